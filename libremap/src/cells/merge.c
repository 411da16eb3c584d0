/* merge -- pieces of one face between the same two cells put together again: across edges that no other polygon has, if the pieces
 * are exactly coplanar, and if what results has one loop that meets itself nowhere. Volumes do not change. O(n), expected. */
#include <stdlib.h>
#include <string.h>

#include "cells/arcs.h"

typedef struct work {
  rm_arena       *scratch;
  const rm_limit *l;
  rm_polygons    *p;
  rm_lid         *cell;   /* [2 num polygons] */
  rm_arcs         arcs;
  rm_lid         *parent; /* [num polygons] */
  uint8_t        *inner;  /* [num_vertices of p] the edge from this place of a loop on is inside */
  rm_lid         *next;   /* [num_spots] along the present loop, -1 */
} work;

/* Turn every polygon so that its normal points out of the lower cell, RM_OUTSIDE being the highest. */
static void turn_polygons(work *w)
{
  for (int64_t k = 0; k < w->p->num; k++) {
    rm_polygon  *g = &w->p->polygon[k];
    rm_lid      *c = &w->cell[2 * k], *v = w->p->vertex + g->first;
    const rm_lid left = c[0];
    if ((uint32_t)c[0] < (uint32_t)c[1]) continue;
    const rm_label label = g->label[0];
    c[0] = c[1], c[1] = left;
    g->label[0] = g->label[1], g->label[1] = label;
    for (rm_lid i = 0, m = g->num - 1; i < m; i++, m--) {
      const rm_lid s = v[i];
      v[i] = v[m], v[m] = s;
    }
  }
}

static rm_lid root(rm_lid *parent, rm_lid k)
{
  while (parent[k] != k) k = parent[k] = parent[parent[k]];
  return k;
}

static bool same_face(const rm_limit *l, int side, rm_lid a, rm_lid b)
{
  if (a < 0 || b < 0) return a == b;
  return l->o->mesh[side]->triangle_face[a] == l->o->mesh[side]->triangle_face[b];
}

static bool coplanar(const rm_limit *l, int side, rm_lid a, rm_lid b)
{
  const rm_trimesh *m = l->o->mesh[side];
  const rm_lid     *v = m->triangle[a];

  for (int h = 0; h < 3 && a != b; h++)
    if (rm_orient3d(m->vertex[v[0]], m->vertex[v[1]], m->vertex[v[2]], m->vertex[m->triangle[b][h]]) != 0) return false;
  return true;
}

static bool belong_together(const work *w, rm_lid x, rm_lid y)
{
  const rm_polygon *a = &w->p->polygon[x], *b = &w->p->polygon[y];
  const int         side = a->triangle[0] >= 0 ? 0 : 1;

  if (w->cell[2 * x] != w->cell[2 * y] || w->cell[2 * x + 1] != w->cell[2 * y + 1]) return false;
  for (int h = 0; h < 2; h++)
    if (!same_face(w->l, h, a->triangle[h], b->triangle[h])) return false;
  return coplanar(w->l, side, a->triangle[side], b->triangle[side]);
}

static remap_status join_pieces(work *w)
{
  RM_TRY(rm_arcs_build(w->scratch, w->l->num_spots, w->p, &w->arcs));
  RM_NEW(w->parent, w->scratch, w->p->num);
  RM_NEW0(w->inner, w->scratch, w->p->num_vertices);
  for (rm_lid k = 0; k < w->p->num; k++) w->parent[k] = k;
  for (int64_t k = 0, end; k < w->arcs.num; k = end) {
    const rm_arc *arc = w->arcs.arc + k;
    for (end = k + 1; end < w->arcs.num && rm_same_arc(&w->arcs.arc[end], arc);) end++;
    if (end != k + 2 || !belong_together(w, arc[0].polygon, arc[1].polygon)) continue;
    const rm_lid a = root(w->parent, arc[0].polygon), b = root(w->parent, arc[1].polygon);
    if (a < b) w->parent[b] = a;
    else w->parent[a] = b;
    for (int h = 0; h < 2; h++) w->inner[w->p->polygon[arc[h].polygon].first + arc[h].place] = 1;
  }
  return REMAP_OK;
}

/* ---- loops ---------------------------------------------------------------------------------------------------------------- */

static remap_status push(rm_polygons *to, const rm_polygon *like, const rm_lid *vertex, rm_lid n)
{
  RM_TRY(rm_grow(&to->polygon, &to->room, to->num + 1, sizeof *to->polygon));
  RM_TRY(rm_grow(&to->vertex, &to->vertex_room, to->num_vertices + n, sizeof *to->vertex));
  to->polygon[to->num]       = *like;
  to->polygon[to->num].first = to->num_vertices;
  to->polygon[to->num].num   = n;
  memcpy(to->vertex + to->num_vertices, vertex, sizeof *vertex * (size_t)n);
  to->num_vertices += n;
  to->num++;
  return REMAP_OK;
}

/* The loop around the pieces piece[0..n), room for all their vertices; 0 if there is not exactly one. */
static rm_lid loop_around(work *w, const rm_lid *piece, rm_lid n, rm_lid *loop)
{
  rm_lid sides = 0, num = 0, first = -1;
  bool   simple = true;

  for (int pass = 0; pass < 2; pass++) { /* link, later unlink */
    if (pass == 1 && simple) {
      rm_lid v = first;
      do {
        loop[num++] = v;
        v           = w->next[v];
      } while (v != first && v >= 0 && num < sides);
      simple = v == first && num == sides;
    }
    for (rm_lid i = 0; i < n; i++) {
      const rm_polygon *g = &w->p->polygon[piece[i]];
      const rm_lid     *v = w->p->vertex + g->first;
      for (rm_lid k = 0; k < g->num; k++) {
        if (w->inner[g->first + k]) continue;
        if (pass == 1) {
          w->next[v[k]] = -1;
          continue;
        }
        simple        = simple && w->next[v[k]] < 0;
        w->next[v[k]] = v[k + 1 < g->num ? k + 1 : 0];
        first         = v[k];
        sides++;
      }
    }
  }
  return simple && num >= 3 ? num : 0;
}

static remap_status rebuild(work *w, rm_polygons *to, rm_lid *new_cell)
{
  rm_lid  *member, *loop;
  int64_t *offset;

  RM_NEW0(offset, w->scratch, w->p->num + 2);
  RM_NEW(member, w->scratch, w->p->num);
  RM_NEW(loop, w->scratch, w->p->num_vertices);
  RM_NEW(w->next, w->scratch, w->l->num_spots);
  for (rm_lid s = 0; s < w->l->num_spots; s++) w->next[s] = -1;
  for (rm_lid k = 0; k < w->p->num; k++) offset[root(w->parent, k) + 2]++;
  for (rm_lid k = 0; k < w->p->num; k++) offset[k + 2] += offset[k + 1];
  for (rm_lid k = 0; k < w->p->num; k++) member[offset[root(w->parent, k) + 1]++] = k;
  for (rm_lid k = 0; k < w->p->num; k++) {
    const rm_lid *piece = member + offset[k], n = (rm_lid)(offset[k + 1] - offset[k]), num = n > 1 ? loop_around(w, piece, n, loop) : 0;

    for (rm_lid i = 0; i < (num ? 1 : n); i++) {
      const rm_polygon *g = &w->p->polygon[piece[i]];
      memcpy(new_cell + 2 * to->num, w->cell + 2 * piece[i], 2 * sizeof *new_cell);
      RM_TRY(push(to, g, num ? loop : w->p->vertex + g->first, num ? num : g->num));
    }
  }
  return REMAP_OK;
}

remap_status rm_merge(rm_arena *arena, const rm_limit *l, rm_polygons *p, rm_glued *glued)
{
  work         w        = {.scratch = rm_arena_new(), .l = l, .p = p};
  rm_polygons  merged   = {0};
  rm_lid      *new_cell = rm_arena_alloc(arena, 2 * p->num, sizeof *new_cell);
  remap_status status   = w.scratch && new_cell ? REMAP_OK : REMAP_NO_MEMORY;

  if (status != REMAP_OK) goto done;
  w.cell = rm_arena_alloc(w.scratch, 2 * p->num, sizeof *w.cell);
  RM_GOTO(done, status = w.cell ? REMAP_OK : REMAP_NO_MEMORY);
  memcpy(w.cell, glued->cell, sizeof *w.cell * 2 * (size_t)p->num);
  turn_polygons(&w);
  RM_GOTO(done, status = join_pieces(&w));
  RM_GOTO(done, status = rebuild(&w, &merged, new_cell));
  glued->cell = new_cell;
  const rm_polygons old = *p;
  *p     = merged;
  merged = old;
done:
  free(merged.polygon);
  free(merged.vertex);
  rm_arena_drop(w.scratch);
  return status;
}
