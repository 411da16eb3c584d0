/* trace -- edge tracing with label colouring (DESIGN 2.3).
 *
 * Vertices are taken in their order, which is that of space, and every edge carries the state of its first vertex to its
 * second. A vertex that no edge has reached before gets its state from the vertex before it, by a walk along the straight line
 * between them, the first one from a point outside. So crossings are found in the order of their edges.
 *
 * In a cell, the edge's line is looked along: the cell's vertices are taken in a frame sheared so that the edge runs along an
 * axis, and a panel (a triangle, or a planar face of four sides) is crossed if the line, now a point, lies in it. Most panels
 * lie to one side as a whole, which bits per vertex tell; for the others it takes a determinant of 2x2 per side, with one error
 * bound for the cell. What the bound cannot decide goes to the exact predicate. Cost: O(panels of the cell) per crossing by
 * adjacency, O(log n + hits) per edge by the box tree.
 *
 * Whatever triangle is met, a crossing is spoken of as one with its facet, that is with the triangle this is called by. */
#include "overlay/trace.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "overlay/states.h"

/* A crossing found: what a facet of the other mesh is called by and the sign of the crossing seen along the edge from its first
 * vertex. */
typedef struct hit {
  rm_lid triangle;
  int    sign;
} hit;

enum {
  MAX_LOCAL = 256,
  CLEARANCE = 2 /* lengths of an edge around it that are to be free of skin */
};

/* Error of an edge's side against a line in the sheared frame, by the square of the reach of its coordinates. With u = 2^-53:
 * differences err by u, shears by 3 u, so sheared coordinates, at most 2 reach, by 8 u reach; their products and the difference
 * of these by less than 80 u reach^2. */
#define LINE_NOISE 0x1p-46
/* Of a sheared coordinate, by the reach. */
#define POINT_NOISE 0x1p-49
/* Of the sum, over a triangle's corners, of such a side by the corner's height over the edge's end, by the square of the reach
 * and the largest height: three products, each off by 80 u reach^2 times the height and 8 reach^2 times 4 u of it, and their
 * sum by as much again. */
#define HEIGHT_NOISE 0x1p-43

typedef struct tracer {
  const rm_trimesh *own, *other;
  int               moved;
  bool              by_tree; /* every edge */
  rm_arena         *scratch;
  rm_states         states;
  const rm_boxtree *all_tree; /* over all triangles of other; built when first needed */
  const double    (*all_box)[6];
  hit              *hits; /* crossings of the present edge, ascending along it */
  int64_t           hits_room;
  int               num_hits;
  hit              *skin_hits; /* crossings of the present edge with the skin, ascending along it */
  int64_t           skin_room;
  int               num_skin; /* -1: not asked for yet */
  int               skin_behind; /* so many of them lie behind the walk */
  const double     *tried;       /* start of the edge for which clear was sought last */
  double            clear[6];    /* a box that no skin enters                         */
  rm_crossing      *crossing;
  int64_t           num_crossings, crossing_room;
  int64_t          *first;
  rm_lid           *count, *state;
  /* the present edge */
  const double     *p0, *p1;
  double            u[3], shear[2]; /* p1 - p0; u[axis[0]] / u[axis[2]], u[axis[1]] / u[axis[2]] */
  int               axis[3];        /* axis[2] is the edge's longest direction; a cyclic permutation of x, y, z */
  int               turn;           /* -1 if the edge runs down that axis, else 1 */
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
  t->turn    = t->u[k] < 0 ? -1 : 1;
  t->shear[0] = t->u[t->axis[0]] / t->u[k];
  t->shear[1] = t->u[t->axis[1]] / t->u[k];
  t->num_skin    = -1;
  t->skin_behind = 0;
}

static int edge_side(const tracer *t, rm_lid f)
{
  const rm_trimesh *m = t->other;
  return rm_edge_side(t->p0, t->p1, m->vertex[m->edge[f][0]], m->vertex[m->edge[f][1]], t->moved, NULL);
}

/* Sign with which the present edge's line crosses triangle b. Exact. */
static int line_crosses(const tracer *t, rm_lid b)
{
  const rm_lid *e = t->other->triangle_edge[b];
  const int     s = edge_side(t, e[0]);
  return s && edge_side(t, e[1]) == s && edge_side(t, e[2]) == -s ? s : 0;
}

/* What the filter of crosses tells about one triangle: true if the present edge's line passes it by. */
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
    reach = rm_max(reach, rm_max(fabs(dx), rm_max(fabs(dy), fabs(dz))));
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
  const int s = line_crosses(t, b);
  return s && end_side(t, b, t->p0) == -s && end_side(t, b, t->p1) == s ? s : 0;
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
static bool comes_before(const tracer *t, hit a, hit b)
{
  const int o = order(t, a.triangle, b.triangle);
  return o < 0 || (o == 0 && a.triangle < b.triangle);
}

/* Put x into the heap of n hits whose root `at` is free. */
static void sift_hit(const tracer *t, hit *h, int at, int n, hit x)
{
  for (int child; (child = 2 * at + 1) < n; at = child) {
    if (child + 1 < n && comes_before(t, h[child], h[child + 1])) child++;
    if (!comes_before(t, x, h[child])) break;
    h[at] = h[child];
  }
  h[at] = x;
}

enum { FEW_HITS = 16 };

/* Few by insertion, many by a heap: an edge may cross a hundred thousand triangles. */
static void sort_hits(const tracer *t, hit *h, int n)
{
  for (int i = 1; i < n && n <= FEW_HITS; i++) {
    const hit x = h[i];
    int       k = i;
    for (; k > 0 && comes_before(t, x, h[k - 1]); k--) h[k] = h[k - 1];
    h[k] = x;
  }
  if (n <= FEW_HITS) return;
  for (int i = n / 2; i-- > 0;) sift_hit(t, h, i, n, h[i]);
  for (int i = n; i-- > 1;) {
    const hit x = h[i];

    h[i] = h[0];
    sift_hit(t, h, 0, i, x);
  }
}

/* The crossing of triangle b with sign s as one of its facet. */
static inline hit hit_of(const rm_trimesh *m, rm_lid b, int s)
{
  const rm_lid facet = rm_facet_of(m, b);
  return (hit){facet / 2, facet & 1 ? -s : s};
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
  (*c->list)[(*c->num)++] = hit_of(c->t->other, b, s);
  return 0;
}

static remap_status need_all_tree(tracer *t)
{
  const rm_trimesh *m = t->other;
  double          (*box)[6];

  if (t->all_tree) return REMAP_OK;
  if (m->num_skin == m->num_triangles) { /* a closed surface: all is skin, in the same order */
    t->all_tree = m->skin_tree;
    t->all_box  = m->skin_box;
    return REMAP_OK;
  }
  RM_NEW(box, t->scratch, m->num_triangles);
  for (rm_lid b = 0; b < m->num_triangles; b++) {
    const double *v[3] = {m->vertex[m->triangle[b][0]], m->vertex[m->triangle[b][1]], m->vertex[m->triangle[b][2]]};
    for (int c = 0; c < 3; c++) {
      box[b][c]     = fmin(v[0][c], fmin(v[1][c], v[2][c]));
      box[b][c + 3] = fmax(v[0][c], fmax(v[1][c], v[2][c]));
    }
  }
  t->all_box = (const double (*)[6])box;
  return rm_boxtree_build(t->scratch, m->num_triangles, t->all_box, &t->all_tree);
}

/* All crossings of the present edge, ascending along it, into t->hits. */
static remap_status all_hits(tracer *t)
{
  collect c = {t, NULL, &t->hits, &t->hits_room, &t->num_hits, REMAP_OK};

  RM_TRY(need_all_tree(t));
  t->num_hits = 0;
  rm_boxtree_query_segment(t->all_tree, t->all_box, t->p0, t->p1, collect_hit, &c);
  RM_TRY(c.status);
  sort_hits(t, t->hits, t->num_hits);
  return REMAP_OK;
}

/* True if the edge's box lies in one that no skin enters. Around a new start, such a box is sought. */
static bool is_clear(tracer *t)
{
  double box[6], room[6], size = 0;
  bool   inside = true;

  for (int c = 0; c < 3; c++) {
    box[c]     = t->p0[c] < t->p1[c] ? t->p0[c] : t->p1[c];
    box[c + 3] = t->p0[c] < t->p1[c] ? t->p1[c] : t->p0[c];
    size       = box[c + 3] - box[c] > size ? box[c + 3] - box[c] : size;
    inside     = inside && box[c] >= t->clear[c] && box[c + 3] <= t->clear[c + 3];
  }
  if (inside || t->tried == t->p0) return inside;
  t->tried = t->p0;
  for (int c = 0; c < 3; c++) room[c] = box[c] - CLEARANCE * size, room[c + 3] = box[c + 3] + CLEARANCE * size;
  if (rm_boxtree_meets(t->other->skin_tree, t->other->skin_box, room)) return false;
  memcpy(t->clear, room, sizeof t->clear);
  return true;
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

/* The vertices of a cell as seen along the present edge, from p0, which is at (0, 0, 0). */
typedef struct view {
  double  x[MAX_LOCAL], y[MAX_LOCAL], z[MAX_LOCAL];
  uint8_t beside[MAX_LOCAL]; /* bits: surely to the right of the line, to the left, above, below */
  double  reach;             /* largest difference to p0 along any axis                          */
} view;

/* Two numbers side by side, one in each lane of a vector register, and what comparing them gives. */
typedef double  lanes __attribute__((vector_size(16)));
typedef int64_t flags __attribute__((vector_size(16)));

static void look_along(const tracer *t, rm_lid c, view *w)
{
  const rm_trimesh *m = t->other;
  const rm_lid *restrict vertex = m->cell_vertex + m->cell_vertex_offset[c];
  const rm_lid  nv = m->cell_vertex_offset[c + 1] - m->cell_vertex_offset[c];
  const int     i = t->axis[0], j = t->axis[1], k = t->axis[2];
  const lanes   p = {t->p0[i], t->p0[j]}, shear = {t->shear[0], t->shear[1]};
  const double  pz = t->p0[k], *box = m->cell_box[c];
  double        reach = 0;

  for (int a = 0; a < 3; a++) {
    const double low = fabs(box[a] - t->p0[a]), high = fabs(box[a + 3] - t->p0[a]);
    reach = low > reach ? low : reach;
    reach = high > reach ? high : reach;
  }
  const double near = POINT_NOISE * reach;
  const lanes  above = {near, near}, below = {-near, -near};
  for (rm_lid v = 0; v < nv; v++) {
    const double *q = m->vertex[vertex[v]], z = q[k] - pz;
    const lanes   at = ((lanes){q[i], q[j]} - p) - shear * (lanes){z, z};
    const flags   side = ((flags)(at > above) & (flags){1, 4}) | ((flags)(at < below) & (flags){2, 8});
    w->x[v]      = at[0];
    w->y[v]      = at[1];
    w->z[v]      = z;
    w->beside[v] = (uint8_t)(side[0] | side[1]);
  }
  w->reach = reach;
}

/* The sides of a polygon of n corners v against the line, as determinants of 2x2: all positive or all negative if it is
 * crossed. */
static inline void sides(const view *w, const uint8_t *v, int n, double *d)
{
  for (int h = 0; h < n; h++) {
    const uint8_t a = v[h], b = v[h + 1 < n ? h + 1 : 0];
    d[h] = w->x[a] * w->y[b] - w->x[b] * w->y[a];
  }
}

/* crosses, where sign[h] holds those sides that are certain, else 0. */
static __attribute__((noinline)) int crosses_closely(const tracer *t, rm_lid c, const uint8_t *v, int n, const int *sign)
{
  const rm_trimesh *m      = t->other;
  const rm_lid     *vertex = m->cell_vertex + m->cell_vertex_offset[c];
  int               all    = 0;

  for (int h = 0; h < n && !all; h++) all = sign[h];
  for (int h = 0; h < n; h++) {
    const uint8_t a = v[h], b = v[h + 1 < n ? h + 1 : 0];
    if (sign[h] || a == b) continue;
    const int s = rm_edge_side(t->p0, t->p1, m->vertex[vertex[a]], m->vertex[vertex[b]], t->moved, NULL);
    if (!s || (all && s != all)) return 0;
    all = s;
  }
  return all;
}

/* Sign with which the line crosses a panel of cell c, whose n corners are v in the view: of n = 4, the last two may be one.
 * Exact. */
static inline int crosses(const tracer *t, const view *w, rm_lid c, const uint8_t *v, int n)
{
  const double bound = LINE_NOISE * w->reach * w->reach;
  double       d[4];
  int          sign[4], along = 0, against = 0;

  sides(w, v, n, d);
  for (int h = 0; h < n; h++) {
    along += d[h] > bound;
    against += d[h] < -bound;
    sign[h] = t->turn * ((d[h] > bound) - (d[h] < -bound));
  }
  if (along && against) return 0;
  if (along == n || against == n) return sign[0];
  return crosses_closely(t, c, v, n, sign);
}

/* The edge ends before it meets facet next, which its line crosses; with sign s about the normal of corners v, which lie in it.
 * Exact. */
static inline bool ends_before(const tracer *t, const view *w, const uint8_t v[3], int s, hit next)
{
  const double end = t->u[t->axis[2]], largest = w->reach + fabs(end);
  double       d[3], sum;

  sides(w, v, 3, d);
  sum = d[1] * (w->z[v[0]] - end) + d[2] * (w->z[v[1]] - end) + d[0] * (w->z[v[2]] - end); /* of the sign of d, turned */
  if (fabs(sum) > HEIGHT_NOISE * w->reach * w->reach * largest) return (sum > 0) == (s > 0);
  return end_side(t, next.triangle, t->p1) != next.sign;
}

/* The crossing ahead of `last` (triangle -1: the walk's start) among those of the line with cell c when there are several. */
static ahead nearest_hit(const tracer *t, const hit *list, int n, hit last, int *next)
{
  int best = -1;

  for (int k = 0; k < n; k++) {
    if (list[k].triangle == last.triangle) continue;
    const bool is_ahead = last.triangle < 0 ? end_side(t, list[k].triangle, t->p0) == -list[k].sign
                                            : order(t, last.triangle, list[k].triangle) < 0;
    if (!is_ahead) continue;
    if (best >= 0) {
      const int o = order(t, list[k].triangle, list[best].triangle);
      if (o == 0) return AHEAD_TANGLED;
      if (o > 0) continue;
    }
    best = k;
  }
  *next = best;
  return best < 0 ? AHEAD_TANGLED : AHEAD_CROSSING;
}

/* leave_cell, in a mesh whose panels have n corners. */
static inline __attribute__((always_inline)) ahead leave_by(const tracer *t, rm_lid c, hit last, hit *next,
                                                            const uint8_t *corner, int n_corners)
{
  const rm_trimesh *m     = t->other;
  const rm_lid      first = m->panel_offset[c], num = m->panel_offset[c + 1] - first;
  const rm_lid     *panel = m->panel + first;
  view              w;
  uint8_t           near[MAX_LOCAL], place[MAX_LOCAL];
  hit               list[MAX_LOCAL];
  int               num_near = 0, n = 0, exits = 0, exit = 0;

  look_along(t, c, &w);
  for (rm_lid a = 0; a < num; a++) {
    const uint8_t *v = corner + n_corners * (first + a);
    uint8_t        beside = w.beside[v[0]] & w.beside[v[1]] & w.beside[v[2]];

    if (n_corners == 4) beside &= w.beside[v[3]];
    near[num_near] = (uint8_t)a;
    num_near += !beside;
  }
  for (int k = 0; k < num_near; k++) {
    const rm_lid   a = near[k], b = panel[a] / 2, facet = n_corners == 3 ? b : rm_facet_of(m, b) / 2;
    const uint8_t *v = corner + n_corners * (first + a);
    const int      s = facet != last.triangle ? crosses(t, &w, c, v, n_corners) : b == facet ? last.sign : 0;

    if (!s) continue;
    list[n]  = n_corners == 3 ? (hit){b, s} : hit_of(m, b, s);
    place[n] = near[k];
    if ((panel[a] & 1 ? -s : s) > 0) exits++, exit = n;
    n++;
  }
  if (exits == 1 && n == 2) { /* in once, out once */
    if (list[exit].triangle == last.triangle) return AHEAD_TANGLED;
  } else {
    if (nearest_hit(t, list, n, last, &exit) != AHEAD_CROSSING) return AHEAD_TANGLED;
    if (m->side[list[exit].triangle][list[exit].sign > 0 ? 0 : 1] != c) return AHEAD_TANGLED;
  }
  *next = list[exit];
  const int s = n_corners == 4 && rm_facet_of(m, panel[place[exit]] / 2) & 1 ? -next->sign : next->sign;
  return ends_before(t, &w, corner + n_corners * (first + place[exit]), s, *next) ? AHEAD_END : AHEAD_CROSSING;
}

/* Where the walk leaves cell c, which it entered through `last` or starts in. */
static ahead leave_cell(const tracer *t, rm_lid c, hit last, hit *next)
{
  const rm_trimesh *m = t->other;

  if (m->panel_corner) return leave_by(t, c, last, next, m->panel_corner[0], 4);
  return leave_by(t, c, last, next, m->cell_triangle_vertex[0], 3);
}

/* Where the walk meets the skin again from outside. */
static ahead enter_mesh(tracer *t, hit last, hit *next)
{
  for (; t->skin_behind < t->num_skin; t->skin_behind++) {
    const hit h = t->skin_hits[t->skin_behind];
    if (last.triangle >= 0) {
      const int o = order(t, last.triangle, h.triangle);
      if (h.triangle == last.triangle || o > 0) continue;
      if (o == 0) return AHEAD_TANGLED;
    }
    *next = h;
    return t->other->side[h.triangle][h.sign > 0 ? 0 : 1] == RM_OUTSIDE ? AHEAD_CROSSING : AHEAD_TANGLED;
  }
  return AHEAD_END;
}

/* What a way of finding the crossings came to. */
typedef enum walked { WALKED, WALK_TOGETHER, WALK_NOT } walked;

/* Follow the present edge from cell *at, entered through `last` or started in, until it ends or comes out of the mesh; *at
 * becomes where it is then. Cells may ask for no more than `most`, an RM_WALK_. */
static remap_status follow(tracer *t, rm_lid *at, hit *last, int most, walked *how)
{
  hit next = {-1, 0};

  while (*at >= 0) {
    if (t->other->cell_walk[*at] > most) {
      *how = t->other->cell_walk[*at] == RM_WALK_NOT ? WALK_NOT : WALK_TOGETHER;
      return REMAP_OK;
    }
    const ahead what = leave_cell(t, *at, *last, &next);
    if (what == AHEAD_TANGLED || t->num_hits > 2 * t->other->num_triangles) {
      *how = WALK_NOT;
      return REMAP_OK;
    }
    if (what == AHEAD_END) break;
    RM_TRY(push_hit(t, next.triangle, next.sign));
    *at   = t->other->side[next.triangle][next.sign > 0 ? 1 : 0];
    *last = next;
  }
  *how = WALKED;
  return REMAP_OK;
}

/* Walk the present edge from its start, in state *state, to its end, in one cell or outside all the way. hits receive the
 * crossings; *state becomes the state at the end, but is unchanged unless *how is WALKED. */
static remap_status walk_alone(tracer *t, rm_lid *state, walked *how)
{
  rm_lid at   = *state;
  hit    last = {-1, 0}, next;
  ahead  what;

  t->num_hits = 0;
  *how        = at == RM_OUTSIDE && is_clear(t) ? WALKED : WALK_TOGETHER;
  if (at < RM_OUTSIDE || *how == WALKED) return REMAP_OK;
  for (;;) {
    RM_TRY(follow(t, &at, &last, RM_WALK_ALONE, how));
    if (*how != WALKED) return REMAP_OK;
    if (at >= 0) break;
    RM_TRY(need_skin_hits(t));
    what = enter_mesh(t, last, &next);
    if (what == AHEAD_TANGLED) *how = WALK_NOT;
    if (what == AHEAD_TANGLED) return REMAP_OK;
    if (what == AHEAD_END) break;
    RM_TRY(push_hit(t, next.triangle, next.sign));
    at   = t->other->side[next.triangle][next.sign > 0 ? 1 : 0];
    last = next;
  }
  *state = at;
  return REMAP_OK;
}

/* Where skins overlap or nearly so, the edge may be in several cells at once. Each of them is followed by itself, from the
 * start or from the skin where it comes in, to the end or to the skin where it goes out: star-shaped cells joined by their
 * faces know of no others. hits receive all crossings. */
static remap_status walk_together(tracer *t, rm_lid state, walked *how)
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
      at   = side[last.sign > 0 ? 1 : 0];
      if (at < 0) {
        going_out++;
        continue;
      }
      RM_TRY(push_hit(t, last.triangle, last.sign));
    }
    RM_TRY(follow(t, &at, &last, RM_WALK_TOGETHER, how));
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

static int is_met(void *user, rm_lid item)
{
  (void)user, (void)item;
  return 1;
}

/* The present edge comes near a cell that may be tangled: that may stick out of the skin, so what is outside may cross it. */
static bool is_near_odd(const tracer *t)
{
  const rm_trimesh *m = t->other;
  return m->num_odd > 0 && rm_boxtree_query_segment(m->odd_tree, m->odd_box, t->p0, t->p1, is_met, NULL);
}

/* The crossings of the line from p0 to p1, which need not be an edge, into t->hits. *state, that of p0, becomes that of p1. */
static remap_status find_hits(tracer *t, const double *p0, const double *p1, rm_lid *state)
{
  walked how = WALK_NOT;

  set_line(t, p0, p1);
  if (!t->by_tree && !is_near_odd(t)) RM_TRY(walk_alone(t, state, &how));
  if (how == WALKED) return REMAP_OK;
  if (how == WALK_TOGETHER) RM_TRY(walk_together(t, *state, &how));
  if (how != WALKED) RM_TRY(all_hits(t));
  for (int k = 0; k < t->num_hits; k++)
    RM_TRY(rm_states_cross(&t->states, *state, t->other->side[t->hits[k].triangle], t->hits[k].sign, state));
  return REMAP_OK;
}

/* Trace edge e, whose first vertex has state *state; *state becomes the second one's. */
static remap_status trace_edge(tracer *t, rm_lid e, rm_lid *state)
{
  rm_lid at = *state;

  RM_TRY(find_hits(t, t->own->vertex[t->own->edge[e][0]], t->own->vertex[t->own->edge[e][1]], state));
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

enum {
  UNKNOWN = INT32_MAX, /* no state yet */
  STEP    = 1 << 14    /* edges between two calls of progress */
};

/* Bits: below and above the box along x, y, z. An edge whose ends share one misses all that is in the box. */
static uint8_t beyond(const double box[6], const double p[3])
{
  int bits = 0;

  for (int c = 0; c < 3; c++) bits |= (p[c] < box[c]) << 2 * c | (p[c] > box[c + 3]) << (2 * c + 1);
  return (uint8_t)bits;
}

/* State of vertex v, from that of vertex `before`, -1: from a point outside. */
static remap_status locate(tracer *t, rm_lid v, rm_lid before, rm_lid *where)
{
  const double *p = t->own->vertex[v], outside[3] = {2, p[1], p[2]}; /* every coordinate is below 1 in magnitude */

  where[v] = before < 0 ? RM_OUTSIDE : where[before];
  return find_hits(t, before < 0 ? outside : t->own->vertex[before], p, &where[v]);
}

static remap_status colour(tracer *t, const rm_progress *progress, rm_lid *bad_edge)
{
  const rm_trimesh *m = t->own;
  rm_lid           *where, last = -1;
  uint8_t          *far;

  RM_NEW(where, t->scratch, m->num_vertices);
  RM_NEW(far, t->scratch, m->num_vertices);
  for (rm_lid v = 0; v < m->num_vertices; v++) {
    far[v]   = beyond(t->other->box, m->vertex[v]);
    where[v] = far[v] ? RM_OUTSIDE : UNKNOWN;
  }
  for (rm_lid e = 0; e < m->num_edges; e++) {
    const rm_lid v = m->edge[e][0], w = m->edge[e][1];
    rm_lid       state;

    if (e % STEP == STEP - 1 && progress && progress->call &&
        progress->call(progress->user, t->moved > 0 ? "tracing of source edges" : "tracing of target edges",
                       (double)e / m->num_edges))
      return REMAP_CANCELLED;
    if (far[v] & far[w] || rm_is_inside_facets(m, e)) {
      t->first[e] = t->num_crossings;
      t->count[e] = 0;
      t->state[e] = RM_OUTSIDE;
      continue;
    }
    if (where[v] == UNKNOWN) RM_TRY(locate(t, v, last, where));
    last  = v;
    state = where[v];
    RM_TRY(trace_edge(t, e, &state));
    if (where[w] == UNKNOWN) where[w] = state;
    if (where[w] != state) {
      *bad_edge = e;
      return REMAP_INCONSISTENT;
    }
  }
  return REMAP_OK;
}

/* What has grown on the way, in the arena. */
static remap_status keep(rm_arena *arena, const tracer *t, rm_trace *out)
{
  const rm_lid num_winding = t->states.offset[t->states.num];
  rm_crossing *crossing;
  rm_lid      *offset;
  rm_winding  *winding;

  RM_NEW(crossing, arena, t->num_crossings);
  RM_NEW(offset, arena, (int64_t)t->states.num + 1);
  RM_NEW(winding, arena, num_winding);
  if (t->num_crossings) memcpy(crossing, t->crossing, sizeof *crossing * (size_t)t->num_crossings);
  memcpy(offset, t->states.offset, sizeof *offset * ((size_t)t->states.num + 1));
  if (num_winding) memcpy(winding, t->states.winding, sizeof *winding * (size_t)num_winding);
  *out = (rm_trace){t->num_crossings, crossing, t->first, t->count, t->state, offset, winding, t->states.num};
  return REMAP_OK;
}

remap_status rm_trace_build(rm_arena *arena, const rm_trimesh *own, const rm_trimesh *other, int moved, bool by_tree,
                            const rm_progress *progress, rm_trace *out, rm_lid *bad_edge)
{
  tracer       t = {.own = own, .other = other, .moved = moved, .by_tree = by_tree, .scratch = rm_arena_new(),
                    .clear = {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY}};
  remap_status status = t.scratch ? REMAP_OK : REMAP_NO_MEMORY;

  if (status != REMAP_OK) goto done;
  RM_GOTO(done, status = rm_states_init(&t.states));
  t.first = rm_arena_alloc(arena, own->num_edges, sizeof *t.first);
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
