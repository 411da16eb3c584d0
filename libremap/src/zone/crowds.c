/* crowds -- who of all ranks is near, without everybody's boxes on everybody.
 *
 * The ranks are halved into blocks again and again, down to single ones. A rank knows boxes around all that its block asks
 * about, on every level, and of the block beside it, so log2 P times RM_CROWDS of them:
 *
 *     level 0   [ 0 1 2 3 | 4 5 6 ]     rank 1 and rank 5 tell each other of the whole left and the whole right block,
 *     level 1   [ 0 1 | 2 3 ]           rank 1 and rank 3 of a quarter,
 *     level 2   [ 0 | 1 ]               rank 0 and rank 1 of themselves: from the lowest level up.
 *
 * Then boxes go down, crowds or others: on each level a rank hands to its partner what meets the partner's block, its own and
 * those that came so far, and keeps what meets its own. A box so comes on one path to each rank that it may meet, and what is
 * on the way is shared evenly within a block. In a block of odd size the last rank of the smaller half has two partners, of
 * which the second gives and gets nothing: it has no counterpart.
 *
 * O(n log RM_CROWDS) time for n boxes, 2 log2 P messages, mostly. */
#include "zone/zone.h"

#include <string.h>

enum { MOST_LEVELS = 32 };

/* Boxes around all that a block asks about. */
typedef struct region {
  int64_t       num;
  const double (*box)[6];
} region;

typedef struct meeting {
  rm_arena      *scratch;
  const rm_comm *comm;
  int            num_levels;
  int            num_with[MOST_LEVELS], with[MOST_LEVELS][2]; /* [level] partners                          */
  region         own[MOST_LEVELS + 1];  /* [level] of the block halved there, from 1; at last of this rank   */
  region         other[MOST_LEVELS];    /* [level] of the half that this rank is not in                      */
  size_t         size;                  /* of an item: a box and more                                        */
  rm_lid         most;                  /* items of other ranks; RM_ALL_CROWDS: any, else these are crowds   */
  int64_t        num_own, num;
  const char    *own_item;              /* [num_own][size]                                                   */
  char          *item;                  /* [num][size] of other ranks                                        */
  remap_status   failed;                /* what this rank failed in: it goes on with less, for others wait   */
} meeting;

/* The partners on every level. */
static void halve(meeting *m)
{
  int first = 0, end = m->comm->size;

  while (end - first > 1) {
    const int left = (end - first + 1) / 2, middle = first + left, right = end - middle, level = m->num_levels++;
    const int rank = m->comm->rank, i = rank < middle ? rank - first : rank - middle;

    m->num_with[level] = 1;
    if (rank < middle) {
      m->with[level][0] = middle + (i < right ? i : right - 1);
      end               = middle;
    } else {
      m->with[level][0] = first + i;
      if (i == right - 1 && left > right) m->with[level][m->num_with[level]++] = first + left - 1;
      first = middle;
    }
  }
}

/* A rank that fails does its part of the messages all the same, with nothing in them; unless these fail. */
static remap_status go_on(meeting *m, remap_status status)
{
  if (status == REMAP_OK || status == REMAP_MPI_FAILURE) return status;
  m->failed = status;
  return REMAP_OK;
}

/* ---- what is asked about ------------------------------------------------------------------------------------------ */

static remap_status group(rm_arena *scratch, rm_lid n, const double (*box)[6], region *out)
{
  double (*around)[6];
  int    num = 0;

  RM_NEW(around, scratch, RM_CROWDS);
  RM_TRY(rm_box_groups(scratch, n, box, RM_CROWDS, around, NULL, &num));
  *out = (region){num, (const double(*)[6])around};
  return REMAP_OK;
}

static remap_status unite(rm_arena *scratch, const region *a, const region *b, region *out)
{
  double (*both)[6];

  RM_NEW(both, scratch, a->num + b->num);
  if (a->num > 0) memcpy(both, a->box, (size_t)a->num * sizeof *both);
  if (b->num > 0) memcpy(both + a->num, b->box, (size_t)b->num * sizeof *both);
  return group(scratch, (rm_lid)(a->num + b->num), (const double(*)[6])both, out);
}

/* Learn what the blocks ask about, from the lowest level up. */
static remap_status climb(meeting *m)
{
  for (int level = m->num_levels - 1; level >= 0; level--) {
    const region *own = &m->own[level + 1];
    region       *other = &m->other[level];

    for (int k = 0; k < m->num_with[level]; k++) { /* both know the same */
      void *recv;

      RM_TRY(go_on(m, rm_comm_swap(m->comm, m->scratch, m->with[level][k], sizeof *own->box, own->num, own->box, &other->num,
                                   &recv)));
      other->box = recv;
    }
    if (level > 0) RM_TRY(go_on(m, unite(m->scratch, own, other, &m->own[level])));
  }
  return REMAP_OK;
}

/* ---- what goes there ---------------------------------------------------------------------------------------------- */

/* Copy the items that meet a region; returns their number. */
static int64_t take(const meeting *m, const region *r, int64_t n, const char *item, char *out)
{
  int64_t num = 0;

  for (int64_t k = 0; k < n; k++, item += m->size) {
    double  box[6];
    int64_t i = 0;

    memcpy(box, item, sizeof box);
    while (i < r->num && !rm_box_meets(box, r->box[i])) i++;
    if (i < r->num) memcpy(out + (size_t)num++ * m->size, item, m->size);
  }
  return num;
}

/* The boxes of crowds, side by side. */
static remap_status boxes_of(rm_arena *arena, int64_t n, const rm_crowd *crowd, const double (**out)[6])
{
  double (*box)[6];

  RM_REQUIRE(n <= INT32_MAX, REMAP_TOO_LARGE);
  RM_NEW(box, arena, n);
  for (int64_t k = 0; k < n; k++) memcpy(box[k], crowd[k].box, sizeof *box);
  *out = (const double(*)[6])box;
  return REMAP_OK;
}

/* Join the crowds of other ranks to no more than there may be. */
static remap_status join(meeting *m)
{
  const rm_crowd *crowd = (const rm_crowd *)(const void *)m->item;
  const double  (*box)[6];
  double        (*around)[6];
  rm_lid         *group_of;
  rm_crowd       *joined;
  int             num;

  RM_ASSERT(m->size == sizeof *crowd);
  RM_TRY(boxes_of(m->scratch, m->num, crowd, &box));
  RM_NEW(around, m->scratch, m->most);
  RM_NEW(group_of, m->scratch, m->num);
  RM_TRY(rm_box_groups(m->scratch, (rm_lid)m->num, box, m->most, around, group_of, &num));
  RM_NEW0(joined, m->scratch, num);
  for (int64_t k = 0; k < m->num; k++) {
    rm_crowd *to = &joined[group_of[k]];

    to->label = to->num > 0 && to->label != crowd[k].label ? RM_SEVERAL_LABELS : crowd[k].label;
    to->rank  = crowd[k].rank;
    to->num += crowd[k].num;
  }
  for (int g = 0; g < num; g++) memcpy(joined[g].box, around[g], sizeof *around);
  m->num  = num;
  m->item = (char *)joined;
  return REMAP_OK;
}

/* What stays of the items of other ranks, and what came. */
static remap_status keep(meeting *m, const region *own, const int64_t num_came[2], void *const came[2])
{
  const int64_t most = m->num + num_came[0] + num_came[1];
  char         *kept = rm_arena_alloc(m->scratch, most, m->size);
  int64_t       num;

  if (!kept) return REMAP_NO_MEMORY;
  num = take(m, own, m->num, m->item, kept);
  for (int k = 0; k < 2; k++) {
    if (num_came[k] > 0) memcpy(kept + (size_t)num * m->size, came[k], (size_t)num_came[k] * m->size);
    num += num_came[k];
  }
  m->num  = num;
  m->item = kept;
  return num > m->most ? join(m) : REMAP_OK;
}

/* Hand items on, from the highest level down. */
static remap_status descend(meeting *m)
{
  for (int level = 0; level < m->num_levels; level++) {
    char   *out = rm_arena_alloc(m->scratch, m->num_own + m->num, m->size);
    int64_t num = 0, num_came[2] = {0, 0};
    void   *came[2] = {NULL, NULL};

    if (out) {
      num = take(m, &m->other[level], m->num_own, m->own_item, out);
      num += take(m, &m->other[level], m->num, m->item, out + (size_t)num * m->size);
    } else {
      m->failed = REMAP_NO_MEMORY;
    }
    for (int k = 0; k < m->num_with[level]; k++)
      RM_TRY(go_on(m, rm_comm_swap(m->comm, m->scratch, m->with[level][k], m->size, k == 0 ? num : 0, out, &num_came[k],
                                   &came[k])));
    RM_TRY(go_on(m, keep(m, &m->own[level + 1], num_came, came)));
  }
  return m->failed;
}

/* This rank's items, then what it meets of others. Not collective. */
static remap_status put_out(rm_arena *arena, const meeting *m, int64_t *num, void **out)
{
  char *all = rm_arena_alloc(arena, m->num_own + m->num, m->size);

  if (!all) return REMAP_NO_MEMORY;
  if (m->num_own > 0) memcpy(all, m->own_item, (size_t)m->num_own * m->size);
  if (m->num > 0) memcpy(all + (size_t)m->num_own * m->size, m->item, (size_t)m->num * m->size);
  *num = m->num_own + m->num;
  *out = all;
  return REMAP_OK;
}

/* All of it, for own items that m has if mine is OK. Collective; the status is this rank's own. */
static remap_status meet(rm_arena *arena, meeting *m, remap_status mine, rm_lid num_asking, const double (*asking)[6],
                         int64_t *num, void **out)
{
  remap_status status;

  m->scratch = rm_arena_new();
  halve(m);
  if (mine == REMAP_OK && !m->scratch) mine = REMAP_NO_MEMORY;
  if (mine == REMAP_OK && m->num_levels > 0) mine = group(m->scratch, num_asking, asking, &m->own[m->num_levels]);
  RM_GOTO(done, status = rm_comm_agree(m->comm, mine, NULL));
  RM_GOTO(done, status = climb(m));
  RM_GOTO(done, status = descend(m));
  status = put_out(arena, m, num, out);
done:
  rm_arena_drop(m->scratch);
  return status;
}

remap_status rm_boxes_meet(rm_arena *arena, const rm_comm *comm, size_t size, int64_t num, const void *item,
                           rm_lid num_asking, const double (*asking)[6], int64_t *num_met, void **met)
{
  meeting m = {.comm = comm, .size = size, .most = RM_ALL_CROWDS, .num_own = num, .own_item = item};

  return rm_comm_agree(comm, meet(arena, &m, REMAP_OK, num_asking, asking, num_met, met), NULL);
}

/* ---- crowds ------------------------------------------------------------------------------------------------------- */

/* This rank's crowds. */
typedef struct making {
  rm_arena *scratch;
  int       rank;
  int64_t   num;
  rm_crowd *crowd; /* [num] */
} making;

/* Add crowds of boxes that have one label. */
static remap_status add_crowds(making *m, rm_lid n, const double (*box)[6], int64_t label, int most)
{
  double (*around)[6];
  int    num = 0;

  RM_NEW(around, m->scratch, most);
  RM_TRY(rm_box_groups(m->scratch, n, box, most, around, NULL, &num));
  for (int g = 0; g < num; g++) {
    rm_crowd *c = &m->crowd[m->num++];

    *c = (rm_crowd){.num = (double)n / num, .rank = m->rank, .label = label};
    memcpy(c->box, around[g], sizeof *around);
  }
  return REMAP_OK;
}

/* Crowds label by label, each with its share of RM_CROWDS. */
static remap_status make_labelled(making *m, rm_lid n, const double (*box)[6], const rm_lid *label)
{
  rm_keyed *keyed, *spare;
  double  (*sorted)[6];
  int       num_labels = 0;

  RM_NEW(keyed, m->scratch, n);
  RM_NEW(spare, m->scratch, n);
  RM_NEW(sorted, m->scratch, n);
  for (rm_lid k = 0; k < n; k++) keyed[k] = (rm_keyed){(uint64_t)label[k], k};
  rm_sort_keyed(keyed, spare, n);
  for (rm_lid k = 0; k < n; k++) {
    memcpy(sorted[k], box[keyed[k].item], sizeof *sorted);
    num_labels += k == 0 || keyed[k].key != keyed[k - 1].key;
  }
  const int share = num_labels > 0 && RM_CROWDS / num_labels > 1 ? RM_CROWDS / num_labels : 1;

  RM_NEW(m->crowd, m->scratch, (int64_t)num_labels * share);
  for (rm_lid k = 0, end; k < n; k = end) {
    for (end = k + 1; end < n && keyed[end].key == keyed[k].key;) end++;
    RM_TRY(add_crowds(m, end - k, (const double(*)[6])(sorted + k), (int64_t)keyed[k].key, share));
  }
  return REMAP_OK;
}

static remap_status make_crowds(making *m, rm_lid n, const double (*box)[6], const rm_lid *label)
{
  if (label) return make_labelled(m, n, box, label);
  RM_NEW(m->crowd, m->scratch, RM_CROWDS);
  return add_crowds(m, n, box, 0, RM_CROWDS);
}

/* The tree over what this rank knows of. Not collective. */
static remap_status plant(rm_arena *arena, int64_t num_own, int64_t num, const rm_crowd *crowd, rm_crowds *out)
{
  RM_REQUIRE(num <= INT32_MAX, REMAP_TOO_LARGE);
  *out = (rm_crowds){.num = (rm_lid)num, .num_own = (rm_lid)num_own, .crowd = crowd};
  RM_TRY(boxes_of(arena, num, crowd, &out->box));
  return rm_boxtree_build(arena, out->num, out->box, &out->tree);
}

remap_status rm_crowds_meet(rm_arena *arena, const rm_comm *comm, rm_lid num_boxes, const double (*box)[6], rm_lid num_asking,
                            const double (*asking)[6], rm_lid most, rm_crowds *out)
{
  return rm_crowds_meet_labelled(arena, comm, num_boxes, box, NULL, num_asking, asking, most, out);
}

remap_status rm_crowds_meet_labelled(rm_arena *arena, const rm_comm *comm, rm_lid num_boxes, const double (*box)[6],
                                     const rm_lid *label, rm_lid num_asking, const double (*asking)[6], rm_lid most,
                                     rm_crowds *out)
{
  making       own  = {.scratch = rm_arena_new(), .rank = comm->rank};
  meeting      m    = {.comm = comm, .size = sizeof *own.crowd, .most = most};
  int64_t      num  = 0;
  void        *all  = NULL;
  remap_status mine = own.scratch ? make_crowds(&own, num_boxes, box, label) : REMAP_NO_MEMORY;

  m.num_own  = own.num;
  m.own_item = (const char *)own.crowd;
  mine       = meet(arena, &m, mine, num_asking, asking, &num, &all);
  if (mine == REMAP_OK) mine = plant(arena, own.num, num, all, out);
  rm_arena_drop(own.scratch);
  return rm_comm_agree(comm, mine, NULL);
}

/* ---- whose crowds a box meets ------------------------------------------------------------------------------------- */

/* What a box's query adds to: the ranks it has met. */
typedef struct listing {
  const rm_crowds *crowds;
  int64_t         *next; /* [comm->size] how many boxes meet a rank, or where the next one goes */
  rm_lid          *last; /* [comm->size] the box that met a rank last                           */
  rm_lid          *item; /* where the boxes go, or NULL to count                                */
  rm_lid           box;  /* the one that asks                                                   */
} listing;

/* A rank counts once, however many of its crowds a box meets. */
static int list_rank(void *user, rm_lid crowd)
{
  listing      *l    = user;
  const int64_t rank = l->crowds->crowd[crowd].rank;

  if (l->last[rank] == l->box) return 0;
  l->last[rank] = l->box;
  if (l->item) l->item[l->next[rank]] = l->box;
  l->next[rank]++;
  return 0;
}

static void list_all(const rm_comm *comm, int left_out, rm_lid num, const rm_lid *which, const double (*box)[6], listing *l)
{
  for (int r = 0; r < comm->size; r++) l->last[r] = -1;
  for (rm_lid k = 0; k < num; k++) {
    l->box = which ? which[k] : k;
    if (left_out >= 0) l->last[left_out] = l->box;
    (void)rm_boxtree_query(l->crowds->tree, l->crowds->box, box[l->box], list_rank, l);
  }
}

remap_status rm_crowds_list(rm_arena *arena, const rm_comm *comm, const rm_crowds *crowds, int left_out, rm_lid num,
                            const rm_lid *which, const double (*box)[6], int64_t *offset, rm_lid **item)
{
  listing l = {.crowds = crowds};

  RM_NEW(l.last, arena, comm->size);
  RM_NEW0(l.next, arena, comm->size);
  list_all(comm, left_out, num, which, box, &l);
  for (int r = 0; r < comm->size; r++) offset[r] = l.next[r];
  RM_NEW(*item, arena, rm_offsets(offset, comm->size));
  for (int r = 0; r < comm->size; r++) l.next[r] = offset[r];
  l.item = *item;
  list_all(comm, left_out, num, which, box, &l);
  return REMAP_OK;
}
