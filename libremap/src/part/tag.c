/* tag -- what is known of the zone's cells travels along the Morton curve, 80 bytes per cell; cells stay at home until it is
 * settled who needs them. O(n) time to sort n tags by rank and, where they arrive, by key. */
#include "part/part_private.h"

#include <math.h>
#include <string.h>

/* Triangles that a cell's faces have, about: a face of n corners has n in a fan about its centre, and serves two cells. */
static int32_t triangles_of(const rm_mesh *mesh, rm_lid cell)
{
  int64_t corners = 0;

  for (int64_t i = mesh->cell_face_offset[cell]; i < mesh->cell_face_offset[cell + 1]; i++)
    corners += mesh->face_offset[mesh->cell_face[i] + 1] - mesh->face_offset[mesh->cell_face[i]];
  return corners / 2 < INT32_MAX ? (int32_t)(corners / 2) : INT32_MAX;
}

/* How much of its box a cell fills. */
static float fill_of(const rm_mesh *mesh, rm_lid cell)
{
  const double *box = mesh->cell_box[cell], volume = (box[3] - box[0]) * (box[4] - box[1]) * (box[5] - box[2]);

  return volume > 0 ? (float)fmin(fabs(mesh->cell_volume[cell]) / volume, 1) : 1;
}

/* The tags of a route's cells. Not collective. */
static remap_status make_tags(rm_arena *scratch, const rm_comm *comm, const rm_frame *zone_frame, const rm_mesh *mesh,
                              const rm_route *route, rm_tag **tag, double (**box)[6])
{
  const int64_t num = route->offset[comm->size];

  RM_NEW(*tag, scratch, num);
  RM_NEW(*box, scratch, num);
  for (int64_t k = 0; k < num; k++) {
    const rm_lid  c   = route->cell[k];
    const double *own = mesh->cell_box[c];

    (*tag)[k] = (rm_tag){rm_part_key(zone_frame, own), comm->rank, c, triangles_of(mesh, c), fill_of(mesh, c), 0, 0};
    memcpy((*box)[k], own, sizeof **box);
  }
  return REMAP_OK;
}

/* Exchange tags of one side. Collective. What arrives lives in arena, as does the room for its offsets. */
static remap_status exchange(rm_arena *arena, const rm_comm *comm, int side, const int64_t *offset, const rm_tag *tag,
                             const double (*box)[6], rm_tags *out, rm_reason *reason)
{
  int64_t     *arrived = rm_arena_alloc(arena, (int64_t)comm->size + 1, sizeof *arrived);
  remap_status mine    = arrived ? REMAP_OK : REMAP_NO_MEMORY;
  void        *tags, *boxes;

  RM_TRY(rm_comm_agree(comm, mine, NULL));
  RM_ASSERT(arrived);
  RM_TRY(rm_comm_exchange(comm, arena, sizeof *tag, offset, tag, arrived, &tags));
  RM_TRY(rm_comm_exchange(comm, arena, sizeof *box, offset, box, arrived, &boxes));
  if (arrived[comm->size] > INT32_MAX)
    mine = rm_fail(REMAP_TOO_LARGE, reason, side, -1, "%lld cells come to one rank; use more ranks",
                   (long long)arrived[comm->size]);
  RM_TRY(rm_comm_agree_reason(comm, mine, reason));
  out->num[side] = (rm_lid)arrived[comm->size];
  out->tag[side] = tags;
  out->box[side] = boxes;
  return REMAP_OK;
}

/* Put the tags of a side into the order of their keys. Not collective. */
static remap_status sort(rm_arena *arena, rm_arena *scratch, int side, rm_tags *tags)
{
  const rm_lid num = tags->num[side];
  rm_keyed    *keyed, *spare;
  rm_tag      *tag;
  double     (*box)[6];

  RM_NEW(keyed, scratch, num);
  RM_NEW(spare, scratch, num);
  RM_NEW(tag, arena, num);
  RM_NEW(box, arena, num);
  for (rm_lid k = 0; k < num; k++) keyed[k] = (rm_keyed){tags->tag[side][k].key, k};
  rm_sort_keyed(keyed, spare, num);
  for (rm_lid k = 0; k < num; k++) {
    tag[k] = tags->tag[side][keyed[k].item];
    memcpy(box[k], tags->box[side][keyed[k].item], sizeof *box);
  }
  tags->tag[side] = tag;
  tags->box[side] = box;
  return REMAP_OK;
}

/* The tags of one side. Collective. *tags lives in arena. */
static remap_status send_side(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_frame *zone_frame,
                              const rm_mesh *mesh, const rm_zone *zone, const rm_cuts *cuts, rm_tags *tags, rm_reason *reason)
{
  const int    side    = (int)mesh->side;
  rm_route     route   = {0};
  rm_tag      *tag     = NULL;
  double     (*box)[6] = NULL;
  remap_status mine    = rm_part_route_to_seats(scratch, comm, zone_frame, mesh, zone, cuts, &route);

  if (mine == REMAP_OK) mine = make_tags(scratch, comm, zone_frame, mesh, &route, &tag, &box);
  RM_TRY(rm_comm_agree(comm, mine, NULL));
  RM_TRY(exchange(scratch, comm, side, route.offset, tag, (const double(*)[6])box, tags, reason));
  return rm_comm_agree(comm, sort(arena, scratch, side, tags), NULL);
}

remap_status rm_part_send_tags(rm_arena *arena, const rm_comm *comm, const rm_frame *zone_frame, const rm_mesh *const mesh[2],
                               const rm_zone *zone, const rm_cuts *cuts, rm_tags *out, rm_reason *reason)
{
  rm_tags      tags   = {{0, 0}, {NULL, NULL}, {NULL, NULL}};
  remap_status status = REMAP_OK;

  for (int side = 0; side < 2 && status == REMAP_OK; side++) {
    rm_arena *scratch = rm_arena_new();

    status = rm_comm_agree(comm, scratch ? REMAP_OK : REMAP_NO_MEMORY, NULL);
    if (status == REMAP_OK) status = send_side(arena, scratch, comm, zone_frame, mesh[side], zone, cuts, &tags, reason);
    rm_arena_drop(scratch);
  }
  *out = tags;
  return status;
}

remap_status rm_part_move_tags(rm_arena *arena, const rm_comm *comm, const rm_tags *tags, const rm_cuts *cuts, rm_tags *out,
                               rm_reason *reason)
{
  int64_t *offset = rm_arena_alloc(arena, (int64_t)comm->size + 1, sizeof *offset);
  rm_tags  moved  = {{0, 0}, {NULL, NULL}, {NULL, NULL}};

  RM_TRY(rm_comm_agree(comm, offset ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(offset);
  for (int side = 0; side < 2; side++) {
    for (int r = 0; r <= comm->size; r++) offset[r] = 0;
    for (rm_lid k = 0; k < tags->num[side]; k++) offset[rm_part_seat(cuts, tags->tag[side][k].key)]++;
    rm_offsets(offset, comm->size);
    RM_TRY(exchange(arena, comm, side, offset, tags->tag[side], (const double(*)[6])tags->box[side], &moved, reason));
  }
  *out = moved;
  return REMAP_OK;
}
