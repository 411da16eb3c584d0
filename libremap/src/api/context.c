/* context -- creation, options, messages, end. */
#include "api/context.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *remap_status_text(remap_status status)
{
  switch (status) {
#define X(name, number, text) \
  case REMAP_##name: return text;
    REMAP_STATUS_LIST(X)
#undef X
  }
  return "unknown status";
}

#define TEXT_OF(x)    TEXT_OF_(x)
#define TEXT_OF_(x)   #x
const char *remap_version(void)
{
  return TEXT_OF(REMAP_VERSION_MAJOR) "." TEXT_OF(REMAP_VERSION_MINOR) "." TEXT_OF(REMAP_VERSION_PATCH);
}

void remap_options_default(remap_options *options)
{
  if (options) *options = (remap_options){.faces = REMAP_FACES_CENTRE, .max_order = 2};
}

void remap_transfer_default(remap_transfer *transfer)
{
  if (transfer)
    *transfer = (remap_transfer){.order         = 2,
                                 .limiter       = REMAP_LIMITER_AUTO,
                                 .on_uncovered  = REMAP_UNCOVERED_KEEP,
                                 .on_partial    = REMAP_PARTIAL_BLEND,
                                 .fill_value    = (double)NAN};
}

static bool options_are_good(const remap_options *o)
{
  return (o->faces == REMAP_FACES_CENTRE || o->faces == REMAP_FACES_DIAGONAL) && o->max_order >= 1 && o->max_order <= 3;
}

remap_status remap_create(MPI_Comm comm, const remap_options *options, remap_context **out)
{
  remap_context *ctx = out ? calloc(1, sizeof *ctx) : NULL;
  remap_status   status = !out ? REMAP_BAD_ARGUMENT : !ctx ? REMAP_NO_MEMORY : REMAP_OK;
  rm_comm        own = {0};

  if (out) *out = NULL;
  if (comm == MPI_COMM_NULL) {
    free(ctx);
    return REMAP_BAD_ARGUMENT;
  }
  remap_options_default(ctx ? &ctx->options : NULL);
  if (ctx && options) ctx->options = *options;
  if (status == REMAP_OK && !options_are_good(&ctx->options)) status = REMAP_BAD_ARGUMENT;
  if (status == REMAP_OK && !rm_geom_selftest()) status = REMAP_INTERNAL;
  const remap_status duplicated = rm_comm_dup(comm, &own);
  if (duplicated != REMAP_OK) {
    free(ctx);
    return duplicated;
  }
  if (status == REMAP_OK) { /* options agree if their extremes do */
    int64_t extreme[8] = {ctx->options.faces, ctx->options.max_order, !!ctx->options.zone_overlap_is_error,
                          !!ctx->options.systems};
    for (int k = 0; k < 4; k++) extreme[4 + k] = -extreme[k];
    const remap_status reduced = rm_comm_max_i64(&own, extreme, 8);
    for (int k = 0; k < 4 && reduced == REMAP_OK; k++)
      if (extreme[k] != -extreme[4 + k]) status = REMAP_BAD_ARGUMENT;
    if (reduced != REMAP_OK) status = reduced;
  } else {
    int64_t unused[8] = {0};
    (void)rm_comm_max_i64(&own, unused, 8);
  }
  if (ctx) ctx->comm = own;
  if (ctx) ctx->slicing = (rm_slicing){RM_BLOCK_TRIANGLES, RM_BLOCK_REPEATS, RM_BLOCKS, RM_BLOCK_FEW};
  if (ctx) ctx->slice = RM_SLICE_PAIRS;
  if (status == REMAP_OK) status = rm_context_meet_few(ctx);
  status = rm_comm_agree(&own, status, NULL);
  if (status != REMAP_OK) {
    rm_arena_drop(ctx ? ctx->peers_arena : NULL);
    rm_comm_free(&own);
    free(ctx);
    return status;
  }
  RM_ASSERT(ctx); /* agreed, so true on every rank */
  *out = ctx;
  return REMAP_OK;
}

remap_status remap_set_blocks(remap_context *ctx, remap_side side, int num_blocks, const remap_mesh *block)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  if (side != REMAP_SOURCE && side != REMAP_TARGET)
    return rm_context_fail(ctx, REMAP_BAD_ARGUMENT, "side is %d, neither source nor target", (int)side);
  if (num_blocks < 0 || (!block && num_blocks > 0))
    return rm_context_fail(ctx, REMAP_BAD_ARGUMENT, "num_blocks is %d, block is %s", num_blocks, block ? "given" : "NULL");
  if (rm_grow(&ctx->block[side], &ctx->block_room[side], num_blocks, sizeof *block) != REMAP_OK)
    return rm_context_fail(ctx, REMAP_NO_MEMORY, "no memory for %d blocks", num_blocks);
  for (int b = 0; b < num_blocks; b++) ctx->block[side][b] = block[b];
  ctx->num_blocks[side] = num_blocks;
  ctx->is_set[side]     = true;
  ctx->is_built         = false;
  ctx->message[0]       = '\0';
  return REMAP_OK;
}

remap_status remap_set_mesh(remap_context *ctx, remap_side side, const remap_mesh *mesh)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  if (!mesh) return rm_context_fail(ctx, REMAP_BAD_ARGUMENT, "mesh is NULL");
  return remap_set_blocks(ctx, side, 1, mesh);
}

remap_status remap_agree(remap_context *ctx, remap_status mine)
{
  rm_reason reason = {-1, -1, ""};

  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  const remap_status entered = rm_context_enter(ctx, RM_CALL_AGREE, 0, &reason);

  if (entered == REMAP_OK) return rm_comm_agree(&ctx->comm, mine, NULL);
  rm_context_explain(ctx, entered, &reason);
  return entered > mine ? entered : mine;
}

const char *remap_message(const remap_context *ctx) { return ctx ? ctx->message : ""; }

void remap_destroy(remap_context **ctx)
{
  if (!ctx || !*ctx) return;
  rm_context_drop_carriers(*ctx);
  rm_context_drop_masks(*ctx);
  rm_context_drop_place(*ctx);
  rm_context_drop_super(*ctx);
  rm_context_drop_meshes(*ctx);
  rm_arena_drop((*ctx)->arena);
  rm_arena_drop((*ctx)->peers_arena);
  for (int side = 0; side < 2; side++) free((*ctx)->block[side]);
  rm_comm_free(&(*ctx)->comm);
  free(*ctx);
  *ctx = NULL;
}

void rm_context_explain(remap_context *ctx, remap_status status, const rm_reason *reason)
{
  const char *text = reason->text[0] ? reason->text : remap_status_text(status);

  if (reason->side < 0) {
    snprintf(ctx->message, sizeof ctx->message, "%s", text);
    return;
  }
  const rm_labels *labels = &ctx->labels[reason->side];
  const char      *mesh   = labels->mesh ? labels->mesh : reason->side == REMAP_SOURCE ? "source mesh" : "target mesh";
  const int64_t    zones  = reason->global_cell < 0 ? 0 : labels->num_zones;
  const int64_t    zone   = rm_interval_of(zones, labels->zone_cell_offset, reason->global_cell);

  if (reason->global_cell < 0)
    snprintf(ctx->message, sizeof ctx->message, "%s: %s", mesh, text);
  else if (zone < 0)
    snprintf(ctx->message, sizeof ctx->message, "%s: cell %lld: %s", mesh, (long long)reason->global_cell, text);
  else
    snprintf(ctx->message, sizeof ctx->message, "%s: zone %s: cell %lld (counted from 1): %s", mesh, labels->zone[zone],
             (long long)(reason->global_cell - labels->zone_cell_offset[zone] + 1), text);
}
