/* report.h -- what the job found: text on standard output for people, a JSON file for programs. One rank calls these. */
#ifndef REMAP_CLI_REPORT_H
#define REMAP_CLI_REPORT_H

#include "cli.h"

#include <cgns.h>
#include <remap/remap.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

/** Greatest errors that pass verification. */
#define CLI_MAX_CLOSURE      1e-10
#define CLI_MAX_CONSERVATION 1e-12

#define CLI_MAX_CONSTANT 1e-12
#define CLI_MAX_LINEAR   1e-10
#define CLI_MAX_BEYOND   1e-12

/** One figure of --check. */
typedef struct cli_check_row {
  const char *name;
  double      figure, bar;
  bool        is_least; /**< the bar is the least that passes, else the most */
} cli_check_row;

/** Is the figure good enough? A NaN is not. Not collective. */
bool cli_check_passes(const cli_check_row *row);

/** What a field is weighted with. */
typedef enum cli_weight {
  CLI_BY_VOLUME = 0,
  CLI_BY_MASS   = 1, /**< it moves in a system with Density */
  CLI_BY_GAS    = 2  /**< likewise, as the energy that the gas model makes of it */
} cli_weight;

/** One transferred field. */
typedef struct cli_field_row {
  const char        *name;
  remap_nature       nature;
  bool               is_told; /**< by --nature */
  cli_weight         weight;
  remap_limiter      limiter; /**< in effect */
  remap_field_report what;
} cli_field_row;

enum { CLI_WORST = 5 };

/** How much of one mesh the other covers, masks counted in. */
typedef struct cli_cover_row {
  int64_t            cells[4];       /**< [remap_cover] */
  double             volume[4];      /**< [remap_cover] of those cells */
  int64_t            num_too_little; /**< cells covered in part that count as uncovered, by --min-coverage */
  int                num_partial, num_uncovered;
  remap_partial_cell partial[CLI_WORST];   /**< [num_partial] those that are covered least */
  remap_partial_cell uncovered[CLI_WORST]; /**< [num_uncovered] the largest ones */
} cli_cover_row;

/** The supermesh that was written. */
typedef struct cli_supermesh_row {
  const char *path; /**< NULL: none */
  int64_t     cells;
  double      volume;
} cli_supermesh_row;

/** Everything there is to tell; texts are borrowed. */
typedef struct cli_report {
  const rcgns_info    *info[2]; /**< [remap_side] */
  remap_stats          stats;
  const char          *solution[2]; /**< [remap_side] names of the FlowSolution_t read and written */
  cli_supermesh_row    supermesh;
  const char          *output, *source_coverage; /**< files that were written, NULL if not */
  const char          *volume[2];                /**< [remap_side] field of the solver's volumes, NULL: none */
  const char          *mask[2];                  /**< [remap_side] as asked for, NULL: none */
  cli_cover_row        cover[2];                 /**< [remap_side] */
  int                  num_checks;
  cli_check_row        check[5]; /**< [num_checks] of --check */
  int                  num_fields;
  const cli_field_row *field; /**< [num_fields] */
  int                  num_notes;
  char *const         *note;                                                         /**< [num_notes] remarks */
  double               seconds_read, seconds_transfer, seconds_write, seconds_total; /**< wall clock, slowest rank */
  int64_t              peak_rss;                                                     /**< bytes of the rank that needs most */
} cli_report;

/** Who reads what: the version, the meshes and, if verbose, their zones. */
void cli_report_meshes(FILE *out, const cli_report *report, int verbose);
/** The overlap: pairs, volumes, coverage, closure. */
void cli_report_overlap(FILE *out, const cli_report *report);
/** Which cells are covered in part or not at all, if there are such, and what the masks say. */
void cli_report_cover(FILE *out, const cli_report *report);
/** A line per field: what was conserved. */
void cli_report_fields(FILE *out, const cli_report *report);
/** A line per figure of --check: PASS or FAIL. */
void cli_report_check(FILE *out, const cli_report *report);
/** Remarks, time per phase, memory, the file written; output is not mentioned if it is NULL. */
void cli_report_end(FILE *out, const cli_report *report);

/** A report file under way: it appears under its name when it is complete. */
typedef struct cli_report_file {
  FILE       *stream;
  char       *part; /**< the name it has until then; NULL where it is written in place: a terminal, a pipe, a link */
  const char *path;
} cli_report_file;

/** Make sure that the report can be written, before the work begins. inputs are [num_inputs] paths that must not be it.
 *  The caller ends *out with cli_report_commit or cli_report_discard. Errors: USAGE, IO, INTERNAL. */
cli_exit cli_report_open(const char *path, int num_others, const char *const *others, cli_report_file *out, cli_failure *why);
/** Do two paths name one file, which need not exist yet? */
bool cli_is_same_file(const char *a, const char *b);
/** Write the report and give the file its name. Errors: IO, INTERNAL; then nothing is left behind. */
cli_exit cli_report_commit(cli_report_file *file, const cli_report *report, cli_failure *why);
/** Leave nothing behind; harmless on a file that is not open. */
void cli_report_discard(cli_report_file *file);

#endif
