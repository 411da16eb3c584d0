/* boundaries -- the boundary conditions of both operands of a supermesh, taken over to its faces. Linear in the faces. */
#include "command.h"

#include <stdlib.h>
#include <string.h>

cli_exit cli_boundaries_begin(MPI_Comm comm, int64_t num_faces, int most, cli_boundaries *out, cli_failure *why)
{
  *out = (cli_boundaries){.num_faces = num_faces,
                          .name      = calloc((size_t)most + 1, sizeof *out->name),
                          .type      = calloc((size_t)most + 1, sizeof *out->type),
                          .face      = malloc(((size_t)num_faces + 1) * sizeof *out->face)};
  CLI_TRY(cli_agree_on(comm, out->name && out->type && out->face ? CLI_DONE : cli_no_memory(why), why));
  for (int64_t f = 0; f < num_faces; f++) out->face[f] = -1;
  return CLI_DONE;
}

/* The number of a boundary in the list, which grows by it if it is new. */
static int32_t number_of(cli_boundaries *b, const char *name, const char *type)
{
  int i = 0;

  while (i < b->num && (strcmp(b->name[i], name) || strcmp(b->type[i], type))) i++;
  b->name[i] = name;
  b->type[i] = type;
  if (i == b->num) b->num++;
  return i;
}

cli_exit cli_boundaries_take(MPI_Comm comm, remap_context *ctx, remap_side side, int64_t num_faces,
                             const rcgns_boundaries *from, cli_boundaries *to, cli_failure *why)
{
  int32_t     *mine   = malloc(((size_t)num_faces + 1) * sizeof *mine);
  int32_t     *taken  = malloc(((size_t)to->num_faces + 1) * sizeof *taken);
  int32_t     *number = calloc((size_t)from->num + 1, sizeof *number);
  cli_exit     code   = cli_agree_on(comm, mine && taken && number ? CLI_DONE : cli_no_memory(why), why);
  remap_status status;

  for (int b = 0; code == CLI_DONE && b < from->num; b++)
    number[b] = number_of(to, from->name[b], from->type ? from->type[b] : "UserDefined");
  for (int64_t f = 0; code == CLI_DONE && f < num_faces; f++)
    mine[f] = from->face && from->face[f] >= 0 ? number[from->face[f]] : -1;
  if (code == CLI_DONE) {
    status = remap_supermesh_face_values(ctx, side, mine, -1, taken);
    if (status != REMAP_OK) code = cli_fail(why, CLI_INTERNAL, "boundaries of a supermesh: %s", remap_status_text(status));
  }
  for (int64_t f = 0; code == CLI_DONE && f < to->num_faces; f++)
    if (to->face[f] < 0) to->face[f] = taken[f];
  free(mine);
  free(taken);
  free(number);
  return code;
}

void cli_boundaries_drop(cli_boundaries *boundaries)
{
  free(boundaries->name);
  free(boundaries->type);
  free(boundaries->face);
  *boundaries = (cli_boundaries){.num = 0};
}
