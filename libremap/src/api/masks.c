/* masks -- which cells give and which want, and what of the overlay is left. O(pairs). */
#include "api/context.h"

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

/* Collective. */
static remap_status apply(remap_context *ctx, const remap_masks *masks, rm_reason *reason)
{
  int64_t      any[4]; /* given on some rank: gives by side, wants by side */
  remap_status status = REMAP_OK;

  for (int side = 0; side < 2; side++) {
    any[side]     = masks && masks->gives[side];
    any[2 + side] = masks && masks->wants[side];
  }
  RM_TRY(rm_comm_max_i64(&ctx->comm, any, 4));
  if (!any[0] && !any[1] && !any[2] && !any[3]) return REMAP_OK;
  ctx->mask_arena = rm_arena_new();
  if (!ctx->mask_arena) status = REMAP_NO_MEMORY;
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
  remap_status status;

  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  ctx->message[0] = '\0';
  if (!ctx->is_built || rm_context_is_busy(ctx)) {
    status = rm_fail(REMAP_BAD_ORDER, &reason, -1, -1, ctx->is_built ? "a transfer is under way: remap_field_finish comes first"
                                                                     : "masks need a successful remap_build");
  } else {
    rm_context_drop_carriers(ctx);
    rm_context_drop_masks(ctx);
    status = apply(ctx, masks, &reason);
    if (status != REMAP_OK) rm_context_drop_masks(ctx);
  }
  if (status != REMAP_OK) rm_context_explain(ctx, status, &reason);
  return status;
}
