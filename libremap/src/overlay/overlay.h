/* overlay -- a rank's pieces of both meshes in; crossings and segments out (DESIGN 2.1-2.3).
 *
 *   trimesh   a piece of one mesh, triangulated, in canonical order: ids ascend with coordinates, so that whatever is summed
 *             in the order of ids is summed in an order that no partition and no numbering can change
 *   facet     what bounds cells: a triangle, or all triangles of a planar convex face, which stays whole; it is called by one
 *             of its triangles
 *   trace     the crossings of every edge of one mesh with the facets of the other, by walking from cell to cell, and the
 *             state (the cells it lies in) of every piece between them; edges inside a facet are none
 *   overlay   both traces, and the segments in which facets of the two meshes meet
 *
 * Both checks of DESIGN 2.3 are always on: every segment has one start and one end, and every edge arrives at each of its ends
 * with the state that all other edges bring there. INCONSISTENT with the cell's id if one ever fails. */
#ifndef RM_OVERLAY_H
#define RM_OVERLAY_H

#include "part/part.h"

enum {
  RM_OUTSIDE = -1 /* the state of a point in no cell; a missing side of a triangle */
};

/* How an edge may be walked through a cell (DESIGN 2.3). */
enum {
  RM_WALK_ALONE    = 0, /* from triangle to triangle: no other cell is near that is no neighbour                            */
  RM_WALK_TOGETHER = 1, /* likewise, but skin that belongs to no neighbour may enter it: the edge may be in other cells too */
  RM_WALK_NOT      = 2  /* not star-shaped, or of many triangles, or beside such a cell: crossings come from the box tree   */
};

enum {
  RM_MAX_SIDES = 32 /* a face with more is never one facet */
};

/* Read-only once built. Invariants:
 *   vertices are distinct and ascend in (Morton key, x, y, z); triangles have ascending corners and ascend lexicographically
 *   except that copies of one triangle that do not join stand side by side (two of two cells, on opposite sides, do join, but
 *   those of a facet only together and with those of one other facet); edges ascend lexicographically;
 *   the normal of a triangle, (v1 - v0) x (v2 - v0), points from its left cell to its right one, and cells are closed;
 *   edge h of a triangle joins corners (0,1), (1,2), (0,2): its boundary runs along the first two and against the third;
 *   the triangles of a facet lie in one plane exactly, fill a convex polygon and have the same cells beside them; it is called
 *   by its largest one, and is a single triangle where its face lies in the skin of the whole mesh: another zone may have
 *   other faces there, and which triangles are a facet must not depend on what else this rank holds. */
typedef struct rm_trimesh {
  rm_lid         num_vertices, num_triangles, num_edges, num_cells, num_skin;
  const double (*vertex)[3];            /* [num_vertices]                                                        */
  const rm_lid (*triangle)[3];          /* [num_triangles] vertices                                              */
  const rm_lid (*triangle_edge)[3];     /* [num_triangles]                                                       */
  const rm_lid (*side)[2];              /* [num_triangles] left and right cell, RM_OUTSIDE where there is none   */
  const uint8_t *triangle_is_skin;      /* [num_triangles] 1: skin of the whole mesh, not only of this piece     */
  const rm_lid (*triangle_face)[2];     /* [num_triangles] faces of the piece that gave it to the cells left and right of it, -1
                                           where there is none; two where cells of two ranks or zones join      */
  const double (*normal)[3];            /* [num_triangles] rounded; magnitude is twice the area                  */
  const rm_lid (*edge)[2];              /* [num_edges] vertices, ascending                                       */
  const rm_lid  *star_offset;           /* [num_edges + 1]                                                       */
  const rm_lid  *star;                  /* [3 num_triangles] 4 * triangle + h of every triangle at the edge      */
  const rm_lid  *facet;                 /* [num_triangles] 2 * (triangle its facet is called by) + (1 if their normals are
                                           opposite); NULL if every facet is a triangle, as are the next three   */
  const rm_lid  *facet_next;            /* [num_triangles] the next triangle of the same facet, in a circle       */
  const uint8_t *triangle_inner;        /* [num_triangles] bit h: edge h is inside its facet                      */
  const uint8_t (*panel_corner)[4];     /* [panel_offset[num_cells]] places in the cell's vertices, in the order of the
                                           boundary about the normal; of a triangle, the last one twice          */
  const rm_lid  *panel_offset;          /* [num_cells + 1] panels of a cell: its facets of two triangles, and the triangles of
                                           the others; cell_triangle_offset where every facet is a triangle      */
  const rm_lid  *panel;                 /* 2 * triangle + (1 if the cell is its right one); cell_triangle likewise */
  const rm_lid  *ring_offset;           /* [num_edges + 1]                                                       */
  const rm_lid  *ring;                  /* 4 * facet of every facet that the edge bounds, + 2 if its boundary runs against the
                                           edge, bit 0 means nothing; star where every facet is a triangle       */
  const rm_lid  *vertex_edge_offset;    /* [num_vertices + 1]                                                    */
  const rm_lid  *vertex_edge;           /* [2 num_edges] edges at a vertex, ascending                            */
  const rm_lid  *cell_triangle_offset;  /* [num_cells + 1]                                                       */
  const rm_lid  *cell_triangle;         /* 2 * triangle + (1 if the cell is its right one), ascending            */
  const rm_lid  *cell_vertex_offset;    /* [num_cells + 1] a cell of many triangles has none of what follows     */
  const rm_lid  *cell_vertex;           /* vertices of the cell                                                  */
  const uint8_t (*cell_triangle_vertex)[3]; /* [cell_triangle_offset[num_cells]] corners, as places in the cell's vertices */
  const double (*cell_box)[6];          /* [num_cells] min x, y, z, max x, y, z                                  */
  const uint8_t *cell_walk;             /* [num_cells] RM_WALK_                                                   */
  double         box[6];                /* of all vertices; min > max if there are none                          */
  const rm_lid  *skin;                  /* [num_skin] triangles with one side only, ascending                    */
  const double (*skin_box)[6];          /* [num_skin]                                                            */
  const rm_boxtree *skin_tree;          /* over skin_box                                                         */
  rm_lid         num_odd;               /* cells that are not star-shaped, or of many triangles among others     */
  const double (*odd_box)[6];           /* [num_odd] outside of the skin, too, edges meet them by the box tree    */
  const rm_boxtree *odd_tree;           /* over odd_box; NULL if there are none                                  */
} rm_trimesh;

/* 2 * (triangle that the facet of t is called by) + (1 if their normals are opposite). */
static inline rm_lid rm_facet_of(const rm_trimesh *mesh, rm_lid t) { return mesh->facet ? mesh->facet[t] : 2 * t; }

/* The next triangle of the facet of t, in a circle. */
static inline rm_lid rm_facet_next(const rm_trimesh *mesh, rm_lid t) { return mesh->facet ? mesh->facet_next[t] : t; }

/* True if edge h of triangle t is inside its facet. */
static inline bool rm_is_inner(const rm_trimesh *mesh, rm_lid t, int h)
{
  return mesh->facet && mesh->triangle_inner[t] >> h & 1;
}

/* True if no facet ends at the edge: it is not traced. */
static inline bool rm_is_inside_facets(const rm_trimesh *mesh, rm_lid e)
{
  return mesh->ring_offset[e] == mesh->ring_offset[e + 1];
}

/* Where a triangulation lives, by how long it is needed; two of them, or all, may be one arena. */
typedef struct rm_trimesh_home {
  rm_arena *mesh;   /* vertices, triangles, their cells and faces, edges               */
  rm_arena *around; /* edges of triangles, triangles at edges, edges at vertices       */
  rm_arena *walks;  /* normals, facets, cells, boxes, skin: what edges are traced with */
} rm_trimesh_home;

/* Triangulate a piece. Not collective. O(n). TOO_LARGE beyond 2^29 triangles. */
remap_status rm_trimesh_build_in(const rm_trimesh_home *home, const rm_frame *frame, const rm_piece *piece, remap_faces faces,
                                 const rm_trimesh **out);
/* The same, all in one arena. */
remap_status rm_trimesh_build(rm_arena *arena, const rm_frame *frame, const rm_piece *piece, remap_faces faces,
                              const rm_trimesh **out);
/* The same mesh with every triangle a facet of its own; it shares the arrays of mesh. Not collective. NO_MEMORY. */
remap_status rm_trimesh_of_triangles(rm_arena *arena, const rm_trimesh *mesh, const rm_trimesh **out);
/* Every invariant above; slow. Not collective. frame is the one the mesh was built with. INTERNAL if one is broken. */
remap_status rm_trimesh_check(const rm_frame *frame, const rm_trimesh *mesh);

/* A crossing of an edge with a facet of the other mesh. */
typedef struct rm_crossing {
  double lambda;   /* where on the edge, 0..1 from its first vertex; a function of the coordinates alone */
  rm_lid triangle; /* 2 * triangle that the facet is called by + (1 if the edge runs against its normal) */
  rm_lid state;    /* behind the crossing, seen along the edge                                           */
  rm_lid edge;     /* whose crossing it is                                                               */
} rm_crossing;

/* A cell and how often it winds about a point. */
typedef struct rm_winding {
  rm_lid  cell;
  int32_t number; /* not 0 */
} rm_winding;

/* How the edges of one mesh run through the other. A state >= 0 is the one cell, with number 1; RM_OUTSIDE none; below that,
 * the list num = -2 - state of `winding`. Read-only once built. Invariants: crossings of an edge stand in their exact order. */
typedef struct rm_trace {
  int64_t            num_crossings;
  const rm_crossing *crossing;      /* [num_crossings] edge after edge                                   */
  const int64_t     *first;         /* [num_edges] an edge's first crossing                              */
  const rm_lid      *count;         /* [num_edges] number of its crossings; 0 of an edge inside facets   */
  const rm_lid      *state;         /* [num_edges] before the first crossing                             */
  const rm_lid      *list_offset;   /* [num_lists + 1]                                                   */
  const rm_winding  *winding;       /* [list_offset[num_lists]] ascending by cell within a list          */
  rm_lid             num_lists;
} rm_trace;

/* One end of a segment. Ends of one segment stand side by side, its start (directed along n_t x n_b) first. */
typedef struct rm_end {
  rm_lid   other; /* facet of mesh 2                                                                */
  uint32_t at;    /* 4 * crossing + 2 * (1 if of an edge of mesh 2) + (1 if the segment's last end)    */
} rm_end;

/* Read-only once built. */
typedef struct rm_overlay {
  const rm_trimesh *mesh[2];
  rm_trace          trace[2];       /* [0] edges of mesh 1 through mesh 2, [1] the reverse                  */
  const int64_t    *end_offset;     /* [triangles of mesh 1 + 1] none but for those that facets are called by */
  const rm_end     *end;            /* ascending by `other` within a facet: twice its number of segments      */
} rm_overlay;

/* Called now and then; not 0 cancels. */
typedef struct rm_progress {
  int (*call)(void *user, const char *phase, double done);
  void *user;
} rm_progress;

/* Trace both ways and pair the segments. Not collective. Lives in arena. O(n + crossings), expected. reason names a cell by the
 * global ids in piece. CANCELLED if progress (may be NULL) says so. */
remap_status rm_overlay_build(rm_arena *arena, const rm_trimesh *const mesh[2], const rm_part *part,
                              const rm_progress *progress, const rm_overlay **out, rm_reason *reason);

#endif
