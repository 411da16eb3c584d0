/* Meshes of two zones that overlap or gape where they are patched together: by much, by the last bit, with nodes that match and
 * that do not. Volumes are then those of winding numbers, known beforehand. */
#include "laid.h"
#include "rt.h"

static const double ulp = 0x1p-53; /* of numbers in [1/2, 1) */

/* A lattice in the unit cube's middle, turned so that no face is parallel to an interface, or around the cube. */
typedef enum across { INSIDE, AROUND, SAME } across;

static tm_mesh *third_mesh(across where)
{
  tm_mesh *mesh;

  if (where == SAME) return tm_hexahedra((int[]){5, 4, 3}, NULL, NULL);
  mesh = tm_benchmark(where == INSIDE ? 5 : 7, .7, .3, where == INSIDE ? .5 : 2.5);
  tm_move(mesh, tm_affine, (double[]){1, 0, 0, .5, 0, 1, 0, .5, 0, 0, 1, .5});
  return mesh;
}

/* The slab between 1/2 and 1/2 + gap over each cell of the third mesh. */
static double *slab_volumes(const tm_mesh *third, double gap, remap_faces faces)
{
  const double low = gap < 0 ? .5 + gap : .5, high = gap < 0 ? .5 : .5 + gap;
  tm_mesh     *slab   = tm_hexahedra((int[]){1, 1, 1}, tm_affine, (double[]){high - low, 0, 0, low, 0, 1, 0, 0, 0, 0, 1, 0});
  laid        *l      = laid_over(slab, third, faces, NULL);
  double      *volume = tm_alloc_(third->view.num_cells, sizeof *volume);

  if (RT_EQ(l->status, REMAP_OK))
    for (rm_lid j = 0; j < l->num[1]; j++)
      volume[j] = laid_volume(l, 0, j) / (l->frame.scale * l->frame.scale * l->frame.scale);
  laid_free(l);
  tm_free(slab);
  return volume;
}

static double sum_over(const laid *l, int side, rm_lid c)
{
  long double sum = 0;

  for (rm_lid k = 0; k < l->num[1 - side]; k++) sum += (long double)(side == 0 ? laid_volume(l, c, k) : laid_volume(l, k, c));
  return (double)sum;
}

/* The zones against the third mesh, as source and as target. */
static void check(const int left[3], const int right[3], double gap, across where)
{
  for (int way = 0; way < 4; way++) {
    const remap_faces faces = way & 2 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE;
    const int         zones = way & 1; /* their side */
    tm_mesh          *two = tm_two_zones(left, right, gap, NULL, NULL), *third = third_mesh(where);
    double           *slab = slab_volumes(third, gap, faces);
    laid             *l    = laid_over(zones ? third : two, zones ? two : third, faces, NULL);

    if (RT_EQ(l->status, REMAP_OK)) {
      const double unit  = l->frame.scale * l->frame.scale * l->frame.scale;
      long double  total = 0;

      for (int64_t k = 0; k < l->moments->num_pairs; k++) total += (long double)l->moments->volume[k];
      if (where != INSIDE) {
        RT_NEAR((double)total / unit, 1 - gap, 1e-13);
        RT_NEAR(laid_closure(l, zones, NULL), 0.0, 1e-12);
      }
      for (rm_lid j = 0; j < l->num[1 - zones] && where != AROUND; j++) {
        const double v = laid_cell_volume(l, 1 - zones, j);
        RT_NEAR(sum_over(l, 1 - zones, j), v + (gap < 0 ? slab[j] : -slab[j]) * unit, 1e-12 * v);
      }
    } else {
      printf("# gap %g, way %d: %s\n", gap, way, l->reason.text);
    }
    laid_free(l);
    tm_free(two);
    tm_free(third);
    free(slab);
  }
}

static const int four[3] = {2, 4, 4}, other[3] = {3, 5, 6};

static void for_all_gaps(const int left[3], const int right[3], across where)
{
  const double gaps[] = {1e-3, -1e-3, ulp, -ulp / 2, 0, .04, -.04};

  for (size_t k = 0; k < sizeof gaps / sizeof *gaps; k++) check(left, right, gaps[k], where);
}

static void nodes_that_match_and_a_mesh_inside(void) { for_all_gaps(four, four, INSIDE); }
static void nodes_that_match_and_a_mesh_around(void) { for_all_gaps(four, four, AROUND); }
static void nodes_that_match_and_a_mesh_of_the_same_box(void) { for_all_gaps(four, four, SAME); }
static void nodes_that_do_not_match_and_a_mesh_inside(void) { for_all_gaps(four, other, INSIDE); }
static void nodes_that_do_not_match_and_a_mesh_around(void) { for_all_gaps(four, other, AROUND); }
static void nodes_that_do_not_match_and_a_mesh_of_the_same_box(void) { for_all_gaps(four, other, SAME); }

/* Warped zones with other nodes at the interface overlap and gape at once. */
static void warped_zones_keep_their_volume_in_a_mesh_around(void)
{
  for (int way = 0; way < 4; way++) {
    tm_mesh *two   = tm_two_zones(four, other, way & 1 ? 1e-4 : -ulp / 2, tm_warp, &(tm_warping){.05, .4}),
            *third = third_mesh(AROUND);
    laid *l        = laid_over(way & 2 ? third : two, way & 2 ? two : third, REMAP_FACES_CENTRE, NULL);

    if (RT_EQ(l->status, REMAP_OK)) RT_NEAR(laid_closure(l, way & 2 ? 1 : 0, NULL), 0.0, 1e-12);
    laid_free(l);
    tm_free(two);
    tm_free(third);
  }
}

/* Both meshes patched, each at its own place. */
static void two_patched_meshes_see_each_other_whole(void)
{
  const double gaps[] = {1e-3, -1e-3, ulp, -ulp / 2};

  for (int k = 0; k < 16; k++) {
    const double a = gaps[k / 4], b = gaps[k % 4];
    tm_mesh     *one = tm_two_zones(four, other, a, NULL, NULL), *two = tm_two_zones(other, four, b, NULL, NULL);
    laid        *l;
    long double  total = 0;

    for (int64_t v = 0; v < two->view.num_nodes; v++) { /* the second cut lies across the first */
      double *x = two->xyz + 3 * v, y = x[0];
      x[0] = x[1];
      x[1] = x[2];
      x[2] = y;
    }
    l = laid_over(one, two, REMAP_FACES_DIAGONAL, NULL);
    if (RT_EQ(l->status, REMAP_OK)) {
      for (int64_t i = 0; i < l->moments->num_pairs; i++) total += (long double)l->moments->volume[i];
      RT_NEAR((double)total / (l->frame.scale * l->frame.scale * l->frame.scale), (1 - a) * (1 - b), 1e-13);
    }
    laid_free(l);
    tm_free(one);
    tm_free(two);
  }
}

/* A zone that lies wholly on another: everything counts twice. */
static void a_mesh_given_twice_counts_twice(void)
{
  tm_mesh *two   = tm_join(tm_hexahedra((int[]){3, 3, 3}, NULL, NULL), tm_hexahedra((int[]){2, 4, 3}, NULL, NULL)),
          *third = third_mesh(INSIDE);
  laid *l        = laid_over(two, third, REMAP_FACES_CENTRE, NULL);

  if (RT_EQ(l->status, REMAP_OK))
    for (rm_lid j = 0; j < l->num[1]; j++) {
      const double v = laid_cell_volume(l, 1, j);
      RT_NEAR(sum_over(l, 1, j), 2 * v, 1e-12 * v);
    }
  laid_free(l);
  tm_free(two);
  two = tm_join(tm_hexahedra((int[]){3, 3, 3}, NULL, NULL), tm_hexahedra((int[]){3, 3, 3}, NULL, NULL)); /* bit for bit */
  l   = laid_over(two, third, REMAP_FACES_DIAGONAL, NULL);
  if (RT_EQ(l->status, REMAP_OK))
    for (rm_lid j = 0; j < l->num[1]; j++) {
      const double v = laid_cell_volume(l, 1, j);
      RT_NEAR(sum_over(l, 1, j), 2 * v, 1e-12 * v);
    }
  laid_free(l);
  tm_free(two);
  tm_free(third);
}

RT_MAIN(RT_CASE(nodes_that_match_and_a_mesh_inside), RT_CASE(nodes_that_match_and_a_mesh_around),
        RT_CASE(nodes_that_match_and_a_mesh_of_the_same_box), RT_CASE(nodes_that_do_not_match_and_a_mesh_inside),
        RT_CASE(nodes_that_do_not_match_and_a_mesh_around), RT_CASE(nodes_that_do_not_match_and_a_mesh_of_the_same_box),
        RT_CASE(warped_zones_keep_their_volume_in_a_mesh_around), RT_CASE(two_patched_meshes_see_each_other_whole),
        RT_CASE(a_mesh_given_twice_counts_twice))
