/* bench_build -- time of a whole remap_build and of one remap_field on the meshes of bench_overlay, on any number of ranks. Cells
 * are dealt in slabs. One JSON line.
 *
 *   mpirun -n P bench_build N NB SCALE diagonal|centre [REPEATS] */
#include <remap/remap.h>
#include <stdio.h>
#include <sys/resource.h>
#include "meshes.h"

static int by_value(const void *a, const void *b)
{
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static double median(double *x, int n)
{
  qsort(x, (size_t)n, sizeof *x, by_value);
  return x[n / 2];
}

int main(int argc, char **argv)
{
  int rank, size;

  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  if (argc < 5) return fprintf(stderr, "usage: bench_build N NB SCALE diagonal|centre [REPEATS]\n"), MPI_Finalize(), 2;

  const int       repeats = argc > 5 ? atoi(argv[5]) : 1;
  tm_mesh        *whole[2] = {tm_benchmark(atoi(argv[1]), 0.7, 0.3, atof(argv[3])), tm_benchmark(atoi(argv[2]), 0.1, 0, 1)}, *mine[2];
  double         *wall = tm_alloc_(4 * repeats, sizeof *wall), *partition = wall + repeats, *overlay = partition + repeats, *field = overlay + repeats;
  remap_options   options;
  remap_context  *ctx = NULL;
  remap_stats     stats;
  int64_t         cells[2];
  remap_status    status;

  for (int side = 0; side < 2; side++) {
    int *deal   = tm_deal(whole[side], size, TM_SLABS, 0);
    mine[side]  = tm_part(whole[side], deal, rank, 0);
    cells[side] = whole[side]->view.num_cells;
    tm_free(whole[side]);
    free(deal);
  }
  remap_options_default(&options);
  options.faces = strcmp(argv[4], "centre") ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE;
  status        = remap_create(MPI_COMM_WORLD, &options, &ctx);
  for (int side = 0; side < 2 && status == REMAP_OK; side++) status = remap_set_mesh(ctx, side, &mine[side]->view);
  double *u = tm_alloc_(mine[0]->view.num_cells, sizeof *u), *v = tm_alloc_(mine[1]->view.num_cells, sizeof *v);
  for (int r = 0; r < repeats && status == REMAP_OK; r++) {
    MPI_Barrier(MPI_COMM_WORLD);
    const double start = MPI_Wtime();
    status             = remap_build(ctx);
    if (status != REMAP_OK) break;
    wall[r] = MPI_Wtime() - start;
    remap_get_stats(ctx, &stats);
    partition[r] = stats.seconds_partition;
    overlay[r]   = stats.seconds_overlay;
    remap_field_desc one = {.name = "u", .nature = REMAP_CONSERVED, .in = u, .out = v};
    status               = remap_field(ctx, REMAP_FORWARD, NULL, 1, &one, NULL); /* prepares the stencils */
    MPI_Barrier(MPI_COMM_WORLD);
    const double begin = MPI_Wtime();
    if (status == REMAP_OK) status = remap_field(ctx, REMAP_FORWARD, NULL, 1, &one, NULL);
    field[r] = MPI_Wtime() - begin;
  }
  if (status != REMAP_OK) {
    if (rank == 0) fprintf(stderr, "%s: %s\n", remap_status_text(status), remap_message(ctx));
  } else {
    struct rusage usage;
    double        peak;
    getrusage(RUSAGE_SELF, &usage);
    peak = (double)usage.ru_maxrss * 1024;
    MPI_Allreduce(MPI_IN_PLACE, &peak, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
    if (rank == 0)
      printf("{\"bench\":\"build\",\"ranks\":%d,\"faces\":\"%s\",\"cells\":[%lld,%lld],\"pairs\":%lld,\"closure\":[%.1e,%.1e],\"seconds_build\":%.3f,"
             "\"seconds_partition\":%.3f,\"seconds_overlay\":%.3f,\"us_build_per_source_cell\":%.2f,\"seconds_field\":%.4f,\"peak_rss_bytes_max\":%.0f}\n",
             size, argv[4], (long long)cells[0], (long long)cells[1], (long long)stats.pairs, stats.max_closure_error[0], stats.max_closure_error[1],
             median(wall, repeats), median(partition, repeats), median(overlay, repeats), 1e6 * median(wall, repeats) / (double)cells[0],
             median(field, repeats), peak);
  }
  remap_destroy(&ctx);
  for (int side = 0; side < 2; side++) tm_free(mine[side]);
  free(u), free(v), free(wall);
  MPI_Finalize();
  return status != REMAP_OK;
}
