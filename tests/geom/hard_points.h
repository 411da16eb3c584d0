/* hard_points -- points that make signs difficult: random, on coarse grids, of wildly different magnitude, nearly or exactly
 * coplanar and collinear, with shared coordinates, an ulp apart, far from the origin. Coordinates are as geom.h admits them. */
#ifndef HARD_POINTS_H
#define HARD_POINTS_H

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { NUM_KINDS = 10 };

typedef struct random_state {
  uint64_t word;
} random_state;

static inline uint64_t random_word(random_state *rnd) /* splitmix64 */
{
  uint64_t x = rnd->word += UINT64_C(0x9e3779b97f4a7c15);

  x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
  x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
  return x ^ x >> 31;
}
static inline int    random_below(random_state *rnd, int n) { return (int)(random_word(rnd) % (uint64_t)n); }
static inline double random_unit(random_state *rnd) { return (double)(int64_t)random_word(rnd) * 0x1p-63; } /* -1..1 */

/* x, if geom.h admits it, else the nearest kind of thing that is. */
static inline double admit(double x) { return fabs(x) < 0x1p-100 ? 0 : fabs(x) > 0x1p10 ? copysign(0x1p10, x) : x; }

/* n points of one kind. Later points depend on the earlier ones, so that shorter prefixes are hard as well. */
static inline void hard_points(random_state *rnd, int kind, double (*p)[3], int n)
{
  const double size = kind == 2 ? 1 : ldexp(1, -random_below(rnd, 12));

  for (int i = 0; i < n; i++)
    for (int k = 0; k < 3; k++) {
      double x = random_unit(rnd) * size;

      if (kind == 1) x = random_below(rnd, 5) - 2;           /* a tiny grid */
      if (kind == 2) x = ldexp(x, -random_below(rnd, 101));  /* any magnitude */
      if (kind == 3) x = (random_below(rnd, 41) - 20) * 0.1; /* a grid that doubles cannot hold */
      if (kind == 4) x = 1000 + floor(x * 0x1p12) * 0x1p-10 + random_unit(rnd) * (random_below(rnd, 2) ? 0 : 0x1p-40); /* far */
      if (kind == 5 && random_below(rnd, 3) == 0) x = 0x1p-57 * random_unit(rnd); /* zero, but for noise */
      p[i][k] = x;
    }
  if (kind == 6 || kind == 7) /* shared coordinates, in 7 an ulp apart */
    for (int i = 1; i < n; i++)
      for (int k = 0; k < 3; k++) {
        if (random_below(rnd, 2)) p[i][k] = p[random_below(rnd, i)][k];
        if (kind == 7 && random_below(rnd, 4) == 0) p[i][k] = nextafter(p[i][k], random_unit(rnd));
      }
  if (kind == 8) /* in one oblique plane, up to rounding */
    for (int i = 3; i < n; i++) {
      const double a = random_unit(rnd), b = random_below(rnd, 3) ? random_unit(rnd) : 0;

      for (int k = 0; k < 3; k++) p[i][k] = p[0][k] + a * (p[1][k] - p[0][k]) + b * (p[2][k] - p[0][k]);
    }
  if (kind == 9) { /* in one oblique plane, exactly, often on lines */
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < 3; k++) p[i][k] = floor(p[i][k] / size * 0x1p20);
    for (int i = 3; i < n; i++) {
      const int a = random_below(rnd, 7) - 3, b = random_below(rnd, 3) - 1;

      for (int k = 0; k < 3; k++) p[i][k] = p[0][k] + a * (p[1][k] - p[0][k]) + b * (p[2][k] - p[0][k]);
    }
    for (int i = 0; i < n; i++)
      for (int k = 0; k < 3; k++) p[i][k] *= 0x1p-20;
  }
  if (random_below(rnd, 4) == 0 && n > 1) memcpy(p[n - 1], p[random_below(rnd, n - 1)], sizeof *p); /* a shared vertex */
  for (int i = 0; i < n; i++)
    for (int k = 0; k < 3; k++) p[i][k] = admit(p[i][k]);
}

#endif
