/* Limiters and orders: errors fall as they should on smooth fields, jumps stay within bounds, and bits do not
 * depend on ranks. With REMAP_LONG_TESTS the meshes are twice as fine. */
#include "carried.h"

/* ---- convergence ------------------------------------------------------------------------------------------------------ */

static const struct {
  int           order;
  remap_limiter limiter;
  double        l1, l2; /* least orders of convergence */
} ways[] = {{2, REMAP_LIMITER_NONE, 1.9, 1.7},
            {2, REMAP_LIMITER_AUTO, 1.9, 1.7},
            {3, REMAP_LIMITER_NONE, 2.8, 2.5},
            {3, REMAP_LIMITER_AUTO, 1.9, 1.7}};
enum { NUM_WAYS = sizeof ways / sizeof *ways };

static bool find_errors(av_kind kind, int n, av_error out[AV_NUM][NUM_WAYS])
{
  carried    w;
  const bool ready = carried_open(&w, MPI_COMM_SELF, 3, av_mesh(kind, n, 0.03), av_mesh(kind, n + 1, -0.02), 0);

  for (int q = AV_TRIG; q <= AV_FRANKE && ready; q++) {
    carried_evaluate(&w, av_fields[q].of);
    for (int k = 0; k < NUM_WAYS; k++) {
      carried_move(&w, REMAP_FORWARD, ways[k].order, ways[k].limiter, w.mean[0], w.got[1], NULL);
      out[q][k] = av_difference(w.cells[1], w.volume[1], w.got[1], w.mean[1]);
    }
  }
  carried_close(&w);
  return ready;
}

static void errors_on_smooth_fields_fall_with_the_order(void)
{
  static const int size[] = {8, 16, 16, 8}; /* of the coarser mesh, by kind */
  const int        finer  = rt_long() ? 2 : 1;

  for (int kind = 0; kind < AV_NUM_KINDS; kind++) {
    av_error coarse[AV_NUM][NUM_WAYS], fine[AV_NUM][NUM_WAYS];

    if (!find_errors((av_kind)kind, finer * size[kind], coarse) || !find_errors((av_kind)kind, 2 * finer * size[kind], fine))
      continue;
    for (int q = AV_TRIG; q <= AV_FRANKE; q++)
      for (int k = 0; k < NUM_WAYS; k++) {
        const double l1 = log2(coarse[q][k].l1 / fine[q][k].l1), l2 = log2(coarse[q][k].l2 / fine[q][k].l2);

        if (!RT_CHECK(l1 >= ways[k].l1 && l2 >= ways[k].l2))
          printf("# %s, %s, order %d, limiter %d: L1 %.2f, L2 %.2f\n", av_kind_name[kind], av_fields[q].name, ways[k].order,
                 (int)ways[k].limiter, l1, l2);
      }
  }
}

/* ---- bounds ----------------------------------------------------------------------------------------------------------- */

static double slanted(const double x[3]) { return x[0] + 0.7 * x[1] - 0.4 * x[2] > 0.6; }
/* One and a half cells deep, where the walls' cells alone would say that it is linear. */
static double film(const double x[3]) { return x[2] < 1.5 / 8; }
static double lot(const double x[3]) { return sin(91 * x[0] + 173 * x[1] - 57 * x[2]) > 0.3; }
/* A jump on top of a smooth field that stays far from it. */
static double shock(const double x[3]) { return (x[0] < 0.45 ? 100.0 : 1.0) * (1 + 0.1 * x[1]); }

static void jumps_stay_within_bounds(void)
{
  static av_field *const     jump[]    = {av_sphere, slanted, film, lot, shock};
  static const remap_limiter limiter[] = {REMAP_LIMITER_BARTH_JESPERSEN, REMAP_LIMITER_CAAS, REMAP_LIMITER_AUTO};

  for (int kind = 0; kind < AV_NUM_KINDS; kind++)
    for (int finer = 0; finer < 2; finer++) {
      carried    w;
      const int  n = kind == AV_DUAL ? 12 : 8;
      const bool ready =
          carried_open(&w, MPI_COMM_WORLD, 3, av_mesh((av_kind)kind, n, 0.02), av_mesh(AV_HEXAHEDRA, finer ? 15 : 7, -0.03), 0);

      for (int j = 0; j < 5 && ready; j++) {
        carried_evaluate(&w, jump[j]);
        for (int k = 0; k < 6; k++) {
          remap_field_report r;

          if (!carried_move(&w, REMAP_FORWARD, 2 + k / 3, limiter[k % 3], w.mean[0], w.got[1], &r)) continue;
          const double by = (j == 4 && k % 3 == 2 ? 1 : 1e-14) * fabs(r.source_max); /* the shock is smooth along itself */
          if (!RT_CHECK(r.target_min >= r.source_min - by && r.target_max <= r.source_max + by))
            printf("# %s, jump %d, order %d, limiter %d: %g %g\n", av_kind_name[kind], j, 2 + k / 3, (int)limiter[k % 3],
                   r.target_min - r.source_min, r.target_max - r.source_max);
          RT_CHECK(r.conservation_error <= 1e-14);
        }
      }
      carried_close(&w);
    }
}

static double positive(const double x[3]) { return exp(-40 * x[0]); }

static void smooth_fields_do_not_change_sign(void)
{
  carried w;

  if (carried_open(&w, MPI_COMM_WORLD, 3, av_mesh(AV_HEXAHEDRA, 12, 0.02), av_mesh(AV_HEXAHEDRA, 17, -0.03), 0)) {
    carried_evaluate(&w, positive);
    for (int order = 2; order <= 3; order++) {
      remap_field_report r;

      if (carried_move(&w, REMAP_FORWARD, order, REMAP_LIMITER_AUTO, w.mean[0], w.got[1], &r)) RT_CHECK(r.target_min >= 0);
    }
  }
  carried_close(&w);
}

/* ---- bits ------------------------------------------------------------------------------------------------------------- */

static void bits_depend_neither_on_ranks_nor_partition_nor_numbering(void)
{
  static const remap_limiter limiter[] = {REMAP_LIMITER_CAAS, REMAP_LIMITER_AUTO};

  for (int kind = 0; kind < AV_NUM_KINDS; kind++)
    for (int k = 0; k < 2; k++) {
      carried    alone, together;
      const bool ready[2] = {
          carried_open(&alone, MPI_COMM_SELF, 3, av_mesh((av_kind)kind, 8, 0.03), av_mesh(AV_HEXAHEDRA, 5, -0.02), 0),
          carried_open(&together, MPI_COMM_WORLD, 3, av_mesh((av_kind)kind, 8, 0.03), av_mesh(AV_HEXAHEDRA, 5, -0.02), 3)};
      double *want = tm_alloc_(125, sizeof *want);

      for (int j = 0; j < 2 && ready[0] && ready[1]; j++) {
        carried_evaluate(&alone,
                         j ? av_sphere : av_trig); /* means are sums in the order of numbers: the others take them from here */
        for (int64_t c = 0; c < together.cells[0]; c++)
          together.mean[0][c] = alone.mean[0][together.mine[0]->view.cell_global[c]];
        for (int order = 2; order <= 3; order++) {
          remap_field_report report[2];

          carried_move(&alone, REMAP_FORWARD, order, limiter[k], alone.mean[0], alone.got[1], &report[0]);
          carried_move(&together, REMAP_FORWARD, order, limiter[k], together.mean[0], together.got[1], &report[1]);
          for (int64_t c = 0; c < alone.cells[1]; c++) want[alone.mine[1]->view.cell_global[c]] = alone.got[1][c];
          for (int64_t c = 0; c < together.cells[1]; c++)
            if (!RT_NEAR(together.got[1][c], want[together.mine[1]->view.cell_global[c]], 0.0)) break;
          RT_EQ(report[1].limited_cells, report[0].limited_cells);
        }
      }
      free(want);
      carried_close(&alone), carried_close(&together);
    }
}

RT_MAIN(RT_ALONE(errors_on_smooth_fields_fall_with_the_order), RT_CASE(jumps_stay_within_bounds),
        RT_CASE(smooth_fields_do_not_change_sign), RT_CASE(bits_depend_neither_on_ranks_nor_partition_nor_numbering))
