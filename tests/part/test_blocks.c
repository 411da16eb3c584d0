/* Blocks of a rank's interval against brute force over all cells of both meshes: small meshes of several kinds, handed in in
 * several ways. */
#include "part/part_private.h"
#include "pairs.h"
#include "rt.h"

/* A pair of meshes and the routes between them, cut finely. */
typedef struct world {
  pairs_world      in;
  const rm_zone   *zone;
  const rm_routes *routes;
  const rm_stock  *stock[2];
  rm_reason        reason;
} world;

static void open_world(world *w, int kind, int deal, rm_slicing slicing)
{
  *w = (world){.reason = {-1, -1, ""}};
  pairs_open(&w->in, (pairs_kind)kind, (tm_dealing)deal);
  RT_EQ(rm_zone_build(w->in.arena, &w->in.comm, w->in.mesh, &w->zone), REMAP_OK);
  RT_EQ(rm_part_plan(w->in.arena, &w->in.comm, &w->in.frame, w->in.mesh, w->zone, &slicing, &w->routes, &w->reason), REMAP_OK);
  for (int side = 0; side < 2; side++)
    RT_EQ(rm_part_send(w->in.arena, &w->in.comm, w->in.mesh[side], w->routes, &w->stock[side], &w->reason), REMAP_OK);
}

static void for_all_worlds(void (*check)(world *w))
{
  for (int kind = 0; kind < pairs_num_kinds(); kind++) {
    world w;

    open_world(&w, kind, kind % PAIRS_NUM_DEALS, (rm_slicing){.triangles = 100, .repeats = INFINITY});
    check(&w);
    pairs_close(&w.in);
  }
}

static rm_part take_block(world *w, int block)
{
  rm_part part;

  for (int side = 0; side < 2; side++)
    RT_EQ(rm_part_take(w->in.arena, w->routes, w->stock[side], block, &part.piece[side], &w->reason), REMAP_OK);
  RT_EQ(rm_part_check(&part), REMAP_OK);
  return part;
}

/* The boxes of a piece's cells. */
static const double (*boxes_of(world *w, const rm_piece *p))[6]
{
  double (*box)[6] = rm_arena_alloc(w->in.arena, p->num_cells, sizeof *box);

  for (rm_lid c = 0; c < p->num_cells; c++)
    for (int d = 0; d < 6; d++) box[c][d] = d < 3 ? INFINITY : -INFINITY;
  for (rm_lid f = 0; f < p->num_faces; f++)
    for (int64_t k = p->face_offset[f]; k < p->face_offset[f + 1]; k++)
      for (int h = 0; h < 2; h++) {
        double *own = p->face_cell[f][h] >= 0 ? box[p->face_cell[f][h]] : NULL;

        for (int d = 0; d < 3 && own; d++) {
          own[d]     = fmin(own[d], p->node_xyz[p->face_node[k]][d]);
          own[d + 3] = fmax(own[d + 3], p->node_xyz[p->face_node[k]][d]);
        }
      }
  return (const double(*)[6])box;
}

/* Pairs of meeting boxes, counted over all cells of both meshes. */
static int64_t count_all(world *w)
{
  int64_t      *offset = rm_arena_alloc(w->in.arena, w->in.comm.size + 1, sizeof *offset), n[2], num = 0;
  const double(*box[2])[6];
  void         *all = NULL;

  for (int side = 0; side < 2; side++) {
    const rm_mesh *mesh = w->in.mesh[side];

    RT_EQ(rm_comm_allgatherv(&w->in.comm, w->in.arena, mesh->cell_box, mesh->num_cells, sizeof *mesh->cell_box, offset, &all),
          REMAP_OK);
    box[side] = all;
    n[side]   = offset[w->in.comm.size];
  }
  for (int64_t i = 0; i < n[0]; i++)
    for (int64_t j = 0; j < n[1]; j++) num += rm_box_meets(box[0][i], box[1][j]);
  return num;
}

static void check_pairs(world *w)
{
  int64_t found = 0;

  for (int block = 0; block < rm_part_blocks(w->routes); block++) {
    const rm_part part = take_block(w, block);
    const double(*box[2])[6];

    for (int side = 0; side < 2; side++) box[side] = boxes_of(w, &part.piece[side]);
    for (rm_lid i = 0; i < part.piece[0].num_cells; i++)
      for (rm_lid j = 0; j < part.piece[1].num_cells; j++)
        found += rm_box_meets(box[0][i], box[1][j]) && rm_part_makes_pair(&part, i, j);
  }
  RT_EQ(rm_comm_sum_i64(&w->in.comm, &found, 1), REMAP_OK);
  RT_EQ(found, count_all(w));
}

static void every_pair_of_cells_with_meeting_boxes_is_made_in_one_block_of_one_rank(void)
{
  for_all_worlds(check_pairs);
}

static int64_t most_blocks(int kind, rm_slicing slicing)
{
  int64_t num;
  world   w;

  open_world(&w, kind, 0, slicing);
  num = rm_part_blocks(w.routes);
  RT_EQ(rm_comm_max_i64(&w.in.comm, &num, 1), REMAP_OK);
  pairs_close(&w.in);
  return num;
}

static void sources_that_meet_everything_make_one_block(void)
{
  for (int kind = 0; kind < pairs_num_kinds(); kind++) {
    const int64_t many = most_blocks(kind, (rm_slicing){.triangles = 100, .repeats = INFINITY});
    const int64_t few  = most_blocks(kind, (rm_slicing){.triangles = 100}); /* no triangle may come twice */

    RT_CHECK(few <= many);
    if (kind == PAIRS_PARTLY) RT_CHECK(many > 1 && few == 1);
    RT_EQ(most_blocks(kind, rm_one_block), 1);
  }
}

static void small_ranks_cut_blocks_too_unless_these_would_have_too_few_triangles(void)
{
  for (int kind = 0; kind < pairs_num_kinds(); kind++) {
    const int64_t some = most_blocks(kind, (rm_slicing){INT64_MAX, INFINITY, 4, 1});

    RT_CHECK(some <= 4 && (kind != PAIRS_PARTLY || some > 1));
    RT_EQ(most_blocks(kind, (rm_slicing){INT64_MAX, INFINITY, 4, INT64_MAX}), 1);
  }
}

RT_MAIN(RT_CASE(every_pair_of_cells_with_meeting_boxes_is_made_in_one_block_of_one_rank),
        RT_CASE(sources_that_meet_everything_make_one_block),
        RT_CASE(small_ranks_cut_blocks_too_unless_these_would_have_too_few_triangles))
