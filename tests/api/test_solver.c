/* What a solver with moving bodies asks of transfers: halves that overlap with its own work, no memory and no collective after
 * the first call, borrowed arrays of any layout, blocks, masks, several contexts. */
#include <remap/remap.h>
#include "heap.h"
#include "meshes.h"
#include "rt.h"

/* ---- calls of MPI that it makes: counted by MPI's profiling interface -------------------------------------------- */

static struct calls {
  long collective, to[16]; /* messages to each rank */
} calls;
int MPI_Allreduce(const void *in, void *out, int n, MPI_Datatype type, MPI_Op op, MPI_Comm comm)
{
  calls.collective++;
  return PMPI_Allreduce(in, out, n, type, op, comm);
}
int MPI_Bcast(void *data, int n, MPI_Datatype type, int root, MPI_Comm comm)
{
  calls.collective++;
  return PMPI_Bcast(data, n, type, root, comm);
}
int MPI_Exscan(const void *in, void *out, int n, MPI_Datatype type, MPI_Op op, MPI_Comm comm)
{
  calls.collective++;
  return PMPI_Exscan(in, out, n, type, op, comm);
}
int MPI_Alltoall(const void *in, int n, MPI_Datatype type, void *out, int m, MPI_Datatype to, MPI_Comm comm)
{
  calls.collective++;
  return PMPI_Alltoall(in, n, type, out, m, to, comm);
}
int MPI_Allgather(const void *in, int n, MPI_Datatype type, void *out, int m, MPI_Datatype to, MPI_Comm comm)
{
  calls.collective++;
  return PMPI_Allgather(in, n, type, out, m, to, comm);
}
int MPI_Allgatherv(const void *in, int n, MPI_Datatype type, void *out, const int *m, const int *at, MPI_Datatype to,
                   MPI_Comm comm)
{
  calls.collective++;
  return PMPI_Allgatherv(in, n, type, out, m, at, to, comm);
}
int MPI_Ibarrier(MPI_Comm comm, MPI_Request *request)
{
  calls.collective++;
  return PMPI_Ibarrier(comm, request);
}
int MPI_Send(const void *data, int n, MPI_Datatype type, int rank, int tag, MPI_Comm comm)
{
  calls.collective++; /* the library asks everybody along a tree */
  return PMPI_Send(data, n, type, rank, tag, comm);
}
int MPI_Isend(const void *data, int n, MPI_Datatype type, int rank, int tag, MPI_Comm comm, MPI_Request *request)
{
  calls.to[rank % 16]++;
  return PMPI_Isend(data, n, type, rank, tag, comm, request);
}

/* ---- two meshes that overlap in part ------------------------------------------------------------------------------------- */

typedef struct world {
  remap_context *ctx;
  tm_mesh       *whole[2], *mine[2];
  int64_t        cells[2];
  double        *u[2]; /* [side][cells] a field by global id */
} world;

static double lot(int64_t global) { return 1 + (double)(tm_mix_((uint64_t)global) % 1000) / 999; }

static tm_mesh *make(int side)
{
  static const double away[12] = {1, 0, 0, .3, 0, 1, 0, .2, 0, 0, 1, -.1};
  tm_mesh *m = tm_hexahedra(side ? (int[]){6, 5, 5} : (int[]){5, 6, 4}, tm_warp, &(tm_warping){0.03, side ? 0.7 : 0.2});

  if (side) tm_move(m, tm_affine, away);
  return m;
}

/* Cells are dealt over the first num_ranks ranks of comm. */
static bool open_world(world *w, MPI_Comm comm, int num_ranks, tm_dealing how, uint64_t seed)
{
  int rank;

  MPI_Comm_rank(comm, &rank);
  memset(w, 0, sizeof *w);
  RT_EQ(remap_create(comm, NULL, &w->ctx), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    w->whole[side] = make(side);
    int *deal      = tm_deal(w->whole[side], num_ranks, how, seed);
    w->mine[side]  = tm_part(w->whole[side], deal, rank, seed);
    w->cells[side] = w->mine[side]->view.num_cells;
    w->u[side]     = tm_alloc_(w->cells[side], sizeof(double));
    for (int64_t c = 0; c < w->cells[side]; c++) w->u[side][c] = lot(w->mine[side]->global[c]);
    free(deal);
    RT_EQ(remap_set_mesh(w->ctx, side, &w->mine[side]->view), REMAP_OK);
  }
  return rt_all(RT_EQ(remap_build(w->ctx), REMAP_OK));
}

static void close_world(world *w)
{
  remap_destroy(&w->ctx);
  for (int side = 0; side < 2; side++) tm_free(w->whole[side]), tm_free(w->mine[side]), free(w->u[side]);
}

static remap_transfer nearest(void)
{
  remap_transfer how;

  remap_transfer_default(&how);
  how.on_uncovered = REMAP_UNCOVERED_NEAREST;
  return how;
}

/* The field from side to the other, in one call. */
static double *moved(world *w, int direction)
{
  double                *v   = tm_alloc_(w->cells[1 - direction], sizeof *v);
  const remap_transfer   how = nearest();
  const remap_field_desc f   = {.nature = REMAP_CONSERVED, .in = w->u[direction], .out = v};

  RT_EQ(remap_field(w->ctx, direction, &how, 1, &f, NULL), REMAP_OK);
  return v;
}

static bool same(const double *a, const double *b, int64_t n) { return memcmp(a, b, (size_t)n * sizeof *a) == 0; }

/* ---- halves ------------------------------------------------------------------------------------------------------------ */

static void halves_make_the_same_as_a_whole_in_both_directions_at_once(void)
{
  world w;

  if (open_world(&w, MPI_COMM_WORLD, rt_size(), TM_RANDOM, 3)) {
    for (int order = 1; order <= 2; order++) {
      double        *want[2], *got[2], *in[2];
      remap_transfer how = nearest();

      how.order = order;
      for (int d = 0; d < 2; d++) {
        want[d] = tm_alloc_(w.cells[1 - d], sizeof(double)), got[d] = tm_alloc_(w.cells[1 - d], sizeof(double));
        in[d]   = tm_alloc_(w.cells[d], sizeof(double));
        const remap_field_desc f = {.nature = REMAP_CONSERVED, .in = w.u[d], .out = want[d]};
        RT_EQ(remap_field(w.ctx, d, &how, 1, &f, NULL), REMAP_OK);
        memcpy(in[d], w.u[d], (size_t)w.cells[d] * sizeof(double));
      }
      for (int d = 0; d < 2; d++) {
        const remap_field_desc f = {.nature = REMAP_CONSERVED, .in = in[d], .out = got[d]};
        RT_EQ(remap_field_start(w.ctx, d, &how, 1, &f), REMAP_OK);
        for (int64_t c = 0; c < w.cells[d]; c++) in[d][c] = NAN; /* has been read */
      }
      for (int d = 0; d < 2; d++) {
        RT_EQ(remap_field_finish(w.ctx, d, NULL), REMAP_OK);
        RT_CHECK(same(got[d], want[d], w.cells[1 - d]));
        free(want[d]), free(got[d]), free(in[d]);
      }
    }
  }
  close_world(&w);
}

static void halves_out_of_order_are_refused_and_a_context_may_end_between_them(void)
{
  world w;

  if (open_world(&w, MPI_COMM_WORLD, rt_size(), TM_SLABS, 0)) {
    double                *v = tm_alloc_(w.cells[1], sizeof *v);
    const remap_field_desc f = {.nature = REMAP_CONSERVED, .in = w.u[0], .out = v};

    RT_EQ(remap_field_finish(w.ctx, REMAP_FORWARD, NULL), REMAP_BAD_ORDER);
    RT_EQ(remap_field_start(w.ctx, REMAP_FORWARD, NULL, 1, &f), REMAP_OK);
    RT_EQ(remap_field_start(w.ctx, REMAP_FORWARD, NULL, 1, &f), REMAP_BAD_ORDER);
    RT_EQ(remap_build(w.ctx), REMAP_BAD_ORDER);
    RT_EQ(remap_set_masks(w.ctx, NULL), REMAP_BAD_ORDER);
    RT_CHECK(strstr(remap_message(w.ctx), "remap_field_finish") != NULL);
    free(v);
  }
  close_world(&w);
}

static void transfers_after_the_first_take_no_memory(void)
{
  world w;

  if (open_world(&w, MPI_COMM_WORLD, rt_size(), TM_RANDOM, 5)) {
    double              *v = tm_alloc_(2 * w.cells[1], sizeof *v);
    const remap_transfer how = nearest();
    remap_field_desc     f[2];
    int64_t              before;

    for (int k = 0; k < 2; k++)
      f[k] = (remap_field_desc){.nature = REMAP_CONSERVED, .in = w.u[0], .out = v + k, .out_stride = 2};
    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 2, f, NULL), REMAP_OK);
    before = heap.requests;
    for (int n = 0; n < 5; n++) RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1 + n % 2, f, NULL), REMAP_OK);
    RT_EQ(heap.requests - before, 0);
    free(v);
  }
  close_world(&w);
}

/* After the first transfer a rank sends each of its peers a message per round, or two if items are many, for however many
 * fields, and there is no collective call. */
static void transfers_after_the_first_are_exchanges_with_neighbours(void)
{
  enum { MANY = 9 };
  static const int rounds[3] = {1, 2, 6}; /* given; halo; slopes, roughness thrice */
  world            w;

  if (open_world(&w, MPI_COMM_WORLD, rt_size(), TM_SLABS, 7)) {
    double          *v   = tm_alloc_(MANY * w.cells[1], sizeof *v);
    remap_transfer   how = nearest();
    remap_field_desc f[MANY];

    how.on_uncovered = REMAP_UNCOVERED_FILL;
    for (int k = 0; k < MANY; k++)
      f[k] = (remap_field_desc){.nature = REMAP_CONSERVED, .in = w.u[0], .out = v + k, .out_stride = MANY};
    for (int kind = 0; kind < 3; kind++) {
      how.order   = kind ? 2 : 1;
      how.limiter = kind == 2 ? REMAP_LIMITER_AUTO : REMAP_LIMITER_BARTH_JESPERSEN;
      RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, MANY, f, NULL), REMAP_OK);
      for (int num = 1; num <= MANY; num += MANY - 1) {
        memset(&calls, 0, sizeof calls);
        RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, num, f, NULL), REMAP_OK);
        const struct calls now = calls; /* before the harness calls MPI again */
        RT_EQ(now.collective, 0);
        for (int r = 0; r < rt_size(); r++) RT_CHECK(now.to[r] <= (r == rt_rank() ? 0 : 2 * rounds[kind]));
      }
    }
    free(v);
  }
  close_world(&w);
}

/* ---- failures ------------------------------------------------------------------------------------------------------------ */

static void what_fails_on_one_rank_reaches_its_neighbours_and_all_by_agreement(void)
{
  world w;

  if (open_world(&w, MPI_COMM_WORLD, rt_size(), TM_RANDOM, 9)) {
    double          *v = tm_alloc_(w.cells[1], sizeof *v), *good = moved(&w, 0);
    remap_field_desc f = {.name = "rho", .nature = REMAP_CONSERVED, .in = w.u[0], .out = v};
    const bool       is_last = rt_rank() == rt_size() - 1;

    for (int kind = 0; kind < 2; kind++)
      for (int with_report = 0; with_report < 2; with_report++) {
        remap_field_report   report;
        const remap_transfer how   = nearest();
        const remap_status   wrong = kind ? REMAP_BAD_ARGUMENT : REMAP_BAD_VALUE;
        const double         keep  = w.cells[0] ? w.u[0][0] : 0;
        remap_status         mine;

        if (is_last && kind) f.out = NULL;
        if (is_last && !kind) w.u[0][0] = INFINITY;
        mine = remap_field(w.ctx, REMAP_FORWARD, &how, 1, &f, with_report ? &report : NULL);
        if (is_last || with_report) RT_EQ(mine, wrong);
        if (is_last || with_report) RT_CHECK(strstr(remap_message(w.ctx), "rho") != NULL);
        if (mine != REMAP_OK) RT_CHECK(v[0] == 0.0); /* not written */
        RT_EQ(remap_agree(w.ctx, mine), wrong);
        f.out = v;
        if (w.cells[0]) w.u[0][0] = keep;
        memset(v, 0, (size_t)w.cells[1] * sizeof *v);
      }
    const remap_transfer how = nearest();
    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &f, NULL), REMAP_OK);
    RT_CHECK(same(v, good, w.cells[1]));
    free(v), free(good);
  }
  close_world(&w);
}

static void a_first_transfer_that_one_rank_gets_wrong_fails_on_all(void)
{
  world w;

  if (open_world(&w, MPI_COMM_WORLD, rt_size(), TM_RANDOM, 9)) {
    double                *v       = tm_alloc_(w.cells[1], sizeof *v);
    const remap_field_desc f       = {.name = "rho", .nature = REMAP_CONSERVED, .in = w.u[0], .out = v};
    const bool             is_last = rt_rank() == rt_size() - 1;
    remap_transfer         how     = nearest();

    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, is_last ? NULL : &f, NULL), REMAP_BAD_ARGUMENT);
    RT_CHECK(strstr(remap_message(w.ctx), "fields is NULL") != NULL);
    if (is_last) how.order = 99;
    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &f, NULL), REMAP_BAD_ARGUMENT);
    RT_CHECK(strstr(remap_message(w.ctx), "order 99") != NULL);
    how = nearest();
    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &f, NULL), REMAP_OK);
    free(v);
  }
  close_world(&w);
}

static void transfers_that_differ_between_ranks_are_refused_where_they_meet(void)
{
  world w;

  if (open_world(&w, MPI_COMM_WORLD, rt_size(), TM_RANDOM, 9)) {
    double          *v = tm_alloc_(w.cells[1], sizeof *v), *good = moved(&w, 0);
    remap_transfer   how = nearest();
    remap_field_desc f[2];
    const bool       is_last = rt_rank() == rt_size() - 1;

    how.order = 1;
    for (int k = 0; k < 2; k++) f[k] = (remap_field_desc){.nature = REMAP_CONSERVED, .in = w.u[0], .out = v};
    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 2, f, NULL), REMAP_OK);
    for (int kind = 0; kind < 2 && rt_size() > 1; kind++) {
      remap_status mine;

      f[0].nature = kind == 0 && is_last ? REMAP_FLAG : REMAP_CONSERVED;
      mine        = remap_field(w.ctx, REMAP_FORWARD, &how, kind == 1 && is_last ? 1 : 2, f, NULL);
      RT_EQ(remap_agree(w.ctx, mine), REMAP_BAD_ARGUMENT);
      if (is_last) RT_CHECK(mine == REMAP_BAD_ARGUMENT && strstr(remap_message(w.ctx), "neighbouring rank") != NULL);
    }
    f[0].nature = REMAP_CONSERVED;
    how.order   = 2;
    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, f, NULL), REMAP_OK);
    RT_CHECK(same(v, good, w.cells[1]));
    free(v), free(good);
  }
  close_world(&w);
}

/* ---- layout ------------------------------------------------------------------------------------------------------------ */

static void strides_and_places_leave_the_rest_alone(void)
{
  enum { NVAR = 3, HALO = 2 }; /* q[(c + HALO) * NVAR + k], with HALO cells before and behind; odd cells come first */
  world w;

  if (open_world(&w, MPI_COMM_WORLD, rt_size(), TM_RANDOM, 11)) {
    double  *want = moved(&w, 0), *q[2];
    int64_t *place[2];

    for (int side = 0; side < 2; side++) {
      const int64_t n = w.cells[side];

      place[side] = tm_alloc_(n, sizeof(int64_t));
      q[side]     = tm_alloc_((n + 2 * HALO) * NVAR, sizeof(double));
      for (int64_t c = 0; c < n; c++) place[side][c] = HALO + (c % 2 ? c / 2 : n / 2 + c / 2);
      for (int64_t k = 0; k < (n + 2 * HALO) * NVAR; k++) q[side][k] = NAN;
      for (int64_t c = 0; c < n && side == 0; c++) q[0][place[0][c] * NVAR + 1] = w.u[0][c];
      w.mine[side]->view.cell_place = place[side];
      RT_EQ(remap_set_mesh(w.ctx, side, &w.mine[side]->view), REMAP_OK);
    }
    if (rt_all(RT_EQ(remap_build(w.ctx), REMAP_OK))) {
      const remap_transfer   how = nearest();
      const remap_field_desc f   = {.nature = REMAP_CONSERVED, .in = q[0] + 1, .out = q[1] + 2,
                                    .in_stride = NVAR, .out_stride = NVAR};

      RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &f, NULL), REMAP_OK);
      for (int64_t c = 0; c < w.cells[1]; c++) {
        RT_NEAR(q[1][place[1][c] * NVAR + 2], want[c], 0.0);
        q[1][place[1][c] * NVAR + 2] = NAN;
      }
      for (int64_t k = 0; k < (w.cells[1] + 2 * HALO) * NVAR; k++) RT_CHECK(isnan(q[1][k]));
    }
    for (int side = 0; side < 2; side++) free(place[side]), free(q[side]);
    free(want);
  }
  close_world(&w);
}

/* A mesh with 32-bit indices from `base`. */
typedef struct narrow {
  tm_mesh   *mesh;
  remap_mesh view;
  int32_t   *list[4];
} narrow;

static int32_t *narrowed(const int64_t *wide, int64_t n, int base)
{
  int32_t *list = tm_alloc_(n, sizeof *list);

  for (int64_t k = 0; k < n; k++) list[k] = (int32_t)(wide[k] + base);
  return list;
}

static void open_narrow(narrow *b, tm_mesh *mesh, int base)
{
  const remap_mesh *v = &mesh->view;

  b->mesh    = mesh;
  b->view    = *v;
  b->list[0] = narrowed(v->face_offset, v->num_faces + 1, base);
  b->list[1] = narrowed(v->face_node, v->face_offset[v->num_faces], base);
  b->list[2] = narrowed(v->face_owner, v->num_faces, base);
  b->list[3] = narrowed(v->face_neighbour, v->num_faces, base);
  b->view.face_offset = b->view.face_node = b->view.face_owner = b->view.face_neighbour = NULL;
  b->view.face_offset32 = b->list[0], b->view.face_node32 = b->list[1];
  b->view.face_owner32 = b->list[2], b->view.face_neighbour32 = b->list[3];
  b->view.index_base = base;
}

static void blocks_with_indices_of_any_kind_make_the_same_bits_as_one_mesh(void)
{
  enum { BLOCKS = 3 };
  world w;

  if (open_world(&w, MPI_COMM_WORLD, rt_size(), TM_RANDOM, 13)) {
    double *want = moved(&w, 0), *by_global = tm_alloc_(w.whole[1]->view.num_cells, sizeof *by_global);
    narrow  block[2][BLOCKS];
    double *values[2][BLOCKS];

    for (int64_t c = 0; c < w.cells[1]; c++) by_global[w.mine[1]->global[c]] = want[c];
    for (int side = 0; side < 2; side++) {
      remap_mesh view[BLOCKS];
      int       *deal = tm_deal(w.whole[side], rt_size(), TM_RANDOM, 13);

      for (int64_t c = 0; c < w.whole[side]->view.num_cells; c++) /* blocks 0 and 2 of a rank; 1 has no cells */
        deal[c] = BLOCKS * deal[c] + (tm_mix_((uint64_t)c) % 2 ? 2 : 0);
      for (int b = 0; b < BLOCKS; b++) {
        open_narrow(&block[side][b], tm_part(w.whole[side], deal, BLOCKS * rt_rank() + b, 17), b == 2);
        view[b]         = block[side][b].view;
        values[side][b] = tm_alloc_(view[b].num_cells, sizeof(double));
        for (int64_t c = 0; c < view[b].num_cells; c++) values[side][b][c] = lot(view[b].cell_global[c]);
      }
      RT_EQ(remap_set_blocks(w.ctx, side, BLOCKS, view), REMAP_OK);
      free(deal);
    }
    if (rt_all(RT_EQ(remap_build(w.ctx), REMAP_OK))) {
      const remap_transfer   how = nearest();
      const remap_field_desc f   = {.nature   = REMAP_CONSERVED,
                                   .in_block  = (const double *const[BLOCKS]){values[0][0], values[0][1], values[0][2]},
                                   .out_block = values[1]};

      RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &f, NULL), REMAP_OK);
      for (int b = 0; b < BLOCKS; b++)
        for (int64_t c = 0; c < block[1][b].view.num_cells; c++)
          RT_NEAR(values[1][b][c], by_global[block[1][b].view.cell_global[c]], 0.0);
    } else {
      printf("# %s\n", remap_message(w.ctx));
    }
    if (rt_rank() == rt_size() - 1 && block[0][2].view.num_faces) block[0][2].list[1][0] = 0; /* below base 1 */
    for (int side = 0; side < 2; side++) {
      remap_mesh view[BLOCKS];

      for (int b = 0; b < BLOCKS; b++) view[b] = block[side][b].view;
      RT_EQ(remap_set_blocks(w.ctx, side, BLOCKS, view), REMAP_OK);
    }
    RT_EQ(remap_build(w.ctx), REMAP_BAD_MESH);
    RT_CHECK(strstr(remap_message(w.ctx), "block 2 has node 0") != NULL);
    for (int side = 0; side < 2; side++)
      for (int b = 0; b < BLOCKS; b++) {
        for (int k = 0; k < 4; k++) free(block[side][b].list[k]);
        tm_free(block[side][b].mesh), free(values[side][b]);
      }
    free(want), free(by_global);
  }
  close_world(&w);
}

/* ---- masks ------------------------------------------------------------------------------------------------------------- */

static bool gives(int64_t global) { return global % 5 != 2 && global % 7 != 3; }
static bool wants(int64_t global) { return global % 3 != 1; }

/* Set masks [side][cells]; what does not give holds a NaN, for nobody looks. */
static void set_masks(world *w, uint8_t *mask[2])
{
  remap_masks masks = {.gives = {NULL, NULL}};

  for (int side = 0; side < 2; side++) {
    mask[side] = tm_alloc_(w->cells[side], 1);
    for (int64_t c = 0; c < w->cells[side]; c++)
      mask[side][c] = side ? wants(w->mine[1]->global[c]) : gives(w->mine[0]->global[c]);
  }
  for (int64_t c = 0; c < w->cells[0]; c++)
    if (!mask[0][c]) w->u[0][c] = NAN;
  masks.gives[0] = mask[0], masks.wants[1] = mask[1];
  RT_EQ(remap_set_masks(w->ctx, &masks), REMAP_OK);
}

/* A context whose source is without the cells that do not give; *rest is this rank's part of that. */
static remap_context *open_rest(const world *w, tm_mesh **rest)
{
  remap_context *ctx  = NULL;
  int           *deal = tm_deal(w->whole[0], rt_size(), TM_RANDOM, 19);

  for (int64_t c = 0; c < w->whole[0]->view.num_cells; c++)
    if (!gives(w->whole[0]->global[c])) deal[c] = -1;
  *rest = tm_part(w->whole[0], deal, rt_rank(), 19);
  free(deal);
  RT_EQ(remap_create(MPI_COMM_WORLD, NULL, &ctx), REMAP_OK);
  RT_EQ(remap_set_mesh(ctx, 0, &(*rest)->view), REMAP_OK);
  RT_EQ(remap_set_mesh(ctx, 1, &w->mine[1]->view), REMAP_OK);
  RT_EQ(remap_build(ctx), REMAP_OK);
  return ctx;
}

/* Wanting cells got what they get without the cells that do not give, the others nothing; coverage and the list of uncovered
 * cells say so. */
static void check_wanting(const world *w, remap_context *without, const uint8_t *wanting, const double *got, const double *want)
{
  remap_cover *masked = tm_alloc_(w->cells[1], sizeof *masked), *plain = tm_alloc_(w->cells[1], sizeof *plain);
  int64_t      num, list[1000], found = 0;

  RT_EQ(remap_coverage(w->ctx, 1, NULL, masked), REMAP_OK);
  RT_EQ(remap_coverage(without, 1, NULL, plain), REMAP_OK);
  RT_EQ(remap_uncovered(w->ctx, REMAP_TARGET, &num, NULL), REMAP_OK);
  RT_EQ(remap_uncovered(w->ctx, REMAP_TARGET, &num, list), REMAP_OK);
  for (int64_t c = 0; c < w->cells[1]; c++) {
    RT_NEAR(got[c], wanting[c] ? want[c] : -7, 0.0);
    RT_EQ(masked[c], wanting[c] ? plain[c] : REMAP_UNWANTED);
    if (masked[c] == REMAP_UNCOVERED) RT_CHECK(found < num && list[found++] == c);
  }
  RT_EQ(found, num);
  free(masked), free(plain);
}

/* The source without the cells that do not give is another mesh; with it, wanting cells get the same bits. */
static void masked_cells_are_as_good_as_not_there(void)
{
  world w;

  if (open_world(&w, MPI_COMM_WORLD, rt_size(), TM_RANDOM, 19)) {
    uint8_t               *mask[2];
    tm_mesh               *rest;
    double                *got = tm_alloc_(w.cells[1], sizeof *got), *want = tm_alloc_(w.cells[1], sizeof *want), *u;
    remap_context         *without = open_rest(&w, &rest);
    const remap_field_desc f       = {.nature = REMAP_CONSERVED, .in = w.u[0], .out = got};
    remap_field_desc       plain   = {.nature = REMAP_CONSERVED, .out = want};
    remap_transfer         how     = nearest();
    remap_field_report     report;

    set_masks(&w, mask);
    plain.in = u = tm_alloc_(rest->view.num_cells, sizeof *u);
    for (int64_t c = 0; c < rest->view.num_cells; c++) u[c] = lot(rest->global[c]);
    for (int64_t c = 0; c < w.cells[1]; c++) got[c] = -7;
    how.on_uncovered = REMAP_UNCOVERED_FILL, how.fill_value = 5;
    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &f, &report), REMAP_OK);
    RT_NEAR(report.conservation_error, 0.0, 1e-14);
    RT_EQ(remap_field(without, REMAP_FORWARD, &how, 1, &plain, NULL), REMAP_OK);
    check_wanting(&w, without, mask[1], got, want);
    how.on_uncovered = REMAP_UNCOVERED_NEAREST;
    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &f, NULL), REMAP_OK);
    for (int64_t c = 0; c < w.cells[1]; c++) RT_CHECK(mask[1][c] ? got[c] >= 1 && got[c] <= 2 : got[c] == -7);
    RT_EQ(remap_set_masks(w.ctx, NULL), REMAP_OK);
    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &f, &report), REMAP_BAD_VALUE); /* now they count */
    remap_destroy(&without);
    tm_free(rest), free(u), free(got), free(want), free(mask[0]), free(mask[1]);
  }
  close_world(&w);
}

/* ---- who has what -------------------------------------------------------------------------------------------------------- */

/* The source on the even ranks, the target on the others: no rank has both, and the bits are those of any other partition. */
static void meshes_on_ranks_of_their_own_make_the_same_bits(void)
{
  world w, apart;

  if (open_world(&w, MPI_COMM_WORLD, rt_size(), TM_RANDOM, 23)) {
    double *want = moved(&w, 0), *by_global = tm_alloc_(w.whole[1]->view.num_cells, sizeof *by_global);

    for (int64_t c = 0; c < w.cells[1]; c++) by_global[w.mine[1]->global[c]] = want[c];
    MPI_Allreduce(MPI_IN_PLACE, by_global, (int)w.whole[1]->view.num_cells, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    memset(&apart, 0, sizeof apart);
    RT_EQ(remap_create(MPI_COMM_WORLD, NULL, &apart.ctx), REMAP_OK);
    for (int side = 0; side < 2; side++) {
      apart.whole[side] = make(side);
      int *deal         = tm_deal(apart.whole[side], rt_size(), TM_RANDOM, 29);

      for (int64_t c = 0; c < apart.whole[side]->view.num_cells && rt_size() > 1; c++) {
        deal[c] = deal[c] / 2 * 2 + side;
        if (deal[c] >= rt_size()) deal[c] = side;
      }
      apart.mine[side]  = tm_part(apart.whole[side], deal, rt_rank(), 31);
      apart.cells[side] = apart.mine[side]->view.num_cells;
      apart.u[side]     = tm_alloc_(apart.cells[side], sizeof(double));
      for (int64_t c = 0; c < apart.cells[side]; c++) apart.u[side][c] = lot(apart.mine[side]->global[c]);
      free(deal);
      if (rt_size() > 1 && rt_rank() % 2 != side) RT_EQ(apart.cells[side], 0);
      RT_EQ(remap_set_mesh(apart.ctx, side, apart.cells[side] ? &apart.mine[side]->view : &(remap_mesh){0}), REMAP_OK);
    }
    if (rt_all(RT_EQ(remap_build(apart.ctx), REMAP_OK))) {
      double *got = moved(&apart, 0), *back = moved(&apart, 1);

      for (int64_t c = 0; c < apart.cells[1]; c++) RT_NEAR(got[c], by_global[apart.mine[1]->global[c]], 0.0);
      free(got), free(back);
    }
    free(want), free(by_global);
    close_world(&apart);
  }
  close_world(&w);
}

/* With the view of pairs a solver does a transfer of order 1 by itself: values come from the ranks that the view names. */
static void pairs_and_their_owners_are_enough_for_a_transfer(void)
{
  world w;

  if (open_world(&w, MPI_COMM_WORLD, rt_size(), TM_RANDOM, 37)) {
    const int64_t     num   = w.whole[0]->view.num_cells;
    double           *value = tm_alloc_(num, sizeof *value), *got = tm_alloc_(w.cells[1], sizeof *got);
    double           *volume = tm_alloc_(w.cells[1], sizeof *volume);
    int              *owner = tm_alloc_(num, sizeof *owner);
    remap_transfer    how   = nearest();
    remap_pairs_view  pairs;
    remap_field_desc  f = {.nature = REMAP_CONSERVED, .in = w.u[0], .out = got};

    for (int64_t c = 0; c < w.cells[0]; c++) {
      value[w.mine[0]->global[c]] = w.u[0][c];
      owner[w.mine[0]->global[c]] = rt_rank();
    }
    MPI_Allreduce(MPI_IN_PLACE, value, (int)num, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    MPI_Allreduce(MPI_IN_PLACE, owner, (int)num, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
    how.order = 1, how.on_partial = REMAP_PARTIAL_CONSERVE, how.on_uncovered = REMAP_UNCOVERED_FILL, how.fill_value = 0;
    RT_EQ(remap_field(w.ctx, REMAP_FORWARD, &how, 1, &f, NULL), REMAP_OK);
    RT_EQ(remap_cells(w.ctx, REMAP_TARGET, volume, NULL), REMAP_OK);
    if (RT_EQ(remap_pairs(w.ctx, REMAP_FORWARD, &pairs), REMAP_OK) && RT_EQ(pairs.num_rows, w.cells[1]))
      for (int64_t r = 0; r < pairs.num_rows; r++) {
        double content = 0;

        for (int64_t k = pairs.row_offset[r]; k < pairs.row_offset[r + 1]; k++) {
          RT_EQ(pairs.owner_rank[k], owner[pairs.global_cell[k]]);
          content += value[pairs.global_cell[k]] * pairs.volume[k];
        }
        RT_NEAR(got[r], content / volume[r], 1e-13);
      }
    free(value), free(got), free(volume), free(owner);
  }
  close_world(&w);
}

/* ---- contexts ------------------------------------------------------------------------------------------------------------ */

static void contexts_do_not_know_of_each_other(void)
{
  world a, b;

  const bool ok = open_world(&a, MPI_COMM_WORLD, rt_size(), TM_RANDOM, 21);
  if (open_world(&b, MPI_COMM_WORLD, rt_size(), TM_SLABS, 0) && ok) {
    double                *want[2] = {moved(&a, 0), moved(&b, 0)};
    double                *got[2]  = {tm_alloc_(a.cells[1], sizeof(double)), tm_alloc_(b.cells[1], sizeof(double))};
    const remap_transfer   how     = nearest();
    const remap_field_desc f[2]    = {{.nature = REMAP_CONSERVED, .in = a.u[0], .out = got[0]},
                                      {.nature = REMAP_CONSERVED, .in = b.u[0], .out = got[1]}};

    RT_EQ(remap_field_start(a.ctx, REMAP_FORWARD, &how, 1, &f[0]), REMAP_OK);
    RT_EQ(remap_field_start(b.ctx, REMAP_FORWARD, &how, 1, &f[1]), REMAP_OK);
    RT_EQ(remap_field_finish(b.ctx, REMAP_FORWARD, NULL), REMAP_OK);
    RT_EQ(remap_field_finish(a.ctx, REMAP_FORWARD, NULL), REMAP_OK);
    RT_CHECK(same(got[0], want[0], a.cells[1]) && same(got[1], want[1], b.cells[1]));
    for (int k = 0; k < 2; k++) free(want[k]), free(got[k]);
  }
  close_world(&a), close_world(&b);
}

RT_MAIN(RT_CASE(halves_make_the_same_as_a_whole_in_both_directions_at_once),
        RT_CASE(halves_out_of_order_are_refused_and_a_context_may_end_between_them),
        RT_CASE(transfers_after_the_first_take_no_memory), RT_CASE(transfers_after_the_first_are_exchanges_with_neighbours),
        RT_CASE(what_fails_on_one_rank_reaches_its_neighbours_and_all_by_agreement),
        RT_CASE(a_first_transfer_that_one_rank_gets_wrong_fails_on_all),
        RT_CASE(transfers_that_differ_between_ranks_are_refused_where_they_meet),
        RT_CASE(strides_and_places_leave_the_rest_alone),
        RT_CASE(blocks_with_indices_of_any_kind_make_the_same_bits_as_one_mesh), RT_CASE(masked_cells_are_as_good_as_not_there),
        RT_CASE(meshes_on_ranks_of_their_own_make_the_same_bits), RT_CASE(pairs_and_their_owners_are_enough_for_a_transfer),
        RT_CASE(contexts_do_not_know_of_each_other))
