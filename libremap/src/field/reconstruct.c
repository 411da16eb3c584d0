/* reconstruct -- what giving cells send: their value and, at order 2, a slope about their centroid, limited if asked for.
 *
 * The slope is the sum of the stencil's weights times differences to the neighbours, in canonical order. Barth-Jespersen: the
 * greatest factor in [0, 1] with which no node of the cell gets a value beyond those of the cell and its neighbours. Values are
 * scaled by a power of two, so nothing overflows and no digit changes. O(neighbours) per cell and field; one exchange among
 * neighbours for all fields. */
#include "field_private.h"

/* Values of one cell's neighbourhood: own cells from the caller's array, others from the halo. */
typedef struct around {
  const double *own, *halo; /* halo [num_halo][stride], this field's first value */
  int64_t       stride;
  double        scale;
} around;

static double value_at(const around *u, rm_lid num_cells, rm_lid cell)
{
  return u->scale * (cell < num_cells ? u->own[cell] : u->halo[(cell - num_cells) * u->stride]);
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
static void move_to_rounded_centroid(const double error[3], double scale, double *place)
{
  const double *slope = place + RM_PACK_SLOPE;
  const double  rise  = slope[0] * error[0] + slope[1] * error[1] + slope[2] * error[2];

  if (rise < 0.0 || rise > 0.0) place[0] = (scale * place[0] - rise) / scale;
}

/* Values of all fields side by side, for the halo exchange. */
static void interleave(rm_lid num_cells, int num_fields, const remap_field_desc *fields, double *item)
{
  for (int f = 0; f < num_fields; f++)
    for (rm_lid c = 0; c < num_cells; c++) item[(int64_t)c * num_fields + f] = fields[f].in[c];
}

/* The halo's values, [num_halo][num_fields]. Collective. */
static remap_status fetch_halo(rm_arena *arena, const rm_transfer_setup *setup, int num_fields, const remap_field_desc *fields,
                               double **out)
{
  const rm_stencil *stencil = setup->giving_stencil;
  const rm_plan    *plan    = stencil->plan;
  const int64_t     sent    = plan->send_offset[plan->num_send];
  double           *item    = rm_arena_alloc(arena, rm_mul_sat(stencil->num_cells, num_fields), sizeof *item);
  double           *halo    = rm_arena_alloc(arena, rm_mul_sat(stencil->num_halo, num_fields), sizeof *halo);
  double           *buffer  = rm_arena_alloc(arena, rm_mul_sat(sent, num_fields), sizeof *buffer);

  RM_TRY(rm_comm_agree(setup->comm, item && halo && buffer ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(item && halo && buffer);
  interleave(stencil->num_cells, num_fields, fields, item);
  *out = halo;
  return rm_plan_run(setup->comm, plan, (size_t)num_fields * sizeof *item, item, halo, buffer);
}

remap_status rm_reconstruct(rm_arena *arena, const rm_transfer_setup *setup, int num_fields, const remap_field_desc *fields,
                            const rm_packing *packing, double *pack, int64_t *limited)
{
  const rm_mesh *mesh       = setup->giving;
  double        *halo       = NULL;
  bool           has_slopes = false;

  for (int f = 0; f < num_fields; f++) has_slopes |= packing->order[f] > 1;
  if (has_slopes) RM_TRY(fetch_halo(arena, setup, num_fields, fields, &halo));
  for (int f = 0; f < num_fields; f++) limited[f] = 0;
  for (rm_lid c = 0; c < mesh->num_cells; c++) /* cells first: their weights are read once for all fields */
    for (int f = 0; f < num_fields; f++) {
      const around u     = {fields[f].in, halo ? halo + f : NULL, num_fields, packing->scale[f]};
      double      *place = pack + (int64_t)c * packing->width + packing->at[f];

      place[0] = fields[f].in[c];
      if (packing->order[f] < 2) continue;
      if (setup->giving_rows->cover[c] != REMAP_UNCOVERED) {
        limited[f] += reconstruct_cell(setup->giving_stencil, mesh, c, &u, packing, place);
        move_to_rounded_centroid(setup->giving_rows->centroid_error[c], packing->scale[f], place);
        continue;
      }
      for (int k = RM_PACK_SLOPE; k < (packing->has_bounds ? 6 : 4); k++) place[k] = 0.0; /* nobody asks for this cell */
    }
  return REMAP_OK;
}
