/* bench_convergence -- how the error of a transfer falls with the size of cells, for each order and limiter. One rank; means
 * over cells of analytic fields are carried from a mesh of N^3 to one of (N + d)^3 that is warped otherwise, and compared with
 * the means over the target cells. One line per field, order and limiter: norms at N and 2 N and the orders between them.
 *
 *   bench_convergence hexahedra|tetrahedra|dual|mixed N [d] */
#include <time.h>
#include "averages.h"

enum { NUM_WAYS = 9 };
static const struct {
  int           order;
  remap_limiter limiter;
  const char   *name;
} ways[NUM_WAYS] = {{1, REMAP_LIMITER_NONE, "none"},
                    {2, REMAP_LIMITER_NONE, "none"},
                    {2, REMAP_LIMITER_BARTH_JESPERSEN, "barth-jespersen"},
                    {2, REMAP_LIMITER_CAAS, "caas"},
                    {2, REMAP_LIMITER_AUTO, "auto"},
                    {3, REMAP_LIMITER_NONE, "none"},
                    {3, REMAP_LIMITER_BARTH_JESPERSEN, "barth-jespersen"},
                    {3, REMAP_LIMITER_CAAS, "caas"},
                    {3, REMAP_LIMITER_AUTO, "auto"}};

typedef struct outcome {
  av_error error;
  double   least, greatest; /* beyond those of the source */
  int64_t  limited, reduced;
} outcome;

static int fail(remap_context *ctx, remap_status status)
{
  fprintf(stderr, "%s: %s\n", remap_status_text(status), remap_message(ctx));
  return 1;
}

static int run(av_kind kind, int n, int extra, outcome out[AV_NUM][NUM_WAYS])
{
  tm_mesh       *mesh[2] = {av_mesh(kind, n, 0.03), av_mesh(kind, n + extra, -0.02)};
  av_field      *field[AV_NUM];
  double        *mean[2][AV_NUM], *volume[2], *got = tm_alloc_(mesh[1]->view.num_cells, sizeof *got);
  remap_context *ctx = NULL;
  remap_options  options;
  remap_status   status;

  remap_options_default(&options);
  options.max_order = 3;
  if ((status = remap_create(MPI_COMM_SELF, &options, &ctx)) != REMAP_OK) return fail(ctx, status);
  for (int q = 0; q < AV_NUM; q++) field[q] = av_fields[q].of;
  for (int side = 0; side < 2; side++) {
    const int64_t num = mesh[side]->view.num_cells;

    volume[side] = tm_alloc_(num, sizeof(double));
    for (int q = 0; q < AV_NUM; q++) mean[side][q] = tm_alloc_(num, sizeof(double));
    av_means(mesh[side], options.faces, AV_NUM, field, volume[side], mean[side]);
    remap_set_mesh(ctx, (remap_side)side, &mesh[side]->view);
  }
  if ((status = remap_build(ctx)) != REMAP_OK) return fail(ctx, status);
  for (int q = 0; q < AV_NUM; q++)
    for (int w = 0; w < NUM_WAYS; w++) {
      const remap_field_desc desc = {.name = av_fields[q].name, .nature = REMAP_CONSERVED, .in = mean[0][q], .out = got};
      remap_field_report     report;
      remap_transfer         how;

      remap_transfer_default(&how);
      how.order   = ways[w].order;
      how.limiter = ways[w].limiter;
      if ((status = remap_field(ctx, REMAP_FORWARD, &how, 1, &desc, &report)) != REMAP_OK) return fail(ctx, status);
      out[q][w] =
          (outcome){av_difference(mesh[1]->view.num_cells, volume[1], got, mean[1][q]), report.target_min - report.source_min,
                    report.target_max - report.source_max, report.limited_cells, report.order_reduced_cells};
    }
  for (int side = 0; side < 2; side++) {
    for (int q = 0; q < AV_NUM; q++) free(mean[side][q]);
    free(volume[side]);
    tm_free(mesh[side]);
  }
  free(got);
  remap_destroy(&ctx);
  return 0;
}

int main(int argc, char **argv)
{
  static outcome coarse[AV_NUM][NUM_WAYS], fine[AV_NUM][NUM_WAYS];
  const int      n = argc > 2 ? atoi(argv[2]) : 0, extra = argc > 3 ? atoi(argv[3]) : 1;
  int            kind = 0, failed;

  while (kind < AV_NUM_KINDS && argc > 1 && strcmp(argv[1], av_kind_name[kind])) kind++;
  if (n < 1 || kind == AV_NUM_KINDS)
    return fprintf(stderr, "usage: bench_convergence hexahedra|tetrahedra|dual|mixed N [d]\n"), 2;
  MPI_Init(&argc, &argv);
  failed = run((av_kind)kind, n, extra, coarse) || run((av_kind)kind, 2 * n, extra, fine);
  printf("| %s %d -> %d | order, limiter | L1 | L2 | Linf | orders | beyond bounds | limited | reduced |\n", av_kind_name[kind],
         n, 2 * n);
  for (int q = 0; q < AV_NUM && !failed; q++)
    for (int w = 0; w < NUM_WAYS; w++) {
      const outcome *a = &coarse[q][w], *b = &fine[q][w];

      printf("| %s | %d %s | %.3g | %.3g | %.3g | %.2f %.2f %.2f | %.2g %.2g | %lld | %lld |\n", av_fields[q].name,
             ways[w].order, ways[w].name, b->error.l1, b->error.l2, b->error.linf, log2(a->error.l1 / b->error.l1),
             log2(a->error.l2 / b->error.l2), log2(a->error.linf / b->error.linf), b->least, b->greatest, (long long)b->limited,
             (long long)b->reduced);
    }
  MPI_Finalize();
  return failed;
}
