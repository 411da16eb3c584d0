/* masks -- which cells of SOURCE give values and which of TARGET want them, by a field of the file such as Iblank or cellN.
 *
 * Codes by convention, the field's name deciding: cellN (0 hole, 1 computed, above 1 interpolated), Iblank (0 hole, above 0
 * computed, below 0 interpolated), others (not 0: takes part). What is interpolated is known better where it was computed, so
 * it does not give; but a solver that starts reads it, so it wants. O(cells). */
#include "job.h"

#include <fnmatch.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_CODES = 32 };

/* A mask as it was asked for: which codes of which field take part. */
typedef struct mask_rule {
  char       field[128];
  remap_side side;
  int        num_codes; /* 0: by convention */
  long long  code[MAX_CODES];
} mask_rule;

/* ---- the rule ----------------------------------------------------------------------------------------------------- */

static const char *option_of(remap_side side) { return side == REMAP_SOURCE ? "--source-mask" : "--target-mask"; }

/* The name of the field without its node. */
static const char *bare(const char *field)
{
  const char *slash = strrchr(field, '/');

  return slash ? slash + 1 : field;
}

static cli_exit read_rule(const char *text, remap_side side, mask_rule *out, cli_failure *why)
{
  const char  *equals = strrchr(text, '=');
  const size_t length = equals ? (size_t)(equals - text) : strlen(text);

  *out = (mask_rule){.side = side};
  if (length == 0 || length >= sizeof out->field)
    return cli_fail(why, CLI_USAGE, "%s: '%.200s' names no field: give FIELD or FIELD=CODES", option_of(side), text);
  memcpy(out->field, text, length);
  for (const char *at = equals; at && *at; out->num_codes++) {
    char *end;

    if (out->num_codes < MAX_CODES) out->code[out->num_codes] = strtoll(at + 1, &end, 10);
    if (out->num_codes == MAX_CODES || end == at + 1 || (*end && *end != '+'))
      return cli_fail(why, CLI_USAGE, "%s: '%.200s' are no codes: give whole numbers such as 1+2", option_of(side), equals + 1);
    at = end;
  }
  if (!out->num_codes && !strcmp(bare(out->field), "ChimeraCellType"))
    return cli_fail(why, CLI_USAGE,
                    "%s: the codes of ChimeraCellType differ between codes: give those that take part, as in %s=1",
                    option_of(side), out->field);
  return CLI_DONE;
}

static bool takes_part(const mask_rule *rule, double value)
{
  const long long code      = llround(value);
  const bool      is_source = rule->side == REMAP_SOURCE;

  if (rule->num_codes) {
    for (int i = 0; i < rule->num_codes; i++)
      if (rule->code[i] == code) return true;
    return false;
  }
  if (is_source && fnmatch("cellN*", bare(rule->field), 0) == 0) return code == 1;
  if (is_source && fnmatch("[Ii][Bb]lank*", bare(rule->field), 0) == 0) return code > 0;
  return code != 0;
}

bool cli_is_mask(const cli_options *options, const char *field)
{
  mask_rule   rule;
  cli_failure why;

  for (int side = 0; side < 2; side++)
    if (options->mask[side] && read_rule(options->mask[side], (remap_side)side, &rule, &why) == CLI_DONE &&
        !strcmp(bare(rule.field), field))
      return true;
  return false;
}

/* ---- reading ------------------------------------------------------------------------------------------------------ */

/* The mask from the values; *num counts the cells of this rank that take part. */
static cli_exit fill_mask(cli_job *j, const mask_rule *rule, const double *values, int64_t *num, cli_failure *why)
{
  const rcgns_info *info = rcgns_get_info(j->file[rule->side]);
  const remap_mesh *mesh = rcgns_mesh(j->file[rule->side]);

  *num = 0;
  for (int64_t c = 0; c < mesh->num_cells; c++) {
    const rcgns_zone_info *zone = cli_zone_of(info, mesh->cell_global[c]);

    if (!(fabs(values[c]) < 1e18))
      return cli_fail(why, CLI_IO, "%s: zone %s: cell %lld (counted from 1): its %s is no code: give another field by %s",
                      info->path, zone->name, (long long)(mesh->cell_global[c] - zone->first_cell + 1), rule->field,
                      option_of(rule->side));
    j->mask[rule->side][c] = takes_part(rule, values[c]);
    *num += j->mask[rule->side][c];
  }
  return CLI_DONE;
}

static cli_exit read_mask(cli_job *j, remap_side side, cli_failure *why)
{
  const int64_t num_cells = rcgns_mesh(j->file[side])->num_cells;
  mask_rule     rule;
  rcgns_message message;
  double       *values = NULL;
  int64_t       num    = 0;
  cli_exit      mine;

  CLI_TRY(read_rule(j->options.mask[side], side, &rule, why));
  j->mask[side] = malloc((size_t)num_cells + 1);
  values        = malloc(((size_t)num_cells + 1) * sizeof *values);
  mine          = cli_agree(j, j->mask[side] && values ? CLI_DONE : cli_no_memory(why), why);
  if (mine == CLI_DONE) mine = cli_from_cgns(rcgns_read_cells(j->file[side], rule.field, values, &message), &message, why);
  if (mine == CLI_DONE) mine = cli_agree(j, fill_mask(j, &rule, values, &num, why), why);
  free(values);
  CLI_TRY(mine);
  MPI_Allreduce(MPI_IN_PLACE, &num, 1, MPI_INT64_T, MPI_SUM, j->comm);
  if (num == 0)
    return cli_fail(why, CLI_USAGE, "%s: by %s %s no cell takes part: give the codes, as in %s=1", j->options.path[side],
                    option_of(side), j->options.mask[side], rule.field);
  j->report.mask[side] = j->options.mask[side];
  return CLI_DONE;
}

cli_exit cli_masks_read(cli_job *j, cli_failure *why)
{
  for (int side = 0; side < 2; side++)
    if (j->options.mask[side]) CLI_TRY(read_mask(j, (remap_side)side, why));
  return CLI_DONE;
}

/* ---- use ---------------------------------------------------------------------------------------------------------- */

static cli_exit set_masks(cli_job *j, double min_coverage, cli_failure *why)
{
  const remap_masks masks = {
      .gives = {j->mask[REMAP_SOURCE], NULL}, .wants = {NULL, j->mask[REMAP_TARGET]}, .min_coverage = {0, min_coverage}};

  return cli_from_remap(j, remap_set_masks(j->ctx, &masks), why);
}

static bool has_masks(const cli_job *j) { return j->options.mask[REMAP_SOURCE] || j->options.mask[REMAP_TARGET]; }

cli_exit cli_masks_apply(cli_job *j, cli_failure *why) { return has_masks(j) ? set_masks(j, 0, why) : CLI_DONE; }

/* A mask lets zones overlap; but what gives must not: it would count twice. */
static cli_exit check_overlap(cli_job *j, cli_failure *why)
{
  const double      most     = 1 + 1e-6; /* zones that only abut overlap by rounding */
  const rcgns_info *info     = rcgns_get_info(j->file[REMAP_TARGET]);
  const remap_mesh *mesh     = rcgns_mesh(j->file[REMAP_TARGET]);
  const double     *fraction = j->fraction[REMAP_TARGET];
  int64_t           cell     = 0;
  cli_exit          mine     = CLI_DONE;

  while (cell < mesh->num_cells && fraction[cell] <= most) cell++;
  if (cell < mesh->num_cells) {
    const rcgns_zone_info *zone = cli_zone_of(info, mesh->cell_global[cell]);

    mine = cli_fail(
        why, CLI_GEOMETRY,
        "%s: zones overlap where cells give values: cell %lld (counted from 1) of zone %s of %s is covered %.7g times: "
        "%s",
        j->options.path[REMAP_SOURCE], (long long)(mesh->cell_global[cell] - zone->first_cell + 1), zone->name, info->path,
        fraction[cell],
        j->options.priority ? "name the zones that overlap one by one in --priority, the highest first"
                            : "give a --source-mask of fewer cells, or --priority");
  }
  return cli_agree(j, mine, why);
}

cli_exit cli_masks_settle(cli_job *j, cli_failure *why)
{
  if (has_masks(j) || j->options.priority) CLI_TRY(check_overlap(j, why));
  return j->options.min_coverage > 0 ? set_masks(j, j->options.min_coverage, why) : CLI_DONE;
}

void cli_masks_fill(cli_job *j)
{
  const remap_mesh *mesh    = rcgns_mesh(j->file[REMAP_TARGET]);
  const uint8_t    *wants   = j->mask[REMAP_TARGET];
  const bool        is_fill = j->options.transfer.on_uncovered == REMAP_UNCOVERED_FILL;
  int64_t           first   = 0;
  int               rank    = 0, holder;

  if (!j->options.mask[REMAP_TARGET]) return;
  MPI_Comm_size(j->comm, &holder); /* cells ascend with the ranks */
  while (first < mesh->num_cells && !wants[first]) first++;
  rank = first < mesh->num_cells ? j->rank : holder;
  MPI_Allreduce(&rank, &holder, 1, MPI_INT, MPI_MIN, j->comm);
  for (int k = 0; k < j->num_fields; k++) {
    double value = j->rank == holder ? j->field[k].out[first] : 0;

    MPI_Bcast(&value, 1, MPI_DOUBLE, holder, j->comm);
    if (is_fill) value = j->options.transfer.fill_value;
    for (int64_t c = 0; c < mesh->num_cells && !j->field[k].has_old; c++)
      if (!wants[c]) j->field[k].out[c] = value;
  }
}
