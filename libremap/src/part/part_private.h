/* part_private -- the stages of rm_part_build: cut the targets, match the sources to them, ship both. Each stage ends in one
 * agreement, so its status is the same on every rank. */
#ifndef RM_PART_PRIVATE_H
#define RM_PART_PRIVATE_H

#include "part/part.h"

/* Which cells of this rank's part of a mesh go where. */
typedef struct rm_route {
  int64_t *offset; /* [comm->size + 1]                                             */
  rm_lid  *cell;   /* [offset[comm->size]] grouped by destination, then ascending  */
} rm_route;

struct rm_routes {
  rm_route of[2]; /* [side] */
};

/* The frame with its box narrowed to the zone's cells, all ranks: Morton keys then resolve the zone and not what lies around
 * it. Collective. */
remap_status rm_part_frame(const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2], const rm_zone *zone,
                           rm_frame *out);

/* Morton key of the centre of a cell's box. Not collective. */
uint64_t rm_part_key(const rm_frame *zone_frame, const double box[6]);

/* Cut the target cells of the zone into one interval of keys per rank, of even work. Collective. *out lives in arena, as does
 * what is needed on the way. */
remap_status rm_part_cut(rm_arena *arena, const rm_comm *comm, const rm_frame *zone_frame, const rm_mesh *const mesh[2],
                         const rm_zone *zone, rm_route *out);

/* Route the source cells of the zone to every rank that has a target cell whose box they meet, targets being where `target`
 * puts them. Collective. *out lives in arena, as does what is needed on the way. */
remap_status rm_part_match(rm_arena *arena, const rm_comm *comm, const rm_mesh *const mesh[2], const rm_zone *zone,
                           const rm_route *target, rm_route *out, rm_reason *reason);

/* Send the cells of a route with their faces and nodes, and put together what arrives. Collective. *out lives in arena, what is
 * needed on the way in scratch. TOO_LARGE if more arrives than a rank can number. */
remap_status rm_part_ship(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_mesh *mesh, const rm_route *route,
                          rm_piece *out, rm_reason *reason);

#endif
