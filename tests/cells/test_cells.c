/* The supermesh of small meshes: closed cells, volumes against the moments, faces against the faces they came from,
 * conformity. */
#include <time.h>
#include "spaced.h"
#include "super.h"

/* Both triangulations, both ways round; the meshes are given up. */
static void agrees(tm_mesh *a, tm_mesh *b, int odd_cells)
{
  for (int way = 0; way < 4; way++) {
    super s =
        super_of(way & 1 ? b : a, way & 1 ? a : b, way & 2 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, NULL, SUPER_UNION);

    super_check(&s, odd_cells, odd_cells >= 0);
    laid_free(s.l);
  }
  tm_free(a);
  tm_free(b);
}

/* ---- boxes ------------------------------------------------------------------------------------------------------- */

static const sp_axis one = {1, {0, 120}}, two = {2, {0, 60, 120}}, three = {3, {0, 40, 80, 120}},
                     four = {4, {0, 30, 60, 90, 120}};
static const sp_axis wide = {3, {0, 60, 120, 180}}, one_wide = {1, {0, 180}}, shifted = {2, {30, 90, 150}};
static const sp_axis beside = {2, {120, 180, 240}}, corner = {1, {120, 180}}, flat = {3, {0, 60, 60, 120}};
static const sp_axis inner = {1, {40, 80}}, inner_two = {2, {40, 50, 80}}, around = {2, {-10, 70, 130}};

static void identical_boxes(void) { agrees(sp_boxes(&two, &two, &two, NULL), sp_boxes(&two, &two, &two, NULL), 0); }
static void identical_warped_boxes(void)
{
  agrees(sp_boxes(&two, &two, &two, sp_warp), sp_boxes(&two, &two, &two, sp_warp), 0);
}
static void children_in_their_parents(void)
{
  agrees(sp_boxes(&two, &two, &two, NULL), sp_boxes(&four, &four, &four, NULL), 0);
}
static void a_box_around_all(void)
{
  agrees(sp_boxes(&wide, &wide, &wide, NULL), sp_boxes(&one_wide, &one_wide, &one_wide, NULL), 0);
}
static void two_against_three(void) { agrees(sp_boxes(&two, &two, &two, NULL), sp_boxes(&three, &three, &three, NULL), 0); }
static void boxes_shifted_by_half(void)
{
  agrees(sp_boxes(&two, &two, &two, NULL), sp_boxes(&shifted, &shifted, &shifted, NULL), 0);
}
static void boxes_that_abut(void) { agrees(sp_boxes(&two, &two, &two, NULL), sp_boxes(&beside, &two, &two, NULL), 0); }
static void boxes_that_abut_askew(void)
{
  agrees(sp_boxes(&two, &two, &two, NULL), sp_boxes(&beside, &shifted, &three, NULL), 0);
}
static void boxes_that_touch_in_a_vertex(void)
{
  agrees(sp_boxes(&two, &two, &two, NULL), sp_boxes(&corner, &corner, &corner, NULL), 0);
}
static void warped_boxes_on_straight_ones(void)
{
  agrees(sp_boxes(&two, &two, &two, sp_warp), sp_boxes(&two, &two, &two, NULL), -1);
}
static void a_singular_axis(void) { agrees(sp_boxes(&two, &two, &two, sp_to_axis), sp_boxes(&two, &two, &two, sp_widen), -1); }
static void a_layer_without_thickness(void) { agrees(sp_boxes(&flat, &two, &two, NULL), sp_boxes(&two, &two, &two, NULL), 0); }
static void two_layers_without_thickness(void)
{
  agrees(sp_boxes(&flat, &flat, &two, NULL), sp_boxes(&flat, &flat, &two, NULL), 0);
}
static void a_box_within_a_box(void)
{
  agrees(sp_boxes(&one, &one, &one, NULL), sp_boxes(&inner_two, &inner, &inner, NULL), 1);
}
static void a_box_through_a_face(void) { agrees(sp_boxes(&one, &one, &one, NULL), sp_boxes(&inner, &inner, &around, NULL), 1); }
static void a_box_on_a_face_from_inside(void)
{
  agrees(sp_boxes(&one, &one, &one, NULL), sp_boxes(&inner_two, &inner, &two, NULL), 1);
}
static void a_box_on_a_face_from_outside(void)
{
  agrees(sp_boxes(&one, &one, &one, NULL), sp_boxes(&inner_two, &inner, &beside, NULL), 0);
}

/* ---- meshes in general position ---------------------------------------------------------------------------------- */

static void benchmark_meshes(void) { agrees(tm_benchmark(3, 0.7, 0.3, 0.4), tm_benchmark(4, 0.1, 0, 1), -1); }
static void moved_tetrahedra_on_prisms(void)
{
  const tm_warping w = {0.03, 0.7};
  agrees(tm_tetrahedra((int[]){3, 3, 2}, tm_warp, &w), tm_prisms((int[]){2, 3, 3}, NULL, NULL), -1);
}
static void dual_on_hexahedra(void)
{
  const tm_warping w = {0.02, 0.3};
  agrees(tm_dual((int[]){2, 2, 2}, tm_warp, &w), tm_hexahedra((int[]){3, 3, 3}, NULL, NULL), -1);
}
static void refined_on_mixed(void)
{
  const tm_warping w = {0.03, 0.7};
  agrees(tm_refined((int[]){2, 2, 2}, tm_checkered, NULL, NULL), tm_mixed((int[]){3, 3, 3}, tm_warp, &w), -1);
}

static void move(double xyz[3], const void *data)
{
  for (int c = 0; c < 3; c++) xyz[c] += *(const double *)data;
}

/* Vertices are rounded there, volumes are not computed from them. */
static void volumes_hold_far_from_the_origin(void)
{
  for (double by = 1e3; by < 1e10; by *= 1e3) {
    tm_mesh *a = tm_benchmark(4, 0.7, 0.3, 0.6), *b = tm_benchmark(3, 0.1, 0, 1);

    tm_move(a, move, &by);
    tm_move(b, move, &by);
    super s = super_of(a, b, REMAP_FACES_CENTRE, NULL, SUPER_UNION);
    if (RT_EQ(s.status, REMAP_OK)) {
      RT_EQ(rm_cells_check(s.cells), REMAP_OK);
      super_check_volumes(&s);
    }
    laid_free(s.l);
    tm_free(a);
    tm_free(b);
  }
}

/* ---- booleans ---------------------------------------------------------------------------------------------------- */

static const int every_keep[] = {REMAP_IN_BOTH, REMAP_IN_SOURCE, REMAP_IN_TARGET, SUPER_WHOLE_SOURCE, SUPER_UNION};

typedef struct amount {
  rm_lid cells;
  double volume, given[2]; /* given: of the operands */
} amount;

static amount amount_of(const tm_mesh *a, const tm_mesh *b, int keep)
{
  super  s   = super_of(a, b, REMAP_FACES_CENTRE, NULL, keep);
  amount got = {-1, NAN, {0, 0}};

  if (RT_EQ(s.status, REMAP_OK)) {
    RT_EQ(rm_cells_check(s.cells), REMAP_OK);
    got.cells  = s.cells->num_cells;
    got.volume = 0;
    for (rm_lid c = 0; c < s.cells->num_cells; c++) got.volume += s.cells->cell_volume[c];
    for (int side = 0; side < 2; side++)
      for (rm_lid c = 0; c < s.l->part.piece[side].num_cells; c++) got.given[side] += s.l->part.piece[side].cell_volume[c];
  }
  laid_free(s.l);
  return got;
}

/* Each of the five by itself: what is in both, what is in one, one with the other's cuts in it, the union. */
static void operations_add_up(void)
{
  const tm_warping w          = {0.03, 0.7};
  tm_mesh         *pair[3][2] = {{tm_benchmark(4, 0.7, 0.3, 0.8), tm_benchmark(3, 0.1, 0, 1)},
                                 {sp_boxes(&two, &three, &two, NULL), sp_boxes(&shifted, &two, &four, NULL)},
                                 {tm_tetrahedra((int[]){3, 2, 2}, tm_warp, &w), tm_hexahedra((int[]){2, 2, 2}, NULL, NULL)}};

  for (int k = 0; k < 3; k++) {
    amount v[5];

    for (int h = 0; h < 5; h++) v[h] = amount_of(pair[k][0], pair[k][1], every_keep[h]);
    const double a = v[0].given[0], b = v[0].given[1], both = v[0].volume, most = 1e-12 * (a + b);
    RT_CHECK(both > 0);
    RT_NEAR(v[1].volume, a - both, most);
    RT_NEAR(v[2].volume, b - both, most);
    RT_NEAR(v[3].volume, a, most);
    RT_NEAR(v[4].volume, a + b - both, most);
    for (int side = 0; side < 2; side++) tm_free(pair[k][side]);
  }
}

/* The faces of a mesh may be quadrangles, so the union has as many cells, faces and vertices as the mesh. */
static void identical_operands_are_their_union_and_leave_no_difference(void)
{
  tm_mesh *a = sp_boxes(&two, &three, &four, NULL), *b = sp_boxes(&two, &three, &four, NULL);
  super    s = super_of(a, b, REMAP_FACES_CENTRE, NULL, SUPER_UNION);

  if (RT_EQ(s.status, REMAP_OK)) {
    RT_EQ(s.cells->num_cells, a->view.num_cells);
    RT_EQ(s.cells->num_faces, a->view.num_faces);
    RT_EQ(s.cells->num_vertices, a->view.num_nodes);
  }
  RT_EQ(amount_of(a, b, REMAP_IN_SOURCE).cells, 0);
  RT_EQ(amount_of(a, b, REMAP_IN_TARGET).cells, 0);
  laid_free(s.l);
  tm_free(a);
  tm_free(b);
}

static void operands_with_one_skin_leave_no_difference(void)
{
  tm_mesh *a = sp_boxes(&two, &three, &four, NULL), *b = sp_boxes(&three, &two, &one, NULL);

  RT_EQ(amount_of(a, b, REMAP_IN_SOURCE).cells, 0);
  RT_EQ(amount_of(a, b, REMAP_IN_TARGET).cells, 0);
  RT_EQ(amount_of(a, b, REMAP_IN_BOTH).cells, 4 * 4 * 4);
  tm_free(a);
  tm_free(b);
}

static void abutting_operands_share_faces_and_no_volume(void)
{
  tm_mesh *a = sp_boxes(&two, &two, &two, NULL), *b = sp_boxes(&beside, &two, &two, NULL);
  super    s      = super_of(a, b, REMAP_FACES_CENTRE, NULL, SUPER_UNION);
  int      shared = 0;

  RT_EQ(amount_of(a, b, REMAP_IN_BOTH).cells, 0);
  if (RT_EQ(s.status, REMAP_OK)) {
    RT_EQ(s.cells->num_cells, 16);
    RT_EQ(s.cells->num_faces, 2 * a->view.num_faces - 4);
    for (rm_lid f = 0; f < s.cells->num_faces; f++) {
      const rm_lid *c = s.cells->face_cell[f];
      shared += c[1] >= 0 && s.cells->cell_ancestor[c[0]][0] >= 0 && s.cells->cell_ancestor[c[1]][0] < 0;
    }
    RT_EQ(shared, 4);
  }
  laid_free(s.l);
  tm_free(a);
  tm_free(b);
}

/* Eight children of one parent, whose outer faces are those of the children. */
static void nested_operands_are_the_finer_one(void)
{
  tm_mesh *a = sp_boxes(&one, &one, &one, NULL), *b = sp_boxes(&two, &two, &two, NULL);
  super    s = super_of(a, b, REMAP_FACES_CENTRE, NULL, SUPER_UNION);

  if (RT_EQ(s.status, REMAP_OK)) {
    RT_EQ(s.cells->num_cells, b->view.num_cells);
    RT_EQ(s.cells->num_faces, b->view.num_faces);
    RT_EQ(s.cells->num_vertices, b->view.num_nodes);
  }
  laid_free(s.l);
  tm_free(a);
  tm_free(b);
}

/* A slab through a box leaves two parts of it. */
static void components_of_a_pair_are_cells_of_their_own(void)
{
  static const sp_axis low = {1, {0, 90}}, slab = {1, {60, 80}}, across = {1, {-10, 100}};
  tm_mesh             *a = sp_boxes(&low, &one, &low, NULL), *b = sp_boxes(&across, &slab, &across, NULL);

  RT_EQ(amount_of(a, b, REMAP_IN_SOURCE).cells, 2);
  RT_EQ(amount_of(a, b, REMAP_IN_BOTH).cells, 1);
  RT_EQ(amount_of(a, b, REMAP_IN_TARGET).cells, 1);
  tm_free(a);
  tm_free(b);
}

/* Two boxes apart within one: three shells, two of them voids. */
static void a_cell_may_have_several_voids(void)
{
  static const sp_axis big = {1, {0, 160}}, three_of_them = {3, {20, 40, 80, 100}}, small = {1, {20, 40}};
  tm_mesh             *a = sp_boxes(&big, &big, &big, NULL), *b = sp_boxes(&three_of_them, &small, &small, NULL);
  uint8_t              keep[3] = {1, 0, 1};

  for (int way = 0; way < 2; way++) {
    const laid_how how = {.keep = {way ? keep : NULL, way ? NULL : keep}};
    super          s   = super_of(way ? b : a, way ? a : b, REMAP_FACES_CENTRE, &how, SUPER_UNION);
    super_check(&s, 1, true);
    if (s.status == REMAP_OK) RT_EQ(s.cells->num_cells, 3);
    laid_free(s.l);
  }
  tm_free(a);
  tm_free(b);
}

/* A void in one of the two parts that a slab leaves of a cell belongs to that part. */
static void a_void_belongs_to_the_part_around_it(void)
{
  static const sp_axis big = {1, {0, 160}}, layers = {3, {20, 40, 80, 100}}, wide_around = {3, {-20, 60, 80, 180}};
  tm_mesh             *a = sp_boxes(&big, &big, &big, NULL), *b = sp_boxes(&layers, &wide_around, &wide_around, NULL);
  uint8_t              keep[27] = {0};
  int                  voids    = 0;

  for (int k = 0; k < 9; k++) keep[3 * k + 2] = 1; /* the slab between 80 and 100 */
  keep[3 * 4]        = 1;                          /* a box within what is below */
  const laid_how how = {.keep = {NULL, keep}};
  super          s   = super_of(a, b, REMAP_FACES_CENTRE, &how, SUPER_UNION);
  super_check(&s, 1, true);
  for (rm_lid c = 0; s.status == REMAP_OK && c < s.cells->num_cells; c++) {
    const double unit = s.l->frame.scale * s.l->frame.scale * s.l->frame.scale;
    if (s.cells->cell_ancestor[c][0] < 0 || s.cells->cell_ancestor[c][1] >= 0) continue;
    voids += fabs(s.cells->cell_volume[c] / unit - (160. * 160 * 80 - 20 * 20 * 20)) < 1e-6;
    RT_CHECK(s.cells->cell_volume[c] / unit < 160. * 160 * 80 - 1);
  }
  RT_EQ(voids, 1);
  laid_free(s.l);
  tm_free(a);
  tm_free(b);
}

/* n * n rods through one plate, every one of which makes a hole in its upper and its lower face: seconds of processor time, the
 * least of three. */
static void flatten(double xyz[3], const void *data)
{
  (void)data;
  xyz[0] = 1.2 * xyz[0] - .1 + .01 * xyz[1], xyz[1] = 1.2 * xyz[1] - .1, xyz[2] = .25 + .5 * xyz[2];
}
static double cross_plate(int n, bool check)
{
  const int g     = 2 * n + 1;
  tm_mesh  *plate = tm_hexahedra((int[]){1, 1, 1}, flatten, NULL), *grid = tm_hexahedra((int[]){g, g, 1}, NULL, NULL);
  uint8_t  *keep  = tm_alloc_((int64_t)g * g, 1);
  double    least = INFINITY;

  for (int j = 1; j < g; j += 2)
    for (int i = 1; i < g; i += 2) keep[j * g + i] = 1;
  for (int k = 0; k < (check ? 1 : 3); k++) {
    const clock_t start = clock();
    super         s     = super_of(plate, grid, REMAP_FACES_CENTRE, &(laid_how){.keep = {NULL, keep}}, SUPER_UNION);
    const clock_t end   = clock();
    if (check) super_check(&s, -1, false);
    if (RT_EQ(s.status, REMAP_OK)) {
      RT_EQ(s.cells->num_cells, 1 + 3 * n * n);
      least = fmin(least, (double)(end - start) / CLOCKS_PER_SEC);
    }
    laid_free(s.l);
  }
  tm_free(plate), tm_free(grid), free(keep);
  return least;
}

/* 16 times as many holes in a face: 256 times the time if a hole were compared with every other. */
static void faces_may_have_many_holes(void)
{
  cross_plate(6, true);
  const double few = cross_plate(12, false), many = cross_plate(rt_long() ? 100 : 48, false);
  RT_CHECK(many < (rt_long() ? 70 : 16) * 4 * few);
}

static void cells_that_overlap_are_refused(void)
{
  tm_mesh *a = tm_two_zones((int[]){2, 2, 2}, (int[]){2, 2, 2}, -0.25, NULL, NULL), *b = sp_boxes(&one, &one, &one, NULL);
  super    s = super_of(a, b, REMAP_FACES_CENTRE, NULL, SUPER_UNION);

  RT_EQ(s.status, REMAP_BAD_MESH);
  RT_CHECK(s.l->reason.text[0] != 0);
  laid_free(s.l);
  tm_free(a);
  tm_free(b);
}

static void squash(double xyz[3], const void *data)
{
  (void)data;
  xyz[1] *= xyz[2];
}

static void to_edge(double xyz[3], const void *data)
{
  (void)data;
  xyz[0] = .5 + (xyz[0] - .5) * xyz[2] * (1 - xyz[2]);
}
static void faces_without_area_are_left_out(void)
{
  agrees(tm_refined((int[]){2, 2, 2}, tm_checkered, squash, NULL), tm_hexahedra((int[]){4, 4, 4}, NULL, NULL), 0);
  agrees(tm_refined((int[]){2, 2, 2}, tm_right_half, squash, NULL), tm_refined((int[]){2, 2, 2}, tm_checkered, squash, NULL),
         -1);
  agrees(tm_refined((int[]){2, 2, 2}, tm_checkered, sp_to_axis, NULL), tm_tetrahedra((int[]){2, 2, 2}, NULL, NULL), -1);
  agrees(tm_refined((int[]){4, 2, 2}, tm_checkered, to_edge, NULL), tm_hexahedra((int[]){3, 2, 3}, NULL, NULL), -1);
}

/* ---- numbering --------------------------------------------------------------------------------------------------- */

static void compare(const super *s, const super *t)
{
  const rm_cells *a = s->cells, *b = t->cells;
  int64_t         different = 0;

  if (!RT_EQ(b->num_vertices, a->num_vertices) || !RT_EQ(b->num_faces, a->num_faces) || !RT_EQ(b->num_cells, a->num_cells))
    return;
  RT_CHECK(!memcmp(a->vertex, b->vertex, sizeof *a->vertex * (size_t)a->num_vertices));
  RT_CHECK(!memcmp(a->face_offset, b->face_offset, sizeof *a->face_offset * ((size_t)a->num_faces + 1)));
  RT_CHECK(!memcmp(a->face_vertex, b->face_vertex, sizeof *a->face_vertex * (size_t)a->face_offset[a->num_faces]));
  RT_CHECK(!memcmp(a->face_cell, b->face_cell, sizeof *a->face_cell * (size_t)a->num_faces));
  RT_CHECK(!memcmp(a->cell_volume, b->cell_volume, sizeof *a->cell_volume * (size_t)a->num_cells));
  for (rm_lid c = 0; c < a->num_cells; c++)
    for (int side = 0; side < 2; side++) {
      const rm_lid x = a->cell_ancestor[c][side], y = b->cell_ancestor[c][side];
      different += (x < 0 ? -1 : s->l->part.piece[side].cell_global[x]) != (y < 0 ? -1 : t->l->part.piece[side].cell_global[y]);
    }
  RT_EQ(different, 0);
}

static void numbering_and_senders_change_no_bit(void)
{
  tm_mesh *pair[3][2] = {{tm_benchmark(4, 0.7, 0.3, 0.8), tm_benchmark(3, 0.1, 0, 1)},
                         {sp_boxes(&two, &three, &two, NULL), sp_boxes(&shifted, &two, &four, NULL)},
                         {tm_dual((int[]){2, 2, 2}, NULL, NULL), tm_mixed((int[]){5, 2, 1}, NULL, NULL)}};

  for (int k = 0; k < 3; k++) {
    super s = super_of(pair[k][0], pair[k][1], REMAP_FACES_CENTRE, NULL, SUPER_UNION);
    for (int senders = 1; senders < 4; senders++) {
      super t = super_of(pair[k][0], pair[k][1], REMAP_FACES_CENTRE,
                         &(laid_how){.shuffle = 5 + (uint64_t)senders, .senders = senders}, SUPER_UNION);
      if (RT_EQ(s.status, REMAP_OK) && RT_EQ(t.status, REMAP_OK)) compare(&s, &t);
      laid_free(t.l);
    }
    laid_free(s.l);
    for (int side = 0; side < 2; side++) tm_free(pair[k][side]);
  }
}

static int by_coordinates(const void *a, const void *b)
{
  const double *x = a, *y = b;

  for (int c = 0; c < 3; c++)
    if (x[c] != y[c]) return x[c] < y[c] ? -1 : 1;
  return 0;
}

static void which_mesh_is_the_source_moves_no_vertex(void)
{
  tm_mesh *pair[3][2] = {{tm_benchmark(4, 0.7, 0.3, 0.8), tm_benchmark(3, 0.1, 0, 1)},
                         {sp_boxes(&two, &three, &two, NULL), sp_boxes(&shifted, &two, &four, NULL)},
                         {sp_boxes(&two, &two, &two, sp_warp), sp_boxes(&three, &two, &three, NULL)}};

  for (int k = 0; k < 3; k++) {
    super s = super_of(pair[k][0], pair[k][1], REMAP_FACES_CENTRE, NULL, SUPER_UNION);
    super t = super_of(pair[k][1], pair[k][0], REMAP_FACES_CENTRE, NULL, SUPER_UNION);
    if (RT_EQ(s.status, REMAP_OK) && RT_EQ(t.status, REMAP_OK) && RT_EQ(t.cells->num_vertices, s.cells->num_vertices)) {
      RT_EQ(t.cells->num_faces, s.cells->num_faces);
      RT_EQ(t.cells->num_cells, s.cells->num_cells);
      RT_EQ(t.cells->face_offset[t.cells->num_faces], s.cells->face_offset[s.cells->num_faces]);
      qsort((void *)s.cells->vertex, (size_t)s.cells->num_vertices, sizeof *s.cells->vertex, by_coordinates);
      qsort((void *)t.cells->vertex, (size_t)t.cells->num_vertices, sizeof *t.cells->vertex, by_coordinates);
      RT_CHECK(!memcmp(s.cells->vertex, t.cells->vertex, sizeof *s.cells->vertex * (size_t)s.cells->num_vertices));
    }
    laid_free(s.l);
    laid_free(t.l);
    for (int side = 0; side < 2; side++) tm_free(pair[k][side]);
  }
}

static void memory_that_runs_out_is_told(void)
{
  tm_mesh          *a = sp_boxes(&two, &two, &two, NULL), *b = sp_boxes(&shifted, &two, &four, NULL);
  laid             *l      = laid_over(a, b, REMAP_FACES_CENTRE, NULL);
  remap_status      status = REMAP_NO_MEMORY;
  int64_t           n      = 0;
  const rm_trimesh *mesh[2];
  const rm_overlay *o = NULL;

  const rm_trimesh_home home = {l->arena, l->arena, l->arena};

  for (int side = 0; side < 2; side++) RT_EQ(rm_cells_mesh(&home, &l->frame, l->mesh[side], &mesh[side]), REMAP_OK);
  RT_EQ(rm_overlay_build(l->arena, mesh, &l->part, NULL, &o, NULL), REMAP_OK);

  while (status == REMAP_NO_MEMORY && n < 100) {
    rm_arena       *arena = rm_arena_new();
    const rm_cells *cells = NULL;
    rm_arena_fail_at(arena, ++n);
    status = rm_cells_build(arena, &l->part, o, NULL, &(rm_cells_choice){.keep = SUPER_UNION}, &cells, NULL);
    RT_CHECK((cells != NULL) == (status == REMAP_OK));
    rm_arena_drop(arena);
  }
  RT_EQ(status, REMAP_OK);
  RT_CHECK(n > 5);
  laid_free(l);
  tm_free(a);
  tm_free(b);
}

RT_MAIN(RT_CASE(identical_boxes), RT_CASE(identical_warped_boxes), RT_CASE(children_in_their_parents),
        RT_CASE(a_box_around_all), RT_CASE(two_against_three), RT_CASE(boxes_shifted_by_half), RT_CASE(boxes_that_abut),
        RT_CASE(boxes_that_abut_askew), RT_CASE(boxes_that_touch_in_a_vertex), RT_CASE(warped_boxes_on_straight_ones),
        RT_CASE(a_singular_axis), RT_CASE(a_layer_without_thickness), RT_CASE(two_layers_without_thickness),
        RT_CASE(a_box_within_a_box), RT_CASE(a_box_through_a_face), RT_CASE(a_box_on_a_face_from_inside),
        RT_CASE(a_box_on_a_face_from_outside), RT_CASE(benchmark_meshes), RT_CASE(moved_tetrahedra_on_prisms),
        RT_CASE(dual_on_hexahedra), RT_CASE(refined_on_mixed), RT_CASE(volumes_hold_far_from_the_origin),
        RT_CASE(operations_add_up), RT_CASE(identical_operands_are_their_union_and_leave_no_difference),
        RT_CASE(operands_with_one_skin_leave_no_difference), RT_CASE(abutting_operands_share_faces_and_no_volume),
        RT_CASE(nested_operands_are_the_finer_one), RT_CASE(components_of_a_pair_are_cells_of_their_own),
        RT_CASE(a_cell_may_have_several_voids), RT_CASE(a_void_belongs_to_the_part_around_it),
        RT_CASE(faces_may_have_many_holes), RT_CASE(cells_that_overlap_are_refused), RT_CASE(faces_without_area_are_left_out),
        RT_CASE(numbering_and_senders_change_no_bit), RT_CASE(which_mesh_is_the_source_moves_no_vertex),
        RT_CASE(memory_that_runs_out_is_told))
