/* mesh -- the caller's borrowed arrays in; a checked view in the library's own frame out. A bad mesh stops here.
 *
 * Frame: coordinates are multiplied by a power of two, the same for both meshes and on all ranks, so that the largest
 * magnitude lies in [1/2, 1); what then is below 2^-100 becomes 0, and -0 becomes +0. So every later product of coordinates is
 * free of overflow and underflow, and results do not depend on the unit. Everything downstream is in this frame. */
#ifndef RM_MESH_H
#define RM_MESH_H

#include "base/base.h"
#include "comm/comm.h"
#include "geom/geom.h"

typedef struct rm_frame {
  double scale;   /* own coordinate = caller's coordinate * scale, a power of two */
  double box[6];  /* of both meshes, all ranks, own frame: min x, y, z, max x, y, z; all 0 if there are no nodes */
} rm_frame;

/* Read-only once built. Invariants:
 *   nodes are distinct in coordinates, and every one is used by a face;
 *   no loop repeats a node next to itself; loops have at least 3 distinct nodes (faces that collapse to fewer are left out,
 *   but count for the boxes);
 *   a loop's normal points out of face_cell[f][0];
 *   every cell is closed: each of its edges is used as often one way as the other;
 *   faces of a cell are listed in ascending order. */
typedef struct rm_mesh {
  remap_side      side;
  rm_lid          num_nodes, num_faces, num_cells;
  const double  (*node_xyz)[3];     /* [num_nodes] own frame                                               */
  const int64_t  *face_offset;      /* [num_faces + 1]                                                     */
  const rm_lid   *face_node;        /* [face_offset[num_faces]]                                            */
  const rm_lid  (*face_cell)[2];    /* [num_faces] owner, neighbour or -1                                  */
  const uint8_t  *face_is_skin;     /* [num_faces] 1: no cell beside it on any rank or in any zone         */
  const rm_lid   *face_given;       /* [num_faces] the caller's number; NULL: all are as given             */
  const int64_t  *cell_face_offset; /* [num_cells + 1]                                                     */
  const rm_lid   *cell_face;        /* [cell_face_offset[num_cells]]                                       */
  const rm_gid   *cell_global;      /* [num_cells]                                                         */
  const double  (*cell_box)[6];     /* [num_cells] min x, y, z, max x, y, z of its nodes                   */
  const double   *cell_volume;      /* [num_cells] of the triangulated cell; signed; exact to 2^-50        */
  const double  (*cell_centroid)[3];/* [num_cells] the same; the box's centre where the volume is 0        */
  rm_gid          num_global_cells; /* over all ranks                                                      */
  rm_gid          num_inverted;     /* over all ranks: cells of negative volume                            */
  rm_gid          worst_inverted;   /* over all ranks: the one of most negative volume, -1 if there is none */
  double          volume;           /* over all ranks: exact sum of abs(cell_volume), rounded once         */
} rm_mesh;

/* The caller's number of a face. */
static inline rm_lid rm_given_face(const rm_mesh *mesh, rm_lid face)
{
  return mesh->face_given ? mesh->face_given[face] : face;
}

/* Agree on the frame of both meshes. Collective. BAD_MESH with the reason if a coordinate is not finite. mesh[] may lie about
 * counts: they are checked here before anything is read (NULL arrays, negative counts, offsets that do not ascend). */
remap_status rm_frame_build(const rm_comm *comm, const remap_mesh mesh[2], rm_frame *out, rm_reason *reason);

/* The same in two steps, for meshes of which one moves. First the extent of each: -min x, y, z, max x, y, z over all ranks in
 * the caller's unit, all -INFINITY without nodes. Collective. */
remap_status rm_frame_extent(const rm_comm *comm, remap_side side, const remap_mesh *given, double extent[6],
                             rm_reason *reason);
/* Then the frame of both extents. Not collective. */
void rm_frame_of(const double extent[2][6], rm_frame *out);

/* Check and convert one mesh. Collective. Volumes and centroids depend on coordinates alone, not on numbering. Only nodes that
 * faces use count. Faces meet across ranks and zones by the coordinates of their nodes (an exchange by hash); two faces join if
 * they run opposite ways: first within each zone, then what is left of all zones if it is two faces. More than two cells at one
 * face within one zone is BAD_MESH, not counting cells of no thickness, which lie at it from both sides; across zones all of
 * these faces stay skin. A face given with owner and neighbour stays as it is; two faces of one cell that lie on each other
 * stay two, and are no skin. Also BAD_MESH: index out of range, a face with fewer than 3 nodes as given or with one cell on
 * both sides, an open cell, a cell without faces as given, duplicate or negative global ids, ids given by some ranks only.
 * TOO_LARGE: a count beyond rm_lid. The reason names the cell, the face and the remedy. The product lives in arena. O(n) time,
 * about 60 bytes per face corner, 20 of which stay. */
remap_status rm_mesh_build(rm_arena *arena, const rm_comm *comm, remap_side side, const remap_mesh *given,
                           const rm_frame *frame, remap_faces faces, const rm_mesh **out, rm_reason *reason);

/* Second moments of every cell, integral of (x - c)(x - c)^T with c = cell_centroid: xx, yy, zz, xy, xz, yz. faces is what the
 * mesh was built with. They depend on coordinates alone, with errors below 2^-50 of the largest term. Not collective. *out,
 * [num_cells], lives in arena. NO_MEMORY. About 0.3 us per triangle. */
remap_status rm_mesh_second(rm_arena *arena, const rm_mesh *mesh, remap_faces faces, const double (**out)[6]);

/* Every invariant above; slow. Not collective. INTERNAL if one is broken. */
remap_status rm_mesh_check(const rm_mesh *mesh);

/* Morton key, 21 bits per axis, of a point in the frame's box. Not collective. */
uint64_t rm_morton(const rm_frame *frame, const double xyz[3]);

#endif
