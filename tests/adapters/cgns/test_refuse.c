/* Files that are broken in one way each: the status, a line that names the file and what is wrong, the same on all ranks. */
#include "files.h"

/* The file at path must be refused. Removes it. */
static void refuse_path(const char *path, rcgns_status status, const char *words)
{
  rcgns_file   *file = NULL;
  rcgns_message why  = {""};

  RT_EQ(rcgns_open(MPI_COMM_WORLD, path, NULL, &file, &why), status);
  if (!RT_CHECK(strstr(why.text, words) && strstr(why.text, path)) && rt_rank() == 0)
    printf("# \"%s\", want \"%s\"\n", why.text, words);
  RT_CHECK(!strchr(why.text, '\n'));
  RT_CHECK(cf_is_agreed(&why));
  RT_CHECK(!file);
  rcgns_close(&file);
}

static void refuse(cf_file *f, rcgns_status status, const char *words)
{
  char path[64];

  cf_path(path, "refused");
  cf_write(f, path);
  refuse_path(path, status, words);
  cf_remove(path);
}

static void write_bytes(const char *path, const void *bytes, size_t count)
{
  if (rt_rank() == 0) {
    FILE *file = fopen(path, "wb");

    if (!file || fwrite(bytes, 1, count, file) != count) abort();
    fclose(file);
  }
  MPI_Barrier(MPI_COMM_WORLD);
}

/* A hexahedron, its section still to be put. */
static int64_t cube(cf_file *f)
{
  const int64_t zone = cf_zone(f, cf_base(f), "Cube", 1, (int64_t[]){8, 1, 0});
  double        xyz[24];

  for (int i = 0; i < 8; i++) memcpy(xyz + 3 * i, CF_ZOO_XYZ + 3 * (CF_ZOO_HEXA[i] - 1), 3 * sizeof *xyz);
  cf_coordinates(f, zone, xyz, 1, (int64_t[]){8});
  return zone;
}
static const int64_t CORNERS[8] = {1, 2, 3, 4, 5, 6, 7, 8};

static void a_missing_file_is_refused(void) { refuse_path("cgns_that_is_not_there.cgns", RCGNS_IO, "No such file"); }

static void a_folder_is_refused(void) { refuse_path(".", RCGNS_IO, "not a file"); }

static void a_file_of_text_is_refused(void)
{
  char path[64];

  write_bytes(cf_path(path, "text"), "x y z\n0 0 0\n", 12);
  refuse_path(path, RCGNS_IO, "neither an HDF5 nor an ADF file");
  cf_remove(path);
  write_bytes(path, "", 0);
  refuse_path(path, RCGNS_IO, "empty");
  cf_remove(path);
}

static void a_truncated_hdf5_file_is_refused(void)
{
  char     path[64];
  cf_file *f = cf_new(4.2);

  cf_section(f, cube(f), "Hexa", 17, 1, 1, 8, CORNERS);
  cf_write(f, cf_path(path, "truncated"));
  for (long size = 6000; size > 10; size /= 2) {
    if (rt_rank() == 0 && truncate(path, size)) abort();
    MPI_Barrier(MPI_COMM_WORLD);
    refuse_path(path, RCGNS_IO, size >= 100 ? "truncated" : "");
  }
  cf_remove(path);
}

static void an_hdf5_file_without_bases_is_refused(void)
{
  cf_file *f = cf_new(4.2);

  refuse(f, RCGNS_IO, "no CGNSBase_t");
}

static void a_base_without_volume_cells_is_refused(void)
{
  cf_file *f = cf_new(4.2);

  cf_section(f, cube(f), "Quad", 7, 1, 2, 8, CORNERS);
  refuse(f, RCGNS_IO, "no volume cells");
}

static void missing_coordinates_are_refused(void)
{
  cf_file     *f    = cf_new(4.2);
  int64_t      zone = cf_zone(f, cf_base(f), "Bare", 1, (int64_t[]){8, 1, 0});
  int64_t      grid;
  const double x[8] = {0};

  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CORNERS);
  refuse(f, RCGNS_IO, "zone Base/Bare: it has no GridCoordinates");
  f    = cf_new(4.2);
  zone = cf_zone(f, cf_base(f), "Bare", 1, (int64_t[]){8, 1, 0});
  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CORNERS);
  grid = cf_empty(f, zone, "GridCoordinates", "GridCoordinates_t");
  cf_reals(f, grid, "CoordinateX", 8, x);
  cf_reals(f, grid, "CoordinateY", 8, x);
  refuse(f, RCGNS_IO, "zone Base/Bare: CoordinateZ is missing");
}

static void coordinates_in_other_systems_are_refused(void)
{
  cf_file      *f    = cf_new(4.2);
  const int64_t zone = cf_zone(f, cf_base(f), "Round", 1, (int64_t[]){8, 1, 0});
  const double  x[8] = {0};

  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CORNERS);
  cf_reals(f, cf_empty(f, zone, "GridCoordinates", "GridCoordinates_t"), "CoordinateR", 8, x);
  refuse(f, RCGNS_IO, "not Cartesian");
}

static void coordinates_of_the_wrong_size_are_refused(void)
{
  cf_file      *f    = cf_new(4.2);
  const int64_t zone = cf_zone(f, cf_base(f), "Short", 1, (int64_t[]){14, 1, 0});

  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CORNERS);
  cf_coordinates(f, zone, CF_ZOO_XYZ, 1, (int64_t[]){13});
  refuse(f, RCGNS_IO, "zone Base/Short: the size of CoordinateX does not match");
}

static void coordinates_that_are_no_numbers_are_refused(void)
{
  for (int block = 0; block < 2; block++) {
    cf_file *f = cf_new(4.2);
    double   xyz[24];
    int64_t  zone;

    for (int i = 0; i < 24; i++) xyz[i] = i == 16 ? (double)NAN : (double)(i / 3 >> i % 3 & 1);
    zone = block ? cf_zone(f, cf_base(f), "Nan", 3, (int64_t[]){2, 2, 2, 1, 1, 1, 0, 0, 0})
                 : cf_zone(f, cf_base(f), "Nan", 1, (int64_t[]){8, 1, 0});
    if (!block) cf_section(f, zone, "Hexa", 17, 1, 1, 8, (int64_t[]){1, 2, 4, 3, 5, 6, 8, 7});
    cf_coordinates(f, zone, xyz, block ? 3 : 1, block ? (int64_t[]){2, 2, 2} : (int64_t[]){8});
    refuse(f, RCGNS_GEOMETRY, "zone Base/Nan: node 6 has a coordinate that is not a finite number");
  }
}

static void node_numbers_out_of_range_are_refused(void)
{
  static const int64_t bad[3] = {9, 0, INT64_MAX};

  for (int i = 0; i < 3; i++) {
    cf_file      *f    = cf_new(4.2);
    const int64_t zone = cube(f);
    int64_t       node[8];

    memcpy(node, CORNERS, sizeof node);
    node[5] = bad[i];
    cf_section(f, zone, "Hexa", 17, 1, 1, 8, node);
    refuse(f, RCGNS_GEOMETRY, "zone Base/Cube: cell 1 refers to node");
  }
}

static void sections_of_the_wrong_size_are_refused(void)
{
  cf_file *f = cf_new(4.2);

  cf_section(f, cube(f), "Hexa", 17, 1, 2, 8, CORNERS);
  refuse(f, RCGNS_IO, "section Hexa has an ElementConnectivity whose size does not match");
  f = cf_new(4.2);
  cf_section(f, cube(f), "Hexa", 17, 5, 2, 8, CORNERS);
  refuse(f, RCGNS_IO, "section Hexa has no valid ElementRange");
  f = cf_new(4.2);
  cf_section(f, cube(f), "Hexa", 99, 1, 1, 8, CORNERS);
  refuse(f, RCGNS_IO, "section Hexa has an unknown element type");
  f = cf_new(4.2);
  {
    const int64_t zone = cube(f);

    cf_section(f, zone, "Hexa", 17, 1, 1, 8, CORNERS);
    cf_section(f, zone, "Again", 17, 1, 1, 8, CORNERS);
  }
  refuse(f, RCGNS_IO, "two sections claim the element number 1");
}

static void mixed_rows_that_do_not_fit_are_refused(void)
{
  const int64_t row[4][9] = {
      {17, 1, 2, 3, 4, 5, 6, 7, 8}, {10, 1, 2, 3, 4, 5, 6, 7, 8}, {77, 1, 2, 3, 4, 5, 6, 7, 8}, {18, 1, 2, 3, 4, 5, 6, 7, 8}};

  for (int i = 1; i < 4; i++)
    for (int with_offsets = 0; with_offsets < 2; with_offsets++) {
      cf_file      *f  = cf_new(4.2);
      const int64_t at = cf_section(f, cube(f), "Mixed", 20, 1, 1, 9, row[i]);

      if (with_offsets) cf_offsets(f, at, 2, (int64_t[]){0, 9});
      refuse(f, RCGNS_IO, "section Mixed is damaged at its row");
    }
  {
    cf_file      *f  = cf_new(4.2);
    const int64_t at = cf_section(f, cube(f), "Mixed", 20, 1, 1, 9, row[0]);

    cf_offsets(f, at, 2, (int64_t[]){-5, 9});
    refuse(f, RCGNS_IO, "section Mixed is damaged");
  }
}

static void zones_with_impossible_sizes_are_refused(void)
{
  cf_file *f = cf_new(4.2);
  int64_t  zone;

  zone = cf_zone(f, cf_base(f), "Odd", 3, (int64_t[]){2, 2, 2, 1, 2, 1, 0, 0, 0});
  cf_coordinates(f, zone, CF_ZOO_XYZ, 3, (int64_t[]){2, 2, 2});
  refuse(f, RCGNS_IO, "zone Base/Odd: its sizes are not valid");
  f = cf_new(4.2);
  zone =
      cf_zone(f, cf_base(f), "Huge", 3,
              (int64_t[]){INT64_C(1) << 40, INT64_C(1) << 40, 2, (INT64_C(1) << 40) - 1, (INT64_C(1) << 40) - 1, 1, 0, 0, 0});
  cf_coordinates(f, zone, CF_ZOO_XYZ, 3, (int64_t[]){2, 2, 2});
  refuse(f, RCGNS_IO, "zone Base/Huge: its sizes are not valid");
  f    = cf_new(4.2);
  zone = cf_zone(f, cf_base(f), "Minus", 1, (int64_t[]){-8, 1, 0});
  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CORNERS);
  refuse(f, RCGNS_IO, "zone Base/Minus: its sizes are not valid");
}

static void a_face_of_three_elements_is_refused(void)
{
  cf_file      *f        = cf_new(4.2);
  const int64_t zone     = cf_zoo_zone(f, cf_base(f), "Zoo");
  const int64_t node[12] = {8, 9, 12, 14, 9, 8, 12, 3, 8, 9, 12, 13};

  cf_section(f, zone, "Tetra", 10, 1, 3, 12, node);
  refuse(f, RCGNS_GEOMETRY, "share");
}

/* The faces of two hexahedra side by side, 1 .. 11, the sixth between them. */
static void put_faces(cf_file *f, int64_t zone)
{
  const int64_t face[44] = {1,  4, 5, 2, 1, 2, 8, 7, 4, 10, 11, 5,  1,  7, 10, 4, 7,  8, 11, 10, 2,  5,
                            11, 8, 2, 5, 6, 3, 2, 3, 9, 8,  5,  11, 12, 6, 3,  6, 12, 9, 8,  9,  12, 11};
  int64_t       at[12];

  for (int i = 0; i < 12; i++) at[i] = 4 * i;
  cf_offsets(f, cf_section(f, zone, "Faces", 22, 1, 11, 44, face), 12, at);
}

static void a_face_of_three_polyhedra_is_refused(void)
{
  cf_file      *f        = cf_new(4.2);
  const int64_t zone     = cf_zoo_zone(f, cf_base(f), "Zoo");
  const int64_t cell[18] = {1, 2, 3, 4, 5, 6, -6, 7, 8, 9, 10, 11, 6, 7, 8, 9, 10, 11}, at[4] = {0, 6, 12, 18};

  put_faces(f, zone);
  cf_offsets(f, cf_section(f, zone, "Cells", 23, 12, 14, 18, cell), 4, at);
  refuse(f, RCGNS_GEOMETRY, "face 6");
}

static void a_face_that_no_section_holds_is_refused(void)
{
  cf_file      *f        = cf_new(4.2);
  const int64_t zone     = cf_zoo_zone(f, cf_base(f), "Zoo");
  const int64_t cell[12] = {1, 2, 3, 4, 5, 6, -6, 7, 8, 9, 10, 99}, at[3] = {0, 6, 12};

  put_faces(f, zone);
  cf_offsets(f, cf_section(f, zone, "Cells", 23, 12, 13, 12, cell), 3, at);
  refuse(f, RCGNS_GEOMETRY, "cell 2 refers to face 99, which no NGON_n section holds");
}

static void a_polyhedron_of_three_faces_is_refused(void)
{
  cf_file      *f       = cf_new(4.2);
  const int64_t zone    = cf_zoo_zone(f, cf_base(f), "Zoo");
  const int64_t cell[9] = {1, 2, 3, 4, 5, 6, -6, 7, 8}, at[3] = {0, 6, 9};

  put_faces(f, zone);
  cf_offsets(f, cf_section(f, zone, "Cells", 23, 12, 13, 9, cell), 3, at);
  refuse(f, RCGNS_GEOMETRY, "cell 2 has 3 faces: it is not closed");
}

static void cells_without_faces_are_refused(void)
{
  cf_file      *f       = cf_new(4.2);
  const int64_t zone    = cf_zoo_zone(f, cf_base(f), "Zoo");
  const int64_t cell[6] = {1, 2, 3, 4, 5, 6}, at[2] = {0, 6};

  cf_offsets(f, cf_section(f, zone, "Cells", 23, 1, 1, 6, cell), 2, at);
  refuse(f, RCGNS_IO, "section NFACE_n has no NGON_n section");
  f = cf_new(4.2);
  {
    const int64_t again = cf_zoo_zone(f, cf_base(f), "Zoo");

    put_faces(f, again);
    cf_offsets(f, cf_section(f, again, "Cells", 23, 12, 12, 6, cell), 2, (int64_t[]){4, 2});
  }
  refuse(f, RCGNS_IO, "ElementStartOffset is not ascending");
}

/* The mesh is for remap_build to refuse: the adapter has no coordinates of its own mind about closure. */
static void an_open_cell_is_refused_by_the_library(void)
{
  cf_file       *f        = cf_new(4.2);
  const int64_t  zone     = cf_zoo_zone(f, cf_base(f), "Zoo");
  const int64_t  cell[11] = {1, 2, 3, 4, 5, 6, -6, 7, 8, 9, 10}, at[3] = {0, 6, 11};
  char           path[64];
  rcgns_file    *file;
  remap_context *ctx;

  put_faces(f, zone);
  cf_offsets(f, cf_section(f, zone, "Cells", 23, 12, 13, 11, cell), 3, at);
  cf_path(path, "open_cell");
  cf_write(f, path);
  if ((file = cf_open(path, NULL))) {
    RT_EQ(remap_create(MPI_COMM_WORLD, NULL, &ctx), REMAP_OK);
    RT_EQ(remap_set_mesh(ctx, REMAP_SOURCE, rcgns_mesh(file)), REMAP_OK);
    RT_EQ(remap_set_mesh(ctx, REMAP_TARGET, rcgns_mesh(file)), REMAP_OK);
    RT_EQ(remap_build(ctx), REMAP_BAD_MESH);
    if (!RT_CHECK(strstr(remap_message(ctx), path) && strstr(remap_message(ctx), "Base/Zoo")))
      printf("# %s\n", remap_message(ctx));
    remap_destroy(&ctx);
    rcgns_close(&file);
  }
  cf_remove(path);
}

static void fields_of_the_wrong_size_are_refused(void)
{
  cf_file       *f        = cf_new(4.2);
  const int64_t  zone     = cf_zoo_zone(f, cf_base(f), "Zoo");
  const double   value[6] = {0};
  double         mine[8];
  char           path[64];
  rcgns_file    *file;
  rcgns_solution chosen;
  rcgns_message  why;
  rcgns_choice   choice;

  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CF_ZOO_HEXA);
  cf_section(f, zone, "Penta", 14, 2, 3, 12, CF_ZOO_PENTA);
  cf_reals(f, cf_solution(f, zone, "Sol", "Long", 6, value), "Right", 3, value);
  cf_path(path, "field_size");
  cf_write(f, path);
  if ((file = cf_open(path, NULL))) {
    rcgns_choice_default(&choice);
    RT_EQ(rcgns_select_solution(file, &choice, &chosen, &why), RCGNS_OK);
    RT_EQ(chosen.num_fields, 2);
    RT_EQ(rcgns_read_field(file, "Long", mine, &why), RCGNS_IO);
    RT_CHECK(strstr(why.text, "zone Base/Zoo: the size of field Long does not match the zone's 3 cells"));
    RT_EQ(rcgns_read_field(file, "Right", mine, &why), RCGNS_OK);
    RT_EQ(rcgns_read_field(file, "Wrong", mine, &why), RCGNS_USAGE);
    choice.optional = 1;
    choice.name     = "Sol";
    RT_EQ(rcgns_select_solution(file, &choice, &chosen, &why), RCGNS_OK);
    RT_EQ(chosen.num_fields, 1);
    choice.name = "Nothing";
    RT_EQ(rcgns_select_solution(file, &choice, &chosen, &why), RCGNS_OK);
    RT_EQ(chosen.num_fields, 0);
    RT_CHECK(!chosen.name);
    rcgns_close(&file);
  }
  cf_remove(path);
}

static void a_field_that_one_zone_lacks_is_refused_there(void)
{
  cf_file       *f        = cf_new(4.2);
  const int64_t  base     = cf_base(f);
  const double   value[1] = {7};
  double         mine[2];
  char           path[64];
  rcgns_file    *file;
  rcgns_solution chosen;
  rcgns_message  why;

  for (int z = 0; z < 2; z++) {
    const int64_t zone = cf_zoo_zone(f, base, z ? "Two" : "One");
    const int64_t sol  = cf_solution(f, zone, "Sol", "Both", 1, value);

    cf_section(f, zone, "Hexa", 17, 1, 1, 8, CF_ZOO_HEXA);
    if (!z) cf_reals(f, sol, "Single", 1, value);
  }
  cf_path(path, "lacking");
  cf_write(f, path);
  if ((file = cf_open(path, NULL))) {
    RT_EQ(rcgns_select_solution(file, NULL, &chosen, &why), RCGNS_OK);
    RT_EQ(chosen.field[0].missing_in, -1);
    RT_EQ(chosen.field[1].missing_in, 1);
    RT_EQ(rcgns_read_field(file, "Single", mine, &why), RCGNS_IO);
    RT_CHECK(strstr(why.text, "zone Base/Two: field Single is missing"));
    RT_EQ(rcgns_read_field(file, "Both", mine, &why), RCGNS_OK);
    rcgns_close(&file);
  }
  cf_remove(path);
}

RT_MAIN(RT_CASE(a_missing_file_is_refused), RT_CASE(a_folder_is_refused), RT_CASE(a_file_of_text_is_refused),
        RT_CASE(a_truncated_hdf5_file_is_refused), RT_CASE(an_hdf5_file_without_bases_is_refused),
        RT_CASE(a_base_without_volume_cells_is_refused), RT_CASE(missing_coordinates_are_refused),
        RT_CASE(coordinates_in_other_systems_are_refused), RT_CASE(coordinates_of_the_wrong_size_are_refused),
        RT_CASE(coordinates_that_are_no_numbers_are_refused), RT_CASE(node_numbers_out_of_range_are_refused),
        RT_CASE(sections_of_the_wrong_size_are_refused), RT_CASE(mixed_rows_that_do_not_fit_are_refused),
        RT_CASE(zones_with_impossible_sizes_are_refused), RT_CASE(a_face_of_three_elements_is_refused),
        RT_CASE(a_face_of_three_polyhedra_is_refused), RT_CASE(a_face_that_no_section_holds_is_refused),
        RT_CASE(a_polyhedron_of_three_faces_is_refused), RT_CASE(cells_without_faces_are_refused),
        RT_CASE(an_open_cell_is_refused_by_the_library), RT_CASE(fields_of_the_wrong_size_are_refused),
        RT_CASE(a_field_that_one_zone_lacks_is_refused_there))
