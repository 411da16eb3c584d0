/* masks -- which cells give and which want, and what of the overlay is left. O(pairs). */
#include "api/context.h"

#include <math.h>
#include <string.h>

void rm_context_drop_masks(remap_context *ctx)
{
  rm_arena_drop(ctx->mask_arena);
  ctx->mask_arena = NULL;
  for (int k = 0; k < 2; k++) {
    ctx->gives[k] = ctx->wants[k] = NULL;
    ctx->masked[k]          = ctx->mapping;
    ctx->giving_stencil[k]  = NULL;
    ctx->giving_wide[k]     = NULL;
    ctx->wanting_stencil[k] = NULL;
    ctx->wanting_wide[k]    = NULL;
  }
  memset(ctx->view, 0, sizeof ctx->view);
}

/* A mask as 0 and 1, all 1 if there is none. */
static remap_status copy_mask(rm_arena *arena, const uint8_t *given, rm_lid n, const uint8_t **out)
{
  uint8_t *mask;

  RM_NEW(mask, arena, n);
  for (rm_lid c = 0; c < n; c++) mask[c] = !given || given[c];
  *out = mask;
  return REMAP_OK;
}

/* What a side's cells are worth as receivers: those covered by less than `least` have no pairs. */
static remap_status find_bare(rm_arena *arena, const rm_mesh *mesh, const rm_rows *rows, double least, uint8_t **out)
{
  uint8_t *mask;

  RM_NEW(mask, arena, rows->num_cells);
  for (rm_lid c = 0; c < rows->num_cells; c++) {
    const bool is_bare = rows->cover[c] == REMAP_PARTIAL && fabs(rm_row_volume(rows, c)) < least * fabs(mesh->cell_volume[c]);

    mask[c] = rows->cover[c] == REMAP_UNWANTED ? RM_MASK_OUT : is_bare ? RM_MASK_BARE : RM_MASK_IN;
  }
  *out = mask;
  return REMAP_OK;
}

/* Take the pairs of cells that are covered too little out of one direction. Collective. */
static remap_status strip(remap_context *ctx, remap_direction direction, double least, rm_reason *reason)
{
  const remap_side  receiving = direction == REMAP_FORWARD ? REMAP_TARGET : REMAP_SOURCE, giving = 1 - receiving;
  const rm_mapping *mapping   = ctx->masked[direction];
  uint8_t          *wants = NULL, *gives = NULL;
  remap_status      status = find_bare(ctx->mask_arena, ctx->mesh[receiving], &mapping->rows[receiving], least, &wants);

  if (status == REMAP_OK) status = find_bare(ctx->mask_arena, ctx->mesh[giving], &mapping->rows[giving], 0.0, &gives);
  RM_TRY(rm_comm_agree_reason(&ctx->comm, status, reason));
  return rm_mapping_mask(ctx->mask_arena, &ctx->comm, mapping, receiving, wants, gives, &ctx->masked[direction]);
}

/* The same, within 0..1, on every rank? Collective. */
static remap_status check_least(const remap_context *ctx, const double least[2], rm_reason *reason)
{
  double extreme[4] = {least[0], -least[0], least[1], -least[1]};

  for (int side = 0; side < 2; side++)
    if (!(least[side] >= 0.0 && least[side] <= 1.0)) extreme[2 * side] = extreme[2 * side + 1] = 2.0;
  RM_TRY(rm_comm_max_f64(&ctx->comm, extreme, 4));
  for (int side = 0; side < 2; side++)
    if (extreme[2 * side] > -extreme[2 * side + 1] || extreme[2 * side] > 1.0)
      return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "min_coverage is within 0..1 and the same on every rank");
  return REMAP_OK;
}

/* Collective. */
static remap_status apply(remap_context *ctx, const remap_masks *masks, rm_reason *reason)
{
  const double least[2] = {masks ? masks->min_coverage[0] : 0.0, masks ? masks->min_coverage[1] : 0.0};
  int64_t      any[4]; /* given on some rank: gives by side, wants by side */
  remap_status status = REMAP_OK;

  RM_TRY(check_least(ctx, least, reason));
  for (int side = 0; side < 2; side++) {
    any[side]     = masks && masks->gives[side];
    any[2 + side] = masks && masks->wants[side];
  }
  RM_TRY(rm_comm_max_i64(&ctx->comm, any, 4));
  if (!any[0] && !any[1] && !any[2] && !any[3] && !(least[0] > 0.0) && !(least[1] > 0.0)) return REMAP_OK;
  ctx->mask_arena = rm_arena_new();
  status          = ctx->mask_arena ? rm_context_need_pairs(ctx) : REMAP_NO_MEMORY;
  for (int side = 0; side < 2; side++) {
    const rm_lid n = ctx->mesh[side]->num_cells;

    if (status == REMAP_OK) status = copy_mask(ctx->mask_arena, masks ? masks->gives[side] : NULL, n, &ctx->gives[side]);
    if (status == REMAP_OK) status = copy_mask(ctx->mask_arena, masks ? masks->wants[side] : NULL, n, &ctx->wants[side]);
  }
  RM_TRY(rm_comm_agree_reason(&ctx->comm, status, reason));
  for (int d = 0; d < 2; d++) {
    const remap_side giving = d == REMAP_FORWARD ? REMAP_SOURCE : REMAP_TARGET, receiving = 1 - giving;

    if (any[giving] || any[2 + receiving])
      RM_TRY(rm_mapping_mask(ctx->mask_arena, &ctx->comm, ctx->mapping, receiving, ctx->wants[receiving], ctx->gives[giving],
                             &ctx->masked[d]));
    if (least[receiving] > 0.0) RM_TRY(strip(ctx, (remap_direction)d, least[receiving], reason));
  }
  for (int side = 0; side < 2; side++) { /* what masks nothing needs no stencil of its own */
    if (!any[side]) ctx->gives[side] = NULL;
    if (!any[2 + side]) ctx->wants[side] = NULL;
  }
  return REMAP_OK;
}

remap_status remap_set_masks(remap_context *ctx, const remap_masks *masks)
{
  rm_reason    reason = {-1, -1, ""};
  remap_status status = REMAP_OK;

  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  ctx->message[0] = '\0';
  if (!ctx->is_built || rm_context_is_busy(ctx))
    status = rm_fail(REMAP_BAD_ORDER, &reason, -1, -1, ctx->is_built ? "a transfer is under way: remap_field_finish comes first"
                                                                     : "masks need a successful remap_build");
  status = rm_context_start_call(ctx, RM_CALL_MASKS, status, &reason);
  if (status == REMAP_OK) {
    rm_context_drop_carriers(ctx);
    rm_context_drop_masks(ctx);
    status = apply(ctx, masks, &reason);
    if (status != REMAP_OK) rm_context_drop_masks(ctx);
  }
  if (status != REMAP_OK) rm_context_explain(ctx, status, &reason);
  return status;
}
