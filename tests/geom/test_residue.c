/* Integers modulo primes of 61 bits against GMP's. */
#include "geom/geom.h"
#include "geom/residue.h"
#include "hard_points.h"
#include "rt.h"

#include <gmp.h>

/* The residue as the integer it stands for: without its factor 2^64. */
static uint64_t plain(const rm_modulus *m, uint64_t r) { return rm_residue_mul(m, r, 1); }

/* x 2^RM_INT_SCALE, an integer. */
static void exactly(mpz_t out, double x)
{
  mpq_t q;

  mpq_init(q);
  mpq_set_d(q, x);
  mpq_mul_2exp(q, q, RM_INT_SCALE);
  mpz_set_q(out, q);
  mpq_clear(q);
}

static void moduli_are_all_the_primes_below_a_bound(void)
{
  uint64_t below = UINT64_C(1) << 61;
  mpz_t    x;

  mpz_init(x);
  for (int k = 0; k < 200; k++) {
    rm_modulus m;

    rm_modulus_below(&m, below);
    for (uint64_t n = below - 1; n > m.prime; n--) {
      mpz_set_ui(x, n);
      if (mpz_probab_prime_p(x, 30)) rt_fail_(__FILE__, __LINE__, "%llu is a prime and was left out", (unsigned long long)n);
    }
    mpz_set_ui(x, m.prime);
    RT_CHECK(mpz_probab_prime_p(x, 30) > 0);
    below = m.prime;
  }
  mpz_clear(x);
}

/* A coordinate of any admitted size, with few or many bits. */
static double coordinate(random_state *rnd)
{
  const double x = random_below(rnd, 4) ? (double)(int64_t)random_word(rnd) : random_below(rnd, 200) - 100;
  return random_below(rnd, 20) ? ldexp(x, -60 - random_below(rnd, 30)) : 0;
}

static void determinants_agree_with_gmp(void)
{
  random_state rnd   = {5};
  uint64_t     below = UINT64_C(1) << 61;
  int          wrong = 0;
  mpz_t        u[3], v[3], p[3], term, det;
  rm_modulus   m;

  mpz_inits(term, det, NULL);
  for (int c = 0; c < 3; c++) mpz_inits(u[c], v[c], p[c], NULL);
  for (int round = 0; round < 20000; round++) {
    double   a[3], b[3], o[3];
    uint64_t s[3], t[3], n[3], q[3];

    if (round % 1000 == 0) rm_modulus_below(&m, below), below = m.prime;
    for (int c = 0; c < 3; c++) {
      a[c] = coordinate(&rnd), b[c] = coordinate(&rnd), o[c] = coordinate(&rnd);
      exactly(p[c], o[c]);
      exactly(u[c], a[c]), mpz_sub(u[c], u[c], p[c]);
      exactly(v[c], b[c]), mpz_sub(v[c], v[c], p[c]);
      q[c] = rm_residue_of(&m, o[c]);
    }
    rm_residue_between(&m, o, a, s);
    rm_residue_between(&m, o, b, t);
    rm_residue_cross(&m, s, t, n);
    mpz_set_ui(det, 0);
    for (int c = 0; c < 3; c++) {
      mpz_mul(term, u[(c + 1) % 3], v[(c + 2) % 3]);
      mpz_submul(term, u[(c + 2) % 3], v[(c + 1) % 3]);
      mpz_addmul(det, term, p[c]);
    }
    wrong += plain(&m, rm_residue_dot(&m, n, q)) != mpz_fdiv_ui(det, m.prime);
  }
  RT_EQ(wrong, 0);
  for (int c = 0; c < 3; c++) mpz_clears(u[c], v[c], p[c], NULL);
  mpz_clears(term, det, NULL);
}

static void small_integers_are_themselves(void)
{
  rm_modulus m;

  rm_modulus_below(&m, UINT64_C(1) << 61);
  for (int x = 0; x < 1000; x++) {
    RT_EQ(plain(&m, rm_residue_of_int(&m, x)), (uint64_t)x);
    RT_EQ(rm_residue_add(&m, rm_residue_of_int(&m, x), rm_residue_of_int(&m, -x)), 0);
  }
  RT_EQ(plain(&m, m.one), 1);
  RT_EQ(plain(&m, rm_residue_of(&m, 0x1p-100)), UINT64_C(1) << 52);
  RT_EQ(rm_residue_of(&m, -0.0), 0);
}

static void planes_have_their_keys_in_common(void)
{
  random_state rnd = {9};
  rm_modulus   m;
  uint64_t     last = 0;

  rm_modulus_below(&m, UINT64_C(1) << 61);
  for (int round = 0; round < 2000; round++) {
    double p[4][3], other[3]; /* points of one plane: p0 + i u + j v with small i, j */

    for (int c = 0; c < 3; c++) {
      const double o = random_below(&rnd, 1000), u = random_below(&rnd, 64) - 32, v = random_below(&rnd, 64) - 32;
      for (int k = 0; k < 4; k++) p[k][c] = (o + (k % 2 ? 3 : -1) * u + (k / 2 ? 5 : 2) * v) / 1024;
      other[c] = p[3][c];
    }
    other[round % 3] += 0x1p-40;
    if (rm_cross_sign(p[0], p[1], p[0], p[2], 0) == 0) continue;
    const uint64_t key = rm_residue_of_plane(&m, p[0], p[1], p[2]);
    RT_CHECK(key == rm_residue_of_plane(&m, p[3], p[1], p[0]) && key == rm_residue_of_plane(&m, p[2], p[3], p[1]));
    if (rm_orient3d(p[0], p[1], p[2], other)) RT_CHECK(key != rm_residue_of_plane(&m, p[0], p[1], other));
    RT_CHECK(key != last);
    last = key;
  }
}

RT_MAIN(RT_CASE(moduli_are_all_the_primes_below_a_bound), RT_CASE(determinants_agree_with_gmp),
        RT_CASE(small_integers_are_themselves), RT_CASE(planes_have_their_keys_in_common))
