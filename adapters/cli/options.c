/* options -- the command line: one table of options makes getopt's list and the help, one table per option its words. */
#include "options.h"

#include "command.h"

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* ---- the table ---------------------------------------------------------------------------------------------------- */

/* Options: letter or 0, name, what its argument is called or NULL, where a text or a flag goes or CLI_OTHER, what it does. A
 * second line of help follows after \n. */
#define AT(member) offsetof(cli_options, member)
#define OPTION_LIST(X)                                                                                                       \
  X(FIELDS, 'f', "fields", "LIST", AT(fields), "names or globs, comma separated; default all of SOURCE")                     \
  X(NATURE, 0, "nature", "NAME=NATURE,...", CLI_OTHER,                                                                       \
    "what fields are: conserved, mass-specific, volume-mean or flag;\nglobs; may be repeated; default by their SIDS names")  \
  X(GAMMA, 0, "gamma", "RATIO", CLI_OTHER,                                                                                   \
    "ratio of specific heats, to carry pressure as energy; default what\nFlowEquationSet or ReferenceState of SOURCE says")  \
  X(ALLOW_NAN, 0, "allow-nan", NULL, AT(allow_nan), "let values that are no numbers pass: they spoil the cells they reach")  \
  X(ORDER, 0, "order", "1|2|3", CLI_OTHER, "accuracy of the transfer; default 2")                                            \
  X(LIMITER, 0, "limiter", "none|barth-jespersen|caas|auto", CLI_OTHER,                                                      \
    "bounds on what is transferred; default auto\n(barth-jespersen where a field is not smooth)")                            \
  X(FACES, 0, "faces", "centre|diagonal", CLI_OTHER, "how faces become triangles; default centre")                           \
  X(ON_UNCOVERED, 0, "on-uncovered", "keep|nearest|fill=VALUE|error", CLI_OTHER,                                             \
    "cells that SOURCE does not meet; default keep\n(nearest where there is no old value)")                                  \
  X(ON_PARTIAL, 0, "on-partial", "blend|normalise|conserve|error", CLI_OTHER,                                                \
    "cells that SOURCE covers in part; default blend\n(normalise where there is no old value)")                              \
  X(MIN_COVERAGE, 0, "min-coverage", "SHARE", CLI_OTHER,                                                                     \
    "cells that are covered less than this count as not covered; default 0")                                                 \
  X(COVERAGE, 0, "coverage", NULL, AT(coverage), "write how much of each cell SOURCE covers too, as field Coverage")         \
  X(SOURCE_COVERAGE, 0, "source-coverage", "FILE", AT(source_coverage),                                                      \
    "write SOURCE with how much of each of its cells TARGET covers")                                                         \
  X(SOURCE_MASK, 0, "source-mask", "FIELD[=CODES]", AT(mask[REMAP_SOURCE]),                                                  \
    "take values only where this field of SOURCE says 'computed':\ncellN 1, Iblank above 0, others not 0, or CODES such as " \
    "1+2")                                                                                                                   \
  X(TARGET_MASK, 0, "target-mask", "FIELD[=CODES]", AT(mask[REMAP_TARGET]),                                                  \
    "write values only where this field of TARGET says 'no hole':\nnot 0, or CODES")                                         \
  X(PRIORITY, 0, "priority", "BASE/ZONE,...", AT(priority),                                                                  \
    "zones that overlap, the highest first, globs: what they hide of\nothers does not count; TARGET's cells get values one " \
    "by one")                                                                                                                \
  X(SOURCE_VOLUME, 0, "source-volume", "FIELD", AT(volume[REMAP_SOURCE]),                                                    \
    "conserve what SOURCE's solver integrates, with its own cell volumes")                                                   \
  X(TARGET_VOLUME, 0, "target-volume", "FIELD", AT(volume[REMAP_TARGET]), "likewise what TARGET's solver integrates")        \
  X(LOCATION, 0, "location", "cell|vertex", CLI_OTHER,                                                                       \
    "where fields are, in both files; default cell; vertex takes the\ncells of the median-dual mesh about the vertices")     \
  X(SOLUTION, 0, "solution", "NAME", AT(solution), "the FlowSolution_t of SOURCE to take; default the only one there is")    \
  X(STEP, 0, "step", "N|last", CLI_OTHER, "or the one of a time step, counted from 1")                                       \
  X(OUTPUT_SOLUTION, 0, "output-solution", "NAME", AT(output_solution),                                                      \
    "the FlowSolution_t to write; default the source's name")                                                                \
  X(SOURCE_BASE, 0, "source-base", "NAME", AT(base[REMAP_SOURCE]), "read this base of SOURCE only")                          \
  X(TARGET_BASE, 0, "target-base", "NAME", AT(base[REMAP_TARGET]), "read this base of TARGET only")                          \
  X(SCALE, 0, "scale", "FACTOR", CLI_OTHER, "multiply SOURCE's coordinates first")                                           \
  X(TRANSFORM, 0, "transform", "FILE", AT(transform), "then move them: x' = A x + b, FILE holds the 3 rows of [A | b]")      \
  X(KEEP_VECTORS, 0, "keep-vectors", NULL, AT(keep_vectors),                                                                 \
    "do not turn velocities and other vectors when that is a rotation")                                                      \
  X(CHECK, 0, "check", NULL, AT(check), "transfer known fields and say how well: PASS or FAIL; no OUTPUT")                   \
  X(SUPERMESH, 0, "supermesh", "FILE", AT(supermesh),                                                                        \
    "write the common parts of the cells too, as polyhedra with their\nancestors: CGNS, or VTK if FILE ends in .vtu")        \
  X(REPORT, 0, "report", "FILE", AT(report), "write the report as JSON too")                                                 \
  X(OUTPUT, 'o', "output", "OUTPUT", AT(output), "the file to write: TARGET and the fields, as HDF5")                        \
  X(QUIET, 'q', "quiet", NULL, AT(quiet), "print neither report nor progress")                                               \
  X(VERBOSE, 'v', "verbose", NULL, AT(verbose), "print zones and what the library says too")                                 \
  X(VERSION, 0, "version", NULL, AT(version), "print the version")                                                           \
  X(HELP, 'h', "help", NULL, AT(help), "print this text")

enum option_key { BEFORE_KEYS = CLI_FIRST_KEY, OPTION_LIST(CLI_KEY) BEHIND_KEYS };

static const cli_row rows[] = {OPTION_LIST(CLI_ROW)};

static cli_exit parse_value(void *options, const cli_row *row, const char *argument, cli_failure *why);
static cli_exit add_path(void *options, const char *path, cli_failure *why);

static const cli_command command = {.name     = "remap",
                                    .num_rows = sizeof rows / sizeof *rows,
                                    .row      = rows,
                                    .take     = parse_value,
                                    .word     = add_path};

/* A word of the command line and its value; lists end with a NULL word. */
typedef struct word {
  const char *text;
  int         value;
} word;

static const word order_words[]     = {{"1", 1}, {"2", 2}, {"3", 3}, {NULL, 0}};
static const word limiter_words[]   = {{"none", REMAP_LIMITER_NONE},
                                       {"barth-jespersen", REMAP_LIMITER_BARTH_JESPERSEN},
                                       {"caas", REMAP_LIMITER_CAAS},
                                       {"auto", REMAP_LIMITER_AUTO},
                                       {NULL, 0}};
static const word nature_words[]    = {{"conserved", REMAP_CONSERVED},
                                       {"mass-specific", REMAP_MASS_SPECIFIC},
                                       {"volume-mean", REMAP_VOLUME_MEAN},
                                       {"flag", REMAP_FLAG},
                                       {NULL, 0}};
static const word location_words[]  = {{"cell", RCGNS_CELLS}, {"vertex", RCGNS_VERTICES}, {NULL, 0}};
static const word faces_words[]     = {{"centre", REMAP_FACES_CENTRE}, {"diagonal", REMAP_FACES_DIAGONAL}, {NULL, 0}};
static const word uncovered_words[] = {{"keep", REMAP_UNCOVERED_KEEP},
                                       {"nearest", REMAP_UNCOVERED_NEAREST},
                                       {"error", REMAP_UNCOVERED_ERROR},
                                       {NULL, 0}};
static const word partial_words[]   = {{"blend", REMAP_PARTIAL_BLEND},
                                       {"normalise", REMAP_PARTIAL_NORMALISE},
                                       {"conserve", REMAP_PARTIAL_CONSERVE},
                                       {"error", REMAP_PARTIAL_ERROR},
                                       {NULL, 0}};

static const char *word_of(const word *words, int value)
{
  for (const word *w = words; w->text; w++)
    if (w->value == value) return w->text;
  return "unknown";
}

const char *cli_limiter_word(remap_limiter limiter) { return word_of(limiter_words, (int)limiter); }

const char *cli_nature_word(remap_nature nature) { return word_of(nature_words, (int)nature); }

bool cli_nature_of(const char *text, remap_nature *nature)
{
  for (const word *w = nature_words; w->text; w++)
    if (!strcmp(w->text, text)) {
      *nature = (remap_nature)w->value;
      return true;
    }
  return false;
}

/* ---- help --------------------------------------------------------------------------------------------------------- */

void cli_options_help(FILE *out)
{
  fputs("remap [options] SOURCE TARGET -o OUTPUT            (also under mpirun -n P)\n"
        "remap [options] --check SOURCE TARGET\n\n"
        "Transfer the cell-centred fields of the CGNS file SOURCE to the mesh of the CGNS file TARGET, conservatively.\n\n",
        out);
  cli_command_help(&command, 36, out);
  fputs("\nExit status:\n", out);
#define X(name, number, text) fprintf(out, "  %d  %s\n", number, text);
  CLI_EXIT_LIST(X)
#undef X
}

/* ---- parsing ------------------------------------------------------------------------------------------------------ */

static cli_exit pick(const word *words, const cli_row *row, const char *argument, int *value, cli_failure *why)
{
  for (const word *w = words; w->text; w++)
    if (!strcmp(w->text, argument)) {
      *value = w->value;
      return CLI_DONE;
    }
  return cli_fail(why, CLI_USAGE, "--%s: '%.200s' is not offered: give %s", row->name, argument, row->argument);
}

static cli_exit parse_uncovered(const cli_row *row, const char *argument, remap_transfer *transfer, cli_failure *why)
{
  int value = 0;

  if (!strncmp(argument, "fill=", 5)) {
    if (!cli_number(argument + 5, &transfer->fill_value) || isinf(transfer->fill_value))
      return cli_fail(why, CLI_USAGE, "--on-uncovered: '%.200s' is no number: give fill=VALUE", argument + 5);
    transfer->on_uncovered = REMAP_UNCOVERED_FILL;
    return CLI_DONE;
  }
  CLI_TRY(pick(uncovered_words, row, argument, &value, why));
  transfer->on_uncovered = (remap_on_uncovered)value;
  return CLI_DONE;
}

static cli_exit parse_step(const char *argument, int64_t *step, cli_failure *why)
{
  char *end;

  if (!strcmp(argument, "last")) {
    *step = -1;
    return CLI_DONE;
  }
  errno = 0;
  *step = strtoll(argument, &end, 10);
  if (end == argument || *end || errno || *step < 1)
    return cli_fail(why, CLI_USAGE, "--step: '%.200s' is no step: give a number from 1 or last", argument);
  return CLI_DONE;
}

/* The options that are neither a mere text nor a flag. */
static cli_exit parse_value(void *options, const cli_row *row, const char *argument, cli_failure *why)
{
  cli_options *out   = options;
  int          value = 0;

  switch (row->key) {
    case KEY_NATURE:
      if (out->num_natures == CLI_MAX_NATURES)
        return cli_fail(why, CLI_USAGE, "--nature: it is given more than %d times: give lists", CLI_MAX_NATURES);
      out->nature[out->num_natures++] = argument;
      break;
    case KEY_ORDER:
      CLI_TRY(pick(order_words, row, argument, &value, why));
      out->transfer.order = value;
      break;
    case KEY_LIMITER:
      CLI_TRY(pick(limiter_words, row, argument, &value, why));
      out->transfer.limiter = (remap_limiter)value;
      break;
    case KEY_LOCATION:
      CLI_TRY(pick(location_words, row, argument, &value, why));
      out->location = (rcgns_location)value;
      break;
    case KEY_FACES:
      CLI_TRY(pick(faces_words, row, argument, &value, why));
      out->faces = (remap_faces)value;
      break;
    case KEY_ON_UNCOVERED: return parse_uncovered(row, argument, &out->transfer, why);
    case KEY_ON_PARTIAL:
      CLI_TRY(pick(partial_words, row, argument, &value, why));
      out->transfer.on_partial = (remap_on_partial)value;
      break;
    case KEY_STEP: return parse_step(argument, &out->step, why);
    case KEY_SCALE:
      if (!cli_number(argument, &out->scale) || !(out->scale > 0) || isinf(out->scale))
        return cli_fail(why, CLI_USAGE, "--scale: '%.200s' is no factor: give a positive number", argument);
      break;
    case KEY_GAMMA:
      if (!cli_number(argument, &out->gamma) || !(out->gamma > 1) || isinf(out->gamma))
        return cli_fail(why, CLI_USAGE, "--gamma: '%.200s' is no ratio of specific heats: give a number above 1", argument);
      break;
    case KEY_MIN_COVERAGE:
      if (!cli_number(argument, &out->min_coverage) || !(out->min_coverage >= 0 && out->min_coverage <= 1))
        return cli_fail(why, CLI_USAGE, "--min-coverage: '%.200s' is no share: give a number from 0 to 1", argument);
      break;
    default: break;
  }
  return CLI_DONE;
}

static cli_exit add_path(void *options, const char *path, cli_failure *why)
{
  cli_options *out = options;

  if (!*path) return cli_fail(why, CLI_USAGE, "the name of a file is empty: give SOURCE TARGET -o OUTPUT");
  if (out->num_paths == 2)
    return cli_fail(why, CLI_USAGE, "'%.200s' is one file too many: give SOURCE TARGET -o OUTPUT, see remap --help", path);
  out->path[out->num_paths++] = path;
  return CLI_DONE;
}

/* What fits together, once everything is read. */
static cli_exit check_whole(const cli_options *out, cli_failure *why)
{
  if (out->num_paths < 2)
    return cli_fail(why, CLI_USAGE, "two files are needed: give SOURCE TARGET -o OUTPUT, see remap --help");
  if (out->check && (out->output || out->source_coverage || out->supermesh))
    return cli_fail(why, CLI_USAGE, "--check writes no fields: leave -o and --source-coverage out");
  if (!out->check && !out->output) return cli_fail(why, CLI_USAGE, "no file to write: give -o OUTPUT, see remap --help");
  if (out->solution && out->step)
    return cli_fail(why, CLI_USAGE, "--solution and --step both choose a solution: give one of them");
  return CLI_DONE;
}

cli_exit cli_options_parse(int argc, char **argv, cli_options *out, cli_failure *why)
{
  *out = (cli_options){.scale = 1};
  remap_transfer_default(&out->transfer);
  CLI_TRY(cli_command_parse(&command, argc, argv, out, why));
  return out->help || out->version ? CLI_DONE : check_whole(out, why);
}
