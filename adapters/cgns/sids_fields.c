/* sids_fields -- FlowSolution_t: which node, which fields, their nature and their values.
 *
 * The choice rests on the tree alone, so it is the same on every rank without a message. A field is read as one slab for each
 * zone and rank, rind left out. */
#include "cgns_private.h"

#include <fnmatch.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- nature ------------------------------------------------------------------------------------------------------- */

/* The first match counts. */
static const struct {
  const char  *pattern;
  remap_nature nature;
} NATURE[] = {
    {"Iblank", REMAP_FLAG},
    {"iblank", REMAP_FLAG},
    {"cellN", REMAP_FLAG},
    {"cellNF", REMAP_FLAG},
    {"ChimeraCellType", REMAP_FLAG},
    {"status", REMAP_FLAG},
    {"globalCell", REMAP_FLAG},
    {"PID", REMAP_FLAG},
    {"Shock", REMAP_FLAG},
    {"Res*", REMAP_VOLUME_MEAN},
    {"GridVelocity*", REMAP_VOLUME_MEAN},
    {"CoefPressure*", REMAP_VOLUME_MEAN},
    {"Pressure*", REMAP_VOLUME_MEAN},
    {"Temperature*", REMAP_VOLUME_MEAN},
    {"Mach*", REMAP_VOLUME_MEAN},
    {"Viscosity*", REMAP_VOLUME_MEAN},
    {"Vorticity*", REMAP_VOLUME_MEAN},
    {"TurbulentDistance*", REMAP_VOLUME_MEAN},
    {"VelocitySound*", REMAP_VOLUME_MEAN},
    {"DensityStagnation*", REMAP_VOLUME_MEAN},
    {"Density*", REMAP_CONSERVED},
    {"Momentum*", REMAP_CONSERVED},
    {"RotatingMomentum*", REMAP_CONSERVED},
    {"EnergyStagnationDensity", REMAP_CONSERVED},
    {"RotatingEnergyStagnationDensity", REMAP_CONSERVED},
    {"SpeciesDensity*", REMAP_CONSERVED},
    {"*Density", REMAP_CONSERVED},
    {"Energy", REMAP_CONSERVED},
    {"Velocity*", REMAP_MASS_SPECIFIC},
    {"RotatingVelocity*", REMAP_MASS_SPECIFIC},
    {"EnergyInternal", REMAP_MASS_SPECIFIC},
    {"EnergyKinetic", REMAP_MASS_SPECIFIC},
    {"EnergyStagnation", REMAP_MASS_SPECIFIC},
    {"Enthalpy*", REMAP_MASS_SPECIFIC},
    {"Entropy*", REMAP_MASS_SPECIFIC},
    {"MassFraction*", REMAP_MASS_SPECIFIC},
    {"MoleFraction*", REMAP_MASS_SPECIFIC},
    {"TurbulentEnergyKinetic", REMAP_MASS_SPECIFIC},
    {"TurbulentDissipation", REMAP_MASS_SPECIFIC},
    {"TurbulentDissipationRate", REMAP_MASS_SPECIFIC},
    {"TurbulentSANuTilde", REMAP_MASS_SPECIFIC},
    {"ReynoldsStress*", REMAP_MASS_SPECIFIC},
    {"Intermittency", REMAP_MASS_SPECIFIC},
};

remap_nature rcgns_nature(const char *name, int is_integer, int *known)
{
  const size_t num = sizeof NATURE / sizeof *NATURE;
  size_t       i   = 0;

  while (i < num && fnmatch(NATURE[i].pattern, name, 0)) i++;
  if (known) *known = i < num || is_integer;
  return is_integer ? REMAP_FLAG : i < num ? NATURE[i].nature : REMAP_VOLUME_MEAN;
}

/* ---- nodes -------------------------------------------------------------------------------------------------------- */

/* The next array of numbers in a solution after `after`; -1: none. */
static int64_t next_field(const rc_tree *tree, int64_t solution, int64_t after)
{
  while ((after = rc_tree_find(tree, solution, after, "DataArray_t", NULL)) >= 0) {
    const rc_node *n = rc_node_at(tree, after);

    if (n->kind == 'R' || n->kind == 'I') return after;
  }
  return -1;
}

static void location_of(const rc_tree *tree, int64_t solution, char *out, size_t size)
{
  rc_tree_string(tree, rc_tree_find(tree, solution, -1, "GridLocation_t", NULL), out, size);
  if (!*out) snprintf(out, size, "Vertex");
}

/* Is it located where the file's values are? */
static bool is_located(const rcgns_file *file, int64_t solution)
{
  char location[RC_NAME];

  location_of(&file->tree, solution, location, sizeof location);
  return !strcmp(location, file->location);
}

/* At the right place, of the whole zone, with at least one array. */
static bool is_usable(const rcgns_file *file, int64_t solution)
{
  const rc_tree *tree = &file->tree;

  return is_located(file, solution) && next_field(tree, solution, -1) >= 0 &&
         rc_tree_find(tree, solution, -1, NULL, "PointList") < 0 && rc_tree_find(tree, solution, -1, NULL, "PointRange") < 0;
}

static int64_t solution_named(const rcgns_file *file, const rc_zone *zone, const char *name)
{
  return rc_tree_find(&file->tree, zone->node, -1, "FlowSolution_t", name);
}

/* A list of words in a fixed space; what does not fit ends in dots. */
typedef struct words {
  char   text[400];
  size_t used;
} words;

static void add_word(words *w, const char *word)
{
  const size_t room = sizeof w->text - w->used;
  const int    n    = room > 48 ? snprintf(w->text + w->used, room, "%s%s", w->used ? ", " : "", word)
                                : snprintf(w->text + w->used, room, "%s", w->used && w->text[w->used - 1] == '.' ? "" : " ...");

  w->used += n > 0 ? (size_t)n : 0;
}

/* The fields of a node, or all solutions of a zone with their locations, for a message. */
static void list_fields(const rc_tree *tree, int64_t solution, words *out)
{
  for (int64_t at = -1; (at = next_field(tree, solution, at)) >= 0;) add_word(out, rc_node_at(tree, at)->name);
  if (!out->used) add_word(out, "none");
}

static void list_solutions(const rcgns_file *file, const rc_zone *zone, words *out)
{
  char word[3 * RC_NAME], location[RC_NAME];

  for (int64_t at = -1; (at = rc_tree_find(&file->tree, zone->node, at, "FlowSolution_t", NULL)) >= 0;) {
    location_of(&file->tree, at, location, sizeof location);
    snprintf(word, sizeof word, "%s (%s%s)", rc_node_at(&file->tree, at)->name, location,
             next_field(&file->tree, at, -1) < 0 ? ", empty" : "");
    add_word(out, word);
  }
  if (!out->used) add_word(out, "none");
}

/* Why a node that was asked for cannot be used. */
static rcgns_status check_usable(const rcgns_file *file, const rc_zone *zone, int64_t solution, rcgns_message *message)
{
  const rc_tree *tree   = &file->tree;
  const char    *name   = rc_node_at(tree, solution)->name;
  const char    *advice = "such fields cannot be remapped";
  words          fields = {.used = 0};
  char           location[RC_NAME];

  if (is_usable(file, solution)) return RCGNS_OK;
  location_of(tree, solution, location, sizeof location);
  list_fields(tree, solution, &fields);
  if (!strcmp(location, "Vertex")) advice = "ask for vertices (--location vertex)";
  if (!strcmp(location, "CellCenter")) advice = "ask for cells (--location cell)";
  if (!is_located(file, solution))
    return rc_fail(message, RCGNS_IO, "%s: zone %s: solution %s is %s-located (fields: %s), not %s: %s", file->path, zone->name,
                   name, location, fields.text, file->location, advice);
  if (next_field(tree, solution, -1) < 0)
    return rc_fail(message, RCGNS_IO, "%s: zone %s: solution %s holds no fields", file->path, zone->name, name);
  return rc_fail(message, RCGNS_IO, "%s: zone %s: solution %s covers a part of the zone only (PointList or PointRange)",
                 file->path, zone->name, name);
}

/* ---- choice ------------------------------------------------------------------------------------------------------- */

static rcgns_status choose_by_name(rcgns_file *file, const char *name, bool optional, rcgns_message *message)
{
  for (int64_t z = 0; z < file->num_zones; z++) {
    const rc_zone *zone = file->zone + z;
    const int64_t  at   = solution_named(file, zone, name);
    words          have = {.used = 0};

    if (optional) {
      file->solution[z] = at >= 0 && is_usable(file, at) ? at : -1;
      continue;
    }
    if (at < 0) {
      list_solutions(file, zone, &have);
      return rc_fail(message, RCGNS_USAGE, "%s: zone %s: it has no solution %s; it has: %s", file->path, zone->name, name,
                     have.text);
    }
    RC_TRY(check_usable(file, zone, at, message));
    file->solution[z] = at;
  }
  return RCGNS_OK;
}

/* The k-th usable solution of a zone, from 1; RCGNS_STEP_LAST: its last; -1: there is none. */
static int64_t nth_usable(const rcgns_file *file, const rc_zone *zone, int64_t k)
{
  int64_t last = -1, n = 0;

  for (int64_t at = -1; (at = rc_tree_find(&file->tree, zone->node, at, "FlowSolution_t", NULL)) >= 0;) {
    if (!is_usable(file, at)) continue;
    last = at;
    if (++n == k) return at;
  }
  return k == RCGNS_STEP_LAST ? last : -1;
}

/* The name that FlowSolutionPointers gives for step k (from 1), or for the last step that has one; false: there are none. */
static bool pointer_of(const rcgns_file *file, const rc_zone *zone, int64_t k, char *name, bool *in_range)
{
  const int64_t  data = rc_tree_find(&file->tree, zone->node, -1, "ZoneIterativeData_t", NULL);
  const int64_t  at   = data < 0 ? -1 : rc_tree_find(&file->tree, data, -1, NULL, "FlowSolutionPointers");
  const rc_node *n    = at < 0 ? NULL : rc_node_at(&file->tree, at);
  int64_t        steps;

  *name = 0;
  if (!n || n->kind != 'C' || n->small < 0 || n->nd != 2 || n->dim[1] > RC_NAME - 1) return false;
  steps     = n->dim[0];
  *in_range = k == RCGNS_STEP_LAST || k <= steps;
  for (int64_t s = k == RCGNS_STEP_LAST ? steps : k; s >= 1 && s <= steps; s--) {
    const char *text   = rc_text(&file->tree, n->small) + (s - 1) * n->dim[1];
    size_t      length = strnlen(text, (size_t)n->dim[1]);

    while (length && text[length - 1] == ' ') length--;
    memcpy(name, text, length);
    name[length] = 0;
    if (k != RCGNS_STEP_LAST || (*name && strcmp(name, "Null"))) break;
  }
  return true;
}

static rcgns_status choose_by_step(rcgns_file *file, int64_t step, rcgns_message *message)
{
  bool by_order = false;

  if (step < 1 && step != RCGNS_STEP_LAST) return rc_fail(message, RCGNS_USAGE, "%s: steps count from 1", file->path);
  for (int64_t z = 0; z < file->num_zones; z++) {
    const rc_zone *zone = file->zone + z;
    char           name[RC_NAME], which[24];
    bool           in_range = true;
    words          have     = {.used = 0};

    snprintf(which, sizeof which, "%lld", (long long)step);
    if (step == RCGNS_STEP_LAST) snprintf(which, sizeof which, "last");
    if (!pointer_of(file, zone, step, name, &in_range)) {
      file->solution[z] = nth_usable(file, zone, step);
      by_order          = true;
    } else {
      file->solution[z] = *name && strcmp(name, "Null") ? solution_named(file, zone, name) : -1;
    }
    if (file->solution[z] < 0) {
      list_solutions(file, zone, &have);
      return rc_fail(message, RCGNS_USAGE, "%s: zone %s: it has no %s solution for step %s; it has: %s", file->path, zone->name,
                     file->location, which, have.text);
    }
    RC_TRY(check_usable(file, zone, file->solution[z], message));
  }
  return by_order ? rc_note(file, message, "no FlowSolutionPointers: steps are the usable solutions in the order of the file")
                  : RCGNS_OK;
}

/* Is there a usable node of that name in every zone? */
static bool is_everywhere(const rcgns_file *file, const char *name)
{
  for (int64_t z = 0; z < file->num_zones; z++) {
    const int64_t at = solution_named(file, file->zone + z, name);

    if (at < 0 || !is_usable(file, at)) return false;
  }
  return true;
}

/* No usable node is everywhere: say what comes nearest. */
static rcgns_status explain_none(const rcgns_file *file, rcgns_message *message)
{
  for (int64_t z = 0; z < file->num_zones; z++) { /* a zone whose solutions are all of another location */
    const rc_zone *zone = file->zone + z;
    words          have = {.used = 0};

    if (nth_usable(file, zone, 1) >= 0) continue;
    for (int64_t at = -1; (at = rc_tree_find(&file->tree, zone->node, at, "FlowSolution_t", NULL)) >= 0;)
      if (!is_located(file, at) && next_field(&file->tree, at, -1) >= 0) return check_usable(file, zone, at, message);
    list_solutions(file, zone, &have);
    return rc_fail(message, RCGNS_IO, "%s: zone %s: it holds no %s solution with fields; it has: %s", file->path, zone->name,
                   file->location, have.text);
  }
  return rc_fail(message, RCGNS_IO, "%s: no %s solution has the same name in every zone: name one base", file->path,
                 file->location);
}

static rcgns_status choose_only(rcgns_file *file, bool optional, rcgns_message *message)
{
  const char *only  = NULL;
  int64_t     num   = 0;
  words       names = {.used = 0};

  for (int64_t at = -1; (at = rc_tree_find(&file->tree, file->zone->node, at, "FlowSolution_t", NULL)) >= 0;) {
    const char *name = rc_node_at(&file->tree, at)->name;

    if (!is_everywhere(file, name)) continue;
    only = name;
    num++;
    add_word(&names, name);
  }
  if (num > 1)
    return rc_fail(message, RCGNS_USAGE, "%s: it holds %lld %s solutions: name one of %s", file->path, (long long)num,
                   file->location, names.text);
  if (num) return choose_by_name(file, only, false, message);
  return optional ? RCGNS_OK : explain_none(file, message);
}

/* ---- fields ------------------------------------------------------------------------------------------------------- */

/* The array of a field in a zone; -1: none. */
static int64_t array_of(const rcgns_file *file, int64_t zone, const char *name)
{
  for (int64_t at = -1; file->solution[zone] >= 0 && (at = next_field(&file->tree, file->solution[zone], at)) >= 0;)
    if (!strcmp(rc_node_at(&file->tree, at)->name, name)) return at;
  return -1;
}

/* Where the zone's cells lie in an array of the solution; false: its size does not match. */
static bool core_of(const rcgns_file *file, const rc_zone *zone, int64_t solution, int64_t array, rc_box *box)
{
  const rc_node *n  = rc_node_at(&file->tree, array);
  const int      nd = zone->is_structured ? 3 : 1;
  int64_t        rind[6];
  bool           fits = n->nd == nd && rc_rind(&file->tree, solution, nd, rind);

  *box = (rc_box){.nd = nd};
  for (int d = 0; d < nd && fits; d++) {
    const int slow = nd - 1 - d;

    box->shape[slow]  = zone->is_structured ? zone->cells[d] : zone->num_cells;
    box->origin[slow] = rind[2 * d];
    fits              = n->dim[slow] == box->shape[slow] + rind[2 * d] + rind[2 * d + 1];
  }
  return fits;
}

/* Add the fields of one zone that are not yet known. */
static rcgns_status add_fields(rcgns_file *file, int64_t zone, ra_array *fields, rcgns_message *message)
{
  for (int64_t at = -1; file->solution[zone] >= 0 && (at = next_field(&file->tree, file->solution[zone], at)) >= 0;) {
    const rc_node *n     = rc_node_at(&file->tree, at);
    rcgns_field    field = {.name = n->name, .stored = n->type, .is_integer = n->kind == 'I', .missing_in = -1};
    bool           known = false;

    for (int64_t i = 0; i < fields->count; i++) known = known || !strcmp(((rcgns_field *)fields->item)[i].name, n->name);
    if (known) continue;
    if (n->type[0] == 'U') field.stored = n->type[1] == '4' ? "I4" : "I8";
    field.nature = rcgns_nature(n->name, field.is_integer, &field.nature_known);
    if (!ra_reserve(fields, 1, sizeof field)) return rc_no_memory(message);
    ((rcgns_field *)fields->item)[fields->count++] = field;
  }
  return RCGNS_OK;
}

/* All fields of the chosen nodes; with `optional`, those alone that every zone has in the right size. */
static rcgns_status list_chosen(rcgns_file *file, bool optional, rcgns_message *message)
{
  ra_array     fields = {.item = NULL};
  rcgns_field *f;
  int64_t      kept   = 0;
  rcgns_status status = RCGNS_OK;

  for (int64_t z = 0; z < file->num_zones && status == RCGNS_OK; z++) status = add_fields(file, z, &fields, message);
  f = fields.item;
  for (int64_t i = 0; i < fields.count; i++) {
    rc_box box;
    bool   fits = true;

    for (int64_t z = 0; z < file->num_zones; z++) {
      const int64_t array = array_of(file, z, f[i].name);

      if (array < 0 && f[i].missing_in < 0) f[i].missing_in = (int)z;
      fits = fits && array >= 0 && core_of(file, file->zone + z, file->solution[z], array, &box);
    }
    if (!optional || fits) f[kept++] = f[i];
  }
  free(file->field);
  file->field      = f;
  file->num_fields = kept;
  return status;
}

rcgns_status rcgns_select_solution(rcgns_file *file, const rcgns_choice *choice, rcgns_solution *out, rcgns_message *message)
{
  rcgns_choice plain;
  rcgns_status status;

  rcgns_choice_default(&plain);
  if (!choice) choice = &plain;
  for (int64_t z = 0; z < file->num_zones; z++) file->solution[z] = -1;
  file->num_fields = 0;
  if (choice->name)
    status = choose_by_name(file, choice->name, choice->optional, message);
  else if (choice->step)
    status = choose_by_step(file, choice->step, message);
  else
    status = choose_only(file, choice->optional, message);
  if (status == RCGNS_OK) status = list_chosen(file, choice->optional, message);
  status = rc_agree(file->comm, status, message);
  if (status == RCGNS_OK) {
    const int64_t first = file->solution[0];

    *out = (rcgns_solution){first < 0 ? NULL : rc_node_at(&file->tree, first)->name, file->num_fields, file->field};
  }
  return status;
}

/* Read one array per zone, array [zones], each of the size of its zone. Collective. */
static rcgns_status read_arrays(rcgns_file *file, const int64_t *array, double *values, rcgns_message *message)
{
  for (int64_t z = 0; z < file->num_zones; z++) {
    const rc_zone *zone = file->zone + z;
    const int64_t  lo   = rc_clamp(file->cell_lo - zone->first_cell, 0, zone->num_cells),
                  hi    = rc_clamp(file->cell_hi - zone->first_cell, lo, zone->num_cells);
    rc_box box;

    core_of(file, zone, rc_node_at(&file->tree, array[z])->parent, array[z], &box);
    RC_TRY(rc_read(file, RCGNS_OK, array[z], &box, lo, hi, 'R', values, message));
    if (values) values += hi - lo;
  }
  return RCGNS_OK;
}

/* The arrays of a field of the chosen solution; what is wrong is said before anything is read. */
static rcgns_status find_field(const rcgns_file *file, const char *name, int64_t *array, rcgns_message *message)
{
  bool known = false;

  for (int64_t i = 0; i < file->num_fields; i++) known = known || !strcmp(file->field[i].name, name);
  if (!known) return rc_fail(message, RCGNS_USAGE, "%s: the chosen solution has no field %s", file->path, name);
  for (int64_t z = 0; z < file->num_zones; z++) {
    rc_box box;

    array[z] = array_of(file, z, name);
    if (array[z] < 0)
      return rc_fail(message, RCGNS_IO, "%s: zone %s: field %s is missing there: leave it out (--fields)", file->path,
                     file->zone[z].name, name);
    if (!core_of(file, file->zone + z, file->solution[z], array[z], &box))
      return rc_fail(message, RCGNS_IO, "%s: zone %s: the size of field %s does not match the zone's %lld cells", file->path,
                     file->zone[z].name, name, (long long)file->zone[z].num_cells);
  }
  return RCGNS_OK;
}

rcgns_status rcgns_read_field(rcgns_file *file, const char *name, double *values, rcgns_message *message)
{
  int64_t     *array  = ra_alloc(file->num_zones, sizeof *array);
  rcgns_status status = array ? find_field(file, name, array, message) : rc_no_memory(message);

  status = rc_agree(file->comm, status, message);
  if (status == RCGNS_OK) status = read_arrays(file, array, values, message);
  free(array);
  return rc_name_file(file->path, status, message);
}

/* ---- fields of any node ------------------------------------------------------------------------------------------- */

/* The cell array `field` of a node of a zone; -1: none of the zone's size. */
static int64_t cells_in(const rcgns_file *file, const rc_zone *zone, int64_t node, const char *field)
{
  const char *label = rc_node_at(&file->tree, node)->label;
  int64_t     at    = -1;
  rc_box      box;

  if ((strcmp(label, "FlowSolution_t") && strcmp(label, "DiscreteData_t")) || !is_usable(file, node)) return -1;
  while ((at = next_field(&file->tree, node, at)) >= 0)
    if (!strcmp(rc_node_at(&file->tree, at)->name, field)) return core_of(file, zone, node, at, &box) ? at : -1;
  return -1;
}

/* The array that `name` means in a zone; -1: there is none. */
static int64_t find_cells(const rcgns_file *file, int64_t z, const char *name)
{
  const rc_zone *zone  = file->zone + z;
  const char    *slash = strchr(name, '/'), *field = slash ? slash + 1 : name;
  int64_t        array = -1;

  if (!slash && file->solution[z] >= 0) array = cells_in(file, zone, file->solution[z], field);
  for (int64_t at = -1; array < 0 && (at = rc_tree_find(&file->tree, zone->node, at, NULL, NULL)) >= 0;) {
    const char *node = rc_node_at(&file->tree, at)->name;

    if (slash && (strncmp(node, name, (size_t)(slash - name)) || node[slash - name])) continue;
    array = cells_in(file, zone, at, field);
  }
  return array;
}

rcgns_status rcgns_read_cells(rcgns_file *file, const char *name, double *values, rcgns_message *message)
{
  int64_t     *array  = ra_alloc(file->num_zones, sizeof *array);
  rcgns_status status = array ? RCGNS_OK : rc_no_memory(message);

  for (int64_t z = 0; z < file->num_zones && status == RCGNS_OK; z++) {
    words have = {.used = 0};

    if ((array[z] = find_cells(file, z, name)) >= 0) continue;
    list_solutions(file, file->zone + z, &have);
    status = rc_fail(message, RCGNS_USAGE, "%s: zone %s: it has no cell-centred field %.100s; its solutions are: %s",
                     file->path, file->zone[z].name, name, have.text);
  }
  status = rc_agree(file->comm, status, message);
  if (status == RCGNS_OK) status = read_arrays(file, array, values, message);
  free(array);
  return rc_name_file(file->path, status, message);
}
