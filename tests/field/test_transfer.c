/* Fields across meshes of boxes: exactness, conservation, bounds, and the same bits on any number of ranks. */
#include "boxes.h"
#include "field/field.h"

#include <float.h>

static const boxes_shape unit = {{0, 0, 0}, {1, 1, 1}, 0};

typedef enum pair_kind { COVERED, GRADED, STICKS_OUT, COARSE_SOURCE, COARSE_TARGET, FAR, NUM_KINDS } pair_kind;

static tm_mesh *make(pair_kind kind, int side)
{
  const bool source = side == REMAP_SOURCE;

  switch (kind) {
    case GRADED: return source ? boxes_grid(7, 4, 6, (boxes_shape){{0, 0, 0}, {1, 1, 1}, .7}) : boxes_grid(4, 7, 3, unit);
    case STICKS_OUT:
      return source ? boxes_grid(5, 5, 5, unit) : boxes_grid(6, 6, 6, (boxes_shape){{.3, .3, .3}, {1.3, 1.5, 1.1}, 0});
    case COARSE_SOURCE:
      return source ? boxes_grid(2, 2, 2, (boxes_shape){{-1, -1, -1}, {2, 2, 2}, 0}) : boxes_grid(5, 5, 5, unit);
    case COARSE_TARGET:
      return source ? boxes_grid(5, 5, 5, unit) : boxes_grid(2, 1, 1, (boxes_shape){{-1, -1, -1}, {2, 2, 2}, 0});
    case FAR:
      return source ? boxes_grid(5, 5, 5, (boxes_shape){{1e6, 1e6, 1e6}, {1e6 + 1, 1e6 + 1, 1e6 + 1}, 0})
                    : boxes_grid(4, 6, 3, (boxes_shape){{1e6, 1e6, 1e6}, {1e6 + 1, 1e6 + 1, 1e6 + 1}, .5});
    default: return source ? boxes_grid(5, 6, 4, unit) : boxes_grid(6, 5, 7, unit);
  }
}

/* A field as a function of position (own frame) and global id. */
typedef double (*field_of)(const double x[3], rm_gid global);

static double constant(const double x[3], rm_gid global) { return (void)x, (void)global, 3.7; }
static double linear(const double x[3], rm_gid global) { return (void)global, 1.0 + 2.0 * x[0] - 3.0 * x[1] + 0.5 * x[2]; }
static double jump(const double x[3], rm_gid global) { return (void)global, x[0] + x[1] > 0.4 ? 1000.0 : 1.0; }
static double lot(const double x[3], rm_gid global)
{
  return (void)x, (double)(rm_hash_word((uint64_t)global) % 2000003) / 1000001.0 - 1.0;
}

static double *values(const boxes_world *w, int side, field_of f)
{
  const rm_mesh *mesh = w->mesh[side];
  double        *u    = rm_arena_alloc(w->arena, mesh->num_cells, sizeof *u);

  for (rm_lid c = 0; c < mesh->num_cells; c++) u[c] = f(mesh->cell_centroid[c], mesh->cell_global[c]);
  return u;
}

static remap_status transfer(const boxes_world *w, remap_direction direction, const remap_transfer *how, int num,
                             const remap_field_desc *fields, remap_field_report *reports)
{
  const rm_transfer_setup setup  = boxes_setup(w, direction);
  rm_arena               *arena  = rm_arena_new();
  rm_reason               reason = {-1, -1, ""};
  const remap_status      status = boxes_transfer(arena, &setup, how, num, fields, reports, &reason);

  rm_arena_drop(arena);
  return status;
}

static remap_transfer way(int order, remap_limiter limiter, remap_on_partial on_partial)
{
  return (remap_transfer){
      .order = order, .limiter = limiter, .on_uncovered = REMAP_UNCOVERED_NEAREST, .on_partial = on_partial, .fill_value = NAN};
}

/* A field without old values: the new ones, in the world's arena. */
static double *move_field(const boxes_world *w, remap_direction direction, remap_transfer how, const double *in,
                          remap_field_report *report)
{
  const int              receiving = direction == REMAP_FORWARD ? REMAP_TARGET : REMAP_SOURCE;
  double                *out       = rm_arena_alloc(w->arena, w->mesh[receiving]->num_cells, sizeof *out);
  const remap_field_desc field     = {.name = "u", .nature = REMAP_CONSERVED, .in = in, .out = out};

  RT_EQ(transfer(w, direction, &how, 1, &field, report), REMAP_OK);
  return out;
}

static void for_all_worlds(void (*look)(boxes_world *w, pair_kind kind, remap_direction direction))
{
  for (pair_kind kind = COVERED; kind < NUM_KINDS; kind++)
    for (int deal = TM_SLABS; deal <= TM_LAST; deal++) {
      boxes_world w;

      boxes_open(&w, MPI_COMM_WORLD, make(kind, 0), make(kind, 1), (tm_dealing)deal);
      look(&w, kind, REMAP_FORWARD);
      look(&w, kind, REMAP_BACKWARD);
      boxes_close(&w);
    }
}

static void look_at_constant(boxes_world *w, pair_kind kind, remap_direction direction)
{
  const double *in = values(w, (int)direction, constant);

  (void)kind;
  for (int order = 1; order <= 2; order++)
    for (int limiter = REMAP_LIMITER_NONE; limiter <= REMAP_LIMITER_AUTO; limiter++) {
      remap_field_report report;
      const double *out = move_field(w, direction, way(order, (remap_limiter)limiter, REMAP_PARTIAL_NORMALISE), in, &report);

      for (rm_lid c = 0; c < w->mesh[1 - direction]->num_cells; c++) RT_NEAR(out[c], 3.7, 1e-13 * 3.7);
      RT_NEAR(report.conservation_error, 0.0, 1e-14);
      RT_EQ(report.limited_cells, 0);
      RT_EQ(report.order, order);
    }
}
static void constant_fields_stay_constant(void) { for_all_worlds(look_at_constant); }

static void look_at_linear(boxes_world *w, pair_kind kind, remap_direction direction)
{
  const double *in   = values(w, (int)direction, linear);
  const double *want = values(w, 1 - (int)direction, linear);
  const double *out  = move_field(w, direction, way(2, REMAP_LIMITER_NONE, REMAP_PARTIAL_NORMALISE), in, NULL);

  if (kind == COARSE_TARGET && direction == REMAP_BACKWARD) return; /* two cells in a row span one direction only */
  for (rm_lid c = 0; c < w->mesh[1 - direction]->num_cells; c++)
    if (w->mapping->rows[1 - direction].cover[c] != REMAP_UNCOVERED) RT_NEAR(out[c], want[c], 4e-12);
}
static void linear_fields_are_exact_also_where_coverage_is_partial(void) { for_all_worlds(look_at_linear); }

static void look_at_conservation(boxes_world *w, pair_kind kind, remap_direction direction)
{
  static const field_of fields[] = {linear, jump, lot};

  (void)kind;
  for (size_t f = 0; f < sizeof fields / sizeof *fields; f++)
    for (int limiter = REMAP_LIMITER_NONE; limiter <= REMAP_LIMITER_BARTH_JESPERSEN; limiter++)
      for (int on_partial = REMAP_PARTIAL_NORMALISE; on_partial <= REMAP_PARTIAL_CONSERVE; on_partial++) {
        const double      *in = values(w, (int)direction, fields[f]);
        remap_field_report report;

        move_field(w, direction, way(2, (remap_limiter)limiter, (remap_on_partial)on_partial), in, &report);
        RT_NEAR(report.conservation_error, 0.0, 1e-14);
      }
}
static void content_is_conserved(void) { for_all_worlds(look_at_conservation); }

/* What the report says, summed here: the target contains the source, so all content arrives. */
static void integrals_are_those_of_the_fields(void)
{
  boxes_world        w;
  remap_field_report report;
  double             sum[2] = {0.0, 0.0};
  const double      *in, *out;

  boxes_open(&w, MPI_COMM_WORLD, boxes_grid(5, 5, 5, unit),
             boxes_grid(4, 4, 4, (boxes_shape){{-.5, -.5, -.5}, {1.5, 1.5, 1.5}, .3}), TM_RANDOM);
  in  = values(&w, 0, lot);
  out = move_field(&w, REMAP_FORWARD, way(2, REMAP_LIMITER_NONE, REMAP_PARTIAL_CONSERVE), in, &report);
  for (rm_lid c = 0; c < w.mesh[0]->num_cells; c++) sum[0] += in[c] * w.mesh[0]->cell_volume[c];
  for (rm_lid c = 0; c < w.mesh[1]->num_cells; c++)
    if (w.mapping->rows[1].cover[c] != REMAP_UNCOVERED) sum[1] += out[c] * w.mesh[1]->cell_volume[c];
  MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  RT_NEAR(report.source_integral, sum[0], 1e-14);
  RT_NEAR(report.target_integral, sum[1], 1e-14);
  RT_NEAR(sum[0], sum[1], 1e-14);
  boxes_close(&w);
}

static void extremes(const boxes_world *w, int side, const double *u, double *least, double *greatest)
{
  *least    = INFINITY;
  *greatest = -INFINITY;
  for (rm_lid c = 0; c < w->mesh[side]->num_cells; c++) {
    *least    = fmin(*least, u[c]);
    *greatest = fmax(*greatest, u[c]);
  }
  RT_EQ(rm_comm_min_f64(&w->comm, least, 1), REMAP_OK);
  RT_EQ(rm_comm_max_f64(&w->comm, greatest, 1), REMAP_OK);
}

static void look_at_bounds(boxes_world *w, pair_kind kind, remap_direction direction)
{
  static const field_of fields[] = {jump, lot};

  (void)kind;
  for (int f = 0; f < 2; f++) {
    const double      *in = values(w, (int)direction, fields[f]);
    double             low[2], high[2];
    remap_field_report report;
    const double      *out = move_field(w, direction, way(2, REMAP_LIMITER_AUTO, REMAP_PARTIAL_NORMALISE), in, &report);

    extremes(w, (int)direction, in, &low[0], &high[0]);
    extremes(w, 1 - (int)direction, out, &low[1], &high[1]);
    RT_CHECK(low[1] >= low[0] - 1e-13 * (fabs(low[0]) + fabs(high[0])) && high[1] <= high[0] * (1.0 + 1e-13));
    RT_NEAR(report.source_min, low[0], 0.0);
    RT_NEAR(report.source_max, high[0], 0.0);
    RT_NEAR(report.target_min, low[1], 0.0);
    RT_NEAR(report.target_max, high[1], 0.0);
  }
}
static void barth_jespersen_makes_no_new_extremes(void) { for_all_worlds(look_at_bounds); }

static void without_a_limiter_a_jump_overshoots_and_the_report_counts_who_was_limited(void)
{
  boxes_world        w;
  remap_field_report report;
  const double      *in;

  boxes_open(&w, MPI_COMM_WORLD, make(COVERED, 0), make(COVERED, 1), TM_SLABS);
  in = values(&w, 0, jump);
  move_field(&w, REMAP_FORWARD, way(2, REMAP_LIMITER_NONE, REMAP_PARTIAL_NORMALISE), in, &report);
  RT_CHECK(report.target_max > 1000.0 && report.target_min < 1.0 && report.limited_cells == 0);
  move_field(&w, REMAP_FORWARD, way(2, REMAP_LIMITER_BARTH_JESPERSEN, REMAP_PARTIAL_NORMALISE), in, &report);
  RT_CHECK(report.target_max <= 1000.0 * (1.0 + 1e-13) && report.target_min >= 1.0 - 1e-13 && report.limited_cells > 0);
  boxes_close(&w);
}

/* Values that any arithmetic would change: small ones, negative zero, the largest. */
static double odd(const double x[3], rm_gid global)
{
  static const double list[] = {-0.0, 0.0, 5e-324, -3e-310, 0.1, DBL_MAX, -DBL_MAX, 1e-200};

  (void)x;
  return list[rm_hash_word((uint64_t)global) % 8];
}
static void identical_meshes_copy_bit_by_bit(void)
{
  for (int deal = TM_SLABS; deal <= TM_LAST; deal++)
    for (int order = 1; order <= 2; order++) {
      boxes_world   w;
      const double *in, *out, *want;

      boxes_open(&w, MPI_COMM_WORLD, make(GRADED, 0), make(GRADED, 0), (tm_dealing)deal);
      in   = values(&w, 0, odd);
      want = values(&w, 1, odd);
      out  = move_field(&w, REMAP_FORWARD, way(order, REMAP_LIMITER_AUTO, REMAP_PARTIAL_BLEND), in, NULL);
      RT_CHECK(boxes_same_bits(out, want, (size_t)w.mesh[1]->num_cells * sizeof *out));
      boxes_close(&w);
    }
}

static void values_of_any_size_stay_finite(void)
{
  static const double sizes[] = {1e308, 1e-308, 1e-320, 1e200, 1.0};

  for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
    boxes_world        w;
    double            *in;
    const double      *out;
    remap_field_report report;

    boxes_open(&w, MPI_COMM_WORLD, make(COVERED, 0), make(COVERED, 1), TM_SLABS);
    in = values(&w, 0, lot);
    for (rm_lid c = 0; c < w.mesh[0]->num_cells; c++) in[c] *= sizes[s];
    out = move_field(&w, REMAP_FORWARD, way(2, REMAP_LIMITER_AUTO, REMAP_PARTIAL_BLEND), in, &report);
    for (rm_lid c = 0; c < w.mesh[1]->num_cells; c++) RT_CHECK(isfinite(out[c]) && fabs(out[c]) <= sizes[s]);
    RT_CHECK(isfinite(report.source_integral) && isfinite(report.target_integral));
    RT_NEAR(report.conservation_error, 0.0, sizes[s] < 1e-300 ? 1.0 : 1e-14); /* subnormal numbers have few digits */
    boxes_close(&w);
  }
}

/* All cells of one mesh are inverted: V and the cells' volumes are negative together. */
static void inverted_cells_receive_like_others(void)
{
  boxes_world   w;
  const double *in, *want, *out;

  boxes_open(&w, MPI_COMM_WORLD, make(COVERED, 0), boxes_grid(4, 5, 3, (boxes_shape){{1, 0, 0}, {0, 1, 1}, .2}), TM_SLABS);
  RT_CHECK(w.mesh[1]->num_inverted > 0);
  in   = values(&w, 0, linear);
  want = values(&w, 1, linear);
  out  = move_field(&w, REMAP_FORWARD, way(2, REMAP_LIMITER_NONE, REMAP_PARTIAL_BLEND), in, NULL);
  for (rm_lid c = 0; c < w.mesh[1]->num_cells; c++) RT_NEAR(out[c], want[c], 1e-12);
  boxes_close(&w);
}

/* Fields of several natures in one call, with and without old values, on the world's and on one rank. */
enum { NUM_FIELDS = 4 };
static void move_many(boxes_world *w, remap_direction direction, remap_field_desc *field, remap_field_report *report)
{
  static const field_of     given[NUM_FIELDS] = {lot, jump, lot, linear}, old = lot;
  static const remap_nature nature[NUM_FIELDS] = {REMAP_CONSERVED, REMAP_FLAG, REMAP_VOLUME_MEAN, REMAP_MASS_SPECIFIC};
  remap_transfer            how                = way(2, REMAP_LIMITER_AUTO, REMAP_PARTIAL_BLEND);

  how.on_uncovered = REMAP_UNCOVERED_KEEP;
  for (int f = 0; f < NUM_FIELDS; f++)
    field[f] = (remap_field_desc){.nature  = nature[f],
                                  .has_old = f > 1,
                                  .in      = values(w, (int)direction, given[f]),
                                  .out     = values(w, 1 - (int)direction, old)};
  RT_EQ(transfer(w, direction, &how, NUM_FIELDS, field, report), REMAP_OK);
}

static void look_at_bits(boxes_world *w, pair_kind kind, remap_direction direction)
{
  boxes_world        alone;
  remap_field_desc   field[NUM_FIELDS], other[NUM_FIELDS];
  remap_field_report report[NUM_FIELDS], other_report[NUM_FIELDS];
  const rm_mesh     *mesh = w->mesh[1 - direction];

  memset(report, 0, sizeof report);
  memset(other_report, 0, sizeof other_report);
  boxes_open(&alone, MPI_COMM_SELF, make(kind, 0), make(kind, 1), TM_SLABS);
  move_many(w, direction, field, report);
  move_many(&alone, direction, other, other_report);
  for (int f = 0; f < NUM_FIELDS; f++)
    for (rm_lid c = 0; c < mesh->num_cells; c++) {
      const rm_lid there = boxes_find(alone.mesh[1 - direction], mesh->cell_global[c]);

      RT_CHECK(boxes_same_bits(&field[f].out[c], &other[f].out[there], sizeof(double)));
    }
  RT_CHECK(boxes_same_bits(report, other_report, sizeof report));
  boxes_close(&alone);
}
static void fields_and_reports_are_those_of_one_rank_bit_by_bit(void) { for_all_worlds(look_at_bits); }

static void a_field_does_not_depend_on_the_others_in_its_call(void)
{
  boxes_world        w;
  remap_field_desc   together[NUM_FIELDS], single[NUM_FIELDS];
  remap_field_report report[NUM_FIELDS], alone;
  remap_transfer     how = way(2, REMAP_LIMITER_AUTO, REMAP_PARTIAL_BLEND);

  how.on_uncovered = REMAP_UNCOVERED_KEEP;
  memset(report, 0, sizeof report);
  memset(&alone, 0, sizeof alone);
  boxes_open(&w, MPI_COMM_WORLD, make(STICKS_OUT, 0), make(STICKS_OUT, 1), TM_RANDOM);
  move_many(&w, REMAP_FORWARD, together, report);
  for (int f = 0; f < NUM_FIELDS; f++) {
    single[f]     = together[f];
    single[f].out = values(&w, 1, lot);
    RT_EQ(transfer(&w, REMAP_FORWARD, &how, 1, &single[f], &alone), REMAP_OK);
    RT_CHECK(boxes_same_bits(single[f].out, together[f].out, (size_t)w.mesh[1]->num_cells * sizeof(double)));
    RT_CHECK(boxes_same_bits(&alone, &report[f], sizeof alone));
  }
  RT_EQ(transfer(&w, REMAP_FORWARD, &how, 0, NULL, NULL), REMAP_OK);
  boxes_close(&w);
}

/* A smooth field on finer and finer pairs: order 2 in the mean, with the limiter too. */
/* Numbers of fields that fill the vectors that fields share in part, and orders with and without limiters. */
static void a_field_has_the_same_bits_with_any_number_of_others(void)
{
  enum { MANY = 11 };
  static const field_of given[] = {lot, linear, jump, constant};
  boxes_world           w;
  remap_field_desc      field[MANY];
  double               *want[MANY];

  boxes_open(&w, MPI_COMM_WORLD, make(STICKS_OUT, 0), make(STICKS_OUT, 1), TM_RANDOM);
  for (int order = 1; order <= 2; order++)
    for (int limiter = REMAP_LIMITER_NONE; limiter <= REMAP_LIMITER_AUTO; limiter++) {
      const remap_transfer how  = way(order, (remap_limiter)limiter, REMAP_PARTIAL_NORMALISE);
      const size_t         size = (size_t)w.mesh[1]->num_cells * sizeof(double);

      for (int f = 0; f < MANY; f++) {
        double *in = values(&w, 0, given[f % 4]);

        for (rm_lid c = 0; c < w.mesh[0]->num_cells; c++) in[c] += 0.1 * f * w.mesh[0]->cell_centroid[c][f % 3];
        field[f] = (remap_field_desc){.in = in, .out = values(&w, 1, lot)};
        want[f]  = move_field(&w, REMAP_FORWARD, how, in, NULL);
      }
      for (int num = 2; num <= MANY; num++) {
        RT_EQ(transfer(&w, REMAP_FORWARD, &how, num, field, NULL), REMAP_OK);
        for (int f = 0; f < num; f++) RT_CHECK(boxes_same_bits(field[f].out, want[f], size));
      }
    }
  boxes_close(&w);
}

/* One cell that 8000 give to: added up plainly, what they give would lose digits. */
static void long_rows_keep_all_digits(void)
{
  static const field_of fields[] = {constant, lot};
  boxes_world           w;
  rm_arena             *arena = rm_arena_new();

  boxes_open(&w, MPI_COMM_WORLD, boxes_grid(20, 20, 20, (boxes_shape){{0, 0, 0}, {1, 1, 1}, .4}),
             boxes_grid(1, 1, 1, (boxes_shape){{-1, -1, -1}, {2, 2, 2}, 0}), TM_SLABS);
  for (int f = 0; f < 2; f++) {
    const rm_rows *rows = &w.mapping->rows[1];
    const double  *in   = values(&w, 0, fields[f]);
    const double  *out  = move_field(&w, REMAP_FORWARD, way(1, REMAP_LIMITER_NONE, REMAP_PARTIAL_CONSERVE), in, NULL);
    double        *got = rm_arena_alloc(arena, rows->num_givers, sizeof *got), magnitude = 0.0, content;
    double        *buffer = rm_arena_alloc(arena, rows->plan->send_offset[rows->plan->num_send], sizeof *buffer);
    rm_sum         sum;

    RT_EQ(rm_plan_run(&w.comm, rows->plan, sizeof *got, in, got, buffer), REMAP_OK);
    if (rows->num_cells == 0) continue;
    RT_EQ(rows->offset[1], 8000);
    rm_sum_clear(&sum);
    for (int64_t k = 0; k < rows->offset[1]; k++) {
      rm_sum_add_product(&sum, got[rows->giver[k]], rows->volume[k]);
      magnitude += fabs(got[rows->giver[k]] * rows->volume[k]);
    }
    content = rm_sum_value(&sum);
    RT_NEAR(out[0] * w.mesh[1]->cell_volume[0], content, 4e-16 * fabs(content) + 2e-16 * magnitude);
  }
  rm_arena_drop(arena);
  boxes_close(&w);
}

static double smooth(const double x[3], rm_gid global) { return (void)global, sin(3.0 * x[0]) * cos(2.0 * x[1]) + x[2] * x[2]; }
static double mean_error(int n, remap_limiter limiter)
{
  boxes_world   w;
  const double *in, *want, *out;
  double        sum = 0.0;

  boxes_open(&w, MPI_COMM_WORLD, boxes_grid(n, n, n, unit), boxes_grid(n + 1, n + 1, n + 1, unit), TM_SLABS);
  in   = values(&w, 0, smooth);
  want = values(&w, 1, smooth);
  out  = move_field(&w, REMAP_FORWARD, way(2, limiter, REMAP_PARTIAL_BLEND), in, NULL);
  for (rm_lid c = 0; c < w.mesh[1]->num_cells; c++) sum += fabs(out[c] - want[c]) * w.mesh[1]->cell_volume[c];
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  boxes_close(&w);
  return sum;
}
static void errors_of_smooth_fields_fall_with_the_square_of_the_cell_size(void)
{
  RT_CHECK(log2(mean_error(6, REMAP_LIMITER_NONE) / mean_error(12, REMAP_LIMITER_NONE)) > 1.9);
  RT_CHECK(log2(mean_error(6, REMAP_LIMITER_AUTO) / mean_error(12, REMAP_LIMITER_AUTO)) > 1.6);
}

RT_MAIN(RT_CASE(constant_fields_stay_constant), RT_CASE(linear_fields_are_exact_also_where_coverage_is_partial),
        RT_CASE(content_is_conserved), RT_CASE(integrals_are_those_of_the_fields),
        RT_CASE(barth_jespersen_makes_no_new_extremes),
        RT_CASE(without_a_limiter_a_jump_overshoots_and_the_report_counts_who_was_limited),
        RT_CASE(identical_meshes_copy_bit_by_bit), RT_CASE(values_of_any_size_stay_finite),
        RT_CASE(inverted_cells_receive_like_others), RT_CASE(fields_and_reports_are_those_of_one_rank_bit_by_bit),
        RT_CASE(a_field_does_not_depend_on_the_others_in_its_call),
        RT_CASE(a_field_has_the_same_bits_with_any_number_of_others), RT_CASE(long_rows_keep_all_digits),
        RT_CASE(errors_of_smooth_fields_fall_with_the_square_of_the_cell_size))
