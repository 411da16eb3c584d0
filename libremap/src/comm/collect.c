/* collect -- communicators, agreement, reductions, and arrays that every rank gets. A reduction costs one MPI call of O(n)
 * bytes; gathering costs one call of the gathered size, or one broadcast per rank and chunk where int cannot count it. */
#include "comm/comm_private.h"

#include <limits.h>
#include <string.h>

remap_status rm_comm_dup(MPI_Comm comm, rm_comm *out)
{
  rm_comm made  = {MPI_COMM_NULL, 0, 0};
  int     inter = 0;

  if (comm == MPI_COMM_NULL) return REMAP_BAD_ARGUMENT;
  RM_TRY(rm_comm_status(MPI_Comm_test_inter(comm, &inter)));
  if (inter) return REMAP_BAD_ARGUMENT;
  RM_TRY(rm_comm_status(MPI_Comm_dup(comm, &made.mpi)));
  MPI_Comm_set_errhandler(made.mpi, MPI_ERRORS_RETURN);
  MPI_Comm_rank(made.mpi, &made.rank);
  MPI_Comm_size(made.mpi, &made.size);
  *out = made;
  return REMAP_OK;
}

void rm_comm_free(rm_comm *comm)
{
  int finalized = 1;

  MPI_Finalized(&finalized); /* a context may outlive MPI: then its communicator is gone already */
  if (!finalized && comm->mpi != MPI_COMM_NULL) MPI_Comm_free(&comm->mpi);
  comm->mpi = MPI_COMM_NULL;
}

remap_status rm_comm_agree(const rm_comm *comm, remap_status mine, int *first_rank)
{
  /* The status in the upper half and the rank, counted downwards, in the lower: one maximum finds both. */
  const int64_t low  = (int64_t)1 << 32;
  int64_t       word = (int64_t)mine * low + (INT_MAX - comm->rank);

  RM_TRY(rm_comm_max_i64(comm, &word, 1));
  if (first_rank) *first_rank = (int)(INT_MAX - word % low);
  return (remap_status)(word / low);
}

remap_status rm_comm_agree_reason(const rm_comm *comm, remap_status mine, rm_reason *reason)
{
  int          first_rank = 0;
  rm_reason    unread     = {-1, -1, ""};
  remap_status status     = rm_comm_agree(comm, mine, &first_rank);

  if (!reason) reason = &unread;
  if (status == REMAP_MPI_FAILURE) *reason = unread; /* send nothing more */
  if (status == REMAP_OK || status == REMAP_MPI_FAILURE) return status;
  RM_TRY(rm_comm_status(MPI_Bcast(reason, (int)sizeof *reason, MPI_BYTE, first_rank, comm->mpi)));
  return status;
}

static remap_status reduce(const rm_comm *comm, void *value, int n, MPI_Datatype type, MPI_Op op)
{
  return rm_comm_status(MPI_Allreduce(MPI_IN_PLACE, value, n, type, op, comm->mpi));
}

remap_status rm_comm_sum_i64(const rm_comm *comm, int64_t *value, int n)
{
  return reduce(comm, value, n, MPI_INT64_T, MPI_SUM);
}

remap_status rm_comm_max_i64(const rm_comm *comm, int64_t *value, int n)
{
  return reduce(comm, value, n, MPI_INT64_T, MPI_MAX);
}

remap_status rm_comm_max_f64(const rm_comm *comm, double *value, int n) { return reduce(comm, value, n, MPI_DOUBLE, MPI_MAX); }

remap_status rm_comm_min_f64(const rm_comm *comm, double *value, int n) { return reduce(comm, value, n, MPI_DOUBLE, MPI_MIN); }

remap_status rm_comm_sum_exact(const rm_comm *comm, rm_sum *sum, int n)
{
  for (int i = 0; i < n; i++) {
    rm_sum_carry(&sum[i]);
    RM_TRY(rm_comm_sum_i64(comm, sum[i].limb, RM_SUM_LIMBS));
    rm_sum_carry(&sum[i]);
  }
  return REMAP_OK;
}

remap_status rm_comm_exscan_i64(const rm_comm *comm, int64_t *value)
{
  RM_TRY(rm_comm_status(MPI_Exscan(MPI_IN_PLACE, value, 1, MPI_INT64_T, MPI_SUM, comm->mpi)));
  if (comm->rank == 0) *value = 0; /* MPI leaves the first rank's alone */
  return REMAP_OK;
}

/* Broadcast bytes of one rank, in chunks. */
static remap_status broadcast(const rm_comm *comm, int64_t chunk, char *data, int64_t bytes, int root)
{
  for (int64_t at = 0; at < bytes; at += chunk)
    RM_TRY(rm_comm_status(MPI_Bcast(data + at, (int)(bytes - at < chunk ? bytes - at : chunk), MPI_BYTE, root, comm->mpi)));
  return REMAP_OK;
}

/* Every rank's bytes [offset[r], offset[r + 1]) * size of all, of which this rank's are filled in, go to every other. */
static remap_status broadcast_all(const rm_comm *comm, int64_t chunk, char *all, const int64_t *offset, int64_t size)
{
  for (int r = 0; r < comm->size; r++)
    RM_TRY(broadcast(comm, chunk, all + offset[r] * size, (offset[r + 1] - offset[r]) * size, r));
  return REMAP_OK;
}

remap_status rm_comm_allgather_chunked(const rm_comm *comm, int64_t chunk, const void *mine, void *all, int64_t n, size_t size)
{
  const int64_t bytes = n * (int64_t)size; /* of one rank */

  if (rm_mul_sat(bytes, comm->size) <= chunk)
    return rm_comm_status(MPI_Allgather(mine, (int)bytes, MPI_BYTE, all, (int)bytes, MPI_BYTE, comm->mpi));
  memcpy((char *)all + comm->rank * bytes, mine, (size_t)bytes);
  for (int r = 0; r < comm->size; r++) RM_TRY(broadcast(comm, chunk, (char *)all + r * bytes, bytes, r));
  return REMAP_OK;
}

remap_status rm_comm_allgather(const rm_comm *comm, const void *mine, void *all, int64_t n, size_t size)
{
  return rm_comm_allgather_chunked(comm, RM_COMM_CHUNK, mine, all, n, size);
}

remap_status rm_comm_allgatherv_chunked(const rm_comm *comm, int64_t chunk, rm_arena *arena, const void *mine, int64_t n,
                                        size_t size, int64_t *offset, void **all)
{
  int64_t total;
  int    *bytes; /* [2 * comm->size] of every rank's part, then where it starts */
  char   *data;

  RM_TRY(rm_comm_allgather(comm, &n, offset, 1, sizeof n));
  total = rm_offsets(offset, comm->size);
  bytes = rm_arena_alloc(arena, 2 * (int64_t)comm->size, sizeof *bytes);
  data  = rm_arena_alloc(arena, total, size);
  RM_TRY(rm_comm_agree(comm, bytes && data ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  if (n > 0) memcpy(data + offset[comm->rank] * (int64_t)size, mine, (size_t)n * size);
  *all = data;
  if (total * (int64_t)size > chunk) return broadcast_all(comm, chunk, data, offset, (int64_t)size);
  for (int r = 0; r < comm->size; r++) {
    bytes[r]              = (int)((offset[r + 1] - offset[r]) * (int64_t)size);
    bytes[comm->size + r] = (int)(offset[r] * (int64_t)size);
  }
  return rm_comm_status(MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_BYTE, data, bytes, bytes + comm->size, MPI_BYTE, comm->mpi));
}

remap_status rm_comm_allgatherv(const rm_comm *comm, rm_arena *arena, const void *mine, int64_t n, size_t size, int64_t *offset,
                                void **all)
{
  return rm_comm_allgatherv_chunked(comm, RM_COMM_CHUNK, arena, mine, n, size, offset, all);
}
