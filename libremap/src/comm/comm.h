/* comm -- the only room that calls MPI: agreement, reductions, exchange of arrays, exchange with neighbours.
 * Everything is collective on the communicator unless it says otherwise; counts beyond 2^31 travel in chunks. */
#ifndef RM_COMM_H
#define RM_COMM_H

#include "base/base.h"

typedef struct rm_comm {
  MPI_Comm mpi; /* a duplicate, owned */
  int      rank, size;
} rm_comm;

/* Duplicate comm, with MPI errors returned instead of fatal. The caller owns *out: rm_comm_free. */
remap_status rm_comm_dup(MPI_Comm comm, rm_comm *out);
void rm_comm_free(rm_comm *comm);

/* One status for all: the greatest number wins; *first_rank (may be NULL) is the lowest rank that has it. */
remap_status rm_comm_agree(const rm_comm *comm, remap_status mine, int *first_rank);
/* The same, and *reason (may be NULL) becomes that rank's everywhere: unchanged if all is well, empty if MPI failed. */
remap_status rm_comm_agree_reason(const rm_comm *comm, remap_status mine, rm_reason *reason);

/* In place over all ranks, elementwise. */
remap_status rm_comm_sum_i64(const rm_comm *comm, int64_t *value, int n);
remap_status rm_comm_max_i64(const rm_comm *comm, int64_t *value, int n);
remap_status rm_comm_max_f64(const rm_comm *comm, double *value, int n);
remap_status rm_comm_min_f64(const rm_comm *comm, double *value, int n);
/* Sum of exact accumulators; the same on every rank whatever the partition. */
remap_status rm_comm_sum_exact(const rm_comm *comm, rm_sum *sum, int n);
/* Sum of the values of all lower ranks. */
remap_status rm_comm_exscan_i64(const rm_comm *comm, int64_t *value);
/* Everybody's n items of `size` bytes, rank after rank, into all[size of comm * n * size]. */
remap_status rm_comm_allgather(const rm_comm *comm, const void *mine, void *all, int64_t n, size_t size);
/* The same with a count per rank: offset, room for comm->size + 1, receives the items' offsets; *all lives in arena. */
remap_status rm_comm_allgatherv(const rm_comm *comm, rm_arena *arena, const void *mine, int64_t n, size_t size, int64_t *offset,
                                void **all);

/* Send items [send_offset[r], send_offset[r+1]) of `size` bytes to each rank r; receive likewise, in the order of the senders'
 * ranks. send_offset and recv_offset are [comm->size + 1]; *recv lives in arena. A rank that cannot allocate makes all fail. */
remap_status rm_comm_exchange(const rm_comm *comm, rm_arena *arena, size_t size, const int64_t *send_offset, const void *send,
                              int64_t *recv_offset, void **recv);

/* plan -- who sends what to whom, again and again: what each rank wants from cells of other ranks. Read-only once built. */
typedef struct rm_plan {
  int            num_send, num_recv;         /* neighbours, this rank among them if it wants from itself */
  const int     *send_rank, *recv_rank;      /* [num_send], [num_recv] ascending                         */
  const int64_t *send_offset, *recv_offset;  /* [num_send + 1], [num_recv + 1]                            */
  const rm_lid  *send_item;                  /* [send_offset[num_send]] which of my items to send         */
  MPI_Request   *request;                    /* [num_send + num_recv] scratch of rm_plan_run              */
} rm_plan;
/* This rank wants item want_item[k] of rank want_rank[k], k < num_want, want_rank ascending. Received items come in that order.
 * The plan lives in arena. */
remap_status rm_plan_build(const rm_comm *comm, rm_arena *arena, int64_t num_want, const int *want_rank, const rm_lid *want_item,
                           const rm_plan **out);
/* Move `size` bytes per item: item is indexed by send_item, received is [recv_offset[num_recv]]; buffer is scratch for
 * send_offset[num_send] items. Among neighbours only: returns as soon as this rank has sent and received. */
remap_status rm_plan_run(const rm_comm *comm, const rm_plan *plan, size_t size, const void *item, void *received, void *buffer);

/* What a rank tells its neighbours in front of its items. */
typedef struct rm_note {
  uint64_t mark;   /* says what is under way: the same at sender and receiver, if they agree */
  int64_t  status; /* remap_status of the sender                                             */
} rm_note;

/* flow -- a plan run in two steps, so that other work fits between, with a note in front of every message. Its memory is taken
 * once. rm_flow_post and rm_flow_wait involve neighbours only and take turns; a rank that failed posts all the same and says so
 * in its note, so nobody waits for ever. */
typedef struct rm_flow {
  const rm_plan *plan;
  size_t         most;     /* bytes per item that there is room for                                        */
  size_t         size;     /* bytes per item of the run under way                                          */
  int64_t        chunk;    /* bytes of one message to MPI at most                                          */
  char          *sent;     /* messages to others side by side, each a note and items                       */
  char          *arrived;  /* messages from others likewise                                                */
  char          *received; /* [plan->recv_offset[plan->num_recv]] items of the last run, in the plan's order */
  MPI_Request   *request;
  MPI_Status    *status;       /* of the requests */
  int            num_requests; /* under way       */
} rm_flow;

/* Room for runs of at most `most` bytes per item. Not collective. Lives in arena. NO_MEMORY. */
remap_status rm_flow_init(rm_arena *arena, const rm_plan *plan, size_t most, rm_flow *out);
/* Send `size` bytes of each item, indexed by the plan's send_item, behind this rank's note; items may be changed afterwards. */
remap_status rm_flow_post(const rm_comm *comm, rm_flow *flow, size_t size, const void *item, rm_note note);
/* Wait until this rank has received and sent; flow->received then holds the items. The status in note becomes the greatest of its
 * own and the senders'. BAD_ARGUMENT if a sender's mark or size differs. */
remap_status rm_flow_wait(const rm_comm *comm, rm_flow *flow, rm_note *note);

#endif
