/* convex -- a concave polygon cut into convex ones (DESIGN 2.8), along edges of triangles: those of the operands' triangulation
 * where they go through it, and within a piece of one triangle those of a triangulation of the piece. Again and again the
 * corner of the largest angle is cut along the edge that leaves an angle below half a turn and closest to it. Which angles are
 * below half a turn is exact, so every part is convex.
 *
 * The triangles have no other vertices than the loop. So the edges that leave a vertex, its rays, follow each other as their
 * ends do along the loop: first the loop's edge to the next vertex, last that to the one before. Two rays between which none is
 * cut are a corner of a part. A queue has corners above half a turn by their angle; a corner that was cut from the other end of
 * a ray is found to be less when its turn comes. O(n log n) for n vertices. */
#include "cells/cells_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A corner: of the vertex at place `at`, from ray to ray. */
typedef struct corner {
  double angle;
  rm_lid at, from, to;
} corner;

typedef struct work {
  const rm_view *view;
  const rm_lid  *loop; /* [n] from its least vertex on */
  rm_lid         n;
  rm_lid        *corner; /* [num][3] triangles */
  int64_t        num;
  rm_arena      *scratch;
  rm_parts      *out;
  rm_lid        *ray_offset; /* [n + 1]                                                            */
  rm_lid        *end;        /* [rays] place where it ends                                         */
  uint8_t       *is_cut;     /* [rays]                                                             */
  rm_lid        *news, *next_news; /* [n], [rays] rays of a vertex that were cut from their ends, -1 */
  corner        *queue;      /* a heap, the largest angle first                                    */
  int64_t        queued, queue_room;
} work;

static int turn_at(const rm_view *view, const rm_lid *loop, rm_lid n, rm_lid k)
{
  return rm_turn(view, loop[k ? k - 1 : n - 1], loop[k], loop[k + 1 < n ? k + 1 : 0]);
}

bool rm_is_convex(const rm_view *view, const rm_lid *loop, rm_lid n)
{
  for (rm_lid k = 0; k < n; k++)
    if (turn_at(view, loop, n, k) < 0) return false;
  return true;
}

/* Angle from the way p -> q to the way p -> r, counter-clockwise, rounded; turn is the sign of p, q, r. */
static double angle_between(const rm_limit *l, rm_lid p, rm_lid q, rm_lid r, int turn)
{
  double u[3], v[3], dot = 0, cross = 0;

  for (int c = 0; c < 3; c++) u[c] = l->xyz[q][c] - l->xyz[p][c], v[c] = l->xyz[r][c] - l->xyz[p][c], dot += u[c] * v[c];
  for (int c = 0; c < 3; c++) {
    const double x = u[(c + 1) % 3] * v[(c + 2) % 3] - u[(c + 2) % 3] * v[(c + 1) % 3];
    cross += x * x;
  }
  const double angle = atan2(sqrt(cross), dot);
  return turn >= 0 ? angle : 2 * acos(-1.) - angle;
}

/* ---- the queue --------------------------------------------------------------------------------------------------- */

static bool comes_first(const corner *a, const corner *b)
{
  if (a->angle > b->angle || a->angle < b->angle) return a->angle > b->angle;
  return a->at != b->at ? a->at < b->at : a->from < b->from;
}

static void swap(corner *a, corner *b)
{
  const corner x = *a;
  *a = *b, *b = x;
}

static corner pop(work *w)
{
  const corner first = w->queue[0];

  w->queue[0] = w->queue[--w->queued];
  for (int64_t k = 0, best;; k = best) {
    best = k;
    for (int64_t child = 2 * k + 1; child <= 2 * k + 2 && child < w->queued; child++)
      if (comes_first(&w->queue[child], &w->queue[best])) best = child;
    if (best == k) return first;
    swap(&w->queue[k], &w->queue[best]);
  }
}

static rm_lid spot_at(const work *w, rm_lid ray) { return w->loop[w->end[ray]]; }

/* Queue a corner if it is above half a turn. */
static remap_status push(work *w, rm_lid at, rm_lid from, rm_lid to)
{
  const rm_lid p = w->loop[at];
  int64_t      k = w->queued;

  if (rm_turn(w->view, p, spot_at(w, from), spot_at(w, to)) >= 0) return REMAP_OK;
  RM_TRY(rm_grow(&w->queue, &w->queue_room, w->queued + 1, sizeof *w->queue));
  w->queue[w->queued++] =
      (corner){angle_between(w->view->l, p, spot_at(w, from), spot_at(w, to), -1), at, from, to};
  for (; k > 0 && comes_first(&w->queue[k], &w->queue[(k - 1) / 2]); k = (k - 1) / 2)
    swap(&w->queue[k], &w->queue[(k - 1) / 2]);
  return REMAP_OK;
}

/* ---- cuts -------------------------------------------------------------------------------------------------------- */

/* The number of edges of the loop that lead from a place on to another. */
static rm_lid steps(const work *w, rm_lid from, rm_lid to) { return to > from ? to - from : to - from + w->n; }

/* The ray from one place to another, which is there. */
static rm_lid ray_to(const work *w, rm_lid at, rm_lid end)
{
  rm_lid low = w->ray_offset[at], high = w->ray_offset[at + 1] - 1;

  while (low < high) {
    const rm_lid middle = low + (high - low) / 2;
    if (steps(w, at, w->end[middle]) < steps(w, at, end)) low = middle + 1;
    else high = middle;
  }
  return low;
}

/* Cut along a ray. The vertex at its end will hear of it. */
static void cut_along(work *w, rm_lid at, rm_lid ray)
{
  const rm_lid end = w->end[ray], back = ray_to(w, end, at);

  w->is_cut[ray] = w->is_cut[back] = 1;
  w->next_news[back] = w->news[end];
  w->news[end]       = back;
}

/* The parts of a corner that has been cut since it was queued go back to the queue; *any is false if it has not. */
static remap_status hear_news(work *w, const corner *c, bool *any)
{
  uint64_t *ray;
  int64_t   num = 0;
  rm_lid    from = c->from;

  for (rm_lid r = w->news[c->at]; r >= 0; r = w->next_news[r]) num += r > c->from && r < c->to;
  *any = num > 0;
  if (!num) return REMAP_OK;
  RM_NEW(ray, w->scratch, num);
  num = 0;
  for (rm_lid r = w->news[c->at]; r >= 0; r = w->next_news[r])
    if (r > c->from && r < c->to) ray[num++] = (uint64_t)r;
  w->news[c->at] = -1; /* what lies in other corners was cut before those were queued, or they are below half a turn */
  rm_sort_words(ray, num);
  for (int64_t k = 0; k < num; k++) {
    RM_TRY(push(w, c->at, from, (rm_lid)ray[k]));
    from = (rm_lid)ray[k];
  }
  return push(w, c->at, from, c->to);
}

/* Cut a corner along the last of its rays that leaves less than half a turn before it; what is behind that is one again. */
static remap_status cut_corner(work *w, const corner *c)
{
  const rm_lid p = w->loop[c->at], next = spot_at(w, c->from);
  rm_lid       low = c->from, high = c->to; /* less than half a turn up to low, not at high */

  while (high - low > 1) {
    const rm_lid middle = low + (high - low) / 2;
    if (rm_turn(w->view, p, next, spot_at(w, middle)) > 0) low = middle;
    else high = middle;
  }
  if (low == c->from) return REMAP_BAD_MESH; /* the triangles are none of this loop */
  cut_along(w, c->at, low);
  return push(w, c->at, low, c->to);
}

static remap_status cut(work *w)
{
  remap_status status = REMAP_OK;

  for (rm_lid k = 0; k < w->n && status == REMAP_OK; k++) status = push(w, k, w->ray_offset[k], w->ray_offset[k + 1] - 1);
  while (w->queued && status == REMAP_OK) {
    const corner c = pop(w);
    bool         any;

    status = hear_news(w, &c, &any);
    if (status == REMAP_OK && !any) status = cut_corner(w, &c);
  }
  return status;
}

/* ---- parts ------------------------------------------------------------------------------------------------------- */

static remap_status add_vertex(rm_parts *out, rm_lid spot)
{
  RM_TRY(rm_grow(&out->vertex, &out->vertex_room, out->num_vertices + 1, sizeof *out->vertex));
  out->vertex[out->num_vertices++] = spot;
  return REMAP_OK;
}

static remap_status end_part(rm_parts *out)
{
  RM_TRY(rm_grow(&out->end, &out->end_room, out->num + 1, sizeof *out->end));
  out->end[out->num++] = (rm_lid)out->num_vertices;
  return REMAP_OK;
}

/* The loop of the part on the left of a ray, on which no part has been; `before` is [rays] the cut one before it, or the loop's
 * edge. */
static remap_status follow(work *w, const rm_lid *before, uint8_t *seen, rm_lid at, rm_lid ray)
{
  while (!seen[ray]) {
    seen[ray] = 1;
    RM_TRY(add_vertex(w->out, w->loop[at]));
    const rm_lid end = w->end[ray];
    ray              = before[ray_to(w, end, at)];
    at               = end;
  }
  return end_part(w->out);
}

static remap_status collect_parts(work *w)
{
  const rm_lid num = w->ray_offset[w->n];
  rm_lid      *before;
  uint8_t     *seen;

  RM_NEW(before, w->scratch, num);
  RM_NEW0(seen, w->scratch, num);
  for (rm_lid k = 0; k < w->n; k++)
    for (rm_lid r = w->ray_offset[k], last = r; r < w->ray_offset[k + 1]; r++) {
      before[r] = last;
      if (w->is_cut[r]) last = r;
    }
  for (rm_lid k = 0; k < w->n; k++)
    for (rm_lid r = w->ray_offset[k]; r < w->ray_offset[k + 1] - 1; r++)
      if (!seen[r] && (w->is_cut[r] || r == w->ray_offset[k])) RM_TRY(follow(w, before, seen, k, r));
  return REMAP_OK;
}

/* ---- rays -------------------------------------------------------------------------------------------------------- */

/* A vertex of the loop and its place in it. */
typedef struct placed {
  rm_lid spot, place;
} placed;

static int by_spot(const void *a, const void *b)
{
  const placed *x = a, *y = b;
  return (x->spot > y->spot) - (x->spot < y->spot);
}

static remap_status place_vertices(work *w, placed **out)
{
  RM_NEW(*out, w->scratch, w->n);
  for (rm_lid k = 0; k < w->n; k++) (*out)[k] = (placed){w->loop[k], k};
  qsort(*out, (size_t)w->n, sizeof **out, by_spot);
  return REMAP_OK;
}

/* The place of a spot in the loop, -1. */
static rm_lid place_of(const work *w, const placed *vertex, rm_lid spot)
{
  const placed  key   = {spot, 0};
  const placed *found = bsearch(&key, vertex, (size_t)w->n, sizeof *vertex, by_spot);

  return found ? found->place : -1;
}

/* The rays of every vertex: the sides of the triangles, which are sides of two but for the loop's, once each. */
static remap_status make_rays(work *w, const placed *vertex)
{
  uint64_t *word;
  int64_t   num = 0;
  rm_lid    kept = 0;

  RM_NEW(word, w->scratch, 6 * w->num);
  for (int64_t k = 0; k < 3 * w->num; k++) {
    const int64_t t = k - k % 3;
    const rm_lid  a = place_of(w, vertex, w->corner[k]), b = place_of(w, vertex, w->corner[k < t + 2 ? k + 1 : t]);

    word[num++] = (uint64_t)a << 32 | (uint64_t)steps(w, a, b);
    word[num++] = (uint64_t)b << 32 | (uint64_t)steps(w, b, a);
  }
  rm_sort_words(word, num);
  RM_NEW0(w->ray_offset, w->scratch, w->n + 1);
  RM_NEW(w->end, w->scratch, num);
  for (int64_t k = 0; k < num; k++) {
    const rm_lid at = (rm_lid)(word[k] >> 32);

    if (k && word[k] == word[k - 1]) continue;
    w->end[kept++]        = (rm_lid)((uint64_t)at + (uint32_t)word[k]) % w->n;
    w->ray_offset[at + 1] = kept;
  }
  for (rm_lid k = 0; k < w->n; k++) { /* both sides of the loop are there */
    const rm_lid first = w->ray_offset[k], last = w->ray_offset[k + 1] - 1;
    if (last <= first || steps(w, k, w->end[first]) != 1 || steps(w, k, w->end[last]) != w->n - 1) return REMAP_BAD_MESH;
  }
  RM_NEW0(w->is_cut, w->scratch, kept);
  RM_NEW(w->next_news, w->scratch, kept);
  RM_NEW(w->news, w->scratch, w->n);
  for (rm_lid k = 0; k < w->n; k++) w->news[k] = -1;
  return REMAP_OK;
}

/* ---- triangles --------------------------------------------------------------------------------------------------- */

/* The loop from its least vertex on, wherever it began. */
static remap_status from_least(work *w, const rm_lid *loop, rm_lid n, rm_lid **out)
{
  rm_lid least = 0;

  for (rm_lid k = 1; k < n; k++)
    if (loop[k] < loop[least]) least = k;
  RM_NEW(*out, w->scratch, n);
  for (rm_lid k = 0; k < n; k++) (*out)[k] = loop[(least + k) % n];
  return REMAP_OK;
}

/* Add the triangles of a loop on its own vertices. */
static remap_status add_triangles(work *w, const rm_view *view, const rm_lid *loop, rm_lid n)
{
  const int64_t offset[2] = {0, n};
  rm_lid       *from, *made;
  int64_t       num;

  RM_TRY(from_least(w, loop, n, &from));
  RM_TRY(rm_cut_holes(w->scratch, view, 1, offset, from, &made, &num));
  memcpy(w->corner + 3 * w->num, made, sizeof *made * 3 * (size_t)num);
  w->num += num;
  return REMAP_OK;
}

/* True if the loop has all vertices of the pieces; *total receives how many the pieces have. */
static bool has_all(const work *w, const placed *vertex, const rm_pieces *of, int64_t *total)
{
  bool all = true;

  *total = 0;
  for (rm_lid k = 0; k < of->num; k++) {
    const rm_lid *piece = rm_polygon_loop(of->p, of->polygon[k]), m = rm_polygon_size(of->p, of->polygon[k]);

    *total += m;
    for (rm_lid i = 0; i < m && all; i++) all = place_of(w, vertex, piece[i]) >= 0;
  }
  return all;
}

/* The triangles of the polygon: of its pieces, or of its own where those have vertices inside of it. */
static remap_status triangulate(work *w, const placed *vertex, const rm_pieces *of)
{
  int64_t    total;
  const bool all = has_all(w, vertex, of, &total);

  RM_NEW(w->corner, w->scratch, 3 * (total > w->n ? total : w->n));
  if (!all) return add_triangles(w, w->view, w->loop, w->n);
  for (rm_lid k = 0; k < of->num; k++) {
    const rm_lid  own  = of->p->own[of->polygon[k]];
    const rm_view view = rm_view_of(w->view->l, own & 1, own / 2);

    RM_TRY(add_triangles(w, &view, rm_polygon_loop(of->p, of->polygon[k]), rm_polygon_size(of->p, of->polygon[k])));
  }
  return REMAP_OK;
}

/* BAD_MESH if it is no polygon where it is looked at. */
static remap_status cut_convex(work *w, const rm_lid *loop, const rm_pieces *of)
{
  rm_lid *from;
  placed *vertex;

  RM_TRY(from_least(w, loop, w->n, &from));
  w->loop = from;
  RM_TRY(place_vertices(w, &vertex));
  RM_TRY(triangulate(w, vertex, of));
  RM_TRY(make_rays(w, vertex));
  RM_TRY(cut(w));
  return collect_parts(w);
}

remap_status rm_cut_convex(const rm_view *view, rm_lid n, const rm_lid *loop, const rm_pieces *of, rm_parts *out)
{
  work         w      = {.view = view, .n = n, .scratch = rm_arena_new(), .out = out};
  remap_status status = REMAP_NO_MEMORY;

  out->num = out->num_vertices = 0;
  if (w.scratch) status = cut_convex(&w, loop, of);
  if (status == REMAP_BAD_MESH) { /* a warped polygon that crosses itself where it is looked at: it stays */
    out->num = out->num_vertices = 0;
    status                       = REMAP_OK;
    for (rm_lid k = 0; k < n && status == REMAP_OK; k++) status = add_vertex(out, w.loop ? w.loop[k] : loop[k]);
    if (status == REMAP_OK) status = end_part(out);
  }
  free(w.queue);
  rm_arena_drop(w.scratch);
  return status;
}
