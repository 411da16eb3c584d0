/* sums -- volumes and moments of the pairs of one cell of mesh 1, in doubles (DESIGN 2.4).
 *
 * The boundary of i n j consists of polygons in the facets of i and of j. Each polygon contributes the cone over it from an
 * origin O, summed over the polygon's sides p -> q: the signed volume of the tetrahedron (O, r, p, q), with r = h n the foot of
 * the perpendicular from O on the plane. With D = n.(p x q) and s = p + q, relative to O, it adds
 *
 *   6 V = h D,   24 M = h D (r + s),   120 S_ab = h D (2 r_a r_b + r_a s_b + s_a r_b + p_a p_b + q_a q_b + s_a s_b)
 *
 * O is the centre of the box of cell i, and what j gains its neighbour beyond the polygon loses. So every side is looked at
 * once for what it adds to all polygons and pairs:
 *   segments: D for the facet of i goes to the pairs on both sides of the facet of j. In the facet of j there is one polygon
 *     for both of them, the facet's `cut`: the sums of D, D s ... over its sides are raised to those of cones, and handed to
 *     both, when all sides are there.
 *   pieces of an edge a + lambda u of i, with two facets there: p x q = (lambda_q - lambda_p) a x u, so that h D of both and
 *     what r has to do with it need be known once per edge. They go to the one cell of mesh 2 in which the piece lies.
 *   pieces of edges of j: to the cuts of the facets there.
 *
 * Where j is much smaller than i, O is the centre of the meeting of their boxes, and all is summed for the pair by itself. So
 * all terms are of the size of the smaller cell, wherever it lies.
 *
 * A crossing is its edge's first vertex plus lambda times the edge, taken relative to O before anything is multiplied. One that
 * several sides share is computed once per cell, a `spot`.
 *
 * Cost: per side some 40 operations, per cut 50, per pair 10. */
#include <string.h>
#include "moments/moments_private.h"

INLINE double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

INLINE void cross(const double a[3], const double b[3], double out[3])
{
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

/* ---- slots ----------------------------------------------------------------------------------------------------------- */

enum { MUCH_SMALLER = 4 }; /* times smaller a cell of mesh 2 has an origin of its own with cell i */

static __attribute__((noinline)) int new_slot(work *w, rm_lid i, rm_lid j)
{
  const double *a = w->o->mesh[0]->cell_box[i], *b = w->o->mesh[1]->cell_box[j];
  slot         *s;

  if (w->num_slots == w->slots_room && (w->status = rm_grow(&w->slots, &w->slots_room, w->num_slots + 64, sizeof *w->slots)))
    return -1;
  s                = &w->slots[w->num_slots];
  s->target        = j;
  s->num_cones     = 0;
  s->kinds         = 0;
  s->first_polygon = NO_POLYGONS;
  s->last_polygon  = -1;
  s->is_local      = MUCH_SMALLER * rm_max(b[3] - b[0], rm_max(b[4] - b[1], b[5] - b[2])) < w->extent;
  s->reach         = s->is_local ? 0 : w->extent;
  for (int k = 0; k < 10; k++) s->sum[k] = 0;
  for (int c = 0; c < 3; c++) s->o[c] = w->centre[c];
  for (int c = 0; c < 3 && s->is_local; c++) {
    const double low = a[c] > b[c] ? a[c] : b[c], high = a[c + 3] < b[c + 3] ? a[c + 3] : b[c + 3];
    s->o[c] = low + 0.5 * (high - low);
    if (high - low > s->reach) s->reach = high - low;
  }
  return w->slot_of[j] = w->num_slots++;
}

/* The number of the pair's slot; -1: w->status tells. */
INLINE int find_slot(work *w, rm_lid i, rm_lid j) { return w->slot_of[j] >= 0 ? w->slot_of[j] : new_slot(w, i, j); }

/* ---- what a side adds ------------------------------------------------------------------------------------------------ */

/* A side p -> q of a polygon, s = p + q: D, D s, D (p p + q q + s s), of which a polygon has the sums. */
INLINE void weigh(double d, const double p[3], const double q[3], const double s[3], int num_sums, double out[10])
{
  out[0] = d;
  for (int c = 0; c < 3; c++) out[1 + c] = d * s[c];
  for (int k = 0; k < num_sums - 4; k++) {
    const int x = rm_row_of[k], y = rm_column_of[k];
    out[4 + k] = d * (p[x] * p[y] + q[x] * q[y] + s[x] * s[y]);
  }
}

/* Likewise the cone over a side from O, w being h D. */
INLINE void cone(double w, const double r[3], const double p[3], const double q[3], const double s[3], int num_sums,
                 double out[10])
{
  const double sum[3] = {r[0] + s[0], r[1] + s[1], r[2] + s[2]};

  out[0] = w;
  for (int c = 0; c < 3; c++) out[1 + c] = w * sum[c];
  for (int k = 0; k < num_sums - 4; k++) {
    const int x = rm_row_of[k], y = rm_column_of[k];
    out[4 + k] = w * (r[x] * r[y] + p[x] * p[y] + q[x] * q[y] + sum[x] * sum[y]);
  }
}

/* From the sums of all sides of a polygon those of its cones, with r = height n. */
INLINE void raise(double side[10], double height, const double r[3], int num_sums)
{
  for (int k = 0; k < num_sums; k++) side[k] *= height;
  for (int k = 0; k < num_sums - 4; k++) {
    const int x = rm_row_of[k], y = rm_column_of[k];
    side[4 + k] += 2 * side[0] * r[x] * r[y] + (r[x] * side[1 + y] + r[y] * side[1 + x]);
  }
  for (int c = 0; c < 3; c++) side[1 + c] += side[0] * r[c];
}

/* A side of polygons in one or two planes (the second may be NULL), about the slot's own origin, to that slot: the cone over it
 * counts `sign` times in the first plane, -sign times in the second. */
static __attribute__((noinline)) void add_local(slot *s, double sign, const plane *first, const plane *second, const point *p,
                                                const point *q, int num_sums)
{
  double a[3], b[3], a_x_b[3], both[3], foot[3], out[10];

  relative(p, s->o, a);
  relative(q, s->o, b);
  cross(a, b, a_x_b);
  for (int c = 0; c < 3; c++) both[c] = a[c] + b[c];
  for (const plane *pl = first; pl; pl = pl == first ? second : NULL, sign = -sign) {
    const double height = rm_moments_foot(pl->n, pl->v, s->o, foot);

    cone(sign * height * dot(pl->n, a_x_b), foot, a, b, both, num_sums, out);
    for (int x = 0; x < num_sums; x++) s->sum[x] += out[x];
  }
}

/* ---- spots and cuts -------------------------------------------------------------------------------------------------- */

/* The place in the table where the key is found, or is to be put. */
INLINE uint32_t place_of(const table *t, const uint32_t *key_of, uint32_t key)
{
  uint32_t h = key * 2654435769u >> t->shift;

  while (t->item[h] >= 0 && key_of[t->item[h]] != key) h = (h + 1) & t->mask;
  return h;
}

/* An empty table for n items at most. */
static remap_status clear_table(table *t, int64_t n)
{
  int log = 6;

  while (log < 31 && n > INT64_C(1) << (log - 1)) log++;
  t->mask  = (UINT32_C(1) << log) - 1;
  t->shift = 32 - log;
  RM_TRY(rm_grow(&t->item, &t->room, (int64_t)t->mask + 1, sizeof *t->item));
  memset(t->item, -1, sizeof *t->item * ((size_t)t->mask + 1));
  return REMAP_OK;
}

static __attribute__((noinline)) int compute_spot(work *w, uint32_t key, uint32_t place)
{
  const rm_trimesh  *m = w->o->mesh[key & 1];
  const rm_crossing *x = &w->o->trace[key & 1].crossing[key >> 1];
  const double      *v = m->vertex[m->edge[x->edge][0]], *u = m->vertex[m->edge[x->edge][1]];
  const int          k = w->num_spots++;

  w->spots.item[place] = k;
  w->spot_key[k]       = key;
  for (int c = 0; c < 3; c++) w->spot[k][c] = (v[c] - w->centre[c]) + x->lambda * (u[c] - v[c]);
  return k;
}

/* Crossing key / 2 of the edges of mesh key % 2, relative to the centre of cell i. */
INLINE int find_spot(work *w, uint32_t key)
{
  const uint32_t place = place_of(&w->spots, w->spot_key, key);
  return w->spots.item[place] >= 0 ? w->spots.item[place] : compute_spot(w, key, place);
}

/* Crossing `key` at a + lambda u. */
INLINE void set_spot(work *w, uint32_t key, const double a[3], double lambda, const double u[3])
{
  const uint32_t place = place_of(&w->spots, w->spot_key, key);

  if (w->spots.item[place] >= 0) return;
  w->spots.item[place]      = w->num_spots;
  w->spot_key[w->num_spots] = key;
  for (int c = 0; c < 3; c++) w->spot[w->num_spots][c] = a[c] + lambda * u[c];
  w->num_spots++;
}

static __attribute__((noinline)) int new_cut(work *w, rm_lid i, rm_lid b, uint32_t place)
{
  const rm_trimesh *m = w->o->mesh[1];
  cut              *c = &w->cut[w->num_cuts];

  c->kinds     = m->triangle_is_skin[b] ? SKIN_TARGET : 0;
  c->num_cones = 0;
  c->any_plain = c->any_local = false;
  for (int k = 0; k < 3; k++) c->n[k] = m->normal[b][k];
  for (int k = 0; k < 10; k++) c->sum[k] = 0;
  for (int h = 0; h < 2; h++) {
    const rm_lid j = m->side[b][h];

    c->slot[h] = c->plain[h] = -1;
    if (j < 0) continue;
    if ((c->slot[h] = find_slot(w, i, j)) < 0) return -1;
    if (w->slots[c->slot[h]].is_local) {
      c->any_local = true;
    } else {
      c->plain[h]  = c->slot[h];
      c->any_plain = true;
    }
  }
  w->cuts.item[place]     = w->num_cuts;
  w->cut_key[w->num_cuts] = (uint32_t)b;
  return w->num_cuts++;
}

/* What facet b of mesh 2 has in common with cell i. -1: w->status tells. */
INLINE int find_cut(work *w, rm_lid i, rm_lid b)
{
  const uint32_t place = place_of(&w->cuts, w->cut_key, (uint32_t)b);
  return w->cuts.item[place] >= 0 ? w->cuts.item[place] : new_cut(w, i, b, place);
}

/* ---- edges of cell i ------------------------------------------------------------------------------------------------- */

/* An edge a + lambda u of cell i and what its pieces have in common: per unit of lambda, with d = n.(a x u) of the two facets,
 * the first less the second, the sums of h d, of h d r and of 2 h d r r. */
typedef struct line {
  const wedge *at;
  const plane *first, *second; /* NULL */
  double       a[3], u[3], d, dr[3], drr[6];
  int          kind, num_cones;
} line;

INLINE void add_facet_to_line(line *l, const own_facet *f, double sign, const double a_x_u[3], uint8_t skin, int num_sums)
{
  const double d = sign * f->height * dot(f->in.n, a_x_u);

  l->d += d;
  for (int c = 0; c < 3; c++) l->dr[c] += d * f->foot[c];
  for (int k = 0; k < num_sums - 4; k++) l->drr[k] += 2 * d * f->foot[rm_row_of[k]] * f->foot[rm_column_of[k]];
  l->num_cones++;
  l->kind |= skin ? SKIN_SOURCE : 0;
}

INLINE void set_line(const work *w, const wedge *at, int num_sums, line *l)
{
  const rm_trimesh *m = w->o->mesh[0];
  const double     *v = m->vertex[m->edge[at->edge][0]], *end = m->vertex[m->edge[at->edge][1]];
  const own_facet  *f[2] = {at->facet[0] >= 0 ? &w->own[at->facet[0]] : NULL, at->facet[1] >= 0 ? &w->own[at->facet[1]] : NULL};
  double            a_x_u[3];

  l->at        = at;
  l->first     = f[0] ? &f[0]->in : NULL;
  l->second    = f[1] ? &f[1]->in : NULL;
  l->kind      = FROM_SOURCE;
  l->num_cones = 0;
  l->d         = 0;
  for (int c = 0; c < 3; c++) {
    l->a[c]  = v[c] - w->centre[c];
    l->u[c]  = end[c] - v[c];
    l->dr[c] = 0;
  }
  for (int k = 0; k < num_sums - 4; k++) l->drr[k] = 0;
  cross(l->a, l->u, a_x_u);
  for (int h = 0; h < 2; h++)
    if (f[h]) add_facet_to_line(l, f[h], h ? -1 : 1, a_x_u, m->triangle_is_skin[f[h]->in.triangle], num_sums);
}

static __attribute__((noinline)) void add_local_piece(const work *w, slot *s, const line *l, rm_lid k, rm_lid end, int number,
                                                      int num_sums)
{
  point p, q;

  rm_moments_set_point(w, 0, l->at->edge, k, &p);
  rm_moments_set_point(w, 0, l->at->edge, end, &q);
  if (l->first) add_local(s, number, l->first, l->second, &p, &q, num_sums);
  else add_local(s, -number, l->second, NULL, &p, &q, num_sums);
}

/* The pieces of the line from point k to point `end`, at those lambda, in cell j, which winds about them that often. True if
 * the pair is summed about the origin of cell i. */
INLINE bool add_piece(work *w, rm_lid i, rm_lid j, const line *l, rm_lid k, rm_lid end, const double lambda[2], int number,
                      int num_sums)
{
  const int    z = find_slot(w, i, j);
  const double length = number * (lambda[1] - lambda[0]), d = length * l->d, sum = lambda[0] + lambda[1];
  double       s[3];

  if (z < 0) return false;
  slot *to = &w->slots[z];
  to->num_cones += l->num_cones;
  to->kinds |= l->kind;
  if (to->is_local) {
    add_local_piece(w, to, l, k, end, number, num_sums);
    return false;
  }
  to->sum[0] += d;
  for (int c = 0; c < 3; c++) {
    s[c] = 2 * l->a[c] + sum * l->u[c];
    to->sum[1 + c] += d * s[c] + length * l->dr[c];
  }
  for (int h = 0; h < num_sums - 4; h++) {
    const int    x = rm_row_of[h], y = rm_column_of[h];
    const double px = l->a[x] + lambda[0] * l->u[x], py = l->a[y] + lambda[0] * l->u[y];
    const double qx = l->a[x] + lambda[1] * l->u[x], qy = l->a[y] + lambda[1] * l->u[y];
    to->sum[4 + h] += d * (px * py + qx * qy + s[x] * s[y]) + length * (l->dr[x] * s[y] + l->dr[y] * s[x] + l->drr[h]);
  }
  return true;
}

/* lambda of point k of an edge of mesh 1. */
INLINE double lambda_of(const rm_trace *tr, rm_lid e, rm_lid k)
{
  return k == 0 ? 0 : k > tr->count[e] ? 1 : tr->crossing[tr->first[e] + k - 1].lambda;
}

/* Piece k of the line, and those behind it that count as one with it, where cells overlap. */
static __attribute__((noinline)) void add_tangled(work *w, rm_lid i, const line *l, rm_lid k, int num_sums)
{
  const rm_trace   *tr    = &w->o->trace[0];
  const rm_lid      e     = l->at->edge, state = piece_state(tr, e, k);
  const rm_winding  one   = {state, 1};
  const rm_winding *list  = state < RM_OUTSIDE ? tr->winding + tr->list_offset[-2 - state] : &one;
  const rm_lid      n     = state < RM_OUTSIDE ? tr->list_offset[-1 - state] - tr->list_offset[-2 - state] : state >= 0;

  for (rm_lid z = 0; z < n; z++) {
    const rm_lid end = run_end(tr, e, k, list[z].cell, list[z].number);

    const double lambda[2] = {lambda_of(tr, e, k), lambda_of(tr, e, end)};

    if (end > k) add_piece(w, i, list[z].cell, l, k, end, lambda, list[z].number, num_sums);
  }
}

/* All pieces of an edge of cell i; crossings behind those that are summed here become spots, for segments will want them. */
INLINE void add_pieces_of(work *w, rm_lid i, const wedge *at, int num_sums)
{
  const rm_trace    *tr = &w->o->trace[0];
  const rm_crossing *x = tr->crossing + tr->first[at->edge];
  const rm_lid       count = tr->count[at->edge];
  rm_lid             before = RM_OUTSIDE, in = tr->state[at->edge];
  double             lambda[2] = {0, 0};
  line               l;

  set_line(w, at, num_sums, &l);
  for (rm_lid k = 0; k <= count; k++) {
    const rm_lid next     = k < count ? x[k].state : RM_OUTSIDE;
    bool         is_plain = false;

    lambda[1] = k < count ? x[k].lambda : 1;
    if (before < RM_OUTSIDE || in < RM_OUTSIDE || next < RM_OUTSIDE || (in >= 0 && (in == before || in == next)))
      add_tangled(w, i, &l, k, num_sums);
    else if (in >= 0)
      is_plain = add_piece(w, i, in, &l, k, k + 1, lambda, 1, num_sums);
    if (k < count && is_plain) set_spot(w, 2 * (uint32_t)(tr->first[at->edge] + k), l.a, lambda[1], l.u);
    before    = in;
    in        = next;
    lambda[0] = lambda[1];
  }
}

/* ---- segments -------------------------------------------------------------------------------------------------------- */

static __attribute__((noinline)) void add_local_segment(work *w, const own_facet *f, const cut *c, rm_end start, rm_end end,
                                                        int num_sums)
{
  const rm_trimesh *m  = w->o->mesh[1];
  const rm_lid      b  = start.other;
  const plane       pb = {1, b, m->normal[b], m->vertex[m->triangle[b][0]]};
  point             p, q;

  rm_moments_set_crossing(w, start.at >> 1 & 1, start.at >> 2, &p);
  rm_moments_set_crossing(w, end.at >> 1 & 1, end.at >> 2, &q);
  for (int h = 0; h < 2; h++)
    if (c->slot[h] >= 0 && c->plain[h] < 0)
      add_local(&w->slots[c->slot[h]], h ? -f->outward : f->outward, &f->in, &pb, &p, &q, num_sums);
}

/* Find the cut and the spots of every segment in a facet of cell i: apart from the arithmetic, so that many are on their way
 * from memory at a time. */
INLINE void find_segments_in(work *w, rm_lid i, const own_facet *f, int num_sums)
{
  const rm_overlay *o    = w->o;
  const int64_t     last = o->end_offset[f->in.triangle + 1];
  const int         kind = FROM_BOTH | (o->mesh[0]->triangle_is_skin[f->in.triangle] ? SKIN_SOURCE : 0);

  for (int64_t k = o->end_offset[f->in.triangle]; k < last; k += 2) {
    const rm_end start = o->end[k], end = o->end[k + 1];
    const int    at    = find_cut(w, i, start.other);

    if (at < 0) return;
    cut *c = &w->cut[at];
    c->kinds |= kind;
    c->num_cones += 2;
    if (c->any_local) add_local_segment(w, f, c, start, end, num_sums);
    if (!c->any_plain) continue;
    const int p = find_spot(w, start.at >> 1), q = find_spot(w, end.at >> 1);
    w->segment[w->num_segments++] = (segment){at, p, q};
  }
}

/* What segments in a facet of cell i add. */
INLINE void add_segments(work *w, const own_facet *f, int first, int last, int num_sums)
{
  const double n[3] = {f->in.n[0], f->in.n[1], f->in.n[2]}, foot[3] = {f->foot[0], f->foot[1], f->foot[2]};
  const double outward = f->outward, height = outward * f->height;

  for (int k = first; k < last; k++) {
    cut          *c = &w->cut[w->segment[k].cut];
    const double *p = w->spot[w->segment[k].from], *q = w->spot[w->segment[k].to];
    double        p_x_q[3], s[3], out[10];

    cross(p, q, p_x_q);
    for (int x = 0; x < 3; x++) s[x] = p[x] + q[x];
    weigh(-outward * dot(c->n, p_x_q), p, q, s, num_sums, out);
    for (int x = 0; x < num_sums; x++) c->sum[x] += out[x];
    cone(height * dot(n, p_x_q), foot, p, q, s, num_sums, out);
    for (int h = 0; h < 2; h++) {
      if (c->plain[h] < 0) continue;
      slot *to = &w->slots[c->plain[h]];
      for (int x = 0; x < num_sums; x++) to->sum[x] = h ? to->sum[x] - out[x] : to->sum[x] + out[x];
    }
  }
}

/* ---- edges of mesh 2 ------------------------------------------------------------------------------------------------- */

static __attribute__((noinline)) void add_local_foreign(work *w, const cut *c, rm_lid b, rm_lid f, rm_lid k, rm_lid end,
                                                        int number, int num_sums)
{
  const rm_trimesh *m  = w->o->mesh[1];
  const plane       pb = {1, b, m->normal[b], m->vertex[m->triangle[b][0]]};
  point             p, q;

  rm_moments_set_point(w, 1, f, k, &p);
  rm_moments_set_point(w, 1, f, end, &q);
  for (int h = 0; h < 2; h++)
    if (c->slot[h] >= 0 && c->plain[h] < 0)
      add_local(&w->slots[c->slot[h]], h ? -number : number, &pb, NULL, &p, &q, num_sums);
}

/* Point k of edge f of mesh 2, relative to the centre of cell i; it may be computed in `own`. */
INLINE const double *foreign_point(work *w, rm_lid f, rm_lid k, double own[3])
{
  const rm_trimesh *m  = w->o->mesh[1];
  const rm_trace   *tr = &w->o->trace[1];

  if (k > 0 && k <= tr->count[f]) return w->spot[find_spot(w, 2 * (uint32_t)(tr->first[f] + k - 1) + 1)];
  for (int c = 0; c < 3; c++) own[c] = m->vertex[m->edge[f][k > 0]][c] - w->centre[c];
  return own;
}

/* Pieces of edges of mesh 2 inside cell i. */
INLINE void add_foreign_pieces(work *w, rm_lid i, int num_sums)
{
  const rm_trimesh *m  = w->o->mesh[1];
  const rm_trace   *tr = &w->o->trace[1];

  for (int64_t k = w->piece_offset[i]; k < w->piece_offset[i + 1]; k++) {
    const rm_lid f = w->piece[k][0], at = w->piece[k][1];
    const int    number = piece_number(tr, f, at, i);
    const rm_lid end    = run_end(tr, f, at, i, number);
    double       own[2][3], p_x_q[3], s[3], out[10];

    if (end == at) continue;
    const double *p = foreign_point(w, f, at, own[0]), *q = foreign_point(w, f, end, own[1]);
    cross(p, q, p_x_q);
    for (int c = 0; c < 3; c++) s[c] = p[c] + q[c];
    for (rm_lid z = m->ring_offset[f]; z < m->ring_offset[f + 1]; z++) {
      const rm_lid b  = m->ring[z] / 4;
      const int    times = m->ring[z] & 2 ? -number : number, in = find_cut(w, i, b);

      if (in < 0) return;
      cut *c = &w->cut[in];
      c->kinds |= FROM_TARGET;
      c->num_cones++;
      if (c->any_local) add_local_foreign(w, c, b, f, at, end, times, num_sums);
      if (!c->any_plain) continue;
      weigh(times * dot(c->n, p_x_q), p, q, s, num_sums, out);
      for (int x = 0; x < num_sums; x++) c->sum[x] += out[x];
    }
  }
}

/* ---- one cell -------------------------------------------------------------------------------------------------------- */

/* What the cuts have gathered, to the pairs on both sides. */
INLINE void hand_out(work *w, int num_sums)
{
  const rm_trimesh *m = w->o->mesh[1];

  for (int k = 0; k < w->num_cuts; k++) {
    cut         *c = &w->cut[k];
    double       foot[3];
    const double height = rm_moments_foot(c->n, m->vertex[m->triangle[w->cut_key[k]][0]], w->centre, foot);

    raise(c->sum, height, foot, num_sums);
    for (int h = 0; h < 2; h++) {
      if (c->slot[h] < 0) continue;
      slot *s = &w->slots[c->slot[h]];
      s->num_cones += c->num_cones;
      s->kinds |= c->kinds;
      if (c->plain[h] < 0) continue;
      for (int x = 0; x < num_sums; x++) s->sum[x] = h ? s->sum[x] - c->sum[x] : s->sum[x] + c->sum[x];
    }
  }
}

/* Room for all that the cell can have. */
static remap_status need_room(work *w, rm_lid i)
{
  const int64_t pieces = w->piece_offset[i + 1] - w->piece_offset[i];
  int64_t       own = 0, segments = 0, facets = 0;

  for (int k = 0; k < w->num_wedges; k++) own += w->o->trace[0].count[w->wedge[k].edge];
  for (int k = 0; k < w->num_own; k++)
    segments += (w->o->end_offset[w->own[k].in.triangle + 1] - w->o->end_offset[w->own[k].in.triangle]) / 2;
  for (int64_t k = w->piece_offset[i]; k < w->piece_offset[i + 1]; k++) {
    const rm_lid *at = w->o->mesh[1]->ring_offset + w->piece[k][0];
    facets += at[1] - at[0];
  }
  RM_TRY(rm_grow(&w->segment, &w->segment_room, segments, sizeof *w->segment));
  RM_TRY(rm_grow(&w->spot, &w->spot_room, own + 2 * (segments + pieces), sizeof *w->spot));
  RM_TRY(rm_grow(&w->spot_key, &w->spot_key_room, own + 2 * (segments + pieces), sizeof *w->spot_key));
  RM_TRY(rm_grow(&w->cut, &w->cut_room, segments + facets, sizeof *w->cut));
  RM_TRY(rm_grow(&w->cut_key, &w->cut_key_room, segments + facets, sizeof *w->cut_key));
  RM_TRY(clear_table(&w->spots, own + 2 * (segments + pieces)));
  return clear_table(&w->cuts, segments + facets);
}

INLINE void add_all(work *w, rm_lid i, int num_sums)
{
  for (int k = 0; k < w->num_wedges; k++) add_pieces_of(w, i, &w->wedge[k], num_sums);
  for (int k = 0; k < w->num_own; k++) {
    w->own[k].first_segment = w->num_segments;
    find_segments_in(w, i, &w->own[k], num_sums);
    w->own[k].last_segment = w->num_segments;
  }
  if (w->status != REMAP_OK) return;
  for (int k = 0; k < w->num_own; k++)
    add_segments(w, &w->own[k], w->own[k].first_segment, w->own[k].last_segment, num_sums);
  add_foreign_pieces(w, i, num_sums);
  if (w->status == REMAP_OK) hand_out(w, num_sums);
}

static void add_all_1(work *w, rm_lid i) { add_all(w, i, 4); }
static void add_all_2(work *w, rm_lid i) { add_all(w, i, 10); }

remap_status rm_moments_sum(work *w, rm_lid i)
{
  RM_TRY(need_room(w, i));
  w->num_spots = w->num_cuts = w->num_segments = 0;
  if (w->num_sums == 4) add_all_1(w, i);
  else add_all_2(w, i);
  return w->status;
}

remap_status rm_moments_ready_sums(work *w)
{
  const rm_overlay *o = w->o;

  RM_NEW(w->slot_of, w->scratch, o->mesh[1]->num_cells);
  for (rm_lid j = 0; j < o->mesh[1]->num_cells; j++) w->slot_of[j] = -1;
  return REMAP_OK;
}
