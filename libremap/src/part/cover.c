/* cover -- the part for the supermesh: every rank gets a share of the cells of both meshes that meet, its core, and all cells
 * that touch these, of both meshes. The core is cut along the same curve as the part of rm_part_build, evenly by numbers; what
 * touches it is found by boxes. O(n log n) time; besides the part, memory for keys, boxes and routes. */
#include "part/part_private.h"

typedef struct work {
  rm_arena             *scratch;
  const rm_comm        *comm;
  const rm_mesh *const *mesh;
  const rm_zone        *zone;
  rm_reason            *reason;
  rm_route              core[2];   /* [side]                                                     */
  rm_route              across[2]; /* [side] cells that meet a rank's core of the other mesh      */
  rm_route              route[2];  /* [side] all that a rank needs                               */
  uint8_t              *met[2];    /* [side][cells] its box meets that of a cell of the other mesh */
  bool                  wanted[2]; /* [side] its cells are core                                  */
  const bool           *all;       /* [side] every cell counts as met                            */
} work;

/* Cells cell[0..num) of one mesh to the ranks that hold, by the route, cells of another whose boxes they meet. Collective. */
static remap_status match(work *w, int side, rm_lid num, const rm_lid *cell, int held_side, const rm_route *held, rm_route *out)
{
  const rm_zone        queried = {{num, 0}, {cell, NULL}};
  const rm_mesh *const pair[2] = {w->mesh[side], w->mesh[held_side]};

  return rm_part_touch(w->scratch, w->comm, pair, &queried, held, out, w->reason);
}

/* Which cells of this rank meet the other mesh. Not collective. */
static remap_status mark_met(rm_arena *arena, work *w)
{
  for (int side = 0; side < 2; side++) {
    RM_NEW(w->met[side], arena, w->mesh[side]->num_cells);
    for (rm_lid c = 0; c < w->mesh[side]->num_cells; c++) w->met[side][c] = w->all[side];
    for (int64_t k = 0; k < w->across[side].offset[w->comm->size]; k++) w->met[side][w->across[side].cell[k]] = 1;
  }
  return REMAP_OK;
}

/* Which mesh has more cells that meet the other: its core makes the cells that lie in both. Collective. */
static remap_status choose_owner(const work *w, int *owner)
{
  int64_t num[2] = {0, 0};

  for (int side = 0; side < 2; side++)
    for (rm_lid c = 0; c < w->mesh[side]->num_cells; c++) num[side] += w->met[side][c];
  RM_TRY(rm_comm_sum_i64(w->comm, num, 2));
  *owner = num[0] > num[1] ? 0 : 1;
  return REMAP_OK;
}

/* Shorten the core to cells that meet the other mesh, or to nothing. */
static void shorten_core(work *w, int side)
{
  rm_route *r     = &w->core[side];
  int64_t   begin = 0, kept = 0; /* kept <= what is read */

  for (int rank = 0; rank < w->comm->size; rank++) {
    const int64_t end = r->offset[rank + 1];

    for (int64_t k = begin; k < end && w->wanted[side]; k++)
      if (w->met[side][r->cell[k]]) r->cell[kept++] = r->cell[k];
    begin               = end;
    r->offset[rank + 1] = kept;
  }
}

/* Both routes in one, every cell once for each rank. */
static remap_status join_routes(work *w, const rm_route *a, const rm_route *b, rm_route *out)
{
  int64_t n = 0;

  RM_NEW(out->offset, w->scratch, (int64_t)w->comm->size + 1);
  RM_NEW(out->cell, w->scratch, a->offset[w->comm->size] + b->offset[w->comm->size]);
  for (int r = 0; r < w->comm->size; r++) {
    int64_t i = a->offset[r], k = b->offset[r];

    out->offset[r] = n;
    while (i < a->offset[r + 1] || k < b->offset[r + 1]) {
      const rm_lid x = i < a->offset[r + 1] ? a->cell[i] : INT32_MAX, y = k < b->offset[r + 1] ? b->cell[k] : INT32_MAX;

      out->cell[n++] = x < y ? x : y;
      i += x <= y;
      k += y <= x;
    }
  }
  out->offset[w->comm->size] = n;
  return REMAP_OK;
}

/* What a rank needs of one mesh: its core, what touches that, what touches the core of the other mesh. Collective. */
static remap_status find_route(work *w, int side)
{
  rm_route     around = {0}, both;
  rm_lid      *all;
  remap_status mine;

  all = rm_arena_alloc(w->scratch, w->mesh[side]->num_cells, sizeof *all);
  RM_TRY(rm_comm_agree(w->comm, all ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(all);
  for (rm_lid c = 0; c < w->mesh[side]->num_cells; c++) all[c] = c;
  RM_TRY(match(w, side, w->mesh[side]->num_cells, all, side, &w->core[side], &around));
  mine = join_routes(w, &w->core[side], &around, &both);
  if (mine == REMAP_OK && w->wanted[1 - side]) mine = join_routes(w, &both, &w->across[side], &w->route[side]);
  else w->route[side] = both;
  return rm_comm_agree(w->comm, mine, NULL);
}

/* Ship one mesh; then what its cells are travels the same way. Collective. */
static remap_status ship(rm_arena *arena, work *w, int side, rm_cover *out)
{
  const rm_route *route = &w->route[side], *core = &w->core[side];
  const int       size = w->comm->size;
  rm_arena       *passing = rm_arena_new();
  uint8_t        *flag = rm_arena_alloc(w->scratch, route->offset[size], sizeof *flag);
  int64_t        *recv_offset = rm_arena_alloc(w->scratch, (int64_t)size + 1, sizeof *recv_offset);
  void           *recv;
  remap_status    status;

  RM_GOTO(done, status = rm_comm_agree(w->comm, passing && flag && recv_offset ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(passing && flag && recv_offset);
  RM_GOTO(done, status = rm_part_ship(arena, passing, w->comm, w->mesh[side], route, &out->part.piece[side], w->reason));
  for (int r = 0; r < size; r++) {
    int64_t next = core->offset[r];
    for (int64_t k = route->offset[r]; k < route->offset[r + 1]; k++) {
      const bool is_core = next < core->offset[r + 1] && core->cell[next] == route->cell[k];
      flag[k]            = (uint8_t)((is_core ? RM_COVER_CORE : 0) | (w->met[side][route->cell[k]] ? RM_COVER_MET : 0));
      next += is_core;
    }
  }
  RM_GOTO(done, status = rm_comm_exchange(w->comm, arena, sizeof *flag, route->offset, flag, recv_offset, &recv));
  out->flag[side] = recv;
done:
  rm_arena_drop(passing);
  return status;
}

static remap_status cover(rm_arena *arena, work *w, const rm_frame *frame, int keep, rm_cover *out)
{
  RM_TRY(rm_part_route_evenly(w->scratch, w->comm, frame, w->mesh, w->zone, w->core));
  for (int side = 0; side < 2; side++)
    RM_TRY(match(w, side, w->zone->num_cells[side], w->zone->cell[side], 1 - side, &w->core[1 - side], &w->across[side]));
  RM_TRY(rm_comm_agree(w->comm, mark_met(arena, w), NULL));
  RM_TRY(choose_owner(w, &out->owner));
  for (int side = 0; side < 2; side++) {
    w->wanted[side]   = (keep & (side ? REMAP_IN_TARGET : REMAP_IN_SOURCE)) || (out->owner == side && (keep & REMAP_IN_BOTH));
    out->is_met[side] = w->met[side];
    shorten_core(w, side);
  }
  for (int side = 0; side < 2; side++) RM_TRY(find_route(w, side));
  for (int side = 0; side < 2; side++) RM_TRY(ship(arena, w, side, out));
  return REMAP_OK;
}

remap_status rm_part_cover(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2],
                           const rm_zone *zone, int keep, const bool all[2], const rm_cover **out, rm_reason *reason)
{
  work         w   = {.scratch = rm_arena_new(), .comm = comm, .mesh = mesh, .zone = zone, .reason = reason, .all = all};
  rm_cover    *new = rm_arena_zero(arena, 1, sizeof *new);
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(comm, w.scratch && new ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(w.scratch && new);
  RM_GOTO(done, status = cover(arena, &w, frame, keep, new));
  RM_ASSERT(rm_part_check(&new->part) != REMAP_INTERNAL);
  *out = new;
done:
  rm_arena_drop(w.scratch);
  return status;
}
