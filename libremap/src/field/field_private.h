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

/* Axes W such that the products W d are orthonormal as columns; their number, the dimension of what the distances span. d is used up; scratch is [n]. Not collective. O(n). */
int rm_leastsq_axes(int64_t n, double (*d)[3], const rm_distance_noise *noise, double *scratch, double axes[3][3]);

/* ---- quadratic ------------------------------------------------------------------------------------------------- */

/* Working memory, [n] each. */
typedef struct rm_quadratic_room {
  double (*distance)[3], (*row)[9], *row_weight;
} rm_quadratic_room;

/* Weights of the nine coefficients of a quadratic polynomial with zero mean over a cell, from distances d_k between n centroids and
 * the cell's own and differences of mean (x - c)(x - c)^T. False if the neighbours do not determine it well. Not collective. O(n). */
bool rm_quadratic_weights(int64_t n, const double (*d)[3], const double (*spread)[6], const rm_distance_noise *noise,
                          rm_quadratic_room *room, double (*weight)[9]);

/* Rows and columns of the six numbers of a symmetric matrix: xx, yy, zz, xy, xz, yz. */
static const int rm_row_of[6] = {0, 1, 2, 0, 0, 1}, rm_column_of[6] = {0, 1, 2, 1, 2, 2};

/* ---- reconstruct ----------------------------------------------------------------------------------------------- */

/* Sums and slopes are of values times this power of two, so that differences of the largest values and slopes over small cells
 * stay finite. It changes no digit of what is not below 1e-280. */
#define RM_VALUE_SCALE 0x1p-64

/* What travels for a giving cell, `width` doubles, field after field from at[f] on: the value as the caller gave it (at
 * order 2 the reconstruction's at the centroid as rounded, unless the cell has a pair of its own alone); where the field has
 * slopes, three slopes of the scaled value, then, if asked for, least and greatest value around, scaled; at order 3 six
 * coefficients h of the scaled value and the constant that gives h:(y y^T) zero mean over the cell. */
typedef struct rm_packing {
  int  num_fields, width;
  int *at;         /* [num_fields]                           */
  int *order;      /* [num_fields] 1, 2 or 3                 */
  bool has_bounds; /* fields of order 2 or 3 carry the bounds */
  bool is_limited; /* Barth-Jespersen                        */
  bool is_checked; /* but not in cells that are smooth       */
} rm_packing;
enum { RM_PACK_SLOPE = 1, RM_PACK_BOUNDS = 4 }; /* places after at[f] */

/* Place of h after at[f], the constant behind it; and how many places a field takes. */
static inline int rm_pack_curvature(bool has_bounds) { return has_bounds ? RM_PACK_BOUNDS + 2 : RM_PACK_BOUNDS; }
static inline int rm_pack_width(int order, bool has_bounds)
{
  return order == 1 ? 1 : rm_pack_curvature(has_bounds) + (order > 2 ? 7 : 0);
}

/* h:(y z^T) with h as six coefficients of a symmetric form. */
static inline double rm_form(const double h[6], const double y[3], const double z[3])
{
  return h[0] * y[0] * z[0] + h[1] * y[1] * z[1] + h[2] * y[2] * z[2] +
         0.5 * (h[3] * (y[0] * z[1] + y[1] * z[0]) + h[4] * (y[0] * z[2] + y[2] * z[0]) + h[5] * (y[1] * z[2] + y[2] * z[1]));
}
static inline double rm_dot6(const double h[6], const double s[6])
{
  return h[0] * s[0] + h[1] * s[1] + h[2] * s[2] + h[3] * s[3] + h[4] * s[4] + h[5] * s[5];
}

/* Numbers of the giving cells, [giving cells][num_fields], and of the stencil's halo, [num_halo][num_fields]. */
typedef struct rm_numbers {
  const double *own, *halo;
} rm_numbers;

/* Values of one field: own cells, then the halo's. */
typedef struct rm_around {
  const double *own, *halo; /* [cells][stride], this field's first value */
  int64_t       stride;
} rm_around;
static inline double rm_value_at(const rm_around *u, rm_lid num_cells, rm_lid cell)
{
  return RM_VALUE_SCALE * (cell < num_cells ? u->own[cell * u->stride] : u->halo[(cell - num_cells) * u->stride]);
}

/* Those of field f out of num. */
static inline rm_around rm_around_of(rm_numbers numbers, int f, int num)
{
  return (rm_around){numbers.own ? numbers.own + f : NULL, numbers.halo ? numbers.halo + f : NULL, num};
}

/* Least-squares slope over the vertex neighbours, scaled; bounds become least and greatest value of the cell and them. */
void rm_fit_slope(const rm_stencil *stencil, rm_lid cell, const rm_around *u, double slope[3], double bounds[2]);

/* Slope and curvature, with its constant, of the quadratic polynomial, scaled; the stencil is widened. False if there is none:
 * slope stays as it is and curvature is 0. */
bool rm_fit_quadratic(const rm_stencil *stencil, rm_lid cell, const rm_around *u, double slope[3], double curvature[7]);

/* Fill the pack, [giving cells][width], of cells whose needs_halo is `which`; limited and reduced [num_fields] grow by the number
 * of cells whose reconstruction the limiter changed, and of those that order 3 has no polynomial for. rough says which cells are
 * not smooth, for a packing that is checked; the halo's numbers are read only for cells that need it. Cells that cover nothing get
 * slope 0. Not collective. */
void rm_reconstruct(const rm_transfer_setup *setup, const rm_packing *packing, rm_numbers given, rm_numbers rough,
                    const uint8_t *needs_halo, uint8_t which, double *pack, int64_t *limited, int64_t *reduced);

/* ---- smooth ---------------------------------------------------------------------------------------------------- */

/* Slopes of all own cells, [giving cells][num_fields][3], scaled. Not collective. */
void rm_smooth_slopes(const rm_stencil *stencil, const rm_packing *packing, rm_numbers given, double (*slope)[3]);

/* 1 for own cells that are rough, 0 for others, [giving cells][num_fields]. Not collective. */
void rm_smooth_roughness(const rm_stencil *stencil, const rm_mesh *mesh, const rm_packing *packing, rm_numbers given,
                         const double (*slope)[3], const double (*halo_slope)[3], double *rough);

/* 1 for own cells that are rough or have a rough neighbour, 0 for others, [giving cells][num_fields]. Not collective. */
void rm_smooth_spread(const rm_stencil *stencil, const rm_packing *packing, rm_numbers rough, double *spread);

/* Are a cell and its neighbours all not rough? Not collective. */
bool rm_is_smooth(const rm_stencil *stencil, rm_lid cell, const rm_around *rough);

/* ---- caas ------------------------------------------------------------------------------------------------------ */

typedef struct rm_receipt rm_receipt;

/* What clipping takes from the new values, and the room above and below the clipped ones, [num_fields][3], scaled; to be summed
 * over all ranks. old [receiving cells][num_fields] are the values before. The pack has bounds. Not collective. */
void rm_caas_sum(const rm_receipt *receipt, const double *old, rm_sum *sum);

/* Clip, and give back what the sums over all ranks say. limited [num_fields] grows by the number of clipped cells. */
void rm_caas_settle(const rm_receipt *receipt, const double *old, const rm_sum *sum, int64_t *limited);

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
struct rm_receipt {
  const rm_transfer_setup *setup;
  const remap_transfer    *how;
  const remap_field_desc  *fields;   /* [packing->num_fields]                                     */
  const rm_packing        *packing;
  const double            *got;      /* [givers of the rows][width]                               */
  double                  *value;    /* [receiving cells][num_fields] old values, then new ones   */
  rm_integral             *integral; /* [num_fields], NULL: nobody wants them                     */
};

/* Is a receiving cell's old value used? */
bool rm_keeps_old(const remap_transfer *how, const remap_field_desc *field, uint8_t cover);
/* Do uncovered cells take the nearest value of this field? */
bool rm_needs_nearest(const remap_transfer *how, const remap_field_desc *field);
/* The new value of every cell that wants one, but for those that take the nearest. Not collective. O(pairs) per field. */
void rm_receive(const rm_receipt *receipt);

#endif
