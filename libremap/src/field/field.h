/* field -- mapping and the caller's values in; the receiving cells' values out (DESIGN 4): reconstruction of order 1 or 2,
 * limiter, coverage policies, integrals. */
#ifndef RM_FIELD_H
#define RM_FIELD_H

#include "mapping/mapping.h"

/* stencil -- least squares over vertex neighbours, prepared once per mesh. Neighbours on other ranks are found by the
 * coordinates of shared nodes. Read-only once built. Invariants:
 *   a cell's neighbours ascend canonically (centroid's Morton key, centroid, volume, global id), without the cell itself;
 *   weight holds, per neighbour, the vector w with gradient = sum of w (u_neighbour - u_cell), exact for linear fields wherever
 *   the neighbours' centroids span space; a direction they do not span has slope 0 (QR with column scaling and pivoting). */
typedef struct rm_stencil {
  rm_lid         num_cells;
  const int64_t *offset;            /* [num_cells + 1]                                                       */
  const rm_lid  *neighbour;         /* [offset[num_cells]] < num_cells: own cell; else halo num_cells + k    */
  const double (*weight)[3];        /* [offset[num_cells]]                                                   */
  const int64_t *node_offset;       /* [num_cells + 1] the cell's nodes, for bounds                          */
  const rm_lid  *node;              /* [node_offset[num_cells]] of the mesh                                  */
  rm_lid         num_halo;
  const rm_plan *plan;              /* brings the halo's values: received item k is halo cell k              */
} rm_stencil;

/* Collective. Lives in arena. */
remap_status rm_stencil_build(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *mesh,
                              const rm_stencil **out);

/* What a transfer needs; everything is borrowed. */
typedef struct rm_transfer_setup {
  const rm_comm    *comm;
  const rm_frame   *frame;
  const rm_mesh    *giving, *receiving;
  const rm_rows    *rows;           /* of the receiving cells                                     */
  const rm_rows    *giving_rows;    /* of the giving cells: their pairs and coverage, for integrals */
  const rm_stencil *giving_stencil; /* NULL if order 1                                            */
  const rm_stencil *receiving_stencil; /* for nearest by layers                                   */
} rm_transfer_setup;

/* Transfer num_fields fields; see remap_field in remap.h for the arguments. Collective. Results depend neither on partition nor on
 * numbering. reports may be NULL on some ranks or all; their integrals are over volumes of the own frame. Old values are
 * read only where a policy keeps them. Scratch memory lives in arena (the caller drops it). */
remap_status rm_field_transfer(rm_arena *arena, const rm_transfer_setup *setup, const remap_transfer *how, int num_fields,
                               const remap_field_desc *fields, remap_field_report *reports, rm_reason *reason);

#endif
