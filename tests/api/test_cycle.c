/* A mesh that moves there and back: what a hundred transfers make of content and shape. 12^3 cells, with REMAP_LONG_TESTS 16^3
 * too. */
#include "carried.h"

/* The mesh moves as its warp swings once, in a hundred steps, and all fields are carried from each position to the next. */
static void a_hundred_steps_of_a_moving_mesh_keep_content_and_shape(void)
{
  static const struct {
    int           field, order;
    remap_limiter limiter;
    double        bar[2]; /* on the mean error at the end, 12^3 and 16^3 */
  } cycle[] = {
      {AV_TRIG, 2, REMAP_LIMITER_NONE, {1.3e-2, 6.0e-3}}, {AV_TRIG, 3, REMAP_LIMITER_NONE, {6e-3, 3.9e-3}},
      {AV_TRIG, 2, REMAP_LIMITER_AUTO, {2e-2, 1e-2}},     {AV_SPHERE, 2, REMAP_LIMITER_BARTH_JESPERSEN, {9e-2, 7.3e-2}},
      {AV_SPHERE, 2, REMAP_LIMITER_AUTO, {9e-2, 7.3e-2}}, {AV_SPHERE, 2, REMAP_LIMITER_CAAS, {9e-2, 7.3e-2}}};
  enum { NUM = sizeof cycle / sizeof *cycle };

  for (int size = 0; size < (getenv("REMAP_LONG_TESTS") ? 2 : 1); size++) {
    const int n      = size ? 16 : 12;
    double   *u[NUM] = {NULL}, *start[NUM] = {NULL}, *volume = NULL, content[NUM];
    int64_t   cells = 0;

    for (int step = 0; step < 100; step++) {
      carried w;

      if (carried_open(&w, MPI_COMM_WORLD, 3, av_mesh(AV_HEXAHEDRA, n, 0.03 * sin(2 * M_PI * step / 100)),
                       av_mesh(AV_HEXAHEDRA, n, 0.03 * sin(2 * M_PI * (step + 1) / 100)), 0))
        for (int k = 0; k < NUM; k++) {
          remap_field_report r = {0};

          if (step == 0) {
            carried_evaluate(&w, av_fields[cycle[k].field].of);
            cells    = w.cells[0];
            u[k]     = tm_alloc_(cells, sizeof(double));
            start[k] = tm_alloc_(cells, sizeof(double));
            if (!volume) volume = tm_alloc_(cells, sizeof(double));
            for (int64_t c = 0; c < cells; c++) u[k][c] = start[k][c] = w.mean[0][c], volume[c] = w.volume[0][c];
          }
          carried_move(&w, REMAP_FORWARD, cycle[k].order, cycle[k].limiter, u[k], w.got[1], &r);
          for (int64_t c = 0; c < cells; c++) u[k][c] = w.got[1][c];
          if (step == 0) content[k] = r.source_integral;
          if (step == 99 && !RT_NEAR(r.target_integral / content[k], 1, 1e-13)) printf("# cycle %d\n", k);
        }
      carried_close(&w);
    }
    for (int k = 0; k < NUM; k++) {
      const av_error error = av_difference(cells, volume, u[k], start[k]);

      if (!RT_CHECK(error.l1 <= cycle[k].bar[size])) printf("# %d^3, cycle %d: %g\n", n, k, error.l1);
      free(u[k]), free(start[k]);
    }
    free(volume);
  }
}

RT_MAIN(RT_CASE(a_hundred_steps_of_a_moving_mesh_keep_content_and_shape))
