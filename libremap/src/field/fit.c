/* fit -- least squares in one cell: sums of the stencil's weights times differences to the neighbours, in canonical order.
 *
 * A few fields next to each other (a span) are summed side by side in registers: neighbours and weights are read once for all
 * of them, and two fields share each vector. A field gets the same digits with any others beside it. Values are scaled by a
 * power of two, so nothing overflows and no digit changes. O(neighbours) per field. */
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
    rm_lanes_put((rm_lanes)((rm_flags)y[t] & is_good), left, slope + num + 2 * t);
    rm_lanes_put((rm_lanes)((rm_flags)z[t] & is_good), left, slope + 2 * num + 2 * t);
    if (!bounded) continue;
    rm_lanes_put(least[t], left, bounds + 2 * t);
    rm_lanes_put(greatest[t], left, bounds + num + 2 * t);
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

  slope[0] = is_good ? xy[0] : 0.0;
  slope[1] = is_good ? xy[1] : 0.0;
  slope[2] = is_good ? z : 0.0;
  if (!bounded) return;
  bounds[0] = least;
  bounds[1] = greatest;
}

void rm_fit_slopes(const rm_stencil *stencil, rm_lid cell, const rm_around *u, int num, double *slope, double *bounds)
{
  if (num > 2 && bounds)
    fit_few(stencil, cell, u, num, TWOS, true, slope, bounds);
  else if (num > 2)
    fit_few(stencil, cell, u, num, TWOS, false, slope, NULL);
  else if (num > 1 && bounds)
    fit_few(stencil, cell, u, num, 1, true, slope, bounds);
  else if (num > 1)
    fit_few(stencil, cell, u, num, 1, false, slope, NULL);
  else if (bounds)
    fit_one(stencil, cell, u, true, slope, bounds);
  else
    fit_one(stencil, cell, u, false, slope, NULL);
}

/* Bounds alone; twos is a constant where this is called. */
RM_UNROLLED void bound_few(const rm_stencil *stencil, rm_lid cell, const rm_around *u, int num, int twos, double *bounds)
{
  const int64_t  stride = u->stride;
  const rm_lid   cells = stencil->num_cells, *neighbour = stencil->neighbour;
  const double  *own = u->own, *halo = u->halo;
  const rm_lanes scale = rm_lanes_of(RM_VALUE_SCALE);
  rm_lanes       least[TWOS], greatest[TWOS];

  for (int t = 0; t < twos; t++) least[t] = greatest[t] = rm_lanes_at(own + cell * stride + 2 * t);
  for (int64_t k = stencil->offset[cell], end = stencil->offset[cell + 1]; k < end; k++) {
    const rm_lid  n     = neighbour[k];
    const double *there = n < cells ? own + n * stride : halo + (n - cells) * stride;

    for (int t = 0; t < twos; t++) {
      const rm_lanes other = rm_lanes_at(there + 2 * t);

      least[t]    = rm_lanes_least(other, least[t]);
      greatest[t] = rm_lanes_greatest(other, greatest[t]);
    }
  }
  for (int t = 0; t < twos; t++) {
    rm_lanes_put(scale * least[t], num - 2 * t, bounds + 2 * t);
    rm_lanes_put(scale * greatest[t], num - 2 * t, bounds + num + 2 * t);
  }
}

void rm_fit_bounds(const rm_stencil *stencil, rm_lid cell, const rm_around *u, int num, double *bounds)
{
  if (num > 2)
    bound_few(stencil, cell, u, num, TWOS, bounds);
  else
    bound_few(stencil, cell, u, num, 1, bounds);
}

/* The polynomials of two fields, the first one's numbers at u, side by side: coefficients to fit[9]. */
static void fit_two(const rm_stencil *stencil, rm_lid cell, const rm_around *u, rm_lanes fit[9])
{
  const int64_t  stride = u->stride;
  const rm_lid   cells = stencil->num_cells, *neighbour = stencil->wide_neighbour;
  const double  *own = u->own, *halo = u->halo;
  const rm_lanes scale = rm_lanes_of(RM_VALUE_SCALE), value = scale * rm_lanes_at(own + cell * stride);
  rm_lanes       sum[9];

  for (int i = 0; i < 9; i++) sum[i] = rm_lanes_of(0.0);
  for (int64_t k = stencil->wide_offset[cell], end = stencil->wide_offset[cell + 1]; k < end; k++) {
    const rm_lid   n     = neighbour[k];
    const double  *there = n < cells ? own + n * stride : halo + (n - cells) * stride, *weight = stencil->wide_weight[k];
    const rm_lanes rise  = scale * rm_lanes_at(there) - value;

    for (int i = 0; i < 9; i++) sum[i] += rm_lanes_of(weight[i]) * rise;
  }
  for (int i = 0; i < 9; i++) fit[i] = sum[i];
}

/* That of one field, its coefficients in twos; second lanes of fit[] are not set. */
static void fit_alone(const rm_stencil *stencil, rm_lid cell, const rm_around *u, rm_lanes fit[9])
{
  const double    value = rm_value_at(u, stencil->num_cells, cell);
  const rm_around near  = *u; /* this and the sums are copies: no write in the loop can change them */
  rm_lanes        two[4];
  double          last = 0.0;

  for (int i = 0; i < 4; i++) two[i] = rm_lanes_of(0.0);
  for (int64_t k = stencil->wide_offset[cell], end = stencil->wide_offset[cell + 1]; k < end; k++) {
    const double  *weight = stencil->wide_weight[k];
    const double   rise   = rm_value_at(&near, stencil->num_cells, stencil->wide_neighbour[k]) - value;
    const rm_lanes both   = rm_lanes_of(rise);

    for (int i = 0; i < 4; i++) two[i] += rm_lanes_at(weight + 2 * i) * both;
    last += weight[8] * rise;
  }
  for (int i = 0; i < 8; i++) fit[i] = rm_lanes_of(two[i / 2][i % 2]);
  fit[8] = rm_lanes_of(last);
}

unsigned rm_fit_quadratic(const rm_stencil *stencil, rm_lid cell, const rm_around *u, int num, double *slope,
                          double *curvature)
{
  const double *spread = stencil->spread[cell];
  unsigned      found  = 0;

  for (int f = 0; f < num; f += 2) {
    const rm_around here = {u->own + f, u->halo ? u->halo + f : NULL, u->stride};
    const int       left = num - f;
    rm_lanes        fit[9], constant = rm_lanes_of(0.0);
    rm_flags        is_good = {0, 0};

    for (int i = 0; i < 9; i++) fit[i] = rm_lanes_of(0.0);
    if (!stencil->is_reduced[cell]) {
      if (left > 1)
        fit_two(stencil, cell, &here, fit);
      else
        fit_alone(stencil, cell, &here, fit);
      is_good = rm_lanes_finite(fit[0], fit[1], fit[2]) & rm_lanes_finite(fit[3], fit[4], fit[5]) &
                rm_lanes_finite(fit[6], fit[7], fit[8]);
    }
    for (int i = 0; i < 9; i++) {
      fit[i] = (rm_lanes)((rm_flags)fit[i] & is_good);
      rm_lanes_put(fit[i], left, (i < 3 ? slope + i * num : curvature + (i - 3) * num) + f);
    }
    for (int i = 0; i < 6; i++) constant -= fit[3 + i] * rm_lanes_of(spread[i]);
    rm_lanes_put(constant, left, curvature + 6 * num + f);
    for (int i = 0; i < 2 && i < left; i++) found |= is_good[i] ? 1u << (f + i) : 0u;
  }
  return found;
}
