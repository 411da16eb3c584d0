/* bench_move -- a cylinder zone that rotates in a box: what a step costs by remap_move and by a fresh remap_build of the same
 * position, with the first transfers both ways, which prepare, and without; and a transfer after that. CPU time of the slowest
 * rank, medians over the steps. One JSON line.
 *
 *   mpirun -n P bench_move [N] [STEPS] [TOP]    box of N^3 cells, zone of as many per length, up to that height; default 32,
 *   50,
 *                                               0.743; at 0.75 the zone ends in a plane of the box's faces */
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

/* The unit cube to a ring of radii 0.08 and 0.3 about (0.5, 0.5), a third of the circle per third of y: z from 0.26 to *data.
 * */
static void to_ring(double xyz[3], const void *data)
{
  const double r = .08 + .22 * xyz[0], angle = 2 * M_PI * xyz[1];

  xyz[0] = .5 + r * cos(angle), xyz[1] = .5 + r * sin(angle), xyz[2] = .26 + (*(const double *)data - .26) * xyz[2];
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

int main(int argc, char **argv)
{
  int rank, size;

  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);

  const int    n = argc > 1 ? atoi(argv[1]) : 32, steps = argc > 2 ? atoi(argv[2]) : 50;
  const double top = argc > 3 ? atof(argv[3]) : .743;
  tm_mesh     *whole[2] = {tm_hexahedra((int[]){n, n, n}, NULL, NULL),
                           tm_hexahedra((int[]){(n + 3) / 4, 2 * n, (n + 1) / 2}, to_ring, &top)};
  tm_mesh     *mine[2];
  double      *move = tm_alloc_(5 * steps, sizeof *move), *fresh = move + steps;
  double      *move_all = fresh + steps, *fresh_all = move_all + steps;
  double      *field = fresh_all + steps, *q[2];
  remap_context *moving = NULL, *anew = NULL;
  remap_stats    stats;
  int64_t        cells[2];
  remap_status   status;

  memset(&stats, 0, sizeof stats);
  for (int side = 0; side < 2; side++) {
    int *deal   = tm_deal(whole[side], size, TM_SLABS, 0);
    mine[side]  = tm_part(whole[side], deal, rank, 0);
    cells[side] = whole[side]->view.num_cells;
    tm_free(whole[side]);
    free(deal);
  }
  for (int side = 0; side < 2; side++) q[side] = tm_alloc_(cells[side], sizeof(double));
  double *xyz = tm_alloc_(3 * mine[1]->view.num_nodes, sizeof *xyz);
  status = remap_create(MPI_COMM_WORLD, NULL, &moving);
  if (status == REMAP_OK) status = remap_create(MPI_COMM_WORLD, NULL, &anew);
  for (int side = 0; side < 2 && status == REMAP_OK; side++) {
    remap_mesh view = mine[side]->view;

    remap_set_mesh(moving, side, &view);
    if (side == 1) view.node_xyz = xyz;
    remap_set_mesh(anew, side, &view);
  }
  if (status == REMAP_OK) status = remap_build(moving);
  for (int step = 0; step < steps && status == REMAP_OK; step++) {
    const remap_field_desc back = {.nature = REMAP_CONSERVED, .has_old = 1, .in = q[1], .out = q[0]};
    double                 m[12], seconds[2];

    rotation(.01 * (step + 1), m);
    status     = timed(moving, m, q, seconds);
    move[step] = seconds[0], move_all[step] = seconds[1];
    const double begin = now();
    if (status == REMAP_OK) status = remap_field(moving, REMAP_BACKWARD, NULL, 1, &back, NULL);
    field[step] = now() - begin;
    memcpy(xyz, mine[1]->xyz, (size_t)(3 * mine[1]->view.num_nodes) * sizeof *xyz);
    for (int64_t i = 0; i < mine[1]->view.num_nodes; i++) tm_affine(xyz + 3 * i, m);
    if (status == REMAP_OK) status = timed(anew, NULL, q, seconds);
    fresh[step] = seconds[0], fresh_all[step] = seconds[1];
  }
  if (status == REMAP_OK) status = remap_get_stats(moving, &stats);
  if (status != REMAP_OK && rank == 0) fprintf(stderr, "%s: %s\n", remap_status_text(status), remap_message(moving));
  if (status == REMAP_OK && rank == 0) print(size, cells, &stats, steps, move);
  remap_destroy(&moving), remap_destroy(&anew);
  for (int side = 0; side < 2; side++) tm_free(mine[side]);
  free(q[0]), free(q[1]), free(xyz), free(move);
  MPI_Finalize();
  return status != REMAP_OK;
}
