/* What ranks learn of each other's boxes, against brute force over all of them. */
#include "rt.h"
#include "zone/zone.h"

#include <string.h>

enum { N = 128, SEEDS = 6 };

/* Boxes of a rank: at places by lot in all of the unit cube, near its place in a row, or in the plane x = 1/2 of it all; few,
 * many or none. */
typedef struct world {
  rm_comm   comm;
  rm_arena *arena;
  rm_lid    num[2];      /* boxes it has, and asks for */
  double  (*box[2])[6];
  int64_t  *offset[2];   /* [size + 1] of everybody's  */
  double  (*all[2])[6];
} world;

static double lot(uint64_t *state) { return (double)((*state = rm_hash_word(*state + 1)) >> 11) * 0x1p-53; }

static void place(const rm_comm *comm, int seed, uint64_t *state, double box[6])
{
  const double side = lot(state) < 0.02 ? 0.4 : 0.02;

  for (int d = 0; d < 3; d++) {
    box[d] = lot(state);
    if (seed % 3 == 1 && d == 0) box[d] = (comm->rank + box[d]) / comm->size;
    if (seed % 3 == 2 && d == 0) box[d] = 0.5;
    box[d + 3] = box[d] + side * lot(state);
  }
}

static void open_world(world *w, int seed)
{
  w->arena = rm_arena_new();
  RT_EQ(rm_comm_dup(MPI_COMM_WORLD, &w->comm), REMAP_OK);
  for (int is_asking = 0; is_asking < 2; is_asking++) {
    uint64_t state = rm_hash_word((uint64_t)(seed * 1000 + is_asking * 100 + rt_rank()));
    void    *all;

    w->num[is_asking]    = lot(&state) < 0.2 ? 0 : (rm_lid)(N * lot(&state));
    w->box[is_asking]    = rm_arena_alloc(w->arena, w->num[is_asking], sizeof *w->box[0]);
    w->offset[is_asking] = rm_arena_alloc(w->arena, w->comm.size + 1, sizeof *w->offset[0]);
    for (rm_lid k = 0; k < w->num[is_asking]; k++) place(&w->comm, seed, &state, w->box[is_asking][k]);
    RT_EQ(rm_comm_allgatherv(&w->comm, w->arena, w->box[is_asking], w->num[is_asking], sizeof *w->box[0], w->offset[is_asking],
                             &all),
          REMAP_OK);
    w->all[is_asking] = all;
  }
}

static void close_world(world *w)
{
  rm_comm_free(&w->comm);
  rm_arena_drop(w->arena);
}

static remap_status meet(const world *w, rm_lid most, rm_crowds *crowds)
{
  return rm_crowds_meet(w->arena, &w->comm, w->num[0], (const double(*)[6])w->box[0], w->num[1], (const double(*)[6])w->box[1],
                        most, crowds);
}

static bool holds(const double outer[6], const double inner[6])
{
  for (int d = 0; d < 3; d++)
    if (inner[d] < outer[d] || inner[d + 3] > outer[d + 3]) return false;
  return true;
}

/* A box that this rank asks for meets another rank's: is that in a crowd, which is of that rank unless they are joined? */
static void check_none_is_missing(const world *w, const rm_crowds *crowds, bool is_joined)
{
  for (int r = 0; r < w->comm.size; r++)
    for (int64_t b = w->offset[0][r]; b < w->offset[0][r + 1]; b++) {
      bool meets = false, is_told = false;

      for (rm_lid k = 0; k < w->num[1] && !meets; k++) meets = rm_box_meets(w->box[1][k], w->all[0][b]);
      for (rm_lid c = 0; meets && c < crowds->num && !is_told; c++)
        is_told = holds(crowds->box[c], w->all[0][b]) && (is_joined || crowds->crowd[c].rank == r);
      RT_CHECK(is_told || !meets);
    }
}

static void every_box_that_a_rank_asks_for_is_in_a_crowd_of_whose_it_is(void)
{
  for (int seed = 0; seed < SEEDS; seed++) {
    world     w;
    rm_crowds crowds;

    open_world(&w, seed);
    if (RT_EQ(meet(&w, RM_ALL_CROWDS, &crowds), REMAP_OK)) check_none_is_missing(&w, &crowds, false);
    close_world(&w);
  }
}

/* Some crowd of a rank: as its boxes are grouped there. */
static void a_crowd_comes_once_and_only_if_it_meets_what_is_asked_for(void)
{
  for (int seed = 0; seed < SEEDS; seed++) {
    world     w;
    rm_crowds crowds;

    open_world(&w, seed);
    if (RT_EQ(meet(&w, RM_ALL_CROWDS, &crowds), REMAP_OK)) {
      double around[RM_CROWDS][6];
      int    num = 0;

      RT_EQ(rm_box_groups(w.arena, w.num[1], (const double(*)[6])w.box[1], RM_CROWDS, around, NULL, &num), REMAP_OK);
      for (rm_lid c = 0; c < crowds.num; c++) {
        bool meets = false;

        RT_CHECK((crowds.crowd[c].rank == rt_rank()) == (c < crowds.num_own));
        RT_CHECK(memcmp(crowds.box[c], crowds.crowd[c].box, sizeof *crowds.box) == 0);
        for (int g = 0; g < num && !meets; g++) meets = rm_box_meets(around[g], crowds.box[c]);
        RT_CHECK(meets || c < crowds.num_own);
        for (rm_lid e = 0; e < c; e++)
          RT_CHECK(crowds.crowd[c].rank != crowds.crowd[e].rank || memcmp(crowds.box[c], crowds.box[e], sizeof *crowds.box));
      }
    }
    close_world(&w);
  }
}

static void joined_crowds_are_few_and_leave_nothing_out(void)
{
  for (int seed = 0; seed < SEEDS; seed++)
    for (rm_lid most = 1; most < 100; most *= 3) {
      world     w;
      rm_crowds crowds;

      open_world(&w, seed);
      if (RT_EQ(meet(&w, most, &crowds), REMAP_OK)) {
        RT_CHECK(crowds.num - crowds.num_own <= most);
        check_none_is_missing(&w, &crowds, true);
      }
      close_world(&w);
    }
}

static void who_asks_for_everything_is_told_how_many_boxes_there_are(void)
{
  for (rm_lid most = 3; most < RM_ALL_CROWDS / 1000; most *= 1000) {
    world     w;
    rm_crowds crowds;
    double    everything[6] = {-9, -9, -9, 9, 9, 9}, sum = 0;

    open_world(&w, 0);
    if (RT_EQ(rm_crowds_meet(w.arena, &w.comm, w.num[0], (const double(*)[6])w.box[0], 1, (const double(*)[6]) & everything,
                             most, &crowds),
              REMAP_OK)) {
      for (rm_lid c = 0; c < crowds.num; c++) sum += crowds.crowd[c].num;
      RT_NEAR(sum, (double)w.offset[0][w.comm.size], 1e-9 * sum);
    }
    close_world(&w);
  }
}

/* Along a row a rank meets its two neighbours: whatever their number, it is told of no one else. */
static void a_rank_in_a_row_is_told_of_its_neighbours_only(void)
{
  double    own[N][6];
  rm_comm   comm;
  rm_arena *arena = rm_arena_new();
  rm_crowds crowds;

  RT_EQ(rm_comm_dup(MPI_COMM_WORLD, &comm), REMAP_OK);
  for (int k = 0; k < N; k++) {
    const double x = comm.rank + (double)k / N; /* exact */

    memcpy(own[k], (double[6]){x, 0, 0, x + 1.0 / N, 1, 1}, sizeof own[k]);
  }
  if (RT_EQ(rm_crowds_meet(arena, &comm, N, (const double(*)[6])own, N, (const double(*)[6])own, RM_ALL_CROWDS, &crowds),
            REMAP_OK)) {
    RT_CHECK(crowds.num_own > RM_CROWDS / 4 && crowds.num_own <= RM_CROWDS);
    RT_EQ(crowds.num - crowds.num_own, (comm.rank > 0) + (comm.rank < comm.size - 1));
  }
  rm_comm_free(&comm);
  rm_arena_drop(arena);
}

static rm_lid label_of(int rank, int64_t k) { return (rm_lid)((7 * rank + k) % 5); }

/* Is every box that this rank asks for in a crowd of its label, or of several? */
static void check_labels(const world *w, const rm_crowds *crowds, bool may_be_several)
{
  for (rm_lid c = 0; c < crowds->num; c++) {
    const int64_t label = crowds->crowd[c].label;

    RT_CHECK((label >= 0 && label < 5) || (may_be_several && c >= crowds->num_own && label == RM_SEVERAL_LABELS));
  }
  for (int r = 0; r < w->comm.size; r++)
    for (int64_t k = w->offset[0][r]; k < w->offset[0][r + 1]; k++) {
      const int64_t label = label_of(r, k - w->offset[0][r]);
      bool          asks = false, found = false;

      for (rm_lid q = 0; q < w->num[1]; q++) asks = asks || rm_box_meets(w->all[0][k], w->box[1][q]);
      for (rm_lid c = 0; c < crowds->num; c++)
        found = found || ((crowds->crowd[c].label == label || crowds->crowd[c].label == RM_SEVERAL_LABELS) &&
                          holds(crowds->box[c], w->all[0][k]));
      RT_CHECK(found || !asks);
    }
}

static void crowds_have_the_labels_of_their_boxes(void)
{
  static const rm_lid most[2] = {RM_ALL_CROWDS, 3};

  for (int k = 0; k < 2 * SEEDS; k++) {
    world     w;
    rm_crowds crowds;
    rm_lid    label[N];

    open_world(&w, k / 2);
    for (rm_lid i = 0; i < w.num[0]; i++) label[i] = label_of(w.comm.rank, i);
    if (RT_EQ(rm_crowds_meet_labelled(w.arena, &w.comm, w.num[0], (const double(*)[6])w.box[0], label, w.num[1],
                                      (const double(*)[6])w.box[1], most[k % 2], &crowds),
              REMAP_OK))
      check_labels(&w, &crowds, k % 2 != 0);
    close_world(&w);
  }
}

static void memory_that_runs_out_on_one_rank_fails_on_all(void)
{
  int failed = 0;

  for (int64_t at = 1; at < 6; at++) {
    world     w;
    rm_crowds crowds;

    open_world(&w, 1);
    if (w.comm.rank == w.comm.size / 2) rm_arena_fail_at(w.arena, at);
    failed += meet(&w, RM_ALL_CROWDS, &crowds) == REMAP_NO_MEMORY;
    close_world(&w);
  }
  RT_CHECK(failed > 2 && failed < 6);
}

RT_MAIN(RT_CASE(every_box_that_a_rank_asks_for_is_in_a_crowd_of_whose_it_is),
        RT_CASE(a_crowd_comes_once_and_only_if_it_meets_what_is_asked_for),
        RT_CASE(joined_crowds_are_few_and_leave_nothing_out),
        RT_CASE(who_asks_for_everything_is_told_how_many_boxes_there_are),
        RT_CASE(a_rank_in_a_row_is_told_of_its_neighbours_only), RT_CASE(crowds_have_the_labels_of_their_boxes),
        RT_CASE(memory_that_runs_out_on_one_rank_fails_on_all))
