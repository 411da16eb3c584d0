/* polygons -- the planar graph in every triangle, made of the vertices along its edges and of its meetings with the other
 * mesh, and the polygons that it bounds.
 *
 * A triangle meets a triangle of the other mesh, if not in a point, in one segment, and an edge that lies in its plane
 * likewise. These arcs do not cross. Around a vertex they are ordered by exact turns; a walk that keeps to the left then
 * goes around each polygon. In which cell of the other mesh a polygon lies, its arcs tell: the side of the triangle that
 * made them, the state of the edge, or, where an arc runs along an edge of the other mesh, the place among the triangles
 * around that edge. A polygon that lies on a triangle of the other mesh is made once, by mesh 1. O(a log a) for the a arcs
 * of a triangle. */
#include "cells/cells_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NOT_CALLED = -1, OUTER = -2 };

typedef struct arc {
  rm_lid from, to, left, right; /* spots, states */
} arc;

typedef struct edge_spot {
  rm_lid edge, spot;
} edge_spot;

typedef struct work {
  rm_arena       *scratch;
  const rm_part  *part;
  const rm_limit *l;
  rm_reason      *reason;
  rm_polygons    *out;
  int             side;
  rm_lid          t;
  rm_graph        g;
  const rm_lid     *segment_offset; /* [num_triangles of mesh `side` + 1] */
  const rm_segment *segment;
  rm_lid         *node_of; /* [num_spots] NOT_CALLED */
  rm_lid         *degree_offset, *around;
  arc            *arc;
  edge_spot      *touch;
  int64_t         spot_room, degree_room, around_room, component_room, half_room, arc_room, cycle_room, touch_room;
  rm_lid          num_boundary, num_arcs, num_touches;
} work;

static inline int other_side(const work *w) { return 1 - w->side; }

static remap_status tangled(const work *w)
{
  return rm_cells_tangled(w->part, w->l->mesh[w->side], w->side, w->t, w->reason);
}

/* ---- segments of mesh 2 ------------------------------------------------------------------------------------------ */

/* From those of mesh 1. */
static remap_status turn_segments(work *w, rm_arena *arena)
{
  const rm_limit *l = w->l;
  const rm_lid    n[2] = {l->mesh[0]->num_triangles, l->mesh[1]->num_triangles}, num = l->segment_offset[n[0]];
  rm_lid         *offset;
  rm_segment     *list;

  RM_NEW0(offset, arena, (int64_t)n[1] + 2);
  RM_NEW(list, arena, num);
  for (rm_lid k = 0; k < num; k++) offset[l->segment[k].other + 2]++;
  for (rm_lid t = 0; t < n[1]; t++) offset[t + 2] += offset[t + 1];
  for (rm_lid t = 0; t < n[0]; t++)
    for (rm_lid k = l->segment_offset[t]; k < l->segment_offset[t + 1]; k++) {
      const rm_segment *s              = &l->segment[k];
      list[offset[s->other + 1]++] = (rm_segment){t, s->q, s->p};
    }
  w->segment_offset = offset;
  w->segment        = list;
  return REMAP_OK;
}

/* ---- the graph of one triangle ----------------------------------------------------------------------------------- */

static remap_status node(work *w, rm_lid spot, rm_lid *out)
{
  if (w->node_of[spot] == NOT_CALLED) {
    RM_TRY(rm_grow(&w->g.spot, &w->spot_room, (int64_t)w->g.num_nodes + 1, sizeof *w->g.spot));
    w->node_of[spot]      = w->g.num_nodes;
    w->g.spot[w->g.num_nodes++] = spot;
  }
  *out = w->node_of[spot];
  return REMAP_OK;
}

static remap_status add_arc(work *w, rm_lid from, rm_lid to, rm_lid left, rm_lid right)
{
  rm_half h[2] = {{-1, left, -1, NOT_CALLED}, {-1, right, -1, right == OUTER ? OUTER : NOT_CALLED}};

  RM_TRY(node(w, from, &h[0].from));
  RM_TRY(node(w, to, &h[1].from));
  if (w->g.num_halves + 2 > w->half_room)
    RM_TRY(rm_grow(&w->g.half, &w->half_room, (int64_t)w->g.num_halves + 2, sizeof *w->g.half));
  memcpy(w->g.half + w->g.num_halves, h, sizeof h);
  w->g.num_halves += 2;
  return REMAP_OK;
}

static remap_status boundary(work *w)
{
  const rm_trimesh *m = w->l->mesh[w->side];
  const rm_limit   *l     = w->l;
  const rm_lines   *lines = &l->lines[w->side];

  for (int h = 0; h < 3; h++) {
    const rm_lid e = m->triangle_edge[w->t][h];
    const rm_lid first = lines->offset[e], n = lines->offset[e + 1] - first;
    const rm_lid end[2] = {l->vertex_spot[w->side][m->edge[e][0]], l->vertex_spot[w->side][m->edge[e][1]]};

    for (rm_lid i = 0; i <= n; i++) { /* pieces of the edge, which the boundary runs along; against the third */
      const rm_lid k = first + (h == 2 ? n - i : i);
      const rm_lid p = k > first ? lines->spot[k - 1] : end[0], q = k < first + n ? lines->spot[k] : end[1];
      rm_lid       at = k > first ? lines->state[k - 1] : lines->start[e], triangle, edge;
      if (rm_carrier(w->l, other_side(w), p, q, &triangle, &edge)) at = RM_UNKNOWN;
      if (at < RM_OUTSIDE) return tangled(w);
      RM_TRY(h == 2 ? add_arc(w, q, p, at, OUTER) : add_arc(w, p, q, at, OUTER));
    }
  }
  w->num_boundary = w->g.num_nodes;
  return REMAP_OK;
}

static remap_status push_arc(work *w, arc a)
{
  if (a.from > a.to) a = (arc){a.to, a.from, a.right, a.left};
  RM_TRY(rm_grow(&w->arc, &w->arc_room, (int64_t)w->num_arcs + 1, sizeof *w->arc));
  w->arc[w->num_arcs++] = a;
  return REMAP_OK;
}

static remap_status segments(work *w)
{
  const rm_limit *l = w->l;

  for (rm_lid k = w->segment_offset[w->t]; k < w->segment_offset[w->t + 1]; k++) {
    const rm_segment *s = &w->segment[k];
    if (rm_both_on_edge(w->l, w->side, w->t, s->p, s->q)) continue;
    const bool    along = rm_both_on_edge(w->l, other_side(w), s->other, s->p, s->q);
    const rm_lid *cell  = l->cell[other_side(w)][s->other];
    RM_TRY(push_arc(w, (arc){s->p, s->q, along ? RM_UNKNOWN : cell[0], along ? RM_UNKNOWN : cell[1]}));
  }
  return REMAP_OK;
}

/* ---- edges of the other mesh in the plane of the triangle -------------------------------------------------------- */

static remap_status push_touch(work *w, rm_lid spot)
{
  const rm_trimesh *m = w->l->mesh[other_side(w)];
  const rm_feature  f = w->l->spot[spot].at[other_side(w)];
  rm_lid            first = 0, last = 1;

  if (f.kind != RM_ON_VERTEX && f.kind != RM_ON_EDGE) return REMAP_OK;
  if (f.kind == RM_ON_VERTEX) first = m->vertex_edge_offset[f.id], last = m->vertex_edge_offset[f.id + 1];
  RM_TRY(rm_grow(&w->touch, &w->touch_room, (int64_t)w->num_touches + last - first, sizeof *w->touch));
  for (rm_lid k = first; k < last; k++)
    w->touch[w->num_touches++] = (edge_spot){f.kind == RM_ON_VERTEX ? m->vertex_edge[k] : f.id, spot};
  return REMAP_OK;
}

static int by_edge(const void *a, const void *b)
{
  const edge_spot *x = a, *y = b;
  return x->edge != y->edge ? (x->edge > y->edge) - (x->edge < y->edge) : (x->spot > y->spot) - (x->spot < y->spot);
}

static bool edge_is_present(const work *w, int side, rm_lid e)
{
  const rm_trimesh *m = w->l->mesh[side];

  for (rm_lid z = m->star_offset[e]; z < m->star_offset[e + 1]; z++)
    if (rm_is_present(w->l, side, w->l->first_copy[side][m->star[z] / 4])) return true;
  return false;
}

/* Edges of the other mesh that meet the closed triangle in two points lie in its plane, and nowhere else. */
static remap_status edges_in_plane(work *w)
{
  const rm_lines *lines = &w->l->lines[w->side];

  w->num_touches = 0;
  for (rm_lid k = 0; k < w->num_boundary; k++) RM_TRY(push_touch(w, w->g.spot[k]));
  for (rm_lid k = lines->inner_offset[w->t]; k < lines->inner_offset[w->t + 1]; k++)
    RM_TRY(push_touch(w, lines->inner_spot[k]));
  if (w->num_touches < 2) return REMAP_OK;
  qsort(w->touch, (size_t)w->num_touches, sizeof *w->touch, by_edge);
  for (rm_lid k = 0; k + 1 < w->num_touches; k++) {
    const edge_spot a = w->touch[k], b = w->touch[k + 1];
    if (a.edge != b.edge || rm_both_on_edge(w->l, w->side, w->t, a.spot, b.spot) || !edge_is_present(w, other_side(w), a.edge))
      continue;
    RM_TRY(push_arc(w, (arc){a.spot, b.spot, RM_UNKNOWN, RM_UNKNOWN}));
  }
  return REMAP_OK;
}

static int by_ends(const void *a, const void *b)
{
  const arc *x = a, *y = b;
  if (x->from != y->from) return x->from < y->from ? -1 : 1;
  if (x->to != y->to) return x->to < y->to ? -1 : 1;
  return (x->left > y->left) - (x->left < y->left);
}

/* ---- arcs inside the triangle ------------------------------------------------------------------------------------ */

/* An arc along an edge of the other mesh: the cells beside it. Separates is false where the other mesh only touches the
 * triangle there, with one cell on both sides. */
static remap_status place_arc(work *w, arc *a, bool *separates)
{
  rm_lid triangle[2] = {-1, -1}, cell[2] = {RM_UNKNOWN, RM_UNKNOWN}, ignored, f;

  if (!rm_carrier(w->l, other_side(w), a->from, a->to, &ignored, &f) || f < 0) return tangled(w);
  if (!rm_place_left(w->l, w->side, w->t, a->from, a->to, f, &triangle[0], &cell[0]) ||
      !rm_place_left(w->l, w->side, w->t, a->to, a->from, f, &triangle[1], &cell[1]))
    return tangled(w);
  if (triangle[0] < 0) a->left = cell[0];
  if (triangle[1] < 0) a->right = cell[1];
  *separates = triangle[0] >= 0 || triangle[1] >= 0 || cell[0] != cell[1];
  return REMAP_OK;
}

/* Arcs that several triangles of the other mesh make are one. */
static remap_status inner_arcs(work *w)
{
  w->num_arcs = 0;
  RM_TRY(segments(w));
  RM_TRY(edges_in_plane(w));
  if (w->num_arcs > 1) qsort(w->arc, (size_t)w->num_arcs, sizeof *w->arc, by_ends);
  for (rm_lid k = 0; k < w->num_arcs; k++) {
    arc *a         = &w->arc[k];
    bool separates = true;
    if (k && a->from == a[-1].from && a->to == a[-1].to) continue;
    if (a->left == RM_UNKNOWN) RM_TRY(place_arc(w, a, &separates));
    if (separates) RM_TRY(add_arc(w, a->from, a->to, a->left, a->right));
  }
  return REMAP_OK;
}

/* ---- walks ------------------------------------------------------------------------------------------------------- */

/* True if half y follows half x, both leaving one node, within less than half a turn counter-clockwise. */
static bool follows(const work *w, rm_lid x, rm_lid y)
{
  return rm_turn(&w->g.view, w->g.spot[w->g.half[x].from], w->g.spot[rm_end_of(&w->g, x)], w->g.spot[rm_end_of(&w->g, y)]) > 0;
}

/* Order the halves that leave a node of the boundary counter-clockwise. It has two halves of the boundary, which come first:
 * along it, which is now the first, and back along it, which becomes the last; all others are between. */
static void order_at_boundary(const work *w, rm_lid *list, rm_lid n)
{
  const rm_lid ahead = list[list[0] & 1], back = list[!(list[0] & 1)];

  for (rm_lid i = 1; i + 1 < n; i++) {
    const rm_lid x = list[i + 1];
    rm_lid       k = i;
    for (; k > 1 && follows(w, x, list[k - 1]); k--) list[k] = list[k - 1];
    list[k] = x;
  }
  list[0]     = ahead;
  list[n - 1] = back;
}

/* Order the halves that leave a node inside counter-clockwise, from the first of them on. */
static void order_inside(const work *w, rm_lid *list, rm_lid n)
{
  const rm_lid p = w->g.spot[w->g.half[list[0]].from], reference = w->g.spot[rm_end_of(&w->g, list[0])];

  for (rm_lid i = 2; i < n; i++) {
    const rm_lid x    = list[i];
    const int    turn = rm_turn(&w->g.view, p, reference, w->g.spot[rm_end_of(&w->g, x)]);
    rm_lid       k    = i;
    while (k > 1) {
      const int other = rm_turn(&w->g.view, p, reference, w->g.spot[rm_end_of(&w->g, list[k - 1])]);
      if (turn == other ? !follows(w, x, list[k - 1]) : turn < other) break; /* left, straight back, right */
      list[k] = list[k - 1];
      k--;
    }
    list[k] = x;
  }
}

static remap_status link_halves(work *w)
{
  rm_lid *offset;

  RM_TRY(rm_grow(&w->degree_offset, &w->degree_room, (int64_t)w->g.num_nodes + 2, sizeof *w->degree_offset));
  RM_TRY(rm_grow(&w->around, &w->around_room, w->g.num_halves, sizeof *w->around));
  offset = w->degree_offset;
  memset(offset, 0, sizeof *offset * ((size_t)w->g.num_nodes + 2));
  for (rm_lid h = 0; h < w->g.num_halves; h++) offset[w->g.half[h].from + 2]++;
  for (rm_lid k = 0; k < w->g.num_nodes; k++) offset[k + 2] += offset[k + 1];
  for (rm_lid h = 0; h < w->g.num_halves; h++) w->around[offset[w->g.half[h].from + 1]++] = h;
  for (rm_lid k = 0; k < w->g.num_nodes; k++) {
    rm_lid      *list = w->around + offset[k];
    const rm_lid n    = offset[k + 1] - offset[k];
    if (n > 2 && k < w->num_boundary) order_at_boundary(w, list, n);
    if (n > 2 && k >= w->num_boundary) order_inside(w, list, n);
    for (rm_lid i = 0; i < n; i++) w->g.half[list[(i + 1) % n] ^ 1].next = list[i];
  }
  return REMAP_OK;
}

static remap_status walk_cycles(work *w)
{
  rm_lid *seen;

  RM_TRY(rm_grow(&w->g.component, &w->component_room, w->g.num_nodes, sizeof *w->g.component));
  seen = w->g.component;
  for (rm_lid k = 0; k < w->g.num_nodes; k++) seen[k] = -1;
  w->g.num_cycles = 0;
  for (rm_lid first = 0; first < w->g.num_halves; first++) {
    rm_cycle c = {first, 0, RM_UNKNOWN, -1, -1, -1, true};
    rm_lid   h = first;

    if (w->g.half[first].cycle != NOT_CALLED) continue;
    do {
      if (w->g.half[h].cycle != NOT_CALLED) return tangled(w);
      w->g.half[h].cycle = w->g.num_cycles;
      c.simple         = c.simple && seen[w->g.half[h].from] != w->g.num_cycles;
      seen[w->g.half[h].from] = w->g.num_cycles;
      c.num++;
      if (w->g.half[h].state != RM_UNKNOWN) {
        if (c.state != RM_UNKNOWN && c.state != w->g.half[h].state) return tangled(w);
        c.state = w->g.half[h].state;
      }
      h = w->g.half[h].next;
    } while (h != first);
    RM_TRY(rm_grow(&w->g.cycle, &w->cycle_room, (int64_t)w->g.num_cycles + 1, sizeof *w->g.cycle));
    w->g.cycle[w->g.num_cycles++] = c;
  }
  return REMAP_OK;
}

/* ---- where a polygon lies in the other mesh ---------------------------------------------------------------------- */

/* Of a polygon that has no arc with a state: all its arcs lie on triangles of the other mesh. */
static remap_status locate(work *w, const rm_cycle *c, rm_lid *triangle, rm_lid *state)
{
  const rm_trimesh *own = w->l->mesh[w->side], *other = w->l->mesh[other_side(w)];
  const rm_lid      p = w->g.spot[w->g.half[c->half].from], q = w->g.spot[rm_end_of(&w->g, c->half)];
  rm_lid            b, f;

  *triangle = -1;
  if (!rm_carrier(w->l, other_side(w), p, q, &b, &f)) return tangled(w);
  if (f >= 0) return rm_place_left(w->l, w->side, w->t, p, q, f, triangle, state) ? REMAP_OK : tangled(w);
  /* the arc runs through the inside of b: along an edge of this triangle, whose far corner is off that edge */
  for (int h = 0; h < 3; h++) {
    const rm_lid e = own->triangle_edge[w->t][h];
    if (!rm_on_edge(w->l, w->side, p, e) || !rm_on_edge(w->l, w->side, q, e)) continue;
    const double *x = own->vertex[own->triangle[w->t][h == 0 ? 2 : h == 1 ? 0 : 1]];
    const rm_lid *v = other->triangle[b];
    const int     s = rm_orient3d(other->vertex[v[0]], other->vertex[v[1]], other->vertex[v[2]], x);
    if (s == 0) *triangle = b;
    else *state = w->l->cell[other_side(w)][b][s > 0];
    return REMAP_OK;
  }
  return tangled(w);
}

/* True if the normals of coplanar triangles t of `side` and b of the other mesh point the same way. */
static bool same_way(const work *w, rm_lid b)
{
  const rm_trimesh *own = w->l->mesh[w->side], *other = w->l->mesh[other_side(w)];
  const rm_lid     *v = own->triangle[w->t], *u = other->triangle[b];
  double            o[3];

  rm_off_plane(own->vertex[v[0]], own->vertex[v[1]], own->vertex[v[2]], o);
  return rm_orient3d(other->vertex[u[0]], other->vertex[u[1]], other->vertex[u[2]], o) > 0;
}

/* ---- output ------------------------------------------------------------------------------------------------------ */

static remap_status push_vertex(rm_polygons *out, rm_lid spot)
{
  if (out->num_vertices == out->vertex_room)
    RM_TRY(rm_grow(&out->vertex, &out->vertex_room, out->num_vertices + 1, sizeof *out->vertex));
  out->vertex[out->num_vertices++] = spot;
  return REMAP_OK;
}

/* Finish a polygon whose vertices are those that came last. */
static remap_status push_polygon(work *w, rm_lid b, rm_lid state)
{
  rm_polygons *out = w->out;

  if (out->num == (1 << 30) - 1 || out->num_vertices > UINT32_MAX) return REMAP_TOO_LARGE;
  RM_TRY(rm_grow(&out->first, &out->first_room, out->num + 2, sizeof *out->first));
  RM_TRY(rm_grow(&out->own, &out->own_room, out->num + 1, sizeof *out->own));
  RM_TRY(rm_grow(&out->other, &out->other_room, out->num + 1, sizeof *out->other));
  out->own[out->num]     = 2 * w->t + w->side;
  out->other[out->num]   = b < 0 ? state : -2 - (2 * b + !same_way(w, b));
  out->first[++out->num] = (uint32_t)out->num_vertices;
  return REMAP_OK;
}

static remap_status push_loop(work *w, const rm_cycle *c, rm_polygons *to)
{
  rm_lid h = c->half;

  do {
    RM_TRY(push_vertex(to, w->g.spot[w->g.half[h].from]));
    h = w->g.half[h].next;
  } while (h != c->half);
  return REMAP_OK;
}

/* Its loops, the outer one first, and the triangles. */
static remap_status cut_loops(work *w, rm_arena *arena, rm_lid around, rm_polygons *loops, rm_lid **corner, int64_t *num)
{
  int64_t *offset;
  int      n = 0;

  RM_NEW(offset, arena, (int64_t)w->g.num_cycles + 1);
  for (rm_lid c = around; c >= 0; c = c == around ? w->g.cycle[c].first_hole : w->g.cycle[c].next_hole) {
    offset[n++] = loops->num_vertices;
    RM_TRY(push_loop(w, &w->g.cycle[c], loops));
  }
  offset[n] = loops->num_vertices;
  const remap_status status = rm_cut_holes(arena, &w->g.view, n, offset, loops->vertex, corner, num);
  return status == REMAP_BAD_MESH ? tangled(w) : status;
}

/* A polygon with holes, or which meets itself in a vertex, as triangles. */
static remap_status push_cut(work *w, rm_lid around, rm_lid b, rm_lid state)
{
  rm_arena    *arena  = rm_arena_new();
  rm_polygons  loops  = {0};
  rm_lid      *corner = NULL;
  int64_t      num    = 0;
  remap_status status = arena ? cut_loops(w, arena, around, &loops, &corner, &num) : REMAP_NO_MEMORY;

  for (int64_t k = 0; k < num && status == REMAP_OK; k++) {
    for (int h = 0; h < 3 && status == REMAP_OK; h++) status = push_vertex(w->out, corner[3 * k + h]);
    if (status == REMAP_OK) status = push_polygon(w, b, state);
  }
  free(loops.vertex);
  rm_arena_drop(arena);
  return status;
}

static remap_status one_triangle(work *w)
{
  remap_status status = REMAP_OK;

  w->g.num_nodes = w->g.num_halves = 0;
  RM_TRY(boundary(w));
  RM_TRY(inner_arcs(w));
  w->g.view = rm_view_of(w->l, w->side, w->t);
  RM_TRY(link_halves(w));
  RM_TRY(walk_cycles(w));
  status = rm_find_holes(&w->g);
  if (status == REMAP_BAD_MESH) return tangled(w);
  for (rm_lid k = 0; k < w->g.num_cycles && status == REMAP_OK; k++) {
    const rm_cycle *c = &w->g.cycle[k];
    rm_lid       b = -1, state = c->state;

    if (c->inside >= 0) continue;
    if (c->num < 3) return tangled(w);
    if (state == RM_UNKNOWN) RM_TRY(locate(w, c, &b, &state));
    if (b >= 0 && w->side == 1) continue;
    if (!c->simple || c->first_hole >= 0) {
      status = push_cut(w, k, b, state);
      continue;
    }
    RM_TRY(push_loop(w, c, w->out));
    status = push_polygon(w, b, state);
  }
  for (rm_lid k = 0; k < w->g.num_nodes; k++) w->node_of[w->g.spot[k]] = NOT_CALLED;
  return status;
}

/* Room for as many more polygons and vertices as the present mesh has in general position, where the graph of every triangle is
 * connected: by Euler, one polygon and one more for each inner arc, less one for each vertex inside. */
static remap_status reserve(const work *w)
{
  const rm_limit   *l        = w->l;
  const rm_trimesh *m        = l->mesh[w->side];
  rm_polygons      *out      = w->out;
  const int64_t     segments = w->segment_offset[m->num_triangles];
  int64_t           polygons = segments + m->num_triangles, vertices = 2 * segments;

  for (rm_lid p = 0; p < l->num_spots; p++) polygons -= l->spot[p].at[w->side].kind == RM_ON_TRIANGLE;
  for (rm_lid t = 0; t < m->num_triangles; t++)
    for (int h = 0; h < 3; h++) {
      const rm_lid e = m->triangle_edge[t][h];
      vertices += 1 + l->lines[w->side].offset[e + 1] - l->lines[w->side].offset[e];
    }
  polygons = out->num + (polygons < 0 ? 0 : polygons + polygons / 64);
  RM_TRY(rm_grow(&out->first, &out->first_room, polygons + 1, sizeof *out->first));
  RM_TRY(rm_grow(&out->own, &out->own_room, polygons, sizeof *out->own));
  RM_TRY(rm_grow(&out->other, &out->other_room, polygons, sizeof *out->other));
  if (!out->num) out->first[0] = 0;
  return rm_grow(&out->vertex, &out->vertex_room, out->num_vertices + vertices, sizeof *out->vertex);
}

static remap_status all_triangles(work *w, rm_arena *lines[2])
{
  RM_NEW(w->node_of, w->scratch, w->l->num_spots);
  for (rm_lid p = 0; p < w->l->num_spots; p++) w->node_of[p] = NOT_CALLED;
  w->segment_offset = w->l->segment_offset;
  w->segment        = w->l->segment;
  for (w->side = 0; w->side < 2; w->side++) {
    RM_TRY(reserve(w));
    for (w->t = 0; w->t < w->l->mesh[w->side]->num_triangles; w->t++)
      if (rm_is_present(w->l, w->side, w->t)) RM_TRY(one_triangle(w));
    if (w->side == 0) RM_TRY(turn_segments(w, lines[1]));
    rm_arena_drop(lines[w->side]);
    lines[w->side] = NULL;
  }
  return REMAP_OK;
}

/* Give back what an array has grown too far. */
static void *trimmed(void *data, int64_t *room, int64_t num, size_t size)
{
  void *moved = num < *room && num > 0 ? realloc(data, (size_t)num * size) : NULL;

  if (moved) *room = num;
  return moved ? moved : data;
}

void rm_polygons_trim(rm_polygons *p)
{
  p->first  = trimmed(p->first, &p->first_room, p->num + 1, sizeof *p->first);
  p->own    = trimmed(p->own, &p->own_room, p->num, sizeof *p->own);
  p->other  = trimmed(p->other, &p->other_room, p->num, sizeof *p->other);
  p->vertex = trimmed(p->vertex, &p->vertex_room, p->num_vertices, sizeof *p->vertex);
}

void rm_polygons_free(rm_polygons *p)
{
  free(p->first);
  free(p->own);
  free(p->other);
  free(p->vertex);
}

remap_status rm_polygons_build(const rm_part *part, const rm_limit *l, rm_arena *lines[2], rm_polygons *out, rm_reason *reason)
{
  work         w      = {.scratch = rm_arena_new(), .part = part, .l = l, .reason = reason, .out = out};
  remap_status status = w.scratch ? all_triangles(&w, lines) : REMAP_NO_MEMORY;

  free(w.g.spot);
  free(w.degree_offset);
  free(w.around);
  free(w.g.component);
  free(w.g.half);
  free(w.arc);
  free(w.g.cycle);
  free(w.touch);
  rm_arena_drop(w.scratch);
  rm_polygons_trim(out);
  return status;
}
