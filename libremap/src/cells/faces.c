/* faces -- pieces of one face between the same two cells put together again: across edges that no other polygon has, if the pieces
 * are exactly coplanar, and if what results has one loop that meets itself nowhere. Volumes do not change. O(n), expected. */
#include "cells/cells_private.h"

#include <string.h>

static rm_lid root(rm_lid *parent, rm_lid k)
{
  while (parent[k] != k) k = parent[k] = parent[parent[k]];
  return k;
}

static bool same_face(const rm_limit *l, int side, rm_lid a, rm_lid b)
{
  if (a < 0 || b < 0) return a == b;
  return rm_face_of_triangle(l->o->mesh[side], a) == rm_face_of_triangle(l->o->mesh[side], b);
}

static bool coplanar(const rm_limit *l, int side, rm_lid a, rm_lid b)
{
  const rm_trimesh *m = l->o->mesh[side];
  const rm_lid     *v = m->triangle[a];

  for (int h = 0; h < 3 && a != b; h++)
    if (rm_orient3d(m->vertex[v[0]], m->vertex[v[1]], m->vertex[v[2]], m->vertex[m->triangle[b][h]]) != 0) return false;
  return true;
}

static bool belong_together(const rm_limit *l, const rm_polygons *p, const rm_glued *g, rm_lid x, rm_lid y)
{
  const rm_polygon *a = &p->polygon[x], *b = &p->polygon[y];
  const int         turned = rm_is_turned(g, x) != rm_is_turned(g, y), side = a->own & 1;

  if (side != (b->own & 1) || g->cell[2 * x] != g->cell[2 * y + turned] || g->cell[2 * x + 1] != g->cell[2 * y + !turned]) return false;
  for (int h = 0; h < 2; h++)
    if (!same_face(l, h, rm_polygon_triangle(a, h), rm_polygon_triangle(b, h))) return false;
  return coplanar(l, side, a->own / 2, b->own / 2);
}

/* Union of polygons across edges; inner marks the edges between them. */
static void join_pieces(const rm_limit *l, const rm_polygons *p, const rm_arcs *arcs, const rm_glued *glued, rm_lid *parent,
                        uint8_t *inner)
{
  for (rm_lid v = 0; v < arcs->num_vertices; v++)
    for (int64_t k = arcs->offset[v], end; k < arcs->offset[v + 1]; k = end) {
      const rm_arc *arc = arcs->arc + k;
      for (end = k + 1; end < arcs->offset[v + 1] && arcs->arc[end].high == arc->high;) end++;
      if (end != k + 2 || !belong_together(l, p, glued, arc[0].polygon / 2, arc[1].polygon / 2)) continue;
      const rm_lid a = root(parent, arc[0].polygon / 2), b = root(parent, arc[1].polygon / 2);
      if (a < b) parent[b] = a;
      else parent[a] = b;
      for (int h = 0; h < 2; h++) inner[p->polygon[arc[h].polygon / 2].first + arc[h].place] = 1;
    }
}

remap_status rm_faces_build(rm_arena *arena, rm_arena *passing, const rm_limit *l, const rm_polygons *p, const rm_arcs *arcs,
                            const rm_glued *glued, rm_faces *out)
{
  rm_lid  *parent, *member;
  int64_t *offset;
  uint8_t *inner;

  RM_NEW(parent, passing, p->num);
  RM_NEW(member, arena, p->num);
  RM_NEW0(offset, arena, p->num + 2);
  RM_NEW0(inner, arena, p->num_vertices);
  RM_NEW(out->next, arena, l->num_spots);
  for (rm_lid s = 0; s < l->num_spots; s++) out->next[s] = -1;
  for (rm_lid k = 0; k < p->num; k++) parent[k] = k;
  join_pieces(l, p, arcs, glued, parent, inner);
  out->num = 0;
  for (rm_lid k = 0; k < p->num; k++) { /* from parents, which are lower, to groups */
    parent[k] = parent[k] == k ? (rm_lid)out->num++ : parent[parent[k]];
    offset[parent[k] + 2]++;
  }
  for (rm_lid k = 0; k < out->num; k++) offset[k + 2] += offset[k + 1];
  for (rm_lid k = 0; k < p->num; k++) member[offset[parent[k] + 1]++] = k;
  out->offset = offset;
  out->member = member;
  out->inner  = inner;
  return REMAP_OK;
}

/* ---- loops ---------------------------------------------------------------------------------------------------------------- */

/* Link the sides of all members, from vertex to vertex, and count them; false if two begin at one vertex. */
static bool link_sides(const rm_faces *faces, const rm_polygons *p, const rm_glued *glued, int64_t group, rm_lid *sides, rm_lid *first)
{
  bool simple = true;

  *sides = 0;
  for (int64_t i = faces->offset[group]; i < faces->offset[group + 1]; i++) {
    const rm_polygon *g      = &p->polygon[faces->member[i]];
    const rm_lid     *v      = p->vertex + g->first, n = rm_polygon_size(g);
    const bool        turned = rm_is_turned(glued, faces->member[i]);

    for (rm_lid k = 0; k < n; k++) {
      const rm_lid from = v[turned ? (k + 1) % n : k], to = v[turned ? k : (k + 1) % n];
      if (faces->inner[g->first + k]) continue;
      simple            = simple && faces->next[from] < 0;
      faces->next[from] = to;
      *first            = from;
      ++*sides;
    }
  }
  return simple;
}

static void unlink_sides(const rm_faces *faces, const rm_polygons *p, int64_t group)
{
  for (int64_t i = faces->offset[group]; i < faces->offset[group + 1]; i++) {
    const rm_polygon *g = &p->polygon[faces->member[i]];
    for (int64_t k = g[0].first; k < g[1].first; k++) faces->next[p->vertex[k]] = -1;
  }
}

rm_lid rm_face_loop(const rm_faces *faces, const rm_polygons *p, const rm_glued *glued, int64_t k, rm_lid *loop)
{
  rm_lid sides, first = -1, num = 0;
  bool   simple = link_sides(faces, p, glued, k, &sides, &first);

  for (rm_lid v = first; simple && num < sides; v = faces->next[v]) {
    loop[num++] = v;
    simple      = faces->next[v] >= 0 && (faces->next[v] == first) == (num == sides);
  }
  unlink_sides(faces, p, k);
  return simple && num >= 3 ? num : 0;
}
