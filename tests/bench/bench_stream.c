/* bench_stream -- what one field costs on an existing mapping, and what one more costs in the same call, beside a plain stream
 * over the bytes that a transfer reads at least: index, V and M (order 1: no M) of every pair, the giving values and the
 * receiving ones. One JSON line: medians of wall clock in milliseconds, and the ratio of one more field to the stream.
 *
 *   mpirun -n P bench_stream CASE N ORDER [REPEATS]      cases: bench.h; ORDER 1 or 2, without a limiter */
#include <remap/remap.h>
#include "bench.h"

enum { MANY = 8 };

/* Read `count` numbers; the sum keeps the compiler from leaving them out. */
static double stream(const double *x, int64_t count)
{
  double sum[8] = {0};

  for (int64_t k = 0; k + 8 <= count; k += 8)
    for (int c = 0; c < 8; c++) sum[c] += x[k + c];
  return sum[0] + sum[1] + sum[2] + sum[3] + sum[4] + sum[5] + sum[6] + sum[7];
}

static remap_status transfer(remap_context *ctx, const remap_transfer *how, int num, remap_field_desc *field, double *seconds)
{
  MPI_Barrier(MPI_COMM_WORLD);
  const double       start  = MPI_Wtime();
  const remap_status status = remap_field(ctx, REMAP_FORWARD, how, num, field, NULL);
  MPI_Barrier(MPI_COMM_WORLD);
  *seconds = MPI_Wtime() - start;
  return status;
}

int main(int argc, char **argv)
{
  const int        order = argc > 3 ? atoi(argv[3]) : 0, repeats = argc > 4 ? atoi(argv[4]) : 9;
  int              rank, size;
  tm_mesh         *whole[2], *mine[2];
  remap_context   *ctx   = NULL;
  remap_stats      stats = {0};
  remap_field_desc field[MANY];
  double          *value[2];

  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  if (order < 1 || order > 2 || atoi(argv[2]) < 1 || repeats < 1 || !bench_meshes(argv[1], atoi(argv[2]), whole))
    return fprintf(stderr, "usage: bench_stream " BENCH_CASES " N 1|2 [REPEATS]\n"), MPI_Finalize(), 2;
  remap_status status = remap_create(MPI_COMM_WORLD, NULL, &ctx);
  for (int side = 0; side < 2; side++) {
    int *deal   = tm_deal(whole[side], size, TM_SLABS, 0);
    mine[side]  = tm_part(whole[side], deal, rank, 0);
    value[side] = tm_alloc_(MANY * mine[side]->view.num_cells, sizeof(double));
    if (status == REMAP_OK) status = remap_set_mesh(ctx, side, &mine[side]->view);
    tm_free(whole[side]);
    free(deal);
  }
  const int64_t num[2] = {mine[0]->view.num_cells, mine[1]->view.num_cells};
  for (int64_t k = 0; k < MANY * num[0]; k++) value[0][k] = 1 + 1e-3 * (double)(k % 1000);
  for (int f = 0; f < MANY; f++)
    field[f] =
        (remap_field_desc){.name = "u", .nature = REMAP_CONSERVED, .in = value[0] + f * num[0], .out = value[1] + f * num[1]};

  remap_transfer how;
  double        *time = tm_alloc_(3 * repeats, sizeof *time), *many = time + repeats, *plain = many + repeats, once, sum = 0;
  remap_transfer_default(&how);
  how.order   = order;
  how.limiter = REMAP_LIMITER_NONE;
  if (status == REMAP_OK) status = remap_build(ctx);
  if (status == REMAP_OK) status = remap_get_stats(ctx, &stats);
  const int64_t bytes = stats.pairs / size * (order == 1 ? 12 : 36) + 8 * (num[0] * (order == 1 ? 1 : 4) + num[1]);
  double       *block = tm_alloc_(bytes / 8, sizeof *block);
  for (int64_t k = 0; k < bytes / 8; k++) block[k] = 1;
  if (status == REMAP_OK) status = transfer(ctx, &how, MANY, field, &once); /* prepares */
  for (int r = 0; r < repeats && status == REMAP_OK; r++) {
    status = transfer(ctx, &how, 1, field, &time[r]);
    if (status == REMAP_OK) status = transfer(ctx, &how, MANY, field, &many[r]);
    const double start = MPI_Wtime();
    sum += stream(block, bytes / 8);
    plain[r] = MPI_Wtime() - start;
  }
  if (status != REMAP_OK && rank == 0) fprintf(stderr, "%s: %s\n", remap_status_text(status), remap_message(ctx));
  if (status == REMAP_OK && rank == 0 && sum > 0) {
    const double one = 1e3 * bench_median(time, repeats), all = 1e3 * bench_median(many, repeats),
                 bare = 1e3 * bench_median(plain, repeats);
    printf("{\"bench\":\"stream\",\"case\":\"%s\",\"n\":%s,\"ranks\":%d,\"order\":%d,\"cells\":[%lld,%lld],\"pairs\":%lld,"
           "\"bytes\":%lld,\"ms_one\":%.3f,"
           "\"ms_one_of_%d\":%.3f,\"ms_one_more\":%.3f,\"ms_stream\":%.3f,\"ratio\":%.2f}\n",
           argv[1], argv[2], size, order, (long long)num[0], (long long)num[1], (long long)stats.pairs, (long long)bytes, one,
           MANY, all / MANY, (all - one) / (MANY - 1), bare, (all - one) / (MANY - 1) / bare);
  }
  remap_destroy(&ctx);
  for (int side = 0; side < 2; side++) tm_free(mine[side]), free(value[side]);
  free(block), free(time);
  MPI_Finalize();
  return status != REMAP_OK;
}
