/* priority -- zones of SOURCE that overlap, each point of space counted once: zones of higher priority keep their cells whole,
 * those of lower priority give the part of theirs that no higher one hides.
 *
 * The zones form classes, one for each name of --priority and a last one of all others. Class by class, from the top, the cells
 * less all that is visible already are made by remap_supermesh, as polyhedra that fit the cells they were cut at. Their values
 * come from the cells they are parts of by a transfer of the order asked for, so they are conserved and as accurate. To the
 * library the cells of the first class and the pieces of the others are the blocks of one mesh, and there are no zones that
 * overlap. Zones of TARGET may overlap once one of them is named: their cells get values one by one.
 *
 * What else belongs to cells is told of pieces too (pieces.c), so that --check, --source-volume, --source-coverage and
 * --supermesh take them like cells. Cost: for each class but the first one supermesh and one overlay of it. */
#include "priority.h"

#include <fnmatch.h>
#include <stdlib.h>
#include <string.h>

int cli_num_carried(const cli_job *j) { return j->num_fields + j->num_hidden; }

/* ---- classes ------------------------------------------------------------------------------------------------------ */

/* The number of the first item of the list that names the zone, from 0; how many there are if none does. */
static int class_of(const char *list, const char *zone)
{
  int item = 0;

  for (const char *from = list, *to; *from; from = *to ? to + 1 : to, item++) {
    char pattern[256];

    to = from + strcspn(from, ",");
    if ((size_t)(to - from) >= sizeof pattern) continue;
    memcpy(pattern, from, (size_t)(to - from));
    pattern[to - from] = '\0';
    if (!strcmp(pattern, zone) || fnmatch(pattern, zone, 0) == 0) return item;
  }
  return item;
}

bool cli_has_priority(const cli_job *j, remap_side side)
{
  const rcgns_info *info = rcgns_get_info(j->file[side]);

  for (int64_t z = 0; j->options.priority && z < info->num_zones; z++)
    if (class_of(j->options.priority, info->zone[z].name) < class_of(j->options.priority, "")) return true;
  return false;
}

cli_exit cli_priority_check(const cli_job *j, cli_failure *why)
{
  const char *list = j->options.priority;

  for (const char *from = list, *to; list && *from; from = *to ? to + 1 : to) {
    char item[256] = "";
    bool any       = false;

    to = from + strcspn(from, ",");
    if ((size_t)(to - from) < sizeof item) memcpy(item, from, (size_t)(to - from));
    for (int side = 0; side < 2; side++) {
      const rcgns_info *info = rcgns_get_info(j->file[side]);

      for (int64_t z = 0; z < info->num_zones; z++) any = any || class_of(item, info->zone[z].name) == 0;
    }
    if (!any || !*item)
      return cli_fail(why, CLI_USAGE, "--priority: neither %s nor %s has a zone '%.200s': give BASE/ZONE,... such as %s",
                      j->options.path[REMAP_SOURCE], j->options.path[REMAP_TARGET], item,
                      rcgns_get_info(j->file[REMAP_SOURCE])->zone[0].name);
  }
  return CLI_DONE;
}

/* ---- cells of the file -------------------------------------------------------------------------------------------- */

/* The cells of a mesh whose class is k; nodes are shared with it. number has room for [cells]. */
static bool take_cells(const remap_mesh *m, const int *class_of_cell, int k, int64_t *number, cli_part *p)
{
  int64_t cells = 0;

  for (int64_t c = 0; c < m->num_cells; c++) number[c] = class_of_cell[c] == k ? cells++ : -1;
  p->num_whole   = cells;
  p->cell_global = malloc(((size_t)cells + 1) * sizeof *p->cell_global);
  p->place       = malloc(((size_t)cells + 1) * sizeof *p->place);
  if (!p->cell_global || !p->place || !cli_part_take(m, number, cells, p)) return false;
  for (int64_t c = 0; c < m->num_cells; c++)
    if (number[c] >= 0) p->cell_global[number[c]] = m->cell_global[c], p->place[number[c]] = c;
  p->mesh.cell_global = p->cell_global;
  return true;
}

/* What else the options ask about cells of the file: their mask, volumes, numbers and boundaries. The faces are those of
 * cli_part_take, in its order. */
static bool take_belongings(const cli_job *j, const rcgns_boundaries *from, const int64_t *number, cli_part *p)
{
  const remap_mesh *m      = rcgns_mesh(j->file[REMAP_SOURCE]);
  const uint8_t    *mask   = j->mask[REMAP_SOURCE];
  const double     *volume = j->volume[REMAP_SOURCE];
  const size_t      cells = (size_t)p->mesh.num_cells, faces = (size_t)p->mesh.num_faces;
  const bool        is_super = j->options.supermesh != NULL;

  if (mask && !(p->gives = malloc(cells + 1))) return false;
  if (volume && !(p->volume = malloc((cells + 1) * sizeof *p->volume))) return false;
  if (is_super && !(p->origin = malloc((cells + 1) * sizeof *p->origin))) return false;
  if (is_super && !(p->boundary = malloc((faces + 1) * sizeof *p->boundary))) return false;
  for (size_t c = 0; c < cells; c++) {
    if (mask) p->gives[c] = mask[p->place[c]];
    if (volume) p->volume[c] = volume[p->place[c]];
    if (is_super) p->origin[c] = (double)p->cell_global[c];
  }
  for (int64_t f = 0, to = 0; is_super && f < m->num_faces; f++)
    if (cli_is_taken(m, number, f)) p->boundary[to++] = from->face ? from->face[f] : -1;
  return true;
}

/* ---- pieces ------------------------------------------------------------------------------------------------------- */

/* The cells less what is visible of the classes above, whose blocks are given. Collective. */
static cli_exit cut_cells(cli_job *j, const cli_part *whole, int num_above, const remap_mesh *above, int64_t first_global,
                          cli_part *piece, cli_failure *why)
{
  const remap_supermesh_view *view = &piece->view;
  remap_supermesh_options     options;

  CLI_TRY(cli_cut_context(j, &piece->maker, why));
  remap_set_mesh(piece->maker, REMAP_SOURCE, &whole->mesh);
  remap_set_blocks(piece->maker, REMAP_TARGET, num_above, above);
  remap_supermesh_options_default(&options);
  options.keep = REMAP_IN_SOURCE;
  CLI_TRY(cli_from_cut(j, piece->maker, remap_supermesh(piece->maker, &options, &piece->view), why));
  piece->cell_global = malloc(((size_t)view->num_cells + 1) * sizeof(int64_t));
  CLI_TRY(cli_agree(j, piece->cell_global ? CLI_DONE : cli_no_memory(why), why));
  for (int64_t c = 0; c < view->num_cells; c++) piece->cell_global[c] = first_global + view->cell_global[c];
  piece->mesh = (remap_mesh){.num_nodes        = view->num_nodes,
                             .num_faces        = view->num_faces,
                             .num_cells        = view->num_cells,
                             .node_xyz         = view->node_xyz,
                             .face_offset      = view->face_offset,
                             .face_node32      = view->face_node,
                             .face_owner32     = view->face_owner,
                             .face_neighbour32 = view->face_neighbour,
                             .cell_global      = piece->cell_global,
                             .name             = whole->mesh.name};
  return CLI_DONE;
}

/* The values of a class as they were read, [fields][cells]; NULL: no memory. */
static double *take_values(const cli_job *j, const cli_part *p)
{
  const int64_t n   = p->mesh.num_cells;
  double       *all = malloc(((size_t)(n * cli_num_carried(j)) + 1) * sizeof *all);

  for (int k = 0; all && k < cli_num_carried(j); k++)
    for (int64_t c = 0; c < n; c++) all[k * n + c] = j->field[k].in[p->place[c]];
  return all;
}

/* ---- the whole ---------------------------------------------------------------------------------------------------- */

/* One class into the next part: its cells, cut unless it is the first, and what belongs to them. Collective. */
static cli_exit add_class(cli_job *j, cli_cut *cut, const int *class_of_cell, int k, int64_t *number, cli_failure *why)
{
  const remap_mesh *m     = rcgns_mesh(j->file[REMAP_SOURCE]);
  const int         p     = cut->num_parts;
  cli_part          whole = {.maker = NULL}, *to = &cut->part[p];
  bool              ok = take_cells(m, class_of_cell, k, number, &whole);
  double           *in = ok ? take_values(j, &whole) : NULL;
  cli_exit          mine;

  ok   = in && take_belongings(j, &cut->boundaries, number, &whole);
  mine = cli_agree(j, ok ? CLI_DONE : cli_no_memory(why), why);
  cut->num_parts++;
  if (p == 0) {
    *to            = whole;
    cut->values[0] = in;
    return mine;
  }
  if (mine == CLI_DONE) mine = cut_cells(j, &whole, p, cut->block, cut->first_global[p], to, why);
  cut->first_global[p + 1] = cut->first_global[p] + to->view.global_cells;
  if (mine == CLI_DONE) {
    cut->values[p] = malloc(((size_t)(to->mesh.num_cells * cli_num_carried(j)) + 1) * sizeof(double));
    mine           = cli_agree(j, cut->values[p] ? CLI_DONE : cli_no_memory(why), why);
  }
  if (mine == CLI_DONE) mine = cli_pieces_fill(j, &whole, to, in, cut->values[p], why);
  to->num_whole = whole.num_whole;
  to->place     = whole.place;
  whole.place   = NULL;
  cli_part_drop(&whole);
  free(in);
  return mine;
}

/* All classes that have cells somewhere. Collective. */
static cli_exit add_classes(cli_job *j, cli_cut *cut, cli_failure *why)
{
  const rcgns_info *info   = rcgns_get_info(j->file[REMAP_SOURCE]);
  const remap_mesh *m      = rcgns_mesh(j->file[REMAP_SOURCE]);
  int              *klass  = malloc(((size_t)m->num_cells + 1) * sizeof *klass);
  int64_t          *number = malloc(((size_t)m->num_cells + 1) * sizeof *number);
  cli_exit          mine   = cli_agree(j, klass && number ? CLI_DONE : cli_no_memory(why), why);

  for (int64_t c = 0; c < m->num_cells && mine == CLI_DONE; c++)
    klass[c] = class_of(j->options.priority, cli_zone_of(info, m->cell_global[c])->name);
  cut->first_global[0] = 0;
  cut->first_global[1] = info->num_cells;
  for (int k = 0; k < cut->num_classes && mine == CLI_DONE; k++) {
    bool any = false;

    for (int64_t z = 0; z < info->num_zones; z++) any = any || class_of(j->options.priority, info->zone[z].name) == k;
    if (!any) continue;
    mine = add_class(j, cut, klass, k, number, why);
    if (mine == CLI_DONE) {
      cut->block[cut->num_parts - 1]           = cut->part[cut->num_parts - 1].mesh;
      cut->block[cut->num_parts - 1].num_zones = 0; /* until the numbers of pieces are all known */
    }
  }
  free(klass);
  free(number);
  return mine;
}

/* The parts one behind the other: cells, values, mask, volumes, boundaries. */
static bool join_parts(cli_job *j, cli_cut *cut)
{
  int64_t  at = 0, face = 0;
  uint8_t *gives  = NULL;
  double  *volume = NULL;

  for (int p = 0; p < cut->num_parts; p++) {
    cut->num_cells += cut->part[p].mesh.num_cells;
    cut->num_faces += cut->part[p].mesh.num_faces;
  }
  cut->in          = malloc(((size_t)(cut->num_cells * cli_num_carried(j)) + 1) * sizeof *cut->in);
  cut->cell_global = malloc(((size_t)cut->num_cells + 1) * sizeof *cut->cell_global);
  if (!cut->in || !cut->cell_global) return false;
  if (j->options.supermesh && !(cut->boundary = malloc(((size_t)cut->num_faces + 1) * sizeof *cut->boundary))) return false;
  if (j->mask[REMAP_SOURCE]) {
    if (!(gives = malloc((size_t)cut->num_cells + 1))) return false;
    free(j->mask[REMAP_SOURCE]);
    j->mask[REMAP_SOURCE] = gives;
  }
  if (j->volume[REMAP_SOURCE]) {
    if (!(volume = malloc(((size_t)cut->num_cells + 1) * sizeof *volume))) return false;
    free(j->volume[REMAP_SOURCE]);
    j->volume[REMAP_SOURCE] = volume;
  }
  for (int p = 0; p < cut->num_parts; p++) {
    const cli_part *part = &cut->part[p];
    const size_t    n = (size_t)part->mesh.num_cells, faces = (size_t)part->mesh.num_faces;

    memcpy(cut->cell_global + at, part->cell_global, n * sizeof(int64_t));
    if (gives) memcpy(gives + at, part->gives, n);
    if (volume) memcpy(volume + at, part->volume, n * sizeof *volume);
    if (volume) cut->block[p].cell_volume = volume + at;
    if (cut->boundary) memcpy(cut->boundary + face, part->boundary, faces * sizeof *cut->boundary);
    for (int k = 0; k < cli_num_carried(j); k++)
      memcpy(cut->in + k * cut->num_cells + at, cut->values[p] + (size_t)k * n, n * sizeof(double));
    at += part->mesh.num_cells;
    face += part->mesh.num_faces;
  }
  cut->boundaries.face = cut->boundary;
  for (int k = 0; k < cli_num_carried(j); k++) j->field[k].in = cut->in + k * cut->num_cells;
  return true;
}

/* The zones of the file and one for the pieces of each class, for messages, the report and the joining of zones. */
static bool name_zones(cli_job *j, cli_cut *cut)
{
  const rcgns_info *info = rcgns_get_info(j->file[REMAP_SOURCE]);
  const size_t      n = (size_t)info->num_zones, all = n + (size_t)cut->num_parts - 1;

  cut->zone             = malloc((all + 1) * sizeof *cut->zone);
  cut->zone_name        = malloc((all + 1) * sizeof *cut->zone_name);
  cut->zone_cell_offset = malloc((all + 2) * sizeof *cut->zone_cell_offset);
  cut->piece_name       = malloc((size_t)cut->num_parts * sizeof *cut->piece_name);
  if (!cut->zone || !cut->zone_name || !cut->zone_cell_offset || !cut->piece_name) return false;
  memcpy(cut->zone, info->zone, n * sizeof *cut->zone);
  for (int p = 1; p < cut->num_parts; p++) {
    snprintf(cut->piece_name[p], sizeof *cut->piece_name, "(pieces of zones of priority %d)", p + 1);
    cut->zone[n + (size_t)p - 1] = (rcgns_zone_info){
        .name = cut->piece_name[p], .num_cells = cut->part[p].num_visible, .first_cell = cut->first_global[p]};
  }
  for (size_t z = 0; z < all; z++) {
    cut->zone_name[z]        = cut->zone[z].name;
    cut->zone_cell_offset[z] = cut->zone[z].first_cell;
  }
  cut->zone_cell_offset[all]     = cut->first_global[cut->num_parts];
  cut->info                      = *info;
  cut->info.zone                 = cut->zone;
  cut->info.num_zones            = (int64_t)all;
  cut->block[0].num_zones        = cut->info.num_zones;
  cut->block[0].zone_name        = cut->zone_name;
  cut->block[0].zone_cell_offset = cut->zone_cell_offset;
  return true;
}

cli_exit cli_priority_cut(cli_job *j, cli_failure *why)
{
  rcgns_message message;
  int64_t       pieces = 0;
  cli_cut      *cut;
  size_t        n;
  cli_exit      mine;

  if (!cli_has_priority(j, REMAP_SOURCE)) return CLI_DONE;
  cli_progress_set(j->progress, "cutting zones", -1);
  n   = (size_t)class_of(j->options.priority, "") + 1;
  cut = j->cut = calloc(1, sizeof *cut);
  if (cut) {
    cut->num_classes  = (int)n;
    cut->part         = calloc(n, sizeof *cut->part);
    cut->block        = calloc(n, sizeof *cut->block);
    cut->values       = calloc(n, sizeof *cut->values);
    cut->first_global = calloc(n + 1, sizeof *cut->first_global);
  }
  mine = cut && cut->part && cut->block && cut->values && cut->first_global ? CLI_DONE : cli_no_memory(why);
  CLI_TRY(cli_agree(j, mine, why));
  if (j->options.supermesh)
    CLI_TRY(cli_from_cgns(rcgns_read_boundaries(j->file[REMAP_SOURCE], &cut->boundaries, &message), &message, why));
  CLI_TRY(add_classes(j, cut, why));
  CLI_TRY(cli_agree(j, join_parts(j, cut) && name_zones(j, cut) ? CLI_DONE : cli_no_memory(why), why));
  j->report.info[REMAP_SOURCE] = &cut->info;
  for (int p = 1; p < cut->num_parts; p++) pieces += cut->part[p].num_visible;
  cli_note(j, "%s: %lld pieces of cells of lower priority are visible", cut->info.path, (long long)pieces);
  return CLI_DONE;
}

void cli_cut_drop(cli_cut **address)
{
  cli_cut *cut = *address;

  *address = NULL;
  if (!cut) return;
  for (int p = 0; p < cut->num_parts; p++) {
    cli_part_drop(&cut->part[p]);
    free(cut->values[p]);
  }
  free(cut->part);
  free(cut->block);
  free(cut->values);
  free(cut->first_global);
  free(cut->in);
  free(cut->cell_global);
  free(cut->zone);
  free(cut->zone_name);
  free(cut->zone_cell_offset);
  free(cut->piece_name);
  free(cut->boundary);
  free(cut);
}

/* ---- cells of a side ---------------------------------------------------------------------------------------------- */

int64_t cli_num_cells(const cli_job *j, remap_side side)
{
  return j->cut && side == REMAP_SOURCE ? j->cut->num_cells : rcgns_mesh(j->file[side])->num_cells;
}

const int64_t *cli_cells(const cli_job *j, remap_side side)
{
  return j->cut && side == REMAP_SOURCE ? j->cut->cell_global : rcgns_mesh(j->file[side])->cell_global;
}

const remap_mesh *cli_blocks(const cli_job *j, remap_side side, int *num_blocks)
{
  const bool is_cut = j->cut && side == REMAP_SOURCE;

  *num_blocks = is_cut ? j->cut->num_parts : 1;
  return is_cut ? j->cut->block : rcgns_mesh(j->file[side]);
}

void cli_set_mesh(const cli_job *j, remap_context *ctx, remap_side side)
{
  remap_mesh mesh = *rcgns_mesh(j->file[side]);

  mesh.cell_volume = j->volume[side];
  if (j->cut && side == REMAP_SOURCE)
    remap_set_blocks(ctx, side, j->cut->num_parts, j->cut->block);
  else
    remap_set_mesh(ctx, side, &mesh);
}
