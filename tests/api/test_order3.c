/* Order 3 through the public interface: quadratic fields are exact, content is kept, bits do not depend on ranks, and cells
 * with too few neighbours are told. */
#include "carried.h"

/* Two meshes that stay the caller's, and the means of one field on both. */
static bool set_up(carried *w, MPI_Comm comm, const tm_mesh *source, const tm_mesh *target, uint64_t seed, int max_order,
                   av_field *field)
{
  if (!carried_open(w, comm, max_order, tm_part(source, NULL, 0, 0), tm_part(target, NULL, 0, 0), seed)) return false;
  carried_evaluate(w, field);
  return true;
}

/* Carry the means of one side to the other. */
static bool carry(carried *w, remap_direction direction, remap_limiter limiter, remap_on_partial on_partial,
                  remap_field_report *report)
{
  const int              from = direction == REMAP_FORWARD ? 0 : 1;
  const remap_field_desc desc = {.name = "u", .nature = REMAP_CONSERVED, .in = w->mean[from], .out = w->got[1 - from]};
  remap_transfer         how;

  remap_transfer_default(&how);
  how.order                 = 3;
  how.limiter               = limiter;
  how.on_partial            = on_partial;
  const remap_status status = remap_field(w->ctx, direction, &how, 1, &desc, report);
  if (status != REMAP_OK) printf("# %s\n", remap_message(w->ctx));
  return rt_all(RT_EQ(status, REMAP_OK));
}

static double largest_error(const carried *w, int side)
{
  double error = 0;

  for (int64_t c = 0; c < w->cells[side]; c++) error = fmax(error, fabs(w->got[side][c] - w->mean[side][c]));
  return error;
}

static void quadratic_fields_are_exact_both_ways_on_every_kind_of_mesh(void)
{
  for (int s = 0; s < AV_NUM_KINDS; s++)
    for (int t = 0; t < AV_NUM_KINDS; t++) {
      tm_mesh           *source = av_mesh((av_kind)s, 5, 0.03), *target = av_mesh((av_kind)t, 6, -0.02);
      carried            w;
      remap_field_report report;

      if (set_up(&w, MPI_COMM_WORLD, source, target, 0, 3, av_quadratic))
        for (int way = 0; way < 2; way++) {
          if (!carry(&w, (remap_direction)way, REMAP_LIMITER_NONE, REMAP_PARTIAL_NORMALISE, &report)) continue;
          if (!RT_NEAR(largest_error(&w, 1 - way), 0, 2e-13))
            printf("# %s, %s, way %d\n", av_kind_name[s], av_kind_name[t], way);
          RT_CHECK(report.conservation_error <= 1e-14);
          RT_EQ(report.order, 3);
          RT_EQ(report.order_reduced_cells, 0);
        }
      carried_close(&w);
      tm_free(source), tm_free(target);
    }
}

static void partly_covered_cells_take_the_whole_polynomial(void)
{
  const double m[12] = {1, 0, 0, 0.23, 0, 1, 0, -0.17, 0, 0, 1, 0.3};

  for (int kind = 0; kind < AV_NUM_KINDS; kind++) {
    tm_mesh           *source = av_mesh((av_kind)kind, 6, 0.03), *target = av_mesh(AV_HEXAHEDRA, 5, -0.02);
    carried            w;
    remap_field_report report;

    tm_move(target, tm_affine, m);
    if (set_up(&w, MPI_COMM_WORLD, source, target, 0, 3, av_quadratic))
      for (int way = 0; way < 2; way++) {
        remap_cover *cover = tm_alloc_(w.cells[1 - way], sizeof *cover);
        double       error = 0;

        RT_EQ(remap_coverage(w.ctx, (remap_side)(1 - way), NULL, cover), REMAP_OK);
        if (carry(&w, (remap_direction)way, REMAP_LIMITER_NONE, REMAP_PARTIAL_NORMALISE, &report)) {
          for (int64_t c = 0; c < w.cells[1 - way]; c++)
            if (cover[c] != REMAP_UNCOVERED) error = fmax(error, fabs(w.got[1 - way][c] - w.mean[1 - way][c]));
          if (!RT_NEAR(error, 0, 2e-12)) printf("# %s, way %d\n", av_kind_name[kind], way);
          RT_CHECK(report.conservation_error <= 1e-14);
        }
        free(cover);
      }
    carried_close(&w);
    tm_free(source), tm_free(target);
  }
}

/* Moved, a quadratic field is of another size. In turned pancakes six numbers of a symmetric matrix hold a part that is 10^8
 * times smaller than they are. */
static void far_stretched_and_turned_meshes_are_no_worse(void)
{
  static const double size[] = {1e-3, 1, 1, 1}, shift[] = {0, 1e4, 0, 0}, thin[] = {1, 1, 1e-4, 1e-4}, angle[] = {0, 0, 0, 0.4};
  static const double bar[] = {1e-12, 1e-12, 1e-12, 1e-8};

  for (int k = 0; k < 4; k++) {
    const double       c = cos(angle[k]), s = sin(angle[k]), a = size[k], b = size[k] * thin[k];
    const double       m[12]  = {c * a, 0, -s * b, shift[k], 0, a, 0, -shift[k], s * a, 0, c * b, shift[k]};
    tm_mesh           *source = av_mesh(AV_HEXAHEDRA, 6, 0.03), *target = av_mesh(AV_HEXAHEDRA, 5, -0.02);
    carried            w;
    remap_field_report report;

    tm_move(source, tm_affine, m), tm_move(target, tm_affine, m);
    if (set_up(&w, MPI_COMM_WORLD, source, target, 0, 3, av_quadratic) &&
        carry(&w, REMAP_FORWARD, REMAP_LIMITER_NONE, REMAP_PARTIAL_NORMALISE, &report)) {
      const double largest = fmax(fabs(report.source_min), fabs(report.source_max));

      if (!RT_CHECK(largest_error(&w, 1) <= bar[k] * largest))
        printf("# case %d: %g of %g\n", k, largest_error(&w, 1), largest);
      if (!RT_CHECK(report.conservation_error <= 1e-13)) printf("# case %d: conservation %g\n", k, report.conservation_error);
      if (!RT_EQ(report.order_reduced_cells, 0)) printf("# case %d\n", k);
    }
    carried_close(&w);
    tm_free(source), tm_free(target);
  }
}

static double in_the_plane(const double x[3])
{
  const double s = x[0] * cos(0.4) + x[2] * sin(0.4);

  return 1 + s * s - 2 * s * x[1] + x[1] * x[1];
}

/* Across one layer of cells nothing is known: slope and curvature are 0 there, and complete along it, however it is turned. */
static void one_layer_of_cells_is_quadratic_in_its_plane(void)
{
  const double c = cos(0.4), s = sin(0.4), m[12] = {c, 0, -0.1 * s, 0, 0, 1, 0, 0, s, 0, 0.1 * c, 0};
  tm_mesh     *source = tm_hexahedra((int[]){6, 5, 1}, tm_affine, m), *target = tm_hexahedra((int[]){5, 7, 1}, tm_affine, m);
  carried      w;
  remap_field_report report;

  if (set_up(&w, MPI_COMM_WORLD, source, target, 0, 3, in_the_plane) &&
      carry(&w, REMAP_FORWARD, REMAP_LIMITER_NONE, REMAP_PARTIAL_NORMALISE, &report)) {
    RT_NEAR(largest_error(&w, 1), 0, 1e-13);
    RT_EQ(report.order_reduced_cells, 0);
  }
  carried_close(&w);
  tm_free(source), tm_free(target);
}

static void cells_with_too_few_neighbours_are_of_order_2_and_told(void)
{
  tm_mesh           *source = tm_hexahedra((int[]){2, 2, 2}, NULL, NULL), *target = tm_hexahedra((int[]){3, 3, 3}, NULL, NULL);
  carried            w;
  remap_field_report report;

  if (set_up(&w, MPI_COMM_WORLD, source, target, 0, 3, av_linear) &&
      carry(&w, REMAP_FORWARD, REMAP_LIMITER_NONE, REMAP_PARTIAL_NORMALISE, &report)) {
    RT_NEAR(largest_error(&w, 1), 0, 1e-14);
    RT_EQ(report.order_reduced_cells, 8);
  }
  carried_close(&w);
  tm_free(source), tm_free(target);
}

static void limited_polynomials_keep_within_the_sources_values(void)
{
  for (int kind = 0; kind < AV_NUM_KINDS; kind++) {
    tm_mesh           *source = av_mesh((av_kind)kind, 8, 0.03), *target = av_mesh(AV_HEXAHEDRA, 11, -0.02);
    carried            w;
    remap_field_report report;

    if (set_up(&w, MPI_COMM_WORLD, source, target, 0, 3, av_sphere) &&
        carry(&w, REMAP_FORWARD, REMAP_LIMITER_BARTH_JESPERSEN, REMAP_PARTIAL_NORMALISE, &report)) {
      RT_CHECK(report.target_min >= report.source_min - 1e-14 && report.target_max <= report.source_max + 1e-14);
      RT_CHECK(report.limited_cells > 0);
    }
    carried_close(&w);
    tm_free(source), tm_free(target);
  }
}

static void bits_depend_neither_on_ranks_nor_partition_nor_numbering(void)
{
  for (int kind = 0; kind < AV_NUM_KINDS; kind++)
    for (uint64_t seed = 1; seed <= 2; seed++) {
      tm_mesh           *source = av_mesh((av_kind)kind, 5, 0.03), *target = av_mesh(AV_HEXAHEDRA, 4, -0.02);
      double            *want = tm_alloc_(target->view.num_cells, sizeof *want);
      carried            alone, together;
      remap_field_report report[2];
      const bool         ready[2] = {set_up(&alone, MPI_COMM_SELF, source, target, 0, 3, av_trig),
                                     set_up(&together, MPI_COMM_WORLD, source, target, seed, 3, av_trig)};

      /* means are sums over faces in the order of numbers: take those of the whole mesh */
      for (int64_t c = 0; c < together.cells[0] && ready[0]; c++)
        together.mean[0][c] = alone.mean[0][together.mine[0]->view.cell_global[c]];
      if (ready[0] && ready[1] &&
          carry(&alone, REMAP_FORWARD, REMAP_LIMITER_BARTH_JESPERSEN, REMAP_PARTIAL_NORMALISE, &report[0]) &&
          carry(&together, REMAP_FORWARD, REMAP_LIMITER_BARTH_JESPERSEN, REMAP_PARTIAL_NORMALISE, &report[1])) {
        for (int64_t c = 0; c < alone.cells[1]; c++) want[alone.mine[1]->view.cell_global[c]] = alone.got[1][c];
        for (int64_t c = 0; c < together.cells[1]; c++)
          if (!RT_NEAR(together.got[1][c], want[together.mine[1]->view.cell_global[c]], 0.0)) break;
        RT_EQ(report[1].limited_cells, report[0].limited_cells);
        RT_EQ(report[1].order_reduced_cells, report[0].order_reduced_cells);
      }
      carried_close(&alone), carried_close(&together);
      free(want);
      tm_free(source), tm_free(target);
    }
}

static void second_moments_are_shown_if_asked_for(void)
{
  tm_mesh *source = tm_hexahedra((int[]){2, 2, 2}, NULL, NULL), *target = tm_hexahedra((int[]){4, 4, 4}, NULL, NULL);

  for (int max_order = 2; max_order <= 3; max_order++) {
    carried          w;
    remap_pairs_view view;

    if (set_up(&w, MPI_COMM_WORLD, source, target, 0, max_order, av_linear)) {
      RT_EQ(remap_pairs(w.ctx, REMAP_FORWARD, &view), REMAP_OK);
      RT_CHECK((view.second != NULL) == (max_order == 3));
      for (int64_t k = 0; k < view.row_offset[view.num_rows] && view.second; k++) /* an eighth of a cell, from its corner on */
        for (int i = 0; i < 6; i++) RT_NEAR(fabs(view.second[6 * k + i]), i < 3 ? 0x1p-10 / 3 : 0x1p-12, 1e-18);
    }
    carried_close(&w);
  }
  tm_free(source), tm_free(target);
}

static void order_3_needs_a_context_for_it(void)
{
  tm_mesh       *mesh = tm_hexahedra((int[]){2, 2, 2}, NULL, NULL);
  carried        w;
  remap_transfer how;

  remap_transfer_default(&how);
  how.order = 3;
  if (set_up(&w, MPI_COMM_WORLD, mesh, mesh, 0, 2, av_linear))
    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 0, NULL, NULL), REMAP_BAD_ARGUMENT);
  carried_close(&w);
  tm_free(mesh);
}

RT_MAIN(RT_CASE(quadratic_fields_are_exact_both_ways_on_every_kind_of_mesh),
        RT_CASE(partly_covered_cells_take_the_whole_polynomial), RT_CASE(far_stretched_and_turned_meshes_are_no_worse),
        RT_CASE(one_layer_of_cells_is_quadratic_in_its_plane), RT_CASE(cells_with_too_few_neighbours_are_of_order_2_and_told),
        RT_CASE(limited_polynomials_keep_within_the_sources_values),
        RT_CASE(bits_depend_neither_on_ranks_nor_partition_nor_numbering), RT_CASE(second_moments_are_shown_if_asked_for),
        RT_CASE(order_3_needs_a_context_for_it))
