/* The superaccumulator against rational arithmetic of GMP and against cases whose answer is known. */
#include "base/base.h"
#include "rt.h"

#include <float.h>
#include <gmp.h>

static uint64_t next(uint64_t *state) { return rm_hash_word((*state)++); }

/* A finite double of any exponent between the two, of either sign, with random mantissa. */
static double any_double(uint64_t *state, int lowest, int highest)
{
  const double mantissa = 1 + ldexp((double)(next(state) >> 12), -52);
  const int    exponent = lowest + (int)(next(state) % (uint64_t)(highest - lowest + 1));

  return ldexp(next(state) & 1 ? mantissa : -mantissa, exponent);
}

/* The sum as a rational number, rounded to the nearest double, ties to even: by trying the neighbours of GMP's truncation. */
static double nearest(const mpq_t exact)
{
  const double inward = mpq_get_d(exact), outward = nextafter(inward, mpq_sgn(exact) < 0 ? -INFINITY : INFINITY);
  double       result;
  mpq_t        low, high;
  int          order;
  int64_t      bits;

  if (isinf(outward)) return inward;
  mpq_inits(low, high, NULL);
  mpq_set_d(low, inward);
  mpq_sub(low, exact, low);
  mpq_abs(low, low);
  mpq_set_d(high, outward);
  mpq_sub(high, exact, high);
  mpq_abs(high, high);
  order = mpq_cmp(low, high);
  memcpy(&bits, &inward, sizeof bits);
  result = order < 0 || (order == 0 && bits % 2 == 0) ? inward : outward;
  mpq_clears(low, high, NULL);
  return result;
}

/* Sum of the list by rm_sum and by GMP; true if they agree to the bit. */
static int agrees(const double *list, int n)
{
  rm_sum sum;
  mpq_t  exact, term;
  double want;

  rm_sum_clear(&sum);
  mpq_inits(exact, term, NULL);
  for (int i = 0; i < n; i++) {
    rm_sum_add(&sum, list[i]);
    mpq_set_d(term, list[i]);
    mpq_add(exact, exact, term);
  }
  want = nearest(exact);
  mpq_clears(exact, term, NULL);
  return RT_NEAR(rm_sum_value(&sum), want, 0.0);
}

static void random_sums_are_rounded_once(void)
{
  static const int range[][2] = {{-1, 1}, {-60, 60}, {-500, 500}, {-1022, 1000}, {-1080, -1020}, {-1074, -1074}, {900, 1010}};
  double           list[300];
  uint64_t         state = 1;

  for (int round = 0; round < 700; round++) {
    const int *r = range[round % 7], n = 1 + round % 300;

    for (int i = 0; i < n; i++) list[i] = any_double(&state, r[0], r[1]);
    if (round % 2) /* cancel all but a few terms */
      for (int i = 3; i + 1 < n; i += 2) list[i + 1] = -list[i];
    if (!agrees(list, n)) return;
  }
}

static double sum_of(const double *list, int n)
{
  rm_sum sum;

  rm_sum_clear(&sum);
  for (int i = 0; i < n; i++) rm_sum_add(&sum, list[i]);
  return rm_sum_value(&sum);
}
#define SUM(...) sum_of((const double[]){__VA_ARGS__}, (int)(sizeof((const double[]){__VA_ARGS__}) / sizeof(double)))

static void known_sums_are_exact(void)
{
  const double tiny = 0x1p-1074, normal = DBL_MIN;

  RT_NEAR(sum_of(NULL, 0), 0.0, 0.0);
  RT_NEAR(SUM(0.0, -0.0), 0.0, 0.0);
  RT_NEAR(SUM(tiny), tiny, 0.0);
  RT_NEAR(SUM(-tiny, -tiny, -tiny), -3 * tiny, 0.0);
  RT_NEAR(SUM(normal, -tiny), normal - tiny, 0.0);
  RT_NEAR(SUM(normal - tiny, tiny), normal, 0.0);
  RT_NEAR(SUM(DBL_MAX, tiny, -DBL_MAX), tiny, 0.0);
  RT_NEAR(SUM(DBL_MAX, DBL_MAX, -DBL_MAX, -tiny), DBL_MAX, 0.0);
  RT_NEAR(SUM(DBL_MAX, DBL_MAX, -DBL_MAX, -DBL_MAX), 0.0, 0.0);
  RT_NEAR(SUM(DBL_MAX, DBL_MAX), INFINITY, 0.0);
  RT_NEAR(SUM(-DBL_MAX, -DBL_MAX), -INFINITY, 0.0);
  RT_NEAR(SUM(1e300, 1.0, -1e300, 1e-300, -1.0), 1e-300, 0.0);
  RT_NEAR(SUM(-1.0, 0x1p-200), -1.0, 0.0);
  RT_NEAR(SUM(-1.0, 0x1p-54, 0x1p-1000), -1 + 0x1p-53, 0.0);
}

static void ties_go_to_even(void)
{
  RT_NEAR(SUM(1.0, 0x1p-53), 1.0, 0.0);
  RT_NEAR(SUM(1.0, 0x1p-53, 0x1p-1074), 1 + 0x1p-52, 0.0);
  RT_NEAR(SUM(1.0, 0x1p-53, -0x1p-1074), 1.0, 0.0);
  RT_NEAR(SUM(1 + 0x1p-52, 0x1p-53), 1 + 0x1p-51, 0.0);
  RT_NEAR(SUM(-1 - 0x1p-52, -0x1p-53), -1 - 0x1p-51, 0.0);
  RT_NEAR(SUM(0x1p53, 1.0), 0x1p53, 0.0);
  RT_NEAR(SUM(0x1p53 + 2, 1.0), 0x1p53 + 4, 0.0);
  RT_NEAR(SUM(2 - 0x1p-52, 0x1p-53), 2.0, 0.0); /* the rounding carries into a new bit */
}

static void integers_sum_without_error(void)
{
  rm_sum                 sum;
  __extension__ __int128 want  = 0;
  uint64_t               state = 5;

  rm_sum_clear(&sum);
  for (int i = 0; i < 2000000; i++) {
    const int64_t x = (int64_t)(next(&state) >> 11) - (INT64_C(1) << 52);

    rm_sum_add(&sum, (double)x);
    want += x;
  }
  RT_NEAR(rm_sum_value(&sum), (double)want, 0.0);
  rm_sum_add(&sum, (double)-(int64_t)(want / 4096) * 4096);
  RT_NEAR(rm_sum_value(&sum), (double)(want % 4096), 0.0);
}

static void products_are_exact(void)
{
  rm_sum   sum;
  uint64_t state = 7;

  rm_sum_clear(&sum);
  rm_sum_add_product(&sum, 1 + 0x1p-52, 1 + 0x1p-52);
  rm_sum_add(&sum, -1 - 0x1p-51);
  RT_NEAR(rm_sum_value(&sum), 0x1p-104, 0.0);
  rm_sum_clear(&sum);
  rm_sum_add_product(&sum, 0.0, -5.0);
  RT_NEAR(rm_sum_value(&sum), 0.0, 0.0);

  for (int round = 0; round < 300; round++) {
    mpq_t exact, x, y;

    mpq_inits(exact, x, y, NULL);
    rm_sum_clear(&sum);
    for (int i = 0; i < 50; i++) {
      const double u = any_double(&state, -478, 490), v = any_double(&state, -478, 490);

      rm_sum_add_product(&sum, u, v);
      mpq_set_d(x, u);
      mpq_set_d(y, v);
      mpq_mul(x, x, y);
      mpq_add(exact, exact, x);
    }
    RT_NEAR(rm_sum_value(&sum), nearest(exact), 0.0);
    mpq_clears(exact, x, y, NULL);
  }
}

/* Any way of dealing the terms out to parts, and merging or adding the parts limb by limb, gives the same bits. */
static void parts_and_order_do_not_matter(void)
{
  double   list[1000], want;
  uint64_t state = 11;

  for (int i = 0; i < 1000; i++) list[i] = any_double(&state, -300, 300);
  want = sum_of(list, 1000);
  for (int parts = 1; parts <= 9; parts++) {
    rm_sum part[9], merged, limbs;

    for (int p = 0; p < parts; p++) rm_sum_clear(&part[p]);
    for (int i = 0; i < 1000; i++) rm_sum_add(&part[next(&state) % (uint64_t)parts], list[(i * 7) % 1000]);
    rm_sum_clear(&merged);
    rm_sum_clear(&limbs);
    for (int p = 0; p < parts; p++) {
      rm_sum_merge(&merged, &part[p]);
      rm_sum_carry(&part[p]);
      for (int k = 0; k < RM_SUM_LIMBS; k++) {
        RT_CHECK(llabs(part[p].limb[k]) < INT64_C(1) << 32);
        limbs.limb[k] += part[p].limb[k];
      }
    }
    RT_NEAR(rm_sum_value(&merged), want, 0.0);
    RT_NEAR(rm_sum_value(&limbs), want, 0.0);
  }
}

static void a_carry_changes_nothing(void)
{
  rm_sum   sum, carried;
  uint64_t state = 13;

  rm_sum_clear(&sum);
  rm_sum_clear(&carried);
  for (int i = 0; i < 500; i++) {
    const double x = any_double(&state, -1074, 1000);

    rm_sum_add(&sum, x);
    rm_sum_add(&carried, x);
    rm_sum_carry(&carried);
    rm_sum_carry(&carried);
  }
  RT_NEAR(rm_sum_value(&carried), rm_sum_value(&sum), 0.0);
}

/* Fill the lowest three limbs to their capacity by merging a sum with itself: 2^40 terms of all ones. */
static void limbs_do_not_overflow(void)
{
  const double ones = 0x1p53 - 1;
  rm_sum       sum, copy;

  rm_sum_clear(&sum);
  rm_sum_add(&sum, ones);
  for (int k = 0; k < 40; k++) {
    copy = sum;
    rm_sum_merge(&sum, &copy);
  }
  RT_NEAR(rm_sum_value(&sum), ldexp(ones, 40), 0.0);
  rm_sum_clear(&copy);
  for (int k = 0; k < RM_SUM_LIMBS; k++) copy.limb[k] = -sum.limb[k];
  RT_NEAR(rm_sum_value(&copy), -ldexp(ones, 40), 0.0);
  rm_sum_merge(&sum, &copy);
  RT_NEAR(rm_sum_value(&sum), 0.0, 0.0);
}

RT_MAIN(RT_CASE(random_sums_are_rounded_once), RT_CASE(known_sums_are_exact), RT_CASE(ties_go_to_even),
        RT_CASE(integers_sum_without_error), RT_CASE(products_are_exact), RT_CASE(parts_and_order_do_not_matter),
        RT_CASE(a_carry_changes_nothing), RT_CASE(limbs_do_not_overflow))
