/* What cells get that the other mesh covers in part or not at all, and what is refused. */
#include "boxes.h"
#include "field/field.h"

static const boxes_shape unit = {{0, 0, 0}, {1, 1, 1}, 0};

/* Six layers of cells of size 0.5 along x, and a source that ends somewhere in them. */
static tm_mesh *long_target(void) { return boxes_grid(6, 2, 2, (boxes_shape){{0, 0, 0}, {3, 1, 1}, 0}); }
static tm_mesh *source_up_to(double x) { return boxes_grid(4, 3, 3, (boxes_shape){{0, 0, 0}, {x, 1, 1}, 0}); }

typedef struct job {
  boxes_world        w;
  remap_transfer     how;
  remap_field_desc   field;
  remap_field_report report;
  rm_reason          reason;
  double            *in, *out;
} job;

static void open_job(job *j, tm_mesh *source, tm_mesh *target, tm_dealing deal)
{
  memset(j, 0, sizeof *j);
  boxes_open(&j->w, MPI_COMM_WORLD, source, target, deal);
  j->how    = (remap_transfer){.order = 2, .limiter = REMAP_LIMITER_NONE, .fill_value = -7.0};
  j->in     = rm_arena_alloc(j->w.arena, j->w.mesh[0]->num_cells, sizeof *j->in);
  j->out    = rm_arena_alloc(j->w.arena, j->w.mesh[1]->num_cells, sizeof *j->out);
  j->field  = (remap_field_desc){.name = "rho", .nature = REMAP_CONSERVED, .has_old = 1, .in = j->in, .out = j->out};
  j->reason = (rm_reason){-1, -1, ""};
  for (rm_lid c = 0; c < j->w.mesh[0]->num_cells; c++) j->in[c] = 2.0;
  for (rm_lid c = 0; c < j->w.mesh[1]->num_cells; c++) j->out[c] = 10.0;
}

static remap_status run(job *j)
{
  const rm_transfer_setup setup  = boxes_setup(&j->w, REMAP_FORWARD);
  rm_arena               *arena  = rm_arena_new();
  const remap_status      status = boxes_transfer(arena, &setup, &j->how, 1, &j->field, &j->report, &j->reason);

  rm_arena_drop(arena);
  return status;
}

/* Layer of a cell of the long target. */
static int layer(const job *j, rm_lid cell) { return (int)(j->w.mesh[1]->cell_centroid[cell][0] / j->w.frame.scale / 0.5); }

/* out is want[layer] in every cell. */
static void check_layers(const job *j, const double want[6])
{
  for (rm_lid c = 0; c < j->w.mesh[1]->num_cells; c++) RT_NEAR(j->out[c], want[layer(j, c)], 1e-13);
}

static void uncovered_cells_keep_what_they_had(void)
{
  job j;

  open_job(&j, source_up_to(1.0), long_target(), TM_RANDOM);
  RT_EQ(run(&j), REMAP_OK);
  check_layers(&j, (double[]){2, 2, 10, 10, 10, 10});
  RT_NEAR(j.report.conservation_error, 0.0, 1e-14);
  RT_NEAR(j.report.target_integral / pow(j.w.frame.scale, 3), 2.0, 1e-14);
  boxes_close(&j.w);
}

static void uncovered_cells_are_filled(void)
{
  job j;

  open_job(&j, source_up_to(1.0), long_target(), TM_RANDOM);
  j.how.on_uncovered = REMAP_UNCOVERED_FILL;
  RT_EQ(run(&j), REMAP_OK);
  check_layers(&j, (double[]){2, 2, -7, -7, -7, -7});
  j.how.fill_value = NAN;
  RT_EQ(run(&j), REMAP_OK);
  for (rm_lid c = 0; c < j.w.mesh[1]->num_cells; c++) RT_CHECK((isnan(j.out[c]) != 0) == (layer(&j, c) > 1));
  RT_NEAR(j.report.target_max, 2.0, 1e-13);
  boxes_close(&j.w);
}

/* A partly covered layer: cells of volume 0.125, covered up to 1.1, that is a fifth. */
static void partly_covered_cells_follow_the_policy(void)
{
  static const double third[4] = {0.2 * 2 + 0.8 * 10, 2, 0.2 * 2, 2}; /* blend, normalise, conserve, blend without old values */

  for (int p = 0; p < 4; p++) {
    job j;

    open_job(&j, source_up_to(1.1), long_target(), TM_SLABS);
    j.how.on_partial = p < 3 ? (remap_on_partial)p : REMAP_PARTIAL_BLEND;
    j.field.has_old  = p < 3;
    if (p == 3) j.how.on_uncovered = REMAP_UNCOVERED_FILL;
    RT_EQ(run(&j), REMAP_OK);
    check_layers(&j, (double[]){2, 2, third[p], p < 3 ? 10 : -7, p < 3 ? 10 : -7, p < 3 ? 10 : -7});
    RT_NEAR(j.report.conservation_error, 0.0, 1e-14);
    boxes_close(&j.w);
  }
}

/* Blending keeps the total: what the source brings and what the uncovered part held. */
static void blending_conserves_the_sum_of_both(void)
{
  job    j;
  double sum[2] = {0.0, 0.0};

  open_job(&j, source_up_to(1.3), long_target(), TM_RANDOM);
  for (rm_lid c = 0; c < j.w.mesh[0]->num_cells; c++) {
    j.in[c] = 1.0 + (double)(j.w.mesh[0]->cell_global[c] % 7);
    sum[0] += j.in[c] * j.w.mesh[0]->cell_volume[c];
  }
  RT_EQ(run(&j), REMAP_OK);
  for (rm_lid c = 0; c < j.w.mesh[1]->num_cells; c++) {
    const double covered = fmin(fmax(1.3 - 0.5 * layer(&j, c), 0.0) / 0.5, 1.0);

    sum[1] += (j.out[c] - 10.0 * (1.0 - covered)) * j.w.mesh[1]->cell_volume[c];
  }
  MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  RT_NEAR(sum[1], sum[0], 1e-14);
  RT_NEAR(j.report.conservation_error, 0.0, 1e-14);
  boxes_close(&j.w);
}

/* Error policies: the same status and text everywhere, and nothing is written. */
static void coverage_errors_reach_every_rank_and_write_nothing(void)
{
  for (int partial = 0; partial < 2; partial++) {
    job j;

    open_job(&j, source_up_to(partial ? 2.9 : 1.0), long_target(), TM_LAST);
    if (partial)
      j.how.on_partial = REMAP_PARTIAL_ERROR;
    else
      j.how.on_uncovered = REMAP_UNCOVERED_ERROR;
    RT_EQ(run(&j), REMAP_COVERAGE);
    RT_EQ(j.reason.side, REMAP_TARGET);
    RT_CHECK(j.reason.global_cell >= 0 && strstr(j.reason.text, "outside") != NULL);
    for (rm_lid c = 0; c < j.w.mesh[1]->num_cells; c++) RT_NEAR(j.out[c], 10.0, 0.0);
    boxes_close(&j.w);
  }
}

static void covered_meshes_pass_the_error_policies(void)
{
  job j;

  open_job(&j, source_up_to(3.0), long_target(), TM_SLABS);
  j.how.on_partial   = REMAP_PARTIAL_ERROR;
  j.how.on_uncovered = REMAP_UNCOVERED_ERROR;
  RT_EQ(run(&j), REMAP_OK);
  check_layers(&j, (double[]){2, 2, 2, 2, 2, 2});
  boxes_close(&j.w);
}

/* Values that differ from cell to cell, so that it shows which one was taken: the mapped cell of the same row. */
static void nearest_takes_the_mapped_cell_of_least_distance(void)
{
  for (int deal = TM_SLABS; deal <= TM_LAST; deal++) {
    job j;

    open_job(&j, source_up_to(1.0), long_target(), (tm_dealing)deal);
    j.how.on_uncovered = REMAP_UNCOVERED_NEAREST;
    for (rm_lid c = 0; c < j.w.mesh[0]->num_cells; c++) {
      const double *x = j.w.mesh[0]->cell_centroid[c];

      j.in[c] = (x[0] + 10.0 * x[1] + 100.0 * x[2]) / j.w.frame.scale;
    }
    RT_EQ(run(&j), REMAP_OK);
    for (rm_lid c = 0; c < j.w.mesh[1]->num_cells; c++) {
      const double *x = j.w.mesh[1]->cell_centroid[c];
      const double  y = x[1] / j.w.frame.scale, z = x[2] / j.w.frame.scale;

      RT_NEAR(j.out[c], fmin(x[0] / j.w.frame.scale, 0.75) + 10.0 * y + 100.0 * z, 1e-12);
    }
    boxes_close(&j.w);
  }
}

/* Two grids in one target, the second far from the source and joined to nothing: distance alone decides. */
static void nearest_reaches_parts_of_the_mesh_that_touch_no_mapped_cell(void)
{
  for (int deal = TM_SLABS; deal <= TM_LAST; deal++) {
    job j;

    open_job(&j, source_up_to(1.0), tm_join(long_target(), boxes_grid(3, 2, 2, (boxes_shape){{0, 3, 0}, {1.5, 4, 1}, 0})),
             (tm_dealing)deal);
    j.how.on_uncovered = REMAP_UNCOVERED_KEEP;
    j.field.has_old    = 0;
    for (rm_lid c = 0; c < j.w.mesh[0]->num_cells; c++) {
      const double *x = j.w.mesh[0]->cell_centroid[c];

      j.in[c] = (x[0] + 10.0 * x[1] + 100.0 * x[2]) / j.w.frame.scale;
    }
    RT_EQ(run(&j), REMAP_OK);
    for (rm_lid c = 0; c < j.w.mesh[1]->num_cells; c++) {
      const double *x = j.w.mesh[1]->cell_centroid[c];
      const double  y = fmin(x[1] / j.w.frame.scale, 0.75), z = x[2] / j.w.frame.scale;

      RT_NEAR(j.out[c], fmin(x[0] / j.w.frame.scale, 0.75) + 10.0 * y + 100.0 * z, 1e-12);
    }
    boxes_close(&j.w);
  }
}

/* Many mapped cells and many that search: against all distances, one by one. */
static void the_search_finds_what_brute_force_finds(void)
{
  job            j;
  boxes_cell_   *cell;
  int64_t        num;
  const uint8_t *cover;

  open_job(&j, boxes_grid(3, 3, 3, unit),
           tm_join(boxes_grid(9, 8, 7, (boxes_shape){{0, 0, 0}, {1, 1, 1}, .5}),
                   boxes_grid(7, 6, 5, (boxes_shape){{1.5, -1, 0.2}, {2.5, 1.5, 1.2}, .3})),
           TM_RANDOM);
  j.how.on_uncovered = REMAP_UNCOVERED_NEAREST;
  j.how.order        = 1;
  for (rm_lid c = 0; c < j.w.mesh[0]->num_cells; c++) j.in[c] = (double)j.w.mesh[0]->cell_global[c];
  RT_EQ(run(&j), REMAP_OK);
  cover = j.w.mapping->rows[1].cover;
  cell  = boxes_gather_(&j.w, j.w.mesh[1], &num);
  for (rm_lid c = 0; c < j.w.mesh[1]->num_cells; c++) {
    const double *x        = j.w.mesh[1]->cell_centroid[c];
    double        smallest = INFINITY, sum = 0.0;
    int64_t       best = -1;

    if (cover[c] != REMAP_UNCOVERED) continue;
    for (int64_t k = 0; k < num; k++) { /* mapped cells come first in the join, within the source's box */
      const double dx = cell[k].centroid[0] - x[0], dy = cell[k].centroid[1] - x[1], dz = cell[k].centroid[2] - x[2];

      if (cell[k].global >= 9 * 8 * 7 || dx * dx + dy * dy + dz * dz >= smallest) continue;
      smallest = dx * dx + dy * dy + dz * dz;
      best     = k;
    }
    if (!RT_CHECK(best >= 0)) continue;
    for (int i = 0; i < 27; i++) { /* order 1: what the best cell got from the source */
      double part = cell[best].volume > 0.0 ? 1.0 / cell[best].volume : 0.0;

      for (int d = 0; d < 3; d++) {
        const int    at  = d == 0 ? i % 3 : d == 1 ? i / 3 % 3 : i / 9;
        const double low = at / 3.0 * j.w.frame.scale, high = (at + 1) / 3.0 * j.w.frame.scale;

        part *= fmax(0.0, fmin(high, cell[best].box[d + 3]) - fmax(low, cell[best].box[d]));
      }
      sum += part * i;
    }
    RT_NEAR(j.out[c], sum, 1e-12);
  }
  boxes_close(&j.w);
}

static void meshes_that_do_not_meet_have_no_nearest_cell(void)
{
  job j;

  open_job(&j, boxes_grid(3, 3, 3, unit), boxes_grid(3, 3, 3, (boxes_shape){{2, 0, 0}, {3, 1, 1}, 0}), TM_SLABS);
  RT_EQ(run(&j), REMAP_OK); /* they keep what they had */
  for (rm_lid c = 0; c < j.w.mesh[1]->num_cells; c++) RT_NEAR(j.out[c], 10.0, 0.0);
  RT_NEAR(j.report.conservation_error, 0.0, 0.0);
  j.field.has_old = 0;
  RT_EQ(run(&j), REMAP_COVERAGE);
  RT_CHECK(strstr(j.reason.text, "no cell meets") != NULL);
  boxes_close(&j.w);
}

static void flags_come_from_the_largest_overlap(void)
{
  job j;

  open_job(&j, source_up_to(1.1), long_target(), TM_RANDOM); /* source layers end at 0.275, 0.55, 0.825, 1.1 */
  j.field.nature = REMAP_FLAG;
  for (rm_lid c = 0; c < j.w.mesh[0]->num_cells; c++)
    j.in[c] = 10.0 + floor(j.w.mesh[0]->cell_centroid[c][0] / j.w.frame.scale / 0.275);
  RT_EQ(run(&j), REMAP_OK);
  for (rm_lid c = 0; c < j.w.mesh[1]->num_cells; c++)
    RT_NEAR(j.out[c], ((double[]){10, 12, 13, 10, 10, 10})[layer(&j, c)], 0.0); /* the covered part wins */
  RT_EQ(j.report.order, 1);
  boxes_close(&j.w);
}

static void values_that_are_not_finite_are_refused_on_every_rank_by_name_and_cell(void)
{
  static const double bad[2] = {NAN, INFINITY};

  for (int b = 0; b < 2; b++) {
    job    j;
    rm_lid cell;

    open_job(&j, source_up_to(1.0), long_target(), TM_RANDOM);
    cell = boxes_find(j.w.mesh[0], 17);
    if (cell >= 0) j.in[cell] = bad[b];
    RT_EQ(run(&j), REMAP_BAD_VALUE);
    RT_EQ(j.reason.side, REMAP_SOURCE);
    RT_EQ(j.reason.global_cell, 17);
    RT_CHECK(strstr(j.reason.text, "rho") != NULL);
    for (rm_lid c = 0; c < j.w.mesh[1]->num_cells; c++) RT_NEAR(j.out[c], 10.0, 0.0);
    boxes_close(&j.w);
  }
}

static void old_values_are_checked_where_they_are_kept_and_nowhere_else(void)
{
  for (int kept = 0; kept < 2; kept++) {
    job j;

    open_job(&j, source_up_to(1.1), long_target(), TM_RANDOM);
    for (rm_lid c = 0; c < j.w.mesh[1]->num_cells; c++)
      if (layer(&j, c) == (kept ? 2 : 0)) j.out[c] = NAN;
    RT_EQ(run(&j), kept ? REMAP_BAD_VALUE : REMAP_OK);
    if (kept) RT_EQ(j.reason.side, REMAP_TARGET);
    boxes_close(&j.w);
  }
}

/* As many overlaps count against a cell as for it, as where a mesh is tangled: the volumes cancel, yet a value comes out,
 * within those given. */
static void volumes_that_cancel_leave_finite_values(void)
{
  job               j;
  double           *volume, (*moment)[3];
  uint8_t          *flags;
  rm_moments        moments;
  const rm_mapping *mapping;

  open_job(&j, boxes_grid(12, 1, 1, (boxes_shape){{0, 0, 0}, {3, 1, 1}, 0}), long_target(), TM_SLABS);
  moments = j.w.moments;
  volume  = rm_arena_alloc(j.w.arena, moments.num_pairs, sizeof *volume);
  moment  = rm_arena_alloc(j.w.arena, moments.num_pairs, sizeof *moment);
  flags   = rm_arena_alloc(j.w.arena, moments.num_pairs, sizeof *flags);
  for (int64_t k = 0; k < moments.num_pairs; k++) {
    const double sign = j.w.part.piece[0].cell_global[moments.source[k]] % 2 ? -1.0 : 1.0;

    volume[k] = sign * moments.volume[k];
    for (int d = 0; d < 3; d++) moment[k][d] = sign * moments.moment[k][d];
    flags[k] = RM_PAIR_SOURCE_SKIN | RM_PAIR_TARGET_SKIN;
  }
  moments.volume = volume;
  moments.moment = (const double(*)[3])moment;
  moments.flags  = flags;
  RT_EQ(rm_mapping_build(j.w.arena, &j.w.comm, &j.w.frame, j.w.mesh, &j.w.part, &moments, &mapping, &j.reason), REMAP_OK);
  j.w.mapping = mapping;
  for (rm_lid c = 0; c < j.w.mesh[0]->num_cells; c++) j.in[c] = (double)j.w.mesh[0]->cell_global[c];
  j.how.on_partial = REMAP_PARTIAL_NORMALISE;
  RT_EQ(run(&j), REMAP_OK);
  for (rm_lid c = 0; c < j.w.mesh[1]->num_cells; c++) RT_NEAR(j.out[c], 2.0 * layer(&j, c) + 0.5, 1e-13);
  boxes_close(&j.w);
}

/* The last rank's n-th allocation fails, for every n there is: all ranks say so, none waits for another, nothing is written. */
static void memory_that_runs_out_on_one_rank_fails_on_all(void)
{
  job          j;
  remap_status status = REMAP_NO_MEMORY;
  int          n      = 0;

  open_job(&j, source_up_to(1.1), long_target(), TM_SLABS);
  j.how.on_uncovered = REMAP_UNCOVERED_NEAREST;
  while (status == REMAP_NO_MEMORY && n < 100) {
    const boxes_world      *w     = &j.w;
    const rm_transfer_setup setup = boxes_setup(w, REMAP_FORWARD);
    rm_arena               *arena = rm_arena_new();
    const rm_stencil       *stencil = NULL;

    n++;
    if (rt_rank() == rt_size() - 1) rm_arena_fail_at(arena, n);
    status = rm_stencil_build(arena, &w->comm, &w->frame, w->mesh[0], NULL, &stencil);
    if (status == REMAP_OK) status = rm_comm_agree(&w->comm, rm_stencil_weigh(arena, w->mesh[0], stencil, &stencil), NULL);
    if (status == REMAP_OK) status = boxes_transfer(arena, &setup, &j.how, 1, &j.field, &j.report, &j.reason);
    if (!rt_all(RT_CHECK(status == REMAP_NO_MEMORY || status == REMAP_OK))) n = 100;
    if (status != REMAP_OK)
      for (rm_lid c = 0; c < w->mesh[1]->num_cells; c++) RT_NEAR(j.out[c], 10.0, 0.0);
    rm_arena_drop(arena);
  }
  RT_EQ(status, REMAP_OK);
  RT_CHECK(n > 20);
  boxes_close(&j.w);
}

RT_MAIN(RT_CASE(uncovered_cells_keep_what_they_had), RT_CASE(uncovered_cells_are_filled),
        RT_CASE(partly_covered_cells_follow_the_policy), RT_CASE(blending_conserves_the_sum_of_both),
        RT_CASE(coverage_errors_reach_every_rank_and_write_nothing), RT_CASE(covered_meshes_pass_the_error_policies),
        RT_CASE(nearest_takes_the_mapped_cell_of_least_distance),
        RT_CASE(nearest_reaches_parts_of_the_mesh_that_touch_no_mapped_cell), RT_CASE(the_search_finds_what_brute_force_finds),
        RT_CASE(meshes_that_do_not_meet_have_no_nearest_cell), RT_CASE(flags_come_from_the_largest_overlap),
        RT_CASE(values_that_are_not_finite_are_refused_on_every_rank_by_name_and_cell),
        RT_CASE(old_values_are_checked_where_they_are_kept_and_nowhere_else), RT_CASE(volumes_that_cancel_leave_finite_values),
        RT_CASE(memory_that_runs_out_on_one_rank_fails_on_all))
