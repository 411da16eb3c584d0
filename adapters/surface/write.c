/* write -- surfaces as text with all digits: OBJ, or STL, whose binary kind holds single precision only. Linear. */
#include "surface_private.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
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

/* The faces in the order of their groups; first [num_groups + 1] says where each begins. The caller frees; NULL: no memory. */
static int64_t *by_group(const rsurf_surface *s, int64_t **first)
{
  int64_t *face = rs_alloc(s->num_faces, sizeof *face), *at = rs_alloc(s->num_groups + 2, sizeof *at);

  for (int64_t f = 0; face && at && f < s->num_faces; f++) at[s->face_group[f] + 2]++;
  for (int32_t g = 0; face && at && g < s->num_groups; g++) at[g + 2] += at[g + 1];
  for (int64_t f = 0; face && at && f < s->num_faces; f++) face[at[s->face_group[f] + 1]++] = f;
  if (!face || !at) {
    free(face);
    free(at);
    return NULL;
  }
  *first = at;
  return face;
}

static void write_polygon(FILE *out, const rsurf_surface *s, int64_t f)
{
  fputc('f', out);
  for (int64_t i = s->face_offset[f]; i < s->face_offset[f + 1]; i++) fprintf(out, " %lld", (long long)s->face_node[i] + 1);
  fputc('\n', out);
}

/* Groups with faces, one after the other: solids of STL, groups of OBJ. */
static rsurf_status write_groups(FILE *out, const rsurf_surface *s, bool is_stl, rsurf_message *message)
{
  int64_t *first, *face = by_group(s, &first);

  if (!face) return rs_no_memory(message);
  for (int32_t g = 0; g < s->num_groups; g++) {
    if (first[g] == first[g + 1]) continue;
    fprintf(out, "%s %s\n", is_stl ? "solid" : "g", s->group_name[g]);
    for (int64_t i = first[g]; i < first[g + 1]; i++) (is_stl ? write_facet : write_polygon)(out, s, face[i]);
    if (is_stl) fprintf(out, "endsolid %s\n", s->group_name[g]);
  }
  free(face);
  free(first);
  return RSURF_OK;
}

static rsurf_status check_triangles(const char *path, const rsurf_surface *s, rsurf_message *message)
{
  for (int64_t f = 0; f < s->num_faces; f++)
    if (s->face_offset[f + 1] - s->face_offset[f] != 3)
      return rs_fail(message, RSURF_USAGE, "%s: a polygon of %lld corners cannot be written as STL: write OBJ", path,
                     (long long)(s->face_offset[f + 1] - s->face_offset[f]));
  return RSURF_OK;
}

rsurf_status rsurf_write(FILE *out, const char *path, const rsurf_surface *surface, rsurf_message *message)
{
  const size_t n      = strlen(path);
  const bool   is_stl = n && (path[n - 1] == 'l' || path[n - 1] == 'L');

  message->text[0] = 0;
  if (!rsurf_is_path(path)) return rs_fail(message, RSURF_USAGE, "%s: a surface is written as .stl or .obj: rename it", path);
  if (is_stl) RS_TRY(check_triangles(path, surface, message));
  for (int64_t i = 0; i < surface->num_nodes && !is_stl; i++)
    fprintf(out, "v %.17g %.17g %.17g\n", surface->node_xyz[3 * i], surface->node_xyz[3 * i + 1], surface->node_xyz[3 * i + 2]);
  RS_TRY(write_groups(out, surface, is_stl, message));
  return fflush(out) || ferror(out) ? rs_fail(message, RSURF_IO, "%s: it cannot be written: is the disk full?", path)
                                    : RSURF_OK;
}
