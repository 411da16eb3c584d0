/* grid -- coordinates as 64-bit integers: exact determinants in a few dozen nanoseconds.
 *
 * Coordinates that are multiples of 2^-61 of the largest among them, as nearly all are, become integers below 2^61. Then
 * differences are below 2^62, components of a cross product of two differences below 2^125, and a dot product with a third one
 * is held in two parts. Private to geom. */
#ifndef RM_GEOM_GRID_H
#define RM_GEOM_GRID_H

#include <math.h>
#include <string.h>

#include "base/base.h"

__extension__ typedef __int128 rm_int128;

enum { RM_GRID_BITS = 61 };

/* high * 2^62 + low, 0 <= low < 2^62. */
typedef struct rm_grid_value {
  rm_int128 high;
  int64_t   low;
} rm_grid_value;

/* The power of two that brings values up to largest > 0 below 2^RM_GRID_BITS. */
static inline double rm_grid_scale(double largest)
{
  uint64_t bits;
  double   scale;

  memcpy(&bits, &largest, sizeof bits);
  bits = (uint64_t)(RM_GRID_BITS + 1022 + 1023 - (int)(bits >> 52)) << 52;
  memcpy(&scale, &bits, sizeof scale);
  return scale;
}

/* The num coordinates x[] as integers in units of their own; false if their last bits are too far below the largest. */
static inline bool rm_to_grid(int num, const double x[], int64_t out[])
{
  double largest = 0, scale;
  bool   exact   = true;

  for (int k = 0; k < num; k++) largest = fabs(x[k]) > largest ? fabs(x[k]) : largest;
  if (largest == 0) largest = 1;
  scale = rm_grid_scale(largest);
  for (int k = 0; k < num; k++) {
    const double y = x[k] * scale;

    out[k] = (int64_t)y;
    exact &= (double)out[k] == y;
  }
  return exact;
}

/* a1 b2 - a2 b1 of differences. */
static inline rm_int128 rm_grid_minor(int64_t a1, int64_t a2, int64_t b1, int64_t b2)
{
  return (rm_int128)a1 * b2 - (rm_int128)a2 * b1;
}

/* u x v of differences. */
static inline void rm_grid_cross(const int64_t u[3], const int64_t v[3], rm_int128 out[3])
{
  for (int k = 0; k < 3; k++) out[k] = rm_grid_minor(u[(k + 1) % 3], u[(k + 2) % 3], v[(k + 1) % 3], v[(k + 2) % 3]);
}

/* n . u of a cross product and a difference. Each component of n is cut into high * 2^62 + low with 0 <= low < 2^62, so that
 * both sums of products stay below 2^127. Shifts of negative numbers round down, as gcc and clang define them. */
static inline rm_grid_value rm_grid_dot(const rm_int128 n[3], const int64_t u[3])
{
  const int64_t low_mask = (INT64_C(1) << 62) - 1;
  rm_int128     high = 0, low = 0;

  for (int k = 0; k < 3; k++) {
    high += (n[k] >> 62) * u[k];
    low += (n[k] & low_mask) * u[k];
  }
  return (rm_grid_value){high + (low >> 62), (int64_t)(low & low_mask)};
}

static inline int rm_grid_sign(rm_grid_value x) { return x.high ? (x.high > 0 ? 1 : -1) : x.low > 0; }

#endif
