/* arcs -- edges of polygons, visited vertex by vertex: filed are only the polygons at each vertex that have an edge from it
 * to a higher one, 4 bytes each and for half of the vertices at a time; the edges are read from their loops and sorted among
 * the few of one vertex. */
#include "cells/cells_private.h"

#include <stdlib.h>

enum { PASSES = 2 };

typedef struct work {
  const rm_polygons *p;
  rm_lid             from, to; /* vertices of the present pass                                          */
  rm_lid            *offset;   /* [to - from + 1]                                                       */
  rm_lid            *polygon;  /* ascending at each vertex: those with an edge from it to a higher one  */
  rm_arc            *arc;      /* those of one vertex                                                   */
} work;

static int by_high(const void *a, const void *b)
{
  const rm_arc *x = a, *y = b;
  if (x->high != y->high) return x->high < y->high ? -1 : 1;
  return (x->polygon > y->polygon) - (x->polygon < y->polygon);
}

/* The list ascends by polygon, and stays so where the higher vertex is the same. */
static void sort_arcs(rm_arc *list, rm_lid n)
{
  if (n > 64) {
    qsort(list, (size_t)n, sizeof *list, by_high);
    return;
  }
  for (rm_lid i = 1; i < n; i++) {
    const rm_arc x = list[i];
    rm_lid       k = i;
    for (; k > 0 && list[k - 1].high > x.high; k--) list[k] = list[k - 1];
    list[k] = x;
  }
}

/* Count the polygons at each vertex, offset[2 ...], or file them where offset[1 ...] says. */
static void each_corner(work *w, bool count)
{
  const rm_lid n = w->to - w->from;

  for (rm_lid g = 0; g < w->p->num; g++) {
    const rm_lid *v = rm_polygon_loop(w->p, g), size = rm_polygon_size(w->p, g);
    for (rm_lid k = 0; k < size; k++) {
      const rm_lid at = v[k] - w->from;
      if ((uint32_t)at >= (uint32_t)n || (v[k] > v[k ? k - 1 : size - 1] && v[k] > v[k + 1 < size ? k + 1 : 0])) continue;
      if (count) w->offset[at + 2]++;
      else w->polygon[w->offset[at + 1]++] = g;
    }
  }
}

static remap_status file_polygons(work *w, rm_arena *arena)
{
  const rm_lid n = w->to - w->from;
  rm_lid       longest = 0;
  int64_t      sum     = 0;

  RM_NEW0(w->offset, arena, (int64_t)n + 2);
  each_corner(w, true);
  for (rm_lid v = 0; v < n; v++) {
    longest = w->offset[v + 2] > longest ? w->offset[v + 2] : longest;
    sum += w->offset[v + 2];
    if (sum > INT32_MAX) return REMAP_TOO_LARGE;
    w->offset[v + 2] = (rm_lid)sum;
  }
  RM_NEW(w->polygon, arena, sum);
  RM_NEW(w->arc, arena, 2 * (int64_t)longest);
  each_corner(w, false);
  return REMAP_OK;
}

/* How many edges have this lower vertex; they are in w->arc then, by their higher vertex, then by polygon. */
static rm_lid arcs_at(work *w, rm_lid low)
{
  const rm_polygons *p   = w->p;
  rm_lid             num = 0;

  for (rm_lid i = w->offset[low - w->from]; i < w->offset[low - w->from + 1]; i++) {
    const rm_lid  g = w->polygon[i], n = rm_polygon_size(p, g);
    const rm_lid *v = rm_polygon_loop(p, g);
    rm_lid        k = 0;

    while (v[k] != low) k++;
    const rm_lid back = k ? k - 1 : n - 1, next = k + 1 < n ? k + 1 : 0;
    if (v[next] > low) w->arc[num++] = (rm_arc){v[next], k, 2 * g};
    if (v[back] > low) w->arc[num++] = (rm_arc){v[back], back, 2 * g + 1};
  }
  sort_arcs(w->arc, num);
  return num;
}

static remap_status one_pass(work *w, rm_arena *arena, rm_arc_visitor *visit, void *user)
{
  RM_TRY(file_polygons(w, arena));
  for (rm_lid v = w->from; v < w->to; v++)
    for (rm_lid k = 0, next, num = arcs_at(w, v); k < num; k = next) {
      for (next = k + 1; next < num && w->arc[next].high == w->arc[k].high;) next++;
      RM_TRY(visit(user, v, w->arc + k, next - k));
    }
  return REMAP_OK;
}

remap_status rm_each_edge(rm_lid num_vertices, const rm_polygons *p, rm_arc_visitor *visit, void *user)
{
  remap_status status = REMAP_OK;

  for (int pass = 0; pass < PASSES && status == REMAP_OK; pass++) {
    work      w     = {.p    = p,
                       .from = (rm_lid)((int64_t)num_vertices * pass / PASSES),
                       .to   = (rm_lid)((int64_t)num_vertices * (pass + 1) / PASSES)};
    rm_arena *arena = rm_arena_new();

    status = arena ? one_pass(&w, arena, visit, user) : REMAP_NO_MEMORY;
    rm_arena_drop(arena);
  }
  return status;
}
