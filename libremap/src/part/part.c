/* part -- the stages in order: tags to their seats, giants, weights, cuts of even work, what each rank needs, and the cells
 * themselves; and the check of what comes out. What a stage needs on the way is dropped before the next, so memory peaks at the
 * product, the routes, and the tags or what one mesh sends and receives. */
#include "part/part_private.h"

#include <math.h>
#include <string.h>

const rm_slicing rm_one_block = {INT64_MAX, INFINITY, 1, 1};

/* Cuts of even work; the giants of these tags, which are marked, end here but for their number. Collective. The cuts live in
 * arena. */
static remap_status cut_work(rm_arena *arena, const rm_comm *comm, const rm_mesh *const mesh[2], rm_tags *tags,
                             rm_giants *giants, rm_cuts *cuts)
{
  rm_arena    *scratch = rm_arena_new();
  uint64_t    *key     = rm_arena_alloc(arena, comm->size, sizeof *key);
  int64_t     *work[2];
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(comm, scratch && key ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_GOTO(done, status = rm_part_find_giants(scratch, comm, tags, giants));
  RM_GOTO(done, status = rm_part_weigh(scratch, scratch, comm, mesh, tags, giants, work));
  RM_GOTO(done, status = rm_part_cut_work(scratch, comm, tags, work, cuts));
  cuts->key = memcpy(key, cuts->key, (size_t)cuts->num * sizeof *key);
done:
  rm_arena_drop(scratch);
  return status;
}

/* Weigh the tags where they are, and move them into intervals of even work. Collective. What comes out lives in arena. */
static remap_status balance(rm_arena *arena, const rm_comm *comm, const rm_mesh *const mesh[2], rm_tags *tags,
                            rm_giants *giants, rm_cuts *cuts, rm_tags *moved, rm_reason *reason)
{
  rm_arena    *scratch = rm_arena_new();
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(comm, scratch ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_GOTO(done, status = cut_work(arena, comm, mesh, tags, giants, cuts));
  RM_GOTO(done, status = rm_part_move_tags(arena, comm, tags, cuts, moved, reason));
  if (giants->num_everywhere > 0) {
    status = rm_part_meet_giants(arena, scratch, comm, moved, giants);
  } else {
    status = rm_comm_agree(comm, rm_part_no_giants(arena, giants), NULL);
  }
done:
  rm_arena_drop(scratch);
  return status;
}

/* The tags of the zone's cells on the ranks where they are of even number. Collective. *out lives in arena, as do the cuts. */
static remap_status seat_evenly(rm_arena *arena, const rm_comm *comm, const rm_frame *zone_frame, const rm_mesh *const mesh[2],
                                const rm_zone *zone, rm_cuts *cuts, rm_tags *out, rm_reason *reason)
{
  rm_arena    *scratch = rm_arena_new();
  uint64_t    *key     = rm_arena_alloc(arena, comm->size, sizeof *key);
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(comm, scratch && key ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_GOTO(done, status = rm_part_cut_evenly(scratch, comm, zone_frame, mesh, zone, cuts));
  cuts->key = memcpy(key, cuts->key, (size_t)cuts->num * sizeof *key);
  rm_arena_drop(scratch);
  scratch = NULL;
  status  = rm_part_send_tags(arena, comm, zone_frame, mesh, zone, cuts, out, reason);
done:
  rm_arena_drop(scratch);
  return status;
}

/* Where the tags end up, and the giants; one rank needs no balance. Collective. All live in arena. */
static remap_status seat(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2],
                         const rm_zone *zone, rm_giants *giants, rm_cuts *cuts, rm_tags *out, rm_reason *reason)
{
  rm_arena    *scratch = rm_arena_new();
  rm_frame     zone_frame;
  rm_tags      tags;
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(comm, scratch ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_GOTO(done, status = rm_part_frame(comm, frame, mesh, zone, &zone_frame));
  if (comm->size > 1) {
    RM_GOTO(done, status = seat_evenly(scratch, comm, &zone_frame, mesh, zone, cuts, &tags, reason));
    status = balance(arena, comm, mesh, &tags, giants, cuts, out, reason);
  } else {
    RM_GOTO(done, status = seat_evenly(arena, comm, &zone_frame, mesh, zone, cuts, out, reason));
    status = rm_comm_agree(comm, rm_part_no_giants(arena, giants), NULL);
  }
done:
  rm_arena_drop(scratch);
  return status;
}

remap_status rm_part_plan(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2],
                          const rm_zone *zone, const rm_slicing *slicing, const rm_routes **out, rm_reason *reason)
{
  rm_arena    *scratch = rm_arena_new();
  rm_routes   *routes  = rm_arena_alloc(arena, 1, sizeof *routes);
  rm_giants    giants;
  rm_cuts      cuts;
  rm_tags      tags;
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(comm, scratch && routes ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(scratch && routes);
  RM_GOTO(done, status = seat(scratch, comm, frame, mesh, zone, &giants, &cuts, &tags, reason));
  RM_GOTO(done, status = rm_part_match(arena, scratch, comm, &cuts, &tags, &giants, slicing, routes));
  *out = routes;
done:
  rm_arena_drop(scratch);
  return status;
}

int rm_part_blocks(const rm_routes *routes) { return routes->num_blocks; }

/* One block of both meshes; the stocks live in scratch. Collective. */
static remap_status bring(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_mesh *const mesh[2],
                          const rm_routes *routes, rm_part *part, rm_reason *reason)
{
  remap_status    status = REMAP_OK;
  const rm_stock *stock[2];

  for (int side = 0; side < 2; side++) RM_TRY(rm_part_send(scratch, comm, mesh[side], routes, &stock[side], reason));
  for (int side = 0; side < 2 && status == REMAP_OK; side++)
    status = rm_part_take(arena, routes, stock[side], 0, &part->piece[side], reason);
  return rm_comm_agree_reason(comm, status, reason);
}

remap_status rm_part_build(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2],
                           const rm_zone *zone, const rm_part **out, rm_reason *reason)
{
  rm_part         *part    = rm_arena_alloc(arena, 1, sizeof *part);
  rm_arena        *scratch = rm_arena_new();
  const rm_routes *routes  = NULL;
  remap_status     status;

  RM_GOTO(done, status = rm_comm_agree(comm, part && scratch ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(part && scratch);
  RM_GOTO(done, status = rm_part_plan(arena, comm, frame, mesh, zone, &rm_one_block, &routes, reason));
  RM_GOTO(done, status = bring(arena, scratch, comm, mesh, routes, part, reason));
  RM_ASSERT(rm_part_check(part) != REMAP_INTERNAL);
  *out = part;
done:
  rm_arena_drop(scratch);
  return status;
}

/* Every number is in its range, a skin face has one cell, and cells ascend by sender and the sender's numbering. */
static bool numbers_are_right(const rm_piece *p)
{
  if (p->num_nodes < 0 || p->num_faces < 0 || p->num_cells < 0 || p->face_offset[0] != 0) return false;
  for (rm_lid f = 0; f < p->num_faces; f++) {
    const rm_lid *cell = p->face_cell[f];

    if (p->face_offset[f + 1] - p->face_offset[f] < 3) return false;
    if (cell[0] < 0 || cell[0] >= p->num_cells || cell[1] < -1 || cell[1] >= p->num_cells) return false;
    if (p->face_is_skin[f] > (cell[1] < 0)) return false;
    for (int64_t i = p->face_offset[f]; i < p->face_offset[f + 1]; i++)
      if (p->face_node[i] < 0 || p->face_node[i] >= p->num_nodes) return false;
  }
  for (rm_lid c = 1; c < p->num_cells; c++) {
    const bool same_sender = p->cell_home_rank[c] == p->cell_home_rank[c - 1];

    if (p->cell_home_rank[c] < p->cell_home_rank[c - 1]) return false;
    if (same_sender && p->cell_home[c] <= p->cell_home[c - 1]) return false;
  }
  return true;
}

/* A face between two cells from one sender is listed once, so it joins cells of one sender; and every node is used. */
static bool senders_are_apart(const rm_piece *p, uint8_t *node_is_used)
{
  for (rm_lid f = 0; f < p->num_faces; f++) {
    const rm_lid *cell = p->face_cell[f];

    if (cell[1] >= 0 && p->cell_home_rank[cell[0]] != p->cell_home_rank[cell[1]]) return false;
  }
  for (int64_t i = 0; i < p->face_offset[p->num_faces]; i++) node_is_used[p->face_node[i]] = 1;
  for (rm_lid v = 0; v < p->num_nodes; v++)
    if (!node_is_used[v]) return false;
  return true;
}

/* Faces close every cell: each edge is used as often one way as the other. (A cell that collapsed to a line or a point has
 * none.) Edges are hashed and the hashes added with the sign of their direction; a missing or turned face leaves a sum that is
 * not zero but with a chance of 2^-64. */
static bool cells_are_closed(const rm_piece *p, uint64_t *sum)
{
  for (rm_lid f = 0; f < p->num_faces; f++) {
    const int64_t first = p->face_offset[f], end = p->face_offset[f + 1];
    uint64_t      loop = 0;

    for (int64_t i = first; i < end; i++) {
      const rm_lid   a = p->face_node[i], b = p->face_node[i + 1 < end ? i + 1 : first];
      const rm_lid   low = a < b ? a : b, high = a < b ? b : a;
      const uint64_t hash = rm_hash_word((uint64_t)low << 32 | (uint64_t)high);

      if (a != b) loop += a < b ? hash : 0 - hash;
    }
    for (int k = 0; k < 2; k++)
      if (p->face_cell[f][k] >= 0) sum[p->face_cell[f][k]] += k == 0 ? loop : 0 - loop;
  }
  for (rm_lid c = 0; c < p->num_cells; c++)
    if (sum[c] != 0) return false;
  return true;
}

/* Every invariant of rm_piece. */
static remap_status check_piece(rm_arena *scratch, const rm_piece *p)
{
  uint8_t  *node_is_used;
  uint64_t *sum;

  RM_REQUIRE(numbers_are_right(p), REMAP_INTERNAL);
  RM_NEW0(node_is_used, scratch, p->num_nodes);
  RM_NEW0(sum, scratch, p->num_cells);
  RM_REQUIRE(senders_are_apart(p, node_is_used), REMAP_INTERNAL);
  RM_REQUIRE(cells_are_closed(p, sum), REMAP_INTERNAL);
  return REMAP_OK;
}

remap_status rm_part_check(const rm_part *part)
{
  rm_arena    *scratch = rm_arena_new();
  remap_status status  = scratch ? REMAP_OK : REMAP_NO_MEMORY;

  for (int side = 0; side < 2 && status == REMAP_OK; side++) status = check_piece(scratch, &part->piece[side]);
  rm_arena_drop(scratch);
  return status;
}
