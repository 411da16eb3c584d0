/* bench_geom -- nanoseconds per call of the geom room on the input it meets: general position, and what identical, nested,
 * abutting and rotated meshes make of it. One JSON line per case. */
#include "geom/geom.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SETS = 4096, POINTS = 8, REPEATS = 7, LOOPS = 40 };

typedef struct point_set {
  double p[POINTS][3];
} point_set;

static double uniform(void) { return rand() / (double)RAND_MAX - 0.5; }

static void rotate(double p[3])
{
  const double c = cos(0.7), s = sin(0.7), x = c * p[0] - s * p[1], y = s * p[0] + c * p[1];

  p[0] = x;
  p[1] = c * y - s * p[2];
  p[2] = s * y + c * p[2];
}

/* Independent points. */
static void general(point_set *s)
{
  for (int i = 0; i < POINTS; i++)
    for (int k = 0; k < 3; k++) s->p[i][k] = uniform();
}
/* Points 0, 1, 2 and 3 share a vertex: identical warped meshes. */
static void shared_vertex(point_set *s)
{
  general(s);
  memcpy(s->p[3], s->p[rand() % 2 + 1], sizeof *s->p);
}
/* All in a plane x = const: identical boxes. */
static void axis_parallel(point_set *s)
{
  general(s);
  for (int i = 1; i < POINTS; i++) s->p[i][0] = s->p[0][0];
}
/* In an oblique plane, exactly, on a grid: nested planar faces. */
static void on_grid(point_set *s)
{
  for (int i = 0; i < POINTS; i++) {
    const double x = rand() % 1000, y = rand() % 1000;

    s->p[i][0] = x * 0x1p-12;
    s->p[i][1] = y * 0x1p-12;
    s->p[i][2] = (x + 3 * y) * 0x1p-12;
  }
}
/* In an oblique plane, up to rounding: nested rotated meshes. */
static void rounded_plane(point_set *s)
{
  axis_parallel(s);
  for (int i = 0; i < POINTS; i++) rotate(s->p[i]);
}
/* In a plane through the origin with noise where zeros should be: nothing fits a common grid. */
static void noisy_zeros(point_set *s)
{
  general(s);
  for (int i = 0; i < POINTS; i++) s->p[i][0] = 6e-17 * uniform();
}
/* Exactly coplanar, yet on no common grid of 61 bits. */
static void long_grid(point_set *s)
{
  on_grid(s);
  for (int k = 0; k < 3; k++) s->p[0][k] = 0x1p-70 * s->p[0][k];
}
/* The line 0-1 runs exactly through the edge that the triangles 2-3-4 and 5-6-7 share. */
static void through_edge(point_set *s)
{
  for (int i = 0; i < POINTS; i++)
    for (int k = 0; k < 3; k++) s->p[i][k] = (rand() % 4096 - 2048) * 0x1p-12;
  memcpy(s->p[5], s->p[2], 2 * sizeof *s->p);
  for (int k = 0; k < 3; k++) s->p[1][k] = s->p[2][k] + s->p[3][k] - s->p[0][k];
}

static volatile double keep;

static double point_side(const point_set *s) { return rm_point_side(s->p[0], s->p[1], s->p[2], s->p[3], 1, NULL); }
static double edge_side(const point_set *s) { return rm_edge_side(s->p[0], s->p[1], s->p[2], s->p[3], 1, NULL); }
static double order(const point_set *s) { return rm_crossing_order(s->p[0], s->p[1], s->p + 2, s->p + 5, 1); }
static double parameter(const point_set *s) { return rm_crossing_parameter(s->p[0], s->p[1], s->p[2], s->p[3], s->p[4]); }
static double det_dd(const point_set *s) { return rm_det_dd(s->p[0], s->p[1], s->p[2], s->p[3]).hi; }

static double triangulate(const point_set *s, int n, remap_faces faces)
{
  int    corner[3 * (POINTS + 2)], work[4 * POINTS];
  double centre[3];

  return rm_triangulate(s->p, n, faces, corner, centre, work) + corner[0];
}
static double triangle(const point_set *s) { return triangulate(s, 3, REMAP_FACES_CENTRE); }
static double quad_centre(const point_set *s) { return triangulate(s, 4, REMAP_FACES_CENTRE); }
static double quad_diagonal(const point_set *s) { return triangulate(s, 4, REMAP_FACES_DIAGONAL); }
static double hexagon(const point_set *s) { return triangulate(s, 6, REMAP_FACES_CENTRE); }

/* A convex loop in order, warped or flat. */
static void loop_of(point_set *s, int n, double warp)
{
  for (int i = 0; i < n; i++) {
    const double angle = 6.2831853 * (i + 0.3 * uniform()) / n;

    s->p[i][0] = floor(0x1p20 * cos(angle)) * 0x1p-20;
    s->p[i][1] = floor(0x1p20 * sin(angle)) * 0x1p-20;
    s->p[i][2] = s->p[i][0] + warp * uniform();
  }
}
static void warped_quad(point_set *s) { loop_of(s, 4, 0.1); }
static void flat_quad(point_set *s) { loop_of(s, 4, 0); }
static void warped_hexagon(point_set *s) { loop_of(s, 6, 0.1); }
static void flat_hexagon(point_set *s) { loop_of(s, 6, 0); }

static void run(const char *what, double (*call)(const point_set *), const char *input, void (*make)(point_set *))
{
  static point_set sets[SETS];
  double           best = HUGE_VAL;

  srand(1);
  for (int i = 0; i < SETS; i++) make(&sets[i]);
  for (int repeat = 0; repeat < REPEATS; repeat++) {
    const double start = rm_seconds();
    double       sum   = 0;

    for (int loop = 0; loop < LOOPS; loop++)
      for (int i = 0; i < SETS; i++) sum += call(&sets[i]);
    keep = sum;
    best = fmin(best, rm_seconds() - start);
  }
  printf("{\"bench\": \"geom\", \"call\": \"%s\", \"input\": \"%s\", \"ns\": %.1f}\n", what, input, best * 1e9 / SETS / LOOPS);
}

#define RUN(call, input) run(#call, call, #input, input)

int main(void)
{
  RUN(point_side, general);
  RUN(point_side, shared_vertex);
  RUN(point_side, axis_parallel);
  RUN(point_side, on_grid);
  RUN(point_side, rounded_plane);
  RUN(point_side, noisy_zeros);
  RUN(point_side, long_grid);
  RUN(edge_side, general);
  RUN(edge_side, shared_vertex);
  RUN(edge_side, axis_parallel);
  RUN(edge_side, on_grid);
  RUN(edge_side, rounded_plane);
  RUN(edge_side, noisy_zeros);
  RUN(edge_side, long_grid);
  RUN(order, general);
  RUN(order, through_edge);
  RUN(parameter, general);
  RUN(parameter, shared_vertex);
  RUN(parameter, noisy_zeros);
  RUN(det_dd, general);
  RUN(triangle, general);
  RUN(quad_centre, warped_quad);
  RUN(quad_diagonal, warped_quad);
  RUN(quad_centre, flat_quad);
  RUN(hexagon, warped_hexagon);
  RUN(hexagon, flat_hexagon);
  return 0;
}
