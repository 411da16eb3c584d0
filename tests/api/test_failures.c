/* One rank fails, at every place where it can: memory that runs out at its n-th request, a callback that cancels, data that are
 * wrong. Every rank returns the same status, none waits for another for ever, and the context is good for another try. */
#include "api/context.h"
#include "heap.h"
#include "meshes.h"
#include "rt.h"

static bool is_last(void) { return rt_rank() == rt_size() - 1; }

/* ---- a step of a solver ------------------------------------------------------------------------------------------------ */

enum { NUM_FIELDS = 3 };

typedef struct world {
  remap_context *ctx;
  tm_mesh       *mine[2];
  double        *u[2]; /* [side][NUM_FIELDS][cells] */
  uint8_t       *mask[2];
} world;

/* What is tried. */
typedef enum work {
  BUILD,    /* build; mask; transfer both ways           */
  MOVE,     /* the same after a move                     */
  SYSTEMS,  /* build; transfers of order 3, CAAS, systems */
  SUPERMESH /* a supermesh, and what belongs to it       */
} work;

static int calls_left = -1; /* calls of the callback until it cancels on the last rank, -1: it does not */
static int progress(void *user, const char *phase, double done)
{
  (void)user, (void)phase, (void)done;
  return calls_left >= 0 && calls_left-- == 0;
}

static void open_world(world *w, int n, work what)
{
  remap_options options;

  remap_options_default(&options);
  options.max_order = what == SYSTEMS ? 3 : 2;
  options.systems   = what == SYSTEMS;
  options.progress = progress;
  RT_EQ(remap_create(MPI_COMM_WORLD, &options, &w->ctx), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    static const double away[12] = {1, 0, 0, .3, 0, 1, 0, .2, 0, 0, 1, -.1};
    tm_mesh *whole = tm_hexahedra((int[]){n, n, n + side}, tm_warp, &(tm_warping){0.03, 0.7});

    if (side) tm_move(whole, tm_affine, away);
    int *deal      = tm_deal(whole, rt_size(), TM_RANDOM, 3);
    w->mine[side]  = tm_part(whole, deal, rt_rank(), 3);
    w->u[side]     = tm_alloc_(NUM_FIELDS * whole->view.num_cells, sizeof(double));
    w->mask[side]  = tm_alloc_(whole->view.num_cells, 1);
    for (int64_t c = 0; c < w->mine[side]->view.num_cells; c++) w->mask[side][c] = c % 5 != 0;
    for (int64_t c = 0; c < NUM_FIELDS * w->mine[side]->view.num_cells; c++) w->u[side][c] = 1 + (double)(c % 3);
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

/* Mask, and transfer both ways. */
static remap_status transfer(world *w)
{
  const remap_masks masks = {.gives = {w->mask[0], NULL}, .wants = {NULL, w->mask[1]}};
  remap_transfer    how;
  remap_status      status;

  remap_transfer_default(&how);
  how.on_uncovered = REMAP_UNCOVERED_NEAREST;
  status           = remap_set_masks(w->ctx, &masks);
  for (int d = 0; d < 2 && status == REMAP_OK; d++) {
    const remap_field_desc f = {.nature = REMAP_CONSERVED, .in = w->u[d], .out = w->u[1 - d]};
    remap_field_report     report;

    status = remap_field(w->ctx, d, &how, 1, &f, d ? &report : NULL);
    if (status == REMAP_OK && d == 0) status = remap_agree(w->ctx, status);
  }
  return status;
}

/* A gas that moves, then the same numbers one by one with another limiter. */
static remap_status transfer_systems(world *w)
{
  static const remap_role role[NUM_FIELDS] = {REMAP_ROLE_DENSITY, REMAP_ROLE_MOMENTUM_X, REMAP_ROLE_MASS_FRACTION};
  const int64_t           n[2] = {w->mine[0]->view.num_cells, w->mine[1]->view.num_cells};
  remap_field_desc        f[NUM_FIELDS];
  remap_field_report      report[NUM_FIELDS];
  remap_transfer          how;
  remap_status            status = REMAP_OK;

  remap_transfer_default(&how);
  for (int one_by_one = 0; one_by_one < 2 && status == REMAP_OK; one_by_one++) {
    how.order   = 2 + one_by_one;
    how.limiter = one_by_one ? REMAP_LIMITER_CAAS : REMAP_LIMITER_AUTO;
    for (int k = 0; k < NUM_FIELDS; k++)
      f[k] = (remap_field_desc){
          .system = !one_by_one, .role = role[k], .in = w->u[0] + k * n[0], .out = w->u[1] + k * n[1]};
    status = remap_field(w->ctx, REMAP_FORWARD, &how, NUM_FIELDS, f, report);
  }
  return status;
}

/* The supermesh of the meshes as they were lent, and values on it. */
static remap_status make_supermesh(world *w)
{
  remap_supermesh_options options;
  remap_supermesh_view    view;
  remap_status            status;

  remap_supermesh_options_default(&options);
  options.keep         = REMAP_IN_BOTH | REMAP_IN_SOURCE;
  options.pass_through = 1;
  status               = remap_supermesh(w->ctx, &options, &view);
  if (status == REMAP_OK) {
    const int64_t requests = heap.left;

    heap.left             = -1; /* for what is the test's own */
    double  *values = tm_alloc_(view.num_cells, sizeof *values);
    int32_t *faces = tm_alloc_(view.num_faces, sizeof *faces), *in = tm_alloc_(w->mine[0]->view.num_faces, sizeof *in);
    heap.left        = requests;

    status = remap_supermesh_cell_values(w->ctx, REMAP_TARGET, w->u[1], 0.0, values);
    if (status == REMAP_OK) status = remap_supermesh_face_values(w->ctx, REMAP_SOURCE, in, -1, faces);
    free(values), free(faces), free(in);
  }
  return status;
}

/* Stops where something fails, after an agreement. */
static remap_status run(world *w, work what)
{
  remap_status status = what == MOVE ? step(w, 3) : what == SUPERMESH ? REMAP_OK : remap_build(w->ctx);

  if (status != REMAP_OK) return status;
  return what == SUPERMESH ? make_supermesh(w) : what == SYSTEMS ? transfer_systems(w) : transfer(w);
}

/* The status on every rank is the same. */
static bool is_agreed(remap_status mine)
{
  int extreme[2] = {(int)mine, -(int)mine};

  MPI_Allreduce(MPI_IN_PLACE, extreme, 2, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  return rt_all(RT_EQ(extreme[0], -extreme[1]));
}

/* Until the n-th request does not come any more. One that fails in a check of a debug build is overlooked there. */
static void exhaust(work what)
{
  int   failed = 0;
  bool  comes  = true;
  world w;

  /* 6: large enough for arrays with blocks of their own */
  open_world(&w, what == BUILD ? 6 : what == MOVE ? 4 : what == SYSTEMS ? 3 : 2, what);
  /* the build of the largest has two blocks or three */
  w.ctx->slicing = (rm_slicing){.triangles = 4000 / rt_size(), .repeats = INFINITY};
  for (int n = 0; comes && n < 2000; n++) {
    remap_status status;

    if (what == MOVE) prepare_move(&w);
    heap.left   = is_last() ? n : -1;
    status = run(&w, what);
    comes  = !rt_all(!is_last() || heap.left >= 0);
    heap.left   = -1;
    if (!is_agreed(status)) break;
    RT_CHECK(status == REMAP_OK || status == REMAP_NO_MEMORY);
    RT_CHECK(status == REMAP_OK || remap_message(w.ctx)[0] != '\0');
    failed += status != REMAP_OK;
  }
  RT_CHECK(!comes && failed > 30);
  close_world(&w);
}
static void memory_that_runs_out_anywhere_in_build_mask_or_transfer_is_told_to_all(void) { exhaust(BUILD); }
static void memory_that_runs_out_anywhere_in_a_move_is_told_to_all(void) { exhaust(MOVE); }
static void memory_that_runs_out_anywhere_in_a_transfer_of_systems_is_told_to_all(void) { exhaust(SYSTEMS); }
static void memory_that_runs_out_anywhere_in_a_supermesh_is_told_to_all(void) { exhaust(SUPERMESH); }

/* On the overlay that is there: what ranks have prepared of it is on all of them or on none. */
static void a_transfer_that_ran_out_of_memory_is_made_again_without_a_build(void)
{
  int   failed = 0;
  bool  comes  = true;
  world w;

  open_world(&w, 3, SYSTEMS);
  for (int n = 0; comes && n < 2000; n++) {
    RT_EQ(remap_build(w.ctx), REMAP_OK);
    heap.left                 = is_last() ? n : -1;
    const remap_status status = transfer_systems(&w);
    comes                     = !rt_all(!is_last() || heap.left >= 0);
    heap.left                 = -1;
    if (!is_agreed(status)) break;
    failed += status == REMAP_NO_MEMORY;
    if (!rt_all(RT_EQ(transfer_systems(&w), REMAP_OK))) break;
  }
  RT_CHECK(!comes && failed > 30);
  close_world(&w);
}

static void cancelling_at_any_call_stops_all_ranks(void)
{
  for (work what = BUILD; what <= SUPERMESH; what++) {
    remap_status status = REMAP_CANCELLED;
    int          failed = 0;
    world        w;

    open_world(&w, 3, what);
    for (int n = 0; status == REMAP_CANCELLED && n < 1000; n++) {
      if (what == MOVE) prepare_move(&w);
      calls_left = is_last() ? n : -1;
      status     = run(&w, what);
      calls_left = -1;
      if (!is_agreed(status)) break;
      failed += status != REMAP_OK;
    }
    RT_EQ(status, REMAP_OK);
    RT_CHECK(failed >= 4);
    close_world(&w);
  }
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
    for (int kind = 0; kind < 2 * NUM_DAMAGES; kind++) {
      world      w;
      remap_mesh view;

      open_world(&w, 3, BUILD);
      view = w.mine[side]->view;
      if (is_last() && rt_all(1)) hurt(&view, w.mine[side], kind / 2);
      else if (!is_last()) rt_all(1);
      RT_EQ(remap_set_mesh(w.ctx, side, &view), REMAP_OK);
      const remap_status status = run(&w, kind % 2 ? SUPERMESH : BUILD);
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
    heap.left   = is_last() ? n : -1;
    status = remap_create(MPI_COMM_WORLD, NULL, &ctx);
    heap.left   = -1;
    if (!is_agreed(status)) break;
    failed += status == REMAP_NO_MEMORY && !ctx;
    remap_destroy(&ctx);
  }
  RT_EQ(status, REMAP_OK);
  RT_CHECK(failed > 1);
}

static void pairs_without_memory_are_refused_with_a_message_and_handed_out_later(void)
{
  world            w;
  remap_pairs_view pairs;
  remap_status     status = REMAP_NO_MEMORY;
  int              failed = 0;

  open_world(&w, 14, BUILD); /* large enough for arrays with blocks of their own */
  RT_EQ(remap_build(w.ctx), REMAP_OK);
  for (int d = 0; d < 2; d++, status = REMAP_NO_MEMORY) {
    for (int n = 0; status == REMAP_NO_MEMORY && n < 100; n++) { /* not collective: every rank runs out by itself */
      heap.left   = n;
      status = remap_pairs(w.ctx, d, &pairs);
      heap.left   = -1;
      failed += status == REMAP_NO_MEMORY;
      RT_CHECK((status == REMAP_NO_MEMORY) == (strstr(remap_message(w.ctx), "remap_pairs: no memory") != NULL));
    }
    RT_EQ(status, REMAP_OK);
    RT_CHECK(pairs.num_rows == 0 || pairs.volume != NULL);
  }
  RT_CHECK(failed > 1);
  close_world(&w);
}

RT_MAIN(RT_CASE(memory_that_runs_out_anywhere_in_build_mask_or_transfer_is_told_to_all),
        RT_CASE(memory_that_runs_out_anywhere_in_a_move_is_told_to_all),
        RT_CASE(memory_that_runs_out_anywhere_in_a_transfer_of_systems_is_told_to_all),
        RT_CASE(memory_that_runs_out_anywhere_in_a_supermesh_is_told_to_all),
        RT_CASE(a_transfer_that_ran_out_of_memory_is_made_again_without_a_build),
        RT_CASE(cancelling_at_any_call_stops_all_ranks),
        RT_CASE(bad_data_of_one_rank_fail_on_all), RT_CASE(an_option_of_one_rank_fails_on_all),
        RT_CASE(pairs_without_memory_are_refused_with_a_message_and_handed_out_later))
