/* remap -- transfer the cell-centred fields of one CGNS file to the mesh of another, on any number of ranks.
 *
 * The job goes step by step; each step is collective and ends with the same status on every rank, so that all of them leave
 * together. What can be refused at once is refused before the meshes are overlaid; OUTPUT is written last, after the result
 * is verified. Memory beyond that of the library and the files: two numbers per field and cell. */
#include "cli.h"
#include "options.h"
#include "progress.h"
#include "report.h"

#include <cgns.h>
#include <fnmatch.h>
#include <math.h>
#include <mpi.h>
#include <remap/remap.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

#define PROGRESS_SECONDS 8.0

typedef struct job {
  MPI_Comm       comm;
  int            rank;
  cli_options    options;
  double         begin; /* MPI_Wtime */
  cli_progress  *progress;
  rcgns_file    *file[2];
  rcgns_solution solution[2]; /* of the target: the old values */
  remap_context *ctx;

  int               num_fields;
  remap_field_desc *field;  /* [num_fields] names, natures and where the values are    */
  cli_field_row    *row;    /* [num_fields]                                             */
  double           *values; /* behind all in and out                                    */
  int               num_notes;
  char            **note; /* [num_notes] */

  cli_report_file report_file; /* rank 0 */
  cli_report      report;
} job;

/* ---- ranks together ----------------------------------------------------------------------------------------------- */

/* The greatest of the ranks' statuses and the text of the lowest rank that has it. Collective. */
static cli_exit agree(const job *j, cli_exit mine, cli_failure *why)
{
  struct {
    int code, rank;
  } worst = {(int)mine, j->rank};

  MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_2INT, MPI_MAXLOC, j->comm);
  if (worst.code != CLI_DONE) MPI_Bcast(why->text, sizeof why->text, MPI_CHAR, worst.rank, j->comm);
  return (cli_exit)worst.code;
}

/* Seconds since then, of the slowest rank. Collective. */
static double slowest(const job *j, double since)
{
  double seconds = MPI_Wtime() - since;

  MPI_Allreduce(MPI_IN_PLACE, &seconds, 1, MPI_DOUBLE, MPI_MAX, j->comm);
  return seconds;
}

static int64_t peak_rss(const job *j)
{
  struct rusage usage;
  int64_t       bytes;

  getrusage(RUSAGE_SELF, &usage);
  bytes = (int64_t)usage.ru_maxrss * 1024;
  MPI_Allreduce(MPI_IN_PLACE, &bytes, 1, MPI_INT64_T, MPI_MAX, j->comm);
  return bytes;
}

static cli_exit no_memory(cli_failure *why) { return cli_fail(why, CLI_INTERNAL, "memory is out on one rank: use more ranks"); }

/* ---- failures of others in our words ------------------------------------------------------------------------------ */

static cli_exit from_cgns(rcgns_status status, const rcgns_message *message, cli_failure *why)
{
  static const cli_exit code[] = {[RCGNS_OK]       = CLI_DONE,
                                  [RCGNS_USAGE]    = CLI_USAGE,
                                  [RCGNS_IO]       = CLI_IO,
                                  [RCGNS_GEOMETRY] = CLI_GEOMETRY,
                                  [RCGNS_MEMORY]   = CLI_INTERNAL};

  return status == RCGNS_OK ? CLI_DONE : cli_fail(why, code[status], "%s", message->text);
}

static cli_exit from_remap(const job *j, remap_status status, cli_failure *why)
{
  const char *text = remap_message(j->ctx), *const *path = j->options.path;
  cli_exit    code = CLI_INTERNAL;

  switch (status) {
    case REMAP_OK: return CLI_DONE;
    case REMAP_COVERAGE: code = CLI_COVERAGE; break;
    case REMAP_BAD_VALUE: code = CLI_IO; break;
    case REMAP_BAD_MESH:
    case REMAP_ZONE_OVERLAP: code = CLI_GEOMETRY; break;
    default: break;
  }
  if (!*text) text = remap_status_text(status);
  if (strstr(text, path[REMAP_SOURCE]) || strstr(text, path[REMAP_TARGET])) return cli_fail(why, code, "%s", text);
  return cli_fail(why, code, "%s onto %s: %s", path[REMAP_SOURCE], path[REMAP_TARGET], text);
}

/* ---- remarks ------------------------------------------------------------------------------------------------------ */

/* Remember a remark for the report; one that finds no memory is lost. */
__attribute__((format(printf, 2, 3))) static void note(job *j, const char *format, ...)
{
  char  **more = realloc(j->note, (size_t)(j->num_notes + 1) * sizeof *more);
  va_list args;
  int     length;

  if (!more) return;
  j->note = more;
  va_start(args, format);
  length = vsnprintf(NULL, 0, format, args);
  va_end(args);
  if (length < 0 || !(more[j->num_notes] = malloc((size_t)length + 1))) return;
  va_start(args, format);
  vsnprintf(more[j->num_notes++], (size_t)length + 1, format, args);
  va_end(args);
}

static void collect_notes(job *j)
{
  for (int side = 0; side < 2; side++) {
    const rcgns_info *info = rcgns_get_info(j->file[side]);

    for (int64_t i = 0; i < info->num_notes; i++) note(j, "%s: %s", info->path, info->note[i]);
  }
  if (j->options.transfer.limiter == REMAP_LIMITER_AUTO && j->options.transfer.order > 1)
    note(j, "limiter auto: barth-jespersen");
}

/* ---- opening ------------------------------------------------------------------------------------------------------ */

/* The 12 numbers of a file, in rows of 4. */
static cli_exit read_matrix(const char *path, double matrix[3][4], cli_failure *why)
{
  FILE *in    = fopen(path, "r");
  int   count = 0;
  char  more;

  if (!in) return cli_fail(why, CLI_IO, "%s: the transform cannot be read: check the path", path);
  while (count < 12 && fscanf(in, "%lf", &matrix[count / 4][count % 4]) == 1 && isfinite(matrix[count / 4][count % 4])) count++;
  if (count < 12 || fscanf(in, " %c", &more) == 1) {
    fclose(in);
    return cli_fail(why, CLI_IO, "%s: it does not hold 12 numbers: give the 3 rows of [A | b]", path);
  }
  fclose(in);
  return CLI_DONE;
}

static cli_exit open_file(job *j, remap_side side, cli_failure *why)
{
  const cli_options *options = &j->options;
  rcgns_options      how;
  rcgns_message      message;

  rcgns_options_default(&how);
  how.base = options->base[side];
  if (side == REMAP_SOURCE) {
    how.scale = options->scale;
    if (options->transform) {
      const cli_exit mine = j->rank ? CLI_DONE : read_matrix(options->transform, how.transform, why);

      CLI_TRY(agree(j, mine, why));
      MPI_Bcast(how.transform, 12, MPI_DOUBLE, 0, j->comm);
    }
  }
  CLI_TRY(from_cgns(rcgns_open(j->comm, options->path[side], &how, &j->file[side], &message), &message, why));
  j->report.info[side] = rcgns_get_info(j->file[side]);
  return CLI_DONE;
}

/* Can OUTPUT and REPORT be written, and are they no input? */
static cli_exit check_outputs(job *j, cli_failure *why)
{
  const cli_options *options   = &j->options;
  const char *const  others[3] = {options->path[REMAP_SOURCE], options->path[REMAP_TARGET], options->output};
  rcgns_message      message;
  cli_exit           mine = CLI_DONE;

  for (int side = 0; side < 2; side++)
    CLI_TRY(from_cgns(rcgns_check_output(j->file[side], options->output, &message), &message, why));
  if (options->report && j->rank == 0) mine = cli_report_open(options->report, 3, others, &j->report_file, why);
  return agree(j, mine, why);
}

static cli_exit open_files(job *j, cli_failure *why)
{
  cli_progress_set(j->progress, "reading meshes", -1);
  CLI_TRY(open_file(j, REMAP_SOURCE, why));
  CLI_TRY(open_file(j, REMAP_TARGET, why));
  return check_outputs(j, why);
}

/* ---- fields ------------------------------------------------------------------------------------------------------- */

static cli_exit select_solutions(job *j, cli_failure *why)
{
  const cli_options *options = &j->options;
  rcgns_choice       choice;
  rcgns_message      message;

  rcgns_choice_default(&choice);
  choice.name = options->solution;
  choice.step = options->step == -1 ? RCGNS_STEP_LAST : options->step;
  CLI_TRY(
      from_cgns(rcgns_select_solution(j->file[REMAP_SOURCE], &choice, &j->solution[REMAP_SOURCE], &message), &message, why));
  j->report.solution[REMAP_SOURCE] = j->solution[REMAP_SOURCE].name;
  j->report.solution[REMAP_TARGET] = options->output_solution ? options->output_solution : j->solution[REMAP_SOURCE].name;
  rcgns_choice_default(&choice);
  choice.name     = j->report.solution[REMAP_TARGET];
  choice.optional = 1;
  return from_cgns(rcgns_select_solution(j->file[REMAP_TARGET], &choice, &j->solution[REMAP_TARGET], &message), &message, why);
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
static cli_exit refuse_name(const job *j, const char *from, const char *to, cli_failure *why)
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
static cli_exit match_list(const job *j, const char *list, bool *wanted, cli_failure *why)
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

/* Every field that all zones have. */
static void match_all(job *j, bool *wanted)
{
  const rcgns_solution *solution = &j->solution[REMAP_SOURCE];
  const rcgns_info     *info     = rcgns_get_info(j->file[REMAP_SOURCE]);

  for (int64_t i = 0; i < solution->num_fields; i++) {
    const rcgns_field *field = &solution->field[i];

    wanted[i] = field->missing_in < 0;
    if (!wanted[i])
      note(j, "%s: field %s is left out: zone %s lacks it", info->path, field->name, info->zone[field->missing_in].name);
  }
}

static bool has_old_value(const job *j, const char *name)
{
  const rcgns_solution *old = &j->solution[REMAP_TARGET];

  for (int64_t i = 0; i < old->num_fields; i++)
    if (!strcmp(old->field[i].name, name)) return old->field[i].missing_in < 0;
  return false;
}

static void describe_field(job *j, const rcgns_field *field)
{
  const int     k       = j->num_fields++;
  const bool    slopes  = j->options.transfer.order > 1 && field->nature != REMAP_FLAG;
  remap_limiter limiter = j->options.transfer.limiter;

  if (limiter == REMAP_LIMITER_AUTO) limiter = REMAP_LIMITER_BARTH_JESPERSEN;
  j->field[k] = (remap_field_desc){.name = field->name, .nature = field->nature, .has_old = has_old_value(j, field->name)};
  j->row[k]   = (cli_field_row){.name = field->name, .nature = field->nature, .limiter = slopes ? limiter : REMAP_LIMITER_NONE};
  if (!field->nature_known && !field->is_integer)
    note(j, "field %s: its name is not known, it is averaged over volume", field->name);
  if (field->nature == REMAP_MASS_SPECIFIC) note(j, "field %s: a quantity per mass, it is averaged over volume", field->name);
}

/* Choose the fields and make room for their values. */
static cli_exit select_fields(job *j, cli_failure *why)
{
  const rcgns_solution *solution = &j->solution[REMAP_SOURCE];
  const size_t          most     = (size_t)solution->num_fields;
  bool                 *wanted   = calloc(most + 1, sizeof *wanted);
  cli_exit              mine;

  j->field = calloc(most + 1, sizeof *j->field);
  j->row   = calloc(most + 1, sizeof *j->row);
  mine     = agree(j, wanted && j->field && j->row ? CLI_DONE : no_memory(why), why);
  if (mine == CLI_DONE && j->options.fields)
    mine = match_list(j, j->options.fields, wanted, why);
  else if (mine == CLI_DONE)
    match_all(j, wanted);
  for (size_t i = 0; mine == CLI_DONE && i < most; i++)
    if (wanted[i]) describe_field(j, &solution->field[i]);
  free(wanted);
  if (mine == CLI_DONE && j->num_fields == 0)
    return cli_fail(why, CLI_IO, "%s: no field of %s is in every zone: choose another by --solution",
                    j->options.path[REMAP_SOURCE], solution->name);
  return mine;
}

static cli_exit make_room(job *j, cli_failure *why)
{
  const int64_t num_in = rcgns_mesh(j->file[REMAP_SOURCE])->num_cells, num_out = rcgns_mesh(j->file[REMAP_TARGET])->num_cells;
  double       *at;

  j->values = calloc((size_t)j->num_fields * (size_t)(num_in + num_out) + 1, sizeof *j->values);
  CLI_TRY(agree(j, j->values ? CLI_DONE : no_memory(why), why));
  at = j->values;
  for (int k = 0; k < j->num_fields; k++, at += num_in + num_out) {
    j->field[k].in  = at;
    j->field[k].out = at + num_in;
  }
  return CLI_DONE;
}

/* Read one field; refuse values that are no numbers, naming the first cell of the lowest rank that has one. */
static cli_exit read_field(job *j, remap_side side, const char *name, double *values, cli_failure *why)
{
  const rcgns_info *info = rcgns_get_info(j->file[side]);
  const remap_mesh *mesh = rcgns_mesh(j->file[side]);
  rcgns_message     message;
  int64_t           cell = 0;
  cli_exit          mine = CLI_DONE;

  CLI_TRY(from_cgns(rcgns_read_field(j->file[side], name, values, &message), &message, why));
  while (cell < mesh->num_cells && isfinite(values[cell])) cell++;
  if (cell < mesh->num_cells) {
    int64_t zone = info->num_zones - 1;

    while (info->zone[zone].first_cell > mesh->cell_global[cell]) zone--;
    mine = cli_fail(why, CLI_IO, "%s: zone %s: cell %lld (counted from 1): %s is not a finite number: %s", info->path,
                    info->zone[zone].name, (long long)(mesh->cell_global[cell] - info->zone[zone].first_cell + 1), name,
                    side == REMAP_SOURCE ? "leave the field out by --fields" : "write elsewhere by --output-solution");
  }
  return agree(j, mine, why);
}

static cli_exit read_fields(job *j, cli_failure *why)
{
  cli_progress_set(j->progress, "reading fields", -1);
  CLI_TRY(select_solutions(j, why));
  CLI_TRY(select_fields(j, why));
  CLI_TRY(make_room(j, why));
  for (int k = 0; k < j->num_fields; k++) {
    remap_field_desc *field = &j->field[k];

    CLI_TRY(read_field(j, REMAP_SOURCE, field->name, (double *)field->in, why));
    if (field->has_old) CLI_TRY(read_field(j, REMAP_TARGET, field->name, field->out, why));
  }
  return CLI_DONE;
}

/* ---- the library -------------------------------------------------------------------------------------------------- */

static void print_log(void *user, const char *line)
{
  const job *j = user;

  printf("remap: rank %d: %s\n", j->rank, line);
  fflush(stdout);
}

static int hear_progress(void *user, const char *phase, double done)
{
  const job *j = user;

  cli_progress_set(j->progress, phase, done);
  return 0;
}

static cli_exit build(job *j, cli_failure *why)
{
  remap_options options;
  remap_status  status;

  cli_progress_set(j->progress, "overlay", -1);
  remap_options_default(&options);
  options.faces                 = j->options.faces;
  options.max_order             = j->options.transfer.order;
  options.zone_overlap_is_error = 1;
  options.log                   = j->options.verbose && !j->options.quiet ? print_log : NULL;
  options.progress              = hear_progress;
  options.user                  = j;
  status                        = remap_create(j->comm, &options, &j->ctx);
  if (status != REMAP_OK)
    return cli_fail(why, CLI_INTERNAL, "%s: %s", j->options.path[REMAP_SOURCE], remap_status_text(status));
  for (int side = 0; side < 2; side++) remap_set_mesh(j->ctx, (remap_side)side, rcgns_mesh(j->file[side]));
  CLI_TRY(from_remap(j, remap_build(j->ctx), why));
  return from_remap(j, remap_get_stats(j->ctx, &j->report.stats), why);
}

static cli_exit transfer(job *j, cli_failure *why)
{
  const double        begin = MPI_Wtime();
  remap_field_report *what  = calloc((size_t)j->num_fields, sizeof *what);
  cli_exit            mine  = agree(j, what ? CLI_DONE : no_memory(why), why);

  cli_progress_set(j->progress, "transfer", -1);
  if (mine == CLI_DONE)
    mine = from_remap(j, remap_field(j->ctx, REMAP_FORWARD, &j->options.transfer, j->num_fields, j->field, what), why);
  for (int k = 0; mine == CLI_DONE && k < j->num_fields; k++) j->row[k].what = what[k];
  free(what);
  CLI_TRY(mine);
  j->report.num_fields       = j->num_fields;
  j->report.field            = j->row;
  j->report.seconds_transfer = slowest(j, begin);
  return CLI_DONE;
}

/* Is the result as good as it must be? Written so that a NaN fails. */
static cli_exit verify(const job *j, cli_failure *why)
{
  const remap_stats *stats = &j->report.stats;

  for (int side = 0; side < 2; side++) {
    const rcgns_info *info = j->report.info[side];
    const int64_t     cell = stats->worst_closure_cell[side];
    int64_t           zone = info->num_zones - 1;

    if (stats->max_closure_error[side] <= CLI_MAX_CLOSURE) continue;
    while (zone > 0 && info->zone[zone].first_cell > cell) zone--;
    return cli_fail(
        why, CLI_VERIFY,
        "%s: zone %s: cell %lld (counted from 1): its overlaps sum up to its volume only within %.1e, the bar is %.0e: "
        "nothing is written; see whether the mesh folds there",
        info->path, info->zone[zone].name, (long long)(cell - info->zone[zone].first_cell + 1), stats->max_closure_error[side],
        CLI_MAX_CLOSURE);
  }
  for (int k = 0; k < j->num_fields; k++) {
    const double error = j->row[k].what.conservation_error;

    if (error <= CLI_MAX_CONSERVATION) continue;
    return cli_fail(why, CLI_VERIFY,
                    "%s: field %s is conserved only within %.1e, the bar is %.0e: nothing is written; see whether a mesh folds",
                    j->options.path[REMAP_SOURCE], j->row[k].name, error, CLI_MAX_CONSERVATION);
  }
  return CLI_DONE;
}

/* ---- the end ------------------------------------------------------------------------------------------------------ */

static cli_exit write_output(job *j, cli_failure *why)
{
  const cli_options *options = &j->options;
  const double       begin   = MPI_Wtime();
  rcgns_new_field   *fields  = calloc((size_t)j->num_fields, sizeof *fields);
  cli_exit           mine    = agree(j, fields ? CLI_DONE : no_memory(why), why);
  rcgns_message      message;

  cli_progress_set(j->progress, "writing", -1);
  for (int k = 0; mine == CLI_DONE && k < j->num_fields; k++)
    fields[k] = (rcgns_new_field){.name = j->field[k].name, .values = j->field[k].out};
  if (mine == CLI_DONE)
    mine = from_cgns(
        rcgns_write(j->file[REMAP_TARGET], options->output, j->report.solution[REMAP_TARGET], j->num_fields, fields, &message),
        &message, why);
  free(fields);
  CLI_TRY(mine);
  j->report.output        = options->output;
  j->report.seconds_write = slowest(j, begin);
  return CLI_DONE;
}

/* Whether the report can be written is known to rank 0 only. */
static cli_exit finish_report(job *j, cli_failure *why)
{
  cli_exit mine = CLI_DONE;

  collect_notes(j);
  j->report.num_notes     = j->num_notes;
  j->report.note          = j->note;
  j->report.peak_rss      = peak_rss(j);
  j->report.seconds_total = slowest(j, j->begin);
  if (j->rank == 0) {
    if (!j->options.quiet) cli_report_end(stdout, &j->report);
    if (j->options.report) mine = cli_report_commit(&j->report_file, &j->report, why);
  }
  return agree(j, mine, why);
}

static cli_exit run(job *j, cli_failure *why)
{
  const bool speaks = j->rank == 0 && !j->options.quiet;
  cli_exit   verified;

  CLI_TRY(open_files(j, why));
  CLI_TRY(read_fields(j, why));
  j->report.seconds_read = slowest(j, j->begin);
  MPI_Comm_size(j->comm, &j->report.stats.ranks);
  if (speaks) cli_report_meshes(stdout, &j->report, j->options.verbose);
  CLI_TRY(build(j, why));
  if (speaks) cli_report_overlap(stdout, &j->report);
  CLI_TRY(transfer(j, why));
  if (speaks) cli_report_fields(stdout, &j->report);
  verified = verify(j, why);
  if (verified != CLI_DONE) {
    cli_failure lesser;

    (void)finish_report(j, &lesser); /* the numbers are worth reading all the same */
    return verified;
  }
  CLI_TRY(write_output(j, why));
  return finish_report(j, why);
}

static void end(job *j)
{
  cli_progress_stop(j->progress);
  cli_report_discard(&j->report_file);
  remap_destroy(&j->ctx);
  for (int side = 0; side < 2; side++) rcgns_close(&j->file[side]);
  for (int i = 0; i < j->num_notes; i++) free(j->note[i]);
  free(j->note);
  free(j->values);
  free(j->row);
  free(j->field);
}

int main(int argc, char **argv)
{
  job         j = {.comm = MPI_COMM_WORLD};
  cli_failure why;
  cli_exit    status;
  int         threads;

  signal(SIGXFSZ, SIG_IGN);                                     /* a file that may not grow is a write error like others */
  MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &threads); /* the other thread only prints */
  MPI_Comm_rank(j.comm, &j.rank);
  j.begin = MPI_Wtime();
  status  = cli_options_parse(argc, argv, &j.options, &why);
  if (status == CLI_DONE && (j.options.help || j.options.version)) {
    if (j.rank == 0 && j.options.help) cli_options_help(stdout);
    if (j.rank == 0 && !j.options.help) printf("remap %s\n", remap_version());
  } else if (status == CLI_DONE) {
    if (j.rank == 0 && !j.options.quiet) j.progress = cli_progress_start(stdout, PROGRESS_SECONDS);
    status = run(&j, &why);
    end(&j);
  }
  if (status != CLI_DONE && j.rank == 0) fprintf(stderr, "remap: %s\n", why.text);
  MPI_Finalize();
  return (int)status;
}
