/* faces -- pieces of one face between the same two cells put together again: across edges that no other polygon has, if what
 * results has one loop that meets itself nowhere. Pieces that are exactly coplanar leave volumes as they are; others come
 * together only if asked for. O(n), expected. */
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

/* What decides which pieces come together. */
typedef struct grouping {
  const rm_limit    *l;
  const rm_polygons *p;
  const rm_arcs     *arcs;
  const rm_glued    *glued;
  const uint8_t     *plane_only; /* [num polygons] the polygon joins coplanar ones alone; NULL: all do */
} grouping;

static bool belong_together(const grouping *g, rm_lid x, rm_lid y)
{
  const rm_polygon *a = &g->p->polygon[x], *b = &g->p->polygon[y];
  const rm_lid     *cell   = g->glued->cell;
  const int         turned = rm_is_turned(g->glued, x) != rm_is_turned(g->glued, y), side = a->own & 1;

  if (side != (b->own & 1) || cell[2 * x] != cell[2 * y + turned] || cell[2 * x + 1] != cell[2 * y + !turned]) return false;
  for (int h = 0; h < 2; h++)
    if (!same_face(g->l, h, rm_polygon_triangle(a, h), rm_polygon_triangle(b, h))) return false;
  if (g->plane_only && !g->plane_only[x] && !g->plane_only[y]) return true;
  return coplanar(g->l, side, a->own / 2, b->own / 2);
}

/* Union of polygons across edges; inner marks the edges between them. */
static void join_pieces(const grouping *g, rm_lid *parent, uint8_t *inner)
{
  const rm_arcs *arcs = g->arcs;

  for (rm_lid v = 0; v < arcs->num_vertices; v++)
    for (rm_lid k = 0, end, num = rm_arcs_at(arcs, v); k < num; k = end) {
      const rm_arc *arc = arcs->arc + k;
      for (end = k + 1; end < num && arcs->arc[end].high == arc->high;) end++;
      if (end != k + 2 || !belong_together(g, arc[0].polygon / 2, arc[1].polygon / 2)) continue;
      const rm_lid a = root(parent, arc[0].polygon / 2), b = root(parent, arc[1].polygon / 2);
      if (a < b) parent[b] = a;
      else parent[a] = b;
      for (int h = 0; h < 2; h++) inner[g->p->polygon[arc[h].polygon / 2].first + arc[h].place] = 1;
    }
}

/* The groups. parent becomes the group of each polygon. */
static remap_status group_pieces(rm_arena *arena, const grouping *g, rm_lid *parent, rm_faces *out)
{
  const rm_polygons *p = g->p;
  rm_lid            *member;
  int64_t           *offset;
  uint8_t           *inner;

  RM_NEW(member, arena, p->num);
  RM_NEW0(offset, arena, p->num + 2);
  RM_NEW0(inner, arena, p->num_vertices);
  for (rm_lid k = 0; k < p->num; k++) parent[k] = k;
  join_pieces(g, parent, inner);
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

/* ---- warped groups ----------------------------------------------------------------------------------------------- */

enum { CANDIDATES = 6 };

/* Groups that have been at all sides of a group so far. */
typedef struct company {
  rm_lid other[CANDIDATES];
  bool   any; /* a side has been seen */
} company;

/* Leave in the company of group g those that are at the present edge too. */
static void meet(company *c, rm_lid g, const rm_lid *present, rm_lid n)
{
  rm_lid kept = 0, was[CANDIDATES];

  memcpy(was, c->other, sizeof was);
  for (int i = 0; i < CANDIDATES; i++) c->other[i] = -1;
  for (rm_lid k = 0; k < n && kept < CANDIDATES; k++) {
    bool stays = present[k] != g && !c->any;
    for (int i = 0; i < CANDIDATES && c->any; i++) stays = stays || (was[i] >= 0 && was[i] == present[k]);
    for (rm_lid i = 0; i < kept; i++) stays = stays && c->other[i] != present[k];
    if (stays) c->other[kept++] = present[k];
  }
  c->any = true;
}

/* Mark groups all of whose sides are sides of one other group too: as polygons of one loop they would leave nothing between
 * them. */
static remap_status mark_enclosed(rm_arena *passing, const grouping *g, const rm_lid *group_of, const rm_faces *faces,
                                  uint8_t *bad)
{
  const rm_arcs *arcs = g->arcs;
  company       *list;
  rm_lid         around[CANDIDATES + 1];

  RM_NEW0(list, passing, faces->num);
  for (rm_lid v = 0; v < arcs->num_vertices; v++)
    for (rm_lid k = 0, end, num = rm_arcs_at(arcs, v); k < num; k = end) {
      rm_lid n = 0;
      for (end = k; end < num && arcs->arc[end].high == arcs->arc[k].high; end++)
        if (n <= CANDIDATES) around[n++] = group_of[arcs->arc[end].polygon / 2];
      if (faces->inner[g->p->polygon[arcs->arc[k].polygon / 2].first + arcs->arc[k].place]) continue;
      for (rm_lid i = 0; i < n; i++) meet(&list[around[i]], around[i], around, n);
    }
  for (rm_lid k = 0; k < faces->num; k++) bad[k] |= list[k].other[0] >= 0 && list[k].any;
  return REMAP_OK;
}

/* Twice the area of a polygon, as a vector along the normal out of its lower cell. */
static void area_vector(const grouping *g, rm_lid k, double out[3])
{
  const rm_polygon *of = &g->p->polygon[k];
  const rm_lid     *v  = g->p->vertex + of->first;
  const double     *o  = g->l->xyz[v[0]], sign = rm_is_turned(g->glued, k) ? -1 : 1;

  out[0] = out[1] = out[2] = 0;
  for (rm_lid i = 1; i + 1 < rm_polygon_size(of); i++) {
    double a[3], b[3];
    for (int c = 0; c < 3; c++) a[c] = g->l->xyz[v[i]][c] - o[c], b[c] = g->l->xyz[v[i + 1]][c] - o[c];
    for (int c = 0; c < 3; c++) out[c] += sign * (a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3]);
  }
}

/* True if all pieces of the group show the same side along the mean of their normals. */
static bool is_without_folds(const grouping *g, const rm_faces *faces, int64_t k)
{
  double sum[3] = {0, 0, 0}, a[3];

  for (int64_t i = faces->offset[k]; i < faces->offset[k + 1]; i++) {
    area_vector(g, faces->member[i], a);
    for (int c = 0; c < 3; c++) sum[c] += a[c];
  }
  for (int64_t i = faces->offset[k]; i < faces->offset[k + 1]; i++) {
    area_vector(g, faces->member[i], a);
    if (!(a[0] * sum[0] + a[1] * sum[1] + a[2] * sum[2] > 0)) return false;
  }
  return true;
}

/* Polygons of groups that are no faces join only what is coplanar. */
static remap_status refuse_groups(rm_arena *passing, const grouping *g, const rm_lid *group_of, const rm_faces *faces,
                                  uint8_t *plane_only)
{
  uint8_t *bad;
  rm_lid  *loop;

  RM_NEW0(bad, passing, faces->num);
  RM_NEW(loop, passing, g->p->num_vertices);
  RM_TRY(mark_enclosed(passing, g, group_of, faces, bad));
  for (int64_t k = 0; k < faces->num; k++) {
    if (faces->offset[k + 1] == faces->offset[k] + 1) continue;
    if (bad[k] || !is_without_folds(g, faces, k) || !rm_face_loop(faces, g->p, g->glued, k, loop)) bad[k] = 1;
    for (int64_t i = faces->offset[k]; i < faces->offset[k + 1]; i++) plane_only[faces->member[i]] = bad[k];
  }
  return REMAP_OK;
}

remap_status rm_faces_build(rm_arena *arena, rm_arena *passing, const rm_limit *l, const rm_polygons *p, const rm_arcs *arcs,
                            const rm_glued *glued, bool warped, rm_faces *out)
{
  grouping g = {l, p, arcs, glued, NULL};
  rm_lid  *parent;
  uint8_t *plane_only;

  RM_NEW(parent, passing, p->num);
  RM_NEW(out->next, arena, l->num_spots);
  for (rm_lid s = 0; s < l->num_spots; s++) out->next[s] = -1;
  if (warped) {
    RM_NEW0(plane_only, passing, p->num);
    g.plane_only = plane_only;
    RM_TRY(group_pieces(passing, &g, parent, out));
    RM_TRY(refuse_groups(passing, &g, parent, out, plane_only));
  }
  return group_pieces(arena, &g, parent, out);
}

/* ---- loops ------------------------------------------------------------------------------------------------------- */

/* Link the sides of all members, from vertex to vertex, and count them; false if two begin at one vertex. */
static bool link_sides(const rm_faces *faces, const rm_polygons *p, const rm_glued *glued, int64_t group, rm_lid *sides,
                       rm_lid *first)
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
