/* match -- which cells each rank needs in each of its blocks, and so which cells each home sends. Pairs are made
 *
 *     source   target      at
 *     any      small       the seat of the target
 *     small    giant       the seat of the source
 *     giant    giant       the seat of the target
 *
 * A seat is a block of a rank. It needs the targets seated there, the source cells whose boxes they meet, and the other
 * partners of its pairs. A rank knows the boxes of all that may be, so no cell is sent in vain. O(n log n) time. */
#include "part/part_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  MOST_BLOCKS = 1 << 12,
  OUTSIDE     = 4 /* a coordinate that no cell reaches: those of the frame are below 1 in magnitude */
};

/* The wants of one side, in no order: key is the home's rank and the cell's number there, item the role. */
typedef struct list {
  int64_t   num, room;
  rm_keyed *want; /* malloc'ed */
} list;

/* What is overlaid at once. */
typedef struct block {
  rm_lid            num_small;    /* targets seated here that are no giants */
  const double    (*small)[6];    /* their boxes                            */
  const rm_boxtree *small_tree;
  uint8_t          *is_wanted;    /* [giants->num] */
  list              wants[2];     /* [side]        */
} block;

/* What this rank's decisions rest on. */
typedef struct here {
  rm_arena         *arena;         /* of the blocks and their trees                 */
  const rm_comm    *comm;
  const rm_cuts    *cuts;
  const rm_tags    *tags;
  const rm_giants  *giants;
  rm_visitors       visitors;      /* sources of other seats                        */
  rm_cuts           inner;         /* of this rank's interval into blocks           */
  block            *block;         /* [inner.num + 1]                               */
  const double    (*block_box)[6]; /* [inner.num + 1] around the small targets      */
  const rm_boxtree *block_tree;    /* over them                                     */
  int64_t           once, often;   /* triangles of sources that are wanted; of each as often as it is */
} here;

/* ---- blocks ------------------------------------------------------------------------------------------------------- */

/* The highest bit in which two keys differ: the level at which the curve's octants part them. */
static int level_between(uint64_t a, uint64_t b)
{
  int level = 0;

  for (uint64_t bits = a ^ b; bits > 1; bits /= 2) level++;
  return level;
}

/* Keys at which this rank's tags, of both sides and in order, are cut into num blocks with about as many triangles each: within
 * a quarter of a block from where that would be, between the largest octants, for blocks are compact then. */
static remap_status cut_inside(rm_arena *arena, const rm_tags *tags, int64_t all, int64_t num, rm_cuts *out)
{
  const int64_t size = all / num;
  rm_lid        at[2] = {0, 0};
  int64_t       sum = 0;
  int           best = -1; /* level of the cut that is chosen so far */
  uint64_t     *key, last = 0;

  RM_NEW(key, arena, num);
  *out = (rm_cuts){0, key};
  while (out->num < num - 1 && (at[0] < tags->num[0] || at[1] < tags->num[1])) {
    const int     side = at[0] == tags->num[0] || (at[1] < tags->num[1] && tags->tag[1][at[1]].key < tags->tag[0][at[0]].key);
    const rm_tag *tag  = &tags->tag[side][at[side]++];
    const int64_t past = sum - (out->num + 1) * size;

    if (tag->key > last && sum > 0 && past >= -(size / 4)) {
      const int level = level_between(last, tag->key);

      if (level > best && (past <= size / 4 || best < 0)) {
        best          = level;
        key[out->num] = tag->key;
      }
      if (past >= size / 4) {
        out->num++;
        best = -1;
      }
    }
    last = tag->key;
    sum += tag->num_triangles;
  }
  out->num += best >= 0;
  return REMAP_OK;
}

/* A tree over each block's small targets, and one over the blocks. */
static remap_status plant(rm_arena *arena, here *h)
{
  const rm_tags *tags = h->tags;
  const int      num  = h->inner.num + 1;
  double       (*small)[6], (*box)[6];
  rm_lid         n = 0, k = 0;

  RM_NEW(small, arena, tags->num[REMAP_TARGET]);
  RM_NEW(box, arena, num);
  RM_NEW0(h->block, arena, num);
  for (int b = 0; b < num; b++) {
    block *own = &h->block[b];

    own->small = (const double(*)[6])(small + n);
    for (; k < tags->num[REMAP_TARGET] && rm_part_seat(&h->inner, tags->tag[REMAP_TARGET][k].key) == b; k++)
      if (!tags->tag[REMAP_TARGET][k].is_giant) memcpy(small[n + own->num_small++], tags->box[REMAP_TARGET][k], sizeof *small);
    n += own->num_small;
    for (int d = 0; d < 6; d++) box[b][d] = own->num_small > 0 ? own->small[0][d] : OUTSIDE;
    for (rm_lid i = 1; i < own->num_small; i++)
      for (int d = 0; d < 3; d++) {
        box[b][d]     = fmin(box[b][d], own->small[i][d]);
        box[b][d + 3] = fmax(box[b][d + 3], own->small[i][d + 3]);
      }
    RM_NEW0(own->is_wanted, arena, h->giants->num);
    RM_TRY(rm_boxtree_build(arena, own->num_small, own->small, &own->small_tree));
  }
  h->block_box = (const double(*)[6])box;
  return rm_boxtree_build(arena, num, h->block_box, &h->block_tree);
}

/* ---- wants -------------------------------------------------------------------------------------------------------- */

static remap_status want(list *l, int32_t home_rank, rm_lid cell, int role)
{
  RM_TRY(rm_grow(&l->want, &l->room, l->num + 1, sizeof *l->want));
  l->want[l->num++] = (rm_keyed){(uint64_t)home_rank << 32 | (uint64_t)cell, role};
  return REMAP_OK;
}

/* A small source and the blocks that want it: those with a target that it meets, and its seat if it meets a giant there. */
typedef struct partner {
  here         *h;
  const double *box;
  int32_t       home_rank, num_triangles;
  rm_lid        cell;
  int           seat; /* block of this rank, or -1 */
  bool          is_wanted, is_seated;
  remap_status  status;
} partner;

static remap_status want_source(partner *p, int b)
{
  p->h->often += p->num_triangles;
  p->is_wanted = true;
  p->is_seated |= b == p->seat;
  return want(&p->h->block[b].wants[REMAP_SOURCE], p->home_rank, p->cell, b == p->seat ? RM_ROLE_SEATED : 0);
}

static int meet_block(void *user, rm_lid b)
{
  partner     *p   = user;
  const block *own = &p->h->block[b];

  if (rm_boxtree_meets(own->small_tree, own->small, p->box)) p->status = want_source(p, b);
  return p->status != REMAP_OK;
}

static int meet_giant(void *user, rm_lid item)
{
  partner *p = user;

  if (p->h->giants->giant[item].side != REMAP_TARGET) return 0;
  p->h->block[p->seat].is_wanted[item] = 1;
  if (!p->is_seated) p->status = want_source(p, p->seat);
  return p->status != REMAP_OK;
}

static remap_status want_small_source(partner *p)
{
  here *h = p->h;

  (void)rm_boxtree_query(h->block_tree, h->block_box, p->box, meet_block, p);
  if (p->status == REMAP_OK && p->seat >= 0) (void)rm_boxtree_query(h->giants->tree, h->giants->box, p->box, meet_giant, p);
  if (p->is_wanted) h->once += p->num_triangles;
  return p->status;
}

static remap_status want_small_sources(here *h)
{
  for (rm_lid k = 0; k < h->tags->num[REMAP_SOURCE]; k++) {
    const rm_tag *tag = &h->tags->tag[REMAP_SOURCE][k];
    partner       p   = {h, h->tags->box[REMAP_SOURCE][k], tag->home_rank, tag->num_triangles, tag->cell,
                         rm_part_seat(&h->inner, tag->key), false, false, REMAP_OK};

    if (!tag->is_giant) RM_TRY(want_small_source(&p));
  }
  for (rm_lid k = 0; k < h->visitors.num; k++) {
    const rm_visitor *visitor = &h->visitors.visitor[k];
    partner           p       = {h, h->visitors.box[k], visitor->home_rank, visitor->num_triangles, visitor->cell, -1,
                                 false, false, REMAP_OK};

    RM_TRY(want_small_source(&p));
  }
  return REMAP_OK;
}

/* The block of this rank in which a giant has its seat, -1: on another rank. */
static int seat_of_giant(const here *h, const rm_giant *giant)
{
  return rm_part_seat(h->cuts, giant->key) == h->comm->rank ? rm_part_seat(&h->inner, giant->key) : -1;
}

/* Giant sources that meet a small target of a block; and both partners of pairs of giants whose target has its seat there. */
static void mark_giants(here *h)
{
  const rm_giant *giant = h->giants->giant;

  for (rm_lid g = 0; g < h->giants->num; g++) {
    const int seat = seat_of_giant(h, &giant[g]);

    if (giant[g].side == REMAP_SOURCE) {
      for (int b = 0; b <= h->inner.num; b++)
        h->block[b].is_wanted[g] |= rm_boxtree_meets(h->block[b].small_tree, h->block[b].small, giant[g].box);
      continue;
    }
    for (rm_lid i = 0; i < h->giants->num && seat >= 0; i++)
      if (giant[i].side == REMAP_SOURCE && rm_box_meets(giant[i].box, giant[g].box))
        h->block[seat].is_wanted[i] = h->block[seat].is_wanted[g] = 1;
  }
}

static remap_status want_giants(here *h)
{
  for (rm_lid g = 0; g < h->giants->num; g++) {
    const rm_giant *giant = &h->giants->giant[g];
    const int       seat  = seat_of_giant(h, giant);
    int64_t         times = 0;

    for (int b = 0; b <= h->inner.num; b++) {
      if (!h->block[b].is_wanted[g]) continue;
      RM_TRY(want(&h->block[b].wants[giant->side], giant->home_rank, giant->cell,
                  RM_ROLE_GIANT | (seat == b ? RM_ROLE_SEATED : 0)));
      times++;
    }
    h->often += times * giant->num_triangles;
    h->once += times > 0 ? giant->num_triangles : 0;
  }
  return REMAP_OK;
}

/* Everything that this rank needs, block by block. Not collective. */
static remap_status list_wants(rm_arena *arena, here *h)
{
  const rm_tags *tags = h->tags;

  RM_TRY(plant(arena, h));
  mark_giants(h);
  RM_TRY(want_small_sources(h));
  for (rm_lid k = 0; k < tags->num[REMAP_TARGET]; k++) {
    const rm_tag *tag = &tags->tag[REMAP_TARGET][k];

    if (!tag->is_giant)
      RM_TRY(want(&h->block[rm_part_seat(&h->inner, tag->key)].wants[REMAP_TARGET], tag->home_rank, tag->cell, RM_ROLE_SEATED));
  }
  return want_giants(h);
}

static void drop_blocks(here *h)
{
  for (int b = 0; b <= h->inner.num && h->block; b++)
    for (int side = 0; side < 2; side++) free(h->block[b].wants[side].want);
  rm_arena_drop(h->arena);
  h->arena = NULL;
  h->block = NULL;
  h->once = h->often = 0;
}

/* Cut into as few blocks as are asked for and have no more triangles each than that, about; into fewer where too many sources
 * would come more than once, for what meets many blocks is triangulated with each of them. Not collective. */
static remap_status choose_blocks(here *h, const rm_slicing *slicing)
{
  int64_t all = 0, num;

  for (int side = 0; side < 2; side++)
    for (rm_lid k = 0; k < h->tags->num[side]; k++) all = rm_add_sat(all, h->tags->tag[side][k].num_triangles);
  num = slicing->few > 0 && all / slicing->few < slicing->blocks ? all / slicing->few : slicing->blocks;
  num = num > all / slicing->triangles ? num : all / slicing->triangles + 1;
  for (num = num < MOST_BLOCKS ? num : MOST_BLOCKS;; num /= 2) {
    h->arena = rm_arena_new();
    if (!h->arena) return REMAP_NO_MEMORY;
    RM_TRY(cut_inside(h->arena, h->tags, all, num, &h->inner));
    RM_TRY(list_wants(h->arena, h));
    if (num == 1 || (double)(h->often - h->once) <= slicing->repeats * (double)all) return REMAP_OK;
    drop_blocks(h);
  }
}

/* ---- lists -------------------------------------------------------------------------------------------------------- */

/* The wants of one side, block after block. */
typedef struct wants {
  int64_t  *offset; /* [blocks + 1]                                                          */
  rm_lid   *cell;   /* [offset[blocks]] number at its home; of other homes' cells, in the end, among those that come here */
  uint8_t  *role;   /* [offset[blocks]]                                                      */
  rm_keyed *spare;  /* [most of one block] */
  rm_keyed *away;   /* [num_away] those of other homes: key as in a list, item the place     */
  int64_t   num_away;
  int64_t  *asked_offset; /* [comm->size + 1] */
  rm_lid   *asked;        /* [asked_offset[comm->size]] what others are asked for, by home and number there, each once */
} wants;

static remap_status new_wants(rm_arena *arena, rm_arena *scratch, const here *h, int side, wants *out)
{
  int64_t num = 0, most = 0;

  RM_NEW(out->offset, scratch, (int64_t)h->inner.num + 2);
  for (int b = 0; b <= h->inner.num; b++) {
    const list *l = &h->block[b].wants[side];

    RM_REQUIRE(l->num <= INT32_MAX, REMAP_TOO_LARGE);
    out->offset[b] = num;
    num += l->num;
    most = l->num > most ? l->num : most;
    for (int64_t k = 0; k < l->num; k++) out->num_away += (int64_t)(l->want[k].key >> 32) != h->comm->rank;
  }
  out->offset[h->inner.num + 1] = num;
  RM_NEW(out->cell, arena, num);
  RM_NEW(out->role, arena, num);
  RM_NEW(out->spare, scratch, most);
  RM_NEW(out->away, scratch, out->num_away);
  out->num_away = 0;
  return REMAP_OK;
}

/* A block's wants in order, as its list; what others have is noted as away. */
static remap_status fill_list(rm_arena *arena, const here *h, int side, int b, wants *w, rm_block *out)
{
  const list *l = &h->block[b].wants[side];

  RM_NEW0(out->list[side].offset, arena, RM_SHARES + 1);
  out->list[side].cell = w->cell + w->offset[b];
  out->role[side]      = w->role + w->offset[b];
  rm_sort_keyed(l->want, w->spare, l->num);
  for (int64_t k = 0; k < l->num; k++) {
    const int home  = (int)(l->want[k].key >> 32), rank = h->comm->rank;
    const int share = home < rank ? RM_BEFORE : home > rank ? RM_BEHIND : RM_OWN;

    out->list[side].offset[share]++;
    out->list[side].cell[k] = (rm_lid)(l->want[k].key & INT32_MAX);
    out->role[side][k]      = (uint8_t)l->want[k].item;
    if (share != RM_OWN) w->away[w->num_away++] = (rm_keyed){l->want[k].key, w->offset[b] + k};
  }
  rm_offsets(out->list[side].offset, RM_SHARES);
  return REMAP_OK;
}

/* Number what comes here as it will arrive, by home and number there, and list what to ask for. */
static remap_status number_away(rm_arena *scratch, const here *h, wants *w)
{
  rm_keyed *spare;
  int64_t   num = 0;

  RM_NEW(spare, scratch, w->num_away);
  RM_NEW(w->asked, scratch, w->num_away);
  RM_NEW0(w->asked_offset, scratch, (int64_t)h->comm->size + 1);
  rm_sort_keyed(w->away, spare, w->num_away);
  for (int64_t k = 0; k < w->num_away; k++) {
    const uint64_t key = w->away[k].key;

    if (k == 0 || key != w->away[k - 1].key) {
      w->asked_offset[key >> 32]++;
      w->asked[num++] = (rm_lid)(key & INT32_MAX);
    }
    RM_REQUIRE(num <= INT32_MAX, REMAP_TOO_LARGE);
    w->cell[w->away[k].item] = (rm_lid)(num - 1);
  }
  rm_offsets(w->asked_offset, h->comm->size);
  return REMAP_OK;
}

/* Not collective. */
static remap_status list_blocks(rm_arena *arena, rm_arena *scratch, const here *h, int side, wants *w, rm_routes *out)
{
  RM_NEW(out->of[side].offset, arena, (int64_t)h->comm->size + 1);
  RM_TRY(new_wants(arena, scratch, h, side, w));
  for (int b = 0; b < out->num_blocks; b++) {
    RM_TRY(fill_list(arena, h, side, b, w, &out->block[b]));
    free(h->block[b].wants[side].want);
    h->block[b].wants[side] = (list){0, 0, NULL};
  }
  return number_away(scratch, h, w);
}

/* What this rank's blocks need of one side, and what others need of this rank. Collective. */
static remap_status ask(rm_arena *arena, const here *h, int side, rm_routes *out)
{
  const rm_comm *comm    = h->comm;
  rm_arena      *scratch = rm_arena_new();
  wants          w       = {0};
  void          *asked;
  remap_status   status = scratch && out->block ? list_blocks(arena, scratch, h, side, &w, out) : REMAP_NO_MEMORY;

  RM_GOTO(done, status = rm_comm_agree(comm, status, NULL));
  RM_ASSERT(w.asked_offset && w.asked);
  out->num_came[side] = (rm_lid)w.asked_offset[comm->size];
  RM_GOTO(done, status = rm_comm_exchange(comm, arena, sizeof *w.asked, w.asked_offset, w.asked, out->of[side].offset, &asked));
  out->of[side].cell = asked;
done:
  rm_arena_drop(scratch);
  return status;
}

remap_status rm_part_match(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_cuts *cuts, const rm_tags *tags,
                           const rm_giants *giants, const rm_slicing *slicing, rm_routes *out)
{
  here         h = {.comm = comm, .cuts = cuts, .tags = tags, .giants = giants};
  remap_status status;

  RM_TRY(rm_part_receive_visitors(scratch, comm, tags, &h.visitors));
  RM_GOTO(done, status = rm_comm_agree(comm, choose_blocks(&h, slicing), NULL));
  out->num_blocks = h.inner.num + 1;
  out->block      = rm_arena_alloc(arena, out->num_blocks, sizeof *out->block);
  for (int side = 0; side < 2 && status == REMAP_OK; side++) status = ask(arena, &h, side, out);
done:
  drop_blocks(&h);
  return status;
}
