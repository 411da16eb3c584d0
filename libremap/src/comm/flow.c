/* flow -- an exchange among neighbours in two steps. All chunks of all messages are posted at once; what a rank wants from
 * itself is copied. O(data) time; memory for what is sent, what arrives, and the items in the plan's order. */
#include "comm/comm_private.h"

#include <string.h>

enum { TAG_FLOW = 3 };

/* Chunks of a message of `items` items of at most `size` bytes. */
static int64_t num_chunks(int64_t items, size_t size, int64_t chunk)
{
  return (rm_add_sat(rm_mul_sat(items, (int64_t)size), sizeof(rm_note)) - 1) / chunk + 1;
}

remap_status rm_flow_init_chunked(rm_arena *arena, int64_t chunk, const rm_plan *plan, size_t most, rm_flow *out)
{
  const int64_t notes  = (int64_t)sizeof(rm_note);
  const int64_t to_all = plan->send_offset[plan->num_send], from_all = plan->recv_offset[plan->num_recv];
  int64_t       num_requests = 0;
  rm_flow       flow         = {.plan = plan, .most = most, .chunk = chunk};

  for (int i = 0; i < plan->num_send; i++)
    num_requests += num_chunks(plan->send_offset[i + 1] - plan->send_offset[i], most, chunk);
  for (int i = 0; i < plan->num_recv; i++)
    num_requests += num_chunks(plan->recv_offset[i + 1] - plan->recv_offset[i], most, chunk);
  RM_NEW(flow.sent, arena, rm_add_sat(rm_mul_sat(to_all, (int64_t)most), notes * plan->num_send));
  RM_NEW(flow.arrived, arena, rm_add_sat(rm_mul_sat(from_all, (int64_t)most), notes * plan->num_recv));
  RM_NEW(flow.received, arena, rm_mul_sat(from_all, (int64_t)most));
  RM_NEW(flow.request, arena, num_requests);
  RM_NEW(flow.status, arena, num_requests);
  *out = flow;
  return REMAP_OK;
}

remap_status rm_flow_init(rm_arena *arena, const rm_plan *plan, size_t most, rm_flow *out)
{
  return rm_flow_init_chunked(arena, RM_COMM_CHUNK, plan, most, out);
}

/* Where the message of neighbour i starts among those side by side. */
static int64_t start_of(const int64_t *offset, int i, size_t size)
{
  return offset[i] * (int64_t)size + i * (int64_t)sizeof(rm_note);
}

/* Items wanted by neighbour i of a plan, one after the other. */
static void gather(const rm_plan *plan, int i, size_t size, const char *item, char *to)
{
  const int64_t first = plan->send_offset[i], num = plan->send_offset[i + 1] - first;

  if (size == 8) /* a copy of known size is a single move */
    for (int64_t k = 0; k < num; k++) memcpy(to + 8 * k, item + 8 * (int64_t)plan->send_item[first + k], 8);
  else
    for (int64_t k = 0; k < num; k++) memcpy(to + (size_t)k * size, item + (size_t)plan->send_item[first + k] * size, size);
}

/* Post one message, chunk by chunk. */
static remap_status post(const rm_comm *comm, rm_flow *flow, bool is_send, int rank, char *at, int64_t bytes)
{
  for (int64_t done = 0; done < bytes; done += flow->chunk) {
    const int    n       = (int)(bytes - done < flow->chunk ? bytes - done : flow->chunk);
    MPI_Request *request = &flow->request[flow->num_requests];

    RM_TRY(rm_comm_status(is_send ? MPI_Isend(at + done, n, MPI_BYTE, rank, TAG_FLOW, comm->mpi, request)
                                  : MPI_Irecv(at + done, n, MPI_BYTE, rank, TAG_FLOW, comm->mpi, request)));
    flow->num_requests++;
  }
  return REMAP_OK;
}

/* Where in received the items from this rank itself go; NULL if it wants none. */
static char *own_place(const rm_comm *comm, const rm_flow *flow)
{
  for (int i = 0; i < flow->plan->num_recv; i++)
    if (flow->plan->recv_rank[i] == comm->rank) return flow->received + flow->plan->recv_offset[i] * (int64_t)flow->size;
  return NULL;
}

remap_status rm_flow_post(const rm_comm *comm, rm_flow *flow, size_t size, const void *item, rm_note note)
{
  const rm_plan *plan = flow->plan;

  RM_ASSERT(size <= flow->most && flow->num_requests == 0);
  flow->size = size;
  for (int i = 0; i < plan->num_recv; i++) {
    const int64_t first = start_of(plan->recv_offset, i, size), end = start_of(plan->recv_offset, i + 1, size);

    if (plan->recv_rank[i] != comm->rank)
      RM_TRY(post(comm, flow, false, plan->recv_rank[i], flow->arrived + first, end - first));
  }
  for (int i = 0; i < plan->num_send; i++) {
    const int64_t first = start_of(plan->send_offset, i, size), end = start_of(plan->send_offset, i + 1, size);

    if (plan->send_rank[i] == comm->rank) {
      gather(plan, i, size, item, own_place(comm, flow));
      continue;
    }
    memcpy(flow->sent + first, &note, sizeof note);
    gather(plan, i, size, item, flow->sent + first + sizeof note);
    RM_TRY(post(comm, flow, true, plan->send_rank[i], flow->sent + first, end - first));
  }
  return REMAP_OK;
}

/* A message longer than expected comes of a sender that has another run in mind. */
static remap_status wait_all(rm_flow *flow)
{
  const int    num    = flow->num_requests;
  const int    error  = MPI_Waitall(num, flow->request, flow->status);
  remap_status status = rm_comm_status(error);
  int          class  = MPI_SUCCESS;

  flow->num_requests = 0;
  if (error != MPI_SUCCESS) MPI_Error_class(error, &class);
  for (int i = 0; i < num && class == MPI_ERR_IN_STATUS; i++) {
    int own = MPI_SUCCESS;

    MPI_Error_class(flow->status[i].MPI_ERROR, &own);
    if (own == MPI_ERR_TRUNCATE) status = REMAP_BAD_ARGUMENT;
    else if (own != MPI_SUCCESS && own != MPI_ERR_PENDING) return REMAP_MPI_FAILURE;
  }
  return status;
}

remap_status rm_flow_wait(const rm_comm *comm, rm_flow *flow, rm_note *note)
{
  const rm_plan *plan = flow->plan;
  remap_status   mine = wait_all(flow);

  if (mine != REMAP_OK) return mine;
  for (int i = 0; i < plan->num_recv; i++) {
    const char   *message = flow->arrived + start_of(plan->recv_offset, i, flow->size);
    const int64_t first = plan->recv_offset[i], num_items = plan->recv_offset[i + 1] - first;
    rm_note       theirs;

    if (plan->recv_rank[i] == comm->rank) continue;
    memcpy(&theirs, message, sizeof theirs);
    memcpy(flow->received + (size_t)first * flow->size, message + sizeof theirs, (size_t)num_items * flow->size);
    if (theirs.mark != note->mark) mine = REMAP_BAD_ARGUMENT;
    if (theirs.status > note->status) note->status = theirs.status;
  }
  return mine;
}
