/* Coverage as callers see it: what is too little counts as none, and the worst cells are told. */
#include "carried.h"

/* A cube whose last layer along x sticks out of the unit cube by four fifths of it. */
static tm_mesh *sticking_out(int n)
{
  const double h = 1.0 / (n - 1 + 0.2);

  return tm_hexahedra((int[]){n, n, n}, tm_affine, (double[]){n * h, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
}

static bool open_cubes(carried *w)
{
  return carried_open(w, MPI_COMM_WORLD, 2, av_mesh(AV_HEXAHEDRA, 5, 0.03), sticking_out(6), 3);
}

static void cells_covered_too_little_count_as_uncovered(void)
{
  carried w;

  if (open_cubes(&w)) {
    for (int k = 0; k < 2; k++) {
      const remap_masks  masks = {.min_coverage = {0, k ? 0.25 : 0.15}};
      remap_cover       *cover = tm_alloc_(w.cells[1], sizeof *cover);
      remap_field_report report;
      remap_transfer     how;
      int64_t            num[3] = {0, 0, 0};

      remap_transfer_default(&how);
      carried_evaluate(&w, av_linear);
      const remap_field_desc field = {.name = "u", .has_old = 1, .in = w.mean[0], .out = w.got[1]};
      for (int64_t c = 0; c < w.cells[1]; c++) w.got[1][c] = -3.0;
      RT_EQ(remap_set_masks(w.ctx, &masks), REMAP_OK);
      RT_EQ(remap_coverage(w.ctx, REMAP_TARGET, NULL, cover), REMAP_OK);
      RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &field, &report), REMAP_OK);
      for (int64_t c = 0; c < w.cells[1]; c++) {
        RT_CHECK(cover[c] != (k ? REMAP_PARTIAL : REMAP_UNCOVERED));
        if (cover[c] == REMAP_UNCOVERED) RT_CHECK(w.got[1][c] == -3.0);
        num[cover[c]]++;
      }
      MPI_Allreduce(MPI_IN_PLACE, num, 3, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
      RT_EQ(num[k ? REMAP_UNCOVERED : REMAP_PARTIAL], 36);
      RT_CHECK(report.conservation_error <= 1e-14);
      free(cover);
    }
    RT_EQ(remap_set_masks(w.ctx, NULL), REMAP_OK);
  }
  carried_close(&w);
}

static void thresholds_beyond_one_or_unlike_on_two_ranks_are_refused(void)
{
  static const double bad[] = {-0.1, 1.1, NAN};
  carried             w;

  if (open_cubes(&w)) {
    for (int k = 0; k < 3; k++) {
      const remap_masks masks = {.min_coverage = {0, bad[k]}};

      RT_EQ(remap_set_masks(w.ctx, &masks), REMAP_BAD_ARGUMENT);
    }
    const remap_masks unlike = {.min_coverage = {rt_rank() ? 0.5 : 0.25, 0}};
    RT_EQ(remap_set_masks(w.ctx, &unlike), rt_size() > 1 ? REMAP_BAD_ARGUMENT : REMAP_OK);
  }
  carried_close(&w);
}

/* A cube sheared along x by a tenth: its last layer sticks out the more, the higher it lies. */
static void the_least_covered_cells_come_first_on_every_rank(void)
{
  carried w;

  if (carried_open(&w, MPI_COMM_WORLD, 2, av_mesh(AV_HEXAHEDRA, 4, 0),
                   tm_hexahedra((int[]){4, 4, 4}, tm_affine, (double[]){1, 0.1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}), 3)) {
    remap_partial_cell cell[20];
    remap_stats        stats;
    int                num = 20;

    RT_EQ(remap_get_stats(w.ctx, &stats), REMAP_OK);
    RT_EQ(remap_partial_cells(w.ctx, REMAP_TARGET, &num, cell), REMAP_OK);
    RT_EQ(num, 16);
    RT_EQ(stats.cells_by_cover[REMAP_TARGET][REMAP_PARTIAL], 16);
    RT_NEAR(stats.volume_by_cover[REMAP_TARGET][REMAP_PARTIAL], 0.25, 1e-14);
    RT_NEAR(stats.volume_by_cover[REMAP_TARGET][REMAP_COVERED], 0.75, 1e-14);
    for (int k = 0; k < 16; k++) { /* rows in y by fours, the one that sticks out farthest first */
      RT_NEAR(cell[k].fraction, 1 - 0.4 * (3 - k / 4 + 0.5) * 0.25, 1e-14);
      RT_NEAR(cell[k].volume, 1.0 / 64, 1e-14);
      RT_NEAR(cell[k].centroid[1], (3 - k / 4 + 0.5) * 0.25, 1e-14);
    }
    num = 3;
    RT_EQ(remap_partial_cells(w.ctx, REMAP_TARGET, &num, cell + 17), REMAP_OK);
    RT_EQ(num, 3);
    for (int k = 0; k < 3; k++) RT_EQ(cell[17 + k].global_cell, cell[k].global_cell);
    num = 0;
    RT_EQ(remap_partial_cells(w.ctx, REMAP_TARGET, &num, NULL), REMAP_OK);
  }
  carried_close(&w);
}

/* ---- blending ---------------------------------------------------------------------------------------------------------- */

/* Where the target sticks out of the source on three sides. */
static tm_mesh *shifted(av_kind kind, int n)
{
  tm_mesh *mesh = av_mesh(kind, n, -0.02);

  tm_move(mesh, tm_affine, (double[]){1, 0, 0, 0.13, 0, 1, 0, -0.21, 0, 0, 1, 0.08});
  return mesh;
}

static void fields_that_a_polynomial_holds_are_blended_exactly(void)
{
  static const struct {
    av_field *field;
    int       order;
  } way[] = {{av_linear, 2}, {av_linear, 3}, {av_quadratic, 3}};

  for (int kind = 0; kind < AV_NUM_KINDS; kind++) {
    carried w;

    if (carried_open(&w, MPI_COMM_WORLD, 3, av_mesh(AV_HEXAHEDRA, 7, 0.03),
                     shifted((av_kind)kind, kind == AV_HEXAHEDRA ? 6 : 8), 3))
      for (size_t k = 0; k < sizeof way / sizeof *way; k++) {
        const remap_field_desc field = {.name = "u", .has_old = 1, .in = w.mean[0], .out = w.got[1]};
        remap_field_report     report;
        remap_transfer         how;

        remap_transfer_default(&how);
        how.order = way[k].order, how.limiter = REMAP_LIMITER_NONE;
        carried_evaluate(&w, way[k].field);
        for (int64_t c = 0; c < w.cells[1]; c++) w.got[1][c] = w.mean[1][c];
        RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &field, &report), REMAP_OK);
        for (int64_t c = 0; c < w.cells[1]; c++)
          if (!RT_NEAR(w.got[1][c], w.mean[1][c], 1e-12)) break;
        RT_CHECK(report.conservation_error <= 1e-14 && report.blended_cells > 50 && report.kept_cells > 0);
        RT_EQ(report.normalised_cells + report.nearest_cells + report.filled_cells, 0);
      }
    carried_close(&w);
  }
}

RT_MAIN(RT_CASE(fields_that_a_polynomial_holds_are_blended_exactly), RT_CASE(cells_covered_too_little_count_as_uncovered),
        RT_CASE(thresholds_beyond_one_or_unlike_on_two_ranks_are_refused),
        RT_CASE(the_least_covered_cells_come_first_on_every_rank))
