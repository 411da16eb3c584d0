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
  const rm_super_job job      = {&ctx->comm, &ctx->frame, ctx->mesh, ctx->options.faces, options, &progress};
  bool               is_new[2] = {true, true}, is_built = false;

  RM_TRY(agree_on_options(ctx, options, has_out, &is_built, reason));
  if (!is_built) {
    ctx->is_built = false;
    for (int side = 0; side < 2; side++) ctx->is_turned[side] = false;
    rm_context_drop_place(ctx);
    RM_TRY(rm_context_read_meshes(ctx, is_new, passing, reason));
  }
  return rm_super_build(ctx->super_arena, &job, &ctx->super, reason);
}

remap_status remap_supermesh(remap_context *ctx, const remap_supermesh_options *options, remap_supermesh_view *out)
{
  remap_supermesh_options chosen;
  rm_reason               reason = {-1, -1, ""};
  rm_arena               *passing;
  remap_status            status;

  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  ctx->message[0] = '\0';
  remap_supermesh_options_default(&chosen);
  if (options) chosen = *options;
  rm_context_drop_super(ctx);
  ctx->super_arena = rm_arena_new();
  passing          = rm_arena_new();
  status = rm_context_start_call(ctx, RM_CALL_SUPERMESH, ctx->super_arena && passing ? REMAP_OK : REMAP_NO_MEMORY, &reason);
  if (status == REMAP_OK) status = supermesh(ctx, &chosen, out != NULL, passing, &reason);
  rm_arena_drop(passing);
  if (status != REMAP_OK) {
    rm_context_drop_super(ctx);
    rm_context_explain(ctx, status, &reason);
    return status;
  }
  *out = ctx->super->view;
  return REMAP_OK;
}

/* ---- what belongs to the operands -------------------------------------------------------------------------------- */

/* Entities of other ranks that this rank wants. */
typedef struct wants {
  int64_t  num;
  rm_lid  *at;   /* [num] entity of the supermesh */
  int     *rank; /* [num] ascending */
  rm_lid  *item; /* [num] */
} wants;

/* Those of n entities that have an origin, by its rank. */
static remap_status sort_wants(rm_arena *passing, int64_t n, const int32_t *from, const int32_t *from_rank, wants *out)
{
  rm_keyed *key, *spare;

  out->num = 0;
  RM_NEW(key, passing, n);
  RM_NEW(spare, passing, n);
  for (int64_t k = 0; k < n; k++)
    if (from_rank[k] >= 0) key[out->num++] = (rm_keyed){(uint64_t)from_rank[k], k};
  rm_sort_keyed(key, spare, out->num);
  RM_NEW(out->at, passing, out->num);
  RM_NEW(out->rank, passing, out->num);
  RM_NEW(out->item, passing, out->num);
  for (int64_t k = 0; k < out->num; k++) {
    out->at[k]   = (rm_lid)key[k].item;
    out->rank[k] = (int)key[k].key;
    out->item[k] = from[key[k].item];
  }
  return REMAP_OK;
}

/* out[k] = in[origin of k], `size` bytes each, where there is one. Collective. */
static remap_status fetch(remap_context *ctx, rm_arena *passing, int64_t n, const int32_t *from, const int32_t *from_rank,
                          size_t size, const void *in, void *out)
{
  const rm_comm *comm = &ctx->comm;
  const rm_plan *plan;
  wants          w = {0};
  char          *received = NULL, *buffer = NULL;
  remap_status   status;

  RM_TRY(rm_comm_agree(comm, passing ? sort_wants(passing, n, from, from_rank, &w) : REMAP_NO_MEMORY, NULL));
  RM_TRY(rm_plan_build(comm, passing, w.num, w.rank, w.item, &plan));
  received = rm_arena_alloc(passing, w.num, size);
  buffer   = rm_arena_alloc(passing, plan->send_offset[plan->num_send], size);
  status   = received && buffer ? REMAP_OK : REMAP_NO_MEMORY;
  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_TRY(rm_comm_agree(comm, rm_plan_run(comm, plan, size, in, received, buffer), NULL));
  for (int64_t k = 0; k < w.num; k++) memcpy((char *)out + (size_t)w.at[k] * size, received + (size_t)k * size, size);
  return REMAP_OK;
}

/* What can be wrong with a call of the two functions below. Collective. */
static remap_status may_fetch(remap_context *ctx, remap_side side, const void *in, const void *out, bool faces)
{
  remap_status status = REMAP_OK;

  ctx->message[0] = '\0';
  if (!ctx->super) {
    status = REMAP_BAD_ORDER;
  } else if (side != REMAP_SOURCE && side != REMAP_TARGET) {
    status = REMAP_BAD_ARGUMENT;
  } else {
    const int64_t num_in  = faces ? ctx->mesh[side]->num_faces : ctx->mesh[side]->num_cells;
    const int64_t num_out = faces ? ctx->super->view.num_faces : ctx->super->view.num_cells;
    if ((!in && num_in > 0) || (!out && num_out > 0)) status = REMAP_BAD_ARGUMENT;
  }
  return rm_comm_agree(&ctx->comm, status, NULL);
}

remap_status remap_supermesh_cell_values(remap_context *ctx, remap_side side, const double *in, double none, double *out)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  RM_TRY(may_fetch(ctx, side, in, out, false));
  rm_arena    *passing = rm_arena_new();
  remap_status status;

  for (int64_t c = 0; c < ctx->super->view.num_cells; c++) out[c] = none;
  status = fetch(ctx, passing, ctx->super->view.num_cells, ctx->super->cell_home[side], ctx->super->cell_rank[side], sizeof *in,
                 in, out);
  rm_arena_drop(passing);
  return status;
}

remap_status remap_supermesh_face_values(remap_context *ctx, remap_side side, const int32_t *in, int32_t none, int32_t *out)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  RM_TRY(may_fetch(ctx, side, in, out, true));
  const remap_supermesh_view *v = &ctx->super->view;
  rm_arena                   *passing = rm_arena_new();
  remap_status                status;

  for (int64_t f = 0; f < v->num_faces; f++) out[f] = none;
  status = fetch(ctx, passing, v->num_faces, v->face_from[side], v->face_from_rank[side], sizeof *in, in, out);
  rm_arena_drop(passing);
  return status;
}
