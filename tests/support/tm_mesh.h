/* tm_mesh -- a mesh that owns its arrays: memory, numbers by lot, maps of its nodes. See meshes.h. */
#ifndef TM_MESH_H
#define TM_MESH_H

#include <remap/remap.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

/* A mesh that owns its arrays; view points to them. Everything in view may be changed or replaced by the caller. */
typedef struct tm_mesh {
  remap_mesh   view;
  double      *xyz;         /* [num_nodes][3]              */
  int64_t     *face_offset; /* [num_faces + 1]             */
  int64_t     *face_node;   /* [face_offset[num_faces]]    */
  int64_t     *owner;       /* [num_faces]                 */
  int64_t     *neighbour;   /* [num_faces], -1 for none    */
  int64_t     *global;      /* [num_cells]                 */
  int64_t     *zone_offset; /* [num_zones + 1] or NULL     */
  const char **zone_name;   /* [num_zones] literals, or NULL */
} tm_mesh;

/* Moves one point. */
typedef void (*tm_map)(double xyz[3], const void *data);

static inline void *tm_alloc_(int64_t count, size_t size)
{
  void *memory = calloc((size_t)count + 1, size);

  if (!memory) {
    fprintf(stderr, "meshes.h: memory is out\n");
    abort();
  }
  return memory;
}

static inline void tm_free(tm_mesh *mesh)
{
  if (!mesh) return;
  free(mesh->xyz);
  free(mesh->face_offset);
  free(mesh->face_node);
  free(mesh->owner);
  free(mesh->neighbour);
  free(mesh->global);
  free(mesh->zone_offset);
  free((void *)mesh->zone_name);
  free(mesh);
}

/* Let the view point to the arrays. */
static inline void tm_view_(tm_mesh *mesh)
{
  mesh->view.node_xyz         = mesh->xyz;
  mesh->view.face_offset      = mesh->face_offset;
  mesh->view.face_node        = mesh->face_node;
  mesh->view.face_owner       = mesh->owner;
  mesh->view.face_neighbour   = mesh->neighbour;
  mesh->view.cell_global      = mesh->global;
  mesh->view.zone_name        = mesh->zone_name;
  mesh->view.zone_cell_offset = mesh->zone_offset;
}

/* A mesh with room for the given counts. */
static inline tm_mesh *tm_new_(int64_t num_nodes, int64_t num_faces, int64_t num_corners, int64_t num_cells)
{
  tm_mesh *mesh = tm_alloc_(1, sizeof *mesh);

  mesh->view.num_nodes = num_nodes;
  mesh->view.num_faces = num_faces;
  mesh->view.num_cells = num_cells;
  mesh->xyz            = tm_alloc_(3 * num_nodes, sizeof(double));
  mesh->face_offset    = tm_alloc_(num_faces + 1, sizeof(int64_t));
  mesh->face_node      = tm_alloc_(num_corners, sizeof(int64_t));
  mesh->owner          = tm_alloc_(num_faces, sizeof(int64_t));
  mesh->neighbour      = tm_alloc_(num_faces, sizeof(int64_t));
  mesh->global         = tm_alloc_(num_cells, sizeof(int64_t));
  tm_view_(mesh);
  return mesh;
}

static inline uint64_t tm_mix_(uint64_t x)
{
  x += UINT64_C(0x9e3779b97f4a7c15);
  x = (x ^ x >> 32) * UINT64_C(0xd6e8feb86659fd93);
  x = (x ^ x >> 29) * UINT64_C(0xd6e8feb86659fd93);
  return x ^ x >> 32;
}

/* The next of a sequence of random numbers, below end. */
static inline int64_t tm_random(uint64_t *state, int64_t end) { return (int64_t)(tm_mix_((*state)++) % (uint64_t)end); }

/* ---- maps -------------------------------------------------------------------------------------------------------- */

/* The warp of q = size sin(2 pi x + phase) sin(2 pi y + phase) sin(2 pi z + phase): (x, y, z) += (q, 0.7 q, -0.9 q). */
typedef struct tm_warping {
  double size, phase;
} tm_warping;
static inline void tm_warp(double xyz[3], const void *data)
{
  const tm_warping *warp = data;
  const double      w    = 2 * M_PI;
  const double q = warp->size * sin(w * xyz[0] + warp->phase) * sin(w * xyz[1] + warp->phase) * sin(w * xyz[2] + warp->phase);

  xyz[0] += q;
  xyz[1] += .7 * q;
  xyz[2] += -.9 * q;
}

/* A 3 x 4 matrix by rows: linear part, then translation. data is double[12]. */
static inline void tm_affine(double xyz[3], const void *data)
{
  const double *m = data, x = xyz[0], y = xyz[1], z = xyz[2];

  for (int r = 0; r < 3; r++) xyz[r] = m[4 * r] * x + m[4 * r + 1] * y + m[4 * r + 2] * z + m[4 * r + 3];
}

/* The lattice's n[0] x n[1] x n[2] boxes as cubes of edge 366 about the origin; `turned`: by the rotation of the quaternion
 * (13, 2, 1, 3), which is rational with denominator 183, and moved a little. All coordinates are exact, so that faces are
 * exactly planar; turned cubes are in general position to those that are not. */
typedef struct tm_cubing {
  int  n[3];
  bool turned;
} tm_cubing;
static inline void tm_cube(double xyz[3], const void *data)
{
  static const double turn[3][3] = {{163, -74, 38}, {82, 157, -46}, {-14, 58, 173}};
  static const double move[3]    = {37 + 311 / 1024., 101 + 717 / 1024., -59 - 103 / 1024.};
  const tm_cubing    *cubes      = data;
  double              at[3];

  for (int d = 0; d < 3; d++) at[d] = rint(2 * xyz[d] * cubes->n[d]) - cubes->n[d]; /* halves, too, come to lie exactly */
  for (int d = 0; d < 3; d++)
    xyz[d] = cubes->turned ? turn[d][0] * at[0] + turn[d][1] * at[1] + turn[d][2] * at[2] + move[d] : 183 * at[d];
}

/* Rotation by an angle about z, then by the same angle about x. */
static inline void tm_rotate_(double xyz[3], double angle)
{
  const double c = cos(angle), s = sin(angle), x = c * xyz[0] - s * xyz[1], y = s * xyz[0] + c * xyz[1], z = xyz[2];

  xyz[0] = x;
  xyz[1] = c * y - s * z;
  xyz[2] = s * y + c * z;
}

/* Move all nodes of a mesh. */
static inline void tm_move(tm_mesh *mesh, tm_map map, const void *data)
{
  for (int64_t v = 0; map && v < mesh->view.num_nodes; v++) map(mesh->xyz + 3 * v, data);
}
#endif
