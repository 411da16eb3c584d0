/* volumes -- cell volumes that solvers wrote, for meshes that they integrate otherwise than over faces of triangles: content is
 * then conserved in their measure. O(cells). */
#include "job.h"

#include <math.h>
#include <stdlib.h>

/* Volumes of the file are those of its own coordinates; those of SOURCE are scaled and transformed. */
static double unit_of(const cli_job *j, remap_side side)
{
  const double(*t)[4] = (const double(*)[4])j->transform;
  const double scale  = j->options.scale;

  if (side == REMAP_TARGET) return 1;
  return scale * scale * scale *
         fabs(t[0][0] * (t[1][1] * t[2][2] - t[1][2] * t[2][1]) - t[0][1] * (t[1][0] * t[2][2] - t[1][2] * t[2][0]) +
              t[0][2] * (t[1][0] * t[2][1] - t[1][1] * t[2][0]));
}

/* Bring the volumes to the unit of the mesh; all must be above 0. */
static cli_exit convert(cli_job *j, remap_side side, cli_failure *why)
{
  const rcgns_info *info = rcgns_get_info(j->file[side]);
  const remap_mesh *mesh = rcgns_mesh(j->file[side]);
  const double      unit = unit_of(j, side);

  for (int64_t c = 0; c < mesh->num_cells; c++) {
    const rcgns_zone_info *zone = cli_zone_of(info, mesh->cell_global[c]);
    double                *v    = &j->volume[side][c];

    *v *= unit;
    if (!(*v > 0) || isinf(*v))
      return cli_fail(why, CLI_IO,
                      "%s: zone %s: cell %lld (counted from 1): its %s is no volume above 0: leave --%s-volume out", info->path,
                      zone->name, (long long)(mesh->cell_global[c] - zone->first_cell + 1), j->options.volume[side],
                      side == REMAP_SOURCE ? "source" : "target");
  }
  return CLI_DONE;
}

cli_exit cli_volumes_read(cli_job *j, cli_failure *why)
{
  for (int side = 0; side < 2; side++) {
    rcgns_message message;

    if (!j->options.volume[side]) continue;
    j->volume[side] = malloc(((size_t)rcgns_mesh(j->file[side])->num_cells + 1) * sizeof(double));
    CLI_TRY(cli_agree(j, j->volume[side] ? CLI_DONE : cli_no_memory(why), why));
    CLI_TRY(cli_from_cgns(rcgns_read_cells(j->file[side], j->options.volume[side], j->volume[side], &message), &message, why));
    CLI_TRY(cli_agree(j, convert(j, (remap_side)side, why), why));
    j->report.volume[side] = j->options.volume[side];
  }
  return CLI_DONE;
}

/* Volumes by another rule differ by a few per cent, of thin curved cells by tens; what differs by 90 % is none. */
void cli_volumes_doubt(cli_job *j)
{
  const remap_stats *stats = &j->report.stats;

  for (int side = 0; side < 2; side++)
    if (stats->max_volume_difference[side] > .9)
      cli_note(j, "%s: field %s differs from the volume of a cell by %.3g times that: see whether it holds volumes",
               j->report.info[side]->path, j->options.volume[side], stats->max_volume_difference[side]);
}
