/* predicates -- exact signs of 3x3 determinants and of components of cross products, with simulation of simplicity.
 *
 * Five stages, each asked only if the one before cannot tell:
 *   1. the determinant in doubles against its rounding error bound (Shewchuk 1997, stage A): 4 ns;
 *   2. exact zeros for free: every product is zero (a shared point, points in an axis-parallel plane; nothing underflows, see
 *      below), or two of the points coincide: 4-6 ns;
 *   3. integers of 64 and 128 bits (grid.h), if the coordinates share a grid, as nearly all do: 30 ns;
 *   4. the determinant in double-double against its bound (3x3 only): 30 ns;
 *   5. integers of any length (exact.h): 300 ns.
 *
 * Coordinates are multiples of 2^-152 (geom.h), so a product of three differences is 0 or at least 2^-456 and every rounding
 * error in it a multiple of 2^-456: underflow does not occur and the bounds hold as they stand. */
#include "geom/exact.h"
#include "geom/expansion.h"
#include "geom/geom_private.h"
#include "geom/grid.h"

/* Rounding error bounds, relative to the sum of absolute terms. */
static const double CROSS_ERROR  = (3 + 16 * RM_EPSILON) * RM_EPSILON;
static const double DET_ERROR    = (7 + 56 * RM_EPSILON) * RM_EPSILON;
static const double DET_ERROR_DD = 0x1p-95;

/* ---- 3x3 ---------------------------------------------------------------------------------------------------------- */

/* Stage 3, grid = o, a, b, c. */
static int grid_det_sign(const int64_t grid[12])
{
  int64_t   d[3][3];
  rm_int128 normal[3];

  for (int r = 0; r < 3; r++)
    for (int k = 0; k < 3; k++) d[r][k] = grid[3 * r + 3 + k] - grid[k];
  rm_grid_cross(d[1], d[2], normal);
  return rm_grid_sign(rm_grid_dot(normal, d[0]));
}

/* The last stage. */
static int exact_det_sign(const double o[3], const double a[3], const double b[3], const double c[3])
{
  const double *const point[] = {o, a, b, c};
  const int           scale   = rm_int_scale(4, point);
  rm_int              d[3][3], normal[3], det;

  for (int r = 0; r < 3; r++)
    for (int k = 0; k < 3; k++) rm_int_from_difference(&d[r][k], point[r + 1][k], o[k], scale);
  rm_int_cross(normal, d[1], d[2]);
  rm_int_dot(&det, d[0], normal);
  return rm_int_sign(&det);
}

/* Stages 2 to 5, where permanent is the sum of absolute terms in doubles. */
static __attribute__((noinline)) int close_det_sign(const double o[3], const double a[3], const double b[3], const double c[3],
                                                    double permanent)
{
  const double xyz[] = {o[0], o[1], o[2], a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]};
  int64_t      grid[12];

  if (rm_same_point(a, b) || rm_same_point(b, c) || rm_same_point(a, c)) return 0;
  if (rm_to_grid(12, xyz, grid)) return grid_det_sign(grid);
  const rm_dd det = rm_det_dd(o, a, b, c);
  return fabs(det.hi) > DET_ERROR_DD * permanent ? rm_sign(det.hi) : exact_det_sign(o, a, b, c);
}

/* Sign of det[a - o, b - o, c - o]. The rows are relative to o: put the point there that is most often shared. */
static inline int det_sign(const double o[3], const double a[3], const double b[3], const double c[3])
{
  const double ax = a[0] - o[0], ay = a[1] - o[1], az = a[2] - o[2];
  const double bx = b[0] - o[0], by = b[1] - o[1], bz = b[2] - o[2];
  const double cx = c[0] - o[0], cy = c[1] - o[1], cz = c[2] - o[2];
  const double bycz = by * cz, bzcy = bz * cy, bzcx = bz * cx, bxcz = bx * cz, bxcy = bx * cy, bycx = by * cx;
  const double det = ax * (bycz - bzcy) + ay * (bzcx - bxcz) + az * (bxcy - bycx);
  const double permanent =
      (fabs(bycz) + fabs(bzcy)) * fabs(ax) + (fabs(bzcx) + fabs(bxcz)) * fabs(ay) + (fabs(bxcy) + fabs(bycx)) * fabs(az);
  const double bound = DET_ERROR * permanent;

  if (det > bound) return 1;
  if (det < -bound) return -1;
  if (permanent == 0) return 0;
  return close_det_sign(o, a, b, c, permanent);
}

/* ---- 2x2 ---------------------------------------------------------------------------------------------------------- */

/* The last stage: sign of (a1 - a0)_i (b1 - b0)_j - (a1 - a0)_j (b1 - b0)_i; x holds i and j of a0, a1, b0, b1. */
static int exact_cross_sign(const double x[8])
{
  const double *const point[] = {x, x + 3, x + 5}; /* all eight, one of them twice */
  const int           scale   = rm_int_scale(3, point);
  rm_int              a[2], b[2], minor;

  for (int k = 0; k < 2; k++) {
    rm_int_from_difference(&a[k], x[2 + k], x[k], scale);
    rm_int_from_difference(&b[k], x[6 + k], x[4 + k], scale);
  }
  rm_int_minor(&minor, &a[0], &b[1], &a[1], &b[0]);
  return rm_int_sign(&minor);
}

static __attribute__((noinline)) int close_cross_sign(const double x[8])
{
  int64_t grid[8];

  if (!rm_to_grid(8, x, grid)) return exact_cross_sign(x);
  const rm_int128 minor = rm_grid_minor(grid[2] - grid[0], grid[3] - grid[1], grid[6] - grid[4], grid[7] - grid[5]);
  return (minor > 0) - (minor < 0);
}

int rm_cross_sign(const double a0[3], const double a1[3], const double b0[3], const double b1[3], int axis)
{
  static const int next[5] = {0, 1, 2, 0, 1};
  const int        i = next[axis + 1], j = next[axis + 2];
  const double     left = (a1[i] - a0[i]) * (b1[j] - b0[j]), right = (a1[j] - a0[j]) * (b1[i] - b0[i]);
  const double     minor = left - right, bound = CROSS_ERROR * (fabs(left) + fabs(right));

  if (minor > bound) return 1;
  if (minor < -bound) return -1;
  if (bound == 0) return 0;
  return close_cross_sign((const double[]){a0[i], a0[j], a1[i], a1[j], b0[i], b0[j], b1[i], b1[j]});
}

int rm_first_cross_sign(const double a0[3], const double a1[3], const double b0[3], const double b1[3])
{
  int sign = 0;

  for (int axis = 0; axis < 3 && !sign; axis++) sign = rm_cross_sign(a0, a1, b0, b1, axis);
  return sign;
}

/* ---- the interface ------------------------------------------------------------------------------------------------ */

int rm_orient3d(const double a[3], const double b[3], const double c[3], const double d[3]) { return det_sign(a, b, c, d); }

int rm_point_side(const double t0[3], const double t1[3], const double t2[3], const double p[3], int moved, bool *degenerate)
{
  const int sign = -det_sign(p, t0, t1, t2); /* a vertex of the triangle makes a row of zeros */

  if (degenerate) *degenerate = sign == 0;
  return sign ? sign : -moved * rm_first_cross_sign(t0, t1, t0, t2);
}

int rm_edge_side(const double p0[3], const double p1[3], const double f0[3], const double f1[3], int moved, bool *degenerate)
{
  const int sign = det_sign(p0, p1, f0, f1); /* det[u, f0 - p0, v] = det[u, f0 - p0, f1 - p0] */

  if (degenerate) *degenerate = sign == 0;
  if (sign) return sign;
  if ((rm_same_point(p0, f0) && rm_same_point(p1, f1)) || (rm_same_point(p0, f1) && rm_same_point(p1, f0))) return 0;
  return moved * rm_first_cross_sign(f0, f1, p0, p1);
}
