/* bench_field -- one field on an existing overlay: what a transfer costs a solver in every step. Times of remap_field by order
 * and limiter, then, of the same messages (order 1, one number per giving cell) without the library, by isend and irecv as it
 * has them, by persistent requests and by a neighbourhood collective. Microseconds, medians over the repeats, the slowest
 * rank's. One JSON line.
 *
 *   mpirun -n P bench_field [N] [REPEATS]      N^3 cells to (N + 1)^3 warped ones; default 32, 200 */
#include <remap/remap.h>
#include <stdio.h>
#include "meshes.h"

enum { WAYS = 3 };

typedef struct world {
  remap_context *ctx;
  int            rank, size, num;            /* neighbours */
  int           *neighbour, *count, *offset; /* [num], items that come from each */
  double        *u, *v, *in, *out;
  int64_t        cells[2];
} world;

static int by_value(const void *a, const void *b)
{
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* Of the slowest rank, in microseconds; x is used up. */
static double median(double *x, int n)
{
  MPI_Allreduce(MPI_IN_PLACE, x, n, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
  qsort(x, (size_t)n, sizeof *x, by_value);
  return 1e6 * x[n / 2];
}

static remap_status open_world(world *w, int n)
{
  remap_status status = remap_create(MPI_COMM_WORLD, NULL, &w->ctx);

  MPI_Comm_rank(MPI_COMM_WORLD, &w->rank);
  MPI_Comm_size(MPI_COMM_WORLD, &w->size);
  tm_mesh *mine[2];
  for (int side = 0; side < 2 && status == REMAP_OK; side++) {
    tm_mesh *whole = tm_hexahedra((int[]){n + side, n + side, n + side}, tm_warp, &(tm_warping){0.2 / n, side ? 0.7 : 0.2});
    int     *deal  = tm_deal(whole, w->size, TM_SLABS, 0);

    mine[side]     = tm_part(whole, deal, w->rank, 0);
    w->cells[side] = mine[side]->view.num_cells;
    status         = remap_set_mesh(w->ctx, side, &mine[side]->view);
    tm_free(whole), free(deal);
  }
  if (status == REMAP_OK) status = remap_build(w->ctx);
  for (int side = 0; side < 2; side++) tm_free(mine[side]);
  w->u = tm_alloc_(w->cells[0], sizeof(double)), w->v = tm_alloc_(w->cells[1], sizeof(double));
  for (int64_t c = 0; c < w->cells[0]; c++) w->u[c] = (double)(c % 7);
  return status;
}

/* Whom this rank has giving cells of, and how many; the same number goes back, near enough. */
static remap_status find_neighbours(world *w)
{
  remap_pairs_view   pairs;
  const remap_status status    = remap_pairs(w->ctx, REMAP_FORWARD, &pairs);
  int                num_items = 0;

  w->neighbour = tm_alloc_(w->size, sizeof(int)), w->count = tm_alloc_(w->size, sizeof(int));
  w->offset = tm_alloc_(w->size + 1, sizeof(int));
  if (status != REMAP_OK) return status;
  int    *items = tm_alloc_(2 * w->size, sizeof *items), *back = items + w->size;
  int64_t last = -1;
  for (int64_t k = 0; k < pairs.row_offset[pairs.num_rows]; k++) {
    items[pairs.owner_rank[k]] += pairs.owner_rank[k] != w->rank && pairs.global_cell[k] != last;
    last = pairs.global_cell[k];
  }
  MPI_Alltoall(items, 1, MPI_INT, back, 1, MPI_INT, MPI_COMM_WORLD);
  for (int r = 0; r < w->size; r++) {
    const int n = items[r] > back[r] ? items[r] : back[r];

    if (n == 0) continue;
    w->neighbour[w->num] = r, w->count[w->num] = n, w->offset[w->num] = num_items;
    w->num++, num_items += n;
  }
  free(items);
  w->in = tm_alloc_(num_items, sizeof(double)), w->out = tm_alloc_(num_items, sizeof(double));
  return status;
}

/* One exchange by isend and irecv, or by requests that were made before. */
static void exchange(world *w, int way, MPI_Request *request, MPI_Comm graph)
{
  if (way == 2) {
    MPI_Neighbor_alltoallv(w->out, w->count, w->offset, MPI_DOUBLE, w->in, w->count, w->offset, MPI_DOUBLE, graph);
    return;
  }
  if (way == 1) MPI_Startall(2 * w->num, request);
  for (int i = 0; i < w->num && way == 0; i++) {
    MPI_Irecv(w->in + w->offset[i], w->count[i], MPI_DOUBLE, w->neighbour[i], 0, MPI_COMM_WORLD, &request[i]);
    MPI_Isend(w->out + w->offset[i], w->count[i], MPI_DOUBLE, w->neighbour[i], 0, MPI_COMM_WORLD, &request[w->num + i]);
  }
  MPI_Waitall(2 * w->num, request, MPI_STATUSES_IGNORE);
}

static void time_messages(world *w, int repeats, double *seconds, double best[WAYS])
{
  MPI_Request *request = malloc((size_t)(2 * w->num + 1) * sizeof *request);
  MPI_Comm     graph;

  MPI_Dist_graph_create_adjacent(MPI_COMM_WORLD, w->num, w->neighbour, w->count, w->num, w->neighbour, w->count, MPI_INFO_NULL,
                                 0, &graph);
  for (int way = 0; way < WAYS; way++) {
    for (int i = 0; i < w->num && way == 1; i++) {
      MPI_Recv_init(w->in + w->offset[i], w->count[i], MPI_DOUBLE, w->neighbour[i], 0, MPI_COMM_WORLD, &request[i]);
      MPI_Send_init(w->out + w->offset[i], w->count[i], MPI_DOUBLE, w->neighbour[i], 0, MPI_COMM_WORLD, &request[w->num + i]);
    }
    for (int k = 0; k < repeats; k++) {
      MPI_Barrier(MPI_COMM_WORLD);
      const double start = MPI_Wtime();
      exchange(w, way, request, graph);
      seconds[k] = MPI_Wtime() - start;
    }
    best[way] = median(seconds, repeats);
    for (int i = 0; i < 2 * w->num && way == 1; i++) MPI_Request_free(&request[i]);
  }
  MPI_Comm_free(&graph);
  free(request);
}

int main(int argc, char **argv)
{
  static const struct {
    const char   *name;
    int           order;
    remap_limiter limiter;
  } kind[]       = {{"order_1", 1, REMAP_LIMITER_NONE},
                    {"order_2", 2, REMAP_LIMITER_NONE},
                    {"barth_jespersen", 2, REMAP_LIMITER_BARTH_JESPERSEN},
                    {"auto", 2, REMAP_LIMITER_AUTO}};
  const int    n = argc > 1 ? atoi(argv[1]) : 32, repeats = argc > 2 ? atoi(argv[2]) : 200;
  double      *seconds = tm_alloc_(repeats, sizeof *seconds), us[4] = {0}, message[WAYS] = {0};
  world        w = {0};
  remap_status status;

  MPI_Init(&argc, &argv);
  status = open_world(&w, n);
  if (status == REMAP_OK) status = find_neighbours(&w);
  for (int t = 0; t < 4 && status == REMAP_OK; t++) {
    const remap_field_desc f = {.nature = REMAP_CONSERVED, .in = w.u, .out = w.v};
    remap_transfer         how;

    remap_transfer_default(&how);
    how.order = kind[t].order, how.limiter = kind[t].limiter;
    status = remap_field(w.ctx, REMAP_FORWARD, &how, 1, &f, NULL);
    for (int k = 0; k < repeats && status == REMAP_OK; k++) {
      MPI_Barrier(MPI_COMM_WORLD);
      const double start = MPI_Wtime();
      status             = remap_field(w.ctx, REMAP_FORWARD, &how, 1, &f, NULL);
      seconds[k]         = MPI_Wtime() - start;
    }
    us[t] = median(seconds, repeats);
  }
  if (status == REMAP_OK) time_messages(&w, repeats, seconds, message);
  if (w.rank == 0 && status == REMAP_OK) {
    printf("{\"bench\":\"field\",\"ranks\":%d,\"cells\":%d,\"neighbours\":%d,\"items\":%d", w.size, n * n * n, w.num,
           w.num ? w.offset[w.num - 1] + w.count[w.num - 1] : 0);
    for (int t = 0; t < 4; t++) printf(",\"us_%s\":%.1f", kind[t].name, us[t]);
    printf(",\"us_messages_isend\":%.1f,\"us_messages_persistent\":%.1f,\"us_messages_neighbour\":%.1f}\n", message[0],
           message[1], message[2]);
  }
  if (w.rank == 0 && status != REMAP_OK) fprintf(stderr, "%s: %s\n", remap_status_text(status), remap_message(w.ctx));
  remap_destroy(&w.ctx);
  free(w.neighbour), free(w.count), free(w.offset), free(w.u), free(w.v), free(w.in), free(w.out), free(seconds);
  MPI_Finalize();
  return status != REMAP_OK;
}
