/* One rank fails, at every place where it can: memory that runs out at its n-th request, a callback that cancels, data that are
 * wrong. Every rank returns the same status, none waits for another for ever, and the context is good for another try. */
#include <remap/remap.h>
#include "meshes.h"
#include "rt.h"

/* ---- memory: the library's requests come here by the linker's --wrap ----------------------------------------------------- */

static long left = -1; /* requests until one fails, -1: none does */
static bool is_out(void) { return left >= 0 && left-- == 0; }

void *__real_malloc(size_t size);
void *__real_calloc(size_t n, size_t size);
void *__real_realloc(void *old, size_t size);
void *__real_aligned_alloc(size_t alignment, size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t n, size_t size);
void *__wrap_realloc(void *old, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
void *__wrap_malloc(size_t size) { return is_out() ? NULL : __real_malloc(size); }
void *__wrap_calloc(size_t n, size_t size) { return is_out() ? NULL : __real_calloc(n, size); }
void *__wrap_realloc(void *old, size_t size) { return is_out() ? NULL : __real_realloc(old, size); }
void *__wrap_aligned_alloc(size_t alignment, size_t size) { return is_out() ? NULL : __real_aligned_alloc(alignment, size); }

static bool is_last(void) { return rt_rank() == rt_size() - 1; }

/* ---- a step of a solver ------------------------------------------------------------------------------------------------ */

typedef struct world {
  remap_context *ctx;
  tm_mesh       *mine[2];
  double        *u[2];
  uint8_t       *mask[2];
} world;

static int calls_left = -1; /* calls of the callback until it cancels on the last rank, -1: it does not */
static int progress(void *user, const char *phase, double done)
{
  (void)user, (void)phase, (void)done;
  return calls_left >= 0 && calls_left-- == 0;
}

static void open_world(world *w, int n)
{
  remap_options options;

  remap_options_default(&options);
  options.progress = progress;
  RT_EQ(remap_create(MPI_COMM_WORLD, &options, &w->ctx), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    static const double away[12] = {1, 0, 0, .3, 0, 1, 0, .2, 0, 0, 1, -.1};
    tm_mesh *whole = tm_hexahedra((int[]){n, n, n + side}, tm_warp, &(tm_warping){0.03, 0.7});

    if (side) tm_move(whole, tm_affine, away);
    int *deal      = tm_deal(whole, rt_size(), TM_RANDOM, 3);
    w->mine[side]  = tm_part(whole, deal, rt_rank(), 3);
    w->u[side]     = tm_alloc_(whole->view.num_cells, sizeof(double));
    w->mask[side]  = tm_alloc_(whole->view.num_cells, 1);
    for (int64_t c = 0; c < w->mine[side]->view.num_cells; c++) w->mask[side][c] = c % 5 != 0;
    RT_EQ(remap_set_mesh(w->ctx, side, &w->mine[side]->view), REMAP_OK);
    tm_free(whole), free(deal);
  }
}

static void close_world(world *w)
{
  remap_destroy(&w->ctx);
  for (int side = 0; side < 2; side++) tm_free(w->mine[side]), free(w->u[side]), free(w->mask[side]);
}

/* Step n of a motion: the source moves by a little. */
static remap_status step(world *w, int n)
{
  const double       m[12]     = {1, 0, 0, .001 * n, 0, 1, 0, 0, 0, 0, 1, 0};
  const remap_motion motion[2] = {{NULL, m}, {NULL, NULL}};

  return remap_move(w->ctx, motion);
}

/* A build, and steps that leave something for the next one to keep. */
static void prepare_move(world *w)
{
  RT_EQ(remap_build(w->ctx), REMAP_OK);
  for (int n = 1; n <= 2; n++) RT_EQ(step(w, n), REMAP_OK);
}

/* Build, or move if moves is true; mask; transfer both ways. Stops where something fails, after an agreement. */
static remap_status run(world *w, bool moves)
{
  const remap_masks   masks      = {.gives = {w->mask[0], NULL}, .wants = {NULL, w->mask[1]}};
  remap_transfer      how;
  remap_status        status;

  remap_transfer_default(&how);
  how.on_uncovered = REMAP_UNCOVERED_NEAREST;
  status           = moves ? step(w, 3) : remap_build(w->ctx);
  if (status == REMAP_OK) status = remap_set_masks(w->ctx, &masks);
  for (int d = 0; d < 2 && status == REMAP_OK; d++) {
    const remap_field_desc f = {.nature = REMAP_CONSERVED, .in = w->u[d], .out = w->u[1 - d]};
    remap_field_report     report;

    status = remap_field(w->ctx, d, &how, 1, &f, d ? &report : NULL);
    if (status == REMAP_OK && d == 0) status = remap_agree(w->ctx, status);
  }
  return status;
}

/* The status on every rank is the same. */
static bool is_agreed(remap_status mine)
{
  int extreme[2] = {(int)mine, -(int)mine};

  MPI_Allreduce(MPI_IN_PLACE, extreme, 2, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  return rt_all(RT_EQ(extreme[0], -extreme[1]));
}

/* Until the n-th request does not come any more. One that fails in a check of a debug build is overlooked there. */
static void exhaust(bool moves)
{
  int   failed = 0;
  bool  comes  = true;
  world w;

  open_world(&w, moves ? 4 : 6); /* 6: large enough for arrays with blocks of their own */
  for (int n = 0; comes && n < 2000; n++) {
    remap_status status;

    if (moves) prepare_move(&w);
    left   = is_last() ? n : -1;
    status = run(&w, moves);
    comes  = !rt_all(!is_last() || left >= 0);
    left   = -1;
    if (!is_agreed(status)) break;
    RT_CHECK(status == REMAP_OK || status == REMAP_NO_MEMORY);
    failed += status != REMAP_OK;
  }
  RT_CHECK(!comes && failed > 30);
  close_world(&w);
}
static void memory_that_runs_out_anywhere_in_build_mask_or_transfer_is_told_to_all(void) { exhaust(false); }
static void memory_that_runs_out_anywhere_in_a_move_is_told_to_all(void) { exhaust(true); }

static void cancelling_at_any_call_stops_all_ranks(void)
{
  world w;

  open_world(&w, 3);
  for (int moves = 0; moves < 2; moves++) {
    remap_status status = REMAP_CANCELLED;
    int          failed = 0;

    for (int n = 0; status == REMAP_CANCELLED && n < 1000; n++) {
      if (moves) prepare_move(&w);
      calls_left = is_last() ? n : -1;
      status     = run(&w, moves);
      calls_left = -1;
      if (!is_agreed(status)) break;
      failed += status != REMAP_OK;
    }
    RT_EQ(status, REMAP_OK);
    RT_CHECK(failed >= 4);
  }
  close_world(&w);
}

/* Damage to the last rank's part, for as long as it takes. */
typedef enum damage { NAN_NODE, WILD_NODE, WILD_OWNER, OPEN_CELL, NO_ARRAY, TWIN_IDS, NUM_DAMAGES } damage;
static void hurt(remap_mesh *view, tm_mesh *m, damage kind)
{
  switch (kind) {
    case NAN_NODE: m->xyz[1] = NAN; break;
    case WILD_NODE: m->face_node[0] = view->num_nodes; break;
    case WILD_OWNER: m->owner[0] = -5; break;
    case OPEN_CELL: view->num_faces--; break;
    case NO_ARRAY: view->face_owner = NULL; break;
    default: m->global[0] = m->global[1]; break;
  }
}

static void bad_data_of_one_rank_fail_on_all(void)
{
  for (int side = 0; side < 2; side++)
    for (int kind = 0; kind < NUM_DAMAGES; kind++) {
      world      w;
      remap_mesh view;

      open_world(&w, 3);
      view = w.mine[side]->view;
      if (is_last() && rt_all(1)) hurt(&view, w.mine[side], kind);
      else if (!is_last()) rt_all(1);
      RT_EQ(remap_set_mesh(w.ctx, side, &view), REMAP_OK);
      const remap_status status = run(&w, false);
      if (is_agreed(status)) RT_EQ(status, REMAP_BAD_MESH);
      RT_CHECK(remap_message(w.ctx)[0] != '\0');
      close_world(&w);
    }
}

static void an_option_of_one_rank_fails_on_all(void)
{
  remap_context *ctx = NULL;
  remap_options  options;

  remap_options_default(&options);
  if (is_last()) options.max_order = 7;
  RT_EQ(remap_create(MPI_COMM_WORLD, &options, &ctx), REMAP_BAD_ARGUMENT);
  RT_CHECK(ctx == NULL);
  remap_status status = REMAP_NO_MEMORY;
  int          failed = 0;
  for (int n = 0; n < 100 && status == REMAP_NO_MEMORY; n++) { /* memory for a context, on one rank */
    left   = is_last() ? n : -1;
    status = remap_create(MPI_COMM_WORLD, NULL, &ctx);
    left   = -1;
    if (!is_agreed(status)) break;
    failed += status == REMAP_NO_MEMORY && !ctx;
    remap_destroy(&ctx);
  }
  RT_EQ(status, REMAP_OK);
  RT_CHECK(failed > 1);
}

RT_MAIN(RT_CASE(memory_that_runs_out_anywhere_in_build_mask_or_transfer_is_told_to_all),
        RT_CASE(memory_that_runs_out_anywhere_in_a_move_is_told_to_all), RT_CASE(cancelling_at_any_call_stops_all_ranks),
        RT_CASE(bad_data_of_one_rank_fail_on_all), RT_CASE(an_option_of_one_rank_fails_on_all))
