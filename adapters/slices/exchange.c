/* exchange -- records from every rank to every other, in messages that MPI can count. Rank r meets the others one by one: in
 * step k it sends to r + k and receives from r - k, chunk by chunk. Both sides of a message have it in the same step, so the
 * rank that is furthest behind can always go on. Who gets how much is told to those alone, by non-blocking consensus (Hoefler,
 * Siebert and Lumsdaine, 2010). Linear in what is sent and received, with a look at every rank. */
#include "slices.h"

#include "base.h"

#include <stdlib.h>
#include <string.h>

enum { TAG = 29, TAG_COUNT = 30 }; /* of messages here */

rslice_status rslice_agree(MPI_Comm comm, rslice_status mine)
{
  int status = (int)mine;

  MPI_Allreduce(MPI_IN_PLACE, &status, 1, MPI_INT, MPI_MAX, comm);
  return (rslice_status)status;
}

/* Send a message and receive another, which may be of another length. */
static void swap(MPI_Comm comm, int64_t chunk, const char *out, int64_t out_bytes, int to, char *in, int64_t in_bytes, int from)
{
  for (int64_t at = 0; at < out_bytes || at < in_bytes; at += chunk) {
    MPI_Request request[2];
    int         num = 0;

    if (at < in_bytes)
      MPI_Irecv(in + at, (int)(in_bytes - at < chunk ? in_bytes - at : chunk), MPI_BYTE, from, TAG, comm, &request[num++]);
    if (at < out_bytes)
      MPI_Isend(out + at, (int)(out_bytes - at < chunk ? out_bytes - at : chunk), MPI_BYTE, to, TAG, comm, &request[num++]);
    MPI_Waitall(num, request, MPI_STATUSES_IGNORE);
  }
}

/* Where the messages begin, in records: [ranks] and their sum. */
static void add_up(int ranks, const int64_t *count, int64_t *at)
{
  at[0] = 0;
  for (int r = 0; r < ranks; r++) at[r + 1] = at[r] + count[r];
}

/* Hear all who tell how much they have for this rank, as far as they did so far. */
static void hear_counts(MPI_Comm comm, int64_t *recv_count)
{
  for (int is_told = 1; is_told;) {
    MPI_Status from;

    MPI_Iprobe(MPI_ANY_SOURCE, TAG_COUNT, comm, &is_told, &from);
    if (is_told)
      MPI_Recv(&recv_count[from.MPI_SOURCE], 1, MPI_INT64_T, from.MPI_SOURCE, TAG_COUNT, comm, MPI_STATUS_IGNORE);
  }
}

/* recv_count from everybody's send_count, [ranks] each as request is. A message is complete when it is heard; a rank whose own
 * are all heard enters a barrier, which is complete when nothing is under way. */
static void tell_counts(MPI_Comm comm, int rank, int ranks, const int64_t *send_count, int64_t *recv_count,
                        MPI_Request *request)
{
  MPI_Request barrier = MPI_REQUEST_NULL;
  int         num = 0, are_heard = 0, is_over = 0;

  memset(recv_count, 0, (size_t)ranks * sizeof *recv_count);
  recv_count[rank] = send_count[rank];
  for (int k = 1; k < ranks; k++) {
    const int dst = (int)(((int64_t)rank + k) % ranks);

    if (send_count[dst]) MPI_Issend(&send_count[dst], 1, MPI_INT64_T, dst, TAG_COUNT, comm, &request[num++]);
  }
  while (!is_over) {
    hear_counts(comm, recv_count);
    if (are_heard) {
      MPI_Test(&barrier, &is_over, MPI_STATUS_IGNORE);
    } else {
      MPI_Testall(num, request, &are_heard, MPI_STATUSES_IGNORE);
      if (are_heard) MPI_Ibarrier(comm, &barrier);
    }
  }
}

rslice_status rslice_exchange(MPI_Comm comm, rslice_status mine, int64_t chunk, size_t size, const int64_t *send_count,
                              const void *send, int64_t *recv_count, void **recv)
{
  const int64_t bytes = (int64_t)size;
  int           rank, ranks;
  int64_t      *from, *to; /* [ranks + 1] */
  MPI_Request  *request;   /* [ranks] */
  char         *in = NULL;

  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  to      = ra_zeros(2 * ((int64_t)ranks + 1), sizeof *to);
  request = ra_zeros(ranks, sizeof *request);
  from    = to ? to + ranks + 1 : NULL;
  mine    = rslice_agree(comm, mine == RSLICE_OK && !(to && request) ? RSLICE_MEMORY : mine);
  if (mine == RSLICE_OK) {
    tell_counts(comm, rank, ranks, send_count, recv_count, request);
    add_up(ranks, send_count, to);
    add_up(ranks, recv_count, from);
    in   = ra_zeros(from[ranks], size);
    mine = rslice_agree(comm, in ? RSLICE_OK : RSLICE_MEMORY);
  }
  if (mine == RSLICE_OK) {
    if (send_count[rank])
      memcpy(in + from[rank] * bytes, (const char *)send + to[rank] * bytes, (size_t)(send_count[rank] * bytes));
    for (int k = 1; k < ranks; k++) {
      const int dst = (int)(((int64_t)rank + k) % ranks), src = (int)(((int64_t)rank + ranks - k) % ranks);

      swap(comm, chunk, (const char *)send + to[dst] * bytes, send_count[dst] * bytes, dst, in + from[src] * bytes,
           recv_count[src] * bytes, src);
    }
    *recv = in;
    in    = NULL;
  }
  free(in);
  free(request);
  free(to);
  return mine;
}
