/* Triangulation of faces: what it promises for any polygon, and what it finds for those one knows. */
#include "geom/geom.h"
#include "hard_points.h"
#include "rt.h"

enum { MAX_N = 40, ROUNDS = 4000 };

/* A triangulated polygon. */
typedef struct result {
  int    num, corner[3 * (MAX_N + 2)];
  double centre[3], xyz[MAX_N][3];
} result;

static void triangulate(double (*xyz)[3], int n, remap_faces faces, result *r)
{
  int work[4 * MAX_N];

  memset(r, 0, sizeof *r);
  memcpy(r->xyz, xyz, (size_t)n * sizeof *xyz);
  r->num = rm_triangulate((const double(*)[3])xyz, n, faces, r->corner, r->centre, work);
}

static const double *corner_of(const result *r, int t, int k)
{
  const int v = r->corner[3 * t + k];
  return v == RM_CENTRE_POINT ? r->centre : r->xyz[v];
}

static bool uses_centre(const result *r)
{
  for (int k = 0; k < 3 * r->num; k++)
    if (r->corner[k] == RM_CENTRE_POINT) return true;
  return false;
}

static bool same_point(const double *a, const double *b) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }

/* True if triangle t of a is triangle s of b, with the same orientation (turned = 0) or the other (1). */
static bool same_triangle(const result *a, int t, const result *b, int s, int turned)
{
  for (int shift = 0; shift < 3; shift++) {
    bool same = true;

    for (int k = 0; k < 3; k++)
      same = same && same_point(corner_of(a, t, k), corner_of(b, s, ((turned ? 3 - k : k) + shift) % 3));
    if (same) return true;
  }
  return false;
}

/* True if a and b are one set of triangles. */
static bool same_set(const result *a, const result *b, int turned)
{
  bool used[MAX_N + 2] = {false};

  if (a->num != b->num) return false;
  for (int t = 0; t < a->num; t++) {
    int s = 0;

    while (s < b->num && (used[s] || !same_triangle(a, t, b, s, turned))) s++;
    if (s == b->num) return false;
    used[s] = true;
  }
  return true;
}

/* Times the edge a -> b is run through in edge order, less the times it is run through backwards. */
static int boundary_of_triangles(const result *r, const double *a, const double *b)
{
  int times = 0;

  for (int t = 0; t < r->num; t++)
    for (int k = 0; k < 3; k++) {
      const double *p = corner_of(r, t, k), *q = corner_of(r, t, (k + 1) % 3);

      times += (same_point(p, a) && same_point(q, b)) - (same_point(p, b) && same_point(q, a));
    }
  return times;
}
static int boundary_of_loop(double (*xyz)[3], int n, const double *a, const double *b)
{
  int times = 0;

  for (int i = 0; i < n; i++) {
    const double *p = xyz[i], *q = xyz[(i + 1) % n];

    times += (same_point(p, a) && same_point(q, b)) - (same_point(p, b) && same_point(q, a));
  }
  return times;
}

/* True if the triangles' boundary is the loop, no edge more, none less, and no triangle has a corner twice. */
static bool fits_loop(double (*xyz)[3], int n, const result *r)
{
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++)
      if (!same_point(xyz[i], xyz[j]) && boundary_of_triangles(r, xyz[i], xyz[j]) != boundary_of_loop(xyz, n, xyz[i], xyz[j]))
        return false;
  for (int t = 0; t < r->num; t++)
    for (int k = 0; k < 3; k++)
      if (same_point(corner_of(r, t, k), corner_of(r, t, (k + 1) % 3))) return false;
  for (int i = 0; i < n && uses_centre(r); i++)
    if (!same_point(r->centre, xyz[i]) && boundary_of_triangles(r, r->centre, xyz[i]) != 0) return false;
  return true;
}

static void add_area(const double *a, const double *b, const double *c, double area[3])
{
  for (int k = 0; k < 3; k++) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;

    area[k] += 0.5 * ((b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]));
  }
}
static double area_of_triangle(const result *r, int t)
{
  double area[3] = {0, 0, 0};

  add_area(corner_of(r, t, 0), corner_of(r, t, 1), corner_of(r, t, 2), area);
  return sqrt(area[0] * area[0] + area[1] * area[1] + area[2] * area[2]);
}
static double total_area(const result *r)
{
  double sum = 0;

  for (int t = 0; t < r->num; t++) sum += area_of_triangle(r, t);
  return sum;
}

/* Copy the loop, beginning elsewhere and perhaps backwards. */
static void rearrange(double (*in)[3], int n, int from, int step, double (*out)[3])
{
  for (int i = 0; i < n; i++) memcpy(out[i], in[((from + step * i) % n + n) % n], sizeof *out);
}

/* A star-shaped polygon about the origin, with radii between 1 - ragged and 1: in the xy plane if warp is 0, else anywhere. */
static int random_star(random_state *rnd, double ragged, double warp, double (*xyz)[3])
{
  const int    n    = 3 + random_below(rnd, 10);
  const double tilt = warp > 0 ? 3 * random_unit(rnd) : 0, lean = warp > 0 ? 3 * random_unit(rnd) : 0;

  for (int i = 0; i < n; i++) {
    const double angle = 2 * M_PI * (i + 0.3 * random_unit(rnd)) / n, radius = 1 - ragged * fabs(random_unit(rnd));
    const double x = radius * cos(angle), y = radius * sin(angle), z = warp * random_unit(rnd);
    const double x2 = x * cos(tilt) - z * sin(tilt), z2 = x * sin(tilt) + z * cos(tilt);

    xyz[i][0] = x2 * cos(lean) - y * sin(lean);
    xyz[i][1] = x2 * sin(lean) + y * cos(lean);
    xyz[i][2] = z2;
  }
  return n;
}

/* Any polygon at all: stars, arbitrary points, and loops that repeat points in a row, as spikes or by touching themselves. */
static int any_polygon(random_state *rnd, double (*xyz)[3])
{
  int n;

  if (random_below(rnd, 2)) {
    n = random_star(rnd, 0.8 * random_below(rnd, 2), 0.1 * random_below(rnd, 3), xyz);
  } else {
    n = 3 + random_below(rnd, 8);
    hard_points(rnd, random_below(rnd, NUM_KINDS), xyz, n);
  }
  if (random_below(rnd, 2))
    for (int more = random_below(rnd, 4); more > 0; more--) { /* a copy of some point, somewhere or beside itself */
      const int from = random_below(rnd, n), to = random_below(rnd, 2) ? from : random_below(rnd, n + 1);
      double    copy[3];

      memcpy(copy, xyz[from], sizeof copy);
      memmove(xyz[to + 1], xyz[to], (size_t)(n - to) * sizeof *xyz);
      memcpy(xyz[to], copy, sizeof copy);
      n++;
    }
  return n;
}

static void triangles_depend_on_neither_start_nor_direction_of_the_loop(void)
{
  random_state rnd       = {31};
  int          different = 0;
  double       xyz[MAX_N][3], other[MAX_N][3];
  result       a, b;

  for (int round = 0; round < 4 * ROUNDS; round++) {
    const int         n     = any_polygon(&rnd, xyz);
    const remap_faces faces = round & 1 ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL;
    const int         step  = random_below(&rnd, 2) ? 1 : -1;

    triangulate(xyz, n, faces, &a);
    rearrange(xyz, n, random_below(&rnd, n), step, other);
    triangulate(other, n, faces, &b);
    different += !same_set(&a, &b, step < 0);
    different += uses_centre(&a) && !same_point(a.centre, b.centre);
  }
  RT_EQ(different, 0);
}

static void the_boundary_of_the_triangles_is_the_loop(void)
{
  random_state rnd  = {32};
  int          open = 0, too_many = 0, centres = 0, parts = 0;
  double       xyz[MAX_N][3];
  result       r;

  for (int round = 0; round < 4 * ROUNDS; round++) {
    const int n = any_polygon(&rnd, xyz);

    triangulate(xyz, n, round & 1 ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL, &r);
    open += !fits_loop(xyz, n, &r);
    too_many += r.num > n + 2;
    centres += uses_centre(&r);
    parts += r.num > 0 && r.num < n - 2;
  }
  RT_EQ(open, 0);
  RT_EQ(too_many, 0);
  RT_CHECK(centres > ROUNDS / 4 && parts > ROUNDS / 10);
}

static void flat_faces_take_two_triangles_less_than_vertices_and_cover_them_once(void)
{
  random_state rnd   = {33};
  int          wrong = 0;
  double       xyz[MAX_N][3];
  result       r;

  for (int round = 0; round < 4 * ROUNDS; round++) {
    int    n = random_star(&rnd, round & 2 ? 0.9 : 0, 0, xyz), flat = random_below(&rnd, 3);
    double area[3] = {0, 0, 0};

    for (int i = 0; i < n; i++) {
      double grid[3]; /* flat exactly, and at an angle: z = x + 2 y */

      for (int k = 0; k < 2; k++) grid[k] = floor(0x1p20 * xyz[i][k]) * 0x1p-20;
      grid[2] = grid[0] + 2 * grid[1];
      memcpy(xyz[i], grid, sizeof grid);
    }
    for (; flat > 0; flat--, n++) { /* hanging vertices */
      const int i = random_below(&rnd, n), next = (i + 1) % n;
      double    middle[3];

      for (int k = 0; k < 3; k++) middle[k] = (xyz[i][k] + xyz[next][k]) / 2;
      memmove(xyz[i + 2], xyz[i + 1], (size_t)(n - 1 - i) * sizeof *xyz);
      memcpy(xyz[i + 1], middle, sizeof middle);
    }
    for (int i = 1; i + 1 < n; i++) add_area(xyz[0], xyz[i], xyz[i + 1], area);
    triangulate(xyz, n, round & 1 ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL, &r);
    wrong += r.num != n - 2 || uses_centre(&r) || !fits_loop(xyz, n, &r);
    wrong += !(fabs(total_area(&r) - sqrt(area[0] * area[0] + area[1] * area[1] + area[2] * area[2])) <= 1e-12);
    for (int t = 0; t < r.num; t++) wrong += !(area_of_triangle(&r, t) > 0);
  }
  RT_EQ(wrong, 0);
}

static void warped_faces_are_fans_about_their_mean(void)
{
  random_state rnd   = {34};
  int          wrong = 0, quads = 0;
  double       xyz[MAX_N][3];
  result       r;

  for (int round = 0; round < ROUNDS; round++) {
    const int n = random_star(&rnd, 0, 0.1, xyz);

    triangulate(xyz, n, REMAP_FACES_CENTRE, &r);
    wrong += r.num != (n == 3 ? 1 : n) || uses_centre(&r) != (n > 3);
    for (int t = 0; t < r.num && n > 3; t++)
      wrong += r.corner[3 * t + 2] != RM_CENTRE_POINT && r.corner[3 * t + 1] != RM_CENTRE_POINT;
    for (int k = 0; k < 3 && n > 3; k++) {
      double mean = 0;

      for (int i = 0; i < n; i++) mean += xyz[i][k] / n;
      wrong += !(fabs(mean - r.centre[k]) < 1e-15);
    }
    triangulate(xyz, n, REMAP_FACES_DIAGONAL, &r);
    wrong += r.num != n - 2 || uses_centre(&r);
    quads += n == 4;
  }
  RT_EQ(wrong, 0);
  RT_CHECK(quads > 0);
}

static void the_centre_stays_in_the_box_of_the_face(void)
{
  random_state rnd = {77};
  int          centres = 0, outside = 0;
  double       xyz[MAX_N][3];
  result       r;

  for (int round = 0; round < ROUNDS; round++) {
    const double level = random_unit(&rnd);

    for (int i = 0; i < 7; i++) { /* flat, but for the last bit of x */
      xyz[i][0] = random_below(&rnd, 2) ? level : nextafter(level, 2);
      xyz[i][1] = cos(i * 0.8975979);
      xyz[i][2] = sin(i * 0.8975979);
    }
    triangulate(xyz, 7, REMAP_FACES_CENTRE, &r);
    if (!uses_centre(&r)) continue;
    centres++;
    outside += r.centre[0] < level || r.centre[0] > nextafter(level, 2);
  }
  RT_CHECK(centres > ROUNDS / 4);
  RT_EQ(outside, 0);
}

static void a_quadrangle_is_cut_along_its_shorter_diagonal(void)
{
  double kite[4][3]   = {{0, 0, 0}, {3, -1, 0}, {4, 0, 0.5}, {3, 1, 0}};
  double square[4][3] = {{1, 1, 0}, {0, 1, 0}, {0, 0, 0}, {1, 0, 0}};
  result r;

  triangulate(kite, 4, REMAP_FACES_DIAGONAL, &r);
  RT_EQ(r.num, 2);
  RT_EQ(boundary_of_triangles(&r, kite[1], kite[3]), 0);
  RT_NEAR(total_area(&r), 3 + sqrt(1 + 0.25), 1e-14); /* 1-3 is the edge between the triangles */
  triangulate(square, 4, REMAP_FACES_CENTRE, &r);
  RT_EQ(r.num, 2);
  for (int t = 0; t < 2; t++) { /* a tie: the diagonal of the smallest vertex */
    bool smallest = false;

    for (int k = 0; k < 3; k++) smallest = smallest || r.corner[3 * t + k] == 2;
    RT_CHECK(smallest);
  }
}

static void a_concave_quadrangle_is_cut_inside(void)
{
  double dart[4][3] = {{0, 0, 0}, {4, -3, 0}, {1, 0, 0}, {4, 3, 0}}, warped[4][3];
  result r;

  memcpy(warped, dart, sizeof dart);
  warped[2][2] = 0.25;
  for (int side = 0; side < 2; side++) {
    triangulate(dart, 4, side ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL, &r);
    RT_EQ(r.num, 2);
    RT_NEAR(total_area(&r), 3.0, 1e-14);
    triangulate(warped, 4, side ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL, &r); /* the mean lies outside the dart */
    RT_EQ(r.num, 2);
    RT_CHECK(!uses_centre(&r));
    RT_NEAR(total_area(&r), 3.25, 1e-14);
  }
}

static void hanging_vertices_stay_corners_and_lie_on_no_diagonal(void)
{
  double triangle[6][3] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {1, 5, 0}};
  double square[8][3]   = {{0, 0, 1}, {1, 0, 1}, {2, 0, 1}, {2, 1, 1}, {2, 2, 1}, {1, 2, 1}, {0, 2, 1}, {0, 1, 1}};
  result r;

  triangulate(triangle, 6, REMAP_FACES_CENTRE, &r);
  RT_EQ(r.num, 4);
  for (int t = 0; t < r.num; t++) RT_NEAR(area_of_triangle(&r, t), 2.5, 1e-15);
  triangulate(square, 8, REMAP_FACES_CENTRE, &r);
  RT_EQ(r.num, 6);
  RT_NEAR(total_area(&r), 4.0, 1e-15);
  for (int t = 0; t < r.num; t++) RT_CHECK(area_of_triangle(&r, t) >= 0.5);
}

static void repeated_vertices_vanish(void)
{
  double collapsed[5][3] = {{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {1, 1, 2}, {0, 0, 0}};
  double spike[6][3]     = {{0, 0, 0}, {1, 0, 0}, {3, 0, 1}, {1, 0, 0}, {1, 1, 0}, {0, 1, 1}}, clean[4][3];
  double folded[4][3]    = {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}, {0, 1, 0}};
  double bow[6][3]       = {{0, 0, 0}, {-1, 1, 0}, {-1, -1, 0}, {0, 0, 0}, {1, -1, 0}, {1, 1, 0}};
  double point[3][3]     = {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}};
  result r, plain;

  triangulate(collapsed, 5, REMAP_FACES_CENTRE, &r);
  RT_EQ(r.num, 1);
  triangulate(spike, 6, REMAP_FACES_CENTRE, &r);
  memcpy(clean[0], spike[0], 2 * sizeof *clean);
  memcpy(clean[2], spike[4], 2 * sizeof *clean);
  triangulate(clean, 4, REMAP_FACES_CENTRE, &plain);
  RT_EQ(plain.num, 4);
  RT_CHECK(same_set(&r, &plain, 0));
  triangulate(folded, 4, REMAP_FACES_DIAGONAL, &r);
  RT_EQ(r.num, 0);
  triangulate(bow, 6, REMAP_FACES_DIAGONAL, &r); /* touches itself: two triangles, not four */
  RT_EQ(r.num, 2);
  RT_NEAR(total_area(&r), 2.0, 0.0);
  triangulate(point, 3, REMAP_FACES_DIAGONAL, &r);
  RT_EQ(r.num, 0);
}

static void faces_without_area_are_covered_by_triangles_without_area(void)
{
  double line[5][3] = {{0, 0, 0}, {1, 2, 3}, {3, 6, 9}, {2, 4, 6}, {0.5, 1, 1.5}};
  result r;

  for (int n = 3; n <= 5; n++)
    for (int faces = 0; faces < 2; faces++) {
      triangulate(line, n, faces ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL, &r);
      RT_EQ(r.num, n - 2);
      RT_NEAR(total_area(&r), 0.0, 0.0);
      RT_CHECK(fits_loop(line, n, &r));
    }
}

/* Whichever vertex comes first, whichever way the loop runs, and in whatever plane. */
static bool planar_convex(double (*xyz)[3], int n, bool want)
{
  bool same = true;

  for (int turn = 0; turn < 3; turn++)
    for (int start = 0; start < n; start++)
      for (int step = -1; step <= 1; step += 2) {
        double loop[MAX_N][3];

        for (int k = 0; k < n; k++)
          for (int c = 0; c < 3; c++) loop[k][c] = xyz[(start + n + step * k) % n][(c + turn) % 3];
        same = same && rm_is_planar_convex((const double(*)[3])loop, n) == want;
      }
  return same;
}

static void planar_convex_loops_are_told_from_all_others(void)
{
  double square[][3]   = {{1, 2, 3}, {164, 84, -11}, {90, 241, 47}, {-73, 159, 61}}, low[4][3];
  double straight[][3] = {{0, 0, 0}, {1, 0, 1}, {3, 0, 3}, {3, 1, 4}, {3, 5, 8}, {0, 5, 5}};
  double concave[][3]  = {{0, 0, 0}, {4, 0, 0}, {1, 1, 0}, {0, 4, 0}};
  double star[][3]     = {{0, 3, 0}, {2, -3, 0}, {-3, 1, 0}, {3, 1, 0}, {-2, -3, 0}};
  double twice[][3]    = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 0}, {2, 0, 0}, {0, 2, 0}};
  double bow[][3]      = {{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 2, 0}};
  double spike[][3]    = {{0, 0, 0}, {2, 0, 0}, {1, 0, 0}, {0, 2, 0}};
  double repeated[][3] = {{0, 0, 0}, {2, 0, 0}, {2, 0, 0}, {0, 2, 0}};
  double line[][3]     = {{0, 0, 0}, {1, 2, 3}, {3, 6, 9}, {2, 4, 6}};

  memcpy(low, square, sizeof low);
  low[2][1] = nextafter(low[2][1], 0);
  RT_CHECK(planar_convex(square, 4, true));
  RT_CHECK(planar_convex(straight, 6, true));
  RT_CHECK(planar_convex(square, 3, true));
  RT_CHECK(planar_convex(low, 4, false));
  RT_CHECK(planar_convex(concave, 4, false));
  RT_CHECK(planar_convex(star, 5, false));
  RT_CHECK(planar_convex(twice, 6, false));
  RT_CHECK(planar_convex(bow, 4, false));
  RT_CHECK(planar_convex(spike, 4, false));
  RT_CHECK(planar_convex(repeated, 4, false));
  RT_CHECK(planar_convex(line, 4, false));
}

RT_MAIN(RT_CASE(triangles_depend_on_neither_start_nor_direction_of_the_loop),
        RT_CASE(the_boundary_of_the_triangles_is_the_loop),
        RT_CASE(flat_faces_take_two_triangles_less_than_vertices_and_cover_them_once),
        RT_CASE(warped_faces_are_fans_about_their_mean), RT_CASE(the_centre_stays_in_the_box_of_the_face),
        RT_CASE(a_quadrangle_is_cut_along_its_shorter_diagonal),
        RT_CASE(a_concave_quadrangle_is_cut_inside), RT_CASE(hanging_vertices_stay_corners_and_lie_on_no_diagonal),
        RT_CASE(repeated_vertices_vanish), RT_CASE(faces_without_area_are_covered_by_triangles_without_area),
        RT_CASE(planar_convex_loops_are_told_from_all_others))
