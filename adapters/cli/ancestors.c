/* ancestors -- in which faces of both operands those of a supermesh lie, as their files call them. Linear in the faces. */
#include "command.h"

#include <stdlib.h>

/* The cell beside each face of an operand, and what the file calls that face. */
static void name_faces(const remap_mesh *mesh, const int64_t *number, int64_t *cell, int64_t *face)
{
  for (int64_t f = 0; f < mesh->num_faces; f++) {
    const int64_t owner = mesh->face_owner[f];

    cell[f] = (mesh->cell_global ? mesh->cell_global[owner] : owner) + 1;
    face[f] = number ? number[f] : f + 1;
  }
}

cli_exit cli_ancestors_take(MPI_Comm comm, remap_context *ctx, remap_side side, const remap_mesh *mesh, const int64_t *number,
                            int64_t num_faces, cli_ancestors *to, cli_failure *why)
{
  const size_t num    = (size_t)mesh->num_faces + 1, room = (size_t)num_faces + 1;
  int64_t     *cell   = malloc(num * sizeof *cell), *face = malloc(num * sizeof *face);
  remap_status status = REMAP_OK;
  cli_exit     code;

  to->cell[side]   = malloc(room * sizeof *to->cell[side]);
  to->number[side] = malloc(room * sizeof *to->number[side]);
  code = cli_agree_on(comm, cell && face && to->cell[side] && to->number[side] ? CLI_DONE : cli_no_memory(why), why);
  if (code == CLI_DONE) {
    name_faces(mesh, number, cell, face);
    status = remap_supermesh_face_numbers(ctx, side, cell, 0, to->cell[side]);
    if (status == REMAP_OK) status = remap_supermesh_face_numbers(ctx, side, face, 0, to->number[side]);
    if (status != REMAP_OK) code = cli_fail(why, CLI_INTERNAL, "faces of a supermesh: %s", remap_status_text(status));
  }
  free(cell);
  free(face);
  return code;
}

void cli_ancestors_drop(cli_ancestors *ancestors)
{
  for (int side = 0; side < 2; side++) {
    free(ancestors->cell[side]);
    free(ancestors->number[side]);
  }
  *ancestors = (cli_ancestors){.cell = {NULL, NULL}};
}
