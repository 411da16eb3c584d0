/* fit -- least squares in one cell: sums of the stencil's weights times differences to the neighbours, in canonical order.
 *
 * Slopes of a few fields next to each other (a span) are summed side by side in registers: neighbours and weights are read once
 * for all of them, and two fields share each vector. A field gets the same digits with any others beside it. Values
 * are scaled by a power of two, so nothing overflows and no digit changes. O(neighbours) per field. */
#include "field_private.h"
#include "lanes.h"

enum { TWOS = RM_SPAN_FIELDS / 2 };

/* The fit of num fields, of which the first one's numbers are at u and results go to these places. twos, half of num, rounded
 * up, and bounded are constants where this is called, so that each case gets loops of its own. */
RM_UNROLLED void fit_few(const rm_stencil *stencil, rm_lid cell, const rm_around *u, int num, int twos, bool bounded,
                         double *slope, double *bounds)
{
  const int64_t  stride = u->stride;
  const rm_lid   cells = stencil->num_cells, *neighbour = stencil->neighbour;
  const double  *own = u->own, *halo = u->halo, (*weight)[3] = stencil->weight;
  const rm_lanes scale = rm_lanes_of(RM_VALUE_SCALE);
  rm_lanes       value[TWOS], x[TWOS], y[TWOS], z[TWOS], least[TWOS], greatest[TWOS];

  for (int t = 0; t < twos; t++) {
    x[t] = y[t] = z[t] = rm_lanes_of(0.0);
    value[t] = least[t] = greatest[t] = scale * rm_lanes_at(own + cell * stride + 2 * t);
  }
  for (int64_t k = stencil->offset[cell], end = stencil->offset[cell + 1]; k < end; k++) {
    const rm_lid   n     = neighbour[k];
    const double  *there = n < cells ? own + n * stride : halo + (n - cells) * stride;
    const rm_lanes wx = rm_lanes_of(weight[k][0]), wy = rm_lanes_of(weight[k][1]), wz = rm_lanes_of(weight[k][2]);

    for (int t = 0; t < twos; t++) {
      const rm_lanes other = scale * rm_lanes_at(there + 2 * t), rise = other - value[t];

      x[t] += wx * rise;
      y[t] += wy * rise;
      z[t] += wz * rise;
      if (!bounded) continue;
      least[t]    = rm_lanes_least(other, least[t]);
      greatest[t] = rm_lanes_greatest(other, greatest[t]);
    }
  }
  for (int t = 0; t < twos; t++) {
    const rm_flags is_good = rm_lanes_finite(x[t], y[t], z[t]);
    const int      left    = num - 2 * t;

    rm_lanes_put((rm_lanes)((rm_flags)x[t] & is_good), left, slope + 2 * t);
    rm_lanes_put((rm_lanes)((rm_flags)y[t] & is_good), left, slope + stride + 2 * t);
    rm_lanes_put((rm_lanes)((rm_flags)z[t] & is_good), left, slope + 2 * stride + 2 * t);
    if (!bounded) continue;
    rm_lanes_put(least[t], left, bounds + 2 * t);
    rm_lanes_put(greatest[t], left, bounds + stride + 2 * t);
  }
}

/* The same of one field, x and y side by side. */
RM_UNROLLED void fit_one(const rm_stencil *stencil, rm_lid cell, const rm_around *u, bool bounded, double *slope,
                         double *bounds)
{
  const int64_t stride = u->stride;
  const rm_lid  cells = stencil->num_cells, *neighbour = stencil->neighbour;
  const double *own = u->own, *halo = u->halo, (*weight)[3] = stencil->weight;
  const double  value = RM_VALUE_SCALE * own[cell * stride];
  rm_lanes      xy    = rm_lanes_of(0.0);
  double        z = 0.0, least = value, greatest = value;

  for (int64_t k = stencil->offset[cell], end = stencil->offset[cell + 1]; k < end; k++) {
    const rm_lid n     = neighbour[k];
    const double other = RM_VALUE_SCALE * (n < cells ? own + n * stride : halo + (n - cells) * stride)[0];
    const double rise  = other - value;

    xy += rm_lanes_at(weight[k]) * rm_lanes_of(rise);
    z += weight[k][2] * rise;
    least    = bounded && other < least ? other : least;
    greatest = bounded && other > greatest ? other : greatest;
  }
  const bool is_good = rm_is_finite(xy[0]) && rm_is_finite(xy[1]) && rm_is_finite(z);

  slope[0]          = is_good ? xy[0] : 0.0;
  slope[stride]     = is_good ? xy[1] : 0.0;
  slope[2 * stride] = is_good ? z : 0.0;
  if (!bounded) return;
  bounds[0]      = least;
  bounds[stride] = greatest;
}

void rm_fit_slopes(const rm_stencil *stencil, const rm_packing *p, rm_lid cell, rm_numbers numbers, rm_fit out)
{
  const bool bounded = p->has_bounds || p->is_limited;

  for (int i = 0; i < p->num_spans; i++) {
    const int       first = p->span[i].first;
    const rm_around u     = rm_around_of(numbers, first, p->num_fields);
    const int       num   = p->span[i].num;
    double         *slope = out.slope + first, *bounds = out.bounds + first;

    if (num > 2 && bounded)
      fit_few(stencil, cell, &u, num, TWOS, true, slope, bounds);
    else if (num > 2)
      fit_few(stencil, cell, &u, num, TWOS, false, slope, bounds);
    else if (num > 1 && bounded)
      fit_few(stencil, cell, &u, num, 1, true, slope, bounds);
    else if (num > 1)
      fit_few(stencil, cell, &u, num, 1, false, slope, bounds);
    else if (bounded)
      fit_one(stencil, cell, &u, true, slope, bounds);
    else
      fit_one(stencil, cell, &u, false, slope, bounds);
  }
}

bool rm_fit_quadratic(const rm_stencil *stencil, rm_lid cell, const rm_around *u, double slope[3], double curvature[7])
{
  const double    value = rm_value_at(u, stencil->num_cells, cell);
  const rm_around near  = *u; /* this and the sums are copies: no write in the loop can change them */
  rm_lanes        xy = rm_lanes_of(0.0), z_xx = xy, yy_zz = xy, xy_xz = xy; /* coefficients in twos, and the last one: */
  double          yz      = 0.0;
  bool            is_good = !stencil->is_reduced[cell];

  for (int k = 0; k < 7; k++) curvature[k] = 0.0;
  if (!is_good) return false;
  for (int64_t k = stencil->wide_offset[cell], end = stencil->wide_offset[cell + 1]; k < end; k++) {
    const double  *weight = stencil->wide_weight[k];
    const double   rise   = rm_value_at(&near, stencil->num_cells, stencil->wide_neighbour[k]) - value;
    const rm_lanes both   = rm_lanes_of(rise);

    xy += rm_lanes_at(weight) * both;
    z_xx += rm_lanes_at(weight + 2) * both;
    yy_zz += rm_lanes_at(weight + 4) * both;
    xy_xz += rm_lanes_at(weight + 6) * both;
    yz += weight[8] * rise;
  }
  const double fit[9] = {xy[0], xy[1], z_xx[0], z_xx[1], yy_zz[0], yy_zz[1], xy_xz[0], xy_xz[1], yz};
  for (int i = 0; i < 9; i++) is_good = is_good && rm_is_finite(fit[i]);
  if (!is_good) return false;
  for (int i = 0; i < 3; i++) slope[i] = fit[i];
  for (int i = 0; i < 6; i++) curvature[i] = fit[3 + i];
  curvature[6] = -rm_dot6(curvature, stencil->spread[cell]);
  return true;
}
