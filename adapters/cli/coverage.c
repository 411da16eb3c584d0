/* coverage -- how much of the cells of one mesh the other covers: counts, volumes and the cells that lack most. O(cells), and a
 * few cells of every rank on every rank. The figures do not depend on the number of ranks: volumes are summed as integers. */
#include "job.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What one rank knows of the cells of one side. */
typedef struct cell_facts {
  double      *fraction, *volume, *centre; /* [cells], [cells], [cells][3] */
  remap_cover *cover;                      /* [cells] */
} cell_facts;

/* Put a cell into the list of the largest ones. */
static void insert(remap_partial_cell list[CLI_WORST], int *num, const remap_partial_cell *cell)
{
  int at = *num;

  while (at > 0 && (cell->volume > list[at - 1].volume ||
                    (cell->volume == list[at - 1].volume && cell->global_cell < list[at - 1].global_cell)))
    at--;
  if (at == CLI_WORST) return;
  if (*num < CLI_WORST) ++*num;
  for (int i = *num - 1; i > at; i--) list[i] = list[i - 1];
  list[at] = *cell;
}

/* This rank's cells. Volumes are summed as multiples of 2^-shift. */
static void count(const cli_job *j, remap_side side, const cell_facts *facts, int shift, int64_t whole[4], cli_cover_row *row)
{
  const int64_t *global = cli_cells(j, side), n = cli_num_cells(j, side);
  const uint8_t *mask = j->mask[side];

  for (int64_t c = 0; c < n; c++) {
    const remap_cover cover       = mask && !mask[c] ? REMAP_UNWANTED : facts->cover[c]; /* the library knows it of receivers */
    const double     *x           = facts->centre + 3 * c;
    const double      volume      = fabs(facts->volume[c]);
    const remap_partial_cell cell = {global[c], facts->fraction[c], volume, {x[0], x[1], x[2]}};

    row->cells[cover]++;
    whole[cover] += llrint(ldexp(volume, shift));
    if (cover == REMAP_UNCOVERED) insert(row->uncovered, &row->num_uncovered, &cell);
    if (side == REMAP_TARGET && cover == REMAP_PARTIAL && cell.fraction < j->options.min_coverage) row->num_too_little++;
  }
}

/* The rows of all ranks into one. rows has room for [ranks]. Collective. */
static void merge(const cli_job *j, const cli_cover_row *mine, cli_cover_row *rows, cli_cover_row *out)
{
  int ranks;

  MPI_Comm_size(j->comm, &ranks);
  MPI_Allgather(mine, (int)sizeof *mine, MPI_BYTE, rows, (int)sizeof *mine, MPI_BYTE, j->comm);
  for (int r = 0; r < ranks; r++) {
    for (int i = 0; i < rows[r].num_uncovered; i++) insert(out->uncovered, &out->num_uncovered, &rows[r].uncovered[i]);
    for (int i = 0; i < 4; i++) out->cells[i] += rows[r].cells[i];
    out->num_too_little += rows[r].num_too_little;
  }
}

static cli_exit find_side(cli_job *j, remap_side side, const cell_facts *facts, cli_failure *why)
{
  int64_t       whole[4] = {0, 0, 0, 0};
  cli_cover_row mine = {.num_partial = 0}, *rows, *out = &j->report.cover[side];
  int           ranks, exponent, shift;

  frexp(j->report.stats.volume[side], &exponent); /* the volume may be 0: a mesh that is tiny beside the other */
  shift = 61 - exponent;
  MPI_Comm_size(j->comm, &ranks);
  rows = calloc((size_t)ranks, sizeof *rows);
  CLI_TRY(cli_agree(j, rows ? CLI_DONE : cli_no_memory(why), why));
  count(j, side, facts, shift, whole, &mine);
  merge(j, &mine, rows, out);
  free(rows);
  MPI_Allreduce(MPI_IN_PLACE, whole, 4, MPI_INT64_T, MPI_SUM, j->comm);
  for (int i = 0; i < 4; i++) out->volume[i] = ldexp((double)whole[i], -shift);
  out->num_partial = CLI_WORST;
  return cli_from_remap(j, remap_partial_cells(j->ctx, side, &out->num_partial, out->partial), why);
}

cli_exit cli_coverage_find(cli_job *j, cli_failure *why)
{
  for (int side = 0; side < 2; side++) {
    const size_t n     = (size_t)cli_num_cells(j, (remap_side)side) + 1;
    double      *d     = malloc(4 * n * sizeof *d);
    cell_facts   facts = {.volume = d, .centre = d + n, .cover = malloc(n * sizeof(remap_cover))};
    cli_exit     mine;

    facts.fraction = j->fraction[side] = malloc(n * sizeof *d);
    mine                               = cli_agree(j, d && facts.cover && facts.fraction ? CLI_DONE : cli_no_memory(why), why);
    if (mine == CLI_DONE) mine = cli_from_remap(j, remap_coverage(j->ctx, (remap_side)side, facts.fraction, facts.cover), why);
    if (mine == CLI_DONE) mine = cli_from_remap(j, remap_cells(j->ctx, (remap_side)side, facts.volume, facts.centre), why);
    if (mine == CLI_DONE) mine = find_side(j, (remap_side)side, &facts, why);
    free(d);
    free(facts.cover);
    CLI_TRY(mine);
  }
  return CLI_DONE;
}
