/* cells_private -- what the files of the room hand to each other, in the order of the work:
 *
 *   flat.c      meshes without flat triangles
 *   limit.c     contacts of the two meshes, found exactly; the vertices of the supermesh; the vertices along every edge
 *   spots.c     exact signs of vertices that are no nodes of the meshes
 *   polygons.c  the planar graph in every triangle and its polygons
 *   islands.c   parts of such a graph that lie in others' polygons
 *   holes.c     polygons with holes, cut into triangles
 *   arcs.c      edges of polygons, sorted
 *   glue.c      cells: sides of polygons joined around edges
 *   faces.c     pieces of one face put together again
 *   convex.c    concave polygons cut into convex ones
 *   cells.c     the product; check.c its invariants */
#ifndef RM_CELLS_PRIVATE_H
#define RM_CELLS_PRIVATE_H

#include "cells/cells.h"

enum { RM_UNKNOWN = INT32_MAX }; /* no state yet */

/* What the polygons on one mesh are made from. */
typedef struct rm_lines {
  const rm_lid *offset;       /* [num_edges + 1]                                                                       */
  const rm_lid *spot, *state; /* spots inside an edge from its first vertex on; state in the other mesh behind each,
                                 where it is in a cell                                                                 */
  const rm_lid *start;        /* [num_edges] state behind the edge's first vertex                                      */
  const rm_lid *inner_offset; /* [num_triangles + 1]                                                                   */
  const rm_lid *inner_spot;   /* vertices of the other mesh inside the triangle                                        */
} rm_lines;

/* A segment as one triangle sees it: from p to q the other triangle's left cell is on the left. */
typedef struct rm_segment {
  rm_lid other, p, q;
} rm_segment;

/* The limit of the overlay. Triangles of a mesh that lie on each other count as the first of them, with the sides that are left
 * when cells on both sides of the stack cancel. A triangle whose sides all cancel is absent. */
typedef struct rm_limit {
  const rm_trimesh *mesh[2];
  const rm_lid     *first_copy[2];   /* [side][num_triangles]                                                   */
  const rm_lid    (*cell[2])[2];     /* [side][num_triangles] net left and right cell; equal where it is absent */
  rm_lid            num_spots;
  rm_spot          *spot;            /* [num_spots] those of mesh 1's vertices, of mesh 2's, of crossings      */
  double          (*xyz)[3];         /* [num_spots] rounded                                                    */
  const float      *error;           /* [num_spots] bound of the error of each coordinate                      */
  const rm_lid     *vertex_spot[2];  /* [side][num_vertices]                                                   */
  rm_lines          lines[2];        /* [side] until the polygons are made                                     */
  const rm_lid     *segment_offset;  /* [triangles of mesh 1 + 1] likewise                                     */
  const rm_segment *segment;         /* of triangles of mesh 1                                                 */
} rm_limit;

/* Where it lives: spot and xyz, which are the result's; what polygons of either mesh are made from, with the segments in the
 * first; all else. What passes is dropped as soon as it is used up. */
typedef struct rm_limit_home {
  rm_arena *spots, *lines[2], *rest;
  rm_cells_passing *passing;
} rm_limit_home;

/* BAD_MESH with the cell at triangle t of mesh `side` as the one where spots or pieces contradict each other, which overlapping
 * cells make. */
remap_status rm_cells_tangled(const rm_part *part, const rm_trimesh *mesh, int side, rm_lid t, rm_reason *reason);

/* Its meshes are those of the overlay, which it uses up. BAD_MESH with cell and reason where cells overlap. O(n) expected. */
remap_status rm_limit_build(const rm_limit_home *home, const rm_part *part, const rm_overlay *o, const rm_limit **out,
                            rm_reason *reason);

static inline bool rm_is_present(const rm_limit *l, int side, rm_lid t)
{
  return l->first_copy[side][t] == t && l->cell[side][t][0] != l->cell[side][t][1];
}

/* True if the spot lies on the closed edge, on the closed triangle, of mesh `side`. */
static inline bool rm_on_edge(const rm_limit *l, int side, rm_lid p, rm_lid e)
{
  const rm_feature f    = l->spot[p].at[side];
  const rm_lid    *edge = l->mesh[side]->edge[e];
  return f.kind == RM_ON_EDGE ? f.id == e : f.kind == RM_ON_VERTEX && (f.id == edge[0] || f.id == edge[1]);
}
static inline bool rm_in_triangle(const rm_limit *l, int side, rm_feature f, rm_lid t)
{
  const rm_trimesh *m = l->mesh[side];
  const rm_lid     *x = f.kind == RM_ON_VERTEX ? m->triangle[t] : m->triangle_edge[t];

  if (f.kind == RM_ON_NOTHING) return false;
  if (f.kind == RM_ON_TRIANGLE) return f.id == t;
  return x[0] == f.id || x[1] == f.id || x[2] == f.id;
}

/* ---- exact signs ------------------------------------------------------------------------------------------------- */

/* The spot as the meeting of a line and a plane: ends of the line, three points of the plane; false if it is a vertex, then
 * line[0] is that. */
bool rm_spot_meeting(const rm_limit *l, const rm_spot *spot, double line[2][3], double plane[3][3]);

/* For a spot inside an edge of mesh `side`: three points of a plane, not along that edge, in which the other mesh has the
 * spot. */
void rm_spot_plane(const rm_limit *l, const rm_spot *spot, int side, double plane[3][3]);

/* xyz and error of all spots. NO_MEMORY. */
remap_status rm_spot_coordinates(const rm_limit_home *home, rm_limit *l);
/* What rounding took from xyz, (*out)[num_spots], in arena: volumes far from the origin need it. It is computed once more
 * rather than kept, for it is 12 bytes a spot. NO_MEMORY. */
remap_status rm_spot_low(rm_arena *arena, const rm_limit *l, float (**out)[3]);

/* Signs within one triangle's plane, seen from its normal's tip: projected along axis. */
typedef struct rm_view {
  const rm_limit *l;
  int             x, y; /* axes */
  int             flip; /* +1, -1 */
} rm_view;
/* The view of a triangle, which has area, of mesh `side`. */
rm_view rm_view_of(const rm_limit *l, int side, rm_lid t);
/* +1 if p, q, r turn counter-clockwise, -1 clockwise, 0 if they are on a line. Exact. */
int rm_turn(const rm_view *v, rm_lid p, rm_lid q, rm_lid r);
/* Sign of p's coordinate less q's on an axis. Exact. */
int rm_compare(const rm_limit *l, rm_lid p, rm_lid q, int axis);

/* ---- where arcs lie in the other mesh ---------------------------------------------------------------------------- */

/* True if both spots lie on one edge of triangle t of mesh `side`. */
bool rm_both_on_edge(const rm_limit *l, int side, rm_lid t, rm_lid p, rm_lid q);
/* A present triangle of mesh `side` on which both spots lie, and an edge of it on which they do, -1; false if there is none. */
bool rm_carrier(const rm_limit *l, int side, rm_lid p, rm_lid q, rm_lid *triangle, rm_lid *edge);
/* What lies left of the arc from p to q in triangle t of mesh `side`, which runs along edge f of the other mesh: the triangle
 * on which the polygon there lies, or -1 and the cell. False if there is nothing around f. */
bool rm_place_left(const rm_limit *l, int side, rm_lid t, rm_lid p, rm_lid q, rm_lid f, rm_lid *triangle, rm_lid *cell);

/* ---- polygons ---------------------------------------------------------------------------------------------------- */

typedef struct rm_label {
  rm_lid cell[2]; /* [side] RM_OUTSIDE */
} rm_label;

/* Polygons of the supermesh. malloc'ed, each array by itself; the owner frees them. Loops are counter-clockwise about the
 * normal of their own triangle. */
typedef struct rm_polygons {
  uint32_t *first;  /* [num + 1] vertex                                                                                      */
  rm_lid   *own;    /* [num] 2 * triangle + its mesh; mesh 1 if it lies on triangles of both                                 */
  rm_lid   *other;  /* [num] cell of the other mesh it lies in, RM_OUTSIDE, or -2 - (2 * triangle + (1 if that faces the other
                       way))                                                                                                */
  rm_lid   *vertex; /* [num_vertices] spots                                                                                  */
  int64_t   num, num_vertices, first_room, own_room, other_room, vertex_room;
} rm_polygons;

/* Free the arrays. */
void rm_polygons_free(rm_polygons *p);
/* Give back what the arrays have grown too far. */
void rm_polygons_trim(rm_polygons *p);

static inline rm_lid rm_polygon_size(const rm_polygons *p, int64_t k) { return (rm_lid)(p->first[k + 1] - p->first[k]); }
static inline const rm_lid *rm_polygon_loop(const rm_polygons *p, int64_t k) { return p->vertex + p->first[k]; }

/* The triangle of mesh `side` that polygon k lies on, -1. */
static inline rm_lid rm_polygon_triangle(const rm_polygons *p, int64_t k, int side)
{
  return (p->own[k] & 1) == side ? p->own[k] / 2 : p->other[k] < RM_OUTSIDE ? (-2 - p->other[k]) / 2 : -1;
}

/* Cells left (h = 0) or right (1) of polygon k. */
static inline rm_label rm_polygon_label(const rm_limit *l, const rm_polygons *p, int64_t k, int h)
{
  const rm_lid own = p->own[k], other = p->other[k], code = -2 - other;
  const int    side = own & 1;
  rm_label     label;

  label.cell[side]     = l->cell[side][own / 2][h];
  label.cell[1 - side] = other < RM_OUTSIDE ? l->cell[1 - side][code / 2][h ^ (code & 1)] : other;
  return label;
}

/* Every polygon of the supermesh. lines are the arenas of l->lines: dropped, and NULL then, one after the other. BAD_MESH with
 * cell and reason if the meshes are not embedded, TOO_LARGE from 2^30 polygons on. O(a log a) for the arcs of a triangle. */
remap_status rm_polygons_build(const rm_part *part, const rm_limit *l, rm_arena *lines[2], rm_polygons *out, rm_reason *reason);

/* An arc of the graph in a triangle, seen from one end; arc k has halves 2 k and 2 k + 1. */
typedef struct rm_half {
  rm_lid from;  /* node                                         */
  rm_lid state; /* of the other mesh on its left, RM_UNKNOWN    */
  rm_lid next;  /* of the walk that has its polygon on the left */
  rm_lid cycle; /* which that walk is                           */
} rm_half;
typedef struct rm_cycle {
  rm_lid half, num, state, inside; /* inside: the cycle whose hole it is, -1              */
  rm_lid first_hole, next_hole;    /* the holes in it; the next one in the same cycle; -1 */
  bool   simple;                   /* it has no vertex twice                              */
} rm_cycle;
/* Node 0 is one of the boundary's. */
typedef struct rm_graph {
  rm_view   view;
  rm_lid    num_nodes, num_halves, num_cycles;
  rm_lid   *spot;      /* [num_nodes]                */
  rm_half  *half;      /* [num_halves]               */
  rm_cycle *cycle;     /* [num_cycles]               */
  rm_lid   *component; /* [num_nodes] working memory */
} rm_graph;
static inline rm_lid rm_end_of(const rm_graph *g, rm_lid h) { return g->half[h ^ 1].from; }
/* Which cycles are holes of which: `inside` and the lists of holes; a hole's state becomes that of the cycle it is in, where
 * that has none. BAD_MESH if edges cross, NO_MEMORY. */
remap_status rm_find_holes(rm_graph *g);

/* A line that sweeps over a plane graph, see sweep.c. */
typedef struct rm_sweep {
  const rm_view *view;
  const rm_lid (*end)[2]; /* of edges: left spot, right spot                        */
  rm_lid        *list;    /* [num] edges that the line meets, from below; the caller's room */
  rm_lid         num;
} rm_sweep;
/* -1, 0, +1 as the line is at spot p before q, is at both, at p after q. Exact. */
int rm_sweep_compare(const rm_view *view, rm_lid p, rm_lid q);
/* list[n] in scratch: the numbers of n spots from left to right; equal ones stay as they are. NO_MEMORY. */
remap_status rm_sweep_order(rm_arena *scratch, const rm_view *view, rm_lid n, const rm_lid *spot, rm_lid **list);
/* The highest edge below a spot that the line is at, -1. */
rm_lid rm_sweep_below(const rm_sweep *s, rm_lid p);
/* The line, at the left end of an edge, begins to meet it. */
void rm_sweep_insert(rm_sweep *s, rm_lid edge);
/* The line, at the right end of an edge, leaves it; false if it is not there: edges cross. */
bool rm_sweep_remove(rm_sweep *s, rm_lid edge);
/* below[k]: the highest edge below spot query[k], -1, among edges of a plane graph. BAD_MESH if they cross, NO_MEMORY. */
remap_status rm_edges_below(rm_arena *scratch, const rm_view *view, rm_lid num_edges, const rm_lid (*edge)[2], rm_lid num,
                            const rm_lid *query, rm_lid *below);

/* The region inside loop[0] and outside the others, as triangles: corner gets three spots each, *num their number. Loops are
 * offset[num_loops + 1] into spot; the first runs counter-clockwise, the others clockwise. NO_MEMORY, BAD_MESH. */
remap_status rm_cut_holes(rm_arena *scratch, const rm_view *view, int num_loops, const int64_t *offset, const rm_lid *spot,
                          rm_lid **corner, int64_t *num);

/* Loops, one after the other; malloc'ed, the owner frees both. */
typedef struct rm_parts {
  rm_lid *vertex, *end; /* [num_vertices] spots; [num] where each ends */
  int64_t num_vertices, num, vertex_room, end_room;
} rm_parts;

/* True if the loop, which runs counter-clockwise in the view, turns right nowhere. Exact. */
bool rm_is_convex(const rm_view *view, const rm_lid *loop, rm_lid n);
/* Polygons that make one together. */
typedef struct rm_pieces {
  const rm_polygons *p;
  const rm_lid      *polygon; /* [num] */
  rm_lid             num;
} rm_pieces;
/* Cut a loop, which runs counter-clockwise, around the pieces into convex ones; what out held is forgotten. NO_MEMORY. */
remap_status rm_cut_convex(const rm_view *view, rm_lid n, const rm_lid *loop, const rm_pieces *of, rm_parts *out);

/* ---- edges of polygons ------------------------------------------------------------------------------------------- */

/* One polygon's edge. */
typedef struct rm_arc {
  rm_lid high;    /* its higher vertex                                        */
  rm_lid place;   /* of its first vertex in the loop                          */
  rm_lid polygon; /* 2 * polygon + (1 if that runs from the higher vertex on) */
} rm_arc;

/* The n polygons at one edge, from a lower vertex on, ascending. */
typedef remap_status rm_arc_visitor(void *user, rm_lid low, const rm_arc *arc, rm_lid n);
/* Visit all edges of the polygons, whose vertices are below num_vertices, in order, until a visit fails. O(n) expected. */
remap_status rm_each_edge(rm_lid num_vertices, const rm_polygons *p, rm_arc_visitor *visit, void *user);

/* ---- cells ------------------------------------------------------------------------------------------------------- */

/* Pieces of one face between the same two cells that meet in an edge which no other polygon has. */
typedef struct rm_joint {
  rm_lid   polygon[2];
  uint32_t corner[2]; /* where the edge begins in the loop of each, among all vertices */
  bool     coplanar;
} rm_joint;

/* cell[2 k] and cell[2 k + 1] are the cells left and right of polygon k, RM_OUTSIDE; label and volume of each cell. */
typedef struct rm_glued {
  rm_lid          num_cells;
  const rm_lid   *cell;
  const rm_label *label;
  const double   *volume;
  rm_joint       *joint; /* malloc'ed, the owner frees it */
  int64_t         num_joints, joint_room;
} rm_glued;
/* Glue polygons to cells around their edges. Lives in arena. Pieces that are not coplanar are joints only if they are wanted.
 * BAD_MESH with cell and reason if the polygons around an edge do not bound cells. O(n log n). */
remap_status rm_glue(rm_arena *arena, const rm_part *part, const rm_limit *l, const rm_polygons *p, bool warped, rm_glued *out,
                     rm_reason *reason);
/* True if polygon k has to be turned so that its normal points out of the lower cell. */
static inline bool rm_is_turned(const rm_glued *glued, int64_t k)
{
  return (uint32_t)glued->cell[2 * k] > (uint32_t)glued->cell[2 * k + 1];
}

/* ---- faces ------------------------------------------------------------------------------------------------------- */

/* What a polygon is to the faces: none, or part of another one's; one as it is; what `made` has instead. */
typedef enum rm_face_kind { RM_FACE_NONE, RM_FACE_ITSELF, RM_FACE_MADE } rm_face_kind;

/* Faces in the order of polygons. A face that is not one of them as it is has a loop in `made`, counter-clockwise about the
 * normal of that polygon's triangle. */
typedef struct rm_faces {
  uint8_t *kind;       /* [num polygons] rm_face_kind; not owned      */
  rm_lid  *made_of;    /* [made.num] polygon, ascending; malloc'ed    */
  int64_t  made_room;
  rm_parts made;
} rm_faces;

/* Pieces put together, coplanar ones; if `warped`, all whose loop is one of a polygon that some plane shows without folds,
 * and is not that of another group all around. If split_concave, concave faces are cut into convex ones. out->kind is given:
 * NONE for polygons of no interest, ITSELF for others. The owner frees what is added to out. O(n) expected. */
remap_status rm_faces_build(const rm_limit *l, const rm_polygons *p, const rm_glued *glued, bool warped, bool split_concave,
                            rm_faces *out);

#endif
