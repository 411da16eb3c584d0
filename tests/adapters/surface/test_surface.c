/* STL and OBJ files: what is read, what is repaired, what is refused and how it is named. */
#include "rt.h"
#include "surface.h"

#include <float.h>
#include <unistd.h>

static rsurf_message why;

/* ---- files ----------------------------------------------------------------------------------------------------------- */

static rsurf_status read_bytes(const char *ending, const void *bytes, size_t size, rsurf_surface *out)
{
  char         path[64];
  FILE        *file;
  rsurf_status status;

  snprintf(path, sizeof path, "surface_%ld%s", (long)getpid(), ending);
  file = fopen(path, "wb");
  if (!file || fwrite(bytes, 1, size, file) != size || fclose(file)) abort();
  *out   = (rsurf_surface){.num_nodes = 0};
  status = rsurf_read(path, 1.0, out, &why);
  remove(path);
  return status;
}
static rsurf_status read_text(const char *ending, const char *text, rsurf_surface *out)
{
  return read_bytes(ending, text, strlen(text), out);
}

/* Read and repair. */
static rsurf_status body(const char *text, rsurf_surface *out, rsurf_repairs *did)
{
  rsurf_status status = read_text(".obj", text, out);

  if (status == RSURF_OK) status = rsurf_repair(out, "s.obj", did, &why);
  return status;
}

/* The text is refused as geometry, and the message holds the words. */
static void refused(const char *text, const char *words)
{
  rsurf_surface s;
  rsurf_repairs did;

  RT_EQ(body(text, &s, &did), RSURF_GEOMETRY);
  if (!RT_CHECK(strstr(why.text, words))) printf("# %s\n", why.text);
  rsurf_drop(&s);
}

/* Six times the volume that the faces bound. */
static double six_volumes(const rsurf_surface *s)
{
  double sum = 0;

  for (int64_t f = 0; f < s->num_faces; f++)
    for (int64_t i = s->face_offset[f] + 1; i + 1 < s->face_offset[f + 1]; i++) {
      const double *a = s->node_xyz + 3 * s->face_node[s->face_offset[f]], *b = s->node_xyz + 3 * s->face_node[i],
                   *c = s->node_xyz + 3 * s->face_node[i + 1];

      sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
  return sum;
}

/* A tetrahedron with legs of that length at a corner, as OBJ text of its own vertices, appended; bit f of turn turns face f. */
static void put_tetrahedron(char *text, double x, double y, double z, double leg, int turn)
{
  static const int face[4][3] = {{1, 3, 2}, {1, 2, 4}, {2, 3, 4}, {1, 4, 3}};
  char            *at         = text + strlen(text);

  at += sprintf(at, "v %.17g %.17g %.17g\nv %.17g %.17g %.17g\n", x, y, z, x + leg, y, z);
  at += sprintf(at, "v %.17g %.17g %.17g\nv %.17g %.17g %.17g\n", x, y + leg, z, x, y, z + leg);
  for (int f = 0; f < 4; f++) {
    const int swap = turn >> f & 1;

    at += sprintf(at, "f %d %d %d\n", face[f][0] - 5, face[f][1 + swap] - 5, face[f][2 - swap] - 5);
  }
}

/* The unit cube of six quadrilaterals, all outward. */
static const char cube[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                           "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/* ---- STL ------------------------------------------------------------------------------------------------------------- */

/* A binary file of the tetrahedron with legs 0.1 in single precision, under a header that begins with "solid". */
static size_t binary_tetrahedron(char out[400], uint32_t count)
{
  static const float p[4][3]    = {{0, 0, 0}, {0.1f, 0, 0}, {0, 0.1f, 0}, {0, 0, 0.1f}};
  static const int   face[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

  memset(out, 0, 400);
  memcpy(out, "solid made by a program that writes binary", 42);
  memcpy(out + 80, &count, 4);
  for (int f = 0; f < 4; f++)
    for (int v = 0; v < 3; v++) memcpy(out + 84 + 50 * f + 12 + 12 * v, p[face[f][v]], 12);
  return 84 + 200;
}

static void binary_stl_is_known_by_its_length_and_read_exactly(void)
{
  char          bytes[400];
  rsurf_surface s;
  rsurf_repairs did;

  RT_EQ(read_bytes(".stl", bytes, binary_tetrahedron(bytes, 4), &s), RSURF_OK);
  RT_EQ(s.num_nodes, 4);
  RT_EQ(s.num_faces, 4);
  RT_EQ(s.num_groups, 1);
  RT_CHECK(!strncmp(s.group_name[0], "surface_", 8) && !strchr(s.group_name[0], '.'));
  RT_NEAR(s.node_xyz[3 * 2], (double)0.1f, 0.0);
  RT_EQ(rsurf_repair(&s, "s.stl", &did, &why), RSURF_OK);
  RT_NEAR(six_volumes(&s), (double)0.1f * (double)0.1f * (double)0.1f, 1e-20);
  rsurf_drop(&s);
}

static void binary_stl_with_a_wrong_count_is_refused(void)
{
  char          bytes[400];
  rsurf_surface s;

  binary_tetrahedron(bytes, 5);
  RT_EQ(read_bytes(".stl", bytes, 284, &s), RSURF_IO);
  RT_CHECK(strstr(why.text, "5 facets, which take 334 bytes, but it has 284"));
  binary_tetrahedron(bytes, 4);
  RT_EQ(read_bytes(".stl", bytes, 283, &s), RSURF_IO);
  binary_tetrahedron(bytes, UINT32_MAX);
  RT_EQ(read_bytes(".stl", bytes, 284, &s), RSURF_IO);
  RT_EQ(read_bytes(".stl", bytes + 6, 60, &s), RSURF_IO);
  RT_EQ(read_bytes(".stl", bytes, 0, &s), RSURF_IO);
  memset(bytes, 0, sizeof bytes);
  RT_EQ(read_bytes(".stl", bytes, 84, &s), RSURF_IO);
  RT_CHECK(strstr(why.text, "no faces"));
}

static void numbers_that_are_not_finite_are_refused_with_their_place(void)
{
  const float   nan_value = NAN;
  char          bytes[400];
  rsurf_surface s;

  binary_tetrahedron(bytes, 4);
  memcpy(bytes + 84 + 2 * 50 + 12, &nan_value, 4);
  RT_EQ(read_bytes(".stl", bytes, 284, &s), RSURF_IO);
  RT_CHECK(strstr(why.text, "facet 3"));
  RT_EQ(read_text(".obj", "v 0 0 0\nv 1 inf 0\n", &s), RSURF_IO);
  RT_CHECK(strstr(why.text, "line 2"));
  RT_EQ(read_text(".obj", "v 0 0 0\nv 1 1e999 0\n", &s), RSURF_IO);
}

static const char facet[] = "facet normal 0 0 nan\r\n outer loop\r\n  vertex 0 0 0\r\n  vertex 1 0 0\r\n  VERTEX 0 1e0 0\r\n"
                            " endloop\r\nendfacet\r\n";

static void text_stl_has_names_and_line_ends_of_any_kind(void)
{
  char          text[2000];
  rsurf_surface s;

  snprintf(text, sizeof text, "solid  left wing \r\n%sendsolid left wing\r\nsolid\r%sendsolid\rSOLID left wing\n%sendsolid\n",
           facet, facet, facet);
  RT_EQ(read_text(".STL", text, &s), RSURF_OK);
  RT_EQ(s.num_faces, 3);
  RT_EQ(s.num_nodes, 3);
  RT_EQ(s.num_groups, 2);
  RT_STR(s.group_name[0], "left wing");
  RT_EQ(s.face_group[1], 1);
  RT_EQ(s.face_group[2], 0);
  rsurf_drop(&s);
}

static void text_stl_that_stops_is_refused_wherever_it_stops(void)
{
  char          text[2000];
  size_t        size;
  rsurf_surface s;

  size = (size_t)snprintf(text, sizeof text, "solid a\n%sendsolid a\n", facet);
  for (size_t n = 6; n + 12 < size; n++) {
    RT_EQ(read_bytes(".stl", text, n, &s), RSURF_IO);
    rsurf_drop(&s);
  }
  RT_CHECK(strstr(why.text, "line 8") && strstr(why.text, "truncated"));
  strcpy(text + size, "more\n");
  RT_EQ(read_text(".stl", text, &s), RSURF_IO);
  RT_CHECK(strstr(why.text, "line 10"));
}

/* ---- OBJ ------------------------------------------------------------------------------------------------------------- */

static void obj_corners_come_in_every_form(void)
{
  rsurf_surface s;

  RT_EQ(read_text(".obj",
                  "# a comment\r\nmtllib x.mtl\r\no thing\r\nv 0 0 0 1.0\r\nv 1 0 0\r\nv 0 1 0 # and another\r\nvt 0 0\r\n"
                  "vn 0 0 1\r\nf 1/1/1 2/1/1 3/1/1\r\ng  two words \r\nf 1//1 2//1 3//1\r\nusemtl m\r\ns off\r\nf -3 -2 \\\r\n"
                  " -1/1\r\nv 0 0 0\r\nf 4 2 3",
                  &s),
        RSURF_OK);
  RT_EQ(s.num_faces, 4);
  RT_EQ(s.num_nodes, 3);
  for (int64_t f = 0; f < 4; f++)
    for (int64_t i = 0; i < 3; i++) RT_EQ(s.face_node[3 * f + i], i);
  RT_EQ(s.num_groups, 2);
  RT_STR(s.group_name[0], "thing");
  RT_STR(s.group_name[1], "two words");
  RT_EQ(s.face_group[3], 1);
  rsurf_drop(&s);
}

static void obj_that_is_damaged_is_refused_with_its_line(void)
{
  static const struct {
    const char *text, *words;
  } bad[] = {
      {"v 0 0\n", "line 1: a vertex needs three numbers"},
      {"v 0 0 zero\n", "line 1: a vertex"},
      {"v 0 0 0\nf 1 1\n", "line 2: a face has 2 corners"},
      {"v 0 0 0\n\nf 1 1 2\n", "line 3: a face has vertex 2, but there are 1"},
      {"v 0 0 0\nf 1 1 -2\n", "vertex -2"},
      {"v 0 0 0\nf 1 1 0\n", "vertex 0"},
      {"v 0 0 0\nf 1 1 99999999999999999999\n", "there are 1"},
      {"v 0 0 0\nf 1 1 x\n", "'x' is no corner"},
      {"v 0 0 0\nf 1 1 1.5\n", "no corner"},
      {"v 0 0 0\n", "no faces"},
      {"a letter\n", "no faces"},
  };
  rsurf_surface s;

  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    RT_EQ(read_text(".obj", bad[i].text, &s), RSURF_IO);
    if (!RT_CHECK(strstr(why.text, bad[i].words))) printf("# %s\n", why.text);
  }
  RT_EQ(read_bytes(".obj", "v 0 0 0\0v", 9, &s), RSURF_IO);
  RT_EQ(rsurf_read("no_such_file.obj", 1, &s, &why), RSURF_IO);
  RT_EQ(rsurf_read(".", 1, &s, &why), RSURF_IO);
}

/* ---- repair ---------------------------------------------------------------------------------------------------------- */

static void faces_are_turned_to_agree_and_point_out(void)
{
  for (int turn = 0; turn < 16; turn++) {
    char          text[1000] = "";
    rsurf_surface s;
    rsurf_repairs did;

    put_tetrahedron(text, 5, 6, 7, 2, turn);
    RT_EQ(body(text, &s, &did), RSURF_OK);
    RT_NEAR(six_volumes(&s), 8, 1e-13);
    RT_EQ(did.faces_turned, __builtin_popcount((unsigned)turn));
    RT_EQ(did.shells, 1);
    RT_EQ(s.num_bodies, 1);
    rsurf_drop(&s);
  }
}

static void a_shell_in_a_shell_is_a_void_and_one_in_the_void_a_body(void)
{
  char          text[4000] = "";
  rsurf_surface s;
  rsurf_repairs did;
  remap_mesh    mesh;

  put_tetrahedron(text, 2, 2, 2, 1, 0);
  put_tetrahedron(text, 0, 0, 0, 20, 5);
  put_tetrahedron(text, 1, 1, 1, 8, 0);
  put_tetrahedron(text, 30, 1, 1, 2, 15);
  RT_EQ(body(text, &s, &did), RSURF_OK);
  RT_EQ(did.shells, 4);
  RT_EQ(did.voids, 1);
  RT_EQ(s.num_bodies, 3);
  RT_NEAR(six_volumes(&s), 8000 - 512 + 1 + 8, 1e-9);
  RT_EQ(s.face_body[0], 0);
  RT_EQ(s.face_body[4], s.face_body[8]);
  mesh = rsurf_mesh(&s, "s");
  RT_EQ(mesh.num_cells, 3);
  RT_EQ(mesh.face_neighbour[15], -1);
  rsurf_drop(&s);
}

static void shells_may_share_a_corner(void)
{
  char          text[2000] = "";
  rsurf_surface s;
  rsurf_repairs did;

  put_tetrahedron(text, 0, 0, 0, 1, 0);
  put_tetrahedron(text, 0, 0, 0, -1, 0);
  RT_EQ(body(text, &s, &did), RSURF_OK);
  RT_EQ(s.num_nodes, 7);
  RT_EQ(s.num_bodies, 2);
  RT_NEAR(six_volumes(&s), 2, 1e-14);
  rsurf_drop(&s);
}

static void flat_convex_polygons_stay_and_others_are_cut(void)
{
  char          text[1000];
  rsurf_surface s;
  rsurf_repairs did;

  RT_EQ(body(cube, &s, &did), RSURF_OK);
  RT_EQ(s.num_faces, 6);
  RT_EQ(did.faces_cut, 0);
  rsurf_drop(&s);
  snprintf(text, sizeof text, "%s", cube);
  memcpy(strstr(text, "v 1 1 1"), "v 2 1 1", 7); /* three faces meet there: one is bent, two only change their shape */
  RT_EQ(body(text, &s, &did), RSURF_OK);
  RT_EQ(did.faces_cut, 1);
  RT_EQ(s.num_faces, 7);
  rsurf_drop(&s);
  /* a prism over an arrow: two concave polygons, one corner on an edge */
  RT_EQ(body("v 0 0 0\nv 4 4 0\nv 0 1 0\nv -4 4 0\nv 0 0 1\nv 4 4 1\nv 0 1 1\nv -4 4 1\n"
             "f 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n",
             &s, &did),
        RSURF_OK);
  RT_EQ(did.faces_cut, 2);
  RT_EQ(s.num_faces, 8);
  RT_NEAR(six_volumes(&s), 6 * 4, 1e-13);
  rsurf_drop(&s);
}

static void faces_that_collapse_are_dropped(void)
{
  char          text[1000] = "";
  rsurf_surface s;
  rsurf_repairs did;

  put_tetrahedron(text, 0, 0, 0, 1, 0);
  strcat(text, "v 0 0 0\nf 1 2 2\nf 1 5 3\n");
  RT_EQ(body(text, &s, &did), RSURF_OK);
  RT_EQ(did.faces_dropped, 2);
  RT_EQ(s.num_faces, 4);
  rsurf_drop(&s);
}

static void a_triangle_on_a_line_lends_its_corner_to_the_neighbour(void)
{
  rsurf_surface s;
  rsurf_repairs did;

  /* a tetrahedron, one edge of which has a node in the middle on one side only; the cap comes in every rotation and way */
  for (int i = 0; i < 6; i++) {
    static const char *const cap[6] = {"f 1 2 3", "f 2 3 1", "f 3 1 2", "f 3 2 1", "f 2 1 3", "f 1 3 2"};
    char                     text[300];

    snprintf(text, sizeof text,
             "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 0 0 1\ng cap\n%s\ng body\nf 1 2 4\nf 2 3 4\nf 1 4 5\nf 4 3 5\n"
             "f 3 1 5\n",
             cap[i]);
    RT_EQ(body(text, &s, &did), RSURF_OK);
    RT_EQ(did.faces_flipped, 1);
    RT_EQ(s.num_faces, 6);
    RT_EQ(s.face_group[0], 1);
    RT_NEAR(six_volumes(&s), 2, 1e-15);
    rsurf_drop(&s);
  }
  /* two nodes on that edge: the caps form a fan, of which only one at a time can be flipped */
  RT_EQ(body("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 4\nf 2 3 4\nf 2 1 5\nf 3 2 5\nf 4 3 5\nf 1 6 5\nf 4 "
             "5 6\n"
             "f 1 4 6\n",
             &s, &did),
        RSURF_OK);
  RT_EQ(did.faces_flipped, 2);
  RT_NEAR(six_volumes(&s), 3, 1e-14);
  rsurf_drop(&s);
}

/* ---- refused --------------------------------------------------------------------------------------------------------- */

static void open_surfaces_are_refused_with_their_edges(void)
{
  char text[1000];

  snprintf(text, sizeof text, "%s", cube);
  *strstr(text, "f 4 1 5 8") = 0;
  refused(text, "4 edges have one face only: (0 0 0)-(0 1 0)");
}

static void edges_of_many_faces_are_refused_with_their_place(void)
{
  char text[2000] = "";

  put_tetrahedron(text, 0, 0, 0, 1, 0);
  strcat(text, "v 1 1 1\nv 0 0 -1\nf 1 2 5\nf 1 5 6\nf 2 1 6\nf 5 2 6\n");
  refused(text, "1 edges have more than two faces, so that it bounds no body: (0 0 0)-(1 0 0)");
  snprintf(text, sizeof text, "%sf 1 2 3 4\n", cube);
  refused(text, "4 edges have more than two faces");
}

static void a_surface_with_one_side_is_refused(void)
{
  /* a torus of 3 x 3 quadrilaterals glued with a twist: a bottle of Klein, in which every edge has two faces */
  char text[4000] = "", *at = text;

  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) at += sprintf(at, "v %d %d %d\n", i, k, i * k + k * k);
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) {
      const int a = 3 * i + k, b = 3 * i + (k + 1) % 3;
      const int c = i < 2 ? b + 3 : (3 - (k + 1)) % 3, d = i < 2 ? a + 3 : (3 - k) % 3;

      at += sprintf(at, "f %d %d %d\nf %d %d %d\n", a + 1, b + 1, c + 1, a + 1, c + 1, d + 1);
    }
  refused(text, "one side only");
}

static void surfaces_that_cross_themselves_are_refused_with_the_triangles(void)
{
  char text[2000] = "";

  put_tetrahedron(text, 0, 0, 0, 4, 0);
  put_tetrahedron(text, 1, 1, 1, 4, 0);
  refused(text, "crosses itself");
  refused(text, "(4 0 0)");
}

static void touching_is_crossing_and_an_ulp_is_a_gap(void)
{
  const double  third      = 1.0 / 3.0;
  char          text[4000] = "";
  rsurf_surface s;
  rsurf_repairs did;

  put_tetrahedron(text, 0, 0, 0, 1, 0);
  put_tetrahedron(text, 0.25, 0.25, 0, -1, 0); /* its corner lies in a face of the first */
  refused(text, "crosses itself");
  text[0] = 0;
  put_tetrahedron(text, 0, 0, 0, 1, 0);
  put_tetrahedron(text, 0.25, 0.25, -DBL_MIN, -1, 0);
  RT_EQ(body(text, &s, &did), RSURF_GEOMETRY); /* counts as 0 beside 1 */
  rsurf_drop(&s);
  text[0] = 0;
  put_tetrahedron(text, third, third, third, 1, 0);
  put_tetrahedron(text, third + 0.25, third + 0.25, nextafter(third, 0), -1, 0);
  RT_EQ(body(text, &s, &did), RSURF_OK);
  rsurf_drop(&s);
}

static void two_bodies_may_not_overlap_in_a_plane(void)
{
  char text[4000] = "";

  put_tetrahedron(text, 0, 0, 0, 1, 0);
  put_tetrahedron(text, 0.125, 0.125, 0, -0.5, 0); /* faces in one plane that overlap, bodies on either side */
  refused(text, "crosses itself");
}

static void shells_and_faces_without_size_are_refused(void)
{
  refused("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n", "crosses itself");
  refused(
      "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 0 0 1\nv 2 0 1\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 1 4 5\nf 4 3 6\nf 4 6 5\nf 3 1 5 6\n",
      "(0 0 0)(1 0 0)(2 0 0) has no area"); /* the neighbour is no triangle */
  refused("v 0 0 0\nv 1 0 0\nv 0 0 0\nf 1 2 3\n", "points or lines");
  refused("v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 4\n", "crosses itself");
  refused("v 0 0 0\nv 1 0 0\nv 1 0 5e-324\nv 0 0 5e-324\nf 1 2 3 4\n", "has no area"); /* too thin for doubles */
  refused("v 0 0 0\nv 1 2 3\nv 2 4 6\nv 3 6 9\nf 1 2 3 4\n", "has no area");
  refused("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4 5 3\n", "corner twice");
}

/* ---- writing --------------------------------------------------------------------------------------------------------- */

/* A surface of one group as a file. */
static void print_surface(FILE *out, int is_stl, const rsurf_surface *s)
{
  for (int64_t i = 0; i < s->num_nodes && !is_stl; i++) rsurf_print_node(out, s->node_xyz + 3 * i);
  rsurf_print_head(out, is_stl, s->group_name[0]);
  for (int64_t f = 0; f < s->num_faces; f++) {
    const int64_t *node      = s->face_node + s->face_offset[f];
    const double  *corner[3] = {s->node_xyz + 3 * node[0], s->node_xyz + 3 * node[1], s->node_xyz + 3 * node[2]};

    if (is_stl) rsurf_print_facet(out, corner);
    else rsurf_print_polygon(out, s->face_offset[f + 1] - s->face_offset[f], node);
  }
  rsurf_print_foot(out, is_stl, s->group_name[0]);
}

static void what_is_written_is_read_back_bit_by_bit(void)
{
  static const char *const path[2]    = {"surface_written.stl", "surface_written.obj"};
  char                     text[1000] = "g a b\n";
  rsurf_surface            s, back;
  rsurf_repairs            did;

  put_tetrahedron(text, 1.0 / 3.0, 1e-17, 3e11, 7.7, 0);
  RT_EQ(body(text, &s, &did), RSURF_OK);
  for (int i = 0; i < 2; i++) {
    FILE *out = fopen(path[i], "w");

    RT_EQ(rsurf_is_stl(path[i]), i == 0);
    print_surface(out, i == 0, &s);
    fclose(out);
    RT_EQ(rsurf_read(path[i], 1, &back, &why), RSURF_OK);
    RT_EQ(back.num_faces, 4);
    RT_STR(back.group_name[0], "a b");
    for (int64_t k = 0; k < 12; k++)
      RT_CHECK(!memcmp(back.node_xyz + 3 * back.face_node[k], s.node_xyz + 3 * s.face_node[k], 3 * sizeof(double)));
    rsurf_drop(&back);
    remove(path[i]);
  }
  rsurf_drop(&s);
  RT_CHECK(!rsurf_is_stl("x.ply") && !rsurf_is_stl("l") && rsurf_is_stl("X.STL"));
}

RT_MAIN(RT_CASE(binary_stl_is_known_by_its_length_and_read_exactly), RT_CASE(binary_stl_with_a_wrong_count_is_refused),
        RT_CASE(numbers_that_are_not_finite_are_refused_with_their_place),
        RT_CASE(text_stl_has_names_and_line_ends_of_any_kind), RT_CASE(text_stl_that_stops_is_refused_wherever_it_stops),
        RT_CASE(obj_corners_come_in_every_form), RT_CASE(obj_that_is_damaged_is_refused_with_its_line),
        RT_CASE(faces_are_turned_to_agree_and_point_out), RT_CASE(a_shell_in_a_shell_is_a_void_and_one_in_the_void_a_body),
        RT_CASE(shells_may_share_a_corner), RT_CASE(flat_convex_polygons_stay_and_others_are_cut),
        RT_CASE(faces_that_collapse_are_dropped), RT_CASE(a_triangle_on_a_line_lends_its_corner_to_the_neighbour),
        RT_CASE(open_surfaces_are_refused_with_their_edges), RT_CASE(edges_of_many_faces_are_refused_with_their_place),
        RT_CASE(a_surface_with_one_side_is_refused), RT_CASE(surfaces_that_cross_themselves_are_refused_with_the_triangles),
        RT_CASE(touching_is_crossing_and_an_ulp_is_a_gap), RT_CASE(two_bodies_may_not_overlap_in_a_plane),
        RT_CASE(shells_and_faces_without_size_are_refused), RT_CASE(what_is_written_is_read_back_bit_by_bit))
