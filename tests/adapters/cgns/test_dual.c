/* The median-dual mesh: a cell about every vertex, closed, of positive volume, filling the space of the cells, on any number of
 * ranks; and what is transferred between such meshes. */
#include "files.h"

static rcgns_file *open_at_vertices(const char *path)
{
  rcgns_options how;

  rcgns_options_default(&how);
  how.location = RCGNS_VERTICES;
  return cf_open(path, &how);
}

/* A file with one zone of polyhedra; the mesh is freed. */
static void write_mesh(tm_mesh *mesh, const char *path)
{
  const rcgns_new_zone zone = {.name = "Zone", .mesh = &mesh->view};
  rcgns_message        why;

  if (rt_rank() == 0) RT_EQ(rcgns_create(path, 4.2, NULL, 1, &zone, &why), RCGNS_OK);
  MPI_Barrier(MPI_COMM_WORLD);
  tm_free(mesh);
}

/* A block of n cells along each axis from low to high. */
static void write_block(const char *path, int n, double low, double high)
{
  const rcgns_new_zone zone = {.name         = "Block",
                               .num_vertices = {n + 1, n + 1, n + 1},
                               .node_xyz = tm_alloc_(3, (size_t)(n + 1) * (size_t)(n + 1) * (size_t)(n + 1) * sizeof(double))};
  double              *at   = (double *)zone.node_xyz;
  rcgns_message        why;

  for (int k = 0; k <= n; k++)
    for (int j = 0; j <= n; j++)
      for (int i = 0; i <= n; i++, at += 3) {
        const int place[3] = {i, j, k};

        for (int d = 0; d < 3; d++) at[d] = low + (high - low) * place[d] / n;
      }
  if (rt_rank() == 0) RT_EQ(rcgns_create(path, 4.2, NULL, 1, &zone, &why), RCGNS_OK);
  MPI_Barrier(MPI_COMM_WORLD);
  free((void *)zone.node_xyz);
}

/* The dual cells of a file fill the space of its cells, one for each vertex. */
static void check_file(const char *path)
{
  rcgns_file *cells = cf_open(path, NULL), *duals = open_at_vertices(path);

  if (rt_all(cells && duals)) {
    const rcgns_info *info = rcgns_get_info(duals);
    const double      want = cf_total(cells);
    int64_t           num  = 0;

    for (int64_t z = 0; z < info->num_zones; z++) num += info->zone[z].num_nodes;
    RT_EQ(info->num_cells, num);
    RT_EQ(cf_count(rcgns_mesh(duals)->num_cells), num);
    RT_NEAR(cf_total(duals) / want, 1, 1e-12);
  }
  rcgns_close(&cells);
  rcgns_close(&duals);
}

static void polyhedra_of_all_kinds_have_duals_that_fill_them(void)
{
  const tm_warping warp                                        = {.04, .3};
  const int        n[3]                                        = {4, 3, 5};
  tm_mesh *(*const make[])(const int[3], tm_map, const void *) = {tm_hexahedra, tm_tetrahedra, tm_prisms, tm_pyramids,
                                                                  tm_mixed};
  char path[64];

  for (size_t i = 0; i < sizeof make / sizeof *make; i++) {
    write_mesh(make[i](n, tm_warp, &warp), cf_path(path, "dual"));
    check_file(path);
  }
  write_mesh(tm_refined(n, tm_checkered, tm_warp, &warp), path);
  check_file(path);
  cf_remove(path);
}

static void elements_have_duals_that_fill_them(void)
{
  cf_file      *f    = cf_new(4.2);
  const int64_t zone = cf_zoo_zone(f, cf_base(f), "Zoo");
  char          path[64];

  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CF_ZOO_HEXA);
  cf_section(f, zone, "Penta", 14, 2, 3, 12, CF_ZOO_PENTA);
  cf_section(f, zone, "Pyra", 12, 4, 4, 5, CF_ZOO_PYRA);
  cf_section(f, zone, "Tetra", 10, 5, 5, 4, CF_ZOO_TETRA);
  cf_write(f, cf_path(path, "dual_zoo"));
  check_file(path);
  cf_remove(path);
}

/* An axis: the first and the last plane along j are one line, on which vertices repeat. */
static void a_block_about_an_axis_has_duals_that_fill_it(void)
{
  enum { NI = 4, NJ = 3, NK = 5 };
  double               xyz[NK][NJ][NI][3];
  const rcgns_new_zone zone = {.name = "Axis", .num_vertices = {NI, NJ, NK}, .node_xyz = &xyz[0][0][0][0]};
  rcgns_message        why;
  char                 path[64];

  for (int k = 0; k < NK; k++)
    for (int j = 0; j < NJ; j++)
      for (int i = 0; i < NI; i++) {
        xyz[k][j][i][0] = i;
        xyz[k][j][i][1] = j * cos(.3 * k);
        xyz[k][j][i][2] = j * sin(.3 * k);
      }
  if (rt_rank() == 0) RT_EQ(rcgns_create(cf_path(path, "dual_axis"), 4.2, NULL, 1, &zone, &why), RCGNS_OK);
  MPI_Barrier(MPI_COMM_WORLD);
  check_file(cf_path(path, "dual_axis"));
  cf_remove(path);
}

static void a_vertex_of_no_cell_has_a_cell_without_volume(void)
{
  cf_file      *f    = cf_new(4.2);
  const int64_t zone = cf_zoo_zone(f, cf_base(f), "Zoo");
  char          path[64];
  rcgns_file   *file;

  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CF_ZOO_HEXA);
  cf_write(f, cf_path(path, "dual_loose"));
  if (rt_all((file = open_at_vertices(path)) != NULL)) {
    const remap_mesh *mesh   = rcgns_mesh(file);
    double           *volume = cf_volumes(mesh, NULL), sum = 0;
    int64_t           empty = 0;

    for (int64_t c = 0; c < mesh->num_cells; c++) sum += volume[c], empty += volume[c] == 0;
    RT_EQ(cf_count(empty), CF_ZOO_NODES - 8);
    RT_NEAR(cf_sum(sum), 1, 1e-14);
    free(volume);
  }
  rcgns_close(&file);
  cf_remove(path);
}

static void higher_order_elements_have_no_duals(void)
{
  static const int64_t tetra_10[10] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  cf_file             *f            = cf_new(4.2);
  const int64_t        zone         = cf_zoo_zone(f, cf_base(f), "Zoo");
  char                 path[64];
  rcgns_options        how;
  rcgns_message        why;
  rcgns_file          *file;

  cf_section(f, zone, "Tetra", 11, 1, 1, 10, tetra_10);
  cf_write(f, cf_path(path, "dual_curved"));
  rcgns_options_default(&how);
  how.location = RCGNS_VERTICES;
  RT_EQ(rcgns_open(MPI_COMM_WORLD, path, &how, &file, &why), RCGNS_IO);
  RT_CHECK(strstr(why.text, "Zoo") && strstr(why.text, "higher-order"));
  RT_CHECK(cf_is_agreed(&why));
  cf_remove(path);
}

static void real_files_have_duals_that_fill_them(void)
{
  static const char *const name[] = {
      "adflow_mdo_tutorial_rans_vol.cgns", "cgnsutil_717_wl_L2.cgns", "maia_U_ATB_45_NGON_v42.cgns",
      "cgns_vers3310_hexa_sol.cgns",       "pycgns_001Disk_T0.cgns",  "msh2cgns_mandel_mixed.cgns",
      "hopr_spheremesh04_mixed.cgns"};

  for (size_t i = 0; i < sizeof name / sizeof *name; i++) {
    char path[512];

    if (!rt_all(rt_shared_data(path, sizeof path, name[i]))) {
      rt_skip("the folder of shared data is not there");
      return;
    }
    check_file(path);
  }
}

/* What a lattice has at the vertex with that number. */
static double linear_at(int n, double low, double high, int64_t vertex, double x[3])
{
  const int64_t row = n + 1, place[3] = {vertex % row, vertex / row % row, vertex / row / row};

  for (int d = 0; d < 3; d++) x[d] = low + (high - low) * (double)place[d] / n;
  return 1 + x[0] - .5 * x[1] + .25 * x[2];
}

/* Fields from the vertices of one lattice to those of a smaller one inside: inner vertices are the centroids of their cells. */
static void constant_and_linear_fields_are_exact_inside(void)
{
  enum { N = 10, M = 5 };
  const double       low = .21, high = .83;
  char               path[2][64];
  rcgns_file        *file[2];
  remap_context     *ctx = NULL;
  remap_transfer     how;
  remap_field_report report[2];
  int64_t            inside = 0;

  write_block(cf_path(path[0], "dual_source"), N, 0, 1);
  write_block(cf_path(path[1], "dual_target"), M, low, high);
  for (int s = 0; s < 2; s++) file[s] = open_at_vertices(path[s]);
  if (!rt_all(file[0] && file[1])) return;
  const remap_mesh *mesh[2] = {rcgns_mesh(file[0]), rcgns_mesh(file[1])};
  const int64_t     n = mesh[0]->num_cells, m = mesh[1]->num_cells;
  double *in = tm_alloc_(2 * n, sizeof *in), *out = tm_alloc_(2 * m, sizeof *out), *centre = tm_alloc_(3 * m, sizeof *centre);
  remap_field_desc field[2] = {{.name = "constant", .in = in, .out = out}, {.name = "linear", .in = in + n, .out = out + m}};

  for (int64_t c = 0; c < n; c++) {
    double x[3];

    in[c]     = 3;
    in[n + c] = linear_at(N, 0, 1, mesh[0]->cell_global[c], x);
  }
  remap_transfer_default(&how);
  how.limiter = REMAP_LIMITER_NONE;
  RT_EQ(remap_create(MPI_COMM_WORLD, NULL, &ctx), REMAP_OK);
  for (int s = 0; s < 2; s++) RT_EQ(remap_set_mesh(ctx, (remap_side)s, mesh[s]), REMAP_OK);
  RT_EQ(remap_build(ctx), REMAP_OK);
  RT_EQ(remap_field(ctx, REMAP_FORWARD, &how, 2, field, report), REMAP_OK);
  RT_EQ(remap_cells(ctx, REMAP_TARGET, NULL, centre), REMAP_OK);
  for (int k = 0; k < 2; k++) RT_CHECK(report[k].conservation_error <= 1e-15);
  for (int64_t c = 0; c < m; c++) {
    double       x[3];
    const double want = linear_at(M, low, high, mesh[1]->cell_global[c], x);

    RT_NEAR(out[c], 3, 1e-14);
    if (fabs(x[0] - centre[3 * c]) + fabs(x[1] - centre[3 * c + 1]) + fabs(x[2] - centre[3 * c + 2]) > 1e-12) continue;
    RT_NEAR(out[m + c], want, 1e-14);
    inside++;
  }
  RT_EQ(cf_count(inside), (M - 1) * (M - 1) * (M - 1));
  remap_destroy(&ctx);
  free(in);
  free(out);
  free(centre);
  for (int s = 0; s < 2; s++) rcgns_close(&file[s]), cf_remove(path[s]);
}

RT_MAIN(RT_CASE(polyhedra_of_all_kinds_have_duals_that_fill_them), RT_CASE(elements_have_duals_that_fill_them),
        RT_CASE(a_block_about_an_axis_has_duals_that_fill_it), RT_CASE(a_vertex_of_no_cell_has_a_cell_without_volume),
        RT_CASE(higher_order_elements_have_no_duals), RT_CASE(real_files_have_duals_that_fill_them),
        RT_CASE(constant_and_linear_fields_are_exact_inside))
