/* build -- remap_build: the stages in order, one agreement each. What only the overlay needs lives in an arena that ends with it. */
#include "api/context.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include "moments/zone_overlap.h"

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

  *out = (rm_labels){.mesh = copy_text(arena, given->name ? given->name : side == REMAP_SOURCE ? "source mesh" : "target mesh")};
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

/* ---- stages ------------------------------------------------------------------------------------------------------- */

/* Every stage's end: one status for all, and the first failing rank's reason. */
static remap_status stage(remap_context *ctx, remap_status mine, rm_reason *reason)
{
  return rm_comm_agree_reason(&ctx->comm, mine, reason);
}

static remap_status report_progress(remap_context *ctx, const char *phase, double done)
{
  return ctx->options.progress && ctx->options.progress(ctx->options.user, phase, done) ? REMAP_CANCELLED : REMAP_OK;
}

static remap_status read_meshes(remap_context *ctx, rm_arena *passing, rm_reason *reason)
{
  remap_mesh   given[2];
  remap_status status = REMAP_OK;

  for (int side = 0; side < 2 && status == REMAP_OK; side++) {
    if (!ctx->is_set[side])
      status = rm_fail(REMAP_BAD_ORDER, reason, side, -1, "remap_set_mesh was not called for this mesh");
    else
      status = rm_context_join_blocks(ctx->arena, passing, side, ctx->num_blocks[side], ctx->block[side], &given[side],
                                      &ctx->layout[side], reason);
    if (status == REMAP_OK) status = copy_labels(ctx->arena, side, &given[side], &ctx->labels[side], reason);
  }
  RM_TRY(stage(ctx, status, reason));
  RM_TRY(rm_frame_build(&ctx->comm, given, &ctx->frame, reason));
  for (int side = 0; side < 2; side++) {
    RM_TRY(rm_mesh_build(ctx->arena, &ctx->comm, side, &given[side], &ctx->frame, ctx->options.faces, &ctx->mesh[side], reason));
    RM_TRY(stage(ctx, report_progress(ctx, "reading of meshes", 0.5 * (side + 1)), reason));
  }
  return REMAP_OK;
}

/* The largest coordinate of each mesh over all ranks. */
static remap_status find_magnitudes(remap_context *ctx, double magnitude[2])
{
  for (int side = 0; side < 2; side++) {
    magnitude[side] = 0;
    for (rm_lid c = 0; c < ctx->mesh[side]->num_cells; c++)
      for (int k = 0; k < 6; k++) magnitude[side] = fmax(magnitude[side], fabs(ctx->mesh[side]->cell_box[c][k]));
  }
  return rm_comm_max_f64(&ctx->comm, magnitude, 2);
}

/* What happens on this rank alone. */
static remap_status overlay_here(remap_context *ctx, rm_arena *arena, const rm_part *part, const double magnitude[2],
                                 const rm_overlay **overlay, const rm_moments **moments, rm_zone_overlap zones[2],
                                 rm_reason *reason)
{
  const rm_progress progress = {ctx->options.progress, ctx->options.user};
  const rm_trimesh *mesh[2];

  for (int side = 0; side < 2; side++) {
    RM_TRY(rm_trimesh_build(arena, &ctx->frame, &part->piece[side], ctx->options.faces, &mesh[side]));
    RM_TRY(rm_zone_overlap_find(&ctx->frame, &part->piece[side], mesh[side], ctx->options.faces, ctx->labels[side].num_zones,
                                ctx->labels[side].zone_cell_offset, magnitude[side], &zones[side], reason));
  }
  RM_TRY(report_progress(ctx, "triangulation", 1));
  RM_TRY(rm_overlay_build(arena, mesh, part, &progress, overlay, reason));
  RM_TRY(rm_moments_build(arena, part, *overlay, 1, moments));
  return report_progress(ctx, "volumes and moments", 1);
}

/* The largest overlap of two zones over all ranks. */
static remap_status worst_zone_overlap(remap_context *ctx, const rm_zone_overlap mine[2], rm_reason *reason)
{
  for (int side = 0; side < 2; side++) {
    double  volume  = mine[side].volume;
    int64_t cell[2] = {INT64_MIN, INT64_MIN}; /* negated, so that the smallest wins */

    RM_TRY(rm_comm_max_f64(&ctx->comm, &volume, 1));
    if (volume > 0 && mine[side].volume == volume) cell[0] = -mine[side].cell[0];
    RM_TRY(rm_comm_max_i64(&ctx->comm, &cell[0], 1));
    if (volume > 0 && mine[side].volume == volume && -mine[side].cell[0] == cell[0]) cell[1] = -mine[side].cell[1];
    RM_TRY(rm_comm_max_i64(&ctx->comm, &cell[1], 1));
    ctx->stats.zone_overlap[side] = volume;
    for (int k = 0; k < 2; k++) ctx->stats.zone_overlap_cell[side][k] = volume > 0 ? -cell[k] : -1;
  }
  for (int side = 0; ctx->options.zone_overlap_is_error && side < 2; side++) {
    if (ctx->stats.zone_overlap[side] <= 0) continue;
    const rm_labels *labels = &ctx->labels[side];
    const rm_gid     other = ctx->stats.zone_overlap_cell[side][1];
    int64_t          z = labels->num_zones - 1;
    while (z > 0 && labels->zone_cell_offset[z] > other) z--;
    return rm_fail(REMAP_ZONE_OVERLAP, reason, side, ctx->stats.zone_overlap_cell[side][0],
                   "it overlaps cell %lld of zone %s by more than rounding; choose one of the overlapping bases or zones",
                   (long long)(other - labels->zone_cell_offset[z] + 1), labels->zone[z]);
  }
  return REMAP_OK;
}

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
    s->inverted_cells[side]     = ctx->mesh[side]->num_inverted;
    s->worst_inverted_cell[side] = ctx->mesh[side]->worst_inverted;
    s->max_closure_error[side]  = m->max_closure_error[side];
    s->worst_closure_cell[side] = m->worst_closure_cell[side];
    s->zone_overlap[side] *= cubed;
    for (int c = 0; c < 3; c++) s->cells_by_cover[side][c] = m->cells_by_cover[side][c];
  }
  return REMAP_OK;
}

static remap_status build(remap_context *ctx, rm_arena *passing, rm_reason *reason)
{
  const rm_zone    *zone;
  const rm_part    *part;
  const rm_overlay *overlay = NULL;
  const rm_moments *moments = NULL;
  rm_zone_overlap   zones[2];
  double            start = rm_seconds(), magnitude[2];

  RM_TRY(read_meshes(ctx, passing, reason));
  RM_TRY(rm_zone_build(passing, &ctx->comm, ctx->mesh, &zone));
  RM_TRY(rm_part_build(passing, &ctx->comm, &ctx->frame, ctx->mesh, zone, &part, reason));
  RM_TRY(find_magnitudes(ctx, magnitude));
  ctx->stats.seconds_partition = rm_seconds() - start;
  start                        = rm_seconds();
  RM_TRY(stage(ctx, overlay_here(ctx, passing, part, magnitude, &overlay, &moments, zones, reason), reason));
  RM_TRY(worst_zone_overlap(ctx, zones, reason));
  const int64_t crossings = overlay->trace[0].num_crossings + overlay->trace[1].num_crossings;
  RM_TRY(rm_mapping_build(ctx->arena, &ctx->comm, &ctx->frame, ctx->mesh, part, moments, &ctx->mapping, reason));
  ctx->stats.seconds_overlay = rm_seconds() - start;
  return fill_stats(ctx, crossings);
}

remap_status remap_build(remap_context *ctx)
{
  rm_reason    reason  = {-1, -1, ""};
  rm_arena    *passing = NULL;
  remap_status status;

  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  if (rm_context_is_busy(ctx)) {
    rm_fail(REMAP_BAD_ORDER, &reason, -1, -1, "a transfer is under way: remap_field_finish comes first");
    rm_context_explain(ctx, REMAP_BAD_ORDER, &reason);
    return REMAP_BAD_ORDER;
  }
  rm_context_drop_carriers(ctx);
  ctx->mapping = NULL;
  rm_context_drop_masks(ctx);
  rm_arena_drop(ctx->arena);
  ctx->arena    = rm_arena_new();
  passing       = rm_arena_new();
  ctx->is_built = false;
  memset(&ctx->stats, 0, sizeof ctx->stats);
  memset(ctx->stencil, 0, sizeof ctx->stencil);
  memset(ctx->labels, 0, sizeof ctx->labels);
  ctx->seconds_transfer = 0;
  ctx->message[0]       = '\0';
  status                = stage(ctx, ctx->arena && passing ? REMAP_OK : REMAP_NO_MEMORY, &reason);
  if (status == REMAP_OK) status = build(ctx, passing, &reason);
  rm_arena_drop(passing);
  ctx->is_built = status == REMAP_OK;
  for (int d = 0; d < 2; d++) ctx->masked[d] = ctx->mapping;
  if (status != REMAP_OK) rm_context_explain(ctx, status, &reason);
  return status;
}
