/* smooth -- which cells lie where a field is smooth, for the limiter `auto` (libremap/doc/limiters.md).
 *
 * In smooth parts the difference of two neighbours is what the mean of their slopes says, up to the third order of their
 * distance: to the second at walls and on uneven meshes. At a jump it errs by a part of the jump, about one half. So a cell is
 * as rough as
 *
 *   max over k of |u_k - u - (g + g_k).d_k / 2|  /  max over k of R_k,
 *
 * R_k being the range of values around neighbour k. It is of the first order of the cells' size where the slope is not 0. At
 * smooth extrema numerator and range fall with the square of the size; slopes on uneven meshes err by as much there, and it is
 * that R_k looks one layer farther which keeps the quotient small. Somewhere within two layers of a jump it is 1/4 to 1/2,
 * however small the jump. A cell is smooth if no cell within three layers of neighbours is rougher than a threshold below that:
 * a jump of one and a half cells before a wall looks linear from the wall, and is rough only on its far side.
 *
 * Slopes and ranges of other ranks' cells come in one exchange, roughness in three. O(neighbours) per cell and field. */
#include "field_private.h"
#include "lanes.h"

#include <string.h>

static const double ROUGH = 0.2;

void rm_smooth_slopes(const rm_stencil *stencil, const rm_packing *packing, rm_numbers given, double *slope, double *bounds)
{
  const int num = packing->num_fields;

  for (rm_lid c = 0; c < stencil->num_cells; c++, slope += 4 * num, bounds += 2 * num) {
    rm_fit_slopes(stencil, packing, c, given, (rm_fit){slope, bounds});
    for (int f = 0; f < num; f++) {
      const rm_around u = rm_around_of(given, f, num);
      double          g[3], curvature[7];

      if (packing->order[f] < 2) continue;
      slope[3 * num + f] = bounds[num + f] - bounds[f];
      if (packing->order[f] < 3 || !rm_fit_quadratic(stencil, c, &u, g, curvature)) continue;
      for (int d = 0; d < 3; d++) slope[d * num + f] = g[d];
    }
  }
}

enum { TWOS = RM_SPAN_FIELDS / 2 };

/* Errors and ranges of one cell in 2 twos fields, of which the first one's numbers are at u and slopes at g. */
RM_UNROLLED void errors_of_twos(const rm_stencil *stencil, const rm_mesh *mesh, rm_lid cell, int twos, const rm_around *u,
                                const rm_around *g, rm_lanes error[TWOS], rm_lanes range[TWOS])
{
  const int64_t  num   = u->stride;
  const rm_lid   cells = stencil->num_cells;
  const double  *slope = g->own + cell * g->stride, *c = mesh->cell_centroid[cell];
  const rm_lanes scale = rm_lanes_of(RM_VALUE_SCALE);
  rm_lanes       value[TWOS], most[TWOS], widest[TWOS], own[3][TWOS];

  for (int t = 0; t < twos; t++) {
    most[t] = widest[t] = rm_lanes_of(0.0);
    value[t]            = scale * rm_lanes_at(u->own + cell * num + 2 * t);
    for (int d = 0; d < 3; d++) own[d][t] = rm_lanes_at(slope + d * num + 2 * t);
  }
  for (int64_t k = stencil->offset[cell], end = stencil->offset[cell + 1]; k < end; k++) {
    const rm_lid   n       = stencil->neighbour[k];
    const bool     is_own  = n < cells;
    const double  *x       = is_own ? mesh->cell_centroid[n] : stencil->halo_centroid[n - cells];
    const double  *there   = is_own ? u->own + n * num : u->halo + (n - cells) * num;
    const double  *other   = is_own ? g->own + n * g->stride : g->halo + (n - cells) * g->stride;
    const rm_lanes half[3] = {rm_lanes_of(0.5 * (x[0] - c[0])), rm_lanes_of(0.5 * (x[1] - c[1])),
                              rm_lanes_of(0.5 * (x[2] - c[2]))};

    for (int t = 0; t < twos; t++) {
      rm_lanes wrong = scale * rm_lanes_at(there + 2 * t) - value[t], told = (own[0][t] + rm_lanes_at(other + 2 * t)) * half[0];

      for (int d = 1; d < 3; d++) told += (own[d][t] + rm_lanes_at(other + d * num + 2 * t)) * half[d];
      wrong     = rm_lanes_magnitude(wrong - told);
      most[t]   = rm_lanes_greatest(wrong, most[t]);
      widest[t] = rm_lanes_greatest(rm_lanes_at(other + 3 * num + 2 * t), widest[t]);
    }
  }
  for (int t = 0; t < twos; t++) {
    error[t] = most[t];
    range[t] = widest[t];
  }
}

void rm_smooth_roughness(const rm_stencil *stencil, const rm_mesh *mesh, const rm_packing *packing, rm_numbers given,
                         rm_numbers slope, double *rough)
{
  const int num = packing->num_fields;

  for (rm_lid c = 0; c < stencil->num_cells; c++) {
    for (int f = 0; f < num && packing->num_flags > 0; f++) rough[(int64_t)c * num + f] = 0.0;
    for (int i = 0; i < packing->num_spans; i++) {
      const int       first = packing->span[i].first;
      const rm_around u = rm_around_of(given, first, num), g = {slope.own + first, slope.halo + first, 4 * (int64_t)num};
      double         *at = rough + (int64_t)c * num + first;
      rm_lanes        error[TWOS], range[TWOS];

      if (packing->span[i].num > 2)
        errors_of_twos(stencil, mesh, c, TWOS, &u, &g, error, range);
      else
        errors_of_twos(stencil, mesh, c, 1, &u, &g, error, range);
      for (int f = 0; f < packing->span[i].num; f++) at[f] = error[f / 2][f % 2] > ROUGH * range[f / 2][f % 2] ? 1.0 : 0.0;
    }
  }
}

void rm_smooth_spread(const rm_ground *ground, const uint8_t *needs_halo, const rm_packing *packing, rm_numbers rough,
                      double *spread)
{
  const rm_stencil *stencil = ground->stencil;
  const int         num     = packing->num_fields;

  memcpy(spread, rough.own, (size_t)stencil->num_cells * (size_t)num * sizeof *spread);
  for (rm_lid c = 0; c < stencil->num_cells;
       c++) { /* from the rough cells, which are few, but for those that are nobody's neighbour */
    const int64_t first = stencil->offset[c], end = stencil->offset[c + 1];

    for (int f = 0; f < num && ground->rows->cover[c] != REMAP_UNWANTED; f++) {
      if (!(rough.own[(int64_t)c * num + f] > 0.0)) continue;
      for (int64_t k = first; k < end; k++)
        if (stencil->neighbour[k] < stencil->num_cells) spread[(int64_t)stencil->neighbour[k] * num + f] = 1.0;
    }
    for (int64_t k = first; k < end && needs_halo[c]; k++)
      for (int f = 0; f < num && stencil->neighbour[k] >= stencil->num_cells; f++)
        if (rough.halo[(int64_t)(stencil->neighbour[k] - stencil->num_cells) * num + f] > 0.0)
          spread[(int64_t)c * num + f] = 1.0;
  }
}
