/* super -- the supermesh over all ranks: two meshes in; out each rank's share of the cells of the supermesh, with numbers
 * that depend on coordinates alone.
 *
 * Every rank takes a core of cells that meet the other mesh, with all that touches them (rm_part_cover), overlays, and keeps
 * the supermesh of the core: it is complete there, down to the vertices on its faces. Vertices are known by what they are
 * made of and not by their rounded place, faces by their vertices, so what two ranks made is recognised exactly, and
 * numbered in one order. Zones of one mesh that touch without matching faces are joined first, in the same way. O(n log n)
 * time; some 850 bytes (centre, 580 diagonal) for each cell of the result while cells are made, on several ranks 1300 while
 * they are numbered. */
#ifndef RM_SUPER_H
#define RM_SUPER_H

#include "cells/cells.h"

typedef struct rm_super {
  remap_supermesh_view view;
  const rm_lid        *cell_home[2]; /* [side][num_cells] the ancestor's number on its home rank, -1 */
  const int           *cell_rank[2]; /* [side][num_cells] that rank, any where there is none          */
} rm_super;

/* The zones of a mesh, as in remap_mesh. */
typedef struct rm_zones {
  int64_t            num;
  const int64_t     *cell_offset; /* [num + 1] */
  const char *const *name;        /* [num]     */
} rm_zones;

/* What it is made of, the same on all ranks. */
typedef struct rm_super_job {
  const rm_comm                 *comm;
  const rm_frame                *frame;
  const rm_mesh *const          *mesh; /* [side] */
  rm_zones                       zones[2];
  remap_faces                    faces;
  const remap_supermesh_options *options;
  const rm_progress             *progress; /* may be NULL */
} rm_super_job;

/* Collective. Lives in arena. Failures are those of remap_supermesh, the same on every rank. */
remap_status rm_super_build(rm_arena *arena, const rm_super_job *job, const rm_super **out, rm_reason *reason);

/* out[k] = in[item from[k] of rank from_rank[k]], `size` bytes each, *none where from[k] is -1, for k < n; untouched after a
 * failure. Collective. */
remap_status rm_super_fetch(const rm_comm *comm, int64_t n, const int32_t *from, const int32_t *from_rank, size_t size,
                            const void *in, const void *none, void *out);

#endif
