/* The supermesh of small meshes: closed cells, volumes against the moments, faces against the faces they came from, conformity. */
#include "cells/cells.h"
#include "laid.h"
#include "rt.h"

typedef struct super {
  laid           *l;
  const rm_cells *cells;
  remap_status    status;
} super;

static super super_of(const tm_mesh *source, const tm_mesh *target, remap_faces faces, const laid_how *how, int keep)
{
  super s = {laid_over(source, target, faces, how), NULL, REMAP_OK};

  s.status = s.l->status == REMAP_OK ? rm_cells_build(s.l->arena, &s.l->part, s.l->overlay, keep, &s.cells, &s.l->reason) : s.l->status;
  return s;
}

/* ---- what a supermesh must be -------------------------------------------------------------------------------------------- */

static void area_vector(const rm_cells *m, rm_lid f, double out[3])
{
  const rm_lid *v = m->face_vertex + m->face_offset[f];
  const double *o = m->vertex[v[0]];

  out[0] = out[1] = out[2] = 0;
  for (int64_t k = 1; k + 1 < m->face_offset[f + 1] - m->face_offset[f]; k++) {
    double a[3], b[3];
    for (int c = 0; c < 3; c++) a[c] = m->vertex[v[k]][c] - o[c], b[c] = m->vertex[v[k + 1]][c] - o[c];
    for (int c = 0; c < 3; c++) out[c] += .5 * (a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3]);
  }
}

/* Volumes by pair are those of the moments, and there are no other pairs. */
static void volumes_are_right(const super *s)
{
  const laid       *l = s->l;
  const rm_moments *p = l->moments;
  const rm_lid      n[2] = {l->mesh[0]->num_cells, l->mesh[1]->num_cells};
  double           *sum = tm_alloc_((int64_t)n[0] * n[1], sizeof *sum), *row[2] = {tm_alloc_(n[0], sizeof(double)), tm_alloc_(n[1], sizeof(double))};

  for (rm_lid c = 0; c < s->cells->num_cells; c++) {
    const rm_lid *a = s->cells->cell_ancestor[c];
    if (a[0] >= 0 && a[1] >= 0) sum[(int64_t)a[0] * n[1] + a[1]] += s->cells->cell_volume[c];
    for (int side = 0; side < 2; side++)
      if (a[side] >= 0) row[side][a[side]] += s->cells->cell_volume[c];
  }
  for (int64_t k = 0; k < p->num_pairs; k++) {
    const double least = fmin(l->part.piece[0].cell_volume[p->source[k]], l->part.piece[1].cell_volume[p->target[k]]);
    double      *x = &sum[(int64_t)p->source[k] * n[1] + p->target[k]];
    if (p->volume[k] > 1e-13 * least) RT_CHECK(*x > 0);
    RT_NEAR(*x, p->volume[k], 1e-12 * least);
    *x = 0;
  }
  for (int64_t k = 0; k < (int64_t)n[0] * n[1]; k++) RT_CHECK(sum[k] == 0);
  for (int side = 0; side < 2; side++)
    for (rm_lid c = 0; c < n[side]; c++)
      RT_NEAR(row[side][c], l->part.piece[side].cell_volume[c], 1e-12 * l->part.piece[side].cell_volume[c]);
  free(sum);
  for (int side = 0; side < 2; side++) free(row[side]);
}

/* The faces that came from a face of an operand cover it, once. */
static void faces_are_covered(const super *s)
{
  for (int side = 0; side < 2; side++) {
    const rm_trimesh *m   = s->l->mesh[side];
    const rm_lid      n   = s->l->part.piece[side].num_faces;
    double           *sum = tm_alloc_(n, sizeof *sum), *area = tm_alloc_(n, sizeof *area), worst = 0;

    for (rm_lid f = 0; f < s->cells->num_faces; f++) {
      const rm_lid t = s->cells->face_triangle[f][side];
      double       a[3];
      area_vector(s->cells, f, a);
      if (t >= 0) sum[m->triangle_face[t]] += sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    }
    for (rm_lid t = 0; t < m->num_triangles; t++) {
      const double *v = m->normal[t];
      if (t && !memcmp(m->triangle[t], m->triangle[t - 1], sizeof *m->triangle)) continue; /* counts as the first that lies there */
      area[m->triangle_face[t]] += .5 * sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    }
    for (rm_lid f = 0; f < n; f++)
      if (area[f] > 0) worst = fmax(worst, fabs(sum[f] - area[f]) / area[f]);
    RT_NEAR(worst, 0, 1e-12);
    free(sum);
    free(area);
  }
}

/* No vertex lies inside an edge of a face. */
static void edges_are_whole(const super *s)
{
  const rm_cells *m = s->cells;
  int64_t         bad = 0;

  for (rm_lid f = 0; f < m->num_faces; f++)
    for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++) {
      const double *a = m->vertex[m->face_vertex[k]], *b = m->vertex[m->face_vertex[k + 1 < m->face_offset[f + 1] ? k + 1 : m->face_offset[f]]];
      for (rm_lid v = 0; v < m->num_vertices; v++) {
        const double *p = m->vertex[v];
        double        uu = 0, up = 0, off = 0;
        for (int c = 0; c < 3; c++) uu += (b[c] - a[c]) * (b[c] - a[c]), up += (p[c] - a[c]) * (b[c] - a[c]);
        if (p == a || p == b || up < 0 || up > uu) continue;
        for (int c = 0; c < 3; c++) off = fmax(off, fabs(p[c] - a[c] - up / uu * (b[c] - a[c])));
        bad += off < 1e-13;
      }
    }
  RT_EQ(bad, 0);
}

typedef struct use {
  rm_lid cell, low, high;
} use;
static int by_use(const void *a, const void *b) { return memcmp(a, b, sizeof(use)); }

/* Every edge of a cell lies in two of its faces, and V - E + F of every cell is 2 times its shells. */
static void cells_are_manifold(const super *s, int shells)
{
  const rm_cells *m    = s->cells;
  use            *list = tm_alloc_(2 * m->face_offset[m->num_faces], sizeof *list);
  rm_lid         *euler = tm_alloc_(m->num_cells, sizeof *euler), *seen = tm_alloc_(m->num_vertices, sizeof *seen), more = 0;
  int64_t         n = 0, odd = 0;

  for (rm_lid f = 0; f < m->num_faces; f++)
    for (int h = 0; h < 2; h++) {
      if (m->face_cell[f][h] < 0) continue;
      euler[m->face_cell[f][h]]++;
      for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++) {
        const rm_lid a = m->face_vertex[k], b = m->face_vertex[k + 1 < m->face_offset[f + 1] ? k + 1 : m->face_offset[f]];
        list[n++]      = (use){m->face_cell[f][h], a < b ? a : b, a < b ? b : a};
      }
    }
  qsort(list, (size_t)n, sizeof *list, by_use);
  for (int64_t k = 0; k < n; k += 2) {
    odd += k + 1 == n || by_use(&list[k], &list[k + 1]) || (k + 2 < n && !by_use(&list[k], &list[k + 2]));
    euler[list[k].cell]--;
  }
  RT_EQ(odd, 0);
  memset(seen, -1, sizeof *seen * (size_t)m->num_vertices);
  for (int pass = 0; pass < 2; pass++) { /* vertices of a cell: those of its edges; lists ascend by bytes, cells stand together */
    for (int64_t k = 0; k < n && pass == 0; k++)
      for (int h = 0; h < 2; h++) {
        const rm_lid v = h ? list[k].high : list[k].low;
        if (seen[v] == list[k].cell) continue;
        seen[v] = list[k].cell;
        euler[list[k].cell]++;
      }
  }
  for (rm_lid c = 0; c < m->num_cells; c++) more += euler[c] != 2;
  if (shells >= 0) RT_EQ(more, shells);
  free(list);
  free(euler);
  free(seen);
}

/* Cells whose V - E + F is not 2: with a void or a hole through them. */
static void supermesh_is_right(const super *s, int odd_cells)
{
  if (!RT_EQ(s->status, REMAP_OK)) {
    fprintf(stderr, "%s\n", s->l->reason.text);
    return;
  }
  RT_EQ(rm_cells_check(s->cells), REMAP_OK);
  volumes_are_right(s);
  faces_are_covered(s);
  if (odd_cells >= 0) edges_are_whole(s);
  cells_are_manifold(s, odd_cells);
}

/* Both triangulations, both ways round; the meshes are given up. */
static void agrees(tm_mesh *a, tm_mesh *b, int odd_cells)
{
  for (int way = 0; way < 4; way++) {
    super s = super_of(way & 1 ? b : a, way & 1 ? a : b, way & 2 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, NULL, RM_CELLS_UNION);

    supermesh_is_right(&s, odd_cells);
    laid_free(s.l);
  }
  tm_free(a);
  tm_free(b);
}

/* ---- boxes ----------------------------------------------------------------------------------------------------------------- */

typedef struct spacing {
  int    n;
  double x[6];
} spacing;
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
static void warp(double xyz[3], const void *data)
{
  const long x = lrint(xyz[0]), y = lrint(xyz[1]), z = lrint(xyz[2]);

  (void)data;
  xyz[0] += (double)((7 * y + 3 * z) % 11 - 5);
  xyz[1] += (double)((5 * x + 2 * z) % 7 - 3);
  xyz[2] += (double)((3 * x + 5 * y) % 13 - 6);
}
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

static const spacing one = {1, {0, 120}}, two = {2, {0, 60, 120}}, three = {3, {0, 40, 80, 120}}, four = {4, {0, 30, 60, 90, 120}};
static const spacing wide = {3, {0, 60, 120, 180}}, one_wide = {1, {0, 180}}, shifted = {2, {30, 90, 150}};
static const spacing beside = {2, {120, 180, 240}}, corner = {1, {120, 180}}, flat = {3, {0, 60, 60, 120}};
static const spacing inner = {1, {40, 80}}, inner_two = {2, {40, 50, 80}}, around = {2, {-10, 70, 130}};

static void identical_boxes(void) { agrees(boxes(&two, &two, &two, NULL), boxes(&two, &two, &two, NULL), 0); }
static void identical_warped_boxes(void) { agrees(boxes(&two, &two, &two, warp), boxes(&two, &two, &two, warp), 0); }
static void children_in_their_parents(void) { agrees(boxes(&two, &two, &two, NULL), boxes(&four, &four, &four, NULL), 0); }
static void a_box_around_all(void) { agrees(boxes(&wide, &wide, &wide, NULL), boxes(&one_wide, &one_wide, &one_wide, NULL), 0); }
static void two_against_three(void) { agrees(boxes(&two, &two, &two, NULL), boxes(&three, &three, &three, NULL), 0); }
static void boxes_shifted_by_half(void) { agrees(boxes(&two, &two, &two, NULL), boxes(&shifted, &shifted, &shifted, NULL), 0); }
static void boxes_that_abut(void) { agrees(boxes(&two, &two, &two, NULL), boxes(&beside, &two, &two, NULL), 0); }
static void boxes_that_abut_askew(void) { agrees(boxes(&two, &two, &two, NULL), boxes(&beside, &shifted, &three, NULL), 0); }
static void boxes_that_touch_in_a_vertex(void) { agrees(boxes(&two, &two, &two, NULL), boxes(&corner, &corner, &corner, NULL), 0); }
static void warped_boxes_on_straight_ones(void) { agrees(boxes(&two, &two, &two, warp), boxes(&two, &two, &two, NULL), -1); }
static void a_singular_axis(void) { agrees(boxes(&two, &two, &two, to_axis), boxes(&two, &two, &two, widen), -1); }
static void a_layer_without_thickness(void) { agrees(boxes(&flat, &two, &two, NULL), boxes(&two, &two, &two, NULL), 0); }
static void two_layers_without_thickness(void) { agrees(boxes(&flat, &flat, &two, NULL), boxes(&flat, &flat, &two, NULL), 0); }
static void a_box_within_a_box(void) { agrees(boxes(&one, &one, &one, NULL), boxes(&inner_two, &inner, &inner, NULL), 1); }
static void a_box_through_a_face(void) { agrees(boxes(&one, &one, &one, NULL), boxes(&inner, &inner, &around, NULL), 1); }
static void a_box_on_a_face_from_inside(void) { agrees(boxes(&one, &one, &one, NULL), boxes(&inner_two, &inner, &two, NULL), 1); }
static void a_box_on_a_face_from_outside(void) { agrees(boxes(&one, &one, &one, NULL), boxes(&inner_two, &inner, &beside, NULL), 0); }

/* ---- meshes in general position ------------------------------------------------------------------------------------------------ */

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

RT_MAIN(RT_CASE(identical_boxes), RT_CASE(identical_warped_boxes), RT_CASE(children_in_their_parents), RT_CASE(a_box_around_all),
        RT_CASE(two_against_three), RT_CASE(boxes_shifted_by_half), RT_CASE(boxes_that_abut), RT_CASE(boxes_that_abut_askew),
        RT_CASE(boxes_that_touch_in_a_vertex), RT_CASE(warped_boxes_on_straight_ones), RT_CASE(a_singular_axis),
        RT_CASE(a_layer_without_thickness), RT_CASE(two_layers_without_thickness), RT_CASE(a_box_within_a_box),
        RT_CASE(a_box_through_a_face), RT_CASE(a_box_on_a_face_from_inside), RT_CASE(a_box_on_a_face_from_outside),
        RT_CASE(benchmark_meshes), RT_CASE(moved_tetrahedra_on_prisms), RT_CASE(dual_on_hexahedra), RT_CASE(refined_on_mixed))
