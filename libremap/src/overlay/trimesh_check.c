/* trimesh_check -- tests every invariant of a triangulated piece. Each list is compared with what the triangles themselves say:
 * a list of the right length whose entries are right and ascend is complete. O(n), O(cells' edges squared) for the cells' own
 * numbering, O(n log n) for the tree. */
#include "overlay/overlay.h"

#include <math.h>
#include <string.h>

/* Corners that bound edge h of a triangle. */
static const int low_corner[3] = {0, 1, 0}, high_corner[3] = {1, 2, 2};

static inline bool holds(const rm_lid *list, int64_t first, int64_t last, rm_lid x)
{
  for (int64_t k = first; k < last; k++)
    if (list[k] == x) return true;
  return false;
}

static int compare_lids(const rm_lid *a, const rm_lid *b, int n)
{
  for (int k = 0; k < n; k++)
    if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
  return 0;
}

static void empty_box(double box[6])
{
  for (int c = 0; c < 3; c++) box[c] = INFINITY, box[c + 3] = -INFINITY;
}
static void widen_box(double box[6], const double p[3])
{
  for (int c = 0; c < 3; c++) box[c] = fmin(box[c], p[c]), box[c + 3] = fmax(box[c + 3], p[c]);
}
static bool same_box(const double a[6], const double b[6])
{
  for (int c = 0; c < 6; c++)
    if (a[c] != b[c]) return false;
  return true;
}

/* ---- entities ---------------------------------------------------------------------------------------------------- */

static bool vertices_are_right(const rm_trimesh *m, const rm_frame *frame)
{
  double   box[6];
  uint64_t last_key = 0;

  empty_box(box);
  for (rm_lid v = 0; v < m->num_vertices; v++) {
    const double  *p = m->vertex[v], *q = m->vertex[v ? v - 1 : 0];
    const uint64_t key = rm_morton(frame, p);
    int            c   = 0;

    for (int a = 0; a < 3; a++)
      if (!isfinite(p[a]) || (p[a] == 0 && signbit(p[a]))) return false;
    while (c < 2 && p[c] == q[c]) c++;
    if (v && (key < last_key || (key == last_key && p[c] <= q[c]))) return false;
    last_key = key;
    widen_box(box, p);
  }
  return same_box(box, m->box);
}

/* The rounded normal is within its rounding of the exact one, component by component. */
static bool normal_is_right(const rm_trimesh *m, rm_lid t)
{
  const double *a = m->vertex[m->triangle[t][0]], *b = m->vertex[m->triangle[t][1]], *c = m->vertex[m->triangle[t][2]];
  double        length = 0;

  for (int k = 0; k < 3; k++) length = fmax(length, fmax(fabs(b[k] - a[k]), fabs(c[k] - a[k])));
  for (int k = 0; k < 3; k++) {
    double end[3] = {a[0], a[1], a[2]};
    end[k] += length > 0 ? length : 1; /* det[b - a, c - a, end - a] is the normal's component times the step */
    const rm_dd  d    = rm_det_dd(a, b, c, end);
    const double step = end[k] - a[k];
    if (!(fabs(m->normal[t][k] * step - d.hi) <= 0x1p-48 * length * length * step)) return false;
  }
  return true;
}

/* The cell of a triangle that has one side. */
static rm_lid only_cell(const rm_lid side[2]) { return side[side[0] == RM_OUTSIDE]; }

/* Copies of one triangle stand side by side, are no two that would have joined, and have one side each. */
static bool triangles_are_right(const rm_trimesh *m)
{
  for (rm_lid t = 0; t < m->num_triangles; t++) {
    const rm_lid *v = m->triangle[t], *side = m->side[t];
    const int     order     = t ? compare_lids(m->triangle[t - 1], v, 3) : -1;
    const bool    one_sided = side[0] == RM_OUTSIDE || side[1] == RM_OUTSIDE;

    if (v[0] < 0 || v[0] >= v[1] || v[1] >= v[2] || v[2] >= m->num_vertices || order > 0) return false;
    if (side[0] < RM_OUTSIDE || side[1] < RM_OUTSIDE || side[0] >= m->num_cells || side[1] >= m->num_cells) return false;
    if (side[0] == RM_OUTSIDE && side[1] == RM_OUTSIDE) return false;
    if (m->triangle_is_skin[t] > one_sided || !normal_is_right(m, t)) return false;
    if (order) continue;
    if (!one_sided || (m->side[t - 1][0] != RM_OUTSIDE && m->side[t - 1][1] != RM_OUTSIDE)) return false;
    const bool alone = (t < 2 || compare_lids(m->triangle[t - 2], v, 3)) &&
                       (t + 1 == m->num_triangles || compare_lids(m->triangle[t + 1], v, 3));
    const bool opposite = (side[0] == RM_OUTSIDE) != (m->side[t - 1][0] == RM_OUTSIDE);
    const bool of_whole = rm_facet_next(m, t) != t || rm_facet_next(m, t - 1) != t - 1; /* joined together or not at all */
    if (alone && opposite && !of_whole && only_cell(side) != only_cell(m->side[t - 1])) return false;
  }
  return true;
}

static bool edges_are_right(const rm_trimesh *m)
{
  for (rm_lid t = 0; t < m->num_triangles; t++)
    for (int h = 0; h < 3; h++) {
      const rm_lid e = m->triangle_edge[t][h];
      if (e < 0 || e >= m->num_edges) return false;
      if (m->edge[e][0] != m->triangle[t][low_corner[h]] || m->edge[e][1] != m->triangle[t][high_corner[h]]) return false;
    }
  if (m->star_offset[0] != 0 || m->star_offset[m->num_edges] != 3 * m->num_triangles) return false;
  for (rm_lid e = 0; e < m->num_edges; e++) {
    if (e && compare_lids(m->edge[e - 1], m->edge[e], 2) >= 0) return false;
    if (m->star_offset[e] >= m->star_offset[e + 1]) return false;
    for (rm_lid k = m->star_offset[e]; k < m->star_offset[e + 1]; k++) {
      const rm_lid s = m->star[k];
      if (s < 0 || s / 4 >= m->num_triangles || (s & 3) == 3 || m->triangle_edge[s / 4][s & 3] != e) return false;
      if (k > m->star_offset[e] && m->star[k - 1] >= s) return false;
    }
  }
  return true;
}

static bool vertex_edges_are_right(const rm_trimesh *m)
{
  if (m->vertex_edge_offset[0] != 0 || m->vertex_edge_offset[m->num_vertices] != 2 * m->num_edges) return false;
  for (rm_lid v = 0; v < m->num_vertices; v++)
    for (rm_lid k = m->vertex_edge_offset[v]; k < m->vertex_edge_offset[v + 1]; k++) {
      const rm_lid e = m->vertex_edge[k];
      if (e < 0 || e >= m->num_edges || (m->edge[e][0] != v && m->edge[e][1] != v)) return false;
      if (k > m->vertex_edge_offset[v] && m->vertex_edge[k - 1] >= e) return false;
    }
  return true;
}

/* ---- facets ------------------------------------------------------------------------------------------------------ */

/* Triangle s and what its facet is called by have the same cells beside them, on the same sides, and the same plane. */
static bool belongs_to(const rm_trimesh *m, rm_lid s, rm_lid facet)
{
  const rm_lid *side = m->side[facet / 2], *v = m->triangle[facet / 2], turned = facet & 1;
  bool          flat = true;

  for (int h = 0; h < 3; h++)
    flat = flat && rm_orient3d(m->vertex[v[0]], m->vertex[v[1]], m->vertex[v[2]], m->vertex[m->triangle[s][h]]) == 0;
  return flat && m->side[s][0] == side[turned] && m->side[s][1] == side[!turned];
}

/* How many triangles of the facet of t have edge e. */
static int times_in_facet(const rm_trimesh *m, rm_lid t, rm_lid e)
{
  rm_lid s = t;
  int    n = 0;

  do {
    for (int h = 0; h < 3; h++) n += m->triangle_edge[s][h] == e;
    s = rm_facet_next(m, s);
  } while (s != t);
  return n;
}

static bool facets_are_right(const rm_trimesh *m)
{
  for (rm_lid t = 0; t < m->num_triangles; t++) {
    const rm_lid facet = rm_facet_of(m, t), next = rm_facet_next(m, t);
    rm_lid       s = t, num = 0;

    if (facet < 0 || facet / 2 >= m->num_triangles || next < 0 || next >= m->num_triangles) return false;
    if (rm_facet_of(m, facet / 2) != facet - (facet & 1) || rm_facet_of(m, next) / 2 != facet / 2) return false;
    if (!belongs_to(m, t, facet) || (next != t && m->triangle_is_skin[t])) return false;
    while (num < RM_MAX_SIDES && (num == 0 || s != t)) s = rm_facet_next(m, s), num++;
    if (s != t) return false;
    for (int h = 0; h < 3; h++)
      if (times_in_facet(m, t, m->triangle_edge[t][h]) != 1 + rm_is_inner(m, t, h)) return false;
  }
  return true;
}

/* The ring of edge e is its star, less what is inside facets, by facets. */
static bool ring_is_right(const rm_trimesh *m, rm_lid e)
{
  rm_lid at = m->ring_offset[e];

  for (rm_lid k = m->star_offset[e]; k < m->star_offset[e + 1]; k++) {
    const rm_lid t = m->star[k] / 4, facet = rm_facet_of(m, t);
    const int    h = m->star[k] & 3;

    if (rm_is_inner(m, t, h)) continue;
    if (at == m->ring_offset[e + 1] || m->ring[at] / 4 != facet / 2) return false;
    if ((m->ring[at] >> 1 & 1) != ((h == 2) ^ (facet & 1))) return false;
    at++;
  }
  return at == m->ring_offset[e + 1];
}

/* The panels of cell c are its triangles, those of quadrangles by two, with their corners about the normal. */
static bool panels_are_right(const rm_trimesh *m, rm_lid c)
{
  const rm_lid first = m->cell_vertex_offset[c];
  rm_lid       num = 0, at = m->panel_offset[c];

  if (!m->panel_corner) return m->panel == m->cell_triangle && m->panel_offset == m->cell_triangle_offset;
  for (rm_lid a = m->cell_triangle_offset[c]; a < m->cell_triangle_offset[c + 1] && m->cell_vertex_offset[c + 1] > first; a++) {
    const rm_lid   t = m->cell_triangle[a] / 2, s = rm_facet_next(m, t);
    const bool     is_half = s != t && rm_facet_next(m, s) == t;
    const uint8_t *v = m->panel_corner[at];
    rm_lid         x[4];

    if (is_half && rm_facet_of(m, t) / 2 != t) continue;
    if (at == m->panel_offset[c + 1] || m->panel[at++] != m->cell_triangle[a]) return false;
    for (int h = 0; h < 4; h++) x[h] = m->cell_vertex[first + v[h]];
    if (!is_half && (compare_lids(x, m->triangle[t], 3) || v[3] != v[2])) return false;
    for (int h = 0; h < 4 && is_half; h++) { /* corners run as those of t do, and each side is one of the facet's */
      const rm_lid p = x[h], q = x[(h + 1) & 3];
      rm_lid       e = m->vertex_edge_offset[p];

      while (e < m->vertex_edge_offset[p + 1] && m->edge[m->vertex_edge[e]][0] != q && m->edge[m->vertex_edge[e]][1] != q) e++;
      if (e == m->vertex_edge_offset[p + 1] || times_in_facet(m, t, m->vertex_edge[e]) != 1) return false;
      num += h < 3 && x[h] == m->triangle[t][num];
    }
    if (is_half && num < 2) return false;
    num = 0;
  }
  return at == m->panel_offset[c + 1];
}

/* ---- cells ------------------------------------------------------------------------------------------------------- */

static bool cell_triangles_are_right(const rm_trimesh *m)
{
  int64_t num_sides = 0;

  for (rm_lid t = 0; t < m->num_triangles; t++) num_sides += (m->side[t][0] >= 0) + (m->side[t][1] >= 0);
  if (m->cell_triangle_offset[0] != 0 || m->cell_triangle_offset[m->num_cells] != num_sides) return false;
  for (rm_lid c = 0; c < m->num_cells; c++) {
    double box[6];

    empty_box(box);
    for (rm_lid a = m->cell_triangle_offset[c]; a < m->cell_triangle_offset[c + 1]; a++) {
      const rm_lid x = m->cell_triangle[a];
      if (x < 0 || x / 2 >= m->num_triangles || m->side[x / 2][x & 1] != c) return false;
      if (a > m->cell_triangle_offset[c] && m->cell_triangle[a - 1] >= x) return false;
      for (int h = 0; h < 3; h++) widen_box(box, m->vertex[m->triangle[x / 2][h]]);
    }
    if (!same_box(box, m->cell_box[c])) return false;
  }
  return true;
}

/* Every edge of every cell is used as often one way as the other. balance is [num_edges], all 0. */
static bool cells_are_closed(const rm_trimesh *m, int *balance)
{
  for (rm_lid c = 0; c < m->num_cells; c++) {
    const rm_lid first = m->cell_triangle_offset[c], last = m->cell_triangle_offset[c + 1];
    bool         closed = true;

    for (rm_lid a = first; a < last; a++)
      for (int h = 0; h < 3; h++)
        balance[m->triangle_edge[m->cell_triangle[a] / 2][h]] += (h == 2) != (m->cell_triangle[a] & 1) ? -1 : 1;
    for (rm_lid a = first; a < last; a++)
      for (int h = 0; h < 3; h++) {
        int *b = &balance[m->triangle_edge[m->cell_triangle[a] / 2][h]];
        closed = closed && *b == 0;
        *b     = 0;
      }
    if (!closed) return false;
  }
  return true;
}

/* The numbering of vertices within cell c, if it has one. */
static bool local_numbers_are_right(const rm_trimesh *m, rm_lid c)
{
  const rm_lid first = m->cell_vertex_offset[c], num = m->cell_vertex_offset[c + 1] - first;
  const rm_lid begin = m->cell_triangle_offset[c], end = m->cell_triangle_offset[c + 1];

  if (num < 0 || m->cell_walk[c] > RM_WALK_NOT) return false;
  if (num == 0) return m->cell_walk[c] == RM_WALK_NOT;
  for (rm_lid v = 0; v < num; v++) {
    bool used = false;
    for (rm_lid a = begin; a < end && !used; a++)
      for (int h = 0; h < 3; h++) used |= m->cell_triangle_vertex[a][h] == v;
    if (!used || holds(m->cell_vertex, first, first + v, m->cell_vertex[first + v])) return false;
  }
  for (rm_lid a = begin; a < end; a++)
    for (int h = 0; h < 3; h++) {
      const int place = m->cell_triangle_vertex[a][h];
      if (place >= num || m->cell_vertex[first + place] != m->triangle[m->cell_triangle[a] / 2][h]) return false;
    }
  return true;
}

/* ---- skin -------------------------------------------------------------------------------------------------------- */

typedef struct wanted {
  rm_lid item;
} wanted;

static int is_wanted(void *user, rm_lid item) { return item == ((const wanted *)user)->item; }

static bool skin_is_right(const rm_trimesh *m)
{
  rm_lid s = 0;

  for (rm_lid t = 0; t < m->num_triangles; t++) {
    double box[6];
    wanted self = {s};

    if (m->side[t][0] >= 0 && m->side[t][1] >= 0) continue;
    if (s == m->num_skin || m->skin[s] != t) return false;
    empty_box(box);
    for (int h = 0; h < 3; h++) widen_box(box, m->vertex[m->triangle[t][h]]);
    if (!same_box(box, m->skin_box[s]) || !rm_boxtree_query(m->skin_tree, m->skin_box, box, is_wanted, &self)) return false;
    s++;
  }
  return s == m->num_skin && m->skin_tree->num_items == s;
}

remap_status rm_trimesh_check(const rm_frame *frame, const rm_trimesh *mesh)
{
  rm_arena    *scratch = rm_arena_new();
  int         *balance = scratch ? rm_arena_zero(scratch, mesh->num_edges, sizeof *balance) : NULL;
  remap_status status  = balance ? REMAP_OK : REMAP_NO_MEMORY;

  if (status == REMAP_OK &&
      !(vertices_are_right(mesh, frame) && triangles_are_right(mesh) && edges_are_right(mesh) && vertex_edges_are_right(mesh) &&
        facets_are_right(mesh) && cell_triangles_are_right(mesh) && cells_are_closed(mesh, balance) && skin_is_right(mesh)))
    status = REMAP_INTERNAL;
  for (rm_lid e = 0; e < mesh->num_edges && status == REMAP_OK; e++)
    if (!ring_is_right(mesh, e)) status = REMAP_INTERNAL;
  for (rm_lid c = 0; c < mesh->num_cells && status == REMAP_OK; c++)
    if (!local_numbers_are_right(mesh, c) || !panels_are_right(mesh, c)) status = REMAP_INTERNAL;
  rm_arena_drop(scratch);
  return status;
}
