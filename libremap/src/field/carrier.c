/* carrier -- fields from giving to receiving cells, in two steps.
 *
 *   start    values are gathered, checked and converted; those of the stencil's halo travel (order 2), or all that is given
 *            (order 1)
 *   finish   reconstruction of the giving cells, with its own messages (profile); what is given travels; slopes of systems are
 *            scaled (admit); cells receive; for CAAS, a sum over all ranks; uncovered cells take the nearest value, where there
 *            are any; exact integrals, where somebody wants them; values are written
 *
 * Every message carries its sender's status, so a failure reaches all who depend on it, in the exchange that follows. The
 * caller's arrays are written at the very end, when nothing can fail any more. What a rank gives to itself is read where it was
 * reconstructed. O(pairs) time per field; for each field 8 bytes per receiving cell (16 for CAAS), 8 per giving cell and what
 * profile takes. */
#include "field_private.h"

#include <string.h>

struct rm_carrier {
  rm_transfer_setup setup;
  rm_load           load;               /* the most it can carry                                       */
  rm_profile        giving;             /* of the giving cells                                         */
  rm_profile        keeping;            /* of old content that receiving cells keep, if they blend it  */
  double           *kept, *kept_number; /* [receiving cells][num_fields] likewise               */
  double           *given;              /* [giving cells][num_fields] as the caller gave them            */
  double           *number;             /* [giving cells][num_fields] what is reconstructed; given itself without systems */
  double           *old;                /* [receiving cells][num_fields] values before, if CAAS needs them */
  rm_sum           *sum;                /* [num_fields][3] of CAAS                                      */
  rm_flow           given_flow;         /* what giving cells give                                       */
  rm_admission      admission;          /* of systems with slopes                                       */
  rm_flow           taken;              /* values that uncovered cells take                             */
  const rm_nearest *nearest;            /* NULL: nobody takes any                                       */
  double           *value;              /* [receiving cells][num_fields] old values, then new ones      */
  double           *room;               /* [5][num_fields]                                              */
  double           *content;            /* [RM_FEW_CELLS][num_fields]                                   */
  uint8_t          *is_plain;           /* [receiving cells] of rm_find_plain                           */
  rm_integral      *integral;           /* [num_fields]                                                 */
  double           *extreme;            /* [4][num_fields] least, least, greatest, greatest              */
  int64_t          *count;              /* [num_fields][NUM_COUNTS] for reports                         */

  /* of the transfer under way: */
  bool              is_under_way;
  remap_transfer    how;
  remap_field_desc *fields; /* [num_fields] */
  rm_packing        packing;
  rm_word           word;
  rm_parley         next; /* in place of the word's from the next transfer on, if it has peers */
};

/* What reports count, over all ranks. */
enum { LIMITED, REDUCED, SCALED, BLENDED, NORMALISED, KEPT, NEAREST, FILLED, SPOILT, NUM_COUNTS };

/* ---- build ------------------------------------------------------------------------------------------------------- */

static remap_status make_packing(rm_arena *arena, const rm_load *load, rm_packing *p)
{
  RM_NEW(p->at, arena, load->num_fields);
  RM_NEW(p->step, arena, load->num_fields);
  RM_NEW(p->order, arena, load->num_fields);
  RM_NEW(p->degree, arena, load->num_fields);
  RM_NEW(p->system_of, arena, load->num_fields);
  RM_NEW(p->system, arena, load->num_systems);
  RM_NEW(p->span, arena, load->num_fields);
  return REMAP_OK;
}

/* What old content takes. */
static remap_status make_keeping(rm_arena *arena, rm_carrier *c)
{
  const rm_transfer_setup *setup = &c->setup;
  const int64_t            num   = rm_mul_sat(setup->receiving->num_cells, c->load.num_fields);

  RM_NEW(c->kept, arena, rm_add_sat(num, 1)); /* one more, here and below: lanes.h */
  if (c->load.num_systems > 0) RM_NEW(c->kept_number, arena, rm_add_sat(num, 1));
  c->keeping.ground = (rm_ground){.mesh       = setup->receiving,
                                  .stencil    = setup->keeping_stencil,
                                  .rows       = setup->rows,
                                  .second     = setup->receiving_second,
                                  .is_keeping = true};
  c->keeping.given  = c->kept;
  RM_NEW(c->keeping.pack, arena, rm_add_sat(rm_mul_sat(setup->receiving->num_cells, c->load.width), 1));
  return rm_profile_init(arena, (int)setup->giving->side, &c->load, &c->keeping);
}

/* Where giving cells stand in their pack: those that this rank wants from itself where it receives them, so that nobody moves
 * them; others behind all that it receives. The number of places goes to *num. */
static remap_status place_cells(rm_arena *arena, const rm_transfer_setup *setup, const rm_lid **out, int64_t *num)
{
  const rm_plan *plan  = setup->rows->plan;
  const rm_lid   cells = setup->giving->num_cells;
  const int64_t  first = plan->own_send >= 0 ? plan->send_offset[plan->own_send] : 0;
  const int64_t  end   = plan->own_send >= 0 ? plan->send_offset[plan->own_send + 1] : 0;
  rm_lid        *place;

  *num = setup->rows->num_givers;
  if (*num > INT32_MAX - cells) return REMAP_TOO_LARGE;
  RM_NEW(place, arena, cells);
  for (rm_lid c = 0; c < cells; c++) place[c] = -1;
  for (int64_t k = first; k < end; k++) place[plan->send_item[k]] = (rm_lid)(plan->recv_offset[plan->own_recv] + k - first);
  for (rm_lid c = 0; c < cells; c++)
    if (place[c] < 0) place[c] = (rm_lid)(*num)++;
  *out = place;
  return REMAP_OK;
}

/* The pack of the giving cells, and the flow that brings those of other ranks. */
static remap_status make_pack(rm_arena *arena, rm_carrier *c, int stream)
{
  const rm_plan *plan;
  int64_t        num;

  RM_TRY(place_cells(arena, &c->setup, &c->giving.place, &num));
  RM_TRY(rm_plan_renumber(arena, c->setup.rows->plan, c->giving.place, &plan));
  RM_NEW(c->giving.pack, arena, rm_add_sat(rm_mul_sat(num, c->load.width), 1));
  return rm_flow_init_into(arena, plan, stream, (size_t)c->load.width * sizeof(double), c->giving.pack, &c->given_flow);
}

/* All memory that transfers need. Not collective. */
static remap_status make_room(rm_arena *arena, rm_carrier *c)
{
  const rm_transfer_setup *setup  = &c->setup;
  const int                n      = c->load.num_fields;
  const int                stream = (int)setup->giving->side; /* transfers either way may be under way at once */
  const size_t             bytes  = (size_t)n * sizeof(double);

  RM_TRY(make_packing(arena, &c->load, &c->packing));
  RM_NEW(c->given, arena, rm_add_sat(rm_mul_sat(setup->giving->num_cells, n), 1)); /* one more, here and below: lanes.h */
  if (c->load.num_systems > 0) RM_NEW(c->number, arena, rm_add_sat(rm_mul_sat(setup->giving->num_cells, n), 1));
  RM_NEW(c->value, arena, rm_mul_sat(setup->receiving->num_cells, n));
  RM_NEW(c->room, arena, 5 * (int64_t)n);
  RM_NEW(c->content, arena, RM_FEW_CELLS * (int64_t)n);
  RM_NEW(c->is_plain, arena, setup->receiving->num_cells);
  RM_NEW(c->integral, arena, n);
  RM_NEW(c->extreme, arena, 4 * (int64_t)n);
  RM_NEW(c->count, arena, NUM_COUNTS * (int64_t)n);
  RM_NEW(c->fields, arena, n);
  c->giving.ground = (rm_ground){.mesh    = setup->giving,
                                 .stencil = setup->giving_stencil,
                                 .rows    = setup->giving_rows,
                                 .second  = setup->giving_second,
                                 .measure = setup->giving_measure,
                                 .differs = setup->giving_differs};
  c->giving.given  = c->given;
  RM_TRY(rm_profile_init(arena, stream, &c->load, &c->giving));
  if (c->load.is_blended) RM_TRY(make_keeping(arena, c));
  if (c->load.is_settled) {
    RM_NEW(c->old, arena, rm_mul_sat(setup->receiving->num_cells, n));
    RM_NEW(c->sum, arena, 3 * (int64_t)n);
  }
  if (c->load.is_curved) RM_TRY(rm_admission_init(arena, setup, &c->load, &c->admission));
  if (c->load.has_nearest) RM_TRY(rm_flow_init(arena, c->nearest->plan, stream, bytes, &c->taken));
  return make_pack(arena, c, stream);
}

int rm_carrier_plans(const rm_carrier *c, const rm_plan *plan[RM_CARRIER_PLANS])
{
  int num = 0;

  plan[num++] = c->setup.rows->plan;
  plan[num++] = c->setup.giving_rows->plan;
  if (c->load.has_slopes) plan[num++] = c->setup.giving_stencil->plan;
  if (c->load.has_slopes && c->load.is_blended) plan[num++] = c->setup.keeping_stencil->plan;
  if (c->load.has_nearest) plan[num++] = c->nearest->plan;
  return num;
}

/* A parley with those that this carrier sends to. */
static remap_status make_parley(rm_arena *arena, rm_carrier *c)
{
  const rm_plan  *plan[RM_CARRIER_PLANS];
  const rm_peers *peers;

  RM_TRY(rm_peers_build(arena, c->setup.comm, rm_carrier_plans(c, plan), plan, &peers));
  return rm_parley_init(arena, peers, &c->next);
}

remap_status rm_carrier_build(rm_arena *arena, const rm_transfer_setup *setup, rm_load load, rm_carrier **out,
                              rm_reason *reason)
{
  const rm_comm *comm = setup->comm;
  rm_carrier    *c    = rm_arena_zero(arena, 1, sizeof *c);

  RM_TRY(rm_comm_agree(comm, c ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(c);
  c->setup = *setup;
  c->load  = load;
  if (load.has_nearest)
    RM_TRY(rm_nearest_build(arena, comm, setup->receiving, setup->receiving_stencil, setup->rows->cover, &c->nearest, reason));
  RM_TRY(rm_comm_agree(comm, make_room(arena, c), NULL));
  rm_find_plain(setup, c->is_plain);
  RM_TRY(rm_comm_agree(comm, make_parley(arena, c), NULL));
  *out = c;
  return REMAP_OK;
}

void rm_carrier_meet(rm_carrier *c, const rm_parley *parley) { c->next = *parley; }

void rm_carrier_confirm(rm_carrier *c, uint64_t mark)
{
  rm_word_await(&c->word, c->setup.comm, rm_profile_reads_halo(&c->packing) ? &c->giving.halo : &c->given_flow);
  rm_word_hear(&c->word, rm_parley_confirm(c->setup.comm, &c->word.parley, mark));
}

bool rm_carrier_is_under_way(const rm_carrier *carrier) { return carrier && carrier->is_under_way; }

void rm_carrier_abandon(rm_carrier *c)
{
  if (!rm_carrier_is_under_way(c)) return;
  c->is_under_way = false;
  rm_profile_abandon(&c->giving, c->setup.comm, &c->word);
  rm_word_await(&c->word, c->setup.comm, &c->given_flow);
}

/* ---- start ------------------------------------------------------------------------------------------------------- */

static remap_status check_coverage(const rm_carrier *c, rm_reason *reason)
{
  const rm_mesh *mesh = c->setup.receiving;

  if (c->how.on_uncovered != REMAP_UNCOVERED_ERROR && c->how.on_partial != REMAP_PARTIAL_ERROR) return REMAP_OK;
  for (rm_lid i = 0; i < mesh->num_cells; i++) {
    const uint8_t cover     = c->setup.rows->cover[i];
    const bool    has_space = fabs(mesh->cell_volume[i]) > 0.0;

    if (cover == REMAP_UNCOVERED && has_space && c->how.on_uncovered == REMAP_UNCOVERED_ERROR)
      return rm_fail(REMAP_COVERAGE, reason, mesh->side, mesh->cell_global[i], "the cell lies outside of the other mesh");
    if (cover == REMAP_PARTIAL && c->how.on_partial == REMAP_PARTIAL_ERROR)
      return rm_fail(REMAP_COVERAGE, reason, mesh->side, mesh->cell_global[i],
                     "the cell lies outside of the other mesh in part");
  }
  return REMAP_OK;
}

/* Is any field's old content reconstructed? */
static bool blends(const rm_carrier *c)
{
  bool any = false;

  for (int f = 0; f < c->packing.num_fields; f++) any |= rm_is_blended(&c->setup, &c->how, &c->fields[f]);
  return any;
}

/* Values from the caller's arrays, checked, turned and converted. The first failure ends it. */
static remap_status gather(rm_carrier *c)
{
  const rm_transfer_setup *setup  = &c->setup;
  rm_reason               *reason = &c->word.reason;

  RM_TRY(rm_gather_given(setup, &c->packing, c->given, reason));
  RM_TRY(rm_gather_old(setup, &c->packing, c->value, reason));
  rm_turn_vectors(setup, &c->packing, c->given);
  if (c->packing.num_systems > 0) {
    RM_TRY(rm_gather_numbers(setup->giving, setup->giving_rows, &c->packing, c->given, c->number, reason));
    RM_TRY(rm_gather_amounts(setup, &c->packing, c->value, c->room, reason));
  }
  if (blends(c)) rm_gather_kept(setup, &c->packing, c->kept, c->kept_number);
  return check_coverage(c, reason);
}

/* Give what is packed to those who receive it. */
static void give(rm_carrier *c)
{
  rm_word_post(&c->word, c->setup.comm, &c->given_flow, (size_t)c->packing.width * sizeof(double), c->giving.pack);
}

void rm_carrier_start(rm_carrier *c, const remap_transfer *how, int num_fields, const remap_field_desc *fields, uint64_t mark,
                      remap_status mine, const rm_reason *reason)
{
  RM_ASSERT(!c->is_under_way && rm_load_covers(c->load, rm_load_of(&c->setup, how, num_fields, fields)));
  c->is_under_way = true;
  c->how          = *how;
  c->word =
      (rm_word){{mark, (int32_t)mine, 0, 0}, mine, *reason, c->next.peers ? c->next : c->word.parley, false, false, false};
  c->next.peers = NULL;
  for (int f = 0; f < num_fields; f++) c->fields[f] = fields[f];
  rm_packing_fill(&c->packing, &c->setup, &c->how, num_fields, c->fields);
  c->giving.number  = c->packing.num_systems > 0 ? c->number : c->given;
  c->keeping.number = c->packing.num_systems > 0 ? c->kept_number : c->kept;
  if (mine == REMAP_OK) rm_word_add(&c->word, gather(c));
  c->how.rotation = NULL; /* the caller's again */
  rm_profile_post(&c->giving, c->setup.comm, &c->packing, &c->word);
  if (!rm_profile_reads_halo(&c->packing)) give(c);
}

/* ---- finish ------------------------------------------------------------------------------------------------------ */

/* Uncovered cells take their values. */
static void take_nearest(rm_carrier *c)
{
  const rm_nearest *nearest = c->nearest;
  const int         num     = c->packing.num_fields;
  const double     *got     = rm_flow_numbers(&c->taken);

  rm_word_post(&c->word, c->setup.comm, &c->taken, (size_t)num * sizeof(double), c->value);
  rm_word_await(&c->word, c->setup.comm, &c->taken);
  if (c->word.note.status != REMAP_OK) return;
  for (int64_t k = 0; k < nearest->num; k++)
    for (int f = 0; f < num; f++)
      if (rm_needs_nearest(&c->how, &c->fields[f]))
        c->value[(int64_t)nearest->cell[k] * num + f] = got[(int64_t)nearest->origin[k] * num + f];
}

/* Clip the new values and give back what that takes. Collective. */
static void settle(rm_carrier *c, const rm_receipt *receipt)
{
  if (!rm_word_agree(&c->word, c->setup.comm)) return;
  rm_caas_sum(receipt, c->old, c->sum);
  rm_word_add(&c->word, rm_comm_sum_exact(c->setup.comm, c->sum, 3 * c->packing.num_fields));
  if (c->word.note.status == REMAP_OK) rm_caas_settle(receipt, c->old, c->sum, c->giving.limited);
}

/* Does a system have slopes? */
static bool has_sloped_system(const rm_packing *packing)
{
  bool has = false;

  for (int s = 0; s < packing->num_systems; s++) has |= packing->degree[packing->system[s].density] > 0;
  return has;
}

/* Everything up to the new values. */
static void carry(rm_carrier *c, bool wants_integral)
{
  const int  num         = c->packing.num_fields;
  const bool is_settled  = rm_profile_reads_halo(&c->packing) && c->how.limiter == REMAP_LIMITER_CAAS;
  bool       any_nearest = false;
  rm_receipt receipt     = {.setup    = &c->setup,
                            .how      = &c->how,
                            .fields   = c->fields,
                            .packing  = &c->packing,
                            .value    = c->value,
                            .room     = c->room,
                            .content  = c->content,
                            .is_plain = c->is_plain,
                            .keeping  = blends(c) ? &c->keeping : NULL,
                            .integral = wants_integral ? c->integral : NULL};

  for (int f = 0; f < num; f++) any_nearest |= c->setup.any_uncovered && rm_needs_nearest(&c->how, &c->fields[f]);
  if (rm_profile_reads_halo(&c->packing)) {
    rm_profile_finish(&c->giving, c->setup.comm, &c->packing, &c->word);
    give(c);
  }
  rm_word_await(&c->word, c->setup.comm, &c->given_flow);
  if (blends(c)) {
    rm_profile_post(&c->keeping, c->setup.comm, &c->packing, &c->word);
    rm_profile_finish(&c->keeping, c->setup.comm, &c->packing, &c->word);
  }
  receipt.got = c->giving.pack;
  if (has_sloped_system(&c->packing))
    rm_admission_run(&c->admission, &c->setup, &c->packing, &c->giving, &c->word);
  if (is_settled) memcpy(c->old, c->value, (size_t)c->setup.receiving->num_cells * (size_t)num * sizeof *c->old);
  if (c->word.note.status == REMAP_OK) rm_receive(&receipt);
  if (is_settled) settle(c, &receipt);
  if (any_nearest) take_nearest(c);
}

/* Least and greatest finite value of a field in cells that take part; -0 counts as +0, whichever comes first. */
static void widen(const double *value, int stride, const rm_rows *rows, double *least, double *greatest)
{
  *least    = INFINITY;
  *greatest = -INFINITY;
  for (rm_lid i = 0; i < rows->num_cells; i++) {
    const double x = value[(int64_t)i * stride];

    if (rows->cover[i] == REMAP_UNWANTED || !isfinite(x)) continue;
    *least    = fmin(*least, x + 0.0);
    *greatest = fmax(*greatest, x + 0.0);
  }
}

/* What this rank's receiving cells got of a field. */
static void count_covers(const rm_carrier *c, int f, int64_t *count)
{
  const remap_field_desc *field = &c->fields[f];

  for (rm_lid i = 0; i < c->setup.receiving->num_cells; i++) {
    const uint8_t cover = c->setup.rows->cover[i];
    const bool    keeps = rm_keeps_old(&c->how, field, cover);

    if (cover == REMAP_PARTIAL && keeps) count[BLENDED]++;
    if (cover == REMAP_PARTIAL && !keeps && c->how.on_partial != REMAP_PARTIAL_CONSERVE && field->nature != REMAP_FLAG)
      count[NORMALISED]++;
    if (cover == REMAP_UNCOVERED) count[keeps ? KEPT : rm_needs_nearest(&c->how, field) ? NEAREST : FILLED]++;
  }
}

static void count_all(rm_carrier *c)
{
  const int n = c->packing.num_fields, num_systems = c->packing.num_systems;

  for (int f = 0; f < n; f++) {
    int64_t  *count = c->count + (int64_t)f * NUM_COUNTS;
    const int s     = c->packing.system_of[f];

    for (int k = 0; k < NUM_COUNTS; k++) count[k] = 0;
    count[LIMITED] = c->giving.limited[f];
    count[REDUCED] = c->giving.limited[n + f];
    for (rm_lid i = 0; i < c->setup.giving->num_cells; i++) {
      count[SPOILT] += !isfinite(c->given[(int64_t)i * n + f]);
      if (s >= 0 && c->packing.degree[f] > 0) count[SCALED] += c->admission.is_scaled[(int64_t)i * num_systems + s];
    }
    count_covers(c, f, count);
  }
}

/* Collective. */
static remap_status report(rm_carrier *c, rm_arena *scratch, remap_field_report *reports)
{
  const rm_transfer_setup *setup = &c->setup;
  const int                n     = c->packing.num_fields;
  double                  *least = c->extreme, *greatest = c->extreme + 2 * n;

  for (int f = 0; f < n; f++) {
    widen(c->given + f, n, setup->giving_rows, &least[2 * f], &greatest[2 * f]);
    widen(c->value + f, n, setup->rows, &least[2 * f + 1], &greatest[2 * f + 1]);
  }
  count_all(c);
  rm_integral_source(&c->giving, setup->rows, &c->packing, c->integral);
  RM_TRY(rm_comm_min_f64(setup->comm, least, 2 * n));
  RM_TRY(rm_comm_max_f64(setup->comm, greatest, 2 * n));
  RM_TRY(rm_comm_sum_i64(setup->comm, c->count, NUM_COUNTS * n));
  RM_TRY(rm_integral_report(scratch, setup, n, c->integral, reports));
  for (int f = 0; f < n; f++) {
    const double  *low = least + 2 * f, *high = greatest + 2 * f;
    const int64_t *count     = c->count + (int64_t)f * NUM_COUNTS;
    const bool     is_spoilt = count[SPOILT] > 0; /* what has values that are no numbers has no integrals */

    reports[f] = (remap_field_report){.order               = c->packing.order[f],
                                      .source_integral     = is_spoilt ? (double)NAN : reports[f].source_integral,
                                      .target_integral     = is_spoilt ? (double)NAN : reports[f].target_integral,
                                      .conservation_error  = is_spoilt ? (double)NAN : reports[f].conservation_error,
                                      .source_min          = low[0] <= high[0] ? low[0] : 0.0, /* no cells: 0 */
                                      .source_max          = low[0] <= high[0] ? high[0] : 0.0,
                                      .target_min          = low[1] <= high[1] ? low[1] : 0.0,
                                      .target_max          = low[1] <= high[1] ? high[1] : 0.0,
                                      .limited_cells       = count[LIMITED],
                                      .order_reduced_cells = count[REDUCED],
                                      .scaled_cells        = count[SCALED],
                                      .blended_cells       = count[BLENDED],
                                      .normalised_cells    = count[NORMALISED],
                                      .kept_cells          = count[KEPT],
                                      .nearest_cells       = count[NEAREST],
                                      .filled_cells        = count[FILLED]};
  }
  return REMAP_OK;
}

static remap_status agree_and_report(rm_carrier *c, remap_field_report *reports)
{
  rm_arena    *scratch;
  remap_status status;

  if (!rm_word_count(&c->word, c->setup.comm)) return (remap_status)c->word.note.status;
  scratch = rm_arena_new();
  rm_word_add(&c->word, scratch ? REMAP_OK : REMAP_NO_MEMORY);
  status = rm_comm_agree_reason(c->setup.comm, c->word.mine, &c->word.reason);
  if (status == REMAP_OK) status = report(c, scratch, reports);
  rm_arena_drop(scratch);
  return status;
}

remap_status rm_carrier_finish(rm_carrier *c, double cubed, remap_field_report *reports, rm_reason *reason)
{
  const int    num = c->packing.num_fields;
  remap_status status;

  RM_ASSERT(c->is_under_way);
  c->is_under_way = false;
  for (int f = 0; f < num && reports; f++) {
    rm_sum_clear(&c->integral[f].source);
    rm_sum_clear(&c->integral[f].minus_target);
    rm_sum_clear(&c->integral[f].magnitude);
  }
  carry(c, reports != NULL);
  status = (remap_status)c->word.note.status;
  if (reports) status = agree_and_report(c, reports);
  for (int f = 0; f < num && reports && status == REMAP_OK; f++) {
    reports[f].source_integral *= cubed;
    reports[f].target_integral *= cubed;
  }
  if (status == REMAP_OK) {
    rm_write_values(&c->setup, &c->packing, c->value);
    return REMAP_OK;
  }
  *reason = c->word.reason;
  return c->word.mine == REMAP_OK ? rm_fail(status, reason, -1, -1, "a neighbouring rank failed: its message says why")
                                  : status;
}
