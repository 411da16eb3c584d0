/* Files made here, in every way a code may write the same cells: sections, MIXED, NGON_n and NFACE_n, blocks. */
#include "files.h"

static void check_zoo(cf_file *f, const char *what)
{
  char           path[64];
  rcgns_file    *file;
  rcgns_solution chosen;
  rcgns_message  why;

  cf_path(path, what);
  cf_write(f, path);
  if ((file = cf_open(path, NULL))) {
    RT_EQ(rcgns_get_info(file)->num_cells, CF_ZOO_CELLS);
    RT_NEAR(cf_total(file), 2.5, 1e-14);
    if (RT_EQ(rcgns_select_solution(file, NULL, &chosen, &why), RCGNS_OK)) /* 1 hexahedron, 20 and 30 prisms, 400, 5000 */
      RT_NEAR(cf_integral(file, "Mark"), 1 + 10 + 15 + 400 / 3.0 + 5000 / 6.0, 1e-11);
    if (rt_size() == 1) RT_EQ(rcgns_mesh(file)->num_faces, 6 + 5 + 5 + 5 + 4 - 4);
    rcgns_close(&file);
  }
  cf_remove(path);
}

static const double MARK[CF_ZOO_CELLS] = {1, 20, 30, 400, 5000};

static void sections_count_by_element_number_and_surfaces_are_no_cells(void)
{
  cf_file      *f    = cf_new(4.2);
  const int64_t zone = cf_zoo_zone(f, cf_base(f), "Zoo");

  cf_section(f, zone, "Tetra", 10, 7, 7, 4, CF_ZOO_TETRA);
  cf_section(f, zone, "Pyra", 12, 6, 6, 5, CF_ZOO_PYRA);
  cf_section(f, zone, "Wall", 7, 4, 4, 4, CF_ZOO_QUAD);
  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CF_ZOO_HEXA);
  cf_section(f, zone, "Penta", 14, 2, 3, 12, CF_ZOO_PENTA);
  cf_solution(f, zone, "Sol", "Mark", CF_ZOO_CELLS, MARK);
  check_zoo(f, "sections");
}

/* Rows of MIXED with a quadrangle, a bar and, if polygon > 0, a pentagon among the cells. Returns the length; offsets has
 * one entry per row and one more. */
static int64_t mixed_rows(const int64_t code[6], int64_t polygon, int64_t *out, int64_t *offset, int64_t *rows)
{
  static const int64_t pentagon[5] = {1, 2, 3, 6, 5};
  const struct {
    int64_t        code, n;
    const int64_t *node;
  } row[] = {
      {code[5], 4, CF_ZOO_QUAD}, {code[3], 8, CF_ZOO_HEXA},      {code[2], 6, CF_ZOO_PENTA}, {3, 2, CF_ZOO_QUAD},
      {polygon, 5, pentagon},    {code[2], 6, CF_ZOO_PENTA + 6}, {code[1], 5, CF_ZOO_PYRA},  {code[0], 4, CF_ZOO_TETRA},
  };
  int64_t at = 0;

  *rows = 0;
  for (size_t r = 0; r < sizeof row / sizeof *row; r++) {
    if (!row[r].code) continue;
    offset[(*rows)++] = at;
    out[at++]         = row[r].code;
    for (int64_t i = 0; i < row[r].n; i++) out[at++] = row[r].node[i];
  }
  offset[*rows] = at;
  return at;
}

static void check_mixed(double version, int64_t mixed, const int64_t code[6], int64_t polygon, int with_offsets,
                        const char *what)
{
  cf_file      *f    = cf_new(version);
  const int64_t zone = cf_zoo_zone(f, cf_base(f), "Zoo");
  int64_t       row[64], offset[16], rows;
  const int64_t length = mixed_rows(code, polygon, row, offset, &rows);
  const int64_t at     = cf_section(f, zone, "Mixed", mixed, 1, rows, length, row);

  if (with_offsets) cf_offsets(f, at, rows + 1, offset);
  cf_solution(f, zone, "Sol", "Mark", CF_ZOO_CELLS, MARK);
  check_zoo(f, what);
}

static const int64_t CODES[6] = {10, 12, 14, 17, 0, 7}, CODES_3_0[6] = {10, 12, 15, 18, 0, 7};

static void mixed_rows_are_found_with_and_without_an_index(void)
{
  check_mixed(3.11, 20, CODES, 0, 0, "mixed_scan");
  check_mixed(4.2, 20, CODES, 0, 1, "mixed_index");
}

static void files_of_version_3_0_use_other_codes(void) { check_mixed(3.0, 21, CODES_3_0, 0, 0, "mixed_30"); }

static void old_mixed_rows_may_be_polygons(void)
{
  check_mixed(3.1, 20, CODES, 22 + 5, 0, "mixed_31");
  check_mixed(2.4, 20, CODES, 21 + 5, 0, "mixed_24");
}

/* n^3 hexahedra in one MIXED section with a quadrangle before each, so that the rows pass many cuts. */
static void long_mixed_sections_are_cut_between_ranks(void)
{
  enum { N = 16, CELLS = N * N * N, P = N + 1 };
  for (int with_offsets = 0; with_offsets < 2; with_offsets++) {
    cf_file       *f    = cf_new(4.2);
    const int64_t  zone = cf_zone(f, cf_base(f), "Long", 1, (int64_t[]){P * P * P, CELLS, 0});
    double        *xyz = tm_alloc_(3 * P * P * P, sizeof *xyz), *value = tm_alloc_(CELLS, sizeof *value), sum = 0.0;
    int64_t       *row = tm_alloc_(14 * CELLS, sizeof *row), *offset = tm_alloc_(2 * CELLS + 1, sizeof *offset), at = 0;
    char           path[64];
    rcgns_file    *file;
    rcgns_solution chosen;
    rcgns_message  why;

    for (int64_t i = 0; i < P * P * P; i++)
      for (int d = 0; d < 3; d++) xyz[3 * i + d] = (double)(i / (int64_t[]){1, P, P * P}[d] % P);
    for (int64_t c = 0; c < CELLS; c++) {
      const int64_t n       = 1 + c % N + P * (c / N % N) + P * P * (c / N / N);
      const int64_t node[8] = {n, n + 1, n + 1 + P, n + P, n + P * P, n + 1 + P * P, n + 1 + P + P * P, n + P + P * P};

      offset[2 * c] = at;
      row[at++]     = 7;
      for (int i = 0; i < 4; i++) row[at++] = node[i];
      offset[2 * c + 1] = at;
      row[at++]         = 17;
      for (int i = 0; i < 8; i++) row[at++] = node[i];
      sum += value[c] = (double)c;
    }
    offset[2 * CELLS] = at;
    cf_coordinates(f, zone, xyz, 1, (int64_t[]){P * P * P});
    {
      const int64_t section = cf_section(f, zone, "Mixed", 20, 1, 2 * CELLS, at, row);

      if (with_offsets) cf_offsets(f, section, 2 * CELLS + 1, offset);
    }
    cf_solution(f, zone, "Sol", "Number", CELLS, value);
    cf_path(path, "long_mixed");
    cf_write(f, path);
    if ((file = cf_open(path, NULL))) {
      RT_EQ(rcgns_get_info(file)->num_cells, CELLS);
      RT_NEAR(cf_total(file), CELLS, 1e-9);
      RT_EQ(rcgns_select_solution(file, NULL, &chosen, &why), RCGNS_OK);
      RT_NEAR(cf_integral(file, "Number"), sum, 1e-6);
      if (rt_size() == 1) RT_EQ(rcgns_mesh(file)->num_faces, 3 * N * N * (N + 1));
      rcgns_close(&file);
    }
    cf_remove(path);
    free(xyz);
    free(value);
    free(row);
    free(offset);
  }
}

static void higher_order_elements_are_taken_by_their_corners(void)
{
  cf_file      *f       = cf_new(4.2);
  const int64_t zone    = cf_zone(f, cf_base(f), "Curved", 1, (int64_t[]){20, 1, 0});
  double        xyz[60] = {0};
  int64_t       node[20];
  char          path[64];
  rcgns_file   *file;

  for (int i = 0; i < 20; i++) node[i] = i + 1;
  for (int i = 0; i < 8; i++) memcpy(xyz + 3 * i, CF_ZOO_XYZ + 3 * (CF_ZOO_HEXA[i] - 1), 3 * sizeof *xyz);
  cf_coordinates(f, zone, xyz, 1, (int64_t[]){20});
  cf_section(f, zone, "Hexa20", 18, 1, 1, 20, node);
  cf_path(path, "curved");
  cf_write(f, path);
  if ((file = cf_open(path, NULL))) {
    RT_NEAR(cf_total(file), 1.0, 1e-15);
    RT_CHECK(cf_has_note(file, "higher-order elements"));
    rcgns_close(&file);
  }
  cf_remove(path);
}

static void flat_cells_let_their_neighbours_join(void)
{
  cf_file      *f        = cf_new(4.2);
  const int64_t zone     = cf_zoo_zone(f, cf_base(f), "Flat");
  const int64_t node[24] = {1, 2, 5, 4, 7, 8, 11, 10, 2, 3, 6, 5, 8, 9, 12, 11, 2, 2, 5, 5, 8, 8, 11, 11};
  char          path[64];
  rcgns_file   *file;

  cf_section(f, zone, "Hexa", 17, 1, 3, 24, node);
  cf_path(path, "flat");
  cf_write(f, path);
  if ((file = cf_open(path, NULL))) {
    const remap_mesh *mesh   = rcgns_mesh(file);
    double           *volume = cf_volumes(mesh, NULL), sum = 0.0;
    int64_t           joined = 0;

    for (int64_t c = 0; c < mesh->num_cells; c++) sum += volume[c];
    for (int64_t k = 0; k < mesh->num_faces; k++) joined += mesh->face_neighbour[k] >= 0;
    RT_NEAR(cf_sum(sum), 2.0, 1e-14);
    if (rt_size() == 1) RT_EQ(joined, 1);
    free(volume);
    rcgns_close(&file);
  }
  cf_remove(path);
}

/* ---- polyhedra ---------------------------------------------------------------------------------------------------- */

typedef enum poly_style { INDEXED, INLINE, UNSIGNED, REVERSED, PARENTS, PARENTS_FROM_1 } poly_style;

/* A mesh's faces as NGON_n and its cells in one of the ways of writing them. */
static void put_poly(cf_file *f, int64_t zone, const remap_mesh *m, poly_style style)
{
  const int64_t n = m->num_faces, cells = m->num_cells, corners = m->face_offset[n];
  int64_t      *node = tm_alloc_(corners + n, sizeof *node), *cell = tm_alloc_(3 * n + cells, sizeof *cell);
  int64_t      *offset = tm_alloc_(cells + 1, sizeof *offset), *parent = tm_alloc_(2 * n, sizeof *parent), at = 0, section;

  for (int64_t k = 0; k < n; k++) {
    if (style == INLINE) node[at++] = m->face_offset[k + 1] - m->face_offset[k];
    for (int64_t i = m->face_offset[k]; i < m->face_offset[k + 1]; i++) node[at++] = m->face_node[i] + 1;
    parent[k]     = (style == PARENTS_FROM_1 ? 1 : n + 1) + m->face_owner[k];
    parent[n + k] = m->face_neighbour[k] < 0 ? 0 : (style == PARENTS_FROM_1 ? 1 : n + 1) + m->face_neighbour[k];
  }
  section = cf_section(f, zone, "Faces", 22, 1, n, at, node);
  if (style != INLINE) cf_offsets(f, section, n + 1, m->face_offset);
  if (style == PARENTS || style == PARENTS_FROM_1)
    cf_put(f, section, "ParentElements", "DataArray_t", "I8", 2, (int64_t[]){2, n}, 'I', parent);
  at = 0;
  for (int64_t c = 0; c < cells; c++) {
    int64_t *count = cell + at;

    offset[c] = at;
    if (style == INLINE) *count = 0, at++;
    for (int64_t k = 0; k < n; k++) {
      const int64_t sign = m->face_owner[k] == c ? 1 : m->face_neighbour[k] == c ? -1 : 0;

      if (!sign) continue;
      cell[at++] = (k + 1) * (style == UNSIGNED ? 1 : style == REVERSED ? -sign : sign);
      if (style == INLINE) ++*count;
    }
  }
  offset[cells] = at;
  if (style != PARENTS && style != PARENTS_FROM_1) {
    section = cf_section(f, zone, "Cells", 23, n + 1, n + cells, at, cell);
    if (style != INLINE) cf_offsets(f, section, cells + 1, offset);
  }
  free(node);
  free(cell);
  free(offset);
  free(parent);
}

static void check_poly(tm_mesh *whole, poly_style style, const char *what)
{
  const remap_mesh *m    = &whole->view;
  cf_file          *f    = cf_new(style == INLINE ? 2.4 : 4.2);
  const int64_t     zone = cf_zone(f, cf_base(f), "Poly", 1, (int64_t[]){m->num_nodes, m->num_cells, 0});
  double           *want = cf_volumes(m, NULL);
  char              path[64];
  rcgns_file       *file;

  cf_coordinates(f, zone, m->node_xyz, 1, &m->num_nodes);
  put_poly(f, zone, m, style);
  cf_solution(f, zone, "Sol", "Volume", m->num_cells, want);
  cf_path(path, what);
  cf_write(f, path);
  if ((file = cf_open(path, NULL))) {
    const remap_mesh *mine   = rcgns_mesh(file);
    double           *volume = cf_volumes(mine, NULL);

    RT_EQ(rcgns_get_info(file)->num_cells, m->num_cells);
    RT_NEAR(cf_total(file), 1.0, 1e-13);
    for (int64_t c = 0; c < mine->num_cells; c++) RT_NEAR(volume[c], want[mine->cell_global[c]], 1e-14);
    if (rt_size() == 1) RT_EQ(mine->num_faces, m->num_faces);
    RT_CHECK(cf_has_note(file, "signs of faces") == (style == UNSIGNED));
    free(volume);
    rcgns_close(&file);
  }
  cf_remove(path);
  free(want);
  tm_free(whole);
}

static tm_mesh *refined(void) { return tm_refined((int[]){4, 3, 3}, tm_right_half, tm_warp, &(tm_warping){0.03, 0.7}); }

static void polyhedra_are_read_in_both_layouts(void)
{
  check_poly(refined(), INDEXED, "poly_indexed");
  check_poly(refined(), INLINE, "poly_inline");
}

static void missing_signs_are_repaired(void) { check_poly(refined(), UNSIGNED, "poly_unsigned"); }

static void signs_that_are_all_reversed_turn_the_zone_round(void) { check_poly(refined(), REVERSED, "poly_reversed"); }

static void cells_come_from_parents_alone_in_either_numbering(void)
{
  check_poly(refined(), PARENTS, "poly_parents");
  check_poly(refined(), PARENTS_FROM_1, "poly_parents_1");
}

static void a_face_that_a_cell_lists_twice_bounds_nothing(void)
{
  /* the hexahedron 1-8 as six faces, and a seventh of its own nodes inside, listed from both sides */
  const int64_t node[28] = {1, 4, 3, 2, 1, 2, 6, 5, 2, 3, 7, 6, 3, 4, 8, 7, 1, 5, 8, 4, 5, 6, 7, 8, 1, 2, 7, 8};
  const int64_t at[8] = {0, 4, 8, 12, 16, 20, 24, 28}, cell[8] = {1, 2, 3, 4, 7, 5, 6, -7}, cut[2] = {0, 8};
  cf_file      *f    = cf_new(4.2);
  const int64_t zone = cf_zone(f, cf_base(f), "Baffle", 1, (int64_t[]){8, 1, 0});
  double        xyz[24];
  char          path[64];
  rcgns_file   *file;

  for (int i = 0; i < 8; i++) memcpy(xyz + 3 * i, CF_ZOO_XYZ + 3 * (CF_ZOO_HEXA[i] - 1), 3 * sizeof *xyz);
  cf_coordinates(f, zone, xyz, 1, (int64_t[]){8});
  cf_offsets(f, cf_section(f, zone, "Faces", 22, 1, 7, 28, node), 8, at);
  cf_offsets(f, cf_section(f, zone, "Cells", 23, 8, 8, 8, cell), 2, cut);
  cf_path(path, "baffle");
  cf_write(f, path);
  if ((file = cf_open(path, NULL))) {
    RT_NEAR(cf_total(file), 1.0, 1e-15);
    RT_EQ(cf_count(rcgns_mesh(file)->num_faces), 6);
    rcgns_close(&file);
  }
  cf_remove(path);
}

static void what_create_writes_is_read_back(void)
{
  tm_mesh        *whole = tm_dual((int[]){3, 3, 3}, tm_warp, &(tm_warping){0.02, 0.3});
  const int64_t   n     = whole->view.num_cells;
  double         *want  = cf_volumes(&whole->view, NULL), grid[3 * 60];
  double          cells[24];
  char            path[64];
  rcgns_message   why;
  rcgns_file     *file;
  rcgns_solution  chosen;
  rcgns_new_field field[2] = {{"Volume", want}, {"Volume", cells}};
  rcgns_new_zone  zone[2]  = {
        {.name = "Poly", .mesh = &whole->view, .num_fields = 1, .field = field},
        {.name = "Block", .num_vertices = {5, 4, 3}, .node_xyz = grid, .num_fields = 1, .field = field + 1}};

  for (int i = 0; i < 60; i++) grid[3 * i] = i % 5, grid[3 * i + 1] = i / 5 % 4, grid[3 * i + 2] = i / 20 + 2.0;
  for (int i = 0; i < 24; i++) cells[i] = i;
  cf_path(path, "create");
  if (rt_rank() == 0) RT_EQ(rcgns_create(path, 4.2, "Sol", 2, zone, &why), RCGNS_OK);
  MPI_Barrier(MPI_COMM_WORLD);
  if ((file = cf_open(path, NULL))) {
    double sum = 0.0;

    for (int64_t c = 0; c < n; c++) sum += want[c] * want[c];
    RT_EQ(rcgns_get_info(file)->num_zones, 2);
    RT_STR(rcgns_get_info(file)->zone[1].name, "Base/Block");
    RT_EQ(rcgns_get_info(file)->zone[1].first_cell, n);
    RT_NEAR(cf_total(file), 1.0 + 24.0, 1e-12);
    RT_EQ(rcgns_select_solution(file, NULL, &chosen, &why), RCGNS_OK);
    RT_NEAR(cf_integral(file, "Volume"), sum + 23 * 12, 1e-11);
    rcgns_close(&file);
  }
  cf_remove(path);
  tm_free(whole);
  free(want);
}

/* ---- blocks ------------------------------------------------------------------------------------------------------- */

/* A block of 4 x 3 x 5 cells between the given x; rind in front of and behind coordinates and field. */
static void put_block(cf_file *f, int64_t base, const char *name, double x0, double x1, int64_t rind)
{
  const int64_t v[3] = {5, 4, 6}, r = rind;
  const int64_t node[3] = {v[2] + 3 * r, v[1] + 2 * r, v[0] + r}, cell[3] = {v[2] - 1 + r, v[1] - 1, v[0] - 1 + 3 * r};
  const int64_t zone = cf_zone(f, base, name, 3, (int64_t[]){v[0], v[1], v[2], v[0] - 1, v[1] - 1, v[2] - 1, 0, 0, 0});
  double       *xyz  = tm_alloc_(3 * node[0] * node[1] * node[2], sizeof *xyz),
         *value      = tm_alloc_(cell[0] * cell[1] * cell[2], sizeof *value);
  int64_t grid, sol;

  for (int64_t i = 0; i < node[0] * node[1] * node[2]; i++) {
    xyz[3 * i]     = x0 + (x1 - x0) * (double)(i % node[2]) / (double)(v[0] - 1);
    xyz[3 * i + 1] = (double)(i / node[2] % node[1] - r);
    xyz[3 * i + 2] = (double)(i / node[2] / node[1] - 2 * r);
  }
  for (int64_t i = 0; i < cell[0] * cell[1] * cell[2]; i++)
    value[i] = (double)(i % cell[2] - 2 * r) + 100.0 * (double)(i / cell[2] % cell[1]) + 1e4 * (double)(i / cell[2] / cell[1]);
  grid = cf_coordinates(f, zone, xyz, 3, node);
  if (r) cf_ints(f, grid, "Rind", "Rind_t", 6, (int64_t[]){0, 1, 1, 1, 2, 1});
  sol = cf_empty(f, zone, "Sol", "FlowSolution_t");
  if (r) cf_ints(f, sol, "Rind", "Rind_t", 6, (int64_t[]){2, 1, 0, 0, 0, 1});
  cf_text(f, sol, "GridLocation", "GridLocation_t", "CellCenter");
  cf_put(f, sol, "Place", "DataArray_t", "R4", 3, cell, 'R', value);
  free(xyz);
  free(value);
}

static void blocks_have_rind_stripped_and_hands_agreed(void)
{
  cf_file       *f    = cf_new(3.3);
  const int64_t  base = cf_base(f);
  char           path[64];
  rcgns_file    *file;
  rcgns_solution chosen;
  rcgns_message  why;

  put_block(f, base, "Right", 0, 4, 0);
  put_block(f, base, "Left", 8, 4, 1);
  cf_path(path, "blocks");
  cf_write(f, path);
  if ((file = cf_open(path, NULL))) {
    const double block = 1.5 * 60 + 100.0 * 60 + 1e4 * 2 * 60;

    RT_NEAR(cf_total(file), 120.0, 1e-12);
    RT_EQ(rcgns_select_solution(file, NULL, &chosen, &why), RCGNS_OK);
    RT_STR(chosen.field[0].stored, "R4");
    RT_NEAR(cf_integral(file, "Place"), 2 * block, 1e-6);
    if (rt_size() == 1) RT_EQ(rcgns_mesh(file)->num_faces, 2 * (5 * 3 * 5 + 4 * 4 * 5 + 4 * 3 * 6));
    rcgns_close(&file);
  }
  cf_remove(path);
}

static void scale_and_transform_move_the_mesh(void)
{
  cf_file      *f = cf_new(3.3);
  char          path[64];
  rcgns_file   *file;
  rcgns_options options;
  rcgns_message why;

  put_block(f, cf_base(f), "Block", 0, 4, 0);
  cf_path(path, "moved");
  cf_write(f, path);
  rcgns_options_default(&options);
  options.scale           = 0.5;
  options.transform[0][0] = -1.0; /* a mirror: the cells stay positive */
  options.transform[1][3] = 7.0;
  if ((file = cf_open(path, &options))) {
    const remap_mesh *m     = rcgns_mesh(file);
    double            least = HUGE_VAL;

    RT_NEAR(cf_total(file), 60.0 / 8.0, 1e-13);
    for (int64_t i = 0; i < m->num_nodes; i++) least = fmin(least, m->node_xyz[3 * i + 1]);
    if (m->num_nodes) RT_CHECK(least >= 7.0);
    rcgns_close(&file);
  }
  options.transform[0][0] = 0.0;
  RT_EQ(rcgns_open(MPI_COMM_WORLD, path, &options, &file, &why), RCGNS_USAGE);
  RT_CHECK(strstr(why.text, "singular"));
  cf_remove(path);
}

/* ---- time and names ------------------------------------------------------------------------------------------------ */

static void put_steps(cf_file *f, int64_t base, int with_pointers)
{
  const int64_t zone = cf_zoo_zone(f, base, "Zoo");
  const double  a[5] = {1, 1, 1, 1, 1}, b[5] = {2, 2, 2, 2, 2}, c[5] = {3, 3, 3, 3, 3};
  char          names[96];
  int64_t       data;

  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CF_ZOO_HEXA);
  cf_section(f, zone, "Penta", 14, 2, 3, 12, CF_ZOO_PENTA);
  cf_section(f, zone, "Pyra", 12, 4, 4, 5, CF_ZOO_PYRA);
  cf_section(f, zone, "Tetra", 10, 5, 5, 4, CF_ZOO_TETRA);
  cf_solution(f, zone, "First", "One", 5, a);
  cf_solution(f, zone, "Second", "One", 5, b);
  cf_solution(f, zone, "Third", "One", 5, c);
  cf_ints(f, base, "TimeData", "BaseIterativeData_t", 1, (int64_t[]){3});
  if (!with_pointers) return;
  memset(names, ' ', sizeof names);
  memcpy(names, "Third", 5);
  memcpy(names + 32, "Second", 6);
  memcpy(names + 64, "Null", 4);
  data = cf_empty(f, zone, "ZoneData", "ZoneIterativeData_t");
  cf_put(f, data, "FlowSolutionPointers", "DataArray_t", "C1", 2, (int64_t[]){3, 32}, 'C', names);
}

static void check_step(rcgns_file *file, int64_t step, const char *want)
{
  rcgns_choice   choice;
  rcgns_solution chosen;
  rcgns_message  why;

  rcgns_choice_default(&choice);
  choice.step = step;
  if (want) {
    RT_EQ(rcgns_select_solution(file, &choice, &chosen, &why), RCGNS_OK);
    RT_STR(chosen.name, want);
  } else {
    RT_EQ(rcgns_select_solution(file, &choice, &chosen, &why), RCGNS_USAGE);
    RT_CHECK(strstr(why.text, "no CellCenter solution for step"));
  }
}

static void steps_follow_pointers_or_the_order_of_the_file(void)
{
  for (int with_pointers = 0; with_pointers < 2; with_pointers++) {
    cf_file       *f = cf_new(4.2);
    char           path[64];
    rcgns_file    *file;
    rcgns_solution chosen;
    rcgns_message  why;

    put_steps(f, cf_base(f), with_pointers);
    cf_path(path, "steps");
    cf_write(f, path);
    if ((file = cf_open(path, NULL))) {
      check_step(file, 1, with_pointers ? "Third" : "First");
      check_step(file, 2, "Second");
      check_step(file, 3, with_pointers ? NULL : "Third");
      check_step(file, RCGNS_STEP_LAST, with_pointers ? "Second" : "Third");
      check_step(file, 4, NULL);
      RT_CHECK(cf_has_note(file, "no FlowSolutionPointers") == !with_pointers);
      RT_EQ(rcgns_select_solution(file, NULL, &chosen, &why), RCGNS_USAGE);
      RT_CHECK(strstr(why.text, "name one of First, Second, Third"));
      rcgns_close(&file);
    }
    cf_remove(path);
  }
}

static void names_tell_natures(void)
{
  static const struct {
    const char  *name;
    int          is_integer;
    remap_nature nature;
    int          known;
  } want[] = {{"Density", 0, REMAP_CONSERVED, 1},
              {"MomentumX", 0, REMAP_CONSERVED, 1},
              {"TurbulentSANuTildeDensity", 0, REMAP_CONSERVED, 1},
              {"Momentum_x", 0, REMAP_CONSERVED, 1},
              {"VelocityX", 0, REMAP_MASS_SPECIFIC, 1},
              {"VelocitySound", 0, REMAP_VOLUME_MEAN, 1},
              {"Pressure", 0, REMAP_VOLUME_MEAN, 1},
              {"ResDensity", 0, REMAP_VOLUME_MEAN, 1},
              {"cellN", 0, REMAP_FLAG, 1},
              {"Iblank", 0, REMAP_FLAG, 1},
              {"Colour", 0, REMAP_VOLUME_MEAN, 0},
              {"Colour", 1, REMAP_FLAG, 1}};

  for (size_t i = 0; i < sizeof want / sizeof *want; i++) {
    int known;

    RT_EQ(rcgns_nature(want[i].name, want[i].is_integer, &known), want[i].nature);
    RT_EQ(known, want[i].known);
  }
}

RT_MAIN(RT_CASE(sections_count_by_element_number_and_surfaces_are_no_cells),
        RT_CASE(mixed_rows_are_found_with_and_without_an_index), RT_CASE(files_of_version_3_0_use_other_codes),
        RT_CASE(old_mixed_rows_may_be_polygons), RT_CASE(long_mixed_sections_are_cut_between_ranks),
        RT_CASE(higher_order_elements_are_taken_by_their_corners), RT_CASE(flat_cells_let_their_neighbours_join),
        RT_CASE(polyhedra_are_read_in_both_layouts), RT_CASE(missing_signs_are_repaired),
        RT_CASE(signs_that_are_all_reversed_turn_the_zone_round), RT_CASE(cells_come_from_parents_alone_in_either_numbering),
        RT_CASE(a_face_that_a_cell_lists_twice_bounds_nothing), RT_CASE(what_create_writes_is_read_back),
        RT_CASE(blocks_have_rind_stripped_and_hands_agreed), RT_CASE(scale_and_transform_move_the_mesh),
        RT_CASE(steps_follow_pointers_or_the_order_of_the_file), RT_CASE(names_tell_natures))
