/* Order and parameter of crossings against rational arithmetic. */
#include "geom/geom.h"
#include "hard_points.h"
#include "rational.h"
#include "rt.h"

enum { ROUNDS = 12000 };

/* A crossing in rationals: values at powers 0..3 of the infinitesimal. */
typedef struct position {
  mpq_t power[4], den;
} position;

static rational3 u, side1, side2, to_t0, normal;

static void begin(position *a, position *b)
{
  r3_init(&u), r3_init(&side1), r3_init(&side2), r3_init(&to_t0), r3_init(&normal);
  for (int k = 0; k < 4; k++) mpq_init(a->power[k]), mpq_init(b->power[k]);
  mpq_init(a->den), mpq_init(b->den);
}
static void end(position *a, position *b)
{
  r3_clear(&u), r3_clear(&side1), r3_clear(&side2), r3_clear(&to_t0), r3_clear(&normal);
  for (int k = 0; k < 4; k++) mpq_clear(a->power[k]), mpq_clear(b->power[k]);
  mpq_clear(a->den), mpq_clear(b->den);
}

/* False if the line is parallel to the plane. */
static bool locate(position *at, const double p0[3], const double p1[3], double t[3][3], int moved)
{
  r3_between(&u, p0, p1);
  r3_between(&side1, t[0], t[1]);
  r3_between(&side2, t[0], t[2]);
  r3_between(&to_t0, p0, t[0]);
  r3_cross(&normal, &side1, &side2);
  r3_dot(at->den, &normal, &u);
  if (mpq_sgn(at->den) == 0) return false;
  r3_dot(at->power[0], &normal, &to_t0);
  mpq_div(at->power[0], at->power[0], at->den);
  for (int k = 0; k < 3; k++) {
    mpq_div(at->power[k + 1], normal.c[k], at->den);
    if (moved < 0) mpq_neg(at->power[k + 1], at->power[k + 1]);
  }
  return true;
}

static int order_of(const position *a, const position *b)
{
  int order = 0;

  for (int k = 0; k < 4 && !order; k++) order = mpq_cmp(a->power[k], b->power[k]);
  return (order > 0) - (order < 0);
}

static int library_order(double (*p)[3], double s[3][3], double t[3][3], int moved)
{
  return rm_crossing_order(p[0], p[1], (const double(*)[3])s, (const double(*)[3])t, moved);
}

static void crossings_come_in_the_order_of_rationals_and_their_derivatives(void)
{
  random_state rnd = {11};
  position     a, b;
  int          wrong = 0, compared = 0, ties = 0, together = 0;
  double       p[8][3];

  begin(&a, &b);
  for (int round = 0; round < NUM_KINDS * ROUNDS; round++) {
    const int moved = round & 1 ? 1 : -1;
    int       want;

    hard_points(&rnd, round / 2 % NUM_KINDS, p, 8);
    if (random_below(&rnd, 3) == 0) memcpy(p[5], p[2], sizeof *p); /* planes that share a vertex, */
    if (random_below(&rnd, 3) == 0) memcpy(p[5], p[2], sizeof *p), memcpy(p[7], p[3], sizeof *p); /* an edge, */
    if (random_below(&rnd, 6) == 0) memcpy(p[6], p[4], sizeof *p);                                /* or all there is */
    if (random_below(&rnd, 6) == 0) memcpy(p[0], p[2 + random_below(&rnd, 3)], sizeof *p); /* the line starts in a vertex */
    if (!locate(&a, p[0], p[1], p + 2, moved) || !locate(&b, p[0], p[1], p + 5, moved)) continue;
    want = order_of(&a, &b);
    wrong += library_order(p, p + 2, p + 5, moved) != want;
    wrong += library_order(p, p + 5, p + 2, moved) != -want;
    compared++;
    ties += mpq_equal(a.power[0], b.power[0]) != 0;
    together += want == 0;
  }
  RT_EQ(wrong, 0);
  RT_CHECK(compared > NUM_KINDS * ROUNDS / 3 && ties > ROUNDS / 2 && together > ROUNDS / 10);
  end(&a, &b);
}

static void parameters_are_accurate_and_stay_on_the_edge(void)
{
  random_state rnd = {12};
  position     a, b;
  mpq_t        error, bound;
  int          inaccurate = 0, outside = 0, inside = 0;
  double       p[5][3];

  begin(&a, &b);
  mpq_init(error), mpq_init(bound);
  for (int round = 0; round < NUM_KINDS * ROUNDS * 2; round++) {
    double got;

    hard_points(&rnd, round % NUM_KINDS, p, 5);
    if (!locate(&a, p[0], p[1], p + 2, 1)) continue;
    got = rm_crossing_parameter(p[0], p[1], p[2], p[3], p[4]);
    outside += !(got >= 0 && got <= 1);
    if (mpq_cmp_ui(a.power[0], 0, 1) < 0) mpq_set_ui(a.power[0], 0, 1);
    if (mpq_cmp_ui(a.power[0], 1, 1) > 0) mpq_set_ui(a.power[0], 1, 1);
    inside += mpq_cmp_ui(a.power[0], 0, 1) > 0 && mpq_cmp_ui(a.power[0], 1, 1) < 0;
    mpq_set_d(error, got);
    mpq_sub(error, error, a.power[0]);
    mpq_abs(error, error);
    mpq_div_2exp(bound, a.power[0], 48); /* 2^-50 from numerator and denominator each, and the division */
    inaccurate += mpq_cmp(error, bound) > 0;
  }
  RT_EQ(outside, 0);
  RT_EQ(inaccurate, 0);
  RT_CHECK(inside > ROUNDS);
  mpq_clear(error), mpq_clear(bound);
  end(&a, &b);
}

static void an_edge_that_ends_in_a_corner_is_crossed_at_its_very_end(void)
{
  random_state rnd   = {13};
  int          wrong = 0;
  double       p[5][3];

  for (int round = 0; round < 1000; round++) {
    hard_points(&rnd, 0, p, 5);
    memcpy(p[4], p[2], sizeof *p);
    wrong += rm_crossing_parameter(p[2], p[1], p[0], p[4], p[3]) != 0;
    wrong += rm_crossing_parameter(p[1], p[2], p[0], p[3], p[4]) != 1;
  }
  RT_EQ(wrong, 0);
}

RT_MAIN(RT_CASE(crossings_come_in_the_order_of_rationals_and_their_derivatives),
        RT_CASE(parameters_are_accurate_and_stay_on_the_edge),
        RT_CASE(an_edge_that_ends_in_a_corner_is_crossed_at_its_very_end))
