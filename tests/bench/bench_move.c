/* bench_move -- a cylinder zone that rotates in a box: what a step costs by remap_move and by a fresh remap_build of the same
 * position, with the first transfers both ways, which prepare, and without; and a transfer after that. CPU time of the slowest
 * rank, medians over the steps. One JSON line.
 *
 *   mpirun -n P bench_move [N] [STEPS] [TOP] [BOTTOM]    box of N^3 cells, zone of half as many layers from the one height to
 *                                                        the other; default 32, 50, 0.743, 0.26. At 0.75 and 0.25 the layers
 *                                                        of both are the same */
#include <remap/remap.h>
#include <stdio.h>
#include <time.h>
#include "meshes.h"

/* CPU time of this process: other programs do not count, but waiting for other ranks does. */
static double now(void)
{
  struct timespec t;

  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int by_value(const void *a, const void *b)
{
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static double median(double *x, int n)
{
  qsort(x, (size_t)n, sizeof *x, by_value);
  return x[n / 2];
}

/* The unit cube to a ring of radii 0.08 and 0.3 about (0.5, 0.5), a third of the circle per third of y, between two heights:
 * data, top and bottom. */
static void to_ring(double xyz[3], const void *data)
{
  const double *height = data, r = .08 + .22 * xyz[0], angle = 2 * M_PI * xyz[1];

  xyz[0] = .5 + r * cos(angle), xyz[1] = .5 + r * sin(angle), xyz[2] = height[1] + (height[0] - height[1]) * xyz[2];
}

static void rotation(double angle, double m[12])
{
  const double c = cos(angle), s = sin(angle);
  memcpy(m, (const double[12]){c, -s, 0, .5 - .5 * c + .5 * s, s, c, 0, .5 - .5 * s - .5 * c, 0, 0, 1, 0}, 12 * sizeof *m);
}

/* The overlay in seconds[0], with a transfer each way in seconds[1]. */
static remap_status timed(remap_context *ctx, const double *matrix, double *const q[2], double seconds[2])
{
  const remap_motion     motion[2] = {{NULL, NULL}, {NULL, matrix}};
  const remap_field_desc field[2]  = {{.nature = REMAP_CONSERVED, .has_old = 1, .in = q[0], .out = q[1]},
                                      {.nature = REMAP_CONSERVED, .has_old = 1, .in = q[1], .out = q[0]}};
  remap_status           status;

  MPI_Barrier(MPI_COMM_WORLD);
  const double start = now();
  status             = matrix ? remap_move(ctx, motion) : remap_build(ctx);
  seconds[0]         = now() - start;
  for (int d = 0; d < 2 && status == REMAP_OK; d++) status = remap_field(ctx, d, NULL, 1, &field[d], NULL);
  MPI_Barrier(MPI_COMM_WORLD);
  seconds[1] = now() - start;
  MPI_Allreduce(MPI_IN_PLACE, seconds, 2, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
  return status;
}

/* seconds, [5][steps]: of remap_move, of a fresh build, of both with their first transfers, of one more transfer. */
static void print(int size, const int64_t cells[2], const remap_stats *stats, int steps, double *seconds)
{
  const double a = median(seconds, steps), b = median(seconds + steps, steps);
  const double c = median(seconds + 2 * steps, steps), d = median(seconds + 3 * steps, steps);

  printf("{\"bench\":\"move\",\"ranks\":%d,\"cells\":[%lld,%lld],\"pairs\":%lld,\"steps\":%d,\"seconds_move\":%.4f,"
         "\"seconds_build\":%.4f,\"share\":%.3f,\"seconds_step_move\":%.4f,\"seconds_step_build\":%.4f,\"share_step\":%.3f,"
         "\"seconds_partition\":%.4f,\"seconds_overlay\":%.4f,\"seconds_field\":%.5f}\n",
         size, (long long)cells[0], (long long)cells[1], (long long)stats->pairs, steps, a, b, a / b, c, d, c / d,
         stats->seconds_partition, stats->seconds_overlay, median(seconds + 4 * steps, steps));
}

/* This rank's parts of box and ring, and two contexts: one that moves, one that is built anew for nodes at xyz. */
typedef struct run {
  tm_mesh       *mine[2];
  int64_t        cells[2]; /* of all ranks */
  double        *q[2], *xyz;
  remap_context *moving, *anew;
} run;

/* box and ring are given up. */
static remap_status prepare(run *r, tm_mesh *box, tm_mesh *ring, int rank, int size)
{
  tm_mesh     *whole[2] = {box, ring};
  remap_status status;

  for (int side = 0; side < 2; side++) {
    int *deal      = tm_deal(whole[side], size, TM_SLABS, 0);
    r->mine[side]  = tm_part(whole[side], deal, rank, 0);
    r->cells[side] = whole[side]->view.num_cells;
    r->q[side]     = tm_alloc_(r->cells[side], sizeof(double));
    tm_free(whole[side]);
    free(deal);
  }
  r->xyz = tm_alloc_(3 * r->mine[1]->view.num_nodes, sizeof *r->xyz);
  status = remap_create(MPI_COMM_WORLD, NULL, &r->moving);
  if (status == REMAP_OK) status = remap_create(MPI_COMM_WORLD, NULL, &r->anew);
  for (int side = 0; side < 2 && status == REMAP_OK; side++) {
    remap_mesh view = r->mine[side]->view;

    remap_set_mesh(r->moving, side, &view);
    if (side == 1) view.node_xyz = r->xyz;
    remap_set_mesh(r->anew, side, &view);
  }
  return status == REMAP_OK ? remap_build(r->moving) : status;
}

static void release(run *r)
{
  remap_destroy(&r->moving), remap_destroy(&r->anew);
  for (int side = 0; side < 2; side++) {
    tm_free(r->mine[side]);
    free(r->q[side]);
  }
  free(r->xyz);
}

/* A step both ways; seconds [5][steps], as print takes them. */
static remap_status take_step(const run *r, int step, int steps, double *seconds)
{
  const remap_field_desc back = {.nature = REMAP_CONSERVED, .has_old = 1, .in = r->q[1], .out = r->q[0]};
  const tm_mesh         *ring = r->mine[1];
  double                 m[12], two[2];
  remap_status           status;

  rotation(.01 * (step + 1), m);
  status              = timed(r->moving, m, r->q, two);
  seconds[step]       = two[0], seconds[2 * steps + step] = two[1];
  const double start  = now();
  if (status == REMAP_OK) status = remap_field(r->moving, REMAP_BACKWARD, NULL, 1, &back, NULL);
  seconds[4 * steps + step] = now() - start;
  memcpy(r->xyz, ring->xyz, (size_t)(3 * ring->view.num_nodes) * sizeof *r->xyz);
  for (int64_t i = 0; i < ring->view.num_nodes; i++) tm_affine(r->xyz + 3 * i, m);
  if (status == REMAP_OK) status = timed(r->anew, NULL, r->q, two);
  seconds[steps + step] = two[0], seconds[3 * steps + step] = two[1];
  return status;
}

int main(int argc, char **argv)
{
  int rank, size;

  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);

  const int    n = argc > 1 ? atoi(argv[1]) : 32, steps = argc > 2 ? atoi(argv[2]) : 50;
  const double height[2] = {argc > 3 ? atof(argv[3]) : .743, argc > 4 ? atof(argv[4]) : .26};
  double      *seconds   = tm_alloc_(5 * steps, sizeof *seconds);
  run          r         = {.moving = NULL};
  remap_stats  stats;
  remap_status status = prepare(&r, tm_hexahedra((int[]){n, n, n}, NULL, NULL),
                                tm_hexahedra((int[]){(n + 3) / 4, 2 * n, (n + 1) / 2}, to_ring, height), rank, size);

  memset(&stats, 0, sizeof stats);
  for (int step = 0; step < steps && status == REMAP_OK; step++) status = take_step(&r, step, steps, seconds);
  if (status == REMAP_OK) status = remap_get_stats(r.moving, &stats);
  if (status != REMAP_OK && rank == 0) fprintf(stderr, "%s: %s\n", remap_status_text(status), remap_message(r.moving));
  if (status == REMAP_OK && rank == 0) print(size, r.cells, &stats, steps, seconds);
  release(&r);
  free(seconds);
  MPI_Finalize();
  return status != REMAP_OK;
}
