/* options -- the command line of remap-boolean: one table makes the parser and the help. */
#include "boolean.h"

#include <math.h>
#include <string.h>

/* Options: letter or 0, name, what its argument is called or NULL, where a text or a flag goes, what it does. */
#define AT(member) offsetof(bool_options, member)
#define OPTION_LIST(X)                                                                                                         \
  X(OUTPUT, 'o', "output", "OUT", AT(output), "the file to write: .cgns or .vtu (cells), .stl or .obj (their outer surface)")  \
  X(FIELDS, 'f', "fields", "LIST", AT(fields), "names or globs, comma separated; default every cell-centred field of A and B") \
  X(SOLUTION, 0, "solution", "NAME", AT(solution), "the FlowSolution_t to take; default the only one there is")                \
  X(FACES, 0, "faces", "centre|diagonal", CLI_OTHER, "how faces become triangles; default centre")                             \
  X(AGGREGATE, 0, "aggregate", NULL, AT(aggregate), "pieces of a warped face become one polygon too")                          \
  X(SPLIT, 0, "split", NULL, AT(split), "cut concave polygons into convex ones")                                               \
  X(A_BASE, 0, "a-base", "NAME", AT(base[0]), "read this base of A only")                                                      \
  X(B_BASE, 0, "b-base", "NAME", AT(base[1]), "read this base of B only")                                                      \
  X(SCALE, 0, "scale", "FACTOR", CLI_OTHER, "multiply B's coordinates first")                                                  \
  X(REPORT, 0, "report", "FILE", AT(report), "write the report as JSON too")                                                   \
  X(QUIET, 'q', "quiet", NULL, AT(quiet), "print neither report nor progress")                                                 \
  X(VERBOSE, 'v', "verbose", NULL, AT(verbose), "print the boundaries and what the library says too")                          \
  X(VERSION, 0, "version", NULL, AT(version), "print the version")                                                             \
  X(HELP, 'h', "help", NULL, AT(help), "print this text")

enum option_key { BEFORE_KEYS = CLI_FIRST_KEY, OPTION_LIST(CLI_KEY) BEHIND_KEYS };

static const cli_row rows[] = {OPTION_LIST(CLI_ROW)};

static cli_exit parse_value(void *options, const cli_row *row, const char *argument, cli_failure *why);
static cli_exit add_word(void *options, const char *text, cli_failure *why);

static const cli_command command = {.name     = "remap-boolean",
                                    .num_rows = sizeof rows / sizeof *rows,
                                    .row      = rows,
                                    .take     = parse_value,
                                    .word     = add_word};

void bool_options_help(FILE *out)
{
  fputs("remap-boolean [options] OPERATION A B -o OUT            (also under mpirun -n P)\n\n"
        "Intersect, join or subtract two bodies exactly: meshes of CGNS files (cells), or closed surfaces of STL or OBJ\n"
        "files. The cells of the result carry their ancestors in A and B, its faces the names of their boundaries.\n\n",
        out);
#define X(word, keep, text) fprintf(out, "  %-13s %s\n", word, text);
  BOOL_OPERATION_LIST(X)
#undef X
  fputc('\n', out);
  cli_command_help(&command, 32, out);
  fputs("\nExit status:\n", out);
#define X(code, text) fprintf(out, "  %d  %s\n", (int)code, text);
  BOOL_EXIT_LIST(X)
#undef X
}

/* ---- parsing ------------------------------------------------------------------------------------------------------- */

/* The options that are neither a mere text nor a flag. */
static cli_exit parse_value(void *options, const cli_row *row, const char *argument, cli_failure *why)
{
  bool_options *out = options;

  if (row->key == KEY_SCALE) {
    if (cli_number(argument, &out->scale) && out->scale > 0 && !isinf(out->scale)) return CLI_DONE;
    return cli_fail(why, CLI_USAGE, "--scale: '%.200s' is no factor: give a positive number", argument);
  }
  if (strcmp(argument, "centre") && strcmp(argument, "diagonal"))
    return cli_fail(why, CLI_USAGE, "--faces: '%.200s' is not offered: give centre|diagonal", argument);
  out->faces = *argument == 'c' ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL;
  return CLI_DONE;
}

/* The operation, then A, then B. */
static cli_exit add_word(void *options, const char *text, cli_failure *why)
{
  bool_options *out = options;

  if (!*text) return cli_fail(why, CLI_USAGE, "a word is empty: give OPERATION A B -o OUT, see remap-boolean --help");
  if (out->num_words == 3) return cli_fail(why, CLI_USAGE, "'%.200s' is one file too many: give OPERATION A B -o OUT", text);
  if (out->num_words++) {
    out->path[out->num_words - 2] = text;
    return CLI_DONE;
  }
#define X(word, bits, what) \
  if (!strcmp(text, word)) out->operation = word, out->keep = bits;
  BOOL_OPERATION_LIST(X)
#undef X
  if (out->operation) return CLI_DONE;
  return cli_fail(why, CLI_USAGE, "'%.200s' is no operation: give intersection, union, difference, rdifference or imprint",
                  text);
}

/* What fits together, once everything is read. */
static cli_exit check_whole(const bool_options *out, cli_failure *why)
{
  if (out->num_words < 3)
    return cli_fail(why, CLI_USAGE, "an operation and two files are needed: give OPERATION A B -o OUT, see --help");
  if (!out->output) return cli_fail(why, CLI_USAGE, "no file to write: give -o OUT, see remap-boolean --help");
  if (out->report && !strcmp(out->report, out->output))
    return cli_fail(why, CLI_USAGE, "%s: it is OUT: give --report another file", out->report);
  return CLI_DONE;
}

cli_exit bool_options_parse(int argc, char **argv, bool_options *out, cli_failure *why)
{
  *out = (bool_options){.scale = 1, .faces = REMAP_FACES_CENTRE};
  CLI_TRY(cli_command_parse(&command, argc, argv, out, why));
  return out->help || out->version ? CLI_DONE : check_whole(out, why);
}
