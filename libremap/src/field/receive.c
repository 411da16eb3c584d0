/* receive -- what receiving cells make of what giving cells sent: the content of each is the sum over its row of u V + g.M +
 * h:S, and its coverage decides what becomes of that. O(pairs) per field. */
#include "field_private.h"

bool rm_keeps_old(const remap_transfer *how, const remap_field_desc *field, uint8_t cover)
{
  if (!field->has_old) return false;
  if (cover == REMAP_UNCOVERED) return how->on_uncovered == REMAP_UNCOVERED_KEEP;
  return cover == REMAP_PARTIAL && how->on_partial == REMAP_PARTIAL_BLEND && field->nature != REMAP_FLAG;
}

/* Cells without volume cannot be covered by anything: ERROR overlooks them, and they take the nearest value. */
bool rm_needs_nearest(const remap_transfer *how, const remap_field_desc *field)
{
  switch (how->on_uncovered) {
    case REMAP_UNCOVERED_KEEP: return !field->has_old;
    case REMAP_UNCOVERED_FILL: return false;
    case REMAP_UNCOVERED_NEAREST:
    case REMAP_UNCOVERED_ERROR: break;
  }
  return true;
}

/* A row, for one field. */
typedef struct row_sums {
  double content;   /* of u V + g.M + h:S */
  double volume;    /* of V         */
  double magnitude; /* of |V|       */
} row_sums;

/* What one giver sent for a field with slopes. */
typedef struct giver_view {
  double value;                    /* scaled, as all that follows          */
  double slope[3], curvature[7];   /* the latter only of degree 2; its constant is behind it */
} giver_view;

static void view(const rm_receipt *w, int f, rm_lid giver, giver_view *out)
{
  const rm_packing *p     = w->packing;
  const double     *place = w->got + (int64_t)giver * p->width;

  out->value = RM_VALUE_SCALE * place[p->at[f]];
  rm_pack_read(p, f, place, RM_PACK_SLOPE, 3, out->slope);
  if (p->degree[f] > 1) rm_pack_read(p, f, place, rm_pack_curvature(p->has_bounds), 7, out->curvature);
}

/* Its value alone. */
static double value_of(const rm_receipt *w, int f, rm_lid giver)
{
  return RM_VALUE_SCALE * w->got[(int64_t)giver * w->packing->width + w->packing->at[f]];
}

/* What all fields share. Volumes are summed in row order, with compensation. */
static row_sums measure_row(const rm_rows *rows, rm_lid cell)
{
  rm_compensated volume    = {0.0, 0.0};
  double         magnitude = 0.0;

  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++) {
    rm_compensated_add(&volume, rows->volume[k]);
    magnitude += fabs(rows->volume[k]);
  }
  return (row_sums){0.0, rm_compensated_value(&volume), magnitude};
}

/* Where the contents of a cell's row are, [num_fields]. */
static double *content_of(const rm_receipt *w, rm_lid cell)
{
  return w->content + (int64_t)(cell % RM_FEW_CELLS) * w->packing->num_fields;
}

static bool is_copied(const rm_receipt *w, int f, rm_lid cell)
{
  return rm_is_copied(w->setup->rows, w->setup->receiving_differs, cell, rm_is_amount(w->packing, f));
}

/* The solver's volume of a cell over that of the mesh, for amounts. */
static double measure_of(const rm_receipt *w, int f, rm_lid cell)
{
  return w->setup->receiving_measure && rm_is_amount(w->packing, f) ? w->setup->receiving_measure[cell] : 1.0;
}

/* row: as measured; contents of the cell's row have been summed. */
static row_sums sums_of(const rm_receipt *w, int f, rm_lid cell, const row_sums *row)
{
  return (row_sums){content_of(w, cell)[f], row->volume, row->magnitude};
}

/* True if a volume is what cancellation left of the parts it is made of: nothing may be divided by it. */
static bool is_void(double volume, const row_sums *s) { return !(fabs(volume) > 0x1p-40 * s->magnitude); }

/* The mean that exists for every row: by the magnitude of the overlaps, else the first giver's value. */
static double plain_mean(const rm_receipt *w, int f, rm_lid cell, const row_sums *s)
{
  const rm_rows *rows = w->setup->rows;
  double         sum  = 0.0;

  if (!(s->magnitude > 0.0)) return value_of(w, f, rows->giver[rows->offset[cell]]);
  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++)
    sum += value_of(w, f, rows->giver[k]) * (fabs(rows->volume[k]) / s->magnitude);
  return sum;
}

/* The mean of a giver's polynomial over a cell that may lie beyond the giver. */
static double mean_beyond(const rm_receipt *w, int f, const giver_view *g, const double giver_centroid[3], rm_lid cell)
{
  const double *x    = w->setup->receiving->cell_centroid[cell];
  const double  y[3] = {x[0] - giver_centroid[0], x[1] - giver_centroid[1], x[2] - giver_centroid[2]};
  const double  mean = g->value + (g->slope[0] * y[0] + g->slope[1] * y[1] + g->slope[2] * y[2]);

  if (w->packing->degree[f] < 2) return mean;
  return mean + (rm_form(g->curvature, y, y) + g->curvature[6] +
                 rm_dot6(g->curvature, w->setup->receiving_second[cell]) / w->setup->receiving->cell_volume[cell]);
}

/* The mean over the covered part, each giver's reconstruction taken to the whole cell. Not for rows without volume. */
static double mean_taken_beyond(const rm_receipt *w, int f, rm_lid cell, const row_sums *s)
{
  const rm_rows *rows = w->setup->rows;
  rm_compensated sum  = {0.0, 0.0};

  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++) {
    giver_view g;

    view(w, f, rows->giver[k], &g);
    rm_compensated_add(&sum, mean_beyond(w, f, &g, rows->giver_centroid[rows->giver[k]], cell) * rows->volume[k]);
  }
  return rm_compensated_value(&sum) / s->volume;
}

static bool is_void_row(const rm_receipt *w, rm_lid cell, const row_sums *s)
{
  return is_void(s->volume, s) || is_void(w->setup->receiving->cell_volume[cell], s);
}

/* The same under a limiter: within the bounds of the givers' neighbourhoods. */
static double normalised(const rm_receipt *w, int f, rm_lid cell, const row_sums *s)
{
  const rm_rows *rows  = w->setup->rows;
  double         least = INFINITY, greatest = -INFINITY, mean;

  if (is_void_row(w, cell, s)) return plain_mean(w, f, cell, s);
  if (w->packing->degree[f] == 0) return s->content / s->volume;
  mean = mean_taken_beyond(w, f, cell, s);
  if (!w->packing->has_bounds || w->packing->order[f] < 2) return mean;
  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++) {
    double bounds[2];

    rm_pack_read(w->packing, f, w->got + (int64_t)rows->giver[k] * w->packing->width, RM_PACK_BOUNDS, 2, bounds);
    least    = fmin(least, bounds[0]);
    greatest = fmax(greatest, bounds[1]);
  }
  return least <= greatest ? fmin(fmax(mean, least), greatest) : mean;
}

/* Is a cell covered in part, and nothing of its old content kept? */
static bool is_normalised(const rm_receipt *w, int f, rm_lid cell)
{
  const uint8_t cover = w->setup->rows->cover[cell];

  return cover == REMAP_PARTIAL && !rm_keeps_old(w->how, &w->fields[f], cover) && w->how->on_partial != REMAP_PARTIAL_CONSERVE;
}

/* Add the old content of a cell on what its pairs leave of it, scaled: as if it were uniform, and what slopes add. Moments of
 * what is left are those of the cell less those of the pairs. */
static void add_kept(const rm_receipt *w, int f, rm_lid cell, double old, const row_sums *s, double *content, double *change)
{
  const rm_rows *rows   = w->setup->rows;
  const rm_mesh *mesh   = w->setup->receiving;
  const double   volume = mesh->cell_volume[cell] - s->volume;
  rm_compensated sum    = {0.0, 0.0};
  const double  *place;
  double         g[3], h[7];

  *content += RM_VALUE_SCALE * old * volume;
  if (!w->keeping || w->packing->degree[f] == 0 || !rm_is_blended(w->setup, w->how, &w->fields[f])) return;
  place = rm_pack_of(w->keeping, w->packing, cell);
  rm_pack_read(w->packing, f, place, RM_PACK_SLOPE, 3, g);
  if (w->packing->degree[f] > 1) {
    rm_pack_read(w->packing, f, place, rm_pack_curvature(w->packing->has_bounds), 7, h);
    rm_compensated_add(&sum, rm_dot6(h, w->setup->receiving_second[cell]));
    rm_compensated_add(&sum, h[6] * volume);
  }
  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++) {
    double m[3], second[6];

    rm_moments_about(rows, k, rows->volume[k], rows->moment[k], mesh->cell_centroid[cell], m, second);
    rm_compensated_add(&sum, -(g[0] * m[0] + g[1] * m[1] + g[2] * m[2]));
    if (w->packing->degree[f] > 1) rm_compensated_add(&sum, -rm_dot6(h, second));
  }
  *change += rm_compensated_value(&sum);
}

/* The old content of a field outside of systems. */
static double kept_content(const rm_receipt *w, int f, rm_lid cell, double old, const row_sums *s)
{
  double content = 0.0, change = 0.0;

  add_kept(w, f, cell, old, s, &content, &change);
  return content + change;
}

static bool is_blend(const rm_receipt *w, int f, rm_lid cell)
{
  return rm_keeps_old(w->how, &w->fields[f], w->setup->rows->cover[cell]);
}

/* The scaled new value of a cell with pairs that is not normalised, from what it gets and what it keeps, 0 unless it blends;
 * its part in the integral goes to integral, if that is not NULL. */
static double receive_content(const rm_receipt *w, int f, rm_lid cell, double old, double kept, const row_sums *s,
                              rm_integral *integral)
{
  const double volume = w->setup->receiving->cell_volume[cell], measure = measure_of(w, f, cell);
  double       value;

  kept *= measure;
  value = (s->content + kept) / (volume * measure);
  if (is_void(volume, s)) {
    value = is_blend(w, f, cell) ? RM_VALUE_SCALE * old : plain_mean(w, f, cell, s) / measure;
    kept  = is_blend(w, f, cell) ? value * (volume - s->volume) * measure : 0.0;
  }
  if (integral) {
    rm_integral_add(&integral->minus_target, -value * measure, volume);
    rm_integral_add(&integral->minus_target, 1.0, kept);
  }
  return value;
}

/* A flag comes from the cell of largest overlap, the canonically first if some are equal. */
static double receive_flag(const rm_receipt *w, int f, rm_lid cell)
{
  const rm_rows *rows = w->setup->rows;
  int64_t        best = rows->offset[cell];

  for (int64_t k = best + 1; k < rows->offset[cell + 1]; k++)
    if (fabs(rows->volume[k]) > fabs(rows->volume[best])) best = k;
  return w->got[(int64_t)rows->giver[best] * w->packing->width + w->packing->at[f]];
}

static rm_integral *integral_of(const rm_receipt *w, int f) { return w->integral ? &w->integral[f] : NULL; }

/* The new value of a mapped cell outside of systems; old is the one it has. */
static double receive(const rm_receipt *w, int f, rm_lid cell, const row_sums *row, double old)
{
  const rm_rows *rows     = w->setup->rows;
  rm_integral   *integral = integral_of(w, f);
  row_sums       s;
  double         copied;

  if (w->fields[f].nature == REMAP_FLAG) return receive_flag(w, f, cell);
  if (!is_copied(w, f, cell)) {
    s = sums_of(w, f, cell, row);
    if (!is_normalised(w, f, cell)) {
      const double kept = is_blend(w, f, cell) ? kept_content(w, f, cell, old, &s) : 0.0;

      return receive_content(w, f, cell, old, kept, &s, integral) / RM_VALUE_SCALE;
    }
    if (integral) rm_integral_add(&integral->minus_target, -1.0, s.content); /* of its covered part: it has no other */
    return normalised(w, f, cell, &s) / measure_of(w, f, cell) / RM_VALUE_SCALE;
  }
  copied = w->got[(int64_t)rows->giver[rows->offset[cell]] * w->packing->width + w->packing->at[f]];
  if (integral)
    rm_integral_add(&integral->minus_target, -RM_VALUE_SCALE * copied * measure_of(w, f, cell),
                    w->setup->receiving->cell_volume[cell]);
  return copied;
}

/* Amounts of a system, normalised: taken to the whole cell as far as the state can be. value receives them. */
static void normalise_system(const rm_receipt *w, int system, rm_lid cell, const row_sums *row, double *value)
{
  const rm_packing *p      = w->packing;
  const rm_rows    *rows   = w->setup->rows;
  const int         num    = p->num_fields;
  const rm_limits   limits = {w->room, w->room + num};
  double           *mean = w->room + 2 * num, *change = w->room + 3 * num, factor = 0.0;

  rm_limits_clear(p, limits);
  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1] && p->has_bounds; k++)
    rm_limits_add(p, w->got + (int64_t)rows->giver[k] * p->width, limits);
  for (int f = 0; f < num; f++) {
    row_sums s;

    mean[f] = change[f] = 0.0;
    if (p->system_of[f] != system) continue;
    s       = sums_of(w, f, cell, row);
    mean[f] = is_void_row(w, cell, &s) ? plain_mean(w, f, cell, &s) : s.content / s.volume;
    if (p->degree[f] > 0 && !is_void_row(w, cell, &s)) change[f] = mean_taken_beyond(w, f, cell, &s) - mean[f];
    if (w->integral) rm_integral_add(&w->integral[f].minus_target, -1.0, s.content);
  }
  if (p->degree[p->system[system].density] > 0) factor = rm_admit_factor(p, system, mean, change, 1.0, limits, 0x1p-44);
  for (int f = 0; f < num; f++)
    if (p->system_of[f] == system) value[f] = (mean[f] + factor * change[f]) / measure_of(w, f, cell) / RM_VALUE_SCALE;
}

/* The old content of a system, its slopes scaled until it is a state that can be. kept receives it, scaled. */
static void keep_system(const rm_receipt *w, int system, rm_lid cell, const row_sums *row, const double *old, double *kept)
{
  const rm_packing *p      = w->packing;
  const int         num    = p->num_fields;
  const rm_limits   limits = {w->room, w->room + num};
  double           *change = w->room + 2 * num, volume = 0.0, factor = 0.0;

  for (int f = 0; f < num; f++) {
    row_sums s;

    kept[f] = change[f] = 0.0;
    if (p->system_of[f] != system) continue;
    s = sums_of(w, f, cell, row);
    add_kept(w, f, cell, old[f], &s, &kept[f], &change[f]);
    volume = w->setup->receiving->cell_volume[cell] - s.volume;
  }
  if (w->keeping) {
    rm_limits_clear(p, limits);
    rm_limits_add(p, rm_pack_of(w->keeping, p, cell), limits);
    factor = rm_admit_factor(p, system, kept, change, volume, limits, 0x1p-44);
  }
  for (int f = 0; f < num; f++) kept[f] += factor * change[f];
}

/* The new values of a system in a mapped cell: amounts, to be converted, but for copies. */
static void receive_system(const rm_receipt *w, int system, rm_lid cell, const row_sums *row, double *value)
{
  const rm_packing *p       = w->packing;
  const rm_rows    *rows    = w->setup->rows;
  const int         density = p->system[system].density;
  const bool        copies  = is_copied(w, density, cell);
  const double     *given   = w->got + (int64_t)rows->giver[rows->offset[cell]] * p->width;
  double           *kept    = w->room + 4 * p->num_fields;

  if (!copies && is_normalised(w, density, cell)) {
    normalise_system(w, system, cell, row, value);
    return;
  }
  for (int f = 0; f < p->num_fields; f++) kept[f] = 0.0;
  if (!copies && is_blend(w, density, cell)) keep_system(w, system, cell, row, value, kept);
  for (int f = 0; f < p->num_fields; f++) {
    row_sums s;

    if (p->system_of[f] != system) continue;
    if (copies) {
      value[f] = given[p->at[f]];
      continue;
    }
    s        = sums_of(w, f, cell, row);
    value[f] = receive_content(w, f, cell, value[f], kept[f], &s, integral_of(w, f)) / RM_VALUE_SCALE;
  }
}

/* Copied values count with their amounts. */
static void integrate_copies(const rm_receipt *w, rm_lid cell, const double *value)
{
  double *number = w->room;
  int     bad;

  if (!w->integral || !rm_system_numbers(w->packing, value, number, &bad)) return;
  for (int f = 0; f < w->packing->num_fields; f++)
    if (w->packing->system_of[f] >= 0)
      rm_integral_add(&w->integral[f].minus_target,
                      -RM_VALUE_SCALE * rm_system_amount(w->packing, f, value, number) * measure_of(w, f, cell),
                      w->setup->receiving->cell_volume[cell]);
}

void rm_find_plain(const rm_transfer_setup *setup, uint8_t *is_plain)
{
  const rm_rows *rows = setup->rows;

  for (rm_lid c = 0; c < rows->num_cells; c++) {
    is_plain[c] = 0;
    if (rows->cover[c] != REMAP_COVERED || rows->same[c]) continue;
    const row_sums row = measure_row(rows, c);
    is_plain[c]        = !is_void(setup->receiving->cell_volume[c], &row);
  }
}

/* The new values of a plain cell, but for systems. */
static void receive_plain(const rm_receipt *w, rm_lid cell, double *value)
{
  const rm_packing *p       = w->packing;
  const double     *content = content_of(w, cell), volume = w->setup->receiving->cell_volume[cell];

  for (int f = 0; f < p->num_fields; f++) {
    const double measure = measure_of(w, f, cell);

    if (p->system_of[f] >= 0) continue;
    if (w->fields[f].nature == REMAP_FLAG) {
      value[f] = receive_flag(w, f, cell);
      continue;
    }
    const double scaled = content[f] / (volume * measure);
    if (w->integral) rm_integral_add(&w->integral[f].minus_target, -scaled * measure, volume);
    value[f] = scaled / RM_VALUE_SCALE;
  }
}

/* The new values of an uncovered cell, but for those that it takes from the nearest. */
static void receive_nothing(const rm_receipt *w, double *value)
{
  for (int f = 0; f < w->packing->num_fields; f++)
    if (!rm_keeps_old(w->how, &w->fields[f], REMAP_UNCOVERED)) value[f] = w->how->fill_value;
}

/* The new values of a mapped cell whose row is summed. */
static void receive_all(const rm_receipt *w, rm_lid cell, double *value)
{
  const rm_packing *p   = w->packing;
  row_sums          row = {0.0, 0.0, 0.0};

  if (!w->is_plain[cell]) row = measure_row(w->setup->rows, cell); /* of plain ones it is known that they are not void */
  if (w->is_plain[cell])
    receive_plain(w, cell, value);
  else
    for (int f = 0; f < p->num_fields; f++)
      if (p->system_of[f] < 0) value[f] = receive(w, f, cell, &row, value[f]);
  for (int s = 0; s < p->num_systems; s++) receive_system(w, s, cell, &row, value);
  if (p->num_systems == 0) return;
  if (rm_is_copied(w->setup->rows, w->setup->receiving_differs, cell, true))
    integrate_copies(w, cell, value);
  else
    rm_system_restore(p, value);
}

void rm_receive(const rm_receipt *w)
{
  const rm_packing *p         = w->packing;
  const rm_rows    *rows      = w->setup->rows;
  const bool        is_simple = p->num_systems + p->num_flags == 0 && !w->setup->receiving_measure && !w->integral;

  for (rm_lid first = 0, end; first < rows->num_cells; first = end) { /* few cells at a time: what is summed stays at hand */
    end = rows->num_cells - first > RM_FEW_CELLS ? first + RM_FEW_CELLS : rows->num_cells;
    rm_sum_rows(p, rows, w->got, first, end, w->content);
    for (rm_lid c = first; c < end; c++) { /* all fields of a cell in turn */
      const double volume = w->setup->receiving->cell_volume[c], *content = content_of(w, c);
      double      *value = w->value + (int64_t)c * p->num_fields;

      if (is_simple && w->is_plain[c])
        for (int f = 0; f < p->num_fields; f++) value[f] = content[f] / volume / RM_VALUE_SCALE;
      else if (rows->cover[c] == REMAP_UNCOVERED)
        receive_nothing(w, value);
      else if (rows->cover[c] != REMAP_UNWANTED)
        receive_all(w, c, value);
    }
  }
}
