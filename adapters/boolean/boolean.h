/* boolean.h -- what the files of the remap-boolean command share: how it can end, what was asked for, the operands, the result.
 *
 *   main.c      the job: open, make the supermesh, write, report
 *   options.c   the command line
 *   operand.c   a CGNS mesh or a closed surface as an operand, with the names of its boundaries and its fields
 *   output.c    the result as CGNS or VTK
 *   outer.c     its outer surface as STL or OBJ
 *   report.c    text for people, JSON for programs
 *
 * Standard output gets the report and the progress, standard error one line per failure and nothing else. */
#ifndef REMAP_BOOLEAN_H
#define REMAP_BOOLEAN_H

#include <cgns.h>
#include <command.h>
#include <mpi.h>
#include <remap/remap.h>
#include <slices.h>
#include <surface.h>

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

/** Every exit status: which, text for --help. The greater one wins when ranks differ. */
#define BOOL_EXIT_LIST(X)                                                                 \
  X(CLI_DONE, "done")                                                                     \
  X(CLI_USAGE, "usage")                                                                   \
  X(CLI_COVERAGE, "the result has no cells; OUT is not written")                          \
  X(CLI_IO, "input or output")                                                            \
  X(CLI_GEOMETRY, "a mesh is broken; a surface is open, not manifold, or crosses itself") \
  X(CLI_INTERNAL, "memory, MPI or an internal check")

/** Every operation: word, REMAP_IN_ bits, text for --help. A is the source, B the target. */
#define BOOL_OPERATION_LIST(X)                                                            \
  X("intersection", REMAP_IN_BOTH, "what lies in A and in B")                             \
  X("union", REMAP_IN_BOTH | REMAP_IN_SOURCE | REMAP_IN_TARGET, "what lies in A or in B") \
  X("difference", REMAP_IN_SOURCE, "A without B")                                         \
  X("rdifference", REMAP_IN_TARGET, "B without A")                                        \
  X("imprint", REMAP_IN_BOTH | REMAP_IN_SOURCE, "all of A, cut where B's faces go through it")

/* ---- options ------------------------------------------------------------------------------------------------------- */

/** What was asked for. Texts point into argv; NULL where an option was not given. */
typedef struct bool_options {
  const char *operation; /**< its word */
  int         keep;      /**< its REMAP_IN_ bits */
  const char *path[2];   /**< A, B */
  int         num_words; /**< operation and paths so far */
  const char *output, *report;
  const char *fields;   /**< names and globs, comma separated */
  const char *solution; /**< of both operands */
  const char *base[2];
  double      scale; /**< of B's coordinates */
  remap_faces faces;
  bool        aggregate, split, quiet, verbose, help, version;
} bool_options;

/** Read the command line. With --help or --version nothing else is demanded. The same on all ranks; not collective.
 *  Errors: USAGE. */
cli_exit bool_options_parse(int argc, char **argv, bool_options *out, cli_failure *why);

/** What --help prints. Not collective. */
void bool_options_help(FILE *out);

/* ---- operands ------------------------------------------------------------------------------------------------------ */

/** One operand, opened. Owned: bool_operand_close. All zero is none. */
typedef struct bool_operand {
  const char        *path;
  bool               is_surface;
  rcgns_file        *file;      /**< NULL for a surface */
  rcgns_solution     solution;  /**< its name is NULL if there is none */
  rsurf_surface      surface;   /**< on rank 0 */
  rsurf_repairs      repairs;   /**< the same on every rank */
  remap_mesh         mesh;      /**< this rank's part */
  int64_t            num_cells; /**< of all ranks */
  rcgns_boundaries   boundaries; /**< types NULL for a surface */
  char             **own_name;   /**< behind their names, of a surface */
} bool_operand;

/** Open operand number side (0: A, 1: B): by its ending a surface, else CGNS. Collective. Errors: USAGE, IO, GEOMETRY,
 *  INTERNAL. */
cli_exit bool_operand_open(MPI_Comm comm, const bool_options *options, int side, bool_operand *out, cli_failure *why);

/** Give everything back. Collective, and harmless on none. */
void bool_operand_close(bool_operand *operand);

/** Fields and boundaries of the result, taken over from both operands. Owned: bool_content_drop. */
typedef struct bool_content {
  rslice_content content;
  rslice_field  *field;  /**< content.field */
  double        *values; /**< behind them */
  cli_boundaries boundaries;
  cli_ancestors  faces;
} bool_content;

/** Take over what the cells and faces of the operands have. A field that both have is A's in the cells of A, else B's; a cell
 *  without a value gets NaN. A face that lies in faces of both belongs to A's boundary. Collective. Errors: USAGE (a field that
 *  neither has), IO, INTERNAL. */
cli_exit bool_content_make(MPI_Comm comm, const bool_options *options, remap_context *ctx, const bool_operand operand[2],
                           const remap_supermesh_view *view, bool_content *out, cli_failure *why);

/** Give it back. Not collective. */
void bool_content_drop(bool_content *content);

/* ---- output -------------------------------------------------------------------------------------------------------- */

/** Refuse an output that cannot be right: an input, something that is no regular file, a place that cannot be written. Nothing
 *  is changed. Collective. Errors: USAGE, IO. */
cli_exit bool_output_check(MPI_Comm comm, const bool_options *options, cli_failure *why);

/** Write the result by the ending of the output's name; it appears when it is complete. Collective. Errors: USAGE, IO,
 *  INTERNAL. */
cli_exit bool_output_write(MPI_Comm comm, const bool_options *options, const rslice_content *content, cli_failure *why);

/** Write the outer surface of the result as text, STL (faces cut into triangles) or OBJ. Collective. Errors: IO, INTERNAL. */
cli_exit bool_outer_write(MPI_Comm comm, const char *path, const rslice_content *content, cli_failure *why);

/* ---- report -------------------------------------------------------------------------------------------------------- */

/** Everything there is to tell. */
typedef struct bool_report {
  int                  ranks;
  const bool_options  *options;
  const bool_operand  *operand;  /**< [2] */
  const bool_content  *content;  /**< NULL before it is made */
  remap_supermesh_view view;     /**< counts of all ranks and seconds of the slowest; arrays are not read */
  int64_t              cells[3]; /**< in both, in A only, in B only */
  double               volume[3];
  double               seconds_read, seconds_supermesh, seconds_write, seconds_total; /**< wall clock, slowest rank */
  char                 part[4096]; /**< on rank 0: the name that the report has until it is complete; empty: there is none */
  int64_t              peak_rss;   /**< bytes of the rank that needs most */
} bool_report;

/** Count cells and volumes over all ranks. Collective. */
void bool_report_count(MPI_Comm comm, const remap_supermesh_view *view, bool_report *report);
/** Text for people. One rank calls. */
void bool_report_print(FILE *out, const bool_report *report);
/** Make sure that the report can be written, before the work begins. One rank calls, and bool_report_end in the end. Errors:
 *  IO. */
cli_exit bool_report_begin(bool_report *report, cli_failure *why);
/** JSON for programs; the file appears when it is complete. The same rank calls. Errors: IO, INTERNAL. */
cli_exit bool_report_write(bool_report *report, cli_failure *why);
/** Leave nothing behind that is not complete. */
void bool_report_end(bool_report *report);

#endif
