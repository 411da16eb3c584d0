/* Planar faces as facets: which faces are, what is traced of them, and that what comes of it is what the oracle finds. */
#include "oracle.h"

/* Triangles of facets of several, and edges that no facet ends at. */
static rm_lid num_whole(const rm_trimesh *m)
{
  rm_lid n = 0;
  for (rm_lid t = 0; t < m->num_triangles; t++) n += rm_facet_next(m, t) != t;
  return n;
}
static rm_lid num_inside(const rm_trimesh *m)
{
  rm_lid n = 0;
  for (rm_lid e = 0; e < m->num_edges; e++) n += rm_is_inside_facets(m, e);
  return n;
}

/* Both ways round, both triangulations: as the oracle has it; of the first mesh, so many triangles are in facets of several. */
static void agrees(tm_mesh *a, tm_mesh *b, rm_lid whole)
{
  for (int way = 0; way < 4; way++) {
    const int side = way & 1;
    laid     *l = laid_over(side ? b : a, side ? a : b, way & 2 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, NULL);

    if (RT_EQ(l->status, REMAP_OK)) {
      RT_EQ(num_whole(l->mesh[side]), whole);
      oracle_check(l, ORACLE_EXACT);
    }
    laid_free(l);
  }
  tm_free(a);
  tm_free(b);
}

static tm_mesh *cubes(int x, int y, int z, bool turned)
{
  return tm_hexahedra((int[]){x, y, z}, tm_cube, &(tm_cubing){{x, y, z}, turned});
}

/* Two cells in a row, each a prism along x, over a polygon in the plane x = 0; what lies between them is one face. */
static tm_mesh *two_prisms(int n, const double (*polygon)[2])
{
  tm_mesh *mesh = tm_column(n, 2);

  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    double   *x  = mesh->xyz + 3 * v;
    const int at = (int)lrint(x[0]);

    x[0] = 64 * x[1] - 64;
    x[1] = polygon[at][0];
    x[2] = polygon[at][1];
  }
  return mesh;
}
#define PRISMS(polygon) two_prisms((int)(sizeof(polygon) / sizeof *(polygon)), polygon)

static void edges_inside_planar_faces_are_not_traced(void)
{
  for (int way = 0; way < 2; way++) {
    tm_mesh *a = cubes(3, 2, 4, true), *b = cubes(4, 3, 3, false);
    laid    *l = laid_over(a, b, way ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, NULL);

    if (RT_EQ(l->status, REMAP_OK))
      for (int side = 0; side < 2; side++) {
        const rm_trimesh *m     = l->mesh[side];
        const rm_lid      inner = side ? 3 * 3 * 3 + 4 * 2 * 3 + 4 * 3 * 2 : 2 * 2 * 4 + 3 * 1 * 4 + 3 * 2 * 3;

        RT_EQ(num_whole(m), 2 * inner);
        RT_EQ(num_inside(m), inner);
        for (rm_lid e = 0; e < m->num_edges; e++)
          RT_CHECK(!rm_is_inside_facets(m, e) || l->overlay->trace[side].count[e] == 0);
        for (rm_lid t = 0; t < m->num_triangles && side == 0; t++)
          RT_CHECK(rm_facet_of(m, t) / 2 == t || l->overlay->end_offset[t] == l->overlay->end_offset[t + 1]);
      }
    laid_free(l);
    tm_free(a);
    tm_free(b);
  }
}

static void turned_boxes_agree(void) { agrees(cubes(2, 2, 2, true), cubes(3, 2, 2, false), 2 * 12); }
static void boxes_on_the_same_planes_agree(void)
{
  agrees(cubes(2, 2, 2, true), cubes(2, 2, 2, true), 2 * 12);
  agrees(cubes(2, 2, 2, false), cubes(4, 2, 2, false), 2 * 12);
  agrees(cubes(2, 2, 2, false), cubes(3, 1, 2, false), 2 * 12);
}
static void skins_are_no_facets(void) { agrees(cubes(1, 1, 1, true), cubes(2, 1, 1, false), 0); }

/* One of the eight boxes is cut in eight: the faces between small ones have four corners, those on large ones up to eight. */
static void planar_faces_with_hanging_nodes_agree(void)
{
  tm_mesh *a = tm_refined((int[]){2, 1, 1}, tm_right_half, tm_cube, &(tm_cubing){{2, 1, 1}, true});
  laid    *l = laid_over(a, a, REMAP_FACES_CENTRE, NULL);
  const rm_lid whole = l->status == REMAP_OK ? num_whole(l->mesh[0]) : 0;

  RT_CHECK(whole >= 2 * (12 + 4));
  laid_free(l);
  agrees(a, cubes(2, 2, 1, false), whole);
}

static void a_planar_face_that_is_not_convex_is_cut(void)
{
  static const double ell[][2]   = {{-64, -64}, {64, -64}, {64, 0}, {0, 0}, {0, 64}, {-64, 64}};
  static const double arrow[][2] = {{-64, -64}, {0, -32}, {64, -64}, {0, 64}};

  agrees(PRISMS(ell), cubes(1, 1, 1, true), 0);
  agrees(PRISMS(arrow), cubes(1, 1, 1, true), 0);
}

static void a_planar_face_with_straight_angles_is_one_facet(void)
{
  static const double square[][2] = {{-64, -64}, {0, -64}, {32, -64}, {64, -64}, {64, 64}, {16, 64}, {-64, 64}};
  static const double kite[][2]   = {{-64, 0}, {0, -64}, {64, 0}, {0, 64}, {-32, 32}};
  static const double wedge[][2]  = {{-64, -64}, {64, -64}, {0, 0}, {-64, 64}};

  agrees(PRISMS(square), cubes(1, 1, 1, true), 5);
  agrees(PRISMS(kite), cubes(1, 1, 1, true), 3);
  agrees(PRISMS(wedge), cubes(1, 1, 1, true), 2);
  agrees(PRISMS(square), PRISMS(kite), 5);
}

/* A face that is warped by the last bit of one coordinate is cut, or has a centre. */
static void a_face_off_by_one_ulp_is_no_facet(void)
{
  static const double square[][2] = {{-64, -64}, {64, -64}, {64, 64}, {-64, 64}};
  tm_mesh            *mesh        = PRISMS(square);

  for (int64_t v = 0; v < mesh->view.num_nodes; v++)
    if (mesh->xyz[3 * v] == 0 && mesh->xyz[3 * v + 1] > 0 && mesh->xyz[3 * v + 2] > 0) mesh->xyz[3 * v] = 0x1p-46;
  agrees(mesh, cubes(1, 1, 1, true), 0);
}

/* Where quadrangles of one zone are patched to pairs of triangles of the other, cut alike, their triangles are joined: no skin
 * passes through a cell there. One way of shearing makes the other zone's diagonal the shorter one. */
static void quadrangles_are_joined_with_pairs_of_triangles(void)
{
  int num_covered = 0;

  for (int way = 0; way < 4; way++) {
    const double shear = way & 1 ? .25 : -.25, m[12] = {1, shear, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    tm_mesh     *boxes = tm_hexahedra((int[]){2, 1, 1}, NULL, NULL), *prisms = tm_prisms((int[]){2, 1, 1}, NULL, NULL), *third;
    laid        *l;

    tm_move(prisms, tm_affine, (double[]){1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1});
    boxes = tm_join(boxes, prisms);
    tm_move(boxes, tm_affine, m);
    third = cubes(1, 1, 1, true);
    tm_move(third, tm_affine, (double[]){0x1p-11, 0, 0, .5, 0, 0x1p-11, 0, .5, 0, 0, 0x1p-11, 1});
    l = laid_over(boxes, third, way & 2 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, NULL);
    if (RT_EQ(l->status, REMAP_OK) && laid_cover(l, 1, 0) == REMAP_COVERED) {
      oracle_check(l, ORACLE_EXACT);
      num_covered++;
    }
    laid_free(l);
    tm_free(boxes);
    tm_free(third);
  }
  RT_EQ(num_covered, 2);
}

RT_MAIN(RT_CASE(edges_inside_planar_faces_are_not_traced), RT_CASE(turned_boxes_agree), RT_CASE(boxes_on_the_same_planes_agree),
        RT_CASE(skins_are_no_facets), RT_CASE(planar_faces_with_hanging_nodes_agree),
        RT_CASE(a_planar_face_that_is_not_convex_is_cut), RT_CASE(a_planar_face_with_straight_angles_is_one_facet),
        RT_CASE(a_face_off_by_one_ulp_is_no_facet), RT_CASE(quadrangles_are_joined_with_pairs_of_triangles))
