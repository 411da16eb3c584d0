/* bench_scaling -- what a remap_build and a remap_field cost a rank besides computing: messages, partners, bytes and collective
 * calls, counted between the library and MPI, and memory. One JSON line; the largest over the ranks of each. The meshes are
 * those of tests/support/balance.h, dealt in slabs, or at random if RANDOM is given.
 *
 *   mpirun -n P bench_scaling CASE N [RANDOM] */
#include <remap/remap.h>
#include "balance.h"
#include "bench.h"

enum { MOST_RANKS = 4096 };

/* What this rank sends to others, as MPI is asked to. */
static struct {
  double messages, bytes, collectives, collective_bytes; /* the last: what this rank puts into them */
  char   partner[MOST_RANKS];
} counted_;

static void collective_(double bytes) { counted_.collectives++, counted_.collective_bytes += bytes; }

static double size_(int n, MPI_Datatype type)
{
  int size = 0;

  PMPI_Type_size(type, &size);
  return (double)n * size;
}

static void message_(double bytes, int to)
{
  counted_.messages++;
  counted_.bytes += bytes;
  if (to < MOST_RANKS) counted_.partner[to] = 1;
}

int MPI_Isend(const void *data, int n, MPI_Datatype type, int to, int tag, MPI_Comm comm, MPI_Request *request)
{
  message_(size_(n, type), to);
  return PMPI_Isend(data, n, type, to, tag, comm, request);
}
int MPI_Issend(const void *data, int n, MPI_Datatype type, int to, int tag, MPI_Comm comm, MPI_Request *request)
{
  message_(size_(n, type), to);
  return PMPI_Issend(data, n, type, to, tag, comm, request);
}
int MPI_Ibarrier(MPI_Comm comm, MPI_Request *request)
{
  collective_(0);
  return PMPI_Ibarrier(comm, request);
}
int MPI_Allreduce(const void *mine, void *all, int n, MPI_Datatype type, MPI_Op op, MPI_Comm comm)
{
  collective_(size_(n, type));
  return PMPI_Allreduce(mine, all, n, type, op, comm);
}
int MPI_Exscan(const void *mine, void *all, int n, MPI_Datatype type, MPI_Op op, MPI_Comm comm)
{
  collective_(size_(n, type));
  return PMPI_Exscan(mine, all, n, type, op, comm);
}
int MPI_Bcast(void *data, int n, MPI_Datatype type, int root, MPI_Comm comm)
{
  collective_(size_(n, type));
  return PMPI_Bcast(data, n, type, root, comm);
}
int MPI_Allgather(const void *mine, int n, MPI_Datatype type, void *all, int m, MPI_Datatype its, MPI_Comm comm)
{
  collective_(size_(n, type));
  return PMPI_Allgather(mine, n, type, all, m, its, comm);
}
int MPI_Allgatherv(const void *mine, int n, MPI_Datatype type, void *all, const int *m, const int *at, MPI_Datatype its,
                   MPI_Comm comm)
{
  int rank;

  PMPI_Comm_rank(comm, &rank);
  collective_(size_(m[rank], its));
  return PMPI_Allgatherv(mine, n, type, all, m, at, its, comm);
}
int MPI_Alltoall(const void *mine, int n, MPI_Datatype type, void *all, int m, MPI_Datatype its, MPI_Comm comm)
{
  int ranks;

  PMPI_Comm_size(comm, &ranks);
  collective_(size_(m, its) * ranks);
  return PMPI_Alltoall(mine, n, type, all, m, its, comm);
}

/* messages, bytes, partners, collectives, their bytes; and forget them. */
static void take_counts(double out[5])
{
  out[0] = counted_.messages, out[1] = counted_.bytes, out[2] = 0;
  out[3] = counted_.collectives, out[4] = counted_.collective_bytes;
  for (int r = 0; r < MOST_RANKS; r++) out[2] += counted_.partner[r];
  memset(&counted_, 0, sizeof counted_);
}

static remap_status run(remap_context *ctx, tm_mesh *const mine[2], double out[12])
{
  double          *u = tm_alloc_(mine[0]->view.num_cells, sizeof *u), *v = tm_alloc_(mine[1]->view.num_cells, sizeof *v);
  const double     held  = bench_heap_start();
  remap_field_desc one   = {.name = "u", .nature = REMAP_CONSERVED, .in = u, .out = v};
  remap_status     status = REMAP_OK;

  for (int side = 0; side < 2 && status == REMAP_OK; side++) status = remap_set_mesh(ctx, side, &mine[side]->view);
  memset(&counted_, 0, sizeof counted_);
  if (status == REMAP_OK) status = remap_build(ctx);
  take_counts(out);
  out[10] = bench_heap_peak() - held;
  out[11] = bench_heap_now() - held;
  for (int k = 0; k < 2 && status == REMAP_OK; k++) { /* the first prepares the stencils */
    memset(&counted_, 0, sizeof counted_);
    status = remap_field(ctx, REMAP_FORWARD, NULL, 1, &one, NULL);
  }
  take_counts(out + 5);
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
