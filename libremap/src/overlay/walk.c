/* walk -- the crossings of a line with a mesh, by walking from cell to cell (DESIGN 2.3).
 *
 * In a cell, the line is looked along: the cell's vertices are taken in a frame sheared so that it runs along an axis, and a
 * panel (a triangle, or a planar face of four sides) is crossed if the line, now a point, lies in it. Most panels lie to one
 * side as a whole, which bits per vertex tell; for the others it takes a determinant of 2x2 per side, with one error bound for
 * the cell. What the bound cannot decide goes to the exact predicate. O(panels of the cell) per crossing.
 *
 * Whatever triangle is met, a crossing is spoken of as one with its facet, that is with the triangle this is called by. */
#include <math.h>
#include <string.h>
#include "overlay/tracer.h"

enum { MAX_LOCAL = 256 };

/* Of a sheared coordinate, by the reach. */
#define POINT_NOISE 0x1p-49
/* Of the sum, over a triangle's corners, of such a side by the corner's height over the edge's end, by the square of the reach
 * and the largest height: three products, each off by 80 u reach^2 times the height and 8 reach^2 times 4 u of it, and their
 * sum by as much again. */
#define HEIGHT_NOISE 0x1p-43

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

/* ---- one cell -------------------------------------------------------------------------------------------------------- */

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
                                            : rm_trace_order(t, last.triangle, list[k].triangle) < 0;
    if (!is_ahead) continue;
    if (best >= 0) {
      const int o = rm_trace_order(t, list[k].triangle, list[best].triangle);
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
      const int o = rm_trace_order(t, last.triangle, h.triangle);
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
  *how        = at == RM_OUTSIDE && rm_trace_is_clear(t) ? WALKED : WALK_TOGETHER;
  if (at < RM_OUTSIDE || *how == WALKED) return REMAP_OK;
  for (;;) {
    RM_TRY(follow(t, &at, &last, RM_WALK_ALONE, how));
    if (*how != WALKED) return REMAP_OK;
    if (at >= 0) break;
    RM_TRY(rm_trace_need_skin_hits(t));
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
  RM_TRY(rm_trace_need_skin_hits(t));
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
  rm_trace_sort_hits(t, t->hits, t->num_hits);
  return REMAP_OK;
}

/* ---------------------------------------------------------------------------------------------------------------------- */

remap_status rm_trace_find_hits(tracer *t, const double *p0, const double *p1, rm_lid *state)
{
  walked how = WALK_NOT;

  set_line(t, p0, p1);
  if (!t->by_tree && !rm_trace_is_near_odd(t)) RM_TRY(walk_alone(t, state, &how));
  if (how == WALKED) return REMAP_OK;
  if (how == WALK_TOGETHER) RM_TRY(walk_together(t, *state, &how));
  if (how != WALKED) RM_TRY(rm_trace_all_hits(t));
  for (int k = 0; k < t->num_hits; k++)
    RM_TRY(rm_states_cross(&t->states, *state, t->other->side[t->hits[k].triangle], t->hits[k].sign, state));
  return REMAP_OK;
}

