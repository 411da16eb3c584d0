/* super -- the supermesh of two test meshes, and what must hold of it: closed cells, each of their edges in two faces,
 * volumes as the moments have them, faces that cover those they came from, no vertex inside an edge.
 *
 *   super s = super_of(source, target, REMAP_FACES_CENTRE, NULL, SUPER_UNION);
 *   super_check(&s, 0, false);
 *   laid_free(s.l); */
#ifndef SUPER_H
#define SUPER_H

#include "cells/cells.h"
#include "laid.h"
#include "rt.h"

enum { SUPER_WHOLE_SOURCE = REMAP_IN_BOTH | REMAP_IN_SOURCE, SUPER_UNION = SUPER_WHOLE_SOURCE | REMAP_IN_TARGET };

typedef struct super {
  laid             *l;
  const rm_trimesh *mesh[2]; /* without flat triangles */
  const rm_cells *cells;
  remap_status    status;
} super;

static inline super super_of(const tm_mesh *source, const tm_mesh *target, remap_faces faces, const laid_how *how, int keep)
{
  const rm_cells_choice choice = {.keep = keep};
  super                 s      = {.l = laid_over(source, target, faces, how)};
  const rm_overlay     *o      = s.l->overlay;
  const rm_trimesh_home home   = {s.l->arena, s.l->arena, s.l->arena};

  s.status = s.l->status;
  for (int side = 0; side < 2 && s.status == REMAP_OK; side++)
    s.status = rm_cells_mesh(&home, &s.l->frame, s.l->mesh[side], &s.mesh[side]);
  if (s.status == REMAP_OK && (s.mesh[0] != s.l->mesh[0] || s.mesh[1] != s.l->mesh[1]))
    s.status = rm_overlay_build(s.l->arena, s.mesh, &s.l->part, NULL, &o, &s.l->reason);
  if (s.status == REMAP_OK) s.status = rm_cells_build(s.l->arena, &s.l->part, o, NULL, &choice, &s.cells, &s.l->reason);
  return s;
}

/* ---- what a supermesh must be ------------------------------------------------------------------------------------ */

static inline void super_area_vector_(const rm_cells *m, rm_lid f, double out[3])
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
static inline void super_check_volumes(const super *s)
{
  const laid       *l = s->l;
  const rm_moments *p = l->moments;
  const rm_lid      n[2] = {l->mesh[0]->num_cells, l->mesh[1]->num_cells};
  double           *sum  = tm_alloc_((int64_t)n[0] * n[1], sizeof *sum),
         *row[2]         = {tm_alloc_(n[0], sizeof(double)), tm_alloc_(n[1], sizeof(double))};

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

/* The face of the piece that a triangle is part of, the lower one if it is of two. */
static inline rm_lid super_face_of_triangle_(const rm_trimesh *mesh, rm_lid t)
{
  const rm_lid *f = mesh->triangle_face[t];
  return f[0] < 0 || (f[1] >= 0 && f[1] < f[0]) ? f[1] : f[0];
}

/* The faces that came from a face of an operand cover it, once. */
static inline void super_faces_are_covered_(const super *s)
{
  for (int side = 0; side < 2; side++) {
    const rm_trimesh *m   = s->mesh[side];
    const rm_lid      n   = s->l->part.piece[side].num_faces;
    double           *sum = tm_alloc_(n, sizeof *sum), *area = tm_alloc_(n, sizeof *area), worst = 0;

    for (rm_lid f = 0; f < s->cells->num_faces; f++) {
      const rm_lid t = rm_cells_triangle(s->cells, f, side);
      double       a[3];
      super_area_vector_(s->cells, f, a);
      if (t >= 0) sum[super_face_of_triangle_(m, t)] += sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    }
    for (rm_lid t = 0; t < m->num_triangles; t++) {
      const double *v = m->normal[t];
      if (t && !memcmp(m->triangle[t], m->triangle[t - 1], sizeof *m->triangle))
        continue; /* counts as the first that lies there */
      area[super_face_of_triangle_(m, t)] += .5 * sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    }
    for (rm_lid f = 0; f < n; f++)
      if (area[f] > 0) worst = fmax(worst, fabs(sum[f] - area[f]) / area[f]);
    RT_NEAR(worst, 0, 1e-12);
    free(sum);
    free(area);
  }
}

/* No vertex lies inside an edge of a face. */
static inline void super_edges_are_whole_(const super *s)
{
  const rm_cells *m = s->cells;
  int64_t         bad = 0;

  for (rm_lid f = 0; f < m->num_faces; f++)
    for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++) {
      const double *a = m->vertex[m->face_vertex[k]],
                   *b = m->vertex[m->face_vertex[k + 1 < m->face_offset[f + 1] ? k + 1 : m->face_offset[f]]];
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

typedef struct super_use_ {
  rm_lid cell, low, high;
} super_use_;
static inline int super_by_use_(const void *a, const void *b) { return memcmp(a, b, sizeof(super_use_)); }

/* Every edge of a cell lies in two of its faces, and V - E + F is 2 for all cells but odd_cells, which have voids or
 * handles. -1: any number of them, and cells may touch themselves along an edge. */
static inline void super_cells_are_manifold_(const super *s, int odd_cells)
{
  const rm_cells *m    = s->cells;
  super_use_     *list = tm_alloc_(2 * m->face_offset[m->num_faces], sizeof *list);
  rm_lid         *euler = tm_alloc_(m->num_cells, sizeof *euler), *seen = tm_alloc_(m->num_vertices, sizeof *seen), more = 0;
  int64_t         n = 0, odd = 0, touching = 0;

  for (rm_lid f = 0; f < m->num_faces; f++)
    for (int h = 0; h < 2; h++) {
      if (m->face_cell[f][h] < 0) continue;
      euler[m->face_cell[f][h]]++;
      for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++) {
        const rm_lid a = m->face_vertex[k], b = m->face_vertex[k + 1 < m->face_offset[f + 1] ? k + 1 : m->face_offset[f]];
        list[n++]      = (super_use_){m->face_cell[f][h], a < b ? a : b, a < b ? b : a};
      }
    }
  qsort(list, (size_t)n, sizeof *list, super_by_use_);
  for (int64_t k = 0, next; k < n; k = next) {
    for (next = k + 1; next < n && !super_by_use_(&list[k], &list[next]);) next++;
    touching += next - k == 4;
    odd += next - k != 2 && next - k != 4;
    euler[list[k].cell]--;
  }
  RT_EQ(odd, 0);
  if (odd_cells >= 0) RT_EQ(touching, 0);
  memset(seen, -1, sizeof *seen * (size_t)m->num_vertices);
  for (int64_t k = 0; k < n; k++) /* edges of a cell stand together */
    for (int h = 0; h < 2; h++) {
      const rm_lid v = h ? list[k].high : list[k].low;
      if (seen[v] == list[k].cell) continue;
      seen[v] = list[k].cell;
      euler[list[k].cell]++;
    }
  for (rm_lid c = 0; c < m->num_cells; c++) more += euler[c] != 2;
  if (odd_cells >= 0) RT_EQ(more, odd_cells);
  free(list);
  free(euler);
  free(seen);
}

/* All of it, for SUPER_UNION. odd_cells: as many cells have voids or handles, -1: any number. coarse: coordinates have so
 * few bits that points within 1e-13 are equal. */
static inline void super_check(const super *s, int odd_cells, bool coarse)
{
  if (!RT_EQ(s->status, REMAP_OK)) {
    fprintf(stderr, "%s\n", s->l->reason.text);
    return;
  }
  RT_EQ(rm_cells_check(s->cells), REMAP_OK);
  super_check_volumes(s);
  super_faces_are_covered_(s);
  if (coarse) super_edges_are_whole_(s);
  super_cells_are_manifold_(s, odd_cells);
}

#endif
