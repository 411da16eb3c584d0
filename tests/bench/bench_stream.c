/* bench_stream -- what one field costs on an existing mapping, and what one more costs in the same call, beside plain streams:
 * sums over arrays of as many bytes. Medians of this process' CPU time in milliseconds, so that others on the machine disturb
 * little; on several ranks rank 0's, waiting included. One JSON line.
 *
 *   mpirun -n P bench_stream CASE N ORDER [LIMITER] [FIELDS] [REPEATS]
 *
 * Cases: bench.h. ORDER 1 to 3. LIMITER: none (default), barth-jespersen, auto, caas; or system: auto, and every five fields
 * are a gas, the least that is measured. FIELDS in the call of many: default 8.
 *
 * The streams. `bytes_pairs`: the pairs' arrays, once: number of the giver (4) and V (8), order 2 and systems M (24), order 3
 * and systems second moments (48); and per field what giving cells give, a value (8) and slopes (24), and what receiving cells
 * receive (8). `bytes_plan`: these and, from order 2 on, the stencil, once: number (4) and weights (24) of every vertex
 * neighbour of every giving cell; order 3 another 4 + 72. `ratio_more` is one more field against bytes_pairs, which fields of a
 * call share, so that it may be below 1; `ratio_one` is a field by itself against bytes_plan, all of which it reads. */
#include <remap/remap.h>
#include "bench.h"

typedef struct task {
  int           order, many, repeats;
  remap_limiter limiter;
  bool          is_system;
} task;

/* Read `count` numbers; the sum keeps the compiler from leaving them out. */
static double stream(const double *x, int64_t count)
{
  double sum[8] = {0};

  for (int64_t k = 0; k + 8 <= count; k += 8)
    for (int c = 0; c < 8; c++) sum[c] += x[k + c];
  return sum[0] + sum[1] + sum[2] + sum[3] + sum[4] + sum[5] + sum[6] + sum[7];
}

/* Seconds of a stream over so many bytes of a block; the sum goes to *sum. */
static double time_stream(const double *block, int64_t bytes, double *sum)
{
  const double start = bench_cpu();

  *sum += stream(block, bytes / 8);
  return bench_cpu() - start;
}

/* Cells around every node, or nodes around every cell, as the faces tell them, with repeats: offset [keys + 1], the items. */
static int64_t *list_incident(const remap_mesh *mesh, bool by_node, int64_t *offset)
{
  const int64_t keys = by_node ? mesh->num_nodes : mesh->num_cells;
  int64_t      *item = NULL;

  for (int pass = 0; pass < 2; pass++) { /* count behind the key's place, then list, which moves the offsets into place */
    for (int64_t f = 0; f < mesh->num_faces; f++)
      for (int64_t k = mesh->face_offset[f]; k < mesh->face_offset[f + 1]; k++)
        for (int side = 0; side < 2; side++) {
          const int64_t node = mesh->face_node[k], cell = side ? mesh->face_neighbour[f] : mesh->face_owner[f];

          if (cell < 0) continue;
          if (pass == 0) offset[(by_node ? node : cell) + 2]++;
          else item[offset[(by_node ? node : cell) + 1]++] = by_node ? cell : node;
        }
    for (int64_t k = 0; k <= keys && pass == 0; k++) offset[k + 1] += offset[k];
    if (pass == 0) item = tm_alloc_(offset[keys + 1], sizeof *item);
  }
  return item;
}

/* Cells that share a node with a cell, over all cells. */
static int64_t count_neighbours(const remap_mesh *mesh)
{
  int64_t *cell_offset = tm_alloc_(mesh->num_cells + 2, sizeof *cell_offset), *node = list_incident(mesh, false, cell_offset);
  int64_t *node_offset = tm_alloc_(mesh->num_nodes + 2, sizeof *node_offset), *cell = list_incident(mesh, true, node_offset);
  int64_t *seen = tm_alloc_(mesh->num_cells, sizeof *seen), num = 0;

  for (int64_t c = 0; c < mesh->num_cells; c++) {
    seen[c] = c + 1;
    for (int64_t i = cell_offset[c]; i < cell_offset[c + 1]; i++)
      for (int64_t k = node_offset[node[i]]; k < node_offset[node[i] + 1]; k++) {
        num += seen[cell[k]] != c + 1;
        seen[cell[k]] = c + 1;
      }
  }
  free(cell_offset), free(node), free(node_offset), free(cell), free(seen);
  return num;
}

/* Seconds of one transfer of the first num fields. */
static remap_status transfer(remap_context *ctx, const task *t, int num, remap_field_desc *field, double *seconds)
{
  remap_transfer how;

  remap_transfer_default(&how);
  how.order = t->order, how.limiter = t->limiter;
  MPI_Barrier(MPI_COMM_WORLD);
  const double       start  = bench_cpu();
  const remap_status status = remap_field(ctx, REMAP_FORWARD, &how, num, field, NULL);
  *seconds                  = bench_cpu() - start;
  return status;
}

static bool read_task(int argc, char **argv, task *t)
{
  static const char *const name[] = {"none", "barth-jespersen", "auto", "caas", "system"};
  static const int limiter[] = {REMAP_LIMITER_NONE, REMAP_LIMITER_BARTH_JESPERSEN, REMAP_LIMITER_AUTO, REMAP_LIMITER_CAAS,
                                REMAP_LIMITER_AUTO};
  int              k         = 0;

  if (argc < 4) return false;
  while (k < 5 && strcmp(argc > 4 ? argv[4] : "none", name[k])) k++;
  if (k == 5) return false;
  *t = (task){.order     = atoi(argv[3]),
              .many      = argc > 5 ? atoi(argv[5]) : 8,
              .repeats   = argc > 6 ? atoi(argv[6]) : 9,
              .limiter   = (remap_limiter)limiter[k],
              .is_system = k == 4};
  return t->order >= 1 && t->order <= 3 && atoi(argv[2]) > 0 && t->repeats > 0 &&
         (t->is_system ? t->many > 5 && t->many % 5 == 0 : t->many > 1);
}

/* Somewhere in each cell: the mean of its faces' nodes, [num_cells][3]. */
static double *middles_of(const remap_mesh *mesh)
{
  double *middle = tm_alloc_(3 * mesh->num_cells, sizeof *middle), *count = tm_alloc_(mesh->num_cells, sizeof *count);

  for (int64_t f = 0; f < mesh->num_faces; f++)
    for (int64_t k = mesh->face_offset[f]; k < mesh->face_offset[f + 1]; k++)
      for (int side = 0; side < 2; side++) {
        const int64_t cell = side ? mesh->face_neighbour[f] : mesh->face_owner[f];

        if (cell < 0) continue;
        for (int d = 0; d < 3; d++) middle[3 * cell + d] += mesh->node_xyz[3 * mesh->face_node[k] + d];
        count[cell]++;
      }
  for (int64_t c = 0; c < mesh->num_cells; c++)
    for (int d = 0; d < 3; d++) middle[3 * c + d] /= count[c];
  free(count);
  return middle;
}

/* Fields that are smooth but for a jump in a plane. */
static void make_fields(const task *t, const remap_mesh *giving, int64_t num_receiving, double *const value[2],
                        remap_field_desc *field)
{
  static const remap_role role[] = {REMAP_ROLE_DENSITY, REMAP_ROLE_MOMENTUM_X, REMAP_ROLE_MOMENTUM_Y, REMAP_ROLE_MOMENTUM_Z,
                                    REMAP_ROLE_ENERGY};
  double                 *x      = middles_of(giving);

  for (int f = 0; f < t->many; f++) {
    double *u = value[0] + f * giving->num_cells;

    field[f] = (remap_field_desc){.name   = "u",
                                  .nature = REMAP_CONSERVED,
                                  .in     = u,
                                  .out    = value[1] + f * num_receiving,
                                  .system = t->is_system ? 1 + f / 5 : 0,
                                  .role   = t->is_system ? role[f % 5] : REMAP_ROLE_OTHER};
    for (int64_t c = 0; c < giving->num_cells; c++)
      u[c] = (f % 5 == 4 ? 10 : 1) * (2 + .3 * sin(4 * x[3 * c] + f) * cos(3 * x[3 * c + 1]) + (x[3 * c + 2] > .4));
  }
  free(x);
}

/* What every field reads, and what all of them read once: pairs, and the stencil too. */
static void count_bytes(const task *t, const int64_t num[2], int64_t pairs, int64_t neighbours, int64_t bytes[2])
{
  const bool is_curved = t->order == 3 || (t->is_system && t->order == 2);

  bytes[0] = pairs * (12 + (t->order > 1 ? 24 : 0) + (is_curved ? 48 : 0)) + 8 * (num[0] * (t->order > 1 ? 4 : 1) + num[1]);
  bytes[1] = bytes[0] + neighbours * ((t->order > 1 ? 28 : 0) + (t->order > 2 ? 76 : 0));
}

/* What is timed, in this order, time after time: each finds in the caches what the one before has left. */
enum { FEW, STREAM_PAIRS, MANY, STREAM_PLAN, TIMES };

static void print_times(char **argv, const task *t, const int64_t num[2], int64_t pairs, const int64_t bytes[2],
                        const double ms[TIMES])
{
  const int    num_few = t->is_system ? 5 : 1;
  const double one = ms[FEW] / num_few, more = (ms[MANY] - ms[FEW]) / (t->many - num_few);
  int          size;

  MPI_Comm_size(MPI_COMM_WORLD, &size);
  printf("{\"bench\":\"stream\",\"case\":\"%s\",\"n\":%s,\"ranks\":%d,\"order\":%d,\"limiter\":%d,\"system\":%d,"
         "\"cells\":[%lld,%lld],\"pairs\":%lld,\"bytes_pairs\":%lld,\"bytes_plan\":%lld,\"ms_one\":%.3f,\"fields\":%d,"
         "\"ms_one_of_many\":%.3f,\"ms_one_more\":%.3f,\"ms_stream_pairs\":%.3f,\"ms_stream_plan\":%.3f,\"ratio_one\":%.2f,"
         "\"ratio_more\":%.2f}\n",
         argv[1], argv[2], size, t->order, (int)t->limiter, t->is_system, (long long)num[0], (long long)num[1],
         (long long)pairs, (long long)bytes[0], (long long)bytes[1], one, t->many, ms[MANY] / t->many, more,
         ms[STREAM_PAIRS], ms[STREAM_PLAN], one / ms[STREAM_PLAN], more / ms[STREAM_PAIRS]);
}

int main(int argc, char **argv)
{
  tm_mesh       *whole[2], *mine[2];
  remap_context *ctx   = NULL;
  remap_stats    stats = {0};
  remap_options  options;
  double        *value[2];
  task           t;
  int            rank, size;

  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  if (!read_task(argc, argv, &t) || !bench_meshes(argv[1], atoi(argv[2]), whole)) {
    fprintf(stderr, "usage: bench_stream " BENCH_CASES " N 1|2|3 [none|barth-jespersen|auto|caas|system] [FIELDS] [REPEATS]\n");
    return MPI_Finalize(), 2;
  }
  remap_options_default(&options);
  options.max_order   = t.order;
  options.systems     = t.is_system;
  remap_status status = remap_create(MPI_COMM_WORLD, &options, &ctx);
  for (int side = 0; side < 2; side++) {
    int *deal   = tm_deal(whole[side], size, TM_SLABS, 0);
    mine[side]  = tm_part(whole[side], deal, rank, 0);
    value[side] = tm_alloc_(t.many * mine[side]->view.num_cells, sizeof(double));
    if (status == REMAP_OK) status = remap_set_mesh(ctx, side, &mine[side]->view);
    tm_free(whole[side]);
    free(deal);
  }
  const int64_t     num[2] = {mine[0]->view.num_cells, mine[1]->view.num_cells};
  remap_field_desc *field  = tm_alloc_(t.many, sizeof *field);
  double           *time[TIMES], ms[TIMES], once, sum = 0;
  int64_t           bytes[2];
  make_fields(&t, &mine[0]->view, num[1], value, field);
  if (status == REMAP_OK) status = remap_build(ctx);
  if (status == REMAP_OK) status = remap_get_stats(ctx, &stats);
  count_bytes(&t, num, stats.pairs / size, count_neighbours(&mine[0]->view), bytes);
  double *block = tm_alloc_(bytes[1] / 8, sizeof *block);
  for (int64_t k = 0; k < bytes[1] / 8; k++) block[k] = 1;
  for (int k = 0; k < TIMES; k++) time[k] = tm_alloc_(t.repeats, sizeof(double));
  if (status == REMAP_OK) status = transfer(ctx, &t, t.many, field, &once); /* prepares */
  for (int r = 0; r < t.repeats && status == REMAP_OK; r++) {
    status                = transfer(ctx, &t, t.is_system ? 5 : 1, field, &time[FEW][r]);
    time[STREAM_PAIRS][r] = time_stream(block, bytes[0], &sum);
    if (status == REMAP_OK) status = transfer(ctx, &t, t.many, field, &time[MANY][r]);
    time[STREAM_PLAN][r] = time_stream(block, bytes[1], &sum);
  }
  for (int k = 0; k < TIMES; k++) ms[k] = 1e3 * bench_median(time[k], t.repeats), free(time[k]);
  if (status != REMAP_OK && rank == 0) fprintf(stderr, "%s: %s\n", remap_status_text(status), remap_message(ctx));
  if (status == REMAP_OK && rank == 0 && sum > 0) print_times(argv, &t, num, stats.pairs, bytes, ms);
  remap_destroy(&ctx);
  for (int side = 0; side < 2; side++) tm_free(mine[side]), free(value[side]);
  free(field), free(block);
  MPI_Finalize();
  return status != REMAP_OK;
}
