/* fields -- which solutions and which of their fields take part, and their values. A few messages per field: everything about
 * names is known to every rank from the file's tree, only values are read. */
#include "job.h"

#include <fnmatch.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static cli_exit select_solutions(cli_job *j, cli_failure *why)
{
  const cli_options *options = &j->options;
  rcgns_choice       choice;
  rcgns_message      message;

  rcgns_choice_default(&choice);
  choice.name = options->solution;
  choice.step = options->step == -1 ? RCGNS_STEP_LAST : options->step;
  CLI_TRY(cli_from_cgns(rcgns_select_solution(j->file[REMAP_SOURCE], &choice, &j->solution[REMAP_SOURCE], &message), &message,
                        why));
  j->report.solution[REMAP_SOURCE] = j->solution[REMAP_SOURCE].name;
  j->report.solution[REMAP_TARGET] = options->output_solution ? options->output_solution : j->solution[REMAP_SOURCE].name;
  CLI_TRY(
      cli_from_cgns(rcgns_check_solution(j->file[REMAP_TARGET], j->report.solution[REMAP_TARGET], &message), &message, why));
  rcgns_choice_default(&choice);
  choice.name     = j->report.solution[REMAP_TARGET];
  choice.optional = 1;
  return cli_from_cgns(rcgns_select_solution(j->file[REMAP_TARGET], &choice, &j->solution[REMAP_TARGET], &message), &message,
                       why);
}

/* Does the pattern from `from` up to `to` (excluded) name the field? A plain name needs no escapes. */
static bool matches(const char *from, const char *to, const char *name)
{
  char pattern[256];

  if ((size_t)(to - from) >= sizeof pattern) return false;
  memcpy(pattern, from, (size_t)(to - from));
  pattern[to - from] = '\0';
  return !strcmp(pattern, name) || fnmatch(pattern, name, 0) == 0;
}

/* Say which names there are. */
static cli_exit refuse_name(const cli_job *j, const char *from, const char *to, cli_failure *why)
{
  const rcgns_solution *solution   = &j->solution[REMAP_SOURCE];
  char                  names[600] = "";
  size_t                length     = 0;

  for (int64_t i = 0; i < solution->num_fields && length < sizeof names; i++)
    length += (size_t)snprintf(names + length, sizeof names - length, " %s", solution->field[i].name);
  return cli_fail(why, CLI_USAGE, "%s: %s has no field '%.*s': give some of:%s%s", j->options.path[REMAP_SOURCE],
                  solution->name, (int)(to - from < 200 ? to - from : 200), from, names, length < sizeof names ? "" : " ...");
}

/* Set wanted[i] for the fields of the solution that the list names. Errors: USAGE if one of its items names none. */
static cli_exit match_list(const cli_job *j, const char *list, bool *wanted, cli_failure *why)
{
  const rcgns_solution *solution = &j->solution[REMAP_SOURCE];

  for (const char *from = list, *to; *from; from = *to ? to + 1 : to) {
    bool any = false;

    to = from + strcspn(from, ",");
    for (int64_t i = 0; i < solution->num_fields; i++)
      if (matches(from, to, solution->field[i].name)) any = wanted[i] = true;
    if (!any) return refuse_name(j, from, to, why);
  }
  return CLI_DONE;
}

/* Every field that all zones have, but for masks: cells that give have theirs alike, and TARGET has its own. */
static void match_all(cli_job *j, bool *wanted)
{
  const rcgns_solution *solution = &j->solution[REMAP_SOURCE];
  const rcgns_info     *info     = rcgns_get_info(j->file[REMAP_SOURCE]);

  for (int64_t i = 0; i < solution->num_fields; i++) {
    const rcgns_field *field = &solution->field[i];

    wanted[i] = field->missing_in < 0;
    if (wanted[i] && cli_is_mask(&j->options, field->name)) {
      wanted[i] = false;
      cli_note(j, "%s: field %s is a mask and is left out: name it by --fields to transfer it", info->path, field->name);
      continue;
    }
    if (!wanted[i])
      cli_note(j, "%s: field %s is left out: zone %s lacks it", info->path, field->name, info->zone[field->missing_in].name);
  }
}

/* What the fields of the solution are, by the table or by --nature; given[i]: by the latter. */
static cli_exit find_natures(const cli_job *j, remap_nature *nature, bool *given, cli_failure *why)
{
  const rcgns_solution *solution = &j->solution[REMAP_SOURCE];

  for (int64_t i = 0; i < solution->num_fields; i++) nature[i] = solution->field[i].nature;
  for (int k = 0; k < j->options.num_natures; k++)
    for (const char *from = j->options.nature[k], *to; *from; from = *to ? to + 1 : to) {
      const char  *equals;
      char         word[32] = "";
      bool         any      = false;
      remap_nature what;

      to     = from + strcspn(from, ",");
      equals = from + strcspn(from, "=");
      if (equals < to && (size_t)(to - equals) <= sizeof word) memcpy(word, equals + 1, (size_t)(to - equals - 1));
      if (!cli_nature_of(word, &what))
        return cli_fail(why, CLI_USAGE,
                        "--nature: '%.*s' is not offered: give NAME=conserved, mass-specific, volume-mean or flag",
                        (int)(to - from < 200 ? to - from : 200), from);
      for (int64_t i = 0; i < solution->num_fields; i++)
        if (matches(from, equals, solution->field[i].name)) any = given[i] = true, nature[i] = what;
      if (!any) return refuse_name(j, from, equals, why);
    }
  return CLI_DONE;
}

static bool has_old_value(const cli_job *j, const char *name)
{
  const rcgns_solution *old = &j->solution[REMAP_TARGET];

  for (int64_t i = 0; i < old->num_fields; i++)
    if (!strcmp(old->field[i].name, name)) return old->field[i].missing_in < 0;
  return false;
}

static void describe_field(cli_job *j, const rcgns_field *field, remap_nature nature, bool is_given)
{
  const int           k       = j->num_fields++;
  const bool          slopes  = j->options.transfer.order > 1 && nature != REMAP_FLAG;
  const remap_limiter limiter = j->options.transfer.limiter;

  j->field[k] = (remap_field_desc){.name = field->name, .nature = nature, .has_old = has_old_value(j, field->name)};
  j->row[k]   = (cli_field_row){
        .name = field->name, .nature = nature, .limiter = slopes ? limiter : REMAP_LIMITER_NONE, .is_told = is_given};
  if (!field->nature_known && !field->is_integer && !is_given)
    cli_note(j, "field %s: its name is not known, it is averaged over volume: say what it is by --nature", field->name);
}

/* Choose the fields and make room for their values. */
static cli_exit select_fields(cli_job *j, cli_failure *why)
{
  const rcgns_solution *solution = &j->solution[REMAP_SOURCE];
  const size_t          most     = (size_t)solution->num_fields;
  bool                 *wanted = calloc(most + 1, sizeof *wanted), *given = calloc(most + 1, sizeof *given);
  remap_nature         *nature = calloc(most + 1, sizeof *nature);
  cli_exit              mine;

  j->field = calloc(most + 2, sizeof *j->field); /* and a hidden one */
  j->row   = calloc(most + 1, sizeof *j->row);
  mine     = cli_agree(j, wanted && given && nature && j->field && j->row ? CLI_DONE : cli_no_memory(why), why);
  if (mine == CLI_DONE) mine = find_natures(j, nature, given, why);
  if (mine == CLI_DONE && j->options.fields)
    mine = match_list(j, j->options.fields, wanted, why);
  else if (mine == CLI_DONE)
    match_all(j, wanted);
  for (size_t i = 0; mine == CLI_DONE && i < most; i++)
    if (wanted[i]) describe_field(j, &solution->field[i], nature[i], given[i]);
  free(wanted);
  free(given);
  free(nature);
  if (mine == CLI_DONE && j->num_fields == 0)
    return cli_fail(why, CLI_IO, "%s: no field of %s is in every zone: choose another by --solution",
                    j->options.path[REMAP_SOURCE], solution->name);
  return mine;
}

/* --coverage adds a field of its own. */
static cli_exit check_coverage_name(const cli_job *j, cli_failure *why)
{
  for (int k = 0; j->options.coverage && k < j->num_fields; k++)
    if (!strcmp(j->field[k].name, CLI_COVERAGE_FIELD))
      return cli_fail(why, CLI_USAGE, "%s: it has a field %s, which --coverage writes: leave one of them out (--fields)",
                      j->options.path[REMAP_SOURCE], CLI_COVERAGE_FIELD);
  return CLI_DONE;
}

static cli_exit make_room(cli_job *j, cli_failure *why)
{
  const int64_t num_in = rcgns_mesh(j->file[REMAP_SOURCE])->num_cells, num_out = rcgns_mesh(j->file[REMAP_TARGET])->num_cells;
  double       *at;

  j->values = calloc((size_t)(j->num_fields + j->num_hidden) * (size_t)(num_in + num_out) + 1, sizeof *j->values);
  CLI_TRY(cli_agree(j, j->values ? CLI_DONE : cli_no_memory(why), why));
  at = j->values;
  for (int k = 0; k < j->num_fields + j->num_hidden; k++, at += num_in + num_out) {
    j->field[k].in  = at;
    j->field[k].out = at + num_in;
  }
  return CLI_DONE;
}

/* Read one field; refuse values that are no numbers, naming the first cell of the lowest rank that has one. */
static cli_exit read_field(cli_job *j, remap_side side, const char *name, double *values, cli_failure *why)
{
  const rcgns_info *info = rcgns_get_info(j->file[side]);
  const remap_mesh *mesh = rcgns_mesh(j->file[side]);
  rcgns_message     message;
  int64_t           cell = 0;
  cli_exit          mine = CLI_DONE;

  CLI_TRY(cli_from_cgns(rcgns_read_field(j->file[side], name, values, &message), &message, why));
  while (cell < mesh->num_cells && (isfinite(values[cell]) || j->options.allow_nan)) cell++;
  if (cell < mesh->num_cells) {
    const rcgns_zone_info *zone = cli_zone_of(info, mesh->cell_global[cell]);

    mine = cli_fail(why, CLI_IO, "%s: zone %s: cell %lld (counted from 1): %s is not a finite number: %s", info->path,
                    zone->name, (long long)(mesh->cell_global[cell] - zone->first_cell + 1), name,
                    side == REMAP_SOURCE ? "leave the field out by --fields, or give --allow-nan"
                                         : "write elsewhere by --output-solution");
  }
  return cli_agree(j, mine, why);
}

/* The values of the hidden density. */
static cli_exit fill_hidden(cli_job *j, cli_failure *why)
{
  const int64_t  num[2] = {rcgns_mesh(j->file[REMAP_SOURCE])->num_cells, rcgns_mesh(j->file[REMAP_TARGET])->num_cells};
  const double **value  = malloc(((size_t)j->num_fields + 1) * sizeof *value);
  cli_exit       mine   = cli_agree(j, value ? CLI_DONE : cli_no_memory(why), why);

  for (int side = 0; side < 2 && mine == CLI_DONE; side++) {
    const remap_field_desc *hidden = &j->field[j->num_fields];

    for (int k = 0; k < j->num_fields; k++) value[k] = side == REMAP_SOURCE ? j->field[k].in : j->field[k].out;
    if (side == REMAP_SOURCE || hidden->has_old)
      cli_hidden_density(j, value, num[side], side == REMAP_SOURCE ? (double *)hidden->in : hidden->out);
  }
  free(value);
  return mine;
}

cli_exit cli_fields_read(cli_job *j, cli_failure *why)
{
  cli_progress_set(j->progress, "reading fields", -1);
  CLI_TRY(select_solutions(j, why));
  CLI_TRY(select_fields(j, why));
  CLI_TRY(check_coverage_name(j, why));
  cli_systems_find(j);
  CLI_TRY(make_room(j, why));
  for (int k = 0; k < j->num_fields; k++) {
    remap_field_desc *field = &j->field[k];

    CLI_TRY(read_field(j, REMAP_SOURCE, field->name, (double *)field->in, why));
    if (field->has_old) CLI_TRY(read_field(j, REMAP_TARGET, field->name, field->out, why));
  }
  return j->num_hidden ? fill_hidden(j, why) : CLI_DONE;
}
