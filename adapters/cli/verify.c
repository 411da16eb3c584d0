/* verify -- is the result as good as it must be, and if it is not, what is to blame?
 *
 * A cell whose faces cross each other can have parts on which it winds the wrong way round. Where these cancel the others, its
 * volume is next to nothing while its pairs have volume: no value of its own stands for the content that comes to it or goes
 * from it. Such a cell is named. O(pairs), after a failure only. */
#include "job.h"

#include <math.h>

/* Rounding of 1e-16, so many times as large, comes near what is allowed. */
#define CANCELS (.1 * CLI_MAX_CONSERVATION / 1e-16)

/* A cell whose parts cancel: volumes of the pairs that count one way and the other, and their sum over their difference. */
typedef struct hollow {
  double  ratio; /* CANCELS at least */
  double  part[2];
  int64_t cell; /* global, -1: none */
} hollow;

/* The worst one of this rank. */
static hollow find_hollow(const int64_t *cell, const remap_pairs_view *pairs)
{
  hollow worst = {.ratio = CANCELS, .cell = -1};

  for (int64_t r = 0; r < pairs->num_rows; r++) {
    hollow h = {.cell = cell[r]};

    for (int64_t k = pairs->row_offset[r]; k < pairs->row_offset[r + 1]; k++)
      h.part[pairs->volume[k] < 0] += fabs(pairs->volume[k]);
    if (h.part[0] == 0 || h.part[1] == 0) continue;
    h.ratio = (h.part[0] + h.part[1]) / fabs(h.part[0] - h.part[1]);
    if (h.ratio > worst.ratio) worst = h;
  }
  return worst;
}

/* The worst one of all ranks, of one side; of equals the lowest number. Collective. */
static cli_exit worst_hollow(const cli_job *j, remap_side side, hollow *out, cli_failure *why)
{
  const remap_direction direction = side == REMAP_TARGET ? REMAP_FORWARD : REMAP_BACKWARD;
  remap_pairs_view      pairs;
  int64_t               first;
  double                most;

  CLI_TRY(cli_agree(j, cli_from_remap(j, remap_pairs(j->ctx, direction, &pairs), why), why));
  *out = find_hollow(cli_cells(j, side), &pairs);
  most = out->ratio;
  MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE, MPI_MAX, j->comm);
  first = out->ratio == most && out->cell >= 0 ? out->cell : INT64_MAX;
  MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT64_T, MPI_MIN, j->comm);
  if (out->ratio != most || out->cell != first) out->part[0] = out->part[1] = 0;
  MPI_Allreduce(MPI_IN_PLACE, out->part, 2, MPI_DOUBLE, MPI_MAX, j->comm);
  out->ratio = most;
  out->cell  = first == INT64_MAX ? -1 : first;
  return CLI_DONE;
}

cli_exit cli_blame(cli_job *j, const char *otherwise, char *words, size_t size, cli_failure *why)
{
  snprintf(words, size, "%s", otherwise);
  for (int side = 0; side < 2; side++) {
    const rcgns_info *info = j->report.info[side];
    hollow            h;

    CLI_TRY(worst_hollow(j, (remap_side)side, &h, why));
    if (h.cell < 0) continue;
    const rcgns_zone_info *zone = cli_zone_of(info, h.cell);
    snprintf(words, size,
             "%s: zone %s: cell %lld (counted from 1) turns inside out: parts of volume %.3g and -%.3g cancel, no value stands "
             "for their content: untangle it",
             info->path, zone->name, (long long)(h.cell - zone->first_cell + 1), h.part[0], h.part[1]);
    cli_note(j, "%s", words);
    return CLI_DONE;
  }
  return CLI_DONE;
}

static cli_exit refuse_closure(const cli_job *j, int side, cli_failure *why)
{
  const remap_stats     *stats = &j->report.stats;
  const rcgns_info      *info  = j->report.info[side];
  const int64_t          cell  = stats->worst_closure_cell[side];
  const rcgns_zone_info *zone  = cli_zone_of(info, cell);

  return cli_fail(
      why, CLI_VERIFY,
      "%s: zone %s: cell %lld (counted from 1): its overlaps sum up to its volume only within %.1e, the bar is %.0e: "
      "nothing is written; see whether the mesh folds there",
      info->path, zone->name, (long long)(cell - zone->first_cell + 1), stats->max_closure_error[side], CLI_MAX_CLOSURE);
}

/* Written so that a NaN fails. */
cli_exit cli_verify(cli_job *j, cli_failure *why)
{
  for (int side = 0; side < 2; side++)
    if (!(j->report.stats.max_closure_error[side] <= CLI_MAX_CLOSURE)) return refuse_closure(j, side, why);
  for (int k = 0; k < j->num_fields; k++) {
    const double error = j->row[k].what.conservation_error;
    char         words[600];

    if (error <= CLI_MAX_CONSERVATION || (j->options.allow_nan && isnan(error))) continue;
    CLI_TRY(cli_blame(j, "see whether a mesh folds", words, sizeof words, why));
    return cli_fail(why, CLI_VERIFY, "%s: field %s is conserved only within %.1e, the bar is %.0e: nothing is written; %s",
                    j->options.path[REMAP_SOURCE], j->row[k].name, error, CLI_MAX_CONSERVATION, words);
  }
  return CLI_DONE;
}
