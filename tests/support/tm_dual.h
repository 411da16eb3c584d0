/* tm_dual -- the dual of the tetrahedra of a lattice: polyhedra about its nodes. O(n log n). See meshes.h. */
#ifndef TM_DUAL_H
#define TM_DUAL_H

#include "tm_lattice.h"

/* One edge in one tetrahedron: det[to - from, left - from, right - from] > 0, so that going round the edge by the right-hand
 * rule leads from the triangle with `left` to the one with `right`. */
typedef struct tm_wedge_ {
  int64_t from, to, left, right, tet;
} tm_wedge_;
static inline int tm_by_edge_(const void *x, const void *y)
{
  const tm_wedge_ *v = x, *w = y;

  if (v->from != w->from) return v->from < w->from ? -1 : 1;
  return (v->to > w->to) - (v->to < w->to);
}

/* Dual nodes are the tetrahedra and, on the boundary, centres of triangles, midpoints of edges and nodes: the mean of `count`
 * nodes, found in a lattice of sixths of a box. m counts nodes. */
static inline int64_t tm_mean_id_(const int m[3], int64_t num_tets, int count, const int64_t *node)
{
  int64_t sixth[3] = {0, 0, 0};

  for (int v = 0; v < count; v++) {
    sixth[0] += 6 / count * (node[v] % m[0]);
    sixth[1] += 6 / count * (node[v] / m[0] % m[1]);
    sixth[2] += 6 / count * (node[v] / m[0] / m[1]);
  }
  return num_tets + (sixth[2] * (6 * m[1] - 5) + sixth[1]) * (6 * m[0] - 5) + sixth[0];
}

/* The dual faces of one edge, from its wedges in any order: the polygon of the tetrahedra around it and, on the boundary,
 * what closes the cells of both ends. */
static inline void tm_add_dual_edge_(tm_builder_ *b, const int m[3], int64_t num_tets, const tm_wedge_ *wedge, int num_wedges)
{
  enum { MOST = 64 };
  const int64_t from = wedge->from, to = wedge->to;
  int           first = 0, here, next, count = 0;
  bool          inner = true;
  int64_t       loop[MOST + 3], tip[2], centre[2], middle;

  for (int w = 0; w < num_wedges; w++) {
    bool has_previous = false;

    for (int v = 0; v < num_wedges; v++) has_previous = has_previous || wedge[v].right == wedge[w].left;
    if (!has_previous) first = w;
    inner = inner && has_previous;
  }
  if (num_wedges > MOST) abort();
  loop[count++] = -1; /* for the first triangle of a boundary edge */
  for (here = first, next = -1; next != first; here = next) {
    loop[count++] = wedge[here].tet;
    for (next = 0; next < num_wedges && wedge[next].left != wedge[here].right;) next++;
    if (next == num_wedges) break;
  }
  if (inner) {
    tm_face_(b, from, count - 1, loop + 1);
    tm_face_(b, to, count - 1, loop + 1);
    return;
  }
  tip[0] = wedge[first].left;
  tip[1] = wedge[here].right;
  middle = tm_mean_id_(m, num_tets, 2, (int64_t[]){from, to});
  for (int h = 0; h < 2; h++) centre[h] = tm_mean_id_(m, num_tets, 3, (int64_t[]){from, to, tip[h]});
  loop[0]       = centre[0];
  loop[count++] = centre[1];
  loop[count++] = middle;
  tm_face_(b, from, count, loop);
  tm_face_(b, to, count, loop);
  for (int h = 0; h < 2; h++) {
    const int64_t corner[2] = {tm_mean_id_(m, num_tets, 1, &from), tm_mean_id_(m, num_tets, 1, &to)};

    tm_face_(b, h ? from : to, 3, (int64_t[]){corner[!h], middle, centre[h]});
    tm_face_(b, h ? to : from, 3, (int64_t[]){middle, corner[h], centre[h]});
  }
}

/* All wedges of the tetrahedra of a lattice, sorted by edge; *mean, [num_tets][3], gets the tetrahedra's centres. */
static inline tm_wedge_ *tm_wedges_(const int n[3], double **mean)
{
  static const int even[6][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}};
  const int64_t    num_tets   = (int64_t)6 * n[0] * n[1] * n[2];
  tm_wedge_       *wedge      = tm_alloc_(6 * num_tets, sizeof *wedge);
  int              kuhn[6][4];

  tm_kuhn_(kuhn);
  *mean = tm_alloc_(3 * num_tets, sizeof **mean);
  for (int64_t tet = 0; tet < num_tets; tet++) {
    const int64_t box    = tet / 6;
    const int     ijk[3] = {(int)(box % n[0]), (int)(box / n[0] % n[1]), (int)(box / n[0] / n[1])};
    int64_t       v[4];

    for (int h = 0; h < 4; h++) {
      const int c = kuhn[tet % 6][h], at[3] = {ijk[0] + (c & 1), ijk[1] + (c >> 1 & 1), ijk[2] + (c >> 2)};

      v[h] = ((int64_t)at[2] * (n[1] + 1) + at[1]) * (n[0] + 1) + at[0];
      for (int d = 0; d < 3; d++) (*mean)[3 * tet + d] += .25 * at[d] / n[d];
    }
    for (int e = 0; e < 6; e++) {
      const int64_t a = v[even[e][0]], z = v[even[e][1]], left = v[even[e][2]], right = v[even[e][3]];

      wedge[6 * tet + e] = a < z ? (tm_wedge_){a, z, left, right, tet} : (tm_wedge_){z, a, right, left, tet};
    }
  }
  qsort(wedge, (size_t)(6 * num_tets), sizeof *wedge, tm_by_edge_);
  return wedge;
}

/* The dual of tm_tetrahedra(n): a polyhedron about every node, with a face for every edge (up to 26 faces of up to 9 nodes),
 * closed by triangles on the boundary. */
static inline tm_mesh *tm_dual(const int n[3], tm_map map, const void *data)
{
  const int     m[3]     = {n[0] + 1, n[1] + 1, n[2] + 1};
  const int64_t num_tets = (int64_t)6 * n[0] * n[1] * n[2], side[3] = {6 * n[0] + 1, 6 * n[1] + 1, 6 * n[2] + 1};
  double       *mean;
  tm_wedge_    *wedge = tm_wedges_(n, &mean);
  tm_builder_   b     = {.num_cells = (int64_t)m[0] * m[1] * m[2]};
  int64_t      *id;
  tm_mesh      *mesh;

  for (int64_t begin = 0, end; begin < 6 * num_tets; begin = end) {
    for (end = begin + 1; end < 6 * num_tets && tm_by_edge_(&wedge[begin], &wedge[end]) == 0;) end++;
    tm_add_dual_edge_(&b, m, num_tets, wedge + begin, (int)(end - begin));
  }
  mesh = tm_finish_(&b, num_tets + side[0] * side[1] * side[2], &id);
  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    int64_t sixths = id[v] - num_tets;

    for (int d = 0; d < 3; d++) {
      mesh->xyz[3 * v + d] = id[v] < num_tets ? mean[3 * id[v] + d] : (double)(sixths % side[d]) / (6 * n[d]);
      sixths /= side[d];
    }
  }
  tm_move(mesh, map, data);
  free(wedge);
  free(mean);
  free(id);
  return mesh;
}
#endif
