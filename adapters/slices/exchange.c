/* exchange -- records from every rank to every other, in messages that MPI can count. Rank r meets the others one by one: in
 * step k it sends to r + k and receives from r - k, chunk by chunk. Both sides of a message have it in the same step, so the
 * rank that is furthest behind can always go on. Linear in what is sent and received, plus one exchange of counts. */
#include "slices.h"

#include <stdlib.h>
#include <string.h>

enum { TAG = 29 }; /* of messages here */

rslice_status rslice_agree(MPI_Comm comm, rslice_status mine)
{
  int status = (int)mine;

  MPI_Allreduce(MPI_IN_PLACE, &status, 1, MPI_INT, MPI_MAX, comm);
  return (rslice_status)status;
}

void *rslice_room(int64_t count, size_t size) { return count < 0 ? NULL : calloc((size_t)count + 1, size); }

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

rslice_status rslice_exchange(MPI_Comm comm, rslice_status mine, int64_t chunk, size_t size, const int64_t *send_count,
                              const void *send, int64_t *recv_count, void **recv)
{
  const int64_t bytes = (int64_t)size;
  int           rank, ranks;
  int64_t      *from, *to; /* [ranks + 1] */
  char         *in = NULL;

  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  to   = rslice_room(2 * ((int64_t)ranks + 1), sizeof *to);
  from = to ? to + ranks + 1 : NULL;
  mine = rslice_agree(comm, mine == RSLICE_OK && !to ? RSLICE_MEMORY : mine);
  if (mine == RSLICE_OK) {
    MPI_Alltoall(send_count, 1, MPI_INT64_T, recv_count, 1, MPI_INT64_T, comm);
    add_up(ranks, send_count, to);
    add_up(ranks, recv_count, from);
    in   = rslice_room(from[ranks], size);
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
  free(to);
  return mine;
}
