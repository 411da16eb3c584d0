/* call -- how a call begins that all ranks make: each tells its peers which one it makes, so that ranks which make different
 * ones are told instead of waiting for each other. Peers are a few ranks of a tree, at first; transfers add those that they
 * exchange messages with. */
#include "api/context.h"

#include <stdarg.h>
#include <stdio.h>

remap_status rm_context_fail(remap_context *ctx, remap_status status, const char *format, ...)
{
  va_list list;

  va_start(list, format);
  vsnprintf(ctx->message, sizeof ctx->message, format, list);
  va_end(list);
  return status;
}

remap_status rm_context_check_view(remap_context *ctx, bool is_good, const char *function)
{
  ctx->message[0] = '\0';
  if (!is_good)
    return rm_context_fail(ctx, REMAP_BAD_ARGUMENT, "%s: a pointer is NULL, or a side or direction is none", function);
  if (!ctx->is_built) return rm_context_fail(ctx, REMAP_BAD_ORDER, "%s needs a successful remap_build", function);
  return REMAP_OK;
}

uint64_t rm_context_mark(rm_call call, int detail) { return rm_hash_word(rm_hash_word((uint64_t)call) ^ (uint64_t)detail); }

remap_status rm_context_enter(remap_context *ctx, rm_call call, int detail, rm_reason *reason)
{
  const remap_status held = rm_parley_hold(&ctx->comm, &ctx->parley, rm_context_mark(call, detail));
  bool               all  = false;

  if (held != REMAP_OK && held != REMAP_BAD_ARGUMENT) return held;
  RM_TRY(rm_parley_all(&ctx->comm, &ctx->parley, &all));
  return all ? REMAP_OK
             : rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1,
                       "the ranks of the communicator call different functions, or differ in what they must agree on");
}

remap_status rm_context_start_call(remap_context *ctx, rm_call call, remap_status mine, rm_reason *reason)
{
  RM_TRY(rm_context_enter(ctx, call, 0, reason));
  return rm_comm_agree_reason(&ctx->comm, mine, reason);
}

remap_status rm_context_meet_few(remap_context *ctx)
{
  const rm_peers *peers;

  ctx->peers_arena = rm_arena_new();
  if (!ctx->peers_arena) return REMAP_NO_MEMORY;
  RM_TRY(rm_peers_build(ctx->peers_arena, &ctx->comm, 0, NULL, &peers));
  RM_TRY(rm_parley_init(ctx->peers_arena, peers, &ctx->few));
  ctx->parley = ctx->few;
  return REMAP_OK;
}

/* Room for the calls of the context, [0], and for its transfers, [1 + direction]. Not collective. */
static remap_status make_parleys(remap_context *ctx, rm_parley parley[3])
{
  const rm_plan  *plan[2 * RM_CARRIER_PLANS];
  const rm_peers *peers;
  int             num = 0;

  for (int d = 0; d < 2; d++)
    if (ctx->carrier[d]) num += rm_carrier_plans(ctx->carrier[d], plan + num);
  RM_TRY(rm_peers_build(ctx->arena, &ctx->comm, num, plan, &peers));
  for (int k = 0; k < 3; k++) RM_TRY(rm_parley_init(ctx->arena, peers, &parley[k]));
  return REMAP_OK;
}

remap_status rm_context_meet(remap_context *ctx)
{
  rm_parley parley[3];

  RM_TRY(rm_comm_agree(&ctx->comm, make_parleys(ctx, parley), NULL));
  ctx->parley = parley[0];
  for (int d = 0; d < 2; d++)
    if (ctx->carrier[d]) rm_carrier_meet(ctx->carrier[d], &parley[1 + d]);
  return REMAP_OK;
}
