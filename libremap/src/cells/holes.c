/* holes -- a polygon with holes, or one that meets itself in vertices, cut into triangles: a line sweeps over it and cuts it,
 * from one vertex to another, into pieces that every upright line meets once; these are cut by a stack (de Berg et al.,
 * Computational Geometry, chapter 3). All signs are exact, so every triangle has area and no vertex lies inside one or on its
 * sides. O(n log n) signs for n vertices.
 *
 * A corner is a vertex of a loop: one that several loops meet in is several corners, with the polygon between its two sides
 * on the left. Edge k runs from corner k to the next of its loop. Those that run to the right have the polygon above them:
 * they are what the line holds, each with a helper, the last corner whose way down ends on it. */
#include "cells/cells_private.h"

#include <string.h>

/* START and SPLIT have both sides to the right, END and MERGE to the left; LOWER and UPPER go on. */
typedef enum corner_kind { START, SPLIT, END, MERGE, LOWER, UPPER } corner_kind;

enum { MOST = 6 }; /* ways out of a corner: its edge and cuts: as helper of two edges, to the helpers of two, and spare */

typedef struct ways {
  rm_lid to[MOST]; /* corners; counter-clockwise, the corner's own edge first */
  int    num;
} ways;

typedef struct work {
  const rm_view *view;
  rm_lid         n;
  const rm_lid  *spot;   /* [n] */
  rm_lid        *next, *back, *rank; /* [n] corner; place in the order of the sweep */
  rm_lid        *helper; /* [n] of an edge on the line */
  ways          *way;    /* [n] */
  rm_sweep       line;
  uint8_t       *seen;   /* [n] bits: the way out is done */
  rm_lid        *piece;  /* [n] */
  rm_lid        *stack;  /* [n] */
  rm_lid        *corner; /* [num][3] spots: the triangles */
  int64_t        num, room;
} work;

static inline int turn(const work *w, rm_lid a, rm_lid b, rm_lid c)
{
  return rm_turn(w->view, w->spot[a], w->spot[b], w->spot[c]);
}

static corner_kind kind_of(const work *w, rm_lid v)
{
  const bool back = w->rank[w->back[v]] < w->rank[v], next = w->rank[w->next[v]] < w->rank[v];

  if (back && !next) return LOWER;
  if (next && !back) return UPPER;
  if (turn(w, w->back[v], v, w->next[v]) > 0) return back ? END : START;
  return back ? MERGE : SPLIT;
}

/* ---- pieces ------------------------------------------------------------------------------------------------------ */

/* Way x comes before y, counter-clockwise from the edge of corner v on. */
static bool comes_before(const work *w, rm_lid v, rm_lid x, rm_lid y)
{
  const int a = turn(w, v, w->next[v], x), b = turn(w, v, w->next[v], y);
  return a != b ? a > b : turn(w, v, x, y) > 0;
}

static bool add_way(work *w, rm_lid v, rm_lid to)
{
  ways *x = &w->way[v];
  int   k = x->num;

  if (k == MOST) return false;
  for (; k > 1 && comes_before(w, v, to, x->to[k - 1]); k--) x->to[k] = x->to[k - 1];
  x->to[k] = to;
  x->num++;
  return true;
}

static bool cut(work *w, rm_lid a, rm_lid b) { return w->spot[a] != w->spot[b] && add_way(w, a, b) && add_way(w, b, a); }

static bool cut_to_merge(work *w, rm_lid v, rm_lid edge)
{
  return kind_of(w, w->helper[edge]) != MERGE || cut(w, v, w->helper[edge]);
}

/* The edge that ends at v leaves the line. */
static bool leave(work *w, rm_lid v) { return cut_to_merge(w, v, w->back[v]) && rm_sweep_remove(&w->line, w->back[v]); }

static void enter(work *w, rm_lid v)
{
  rm_sweep_insert(&w->line, v);
  w->helper[v] = v;
}

/* The edge below v, which v helps from now on; always: what v is cut from though that does not merge. */
static bool help_below(work *w, rm_lid v, bool always)
{
  const rm_lid e = rm_sweep_below(&w->line, w->spot[v]);

  if (e < 0 || !(always ? cut(w, v, w->helper[e]) : cut_to_merge(w, v, e))) return false;
  w->helper[e] = v;
  return true;
}

/* False if the loops cross each other. */
static bool pass_corner(work *w, rm_lid v)
{
  switch (kind_of(w, v)) {
    case START: enter(w, v); return true;
    case SPLIT:
      if (!help_below(w, v, true)) return false;
      enter(w, v);
      return true;
    case END: return leave(w, v);
    case MERGE: return leave(w, v) && help_below(w, v, false);
    case LOWER:
      if (!leave(w, v)) return false;
      enter(w, v);
      return true;
    default: return help_below(w, v, false);
  }
}

/* ---- triangles of a piece ---------------------------------------------------------------------------------------- */

static bool add_triangle(work *w, rm_lid a, rm_lid b, rm_lid c)
{
  rm_lid *to = w->corner + 3 * w->num;

  if (w->num == w->room || turn(w, a, b, c) <= 0) return false;
  to[0] = w->spot[a], to[1] = w->spot[b], to[2] = w->spot[c];
  w->num++;
  return true;
}

/* The triangle of corners along the lower or upper side of a piece, and one more. */
static bool add_beside(work *w, bool lower, rm_lid a, rm_lid b, rm_lid c)
{
  return lower ? add_triangle(w, a, b, c) : add_triangle(w, b, a, c);
}

/* A piece of n corners, in w->piece along its loop from the leftmost on, which an upright line meets once. */
static bool cut_piece(work *w, rm_lid n)
{
  rm_lid low = 1, high = n - 1, num = 1; /* the next corners below and above; of the stack */
  bool   lower = true;                   /* the stack, but for its first corner, is of the lower side */

  w->stack[0] = w->piece[0];
  while (low <= high) {
    const bool   is_lower = low < high ? w->rank[w->piece[low]] < w->rank[w->piece[high]] : !lower;
    const rm_lid v        = w->piece[is_lower ? low++ : high--];

    if (num > 1 && is_lower != lower) {
      for (rm_lid k = 0; k + 1 < num; k++)
        if (!add_beside(w, lower, w->stack[k], w->stack[k + 1], v)) return false;
      w->stack[0] = w->stack[num - 1];
      num         = 1;
    }
    while (num > 1 && (lower ? turn(w, w->stack[num - 2], w->stack[num - 1], v) > 0
                             : turn(w, w->stack[num - 2], w->stack[num - 1], v) < 0)) {
      if (!add_beside(w, lower, w->stack[num - 2], w->stack[num - 1], v)) return false;
      num--;
    }
    w->stack[num++] = v;
    lower           = is_lower;
  }
  return true;
}

/* The piece on the left of way k out of corner v, from its leftmost corner on; 0 if there is none. */
static rm_lid walk_piece(work *w, rm_lid v, int k)
{
  rm_lid n = 0, first = 0, at = v;

  do {
    const rm_lid to = w->way[at].to[k];
    int          in = w->way[to].num;

    if (n == w->n || w->seen[at] >> k & 1) return 0;
    w->seen[at] |= (uint8_t)(1 << k);
    w->piece[n] = at;
    if (w->rank[at] < w->rank[w->piece[first]]) first = n;
    n++;
    if (k > 0) /* a cut: the next way out is the one before the way back */
      for (in = 1; in < w->way[to].num && w->way[to].to[in] != at;) in++;
    k  = in - 1;
    at = to;
  } while (at != v || !(w->seen[at] >> k & 1));
  memcpy(w->stack, w->piece, sizeof *w->piece * (size_t)n);
  for (rm_lid i = 0; i < n; i++) w->piece[i] = w->stack[(first + i) % n];
  return n;
}

static bool cut_pieces(work *w)
{
  for (rm_lid v = 0; v < w->n; v++)
    for (int k = 0; k < w->way[v].num; k++) {
      if (w->seen[v] >> k & 1) continue;
      const rm_lid n = walk_piece(w, v, k);
      if (n < 3 || !cut_piece(w, n)) return false;
    }
  return true;
}

/* ------------------------------------------------------------------------------------------------------------------ */

static remap_status start(work *w, rm_arena *scratch, int num_loops, const int64_t *offset, const rm_lid **list)
{
  rm_lid (*end)[2], *order;

  RM_NEW(w->next, scratch, w->n);
  RM_NEW(w->back, scratch, w->n);
  RM_NEW(w->rank, scratch, w->n);
  RM_NEW(w->helper, scratch, w->n);
  RM_NEW(w->way, scratch, w->n);
  RM_NEW(w->piece, scratch, w->n);
  RM_NEW(w->stack, scratch, w->n);
  RM_NEW(end, scratch, w->n);
  RM_NEW(w->line.list, scratch, w->n);
  RM_NEW0(w->seen, scratch, w->n);
  RM_NEW(w->corner, scratch, 3 * w->room);
  for (int h = 0; h < num_loops; h++)
    for (int64_t k = offset[h]; k < offset[h + 1]; k++) {
      w->next[k] = (rm_lid)(k + 1 < offset[h + 1] ? k + 1 : offset[h]);
      w->back[k] = (rm_lid)(k > offset[h] ? k - 1 : offset[h + 1] - 1);
    }
  RM_TRY(rm_sweep_order(scratch, w->view, w->n, w->spot, &order));
  for (rm_lid i = 0; i < w->n; i++) w->rank[order[i]] = i;
  for (rm_lid k = 0; k < w->n; k++) {
    const bool right = w->rank[k] < w->rank[w->next[k]];
    end[k][!right]   = w->spot[k];
    end[k][right]    = w->spot[w->next[k]];
    w->way[k]        = (ways){{w->next[k]}, 1};
  }
  w->line.view = w->view;
  w->line.end  = (const rm_lid (*)[2])end;
  *list        = order;
  return REMAP_OK;
}

remap_status rm_cut_holes(rm_arena *scratch, const rm_view *view, int num_loops, const int64_t *offset, const rm_lid *spot,
                          rm_lid **corner, int64_t *num)
{
  work          w = {.view = view, .n = (rm_lid)offset[num_loops], .spot = spot};
  const rm_lid *order;

  w.room = offset[num_loops] + 2 * (int64_t)num_loops;
  RM_TRY(start(&w, scratch, num_loops, offset, &order));
  for (rm_lid i = 0; i < w.n; i++)
    if (!pass_corner(&w, order[i])) return REMAP_BAD_MESH;
  if (!cut_pieces(&w)) return REMAP_BAD_MESH;
  *corner = w.corner;
  *num    = w.num;
  return REMAP_OK;
}
