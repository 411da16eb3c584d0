/* One rank makes another call than the others, or passes other arguments where all must agree: nobody waits for ever, those
 * that differ are told, and the next call that all make alike works as if nothing had happened. */
#include <remap/remap.h>
#include "meshes.h"
#include "rt.h"

typedef struct world {
  remap_context *ctx;
  tm_mesh       *mine[2];
  double        *u[2], *got[2]; /* [side][cells][MOST_FIELDS] */
  double        *pieces;        /* [MOST_PIECES]              */
} world;

enum { MOST_FIELDS = 24, MOST_PIECES = 10000 };

static void open_world(world *w, int n)
{
  RT_EQ(remap_create(MPI_COMM_WORLD, NULL, &w->ctx), REMAP_OK);
  w->pieces = tm_alloc_(MOST_PIECES, sizeof *w->pieces);
  for (int side = 0; side < 2; side++) {
    static const double away[12] = {1, 0, 0, .3, 0, 1, 0, .2, 0, 0, 1, -.1};
    tm_mesh            *whole    = tm_hexahedra((int[]){n, n, n + side}, tm_warp, &(tm_warping){0.03, 0.7});

    if (side) tm_move(whole, tm_affine, away);
    int *deal     = tm_deal(whole, rt_size(), TM_SLABS, 0);
    w->mine[side] = tm_part(whole, deal, rt_rank(), 3);
    w->u[side]    = tm_alloc_(MOST_FIELDS * w->mine[side]->view.num_cells, sizeof(double));
    w->got[side]  = tm_alloc_(MOST_FIELDS * w->mine[side]->view.num_cells, sizeof(double));
    for (int64_t c = 0; c < MOST_FIELDS * w->mine[side]->view.num_cells; c++) w->u[side][c] = 1 + (double)(c % 7);
    RT_EQ(remap_set_mesh(w->ctx, side, &w->mine[side]->view), REMAP_OK);
    tm_free(whole), free(deal);
  }
}

static void close_world(world *w)
{
  remap_destroy(&w->ctx);
  free(w->pieces);
  for (int side = 0; side < 2; side++) tm_free(w->mine[side]), free(w->u[side]), free(w->got[side]);
}

typedef enum reporting { WITHOUT, WITH, HALVES, HALVES_WITH } reporting;

static remap_status transfer(world *w, int d, int order, remap_limiter limiter, int num, reporting how)
{
  const int          in = d & 1, out = 1 - in; /* d may be no direction */
  const int64_t      n[2] = {w->mine[in]->view.num_cells, w->mine[out]->view.num_cells};
  remap_field_desc   f[MOST_FIELDS];
  remap_field_report report[MOST_FIELDS];
  remap_transfer     t;

  remap_transfer_default(&t);
  t.order   = order;
  t.limiter = limiter;
  for (int k = 0; k < num; k++)
    f[k] =
        (remap_field_desc){.nature = REMAP_CONSERVED, .has_old = 1, .in = w->u[in] + k * n[0], .out = w->got[out] + k * n[1]};
  if (how == WITHOUT || how == WITH) return remap_field(w->ctx, (remap_direction)d, &t, num, f, how == WITH ? report : NULL);
  const remap_status status = remap_field_start(w->ctx, (remap_direction)d, &t, num, f);
  return status != REMAP_OK ? status : remap_field_finish(w->ctx, (remap_direction)d, how == HALVES_WITH ? report : NULL);
}

static remap_status make_supermesh(world *w)
{
  remap_supermesh_view view;
  const remap_status   status = remap_supermesh(w->ctx, NULL, &view);

  if (status == REMAP_OK) RT_CHECK(view.num_cells <= MOST_PIECES);
  return status;
}

static remap_status take_over(world *w, remap_side side)
{
  return remap_supermesh_cell_values(w->ctx, side, w->u[side], 0.0, w->pieces);
}

/* Calls that no two of are alike. The last three change the context if all make them. */
enum { NUM_CALLS = 24 };
static bool         is_wrong_anyway(int call) { return call == 12 || call == 13 || call == 17; }
static remap_status make_call(world *w, int call)
{
  static const double turned[12] = {1, 0, 0, .01, 0, 1, 0, 0, 0, 0, 1, 0};
  const remap_motion  motion[2]  = {{NULL, turned}, {NULL, NULL}};
  remap_partial_cell  partial[2];
  int                 two = 2;

  switch (call) {
    case 0: return transfer(w, 0, 1, REMAP_LIMITER_NONE, 1, WITHOUT);
    case 1: return transfer(w, 0, 1, REMAP_LIMITER_NONE, 2, WITHOUT);
    case 2: return transfer(w, 0, 2, REMAP_LIMITER_NONE, 2, WITHOUT);
    case 3: return transfer(w, 0, 2, REMAP_LIMITER_BARTH_JESPERSEN, 2, WITHOUT);
    case 4: return transfer(w, 0, 2, REMAP_LIMITER_AUTO, 2, WITHOUT);
    case 5: return transfer(w, 0, 2, REMAP_LIMITER_CAAS, 2, WITHOUT);
    case 6: return transfer(w, 0, 2, REMAP_LIMITER_AUTO, 2, WITH);
    case 7: return transfer(w, 0, 2, REMAP_LIMITER_CAAS, 2, WITH);
    case 8: return transfer(w, 1, 2, REMAP_LIMITER_AUTO, 2, WITHOUT);
    case 9: return transfer(w, 0, 2, REMAP_LIMITER_AUTO, 2, HALVES);
    case 10: return transfer(w, 0, 2, REMAP_LIMITER_AUTO, 2, HALVES_WITH);
    case 11: return transfer(w, 0, 1, REMAP_LIMITER_NONE, 0, WITHOUT);
    case 12: return transfer(w, 0, 99, REMAP_LIMITER_NONE, 1, WITHOUT); /* BAD_ARGUMENT anyway */
    case 13: return transfer(w, 7, 1, REMAP_LIMITER_NONE, 0, WITHOUT);  /* likewise            */
    case 14: return remap_agree(w->ctx, REMAP_OK);
    case 15: return remap_partial_cells(w->ctx, REMAP_TARGET, &two, partial);
    case 16: return transfer(w, 0, 2, REMAP_LIMITER_AUTO, MOST_FIELDS, WITHOUT); /* is prepared for by all together */
    case 17: return transfer(w, 0, 99, REMAP_LIMITER_NONE, 1, HALVES);
    case 18: return make_supermesh(w);
    case 19: return take_over(w, REMAP_SOURCE);
    case 20: return take_over(w, REMAP_TARGET);
    case 21: return remap_set_masks(w->ctx, NULL);
    case 22: return remap_move(w->ctx, motion);
    default: return remap_build(w->ctx);
  }
}

/* Build, and the first transfers, so that later ones are for neighbours. */
static void prepare(world *w)
{
  RT_EQ(remap_build(w->ctx), REMAP_OK);
  RT_EQ(transfer(w, 0, 2, REMAP_LIMITER_AUTO, 2, WITHOUT), REMAP_OK);
  RT_EQ(transfer(w, 0, 2, REMAP_LIMITER_CAAS, 2, WITHOUT), REMAP_OK);
  RT_EQ(transfer(w, 1, 2, REMAP_LIMITER_AUTO, 2, WITHOUT), REMAP_OK);
  RT_EQ(make_supermesh(w), REMAP_OK);
}

/* Rank `odd` makes one call, the others another. */
static bool differ(world *w, int odd, int one, int other)
{
  const remap_status mine = make_call(w, rt_rank() == odd ? one : other);
  bool               ok   = RT_CHECK(mine == REMAP_OK || mine == REMAP_BAD_ARGUMENT);

  if (rt_rank() == odd) ok &= RT_EQ(mine, REMAP_BAD_ARGUMENT);
  if (mine != REMAP_OK) ok &= RT_CHECK(remap_message(w->ctx)[0] != '\0');
  if (!rt_all(ok)) return false;
  ok = RT_EQ(remap_agree(w->ctx, mine), REMAP_BAD_ARGUMENT);
  ok &= RT_EQ(transfer(w, 0, 1, REMAP_LIMITER_NONE, 1, WITHOUT), REMAP_OK);
  ok &= RT_EQ(take_over(w, REMAP_SOURCE), REMAP_OK); /* the supermesh is still there, too */
  return rt_all(ok);
}

static void a_call_that_one_rank_makes_differently_is_refused_and_the_next_one_works(void)
{
  world w;

  open_world(&w, 4);
  prepare(&w);
  for (int one = 0; one < NUM_CALLS && rt_size() > 1; one++)
    for (int other = 0; other < NUM_CALLS; other++) {
      if (one == other || (is_wrong_anyway(one) && is_wrong_anyway(other))) continue;
      if (differ(&w, (one + other) % rt_size(), one, other)) continue;
      if (rt_rank() == 0) printf("# call %d, the others %d\n", one, other);
      close_world(&w);
      return;
    }
  for (int call = 0; call < NUM_CALLS; call++) /* all alike */
    RT_EQ(make_call(&w, call), is_wrong_anyway(call) ? REMAP_BAD_ARGUMENT : REMAP_OK);
  close_world(&w);
}

/* Messages of another length than the receiver has room for, too long to travel unasked. */
static void long_messages_that_nobody_expects_are_taken_away(void)
{
  world w;

  open_world(&w, 14);
  RT_EQ(remap_build(w.ctx), REMAP_OK);
  RT_EQ(transfer(&w, 0, 2, REMAP_LIMITER_NONE, MOST_FIELDS, WITHOUT), REMAP_OK);
  for (int odd = 0; odd < rt_size() && rt_size() > 1; odd++)
    for (int many = 0; many < 2; many++) {
      const bool         mine   = (rt_rank() == odd) == (many == 1);
      const remap_status status = transfer(&w, 0, 1 + mine, REMAP_LIMITER_NONE, mine ? MOST_FIELDS : 1, WITHOUT);

      if (rt_rank() == odd) RT_EQ(status, REMAP_BAD_ARGUMENT);
      RT_EQ(remap_agree(w.ctx, status), REMAP_BAD_ARGUMENT);
      RT_EQ(transfer(&w, 0, 1, REMAP_LIMITER_NONE, 1, WITHOUT), REMAP_OK);
    }
  close_world(&w);
}

/* Before there is an overlay, and before there are transfers. */
static void calls_before_a_build_are_refused_and_so_are_first_ones_that_differ(void)
{
  static const double turned[12] = {1, 0, 0, .01, 0, 1, 0, 0, 0, 0, 1, 0};
  const remap_motion  motion[2]  = {{NULL, turned}, {NULL, NULL}};
  const bool          is_last    = rt_rank() == rt_size() - 1 && rt_size() > 1;
  world               w;

  open_world(&w, 3);
  RT_EQ(transfer(&w, 0, 1, REMAP_LIMITER_NONE, 1, WITHOUT), REMAP_BAD_ORDER);
  RT_EQ(remap_set_masks(w.ctx, NULL), REMAP_BAD_ORDER);
  RT_EQ(remap_move(w.ctx, motion), REMAP_BAD_ORDER);
  RT_EQ(remap_partial_cells(w.ctx, REMAP_TARGET, &(int){0}, NULL), REMAP_BAD_ORDER);
  RT_CHECK(strstr(remap_message(w.ctx), "remap_build") != NULL);
  RT_EQ(is_last ? remap_move(w.ctx, motion) : remap_build(w.ctx), rt_size() > 1 ? REMAP_BAD_ARGUMENT : REMAP_OK);
  RT_EQ(remap_build(w.ctx), REMAP_OK);
  RT_EQ(transfer(&w, is_last, 1, REMAP_LIMITER_NONE, 1, WITHOUT), rt_size() > 1 ? REMAP_BAD_ARGUMENT : REMAP_OK);
  RT_EQ(is_last ? remap_agree(w.ctx, REMAP_OK) : transfer(&w, 0, 1, REMAP_LIMITER_NONE, 1, WITHOUT),
        rt_size() > 1 ? REMAP_BAD_ARGUMENT : REMAP_OK);
  RT_EQ(transfer(&w, 0, 2, REMAP_LIMITER_NONE, 1, WITHOUT), REMAP_OK);

  /* One rank lends a mesh again: its overlay is gone, that of the others is not. */
  if (is_last) RT_EQ(remap_set_mesh(w.ctx, REMAP_SOURCE, &w.mine[0]->view), REMAP_OK);
  const remap_status status = transfer(&w, 0, 2, REMAP_LIMITER_NONE, 1, WITHOUT);
  RT_CHECK(!is_last || status == REMAP_BAD_ORDER);
  if (rt_size() > 1) RT_CHECK(remap_agree(w.ctx, status) == REMAP_BAD_ORDER);
  RT_EQ(remap_set_masks(w.ctx, NULL), rt_size() > 1 ? REMAP_BAD_ORDER : REMAP_OK);
  RT_EQ(remap_build(w.ctx), REMAP_OK);
  RT_EQ(transfer(&w, 0, 2, REMAP_LIMITER_NONE, 1, WITHOUT), REMAP_OK);
  close_world(&w);
}

/* The overlay of what was lent before is not used for what has more cells, or fewer. */
static void meshes_of_another_size_are_refused_until_they_are_built(void)
{
  static const double away[12] = {1, 0, 0, .01, 0, 1, 0, 0, 0, 0, 1, 0};
  const remap_motion  motion[2] = {{NULL, away}, {NULL, NULL}};
  remap_pairs_view    pairs;
  world               w[2];

  for (int k = 0; k < 2; k++) open_world(&w[k], 4 - k);
  RT_EQ(remap_build(w[0].ctx), REMAP_OK);
  for (int larger = 0; larger < 2; larger++) {
    world *now = &w[1 - larger];

    RT_EQ(remap_set_mesh(w[0].ctx, REMAP_TARGET, &now->mine[1]->view), REMAP_OK);
    RT_EQ(transfer(&w[0], 0, 1, REMAP_LIMITER_NONE, 1, WITHOUT), REMAP_BAD_ORDER);
    RT_EQ(remap_move(w[0].ctx, motion), REMAP_BAD_ORDER);
    RT_CHECK(remap_message(w[0].ctx)[0] != '\0');
    RT_EQ(remap_pairs(w[0].ctx, REMAP_FORWARD, &pairs), REMAP_BAD_ORDER);
    RT_EQ(remap_build(w[0].ctx), REMAP_OK);
    RT_EQ(remap_pairs(w[0].ctx, REMAP_FORWARD, &pairs), REMAP_OK);
    RT_EQ(pairs.num_rows, now->mine[1]->view.num_cells);
  }
  for (int k = 0; k < 2; k++) close_world(&w[k]);
}

/* What only looks, or lends, says why it fails, and not what failed before. */
static void messages_are_those_of_the_last_failure_of_any_call(void)
{
  remap_stats      stats;
  remap_pairs_view pairs;
  int64_t          num;
  world            w;

  open_world(&w, 3);
  RT_EQ(remap_build(w.ctx), REMAP_OK);
  RT_EQ(transfer(&w, 7, 1, REMAP_LIMITER_NONE, 1, WITHOUT), REMAP_BAD_ARGUMENT);
  RT_CHECK(strstr(remap_message(w.ctx), "direction is 7") != NULL);
  RT_EQ(remap_set_mesh(w.ctx, REMAP_SOURCE, NULL), REMAP_BAD_ARGUMENT);
  RT_CHECK(strstr(remap_message(w.ctx), "mesh is NULL") != NULL);
  RT_EQ(remap_set_blocks(w.ctx, (remap_side)5, 1, &w.mine[0]->view), REMAP_BAD_ARGUMENT);
  RT_CHECK(strstr(remap_message(w.ctx), "side is 5") != NULL);
  RT_EQ(remap_set_blocks(w.ctx, REMAP_SOURCE, -1, &w.mine[0]->view), REMAP_BAD_ARGUMENT);
  RT_CHECK(strstr(remap_message(w.ctx), "num_blocks is -1") != NULL);
  RT_EQ(remap_get_stats(w.ctx, NULL), REMAP_BAD_ARGUMENT);
  RT_CHECK(strstr(remap_message(w.ctx), "remap_get_stats") != NULL);
  RT_EQ(remap_pairs(w.ctx, (remap_direction)2, &pairs), REMAP_BAD_ARGUMENT);
  RT_CHECK(strstr(remap_message(w.ctx), "remap_pairs") != NULL);
  RT_EQ(remap_uncovered(w.ctx, REMAP_TARGET, NULL, NULL), REMAP_BAD_ARGUMENT);
  RT_CHECK(strstr(remap_message(w.ctx), "remap_uncovered") != NULL);
  RT_EQ(remap_get_stats(w.ctx, &stats), REMAP_OK);
  RT_CHECK(remap_message(w.ctx)[0] == '\0');
  RT_EQ(remap_set_mesh(w.ctx, REMAP_SOURCE, &w.mine[0]->view), REMAP_OK);
  RT_EQ(remap_coverage(w.ctx, REMAP_SOURCE, NULL, NULL), REMAP_BAD_ORDER);
  RT_CHECK(strstr(remap_message(w.ctx), "remap_coverage needs a successful remap_build") != NULL);
  RT_EQ(remap_uncovered(w.ctx, REMAP_SOURCE, &num, NULL), REMAP_BAD_ORDER);
  RT_EQ(remap_cells(w.ctx, REMAP_SOURCE, NULL, NULL), REMAP_BAD_ORDER);
  RT_EQ(remap_get_stats(w.ctx, &stats), REMAP_BAD_ORDER);
  RT_EQ(remap_pairs(w.ctx, REMAP_FORWARD, &pairs), REMAP_BAD_ORDER);
  close_world(&w);
}

RT_MAIN(RT_CASE(a_call_that_one_rank_makes_differently_is_refused_and_the_next_one_works),
        RT_CASE(long_messages_that_nobody_expects_are_taken_away),
        RT_CASE(calls_before_a_build_are_refused_and_so_are_first_ones_that_differ),
        RT_CASE(meshes_of_another_size_are_refused_until_they_are_built),
        RT_CASE(messages_are_those_of_the_last_failure_of_any_call))
