/* pieces -- what belongs to cells of SOURCE, told of the pieces that --priority leaves of them, and what is found out about
 * pieces told of the cells. Numbers, masks and boundaries go by ancestor; the solver's volume of a piece is its share of the
 * cell's; values and coverage go by a transfer between the two, O(pieces) with an overlay of them. */
#include "priority.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

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
  free(part->gives);
  free(part->volume);
  free(part->origin);
  free(part->boundary);
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

/* Each piece gets of its cell's volume what it has of it by faces. Room as above; after the overlay of cells and pieces.
 * Collective. */
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

cli_exit cli_pieces_fill(cli_job *j, const cli_part *whole, cli_part *piece, const double *in, double *out, cli_failure *why)
{
  double  *from = malloc(((size_t)whole->mesh.num_cells + 1) * sizeof *from);
  double  *to   = malloc(((size_t)piece->mesh.num_cells + 1) * sizeof *to);
  cli_exit mine = cli_agree(j, from && to && make_room(whole, piece) ? CLI_DONE : cli_no_memory(why), why);

  if (mine == CLI_DONE) mine = cli_from_cut(j, piece->maker, take_over(whole, piece, from, to), why);
  if (mine == CLI_DONE) mine = cli_cut_context(j, &piece->transfer, why);
  if (mine == CLI_DONE) {
    remap_set_mesh(piece->transfer, REMAP_SOURCE, &whole->mesh);
    remap_set_mesh(piece->transfer, REMAP_TARGET, &piece->mesh);
    mine = cli_from_cut(j, piece->transfer, remap_build(piece->transfer), why);
  }
  if (mine == CLI_DONE && whole->volume) mine = cli_from_cut(j, piece->maker, share_volumes(whole, piece, from, to), why);
  if (mine == CLI_DONE && cli_num_carried(j) > 0) mine = carry(j, whole, piece, in, out, why);
  if (!j->options.source_coverage) remap_destroy(&piece->transfer);
  free(from);
  free(to);
  return mine;
}

/* ---- from pieces to cells ----------------------------------------------------------------------------------------- */

cli_exit cli_source_share(cli_job *j, double *share, cli_failure *why)
{
  const double    *fraction = j->fraction[REMAP_SOURCE];
  const cli_cut   *cut      = j->cut;
  double          *whole    = malloc(((size_t)rcgns_mesh(j->file[REMAP_SOURCE])->num_cells + 1) * sizeof *whole);
  cli_exit         mine     = cli_agree(j, whole ? CLI_DONE : cli_no_memory(why), why);
  remap_transfer   how;
  remap_field_desc f = {.name = CLI_COVERAGE_FIELD, .nature = REMAP_CONSERVED, .out = whole};

  remap_transfer_default(&how);
  how.order        = 1;
  how.limiter      = REMAP_LIMITER_NONE;
  how.on_uncovered = REMAP_UNCOVERED_FILL;
  how.fill_value   = 0; /* nothing is visible of them */
  how.on_partial   = REMAP_PARTIAL_CONSERVE;
  if (!cut && mine == CLI_DONE) memcpy(share, fraction, (size_t)rcgns_mesh(j->file[REMAP_SOURCE])->num_cells * sizeof *share);
  for (int p = 0; cut && p < cut->num_parts && mine == CLI_DONE; fraction += cut->part[p++].mesh.num_cells) {
    const cli_part *part = &cut->part[p];

    f.in = fraction;
    if (p > 0) mine = cli_from_cut(j, part->transfer, remap_field(part->transfer, REMAP_BACKWARD, &how, 1, &f, NULL), why);
    for (int64_t c = 0; c < part->num_whole && mine == CLI_DONE; c++) share[part->place[c]] = p > 0 ? whole[c] : fraction[c];
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
