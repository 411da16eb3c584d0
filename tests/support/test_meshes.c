/* The makers of test meshes make what they say: closed cells, conformal faces, the volume of the cube, parts that add up. */
#include "meshes.h"
#include "rt.h"

/* Signed volume of every cell about the origin by fans about the faces' means; malloc'ed. Sum in *total. */
static double *volumes(const remap_mesh *mesh, double *total)
{
  double *volume = calloc((size_t)mesh->num_cells + 1, sizeof *volume);

  for (int64_t f = 0; f < mesh->num_faces; f++) {
    const int64_t *loop = mesh->face_node + mesh->face_offset[f], n = mesh->face_offset[f + 1] - mesh->face_offset[f];
    double         c[3] = {0, 0, 0}, sum = 0;

    for (int64_t i = 0; i < n; i++)
      for (int d = 0; d < 3; d++) c[d] += mesh->node_xyz[3 * loop[i] + d] / (double)n;
    for (int64_t i = 0; i < n; i++) {
      const double *a = mesh->node_xyz + 3 * loop[i], *b = mesh->node_xyz + 3 * loop[(i + 1) % n];

      sum += c[0] * (a[1] * b[2] - a[2] * b[1]) + c[1] * (a[2] * b[0] - a[0] * b[2]) + c[2] * (a[0] * b[1] - a[1] * b[0]);
    }
    volume[mesh->face_owner[f]] += sum / 6;
    if (mesh->face_neighbour[f] >= 0) volume[mesh->face_neighbour[f]] -= sum / 6;
  }
  *total = 0;
  for (int64_t c = 0; c < mesh->num_cells; c++) *total += volume[c];
  return volume;
}

typedef struct half_edge {
  int64_t cell, from, to;
} half_edge;
static int by_half_edge(const void *x, const void *y)
{
  const half_edge *g = x, *h = y;

  if (g->cell != h->cell) return g->cell < h->cell ? -1 : 1;
  if (g->from != h->from) return g->from < h->from ? -1 : 1;
  return (g->to > h->to) - (g->to < h->to);
}

/* Every edge of every cell is run along once in each direction by the cell's faces. */
static int cells_are_closed(const remap_mesh *mesh)
{
  half_edge *edge  = malloc((size_t)(2 * mesh->face_offset[mesh->num_faces] + 1) * sizeof *edge);
  int64_t    count = 0, wrong = 0;

  for (int64_t f = 0; f < mesh->num_faces; f++) {
    const int64_t *loop = mesh->face_node + mesh->face_offset[f], n = mesh->face_offset[f + 1] - mesh->face_offset[f];

    wrong += n < 3;
    for (int64_t i = 0; i < n; i++) {
      const int64_t from = loop[i], to = loop[(i + 1) % n];

      edge[count++] = (half_edge){mesh->face_owner[f], from, to};
      if (mesh->face_neighbour[f] >= 0) edge[count++] = (half_edge){mesh->face_neighbour[f], to, from};
    }
  }
  qsort(edge, (size_t)count, sizeof *edge, by_half_edge);
  for (int64_t i = 0; i < count; i++) {
    const half_edge back = {edge[i].cell, edge[i].to, edge[i].from};

    wrong += i > 0 && by_half_edge(&edge[i - 1], &edge[i]) == 0;
    wrong += bsearch(&back, edge, (size_t)count, sizeof *edge, by_half_edge) == NULL;
  }
  free(edge);
  return wrong == 0;
}

/* Faces of the boundary; for the unit cube at rest they lie on its sides. */
static int64_t boundary_faces(const remap_mesh *mesh)
{
  int64_t count = 0;

  for (int64_t f = 0; f < mesh->num_faces; f++) count += mesh->face_neighbour[f] < 0;
  return count;
}

/* Check a mesh, whose total volume should be `want`, and free it. */
static void check(tm_mesh *mesh, int64_t num_cells, double want)
{
  double  total, *volume = volumes(&mesh->view, &total);
  int64_t not_positive = 0;

  RT_EQ(mesh->view.num_cells, num_cells);
  RT_CHECK(cells_are_closed(&mesh->view));
  RT_NEAR(total, want, 1e-13);
  for (int64_t c = 0; c < num_cells; c++) not_positive += !(volume[c] > 0);
  RT_EQ(not_positive, 0);
  free(volume);
  tm_free(mesh);
}

static const int        n[3] = {5, 4, 3};
static const tm_warping warp = {.02, .7};

static tm_mesh *left_and_right(const int m[3], tm_map map, const void *data) { return tm_refined(m, tm_right_half, map, data); }
static tm_mesh *checkered(const int m[3], tm_map map, const void *data) { return tm_refined(m, tm_checkered, map, data); }

typedef tm_mesh *(*maker)(const int n[3], tm_map map, const void *data);
static const struct {
  maker   make;
  int64_t cells;
} makers[] = {{tm_hexahedra, 60},
              {tm_tetrahedra, 360},
              {tm_prisms, 120},
              {tm_pyramids, 360},
              {tm_mixed, 12 * (1 + 2 + 6 + 7 + 6)},
              {left_and_right, 24 + 8 * 36},
              {checkered, 30 + 8 * 30},
              {tm_dual, 6 * 5 * 4}};

enum { NUM_MAKERS = sizeof makers / sizeof *makers };

static void cells_are_closed_and_fill_the_cube(void)
{
  for (int m = 0; m < NUM_MAKERS; m++) check(makers[m].make(n, NULL, NULL), makers[m].cells, 1);
}

/* (x + y z / 2, y, z + x / 4) has the Jacobian 1 - y / 8. */
static void shear(double xyz[3], const void *data)
{
  (void)data;
  xyz[0] += xyz[1] * xyz[2] / 2;
  xyz[2] += xyz[0] / 4;
}

static void maps_move_the_nodes(void)
{
  const double stretch[12] = {2, 0, 0, 10, 0, 3, 0, 20, 0, 0, .5, 30};

  for (int m = 0; m < NUM_MAKERS; m++) {
    tm_mesh *mesh = makers[m].make(n, shear, NULL);
    double   total, *volume = volumes(&mesh->view, &total);

    RT_CHECK(cells_are_closed(&mesh->view));
    RT_NEAR(total, 1, 1e-2); /* the boundary's polygons are not the curved one */
    free(volume);
    tm_free(mesh);
    mesh = makers[m].make(n, tm_warp, &warp);
    tm_move(mesh, tm_affine, stretch);
    RT_NEAR(mesh->xyz[1] / 3, 20 / 3., 1);
    volume = volumes(&mesh->view, &total);
    RT_NEAR(total, 3, 0.3);
    free(volume);
    tm_free(mesh);
  }
}

static void mixed_mesh_holds_all_four_kinds(void)
{
  tm_mesh *mesh  = tm_mixed(n, NULL, NULL);
  int     *faces = calloc((size_t)mesh->view.num_cells, sizeof *faces),
      *corners   = calloc((size_t)mesh->view.num_cells, sizeof *corners);
  int tets = 0, pyramids = 0, prisms = 0, hexahedra = 0;

  for (int64_t f = 0; f < mesh->view.num_faces; f++)
    for (int side = 0; side < 2; side++) {
      const int64_t cell = side ? mesh->neighbour[f] : mesh->owner[f];

      if (cell < 0) continue;
      faces[cell]++;
      corners[cell] += (int)(mesh->face_offset[f + 1] - mesh->face_offset[f]);
    }
  for (int64_t c = 0; c < mesh->view.num_cells; c++) {
    tets += faces[c] == 4 && corners[c] == 12;
    pyramids += faces[c] == 5 && corners[c] == 16;
    prisms += faces[c] == 5 && corners[c] == 18;
    hexahedra += faces[c] == 6 && corners[c] == 24;
  }
  RT_EQ(hexahedra, 12);
  RT_EQ(prisms, 24);
  RT_EQ(pyramids, 12 * (6 + 5));
  RT_EQ(tets, 12 * (2 + 6));
  free(faces);
  free(corners);
  tm_free(mesh);
}

static void hanging_nodes_make_larger_polygons(void)
{
  tm_mesh *mesh = checkered(n, NULL, NULL);
  int64_t  most = 0;

  for (int64_t f = 0; f < mesh->view.num_faces; f++) {
    const int64_t corners = mesh->face_offset[f + 1] - mesh->face_offset[f];

    if (corners > most) most = corners;
  }
  RT_EQ(most, 8);
  tm_free(mesh);
}

static void benchmark_mesh_is_the_formula_of_its_nodes(void)
{
  const int    m = 6, i = 2, j = 5, k = 3;
  tm_mesh     *mesh = tm_benchmark(m, .7, .3, .5);
  const double w = 2 * M_PI, x = (double)i / m, y = (double)j / m, z = (double)k / m;
  const double q     = .03 * sin(w * x + .7) * sin(w * y + .7) * sin(w * z + .7),
               p[3]  = {x + q - .5, y + .7 * q - .5, z - .9 * q - .5};
  const double  r[3] = {cos(.3) * p[0] - sin(.3) * p[1], sin(.3) * p[0] + cos(.3) * p[1], p[2]};
  const double *got  = mesh->xyz + 3 * (((k * (m + 1)) + j) * (m + 1) + i);

  RT_EQ(mesh->view.num_nodes, (m + 1) * (m + 1) * (m + 1));
  RT_NEAR(got[0], .5 * r[0], 1e-15);
  RT_NEAR(got[1], .5 * (cos(.3) * r[1] - sin(.3) * r[2]), 1e-15);
  RT_NEAR(got[2], .5 * (sin(.3) * r[1] + cos(.3) * r[2]), 1e-15);
  tm_free(mesh);
}

static void zones_fill_the_cube_but_for_the_gap(void)
{
  const int    fine[3] = {4, 6, 5};
  const double gaps[]  = {0, 1e-3, -1e-3, 0x1p-53, -0x1p-54};

  for (int g = 0; g < 5; g++) {
    tm_mesh *mesh = tm_two_zones(n, fine, gaps[g], NULL, NULL);

    RT_EQ(mesh->view.num_zones, 2);
    RT_EQ(mesh->view.zone_cell_offset[1], 60);
    RT_EQ(mesh->view.zone_cell_offset[2], 180);
    RT_STR(mesh->view.zone_name[1], "right");
    check(mesh, 180, 1 - gaps[g]);
  }
}

static void zones_that_match_share_coordinates(void)
{
  tm_mesh      *mesh   = tm_two_zones(n, n, 0, tm_warp, &warp);
  int64_t       shared = 0;
  const int64_t half   = mesh->view.num_nodes / 2;

  for (int64_t v = 0; v < half; v++)
    for (int64_t w = half; w < 2 * half; w++) shared += memcmp(mesh->xyz + 3 * v, mesh->xyz + 3 * w, 3 * sizeof(double)) == 0;
  RT_EQ(shared, 5 * 4);
  tm_free(mesh);
}

/* Each cell is on one rank, closed there and of the same volume, whichever way cells are dealt and renumbered. */
static void parts_add_up_to_the_whole(void)
{
  for (int m = 0; m < NUM_MAKERS; m++) {
    tm_mesh *whole = makers[m].make(n, tm_warp, &warp);
    double   total, *want = volumes(&whole->view, &total);

    for (int how = TM_SLABS; how <= TM_LAST; how++)
      for (uint64_t seed = 0; seed < 3; seed++) {
        int      *rank_of_cell = tm_deal(whole, rt_size(), (tm_dealing)how, seed);
        tm_mesh  *part         = tm_part(whole, rank_of_cell, rt_rank(), seed);
        double    here, *volume = volumes(&part->view, &here), sum = 0;
        long long mine = part->view.num_cells, all = 0;
        int64_t   wrong = 0;

        MPI_Allreduce(&mine, &all, 1, MPI_LONG_LONG, MPI_SUM, MPI_COMM_WORLD);
        MPI_Allreduce(&here, &sum, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
        RT_EQ(all, whole->view.num_cells);
        RT_NEAR(sum, total, 1e-13);
        RT_CHECK(cells_are_closed(&part->view));
        for (int64_t c = 0; c < part->view.num_cells; c++) {
          const int64_t global = part->view.cell_global[c];

          wrong += rank_of_cell[global] != rt_rank() || !(fabs(volume[c] - want[global]) < 1e-15);
        }
        RT_EQ(wrong, 0);
        if (how == TM_LAST && rt_rank() < rt_size() - 1) RT_EQ(part->view.num_nodes, 0);
        free(volume);
        free(rank_of_cell);
        tm_free(part);
      }
    free(want);
    tm_free(whole);
  }
}

static void renumbering_changes_numbers_only(void)
{
  tm_mesh *whole = tm_two_zones(n, n, 0, NULL, NULL), *part = tm_part(whole, NULL, 0, 5);
  int64_t  moved = 0;

  RT_EQ(part->view.num_cells, whole->view.num_cells);
  RT_EQ(part->view.num_nodes, whole->view.num_nodes);
  RT_EQ(boundary_faces(&part->view), boundary_faces(&whole->view));
  RT_EQ(part->view.zone_cell_offset[2], 120);
  for (int64_t c = 0; c < part->view.num_cells; c++) moved += part->view.cell_global[c] != c;
  RT_CHECK(moved > 60);
  tm_free(part);
  tm_free(whole);
}

RT_MAIN(RT_CASE(cells_are_closed_and_fill_the_cube), RT_CASE(maps_move_the_nodes), RT_CASE(mixed_mesh_holds_all_four_kinds),
        RT_CASE(hanging_nodes_make_larger_polygons), RT_CASE(benchmark_mesh_is_the_formula_of_its_nodes),
        RT_CASE(zones_fill_the_cube_but_for_the_gap), RT_CASE(zones_that_match_share_coordinates),
        RT_CASE(parts_add_up_to_the_whole), RT_CASE(renumbering_changes_numbers_only))
