/* counted -- what a program asks of MPI, counted between it and MPI: messages, bytes, partners, collective calls and what these
 * hand out. For one file of a program: it defines MPI functions. */
#ifndef COUNTED_H
#define COUNTED_H

#include <mpi.h>
#include <string.h>

enum { COUNTED_RANKS = 4096 };

/* What this rank sends to others, as MPI is asked to. */
static struct {
  double messages, bytes, collectives, collective_bytes; /* the last: what comes out of them on this rank */
  char   partner[COUNTED_RANKS];
} counted_;

static void counted_call_(double bytes) { counted_.collectives++, counted_.collective_bytes += bytes; }

static double counted_size_(int n, MPI_Datatype type)
{
  int size = 0;

  PMPI_Type_size(type, &size);
  return (double)n * size;
}

static int counted_ranks_(MPI_Comm comm)
{
  int ranks = 0;

  PMPI_Comm_size(comm, &ranks);
  return ranks;
}

static void counted_message_(double bytes, int to)
{
  counted_.messages++;
  counted_.bytes += bytes;
  if (to < COUNTED_RANKS) counted_.partner[to] = 1;
}

int MPI_Isend(const void *data, int n, MPI_Datatype type, int to, int tag, MPI_Comm comm, MPI_Request *request)
{
  counted_message_(counted_size_(n, type), to);
  return PMPI_Isend(data, n, type, to, tag, comm, request);
}
int MPI_Issend(const void *data, int n, MPI_Datatype type, int to, int tag, MPI_Comm comm, MPI_Request *request)
{
  counted_message_(counted_size_(n, type), to);
  return PMPI_Issend(data, n, type, to, tag, comm, request);
}
int MPI_Ibarrier(MPI_Comm comm, MPI_Request *request)
{
  counted_call_(0);
  return PMPI_Ibarrier(comm, request);
}
int MPI_Allreduce(const void *mine, void *all, int n, MPI_Datatype type, MPI_Op op, MPI_Comm comm)
{
  counted_call_(counted_size_(n, type));
  return PMPI_Allreduce(mine, all, n, type, op, comm);
}
int MPI_Exscan(const void *mine, void *all, int n, MPI_Datatype type, MPI_Op op, MPI_Comm comm)
{
  counted_call_(counted_size_(n, type));
  return PMPI_Exscan(mine, all, n, type, op, comm);
}
int MPI_Bcast(void *data, int n, MPI_Datatype type, int root, MPI_Comm comm)
{
  counted_call_(counted_size_(n, type));
  return PMPI_Bcast(data, n, type, root, comm);
}
int MPI_Allgather(const void *mine, int n, MPI_Datatype type, void *all, int m, MPI_Datatype its, MPI_Comm comm)
{
  counted_call_(counted_size_(m, its) * counted_ranks_(comm));
  return PMPI_Allgather(mine, n, type, all, m, its, comm);
}
int MPI_Allgatherv(const void *mine, int n, MPI_Datatype type, void *all, const int *m, const int *at, MPI_Datatype its,
                   MPI_Comm comm)
{
  double bytes = 0;

  for (int r = 0; r < counted_ranks_(comm); r++) bytes += counted_size_(m[r], its);
  counted_call_(bytes);
  return PMPI_Allgatherv(mine, n, type, all, m, at, its, comm);
}
int MPI_Alltoall(const void *mine, int n, MPI_Datatype type, void *all, int m, MPI_Datatype its, MPI_Comm comm)
{
  counted_call_(counted_size_(m, its) * counted_ranks_(comm));
  return PMPI_Alltoall(mine, n, type, all, m, its, comm);
}

/* messages, bytes, partners, collectives, their bytes since the last time; and start anew. out may be NULL. */
static void counted_take(double *out)
{
  if (out) {
    out[0] = counted_.messages, out[1] = counted_.bytes, out[2] = 0;
    out[3] = counted_.collectives, out[4] = counted_.collective_bytes;
    for (int r = 0; r < COUNTED_RANKS; r++) out[2] += counted_.partner[r];
  }
  memset(&counted_, 0, sizeof counted_);
}

#endif
