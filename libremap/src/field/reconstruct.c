/* reconstruct -- what giving cells send: their value and, at order 2, a slope about their centroid, at order 3 a quadratic
 * polynomial, limited if asked for.
 *
 * Coefficients are sums of the stencil's weights times differences to the neighbours, in canonical order. Barth-Jespersen: the
 * greatest factor in [0, 1] with which no node of the cell gets a value beyond those of the cell and its neighbours; a
 * quadratic polynomial that may leave these bounds anywhere in the cell gives way to the limited slope. Values are scaled by a
 * power of two, so nothing overflows and no digit changes. O(neighbours) per cell and field. */
#include "field_private.h"

/* The factor by which the slope may stay so that the nodes keep within [least, greatest]. */
static double barth_jespersen(const rm_stencil *stencil, const rm_mesh *mesh, rm_lid cell, double value, const double slope[3],
                              double least, double greatest)
{
  const double *c      = mesh->cell_centroid[cell];
  double        factor = 1.0;

  for (int64_t k = stencil->node_offset[cell]; k < stencil->node_offset[cell + 1]; k++) {
    const double *x    = mesh->node_xyz[stencil->node[k]];
    const double  rise = slope[0] * (x[0] - c[0]) + slope[1] * (x[1] - c[1]) + slope[2] * (x[2] - c[2]);

    if (rise > 0.0 && factor * rise > greatest - value) factor = (greatest - value) / rise;
    if (rise < 0.0 && factor * rise < least - value) factor = (least - value) / rise;
  }
  return factor;
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

void rm_fit_slope(const rm_stencil *stencil, rm_lid cell, const rm_around *u, double slope[3], double bounds[2])
{
  const double    value = rm_value_at(u, stencil->num_cells, cell);
  const rm_around near  = *u; /* this and the sums are copies: no write in the loop can change them */
  double          g[3] = {0.0, 0.0, 0.0}, least = value, greatest = value;

  for (int64_t k = stencil->offset[cell], end = stencil->offset[cell + 1]; k < end; k++) {
    const double other = rm_value_at(&near, stencil->num_cells, stencil->neighbour[k]), rise = other - value;

    for (int d = 0; d < 3; d++) g[d] += stencil->weight[k][d] * rise;
    least    = other < least ? other : least; /* not by fmin, which is a call; what is no number changes nothing either way */
    greatest = other > greatest ? other : greatest;
  }
  const bool is_good = isfinite(g[0]) && isfinite(g[1]) && isfinite(g[2]);
  for (int d = 0; d < 3; d++) slope[d] = is_good ? g[d] : 0.0;
  bounds[0] = least;
  bounds[1] = greatest;
}

bool rm_fit_quadratic(const rm_stencil *stencil, rm_lid cell, const rm_around *u, double slope[3], double curvature[7])
{
  const double value   = rm_value_at(u, stencil->num_cells, cell);
  double       fit[9]  = {0.0};
  bool         is_good = !stencil->is_reduced[cell];

  for (int k = 0; k < 7; k++) curvature[k] = 0.0;
  for (int64_t k = stencil->wide_offset[cell]; k < stencil->wide_offset[cell + 1] && is_good; k++) {
    const double rise = rm_value_at(u, stencil->num_cells, stencil->wide_neighbour[k]) - value;

    for (int i = 0; i < 9; i++) fit[i] += stencil->wide_weight[k][i] * rise;
  }
  for (int i = 0; i < 9; i++) is_good = is_good && isfinite(fit[i]);
  if (!is_good) return false;
  for (int i = 0; i < 3; i++) slope[i] = fit[i];
  for (int i = 0; i < 6; i++) curvature[i] = fit[3 + i];
  curvature[6] = -rm_dot6(curvature, stencil->spread[cell]);
  return true;
}

/* A smooth field may leave the neighbours' bounds, at extrema and towards walls: by as much as they lie apart, not past 0. */
static void widen_bounds(double bounds[2])
{
  const double range = bounds[1] - bounds[0];

  bounds[0] = bounds[0] >= 0.0 ? fmax(bounds[0] - range, 0.0) : bounds[0] - range;
  bounds[1] = bounds[1] <= 0.0 ? fmin(bounds[1] + range, 0.0) : bounds[1] + range;
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

static void fit_cell(const rm_profile *w, const rm_packing *packing, rm_lid cell, int f, bool is_smooth, fit *out)
{
  const rm_stencil *stencil    = w->ground.stencil;
  const rm_mesh    *mesh       = w->ground.mesh;
  const rm_around   u          = rm_around_of((rm_numbers){w->number, rm_flow_numbers(&w->halo)}, f, packing->num_fields);
  const double      value      = rm_value_at(&u, mesh->num_cells, cell);
  const double      extreme[2] = {w->extreme[f], w->extreme[packing->num_fields + f]};

  out->factor       = 1.0;
  out->is_quadratic = out->is_reduced = out->is_limited = false;
  rm_fit_slope(stencil, cell, &u, out->linear, out->bounds);
  for (int b = 0; b < 2; b++) out->local[b] = out->bounds[b];
  if (is_carried(packing, f) && (is_smooth || !packing->is_limited))
    widen_within(out->bounds, extreme);
  else if (is_smooth)
    widen_bounds(out->bounds);
  for (int d = 0; d < 3; d++) out->slope[d] = out->linear[d];
  if (packing->order[f] > 2) {
    out->is_quadratic = rm_fit_quadratic(stencil, cell, &u, out->slope, out->curvature);
    out->is_reduced   = !out->is_quadratic;
    if (out->is_quadratic && packing->is_limited &&
        !keeps_within(stencil, mesh, cell, value, out->slope, out->curvature, out->bounds[0], out->bounds[1])) {
      out->is_quadratic = false;
      out->is_limited   = true;
    }
  }
  if (!packing->is_limited) return;
  out->factor = barth_jespersen(stencil, mesh, cell, value, out->linear, out->bounds[0], out->bounds[1]);
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
static void reconstruct_fractions(const rm_profile *w, const rm_packing *packing, rm_lid cell, int s, double *place)
{
  const int num       = packing->num_fields;
  bool      is_smooth = true, is_quadratic = true;
  double    factor = 1.0;
  fit       x;

  for (int f = 0; f < num; f++)
    if (is_fraction(packing, f) && packing->system_of[f] == s) is_smooth = is_smooth && is_smooth_cell(w, packing, cell, f);
  for (int f = 0; f < num; f++) {
    if (!is_fraction(packing, f) || packing->system_of[f] != s) continue;
    fit_cell(w, packing, cell, f, is_smooth, &x);
    is_quadratic = is_quadratic && x.is_quadratic;
    factor       = fmin(factor, x.factor);
  }
  for (int f = 0; f < num; f++) {
    if (!is_fraction(packing, f) || packing->system_of[f] != s) continue;
    fit_cell(w, packing, cell, f, is_smooth, &x);
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

/* Polynomials of all fields in one cell, as they are reconstructed. */
static void reconstruct_cell(const rm_profile *w, const rm_packing *packing, rm_lid cell, double *place)
{
  const int num = packing->num_fields;

  for (int f = 0; f < num; f++) {
    fit x;

    if (packing->order[f] < 2 || is_fraction(packing, f)) continue;
    fit_cell(w, packing, cell, f, is_smooth_cell(w, packing, cell, f), &x);
    put_fit(packing, f, &x, x.is_quadratic, x.factor, place + packing->at[f]);
    w->limited[f] += x.is_limited;
    w->limited[num + f] += x.is_reduced;
    if (packing->system_of[f] < 0) move_to_rounded_centroid(w->ground.rows->centroid_error[cell], place + packing->at[f]);
  }
  for (int s = 0; s < packing->num_systems; s++) {
    const int at = packing->system[s].density;

    if (packing->order[at] < 2) continue;
    reconstruct_fractions(w, packing, cell, s, place);
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

void rm_reconstruct(const rm_profile *w, const rm_packing *packing, uint8_t which)
{
  const rm_rows *rows = w->ground.rows;
  const int      num  = packing->num_fields;

  for (rm_lid c = 0; c < w->ground.mesh->num_cells; c++) { /* cells first: their weights are read once for all fields */
    const double *given = w->given + (int64_t)c * num, *number = w->number + (int64_t)c * num;
    double       *place = w->pack + (int64_t)c * packing->width;
    const bool    asked = is_asked(&w->ground, rows->cover[c]);
    const bool    is_same = asked && rm_is_copied(rows, w->ground.differs, c, true);

    if (w->needs_halo[c] != which) continue;
    for (int f = 0; f < num; f++) {
      place[packing->at[f]] = is_same || packing->system_of[f] < 0 ? given[f] : rm_system_amount(packing, f, given, number);
      for (int k = RM_PACK_SLOPE; k < rm_pack_width(packing->degree[f], packing->has_bounds) && !asked; k++)
        place[packing->at[f] + k] = 0.0; /* nobody asks for it */
    }
    if (asked) reconstruct_cell(w, packing, c, place);
    if (asked && w->ground.measure && !is_same) measure_cell(w, packing, c, place);
  }
}
