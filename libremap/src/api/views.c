/* views -- what callers may look at after remap_build, in their own unit. */
#include "api/context.h"

#include <math.h>
#include <stdlib.h>

/* The pairs of a side's cells as receivers, those of masked cells left out. */
static const rm_rows *rows_of(const remap_context *ctx, remap_side side)
{
  return &ctx->masked[side == REMAP_TARGET ? REMAP_FORWARD : REMAP_BACKWARD]->rows[side];
}

remap_status rm_context_need_pairs(remap_context *ctx)
{
  const rm_mapping *before = ctx->mapping;

  if (before->rows[REMAP_SOURCE].volume) return REMAP_OK;
  RM_TRY(rm_mapping_complete(ctx->arena, ctx->mesh, before, &ctx->mapping));
  for (int d = 0; d < 2; d++)
    if (ctx->masked[d] == before) ctx->masked[d] = ctx->mapping;
  return REMAP_OK;
}

static bool is_side(remap_side side) { return side == REMAP_SOURCE || side == REMAP_TARGET; }

remap_status remap_get_stats(remap_context *ctx, remap_stats *out)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  RM_TRY(rm_context_check_view(ctx, out != NULL, "remap_get_stats"));
  *out                  = ctx->stats;
  out->seconds_transfer = ctx->seconds_transfer;
  return REMAP_OK;
}

remap_status remap_cells(remap_context *ctx, remap_side side, double *volume, double *centroid)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  RM_TRY(rm_context_check_view(ctx, is_side(side), "remap_cells"));
  const rm_mesh *m = ctx->mesh[side];
  const double   unit = 1 / ctx->frame.scale, cubed = unit * unit * unit;

  for (rm_lid c = 0; c < m->num_cells; c++) {
    if (volume) volume[c] = m->cell_volume[c] * cubed;
    if (centroid)
      for (int a = 0; a < 3; a++) centroid[3 * (int64_t)c + a] = m->cell_centroid[c][a] * unit;
  }
  return REMAP_OK;
}

/* The share of a cell that its pairs cover. */
static double fraction_of(const remap_context *ctx, remap_side side, const rm_rows *rows, rm_lid cell)
{
  const double own = ctx->mesh[side]->cell_volume[cell];

  return rows->cover[cell] == REMAP_COVERED ? 1 : fabs(own) > 0 ? rm_row_volume(rows, cell) / own : 0;
}

remap_status remap_coverage(remap_context *ctx, remap_side side, double *fraction, remap_cover *cover)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  RM_TRY(rm_context_check_view(ctx, is_side(side), "remap_coverage"));
  if (side == REMAP_SOURCE && fraction && rm_context_need_pairs(ctx) != REMAP_OK)
    return rm_context_fail(ctx, REMAP_NO_MEMORY, "remap_coverage: no memory for the pairs of this rank: use more ranks");
  const rm_rows *rows = rows_of(ctx, side);

  for (rm_lid c = 0; c < rows->num_cells; c++) {
    if (fraction) fraction[c] = fraction_of(ctx, side, rows, c);
    if (cover) cover[c] = (remap_cover)rows->cover[c];
  }
  return REMAP_OK;
}

remap_status remap_uncovered(remap_context *ctx, remap_side side, int64_t *num, int64_t *cell)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  RM_TRY(rm_context_check_view(ctx, num && is_side(side), "remap_uncovered"));
  const rm_rows *rows = rows_of(ctx, side);
  int64_t        n    = 0;

  for (rm_lid c = 0; c < rows->num_cells; c++) {
    if (rows->cover[c] != REMAP_UNCOVERED) continue;
    if (cell) cell[n] = c;
    n++;
  }
  *num = n;
  return REMAP_OK;
}

/* Ascending by coverage; equal ones by place, then by global id. */
static int compare_partial(const void *first, const void *second)
{
  const remap_partial_cell *a = first, *b = second;

  if (a->fraction < b->fraction || a->fraction > b->fraction) return a->fraction < b->fraction ? -1 : 1;
  for (int d = 0; d < 3; d++)
    if (a->centroid[d] < b->centroid[d] || a->centroid[d] > b->centroid[d]) return a->centroid[d] < b->centroid[d] ? -1 : 1;
  return (a->global_cell > b->global_cell) - (a->global_cell < b->global_cell);
}

/* This rank's partial cells, sorted. */
static remap_status list_partial(rm_arena *scratch, const remap_context *ctx, remap_side side, int64_t *num,
                                 remap_partial_cell **out)
{
  const rm_rows *rows = rows_of(ctx, side);
  const rm_mesh *mesh = ctx->mesh[side];
  const double   unit = 1 / ctx->frame.scale, cubed = unit * unit * unit;

  *num = 0;
  for (rm_lid c = 0; c < rows->num_cells; c++) *num += rows->cover[c] == REMAP_PARTIAL;
  RM_NEW(*out, scratch, *num);
  *num = 0;
  for (rm_lid c = 0; c < rows->num_cells; c++) {
    const double *x = mesh->cell_centroid[c];

    if (rows->cover[c] != REMAP_PARTIAL) continue;
    (*out)[(*num)++] = (remap_partial_cell){mesh->cell_global[c], fraction_of(ctx, side, rows, c), mesh->cell_volume[c] * cubed,
                                            {x[0] * unit, x[1] * unit, x[2] * unit}};
  }
  qsort(*out, (size_t)*num, sizeof **out, compare_partial);
  return REMAP_OK;
}

/* Collective. */
static remap_status gather_partial(rm_arena *scratch, const remap_context *ctx, remap_side side, int most, int *num,
                                   remap_partial_cell *cell)
{
  int64_t            *offset = rm_arena_alloc(scratch, (int64_t)ctx->comm.size + 1, sizeof *offset), own = 0, all;
  remap_partial_cell *mine   = NULL;
  void               *got    = NULL;
  remap_status        status = offset ? list_partial(scratch, ctx, side, &own, &mine) : REMAP_NO_MEMORY;

  RM_TRY(rm_comm_agree(&ctx->comm, status, NULL));
  RM_ASSERT(offset && mine);
  RM_TRY(rm_comm_allgatherv(&ctx->comm, scratch, mine, own < most ? own : most, sizeof *mine, offset, &got));
  all = offset[ctx->comm.size];
  qsort(got, (size_t)all, sizeof *mine, compare_partial);
  *num = (int)(all < most ? all : most);
  for (int k = 0; k < *num; k++) cell[k] = ((const remap_partial_cell *)got)[k];
  return REMAP_OK;
}

remap_status remap_partial_cells(remap_context *ctx, remap_side side, int *num, remap_partial_cell *cell)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  rm_reason    reason  = {-1, -1, ""};
  rm_arena    *scratch = rm_arena_new();
  int64_t      room[2] = {num ? *num : -1, num ? -*num : 1};
  remap_status status =
      rm_context_check_view(ctx, is_side(side) && room[0] >= 0 && (room[0] == 0 || cell), "remap_partial_cells");

  if (status != REMAP_OK) rm_fail(status, &reason, -1, -1, "%s", ctx->message);
  if (!scratch) status = REMAP_NO_MEMORY;
  if (status == REMAP_OK && side == REMAP_SOURCE) status = rm_context_need_pairs(ctx);
  RM_GOTO(done, status = rm_context_start_call(ctx, RM_CALL_PARTIAL_CELLS, status, &reason));
  RM_GOTO(done, status = rm_comm_max_i64(&ctx->comm, room, 2));
  status = room[0] == -room[1]
             ? gather_partial(scratch, ctx, side, (int)room[0], num, cell)
             : rm_fail(REMAP_BAD_ARGUMENT, &reason, -1, -1, "remap_partial_cells: *num differs between ranks");
done:
  rm_arena_drop(scratch);
  if (status != REMAP_OK) rm_context_explain(ctx, status, &reason);
  return status;
}

/* The pairs of a direction in the caller's unit. The arrays live in arena. */
static remap_status copy_pairs(rm_arena *arena, const rm_rows *rows, double unit, remap_pairs_view *out)
{
  const double  cubed = unit * unit * unit;
  const int64_t n     = rows->offset[rows->num_cells];
  int64_t      *global;
  int          *rank;
  double       *volume, *moment, *second = NULL;
  uint8_t      *same;

  RM_NEW(global, arena, n);
  RM_NEW(rank, arena, n);
  RM_NEW(volume, arena, n);
  RM_NEW(moment, arena, 3 * n);
  RM_NEW(same, arena, n);
  if (rows->second) RM_NEW(second, arena, 6 * n);
  for (int64_t k = 0; k < n; k++) {
    global[k] = rows->giver_global[rows->giver[k]];
    rank[k]   = rows->giver_rank[rows->giver[k]];
    volume[k] = rows->volume[k] * cubed;
    for (int a = 0; a < 3; a++) moment[3 * k + a] = rows->moment[k][a] * cubed * unit;
    for (int a = 0; a < 6 && second; a++) second[6 * k + a] = rows->second[k][a] * cubed * unit * unit;
  }
  for (rm_lid c = 0; c < rows->num_cells; c++)
    for (int64_t k = rows->offset[c]; k < rows->offset[c + 1]; k++) same[k] = rows->same[c];
  *out = (remap_pairs_view){rows->num_cells, rows->offset, global, rank, volume, moment, same, second};
  return REMAP_OK;
}

remap_status remap_pairs(remap_context *ctx, remap_direction direction, remap_pairs_view *out)
{
  RM_REQUIRE(ctx, REMAP_BAD_ARGUMENT);
  RM_TRY(rm_context_check_view(ctx, out && (direction == REMAP_FORWARD || direction == REMAP_BACKWARD), "remap_pairs"));
  const remap_status complete = direction == REMAP_BACKWARD ? rm_context_need_pairs(ctx) : REMAP_OK;
  const rm_rows    *rows = rows_of(ctx, direction == REMAP_FORWARD ? REMAP_TARGET : REMAP_SOURCE);
  rm_arena         *arena = ctx->mask_arena ? ctx->mask_arena : ctx->arena;
  remap_pairs_view *view = &ctx->view[direction];

  if (complete != REMAP_OK || (!view->row_offset && copy_pairs(arena, rows, 1 / ctx->frame.scale, view) != REMAP_OK))
    return rm_context_fail(ctx, REMAP_NO_MEMORY,
                           "remap_pairs: no memory for copies of the %lld pairs of this rank: use more ranks",
                           (long long)rows->offset[rows->num_cells]);
  *out = *view;
  return REMAP_OK;
}
