/* part_private -- the stages of rm_part_build. What a rank needs to know of a cell to decide where it is overlaid is its tag,
 * far smaller than the cell with its faces: tags are sorted along the Morton curve over all ranks, and only then cells move.
 *
 *   tag      tags of the zone's cells go to the ranks in whose interval of keys they lie, at first of equal numbers (cut)
 *   crowd    coarse boxes tell a rank where tags are that may meet its own
 *   giant    the cells that meet a large part of the other mesh are found, and known where they meet something
 *   weigh    estimates the work that each cell's pairs make; intervals of equal work are cut, and the tags move on
 *   match    every rank lists the cells its blocks need, and asks their homes for those of other ranks
 *   ship     cells with their faces and nodes travel; those of a block are taken out of what is there
 *
 * The part of a supermesh (cover), and where zones of one mesh may overlap (skins), are cut evenly and matched from the homes
 * (touch).
 *
 * Each stage ends in one agreement, so its status is the same on every rank. */
#ifndef RM_PART_PRIVATE_H
#define RM_PART_PRIVATE_H

#include "part/part.h"

/* Keys have 63 bits. */
enum { RM_KEY_BITS = 63 };

/* Which cells of this rank's part of a mesh go where. */
typedef struct rm_route {
  int64_t *offset; /* [comm->size + 1]                                             */
  rm_lid  *cell;   /* [offset[comm->size]] grouped by destination, then ascending  */
} rm_route;

/* What is listed for a block comes in shares: first of what came from ranks before this one, then of this rank's own cells,
 * then of what came from ranks behind it. */
enum { RM_BEFORE, RM_OWN, RM_BEHIND, RM_SHARES };

typedef struct rm_block {
  rm_route list[2]; /* [side] offset is [RM_SHARES + 1]; cells, by their numbers in what came or in the own mesh, ascend in
                       each share                                                                               */
  uint8_t *role[2]; /* [side][cells] RM_ROLE_ */
} rm_block;

struct rm_routes {
  rm_route  of[2];       /* [side] of this rank's cells to other ranks         */
  rm_lid    num_came[2]; /* [side] cells of others that come here              */
  int       num_blocks;  /* of this rank, at least 1                           */
  rm_block *block;       /* [num_blocks]                                       */
};

/* Where the intervals end: rank r has the keys from key[r - 1] up to but not including key[r]; the first and the last rank's
 * are open. Ascending. */
typedef struct rm_cuts {
  int             num; /* comm->size - 1 */
  const uint64_t *key; /* [num]          */
} rm_cuts;

/* A cell of the zone. */
typedef struct rm_tag {
  uint64_t key;           /* of the centre of its box */
  int32_t  home_rank;     /* who handed it in         */
  rm_lid   cell;          /* its number there         */
  int32_t  num_triangles; /* of its faces, about; a face between two cells counts half */
  float    fill;          /* volume over that of the box */
  int32_t  is_giant;
  int32_t  unused;        /* no padding on the wire */
} rm_tag;

/* The tags in this rank's interval. Read-only once sent, but for is_giant. Ascending by key. */
typedef struct rm_tags {
  rm_lid   num[2]; /* [side] */
  rm_tag  *tag[2];
  double (*box[2])[6];
} rm_tags;

/* A cell that is replicated to where the small cells are that it meets. */
typedef struct rm_giant {
  double   box[6];
  uint64_t key;
  int32_t  side, home_rank;
  rm_lid   cell;
  int32_t  num_triangles; /* as in its tag */
} rm_giant;

typedef struct rm_giants {
  int64_t           num_everywhere; /* of both sides, all ranks; the same on every rank                   */
  rm_lid            num;            /* those seated here, and all others that meet the box of a tag here  */
  const rm_giant   *giant;          /* [num]                                                              */
  const double    (*box)[6];        /* [num]                                                              */
  const rm_boxtree *tree;           /* over them                                                          */
} rm_giants;

/* A source tag of another seat that may meet a target here. */
typedef struct rm_visitor {
  int32_t home_rank;
  rm_lid  cell;
  int32_t num_triangles;
  float   fill;
} rm_visitor;

typedef struct rm_visitors {
  rm_lid            num;
  const rm_visitor *visitor; /* [num] */
  const double    (*box)[6]; /* [num] */
} rm_visitors;

/* The frame with its box narrowed to the zone's cells, all ranks: Morton keys then resolve the zone and not what lies around
 * it. Collective. */
remap_status rm_part_frame(const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2], const rm_zone *zone,
                           rm_frame *out);

/* Morton key of the centre of a cell's box. Not collective. */
uint64_t rm_part_key(const rm_frame *zone_frame, const double box[6]);

/* The rank in whose interval a key is: its seat. Not collective. */
int rm_part_seat(const rm_cuts *cuts, uint64_t key);

/* This rank's cells of the zone to their seats. Not collective. *out lives in arena, as does what is needed on the way. */
remap_status rm_part_route_to_seats(rm_arena *arena, const rm_comm *comm, const rm_frame *zone_frame, const rm_mesh *mesh,
                                    const rm_zone *zone, const rm_cuts *cuts, rm_route *out);

/* Cut the zone's cells of both meshes, as this rank handed them in, into intervals of equal numbers to within a 32nd, or as far
 * as keys differ. Collective. *out lives in arena, as does what is needed on the way. */
remap_status rm_part_cut_evenly(rm_arena *arena, const rm_comm *comm, const rm_frame *zone_frame, const rm_mesh *const mesh[2],
                                const rm_zone *zone, rm_cuts *out);

/* Both: cut them evenly, and route the cells of each mesh to their seats. Collective. route [side] lives in arena, as does what
 * is needed on the way. */
remap_status rm_part_route_evenly(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2],
                                  const rm_zone *zone, rm_route route[2]);

/* Cut tags, which lie in order over the ranks, into intervals of equal work; work [side][tags->num[side]] is not negative. A
 * tag goes to the side of the cut on which most of it lies. Collective. *out lives in arena, as does what is needed on the
 * way. */
remap_status rm_part_cut_work(rm_arena *arena, const rm_comm *comm, const rm_tags *tags, int64_t *const work[2], rm_cuts *out);

/* Send the tags of this rank's cells of the zone to their seats. Collective. *out lives in arena. TOO_LARGE if a rank
 * gets more than it can number. */
remap_status rm_part_send_tags(rm_arena *arena, const rm_comm *comm, const rm_frame *zone_frame, const rm_mesh *const mesh[2],
                               const rm_zone *zone, const rm_cuts *cuts, rm_tags *out, rm_reason *reason);
/* The same for tags that lie in order over the ranks already, by other cuts. */
remap_status rm_part_move_tags(rm_arena *arena, const rm_comm *comm, const rm_tags *tags, const rm_cuts *cuts, rm_tags *out,
                               rm_reason *reason);

/* Crowds of the tags of a side that are no giants, as rm_crowds_meet. Collective. *out lives in arena. */
remap_status rm_part_crowds(rm_arena *arena, const rm_comm *comm, const rm_tags *tags, int side, rm_lid num_asking,
                            const double (*asking)[6], rm_lid most, rm_crowds *out);

/* The source tags of other ranks, but for giants, that meet a crowd of this rank's targets. Collective. *out lives in arena,
 * with what is needed on the way. TOO_LARGE. */
remap_status rm_part_receive_visitors(rm_arena *arena, const rm_comm *comm, const rm_tags *tags, rm_visitors *out);

/* Mark the tags of giants, and tell the ranks of those that they meet. Collective. *out lives in scratch. */
remap_status rm_part_find_giants(rm_arena *scratch, const rm_comm *comm, rm_tags *tags, rm_giants *out);

/* Tell the ranks, on which marked tags are elsewhere, of the giants that they meet: num_everywhere is known and stays.
 * Collective. *out lives in arena, what is needed on the way in scratch. TOO_LARGE. */
remap_status rm_part_meet_giants(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_tags *tags, rm_giants *out);

/* There are none. Not collective. *out lives in arena. */
remap_status rm_part_no_giants(rm_arena *arena, rm_giants *out);

/* The giants of a side that this rank handed in, by their numbers there. Collective. *cell lives in scratch. */
remap_status rm_part_giants_at_home(rm_arena *scratch, const rm_comm *comm, const rm_tags *tags, int side, int64_t *num,
                                    const rm_lid **cell);

/* An estimate of the work that is done at its seat because of each tag, in units of 1/64 of what an edge and a face that cross
 * cost. Collective. *work[side], [tags->num[side]], live in arena, what is needed on the way in scratch. */
remap_status rm_part_weigh(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_mesh *const mesh[2],
                           const rm_tags *tags, const rm_giants *giants, int64_t *work[2]);

/* What every rank needs, as routes of this rank's cells, and what this rank's blocks need: targets at their seats, the source
 * cells whose boxes they meet, and giants. Collective. *out lives in arena, what is needed on the way in scratch. */
remap_status rm_part_match(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_cuts *cuts, const rm_tags *tags,
                           const rm_giants *giants, const rm_slicing *slicing, rm_routes *out);

/* Route the source cells of the zone to every rank that has a target cell whose box they meet, targets being where `target`
 * puts them. Collective. *out lives in arena, as does what is needed on the way. */
remap_status rm_part_touch(rm_arena *arena, const rm_comm *comm, const rm_mesh *const mesh[2], const rm_zone *zone,
                           const rm_route *target, rm_route *out, rm_reason *reason);

/* Send the cells of a route with their faces and nodes, and put together what arrives, but for its roles. Collective. *out
 * lives in arena, what is needed on the way in scratch. TOO_LARGE if more arrives than a rank can number. */
remap_status rm_part_ship(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_mesh *mesh, const rm_route *route,
                          rm_piece *out, rm_reason *reason);

#endif
