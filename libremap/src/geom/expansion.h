/* expansion -- error-free transformations (Knuth, Dekker) and the double-double arithmetic built on them: a value is the
 * unevaluated sum hi + lo with |lo| at most half an ulp of hi. Only additions and multiplications in round-to-nearest, no fused
 * operations, so that the result is the same on every processor. Magnitudes must stay within 2^-1000..2^990. Shared by geom,
 * mesh, moments and cells. */
#ifndef RM_GEOM_EXPANSION_H
#define RM_GEOM_EXPANSION_H

#include "geom/geom.h"

/* Half an ulp of 1: the unit of the error bounds. */
#define RM_EPSILON 0x1p-53

/* a + b exactly. 6 operations. */
static inline rm_dd rm_two_sum(double a, double b)
{
  const double sum = a + b, bb = sum - a;
  return (rm_dd){sum, (a - (sum - bb)) + (b - bb)};
}

/* a + b exactly, if |a| >= |b| or a = 0. 3 operations. */
static inline rm_dd rm_quick_two_sum(double a, double b)
{
  const double sum = a + b;
  return (rm_dd){sum, b - (sum - a)};
}

/* a - b exactly. 6 operations. */
static inline rm_dd rm_two_diff(double a, double b)
{
  const double diff = a - b, bb = a - diff;
  return (rm_dd){diff, (a - (diff + bb)) + (bb - b)};
}

/* a as the sum of two doubles of 26 bits each. */
static inline rm_dd rm_split(double a)
{
  const double c = 0x8000001p0 * a, hi = c - (c - a);
  return (rm_dd){hi, a - hi};
}

/* a * b exactly. 17 operations; the compiler shares the split of a factor that is used again. */
static inline rm_dd rm_two_product(double a, double b)
{
  const double product = a * b;
  const rm_dd  p = rm_split(a), q = rm_split(b);
  return (rm_dd){product, ((p.hi * q.hi - product) + p.hi * q.lo + p.lo * q.hi) + p.lo * q.lo};
}

/* a + b with an error below 2^-103 (|a| + |b|). */
static inline rm_dd rm_dd_add(rm_dd a, rm_dd b)
{
  const rm_dd sum = rm_two_sum(a.hi, b.hi);
  return rm_quick_two_sum(sum.hi, sum.lo + (a.lo + b.lo));
}

/* a - b, likewise. */
static inline rm_dd rm_dd_sub(rm_dd a, rm_dd b) { return rm_dd_add(a, (rm_dd){-b.hi, -b.lo}); }

/* a * b with an error below 2^-102 |a b|. */
static inline rm_dd rm_dd_mul(rm_dd a, rm_dd b)
{
  const rm_dd product = rm_two_product(a.hi, b.hi);
  return rm_quick_two_sum(product.hi, product.lo + (a.hi * b.lo + a.lo * b.hi));
}

/* u x v of vectors in double-double. */
static inline void rm_dd_cross(const rm_dd u[3], const rm_dd v[3], rm_dd out[3])
{
  for (int k = 0; k < 3; k++) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;

    out[k] = rm_dd_sub(rm_dd_mul(u[i], v[j]), rm_dd_mul(u[j], v[i]));
  }
}

/* u . v, likewise. */
static inline rm_dd rm_dd_dot(const rm_dd u[3], const rm_dd v[3])
{
  return rm_dd_add(rm_dd_add(rm_dd_mul(u[0], v[0]), rm_dd_mul(u[1], v[1])), rm_dd_mul(u[2], v[2]));
}

#endif
