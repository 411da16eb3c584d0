/* The overlap zone against brute force over all cells of both meshes. */
#include "zone/zone.h"
#include "pairs.h"
#include "rt.h"

static void for_all_worlds(void (*check)(const pairs_world *w, const rm_zone *zone))
{
  for (int kind = 0; kind < pairs_num_kinds(); kind++)
    for (int deal = 0; deal < PAIRS_NUM_DEALS; deal++) {
      pairs_world    w;
      const rm_zone *zone = NULL;

      pairs_open(&w, (pairs_kind)kind, (tm_dealing)deal);
      RT_EQ(rm_zone_build(w.arena, &w.comm, w.mesh, &zone), REMAP_OK);
      check(&w, zone);
      pairs_close(&w);
    }
}

/* Boxes of all cells of one side on every rank. */
static int64_t gather_boxes(const pairs_world *w, int side, double (**box)[6])
{
  int64_t *offset = rm_arena_alloc(w->arena, w->comm.size + 1, sizeof *offset);
  void    *all    = NULL;

  RT_EQ(rm_comm_allgatherv(&w->comm, w->arena, w->mesh[side]->cell_box, w->mesh[side]->num_cells, sizeof **box, offset, &all),
        REMAP_OK);
  *box = all;
  return offset[w->comm.size];
}

static uint8_t *mark_listed(const pairs_world *w, const rm_zone *zone, int side)
{
  uint8_t *listed = rm_arena_zero(w->arena, w->mesh[side]->num_cells, sizeof *listed);

  for (rm_lid k = 0; k < zone->num_cells[side]; k++) listed[zone->cell[side][k]] = 1;
  return listed;
}

static void check_invariants(const pairs_world *w, const rm_zone *zone)
{
  RT_EQ(rm_zone_check(zone, w->mesh), REMAP_OK);
}

static void every_invariant_that_one_rank_sees_holds(void)
{
  for_all_worlds(check_invariants);
}

static void check_none_is_left_out(const pairs_world *w, const rm_zone *zone)
{
  for (int side = 0; side < 2; side++) {
    const uint8_t *listed = mark_listed(w, zone, side);
    double       (*box)[6];
    const int64_t  num = gather_boxes(w, 1 - side, &box);

    for (rm_lid c = 0; c < w->mesh[side]->num_cells; c++) {
      bool meets = false;

      for (int64_t i = 0; i < num && !meets; i++) meets = rm_box_meets(w->mesh[side]->cell_box[c], box[i]);
      RT_CHECK(listed[c] || !meets);
    }
  }
}

static void a_cell_that_meets_a_box_of_the_other_mesh_on_any_rank_is_listed(void)
{
  for_all_worlds(check_none_is_left_out);
}

static void check_far_cells(const pairs_world *w, const rm_zone *zone)
{
  for (int side = 0; side < 2; side++) {
    const uint8_t *listed = mark_listed(w, zone, side);
    double       (*box)[6], whole[6] = {HUGE_VAL, HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    const int64_t  num = gather_boxes(w, 1 - side, &box);

    for (int64_t i = 0; i < num; i++)
      for (int d = 0; d < 3; d++) {
        whole[d]     = fmin(whole[d], box[i][d]);
        whole[3 + d] = fmax(whole[3 + d], box[i][3 + d]);
      }
    for (rm_lid c = 0; c < w->mesh[side]->num_cells; c++)
      RT_CHECK(!listed[c] || rm_box_meets(w->mesh[side]->cell_box[c], whole));
  }
}

static void a_cell_outside_of_the_other_meshs_box_stays_home(void)
{
  for_all_worlds(check_far_cells);
}

static int64_t num_listed(const pairs_world *w, int side)
{
  const rm_zone *zone = NULL;
  int64_t        num;

  RT_EQ(rm_zone_build(w->arena, &w->comm, w->mesh, &zone), REMAP_OK);
  num = zone->num_cells[side];
  RT_EQ(rm_comm_sum_i64(&w->comm, &num, 1), REMAP_OK);
  return num;
}

static void grids_that_share_a_plane_list_one_layer_each(void)
{
  pairs_world w;

  pairs_open(&w, PAIRS_TOUCHING, TM_SLABS);
  RT_EQ(num_listed(&w, REMAP_SOURCE), 25);
  RT_EQ(num_listed(&w, REMAP_TARGET), 16);
  pairs_close(&w);
}

static void grids_apart_and_a_mesh_without_cells_list_nothing(void)
{
  static const pairs_kind kinds[2] = {PAIRS_APART, PAIRS_NO_SOURCE};

  for (int k = 0; k < 2; k++) {
    pairs_world w;

    pairs_open(&w, kinds[k], TM_RANDOM);
    RT_EQ(num_listed(&w, REMAP_SOURCE), 0);
    RT_EQ(num_listed(&w, REMAP_TARGET), 0);
    pairs_close(&w);
  }
}

static void the_check_sees_a_missing_cell_and_a_wrong_order(void)
{
  pairs_world    w;
  const rm_zone *zone = NULL;

  pairs_open(&w, PAIRS_SAME, TM_SLABS);
  RT_EQ(rm_zone_build(w.arena, &w.comm, w.mesh, &zone), REMAP_OK);
  if (zone->num_cells[REMAP_SOURCE] > 1) {
    rm_zone broken = *zone;
    rm_lid *cell   = rm_arena_alloc(w.arena, zone->num_cells[REMAP_SOURCE], sizeof *cell);

    broken.num_cells[REMAP_SOURCE]--;
    RT_EQ(rm_zone_check(&broken, w.mesh), REMAP_INTERNAL);
    broken = *zone;
    for (rm_lid k = 0; k < zone->num_cells[REMAP_SOURCE]; k++) cell[k] = zone->cell[REMAP_SOURCE][k];
    cell[0]                   = cell[1];
    cell[1]                   = zone->cell[REMAP_SOURCE][0];
    broken.cell[REMAP_SOURCE] = cell;
    RT_EQ(rm_zone_check(&broken, w.mesh), REMAP_INTERNAL);
  }
  pairs_close(&w);
}

static void all_ranks_fail_alike_when_one_is_out_of_memory(void)
{
  pairs_world w;

  pairs_open(&w, PAIRS_WARPED, TM_SLABS);
  for (int rank = 0; rank < w.comm.size; rank++) {
    remap_status status = REMAP_NO_MEMORY;
    int64_t      at     = 0;

    while (status != REMAP_OK && at < 100) {
      rm_arena      *arena = rm_arena_new();
      const rm_zone *zone  = NULL;

      at++;
      if (w.comm.rank == rank) rm_arena_fail_at(arena, at);
      status = rm_zone_build(arena, &w.comm, w.mesh, &zone);
      RT_EQ(status, zone ? REMAP_OK : REMAP_NO_MEMORY);
      rm_arena_drop(arena);
      if (!rt_all(RT_EQ(rm_comm_agree(&w.comm, status, NULL), status))) status = REMAP_OK;
    }
    RT_EQ(status, REMAP_OK);
    RT_CHECK(at > 1);
  }
  pairs_close(&w);
}

RT_MAIN(RT_CASE(every_invariant_that_one_rank_sees_holds),
        RT_CASE(a_cell_that_meets_a_box_of_the_other_mesh_on_any_rank_is_listed),
        RT_CASE(a_cell_outside_of_the_other_meshs_box_stays_home), RT_CASE(grids_that_share_a_plane_list_one_layer_each),
        RT_CASE(grids_apart_and_a_mesh_without_cells_list_nothing), RT_CASE(the_check_sees_a_missing_cell_and_a_wrong_order),
        RT_CASE(all_ranks_fail_alike_when_one_is_out_of_memory))
