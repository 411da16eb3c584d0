/* rational -- vectors of GMP rationals, plain and slow: what the predicates are compared with. */
#ifndef RATIONAL_H
#define RATIONAL_H

#include <gmp.h>

typedef struct rational3 {
  mpq_t c[3];
} rational3;

static inline void r3_init(rational3 *v)
{
  for (int k = 0; k < 3; k++) mpq_init(v->c[k]);
}
static inline void r3_clear(rational3 *v)
{
  for (int k = 0; k < 3; k++) mpq_clear(v->c[k]);
}

/* out = b - a */
static inline void r3_between(rational3 *out, const double a[3], const double b[3])
{
  mpq_t x;

  mpq_init(x);
  for (int k = 0; k < 3; k++) {
    mpq_set_d(x, a[k]);
    mpq_set_d(out->c[k], b[k]);
    mpq_sub(out->c[k], out->c[k], x);
  }
  mpq_clear(x);
}

/* out = u x v */
static inline void r3_cross(rational3 *out, const rational3 *u, const rational3 *v)
{
  mpq_t x;

  mpq_init(x);
  for (int k = 0; k < 3; k++) {
    mpq_mul(out->c[k], u->c[(k + 1) % 3], v->c[(k + 2) % 3]);
    mpq_mul(x, u->c[(k + 2) % 3], v->c[(k + 1) % 3]);
    mpq_sub(out->c[k], out->c[k], x);
  }
  mpq_clear(x);
}

/* out = u . v */
static inline void r3_dot(mpq_t out, const rational3 *u, const rational3 *v)
{
  mpq_t x;

  mpq_init(x);
  mpq_set_ui(out, 0, 1);
  for (int k = 0; k < 3; k++) {
    mpq_mul(x, u->c[k], v->c[k]);
    mpq_add(out, out, x);
  }
  mpq_clear(x);
}

/* Sign of the first component that is not zero. */
static inline int r3_first_sign(const rational3 *v)
{
  int sign = 0;

  for (int k = 0; k < 3 && !sign; k++) sign = mpq_sgn(v->c[k]);
  return sign;
}

#endif
