/* read -- the caller's meshes as room mesh has them. A mesh that has not moved is kept from the last overlay, unless the
 * frame's scale has changed; so is its stencil, unless the frame has. O(n) for what is read. */
#include "api/context.h"

#include <math.h>
#include <string.h>

/* ---- names -------------------------------------------------------------------------------------------------------- */

static const char *copy_text(rm_arena *arena, const char *text)
{
  const size_t n    = strlen(text) + 1;
  char        *copy = rm_arena_alloc(arena, (int64_t)n, 1);
  return copy ? memcpy(copy, text, n) : NULL;
}

static remap_status copy_labels(rm_arena *arena, int side, const remap_mesh *given, rm_labels *out, rm_reason *reason)
{
  const char **zone;
  int64_t     *offset;
  const char  *name = given->name ? given->name : side == REMAP_SOURCE ? "source mesh" : "target mesh";

  *out = (rm_labels){.mesh = copy_text(arena, name)};
  if (!out->mesh) return REMAP_NO_MEMORY;
  if (given->num_zones == 0) return REMAP_OK;
  if (given->num_zones < 0 || !given->zone_name || !given->zone_cell_offset)
    return rm_fail(REMAP_BAD_MESH, reason, side, -1, "num_zones is %lld but zone_name or zone_cell_offset is missing",
                   (long long)given->num_zones);
  RM_NEW(zone, arena, given->num_zones);
  RM_NEW(offset, arena, given->num_zones + 1);
  for (int64_t z = 0; z <= given->num_zones; z++) {
    offset[z] = given->zone_cell_offset[z];
    if (z > 0 && offset[z] < offset[z - 1])
      return rm_fail(REMAP_BAD_MESH, reason, side, -1, "zone_cell_offset descends at zone %lld", (long long)z);
  }
  for (int64_t z = 0; z < given->num_zones; z++) {
    zone[z] = copy_text(arena, given->zone_name[z] ? given->zone_name[z] : "unnamed");
    if (!zone[z]) return REMAP_NO_MEMORY;
  }
  out->zone_cell_offset = offset;
  out->zone             = zone;
  out->num_zones        = given->num_zones;
  return REMAP_OK;
}

/* ---- meshes ------------------------------------------------------------------------------------------------------- */

remap_status rm_context_progress(remap_context *ctx, const char *phase, double done)
{
  return ctx->options.progress && ctx->options.progress(ctx->options.user, phase, done) ? REMAP_CANCELLED : REMAP_OK;
}

/* Nodes where the matrix puts them. */
static remap_status turn(rm_arena *passing, const double matrix[12], remap_mesh *given)
{
  const double *m = matrix;
  double       *xyz;

  if (given->num_nodes < 0 || !given->node_xyz) return REMAP_OK; /* room mesh says so */
  RM_NEW(xyz, passing, rm_mul_sat(given->num_nodes, 3));
  for (int64_t i = 0; i < given->num_nodes; i++) {
    const double *x = given->node_xyz + 3 * i;

    for (int r = 0; r < 3; r++) xyz[3 * i + r] = m[4 * r] * x[0] + m[4 * r + 1] * x[1] + m[4 * r + 2] * x[2] + m[4 * r + 3];
  }
  given->node_xyz = xyz;
  return REMAP_OK;
}

/* Forget a mesh and take a new arena for it. */
static remap_status renew(remap_context *ctx, int side)
{
  rm_arena_drop(ctx->mesh_arena[side]);
  ctx->mesh[side]       = NULL;
  ctx->labels[side]     = (rm_labels){0};
  ctx->mesh_arena[side] = rm_arena_new();
  return ctx->mesh_arena[side] ? REMAP_OK : REMAP_NO_MEMORY;
}

/* One side's arrays as room mesh reads them. Not collective. */
static remap_status read_side(remap_context *ctx, rm_arena *passing, int side, remap_mesh *given, rm_reason *reason)
{
  RM_TRY(renew(ctx, side));
  if (!ctx->is_set[side])
    return rm_fail(REMAP_BAD_ORDER, reason, side, -1, "remap_set_mesh was not called for this mesh");
  RM_TRY(rm_context_join_blocks(ctx->mesh_arena[side], passing, side, ctx->num_blocks[side], ctx->block[side], given,
                                &ctx->layout[side], reason));
  if (ctx->is_turned[side]) RM_TRY(turn(passing, ctx->matrix[side], given));
  return copy_labels(ctx->mesh_arena[side], side, given, &ctx->labels[side], reason);
}

/* The stencil of a mesh is ordered along the frame's curve: it ends with the frame. */
static void drop_stencil(remap_context *ctx, int side)
{
  rm_arena_drop(ctx->stencil_arena[side]);
  ctx->stencil_arena[side] = NULL;
  ctx->stencil[side]       = NULL;
  ctx->wide[side]          = NULL;
  ctx->second[side]        = NULL;
}

/* The arrays of the sides that are read, and the frame of both. Collective. */
static remap_status find_frame(remap_context *ctx, bool is_read[2], rm_arena *passing, remap_mesh given[2], rm_reason *reason)
{
  const rm_frame before = ctx->frame;
  remap_status   status = REMAP_OK;

  for (int side = 0; side < 2 && status == REMAP_OK; side++)
    if (is_read[side]) status = read_side(ctx, passing, side, &given[side], reason);
  RM_TRY(rm_comm_agree_reason(&ctx->comm, status, reason));
  for (int side = 0; side < 2; side++)
    if (is_read[side]) RM_TRY(rm_frame_extent(&ctx->comm, side, &given[side], ctx->extent[side], reason));
  rm_frame_of((const double(*)[6])ctx->extent, &ctx->frame);
  for (int side = 0; side < 2; side++) {
    if (is_read[side] || memcmp(&before, &ctx->frame, sizeof before)) drop_stencil(ctx, side);
    if (is_read[side] || !(before.scale < ctx->frame.scale || before.scale > ctx->frame.scale)) continue;
    is_read[side] = true; /* the same on every rank */
    RM_TRY(rm_comm_agree_reason(&ctx->comm, read_side(ctx, passing, side, &given[side], reason), reason));
  }
  return REMAP_OK;
}

remap_status rm_context_read_meshes(remap_context *ctx, bool is_new[2], rm_arena *passing, rm_reason *reason)
{
  remap_mesh given[2];

  RM_TRY(find_frame(ctx, is_new, passing, given, reason));
  const double unit = 1 / ctx->frame.scale, cubed = unit * unit * unit; /* the same on all ranks */
  if (!isnormal(cubed) || !isnormal(cubed * unit * unit))
    return rm_fail(REMAP_BAD_MESH, reason, -1, -1,
                   "the largest coordinate is about %.1g: volumes and moments are no doubles in this unit", unit);
  for (int side = 0; side < 2; side++) {
    if (is_new[side])
      RM_TRY(rm_mesh_build(ctx->mesh_arena[side], &ctx->comm, side, &given[side], &ctx->frame, ctx->options.faces,
                           &ctx->mesh[side], reason));
    if (is_new[side]) RM_TRY(rm_context_measure(ctx, side, &given[side], reason));
    RM_TRY(rm_comm_agree_reason(&ctx->comm, rm_context_progress(ctx, "checking of meshes", 0.5 * (side + 1)), reason));
  }
  return REMAP_OK;
}

void rm_context_drop_meshes(remap_context *ctx)
{
  for (int side = 0; side < 2; side++) {
    drop_stencil(ctx, side);
    rm_arena_drop(ctx->mesh_arena[side]);
    ctx->mesh_arena[side] = NULL;
  }
}
