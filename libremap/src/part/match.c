/* match -- which cells each rank needs, and so which cells each home sends. Pairs are made
 *
 *     source   target      at
 *     any      small       the seat of the target
 *     small    giant       the seat of the source
 *     giant    giant       the seat of the target
 *
 * A rank needs the targets seated there, the source cells whose boxes they meet, and the other partners of its pairs. It knows
 * the boxes of all that may be, so no cell is sent in vain. O(n log n) time. */
#include "part/part_private.h"

#include <string.h>

/* What this rank's decisions rest on. */
typedef struct here {
  const rm_comm    *comm;
  const rm_cuts    *cuts;
  const rm_tags    *tags;
  const rm_giants  *giants;
  rm_lid            num_small;    /* targets seated here that are no giants */
  const double    (*small)[6];    /* their boxes                            */
  const rm_boxtree *small_tree;
  rm_visitors       visitors;      /* sources of other seats                */
  uint8_t          *is_wanted;     /* [giants->num] */
} here;

/* A tree over the small targets. Not collective. */
static remap_status plant(rm_arena *arena, here *h)
{
  const rm_tags *tags = h->tags;
  double       (*small)[6];

  RM_NEW(small, arena, tags->num[REMAP_TARGET]);
  RM_NEW0(h->is_wanted, arena, h->giants->num);
  for (rm_lid k = 0; k < tags->num[REMAP_TARGET]; k++)
    if (!tags->tag[REMAP_TARGET][k].is_giant) memcpy(small[h->num_small++], tags->box[REMAP_TARGET][k], sizeof *small);
  h->small = (const double(*)[6])small;
  return rm_boxtree_build(arena, h->num_small, h->small, &h->small_tree);
}

/* ---- wants -------------------------------------------------------------------------------------------------------- */

/* The wants of one side, in no order: key is the home's rank and the cell's number there, item the role. */
typedef struct list {
  int64_t   num;
  rm_keyed *want;
} list;

static void want(list *l, int32_t home_rank, rm_lid cell, int role)
{
  l->want[l->num++] = (rm_keyed){(uint64_t)home_rank << 32 | (uint64_t)cell, role};
}

/* A small source seated here meets a giant: if that is a target, both are wanted here. */
typedef struct partner {
  const here *h;
  bool        met;
} partner;

static int meet_giant(void *user, rm_lid item)
{
  partner *p = user;

  if (p->h->giants->giant[item].side != REMAP_TARGET) return 0;
  p->met                = true;
  p->h->is_wanted[item] = 1;
  return 0;
}

static void want_small_sources(here *h, list *l)
{
  for (rm_lid k = 0; k < h->tags->num[REMAP_SOURCE]; k++) {
    const rm_tag *tag = &h->tags->tag[REMAP_SOURCE][k];
    const double *box = h->tags->box[REMAP_SOURCE][k];
    partner       p   = {h, false};

    if (tag->is_giant) continue;
    (void)rm_boxtree_query(h->giants->tree, h->giants->box, box, meet_giant, &p);
    if (p.met || rm_boxtree_meets(h->small_tree, h->small, box)) want(l, tag->home_rank, tag->cell, RM_ROLE_SEATED);
  }
  for (rm_lid k = 0; k < h->visitors.num; k++)
    if (rm_boxtree_meets(h->small_tree, h->small, h->visitors.box[k]))
      want(l, h->visitors.visitor[k].home_rank, h->visitors.visitor[k].cell, 0);
}

/* Giant sources that meet a small target here; and both partners of pairs of giants whose target has its seat here. */
static void want_giants(here *h)
{
  const rm_giant *giant = h->giants->giant;

  for (int64_t g = 0; g < h->giants->num; g++)
    if (giant[g].side == REMAP_SOURCE) {
      h->is_wanted[g] |= rm_boxtree_meets(h->small_tree, h->small, giant[g].box);
    } else if (rm_part_seat(h->cuts, giant[g].key) == h->comm->rank) {
      for (int64_t i = 0; i < h->giants->num; i++)
        if (giant[i].side == REMAP_SOURCE && rm_box_meets(giant[i].box, giant[g].box)) h->is_wanted[i] = h->is_wanted[g] = 1;
    }
}

/* Everything this rank needs. Not collective. */
static remap_status list_wants(rm_arena *arena, here *h, list l[2])
{
  const rm_tags *tags = h->tags;

  RM_NEW(l[REMAP_SOURCE].want, arena, (int64_t)tags->num[REMAP_SOURCE] + h->visitors.num + h->giants->num);
  RM_NEW(l[REMAP_TARGET].want, arena, (int64_t)h->num_small + h->giants->num);
  want_giants(h);
  want_small_sources(h, &l[REMAP_SOURCE]);
  for (rm_lid k = 0; k < tags->num[REMAP_TARGET]; k++) {
    const rm_tag *tag = &tags->tag[REMAP_TARGET][k];

    if (!tag->is_giant) want(&l[REMAP_TARGET], tag->home_rank, tag->cell, RM_ROLE_SEATED);
  }
  for (int64_t g = 0; g < h->giants->num; g++) {
    const rm_giant *giant = &h->giants->giant[g];
    const bool      sits  = rm_part_seat(h->cuts, giant->key) == h->comm->rank;

    if (h->is_wanted[g]) want(&l[giant->side], giant->home_rank, giant->cell, RM_ROLE_GIANT | (sits ? RM_ROLE_SEATED : 0));
  }
  return REMAP_OK;
}

/* Sort one side's wants by home and number there, and part them into what to ask whom and what it is. Not collective. */
static remap_status sort_wants(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, list *l, int64_t *offset, rm_lid **cell,
                               uint8_t **role)
{
  rm_keyed *spare;

  RM_REQUIRE(l->num <= INT32_MAX, REMAP_TOO_LARGE);
  RM_NEW(spare, scratch, l->num);
  RM_NEW(*cell, scratch, l->num);
  RM_NEW(*role, arena, l->num);
  rm_sort_keyed(l->want, spare, l->num);
  for (int r = 0; r <= comm->size; r++) offset[r] = 0;
  for (int64_t k = 0; k < l->num; k++) {
    offset[l->want[k].key >> 32]++;
    (*cell)[k] = (rm_lid)(l->want[k].key & INT32_MAX);
    (*role)[k] = (uint8_t)l->want[k].item;
  }
  rm_offsets(offset, comm->size);
  return REMAP_OK;
}

/* Ask the homes of one side for the cells on a list. Collective. */
static remap_status ask(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, list *l, int side, rm_routes *out)
{
  int64_t     *offset = rm_arena_alloc(scratch, (int64_t)comm->size + 1, sizeof *offset);
  rm_lid      *cell   = NULL;
  rm_route    *route  = &out->of[side];
  void        *asked;
  remap_status status;

  route->offset = rm_arena_alloc(arena, (int64_t)comm->size + 1, sizeof *route->offset);
  status = offset && route->offset ? sort_wants(arena, scratch, comm, l, offset, &cell, &out->role[side]) : REMAP_NO_MEMORY;
  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_TRY(rm_comm_exchange(comm, arena, sizeof *cell, offset, cell, route->offset, &asked));
  route->cell    = asked;
  out->num[side] = (rm_lid)l->num;
  return REMAP_OK;
}

remap_status rm_part_match(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_cuts *cuts, const rm_tags *tags,
                           const rm_giants *giants, rm_routes *out)
{
  here      h = {.comm = comm, .cuts = cuts, .tags = tags, .giants = giants};
  list      l[2] = {{0, NULL}, {0, NULL}};

  RM_TRY(rm_comm_agree(comm, plant(scratch, &h), NULL));
  RM_TRY(rm_part_receive_visitors(scratch, comm, tags, &h.visitors));
  RM_TRY(rm_comm_agree(comm, list_wants(scratch, &h, l), NULL));
  for (int side = 0; side < 2; side++) RM_TRY(ask(arena, scratch, comm, &l[side], side, out));
  return REMAP_OK;
}
