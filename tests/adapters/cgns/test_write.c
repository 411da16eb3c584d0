/* Output: everything of the target, the fields put in, nothing half written, the same bytes on any number of ranks. */
#include "files.h"

#include <glob.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

/* A target with much in it: a block whose solution has rind, elements without a solution, and nodes nobody knows. */
static void make_target(const char *path)
{
  enum { LONG = 3000 };
  cf_file      *f     = cf_new(3.4);
  const int64_t base  = cf_base(f);
  const int64_t block = cf_zone(f, base, "Block", 3, (int64_t[]){4, 3, 3, 3, 2, 2, 0, 0, 0});
  double        xyz[3 * 36], value[5 * 2 * 2], series[LONG];
  int64_t       sol, zone;

  for (int i = 0; i < 36; i++) xyz[3 * i] = 5 + i % 4, xyz[3 * i + 1] = i / 4 % 3, xyz[3 * i + 2] = i / 12;
  for (int i = 0; i < 20; i++) value[i] = i;
  for (int i = 0; i < LONG; i++) series[i] = i / 7.0;
  cf_coordinates(f, block, xyz, 3, (int64_t[]){3, 3, 4});
  sol = cf_empty(f, block, "Sol", "FlowSolution_t");
  cf_text(f, sol, "GridLocation", "GridLocation_t", "CellCenter");
  cf_ints(f, sol, "Rind", "Rind_t", 6, (int64_t[]){1, 1, 0, 0, 0, 0});
  cf_text(f, cf_put(f, sol, "Density", "DataArray_t", "R4", 3, (int64_t[]){2, 2, 5}, 'R', value), "DataClass", "DataClass_t",
          "Dimensional");
  cf_put(f, sol, "Pressure", "DataArray_t", "R8", 3, (int64_t[]){2, 2, 5}, 'R', value);
  zone = cf_zoo_zone(f, base, "Zoo");
  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CF_ZOO_HEXA);
  cf_section(f, zone, "Penta", 14, 2, 3, 12, CF_ZOO_PENTA);
  cf_reals(f, cf_empty(f, base, "Odd one", "UserDefinedData_t"), "series", LONG, series);
  cf_text(f, base, "Remark", "Descriptor_t", "kept as it is");
  cf_write(f, path);
}

/* Values that depend on nothing but the cell's global number. */
static double *values_of(const rcgns_file *file, double factor)
{
  const remap_mesh *mesh  = rcgns_mesh(file);
  double           *value = tm_alloc_(mesh->num_cells, sizeof *value);

  for (int64_t c = 0; c < mesh->num_cells; c++) value[c] = factor * (double)(mesh->cell_global[c] + 1);
  return value;
}

/* The content of a file; the caller frees. */
static char *slurp(const char *path, long *size)
{
  FILE *file = fopen(path, "rb");
  char *text = NULL;

  *size = -1;
  if (!file) return NULL;
  fseek(file, 0, SEEK_END);
  *size = ftell(file);
  rewind(file);
  text = tm_alloc_(*size, 1);
  if (fread(text, 1, (size_t)*size, file) != (size_t)*size) *size = -1;
  fclose(file);
  return text;
}

static bool is_same_file(const char *a, const char *b)
{
  long  n, m;
  char *x = slurp(a, &n), *y = slurp(b, &m);
  bool  same = x && y && n == m && n > 0 && !memcmp(x, y, (size_t)n);

  free(x);
  free(y);
  return same;
}

static rcgns_status write_fields(const char *from, const char *to, const char *solution, rcgns_message *why)
{
  rcgns_file  *file   = cf_open(from, NULL);
  rcgns_status status = RCGNS_MEMORY;

  if (file) {
    double               *a = values_of(file, 1.0), *b = values_of(file, 0.1);
    const rcgns_new_field field[2] = {{"Density", a}, {"MomentumX", b}};

    status = rcgns_write(file, to, solution, 2, field, why);
    free(a);
    free(b);
    rcgns_close(&file);
  }
  return status;
}

/* The payload of a node, by its path below the root; NULL: there is none. */
static const rc_node *node_at(const rcgns_file *file, const char *a, const char *b, const char *c, const char *d)
{
  const char *const name[4] = {a, b, c, d};
  int64_t           at      = 0;

  for (int i = 0; i < 4 && name[i] && at >= 0; i++) at = rc_tree_find(&file->tree, at, -1, NULL, name[i]);
  return at < 0 ? NULL : rc_node_at(&file->tree, at);
}

static void fields_are_replaced_and_added_and_the_rest_stays(void)
{
  char           from[64], to[64];
  rcgns_message  why;
  rcgns_file    *file;
  rcgns_solution chosen;
  double         block = 0.0, zoo = 0.0;

  make_target(cf_path(from, "target"));
  RT_EQ(write_fields(from, cf_path(to, "replaced"), "Sol", &why), RCGNS_OK);
  for (int c = 0; c < 12; c++) block += c + 1;
  zoo = 13 + 0.5 * (14 + 15);
  if ((file = cf_open(to, NULL))) {
    const rc_node *series = node_at(file, "Base", "Odd one", "series", NULL);
    const rc_node *class  = node_at(file, "Base", "Block", "Sol", "Density");
    char text[64];

    RT_NEAR(rcgns_get_info(file)->version, 3.4, 1e-6);
    RT_NEAR(cf_total(file), 12.0 + 2.0, 1e-12);
    RT_EQ(rcgns_select_solution(file, NULL, &chosen, &why), RCGNS_OK);
    RT_EQ(chosen.num_fields, 3);
    RT_STR(chosen.field[0].name, "Density");
    RT_STR(chosen.field[0].stored, "R8");
    RT_NEAR(cf_integral(file, "Density"), block + zoo, 1e-12);
    RT_NEAR(cf_integral(file, "MomentumX"), 0.1 * (block + zoo), 1e-12);
    RT_EQ(chosen.field[1].missing_in, 1); /* Pressure stays where it was */
    RT_CHECK(!node_at(file, "Base", "Block", "Sol", "Rind"));
    RT_CHECK(series && rc_count(series) == 3000 && series->kind == 'R');
    RT_CHECK(class && class->child >= 0 && !strcmp(rc_node_at(&file->tree, class->child)->name, "DataClass"));
    if (class)
      rc_tree_string(&file->tree,
                     rc_tree_find(&file->tree, rc_node_at(&file->tree, class->parent)->parent, -1, NULL, "ZoneType"), text,
                     sizeof text);
    RT_STR(text, "Structured");
    {
      double        pressure[12];
      const int64_t array = rc_tree_find(&file->tree, class->parent, -1, NULL, "Pressure");

      RT_EQ(rc_read_1d(file, RCGNS_OK, array, 0, 12, 'R', pressure, &why), RCGNS_OK);
      for (int c = 0; c < 12; c++) RT_NEAR(pressure[c], 5 * (c / 3) + 1 + c % 3, 0.0);
    }
    rcgns_close(&file);
  }
  cf_remove(from);
  cf_remove(to);
}

static void the_arrays_of_unknown_nodes_are_copied_bit_by_bit(void)
{
  char          from[64], to[64];
  rcgns_message why;
  rcgns_file   *file;

  make_target(cf_path(from, "target_bits"));
  RT_EQ(write_fields(from, cf_path(to, "bits"), "New", &why), RCGNS_OK);
  if ((file = cf_open(to, NULL))) {
    const int64_t user  = rc_tree_find(&file->tree, rc_tree_find(&file->tree, 0, -1, NULL, "Base"), -1, NULL, "Odd one");
    const int64_t array = rc_tree_find(&file->tree, user, -1, NULL, "series");
    double       *got   = tm_alloc_(3000, sizeof *got);

    RT_EQ(rc_read_1d(file, RCGNS_OK, array, 0, 3000, 'R', got, &why), RCGNS_OK);
    for (int i = 0; i < 3000; i++) RT_NEAR(got[i], i / 7.0, 0.0);
    free(got);
    rcgns_close(&file);
  }
  cf_remove(from);
  cf_remove(to);
}

static void the_bytes_do_not_depend_on_ranks_or_time(void)
{
  char          from[64], one[64], all[64];
  rcgns_message why;

  make_target(cf_path(from, "target_bytes"));
  cf_path(one, "by_one");
  if (rt_rank() == 0) {
    rcgns_file *file = NULL;

    RT_EQ(rcgns_open(MPI_COMM_SELF, from, NULL, &file, &why), RCGNS_OK);
    if (file) {
      double               *a = values_of(file, 1.0), *b = values_of(file, 0.1);
      const rcgns_new_field field[2] = {{"Density", a}, {"MomentumX", b}};

      RT_EQ(rcgns_write(file, one, "Sol", 2, field, &why), RCGNS_OK);
      free(a);
      free(b);
      rcgns_close(&file);
    }
    sleep(1);
  }
  MPI_Barrier(MPI_COMM_WORLD);
  RT_EQ(write_fields(from, cf_path(all, "by_all"), "Sol", &why), RCGNS_OK);
  if (rt_rank() == 0) RT_CHECK(is_same_file(one, all));
  cf_remove(from);
  cf_remove(one);
  cf_remove(all);
}

static void writing_again_changes_nothing_else(void)
{
  char          from[64], once[64], twice[64];
  rcgns_message why;

  make_target(cf_path(from, "target_twice"));
  RT_EQ(write_fields(from, cf_path(once, "once"), "Sol", &why), RCGNS_OK);
  RT_EQ(write_fields(once, cf_path(twice, "twice"), "Sol", &why), RCGNS_OK);
  if (rt_rank() == 0) RT_CHECK(is_same_file(once, twice));
  cf_remove(from);
  cf_remove(once);
  cf_remove(twice);
}

static void an_output_that_cannot_be_is_refused(void)
{
  char          from[64];
  rcgns_message why;
  rcgns_file   *file;

  make_target(cf_path(from, "target_refused"));
  RT_EQ(write_fields(from, from, "Sol", &why), RCGNS_USAGE);
  RT_CHECK(strstr(why.text, "one of the input files") && cf_is_agreed(&why));
  RT_EQ(write_fields(from, "no/such/folder.cgns", "Sol", &why), RCGNS_IO);
  RT_CHECK(strstr(why.text, "no/such/folder.cgns") && strstr(why.text, "folder cannot be written"));
  RT_EQ(write_fields(from, ".", "Sol", &why), RCGNS_IO);
  RT_CHECK(strstr(why.text, "not a regular file"));
  RT_EQ(write_fields(from, "/dev/null", "Sol", &why), RCGNS_IO);
  RT_EQ(write_fields(from, "cgns_never.cgns", "a/b", &why), RCGNS_USAGE);
  RT_CHECK(strstr(why.text, "no name for a solution"));
  RT_EQ(write_fields(from, "cgns_never.cgns", "ZoneType", &why), RCGNS_USAGE);
  RT_CHECK(strstr(why.text, "is no solution"));
  if ((file = cf_open(from, NULL))) {
    RT_EQ(rcgns_check_output(file, from, &why), RCGNS_USAGE);
    RT_EQ(rcgns_check_output(file, "cgns_never.cgns", &why), RCGNS_OK);
    rcgns_close(&file);
  }
  RT_CHECK(access("cgns_never.cgns", F_OK));
  cf_remove(from);
}

static void a_node_of_another_location_is_not_overwritten(void)
{
  cf_file      *f    = cf_new(3.4);
  const int64_t zone = cf_zoo_zone(f, cf_base(f), "Zoo");
  char          from[64];
  rcgns_message why;

  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CF_ZOO_HEXA);
  cf_reals(f, cf_empty(f, zone, "Sol", "FlowSolution_t"), "Density", 14, CF_ZOO_XYZ);
  cf_write(f, cf_path(from, "target_vertex"));
  RT_EQ(write_fields(from, "cgns_never.cgns", "Sol", &why), RCGNS_USAGE);
  RT_CHECK(strstr(why.text, "Vertex-located: choose another name (--output-solution)"));
  cf_remove(from);
}

/* Are there files of an unfinished output? */
static bool leaves_parts(const char *path)
{
  char   pattern[128];
  glob_t found;
  bool   any;

  snprintf(pattern, sizeof pattern, "%s.part-*", path);
  any = glob(pattern, 0, NULL, &found) == 0;
  globfree(&found);
  return any;
}

static void a_full_disk_leaves_the_old_output_as_it_was(void)
{
  char          from[64], to[64];
  rcgns_message why;
  struct rlimit old, small;

  make_target(cf_path(from, "target_full"));
  cf_path(to, "full");
  if (rt_rank() == 0) {
    FILE *file = fopen(to, "wb");

    fputs("the old content", file);
    fclose(file);
  }
  MPI_Barrier(MPI_COMM_WORLD);
  signal(SIGXFSZ, SIG_IGN);
  getrlimit(RLIMIT_FSIZE, &old);
  small = old;
  for (rlim_t limit = 100000; limit > 100; limit /= 10) {
    rcgns_status status;

    small.rlim_cur = limit;
    setrlimit(RLIMIT_FSIZE, &small);
    status = write_fields(from, to, "Sol", &why);
    setrlimit(RLIMIT_FSIZE, &old);
    RT_EQ(status, RCGNS_IO);
    RT_CHECK(strstr(why.text, to) && cf_is_agreed(&why));
    if (rt_rank() == 0) {
      long  size;
      char *text = slurp(to, &size);

      RT_CHECK(size == 15 && !memcmp(text, "the old content", 15));
      RT_CHECK(!leaves_parts(to));
      free(text);
    }
  }
  RT_EQ(write_fields(from, to, "Sol", &why), RCGNS_OK);
  if (rt_rank() == 0) RT_CHECK(!leaves_parts(to));
  cf_remove(from);
  cf_remove(to);
}

static void put_link(cf_file *f, int64_t parent, const char *name, const char *file, const char *path)
{
  const int64_t at = rc_plan_add(&f->plan, parent, name, "", NULL, 0, NULL, 0, NULL);
  rc_entry     *e  = rc_entry_at(&f->plan, at);

  e->content   = RC_LINK;
  e->link_file = strdup(file);
  e->link_path = strdup(path);
}

static void links_still_lead_somewhere_from_another_folder(void)
{
  cf_file      *f    = cf_new(3.4);
  int64_t       base = cf_base(f), zone = cf_zoo_zone(f, base, "Zoo");
  char          grid[64], from[64], folder[64], to[160];
  rcgns_message why;
  rcgns_file   *file;

  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CF_ZOO_HEXA);
  zone = cf_zoo_zone(f, base, "Whole");
  cf_section(f, zone, "Penta", 14, 1, 2, 12, CF_ZOO_PENTA);
  cf_write(f, cf_path(grid, "link_grid"));
  f    = cf_new(3.4);
  base = cf_base(f);
  zone = cf_zone(f, base, "Zoo", 1, (int64_t[]){CF_ZOO_NODES, 1, 0});
  put_link(f, zone, "GridCoordinates", grid, "/Base/Zoo/GridCoordinates");
  put_link(f, zone, "Hexa", grid, "/Base/Zoo/Hexa");
  put_link(f, base, "Linked", grid, "/Base/Whole");
  put_link(f, base, "Lost", "no_such_file.cgns", "/Base/Z");
  put_link(f, base, "Circle", "", "/Base");
  put_link(f, zone, "Twin", "", "/Base/Zoo/ZoneType");
  cf_write(f, cf_path(from, "link_target"));
  snprintf(folder, sizeof folder, "cgns_folder_np%d", rt_size());
  if (rt_rank() == 0) mkdir(folder, 0777);
  snprintf(to, sizeof to, "%s/out.cgns", folder);
  RT_EQ(write_fields(from, to, "Sol", &why), RCGNS_OK);
  if ((file = cf_open(to, NULL))) {
    const rc_node *whole = node_at(file, "Base", "Linked", NULL, NULL);
    rcgns_solution chosen;

    RT_EQ(rcgns_get_info(file)->num_cells, 3);
    RT_NEAR(cf_total(file), 2.0, 1e-14);
    RT_CHECK(cf_has_note(file, "Base/Lost leads nowhere") && cf_has_note(file, "Base/Circle leads nowhere"));
    RT_CHECK(whole && !whole->is_link); /* a solution had to go into it */
    RT_CHECK(node_at(file, "Base", "Zoo", "Hexa", NULL)->is_link);
    RT_STR(node_at(file, "Base", "Zoo", "Twin", NULL)->label, "ZoneType_t");
    RT_EQ(rcgns_select_solution(file, NULL, &chosen, &why), RCGNS_OK);
    RT_NEAR(cf_integral(file, "Density"), 1 + 0.5 * (2 + 3), 1e-14);
    RT_EQ(rcgns_check_output(file, grid, &why), RCGNS_USAGE);
    rcgns_close(&file);
  }
  if ((file = cf_open(grid, NULL))) { /* and not into the file it was linked from */
    RT_CHECK(!node_at(file, "Base", "Whole", "Sol", NULL));
    rcgns_close(&file);
  }
  cf_remove(to);
  cf_remove(from);
  cf_remove(grid);
  if (rt_rank() == 0) rmdir(folder);
}

RT_MAIN(RT_CASE(fields_are_replaced_and_added_and_the_rest_stays), RT_CASE(the_arrays_of_unknown_nodes_are_copied_bit_by_bit),
        RT_CASE(the_bytes_do_not_depend_on_ranks_or_time), RT_CASE(writing_again_changes_nothing_else),
        RT_CASE(an_output_that_cannot_be_is_refused), RT_CASE(a_node_of_another_location_is_not_overwritten),
        RT_CASE(a_full_disk_leaves_the_old_output_as_it_was), RT_CASE(links_still_lead_somewhere_from_another_folder))
