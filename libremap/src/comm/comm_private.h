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

/* The numbers of items that every rank is about to send to this one: count[comm->size], out of everybody's send_offset
 * [comm->size + 1]. Collective; before it is called again the ranks have to meet, in any collective call. */
remap_status rm_comm_counts(const rm_comm *comm, const int64_t *send_offset, int64_t *count);

/* The functions of comm.h of the same names, with messages of at most chunk bytes, 1 <= chunk <= RM_COMM_CHUNK, the same on
 * every rank. */

/* As rm_comm_allgather. Collective. */
remap_status rm_comm_allgather_chunked(const rm_comm *comm, int64_t chunk, const void *mine, void *all, int64_t n, size_t size);

/* As rm_comm_allgatherv. Collective. *all lives in arena. */
remap_status rm_comm_allgatherv_chunked(const rm_comm *comm, int64_t chunk, rm_arena *arena, const void *mine, int64_t n,
                                        size_t size, int64_t *offset, void **all);

/* As rm_comm_exchange. Collective. *recv lives in arena. */
remap_status rm_comm_exchange_chunked(const rm_comm *comm, int64_t chunk, rm_arena *arena, size_t size,
                                      const int64_t *send_offset, const void *send, int64_t *recv_offset, void **recv);

/* As rm_plan_run. Among neighbours. */
remap_status rm_plan_run_chunked(const rm_comm *comm, int64_t chunk, const rm_plan *plan, size_t size, const void *item,
                                 void *received, void *buffer);

/* As rm_flow_init. Not collective. *out lives in arena. */
remap_status rm_flow_init_chunked(rm_arena *arena, int64_t chunk, const rm_plan *plan, int stream, size_t most, rm_flow *out);

/* Tags of messages. Whoever says something says it first with RM_TAG_FIRST, in a message of RM_FIRST_BYTES at most, for which
 * there is always room; what is longer follows, with a tag from RM_TAG_REST on that tells what is under way from everything
 * else. */
enum { RM_TAG_FIRST = 3, RM_TAG_TREE = 4, RM_TAG_APART = 5, RM_TAG_REST = 8, RM_FIRST_BYTES = 1024 };

/* Tell the peers that are none of plan's (which may be NULL) neighbours and not apart this note, and listen to them. */
remap_status rm_parley_post(const rm_comm *comm, rm_parley *parley, const rm_plan *plan, rm_note note);
/* Note that peer p is apart, and tell it that nothing is expected of it any more. */
remap_status rm_parley_part(const rm_comm *comm, rm_parley *parley, int p);
/* Hear the same of all who came apart since the parley was opened: what they send from now on belongs to another one. */
remap_status rm_parley_settle(const rm_comm *comm, rm_parley *parley);
/* Nobody is apart. */
void rm_parley_clear(rm_parley *parley);
/* Wait for what they say; BAD_ARGUMENT if one is apart. */
remap_status rm_parley_wait(const rm_comm *comm, rm_parley *parley);
/* The place of a rank among peers. */
int rm_peers_find(const rm_peers *peers, int rank);
/* Wait for a request. */
remap_status rm_comm_wait(MPI_Request *request);
/* Take what follows a note that is of no use. MPI_FAILURE; NO_MEMORY, and it stays where it is. */
remap_status rm_comm_drain(const rm_comm *comm, int rank, const rm_note *note);

#endif
