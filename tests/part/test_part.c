/* What part hands to the overlay, against brute force over all cells of both meshes: small meshes of several kinds, handed in
 * in several ways. */
#include "part/part_private.h"
#include "pairs.h"
#include "rt.h"

#include <stdlib.h>
#include <string.h>

/* All cells of one mesh on every rank, rank after rank: cell c of rank r is number rank_offset[r] + c. */
typedef struct whole {
  int64_t  num_cells, *rank_offset;
  rm_gid  *global;
  double (*box)[6], *volume, (*centroid)[3];
} whole;

/* A pair of meshes, taken through zone and part. */
typedef struct world {
  pairs_world    in;
  const rm_zone *zone;
  const rm_part *part;
  whole          all[2];
} world;

static void *gather(const pairs_world *in, const void *mine, int64_t n, size_t size, int64_t *offset)
{
  void *all = NULL;

  RT_EQ(rm_comm_allgatherv(&in->comm, in->arena, mine, n, size, offset, &all), REMAP_OK);
  return all;
}

static void gather_whole(const pairs_world *in, const rm_mesh *mesh, whole *all)
{
  all->rank_offset = rm_arena_alloc(in->arena, in->comm.size + 1, sizeof *all->rank_offset);
  all->global      = gather(in, mesh->cell_global, mesh->num_cells, sizeof *mesh->cell_global, all->rank_offset);
  all->box         = gather(in, mesh->cell_box, mesh->num_cells, sizeof *mesh->cell_box, all->rank_offset);
  all->volume      = gather(in, mesh->cell_volume, mesh->num_cells, sizeof *mesh->cell_volume, all->rank_offset);
  all->centroid    = gather(in, mesh->cell_centroid, mesh->num_cells, sizeof *mesh->cell_centroid, all->rank_offset);
  all->num_cells   = all->rank_offset[in->comm.size];
}

static void open_world(world *w, int kind, int deal)
{
  rm_reason reason = {-1, -1, ""};

  memset(w, 0, sizeof *w);
  pairs_open(&w->in, (pairs_kind)kind, (tm_dealing)deal);
  RT_EQ(rm_zone_build(w->in.arena, &w->in.comm, w->in.mesh, &w->zone), REMAP_OK);
  RT_EQ(rm_part_build(w->in.arena, &w->in.comm, &w->in.frame, w->in.mesh, w->zone, &w->part, &reason), REMAP_OK);
  for (int side = 0; side < 2; side++) gather_whole(&w->in, w->in.mesh[side], &w->all[side]);
}

static void for_all_worlds(void (*check)(world *w))
{
  for (int kind = 0; kind < pairs_num_kinds(); kind++)
    for (int deal = 0; deal < PAIRS_NUM_DEALS; deal++) {
      world w;

      open_world(&w, kind, deal);
      check(&w);
      pairs_close(&w.in);
    }
}

/* Number among all cells of a cell of a piece. */
static int64_t whole_number(const whole *all, const rm_piece *p, rm_lid cell)
{
  return all->rank_offset[p->cell_home_rank[cell]] + p->cell_home[cell];
}

/* How often each of all cells is on some rank, summed over the ranks. */
static int64_t *count_copies(world *w, int side)
{
  const whole    *all    = &w->all[side];
  const rm_piece *p      = &w->part->piece[side];
  int64_t        *copies = rm_arena_zero(w->in.arena, all->num_cells, sizeof *copies);

  for (rm_lid c = 0; c < p->num_cells; c++) copies[whole_number(all, p, c)]++;
  RT_EQ(rm_comm_sum_i64(&w->in.comm, copies, (int)all->num_cells), REMAP_OK);
  return copies;
}

static void check_invariants(world *w)
{
  RT_EQ(rm_part_check(w->part), REMAP_OK);
}

static void every_invariant_holds(void)
{
  for_all_worlds(check_invariants);
}

static bool is_giant(const rm_piece *p, rm_lid cell)
{
  return (p->cell_role[cell] & RM_ROLE_GIANT) != 0;
}

static void check_targets(world *w)
{
  const whole    *all    = &w->all[REMAP_TARGET];
  const rm_piece *p      = &w->part->piece[REMAP_TARGET];
  const int64_t  *copies = count_copies(w, REMAP_TARGET);
  const rm_lid    here   = w->zone->num_cells[REMAP_TARGET];
  int64_t        *giant  = rm_arena_zero(w->in.arena, all->num_cells, sizeof *giant), num = here, found = 0;

  for (rm_lid c = 0; c < p->num_cells; c++) {
    giant[whole_number(all, p, c)] = is_giant(p, c);
    RT_CHECK(is_giant(p, c) || p->cell_role[c] == RM_ROLE_SEATED);
  }
  RT_EQ(rm_comm_max_i64(&w->in.comm, giant, (int)all->num_cells), REMAP_OK);
  RT_EQ(rm_comm_sum_i64(&w->in.comm, &num, 1), REMAP_OK);
  for (rm_lid k = 0; k < here; k++) {
    const int64_t i = all->rank_offset[w->in.comm.rank] + w->zone->cell[REMAP_TARGET][k];

    RT_CHECK(giant[i] || copies[i] == 1);
  }
  for (int64_t i = 0; i < all->num_cells; i++) found += giant[i] ? 1 : copies[i];
  RT_EQ(found, num);
}

static void every_target_of_the_zone_and_no_other_is_on_one_rank_or_a_giant(void)
{
  for_all_worlds(check_targets);
}

/* Every cell of a piece makes a pair there; and the ranks together make as many as there are. */
static void check_pairs(world *w)
{
  const whole    *src = &w->all[REMAP_SOURCE], *dst = &w->all[REMAP_TARGET];
  const rm_piece *src_piece = &w->part->piece[REMAP_SOURCE], *dst_piece = &w->part->piece[REMAP_TARGET];
  bool           *has_pair = rm_arena_zero(w->in.arena, dst_piece->num_cells, sizeof *has_pair);
  int64_t         num_pairs = 0, found = 0;

  for (int64_t i = 0; i < src->num_cells; i++)
    for (int64_t j = 0; j < dst->num_cells; j++) num_pairs += rm_box_meets(src->box[i], dst->box[j]);
  for (rm_lid i = 0; i < src_piece->num_cells; i++) {
    int64_t mine = 0;

    for (rm_lid j = 0; j < dst_piece->num_cells; j++)
      if (rm_box_meets(src->box[whole_number(src, src_piece, i)], dst->box[whole_number(dst, dst_piece, j)]) &&
          rm_part_makes_pair(w->part, i, j)) {
        mine++;
        has_pair[j] = true;
      }
    RT_CHECK(mine > 0); /* a source cell that meets no target here stays away */
    found += mine;
  }
  for (rm_lid j = 0; j < dst_piece->num_cells; j++) RT_CHECK(has_pair[j] || !is_giant(dst_piece, j));
  RT_EQ(rm_comm_sum_i64(&w->in.comm, &found, 1), REMAP_OK);
  RT_EQ(found, num_pairs);
}

static void every_pair_of_cells_with_meeting_boxes_is_made_on_one_rank(void)
{
  for_all_worlds(check_pairs);
}

static void check_homes(world *w)
{
  for (int side = 0; side < 2; side++) {
    const rm_piece *p   = &w->part->piece[side];
    const whole    *all = &w->all[side];

    for (rm_lid c = 0; c < p->num_cells; c++) {
      const int64_t i = whole_number(all, p, c);

      RT_EQ(p->cell_global[c], all->global[i]);
      RT_NEAR(p->cell_volume[c], all->volume[i], 0.0);
      for (int d = 0; d < 3; d++) RT_NEAR(p->cell_centroid[c][d], all->centroid[i][d], 0.0);
    }
  }
}

static void cells_carry_their_home_id_volume_and_centroid(void)
{
  for_all_worlds(check_homes);
}

/* Six times the volume between face f's triangles and the point o, along the loop. */
static double six_volumes_under(const rm_piece *p, rm_lid f, const double o[3])
{
  enum { MOST = 64 };
  const int n = (int)(p->face_offset[f + 1] - p->face_offset[f]);
  double    xyz[MOST][3], centre[3], sum = 0.0;
  int       corner[3 * (MOST + 2)], work[4 * MOST], num;

  if (!RT_CHECK(n <= MOST)) return 0.0;
  for (int i = 0; i < n; i++) memcpy(xyz[i], p->node_xyz[p->face_node[p->face_offset[f] + i]], sizeof xyz[i]);
  num = rm_triangulate((const double(*)[3])xyz, n, REMAP_FACES_CENTRE, corner, centre, work);
  for (int t = 0; t < num; t++) {
    const double *x[3];

    for (int k = 0; k < 3; k++) x[k] = corner[3 * t + k] == RM_CENTRE_POINT ? centre : xyz[corner[3 * t + k]];
    sum += rm_det_dd(o, x[0], x[1], x[2]).hi;
  }
  return sum;
}

/* Boxes and volumes from the faces: a face that is missing, doubled or wrong way round shows in them. */
static void check_geometry(world *w)
{
  for (int side = 0; side < 2; side++) {
    const rm_piece *p      = &w->part->piece[side];
    double         *volume = rm_arena_zero(w->in.arena, p->num_cells, sizeof *volume);
    double        (*box)[6] = rm_arena_alloc(w->in.arena, p->num_cells, sizeof *box);

    for (rm_lid c = 0; c < p->num_cells; c++)
      for (int d = 0; d < 3; d++) box[c][d] = HUGE_VAL, box[c][3 + d] = -HUGE_VAL;
    for (rm_lid f = 0; f < p->num_faces; f++)
      for (int k = 0; k < 2 && p->face_cell[f][k] >= 0; k++) {
        const rm_lid c = p->face_cell[f][k];

        volume[c] += (k == 0 ? 1.0 : -1.0) / 6.0 * six_volumes_under(p, f, p->cell_centroid[c]);
        for (int64_t i = p->face_offset[f]; i < p->face_offset[f + 1]; i++)
          for (int d = 0; d < 3; d++) {
            box[c][d]     = fmin(box[c][d], p->node_xyz[p->face_node[i]][d]);
            box[c][3 + d] = fmax(box[c][3 + d], p->node_xyz[p->face_node[i]][d]);
          }
      }
    for (rm_lid c = 0; c < p->num_cells; c++) {
      RT_NEAR(volume[c], p->cell_volume[c], 1e-13 * fabs(p->cell_volume[c]));
      for (int d = 0; d < 6; d++) RT_NEAR(box[c][d], w->all[side].box[whole_number(&w->all[side], p, c)][d], 0.0);
    }
  }
}

static void the_faces_of_every_cell_enclose_its_volume_and_point_outward(void)
{
  for_all_worlds(check_geometry);
}

/* Skin faces of the piece are as many as the shipped cells have in the mesh. */
static void check_skin(world *w)
{
  for (int side = 0; side < 2; side++) {
    const rm_mesh  *mesh = w->in.mesh[side];
    const rm_piece *p    = &w->part->piece[side];
    const int64_t  *copies = count_copies(w, side);
    int64_t         count[2] = {0, 0}; /* sent, received */

    for (rm_lid f = 0; f < mesh->num_faces; f++)
      if (mesh->face_is_skin[f]) count[0] += copies[w->all[side].rank_offset[w->in.comm.rank] + mesh->face_cell[f][0]];
    for (rm_lid f = 0; f < p->num_faces; f++) count[1] += p->face_is_skin[f];
    RT_EQ(rm_comm_sum_i64(&w->in.comm, count, 2), REMAP_OK);
    RT_EQ(count[1], count[0]);
  }
}

static void skin_stays_skin_and_cut_faces_do_not_become_it(void)
{
  for_all_worlds(check_skin);
}

/* Keys of the small targets here: *low..*high; none if *low > *high. */
static void key_range(world *w, uint64_t *low, uint64_t *high)
{
  const rm_piece *p = &w->part->piece[REMAP_TARGET];
  rm_frame        zone_frame;

  RT_EQ(rm_part_frame(&w->in.comm, &w->in.frame, w->in.mesh, w->zone, &zone_frame), REMAP_OK);
  *low  = UINT64_MAX;
  *high = 0;
  for (rm_lid c = 0; c < p->num_cells; c++) {
    const uint64_t key = rm_part_key(&zone_frame, w->all[REMAP_TARGET].box[whole_number(&w->all[REMAP_TARGET], p, c)]);

    if (is_giant(p, c)) continue;
    if (key < *low) *low = key;
    if (key > *high) *high = key;
  }
}

static void check_intervals(world *w)
{
  const int size  = w->in.comm.size;
  uint64_t  mine[2], *all = rm_arena_alloc(w->in.arena, 2 * size, sizeof *all);
  int       last = -1; /* rank below that has targets */

  key_range(w, &mine[0], &mine[1]);
  RT_EQ(rm_comm_allgather(&w->in.comm, mine, all, 2, sizeof *all), REMAP_OK);
  for (int r = 0; r < size; r++) {
    if (all[2 * r] > all[2 * r + 1]) continue;
    if (last >= 0) RT_CHECK(all[2 * last + 1] < all[2 * r]);
    last = r;
  }
}

static void the_small_targets_of_a_rank_are_an_interval_of_keys(void)
{
  for_all_worlds(check_intervals);
}

/* One cell around a grid: the grid's cells are shared out, and the one is wherever they are. */
static void the_partners_of_a_giant_stay_apart(void)
{
  for (int side = 0; side < 2; side++)
    for (int deal = 0; deal < PAIRS_NUM_DEALS; deal++) {
      world   w;
      int64_t most;

      open_world(&w, side ? PAIRS_COARSE_TARGET : PAIRS_COARSE_SOURCE, deal);
      most = w.part->piece[1 - side].num_cells;
      RT_EQ(w.part->piece[side].num_cells, most > 0 ? 1 : 0);
      if (most > 0) RT_CHECK(is_giant(&w.part->piece[side], 0) == (w.in.comm.size > 1));
      RT_EQ(rm_comm_max_i64(&w.in.comm, &most, 1), REMAP_OK);
      RT_CHECK(most <= w.all[1 - side].num_cells / w.in.comm.size + 2);
      pairs_close(&w.in);
    }
}

/* Pairs of cells on this rank whose boxes meet. */
static int64_t count_pairs(const world *w)
{
  const rm_piece *src_piece = &w->part->piece[REMAP_SOURCE], *dst_piece = &w->part->piece[REMAP_TARGET];
  const whole    *src = &w->all[REMAP_SOURCE], *dst = &w->all[REMAP_TARGET];
  int64_t         num = 0;

  for (rm_lid i = 0; i < src_piece->num_cells; i++)
    for (rm_lid j = 0; j < dst_piece->num_cells; j++)
      num += rm_box_meets(src->box[whole_number(src, src_piece, i)], dst->box[whole_number(dst, dst_piece, j)]);
  return num;
}

/* Pairs of the rank that has most of them over the mean. */
static double ratio_of_pairs(pairs_kind kind, tm_dealing deal)
{
  world   w;
  int64_t most, sum;

  open_world(&w, (int)kind, (int)deal);
  most = sum = count_pairs(&w);
  RT_EQ(rm_comm_max_i64(&w.in.comm, &most, 1), REMAP_OK);
  RT_EQ(rm_comm_sum_i64(&w.in.comm, &sum, 1), REMAP_OK);
  pairs_close(&w.in);
  return (double)most * rt_size() / (double)sum;
}

static void equal_grids_are_shared_out_evenly(void)
{
  for (int deal = 0; deal < PAIRS_NUM_DEALS; deal++) RT_CHECK(ratio_of_pairs(PAIRS_SAME, (tm_dealing)deal) <= 1.15);
}

static void pairs_are_shared_out_evenly_though_one_grid_is_refined_in_a_corner(void)
{
  RT_CHECK(ratio_of_pairs(PAIRS_GRADED, TM_SLABS) <= 1.3);
}

/* The rank of every target by its global id, which is dense in these meshes. */
static int64_t *rank_of_target(world *w)
{
  const rm_piece *p    = &w->part->piece[REMAP_TARGET];
  int64_t        *rank = rm_arena_zero(w->in.arena, w->all[REMAP_TARGET].num_cells, sizeof *rank);

  for (rm_lid c = 0; c < p->num_cells; c++) rank[p->cell_global[c]] = w->in.comm.rank + 1;
  RT_EQ(rm_comm_sum_i64(&w->in.comm, rank, (int)w->all[REMAP_TARGET].num_cells), REMAP_OK);
  return rank;
}

static void the_cut_does_not_depend_on_who_hands_in_what(void)
{
  for (int deal = 1; deal < PAIRS_NUM_DEALS; deal++) {
    world    w[2];
    int64_t *rank[2];

    for (int k = 0; k < 2; k++) {
      open_world(&w[k], PAIRS_SAME, k * deal);
      rank[k] = rank_of_target(&w[k]);
    }
    RT_EQ(w[0].all[REMAP_TARGET].num_cells, w[1].all[REMAP_TARGET].num_cells);
    for (int64_t i = 0; i < w[0].all[REMAP_TARGET].num_cells; i++) RT_EQ(rank[0][i], rank[1][i]);
    for (int k = 0; k < 2; k++) pairs_close(&w[k].in);
  }
}

/* Cells of the zone of both meshes, on all ranks, whose keys lie below. */
static int64_t cells_below(world *w, const rm_frame *zone_frame, uint64_t key)
{
  int64_t num = 0;

  for (int side = 0; side < 2; side++)
    for (rm_lid k = 0; k < w->zone->num_cells[side]; k++)
      num += rm_part_key(zone_frame, w->in.mesh[side]->cell_box[w->zone->cell[side][k]]) < key;
  RT_EQ(rm_comm_sum_i64(&w->in.comm, &num, 1), REMAP_OK);
  return num;
}

static void check_even_cuts(world *w)
{
  const rm_comm *comm = &w->in.comm;
  rm_cuts        cuts = {0};
  rm_frame       zone_frame;

  RT_EQ(rm_part_frame(comm, &w->in.frame, w->in.mesh, w->zone, &zone_frame), REMAP_OK);
  RT_EQ(rm_part_cut_evenly(w->in.arena, comm, &zone_frame, w->in.mesh, w->zone, &cuts), REMAP_OK);
  RT_EQ(cuts.num, comm->size - 1);
  const int64_t total = cells_below(w, &zone_frame, UINT64_MAX), slack = total / comm->size / 64;
  for (int i = 0; i < cuts.num; i++) {
    const int64_t goal = total * (i + 1) / comm->size, below = cells_below(w, &zone_frame, cuts.key[i]);

    RT_CHECK(i == 0 || cuts.key[i - 1] <= cuts.key[i]);
    RT_CHECK(below <= goal + slack);
    if (below < goal - slack) /* cells of one key stay together */
      RT_CHECK(cells_below(w, &zone_frame, cuts.key[i] + 1) > goal);
  }
}

static void cells_are_cut_into_even_numbers(void) { for_all_worlds(check_even_cuts); }

static void meshes_apart_leave_every_rank_with_empty_pieces(void)
{
  world w;

  open_world(&w, PAIRS_APART, 0);
  for (int side = 0; side < 2; side++) {
    RT_EQ(w.part->piece[side].num_cells, 0);
    RT_EQ(w.part->piece[side].num_faces, 0);
    RT_EQ(w.part->piece[side].num_nodes, 0);
    RT_EQ(w.part->piece[side].face_offset[0], 0);
  }
  pairs_close(&w.in);
}

/* A copy of the part whose source piece the caller may spoil. */
static rm_part copy_part(world *w, rm_lid **face_node, rm_lid (**face_cell)[2])
{
  rm_part   copy = *w->part;
  rm_piece *p    = &copy.piece[REMAP_SOURCE];

  *face_node = rm_arena_alloc(w->in.arena, p->face_offset[p->num_faces], sizeof **face_node);
  *face_cell = rm_arena_alloc(w->in.arena, p->num_faces, sizeof **face_cell);
  memcpy(*face_node, p->face_node, (size_t)p->face_offset[p->num_faces] * sizeof **face_node);
  memcpy(*face_cell, p->face_cell, (size_t)p->num_faces * sizeof **face_cell);
  p->face_node = *face_node;
  p->face_cell = (const rm_lid(*)[2]) * face_cell;
  return copy;
}

static void the_check_sees_a_face_that_is_turned_missing_or_beside_no_cell(void)
{
  world w;
  rm_lid *face_node, (*face_cell)[2], swap;
  rm_part copy;

  open_world(&w, PAIRS_SAME, 0);
  if (w.part->piece[REMAP_SOURCE].num_faces > 0) {
    copy         = copy_part(&w, &face_node, &face_cell);
    swap         = face_node[0];
    face_node[0] = face_node[2];
    face_node[2] = swap;
    RT_EQ(rm_part_check(&copy), REMAP_INTERNAL);

    copy = copy_part(&w, &face_node, &face_cell);
    copy.piece[REMAP_SOURCE].num_faces--;
    RT_EQ(rm_part_check(&copy), REMAP_INTERNAL);

    copy            = copy_part(&w, &face_node, &face_cell);
    face_cell[0][0] = -1;
    RT_EQ(rm_part_check(&copy), REMAP_INTERNAL);

    copy         = copy_part(&w, &face_node, &face_cell);
    face_node[0] = copy.piece[REMAP_SOURCE].num_nodes;
    RT_EQ(rm_part_check(&copy), REMAP_INTERNAL);
  }
  pairs_close(&w.in);
}

/* The stages, each with the arenas that a test may let fail. */
static remap_status run_build(world *w, rm_arena *arena)
{
  const rm_part *part = NULL;
  rm_reason      reason = {-1, -1, ""};

  return rm_part_build(arena, &w->in.comm, &w->in.frame, w->in.mesh, w->zone, &part, &reason);
}

static remap_status run_stages(world *w, rm_arena *arena)
{
  const rm_comm *comm   = &w->in.comm;
  rm_reason      reason = {-1, -1, ""};
  rm_routes      routes;
  rm_piece       piece;
  rm_cuts        cuts;
  rm_tags        tags, moved;
  rm_giants      giants;
  int64_t       *work[2];

  RM_TRY(rm_part_cut_evenly(arena, comm, &w->in.frame, w->in.mesh, w->zone, &cuts));
  RM_TRY(rm_part_send_tags(arena, comm, &w->in.frame, w->in.mesh, w->zone, &cuts, &tags, &reason));
  RM_TRY(rm_part_find_giants(arena, comm, &tags, &giants));
  RM_TRY(rm_part_weigh(arena, arena, comm, w->in.mesh, &tags, &giants, work));
  RM_TRY(rm_part_cut_work(arena, comm, &tags, work, &cuts));
  RM_TRY(rm_part_move_tags(arena, comm, &tags, &cuts, &moved, &reason));
  RM_TRY(rm_part_meet_giants(arena, arena, comm, &moved, &giants));
  RM_TRY(rm_part_match(arena, arena, comm, &cuts, &moved, &giants, &rm_one_block, &routes));
  return rm_part_ship(w->in.arena, arena, &w->in.comm, w->in.mesh[REMAP_SOURCE], &routes.of[REMAP_SOURCE], &piece,
                      &reason);
}

/* Let every allocation of one rank fail in turn until all are passed. */
static void fail_everywhere(remap_status (*run)(world *w, rm_arena *arena))
{
  world w;

  open_world(&w, PAIRS_PARTLY, 0);
  for (int rank = 0; rank < w.in.comm.size; rank++) {
    remap_status status = REMAP_NO_MEMORY;
    int64_t      at     = 0;

    while (status != REMAP_OK && at < 1000) {
      rm_arena *arena = rm_arena_new();

      at++;
      if (w.in.comm.rank == rank) rm_arena_fail_at(arena, at);
      status = run(&w, arena);
      RT_CHECK(status == REMAP_OK || status == REMAP_NO_MEMORY);
      rm_arena_drop(arena);
      if (!rt_all(RT_EQ(rm_comm_agree(&w.in.comm, status, NULL), status))) status = REMAP_OK;
    }
    RT_EQ(status, REMAP_OK);
    RT_CHECK(at > 10);
  }
  pairs_close(&w.in);
}

static void all_ranks_fail_alike_when_one_is_out_of_memory_for_the_product(void)
{
  fail_everywhere(run_build);
}

static void all_ranks_fail_alike_when_one_is_out_of_memory_on_the_way(void)
{
  fail_everywhere(run_stages);
}

RT_MAIN(RT_CASE(every_invariant_holds), RT_CASE(every_target_of_the_zone_and_no_other_is_on_one_rank_or_a_giant),
        RT_CASE(every_pair_of_cells_with_meeting_boxes_is_made_on_one_rank),
        RT_CASE(cells_carry_their_home_id_volume_and_centroid),
        RT_CASE(the_faces_of_every_cell_enclose_its_volume_and_point_outward),
        RT_CASE(skin_stays_skin_and_cut_faces_do_not_become_it), RT_CASE(the_small_targets_of_a_rank_are_an_interval_of_keys),
        RT_CASE(equal_grids_are_shared_out_evenly), RT_CASE(the_partners_of_a_giant_stay_apart),
        RT_CASE(pairs_are_shared_out_evenly_though_one_grid_is_refined_in_a_corner),
        RT_CASE(the_cut_does_not_depend_on_who_hands_in_what), RT_CASE(cells_are_cut_into_even_numbers),
        RT_CASE(meshes_apart_leave_every_rank_with_empty_pieces),
        RT_CASE(the_check_sees_a_face_that_is_turned_missing_or_beside_no_cell),
        RT_CASE(all_ranks_fail_alike_when_one_is_out_of_memory_for_the_product),
        RT_CASE(all_ranks_fail_alike_when_one_is_out_of_memory_on_the_way))
