/* exact -- integers of fixed capacity, sign and magnitude; see exact.h for capacities and cost. Schoolbook products: at the
 * handful of limbs in use nothing else is faster. */
#include "geom/exact.h"

#include <math.h>
#include <string.h>

__extension__ typedef unsigned __int128 wide; /* two limbs */

/* x = (-1)^negative * mantissa * 2^exponent with an odd mantissa; x finite and not 0. */
static uint64_t decompose(double x, int *exponent, bool *negative)
{
  uint64_t bits, mantissa;
  int      zeros;

  memcpy(&bits, &x, sizeof bits);
  *negative = bits >> 63;
  *exponent = (int)(bits >> 52 & 2047);
  RM_ASSERT(*exponent < 2047);
  mantissa  = (bits & ((UINT64_C(1) << 52) - 1)) | (uint64_t)(*exponent > 0) << 52;
  *exponent = (*exponent > 0 ? *exponent : 1) - 1075;
  zeros     = __builtin_ctzll(mantissa);
  *exponent += zeros;
  return mantissa >> zeros;
}

int rm_int_scale(int num, const double *const xyz[])
{
  int  scale = -1074;
  bool negative;

  for (int i = 0; i < num; i++)
    for (int k = 0; k < 3; k++) {
      int exponent;

      if (xyz[i][k] == 0) continue;
      decompose(xyz[i][k], &exponent, &negative);
      if (-exponent > scale) scale = -exponent;
    }
  return scale;
}

void rm_int_from_double(rm_int *r, double x, int scale)
{
  uint64_t mantissa;
  int      exponent, first, shift;
  bool     negative;

  r->sign = r->num_limbs = 0;
  if (x == 0) return;
  mantissa = decompose(x, &exponent, &negative);
  exponent += scale;
  first = exponent / 64;
  shift = exponent % 64;
  RM_ASSERT(exponent >= 0 && first + 2 <= RM_INT_LIMBS);
  for (int k = 0; k < first; k++) r->limb[k] = 0;
  r->limb[first]     = mantissa << shift;
  r->limb[first + 1] = shift ? mantissa >> (64 - shift) : 0;
  r->num_limbs       = first + 1 + (r->limb[first + 1] != 0);
  r->sign            = negative ? -1 : 1;
}

void rm_int_from_difference(rm_int *r, double x, double y, int scale)
{
  rm_int other;

  rm_int_from_double(r, x, scale);
  rm_int_from_double(&other, y, scale);
  rm_int_sub(r, r, &other);
}

/* -1, 0, +1 as |a| is less, equal, greater. */
static int compare_magnitude(const rm_int *a, const rm_int *b)
{
  if (a->num_limbs != b->num_limbs) return a->num_limbs < b->num_limbs ? -1 : 1;
  for (int k = a->num_limbs - 1; k >= 0; k--)
    if (a->limb[k] != b->limb[k]) return a->limb[k] < b->limb[k] ? -1 : 1;
  return 0;
}

/* |r| = |a| + |b|; r may be an operand, its sign is left to the caller. */
static void add_magnitude(rm_int *r, const rm_int *a, const rm_int *b)
{
  const rm_int *longer = a->num_limbs >= b->num_limbs ? a : b, *shorter = longer == a ? b : a;
  const int     n = longer->num_limbs, m = shorter->num_limbs;
  wide          carry = 0;

  for (int k = 0; k < n; k++) {
    carry += (wide)longer->limb[k] + (k < m ? shorter->limb[k] : 0);
    r->limb[k] = (uint64_t)carry;
    carry >>= 64;
  }
  r->num_limbs = n;
  if (carry) {
    RM_ASSERT(n < RM_INT_LIMBS);
    r->limb[r->num_limbs++] = (uint64_t)carry;
  }
}

/* |r| = |a| - |b|, |a| > |b|; likewise. */
static void sub_magnitude(rm_int *r, const rm_int *a, const rm_int *b)
{
  const int n = a->num_limbs, m = b->num_limbs;
  uint64_t  borrow = 0;

  for (int k = 0; k < n; k++) {
    const uint64_t minuend = a->limb[k], subtrahend = k < m ? b->limb[k] : 0, diff = minuend - subtrahend;

    r->limb[k] = diff - borrow;
    borrow     = (uint64_t)(minuend < subtrahend) | (uint64_t)(diff < borrow);
  }
  r->num_limbs = n;
  while (r->limb[r->num_limbs - 1] == 0) r->num_limbs--;
}

/* *r = a + sign_b |b|. */
static void add_signed(rm_int *r, const rm_int *a, const rm_int *b, int sign_b)
{
  const int sign_a = a->sign;

  if (sign_a == 0 || sign_b == 0 || sign_a == sign_b) {
    add_magnitude(r, a, b);
    r->sign = sign_a ? sign_a : sign_b;
    return;
  }
  const int order = compare_magnitude(a, b);
  if (order > 0) sub_magnitude(r, a, b);
  if (order < 0) sub_magnitude(r, b, a);
  if (order == 0) r->num_limbs = 0;
  r->sign = order * sign_a;
}

void rm_int_add(rm_int *r, const rm_int *a, const rm_int *b) { add_signed(r, a, b, b->sign); }

void rm_int_sub(rm_int *r, const rm_int *a, const rm_int *b) { add_signed(r, a, b, -b->sign); }

void rm_int_mul(rm_int *r, const rm_int *a, const rm_int *b)
{
  const int n = a->num_limbs, m = b->num_limbs;

  RM_ASSERT(r != a && r != b && n + m <= RM_INT_LIMBS);
  r->sign      = a->sign * b->sign;
  r->num_limbs = 0;
  if (!r->sign) return;
  for (int k = 0; k < m; k++) r->limb[k] = 0;
  for (int i = 0; i < n; i++) {
    const wide factor = a->limb[i];
    wide       carry  = 0;

    for (int k = 0; k < m; k++) {
      carry += factor * b->limb[k] + r->limb[i + k];
      r->limb[i + k] = (uint64_t)carry;
      carry >>= 64;
    }
    r->limb[i + m] = (uint64_t)carry;
  }
  r->num_limbs = n + m - (r->limb[n + m - 1] == 0);
}

void rm_int_minor(rm_int *r, const rm_int *a, const rm_int *b, const rm_int *c, const rm_int *d)
{
  rm_int cd;

  rm_int_mul(r, a, b);
  rm_int_mul(&cd, c, d);
  rm_int_sub(r, r, &cd);
}

void rm_int_dot(rm_int *r, const rm_int u[3], const rm_int v[3])
{
  rm_int term;

  rm_int_mul(r, &u[0], &v[0]);
  for (int k = 1; k < 3; k++) {
    rm_int_mul(&term, &u[k], &v[k]);
    rm_int_add(r, r, &term);
  }
}

void rm_int_cross(rm_int out[3], const rm_int u[3], const rm_int v[3])
{
  for (int k = 0; k < 3; k++) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;

    rm_int_minor(&out[k], &u[i], &v[j], &u[j], &v[i]);
  }
}

/* |a| = m 2^*exponent, m in [1/2, 1], relative error below 2^-52; a is not 0. */
static double mantissa(const rm_int *a, int *exponent)
{
  const int      n     = a->num_limbs;
  const int      shift = __builtin_clzll(a->limb[n - 1]);
  const uint64_t next  = n > 1 && shift ? a->limb[n - 2] >> (64 - shift) : 0;

  *exponent = 64 * n - shift;
  return (double)(a->limb[n - 1] << shift | next) * 0x1p-64;
}

double rm_int_ratio(const rm_int *num, const rm_int *den)
{
  int    num_exponent, den_exponent;
  double quotient;

  RM_ASSERT(den->sign);
  if (!num->sign) return 0;
  quotient = mantissa(num, &num_exponent) / mantissa(den, &den_exponent);
  return num->sign * den->sign * ldexp(quotient, num_exponent - den_exponent);
}
