/* options -- the command line of remap-boolean: one table makes getopt's list, the help and the parser's cases. */
#include "boolean.h"

#include <getopt.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

bool_exit bool_fail(bool_failure *why, bool_exit code, const char *format, ...)
{
  va_list args;

  va_start(args, format);
  vsnprintf(why->text, sizeof why->text, format, args);
  va_end(args);
  return code;
}

/* Options: letter or 0, name, what its argument is called or NULL, what it does. */
#define OPTION_LIST(X)                                                                                             \
  X(OUTPUT, 'o', "output", "OUT", "the file to write: .cgns or .vtu (cells), .stl or .obj (their outer surface)")  \
  X(FIELDS, 'f', "fields", "LIST", "names or globs, comma separated; default every cell-centred field of A and B") \
  X(SOLUTION, 0, "solution", "NAME", "the FlowSolution_t to take; default the only one there is")                  \
  X(FACES, 0, "faces", "centre|diagonal", "how faces become triangles; default centre")                            \
  X(AGGREGATE, 0, "aggregate", NULL, "pieces of a warped face become one polygon too")                             \
  X(SPLIT, 0, "split", NULL, "cut concave polygons into convex ones")                                              \
  X(A_BASE, 0, "a-base", "NAME", "read this base of A only")                                                       \
  X(B_BASE, 0, "b-base", "NAME", "read this base of B only")                                                       \
  X(SCALE, 0, "scale", "FACTOR", "multiply B's coordinates first")                                                 \
  X(REPORT, 0, "report", "FILE", "write the report as JSON too")                                                   \
  X(QUIET, 'q', "quiet", NULL, "print neither report nor progress")                                                \
  X(VERBOSE, 'v', "verbose", NULL, "print the boundaries and what the library says too")                           \
  X(VERSION, 0, "version", NULL, "print the version")                                                              \
  X(HELP, 'h', "help", NULL, "print this text")

enum option_key {
  FIRST_KEY = 256, /* above every letter, so that getopt's own answers cannot be mistaken */
#define X(key, letter, name, argument, text) KEY_##key,
  OPTION_LIST(X)
#undef X
      END_KEY
};

typedef struct option_row {
  int         key;
  char        letter;
  const char *name, *argument, *text;
} option_row;

static const option_row rows[] = {
#define X(key, letter, name, argument, text) {KEY_##key, letter, name, argument, text},
    OPTION_LIST(X)
#undef X
};
enum { NUM_ROWS = sizeof rows / sizeof *rows };

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
  for (int i = 0; i < NUM_ROWS; i++) {
    const option_row *row = &rows[i];
    int               width;

    width = row->letter ? fprintf(out, "  -%c, --%s", row->letter, row->name) : fprintf(out, "      --%s", row->name);
    if (row->argument) width += fprintf(out, " %s", row->argument);
    fprintf(out, "%*s  %s\n", 30 - width, "", row->text);
  }
  fputs("\nExit status:\n", out);
#define X(name, number, text) fprintf(out, "  %d  %s\n", number, text);
  BOOL_EXIT_LIST(X)
#undef X
}

/* ---- parsing ------------------------------------------------------------------------------------------------------- */

static bool_exit parse_scale(const char *argument, double *scale, bool_failure *why)
{
  char *end;

  *scale = strtod(argument, &end);
  if (end == argument || *end || !(*scale > 0) || isinf(*scale))
    return bool_fail(why, BOOL_USAGE, "--scale: '%.200s' is no factor: give a positive number", argument);
  return BOOL_DONE;
}

static bool_exit parse_faces(const char *argument, remap_faces *faces, bool_failure *why)
{
  if (strcmp(argument, "centre") && strcmp(argument, "diagonal"))
    return bool_fail(why, BOOL_USAGE, "--faces: '%.200s' is not offered: give centre|diagonal", argument);
  *faces = *argument == 'c' ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL;
  return BOOL_DONE;
}

static bool_exit parse_one(const option_row *row, const char *argument, bool_options *out, bool_failure *why)
{
  if (argument && !*argument)
    return bool_fail(why, BOOL_USAGE, "--%s: its argument is empty: give %s", row->name, row->argument);
  switch (row->key) {
    case KEY_OUTPUT: out->output = argument; break;
    case KEY_FIELDS: out->fields = argument; break;
    case KEY_SOLUTION: out->solution = argument; break;
    case KEY_FACES: return parse_faces(argument, &out->faces, why);
    case KEY_AGGREGATE: out->aggregate = true; break;
    case KEY_SPLIT: out->split = true; break;
    case KEY_A_BASE: out->base[0] = argument; break;
    case KEY_B_BASE: out->base[1] = argument; break;
    case KEY_SCALE: return parse_scale(argument, &out->scale, why);
    case KEY_REPORT: out->report = argument; break;
    case KEY_QUIET: out->quiet = true; break;
    case KEY_VERBOSE: out->verbose = true; break;
    case KEY_VERSION: out->version = true; break;
    case KEY_HELP: out->help = true; break;
    default: break;
  }
  return BOOL_DONE;
}

/* The row of what getopt_long answered; NULL if it is none. */
static const option_row *row_of(int key)
{
  for (int i = 0; i < NUM_ROWS; i++)
    if (rows[i].key == key || (rows[i].letter && rows[i].letter == key)) return &rows[i];
  return NULL;
}

/* The operation, then A, then B. */
static bool_exit add_word(bool_options *out, int *num_words, const char *text, bool_failure *why)
{
  if (!*text) return bool_fail(why, BOOL_USAGE, "a word is empty: give OPERATION A B -o OUT, see remap-boolean --help");
  if (*num_words == 3) return bool_fail(why, BOOL_USAGE, "'%.200s' is one file too many: give OPERATION A B -o OUT", text);
  if ((*num_words)++) {
    out->path[*num_words - 2] = text;
    return BOOL_DONE;
  }
#define X(word, bits, what) \
  if (!strcmp(text, word)) out->operation = word, out->keep = bits;
  BOOL_OPERATION_LIST(X)
#undef X
  if (out->operation) return BOOL_DONE;
  return bool_fail(why, BOOL_USAGE, "'%.200s' is no operation: give intersection, union, difference, rdifference or imprint",
                   text);
}

static bool_exit refuse(int key, const char *given, bool_failure *why)
{
  if (key != ':') /* getopt's word for a missing argument */
    return bool_fail(why, BOOL_USAGE, "option '%.200s' is unknown, ambiguous or takes no argument: see remap-boolean --help",
                     given);
  return bool_fail(why, BOOL_USAGE, "option '%.200s' lacks its argument: see remap-boolean --help", given);
}

/* What fits together, once everything is read. */
static bool_exit check_whole(const bool_options *out, int num_words, bool_failure *why)
{
  if (num_words < 3)
    return bool_fail(why, BOOL_USAGE, "an operation and two files are needed: give OPERATION A B -o OUT, see --help");
  if (!out->output) return bool_fail(why, BOOL_USAGE, "no file to write: give -o OUT, see remap-boolean --help");
  if (out->report && !strcmp(out->report, out->output))
    return bool_fail(why, BOOL_USAGE, "%s: it is OUT: give --report another file", out->report);
  return BOOL_DONE;
}

bool_exit bool_options_parse(int argc, char **argv, bool_options *out, bool_failure *why)
{
  struct option table[NUM_ROWS + 1]       = {{0}};
  char          letters[2 * NUM_ROWS + 3] = "-:"; /* words come in order as 1; a missing argument comes as ':' */
  int           key, num_words = 0;

  *out = (bool_options){.scale = 1, .faces = REMAP_FACES_CENTRE};
  for (int i = 0; i < NUM_ROWS; i++) {
    const char short_form[3] = {rows[i].letter, rows[i].argument ? ':' : '\0', '\0'};

    table[i] = (struct option){rows[i].name, rows[i].argument ? required_argument : no_argument, NULL, rows[i].key};
    strcat(letters, short_form);
  }
  opterr = 0;
  optind = 1;
  for (;;) {
    const int         at  = optind;
    const option_row *row = NULL;

    if ((key = getopt_long(argc, argv, letters, table, NULL)) == -1) break;
    if (key == 1) {
      BOOL_TRY(add_word(out, &num_words, optarg, why));
      continue;
    }
    row = row_of(key);
    if (!row) return refuse(key, argv[at < argc ? at : argc - 1], why);
    BOOL_TRY(parse_one(row, optarg, out, why));
  }
  if (out->help || out->version) return BOOL_DONE;
  for (; optind < argc; optind++) BOOL_TRY(add_word(out, &num_words, argv[optind], why));
  return check_whole(out, num_words, why);
}
