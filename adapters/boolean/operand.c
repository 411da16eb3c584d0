/* operand -- a CGNS mesh, of which each rank has a part, or a closed surface, which rank 0 has; what their cells and faces
 * have, taken over to the result. */
#include "boolean.h"

#include <fnmatch.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- surfaces ------------------------------------------------------------------------------------------------------ */

static cli_exit from_surface(rsurf_status status, const rsurf_message *message, cli_failure *why)
{
  static const cli_exit code[] = {[RSURF_OK]       = CLI_DONE,
                                  [RSURF_IO]       = CLI_IO,
                                  [RSURF_GEOMETRY] = CLI_GEOMETRY,
                                  [RSURF_MEMORY]   = CLI_INTERNAL};

  return status == RSURF_OK ? CLI_DONE : cli_fail(why, code[status], "%s", message->text);
}

/* Rank 0 alone. */
static cli_exit read_surface(const char *path, double scale, bool_operand *o, cli_failure *why)
{
  rsurf_message message;

  CLI_TRY(from_surface(rsurf_read(path, scale, &o->surface, &message), &message, why));
  return from_surface(rsurf_repair(&o->surface, path, &o->repairs, &message), &message, why);
}

/* Rank 0's list of texts to all. The caller's texts stay his. Collective. */
static cli_exit share_names(MPI_Comm comm, int num, char *const *from, char ***out, cli_failure *why)
{
  int rank;

  MPI_Comm_rank(comm, &rank);
  *out = calloc((size_t)num + 1, sizeof **out);
  CLI_TRY(cli_agree_on(comm, *out ? CLI_DONE : cli_no_memory(why), why));
  for (int i = 0; i < num; i++) {
    int length = rank == 0 ? (int)strlen(from[i]) : 0;

    MPI_Bcast(&length, 1, MPI_INT, 0, comm);
    (*out)[i] = calloc((size_t)length + 1, 1);
    CLI_TRY(cli_agree_on(comm, (*out)[i] ? CLI_DONE : cli_no_memory(why), why));
    if (rank == 0) memcpy((*out)[i], from[i], (size_t)length);
    MPI_Bcast((*out)[i], length, MPI_CHAR, 0, comm);
  }
  return CLI_DONE;
}

static cli_exit open_surface(MPI_Comm comm, const char *path, double scale, bool_operand *o, cli_failure *why)
{
  int64_t count[2] = {0, 0};
  int     rank;

  MPI_Comm_rank(comm, &rank);
  o->is_surface = true;
  CLI_TRY(cli_agree_on(comm, rank == 0 ? read_surface(path, scale, o, why) : CLI_DONE, why));
  if (rank == 0) {
    count[0] = o->surface.num_bodies;
    count[1] = o->surface.num_groups;
  }
  MPI_Bcast(count, 2, MPI_INT64_T, 0, comm);
  MPI_Bcast(&o->repairs, (int)sizeof o->repairs, MPI_BYTE, 0, comm);
  o->num_cells       = count[0];
  o->mesh            = rsurf_mesh(&o->surface, path);
  o->boundaries.num  = (int)count[1];
  o->boundaries.face = o->surface.face_group;
  CLI_TRY(share_names(comm, o->boundaries.num, o->surface.group_name, &o->own_name, why));
  o->boundaries.name = (const char *const *)o->own_name;
  return CLI_DONE;
}

/* ---- meshes -------------------------------------------------------------------------------------------------------- */

static cli_exit open_mesh(MPI_Comm comm, const bool_options *options, int side, bool_operand *o, cli_failure *why)
{
  rcgns_options    how;
  rcgns_choice     choice;
  rcgns_message    message;

  rcgns_options_default(&how);
  how.base         = options->base[side];
  how.face_numbers = 1;
  if (side == 1) how.scale = options->scale;
  CLI_TRY(cli_from_cgns(rcgns_open(comm, o->path, &how, &o->file, &message), &message, why));
  o->mesh      = *rcgns_mesh(o->file);
  o->num_cells = rcgns_get_info(o->file)->num_cells;
  CLI_TRY(cli_from_cgns(rcgns_read_boundaries(o->file, &o->boundaries, &message), &message, why));
  rcgns_choice_default(&choice);
  choice.name     = options->solution;
  choice.optional = 1;
  return cli_from_cgns(rcgns_select_solution(o->file, &choice, &o->solution, &message), &message, why);
}

cli_exit bool_operand_open(MPI_Comm comm, const bool_options *options, int side, bool_operand *out, cli_failure *why)
{
  *out = (bool_operand){.path = options->path[side]};
  if (rsurf_is_path(out->path)) return open_surface(comm, out->path, side == 1 ? options->scale : 1.0, out, why);
  return open_mesh(comm, options, side, out, why);
}

void bool_operand_close(bool_operand *operand)
{
  for (int i = 0; i < operand->boundaries.num && operand->own_name; i++) free(operand->own_name[i]);
  free(operand->own_name);
  rsurf_drop(&operand->surface);
  rcgns_close(&operand->file);
}

/* ---- fields -------------------------------------------------------------------------------------------------------- */

/* Does one of the comma separated names and globs name it? */
static bool is_listed(const char *list, const char *name)
{
  char pattern[256];

  if (!list) return true;
  for (const char *from = list, *to; *from; from = *to ? to + 1 : to) {
    const size_t n = strcspn(from, ",");

    to = from + n;
    if (n >= sizeof pattern) continue;
    memcpy(pattern, from, n);
    pattern[n] = '\0';
    if (!strcmp(pattern, name) || fnmatch(pattern, name, 0) == 0) return true;
  }
  return false;
}

/* The field of that name that all zones of an operand have, -1: none. */
static int64_t find_field(const bool_operand *o, const char *name)
{
  for (int64_t i = 0; i < o->solution.num_fields; i++)
    if (o->solution.field[i].missing_in < 0 && !strcmp(o->solution.field[i].name, name)) return i;
  return -1;
}

/* Names of the fields to take over: A's, then those that B alone has. The ancestors and volumes are the writer's own. */
static int list_fields(const bool_options *options, const bool_operand operand[2], const char **name)
{
  int num = 0;

  for (int side = 0; side < 2; side++)
    for (int64_t i = 0; i < operand[side].solution.num_fields; i++) {
      const rcgns_field *field = &operand[side].solution.field[i];

      if (field->missing_in >= 0 || !is_listed(options->fields, field->name)) continue;
      if (side == 1 && find_field(&operand[0], field->name) >= 0) continue;
      if (!strcmp(field->name, "AncestorA") || !strcmp(field->name, "AncestorB") || !strcmp(field->name, "Volume")) continue;
      name[num++] = field->name;
    }
  return num;
}

/* A field of one operand for the cells that lie in it; where only is set, for those alone that do not lie in A. Collective. */
static cli_exit take_field(MPI_Comm comm, remap_context *ctx, int side, const bool_operand *o, const char *name,
                           const remap_supermesh_view *view, bool after_a, double *values, cli_failure *why)
{
  double       *in   = malloc(((size_t)o->mesh.num_cells + 1) * sizeof *in);
  double       *out  = malloc(((size_t)view->num_cells + 1) * sizeof *out);
  cli_exit      code = cli_agree_on(comm, in && out ? CLI_DONE : cli_no_memory(why), why);
  rcgns_message message;
  remap_status  status;

  if (code == CLI_DONE) code = cli_from_cgns(rcgns_read_field(o->file, name, in, &message), &message, why);
  if (code == CLI_DONE) {
    status = remap_supermesh_cell_values(ctx, (remap_side)side, in, NAN, out);
    if (status != REMAP_OK) code = cli_fail(why, CLI_INTERNAL, "%s: %s", o->path, remap_status_text(status));
  }
  for (int64_t c = 0; code == CLI_DONE && c < view->num_cells; c++)
    if (!after_a || view->cell_ancestor[0][c] < 0) values[c] = out[c];
  free(in);
  free(out);
  return code;
}

static cli_exit take_fields(MPI_Comm comm, const bool_options *options, remap_context *ctx, const bool_operand operand[2],
                            const remap_supermesh_view *view, bool_content *c, cli_failure *why)
{
  const char **name = calloc((size_t)(operand[0].solution.num_fields + operand[1].solution.num_fields) + 1, sizeof *name);
  int          num  = name ? list_fields(options, operand, name) : 0;
  cli_exit     code;

  c->field  = calloc((size_t)num + 1, sizeof *c->field);
  c->values = malloc(((size_t)num * (size_t)view->num_cells + 1) * sizeof *c->values);
  code      = cli_agree_on(comm, name && c->field && c->values ? CLI_DONE : cli_no_memory(why), why);
  if (code == CLI_DONE && options->fields && !num)
    code = cli_fail(why, CLI_USAGE, "--fields: neither %s nor %s has a cell-centred field '%.200s' in all zones",
                    options->path[0], options->path[1], options->fields);
  for (int k = 0; k < num && code == CLI_DONE; k++) {
    double *values = c->values + (size_t)k * (size_t)view->num_cells;
    bool    in_a   = false;

    c->field[k] = (rslice_field){.name = name[k], .values = values};
    for (int64_t i = 0; i < view->num_cells; i++) values[i] = NAN;
    for (int side = 0; side < 2 && code == CLI_DONE; side++) {
      if (find_field(&operand[side], name[k]) < 0) continue;
      code = take_field(comm, ctx, side, &operand[side], name[k], view, in_a, values, why);
      in_a = true;
    }
  }
  c->content.num_fields = num;
  c->content.field      = c->field;
  free(name);
  return code;
}

/* A solution that was asked for is in one of the operands at least. */
static cli_exit check_solution(const bool_options *options, const bool_operand operand[2], cli_failure *why)
{
  if (!options->solution || operand[0].solution.name || operand[1].solution.name) return CLI_DONE;
  return cli_fail(why, CLI_USAGE, "--solution: neither %s nor %s has a solution %.64s: give another", options->path[0],
                  options->path[1], options->solution);
}

/* ---- both ---------------------------------------------------------------------------------------------------------- */

cli_exit bool_content_make(MPI_Comm comm, const bool_options *options, remap_context *ctx, const bool_operand operand[2],
                           const remap_supermesh_view *view, bool_content *out, cli_failure *why)
{
  cli_boundaries *b = &out->boundaries;

  CLI_TRY(check_solution(options, operand, why));
  *out = (bool_content){.content = {.mesh = view, .ancestor = {"AncestorA", "AncestorB"}}};
  CLI_TRY(cli_boundaries_begin(comm, view->num_faces, operand[0].boundaries.num + operand[1].boundaries.num, b, why));
  for (int side = 0; side < 2; side++)
    CLI_TRY(cli_boundaries_take(comm, ctx, (remap_side)side, operand[side].mesh.num_faces, &operand[side].boundaries, b, why));
  for (int side = 0; side < 2; side++) {
    CLI_TRY(cli_ancestors_take(comm, ctx, (remap_side)side, &operand[side].mesh,
                               operand[side].file ? rcgns_face_numbers(operand[side].file) : NULL, view->num_faces, &out->faces,
                               why));
    out->content.face_cell[side]   = out->faces.cell[side];
    out->content.face_number[side] = out->faces.number[side];
  }
  out->content.num_boundaries = b->num;
  out->content.boundary_name  = b->name;
  out->content.boundary_type  = b->type;
  out->content.face_boundary  = b->face;
  return take_fields(comm, options, ctx, operand, view, out, why);
}

void bool_content_drop(bool_content *content)
{
  free(content->field);
  free(content->values);
  cli_boundaries_drop(&content->boundaries);
  cli_ancestors_drop(&content->faces);
  *content = (bool_content){.field = NULL};
}
