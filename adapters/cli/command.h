/* command.h -- what the commands remap and remap-boolean share: a table of options that makes the parser and the help,
 * agreement of ranks, failures of the CGNS adapter in their words, boundaries of a supermesh. */
#ifndef REMAP_CLI_COMMAND_H
#define REMAP_CLI_COMMAND_H

#include "cli.h"

#include <cgns.h>
#include <mpi.h>
#include <remap/remap.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/** One option. */
typedef struct cli_row {
  int         key;             /**< distinct, above every letter */
  char        letter;          /**< 0: it has none */
  const char *name, *argument; /**< what its argument is called, NULL if it takes none */
  size_t      at;   /**< offset in the options of a const char * if there is an argument, else a bool; CLI_OTHER: see take */
  const char *text; /**< what it does; a second line of help follows after \n */
} cli_row;

#define CLI_OTHER SIZE_MAX

/** From a list X(KEY, letter, name, argument, at, text) of all options: their keys, in an enum that begins above every letter,
 *  so that getopt's own answers cannot be mistaken, and their rows. */
enum { CLI_FIRST_KEY = 256 };
#define CLI_KEY(key, letter, name, argument, at, text) KEY_##key,
#define CLI_ROW(key, letter, name, argument, at, text) {KEY_##key, letter, name, argument, at, text},

/** A command line: its options, and who hears of the rest. */
typedef struct cli_command {
  const char    *name; /**< of the command, for messages */
  int            num_rows;
  const cli_row *row; /**< [num_rows] */
  cli_exit (*take)(void *options, const cli_row *row, const char *argument,
                   cli_failure *why);                                  /**< an option that is CLI_OTHER */
  cli_exit (*word)(void *options, const char *text, cli_failure *why); /**< a word that is no option */
} cli_command;

/** Read a command line into *options, as the rows say. The same on all ranks; not collective. Errors: USAGE, and what take and
 *  word refuse. */
cli_exit cli_command_parse(const cli_command *command, int argc, char **argv, void *options, cli_failure *why);

/** A line or two for each option, texts from column `width` on. Not collective. */
void cli_command_help(const cli_command *command, int width, FILE *out);

/** The whole of a text as a number; false if it is none. Not collective. */
int cli_number(const char *text, double *value);

/** Begin a command: MPI with one thread beside, which only prints; a file that may not grow is a write error like others. */
void cli_begin(int *argc, char ***argv);

/** End it: why a failure happened, in one line on standard error of rank 0. What main returns. Collective. */
int cli_end(const char *name, cli_exit status, const cli_failure *why);

/** The greatest of the ranks' statuses and the text of the lowest rank that has it. Collective. */
cli_exit cli_agree_on(MPI_Comm comm, cli_exit mine, cli_failure *why);

/** INTERNAL, with the words for it. Not collective. */
cli_exit cli_no_memory(cli_failure *why);

/** A status of the CGNS adapter as an exit status; its message becomes ours. Not collective. */
cli_exit cli_from_cgns(rcgns_status status, const rcgns_message *message, cli_failure *why);

/** The boundaries of a supermesh. Owned: cli_boundaries_drop. */
typedef struct cli_boundaries {
  int          num;
  const char **name, **type; /**< [num] texts are borrowed; the same on every rank */
  int64_t      num_faces;
  int32_t     *face; /**< [num_faces] of this rank; -1: none */
} cli_boundaries;

/** Begin without any, with room for the boundaries of both operands, `most` in all. Collective. Errors: INTERNAL. */
cli_exit cli_boundaries_begin(MPI_Comm comm, int64_t num_faces, int most, cli_boundaries *out, cli_failure *why);

/** Take those of one operand, which has num_faces on this rank, over to the faces of the supermesh of ctx that lie in its
 *  faces; those that have one keep it. Those of one name and type are one. Collective. Errors: INTERNAL. */
cli_exit cli_boundaries_take(MPI_Comm comm, remap_context *ctx, remap_side side, int64_t num_faces,
                             const rcgns_boundaries *from, cli_boundaries *to, cli_failure *why);

/** Give them back; harmless on none. Not collective. */
void cli_boundaries_drop(cli_boundaries *boundaries);

/** In which faces of the operands those of a supermesh lie. Owned: cli_ancestors_drop; all NULL is none. */
typedef struct cli_ancestors {
  int64_t *cell[2], *number[2]; /**< [side][faces of the supermesh on this rank] as in rslice_content */
} cli_ancestors;

/** Those of one operand, whose faces the file calls number [faces of mesh]; NULL: as they are numbered in mesh, from 1.
 *  num_faces: of the supermesh of ctx on this rank. Collective. Errors: INTERNAL. */
cli_exit cli_ancestors_take(MPI_Comm comm, remap_context *ctx, remap_side side, const remap_mesh *mesh, const int64_t *number,
                            int64_t num_faces, cli_ancestors *to, cli_failure *why);

/** Give them back; harmless on none. Not collective. */
void cli_ancestors_drop(cli_ancestors *ancestors);

/** "" or "s", for a count of things. Not collective. */
const char *cli_plural(int64_t count);

/** Seconds since then, of the slowest rank. Collective. */
double cli_slowest(MPI_Comm comm, double since);

/** Bytes of the rank that has needed most. Collective. */
int64_t cli_peak_rss(MPI_Comm comm);

#endif
