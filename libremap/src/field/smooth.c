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

#include <string.h>

static const double ROUGH = 0.2;

void rm_smooth_slopes(const rm_stencil *stencil, const rm_packing *packing, rm_numbers given, double (*slope)[4])
{
  const int num = packing->num_fields;

  for (rm_lid c = 0; c < stencil->num_cells; c++)
    for (int f = 0; f < num; f++) {
      const rm_around u = rm_around_of(given, f, num);
      double          bounds[2], curvature[7], *g = slope[(int64_t)c * num + f];

      if (packing->order[f] > 1) rm_fit_slope(stencil, c, &u, g, bounds);
      if (packing->order[f] > 2) (void)rm_fit_quadratic(stencil, c, &u, g, curvature);
      if (packing->order[f] > 1) g[3] = bounds[1] - bounds[0];
    }
}

/* Is a cell rough in field number f? */
static bool is_rough(const rm_stencil *stencil, const rm_mesh *mesh, rm_lid cell, int f, int num, const rm_around *u,
                     const double (*slope)[4], const double (*halo_slope)[4])
{
  const double  value = rm_value_at(u, stencil->num_cells, cell);
  const double *c = mesh->cell_centroid[cell], *g = slope[(int64_t)cell * num + f];
  double        error = 0.0, range = 0.0;

  for (int64_t k = stencil->offset[cell]; k < stencil->offset[cell + 1]; k++) {
    const rm_lid  n     = stencil->neighbour[k];
    const bool    own   = n < stencil->num_cells;
    const double *x     = own ? mesh->cell_centroid[n] : stencil->halo_centroid[n - stencil->num_cells];
    const double *other = own ? slope[(int64_t)n * num + f] : halo_slope[(int64_t)(n - stencil->num_cells) * num + f];
    const double  rise  = rm_value_at(u, stencil->num_cells, n) - value;
    double        told  = 0.0;

    for (int d = 0; d < 3; d++) told += 0.5 * (g[d] + other[d]) * (x[d] - c[d]);
    error = fmax(error, fabs(rise - told));
    range = fmax(range, other[3]);
  }
  return error > ROUGH * range;
}

void rm_smooth_roughness(const rm_stencil *stencil, const rm_mesh *mesh, const rm_packing *packing, rm_numbers given,
                         const double (*slope)[4], const double (*halo_slope)[4], double *rough)
{
  const int num = packing->num_fields;

  for (rm_lid c = 0; c < stencil->num_cells; c++)
    for (int f = 0; f < num; f++) {
      const rm_around u = rm_around_of(given, f, num);

      rough[(int64_t)c * num + f] =
          packing->order[f] > 1 && is_rough(stencil, mesh, c, f, num, &u, slope, halo_slope) ? 1.0 : 0.0;
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
