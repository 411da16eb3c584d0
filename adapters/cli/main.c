/* remap -- transfer the cell-centred fields of one CGNS file to the mesh of another, on any number of ranks.
 *
 * The job goes step by step; each step is collective and ends with the same status on every rank, so that all of them leave
 * together. What can be refused at once is refused before the meshes are overlaid; OUTPUT is written last, after the result
 * is verified. Memory beyond that of the library and the files: two numbers per field and cell. */
#include "job.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PROGRESS_SECONDS 8.0 /* a line at least every 10 s is promised */

/* ---- ranks together ----------------------------------------------------------------------------------------------- */

/* What the files and the options leave to remark. */
static void collect_notes(cli_job *j)
{
  for (int side = 0; side < 2; side++) {
    const rcgns_info *info = rcgns_get_info(j->file[side]);

    for (int64_t i = 0; i < info->num_notes; i++) cli_note(j, "%s: %s", info->path, info->note[i]);
  }
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

static cli_exit open_file(cli_job *j, remap_side side, cli_failure *why)
{
  const cli_options *options = &j->options;
  rcgns_options      how;
  rcgns_message      message;

  rcgns_options_default(&how);
  how.base         = options->base[side];
  how.location     = options->location;
  how.face_numbers = options->supermesh != NULL;
  if (side == REMAP_SOURCE) {
    how.scale = options->scale;
    if (options->transform) {
      const cli_exit mine = j->rank ? CLI_DONE : read_matrix(options->transform, how.transform, why);

      CLI_TRY(cli_agree(j, mine, why));
      MPI_Bcast(how.transform, 12, MPI_DOUBLE, 0, j->comm);
    }
    memcpy(j->transform, how.transform, sizeof j->transform);
  }
  CLI_TRY(cli_from_cgns(rcgns_open(j->comm, options->path[side], &how, &j->file[side], &message), &message, why));
  j->report.info[side] = rcgns_get_info(j->file[side]);
  return CLI_DONE;
}

/* A CGNS file to be written must be no input. Collective. */
static cli_exit check_new_file(cli_job *j, const char *path, cli_failure *why)
{
  rcgns_message message;

  for (int side = 0; side < 2; side++) CLI_TRY(cli_from_cgns(rcgns_check_output(j->file[side], path, &message), &message, why));
  return CLI_DONE;
}

/* Can OUTPUT, REPORT and the like be written, and are they no input? */
static cli_exit check_outputs(cli_job *j, cli_failure *why)
{
  const cli_options *options    = &j->options;
  const char *const  file[3]    = {options->output, options->source_coverage, options->supermesh};
  const char *const  word[3]    = {"-o", "--source-coverage", "--supermesh"};
  const char        *others[5]  = {options->path[REMAP_SOURCE], options->path[REMAP_TARGET]};
  int                num_others = 2;
  cli_exit           mine       = CLI_DONE;

  for (int i = 0; i < 3; i++) {
    if (!file[i]) continue;
    CLI_TRY(check_new_file(j, file[i], why));
    for (int k = 2; k < num_others && j->rank == 0 && mine == CLI_DONE; k++)
      if (cli_is_same_file(file[i], others[k]))
        mine = cli_fail(why, CLI_USAGE, "%s: it is used already: give %s another file", file[i], word[i]);
    others[num_others++] = file[i];
  }
  if (mine == CLI_DONE && options->report && j->rank == 0)
    mine = cli_report_open(options->report, num_others, others, &j->report_file, why);
  return cli_agree(j, mine, why);
}

static cli_exit open_files(cli_job *j, cli_failure *why)
{
  cli_progress_set(j->progress, "reading meshes", -1);
  CLI_TRY(open_file(j, REMAP_SOURCE, why));
  CLI_TRY(open_file(j, REMAP_TARGET, why));
  CLI_TRY(cli_priority_check(j, why));
  return check_outputs(j, why);
}

/* ---- the library -------------------------------------------------------------------------------------------------- */

static void print_log(void *user, const char *line)
{
  const cli_job *j = user;

  printf("remap: rank %d: %s\n", j->rank, line);
  fflush(stdout);
}

static int hear_progress(void *user, const char *phase, double done)
{
  const cli_job *j = user;

  cli_progress_set(j->progress, phase, done);
  return 0;
}

static cli_exit build(cli_job *j, cli_failure *why)
{
  remap_options options;
  remap_status  status;

  cli_progress_set(j->progress, "overlay", -1);
  remap_options_default(&options);
  options.faces = j->options.faces;
  for (int k = 0; k < j->num_fields; k++) options.systems |= j->field[k].system;
  options.max_order             = j->options.check && j->options.transfer.order < 2 ? 2 : j->options.transfer.order;
  options.zone_overlap_is_error = !j->options.mask[REMAP_SOURCE] && !j->options.mask[REMAP_TARGET] && !j->options.priority;
  options.log                   = j->options.verbose && !j->options.quiet ? print_log : NULL;
  options.progress              = hear_progress;
  options.user                  = j;
  status                        = remap_create(j->comm, &options, &j->ctx);
  if (status != REMAP_OK)
    return cli_fail(why, CLI_INTERNAL, "%s: %s", j->options.path[REMAP_SOURCE], remap_status_text(status));
  for (int side = 0; side < 2; side++) cli_set_mesh(j, j->ctx, (remap_side)side);
  CLI_TRY(cli_from_remap(j, remap_build(j->ctx), why));
  CLI_TRY(cli_from_remap(j, remap_get_stats(j->ctx, &j->report.stats), why));
  cli_volumes_doubt(j);
  CLI_TRY(cli_masks_apply(j, why));
  CLI_TRY(cli_coverage_find(j, why));
  return cli_masks_settle(j, why);
}

static cli_exit transfer(cli_job *j, cli_failure *why)
{
  remap_transfer     *how   = &j->options.transfer;
  const double        begin = MPI_Wtime();
  remap_field_report *what  = calloc((size_t)j->num_fields + 1, sizeof *what);
  cli_exit            mine  = cli_agree(j, what ? CLI_DONE : cli_no_memory(why), why);

  cli_progress_set(j->progress, "transfer", -1);
  how->allow_nan = j->options.allow_nan;
  if (mine == CLI_DONE)
    mine = cli_from_remap(j, remap_field(j->ctx, REMAP_FORWARD, how, j->num_fields + j->num_hidden, j->field, what), why);
  for (int k = 0; mine == CLI_DONE && k < j->num_fields; k++) j->row[k].what = what[k];
  if (mine == CLI_DONE) cli_masks_fill(j);
  free(what);
  CLI_TRY(mine);
  j->report.num_fields       = j->num_fields;
  j->report.field            = j->row;
  j->report.seconds_transfer = cli_slowest(j->comm, begin);
  return CLI_DONE;
}

/* ---- the end ------------------------------------------------------------------------------------------------------ */

/* The fields and, with --coverage, phi. Collective. */
static cli_exit write_target(cli_job *j, cli_failure *why)
{
  const cli_options *options = &j->options;
  rcgns_new_field   *fields  = calloc((size_t)j->num_fields + 1, sizeof *fields);
  cli_exit           mine    = cli_agree(j, fields ? CLI_DONE : cli_no_memory(why), why);
  rcgns_message      message;

  for (int k = 0; mine == CLI_DONE && k < j->num_fields; k++)
    fields[k] = (rcgns_new_field){.name = j->field[k].name, .values = j->field[k].out};
  if (mine == CLI_DONE) {
    const char  *solution = j->report.solution[REMAP_TARGET];
    rcgns_status status;

    fields[j->num_fields] = (rcgns_new_field){.name = CLI_COVERAGE_FIELD, .values = j->fraction[REMAP_TARGET]};
    status = rcgns_write(j->file[REMAP_TARGET], options->output, solution, j->num_fields + options->coverage, fields, &message);
    mine   = cli_from_cgns(status, &message, why);
  }
  free(fields);
  if (mine == CLI_DONE) j->report.output = options->output;
  return mine;
}

/* SOURCE with psi. Collective. */
static cli_exit write_source(cli_job *j, cli_failure *why)
{
  const char     *path  = j->options.source_coverage;
  double         *share = malloc(((size_t)rcgns_mesh(j->file[REMAP_SOURCE])->num_cells + 1) * sizeof *share);
  rcgns_new_field psi   = {.name = CLI_COVERAGE_FIELD, .values = share};
  cli_exit        mine  = cli_agree(j, share ? CLI_DONE : cli_no_memory(why), why);
  rcgns_message   message;

  if (mine == CLI_DONE) mine = cli_source_share(j, share, why);
  if (mine == CLI_DONE)
    mine = cli_from_cgns(rcgns_write(j->file[REMAP_SOURCE], path, j->report.solution[REMAP_SOURCE], 1, &psi, &message),
                         &message, why);
  free(share);
  if (mine == CLI_DONE) j->report.source_coverage = path;
  return mine;
}

static cli_exit write_output(cli_job *j, cli_failure *why)
{
  const double begin = MPI_Wtime();

  cli_progress_set(j->progress, "writing", -1);
  if (j->options.source_coverage) CLI_TRY(write_source(j, why));
  CLI_TRY(write_target(j, why));
  j->report.seconds_write = cli_slowest(j->comm, begin);
  return CLI_DONE;
}

/* Whether the report can be written is known to rank 0 only. */
static cli_exit finish_report(cli_job *j, cli_failure *why)
{
  cli_exit mine = CLI_DONE;

  collect_notes(j);
  j->report.num_notes     = j->num_notes;
  j->report.note          = j->note;
  j->report.peak_rss      = cli_peak_rss(j->comm);
  j->report.seconds_total = cli_slowest(j->comm, j->begin);
  if (j->rank == 0) {
    if (!j->options.quiet) cli_report_end(stdout, &j->report);
    if (j->options.report) mine = cli_report_commit(&j->report_file, &j->report, why);
  }
  return cli_agree(j, mine, why);
}

/* After a verification that failed the numbers are worth reading all the same. Collective. */
static cli_exit report_even_if(cli_job *j, cli_exit status, cli_failure *why)
{
  cli_failure lesser;

  if (status == CLI_DONE) return finish_report(j, why);
  if (status == CLI_VERIFY) (void)finish_report(j, &lesser);
  return status;
}

static cli_exit run(cli_job *j, cli_failure *why)
{
  const bool speaks = j->rank == 0 && !j->options.quiet;
  cli_exit   verified;

  CLI_TRY(open_files(j, why));
  if (!j->options.check) CLI_TRY(cli_fields_read(j, why));
  CLI_TRY(cli_masks_read(j, why));
  CLI_TRY(cli_volumes_read(j, why));
  CLI_TRY(cli_priority_cut(j, why));
  j->report.seconds_read = cli_slowest(j->comm, j->begin);
  MPI_Comm_size(j->comm, &j->report.stats.ranks);
  if (speaks) cli_report_meshes(stdout, &j->report, j->options.verbose);
  CLI_TRY(build(j, why));
  if (speaks) cli_report_overlap(stdout, &j->report);
  if (speaks) cli_report_cover(stdout, &j->report);
  if (j->options.check) {
    verified = cli_verify(j, why);
    if (verified == CLI_DONE) verified = cli_check(j, why);
    return report_even_if(j, verified, why);
  }
  CLI_TRY(transfer(j, why));
  if (speaks) cli_report_fields(stdout, &j->report);
  verified = cli_verify(j, why);
  if (verified != CLI_DONE) return report_even_if(j, verified, why);
  if (j->options.supermesh) CLI_TRY(cli_supermesh_write(j, why));
  CLI_TRY(write_output(j, why));
  return finish_report(j, why);
}

static void end(cli_job *j)
{
  cli_progress_stop(j->progress);
  cli_report_discard(&j->report_file);
  remap_destroy(&j->ctx);
  cli_cut_drop(&j->cut);
  for (int side = 0; side < 2; side++) rcgns_close(&j->file[side]);
  for (int i = 0; i < j->num_notes; i++) free(j->note[i]);
  free(j->note);
  for (int side = 0; side < 2; side++) free(j->mask[side]), free(j->fraction[side]), free(j->volume[side]);
  free(j->values);
  free(j->row);
  free(j->field);
}

int main(int argc, char **argv)
{
  cli_job     j = {.comm = MPI_COMM_WORLD};
  cli_failure why;
  cli_exit    status;

  cli_begin(&argc, &argv);
  MPI_Comm_rank(j.comm, &j.rank);
  j.begin = MPI_Wtime();
  status  = cli_options_parse(argc, argv, &j.options, &why);
  if (status == CLI_DONE && (j.options.help || j.options.version)) {
    if (j.rank == 0 && j.options.help) cli_options_help(stdout);
    if (j.rank == 0 && !j.options.help) printf("remap %s\n", remap_version());
  } else if (status == CLI_DONE) {
    if (j.rank == 0 && !j.options.quiet) j.progress = cli_progress_start("remap", stdout, PROGRESS_SECONDS);
    status = run(&j, &why);
    end(&j);
  }
  return cli_end("remap", status, &why);
}
