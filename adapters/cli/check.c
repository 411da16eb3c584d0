/* check -- remap --check: what transfers between two given meshes are worth, told by fields that are known everywhere.
 *
 *   constant      comes through as it is
 *   linear        comes through exactly (order 2 and 3, without a limiter)
 *   order         a quarter of a wave in the box comes through better than half a wave by 2^order
 *   conservation  of that wave
 *   bounds        a jump stays within its two values
 *
 * Values of a cell are means: of the linear field that at the centroid, of the waves by quadrature of degree 2 over the
 * tetrahedra between the centroid and the faces, each fanned about the mean of its nodes. Errors are taken over cells that
 * are covered, constant and linear over those covered in part as well. O(faces); five fields. */
#include "job.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CONSTANT, LINEAR, LONG_WAVE, SHORT_WAVE, JUMP, NUM_FIELDS };

/* The fields, in the box of the covered cells. */
typedef struct known {
  double middle[3],
      per_extent[3]; /* [d] of the box; 1 / extent, 0 where a mesh is one layer of cells: nothing varies along it */
} known;

/* One side: its cells, block after block, and the fields' means. */
typedef struct check_side {
  int               num_blocks;
  const remap_mesh *block; /* [num_blocks] */
  int64_t           num_cells;
  double           *volume, *centre, *mean[NUM_FIELDS]; /* [cells], [cells][3], [cells] each */
} check_side;

/* ---- fields ------------------------------------------------------------------------------------------------------- */

/* The place in the box, -1/2 .. 1/2 along each axis. */
static double place(const known *k, const double x[3], int d) { return (x[d] - k->middle[d]) * k->per_extent[d]; }

static double linear(const known *k, const double x[3])
{
  return 1 + .5 * place(k, x, 0) - .3 * place(k, x, 1) + .4 * place(k, x, 2);
}

/* So many waves along each axis. */
static double wave(const known *k, const double x[3], double waves)
{
  const double turn = 2 * M_PI * waves;

  return 2 + sin(turn * place(k, x, 0) + .4) * cos(turn * place(k, x, 1) + .3) * sin(turn * place(k, x, 2) + 1);
}

/* 1 inside an ellipsoid, 0 outside. */
static double jump(const known *k, const double x[3])
{
  double square = 0;

  for (int d = 0; d < 3; d++) square += place(k, x, d) * place(k, x, d);
  return square < .09;
}

/* ---- means -------------------------------------------------------------------------------------------------------- */

/* Add the integrals of the waves over the tetrahedron (apex, a, b, c) and its volume: sum[3]. */
static void add_tetrahedron(const known *k, const double *apex, const double *a, const double *b, const double *c,
                            double sum[3])
{
  static const double near = 0.13819660112501051518, far = 0.58541019662496845446; /* (5 -+ sqrt 5) / 20 */
  const double *const p[4] = {apex, a, b, c};
  double              e[3][3], volume;

  for (int i = 0; i < 3; i++)
    for (int d = 0; d < 3; d++) e[i][d] = p[i + 1][d] - apex[d];
  volume = (e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) + e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
            e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0])) /
           6;
  for (int i = 0; i < 4; i++) {
    double x[3] = {0, 0, 0};

    for (int v = 0; v < 4; v++)
      for (int d = 0; d < 3; d++) x[d] += (v == i ? far : near) * p[v][d];
    sum[0] += volume / 4 * wave(k, x, .25);
    sum[1] += volume / 4 * wave(k, x, .5);
  }
  sum[2] += volume;
}

/* Corner i of a face that begins at entry `first` of the loops. */
static const double *corner(const remap_mesh *m, int64_t first, int64_t i)
{
  return m->node_xyz + 3 * cli_entry(m->face_node, m->face_node32, first + i);
}

/* Add a face to the integrals of a cell; sign -1 if its normal points into it. */
static void add_face(const known *k, const remap_mesh *m, int64_t face, const double *apex, double sign, double sum[3])
{
  const int64_t first     = cli_entry(m->face_offset, m->face_offset32, face);
  const int64_t n         = cli_entry(m->face_offset, m->face_offset32, face + 1) - first;
  double        middle[3] = {0, 0, 0}, part[3] = {0, 0, 0};

  for (int64_t i = 0; i < n; i++)
    for (int d = 0; d < 3; d++) middle[d] += corner(m, first, i)[d] / (double)n;
  for (int64_t i = 0; i < n; i++)
    add_tetrahedron(k, apex, middle, corner(m, first, i), corner(m, first, i + 1 < n ? i + 1 : 0), part);
  for (int i = 0; i < 3; i++) sum[i] += sign * part[i];
}

/* The means of all fields over the cells of one side. sum has room for [cells][3]. */
static void find_means(const known *k, check_side *s, double *sum)
{
  int64_t first = 0; /* cell of the block */

  memset(sum, 0, 3 * (size_t)s->num_cells * sizeof *sum);
  for (int b = 0; b < s->num_blocks; first += s->block[b++].num_cells) {
    const remap_mesh *m = &s->block[b];

    for (int64_t f = 0; f < m->num_faces; f++) {
      const int64_t own   = first + cli_entry(m->face_owner, m->face_owner32, f);
      const int64_t other = cli_entry(m->face_neighbour, m->face_neighbour32, f);

      add_face(k, m, f, s->centre + 3 * own, 1, sum + 3 * own);
      if (other >= 0) add_face(k, m, f, s->centre + 3 * (first + other), -1, sum + 3 * (first + other));
    }
  }
  for (int64_t c = 0; c < s->num_cells; c++) {
    const double *x = s->centre + 3 * c, *whole = sum + 3 * c;

    s->mean[CONSTANT][c]   = 1.7;
    s->mean[LINEAR][c]     = linear(k, x);
    s->mean[LONG_WAVE][c]  = whole[2] != 0 ? whole[0] / whole[2] : wave(k, x, .25);
    s->mean[SHORT_WAVE][c] = whole[2] != 0 ? whole[1] / whole[2] : wave(k, x, .5);
    s->mean[JUMP][c]       = jump(k, x);
  }
}

/* ---- the transfers ------------------------------------------------------------------------------------------------ */

/* The box of the centroids of a mesh's cells that are covered, wholly or in part: -low and high. Collective. */
static cli_exit find_ends(const cli_job *j, remap_side which, const check_side *s, remap_cover *cover, double end[6],
                          cli_failure *why)
{
  CLI_TRY(cli_from_remap(j, remap_coverage(j->ctx, which, NULL, cover), why));
  for (int i = 0; i < 6; i++) end[i] = -DBL_MAX;
  for (int64_t c = 0; c < s->num_cells; c++)
    for (int d = 0; d < 3 && (cover[c] == REMAP_COVERED || cover[c] == REMAP_PARTIAL); d++) {
      end[d]     = fmax(end[d], -s->centre[3 * c + d]);
      end[3 + d] = fmax(end[3 + d], s->centre[3 * c + d]);
    }
  MPI_Allreduce(MPI_IN_PLACE, end, 6, MPI_DOUBLE, MPI_MAX, j->comm);
  return CLI_DONE;
}

/* The box of both meshes. cover, room for the cells of either, holds TARGET's in the end. Collective. */
static cli_exit find_box(const cli_job *j, const check_side side[2], remap_cover *cover, known *out, cli_failure *why)
{
  double end[2][6], most[2] = {0, 0};

  for (int i = 0; i < 2; i++) CLI_TRY(find_ends(j, (remap_side)i, &side[i], cover, end[i], why));
  if (end[REMAP_TARGET][0] == -DBL_MAX)
    return cli_fail(why, CLI_COVERAGE,
                    "%s onto %s: the meshes do not meet, there is nothing to check: see --scale and --transform",
                    j->options.path[REMAP_SOURCE], j->options.path[REMAP_TARGET]);
  for (int i = 0; i < 2; i++)
    for (int d = 0; d < 3; d++) most[i] = fmax(most[i], end[i][d] + end[i][3 + d]);
  for (int d = 0; d < 3; d++) {
    const double *t       = end[REMAP_TARGET];
    bool          is_thin = false;

    for (int i = 0; i < 2; i++) is_thin = is_thin || end[i][d] + end[i][3 + d] <= 1e-3 * most[i];
    out->middle[d]     = (t[3 + d] - t[d]) / 2;
    out->per_extent[d] = is_thin ? 0 : 1 / (t[d] + t[3 + d]);
  }
  return CLI_DONE;
}

/* All fields to TARGET: waves as the command line asks, the jump with a limiter, the others without, of order 2 at least. */
static cli_exit carry(cli_job *j, const check_side side[2], double *const out[NUM_FIELDS], remap_field_report *report,
                      cli_failure *why)
{
  remap_transfer   how = j->options.transfer;
  remap_field_desc f[NUM_FIELDS];

  for (int i = 0; i < NUM_FIELDS; i++)
    f[i] = (remap_field_desc){.nature = REMAP_CONSERVED, .in = side[REMAP_SOURCE].mean[i], .out = out[i]};
  how.on_uncovered = REMAP_UNCOVERED_FILL;
  how.on_partial   = REMAP_PARTIAL_NORMALISE;
  how.fill_value   = 0;
  CLI_TRY(cli_from_remap(j, remap_field(j->ctx, REMAP_FORWARD, &how, 2, f + LONG_WAVE, report + LONG_WAVE), why));
  if (how.limiter == REMAP_LIMITER_NONE) how.limiter = REMAP_LIMITER_AUTO;
  CLI_TRY(cli_from_remap(j, remap_field(j->ctx, REMAP_FORWARD, &how, 1, f + JUMP, report + JUMP), why));
  how.limiter = REMAP_LIMITER_NONE;
  if (how.order < 2) how.order = 2;
  return cli_from_remap(j, remap_field(j->ctx, REMAP_FORWARD, &how, 2, f, report), why);
}

/* ---- the verdict -------------------------------------------------------------------------------------------------- */

/* Errors of the fields: the largest one and the mean over covered cells. Means are summed as integers, alike on any ranks. */
static void find_errors(const cli_job *j, const check_side *target, double *const out[NUM_FIELDS], const remap_cover *cover,
                        double largest[NUM_FIELDS], double mean[NUM_FIELDS])
{
  const double total             = j->report.stats.volume[REMAP_TARGET];
  int64_t      whole[NUM_FIELDS] = {0};

  for (int i = 0; i < NUM_FIELDS; i++) largest[i] = 0;
  for (int64_t c = 0; c < target->num_cells; c++)
    for (int i = 0; i < NUM_FIELDS && (cover[c] == REMAP_COVERED || cover[c] == REMAP_PARTIAL); i++) {
      const double error = fabs(out[i][c] - target->mean[i][c]);

      largest[i] = fmax(largest[i], error);
      if (cover[c] == REMAP_COVERED) whole[i] += llrint(ldexp(fmin(error, 1) * fabs(target->volume[c]) / total, 60));
    }
  MPI_Allreduce(MPI_IN_PLACE, largest, NUM_FIELDS, MPI_DOUBLE, MPI_MAX, j->comm);
  MPI_Allreduce(MPI_IN_PLACE, whole, NUM_FIELDS, MPI_INT64_T, MPI_SUM, j->comm);
  for (int i = 0; i < NUM_FIELDS; i++) mean[i] = ldexp((double)whole[i], -60);
}

static void judge(cli_job *j, const double largest[NUM_FIELDS], const double mean[NUM_FIELDS], const remap_field_report *report)
{
  const double asked = j->options.transfer.order, tiny = 1e-13;
  const double order  = mean[LONG_WAVE] > 0 && mean[SHORT_WAVE] > tiny ? log2(mean[SHORT_WAVE] / mean[LONG_WAVE]) : asked;
  const double beyond = fmax(-report[JUMP].target_min, report[JUMP].target_max - 1);

  j->report.num_checks                    = 0;
  j->report.check[j->report.num_checks++] = (cli_check_row){"constant", largest[CONSTANT] / 1.7, CLI_MAX_CONSTANT, false};
  j->report.check[j->report.num_checks++] = (cli_check_row){"linear", largest[LINEAR], CLI_MAX_LINEAR, false};
  j->report.check[j->report.num_checks++] = (cli_check_row){"order", order, asked - .5, true};
  j->report.check[j->report.num_checks++] =
      (cli_check_row){"conservation", report[LONG_WAVE].conservation_error, CLI_MAX_CONSERVATION, false};
  j->report.check[j->report.num_checks++] = (cli_check_row){"bounds", fmax(beyond, 0), CLI_MAX_BEYOND, false};
}

/* One line that names the figures that fail, and a cell that is to blame. Collective. */
static cli_exit say_failures(cli_job *j, cli_failure *why)
{
  char   names[200] = "", words[600];
  size_t length     = 0;

  for (int i = 0; i < j->report.num_checks; i++)
    if (!cli_check_passes(&j->report.check[i]))
      length += (size_t)snprintf(names + length, sizeof names - length, "%s %s", length ? "," : "", j->report.check[i].name);
  if (!length) return CLI_DONE;
  CLI_TRY(cli_blame(j, "refine the coarser mesh, or see whether one folds", words, sizeof words, why));
  return cli_fail(why, CLI_VERIFY, "%s onto %s: the check fails in%s: %s", j->options.path[REMAP_SOURCE],
                  j->options.path[REMAP_TARGET], names, words);
}

/* Room for one side, and the cells. */
static cli_exit open_side(cli_job *j, remap_side which, check_side *s, cli_failure *why)
{
  const size_t n = (size_t)cli_num_cells(j, which);
  cli_exit     mine;

  s->block     = cli_blocks(j, which, &s->num_blocks);
  s->num_cells = (int64_t)n;
  s->volume    = malloc((4 + NUM_FIELDS) * (n + 1) * sizeof *s->volume);
  mine         = cli_agree(j, s->volume ? CLI_DONE : cli_no_memory(why), why);
  CLI_TRY(mine);
  s->centre = s->volume + n;
  for (int i = 0; i < NUM_FIELDS; i++) s->mean[i] = s->volume + (4 + (size_t)i) * n;
  return cli_from_remap(j, remap_cells(j->ctx, which, s->volume, s->centre), why);
}

/* With both sides there. room is [most cells of a side][3], out [NUM_FIELDS][cells of TARGET]. */
static cli_exit check_sides(cli_job *j, check_side side[2], double *room, double *values, remap_cover *cover, cli_failure *why)
{
  remap_field_report report[NUM_FIELDS];
  double            *out[NUM_FIELDS], largest[NUM_FIELDS], mean[NUM_FIELDS];
  known              k;

  CLI_TRY(find_box(j, side, cover, &k, why));
  for (int i = 0; i < 2; i++) find_means(&k, &side[i], room);
  for (int i = 0; i < NUM_FIELDS; i++) out[i] = values + (size_t)i * (size_t)side[REMAP_TARGET].num_cells;
  CLI_TRY(carry(j, side, out, report, why));
  find_errors(j, &side[REMAP_TARGET], out, cover, largest, mean);
  judge(j, largest, mean, report);
  return CLI_DONE;
}

cli_exit cli_check(cli_job *j, cli_failure *why)
{
  const int64_t num[2]  = {cli_num_cells(j, REMAP_SOURCE), cli_num_cells(j, REMAP_TARGET)};
  const size_t  most    = (size_t)(num[0] > num[1] ? num[0] : num[1]) + 1;
  double       *room    = malloc((3 * most + NUM_FIELDS * ((size_t)num[REMAP_TARGET] + 1)) * sizeof *room);
  remap_cover  *cover   = malloc(most * sizeof *cover);
  check_side    side[2] = {{.volume = NULL}, {.volume = NULL}};
  cli_exit      mine    = cli_agree(j, room && cover ? CLI_DONE : cli_no_memory(why), why);

  cli_progress_set(j->progress, "check", -1);
  for (int i = 0; i < 2 && mine == CLI_DONE; i++) mine = open_side(j, (remap_side)i, &side[i], why);
  if (mine == CLI_DONE) mine = check_sides(j, side, room, room + 3 * most, cover, why);
  if (mine == CLI_DONE && j->rank == 0 && !j->options.quiet) cli_report_check(stdout, &j->report);
  if (mine == CLI_DONE) mine = say_failures(j, why);
  for (int i = 0; i < 2; i++) free(side[i].volume);
  free(room);
  free(cover);
  return mine;
}
