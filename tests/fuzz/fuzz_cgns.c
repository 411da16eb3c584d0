/* Any file that HDF5 can open is refused with a message or read; what was read can be overlaid, and written and read again;
 * nothing crashes or hangs, and all ranks agree. The bytes choose a small valid file and damage its nodes: labels, types,
 * names, shapes, values, links, whole branches, and at last its length. */
#include "files.h"
#include "fuzz.h"

#include <hdf5.h>

enum { NUM_BASES = 6, MOST_NODES = 200, MOST_FIELDS = 6, MOST_DAMAGES = 24, MOST_VALUES = 4096, MOST_CELLS = 5000 };

/* ---- files to begin with ------------------------------------------------------------------------------------------------ */

static void write_blocks(const char *path)
{
  double         xyz[27 * 3], value[8];
  rcgns_new_zone zone[2];
  rcgns_message  why;

  for (int i = 0; i < 27; i++)
    for (int d = 0; d < 3; d++)
      xyz[3 * i + d] = d == 0 ? i % 3 : d == 1 ? i / 3 % 3 : i / 9; /* NOLINT(bugprone-integer-division) */
  for (int i = 0; i < 8; i++) value[i] = i;
  const rcgns_new_field field = {"Density", value};
  for (int z = 0; z < 2; z++)
    zone[z] =
        (rcgns_new_zone){.name = z ? "B" : "A", .num_vertices = {3, 3, 3}, .node_xyz = xyz, .num_fields = 1, .field = &field};
  FUZZ_CHECK(rcgns_create(path, 4.2, "FlowSolution", 2, zone, &why) == RCGNS_OK);
}

static void write_polyhedra(const char *path)
{
  tm_mesh             *mesh     = tm_dual((int[]){1, 1, 1}, NULL, NULL);
  const double         value[8] = {1, 2, 3, 4, 5, 6, 7, 8};
  const rcgns_new_field field   = {"Pressure", value};
  const rcgns_new_zone zone     = {.name = "Z", .mesh = &mesh->view, .num_fields = 1, .field = &field};
  rcgns_message        why;

  FUZZ_CHECK(rcgns_create(path, 3.4, "FlowSolution", 1, &zone, &why) == RCGNS_OK);
  tm_free(mesh);
}

/* A boundary condition; location NULL: none is said. */
static void put_bc(cf_file *f, int64_t zone, const char *place, int nd, const int64_t *dim, const int64_t *number,
                   const char *location)
{
  const int64_t at = cf_text(f, cf_empty(f, zone, "ZoneBC", "ZoneBC_t"), "Wall", "BC_t", "BCWall");

  cf_put(f, at, place, "IndexArray_t", "I4", nd, dim, 'I', number);
  if (location) cf_text(f, at, "GridLocation", "GridLocation_t", location);
}

/* A zone of every element type: in sections of one type, or MIXED. */
static void write_elements(const char *path, bool mixed)
{
  static const double  value[CF_ZOO_CELLS] = {1, 2, 3, 4, 5};
  static const int64_t together[] = {17, 1, 2, 5, 4,  7,  8,  11, 10, 14, 2,  3,  6,  8, 9, 12, 14,
                                     2,  6, 5, 8, 12, 11, 12, 7,  8,  11, 10, 13, 10, 8, 9, 12, 14};
  static const int64_t offset[]   = {0, 9, 16, 23, 29, 34};
  cf_file      *f    = cf_new(4.2);
  const int64_t base = cf_base(f), zone = cf_zoo_zone(f, base, "Z");

  if (mixed) {
    cf_offsets(f, cf_section(f, zone, "Mixed", 20, 1, 5, (int64_t)(sizeof together / sizeof *together), together), 6, offset);
  } else {
    cf_section(f, zone, "Hexa", 17, 1, 1, 8, CF_ZOO_HEXA);
    cf_section(f, zone, "Penta", 14, 2, 3, 12, CF_ZOO_PENTA);
    cf_section(f, zone, "Pyra", 12, 4, 4, 5, CF_ZOO_PYRA);
    cf_section(f, zone, "Tetra", 10, 5, 5, 4, CF_ZOO_TETRA);
    cf_section(f, zone, "Quad", 7, 6, 6, 4, CF_ZOO_QUAD);
  }
  if (mixed)
    put_bc(f, zone, "PointList", 2, (int64_t[]){4, 1}, (int64_t[]){1, 2, 5, 4}, NULL);
  else
    put_bc(f, zone, "PointRange", 2, (int64_t[]){2, 1}, (int64_t[]){6, 6}, "FaceCenter");
  cf_solution(f, zone, "First", "Density", CF_ZOO_CELLS, value);
  cf_solution(f, zone, "Second", "Density", CF_ZOO_CELLS, value);
  const int64_t steps = cf_ints(f, base, "Steps", "BaseIterativeData_t", 1, (int64_t[]){2});
  cf_reals(f, steps, "TimeValues", 2, (double[]){0.0, 1.0});
  const int64_t history = cf_empty(f, zone, "History", "ZoneIterativeData_t");
  char          names[64];
  memset(names, ' ', sizeof names);
  memcpy(names, "First", 5);
  memcpy(names + 32, "Second", 6);
  cf_put(f, history, "FlowSolutionPointers", "DataArray_t", "C1", 2, (int64_t[]){2, 32}, 'C', names);
  cf_write(f, path);
}

/* NGON_n with ParentElements, without NFACE_n. */
static void write_parents(const char *path)
{
  tm_mesh      *mesh = tm_tetrahedra((int[]){1, 1, 1}, NULL, NULL);
  const int64_t n = mesh->view.num_faces, corners = mesh->face_offset[n];
  int64_t      *node = tm_alloc_(corners, sizeof *node), *parent = tm_alloc_(2 * n, sizeof *parent);
  cf_file      *f    = cf_new(4.2);
  const int64_t zone = cf_zone(f, cf_base(f), "Z", 1, (int64_t[]){mesh->view.num_nodes, mesh->view.num_cells, 0});

  for (int64_t i = 0; i < corners; i++) node[i] = mesh->face_node[i] + 1;
  for (int64_t i = 0; i < n; i++) {
    parent[i]     = n + 1 + mesh->owner[i];
    parent[n + i] = mesh->neighbour[i] < 0 ? 0 : n + 1 + mesh->neighbour[i];
  }
  cf_coordinates(f, zone, mesh->xyz, 1, &mesh->view.num_nodes);
  const int64_t section = cf_section(f, zone, "Faces", 22, 1, n, corners, node);
  cf_offsets(f, section, n + 1, mesh->face_offset);
  cf_put(f, section, "ParentElements", "DataArray_t", "I8", 2, (int64_t[]){2, n}, 'I', parent);
  put_bc(f, zone, "PointList", 2, (int64_t[]){3, 1}, (int64_t[]){1, 2, 3}, "FaceCenter");
  cf_write(f, path);
  free(node);
  free(parent);
  tm_free(mesh);
}

/* A block with a layer of rind around coordinates and solution. */
static void write_rind(const char *path)
{
  double        xyz[125 * 3], value[64];
  cf_file      *f    = cf_new(3.2);
  const int64_t zone = cf_zone(f, cf_base(f), "Z", 3, (int64_t[]){3, 3, 3, 2, 2, 2, 0, 0, 0}), layer[6] = {1, 1, 1, 1, 1, 1};

  for (int i = 0; i < 125; i++)
    for (int d = 0; d < 3; d++)
      xyz[3 * i + d] = d == 0 ? i % 5 : d == 1 ? i / 5 % 5 : i / 25; /* NOLINT(bugprone-integer-division) */
  for (int i = 0; i < 64; i++) value[i] = i;
  cf_ints(f, cf_coordinates(f, zone, xyz, 3, (int64_t[]){5, 5, 5}), "Rind", "Rind_t", 6, layer);
  const int64_t solution = cf_solution(f, zone, "S", "Density", 0, NULL);
  cf_ints(f, solution, "Rind", "Rind_t", 6, layer);
  put_bc(f, zone, "PointRange", 2, (int64_t[]){2, 3}, (int64_t[]){1, 1, 1, 1, 3, 3}, NULL);
  cf_put(f, solution, "Density", "DataArray_t", "R8", 3, (int64_t[]){4, 4, 4}, 'R', value);
  cf_write(f, path);
}

/* ---- damage: rank 0 alone ------------------------------------------------------------------------------------------------ */

/* The nodes of the file, as paths. */
typedef struct node_list {
  char path[MOST_NODES][200];
  int  num;
} node_list;

static herr_t add_node(hid_t group, const char *name, const H5O_info_t *info, void *user)
{
  node_list *list = user;

  (void)group;
  if (info->type != H5O_TYPE_GROUP || list->num == MOST_NODES || strlen(name) >= sizeof list->path[0] - 1) return 0;
  snprintf(list->path[list->num++], sizeof list->path[0], "%s", name);
  return 0;
}

static const char *any_label(fuzz_bytes *b)
{
  static const char *const label[] = {"CGNSBase_t",  "Zone_t",          "Elements_t",     "DataArray_t",   "FlowSolution_t",
                                      "Rind_t",      "GridLocation_t",  "IndexRange_t",   "ZoneType_t",    "GridCoordinates_t",
                                      "BaseIterativeData_t", "ZoneIterativeData_t", "CGNSLibraryVersion_t", "", "Nonsense_t"};
  return label[fuzz_below(b, (int64_t)(sizeof label / sizeof *label))];
}

static const char *any_name(fuzz_bytes *b)
{
  static const char *const name[] = {"GridCoordinates",     "CoordinateX",        "CoordinateR",          "ElementRange",
                                     "ElementConnectivity", "Density",            "ParentElements",       "ParentData",
                                     "Rind",                "ElementStartOffset", "GridLocation",         "ZoneType",
                                     "PointList",           "PointRange",         "FlowSolutionPointers", "TimeValues",
                                     "Z",                   "Base",               "NumberOfSteps",
                                     "a name of more than 32 letters in all"};
  return name[fuzz_below(b, (int64_t)(sizeof name / sizeof *name))];
}

static const char *any_text(fuzz_bytes *b)
{
  static const char *const text[] = {"Structured",  "Unstructured", "CellCenter", "Vertex",  "FaceCenter",
                                     "UserDefined", "Null",         " ",          "First",   "/Base/Z",
                                     "/",           "Base/Z/..",    "/nowhere",   "\xff\xfe"};
  return text[fuzz_below(b, (int64_t)(sizeof text / sizeof *text))];
}

static hid_t any_type(fuzz_bytes *b)
{
  const hid_t type[] = {H5T_NATIVE_INT32, H5T_NATIVE_INT64,  H5T_NATIVE_DOUBLE, H5T_NATIVE_FLOAT,
                        H5T_NATIVE_SCHAR, H5T_NATIVE_UINT32, H5T_NATIVE_INT16,  H5T_NATIVE_UINT64,
                        H5T_STD_I64BE,    H5T_NATIVE_UCHAR,  H5T_NATIVE_LDOUBLE};
  return type[fuzz_below(b, (int64_t)(sizeof type / sizeof *type))];
}

static void set_attribute(hid_t node, const char *name, const char *text, size_t size)
{
  char  padded[40] = "";
  hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR), attribute;

  snprintf(padded, sizeof padded, "%s", text);
  H5Tset_size(type, size);
  if (H5Aexists(node, name) > 0) H5Adelete(node, name);
  attribute = H5Acreate2(node, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
  H5Awrite(attribute, type, padded);
  H5Aclose(attribute);
  H5Sclose(space);
  H5Tclose(type);
}

/* A new payload of any shape and type, filled with small numbers. */
static void new_payload(hid_t node, const char *name, fuzz_bytes *b)
{
  const int   nd   = (int)fuzz_below(b, 5);
  const hid_t type = any_type(b);
  hsize_t     dim[4];
  int64_t     value[MOST_VALUES];
  hid_t       space, data;
  hsize_t     count = 1;

  for (int d = 0; d < nd; d++) count *= dim[d] = (hsize_t)fuzz_below(b, 9);
  if (count > MOST_VALUES) return;
  for (hsize_t i = 0; i < count; i++) value[i] = i < 40 ? (int64_t)fuzz_byte(b) - 4 : (int64_t)i;
  if (H5Lexists(node, name, H5P_DEFAULT) > 0) H5Ldelete(node, name, H5P_DEFAULT);
  space = nd ? H5Screate_simple(nd, dim, NULL) : H5Screate(count % 2 ? H5S_SCALAR : H5S_NULL);
  data  = H5Dcreate2(node, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  H5Dwrite(data, H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, value);
  H5Dclose(data);
  H5Sclose(space);
}

static void new_text(hid_t node, const char *name, const char *text)
{
  const hsize_t n     = strlen(text);
  const hid_t   space = H5Screate_simple(1, &n, NULL);
  hid_t         data;

  if (H5Lexists(node, name, H5P_DEFAULT) > 0) H5Ldelete(node, name, H5P_DEFAULT);
  data = H5Dcreate2(node, name, H5T_NATIVE_SCHAR, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  H5Dwrite(data, H5T_NATIVE_SCHAR, H5S_ALL, H5S_ALL, H5P_DEFAULT, text);
  H5Dclose(data);
  H5Sclose(space);
}

/* Another value somewhere in the payload. */
static void change_value(hid_t node, fuzz_bytes *b)
{
  const hid_t data = H5Dopen2(node, " data", H5P_DEFAULT);
  const hid_t space = H5Dget_space(data), type = H5Dget_type(data);
  const bool  real  = H5Tget_class(type) == H5T_FLOAT;
  const hid_t as    = real ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT64;
  const hssize_t n  = H5Sget_simple_extent_npoints(space);
  int64_t        value[MOST_VALUES] = {0};

  if (data >= 0 && n > 0 && n <= MOST_VALUES && H5Dread(data, as, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0) {
    const int64_t at   = fuzz_below(b, n), kind = fuzz_below(b, 6);
    const double  x    = kind == 0 ? fuzz_double(b) : (double)fuzz_below(b, 32) / 8 - 1;
    const int64_t word = kind == 0 ? fuzz_int64(b) : kind == 1 ? value[fuzz_below(b, n)] : fuzz_below(b, 40) - 8;

    if (real)
      memcpy(&value[at], &x, sizeof x);
    else
      value[at] = word;
    H5Dwrite(data, as, H5S_ALL, H5S_ALL, H5P_DEFAULT, value);
  }
  H5Tclose(type);
  H5Sclose(space);
  H5Dclose(data);
}

static void damage_node(hid_t file, const node_list *list, fuzz_bytes *b)
{
  static const char *const type[] = {"I4", "I8", "R4", "R8", "C1", "MT", "LK", "U8", "B1", "X8", "?"};
  const char *path  = list->path[fuzz_below(b, list->num)], *other = list->path[fuzz_below(b, list->num)];
  const int64_t kind = fuzz_below(b, 13);
  char        to[260];
  const hid_t node = H5Gopen2(file, path, H5P_DEFAULT);

  if (node < 0) return; /* it went with a branch that was cut off */
  snprintf(to, sizeof to, "%s/%s", other, any_name(b));
  switch (kind) {
    case 0: set_attribute(node, "label", any_label(b), 33); break;
    case 1: set_attribute(node, "type", type[fuzz_below(b, (int64_t)(sizeof type / sizeof *type))], 3); break;
    case 2: set_attribute(node, fuzz_byte(b) & 1 ? "name" : "label", any_name(b), 1 + (size_t)fuzz_below(b, 39)); break;
    case 3: H5Lmove(file, path, file, to, H5P_DEFAULT, H5P_DEFAULT); break;
    case 4: H5Ldelete(file, path, H5P_DEFAULT); break;
    case 5: H5Ocopy(file, path, file, to, H5P_DEFAULT, H5P_DEFAULT); break;
    case 6: new_payload(node, " data", b); break;
    case 7: new_text(node, " data", any_text(b)); break;
    case 8:
      set_attribute(node, "type", "LK", 3);
      new_text(node, " path", fuzz_byte(b) & 1 ? any_text(b) : other);
      if (fuzz_byte(b) & 1) new_text(node, " file", fuzz_byte(b) & 1 ? "nowhere.cgns" : "");
      break;
    case 9: H5Lcreate_soft(other, file, to, H5P_DEFAULT, H5P_DEFAULT); break;
    case 10: H5Lcreate_hard(file, path, file, to, H5P_DEFAULT, H5P_DEFAULT); break;
    default: change_value(node, b); break;
  }
  H5Gclose(node);
}

static void damage_file(const char *path, fuzz_bytes *b)
{
  const int64_t length = fuzz_byte(b); /* in 256ths; 0: all of it */
  const hid_t   file   = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
  node_list    *list   = calloc(1, sizeof *list);
  FILE         *stream;

  FUZZ_CHECK(file >= 0 && list);
  H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_INC, add_node, list, H5O_INFO_BASIC);
  for (int i = 0; i < MOST_DAMAGES && b->left; i++) damage_node(file, list, b);
  free(list);
  H5Fclose(file);
  if (length == 0 || length % 4) return; /* mostly all */
  stream = fopen(path, "rb+");
  FUZZ_CHECK(stream && fseek(stream, 0, SEEK_END) == 0);
  FUZZ_CHECK(ftruncate(fileno(stream), ftell(stream) * length / 256) == 0);
  fclose(stream);
}

/* ---- what must hold ------------------------------------------------------------------------------------------------------ */

/* All ranks got the same, and a failure says why. Collective. */
static void check_status(rcgns_status status, const rcgns_message *why)
{
  int both[2] = {(int)status, -(int)status};

  MPI_Allreduce(MPI_IN_PLACE, both, 2, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  FUZZ_CHECK(both[0] == -both[1]);
  FUZZ_CHECK((status == RCGNS_OK) == (why->text[0] == 0));
  FUZZ_CHECK(strlen(why->text) < sizeof why->text - 1 && !strchr(why->text, '\n'));
}

static void read_fields(rcgns_file *file, double *value)
{
  for (int k = 0; k < 4; k++) {
    rcgns_choice   choice;
    rcgns_solution solution;
    rcgns_message  why;
    rcgns_status   status;

    rcgns_choice_default(&choice);
    if (k == 1) choice.optional = 1;
    if (k == 2) choice.step = RCGNS_STEP_LAST;
    if (k == 3) choice.name = "First";
    status = rcgns_select_solution(file, &choice, &solution, &why);
    check_status(status, &why);
    for (int64_t f = 0; status == RCGNS_OK && f < solution.num_fields && f < MOST_FIELDS; f++)
      check_status(rcgns_read_field(file, solution.field[f].name, value, &why), &why);
  }
}

static void read_boundaries(rcgns_file *file)
{
  const int64_t    num = rcgns_mesh(file)->num_faces;
  rcgns_boundaries boundaries;
  rcgns_message    why;
  rcgns_status     status = rcgns_read_boundaries(file, &boundaries, &why);

  check_status(status, &why);
  for (int64_t f = 0; status == RCGNS_OK && f < num; f++)
    FUZZ_CHECK(boundaries.face[f] >= -1 && boundaries.face[f] < boundaries.num);
}

static void overlay_with_itself(const remap_mesh *mesh)
{
  remap_context *ctx = NULL;
  remap_status   status;

  FUZZ_CHECK(remap_create(MPI_COMM_WORLD, NULL, &ctx) == REMAP_OK);
  FUZZ_CHECK(remap_set_mesh(ctx, REMAP_SOURCE, mesh) == REMAP_OK && remap_set_mesh(ctx, REMAP_TARGET, mesh) == REMAP_OK);
  status = remap_build(ctx);
  if (status != REMAP_OK && status != REMAP_BAD_MESH) fprintf(stderr, "%s\n", remap_message(ctx));
  FUZZ_CHECK(status == REMAP_OK || status == REMAP_BAD_MESH);
  remap_destroy(&ctx);
}

/* A file that was read can be written with a new field; what was written can be read, and has as many cells. */
static void write_and_read(rcgns_file *file, const char *path, const double *value)
{
  const rcgns_new_field field = {"Written", value};
  rcgns_file           *back  = NULL;
  rcgns_message         why;
  rcgns_status          status = rcgns_write(file, path, "FlowSolution", 1, &field, &why);

  check_status(status, &why);
  if (status != RCGNS_OK) return;
  status = rcgns_open(MPI_COMM_WORLD, path, NULL, &back, &why);
  if (status != RCGNS_OK && rt_rank_ == 0) fprintf(stderr, "%s\n", why.text);
  FUZZ_CHECK(status == RCGNS_OK);
  FUZZ_CHECK(rcgns_get_info(back)->num_cells == rcgns_get_info(file)->num_cells);
  rcgns_close(&back);
}

static void try_file(const char *path, const char *output)
{
  rcgns_file   *file = NULL;
  rcgns_message why;
  rcgns_status  status = rcgns_open(MPI_COMM_WORLD, path, NULL, &file, &why);

  check_status(status, &why);
  FUZZ_CHECK((status == RCGNS_OK) == (file != NULL));
  if (status != RCGNS_OK) return;
  fuzz_accepted++;
  if (rcgns_get_info(file)->num_cells <= MOST_CELLS) {
    double *value = tm_alloc_(rcgns_mesh(file)->num_cells, sizeof *value);

    read_boundaries(file);
    read_fields(file, value);
    overlay_with_itself(rcgns_mesh(file));
    write_and_read(file, output, value);
    free(value);
  }
  rcgns_close(&file);
}

void fuzz_one(const uint8_t *data, size_t size)
{
  fuzz_bytes b     = {data, size};
  const int  which = (int)fuzz_below(&b, NUM_BASES);
  int        id    = (int)getpid();
  char       path[64], output[64];

  H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
  MPI_Comm_rank(MPI_COMM_WORLD, &rt_rank_);
  MPI_Bcast(&id, 1, MPI_INT, 0, MPI_COMM_WORLD);
  snprintf(path, sizeof path, "fuzz_cgns_%d.cgns", id);
  snprintf(output, sizeof output, "fuzz_cgns_%d_out.cgns", id);
  if (which == 0 && rt_rank_ == 0) write_blocks(path);
  if (which == 1 && rt_rank_ == 0) write_polyhedra(path);
  if (which == 2 || which == 3) write_elements(path, which == 3);
  if (which == 4) write_parents(path);
  if (which == 5) write_rind(path);
  if (rt_rank_ == 0) damage_file(path, &b);
  MPI_Barrier(MPI_COMM_WORLD);
  try_file(path, output);
  MPI_Barrier(MPI_COMM_WORLD);
  if (rt_rank_ == 0) {
    unlink(path);
    unlink(output);
  }
}
FUZZ_MAIN
