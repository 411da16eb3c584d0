/* giant -- a cell that meets more than one in GIANT_SHARE times the ranks of the other mesh's cells would bring them all to its
 * rank. It is a giant instead: replicated to where they are. How many a cell meets is estimated from crowds of the other mesh's
 * tags: O(n log B) time for n tags and B crowds that are near. A rank knows of those giants that may meet its tags. */
#include "part/part_private.h"

#include <string.h>

enum {
  GIANT_SHARE = 8, /* so a rank's work is settled to an eighth at worst, usually far better */
  FEW_CELLS   = 32 /* no cell that meets fewer is a giant                                   */
};

/* How many of the crowds' cells a box meets, about: of each crowd the part of its box that it covers. */
typedef struct tally {
  const rm_crowds *crowds;
  const double    *box;
  double           num;
} tally;

static int add_crowd(void *user, rm_lid item)
{
  tally          *t     = user;
  const rm_crowd *crowd = &t->crowds->crowd[item];
  double          part  = crowd->num;

  for (int d = 0; d < 3; d++) {
    const double low  = crowd->box[d] > t->box[d] ? crowd->box[d] : t->box[d];
    const double high = crowd->box[3 + d] < t->box[3 + d] ? crowd->box[3 + d] : t->box[3 + d];

    if (crowd->box[3 + d] > crowd->box[d]) part *= (high - low) / (crowd->box[3 + d] - crowd->box[d]);
  }
  t->num += part;
  return 0;
}

/* Mark the giants of a side among this rank's tags, held against the crowds of the other side, which has `total` tags; returns
 * how many there are. */
static int64_t mark_giants(const rm_comm *comm, const rm_crowds *other, int64_t total, int side, rm_tags *tags)
{
  double  most  = (double)total / ((double)GIANT_SHARE * comm->size);
  int64_t found = 0;

  if (most < FEW_CELLS) most = FEW_CELLS;
  for (rm_lid k = 0; k < tags->num[side]; k++) {
    tally t = {other, tags->box[side][k], 0};

    (void)rm_boxtree_query(other->tree, other->box, t.box, add_crowd, &t);
    tags->tag[side][k].is_giant = t.num > most;
    found += t.num > most;
  }
  return found;
}

/* This rank's giants, and the boxes of all its tags. Not collective. */
static remap_status list_giants(rm_arena *scratch, const rm_tags *tags, int64_t *num, rm_giant **out, double (**box)[6])
{
  int64_t   n = 0, most = 0;
  rm_giant *giant;

  RM_REQUIRE((int64_t)tags->num[0] + tags->num[1] <= INT32_MAX, REMAP_TOO_LARGE);
  for (int side = 0; side < 2; side++)
    for (rm_lid k = 0; k < tags->num[side]; k++) most += tags->tag[side][k].is_giant;
  RM_NEW(giant, scratch, most);
  RM_NEW(*box, scratch, (int64_t)tags->num[0] + tags->num[1]);
  for (int side = 0; side < 2; side++)
    if (tags->num[side] > 0)
      memcpy(*box + (side ? tags->num[0] : 0), tags->box[side], (size_t)tags->num[side] * sizeof **box);
  for (int side = 0; side < 2; side++)
    for (rm_lid k = 0; k < tags->num[side]; k++) {
      const rm_tag *tag = &tags->tag[side][k];

      if (!tag->is_giant) continue;
      giant[n] = (rm_giant){.key = tag->key, .side = side, .home_rank = tag->home_rank, .cell = tag->cell,
                            .num_triangles = tag->num_triangles};
      memcpy(giant[n++].box, tags->box[side][k], sizeof giant->box);
    }
  *num = n;
  *out = giant;
  return REMAP_OK;
}

remap_status rm_part_no_giants(rm_arena *arena, rm_giants *out)
{
  *out = (rm_giants){.num = 0};
  return rm_boxtree_build(arena, 0, NULL, &out->tree);
}

/* These giants, and a tree over them. Not collective. */
static remap_status know_giants(rm_arena *arena, int64_t num, const rm_giant *giant, rm_giants *out)
{
  double (*box)[6];

  RM_REQUIRE(num <= INT32_MAX, REMAP_TOO_LARGE);
  RM_NEW(box, arena, num);
  for (int64_t g = 0; g < num; g++) memcpy(box[g], giant[g].box, sizeof *box);
  out->num   = (rm_lid)num;
  out->giant = giant;
  out->box   = (const double(*)[6])box;
  return rm_boxtree_build(arena, out->num, out->box, &out->tree);
}

remap_status rm_part_meet_giants(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_tags *tags, rm_giants *out)
{
  int64_t   num = 0, met;
  rm_giant *mine    = NULL;
  double  (*box)[6] = NULL;
  void     *all;

  RM_TRY(rm_comm_agree(comm, list_giants(scratch, tags, &num, &mine, &box), NULL));
  RM_TRY(rm_boxes_meet(arena, comm, sizeof *mine, num, mine, tags->num[0] + tags->num[1], (const double(*)[6])box, &met, &all));
  return rm_comm_agree(comm, know_giants(arena, met, all, out), NULL);
}

remap_status rm_part_find_giants(rm_arena *scratch, const rm_comm *comm, rm_tags *tags, rm_giants *out)
{
  int64_t   total[2] = {tags->num[0], tags->num[1]}, num = 0;
  rm_crowds crowds[2];

  RM_TRY(rm_comm_sum_i64(comm, total, 2));
  for (int side = 0; side < 2; side++)
    RM_TRY(rm_part_crowds(scratch, comm, tags, side, tags->num[1 - side], (const double(*)[6])tags->box[1 - side],
                          RM_SOME_CROWDS, &crowds[side]));
  for (int side = 0; side < 2; side++) num += mark_giants(comm, &crowds[1 - side], total[1 - side], side, tags);
  RM_TRY(rm_comm_sum_i64(comm, &num, 1));
  RM_TRY(rm_comm_agree(comm, rm_part_no_giants(scratch, out), NULL));
  out->num_everywhere = num;
  return num > 0 ? rm_part_meet_giants(scratch, scratch, comm, tags, out) : REMAP_OK;
}

/* The giants of a side that are seated here, by their homes; offset is [comm->size + 1]. Not collective. */
static remap_status list_homes(rm_arena *scratch, const rm_comm *comm, const rm_tags *tags, int side, int64_t *offset,
                               rm_lid **cell)
{
  int64_t *next;

  for (int r = 0; r <= comm->size; r++) offset[r] = 0;
  for (rm_lid k = 0; k < tags->num[side]; k++) offset[tags->tag[side][k].home_rank] += tags->tag[side][k].is_giant;
  RM_NEW(*cell, scratch, rm_offsets(offset, comm->size));
  RM_NEW(next, scratch, comm->size);
  for (int r = 0; r < comm->size; r++) next[r] = offset[r];
  for (rm_lid k = 0; k < tags->num[side]; k++)
    if (tags->tag[side][k].is_giant) (*cell)[next[tags->tag[side][k].home_rank]++] = tags->tag[side][k].cell;
  return REMAP_OK;
}

remap_status rm_part_giants_at_home(rm_arena *scratch, const rm_comm *comm, const rm_tags *tags, int side, int64_t *num,
                                    const rm_lid **cell)
{
  int64_t     *offset  = rm_arena_alloc(scratch, (int64_t)comm->size + 1, sizeof *offset);
  int64_t     *arrived = rm_arena_alloc(scratch, (int64_t)comm->size + 1, sizeof *arrived);
  rm_lid      *send    = NULL;
  void        *recv;
  remap_status status = offset && arrived ? list_homes(scratch, comm, tags, side, offset, &send) : REMAP_NO_MEMORY;

  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_ASSERT(offset && arrived);
  RM_TRY(rm_comm_exchange(comm, scratch, sizeof *send, offset, send, arrived, &recv));
  *num  = arrived[comm->size];
  *cell = recv;
  return REMAP_OK;
}
