/* cells -- the supermesh itself: the overlay in; explicit minimal polyhedra (maPH cells) out, with their ancestors (DESIGN
 * 2.8).
 *
 * Where the overlay thinks mesh 2 moved by an infinitesimal, the supermesh is taken in the limit: its vertices, edges and
 * polygons are the meetings of a vertex, edge, triangle of one mesh with those or a cell of the other, at their exact
 * places. So no piece of zero volume, area or length exists, coincident faces of the two meshes are one face, and the result
 * is conformal: a face has one or two cells, every edge of a cell lies in two of its faces (four where a cell touches itself
 * along it), every cell is closed. Whether two features meet, and in which order, is decided exactly; coordinates are
 * rounded last. */
#ifndef RM_CELLS_H
#define RM_CELLS_H

#include "overlay/overlay.h"

/* Which cells to keep, and how their faces are made. */
typedef struct rm_cells_choice {
  int            keep;          /* REMAP_IN_ bits                                                                         */
  int            owner;         /* side of the mesh whose cells decide about what lies in both                            */
  const uint8_t *core[2];       /* [side][cells of the piece] pieces of cells with bit 0 are kept; NULL: of all           */
  bool           aggregate;     /* warped pieces of one face too become one polygon, where cells stay closed              */
  bool           split_concave; /* concave polygons are cut into convex ones                                              */
} rm_cells_choice;

/* Where a point lies in one of the meshes: on a vertex, inside an edge or triangle, or anywhere else (id is 0 then). There are
 * less than 2^30 of each. */
typedef enum rm_kind { RM_ON_VERTEX, RM_ON_EDGE, RM_ON_TRIANGLE, RM_ON_NOTHING } rm_kind;
typedef struct rm_feature {
  uint32_t kind : 2; /* rm_kind */
  uint32_t id : 30;
} rm_feature;
static inline rm_feature rm_feature_of(rm_kind kind, rm_lid id)
{
  return (rm_feature){(uint32_t)kind & 3, (uint32_t)id & 0x3fffffff};
}

/* A vertex of the supermesh: a vertex of one mesh, or an edge of one with an edge or a triangle of the other. */
typedef struct rm_spot {
  rm_feature at[2]; /* [side] */
} rm_spot;

/* Read-only once built. Invariants:
 *   every vertex is used; loops have at least three vertices, none twice, and do not cross themselves;
 *   a loop's normal points out of face_cell[f][0], which is a cell always;
 *   cells are closed and their exact volumes positive (what rounding leaves of a sliver may not be);
 *   cells, faces and vertices are in an order that depends on coordinates alone.
 * Vertices, loops and cells of faces were adopted by the arena: rm_arena_release takes them over. */
typedef struct rm_cells {
  rm_lid          num_vertices, num_faces, num_cells, num_beyond, num_shared;
  const double  (*vertex)[3];        /* [num_vertices] mesh room's frame                                                     */
  const rm_spot  *vertex_spot;       /* [num_vertices] what it is                                                            */
  const uint32_t *face_offset;       /* [num_faces + 1]                                                                      */
  const rm_lid   *face_vertex;       /* [face_offset[num_faces]] loops                                                       */
  const rm_lid  (*face_cell)[2];     /* [num_faces] owner; neighbour, RM_OUTSIDE, or -2 - k where beyond[k] was not kept      */
  const rm_lid   *face_own;          /* [num_faces] 2 * triangle + its mesh where it lies in one; or -1 - k: in shared[k]    */
  const rm_lid  (*beyond)[2];        /* [num_beyond] ancestors of the cell behind a face which is not of the result          */
  const rm_lid  (*shared)[2];        /* [num_shared] triangle of mesh 1 and of mesh 2 that a face lies in                    */
  const rm_lid  (*cell_ancestor)[2]; /* [num_cells] cells of part->piece[0] and [1], RM_OUTSIDE                              */
  const double   *cell_volume;       /* [num_cells] of the exact cell, not of its rounded vertices                           */
  int64_t         num_polygons;      /* before pieces of a face were put together                                            */
  double          seconds_polygons, seconds_glue, seconds_faces;
} rm_cells;

/* The triangle of mesh `side` that face f lies in (of several: the first), -1. */
static inline rm_lid rm_cells_triangle(const rm_cells *cells, rm_lid f, int side)
{
  const rm_lid own = cells->face_own[f];
  return own < 0 ? cells->shared[-1 - own][side] : (own & 1) == side ? own / 2 : -1;
}

/* Ancestors of what is behind face f, if that is a cell which was not kept, else NULL. */
static inline const rm_lid *rm_cells_beyond(const rm_cells *cells, rm_lid f)
{
  return cells->face_cell[f][1] < RM_OUTSIDE ? cells->beyond[-2 - cells->face_cell[f][1]] : NULL;
}

/* A point off the plane of a, b, c, on the side that its normal points to; false if they are on one line. Exact. Not
 * collective. */
bool rm_off_plane(const double a[3], const double b[3], const double c[3], double o[3]);

/* False if the corners of triangle t are on a line. Exact. Not collective. */
bool rm_has_area(const rm_trimesh *m, rm_lid t);

/* The triangulation that cells are made of: every triangle a facet of its own, and none flat, with its corners on a line: these
 * are left out, and others are cut where such a one had a vertex on their edge, so that what is left is conformal and bounds
 * the same volumes. *out is mesh itself if it is like that; triangle_face stays that of mesh. Not collective. Lives in home, as
 * mesh does. NO_MEMORY, TOO_LARGE. */
remap_status rm_cells_mesh(const rm_trimesh_home *home, const rm_frame *frame, const rm_trimesh *mesh,
                           const rm_trimesh **out);

/* Arenas that are dropped, and NULL then, as soon as cells need no more of what they hold; NULL: the caller's. */
typedef struct rm_cells_passing {
  rm_arena *walks;   /* of both meshes, see rm_trimesh_home: until it is known where they touch */
  rm_arena *overlay; /* not with its meshes: until vertices are known                           */
  rm_arena *around;  /* of both meshes: until polygons are made                                 */
} rm_cells_passing;

/* Build the cells that choice names. Pieces of one original face between the same two cells become one polygon where they are
 * coplanar and have one loop around them. A face with holes is cut into triangles. Not collective. Lives in arena. BAD_MESH
 * with the cell and the reason if cells of one mesh overlap or cross each other; TOO_LARGE from 2^30 polygons on. The meshes
 * of the overlay are those of rm_cells_mesh. passing may be NULL. O(n log n). */
remap_status rm_cells_build(rm_arena *arena, const rm_part *part, const rm_overlay *overlay, rm_cells_passing *passing,
                            const rm_cells_choice *choice, const rm_cells **out, rm_reason *reason);

/* Every invariant above but the last; slow. Not collective. INTERNAL if one is broken. */
remap_status rm_cells_check(const rm_cells *cells);

#endif
