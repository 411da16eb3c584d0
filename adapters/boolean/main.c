/* remap-boolean -- intersect, join or subtract two bodies, meshes or closed surfaces, on any number of ranks.
 *
 * The job goes step by step; each step is collective and ends with the same status on every rank, so that all of them leave
 * together. OUT is written last. Memory beyond that of the library and the files: a number per field and cell of the result. */
#include "boolean.h"

#include <progress.h>

#include <signal.h>
#include <string.h>
#include <sys/resource.h>

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

/* ---- ranks together ------------------------------------------------------------------------------------------------ */

bool_exit bool_agree(MPI_Comm comm, bool_exit mine, bool_failure *why)
{
  struct {
    int code, rank;
  } worst = {(int)mine, 0};

  MPI_Comm_rank(comm, &worst.rank);
  MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_2INT, MPI_MAXLOC, comm);
  if (worst.code != BOOL_DONE) MPI_Bcast(why->text, (int)sizeof why->text, MPI_CHAR, worst.rank, comm);
  return (bool_exit)worst.code;
}

bool_exit bool_no_memory(bool_failure *why)
{
  return bool_fail(why, BOOL_INTERNAL, "memory is out on one rank: use more ranks");
}

bool_exit bool_from_cgns(rcgns_status status, const rcgns_message *message, bool_failure *why)
{
  static const bool_exit code[] = {[RCGNS_OK]       = BOOL_DONE,
                                   [RCGNS_USAGE]    = BOOL_USAGE,
                                   [RCGNS_IO]       = BOOL_IO,
                                   [RCGNS_GEOMETRY] = BOOL_GEOMETRY,
                                   [RCGNS_MEMORY]   = BOOL_INTERNAL};

  return status == RCGNS_OK ? BOOL_DONE : bool_fail(why, code[status], "%s", message->text);
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
static bool_exit from_remap(const job *j, remap_status status, bool_failure *why)
{
  const char     *text = j->ctx ? remap_message(j->ctx) : "", *const *path = j->options.path;
  const bool_exit code = status == REMAP_BAD_MESH || status == REMAP_ZONE_OVERLAP ? BOOL_GEOMETRY : BOOL_INTERNAL;

  if (status == REMAP_OK) return BOOL_DONE;
  if (!*text) text = remap_status_text(status);
  if (strstr(text, path[0]) || strstr(text, path[1])) return bool_fail(why, code, "%s", text);
  return bool_fail(why, code, "%s and %s: %s", path[0], path[1], text);
}

static bool_exit make_supermesh(job *j, bool_failure *why)
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
  BOOL_TRY(from_remap(j, remap_create(j->comm, &options, &j->ctx), why));
  for (int side = 0; side < 2; side++) remap_set_mesh(j->ctx, (remap_side)side, &j->operand[side].mesh);
  BOOL_TRY(from_remap(j, remap_supermesh(j->ctx, &how, &j->view), why));
  j->report.seconds_supermesh = slowest(j, begin);
  bool_report_count(j->comm, &j->view, &j->report);
  if (j->view.global_cells) return BOOL_DONE;
  return bool_fail(why, BOOL_EMPTY, "%s of %s and %s has no cells: nothing is written", j->options.operation,
                   j->options.path[0], j->options.path[1]);
}

/* ---- the job ------------------------------------------------------------------------------------------------------- */

static bool_exit finish_report(job *j, bool_failure *why)
{
  bool_exit code = BOOL_DONE;

  j->report.content       = &j->content;
  j->report.peak_rss      = peak_rss(j);
  j->report.seconds_total = slowest(j, j->begin);
  if (j->rank == 0) {
    if (!j->options.quiet) bool_report_print(stdout, &j->report);
    if (j->options.report) code = bool_report_write(&j->report, why);
  }
  return bool_agree(j->comm, code, why);
}

static bool_exit run(job *j, bool_failure *why)
{
  double    begin;
  bool_exit begun = BOOL_DONE;

  j->report.options = &j->options;
  BOOL_TRY(bool_output_check(j->comm, &j->options, why));
  if (j->rank == 0 && j->options.report) begun = bool_report_begin(&j->report, why);
  BOOL_TRY(bool_agree(j->comm, begun, why));
  cli_progress_set(j->progress, "reading", -1);
  for (int side = 0; side < 2; side++) BOOL_TRY(bool_operand_open(j->comm, &j->options, side, &j->operand[side], why));
  j->report.operand      = j->operand;
  j->report.seconds_read = slowest(j, j->begin);
  MPI_Comm_size(j->comm, &j->report.ranks);
  BOOL_TRY(make_supermesh(j, why));
  BOOL_TRY(bool_content_make(j->comm, &j->options, j->ctx, j->operand, &j->view, &j->content, why));
  cli_progress_set(j->progress, "writing", -1);
  begin = MPI_Wtime();
  BOOL_TRY(bool_output_write(j->comm, &j->options, &j->content.content, why));
  j->report.seconds_write = slowest(j, begin);
  return finish_report(j, why);
}

int main(int argc, char **argv)
{
  job          j = {.comm = MPI_COMM_WORLD};
  bool_failure why;
  bool_exit    code;
  int          threads;

  signal(SIGXFSZ, SIG_IGN);                                     /* a file that may not grow is a write error like others */
  MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &threads); /* the other thread only prints */
  MPI_Comm_rank(j.comm, &j.rank);
  j.begin = MPI_Wtime();
  code    = bool_options_parse(argc, argv, &j.options, &why);
  if (code == BOOL_DONE && (j.options.help || j.options.version)) {
    if (j.rank == 0 && j.options.help) bool_options_help(stdout);
    if (j.rank == 0 && !j.options.help) printf("remap-boolean %s\n", remap_version());
  } else if (code == BOOL_DONE) {
    if (j.rank == 0 && !j.options.quiet) j.progress = cli_progress_start(stdout, PROGRESS_SECONDS);
    code = run(&j, &why);
    cli_progress_stop(j.progress);
    bool_report_end(&j.report);
    bool_content_drop(&j.content);
    remap_destroy(&j.ctx);
    for (int side = 0; side < 2; side++) bool_operand_close(&j.operand[side]);
  }
  if (code != BOOL_DONE && j.rank == 0) fprintf(stderr, "remap-boolean: %s\n", why.text);
  MPI_Finalize();
  return (int)code;
}
