/* surfaces -- cells of very many triangles: closed surfaces as meshes of one cell, and cells round one edge. The caller's:
 * tm_free. */
#ifndef SURFACES_H
#define SURFACES_H

#include "meshes.h"

/* An octahedron of the given radius about a centre, its faces divided into n^2 triangles: 8 n^2, volume 4/3 radius^3. */
static inline tm_mesh *surfaces_octahedron(int n, double radius, const double centre[3])
{
  const int64_t side = 2 * n + 1;
  tm_builder_   b    = {.num_cells = 1};
  int64_t      *id;
  tm_mesh      *mesh;

  for (int octant = 0; octant < 8; octant++) {
    const int sx = octant & 1 ? -1 : 1, sy = octant & 2 ? -1 : 1, sz = octant & 4 ? -1 : 1;

    for (int i = 0; i < n; i++)
      for (int j = 0; i + j < n; j++)
        for (int up = 0; up < 2 && i + j + up < n; up++) { /* corners (i, j, n - i - j) on the octahedron, in units of 1 / n */
          const int p[3][2] = {{i + up, j + up}, {i + 1, j}, {i, j + 1}};
          int64_t   v[3];

          for (int h = 0; h < 3; h++)
            v[h] = ((int64_t)(n + sz * (n - p[h][0] - p[h][1])) * side + (n + sy * p[h][1])) * side + (n + sx * p[h][0]);
          if ((sx * sy * sz < 0) != (up == 1)) {
            const int64_t x = v[1];
            v[1]            = v[2];
            v[2]            = x;
          }
          tm_face_(&b, 0, 3, v);
        }
  }
  mesh = tm_finish_(&b, side * side * side, &id);
  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    const double p[3] = {(double)(id[v] % side - n), (double)(id[v] / side % side - n), (double)(id[v] / side / side - n)};
    for (int c = 0; c < 3; c++) mesh->xyz[3 * v + c] = centre[c] + radius / n * p[c];
  }
  free(id);
  return mesh;
}

/* The same blown up to a ball. */
static inline tm_mesh *surfaces_ball(int n, double radius, const double centre[3])
{
  tm_mesh *mesh = surfaces_octahedron(n, n, (double[]){0, 0, 0});

  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    double      *p      = mesh->xyz + 3 * v;
    const double length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);

    for (int c = 0; c < 3; c++) p[c] = centre[c] + radius * p[c] / length;
  }
  return mesh;
}

/* Two cones over one rim of n vertices about the x axis, tips at x = -1 and 1, radius 1: 2 n triangles, n round each tip. */
static inline tm_mesh *surfaces_double_cone(int64_t n)
{
  tm_builder_ b = {.num_cells = 1};
  int64_t    *id;
  tm_mesh    *mesh;

  for (int64_t k = 0; k < n; k++)
    for (int h = 0; h < 2; h++) tm_face_(&b, 0, 3, (int64_t[]){h ? (k + 1) % n : k, h ? k : (k + 1) % n, n + h});
  mesh = tm_finish_(&b, n + 2, &id);
  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    const double angle = 2 * M_PI * (double)id[v] / (double)n;

    mesh->xyz[3 * v]     = id[v] < n ? 0 : id[v] == n ? 1 : -1;
    mesh->xyz[3 * v + 1] = id[v] < n ? cos(angle) : 0;
    mesh->xyz[3 * v + 2] = id[v] < n ? sin(angle) : 0;
  }
  free(id);
  return mesh;
}

/* A block of one cell over the unit square, below (or above) a bumpy surface of 2 n^2 triangles near z = 0: two such blocks
 * touch in all of it. */
static inline tm_mesh *surfaces_block(int n, bool above)
{
  const int64_t side = n + 1, far = side * side; /* nodes j * side + i, then the four corners of the flat face */
  tm_builder_   b    = {.num_cells = 1};
  int64_t      *loop = tm_alloc_(side + 2, sizeof *loop), *id, flat[4];
  tm_mesh      *mesh;

  for (int64_t j = 0; j < n; j++)
    for (int64_t i = 0; i < n; i++) {
      const int64_t p = j * side + i, q[2][3] = {{p, p + 1, p + side + 1}, {p, p + side + 1, p + side}};
      for (int h = 0; h < 2; h++) tm_face_(&b, 0, 3, (int64_t[]){q[h][0], q[h][above ? 2 : 1], q[h][above ? 1 : 2]});
    }
  for (int k = 0; k < 4; k++) flat[k] = far + (above ? k : 3 - k);
  tm_face_(&b, 0, 4, flat);
  for (int wall = 0; wall < 4; wall++) { /* from corner `wall` to the next, counterclockwise seen from above */
    static const int at[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const int       *p = at[wall], *q = at[(wall + 1) % 4];

    for (int64_t k = 0; k < side; k++) {
      const int64_t i = p[0] * (n - k) + q[0] * k, j = p[1] * (n - k) + q[1] * k;
      loop[above ? k : n - k] = j * side + i;
    }
    loop[side]     = far + (above ? (wall + 1) % 4 : wall);
    loop[side + 1] = far + (above ? wall : (wall + 1) % 4);
    tm_face_(&b, 0, (int)side + 2, loop);
  }
  mesh = tm_finish_(&b, far + 4, &id);
  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    double       *p = mesh->xyz + 3 * v;
    const int64_t k = id[v] - far;

    p[0] = k < 0 ? (double)(id[v] % side) / n : k == 1 || k == 2;
    p[1] = k < 0 ? (double)(id[v] / side) / n : k >= 2;
    p[2] = k >= 0                                             ? (above ? 1 : -1)
           : p[0] == 0 || p[1] == 0 || p[0] == 1 || p[1] == 1 ? 0
                                                              : .1 * sin(9 * p[0] + 1) * cos(7 * p[1]);
  }
  free(loop);
  free(id);
  return mesh;
}

/* n wedges round the edge from (-1, 0, 0) to (1, 0, 0), of radius 1: a mesh of n prisms that all share that edge. */
static inline tm_mesh *surfaces_wedges(int64_t n)
{
  tm_builder_ b = {.num_cells = n};
  int64_t    *id;
  tm_mesh    *mesh;

  for (int64_t k = 0; k < n; k++) { /* node 2 k + h: rim k at end h; the axis is rim n */
    const int64_t p[2] = {2 * k, 2 * k + 1}, q[2] = {2 * ((k + 1) % n), 2 * ((k + 1) % n) + 1}, o[2] = {2 * n, 2 * n + 1};

    tm_face_(&b, k, 3, (int64_t[]){o[0], q[0], p[0]});
    tm_face_(&b, k, 3, (int64_t[]){o[1], p[1], q[1]});
    tm_face_(&b, k, 4, (int64_t[]){p[0], q[0], q[1], p[1]});
    tm_face_(&b, k, 4, (int64_t[]){o[0], p[0], p[1], o[1]});
    tm_face_(&b, k, 4, (int64_t[]){o[0], o[1], q[1], q[0]});
  }
  mesh = tm_finish_(&b, 2 * n + 2, &id);
  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    const double angle = 2 * M_PI * (double)(id[v] / 2) / (double)n;

    mesh->xyz[3 * v]     = id[v] % 2 ? 1 : -1;
    mesh->xyz[3 * v + 1] = id[v] / 2 < n ? cos(angle) : 0;
    mesh->xyz[3 * v + 2] = id[v] / 2 < n ? sin(angle) : 0;
  }
  free(id);
  return mesh;
}

#endif
