/* convex -- a concave polygon cut into convex ones (DESIGN 2.8), along edges of triangles: those of the operands' triangulation
 * where they go through it, and within a piece of one triangle those of a triangulation of the piece. Again and again the
 * vertex of the largest angle is cut from along the edge that leaves an angle below half a turn and closest to it. Which angles
 * are below half a turn is exact, so every part is convex. O(n^2) for n vertices. */
#include "cells/cells_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct work {
  const rm_view *view;
  rm_lid        *corner; /* [num][3] triangles */
  int64_t        num;
  rm_arena      *scratch;
  rm_parts      *out;
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

/* The place of the vertex of the largest angle above half a turn, -1 if there is none. */
static rm_lid worst_of(const work *w, const rm_lid *loop, rm_lid n)
{
  rm_lid worst = -1;
  double most  = 0;

  for (rm_lid k = 0; k < n; k++) {
    if (turn_at(w->view, loop, n, k) >= 0) continue;
    const double angle = angle_between(w->view->l, loop[k], loop[k + 1 < n ? k + 1 : 0], loop[k ? k - 1 : n - 1], -1);
    if (worst >= 0 && angle <= most) continue;
    worst = k;
    most  = angle;
  }
  return worst;
}

static bool are_joined(const work *w, rm_lid a, rm_lid b)
{
  for (int64_t t = 0; t < w->num; t++) {
    const rm_lid *c = w->corner + 3 * t;
    if ((c[0] == a || c[1] == a || c[2] == a) && (c[0] == b || c[1] == b || c[2] == b)) return true;
  }
  return false;
}

/* How many places behind `worst` the vertex is to which the cut goes. */
static rm_lid choose_cut(const work *w, const rm_lid *loop, rm_lid n, rm_lid worst)
{
  const rm_lid p = loop[worst], next = loop[(worst + 1) % n];
  rm_lid       best = 0;
  double       most = 0;

  for (rm_lid k = 2; k < n - 1; k++) {
    const rm_lid q = loop[(worst + k) % n];
    if (!are_joined(w, p, q) || rm_turn(w->view, p, next, q) <= 0) continue;
    const double angle = angle_between(w->view->l, p, next, q, 1);
    if (best && angle <= most) continue;
    best = k;
    most = angle;
  }
  return best;
}

static remap_status add_part(work *w, const rm_lid *loop, rm_lid n)
{
  rm_parts *out = w->out;

  RM_TRY(rm_grow(&out->vertex, &out->vertex_room, out->num_vertices + n, sizeof *out->vertex));
  RM_TRY(rm_grow(&out->end, &out->end_room, out->num + 1, sizeof *out->end));
  memcpy(out->vertex + out->num_vertices, loop, sizeof *loop * (size_t)n);
  out->num_vertices += n;
  out->end[out->num++] = (rm_lid)out->num_vertices;
  return REMAP_OK;
}

/* Cut the loop in two and those again. The depth is at most n. */
static remap_status cut(work *w, const rm_lid *loop, rm_lid n)
{
  const rm_lid worst = worst_of(w, loop, n), far = worst < 0 ? 0 : choose_cut(w, loop, n, worst);
  rm_lid      *part;

  if (worst < 0) return add_part(w, loop, n);
  if (!far) return REMAP_BAD_MESH; /* the triangles are none of this loop */
  RM_NEW(part, w->scratch, n);
  for (rm_lid k = 0; k <= far; k++) part[k] = loop[(worst + k) % n];
  RM_TRY(cut(w, part, far + 1));
  for (rm_lid k = far; k <= n; k++) part[k - far] = loop[(worst + k) % n];
  return cut(w, part, n - far + 1);
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
  rm_lid       *from, *corner;
  int64_t       num;

  RM_TRY(from_least(w, loop, n, &from));
  RM_TRY(rm_cut_holes(w->scratch, view, 1, offset, from, &corner, &num));
  memcpy(w->corner + 3 * w->num, corner, sizeof *corner * 3 * (size_t)num);
  w->num += num;
  return REMAP_OK;
}

static int by_spot(const void *a, const void *b)
{
  const rm_lid x = *(const rm_lid *)a, y = *(const rm_lid *)b;
  return (x > y) - (x < y);
}

/* True if the loop has all vertices of the pieces; *total receives how many the pieces have. */
static remap_status has_all(work *w, const rm_lid *loop, rm_lid n, const rm_pieces *of, bool *all, int64_t *total)
{
  rm_lid *sorted;

  *total = 0;
  *all   = true;
  RM_NEW(sorted, w->scratch, n);
  memcpy(sorted, loop, sizeof *sorted * (size_t)n);
  qsort(sorted, (size_t)n, sizeof *sorted, by_spot);
  for (rm_lid k = 0; k < of->num; k++) {
    const rm_lid *piece = rm_polygon_loop(of->p, of->polygon[k]), m = rm_polygon_size(of->p, of->polygon[k]);

    *total += m;
    for (rm_lid i = 0; i < m && *all; i++) *all = bsearch(&piece[i], sorted, (size_t)n, sizeof *sorted, by_spot) != NULL;
  }
  return REMAP_OK;
}

/* The triangles of the polygon: of its pieces, or of its own where those have vertices inside of it. */
static remap_status triangulate(work *w, const rm_lid *loop, rm_lid n, const rm_pieces *of)
{
  int64_t total;
  bool    all;

  RM_TRY(has_all(w, loop, n, of, &all, &total));
  RM_NEW(w->corner, w->scratch, 3 * (total > n ? total : n));
  if (!all) return add_triangles(w, w->view, loop, n);
  for (rm_lid k = 0; k < of->num; k++) {
    const rm_lid  own  = of->p->own[of->polygon[k]];
    const rm_view view = rm_view_of(w->view->l, own & 1, own / 2);

    RM_TRY(add_triangles(w, &view, rm_polygon_loop(of->p, of->polygon[k]), rm_polygon_size(of->p, of->polygon[k])));
  }
  return REMAP_OK;
}

remap_status rm_cut_convex(const rm_view *view, rm_lid n, const rm_lid *loop, const rm_pieces *of, rm_parts *out)
{
  work         w      = {.view = view, .scratch = rm_arena_new(), .out = out};
  rm_lid      *from   = NULL;
  remap_status status = w.scratch ? from_least(&w, loop, n, &from) : REMAP_NO_MEMORY;

  out->num = out->num_vertices = 0;
  if (status == REMAP_OK) status = triangulate(&w, from, n, of);
  if (status == REMAP_OK) status = cut(&w, from, n);
  if (status == REMAP_BAD_MESH) { /* a warped polygon that crosses itself where it is looked at: it stays */
    out->num = out->num_vertices = 0;
    status                       = add_part(&w, loop, n);
  }
  rm_arena_drop(w.scratch);
  return status;
}
