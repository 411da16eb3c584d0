/* bench_systems -- what becomes of a gas with a jump of density: as a system, and field by field. One rank; a ball of some
 * density in density 1, velocity tanh((x - 1/2) / 0.08), uniform pressure, from hexahedra to tetrahedra. A table; one line per
 * case.
 *
 *   bench_systems */
#include <time.h>
#include "averages.h"

enum { NUM = 5 };
static const double gamma_of_air = 1.4;

typedef struct gas_case {
  int           n;     /* hexahedra n^3                        */
  double        ratio; /* density of the ball                  */
  double        pressure;
  int           order;
  remap_limiter limiter;
  bool          is_system;
} gas_case;

/* Range of a quantity. */
typedef struct range {
  double least, greatest;
} range;

static void widen(range *r, double x)
{
  r->least    = fmin(r->least, x);
  r->greatest = fmax(r->greatest, x);
}

static double velocity(const double *x) { return tanh((x[0] - 0.5) / 0.08); }

static remap_status move(remap_context *ctx, const gas_case *g, double *const in[NUM], double *const out[NUM],
                         remap_field_report report[NUM])
{
  static const remap_role role[NUM] = {REMAP_ROLE_DENSITY, REMAP_ROLE_MOMENTUM_X, REMAP_ROLE_MOMENTUM_Y, REMAP_ROLE_MOMENTUM_Z,
                                       REMAP_ROLE_ENERGY};
  remap_field_desc        field[NUM];
  remap_transfer          how;

  remap_transfer_default(&how);
  how.order = g->order, how.limiter = g->limiter;
  for (int k = 0; k < NUM; k++)
    field[k] = (remap_field_desc){.system = g->is_system, .role = role[k], .in = in[k], .out = out[k]};
  return remap_field(ctx, REMAP_FORWARD, &how, NUM, field, report);
}

static void print_case(const gas_case *g, int64_t cells[2], double *const in[NUM], double *const out[NUM],
                       const remap_field_report report[NUM], double seconds)
{
  static const char *const limiter[] = {"none", "barth-jespersen", "auto", "caas"};
  range                    from = {1e300, -1e300}, u = from, p = from, rho = from;
  double                   worst = 0;

  for (int64_t c = 0; c < cells[0]; c++) widen(&from, in[1][c] / in[0][c]);
  for (int64_t c = 0; c < cells[1]; c++) {
    const double m2 = out[1][c] * out[1][c] + out[2][c] * out[2][c] + out[3][c] * out[3][c];

    widen(&u, out[1][c] / out[0][c]);
    widen(&p, (gamma_of_air - 1) * (out[4][c] - 0.5 * m2 / out[0][c]));
    widen(&rho, out[0][c]);
  }
  for (int k = 0; k < NUM; k++) worst = fmax(worst, report[k].conservation_error);
  printf("| %d^3 | %g | %g | %s | %d %s | %.1e %.1e | %.3g %.3g | %.3g %.4g | %.1f %% | %.1f %% | %.0e | %.2f |\n", g->n,
         g->ratio, g->pressure, g->is_system ? "system" : "field by field", g->order, limiter[g->limiter], u.least - from.least,
         u.greatest - from.greatest, p.least, p.greatest, rho.least, rho.greatest,
         100.0 * (double)report[0].limited_cells / (double)cells[0], 100.0 * (double)report[0].scaled_cells / (double)cells[0],
         worst, 1e6 * seconds / (double)(NUM * cells[1]));
}

/* All cases on meshes of one size. */
static int run(int n, int num, const gas_case *list)
{
  tm_mesh  *mesh[2]  = {av_mesh(AV_HEXAHEDRA, n, 0), av_mesh(AV_TETRAHEDRA, n == 12 ? 20 : 32, 0)};
  int64_t   cells[2] = {mesh[0]->view.num_cells, mesh[1]->view.num_cells};
  double   *in[NUM], *out[NUM], *share = tm_alloc_(cells[0], sizeof(double)), *volume = tm_alloc_(cells[0], sizeof(double));
  double   *x        = tm_alloc_(3 * cells[0], sizeof(double));
  av_field *ball     = av_sphere;
  remap_context *ctx = NULL;
  remap_options  options;
  remap_status   status;

  remap_options_default(&options);
  options.max_order = 3;
  status            = remap_create(MPI_COMM_SELF, &options, &ctx);
  for (int side = 0; side < 2 && status == REMAP_OK; side++) status = remap_set_mesh(ctx, (remap_side)side, &mesh[side]->view);
  if (status == REMAP_OK) status = remap_build(ctx);
  if (status == REMAP_OK) status = remap_cells(ctx, REMAP_SOURCE, NULL, x);
  av_means(mesh[0], options.faces, 1, &ball, volume, &share);
  for (int k = 0; k < NUM; k++) in[k] = tm_alloc_(cells[0], sizeof(double)), out[k] = tm_alloc_(cells[1], sizeof(double));
  for (int w = 0; w < num && status == REMAP_OK; w++) {
    remap_field_report report[NUM];

    if (list[w].n != n) continue;
    for (int64_t c = 0; c < cells[0]; c++) {
      const double u = velocity(x + 3 * c), rho = 1 + (list[w].ratio - 1) * share[c];

      in[0][c] = rho, in[1][c] = rho * u;
      in[4][c] = list[w].pressure / (gamma_of_air - 1) + 0.5 * rho * u * u;
    }
    status              = move(ctx, &list[w], in, out, report); /* prepares */
    const clock_t begin = clock();
    if (status == REMAP_OK) status = move(ctx, &list[w], in, out, report);
    if (status == REMAP_OK) print_case(&list[w], cells, in, out, report, (double)(clock() - begin) / CLOCKS_PER_SEC);
  }
  if (status != REMAP_OK) fprintf(stderr, "%s: %s\n", remap_status_text(status), remap_message(ctx));
  for (int k = 0; k < NUM; k++) free(in[k]), free(out[k]);
  free(share), free(volume), free(x);
  for (int side = 0; side < 2; side++) tm_free(mesh[side]);
  remap_destroy(&ctx);
  return status != REMAP_OK;
}

int main(int argc, char **argv)
{
  static const gas_case list[] = {{12, 1000, 1e-2, 2, REMAP_LIMITER_BARTH_JESPERSEN, false},
                                  {12, 1000, 1e-2, 1, REMAP_LIMITER_NONE, true},
                                  {12, 1000, 1e-2, 2, REMAP_LIMITER_NONE, true},
                                  {12, 1000, 1e-2, 2, REMAP_LIMITER_BARTH_JESPERSEN, true},
                                  {12, 1000, 1e-2, 2, REMAP_LIMITER_AUTO, true},
                                  {12, 1000, 1e-2, 3, REMAP_LIMITER_AUTO, true},
                                  {24, 3, 1e-2, 2, REMAP_LIMITER_AUTO, true},
                                  {24, 3, 1, 2, REMAP_LIMITER_AUTO, false},
                                  {24, 3, 1, 2, REMAP_LIMITER_NONE, true},
                                  {24, 3, 1, 2, REMAP_LIMITER_AUTO, true},
                                  {24, 3, 1, 3, REMAP_LIMITER_AUTO, true}};
  const int             num    = (int)(sizeof list / sizeof *list);
  int                   failed;

  MPI_Init(&argc, &argv);
  printf("| source | density | pressure | moved | order, limiter | velocity beyond bounds | pressure | density | limited | "
         "scaled | "
         "conservation | us per cell and field |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  failed = run(12, num, list) || run(24, num, list);
  MPI_Finalize();
  return failed;
}
