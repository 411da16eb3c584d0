/* bench_build -- a whole remap_build and one remap_field on the meshes of bench.h, on any number of ranks; cells are dealt in
 * slabs. One JSON line: medians of wall clock; bytes of heap that the library holds at the peak of remap_build, after it, and
 * when fields have been moved too, per target cell; the largest resident size.
 *
 *   mpirun -n P bench_build CASE N diagonal|centre [REPEATS] */
#include <remap/remap.h>
#include "bench.h"

typedef struct times {
  double *build, *cpu, *partition, *overlay, *field; /* [repeats] */
} times;

static remap_status one_field(remap_context *ctx, const double *u, double *v)
{
  remap_field_desc one = {.name = "u", .nature = REMAP_CONSERVED, .in = u, .out = v};
  return remap_field(ctx, REMAP_FORWARD, NULL, 1, &one, NULL);
}

/* Heap held at the peak of remap_build and after it, and when fields have been moved. */
typedef struct amounts {
  double peak, built, moved;
} amounts;

/* Build once, and transfer a field twice: the first time prepares the stencils. */
static remap_status measure(remap_context *ctx, const double *u, double *v, int r, const times *t, remap_stats *stats,
                            amounts *bytes)
{
  remap_status status;

  MPI_Barrier(MPI_COMM_WORLD);
  const double start = MPI_Wtime(), cpu = bench_cpu();
  status = remap_build(ctx);
  if (status != REMAP_OK) return status;
  bytes->peak  = bench_heap_peak();
  bytes->built = bench_heap_now();
  t->build[r]  = MPI_Wtime() - start;
  t->cpu[r]    = bench_cpu() - cpu;
  remap_get_stats(ctx, stats);
  t->partition[r] = stats->seconds_partition;
  t->overlay[r]   = stats->seconds_overlay;
  status          = one_field(ctx, u, v);
  MPI_Barrier(MPI_COMM_WORLD);
  const double begin = MPI_Wtime();
  if (status == REMAP_OK) status = one_field(ctx, u, v);
  t->field[r]  = MPI_Wtime() - begin;
  bytes->moved = bench_heap_now();
  return status;
}

static double largest(double x)
{
  MPI_Allreduce(MPI_IN_PLACE, &x, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
  return x;
}

int main(int argc, char **argv)
{
  const int      repeats = argc > 4 ? atoi(argv[4]) : 1, faces = argc > 3 ? bench_faces(argv[3]) : -1;
  int            rank, size;
  tm_mesh       *whole[2], *mine[2];
  int64_t        cells[2];
  remap_options  options;
  remap_context *ctx   = NULL;
  remap_stats    stats = {0};
  remap_status   status;

  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  if (faces < 0 || atoi(argv[2]) < 1 || repeats < 1 || !bench_meshes(argv[1], atoi(argv[2]), whole))
    return fprintf(stderr, "usage: bench_build " BENCH_CASES " N diagonal|centre [REPEATS]\n"), MPI_Finalize(), 2;
  for (int side = 0; side < 2; side++) {
    int *deal   = tm_deal(whole[side], size, TM_SLABS, 0);
    mine[side]  = tm_part(whole[side], deal, rank, 0);
    cells[side] = whole[side]->view.num_cells;
    tm_free(whole[side]);
    free(deal);
  }
  double     *time = tm_alloc_(5 * repeats, sizeof *time);
  const times t    = {time, time + repeats, time + 2 * repeats, time + 3 * repeats, time + 4 * repeats};
  double     *u = tm_alloc_(mine[0]->view.num_cells, sizeof *u), *v = tm_alloc_(mine[1]->view.num_cells, sizeof *v);

  remap_options_default(&options);
  options.faces = (remap_faces)faces;
  status        = remap_create(MPI_COMM_WORLD, &options, &ctx);
  for (int side = 0; side < 2 && status == REMAP_OK; side++) status = remap_set_mesh(ctx, side, &mine[side]->view);
  const double held  = bench_heap_start();
  amounts      bytes = {0, 0, 0}, once = {0, 0, 0};
  for (int r = 0; r < repeats && status == REMAP_OK; r++) {
    status = measure(ctx, u, v, r, &t, &stats, &once);
    if (r == 0) bytes = (amounts){once.peak - held, once.built - held, once.moved - held};
  }
  if (status != REMAP_OK && rank == 0) fprintf(stderr, "%s: %s\n", remap_status_text(status), remap_message(ctx));
  bytes = (amounts){largest(bytes.peak) * size, largest(bytes.built) * size, largest(bytes.moved) * size};
  if (status == REMAP_OK && rank == 0)
    printf("{\"bench\":\"build\",\"case\":\"%s\",\"n\":%s,\"ranks\":%d,\"faces\":\"%s\",\"cells\":[%lld,%lld],\"pairs\":%lld,"
           "\"closure\":[%.1e,%.1e],"
           "\"seconds_build\":%.3f,\"seconds_cpu\":%.3f,\"seconds_partition\":%.3f,\"seconds_overlay\":%.3f,\"us_build_per_"
           "source_cell\":%.2f,"
           "\"seconds_field\":%.4f,\"peak_bytes_per_target_cell\":%.0f,\"built_bytes_per_target_cell\":%.0f,"
           "\"moved_bytes_per_target_cell\":%.0f,\"peak_rss_bytes\":%.0f}\n",
           argv[1], argv[2], size, argv[3], (long long)cells[0], (long long)cells[1], (long long)stats.pairs,
           stats.max_closure_error[0], stats.max_closure_error[1], bench_median(t.build, repeats), bench_median(t.cpu, repeats),
           bench_median(t.partition, repeats), bench_median(t.overlay, repeats),
           1e6 * bench_median(t.cpu, repeats) / (double)cells[0], bench_median(t.field, repeats), bytes.peak / (double)cells[1],
           bytes.built / (double)cells[1], bytes.moved / (double)cells[1], bench_rss_bytes());
  remap_destroy(&ctx);
  for (int side = 0; side < 2; side++) tm_free(mine[side]);
  free(u), free(v), free(time);
  MPI_Finalize();
  return status != REMAP_OK;
}
