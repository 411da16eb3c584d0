/* mesh_private -- what the files of the room hand to each other, in the order of the work:
 *
 *   given.c      the caller's arrays are safe to read
 *   frame.c      common scale and box
 *   loops.c      nodes unified by coordinates, loops without repeats
 *   join.c       faces that meet by their coordinates, on any rank
 *   cells.c      faces of each cell, closure
 *   integrals.c  volume and centroid
 *   build.c      the product; check.c its invariants */
#ifndef RM_MESH_PRIVATE_H
#define RM_MESH_PRIVATE_H

#include "mesh/mesh.h"

/* One call of rm_mesh_build. */
typedef struct rm_mesh_job {
  rm_arena         *scratch; /* dropped when the mesh is built */
  const rm_comm    *comm;
  remap_side        side;
  const remap_mesh *given;
  const rm_frame   *frame;
  rm_gid            first_global; /* of this rank's cells if the caller gives no ids */
  rm_reason        *reason;
} rm_mesh_job;

/* The caller's faces as loops over unified nodes. Order and owners as given; faces that collapse are left out. */
typedef struct rm_loops {
  rm_lid          num_nodes, num;
  const double  (*xyz)[3];    /* [num_nodes] own frame, distinct                                     */
  const uint64_t *node_hash;  /* [num_nodes] of the coordinates                                      */
  int64_t        *offset;     /* [num + 1]                                                           */
  rm_lid         *node;       /* [offset[num]]                                                       */
  rm_lid        (*cell)[2];   /* [num] owner, neighbour or -1; owner -1 once the other side has it   */
  uint8_t        *is_skin;    /* [num]                                                               */
  rm_lid         *given;      /* [num] the caller's number                                          */
  double        (*cell_box)[6]; /* [given num_cells] of all given faces                              */
} rm_loops;

/* Global id of a cell given on this rank, -1 if there is no such cell. */
rm_gid rm_mesh_global_of(const remap_mesh *given, rm_gid first_global, int64_t cell);

/* The rank that looks after a hash. */
static inline rm_lid rm_mesh_home_of(uint64_t hash, int num_ranks)
{
  return (rm_lid)((hash >> 32) * (uint64_t)num_ranks >> 32);
}

/* Number of cells of all lower ranks, over counts that may be nonsense. Collective. */
remap_status rm_mesh_first_global(const rm_comm *comm, const remap_mesh *given, rm_gid *out);

/* BAD_MESH or TOO_LARGE with the reason, unless every array can be read as remap.h describes it. Not collective. O(corners). */
remap_status rm_mesh_given_check(remap_side side, const remap_mesh *given, rm_gid first_global, rm_reason *reason);

/* A coordinate of the caller in the own frame. */
double rm_mesh_to_frame(double x, double scale);

/* Unify nodes, clean loops. Not collective. Lives in job->scratch. BAD_MESH if a cell has no faces, NO_MEMORY. */
remap_status rm_mesh_loops(const rm_mesh_job *job, rm_loops *out);

/* Find the other side of every loop that has one cell: fills cell[][1] and is_skin. Collective. Ids are the final ones. */
remap_status rm_mesh_join(const rm_mesh_job *job, const rm_gid *cell_global, rm_loops *loops);

/* Faces of each cell, ascending, into offset [num_cells + 1] and *face, both in arena. Not collective. */
remap_status rm_mesh_cell_faces(rm_arena *arena, rm_lid num_cells, rm_lid num_faces, const rm_lid (*face_cell)[2],
                                const int64_t **offset, const rm_lid **face);

/* A cell that is not closed: some edge runs more often one way than the other. */
typedef struct rm_mesh_open {
  rm_lid cell, node[2]; /* cell -1 if all are closed */
} rm_mesh_open;
/* The first open cell. Not collective. O(corners); scratch memory for the largest cell. NO_MEMORY. */
remap_status rm_mesh_find_open(rm_arena *scratch, const rm_mesh *mesh, rm_mesh_open *out);

/* Volume and centroid of every cell, [num_cells]. Needs all of mesh but them. Not collective. NO_MEMORY. */
remap_status rm_mesh_integrals(rm_arena *scratch, const rm_mesh *mesh, remap_faces faces, double *volume,
                               double (*centroid)[3]);

/* rm_mesh_build with the scratch memory of the caller, which may be NULL: then memory is out. For tests of what happens
 * then. */
remap_status rm_mesh_build_in(rm_arena *scratch, rm_arena *arena, const rm_comm *comm, remap_side side, const remap_mesh *given,
                              const rm_frame *frame, remap_faces faces, const rm_mesh **out, rm_reason *reason);

#endif
