/* caas -- clip and assured sum: receiving values are clipped to the bounds of the givers' neighbourhoods, and what that adds or
 * takes is given back in proportion to the room that every value has left. Content is kept to rounding, and bounds hold,
 * whatever the reconstruction was; the price is a sum over all ranks, exact and therefore the same on any number of them, and
 * that a part of each clipping is spread over the whole mesh. O(pairs) per field. */
#include "field_private.h"

/* Bounds of a cell that takes part, scaled; false for cells that do not: copies, cells without volume, and partial ones whose
 * mean is over the covered part alone (which has been kept within the bounds) or over more than that. */
static bool bounds_of(const rm_receipt *w, int f, rm_lid cell, double old, double bounds[2])
{
  const rm_rows *rows  = w->setup->rows;
  const uint8_t  cover = rows->cover[cell];
  double         given[2];

  if (w->packing->order[f] < 2 || w->packing->system_of[f] >= 0 || !rm_is_mapped(cover)) return false;
  if (rm_is_copied(rows, w->setup->receiving_differs, cell, rm_is_amount(w->packing, f))) return false;
  if (!(w->setup->receiving->cell_volume[cell] > 0.0)) return false;
  bounds[0] = INFINITY;
  bounds[1] = -INFINITY;
  if (cover == REMAP_PARTIAL) {
    if (!rm_keeps_old(w->how, &w->fields[f], cover)) return false;
    bounds[0] = bounds[1] = RM_VALUE_SCALE * old;
    if (w->keeping) rm_pack_read(w->packing, f, rm_pack_of(w->keeping, w->packing, cell), RM_PACK_BOUNDS, 2, bounds);
  }
  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++) {
    rm_pack_read(w->packing, f, w->got + (int64_t)rows->giver[k] * w->packing->width, RM_PACK_BOUNDS, 2, given);
    bounds[0] = given[0] < bounds[0] ? given[0] : bounds[0]; /* not by fmin, which is a call */
    bounds[1] = given[1] > bounds[1] ? given[1] : bounds[1];
  }
  return isfinite(bounds[0]) && isfinite(bounds[1]);
}

/* A cell's volume, by the solver's measure for amounts. */
static double volume_of(const rm_receipt *w, int f, rm_lid cell)
{
  const double volume = w->setup->receiving->cell_volume[cell];

  return w->setup->receiving_measure && rm_is_amount(w->packing, f) ? volume * w->setup->receiving_measure[cell] : volume;
}

static double clip(double x, const double bounds[2]) { return x < bounds[0] ? bounds[0] : x > bounds[1] ? bounds[1] : x; }

void rm_caas_sum(const rm_receipt *w, const double *old, rm_sum *sum)
{
  const int num = w->packing->num_fields;

  for (int k = 0; k < 3 * num; k++) rm_sum_clear(&sum[k]);
  for (rm_lid c = 0; c < w->setup->receiving->num_cells; c++)
    for (int f = 0; f < num; f++) {
      const double volume = volume_of(w, f, c), value = RM_VALUE_SCALE * w->value[(int64_t)c * num + f];
      double       bounds[2], clipped;

      if (!isfinite(value) || !bounds_of(w, f, c, old[(int64_t)c * num + f], bounds)) continue;
      clipped = clip(value, bounds);
      if (clipped < value || clipped > value) { /* else they cancel */
        rm_integral_add(&sum[3 * f], value, volume);
        rm_integral_add(&sum[3 * f], -clipped, volume);
      }
      rm_integral_add(&sum[3 * f + 1], bounds[1] - clipped, volume);
      rm_integral_add(&sum[3 * f + 2], clipped - bounds[0], volume);
    }
}

void rm_caas_settle(const rm_receipt *w, const double *old, const rm_sum *sum, int64_t *limited)
{
  const int num = w->packing->num_fields;

  for (int f = 0; f < num; f++) {
    const double missing = rm_sum_value(&sum[3 * f]), room = rm_sum_value(&sum[3 * f + (missing > 0.0 ? 1 : 2)]);
    const double share = room > 0.0 ? fmin(fabs(missing) / room, 1.0) : 0.0;

    for (rm_lid c = 0; c < w->setup->receiving->num_cells; c++) {
      double      *place  = &w->value[(int64_t)c * num + f], bounds[2], settled;
      const double volume = volume_of(w, f, c), value = RM_VALUE_SCALE * *place;

      if (!isfinite(value) || !bounds_of(w, f, c, old[(int64_t)c * num + f], bounds)) continue;
      settled = clip(value, bounds);
      limited[f] += settled < value || settled > value;
      settled += share * ((missing > 0.0 ? bounds[1] : bounds[0]) - settled);
      *place = settled / RM_VALUE_SCALE;
      if (!w->integral || !(settled < value || settled > value)) continue;
      rm_integral_add(&w->integral[f].minus_target, value, volume);
      rm_integral_add(&w->integral[f].minus_target, -settled, volume);
    }
  }
}
