/* surface_private.h -- what the files of the adapter share.
 *
 *   common.c   status and message
 *   read.c     rsurf_read: which format, joining of nodes
 *   stl.c      STL, binary and text
 *   obj.c      OBJ
 *   repair.c   rsurf_repair: edges, orientation
 *   caps.c     triangles whose corners are on a line
 *   shells.c   shells: volume, nesting, bodies
 *   cross.c    faces that cross or overlap
 *   tree.c     boxes
 *   exact.c    exact signs
 *   write.c    rsurf_write */
#ifndef REMAP_ADAPTERS_SURFACE_PRIVATE_H
#define REMAP_ADAPTERS_SURFACE_PRIVATE_H

#include "base.h"
#include "surface.h"

#include <stdbool.h>

/* Hand a failure up; only where nothing is owned. */
#define RS_TRY(call)                         \
  do {                                       \
    const rsurf_status rs_try_ = (call);     \
    if (rs_try_ != RSURF_OK) return rs_try_; \
  } while (0)

/* Hand it up through the one cleanup label; assign is an assignment to the status. */
#define RS_GOTO(label, assign)            \
  do {                                    \
    if ((assign) != RSURF_OK) goto label; \
  } while (0)

/* ---- common.c ------------------------------------------------------------------------------------------------------ */

/* Format the message and return the status. */
rsurf_status rs_fail(rsurf_message *message, rsurf_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* MEMORY, with the words for it. */
rsurf_status rs_no_memory(rsurf_message *message);

/* ---- reading ------------------------------------------------------------------------------------------------------- */

/* A file in memory and the surface that grows from it. text ends with a NUL that is not counted. */
typedef struct rs_input {
  const char    *path;
  char          *text;
  size_t         size;
  double         scale;
  ra_map         nodes; /* by the bits of coordinates: rows of 3 doubles */
  ra_array       offset, loop, group, names;
  int32_t        current; /* group of the next face, -1: it has no name yet */
  rsurf_message *message;
} rs_input;

/* The node at a place, the one that is there already if its bits are alike. Where it was read is for messages: "line", 7.
 * IO (not finite), MEMORY. */
rsurf_status rs_node(rs_input *in, const double xyz[3], const char *unit, int64_t where, int64_t *node);
/* Add a face of the current group. MEMORY. */
rsurf_status rs_face(rs_input *in, const int64_t *node, int64_t n);
/* The group of the faces to come; a name without letters stands for the file's. MEMORY. */
rsurf_status rs_group(rs_input *in, const char *name, size_t length);
/* All facets of an STL file, binary or text. IO (with the line or the facet), MEMORY. */
rsurf_status rs_read_stl(rs_input *in);
/* All faces of an OBJ file. IO (with the line), MEMORY. */
rsurf_status rs_read_obj(rs_input *in);

/* ---- exact.c ------------------------------------------------------------------------------------------------------- */

/* Signs of determinants, exact while coordinates are 0 or between 2^-100 and 2^100. */

/* Of the turn a, b, c in the plane across axis (0: y and z, 1: z and x, 2: x and y): 1 to the left. */
int rs_turn(const double *a, const double *b, const double *c, int axis);
/* 1 if d lies below the plane of a, b, c: on the side from which they run clockwise. */
int rs_side(const double *a, const double *b, const double *c, const double *d);
/* Of the volume that triangles [num] bound; corner [num][3] are nodes. */
int rs_volume_sign(const double *xyz, const int64_t (*corner)[3], int64_t num);

/* ---- repair -------------------------------------------------------------------------------------------------------- */

/* The faces' triangles, for everything that needs them. */
typedef struct rs_triangles {
  int64_t num;
  int64_t (*corner)[3]; /* [num] nodes */
  int64_t *face;        /* [num] */
} rs_triangles;

/* Sides of faces, numbered as in face_node: side i runs from that corner to the next one of its loop. */
typedef struct rs_edges {
  ra_map   map;       /* its two nodes, the smaller one first */
  int64_t *of_side;   /* [sides] edge */
  int64_t (*side)[2]; /* [edges] the first two sides, -1: none */
  int64_t *count;     /* [edges] sides */
} rs_edges;

/* false: no memory; then too the edges must be dropped. */
bool rs_find_edges(const rsurf_surface *surface, rs_edges *e);
/* Give edges back. */
void rs_edges_drop(rs_edges *e);
/* Triangles whose corners are on a line lend their middle corner to the neighbour, where that can be. */
rsurf_status rs_flip_caps(rsurf_surface *surface, const double *xyz, rsurf_repairs *repairs, rsurf_message *message);

/* Flat convex polygons as fans. The caller frees corner and face. false: no memory. */
bool rs_fan(const rsurf_surface *surface, rs_triangles *out);
/* Let a face run the other way round. */
void rs_turn_face(rsurf_surface *surface, int64_t face);
/* "(x y z)", cut to fit; its length. */
size_t rs_put_point(const double *x, char *out, size_t size);

/* Boxes {low, high} in a tree; box is borrowed. */
typedef struct rs_tree {
  int64_t num;
  const double (*box)[6]; /* [num] */
  int64_t *item;          /* [num] boxes; each half of the tree is half of this list */
  double (*part)[6];      /* [num] around [lo, hi) of the list, at its middle */
} rs_tree;

/* false: no memory; then too the tree must be dropped. */
bool rs_tree_build(int64_t num, const double (*box)[6], rs_tree *out);
/* Numbers of the boxes that meet a box, in hits, which is overwritten. false: no memory. */
bool rs_tree_find(const rs_tree *tree, const double box[6], ra_array *hits);
/* What hears of two boxes that meet; false: of no more. */
typedef bool (*rs_visit)(void *user, int64_t one, int64_t other);
/* Let visit hear of each pair of boxes that meet, once. */
void rs_tree_pairs(const rs_tree *tree, rs_visit visit, void *user);
/* Give a tree back; its boxes are the caller's. */
void rs_tree_drop(rs_tree *tree);

/* Shells into bodies: checks that triangles do not cross, turns faces and notes it in turned [faces]. shell [faces]; xyz
 * are unit coordinates, fit for exact.c. */
rsurf_status rs_make_bodies(rsurf_surface *surface, const double *xyz, const char *name, int64_t num_shells,
                            const int64_t *shell, int8_t *turned, const rs_triangles *triangles, rsurf_repairs *repairs,
                            rsurf_message *message);
/* GEOMETRY if two triangles meet elsewhere than in common corners and edges. */
rsurf_status rs_check_crossings(const rsurf_surface *surface, const double *xyz, const char *name, const rs_triangles *t,
                                const rs_tree *tree, rsurf_message *message);

#endif
