/* caps -- triangles without area whose three corners are distinct and on a line, as CAD programs leave them along edges: the
 * middle corner splits the longest side of the neighbour. Flipping that side puts two triangles with area in place of the two,
 * over the same points. Linear in the faces for each pass; a pass flips all that do not touch each other. */
#include "surface_private.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_PASSES = 50 };

/* The corner of a triangle that lies between the others; -1: it has area, or two corners are in one place. */
static int middle_of(const double *xyz, const int64_t *t)
{
  const double *a = xyz + 3 * t[0], *b = xyz + 3 * t[1], *c = xyz + 3 * t[2];

  for (int axis = 0; axis < 3; axis++)
    if (rs_turn(a, b, c, axis)) return -1;
  for (int v = 0; v < 3; v++) {
    const double *p = xyz + 3 * t[(v + 1) % 3], *q = xyz + 3 * t[(v + 2) % 3], *m = xyz + 3 * t[v];

    for (int k = 0; k < 3; k++)
      if ((p[k] < m[k] && m[k] < q[k]) || (q[k] < m[k] && m[k] < p[k])) return v;
  }
  return -1;
}

/* The face of a side. */
static int64_t face_of(const rsurf_surface *s, int64_t side)
{
  int64_t lo = 0, hi = s->num_faces;

  while (hi - lo > 1) {
    const int64_t mid = lo + (hi - lo) / 2;

    if (s->face_offset[mid] <= side)
      lo = mid;
    else
      hi = mid;
  }
  return lo;
}

/* Is there an edge between two nodes? */
static bool has_edge(const rs_edges *e, int64_t a, int64_t b)
{
  return ra_map_find(&e->map, (int64_t[2]){a < b ? a : b, a < b ? b : a}) >= 0;
}

/* Flip the longest side of cap f, whose middle corner is v, if the face behind it is a triangle that nobody has changed. */
static bool flip(rsurf_surface *s, const rs_edges *e, int64_t f, int v, uint8_t *changed)
{
  int64_t      *cap  = s->face_node + s->face_offset[f];
  const int64_t side = s->face_offset[f] + (v + 1) % 3, edge = e->of_side[side];
  const int64_t other = e->side[edge][0] == side ? e->side[edge][1] : e->side[edge][0];
  const int64_t m = cap[v], p = cap[(v + 1) % 3], q = cap[(v + 2) % 3];
  int64_t      *loop, g, far;
  int           at;

  if (e->count[edge] != 2 || changed[f]) return false;
  g = face_of(s, other);
  if (g == f || changed[g] || s->face_offset[g + 1] - s->face_offset[g] != 3) return false;
  loop = s->face_node + s->face_offset[g];
  at   = (int)(other - s->face_offset[g]);
  far  = loop[(at + 2) % 3];
  if (far == m || has_edge(e, m, far)) return false;
  changed[f] = changed[g] = 1;
  s->face_group[f]        = s->face_group[g];
  memcpy(cap, (int64_t[3]){m, p, far}, 3 * sizeof *cap);
  memcpy(loop, (int64_t[3]){m, far, q}, 3 * sizeof *loop);
  return true;
}

rsurf_status rs_flip_caps(rsurf_surface *s, const double *xyz, rsurf_repairs *repairs, rsurf_message *message)
{
  uint8_t     *changed = ra_zeros(s->num_faces, 1);
  int64_t      flipped = 1;
  rsurf_status status  = changed ? RSURF_OK : rs_no_memory(message);

  for (int pass = 0; pass < MOST_PASSES && flipped && status == RSURF_OK; pass++) {
    rs_edges e     = {.count = NULL};
    bool     found = false;

    flipped = 0;
    for (int64_t f = 0; f < s->num_faces && !found; f++)
      found = s->face_offset[f + 1] - s->face_offset[f] == 3 && middle_of(xyz, s->face_node + s->face_offset[f]) >= 0;
    if (!found) break;
    memset(changed, 0, (size_t)s->num_faces);
    if (!rs_find_edges(s, &e)) status = rs_no_memory(message);
    for (int64_t f = 0; f < s->num_faces && status == RSURF_OK; f++) {
      const bool is_triangle = s->face_offset[f + 1] - s->face_offset[f] == 3;
      const int  v           = is_triangle ? middle_of(xyz, s->face_node + s->face_offset[f]) : -1;

      if (v >= 0 && flip(s, &e, f, v, changed)) flipped++;
    }
    repairs->faces_flipped += flipped;
    rs_edges_drop(&e);
  }
  free(changed);
  return status;
}
