/* field -- mapping and the caller's values in; the receiving cells' values out (DESIGN 4): reconstruction of order 1 to 3,
 * limiter, coverage policies, integrals. */
#ifndef RM_FIELD_H
#define RM_FIELD_H

#include "mapping/mapping.h"

/* stencil -- vertex neighbours, prepared once per mesh, and least squares over them. Neighbours on other ranks are found by the
 * coordinates of shared nodes. Read-only once built. Invariants:
 *   a cell's neighbours ascend canonically (centroid's Morton key, centroid, volume, global id), without the cell itself; of
 *   the cells at a node with more than 512 they are about 130, chosen by that order: those next to the cell, others all round;
 *   weight holds, per neighbour, the vector w with gradient = sum of w (u_neighbour - u_cell), exact for linear fields wherever
 *   the neighbours' centroids span space; a direction they do not span has slope 0 (QR with column scaling and pivoting). */
typedef struct rm_stencil {
  rm_lid         num_cells;
  const int64_t *offset;      /* [num_cells + 1]                                                       */
  const rm_lid  *neighbour;   /* [offset[num_cells]] < num_cells: own cell; else halo num_cells + k    */
  const double (*weight)[3];  /* [offset[num_cells]] NULL until rm_stencil_weigh                       */
  const int64_t *node_offset; /* [num_cells + 1] the cell's nodes, for bounds                          */
  const rm_lid  *node;        /* [node_offset[num_cells]] of the mesh                                  */
  rm_lid         num_halo;     /* cells of other ranks that are neighbours here                         */
  const double (*halo_centroid)[3]; /* [num_halo]                                                            */
  const rm_plan *plan;              /* brings the halo's values: received item k is halo cell k              */

  /* Of a widened stencil, else NULL: least squares for quadratic polynomials g.y + sum of h (y y^T - spread), y = x - c, with
   * zero mean over the cell; coefficients are sums of weight (u_neighbour - u_cell), exact for quadratic fields. */
  const int64_t *wide_offset;   /* [num_cells + 1]                                                       */
  const rm_lid *wide_neighbour; /* [wide_offset[num_cells]] canonical order; vertex neighbours and, if they do not do, theirs */
  const double (*wide_weight)[9]; /* [same] of g, then of h: xx, yy, zz, xy, xz, yz                         */
  const double (*spread)[6];      /* [num_cells] mean of (x - c)(x - c)^T                                  */
  const uint8_t *is_reduced;      /* [num_cells] 1: no polynomial is determined well: order 2 there        */
} rm_stencil;

/* Neighbours without weights. takes_part [num_cells]: 0 for cells that are nobody's neighbour; NULL: all are. Collective. Lives
 * in arena. */
remap_status rm_stencil_build(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *mesh,
                              const uint8_t *takes_part, const rm_stencil **out);

/* The same stencil with weights. Not collective. Lives in arena and borrows from stencil. O(neighbours). NO_MEMORY. */
remap_status rm_stencil_weigh(rm_arena *arena, const rm_mesh *mesh, const rm_stencil *stencil, const rm_stencil **out);

/* Where the values of a mesh's cells stand in the caller's arrays. */
typedef struct rm_layout {
  int            num_blocks;   /* 0: one block of all cells                                                    */
  const rm_lid  *block_offset; /* [num_blocks + 1] the cells of block b                                         */
  const int64_t *place;        /* [num_cells] place in its array, NULL: the number within what the array is of  */
} rm_layout;

/* A stencil for order 3 as well: near, which has weights, with more neighbours, hence with a halo and a plan of its own; it
 * shares arrays with near. second: rm_mesh_second of the mesh. Collective. Lives in arena. */
remap_status rm_stencil_widen(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *mesh,
                              const double (*second)[6], const rm_stencil *near, const rm_stencil **out);

/* What a transfer needs; everything is borrowed. */
typedef struct rm_transfer_setup {
  const rm_comm    *comm;
  const rm_frame   *frame;
  const rm_mesh    *giving, *receiving;
  const rm_rows    *rows;              /* of the receiving cells                                        */
  const rm_rows    *giving_rows;       /* of the giving cells: their pairs and coverage, for integrals  */
  const rm_stencil *giving_stencil;    /* NULL if order 1; widened if order 3                           */
  const rm_stencil *receiving_stencil; /* for nearest by layers; NULL if nobody looks for the nearest */
  const rm_stencil *keeping_stencil; /* of receiving cells that keep old content outside; NULL if order 1; widened if order 3 */
  rm_layout         giving_layout, receiving_layout;
  const double (*giving_second)[6];    /* rm_mesh_second; NULL unless systems have slopes              */
  const double (*receiving_second)[6]; /* likewise; NULL unless such slopes, or order 3, go beyond what is covered */
  const double *giving_measure, *receiving_measure; /* [cells] the solver's volumes over those of the mesh; NULL: 1   */
  /* [cells] 1: the cell and its giver are the same, but not their volumes for the solver: amounts are no copies; NULL: none */
  const uint8_t *giving_differs, *receiving_differs;
  bool           any_partial, any_uncovered; /* such receiving cells exist on some rank           */
} rm_transfer_setup;

/* Are roles, vectors and the gas model such that fields can be moved together? BAD_ARGUMENT with the reason. Not collective. */
remap_status rm_systems_check(const remap_transfer *how, int num_fields, const remap_field_desc *fields, rm_reason *reason);

/* How much a transfer asks of a carrier; the same on every rank. */
typedef struct rm_load {
  int  num_fields;
  int  width; /* doubles that travel per giving cell           */
  int  num_systems;
  bool has_slopes;  /* needs the stencil's halo                       */
  bool is_settled;  /* limiter CAAS: old values and sums are kept     */
  bool is_checked;  /* limiter auto: slopes and roughness travel too    */
  bool keeps_bounds; /* the same where bounds do not travel              */
  bool is_wide;     /* of the widened stencil, for order 3            */
  bool is_curved;   /* systems with slopes: second moments of cells   */
  bool is_blended;  /* old content outside is reconstructed too       */
  bool has_nearest; /* uncovered cells take the nearest mapped cell's */
} rm_load;

/* The load of a transfer. Not collective. */
rm_load rm_load_of(const rm_transfer_setup *setup, const remap_transfer *how, int num_fields, const remap_field_desc *fields);
/* A load that covers both. */
rm_load rm_load_max(rm_load a, rm_load b);
/* Does the first cover the second? */
bool rm_load_covers(rm_load a, rm_load b);

/* carrier -- takes fields from the giving to the receiving cells, again and again, without taking memory and among neighbours
 * only. It holds buffers and what is under way, but nothing that changes a result: results depend neither on partition nor on
 * numbering, nor on earlier transfers. */
typedef struct rm_carrier rm_carrier;

/* A carrier for transfers up to a load. Collective. Lives in arena; setup is copied, what it points to is borrowed. COVERAGE if
 * cells look for the nearest mapped cell and there is none. */
remap_status rm_carrier_build(rm_arena *arena, const rm_transfer_setup *setup, rm_load load, rm_carrier **out,
                              rm_reason *reason);

enum { RM_CARRIER_PLANS = 5 };
/* The plans along which it sends, and their number; the same on every rank. Not collective. */
int rm_carrier_plans(const rm_carrier *carrier, const rm_plan *plan[RM_CARRIER_PLANS]);

/* Hold this parley in every transfer from the next on, instead of one with the plans' neighbours, which are among its peers. */
void rm_carrier_meet(rm_carrier *carrier, const rm_parley *parley);

/* Read values, check them and send what neighbours wait for. All ranks start, but none waits. mark tells this transfer from
 * others. A failure here is kept: rm_carrier_finish hands it out, once neighbours know; so is one that the caller comes with,
 * mine and its reason: then no value is read. The load fits; none is under way. how and fields are copied; of the arrays, only
 * `out` is borrowed until the finish, which writes it. */
void rm_carrier_start(rm_carrier *carrier, const remap_transfer *how, int num_fields, const remap_field_desc *fields,
                      uint64_t mark, remap_status mine, const rm_reason *reason);

/* Tell peers how the transfer under way is to be finished; those that finish it otherwise are told. By all ranks, just before
 * they finish it, or by none; waits for peers. */
void rm_carrier_confirm(rm_carrier *carrier, uint64_t mark);

/* Complete what was started. All ranks finish; each waits for its neighbours only, and its status is the worst of its own and
 * of those whose values it uses. With reports, [num_fields] on every rank or NULL on every rank, it is collective and the
 * status the same everywhere. Fields are written if the status is OK. cubed: the caller's unit of volume in that of the own
 * frame, for the integrals of the reports. */
remap_status rm_carrier_finish(rm_carrier *carrier, double cubed, remap_field_report *reports, rm_reason *reason);

/* Is a transfer under way? carrier may be NULL here and below. */
bool rm_carrier_is_under_way(const rm_carrier *carrier);

/* Give up what is under way, if anything, on all ranks; each waits for the neighbours' starts only. */
void rm_carrier_abandon(rm_carrier *carrier);

#endif
