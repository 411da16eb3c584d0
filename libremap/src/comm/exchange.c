/* exchange -- arrays from every rank to every other, and among neighbours again and again. Messages are point to point, cut
 * into chunks that int can count; pairs of ranks with nothing to say exchange nothing.
 *
 * Rank r meets the others in rounds of WINDOW partners: in round k it sends to r + k WINDOW + 0, 1, ... and receives from
 * r - k WINDOW - 0, 1, ..., one chunk each at a time, and then waits. A chunk has the same (round, place in the message) on
 * both sides, so the rank that is furthest behind can always go on and nobody waits for ever. O(data) time besides one exchange
 * of counts; no memory besides what is received. */
#include "comm/comm_private.h"

#include <string.h>

enum { WINDOW = 32, TAG_EXCHANGE = 1, TAG_PLAN = 2 };

/* A message under way, of which `left` bytes from `at` on are not posted yet. */
typedef struct message {
  char   *at;
  int64_t left;
  int     rank;
} message;

static message message_of(const void *data, int64_t size, int64_t first, int64_t end, int rank)
{
  return (message){(char *)(uintptr_t)data + first * size, (end - first) * size, rank};
}

/* Post the next chunk of a message, if one is left. */
static remap_status post(const rm_comm *comm, int64_t chunk, message *m, bool is_send, int tag, MPI_Request *request, int *num)
{
  const int bytes = (int)(m->left < chunk ? m->left : chunk);

  if (bytes == 0) return REMAP_OK;
  if (is_send)
    RM_TRY(rm_comm_status(MPI_Isend(m->at, bytes, MPI_BYTE, m->rank, tag, comm->mpi, &request[*num])));
  else
    RM_TRY(rm_comm_status(MPI_Irecv(m->at, bytes, MPI_BYTE, m->rank, tag, comm->mpi, &request[*num])));
  m->at += bytes;
  m->left -= bytes;
  ++*num;
  return REMAP_OK;
}

/* One round of rm_comm_exchange: partners at distance first, first + 1, ... below end. */
static remap_status exchange_round(const rm_comm *comm, int64_t chunk, int first, int end, int64_t size,
                                   const int64_t *send_offset, const void *send, const int64_t *recv_offset, void *recv)
{
  message     to[WINDOW], from[WINDOW];
  MPI_Request request[2 * WINDOW];
  int         num;

  for (int k = first; k < end; k++) {
    const int dst = (int)(((int64_t)comm->rank + k) % comm->size);
    const int src = (int)(((int64_t)comm->rank + comm->size - k) % comm->size);

    to[k - first]   = message_of(send, size, send_offset[dst], send_offset[dst + 1], dst);
    from[k - first] = message_of(recv, size, recv_offset[src], recv_offset[src + 1], src);
  }
  do {
    num = 0;
    for (int i = 0; i < end - first; i++) RM_TRY(post(comm, chunk, &from[i], false, TAG_EXCHANGE, request, &num));
    for (int i = 0; i < end - first; i++) RM_TRY(post(comm, chunk, &to[i], true, TAG_EXCHANGE, request, &num));
    RM_TRY(rm_comm_status(MPI_Waitall(num, request, MPI_STATUSES_IGNORE)));
  } while (num > 0);
  return REMAP_OK;
}

remap_status rm_comm_exchange_chunked(const rm_comm *comm, int64_t chunk, rm_arena *arena, size_t size,
                                      const int64_t *send_offset, const void *send, int64_t *recv_offset, void **recv)
{
  const int64_t bytes = (int64_t)size;
  const int     me    = comm->rank;
  int64_t       total, own;
  char         *data;

  for (int r = 0; r < comm->size; r++) RM_ASSERT(send_offset[r] <= send_offset[r + 1]);
  RM_TRY(rm_comm_counts(comm, send_offset, recv_offset));
  total = rm_offsets(recv_offset, comm->size);
  data  = rm_arena_alloc(arena, total, size);
  RM_TRY(rm_comm_agree(comm, data ? REMAP_OK : REMAP_NO_MEMORY, NULL)); /* keeps the counts of two exchanges apart, too */
  *recv = data;

  own = send_offset[me + 1] - send_offset[me];
  if (own > 0) memcpy(data + recv_offset[me] * bytes, (const char *)send + send_offset[me] * bytes, (size_t)(own * bytes));
  for (int first = 1; first < comm->size; first += WINDOW) {
    const int end = first < comm->size - WINDOW ? first + WINDOW : comm->size;

    RM_TRY(exchange_round(comm, chunk, first, end, bytes, send_offset, send, recv_offset, data));
  }
  return REMAP_OK;
}

remap_status rm_comm_exchange(const rm_comm *comm, rm_arena *arena, size_t size, const int64_t *send_offset, const void *send,
                              int64_t *recv_offset, void **recv)
{
  return rm_comm_exchange_chunked(comm, RM_COMM_CHUNK, arena, size, send_offset, send, recv_offset, recv);
}

/* The ranks with items, ascending, and the offsets of their items and of the end: [*num] and [*num + 1] in arena, however many
 * ranks there are. Not collective. */
static remap_status keep_neighbours(rm_arena *arena, int num_ranks, const int64_t *offset, int *num, const int **rank,
                                    const int64_t **kept)
{
  int     *own_rank, n = 0;
  int64_t *own_offset;

  for (int r = 0; r < num_ranks; r++) n += offset[r] < offset[r + 1];
  RM_NEW(own_rank, arena, n);
  RM_NEW(own_offset, arena, (int64_t)n + 1);
  *num = n;
  n    = 0;
  for (int r = 0; r < num_ranks; r++) {
    if (offset[r] == offset[r + 1]) continue;
    own_rank[n]     = r;
    own_offset[n++] = offset[r];
  }
  own_offset[n] = offset[num_ranks];
  *rank         = own_rank;
  *kept         = own_offset;
  return REMAP_OK;
}

static int place_of(int wanted, int num, const int *rank)
{
  int i = 0;

  while (i < num && rank[i] != wanted) i++;
  return i < num ? i : -1;
}

/* The plan out of how much is wanted of each rank, and by each. Not collective. */
static remap_status shorten(rm_arena *arena, const rm_comm *comm, const int64_t *recv_offset, const int64_t *send_offset,
                            rm_plan *plan)
{
  RM_TRY(keep_neighbours(arena, comm->size, recv_offset, &plan->num_recv, &plan->recv_rank, &plan->recv_offset));
  RM_TRY(keep_neighbours(arena, comm->size, send_offset, &plan->num_send, &plan->send_rank, &plan->send_offset));
  plan->own_send = place_of(comm->rank, plan->num_send, plan->send_rank);
  plan->own_recv = place_of(comm->rank, plan->num_recv, plan->recv_rank);
  RM_NEW(plan->request, arena, (int64_t)plan->num_send + plan->num_recv);
  return REMAP_OK;
}

remap_status rm_plan_build(const rm_comm *comm, rm_arena *arena, int64_t num_want, const int *want_rank,
                           const rm_lid *want_item, const rm_plan **out)
{
  rm_arena    *scratch     = rm_arena_new();
  rm_plan     *plan        = rm_arena_zero(arena, 1, sizeof *plan);
  int64_t     *recv_offset = scratch ? rm_arena_zero(scratch, (int64_t)comm->size + 1, sizeof *recv_offset) : NULL;
  int64_t     *send_offset = scratch ? rm_arena_zero(scratch, (int64_t)comm->size + 1, sizeof *send_offset) : NULL;
  void        *asked       = NULL;
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(comm, plan && recv_offset && send_offset ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(plan && recv_offset && send_offset);
  for (int64_t k = 0; k < num_want; k++) {
    RM_ASSERT(want_rank[k] >= 0 && want_rank[k] < comm->size && (k == 0 || want_rank[k - 1] <= want_rank[k]));
    recv_offset[want_rank[k]]++;
  }
  rm_offsets(recv_offset, comm->size);
  RM_GOTO(done, status = rm_comm_exchange(comm, arena, sizeof *want_item, recv_offset, want_item, send_offset, &asked));
  plan->send_item = asked;
  status          = shorten(arena, comm, recv_offset, send_offset, plan);
  RM_GOTO(done, status = rm_comm_agree(comm, status, NULL));
  *out = plan;
done:
  rm_arena_drop(scratch);
  return status;
}

remap_status rm_plan_renumber(rm_arena *arena, const rm_plan *plan, const rm_lid *new_of, const rm_plan **out)
{
  const int64_t num = plan->send_offset[plan->num_send];
  rm_plan      *renumbered;
  rm_lid       *item;

  RM_NEW(renumbered, arena, 1);
  RM_NEW(item, arena, num);
  for (int64_t k = 0; k < num; k++) item[k] = new_of[plan->send_item[k]];
  *renumbered           = *plan;
  renumbered->send_item = item;
  *out                  = renumbered;
  return REMAP_OK;
}

/* The items to send, gathered in the plan's order. */
static void pack(const rm_plan *plan, size_t size, const char *item, char *buffer)
{
  const int64_t num = plan->send_offset[plan->num_send];

  if (size == 8) /* one number per item: by far the most frequent; a copy of known size is a single move */
    for (int64_t k = 0; k < num; k++) memcpy(buffer + 8 * k, item + 8 * (int64_t)plan->send_item[k], 8);
  else
    for (int64_t k = 0; k < num; k++) memcpy(buffer + (size_t)k * size, item + (size_t)plan->send_item[k] * size, size);
}

/* Post the chunk that starts `at` bytes into each message to or from the ranks of a plan; *largest grows to the longest. */
static remap_status post_all(const rm_comm *comm, int64_t chunk, int64_t at, int num_ranks, const int *rank,
                             const int64_t *offset, const void *data, int64_t size, bool is_send, MPI_Request *request,
                             int *num, int64_t *largest)
{
  for (int i = 0; i < num_ranks; i++) {
    message m = message_of(data, size, offset[i], offset[i + 1], rank[i]);

    if (m.left > *largest) *largest = m.left;
    if (m.left <= at) continue;
    m.at += at;
    m.left -= at;
    RM_TRY(post(comm, chunk, &m, is_send, TAG_PLAN, request, num));
  }
  return REMAP_OK;
}

remap_status rm_plan_run_chunked(const rm_comm *comm, int64_t chunk, const rm_plan *plan, size_t size, const void *item,
                                 void *received, void *buffer)
{
  const int64_t bytes   = (int64_t)size;
  int64_t       largest = 0; /* message, in bytes */

  pack(plan, size, item, buffer);
  for (int64_t at = 0; at == 0 || at < largest; at += chunk) { /* every neighbour at once, chunk by chunk */
    int num = 0;

    RM_TRY(post_all(comm, chunk, at, plan->num_recv, plan->recv_rank, plan->recv_offset, received, bytes, false, plan->request,
                    &num, &largest));
    RM_TRY(post_all(comm, chunk, at, plan->num_send, plan->send_rank, plan->send_offset, buffer, bytes, true, plan->request,
                    &num, &largest));
    RM_TRY(rm_comm_status(MPI_Waitall(num, plan->request, MPI_STATUSES_IGNORE)));
  }
  return REMAP_OK;
}

remap_status rm_plan_run(const rm_comm *comm, const rm_plan *plan, size_t size, const void *item, void *received, void *buffer)
{
  return rm_plan_run_chunked(comm, RM_COMM_CHUNK, plan, size, item, received, buffer);
}
