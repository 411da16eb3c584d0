/* flow -- an exchange among neighbours in two steps. Everything is posted at once, what is sent and what is expected: a first
 * message per neighbour with a note, and the items if they are few; else the items by themselves. A neighbour that has another
 * run in mind is known by its note: then what was expected of it is called off, and what it sent taken away. What a rank wants
 * from itself is copied. O(data) time; memory for what is sent, the first messages, and the items in the plan's order. */
#include "comm/comm_private.h"

#include <string.h>

enum { NOTE = sizeof(rm_note), SPARE = 8 }; /* bytes behind what was received: readers may take numbers in twos */

/* Messages that follow a first one of so many bytes of items, and the length of that. */
static int64_t num_pieces(int64_t bytes, int64_t chunk)
{
  return bytes > RM_FIRST_BYTES - NOTE || (bytes > 0 && bytes > chunk - NOTE) ? (bytes - 1) / chunk + 1 : 0;
}
static int first_bytes(int64_t bytes, int64_t chunk) { return num_pieces(bytes, chunk) > 0 ? NOTE : NOTE + (int)bytes; }

/* Length of the piece that starts so many bytes into the items. */
static int piece_bytes(int64_t bytes, int64_t done, int64_t chunk)
{
  return (int)(bytes - done < chunk ? bytes - done : chunk);
}

/* Where the message to neighbour i starts among those side by side, this rank's own left out; and the bytes of a neighbour's
 * items. */
static int64_t start_of(const rm_plan *plan, int i, size_t size)
{
  const int64_t *offset = plan->send_offset, own = plan->own_send;
  const int64_t  left_out = own >= 0 && own < i ? offset[own + 1] - offset[own] : 0;

  return rm_add_sat(rm_mul_sat(offset[i] - left_out, (int64_t)size), (int64_t)i * NOTE);
}
static int64_t bytes_of(const int64_t *offset, int i, size_t size)
{
  return rm_mul_sat(offset[i + 1] - offset[i], (int64_t)size);
}

/* As rm_flow_init_into, unless received is NULL: then as rm_flow_init. */
static remap_status init(rm_arena *arena, int64_t chunk, const rm_plan *plan, int stream, size_t most, void *received,
                         rm_flow *out)
{
  int64_t num_requests = plan->num_send;
  rm_flow flow         = {.plan = plan, .stream = stream, .most = most, .chunk = chunk, .received = received};

  RM_ASSERT(sizeof *flow.arrived == RM_FIRST_BYTES);
  for (int i = 0; i < plan->num_send; i++)
    num_requests = rm_add_sat(num_requests, num_pieces(bytes_of(plan->send_offset, i, most), chunk));
  for (int i = 0; i < plan->num_recv; i++)
    num_requests = rm_add_sat(num_requests, num_pieces(bytes_of(plan->recv_offset, i, most), chunk));
  RM_NEW(flow.sent, arena, start_of(plan, plan->num_send, most));
  RM_NEW(flow.arrived, arena, plan->num_recv);
  if (!received) RM_NEW(flow.received, arena, rm_add_sat(rm_mul_sat(plan->recv_offset[plan->num_recv], (int64_t)most), SPARE));
  RM_NEW(flow.first, arena, plan->num_recv);
  RM_NEW(flow.rest, arena, plan->num_recv);
  RM_NEW(flow.request, arena, num_requests);
  *out = flow;
  return REMAP_OK;
}

remap_status rm_flow_init_chunked(rm_arena *arena, int64_t chunk, const rm_plan *plan, int stream, size_t most, rm_flow *out)
{
  return init(arena, chunk, plan, stream, most, NULL, out);
}

remap_status rm_flow_init(rm_arena *arena, const rm_plan *plan, int stream, size_t most, rm_flow *out)
{
  return init(arena, RM_COMM_CHUNK, plan, stream, most, NULL, out);
}

remap_status rm_flow_init_into(rm_arena *arena, const rm_plan *plan, int stream, size_t most, void *received, rm_flow *out)
{
  return init(arena, RM_COMM_CHUNK, plan, stream, most, received, out);
}

/* Items wanted by neighbour i of a plan, one after the other: those that stand one after the other are copied at once. */
static void gather(const rm_plan *plan, int i, size_t size, const char *item, char *to)
{
  const rm_lid *wanted = plan->send_item + plan->send_offset[i];
  const int64_t num    = plan->send_offset[i + 1] - plan->send_offset[i];

  for (int64_t k = 0, end; k < num; k = end) {
    const char *from = item + (size_t)wanted[k] * size;

    for (end = k + 1; end < num && wanted[end] == wanted[end - 1] + 1; end++) continue;
    if (end == k + 1 && size == 8)
      memcpy(to + (size_t)k * size, from, 8); /* a copy of known size is a single move */
    else
      memcpy(to + (size_t)k * size, from, (size_t)(end - k) * size);
  }
}

static bool is_apart(const rm_parley *parley, int rank)
{
  return parley && parley->is_apart[rm_peers_find(parley->peers, rank)];
}

/* The tag of what follows a first message: others that are under way, or that a neighbour has in mind, have another one. */
static int tag_of(const rm_flow *flow, uint64_t mark)
{
  return RM_TAG_REST + 2 * (int)(mark % 8192) + flow->stream; /* MPI promises 32767 */
}

/* Where the items of neighbour i go. */
static char *place_of(const rm_flow *flow, int i) { return flow->received + flow->plan->recv_offset[i] * (int64_t)flow->size; }

/* Post the items of one message in pieces, to or from a rank. */
static remap_status post_pieces(const rm_comm *comm, rm_flow *flow, bool is_send, int rank, int tag, char *at, int64_t bytes)
{
  for (int64_t done = 0; num_pieces(bytes, flow->chunk) > 0 && done < bytes; done += flow->chunk) {
    const int    n       = piece_bytes(bytes, done, flow->chunk);
    MPI_Request *request = &flow->request[flow->num_requests];

    RM_TRY(rm_comm_status(is_send ? MPI_Isend(at + done, n, MPI_BYTE, rank, tag, comm->mpi, request)
                                  : MPI_Irecv(at + done, n, MPI_BYTE, rank, tag, comm->mpi, request)));
    flow->num_requests++;
  }
  return REMAP_OK;
}

/* Expect neighbour i's message. */
static remap_status expect(const rm_comm *comm, rm_flow *flow, const rm_parley *parley, int i, uint64_t mark)
{
  const int rank = flow->plan->recv_rank[i];

  flow->first[i] = MPI_REQUEST_NULL;
  flow->rest[i]  = flow->num_requests;
  if (i == flow->plan->own_recv || is_apart(parley, rank)) return REMAP_OK;
  RM_TRY(rm_comm_status(MPI_Irecv(flow->arrived[i], RM_FIRST_BYTES, MPI_BYTE, rank, RM_TAG_FIRST, comm->mpi, &flow->first[i])));
  return post_pieces(comm, flow, false, rank, tag_of(flow, mark), place_of(flow, i),
                     bytes_of(flow->plan->recv_offset, i, flow->size));
}

/* Send neighbour i its message. */
static remap_status send(const rm_comm *comm, rm_flow *flow, const rm_parley *parley, int i, const char *item, rm_note note)
{
  const rm_plan *plan  = flow->plan;
  const int      rank  = plan->send_rank[i];
  const int64_t  bytes = bytes_of(plan->send_offset, i, flow->size);
  char          *at    = flow->sent + start_of(plan, i, flow->size);

  if (is_apart(parley, rank)) return REMAP_OK;
  note.tag  = tag_of(flow, note.mark);
  note.more = num_pieces(bytes, flow->chunk);
  memcpy(at, &note, NOTE);
  gather(plan, i, flow->size, item, at + NOTE);
  RM_TRY(rm_comm_status(MPI_Isend(at, first_bytes(bytes, flow->chunk), MPI_BYTE, rank, RM_TAG_FIRST, comm->mpi,
                                  &flow->request[flow->num_requests])));
  flow->num_requests++;
  return post_pieces(comm, flow, true, rank, note.tag, at + NOTE, bytes);
}

/* Items that this rank wants from itself, unless they are there. */
static void keep_own(rm_flow *flow, const char *item)
{
  const rm_plan *plan = flow->plan;

  if (plan->own_send >= 0 && item != flow->received)
    gather(plan, plan->own_send, flow->size, item, place_of(flow, plan->own_recv));
}

remap_status rm_flow_post(const rm_comm *comm, rm_flow *flow, rm_parley *parley, bool opens, size_t size, const void *item,
                          rm_note note)
{
  const rm_plan *plan = flow->plan;

  RM_ASSERT(size <= flow->most && !flow->is_under_way);
  flow->size         = size;
  flow->is_under_way = true;
  if (opens) {
    rm_parley_clear(parley);
    RM_TRY(rm_parley_post(comm, parley, plan, note));
  }
  for (int i = 0; i < plan->num_recv; i++) RM_TRY(expect(comm, flow, parley, i, note.mark));
  for (int i = 0; i < plan->num_send; i++)
    if (i != plan->own_send) RM_TRY(send(comm, flow, parley, i, item, note));
  keep_own(flow, item);
  return REMAP_OK;
}

/* Listen to a neighbour's first message: if it is apart that is noted, what it was expected to send called off, and what it did
 * send taken away. */
static remap_status hear(const rm_comm *comm, rm_flow *flow, rm_parley *parley, int i, rm_note *note)
{
  const int     rank  = flow->plan->recv_rank[i];
  const int64_t bytes = bytes_of(flow->plan->recv_offset, i, flow->size), pieces = num_pieces(bytes, flow->chunk);
  rm_note       theirs;

  RM_TRY(rm_comm_wait(&flow->first[i]));
  memcpy(&theirs, flow->arrived[i], NOTE);
  if (theirs.mark == note->mark && theirs.more == pieces) {
    if (theirs.status > note->status) note->status = theirs.status;
    if (pieces == 0 && bytes > 0) memcpy(place_of(flow, i), flow->arrived[i] + NOTE, (size_t)bytes);
    return REMAP_OK;
  }
  for (int64_t k = flow->rest[i]; k < flow->rest[i] + pieces; k++) {
    RM_TRY(rm_comm_status(MPI_Cancel(&flow->request[k])));
    RM_TRY(rm_comm_wait(&flow->request[k]));
  }
  if (bytes > 0) memset(place_of(flow, i), 0, (size_t)bytes);
  RM_TRY(rm_comm_drain(comm, rank, &theirs));
  if (parley) RM_TRY(rm_parley_part(comm, parley, rm_peers_find(parley->peers, rank)));
  return REMAP_BAD_ARGUMENT;
}

remap_status rm_flow_wait(const rm_comm *comm, rm_flow *flow, rm_parley *parley, rm_note *note)
{
  remap_status mine = parley && parley->is_open ? rm_parley_wait(comm, parley) : REMAP_OK;

  flow->is_under_way = false;
  for (int i = 0; i < flow->plan->num_recv && mine <= REMAP_BAD_ARGUMENT; i++) {
    const remap_status heard = flow->first[i] == MPI_REQUEST_NULL ? REMAP_OK : hear(comm, flow, parley, i, note);

    if (heard > mine) mine = heard;
  }
  for (int k = 0; k < flow->num_requests; k++) RM_TRY(rm_comm_wait(&flow->request[k]));
  flow->num_requests = 0;
  if (parley) RM_TRY(rm_parley_settle(comm, parley));
  return mine;
}
