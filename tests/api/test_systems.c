/* Systems of fields: states stay such that can be, what is uniform stays so, amounts are conserved, primitive variables come
 * back. With REMAP_LONG_TESTS the meshes are finer. */
#include "carried.h"

enum { NUM = 5 };
static const remap_role conserved[NUM] = {REMAP_ROLE_DENSITY, REMAP_ROLE_MOMENTUM_X, REMAP_ROLE_MOMENTUM_Y,
                                          REMAP_ROLE_MOMENTUM_Z, REMAP_ROLE_ENERGY};
static const remap_role primitive[NUM] = {REMAP_ROLE_DENSITY, REMAP_ROLE_VELOCITY_X, REMAP_ROLE_VELOCITY_Y,
                                          REMAP_ROLE_VELOCITY_Z, REMAP_ROLE_PRESSURE};
static const double     gamma_of_air   = 1.4;

/* A gas on both meshes: NUM values per cell, one after the other. */
typedef struct gas {
  carried w;
  double *in[NUM], *out[NUM], *centroid[2];
  int     has_old;
} gas;

/* Density, velocity and pressure at a point. */
typedef void gas_state(const double x[3], double inside, double state[NUM]);

static void shear(const double x[3], double inside, double state[NUM])
{
  state[0] = inside;
  state[1] = tanh((x[0] - .5) / .08);
  state[2] = state[3] = 0;
  state[4]            = 1e-2;
}
static void uniform_motion(const double x[3], double inside, double state[NUM])
{
  (void)x;
  state[0] = inside;
  state[1] = 0.7, state[2] = -0.3, state[3] = 1.1;
  state[4] = 2.5;
}
/* Anything: a state by a hash of the place. */
static void wild(const double x[3], double inside, double state[NUM])
{
  uint64_t seed = (uint64_t)(1e6 * x[0]) ^ (uint64_t)(1e6 * x[1]) << 20 ^ (uint64_t)(1e6 * x[2]) << 40;

  (void)inside;
  state[0] = pow(10, 6e-3 * (double)tm_random(&seed, 1001) - 3);
  for (int d = 1; d < 4; d++) state[d] = 2e-3 * (double)tm_random(&seed, 1001) - 1;
  state[4] = pow(10, 6e-3 * (double)tm_random(&seed, 1001) - 4);
}
static void smooth_flow(const double x[3], double inside, double state[NUM])
{
  (void)inside;
  state[0] = 1 + 0.3 * sin(2 * x[0] + x[1]);
  state[1] = 0.5 + 0.2 * cos(x[1] - x[2]), state[2] = 0.3 * sin(x[0] + x[2]), state[3] = 0.1 * x[0] * x[1];
  state[4] = 1 + 0.2 * x[2];
}

static void to_conserved(const double state[NUM], double out[NUM])
{
  out[0] = state[0];
  out[4] = state[4] / (gamma_of_air - 1);
  for (int d = 1; d < 4; d++) {
    out[d] = state[0] * state[d];
    out[4] += 0.5 * state[0] * state[d] * state[d];
  }
}
static void to_primitive(const double amount[NUM], double state[NUM])
{
  double kinetic = 0;

  state[0] = amount[0];
  for (int d = 1; d < 4; d++) {
    state[d] = amount[d] / amount[0];
    kinetic += 0.5 * amount[d] * state[d];
  }
  state[4] = (gamma_of_air - 1) * (amount[4] - kinetic);
}

/* The mean density of a ball of `ratio` in 1: the share of the ball is a mean over the cell. */
static bool gas_open(gas *g, MPI_Comm comm, tm_mesh *source, tm_mesh *target, uint64_t seed, gas_state *state, double ratio,
                     bool is_primitive)
{
  const bool ready = carried_open(&g->w, comm, 3, source, target, seed);

  g->has_old = 0;
  carried_evaluate(&g->w, av_sphere);
  for (int side = 0; side < 2; side++) {
    g->centroid[side] = tm_alloc_(3 * g->w.cells[side], sizeof(double));
    if (ready) remap_cells(g->w.ctx, (remap_side)side, NULL, g->centroid[side]);
  }
  for (int k = 0; k < NUM; k++) {
    g->in[k]  = tm_alloc_(g->w.cells[0], sizeof(double));
    g->out[k] = tm_alloc_(g->w.cells[1], sizeof(double));
  }
  for (int64_t c = 0; c < g->w.cells[0]; c++) {
    double x[NUM], q[NUM];

    state(g->centroid[0] + 3 * c, 1 + (ratio - 1) * g->w.mean[0][c], x);
    to_conserved(x, q);
    for (int k = 0; k < NUM; k++) g->in[k][c] = is_primitive ? x[k] : q[k];
  }
  return ready;
}

static void gas_close(gas *g)
{
  carried_close(&g->w);
  for (int side = 0; side < 2; side++) free(g->centroid[side]);
  for (int k = 0; k < NUM; k++) free(g->in[k]), free(g->out[k]);
}

static remap_status gas_move(gas *g, const remap_role role[NUM], int order, remap_limiter limiter,
                             remap_field_report report[NUM])
{
  static const char *const name[NUM] = {"Density", "X", "Y", "Z", "Energy"};
  remap_field_desc         field[NUM];
  remap_transfer           how;

  remap_transfer_default(&how);
  how.order = order, how.limiter = limiter, how.gamma = gamma_of_air;
  for (int k = 0; k < NUM; k++)
    field[k] = (remap_field_desc){
        .name = name[k], .has_old = g->has_old, .system = 1, .role = role[k], .in = g->in[k], .out = g->out[k]};
  return remap_field(g->w.ctx, REMAP_FORWARD, &how, NUM, field, report);
}

static tm_mesh *shifted_cubes(void)
{
  return tm_hexahedra((int[]){5, 5, 5}, tm_affine, (double[]){1, 0, 0, 0.15, 0, 1, 0, 0, 0, 0, 1, -0.1});
}

/* ---- states ------------------------------------------------------------------------------------------------------------ */

static void check_states(gas *g, int order, remap_limiter limiter)
{
  remap_field_report report[NUM];
  double             extreme[2] = {-1e30, -1e30}; /* of -u, u, in the source */
  int64_t            bad        = 0;

  if (!rt_all(RT_EQ(gas_move(g, conserved, order, limiter, report), REMAP_OK))) return;
  for (int64_t c = 0; c < g->w.cells[0]; c++) {
    const double u = g->in[1][c] / g->in[0][c];

    extreme[0] = fmax(extreme[0], -u), extreme[1] = fmax(extreme[1], u);
  }
  MPI_Allreduce(MPI_IN_PLACE, extreme, 2, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
  for (int64_t c = 0; c < g->w.cells[1]; c++) {
    double amount[NUM], x[NUM];

    for (int k = 0; k < NUM; k++) amount[k] = g->out[k][c];
    to_primitive(amount, x);
    bad += !(x[0] > 0 && x[4] > 0 && x[1] >= -extreme[0] - 1e-12 && x[1] <= extreme[1] + 1e-12);
  }
  if (!RT_EQ(bad, 0)) printf("# order %d, limiter %d\n", order, (int)limiter);
  for (int k = 0; k < NUM; k++) RT_CHECK(report[k].conservation_error <= 1e-14);
}

static void a_jump_of_density_a_thousandfold_leaves_states_that_can_be(void)
{
  for (int kind = AV_HEXAHEDRA; kind <= AV_DUAL; kind++) {
    gas g;

    if (gas_open(&g, MPI_COMM_WORLD, av_mesh(AV_HEXAHEDRA, 12, 0.02), av_mesh((av_kind)kind, kind ? 16 : 13, -0.02), 3, shear,
                 1000, false))
      for (int order = 1; order <= 3; order++)
        for (int limiter = REMAP_LIMITER_NONE; limiter <= (order > 1 ? REMAP_LIMITER_CAAS : REMAP_LIMITER_NONE); limiter++)
          check_states(&g, order, (remap_limiter)limiter);
    gas_close(&g);
  }
}

static void whatever_moves_leaves_states_that_can_be(void)
{
  for (int kind = AV_HEXAHEDRA; kind < AV_NUM_KINDS; kind++) {
    gas g;

    if (gas_open(&g, MPI_COMM_WORLD, av_mesh((av_kind)kind, kind == AV_MIXED ? 6 : 8, 0.03), av_mesh(AV_TETRAHEDRA, 10, -0.02),
                 3, wild, 1, false))
      for (int order = 2; order <= 3; order++)
        for (int limiter = REMAP_LIMITER_NONE; limiter <= REMAP_LIMITER_AUTO; limiter++)
          check_states(&g, order, (remap_limiter)limiter);
    gas_close(&g);
  }
}

static void a_mild_jump_touches_few_cells(void)
{
  gas g;

  if (gas_open(&g, MPI_COMM_WORLD, av_mesh(AV_HEXAHEDRA, 24, 0), av_mesh(AV_TETRAHEDRA, 24, 0), 0, shear, 3, false))
    for (int order = 2; order <= 3; order++) {
      remap_field_report report[NUM];

      RT_EQ(gas_move(&g, conserved, order, REMAP_LIMITER_AUTO, report), REMAP_OK);
      RT_CHECK(report[0].scaled_cells <= 24 * 24 * 24 * 3 / 100);
    }
  gas_close(&g);
}

static void what_moves_uniformly_goes_on_to(void)
{
  for (int p = 0; p < 2; p++)
    for (int partial = 0; partial < 3; partial++) { /* covered, normalised, blended */
      gas      g;
      tm_mesh *target = av_mesh(AV_TETRAHEDRA, 14, -0.02);

      if (partial) tm_move(target, tm_affine, (double[]){1, 0, 0, 0.21, 0, 1, 0, 0, 0, 0, 1, 0});
      if (gas_open(&g, MPI_COMM_WORLD, av_mesh(AV_DUAL, 14, 0.03), target, 5, uniform_motion, 100, p))
        for (int order = 1; order <= 3; order++) {
          remap_field_report report[NUM];

          g.has_old = partial == 2;
          for (int64_t c = 0; c < g.w.cells[1]; c++) {
            double x[NUM], q[NUM];

            uniform_motion(g.centroid[1] + 3 * c, c % 2 ? 10 : 1, x);
            to_conserved(x, q);
            for (int k = 0; k < NUM; k++) g.out[k][c] = p ? x[k] : q[k];
          }
          if (!rt_all(RT_EQ(gas_move(&g, p ? primitive : conserved, order, REMAP_LIMITER_AUTO, report), REMAP_OK))) continue;
          for (int64_t c = 0; c < g.w.cells[1]; c++) {
            double got[NUM], x[NUM], want[NUM];

            for (int k = 0; k < NUM; k++) got[k] = x[k] = g.out[k][c];
            if (!p) to_primitive(got, x);
            uniform_motion(g.centroid[1] + 3 * c, 1, want);
            for (int k = 1; k < 4; k++) RT_NEAR(x[k], want[k], 1e-13);
            RT_NEAR(x[4], want[4], 1e-11); /* what rounding leaves of kinetic energies up to a hundred times as large */
          }
          for (int k = 0; k < NUM; k++) RT_CHECK(report[k].conservation_error <= 1e-14);
        }
      gas_close(&g);
    }
}

static void smooth_flow_is_moved_to_the_second_order(void)
{
  double error[2][NUM] = {{0}};

  for (int finer = 0; finer < 2; finer++) {
    gas       g;
    const int n = finer ? 16 : 8;

    if (gas_open(&g, MPI_COMM_WORLD, av_mesh(AV_HEXAHEDRA, n, 0.02), av_mesh(AV_HEXAHEDRA, n + 1, -0.02), 0, smooth_flow, 1,
                 true)) {
      RT_EQ(gas_move(&g, primitive, 2, REMAP_LIMITER_AUTO, NULL), REMAP_OK);
      for (int64_t c = 0; c < g.w.cells[1]; c++) {
        double want[NUM];

        smooth_flow(g.centroid[1] + 3 * c, 1, want);
        for (int k = 0; k < NUM; k++) error[finer][k] += fabs(g.out[k][c] - want[k]) * g.w.volume[1][c];
      }
    }
    gas_close(&g);
    MPI_Allreduce(MPI_IN_PLACE, error[finer], NUM, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  }
  for (int k = 0; k < NUM; k++) RT_CHECK(error[0][k] / error[1][k] > 3.6);
}

/* What a context has room for after a system does not show in what it moves next. */
static void a_field_alone_is_the_same_after_a_system(void)
{
  gas g;

  if (gas_open(&g, MPI_COMM_WORLD, av_mesh(AV_HEXAHEDRA, 6, 0.02), shifted_cubes(), 3, shear, 10, true)) {
    const remap_field_desc alone = {.name = "T", .has_old = 1, .in = g.in[1], .out = g.out[1]};
    double                *want  = tm_alloc_(g.w.cells[1], sizeof *want);

    for (int k = 0; k < 2; k++) {
      for (int64_t c = 0; c < g.w.cells[1]; c++) g.out[1][c] = g.centroid[1][3 * c];
      RT_EQ(remap_field(g.w.ctx, REMAP_FORWARD, NULL, 1, &alone, NULL), REMAP_OK);
      for (int64_t c = 0; c < g.w.cells[1]; c++) {
        if (k == 0)
          want[c] = g.out[1][c];
        else if (!RT_NEAR(g.out[1][c], want[c], 0.0))
          break;
      }
      g.has_old = 1;
      for (int64_t c = 0; c < g.w.cells[1]; c++) g.out[0][c] = 1;
      if (k == 0) RT_EQ(gas_move(&g, primitive, 2, REMAP_LIMITER_AUTO, NULL), REMAP_OK);
    }
    free(want);
  }
  gas_close(&g);
}

/* ---- copies, bits ------------------------------------------------------------------------------------------------------ */

static void the_same_mesh_copies_primitive_variables(void)
{
  gas g;

  if (gas_open(&g, MPI_COMM_WORLD, av_mesh(AV_DUAL, 10, 0.03), av_mesh(AV_DUAL, 10, 0.03), 7, shear, 1000, true)) {
    remap_field_report report[NUM];

    RT_EQ(gas_move(&g, primitive, 3, REMAP_LIMITER_AUTO, report), REMAP_OK);
    for (int64_t c = 0; c < g.w.cells[1]; c++) {
      int64_t from = 0;

      while (from < g.w.cells[0] && g.w.mine[0]->global[from] != g.w.mine[1]->global[c]) from++;
      for (int k = 0; k < NUM && from < g.w.cells[0]; k++) RT_CHECK(memcmp(&g.out[k][c], &g.in[k][from], sizeof(double)) == 0);
    }
    for (int k = 0; k < NUM; k++) RT_CHECK(report[k].conservation_error <= 1e-14);
  }
  gas_close(&g);
}

static void bits_of_systems_depend_neither_on_ranks_nor_numbering(void)
{
  gas        alone, together;
  const bool ready[2] = {gas_open(&alone, MPI_COMM_SELF, av_mesh(AV_HEXAHEDRA, 10, 0.02), av_mesh(AV_TETRAHEDRA, 12, -0.02), 0,
                                  shear, 1000, false),
                         gas_open(&together, MPI_COMM_WORLD, av_mesh(AV_HEXAHEDRA, 10, 0.02), av_mesh(AV_TETRAHEDRA, 12, -0.02),
                                  3, shear, 1000, false)};
  double    *want     = tm_alloc_(alone.w.cells[1], sizeof *want);

  for (int order = 2; order <= 3 && ready[0] && ready[1]; order++) {
    remap_field_report report[2][NUM];

    for (int k = 0; k < NUM; k++) /* means are sums in the order of numbers: the others take them from here */
      for (int64_t c = 0; c < together.w.cells[0]; c++)
        together.in[k][c] = alone.in[k][together.w.mine[0]->view.cell_global[c]];
    RT_EQ(gas_move(&alone, conserved, order, order == 2 ? REMAP_LIMITER_NONE : REMAP_LIMITER_AUTO, report[0]), REMAP_OK);
    RT_EQ(gas_move(&together, conserved, order, order == 2 ? REMAP_LIMITER_NONE : REMAP_LIMITER_AUTO, report[1]), REMAP_OK);
    RT_CHECK(report[0][0].scaled_cells > 0);
    RT_EQ(report[1][0].scaled_cells, report[0][0].scaled_cells);
    for (int k = 0; k < NUM; k++) {
      for (int64_t c = 0; c < alone.w.cells[1]; c++) want[alone.w.mine[1]->view.cell_global[c]] = alone.out[k][c];
      for (int64_t c = 0; c < together.w.cells[1]; c++)
        if (!RT_NEAR(together.out[k][c], want[together.w.mine[1]->view.cell_global[c]], 0.0)) break;
    }
  }
  free(want);
  gas_close(&alone), gas_close(&together);
}

/* ---- fractions, vectors, bad input -------------------------------------------------------------------------------------- */

static double share(const double x[3], int k)
{
  const double a = 0.5 + 0.5 * tanh((x[0] - 0.4) / 0.03), b = x[1] > 0.5 ? 1 : 0.2;

  return k == 0 ? a * b : k == 1 ? a * (1 - b) : 1 - a;
}

static void mass_fractions_stay_within_bounds_and_add_up(void)
{
  for (int per_mass = 0; per_mass < 2; per_mass++) {
    gas     g;
    double *in[3], *out[3];

    const bool ready =
        gas_open(&g, MPI_COMM_WORLD, av_mesh(AV_HEXAHEDRA, 12, 0.02), av_mesh(AV_TETRAHEDRA, 16, -0.02), 3, shear, 50, false);
    for (int k = 0; k < 3; k++) {
      in[k] = tm_alloc_(g.w.cells[0], sizeof(double)), out[k] = tm_alloc_(g.w.cells[1], sizeof(double));
      for (int64_t c = 0; c < g.w.cells[0]; c++) in[k][c] = share(g.centroid[0] + 3 * c, k) * (per_mass ? 1 : g.in[0][c]);
    }
    for (int order = 2; order <= 3 && ready; order++)
      for (int limiter = REMAP_LIMITER_NONE; limiter <= REMAP_LIMITER_AUTO; limiter++) {
        remap_field_desc field[4] = {{.name = "rho", .system = 4, .role = REMAP_ROLE_DENSITY, .in = g.in[0], .out = g.out[0]}};
        remap_field_report report[4];
        remap_transfer     how;

        remap_transfer_default(&how);
        how.order = order, how.limiter = (remap_limiter)limiter;
        for (int k = 0; k < 3; k++)
          field[1 + k] = (remap_field_desc){.name   = "Y",
                                            .nature = per_mass ? REMAP_MASS_SPECIFIC : REMAP_CONSERVED,
                                            .system = 4,
                                            .role   = REMAP_ROLE_MASS_FRACTION,
                                            .in     = in[k],
                                            .out    = out[k]};
        if (!rt_all(RT_EQ(remap_field(g.w.ctx, REMAP_FORWARD, &how, 4, field, report), REMAP_OK))) continue;
        for (int64_t c = 0; c < g.w.cells[1]; c++) {
          double sum = 0;

          for (int k = 0; k < 3; k++) {
            const double y = out[k][c] / (per_mass ? 1 : g.out[0][c]);

            RT_CHECK(y >= -1e-13 && y <= 1 + 1e-13);
            sum += y;
          }
          RT_NEAR(sum, 1.0, 1e-13);
        }
        for (int k = 0; k < 4; k++) RT_CHECK(report[k].conservation_error <= 1e-14);
      }
    for (int k = 0; k < 3; k++) free(in[k]), free(out[k]);
    gas_close(&g);
  }
}

/* A quarter turn about z takes (x, y, z) to (-y, x, z); backward it is undone. */
static void vectors_are_turned(void)
{
  static const double turn[9] = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  gas                 g;

  if (gas_open(&g, MPI_COMM_WORLD, av_mesh(AV_HEXAHEDRA, 6, 0.02), av_mesh(AV_HEXAHEDRA, 5, -0.02), 3, uniform_motion, 1,
               true)) {
    remap_field_desc field[7];
    remap_transfer   how;
    double          *v[2][3];

    for (int k = 0; k < 3; k++) {
      v[0][k] = tm_alloc_(g.w.cells[0], sizeof(double)), v[1][k] = tm_alloc_(g.w.cells[1], sizeof(double));
      for (int64_t c = 0; c < g.w.cells[0]; c++) v[0][k][c] = k + 1;
    }
    remap_transfer_default(&how);
    how.rotation = turn, how.gamma = gamma_of_air;
    for (int k = 0; k < 4; k++)
      field[k] = (remap_field_desc){.system = 9, .role = primitive[k], .in = g.in[k], .out = g.out[k]};
    for (int k = 0; k < 3; k++) field[4 + k] = (remap_field_desc){.vector = 2, .in = v[0][k], .out = v[1][k]};
    RT_EQ(remap_field(g.w.ctx, REMAP_FORWARD, &how, 7, field, NULL), REMAP_OK);
    for (int64_t c = 0; c < g.w.cells[1]; c++) {
      RT_NEAR(g.out[1][c], 0.3, 1e-13);
      RT_NEAR(g.out[2][c], 0.7, 1e-13);
      RT_NEAR(g.out[3][c], 1.1, 1e-13);
      RT_NEAR(v[1][0][c], -2.0, 1e-13);
      RT_NEAR(v[1][1][c], 1.0, 1e-13);
      RT_NEAR(v[1][2][c], 3.0, 1e-13);
    }
    for (int k = 0; k < 3; k++) field[4 + k] = (remap_field_desc){.vector = 2, .in = v[1][k], .out = v[0][k]};
    RT_EQ(remap_field(g.w.ctx, REMAP_BACKWARD, &how, 3, field + 4, NULL), REMAP_OK);
    for (int64_t c = 0; c < g.w.cells[0]; c++)
      for (int k = 0; k < 3; k++) RT_NEAR(v[0][k][c], k + 1.0, 1e-13);
    for (int k = 0; k < 3; k++) free(v[0][k]), free(v[1][k]);
  }
  gas_close(&g);
}

static void systems_that_make_no_sense_are_refused(void)
{
  static const struct {
    remap_field_desc field[2];
    double           gamma;
    const char      *word; /* of the message */
  } bad[] = {{{{.system = 1, .role = REMAP_ROLE_MOMENTUM_X}}, 0, "no density"},
             {{{.system = 1, .role = REMAP_ROLE_DENSITY}, {.system = 1, .role = REMAP_ROLE_DENSITY}}, 0, "another density"},
             {{{.system = 1, .role = REMAP_ROLE_DENSITY}, {.system = 1, .role = REMAP_ROLE_PRESSURE}}, 0, "gamma"},
             {{{.system = 1, .role = REMAP_ROLE_DENSITY}, {.system = 1, .role = REMAP_ROLE_TEMPERATURE}}, 1.4, "gas constant"},
             {{{.system = 1, .role = REMAP_ROLE_DENSITY}, {.system = 1, .nature = REMAP_VOLUME_MEAN}}, 0, "mass-specific"},
             {{{.system = 1, .role = REMAP_ROLE_DENSITY, .has_old = 1}, {.system = 1}}, 0, "old values"},
             {{{.vector = 3}, {.vector = 3}}, 0, "three components"}};
  gas g;

  if (gas_open(&g, MPI_COMM_WORLD, av_mesh(AV_HEXAHEDRA, 3, 0), av_mesh(AV_HEXAHEDRA, 4, 0), 0, uniform_motion, 1, false)) {
    remap_field_report report[NUM];

    for (size_t b = 0; b < sizeof bad / sizeof *bad; b++) {
      remap_field_desc field[2];
      remap_transfer   how;

      remap_transfer_default(&how);
      how.gamma = bad[b].gamma;
      for (int k = 0; k < 2; k++) {
        field[k]      = bad[b].field[k];
        field[k].name = "rho", field[k].in = g.in[k], field[k].out = g.out[k];
      }
      RT_EQ(remap_field(g.w.ctx, REMAP_FORWARD, &how, b == 0 ? 1 : 2, field, NULL), REMAP_BAD_ARGUMENT);
      if (!RT_CHECK(strstr(remap_message(g.w.ctx), bad[b].word) != NULL)) printf("# %s\n", remap_message(g.w.ctx));
    }
    for (int64_t c = 0; c < g.w.cells[0]; c++)
      if (g.w.mine[0]->global[c] == 13) g.in[0][c] = 0;
    RT_EQ(gas_move(&g, conserved, 2, REMAP_LIMITER_AUTO, report), REMAP_BAD_VALUE);
    RT_CHECK(strstr(remap_message(g.w.ctx), "cell 13") && strstr(remap_message(g.w.ctx), "Density"));
  }
  gas_close(&g);
}

static void second_moments_must_have_been_asked_for(void)
{
  for (int k = 0; k < 2; k++) {
    tm_mesh               *mesh = tm_hexahedra((int[]){1, 1, 1}, NULL, NULL);
    double                 in = 1, out = 0;
    const remap_field_desc field = {.name = "rho", .system = 1, .role = REMAP_ROLE_DENSITY, .in = &in, .out = &out};
    remap_context         *ctx   = NULL;
    remap_options          options;
    remap_transfer         how;

    remap_options_default(&options);
    remap_transfer_default(&how);
    options.systems = k;
    RT_EQ(remap_create(MPI_COMM_SELF, &options, &ctx), REMAP_OK);
    for (int side = 0; side < 2; side++) remap_set_mesh(ctx, (remap_side)side, &mesh->view);
    RT_EQ(remap_build(ctx), REMAP_OK);
    RT_EQ(remap_field(ctx, REMAP_FORWARD, &how, 1, &field, NULL), k ? REMAP_OK : REMAP_BAD_ARGUMENT);
    how.order = 1;
    RT_EQ(remap_field(ctx, REMAP_FORWARD, &how, 1, &field, NULL), REMAP_OK);
    RT_NEAR(out, 1.0, 0.0);
    remap_destroy(&ctx);
    tm_free(mesh);
  }
}

static void values_that_are_no_numbers_pass_if_they_may(void)
{
  carried w;

  if (carried_open(&w, MPI_COMM_WORLD, 2, av_mesh(AV_HEXAHEDRA, 5, 0), av_mesh(AV_HEXAHEDRA, 10, 0), 3)) {
    const remap_field_desc field = {.name = "u", .in = w.mean[0], .out = w.got[1]};
    remap_field_report     report;
    remap_transfer         how;
    int64_t                num[2] = {0, 0};

    carried_evaluate(&w, av_linear);
    for (int64_t c = 0; c < w.cells[0]; c++)
      if (w.mine[0]->global[c] % 50 == 0) w.mean[0][c] = w.mine[0]->global[c] ? NAN : INFINITY;
    remap_transfer_default(&how);
    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &field, &report), REMAP_BAD_VALUE);
    for (int limiter = REMAP_LIMITER_NONE; limiter <= REMAP_LIMITER_CAAS; limiter++) {
      how.allow_nan = 1, how.limiter = (remap_limiter)limiter;
      num[0] = num[1] = 0;
      RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &field, &report), REMAP_OK);
      RT_CHECK(isnan(report.conservation_error) && isfinite(report.source_max));
      for (int64_t c = 0; c < w.cells[1]; c++) num[0] += !isfinite(w.got[1][c]);
      MPI_Allreduce(num, num + 1, 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
      RT_EQ(num[1], 3 * 8);
    }
  }
  carried_close(&w);
}

RT_MAIN(RT_CASE(a_jump_of_density_a_thousandfold_leaves_states_that_can_be), RT_CASE(whatever_moves_leaves_states_that_can_be),
        RT_CASE(a_mild_jump_touches_few_cells), RT_CASE(what_moves_uniformly_goes_on_to),
        RT_CASE(smooth_flow_is_moved_to_the_second_order), RT_CASE(a_field_alone_is_the_same_after_a_system),
        RT_CASE(the_same_mesh_copies_primitive_variables), RT_CASE(bits_of_systems_depend_neither_on_ranks_nor_numbering),
        RT_CASE(mass_fractions_stay_within_bounds_and_add_up), RT_CASE(vectors_are_turned),
        RT_CASE(systems_that_make_no_sense_are_refused), RT_CASE(second_moments_must_have_been_asked_for),
        RT_CASE(values_that_are_no_numbers_pass_if_they_may))
