/* residue -- integers modulo primes of 61 bits: whether a rational number is zero, at a price that grows with its length
 * only as often as it is.
 *
 * Sums, products and quotients of coordinates have an image modulo every odd prime that divides no denominator, and the
 * image of 0 is 0. So one image that is not 0 proves that the number is not, whatever its length; and a number of at most b
 * bits (its numerator over any common denominator, coordinates counted as integers) whose images vanish modulo more than b /
 * RM_RESIDUE_BITS primes is 0: their product would divide it. No number is ever longer than a word.
 *
 * Residues are kept times 2^64, after Montgomery (1985). Coordinates are as geom.h admits them and count in units of
 * 2^-RM_INT_SCALE. A product takes 3 ns, a coordinate 4 ns, the next prime about 10 us. Shared by geom and moments. */
#ifndef RM_GEOM_RESIDUE_H
#define RM_GEOM_RESIDUE_H

#include <string.h>

#include "geom/exact.h"

enum {
  RM_RESIDUE_BITS   = 60, /* every prime exceeds 2^60 */
  RM_RESIDUE_POWERS = 128
};

typedef struct rm_modulus {
  uint64_t prime;                    /* below 2^61                                      */
  uint64_t negative_inverse;         /* -1 / prime modulo 2^64                          */
  uint64_t one;                      /* 1 as a residue                                  */
  uint64_t power[RM_RESIDUE_POWERS]; /* 2^k times 2^128: turns an integer into a residue */
} rm_modulus;

__extension__ typedef unsigned __int128 rm_wide;

/* The next modulus: the largest prime below `below`, which is 2^61 for the first and the last modulus' prime for the next. */
void rm_modulus_below(rm_modulus *m, uint64_t below);

static inline uint64_t rm_residue_mul(const rm_modulus *m, uint64_t a, uint64_t b)
{
  const rm_wide  product = (rm_wide)a * b;
  const uint64_t factor = (uint64_t)product * m->negative_inverse, r = (uint64_t)((product + (rm_wide)factor * m->prime) >> 64);
  return r >= m->prime ? r - m->prime : r;
}
static inline uint64_t rm_residue_add(const rm_modulus *m, uint64_t a, uint64_t b)
{
  const uint64_t sum = a + b;
  return sum >= m->prime ? sum - m->prime : sum;
}
static inline uint64_t rm_residue_sub(const rm_modulus *m, uint64_t a, uint64_t b) { return a >= b ? a - b : a + m->prime - b; }

/* The residue of an integer, and of a coordinate in units of 2^-RM_INT_SCALE. */
static inline uint64_t rm_residue_of_int(const rm_modulus *m, int x)
{
  const uint64_t r = rm_residue_mul(m, (uint64_t)(x < 0 ? -(int64_t)x : x), m->power[0]);
  return x < 0 ? rm_residue_sub(m, 0, r) : r;
}
static inline uint64_t rm_residue_of(const rm_modulus *m, double x)
{
  uint64_t bits, r;

  if (x == 0) return 0;
  memcpy(&bits, &x, sizeof bits);
  const int scale = (int)(bits >> 52 & 2047) - 1075 + RM_INT_SCALE;
  RM_ASSERT(scale >= 0 && scale < RM_RESIDUE_POWERS);
  r = rm_residue_mul(m, (bits & ((UINT64_C(1) << 52) - 1)) | UINT64_C(1) << 52, m->power[scale]);
  return bits >> 63 ? rm_residue_sub(m, 0, r) : r;
}

/* out = b - a, u x v, u . v. out must not overlap an operand. */
static inline void rm_residue_between(const rm_modulus *m, const double a[3], const double b[3], uint64_t out[3])
{
  for (int k = 0; k < 3; k++) out[k] = rm_residue_sub(m, rm_residue_of(m, b[k]), rm_residue_of(m, a[k]));
}
static inline uint64_t rm_residue_minor(const rm_modulus *m, uint64_t a, uint64_t b, uint64_t c, uint64_t d)
{
  return rm_residue_sub(m, rm_residue_mul(m, a, b), rm_residue_mul(m, c, d));
}
static inline void rm_residue_cross(const rm_modulus *m, const uint64_t u[3], const uint64_t v[3], uint64_t out[3])
{
  for (int k = 0; k < 3; k++) out[k] = rm_residue_minor(m, u[(k + 1) % 3], v[(k + 2) % 3], u[(k + 2) % 3], v[(k + 1) % 3]);
}
static inline uint64_t rm_residue_dot(const rm_modulus *m, const uint64_t u[3], const uint64_t v[3])
{
  return rm_residue_add(m, rm_residue_add(m, rm_residue_mul(m, u[0], v[0]), rm_residue_mul(m, u[1], v[1])),
                        rm_residue_mul(m, u[2], v[2]));
}

/* A key that two planes have in common if they are one, and hardly ever otherwise: the plane through three points that are
 * not on one line, its normal scaled so that the first component that is not 0 is 1. 0.5 us. */
uint64_t rm_residue_of_plane(const rm_modulus *m, const double a[3], const double b[3], const double c[3]);

#endif
