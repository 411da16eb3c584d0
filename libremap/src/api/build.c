/* build -- remap_build and remap_move: the stages in order, one agreement each. What only the overlay needs lives in an arena
 * that ends with it. */
#include "api/context.h"

#include <stdio.h>
#include <string.h>

/* ---- stages ------------------------------------------------------------------------------------------------------- */

/* Every stage's end: one status for all, and the first failing rank's reason. */
static remap_status stage(remap_context *ctx, remap_status mine, rm_reason *reason)
{
  return rm_comm_agree_reason(&ctx->comm, mine, reason);
}

/* Do pairs have second moments? */
static bool has_second(const remap_context *ctx) { return ctx->options.max_order > 2 || ctx->options.systems; }

/* One of a rank's blocks, of which progress is told as of one. */
typedef struct turn {
  remap_context *ctx;
  int            block, num_blocks;
} turn;

static remap_status tell(const turn *t, const char *phase, double done)
{
  return rm_context_progress(t->ctx, phase, (t->block + done) / t->num_blocks);
}

static int tell_of_overlay(void *user, const char *phase, double done) { return tell(user, phase, done) != REMAP_OK; }

/* Crossings, segments and the pairs they make, which stay in arena; the overlay itself ends here. Not collective. */
static remap_status overlay_pairs(turn *t, rm_arena *arena, int64_t *crossings, const rm_moments **moments, rm_reason *reason)
{
  const remap_context *ctx      = t->ctx;
  const rm_progress    progress = {tell_of_overlay, t};
  const rm_part       *part     = &ctx->place.part;
  rm_arena            *own      = rm_arena_new();
  const rm_overlay    *overlay;
  remap_status         status = own ? REMAP_OK : REMAP_NO_MEMORY;

  if (status == REMAP_OK) status = rm_overlay_build(own, ctx->place.trimesh, part, &progress, &overlay, reason);
  if (status == REMAP_OK) status = rm_moments_build(arena, part, overlay, has_second(ctx) ? 2 : 1, moments);
  if (status == REMAP_OK) *crossings += overlay->trace[0].num_crossings + overlay->trace[1].num_crossings;
  rm_arena_drop(own);
  return status;
}

/* A block: its cells taken, overlaid, and the pairs added; the next overlay may use the triangles if it keeps them. *seconds
 * grows by what the first takes. Not collective. */
static remap_status overlay_block(turn *t, bool keeps, rm_gathering *gathering, int64_t *crossings, double *seconds,
                                  rm_reason *reason)
{
  remap_context    *ctx   = t->ctx;
  const double      start = rm_seconds();
  const rm_moments *moments;
  rm_arena         *arena;
  remap_status      status;

  RM_TRY(rm_context_take_block(ctx, t->block, reason));
  *seconds += rm_seconds() - start;
  for (int side = 0; side < 2; side++) RM_TRY(rm_context_triangulate(ctx, side));
  RM_TRY(tell(t, "triangulation", 1));
  arena = rm_arena_new();
  RM_GOTO(done, status = arena ? overlay_pairs(t, arena, crossings, &moments, reason) : REMAP_NO_MEMORY);
  for (int side = 0; side < 2 && !keeps; side++) rm_context_drop_triangles(ctx, side);
  RM_GOTO(done, status = rm_mapping_add(gathering, &ctx->place.part, moments));
  status = tell(t, "volumes and moments", 1);
done:
  rm_arena_drop(arena);
  return status;
}

/* What happens on this rank alone, block by block. Not collective: a rank that fails ends its own blocks. */
static remap_status overlay_here(remap_context *ctx, bool keeps, rm_gathering *gathering, int64_t *crossings, double *seconds,
                                 rm_reason *reason)
{
  turn         t      = {ctx, 0, rm_part_blocks(ctx->place.routes)};
  remap_status status = gathering ? REMAP_OK : REMAP_NO_MEMORY;

  for (; t.block < t.num_blocks && status == REMAP_OK; t.block++)
    status = overlay_block(&t, keeps, gathering, crossings, seconds, reason);
  return status;
}

/* All blocks, and the mapping of the pairs that they make. *seconds is what it takes to bring cells together. Collective. */
static remap_status overlay_all(remap_context *ctx, bool keeps, int64_t *crossings, double *seconds, rm_reason *reason)
{
  rm_gathering *gathering = rm_mapping_open(ctx->mesh, has_second(ctx), ctx->slice);
  remap_status  status    = stage(ctx, overlay_here(ctx, keeps, gathering, crossings, seconds, reason), reason);

  if (!keeps) rm_context_drop_place(ctx);
  if (status == REMAP_OK)
    status = rm_mapping_close(ctx->arena, gathering, &ctx->comm, &ctx->frame, ctx->mesh, &ctx->mapping, reason);
  rm_gathering_drop(gathering);
  return status;
}

/* ---- all of it ---------------------------------------------------------------------------------------------------- */

static remap_status fill_stats(remap_context *ctx, int64_t crossings)
{
  remap_stats  *s = &ctx->stats;
  const double  unit = 1 / ctx->frame.scale, cubed = unit * unit * unit;
  const rm_mapping *m = ctx->mapping;

  RM_TRY(rm_comm_sum_i64(&ctx->comm, &crossings, 1));
  RM_TRY(rm_comm_max_f64(&ctx->comm, &s->seconds_partition, 1));
  RM_TRY(rm_comm_max_f64(&ctx->comm, &s->seconds_overlay, 1));
  s->ranks          = ctx->comm.size;
  s->crossings      = crossings;
  s->pairs          = m->num_pairs;
  s->overlap_volume = m->overlap_volume * cubed;
  for (int side = 0; side < 2; side++) {
    s->cells[side]              = ctx->mesh[side]->num_global_cells;
    s->volume[side]             = ctx->mesh[side]->volume * cubed;
    s->solver_volume[side]         = ctx->solver_volume[side];
    s->max_volume_difference[side] = ctx->max_volume_difference[side];
    s->worst_volume_cell[side]     = ctx->worst_volume_cell[side];
    s->inverted_cells[side]     = ctx->mesh[side]->num_inverted;
    s->worst_inverted_cell[side] = ctx->mesh[side]->worst_inverted;
    s->max_closure_error[side]  = m->max_closure_error[side];
    s->worst_closure_cell[side] = m->worst_closure_cell[side];
    for (int c = 0; c < 3; c++) {
      s->cells_by_cover[side][c]  = m->cells_by_cover[side][c];
      s->volume_by_cover[side][c] = m->volume_by_cover[side][c] * cubed;
    }
  }
  return REMAP_OK;
}

/* Read meshes that are new, as rm_context_read_meshes; what only that needs ends with it. Collective. */
static remap_status read_meshes(remap_context *ctx, bool is_new[2], rm_reason *reason)
{
  rm_arena    *passing = rm_arena_new();
  remap_status status  = stage(ctx, passing ? REMAP_OK : REMAP_NO_MEMORY, reason);

  if (status == REMAP_OK) status = rm_context_read_meshes(ctx, is_new, passing, reason);
  rm_arena_drop(passing);
  return status;
}

/* The overlay of meshes that move or are new, which are read again, and of others, which are as they were. Collective. */
static remap_status build(remap_context *ctx, const bool moves[2], bool keeps, rm_reason *reason)
{
  int64_t         crossings = 0;
  bool            is_new[2] = {moves[0], moves[1]};
  const double    start = rm_seconds();
  double          seconds;

  RM_TRY(read_meshes(ctx, is_new, reason));
  RM_TRY(rm_context_compare_zones(ctx, reason));
  RM_TRY(rm_context_place(ctx, is_new, keeps, reason));
  seconds = rm_seconds() - start;
  RM_TRY(overlay_all(ctx, keeps, &crossings, &seconds, reason));
  RM_TRY(rm_context_compare_volumes(ctx));
  ctx->stats.seconds_partition = seconds;
  ctx->stats.seconds_overlay   = rm_seconds() - start - seconds;
  return fill_stats(ctx, crossings);
}

/* Drop what rests on the last overlay and make a new one. keeps: the next one may use what this one can. Collective. */
static remap_status build_anew(remap_context *ctx, const bool moves[2], bool keeps, rm_reason *reason)
{
  remap_status status;

  rm_context_drop_carriers(ctx);
  ctx->mapping = NULL;
  rm_context_drop_masks(ctx);
  rm_context_drop_super(ctx);
  ctx->parley = ctx->few;
  rm_arena_drop(ctx->arena);
  ctx->arena    = rm_arena_new();
  ctx->is_built = false;
  memset(&ctx->stats, 0, sizeof ctx->stats);
  ctx->seconds_transfer = 0;
  status                = stage(ctx, ctx->arena ? REMAP_OK : REMAP_NO_MEMORY, reason);
  if (status == REMAP_OK) status = build(ctx, moves, keeps, reason);
  ctx->is_built = status == REMAP_OK;
  if (!ctx->is_built || !keeps) rm_context_drop_place(ctx);
  for (int d = 0; d < 2; d++) ctx->masked[d] = ctx->mapping;
  return status;
}

remap_status remap_build(remap_context *ctx)
{
  static const bool both[2] = {true, true};
  rm_reason         reason  = {-1, -1, ""};
  remap_status      status  = REMAP_OK;

  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  ctx->message[0] = '\0';
  if (rm_context_is_busy(ctx))
    status = rm_fail(REMAP_BAD_ORDER, &reason, -1, -1, "a transfer is under way: remap_field_finish comes first");
  status = rm_context_start_call(ctx, RM_CALL_BUILD, status, &reason);
  if (status == REMAP_OK) {
    for (int side = 0; side < 2; side++) ctx->is_turned[side] = false;
    rm_context_drop_place(ctx);
    status = build_anew(ctx, both, false, &reason);
  }
  if (status != REMAP_OK) rm_context_explain(ctx, status, &reason);
  return status;
}

/* Take a mesh's new position over; true if it has one on this rank. */
static bool take_motion(remap_context *ctx, int side, const remap_motion *motion)
{
  for (int b = 0; motion->node_xyz && b < ctx->num_blocks[side]; b++) ctx->block[side][b].node_xyz = motion->node_xyz[b];
  if (!motion->node_xyz && !motion->matrix) return false;
  ctx->is_turned[side] = motion->matrix != NULL;
  if (motion->matrix) memcpy(ctx->matrix[side], motion->matrix, sizeof ctx->matrix[side]);
  return true;
}

remap_status remap_move(remap_context *ctx, const remap_motion motion[2])
{
  rm_reason    reason = {-1, -1, ""};
  remap_status status = REMAP_OK;

  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  ctx->message[0] = '\0';
  if (!ctx->is_built)
    status = rm_fail(REMAP_BAD_ORDER, &reason, -1, -1,
                     "remap_move needs a successful remap_build of meshes that were not set since");
  else if (rm_context_is_busy(ctx))
    status = rm_fail(REMAP_BAD_ORDER, &reason, -1, -1, "a transfer is under way: remap_field_finish comes first");
  else if (!motion)
    status = rm_fail(REMAP_BAD_ARGUMENT, &reason, -1, -1, "motion is NULL");
  status = rm_context_start_call(ctx, RM_CALL_MOVE, status, &reason);
  if (status == REMAP_OK) {
    int64_t any[2];

    for (int side = 0; side < 2; side++) any[side] = take_motion(ctx, side, &motion[side]);
    status = rm_comm_max_i64(&ctx->comm, any, 2);
    if (status == REMAP_OK) status = build_anew(ctx, (const bool[2]){any[0] != 0, any[1] != 0}, true, &reason);
  }
  if (status != REMAP_OK) rm_context_explain(ctx, status, &reason);
  return status;
}
