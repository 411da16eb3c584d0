/* counts -- how much every rank is about to send to every other, told only where there is something to tell: non-blocking
 * consensus (Hoefler, Siebert and Lumsdaine, 2010).
 *
 * A rank tells whom it sends to by synchronous messages, which are complete when they are matched, listens to whoever tells it,
 * and enters a barrier when all its own are heard. The barrier is complete when every rank has entered it, so when nothing is
 * under way any more. A message of 8 bytes for each pair of ranks with something to say, and log2 P steps of the barrier; an
 * exchange of all counts would be 8 bytes for every pair of ranks. What comes out does not depend on the order of arrival. */
#include "comm/comm_private.h"

#include <string.h>

enum { WINDOW = 32, TAG_COUNT = 6 };

/* What this rank has to tell: WINDOW messages under way at most. */
typedef struct telling {
  const int64_t *send_offset;
  int            distance;         /* upwards to the next rank that may have to be told */
  int64_t        word[WINDOW];     /* under way                                         */
  MPI_Request    request[WINDOW];  /* null: free                                        */
} telling;

/* Items for the rank at that distance. */
static int64_t num_items(const rm_comm *comm, const int64_t *send_offset, int distance, int *rank)
{
  *rank = (int)(((int64_t)comm->rank + distance) % comm->size);
  return send_offset[*rank + 1] - send_offset[*rank];
}

/* Tell the next ones, as far as there are free places; *done: nothing is left to tell, and everything was heard. */
static remap_status tell(const rm_comm *comm, telling *t, bool *done)
{
  int heard = 0;

  for (int i = 0; i < WINDOW; i++) {
    int rank = 0;

    if (t->request[i] != MPI_REQUEST_NULL) continue;
    while (t->distance < comm->size && num_items(comm, t->send_offset, t->distance, &rank) == 0) t->distance++;
    if (t->distance >= comm->size) break;
    t->word[i] = num_items(comm, t->send_offset, t->distance++, &rank);
    RM_TRY(rm_comm_status(MPI_Issend(&t->word[i], 1, MPI_INT64_T, rank, TAG_COUNT, comm->mpi, &t->request[i])));
  }
  for (int i = 0; i < WINDOW; i++) {
    int flag = 1;

    if (t->request[i] != MPI_REQUEST_NULL) RM_TRY(rm_comm_status(MPI_Test(&t->request[i], &flag, MPI_STATUS_IGNORE)));
    heard += flag;
  }
  *done = heard == WINDOW && t->distance >= comm->size;
  return REMAP_OK;
}

/* Hear whoever tells something just now. */
static remap_status hear(const rm_comm *comm, int64_t *count)
{
  for (int flag = 1; flag;) {
    MPI_Status from;

    RM_TRY(rm_comm_status(MPI_Iprobe(MPI_ANY_SOURCE, TAG_COUNT, comm->mpi, &flag, &from)));
    if (flag)
      RM_TRY(rm_comm_status(
          MPI_Recv(&count[from.MPI_SOURCE], 1, MPI_INT64_T, from.MPI_SOURCE, TAG_COUNT, comm->mpi, MPI_STATUS_IGNORE)));
  }
  return REMAP_OK;
}

remap_status rm_comm_counts(const rm_comm *comm, const int64_t *send_offset, int64_t *count)
{
  telling     own     = {.send_offset = send_offset, .distance = 1};
  MPI_Request barrier = MPI_REQUEST_NULL;
  bool        entered = false;

  for (int i = 0; i < WINDOW; i++) own.request[i] = MPI_REQUEST_NULL;
  memset(count, 0, (size_t)comm->size * sizeof *count);
  count[comm->rank] = send_offset[comm->rank + 1] - send_offset[comm->rank];
  for (int over = 0; !over;) {
    RM_TRY(hear(comm, count));
    if (entered) {
      RM_TRY(rm_comm_status(MPI_Test(&barrier, &over, MPI_STATUS_IGNORE)));
    } else {
      RM_TRY(tell(comm, &own, &entered));
      if (entered) RM_TRY(rm_comm_status(MPI_Ibarrier(comm->mpi, &barrier)));
    }
  }
  return REMAP_OK;
}
