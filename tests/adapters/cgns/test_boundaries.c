/* Boundary conditions: which faces they name, by ranges and lists of indices, elements and vertices, on any number of ranks;
 * what cannot be read is noted and left out. */
#include "files.h"

#include "../slices/blocks.h"

static rcgns_message why;

/* A condition below a ZoneBC_t. place: PointRange or the like, dim its shape, slowest first. */
static int64_t put_bc(cf_file *f, int64_t parent, const char *name, const char *type, const char *place, int nd,
                      const int64_t *dim, const int64_t *number, const char *location)
{
  const int64_t at = cf_text(f, parent, name, "BC_t", type);

  cf_put(f, at, place, strstr(place, "Range") ? "IndexRange_t" : "IndexArray_t", "I4", nd, dim, 'I', number);
  if (location) cf_text(f, at, "GridLocation", "GridLocation_t", location);
  return at;
}

/* How many faces, of which total area, has the boundary of that name and type? -1: there is none. Collective. */
static int64_t faces_of(const rcgns_file *file, const rcgns_boundaries *b, const char *name, const char *type, double *area)
{
  const remap_mesh *m   = rcgns_mesh(file);
  int64_t           num = 0;
  int               i   = 0;

  *area = 0;
  while (i < b->num && (strcmp(b->name[i], name) || strcmp(b->type[i], type))) i++;
  if (i == b->num) return -1;
  for (int64_t f = 0; f < m->num_faces; f++) {
    const int64_t *node = m->face_node + m->face_offset[f];
    const double  *p = m->node_xyz + 3 * node[0], *q = m->node_xyz + 3 * node[1], *r = m->node_xyz + 3 * node[2];
    double         cross = 0;

    if (b->face[f] != i) continue;
    num++;
    for (int d = 0; d < 3; d++) {
      const int    x = (d + 1) % 3, y = (d + 2) % 3;
      const double c = (q[x] - p[x]) * (r[y] - p[y]) - (q[y] - p[y]) * (r[x] - p[x]);

      cross += c * c;
    }
    *area += sqrt(cross) * (m->face_offset[f + 1] - m->face_offset[f] == 3 ? .5 : 1);
  }
  *area = cf_sum(*area);
  return cf_count(num);
}

static void blocks_name_faces_by_ranges(void)
{
  cf_file      *f     = cf_new(3.4);
  const int64_t base  = cf_base(f);
  const int64_t block = cf_zone(f, base, "Block", 3, (int64_t[]){3, 4, 5, 2, 3, 4, 0, 0, 0}), two_by_three[2] = {2, 3};
  const int64_t list = cf_empty(f, block, "ZoneBC", "ZoneBC_t"), family = cf_empty(f, base, "Slip", "Family_t");
  double        xyz[180], area;
  char          path[64];
  rcgns_file   *file;

  for (int i = 0; i < 60; i++) xyz[3 * i] = i % 3, xyz[3 * i + 1] = i / 3 % 4, xyz[3 * i + 2] = i / 12;
  cf_coordinates(f, block, xyz, 3, (int64_t[]){5, 4, 3});
  cf_text(f, family, "FamilyBC", "FamilyBC_t", "BCWallInviscid");
  put_bc(f, list, "low", "BCWall", "PointRange", 2, two_by_three, (int64_t[]){1, 1, 1, 1, 4, 5}, NULL);
  put_bc(f, list, "patch", "BCInflow", "PointRange", 2, two_by_three, (int64_t[]){3, 4, 5, 1, 2, 5}, "Vertex");
  put_bc(f, list, "faces", "BCOutflow", "PointRange", 2, two_by_three, (int64_t[]){3, 1, 2, 3, 2, 4}, "IFaceCenter");
  put_bc(f, list, "again", "BCOutflow", "PointRange", 2, two_by_three, (int64_t[]){3, 1, 1, 3, 4, 5}, NULL);
  put_bc(f, list, "edge", "BCWall", "PointRange", 2, two_by_three, (int64_t[]){1, 1, 1, 1, 1, 5}, NULL);
  put_bc(f, list, "inside", "BCWall", "PointRange", 2, two_by_three, (int64_t[]){2, 1, 1, 2, 4, 5}, NULL);
  put_bc(f, list, "odd", "Nonsense", "PointList", 2, (int64_t[]){1, 3}, (int64_t[]){1, 1, 1}, "FaceCenter");
  cf_text(f, put_bc(f, list, "slip", "FamilySpecified", "PointRange", 2, two_by_three, (int64_t[]){1, 1, 1, 3, 1, 5}, NULL),
          "FamilyName", "FamilyName_t", "Slip");
  cf_write(f, cf_path(path, "bc_block"));
  file = cf_open(path, NULL);
  if (file) {
    rcgns_boundaries b;

    RT_EQ(rcgns_read_boundaries(file, &b, &why), RCGNS_OK);
    RT_EQ(faces_of(file, &b, "low", "BCWall", &area), 12);
    RT_NEAR(area, 12, 1e-13);
    RT_EQ(faces_of(file, &b, "patch", "BCInflow", &area), 4);
    RT_EQ(faces_of(file, &b, "faces", "BCOutflow", &area), 6);
    RT_EQ(faces_of(file, &b, "again", "BCOutflow", &area), 6);
    RT_EQ(faces_of(file, &b, "edge", "BCWall", &area), 0);
    RT_EQ(faces_of(file, &b, "inside", "BCWall", &area), 0);
    RT_EQ(faces_of(file, &b, "slip", "BCWallInviscid", &area), 8);
    RT_EQ(faces_of(file, &b, "odd", "UserDefined", &area), 0);
    RT_CHECK(cf_has_note(file, "odd"));
    RT_EQ(rcgns_read_boundaries(file, &b, &why), RCGNS_OK);
    RT_EQ(b.num, 8);
  }
  rcgns_close(&file);
  cf_remove(path);
}

static void blocks_name_faces_by_lists(void)
{
  const int64_t square[18] = {1, 2, 1, 1, 1, 1, 2, 2, 2, 1, 1, 2, 1, 2, 2, 3, 4, 5}, below[6] = {1, 1, 1, 2, 3, 1};
  const int64_t front[9] = {1, 1, 2, 2, 1, 2, 1, 1, 3}, far[3] = {1, 2, 5}, strip[6] = {1, 1, 1, 1, 2, 1};
  const int64_t edge[12] = {3, 4, 5, 3, 3, 5, 3, 4, 4, 2, 3, 4}, wild[12] = {0, 1, 1, 4, 1, 1, 1, 1, -3, 1, INT32_MAX, 1};
  cf_file      *f     = cf_new(3.4);
  const int64_t block = cf_zone(f, cf_base(f), "Block", 3, (int64_t[]){3, 4, 5, 2, 3, 4, 0, 0, 0});
  const int64_t list  = cf_empty(f, block, "ZoneBC", "ZoneBC_t");
  double        xyz[180], area;
  char          path[64];
  rcgns_file   *file;

  for (int i = 0; i < 60; i++) xyz[3 * i] = i % 3, xyz[3 * i + 1] = i / 3 % 4, xyz[3 * i + 2] = i / 12;
  cf_coordinates(f, block, xyz, 3, (int64_t[]){5, 4, 3});
  put_bc(f, list, "square", "BCWall", "PointList", 2, (int64_t[]){6, 3}, square, NULL);
  put_bc(f, list, "below", "BCWall", "PointList", 2, (int64_t[]){2, 3}, below, "KFaceCenter");
  put_bc(f, list, "inside", "BCWall", "PointList", 2, (int64_t[]){2, 3}, below, "JFaceCenter");
  put_bc(f, list, "edge", "BCWall", "PointList", 2, (int64_t[]){4, 3}, edge, "Vertex");
  put_bc(f, list, "front", "BCInflow", "PointList", 2, (int64_t[]){3, 3}, front, "FaceCenter");
  put_bc(f, list, "far", "BCInflow", "PointList", 2, (int64_t[]){1, 3}, far, "FaceCenter");
  put_bc(f, list, "strip", "BCInflow", "PointList", 2, (int64_t[]){2, 3}, strip, "FaceCenter");
  cf_ints(f, put_bc(f, list, "told", "BCInflow", "PointList", 2, (int64_t[]){2, 3}, strip, "FaceCenter"), "InwardNormalIndex",
          "\"int[IndexDimension]\"", 3, (int64_t[]){0, 0, 1});
  put_bc(f, list, "deep", "BCInflow", "PointList", 2, (int64_t[]){1, 3}, (int64_t[]){2, 2, 2}, "FaceCenter");
  put_bc(f, list, "wild", "BCWall", "PointList", 2, (int64_t[]){4, 3}, wild, "Vertex");
  put_bc(f, list, "wilder", "BCWall", "PointList", 2, (int64_t[]){4, 3}, wild, "IFaceCenter");
  cf_write(f, cf_path(path, "bc_points"));
  file = cf_open(path, NULL);
  if (file) {
    rcgns_boundaries b;

    RT_EQ(rcgns_read_boundaries(file, &b, &why), RCGNS_OK);
    RT_EQ(faces_of(file, &b, "square", "BCWall", &area), 1);
    RT_EQ(faces_of(file, &b, "below", "BCWall", &area), 2);
    RT_EQ(faces_of(file, &b, "inside", "BCWall", &area), 1);
    RT_EQ(faces_of(file, &b, "edge", "BCWall", &area), 0);
    RT_EQ(faces_of(file, &b, "wild", "BCWall", &area), 0);
    RT_EQ(faces_of(file, &b, "wilder", "BCWall", &area), 0);
    RT_EQ(faces_of(file, &b, "front", "BCInflow", &area), 3);
    RT_EQ(faces_of(file, &b, "far", "BCInflow", &area), 1);
    RT_EQ(faces_of(file, &b, "strip", "BCInflow", &area), 0); /* of the side across i or across k */
    RT_EQ(faces_of(file, &b, "told", "BCInflow", &area), 1);  /* the first of them is "below" */
    RT_EQ(faces_of(file, &b, "deep", "BCInflow", &area), 0);
    for (int i = 0; i < b.num; i++)
      RT_CHECK(cf_has_note(file, b.name[i]) == (!strcmp(b.name[i], "strip") || !strcmp(b.name[i], "deep")));
  }
  rcgns_close(&file);
  cf_remove(path);
}

/* A quadrangle and a triangle of a MIXED section begin with these codes. */
static void check_lists(double version, int64_t quadrangle, int64_t triangle)
{
  const int64_t mixed[9] = {quadrangle, 2, 3, 9, 8, triangle, 8, 9, 14}, one[2] = {1, 1}, bottom[4] = {1, 2, 5, 4};
  cf_file      *f    = cf_new(version);
  const int64_t base = cf_base(f), zone = cf_zoo_zone(f, base, "Zoo"), list = cf_empty(f, zone, "ZoneBC", "ZoneBC_t");
  double        area;
  char          path[64];
  rcgns_file   *file;

  cf_section(f, zone, "Hexa", 17, 1, 1, 8, CF_ZOO_HEXA);
  cf_section(f, zone, "Penta", 14, 2, 3, 12, CF_ZOO_PENTA);
  cf_section(f, zone, "Pyra", 12, 4, 4, 5, CF_ZOO_PYRA);
  cf_section(f, zone, "Tetra", 10, 5, 5, 4, CF_ZOO_TETRA);
  cf_section(f, zone, "Quad", 7, 6, 6, 4, CF_ZOO_QUAD);
  cf_section(f, zone, "Mixed", 20, 7, 8, 9, mixed);
  put_bc(f, list, "front", "BCWall", "PointList", 2, one, (int64_t[]){6}, "FaceCenter");
  put_bc(f, list, "right", "BCInflow", "ElementRange", 2, (int64_t[]){2, 1}, (int64_t[]){7, 8}, NULL);
  put_bc(f, list, "below", "BCWall", "PointList", 2, (int64_t[]){4, 1}, bottom, NULL);
  put_bc(f, list, "none", "BCWall", "PointList", 2, one, (int64_t[]){99}, "FaceCenter");
  cf_write(f, cf_path(path, "bc_zoo"));
  file = cf_open(path, NULL);
  if (file) {
    rcgns_boundaries b;

    RT_EQ(rcgns_read_boundaries(file, &b, &why), RCGNS_OK);
    RT_EQ(faces_of(file, &b, "front", "BCWall", &area), 1);
    RT_EQ(faces_of(file, &b, "right", "BCInflow", &area), 2);
    RT_EQ(faces_of(file, &b, "below", "BCWall", &area), 1);
    RT_NEAR(area, 1, 1e-13);
    RT_EQ(faces_of(file, &b, "none", "BCWall", &area), 0);
  }
  rcgns_close(&file);
  cf_remove(path);
}

static void elements_are_named_by_lists_of_faces_and_vertices(void)
{
  check_lists(3.4, 7, 5);
  check_lists(3.1, 22 + 4, 22 + 3); /* polygons, as old files may have them */
}

static void polyhedra_are_named_by_lists_of_faces(void)
{
  static const char *const name[6] = {"left", "right", "front", "back", "a very long name with _ in it, 4", "top"};
  bl_blocks               *blocks  = bl_new((int[]){3, 2, 4}, rt_rank(), rt_size());
  double                   area;
  char                     path[64];
  rcgns_file              *file;

  RT_EQ(rcgns_write_supermesh(MPI_COMM_WORLD, cf_path(path, "bc_poly"), 3.4, &blocks->content, &why), RCGNS_OK);
  file = cf_open(path, NULL);
  if (file) {
    rcgns_boundaries b;

    RT_EQ(rcgns_read_boundaries(file, &b, &why), RCGNS_OK);
    RT_EQ(b.num, 6);
    for (int i = 0; i < 6; i++) RT_EQ(faces_of(file, &b, name[i], "UserDefined", &area), i < 2 ? 8 : i < 4 ? 12 : 6);
  }
  rcgns_close(&file);
  cf_remove(path);
  bl_free(blocks);
}

static void polyhedra_are_named_by_vertices(void)
{
  /* two cubes side by side; node 1 + x + 3 y + 6 z */
  static const int64_t node[44] = {1, 7,  10, 4, 2, 5, 11, 8, 3, 6, 12, 9, 1, 2, 8,  7,  2, 3, 9,  8,  4,  10,
                                   11, 5, 5, 11, 12, 6, 1, 4, 5, 2, 2, 5, 6, 3,  7,  8, 11, 10, 8,  9,  12, 11};
  static const int64_t cell[12] = {1, 2, 4, 6, 8, 10, -2, 3, 5, 7, 9, 11}, cut[3] = {0, 6, 12};
  cf_file             *f        = cf_new(4.2);
  const int64_t        zone     = cf_zone(f, cf_base(f), "Pair", 1, (int64_t[]){12, 2, 0});
  const int64_t        list     = cf_empty(f, zone, "ZoneBC", "ZoneBC_t");
  int64_t              at[12];
  double               xyz[36], area;
  char                 path[64];
  rcgns_file          *file;

  for (int i = 0; i < 12; i++) at[i] = 4 * i, xyz[3 * i] = i % 3, xyz[3 * i + 1] = i / 3 % 2, xyz[3 * i + 2] = i / 6;
  cf_coordinates(f, zone, xyz, 1, (int64_t[]){12});
  cf_offsets(f, cf_section(f, zone, "Faces", 22, 1, 11, 44, node), 12, at);
  cf_offsets(f, cf_section(f, zone, "Cells", 23, 12, 13, 12, cell), 3, cut);
  put_bc(f, list, "front", "BCWall", "PointList", 2, (int64_t[]){6, 1}, (int64_t[]){9, 8, 7, 1, 2, 3}, "Vertex");
  put_bc(f, list, "row", "BCWall", "PointList", 2, (int64_t[]){3, 1}, (int64_t[]){4, 5, 6}, NULL);
  put_bc(f, list, "below", "BCInflow", "PointRange", 2, (int64_t[]){2, 1}, (int64_t[]){1, 6}, NULL);
  put_bc(f, list, "joint", "BCWall", "PointList", 2, (int64_t[]){4, 1}, (int64_t[]){2, 5, 11, 8}, NULL);
  cf_write(f, cf_path(path, "bc_pair"));
  file = cf_open(path, NULL);
  if (file) {
    rcgns_boundaries b;

    RT_EQ(rcgns_read_boundaries(file, &b, &why), RCGNS_OK);
    RT_EQ(faces_of(file, &b, "front", "BCWall", &area), 2);
    RT_NEAR(area, 2, 1e-14);
    RT_EQ(faces_of(file, &b, "row", "BCWall", &area), 0);
    RT_EQ(faces_of(file, &b, "below", "BCInflow", &area), 2);
    RT_EQ(faces_of(file, &b, "joint", "BCWall", &area), 0);
    RT_CHECK(!cf_has_note(file, "left out"));
  }
  rcgns_close(&file);
  cf_remove(path);
}

RT_MAIN(RT_CASE(blocks_name_faces_by_ranges), RT_CASE(blocks_name_faces_by_lists),
        RT_CASE(elements_are_named_by_lists_of_faces_and_vertices), RT_CASE(polyhedra_are_named_by_lists_of_faces),
        RT_CASE(polyhedra_are_named_by_vertices))
