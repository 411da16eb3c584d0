/* spaced -- grids of boxes at given coordinates along each axis, and maps of their nodes: for meshes that meet in degenerate
 * ways. Whole numbers keep all positions exact. */
#ifndef SPACED_H
#define SPACED_H

#include "meshes.h"

/* n boxes along an axis, between n + 1 coordinates. */
typedef struct sp_axis {
  int    n;
  double x[6];
} sp_axis;

/* The lattice [0, 1]^3 to the coordinates, then by another map. */
typedef struct sp_placing_ {
  const sp_axis *axis[3];
  tm_map         then;
} sp_placing_;
static inline void sp_place_(double xyz[3], const void *data)
{
  const sp_placing_ *p = data;

  for (int c = 0; c < 3; c++) xyz[c] = p->axis[c]->x[lrint(xyz[c] * p->axis[c]->n)];
  if (p->then) p->then(xyz, NULL);
}

/* Boxes along three axes; then: a map of the nodes, NULL for none. */
static inline tm_mesh *sp_boxes(const sp_axis *x, const sp_axis *y, const sp_axis *z, tm_map then)
{
  return tm_hexahedra((int[]){x->n, y->n, z->n}, sp_place_, &(sp_placing_){{x, y, z}, then});
}

/* Whole numbers that move every node by up to 6 in a way of its own. */
static inline void sp_warp(double xyz[3], const void *data)
{
  const long x = lrint(xyz[0]), y = lrint(xyz[1]), z = lrint(xyz[2]);

  (void)data;
  xyz[0] += (double)((7 * y + 3 * z) % 11 - 5);
  xyz[1] += (double)((5 * x + 2 * z) % 7 - 3);
  xyz[2] += (double)((3 * x + 5 * y) % 13 - 6);
}

/* Draw the plane z = 0 together: one layer of cells ends in a point. */
static inline void sp_to_axis(double xyz[3], const void *data)
{
  (void)data;
  xyz[0] *= xyz[2];
  xyz[1] *= xyz[2];
}

/* As wide as what sp_to_axis leaves of whole numbers. */
static inline void sp_widen(double xyz[3], const void *data)
{
  (void)data;
  xyz[0] *= 40;
  xyz[1] *= 40;
}
#endif
