/* sum -- exact sums of doubles in fixed point.
 *
 * limb[k] counts units of 2^(32 k - 1074), so that limb 0 starts at the last bit of the smallest subnormal number and limb 65
 * holds the first bit of the largest one; the four limbs above take carries. A double is 53 bits at any offset, hence three
 * limbs; an addition is three integer additions, a carry or the rounding to a double O(RM_SUM_LIMBS). */
#include "base.h"

#include <math.h>
#include <string.h>

enum { LOWEST = -1074, MAX_ADDED = 1 << 30 };

void rm_sum_clear(rm_sum *sum) { memset(sum, 0, sizeof *sum); }

void rm_sum_add(rm_sum *sum, double x)
{
  const uint64_t fraction_mask = (UINT64_C(1) << 52) - 1, word = UINT32_MAX;
  uint64_t       bits, mantissa, low;
  int64_t       *limb, part[3];
  int            exponent, shift;

  RM_ASSERT(isfinite(x));
  memcpy(&bits, &x, sizeof bits);
  exponent = (int)(bits >> 52 & 2047);
  mantissa = (bits & fraction_mask) | (uint64_t)(exponent > 0) << 52;
  exponent -= exponent > 0; /* subnormal numbers share the unit of the smallest normal ones */

  limb    = sum->limb + exponent / 32;
  shift   = exponent % 32;
  low     = (mantissa & word) << shift;
  part[0] = (int64_t)(low & word);
  low     = (low >> 32) + ((mantissa >> 32) << shift); /* below 2^53 */
  part[1] = (int64_t)(low & word);
  part[2] = (int64_t)(low >> 32);
  for (int k = 0; k < 3; k++) limb[k] += bits >> 63 ? -part[k] : part[k];
  if (++sum->added >= MAX_ADDED) rm_sum_carry(sum);
}

void rm_sum_add_product(rm_sum *sum, double x, double y)
{
  const double product = x * y;

  RM_ASSERT(product == 0 ? x == 0 || y == 0 : fabs(product) >= 0x1p-960 && fabs(product) <= 0x1p1000);
  rm_sum_add(sum, product);
  rm_sum_add(sum, fma(x, y, -product)); /* the rounding error, exactly */
}

void rm_sum_merge(rm_sum *sum, const rm_sum *other)
{
  if (other->added >= MAX_ADDED - sum->added) rm_sum_carry(sum);
  for (int k = 0; k < RM_SUM_LIMBS; k++) sum->limb[k] += other->limb[k];
  sum->added += other->added;
  if (sum->added >= MAX_ADDED) rm_sum_carry(sum);
}

void rm_sum_carry(rm_sum *sum)
{
  int64_t carry = 0;

  for (int k = 0; k < RM_SUM_LIMBS - 1; k++) {
    const int64_t here = sum->limb[k] + carry, low = here & UINT32_MAX;

    sum->limb[k] = low;
    carry        = (here - low) / ((int64_t)1 << 32); /* exact, so rounded towards minus infinity */
  }
  sum->limb[RM_SUM_LIMBS - 1] += carry; /* the sign lives here */
  sum->added = 1;
}

static uint64_t limb_or_zero(const rm_sum *sum, int k) { return k >= 0 && k < RM_SUM_LIMBS ? (uint64_t)sum->limb[k] : 0; }

/* 64 bits of a carried, non-negative number from bit `from` upwards, from >= -64; bits below 0 are 0. */
static uint64_t bits_from(const rm_sum *sum, int from)
{
  const int      k = (from + 64) / 32 - 2, shift = (from + 64) % 32;
  const uint64_t low = limb_or_zero(sum, k) | limb_or_zero(sum, k + 1) << 32, high = limb_or_zero(sum, k + 2);

  return shift ? low >> shift | high << (64 - shift) : low;
}

static bool any_bit_below(const rm_sum *sum, int end)
{
  for (int k = 0; 32 * k < end; k++) {
    const int      kept = end - 32 * k; /* bits of this limb that count */
    const uint64_t mask = kept < 32 ? (UINT64_C(1) << kept) - 1 : UINT32_MAX;

    if ((uint64_t)sum->limb[k] & mask) return true;
  }
  return false;
}

double rm_sum_value(const rm_sum *sum)
{
  rm_sum   magnitude = *sum;
  double   sign      = 1;
  int      top       = RM_SUM_LIMBS - 1, length;
  uint64_t bits, rest;

  rm_sum_carry(&magnitude);
  if (magnitude.limb[top] < 0) {
    sign = -1;
    for (int k = 0; k < RM_SUM_LIMBS; k++) magnitude.limb[k] = -magnitude.limb[k];
    rm_sum_carry(&magnitude);
  }
  while (top >= 0 && magnitude.limb[top] == 0) top--;
  if (top < 0) return 0;
  length = 32 * top;
  for (int64_t x = magnitude.limb[top]; x; x >>= 1) length++;

  /* The highest bit goes to bit 63: 53 bits are kept, 11 and all below decide the rounding. */
  if (length <= 53) return sign * ldexp((double)(bits_from(&magnitude, 0)), LOWEST);
  bits = bits_from(&magnitude, length - 64);
  rest = (bits & 2047) << 1 | any_bit_below(&magnitude, length - 64);
  bits >>= 11;
  bits += rest > 2048 || (rest == 2048 && (bits & 1));
  return sign * ldexp((double)bits, length - 53 + LOWEST);
}
