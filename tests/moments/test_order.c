/* What a pair holds depends on the coordinates of its two cells alone: not on numbering, not on which rank sent a cell, not on
 * what other cells are there. Compared bit for bit. */
#include "laid.h"
#include "rt.h"

/* Every pair of the kept cells, and of no others, is in both, alike in every bit; asked of targets that are kept in `part`. */
static void alike(const laid *whole, const laid *part)
{
  int64_t found = 0;

  for (rm_lid i = 0; i < whole->num[0]; i++)
    for (rm_lid j = 0; j < whole->num[1]; j++) {
      const int64_t k = laid_pair(whole, i, j), l = laid_pair(part, i, j);

      if (part->place[1][j] < 0) continue;
      found += l >= 0;
      if ((k >= 0) != (l >= 0)) rt_fail_(__FILE__, __LINE__, "pair (%d, %d) is in one only", i, j);
      if (k < 0 || l < 0) continue;
      RT_NEAR(part->moments->volume[l], whole->moments->volume[k], 0.0);
      for (int c = 0; c < 3; c++) RT_NEAR(part->moments->moment[l][c], whole->moments->moment[k][c], 0.0);
      for (int c = 0; c < 6; c++) RT_NEAR(part->moments->second[l][c], whole->moments->second[k][c], 0.0);
      RT_EQ(part->moments->flags[l], whole->moments->flags[k]);
    }
  RT_EQ(found, part->moments->num_pairs);
}

/* The sources whose boxes meet a kept target: what a rank is sent. */
static uint8_t *sources_needed(const laid *l, const uint8_t *keep)
{
  uint8_t *need = tm_alloc_(l->num[0], 1);

  for (rm_lid i = 0; i < l->num[0]; i++)
    for (rm_lid j = 0; j < l->num[1]; j++)
      need[i] |= keep[j] && rm_box_meets(l->mesh[0]->cell_box[l->place[0][i]], l->mesh[1]->cell_box[l->place[1][j]]);
  return need;
}

static void check(tm_mesh *source, tm_mesh *target)
{
  for (int f = 0; f < 2; f++) {
    const remap_faces faces = f ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE;
    laid             *whole = laid_over(source, target, faces, &(laid_how){.degree = 2});
    uint64_t          seed  = 77 + (uint64_t)f;

    if (!RT_EQ(whole->status, REMAP_OK)) printf("# %s\n", whole->reason.text);
    for (int round = 1; round <= (rt_long() ? 40 : 6) && whole->status == REMAP_OK; round++) {
      uint8_t *keep = tm_alloc_(whole->num[1], 1), *need;
      laid    *l = laid_over(source, target, faces, &(laid_how){.shuffle = (uint64_t)round, .senders = round % 4, .degree = 2});

      if (RT_EQ(l->status, REMAP_OK)) alike(whole, l);
      laid_free(l);
      for (rm_lid j = 0; j < whole->num[1]; j++) keep[j] = tm_random(&seed, round + 1) == 0;
      need = sources_needed(whole, keep);
      l    = laid_over(source, target, faces, &(laid_how){{need, keep}, (uint64_t)round, round % 3, 2});
      if (RT_EQ(l->status, REMAP_OK)) alike(whole, l);
      laid_free(l);
      free(keep);
      free(need);
    }
    laid_free(whole);
  }
  tm_free(source);
  tm_free(target);
}

static void placed(tm_mesh *mesh, double scale, double shift)
{
  tm_move(mesh, tm_affine, (double[]){scale, 0, 0, shift, 0, scale, 0, shift, 0, 0, scale, shift});
}

static void warped_and_turned_hexahedra(void) { check(tm_benchmark(5, .7, .3, .6), tm_benchmark(4, .1, 0, 1)); }
static void meshes_that_stick_out_of_each_other(void)
{
  tm_mesh *a = tm_benchmark(5, .7, .3, 1), *b = tm_benchmark(4, .1, 0, 1);

  placed(b, 1, .3);
  check(a, b);
}
static void identical_meshes(void)
{
  check(tm_hexahedra((int[]){3, 4, 3}, tm_warp, &(tm_warping){.04, .3}),
        tm_hexahedra((int[]){3, 4, 3}, tm_warp, &(tm_warping){.04, .3}));
}
static void nested_and_aligned_boxes(void)
{
  check(tm_hexahedra((int[]){2, 3, 2}, NULL, NULL), tm_hexahedra((int[]){4, 4, 4}, NULL, NULL));
}
static void polyhedra_and_hanging_nodes(void)
{
  check(tm_dual((int[]){2, 3, 2}, tm_warp, &(tm_warping){.03, .3}), tm_refined((int[]){2, 2, 2}, tm_checkered, NULL, NULL));
}
static void tetrahedra_on_mixed_cells(void)
{
  check(tm_tetrahedra((int[]){2, 2, 2}, tm_warp, &(tm_warping){.03, .3}), tm_mixed((int[]){5, 2, 2}, NULL, NULL));
}
static void patched_zones(void)
{
  for (int k = -1; k <= 1; k++) {
    tm_mesh *third = tm_benchmark(4, .7, .3, 1);
    placed(third, 1, .5);
    check(tm_two_zones((int[]){2, 3, 3}, (int[]){2, 3, 2}, k * 1e-3, NULL, NULL), third);
  }
}
static void planar_boxes(void)
{
  check(tm_hexahedra((int[]){3, 3, 3}, tm_cube, &(tm_cubing){{3, 3, 3}, true}),
        tm_hexahedra((int[]){4, 3, 4}, tm_cube, &(tm_cubing){{4, 3, 4}, false}));
}
static void planar_faces_with_hanging_nodes(void)
{
  check(tm_refined((int[]){2, 2, 2}, tm_checkered, tm_cube, &(tm_cubing){{2, 2, 2}, true}),
        tm_refined((int[]){2, 2, 2}, tm_right_half, tm_cube, &(tm_cubing){{2, 2, 2}, false}));
}

/* Where the zones meet, each face of one is two of the other, cut along the same diagonal: one way of shearing makes that the
 * shorter one. */
static void quadrangles_patched_to_pairs_of_triangles(void)
{
  for (int way = -1; way <= 1; way += 2) {
    tm_mesh *boxes = tm_hexahedra((int[]){2, 2, 2}, NULL, NULL), *prisms = tm_prisms((int[]){2, 2, 2}, NULL, NULL), *third;

    tm_move(prisms, tm_affine, (double[]){1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1});
    boxes = tm_join(boxes, prisms);
    tm_move(boxes, tm_affine, (double[]){1, .25 * way, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    third = tm_hexahedra((int[]){3, 2, 3}, tm_cube, &(tm_cubing){{3, 2, 3}, true});
    placed(third, 0x1p-9, .5);
    check(boxes, third);
  }
}
static void pancakes(void)
{
  tm_mesh *a = tm_benchmark(4, .7, 0, .9), *b = tm_benchmark(4, .1, 0, 1);

  for (int64_t v = 0; v < a->view.num_nodes; v++) a->xyz[3 * v + 2] *= 1e-5, tm_rotate_(a->xyz + 3 * v, .4);
  for (int64_t v = 0; v < b->view.num_nodes; v++) b->xyz[3 * v + 2] *= 1e-5, tm_rotate_(b->xyz + 3 * v, .4);
  check(a, b);
}
static void coarse_cells_around_small_ones(void)
{
  tm_mesh *small = tm_hexahedra((int[]){4, 4, 4}, tm_warp, &(tm_warping){.04, .3});

  placed(small, .1, .31);
  check(tm_hexahedra((int[]){2, 2, 1}, NULL, NULL), small);
}

RT_MAIN(RT_CASE(warped_and_turned_hexahedra), RT_CASE(meshes_that_stick_out_of_each_other), RT_CASE(identical_meshes),
        RT_CASE(nested_and_aligned_boxes), RT_CASE(polyhedra_and_hanging_nodes), RT_CASE(tetrahedra_on_mixed_cells),
        RT_CASE(patched_zones), RT_CASE(planar_boxes), RT_CASE(planar_faces_with_hanging_nodes),
        RT_CASE(quadrangles_patched_to_pairs_of_triangles), RT_CASE(pancakes), RT_CASE(coarse_cells_around_small_ones))
