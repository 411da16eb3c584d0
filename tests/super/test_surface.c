/* Closed surfaces, meshes of one cell each: booleans of two of them in every position, also where they share faces, edges or
 * a vertex, and a surface in a grid. Octahedra on the integer lattice, so that volumes and areas are exact and many faces
 * lie on each other. */
#include <remap/remap.h>
#include "meshes.h"
#include "rt.h"
#include "surfaces.h"
#include "views.h"

enum { UNION = REMAP_IN_BOTH | REMAP_IN_SOURCE | REMAP_IN_TARGET };

typedef struct result {
  remap_context       *ctx;
  tm_mesh             *mine[2];
  remap_supermesh_view v;
  remap_status         status;
} result;

/* The meshes are given up. */
static result combine(MPI_Comm comm, tm_mesh *a, tm_mesh *b, int keep)
{
  const remap_supermesh_options options = {.keep = keep, .pass_through = 1};
  tm_mesh                      *whole[2] = {a, b};
  result                        r;
  int                           rank, size;

  MPI_Comm_rank(comm, &rank), MPI_Comm_size(comm, &size);
  memset(&r, 0, sizeof r);
  RT_EQ(remap_create(comm, NULL, &r.ctx), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    int *deal    = tm_deal(whole[side], size, TM_SLABS, 1);
    r.mine[side] = tm_part(whole[side], deal, rank, 0);
    RT_EQ(remap_set_mesh(r.ctx, side, &r.mine[side]->view), REMAP_OK);
    free(deal), tm_free(whole[side]);
  }
  r.status = remap_supermesh(r.ctx, &options, &r.v);
  return r;
}

static void drop(result *r)
{
  remap_destroy(&r->ctx);
  for (int side = 0; side < 2; side++) tm_free(r->mine[side]);
}

/* What the boundary of the result encloses: faces with one cell. One rank. */
static double enclosed(const remap_supermesh_view *v)
{
  double sum = 0, a[3];

  for (int64_t f = 0; f < v->num_faces; f++) {
    if (v->face_neighbour[f] >= 0) continue;
    const double *p = v->node_xyz + 3 * (int64_t)v->face_node[v->face_offset[f]];
    view_area_vector(v, f, a);
    for (int c = 0; c < 3; c++) sum += a[c] * p[c] / 6;
  }
  return sum;
}

/* No face without area, by corners on a line. */
static void has_no_flat_face(const remap_supermesh_view *v)
{
  int64_t flat = 0;
  double  a[3];

  for (int64_t f = 0; f < v->num_faces; f++) {
    view_area_vector(v, f, a);
    flat += a[0] * a[0] + a[1] * a[1] + a[2] * a[2] < 1e-20;
  }
  RT_EQ(flat, 0);
}

typedef struct amount {
  int64_t cells;
  double  volume;
} amount;

static amount amount_of(tm_mesh *a, tm_mesh *b, int keep)
{
  result r   = combine(MPI_COMM_SELF, a, b, keep);
  amount got = {-1, NAN};

  if (RT_EQ(r.status, REMAP_OK)) {
    got = (amount){r.v.num_cells, 0};
    for (int64_t c = 0; c < r.v.num_cells; c++) got.volume += r.v.cell_volume[c];
    RT_NEAR(enclosed(&r.v), got.volume, 1e-9);
    has_no_flat_face(&r.v);
  } else {
    printf("# %s\n", remap_message(r.ctx));
  }
  drop(&r);
  return got;
}

static void every_position_adds_up(void)
{
  static const int shift[][4] = {{1, 0, 0, 4}, {2, 1, 0, 4}, {1, 1, 1, 4}, {2, 2, 0, 4}, {4, 4, 0, 4}, {8, 0, 0, 4},
                                 {4, 2, 2, 4}, {0, 0, 0, 2}, {2, 0, 0, 2}, {1, 1, 0, 2}, {3, 0, 0, 2}, {6, 0, 0, 2},
                                 {3, 3, 0, 2}, {9, 1, 0, 4}, {1, 2, 3, 3}, {5, 1, 2, 3}};

  for (size_t k = 0; k < sizeof shift / sizeof *shift; k++)
    for (int n = 2; n <= 4; n += 2) {
      const double o[3] = {0, 0, 0}, p[3] = {3 * shift[k][0], 3 * shift[k][1], 3 * shift[k][2]}, r = 3 * shift[k][3];
      const double a = 4. / 3 * 12 * 12 * 12, b = 4. / 3 * r * r * r, most = 1e-12 * a;
      const int    before = rt_failed_;
      amount       x[4];

      for (int h = 0; h < 4; h++)
        x[h] = amount_of(surfaces_octahedron(n, 12, o), surfaces_octahedron(3, r, p), h < 3 ? 1 << h : UNION);
      RT_NEAR(x[0].volume + x[1].volume, a, most);
      RT_NEAR(x[0].volume + x[2].volume, b, most);
      RT_NEAR(x[3].volume, a + b - x[0].volume, most);
      if (rt_failed_ > before) printf("# position %d, n %d\n", (int)k, n);
    }
}

static void identical_surfaces_are_one(void)
{
  const double o[3] = {0, 0, 0};

  for (int n = 1; n <= 6; n++) {
    result r = combine(MPI_COMM_SELF, surfaces_octahedron(n, 4, o), surfaces_octahedron(n, 4, o), UNION);

    RT_EQ(r.status, REMAP_OK);
    RT_EQ(r.v.num_cells, 1);
    RT_EQ(r.v.num_faces, 8 * n * n);
    RT_EQ(r.v.num_nodes, 4 * n * n + 2);
    RT_NEAR(r.v.cell_volume[0], 4. / 3 * 64, 1e-12);
    drop(&r);
    RT_EQ(amount_of(surfaces_octahedron(n, 4, o), surfaces_octahedron(n, 4, o), REMAP_IN_SOURCE).cells, 0);
    RT_EQ(amount_of(surfaces_octahedron(n, 4, o), surfaces_octahedron(n, 4, o), REMAP_IN_TARGET).cells, 0);
  }
}

/* The same skin from other triangles: none of either mesh is left over, and none of the other. */
static void surfaces_of_one_shape_leave_no_difference(void)
{
  const double o[3] = {1, 2, 3};

  RT_EQ(amount_of(surfaces_octahedron(3, 12, o), surfaces_octahedron(4, 12, o), REMAP_IN_SOURCE).cells, 0);
  RT_EQ(amount_of(surfaces_octahedron(3, 12, o), surfaces_octahedron(4, 12, o), REMAP_IN_TARGET).cells, 0);
  RT_EQ(amount_of(surfaces_octahedron(3, 12, o), surfaces_octahedron(4, 12, o), REMAP_IN_BOTH).cells, 1);
}

static void surfaces_that_only_touch_share_no_volume(void)
{
  static const double touching[][3] = {{8, 0, 0}, {4, 4, 0}, {3, 3, 2}, {4, 2, 2}, {0, 6, 2}};
  const double        o[3] = {0, 0, 0};

  for (int k = 0; k < 5; k++) {
    RT_EQ(amount_of(surfaces_octahedron(2, 4, o), surfaces_octahedron(4, 4, touching[k]), REMAP_IN_BOTH).cells, 0);
    RT_EQ(amount_of(surfaces_octahedron(2, 4, o), surfaces_octahedron(4, 4, touching[k]), UNION).cells, 2);
  }
}

/* ---- a surface in a grid ----------------------------------------------------------------------------------------- */

static void place(double xyz[3], const void *data)
{
  (void)data;
  for (int c = 0; c < 3; c++) xyz[c] = 12 * xyz[c] - 6;
}

/* The grid without the body, on any number of ranks: cells know their boxes, faces of the cut know the body's triangles. */
static void a_body_is_cut_from_a_grid(void)
{
  for (int warped = 0; warped < 2; warped++) {
    const double o[3] = {warped ? .1 : 0, 0, 0};
    tm_mesh     *body = surfaces_octahedron(4, 4, o);
    result       r    = combine(MPI_COMM_WORLD, tm_hexahedra((int[]){12, 12, 12}, place, NULL), body, REMAP_IN_SOURCE);
    double       sum[3] = {0, 0, 0}, all[3], a[3];

    RT_EQ(r.status, REMAP_OK);
    double  *given = tm_alloc_(r.mine[0]->view.num_cells, sizeof *given), *got = tm_alloc_(r.v.num_cells, sizeof *got);
    int32_t *tag = tm_alloc_(r.mine[1]->view.num_faces, sizeof *tag), *tagged = tm_alloc_(r.v.num_faces, sizeof *tagged);
    for (int64_t c = 0; c < r.mine[0]->view.num_cells; c++) given[c] = (double)r.mine[0]->global[c] + .5;
    for (int64_t f = 0; f < r.mine[1]->view.num_faces; f++) tag[f] = 7;
    RT_EQ(remap_supermesh_cell_values(r.ctx, REMAP_SOURCE, given, -1, got), REMAP_OK);
    for (int64_t c = 0; c < r.v.num_cells; c++) {
      RT_NEAR(got[c], (double)r.v.cell_ancestor[0][c] + .5, 0);
      RT_EQ(r.v.cell_ancestor[1][c], -1);
      sum[0] += r.v.cell_volume[c];
    }
    RT_EQ(remap_supermesh_cell_values(r.ctx, REMAP_TARGET, NULL, -1, got),
          r.mine[1]->view.num_cells || rt_size() > 1 ? REMAP_BAD_ARGUMENT : REMAP_OK);
    RT_EQ(remap_supermesh_face_values(r.ctx, REMAP_TARGET, tag, -1, tagged), REMAP_OK);
    for (int64_t f = 0, next = 0; f < r.v.num_faces; f++) {
      const bool beyond = next < r.v.num_beyond && r.v.beyond_face[next] == f;
      next += beyond;
      view_area_vector(&r.v, f, a);
      RT_EQ(tagged[f], r.v.face_from[1][f] >= 0 ? 7 : -1);
      if (tagged[f] == 7) sum[1] += .5 * sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
      else if (r.v.face_neighbour[f] < 0 && !beyond) sum[2] += .5 * sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    }
    MPI_Allreduce(sum, all, 3, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    RT_NEAR(all[0], 12. * 12 * 12 - 4. / 3 * 64, 1e-9);
    RT_NEAR(all[1], 8 * 16 * sqrt(3) / 2, 1e-9);
    RT_NEAR(all[2], 6. * 12 * 12, 1e-9);
    free(given), free(got), free(tag), free(tagged);
    drop(&r);
  }
}

static void an_inverted_surface_is_refused(void)
{
  const double o[3] = {0, 0, 0}, p[3] = {1, 0, 0};
  tm_mesh     *inverted = surfaces_octahedron(2, 4, o);

  for (int64_t f = 0; f < inverted->view.num_faces; f++) {
    const int64_t first = inverted->face_offset[f], x = inverted->face_node[first];
    inverted->face_node[first]     = inverted->face_node[first + 1];
    inverted->face_node[first + 1] = x;
  }
  result r = combine(MPI_COMM_SELF, inverted, surfaces_octahedron(2, 4, p), UNION);
  RT_EQ(r.status, REMAP_BAD_MESH);
  RT_CHECK(remap_message(r.ctx)[0] != 0);
  drop(&r);
}

static void what_is_wrong_is_told(void)
{
  const double            o[3] = {0, 0, 0};
  remap_supermesh_options options;
  remap_supermesh_view    v;
  remap_context          *ctx;
  tm_mesh                *a = surfaces_octahedron(2, 4, o);

  RT_EQ(remap_create(MPI_COMM_WORLD, NULL, &ctx), REMAP_OK);
  remap_supermesh_options_default(&options);
  RT_EQ(options.keep, REMAP_IN_BOTH);
  RT_EQ(remap_supermesh(ctx, &options, &v), REMAP_BAD_ORDER);
  RT_EQ(remap_supermesh_cell_values(ctx, REMAP_SOURCE, NULL, 0, NULL), REMAP_BAD_ORDER);
  for (int side = 0; side < 2; side++) RT_EQ(remap_set_mesh(ctx, side, &(remap_mesh){0}), REMAP_OK);
  RT_EQ(remap_supermesh(ctx, &options, &v), REMAP_OK);
  RT_EQ(v.global_cells, 0);
  RT_EQ(remap_supermesh(ctx, &options, NULL), REMAP_BAD_ARGUMENT);
  options.keep = 8;
  RT_EQ(remap_supermesh(ctx, &options, &v), REMAP_BAD_ARGUMENT);
  options.keep = rt_rank() == 0 ? REMAP_IN_BOTH : REMAP_IN_SOURCE;
  RT_EQ(remap_supermesh(ctx, &options, &v), rt_size() > 1 ? REMAP_BAD_ARGUMENT : REMAP_OK);
  RT_EQ(remap_supermesh(NULL, &options, &v), REMAP_BAD_ARGUMENT);
  tm_free(a);
  remap_destroy(&ctx);
}

RT_MAIN(RT_ALONE(every_position_adds_up), RT_ALONE(identical_surfaces_are_one),
        RT_ALONE(surfaces_of_one_shape_leave_no_difference), RT_ALONE(surfaces_that_only_touch_share_no_volume),
        RT_CASE(a_body_is_cut_from_a_grid), RT_ALONE(an_inverted_surface_is_refused), RT_CASE(what_is_wrong_is_told))
