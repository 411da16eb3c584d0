/* make_files -- write the small CGNS files that the tests of the remap command run on, good ones and broken ones.
 *
 *   ./make_files DIR
 *
 * Every file holds the cube from `low` to `high` as n x n x n hexahedra, with what its recipe changes. */
#include <cgns_io.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_N = 4, MAX_NODES = (MAX_N + 1) * (MAX_N + 1) * (MAX_N + 1), MAX_CELLS = MAX_N * MAX_N * MAX_N };

/* What is in a file, and what is wrong with it. */
typedef struct recipe {
  const char *name;
  int         n;
  double      low, high;
  double      fields;      /* not 0: FlowSolution with Density of that value, more or less, and others */
  double      second;      /* not 0: a second solution, Other */
  double      second_zone; /* not 0: a second zone, from there on */
  bool        is_ngon;     /* NGON_n and NFACE_n, one cell */
  bool        is_surface;  /* quadrilaterals only */
  int         gas;         /* not 0: velocities, pressure, temperature, mass fractions and a gas model: see gas_bits */
  bool        masks;       /* a node Masks: Iblank, ChimeraCellType and others; Density is absurd in their holes */
  bool        linear;      /* Tracer is a linear field, by the middles of cells */
  bool        hole_column; /* the holes are the first cells along x of the second zone instead */
  bool        walls;       /* boundary conditions: Inlet at the low side of x, Outlet of the second zone at its high side */
  bool        bow_tie;     /* one cell that is turned inside out over half of its width: its volume nearly cancels */
  bool        no_coordinates, nan_coordinate, far_node, open_cell, three_cells, short_field, nan_field, at_vertices;
} recipe;

/* What a file with a gas holds; velocity, pressure and temperature are uniform unless Density is left out. */
enum gas_bits { GAS = 1, GAS_RATIO = 2, GAS_CONSTANT = 4, GAS_DENSITY = 8, GAS_VACUUM = 16, GAS_LONE = 32 };

static const recipe recipes[] = {
    {.name = "good", .n = 4, .high = 1, .fields = 1},
    {.name = "mesh", .n = 3, .high = 1},
    {.name = "half", .n = 3, .low = .5, .high = 1.5},
    {.name = "old", .n = 3, .low = .5, .high = 1.5, .fields = 7},
    {.name = "far", .n = 2, .low = 10, .high = 11},
    {.name = "two_solutions", .n = 2, .high = 1, .fields = 1, .second = 2},
    {.name = "two_zones", .n = 2, .high = 1, .second_zone = 1},
    {.name = "no_volume", .n = 2, .high = 1, .is_surface = true},
    {.name = "no_coordinates", .n = 2, .high = 1, .fields = 1, .no_coordinates = true},
    {.name = "nan_coordinate", .n = 2, .high = 1, .fields = 1, .nan_coordinate = true},
    {.name = "far_node", .n = 2, .high = 1, .fields = 1, .far_node = true},
    {.name = "closed_cell", .n = 1, .high = 1, .is_ngon = true},
    {.name = "open_cell", .n = 1, .high = 1, .is_ngon = true, .open_cell = true},
    {.name = "three_cells", .n = 1, .high = 1, .is_ngon = true, .three_cells = true},
    {.name = "short_field", .n = 2, .high = 1, .fields = 1, .short_field = true},
    {.name = "nan_field", .n = 2, .high = 1, .fields = 1, .nan_field = true},
    {.name = "at_vertices", .n = 2, .high = 1, .fields = 1, .at_vertices = true},
    {.name = "vertex_old", .n = 3, .low = .5, .high = 1.5, .fields = 7, .at_vertices = true},
    {.name = "zones_overlap", .n = 2, .high = 1, .second_zone = .25},
    {.name = "gas", .n = 4, .high = 1, .fields = 1, .gas = GAS | GAS_DENSITY | GAS_RATIO | GAS_CONSTANT},
    {.name = "gas_untold", .n = 4, .high = 1, .fields = 1, .gas = GAS | GAS_DENSITY},
    {.name = "gas_without_density", .n = 4, .high = 1, .fields = 1, .gas = GAS | GAS_RATIO},
    {.name = "gas_by_state", .n = 4, .high = 1, .fields = 1, .gas = GAS | GAS_RATIO | GAS_CONSTANT},
    {.name = "gas_vacuum", .n = 4, .high = 1, .fields = 1, .gas = GAS | GAS_DENSITY | GAS_RATIO | GAS_VACUUM},
    {.name = "gas_lone", .n = 4, .high = 1, .fields = 1, .gas = GAS | GAS_DENSITY | GAS_LONE},
    {.name = "masked", .n = 4, .high = 1, .fields = 1, .masks = true},
    {.name = "overset", .n = 2, .high = 1, .fields = 1, .masks = true, .second_zone = .5, .hole_column = true},
    {.name = "crossed", .n = 4, .high = 1, .fields = 1, .linear = true, .second_zone = .3, .walls = true},
    {.name = "inside", .n = 3, .low = .05, .high = 1.05, .fields = 1, .linear = true},
    {.name = "gas_crossed", .n = 4, .high = 1, .fields = 1, .second_zone = .3, .gas = GAS | GAS_DENSITY | GAS_RATIO},
    {.name = "wide", .n = 4, .low = -1, .high = 2, .fields = 1},
    {.name = "bow_tie", .n = 1, .high = 1, .bow_tie = true},
};

static int file; /* cgio's handle */

static void must(int error, const char *what)
{
  char text[400];

  if (!error) return;
  cgio_error_message(text);
  fprintf(stderr, "make_files: %s: %s\n", what, text);
  exit(1);
}

/* A node; type MT has no data. */
static double add(double parent, const char *name, const char *label, const char *type, int nd, const cgsize_t *dims,
                  const void *data)
{
  char   full_name[33] = "", full_label[33] = ""; /* the CGNS library reads as much, whatever is in it */
  double id;

  memcpy(full_name, name, strlen(name));
  memcpy(full_label, label, strlen(label));
  must(cgio_create_node(file, parent, full_name, &id), name);
  must(cgio_set_label(file, id, full_label), name);
  if (strcmp(type, "MT")) must(cgio_set_dimensions(file, id, type, nd, dims), name);
  if (data) must(cgio_write_all_data(file, id, data), name);
  return id;
}

static double add_1d(double parent, const char *name, const char *label, const char *type, int count, const void *data)
{
  const cgsize_t dims[1] = {count};

  return add(parent, name, label, type, 1, dims, data);
}

static double add_text(double parent, const char *name, const char *label, const char *text)
{
  return add_1d(parent, name, label, "C1", (int)strlen(text), text);
}

static void add_coordinates(double zone, const recipe *r, double low, double high)
{
  static const char *const name[3] = {"CoordinateX", "CoordinateY", "CoordinateZ"};
  const double             grid    = add(zone, "GridCoordinates", "GridCoordinates_t", "MT", 0, NULL, NULL);
  const int                row = r->n + 1, count = row * row * row;
  double                   x[MAX_NODES];

  for (int d = 0; d < 3; d++) {
    for (int i = 0; i < count; i++) {
      const int    place = d == 0 ? i % row : d == 1 ? i / row % row : i / row / row;
      const double from = d == 0 ? low : r->low, to = d == 0 ? high : r->high;

      x[i] = place == r->n ? to : from + (to - from) * place / r->n;
    }
    if (r->nan_coordinate && d == 1) x[count - 1] = NAN;
    if (r->bow_tie && d == 0) x[2] = x[6] = 1 + 1e-13, x[3] = x[7] = 0;
    add_1d(grid, name[d], "DataArray_t", "R8", count, x);
  }
}

static double add_section(double zone, const char *name, int code, int first, int last, int length, const int *connectivity)
{
  const int    element[2] = {code, 0}, range[2] = {first, last};
  const double section = add_1d(zone, name, "Elements_t", "I4", 2, element);

  add_1d(section, "ElementRange", "IndexRange_t", "I4", 2, range);
  add_1d(section, "ElementConnectivity", "DataArray_t", "I4", length, connectivity);
  return section;
}

static void add_hexahedra(double zone, const recipe *r)
{
  const int row = r->n + 1, layer      = row * row;
  int       node[MAX_CELLS * 8], count = 0;

  for (int k = 0; k < r->n; k++)
    for (int j = 0; j < r->n; j++)
      for (int i = 0; i < r->n; i++) {
        const int first         = 1 + i + row * j + layer * k;
        const int hexahedron[8] = {first,         first + 1,         first + 1 + row,         first + row,
                                   first + layer, first + layer + 1, first + layer + 1 + row, first + layer + row};

        memcpy(node + count, hexahedron, sizeof hexahedron);
        count += 8;
      }
  if (r->far_node) node[count - 1] = 1000;
  add_section(zone, "Hexahedra", 17, 1, count / 8, count, node);
}

static void add_surface(double zone)
{
  const int quadrilateral[4] = {1, 2, 5, 4};

  add_section(zone, "Quadrilaterals", 7, 1, 1, 4, quadrilateral);
}

/* The one cell of a cube as a polyhedron; its face 6 is left out of an open cell and claimed by three in all of three_cells. */
static void add_polyhedron(double zone, const recipe *r)
{
  static const int nodes[24]      = {1, 3, 4, 2, 5, 6, 8, 7, 1, 2, 6, 5, 3, 7, 8, 4, 1, 5, 7, 3, 2, 4, 8, 6};
  static const int faces[18]      = {1, 2, 3, 4, 5, 6, 1, 2, 3, 4, 5, 6, 1, 2, 3, 4, 5, 6};
  static const int node_offset[7] = {0, 4, 8, 12, 16, 20, 24}, face_offset[4] = {0, 6, 12, 18}, open_offset[2] = {0, 5};
  const int        cells = r->three_cells ? 3 : 1;
  double           section;

  section = add_section(zone, "Faces", 22, 1, 6, 24, nodes);
  add_1d(section, "ElementStartOffset", "DataArray_t", "I4", 7, node_offset);
  section = add_section(zone, "Cells", 23, 7, 6 + cells, r->open_cell ? 5 : 6 * cells, faces);
  add_1d(section, "ElementStartOffset", "DataArray_t", "I4", cells + 1, r->open_cell ? open_offset : face_offset);
}

/* What a cell is by its place along x: 1 computed, -1 interpolated, 0 hole. */
static int kind_of(const recipe *r, bool is_second, int cell)
{
  const int i = cell % r->n;

  if (r->hole_column) return !is_second || i > 0;
  return i < 2 ? 1 : i == 2 ? -1 : 0;
}

static void add_solution(double zone, const recipe *r, bool is_second, const char *name, double value)
{
  const int    cells = r->n * r->n * r->n, row = r->n + 1;
  const int    count    = r->at_vertices ? row * row * row : cells;
  const double solution = add(zone, name, "FlowSolution_t", "MT", 0, NULL, NULL);
  double       x[MAX_NODES];
  int          flag[MAX_NODES];

  add_text(solution, "GridLocation", "GridLocation_t", r->at_vertices ? "Vertex" : "CellCenter");
  for (int i = 0; i < count; i++) x[i] = value + .1 * sin(3 * i), flag[i] = i % 2;
  for (int i = 0; i < count && r->masks; i++) x[i] = kind_of(r, is_second, i) ? value : 1e30;
  add_1d(solution, "Density", "DataArray_t", "R8", r->short_field ? count - 1 : count, x);
  for (int i = 0; i < count; i++) x[i] = r->nan_field && i == 2 ? NAN : cos(i);
  add_1d(solution, "MomentumX", "DataArray_t", "R8", count, x);
  for (int i = 0; i < count && r->linear; i++) {
    const double low = is_second ? r->second_zone : r->low, size = (r->high - r->low) / r->n;

    x[i] = 1 + low + size * (i % r->n + .5) + 2 * size * (i / r->n % r->n) - size * (i / r->n / r->n);
    x[i] += 2 * (r->low + .5 * size) - (r->low + .5 * size);
  }
  add_1d(solution, "Tracer", "DataArray_t", "R8", count, x);
  add_1d(solution, "cellN", "DataArray_t", "I4", count, flag);
}

/* A flow with velocity (1, 2, 3) and pressure 1, temperature 1 / density; the components in an order of their own. */
static void add_gas(double zone, const recipe *r)
{
  static const struct {
    const char *name;
    int         needs;
    double      value; /* 0: density; < 0: not uniform */
  } field[]             = {{"VelocityZ", GAS, 3},      {"Density", GAS_DENSITY, 0}, {"VelocityX", GAS, 1},
                           {"VelocityY", GAS, 2},      {"Pressure", GAS, 1},        {"Temperature", GAS, -1},
                           {"MassFractionA", GAS, -2}, {"MassFractionB", GAS, -3},  {"Tracer", GAS_LONE, 5}};
  const double solution = add(zone, "FlowSolution", "FlowSolution_t", "MT", 0, NULL, NULL);
  const int    n        = r->n * r->n * r->n;
  double       x[MAX_CELLS];

  add_text(solution, "GridLocation", "GridLocation_t", "CellCenter");
  for (size_t f = 0; f < sizeof field / sizeof *field; f++) {
    if (!(r->gas & field[f].needs) || ((r->gas & GAS_LONE) && field[f].value == 2)) continue;
    for (int c = 0; c < n; c++) {
      const double density = 1 + .9 * sin(5 * c), fraction = .5 + .5 * sin(7 * c);

      x[c] = field[f].value > 0     ? field[f].value
             : field[f].value == 0  ? density
             : field[f].value == -1 ? 1 / density
                                    : fraction;
      if (field[f].value == -3) x[c] = 1 - fraction;
      if (field[f].value == 0 && (r->gas & GAS_VACUUM) && c == 4) x[c] = 0;
    }
    add_1d(solution, field[f].name, "DataArray_t", "R8", n, x);
  }
}

static void add_gas_model(double base, const recipe *r)
{
  const double set   = add(base, "FlowEquationSet", "FlowEquationSet_t", "MT", 0, NULL, NULL);
  const double model = add_text(set, "GasModel", "GasModel_t", "CaloricallyPerfect");
  const double ratio = 1.5, constant = 2;

  if (r->gas & GAS_RATIO) add_1d(model, "SpecificHeatRatio", "DataArray_t", "R8", 1, &ratio);
  if (r->gas & GAS_CONSTANT)
    add_1d(add(base, "ReferenceState", "ReferenceState_t", "MT", 0, NULL, NULL), "IdealGasConstant", "DataArray_t", "R8", 1,
           &constant);
}

/* Masks by several conventions, some with real values, one that names no cell and one that is broken. */
static void add_masks(double zone, const recipe *r, bool is_second)
{
  const double node = add(zone, "Masks", "DiscreteData_t", "MT", 0, NULL, NULL);
  const int    n    = r->n * r->n * r->n;
  float        iblank[MAX_CELLS], broken[MAX_CELLS];
  double       cell_n[MAX_CELLS], volume[MAX_CELLS];
  int          chimera[MAX_CELLS], none[MAX_CELLS];

  for (int c = 0; c < n; c++) {
    const int kind = kind_of(r, is_second, c);

    iblank[c]  = (float)kind;
    cell_n[c]  = kind < 0 ? 2 : kind;
    chimera[c] = kind;
    none[c]    = 0;
    volume[c]  = (c == 3 ? 1.25 : 1) / (r->n * r->n * r->n); /* of the unit cube, but for one */
    broken[c]  = c == n - 1 ? NAN : 1;
  }
  add_text(node, "GridLocation", "GridLocation_t", "CellCenter");
  add_1d(node, "Iblank", "DataArray_t", "R4", n, iblank);
  add_1d(node, "cellN", "DataArray_t", "R8", n, cell_n);
  add_1d(node, "ChimeraCellType", "DataArray_t", "I4", n, chimera);
  add_1d(node, "Volume", "DataArray_t", "R8", n, volume);
  add_1d(node, "Nowhere", "DataArray_t", "I4", n, none);
  add_1d(node, "Broken", "DataArray_t", "R4", n, broken);
}

/* A boundary condition by its vertices. */
static void add_wall(double zone, const recipe *r, bool is_second)
{
  const double   list = add(zone, "ZoneBC", "ZoneBC_t", "MT", 0, NULL, NULL);
  const double   wall = add_text(list, is_second ? "Outlet" : "Inlet", "BC_t", is_second ? "BCOutflow" : "BCInflow");
  const int      row = r->n + 1, count = row * row;
  const cgsize_t dims[2] = {1, count};
  int            node[MAX_NODES];

  for (int i = 0; i < count; i++) node[i] = 1 + row * i + (is_second ? r->n : 0);
  add_text(wall, "GridLocation", "GridLocation_t", "Vertex");
  add(wall, "PointList", "IndexArray_t", "I4", 2, dims, node);
}

static void add_zone(double base, const recipe *r, bool is_second)
{
  const char    *name = is_second ? "Second" : "Zone";
  const double   low = is_second ? r->second_zone : r->low, high = low + r->high - r->low;
  const int      row = r->n + 1, count = row * row * row;
  const int      sizes[3] = {count, r->n * r->n * r->n, 0};
  const cgsize_t dims[2]  = {1, 3};
  const double   zone     = add(base, name, "Zone_t", "I4", 2, dims, sizes);

  add_text(zone, "ZoneType", "ZoneType_t", "Unstructured");
  if (!r->no_coordinates) add_coordinates(zone, r, low, high);
  if (r->is_surface)
    add_surface(zone);
  else if (r->is_ngon)
    add_polyhedron(zone, r);
  else
    add_hexahedra(zone, r);
  if (r->gas)
    add_gas(zone, r);
  else if (r->fields != 0)
    add_solution(zone, r, is_second, "FlowSolution", r->fields);
  if (r->second != 0) add_solution(zone, r, is_second, "Other", r->second);
  if (r->masks) add_masks(zone, r, is_second);
  if (r->walls) add_wall(zone, r, is_second);
}

static void write_file(const char *folder, const recipe *r)
{
  const float version      = 3.4F;
  const int   dimension[2] = {3, 3};
  char        path[4096];
  double      root, base;

  snprintf(path, sizeof path, "%s/%s.cgns", folder, r->name);
  must(cgio_open_file(path, CGIO_MODE_WRITE, CGIO_FILE_HDF5, &file), path);
  must(cgio_get_root_id(file, &root), path);
  add_1d(root, "CGNSLibraryVersion", "CGNSLibraryVersion_t", "R4", 1, &version);
  base = add_1d(root, "Base", "CGNSBase_t", "I4", 2, dimension);
  add_zone(base, r, false);
  if (r->second_zone != 0) add_zone(base, r, true);
  if (r->gas) add_gas_model(base, r);
  must(cgio_close_file(file), path);
}

int main(int argc, char **argv)
{
  if (argc != 2) {
    fputs("usage: make_files DIR\n", stderr);
    return 2;
  }
  for (size_t i = 0; i < sizeof recipes / sizeof *recipes; i++) write_file(argv[1], &recipes[i]);
  return 0;
}
