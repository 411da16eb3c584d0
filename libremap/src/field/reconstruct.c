/* reconstruct -- what giving cells send: their value and, at order 2, a slope about their centroid, limited if asked for.
 *
 * The slope is the sum of the stencil's weights times differences to the neighbours, in canonical order. Barth-Jespersen: the
 * greatest factor in [0, 1] with which no node of the cell gets a value beyond those of the cell and its neighbours. Values are
 * scaled by a power of two, so nothing overflows and no digit changes. O(neighbours) per cell and field. */
#include "field_private.h"

/* Values of one field: own cells, then the halo's. */
typedef struct around {
  const double *own, *halo;
  int64_t       stride;
} around;

static double value_at(const around *u, rm_lid num_cells, rm_lid cell)
{
  return RM_VALUE_SCALE * (cell < num_cells ? u->own[cell * u->stride] : u->halo[(cell - num_cells) * u->stride]);
}

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

/* Slope and bounds of one field in one cell, into its place in the pack. True if the slope was reduced. */
static bool reconstruct_cell(const rm_stencil *stencil, const rm_mesh *mesh, rm_lid cell, const around *u,
                             const rm_packing *packing, double *place)
{
  const double value = value_at(u, mesh->num_cells, cell);
  double       least = value, greatest = value, factor = 1.0, *slope = place + RM_PACK_SLOPE;

  slope[0] = slope[1] = slope[2] = 0.0;
  for (int64_t k = stencil->offset[cell]; k < stencil->offset[cell + 1]; k++) {
    const double other = value_at(u, mesh->num_cells, stencil->neighbour[k]), rise = other - value;

    for (int d = 0; d < 3; d++) slope[d] += stencil->weight[k][d] * rise;
    least    = fmin(least, other);
    greatest = fmax(greatest, other);
  }
  if (!isfinite(slope[0]) || !isfinite(slope[1]) || !isfinite(slope[2])) slope[0] = slope[1] = slope[2] = 0.0;
  if (packing->is_limited) {
    factor = barth_jespersen(stencil, mesh, cell, value, slope, least, greatest);
    for (int d = 0; d < 3; d++) slope[d] *= factor;
  }
  if (packing->has_bounds) {
    place[RM_PACK_BOUNDS]     = least;
    place[RM_PACK_BOUNDS + 1] = greatest;
  }
  return factor < 1.0;
}

/* The mean belongs to the true centroid; what travels is the value at the rounded one, about which the moments are. */
static void move_to_rounded_centroid(const double error[3], double *place)
{
  const double *slope = place + RM_PACK_SLOPE;
  const double  rise  = slope[0] * error[0] + slope[1] * error[1] + slope[2] * error[2];

  if (rise < 0.0 || rise > 0.0) place[0] = (RM_VALUE_SCALE * place[0] - rise) / RM_VALUE_SCALE;
}

void rm_reconstruct(const rm_transfer_setup *setup, const rm_packing *packing, const double *given, const double *halo,
                    const uint8_t *needs_halo, uint8_t which, double *pack, int64_t *limited)
{
  const rm_mesh *mesh = setup->giving;
  const int      num  = packing->num_fields;

  for (rm_lid c = 0; c < mesh->num_cells; c++) { /* cells first: their weights are read once for all fields */
    if (needs_halo[c] != which) continue;
    for (int f = 0; f < num; f++) {
      const around u     = {given + f, halo ? halo + f : NULL, num};
      double      *place = pack + (int64_t)c * packing->width + packing->at[f];

      place[0] = given[(int64_t)c * num + f];
      if (packing->order[f] < 2) continue;
      if (rm_is_mapped(setup->giving_rows->cover[c])) {
        limited[f] += reconstruct_cell(setup->giving_stencil, mesh, c, &u, packing, place);
        move_to_rounded_centroid(setup->giving_rows->centroid_error[c], place);
        continue;
      }
      for (int k = RM_PACK_SLOPE; k < (packing->has_bounds ? 6 : 4); k++) place[k] = 0.0; /* nobody asks for this cell */
    }
  }
}
