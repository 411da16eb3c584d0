/* Volumes as a solver has them: amounts are kept by its measure, means do not see it, and what differs is told. */
#include "carried.h"

/* By how much a solver's volume differs, by the cell's global id. */
static double differs(int side, int64_t global) { return 1 + (side ? 0.03 : 0.02) * sin(1.7 * (double)global); }

typedef struct world {
  remap_context *ctx;
  tm_mesh       *mine[2];
  int64_t        cells[2];
  double        *volume[2], *u[2];
} world;

static bool open_world(world *w, bool is_by_blocks)
{
  tm_mesh      *whole[2] = {av_mesh(AV_HEXAHEDRA, 6, 0.03), av_mesh(AV_TETRAHEDRA, 8, -0.02)};
  remap_options options;

  memset(w, 0, sizeof *w);
  remap_options_default(&options);
  options.systems = 1;
  if (!rt_all(RT_EQ(remap_create(MPI_COMM_WORLD, &options, &w->ctx), REMAP_OK))) return false;
  for (int side = 0; side < 2; side++) {
    int       *deal = tm_deal(whole[side], rt_size(), TM_RANDOM, 5);
    remap_mesh block[2];

    w->mine[side]   = tm_part(whole[side], deal, rt_rank(), 5);
    w->cells[side]  = w->mine[side]->view.num_cells;
    w->volume[side] = tm_alloc_(w->cells[side], sizeof(double));
    w->u[side]      = tm_alloc_(w->cells[side], sizeof(double));
    double   *mean  = tm_alloc_(w->cells[side], sizeof(double));
    av_field *field = av_constant;
    av_means(w->mine[side], REMAP_FACES_CENTRE, 1, &field, w->volume[side], &mean);
    for (int64_t c = 0; c < w->cells[side]; c++) w->volume[side][c] *= differs(side, w->mine[side]->global[c]);
    block[0] = w->mine[side]->view, block[1] = (remap_mesh){0};
    block[0].cell_volume = w->volume[side];
    RT_EQ(remap_set_blocks(w->ctx, (remap_side)side, is_by_blocks ? 2 : 1, block), REMAP_OK);
    free(mean), free(deal);
    tm_free(whole[side]);
  }
  return rt_all(RT_EQ(remap_build(w->ctx), REMAP_OK));
}

static void close_world(world *w)
{
  remap_destroy(&w->ctx);
  for (int side = 0; side < 2; side++) {
    tm_free(w->mine[side]);
    free(w->volume[side]), free(w->u[side]);
  }
}

static double integral(const world *w, int side, const double *u)
{
  double sum = 0;

  for (int64_t c = 0; c < w->cells[side]; c++) sum += u[c] * w->volume[side][c];
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  return sum;
}

static void amounts_are_kept_by_the_solvers_measure(void)
{
  for (int blocks = 0; blocks < 2; blocks++) {
    world w;

    if (open_world(&w, blocks))
      for (int limiter = REMAP_LIMITER_NONE; limiter <= REMAP_LIMITER_CAAS; limiter++)
        for (int in_system = 0; in_system < 2; in_system++) {
          const remap_field_desc field = {
              .name = "rho", .system = in_system, .role = REMAP_ROLE_DENSITY, .in = w.u[0], .out = w.u[1]};
          remap_field_report report;
          remap_transfer     how;

          remap_transfer_default(&how);
          how.limiter = (remap_limiter)limiter;
          for (int64_t c = 0; c < w.cells[0]; c++) w.u[0][c] = 2 + sin((double)w.mine[0]->global[c] / 7);
          RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &field, &report), REMAP_OK);
          RT_NEAR(integral(&w, 1, w.u[1]), integral(&w, 0, w.u[0]), 1e-13);
          RT_NEAR(report.target_integral, integral(&w, 1, w.u[1]), 1e-13);
          RT_NEAR(report.source_integral, integral(&w, 0, w.u[0]), 1e-13);
          RT_CHECK(report.conservation_error <= 1e-14);
        }
    close_world(&w);
  }
}

static void means_and_velocities_stay_uniform(void)
{
  world w;

  if (open_world(&w, false)) {
    double                *in = tm_alloc_(w.cells[0], sizeof *in), *out = tm_alloc_(w.cells[1], sizeof *out);
    double                *density[2] = {tm_alloc_(w.cells[0], sizeof(double)), tm_alloc_(w.cells[1], sizeof(double))};
    const remap_field_desc field[3]   = {
          {.name = "T", .nature = REMAP_VOLUME_MEAN, .in = in, .out = out},
          {.name = "rho", .system = 2, .role = REMAP_ROLE_DENSITY, .in = density[0], .out = density[1]},
          {.name = "u", .system = 2, .role = REMAP_ROLE_VELOCITY_X, .in = in, .out = w.u[1]}};
    remap_transfer how;

    remap_transfer_default(&how);
    for (int64_t c = 0; c < w.cells[0]; c++) in[c] = -3.25, density[0][c] = w.mine[0]->global[c] % 2 ? 7 : 1;
    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 3, field, NULL), REMAP_OK);
    for (int64_t c = 0; c < w.cells[1]; c++) {
      RT_NEAR(out[c], -3.25, 1e-13);
      RT_NEAR(w.u[1][c], -3.25, 1e-13);
    }
    free(in), free(out), free(density[0]), free(density[1]);
  }
  close_world(&w);
}

static void statistics_tell_how_volumes_differ(void)
{
  world w;

  if (open_world(&w, true)) {
    remap_stats stats;
    double      one[2] = {0, 0};

    RT_EQ(remap_get_stats(w.ctx, &stats), REMAP_OK);
    for (int side = 0; side < 2; side++) {
      const int64_t num   = stats.cells[side];
      double        worst = 0;
      int64_t       cell  = -1;

      for (int64_t g = 0; g < num; g++)
        if (fabs(differs(side, g) - 1) > worst) worst = fabs(differs(side, g) - 1), cell = g;
      for (int64_t c = 0; c < w.cells[side]; c++) one[side] += w.volume[side][c];
      MPI_Allreduce(MPI_IN_PLACE, &one[side], 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
      RT_NEAR(stats.volume[side], 1.0, 1e-14);
      RT_NEAR(stats.solver_volume[side], one[side], 1e-13);
      RT_NEAR(stats.max_volume_difference[side], worst, 1e-12);
      RT_EQ(stats.worst_volume_cell[side], cell);
    }
  }
  close_world(&w);
}

/* One mesh on both sides, numbered and dealt otherwise, with volumes on those of its sides that has_volume says, which agree or
 * not; returned: a context with an overlay. */
static remap_context *twice_the_same(tm_mesh *mesh[2], double *volume[2], const bool has_volume[2], bool agrees)
{
  tm_mesh       *whole = av_mesh(AV_HEXAHEDRA, 5, 0.03);
  remap_context *ctx   = NULL;
  remap_options  options;

  remap_options_default(&options);
  options.systems = 1;
  RT_EQ(remap_create(MPI_COMM_WORLD, &options, &ctx), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    int *deal = tm_deal(whole, rt_size(), TM_RANDOM, 5 + (uint64_t)side);

    mesh[side]   = tm_part(whole, deal, rt_rank(), 5 + (uint64_t)side);
    volume[side] = tm_alloc_(mesh[side]->view.num_cells, sizeof(double));
    for (int64_t c = 0; c < mesh[side]->view.num_cells; c++)
      volume[side][c] = differs(agrees ? 0 : side, mesh[side]->global[c]) / 125;
    if (has_volume[side]) mesh[side]->view.cell_volume = volume[side];
    RT_EQ(remap_set_mesh(ctx, (remap_side)side, &mesh[side]->view), REMAP_OK);
    free(deal);
  }
  tm_free(whole);
  RT_EQ(remap_build(ctx), REMAP_OK);
  return ctx;
}

/* Means are copied whatever the volumes; amounts only where both agree, else their sum is kept. */
static void check_copies(remap_context *ctx, tm_mesh *const mesh[2], bool agrees, remap_limiter limiter, int in_system)
{
  const int64_t          num[2] = {mesh[0]->view.num_cells, mesh[1]->view.num_cells};
  double                *in = tm_alloc_(num[0], sizeof *in), *mean = tm_alloc_(num[1], sizeof *mean);
  double                *density  = tm_alloc_(num[1], sizeof *density);
  const remap_field_desc field[2] = {
      {.name = "T", .nature = REMAP_VOLUME_MEAN, .in = in, .out = mean},
      {.name = "rho", .system = in_system, .role = REMAP_ROLE_DENSITY, .in = in, .out = density}};
  remap_field_report report[2];
  remap_transfer     how;
  int64_t            changed = 0;

  remap_transfer_default(&how);
  how.limiter = limiter;
  for (int64_t c = 0; c < num[0]; c++) in[c] = 2 + sin((double)mesh[0]->global[c] / 7);
  RT_EQ(remap_field(ctx, REMAP_FORWARD, &how, 2, field, report), REMAP_OK);
  RT_CHECK(report[1].conservation_error <= 1e-14);
  for (int64_t c = 0; c < num[1]; c++) {
    const double expected = 2 + sin((double)mesh[1]->global[c] / 7);

    RT_CHECK(!(mean[c] < expected || mean[c] > expected));
    changed += density[c] < expected || density[c] > expected;
  }
  MPI_Allreduce(MPI_IN_PLACE, &changed, 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  RT_CHECK(agrees ? changed == 0 : changed > 100);
  free(in), free(mean), free(density);
}

static void amounts_of_same_cells_are_copied_only_if_their_volumes_agree(void)
{
  static const bool has_volume[4][2] = {{true, false}, {false, true}, {true, true}, {true, true}};

  for (int k = 0; k < 4; k++) {
    tm_mesh       *mesh[2];
    double        *volume[2];
    remap_context *ctx = twice_the_same(mesh, volume, has_volume[k], k == 3);

    for (int limiter = REMAP_LIMITER_NONE; limiter <= REMAP_LIMITER_CAAS; limiter++)
      for (int in_system = 0; in_system < 2; in_system++) check_copies(ctx, mesh, k == 3, (remap_limiter)limiter, in_system);
    remap_destroy(&ctx);
    for (int side = 0; side < 2; side++) tm_free(mesh[side]), free(volume[side]);
  }
}

static void volumes_that_are_none_are_refused(void)
{
  static const double bad[] = {0, -1, NAN, 1e300};

  for (int k = 0; k < 4; k++) {
    tm_mesh       *mesh      = tm_hexahedra((int[]){2, 1, 1}, NULL, NULL);
    double         volume[2] = {0.5, bad[k]};
    remap_context *ctx       = NULL;

    RT_EQ(remap_create(MPI_COMM_SELF, NULL, &ctx), REMAP_OK);
    RT_EQ(remap_set_mesh(ctx, REMAP_SOURCE, &mesh->view), REMAP_OK);
    mesh->view.cell_volume = volume;
    RT_EQ(remap_set_mesh(ctx, REMAP_TARGET, &mesh->view), REMAP_OK);
    RT_EQ(remap_build(ctx), REMAP_BAD_MESH);
    RT_CHECK(strstr(remap_message(ctx), "cell 1") && strstr(remap_message(ctx), "cell_volume"));
    remap_destroy(&ctx);
    tm_free(mesh);
  }
}

RT_MAIN(RT_CASE(amounts_are_kept_by_the_solvers_measure), RT_CASE(means_and_velocities_stay_uniform),
        RT_CASE(statistics_tell_how_volumes_differ),
        RT_CASE(amounts_of_same_cells_are_copied_only_if_their_volumes_agree), RT_CASE(volumes_that_are_none_are_refused))
