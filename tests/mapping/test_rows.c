/* Rows of the mapping on meshes of boxes, whose overlaps are known in closed form. */
#include "boxes.h"
#include "mapping/mapping.h"

enum { SAME, SHIFTED, STICKS_OUT, NESTED, COARSE_SOURCE, COARSE_TARGET, APART, MIRRORED, NUM_KINDS };

static const boxes_shape unit = {{0, 0, 0}, {1, 1, 1}, 0};

static tm_mesh *make(int kind, int side)
{
  const bool source = side == REMAP_SOURCE;

  switch (kind) {
    case SHIFTED: return source ? boxes_grid(5, 4, 6, (boxes_shape){{0, 0, 0}, {1, 1, 1}, .5}) : boxes_grid(4, 7, 3, unit);
    case STICKS_OUT:
      return source ? boxes_grid(5, 5, 5, unit) : boxes_grid(4, 4, 4, (boxes_shape){{.3, .3, .3}, {1.3, 1.5, 1.1}, 0});
    case NESTED: return source ? boxes_grid(2, 2, 2, unit) : boxes_grid(6, 4, 2, unit);
    case COARSE_SOURCE:
      return source ? boxes_grid(1, 1, 1, (boxes_shape){{-1, -1, -1}, {2, 2, 2}, 0}) : boxes_grid(4, 4, 4, unit);
    case COARSE_TARGET:
      return source ? boxes_grid(4, 4, 4, unit) : boxes_grid(1, 1, 1, (boxes_shape){{-1, -1, -1}, {2, 2, 2}, 0});
    case APART: return source ? boxes_grid(3, 3, 3, unit) : boxes_grid(3, 3, 3, (boxes_shape){{2, 0, 0}, {3, 1, 1}, 0});
    case MIRRORED: return source ? boxes_grid(4, 5, 4, unit) : boxes_grid(5, 4, 3, (boxes_shape){{1, 0, 0}, {0, 1, 1}, 0});
    default: return boxes_grid(4, 4, 4, unit);
  }
}

static void for_all_worlds(void (*look)(boxes_world *w, int kind))
{
  for (int kind = 0; kind < NUM_KINDS; kind++)
    for (int deal = TM_SLABS; deal <= TM_LAST; deal++) {
      boxes_world w;

      boxes_open(&w, MPI_COMM_WORLD, make(kind, 0), make(kind, 1), (tm_dealing)deal);
      look(&w, kind);
      boxes_close(&w);
    }
}

static void look_at_invariants(boxes_world *w, int kind)
{
  (void)kind;
  RT_EQ(rm_mapping_check(w->mapping, w->mesh), REMAP_OK);
}
static void every_invariant_holds(void) { for_all_worlds(look_at_invariants); }

/* Volumes and moments of a row add up to those of its cell, whichever way. */
static void look_at_sums(boxes_world *w, int kind)
{
  (void)kind;
  for (int side = 0; side < 2; side++) {
    const rm_rows *rows = &w->mapping->rows[side];

    for (rm_lid c = 0; c < rows->num_cells; c++) {
      const double volume = w->mesh[side]->cell_volume[c];
      double       sum = 0.0, moment[3] = {0.0, 0.0, 0.0};

      if (rows->cover[c] != REMAP_COVERED) continue;
      for (int64_t k = rows->offset[c]; k < rows->offset[c + 1]; k++) {
        sum += rows->volume[k];
        for (int d = 0; d < 3; d++) moment[d] += rows->moment[k][d] + rows->giver_centroid[rows->giver[k]][d] * rows->volume[k];
      }
      RT_NEAR(fabs(sum), fabs(volume), 1e-13 * fabs(volume));
      for (int d = 0; d < 3; d++) RT_NEAR(moment[d] / sum, w->mesh[side]->cell_centroid[c][d], 1e-13);
    }
  }
}
static void rows_of_covered_cells_add_up_to_the_cell(void) { for_all_worlds(look_at_sums); }

static void look_at_counts(boxes_world *w, int kind)
{
  static const int64_t pairs[NUM_KINDS] = {[SAME] = 64, [NESTED] = 48, [COARSE_SOURCE] = 64, [COARSE_TARGET] = 64};
  const rm_mapping    *m                = w->mapping;
  int64_t              num[2];

  if (pairs[kind] > 0) RT_EQ(m->num_pairs, pairs[kind]);
  for (int side = 0; side < 2; side++) num[side] = m->rows[side].offset[m->rows[side].num_cells];
  RT_EQ(rm_comm_sum_i64(&w->comm, num, 2), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    RT_EQ(num[side], m->num_pairs);
    RT_EQ(m->cells_by_cover[side][0] + m->cells_by_cover[side][1] + m->cells_by_cover[side][2],
          w->mesh[side]->num_global_cells);
  }
  if (kind == STICKS_OUT) {
    RT_CHECK(m->cells_by_cover[REMAP_TARGET][REMAP_COVERED] > 0 && m->cells_by_cover[REMAP_TARGET][REMAP_PARTIAL] > 0);
    RT_CHECK(m->cells_by_cover[REMAP_TARGET][REMAP_UNCOVERED] > 0 && m->cells_by_cover[REMAP_SOURCE][REMAP_UNCOVERED] > 0);
  }
  if (kind == APART) {
    RT_EQ(m->num_pairs, 0);
    RT_EQ(m->worst_closure_cell[0], -1);
    RT_NEAR(m->overlap_volume, 0.0, 0.0);
  }
}
static void both_ways_hold_the_same_pairs_and_every_cell_has_a_cover(void) { for_all_worlds(look_at_counts); }

static void look_at_same(boxes_world *w, int kind)
{
  for (int side = 0; side < 2; side++) {
    const rm_rows *rows = &w->mapping->rows[side];

    for (rm_lid c = 0; c < rows->num_cells; c++) RT_EQ(rows->same[c], kind == SAME);
    if (kind == SAME)
      for (rm_lid c = 0; c < rows->num_cells; c++) RT_EQ(rows->giver_global[rows->giver[c]], w->mesh[side]->cell_global[c]);
  }
}
static void pairs_are_the_same_on_identical_meshes_only(void) { for_all_worlds(look_at_same); }

/* One target inside of one source cell: alone in both rows, but the source cell is not covered. */
static void a_cell_inside_of_another_is_not_the_same(void)
{
  boxes_world w;

  boxes_open(&w, MPI_COMM_WORLD, boxes_grid(1, 1, 1, unit), boxes_grid(1, 1, 1, (boxes_shape){{.1, .1, .1}, {.9, .9, .9}, 0}),
             TM_SLABS);
  RT_EQ(w.mapping->num_pairs, 1);
  RT_EQ(w.mapping->cells_by_cover[REMAP_SOURCE][REMAP_PARTIAL], 1);
  RT_EQ(w.mapping->cells_by_cover[REMAP_TARGET][REMAP_COVERED], 1);
  for (int side = 0; side < 2; side++)
    for (rm_lid c = 0; c < w.mapping->rows[side].num_cells; c++) RT_EQ(w.mapping->rows[side].same[c], 0);
  boxes_close(&w);
}

static void look_at_plans(boxes_world *w, int kind)
{
  (void)kind;
  for (int side = 0; side < 2; side++) {
    const rm_rows *rows   = &w->mapping->rows[side];
    rm_gid        *got    = rm_arena_alloc(w->arena, rows->num_givers, sizeof *got);
    rm_gid        *buffer = rm_arena_alloc(w->arena, rows->plan->send_offset[rows->plan->num_send], sizeof *buffer);

    RT_EQ(rm_plan_run(&w->comm, rows->plan, sizeof *got, w->mesh[1 - side]->cell_global, got, buffer), REMAP_OK);
    for (rm_lid g = 0; g < rows->num_givers; g++) RT_EQ(got[g], rows->giver_global[g]);
  }
}
static void the_plan_brings_the_givers_listed(void) { for_all_worlds(look_at_plans); }

/* A row, held against the one that one rank alone makes. */
static bool same_row(const rm_rows *rows, rm_lid cell, const rm_rows *alone, rm_lid other)
{
  const int64_t n = rows->offset[cell + 1] - rows->offset[cell];

  if (rows->cover[cell] != alone->cover[other] || rows->same[cell] != alone->same[other]) return false;
  if (n != alone->offset[other + 1] - alone->offset[other]) return false;
  for (int64_t i = 0; i < n; i++) {
    const int64_t k = rows->offset[cell] + i, l = alone->offset[other] + i;

    if (rows->giver_global[rows->giver[k]] != alone->giver_global[alone->giver[l]]) return false;
    if (!boxes_same_bits(&rows->volume[k], &alone->volume[l], sizeof(double))) return false;
    if (!boxes_same_bits(rows->moment[k], alone->moment[l], 3 * sizeof(double))) return false;
  }
  return true;
}
static void look_at_bits(boxes_world *w, int kind)
{
  const rm_mapping *m = w->mapping;
  boxes_world       alone;

  boxes_open(&alone, MPI_COMM_SELF, make(kind, 0), make(kind, 1), TM_SLABS);
  for (int side = 0; side < 2; side++) {
    for (rm_lid c = 0; c < m->rows[side].num_cells; c++) {
      const rm_lid other = boxes_find(alone.mesh[side], w->mesh[side]->cell_global[c]);

      RT_CHECK(same_row(&m->rows[side], c, &alone.mapping->rows[side], other));
    }
    RT_EQ(m->worst_closure_cell[side], alone.mapping->worst_closure_cell[side]);
    RT_NEAR(m->max_closure_error[side], alone.mapping->max_closure_error[side], 0.0);
  }
  RT_NEAR(m->overlap_volume, alone.mapping->overlap_volume, 0.0);
  boxes_close(&alone);
}
static void rows_are_those_of_one_rank_bit_by_bit(void) { for_all_worlds(look_at_bits); }

/* The last rank's n-th allocation fails, for every n there is: all ranks say so, and none waits for another. */
static void memory_that_runs_out_on_one_rank_fails_on_all(void)
{
  boxes_world  w;
  remap_status status = REMAP_NO_MEMORY;
  int          n      = 0;

  boxes_open(&w, MPI_COMM_WORLD, make(STICKS_OUT, 0), make(STICKS_OUT, 1), TM_SLABS);
  while (status == REMAP_NO_MEMORY && n < 100) {
    rm_arena         *arena = rm_arena_new();
    const rm_mapping *mapping;
    rm_reason         reason = {-1, -1, ""};

    n++;
    if (rt_rank() == rt_size() - 1) rm_arena_fail_at(arena, n);
    status = rm_mapping_build(arena, &w.comm, &w.frame, w.mesh, &w.part, &w.moments, &mapping, &reason);
    if (!rt_all(RT_CHECK(status == REMAP_NO_MEMORY || status == REMAP_OK))) n = 100;
    rm_arena_drop(arena);
  }
  RT_EQ(status, REMAP_OK);
  RT_CHECK(n > 20);
  boxes_close(&w);
}

RT_MAIN(RT_CASE(every_invariant_holds), RT_CASE(rows_of_covered_cells_add_up_to_the_cell),
        RT_CASE(both_ways_hold_the_same_pairs_and_every_cell_has_a_cover), RT_CASE(pairs_are_the_same_on_identical_meshes_only),
        RT_CASE(a_cell_inside_of_another_is_not_the_same), RT_CASE(the_plan_brings_the_givers_listed),
        RT_CASE(rows_are_those_of_one_rank_bit_by_bit), RT_CASE(memory_that_runs_out_on_one_rank_fails_on_all))
