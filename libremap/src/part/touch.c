/* touch -- which cells of a mesh meet which rank's cells of another, or of the same. A rank learns of crowds of what others
 * hold; the boxes of the cells that meet those travel there, are held against the cells themselves, and the answers come back.
 * So no cell is sent in vain, for 49 bytes per candidate. O(n log n) time. */
#include "part/part_private.h"

/* Where the targets are: those of this rank by box, those of others by crowds. */
typedef struct targets {
  int64_t          *recv_offset;             /* [comm->size + 1]                            */
  const double    (*box)[6];                 /* [recv_offset[comm->size]] of this rank's    */
  const rm_boxtree *tree;                    /* over them                                   */
  rm_crowds         crowds;                  /* of these and of other ranks' targets        */
} targets;

/* Send the boxes of a route's cells along it. Collective. recv_offset and *box live in arena. */
static remap_status send_boxes(rm_arena *arena, const rm_comm *comm, const rm_mesh *mesh, const rm_route *route,
                               int64_t **recv_offset, const double (**box)[6])
{
  const int64_t num = route->offset[comm->size];
  double      (*send)[6];
  void         *recv;

  send         = rm_arena_alloc(arena, num, sizeof *send);
  *recv_offset = rm_arena_alloc(arena, (int64_t)comm->size + 1, sizeof **recv_offset);
  RM_TRY(rm_comm_agree(comm, send && *recv_offset ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(send && *recv_offset);
  for (int64_t k = 0; k < num; k++)
    for (int d = 0; d < 6; d++) send[k][d] = mesh->cell_box[route->cell[k]][d];
  RM_TRY(rm_comm_exchange(comm, arena, sizeof *send, route->offset, send, *recv_offset, &recv));
  *box = recv;
  return REMAP_OK;
}

/* The tree over this rank's targets. Not collective. */
static remap_status plant(rm_arena *arena, const rm_comm *comm, targets *t, rm_reason *reason)
{
  const int64_t num = t->recv_offset[comm->size];

  if (num > INT32_MAX)
    return rm_fail(REMAP_TOO_LARGE, reason, REMAP_TARGET, -1, "%lld cells come to one rank; use more ranks", (long long)num);
  return rm_boxtree_build(arena, (rm_lid)num, t->box, &t->tree);
}

/* The source cells that meet a crowd of a rank's targets. Not collective. */
static remap_status list_candidates(rm_arena *arena, const rm_comm *comm, const rm_mesh *mesh, const rm_zone *zone,
                                    const rm_crowds *crowds, rm_route *route)
{
  RM_NEW(route->offset, arena, (int64_t)comm->size + 1);
  return rm_crowds_list(arena, comm, crowds, -1, zone->num_cells[REMAP_SOURCE], zone->cell[REMAP_SOURCE], mesh->cell_box,
                        route->offset, &route->cell);
}

/* For each of n boxes, whether it meets a target of this rank; and room for the offsets of the answers that come back here.
 * Not collective. */
static remap_status answer_boxes(rm_arena *arena, const rm_comm *comm, const targets *t, int64_t n, const double (*box)[6],
                                 uint8_t **answer, int64_t **back_offset)
{
  RM_NEW(*answer, arena, n);
  RM_NEW(*back_offset, arena, (int64_t)comm->size + 1);
  for (int64_t k = 0; k < n; k++)
    (*answer)[k] = rm_boxtree_meets(t->tree, t->box, box[k]);
  return REMAP_OK;
}

/* Shorten a route, in place, to the cells whose answer is yes. */
static void keep_answered(const rm_comm *comm, rm_route *route, const uint8_t *answer)
{
  int64_t begin = 0, kept = 0; /* kept <= what is read */

  for (int r = 0; r < comm->size; r++) {
    const int64_t end = route->offset[r + 1];

    for (int64_t k = begin; k < end; k++)
      if (answer[k]) route->cell[kept++] = route->cell[k];
    begin                = end;
    route->offset[r + 1] = kept;
  }
}

/* Ask the ranks of a route which of its cells they want. Collective. */
static remap_status ask(rm_arena *arena, const rm_comm *comm, const rm_mesh *mesh, const targets *t, rm_route *route)
{
  const double (*box)[6];
  int64_t       *asked_offset, *back_offset = NULL; /* [comm->size + 1] of what comes to be answered, and of the answers */
  uint8_t       *answer = NULL;
  void          *answers;
  remap_status   mine;

  RM_TRY(send_boxes(arena, comm, mesh, route, &asked_offset, &box));
  mine = answer_boxes(arena, comm, t, asked_offset[comm->size], box, &answer, &back_offset);
  RM_TRY(rm_comm_agree(comm, mine, NULL));
  RM_ASSERT(mine == REMAP_OK);
  RM_TRY(rm_comm_exchange(comm, arena, sizeof *answer, asked_offset, answer, back_offset, &answers));
  RM_ASSERT(back_offset[comm->size] == route->offset[comm->size]);
  keep_answered(comm, route, answers);
  return REMAP_OK;
}

remap_status rm_part_touch(rm_arena *arena, const rm_comm *comm, const rm_mesh *const mesh[2], const rm_zone *zone,
                           const rm_route *target, rm_route *out, rm_reason *reason)
{
  const rm_mesh *source = mesh[REMAP_SOURCE];
  targets        t     = {0};
  rm_route       route = {0};
  remap_status   mine;

  RM_TRY(send_boxes(arena, comm, mesh[REMAP_TARGET], target, &t.recv_offset, &t.box));
  mine = plant(arena, comm, &t, reason);
  RM_TRY(rm_comm_agree_reason(comm, mine, reason));
  RM_ASSERT(mine == REMAP_OK);
  RM_TRY(rm_crowds_meet(arena, comm, t.tree->num_items, t.box, source->num_cells, source->cell_box, RM_ALL_CROWDS, &t.crowds));
  mine = list_candidates(arena, comm, source, zone, &t.crowds, &route);
  RM_TRY(rm_comm_agree(comm, mine, NULL));
  RM_ASSERT(mine == REMAP_OK);
  RM_TRY(ask(arena, comm, source, &t, &route));
  *out = route;
  return REMAP_OK;
}
