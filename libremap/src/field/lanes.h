/* lanes -- two numbers side by side, one in each lane of a vector register, which every processor with vectors has. They add
 * and multiply by the ordinary operators. Of an odd number of fields the last one's second lane holds whatever stands behind it
 * in memory, and is thrown away: arrays that are read by lanes have room for one number more than they hold. */
#ifndef RM_LANES_H
#define RM_LANES_H

#include <stdint.h>
#include <string.h>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

/* Of functions whose loops are unrolled for the constants that they are called with. */
#define RM_UNROLLED static inline __attribute__((always_inline))

typedef double  rm_lanes __attribute__((vector_size(16)));
typedef int64_t rm_flags __attribute__((vector_size(16)));

/* Two numbers next to each other in memory, from there and to there, and one number twice. */
static inline rm_lanes rm_lanes_at(const double *x)
{
  rm_lanes lanes;

  memcpy(&lanes, x, sizeof lanes);
  return lanes;
}
static inline void rm_lanes_put(rm_lanes lanes, int num, double *x) /* the first one only if num is 1 */
{
  if (num > 1)
    memcpy(x, &lanes, sizeof lanes);
  else
    x[0] = lanes[0];
}
static inline rm_lanes rm_lanes_of(double x) { return (rm_lanes){x, x}; }

/* Upper halves of two numbers next to each other, which tell them to 21 bits: from there as numbers, and to there, rounded. */
static inline rm_lanes rm_lanes_from_halves(const uint32_t *half)
{
#ifdef __SSE2__
  return (rm_lanes)_mm_unpacklo_epi32(_mm_setzero_si128(), _mm_loadl_epi64((const __m128i *)(const void *)half));
#else
  return (rm_lanes)((rm_flags){half[0], half[1]} << 32);
#endif
}
static inline void rm_lanes_put_halves(rm_lanes lanes, int num, uint32_t *half) /* the first one only if num is 1 */
{
  const rm_flags bits = (rm_flags)lanes + ((rm_flags){1, 1} << 31);

  half[0] = (uint32_t)((uint64_t)bits[0] >> 32);
  if (num > 1) half[1] = (uint32_t)((uint64_t)bits[1] >> 32);
}

/* a where it is less (greater) than b, else b: so what is no number in a counts nowhere. */
static inline rm_lanes rm_lanes_least(rm_lanes a, rm_lanes b)
{
#ifdef __SSE2__
  return _mm_min_pd(a, b);
#else
  const rm_flags is_less = a < b;
  return (rm_lanes)((is_less & (rm_flags)a) | (~is_less & (rm_flags)b));
#endif
}
static inline rm_lanes rm_lanes_greatest(rm_lanes a, rm_lanes b)
{
#ifdef __SSE2__
  return _mm_max_pd(a, b);
#else
  const rm_flags is_greater = a > b;
  return (rm_lanes)((is_greater & (rm_flags)a) | (~is_greater & (rm_flags)b));
#endif
}

/* 0 in the lanes where a sum of x, y and z times 0 is no number: where one of them is none or infinite. */
static inline rm_flags rm_lanes_finite(rm_lanes x, rm_lanes y, rm_lanes z)
{
  const rm_lanes zero = {0.0, 0.0};

  return (rm_flags)(zero * x + zero * y + zero * z == zero);
}

/* Without signs. */
static inline rm_lanes rm_lanes_magnitude(rm_lanes a) { return (rm_lanes)((rm_flags)a & (rm_flags){INT64_MAX, INT64_MAX}); }

#endif
