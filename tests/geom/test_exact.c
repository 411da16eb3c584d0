/* Integers of fixed capacity against GMP's. */
#include "geom/exact.h"
#include "hard_points.h"
#include "rt.h"

#include <gmp.h>

/* A random integer of up to num_limbs limbs, often with runs of zeros and ones, built from doubles. */
static void random_int(random_state *rnd, rm_int *r, int num_limbs)
{
  rm_int part;

  rm_int_from_double(r, 0, 0);
  for (int k = 0; k < num_limbs; k++)
    for (int half = 0; half < 2; half++) {
      const int    kind  = random_below(rnd, 4);
      const double digit = kind == 0 ? 0 : kind == 1 ? 0xffffffffp0 : (double)(random_word(rnd) >> 32);

      rm_int_from_double(&part, digit, 64 * k + 32 * half);
      rm_int_add(r, r, &part);
    }
  if (random_below(rnd, 2)) {
    rm_int_from_double(&part, 0, 0);
    rm_int_sub(r, &part, r);
  }
}

static void to_gmp(mpz_t out, const rm_int *a)
{
  mpz_import(out, (size_t)a->num_limbs, -1, sizeof *a->limb, 0, 0, a->limb);
  if (a->sign < 0) mpz_neg(out, out);
}

static bool agrees(const rm_int *a, const mpz_t want)
{
  mpz_t got;
  bool  same;

  mpz_init(got);
  to_gmp(got, a);
  same = mpz_cmp(got, want) == 0 && rm_int_sign(a) == mpz_sgn(want) && (a->num_limbs == 0 || a->limb[a->num_limbs - 1] != 0) &&
         (a->sign == 0) == (a->num_limbs == 0);
  mpz_clear(got);
  return same;
}

static void sums_and_products_agree_with_gmp(void)
{
  random_state rnd   = {21};
  int          wrong = 0;
  rm_int       a, b, r;
  mpz_t        x, y, z;

  mpz_inits(x, y, z, NULL);
  for (int round = 0; round < 100000; round++) {
    random_int(&rnd, &a, random_below(&rnd, round % 100 ? 8 : RM_INT_LIMBS / 2));
    random_int(&rnd, &b, random_below(&rnd, round % 100 ? 8 : RM_INT_LIMBS / 2));
    if (random_below(&rnd, 10) == 0) b = a;
    to_gmp(x, &a);
    to_gmp(y, &b);
    rm_int_add(&r, &a, &b);
    mpz_add(z, x, y);
    wrong += !agrees(&r, z);
    rm_int_sub(&r, &a, &b);
    mpz_sub(z, x, y);
    wrong += !agrees(&r, z);
    rm_int_mul(&r, &a, &b);
    mpz_mul(z, x, y);
    wrong += !agrees(&r, z);
    rm_int_minor(&r, &a, &b, &b, &a);
    wrong += rm_int_sign(&r) != 0;
    r = a;
    rm_int_sub(&r, &b, &r);
    mpz_sub(z, y, x);
    wrong += !agrees(&r, z);
  }
  RT_EQ(wrong, 0);
  mpz_clears(x, y, z, NULL);
}

static void coordinates_are_integers_at_their_scale(void)
{
  random_state rnd   = {22};
  int          wrong = 0;
  rm_int       a;
  mpz_t        z;
  mpf_t        f;
  double       p[3][3];

  mpz_init(z);
  mpf_init2(f, 400);
  for (int round = 0; round < 20000; round++) {
    const double *const point[] = {p[0], p[1], p[2]};
    int                 scale;

    hard_points(&rnd, round % NUM_KINDS, p, 3);
    scale = rm_int_scale(3, point);
    wrong += scale > RM_INT_SCALE;
    for (int at = 0; at < 2; at++, scale = RM_INT_SCALE) {
      mpf_set_d(f, p[0][0]);
      if (scale >= 0)
        mpf_mul_2exp(f, f, (mp_bitcnt_t)scale);
      else
        mpf_div_2exp(f, f, (mp_bitcnt_t)-scale);
      wrong += !mpf_integer_p(f);
      mpz_set_f(z, f);
      rm_int_from_double(&a, p[0][0], scale);
      wrong += !agrees(&a, z);
      rm_int_from_difference(&a, p[0][0], p[1][1], scale);
      wrong += rm_int_sign(&a) != (p[0][0] > p[1][1]) - (p[0][0] < p[1][1]);
    }
  }
  RT_EQ(wrong, 0);
  mpz_clear(z);
  mpf_clear(f);
}

static void quotients_are_rounded_to_doubles(void)
{
  random_state rnd   = {23};
  int          wrong = 0;
  rm_int       a, b;
  mpq_t        q, got;

  mpq_inits(q, got, NULL);
  for (int round = 0; round < 20000; round++) {
    random_int(&rnd, &a, 1 + random_below(&rnd, 8));
    random_int(&rnd, &b, 1 + random_below(&rnd, 8));
    if (!rm_int_sign(&b)) continue;
    to_gmp(mpq_numref(q), &a);
    to_gmp(mpq_denref(q), &b);
    mpq_canonicalize(q);
    mpq_set_d(got, rm_int_ratio(&a, &b));
    mpq_sub(got, got, q);
    mpq_abs(got, got);
    mpq_abs(q, q);
    mpq_div_2exp(q, q, 50);
    wrong += mpq_cmp(got, q) > 0;
  }
  RT_EQ(wrong, 0);
  mpq_clears(q, got, NULL);
}

RT_MAIN(RT_CASE(sums_and_products_agree_with_gmp), RT_CASE(coordinates_are_integers_at_their_scale),
        RT_CASE(quotients_are_rounded_to_doubles))
