/* write -- surfaces as text with all digits: OBJ, or STL, whose binary kind holds single precision only. Linear. */
#include "surface_private.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static void write_facet(FILE *out, const rsurf_surface *s, int64_t f)
{
  const int64_t *loop = s->face_node + s->face_offset[f];
  const double  *p[3], *a, *b, *c;
  double         normal[3], length = 0;

  for (int v = 0; v < 3; v++) p[v] = s->node_xyz + 3 * loop[v];
  a = p[0], b = p[1], c = p[2];
  for (int k = 0; k < 3; k++) {
    const int x = (k + 1) % 3, y = (k + 2) % 3;

    normal[k] = (b[x] - a[x]) * (c[y] - a[y]) - (b[y] - a[y]) * (c[x] - a[x]);
    length += normal[k] * normal[k];
  }
  length = length > 0 && isfinite(length) ? sqrt(length) : 1;
  fprintf(out, "facet normal %.9g %.9g %.9g\n outer loop\n", normal[0] / length, normal[1] / length, normal[2] / length);
  for (int v = 0; v < 3; v++) fprintf(out, "  vertex %.17g %.17g %.17g\n", p[v][0], p[v][1], p[v][2]);
  fputs(" endloop\nendfacet\n", out);
}

/* The faces of each group in a solid of its own. */
static rsurf_status write_stl(FILE *out, const char *path, const rsurf_surface *s, rsurf_message *message)
{
  for (int64_t f = 0; f < s->num_faces; f++)
    if (s->face_offset[f + 1] - s->face_offset[f] != 3)
      return rs_fail(message, RSURF_USAGE, "%s: a polygon of %lld corners cannot be written as STL: write OBJ", path,
                     (long long)(s->face_offset[f + 1] - s->face_offset[f]));
  for (int32_t g = 0; g < s->num_groups; g++) {
    fprintf(out, "solid %s\n", s->group_name[g]);
    for (int64_t f = 0; f < s->num_faces; f++)
      if (s->face_group[f] == g) write_facet(out, s, f);
    fprintf(out, "endsolid %s\n", s->group_name[g]);
  }
  return RSURF_OK;
}

static void write_obj(FILE *out, const rsurf_surface *s)
{
  for (int64_t i = 0; i < s->num_nodes; i++)
    fprintf(out, "v %.17g %.17g %.17g\n", s->node_xyz[3 * i], s->node_xyz[3 * i + 1], s->node_xyz[3 * i + 2]);
  for (int32_t g = 0; g < s->num_groups; g++) {
    fprintf(out, "g %s\n", s->group_name[g]);
    for (int64_t f = 0; f < s->num_faces; f++) {
      if (s->face_group[f] != g) continue;
      fputc('f', out);
      for (int64_t i = s->face_offset[f]; i < s->face_offset[f + 1]; i++) fprintf(out, " %lld", (long long)s->face_node[i] + 1);
      fputc('\n', out);
    }
  }
}

rsurf_status rsurf_write(FILE *out, const char *path, const rsurf_surface *surface, rsurf_message *message)
{
  const size_t n = strlen(path);

  message->text[0] = 0;
  if (!rsurf_is_path(path)) return rs_fail(message, RSURF_USAGE, "%s: a surface is written as .stl or .obj: rename it", path);
  if (path[n - 1] == 'l' || path[n - 1] == 'L')
    RS_TRY(write_stl(out, path, surface, message));
  else
    write_obj(out, surface);
  return fflush(out) || ferror(out) ? rs_fail(message, RSURF_IO, "%s: it cannot be written: is the disk full?", path)
                                    : RSURF_OK;
}
