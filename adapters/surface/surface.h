/** @file
 * surface.h -- closed surfaces in STL and OBJ files: reading, repair, writing.
 *
 *   rsurf_read      a file's faces as they stand, nodes joined by equal coordinates
 *   rsurf_repair    faces of one orientation, shells outward, or the reason why that cannot be
 *   rsurf_begin     a surface from polygons: rsurf_add, rsurf_end
 *   rsurf_triangulate   polygons into triangles
 *   rsurf_print_head ...   lines of an STL (text) or OBJ file
 *   rsurf_drop      give everything back
 *
 * Conventions that hold for every function below:
 *   - none is collective: one rank reads and repairs, because a closed surface is a mesh of one cell;
 *   - `message`, never NULL, holds one line without a newline after a failure; it names the file and what to do;
 *   - outputs are written only when RSURF_OK is returned;
 *   - no function prints, exits or keeps state.
 *
 * Cost: reading is linear in the file; repair is O(n log n) in the faces, with exact signs and no tolerance. */
#ifndef REMAP_ADAPTERS_SURFACE_H
#define REMAP_ADAPTERS_SURFACE_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <remap/remap.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Every status: name, number, text. */
#define RSURF_STATUS_LIST(X)                                               \
  X(OK, 0, "success")                                                      \
  X(IO, 2, "a file cannot be read or written, or is not valid STL or OBJ") \
  X(GEOMETRY, 3, "the surface is open, not manifold, or crosses itself")   \
  X(MEMORY, 4, "memory could not be allocated")

typedef enum rsurf_status {
#define X(name, number, text) RSURF_##name = number,
  RSURF_STATUS_LIST(X)
#undef X
} rsurf_status;

/** One line of text: why a call failed. */
typedef struct rsurf_message {
  char text[1024];
} rsurf_message;

/** A surface of polygons. Owned: rsurf_drop. All zero is an empty one. After rsurf_repair a face's normal points out of the
 *  body that it bounds. */
typedef struct rsurf_surface {
  int64_t  num_nodes, num_faces;
  int64_t  num_bodies;  /**< 0 before rsurf_repair */
  int32_t  num_groups;  /**< at least 1 if there are faces */
  double  *node_xyz;    /**< [num_nodes][3] finite, distinct */
  int64_t *face_offset; /**< [num_faces + 1] */
  int64_t *face_node;   /**< [face_offset[num_faces]] loops */
  int32_t *face_group;  /**< [num_faces] */
  int64_t *face_body;   /**< [num_faces] the body inside of the face; NULL before rsurf_repair */
  int64_t *face_none;   /**< [num_faces] -1: the neighbour that no face has; NULL before rsurf_repair */
  char   **group_name;  /**< [num_groups] of STL's solids, OBJ's groups and objects; else the file's name without its ending */
} rsurf_surface;

/** What rsurf_repair found and did. */
typedef struct rsurf_repairs {
  int64_t faces_dropped; /**< two corners in one place: they bound nothing */
  int64_t faces_cut;     /**< polygons that are not flat and convex: cut into triangles */
  int64_t faces_flipped; /**< corners on a line: the middle one split the longest side of the neighbour instead */
  int64_t faces_turned;  /**< turned round to agree with the faces beside them */
  int64_t shells;        /**< connected pieces of the surface */
  int64_t voids;         /**< shells inside of another one, whose inside is outside */
} rsurf_repairs;

/** A short text for a status; static text, never NULL. */
const char *rsurf_status_text(rsurf_status status);

/** Does the name end in .stl or .obj, in letters of any size? */
int rsurf_is_path(const char *path);

/** Read a file: STL, binary (whatever its header says) or text, if its name ends in .stl, else OBJ. Coordinates are multiplied
 *  by scale, which is 1 where single precision shall stay what it is. Binary STL of single precision is taken exactly.
 *  Errors: IO (missing, truncated, a count that does not fit the file, no faces, a coordinate that is no finite number, a
 *  corner that does not exist; the message says in which line or facet), MEMORY. */
rsurf_status rsurf_read(const char *path, double scale, rsurf_surface *out, rsurf_message *message);

/** Make of the faces the boundary of bodies, in place. Triangles whose corners are on a line are flipped; faces are turned to
 *  agree with their neighbours; each shell is turned by the exact sign of its volume and by how many shells it lies in:
 *  outward if that number is even, inward (a void) if it is odd. name is the file's, for messages. After a failure the surface
 *  can only be dropped. Errors: GEOMETRY (an edge with one face or with more than two, a face without area that cannot be
 *  flipped, a surface with one side only, a shell without volume, faces that cross or overlap; the message counts them and
 *  gives the coordinates of the first ones), MEMORY. */
rsurf_status rsurf_repair(rsurf_surface *surface, const char *name, rsurf_repairs *repairs, rsurf_message *message);

/** A repaired surface as remap_set_mesh wants it, a cell for each body: a view of the surface. */
remap_mesh rsurf_mesh(const rsurf_surface *surface, const char *name);

/** A surface that grows. Opaque. */
typedef struct rsurf_builder rsurf_builder;

/** Begin a surface with these groups, which are copied. The caller ends *out with rsurf_end. Errors: MEMORY. */
rsurf_status rsurf_begin(int32_t num_groups, const char *const *group_name, rsurf_builder **out, rsurf_message *message);
/** Add a polygon of n corners, xyz [n][3], to a group. Corners in one place become one node. Errors: IO (a coordinate that is
 *  no finite number), MEMORY. */
rsurf_status rsurf_add(rsurf_builder *builder, const double *xyz, int64_t n, int32_t group, rsurf_message *message);
/** End it: the faces become *out, and *builder NULL. Harmless on NULL: an empty surface. */
void rsurf_end(rsurf_builder **builder, rsurf_surface *out);

/** Cut every polygon into triangles on its own corners, none without area where that can be. Errors: MEMORY. */
rsurf_status rsurf_triangulate(rsurf_surface *surface, rsurf_message *message);

/** Is it the name of an STL file? */
int rsurf_is_stl(const char *path);

/** A file as text, all digits of every coordinate: groups, solids in STL, of faces; in OBJ all nodes come before them. What
 *  begins and ends a group; a facet of STL; a node, and a polygon of nodes counted from 0, of OBJ. Nothing is checked:
 *  ferror(out) tells. */
void rsurf_print_head(FILE *out, int is_stl, const char *group);
void rsurf_print_foot(FILE *out, int is_stl, const char *group);
void rsurf_print_facet(FILE *out, const double *const corner[3]);
void rsurf_print_node(FILE *out, const double xyz[3]);
void rsurf_print_polygon(FILE *out, int64_t n, const int64_t *node);

/** Give everything back; harmless on an empty surface. */
void rsurf_drop(rsurf_surface *surface);

#ifdef __cplusplus
}
#endif
#endif
