/* job.h -- the one job of a run of remap: what its steps share, and its fields. */
#ifndef REMAP_CLI_JOB_H
#define REMAP_CLI_JOB_H

#include "cli.h"
#include "command.h"
#include "options.h"
#include "progress.h"
#include "report.h"

#include <cgns.h>
#include <mpi.h>
#include <remap/remap.h>

/** The field that --coverage and --source-coverage write. */
#define CLI_COVERAGE_FIELD "Coverage"

/** SOURCE cut by --priority. Opaque. */
typedef struct cli_cut cli_cut;

/** Everything a step may need. Files and solutions of [remap_side]; the solution of the target holds the old values. */
typedef struct cli_job {
  MPI_Comm       comm;
  int            rank;
  cli_options    options;
  double         begin;           /**< MPI_Wtime */
  double         transform[3][4]; /**< of SOURCE */
  double         rotation[3][3];  /**< in it, if transfer.rotation is set */
  cli_progress  *progress;        /**< NULL but on a rank that speaks */
  rcgns_file    *file[2];
  rcgns_solution solution[2];
  cli_cut       *cut; /**< NULL: SOURCE is as its file has it */
  remap_context *ctx;

  double           *fraction[2]; /**< [remap_side][cells of this rank] of their volume that is covered: psi and phi */
  int               num_fields;
  int               num_hidden; /**< further fields, 0 or 1, that take part and are not written */
  remap_field_desc *field;      /**< [num_fields + num_hidden] names, natures, roles and where the values are */
  cli_field_row    *row;        /**< [num_fields] the same fields in the report */
  double           *values;     /**< behind every in and out of field */
  uint8_t          *mask[2];    /**< [remap_side][cells of this rank] SOURCE: which give, TARGET: which want; NULL: all */

  double *volume[2]; /**< [remap_side][cells of this rank] the solver's own, NULL: none */

  int             num_notes;
  char          **note;        /**< [num_notes] remarks for the report */
  cli_report_file report_file; /**< on rank 0 */
  cli_report      report;
} cli_job;

/** The greatest of the ranks' statuses and the text of the lowest rank that has it. Collective. */
cli_exit cli_agree(const cli_job *j, cli_exit mine, cli_failure *why);

/** Remember a remark for the report; one that finds no memory is lost. Not collective. */
void cli_note(cli_job *j, const char *format, ...) __attribute__((format(printf, 2, 3)));

/** The zone that holds a global cell. Not collective. */
const rcgns_zone_info *cli_zone_of(const rcgns_info *info, int64_t cell);

/** Choose the solutions and the fields, make room for their values and read them, old values of the target included: fills
 *  solution, field, row and values. Collective. Errors: USAGE (what was named is not there), IO (unreadable, or not finite),
 *  INTERNAL. */
cli_exit cli_fields_read(cli_job *j, cli_failure *why);

/** Is a field of that name the mask of one side? Not collective. */
bool cli_is_mask(const cli_options *options, const char *field);

/** Find out which fields of the job move in a system, by which gas model, and which are vectors that turn with SOURCE: sets
 *  members of field, row and options.transfer, and may add a hidden density. Not collective; alike on all ranks. */
void cli_systems_find(cli_job *j);

/** The hidden density from the values, [num_fields][num_cells], of the other fields. Not collective. */
void cli_hidden_density(const cli_job *j, const double *const *value, int64_t num_cells, double *density);

/** Read the masks that were asked for: fills mask and the report's words about them. Collective. Errors: USAGE (no such field,
 *  no known codes, no cell takes part), IO, INTERNAL. */
cli_exit cli_masks_read(cli_job *j, cli_failure *why);

/** Read the solvers' cell volumes that were asked for: fills volume. Collective. Errors: USAGE (no such field), IO (not above
 *  0), INTERNAL. */
cli_exit cli_volumes_read(cli_job *j, cli_failure *why);

/** After remap_build, remark on volumes that cannot be any. Not collective; alike on all ranks. */
void cli_volumes_doubt(cli_job *j);

/** Refuse a --priority that names zones of neither file. Not collective; alike on all ranks. Errors: USAGE. */
cli_exit cli_priority_check(const cli_job *j, cli_failure *why);

/** Does --priority name zones of that side? Not collective. */
bool cli_has_priority(const cli_job *j, remap_side side);

/** Where --priority names zones of SOURCE, cut those of lower priority: sets cut, and values, mask and volumes become those of
 *  what is visible. After all of SOURCE is read. Collective. Errors: USAGE, GEOMETRY (cells that cannot be cut), INTERNAL. */
cli_exit cli_priority_cut(cli_job *j, cli_failure *why);

/** End a cut and set *cut to NULL. Collective, and harmless on NULL. */
void cli_cut_drop(cli_cut **cut);

/** How much of each cell of SOURCE's file is covered, [cells of rcgns_mesh]: of one that --priority cuts, its visible part
 *  counts. After cli_coverage_find. Collective. Errors: INTERNAL. */
cli_exit cli_source_share(cli_job *j, double *share, cli_failure *why);

/** The boundaries of one side, for the num_faces faces that it lends, block after block. Collective. Errors: IO, INTERNAL. */
cli_exit cli_side_boundaries(cli_job *j, remap_side side, rcgns_boundaries *out, int64_t *num_faces, cli_failure *why);

/** The cells of SOURCE's file in which the cells of a supermesh lie, [num_cells of the view] global numbers or -1. Collective,
 *  after the supermesh of ctx, whose ancestors are the cells that were lent. Errors: INTERNAL. */
cli_exit cli_source_ancestors(cli_job *j, const remap_supermesh_view *view, int64_t *ancestor, cli_failure *why);

/** How many cells of one side this rank lends to the library. Not collective. */
int64_t cli_num_cells(const cli_job *j, remap_side side);

/** Their global numbers, [cli_num_cells]. Owned by the job. Not collective. */
const int64_t *cli_cells(const cli_job *j, remap_side side);

/** An entry of an array of a mesh, which is there with 64 or with 32 bits. Not collective. */
static inline int64_t cli_entry(const int64_t *wide, const int32_t *narrow, int64_t i) { return wide ? wide[i] : narrow[i]; }

/** The meshes that are lent, one block after the other. Owned by the job. Not collective. */
const remap_mesh *cli_blocks(const cli_job *j, remap_side side, int *num_blocks);

/** Lend one side to the library, with the solver's volumes. Not collective. */
void cli_set_mesh(const cli_job *j, remap_context *ctx, remap_side side);

/** Give the library the masks, after remap_build. Collective. Errors: INTERNAL. */
cli_exit cli_masks_apply(cli_job *j, cli_failure *why);

/** How much of the cells is covered, after the masks: fills fraction and the coverage of the report. Collective.
 *  Errors: INTERNAL. */
cli_exit cli_coverage_find(cli_job *j, cli_failure *why);

/** After that: refuse masks that leave zones of SOURCE overlapping, and let what is covered too little count as uncovered.
 *  Collective. Errors: GEOMETRY, INTERNAL. */
cli_exit cli_masks_settle(cli_job *j, cli_failure *why);

/** Give the cells of TARGET that want nothing and have no old values the state of the first cell that wants: holes must hold
 *  something that a solver can read. With --on-uncovered fill=VALUE they get that. Collective. */
void cli_masks_fill(cli_job *j);

/** Is the result as good as it must be? What is to blame where a field is not conserved goes to the remarks too. Collective.
 *  Errors: VERIFY, INTERNAL. */
cli_exit cli_verify(cli_job *j, cli_failure *why);

/** What to look at where fields are not conserved or constants do not stay: the cell whose parts cancel most, to the remarks
 *  too, or what is said otherwise. words gets size characters at most. Collective, after remap_build. Errors: INTERNAL. */
cli_exit cli_blame(cli_job *j, const char *otherwise, char *words, size_t size, cli_failure *why);

/** Write the supermesh that was asked for, after remap_build: fills supermesh of the report. Collective. Errors: GEOMETRY, IO,
 *  INTERNAL. */
cli_exit cli_supermesh_write(cli_job *j, cli_failure *why);

/** remap --check: transfer known fields, put the figures into the report and, unless quiet, print them. After the masks.
 *  Collective. Errors: VERIFY (a figure fails), COVERAGE (the meshes do not meet), INTERNAL. */
cli_exit cli_check(cli_job *j, cli_failure *why);

/** A status of the library as an exit status; its message becomes ours, with the files' names where it has none. Not
 *  collective. */
cli_exit cli_from_remap(const cli_job *j, remap_status status, cli_failure *why);

#endif
