/* swap -- two ranks exchange arrays of lengths that only the sender knows, in pieces that fit on the stack, so that a rank
 * without memory for what comes can take it away all the same. The first piece says how much there is. O(data) time. */
#include "comm/comm_private.h"

#include <string.h>

enum { TAG_SWAP = 7, PIECE = 1 << 14, HEAD = (int)sizeof(int64_t) };

/* Bytes of an array of `all` that go in the piece from `at` on, which has room for `most`. */
static int piece_of(int64_t all, int64_t at, int64_t most)
{
  return (int)(all <= at ? 0 : all - at < most ? all - at : most);
}

/* Send and receive a piece; without bytes there is none. */
static remap_status swap_piece(const rm_comm *comm, int with, const char *out, int out_bytes, char *in, int in_bytes)
{
  MPI_Request request[2];
  int         num = 0;

  if (in_bytes > 0)
    RM_TRY(rm_comm_status(MPI_Irecv(in, in_bytes, MPI_BYTE, with, TAG_SWAP, comm->mpi, &request[num++])));
  if (out_bytes > 0)
    RM_TRY(rm_comm_status(MPI_Isend(out, out_bytes, MPI_BYTE, with, TAG_SWAP, comm->mpi, &request[num++])));
  return rm_comm_status(MPI_Waitall(num, request, MPI_STATUSES_IGNORE));
}

remap_status rm_comm_swap(const rm_comm *comm, rm_arena *arena, int with, size_t size, int64_t n, const void *send,
                          int64_t *num, void **recv)
{
  const int64_t out_bytes = n * (int64_t)size;
  const int     first     = piece_of(out_bytes, 0, PIECE - HEAD);
  char          out[PIECE], in[PIECE], *data;
  int64_t       in_bytes;

  memcpy(out, &out_bytes, HEAD);
  if (first > 0) memcpy(out + HEAD, send, (size_t)first);
  RM_TRY(swap_piece(comm, with, out, HEAD + first, in, PIECE));
  memcpy(&in_bytes, in, HEAD);
  data = rm_arena_alloc(arena, in_bytes / (int64_t)size, size);
  if (data && in_bytes > 0) memcpy(data, in + HEAD, (size_t)piece_of(in_bytes, 0, PIECE - HEAD));
  for (int64_t at = PIECE - HEAD; at < out_bytes || at < in_bytes; at += PIECE) {
    const int out_piece = piece_of(out_bytes, at, PIECE), in_piece = piece_of(in_bytes, at, PIECE);

    RM_TRY(swap_piece(comm, with, out_piece > 0 ? (const char *)send + at : NULL, out_piece,
                      data && in_piece > 0 ? data + at : in, in_piece));
  }
  *num  = data ? in_bytes / (int64_t)size : 0;
  *recv = data;
  return data ? REMAP_OK : REMAP_NO_MEMORY;
}
