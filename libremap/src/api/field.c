/* field -- remap_field and its halves. What a transfer needs is prepared when it is first asked for, by all ranks together;
 * after that a transfer involves neighbours only and takes no memory. */
#include "api/context.h"

#include <string.h>

static remap_side giver_of(remap_direction direction) { return direction == REMAP_FORWARD ? REMAP_SOURCE : REMAP_TARGET; }

/* What all ranks pass alike. */
static remap_status check_agreed(const remap_context *ctx, remap_direction direction, const remap_transfer *how, int num_fields,
                                 const remap_field_desc *fields, rm_reason *reason)
{
  if (!ctx->is_built) return rm_fail(REMAP_BAD_ORDER, reason, -1, -1, "a transfer needs a successful remap_build");
  if (direction != REMAP_FORWARD && direction != REMAP_BACKWARD)
    return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "direction is %d, neither forward nor backward", (int)direction);
  if (rm_carrier_is_under_way(ctx->carrier[direction]))
    return rm_fail(REMAP_BAD_ORDER, reason, -1, -1,
                   "a transfer in this direction is under way: remap_field_finish comes first");
  if (how->order < 1 || how->order > ctx->options.max_order)
    return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "order %d is not within 1..%d, the context's max_order", how->order,
                   ctx->options.max_order);
  if (how->limiter < REMAP_LIMITER_NONE || how->limiter > REMAP_LIMITER_CAAS || how->on_uncovered < REMAP_UNCOVERED_KEEP ||
      how->on_uncovered > REMAP_UNCOVERED_ERROR || how->on_partial < REMAP_PARTIAL_BLEND ||
      how->on_partial > REMAP_PARTIAL_ERROR)
    return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "the limiter or a coverage policy is not one of its enum");
  if (num_fields < 0 || (num_fields > 0 && !fields))
    return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "num_fields is %d, fields is %s", num_fields, fields ? "given" : "NULL");
  for (int k = 0; k < num_fields; k++)
    if (fields[k].nature < REMAP_CONSERVED || fields[k].nature > REMAP_FLAG)
      return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "field %s: nature %d is not one of its enum",
                     fields[k].name ? fields[k].name : "?", (int)fields[k].nature);
  RM_TRY(rm_systems_check(how, num_fields, fields, reason));
  for (int k = 0; k < num_fields; k++)
    if (fields[k].system > 0 && how->order > 1 && ctx->options.max_order < 3 && !ctx->options.systems)
      return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1,
                     "systems of order 2 need second moments: create the context with systems not 0, or max_order 3");
  return REMAP_OK;
}

/* Is a field's array, or that of a block with cells, missing? */
static bool is_missing(const void *all, const void *const *block, bool is_by_block, const rm_layout *layout)
{
  const int num = layout->num_blocks;

  if (!is_by_block) return !all && num > 0 && layout->block_offset[num] > 0;
  for (int b = 0; b < num; b++)
    if (!block[b] && layout->block_offset[b] < layout->block_offset[b + 1]) return true;
  return false;
}

/* What this rank alone passes. */
static remap_status check_own(const remap_context *ctx, remap_direction direction, int num_fields,
                              const remap_field_desc *fields, rm_reason *reason)
{
  const remap_side giving = giver_of(direction);

  for (int k = 0; k < num_fields; k++) {
    const remap_field_desc *f = &fields[k];

    if (is_missing(f->in, (const void *const *)f->in_block, f->in_block != NULL, &ctx->layout[giving]) ||
        is_missing(f->out, (const void *const *)f->out_block, f->out_block != NULL, &ctx->layout[1 - giving]))
      return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "field %s: in or out is NULL on a rank that has cells",
                     f->name ? f->name : "?");
    if (f->in_stride < 0 || f->out_stride < 0)
      return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "field %s: strides are not negative", f->name ? f->name : "?");
  }
  return REMAP_OK;
}

/* Does a transfer end in reports? Of one in two halves that is not known at the start. */
typedef enum reporting { WITHOUT_REPORTS, WITH_REPORTS, IN_HALVES } reporting;

/* A number that tells this transfer from others that ranks might mistake for it. */
static uint64_t mark_of(remap_direction direction, const remap_transfer *how, int num_fields, const remap_field_desc *fields,
                        reporting reports)
{
  const int    words[9] = {(int)direction,       how->order, (int)how->limiter,   (int)how->on_uncovered,
                           (int)how->on_partial, num_fields, how->allow_nan != 0, how->rotation != NULL,
                           (int)reports};
  const double gas[2]   = {how->gamma, how->gas_constant};
  uint64_t     hash     = 0, bits[2];

  memcpy(bits, gas, sizeof bits);
  for (int k = 0; k < 9; k++) hash = rm_hash_word(hash ^ (uint64_t)words[k]);
  for (int k = 0; k < 2; k++) hash = rm_hash_word(hash ^ bits[k]);
  for (int k = 0; k < num_fields; k++) {
    const remap_field_desc *f = &fields[k];

    hash = rm_hash_word(hash ^ ((uint64_t)f->nature << 1 | (f->has_old != 0)));
    hash = rm_hash_word(hash ^ ((uint64_t)f->system << 32 | (uint64_t)f->vector << 8 | (uint64_t)f->role));
  }
  return hash;
}

/* The same transfer on every rank? Compared by its mark and the complement. Collective. */
static remap_status check_marks(const remap_context *ctx, uint64_t mark, rm_reason *reason)
{
  int64_t extreme[2] = {(int64_t)(mark >> 2), -(int64_t)(mark >> 2)};

  RM_TRY(rm_comm_max_i64(&ctx->comm, extreme, 2));
  return extreme[0] == -extreme[1]
             ? REMAP_OK
             : rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1,
                       "direction, transfer, number, natures or old values of fields differ between ranks");
}

/* The stencil among the cells that take part in a role; one of all cells serves both where nothing is masked. */
static const rm_stencil **stencil_of(remap_context *ctx, remap_side side, bool is_giving)
{
  if (is_giving) return ctx->gives[side] ? &ctx->giving_stencil[side] : &ctx->stencil[side];
  return ctx->wants[side] ? &ctx->wanting_stencil[side] : &ctx->stencil[side];
}

/* Likewise the wider one for order 3. */
static const rm_stencil **wide_of(remap_context *ctx, remap_side side, bool is_giving)
{
  if (is_giving) return ctx->gives[side] ? &ctx->giving_wide[side] : &ctx->wide[side];
  return ctx->wants[side] ? &ctx->wanting_wide[side] : &ctx->wide[side];
}

/* is_wide: with what order 3 needs. */
static rm_transfer_setup setup_of(remap_context *ctx, remap_direction direction, bool is_wide)
{
  const remap_side  giving = giver_of(direction), receiving = 1 - giving;
  const rm_mapping *mapping = ctx->masked[direction];

  return (rm_transfer_setup){.comm              = &ctx->comm,
                             .frame             = &ctx->frame,
                             .giving            = ctx->mesh[giving],
                             .receiving         = ctx->mesh[receiving],
                             .rows              = &mapping->rows[receiving],
                             .giving_rows       = &mapping->rows[giving],
                             .giving_stencil    = is_wide ? *wide_of(ctx, giving, true) : *stencil_of(ctx, giving, true),
                             .receiving_stencil = *stencil_of(ctx, receiving, false),
                             .keeping_stencil  = is_wide ? *wide_of(ctx, receiving, false) : *stencil_of(ctx, receiving, false),
                             .giving_second    = ctx->second[giving],
                             .receiving_second = ctx->second[receiving],
                             .giving_measure   = ctx->measure[giving],
                             .receiving_measure = ctx->measure[receiving],
                             .giving_differs    = ctx->differs[giving],
                             .receiving_differs = ctx->differs[receiving],
                             .giving_layout     = ctx->layout[giving],
                             .receiving_layout  = ctx->layout[receiving],
                             .any_partial       = mapping->cells_by_cover[receiving][REMAP_PARTIAL] > 0,
                             .any_uncovered     = mapping->cells_by_cover[receiving][REMAP_UNCOVERED] > 0};
}

/* Make the stencil that a side needs in a role, unless it is there; with weights where fields get slopes. Collective. */
static remap_status need_stencil(remap_context *ctx, remap_side side, bool is_giving, bool is_weighed)
{
  const rm_stencil **stencil = stencil_of(ctx, side, is_giving), *weighed = NULL;
  const uint8_t     *mask    = is_giving ? ctx->gives[side] : ctx->wants[side];

  if (!mask && !ctx->stencil_arena[side]) ctx->stencil_arena[side] = rm_arena_new();
  rm_arena *arena = mask ? ctx->mask_arena : ctx->stencil_arena[side];
  if (!*stencil) {
    RM_TRY(rm_comm_agree(&ctx->comm, arena ? REMAP_OK : REMAP_NO_MEMORY, NULL));
    RM_TRY(rm_stencil_build(arena, &ctx->comm, &ctx->frame, ctx->mesh[side], mask, stencil));
  }
  if (!is_weighed || (*stencil)->weight) return REMAP_OK;
  RM_TRY(rm_comm_agree(&ctx->comm, rm_stencil_weigh(arena, ctx->mesh[side], *stencil, &weighed), NULL));
  *stencil = weighed; /* on all ranks or on none */
  return REMAP_OK;
}

/* Second moments of both sides' cells. Collective. */
static remap_status need_second(remap_context *ctx)
{
  remap_status status = REMAP_OK;

  for (int side = 0; side < 2 && status == REMAP_OK; side++) {
    if (ctx->second[side]) continue;
    if (!ctx->stencil_arena[side]) ctx->stencil_arena[side] = rm_arena_new();
    status = !ctx->stencil_arena[side]
                 ? REMAP_NO_MEMORY
                 : rm_mesh_second(ctx->stencil_arena[side], ctx->mesh[side], ctx->options.faces, &ctx->second[side]);
  }
  return rm_comm_agree(&ctx->comm, status, NULL);
}

/* The wider stencil of a side in a role, whose stencil and second moments are there. Collective. */
static remap_status need_wide(remap_context *ctx, remap_side side, bool is_giving)
{
  const rm_stencil **wide = wide_of(ctx, side, is_giving);
  const uint8_t     *mask = is_giving ? ctx->gives[side] : ctx->wants[side];

  if (*wide) return REMAP_OK;
  return rm_stencil_widen(mask ? ctx->mask_arena : ctx->stencil_arena[side], &ctx->comm, &ctx->frame, ctx->mesh[side],
                          ctx->second[side], *stencil_of(ctx, side, is_giving), wide);
}

/* Make the carrier that a load needs, and what it rests on. Collective. */
static remap_status prepare(remap_context *ctx, remap_direction direction, rm_load load, rm_reason *reason)
{
  const remap_side giving = giver_of(direction);
  remap_status     mine   = REMAP_OK;

  if (ctx->carrier[direction]) load = rm_load_max(load, ctx->load[direction]);
  if (direction == REMAP_BACKWARD || load.is_curved) mine = rm_context_need_pairs(ctx); /* systems: what slopes add to them */
  rm_arena_drop(ctx->carrier_arena[direction]);
  ctx->carrier[direction]       = NULL;
  ctx->carrier_arena[direction] = rm_arena_new();
  if (!ctx->carrier_arena[direction]) mine = REMAP_NO_MEMORY;
  RM_TRY(rm_comm_agree(&ctx->comm, mine, NULL));
  if (load.has_slopes) RM_TRY(need_stencil(ctx, giving, true, true));
  if (load.has_nearest || load.is_blended) RM_TRY(need_stencil(ctx, 1 - giving, false, load.is_blended));
  if (load.is_wide || load.is_curved) RM_TRY(need_second(ctx));
  if (load.is_wide) RM_TRY(need_wide(ctx, giving, true));
  if (load.is_wide && load.is_blended) RM_TRY(need_wide(ctx, 1 - giving, false));
  const rm_transfer_setup setup = setup_of(ctx, direction, load.is_wide);
  RM_TRY(rm_carrier_build(ctx->carrier_arena[direction], &setup, load, &ctx->carrier[direction], reason));
  ctx->load[direction]      = load;
  const remap_status status = rm_context_meet(ctx);
  if (status != REMAP_OK) ctx->carrier[direction] = NULL;
  return status;
}

/* Transfers that need more than is there prepare it together. Collective; mine is the status of what only this rank passes. */
static remap_status prepare_together(remap_context *ctx, remap_direction direction, rm_load load, uint64_t mark,
                                     remap_status mine, rm_reason *reason)
{
  if (ctx->carrier[direction]) RM_TRY(rm_context_enter(ctx, RM_CALL_LARGER_TRANSFER, (int)direction, reason));
  RM_TRY(rm_comm_agree_reason(&ctx->comm, mine, reason));
  RM_TRY(check_marks(ctx, mark, reason));
  return prepare(ctx, direction, load, reason);
}

/* Arguments that every rank must pass alike are wrong here, or come at the wrong time. The first transfer in a direction is
 * collective: then all ranks hear what is wrong; later, those that wait for this one find out that it does not come along. */
static remap_status start_alike(remap_context *ctx, remap_direction direction, const remap_transfer *how, int num_fields,
                                const remap_field_desc *fields, rm_reason *reason)
{
  const remap_status mine     = check_agreed(ctx, direction, how, num_fields, fields, reason);
  const bool         is_known = direction == REMAP_FORWARD || direction == REMAP_BACKWARD;

  if (is_known && !ctx->carrier[direction]) {
    RM_TRY(rm_context_enter(ctx, RM_CALL_FIRST_TRANSFER, (int)direction, reason));
    return mine == REMAP_OK ? mine : rm_comm_agree_reason(&ctx->comm, mine, reason);
  }
  if (mine != REMAP_OK && !(is_known && rm_carrier_is_under_way(ctx->carrier[direction])))
    (void)rm_parley_hold(&ctx->comm, &ctx->parley, rm_context_mark(RM_CALL_REFUSED_TRANSFER, 0));
  return mine;
}

static remap_status start(remap_context *ctx, remap_direction direction, const remap_transfer *transfer, int num_fields,
                          const remap_field_desc *fields, reporting reports, rm_reason *reason)
{
  remap_transfer how;
  remap_status   mine;

  remap_transfer_default(&how);
  if (transfer) how = *transfer;
  RM_TRY(start_alike(ctx, direction, &how, num_fields, fields, reason));
  const rm_transfer_setup setup = setup_of(ctx, direction, false);
  const rm_load           load  = rm_load_of(&setup, &how, num_fields, fields);
  const uint64_t          mark  = mark_of(direction, &how, num_fields, fields, reports);
  mine                          = check_own(ctx, direction, num_fields, fields, reason);
  if (!ctx->carrier[direction] || !rm_load_covers(ctx->load[direction], load))
    RM_TRY(prepare_together(ctx, direction, load, mark, mine, reason));
  rm_carrier_start(ctx->carrier[direction], &how, num_fields, fields, mark, mine, reason);
  return REMAP_OK;
}

/* The first half, timed and explained. */
static remap_status start_timed(remap_context *ctx, remap_direction direction, const remap_transfer *transfer, int num_fields,
                                const remap_field_desc *fields, reporting reports)
{
  rm_reason    reason = {-1, -1, ""};
  remap_status status;
  const double begin = rm_seconds();

  ctx->message[0] = '\0';
  status          = start(ctx, direction, transfer, num_fields, fields, reports, &reason);
  if (status != REMAP_OK) rm_context_explain(ctx, status, &reason);
  ctx->seconds_transfer += rm_seconds() - begin;
  return status;
}

/* The second half, timed and explained. */
static remap_status finish_timed(remap_context *ctx, remap_direction direction, remap_field_report *reports, bool in_halves)
{
  rm_reason    reason = {-1, -1, ""};
  remap_status status;
  const double begin = rm_seconds(), unit = 1 / ctx->frame.scale, cubed = unit * unit * unit;

  ctx->message[0] = '\0';
  if (!rm_carrier_is_under_way(ctx->carrier[direction])) {
    status =
        rm_fail(REMAP_BAD_ORDER, &reason, -1, -1, "no transfer in this direction is under way: remap_field_start comes first");
  } else {
    if (in_halves)
      rm_carrier_confirm(ctx->carrier[direction], rm_context_mark(RM_CALL_FINISH, 2 * (int)direction + (reports != NULL)));
    status = rm_carrier_finish(ctx->carrier[direction], cubed, reports, &reason);
  }
  if (status != REMAP_OK) rm_context_explain(ctx, status, &reason);
  ctx->seconds_transfer += rm_seconds() - begin;
  return status;
}

remap_status remap_field_start(remap_context *ctx, remap_direction direction, const remap_transfer *transfer, int num_fields,
                               const remap_field_desc *fields)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  return start_timed(ctx, direction, transfer, num_fields, fields, IN_HALVES);
}

remap_status remap_field_finish(remap_context *ctx, remap_direction direction, remap_field_report *reports)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  if (direction != REMAP_FORWARD && direction != REMAP_BACKWARD)
    return rm_context_fail(ctx, REMAP_BAD_ARGUMENT, "direction is %d, neither forward nor backward", (int)direction);
  return finish_timed(ctx, direction, reports, true);
}

remap_status remap_field(remap_context *ctx, remap_direction direction, const remap_transfer *transfer, int num_fields,
                         const remap_field_desc *fields, remap_field_report *reports)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  RM_TRY(start_timed(ctx, direction, transfer, num_fields, fields, reports ? WITH_REPORTS : WITHOUT_REPORTS));
  return finish_timed(ctx, direction, reports, false);
}

bool rm_context_is_busy(const remap_context *ctx)
{
  return rm_carrier_is_under_way(ctx->carrier[0]) || rm_carrier_is_under_way(ctx->carrier[1]);
}

void rm_context_drop_carriers(remap_context *ctx)
{
  for (int d = 0; d < 2; d++) {
    rm_carrier_abandon(ctx->carrier[d]);
    rm_arena_drop(ctx->carrier_arena[d]);
    ctx->carrier[d]       = NULL;
    ctx->carrier_arena[d] = NULL;
  }
}
