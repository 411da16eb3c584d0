/* carrier -- fields from giving to receiving cells, in two steps.
 *
 *   start    values are gathered and checked; those of the stencil's halo travel (order 2), or all that is given (order 1)
 *   finish   for the limiter auto, slopes travel and then which cells are rough, twice; reconstruction of the giving cells; what
 *            is given travels; cells receive; for CAAS, a sum over all ranks; uncovered cells take the nearest value, where there
 *            are any; exact integrals, where somebody wants them; values are written
 *
 * Every message carries its sender's status, so a failure reaches all who depend on it, in the exchange that follows. The caller's
 * arrays are written at the very end, when nothing can fail any more. O(pairs) time per field; 16 bytes per receiving cell (24 for
 * CAAS) and 16 to 56 per giving cell (40 more for auto, 56 more for order 3) for each field. */
#include "field_private.h"

#include <stdio.h>
#include <string.h>

struct rm_carrier {
  rm_transfer_setup setup;
  rm_load           load;       /* the most it can carry                                       */
  rm_flow           halo;       /* values around the giving cells' stencils                     */
  rm_flow           slopes, roughs; /* likewise slopes and roughness, if smooth cells are told from others */
  double          (*slope)[3];  /* [giving cells][num_fields]                                   */
  double           *rough, *spread; /* [giving cells][num_fields] cells that are rough, and their neighbours too */
  double           *old;        /* [receiving cells][num_fields] values before, if CAAS needs them */
  rm_sum           *sum;        /* [num_fields][3] of CAAS                                      */
  rm_flow           given_flow; /* what giving cells give                                       */
  rm_flow           taken;      /* values that uncovered cells take                             */
  const rm_nearest *nearest;    /* NULL: nobody takes any                                       */
  uint8_t          *needs_halo; /* [giving cells] 1: its stencil reaches other ranks             */
  double           *given;      /* [giving cells][num_fields] as the caller gave them            */
  double           *pack;       /* [giving cells][width]                                        */
  double           *value;      /* [receiving cells][num_fields] old values, then new ones      */
  int64_t          *limited;    /* [2][num_fields] on this rank; behind it the cells of reduced order */
  rm_integral      *integral;   /* [num_fields]                                                 */
  double           *extreme;    /* [4][num_fields] least, least, greatest, greatest              */

  /* of the transfer under way: */
  bool              is_under_way;
  remap_transfer    how;
  remap_field_desc *fields; /* [num_fields] */
  rm_packing        packing;
  rm_note           note; /* worst status so far                              */
  remap_status      mine; /* the same without what only neighbours told         */
  rm_reason         reason;
};

/* ---- loads ------------------------------------------------------------------------------------------------------- */

static bool has_slope(const remap_transfer *how, const remap_field_desc *field)
{
  return how->order > 1 && field->nature != REMAP_FLAG;
}

/* Do receiving cells need the bounds of what they are given: all (CAAS), or those in part covered that it is taken beyond? */
static bool needs_bounds(const rm_transfer_setup *setup, const remap_transfer *how, int num_fields, const remap_field_desc *fields)
{
  bool normalises = false;

  for (int f = 0; f < num_fields; f++)
    normalises |= has_slope(how, &fields[f]) && (how->on_partial == REMAP_PARTIAL_NORMALISE ||
                                                 (how->on_partial == REMAP_PARTIAL_BLEND && !fields[f].has_old));
  return how->limiter == REMAP_LIMITER_CAAS || (normalises && how->limiter != REMAP_LIMITER_NONE && setup->any_partial);
}

rm_load rm_load_of(const rm_transfer_setup *setup, const remap_transfer *how, int num_fields, const remap_field_desc *fields)
{
  const bool has_bounds = needs_bounds(setup, how, num_fields, fields);
  rm_load    load       = {.num_fields = num_fields};

  for (int f = 0; f < num_fields; f++) {
    const bool is_sloped = has_slope(how, &fields[f]);

    load.width += rm_pack_width(is_sloped ? how->order : 1, has_bounds);
    load.has_slopes |= is_sloped;
    load.is_wide |= is_sloped && how->order > 2;
    load.is_settled |= is_sloped && how->limiter == REMAP_LIMITER_CAAS;
    load.is_checked |= is_sloped && how->limiter == REMAP_LIMITER_AUTO;
    load.has_nearest |= setup->any_uncovered && rm_needs_nearest(how, &fields[f]);
  }
  return load;
}

rm_load rm_load_max(rm_load a, rm_load b)
{
  return (rm_load){a.num_fields > b.num_fields ? a.num_fields : b.num_fields,
                   a.width > b.width ? a.width : b.width,
                   a.has_slopes || b.has_slopes,
                   a.is_settled || b.is_settled,
                   a.is_checked || b.is_checked,
                   a.is_wide || b.is_wide,
                   a.has_nearest || b.has_nearest};
}

bool rm_load_covers(rm_load a, rm_load b)
{
  return a.num_fields >= b.num_fields && a.width >= b.width && a.has_slopes >= b.has_slopes &&
         a.is_settled >= b.is_settled && a.is_checked >= b.is_checked && a.is_wide >= b.is_wide &&
         a.has_nearest >= b.has_nearest;
}

static void lay_out(rm_carrier *c, int num_fields)
{
  rm_packing *p = &c->packing;

  p->num_fields = num_fields;
  p->is_limited = c->how.limiter == REMAP_LIMITER_BARTH_JESPERSEN || c->how.limiter == REMAP_LIMITER_AUTO;
  p->is_checked = c->how.limiter == REMAP_LIMITER_AUTO;
  p->has_bounds = needs_bounds(&c->setup, &c->how, num_fields, c->fields);
  p->width      = 0;
  for (int f = 0; f < num_fields; f++) {
    p->order[f] = has_slope(&c->how, &c->fields[f]) ? c->how.order : 1;
    p->at[f]    = p->width;
    p->width += rm_pack_width(p->order[f], p->has_bounds);
  }
}

/* ---- build ------------------------------------------------------------------------------------------------------- */

static void mark_halo_cells(const rm_stencil *stencil, uint8_t *needs_halo)
{
  for (rm_lid c = 0; c < stencil->num_cells; c++) {
    for (int64_t k = stencil->offset[c]; k < stencil->offset[c + 1]; k++)
      needs_halo[c] |= stencil->neighbour[k] >= stencil->num_cells;
    for (int64_t k = stencil->wide_offset ? stencil->wide_offset[c] : 0; stencil->wide_offset && k < stencil->wide_offset[c + 1]; k++)
      needs_halo[c] |= stencil->wide_neighbour[k] >= stencil->num_cells;
  }
}

/* All memory that transfers need. Not collective. */
static remap_status make_room(rm_arena *arena, rm_carrier *c)
{
  const rm_transfer_setup *setup = &c->setup;
  const int                n     = c->load.num_fields;
  const size_t             bytes = (size_t)n * sizeof(double);

  RM_NEW0(c->needs_halo, arena, setup->giving->num_cells);
  RM_NEW(c->given, arena, rm_mul_sat(setup->giving->num_cells, n));
  RM_NEW(c->pack, arena, rm_mul_sat(setup->giving->num_cells, c->load.width));
  RM_NEW(c->value, arena, rm_mul_sat(setup->receiving->num_cells, n));
  RM_NEW(c->limited, arena, 2 * (int64_t)n);
  RM_NEW(c->integral, arena, n);
  RM_NEW(c->extreme, arena, 4 * (int64_t)n);
  RM_NEW(c->fields, arena, n);
  RM_NEW(c->packing.at, arena, n);
  RM_NEW(c->packing.order, arena, n);
  if (c->load.has_slopes) {
    RM_TRY(rm_flow_init(arena, setup->giving_stencil->plan, bytes, &c->halo));
    mark_halo_cells(setup->giving_stencil, c->needs_halo);
  }
  if (c->load.is_settled) {
    RM_NEW(c->old, arena, rm_mul_sat(setup->receiving->num_cells, n));
    RM_NEW(c->sum, arena, 3 * (int64_t)n);
  }
  if (c->load.is_checked) {
    RM_TRY(rm_flow_init(arena, setup->giving_stencil->plan, 3 * bytes, &c->slopes));
    RM_TRY(rm_flow_init(arena, setup->giving_stencil->plan, bytes, &c->roughs));
    RM_NEW(c->slope, arena, rm_mul_sat(setup->giving->num_cells, n));
    RM_NEW(c->rough, arena, rm_mul_sat(setup->giving->num_cells, n));
    RM_NEW(c->spread, arena, rm_mul_sat(setup->giving->num_cells, n));
  }
  if (c->load.has_nearest) RM_TRY(rm_flow_init(arena, c->nearest->plan, bytes, &c->taken));
  return rm_flow_init(arena, setup->rows->plan, (size_t)c->load.width * sizeof(double), &c->given_flow);
}

remap_status rm_carrier_build(rm_arena *arena, const rm_transfer_setup *setup, rm_load load, rm_carrier **out, rm_reason *reason)
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
  *out = c;
  return REMAP_OK;
}

bool rm_carrier_is_under_way(const rm_carrier *carrier) { return carrier && carrier->is_under_way; }

void rm_carrier_abandon(rm_carrier *c)
{
  if (!rm_carrier_is_under_way(c)) return;
  c->is_under_way = false;
  if (c->halo.num_requests > 0) (void)rm_flow_wait(c->setup.comm, &c->halo, &c->note);
  if (c->slopes.num_requests > 0) (void)rm_flow_wait(c->setup.comm, &c->slopes, &c->note);
  if (c->roughs.num_requests > 0) (void)rm_flow_wait(c->setup.comm, &c->roughs, &c->note);
  if (c->given_flow.num_requests > 0) (void)rm_flow_wait(c->setup.comm, &c->given_flow, &c->note);
}

/* ---- start ------------------------------------------------------------------------------------------------------- */

/* The values of one block of one field: of cells first to end - 1, that of cell i at array + stride * (place[i] or i - zero). */
typedef struct strip {
  const rm_layout *layout;
  rm_lid           first, end, zero;
  int64_t          stride;
} strip;

static int num_strips(const rm_layout *layout) { return layout->num_blocks > 0 ? layout->num_blocks : 1; }

static strip strip_of(const rm_layout *layout, rm_lid num_cells, int block, bool is_by_block, int64_t stride)
{
  strip s = {layout, 0, num_cells, 0, stride ? stride : 1};

  if (layout->num_blocks > 0) {
    s.first = layout->block_offset[block];
    s.end   = layout->block_offset[block + 1];
  }
  if (is_by_block) s.zero = s.first;
  return s;
}

static int64_t place_of(const strip *s, rm_lid cell)
{
  return (s->layout->place ? s->layout->place[cell] : cell - s->zero) * s->stride;
}

static remap_status bad_value(const rm_carrier *c, int f, const rm_mesh *mesh, rm_lid cell, double value, const char *which,
                              rm_reason *reason)
{
  char name[64];

  snprintf(name, sizeof name, "number %d", f);
  return rm_fail(REMAP_BAD_VALUE, reason, mesh->side, mesh->cell_global[cell], "field %s: %s value %g is not a finite number",
                 c->fields[f].name ? c->fields[f].name : name, which, value);
}

/* Values of the giving cells. Those that nobody may have count as 0, whatever stands there. */
static remap_status gather_given(rm_carrier *c, int f, rm_reason *reason)
{
  const rm_mesh          *mesh   = c->setup.giving;
  const remap_field_desc *field  = &c->fields[f];
  const rm_layout        *layout = &c->setup.giving_layout;
  const int               num    = c->packing.num_fields;

  for (int b = 0; b < num_strips(layout); b++) {
    const strip   s  = strip_of(layout, mesh->num_cells, b, field->in_block != NULL, field->in_stride);
    const double *in = field->in_block ? field->in_block[b] : field->in;

    for (rm_lid i = s.first; i < s.end; i++) {
      const double value = c->setup.giving_rows->cover[i] != REMAP_UNWANTED ? in[place_of(&s, i)] : 0.0;

      if (!isfinite(value)) return bad_value(c, f, mesh, i, value, "the", reason);
      c->given[(int64_t)i * num + f] = value;
    }
  }
  return REMAP_OK;
}

/* Where the values of a block's receiving cells go. */
static double *out_of(const remap_field_desc *field, int block) { return field->out_block ? field->out_block[block] : field->out; }

/* Old values, where they are used. */
static remap_status gather_old(rm_carrier *c, int f, rm_reason *reason)
{
  const rm_mesh          *mesh   = c->setup.receiving;
  const remap_field_desc *field  = &c->fields[f];
  const rm_layout        *layout = &c->setup.receiving_layout;
  const int               num    = c->packing.num_fields;

  for (int b = 0; b < num_strips(layout); b++) {
    const strip   s   = strip_of(layout, mesh->num_cells, b, field->out_block != NULL, field->out_stride);
    const double *out = out_of(field, b);

    for (rm_lid i = s.first; i < s.end; i++) {
      const double value = rm_keeps_old(&c->how, field, c->setup.rows->cover[i]) ? out[place_of(&s, i)] : 0.0;

      if (!isfinite(value)) return bad_value(c, f, mesh, i, value, "the old", reason);
      c->value[(int64_t)i * num + f] = value;
    }
  }
  return REMAP_OK;
}

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

/* What a step on this rank said; the first failure stays. */
static void note(rm_carrier *c, remap_status status)
{
  if (status > c->mine) c->mine = status;
  if ((int64_t)status > c->note.status) c->note.status = status;
}

/* What a flow has brought. */
static const double *numbers_in(const rm_flow *flow) { return (const double *)(const void *)flow->received; }

/* Reconstruct the cells whose neighbours are all here, or the others. */
static void reconstruct(rm_carrier *c, uint8_t which)
{
  rm_reconstruct(&c->setup, &c->packing, (rm_numbers){c->given, numbers_in(&c->halo)},
                 (rm_numbers){c->spread, numbers_in(&c->roughs)}, c->needs_halo, which, c->pack, c->limited,
                 c->limited + c->packing.num_fields);
}

/* Does this transfer read the halo? */
static bool reads_halo(const rm_carrier *c)
{
  bool reads = false;

  for (int f = 0; f < c->packing.num_fields; f++) reads |= c->packing.order[f] > 1;
  return reads;
}

/* Give what is packed to those who receive it. */
static void give(rm_carrier *c)
{
  note(c, rm_flow_post(c->setup.comm, &c->given_flow, (size_t)c->packing.width * sizeof(double), c->pack, c->note));
}

void rm_carrier_start(rm_carrier *c, const remap_transfer *how, int num_fields, const remap_field_desc *fields, uint64_t mark,
                      remap_status mine, const rm_reason *reason)
{
  RM_ASSERT(!c->is_under_way && rm_load_covers(c->load, rm_load_of(&c->setup, how, num_fields, fields)));
  c->is_under_way = true;
  c->how          = *how;
  c->note         = (rm_note){mark, (int64_t)mine};
  c->mine         = mine;
  c->reason       = *reason;
  for (int f = 0; f < num_fields; f++) c->fields[f] = fields[f];
  for (int f = 0; f < 2 * num_fields; f++) c->limited[f] = 0;
  lay_out(c, num_fields);
  for (int f = 0; f < num_fields; f++) {
    if (c->note.status == REMAP_OK) note(c, gather_given(c, f, &c->reason));
    if (c->note.status == REMAP_OK) note(c, gather_old(c, f, &c->reason));
  }
  if (c->note.status == REMAP_OK) note(c, check_coverage(c, &c->reason));
  if (num_fields == 0) return;
  if (reads_halo(c)) {
    note(c, rm_flow_post(c->setup.comm, &c->halo, (size_t)num_fields * sizeof(double), c->given, c->note));
  } else {
    if (c->note.status == REMAP_OK) reconstruct(c, 0), reconstruct(c, 1);
    give(c);
  }
}

/* ---- finish ------------------------------------------------------------------------------------------------------ */

/* Wait for a flow; what its senders say counts. */
static void await(rm_carrier *c, rm_flow *flow)
{
  const remap_status waited = rm_flow_wait(c->setup.comm, flow, &c->note);

  if (waited == REMAP_BAD_ARGUMENT)
    rm_fail(waited, &c->reason, -1, -1,
            "direction, transfer, number, natures or old values of fields differ from those of a neighbouring rank");
  note(c, waited);
}

/* Uncovered cells take their values. */
static void take_nearest(rm_carrier *c)
{
  const rm_nearest *nearest = c->nearest;
  const int         num     = c->packing.num_fields;
  const double     *got     = numbers_in(&c->taken);

  note(c, rm_flow_post(c->setup.comm, &c->taken, (size_t)num * sizeof(double), c->value, c->note));
  await(c, &c->taken);
  if (c->note.status != REMAP_OK) return;
  for (int64_t k = 0; k < nearest->num; k++)
    for (int f = 0; f < num; f++)
      if (rm_needs_nearest(&c->how, &c->fields[f]))
        c->value[(int64_t)nearest->cell[k] * num + f] = got[(int64_t)nearest->origin[k] * num + f];
}

/* Tell smooth cells from others: slopes of all around, then roughness of all around, and of all around them. */
static void find_smooth(rm_carrier *c)
{
  const rm_stencil *stencil = c->setup.giving_stencil;
  const size_t      bytes   = (size_t)c->packing.num_fields * sizeof(double);
  const rm_numbers  given   = {c->given, numbers_in(&c->halo)};

  if (c->note.status == REMAP_OK) rm_smooth_slopes(stencil, &c->packing, given, c->slope);
  note(c, rm_flow_post(c->setup.comm, &c->slopes, 3 * bytes, c->slope, c->note));
  await(c, &c->slopes);
  if (c->note.status == REMAP_OK)
    rm_smooth_roughness(stencil, c->setup.giving, &c->packing, given, (const double(*)[3])c->slope,
                        (const double(*)[3])(const void *)c->slopes.received, c->rough);
  note(c, rm_flow_post(c->setup.comm, &c->roughs, bytes, c->rough, c->note));
  await(c, &c->roughs);
  if (c->note.status == REMAP_OK)
    rm_smooth_spread(stencil, &c->packing, (rm_numbers){c->rough, numbers_in(&c->roughs)}, c->spread);
  note(c, rm_flow_post(c->setup.comm, &c->roughs, bytes, c->spread, c->note));
  await(c, &c->roughs);
}

/* Clip the new values and give back what that takes. Collective. */
static void settle(rm_carrier *c, const rm_receipt *receipt)
{
  const int64_t before = c->note.status;

  c->note.status = (int64_t)rm_comm_agree(c->setup.comm, (remap_status)before, NULL);
  if (c->note.status != REMAP_OK) return;
  rm_caas_sum(receipt, c->old, c->sum);
  note(c, rm_comm_sum_exact(c->setup.comm, c->sum, 3 * c->packing.num_fields));
  if (c->note.status == REMAP_OK) rm_caas_settle(receipt, c->old, c->sum, c->limited);
}

/* Everything up to the new values. */
static void carry(rm_carrier *c, bool wants_integral)
{
  const int  num         = c->packing.num_fields;
  const bool is_settled  = reads_halo(c) && c->how.limiter == REMAP_LIMITER_CAAS;
  bool       any_nearest = false;
  rm_receipt receipt     = {&c->setup, &c->how, c->fields, &c->packing, NULL, c->value, wants_integral ? c->integral : NULL};

  for (int f = 0; f < num; f++) any_nearest |= c->setup.any_uncovered && rm_needs_nearest(&c->how, &c->fields[f]);
  if (reads_halo(c)) {
    if (c->note.status == REMAP_OK && !c->packing.is_checked) reconstruct(c, 0);
    await(c, &c->halo);
    if (c->packing.is_checked) find_smooth(c);
    if (c->note.status == REMAP_OK && c->packing.is_checked) reconstruct(c, 0);
    if (c->note.status == REMAP_OK) reconstruct(c, 1);
    give(c);
  }
  await(c, &c->given_flow);
  receipt.got = numbers_in(&c->given_flow);
  if (is_settled) memcpy(c->old, c->value, (size_t)c->setup.receiving->num_cells * (size_t)num * sizeof *c->old);
  if (c->note.status == REMAP_OK) rm_receive(&receipt);
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
  rm_integral_source(setup, c->fields, &c->packing, c->given, c->pack, c->integral);
  RM_TRY(rm_comm_min_f64(setup->comm, least, 2 * n));
  RM_TRY(rm_comm_max_f64(setup->comm, greatest, 2 * n));
  RM_TRY(rm_comm_sum_i64(setup->comm, c->limited, 2 * n));
  RM_TRY(rm_integral_report(scratch, setup, n, c->integral, reports));
  for (int f = 0; f < n; f++) {
    const double *low = least + 2 * f, *high = greatest + 2 * f;

    reports[f].order         = c->packing.order[f];
    reports[f].source_min    = low[0] <= high[0] ? low[0] : 0.0; /* no cells: 0 */
    reports[f].source_max    = low[0] <= high[0] ? high[0] : 0.0;
    reports[f].target_min    = low[1] <= high[1] ? low[1] : 0.0;
    reports[f].target_max    = low[1] <= high[1] ? high[1] : 0.0;
    reports[f].limited_cells = c->limited[f];
    reports[f].order_reduced_cells = c->limited[n + f];
  }
  return REMAP_OK;
}

static remap_status agree_and_report(rm_carrier *c, remap_field_report *reports)
{
  rm_arena    *scratch = rm_arena_new();
  remap_status status;

  note(c, scratch ? REMAP_OK : REMAP_NO_MEMORY);
  status = rm_comm_agree_reason(c->setup.comm, c->mine, &c->reason);
  if (status == REMAP_OK) status = report(c, scratch, reports);
  rm_arena_drop(scratch);
  return status;
}

/* Into the caller's array. */
static void write_values(const rm_carrier *c, int f)
{
  const remap_field_desc *field  = &c->fields[f];
  const rm_layout        *layout = &c->setup.receiving_layout;
  const int               num    = c->packing.num_fields;

  for (int b = 0; b < num_strips(layout); b++) {
    const strip s   = strip_of(layout, c->setup.receiving->num_cells, b, field->out_block != NULL, field->out_stride);
    double     *out = out_of(field, b);

    for (rm_lid i = s.first; i < s.end; i++)
      if (c->setup.rows->cover[i] != REMAP_UNWANTED) out[place_of(&s, i)] = c->value[(int64_t)i * num + f];
  }
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
  if (num > 0) carry(c, reports != NULL);
  status = (remap_status)c->note.status;
  if (reports) status = agree_and_report(c, reports);
  for (int f = 0; f < num && reports && status == REMAP_OK; f++) {
    reports[f].source_integral *= cubed;
    reports[f].target_integral *= cubed;
  }
  if (status == REMAP_OK) {
    for (int f = 0; f < num; f++) write_values(c, f);
    return REMAP_OK;
  }
  *reason = c->reason;
  return c->mine == REMAP_OK ? rm_fail(status, reason, -1, -1, "a neighbouring rank failed: its message says why") : status;
}
