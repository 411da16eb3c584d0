/* pieces -- what belongs to cells of SOURCE, told of the pieces that --priority leaves of them, and what is found out about
 * pieces told of the cells. Numbers, masks and boundaries go by ancestor; the solver's volume of a piece is its share of the
 * cell's; values and coverage go by a transfer between the two, O(pieces) with an overlay of them.
 *
 * Zones whose sides lie in one plane but for rounding hide each other up to slivers of no content. What is left of a cell there
 * counts as nothing, as it does where the library says what is covered: below 2^-44 of the cell. */
#include "priority.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ROUNDING 0x1p-44

cli_exit cli_from_cut(const cli_job *j, remap_context *ctx, remap_status status, cli_failure *why)
{
  if (status == REMAP_OK) return CLI_DONE;
  return cli_fail(why, status == REMAP_BAD_MESH || status == REMAP_INCONSISTENT ? CLI_GEOMETRY : CLI_INTERNAL,
                  "%s: its zones cannot be cut by --priority: %s", j->options.path[REMAP_SOURCE],
                  *remap_message(ctx) ? remap_message(ctx) : remap_status_text(status));
}

cli_exit cli_cut_context(cli_job *j, remap_context **out, cli_failure *why)
{
  remap_options options;
  remap_status  status;

  remap_options_default(&options);
  options.faces     = j->options.faces;
  options.max_order = j->options.transfer.order;
  for (int k = 0; k < cli_num_carried(j); k++) options.systems |= j->field[k].system;
  status = remap_create(j->comm, &options, out);
  return status == REMAP_OK ? CLI_DONE
                            : cli_fail(why, CLI_INTERNAL, "%s: %s", j->options.path[REMAP_SOURCE], remap_status_text(status));
}

void cli_part_drop(cli_part *part)
{
  remap_destroy(&part->transfer);
  remap_destroy(&part->maker);
  free(part->cell_global);
  free(part->place);
  free(part->face_offset);
  free(part->face_node);
  free(part->face_owner);
  free(part->face_neighbour);
  free(part->number);
  free(part->gives);
  free(part->volume);
  free(part->origin);
  free(part->boundary);
}

/* ---- the mesh of a part ------------------------------------------------------------------------------------------- */

/* The cells beside a face by their numbers: the first one has one, if any has. true: the face has to be turned for that. */
static bool cells_beside(const remap_mesh *m, const int64_t *number, int64_t face, int64_t beside[2])
{
  const int64_t other = cli_entry(m->face_neighbour, m->face_neighbour32, face);

  beside[0] = number[cli_entry(m->face_owner, m->face_owner32, face)];
  beside[1] = other < 0 ? -1 : number[other];
  if (beside[0] >= 0 || beside[1] < 0) return false;
  beside[0] = beside[1];
  beside[1] = -1;
  return true;
}

bool cli_is_taken(const remap_mesh *mesh, const int64_t *number, int64_t face)
{
  int64_t beside[2];

  cells_beside(mesh, number, face, beside);
  return beside[0] >= 0;
}

static int64_t face_begin(const remap_mesh *m, int64_t face) { return cli_entry(m->face_offset, m->face_offset32, face); }

bool cli_part_take(const remap_mesh *mesh, const int64_t *number, int64_t num_cells, cli_part *part)
{
  int64_t faces = 0, corners = 0, beside[2];

  for (int64_t f = 0; f < mesh->num_faces; f++)
    if (cli_is_taken(mesh, number, f)) faces++, corners += face_begin(mesh, f + 1) - face_begin(mesh, f);
  part->face_offset    = malloc(((size_t)faces + 1) * sizeof(int64_t));
  part->face_node      = malloc(((size_t)corners + 1) * sizeof(int64_t));
  part->face_owner     = malloc(((size_t)faces + 1) * sizeof(int64_t));
  part->face_neighbour = malloc(((size_t)faces + 1) * sizeof(int64_t));
  if (!part->face_offset || !part->face_node || !part->face_owner || !part->face_neighbour) return false;
  faces = corners = part->face_offset[0] = 0;
  for (int64_t f = 0; f < mesh->num_faces; f++) {
    const int64_t first = face_begin(mesh, f), n = face_begin(mesh, f + 1) - first;
    const bool    turned = cells_beside(mesh, number, f, beside);

    if (beside[0] < 0) continue;
    for (int64_t i = 0; i < n; i++)
      part->face_node[corners++] = cli_entry(mesh->face_node, mesh->face_node32, first + (turned ? n - 1 - i : i));
    part->face_owner[faces]     = beside[0];
    part->face_neighbour[faces] = beside[1];
    part->face_offset[++faces]  = corners;
  }
  part->mesh                = *mesh;
  part->mesh.num_cells      = num_cells;
  part->mesh.num_faces      = faces;
  part->mesh.face_offset    = part->face_offset;
  part->mesh.face_node      = part->face_node;
  part->mesh.face_owner     = part->face_owner;
  part->mesh.face_neighbour = part->face_neighbour;
  return true;
}

/* ---- from cells to pieces ----------------------------------------------------------------------------------------- */

/* Room for what the cells have. */
static bool make_room(const cli_part *whole, cli_part *piece)
{
  const size_t n = (size_t)piece->mesh.num_cells + 1, faces = (size_t)piece->mesh.num_faces + 1;

  if (whole->gives && !(piece->gives = malloc(n))) return false;
  if (whole->volume && !(piece->volume = malloc(n * sizeof *piece->volume))) return false;
  if (whole->origin && !(piece->origin = malloc(n * sizeof *piece->origin))) return false;
  return !whole->boundary || (piece->boundary = malloc(faces * sizeof *piece->boundary));
}

/* What goes by ancestor: mask, numbers and boundaries. in and out have room for the cells and the pieces. Collective. */
static remap_status take_over(const cli_part *whole, cli_part *piece, double *in, double *out)
{
  remap_status status = REMAP_OK;

  for (int64_t c = 0; whole->gives && c < whole->mesh.num_cells; c++) in[c] = whole->gives[c];
  if (whole->gives) status = remap_supermesh_cell_values(piece->maker, REMAP_SOURCE, in, 0, out);
  for (int64_t c = 0; whole->gives && status == REMAP_OK && c < piece->mesh.num_cells; c++) piece->gives[c] = out[c] != 0;
  if (whole->origin && status == REMAP_OK)
    status = remap_supermesh_cell_values(piece->maker, REMAP_SOURCE, whole->origin, -1, piece->origin);
  if (whole->boundary && status == REMAP_OK)
    status = remap_supermesh_face_values(piece->maker, REMAP_SOURCE, whole->boundary, -1, piece->boundary);
  return status;
}

/* Which pieces are more than rounding of their cells: fills number and *num. Room as above; after the overlay of cells and
 * pieces. Collective. */
static remap_status find_visible(cli_part *piece, int64_t *num, double *in, double *out)
{
  remap_status status = remap_cells(piece->transfer, REMAP_SOURCE, in, NULL);

  *num = 0;
  if (status == REMAP_OK) status = remap_supermesh_cell_values(piece->maker, REMAP_SOURCE, in, 0, out);
  for (int64_t c = 0; status == REMAP_OK && c < piece->view.num_cells; c++)
    piece->number[c] = piece->view.cell_volume[c] > ROUNDING * out[c] ? (*num)++ : -1;
  return status;
}

/* Each piece gets of its cell's volume what it has of it by faces. As above. */
static remap_status share_volumes(const cli_part *whole, cli_part *piece, double *in, double *out)
{
  remap_status status = remap_cells(piece->transfer, REMAP_SOURCE, in, NULL);

  if (status != REMAP_OK) return status;
  for (int64_t c = 0; c < whole->mesh.num_cells; c++) in[c] = whole->volume[c] / in[c];
  status = remap_supermesh_cell_values(piece->maker, REMAP_SOURCE, in, 1, out);
  for (int64_t c = 0; status == REMAP_OK && c < piece->mesh.num_cells; c++)
    piece->volume[c] = fmax(out[c] * piece->view.cell_volume[c], DBL_MIN); /* a volume above 0, also where it is next to none */
  return status;
}

/* All fields from the cells to their pieces. Collective. */
static cli_exit carry(cli_job *j, const cli_part *whole, const cli_part *piece, const double *in, double *out, cli_failure *why)
{
  const remap_masks masks = {.gives = {whole->gives, NULL}, .wants = {NULL, piece->gives}};
  remap_transfer    how   = j->options.transfer;
  remap_context    *ctx   = piece->transfer;
  remap_field_desc *f     = malloc(((size_t)cli_num_carried(j) + 1) * sizeof *f);
  cli_exit          mine  = cli_agree(j, f ? CLI_DONE : cli_no_memory(why), why);

  if (mine == CLI_DONE && whole->gives) mine = cli_from_cut(j, ctx, remap_set_masks(ctx, &masks), why);
  if (mine == CLI_DONE) {
    for (int k = 0; k < cli_num_carried(j); k++) {
      f[k]         = j->field[k];
      f[k].in      = in + (int64_t)k * whole->mesh.num_cells;
      f[k].out     = out + (int64_t)k * piece->mesh.num_cells;
      f[k].has_old = 0;
    }
    how.on_uncovered = REMAP_UNCOVERED_KEEP; /* by rounding at most */
    how.on_partial   = REMAP_PARTIAL_NORMALISE;
    how.rotation     = NULL; /* once is enough */
    how.allow_nan    = j->options.allow_nan;
    mine             = cli_from_cut(j, ctx, remap_field(ctx, REMAP_FORWARD, &how, cli_num_carried(j), f, NULL), why);
  }
  free(f);
  return mine;
}

/* Leave out the pieces without a number, of which `num` have one, from all that there is of them. */
static bool shrink(cli_part *p, int64_t num, int num_fields, double *values)
{
  const remap_mesh all = p->mesh;
  int64_t          to  = 0;

  if (num == all.num_cells) return true;
  if (!cli_part_take(&all, p->number, num, p)) return false;
  for (int64_t f = 0; p->boundary && f < all.num_faces; f++)
    if (cli_is_taken(&all, p->number, f)) p->boundary[to++] = p->boundary[f];
  for (int64_t c = 0; c < all.num_cells; c++) {
    const int64_t k = p->number[c];

    if (k < 0) continue;
    p->cell_global[k] = p->cell_global[c];
    if (p->gives) p->gives[k] = p->gives[c];
    if (p->volume) p->volume[k] = p->volume[c];
    if (p->origin) p->origin[k] = p->origin[c];
  }
  for (int field = 0; field < num_fields; field++)
    for (int64_t c = 0; c < all.num_cells; c++)
      if (p->number[c] >= 0) values[field * num + p->number[c]] = values[field * all.num_cells + c];
  return true;
}

cli_exit cli_pieces_fill(cli_job *j, const cli_part *whole, cli_part *piece, const double *in, double *out, cli_failure *why)
{
  double  *from = malloc(((size_t)whole->mesh.num_cells + 1) * sizeof *from);
  double  *to   = malloc(((size_t)piece->mesh.num_cells + 1) * sizeof *to);
  int64_t  num  = 0;
  cli_exit mine;

  piece->number = malloc(((size_t)piece->mesh.num_cells + 1) * sizeof *piece->number);
  mine          = cli_agree(j, from && to && piece->number && make_room(whole, piece) ? CLI_DONE : cli_no_memory(why), why);

  if (mine == CLI_DONE) mine = cli_from_cut(j, piece->maker, take_over(whole, piece, from, to), why);
  if (mine == CLI_DONE) mine = cli_cut_context(j, &piece->transfer, why);
  if (mine == CLI_DONE) {
    remap_set_mesh(piece->transfer, REMAP_SOURCE, &whole->mesh);
    remap_set_mesh(piece->transfer, REMAP_TARGET, &piece->mesh);
    mine = cli_from_cut(j, piece->transfer, remap_build(piece->transfer), why);
  }
  if (mine == CLI_DONE && whole->volume) mine = cli_from_cut(j, piece->maker, share_volumes(whole, piece, from, to), why);
  if (mine == CLI_DONE && cli_num_carried(j) > 0) mine = carry(j, whole, piece, in, out, why);
  if (mine == CLI_DONE) mine = cli_from_cut(j, piece->maker, find_visible(piece, &num, from, to), why);
  if (mine == CLI_DONE) mine = cli_agree(j, shrink(piece, num, cli_num_carried(j), out) ? CLI_DONE : cli_no_memory(why), why);
  MPI_Allreduce(&num, &piece->num_visible, 1, MPI_INT64_T, MPI_SUM, j->comm);
  if (!j->options.source_coverage) remap_destroy(&piece->transfer);
  free(from);
  free(to);
  return mine;
}

/* ---- from pieces to cells ----------------------------------------------------------------------------------------- */

/* Coverage of the pieces of one part to the cells they are parts of, whole [num_whole]. Collective. */
static cli_exit share_of_part(const cli_job *j, const cli_part *part, const double *fraction, double *whole, cli_failure *why)
{
  const int64_t    n   = part->view.num_cells;
  double          *all = malloc(((size_t)n + 1) * sizeof *all);
  remap_field_desc f   = {.name = CLI_COVERAGE_FIELD, .nature = REMAP_CONSERVED, .in = all, .out = whole};
  remap_transfer   how;
  cli_exit         mine = cli_agree(j, all ? CLI_DONE : cli_no_memory(why), why);

  remap_transfer_default(&how);
  how.order        = 1;
  how.limiter      = REMAP_LIMITER_NONE;
  how.on_uncovered = REMAP_UNCOVERED_FILL;
  how.fill_value   = 0; /* nothing is visible of them */
  how.on_partial   = REMAP_PARTIAL_CONSERVE;
  if (mine == CLI_DONE) {
    for (int64_t c = 0; c < n; c++) all[c] = part->number[c] < 0 ? 0 : fraction[part->number[c]];
    mine = cli_from_cut(j, part->transfer, remap_field(part->transfer, REMAP_BACKWARD, &how, 1, &f, NULL), why);
  }
  free(all);
  return mine;
}

cli_exit cli_source_share(cli_job *j, double *share, cli_failure *why)
{
  const size_t   n        = (size_t)rcgns_mesh(j->file[REMAP_SOURCE])->num_cells;
  const double  *fraction = j->fraction[REMAP_SOURCE];
  const cli_cut *cut      = j->cut;
  double        *whole    = malloc((n + 1) * sizeof *whole);
  cli_exit       mine     = cli_agree(j, whole ? CLI_DONE : cli_no_memory(why), why);

  if (!cut && mine == CLI_DONE) memcpy(share, fraction, n * sizeof *share);
  for (int p = 0; cut && p < cut->num_parts && mine == CLI_DONE; fraction += cut->part[p++].mesh.num_cells) {
    const cli_part *part = &cut->part[p];

    if (p > 0) mine = share_of_part(j, part, fraction, whole, why);
    for (int64_t c = 0; c < part->num_whole && mine == CLI_DONE; c++)
      share[part->place[c]] = p == 0 ? fraction[c] : whole[c] > ROUNDING ? whole[c] : 0;
  }
  free(whole);
  return mine;
}

cli_exit cli_side_boundaries(cli_job *j, remap_side side, rcgns_boundaries *out, int64_t *num_faces, cli_failure *why)
{
  rcgns_message message;

  if (j->cut && side == REMAP_SOURCE) {
    *out       = j->cut->boundaries;
    *num_faces = j->cut->num_faces;
    return CLI_DONE;
  }
  *num_faces = rcgns_mesh(j->file[side])->num_faces;
  return cli_from_cgns(rcgns_read_boundaries(j->file[side], out, &message), &message, why);
}

cli_exit cli_source_ancestors(cli_job *j, const remap_supermesh_view *view, int64_t *ancestor, cli_failure *why)
{
  const cli_cut *cut  = j->cut;
  const size_t   n    = (size_t)view->num_cells;
  double        *in   = malloc(((size_t)(cut ? cut->num_cells : 0) + 1) * sizeof *in);
  double        *out  = malloc((n + 1) * sizeof *out);
  cli_exit       mine = cli_agree(j, in && out ? CLI_DONE : cli_no_memory(why), why);

  if (!cut && mine == CLI_DONE && n) memcpy(ancestor, view->cell_ancestor[REMAP_SOURCE], n * sizeof *ancestor);
  if (cut && mine == CLI_DONE) {
    int64_t at = 0;

    for (int p = 0; p < cut->num_parts; at += cut->part[p++].mesh.num_cells)
      memcpy(in + at, cut->part[p].origin, (size_t)cut->part[p].mesh.num_cells * sizeof *in);
    mine = cli_from_remap(j, remap_supermesh_cell_values(j->ctx, REMAP_SOURCE, in, -1, out), why);
    for (size_t c = 0; c < n && mine == CLI_DONE; c++) ancestor[c] = (int64_t)out[c];
  }
  free(in);
  free(out);
  return mine;
}
