/* measure -- volumes as the solver has them, beside those of the triangulated cells. O(cells). */
#include "api/context.h"

#include <math.h>

/* Factors from own volumes to the solver's, and the latter. */
static remap_status find_factors(rm_arena *arena, const rm_mesh *mesh, const double *given, double cubed, const double **out,
                                 const double **out_volume, rm_reason *reason)
{
  double *factor, *volume;

  RM_NEW(factor, arena, mesh->num_cells);
  RM_NEW(volume, arena, mesh->num_cells);
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    const double own = fabs(mesh->cell_volume[c]) * cubed;

    if (given && !(given[c] > 0.0 && isfinite(given[c])))
      return rm_fail(REMAP_BAD_MESH, reason, mesh->side, mesh->cell_global[c],
                     "cell_volume is %g: give a volume above 0, or none", given[c]);
    volume[c] = given ? given[c] : own;
    factor[c] = given && own > 0.0 ? given[c] / own : 1.0;
    if (!(factor[c] > 0x1p-100 && factor[c] < 0x1p100))
      return rm_fail(REMAP_BAD_MESH, reason, mesh->side, mesh->cell_global[c],
                     "cell_volume is %g, but the cell has %g: give volumes in the unit of the coordinates",
                     given ? given[c] : 1.0, own);
  }
  *out        = factor;
  *out_volume = volume;
  return REMAP_OK;
}

/* What statistics say of them. Collective. */
static remap_status summarise(remap_context *ctx, int side, double cubed)
{
  const rm_mesh *mesh  = ctx->mesh[side];
  double         worst = 0.0, all;
  int64_t        cell  = INT64_MIN; /* negated, so that the smallest wins */
  rm_sum         sum;

  rm_sum_clear(&sum);
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    rm_sum_add(&sum, ctx->measure[side][c] * fabs(mesh->cell_volume[c]));
    worst = fmax(worst, fabs(ctx->measure[side][c] - 1.0));
  }
  all = worst;
  RM_TRY(rm_comm_sum_exact(&ctx->comm, &sum, 1));
  RM_TRY(rm_comm_max_f64(&ctx->comm, &all, 1));
  for (rm_lid c = 0; c < mesh->num_cells; c++)
    if (fabs(ctx->measure[side][c] - 1.0) >= all && -mesh->cell_global[c] > cell) cell = -mesh->cell_global[c];
  RM_TRY(rm_comm_max_i64(&ctx->comm, &cell, 1));
  ctx->solver_volume[side]         = rm_sum_value(&sum) * cubed;
  ctx->max_volume_difference[side] = all;
  ctx->worst_volume_cell[side]     = cell == INT64_MIN ? -1 : -cell;
  return REMAP_OK;
}

remap_status rm_context_measure(remap_context *ctx, int side, const remap_mesh *given, rm_reason *reason)
{
  const double unit = 1 / ctx->frame.scale, cubed = unit * unit * unit;
  int64_t      any = given->cell_volume != NULL;
  remap_status status;

  ctx->measure[side] = ctx->given_volume[side] = NULL;
  RM_TRY(rm_comm_max_i64(&ctx->comm, &any, 1));
  if (!any) {
    ctx->solver_volume[side]         = ctx->mesh[side]->volume * cubed;
    ctx->max_volume_difference[side] = 0.0;
    ctx->worst_volume_cell[side]     = -1;
    return REMAP_OK;
  }
  status = find_factors(ctx->mesh_arena[side], ctx->mesh[side], given->cell_volume, cubed, &ctx->measure[side],
                        &ctx->given_volume[side], reason);
  RM_TRY(rm_comm_agree_reason(&ctx->comm, status, reason));
  return summarise(ctx, side, cubed);
}

/* Volumes of a side's cells as the solver has them, those of the mesh where it has none; NULL: no memory. */
static const double *volumes_of(const remap_context *ctx, rm_arena *scratch, int side)
{
  const rm_mesh *mesh = ctx->mesh[side];
  const double   unit = 1 / ctx->frame.scale, cubed = unit * unit * unit;
  double        *own  = ctx->given_volume[side] ? NULL : rm_arena_alloc(scratch, mesh->num_cells, sizeof *own);

  for (rm_lid c = 0; own && c < mesh->num_cells; c++) own[c] = fabs(mesh->cell_volume[c]) * cubed;
  return own ? own : ctx->given_volume[side];
}

/* One side's cells: what the others have is asked of their ranks. Collective. */
static remap_status compare_side(remap_context *ctx, rm_arena *scratch, int side, const double *const volume[2])
{
  const rm_rows *rows    = &ctx->mapping->rows[side];
  double        *heard   = rm_arena_alloc(scratch, rows->num_givers, sizeof *heard);
  double        *buffer  = rm_arena_alloc(scratch, rows->plan->send_offset[rows->plan->num_send], sizeof *buffer);
  uint8_t       *differs = rm_arena_zero(ctx->arena, rows->num_cells, 1);
  const bool     have    = volume[0] && volume[1] && heard && buffer && differs;

  RM_TRY(rm_comm_agree(&ctx->comm, have ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(have);
  RM_TRY(rm_comm_agree(&ctx->comm, rm_plan_run(&ctx->comm, rows->plan, sizeof *heard, volume[1 - side], heard, buffer), NULL));
  for (rm_lid c = 0; c < rows->num_cells; c++) {
    if (!rows->same[c]) continue;
    const double other = heard[rows->giver[rows->offset[c]]];

    differs[c] = volume[side][c] < other || volume[side][c] > other;
  }
  ctx->differs[side] = differs;
  return REMAP_OK;
}

remap_status rm_context_compare_volumes(remap_context *ctx)
{
  rm_arena    *scratch;
  remap_status status;

  for (int side = 0; side < 2; side++) ctx->differs[side] = NULL;
  if (!ctx->measure[0] && !ctx->measure[1]) return REMAP_OK;
  scratch = rm_arena_new();
  status  = rm_comm_agree(&ctx->comm, scratch ? REMAP_OK : REMAP_NO_MEMORY, NULL);
  if (status == REMAP_OK) {
    const double *const volume[2] = {volumes_of(ctx, scratch, 0), volumes_of(ctx, scratch, 1)};

    for (int side = 0; side < 2 && status == REMAP_OK; side++) status = compare_side(ctx, scratch, side, volume);
  }
  rm_arena_drop(scratch);
  return status;
}
