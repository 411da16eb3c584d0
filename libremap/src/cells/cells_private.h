/* cells_private -- what the files of the room hand to each other, in the order of the work:
 *
 *   limit.c     contacts of the two meshes, found exactly; the vertices of the supermesh; the vertices along every edge
 *   spots.c     exact signs of vertices that are no nodes of the meshes
 *   polygons.c  the planar graph in every triangle and its polygons
 *   holes.c     polygons with holes, cut into triangles
 *   glue.c      cells: sides of polygons joined around edges
 *   merge.c     pieces of one planar face put together again
 *   cells.c     the product; check.c its invariants */
#ifndef RM_CELLS_PRIVATE_H
#define RM_CELLS_PRIVATE_H

#include "cells/cells.h"

enum { RM_UNKNOWN = INT32_MAX }; /* no state yet */

/* Where in a mesh a point lies: on a vertex, inside an edge or triangle, or anywhere else. */
typedef enum rm_kind { RM_ON_VERTEX, RM_ON_EDGE, RM_ON_TRIANGLE, RM_ON_NOTHING } rm_kind;
typedef struct rm_feature {
  rm_kind kind;
  rm_lid  id;
} rm_feature;

/* A vertex of the supermesh: a vertex of one mesh, or an edge of one with an edge or a triangle of the other. */
typedef struct rm_spot {
  rm_feature at[2]; /* [side] */
} rm_spot;

/* The limit of the overlay. Triangles of a mesh that lie on each other count as the first of them, with the sides that are left
 * when cells on both sides of the stack cancel. A triangle without area, or whose sides all cancel, is absent. */
typedef struct rm_limit {
  const rm_overlay *o;
  const rm_lid     *first_copy[2];   /* [side][num_triangles]                                                  */
  const rm_lid    (*cell[2])[2];     /* [side][num_triangles] net left and right cell; equal where it is absent */
  rm_lid            num_spots;
  const rm_spot    *spot;            /* [num_spots] those of mesh 1's vertices, of mesh 2's, of crossings      */
  const double    (*xyz)[3];         /* [num_spots] rounded                                                    */
  const double     *error;           /* [num_spots] bound of the error of each coordinate                      */
  const rm_lid     *vertex_spot[2];  /* [side][num_vertices]                                                   */
  const rm_lid     *crossing_spot[2]; /* [side][crossings of its edges]                                        */
  const int64_t    *line_offset[2];  /* [side][num_edges + 1]                                                  */
  const rm_lid     *line_spot[2];    /* spots along an edge from its first vertex to its second                */
  const rm_lid     *line_state[2];   /* [same] state in the other mesh behind the spot, where it is in a cell  */
  const int64_t    *inner_offset[2]; /* [side][num_triangles + 1]                                              */
  const rm_lid     *inner_spot[2];   /* vertices of the other mesh inside the triangle                         */
} rm_limit;

/* Lives in arena. BAD_MESH with the reason where cells overlap. */
remap_status rm_limit_build(rm_arena *arena, const rm_part *part, const rm_overlay *o, const rm_limit **out, rm_reason *reason);

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

/* ---- exact signs -------------------------------------------------------------------------------------------------- */

/* A point off the plane of a, b, c, on the side that its normal points to; false if they are on one line. */
bool rm_off_plane(const double a[3], const double b[3], const double c[3], double o[3]);

/* The spot as the meeting of a line and a plane: ends of the line, three points of the plane; false if it is a vertex, then
 * line[0] is that. */
bool rm_spot_meeting(const rm_overlay *o, const rm_spot *spot, double line[2][3], double plane[3][3]);

/* A plane through a vertex of the other mesh that lies on edge e. */
void rm_vertex_plane(const rm_trimesh *own, rm_lid e, const double vertex[3], double plane[3][3]);

/* Signs within one triangle's plane, seen from its normal's tip: projected along axis. */
typedef struct rm_view {
  const rm_limit *l;
  int             x, y; /* axes */
  int             flip; /* +1, -1 */
} rm_view;
rm_view rm_view_of(const rm_limit *l, int side, rm_lid t);
/* +1 if p, q, r turn counter-clockwise, -1 clockwise, 0 if they are on a line. Exact. */
int rm_turn(const rm_view *v, rm_lid p, rm_lid q, rm_lid r);
/* Sign of p's coordinate less q's on an axis. Exact. */
int rm_compare(const rm_limit *l, rm_lid p, rm_lid q, int axis);

/* ---- polygons ------------------------------------------------------------------------------------------------------ */

typedef struct rm_label {
  rm_lid cell[2]; /* [side] RM_OUTSIDE */
} rm_label;

/* A polygon of the supermesh: loop counter-clockwise about the normal of its triangle of mesh 1, or else of mesh 2. */
typedef struct rm_polygon {
  int64_t  first;
  rm_lid   num;
  rm_lid   triangle[2]; /* [side] -1 */
  rm_label label[2];    /* left, right */
} rm_polygon;

/* malloc'ed; the owner frees both arrays. */
typedef struct rm_polygons {
  rm_polygon *polygon;
  rm_lid     *vertex;
  int64_t     num, num_vertices, room, vertex_room;
} rm_polygons;

/* Every polygon of the supermesh. BAD_MESH if the meshes are not embedded. */
remap_status rm_polygons_build(rm_arena *scratch, const rm_part *part, const rm_limit *l, rm_polygons *out, rm_reason *reason);

/* The region inside loop[0] and outside the others, as triangles: corner gets three spots each, *num their number. Loops are
 * offset[num_loops + 1] into spot; the first runs counter-clockwise, the others clockwise. NO_MEMORY, BAD_MESH. */
remap_status rm_cut_holes(rm_arena *scratch, const rm_view *view, int num_loops, const int64_t *offset, const rm_lid *spot,
                          rm_lid **corner, int64_t *num);

/* ---- cells ----------------------------------------------------------------------------------------------------------- */

/* cell[2 k] and cell[2 k + 1] are the cells left and right of polygon k, RM_OUTSIDE; label and volume of each cell. All live in
 * arena. */
typedef struct rm_glued {
  rm_lid          num_cells;
  const rm_lid   *cell;
  const rm_label *label;
  const double   *volume;
} rm_glued;
remap_status rm_glue(rm_arena *arena, const rm_limit *l, const rm_polygons *p, rm_glued *out);

/* Put coplanar pieces of one face between the same two cells together: p shrinks, glued->cell with it. */
remap_status rm_merge(rm_arena *arena, const rm_limit *l, rm_polygons *p, rm_glued *glued);

#endif
