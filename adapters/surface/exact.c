/* exact -- signs of determinants of coordinates. A floating-point estimate with an error bound decides nearly always; the
 * rest is summed exactly, as an expansion of doubles that do not overlap (Shewchuk, "Adaptive precision floating-point
 * arithmetic", 1997). Only additions and multiplications in round-to-nearest, no fused operations. */
#include "surface_private.h"

#include <math.h>

enum { MOST = 256 }; /* components: three products of three differences need 192 */

typedef struct expansion {
  int    n;
  double c[MOST]; /* ascending in magnitude, none zero, no bits in common: their sum is the value */
} expansion;

static double two_sum(double a, double b, double *rest)
{
  const double sum = a + b, bb = sum - a;

  *rest = (a - (sum - bb)) + (b - bb);
  return sum;
}

static double two_product(double a, double b, double *rest)
{
  const double product = a * b, p = 0x8000001p0 * a, q = 0x8000001p0 * b;
  const double ah = p - (p - a), bh = q - (q - b), al = a - ah, bl = b - bh;

  *rest = ((ah * bh - product) + ah * bl + al * bh) + al * bl;
  return product;
}

static void add(expansion *e, double b)
{
  int n = 0;

  for (int i = 0; i < e->n; i++) {
    double rest;

    b = two_sum(b, e->c[i], &rest);
    if (rest != 0) e->c[n++] = rest;
  }
  if (b != 0) e->c[n++] = b;
  e->n = n;
}

/* e += a b */
static void add_product(expansion *e, double a, double b)
{
  double rest, product = two_product(a, b, &rest);

  add(e, rest);
  add(e, product);
}

/* e += a b c of three differences, each a sum of two doubles. */
static void add_product3(expansion *e, const double a[2], const double b[2], const double c[2])
{
  expansion ab;

  ab.n = 0;
  for (int i = 0; i < 2; i++)
    for (int j = 0; j < 2; j++) add_product(&ab, a[i], b[j]);
  for (int i = 0; i < ab.n; i++)
    for (int j = 0; j < 2; j++) add_product(e, ab.c[i], c[j]);
}

/* As few components as can be, so that a long sum stays short. */
static void compress(expansion *e)
{
  double kept[MOST], q;
  int    n = 0, m = 0;

  if (!e->n) return;
  q = e->c[e->n - 1];
  for (int i = e->n - 2; i >= 0; i--) { /* from the top: what is complete goes to kept, greatest first */
    double rest;

    q = two_sum(q, e->c[i], &rest);
    if (rest == 0) continue;
    kept[n++] = q;
    q         = rest;
  }
  kept[n++] = q;
  for (int i = n - 2; i >= 0; i--) {
    double rest;

    q = two_sum(kept[i], q, &rest);
    if (rest != 0) e->c[m++] = rest;
  }
  e->c[m++] = q;
  e->n      = m;
}

static int sign_of(const expansion *e)
{
  const double top = e->n ? e->c[e->n - 1] : 0.0;

  return (top > 0) - (top < 0);
}

/* Rows u, v, w of the differences a - d, b - d, c - d; their determinant is added to e with that sign. */
static void add_det(expansion *e, const double *a, const double *b, const double *c, const double *d)
{
  const double *const p[3] = {a, b, c};
  double              m[3][3][2], back[2];

  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) m[i][k][0] = two_sum(p[i][k], -d[k], &m[i][k][1]);
  for (int k = 0; k < 3; k++) {
    const int x = (k + 1) % 3, y = (k + 2) % 3;

    back[0] = -m[1][y][0];
    back[1] = -m[1][y][1];
    add_product3(e, m[1][x], m[2][y], m[0][k]);
    add_product3(e, back, m[2][x], m[0][k]);
  }
}

/* The turn where the estimate does not decide. */
static int exact_turn(const double *a, const double *b, const double *c, int x, int y)
{
  expansion e;

  e.n = 0;
  add_product(&e, a[x], b[y]);
  add_product(&e, -a[y], b[x]);
  add_product(&e, b[x], c[y]);
  add_product(&e, -b[y], c[x]);
  add_product(&e, c[x], a[y]);
  add_product(&e, -c[y], a[x]);
  return sign_of(&e);
}

int rs_turn(const double *a, const double *b, const double *c, int axis)
{
  const int    x = (axis + 1) % 3, y = (axis + 2) % 3;
  const double left = (a[x] - c[x]) * (b[y] - c[y]), right = (a[y] - c[y]) * (b[x] - c[x]);
  const double bound = 4e-16 * (fabs(left) + fabs(right));

  if (left - right > bound) return 1;
  if (left - right < -bound) return -1;
  return exact_turn(a, b, c, x, y);
}

/* The determinant of a - d, b - d, c - d and a bound on its error. */
static double det(const double *a, const double *b, const double *c, const double *d, double *bound)
{
  double u[3], v[3], w[3], sum = 0, size = 0;

  for (int k = 0; k < 3; k++) {
    u[k] = a[k] - d[k];
    v[k] = b[k] - d[k];
    w[k] = c[k] - d[k];
  }
  for (int k = 0; k < 3; k++) {
    const double p = v[(k + 1) % 3] * w[(k + 2) % 3], q = v[(k + 2) % 3] * w[(k + 1) % 3];

    sum += u[k] * (p - q);
    size += fabs(u[k]) * (fabs(p) + fabs(q));
  }
  *bound = 8e-16 * size;
  return sum;
}

/* The side where the estimate does not decide. */
static int exact_side(const double *a, const double *b, const double *c, const double *d)
{
  expansion e;

  e.n = 0;
  add_det(&e, a, b, c, d);
  return sign_of(&e);
}

int rs_side(const double *a, const double *b, const double *c, const double *d)
{
  double       bound;
  const double estimate = det(a, b, c, d, &bound);

  return fabs(estimate) > bound ? (estimate > 0) - (estimate < 0) : exact_side(a, b, c, d);
}

int rs_volume_sign(const double *xyz, const int64_t (*corner)[3], int64_t num)
{
  const double *o   = num ? xyz + 3 * corner[0][0] : NULL;
  double        sum = 0, error = 0;
  expansion     e = {.n = 0};

  for (int64_t t = 0; t < num; t++) {
    double       bound;
    const double part = det(xyz + 3 * corner[t][0], xyz + 3 * corner[t][1], xyz + 3 * corner[t][2], o, &bound);

    sum += part;
    error += bound + 0x1p-52 * fabs(sum);
  }
  if (fabs(sum) > 1.01 * error) return (sum > 0) - (sum < 0);
  for (int64_t t = 0; t < num; t++) {
    add_det(&e, xyz + 3 * corner[t][0], xyz + 3 * corner[t][1], xyz + 3 * corner[t][2], o);
    compress(&e);
  }
  return sign_of(&e);
}
