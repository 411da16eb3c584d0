/* bench_scaling -- what a remap_build and a remap_field cost a rank besides computing: messages, partners, bytes and collective
 * calls, counted between the library and MPI, and memory. One JSON line; the largest over the ranks of each. The meshes are
 * those of tests/support/balance.h, dealt in slabs, or at random if RANDOM is given.
 *
 *   mpirun -n P bench_scaling CASE N [RANDOM] */
#include <remap/remap.h>
#include "balance.h"
#include "bench.h"
#include "counted.h"

static remap_status run(remap_context *ctx, tm_mesh *const mine[2], double out[12])
{
  double          *u = tm_alloc_(mine[0]->view.num_cells, sizeof *u), *v = tm_alloc_(mine[1]->view.num_cells, sizeof *v);
  const double     held  = bench_heap_start();
  remap_field_desc one   = {.name = "u", .nature = REMAP_CONSERVED, .in = u, .out = v};
  remap_status     status = REMAP_OK;

  for (int side = 0; side < 2 && status == REMAP_OK; side++) status = remap_set_mesh(ctx, side, &mine[side]->view);
  counted_take(NULL);
  if (status == REMAP_OK) status = remap_build(ctx);
  counted_take(out);
  out[10] = bench_heap_peak() - held;
  out[11] = bench_heap_now() - held;
  for (int k = 0; k < 2 && status == REMAP_OK; k++) { /* the first prepares the stencils */
    counted_take(NULL);
    status = remap_field(ctx, REMAP_FORWARD, NULL, 1, &one, NULL);
  }
  counted_take(out + 5);
  free(u), free(v);
  return status;
}

int main(int argc, char **argv)
{
  int            rank, size;
  tm_mesh       *whole[2], *mine[2];
  remap_context *ctx = NULL;
  remap_stats    stats;
  double         out[12] = {0};
  int64_t        cells = 0;

  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  if (argc < 3 || !balance_meshes(argv[1], atoi(argv[2]), whole))
    return fprintf(stderr, "usage: bench_scaling CASE N [RANDOM]\n"), MPI_Finalize(), 2;
  for (int side = 0; side < 2; side++) {
    int *deal  = tm_deal(whole[side], size, argc > 3 ? TM_RANDOM : TM_SLABS, 1);
    mine[side] = tm_part(whole[side], deal, rank, 0);
    cells += whole[side]->view.num_cells;
    tm_free(whole[side]);
    free(deal);
  }
  remap_status status = remap_create(MPI_COMM_WORLD, NULL, &ctx);
  if (status == REMAP_OK) status = run(ctx, mine, out);
  if (status == REMAP_OK) status = remap_get_stats(ctx, &stats);
  PMPI_Allreduce(MPI_IN_PLACE, out, 12, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
  if (rank == 0 && status == REMAP_OK)
    printf("{\"bench\":\"scaling\",\"case\":\"%s\",\"dealt\":\"%s\",\"ranks\":%d,\"cells\":%lld,\"pairs\":%lld,\"build\":{"
           "\"messages\":%.0f,\"bytes\":%.0f,\"partners\":%.0f,\"collectives\":%.0f,\"collective_bytes\":%.0f,"
           "\"peak_bytes\":%.0f,\"kept_bytes\":%.0f},"
           "\"field\":{\"messages\":%.0f,\"bytes\":%.0f,\"partners\":%.0f,\"collectives\":%.0f}}\n",
           argv[1], argc > 3 ? "random" : "slabs", size, (long long)cells, (long long)stats.pairs, out[0], out[1], out[2],
           out[3], out[4], out[10], out[11], out[5], out[6], out[7], out[8]);
  remap_destroy(&ctx);
  for (int side = 0; side < 2; side++) tm_free(mine[side]);
  MPI_Finalize();
  return status != REMAP_OK;
}
