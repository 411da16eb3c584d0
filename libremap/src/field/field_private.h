/* field_private -- between the files of the room.
 *
 *   stencil         vertex neighbours and their weights              leastsq   the weights of one cell
 *   reconstruct     giving cells: value, slope, bounds               nearest   where uncovered cells look
 *   receive         receiving cells, coverage policies               integral  what was kept, exactly
 *   carrier         all of it in order, in two steps                                                      */
#ifndef RM_FIELD_PRIVATE_H
#define RM_FIELD_PRIVATE_H

#include "field.h"

#include <math.h>

/* ---- leastsq --------------------------------------------------------------------------------------------------- */

/* What rounding leaves of the distances in one stencil. */
typedef struct rm_distance_noise {
  double coordinate[3]; /* a distance along an axis below this is rounding only                  */
  double extent[3];     /* of the cell itself: what is far smaller spans nothing along this axis */
} rm_distance_noise;

/* Weights w_k with gradient = sum of w_k (u_k - u), from distances d_k between n centroids and the cell's own. d is used up.
 * Not collective. O(n). */
void rm_leastsq_weights(int64_t n, double (*d)[3], const rm_distance_noise *noise, double *scratch, double (*weight)[3]);

/* ---- reconstruct ----------------------------------------------------------------------------------------------- */

/* Sums and slopes are of values times this power of two, so that differences of the largest values and slopes over small cells
 * stay finite. It changes no digit of what is not below 1e-280. */
#define RM_VALUE_SCALE 0x1p-64

/* What travels for a giving cell, `width` doubles, field after field from at[f] on: the value as the caller gave it (at
 * order 2 the reconstruction's at the centroid as rounded, unless the cell has a pair of its own alone); where the field has
 * slopes, three slopes of the scaled value, then, if asked for, least and greatest value around, scaled. */
typedef struct rm_packing {
  int  num_fields, width;
  int *at;         /* [num_fields]                           */
  int *order;      /* [num_fields] 1 or 2                    */
  bool has_bounds; /* fields of order 2 carry the bounds     */
  bool is_limited; /* Barth-Jespersen                        */
} rm_packing;
enum { RM_PACK_SLOPE = 1, RM_PACK_BOUNDS = 4 }; /* places after at[f] */

/* Fill the pack, [giving cells][width], of cells whose needs_halo is `which`; limited [num_fields] grows by the number of cells
 * whose slope was reduced. given is [giving cells][num_fields], halo [halo of the stencil][num_fields], read only for cells that
 * need it. Cells that cover nothing get slope 0. Not collective. */
void rm_reconstruct(const rm_transfer_setup *setup, const rm_packing *packing, const double *given, const double *halo,
                    const uint8_t *needs_halo, uint8_t which, double *pack, int64_t *limited);

/* ---- nearest --------------------------------------------------------------------------------------------------- */

/* Where cells without a value of their own look: the nearest mapped cell. Read-only once built. */
typedef struct rm_nearest {
  int64_t        num;    /* cells without pairs on this rank         */
  const rm_lid  *cell;   /* [num] ascending                          */
  const rm_lid  *origin; /* [num] place in what the plan brings      */
  const rm_plan *plan;   /* brings the values of mapped cells        */
} rm_nearest;

/* Find the nearest mapped cell, by layers of vertex neighbours: a cell takes, among its neighbours' mapped cells of the layers
 * before, the one whose centroid is nearest to its own, the canonically first if some are equally near. Cells that no
 * layer reaches take the mapped cell of nearest centroid in the whole mesh. COVERAGE if no cell is mapped anywhere.
 * Collective. Lives in arena. */
remap_status rm_nearest_build(rm_arena *arena, const rm_comm *comm, const rm_mesh *mesh, const rm_stencil *stencil,
                              const uint8_t *cover, const rm_nearest **out, rm_reason *reason);

/* The cell a search has found for a point. */
typedef struct rm_origin {
  double xyz[3]; /* its centroid */
  rm_gid global;
  int    rank; /* -1: none yet */
  rm_lid cell;
} rm_origin;

/* The mapped cell of nearest centroid for each of num_points points, by distance, then centroid, then global id. Collective; some
 * cell is mapped somewhere. found is [num_points]. Working memory from scratch. O(log n) per point and rank that is near. */
remap_status rm_nearest_anywhere(rm_arena *scratch, const rm_comm *comm, const rm_mesh *mesh, const uint8_t *cover,
                                 int64_t num_points, const double (*point)[3], rm_origin *found);

static inline double rm_distance2(const double x[3], const double y[3])
{
  const double dx = x[0] - y[0], dy = x[1] - y[1], dz = x[2] - y[2];

  return dx * dx + dy * dy + dz * dz;
}

/* ---- integral -------------------------------------------------------------------------------------------------- */

/* What a field's transfer kept, summed without rounding; scaled values, own frame. */
typedef struct rm_integral {
  rm_sum source, minus_target, magnitude;
} rm_integral;

/* Add x y to a sum unless it is too small to count beside products of ordinary size (below 2^-900). */
static inline void rm_integral_add(rm_sum *sum, double x, double y)
{
  if (fabs(x * y) >= 0x1p-900) rm_sum_add_product(sum, x, y);
}

/* Add what the giving cells hold to source and magnitude of integral [num_fields]; flags are left out. Not collective. */
void rm_integral_source(const rm_transfer_setup *setup, const remap_field_desc *fields, const rm_packing *packing,
                        const double *given, const double *pack, rm_integral *integral);

/* Reduce over all ranks and fill in the integrals of reports [num_fields]. Collective. Working memory from scratch. */
remap_status rm_integral_report(rm_arena *scratch, const rm_transfer_setup *setup, int num_fields, const rm_integral *integral,
                                remap_field_report *reports);

/* ---- receive --------------------------------------------------------------------------------------------------- */

/* One transfer on the receiving side. */
typedef struct rm_receipt {
  const rm_transfer_setup *setup;
  const remap_transfer    *how;
  const remap_field_desc  *fields;   /* [packing->num_fields]                                     */
  const rm_packing        *packing;
  const double            *got;      /* [givers of the rows][width]                               */
  double                  *value;    /* [receiving cells][num_fields] old values, then new ones   */
  rm_integral             *integral; /* [num_fields], NULL: nobody wants them                     */
} rm_receipt;

/* Is a receiving cell's old value used? */
bool rm_keeps_old(const remap_transfer *how, const remap_field_desc *field, uint8_t cover);
/* Do uncovered cells take the nearest value of this field? */
bool rm_needs_nearest(const remap_transfer *how, const remap_field_desc *field);
/* The new value of every cell that wants one, but for those that take the nearest. Not collective. O(pairs) per field. */
void rm_receive(const rm_receipt *receipt);

#endif
