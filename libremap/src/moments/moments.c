/* moments -- volumes and moments of all pairs, from segments and pieces of edges (DESIGN 2.4, 2.6).
 *
 * The boundary of i n j consists of polygons in the triangles of i and of j. Each polygon contributes the cone over it from a local
 * origin O, the centre of the meeting of the two cells' boxes, summed over the polygon's sides p -> q: the signed volume of the
 * tetrahedron (O, r, p, q), with r the foot of the perpendicular from O on the triangle's plane. All terms are of the size of the
 * pair, wherever it lies and however large its cells are. A point is its edge's first vertex plus lambda times the edge, and is
 * taken relative to O before anything is multiplied.
 *
 * Cost: four cones per segment and cell beside it, two per piece of an edge and triangle at it; 45 operations per cone. */
#include "moments/moments_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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

/* ---- one source cell ------------------------------------------------------------------------------------------------- */

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
    w->num_polygons = w->num_corners = 0;
    all_cones(w, i, rm_moments_add_polygon);
  }
  return w->status;
}

static uint8_t skins_in(const work *w, rm_lid i, const slot *s, bool is_flat)
{
  uint8_t flags = 0;

  if (s->kinds & SKIN_SOURCE && rm_moments_skin_passes(w, i, s, 0, is_flat)) flags |= RM_PAIR_SOURCE_SKIN;
  if (s->kinds & SKIN_TARGET && rm_moments_skin_passes(w, i, s, 1, is_flat)) flags |= RM_PAIR_TARGET_SKIN;
  return flags;
}

/* A pair without volume is none; but where one cell is flat and in the skin, the other may end there. */
static remap_status drop_pair(work *w, rm_lid i, slot *s)
{
  if (w->part->piece[0].cell_volume[i] != 0 && w->part->piece[1].cell_volume[s->target] != 0) return REMAP_OK;
  const uint8_t flags = skins_in(w, i, s, true);

  if (!flags) return REMAP_OK;
  memset(s->sum, 0, sizeof s->sum);
  return push_pair(w, i, s, flags | RM_PAIR_EMPTY);
}

static remap_status finish_cell(work *w, rm_lid i)
{
  const double vi = fabs(w->part->piece[0].cell_volume[i]);
  bool         sums = false, polygons = false;

  for (int k = 0; k < w->num_slots; k++) {
    slot        *s  = &w->slots[k];
    const double vj = fabs(w->part->piece[1].cell_volume[s->target]), noise = rm_moments_noise(w, i, s);

    if (noise > 6 * 0x1p-33 * (vi < vj ? vi : vj)) s->kinds |= AGAIN, sums = true;
    if (fabs(s->sum[0]) <= noise || s->kinds & (SKIN_SOURCE | SKIN_TARGET)) s->first_polygon = WANTS_POLYGONS, polygons = true;
  }
  if (sums || polygons) RM_TRY(look_again(w, i, sums, polygons));
  for (int k = 0; k < w->num_slots; k++) {
    slot      *s        = &w->slots[k];
    const bool in_doubt = s->first_polygon != NO_POLYGONS;

    w->slot_of[s->target] = -1;
    if (in_doubt && fabs(s->sum[0]) <= rm_moments_noise(w, i, s) && !rm_moments_has_volume(w, i, s))
      RM_TRY(drop_pair(w, i, s));
    else
      RM_TRY(push_pair(w, i, s, in_doubt ? skins_in(w, i, s, false) : 0));
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
  free(w.corner);
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
