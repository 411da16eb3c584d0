/* arcs -- edges of polygons, filed under their lower vertex by counting, then sorted by the other among the few of one vertex. */
#include "cells/cells_private.h"

#include <stdlib.h>

static int by_high(const void *a, const void *b)
{
  const rm_arc *x = a, *y = b;
  if (x->high != y->high) return x->high < y->high ? -1 : 1;
  return (x->polygon > y->polygon) - (x->polygon < y->polygon);
}

static void sort_arcs(rm_arc *list, int64_t n)
{
  if (n > 64) {
    qsort(list, (size_t)n, sizeof *list, by_high);
    return;
  }
  for (int64_t i = 1; i < n; i++) {
    const rm_arc x = list[i];
    int64_t      k = i;
    for (; k > 0 && by_high(&list[k - 1], &x) > 0; k--) list[k] = list[k - 1];
    list[k] = x;
  }
}

remap_status rm_arcs_build(rm_arena *arena, rm_lid num_vertices, const rm_polygons *p, rm_arcs *out)
{
  int64_t *offset;
  rm_arc  *arc;

  if (p->num >= 1 << 30) return REMAP_TOO_LARGE;
  RM_NEW0(offset, arena, (int64_t)num_vertices + 2);
  RM_NEW(arc, arena, p->num_vertices);
  for (int pass = 0; pass < 2; pass++) {
    for (rm_lid g = 0; g < p->num; g++) {
      const rm_lid *v = p->vertex + p->polygon[g].first, n = rm_polygon_size(&p->polygon[g]);
      for (rm_lid k = 0; k < n; k++) {
        const rm_lid a = v[k], b = v[k + 1 < n ? k + 1 : 0], low = a < b ? a : b;
        if (pass == 0) offset[low + 2]++;
        else arc[offset[low + 1]++] = (rm_arc){a < b ? b : a, k, 2 * g + (a > b)};
      }
    }
    for (rm_lid v = 0; v < num_vertices && pass == 0; v++) offset[v + 2] += offset[v + 1];
  }
  for (rm_lid v = 0; v < num_vertices; v++) sort_arcs(arc + offset[v], offset[v + 1] - offset[v]);
  *out = (rm_arcs){num_vertices, offset, arc};
  return REMAP_OK;
}
