/* cells_private -- what the files of the room hand to each other, in the order of the work:
 *
 *   flat.c      meshes without flat triangles
 *   limit.c     contacts of the two meshes, found exactly; the vertices of the supermesh; the vertices along every edge
 *   spots.c     exact signs of vertices that are no nodes of the meshes
 *   polygons.c  the planar graph in every triangle and its polygons
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

/* The limit of the overlay. Triangles of a mesh that lie on each other count as the first of them, with the sides that are left
 * when cells on both sides of the stack cancel. A triangle whose sides all cancel is absent. */
typedef struct rm_limit {
  const rm_overlay *o;
  const rm_lid     *first_copy[2];   /* [side][num_triangles]                                                  */
  const rm_lid    (*cell[2])[2];     /* [side][num_triangles] net left and right cell; equal where it is absent */
  rm_lid            num_spots;
  const rm_spot    *spot;            /* [num_spots] those of mesh 1's vertices, of mesh 2's, of crossings      */
  const double    (*xyz)[3];         /* [num_spots] rounded                                                    */
  const float     (*low)[3];         /* [num_spots] what rounding took from xyz: volumes far from the origin need it */
  const float      *error;           /* [num_spots] bound of the error of each coordinate                      */
  const rm_lid     *vertex_spot[2];  /* [side][num_vertices]                                                   */
  const rm_lid     *crossing_spot[2]; /* [side][crossings of its edges]                                        */
  const int64_t    *line_offset[2];  /* [side][num_edges + 1]                                                  */
  const rm_lid     *line_spot[2];    /* spots along an edge from its first vertex to its second                */
  const rm_lid     *line_state[2];   /* [same] state in the other mesh behind the spot, where it is in a cell  */
  const int64_t    *inner_offset[2]; /* [side][num_triangles + 1]                                              */
  const rm_lid     *inner_spot[2];   /* vertices of the other mesh inside the triangle                         */
} rm_limit;

/* Lives in arena, but for what only polygons are made from, which lives in passing: crossing_spot, lines, inner. BAD_MESH
 * with the reason where cells overlap. */
remap_status rm_limit_build(rm_arena *arena, rm_arena *passing, const rm_part *part, const rm_overlay *o, const rm_limit **out,
                            rm_reason *reason);

static inline bool rm_is_present(const rm_limit *l, int side, rm_lid t)
{
  return l->first_copy[side][t] == t && l->cell[side][t][0] != l->cell[side][t][1];
}

/* True if the spot lies on the closed edge, on the closed triangle, of mesh `side`. */
static inline bool rm_on_edge(const rm_limit *l, int side, rm_lid p, rm_lid e)
{
  const rm_feature f    = l->spot[p].at[side];
  const rm_lid    *edge = l->o->mesh[side]->edge[e];
  return f.kind == RM_ON_EDGE ? f.id == e : f.kind == RM_ON_VERTEX && (f.id == edge[0] || f.id == edge[1]);
}
static inline bool rm_in_triangle(const rm_limit *l, int side, rm_feature f, rm_lid t)
{
  const rm_trimesh *m = l->o->mesh[side];
  const rm_lid     *x = f.kind == RM_ON_VERTEX ? m->triangle[t] : m->triangle_edge[t];

  if (f.kind == RM_ON_NOTHING) return false;
  if (f.kind == RM_ON_TRIANGLE) return f.id == t;
  return x[0] == f.id || x[1] == f.id || x[2] == f.id;
}

/* ---- exact signs ------------------------------------------------------------------------------------------------- */

/* A point off the plane of a, b, c, on the side that its normal points to; false if they are on one line. */
bool rm_off_plane(const double a[3], const double b[3], const double c[3], double o[3]);

/* The spot as the meeting of a line and a plane: ends of the line, three points of the plane; false if it is a vertex, then
 * line[0] is that. */
bool rm_spot_meeting(const rm_overlay *o, const rm_spot *spot, double line[2][3], double plane[3][3]);

/* For a spot inside an edge of mesh `side`: three points of a plane, not along that edge, in which the other mesh has the
 * spot. */
void rm_spot_plane(const rm_overlay *o, const rm_spot *spot, int side, double plane[3][3]);

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

/* ---- polygons ---------------------------------------------------------------------------------------------------- */

typedef struct rm_label {
  rm_lid cell[2]; /* [side] RM_OUTSIDE */
} rm_label;

/* A polygon of the supermesh: its loop is counter-clockwise about the normal of its own triangle. */
typedef struct rm_polygon {
  int64_t first; /* vertex */
  rm_lid  own;   /* 2 * triangle + its mesh; mesh 1 if it lies on triangles of both */
  rm_lid  other; /* cell of the other mesh it lies in, RM_OUTSIDE, or -2 - (2 * triangle + (1 if that faces the other way)) */
} rm_polygon;

/* malloc'ed; the owner frees both arrays. */
typedef struct rm_polygons {
  rm_polygon *polygon; /* [num + 1] the last one has `first` only, unless there are none */
  rm_lid     *vertex;  /* [num_vertices] spots */
  int64_t     num, num_vertices, room, vertex_room;
} rm_polygons;

static inline rm_lid rm_polygon_size(const rm_polygon *g) { return (rm_lid)(g[1].first - g[0].first); }

/* The triangle of mesh `side` it lies on, -1. */
static inline rm_lid rm_polygon_triangle(const rm_polygon *g, int side)
{
  return (g->own & 1) == side ? g->own / 2 : g->other < RM_OUTSIDE ? (-2 - g->other) / 2 : -1;
}

/* Cells left (h = 0) or right (1) of it. */
static inline rm_label rm_polygon_label(const rm_limit *l, const rm_polygon *g, int h)
{
  const int side = g->own & 1, code = -2 - g->other;
  rm_label  label;

  label.cell[side]     = l->cell[side][g->own / 2][h];
  label.cell[1 - side] = g->other < RM_OUTSIDE ? l->cell[1 - side][code / 2][h ^ (code & 1)] : g->other;
  return label;
}

/* Every polygon of the supermesh. BAD_MESH if the meshes are not embedded. */
remap_status rm_polygons_build(const rm_part *part, const rm_limit *l, rm_polygons *out, rm_reason *reason);

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
/* Cut a loop, which runs counter-clockwise, into convex ones; what out held is forgotten. NO_MEMORY. */
remap_status rm_cut_convex(const rm_view *view, rm_lid n, const rm_lid *loop, rm_parts *out);

/* ---- edges of polygons ------------------------------------------------------------------------------------------- */

/* One polygon's edge. */
typedef struct rm_arc {
  rm_lid high;    /* its higher vertex                                        */
  rm_lid place;   /* of its first vertex in the loop                          */
  rm_lid polygon; /* 2 * polygon + (1 if that runs from the higher vertex on) */
} rm_arc;

/* The edges of all polygons, by their lower vertex. */
typedef struct rm_arcs {
  rm_lid             num_vertices;
  const rm_polygons *p;
  const int64_t     *offset;  /* [num_vertices + 1]                                               */
  const rm_lid      *polygon; /* ascending at each vertex: those with an edge to a higher one     */
  rm_arc            *arc;     /* those of one vertex: what rm_arcs_at found last                  */
} rm_arcs;

/* Lives in arena. Vertices of the polygons are below num_vertices. TOO_LARGE from 2^30 polygons on. O(n). */
remap_status rm_arcs_build(rm_arena *arena, rm_lid num_vertices, const rm_polygons *p, rm_arcs *out);
/* How many edges have this lower vertex; they are in arcs->arc then, by their higher vertex, then by polygon. O(n log n). */
rm_lid rm_arcs_at(const rm_arcs *arcs, rm_lid low);

/* ---- cells ------------------------------------------------------------------------------------------------------- */

/* cell[2 k] and cell[2 k + 1] are the cells left and right of polygon k, RM_OUTSIDE; label and volume of each cell. */
typedef struct rm_glued {
  rm_lid          num_cells;
  const rm_lid   *cell;
  const rm_label *label;
  const double   *volume;
} rm_glued;
/* Glue polygons to cells around their edges. All lives in arena. BAD_MESH if the polygons around an edge bound no cells. */
remap_status rm_glue(rm_arena *arena, const rm_limit *l, const rm_polygons *p, const rm_arcs *arcs, rm_glued *out);

/* Which polygons make one face. Its loop is counter-clockwise about the normal out of the lower cell, RM_OUTSIDE being the
 * highest. */
typedef struct rm_faces {
  int64_t        num;    /* groups                                                      */
  const int64_t *offset; /* [num + 1]                                                   */
  const rm_lid  *member; /* polygons, ascending; groups ascend by their first one       */
  const uint8_t *inner;  /* [num_vertices of p] the edge from this place on is no side  */
  rm_lid        *next;   /* scratch of rm_face_loop, [num_spots]                        */
} rm_faces;

/* Group pieces of one face between the same two cells: coplanar ones; if warped, all whose loop is one of a polygon that
 * some plane shows without folds, and is not that of another group all around. Lives in arena; passing is for what is not
 * kept. */
remap_status rm_faces_build(rm_arena *arena, rm_arena *passing, const rm_limit *l, const rm_polygons *p, const rm_arcs *arcs,
                            const rm_glued *glued, bool warped, rm_faces *out);
/* The loop of group k, room for all its members' vertices; 0 if the group has not exactly one loop that meets itself
 * nowhere: its members then are faces as they are. */
rm_lid rm_face_loop(const rm_faces *faces, const rm_polygons *p, const rm_glued *glued, int64_t k, rm_lid *loop);
/* True if polygon k has to be turned so that its normal points out of the lower cell. */
static inline bool rm_is_turned(const rm_glued *glued, int64_t k)
{
  return (uint32_t)glued->cell[2 * k] > (uint32_t)glued->cell[2 * k + 1];
}

#endif
