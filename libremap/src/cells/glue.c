/* glue -- cells from polygons: two sides of polygons belong to one cell if they face each other around an edge. Around most
 * edges the labels tell which do, for every label is there twice; around others, where a cell touches itself, the polygons
 * are ordered by exact signs. The shells that result are cells, unless one winds the other way: that is a void in another of
 * its label. Edges between pieces of one face are noted on the way. O(n log n) for n polygon sides. */
#include "cells/cells_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FEW = 8 };

typedef struct work {
  rm_arena          *arena, *scratch;
  const rm_part     *part;
  const rm_limit    *l;
  const rm_polygons *p;
  rm_reason         *reason;
  rm_lid            *parent; /* [2 num polygons] of a side, not above it; then shell, then cell */
  float            (*low)[3]; /* [num_spots] rm_spot_low, once sides are joined                   */
  bool               warped; /* joints are wanted that are not coplanar                         */
  rm_glued          *out;
  rm_keyed          *key, *spare; /* of edges with many polygons; malloc'ed */
  struct spoke      *spoke;
  int64_t            key_room, spare_room, spoke_room;
} work;

static rm_lid root(rm_lid *parent, rm_lid k)
{
  while (parent[k] != k) k = parent[k] = parent[parent[k]];
  return k;
}

static void join(work *w, rm_lid a, rm_lid b)
{
  a = root(w->parent, a), b = root(w->parent, b);
  if (a < b) w->parent[b] = a;
  else w->parent[a] = b;
}

static inline rm_label label_of(const work *w, rm_lid side) { return rm_polygon_label(w->l, w->p, side / 2, side & 1); }
static inline bool same_label(rm_label a, rm_label b) { return a.cell[0] == b.cell[0] && a.cell[1] == b.cell[1]; }
static inline uint64_t label_key(rm_label a) { return (uint64_t)(uint32_t)(a.cell[0] + 1) << 32 | (uint32_t)(a.cell[1] + 1); }
static inline bool is_outside(rm_label a) { return a.cell[0] == RM_OUTSIDE && a.cell[1] == RM_OUTSIDE; }

/* ---- around an edge ---------------------------------------------------------------------------------------------- */

/* The left (0) or right (1) side of an arc's polygon. */
static inline rm_lid side_of(const rm_arc *arc, int h) { return (arc->polygon & ~1) + h; }

/* The refusal of cells that do not fit together around an edge: which name the two labels have in different cells, if any. */
static remap_status misfit(const work *w, rm_label a, rm_label b)
{
  const int    side = a.cell[0] != b.cell[0] ? 0 : a.cell[1] != b.cell[1] ? 1 : a.cell[0] >= 0 ? 0 : 1;
  const rm_lid c    = a.cell[side] >= 0 ? a.cell[side] : b.cell[side];

  return rm_fail(REMAP_BAD_MESH, w->reason, side, c >= 0 ? w->part->piece[side].cell_global[c] : -1,
                 "the faces around an edge of this cell do not bound cells: cells of its mesh overlap or are inverted; a "
                 "supermesh needs cells that do not and are not");
}

/* Join the sides that face each other if every label is there twice; false if one is not. */
static bool join_few(work *w, const rm_arc *arc, rm_lid n)
{
  uint64_t key[2 * FEW];
  rm_lid   pair[FEW][2], num = 0;
  unsigned done = 0; /* bits */

  for (rm_lid k = 0; k < 2 * n; k++) key[k] = label_key(label_of(w, side_of(&arc[k / 2], k & 1)));
  for (rm_lid k = 0; k < 2 * n; k++) {
    int times = 0;
    if (!key[k] || done >> k & 1) continue;
    for (rm_lid m = k + 1; m < 2 * n; m++)
      if (key[m] == key[k]) pair[num][1] = m, times++;
    if (times != 1) return false;
    done |= 1u << pair[num][1];
    pair[num++][0] = k;
  }
  for (rm_lid i = 0; i < num; i++)
    join(w, side_of(&arc[pair[i][0] / 2], pair[i][0] & 1), side_of(&arc[pair[i][1] / 2], pair[i][1] & 1));
  return true;
}

/* The same of many, by sorting. */
static remap_status join_many(work *w, const rm_arc *arc, rm_lid n, bool *joined)
{
  RM_TRY(rm_grow(&w->key, &w->key_room, 2 * (int64_t)n, sizeof *w->key));
  RM_TRY(rm_grow(&w->spare, &w->spare_room, 2 * (int64_t)n, sizeof *w->spare));
  for (rm_lid k = 0; k < 2 * n; k++) {
    const rm_lid side = side_of(&arc[k / 2], k & 1);
    w->key[k] = (rm_keyed){label_key(label_of(w, side)), side};
  }
  rm_sort_keyed(w->key, w->spare, 2 * (int64_t)n);
  *joined = true;
  for (rm_lid k = 0, next; k < 2 * n && *joined; k = next) {
    for (next = k + 1; next < 2 * n && w->key[next].key == w->key[k].key;) next++;
    *joined = !w->key[k].key || next == k + 2;
  }
  for (rm_lid k = 0; k < 2 * n && *joined; k++)
    if (w->key[k].key && k + 1 < 2 * n && w->key[k + 1].key == w->key[k].key)
      join(w, (rm_lid)w->key[k].item, (rm_lid)w->key[k + 1].item);
  return REMAP_OK;
}

/* The edge between two vertices, -1. Edges ascend. O(log n). */
static rm_lid edge_between(const rm_trimesh *m, rm_lid a, rm_lid b)
{
  const rm_lid v[2] = {a < b ? a : b, a < b ? b : a};
  rm_lid       low  = 0, high = m->num_edges;

  while (low < high) {
    const rm_lid  middle = low + (high - low) / 2;
    const rm_lid *e      = m->edge[middle];

    if (e[0] < v[0] || (e[0] == v[0] && e[1] < v[1])) low = middle + 1;
    else high = middle;
  }
  return low < m->num_edges && m->edge[low][0] == v[0] && m->edge[low][1] == v[1] ? low : -1;
}

/* An edge of a mesh on which both spots lie; false if there is none. */
static bool common_edge(const rm_limit *l, rm_lid p, rm_lid q, const double *line[2])
{
  for (int side = 0; side < 2; side++) {
    const rm_trimesh *m = l->mesh[side];
    const rm_feature  f = l->spot[p].at[side], g = l->spot[q].at[side];
    rm_lid            e = -1;

    if (f.kind == RM_ON_EDGE && rm_on_edge(l, side, q, f.id)) e = f.id;
    else if (g.kind == RM_ON_EDGE && rm_on_edge(l, side, p, g.id)) e = g.id;
    else if (f.kind == RM_ON_VERTEX && g.kind == RM_ON_VERTEX) e = edge_between(m, f.id, g.id);
    if (e < 0) continue;
    for (int h = 0; h < 2; h++) line[h] = m->vertex[m->edge[e][h]];
    return true;
  }
  return false;
}

/* A corner of polygon g's triangle on the polygon's side of the line, which runs as the polygon does; NULL if there is none. */
static const double *corner_of(const work *w, rm_lid g, const double a[3], const double b[3])
{
  const rm_lid      own = w->p->own[g];
  const rm_trimesh *m   = w->l->mesh[own & 1];
  const rm_lid     *v   = m->triangle[own / 2];
  double            o[3];

  rm_off_plane(m->vertex[v[0]], m->vertex[v[1]], m->vertex[v[2]], o);
  for (int h = 0; h < 3; h++)
    if (rm_orient3d(a, b, m->vertex[v[h]], o) > 0) return m->vertex[v[h]];
  return NULL;
}

typedef struct spoke {
  const double *corner;
  int           quarter; /* of a turn from the first: 0 below half, 1 half, 2 above */
  rm_lid        arc;
} spoke;

/* Order the polygons around the line from a to b. */
static remap_status order_spokes(work *w, const rm_arc *arc, rm_lid n, const double a[3], const double b[3])
{
  RM_TRY(rm_grow(&w->spoke, &w->spoke_room, n, sizeof *w->spoke));
  for (rm_lid k = 0; k < n; k++) {
    const bool against = arc[k].polygon & 1;
    spoke      x       = {corner_of(w, arc[k].polygon / 2, against ? b : a, against ? a : b), 0, k};
    rm_lid     i       = k;

    if (!x.corner) return misfit(w, label_of(w, side_of(&arc[k], 0)), label_of(w, side_of(&arc[k], 0)));
    const int turn = k ? rm_orient3d(a, b, w->spoke[0].corner, x.corner) : 1;
    x.quarter      = k == 0 ? -1 : turn > 0 ? 0 : turn == 0 ? 1 : 2;
    for (; i > 0; i--) {
      const spoke *y = &w->spoke[i - 1];
      if (y->quarter < x.quarter || (y->quarter == x.quarter && rm_orient3d(a, b, y->corner, x.corner) >= 0)) break;
      w->spoke[i] = *y;
    }
    w->spoke[i] = x;
  }
  return REMAP_OK;
}

static remap_status join_by_angle(work *w, rm_lid p, const rm_arc *arc, rm_lid n)
{
  const rm_lid   q     = arc[0].high;
  const rm_label first = label_of(w, side_of(&arc[0], 0));
  const double  *line[2];
  int            sign = 0;

  if (!common_edge(w->l, p, q, line)) return misfit(w, first, first);
  for (int k = 0; k < 3 && !sign; k++)
    if (line[0][k] != line[1][k]) sign = rm_compare(w->l, q, p, k) * (line[1][k] > line[0][k] ? 1 : -1);
  RM_TRY(order_spokes(w, arc, n, line[sign > 0 ? 0 : 1], line[sign > 0 ? 1 : 0])); /* from low to high */
  for (rm_lid k = 0; k < n; k++) {
    const rm_arc  *x = &arc[w->spoke[k].arc], *y = &arc[w->spoke[(k + 1) % n].arc];
    const rm_lid   front = side_of(x, !(x->polygon & 1)), back = side_of(y, y->polygon & 1);
    const rm_label a = label_of(w, front), b = label_of(w, back);
    if (!same_label(a, b)) return misfit(w, a, b);
    if (!is_outside(a)) join(w, front, back);
  }
  return REMAP_OK;
}

/* ---- between pieces of a face ------------------------------------------------------------------------------------ */

/* True if some face has a part in both triangles, or in copies of them; two of -1 are alike. */
static bool same_face(const rm_limit *l, int side, rm_lid a, rm_lid b)
{
  const rm_trimesh *m    = l->mesh[side];
  const rm_lid     *copy = l->first_copy[side];

  if (a == b) return true;
  if (a < 0 || b < 0) return false;
  for (rm_lid x = a; x < m->num_triangles && copy[x] == a; x++)
    for (rm_lid y = b; y < m->num_triangles && copy[y] == b; y++)
      for (int h = 0; h < 4; h++) {
        const rm_lid f = m->triangle_face[x][h & 1];
        if (f >= 0 && f == m->triangle_face[y][h >> 1]) return true;
      }
  return false;
}

static bool coplanar(const rm_limit *l, int side, rm_lid a, rm_lid b)
{
  const rm_trimesh *m = l->mesh[side];
  const rm_lid     *v = m->triangle[a];

  for (int h = 0; h < 3 && a != b; h++)
    if (rm_orient3d(m->vertex[v[0]], m->vertex[v[1]], m->vertex[v[2]], m->vertex[m->triangle[b][h]]) != 0) return false;
  return true;
}

/* Note the edge if the two polygons, which alone have it, are pieces of one face. Their cells are the same if their labels
 * are. */
static remap_status note_joint(work *w, const rm_arc *arc)
{
  const rm_polygons *p = w->p;
  const rm_lid       x = arc[0].polygon / 2, y = arc[1].polygon / 2;
  const int          side = p->own[x] & 1;
  rm_joint           joint = {{x, y}, {0, 0}, false};

  if (side != (p->own[y] & 1)) return REMAP_OK;
  for (int h = 0; h < 2; h++)
    if (!same_face(w->l, h, rm_polygon_triangle(p, x, h), rm_polygon_triangle(p, y, h))) return REMAP_OK;
  const rm_label a[2] = {label_of(w, 2 * x), label_of(w, 2 * x + 1)}, b[2] = {label_of(w, 2 * y), label_of(w, 2 * y + 1)};
  const bool     turned = !same_label(a[0], b[0]);
  if (!same_label(a[0], b[turned]) || !same_label(a[1], b[!turned])) return REMAP_OK;
  joint.coplanar = coplanar(w->l, side, p->own[x] / 2, p->own[y] / 2);
  if (!joint.coplanar && !w->warped) return REMAP_OK;
  for (int h = 0; h < 2; h++) joint.corner[h] = p->first[joint.polygon[h]] + (uint32_t)arc[h].place;
  RM_TRY(rm_grow(&w->out->joint, &w->out->joint_room, w->out->num_joints + 1, sizeof *w->out->joint));
  w->out->joint[w->out->num_joints++] = joint;
  return REMAP_OK;
}

static remap_status visit_edge(void *user, rm_lid low, const rm_arc *arc, rm_lid n)
{
  work *w      = user;
  bool  joined = false;

  if (n <= FEW) joined = join_few(w, arc, n);
  else RM_TRY(join_many(w, arc, n, &joined));
  if (!joined) RM_TRY(join_by_angle(w, low, arc, n));
  return n == 2 ? note_joint(w, arc) : REMAP_OK;
}

/* ---- shells ------------------------------------------------------------------------------------------------------ */

static inline double largest(const double x[3]) { return fmax(fabs(x[0]), fmax(fabs(x[1]), fabs(x[2]))); }

/* From spot o to spot p, as if both had not been rounded. */
static inline void between(const work *w, rm_lid o, rm_lid p, double out[3])
{
  const double *a = w->l->xyz[o], *b = w->l->xyz[p];
  const float  *c = w->low[o], *d = w->low[p];

  for (int k = 0; k < 3; k++) out[k] = (b[k] - a[k]) + ((double)d[k] - (double)c[k]);
}

/* Six times the volume of the cone from spot o over polygon g; if noise is not NULL, a bound of its error is added to
 * *noise. */
static double cone(const work *w, rm_lid g, rm_lid o, double *noise)
{
  const rm_lid *v = rm_polygon_loop(w->p, g), n = rm_polygon_size(w->p, g);
  double        a[3], b[3], c[3], sum = 0;

  between(w, o, v[0], a);
  between(w, o, v[1], b);
  for (rm_lid i = 2; i < n; i++) {
    between(w, o, v[i], c);
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
    const double reach = noise ? fmax(largest(a), fmax(largest(b), largest(c))) : 0;
    if (noise)
      *noise +=
          reach * reach *
          (0x1p-46 * reach + 16 * ((double)w->l->error[v[0]] + (double)w->l->error[v[i - 1]] + (double)w->l->error[v[i]]));
    memcpy(b, c, sizeof b);
  }
  return sum;
}

/* Solid angle of polygon g seen from o. */
static double solid_angle(const work *w, rm_lid g, const double o[3])
{
  const rm_lid *v = rm_polygon_loop(w->p, g), n = rm_polygon_size(w->p, g);
  double        d[3][3], r[3], sum = 0;

  for (rm_lid i = 2; i < n; i++) {
    const rm_lid x[3] = {v[0], v[i - 1], v[i]};
    for (int h = 0; h < 3; h++) {
      for (int k = 0; k < 3; k++) d[h][k] = w->l->xyz[x[h]][k] - o[k];
      r[h] = sqrt(d[h][0] * d[h][0] + d[h][1] * d[h][1] + d[h][2] * d[h][2]);
    }
    const double det = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) + d[0][1] * (d[1][2] * d[2][0] - d[1][0] * d[2][2]) +
                       d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
    double dot[3];
    for (int h = 0; h < 3; h++)
      dot[h] = d[h][0] * d[(h + 1) % 3][0] + d[h][1] * d[(h + 1) % 3][1] + d[h][2] * d[(h + 1) % 3][2];
    sum += 2 * atan2(det, r[0] * r[1] * r[2] + dot[0] * r[2] + dot[1] * r[0] + dot[2] * r[1]);
  }
  return sum;
}

typedef struct shells {
  rm_lid    num;
  rm_lid   *of; /* [sides] shell of a root, RM_OUTSIDE */
  rm_lid   *first_side;
  rm_lid   *inside; /* the shell whose void it is, or itself */
  rm_label *label;
  double   *volume;
  bool     *is_void; /* winds the other way, beyond rounding */
  double  (*box)[6]; /* these only if there are voids */
  rm_lid   *side_offset, *side;
} shells;

/* A vertex of the shell. */
static rm_lid origin_of(const work *w, const shells *s, rm_lid shell)
{
  return rm_polygon_loop(w->p, s->first_side[shell] / 2)[0];
}

/* Number the trees that parents make: from now on `of` has a side's shell in their place. A parent is never above its child, so
 * it has been numbered before. */
static remap_status number_shells(work *w, shells *s)
{
  const rm_lid sides = (rm_lid)(2 * w->p->num);

  s->of = w->parent;
  for (rm_lid k = 0; k < sides; k++) s->num += s->of[k] == k && !is_outside(label_of(w, k));
  RM_NEW(s->first_side, w->scratch, s->num);
  s->num = 0;
  for (rm_lid k = 0; k < sides; k++) {
    if (s->of[k] < k) {
      s->of[k] = s->of[s->of[k]];
    } else if (is_outside(label_of(w, k))) {
      s->of[k] = RM_OUTSIDE;
    } else {
      s->first_side[s->num] = k;
      s->of[k]              = s->num++;
    }
  }
  return REMAP_OK;
}

static remap_status collect_shells(work *w, shells *s)
{
  const rm_lid sides = (rm_lid)(2 * w->p->num);
  double      *noise;
  bool         any = false;

  RM_TRY(number_shells(w, s));
  RM_NEW(s->inside, w->scratch, s->num);
  RM_NEW(s->label, w->scratch, s->num);
  RM_NEW0(s->volume, w->scratch, s->num);
  RM_NEW(s->is_void, w->scratch, s->num);
  for (rm_lid k = 0; k < s->num; k++) s->inside[k] = k, s->label[k] = label_of(w, s->first_side[k]);
  for (rm_lid k = 0; k < sides; k++)
    if (s->of[k] >= 0) s->volume[s->of[k]] += (k & 1 ? -1 : 1) / 6. * cone(w, k / 2, origin_of(w, s, s->of[k]), NULL);
  for (rm_lid k = 0; k < s->num; k++) {
    s->is_void[k] = s->volume[k] < 0;
    any           = any || s->is_void[k];
  }
  if (!any) return REMAP_OK;
  RM_NEW0(noise, w->scratch, s->num);
  for (rm_lid k = 0; k < sides; k++)
    if (s->of[k] >= 0 && s->is_void[s->of[k]]) cone(w, k / 2, origin_of(w, s, s->of[k]), &noise[s->of[k]]);
  for (rm_lid k = 0; k < s->num; k++) s->is_void[k] = s->is_void[k] && 6 * s->volume[k] < -noise[k];
  return REMAP_OK;
}

/* Boxes of all shells, and the sides of each. */
static remap_status file_sides(work *w, shells *s)
{
  const rm_lid sides = (rm_lid)(2 * w->p->num);

  RM_NEW(s->box, w->scratch, s->num);
  RM_NEW0(s->side_offset, w->scratch, (int64_t)s->num + 2);
  RM_NEW(s->side, w->scratch, sides);
  for (rm_lid k = 0; k < s->num; k++)
    for (int c = 0; c < 3; c++) s->box[k][c] = INFINITY, s->box[k][c + 3] = -INFINITY;
  for (rm_lid side = 0; side < sides; side++) {
    if (s->of[side] < 0) continue;
    s->side_offset[s->of[side] + 2]++;
    for (uint32_t k = w->p->first[side / 2]; k < w->p->first[side / 2 + 1]; k++)
      for (int c = 0; c < 3; c++) {
        double      *box = s->box[s->of[side]];
        const double x   = w->l->xyz[w->p->vertex[k]][c];
        box[c] = x < box[c] ? x : box[c], box[c + 3] = x > box[c + 3] ? x : box[c + 3];
      }
  }
  for (rm_lid k = 0; k < s->num; k++) s->side_offset[k + 2] += s->side_offset[k + 1];
  for (rm_lid side = 0; side < sides; side++)
    if (s->of[side] >= 0) s->side[s->side_offset[s->of[side] + 1]++] = side;
  return REMAP_OK;
}

/* How often shell x winds about a point, times 4 pi. */
static double winding(const work *w, const shells *s, rm_lid x, const double p[3])
{
  double angle = 0;

  for (rm_lid k = s->side_offset[x]; k < s->side_offset[x + 1]; k++)
    angle += (s->side[k] & 1 ? -1 : 1) * solid_angle(w, s->side[k] / 2, p);
  return angle;
}

/* The solid shell among list[0..n) around a void: the only one whose box holds a vertex of it, or else the one that winds
 * about that the most. */
static rm_lid shell_around(const work *w, const shells *s, rm_lid hollow, const rm_keyed *list, int64_t n)
{
  const double *p = w->l->xyz[origin_of(w, s, hollow)], at[6] = {p[0], p[1], p[2], p[0], p[1], p[2]};
  rm_lid        best = -1;
  double        most = NAN; /* of the best one, if it is known */

  for (int64_t k = 0; k < n; k++) {
    const rm_lid x = (rm_lid)list[k].item;
    if (s->is_void[x] || !rm_box_meets(s->box[x], at)) continue;
    if (best >= 0) {
      const double angle = winding(w, s, x, p);
      if (isnan(most)) most = winding(w, s, best, p);
      if (angle <= most) continue;
      most = angle;
    }
    best = x;
  }
  return best >= 0 ? best : hollow;
}

static remap_status place_voids(work *w, shells *s)
{
  rm_keyed *key, *spare;
  bool      any = false;

  for (rm_lid k = 0; k < s->num; k++) any = any || s->is_void[k];
  if (!any) return REMAP_OK;
  RM_TRY(file_sides(w, s));
  RM_NEW(key, w->scratch, s->num);
  RM_NEW(spare, w->scratch, s->num);
  for (rm_lid k = 0; k < s->num; k++) key[k] = (rm_keyed){label_key(s->label[k]), k};
  rm_sort_keyed(key, spare, s->num);
  for (int64_t k = 0, next; k < s->num; k = next) {
    for (next = k + 1; next < s->num && key[next].key == key[k].key;) next++;
    for (int64_t i = k; i < next && next > k + 1; i++) {
      const rm_lid x = (rm_lid)key[i].item;
      if (s->is_void[x]) s->inside[x] = shell_around(w, s, x, key + k, next - k);
    }
  }
  return REMAP_OK;
}

/* A void in nothing: an inverted cell. */
static remap_status inverted(const work *w, rm_label label)
{
  const int side = label.cell[0] >= 0 ? 0 : 1;

  return rm_fail(REMAP_BAD_MESH, w->reason, side, w->part->piece[side].cell_global[label.cell[side]],
                 "a part of this cell is inverted%s; a supermesh needs cells that are not",
                 label.cell[0] >= 0 && label.cell[1] >= 0 ? ", or the cell of the other mesh that it meets is" : "");
}

static remap_status number_cells(work *w, shells *s)
{
  const rm_lid sides = (rm_lid)(2 * w->p->num);
  rm_lid      *cell_of;
  rm_label    *label;
  double      *volume;

  RM_NEW(cell_of, w->scratch, s->num);
  RM_NEW(label, w->arena, s->num);
  RM_NEW0(volume, w->arena, s->num);
  w->out->num_cells = 0;
  for (rm_lid k = 0; k < s->num; k++) {
    if (s->inside[k] != k) continue;
    if (s->is_void[k]) return inverted(w, s->label[k]);
    label[w->out->num_cells] = s->label[k];
    cell_of[k]               = w->out->num_cells++;
  }
  for (rm_lid k = 0; k < s->num; k++) {
    cell_of[k] = cell_of[s->inside[k]];
    volume[cell_of[k]] += s->volume[k];
  }
  for (rm_lid k = 0; k < sides; k++) s->of[k] = s->of[k] < 0 ? RM_OUTSIDE : cell_of[s->of[k]];
  w->out->cell   = s->of;
  w->out->label  = label;
  w->out->volume = volume;
  return REMAP_OK;
}

static remap_status glue(work *w)
{
  shells s = {0};

  RM_NEW(w->parent, w->arena, 2 * w->p->num);
  for (rm_lid k = 0; k < 2 * w->p->num; k++) w->parent[k] = k;
  RM_TRY(rm_each_edge(w->l->num_spots, w->p, visit_edge, w));
  RM_TRY(rm_spot_low(w->scratch, w->l, &w->low));
  RM_TRY(collect_shells(w, &s));
  RM_TRY(place_voids(w, &s));
  return number_cells(w, &s);
}

remap_status rm_glue(rm_arena *arena, const rm_part *part, const rm_limit *l, const rm_polygons *p, bool warped, rm_glued *out,
                     rm_reason *reason)
{
  work         w = {.arena = arena, .scratch = rm_arena_new(), .part = part, .l = l, .p = p, .reason = reason,
                    .warped = warped, .out = out};
  remap_status status = w.scratch ? glue(&w) : REMAP_NO_MEMORY;

  free(w.key);
  free(w.spare);
  free(w.spoke);
  rm_arena_drop(w.scratch);
  return status;
}
