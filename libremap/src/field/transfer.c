/* transfer -- fields from giving to receiving cells.
 *
 *   check        values are finite, coverage is as the caller demands; one agreement
 *   reconstruct  slopes of the giving cells
 *   travel       one exchange among neighbours for all fields
 *   receive      content of each cell = sum over its row of u V + g.M, and what its coverage makes of it
 *   nearest      uncovered cells without another value, where there are any
 *   report       exact integrals, where somebody wants them
 *
 * The caller's arrays are written at the very end, when nothing can fail any more. O(pairs) time per field; 8 bytes per receiving
 * cell, and 8 to 48 per giving cell, for each field. */
#include "field_private.h"

#include <stdio.h>

/* Answers that all ranks need, as a maximum over ranks, behind the largest magnitude of each field. */
enum { HAS_PARTIAL, HAS_UNCOVERED, WANTS_REPORTS, NUM_ANSWERS };

typedef struct work {
  rm_arena                *arena;
  const rm_transfer_setup *setup;
  const remap_transfer    *how;
  int                      num_fields;
  const remap_field_desc  *fields;
  double                  *most;  /* [num_fields + NUM_ANSWERS] over all ranks                     */
  double                  *scale; /* [num_fields]                                                  */
  rm_packing               packing;
  double                  *pack;     /* [giving cells][width]                                         */
  double                  *got;      /* [givers of the rows][width]                                   */
  double                  *buffer;   /* for the exchange                                              */
  double                  *value;    /* [num_fields][receiving cells] as it will be written           */
  int64_t                 *limited;  /* [num_fields] on this rank                                    */
  rm_integral             *integral; /* [num_fields], NULL: nobody wants them                       */
} work;

/* ---- check ----------------------------------------------------------------------------------------------------- */

static bool keeps_old(const work *w, const remap_field_desc *field, uint8_t cover)
{
  if (!field->has_old) return false;
  if (cover == REMAP_UNCOVERED) return w->how->on_uncovered == REMAP_UNCOVERED_KEEP;
  return cover == REMAP_PARTIAL && w->how->on_partial == REMAP_PARTIAL_BLEND && field->nature != REMAP_FLAG;
}

/* Cells without volume cannot be covered by anything: ERROR overlooks them, and they take the nearest value. */
static bool needs_nearest(const work *w, const remap_field_desc *field)
{
  switch (w->how->on_uncovered) {
    case REMAP_UNCOVERED_KEEP: return !field->has_old;
    case REMAP_UNCOVERED_FILL: return false;
    case REMAP_UNCOVERED_NEAREST:
    case REMAP_UNCOVERED_ERROR: break;
  }
  return true;
}

static remap_status bad_value(const work *w, int f, const rm_mesh *mesh, rm_lid cell, double value, const char *which,
                              rm_reason *reason)
{
  char name[64];

  snprintf(name, sizeof name, "number %d", f);
  return rm_fail(REMAP_BAD_VALUE, reason, mesh->side, mesh->cell_global[cell], "field %s: %s value %g is not a finite number",
                 w->fields[f].name ? w->fields[f].name : name, which, value);
}

/* Values that are used are finite; most[f] grows to their largest magnitude. */
static remap_status check_values(work *w, int f, rm_reason *reason)
{
  const remap_field_desc *field  = &w->fields[f];
  const rm_mesh          *giving = w->setup->giving, *receiving = w->setup->receiving;
  const uint8_t          *cover   = w->setup->rows->cover;
  double                  largest = 0.0;

  for (rm_lid c = 0; c < giving->num_cells; c++) {
    if (!isfinite(field->in[c])) return bad_value(w, f, giving, c, field->in[c], "the", reason);
    largest = fmax(largest, fabs(field->in[c]));
  }
  for (rm_lid c = 0; c < receiving->num_cells; c++) {
    if (!keeps_old(w, field, cover[c])) continue;
    if (!isfinite(field->out[c])) return bad_value(w, f, receiving, c, field->out[c], "the old", reason);
    largest = fmax(largest, fabs(field->out[c]));
  }
  w->most[f] = largest;
  return REMAP_OK;
}

static remap_status check_coverage(work *w, rm_reason *reason)
{
  const rm_mesh *mesh   = w->setup->receiving;
  double        *answer = w->most + w->num_fields;

  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    const uint8_t cover     = w->setup->rows->cover[c];
    const bool    has_space = fabs(mesh->cell_volume[c]) > 0.0;

    if (cover == REMAP_UNCOVERED && has_space && w->how->on_uncovered == REMAP_UNCOVERED_ERROR)
      return rm_fail(REMAP_COVERAGE, reason, mesh->side, mesh->cell_global[c], "the cell lies outside of the other mesh");
    if (cover == REMAP_PARTIAL && w->how->on_partial == REMAP_PARTIAL_ERROR)
      return rm_fail(REMAP_COVERAGE, reason, mesh->side, mesh->cell_global[c],
                     "the cell lies outside of the other mesh in part");
    if (cover == REMAP_PARTIAL) answer[HAS_PARTIAL] = 1.0;
    if (cover == REMAP_UNCOVERED) answer[HAS_UNCOVERED] = 1.0;
  }
  return REMAP_OK;
}

/* All checks, and what every rank must know before it packs. Collective. */
static remap_status check(work *w, bool wants_reports, rm_reason *reason)
{
  const int    num    = w->num_fields + NUM_ANSWERS;
  remap_status status = REMAP_OK;

  w->most = rm_arena_zero(w->arena, num, sizeof *w->most);
  if (!w->most) status = REMAP_NO_MEMORY;
  for (int f = 0; f < w->num_fields && status == REMAP_OK; f++) status = check_values(w, f, reason);
  if (status == REMAP_OK) status = check_coverage(w, reason);
  RM_TRY(rm_comm_agree_reason(w->setup->comm, status, reason));
  w->most[w->num_fields + WANTS_REPORTS] = wants_reports ? 1.0 : 0.0;
  return rm_comm_max_f64(w->setup->comm, w->most, num);
}

static bool answer(const work *w, int which) { return w->most[w->num_fields + which] > 0.0; }

/* ---- travel ---------------------------------------------------------------------------------------------------- */

/* A power of two that brings values of extreme size near 1; others stay as they are. */
static double scale_for(double largest)
{
  int exponent;

  if (!(largest > 0.0) || (largest >= 0x1p-400 && largest <= 0x1p400)) return 1.0;
  frexp(largest, &exponent);
  return ldexp(1.0, exponent < -1000 ? 1000 : -exponent);
}

static void lay_out(work *w)
{
  rm_packing *p          = &w->packing;
  bool        normalises = false;
  const bool  is_limited = w->how->limiter != REMAP_LIMITER_NONE;

  for (int f = 0; f < w->num_fields; f++) {
    const bool has_slope = w->how->order > 1 && w->fields[f].nature != REMAP_FLAG;

    p->order[f] = has_slope ? 2 : 1;
    w->scale[f] = scale_for(w->most[f]);
    normalises |= has_slope && (w->how->on_partial == REMAP_PARTIAL_NORMALISE ||
                                (w->how->on_partial == REMAP_PARTIAL_BLEND && !w->fields[f].has_old));
  }
  p->scale      = w->scale;
  p->is_limited = is_limited;
  p->has_bounds = is_limited && normalises && answer(w, HAS_PARTIAL);
  p->width      = 0;
  for (int f = 0; f < w->num_fields; f++) {
    p->at[f] = p->width;
    p->width += p->order[f] == 1 ? 1 : p->has_bounds ? 6 : 4;
  }
}

static remap_status make_room(work *w)
{
  const rm_plan *plan = w->setup->rows->plan;

  RM_NEW(w->packing.at, w->arena, w->num_fields);
  RM_NEW(w->packing.order, w->arena, w->num_fields);
  RM_NEW(w->scale, w->arena, w->num_fields);
  RM_NEW0(w->limited, w->arena, w->num_fields);
  if (answer(w, WANTS_REPORTS)) RM_NEW0(w->integral, w->arena, w->num_fields);
  lay_out(w);
  RM_NEW(w->value, w->arena, rm_mul_sat(w->setup->receiving->num_cells, w->num_fields));
  RM_NEW(w->pack, w->arena, rm_mul_sat(w->setup->giving->num_cells, w->packing.width));
  RM_NEW(w->got, w->arena, rm_mul_sat(w->setup->rows->num_givers, w->packing.width));
  RM_NEW(w->buffer, w->arena, rm_mul_sat(plan->send_offset[plan->num_send], w->packing.width));
  return REMAP_OK;
}

/* Reconstruct, and bring what this rank's rows need. Collective. */
static remap_status travel(work *w)
{
  const rm_comm *comm   = w->setup->comm;
  remap_status   status = make_room(w);

  RM_TRY(rm_comm_agree(comm, status, NULL));
  status = rm_reconstruct(w->arena, w->setup, w->num_fields, w->fields, &w->packing, w->pack, w->limited);
  RM_TRY(rm_comm_agree(comm, status, NULL));
  status = rm_plan_run(comm, w->setup->rows->plan, (size_t)w->packing.width * sizeof *w->pack, w->pack, w->got, w->buffer);
  return rm_comm_agree(comm, status, NULL);
}

/* ---- receive --------------------------------------------------------------------------------------------------- */

/* A row, for one field: sums in row order, the first two with compensation. */
typedef struct row_sums {
  double content;   /* of u V + g.M */
  double volume;    /* of V         */
  double magnitude; /* of |V|       */
} row_sums;

/* What one giver sent for a field. */
typedef struct giver_view {
  double        value; /* scaled                                            */
  const double *slope; /* scaled; behind it the bounds, if there are any    */
} giver_view;

static giver_view view(const work *w, int f, rm_lid giver)
{
  static const double no_slope[3] = {0.0, 0.0, 0.0};
  const double       *place       = w->got + (int64_t)giver * w->packing.width + w->packing.at[f];

  return (giver_view){w->packing.scale[f] * place[0], w->packing.order[f] > 1 ? place + RM_PACK_SLOPE : no_slope};
}

static row_sums sum_row(const work *w, int f, rm_lid cell)
{
  const rm_rows *rows    = w->setup->rows;
  rm_compensated content = {0.0, 0.0}, volume = {0.0, 0.0};
  double         magnitude = 0.0;

  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++) {
    const giver_view g = view(w, f, rows->giver[k]);
    const double    *m = rows->moment[k];

    rm_compensated_add(&content, g.value * rows->volume[k]);
    rm_compensated_add(&content, g.slope[0] * m[0] + g.slope[1] * m[1] + g.slope[2] * m[2]);
    rm_compensated_add(&volume, rows->volume[k]);
    magnitude += fabs(rows->volume[k]);
  }
  return (row_sums){rm_compensated_value(&content), rm_compensated_value(&volume), magnitude};
}

/* True if a volume is what cancellation left of the parts it is made of: nothing may be divided by it. */
static bool is_void(double volume, const row_sums *s) { return !(fabs(volume) > 0x1p-40 * s->magnitude); }

/* The mean that exists for every row: by the magnitude of the overlaps, else the first giver's value. */
static double plain_mean(const work *w, int f, rm_lid cell, const row_sums *s)
{
  const rm_rows *rows = w->setup->rows;
  double         sum  = 0.0;

  if (!(s->magnitude > 0.0)) return view(w, f, rows->giver[rows->offset[cell]]).value;
  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++)
    sum += view(w, f, rows->giver[k]).value * (fabs(rows->volume[k]) / s->magnitude);
  return sum;
}

/* The mean over the covered part, each giver's reconstruction taken to the centroid of the whole cell; under a limiter within the
 * bounds of the givers' neighbourhoods. */
static double normalised(const work *w, int f, rm_lid cell, const row_sums *s)
{
  const rm_rows *rows  = w->setup->rows;
  const double  *x     = w->setup->receiving->cell_centroid[cell];
  rm_compensated sum   = {0.0, 0.0};
  double         least = INFINITY, greatest = -INFINITY, mean;

  if (is_void(s->volume, s)) return plain_mean(w, f, cell, s);
  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++) {
    const giver_view g    = view(w, f, rows->giver[k]);
    const double    *c    = rows->giver_centroid[rows->giver[k]];
    const double     rise = g.slope[0] * (x[0] - c[0]) + g.slope[1] * (x[1] - c[1]) + g.slope[2] * (x[2] - c[2]);

    rm_compensated_add(&sum, (g.value + rise) * rows->volume[k]);
    if (!w->packing.has_bounds || w->packing.order[f] < 2) continue;
    least    = fmin(least, g.slope[RM_PACK_BOUNDS - RM_PACK_SLOPE]);
    greatest = fmax(greatest, g.slope[RM_PACK_BOUNDS - RM_PACK_SLOPE + 1]);
  }
  mean = rm_compensated_value(&sum) / s->volume;
  return least <= greatest ? fmin(fmax(mean, least), greatest) : mean;
}

/* The scaled new value of a cell with pairs; its part in the integral goes to integral, if that is not NULL. */
static double receive_cell(const work *w, int f, rm_lid cell, rm_integral *integral)
{
  const row_sums s        = sum_row(w, f, cell);
  const double   volume   = w->setup->receiving->cell_volume[cell];
  const bool     is_part  = w->setup->rows->cover[cell] == REMAP_PARTIAL;
  const bool     is_blend = keeps_old(w, &w->fields[f], w->setup->rows->cover[cell]);
  double         old      = 0.0, value;

  if (is_part && !is_blend && w->how->on_partial != REMAP_PARTIAL_CONSERVE) {
    if (integral) rm_integral_add(&integral->minus_target, -1.0, s.content); /* of its covered part: it has no other */
    return normalised(w, f, cell, &s);
  }
  if (is_blend) old = w->packing.scale[f] * w->fields[f].out[cell];
  if (is_void(volume, &s))
    value = is_blend ? old : plain_mean(w, f, cell, &s);
  else
    value = is_blend ? (s.content + old * (volume - s.volume)) / volume : s.content / volume;
  if (integral) {
    rm_integral_add(&integral->minus_target, -value, volume);
    if (is_blend) {
      rm_integral_add(&integral->minus_target, old, volume);
      rm_integral_add(&integral->minus_target, -old, s.volume);
    }
  }
  return value;
}

/* A flag comes from the cell of largest overlap, the canonically first if some are equal. */
static double receive_flag(const work *w, int f, rm_lid cell)
{
  const rm_rows *rows = w->setup->rows;
  int64_t        best = rows->offset[cell];

  for (int64_t k = best + 1; k < rows->offset[cell + 1]; k++)
    if (fabs(rows->volume[k]) > fabs(rows->volume[best])) best = k;
  return w->got[(int64_t)rows->giver[best] * w->packing.width + w->packing.at[f]];
}

/* The new value of a cell; one that takes the nearest value gets it later. */
static double receive(const work *w, int f, rm_lid cell)
{
  const rm_rows          *rows     = w->setup->rows;
  const remap_field_desc *field    = &w->fields[f];
  const int64_t           first    = rows->offset[cell];
  const double            scale    = w->packing.scale[f];
  rm_integral            *integral = w->integral ? &w->integral[f] : NULL;
  double                  copied;

  if (rows->cover[cell] == REMAP_UNCOVERED)
    return keeps_old(w, field, rows->cover[cell]) ? field->out[cell] : w->how->fill_value;
  if (field->nature == REMAP_FLAG) return receive_flag(w, f, cell);
  if (!rows->same[first]) return receive_cell(w, f, cell, integral) / scale;
  copied = w->got[(int64_t)rows->giver[first] * w->packing.width + w->packing.at[f]];
  if (integral) rm_integral_add(&integral->minus_target, -scale * copied, w->setup->receiving->cell_volume[cell]);
  return copied;
}

/* All fields of a cell in turn: its row is read once for all of them. */
static void receive_all(work *w)
{
  const rm_lid n = w->setup->receiving->num_cells;

  for (rm_lid c = 0; c < n; c++)
    for (int f = 0; f < w->num_fields; f++) w->value[(int64_t)f * n + c] = receive(w, f, c);
}

/* ---- nearest --------------------------------------------------------------------------------------------------- */

/* The values that uncovered cells take, field after field. Collective; every rank comes here or none. */
static remap_status take_nearest(work *w, rm_reason *reason)
{
  const rm_comm    *comm = w->setup->comm;
  const rm_mesh    *mesh = w->setup->receiving;
  const rm_nearest *nearest;
  double           *got, *buffer;
  remap_status      status = REMAP_OK;

  RM_TRY(rm_nearest_build(w->arena, comm, mesh, w->setup->receiving_stencil, w->setup->rows->cover, &nearest, reason));
  got    = rm_arena_alloc(w->arena, nearest->plan->recv_offset[nearest->plan->num_recv], sizeof *got);
  buffer = rm_arena_alloc(w->arena, nearest->plan->send_offset[nearest->plan->num_send], sizeof *buffer);
  RM_TRY(rm_comm_agree(comm, got && buffer ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(got && buffer);
  for (int f = 0; f < w->num_fields && status == REMAP_OK; f++) {
    double *value = w->value + (int64_t)f * mesh->num_cells;

    if (!needs_nearest(w, &w->fields[f])) continue;
    status = rm_plan_run(comm, nearest->plan, sizeof *value, value, got, buffer);
    if (status != REMAP_OK) break;
    for (int64_t k = 0; k < nearest->num; k++) value[nearest->cell[k]] = got[nearest->origin[k]];
  }
  return rm_comm_agree(comm, status, NULL);
}

/* ---- report ---------------------------------------------------------------------------------------------------- */

/* Least and greatest finite value of a list, kept in the two numbers; -0 counts as +0, whichever comes first. */
static void widen(const double *value, rm_lid n, double *least, double *greatest)
{
  *least    = INFINITY;
  *greatest = -INFINITY;
  for (rm_lid c = 0; c < n; c++) {
    if (!isfinite(value[c])) continue;
    *least    = fmin(*least, value[c] + 0.0);
    *greatest = fmax(*greatest, value[c] + 0.0);
  }
}

/* Collective. reports may be NULL on this rank. */
static remap_status report(work *w, remap_field_report *reports)
{
  const rm_transfer_setup *setup    = w->setup;
  const int                n        = w->num_fields;
  double                  *least    = rm_arena_alloc(w->arena, 2 * (int64_t)n, sizeof *least);
  double                  *greatest = rm_arena_alloc(w->arena, 2 * (int64_t)n, sizeof *greatest);

  RM_TRY(rm_comm_agree(setup->comm, least && greatest ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(least && greatest);
  for (int f = 0; f < n; f++) {
    const double *value = w->value + (int64_t)f * setup->receiving->num_cells;

    widen(w->fields[f].in, setup->giving->num_cells, &least[2 * f], &greatest[2 * f]);
    widen(value, setup->receiving->num_cells, &least[2 * f + 1], &greatest[2 * f + 1]);
  }
  rm_integral_source(setup, n, w->fields, &w->packing, w->pack, w->integral);
  RM_TRY(rm_comm_min_f64(setup->comm, least, 2 * n));
  RM_TRY(rm_comm_max_f64(setup->comm, greatest, 2 * n));
  RM_TRY(rm_comm_sum_i64(setup->comm, w->limited, n));
  RM_TRY(rm_integral_report(w->arena, setup, n, &w->packing, w->integral, reports));
  for (int f = 0; f < n && reports; f++) {
    const double *low = least + 2 * f, *high = greatest + 2 * f;

    reports[f].order         = w->packing.order[f];
    reports[f].source_min    = low[0] <= high[0] ? low[0] : 0.0; /* no cells: 0 */
    reports[f].source_max    = low[0] <= high[0] ? high[0] : 0.0;
    reports[f].target_min    = low[1] <= high[1] ? low[1] : 0.0;
    reports[f].target_max    = low[1] <= high[1] ? high[1] : 0.0;
    reports[f].limited_cells = w->limited[f];
  }
  return REMAP_OK;
}

/* ---------------------------------------------------------------------------------------------------------------- */

remap_status rm_field_transfer(rm_arena *arena, const rm_transfer_setup *setup, const remap_transfer *how, int num_fields,
                               const remap_field_desc *fields, remap_field_report *reports, rm_reason *reason)
{
  const rm_lid num_cells   = setup->receiving->num_cells;
  bool         any_nearest = false;
  work         w           = {.arena = arena, .setup = setup, .how = how, .num_fields = num_fields, .fields = fields};

  RM_TRY(check(&w, reports != NULL, reason));
  RM_TRY(travel(&w));
  receive_all(&w);
  for (int f = 0; f < num_fields; f++) any_nearest |= needs_nearest(&w, &fields[f]);
  if (any_nearest && answer(&w, HAS_UNCOVERED)) RM_TRY(take_nearest(&w, reason));
  if (answer(&w, WANTS_REPORTS)) RM_TRY(report(&w, reports));
  for (int f = 0; f < num_fields; f++)
    for (rm_lid c = 0; c < num_cells; c++) fields[f].out[c] = w.value[(int64_t)f * num_cells + c];
  return REMAP_OK;
}
