/* cli.h -- what the files of the remap command share: how it can end, and the one line that says why.
 *
 *   main.c      the job: open, read, build, transfer, verify, write, report
 *   fields.c    which fields take part, and their values
 *   system.c    which fields move together, and how vectors turn
 *   masks.c     which cells give and which want values
 *   volumes.c   cell volumes of the solvers
 *   priority.c  zones of SOURCE that overlap
 *   pieces.c    what belongs to cells, of pieces of them
 *   coverage.c  how much of the cells is covered
 *   verify.c    is the result good enough to be written
 *   check.c     --check
 *   supermesh.c --supermesh
 *   job.c       what these share
 *   options.c   the command line
 *   command.c   what this and other commands share
 *   report.c    text for people, JSON for programs
 *   progress.c  a line now and then while a long job runs
 *
 * Standard output gets the report and the progress, standard error one line per failure and nothing else. */
#ifndef REMAP_CLI_H
#define REMAP_CLI_H

/** Every exit status: name, number, text for --help. The greater one wins when ranks differ. */
#define CLI_EXIT_LIST(X)                                                                                        \
  X(DONE, 0, "done")                                                                                            \
  X(USAGE, 2, "usage")                                                                                          \
  X(COVERAGE, 3, "cells are not covered as --on-uncovered or --on-partial demand")                              \
  X(VERIFY, 4, "verification or --check failed: closure above 1e-10, conservation above 1e-12, ...; no OUTPUT") \
  X(IO, 5, "input or output")                                                                                   \
  X(GEOMETRY, 6, "a mesh is broken, or its zones overlap")                                                      \
  X(INTERNAL, 7, "memory, MPI or an internal check")

typedef enum cli_exit {
#define X(name, number, text) CLI_##name = number,
  CLI_EXIT_LIST(X)
#undef X
} cli_exit;

/** Why a step failed: one line without a newline, the same on every rank. */
typedef struct cli_failure {
  char text[1400];
} cli_failure;

/** Fill in *why in the manner of printf and hand code back: return cli_fail(...). Not collective. */
cli_exit cli_fail(cli_failure *why, cli_exit code, const char *format, ...) __attribute__((format(printf, 3, 4)));

/** Hand a failure up; only where nothing is owned. */
#define CLI_TRY(call)                          \
  do {                                         \
    const cli_exit cli_try_ = (call);          \
    if (cli_try_ != CLI_DONE) return cli_try_; \
  } while (0)

#endif
