/* skin -- does the skin of a mesh pass through a cell of the other (DESIGN 3, coverage)? Exact where planes coincide.
 *
 * A skin that lies in the cell's own faces, with the same side outward, does not pass through it: so meshes of one domain
 * cover each other. Simulation of simplicity puts such a skin just outside the cell, where it leaves no polygon, or just
 * inside; then the polygon's area has to be that which its triangle shares with the cell's. O(polygons x triangles of the
 * cell), by a box tree for cells of many triangles. */
#include <math.h>

#include "moments/moments_private.h"

/* ---- what two coplanar triangles have in common -------------------------------------------------------------------------- */

/* The corners of a triangle, turned so that they run counterclockwise seen along the axis. */
static void corners(const rm_trimesh *m, rm_lid t, int axis, const double *out[4])
{
  const bool turned = rm_moments_normal_sign(m, t, axis) < 0;

  for (int h = 0; h < 4; h++) out[h] = m->vertex[m->triangle[t][turned ? (3 - h) % 3 : h % 3]];
}

/* Side of point c against the line p -> q, where c (shift = 1) or the line (shift = -1) is moved by (e, e^2) in the plane
 * across the axis: never 0 for points p and q that differ there. */
static int flat_side(const double *p, const double *q, const double *c, int axis, int shift)
{
  const int x = (axis + 1) % 3, y = (axis + 2) % 3, sign = rm_cross_sign(p, q, p, c, axis);

  if (sign) return sign;
  if (p[y] != q[y]) return q[y] > p[y] ? -shift : shift;
  return q[x] > p[x] ? shift : -shift;
}

/* The strips of a's edges within b. of_b[e][f] is the side of b's corner f against a's edge e, of_a[f][e] the reverse. */
static int strips_of(const double *const a[4], const double *const b[4], int of_b[3][4], int of_a[3][4], strip *out)
{
  int n = 0;

  for (int e = 0; e < 3; e++) {
    strip s      = {.p = a[e], .q = a[e + 1]};
    bool  begins = of_a[0][e] > 0 && of_a[1][e] > 0 && of_a[2][e] > 0;
    for (int f = 0; f < 3; f++) {
      if (of_a[f][e] == of_a[f][e + 1] || of_b[e][f] == of_b[e][f + 1]) continue;
      if (of_a[f][e] < 0)
        s.from[0] = b[f], s.from[1] = b[f + 1], begins = true;
      else
        s.to[0] = b[f], s.to[1] = b[f + 1];
    }
    if (begins) out[n++] = s;
  }
  return n;
}

/* Append the boundary of what triangles t and b share to the n strips, b thought of as moved infinitesimally; the new
 * number. */
static int64_t add_common(work *w, int mesh, rm_lid t, rm_lid b, int axis, int64_t n)
{
  const double *a[4], *c[4];
  int           of_c[3][4], of_a[3][4];

  if ((w->status = rm_grow(&w->strip, &w->strip_room, n + 6, sizeof *w->strip)) != REMAP_OK) return n;
  corners(w->o->mesh[mesh], t, axis, a);
  corners(w->o->mesh[1 - mesh], b, axis, c);
  for (int e = 0; e < 3; e++)
    for (int f = 0; f < 4; f++) {
      of_c[e][f] = flat_side(a[e], a[e + 1], c[f], axis, 1);
      of_a[e][f] = flat_side(c[e], c[e + 1], a[f], axis, -1);
    }
  n += strips_of(a, c, of_c, of_a, w->strip + n);
  return n + strips_of(c, a, of_a, of_c, w->strip + n);
}

/* ---- the cell's triangles in the plane of a skin triangle ---------------------------------------------------------------- */

/* A skin triangle t of mesh `mesh` in the pair of cells cell[2], and what is found for it. */
typedef struct search {
  work         *w;
  const rm_lid *cell;
  int           mesh, axis;
  rm_lid        t;
  bool          is_flat, is_same;
  int64_t       num_strips;
} search;

/* +1 if the normals of coplanar triangles t and b out of their cells point the same way, -1 if opposite. */
static int facing(const search *s, rm_lid b)
{
  const rm_trimesh *m = s->w->o->mesh[s->mesh], *k = s->w->o->mesh[1 - s->mesh];
  const int         same = rm_moments_normal_sign(m, s->t, s->axis) * rm_moments_normal_sign(k, b, s->axis);
  return (m->side[s->t][0] == s->cell[s->mesh]) == (k->side[b][0] == s->cell[1 - s->mesh]) ? same : -same;
}

/* Simulation of simplicity puts t on the inner side of the coplanar triangle b. */
static bool is_just_inside(const search *s, rm_lid b)
{
  const rm_trimesh *own = s->w->o->mesh[s->mesh], *other = s->w->o->mesh[1 - s->mesh];
  const rm_lid     *v    = other->triangle[b];
  const int         side = rm_point_side(other->vertex[v[0]], other->vertex[v[1]], other->vertex[v[2]],
                                         own->vertex[own->triangle[s->t][0]], s->mesh ? -1 : 1, NULL);
  return other->side[b][0] == s->cell[1 - s->mesh] ? side < 0 : side > 0;
}

static bool is_same_triangle(const search *s, rm_lid b)
{
  const rm_trimesh *m = s->w->o->mesh[s->mesh], *k = s->w->o->mesh[1 - s->mesh];

  for (int h = 0; h < 3; h++) { /* corners ascend in both */
    const double *p = m->vertex[m->triangle[s->t][h]], *q = k->vertex[k->triangle[b][h]];
    if (p[0] != q[0] || p[1] != q[1] || p[2] != q[2]) return false;
  }
  return true;
}

static int look_at(void *user, rm_lid b)
{
  search           *s = user;
  const rm_trimesh *k = s->w->o->mesh[1 - s->mesh];

  if (k->side[b][0] != s->cell[1 - s->mesh] && k->side[b][1] != s->cell[1 - s->mesh]) return 0;
  if (!rm_moments_coplanar(s->w, s->mesh, s->t, 1 - s->mesh, b) || !rm_moments_normal_sign(k, b, s->axis)) return 0;
  if (!is_just_inside(s, b) || (!s->is_flat && facing(s, b) < 0)) return 0;
  if (is_same_triangle(s, b)) s->is_same = true;
  s->num_strips = add_common(s->w, s->mesh, s->t, b, s->axis, s->num_strips);
  return s->is_same || s->w->status != REMAP_OK;
}

static remap_status need_tree(work *w, int mesh)
{
  const rm_trimesh *m = w->o->mesh[mesh];
  double(*box)[6];

  if (w->tree[mesh]) return REMAP_OK;
  RM_NEW(box, w->scratch, m->num_triangles);
  for (rm_lid t = 0; t < m->num_triangles; t++)
    for (int c = 0; c < 3; c++) {
      const double x = m->vertex[m->triangle[t][0]][c], y = m->vertex[m->triangle[t][1]][c],
                   z = m->vertex[m->triangle[t][2]][c];
      box[t][c]      = fmin(x, fmin(y, z));
      box[t][c + 3]  = rm_max(x, rm_max(y, z));
    }
  w->triangle_box[mesh] = box;
  return rm_boxtree_build(w->scratch, m->num_triangles, (const double(*)[6])box, &w->tree[mesh]);
}

enum { MANY = 256 };

static void find_coplanar(search *s)
{
  work             *w     = s->w;
  const int         other = 1 - s->mesh;
  const rm_trimesh *m = w->o->mesh[s->mesh], *k = w->o->mesh[other];
  const rm_lid      first = k->cell_triangle_offset[s->cell[other]], end = k->cell_triangle_offset[s->cell[other] + 1];
  double            box[6] = {1, 1, 1, -1, -1, -1}; /* coordinates are below 1 in magnitude */

  for (rm_lid a = first; a < end && end - first <= MANY; a++)
    if (look_at(s, k->cell_triangle[a] / 2)) return;
  if (end - first <= MANY || (w->status = need_tree(w, other)) != REMAP_OK) return;
  for (int h = 0; h < 3; h++)
    for (int c = 0; c < 3; c++) {
      box[c]     = fmin(box[c], m->vertex[m->triangle[s->t][h]][c]);
      box[c + 3] = rm_max(box[c + 3], m->vertex[m->triangle[s->t][h]][c]);
    }
  rm_boxtree_query(w->tree[other], (const double(*)[6])w->triangle_box[other], box, look_at, s);
}

/* -------------------------------------------------------------------------------------------------------------------------- */

/* Triangle t's plane does not cut the other cell: what there is of t in the cell lies in its faces. */
static bool is_beside(const search *s)
{
  const rm_trimesh *m = s->w->o->mesh[s->mesh], *k = s->w->o->mesh[1 - s->mesh];
  const rm_lid     *v = m->triangle[s->t], c = s->cell[1 - s->mesh];
  bool              above = false, below = false;

  for (rm_lid a = k->cell_vertex_offset[c]; a < k->cell_vertex_offset[c + 1] && !(above && below); a++) {
    const int side = rm_orient3d(m->vertex[v[0]], m->vertex[v[1]], m->vertex[v[2]], k->vertex[k->cell_vertex[a]]);
    above |= side > 0;
    below |= side < 0;
  }
  return above != below;
}

/* The polygon has area beyond what its triangle shares with triangles of the other cell in its plane. */
static bool passes(work *w, rm_lid i, const slot *s, polygon *g, bool is_flat)
{
  const rm_lid      cell[2] = {i, s->target};
  const rm_trimesh *own     = w->o->mesh[g->mesh];
  const int         axis    = rm_moments_axis(own, g->triangle);
  search            f       = {.w = w, .cell = cell, .mesh = g->mesh, .axis = axis, .t = g->triangle, .is_flat = is_flat};
  exact_sum         area    = {.axis = axis, .origin = own->vertex[own->triangle[g->triangle][0]]};

  if (axis < 0 || is_beside(&f)) return false;
  find_coplanar(&f);
  if (w->status != REMAP_OK || f.is_same) return false;
  if (f.num_strips == 0 && rm_moments_has_area(w, i, s, g)) return true;
  rm_moments_settle(w, g);
  for (int k = g->first_side; k >= 0; k = w->side[k].next) {
    if ((w->status = rm_grow(&w->left, &w->left_room, area.num_sides + 1, sizeof *w->left)) != REMAP_OK) return false;
    w->left[area.num_sides++] = k;
  }
  area.side       = w->left;
  area.strip      = w->strip;
  area.num_strips = f.num_strips;
  area.strip_sign = 1;
  if (rm_moments_is_zero(w, &area)) return false;
  area.strip_sign = -1; /* the polygon runs one way or the other */
  return f.num_strips == 0 || !rm_moments_is_zero(w, &area);
}

bool rm_moments_skin_passes(work *w, rm_lid i, const slot *s, int mesh, bool is_flat)
{
  for (int k = s->first_polygon; k >= 0; k = w->polygon[k].next) {
    polygon *g = &w->polygon[k];
    if (g->mesh == mesh && w->o->mesh[mesh]->triangle_is_skin[g->triangle] && passes(w, i, s, g, is_flat)) return true;
  }
  return false;
}
