/* reconstruct -- what giving cells send: their value and, at order 2, a slope about their centroid, at order 3 a quadratic
 * polynomial, limited if asked for.
 *
 * Coefficients are sums of the stencil's weights times differences to the neighbours, in canonical order. Barth-Jespersen: the
 * greatest factor in [0, 1] with which no node of the cell gets a value beyond those of the cell and its neighbours; a quadratic
 * polynomial that may leave these bounds anywhere in the cell gives way to the limited slope. Values are scaled by a power of two, so nothing overflows and no digit changes. O(neighbours) per cell and field. */
#include "field_private.h"

/* The factor by which the slope may stay so that the nodes keep within [least, greatest]. */
static double barth_jespersen(const rm_stencil *stencil, const rm_mesh *mesh, rm_lid cell, double value, const double slope[3],
                              double least, double greatest)
{
  const double *c      = mesh->cell_centroid[cell];
  double        factor = 1.0;

  for (int64_t k = stencil->node_offset[cell]; k < stencil->node_offset[cell + 1]; k++) {
    const double *x    = mesh->node_xyz[stencil->node[k]];
    const double  rise = slope[0] * (x[0] - c[0]) + slope[1] * (x[1] - c[1]) + slope[2] * (x[2] - c[2]);

    if (rise > 0.0 && factor * rise > greatest - value) factor = (greatest - value) / rise;
    if (rise < 0.0 && factor * rise < least - value) factor = (least - value) / rise;
  }
  return factor;
}

/* Does a quadratic polynomial keep within [least, greatest] in the hull of the nodes? It lies between the least and the greatest of
 * its polar form, rest + g.(y + z)/2 + h:(y z^T), over pairs of nodes. */
static bool keeps_within(const rm_stencil *stencil, const rm_mesh *mesh, rm_lid cell, double value, const double *slope,
                         const double *curvature, double least, double greatest)
{
  const double *c     = mesh->cell_centroid[cell];
  const int64_t first = stencil->node_offset[cell], end = stencil->node_offset[cell + 1];

  for (int64_t k = first; k < end; k++) {
    const double *x = mesh->node_xyz[stencil->node[k]], y[3] = {x[0] - c[0], x[1] - c[1], x[2] - c[2]};
    const double  at_y = value + curvature[6] + 0.5 * (slope[0] * y[0] + slope[1] * y[1] + slope[2] * y[2]);

    for (int64_t l = first; l <= k; l++) {
      const double *x2 = mesh->node_xyz[stencil->node[l]], z[3] = {x2[0] - c[0], x2[1] - c[1], x2[2] - c[2]};
      const double  polar = at_y + 0.5 * (slope[0] * z[0] + slope[1] * z[1] + slope[2] * z[2]) + rm_form(curvature, y, z);

      if (!(polar >= least && polar <= greatest)) return false;
    }
  }
  return true;
}

void rm_fit_slope(const rm_stencil *stencil, rm_lid cell, const rm_around *u, double slope[3], double bounds[2])
{
  const double value = rm_value_at(u, stencil->num_cells, cell);

  slope[0] = slope[1] = slope[2] = 0.0;
  bounds[0] = bounds[1] = value;
  for (int64_t k = stencil->offset[cell]; k < stencil->offset[cell + 1]; k++) {
    const double other = rm_value_at(u, stencil->num_cells, stencil->neighbour[k]), rise = other - value;

    for (int d = 0; d < 3; d++) slope[d] += stencil->weight[k][d] * rise;
    bounds[0] = fmin(bounds[0], other);
    bounds[1] = fmax(bounds[1], other);
  }
  if (!isfinite(slope[0]) || !isfinite(slope[1]) || !isfinite(slope[2])) slope[0] = slope[1] = slope[2] = 0.0;
}

bool rm_fit_quadratic(const rm_stencil *stencil, rm_lid cell, const rm_around *u, double slope[3], double curvature[7])
{
  const double value   = rm_value_at(u, stencil->num_cells, cell);
  double       fit[9]  = {0.0};
  bool         is_good = !stencil->is_reduced[cell];

  for (int k = 0; k < 7; k++) curvature[k] = 0.0;
  for (int64_t k = stencil->wide_offset[cell]; k < stencil->wide_offset[cell + 1] && is_good; k++) {
    const double rise = rm_value_at(u, stencil->num_cells, stencil->wide_neighbour[k]) - value;

    for (int i = 0; i < 9; i++) fit[i] += stencil->wide_weight[k][i] * rise;
  }
  for (int i = 0; i < 9; i++) is_good = is_good && isfinite(fit[i]);
  if (!is_good) return false;
  for (int i = 0; i < 3; i++) slope[i] = fit[i];
  for (int i = 0; i < 6; i++) curvature[i] = fit[3 + i];
  curvature[6] = -rm_dot6(curvature, stencil->spread[cell]);
  return true;
}

/* A smooth field may leave the neighbours' bounds, at extrema and towards walls: by as much as they lie apart, not past 0. */
static void widen_bounds(double bounds[2])
{
  const double range = bounds[1] - bounds[0];

  bounds[0] = bounds[0] >= 0.0 ? fmax(bounds[0] - range, 0.0) : bounds[0] - range;
  bounds[1] = bounds[1] <= 0.0 ? fmin(bounds[1] + range, 0.0) : bounds[1] + range;
}

/* What became of a cell's reconstruction. */
enum { IS_LIMITED = 1, IS_REDUCED = 2 };

/* Reconstruction and bounds of one field in one cell, into its place in the pack. */
static int reconstruct_cell(const rm_stencil *stencil, const rm_mesh *mesh, rm_lid cell, const rm_around *u, int order,
                            const rm_packing *packing, bool is_smooth, double *place)
{
  const double value = rm_value_at(u, mesh->num_cells, cell);
  double      *slope = place + RM_PACK_SLOPE, *curvature = place + rm_pack_curvature(packing->has_bounds);
  double       linear[3], bounds[2], factor;
  int          what = 0;

  rm_fit_slope(stencil, cell, u, linear, bounds);
  for (int d = 0; d < 3; d++) slope[d] = linear[d];
  if (is_smooth) widen_bounds(bounds);
  if (packing->has_bounds)
    for (int b = 0; b < 2; b++) place[RM_PACK_BOUNDS + b] = bounds[b];
  if (order > 2) {
    if (!rm_fit_quadratic(stencil, cell, u, slope, curvature))
      what |= IS_REDUCED;
    else if (!packing->is_limited || keeps_within(stencil, mesh, cell, value, slope, curvature, bounds[0], bounds[1]))
      return what;
    else
      what |= IS_LIMITED;
    for (int k = 0; k < 7; k++) curvature[k] = 0.0;
  }
  if (!packing->is_limited) return what;
  factor = barth_jespersen(stencil, mesh, cell, value, linear, bounds[0], bounds[1]);
  for (int d = 0; d < 3; d++) slope[d] = factor * linear[d];
  return what | (factor < 1.0 ? IS_LIMITED : 0);
}

/* The mean belongs to the true centroid; what travels is the value at the rounded one, about which the moments are. */
static void move_to_rounded_centroid(const double error[3], double *place)
{
  const double *slope = place + RM_PACK_SLOPE;
  const double  rise  = slope[0] * error[0] + slope[1] * error[1] + slope[2] * error[2];

  if (rise < 0.0 || rise > 0.0) place[0] = (RM_VALUE_SCALE * place[0] - rise) / RM_VALUE_SCALE;
}

void rm_reconstruct(const rm_transfer_setup *setup, const rm_packing *packing, rm_numbers given, rm_numbers rough,
                    const uint8_t *needs_halo, uint8_t which, double *pack, int64_t *limited, int64_t *reduced)
{
  const rm_mesh *mesh = setup->giving;
  const int      num  = packing->num_fields;

  for (rm_lid c = 0; c < mesh->num_cells; c++) { /* cells first: their weights are read once for all fields */
    if (needs_halo[c] != which) continue;
    for (int f = 0; f < num; f++) {
      const rm_around u     = rm_around_of(given, f, num);
      const int       order = packing->order[f];
      double         *place = pack + (int64_t)c * packing->width + packing->at[f];

      place[0] = given.own[(int64_t)c * num + f];
      if (order < 2) continue;
      if (rm_is_mapped(setup->giving_rows->cover[c])) {
        const rm_around r         = rm_around_of(rough, f, num);
        const bool      is_smooth = packing->is_checked && rm_is_smooth(setup->giving_stencil, c, &r);
        const int       what      = reconstruct_cell(setup->giving_stencil, mesh, c, &u, order, packing, is_smooth, place);

        limited[f] += (what & IS_LIMITED) != 0;
        reduced[f] += (what & IS_REDUCED) != 0;
        move_to_rounded_centroid(setup->giving_rows->centroid_error[c], place);
        continue;
      }
      for (int k = RM_PACK_SLOPE; k < rm_pack_width(order, packing->has_bounds); k++) place[k] = 0.0; /* nobody asks for it */
    }
  }
}
