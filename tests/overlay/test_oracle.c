/* Overlays of small meshes against brute force in exact rationals: the degenerate positions of two meshes that fail
 * elsewhere. */
#include "oracle.h"
#include "spaced.h"

static const sp_axis two = {2, {0, 60, 120}}, three = {3, {0, 40, 80, 120}}, four = {4, {0, 30, 60, 90, 120}};
static const sp_axis wide = {3, {0, 60, 120, 180}}, one_wide = {1, {0, 180}}, shifted = {2, {30, 90, 150}};
static const sp_axis beside = {2, {120, 180, 240}}, corner = {1, {120, 180}}, flat = {3, {0, 60, 60, 120}};

static void identical_boxes_agree(void) { oracle_agrees(sp_boxes(&two, &two, &two, NULL), sp_boxes(&two, &two, &two, NULL)); }
static void identical_warped_boxes_agree(void)
{
  oracle_agrees(sp_boxes(&two, &two, &two, sp_warp), sp_boxes(&two, &two, &two, sp_warp));
}
static void children_in_their_parents_agree(void)
{
  oracle_agrees(sp_boxes(&two, &two, &two, NULL), sp_boxes(&four, &four, &four, NULL));
}
static void a_box_around_all_agrees(void)
{
  oracle_agrees(sp_boxes(&wide, &wide, &wide, NULL), sp_boxes(&one_wide, &one_wide, &one_wide, NULL));
}
static void two_against_three_agree(void)
{
  oracle_agrees(sp_boxes(&two, &two, &two, NULL), sp_boxes(&three, &three, &three, NULL));
}
static void boxes_shifted_by_half_agree(void)
{
  oracle_agrees(sp_boxes(&two, &two, &two, NULL), sp_boxes(&shifted, &shifted, &shifted, NULL));
}
static void boxes_that_abut_agree(void)
{
  oracle_agrees(sp_boxes(&two, &two, &two, NULL), sp_boxes(&beside, &two, &two, NULL));
}
static void boxes_that_touch_in_a_vertex_agree(void)
{
  oracle_agrees(sp_boxes(&two, &two, &two, NULL), sp_boxes(&corner, &corner, &corner, NULL));
}
static void warped_boxes_on_straight_ones_agree(void)
{
  oracle_agrees(sp_boxes(&two, &two, &two, sp_warp), sp_boxes(&two, &two, &two, NULL));
}
static void a_singular_axis_agrees(void)
{
  oracle_agrees(sp_boxes(&two, &two, &two, sp_to_axis), sp_boxes(&two, &two, &two, sp_widen));
}
static void a_layer_without_thickness_agrees(void)
{
  oracle_agrees(sp_boxes(&flat, &two, &two, NULL), sp_boxes(&two, &two, &two, NULL));
}
static void two_layers_without_thickness_agree(void)
{
  oracle_agrees(sp_boxes(&flat, &flat, &two, NULL), sp_boxes(&flat, &flat, &two, NULL));
}

RT_MAIN(RT_CASE(identical_boxes_agree), RT_CASE(identical_warped_boxes_agree), RT_CASE(children_in_their_parents_agree),
        RT_CASE(a_box_around_all_agrees), RT_CASE(two_against_three_agree), RT_CASE(boxes_shifted_by_half_agree),
        RT_CASE(boxes_that_abut_agree), RT_CASE(boxes_that_touch_in_a_vertex_agree),
        RT_CASE(warped_boxes_on_straight_ones_agree), RT_CASE(a_singular_axis_agrees),
        RT_CASE(a_layer_without_thickness_agrees), RT_CASE(two_layers_without_thickness_agree))
