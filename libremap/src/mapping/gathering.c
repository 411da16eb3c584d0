/* gathering -- pairs wait where they were made until all are there, and go home in slices: the last ones first, so that what
 * they took can be given back at once.
 *
 *   overlay rank              home of the receiving cell
 *   (i, j, V, M)   ----->     j, i, V, M                      serves source to target
 *        \------------->      i, j, which pair of j           serves target to source, if j has the same home
 *                             i, j, V, M                      else
 *
 * Where it was made a pair takes 41 bytes, and 8 for each of its cells in each block. It travels as a link of 20 bytes, and 32
 * bytes that it holds. At home it takes 40 bytes, its reverse 12, and 32 more where it is away; what is known of the givers is
 * fetched once per giver, when all pairs are there. O(pairs) time. */
#include "mapping_private.h"

#include <stdlib.h>
#include <string.h>

enum {
  SLACK  = 32, /* growing arrays have so much of their length to spare                    */
  SLICES = 16  /* in which pairs go home, at most: what is under way is kept several times */
};

enum {
  IS_CUT   = 1, /* the skin of the giving mesh passes through the receiver */
  IS_EMPTY = 2  /* the giver has no volume; no pair, but its skin counts   */
};

/* A pair on its way, without what it holds. */
typedef struct link {
  rm_lid  receiver, giver_cell; /* numbers at their homes */
  int32_t giver_rank, what;     /* IS_ bits               */
  rm_lid  twin; /* place among what the pairs hold that go to the same rank the other way, -1: this pair's own goes with it */
} link;

/* Volume, and moments about the source cell's centroid. */
typedef struct held {
  double volume, moment[3];
} held;

/* Pairs by destination, and by sender. */
typedef struct mail {
  int64_t *link_offset, *held_offset; /* [comm->size + 1] */
  link    *link;
  held    *held;                      /* of those links that are pairs and have no twin, in their order */
  double (*second)[6];                /* [links] NULL if there are none                                 */
} mail;

/* ---- out --------------------------------------------------------------------------------------------------------- */

/* What is made ready for one slice: pairs from first on; what they say to one side's cells. */
typedef struct ends {
  remap_side            receiving;
  const rm_pairs_here  *p;
  int64_t               first;
  const rm_home        *to, *from;
  const rm_lid         *receiver, *giver;
  const double        (*second)[6];
  int                   skin;
} ends;

static ends ends_of(const rm_pairs_here *p, int64_t first, remap_side receiving)
{
  const int      to     = (int)receiving, from = 1 - to;
  const double (*second)[6] = (const double(*)[6])(receiving == REMAP_TARGET ? p->second : p->second_back);

  return (ends){.receiving = receiving,
                .p         = p,
                .first     = first,
                .to        = p->home[to],
                .from      = p->home[from],
                .receiver  = p->cell[to],
                .giver     = p->cell[from],
                .second    = second,
                .skin      = receiving == REMAP_TARGET ? RM_PAIR_SOURCE_SKIN : RM_PAIR_TARGET_SKIN};
}

/* Does what pair k holds go with it? */
static bool goes_along(const ends *e, int64_t k)
{
  if (e->p->flags[k] & RM_PAIR_EMPTY) return false;
  return e->receiving == REMAP_TARGET || e->to[e->receiver[k]].rank != e->from[e->giver[k]].rank;
}

static remap_status new_mail(rm_arena *scratch, const rm_comm *comm, const ends *e, mail *out)
{
  RM_NEW0(out->link_offset, scratch, (int64_t)comm->size + 1);
  RM_NEW0(out->held_offset, scratch, (int64_t)comm->size + 1);
  for (int64_t k = e->first; k < e->p->num; k++) {
    const int home = e->to[e->receiver[k]].rank;

    out->link_offset[home]++;
    out->held_offset[home] += goes_along(e, k);
  }
  RM_NEW(out->link, scratch, rm_offsets(out->link_offset, comm->size));
  RM_NEW(out->held, scratch, rm_offsets(out->held_offset, comm->size));
  out->second = NULL;
  if (e->second) RM_NEW(out->second, scratch, e->p->num - e->first);
  return REMAP_OK;
}

/* The pairs of a slice, by the home of the receiving cell. place [pairs] is where a pair's volume stands among what goes to
 * the home of its target cell: written on the way to targets, read on the way to sources. */
static remap_status pack(rm_arena *scratch, const rm_comm *comm, const ends *e, rm_lid *place, mail *out)
{
  const rm_pairs_here *p = e->p;
  int64_t             *next_link, *next_held;

  RM_TRY(new_mail(scratch, comm, e, out));
  RM_NEW(next_link, scratch, comm->size);
  RM_NEW(next_held, scratch, comm->size);
  for (int r = 0; r < comm->size; r++) next_link[r] = out->link_offset[r], next_held[r] = out->held_offset[r];
  for (int64_t k = e->first; k < p->num; k++) {
    const rm_home to = e->to[e->receiver[k]], from = e->from[e->giver[k]];
    const int64_t at   = next_link[to.rank]++;
    const int     what = (p->flags[k] & e->skin ? IS_CUT : 0) | (p->flags[k] & RM_PAIR_EMPTY ? IS_EMPTY : 0);
    const bool    goes = goes_along(e, k);
    held         *h    = out->held + next_held[to.rank];

    if (e->receiving == REMAP_TARGET) place[k - e->first] = (rm_lid)(next_held[to.rank] - out->held_offset[to.rank]);
    out->link[at] = (link){to.cell, from.cell, from.rank, what, goes ? -1 : place[k - e->first]};
    if (goes) {
      h->volume = p->volume[k];
      memcpy(h->moment, p->moment[k], sizeof h->moment);
      next_held[to.rank]++;
    }
    if (e->second) memcpy(out->second[at], e->second[k], sizeof *out->second);
  }
  return REMAP_OK;
}

/* Send and receive. Collective. */
static remap_status deliver(rm_arena *scratch, const rm_comm *comm, const mail *out, bool has_second, mail *in)
{
  void *recv;

  in->link_offset = rm_arena_alloc(scratch, (int64_t)comm->size + 1, sizeof *in->link_offset);
  in->held_offset = rm_arena_alloc(scratch, (int64_t)comm->size + 1, sizeof *in->held_offset);
  in->second      = NULL;
  RM_TRY(rm_comm_agree(comm, in->link_offset && in->held_offset ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_TRY(rm_comm_exchange(comm, scratch, sizeof *out->held, out->held_offset, out->held, in->held_offset, &recv));
  in->held = recv;
  if (has_second) {
    RM_TRY(rm_comm_exchange(comm, scratch, sizeof *out->second, out->link_offset, out->second, in->link_offset, &recv));
    in->second = recv;
  }
  RM_TRY(rm_comm_exchange(comm, scratch, sizeof *out->link, out->link_offset, out->link, in->link_offset, &recv));
  in->link = recv;
  return REMAP_OK;
}

/* ---- in ---------------------------------------------------------------------------------------------------------- */

/* Room for need elements, and a little more: what is left over counts where pairs fill most of the memory. */
static remap_status reserve(void *data, int64_t room, int64_t need, size_t size)
{
  int64_t wish = 0;

  return need > room ? rm_grow(data, &wish, rm_add_sat(need, need / SLACK), size) : REMAP_OK;
}

static remap_status reserve_pairs(rm_arrivals *a, const mail *in, int num_ranks, bool is_source)
{
  const int64_t need = a->num + in->link_offset[num_ranks], room = a->num_held + in->held_offset[num_ranks];

  RM_TRY(reserve(&a->receiver, a->room, need, sizeof *a->receiver));
  RM_TRY(reserve(&a->giver, a->room, need, sizeof *a->giver));
  if (is_source) RM_TRY(reserve(&a->twin, a->room, need, sizeof *a->twin));
  if (in->second) RM_TRY(reserve(&a->second, a->room, need, sizeof *a->second));
  RM_TRY(reserve(&a->volume, a->held_room, room, sizeof *a->volume));
  RM_TRY(reserve(&a->moment, a->held_room, room, sizeof *a->moment));
  if (need > a->room) a->room = need + need / SLACK;
  if (room > a->held_room) a->held_room = room + room / SLACK;
  return REMAP_OK;
}

static uint64_t hash_giver(int32_t rank, rm_lid cell) { return rm_hash_word((uint64_t)rank << 32 | (uint64_t)cell); }

/* Twice as many buckets as there are givers, at least. */
static remap_status rehash(rm_arrivals *a)
{
  const int64_t num = a->num_buckets ? 2 * a->num_buckets : 64;
  rm_lid       *bucket = calloc((size_t)num, sizeof *bucket);

  if (!bucket) return REMAP_NO_MEMORY;
  for (int64_t g = 0; g < a->num_givers; g++) {
    int64_t at = (int64_t)(hash_giver(a->giver_rank[g], a->giver_cell[g]) & (uint64_t)(num - 1));

    while (bucket[at]) at = (at + 1) & (num - 1);
    bucket[at] = (rm_lid)(g + 1);
  }
  free(a->bucket);
  a->bucket      = bucket;
  a->num_buckets = num;
  return REMAP_OK;
}

/* The place of a giver in the list, to which it is added if it is new. */
static remap_status find_giver(rm_arrivals *a, int32_t rank, rm_lid cell, rm_lid *out)
{
  int64_t at;

  if (2 * (a->num_givers + 1) > a->num_buckets) RM_TRY(rehash(a));
  at = (int64_t)(hash_giver(rank, cell) & (uint64_t)(a->num_buckets - 1));
  for (; a->bucket[at]; at = (at + 1) & (a->num_buckets - 1)) {
    *out = a->bucket[at] - 1;
    if (a->giver_cell[*out] == cell && a->giver_rank[*out] == rank) return REMAP_OK;
  }
  RM_TRY(reserve(&a->giver_rank, a->giver_room, a->num_givers + 1, sizeof *a->giver_rank));
  RM_TRY(reserve(&a->giver_cell, a->giver_room, a->num_givers + 1, sizeof *a->giver_cell));
  if (a->num_givers + 1 > a->giver_room) a->giver_room = a->num_givers + 1 + (a->num_givers + 1) / SLACK;
  *out                = (rm_lid)a->num_givers++;
  a->giver_rank[*out] = rank;
  a->giver_cell[*out] = cell;
  a->bucket[at]       = *out + 1;
  return REMAP_OK;
}

/* What has come from one rank behind what came before; its held ones begin at *next. first: where those begin of the target
 * cells from the same rank. */
static remap_status take(rm_arrivals *a, const mail *in, int64_t from, int64_t end, const held *next, int64_t first)
{
  for (int64_t k = from; k < end; k++) {
    const link *l = &in->link[k];

    RM_ASSERT(l->receiver >= 0 && l->twin <= INT32_MAX - first);
    a->is_cut[l->receiver] |= (l->what & IS_CUT) != 0;
    if (l->what & IS_EMPTY) continue;
    RM_TRY(find_giver(a, l->giver_rank, l->giver_cell, &a->giver[a->num]));
    a->receiver[a->num] = l->receiver;
    if (a->twin) a->twin[a->num] = (rm_lid)(l->twin < 0 ? -1 - a->num_held : first + l->twin);
    if (in->second) memcpy(a->second[a->num], in->second[k], sizeof *a->second);
    if (l->twin < 0) {
      a->volume[a->num_held] = next->volume;
      memcpy(a->moment[a->num_held++], next++->moment, sizeof *a->moment);
    }
    a->num++;
  }
  return REMAP_OK;
}

/* Not collective. first [comm->size] is written for the targets, read for the sources. */
static remap_status take_all(rm_gathering *g, const rm_comm *comm, remap_side side, const mail *in, int64_t *first,
                             rm_reason *reason)
{
  rm_arrivals  *a   = &g->of[side];
  const int64_t num = a->num + in->link_offset[comm->size];

  if (num > INT32_MAX)
    return rm_fail(REMAP_TOO_LARGE, reason, (int)side, -1, "%lld pairs come to one rank; use more ranks", (long long)num);
  RM_TRY(reserve_pairs(a, in, comm->size, side == REMAP_SOURCE));
  for (int r = 0; r < comm->size; r++) {
    if (side == REMAP_TARGET) first[r] = a->num_held;
    RM_TRY(take(a, in, in->link_offset[r], in->link_offset[r + 1], in->held + in->held_offset[r], first[r]));
  }
  return REMAP_OK;
}

/* ------------------------------------------------------------------------------------------------------------------ */

/* What a slice says to one side's cells. Collective. */
static remap_status bring_home(rm_gathering *g, const rm_comm *comm, const ends *e, rm_lid *place, int64_t *first,
                               rm_reason *reason)
{
  rm_arena    *going = rm_arena_new(), *coming = rm_arena_new();
  mail         out = {0}, in = {0};
  remap_status status = going && coming ? pack(going, comm, e, place, &out) : REMAP_NO_MEMORY;

  RM_GOTO(done, status = rm_comm_agree(comm, status, NULL));
  RM_GOTO(done, status = deliver(coming, comm, &out, g->has_second, &in));
  rm_arena_drop(going);
  going  = NULL;
  status = rm_comm_agree_reason(comm, take_all(g, comm, e->receiving, &in, first, reason), reason);
done:
  rm_arena_drop(going);
  rm_arena_drop(coming);
  return status;
}

/* The last num of the pairs that are here. Collective. */
static remap_status send_slice(rm_gathering *g, const rm_comm *comm, int64_t num, rm_reason *reason)
{
  static const remap_side order[2] = {REMAP_TARGET, REMAP_SOURCE};
  const int64_t           from     = g->here.num - num;
  rm_arena               *scratch  = rm_arena_new();
  int64_t                *first    = scratch ? rm_arena_alloc(scratch, comm->size, sizeof *first) : NULL;
  rm_lid                 *place    = scratch ? rm_arena_alloc(scratch, num, sizeof *place) : NULL;
  remap_status            status   = rm_comm_agree(comm, first && place ? REMAP_OK : REMAP_NO_MEMORY, NULL);

  for (int k = 0; k < 2 && status == REMAP_OK; k++) {
    const ends e = ends_of(&g->here, from, order[k]);

    status = bring_home(g, comm, &e, place, first, reason);
  }
  rm_arena_drop(scratch);
  return status;
}

/* ---- here -------------------------------------------------------------------------------------------------------- */

static void forget_pairs(rm_pairs_here *p)
{
  void *all[9] = {p->cell[0], p->cell[1], p->home[0], p->home[1], p->volume, p->moment, p->second, p->second_back, p->flags};

  for (int k = 0; k < 9; k++) free(all[k]);
  memset(p, 0, sizeof *p);
}

/* Cut an array off behind n elements. It stays as it is if there is no memory to do that with. */
static void cut_off(void *data, int64_t n, size_t size)
{
  void *array, *shorter;

  memcpy(&array, data, sizeof array); /* data points to a pointer of some type */
  shorter = array && n > 0 ? realloc(array, (size_t)n * size) : NULL;
  if (shorter) memcpy(data, &shorter, sizeof shorter);
}

/* Give back what the last num pairs took, and everything with the last one. */
static void forget_slice(rm_pairs_here *p, int64_t num)
{
  p->num -= num;
  if (p->num == 0) {
    forget_pairs(p);
    return;
  }
  for (int side = 0; side < 2; side++) cut_off(&p->cell[side], p->num, sizeof *p->cell[side]);
  cut_off(&p->volume, p->num, sizeof *p->volume);
  cut_off(&p->moment, p->num, sizeof *p->moment);
  cut_off(&p->second, p->num, sizeof *p->second);
  cut_off(&p->second_back, p->num, sizeof *p->second_back);
  cut_off(&p->flags, p->num, sizeof *p->flags);
}

remap_status rm_gathering_send(rm_gathering *g, const rm_comm *comm, rm_reason *reason)
{
  const int64_t most = (g->here.num + SLICES - 1) / SLICES, size = most > g->slice ? most : g->slice;
  int64_t       num_slices = (g->here.num + size - 1) / size;

  RM_TRY(rm_comm_max_i64(comm, &num_slices, 1));
  for (int64_t s = 0; s < num_slices; s++) {
    const int64_t num = g->here.num < size ? g->here.num : size;

    RM_TRY(send_slice(g, comm, num, reason));
    forget_slice(&g->here, num);
  }
  return REMAP_OK;
}

static remap_status reserve_here(rm_pairs_here *p, const rm_part *part, const rm_moments *m)
{
  const int64_t need = p->num + m->num_pairs;

  for (int side = 0; side < 2; side++) {
    const int64_t homes = p->num_homes[side] + part->piece[side].num_cells;

    RM_REQUIRE(homes <= INT32_MAX, REMAP_TOO_LARGE);
    RM_TRY(reserve(&p->home[side], p->home_room[side], homes, sizeof *p->home[side]));
    if (homes > p->home_room[side]) p->home_room[side] = homes + homes / SLACK;
    RM_TRY(reserve(&p->cell[side], p->room, need, sizeof *p->cell[side]));
  }
  RM_TRY(reserve(&p->volume, p->room, need, sizeof *p->volume));
  RM_TRY(reserve(&p->moment, p->room, need, sizeof *p->moment));
  if (m->second) RM_TRY(reserve(&p->second, p->room, need, sizeof *p->second));
  if (m->second) RM_TRY(reserve(&p->second_back, p->room, need, sizeof *p->second_back));
  RM_TRY(reserve(&p->flags, p->room, need, sizeof *p->flags));
  if (need > p->room) p->room = need + need / SLACK;
  return REMAP_OK;
}

remap_status rm_mapping_add(rm_gathering *g, const rm_part *part, const rm_moments *m)
{
  rm_pairs_here      *p       = &g->here;
  const rm_lid *const cell[2] = {m->source, m->target};
  const size_t        num     = (size_t)m->num_pairs;

  RM_TRY(reserve_here(p, part, m));
  if (num == 0) return REMAP_OK;
  for (int side = 0; side < 2; side++) {
    const rm_piece *piece = &part->piece[side];
    const rm_lid    first = (rm_lid)p->num_homes[side];

    for (rm_lid c = 0; c < piece->num_cells; c++)
      p->home[side][p->num_homes[side]++] = (rm_home){piece->cell_home_rank[c], piece->cell_home[c]};
    for (size_t k = 0; k < num; k++) p->cell[side][(size_t)p->num + k] = first + cell[side][k];
  }
  memcpy(p->volume + p->num, m->volume, num * sizeof *p->volume);
  memcpy(p->moment + p->num, m->moment, num * sizeof *p->moment);
  if (m->second) memcpy(p->second + p->num, m->second, num * sizeof *p->second);
  if (m->second) memcpy(p->second_back + p->num, m->second_back, num * sizeof *p->second_back);
  memcpy(p->flags + p->num, m->flags, num);
  p->num += m->num_pairs;
  return REMAP_OK;
}

rm_gathering *rm_mapping_open(const rm_mesh *const mesh[2], bool has_second, int64_t slice)
{
  rm_gathering *g = calloc(1, sizeof *g);

  for (int side = 0; side < 2 && g; side++) {
    g->has_second      = has_second;
    g->slice           = slice > 0 ? slice : 1;
    g->of[side].is_cut = calloc((size_t)mesh[side]->num_cells + 1, 1);
    if (g->of[side].is_cut) continue;
    rm_gathering_drop(g);
    return NULL;
  }
  return g;
}

void rm_gathering_drop(rm_gathering *g)
{
  for (int side = 0; side < 2 && g; side++) {
    rm_arrivals *a      = &g->of[side];
    void        *all[7] = {a->receiver, a->giver, a->twin, a->second, a->volume, a->moment, a->is_cut};

    for (int k = 0; k < 7; k++) free(all[k]);
    rm_arrivals_forget_givers(a);
  }
  if (g) forget_pairs(&g->here);
  free(g);
}

void rm_arrivals_forget_givers(rm_arrivals *a)
{
  free(a->giver_rank);
  free(a->giver_cell);
  free(a->bucket);
  a->giver_rank = a->giver_cell = a->bucket = NULL;
}

/* ---- order ------------------------------------------------------------------------------------------------------- */

/* What a pair has that is put into the order of rows. */
typedef struct entry {
  rm_lid giver, twin;
  double volume, moment[3], second[6];
} entry;

static void load(const rm_arrivals *a, int64_t k, entry *x)
{
  x->giver = a->giver[k];
  if (a->twin) {
    x->twin = a->twin[k];
  } else {
    x->volume = a->volume[k];
    memcpy(x->moment, a->moment[k], sizeof x->moment);
  }
  if (a->second) memcpy(x->second, a->second[k], sizeof x->second);
}

static void store(rm_arrivals *a, int64_t k, const entry *x)
{
  a->giver[k] = x->giver;
  if (a->twin) {
    a->twin[k] = x->twin;
  } else {
    a->volume[k] = x->volume;
    memcpy(a->moment[k], x->moment, sizeof x->moment);
  }
  if (a->second) memcpy(a->second[k], x->second, sizeof x->second);
}

/* Cycle by cycle; places that are done are complemented. */
void rm_arrivals_permute(rm_arrivals *a, rm_lid *place)
{
  entry kept, moved;

  free(a->receiver);
  a->receiver = NULL;
  for (int64_t k = 0; k < a->num; k++) {
    int64_t at = k;

    if (place[k] < 0) continue;
    load(a, k, &kept);
    while (place[at] != k) {
      const rm_lid from = place[at];

      load(a, from, &moved);
      store(a, at, &moved);
      place[at] = ~from;
      at        = from;
    }
    store(a, at, &kept);
    place[at] = ~place[at];
  }
  for (int64_t k = 0; k < a->num; k++) place[k] = ~place[k];
}
