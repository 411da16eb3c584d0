/* residue -- see residue.h. Primes by the test of Miller and Rabin with twelve bases, which is exact below 3e24 (Sorenson and
 * Webster 2017): one odd number in 21 is prime here, and most others are found out by the first base. */
#include "geom/residue.h"

/* Everything but the powers. */
static void set_modulus(rm_modulus *m, uint64_t odd)
{
  uint64_t inverse = odd; /* to 3 bits; each step doubles them */

  for (int k = 0; k < 5; k++) inverse *= 2 - odd * inverse;
  m->prime            = odd;
  m->negative_inverse = (uint64_t)0 - inverse;
  m->one              = ((uint64_t)0 - odd) % odd; /* 2^64 */
}

/* base^exponent for a residue. */
static uint64_t power_of(const rm_modulus *m, uint64_t base, uint64_t exponent)
{
  uint64_t r = m->one;

  for (; exponent; exponent >>= 1) {
    if (exponent & 1) r = rm_residue_mul(m, r, base);
    base = rm_residue_mul(m, base, base);
  }
  return r;
}

/* base as a residue, by doubling and adding. */
static uint64_t small(const rm_modulus *m, int base)
{
  uint64_t r = 0;

  for (int k = 0; k < base; k++) r = rm_residue_add(m, r, m->one);
  return r;
}

static bool is_prime(const rm_modulus *m)
{
  static const int base[12]  = {2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37};
  const uint64_t   minus_one = m->prime - m->one;
  const int        twos      = __builtin_ctzll(m->prime - 1);

  for (int k = 0; k < 12; k++) {
    uint64_t x      = power_of(m, small(m, base[k]), (m->prime - 1) >> twos);
    bool     passes = x == m->one || x == minus_one;

    for (int h = 1; h < twos && !passes; h++) {
      x      = rm_residue_mul(m, x, x);
      passes = x == minus_one;
    }
    if (!passes) return false;
  }
  return true;
}

void rm_modulus_below(rm_modulus *m, uint64_t below)
{
  uint64_t candidate = (below - 2) | 1;

  RM_ASSERT(below <= UINT64_C(1) << 61);
  for (set_modulus(m, candidate); !is_prime(m); set_modulus(m, candidate)) candidate -= 2;
  RM_ASSERT(m->prime > UINT64_C(1) << RM_RESIDUE_BITS);
  m->power[0] = m->one;
  for (int k = 0; k < 64; k++) m->power[0] = rm_residue_add(m, m->power[0], m->power[0]);
  for (int k = 1; k < RM_RESIDUE_POWERS; k++) m->power[k] = rm_residue_add(m, m->power[k - 1], m->power[k - 1]);
}

uint64_t rm_residue_of_plane(const rm_modulus *m, const double a[3], const double b[3], const double c[3])
{
  const double zero[3] = {0, 0, 0};
  uint64_t     u[3], v[3], p[3], n[3], offset, inverse;
  int          k = 0;

  rm_residue_between(m, a, b, u);
  rm_residue_between(m, a, c, v);
  rm_residue_between(m, zero, a, p);
  rm_residue_cross(m, u, v, n);
  offset = rm_residue_dot(m, n, p);
  while (k < 2 && n[k] == 0) k++;
  inverse = power_of(m, n[k], m->prime - 2);
  for (int h = 0; h < 3; h++) n[h] = rm_residue_mul(m, n[h], inverse);
  return rm_hash_word(n[0] ^ rm_hash_word(n[1] ^ rm_hash_word(n[2] ^ rm_hash_word(rm_residue_mul(m, offset, inverse)))));
}
