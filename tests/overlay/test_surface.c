/* A closed surface of very many triangles as a mesh of one cell, against grids that it passes through. */
#include "laid.h"
#include "rt.h"
#include "surfaces.h"

/* The ball is covered by the grid, the grid's cells by the ball as their corners tell: a ball is convex. */
static void check(int n, double radius, const double centre[3], tm_mesh *grid, remap_faces faces)
{
  tm_mesh *whole = surfaces_ball(n, radius, centre);

  for (int side = 0; side < 2; side++) { /* of the ball */
    laid *l = laid_over(side ? grid : whole, side ? whole : grid, faces, NULL);

    if (RT_EQ(l->status, REMAP_OK)) {
      const rm_trimesh *m = l->mesh[1 - side];
      RT_NEAR(laid_closure(l, side, NULL), 0.0, 1e-12);
      RT_EQ(laid_cover(l, side, 0), REMAP_COVERED);
      RT_NEAR(laid_cell_volume(l, side, 0) / pow(l->frame.scale * radius, 3), 4 * M_PI / 3, 8.0 / (n * n));
      for (rm_lid c = 0; c < l->num[1 - side]; c++) {
        const rm_lid at = l->place[1 - side][c];
        const double v = laid_volume(l, side ? c : 0, side ? 0 : c), whole_v = laid_cell_volume(l, 1 - side, c);
        double       nearest = INFINITY, farthest = 0;

        for (rm_lid k = m->cell_vertex_offset[at]; k < m->cell_vertex_offset[at + 1]; k++) {
          const double *p = m->vertex[m->cell_vertex[k]];
          double        r = 0;
          for (int d = 0; d < 3; d++) r += pow(p[d] / l->frame.scale - centre[d], 2);
          nearest  = fmin(nearest, sqrt(r) / radius);
          farthest = fmax(farthest, sqrt(r) / radius);
        }
        if (farthest < 1 - 2.0 / (n * n)) {
          RT_NEAR(v, whole_v, 1e-12 * whole_v);
          RT_EQ(laid_cover(l, 1 - side, c), REMAP_COVERED);
        } else if (nearest < 1 - 2.0 / (n * n) && farthest > 1) {
          RT_CHECK(v > 0 && v < whole_v);
          RT_EQ(laid_cover(l, 1 - side, c), REMAP_PARTIAL);
        }
      }
    }
    laid_free(l);
  }
  tm_free(whole);
  tm_free(grid);
}

static tm_mesh *grid_about(int n, double angle)
{
  tm_mesh *grid = tm_benchmark(n, .7, angle, 2.6);
  tm_move(grid, tm_affine, (double[]){1, 0, 0, .1, 0, 1, 0, .2, 0, 0, 1, .3});
  return grid;
}

static const double middle[3] = {.1, .2, .3};

static void a_ball_of_many_triangles_lies_on_a_warped_grid(void)
{
  check(40, 1, middle, grid_about(12, 0), REMAP_FACES_CENTRE);
  check(rt_long() ? 110 : 50, 1, middle, grid_about(9, .3), REMAP_FACES_DIAGONAL);
}

/* Vertices of the ball lie on the grid's planes, its centre in a node. */
static void a_ball_lies_on_a_grid_through_its_poles(void)
{
  tm_mesh *grid =
      tm_hexahedra((int[]){10, 10, 10}, tm_affine, (double[]){2.5, 0, 0, -1.25, 0, 2.5, 0, -1.25, 0, 0, 2.5, -1.25});
  check(32, 1, (double[]){0, 0, 0}, grid, REMAP_FACES_CENTRE);
}
static void a_ball_lies_in_one_cell(void)
{
  check(40, 1, middle, tm_hexahedra((int[]){1, 1, 2}, tm_affine, (double[]){9, 0, 0, -4, 0, 9, 0, -4, 0, 0, 9, -4}),
        REMAP_FACES_CENTRE);
}
static void cells_lie_in_a_ball(void) { check(40, 1, middle, grid_about(20, .2), REMAP_FACES_CENTRE); }

/* Surface against surface: balls that meet in a lens. */
static void two_balls_share_a_lens(void)
{
  const int    n = 48;
  tm_mesh     *a = surfaces_ball(n, 1, (double[]){0, 0, 0}), *b = surfaces_ball(n, 1, (double[]){.7, .5, .3});
  const double d = sqrt(.49 + .25 + .09), lens = M_PI * (4 + d) * (2 - d) * (2 - d) / 12;
  laid        *l = laid_over(a, b, REMAP_FACES_CENTRE, NULL), *back = laid_over(b, a, REMAP_FACES_CENTRE, NULL);

  if (RT_EQ(l->status, REMAP_OK) && RT_EQ(back->status, REMAP_OK)) {
    RT_NEAR(laid_volume(l, 0, 0) / pow(l->frame.scale, 3), lens, 10.0 / (n * n));
    RT_NEAR(laid_volume(l, 0, 0), laid_volume(back, 0, 0), 1e-13 * laid_cell_volume(l, 0, 0));
    RT_EQ(laid_cover(l, 0, 0), REMAP_PARTIAL);
    RT_EQ(laid_cover(l, 1, 0), REMAP_PARTIAL);
  }
  laid_free(l);
  laid_free(back);
  tm_free(a);
  tm_free(b);
}
static void a_ball_covers_itself(void)
{
  tm_mesh *a = surfaces_ball(40, 1, middle), *inner = surfaces_ball(30, .5, middle);
  laid    *l = laid_over(a, a, REMAP_FACES_CENTRE, NULL);

  if (RT_EQ(l->status, REMAP_OK)) {
    RT_NEAR(laid_closure(l, 0, NULL), 0.0, 1e-13);
    RT_EQ(laid_cover(l, 0, 0), REMAP_COVERED);
    RT_EQ(laid_cover(l, 1, 0), REMAP_COVERED);
  }
  laid_free(l);
  l = laid_over(a, inner, REMAP_FACES_CENTRE, NULL);
  if (RT_EQ(l->status, REMAP_OK)) {
    RT_NEAR(laid_closure(l, 1, NULL), 0.0, 1e-13);
    RT_EQ(laid_cover(l, 0, 0), REMAP_PARTIAL);
    RT_EQ(laid_cover(l, 1, 0), REMAP_COVERED);
  }
  laid_free(l);
  tm_free(a);
  tm_free(inner);
}

RT_MAIN(RT_CASE(a_ball_of_many_triangles_lies_on_a_warped_grid), RT_CASE(a_ball_lies_on_a_grid_through_its_poles),
        RT_CASE(a_ball_lies_in_one_cell), RT_CASE(cells_lie_in_a_ball), RT_CASE(two_balls_share_a_lens),
        RT_CASE(a_ball_covers_itself))
