/* parley -- ranks tell their peers what they are about to do. A note costs 24 bytes per peer; the question whether everybody
 * agrees goes up a binary tree and down again, 2 log2 P messages deep, along those of its edges whose ends said the same. */
#include "comm/comm_private.h"

#include <stdlib.h>
#include <string.h>

/* ---- peers -------------------------------------------------------------------------------------------------------- */

/* Parent and children in the tree; their number. */
static int tree_of(const rm_comm *comm, int rank[3])
{
  int num = 0;

  if (comm->rank > 0) rank[num++] = (comm->rank - 1) / 2;
  for (int64_t child = 2 * (int64_t)comm->rank + 1; child <= 2 * (int64_t)comm->rank + 2 && child < comm->size; child++)
    rank[num++] = (int)child;
  return num;
}

static int compare_ranks(const void *a, const void *b) { return *(const int *)a - *(const int *)b; }

remap_status rm_peers_build(rm_arena *arena, const rm_comm *comm, int num_plans, const rm_plan *const *plan,
                            const rm_peers **out)
{
  int64_t   most = 3;
  int       tree[3], num = 0, *rank;
  rm_peers *peers;

  for (int p = 0; p < num_plans; p++) most += plan[p] ? plan[p]->num_send + plan[p]->num_recv : 0;
  RM_NEW(peers, arena, 1);
  RM_NEW(rank, arena, most);
  most = tree_of(comm, tree);
  for (int k = 0; k < most; k++) rank[num++] = tree[k];
  for (int p = 0; p < num_plans; p++) {
    for (int i = 0; plan[p] && i < plan[p]->num_send; i++) rank[num++] = plan[p]->send_rank[i];
    for (int i = 0; plan[p] && i < plan[p]->num_recv; i++) rank[num++] = plan[p]->recv_rank[i];
  }
  if (num > 1) qsort(rank, (size_t)num, sizeof *rank, compare_ranks);
  *peers = (rm_peers){0, rank};
  for (int k = 0; k < num; k++) {
    const int next = rank[k];

    if (next != comm->rank && (peers->num == 0 || rank[peers->num - 1] != next)) rank[peers->num++] = next;
  }
  *out = peers;
  return REMAP_OK;
}

int rm_peers_find(const rm_peers *peers, int rank)
{
  int low = 0, high = peers->num;

  while (low < high) {
    const int mid = low + (high - low) / 2;

    if (peers->rank[mid] < rank)
      low = mid + 1;
    else
      high = mid;
  }
  RM_ASSERT(low < peers->num && peers->rank[low] == rank);
  return low;
}

/* ---- notes -------------------------------------------------------------------------------------------------------- */

remap_status rm_comm_wait(MPI_Request *request) { return rm_comm_status(MPI_Wait(request, MPI_STATUS_IGNORE)); }

/* Take one message and forget it. */
static remap_status take_away(rm_arena *scratch, const rm_comm *comm, int rank, int tag)
{
  MPI_Status status;
  int        bytes = 0;
  char      *data;

  RM_TRY(rm_comm_status(MPI_Probe(rank, tag, comm->mpi, &status)));
  RM_TRY(rm_comm_status(MPI_Get_count(&status, MPI_BYTE, &bytes)));
  RM_NEW(data, scratch, bytes);
  return rm_comm_status(MPI_Recv(data, bytes, MPI_BYTE, rank, tag, comm->mpi, MPI_STATUS_IGNORE));
}

remap_status rm_comm_drain(const rm_comm *comm, int rank, const rm_note *note)
{
  remap_status status = REMAP_OK;

  for (int64_t k = 0; k < note->more && status == REMAP_OK; k++) {
    rm_arena *scratch = rm_arena_new();

    status = scratch ? take_away(scratch, comm, rank, note->tag) : REMAP_NO_MEMORY;
    rm_arena_drop(scratch);
  }
  return status;
}

remap_status rm_parley_init(rm_arena *arena, const rm_peers *peers, rm_parley *out)
{
  rm_parley parley = {.peers = peers};

  RM_NEW0(parley.is_apart, arena, peers->num);
  RM_NEW(parley.heard, arena, peers->num);
  RM_NEW(parley.request, arena, 2 * (int64_t)peers->num);
  *out = parley;
  return REMAP_OK;
}

/* Is rank the next of an ascending list? Steps on if so. */
static bool is_next(int rank, int num, const int *list, int self, int *at)
{
  if (*at < num && list[*at] == self) ++*at;
  if (*at == num || list[*at] != rank) return false;
  ++*at;
  return true;
}

/* Listen to a peer, and tell it. */
static remap_status post_note(const rm_comm *comm, rm_parley *parley, int p, bool hears, bool says)
{
  const int    rank    = parley->peers->rank[p];
  MPI_Request *request = &parley->request[p];

  if (hears)
    RM_TRY(rm_comm_status(MPI_Irecv(parley->heard[p], RM_FIRST_BYTES, MPI_BYTE, rank, RM_TAG_FIRST, comm->mpi, request)));
  request += parley->peers->num;
  if (!says) return REMAP_OK;
  return rm_comm_status(MPI_Isend(&parley->said, (int)sizeof(rm_note), MPI_BYTE, rank, RM_TAG_FIRST, comm->mpi, request));
}

enum { SETTLED = 1, UNSETTLED = 2 };

remap_status rm_parley_part(const rm_comm *comm, rm_parley *parley, int p)
{
  parley->is_apart[p] = UNSETTLED;
  return rm_comm_status(MPI_Send(NULL, 0, MPI_BYTE, parley->peers->rank[p], RM_TAG_APART, comm->mpi));
}

remap_status rm_parley_settle(const rm_comm *comm, rm_parley *parley)
{
  for (int p = 0; p < parley->peers->num; p++) {
    if (parley->is_apart[p] != UNSETTLED) continue;
    RM_TRY(rm_comm_status(MPI_Recv(NULL, 0, MPI_BYTE, parley->peers->rank[p], RM_TAG_APART, comm->mpi, MPI_STATUS_IGNORE)));
    parley->is_apart[p] = SETTLED;
  }
  return REMAP_OK;
}

/* Wait for both; BAD_ARGUMENT if it says something else. */
static remap_status wait_note(const rm_comm *comm, rm_parley *parley, int p)
{
  const bool hears = parley->request[p] != MPI_REQUEST_NULL;
  rm_note    theirs;

  RM_TRY(rm_comm_wait(&parley->request[p]));
  RM_TRY(rm_comm_wait(&parley->request[parley->peers->num + p]));
  if (!hears) return REMAP_OK;
  memcpy(&theirs, parley->heard[p], sizeof theirs);
  if (theirs.mark == parley->said.mark) return REMAP_OK;
  RM_TRY(rm_comm_drain(comm, parley->peers->rank[p], &theirs));
  RM_TRY(rm_parley_part(comm, parley, p));
  return REMAP_BAD_ARGUMENT;
}

void rm_parley_clear(rm_parley *parley)
{
  for (int p = 0; p < parley->peers->num; p++) parley->is_apart[p] = 0;
}

remap_status rm_parley_post(const rm_comm *comm, rm_parley *parley, const rm_plan *plan, rm_note note)
{
  const rm_peers *peers = parley->peers;
  int             from = 0, to = 0;

  RM_ASSERT(!parley->is_open);
  note.more       = 0;
  parley->said    = note;
  parley->is_open = true;
  for (int p = 0; p < 2 * peers->num; p++) parley->request[p] = MPI_REQUEST_NULL;
  for (int p = 0; p < peers->num; p++) {
    const bool brings = plan && is_next(peers->rank[p], plan->num_recv, plan->recv_rank, comm->rank, &from);
    const bool takes  = plan && is_next(peers->rank[p], plan->num_send, plan->send_rank, comm->rank, &to);

    if (!parley->is_apart[p]) RM_TRY(post_note(comm, parley, p, !brings, !takes));
  }
  return REMAP_OK;
}

remap_status rm_parley_wait(const rm_comm *comm, rm_parley *parley)
{
  remap_status mine = REMAP_OK;

  parley->is_open = false;
  for (int p = 0; p < parley->peers->num; p++) {
    const remap_status heard = wait_note(comm, parley, p);

    if (heard > mine) mine = heard;
  }
  return mine;
}

remap_status rm_parley_hold(const rm_comm *comm, rm_parley *parley, uint64_t mark)
{
  rm_parley_clear(parley);
  RM_TRY(rm_parley_post(comm, parley, NULL, (rm_note){mark, REMAP_OK, 0, 0}));
  const remap_status status = rm_parley_wait(comm, parley);
  RM_TRY(rm_parley_settle(comm, parley));
  return status;
}

remap_status rm_parley_confirm(const rm_comm *comm, rm_parley *parley, uint64_t mark)
{
  const rm_peers *peers = parley->peers;
  const rm_note   note  = {mark, REMAP_OK, 0, 0};
  int             tree[3], place[3], num = tree_of(comm, tree);
  remap_status    mine = REMAP_OK;

  for (int p = 0; p < 2 * peers->num; p++) parley->request[p] = MPI_REQUEST_NULL;
  parley->said = note;
  for (int k = 0; k < num; k++) {
    place[k] = rm_peers_find(peers, tree[k]);
    if (!parley->is_apart[place[k]]) RM_TRY(post_note(comm, parley, place[k], true, true));
  }
  for (int k = 0; k < num; k++) {
    const remap_status heard = wait_note(comm, parley, place[k]);

    if (heard > mine) mine = heard;
  }
  RM_TRY(rm_parley_settle(comm, parley));
  return mine;
}

/* ---- everybody ---------------------------------------------------------------------------------------------------- */

static remap_status hear(const rm_comm *comm, int rank, int *word)
{
  return rm_comm_status(MPI_Recv(word, 1, MPI_INT, rank, RM_TAG_TREE, comm->mpi, MPI_STATUS_IGNORE));
}

static remap_status tell(const rm_comm *comm, int rank, int word)
{
  return rm_comm_status(MPI_Send(&word, 1, MPI_INT, rank, RM_TAG_TREE, comm->mpi));
}

remap_status rm_parley_all(const rm_comm *comm, const rm_parley *parley, bool *all)
{
  const rm_peers *peers = parley->peers;
  int             tree[3], word = 1, theirs;
  const int       num = tree_of(comm, tree);

  for (int p = 0; p < peers->num; p++) word &= !parley->is_apart[p];
  for (int k = comm->rank > 0; k < num; k++) {
    if (parley->is_apart[rm_peers_find(peers, tree[k])]) continue;
    RM_TRY(hear(comm, tree[k], &theirs));
    word &= theirs;
  }
  if (comm->rank > 0 && !parley->is_apart[rm_peers_find(peers, tree[0])]) {
    RM_TRY(tell(comm, tree[0], word));
    RM_TRY(hear(comm, tree[0], &word));
  }
  for (int k = comm->rank > 0; k < num; k++)
    if (!parley->is_apart[rm_peers_find(peers, tree[k])]) RM_TRY(tell(comm, tree[k], word));
  *all = word != 0;
  return REMAP_OK;
}
