/* Concave faces cut into convex ones: where they are whole faces of an operand, along edges of its triangles; areas and volumes
 * stay, cells stay closed. */
#include "super.h"

#include <time.h>

enum { MAX_POINTS = 12 };

/* A prism over the polygon of n points, counter-clockwise: one cell, 0 <= z <= 1. */
static tm_mesh *prism(int n, const double (*xy)[2])
{
  tm_builder_ b    = {.num_cells = 1};
  int64_t    *id, *node = tm_alloc_(n > 4 ? n : 4, sizeof *node);
  tm_mesh    *mesh;

  for (int f = 0; f < n + 2; f++) { /* below, above, then the sides */
    const int64_t side[4] = {f - 2, (f - 1) % n, n + (f - 1) % n, n + f - 2};

    memcpy(node, side, sizeof side);
    for (int k = 0; k < n && f < 2; k++) node[k] = f ? n + k : n - 1 - k;
    tm_face_(&b, 0, f < 2 ? n : 4, node);
  }
  mesh = tm_finish_(&b, 2 * n, &id);
  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    memcpy(mesh->xyz + 3 * v, xy[id[v] % n], sizeof *xy);
    mesh->xyz[3 * v + 2] = id[v] < n ? 0 : 1;
  }
  free(id), free(node);
  return mesh;
}

/* Points around the z axis, those at odd places nearer to it. */
static tm_mesh *star_of(uint64_t seed)
{
  double xy[MAX_POINTS][2];

  for (int k = 0; k < MAX_POINTS; k++) {
    const double radius = k % 2 ? .5 + .05 * (double)tm_random(&seed, 10) : 1.5 + .1 * (double)tm_random(&seed, 10);
    const double angle  = 2 * M_PI * (1000 * k / MAX_POINTS + (int)tm_random(&seed, 30)) / 1000;

    xy[k][0] = rint(64 * radius * cos(angle)) / 64;
    xy[k][1] = rint(64 * radius * sin(angle)) / 64;
  }
  return prism(MAX_POINTS, (const double (*)[2])xy);
}

/* The cells with concave faces cut; *whole those without; *seconds of processor time for the former. */
static super split(const tm_mesh *a, const tm_mesh *b, remap_faces faces, const rm_cells **whole, double *seconds)
{
  const rm_cells_choice choice = {.keep = SUPER_UNION, .split_concave = true};
  super                 s      = super_of(a, b, faces, NULL, SUPER_UNION);
  const rm_overlay     *o;

  *whole = s.cells;
  if (!RT_EQ(s.status, REMAP_OK)) return s;
  RT_EQ(rm_overlay_build(s.l->arena, s.mesh, &s.l->part, NULL, &o, &s.l->reason), REMAP_OK);
  const clock_t start = clock();
  s.status            = rm_cells_build(s.l->arena, &s.l->part, o, NULL, &choice, &s.cells, &s.l->reason);
  *seconds            = (double)(clock() - start) / CLOCKS_PER_SEC;
  RT_EQ(s.status, REMAP_OK);
  return s;
}

static double total_area(const rm_cells *m)
{
  double sum = 0, a[3];

  for (rm_lid f = 0; f < m->num_faces; f++) {
    super_area_vector_(m, f, a);
    sum += sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
  }
  return sum;
}

/* Turns the other way of faces, which are planar here, by more than rounding. */
static int64_t turns_back(const rm_cells *m)
{
  int64_t num = 0;

  for (rm_lid f = 0; f < m->num_faces; f++) {
    const rm_lid *v = m->face_vertex + m->face_offset[f], n = (rm_lid)(m->face_offset[f + 1] - m->face_offset[f]);
    double        a[3], size;

    super_area_vector_(m, f, a);
    size = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    for (rm_lid k = 0; k < n; k++) {
      const double *p = m->vertex[v[k]], *q = m->vertex[v[(k + 1) % n]], *r = m->vertex[v[(k + 2) % n]];
      double        turn = 0;

      for (int c = 0; c < 3; c++) {
        const int x = (c + 1) % 3, y = (c + 2) % 3;
        turn += a[c] * ((q[x] - p[x]) * (r[y] - q[y]) - (q[y] - p[y]) * (r[x] - q[x]));
      }
      num += turn < -1e-12 * size;
    }
  }
  return num;
}

static bool has_edge(const rm_trimesh *m, rm_lid a, rm_lid b)
{
  for (rm_lid k = m->vertex_edge_offset[a]; k < m->vertex_edge_offset[a + 1]; k++) {
    const rm_lid *e = m->edge[m->vertex_edge[k]];
    if (e[0] == b || e[1] == b) return true;
  }
  return false;
}

/* Edges between vertices of mesh 1 that are none of its triangles'. */
static int64_t strange_edges(const super *s)
{
  const rm_cells *m   = s->cells;
  int64_t         num = 0;

  for (rm_lid f = 0; f < m->num_faces; f++)
    for (uint32_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++) {
      const uint32_t   next = k + 1 < m->face_offset[f + 1] ? k + 1 : m->face_offset[f];
      const rm_feature a = m->vertex_spot[m->face_vertex[k]].at[0], b = m->vertex_spot[m->face_vertex[next]].at[0];

      num += a.kind == RM_ON_VERTEX && b.kind == RM_ON_VERTEX && !has_edge(s->mesh[0], a.id, b.id);
    }
  return num;
}

static void whole_faces_are_cut_along_their_triangles(void)
{
  static const double away[12] = {.5, 0, 0, 4, 0, .5, 0, 4, 0, 0, .5, 4};

  for (uint64_t seed = 1; seed <= 20; seed++) {
    tm_mesh        *a = star_of(seed), *b = tm_hexahedra((int[]){1, 1, 1}, NULL, NULL);
    const rm_cells *whole;
    double          seconds;
    super           s;

    tm_move(b, tm_affine, away);
    s = split(a, b, seed % 2 ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL, &whole, &seconds);
    if (s.status == REMAP_OK) {
      RT_CHECK(s.cells->num_faces > whole->num_faces);
      RT_EQ(turns_back(s.cells), 0);
      RT_EQ(strange_edges(&s), 0);
      RT_NEAR(total_area(s.cells), total_area(whole), 1e-13 * total_area(whole));
      super_check(&s, 0, false);
    }
    laid_free(s.l);
    tm_free(a);
    tm_free(b);
  }
}

static void pieces_of_faces_are_convex_too(void)
{
  static const double over[12] = {2, 0, 0, -.4, 0, 3, 0, -.3, 0, 0, 2, -.6};

  for (uint64_t seed = 1; seed <= 20; seed++) {
    tm_mesh        *a = star_of(seed);
    tm_mesh        *b = seed % 3 ? star_of(seed + 100) : tm_refined((int[]){2, 2, 2}, tm_checkered, NULL, NULL);
    const rm_cells *whole;
    double          seconds;
    super           s;

    tm_move(b, tm_affine, over);
    s = split(a, b, seed % 2 ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL, &whole, &seconds);
    if (s.status == REMAP_OK) {
      RT_CHECK(s.cells->num_faces > whole->num_faces);
      RT_EQ(turns_back(s.cells), 0);
      RT_NEAR(total_area(s.cells), total_area(whole), 1e-13 * total_area(whole));
      super_check(&s, -1, false); /* stars that cross leave handles */
    }
    laid_free(s.l);
    tm_free(a);
    tm_free(b);
  }
}

/* A comb of n teeth, of different lengths: seconds of processor time for its cells with concave faces cut, the least of
 * three. */
static double time_of_comb(int n)
{
  double (*xy)[2] = tm_alloc_(2 * n + 3, sizeof *xy), least = INFINITY;

  memcpy(xy, (const double[2][2]){{0, -20}, {2 * n, -20}}, 2 * sizeof *xy);
  for (int k = 0; k <= 2 * n; k++) xy[2 + k][0] = 2 * n - k, xy[2 + k][1] = k % 2 ? -1 - k * 7 % 11 : k * 5 % 13;
  tm_mesh *a = prism(2 * n + 3, (const double (*)[2])xy), *b = tm_hexahedra((int[]){1, 1, 1}, NULL, NULL);
  tm_move(b, tm_affine, (const double[12]){1, 0, 0, -9, 0, 1, 0, -9, 0, 0, 1, -9});
  for (int k = 0; k < 3; k++) {
    const rm_cells *whole;
    double          seconds = INFINITY;
    super           s       = split(a, b, REMAP_FACES_DIAGONAL, &whole, &seconds);

    least = fmin(least, seconds);
    if (s.status == REMAP_OK) RT_CHECK(s.cells->num_faces > whole->num_faces + n);
    if (s.status == REMAP_OK && n < 200) RT_EQ(turns_back(s.cells), 0);
    laid_free(s.l);
  }
  tm_free(a), tm_free(b), free(xy);
  return least;
}

/* 16 times as many corners: 256 times the time if every cut looked at all of them. */
static void faces_may_have_many_corners(void)
{
  const double few = time_of_comb(100), many = time_of_comb(1600);
  RT_CHECK(many < 64 * few);
}

RT_MAIN(RT_CASE(whole_faces_are_cut_along_their_triangles), RT_CASE(pieces_of_faces_are_convex_too),
        RT_CASE(faces_may_have_many_corners))
