/* check -- tests every invariant of the cells: loops, closed cells, edges of a cell in two of its faces or paired along a
 * contact, volumes. O(n log n). */
#include "cells/cells.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool loops_are_right(const rm_cells *m, rm_lid *seen)
{
  if (m->num_faces && m->face_offset[0] != 0) return false;
  for (rm_lid v = 0; v < m->num_vertices; v++) seen[v] = -1;
  for (rm_lid f = 0; f < m->num_faces; f++) {
    if (m->face_offset[f + 1] - m->face_offset[f] < 3) return false;
    if (m->face_cell[f][0] < 0 || m->face_cell[f][0] >= m->num_cells || m->face_cell[f][1] < -1 - m->num_beyond) return false;
    if (m->face_cell[f][1] >= m->num_cells || m->face_cell[f][0] == m->face_cell[f][1]) return false;
    if (m->face_own[f] < -m->num_shared) return false;
    for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++) {
      const rm_lid v = m->face_vertex[k];
      if (v < 0 || v >= m->num_vertices || seen[v] == f) return false;
      seen[v] = f;
    }
  }
  for (rm_lid v = 0; v < m->num_vertices; v++)
    if (seen[v] < 0) return false;
  return true;
}

/* One use of an edge by a cell's face. */
typedef struct use {
  rm_lid cell, low, high;
  int    way;
} use;

static int by_cell_and_edge(const void *a, const void *b)
{
  const use *x = a, *y = b;
  if (x->cell != y->cell) return x->cell < y->cell ? -1 : 1;
  if (x->low != y->low) return x->low < y->low ? -1 : 1;
  return (x->high > y->high) - (x->high < y->high);
}

/* Every edge of a cell is used as often one way as the other, mostly once. */
static bool cells_are_closed(const rm_cells *m, use *list)
{
  int64_t n = 0;

  for (rm_lid f = 0; f < m->num_faces; f++)
    for (int h = 0; h < 2; h++)
      for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1] && m->face_cell[f][h] >= 0; k++) {
        const rm_lid a = m->face_vertex[k], b = m->face_vertex[k + 1 < m->face_offset[f + 1] ? k + 1 : m->face_offset[f]];
        list[n++]      = (use){m->face_cell[f][h], a < b ? a : b, a < b ? b : a, (a < b) != h ? 1 : -1};
      }
  qsort(list, (size_t)n, sizeof *list, by_cell_and_edge);
  for (int64_t i = 0, k; i < n; i = k) {
    int sum = 0;
    for (k = i; k < n && by_cell_and_edge(&list[i], &list[k]) == 0; k++) sum += list[k].way;
    if (sum != 0) return false;
  }
  return true;
}

remap_status rm_cells_check(const rm_cells *cells)
{
  rm_arena    *scratch = rm_arena_new();
  rm_lid      *seen    = scratch ? rm_arena_alloc(scratch, cells->num_vertices, sizeof *seen) : NULL;
  use         *list = scratch ? rm_arena_alloc(scratch, 2 * cells->face_offset[cells->num_faces], sizeof *list) : NULL;
  remap_status status = seen && list ? REMAP_OK : REMAP_NO_MEMORY;

  if (status == REMAP_OK && !(loops_are_right(cells, seen) && cells_are_closed(cells, list))) status = REMAP_INTERNAL;
  for (rm_lid c = 0; c < cells->num_cells && status == REMAP_OK; c++)
    if (!(cells->cell_volume[c] > -0x1p-44) || (cells->cell_ancestor[c][0] < 0 && cells->cell_ancestor[c][1] < 0))
      status = REMAP_INTERNAL;
  rm_arena_drop(scratch);
  return status;
}
