/* crowd -- where the tags of other ranks are, coarsely, and what of this rank may meet them. Source tags that meet a crowd of
 * another rank's targets are told there; those are mostly the neighbours along the Morton curve. O(n log B) time for n tags and
 * B crowds that are near; 64 bytes per visitor. */
#include "part/part_private.h"

#include <string.h>

/* ---- crowds ------------------------------------------------------------------------------------------------------- */

/* The boxes of the tags of a side that are no giants. Not collective. */
static remap_status small_boxes(rm_arena *arena, const rm_tags *tags, int side, rm_lid *num, double (**out)[6])
{
  RM_NEW(*out, arena, tags->num[side]);
  *num = 0;
  for (rm_lid k = 0; k < tags->num[side]; k++)
    if (!tags->tag[side][k].is_giant) memcpy((*out)[(*num)++], tags->box[side][k], sizeof **out);
  return REMAP_OK;
}

remap_status rm_part_crowds(rm_arena *arena, const rm_comm *comm, const rm_tags *tags, int side, rm_lid num_asking,
                            const double (*asking)[6], rm_lid most, rm_crowds *out)
{
  rm_arena    *scratch = rm_arena_new();
  double     (*box)[6] = NULL;
  rm_lid       num     = 0;
  remap_status status  = scratch ? small_boxes(scratch, tags, side, &num, &box) : REMAP_NO_MEMORY;

  RM_GOTO(done, status = rm_comm_agree(comm, status, NULL));
  status = rm_crowds_meet(arena, comm, num, (const double(*)[6])box, num_asking, asking, most, out);
done:
  rm_arena_drop(scratch);
  return status;
}

/* The crowds of targets that the small sources seated here may meet. Collective. */
static remap_status target_crowds(rm_arena *arena, const rm_comm *comm, const rm_tags *tags, rm_crowds *out)
{
  rm_arena    *scratch = rm_arena_new();
  double     (*box)[6] = NULL;
  rm_lid       num     = 0;
  remap_status status  = scratch ? small_boxes(scratch, tags, REMAP_SOURCE, &num, &box) : REMAP_NO_MEMORY;

  RM_GOTO(done, status = rm_comm_agree(comm, status, NULL));
  status = rm_part_crowds(arena, comm, tags, REMAP_TARGET, num, (const double(*)[6])box, RM_ALL_CROWDS, out);
done:
  rm_arena_drop(scratch);
  return status;
}

/* ---- visitors ----------------------------------------------------------------------------------------------------- */

/* The visitors to other ranks; offset is [comm->size + 1]. Not collective. */
static remap_status list_visitors(rm_arena *arena, const rm_comm *comm, const rm_tags *tags, const rm_crowds *crowds,
                                  int64_t *offset, rm_visitor **out, double (**box)[6])
{
  const double(*tag_box)[6] = (const double(*)[6])tags->box[REMAP_SOURCE];
  rm_lid *small, *list, num = 0;

  RM_NEW(small, arena, tags->num[REMAP_SOURCE]);
  for (rm_lid k = 0; k < tags->num[REMAP_SOURCE]; k++)
    if (!tags->tag[REMAP_SOURCE][k].is_giant) small[num++] = k;
  RM_TRY(rm_crowds_list(arena, comm, crowds, comm->rank, num, small, tag_box, offset, &list));
  RM_NEW(*out, arena, offset[comm->size]);
  RM_NEW(*box, arena, offset[comm->size]);
  for (int64_t k = 0; k < offset[comm->size]; k++) {
    const rm_tag *tag = &tags->tag[REMAP_SOURCE][list[k]];

    (*out)[k] = (rm_visitor){tag->home_rank, tag->cell, tag->num_triangles, tag->fill};
    memcpy((*box)[k], tag_box[list[k]], sizeof **box);
  }
  return REMAP_OK;
}

remap_status rm_part_receive_visitors(rm_arena *arena, const rm_comm *comm, const rm_tags *tags, rm_visitors *out)
{
  int64_t     *offset  = rm_arena_alloc(arena, (int64_t)comm->size + 1, sizeof *offset);
  int64_t     *arrived = rm_arena_alloc(arena, (int64_t)comm->size + 1, sizeof *arrived);
  rm_visitor  *visitor = NULL;
  double     (*box)[6] = NULL;
  void        *who, *where;
  rm_crowds    crowds;
  remap_status status;

  RM_TRY(target_crowds(arena, comm, tags, &crowds));
  status = offset && arrived ? list_visitors(arena, comm, tags, &crowds, offset, &visitor, &box) : REMAP_NO_MEMORY;
  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_ASSERT(offset && arrived);
  RM_TRY(rm_comm_exchange(comm, arena, sizeof *visitor, offset, visitor, arrived, &who));
  RM_TRY(rm_comm_exchange(comm, arena, sizeof *box, offset, box, arrived, &where));
  *out = (rm_visitors){(rm_lid)arrived[comm->size], who, where};
  return rm_comm_agree(comm, arrived[comm->size] > INT32_MAX ? REMAP_TOO_LARGE : REMAP_OK, NULL);
}
