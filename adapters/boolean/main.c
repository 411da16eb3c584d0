/* remap-boolean -- intersect, join or subtract two bodies, meshes or closed surfaces, on any number of ranks.
 *
 * The job goes step by step; each step is collective and ends with the same status on every rank, so that all of them leave
 * together. OUT is written last. Memory beyond that of the library and the files: a number per field and cell of the result. */
#include "boolean.h"

#include <progress.h>

#include <string.h>

#define PROGRESS_SECONDS 8.0 /* between lines */

/* Everything a step may need. */
typedef struct job {
  MPI_Comm             comm;
  int                  rank;
  bool_options         options;
  double               begin;
  cli_progress        *progress; /* NULL but on a rank that speaks */
  bool_operand         operand[2];
  remap_context       *ctx;
  remap_supermesh_view view;
  bool_content         content;
  bool_report          report;
} job;

/* ---- the library --------------------------------------------------------------------------------------------------- */

static void print_log(void *user, const char *line)
{
  const job *j = user;

  printf("remap-boolean: rank %d: %s\n", j->rank, line);
  fflush(stdout);
}

static int hear_progress(void *user, const char *phase, double done)
{
  const job *j = user;

  cli_progress_set(j->progress, phase, done);
  return 0;
}

/* A status of the library as ours, with the files' names where its message has none. */
static cli_exit from_remap(const job *j, remap_status status, cli_failure *why)
{
  const char    *text = j->ctx ? remap_message(j->ctx) : "", *const *path = j->options.path;
  const cli_exit code = status == REMAP_BAD_MESH || status == REMAP_ZONE_OVERLAP ? CLI_GEOMETRY : CLI_INTERNAL;

  if (status == REMAP_OK) return CLI_DONE;
  if (!*text) text = remap_status_text(status);
  if (strstr(text, path[0]) || strstr(text, path[1])) return cli_fail(why, code, "%s", text);
  return cli_fail(why, code, "%s and %s: %s", path[0], path[1], text);
}

static cli_exit make_supermesh(job *j, cli_failure *why)
{
  const double            begin = MPI_Wtime();
  remap_options           options;
  remap_supermesh_options how;

  cli_progress_set(j->progress, "supermesh", -1);
  remap_options_default(&options);
  options.faces    = j->options.faces;
  options.log      = j->options.verbose && !j->options.quiet ? print_log : NULL;
  options.progress = hear_progress;
  options.user     = j;
  remap_supermesh_options_default(&how);
  how.keep          = j->options.keep;
  how.aggregate     = j->options.aggregate;
  how.split_concave = j->options.split;
  CLI_TRY(from_remap(j, remap_create(j->comm, &options, &j->ctx), why));
  for (int side = 0; side < 2; side++) remap_set_mesh(j->ctx, (remap_side)side, &j->operand[side].mesh);
  CLI_TRY(from_remap(j, remap_supermesh(j->ctx, &how, &j->view), why));
  j->report.seconds_supermesh = cli_slowest(j->comm, begin);
  bool_report_count(j->comm, &j->view, &j->report);
  if (j->view.global_cells) return CLI_DONE;
  return cli_fail(why, CLI_COVERAGE, "%s of %s and %s has no cells: nothing is written", j->options.operation,
                  j->options.path[0], j->options.path[1]);
}

/* ---- the job ------------------------------------------------------------------------------------------------------- */

static cli_exit finish_report(job *j, cli_failure *why)
{
  cli_exit code = CLI_DONE;

  j->report.content       = &j->content;
  j->report.peak_rss      = cli_peak_rss(j->comm);
  j->report.seconds_total = cli_slowest(j->comm, j->begin);
  if (j->rank == 0) {
    if (!j->options.quiet) bool_report_print(stdout, &j->report);
    if (j->options.report) code = bool_report_write(&j->report, why);
  }
  return cli_agree_on(j->comm, code, why);
}

static cli_exit run(job *j, cli_failure *why)
{
  double   begin;
  cli_exit begun = CLI_DONE;

  j->report.options = &j->options;
  CLI_TRY(bool_output_check(j->comm, &j->options, why));
  if (j->rank == 0 && j->options.report) begun = bool_report_begin(&j->report, why);
  CLI_TRY(cli_agree_on(j->comm, begun, why));
  cli_progress_set(j->progress, "reading", -1);
  for (int side = 0; side < 2; side++) CLI_TRY(bool_operand_open(j->comm, &j->options, side, &j->operand[side], why));
  j->report.operand      = j->operand;
  j->report.seconds_read = cli_slowest(j->comm, j->begin);
  MPI_Comm_size(j->comm, &j->report.ranks);
  CLI_TRY(make_supermesh(j, why));
  CLI_TRY(bool_content_make(j->comm, &j->options, j->ctx, j->operand, &j->view, &j->content, why));
  cli_progress_set(j->progress, "writing", -1);
  begin = MPI_Wtime();
  CLI_TRY(bool_output_write(j->comm, &j->options, &j->content.content, why));
  j->report.seconds_write = cli_slowest(j->comm, begin);
  return finish_report(j, why);
}

int main(int argc, char **argv)
{
  job         j = {.comm = MPI_COMM_WORLD};
  cli_failure why;
  cli_exit    code;

  cli_begin(&argc, &argv);
  MPI_Comm_rank(j.comm, &j.rank);
  j.begin = MPI_Wtime();
  code    = bool_options_parse(argc, argv, &j.options, &why);
  if (code == CLI_DONE && (j.options.help || j.options.version)) {
    if (j.rank == 0 && j.options.help) bool_options_help(stdout);
    if (j.rank == 0 && !j.options.help) printf("remap-boolean %s\n", remap_version());
  } else if (code == CLI_DONE) {
    if (j.rank == 0 && !j.options.quiet) j.progress = cli_progress_start("remap-boolean", stdout, PROGRESS_SECONDS);
    code = run(&j, &why);
    cli_progress_stop(j.progress);
    bool_report_end(&j.report);
    bool_content_drop(&j.content);
    remap_destroy(&j.ctx);
    for (int side = 0; side < 2; side++) bool_operand_close(&j.operand[side]);
  }
  return cli_end("remap-boolean", code, &why);
}
