/* remap_move against a fresh build of the meshes where they went: the same bits of pairs, coverage, statistics and fields, for
 * one mesh or both, by coordinates or by a matrix, for steps so small that much is kept and for jumps; what it refuses; and
 * that memory does not grow. */
#include <remap/remap.h>
#include "heap.h"
#include "meshes.h"
#include "rt.h"

typedef struct world {
  remap_context *ctx;
  tm_mesh       *mine[2];
} world;

static tm_mesh *make(int side)
{
  static const double away[12] = {1, 0, 0, .25, 0, 1, 0, .2, 0, 0, 1, .3};
  tm_mesh *m = side ? tm_mixed((int[]){4, 4, 5}, tm_warp, &(tm_warping){0.02, 0.1})
                    : tm_hexahedra((int[]){5, 4, 4}, tm_warp, &(tm_warping){0.03, 0.7});

  if (side) tm_move(m, tm_affine, away);
  return m;
}

/* The same matrix arithmetic as the library promises. */
static void put(double *to, const double *from, int64_t n, const double m[12])
{
  for (int64_t i = 0; i < n; i++)
    for (int r = 0; r < 3; r++)
      to[3 * i + r] = m[4 * r] * from[3 * i] + m[4 * r + 1] * from[3 * i + 1] + m[4 * r + 2] * from[3 * i + 2] + m[4 * r + 3];
}

/* A small rotation about an axis by lot, and a shift; now and then a jump that changes the scale of coordinates. */
static void draw(uint64_t *state, bool far, double m[12])
{
  const double angle = .001 * (double)tm_random(state, 400), c = cos(angle), s = sin(angle);
  const int    a     = (int)tm_random(state, 3), b = (a + 1) % 3, z = (a + 2) % 3;

  for (int k = 0; k < 12; k++) m[k] = 0;
  m[4 * a + a] = m[4 * b + b] = c;
  m[4 * a + b] = -s;
  m[4 * b + a] = s;
  m[4 * z + z] = 1;
  for (int r = 0; r < 3; r++) m[4 * r + 3] = .001 * (double)tm_random(state, 200) + (far ? 3 * r : 0);
}

/* The coordinates of a side's nodes, moved. */
static double *put_all(const world *w, int side, const double m[12])
{
  const int64_t n   = w->mine[side]->view.num_nodes;
  double       *xyz = tm_alloc_(3 * n, sizeof *xyz);

  put(xyz, w->mine[side]->xyz, n, m);
  return xyz;
}

/* Hand these coordinates of a side to a context that is new. */
static void lend(world *w, int side, double *xyz)
{
  free(w->mine[side]->xyz);
  w->mine[side]->view.node_xyz = w->mine[side]->xyz = xyz;
}

/* A world whose meshes are set but not built. */
static void start_world(world *w, uint64_t seed)
{
  RT_EQ(remap_create(MPI_COMM_WORLD, NULL, &w->ctx), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    tm_mesh *whole = make(side);
    int     *deal  = tm_deal(whole, rt_size(), TM_RANDOM, seed);
    w->mine[side]  = tm_part(whole, deal, rt_rank(), seed);
    tm_free(whole), free(deal);
  }
}

static void build_world(world *w)
{
  for (int side = 0; side < 2; side++) RT_EQ(remap_set_mesh(w->ctx, side, &w->mine[side]->view), REMAP_OK);
  RT_EQ(remap_build(w->ctx), REMAP_OK);
}

static void open_world(world *w, const double (*where)[12], uint64_t seed)
{
  start_world(w, seed);
  for (int side = 0; side < 2 && where; side++) lend(w, side, put_all(w, side, where[side]));
  build_world(w);
}

static void close_world(world *w)
{
  remap_destroy(&w->ctx);
  for (int side = 0; side < 2; side++) tm_free(w->mine[side]);
}

static bool same(const void *a, const void *b, int64_t n, size_t size) { return n == 0 || memcmp(a, b, (size_t)n * size) == 0; }

static void compare(world *a, world *b)
{
  remap_stats    s[2];
  remap_transfer how;

  RT_EQ(remap_get_stats(a->ctx, &s[0]), REMAP_OK);
  RT_EQ(remap_get_stats(b->ctx, &s[1]), REMAP_OK);
  RT_CHECK((s[0].crossings > 0) == (s[1].crossings > 0));
  RT_NEAR(s[0].overlap_volume, s[1].overlap_volume, 0.0);
  remap_transfer_default(&how);
  how.on_uncovered = s[0].pairs > 0 ? REMAP_UNCOVERED_NEAREST : REMAP_UNCOVERED_FILL;
  for (int d = 0; d < 2; d++) {
    const int64_t      ng = a->mine[d]->view.num_cells, nr = a->mine[1 - d]->view.num_cells;
    remap_pairs_view   p[2];
    double            *u = tm_alloc_(ng, sizeof *u), *v[2];
    remap_cover       *cover[2];
    remap_field_report report[2];

    memset(report, 0, sizeof report);
    for (int64_t c = 0; c < ng; c++) u[c] = (double)(tm_mix_((uint64_t)a->mine[d]->global[c]) % 1000);
    for (int k = 0; k < 2; k++) {
      world *w = k ? b : a;
      v[k]     = tm_alloc_(nr, sizeof *u);
      cover[k] = tm_alloc_(nr, sizeof(remap_cover));
      const remap_field_desc f = {.nature = REMAP_CONSERVED, .in = u, .out = v[k]};
      RT_EQ(remap_pairs(w->ctx, d, &p[k]), REMAP_OK);
      RT_EQ(remap_coverage(w->ctx, 1 - d, NULL, cover[k]), REMAP_OK);
      RT_EQ(remap_field(w->ctx, d, &how, 1, &f, &report[k]), REMAP_OK);
    }
    const int64_t n = p[0].row_offset[nr];
    if (RT_EQ(p[1].row_offset[nr], n)) {
      RT_CHECK(same(p[0].row_offset, p[1].row_offset, nr + 1, 8) && same(p[0].global_cell, p[1].global_cell, n, 8));
      RT_CHECK(same(p[0].volume, p[1].volume, n, 8) && same(p[0].moment, p[1].moment, 3 * n, 8));
    }
    RT_CHECK(same(cover[0], cover[1], nr, sizeof **cover) && same(report, report + 1, 1, sizeof *report));
    for (int64_t c = 0; c < nr && how.on_uncovered == REMAP_UNCOVERED_NEAREST; c++)
      if (!RT_NEAR(v[0][c], v[1][c], 0.0)) break;
    for (int k = 0; k < 2; k++) free(v[k]), free(cover[k]);
    free(u);
  }
}

static void a_move_makes_the_bits_of_a_fresh_build(void)
{
  for (uint64_t seed = 1; seed <= 3; seed++) {
    double   where[2][12] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}}, *xyz[2];
    uint64_t state        = tm_mix_(seed);
    world    w;

    open_world(&w, NULL, seed);
    for (int side = 0; side < 2; side++) xyz[side] = tm_alloc_(3 * w.mine[side]->view.num_nodes, sizeof(double));
    for (int step = 0; step < 6; step++) {
      const double *list[2] = {xyz[0], xyz[1]};
      remap_motion  motion[2] = {{NULL, NULL}, {NULL, NULL}};
      world         fresh;

      for (int side = 0; side < 2; side++) {
        if (step % 3 == side) continue; /* in every third step both move */
        draw(&state, step == 4, where[side]);
        if (seed % 2) { /* by matrix */
          motion[side].matrix = where[side];
        } else {
          put(xyz[side], w.mine[side]->xyz, w.mine[side]->view.num_nodes, where[side]);
          motion[side].node_xyz = &list[side];
        }
      }
      RT_EQ(remap_move(w.ctx, motion), REMAP_OK);
      open_world(&fresh, (const double(*)[12])where, seed);
      compare(&w, &fresh);
      close_world(&fresh);
    }
    close_world(&w);
    for (int side = 0; side < 2; side++) free(xyz[side]);
  }
}

/* A zone turns by a tenth of a cell each time, now and then by more: what is kept holds for some steps and then does not. */
static void many_small_steps_make_the_bits_of_fresh_builds(void)
{
  double where[2][12] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
  world  w;

  open_world(&w, NULL, 11);
  for (int step = 1; step <= 32; step++) {
    const int          side      = step < 24; /* first the target moves alone, then the source */
    const double       angle     = .02 * step + (step % 9 == 0 ? .1 : 0), c = cos(angle), s = sin(angle);
    const remap_motion motion[2] = {{NULL, side ? NULL : where[0]}, {NULL, side ? where[1] : NULL}};
    world              fresh;

    memcpy(where[side], (const double[12]){c, -s, 0, .5 - .5 * c + .5 * s, s, c, 0, .5 - .5 * s - .5 * c, 0, 0, 1, .005 * step},
           sizeof where[side]);
    RT_EQ(remap_move(w.ctx, motion), REMAP_OK);
    if (step % 3 == 1) continue;
    open_world(&fresh, (const double(*)[12])where, 11);
    compare(&w, &fresh);
    close_world(&fresh);
  }
  close_world(&w);
}

/* Every node by a lot of its own, drawn from its coordinates, so that its copies stay together: faces bend, other diagonals and
 * other triangles are chosen for them, cells turn inside out. */
static double *shaken(const world *w, int side, uint64_t seed, double by)
{
  const int64_t n   = w->mine[side]->view.num_nodes;
  double       *xyz = tm_alloc_(3 * n, sizeof *xyz);

  for (int64_t i = 0; i < n; i++) {
    uint64_t state = seed;

    for (int k = 0; k < 3; k++) {
      uint64_t bits;
      memcpy(&bits, &w->mine[side]->xyz[3 * i + k], sizeof bits);
      state = tm_mix_(state ^ bits);
    }
    for (int k = 0; k < 3; k++)
      xyz[3 * i + k] = w->mine[side]->xyz[3 * i + k] + by * ((double)tm_random(&state, 2001) / 1000 - 1);
  }
  return xyz;
}

static void nodes_that_move_apart_make_the_bits_of_a_fresh_build(void)
{
  static const double by[] = {1e-3, 2e-3, 1e-3, .3, 5e-2, .2, 1e-3};
  double             *xyz[2] = {NULL, NULL};
  world               w;

  open_world(&w, NULL, 13);
  for (int step = 0; step < 7; step++) {
    remap_motion  motion[2] = {{NULL, NULL}, {NULL, NULL}};
    const double *list[2];
    world         fresh;

    start_world(&fresh, 13);
    for (int side = 0; side < 2; side++) {
      if (step % 3 != side) {
        free(xyz[side]);
        xyz[side]             = shaken(&w, side, (uint64_t)(100 * side + step), by[step]);
        list[side]            = xyz[side];
        motion[side].node_xyz = &list[side];
      }
      if (!xyz[side]) continue;
      double *copy = tm_alloc_(3 * w.mine[side]->view.num_nodes, sizeof *copy);
      memcpy(copy, xyz[side], (size_t)(3 * w.mine[side]->view.num_nodes) * sizeof *copy);
      lend(&fresh, side, copy);
    }
    build_world(&fresh);
    RT_EQ(remap_move(w.ctx, motion), REMAP_OK);
    compare(&w, &fresh);
    close_world(&fresh);
  }
  close_world(&w);
  for (int side = 0; side < 2; side++) free(xyz[side]);
}

static void a_thousand_moves_hold_no_more_memory_than_sixty(void)
{
#if defined(__SANITIZE_ADDRESS__) /* which looks for leaks by itself */
  const int num = 80;
#else
  const int num = rt_size() == 1 ? 1000 : 80;
#endif
  const int64_t share = rt_size() == 1 ? 1024 : 16; /* MPI's own store, of messages that came early too, counts in heap.held */
  int64_t       most = 0;
  int           grown = 0;
  world         w;

  open_world(&w, NULL, 17);
  double *u = tm_alloc_(w.mine[0]->view.num_cells, sizeof *u), *v = tm_alloc_(w.mine[1]->view.num_cells, sizeof *v);
  for (int step = 0; step < num; step++) {
    const double           angle = .3 * sin(.1 * M_PI * (step % 20)), c = cos(angle), s = sin(angle);
    const double           m[12] = {c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0};
    const remap_motion     motion[2] = {{NULL, NULL}, {NULL, m}};
    const remap_field_desc f         = {.nature = REMAP_CONSERVED, .has_old = 1, .in = u, .out = v};

    RT_EQ(remap_move(w.ctx, motion), REMAP_OK);
    if (step % 10 == 0) RT_EQ(remap_field(w.ctx, REMAP_FORWARD, NULL, 1, &f, NULL), REMAP_OK);
    if (step < 60) most = heap.held > most ? heap.held : most; /* three times to and fro */
    else if (heap.held - most > most / share) grown++;
  }
  RT_EQ(grown, 0);
  free(u), free(v);
  close_world(&w);
}

static void moves_are_refused_before_a_build_and_after_a_mesh_is_set(void)
{
  static const double turned[12] = {1, 0, 0, .01, 0, 1, 0, 0, 0, 0, 1, 0};
  const remap_motion  motion[2]  = {{NULL, turned}, {NULL, NULL}};
  remap_context      *empty      = NULL;
  world               w;

  RT_EQ(remap_create(MPI_COMM_WORLD, NULL, &empty), REMAP_OK);
  RT_EQ(remap_move(empty, motion), REMAP_BAD_ORDER);
  RT_CHECK(strstr(remap_message(empty), "remap_build") != NULL);
  remap_destroy(&empty);
  open_world(&w, NULL, 5);
  RT_EQ(remap_move(w.ctx, NULL), REMAP_BAD_ARGUMENT);
  RT_EQ(remap_move(w.ctx, motion), REMAP_OK);
  if (rt_rank() == 0) RT_EQ(remap_set_mesh(w.ctx, 0, &w.mine[0]->view), REMAP_OK); /* one rank forgets */
  RT_EQ(remap_move(w.ctx, motion), REMAP_BAD_ORDER);
  RT_EQ(remap_build(w.ctx), REMAP_OK);
  RT_EQ(remap_move(w.ctx, motion), REMAP_OK);
  close_world(&w);
}

static void a_move_to_nowhere_fails_on_every_rank_and_a_build_mends_it(void)
{
  world w;

  open_world(&w, NULL, 7);
  double *xyz = tm_alloc_(3 * w.mine[1]->view.num_nodes, sizeof *xyz);
  memcpy(xyz, w.mine[1]->xyz, (size_t)(3 * w.mine[1]->view.num_nodes) * sizeof *xyz);
  if (rt_rank() == rt_size() - 1 && w.mine[1]->view.num_nodes) xyz[0] = NAN;
  const double      *list      = xyz;
  const remap_motion motion[2] = {{NULL, NULL}, {&list, NULL}};
  RT_EQ(remap_move(w.ctx, motion), REMAP_BAD_MESH);
  RT_CHECK(strstr(remap_message(w.ctx), "finite") != NULL);
  RT_EQ(remap_move(w.ctx, motion), REMAP_BAD_ORDER);
  memcpy(xyz, w.mine[1]->xyz, (size_t)(3 * w.mine[1]->view.num_nodes) * sizeof *xyz);
  RT_EQ(remap_build(w.ctx), REMAP_OK);
  RT_EQ(remap_move(w.ctx, motion), REMAP_OK);
  close_world(&w);
  free(xyz);
}

RT_MAIN(RT_CASE(a_move_makes_the_bits_of_a_fresh_build), RT_CASE(many_small_steps_make_the_bits_of_fresh_builds),
        RT_CASE(nodes_that_move_apart_make_the_bits_of_a_fresh_build), RT_CASE(a_thousand_moves_hold_no_more_memory_than_sixty),
        RT_CASE(moves_are_refused_before_a_build_and_after_a_mesh_is_set),
        RT_CASE(a_move_to_nowhere_fails_on_every_rank_and_a_build_mends_it))
