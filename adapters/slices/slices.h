/** @file
 * slices.h -- what the writers of supermeshes share: rows of global arrays brought to the ranks that write them, and
 * files that appear when they are complete.
 *
 * A global array of n rows is written in slices: rank r has the rows from ra_share(n, r, size) (base.h) up to that of rank
 * r + 1. The rows come from wherever the supermesh has them; since its numbers depend on coordinates alone, so does a file that
 * is written in their order, whatever the number of ranks. No rank ever holds more than its slices and its own part. */
#ifndef REMAP_ADAPTERS_SLICES_H
#define REMAP_ADAPTERS_SLICES_H

#include <mpi.h>
#include <stddef.h>
#include <stdint.h>

#include <remap/remap.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Every status: name, number, text. The greater one wins when ranks differ. */
#define RSLICE_STATUS_LIST(X)                                   \
  X(OK, 0, "success")                                           \
  X(MEMORY, 2, "memory could not be allocated: use more ranks") \
  X(INTERNAL, 3, "the numbers of the supermesh leave gaps")

typedef enum rslice_status {
#define X(name, number, text) RSLICE_##name = number,
  RSLICE_STATUS_LIST(X)
#undef X
} rslice_status;

/** A short text for a status; static text, never NULL. Not collective. */
const char *rslice_status_text(rslice_status status);

/** The greatest status of all ranks. Collective on comm. */
rslice_status rslice_agree(MPI_Comm comm, rslice_status mine);

/** Bytes of one message at most: MPI counts in int. */
#define RSLICE_CHUNK ((int64_t)1 << 30)

/** Records of `size` bytes to every rank and back: send holds send_count[r] records for rank r, r ascending; *recv, the
 *  caller's (free), those of each rank in the same order, and recv_count [ranks] how many. Messages have at most chunk bytes, 1
 *  to RSLICE_CHUNK, the same on all ranks. mine is the caller's own status so far, so that a rank in trouble takes the others
 *  with it; if it is not OK its pointers are not looked at. Collective on comm. Errors: mine of any rank, MEMORY. */
rslice_status rslice_exchange(MPI_Comm comm, rslice_status mine, int64_t chunk, size_t size, const int64_t *send_count,
                              const void *send, int64_t *recv_count, void **recv);

/** A cell field of a supermesh. */
typedef struct rslice_field {
  const char   *name;   /**< without '/', of at most 32 characters where the file is to be CGNS */
  const double *values; /**< [cells of this rank] borrowed */
} rslice_field;

/** A supermesh and what belongs to it, for a writer. Borrowed; names and counts agree on all ranks. */
typedef struct rslice_content {
  const remap_supermesh_view *mesh;
  const char         *ancestor[2]; /**< [side] names of the two fields that hold the cells' ancestors: their numbers, counted
                                                from 1, in that mesh; 0: none */
  int                 num_fields;
  const rslice_field *field; /**< [num_fields] */
  int                 num_boundaries;
  const char *const  *boundary_name; /**< [num_boundaries] */
  const char *const  *boundary_type; /**< [num_boundaries] BCType_t of CGNS, as text; NULL: all UserDefined */
  const int32_t      *face_boundary; /**< [faces of this rank] -1: none; may be NULL if num_boundaries is 0 */
  const int64_t      *face_cell[2];   /**< [side][faces of this rank] of the face of that mesh it lies in, a cell beside: its
                                           number, counted from 1; 0: it lies in none; NULL: not known */
  const int64_t      *face_number[2]; /**< [side][faces of this rank] what that face is called there; NULL as face_cell */
} rslice_content;

/** Rows of words of 8 bytes. Owned: rslice_drop. All zero is none. */
typedef struct rslice_rows {
  int64_t  first, num; /**< number of the first row and how many there are */
  int64_t *offset;     /**< [num + 1] from 0, in words */
  int64_t *word;       /**< [offset[num]] */
} rslice_rows;

/** Bring rows to their slices. global [num] are the numbers of the rows that this rank has, word[offset[i] .. offset[i + 1])
 *  row i. A row may come from several ranks: they give the same words. mine is the caller's own status so far, so that a rank
 *  in trouble takes the others with it. Collective on comm. Errors: those of the list; *out is then empty. */
rslice_status rslice_ship(MPI_Comm comm, rslice_status mine, int64_t total, int64_t num, const int64_t *global,
                          const int64_t *offset, const int64_t *word, rslice_rows *out);

/** The same in messages of at most chunk bytes. */
rslice_status rslice_ship_chunked(MPI_Comm comm, rslice_status mine, int64_t chunk, int64_t total, int64_t num,
                                  const int64_t *global, const int64_t *offset, const int64_t *word, rslice_rows *out);

/** Give rows back; harmless on none. Not collective. */
void rslice_drop(rslice_rows *rows);

/** The nodes' coordinates: rows of 3 words, doubles bit by bit. Collective. */
rslice_status rslice_nodes(MPI_Comm comm, const remap_supermesh_view *mesh, rslice_rows *out);

enum { RSLICE_FACE_HEAD = 8 }; /**< words of a row of rslice_faces before the nodes */
enum { RSLICE_FACE_BOUNDARY = 2, RSLICE_FACE_ORIGIN = 3, RSLICE_FACE_CELL = 4, RSLICE_FACE_NUMBER = 6 };

/** The faces: rows {owner, neighbour or -1, boundary or -1, origin, cells of both sides, numbers of both sides, nodes ...},
 *  nodes and cells of the supermesh by global numbers; the normal points out of the owner, which is the lower cell; the loop
 *  begins at its lowest node. Origin: 1 if it lies in a face of the source, plus 2 if it lies in one of the target; cells and
 *  numbers are those of face_cell and face_number, 0 where these are NULL. Collective. */
rslice_status rslice_faces(MPI_Comm comm, const rslice_content *content, rslice_rows *out);

/** The cells: rows {ancestors, volume, fields ..., then their faces}; ancestors as in their fields, numbers bit by bit. Faces
 *  are +-(global number + 1), negative where the normal points into the cell, ascending; or, with loops, they are written out
 *  for VTK: {how many, then for each: its global number, how many nodes, nodes ...}, normals pointing out. Collective. */
rslice_status rslice_cells(MPI_Comm comm, const rslice_content *content, int with_loops, rslice_rows *out);
/** Words of such a row before the faces. Not collective. */
int64_t rslice_cell_head(const rslice_content *content);

/** May a file of that name be written? One without any write permission is not replaced, not even by root, nor is a link that
 *  leads nowhere. Not collective. 0, or an error number. */
int rslice_file_check(const char *path);
/** A new, empty file beside `path`, or beside what it links to, that is to get its name; its own goes to part. One rank calls.
 *  0, or an error number. */
int rslice_file_begin(const char *path, char *part, size_t size);
/** Claim so many bytes of disk, so that later writes cannot find it full. One rank calls. 0, or an error number. */
int rslice_file_claim(const char *part, int64_t bytes);
/** Bring the file to the disk and give it its name; a link stays, and what it links to is replaced. One rank calls. 0, or an
 *  error number. */
int rslice_file_finish(const char *part, const char *path);

#ifdef __cplusplus
}
#endif
#endif
