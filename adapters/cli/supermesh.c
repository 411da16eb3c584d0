/* supermesh -- --supermesh FILE: the cells in which source and target cells meet, as a mesh of their own with their ancestors.
 * Made after the overlay, which stays as it is; as large as the pairs. */
#include "job.h"

#include <string.h>
#include <vtk.h>

#define CGNS_VERSION 4.2 /* what most readers of ElementStartOffset want */

static cli_exit write_file(cli_job *j, const rslice_content *content, cli_failure *why)
{
  const char   *path = j->options.supermesh;
  rcgns_message message;
  rvtk_message  text;
  rvtk_status   status;

  if (!rvtk_is_path(path))
    return cli_from_cgns(rcgns_write_supermesh(j->comm, path, CGNS_VERSION, content, &message), &message, why);
  status = rvtk_write(j->comm, path, content, &text);
  return status == RVTK_OK ? CLI_DONE : cli_fail(why, status == RVTK_IO ? CLI_IO : CLI_INTERNAL, "%s", text.text);
}

cli_exit cli_supermesh_write(cli_job *j, cli_failure *why)
{
  remap_supermesh_view view;
  const rslice_content content = {.mesh = &view, .ancestor = {"AncestorSource", "AncestorTarget"}};
  cli_supermesh_row   *row     = &j->report.supermesh;

  cli_progress_set(j->progress, "supermesh", -1);
  CLI_TRY(cli_from_remap(j, remap_supermesh(j->ctx, NULL, &view), why));
  row->cells  = view.global_cells;
  row->volume = 0;
  for (int64_t c = 0; c < view.num_cells; c++) row->volume += view.cell_volume[c];
  MPI_Allreduce(MPI_IN_PLACE, &row->volume, 1, MPI_DOUBLE, MPI_SUM, j->comm);
  CLI_TRY(write_file(j, &content, why));
  row->path = j->options.supermesh;
  return CLI_DONE;
}
