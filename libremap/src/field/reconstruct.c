/* reconstruct -- what giving cells send: their value and, at order 2, a slope about their centroid, at order 3 a quadratic
 * polynomial, limited if asked for. Cells are fitted first, then finished: where the limiter tells smooth cells from others,
 * all are looked at in between.
 *
 * Barth-Jespersen: the greatest factor in [0, 1] with which no node of the cell gets a value beyond those of the cell and its
 * neighbours; a quadratic polynomial that may leave these bounds anywhere in the cell gives way to the limited slope. Values
 * are scaled by a power of two, so nothing overflows and no digit changes. O(neighbours) per cell and field. */
#include "field_private.h"
#include "lanes.h"

#include <string.h>

enum { TWOS = RM_SPAN_FIELDS / 2 };

/* ---- fit --------------------------------------------------------------------------------------------------------- */

double *rm_bounds_of(const rm_profile *w, const rm_packing *p, const rm_span *span, rm_lid cell)
{
  if (p->has_bounds) return rm_pack_of(w, p, cell) + p->at[span->first] + RM_PACK_BOUNDS * span->num;
  if (p->is_checked) return w->bounds + ((int64_t)cell * p->num_fields + span->first) * 2;
  return p->is_limited ? w->line + 2 * span->first : NULL;
}

/* Fit the fields of a span; which of them have a quadratic polynomial. */
static unsigned fit_span(const rm_profile *w, const rm_packing *p, const rm_span *span, rm_lid cell)
{
  const rm_stencil *stencil = w->ground.stencil;
  const rm_around   u       = rm_around_span(w, p, span);
  const int         num     = span->num;
  double *const     slope = rm_pack_of(w, p, cell) + p->at[span->first] + RM_PACK_SLOPE * num;
  double *const     bounds = rm_bounds_of(w, p, span, cell);
  double           *curvature;
  double            linear[3 * RM_SPAN_FIELDS];
  unsigned          found;

  if (p->order[span->first] < 3) {
    rm_fit_slopes(stencil, cell, &u, num, slope, bounds);
    return 0;
  }
  curvature = slope + (rm_pack_curvature(p->has_bounds) - RM_PACK_SLOPE) * num;
  if (bounds) rm_fit_bounds(stencil, cell, &u, num, bounds);
  found = rm_fit_quadratic(stencil, cell, &u, num, slope, curvature);
  if (found + 1 == 1u << num) return found;
  rm_fit_slopes(stencil, cell, &u, num, linear, NULL);
  for (int f = 0; f < num; f++)
    for (int d = 0; d < 3 && !(found >> f & 1); d++) slope[d * num + f] = linear[d * num + f];
  return found;
}

static void fit_cell(const rm_profile *w, const rm_packing *p, rm_lid cell, bool is_asked)
{
  for (int i = 0; i < p->num_spans; i++) {
    const rm_span *span = &p->span[i];

    if (p->order[span->first] < 2) continue;
    const unsigned found = fit_span(w, p, span, cell);
    if (p->is_checked) rm_smooth_show(w, p, span, cell);
    for (int f = 0; f < span->num && is_asked && p->order[span->first] > 2; f++)
      w->limited[p->num_fields + span->first + f] += !(found >> f & 1);
  }
}

/* ---- limits ------------------------------------------------------------------------------------------------------ */

/* How far slopes [3][num] go up and down at the nodes of a cell; twos, half of num, rounded up, is a constant where this is
 * called. */
RM_UNROLLED void climb(const rm_ground *ground, rm_lid cell, int num, int twos, const double *slope, double *up, double *down)
{
  const rm_stencil *stencil = ground->stencil;
  const rm_mesh    *mesh    = ground->mesh;
  const double     *c       = mesh->cell_centroid[cell];
  rm_lanes          g[3][TWOS], most[TWOS], least[TWOS];

  for (int t = 0; t < twos; t++) {
    most[t] = least[t] = rm_lanes_of(0.0);
    for (int d = 0; d < 3; d++) g[d][t] = rm_lanes_at(slope + d * num + 2 * t);
  }
  for (int64_t k = stencil->node_offset[cell], end = stencil->node_offset[cell + 1]; k < end; k++) {
    const double  *x    = mesh->node_xyz[stencil->node[k]];
    const rm_lanes y[3] = {rm_lanes_of(x[0] - c[0]), rm_lanes_of(x[1] - c[1]), rm_lanes_of(x[2] - c[2])};

    for (int t = 0; t < twos; t++) {
      const rm_lanes rise = g[0][t] * y[0] + g[1][t] * y[1] + g[2][t] * y[2];

      most[t]  = rm_lanes_greatest(rise, most[t]);
      least[t] = rm_lanes_least(rise, least[t]);
    }
  }
  for (int t = 0; t < twos; t++) {
    rm_lanes_put(most[t], num - 2 * t, up + 2 * t);
    rm_lanes_put(least[t], num - 2 * t, down + 2 * t);
  }
}

static void climb_span(const rm_ground *ground, rm_lid cell, int num, const double *slope, double *up, double *down)
{
  if (num > 2)
    climb(ground, cell, num, TWOS, slope, up, down);
  else
    climb(ground, cell, num, 1, slope, up, down);
}

/* The factor by which a slope may stay so that what it adds keeps within these bounds of the value. */
static double factor_within(double up, double down, double value, const double bounds[2])
{
  double factor = 1.0;

  if (up > 0.0 && up > bounds[1] - value) factor = (bounds[1] - value) / up;
  if (down < 0.0 && factor * down < bounds[0] - value) factor = (bounds[0] - value) / down;
  return factor;
}

/* A polynomial as it is limited. */
typedef struct quadratic {
  double value, slope[3], curvature[7];
} quadratic;

/* Is it certain, by the extent of the nodes about the centroid alone, that a polynomial keeps within bounds? */
static bool is_far_within(const quadratic *q, const double extent[3], const double bounds[2])
{
  const double *r = extent, *g = q->slope, *h = q->curvature, middle = q->value + h[6];
  const double  most = (fabs(g[0]) * r[0] + fabs(g[1]) * r[1] + fabs(g[2]) * r[2]) +
                      ((fabs(h[0]) * r[0] + fabs(h[3]) * r[1] + fabs(h[4]) * r[2]) * r[0] +
                       (fabs(h[1]) * r[1] + fabs(h[5]) * r[2]) * r[1] + fabs(h[2]) * r[2] * r[2]);

  return middle - most >= bounds[0] && middle + most <= bounds[1];
}

/* Does a quadratic polynomial keep within bounds in the hull of the nodes? It lies between the least and the greatest of its
 * polar form, rest + g.(y + z)/2 + h:(y z^T), over pairs of nodes. */
static bool keeps_within(const rm_ground *ground, rm_lid cell, const quadratic *q, const double bounds[2])
{
  const rm_stencil *stencil = ground->stencil;
  const rm_mesh    *mesh    = ground->mesh;
  const double     *c = mesh->cell_centroid[cell], *g = q->slope;
  const int64_t     first = stencil->node_offset[cell], end = stencil->node_offset[cell + 1];

  for (int64_t k = first; k < end; k++) {
    const double *x = mesh->node_xyz[stencil->node[k]], y[3] = {x[0] - c[0], x[1] - c[1], x[2] - c[2]};
    const double  at_y = q->value + q->curvature[6] + 0.5 * (g[0] * y[0] + g[1] * y[1] + g[2] * y[2]);

    for (int64_t l = first; l <= k; l++) {
      const double *x2 = mesh->node_xyz[stencil->node[l]], z[3] = {x2[0] - c[0], x2[1] - c[1], x2[2] - c[2]};
      const double  polar = at_y + 0.5 * (g[0] * z[0] + g[1] * z[1] + g[2] * z[2]) + rm_form(q->curvature, y, z);

      if (!(polar >= bounds[0] && polar <= bounds[1])) return false;
    }
  }
  return true;
}

/* How far the nodes of a cell lie from its centroid along each axis. */
static void find_extent(const rm_ground *ground, rm_lid cell, double extent[3])
{
  const rm_stencil *stencil = ground->stencil;
  const double     *c       = ground->mesh->cell_centroid[cell];

  for (int d = 0; d < 3; d++) extent[d] = 0.0;
  for (int64_t k = stencil->node_offset[cell]; k < stencil->node_offset[cell + 1]; k++)
    for (int d = 0; d < 3; d++) {
      const double y = fabs(ground->mesh->node_xyz[stencil->node[k]][d] - c[d]);

      extent[d] = y > extent[d] ? y : extent[d];
    }
}

/* A smooth field may leave the neighbours' bounds, at extrema and towards walls: by as much as they lie apart, not past 0. */
static void widen_bounds(double bounds[2])
{
  const double range = bounds[1] - bounds[0];

  bounds[0] = bounds[0] >= 0.0 && bounds[0] < range ? 0.0 : bounds[0] - range;
  bounds[1] = bounds[1] <= 0.0 && bounds[1] > -range ? 0.0 : bounds[1] + range;
}

/* Bounds of an amount per mass: smooth fields may leave the neighbours', but not those of the whole mesh. */
static void widen_within(double bounds[2], const double extreme[2])
{
  const double range = bounds[1] - bounds[0];

  bounds[0] = fmax(bounds[0] - range, fmin(bounds[0], RM_VALUE_SCALE * extreme[0]));
  bounds[1] = fmin(bounds[1] + range, fmax(bounds[1], RM_VALUE_SCALE * extreme[1]));
}

/* Has a field bounds of its own whatever its sign: what moves with the mass, but for energy? */
static bool is_carried(const rm_packing *packing, int f)
{
  const rm_system *s = packing->system_of[f] >= 0 ? &packing->system[packing->system_of[f]] : NULL;

  return s && f != s->density && f != s->energy;
}

static double value_of(const rm_profile *w, const rm_packing *packing, rm_lid cell, int f)
{
  return RM_VALUE_SCALE * w->number[(int64_t)cell * packing->num_fields + f];
}

static bool is_smooth_cell(const rm_profile *w, const rm_packing *p, rm_lid cell, int f)
{
  return p->is_checked && !rm_is_rough(w->spread + (int64_t)cell * rm_rough_words(p->num_fields), f);
}

/* ---- finish: linear slopes of fields outside of systems ----------------------------------------------------------------- */

/* Do all slopes of a span that go so far keep within bounds [2][num] as they are? */
static bool keep_all(const double *value, int num, const double *up, const double *down, const double *bounds)
{
  bool keep = true;

  for (int f = 0; f < num; f++) {
    const double here = RM_VALUE_SCALE * value[f];

    keep &= up[f] <= bounds[num + f] - here && down[f] >= bounds[f] - here;
  }
  return keep;
}

static void limit_linear(const rm_profile *w, const rm_packing *p, const rm_span *span, rm_lid cell, double *slope)
{
  const int     num    = span->num;
  double *const bounds = rm_bounds_of(w, p, span, cell);
  double        up[RM_SPAN_FIELDS], down[RM_SPAN_FIELDS];

  climb_span(&w->ground, cell, num, slope, up, down);
  if (!p->has_bounds && keep_all(w->number + (int64_t)cell * p->num_fields + span->first, num, up, down, bounds)) return;
  for (int f = 0; f < num; f++) {
    double own[2] = {bounds[f], bounds[num + f]}, factor;

    if (is_smooth_cell(w, p, cell, span->first + f)) widen_bounds(own);
    factor = factor_within(up[f], down[f], value_of(w, p, cell, span->first + f), own);
    for (int d = 0; d < 3 && factor < 1.0; d++) slope[d * num + f] *= factor;
    for (int b = 0; b < 2; b++) bounds[b * num + f] = own[b];
    w->limited[span->first + f] += factor < 1.0;
  }
}

/* ---- finish: quadratic polynomials, and those of systems ---------------------------------------------------------------- */

/* A cell that is finished. */
typedef struct draft {
  const rm_profile *w;
  const rm_packing *p;
  rm_lid            cell;
  double           *place;     /* in the pack                                        */
  double            extent[3]; /* of its nodes                                       */
  double           *linear;    /* [3 num_fields] linear slopes, span after span      */
  double           *up, *down; /* [num_fields] how far they go                       */
  uint8_t          *is_made;   /* [num_spans] 1: these three are known               */
} draft;

/* Make the linear slopes of a span and see how far they go, unless that is known; before anything of it is finished. */
static void need_linear(const draft *d, int i)
{
  const rm_packing *p      = d->p;
  const rm_span    *span   = &p->span[i];
  const rm_around   u      = rm_around_span(d->w, p, span);
  double           *linear = d->linear + 3 * span->first;

  if (d->is_made[i]) return;
  d->is_made[i] = 1;
  if (p->order[span->first] > 2)
    rm_fit_slopes(d->w->ground.stencil, d->cell, &u, span->num, linear, NULL);
  else
    memcpy(linear, d->place + p->at[span->first] + RM_PACK_SLOPE * span->num, 3 * (size_t)span->num * sizeof *linear);
  climb_span(&d->w->ground, d->cell, span->num, linear, d->up + span->first, d->down + span->first);
}

/* One field's reconstruction as it may be limited. */
typedef struct fit {
  quadratic whole;
  double    linear[3], bounds[2];           /* bounds: those that the limiter keeps              */
  double    local[2];                       /* those of the neighbours alone                     */
  double    factor;                         /* that the linear slope is limited by               */
  bool      is_quadratic, has_none, is_limited; /* has_none: there is no polynomial of order 3       */
} fit;

static bool is_curved(const double h[7])
{
  bool is = false;

  for (int k = 0; k < 6; k++) is |= h[k] < 0.0 || h[k] > 0.0;
  return is;
}

/* Fit of field f of span i; with the linear one too if it is wanted or nothing else keeps within bounds. */
static void see_fit(const draft *d, int i, int f, bool is_smooth, bool wants_linear, fit *out)
{
  const rm_profile *w          = d->w;
  const rm_packing *p          = d->p;
  const int         num        = p->span[i].num, k = f - p->span[i].first;
  const double     *bounds     = rm_bounds_of(w, p, &p->span[i], d->cell);
  const double      extreme[2] = {w->extreme[f], w->extreme[p->num_fields + f]};

  out->whole.value = value_of(w, p, d->cell, f);
  out->factor      = 1.0;
  rm_pack_read(p, f, d->place, RM_PACK_SLOPE, 3, out->whole.slope);
  rm_pack_read(p, f, d->place, RM_PACK_SLOPE, 3, out->linear);
  if (p->order[f] > 2) rm_pack_read(p, f, d->place, rm_pack_curvature(p->has_bounds), 7, out->whole.curvature);
  out->is_quadratic = p->order[f] > 2 && is_curved(out->whole.curvature);
  out->has_none     = p->order[f] > 2 && !out->is_quadratic;
  out->is_limited   = false;
  for (int b = 0; b < 2 && bounds; b++) out->local[b] = out->bounds[b] = bounds[b * num + k];
  if (bounds && is_carried(p, f) && (is_smooth || !p->is_limited))
    widen_within(out->bounds, extreme);
  else if (bounds && is_smooth)
    widen_bounds(out->bounds);
  if (!p->is_limited) return;
  if (out->is_quadratic && !is_far_within(&out->whole, d->extent, out->bounds) &&
      !keeps_within(&w->ground, d->cell, &out->whole, out->bounds)) {
    out->is_quadratic = false;
    out->is_limited   = true;
  }
  if (out->is_quadratic && !wants_linear) return;
  need_linear(d, i);
  for (int a = 0; a < 3; a++) out->linear[a] = d->linear[3 * p->span[i].first + a * num + k];
  out->factor = factor_within(d->up[f], d->down[f], out->whole.value, out->bounds);
  out->is_limited |= !out->is_quadratic && out->factor < 1.0;
}

/* A fit into the pack: quadratic, or its linear slope times a factor. */
static void put_fit(const draft *d, int f, const fit *x, bool is_quadratic, double factor)
{
  static const double none[7] = {0.0};
  const rm_packing   *p       = d->p;
  const double        slope[3] = {factor * x->linear[0], factor * x->linear[1], factor * x->linear[2]};

  rm_pack_write(p, f, is_quadratic ? x->whole.slope : slope, RM_PACK_SLOPE, 3, d->place);
  rm_pack_write(p, f, is_quadratic ? x->whole.curvature : none, rm_pack_curvature(p->has_bounds), 7, d->place);
  if (!p->has_bounds) return;
  rm_pack_write(p, f, p->system_of[f] < 0 || is_carried(p, f) ? x->bounds : x->local, RM_PACK_BOUNDS, 2, d->place);
}

/* Mass fractions of a system. */
static bool is_fraction(const rm_packing *p, int f)
{
  return p->system_of[f] >= 0 && p->fields[f].role == REMAP_ROLE_MASS_FRACTION;
}

/* The fields of a span, but for fractions. */
static void finish_fits(const draft *d, int i)
{
  const rm_span *span = &d->p->span[i];

  for (int f = span->first; f < span->first + span->num; f++) {
    fit x;

    if (is_fraction(d->p, f)) continue;
    see_fit(d, i, f, is_smooth_cell(d->w, d->p, d->cell, f), false, &x);
    put_fit(d, f, &x, x.is_quadratic, x.factor);
    d->w->limited[f] += x.is_limited;
  }
}

/* The mass fractions of a system keep their sum: they are limited alike. */
static void finish_fractions(const draft *d, int s)
{
  const rm_packing *p         = d->p;
  bool              is_smooth = true, is_quadratic = true;
  double            factor = 1.0;
  fit               x;

  for (int f = 0; f < p->num_fields; f++)
    if (is_fraction(p, f) && p->system_of[f] == s) is_smooth = is_smooth && is_smooth_cell(d->w, p, d->cell, f);
  for (int pass = 0; pass < 2; pass++) /* look at all, then put them */
    for (int i = 0; i < p->num_spans; i++)
      for (int f = p->span[i].first; f < p->span[i].first + p->span[i].num; f++) {
        if (!is_fraction(p, f) || p->system_of[f] != s) continue;
        see_fit(d, i, f, is_smooth, true, &x);
        if (pass == 0) {
          is_quadratic = is_quadratic && x.is_quadratic;
          factor       = fmin(factor, x.factor);
          continue;
        }
        put_fit(d, f, &x, is_quadratic, factor);
        d->w->limited[f] += p->is_limited && (p->order[f] > 2 ? !is_quadratic && !x.has_none : factor < 1.0);
      }
}

/* ---- finish: all of a cell ---------------------------------------------------------------------------------------------- */

/* The mean belongs to the true centroid; what travels is the value at the rounded one, about which the moments are. */
static void move_to_rounded_centroid(const double error[3], const rm_span *span, double *value)
{
  const int     num   = span->num;
  const double *slope = value + RM_PACK_SLOPE * num;

  for (int f = 0; f < num; f++) {
    const double rise = slope[f] * error[0] + slope[num + f] * error[1] + slope[2 * num + f] * error[2];

    if (rise < 0.0 || rise > 0.0) value[f] = (RM_VALUE_SCALE * value[f] - rise) / RM_VALUE_SCALE;
  }
}

/* Limit what was fitted in a cell, and make of it what travels. */
static void finish_slopes(const rm_profile *w, const rm_packing *p, rm_lid cell, double *place)
{
  const int n = p->num_fields;
  draft     d = {w, p, cell, place, {0.0, 0.0, 0.0}, w->line + 2 * n, w->line + 5 * n, w->line + 6 * n, w->is_made};
  bool      is_linear = true;

  for (int i = 0; i < p->num_spans; i++) is_linear &= p->span[i].degree < 2;
  if (!is_linear) memset(w->is_made, 0, (size_t)p->num_spans);
  if (!is_linear && p->is_limited) find_extent(&w->ground, cell, d.extent);
  for (int i = 0; i < p->num_spans; i++) {
    const rm_span *span  = &p->span[i];
    double        *value = place + p->at[span->first];

    if (p->order[span->first] < 2) continue;
    if (span->degree > 1)
      finish_fits(&d, i);
    else if (p->is_limited)
      limit_linear(w, p, span, cell, value + RM_PACK_SLOPE * span->num);
    if (p->system_of[span->first] < 0) move_to_rounded_centroid(w->ground.rows->centroid_error[cell], span, value);
  }
  for (int s = 0; s < p->num_systems; s++) {
    if (p->order[p->system[s].density] < 2) continue;
    finish_fractions(&d, s);
    rm_system_combine(p, s, w->given + (int64_t)cell * n, w->number + (int64_t)cell * n, w->ground.second[cell],
                      w->ground.mesh->cell_volume[cell], w->ground.rows->centroid_error[cell], place);
  }
}

/* Amounts by the solver's volumes. */
static void measure_cell(const rm_profile *w, const rm_packing *p, rm_lid cell, double *place)
{
  const double measure = w->ground.measure[cell];

  for (int f = 0; f < p->num_fields; f++) {
    if (!rm_is_amount(p, f)) continue;
    place[p->at[f]] *= measure;
    if (p->degree[f] > 0) rm_pack_scale(p, f, measure, RM_PACK_SLOPE, 3, place);
    if (p->degree[f] > 1) rm_pack_scale(p, f, measure, rm_pack_curvature(p->has_bounds), 7, place);
  }
}

static bool is_asked(const rm_ground *ground, uint8_t cover)
{
  return ground->is_keeping ? cover == REMAP_PARTIAL : rm_is_mapped(cover);
}

/* What travels where nobody asks for slopes: values are already there. */
static void clear_slopes(const rm_packing *p, double *place)
{
  for (int i = 0; i < p->num_spans; i++) {
    const rm_span *span = &p->span[i];

    for (int k = span->num; k < span->num * rm_pack_width(span->degree, p->has_bounds); k++)
      place[p->at[span->first] + k] = 0.0;
  }
}

static void finish_cell(const rm_profile *w, const rm_packing *p, rm_lid cell, bool asked, bool is_sloped)
{
  const int     num   = p->num_fields;
  const double *given = w->given + (int64_t)cell * num, *number = w->number + (int64_t)cell * num;
  const bool    is_same = asked && rm_is_copied(w->ground.rows, w->ground.differs, cell, true);
  double       *place   = rm_pack_of(w, p, cell);

  for (int f = 0; f < num; f++)
    place[p->at[f]] = is_same || p->system_of[f] < 0 ? given[f] : rm_system_amount(p, f, given, number);
  if (asked && is_sloped)
    finish_slopes(w, p, cell, place);
  else if (p->width > num)
    clear_slopes(p, place);
  if (asked && w->ground.measure && !is_same) measure_cell(w, p, cell, place);
}

void rm_reconstruct(const rm_profile *w, const rm_packing *p, uint8_t which, int steps)
{
  const bool is_sloped = rm_profile_reads_halo(p);

  for (rm_lid c = 0; c < w->ground.mesh->num_cells; c++) { /* cells first: their weights are read once for all fields */
    const bool asked = is_asked(&w->ground, w->ground.rows->cover[c]);

    if (w->needs_halo[c] != which) continue;
    if (steps & RM_FIT && is_sloped && (asked || p->is_checked)) fit_cell(w, p, c, asked);
    if (steps & RM_FINISH) finish_cell(w, p, c, asked, is_sloped);
  }
}
