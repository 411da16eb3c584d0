/* trace -- edge tracing with label colouring (DESIGN 2.3).
 *
 * One vertex per connected component is located by a ray; every edge then carries the state of one end to the other, and so the
 * whole mesh is coloured. In a cell, the signs of the edge's line against the cell's edges tell through which triangle it leaves.
 * The signs are taken in a frame sheared so that the edge runs along an axis: two products per edge of the cell, with one error
 * bound for the cell; what that cannot decide goes to the exact predicate. Cost: O(edges of the cell) per crossing by adjacency,
 * O(log n + hits) per edge by the box tree. */
#include "overlay/trace.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "overlay/states.h"

/* A crossing found: triangle of the other mesh and the sign of the crossing seen along the edge from its first vertex. */
typedef struct hit {
  rm_lid triangle;
  int    sign;
} hit;

enum { MAX_LOCAL = 256 };

/* Error of an edge's side against a line in the sheared frame, by the square of the reach of its coordinates. With u = 2^-53:
 * differences err by u, shears by 3 u, so sheared coordinates, at most 2 reach, by 8 u reach; their products and the difference of
 * these by less than 80 u reach^2. */
#define LINE_NOISE 0x1p-46

typedef struct tracer {
  const rm_trimesh *own, *other;
  int               moved;
  bool              by_tree; /* every edge */
  rm_arena         *scratch;
  rm_states         states;
  const rm_boxtree *all_tree; /* over all triangles of other; built when first needed */
  double          (*all_box)[6];
  hit              *hits;     /* crossings of the present edge, in walking order */
  int64_t           hits_room;
  int               num_hits;
  hit              *skin_hits; /* crossings of the present edge with the skin, ascending along it */
  int64_t           skin_room;
  int               num_skin; /* -1: not asked for yet */
  rm_crossing      *crossing;
  int64_t           num_crossings, crossing_room;
  int64_t          *first;
  rm_lid           *count, *state;
  /* the present edge, or ray */
  const double     *p0, *p1;
  double            beyond[3]; /* far end of a ray */
  double            u[3], shear[2]; /* p1 - p0; u[axis[0]] / u[axis[2]], u[axis[1]] / u[axis[2]] */
  int               axis[3];        /* axis[2] is the edge's longest direction; a cyclic permutation of x, y, z */
} tracer;

static void set_line(tracer *t, const double *p0, const double *p1)
{
  int k = 0;

  t->p0 = p0, t->p1 = p1;
  for (int c = 0; c < 3; c++) t->u[c] = p1[c] - p0[c];
  if (fabs(t->u[1]) > fabs(t->u[k])) k = 1;
  if (fabs(t->u[2]) > fabs(t->u[k])) k = 2;
  t->axis[2] = k;
  t->axis[0] = (k + 1) % 3;
  t->axis[1] = (k + 2) % 3;
  t->shear[0] = t->u[t->axis[0]] / t->u[k];
  t->shear[1] = t->u[t->axis[1]] / t->u[k];
  t->num_skin = -1;
}

/* Sign with which the edge's line crosses the triangle, from the exact sides of its three edges: +1 along the normal; 0: misses. */
static inline int crossing_sign(int s01, int s12, int s02)
{
  const int sum = s01 + s12 - s02;
  return sum == 3 ? 1 : sum == -3 ? -1 : 0;
}

static int edge_side(const tracer *t, rm_lid f)
{
  const rm_trimesh *m = t->other;
  return rm_edge_side(t->p0, t->p1, m->vertex[m->edge[f][0]], m->vertex[m->edge[f][1]], t->moved, NULL);
}

/* What the filter of line_sides tells about one triangle: true if the present edge's line passes it by. */
static bool surely_misses(const tracer *t, rm_lid b)
{
  const int    i = t->axis[0], j = t->axis[1], k = t->axis[2];
  double       x[3], y[3], reach = 0;
  int          along = 0, against = 0;

  for (int h = 0; h < 3; h++) {
    const double *q = t->other->vertex[t->other->triangle[b][h]];
    const double  dx = q[i] - t->p0[i], dy = q[j] - t->p0[j], dz = q[k] - t->p0[k];
    x[h]  = dx - t->shear[0] * dz;
    y[h]  = dy - t->shear[1] * dz;
    reach = fmax(reach, fmax(fabs(dx), fmax(fabs(dy), fabs(dz))));
  }
  const double bound = LINE_NOISE * reach * reach;
  for (int h = 0; h < 3; h++) {
    const int    g = (h + 1) % 3;
    const double d = x[h] * y[g] - x[g] * y[h];
    along += d > bound;
    against += d < -bound;
  }
  return along && against;
}

/* Side of an end of the present edge against triangle b's plane. */
static int end_side(const tracer *t, rm_lid b, const double *p)
{
  const rm_lid *v = t->other->triangle[b];
  return rm_point_side(t->other->vertex[v[0]], t->other->vertex[v[1]], t->other->vertex[v[2]], p, t->moved, NULL);
}

/* Sign of the crossing of the present edge with triangle b, or 0 if they do not meet. Exact. */
static int meets(const tracer *t, rm_lid b)
{
  const rm_lid *e = t->other->triangle_edge[b];
  const int     a = edge_side(t, e[0]);
  int           s;

  if (!a || edge_side(t, e[1]) != a || edge_side(t, e[2]) != -a) return 0;
  s = a;
  return end_side(t, b, t->p0) == -s && end_side(t, b, t->p1) == s ? s : 0;
}

/* -1, 0, +1: triangle a is crossed before, with, after triangle b going from p0 to p1. Exact. */
static int order(const tracer *t, rm_lid a, rm_lid b)
{
  double q[2][3][3];

  if (a == b) return 0;
  for (int h = 0; h < 3; h++) {
    memcpy(q[0][h], t->other->vertex[t->other->triangle[a][h]], sizeof q[0][h]);
    memcpy(q[1][h], t->other->vertex[t->other->triangle[b][h]], sizeof q[1][h]);
  }
  return rm_crossing_order(t->p0, t->p1, (const double (*)[3])q[0], (const double (*)[3])q[1], t->moved);
}

/* Crossings at exactly one place keep the order of triangles, which is canonical. */
static void sort_hits(const tracer *t, hit *h, int n)
{
  for (int i = 1; i < n; i++) {
    const hit x = h[i];
    int       k = i;
    while (k > 0) {
      const int o = order(t, h[k - 1].triangle, x.triangle);
      if (o < 0 || (o == 0 && h[k - 1].triangle < x.triangle)) break;
      h[k] = h[k - 1];
      k--;
    }
    h[k] = x;
  }
}

static remap_status push_hit(tracer *t, rm_lid triangle, int sign)
{
  RM_TRY(rm_grow(&t->hits, &t->hits_room, t->num_hits + 1, sizeof *t->hits));
  t->hits[t->num_hits++] = (hit){triangle, sign};
  return REMAP_OK;
}

/* ---- crossings from a box tree ----------------------------------------------------------------------------------- */

typedef struct collect {
  tracer       *t;
  const rm_lid *triangle_of; /* NULL: items are triangles */
  hit         **list;
  int64_t      *room;
  int          *num;
  remap_status  status;
} collect;

static int collect_hit(void *user, rm_lid item)
{
  collect     *c = user;
  const rm_lid b = c->triangle_of ? c->triangle_of[item] : item;
  const int    s = surely_misses(c->t, b) ? 0 : meets(c->t, b);

  if (!s) return 0;
  c->status = rm_grow(c->list, c->room, *c->num + 1, sizeof **c->list);
  if (c->status != REMAP_OK) return 1;
  (*c->list)[(*c->num)++] = (hit){b, s};
  return 0;
}

static remap_status need_all_tree(tracer *t)
{
  const rm_trimesh *m = t->other;

  if (t->all_tree) return REMAP_OK;
  RM_NEW(t->all_box, t->scratch, m->num_triangles);
  for (rm_lid b = 0; b < m->num_triangles; b++) {
    const double *v[3] = {m->vertex[m->triangle[b][0]], m->vertex[m->triangle[b][1]], m->vertex[m->triangle[b][2]]};
    for (int c = 0; c < 3; c++) {
      t->all_box[b][c]     = fmin(v[0][c], fmin(v[1][c], v[2][c]));
      t->all_box[b][c + 3] = fmax(v[0][c], fmax(v[1][c], v[2][c]));
    }
  }
  return rm_boxtree_build(t->scratch, m->num_triangles, (const double (*)[6])t->all_box, &t->all_tree);
}

/* All crossings of the present edge, ascending along it, into t->hits. */
static remap_status all_hits(tracer *t)
{
  collect c = {t, NULL, &t->hits, &t->hits_room, &t->num_hits, REMAP_OK};

  RM_TRY(need_all_tree(t));
  t->num_hits = 0;
  rm_boxtree_query_segment(t->all_tree, (const double (*)[6])t->all_box, t->p0, t->p1, collect_hit, &c);
  RM_TRY(c.status);
  sort_hits(t, t->hits, t->num_hits);
  return REMAP_OK;
}

static remap_status need_skin_hits(tracer *t)
{
  collect c = {t, t->other->skin, &t->skin_hits, &t->skin_room, &t->num_skin, REMAP_OK};

  if (t->num_skin >= 0) return REMAP_OK;
  t->num_skin = 0;
  rm_boxtree_query_segment(t->other->skin_tree, t->other->skin_box, t->p0, t->p1, collect_hit, &c);
  RM_TRY(c.status);
  sort_hits(t, t->skin_hits, t->num_skin);
  return REMAP_OK;
}

/* ---- walking by adjacency ---------------------------------------------------------------------------------------- */

/* What lies ahead on the walk: a crossing, the edge's end, or something adjacency cannot answer. */
typedef enum ahead { AHEAD_CROSSING, AHEAD_END, AHEAD_TANGLED } ahead;

/* Signs of the present edge's line against the edges of cell c. Exact. */
static void line_sides(const tracer *t, rm_lid c, int8_t *side)
{
  const rm_trimesh *m = t->other;
  const rm_lid  first = m->cell_vertex_offset[c], nv = m->cell_vertex_offset[c + 1] - first;
  const rm_lid  first_edge = m->cell_edge_offset[c], ne = m->cell_edge_offset[c + 1] - first_edge;
  const uint8_t (*end)[2] = m->cell_edge_end + first_edge;
  const int     i = t->axis[0], j = t->axis[1], k = t->axis[2];
  const double  pi = t->p0[i], pj = t->p0[j], pk = t->p0[k], si = t->shear[0], sj = t->shear[1];
  const double  flip = t->u[k] < 0 ? -1 : 1;
  const double *box = m->cell_box[c];
  double        x[MAX_LOCAL], y[MAX_LOCAL], reach = 0;
  int           undecided = 0;

  for (int a = 0; a < 3; a++) {
    const double low = fabs(box[a] - t->p0[a]), high = fabs(box[a + 3] - t->p0[a]);
    reach = low > reach ? low : reach;
    reach = high > reach ? high : reach;
  }
  for (rm_lid v = 0; v < nv; v++) {
    const double *q = m->vertex[m->cell_vertex[first + v]];
    const double  z = q[k] - pk;
    x[v] = ((q[i] - pi) - si * z) * flip;
    y[v] = (q[j] - pj) - sj * z;
  }
  const double bound = LINE_NOISE * reach * reach;
  for (rm_lid f = 0; f < ne; f++) {
    const double d = x[end[f][0]] * y[end[f][1]] - x[end[f][1]] * y[end[f][0]];
    const int    s = (d > bound) - (d < -bound);
    side[f] = (int8_t)s;
    undecided += s == 0;
  }
  if (undecided)
    for (rm_lid f = 0; f < ne; f++)
      if (!side[f]) side[f] = (int8_t)edge_side(t, m->cell_edge[first_edge + f]);
}

/* The crossing ahead of `last` (triangle -1: the walk's start) among those of the line with cell c when there are several. */
static ahead nearest_hit(const tracer *t, const hit *list, int n, hit last, int dir, hit *next)
{
  const double *start = dir > 0 ? t->p0 : t->p1;
  int           best = -1;

  for (int k = 0; k < n; k++) {
    if (list[k].triangle == last.triangle) continue;
    const bool is_ahead = last.triangle < 0 ? end_side(t, list[k].triangle, start) == -list[k].sign * dir
                                            : order(t, last.triangle, list[k].triangle) * dir < 0;
    if (!is_ahead) continue;
    if (best >= 0) {
      const int o = order(t, list[k].triangle, list[best].triangle) * dir;
      if (o == 0) return AHEAD_TANGLED;
      if (o > 0) continue;
    }
    best = k;
  }
  if (best < 0) return AHEAD_TANGLED;
  *next = list[best];
  return AHEAD_CROSSING;
}

/* Where the walk leaves cell c, which it entered through `last` or starts in. dir: +1 from p0 to p1. */
static ahead leave_cell(const tracer *t, rm_lid c, hit last, int dir, hit *next)
{
  const rm_trimesh *m = t->other;
  const rm_lid  first = m->cell_triangle_offset[c], nt = m->cell_triangle_offset[c + 1] - first;
  const uint8_t (*edge)[3] = m->cell_triangle_edge + first;
  int8_t        side[MAX_LOCAL];
  hit           list[2 * MAX_LOCAL];
  int           n = 0, exits = 0, exit = 0;

  line_sides(t, c, side);
  for (rm_lid a = 0; a < nt; a++) {
    const int s = crossing_sign(side[edge[a][0]], side[edge[a][1]], side[edge[a][2]]);
    if (!s) continue;
    list[n] = (hit){m->cell_triangle[first + a] / 2, s};
    if (((m->cell_triangle[first + a] & 1) ? -s : s) * dir > 0) exits++, exit = n;
    n++;
  }
  if (exits == 1 && n == 2) { /* in once, out once */
    *next = list[exit];
    if (next->triangle == last.triangle) return AHEAD_TANGLED;
  } else {
    if (nearest_hit(t, list, n, last, dir, next) != AHEAD_CROSSING) return AHEAD_TANGLED;
    if (m->side[next->triangle][next->sign * dir > 0 ? 0 : 1] != c) return AHEAD_TANGLED;
  }
  return end_side(t, next->triangle, dir > 0 ? t->p1 : t->p0) == next->sign * dir ? AHEAD_CROSSING : AHEAD_END;
}

/* Where the walk meets the skin again from outside. */
static ahead enter_mesh(const tracer *t, hit last, int dir, hit *next)
{
  for (int k = 0; k < t->num_skin; k++) {
    const hit h = t->skin_hits[dir > 0 ? k : t->num_skin - 1 - k];
    if (last.triangle >= 0) {
      const int o = order(t, last.triangle, h.triangle) * dir;
      if (h.triangle == last.triangle || o > 0) continue;
      if (o == 0) return AHEAD_TANGLED;
    }
    *next = h;
    return t->other->side[h.triangle][h.sign * dir > 0 ? 0 : 1] == RM_OUTSIDE ? AHEAD_CROSSING : AHEAD_TANGLED;
  }
  return AHEAD_END;
}

/* What a way of finding the crossings came to. */
typedef enum walked { WALKED, WALK_TOGETHER, WALK_NOT } walked;

/* Follow the present edge from cell *at, entered through `last` or started in, until it ends or comes out of the mesh; *at becomes
 * where it is then. Cells may ask for no more than `most`, an RM_WALK_. */
static remap_status follow(tracer *t, rm_lid *at, hit *last, int dir, int most, walked *how)
{
  hit next = {-1, 0};

  while (*at >= 0) {
    if (t->other->cell_walk[*at] > most) {
      *how = t->other->cell_walk[*at] == RM_WALK_NOT ? WALK_NOT : WALK_TOGETHER;
      return REMAP_OK;
    }
    const ahead what = leave_cell(t, *at, *last, dir, &next);
    if (what == AHEAD_TANGLED || t->num_hits > 2 * t->other->num_triangles) {
      *how = WALK_NOT;
      return REMAP_OK;
    }
    if (what == AHEAD_END) break;
    RM_TRY(push_hit(t, next.triangle, next.sign));
    *at   = t->other->side[next.triangle][next.sign * dir > 0 ? 1 : 0];
    *last = next;
  }
  *how = WALKED;
  return REMAP_OK;
}

/* Walk the present edge from one end, in state *state there, to the other, in one cell or outside all the way. hits receive the
 * crossings in walking order, *state the state at the far end; it is unchanged unless *how is WALKED. */
static remap_status walk_alone(tracer *t, int dir, rm_lid *state, walked *how)
{
  rm_lid at   = *state;
  hit    last = {-1, 0}, next;
  ahead  what;

  t->num_hits = 0;
  *how        = WALK_TOGETHER;
  if (at < RM_OUTSIDE) return REMAP_OK;
  for (;;) {
    RM_TRY(follow(t, &at, &last, dir, RM_WALK_ALONE, how));
    if (*how != WALKED) return REMAP_OK;
    if (at >= 0) break;
    RM_TRY(need_skin_hits(t));
    what = enter_mesh(t, last, dir, &next);
    if (what == AHEAD_TANGLED) *how = WALK_NOT;
    if (what == AHEAD_TANGLED) return REMAP_OK;
    if (what == AHEAD_END) break;
    RM_TRY(push_hit(t, next.triangle, next.sign));
    at   = t->other->side[next.triangle][next.sign * dir > 0 ? 1 : 0];
    last = next;
  }
  *state = at;
  return REMAP_OK;
}

/* Where skins overlap or nearly so, the edge may be in several cells at once. Each of them is followed by itself, from the start or
 * from the skin where it comes in, to the end or to the skin where it goes out: star-shaped cells joined by their faces know of no
 * others. hits receive all crossings, ascending along the edge. */
static remap_status walk_together(tracer *t, int dir, rm_lid state, walked *how)
{
  const rm_lid     *side;
  const rm_winding  single = {state, 1}, *list = &single;
  rm_lid            num = state >= 0, out = 0, going_out = 0;

  if (state < RM_OUTSIDE) {
    list = t->states.winding + t->states.offset[-2 - state];
    num  = t->states.offset[-1 - state] - t->states.offset[-2 - state];
  }
  t->num_hits = 0;
  *how        = WALK_NOT;
  RM_TRY(need_skin_hits(t));
  for (rm_lid k = 0; k < num + t->num_skin; k++) {
    hit    last = {-1, 0};
    rm_lid at;

    if (k < num) {
      if (list[k].number != 1) return REMAP_OK;
      at = list[k].cell;
    } else {
      last = t->skin_hits[k - num];
      side = t->other->side[last.triangle];
      at   = side[last.sign * dir > 0 ? 1 : 0];
      if (at < 0) {
        going_out++;
        continue;
      }
      RM_TRY(push_hit(t, last.triangle, last.sign));
    }
    RM_TRY(follow(t, &at, &last, dir, RM_WALK_TOGETHER, how));
    if (*how != WALKED) return REMAP_OK;
    out += at < 0;
  }
  *how = out == going_out ? WALKED : WALK_NOT;
  sort_hits(t, t->hits, t->num_hits);
  return REMAP_OK;
}

/* ---- one edge ---------------------------------------------------------------------------------------------------- */

static double parameter(const tracer *t, rm_lid b)
{
  const rm_lid *v = t->other->triangle[b];
  return rm_crossing_parameter(t->p0, t->p1, t->other->vertex[v[0]], t->other->vertex[v[1]], t->other->vertex[v[2]]);
}

static void reverse(hit *h, int n)
{
  for (int i = 0, k = n - 1; i < k; i++, k--) {
    const hit x = h[i];
    h[i]        = h[k];
    h[k]        = x;
  }
}

/* The edge's box misses the box of the other mesh. */
static bool is_far(const tracer *t, rm_lid e)
{
  const double *p = t->own->vertex[t->own->edge[e][0]], *q = t->own->vertex[t->own->edge[e][1]], *box = t->other->box;

  for (int c = 0; c < 3; c++)
    if ((p[c] < box[c] && q[c] < box[c]) || (p[c] > box[c + 3] && q[c] > box[c + 3])) return true;
  return false;
}

/* Trace edge e from the end that has state *state; *state becomes the other end's. */
static remap_status trace_edge(tracer *t, rm_lid e, int dir, rm_lid *state)
{
  rm_lid at  = *state;
  walked how = WALK_NOT;

  if (at == RM_OUTSIDE && is_far(t, e)) {
    t->first[e] = t->num_crossings;
    t->count[e] = 0;
    t->state[e] = RM_OUTSIDE;
    return REMAP_OK;
  }
  set_line(t, t->own->vertex[t->own->edge[e][0]], t->own->vertex[t->own->edge[e][1]]);
  if (!t->by_tree) RM_TRY(walk_alone(t, dir, state, &how));
  if (how == WALKED) {
    if (dir < 0) reverse(t->hits, t->num_hits);
  } else {
    if (how == WALK_TOGETHER) RM_TRY(walk_together(t, dir, *state, &how));
    if (how != WALKED) RM_TRY(all_hits(t));
    for (int k = 0; k < t->num_hits; k++)
      RM_TRY(rm_states_cross(&t->states, *state, t->other->side[t->hits[k].triangle], t->hits[k].sign * dir, state));
  }
  at = dir > 0 ? at : *state;
  RM_TRY(rm_grow(&t->crossing, &t->crossing_room, t->num_crossings + t->num_hits, sizeof *t->crossing));
  t->first[e] = t->num_crossings;
  t->count[e] = t->num_hits;
  t->state[e] = at;
  for (int k = 0; k < t->num_hits; k++) {
    const hit h = t->hits[k];
    RM_TRY(rm_states_cross(&t->states, at, t->other->side[h.triangle], h.sign, &at));
    t->crossing[t->num_crossings++] = (rm_crossing){parameter(t, h.triangle), 2 * h.triangle + (h.sign < 0), at, e};
  }
  return REMAP_OK;
}

/* ---- the whole mesh ---------------------------------------------------------------------------------------------- */

/* State of a point, by a ray along x to beyond the other mesh. */
static remap_status locate(tracer *t, const double *p, rm_lid *state)
{
  const rm_trimesh *m = t->other;

  *state = RM_OUTSIDE;
  if (p[0] > m->box[3] || p[1] < m->box[1] || p[1] > m->box[4] || p[2] < m->box[2] || p[2] > m->box[5]) return REMAP_OK;
  t->beyond[0] = 2; /* every coordinate is below 1 in magnitude */
  t->beyond[1] = p[1], t->beyond[2] = p[2];
  set_line(t, p, t->beyond);
  if (t->all_tree) {
    RM_TRY(all_hits(t));
    for (int k = 0; k < t->num_hits; k++)
      RM_TRY(rm_states_cross(&t->states, *state, m->side[t->hits[k].triangle], -t->hits[k].sign, state));
    return REMAP_OK;
  }
  for (rm_lid b = 0; b < m->num_triangles; b++) {
    const double *v[3] = {m->vertex[m->triangle[b][0]], m->vertex[m->triangle[b][1]], m->vertex[m->triangle[b][2]]};

    if ((v[0][1] < p[1] && v[1][1] < p[1] && v[2][1] < p[1]) || (v[0][1] > p[1] && v[1][1] > p[1] && v[2][1] > p[1])) continue;
    if ((v[0][2] < p[2] && v[1][2] < p[2] && v[2][2] < p[2]) || (v[0][2] > p[2] && v[1][2] > p[2] && v[2][2] > p[2])) continue;
    if (v[0][0] < p[0] && v[1][0] < p[0] && v[2][0] < p[0]) continue;
    const int s = meets(t, b);
    if (s) RM_TRY(rm_states_cross(&t->states, *state, m->side[b], -s, state));
  }
  return REMAP_OK;
}

enum {
  UNKNOWN       = INT32_MAX, /* no state yet */
  LOCATED_PLAIN = 4,         /* so many components are located without a tree */
  STEP          = 1 << 14    /* edges between two calls of progress */
};

static remap_status colour(tracer *t, const rm_progress *progress, rm_lid *bad_edge)
{
  const rm_trimesh *m = t->own;
  rm_lid           *where, *stack, depth = 0, done = 0, components = 0;

  RM_NEW(where, t->scratch, m->num_vertices);
  RM_NEW(stack, t->scratch, m->num_vertices);
  for (rm_lid v = 0; v < m->num_vertices; v++) where[v] = UNKNOWN;
  for (rm_lid e = 0; e < m->num_edges; e++) t->count[e] = -1;
  for (rm_lid seed = 0; seed < m->num_vertices; seed++) {
    if (where[seed] != UNKNOWN) continue;
    if (++components == LOCATED_PLAIN) RM_TRY(need_all_tree(t));
    RM_TRY(locate(t, m->vertex[seed], &where[seed]));
    stack[depth++] = seed;
    while (depth > 0) {
      const rm_lid v = stack[--depth];

      for (rm_lid k = m->vertex_edge_offset[v]; k < m->vertex_edge_offset[v + 1]; k++) {
        const rm_lid e = m->vertex_edge[k], dir = m->edge[e][0] == v ? 1 : -1, w = m->edge[e][dir > 0 ? 1 : 0];
        rm_lid       state = where[v];

        if (t->count[e] >= 0) continue;
        RM_TRY(trace_edge(t, e, dir, &state));
        if (where[w] == UNKNOWN) where[w] = state, stack[depth++] = w;
        if (where[w] != state) {
          *bad_edge = e;
          return REMAP_INCONSISTENT;
        }
        if (++done % STEP == 0 && progress && progress->call &&
            progress->call(progress->user, t->moved > 0 ? "tracing of source edges" : "tracing of target edges", (double)done / m->num_edges))
          return REMAP_CANCELLED;
      }
    }
  }
  return REMAP_OK;
}

/* The crossings in the order of their edges, as neighbours in space are neighbours in memory then. */
static remap_status keep(rm_arena *arena, const tracer *t, rm_trace *out)
{
  int64_t     *first;
  const rm_lid num_winding = t->states.offset[t->states.num];
  rm_crossing *crossing;
  rm_lid      *offset;
  rm_winding  *winding;

  RM_NEW(crossing, arena, t->num_crossings);
  RM_NEW(offset, arena, (int64_t)t->states.num + 1);
  RM_NEW(winding, arena, num_winding);
  RM_NEW(first, arena, t->own->num_edges);
  for (int64_t e = 0, n = 0; e < t->own->num_edges; n += t->count[e++]) {
    first[e] = n;
    for (rm_lid k = 0; k < t->count[e]; k++) crossing[n + k] = t->crossing[t->first[e] + k];
  }
  memcpy(offset, t->states.offset, sizeof *offset * ((size_t)t->states.num + 1));
  if (num_winding) memcpy(winding, t->states.winding, sizeof *winding * (size_t)num_winding);
  *out = (rm_trace){t->num_crossings, crossing, first, t->count, t->state, offset, winding, t->states.num};
  return REMAP_OK;
}

remap_status rm_trace_build(rm_arena *arena, const rm_trimesh *own, const rm_trimesh *other, int moved, bool by_tree,
                            const rm_progress *progress, rm_trace *out, rm_lid *bad_edge)
{
  tracer       t = {.own = own, .other = other, .moved = moved, .by_tree = by_tree, .scratch = rm_arena_new()};
  remap_status status = t.scratch ? REMAP_OK : REMAP_NO_MEMORY;

  if (status != REMAP_OK) goto done;
  RM_GOTO(done, status = rm_states_init(&t.states));
  t.first = rm_arena_alloc(t.scratch, own->num_edges, sizeof *t.first);
  t.count = rm_arena_alloc(arena, own->num_edges, sizeof *t.count);
  t.state = rm_arena_alloc(arena, own->num_edges, sizeof *t.state);
  RM_GOTO(done, status = t.first && t.count && t.state ? REMAP_OK : REMAP_NO_MEMORY);
  RM_GOTO(done, status = colour(&t, progress, bad_edge));
  status = keep(arena, &t, out);
done:
  rm_states_free(&t.states);
  free(t.hits);
  free(t.skin_hits);
  free(t.crossing);
  rm_arena_drop(t.scratch);
  return status;
}
