/* cells -- the supermesh itself: the overlay in; explicit minimal polyhedra (maPH cells) out, with their ancestors (DESIGN 2.8).
 *
 * Where the overlay thinks mesh 2 moved by an infinitesimal, the supermesh is taken in the limit: its vertices, edges and polygons
 * are the meetings of a vertex, edge, triangle of one mesh with those or a cell of the other, at their exact places. So no piece
 * of zero volume, area or length exists, coincident faces of the two meshes are one face, and the result is conformal: a face has
 * one or two cells, every edge of a cell lies in two of its faces (four where a cell touches itself along it), every cell is
 * closed. Whether two features meet, and in which order, is decided exactly; coordinates are rounded last. */
#ifndef RM_CELLS_H
#define RM_CELLS_H

#include "overlay/overlay.h"

/* What of the supermesh to keep, by ancestors; bits add up. */
enum {
  RM_CELLS_IN_BOTH       = 1, /* intersection                                                      */
  RM_CELLS_IN_SOURCE     = 2, /* source less target                                                */
  RM_CELLS_IN_TARGET     = 4, /* target less source                                                */
  RM_CELLS_WHOLE_SOURCE  = 3, /* the source with the target's faces in it: difference + intersection */
  RM_CELLS_UNION         = 7
};

/* Read-only once built. Invariants:
 *   every vertex is used; loops have at least three vertices, none twice, and do not cross themselves;
 *   a loop's normal points out of face_cell[f][0], which is a cell always;
 *   cells are closed and their exact volumes positive (what rounding leaves of a sliver may not be);
 *   cells, faces and vertices are in an order that depends on coordinates alone. */
typedef struct rm_cells {
  rm_lid         num_vertices, num_faces, num_cells;
  const double (*vertex)[3];        /* [num_vertices] mesh room's frame                                                       */
  const int64_t *face_offset;       /* [num_faces + 1]                                                                        */
  const rm_lid  *face_vertex;       /* [face_offset[num_faces]] loops                                                         */
  const rm_lid (*face_cell)[2];     /* [num_faces] owner, neighbour or RM_OUTSIDE                                             */
  const rm_lid (*face_triangle)[2]; /* [num_faces] triangle of mesh 1 and of mesh 2 it lies in, -1 (of several: the first)    */
  const rm_lid (*cell_ancestor)[2]; /* [num_cells] cells of part->piece[0] and [1], RM_OUTSIDE                                */
  const double  *cell_volume;       /* [num_cells] of the exact cell, not of its rounded vertices                             */
} rm_cells;

/* Build the cells whose ancestors `keep` names (RM_CELLS_ bits). Pieces of one original face between the same two cells become one
 * polygon where they are coplanar and have one loop around them. A face with holes is cut into triangles. Not collective. Lives in
 * arena. BAD_MESH with the reason if cells of one mesh overlap or cross each other, or if a triangle of a face has no area: a
 * supermesh needs meshes without. O(n log n) in crossings, n^2 in the vertices of a face with holes. */
remap_status rm_cells_build(rm_arena *arena, const rm_part *part, const rm_overlay *overlay, int keep, const rm_cells **out,
                            rm_reason *reason);

/* Every invariant above but the last; slow. Not collective. INTERNAL if one is broken. */
remap_status rm_cells_check(const rm_cells *cells);

#endif
