/* Signs of the geom room against rational arithmetic, on points that make them difficult. */
#include "geom/exact.h"
#include "geom/geom.h"
#include "hard_points.h"
#include "rational.h"
#include "rt.h"

enum { ROUNDS = 40000 };

static rational3 u, v, w, normal;
static mpq_t     det;

static void begin(void) { r3_init(&u), r3_init(&v), r3_init(&w), r3_init(&normal), mpq_init(det); }
static void end(void) { r3_clear(&u), r3_clear(&v), r3_clear(&w), r3_clear(&normal), mpq_clear(det); }

static void compiled_arithmetic_is_exact_where_it_must_be(void) { RT_CHECK(rm_geom_selftest()); }

static void orientation_agrees_with_rationals(void)
{
  random_state rnd   = {1};
  int          wrong = 0, zeros = 0;
  double       p[4][3];

  begin();
  for (int round = 0; round < NUM_KINDS * ROUNDS; round++) {
    hard_points(&rnd, round % NUM_KINDS, p, 4);
    r3_between(&u, p[0], p[1]);
    r3_between(&v, p[0], p[2]);
    r3_between(&w, p[0], p[3]);
    r3_cross(&normal, &u, &v);
    r3_dot(det, &normal, &w);
    wrong += rm_orient3d(p[0], p[1], p[2], p[3]) != mpq_sgn(det);
    zeros += mpq_sgn(det) == 0;
  }
  RT_EQ(wrong, 0);
  RT_CHECK(zeros > ROUNDS);
  end();
}

static void point_sides_agree_with_rationals_and_their_derivatives(void)
{
  random_state rnd   = {2};
  int          wrong = 0, zeros = 0, flat = 0;
  double       p[4][3];

  begin();
  for (int round = 0; round < NUM_KINDS * ROUNDS; round++) {
    const int moved      = round & 1 ? 1 : -1;
    bool      degenerate = round & 2;
    int       want;

    hard_points(&rnd, round / 2 % NUM_KINDS, p, 4);
    r3_between(&u, p[0], p[1]);
    r3_between(&v, p[0], p[2]);
    r3_between(&w, p[0], p[3]);
    r3_cross(&normal, &u, &v);
    r3_dot(det, &normal, &w);
    want = mpq_sgn(det) ? mpq_sgn(det) : -moved * r3_first_sign(&normal);
    wrong += rm_point_side(p[0], p[1], p[2], p[3], moved, &degenerate) != want || degenerate != (mpq_sgn(det) == 0);
    wrong += rm_point_side(p[0], p[1], p[2], p[3], moved, NULL) != want;
    zeros += mpq_sgn(det) == 0;
    flat += want == 0;
  }
  RT_EQ(wrong, 0);
  RT_CHECK(zeros > ROUNDS && flat > ROUNDS / 10);
  end();
}

static void edge_sides_agree_with_rationals_and_their_derivatives(void)
{
  random_state rnd   = {3};
  int          wrong = 0, zeros = 0, parallel = 0;
  double       p[4][3];

  begin();
  for (int round = 0; round < NUM_KINDS * ROUNDS; round++) {
    const int moved      = round & 1 ? 1 : -1;
    bool      degenerate = round & 2;
    int       want;

    hard_points(&rnd, round / 2 % NUM_KINDS, p, 4);
    if (random_below(&rnd, 10) == 0) { /* the same edge, either way round */
      const int way = random_below(&rnd, 2);

      memcpy(p[2 + way], p[0], sizeof *p);
      memcpy(p[3 - way], p[1], sizeof *p);
    }
    r3_between(&u, p[0], p[1]);
    r3_between(&v, p[2], p[3]);
    r3_between(&w, p[0], p[2]);
    r3_cross(&normal, &w, &v);
    r3_dot(det, &normal, &u);
    r3_cross(&normal, &v, &u);
    want = mpq_sgn(det) ? mpq_sgn(det) : moved * r3_first_sign(&normal);
    wrong += rm_edge_side(p[0], p[1], p[2], p[3], moved, &degenerate) != want || degenerate != (mpq_sgn(det) == 0);
    wrong += rm_edge_side(p[0], p[1], p[2], p[3], moved, NULL) != want;
    zeros += mpq_sgn(det) == 0;
    parallel += want == 0;
  }
  RT_EQ(wrong, 0);
  RT_CHECK(zeros > ROUNDS && parallel > ROUNDS / 10);
  end();
}

/* Both signs of one geometric question are asked of different operands: they may not contradict each other. */
static void an_edge_that_runs_inside_three_edges_crosses_their_triangle(void)
{
  random_state rnd            = {4};
  int          contradictions = 0, crossed = 0;
  double       p[5][3];

  for (int round = 0; round < NUM_KINDS * ROUNDS; round++) {
    const int moved = round & 1 ? 1 : -1;
    int       side[3], from, to;

    hard_points(&rnd, round / 2 % NUM_KINDS, p, 5);
    for (int k = 0; k < 3; k++) side[k] = rm_edge_side(p[3], p[4], p[k], p[(k + 1) % 3], moved, NULL);
    from = rm_point_side(p[0], p[1], p[2], p[3], moved, NULL);
    to   = rm_point_side(p[0], p[1], p[2], p[4], moved, NULL);
    if (side[0] == 0 || side[0] != side[1] || side[1] != side[2]) continue;
    contradictions += from == to ? 0 : from != -side[0] || to != side[0];
    crossed += from == -to && from;
  }
  RT_EQ(contradictions, 0);
  RT_CHECK(crossed > ROUNDS / 10);
}

static void determinants_in_double_double_keep_their_bound(void)
{
  random_state rnd   = {5};
  int          wrong = 0;
  mpq_t        term, sum;
  double       p[4][3];

  begin();
  mpq_init(term), mpq_init(sum);
  for (int round = 0; round < NUM_KINDS * ROUNDS / 4; round++) {
    rm_dd got;

    hard_points(&rnd, round % NUM_KINDS, p, 4);
    got = rm_det_dd(p[0], p[1], p[2], p[3]);
    r3_between(&u, p[0], p[1]);
    r3_between(&v, p[0], p[2]);
    r3_between(&w, p[0], p[3]);
    r3_cross(&normal, &v, &w);
    r3_dot(det, &normal, &u);
    mpq_set_d(term, got.hi);
    mpq_sub(det, det, term);
    mpq_set_d(term, got.lo);
    mpq_sub(det, det, term);
    mpq_set_ui(sum, 0, 1);
    for (int i = 0; i < 3; i++) /* sum of absolute terms */
      for (int j = 0; j < 3; j++) {
        if (i == j) continue;
        mpq_mul(term, u.c[i], v.c[j]);
        mpq_mul(term, term, w.c[3 - i - j]);
        mpq_abs(term, term);
        mpq_add(sum, sum, term);
      }
    mpq_div_2exp(sum, sum, 95);
    mpq_abs(det, det);
    wrong += mpq_cmp(det, sum) > 0;
    wrong += fabs(got.lo) > fabs(got.hi) * 0x1p-53;
  }
  RT_EQ(wrong, 0);
  mpq_clear(term), mpq_clear(sum);
  end();
}

RT_MAIN(RT_CASE(compiled_arithmetic_is_exact_where_it_must_be), RT_CASE(orientation_agrees_with_rationals),
        RT_CASE(point_sides_agree_with_rationals_and_their_derivatives),
        RT_CASE(edge_sides_agree_with_rationals_and_their_derivatives),
        RT_CASE(an_edge_that_runs_inside_three_edges_crosses_their_triangle),
        RT_CASE(determinants_in_double_double_keep_their_bound))
