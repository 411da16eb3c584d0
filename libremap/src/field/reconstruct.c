/* reconstruct -- what giving cells send: their value and, at order 2, a slope about their centroid, at order 3 a quadratic
 * polynomial, limited if asked for.
 *
 * Barth-Jespersen: the greatest factor in [0, 1] with which no node of the cell gets a value beyond those of the cell and its
 * neighbours; a quadratic polynomial that may leave these bounds anywhere in the cell gives way to the limited slope. Values
 * are scaled by a power of two, so nothing overflows and no digit changes. O(neighbours) per cell and field. */
#include "field_private.h"
#include "lanes.h"

/* What is known of a cell's fields before they are limited, row by row. */
typedef struct draft {
  rm_fit        linear;
  const double *up, *down; /* [num_fields] the farthest that the linear slope goes up and down at a node; 0 without limiter */
} draft;

enum { TWOS = RM_SPAN_FIELDS / 2 };

/* How far the slopes of few fields go up and down at the nodes of a cell. The first field's are at slope, [3][num] in all; twos
 * is half of few, rounded up. */
RM_UNROLLED void climb(const rm_stencil *stencil, const rm_mesh *mesh, rm_lid cell, int few, int twos, int num,
                       const double *slope, double *up, double *down)
{
  const double *c = mesh->cell_centroid[cell];
  rm_lanes      g[3][TWOS], most[TWOS], least[TWOS];

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
    rm_lanes_put(most[t], few - 2 * t, up + 2 * t);
    rm_lanes_put(least[t], few - 2 * t, down + 2 * t);
  }
}

/* The factor by which a slope may stay so that what it adds keeps within these bounds of the value. */
static double factor_within(double up, double down, double value, const double bounds[2])
{
  double factor = 1.0;

  if (up > 0.0 && up > bounds[1] - value) factor = (bounds[1] - value) / up;
  if (down < 0.0 && factor * down < bounds[0] - value) factor = (bounds[0] - value) / down;
  return factor;
}

/* Linear fits of all fields in a cell. Where smooth cells are told from others they are known already, but for those that
 * quadratic ones have taken the place of. */
static draft draft_of(const rm_profile *w, const rm_packing *p, rm_lid cell)
{
  const int num = p->num_fields;
  double   *up = w->line + 5 * num, *down = up + num;
  draft     d     = {{w->line, w->line + 3 * num}, up, down};
  bool      known = p->is_checked;

  for (int i = 0; i < p->num_spans; i++) known = known && p->order[p->span[i].first] < 3;
  if (known)
    d.linear = (rm_fit){w->slope + (int64_t)cell * 4 * num, w->bounds + (int64_t)cell * 2 * num};
  else
    rm_fit_slopes(w->ground.stencil, p, cell, (rm_numbers){w->number, rm_flow_numbers(&w->halo)}, d.linear);
  for (int i = 0; i < p->num_spans && p->is_limited; i++) {
    const int     first = p->span[i].first, few = p->span[i].num;
    const double *slope = d.linear.slope + first;

    if (few > 2)
      climb(w->ground.stencil, w->ground.mesh, cell, few, TWOS, num, slope, up + first, down + first);
    else
      climb(w->ground.stencil, w->ground.mesh, cell, few, 1, num, slope, up + first, down + first);
  }
  return d;
}

/* Does a quadratic polynomial keep within [least, greatest] in the hull of the nodes? It lies between the least and the
 * greatest of its polar form, rest + g.(y + z)/2 + h:(y z^T), over pairs of nodes. */
static bool keeps_within(const rm_stencil *stencil, const rm_mesh *mesh, rm_lid cell, double value, const double *slope,
                         const double *curvature, double least, double greatest)
{
  const double *c     = mesh->cell_centroid[cell];
  const int64_t first = stencil->node_offset[cell], end = stencil->node_offset[cell + 1];

  for (int64_t k = first; k < end; k++) {
    const double *x = mesh->node_xyz[stencil->node[k]], y[3] = {x[0] - c[0], x[1] - c[1], x[2] - c[2]};
    const double  at_y = value + curvature[6] + 0.5 * (slope[0] * y[0] + slope[1] * y[1] + slope[2] * y[2]);

    for (int64_t l = first; l <= k; l++) {
      const double *x2 = mesh->node_xyz[stencil->node[l]], z[3] = {x2[0] - c[0], x2[1] - c[1], x2[2] - c[2]};
      const double  polar = at_y + 0.5 * (slope[0] * z[0] + slope[1] * z[1] + slope[2] * z[2]) + rm_form(curvature, y, z);

      if (!(polar >= least && polar <= greatest)) return false;
    }
  }
  return true;
}

/* A smooth field may leave the neighbours' bounds, at extrema and towards walls: by as much as they lie apart, not past 0. */
static void widen_bounds(double bounds[2])
{
  const double range = bounds[1] - bounds[0];

  bounds[0] = bounds[0] >= 0.0 && bounds[0] < range ? 0.0 : bounds[0] - range;
  bounds[1] = bounds[1] <= 0.0 && bounds[1] > -range ? 0.0 : bounds[1] + range;
}

/* The reconstruction of one field in one cell, before it is limited. */
typedef struct fit {
  double linear[3], slope[3], curvature[7], bounds[2]; /* bounds: those that the limiter keeps */
  double local[2];                                     /* those of the neighbours alone        */
  double factor;                                       /* that the linear slope is limited by  */
  bool   is_quadratic, is_reduced, is_limited;
} fit;

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

static void fit_cell(const rm_profile *w, const rm_packing *packing, rm_lid cell, int f, bool is_smooth, const draft *d,
                     fit *out)
{
  const rm_stencil *stencil    = w->ground.stencil;
  const rm_mesh    *mesh       = w->ground.mesh;
  const int         num        = packing->num_fields;
  const double      value      = value_of(w, packing, cell, f);
  const double      extreme[2] = {w->extreme[f], w->extreme[num + f]};

  out->factor       = 1.0;
  out->is_quadratic = out->is_reduced = out->is_limited = false;
  for (int b = 0; b < 2; b++) out->local[b] = out->bounds[b] = d->linear.bounds[b * num + f];
  if (is_carried(packing, f) && (is_smooth || !packing->is_limited))
    widen_within(out->bounds, extreme);
  else if (is_smooth)
    widen_bounds(out->bounds);
  for (int i = 0; i < 3; i++) out->slope[i] = out->linear[i] = d->linear.slope[i * num + f];
  if (packing->order[f] > 2) {
    const rm_around u = rm_around_of((rm_numbers){w->number, rm_flow_numbers(&w->halo)}, f, num);

    out->is_quadratic = rm_fit_quadratic(stencil, cell, &u, out->slope, out->curvature);
    out->is_reduced   = !out->is_quadratic;
    if (out->is_quadratic && packing->is_limited &&
        !keeps_within(stencil, mesh, cell, value, out->slope, out->curvature, out->bounds[0], out->bounds[1])) {
      out->is_quadratic = false;
      out->is_limited   = true;
    }
  }
  if (!packing->is_limited) return;
  out->factor = factor_within(d->up[f], d->down[f], value, out->bounds);
  out->is_limited |= !out->is_quadratic && out->factor < 1.0;
}

/* A fit into the pack: quadratic, or its linear slope times a factor. */
static void put_fit(const rm_packing *packing, int f, const fit *x, bool is_quadratic, double factor, double *place)
{
  double *slope = place + RM_PACK_SLOPE, *curvature = place + rm_pack_curvature(packing->has_bounds);

  for (int d = 0; d < 3; d++) slope[d] = is_quadratic ? x->slope[d] : factor * x->linear[d];
  for (int b = 0; b < 2 && packing->has_bounds; b++)
    place[RM_PACK_BOUNDS + b] = packing->system_of[f] < 0 || is_carried(packing, f) ? x->bounds[b] : x->local[b];
  for (int k = 0; k < 7 && packing->degree[f] > 1; k++) curvature[k] = is_quadratic ? x->curvature[k] : 0.0;
}

/* Mass fractions of a system. */
static bool is_fraction(const rm_packing *packing, int f)
{
  return packing->system_of[f] >= 0 && packing->fields[f].role == REMAP_ROLE_MASS_FRACTION;
}

static bool is_smooth_cell(const rm_profile *w, const rm_packing *packing, rm_lid cell, int f)
{
  return packing->is_checked && !(w->spread[(int64_t)cell * packing->num_fields + f] > 0.0);
}

/* The mass fractions of a system keep their sum: they are limited alike. */
static void reconstruct_fractions(const rm_profile *w, const rm_packing *packing, rm_lid cell, int s, const draft *d,
                                  double *place)
{
  const int num       = packing->num_fields;
  bool      is_smooth = true, is_quadratic = true;
  double    factor = 1.0;
  fit       x;

  for (int f = 0; f < num; f++)
    if (is_fraction(packing, f) && packing->system_of[f] == s) is_smooth = is_smooth && is_smooth_cell(w, packing, cell, f);
  for (int f = 0; f < num; f++) {
    if (!is_fraction(packing, f) || packing->system_of[f] != s) continue;
    fit_cell(w, packing, cell, f, is_smooth, d, &x);
    is_quadratic = is_quadratic && x.is_quadratic;
    factor       = fmin(factor, x.factor);
  }
  for (int f = 0; f < num; f++) {
    if (!is_fraction(packing, f) || packing->system_of[f] != s) continue;
    fit_cell(w, packing, cell, f, is_smooth, d, &x);
    put_fit(packing, f, &x, is_quadratic, factor, place + packing->at[f]);
    w->limited[f] += packing->is_limited && (packing->order[f] > 2 ? !is_quadratic && !x.is_reduced : factor < 1.0);
    w->limited[num + f] += x.is_reduced;
  }
}

/* The mean belongs to the true centroid; what travels is the value at the rounded one, about which the moments are. */
static void move_to_rounded_centroid(const double error[3], double *place)
{
  const double *slope = place + RM_PACK_SLOPE;
  const double  rise  = slope[0] * error[0] + slope[1] * error[1] + slope[2] * error[2];

  if (rise < 0.0 || rise > 0.0) place[0] = (RM_VALUE_SCALE * place[0] - rise) / RM_VALUE_SCALE;
}

/* Linear slopes of a field outside of systems. */
static void put_linear(const rm_profile *w, const rm_packing *packing, rm_lid cell, int f, const draft *d, double *at)
{
  const int num       = packing->num_fields;
  double    bounds[2] = {d->linear.bounds[f], d->linear.bounds[num + f]}, factor = 1.0;

  if (packing->is_limited) {
    if (is_smooth_cell(w, packing, cell, f)) widen_bounds(bounds);
    factor = factor_within(d->up[f], d->down[f], value_of(w, packing, cell, f), bounds);
    w->limited[f] += factor < 1.0;
  }
  for (int i = 0; i < 3; i++) at[RM_PACK_SLOPE + i] = factor * d->linear.slope[i * num + f];
  for (int b = 0; b < 2 && packing->has_bounds; b++) at[RM_PACK_BOUNDS + b] = bounds[b];
}

/* Polynomials of all fields in one cell, as they are reconstructed. */
static void reconstruct_cell(const rm_profile *w, const rm_packing *packing, rm_lid cell, double *place)
{
  const int   num = packing->num_fields;
  const draft d   = draft_of(w, packing, cell);

  for (int f = 0; f < num; f++) {
    double *at = place + packing->at[f];
    fit     x;

    if (packing->order[f] < 2 || is_fraction(packing, f)) continue;
    if (packing->degree[f] == 1) {
      put_linear(w, packing, cell, f, &d, at);
    } else {
      fit_cell(w, packing, cell, f, is_smooth_cell(w, packing, cell, f), &d, &x);
      put_fit(packing, f, &x, x.is_quadratic, x.factor, at);
      w->limited[f] += x.is_limited;
      w->limited[num + f] += x.is_reduced;
    }
    if (packing->system_of[f] < 0) move_to_rounded_centroid(w->ground.rows->centroid_error[cell], at);
  }
  for (int s = 0; s < packing->num_systems; s++) {
    const int at = packing->system[s].density;

    if (packing->order[at] < 2) continue;
    reconstruct_fractions(w, packing, cell, s, &d, place);
    rm_system_combine(packing, s, w->given + (int64_t)cell * num, w->number + (int64_t)cell * num, w->ground.second[cell],
                      w->ground.mesh->cell_volume[cell], w->ground.rows->centroid_error[cell], place);
  }
}

/* Amounts by the solver's volumes. */
static void measure_cell(const rm_profile *w, const rm_packing *packing, rm_lid cell, double *place)
{
  for (int f = 0; f < packing->num_fields; f++) {
    double *at = place + packing->at[f];

    if (!rm_is_amount(packing, f)) continue;
    at[0] *= w->ground.measure[cell];
    for (int d = 0; d < 3 && packing->degree[f] > 0; d++) at[RM_PACK_SLOPE + d] *= w->ground.measure[cell];
    for (int k = 0; k < 7 && packing->degree[f] > 1; k++)
      at[rm_pack_curvature(packing->has_bounds) + k] *= w->ground.measure[cell];
  }
}

static bool is_asked(const rm_ground *ground, uint8_t cover)
{
  return ground->is_keeping ? cover == REMAP_PARTIAL : rm_is_mapped(cover);
}

/* What travels where nobody asks for slopes. */
static void put_no_slopes(const rm_packing *packing, double *place)
{
  for (int f = 0; f < packing->num_fields; f++)
    for (int k = RM_PACK_SLOPE; k < rm_pack_width(packing->degree[f], packing->has_bounds); k++)
      place[packing->at[f] + k] = 0.0;
}

void rm_reconstruct(const rm_profile *w, const rm_packing *packing, uint8_t which)
{
  const rm_rows *rows      = w->ground.rows;
  const int      num       = packing->num_fields;
  const bool     is_sloped = rm_profile_reads_halo(packing);

  for (rm_lid c = 0; c < w->ground.mesh->num_cells; c++) { /* cells first: their weights are read once for all fields */
    const double *given = w->given + (int64_t)c * num, *number = w->number + (int64_t)c * num;
    double       *place   = w->pack + (int64_t)c * packing->width;
    const bool    asked   = is_asked(&w->ground, rows->cover[c]);
    const bool    is_same = asked && rm_is_copied(rows, w->ground.differs, c, true);

    if (w->needs_halo[c] != which) continue;
    for (int f = 0; f < num; f++)
      place[packing->at[f]] = is_same || packing->system_of[f] < 0 ? given[f] : rm_system_amount(packing, f, given, number);
    if (is_sloped && asked) reconstruct_cell(w, packing, c, place);
    if (is_sloped && !asked) put_no_slopes(packing, place);
    if (asked && w->ground.measure && !is_same) measure_cell(w, packing, c, place);
  }
}
