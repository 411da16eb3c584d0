/* comm_private -- what the files of the room share, and what its tests reach: messages cut into pieces of a size that the
 * caller names, so that the path of very large arrays runs on small ones too. */
#ifndef RM_COMM_PRIVATE_H
#define RM_COMM_PRIVATE_H

#include "comm/comm.h"

/* Bytes of one message at most. MPI counts in int; a power of two below that leaves room for headers. */
#define RM_COMM_CHUNK ((int64_t)1 << 30)

/* A status of an MPI call. */
static inline remap_status rm_comm_status(int mpi)
{
  return mpi == MPI_SUCCESS ? REMAP_OK : REMAP_MPI_FAILURE;
}

/* As rm_comm_allgather, rm_comm_allgatherv, rm_comm_exchange, rm_plan_run and rm_flow_init, with messages of at most chunk bytes,
 * 1 <= chunk <= RM_COMM_CHUNK, the same on every rank. */
remap_status rm_comm_allgather_chunked(const rm_comm *comm, int64_t chunk, const void *mine, void *all, int64_t n, size_t size);
remap_status rm_comm_allgatherv_chunked(const rm_comm *comm, int64_t chunk, rm_arena *arena, const void *mine, int64_t n,
                                        size_t size, int64_t *offset, void **all);
remap_status rm_comm_exchange_chunked(const rm_comm *comm, int64_t chunk, rm_arena *arena, size_t size,
                                      const int64_t *send_offset, const void *send, int64_t *recv_offset, void **recv);
remap_status rm_plan_run_chunked(const rm_comm *comm, int64_t chunk, const rm_plan *plan, size_t size, const void *item,
                                 void *received, void *buffer);
remap_status rm_flow_init_chunked(rm_arena *arena, int64_t chunk, const rm_plan *plan, size_t most, rm_flow *out);

#endif
