/* Any bytes as an STL or OBJ file are refused with a reason, or give a surface; one that can be repaired is closed,
 * manifold and bounds bodies. The first byte chooses the format. */
#include "fuzz.h"
#include "surface.h"

#include <math.h>

/* Every side of a face has one that runs against it: the surface is closed and of one orientation. */
static void check_closed(const rsurf_surface *s)
{
  for (int64_t f = 0; f < s->num_faces; f++)
    for (int64_t i = s->face_offset[f], n = s->face_offset[f + 1]; i < n; i++) {
      const int64_t a = s->face_node[i], b = s->face_node[i + 1 < n ? i + 1 : s->face_offset[f]];
      int           with = 0, against = 0;

      for (int64_t g = 0; g < s->num_faces; g++)
        for (int64_t k = s->face_offset[g], m = s->face_offset[g + 1]; k < m; k++) {
          const int64_t c = s->face_node[k], d = s->face_node[k + 1 < m ? k + 1 : s->face_offset[g]];

          with += a == c && b == d;
          against += a == d && b == c;
        }
      FUZZ_CHECK(with == 1 && against == 1);
    }
}

static void check_read(const rsurf_surface *s)
{
  FUZZ_CHECK(s->num_faces > 0 && s->num_groups > 0 && s->face_offset[0] == 0);
  for (int64_t i = 0; i < 3 * s->num_nodes; i++) FUZZ_CHECK(isfinite(s->node_xyz[i]));
  for (int64_t f = 0; f < s->num_faces; f++) {
    FUZZ_CHECK(s->face_offset[f + 1] >= s->face_offset[f] + 3 && s->face_group[f] < s->num_groups);
    for (int64_t i = s->face_offset[f]; i < s->face_offset[f + 1]; i++)
      FUZZ_CHECK(s->face_node[i] >= 0 && s->face_node[i] < s->num_nodes);
  }
}

void fuzz_one(const uint8_t *data, size_t size)
{
  char          path[64];
  rsurf_surface s = {.num_nodes = 0};
  rsurf_repairs did;
  rsurf_message why;
  rsurf_status  status;
  FILE         *file;

  if (!size) return;
  snprintf(path, sizeof path, "fuzz_surface_%ld.%s", (long)getpid(), *data % 2 ? "stl" : "obj");
  file = fopen(path, "wb");
  FUZZ_CHECK(file && fwrite(data + 1, 1, size - 1, file) == size - 1 && !fclose(file));
  status = rsurf_read(path, 1, &s, &why);
  remove(path);
  FUZZ_CHECK((status == RSURF_OK) == (why.text[0] == 0));
  if (status == RSURF_OK) {
    check_read(&s);
    status = rsurf_repair(&s, path, &did, &why);
    FUZZ_CHECK(status == RSURF_OK || status == RSURF_GEOMETRY);
    FUZZ_CHECK((status == RSURF_OK) == (why.text[0] == 0));
  } else {
    FUZZ_CHECK(status == RSURF_IO);
  }
  if (status == RSURF_OK) {
    fuzz_accepted++;
    FUZZ_CHECK(s.num_bodies >= 1 && did.shells == s.num_bodies + did.voids);
    check_read(&s);
    check_closed(&s);
  }
  rsurf_drop(&s);
}
FUZZ_MAIN
