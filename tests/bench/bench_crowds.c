/* bench_crowds -- what it costs a rank to learn of the boxes that it meets, on very many ranks: each has K^3 unit boxes, side
 * by side along the Morton curve, or anywhere among those of all ranks if RANDOM is given. One JSON line: the largest over the
 * ranks of messages, bytes sent and crowds known, of all and of joined ones, and what 48 bytes for each crowd of each rank are.
 *
 *   mpirun -n P bench_crowds K [RANDOM] */
#include "counted.h"
#include "zone/zone.h"

#include <stdio.h>
#include <stdlib.h>

/* Place of the i-th unit box on the Morton curve. */
static void place(uint64_t i, double box[6])
{
  for (int d = 0; d < 3; d++) {
    uint64_t at = 0;

    for (int bit = 0; bit < 21; bit++) at |= (i >> (3 * bit + d) & 1) << bit;
    box[d]     = (double)at;
    box[d + 3] = (double)at + 1;
  }
}

int main(int argc, char **argv)
{
  static const rm_lid most[2] = {RM_ALL_CROWDS, RM_SOME_CROWDS};
  const int64_t       k = argc > 1 ? atoi(argv[1]) : 0, n = k * k * k;
  rm_arena           *arena = rm_arena_new();
  rm_comm             comm;
  rm_crowds           crowds = {.num = 0};
  double              counts[2][5] = {{0}}, known[2] = {0}, (*box)[6];
  remap_status        status = REMAP_OK;

  MPI_Init(&argc, &argv);
  if (k < 1 || k > 100) return fprintf(stderr, "usage: bench_crowds K [RANDOM], K below 101\n"), MPI_Finalize(), 2;
  if (rm_comm_dup(MPI_COMM_WORLD, &comm) != REMAP_OK || !arena) MPI_Abort(MPI_COMM_WORLD, 7);
  box = rm_arena_alloc(arena, n, sizeof *box);
  if (!box) MPI_Abort(MPI_COMM_WORLD, 7);
  for (int64_t i = 0; i < n; i++) {
    const uint64_t own = (uint64_t)(comm.rank * n + i);

    place(argc > 2 ? rm_hash_word(own) % (uint64_t)(comm.size * n) : own, box[i]);
  }
  for (int j = 0; j < 2 && status == REMAP_OK; j++) {
    counted_take(NULL);
    status = rm_crowds_meet(arena, &comm, (rm_lid)n, (const double(*)[6])box, (rm_lid)n, (const double(*)[6])box, most[j],
                            &crowds);
    counted_take(counts[j]);
    known[j] = crowds.num;
  }
  PMPI_Allreduce(MPI_IN_PLACE, counts, 10, MPI_DOUBLE, MPI_MAX, comm.mpi);
  PMPI_Allreduce(MPI_IN_PLACE, known, 2, MPI_DOUBLE, MPI_MAX, comm.mpi);
  if (comm.rank == 0 && status == REMAP_OK)
    printf("{\"bench\":\"crowds\",\"dealt\":\"%s\",\"ranks\":%d,\"boxes\":%lld,\"messages\":%.0f,\"bytes\":%.0f,\"known\":%.0f,"
           "\"joined\":{\"bytes\":%.0f,\"known\":%.0f},\"all_bytes\":%.0f}\n",
           argc > 2 ? "random" : "curve", comm.size, (long long)n, counts[0][0], counts[0][1], known[0], counts[1][1], known[1],
           48.0 * RM_CROWDS * comm.size);
  rm_comm_free(&comm);
  rm_arena_drop(arena);
  MPI_Finalize();
  return status != REMAP_OK;
}
