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
/* Free the duplicate. Collective. */
void rm_comm_free(rm_comm *comm);

/* One status for all: the greatest number wins; *first_rank (may be NULL) is the lowest rank that has it. */
remap_status rm_comm_agree(const rm_comm *comm, remap_status mine, int *first_rank);
/* The same, and *reason (may be NULL) becomes that rank's everywhere: unchanged if all is well, empty if MPI failed. */
remap_status rm_comm_agree_reason(const rm_comm *comm, remap_status mine, rm_reason *reason);

/* Sums over all ranks, in place, elementwise. */
remap_status rm_comm_sum_i64(const rm_comm *comm, int64_t *value, int n);
/* The greatest, likewise. */
remap_status rm_comm_max_i64(const rm_comm *comm, int64_t *value, int n);
/* The greatest, likewise; no NaN. */
remap_status rm_comm_max_f64(const rm_comm *comm, double *value, int n);
/* The least, likewise; no NaN. */
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

/* Send n items of `size` bytes to the rank `with`, and receive *num of its, *recv in arena; it calls this for this rank at the
 * same time. Among these two only, in one message each way if it is short. NO_MEMORY on the rank that lacks it: what it was
 * sent is lost, *num is 0, and the other has its items all the same. */
remap_status rm_comm_swap(const rm_comm *comm, rm_arena *arena, int with, size_t size, int64_t n, const void *send,
                          int64_t *num, void **recv);

/* plan -- who sends what to whom, again and again: what each rank wants from cells of other ranks. Read-only once built. */
typedef struct rm_plan {
  int            num_send, num_recv;         /* neighbours, this rank among them if it wants from itself */
  const int     *send_rank, *recv_rank;      /* [num_send], [num_recv] ascending                         */
  int            own_send, own_recv;         /* place of this rank in both, -1: it is in neither          */
  const int64_t *send_offset, *recv_offset;  /* [num_send + 1], [num_recv + 1]                            */
  const rm_lid  *send_item;                  /* [send_offset[num_send]] which of my items to send         */
  MPI_Request   *request;                    /* [num_send + num_recv] scratch of rm_plan_run              */
} rm_plan;
/* This rank wants item want_item[k] of rank want_rank[k], k < num_want, want_rank ascending. Received items come in that order.
 * The plan lives in arena. */
remap_status rm_plan_build(const rm_comm *comm, rm_arena *arena, int64_t num_want, const int *want_rank,
                           const rm_lid *want_item, const rm_plan **out);
/* The same plan with items under other numbers, new_of[item]. Not collective. Lives in arena, borrows from plan. NO_MEMORY. */
remap_status rm_plan_renumber(rm_arena *arena, const rm_plan *plan, const rm_lid *new_of, const rm_plan **out);
/* Move `size` bytes per item: item is indexed by send_item, received is [recv_offset[num_recv]]; buffer is scratch for
 * send_offset[num_send] items. Among neighbours only: returns as soon as this rank has sent and received. */
remap_status rm_plan_run(const rm_comm *comm, const rm_plan *plan, size_t size, const void *item, void *received, void *buffer);

/* What a rank tells another before, or in front of, the items that it sends. */
typedef struct rm_note {
  uint64_t mark;   /* says what is under way: the same at sender and receiver, if they agree */
  int32_t  status; /* remap_status of the sender                                             */
  int32_t  tag;    /* set by the room: of messages that follow this one                      */
  int64_t  more;   /* likewise: how many follow                                              */
} rm_note;

/* peers -- ranks whose calls meet: one's parent and children in a binary tree over all ranks, and those that messages come from
 * or go to. Being a peer is mutual. Read-only once built. */
typedef struct rm_peers {
  int        num;
  const int *rank; /* [num] ascending, without this rank */
} rm_peers;
/* The tree, and the neighbours of num_plans plans, which may be NULL. Not collective, but mutual if all ranks call it for the
 * same plans. Lives in arena. NO_MEMORY. */
remap_status rm_peers_build(rm_arena *arena, const rm_comm *comm, int num_plans, const rm_plan *const *plan,
                            const rm_peers **out);

/* parley -- before ranks go on together each tells its peers by a mark what it is about to do, and goes on only with those of
 * the same mark; the others are apart from it, as it is from them. So a call that differs between ranks is noticed at both
 * ends, and nobody waits for one that does something else. Its memory is taken once. */
typedef struct rm_parley {
  const rm_peers *peers;
  uint8_t        *is_apart;  /* [num] 1: said something else when the parley was last held */
  rm_note         said;
  char          (*heard)[1024]; /* [num] first messages                                    */
  MPI_Request    *request;   /* [2 num] of notes that come and go alone                      */
  bool            is_open;   /* notes are under way                                         */
} rm_parley;
/* Not collective. Lives in arena. NO_MEMORY. */
remap_status rm_parley_init(rm_arena *arena, const rm_peers *peers, rm_parley *out);
/* Tell all peers and hear them. By all ranks; waits for peers only. BAD_ARGUMENT if one is apart. */
remap_status rm_parley_hold(const rm_comm *comm, rm_parley *parley, uint64_t mark);
/* Tell those of the tree that are not apart how to go on, and hear them. By all ranks that go on; waits for these only.
 * BAD_ARGUMENT if one is apart from now on. */
remap_status rm_parley_confirm(const rm_comm *comm, rm_parley *parley, uint64_t mark);
/* Does everybody agree? By all ranks of one mark after a parley: *all is true on every rank of the communicator or on none of
 * those that call this; true if nobody is apart from anybody. */
remap_status rm_parley_all(const rm_comm *comm, const rm_parley *parley, bool *all);

/* flow -- a plan run in two steps, so that other work fits between, with a note in front of every message. Its memory is taken
 * once. rm_flow_post and rm_flow_wait involve neighbours only and take turns; a rank that failed posts all the same and says so
 * in its note, so nobody waits for ever. The first run of several opens a parley: it carries the notes, and those who are no
 * neighbours get one alone. The others leave out who is apart. */
typedef struct rm_flow {
  const rm_plan *plan;
  int            stream;   /* flows that are under way at once have different ones                         */
  size_t         most;     /* bytes per item that there is room for                                        */
  size_t         size;     /* bytes per item of the run under way                                          */
  int64_t        chunk;    /* bytes of one message to MPI at most                                          */
  char          *sent;     /* messages to others side by side, each a note and items                       */
  char         (*arrived)[1024]; /* [num_recv] first messages from others                                  */
  char          *received; /* [plan->recv_offset[plan->num_recv]] items of the last run, in the plan's order */
  MPI_Request   *first;    /* [num_recv] of first messages from others                                     */
  MPI_Request   *request;  /* of what follows those, [rest[i]] on from neighbour i, and of all that is sent */
  int           *rest;     /* [num_recv]                                                                   */
  int            num_requests; /* under way        */
  bool           is_under_way;
} rm_flow;

/* Room for runs of at most `most` bytes per item. Not collective. Lives in arena. NO_MEMORY. */
remap_status rm_flow_init(rm_arena *arena, const rm_plan *plan, int stream, size_t most, rm_flow *out);
/* The same into room of the caller's, [plan->recv_offset[plan->num_recv]] items at least. Items may be sent from there too,
 * under the numbers of their places: then those that this rank wants from itself are where they belong and stay. */
remap_status rm_flow_init_into(rm_arena *arena, const rm_plan *plan, int stream, size_t most, void *received, rm_flow *out);
/* Send `size` bytes of each item, indexed by the plan's send_item, behind this rank's note; items may be changed afterwards.
 * parley may be NULL: then everybody is there. */
remap_status rm_flow_post(const rm_comm *comm, rm_flow *flow, rm_parley *parley, bool opens, size_t size, const void *item,
                          rm_note note);
/* Wait until this rank has received and sent; flow->received then holds the items. The status in note becomes the greatest of
 * its own and the senders'. BAD_ARGUMENT if somebody turned out to be apart, or sends another number of items; items of such
 * are 0. */
remap_status rm_flow_wait(const rm_comm *comm, rm_flow *flow, rm_parley *parley, rm_note *note);

#endif
