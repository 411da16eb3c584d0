/* integral -- what a transfer takes from the giving cells and what arrives, summed without rounding, so that the report is the
 * same on any number of ranks and shows the error of the transfer, not that of a sum. O(cells + pairs of partial cells). */
#include "field_private.h"

/* A partial cell gives what its pairs hold. Its rows have moments about the receiving cells' centroids; they are taken back. */
static void add_partial(const rm_ground *ground, const rm_rows *back, rm_lid cell, double value, const double *slope,
                        const double *curvature, rm_integral *integral)
{
  const rm_rows *rows = ground->rows;

  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++) {
    double       moment[3], m[3], second[6];
    const double volume = rm_mapping_pair(rows, back, ground->mesh, cell, k, moment);

    rm_integral_add(&integral->source, value, volume);
    rm_integral_add(&integral->magnitude, fabs(value), fabs(volume));
    if (!slope) continue;
    rm_moments_about(rows, k, volume, moment, ground->mesh->cell_centroid[cell], m, second);
    for (int d = 0; d < 3; d++) rm_integral_add(&integral->source, slope[d], m[d]);
    if (curvature) rm_integral_add(&integral->source, 1.0, rm_dot6(curvature, second) + curvature[6] * volume);
  }
}

void rm_integral_source(const rm_profile *w, const rm_rows *back, const rm_packing *packing, rm_integral *integral)
{
  const rm_rows *rows = w->ground.rows;
  const rm_mesh *mesh = w->ground.mesh;
  const int      num  = packing->num_fields;

  for (int f = 0; f < num; f++) {
    if (packing->fields[f].nature == REMAP_FLAG) continue;
    for (rm_lid c = 0; c < mesh->num_cells; c++) {
      const double *place   = rm_pack_of(w, packing, c);
      const double  amount  = rm_system_amount(packing, f, w->given + (int64_t)c * num, w->number + (int64_t)c * num);
      const double  measure = w->ground.measure && rm_is_amount(packing, f) ? w->ground.measure[c] : 1.0;
      const double  value = RM_VALUE_SCALE * amount * measure, volume = mesh->cell_volume[c];
      double        slope[3], curvature[7];

      if (rows->cover[c] == REMAP_COVERED) {
        rm_integral_add(&integral[f].source, value, volume);
        rm_integral_add(&integral[f].magnitude, fabs(value), fabs(volume));
      } else if (rows->cover[c] == REMAP_PARTIAL) {
        if (packing->degree[f] > 0) rm_pack_read(packing, f, place, RM_PACK_SLOPE, 3, slope);
        if (packing->degree[f] > 1) rm_pack_read(packing, f, place, rm_pack_curvature(packing->has_bounds), 7, curvature);
        add_partial(&w->ground, back, c, value, packing->degree[f] > 0 ? slope : NULL,
                    packing->degree[f] > 1 ? curvature : NULL, &integral[f]);
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
