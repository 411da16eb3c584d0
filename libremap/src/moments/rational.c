/* rational -- is a sum of cones, or of areas, exactly zero (DESIGN 2.6)?
 *
 * Coordinates are integers in a unit small enough, a crossing is a quotient of integers, so the sum is a rational number
 * whose denominator is the product of those of its crossings. Its images modulo primes (geom/residue.h) tell: the first one
 * that is not zero proves that it is not; as many zeros as the numerator has words prove that it is. Every crossing is
 * computed from the coordinates again, without rounding, hence without simulation of simplicity: where it is in the limit.
 *
 * About 0.2 us per side and prime. A sum of n crossings of full coordinates has some 3 n words if it is zero. */
#include <math.h>

#include "moments/moments_private.h"

/* A sum of quotients: only the whole of it is divided. */
typedef struct fraction {
  uint64_t num, den;
} fraction;

/* A point relative to an origin, times w. */
typedef struct scaled {
  uint64_t x[3], w;
} scaled;

static void add(const rm_modulus *m, fraction *sum, int times, uint64_t num, uint64_t den)
{
  num      = rm_residue_mul(m, rm_residue_mul(m, num, sum->den), rm_residue_of_int(m, times));
  sum->num = rm_residue_add(m, rm_residue_mul(m, sum->num, den), num);
  sum->den = rm_residue_mul(m, sum->den, den);
}

/* p - o + num / den (q - p). */
static scaled along(const rm_modulus *m, const double *o, const double *p, const uint64_t u[3], uint64_t num, uint64_t den)
{
  scaled s = {.w = den};

  rm_residue_between(m, o, p, s.x);
  for (int c = 0; c < 3; c++) s.x[c] = rm_residue_add(m, rm_residue_mul(m, s.x[c], den), rm_residue_mul(m, u[c], num));
  return s;
}

static scaled vertex_at(const rm_modulus *m, const double *o, const double *v)
{
  scaled s = {.w = m->one};

  rm_residue_between(m, o, v, s.x);
  return s;
}

/* The ends of the edge and the corners of the triangle that cross each other. */
typedef struct line_and_plane {
  const double *point[5];
} line_and_plane;

static line_and_plane what_crosses(const work *w, const locus *p)
{
  const rm_trimesh  *own = w->o->mesh[p->mesh], *other = w->o->mesh[1 - p->mesh];
  const rm_crossing *x = &w->o->trace[p->mesh].crossing[p->crossing];
  const rm_lid      *e = own->edge[x->edge], *t = other->triangle[x->triangle / 2];

  return (line_and_plane){
      {own->vertex[e[0]], own->vertex[e[1]], other->vertex[t[0]], other->vertex[t[1]], other->vertex[t[2]]}};
}

/* The point of an edge that lies in the plane of a triangle t0 t1 t2: parameter n.(t0 - p0) / n.u. */
static scaled located(const work *w, const rm_modulus *m, const double *o, const locus *p)
{
  if (p->vertex) return vertex_at(m, o, p->vertex);
  const line_and_plane of = what_crosses(w, p);
  uint64_t             a[3], b[3], n[3], u[3], down[3];

  rm_residue_between(m, of.point[2], of.point[3], a);
  rm_residue_between(m, of.point[2], of.point[4], b);
  rm_residue_between(m, of.point[0], of.point[2], down);
  rm_residue_between(m, of.point[0], of.point[1], u);
  rm_residue_cross(m, a, b, n);
  return along(m, o, of.point[0], u, rm_residue_dot(m, n, down), rm_residue_dot(m, n, u));
}

/* The same in the plane across an axis: where the line p q meets the line c0 c1. */
static scaled flat_located(const rm_modulus *m, int axis, const double *o, const double *p, const double *q,
                           const double *const line[2])
{
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  uint64_t  u[3], v[3], d[3];

  rm_residue_between(m, p, q, u);
  rm_residue_between(m, line[0], line[1], v);
  rm_residue_between(m, p, line[0], d);
  return along(m, o, p, u, rm_residue_minor(m, d[x], v[y], d[y], v[x]), rm_residue_minor(m, u[x], v[y], u[y], v[x]));
}

/* The image of the sum; false if the prime divides a denominator. */
static bool image(const work *w, const rm_modulus *m, const exact_sum *sum, uint64_t *out)
{
  fraction  f = {0, m->one};
  const int k = sum->axis, x = (k + 1) % 3, y = (k + 2) % 3;

  for (int64_t i = 0; i < sum->num_sides; i++) {
    const polygon_side *s = &w->side[sum->side[i]];
    const scaled        p = located(w, m, sum->origin, &s->from), q = located(w, m, sum->origin, &s->to);
    uint64_t            area[3], apex[3], num;

    if (k >= 0) {
      num = rm_residue_minor(m, p.x[x], q.x[y], p.x[y], q.x[x]);
    } else {
      rm_residue_cross(m, p.x, q.x, area);
      rm_residue_between(m, sum->origin, s->in_plane, apex);
      num = rm_residue_dot(m, apex, area);
    }
    add(m, &f, s->times, num, rm_residue_mul(m, p.w, q.w));
  }
  for (int64_t i = 0; i < sum->num_strips; i++) {
    const strip *s = &sum->strip[i];
    const scaled p = s->from[0] ? flat_located(m, k, sum->origin, s->p, s->q, s->from) : vertex_at(m, sum->origin, s->p);
    const scaled q = s->to[0] ? flat_located(m, k, sum->origin, s->p, s->q, s->to) : vertex_at(m, sum->origin, s->q);

    add(m, &f, sum->strip_sign, rm_residue_minor(m, p.x[x], q.x[y], p.x[y], q.x[x]), rm_residue_mul(m, p.w, q.w));
  }
  *out = f.num;
  return f.den != 0;
}

/* ---- how long the sum can be ------------------------------------------------------------------------------------------- */

static int scale_of(const work *w, const locus *p, int scale)
{
  const line_and_plane of   = p->vertex ? (line_and_plane){{p->vertex}} : what_crosses(w, p);
  const int            more = rm_int_scale(p->vertex ? 1 : 5, of.point);

  return more > scale ? more : scale;
}

/* Bits of the sum times its denominators, as an integer. Coordinates are below 1 in magnitude, integers below 2^s in units
 * of 2^-s. Differences then have s + 1 bits, numerators and denominators of parameters in space 3 s + 6, in a plane 2 s + 3;
 * points are within the box of all, so a cone of unit apex has 2 s + 4, any 3 s + 8; 64 more cover the number of terms. All
 * polygons are closed, so that every denominator belongs to the beginning of a side. */
static int64_t length(const work *w, const exact_sum *sum)
{
  int     s        = rm_int_scale(1, &sum->origin);
  int64_t in_space = 0, in_plane = 0;

  for (int64_t i = 0; i < sum->num_sides; i++) {
    const polygon_side *at = &w->side[sum->side[i]];

    s = scale_of(w, &at->from, s);
    s = scale_of(w, &at->to, s);
    if (sum->axis < 0 && rm_int_scale(1, &at->in_plane) > s) s = rm_int_scale(1, &at->in_plane);
    in_space += at->from.vertex == NULL;
  }
  for (int64_t i = 0; i < sum->num_strips; i++) {
    const strip        *at       = &sum->strip[i];
    const double *const known[6] = {at->p,
                                    at->q,
                                    at->from[0] ? at->from[0] : at->p,
                                    at->from[1] ? at->from[1] : at->p,
                                    at->to[0] ? at->to[0] : at->p,
                                    at->to[1] ? at->to[1] : at->p};
    const int           more     = rm_int_scale(6, known);

    if (more > s) s = more;
    in_plane += at->from[0] != NULL;
  }
  if (s < 0) s = 0;
  return 64 + (sum->axis < 0 ? 3 * s + 8 : 2 * s + 4) + in_space * (3 * s + 6) + in_plane * (2 * s + 3);
}

const rm_modulus *rm_moments_modulus(work *w, int64_t k)
{
  if (k == w->num_moduli) {
    if ((w->status = rm_grow(&w->modulus, &w->modulus_room, k + 1, sizeof *w->modulus)) != REMAP_OK) return NULL;
    rm_modulus_below(&w->modulus[k], k ? w->modulus[k - 1].prime : UINT64_C(1) << 61);
    w->num_moduli++;
  }
  return &w->modulus[k];
}

bool rm_moments_is_zero(work *w, const exact_sum *sum)
{
  int64_t bits = sum->num_sides + sum->num_strips > 0 ? -1 : 0; /* not known yet */

  for (int64_t k = 0; bits; k++) { /* denominators have too few prime factors to make more than that many images useless */
    const rm_modulus *m = rm_moments_modulus(w, k);
    uint64_t          at;

    if (!m) return true;
    if (!image(w, m, sum, &at)) continue;
    if (at) return false;
    if (bits < 0) bits = length(w, sum);
    bits = bits > RM_RESIDUE_BITS ? bits - RM_RESIDUE_BITS : 0;
  }
  return true;
}
