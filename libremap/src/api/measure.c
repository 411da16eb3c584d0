/* measure -- volumes as the solver has them, beside those of the triangulated cells. O(cells). */
#include "api/context.h"

#include <math.h>

/* Factors from own volumes to the solver's. */
static remap_status find_factors(rm_arena *arena, const rm_mesh *mesh, const double *given, double cubed, const double **out,
                                 rm_reason *reason)
{
  double *factor;

  RM_NEW(factor, arena, mesh->num_cells);
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    const double own = fabs(mesh->cell_volume[c]) * cubed;

    if (given && !(given[c] > 0.0 && isfinite(given[c])))
      return rm_fail(REMAP_BAD_MESH, reason, mesh->side, mesh->cell_global[c],
                     "cell_volume is %g: give a volume above 0, or none", given[c]);
    factor[c] = given && own > 0.0 ? given[c] / own : 1.0;
    if (!(factor[c] > 0x1p-100 && factor[c] < 0x1p100))
      return rm_fail(REMAP_BAD_MESH, reason, mesh->side, mesh->cell_global[c],
                     "cell_volume is %g, but the cell has %g: give volumes in the unit of the coordinates",
                     given ? given[c] : 1.0, own);
  }
  *out = factor;
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

  ctx->measure[side] = NULL;
  RM_TRY(rm_comm_max_i64(&ctx->comm, &any, 1));
  if (!any) {
    ctx->solver_volume[side]         = ctx->mesh[side]->volume * cubed;
    ctx->max_volume_difference[side] = 0.0;
    ctx->worst_volume_cell[side]     = -1;
    return REMAP_OK;
  }
  status = find_factors(ctx->mesh_arena[side], ctx->mesh[side], given->cell_volume, cubed, &ctx->measure[side], reason);
  RM_TRY(rm_comm_agree_reason(&ctx->comm, status, reason));
  return summarise(ctx, side, cubed);
}
