/* views -- what callers may look at after remap_build, in their own unit. */
#include "api/context.h"

/* The pairs of a side's cells as receivers, those of masked cells left out. */
static const rm_rows *rows_of(const remap_context *ctx, remap_side side)
{
  return &ctx->masked[side == REMAP_TARGET ? REMAP_FORWARD : REMAP_BACKWARD]->rows[side];
}

remap_status remap_get_stats(const remap_context *ctx, remap_stats *out)
{
  RM_REQUIRE(ctx && out, REMAP_BAD_ARGUMENT);
  RM_REQUIRE(ctx->is_built, REMAP_BAD_ORDER);
  *out                  = ctx->stats;
  out->seconds_transfer = ctx->seconds_transfer;
  return REMAP_OK;
}

remap_status remap_cells(const remap_context *ctx, remap_side side, double *volume, double *centroid)
{
  RM_REQUIRE(ctx && (side == REMAP_SOURCE || side == REMAP_TARGET), REMAP_BAD_ARGUMENT);
  RM_REQUIRE(ctx->is_built, REMAP_BAD_ORDER);
  const rm_mesh *m = ctx->mesh[side];
  const double   unit = 1 / ctx->frame.scale, cubed = unit * unit * unit;

  for (rm_lid c = 0; c < m->num_cells; c++) {
    if (volume) volume[c] = m->cell_volume[c] * cubed;
    if (centroid)
      for (int a = 0; a < 3; a++) centroid[3 * (int64_t)c + a] = m->cell_centroid[c][a] * unit;
  }
  return REMAP_OK;
}

remap_status remap_coverage(const remap_context *ctx, remap_side side, double *fraction, remap_cover *cover)
{
  RM_REQUIRE(ctx && (side == REMAP_SOURCE || side == REMAP_TARGET), REMAP_BAD_ARGUMENT);
  RM_REQUIRE(ctx->is_built, REMAP_BAD_ORDER);
  const rm_rows *rows = rows_of(ctx, side);

  for (rm_lid c = 0; c < rows->num_cells; c++) {
    double sum = 0;
    for (int64_t k = rows->offset[c]; k < rows->offset[c + 1]; k++) sum += rows->volume[k];
    const double own = ctx->mesh[side]->cell_volume[c];
    if (fraction) fraction[c] = rows->cover[c] == REMAP_COVERED ? 1 : own != 0 ? sum / own : 0;
    if (cover) cover[c] = (remap_cover)rows->cover[c];
  }
  return REMAP_OK;
}

remap_status remap_uncovered(const remap_context *ctx, remap_side side, int64_t *num, int64_t *cell)
{
  RM_REQUIRE(ctx && num && (side == REMAP_SOURCE || side == REMAP_TARGET), REMAP_BAD_ARGUMENT);
  RM_REQUIRE(ctx->is_built, REMAP_BAD_ORDER);
  const rm_rows *rows = rows_of(ctx, side);
  int64_t        n    = 0;

  for (rm_lid c = 0; c < rows->num_cells; c++) {
    if (rows->cover[c] != REMAP_UNCOVERED) continue;
    if (cell) cell[n] = c;
    n++;
  }
  *num = n;
  return REMAP_OK;
}

remap_status remap_pairs(remap_context *ctx, remap_direction direction, remap_pairs_view *out)
{
  RM_REQUIRE(ctx && out && (direction == REMAP_FORWARD || direction == REMAP_BACKWARD), REMAP_BAD_ARGUMENT);
  RM_REQUIRE(ctx->is_built, REMAP_BAD_ORDER);
  const rm_rows    *rows = rows_of(ctx, direction == REMAP_FORWARD ? REMAP_TARGET : REMAP_SOURCE);
  rm_arena         *arena = ctx->mask_arena ? ctx->mask_arena : ctx->arena;
  const double      unit = 1 / ctx->frame.scale, cubed = unit * unit * unit;
  const int64_t     n = rows->offset[rows->num_cells];
  remap_pairs_view *view = &ctx->view[direction];
  int64_t          *global;
  int              *rank;
  double           *volume, *moment, *second = NULL;

  if (!view->row_offset) {
    RM_NEW(global, arena, n);
    RM_NEW(rank, arena, n);
    RM_NEW(volume, arena, n);
    RM_NEW(moment, arena, 3 * n);
    if (rows->second) RM_NEW(second, arena, 6 * n);
    for (int64_t k = 0; k < n; k++) {
      global[k] = rows->giver_global[rows->giver[k]];
      rank[k]   = rows->giver_rank[rows->giver[k]];
      volume[k] = rows->volume[k] * cubed;
      for (int a = 0; a < 3; a++) moment[3 * k + a] = rows->moment[k][a] * cubed * unit;
      for (int a = 0; a < 6 && second; a++) second[6 * k + a] = rows->second[k][a] * cubed * unit * unit;
    }
    *view = (remap_pairs_view){rows->num_cells, rows->offset, global, rank, volume, moment, rows->same, second};
  }
  *out = *view;
  return REMAP_OK;
}
