/* moments -- volumes and moments of all pairs, from segments and pieces of edges (DESIGN 2.4, 2.6).
 *
 * The boundary of i n j consists of polygons in the triangles of i and of j. Each polygon contributes the cone over it from a local
 * origin O, the centre of the meeting of the two cells' boxes, summed over the polygon's sides p -> q: the signed volume of the
 * tetrahedron (O, r, p, q), with r the foot of the perpendicular from O on the triangle's plane. All terms are of the size of the
 * pair, wherever it lies and however large its cells are. A point is its edge's first vertex plus lambda times the edge, and is
 * taken relative to O before anything is multiplied.
 *
 * Cost: four cones per segment and cell beside it, two per piece of an edge and triangle at it; 45 operations per cone. */
#include "moments/moments.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "geom/expansion.h"

#if defined(__GNUC__)
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
#endif

enum {
  FROM_SOURCE = 1, /* the pair has pieces of edges of mesh 1 */
  FROM_TARGET = 2, /* of mesh 2                              */
  FROM_BOTH   = 4, /* it has segments                        */
  SKIN_SOURCE = 8, /* one of its polygons lies in the skin of mesh 1 */
  SKIN_TARGET = 16,
  AGAIN       = 32 /* to be summed again in double-double    */
};

/* Sums of one pair: 6 V, 24 M, 120 S about o. */
typedef struct slot {
  rm_lid  target;
  int32_t num_cones;
  int     kinds;
  int     first_polygon; /* of the pair in work.polygon, -1 */
  double  o[3];
  double  reach; /* largest extent of the meeting of the boxes */
  double  sum[10];
} slot;

/* A side of a polygon ends in a vertex or in a crossing of an edge. */
typedef struct point {
  const double *base;     /* the edge's first vertex, or the vertex  */
  double        delta[3]; /* from there; 0 for a vertex              */
  int           mesh;     /* of the edge                             */
  rm_lid        edge;     /* -1 for a vertex                         */
  rm_lid        triangle; /* of the other mesh, crossed by the edge  */
} point;

/* The plane a polygon lies in. */
typedef struct plane {
  int           mesh;
  rm_lid        triangle;
  const double *n, *v;   /* normal, a vertex */
  double        inverse; /* 1 / n.n, 0 for a triangle without area */
} plane;

/* One polygon of a pair, for the decision whether the pair has volume. */
typedef struct polygon {
  int     next; /* of the same pair, -1 */
  int     mesh;
  rm_lid  triangle;
  int32_t num_cones;
  double  area; /* twice, times the normal's magnitude, outward or not as the cones' signs say */
  double  first[3]; /* one of its vertices, relative to the pair's origin */
  double  reach;    /* largest distance of the others from it, by any one coordinate */
} polygon;

/* A crossing in double-double, relative to its edge's first vertex. */
typedef struct memo {
  int    mesh;
  rm_lid edge, triangle;
  rm_dd  delta[3];
} memo;

enum { NUM_MEMOS = 256 };

typedef struct work {
  const rm_part    *part;
  const rm_overlay *o;
  rm_arena         *scratch;
  int               num_sums; /* 4 or 10 */
  int64_t          *piece_offset; /* [cells of mesh 1 + 1] pieces of edges of mesh 2 in them */
  rm_lid          (*piece)[2];    /* edge, number of the piece on it */
  rm_lid           *slot_of;      /* [cells of mesh 2] -1 */
  slot             *slots;
  int64_t           slots_room;
  int               num_slots;
  polygon          *polygon;
  int64_t           polygon_room;
  int               num_polygons;
  rm_dd           (*exact)[10]; /* [num_slots] sums of those marked AGAIN */
  int64_t           exact_room;
  memo             *memo; /* [NUM_MEMOS] */
  remap_status      status;
  /* the result */
  rm_lid           *source, *target;
  double           *volume, (*moment)[3], (*second)[6];
  uint8_t          *flags;
  int64_t           num_pairs, room[6];
} work;

/* ---- slots ------------------------------------------------------------------------------------------------------- */

static slot *new_slot(work *w, rm_lid i, rm_lid j)
{
  const double *a = w->o->mesh[0]->cell_box[i], *b = w->o->mesh[1]->cell_box[j];
  slot         *s;

  if (w->num_slots == w->slots_room && (w->status = rm_grow(&w->slots, &w->slots_room, w->num_slots + 64, sizeof *w->slots))) return NULL;
  s = &w->slots[w->num_slots];
  memset(s, 0, sizeof *s);
  s->target        = j;
  s->first_polygon = -1;
  for (int c = 0; c < 3; c++) {
    const double low = a[c] > b[c] ? a[c] : b[c], high = a[c + 3] < b[c + 3] ? a[c + 3] : b[c + 3];
    s->o[c] = low + 0.5 * (high - low);
    if (high - low > s->reach) s->reach = high - low;
  }
  w->slot_of[j] = w->num_slots++;
  return s;
}

INLINE slot *find_slot(work *w, rm_lid i, rm_lid j) { return w->slot_of[j] >= 0 ? &w->slots[w->slot_of[j]] : new_slot(w, i, j); }

/* ---- what a cone adds --------------------------------------------------------------------------------------------- */

typedef void sink(work *w, rm_lid i, rm_lid j, int kind, double sign, const plane *pl, const point *p, const point *q);

INLINE void relative(const point *p, const double o[3], double out[3])
{
  for (int c = 0; c < 3; c++) out[c] = (p->base[c] - o[c]) + p->delta[c];
}

/* n.(p x q) for p and q relative to the slot's origin, and the plane's height over it times |n|. */
INLINE double side_area(const slot *s, const plane *pl, const double p[3], const double q[3], double *height)
{
  const double *n = pl->n, *v = pl->v;

  *height = n[0] * (v[0] - s->o[0]) + n[1] * (v[1] - s->o[1]) + n[2] * (v[2] - s->o[2]);
  return n[0] * (p[1] * q[2] - p[2] * q[1]) + n[1] * (p[2] * q[0] - p[0] * q[2]) + n[2] * (p[0] * q[1] - p[1] * q[0]);
}

INLINE void add_cone_of_degree(work *w, rm_lid i, rm_lid j, int kind, double sign, const plane *pl, const point *p, const point *q,
                               bool with_second)
{
  slot  *s = find_slot(w, i, j);
  double a[3], b[3], height;

  if (!s) return;
  relative(p, s->o, a);
  relative(q, s->o, b);
  const double area = side_area(s, pl, a, b, &height), foot = height * pl->inverse, six_v = sign * area * foot;
  double       r[3], sum[3];
  s->num_cones++;
  s->kinds |= kind;
  s->sum[0] += six_v;
  for (int c = 0; c < 3; c++) {
    r[c]   = pl->n[c] * foot;
    sum[c] = r[c] + a[c] + b[c];
    s->sum[1 + c] += six_v * sum[c];
  }
  if (with_second)
    for (int k = 0; k < 6; k++) {
      static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
      const int        x = row[k], y = column[k];
      s->sum[4 + k] += six_v * (r[x] * r[y] + a[x] * a[y] + b[x] * b[y] + sum[x] * sum[y]);
    }
}

INLINE void add_cone(work *w, rm_lid i, rm_lid j, int kind, double sign, const plane *pl, const point *p, const point *q)
{
  add_cone_of_degree(w, i, j, kind, sign, pl, p, q, false);
}
INLINE void add_cone_2(work *w, rm_lid i, rm_lid j, int kind, double sign, const plane *pl, const point *p, const point *q)
{
  add_cone_of_degree(w, i, j, kind, sign, pl, p, q, true);
}

/* The polygon's area, for pairs that are in doubt. */
static void add_polygon(work *w, rm_lid i, rm_lid j, int kind, double sign, const plane *pl, const point *p, const point *q)
{
  slot         *s = &w->slots[w->slot_of[j]];
  const double *n = pl->n;
  double        a[3], b[3];
  polygon      *g = NULL;

  (void)i, (void)kind;
  if (s->first_polygon == -1 || w->status != REMAP_OK) return;
  for (int k = s->first_polygon; k >= 0; k = w->polygon[k].next)
    if (w->polygon[k].triangle == pl->triangle && w->polygon[k].mesh == pl->mesh) {
      g = &w->polygon[k];
      break;
    }
  relative(p, s->o, a);
  relative(q, s->o, b);
  if (!g) {
    if ((w->status = rm_grow(&w->polygon, &w->polygon_room, w->num_polygons + 1, sizeof *w->polygon)) != REMAP_OK) return;
    g  = &w->polygon[w->num_polygons];
    *g = (polygon){s->first_polygon, pl->mesh, pl->triangle, 0, 0, {a[0], a[1], a[2]}, 0};
    s->first_polygon = w->num_polygons++;
  }
  for (int c = 0; c < 3; c++) {
    a[c] -= g->first[c];
    b[c] -= g->first[c];
    g->reach = fmax(g->reach, fmax(fabs(a[c]), fabs(b[c])));
  }
  g->area += sign * (n[0] * (a[1] * b[2] - a[2] * b[1]) + n[1] * (a[2] * b[0] - a[0] * b[2]) + n[2] * (a[0] * b[1] - a[1] * b[0]));
  g->num_cones++;
}

/* ---- enumeration of the cones of cell i ---------------------------------------------------------------------------- */

INLINE point vertex_point(const rm_trimesh *m, rm_lid v) { return (point){m->vertex[v], {0, 0, 0}, 0, -1, -1}; }

INLINE point crossing_point(const rm_overlay *o, int mesh, rm_lid e, int64_t x)
{
  const rm_trimesh  *m = o->mesh[mesh];
  const rm_crossing *c = &o->trace[mesh].crossing[x];
  const double      *v = m->vertex[m->edge[e][0]], *u = m->vertex[m->edge[e][1]];
  const double       l = c->lambda;

  return (point){v, {l * (u[0] - v[0]), l * (u[1] - v[1]), l * (u[2] - v[2])}, mesh, e, c->triangle / 2};
}

/* Ends of piece k of edge e, and the state in which it lies. */
INLINE rm_lid piece_ends(const rm_overlay *o, int mesh, rm_lid e, rm_lid k, point *p, point *q)
{
  const rm_trace *t = &o->trace[mesh];
  const int64_t   x = t->first[e] + k;

  *p = k == 0 ? vertex_point(o->mesh[mesh], o->mesh[mesh]->edge[e][0]) : crossing_point(o, mesh, e, x - 1);
  *q = k == t->count[e] ? vertex_point(o->mesh[mesh], o->mesh[mesh]->edge[e][1]) : crossing_point(o, mesh, e, x);
  return k == 0 ? t->state[e] : t->crossing[x - 1].state;
}

INLINE plane plane_of(const rm_overlay *o, int mesh, rm_lid t)
{
  const rm_trimesh *m = o->mesh[mesh];
  const double     *n = m->normal[t];
  const double      square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];

  return (plane){mesh, t, n, m->vertex[m->triangle[t][0]], square > 0 ? 1 / square : 0};
}

/* The edge on which an end of a segment on triangles t and b lies is found again from its crossing: the edge of b (or t) that has
 * it. Edges of a triangle are three. */
INLINE rm_lid edge_of_crossing(const rm_overlay *o, int mesh, rm_lid triangle, int64_t x)
{
  const rm_trace *t = &o->trace[mesh];
  const rm_lid   *e = o->mesh[mesh]->triangle_edge[triangle];

  for (int h = 0; h < 2; h++)
    if (x >= t->first[e[h]] && x < t->first[e[h]] + t->count[e[h]]) return e[h];
  return e[2];
}

INLINE point end_point(const rm_overlay *o, rm_lid t, rm_end end)
{
  const int     mesh = end.at >> 1 & 1;
  const int64_t x    = end.at >> 2;

  return crossing_point(o, mesh, edge_of_crossing(o, mesh, mesh ? end.other : t, x), x);
}

/* Segments in triangle t of cell i, which lies on its left (g = 1) or right (g = -1). */
INLINE void segments_in(work *w, rm_lid i, const plane *pt, double g, sink *add)
{
  const rm_overlay *o  = w->o;
  const rm_trimesh *m2 = o->mesh[1];

  for (int64_t k = o->end_offset[pt->triangle]; k < o->end_offset[pt->triangle + 1]; k += 2) {
    const rm_lid b    = o->end[k].other;
    const point  p    = end_point(o, pt->triangle, o->end[k]), q = end_point(o, pt->triangle, o->end[k + 1]);
    const plane  pb   = plane_of(o, 1, b);
    const int    kind = FROM_BOTH | (o->mesh[0]->triangle_is_skin[pt->triangle] ? SKIN_SOURCE : 0) | (m2->triangle_is_skin[b] ? SKIN_TARGET : 0);

    for (int h = 0; h < 2; h++) {
      const rm_lid j = m2->side[b][h];
      const double s = h ? -g : g;
      if (j < 0) continue;
      add(w, i, j, kind, s, pt, &p, &q);
      add(w, i, j, kind, -s, &pb, &p, &q);
    }
  }
}

/* Pieces of the edges of triangle t, which bound its polygons in the cells of mesh 2. */
INLINE void own_pieces_in(work *w, rm_lid i, const plane *pt, double g, sink *add)
{
  const rm_overlay *o  = w->o;
  const rm_trace   *tr = &o->trace[0];
  const int         kind = FROM_SOURCE | (o->mesh[0]->triangle_is_skin[pt->triangle] ? SKIN_SOURCE : 0);

  for (int h = 0; h < 3; h++) {
    const rm_lid e = o->mesh[0]->triangle_edge[pt->triangle][h];
    const double s = h == 2 ? -g : g;

    for (rm_lid k = 0; k <= tr->count[e]; k++) {
      point        p, q;
      const rm_lid state = piece_ends(o, 0, e, k, &p, &q);
      if (state >= 0) {
        add(w, i, state, kind, s, pt, &p, &q);
      } else if (state < RM_OUTSIDE) {
        for (rm_lid z = tr->list_offset[-2 - state]; z < tr->list_offset[-1 - state]; z++)
          add(w, i, tr->winding[z].cell, kind, s * tr->winding[z].number, pt, &p, &q);
      }
    }
  }
}

/* Pieces of edges of mesh 2 inside cell i. */
INLINE void foreign_pieces(work *w, rm_lid i, sink *add)
{
  const rm_overlay *o  = w->o;
  const rm_trimesh *m2 = o->mesh[1];
  const rm_trace   *tr = &o->trace[1];

  for (int64_t k = w->piece_offset[i]; k < w->piece_offset[i + 1]; k++) {
    const rm_lid f = w->piece[k][0];
    point        p, q;
    const rm_lid state = piece_ends(o, 1, f, w->piece[k][1], &p, &q);
    double       number = 1;

    if (state < RM_OUTSIDE)
      for (rm_lid z = tr->list_offset[-2 - state]; z < tr->list_offset[-1 - state]; z++)
        if (tr->winding[z].cell == i) number = tr->winding[z].number;
    for (rm_lid z = m2->star_offset[f]; z < m2->star_offset[f + 1]; z++) {
      const rm_lid b    = m2->star[z] / 4;
      const double s    = (m2->star[z] & 3) == 2 ? -number : number;
      const plane  pb   = plane_of(o, 1, b);
      const int    kind = FROM_TARGET | (m2->triangle_is_skin[b] ? SKIN_TARGET : 0);
      if (m2->side[b][0] >= 0) add(w, i, m2->side[b][0], kind, s, &pb, &p, &q);
      if (m2->side[b][1] >= 0) add(w, i, m2->side[b][1], kind, -s, &pb, &p, &q);
    }
  }
}

INLINE void all_cones(work *w, rm_lid i, sink *add)
{
  const rm_trimesh *m1 = w->o->mesh[0];

  for (rm_lid a = m1->cell_triangle_offset[i]; a < m1->cell_triangle_offset[i + 1]; a++) {
    const plane  pt = plane_of(w->o, 0, m1->cell_triangle[a] / 2);
    const double g  = m1->cell_triangle[a] & 1 ? -1 : 1;
    segments_in(w, i, &pt, g, add);
    own_pieces_in(w, i, &pt, g, add);
  }
  foreign_pieces(w, i, add);
}

/* ---- double-double -------------------------------------------------------------------------------------------------- */

static void dd_difference(const double a[3], const double b[3], rm_dd out[3])
{
  for (int c = 0; c < 3; c++) out[c] = rm_two_diff(a[c], b[c]);
}

static rm_dd dd_quotient(rm_dd a, rm_dd b)
{
  const double q0 = a.hi / b.hi;
  const rm_dd  r  = rm_dd_sub(a, rm_dd_mul(b, (rm_dd){q0, 0}));
  const double q1 = (r.hi + r.lo) / b.hi;
  return rm_quick_two_sum(q0, q1);
}

/* lambda times the edge, the parameter computed again from the coordinates. */
static void dd_delta(const rm_overlay *o, const point *p, rm_dd out[3])
{
  const rm_trimesh *own = o->mesh[p->mesh], *other = o->mesh[1 - p->mesh];
  const rm_lid     *v = other->triangle[p->triangle];
  const double     *t0 = other->vertex[v[0]];
  rm_dd             a[3], b[3], n[3], u[3], down[3];

  dd_difference(other->vertex[v[1]], t0, a);
  dd_difference(other->vertex[v[2]], t0, b);
  rm_dd_cross(a, b, n);
  dd_difference(own->vertex[own->edge[p->edge][1]], p->base, u);
  dd_difference(t0, p->base, down);
  const rm_dd along  = rm_dd_dot(n, u);
  rm_dd       lambda = along.hi != 0 ? dd_quotient(rm_dd_dot(n, down), along) : (rm_dd){0, 0}; /* as lambda has it */
  if (lambda.hi < 0) lambda = (rm_dd){0, 0};
  if (lambda.hi > 1) lambda = (rm_dd){1, 0};
  for (int c = 0; c < 3; c++) out[c] = rm_dd_mul(lambda, u[c]);
}

/* The point relative to an origin. A crossing serves several cones in a row: the last ones are remembered. */
static void dd_relative(work *w, const point *p, const double origin[3], rm_dd out[3])
{
  dd_difference(p->base, origin, out);
  if (p->edge < 0) return;
  memo *m = &w->memo[((uint32_t)p->edge * 31u + (uint32_t)p->triangle) % NUM_MEMOS];
  if (m->edge != p->edge || m->triangle != p->triangle || m->mesh != p->mesh) {
    m->edge = p->edge, m->triangle = p->triangle, m->mesh = p->mesh;
    dd_delta(w->o, p, m->delta);
  }
  for (int c = 0; c < 3; c++) out[c] = rm_dd_add(out[c], m->delta[c]);
}

static void add_cone_dd(work *w, rm_lid i, rm_lid j, int kind, double sign, const plane *pl, const point *p, const point *q)
{
  const slot *s = &w->slots[w->slot_of[j]];
  rm_dd      *sum = w->exact[w->slot_of[j]], r[3], a[3], b[3], cross[3];

  (void)i, (void)kind;
  if (!(s->kinds & AGAIN)) return;
  dd_difference(pl->v, s->o, r);
  dd_relative(w, p, s->o, a);
  dd_relative(w, q, s->o, b);
  rm_dd_cross(a, b, cross);
  const rm_dd six_v = rm_dd_mul(rm_dd_dot(r, cross), (rm_dd){sign, 0});
  sum[0] = rm_dd_add(sum[0], six_v);
  for (int c = 0; c < 3; c++) sum[1 + c] = rm_dd_add(sum[1 + c], rm_dd_mul(six_v, rm_dd_add(r[c], rm_dd_add(a[c], b[c]))));
  for (int k = 0; k < w->num_sums - 4; k++) {
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    const int        x = row[k], y = column[k];
    const rm_dd      sx = rm_dd_add(r[x], rm_dd_add(a[x], b[x])), sy = rm_dd_add(r[y], rm_dd_add(a[y], b[y]));
    const rm_dd      own = rm_dd_add(rm_dd_mul(r[x], r[y]), rm_dd_add(rm_dd_mul(a[x], a[y]), rm_dd_mul(b[x], b[y])));
    sum[4 + k] = rm_dd_add(sum[4 + k], rm_dd_mul(six_v, rm_dd_add(own, rm_dd_mul(sx, sy))));
  }
}

/* ---- does a pair have volume, does a skin pass through it (DESIGN 2.6) ------------------------------------------------- */

static double largest_extent(const double box[6])
{
  return fmax(box[3] - box[0], fmax(box[4] - box[1], box[5] - box[2]));
}

/* Extent of what the pair's points are computed from: edges and faces of i, of j. */
static double operand_extent(const work *w, rm_lid i, const slot *s)
{
  const double a = largest_extent(w->o->mesh[0]->cell_box[i]), b = largest_extent(w->o->mesh[1]->cell_box[s->target]);
  return (s->kinds & (FROM_SOURCE | FROM_BOTH) ? a : 0) + (s->kinds & (FROM_TARGET | FROM_BOTH) ? b : 0) + s->reach;
}

/* Forward error of 6 V: in units of u = 2^-53, a point errs by 4 extents, a plane's height by 6, a cone's double area by 3 sqrt(3)
 * reach^2 at most: together less than 2^7 extent reach^2 per cone. */
static double volume_noise(const work *w, rm_lid i, const slot *s)
{
  return 0x1p-46 * (s->num_cones + 1) * s->reach * s->reach * operand_extent(w, i, s);
}

/* The polygon has area beyond rounding: its points err by 4 extents, in units of u, however small it is itself. */
static bool has_area(const work *w, rm_lid i, const slot *s, const polygon *g)
{
  const double *n = w->o->mesh[g->mesh]->normal[g->triangle];
  const double  length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  return fabs(g->area) > 0x1p-46 * (g->num_cones + 1) * g->reach * operand_extent(w, i, s) * length;
}

static bool coplanar(const work *w, int mesh_a, rm_lid a, int mesh_b, rm_lid b)
{
  const rm_trimesh *m = w->o->mesh[mesh_a], *k = w->o->mesh[mesh_b];
  const rm_lid     *v = m->triangle[a];

  for (int c = 0; c < 3; c++)
    if (rm_orient3d(m->vertex[v[0]], m->vertex[v[1]], m->vertex[v[2]], k->vertex[k->triangle[b][c]]) != 0) return false;
  return true;
}

/* +1 if the normals of triangles a and b out of their cells, cell[mesh], point the same way, -1 if opposite; for coplanar ones. */
static int facing(const work *w, const rm_lid cell[2], int mesh_a, rm_lid a, int mesh_b, rm_lid b)
{
  const rm_trimesh *m = w->o->mesh[mesh_a], *k = w->o->mesh[mesh_b];
  const double     *n = m->normal[a], *o = k->normal[b];
  const bool        flip = (m->side[a][0] == cell[mesh_a]) != (k->side[b][0] == cell[mesh_b]);

  return (n[0] * o[0] + n[1] * o[1] + n[2] * o[2] > 0) != flip ? 1 : -1;
}

/* The polygons of the pair cancel: each one that has area meets an exactly coplanar one that has area and faces the other way. */
static bool polygons_cancel(const work *w, rm_lid i, const slot *s)
{
  const rm_lid cell[2] = {i, s->target};

  for (int k = s->first_polygon; k >= 0; k = w->polygon[k].next) {
    const polygon *g = &w->polygon[k];
    bool           found = !has_area(w, i, s, g);

    for (int l = s->first_polygon; l >= 0 && !found; l = w->polygon[l].next) {
      const polygon *h = &w->polygon[l];
      found = l != k && has_area(w, i, s, h) && coplanar(w, g->mesh, g->triangle, h->mesh, h->triangle) &&
              facing(w, cell, g->mesh, g->triangle, h->mesh, h->triangle) < 0;
    }
    if (!found) return false;
  }
  return true;
}

/* Area shared by triangles a and b projected along axis k, by clipping one at the sides of the other; computed relative to o. */
static double shared_area(const double *const a[3], const double *const b[3], int k, const double o[3])
{
  const int x = (k + 1) % 3, y = (k + 2) % 3;
  double    loop[2][8][2], area = 0;
  int       n = 3, from = 0;
  double    c[3][2];

  for (int h = 0; h < 3; h++) {
    loop[0][h][0] = a[h][x] - o[x], loop[0][h][1] = a[h][y] - o[y];
    c[h][0] = b[h][x] - o[x], c[h][1] = b[h][y] - o[y];
  }
  const double turn = (c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[1][1] - c[0][1]) * (c[2][0] - c[0][0]) < 0 ? -1 : 1;
  for (int h = 0; h < 3; h++, from = 1 - from) {
    const double *p = c[h], u[2] = {c[(h + 1) % 3][0] - p[0], c[(h + 1) % 3][1] - p[1]};
    double      (*in)[2] = loop[from], (*out)[2] = loop[1 - from];
    int           m = 0;
    for (int i = 0; i < n; i++) {
      const double *q = in[i], *r = in[(i + 1) % n];
      const double  s = turn * (u[0] * (q[1] - p[1]) - u[1] * (q[0] - p[0])), t = turn * (u[0] * (r[1] - p[1]) - u[1] * (r[0] - p[0]));
      if (s >= 0) out[m][0] = q[0], out[m][1] = q[1], m++;
      if ((s > 0 && t < 0) || (s < 0 && t > 0)) {
        const double l = s / (s - t);
        out[m][0] = q[0] + l * (r[0] - q[0]), out[m][1] = q[1] + l * (r[1] - q[1]), m++;
      }
    }
    n = m;
  }
  for (int i = 1; i + 1 < n; i++)
    area += (loop[from][i][0] - loop[from][0][0]) * (loop[from][i + 1][1] - loop[from][0][1]) -
            (loop[from][i][1] - loop[from][0][1]) * (loop[from][i + 1][0] - loop[from][0][0]);
  return fabs(area) / 2;
}

/* Simulation of simplicity puts triangle t of mesh `mesh` on the inner side of the coplanar triangle b of the other mesh's cell. */
static bool is_just_inside(const work *w, const rm_lid cell[2], int mesh, rm_lid t, rm_lid b)
{
  const rm_trimesh *other = w->o->mesh[1 - mesh];
  const rm_lid     *v     = other->triangle[b];
  const int         side  = rm_point_side(other->vertex[v[0]], other->vertex[v[1]], other->vertex[v[2]],
                                          w->o->mesh[mesh]->vertex[w->o->mesh[mesh]->triangle[t][0]], mesh ? -1 : 1, NULL);
  return other->side[b][0] == cell[1 - mesh] ? side < 0 : side > 0;
}

/* The skin of a mesh passes through the pair's cell of the other mesh: one of its polygons there has area beyond what lies in
 * coplanar triangles of that cell with the same side outward. (Coincident skins, as of two meshes of one domain, do not make a cell
 * partial. Where they are put just outside the cell they are no polygons of it; where just inside, their area is taken off.) */
static bool skin_passes(const work *w, rm_lid i, const slot *s, int mesh)
{
  const rm_lid      cell[2] = {i, s->target};
  const rm_trimesh *own = w->o->mesh[mesh], *other = w->o->mesh[1 - mesh];

  for (int l = s->first_polygon; l >= 0; l = w->polygon[l].next) {
    const polygon *g = &w->polygon[l];
    const rm_lid   t = g->triangle;

    if (g->mesh != mesh || !own->triangle_is_skin[t] || !has_area(w, i, s, g)) continue;
    const double *n = own->normal[t], square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    const double *v[3] = {own->vertex[own->triangle[t][0]], own->vertex[own->triangle[t][1]], own->vertex[own->triangle[t][2]]};
    int           k    = fabs(n[1]) > fabs(n[0]) ? 1 : 0;
    if (fabs(n[2]) > fabs(n[k])) k = 2;
    const double area = fabs(g->area) / 2 * fabs(n[k]) / square;
    double       shared = 0;
    for (rm_lid a = other->cell_triangle_offset[cell[1 - mesh]]; a < other->cell_triangle_offset[cell[1 - mesh] + 1]; a++) {
      const rm_lid b = other->cell_triangle[a] / 2;
      if (!coplanar(w, mesh, t, 1 - mesh, b) || facing(w, cell, mesh, t, 1 - mesh, b) < 0) continue;
      if (!is_just_inside(w, cell, mesh, t, b)) continue;
      const double *c[3] = {other->vertex[other->triangle[b][0]], other->vertex[other->triangle[b][1]], other->vertex[other->triangle[b][2]]};
      shared += shared_area(v, c, k, s->o);
    }
    if (shared == 0 || area - shared > 0x1p-40 * area) return true;
  }
  return false;
}

/* ---- one source cell ------------------------------------------------------------------------------------------------- */

enum { NO_POLYGONS = -1, WANTS_POLYGONS = -2 };

static remap_status push_pair(work *w, rm_lid i, const slot *s, uint8_t flags)
{
  const double *c = w->part->piece[0].cell_centroid[i];
  const double  v = s->sum[0] / 6, d[3] = {s->o[0] - c[0], s->o[1] - c[1], s->o[2] - c[2]};
  const double  m[3] = {s->sum[1] / 24, s->sum[2] / 24, s->sum[3] / 24};
  const int64_t n = w->num_pairs, need = n + 1;

  RM_TRY(rm_grow(&w->source, &w->room[0], need, sizeof *w->source));
  RM_TRY(rm_grow(&w->target, &w->room[1], need, sizeof *w->target));
  RM_TRY(rm_grow(&w->volume, &w->room[2], need, sizeof *w->volume));
  RM_TRY(rm_grow(&w->moment, &w->room[3], need, sizeof *w->moment));
  RM_TRY(rm_grow(&w->flags, &w->room[4], need, sizeof *w->flags));
  w->source[n] = i;
  w->target[n] = s->target;
  w->volume[n] = v;
  w->flags[n]  = flags;
  for (int k = 0; k < 3; k++) w->moment[n][k] = m[k] + d[k] * v;
  if (w->num_sums == 10) {
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    RM_TRY(rm_grow(&w->second, &w->room[5], need, sizeof *w->second));
    for (int k = 0; k < 6; k++) {
      const int x = row[k], y = column[k];
      w->second[n][k] = s->sum[4 + k] / 120 + (d[x] * m[y] + d[y] * m[x]) + d[x] * d[y] * v;
    }
  }
  w->num_pairs++;
  return REMAP_OK;
}

/* Sum the slots marked AGAIN in double-double, and collect the polygons of those that want them. */
static remap_status look_again(work *w, rm_lid i, bool sums, bool polygons)
{
  if (sums) {
    RM_TRY(rm_grow(&w->exact, &w->exact_room, w->num_slots, sizeof *w->exact));
    memset(w->exact, 0, sizeof *w->exact * (size_t)w->num_slots);
    all_cones(w, i, add_cone_dd);
    for (int k = 0; k < w->num_slots; k++)
      if (w->slots[k].kinds & AGAIN)
        for (int c = 0; c < w->num_sums; c++) w->slots[k].sum[c] = w->exact[k][c].hi + w->exact[k][c].lo;
  }
  if (polygons) {
    w->num_polygons = 0;
    all_cones(w, i, add_polygon);
  }
  return w->status;
}

static remap_status finish_cell(work *w, rm_lid i)
{
  const double vi = fabs(w->part->piece[0].cell_volume[i]);
  bool         sums = false, polygons = false;

  for (int k = 0; k < w->num_slots; k++) {
    slot        *s  = &w->slots[k];
    const double vj = fabs(w->part->piece[1].cell_volume[s->target]), noise = volume_noise(w, i, s);

    if (noise > 6 * 0x1p-33 * (vi < vj ? vi : vj)) s->kinds |= AGAIN, sums = true;
    if (fabs(s->sum[0]) <= noise || s->kinds & (SKIN_SOURCE | SKIN_TARGET)) s->first_polygon = WANTS_POLYGONS, polygons = true;
  }
  if (sums || polygons) RM_TRY(look_again(w, i, sums, polygons));
  for (int k = 0; k < w->num_slots; k++) {
    slot   *s = &w->slots[k];
    uint8_t flags = 0;

    w->slot_of[s->target] = -1;
    if (s->first_polygon != NO_POLYGONS) {
      if (fabs(s->sum[0]) <= volume_noise(w, i, s) && polygons_cancel(w, i, s)) continue;
      if (s->kinds & SKIN_SOURCE && skin_passes(w, i, s, 0)) flags |= RM_PAIR_SOURCE_SKIN;
      if (s->kinds & SKIN_TARGET && skin_passes(w, i, s, 1)) flags |= RM_PAIR_TARGET_SKIN;
    }
    RM_TRY(push_pair(w, i, s, flags));
  }
  w->num_slots = 0;
  return REMAP_OK;
}

/* ---- all of them ------------------------------------------------------------------------------------------------------ */

/* File the pieces of the edges of mesh 2 under the cells of mesh 1 they lie in: by counting, edges ascending. */
static remap_status file_pieces(work *w)
{
  const rm_trace *t = &w->o->trace[1];
  const rm_lid    ne = w->o->mesh[1]->num_edges, nc = w->o->mesh[0]->num_cells;

  RM_NEW0(w->piece_offset, w->scratch, (int64_t)nc + 2);
  for (int pass = 0; pass < 2; pass++) {
    for (rm_lid f = 0; f < ne; f++)
      for (rm_lid k = 0; k <= t->count[f]; k++) {
        const rm_lid     state = k ? t->crossing[t->first[f] + k - 1].state : t->state[f];
        const rm_winding one   = {state, 1};
        const rm_winding *list = state < RM_OUTSIDE ? t->winding + t->list_offset[-2 - state] : &one;
        const rm_lid      n    = state < RM_OUTSIDE ? t->list_offset[-1 - state] - t->list_offset[-2 - state] : state >= 0;
        for (rm_lid z = 0; z < n; z++) {
          if (pass == 0) {
            w->piece_offset[list[z].cell + 2]++;
          } else {
            rm_lid *piece = w->piece[w->piece_offset[list[z].cell + 1]++];
            piece[0] = f, piece[1] = k;
          }
        }
      }
    if (pass == 0) {
      for (rm_lid i = 0; i < nc; i++) w->piece_offset[i + 2] += w->piece_offset[i + 1];
      RM_NEW(w->piece, w->scratch, w->piece_offset[nc + 1]);
    }
  }
  return REMAP_OK;
}

static remap_status all_cells(work *w)
{
  RM_TRY(file_pieces(w));
  RM_NEW(w->memo, w->scratch, NUM_MEMOS);
  for (int k = 0; k < NUM_MEMOS; k++) w->memo[k].edge = -1;
  RM_NEW(w->slot_of, w->scratch, w->o->mesh[1]->num_cells);
  for (rm_lid j = 0; j < w->o->mesh[1]->num_cells; j++) w->slot_of[j] = -1;
  for (rm_lid i = 0; i < w->o->mesh[0]->num_cells; i++) {
    if (w->num_sums == 4) all_cones(w, i, add_cone);
    else all_cones(w, i, add_cone_2);
    RM_TRY(w->status);
    RM_TRY(finish_cell(w, i));
  }
  return REMAP_OK;
}

static void *kept(rm_arena *arena, const void *data, int64_t n, size_t size)
{
  void *copy = rm_arena_alloc(arena, n, size);
  if (copy && n) memcpy(copy, data, (size_t)n * size);
  return copy;
}

static remap_status keep(rm_arena *arena, const work *w, const rm_moments **out)
{
  const int64_t n = w->num_pairs;
  rm_moments   *m;

  RM_NEW0(m, arena, 1);
  m->num_pairs = n;
  m->source    = kept(arena, w->source, n, sizeof *w->source);
  m->target    = kept(arena, w->target, n, sizeof *w->target);
  m->volume    = kept(arena, w->volume, n, sizeof *w->volume);
  m->moment    = kept(arena, w->moment, n, sizeof *w->moment);
  m->flags     = kept(arena, w->flags, n, sizeof *w->flags);
  m->second    = w->num_sums == 10 ? kept(arena, w->second, n, sizeof *w->second) : NULL;
  if (!m->source || !m->target || !m->volume || !m->moment || !m->flags || (w->num_sums == 10 && !m->second)) return REMAP_NO_MEMORY;
  *out = m;
  return REMAP_OK;
}

remap_status rm_moments_build(rm_arena *arena, const rm_part *part, const rm_overlay *overlay, int degree, const rm_moments **out)
{
  work         w = {.part = part, .o = overlay, .scratch = rm_arena_new(), .num_sums = degree == 2 ? 10 : 4};
  remap_status status = w.scratch ? REMAP_OK : REMAP_NO_MEMORY;

  if (status == REMAP_OK) status = all_cells(&w);
  if (status == REMAP_OK) status = keep(arena, &w, out);
  free(w.slots);
  free(w.polygon);
  free(w.exact);
  free(w.source);
  free(w.target);
  free(w.volume);
  free(w.moment);
  free(w.second);
  free(w.flags);
  rm_arena_drop(w.scratch);
  return status;
}
