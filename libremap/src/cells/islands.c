/* islands -- the parts of a planar graph that hang together: the cycle around each of them but the boundary is a hole of the
 * polygon that it lies in, which a sweep finds. O(a log a) for a arcs, O(a) where all hang together. */
#include "cells/cells_private.h"

#include <math.h>

/* Twice the area of a cycle, rounded. */
static double cycle_area(const rm_graph *g, rm_lid first)
{
  const double (*xyz)[3] = (const double (*)[3])g->view.l->xyz, *o = xyz[g->spot[g->half[first].from]];
  double        area = 0;
  rm_lid        h = first;

  do {
    const double *p = xyz[g->spot[g->half[h].from]], *q = xyz[g->spot[rm_end_of(g, h)]];
    const int     x = g->view.x, y = g->view.y;
    area += (p[x] - o[x]) * (q[y] - o[y]) - (p[y] - o[y]) * (q[x] - o[x]);
    h = g->half[h].next;
  } while (h != first);
  return g->view.flip * area;
}

static rm_lid root(rm_lid *parent, rm_lid k)
{
  while (parent[k] != k) k = parent[k] = parent[parent[k]];
  return k;
}

/* A part of the graph apart from the boundary. */
typedef struct island {
  rm_lid root;  /* node                                           */
  rm_lid first; /* spot that a line from the left comes to first  */
  rm_lid shore; /* the cycle around it                            */
} island;

/* The islands, in the order in which a line from the left comes to them; of[node] is the island of a root, -1. */
static remap_status find_islands(rm_graph *g, rm_arena *arena, const rm_lid *parent, rm_lid num, island **out, rm_lid *of)
{
  island *list, *sorted;
  rm_lid *first, *order;
  double *area;

  RM_NEW(list, arena, num);
  RM_NEW(sorted, arena, num);
  RM_NEW(first, arena, num);
  RM_NEW(area, arena, num);
  num = 0;
  for (rm_lid k = 0; k < g->num_nodes; k++) {
    of[k] = k && parent[k] == k ? num : -1;
    if (of[k] >= 0) area[num] = INFINITY, list[num++] = (island){k, g->spot[k], -1};
  }
  for (rm_lid k = 0; k < g->num_nodes; k++) {
    island *x = parent[k] ? &list[of[parent[k]]] : NULL;
    if (x && rm_sweep_compare(&g->view, g->spot[k], x->first) < 0) x->first = g->spot[k];
  }
  for (rm_lid c = 0; c < g->num_cycles; c++) { /* the one that runs clockwise */
    const rm_lid x = of[parent[g->half[g->cycle[c].half].from]];
    const double a = x >= 0 ? cycle_area(g, g->cycle[c].half) : 0;
    if (x >= 0 && a < area[x]) area[x] = a, list[x].shore = c;
  }
  for (rm_lid k = 0; k < num; k++) first[k] = list[k].first;
  RM_TRY(rm_sweep_order(arena, &g->view, num, first, &order));
  for (rm_lid k = 0; k < num; k++) sorted[k] = list[order[k]], of[sorted[k].root] = k;
  *out = sorted;
  return REMAP_OK;
}

/* The cycle above arc k. */
static rm_lid cycle_above(const rm_graph *g, rm_lid k)
{
  const rm_lid h = 2 * k;
  return g->half[rm_sweep_compare(&g->view, g->spot[g->half[h].from], g->spot[rm_end_of(g, h)]) < 0 ? h : h + 1].cycle;
}

/* Each island is a hole of the polygon above the edge that is below its first spot; if that is another's shore, it is in the
 * same polygon. */
static remap_status place_islands(rm_graph *g, rm_arena *arena, const island *list, rm_lid num)
{
  const rm_lid arcs = g->num_halves / 2;
  rm_lid     (*edge)[2], *query, *below;

  RM_NEW(edge, arena, arcs);
  RM_NEW(query, arena, num);
  RM_NEW(below, arena, num);
  for (rm_lid k = 0; k < arcs; k++)
    for (int h = 0; h < 2; h++) edge[k][h] = g->spot[g->half[2 * k + h].from];
  for (rm_lid k = 0; k < num; k++) {
    query[k]                       = list[k].first;
    g->cycle[list[k].shore].inside = g->num_cycles; /* not known yet */
  }
  RM_TRY(rm_edges_below(arena, &g->view, arcs, (const rm_lid (*)[2])edge, num, query, below));
  for (rm_lid k = 0; k < num; k++) {
    rm_cycle *hole   = &g->cycle[list[k].shore];
    rm_lid    around = below[k] < 0 ? -1 : cycle_above(g, below[k]);

    if (around >= 0 && g->cycle[around].inside >= 0) around = g->cycle[around].inside;
    if (around < 0 || around == g->num_cycles) return REMAP_BAD_MESH;
    hole->inside                = around;
    hole->next_hole             = g->cycle[around].first_hole;
    g->cycle[around].first_hole = list[k].shore;
    if (g->cycle[around].state == RM_UNKNOWN) g->cycle[around].state = hole->state;
  }
  return REMAP_OK;
}

remap_status rm_find_holes(rm_graph *g)
{
  rm_lid *parent, *of, num = 0;
  island *list;

  parent = g->component;
  for (rm_lid k = 0; k < g->num_nodes; k++) parent[k] = k;
  for (rm_lid h = 0; h < g->num_halves; h += 2) {
    const rm_lid a = root(parent, g->half[h].from), b = root(parent, rm_end_of(g, h));
    if (a < b) parent[b] = a;
    else parent[a] = b;
  }
  for (rm_lid k = 1; k < g->num_nodes; k++) num += root(parent, k) == k;
  if (!num) return REMAP_OK;
  for (rm_lid k = 1; k < g->num_nodes; k++) parent[k] = root(parent, k);

  rm_arena    *arena  = rm_arena_new();
  remap_status status = arena && (of = rm_arena_alloc(arena, g->num_nodes, sizeof *of)) ? REMAP_OK : REMAP_NO_MEMORY;
  if (status == REMAP_OK) status = find_islands(g, arena, parent, num, &list, of);
  if (status == REMAP_OK) status = place_islands(g, arena, list, num);
  rm_arena_drop(arena);
  return status;
}
