/* Cells that are not convex, skins that are left and entered again, meshes inside one cell of the other, thin gaps: against the
 * oracle in exact rationals, both triangulations, both ways round. */
#include "oracle.h"

typedef struct point2 {
  double x, y;
} point2;

/* Cells one on top of the other, prisms along z over a polygon, counter-clockwise, with `layers` layers of equal height. */
static tm_mesh *prism(int n, const point2 *polygon, double bottom, double top, int layers)
{
  tm_mesh *mesh = tm_column(n, layers);

  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    double *x = mesh->xyz + 3 * v;

    x[2] = bottom + (top - bottom) * x[1] / layers;
    x[1] = polygon[lrint(x[0])].y;
    x[0] = polygon[lrint(x[0])].x;
  }
  return mesh;
}

static tm_mesh *box_grid(int nx, int ny, int nz, const double low[3], const double high[3])
{
  return tm_hexahedra(
      (int[]){nx, ny, nz}, tm_affine,
      (double[]){high[0] - low[0], 0, 0, low[0], 0, high[1] - low[1], 0, low[1], 0, 0, high[2] - low[2], low[2]});
}

static const point2 ell[]  = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
static const point2 you[]  = {{0, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}};
static const point2 comb[] = {{0, 0}, {9, 0}, {9, 4}, {8, 4}, {8, 1}, {7, 1}, {7, 4}, {6, 4}, {6, 1}, {5, 1},
                              {5, 4}, {4, 4}, {4, 1}, {3, 1}, {3, 4}, {2, 4}, {2, 1}, {1, 1}, {1, 4}, {0, 4}};
static const point2 star[] = {{4, 0}, {1, 1}, {0, 4}, {-1, 1}, {-4, 0}, {-1, -1}, {0, -4}, {1, -1}};

#define PRISM(shape, ...) prism((int)(sizeof(shape) / sizeof *(shape)), shape, __VA_ARGS__)

static void turn(double xyz[3], const void *data)
{
  const double x = xyz[0], y = xyz[1], z = xyz[2];

  (void)data;
  xyz[0] = y, xyz[1] = z, xyz[2] = x;
}

/* A shear and a tilt with few bits, so that nothing is parallel to an axis. */
static void tilt(double xyz[3], const void *data)
{
  const double x = xyz[0], y = xyz[1], z = xyz[2];

  (void)data;
  xyz[0] = x + .25 * y - .125 * z;
  xyz[1] = y - .375 * x + .25 * z + .0625;
  xyz[2] = z + .125 * x + .0625 * y - .25;
}

static tm_mesh *moved(tm_mesh *mesh, tm_map map)
{
  tm_move(mesh, map, NULL);
  return mesh;
}

static void an_l_on_aligned_boxes_agrees(void)
{
  oracle_agrees(PRISM(ell, 0, 1, 1), box_grid(4, 4, 2, (double[]){0, 0, 0}, (double[]){2, 2, 1}));
  oracle_agrees(PRISM(ell, 0, 1, 2), box_grid(3, 2, 1, (double[]){-.5, 0, 0}, (double[]){2.5, 2, 1}));
}
static void a_skin_in_the_plane_of_a_notch_cuts_the_cell_behind_it(void)
{
  oracle_agrees(PRISM(ell, 0, 1, 1), box_grid(1, 1, 1, (double[]){0, 0, 0}, (double[]){1, 2, 1}));
  oracle_agrees(PRISM(ell, 0, 1, 1), box_grid(1, 2, 1, (double[]){0, 0, 0}, (double[]){1, 2, 1}));
  oracle_agrees(PRISM(ell, 0, 1, 1), box_grid(2, 1, 1, (double[]){1, 0, 0}, (double[]){3, 3, 1}));
  oracle_agrees(PRISM(you, 0, 1, 1), box_grid(1, 1, 1, (double[]){0, 1, 0}, (double[]){3, 3, 1}));
  oracle_agrees(PRISM(you, 0, 1, 1), box_grid(1, 1, 1, (double[]){-1, -1, 0}, (double[]){4, 1, 1}));
}
static void two_ls_that_fill_a_square_share_nothing(void)
{
  tm_mesh *l = PRISM(ell, 0, 1, 1), *other = box_grid(1, 1, 1, (double[]){1, 1, 0}, (double[]){2, 2, 1});

  oracle_agrees(l, other);
}
static void tilted_ls_agree(void) { oracle_agrees(PRISM(ell, 0, 1, 2), moved(PRISM(ell, 0, 1, 2), tilt)); }
static void a_u_is_left_and_entered_again(void)
{
  oracle_agrees(PRISM(you, 0, 1, 1), box_grid(1, 3, 1, (double[]){-1, .5, .25}, (double[]){4, 2.5, .75}));
  oracle_agrees(PRISM(you, 0, 1, 2), moved(box_grid(1, 2, 2, (double[]){-1, .5, .25}, (double[]){4, 2.5, .75}), tilt));
}
static void edges_run_through_all_teeth_of_a_comb(void)
{
  oracle_agrees(PRISM(comb, 0, 1, 1), box_grid(1, 2, 1, (double[]){-1, 1, .25}, (double[]){10, 3, .75}));
  oracle_agrees(PRISM(comb, 0, 2, 1), moved(PRISM(comb, 0, 2, 1), turn));
}
static void interlocking_combs_agree(void)
{
  tm_mesh *b = PRISM(comb, 0, 1, 1);

  tm_move(b, tm_affine, (double[]){-1, 0, 0, 10, 0, -1, 0, 5, 0, 0, 1, 0}); /* turned about z: teeth into the gaps */
  oracle_agrees(PRISM(comb, 0, 1, 1), b);
}
static void a_star_on_boxes_agrees(void)
{
  oracle_agrees(PRISM(star, -1, 1, 2), box_grid(4, 4, 1, (double[]){-4, -4, -1}, (double[]){4, 4, 1}));
  oracle_agrees(PRISM(star, -1, 1, 1), moved(PRISM(star, -1, 1, 1), tilt));
}
static void components_that_do_not_touch_agree(void)
{
  oracle_agrees(tm_join(box_grid(2, 1, 1, (double[]){0, 0, 0}, (double[]){1, 1, 1}),
                        box_grid(1, 2, 1, (double[]){2, 0, 0}, (double[]){3, 1, 1})),
                tm_join(box_grid(1, 1, 2, (double[]){.5, .25, 0}, (double[]){2.5, .75, 1}),
                        box_grid(1, 1, 1, (double[]){8, 0, 0}, (double[]){9, 1, 1})));
}
static void components_that_touch_in_an_edge_or_a_vertex_agree(void)
{
  oracle_agrees(tm_join(box_grid(1, 1, 1, (double[]){0, 0, 0}, (double[]){1, 1, 1}),
                        box_grid(1, 1, 1, (double[]){1, 1, 0}, (double[]){2, 2, 1})),
                box_grid(2, 2, 1, (double[]){.5, .5, .25}, (double[]){1.5, 1.5, .75}));
  oracle_agrees(tm_join(box_grid(1, 1, 1, (double[]){0, 0, 0}, (double[]){1, 1, 1}),
                        box_grid(1, 1, 1, (double[]){1, 1, 1}, (double[]){2, 2, 2})),
                moved(box_grid(1, 1, 1, (double[]){.5, .5, .5}, (double[]){1.5, 1.5, 1.5}), tilt));
}
static void a_mesh_inside_one_cell_agrees(void)
{
  oracle_agrees(box_grid(1, 1, 1, (double[]){-8, -8, -8}, (double[]){8, 8, 8}),
                box_grid(2, 2, 2, (double[]){1, 1, 1}, (double[]){2, 2, 2}));
  oracle_agrees(box_grid(2, 1, 1, (double[]){-8, -8, -8}, (double[]){24, 8, 8}),
                tm_join(PRISM(you, 0, 1, 1), box_grid(1, 1, 1, (double[]){4, 4, 4}, (double[]){5, 5, 5})));
}
static void a_cell_with_a_void_holds_what_it_holds(void)
{
  /* a hollow cell: the outer box and, turned inside out, the inner one */
  tm_mesh *hollow = tm_join(box_grid(1, 1, 1, (double[]){0, 0, 0}, (double[]){4, 4, 4}),
                            box_grid(1, 1, 1, (double[]){1, 1, 1}, (double[]){3, 3, 3}));

  for (int64_t f = 0; f < hollow->view.num_faces; f++) {
    int64_t *loop = hollow->face_node + hollow->face_offset[f], swap = loop[1];

    if (hollow->owner[f] == 0) continue;
    hollow->owner[f] = 0;
    loop[1]          = loop[3];
    loop[3]          = swap;
  }
  hollow->view.num_cells = 1;
  oracle_agrees(hollow, box_grid(3, 3, 2, (double[]){-1, 0, .5}, (double[]){5, 4.5, 3.5}));
}
static void gaps_much_thinner_than_cells_agree(void)
{
  const double gap = 0x1p-30;

  oracle_agrees(tm_join(box_grid(1, 2, 1, (double[]){0, 0, 0}, (double[]){1, 1, 1}),
                        box_grid(1, 2, 1, (double[]){1 + gap, 0, 0}, (double[]){2, 1, 1})),
                box_grid(1, 1, 2, (double[]){0, 0, 0}, (double[]){2, 1, 1}));
  oracle_agrees(tm_join(box_grid(1, 2, 1, (double[]){0, 0, 0}, (double[]){1, 1, 1}),
                        box_grid(1, 2, 1, (double[]){1 + gap, 0, 0}, (double[]){2, 1, 1})),
                moved(box_grid(1, 2, 2, (double[]){.5, 0, 0}, (double[]){1.5, 1, 1}), tilt));
}
static void slivers_much_thinner_than_cells_agree(void)
{
  for (int bits = 10; bits <= 50; bits += 20)
    oracle_agrees(box_grid(1, 2, 1, (double[]){0, 0, 0}, (double[]){1, 1, 1}),
                  box_grid(1, 1, 1, (double[]){1 - ldexp(1, -bits), .25, .25}, (double[]){2, .75, .75}));
}
static void a_corner_that_pokes_through_a_face_makes_a_pair(void)
{
  static const int place[4] = {-10, -20, -30, -45};

  for (int k = 0; k < 4; k++) { /* a tetrahedron whose tip enters the box by so little */
    const double deep = ldexp(1, place[k]);
    tm_mesh     *tet  = tm_tetrahedra((int[]){1, 1, 1}, NULL, NULL);

    tm_move(tet, tilt, NULL);
    double low = INFINITY;
    for (int64_t v = 0; v < tet->view.num_nodes; v++) low = fmin(low, tet->xyz[3 * v]);
    for (int64_t v = 0; v < tet->view.num_nodes; v++) tet->xyz[3 * v] += 1 - low - deep;
    oracle_agrees(tet, box_grid(1, 1, 1, (double[]){0, -2, -2}, (double[]){1, 2, 2}));
  }
}

/* The mean of the five vertices of the upper face is one of them. */
static void a_face_whose_mean_is_one_of_its_vertices_agrees(void)
{
  static const point2 house[] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}, {0, 0}};
  tm_mesh            *mesh    = PRISM(house, 0, 2, 1);

  for (int64_t v = 0; v < mesh->view.num_nodes; v++)
    if (mesh->xyz[3 * v + 2] > 1) mesh->xyz[3 * v + 2] += .25 * mesh->xyz[3 * v] * mesh->xyz[3 * v + 1];
  oracle_agrees(mesh, box_grid(2, 2, 2, (double[]){-1, -1, 0}, (double[]){1, 1, 2}));
}

RT_MAIN(RT_CASE(an_l_on_aligned_boxes_agrees), RT_CASE(a_skin_in_the_plane_of_a_notch_cuts_the_cell_behind_it),
        RT_CASE(two_ls_that_fill_a_square_share_nothing), RT_CASE(tilted_ls_agree), RT_CASE(a_u_is_left_and_entered_again),
        RT_CASE(edges_run_through_all_teeth_of_a_comb), RT_CASE(interlocking_combs_agree), RT_CASE(a_star_on_boxes_agrees),
        RT_CASE(components_that_do_not_touch_agree), RT_CASE(components_that_touch_in_an_edge_or_a_vertex_agree),
        RT_CASE(a_mesh_inside_one_cell_agrees), RT_CASE(a_cell_with_a_void_holds_what_it_holds),
        RT_CASE(gaps_much_thinner_than_cells_agree), RT_CASE(slivers_much_thinner_than_cells_agree),
        RT_CASE(a_corner_that_pokes_through_a_face_makes_a_pair), RT_CASE(a_face_whose_mean_is_one_of_its_vertices_agrees))
