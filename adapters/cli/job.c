/* job -- what the steps of a run share: agreement of ranks, failures of others in our words, remarks. */
#include "job.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

/* ---- ranks together ----------------------------------------------------------------------------------------------- */

cli_exit cli_agree(const cli_job *j, cli_exit mine, cli_failure *why) { return cli_agree_on(j->comm, mine, why); }

/* ---- failures of others in our words ------------------------------------------------------------------------------ */

cli_exit cli_from_remap(const cli_job *j, remap_status status, cli_failure *why)
{
  const char *text = remap_message(j->ctx), *const *path = j->options.path;
  cli_exit    code = CLI_INTERNAL;

  switch (status) {
    case REMAP_OK: return CLI_DONE;
    case REMAP_COVERAGE: code = CLI_COVERAGE; break;
    case REMAP_BAD_VALUE: code = CLI_IO; break;
    case REMAP_BAD_MESH:
    case REMAP_ZONE_OVERLAP: code = CLI_GEOMETRY; break;
    default: break;
  }
  if (!*text) text = remap_status_text(status);
  if (strstr(text, "is not above 0"))
    return cli_fail(why, code, "%s: repair it, or let nothing move with it by --nature Density=volume-mean", text);
  if (status == REMAP_COVERAGE)
    return cli_fail(why, code, "%s: allow it by --on-uncovered, --on-partial or --min-coverage", text);
  if (status == REMAP_ZONE_OVERLAP)
    return cli_fail(why, code, "%s, or say by --priority, or by --source-mask and --target-mask, which cells count", text);
  if (strstr(text, path[REMAP_SOURCE]) || strstr(text, path[REMAP_TARGET])) return cli_fail(why, code, "%s", text);
  return cli_fail(why, code, "%s onto %s: %s", path[REMAP_SOURCE], path[REMAP_TARGET], text);
}

/* ---- remarks ------------------------------------------------------------------------------------------------------ */

void cli_note(cli_job *j, const char *format, ...)
{
  char  **more = realloc(j->note, (size_t)(j->num_notes + 1) * sizeof *more);
  va_list args;
  int     length;

  if (!more) return;
  j->note = more;
  va_start(args, format);
  length = vsnprintf(NULL, 0, format, args);
  va_end(args);
  if (length < 0 || !(more[j->num_notes] = malloc((size_t)length + 1))) return;
  va_start(args, format);
  vsnprintf(more[j->num_notes++], (size_t)length + 1, format, args);
  va_end(args);
}

/* ---- cells -------------------------------------------------------------------------------------------------------- */

const rcgns_zone_info *cli_zone_of(const rcgns_info *info, int64_t cell)
{
  int64_t zone = info->num_zones - 1;

  while (zone > 0 && info->zone[zone].first_cell > cell) zone--;
  return &info->zone[zone];
}
