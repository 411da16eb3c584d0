/* limit -- where the two meshes touch, found exactly, and the vertices of the supermesh that follow.
 *
 * The overlay finds every crossing of an edge with the inside of a triangle, but thinks mesh 2 moved by an infinitesimal.
 * Three kinds of contacts say all about its limit: vertices of one mesh on triangles of the other, either way, and edges
 * that cross each other inside. A crossing whose edge or triangle takes part in one of them at its place becomes that
 * contact; all others are vertices of their own. Contacts are looked for in the cells that the overlay names: O(n +
 * crossings) times the size of a cell. */
#include "cells/cells_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* An edge of mesh 1 and one of mesh 2 that cross inside both. */
typedef struct edge_contact {
  rm_lid edge[2], spot;
} edge_contact;

typedef struct builder {
  const rm_limit_home *home;
  rm_arena         *arena, *scratch; /* home->rest; working memory */
  const rm_part    *part;
  const rm_overlay *o;
  rm_limit      *l;
  rm_reason     *reason;
  const rm_boxtree *tree[2];      /* [side] over all triangles, NULL until needed */
  const double (*box[2])[6];
  uint8_t       *edge_present[2]; /* [side][num_edges] some present triangle has the edge */
  rm_feature    *at[2];           /* [side][num_vertices] where the vertex lies in the other mesh */
  rm_lid        *crossing_spot[2]; /* [side][crossings of its edges] */
  edge_contact  *contact;         /* ascending by edge[0], then by edge[1] */
  int64_t        num_contacts, contact_room;
  rm_lid        *contact_first[2]; /* [side][num_edges + 1] */
  rm_lid        *contact_of[2];    /* contacts of an edge   */
  rm_spot       *spot;
  int64_t        spot_room;
  rm_lid        *on_edge_offset[2], *on_edge[2]; /* vertices of the other mesh on an edge of `side` */
} builder;

static inline const double *corner(const rm_trimesh *m, rm_lid t, int h) { return m->vertex[m->triangle[t][h]]; }

/* ---- triangles that lie on each other ---------------------------------------------------------------------------- */

static remap_status overlapping(const builder *b, int side, rm_lid cell)
{
  return rm_fail(REMAP_BAD_MESH, b->reason, side, cell >= 0 ? b->part->piece[side].cell_global[cell] : -1,
                 "this cell overlaps another of its mesh; a supermesh needs cells that do not");
}

remap_status rm_cells_tangled(const rm_part *part, const rm_trimesh *mesh, int side, rm_lid t, rm_reason *reason)
{
  const rm_lid *cell = mesh->side[t], c = cell[0] >= 0 ? cell[0] : cell[1];

  return rm_fail(REMAP_BAD_MESH, reason, side, c >= 0 ? part->piece[side].cell_global[c] : -1,
                 "a face of this cell meets cells of the other mesh that overlap, or overlaps faces of its own mesh; a "
                 "supermesh needs cells that do not");
}

/* The sides of triangles first..last - 1, which lie on each other, less the cells that are on both. */
static remap_status net_sides(const builder *b, int side, rm_lid first, rm_lid last, rm_lid net[2])
{
  const rm_trimesh *m = b->l->mesh[side];
  int               left = 0;

  net[0] = net[1] = RM_OUTSIDE;
  for (int h = 0; h < 2; h++) {
    left = 0;
    for (rm_lid t = first; t < last; t++) {
      const rm_lid c = m->side[t][h];
      int          times = 0;
      if (c < 0) continue;
      for (rm_lid s = first; s < last; s++) times += (m->side[s][h] == c) - (m->side[s][1 - h] == c);
      if (times <= 0 || net[h] == c) continue;
      net[h] = c;
      left += times;
    }
    if (left > 1) return overlapping(b, side, net[h]);
  }
  return REMAP_OK;
}

static inline bool is_copy(const rm_trimesh *m, rm_lid t)
{
  return t > 0 && !memcmp(m->triangle[t], m->triangle[t - 1], sizeof *m->triangle);
}

static remap_status join_copies(builder *b, int side)
{
  const rm_trimesh *m = b->l->mesh[side];
  rm_lid           *first, (*cell)[2] = NULL, copies = 0;

  RM_NEW(first, b->arena, m->num_triangles);
  RM_NEW0(b->edge_present[side], b->scratch, m->num_edges);
  for (rm_lid t = 0; t < m->num_triangles; t++) copies += is_copy(m, t);
  if (copies) RM_NEW(cell, b->arena, m->num_triangles);
  b->l->cell[side] = copies ? (const rm_lid(*)[2])cell : m->side; /* one triangle alone has its own sides */
  for (rm_lid t = 0, last; t < m->num_triangles; t = last) {
    for (last = t + 1; last < m->num_triangles && is_copy(m, last);) last++;
    RM_ASSERT(rm_has_area(m, t));
    for (rm_lid s = t; s < last; s++) first[s] = t;
    if (copies) {
      RM_TRY(net_sides(b, side, t, last, cell[t]));
      for (rm_lid s = t + 1; s < last; s++) memcpy(cell[s], cell[t], sizeof *cell);
    }
    for (int h = 0; h < 3 && b->l->cell[side][t][0] != b->l->cell[side][t][1]; h++)
      b->edge_present[side][m->triangle_edge[t][h]] = 1;
  }
  b->l->first_copy[side] = first;
  return REMAP_OK;
}

/* ---- contacts ---------------------------------------------------------------------------------------------------- */

/* A feature that a point of cell j, moved by an infinitesimal, lies on is one of that cell; of the skin if it is in no cell.
 * Where a cell is too large to be searched through, a tree over all triangles is, made when first needed. */
enum { LARGE = 256 };

static remap_status need_tree(builder *b, int side)
{
  const rm_trimesh *m = b->l->mesh[side];
  double          (*box)[6];

  if (b->tree[side]) return REMAP_OK;
  if (m->num_skin == m->num_triangles) { /* a closed surface: all is skin, in the same order */
    b->tree[side] = m->skin_tree;
    b->box[side]  = m->skin_box;
    return REMAP_OK;
  }
  RM_NEW(box, b->scratch, m->num_triangles);
  for (rm_lid t = 0; t < m->num_triangles; t++)
    for (int c = 0; c < 3; c++) {
      box[t][c]     = fmin(corner(m, t, 0)[c], fmin(corner(m, t, 1)[c], corner(m, t, 2)[c]));
      box[t][c + 3] = fmax(corner(m, t, 0)[c], fmax(corner(m, t, 1)[c], corner(m, t, 2)[c]));
    }
  b->box[side] = (const double (*)[6])box;
  return rm_boxtree_build(b->scratch, m->num_triangles, b->box[side], &b->tree[side]);
}

typedef struct vertex_query {
  const rm_limit *l;
  int             other;
  const double   *p;
  rm_feature      found;
} vertex_query;

/* Where in triangle t of the other mesh the point lies, if it does; a vertex ends the search, an edge wins. */
static int touch_triangle(void *user, rm_lid t)
{
  vertex_query     *q = user;
  const rm_trimesh *m = q->l->mesh[q->other];
  const double     *v[3] = {corner(m, t, 0), corner(m, t, 1), corner(m, t, 2)};
  double            o[3];
  int               turn[3], zeros = 0;

  for (int c = 0; c < 3; c++) {
    const double x = q->p[c];
    if ((v[0][c] < x && v[1][c] < x && v[2][c] < x) || (v[0][c] > x && v[1][c] > x && v[2][c] > x)) return 0;
  }
  if (rm_orient3d(v[0], v[1], v[2], q->p) != 0 || !rm_is_present(q->l, q->other, t)) return 0;
  if (!rm_off_plane(v[0], v[1], v[2], o)) return 0;
  for (int h = 0; h < 3; h++) {
    turn[h] = rm_orient3d(v[h], v[(h + 1) % 3], q->p, o);
    if (turn[h] < 0) return 0;
    zeros += turn[h] == 0;
  }
  if (zeros == 2) {
    const int h = turn[0] ? 2 : turn[1] ? 0 : 1; /* the corner between the two sides it is on */
    q->found = rm_feature_of(RM_ON_VERTEX, m->triangle[t][h]);
    return 1;
  }
  if (zeros == 1) {
    const int h = !turn[0] ? 0 : !turn[1] ? 1 : 2;
    q->found = rm_feature_of(RM_ON_EDGE, m->triangle_edge[t][h]);
  } else if (q->found.kind == RM_ON_NOTHING) {
    q->found = rm_feature_of(RM_ON_TRIANGLE, t);
  }
  return 0;
}

static int touch_skin(void *user, rm_lid item)
{
  const vertex_query *q = user;
  return touch_triangle(user, q->l->mesh[q->other]->skin[item]);
}

/* State of a vertex in the other mesh. */
static rm_lid state_of_vertex(const rm_overlay *o, int side, rm_lid v)
{
  const rm_trimesh *m = o->mesh[side];
  const rm_trace   *t = &o->trace[side];
  const rm_lid      e = m->vertex_edge[m->vertex_edge_offset[v]];

  if (m->edge[e][0] == v || t->count[e] == 0) return t->state[e];
  return t->crossing[t->first[e] + t->count[e] - 1].state;
}

static remap_status place_vertices(builder *b, int side)
{
  const rm_trimesh *own = b->l->mesh[side], *other = b->l->mesh[1 - side];

  RM_NEW(b->at[side], b->scratch, own->num_vertices);
  for (rm_lid v = 0; v < own->num_vertices; v++) {
    const rm_lid  j = state_of_vertex(b->o, side, v);
    const double *p = own->vertex[v], at[6] = {p[0], p[1], p[2], p[0], p[1], p[2]};
    vertex_query  q = {b->l, 1 - side, p, {RM_ON_NOTHING, 0}};

    if (j == RM_OUTSIDE) {
      rm_boxtree_query(other->skin_tree, other->skin_box, at, touch_skin, &q);
    } else if (j < RM_OUTSIDE || other->cell_triangle_offset[j + 1] - other->cell_triangle_offset[j] > LARGE) {
      RM_TRY(need_tree(b, 1 - side));
      rm_boxtree_query(b->tree[1 - side], b->box[1 - side], at, touch_triangle, &q);
    } else {
      for (rm_lid k = other->cell_triangle_offset[j]; k < other->cell_triangle_offset[j + 1]; k++)
        if (touch_triangle(&q, b->l->first_copy[1 - side][other->cell_triangle[k] / 2])) break;
    }
    b->at[side][v] = q.found;
  }
  return REMAP_OK;
}

typedef struct edge_query {
  builder      *b;
  rm_lid        edge;
  const double *p0, *p1;
  double        box[6]; /* of the present piece of it */
  int64_t       first;  /* contact of this edge       */
  remap_status  status;
} edge_query;

/* Sides of the piece's box that a point is beyond; points beyond one and the same make no edge that meets the piece. */
static unsigned beyond(const edge_query *q, const double p[3])
{
  unsigned code = 0;

  for (int c = 0; c < 3; c++) code |= (unsigned)(p[c] < q->box[c]) << c | (unsigned)(p[c] > q->box[c + 3]) << (c + 3);
  return code;
}

/* The box of the piece between two parameters, with room for their rounding. */
static void set_box(edge_query *q, double from, double to)
{
  double size = 0;

  for (int c = 0; c < 3; c++) size = fmax(size, fabs(q->p1[c] - q->p0[c]));
  for (int c = 0; c < 3; c++) {
    const double u = q->p1[c] - q->p0[c], a = q->p0[c] + from * u, b = q->p0[c] + to * u;
    const double slack = 0x1p-46 * size + 0x1p-50 * fmax(fabs(q->p0[c]), fabs(q->p1[c]));
    q->box[c]          = fmin(a, b) - slack;
    q->box[c + 3]      = fmax(a, b) + slack;
  }
}

/* Edges that are coplanar and cross inside both: each has its ends on both sides of the other. */
static int touch_edge(edge_query *q, rm_lid f)
{
  const rm_trimesh *m2 = q->b->l->mesh[1];
  const double     *f0 = m2->vertex[m2->edge[f][0]], *f1 = m2->vertex[m2->edge[f][1]];
  double            o[3];

  if (rm_orient3d(q->p0, q->p1, f0, f1) != 0 || !q->b->edge_present[1][f]) return 0;
  if (!rm_off_plane(q->p0, q->p1, f0, o) && !rm_off_plane(q->p0, q->p1, f1, o)) return 0;
  if (rm_orient3d(o, q->p0, q->p1, f0) * rm_orient3d(o, q->p0, q->p1, f1) >= 0) return 0;
  if (rm_orient3d(o, f0, f1, q->p0) * rm_orient3d(o, f0, f1, q->p1) >= 0) return 0;
  for (int64_t k = q->first; k < q->b->num_contacts; k++)
    if (q->b->contact[k].edge[1] == f) return 0;
  q->status = rm_grow(&q->b->contact, &q->b->contact_room, q->b->num_contacts + 1, sizeof *q->b->contact);
  if (q->status != REMAP_OK) return 1;
  q->b->contact[q->b->num_contacts++] = (edge_contact){{q->edge, f}, -1};
  return 0;
}

static int touch_edges_of(void *user, rm_lid t)
{
  edge_query *q = user;

  for (int h = 0; h < 3; h++)
    if (touch_edge(q, q->b->l->mesh[1]->triangle_edge[t][h])) return 1;
  return 0;
}

static int touch_edges_of_skin(void *user, rm_lid item)
{
  const edge_query *q = user;
  return touch_edges_of(user, q->b->l->mesh[1]->skin[item]);
}

/* Contacts of the present piece with the edges of cell j, by sides of its box that all their vertices are beyond. */
static void touch_near(edge_query *q, rm_lid j)
{
  static const int  low[3] = {0, 1, 0}, high[3] = {1, 2, 2};
  const rm_trimesh *m2     = q->b->l->mesh[1];
  const rm_lid     *vertex = m2->cell_vertex + m2->cell_vertex_offset[j],
               n           = m2->cell_vertex_offset[j + 1] - m2->cell_vertex_offset[j];
  unsigned          code[256]; /* places in a cell are bytes */

  for (rm_lid k = 0; k < n; k++) code[k] = beyond(q, m2->vertex[vertex[k]]);
  for (rm_lid k = m2->cell_triangle_offset[j]; k < m2->cell_triangle_offset[j + 1]; k++) {
    const uint8_t *corner = m2->cell_triangle_vertex[k];
    if (code[corner[0]] & code[corner[1]] & code[corner[2]]) continue;
    for (int h = 0; h < 3; h++)
      if (!(code[corner[low[h]]] & code[corner[high[h]]]) && touch_edge(q, m2->triangle_edge[m2->cell_triangle[k] / 2][h]))
        return;
  }
}

/* The same for any cell in which the piece runs. */
static remap_status touch_cell(edge_query *q, rm_lid j)
{
  builder          *b  = q->b;
  const rm_trimesh *m2 = b->l->mesh[1];

  if (j >= 0 && m2->cell_vertex_offset[j] < m2->cell_vertex_offset[j + 1]) {
    touch_near(q, j);
  } else if (j == RM_OUTSIDE) {
    rm_boxtree_query(m2->skin_tree, m2->skin_box, q->box, touch_edges_of_skin, q);
  } else {
    RM_TRY(need_tree(b, 1));
    rm_boxtree_query(b->tree[1], b->box[1], q->box, touch_edges_of, q);
  }
  return q->status;
}

/* The order in which cells are searched is not that of the mesh: put the contacts of one edge from `first` on into it. */
static void sort_contacts(builder *b, int64_t first)
{
  for (int64_t i = first + 1; i < b->num_contacts; i++) {
    const edge_contact x = b->contact[i];
    int64_t            k = i;
    for (; k > first && b->contact[k - 1].edge[1] > x.edge[1]; k--) b->contact[k] = b->contact[k - 1];
    b->contact[k] = x;
  }
}

static remap_status cross_edges(builder *b)
{
  const rm_trimesh *m1 = b->l->mesh[0];
  const rm_trace   *trace = &b->o->trace[0];

  for (rm_lid e = 0; e < m1->num_edges; e++) {
    const rm_crossing *x = trace->crossing + trace->first[e];
    edge_query         q = {b, e, m1->vertex[m1->edge[e][0]], m1->vertex[m1->edge[e][1]], {0}, b->num_contacts, REMAP_OK};

    for (rm_lid k = 0; k <= trace->count[e] && b->edge_present[0][e]; k++) {
      set_box(&q, k ? x[k - 1].lambda : 0, k < trace->count[e] ? x[k].lambda : 1);
      RM_TRY(touch_cell(&q, k ? x[k - 1].state : trace->state[e]));
    }
    sort_contacts(b, q.first);
  }
  for (int side = 0; side < 2; side++) {
    const rm_trimesh *m = b->l->mesh[side];
    rm_lid           *first;

    RM_NEW0(first, b->scratch, (int64_t)m->num_edges + 2);
    RM_NEW(b->contact_of[side], b->scratch, b->num_contacts);
    for (int64_t k = 0; k < b->num_contacts; k++) first[b->contact[k].edge[side] + 2]++;
    for (rm_lid e = 0; e < m->num_edges; e++) first[e + 2] += first[e + 1];
    for (int64_t k = 0; k < b->num_contacts; k++) b->contact_of[side][first[b->contact[k].edge[side] + 1]++] = (rm_lid)k;
    b->contact_first[side] = first;
  }
  return REMAP_OK;
}

/* ---- spots ------------------------------------------------------------------------------------------------------- */

static remap_status push_spot(builder *b, rm_feature at1, rm_feature at2, rm_lid *out)
{
  if (b->l->num_spots == INT32_MAX - 8) return REMAP_TOO_LARGE;
  RM_TRY(rm_grow(&b->spot, &b->spot_room, (int64_t)b->l->num_spots + 1, sizeof *b->spot));
  b->spot[b->l->num_spots] = (rm_spot){{at1, at2}};
  *out = b->l->num_spots++;
  return REMAP_OK;
}

static remap_status vertex_spots(builder *b)
{
  for (int side = 0; side < 2; side++) {
    const rm_trimesh *m = b->l->mesh[side];
    rm_lid           *spot;

    RM_NEW(spot, b->arena, m->num_vertices);
    for (rm_lid v = 0; v < m->num_vertices; v++) {
      const rm_feature own = rm_feature_of(RM_ON_VERTEX, v), other = b->at[side][v];
      if (side == 1 && other.kind == RM_ON_VERTEX) spot[v] = b->l->vertex_spot[0][other.id];
      else RM_TRY(push_spot(b, side ? other : own, side ? own : other, &spot[v]));
    }
    b->l->vertex_spot[side] = spot;
  }
  for (int64_t k = 0; k < b->num_contacts; k++)
    RM_TRY(push_spot(b, rm_feature_of(RM_ON_EDGE, b->contact[k].edge[0]), rm_feature_of(RM_ON_EDGE, b->contact[k].edge[1]),
                     &b->contact[k].spot));
  return REMAP_OK;
}

/* The contact at which edge e of `side` crosses triangle t of the other mesh, -1 if there is none. */
static rm_lid contact_at(const builder *b, int side, rm_lid e, rm_lid t)
{
  const rm_trimesh *own = b->l->mesh[side], *other = b->l->mesh[1 - side];

  for (int h = 0; h < 2; h++) {
    const rm_lid v = own->edge[e][h];
    if (rm_in_triangle(b->l, 1 - side, b->at[side][v], t)) return b->l->vertex_spot[side][v];
  }
  for (int h = 0; h < 3; h++) {
    const rm_feature f = b->at[1 - side][other->triangle[t][h]];
    if (f.kind == RM_ON_EDGE && f.id == e) return b->l->vertex_spot[1 - side][other->triangle[t][h]];
  }
  for (rm_lid k = b->contact_first[side][e]; k < b->contact_first[side][e + 1]; k++) {
    const edge_contact *c = &b->contact[b->contact_of[side][k]];
    for (int h = 0; h < 3; h++)
      if (other->triangle_edge[t][h] == c->edge[1 - side]) return c->spot;
  }
  return -1;
}

static remap_status crossing_spots(builder *b, int side)
{
  const rm_trimesh *own = b->l->mesh[side];
  const rm_trace   *trace = &b->o->trace[side];
  const rm_lid     *copy  = b->l->first_copy[1 - side];
  rm_lid           *spot;

  RM_NEW(spot, b->scratch, trace->num_crossings);
  for (rm_lid e = 0; e < own->num_edges; e++)
    for (int64_t x = trace->first[e]; x < trace->first[e] + trace->count[e]; x++) {
      const rm_lid     t = copy[trace->crossing[x].triangle / 2];
      const rm_feature edge = rm_feature_of(RM_ON_EDGE, e), triangle = rm_feature_of(RM_ON_TRIANGLE, t);

      spot[x] = contact_at(b, side, e, t);
      for (int64_t y = trace->first[e]; y < x && spot[x] < 0; y++)
        if (copy[trace->crossing[y].triangle / 2] == t) spot[x] = spot[y];
      if (spot[x] < 0) RM_TRY(push_spot(b, side ? triangle : edge, side ? edge : triangle, &spot[x]));
    }
  b->crossing_spot[side] = spot;
  return REMAP_OK;
}

/* The spots are all there. */
static remap_status keep_spots(builder *b)
{
  rm_spot *spot;

  spot = rm_arena_alloc_apart(b->home->spots, b->l->num_spots, sizeof *spot);
  if (!spot) return REMAP_NO_MEMORY;
  if (b->l->num_spots) memcpy(spot, b->spot, sizeof *spot * (size_t)b->l->num_spots);
  free(b->spot);
  b->spot    = NULL;
  b->l->spot = spot;
  return REMAP_OK;
}

/* ---- vertices of the other mesh on edges and in triangles -------------------------------------------------------- */

static remap_status file_vertices(builder *b, int side)
{
  const rm_trimesh *own = b->l->mesh[side], *other = b->l->mesh[1 - side];
  rm_arena         *lines = b->home->lines[side];
  rm_lid           *inner_offset, *inner, *on_offset, *on, num_inner = 0, num_on = 0;

  RM_NEW0(inner_offset, lines, (int64_t)own->num_triangles + 2);
  RM_NEW0(on_offset, b->scratch, (int64_t)own->num_edges + 2);
  for (rm_lid v = 0; v < other->num_vertices; v++) {
    const rm_feature f = b->at[1 - side][v];
    if (f.kind == RM_ON_TRIANGLE) inner_offset[f.id + 2]++, num_inner++;
    if (f.kind == RM_ON_EDGE) on_offset[f.id + 2]++, num_on++;
  }
  for (rm_lid t = 0; t < own->num_triangles; t++) inner_offset[t + 2] += inner_offset[t + 1];
  for (rm_lid e = 0; e < own->num_edges; e++) on_offset[e + 2] += on_offset[e + 1];
  RM_NEW(inner, lines, num_inner);
  RM_NEW(on, b->scratch, num_on);
  for (rm_lid v = 0; v < other->num_vertices; v++) {
    const rm_feature f = b->at[1 - side][v];
    if (f.kind == RM_ON_TRIANGLE) inner[inner_offset[f.id + 1]++] = b->l->vertex_spot[1 - side][v];
    if (f.kind == RM_ON_EDGE) on[on_offset[f.id + 1]++] = v;
  }
  b->l->lines[side].inner_offset = inner_offset;
  b->l->lines[side].inner_spot   = inner;
  b->on_edge_offset[side]        = on_offset;
  b->on_edge[side]               = on;
  return REMAP_OK;
}

/* ---- segments ---------------------------------------------------------------------------------------------------- */

/* Segment k / 2 of triangle t of mesh 1 in the limit; false if there it has no length, or a triangle is absent. */
static bool limit_segment(const builder *b, rm_lid t, int64_t k, rm_segment *out)
{
  const rm_end *end = &b->o->end[k];
  rm_lid        p[2];

  for (int h = 0; h < 2; h++) p[h] = b->crossing_spot[end[h].at >> 1 & 1][end[h].at >> 2];
  *out = (rm_segment){b->l->first_copy[1][end->other], p[0], p[1]};
  return p[0] != p[1] && rm_is_present(b->l, 0, b->l->first_copy[0][t]) && rm_is_present(b->l, 1, out->other);
}

/* Those of triangles of mesh 1, copies of one triangle as those of the first, which stands before them. */
static remap_status file_segments(builder *b)
{
  const rm_lid nt = b->l->mesh[0]->num_triangles;
  rm_arena    *lines = b->home->lines[0];
  rm_lid      *offset, num = 0;
  rm_segment  *list, s;

  if (b->o->end_offset[nt] / 2 > INT32_MAX) return REMAP_TOO_LARGE;
  RM_NEW0(offset, lines, (int64_t)nt + 1);
  for (rm_lid t = 0; t < nt; t++)
    for (int64_t k = b->o->end_offset[t]; k < b->o->end_offset[t + 1]; k += 2) num += limit_segment(b, t, k, &s);
  RM_NEW(list, lines, num);
  num = 0;
  for (rm_lid t = 0; t < nt; t++) {
    for (int64_t k = b->o->end_offset[t]; k < b->o->end_offset[t + 1]; k += 2)
      if (limit_segment(b, t, k, &s)) list[num++] = s;
    offset[b->l->first_copy[0][t] + 1] = num;
  }
  for (rm_lid t = 0; t < nt; t++) /* copies have none */
    if (b->l->first_copy[0][t] != t) offset[t + 1] = offset[t];
  b->l->segment_offset = offset;
  b->l->segment        = list;
  return REMAP_OK;
}

/* ---- lines ------------------------------------------------------------------------------------------------------- */

typedef struct line {
  rm_lid *spot, *state;
  int64_t num, room[2];
} line;

static remap_status line_room(line *l)
{
  RM_TRY(rm_grow(&l->spot, &l->room[0], l->num + 1, sizeof *l->spot));
  return rm_grow(&l->state, &l->room[1], l->num + 1, sizeof *l->state);
}

/* Is spot k of a line, which is not an end of edge e, inside the edge? Where cells of the other mesh overlap it may be an end
 * once more. */
static bool spot_is_inside(const builder *b, int side, rm_lid e, const line *l, int64_t k)
{
  const rm_feature f = b->l->spot[l->spot[k]].at[side];

  return f.kind == RM_ON_EDGE && f.id == e;
}

/* Put a spot inside edge e, which has no crossing, to its place. */
static remap_status insert_spot(const builder *b, int side, rm_lid e, line *l, rm_lid p)
{
  const rm_trimesh *m  = b->l->mesh[side];
  const double     *p0 = m->vertex[m->edge[e][0]], *p1 = m->vertex[m->edge[e][1]];
  double            mine[3][3], its[3][3];
  int64_t           low = 1, high = l->num - 1; /* it lies before one of low..high */

  for (int64_t k = 0; k < l->num; k++)
    if (l->spot[k] == p) return REMAP_OK;
  rm_spot_plane(b->l, &b->l->spot[p], side, mine);
  while (low < high) {
    const int64_t middle = (low + high) / 2;
    if (!spot_is_inside(b, side, e, l, middle)) return rm_cells_tangled(b->part, m, side, m->ring[m->ring_offset[e]] / 4, b->reason);
    rm_spot_plane(b->l, &b->l->spot[l->spot[middle]], side, its);
    if (rm_crossing_order(p0, p1, (const double (*)[3])mine, (const double (*)[3])its, 1) < 0) high = middle;
    else low = middle + 1;
  }
  RM_TRY(line_room(l));
  for (int64_t k = l->num; k > low; k--) l->spot[k] = l->spot[k - 1], l->state[k] = l->state[k - 1];
  l->spot[low]  = p;
  l->state[low] = l->state[low - 1];
  l->num++;
  return REMAP_OK;
}

static remap_status one_line(const builder *b, int side, rm_lid e, line *l)
{
  const rm_trimesh *m     = b->l->mesh[side];
  const rm_trace   *trace = &b->o->trace[side];

  l->num = 0;
  RM_TRY(line_room(l));
  l->spot[l->num]    = b->l->vertex_spot[side][m->edge[e][0]];
  l->state[l->num++] = trace->state[e];
  for (int64_t x = trace->first[e]; x < trace->first[e] + trace->count[e]; x++) {
    const rm_lid p = b->crossing_spot[side][x];
    if (p != l->spot[l->num - 1]) {
      RM_TRY(line_room(l));
      l->spot[l->num++] = p;
    }
    l->state[l->num - 1] = trace->crossing[x].state;
  }
  if (l->spot[l->num - 1] != b->l->vertex_spot[side][m->edge[e][1]]) {
    RM_TRY(line_room(l));
    l->spot[l->num]    = b->l->vertex_spot[side][m->edge[e][1]];
    l->state[l->num++] = RM_UNKNOWN;
  }
  if (!b->edge_present[side][e]) return REMAP_OK;
  for (rm_lid k = b->on_edge_offset[side][e]; k < b->on_edge_offset[side][e + 1]; k++)
    RM_TRY(insert_spot(b, side, e, l, b->l->vertex_spot[1 - side][b->on_edge[side][k]]));
  for (rm_lid k = b->contact_first[side][e]; k < b->contact_first[side][e + 1]; k++)
    RM_TRY(insert_spot(b, side, e, l, b->contact[b->contact_of[side][k]].spot));
  return REMAP_OK;
}

/* All spots inside edges; those at their ends are known. */
static remap_status fill_lines(const builder *b, int side, line *l, rm_lid *offset, rm_lid *start, rm_lid *spot, rm_lid *state)
{
  const rm_lid n = b->l->mesh[side]->num_edges;

  offset[0] = 0;
  for (rm_lid e = 0; e < n; e++) {
    RM_TRY(one_line(b, side, e, l));
    const rm_lid inside = (rm_lid)l->num - 2;
    start[e] = l->state[0];
    memcpy(spot + offset[e], l->spot + 1, sizeof *spot * (size_t)inside);
    memcpy(state + offset[e], l->state + 1, sizeof *state * (size_t)inside);
    offset[e + 1] = offset[e] + inside;
  }
  return REMAP_OK;
}

static remap_status lines(builder *b, int side)
{
  const rm_lid n    = b->l->mesh[side]->num_edges;
  rm_arena    *home = b->home->lines[side];
  const int64_t most = b->o->trace[side].num_crossings + b->on_edge_offset[side][n] + b->num_contacts;
  line         l     = {0};
  rm_lid      *offset, *start, *spot, *state;
  remap_status status;

  if (most > INT32_MAX) return REMAP_TOO_LARGE;
  RM_NEW(offset, home, (int64_t)n + 1);
  RM_NEW(start, home, n);
  RM_NEW(spot, home, most);
  RM_NEW(state, home, most);
  status = fill_lines(b, side, &l, offset, start, spot, state);
  free(l.spot);
  free(l.state);
  b->l->lines[side].offset = offset;
  b->l->lines[side].start  = start;
  b->l->lines[side].spot   = spot;
  b->l->lines[side].state  = state;
  return status;
}

/* ------------------------------------------------------------------------------------------------------------------ */

static remap_status build(builder *b)
{
  for (int side = 0; side < 2; side++) RM_TRY(join_copies(b, side));
  for (int side = 0; side < 2; side++) RM_TRY(place_vertices(b, side));
  RM_TRY(cross_edges(b));
  rm_arena_drop(b->home->passing->walks);
  b->home->passing->walks = NULL;
  RM_TRY(vertex_spots(b));
  for (int side = 0; side < 2; side++) RM_TRY(crossing_spots(b, side));
  RM_TRY(keep_spots(b));
  RM_TRY(file_segments(b));
  for (int side = 0; side < 2; side++) RM_TRY(file_vertices(b, side));
  for (int side = 0; side < 2; side++) RM_TRY(lines(b, side));
  return REMAP_OK;
}

remap_status rm_limit_build(const rm_limit_home *home, const rm_part *part, const rm_overlay *o, const rm_limit **out,
                            rm_reason *reason)
{
  builder      b = {.home = home, .arena = home->rest, .scratch = rm_arena_new(), .part = part, .o = o, .reason = reason};
  remap_status status = b.scratch ? REMAP_OK : REMAP_NO_MEMORY;

  b.l = rm_arena_zero(home->rest, 1, sizeof *b.l);
  if (!b.l) status = REMAP_NO_MEMORY;
  if (status == REMAP_OK) {
    for (int side = 0; side < 2; side++) b.l->mesh[side] = o->mesh[side];
    status = build(&b);
  }
  free(b.contact);
  free(b.spot);
  rm_arena_drop(b.scratch);
  if (status == REMAP_OK) {
    rm_arena_drop(home->passing->overlay);
    home->passing->overlay = NULL;
  }
  if (status == REMAP_OK) status = rm_spot_coordinates(home, b.l);
  if (status == REMAP_OK) *out = b.l;
  return status;
}
