/* field -- remap_field: checks the arguments on every rank, then hands over to room field. */
#include <stdlib.h>
#include <string.h>
#include "api/context.h"

static remap_status check_arguments(const remap_context *ctx, remap_direction direction, const remap_transfer *how, int num_fields,
                                    const remap_field_desc *fields, rm_reason *reason)
{
  const remap_side giving = direction == REMAP_FORWARD ? REMAP_SOURCE : REMAP_TARGET, receiving = 1 - giving;

  if (!ctx->is_built) return rm_fail(REMAP_BAD_ORDER, reason, -1, -1, "remap_field needs a successful remap_build");
  if (direction != REMAP_FORWARD && direction != REMAP_BACKWARD)
    return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "direction is %d, neither forward nor backward", (int)direction);
  if (how->order < 1 || how->order > ctx->options.max_order)
    return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "order %d is not within 1..%d, the context's max_order", how->order,
                   ctx->options.max_order);
  if (how->limiter < REMAP_LIMITER_NONE || how->limiter > REMAP_LIMITER_AUTO || how->on_uncovered < REMAP_UNCOVERED_KEEP ||
      how->on_uncovered > REMAP_UNCOVERED_ERROR || how->on_partial < REMAP_PARTIAL_BLEND || how->on_partial > REMAP_PARTIAL_ERROR)
    return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "the limiter or a coverage policy is not one of its enum");
  if (num_fields < 0 || (num_fields > 0 && !fields))
    return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "num_fields is %d, fields is %s", num_fields, fields ? "given" : "NULL");
  for (int k = 0; k < num_fields; k++) {
    const remap_field_desc *f = &fields[k];
    if (f->nature < REMAP_CONSERVED || f->nature > REMAP_FLAG)
      return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "field %s: nature %d is not one of its enum", f->name ? f->name : "?", (int)f->nature);
    if ((!f->in && ctx->mesh[giving]->num_cells) || (!f->out && ctx->mesh[receiving]->num_cells))
      return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "field %s: in or out is NULL on a rank that has cells", f->name ? f->name : "?");
  }
  return REMAP_OK;
}

/* The same transfer on every rank? Compared by a hash and its complement. Collective. */
static remap_status check_agreement(const remap_context *ctx, remap_direction direction, const remap_transfer *how, int num_fields,
                                    const remap_field_desc *fields, rm_reason *reason)
{
  const int words[6] = {(int)direction, how->order, (int)how->limiter, (int)how->on_uncovered, (int)how->on_partial, num_fields};
  uint64_t  hash = 0;

  for (int k = 0; k < 6; k++) hash = rm_hash_word(hash ^ (uint64_t)words[k]);
  for (int k = 0; k < num_fields; k++) hash = rm_hash_word(hash ^ ((uint64_t)fields[k].nature << 1 | (fields[k].has_old != 0)));
  int64_t extreme[2] = {(int64_t)(hash >> 2), -(int64_t)(hash >> 2)};
  RM_TRY(rm_comm_max_i64(&ctx->comm, extreme, 2));
  return extreme[0] == -extreme[1] ? REMAP_OK
                                   : rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1,
                                             "direction, transfer, number, natures or old values of fields differ between ranks");
}

static remap_status need_stencils(remap_context *ctx, remap_side giving, const remap_transfer *how)
{
  const bool needed[2] = {giving == REMAP_SOURCE ? how->order > 1 : true, giving == REMAP_TARGET ? how->order > 1 : true};

  for (int side = 0; side < 2; side++)
    if (needed[side] && !ctx->stencil[side])
      RM_TRY(rm_stencil_build(ctx->arena, &ctx->comm, &ctx->frame, ctx->mesh[side], &ctx->stencil[side]));
  return REMAP_OK;
}

static remap_status transfer(remap_context *ctx, remap_direction direction, const remap_transfer *how, int num_fields,
                             const remap_field_desc *fields, remap_field_report *reports, rm_arena *arena, rm_reason *reason)
{
  const remap_side giving = direction == REMAP_FORWARD ? REMAP_SOURCE : REMAP_TARGET, receiving = 1 - giving;
  const double     unit = 1 / ctx->frame.scale, cubed = unit * unit * unit;

  RM_TRY(check_agreement(ctx, direction, how, num_fields, fields, reason));
  RM_TRY(need_stencils(ctx, giving, how));
  const rm_transfer_setup setup = {&ctx->comm,
                                   &ctx->frame,
                                   ctx->mesh[giving],
                                   ctx->mesh[receiving],
                                   &ctx->mapping->rows[receiving],
                                   &ctx->mapping->rows[giving],
                                   how->order > 1 ? ctx->stencil[giving] : NULL,
                                   ctx->stencil[receiving]};
  RM_TRY(rm_field_transfer(arena, &setup, how, num_fields, fields, reports, reason));
  for (int k = 0; reports && k < num_fields; k++) {
    reports[k].source_integral *= cubed;
    reports[k].target_integral *= cubed;
  }
  return REMAP_OK;
}

remap_status remap_field(remap_context *ctx, remap_direction direction, const remap_transfer *transfer_given, int num_fields,
                         const remap_field_desc *fields, remap_field_report *reports)
{
  rm_reason      reason = {-1, -1, ""};
  remap_transfer how;
  rm_arena      *arena;
  remap_status   status;
  const double   start = rm_seconds();

  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  ctx->message[0] = '\0';
  remap_transfer_default(&how);
  if (transfer_given) how = *transfer_given;
  arena  = rm_arena_new();
  status = check_arguments(ctx, direction, &how, num_fields, fields, &reason);
  if (status == REMAP_OK && !arena) status = REMAP_NO_MEMORY;
  status = rm_comm_agree_reason(&ctx->comm, status, &reason);
  if (status == REMAP_OK) status = transfer(ctx, direction, &how, num_fields, fields, reports, arena, &reason);
  rm_arena_drop(arena);
  if (status != REMAP_OK) rm_context_explain(ctx, status, &reason);
  ctx->seconds_transfer += rm_seconds() - start;
  return status;
}
