/* command -- what the commands share; see command.h. */
#include "command.h"

#include <base.h>
#include <getopt.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

/* ---- the whole ----------------------------------------------------------------------------------------------------- */

void cli_begin(int *argc, char ***argv)
{
  int threads;

  signal(SIGXFSZ, SIG_IGN);
  MPI_Init_thread(argc, argv, MPI_THREAD_FUNNELED, &threads);
}

int cli_end(const char *name, cli_exit status, const cli_failure *why)
{
  int rank;

  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (status != CLI_DONE && rank == 0) fprintf(stderr, "%s: %s\n", name, why->text);
  MPI_Finalize();
  return (int)status;
}

/* ---- failures ------------------------------------------------------------------------------------------------------ */

cli_exit cli_fail(cli_failure *why, cli_exit code, const char *format, ...)
{
  va_list args;

  va_start(args, format);
  vsnprintf(why->text, sizeof why->text, format, args);
  va_end(args);
  return code;
}

cli_exit cli_no_memory(cli_failure *why) { return cli_fail(why, CLI_INTERNAL, "memory is out on one rank: use more ranks"); }

cli_exit cli_from_cgns(rcgns_status status, const rcgns_message *message, cli_failure *why)
{
  static const cli_exit code[] = {[RCGNS_OK]       = CLI_DONE,
                                  [RCGNS_USAGE]    = CLI_USAGE,
                                  [RCGNS_IO]       = CLI_IO,
                                  [RCGNS_GEOMETRY] = CLI_GEOMETRY,
                                  [RCGNS_MEMORY]   = CLI_INTERNAL};

  return status == RCGNS_OK ? CLI_DONE : cli_fail(why, code[status], "%s", message->text);
}

/* ---- ranks together ------------------------------------------------------------------------------------------------ */

cli_exit cli_agree_on(MPI_Comm comm, cli_exit mine, cli_failure *why)
{
  return (cli_exit)ra_agree(comm, (int)mine, why->text, sizeof why->text);
}

/* ---- figures of reports -------------------------------------------------------------------------------------------- */

const char *cli_plural(int64_t count) { return count == 1 ? "" : "s"; }

double cli_slowest(MPI_Comm comm, double since)
{
  double seconds = MPI_Wtime() - since;

  MPI_Allreduce(MPI_IN_PLACE, &seconds, 1, MPI_DOUBLE, MPI_MAX, comm);
  return seconds;
}

int64_t cli_peak_rss(MPI_Comm comm)
{
  struct rusage usage;
  int64_t       bytes;

  getrusage(RUSAGE_SELF, &usage);
  bytes = (int64_t)usage.ru_maxrss * 1024;
  MPI_Allreduce(MPI_IN_PLACE, &bytes, 1, MPI_INT64_T, MPI_MAX, comm);
  return bytes;
}

/* ---- help ---------------------------------------------------------------------------------------------------------- */

void cli_command_help(const cli_command *command, int width, FILE *out)
{
  for (int i = 0; i < command->num_rows; i++) {
    const cli_row *row = &command->row[i];
    const char    *end = strchr(row->text, '\n');
    int            at;

    at = row->letter ? fprintf(out, "  -%c, --%s", row->letter, row->name) : fprintf(out, "      --%s", row->name);
    if (row->argument) at += fprintf(out, " %s", row->argument);
    if (at > width - 2) at = fprintf(out, "\n") - 1;
    fprintf(out, "%*s%.*s\n", width - at, "", end ? (int)(end - row->text) : (int)strlen(row->text), row->text);
    if (end) fprintf(out, "%*s%s\n", width, "", end + 1);
  }
}

/* ---- parsing ------------------------------------------------------------------------------------------------------- */

int cli_number(const char *text, double *value)
{
  char *end;

  *value = strtod(text, &end);
  return end != text && !*end;
}

/* The row of what getopt_long answered; NULL if it is none. */
static const cli_row *row_of(const cli_command *command, int key)
{
  for (int i = 0; i < command->num_rows; i++) {
    const cli_row *row = &command->row[i];

    if (row->key == key || (row->letter && row->letter == key)) return row;
  }
  return NULL;
}

static cli_exit take(const cli_command *command, const cli_row *row, const char *argument, void *options, cli_failure *why)
{
  if (argument && !*argument) return cli_fail(why, CLI_USAGE, "--%s: its argument is empty: give %s", row->name, row->argument);
  if (row->at == CLI_OTHER) return command->take(options, row, argument, why);
  if (row->argument)
    *(const char **)(void *)((char *)options + row->at) = argument;
  else
    *(bool *)(void *)((char *)options + row->at) = true;
  return CLI_DONE;
}

static cli_exit refuse(const cli_command *command, int key, const char *given, cli_failure *why)
{
  if (key != ':') /* getopt's word for a missing argument */
    return cli_fail(why, CLI_USAGE, "option '%.200s' is unknown, ambiguous or takes no argument: see %s --help", given,
                    command->name);
  return cli_fail(why, CLI_USAGE, "option '%.200s' lacks its argument: see %s --help", given, command->name);
}

/* getopt's own tables. Words come in order as 1, a missing argument as ':'. */
static void fill(const cli_command *command, struct option *table, char *letters)
{
  strcpy(letters, "-:");
  for (int i = 0; i < command->num_rows; i++) {
    const cli_row *row           = &command->row[i];
    const char     short_form[3] = {row->letter, row->argument ? ':' : '\0', '\0'};

    table[i] = (struct option){row->name, row->argument ? required_argument : no_argument, NULL, row->key};
    strcat(letters, short_form);
  }
}

static cli_exit parse(const cli_command *command, const struct option *table, const char *letters, int argc, char **argv,
                      void *options, cli_failure *why)
{
  opterr = 0;
  optind = 1;
  for (;;) {
    const int      at = optind, key = getopt_long(argc, argv, letters, table, NULL);
    const cli_row *row = row_of(command, key);

    if (key == -1) break;
    if (key != 1 && !row) return refuse(command, key, argv[at < argc ? at : argc - 1], why);
    CLI_TRY(key == 1 ? command->word(options, optarg, why) : take(command, row, optarg, options, why));
  }
  for (; optind < argc; optind++) CLI_TRY(command->word(options, argv[optind], why));
  return CLI_DONE;
}

cli_exit cli_command_parse(const cli_command *command, int argc, char **argv, void *options, cli_failure *why)
{
  struct option *table   = calloc((size_t)command->num_rows + 1, sizeof *table);
  char          *letters = calloc(2 * (size_t)command->num_rows + 3, 1);
  cli_exit       code    = table && letters ? CLI_DONE : cli_no_memory(why);

  if (code == CLI_DONE) {
    fill(command, table, letters);
    code = parse(command, table, letters, argc, argv, options, why);
  }
  free(table);
  free(letters);
  return code;
}
