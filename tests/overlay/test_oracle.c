/* Overlays of small meshes against brute force in exact rationals: the degenerate positions of two meshes that fail
 * elsewhere. */
#include "oracle.h"

typedef struct spacing {
  int    n;
  double x[6];
} spacing;

/* The lattice [0, 1]^3 to given coordinates. */
typedef struct placing {
  const spacing *axis[3];
  tm_map         then;
} placing;

static void place(double xyz[3], const void *data)
{
  const placing *p = data;

  for (int c = 0; c < 3; c++) xyz[c] = p->axis[c]->x[lrint(xyz[c] * p->axis[c]->n)];
  if (p->then) p->then(xyz, NULL);
}

static tm_mesh *boxes(const spacing *x, const spacing *y, const spacing *z, tm_map then)
{
  return tm_hexahedra((int[]){x->n, y->n, z->n}, place, &(placing){{x, y, z}, then});
}

/* Whole numbers that move every node by up to 6 in a way of its own. */
static void warp(double xyz[3], const void *data)
{
  const long x = lrint(xyz[0]), y = lrint(xyz[1]), z = lrint(xyz[2]);

  (void)data;
  xyz[0] += (double)((7 * y + 3 * z) % 11 - 5);
  xyz[1] += (double)((5 * x + 2 * z) % 7 - 3);
  xyz[2] += (double)((3 * x + 5 * y) % 13 - 6);
}

/* Draw the plane z = 0 together: one layer of cells ends in a point. */
static void to_axis(double xyz[3], const void *data)
{
  (void)data;
  xyz[0] *= xyz[2];
  xyz[1] *= xyz[2];
}
static void widen(double xyz[3], const void *data)
{
  (void)data;
  xyz[0] *= 40;
  xyz[1] *= 40;
}

static const spacing two = {2, {0, 60, 120}}, three = {3, {0, 40, 80, 120}}, four = {4, {0, 30, 60, 90, 120}};
static const spacing wide = {3, {0, 60, 120, 180}}, one_wide = {1, {0, 180}}, shifted = {2, {30, 90, 150}};
static const spacing beside = {2, {120, 180, 240}}, corner = {1, {120, 180}}, flat = {3, {0, 60, 60, 120}};

/* Both triangulations, both ways round; the meshes are given up. */
static void agrees(tm_mesh *a, tm_mesh *b)
{
  for (int way = 0; way < 4; way++) {
    laid *l = laid_over(way & 1 ? b : a, way & 1 ? a : b, way & 2 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, NULL);

    if (RT_EQ(l->status, REMAP_OK)) oracle_check(l, ORACLE_EXACT);
    laid_free(l);
  }
  tm_free(a);
  tm_free(b);
}

static void identical_boxes_agree(void) { agrees(boxes(&two, &two, &two, NULL), boxes(&two, &two, &two, NULL)); }
static void identical_warped_boxes_agree(void) { agrees(boxes(&two, &two, &two, warp), boxes(&two, &two, &two, warp)); }
static void children_in_their_parents_agree(void) { agrees(boxes(&two, &two, &two, NULL), boxes(&four, &four, &four, NULL)); }
static void a_box_around_all_agrees(void)
{
  agrees(boxes(&wide, &wide, &wide, NULL), boxes(&one_wide, &one_wide, &one_wide, NULL));
}
static void two_against_three_agree(void) { agrees(boxes(&two, &two, &two, NULL), boxes(&three, &three, &three, NULL)); }
static void boxes_shifted_by_half_agree(void)
{
  agrees(boxes(&two, &two, &two, NULL), boxes(&shifted, &shifted, &shifted, NULL));
}
static void boxes_that_abut_agree(void) { agrees(boxes(&two, &two, &two, NULL), boxes(&beside, &two, &two, NULL)); }
static void boxes_that_touch_in_a_vertex_agree(void)
{
  agrees(boxes(&two, &two, &two, NULL), boxes(&corner, &corner, &corner, NULL));
}
static void warped_boxes_on_straight_ones_agree(void) { agrees(boxes(&two, &two, &two, warp), boxes(&two, &two, &two, NULL)); }
static void a_singular_axis_agrees(void) { agrees(boxes(&two, &two, &two, to_axis), boxes(&two, &two, &two, widen)); }
static void a_layer_without_thickness_agrees(void) { agrees(boxes(&flat, &two, &two, NULL), boxes(&two, &two, &two, NULL)); }
static void two_layers_without_thickness_agree(void)
{
  agrees(boxes(&flat, &flat, &two, NULL), boxes(&flat, &flat, &two, NULL));
}

RT_MAIN(RT_CASE(identical_boxes_agree), RT_CASE(identical_warped_boxes_agree), RT_CASE(children_in_their_parents_agree),
        RT_CASE(a_box_around_all_agrees), RT_CASE(two_against_three_agree), RT_CASE(boxes_shifted_by_half_agree),
        RT_CASE(boxes_that_abut_agree), RT_CASE(boxes_that_touch_in_a_vertex_agree),
        RT_CASE(warped_boxes_on_straight_ones_agree), RT_CASE(a_singular_axis_agrees),
        RT_CASE(a_layer_without_thickness_agrees), RT_CASE(two_layers_without_thickness_agree))
