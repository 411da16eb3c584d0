/* exact -- signed integers of fixed capacity on the stack: the last word wherever floating point cannot decide.
 *
 * A double times 2^scale is an integer as soon as scale covers its last bit: coordinates as geom.h admits them are integers of
 * at most 163 bits at RM_INT_SCALE, their determinants (degree 3) have below 500 bits, comparisons of two quotients of
 * determinants (degree 6) below 1000. The capacity of RM_INT_BITS leaves degree 24: a point with rational coordinates
 * (numerator degree 4 over 3) in a determinant of its own kind. A product of integers at scales s and t is an integer at scale
 * s + t; sums need equal scales, which is the caller's business. Signs do not depend on the scale, so rm_int_scale can pick the
 * smallest one that fits, where numbers are short and quick.
 *
 * Values are functions of their arguments; nothing is allocated. Cost: O(limbs) for sums, O(limbs a times limbs b) for
 * products; a determinant of coordinates takes about 250 ns. Only the limbs in use are written or read. Shared by geom, moments
 * and cells. */
#ifndef RM_GEOM_EXACT_H
#define RM_GEOM_EXACT_H

#include "base/base.h"

enum { RM_INT_LIMBS = 66, RM_INT_BITS = 64 * RM_INT_LIMBS, RM_INT_SCALE = 152 };

typedef struct rm_int {
  int      sign;               /* -1, 0, +1                                              */
  int      num_limbs;          /* in use; the last one is not zero; 0 exactly if sign is */
  uint64_t limb[RM_INT_LIMBS]; /* magnitude, least significant first                     */
} rm_int;

/* The smallest scale at which every coordinate of num points is an integer. RM_INT_SCALE is one for all admitted
 * coordinates. */
int rm_int_scale(int num, const double *const xyz[]);

/* *r = x 2^scale, which has to be an integer within RM_INT_BITS. */
void rm_int_from_double(rm_int *r, double x, int scale);

/* *r = (x - y) 2^scale, likewise. */
void rm_int_from_difference(rm_int *r, double x, double y, int scale);

/* *r = a + b: r may be an operand. */
void rm_int_add(rm_int *r, const rm_int *a, const rm_int *b);

/* *r = a - b: r may be an operand. */
void rm_int_sub(rm_int *r, const rm_int *a, const rm_int *b);

/* *r = a b: r must not be an operand. */
void rm_int_mul(rm_int *r, const rm_int *a, const rm_int *b);

/* *r = a b - c d: r must not be an operand. */
void rm_int_minor(rm_int *r, const rm_int *a, const rm_int *b, const rm_int *c, const rm_int *d);

/* *r = u . v: r must not be an operand. */
void rm_int_dot(rm_int *r, const rm_int u[3], const rm_int v[3]);

/* out = u x v: out must not overlap an operand. */
void rm_int_cross(rm_int out[3], const rm_int u[3], const rm_int v[3]);

/* -1, 0, +1. */
static inline int rm_int_sign(const rm_int *a) { return a->sign; }

/* num / den as a double, relative error below 2^-50; den is not 0, the quotient within the range of doubles. */
double rm_int_ratio(const rm_int *num, const rm_int *den);

#endif
