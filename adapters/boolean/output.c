/* output -- where the result may be written, and in which format. */
#include "boolean.h"

#include <vtk.h>

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#define CGNS_VERSION 4.2 /* what most readers of ElementStartOffset want */

/* ---- check --------------------------------------------------------------------------------------------------------- */

static bool is_same_file(const char *one, const char *other)
{
  struct stat a, b;

  return !stat(one, &a) && !stat(other, &b) && a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

/* Can a file be made there? Rank 0 alone. */
static cli_exit check_path(const char *path, const char *word, const bool_options *options, cli_failure *why)
{
  const char *slash  = strrchr(path, '/');
  char       *folder = slash == path ? strdup("/") : slash ? strndup(path, (size_t)(slash - path)) : strdup(".");
  struct stat st;
  cli_exit    code = CLI_DONE;

  if (!folder) return cli_no_memory(why);
  for (int side = 0; side < 2 && code == CLI_DONE; side++)
    if (is_same_file(path, options->path[side]))
      code = cli_fail(why, CLI_USAGE, "%s: it is one of the input files: choose another %s", path, word);
  if (code == CLI_DONE && !stat(path, &st) && !S_ISREG(st.st_mode))
    code = cli_fail(why, CLI_IO, "%s: it exists and is not a regular file: choose another %s", path, word);
  if (code == CLI_DONE && rslice_file_check(path))
    code = cli_fail(why, CLI_IO, "%s: it may not be written (%s): remove it, or choose another %s", path,
                    strerror(rslice_file_check(path)), word);
  if (code == CLI_DONE && access(folder, W_OK | X_OK))
    code = cli_fail(why, CLI_IO, "%s: its folder cannot be written (%s): choose another %s", path, strerror(errno), word);
  free(folder);
  return code;
}

static bool ends_in(const char *path, const char *ending)
{
  const size_t n = strlen(path), m = strlen(ending);

  return n > m && !strcasecmp(path + n - m, ending);
}

cli_exit bool_output_check(MPI_Comm comm, const bool_options *options, cli_failure *why)
{
  cli_exit code = CLI_DONE;
  int      rank;

  MPI_Comm_rank(comm, &rank);
  if (!rsurf_is_path(options->output) && !rvtk_is_path(options->output) && !ends_in(options->output, ".cgns"))
    return cli_fail(why, CLI_USAGE, "%s: its ending says no format: give OUT as .cgns, .vtu, .stl or .obj", options->output);
  if (rank == 0) code = check_path(options->output, "OUT", options, why);
  if (rank == 0 && code == CLI_DONE && options->report) code = check_path(options->report, "report", options, why);
  return cli_agree_on(comm, code, why);
}

/* ---- which --------------------------------------------------------------------------------------------------------- */

cli_exit bool_output_write(MPI_Comm comm, const bool_options *options, const rslice_content *content, cli_failure *why)
{
  rcgns_message message;
  rvtk_message  text;
  rvtk_status   status;

  if (rsurf_is_path(options->output)) return bool_outer_write(comm, options->output, content, why);
  if (!rvtk_is_path(options->output))
    return cli_from_cgns(rcgns_write_supermesh(comm, options->output, CGNS_VERSION, content, &message), &message, why);
  status = rvtk_write(comm, options->output, content, &text);
  if (status == RVTK_OK) return CLI_DONE;
  return cli_fail(why, status == RVTK_IO ? CLI_IO : CLI_INTERNAL, "%s", text.text);
}
