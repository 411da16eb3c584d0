/* Cells that come together because one zone's skin may enter another zone, against brute force over all pairs of cells. */
#include "meshes.h"
#include "part/part.h"
#include "rt.h"

#include <math.h>

typedef struct world {
  rm_comm        comm;
  rm_arena      *arena;
  rm_frame       frame;
  const rm_mesh *mesh[2];
} world;

/* The parts of both meshes that a rank of some has, in the library's form. */
static void open_world(world *w, MPI_Comm comm, tm_mesh *const whole[2], tm_dealing how)
{
  tm_mesh   *part[2];
  rm_reason  reason = {-1, -1, ""};
  remap_mesh view[2];

  RT_EQ(rm_comm_dup(comm, &w->comm), REMAP_OK);
  w->arena = rm_arena_new();
  for (int side = 0; side < 2; side++) {
    int *deal = tm_deal(whole[side], w->comm.size, how, 5);

    part[side] = tm_part(whole[side], deal, w->comm.rank, 0);
    view[side] = part[side]->view;
    free(deal);
  }
  RT_EQ(rm_frame_build(&w->comm, view, &w->frame, &reason), REMAP_OK);
  for (int side = 0; side < 2; side++)
    RT_EQ(rm_mesh_build(w->arena, &w->comm, (remap_side)side, &view[side], &w->frame, REMAP_FACES_CENTRE, &w->mesh[side],
                        &reason),
          REMAP_OK);
  for (int side = 0; side < 2; side++) tm_free(part[side]);
}

static void close_world(world *w)
{
  rm_arena_drop(w->arena);
  rm_comm_free(&w->comm);
}

static rm_lid zone_of(const tm_mesh *m, rm_gid cell)
{
  return cell >= m->view.zone_cell_offset[1];
}

static bool is_met(const world *w, int side, rm_lid cell)
{
  for (rm_lid k = 0; k < w->mesh[1 - side]->num_cells; k++)
    if (rm_box_meets(w->mesh[side]->cell_box[cell], w->mesh[1 - side]->cell_box[k])) return true;
  return false;
}

/* wanted[entered * cells + entering], by global ids; all is the mesh on one rank. */
static void find_wanted(const world *all, int side, const tm_mesh *whole, int64_t *wanted)
{
  const rm_mesh *m = all->mesh[side];

  for (rm_lid f = 0; f < m->num_faces; f++) {
    const rm_lid b      = m->face_cell[f][0];
    double       box[6] = {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY};

    if (!m->face_is_skin[f] || !is_met(all, side, b)) continue;
    for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++)
      for (int d = 0; d < 3; d++) {
        box[d]     = fmin(box[d], m->node_xyz[m->face_node[k]][d]);
        box[d + 3] = fmax(box[d + 3], m->node_xyz[m->face_node[k]][d]);
      }
    for (rm_lid a = 0; a < m->num_cells; a++)
      if (zone_of(whole, m->cell_global[a]) != zone_of(whole, m->cell_global[b]) && rm_box_meets(box, m->cell_box[a]) &&
          is_met(all, side, a))
        wanted[m->cell_global[a] * m->num_cells + m->cell_global[b]] = 1;
  }
}

static void compare(tm_mesh *const whole[2], int side, tm_dealing how, bool expects_any)
{
  const int64_t n      = whole[side]->view.num_cells;
  int64_t      *wanted = tm_alloc_(n * n, sizeof *wanted), *got = tm_alloc_(n * n, sizeof *got), sum = 0, wrong = 0;
  rm_reason     reason = {-1, -1, ""};
  world         here, all;
  rm_skins      skins;

  open_world(&all, MPI_COMM_SELF, whole, TM_SLABS);
  open_world(&here, MPI_COMM_WORLD, whole, how);
  find_wanted(&all, side, whole[side], wanted);
  rm_lid *zone = rm_arena_alloc(here.arena, here.mesh[side]->num_cells, sizeof *zone);
  for (rm_lid c = 0; c < here.mesh[side]->num_cells; c++) zone[c] = zone_of(whole[side], here.mesh[side]->cell_global[c]);
  RT_EQ(rm_part_skins(here.arena, &here.comm, &here.frame, here.mesh, side, zone, &skins, &reason), REMAP_OK);
  for (rm_lid a = 0; skins.any && a < skins.piece[RM_SKINS_ENTERED].num_cells; a++)
    for (rm_lid b = 0; b < skins.piece[RM_SKINS_ENTERING].num_cells; b++) {
      const rm_gid id[2] = {skins.piece[RM_SKINS_ENTERED].cell_global[a], skins.piece[RM_SKINS_ENTERING].cell_global[b]};

      RT_EQ(skins.zone[RM_SKINS_ENTERED][a], zone_of(whole[side], id[0]));
      RT_EQ(skins.zone[RM_SKINS_ENTERING][b], zone_of(whole[side], id[1]));
      got[id[0] * n + id[1]] += wanted[id[0] * n + id[1]];
    }
  RT_EQ(rm_comm_sum_i64(&here.comm, got, (int)(n * n)), REMAP_OK);
  for (int64_t k = 0; k < n * n; k++) sum += wanted[k], wrong += wanted[k] != got[k];
  RT_EQ(wrong, 0);
  RT_CHECK((sum > 0) == expects_any);
  RT_CHECK(skins.any || !expects_any);
  close_world(&here), close_world(&all);
  free(wanted), free(got);
}

static void every_pair_of_a_zone_and_anothers_skin_is_on_one_rank(void)
{
  static const double corner[12] = {.3, 0, 0, .4, 0, .3, 0, .1, 0, 0, .4, .2};
  static const double gap[] = {0, -.125, -.4};

  for (int k = 0; k < 9; k++) {
    tm_mesh *whole[2] = {tm_hexahedra((int[]){3, 3, 3}, k / 3 == 1 ? tm_affine : NULL, corner),
                         tm_two_zones((int[]){k / 3 == 2 ? 1 : 4, 3, 3}, (int[]){5, 3, 2}, gap[k % 3], tm_warp,
                                      &(tm_warping){.03, .1 * k})};

    if (k / 3 != 1) tm_move(whole[0], tm_affine, (double[]){1, 0, 0, .1, 0, 1, 0, .1, 0, 0, 1, .1});
    for (int how = 0; how <= TM_LAST; how++) compare(whole, 1, how, true);
    for (int side = 0; side < 2; side++) tm_free(whole[side]);
  }
}

static void nothing_comes_together_where_the_other_mesh_is_not(void)
{
  tm_mesh *whole[2] = {tm_two_zones((int[]){4, 3, 3}, (int[]){5, 3, 2}, -.125, NULL, NULL),
                       tm_hexahedra((int[]){2, 2, 2}, tm_affine, (double[]){.1, 0, 0, .05, 0, .5, 0, .1, 0, 0, .4, .2})};

  compare(whole, 0, TM_RANDOM, false);
  for (int side = 0; side < 2; side++) tm_free(whole[side]);
}

RT_MAIN(RT_CASE(every_pair_of_a_zone_and_anothers_skin_is_on_one_rank),
        RT_CASE(nothing_comes_together_where_the_other_mesh_is_not))
