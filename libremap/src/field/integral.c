/* integral -- what a transfer takes from the giving cells and what arrives, summed without rounding, so that the report is the
 * same on any number of ranks and shows the error of the transfer, not that of a sum. O(cells + pairs of partial cells). */
#include "field_private.h"

/* h:S about a centroid that lies e before the point about which the row has its moments. */
static double curved_part(const rm_rows *rows, int64_t k, const double curvature[7], const double e[3])
{
  const double *m = rows->moment[k];

  return rm_dot6(curvature, rows->second[k]) + 2.0 * rm_form(curvature, e, m) +
         (rm_form(curvature, e, e) + curvature[6]) * rows->volume[k];
}

/* A partial cell gives what its pairs hold. Its rows have moments about the receiving cells' centroids; they are taken back. */
static void add_partial(const rm_rows *rows, rm_lid cell, const double centroid[3], double value, const double *slope,
                        const double *curvature, rm_integral *integral)
{
  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++) {
    const double  volume = rows->volume[k];
    const double *c      = rows->giver_centroid[rows->giver[k]];
    const double  e[3]   = {c[0] - centroid[0], c[1] - centroid[1], c[2] - centroid[2]};

    rm_integral_add(&integral->source, value, volume);
    rm_integral_add(&integral->magnitude, fabs(value), fabs(volume));
    for (int d = 0; d < 3 && slope; d++)
      rm_integral_add(&integral->source, slope[d], rows->moment[k][d] + e[d] * volume);
    if (curvature) rm_integral_add(&integral->source, 1.0, curved_part(rows, k, curvature, e));
  }
}

void rm_integral_source(const rm_transfer_setup *setup, const remap_field_desc *fields, const rm_packing *packing,
                        const double *given, const double *pack, rm_integral *integral)
{
  const rm_rows *rows = setup->giving_rows;
  const rm_mesh *mesh = setup->giving;
  const int      num  = packing->num_fields;

  for (int f = 0; f < num; f++) {
    if (fields[f].nature == REMAP_FLAG) continue;
    for (rm_lid c = 0; c < mesh->num_cells; c++) {
      const double *place  = pack + (int64_t)c * packing->width + packing->at[f];
      const double  value  = RM_VALUE_SCALE * given[(int64_t)c * num + f];
      const double *slope  = packing->order[f] > 1 ? place + RM_PACK_SLOPE : NULL;
      const double *curvature = packing->order[f] > 2 ? place + rm_pack_curvature(packing->has_bounds) : NULL;
      const double  volume = mesh->cell_volume[c];

      if (rows->cover[c] == REMAP_COVERED) {
        rm_integral_add(&integral[f].source, value, volume);
        rm_integral_add(&integral[f].magnitude, fabs(value), fabs(volume));
      } else if (rows->cover[c] == REMAP_PARTIAL) {
        add_partial(rows, c, mesh->cell_centroid[c], value, slope, curvature, &integral[f]);
      }
    }
  }
}

remap_status rm_integral_report(rm_arena *scratch, const rm_transfer_setup *setup, int num_fields, const rm_integral *integral,
                                remap_field_report *reports)
{
  const int n   = num_fields;
  rm_sum   *sum = rm_arena_alloc(scratch, 3 * (int64_t)n, sizeof *sum);

  RM_TRY(rm_comm_agree(setup->comm, sum ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(sum);
  for (int f = 0; f < n; f++) {
    sum[f]         = integral[f].source;
    sum[n + f]     = integral[f].minus_target;
    sum[2 * n + f] = integral[f].magnitude;
  }
  RM_TRY(rm_comm_sum_exact(setup->comm, sum, 3 * n));
  for (int f = 0; f < n; f++) {
    const double magnitude = rm_sum_value(&sum[2 * n + f]);

    reports[f].source_integral = rm_sum_value(&sum[f]) / RM_VALUE_SCALE;
    reports[f].target_integral = (0.0 - rm_sum_value(&sum[n + f])) / RM_VALUE_SCALE;
    rm_sum_merge(&sum[f], &sum[n + f]);
    reports[f].conservation_error = magnitude > 0.0 ? fabs(rm_sum_value(&sum[f])) / magnitude : 0.0;
  }
  return REMAP_OK;
}
