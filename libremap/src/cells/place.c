/* place -- where arcs of a triangle's graph lie in the other mesh: on which of its triangles and edges, and in which cell
 * what is left of an arc along one of its edges. Turning about the edge, the triangle that is met first tells. All signs are
 * exact. O(1) for what has few triangles around it. */
#include "cells/cells_private.h"

bool rm_both_on_edge(const rm_limit *l, int side, rm_lid t, rm_lid p, rm_lid q)
{
  const rm_lid *e = l->mesh[side]->triangle_edge[t];

  for (int h = 0; h < 3; h++)
    if (rm_on_edge(l, side, p, e[h]) && rm_on_edge(l, side, q, e[h])) return true;
  return false;
}

bool rm_carrier(const rm_limit *l, int side, rm_lid p, rm_lid q, rm_lid *triangle, rm_lid *edge)
{
  const rm_trimesh *m = l->mesh[side];
  const rm_feature  f = l->spot[p].at[side], g = l->spot[q].at[side];
  rm_lid            first = 0, last = 1;

  *triangle = *edge = -1;
  if (f.kind == RM_ON_NOTHING || g.kind == RM_ON_NOTHING) return false;
  if (f.kind == RM_ON_TRIANGLE) {
    *triangle = rm_in_triangle(l, side, g, f.id) && rm_is_present(l, side, f.id) ? f.id : -1;
    return *triangle >= 0;
  }
  if (f.kind == RM_ON_VERTEX) first = m->vertex_edge_offset[f.id], last = m->vertex_edge_offset[f.id + 1];
  for (rm_lid k = first; k < last; k++) {
    const rm_lid e = f.kind == RM_ON_VERTEX ? m->vertex_edge[k] : f.id;
    for (rm_lid z = m->star_offset[e]; z < m->star_offset[e + 1]; z++) {
      const rm_lid t = l->first_copy[side][m->star[z] / 4];
      if (!rm_is_present(l, side, t)) continue;
      if (rm_on_edge(l, side, q, e)) {
        *edge = e, *triangle = t;
        return true;
      }
      if (*triangle < 0 && rm_in_triangle(l, side, g, t)) *triangle = t;
    }
  }
  if (*triangle >= 0) /* the common edge may be the one across the vertex */
    for (int h = 0; h < 3; h++) {
      const rm_lid e = m->triangle_edge[*triangle][h];
      if (rm_on_edge(l, side, p, e) && rm_on_edge(l, side, q, e)) *edge = e;
    }
  return *triangle >= 0;
}

/* ---- around an edge of the other mesh ---------------------------------------------------------------------------- */

/* A corner of the triangle on the left of the line from a to b in its plane. */
static const double *corner_left_of(const rm_limit *l, int side, rm_lid t, const double a[3], const double b[3])
{
  const rm_trimesh *m = l->mesh[side];
  const rm_lid     *v = m->triangle[t];
  double            o[3];

  rm_off_plane(m->vertex[v[0]], m->vertex[v[1]], m->vertex[v[2]], o);
  for (int h = 0; h < 3; h++)
    if (rm_orient3d(a, b, m->vertex[v[h]], o) > 0) return m->vertex[v[h]];
  return NULL;
}

/* True if x and y, in one plane with the line f0 f1, are on the same side of it. */
static bool same_side(const double f0[3], const double f1[3], const double x[3], const double y[3])
{
  double o[3];
  return rm_off_plane(f0, f1, x, o) && rm_orient3d(o, f0, f1, x) == rm_orient3d(o, f0, f1, y);
}

/* The half-plane from f to x among the triangles of the other mesh around edge f: the triangle it lies in, or the cell. */
static bool place_around(const rm_limit *l, int side, rm_lid f, const double x[3], rm_lid *triangle, rm_lid *cell)
{
  const rm_trimesh *m = l->mesh[1 - side];
  const double     *f0 = m->vertex[m->edge[f][0]], *f1 = m->vertex[m->edge[f][1]], *nearest = NULL;
  int               nearest_quarter = 0;

  *triangle = -1;
  for (rm_lid z = m->star_offset[f]; z < m->star_offset[f + 1]; z++) {
    const rm_lid  b = m->star[z] / 4;
    const int     h = m->star[z] & 3;
    const double *y = m->vertex[m->triangle[b][h == 0 ? 2 : h == 1 ? 0 : 1]];
    int           quarter;

    if (!rm_is_present(l, 1 - side, b)) continue;
    const int s = rm_orient3d(f0, f1, x, y);
    if (s == 0 && same_side(f0, f1, x, y)) {
      *triangle = b;
      return true;
    }
    quarter = s > 0 ? 0 : s == 0 ? 1 : 2;
    if (nearest && (quarter > nearest_quarter || (quarter == nearest_quarter && rm_orient3d(f0, f1, y, nearest) <= 0)))
      continue;
    nearest         = y;
    nearest_quarter = quarter;
    *cell           = l->cell[1 - side][b][h == 2 ? 1 : 0]; /* the side that is met first, turning about f */
  }
  return nearest != NULL;
}

bool rm_place_left(const rm_limit *l, int side, rm_lid t, rm_lid p, rm_lid q, rm_lid f, rm_lid *triangle, rm_lid *cell)
{
  const rm_trimesh *m = l->mesh[1 - side];
  const double     *f0 = m->vertex[m->edge[f][0]], *f1 = m->vertex[m->edge[f][1]];
  int               sign = 0;

  for (int k = 0; k < 3 && !sign; k++) /* the direction of the arc along f */
    if (f0[k] != f1[k]) sign = rm_compare(l, q, p, k) * (f1[k] > f0[k] ? 1 : -1);
  const double *x = sign > 0 ? corner_left_of(l, side, t, f0, f1) : corner_left_of(l, side, t, f1, f0);
  return x && place_around(l, side, f, x, triangle, cell);
}
