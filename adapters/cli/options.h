/* options.h -- the command line of remap as plain data. */
#ifndef REMAP_CLI_OPTIONS_H
#define REMAP_CLI_OPTIONS_H

#include "cli.h"

#include <cgns.h>
#include <remap/remap.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

enum { CLI_MAX_NATURES = 64 };

/** What was asked for. Texts point into argv; NULL where an option was not given. */
typedef struct cli_options {
  const char    *path[2]; /**< [remap_side] */
  int            num_paths;
  const char    *output;
  const char    *report;
  const char    *fields; /**< names and globs, comma separated */
  int            num_natures;
  const char    *nature[CLI_MAX_NATURES]; /**< [num_natures] lists of NAME=NATURE, comma separated */
  const char    *priority;                /**< zones, BASE/ZONE or globs, comma separated, the highest first */
  const char    *mask[2];                 /**< [remap_side] FIELD or FIELD=CODES */
  const char    *volume[2];               /**< [remap_side] FIELD that holds the solver's cell volumes */
  const char    *base[2];                 /**< [remap_side] */
  const char    *solution, *output_solution;
  const char    *transform;       /**< path of a 3x4 matrix */
  const char    *source_coverage; /**< the file to write with psi */
  const char    *supermesh;       /**< the file to write with the cells' common parts */
  bool           check;           /**< try the two meshes, write nothing */
  bool           coverage;        /**< write phi into OUTPUT */
  int64_t        step;            /**< 1 ..; -1 the last; 0 not given */
  double         gamma;           /**< 0: not given */
  bool           keep_vectors;    /**< vectors do not turn with SOURCE */
  bool           allow_nan;
  double         scale;
  double         min_coverage; /**< of a target cell, 0 .. 1; default 0 */
  rcgns_location location;     /**< of the fields of both files */
  remap_faces    faces;
  remap_transfer transfer;
  bool           quiet, verbose, help, version;
} cli_options;

/** Read the command line. With --help or --version nothing else is demanded. The same on all ranks; not collective.
 *  Errors: USAGE. */
cli_exit cli_options_parse(int argc, char **argv, cli_options *out, cli_failure *why);

/** What --help prints. Not collective. */
void cli_options_help(FILE *out);

/** The word of the command line for a limiter. Static text. Not collective. */
const char *cli_limiter_word(remap_limiter limiter);

/** The word of the command line for a nature. Static text. Not collective. */
const char *cli_nature_word(remap_nature nature);

/** The nature that a word of the command line names; false if it names none. Not collective. */
bool cli_nature_of(const char *word, remap_nature *nature);

#endif
