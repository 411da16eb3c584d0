/* zones -- do zones of one mesh overlap? Cells beside skins come together for this alone (rm_part_skins), before the overlay
 * and its memory; meshes without zones pay nothing. */
#include "api/context.h"

#include <math.h>
#include "moments/zone_overlap.h"

/* The zone of each cell of this rank. Not collective. */
static remap_status list_zones(const remap_context *ctx, int side, rm_arena *arena, rm_lid **out)
{
  const rm_labels *labels = &ctx->labels[side];
  const rm_mesh   *mesh   = ctx->mesh[side];

  if (!arena) return REMAP_NO_MEMORY;
  RM_NEW(*out, arena, mesh->num_cells);
  for (rm_lid c = 0; c < mesh->num_cells; c++)
    (*out)[c] = (rm_lid)rm_interval_of(labels->num_zones, labels->zone_cell_offset, mesh->cell_global[c]);
  return REMAP_OK;
}

/* The largest coordinate of a mesh over all ranks. */
static remap_status find_magnitude(const remap_context *ctx, int side, double *out)
{
  *out = 0;
  for (rm_lid c = 0; c < ctx->mesh[side]->num_cells; c++)
    for (int k = 0; k < 6; k++) *out = fmax(*out, fabs(ctx->mesh[side]->cell_box[c][k]));
  return rm_comm_max_f64(&ctx->comm, out, 1);
}

/* The largest overlap among the pairs that come to this rank. Collective. */
static remap_status find_overlap(remap_context *ctx, int side, rm_zone_overlap *out, rm_reason *reason)
{
  rm_arena    *arena = rm_arena_new();
  rm_lid      *zone  = NULL;
  double       magnitude;
  rm_skins     skins;
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(&ctx->comm, list_zones(ctx, side, arena, &zone), NULL));
  RM_GOTO(done, status = find_magnitude(ctx, side, &magnitude));
  RM_GOTO(done, status = rm_part_skins(arena, &ctx->comm, &ctx->frame, ctx->mesh, side, zone, &skins, reason));
  status = rm_zone_overlap_find(&ctx->frame, &skins, ctx->options.faces, magnitude, out, reason);
  status = rm_comm_agree_reason(&ctx->comm, status, reason);
done:
  rm_arena_drop(arena);
  return status;
}

/* The largest over all ranks, and of several such that of the lowest cells. Collective. */
static remap_status find_largest(remap_context *ctx, int side, const rm_zone_overlap *mine)
{
  const double unit = 1 / ctx->frame.scale;
  double  volume  = mine->volume;
  int64_t cell[2] = {INT64_MIN, INT64_MIN}; /* negated, so that the lowest wins */

  RM_TRY(rm_comm_max_f64(&ctx->comm, &volume, 1));
  if (volume > 0 && mine->volume == volume) cell[0] = -mine->cell[0];
  RM_TRY(rm_comm_max_i64(&ctx->comm, &cell[0], 1));
  if (volume > 0 && mine->volume == volume && -mine->cell[0] == cell[0]) cell[1] = -mine->cell[1];
  RM_TRY(rm_comm_max_i64(&ctx->comm, &cell[1], 1));
  ctx->stats.zone_overlap[side] = volume * (unit * unit * unit);
  for (int k = 0; k < 2; k++) ctx->stats.zone_overlap_cell[side][k] = volume > 0 ? -cell[k] : -1;
  return REMAP_OK;
}

/* Collective. */
static remap_status compare_zones(remap_context *ctx, int side, rm_reason *reason)
{
  int64_t         num = ctx->labels[side].num_zones;
  rm_zone_overlap mine;

  for (int k = 0; k < 2; k++) ctx->stats.zone_overlap_cell[side][k] = -1;
  RM_TRY(rm_comm_max_i64(&ctx->comm, &num, 1)); /* a rank without cells need not say */
  if (num < 2) return REMAP_OK;
  RM_TRY(find_overlap(ctx, side, &mine, reason));
  return find_largest(ctx, side, &mine);
}

remap_status rm_context_compare_zones(remap_context *ctx, rm_reason *reason)
{
  for (int side = 0; side < 2; side++) RM_TRY(compare_zones(ctx, side, reason));
  for (int side = 0; ctx->options.zone_overlap_is_error && side < 2; side++) {
    const rm_labels *labels = &ctx->labels[side];
    const rm_gid     other  = ctx->stats.zone_overlap_cell[side][1];
    const int64_t    zone   = rm_interval_of(labels->num_zones, labels->zone_cell_offset, other);

    if (other < 0) continue;
    return rm_fail(REMAP_ZONE_OVERLAP, reason, side, ctx->stats.zone_overlap_cell[side][0],
                   "it overlaps cell %lld of zone %s by more than rounding; choose one of the overlapping bases or zones",
                   (long long)(zone < 0 ? other : other - labels->zone_cell_offset[zone] + 1),
                   zone < 0 ? "?" : labels->zone[zone]);
  }
  return REMAP_OK;
}
