/* Closure of both meshes, 1e-12 per cell, where cells are far from the origin, thin, turned, or much smaller than what they
 * meet; and that a mesh's unit is of no account. */
#include "laid.h"
#include "rt.h"

static const double bar = 1e-12;

/* Both ways round and both triangulations; every cell of the side that is inside the other mesh closes, the others if
 * covered. */
static void closes(tm_mesh *inner, tm_mesh *outer)
{
  for (int way = 0; way < 4; way++) {
    laid *l =
        laid_over(way & 1 ? outer : inner, way & 1 ? inner : outer, way & 2 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, NULL);
    const int in = way & 1;

    if (RT_EQ(l->status, REMAP_OK)) {
      uint8_t *covered = tm_alloc_(l->num[1 - in], 1);

      RT_NEAR(laid_closure(l, in, NULL), 0.0, bar);
      for (rm_lid c = 0; c < l->num[in]; c++) RT_EQ(laid_cover(l, in, c), REMAP_COVERED);
      for (rm_lid c = 0; c < l->num[1 - in]; c++) covered[c] = laid_cover(l, 1 - in, c) == REMAP_COVERED;
      RT_NEAR(laid_closure(l, 1 - in, covered), 0.0, bar);
      free(covered);
    }
    laid_free(l);
  }
  tm_free(inner);
  tm_free(outer);
}

static tm_mesh *turned(tm_mesh *mesh, double angle, double x, double y, double z)
{
  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    double *p = mesh->xyz + 3 * v;

    tm_rotate_(p, angle);
    p[0] += x, p[1] += y, p[2] += z;
  }
  return mesh;
}

static void far_meshes_close(void)
{
  for (double far = 1e3; far < 2e9; far *= 1e3) {
    closes(turned(tm_benchmark(6, .7, .3, .5), .1, far, -far, .7 * far),
           turned(tm_benchmark(7, .1, 0, 1), 0, far, -far, .7 * far));
    closes(turned(tm_tetrahedra((int[]){3, 3, 3}, NULL, NULL), .2, far + .5, far + .5, -far),
           turned(tm_benchmark(7, .1, 0, 4), 0, far, far, -far));
  }
}
static void identical_domains_far_away_close(void)
{
  closes(turned(tm_hexahedra((int[]){5, 5, 5}, NULL, NULL), 0, 1e6, 1e6, 1e6),
         turned(tm_hexahedra((int[]){6, 6, 6}, NULL, NULL), 0, 1e6, 1e6, 1e6));
}

static void flatten(tm_mesh *mesh, double x, double y, double z)
{
  tm_move(mesh, tm_affine, (double[]){x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0});
}
static void turned_pancakes_close(void)
{
  for (int k = 0; k < 6; k++) {
    const double thin = k & 1 ? 1e-5 : 1e-3, angle = .3 + .2 * (k / 2), far = k < 4 ? 0 : 1e3;
    tm_mesh     *a = tm_benchmark(5, .7, 0, .6), *b = tm_benchmark(6, .1, 0, 1);

    flatten(a, 1, 1, thin);
    flatten(b, 1, 1, thin);
    closes(turned(a, angle, far, 0, far), turned(b, angle, far, 0, far));
  }
}
static void needles_close(void)
{
  tm_mesh *a = tm_benchmark(5, .7, 0, .6), *b = tm_benchmark(6, .1, 0, 1);

  flatten(a, 1e-5, 1e-5, 1);
  flatten(b, 1e-5, 1e-5, 1);
  closes(turned(a, .4, 0, 0, 0), turned(b, .4, 0, 0, 0));
}
static void crossed_pancakes_close_where_they_meet(void)
{
  tm_mesh *a = tm_benchmark(5, .7, 0, 1), *b = tm_benchmark(4, .1, 0, .5);

  flatten(a, 1, 1, .5); /* cells of 1 x 1 x .5 in which thin ones stand upright */
  flatten(b, .3, 1e-5, .3);
  closes(turned(b, .7, 0, 0, 0), turned(a, .2, 0, 0, 0));
}
static void small_cells_in_large_ones_close(void)
{
  for (double ratio = 1e3; ratio < 1e7; ratio *= 1e3) {
    closes(turned(tm_benchmark(4, .7, .3, 1), .1, .1, .2, .3), tm_benchmark(3, .1, 0, 3 * ratio));
    closes(turned(tm_benchmark(4, .7, .3, 1), .1, .3 * ratio, .2 * ratio, .1 * ratio), tm_benchmark(3, .1, .2, 3 * ratio));
  }
}
static void thin_small_cells_in_large_ones_close(void)
{
  tm_mesh *a = tm_benchmark(5, .7, 0, 1);

  flatten(a, 1, 1, 1e-4);
  closes(turned(a, .6, 200, 150, 100), tm_benchmark(4, .1, .2, 1000));
}
static void polyhedra_and_tetrahedra_far_away_close(void)
{
  tm_mesh *dual = tm_dual((int[]){4, 4, 4}, tm_warp, &(tm_warping){.02, .3}),
          *tets = tm_tetrahedra((int[]){5, 4, 5}, NULL, NULL);

  flatten(tets, 1.6, 1.6, 1.6);
  closes(turned(dual, 0, 1e6, 1e6, 1e6), turned(tets, 0, 1e6 - .3, 1e6 - .3, 1e6 - .3));
}

/* Scaled by a power of two every bit stays, by any factor the bar holds. */
static void the_unit_is_of_no_account(void)
{
  static const double scales[] = {0x1p-20, 0x1p20, 0x1p-300, 0x1p300};
  tm_mesh            *a[2]     = {tm_benchmark(5, .7, .3, .5), tm_benchmark(6, .1, 0, 1)};
  laid               *first    = laid_over(a[0], a[1], REMAP_FACES_CENTRE, NULL);

  RT_EQ(first->status, REMAP_OK);
  for (size_t k = 0; k < sizeof scales / sizeof *scales && first->status == REMAP_OK; k++) {
    tm_mesh *b[2] = {tm_benchmark(5, .7, .3, .5), tm_benchmark(6, .1, 0, 1)};
    laid    *l;

    for (int side = 0; side < 2; side++) flatten(b[side], scales[k], scales[k], scales[k]);
    l = laid_over(b[0], b[1], REMAP_FACES_CENTRE, NULL);
    if (RT_EQ(l->status, REMAP_OK) && RT_EQ(l->moments->num_pairs, first->moments->num_pairs))
      for (int64_t p = 0; p < l->moments->num_pairs; p++) {
        RT_NEAR(l->moments->volume[p], first->moments->volume[p], 0.0);
        for (int c = 0; c < 3; c++) RT_NEAR(l->moments->moment[p][c], first->moments->moment[p][c], 0.0);
      }
    laid_free(l);
    for (int side = 0; side < 2; side++) tm_free(b[side]);
  }
  laid_free(first);
  for (int side = 0; side < 2; side++) {
    flatten(a[side], 1e-6, 1e-6, 1e-6);
    turned(a[side], .5, 0, 0, 0);
  }
  closes(a[0], a[1]);
}

RT_MAIN(RT_CASE(far_meshes_close), RT_CASE(identical_domains_far_away_close), RT_CASE(turned_pancakes_close),
        RT_CASE(needles_close), RT_CASE(crossed_pancakes_close_where_they_meet), RT_CASE(small_cells_in_large_ones_close),
        RT_CASE(thin_small_cells_in_large_ones_close), RT_CASE(polyhedra_and_tetrahedra_far_away_close),
        RT_CASE(the_unit_is_of_no_account))
