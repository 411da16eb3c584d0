/* supermesh -- --supermesh FILE: the cells in which source and target cells meet, as a mesh of their own with their ancestors.
 * Made after the overlay, which stays as it is; as large as the pairs. */
#include "job.h"

#include <stdlib.h>
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

/* The boundaries of both files; where a face lies on one of each, that of SOURCE. Collective. */
static cli_exit take_boundaries(cli_job *j, cli_boundaries *to, int64_t num_faces, cli_failure *why)
{
  rcgns_boundaries from[2];
  int64_t          num[2];

  for (int side = 0; side < 2; side++) CLI_TRY(cli_side_boundaries(j, (remap_side)side, &from[side], &num[side], why));
  CLI_TRY(cli_boundaries_begin(j->comm, num_faces, from[0].num + from[1].num, to, why));
  for (int side = 0; side < 2; side++)
    CLI_TRY(cli_boundaries_take(j->comm, j->ctx, (remap_side)side, num[side], &from[side], to, why));
  return CLI_DONE;
}

/* In which faces of the files its faces lie; not of SOURCE where --priority cut its cells, nor of dual cells. Collective. */
static cli_exit take_faces(cli_job *j, cli_ancestors *to, rslice_content *content, cli_failure *why)
{
  for (int side = 0; side < 2; side++) {
    const remap_mesh *mesh   = rcgns_mesh(j->file[side]);
    const int64_t    *number = rcgns_face_numbers(j->file[side]);

    if (j->options.location == RCGNS_VERTICES || (j->cut && side == REMAP_SOURCE)) continue;
    CLI_TRY(cli_ancestors_take(j->comm, j->ctx, (remap_side)side, mesh, number, content->mesh->num_faces, to, why));
    content->face_cell[side]   = to->cell[side];
    content->face_number[side] = to->number[side];
  }
  return CLI_DONE;
}

/* The supermesh with ancestors and boundaries as they are numbered in the files. Collective. */
static cli_exit write_supermesh(cli_job *j, remap_supermesh_view *view, int64_t *ancestor, cli_failure *why)
{
  rslice_content content = {.mesh = view, .ancestor = {"AncestorSource", "AncestorTarget"}};
  cli_boundaries b       = {.num = 0};
  cli_ancestors  faces   = {.cell = {NULL, NULL}};
  cli_exit       code;

  CLI_TRY(cli_source_ancestors(j, view, ancestor, why));
  view->cell_ancestor[REMAP_SOURCE] = ancestor;
  code                              = take_boundaries(j, &b, view->num_faces, why);
  content.num_boundaries            = b.num;
  content.boundary_name             = b.name;
  content.boundary_type             = b.type;
  content.face_boundary             = b.face;
  if (code == CLI_DONE) code = take_faces(j, &faces, &content, why);
  if (code == CLI_DONE) code = write_file(j, &content, why);
  cli_boundaries_drop(&b);
  cli_ancestors_drop(&faces);
  return code;
}

/* Pieces of cells have rounded nodes, so that they may overlap what they were cut at; then they are no mesh to make one of. */
static cli_exit from_supermesh(const cli_job *j, remap_status status, cli_failure *why)
{
  if (!j->cut || (status != REMAP_BAD_MESH && status != REMAP_ZONE_OVERLAP)) return cli_from_remap(j, status, why);
  return cli_fail(
      why, CLI_GEOMETRY,
      "%s: by rounding, pieces that --priority leaves do not fit the cells they were cut at: leave --supermesh out, or "
      "the zones of SOURCE in --priority: %s",
      j->options.path[REMAP_SOURCE], remap_message(j->ctx));
}

cli_exit cli_supermesh_write(cli_job *j, cli_failure *why)
{
  cli_supermesh_row   *row = &j->report.supermesh;
  remap_supermesh_view view;
  int64_t             *ancestor;
  cli_exit             code;

  cli_progress_set(j->progress, "supermesh", -1);
  CLI_TRY(from_supermesh(j, remap_supermesh(j->ctx, NULL, &view), why));
  for (int side = 0; side < 2; side++)
    if (view.zone_overlap[side] > 0)
      cli_note(j, "%s: zones overlap by rounding; a volume of %.3g that two of them have counts once in the supermesh",
               j->options.path[side], view.zone_overlap[side]);
  row->cells  = view.global_cells;
  row->volume = view.volume[0]; /* all of it is in both */
  ancestor    = malloc(((size_t)view.num_cells + 1) * sizeof *ancestor);
  code        = cli_agree(j, ancestor ? CLI_DONE : cli_no_memory(why), why);
  if (code == CLI_DONE) code = write_supermesh(j, &view, ancestor, why);
  free(ancestor);
  if (code == CLI_DONE) row->path = j->options.supermesh;
  return code;
}
