/* check -- the invariants of a mapping that one rank can see. O(p) time, 4 bytes per giving cell. */
#include "mapping.h"

#include <stdlib.h>

static bool givers_ascend(const rm_rows *rows)
{
  const rm_plan *plan = rows->plan;

  if (plan->recv_offset[plan->num_recv] != rows->num_givers) return false;
  for (rm_lid g = 1; g < rows->num_givers; g++) {
    if (rows->giver_rank[g - 1] > rows->giver_rank[g]) return false;
    if (rows->giver_rank[g - 1] == rows->giver_rank[g] && rows->giver_cell[g - 1] >= rows->giver_cell[g]) return false;
  }
  return true;
}

/* last_row [num_givers], zeroed, remembers 1 + the row that listed a giver last. */
static bool row_holds(const rm_rows *rows, rm_lid cell, double cell_volume, rm_lid *last_row)
{
  const int64_t first = rows->offset[cell], end = rows->offset[cell + 1];

  if (first > end || rows->cover[cell] > REMAP_COVERED) return false;
  if ((first == end) != (rows->cover[cell] == REMAP_UNCOVERED)) return false;
  for (int64_t k = first; k < end; k++) {
    const rm_lid g = rows->giver[k];

    if (g < 0 || g >= rows->num_givers || last_row[g] == cell + 1) return false;
    last_row[g] = cell + 1;
    if (!rows->same[cell]) continue;
    if (rows->cover[cell] != REMAP_COVERED || end - first != 1) return false;
    if (rows->volume && rows->volume[k] != cell_volume) return false;
    for (int d = 0; d < 3 && rows->moment; d++)
      if (rows->moment[k][d] != 0.0) return false;
  }
  return true;
}

remap_status rm_mapping_check(const rm_mapping *mapping, const rm_mesh *const mesh[2])
{
  for (int side = 0; side < 2; side++) {
    const rm_rows *rows     = &mapping->rows[side];
    rm_lid        *last_row = NULL;
    bool           holds    = rows->num_cells == mesh[side]->num_cells && rows->offset[0] == 0 && givers_ascend(rows);

    if (holds && !(last_row = calloc((size_t)rows->num_givers + 1, sizeof *last_row))) return REMAP_NO_MEMORY;
    for (rm_lid c = 0; c < rows->num_cells && holds; c++) holds = row_holds(rows, c, mesh[side]->cell_volume[c], last_row);
    free(last_row);
    if (!holds) return REMAP_INTERNAL;
  }
  return REMAP_OK;
}
