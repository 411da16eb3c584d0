/* supermesh -- remap_supermesh, and what belongs to cells and faces of the two meshes taken over to it. */
#include "api/context.h"

#include <string.h>

void remap_supermesh_options_default(remap_supermesh_options *options)
{
  if (options) *options = (remap_supermesh_options){.keep = REMAP_IN_BOTH, .pass_through = 1};
}

void rm_context_drop_super(remap_context *ctx)
{
  rm_arena_drop(ctx->super_arena);
  ctx->super_arena = NULL;
  ctx->super       = NULL;
}

/* Options are good and the same on all ranks; *is_built if every rank has an overlay. Collective. */
static remap_status agree_on_options(remap_context *ctx, const remap_supermesh_options *o, bool has_out, bool *is_built,
                                     rm_reason *reason)
{
  const int64_t mine[5]    = {o->keep, o->aggregate != 0, o->split_concave != 0, o->pass_through != 0, !ctx->is_built};
  int64_t       extreme[9];
  remap_status  status = REMAP_OK;

  if (!has_out) status = rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "the view to fill is NULL");
  else if (o->keep < 1 || o->keep > (REMAP_IN_BOTH | REMAP_IN_SOURCE | REMAP_IN_TARGET))
    status = rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "keep is %d: give a sum of REMAP_IN_ bits", o->keep);
  else if (!ctx->is_built && rm_context_is_busy(ctx))
    status = rm_fail(REMAP_BAD_ORDER, reason, -1, -1, "a transfer is under way: remap_field_finish comes first");
  RM_TRY(rm_comm_agree_reason(&ctx->comm, status, reason));
  for (int k = 0; k < 5; k++) extreme[k] = mine[k];
  for (int k = 0; k < 4; k++) extreme[5 + k] = -mine[k];
  RM_TRY(rm_comm_max_i64(&ctx->comm, extreme, 9));
  for (int k = 0; k < 4; k++)
    if (extreme[k] != -extreme[5 + k])
      return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "the options of remap_supermesh differ from rank to rank");
  *is_built = extreme[4] == 0;
  return REMAP_OK;
}

/* The meshes as they stand, or read now. Collective. */
static remap_status supermesh(remap_context *ctx, const remap_supermesh_options *options, bool has_out, rm_arena *passing,
                              rm_reason *reason)
{
  const rm_progress  progress = {ctx->options.progress, ctx->options.user};
  rm_super_job       job      = {&ctx->comm, &ctx->frame, ctx->mesh, {{0}, {0}}, ctx->options.faces, options, &progress};
  bool               is_new[2] = {true, true}, is_built = false;

  RM_TRY(agree_on_options(ctx, options, has_out, &is_built, reason));
  if (!is_built) {
    ctx->is_built = false;
    for (int side = 0; side < 2; side++) ctx->is_turned[side] = false;
    rm_context_drop_place(ctx);
    RM_TRY(rm_context_read_meshes(ctx, is_new, passing, reason));
  }
  for (int side = 0; side < 2; side++)
    job.zones[side] = (rm_zones){ctx->labels[side].num_zones, ctx->labels[side].zone_cell_offset, ctx->labels[side].zone};
  return rm_super_build(ctx->super_arena, &job, &ctx->super, reason);
}

remap_status remap_supermesh(remap_context *ctx, const remap_supermesh_options *options, remap_supermesh_view *out)
{
  remap_supermesh_options chosen;
  rm_reason               reason = {-1, -1, ""};
  rm_arena               *passing, *own;
  remap_status            status;

  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  passing         = rm_arena_new();
  own             = rm_arena_new();
  ctx->message[0] = '\0';
  remap_supermesh_options_default(&chosen);
  if (options) chosen = *options;
  status = rm_context_start_call(ctx, RM_CALL_SUPERMESH, own && passing ? REMAP_OK : REMAP_NO_MEMORY, &reason);
  if (status == REMAP_OK) { /* the last one stays where the call is refused */
    rm_context_drop_super(ctx);
    ctx->super_arena = own;
    own              = NULL;
    status           = supermesh(ctx, &chosen, out != NULL, passing, &reason);
    if (status != REMAP_OK) rm_context_drop_super(ctx);
  }
  rm_arena_drop(passing);
  rm_arena_drop(own);
  if (status != REMAP_OK) {
    rm_context_explain(ctx, status, &reason);
    return status;
  }
  *out = ctx->super->view;
  return REMAP_OK;
}

/* ---- what belongs to the operands -------------------------------------------------------------------------------- */

/* What can be wrong with a call of the functions below on this rank. Not collective. */
static remap_status may_carry(const remap_context *ctx, remap_side side, bool faces, const void *in, const void *out,
                              rm_reason *reason)
{
  if (!ctx->super) return rm_fail(REMAP_BAD_ORDER, reason, -1, -1, "values are taken over after a successful remap_supermesh");
  if (side != REMAP_SOURCE && side != REMAP_TARGET)
    return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "side is %d, neither source nor target", (int)side);
  const int64_t num_in  = faces ? ctx->mesh[side]->num_faces : ctx->mesh[side]->num_cells;
  const int64_t num_out = faces ? ctx->super->view.num_faces : ctx->super->view.num_cells;

  if ((!in && num_in > 0) || (!out && num_out > 0))
    return rm_fail(REMAP_BAD_ARGUMENT, reason, side, -1, "the values to take over, or the room for them, are NULL");
  return REMAP_OK;
}

/* Values of `size` bytes of the cells or faces of a side. Collective. */
static remap_status carry(remap_context *ctx, remap_side side, bool faces, size_t size, const void *in, const void *none,
                          void *out)
{
  rm_reason    reason = {-1, -1, ""};
  remap_status status = may_carry(ctx, side, faces, in, out, &reason);

  ctx->message[0] = '\0';
  const remap_status entered = rm_context_enter(ctx, RM_CALL_SUPERMESH_VALUES, 2 * (int)side + faces, &reason);

  status = entered == REMAP_OK ? rm_comm_agree_reason(&ctx->comm, status, &reason) : entered;
  if (status == REMAP_OK) {
    const rm_super *s = ctx->super;

    status = faces ? rm_super_fetch(&ctx->comm, s->view.num_faces, s->view.face_from[side], s->view.face_from_rank[side], size,
                                    in, none, out)
                   : rm_super_fetch(&ctx->comm, s->view.num_cells, s->cell_home[side], s->cell_rank[side], size, in, none, out);
  }
  if (status != REMAP_OK) rm_context_explain(ctx, status, &reason);
  return status;
}

remap_status remap_supermesh_cell_values(remap_context *ctx, remap_side side, const double *in, double none, double *out)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  return carry(ctx, side, false, sizeof *in, in, &none, out);
}

remap_status remap_supermesh_face_values(remap_context *ctx, remap_side side, const int32_t *in, int32_t none, int32_t *out)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  return carry(ctx, side, true, sizeof *in, in, &none, out);
}

remap_status remap_supermesh_face_numbers(remap_context *ctx, remap_side side, const int64_t *in, int64_t none, int64_t *out)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  return carry(ctx, side, true, sizeof *in, in, &none, out);
}
