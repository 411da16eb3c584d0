/* Meshes that are ugly but meshes: inverted, tangled and collapsed cells, faces without area, nodes given many times,
 * hanging nodes, cells of a hundred thousand faces. They are transferred like others, and what is inverted is reported:
 * through the public interface, on any number of ranks. */
#include "carried.h"
#include "surfaces.h"

/* A constant goes both ways, at second order with the default limiter, and stays constant and conserved; stats receives the
 * overlay's. Both meshes are given up. */
static void constant_stays(tm_mesh *source, tm_mesh *target, remap_stats *stats)
{
  carried w;

  if (carried_open(&w, MPI_COMM_WORLD, 2, source, target, 17)) {
    RT_EQ(remap_get_stats(w.ctx, stats), REMAP_OK);
    for (int to = 0; to < 2; to++) {
      remap_field_report report;

      for (int64_t c = 0; c < w.cells[1 - to]; c++) w.mean[1 - to][c] = 3;
      RT_CHECK(stats->max_closure_error[to] <= 1e-12);
      if (!carried_move(&w, to ? REMAP_FORWARD : REMAP_BACKWARD, 2, REMAP_LIMITER_AUTO, w.mean[1 - to], w.got[to], &report))
        continue;
      RT_CHECK(report.conservation_error <= 1e-14);
      for (int64_t c = 0; c < w.cells[to]; c++) RT_NEAR(w.got[to][c], 3, 1e-11); /* small volumes of tangled cells amplify */
    }
  }
  carried_close(&w);
}

static tm_mesh *warped(int n, double phase) { return tm_hexahedra((int[]){n, n, n}, tm_warp, &(tm_warping){.03, phase}); }

static double *node(tm_mesh *mesh, int n, int i, int j, int k)
{
  return mesh->xyz + 3 * (((int64_t)k * (n + 1) + j) * (n + 1) + i);
}

static void tangled_cells_carry_constants(void)
{
  for (int way = 0; way < 4; way++) {
    tm_mesh    *mesh[2] = {warped(5, .3), warped(4, .9)};
    const int   n       = way & 1 ? 4 : 5;
    double     *p       = node(mesh[way & 1], n, 2, 2, 2);
    remap_stats stats   = {0};

    if (way < 2)
      p[0] -= 1.2 / n; /* through the faces behind */
    else
      memcpy(p, (double[]){2.3 / n, 1.1 / n, 1.2 / n}, 3 * sizeof *p);
    constant_stays(mesh[0], mesh[1], &stats);
    RT_EQ(stats.inverted_cells[0] + stats.inverted_cells[1], 0); /* none is negative as a whole */
  }
}

/* Nodes swapped with their neighbours, more and more of them. */
static void tangled_cells_conserve_any_field(void)
{
  const int n = 4;

  for (int m = 2; m <= 6; m++) {
    tm_mesh *tangled = warped(n, .3);
    uint64_t seed    = (uint64_t)m;
    carried  w;

    for (int k = 0; k < m; k++) {
      double *p = node(tangled, n, 1 + (int)tm_random(&seed, 2), 1 + (int)tm_random(&seed, 2), 1 + (int)tm_random(&seed, 2));
      double *q = p + (tm_random(&seed, 2) ? 3 : 3 * (n + 1));
      for (int c = 0; c < 3; c++) {
        const double x = p[c];
        p[c]           = q[c];
        q[c]           = x;
      }
    }
    if (carried_open(&w, MPI_COMM_WORLD, 2, tangled, warped(m, .9), 17))
      for (int to = 0; to < 2; to++) {
        remap_field_report report;

        for (int64_t c = 0; c < w.cells[1 - to]; c++) w.mean[1 - to][c] = 1 + sin(1.7 * (double)c);
        if (carried_move(&w, to ? REMAP_FORWARD : REMAP_BACKWARD, 2, REMAP_LIMITER_NONE, w.mean[1 - to], w.got[to], &report))
          RT_CHECK(report.conservation_error <= 1e-14);
      }
    carried_close(&w);
  }
}

/* One column of cells is turned over: every cell of it has its volume, negative. */
static void inverted_cells_are_counted_and_the_worst_is_named(void)
{
  const int   n       = 4;
  tm_mesh    *mesh[2] = {tm_hexahedra((int[]){n, n, n}, NULL, NULL), warped(5, .2)};
  remap_stats stats   = {0};

  for (int j = 0; j <= n; j++)
    for (int k = 0; k <= n; k++) {
      double *p = node(mesh[0], n, 1, j, k), *q = node(mesh[0], n, 2, j, k);
      p[0] = .5, q[0] = .25; /* cells (1, j, k) are negative, their neighbours half as large again */
    }
  node(mesh[0], n, 2, 0, 0)[0] = .125; /* and cell (1, 0, 0) the most */
  constant_stays(mesh[0], mesh[1], &stats);
  RT_EQ(stats.inverted_cells[0], n * n);
  RT_EQ(stats.worst_inverted_cell[0], 1);
  RT_EQ(stats.inverted_cells[1], 0);
}

/* Rings about an axis: the innermost cells have an edge and a face that are points and lines. */
static void to_rings(double x[3], const void *data)
{
  const double r = x[0], angle = 1.5 * x[1];

  (void)data;
  x[0] = r * cos(angle);
  x[1] = r * sin(angle);
}

static void cells_collapsed_to_an_axis_carry_constants(void)
{
  remap_stats stats = {0};

  constant_stays(tm_hexahedra((int[]){4, 6, 3}, to_rings, NULL), tm_hexahedra((int[]){4, 6, 3}, to_rings, NULL), &stats);
  RT_EQ(stats.pairs, 4 * 6 * 3);
  constant_stays(tm_hexahedra((int[]){4, 6, 3}, to_rings, NULL), warped(4, .3), &stats);
  RT_CHECK(stats.overlap_volume > 0);
}

/* Every face gets nodes of its own; nodes are recognised by their coordinates. */
static tm_mesh *scattered(tm_mesh *mesh)
{
  const int64_t corners = mesh->face_offset[mesh->view.num_faces];
  double       *xyz     = tm_alloc_(3 * corners, sizeof *xyz);

  for (int64_t k = 0; k < corners; k++) {
    memcpy(xyz + 3 * k, mesh->xyz + 3 * mesh->face_node[k], 3 * sizeof *xyz);
    mesh->face_node[k] = k;
  }
  free(mesh->xyz);
  mesh->xyz            = xyz;
  mesh->view.node_xyz  = xyz;
  mesh->view.num_nodes = corners;
  return mesh;
}

static void nodes_given_once_per_face_are_the_same_nodes(void)
{
  remap_stats stats = {0};

  constant_stays(scattered(warped(4, .3)), warped(4, .3), &stats);
  RT_EQ(stats.pairs, 64);
  RT_EQ(stats.cells_by_cover[1][REMAP_COVERED], 64);
}

static void hanging_nodes_carry_constants(void)
{
  remap_stats stats = {0};

  constant_stays(tm_refined((int[]){4, 4, 4}, tm_right_half, tm_warp, &(tm_warping){.03, .3}), warped(5, .8), &stats);
  RT_EQ(stats.inverted_cells[0] + stats.inverted_cells[1], 0);
}

static void a_cell_of_a_hundred_thousand_faces_carries_constants(void)
{
  for (int way = 0; way < 2; way++) {
    tm_mesh    *ball = surfaces_ball(112, .3, (double[]){.5, .45, .55}), *grid = warped(6, .3);
    remap_stats stats = {0};

    constant_stays(way ? grid : ball, way ? ball : grid, &stats);
    RT_EQ(stats.cells_by_cover[way][REMAP_COVERED], 1);
    RT_NEAR(stats.overlap_volume, stats.volume[way], 1e-13);
    RT_NEAR(stats.volume[way], 4 * M_PI / 3 * .027, 2e-5);
  }
}

/* What remap_build makes of a mesh on itself in another unit. */
static remap_status built_in_unit(double unit, char message[256])
{
  const double   m[12] = {unit, 0, 0, 0, 0, unit, 0, 0, 0, 0, unit, 0};
  tm_mesh       *mesh = warped(3, .3), *mine = tm_part(mesh, (int[27]){0}, rt_rank(), 0);
  remap_context *ctx = NULL;
  remap_status   status;

  tm_move(mine, tm_affine, m);
  RT_EQ(remap_create(MPI_COMM_WORLD, NULL, &ctx), REMAP_OK);
  for (int side = 0; side < 2; side++) RT_EQ(remap_set_mesh(ctx, (remap_side)side, &mine->view), REMAP_OK);
  status = remap_build(ctx);
  snprintf(message, 256, "%s", remap_message(ctx));
  remap_destroy(&ctx);
  tm_free(mesh);
  tm_free(mine);
  return status;
}

static void a_unit_in_which_volumes_are_no_doubles_is_refused_by_a_message(void)
{
  static const double refused[] = {1e105, 1e70, 1e-105, 1e-70}, good[] = {1e55, 1e-55};
  char                message[256];

  for (int k = 0; k < 4; k++) {
    RT_EQ(built_in_unit(refused[k], message), REMAP_BAD_MESH);
    RT_CHECK(strstr(message, "no doubles in this unit") != NULL);
  }
  for (int k = 0; k < 2; k++) RT_EQ(built_in_unit(good[k], message), REMAP_OK);
}

RT_MAIN(RT_CASE(a_unit_in_which_volumes_are_no_doubles_is_refused_by_a_message), RT_CASE(tangled_cells_carry_constants),
        RT_CASE(tangled_cells_conserve_any_field), RT_CASE(inverted_cells_are_counted_and_the_worst_is_named),
        RT_CASE(cells_collapsed_to_an_axis_carry_constants), RT_CASE(nodes_given_once_per_face_are_the_same_nodes),
        RT_CASE(hanging_nodes_carry_constants), RT_CASE(a_cell_of_a_hundred_thousand_faces_carries_constants))
