/* moments -- volumes and moments of all pairs, from segments and pieces of edges (DESIGN 2.4, 2.6).
 *
 * The boundary of i n j consists of polygons in the triangles of i and of j. Each polygon contributes the cone over it from an
 * origin O, summed over the polygon's sides p -> q: the signed volume of the tetrahedron (O, r, p, q), with r the foot of the
 * perpendicular from O on the triangle's plane. O is the centre of the box of cell i, and what j gains its neighbour beyond the
 * polygon loses, so that one product serves both; where j is much smaller than i, O is the centre of the meeting of their
 * boxes. So all terms are of the size of the smaller cell, wherever it lies. A point is its edge's first vertex plus lambda
 * times the edge, and is taken relative to O before anything is multiplied.
 *
 * Cost: two cones per segment and cell beside it in mesh 1, one per piece of an edge and facet at it, and for edges of mesh 1
 * per cell beside that; 40 operations per cone. */
#include "moments/moments_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- slots ------------------------------------------------------------------------------------------------------- */

enum { MUCH_SMALLER = 4 }; /* times smaller a cell of mesh 2 has an origin of its own with cell i */

static slot *new_slot(work *w, rm_lid i, rm_lid j)
{
  const double *a = w->o->mesh[0]->cell_box[i], *b = w->o->mesh[1]->cell_box[j];
  slot         *s;

  if (w->num_slots == w->slots_room && (w->status = rm_grow(&w->slots, &w->slots_room, w->num_slots + 64, sizeof *w->slots)))
    return NULL;
  s = &w->slots[w->num_slots];
  memset(s, 0, sizeof *s);
  s->target        = j;
  s->first_polygon = NO_POLYGONS;
  s->last_polygon  = -1;
  s->is_local      = MUCH_SMALLER * rm_max(b[3] - b[0], rm_max(b[4] - b[1], b[5] - b[2])) < w->extent;
  s->reach         = s->is_local ? 0 : w->extent;
  memcpy(s->o, w->centre, sizeof s->o);
  for (int c = 0; c < 3 && s->is_local; c++) {
    const double low = a[c] > b[c] ? a[c] : b[c], high = a[c + 3] < b[c + 3] ? a[c + 3] : b[c + 3];
    s->o[c] = low + 0.5 * (high - low);
    if (high - low > s->reach) s->reach = high - low;
  }
  w->slot_of[j] = w->num_slots++;
  return s;
}

INLINE slot *find_slot(work *w, rm_lid i, rm_lid j)
{
  return w->slot_of[j] >= 0 ? &w->slots[w->slot_of[j]] : new_slot(w, i, j);
}

/* ---- what a cone adds --------------------------------------------------------------------------------------------- */

INLINE double triple(const double n[3], const double p[3], const double q[3])
{
  return n[0] * (p[1] * q[2] - p[2] * q[1]) + n[1] * (p[2] * q[0] - p[0] * q[2]) + n[2] * (p[0] * q[1] - p[1] * q[0]);
}

/* 6 V, 24 M and, of ten sums, 120 S of the tetrahedron (O, r, p, q), with r = height n. */
INLINE void cone(const double n[3], double height, const double r[3], const double p[3], const double q[3], double sign,
                 int num_sums, double out[10])
{
  double sum[3];

  out[0] = sign * triple(n, p, q) * height;
  for (int c = 0; c < 3; c++) {
    sum[c]     = r[c] + p[c] + q[c];
    out[1 + c] = out[0] * sum[c];
  }
  for (int k = 0; k < num_sums - 4; k++) {
    const int x = rm_row_of[k], y = rm_column_of[k];
    out[4 + k] = out[0] * (r[x] * r[y] + p[x] * p[y] + q[x] * q[y] + sum[x] * sum[y]);
  }
}

/* The same about the slot's own origin, p and q being relative to that; v is a vertex in the plane. */
static __attribute__((noinline)) void add_local(slot *s, double sign, const double n[3], const double v[3], double inverse,
                                                const double p[3], const double q[3], int num_sums)
{
  double       r[3], out[10];
  const double d[3]   = {v[0] - s->o[0], v[1] - s->o[1], v[2] - s->o[2]};
  const double height = (n[0] * d[0] + n[1] * d[1] + n[2] * d[2]) * inverse;

  for (int c = 0; c < 3; c++) r[c] = n[c] * height;
  cone(n, height, r, p, q, sign, num_sums, out);
  for (int k = 0; k < num_sums; k++) s->sum[k] += out[k];
}

/* One cone to both its slots. */
INLINE void add_cone(work *w, rm_lid i, const rm_lid j[2], int kind, double sign, const plane *pl, const point *p,
                     const point *q, int num_sums)
{
  double out[10];

  cone(pl->n, pl->height, pl->foot, p->at, q->at, sign, num_sums, out);
  for (int h = 0; h < 2; h++) {
    if (j[h] < 0) continue;
    slot *s = find_slot(w, i, j[h]);
    if (!s) return;
    s->num_cones++;
    s->kinds |= kind;
    if (s->is_local) {
      double a[3], b[3];

      relative(p, s->o, a);
      relative(q, s->o, b);
      add_local(s, h ? -sign : sign, pl->n, pl->v, pl->inverse, a, b, num_sums);
    } else {
      for (int k = 0; k < num_sums; k++) s->sum[k] += h ? -out[k] : out[k];
    }
  }
}

/* The cones of a side that two polygons share, to the slots of two cells: each slot is fetched once. */
INLINE void add_two_cones(work *w, rm_lid i, const rm_lid j[2], int kind, double sign, const plane *pl, const plane *other,
                          const point *p, const point *q, int num_sums)
{
  double out[10], back[10];

  cone(pl->n, pl->height, pl->foot, p->at, q->at, sign, num_sums, out);
  cone(other->n, other->height, other->foot, p->at, q->at, -sign, num_sums, back);
  for (int h = 0; h < 2; h++) {
    if (j[h] < 0) continue;
    slot *s = find_slot(w, i, j[h]);
    if (!s) return;
    s->num_cones += 2;
    s->kinds |= kind;
    if (s->is_local) {
      double a[3], b[3];

      relative(p, s->o, a);
      relative(q, s->o, b);
      add_local(s, h ? -sign : sign, pl->n, pl->v, pl->inverse, a, b, num_sums);
      add_local(s, h ? sign : -sign, other->n, other->v, other->inverse, a, b, num_sums);
    } else {
      for (int k = 0; k < num_sums; k++) s->sum[k] = h ? (s->sum[k] - out[k]) - back[k] : (s->sum[k] + out[k]) + back[k];
    }
  }
}

INLINE void add_of_degree(work *w, rm_lid i, const rm_lid j[2], int kind, double sign, const plane *pl, const plane *other,
                          const point *p, const point *q, int num_sums)
{
  if (other && j[0] != j[1]) {
    add_two_cones(w, i, j, kind, sign, pl, other, p, q, num_sums);
  } else {
    add_cone(w, i, j, kind, sign, pl, p, q, num_sums);
    if (other) add_cone(w, i, j, kind, -sign, other, p, q, num_sums);
  }
}

INLINE void add(work *w, rm_lid i, const rm_lid j[2], int kind, double sign, const plane *pl, const plane *other,
                const point *p, const point *q)
{
  add_of_degree(w, i, j, kind, sign, pl, other, p, q, 4);
}
INLINE void add_2(work *w, rm_lid i, const rm_lid j[2], int kind, double sign, const plane *pl, const plane *other,
                  const point *p, const point *q)
{
  add_of_degree(w, i, j, kind, sign, pl, other, p, q, 10);
}

/* ---- enumeration of the polygons' sides in cell i ------------------------------------------------------------------- */

/* Points are written where they stay: a copy made at once would wait for its parts to arrive in memory. */
INLINE void set_vertex(const work *w, const rm_trimesh *m, rm_lid v, point *p)
{
  p->base = m->vertex[v];
  for (int c = 0; c < 3; c++) {
    p->delta[c] = 0;
    p->at[c]    = p->base[c] - w->centre[c];
  }
  p->mesh     = 0;
  p->edge     = -1;
  p->triangle = -1;
  p->crossing = -1;
}

INLINE void set_crossing(const work *w, int mesh, const rm_crossing *x, point *p)
{
  const rm_trimesh *m = w->o->mesh[mesh];
  const double     *v = m->vertex[m->edge[x->edge][0]], *u = m->vertex[m->edge[x->edge][1]], l = x->lambda;

  p->base = v;
  for (int c = 0; c < 3; c++) {
    p->delta[c] = l * (u[c] - v[c]);
    p->at[c]    = (v[c] - w->centre[c]) + p->delta[c];
  }
  p->mesh     = mesh;
  p->edge     = x->edge;
  p->triangle = x->triangle / 2;
  p->crossing = x - w->o->trace[mesh].crossing;
}

INLINE plane plane_of(const work *w, int mesh, rm_lid t)
{
  const rm_trimesh *m = w->o->mesh[mesh];
  const double     *n = m->normal[t], *v = m->vertex[m->triangle[t][0]], *o = w->centre;
  const double      square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2], inverse = square > 0 ? 1 / square : 0;
  const double      height = (n[0] * (v[0] - o[0]) + n[1] * (v[1] - o[1]) + n[2] * (v[2] - o[2])) * inverse;

  return (plane){mesh, t, n, v, inverse, {n[0] * height, n[1] * height, n[2] * height}, height, 1};
}

/* Segments in a facet of cell i. */
INLINE void segments_in(work *w, rm_lid i, const plane *pt, sink *add_side)
{
  const rm_overlay *o    = w->o;
  const int         skin = FROM_BOTH | (o->mesh[0]->triangle_is_skin[pt->triangle] ? SKIN_SOURCE : 0);

  for (int64_t k = o->end_offset[pt->triangle]; k < o->end_offset[pt->triangle + 1]; k += 2) {
    const rm_end start = o->end[k], end = o->end[k + 1];
    const rm_lid b     = start.other;
    if (w->skin_only && !(skin & SKIN_SOURCE) && !o->mesh[1]->triangle_is_skin[b]) continue;
    const plane  pb    = plane_of(w, 1, b);
    const int    kind  = skin | (o->mesh[1]->triangle_is_skin[b] ? SKIN_TARGET : 0);

    point        p, q;

    set_crossing(w, start.at >> 1 & 1, &o->trace[start.at >> 1 & 1].crossing[start.at >> 2], &p);
    set_crossing(w, end.at >> 1 & 1, &o->trace[end.at >> 1 & 1].crossing[end.at >> 2], &q);
    add_side(w, i, o->mesh[1]->side[b], kind, pt->outward, pt, &pb, &p, &q);
  }
}

/* Point k of an edge of `mesh`, where its piece k begins and its piece k - 1 ends. */
INLINE void set_point(const work *w, int mesh, rm_lid e, rm_lid k, point *p)
{
  const rm_trimesh *m  = w->o->mesh[mesh];
  const rm_trace   *tr = &w->o->trace[mesh];

  if (k == 0) set_vertex(w, m, m->edge[e][0], p);
  else if (k > tr->count[e]) set_vertex(w, m, m->edge[e][1], p);
  else set_crossing(w, mesh, &tr->crossing[tr->first[e] + k - 1], p);
}

INLINE rm_lid piece_state(const rm_trace *tr, rm_lid e, rm_lid k)
{
  return k == 0 ? tr->state[e] : tr->crossing[tr->first[e] + k - 1].state;
}

/* How often a cell winds about piece k of an edge. */
INLINE int piece_number(const rm_trace *tr, rm_lid e, rm_lid k, rm_lid cell)
{
  const rm_lid state = piece_state(tr, e, k);

  if (state >= RM_OUTSIDE) return state == cell;
  for (rm_lid z = tr->list_offset[-2 - state]; z < tr->list_offset[-1 - state]; z++)
    if (tr->winding[z].cell == cell) return tr->winding[z].number;
  return 0;
}

/* Pieces of an edge about which a cell winds equally often count as one: what cuts them are other cells that overlap this one,
 * and another rank need not have those. The number of the first piece behind those that begin with piece k; k if they began
 * before. */
INLINE rm_lid run_end(const rm_trace *tr, rm_lid e, rm_lid k, rm_lid cell, int number)
{
  if (k > 0 && piece_number(tr, e, k - 1, cell) == number) return k;
  do k++;
  while (k <= tr->count[e] && piece_number(tr, e, k, cell) == number);
  return k;
}

/* Piece k of edge e, and those behind it that count as one with it, where cells overlap. */
static void tangled_pieces(work *w, rm_lid i, rm_lid e, rm_lid k, int kind, double sign, const plane *pl, const plane *other,
                           sink *add_side)
{
  const rm_trace   *tr    = &w->o->trace[0];
  const rm_lid      state = piece_state(tr, e, k);
  const rm_winding  one   = {state, 1};
  const rm_winding *list  = state < RM_OUTSIDE ? tr->winding + tr->list_offset[-2 - state] : &one;
  const rm_lid      n     = state < RM_OUTSIDE ? tr->list_offset[-1 - state] - tr->list_offset[-2 - state] : state >= 0;
  point             p, q;

  set_point(w, 0, e, k, &p);
  for (rm_lid z = 0; z < n; z++) {
    const rm_lid in[2] = {list[z].cell, RM_OUTSIDE}, end = run_end(tr, e, k, in[0], list[z].number);

    if (end == k) continue;
    set_point(w, 0, e, end, &q);
    add_side(w, i, in, kind, sign * list[z].number, pl, other, &p, &q);
  }
}

/* Pieces of an edge of cell i, which bound polygons of its facets in the cells of mesh 2. */
INLINE void pieces_at(work *w, rm_lid i, const wedge *at, sink *add_side)
{
  const rm_trace *tr     = &w->o->trace[0];
  const uint8_t  *skin   = w->o->mesh[0]->triangle_is_skin;
  const plane    *along  = at->plane[0] >= 0 ? &w->own_plane[at->plane[0]] : NULL;
  const plane    *second = at->plane[1] >= 0 ? &w->own_plane[at->plane[1]] : NULL;
  const plane    *pl     = along ? along : second, *other = along ? second : NULL;
  const int       kind   = FROM_SOURCE | (skin[pl->triangle] || (other && skin[other->triangle]) ? SKIN_SOURCE : 0);
  const rm_lid    e = at->edge, count = tr->count[e];
  const double    sign   = along ? 1 : -1;
  rm_lid          before = RM_OUTSIDE, in[2] = {tr->state[e], RM_OUTSIDE};
  point           end[2]; /* of piece k: [k & 1] and the other */

  if (w->skin_only && !(kind & SKIN_SOURCE)) return;
  set_point(w, 0, e, 0, &end[0]);
  for (rm_lid k = 0; k <= count; k++) {
    const rm_lid next = k < count ? tr->crossing[tr->first[e] + k].state : RM_OUTSIDE;

    set_point(w, 0, e, k + 1, &end[~k & 1]);
    if (before < RM_OUTSIDE || in[0] < RM_OUTSIDE || next < RM_OUTSIDE || (in[0] >= 0 && (in[0] == before || in[0] == next)))
      tangled_pieces(w, i, e, k, kind, sign, pl, other, add_side);
    else
      add_side(w, i, in, kind, sign, pl, other, &end[k & 1], &end[~k & 1]);
    before = in[0];
    in[0]  = next;
  }
}

/* Pieces of edges of mesh 2 inside cell i. */
INLINE void foreign_pieces(work *w, rm_lid i, sink *add_side)
{
  const rm_trimesh *m  = w->o->mesh[1];
  const rm_trace   *tr = &w->o->trace[1];

  for (int64_t k = w->piece_offset[i]; k < w->piece_offset[i + 1]; k++) {
    const rm_lid f = w->piece[k][0], at = w->piece[k][1];
    const int    number = piece_number(tr, f, at, i);
    const rm_lid end    = run_end(tr, f, at, i, number);
    point        p, q;

    if (end == at) continue;
    set_point(w, 1, f, at, &p);
    set_point(w, 1, f, end, &q);
    for (rm_lid z = m->ring_offset[f]; z < m->ring_offset[f + 1]; z++) {
      const rm_lid b  = m->ring[z] / 4;
      if (w->skin_only && !m->triangle_is_skin[b]) continue;
      const plane  pb = plane_of(w, 1, b);

      add_side(w, i, m->side[b], FROM_TARGET | (m->triangle_is_skin[b] ? SKIN_TARGET : 0),
               m->ring[z] & 2 ? -number : number, &pb, NULL, &p, &q);
    }
  }
}

/* Edge e of cell i bounds its facet of that number, whose boundary, seen from outside of the cell, runs along it or against it.
 * An edge has one facet each way nearly always: these two are one wedge. */
static remap_status add_to_wedge(work *w, rm_lid e, int number, bool against)
{
  const int k = w->wedge_of[e];

  if (k < 0 || w->wedge[k].plane[against] >= 0) {
    RM_TRY(rm_grow(&w->wedge, &w->wedge_room, w->num_wedges + 1, sizeof *w->wedge));
    w->wedge[w->num_wedges]                = (wedge){e, {-1, -1}};
    w->wedge[w->num_wedges].plane[against] = number;
    w->wedge_of[e]                         = w->num_wedges++;
  } else {
    w->wedge[k].plane[against] = number;
  }
  return REMAP_OK;
}

/* The planes of cell i's facets, and its edges with the two facets at each: once for all that is summed of the cell. */
static remap_status open_cell(work *w, rm_lid i)
{
  const rm_trimesh *m   = w->o->mesh[0];
  const double     *box = m->cell_box[i];

  w->extent = rm_max(box[3] - box[0], rm_max(box[4] - box[1], box[5] - box[2]));
  for (int c = 0; c < 3; c++) w->centre[c] = box[c] + 0.5 * (box[c + 3] - box[c]);
  w->num_planes = w->num_wedges = 0;
  for (rm_lid a = m->cell_triangle_offset[i]; a < m->cell_triangle_offset[i + 1]; a++) {
    const rm_lid facet = m->cell_triangle[a] / 2, is_right = m->cell_triangle[a] & 1;
    rm_lid       t     = facet;

    if (rm_facet_of(m, facet) / 2 != facet) continue;
    RM_TRY(rm_grow(&w->own_plane, &w->own_plane_room, w->num_planes + 1, sizeof *w->own_plane));
    w->own_plane[w->num_planes]         = plane_of(w, 0, facet);
    w->own_plane[w->num_planes].outward = is_right ? -1 : 1;
    do {
      for (int h = 0; h < 3; h++)
        if (!rm_is_inner(m, t, h))
          RM_TRY(add_to_wedge(w, m->triangle_edge[t][h], w->num_planes, (h == 2) ^ (rm_facet_of(m, t) & 1) ^ is_right));
      t = rm_facet_next(m, t);
    } while (t != facet);
    w->num_planes++;
  }
  for (int k = 0; k < w->num_wedges; k++) w->wedge_of[w->wedge[k].edge] = -1;
  return REMAP_OK;
}

/* Hand on every side of every polygon in the open cell i. */
INLINE void all_sides(work *w, rm_lid i, sink *add_side)
{
  for (int k = 0; k < w->num_planes; k++) segments_in(w, i, &w->own_plane[k], add_side);
  for (int k = 0; k < w->num_wedges; k++) pieces_at(w, i, &w->wedge[k], add_side);
  foreign_pieces(w, i, add_side);
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

static void add_cone_dd(work *w, rm_lid j, double sign, const plane *pl, const point *p, const point *q)
{
  const slot *s = &w->slots[w->slot_of[j]];
  rm_dd      *sum = w->exact[w->slot_of[j]], r[3], a[3], b[3], cross[3];

  if (!(s->kinds & AGAIN)) return;
  dd_difference(pl->v, s->o, r);
  dd_relative(w, p, s->o, a);
  dd_relative(w, q, s->o, b);
  rm_dd_cross(a, b, cross);
  const rm_dd six_v = rm_dd_mul(rm_dd_dot(r, cross), (rm_dd){sign, 0});
  sum[0] = rm_dd_add(sum[0], six_v);
  for (int c = 0; c < 3; c++) sum[1 + c] = rm_dd_add(sum[1 + c], rm_dd_mul(six_v, rm_dd_add(r[c], rm_dd_add(a[c], b[c]))));
  for (int k = 0; k < w->num_sums - 4; k++) {
    const int   x = rm_row_of[k], y = rm_column_of[k];
    const rm_dd sx = rm_dd_add(r[x], rm_dd_add(a[x], b[x])), sy = rm_dd_add(r[y], rm_dd_add(a[y], b[y]));
    const rm_dd own = rm_dd_add(rm_dd_mul(r[x], r[y]), rm_dd_add(rm_dd_mul(a[x], a[y]), rm_dd_mul(b[x], b[y])));
    sum[4 + k] = rm_dd_add(sum[4 + k], rm_dd_mul(six_v, rm_dd_add(own, rm_dd_mul(sx, sy))));
  }
}

static void add_dd(work *w, rm_lid i, const rm_lid j[2], int kind, double sign, const plane *pl, const plane *other,
                   const point *p, const point *q)
{
  (void)i, (void)kind;
  for (int h = 0; h < 2; h++) {
    if (j[h] < 0) continue;
    add_cone_dd(w, j[h], h ? -sign : sign, pl, p, q);
    if (other) add_cone_dd(w, j[h], h ? sign : -sign, other, p, q);
  }
}

/* ---- one source cell ------------------------------------------------------------------------------------------------- */

/* The slot's second moments about a point d before its origin, with its first ones m. */
static void shift_second(const slot *s, const double m[3], const double d[3], double second[6])
{
  for (int k = 0; k < 6; k++) {
    const int x = rm_row_of[k], y = rm_column_of[k];
    second[k] = s->sum[4 + k] / 120 + (d[x] * m[y] + d[y] * m[x]) + d[x] * d[y] * (s->sum[0] / 6);
  }
}

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
    const double *b = w->part->piece[1].cell_centroid[s->target], e[3] = {s->o[0] - b[0], s->o[1] - b[1], s->o[2] - b[2]};
    RM_TRY(rm_grow(&w->second, &w->room[5], need, sizeof *w->second));
    RM_TRY(rm_grow(&w->second_back, &w->room[6], need, sizeof *w->second_back));
    shift_second(s, m, d, w->second[n]);
    shift_second(s, m, e, w->second_back[n]);
  }
  w->num_pairs++;
  return REMAP_OK;
}

/* Sum the slots marked AGAIN in double-double. */
static remap_status sum_again(work *w, rm_lid i)
{
  RM_TRY(rm_grow(&w->exact, &w->exact_room, w->num_slots, sizeof *w->exact));
  memset(w->exact, 0, sizeof *w->exact * (size_t)w->num_slots);
  all_sides(w, i, add_dd);
  for (int k = 0; k < w->num_slots; k++)
    if (w->slots[k].kinds & AGAIN)
      for (int c = 0; c < w->num_sums; c++) w->slots[k].sum[c] = w->exact[k][c].hi + w->exact[k][c].lo;
  return w->status;
}

/* Collect the polygons of the slots that want them: all polygons of those in doubt, else those in skins. */
static remap_status collect_polygons(work *w, rm_lid i)
{
  w->skin_only = true;
  for (int k = 0; k < w->num_slots; k++) {
    slot *s = &w->slots[k];
    if (s->first_polygon == NO_POLYGONS || s->kinds & APART || fabs(s->sum[0]) > rm_moments_noise(w, i, s)) continue;
    s->kinds |= IN_DOUBT;
    w->skin_only = false;
  }
  for (int side = 0; side < 2 && !w->limit[side]; side++) RM_NEW0(w->limit[side], w->scratch, w->o->trace[side].num_crossings);
  RM_TRY(rm_moments_no_polygons(w));
  all_sides(w, i, rm_moments_add_polygon);
  w->skin_only = false;
  return w->status;
}

static uint8_t skins_in(work *w, rm_lid i, const slot *s, bool is_flat)
{
  uint8_t flags = 0;

  if (s->kinds & SKIN_SOURCE && rm_moments_skin_passes(w, i, s, 0, is_flat)) flags |= RM_PAIR_SOURCE_SKIN;
  if (s->kinds & SKIN_TARGET && rm_moments_skin_passes(w, i, s, 1, is_flat)) flags |= RM_PAIR_TARGET_SKIN;
  return flags;
}

/* A pair without volume is none; but where one cell is flat, wholly or in part, and in the skin, the other may end there. */
static remap_status drop_pair(work *w, rm_lid i, slot *s)
{
  const uint8_t flags = skins_in(w, i, s, true);

  if (!flags) return REMAP_OK;
  memset(s->sum, 0, sizeof s->sum);
  return push_pair(w, i, s, flags | RM_PAIR_EMPTY);
}

/* The boxes of the two cells meet in a face at most: a cell winds about nothing beyond its box, so the pair has no volume. */
static bool are_apart(const work *w, rm_lid i, rm_lid j)
{
  const double *a = w->o->mesh[0]->cell_box[i], *b = w->o->mesh[1]->cell_box[j];

  return a[0] >= b[3] || a[1] >= b[4] || a[2] >= b[5] || b[0] >= a[3] || b[1] >= a[4] || b[2] >= a[5];
}

/* What must be known of a pair besides its sums. Only where skins pass do cells that are apart need their polygons. */
static void look_closer(work *w, rm_lid i, slot *s, bool *sums, bool *polygons)
{
  const double vi = fabs(w->part->piece[0].cell_volume[i]), vj = fabs(w->part->piece[1].cell_volume[s->target]);
  const double noise = rm_moments_noise(w, i, s);
  const bool   skin  = (s->kinds & (SKIN_SOURCE | SKIN_TARGET)) != 0;

  if (are_apart(w, i, s->target)) s->kinds |= APART;
  else if (noise > 6 * 0x1p-33 * (vi < vj ? vi : vj)) s->kinds |= AGAIN, *sums = true;
  if (skin || (!(s->kinds & APART) && fabs(s->sum[0]) <= noise)) s->first_polygon = WANTS_POLYGONS, *polygons = true;
}

static remap_status finish_cell(work *w, rm_lid i)
{
  bool sums = false, polygons = false;

  for (int k = 0; k < w->num_slots; k++)
    if (rm_part_makes_pair(w->part, i, w->slots[k].target)) look_closer(w, i, &w->slots[k], &sums, &polygons);
  if (sums) RM_TRY(sum_again(w, i));
  if (polygons) RM_TRY(collect_polygons(w, i));
  for (int k = 0; k < w->num_slots; k++) {
    slot *s = &w->slots[k];

    w->slot_of[s->target] = -1;
    if (!rm_part_makes_pair(w->part, i, s->target)) continue;
    if (s->kinds & APART || (s->kinds & IN_DOUBT && !rm_moments_has_volume(w, s)))
      RM_TRY(drop_pair(w, i, s));
    else
      RM_TRY(push_pair(w, i, s, skins_in(w, i, s, false)));
    RM_TRY(w->status);
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
  const rm_trimesh *m1 = w->o->mesh[0];

  RM_TRY(file_pieces(w));
  RM_NEW(w->memo, w->scratch, NUM_MEMOS);
  for (int k = 0; k < NUM_MEMOS; k++) w->memo[k].edge = -1;
  RM_NEW(w->slot_of, w->scratch, w->o->mesh[1]->num_cells);
  for (rm_lid j = 0; j < w->o->mesh[1]->num_cells; j++) w->slot_of[j] = -1;
  RM_NEW(w->wedge_of, w->scratch, m1->num_edges);
  for (rm_lid e = 0; e < m1->num_edges; e++) w->wedge_of[e] = -1;
  for (rm_lid t = 0; t < m1->num_triangles; t++) /* cells by their first triangle: as they lie in space */
    for (int h = 0; h < 2; h++) {
      const rm_lid i = m1->side[t][h];

      if (i < 0 || m1->cell_triangle[m1->cell_triangle_offset[i]] != 2 * t + h) continue;
      RM_TRY(open_cell(w, i));
      if (w->num_sums == 4) all_sides(w, i, add);
      else all_sides(w, i, add_2);
      RM_TRY(w->status);
      RM_TRY(finish_cell(w, i));
    }
  return REMAP_OK;
}

/* (*data)[place[k]] for all k, in the arena; *data, malloc'ed, is given back. */
static void *kept(rm_arena *arena, void *data, const int64_t *place, int64_t n, size_t size)
{
  char *from, *to = rm_arena_alloc(arena, n, size);

  memcpy(&from, data, sizeof from); /* data points to a pointer of some type */
  for (int64_t k = 0; to && k < n; k++) memcpy(to + (size_t)k * size, from + (size_t)place[k] * size, size);
  free(from);
  memset(data, 0, sizeof from);
  return to;
}

/* The pairs in the order of their sources. */
static remap_status keep(rm_arena *arena, work *w, const rm_moments **out)
{
  const int64_t n = w->num_pairs;
  int64_t      *next, *place;
  rm_moments   *m;

  RM_NEW0(next, w->scratch, (int64_t)w->o->mesh[0]->num_cells + 1);
  RM_NEW(place, w->scratch, n);
  for (int64_t k = 0; k < n; k++) next[w->source[k]]++;
  rm_offsets(next, w->o->mesh[0]->num_cells);
  for (int64_t k = 0; k < n; k++) place[next[w->source[k]]++] = k;
  RM_NEW0(m, arena, 1);
  m->num_pairs = n;
  m->source    = kept(arena, &w->source, place, n, sizeof *w->source);
  m->target    = kept(arena, &w->target, place, n, sizeof *w->target);
  m->volume    = kept(arena, &w->volume, place, n, sizeof *w->volume);
  m->moment    = kept(arena, &w->moment, place, n, sizeof *w->moment);
  m->flags     = kept(arena, &w->flags, place, n, sizeof *w->flags);
  m->second    = w->num_sums == 10 ? kept(arena, &w->second, place, n, sizeof *w->second) : NULL;
  m->second_back = w->num_sums == 10 ? kept(arena, &w->second_back, place, n, sizeof *w->second_back) : NULL;
  if (!m->source || !m->target || !m->volume || !m->moment || !m->flags) return REMAP_NO_MEMORY;
  if (w->num_sums == 10 && (!m->second || !m->second_back)) return REMAP_NO_MEMORY;
  *out = m;
  return REMAP_OK;
}

remap_status rm_moments_build(rm_arena *arena, const rm_part *part, const rm_overlay *overlay, int degree,
                              const rm_moments **out)
{
  work         w = {.part = part, .o = overlay, .scratch = rm_arena_new(), .num_sums = degree == 2 ? 10 : 4};
  remap_status status = w.scratch ? REMAP_OK : REMAP_NO_MEMORY;

  if (status == REMAP_OK) status = all_cells(&w);
  if (status == REMAP_OK) status = keep(arena, &w, out);
  rm_moments_decided(&w);
  free(w.slots);
  free(w.own_plane);
  free(w.wedge);
  free(w.exact);
  free(w.source);
  free(w.target);
  free(w.volume);
  free(w.moment);
  free(w.second);
  free(w.second_back);
  free(w.flags);
  rm_arena_drop(w.scratch);
  return status;
}
