/* arcs -- edges of polygons, found vertex by vertex: filed are only the polygons at each vertex that have an edge from it to
 * a higher one, 4 bytes each; the edges are read from their loops and sorted when they are asked for, among the few of one
 * vertex. */
#include "cells/cells_private.h"

#include <stdlib.h>

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

remap_status rm_arcs_build(rm_arena *arena, rm_lid num_vertices, const rm_polygons *p, rm_arcs *out)
{
  int64_t *offset, longest = 0;
  rm_lid  *polygon = NULL;

  if (p->num >= 1 << 30) return REMAP_TOO_LARGE;
  RM_NEW0(offset, arena, (int64_t)num_vertices + 2);
  for (int pass = 0; pass < 2; pass++) {
    for (rm_lid g = 0; g < p->num; g++) {
      const rm_lid *v = p->vertex + p->polygon[g].first, n = rm_polygon_size(&p->polygon[g]);
      for (rm_lid k = 0; k < n; k++) {
        if (v[k] > v[k ? k - 1 : n - 1] && v[k] > v[k + 1 < n ? k + 1 : 0]) continue;
        if (pass == 0) offset[v[k] + 2]++;
        else polygon[offset[v[k] + 1]++] = g;
      }
    }
    for (rm_lid v = 0; v < num_vertices && pass == 0; v++) {
      longest = offset[v + 2] > longest ? offset[v + 2] : longest;
      offset[v + 2] += offset[v + 1];
    }
    if (pass == 0) RM_NEW(polygon, arena, offset[num_vertices + 1]);
  }
  if (longest > INT32_MAX / 2) return REMAP_TOO_LARGE;
  *out = (rm_arcs){num_vertices, p, offset, polygon, NULL};
  RM_NEW(out->arc, arena, 2 * longest);
  return REMAP_OK;
}

rm_lid rm_arcs_at(const rm_arcs *arcs, rm_lid low)
{
  const rm_polygons *p   = arcs->p;
  rm_lid             num = 0;

  for (int64_t i = arcs->offset[low]; i < arcs->offset[low + 1]; i++) {
    const rm_lid  g = arcs->polygon[i], n = rm_polygon_size(&p->polygon[g]);
    const rm_lid *v = p->vertex + p->polygon[g].first;
    rm_lid        k = 0;

    while (v[k] != low) k++;
    const rm_lid back = k ? k - 1 : n - 1, next = k + 1 < n ? k + 1 : 0;
    if (v[next] > low) arcs->arc[num++] = (rm_arc){v[next], k, 2 * g};
    if (v[back] > low) arcs->arc[num++] = (rm_arc){v[back], back, 2 * g + 1};
  }
  sort_arcs(arcs->arc, num);
  return num;
}
