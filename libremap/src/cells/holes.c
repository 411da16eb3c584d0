/* holes -- a polygon with holes, or one that meets itself in a vertex, cut into triangles: each hole is joined to the loop
 * around it by a bridge, from right to left, then ears are cut off. All signs are exact, so every triangle has area and no
 * vertex lies inside one or on its sides. O(n^2) for n vertices, expected. */
#include "cells/cells_private.h"

#include <string.h>

typedef struct work {
  const rm_view *view;
  int            num_loops;
  const int64_t *offset;
  const rm_lid  *spot;
  bool          *joined; /* [num_loops] */
  rm_lid        *loop;   /* spots of the loop so far; a bridge's ends are in it twice */
  int64_t        num;
  double        *distance;
} work;

static bool is_right_of(const work *w, rm_lid p, rm_lid q)
{
  const int x = rm_compare(w->view->l, p, q, w->view->x);
  return x ? x > 0 : rm_compare(w->view->l, p, q, w->view->y) > 0;
}

static int64_t rightmost(const work *w, int loop)
{
  int64_t best = w->offset[loop];

  for (int64_t k = best + 1; k < w->offset[loop + 1]; k++)
    if (is_right_of(w, w->spot[k], w->spot[best])) best = k;
  return best;
}

/* Point r of the line through p and q is strictly between them. */
static bool is_between(const work *w, rm_lid p, rm_lid q, rm_lid r)
{
  const rm_limit *l = w->view->l;
  const int       axis = rm_compare(l, p, q, w->view->x) ? w->view->x : w->view->y;
  return rm_compare(l, p, r, axis) * rm_compare(l, r, q, axis) > 0;
}

/* The side c d is in the way of a bridge from a to b. */
static bool blocks(const work *w, rm_lid a, rm_lid b, rm_lid c, rm_lid d)
{
  const int tc = rm_turn(w->view, a, b, c), td = rm_turn(w->view, a, b, d);

  if (tc == 0 && c != a && c != b && is_between(w, a, b, c)) return true;
  if (td == 0 && d != a && d != b && is_between(w, a, b, d)) return true;
  return tc * td < 0 && rm_turn(w->view, c, d, a) * rm_turn(w->view, c, d, b) < 0;
}

/* The way from v to p starts inside the loop ... before, v, after ... */
static bool starts_inside(const work *w, rm_lid before, rm_lid v, rm_lid after, rm_lid p)
{
  const int in = rm_turn(w->view, before, v, p), out = rm_turn(w->view, v, after, p);
  return rm_turn(w->view, before, v, after) > 0 ? in > 0 && out > 0 : in > 0 || out > 0;
}

static bool is_free(const work *w, rm_lid a, rm_lid b)
{
  for (int64_t k = 0; k < w->num; k++)
    if (blocks(w, a, b, w->loop[k], w->loop[(k + 1) % w->num])) return false;
  for (int h = 0; h < w->num_loops; h++)
    for (int64_t k = w->offset[h]; k < w->offset[h + 1] && !w->joined[h]; k++)
      if (blocks(w, a, b, w->spot[k], w->spot[k + 1 < w->offset[h + 1] ? k + 1 : w->offset[h]])) return false;
  return true;
}

/* The nearest place in the loop that a bridge from vertex m of loop h can reach, -1. */
static int64_t find_bridge(work *w, int h, int64_t m)
{
  const int64_t first = w->offset[h], n = w->offset[h + 1] - first;
  const rm_lid  p = w->spot[m], before = w->spot[first + (m - first + n - 1) % n], after = w->spot[first + (m - first + 1) % n];
  const double *at = w->view->l->xyz[p];

  for (int64_t k = 0; k < w->num; k++) {
    const double *q = w->view->l->xyz[w->loop[k]];
    w->distance[k] = 0;
    for (int c = 0; c < 3; c++) w->distance[k] += (q[c] - at[c]) * (q[c] - at[c]);
  }
  for (int64_t tried = 0; tried < w->num; tried++) {
    int64_t best = -1;
    for (int64_t k = 0; k < w->num; k++)
      if (w->distance[k] >= 0 && (best < 0 || w->distance[k] < w->distance[best])) best = k;
    const rm_lid v = w->loop[best];
    if (starts_inside(w, w->loop[(best + w->num - 1) % w->num], v, w->loop[(best + 1) % w->num], p) &&
        starts_inside(w, before, p, after, v) && is_free(w, p, v))
      return best;
    w->distance[best] = -1;
  }
  return -1;
}

static bool join_holes(work *w)
{
  for (int step = 1; step < w->num_loops; step++) {
    int     hole = -1;
    int64_t m    = -1;

    for (int h = 1; h < w->num_loops; h++) {
      if (w->joined[h]) continue;
      const int64_t r = rightmost(w, h);
      if (hole < 0 || is_right_of(w, w->spot[r], w->spot[m])) hole = h, m = r;
    }
    const int64_t at = find_bridge(w, hole, m), first = w->offset[hole], n = w->offset[hole + 1] - first;
    if (at < 0) return false;
    memmove(w->loop + at + n + 2, w->loop + at, sizeof *w->loop * (size_t)(w->num - at));
    for (int64_t k = 0; k <= n; k++) w->loop[at + 1 + k] = w->spot[first + (m - first + k) % n];
    w->num += n + 2;
    w->joined[hole] = true;
  }
  return true;
}

static bool is_ear(const work *w, int64_t k)
{
  const rm_lid a = w->loop[(k + w->num - 1) % w->num], b = w->loop[k], c = w->loop[(k + 1) % w->num];

  if (rm_turn(w->view, a, b, c) <= 0) return false;
  for (int64_t i = 0; i < w->num; i++) {
    const rm_lid p = w->loop[i];
    if (p == a || p == b || p == c) continue;
    if (rm_turn(w->view, a, b, p) >= 0 && rm_turn(w->view, b, c, p) >= 0 && rm_turn(w->view, c, a, p) >= 0) return false;
  }
  return true;
}

static bool cut_ears(work *w, rm_lid *corner, int64_t *num)
{
  int64_t k = 0, failed = 0;

  *num = 0;
  while (w->num >= 3) {
    if (k >= w->num) k = 0;
    if (!is_ear(w, k)) {
      if (++failed > w->num) return false;
      k++;
      continue;
    }
    corner[3 * *num]     = w->loop[(k + w->num - 1) % w->num];
    corner[3 * *num + 1] = w->loop[k];
    corner[3 * *num + 2] = w->loop[(k + 1) % w->num];
    ++*num;
    if (w->num == 3) break;
    memmove(w->loop + k, w->loop + k + 1, sizeof *w->loop * (size_t)(w->num - k - 1));
    w->num--;
    failed = 0;
    k++; /* not the same corner again: fans make thin triangles */
  }
  return true;
}

remap_status rm_cut_holes(rm_arena *scratch, const rm_view *view, int num_loops, const int64_t *offset, const rm_lid *spot,
                          rm_lid **corner, int64_t *num)
{
  const int64_t most = offset[num_loops] + 2 * (int64_t)num_loops;
  work          w    = {.view = view, .num_loops = num_loops, .offset = offset, .spot = spot, .num = offset[1]};

  RM_NEW0(w.joined, scratch, num_loops);
  RM_NEW(w.loop, scratch, most);
  RM_NEW(w.distance, scratch, most);
  RM_NEW(*corner, scratch, 3 * most);
  memcpy(w.loop, spot, sizeof *spot * (size_t)offset[1]);
  w.joined[0] = true;
  return join_holes(&w) && cut_ears(&w, *corner, num) ? REMAP_OK : REMAP_BAD_MESH;
}
