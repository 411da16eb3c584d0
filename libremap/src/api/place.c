/* place -- the cells of both meshes where they are overlaid: sent there along routes, and triangulated. What remap_move can use
 * again is kept from one call to the next:
 *
 *   routes          while no two cells that meet are kept apart by them
 *   piece, triangles of a mesh that has not moved, while routes hold (triangles: and the frame)
 *
 * Routes are chosen for target cells whose boxes are widened by a margin. As long as the boxes of both meshes' cells together
 * have grown out of what they were by no more than that, every source cell that meets a target cell is where that one is: one
 * reduction tells. More source cells than are needed change no result. The margin follows the pace of the motion and is 0 for a
 * build, or where cells move by much of their size at once.
 *
 * A build keeps nothing, and overlays a rank's cells block by block, each a piece that is taken from the rank's stocks; moves
 * overlay them in one block, and keep the piece instead of the stock.
 *
 * O(n) time for what is made anew, besides two numbers per cell that moved; kept are 48 bytes per cell, and pieces and
 * triangles. */
#include "api/context.h"

#include <math.h>
#include <string.h>

enum { MOVES_AHEAD = 6 }; /* that the margin allows for */

void rm_context_drop_triangles(remap_context *ctx, int side)
{
  rm_arena_drop(ctx->place.triangle_arena[side]);
  ctx->place.triangle_arena[side] = NULL;
  ctx->place.trimesh[side]        = NULL;
}

void rm_context_drop_place(remap_context *ctx)
{
  rm_arena_drop(ctx->place.arena);
  for (int side = 0; side < 2; side++) {
    rm_context_drop_triangles(ctx, side);
    rm_arena_drop(ctx->place.piece_arena[side]);
    rm_arena_drop(ctx->place.stock_arena[side]);
  }
  memset(&ctx->place, 0, sizeof ctx->place);
}

/* By how much cells of both meshes have come nearer to each other since routes were chosen, at most. Collective. */
static remap_status find_approach(const remap_context *ctx, double *out)
{
  double grown[2] = {0, 0}; /* [side] boxes out of what they were */

  for (int side = 0; side < 2; side++)
    for (rm_lid c = 0; c < ctx->mesh[side]->num_cells; c++) {
      const double *now = ctx->mesh[side]->cell_box[c], *then = ctx->place.box[side][c];

      for (int d = 0; d < 3; d++) grown[side] = fmax(grown[side], fmax(then[d] - now[d], now[d + 3] - then[d + 3]));
    }
  RM_TRY(rm_comm_max_f64(&ctx->comm, grown, 2));
  *out = grown[0] + grown[1];
  return REMAP_OK;
}

/* The margin for routes that are chosen now, from how far cells came in num_moves moves. */
static double choose_margin(const remap_context *ctx, double approach, int num_moves)
{
  double size = INFINITY; /* of a cell */

  for (int side = 0; side < 2; side++) {
    if (ctx->mesh[side]->num_global_cells == 0) return 0;
    size = fmin(size, cbrt(ctx->mesh[side]->volume / (double)ctx->mesh[side]->num_global_cells));
  }
  const double pace = num_moves > 0 ? approach / num_moves : 0;

  return 4 * pace > size ? 0 : fmin(MOVES_AHEAD * pace, size / 2);
}

/* Room for a new choice, and the boxes of now if it is to be kept. Not collective. */
static remap_status open_place(remap_context *ctx, double margin, bool keeps)
{
  rm_place *place = &ctx->place;
  double(*box)[6];

  place->arena  = rm_arena_new();
  place->margin = margin;
  if (!place->arena) return REMAP_NO_MEMORY;
  for (int side = 0; side < 2 && keeps; side++) {
    RM_NEW(box, place->arena, ctx->mesh[side]->num_cells);
    if (ctx->mesh[side]->num_cells > 0)
      memcpy(box, ctx->mesh[side]->cell_box, (size_t)ctx->mesh[side]->num_cells * sizeof *box);
    place->box[side] = (const double(*)[6])box;
  }
  return REMAP_OK;
}

/* The target's cells with wider boxes. Not collective. */
static remap_status widen(const remap_context *ctx, double margin, rm_arena *passing, rm_mesh *widened)
{
  const rm_mesh *target = ctx->mesh[REMAP_TARGET];
  double(*box)[6];

  *widened = *target;
  if (!(margin > 0)) return REMAP_OK;
  RM_NEW(box, passing, target->num_cells);
  for (rm_lid c = 0; c < target->num_cells; c++)
    for (int k = 0; k < 6; k++) box[c][k] = target->cell_box[c][k] + (k < 3 ? -margin : margin);
  widened->cell_box = (const double(*)[6])box;
  return REMAP_OK;
}

/* Choose routes. Collective. */
static remap_status choose_routes(remap_context *ctx, double margin, bool keeps, rm_reason *reason)
{
  rm_arena      *passing = rm_arena_new();
  rm_mesh        widened;
  const rm_mesh *mesh[2] = {ctx->mesh[REMAP_SOURCE], &widened};
  const rm_zone *zone;
  remap_status   status = passing ? widen(ctx, margin, passing, &widened) : REMAP_NO_MEMORY;

  rm_context_drop_place(ctx);
  if (status == REMAP_OK) status = open_place(ctx, margin, keeps);
  RM_GOTO(done, status = rm_comm_agree(&ctx->comm, status, NULL));
  RM_GOTO(done, status = rm_zone_build(passing, &ctx->comm, mesh, &zone));
  status           = rm_part_plan(ctx->place.arena, &ctx->comm, &ctx->frame, mesh, zone, keeps ? &rm_one_block : &ctx->slicing,
                                  &ctx->place.routes, reason);
  ctx->place.frame = ctx->frame;
done:
  rm_arena_drop(passing);
  return status;
}

/* Do routes hold for the meshes as they are now? If not, *margin is for new ones. Collective. */
static remap_status try_routes(remap_context *ctx, bool *hold, double *margin)
{
  rm_place *place = &ctx->place;
  double    approach;

  *hold   = false;
  *margin = 0;
  if (!place->routes || place->frame.scale < ctx->frame.scale || place->frame.scale > ctx->frame.scale) return REMAP_OK;
  RM_TRY(find_approach(ctx, &approach));
  place->num_moves++;
  *margin = choose_margin(ctx, approach, place->num_moves);
  *hold   = !(approach > 0) || approach + 0x1p-40 <= place->margin; /* boxes are rounded by less than 2^-52 */
  return REMAP_OK;
}

/* A mesh's cells along the routes. Collective. */
static remap_status send_stock(remap_context *ctx, int side, rm_reason *reason)
{
  rm_place *place = &ctx->place;

  rm_arena_drop(place->stock_arena[side]);
  place->stock_arena[side] = rm_arena_new();
  RM_TRY(rm_comm_agree(&ctx->comm, place->stock_arena[side] ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  return rm_part_send(place->stock_arena[side], &ctx->comm, ctx->mesh[side], place->routes, &place->stock[side], reason);
}

/* One side's piece of a block. Not collective. */
static remap_status take_piece(remap_context *ctx, int side, int block, rm_reason *reason)
{
  rm_place *place = &ctx->place;

  rm_context_drop_triangles(ctx, side);
  rm_arena_drop(place->piece_arena[side]);
  place->piece_arena[side] = rm_arena_new();
  if (!place->piece_arena[side]) return REMAP_NO_MEMORY;
  return rm_part_take(place->piece_arena[side], place->routes, place->stock[side], block, &place->part.piece[side], reason);
}

/* What is to be kept of a mesh: its piece, in one block. Collective. */
static remap_status keep_piece(remap_context *ctx, int side, rm_reason *reason)
{
  remap_status status;

  RM_ASSERT(rm_part_blocks(ctx->place.routes) == 1);
  status = rm_comm_agree_reason(&ctx->comm, take_piece(ctx, side, 0, reason), reason);
  rm_arena_drop(ctx->place.stock_arena[side]);
  ctx->place.stock_arena[side] = NULL;
  ctx->place.stock[side]       = NULL;
  return status;
}

remap_status rm_context_place(remap_context *ctx, const bool is_new[2], bool keeps, rm_reason *reason)
{
  bool   hold;
  double margin;

  RM_TRY(try_routes(ctx, &hold, &margin));
  if (!hold) RM_TRY(choose_routes(ctx, margin, keeps, reason));
  if (hold && memcmp(&ctx->place.frame, &ctx->frame, sizeof ctx->frame)) { /* triangles are in order along its curve */
    ctx->place.frame = ctx->frame;
    for (int side = 0; side < 2; side++) rm_context_drop_triangles(ctx, side);
  }
  for (int side = 0; side < 2; side++) {
    if (hold && !is_new[side]) continue;
    RM_TRY(send_stock(ctx, side, reason));
    if (keeps) RM_TRY(keep_piece(ctx, side, reason));
  }
  return REMAP_OK;
}

remap_status rm_context_take_block(remap_context *ctx, int block, rm_reason *reason)
{
  for (int side = 0; side < 2; side++)
    if (ctx->place.stock[side]) RM_TRY(take_piece(ctx, side, block, reason));
  RM_ASSERT(rm_part_check(&ctx->place.part) != REMAP_INTERNAL);
  return REMAP_OK;
}

remap_status rm_context_triangulate(remap_context *ctx, int side)
{
  rm_place *place = &ctx->place;

  if (place->trimesh[side]) return REMAP_OK;
  rm_context_drop_triangles(ctx, side);
  place->triangle_arena[side] = rm_arena_new();
  if (!place->triangle_arena[side]) return REMAP_NO_MEMORY;
  return rm_trimesh_build(place->triangle_arena[side], &ctx->frame, &place->part.piece[side], ctx->options.faces,
                          &place->trimesh[side]);
}
