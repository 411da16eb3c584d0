/* Meshes whose faces coincide give exactly the pairs that share volume: the parent map where cells are nested, eight where they
 * are shifted by half a cell; on any number of ranks. Coordinates are small integers, so that planes coincide exactly. */
#include <remap/remap.h>
#include "meshes.h"
#include "rt.h"

enum { SIDE = 24 }; /* of the cube */

/* To integers, moved by data[0] of them. */
static void to_lattice(double x[3], const void *data)
{
  for (int k = 0; k < 3; k++) x[k] = nearbyint(x[k] * SIDE) + *(const double *)data;
}

static tm_mesh *lattice(int n, double shift) { return tm_hexahedra((int[]){n, n, n}, to_lattice, &shift); }

/* Build the overlay of two lattices of n and m cells a side, the second moved, and hand the rows of the second to `check`. */
static void overlay(int n, int m, double shift, remap_faces faces,
                    void (*check)(int n, int m, const remap_pairs_view *v, const int64_t *global))
{
  tm_mesh       *whole[2] = {lattice(n, 0), lattice(m, shift)}, *mine[2];
  remap_options  options;
  remap_context *ctx = NULL;
  remap_pairs_view view;

  remap_options_default(&options);
  options.faces = faces;
  RT_EQ(remap_create(MPI_COMM_WORLD, &options, &ctx), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    int *deal  = tm_deal(whole[side], rt_size(), TM_RANDOM, 5);
    mine[side] = tm_part(whole[side], deal, rt_rank(), 11);
    free(deal);
    RT_EQ(remap_set_mesh(ctx, side, &mine[side]->view), REMAP_OK);
  }
  if (rt_all(RT_EQ(remap_build(ctx), REMAP_OK)) && RT_EQ(remap_pairs(ctx, REMAP_FORWARD, &view), REMAP_OK))
    check(n, m, &view, mine[1]->view.cell_global);
  remap_destroy(&ctx);
  for (int side = 0; side < 2; side++) tm_free(whole[side]), tm_free(mine[side]);
}

static void split(int64_t cell, int n, int at[3])
{
  at[0] = (int)(cell % n), at[1] = (int)(cell / n % n), at[2] = (int)(cell / n / n);
}

/* Every pair is parent and child, every child has one parent, every parent all its children; volumes are exact. */
static void is_parent_map(int n, int m, const remap_pairs_view *v, const int64_t *global)
{
  const int    ratio = n < m ? m / n : n / m, fine = n < m ? m : n;
  const double child = (double)(SIDE / fine) * (SIDE / fine) * (SIDE / fine);

  for (int64_t row = 0; row < v->num_rows; row++) {
    RT_EQ(v->row_offset[row + 1] - v->row_offset[row], n < m ? 1 : ratio * ratio * ratio);
    for (int64_t k = v->row_offset[row]; k < v->row_offset[row + 1]; k++) {
      int giver[3], receiver[3];
      split(v->global_cell[k], n, giver), split(global[row], m, receiver);
      for (int d = 0; d < 3; d++) RT_EQ(n < m ? receiver[d] / ratio : receiver[d], n < m ? giver[d] : giver[d] / ratio);
      RT_NEAR(v->volume[k], child, 1e-13 * child);
    }
  }
}

static void is_half_shifted(int n, int m, const remap_pairs_view *v, const int64_t *global)
{
  for (int64_t row = 0; row < v->num_rows; row++) {
    int at[3], want = 1;
    split(global[row], m, at);
    for (int d = 0; d < 3; d++) want *= at[d] == n - 1 ? 1 : 2; /* the last layer sticks out by half */
    RT_EQ(v->row_offset[row + 1] - v->row_offset[row], want);
  }
}

static void is_identical(int n, int m, const remap_pairs_view *v, const int64_t *global)
{
  (void)n, (void)m;
  for (int64_t row = 0; row < v->num_rows; row++)
    if (RT_EQ(v->row_offset[row + 1] - v->row_offset[row], 1)) {
      RT_EQ(v->global_cell[v->row_offset[row]], global[row]);
      RT_EQ(v->same[v->row_offset[row]], 1);
    }
}

static void nested_meshes_give_the_parent_map(void)
{
  static const int pair[][2] = {{2, 4}, {4, 2}, {2, 6}, {6, 2}, {3, 6}, {1, 3}, {4, 1}};

  for (int faces = 0; faces < 2; faces++)
    for (int k = 0; k < 7; k++) overlay(pair[k][0], pair[k][1], 0, faces, is_parent_map);
}
static void grids_shifted_by_half_a_cell_give_eight_pairs_per_inner_cell(void)
{
  for (int faces = 0; faces < 2; faces++) overlay(4, 4, SIDE / 4 / 2, faces, is_half_shifted);
}
static void identical_meshes_give_one_pair_per_cell(void)
{
  for (int faces = 0; faces < 2; faces++)
    for (int n = 1; n <= 4; n++) overlay(n, n, 0, faces, is_identical);
}

RT_MAIN(RT_CASE(nested_meshes_give_the_parent_map), RT_CASE(grids_shifted_by_half_a_cell_give_eight_pairs_per_inner_cell),
        RT_CASE(identical_meshes_give_one_pair_per_cell))
