/* rows -- what receiving cells get from their pairs: sums over a row of u V + g.M + h:S, for all fields of a transfer.
 *
 * A row is read once for every few fields next to each other (a span), whose sums stay in registers; the products of a pair
 * are added up side by side, value, slope and curvature, the same for any number of fields. Pairs are added in row order, so
 * the sums are those of any partition: plainly within runs of 32 pairs, where rounding takes little, runs with compensation, so
 * that rows of any length keep all digits. O(pairs) per field. */
#include "field_private.h"
#include "lanes.h"

enum { RUN = 32, MOST = RM_SPAN_FIELDS, AHEAD = 64, LINE = 8 };

/* Pairs next to each other in a row. */
typedef struct run {
  const rm_rows *rows;
  const double  *got;                     /* of the span's first field in giver 0 */
  int64_t        width, first, end, last; /* last: pair of all rows */
} run;

/* Fetch `num` numbers of the giver so many pairs ahead, since where they stand no processor can guess. */
RM_UNROLLED void fetch_ahead(const run *r, int64_t k, int64_t num)
{
  const double *place = r->got + r->rows->giver[k + AHEAD < r->last ? k + AHEAD : r->last] * r->width;

  for (int64_t i = 0; i < num; i += LINE) __builtin_prefetch(place + i);
  __builtin_prefetch(place + num - 1);
}

/* The sums over a run, of num fields without slopes, whose values are side by side. */
RM_UNROLLED void add_values(const run *r, int num, double *content)
{
  const rm_lid *giver  = r->rows->giver;
  const double *volume = r->rows->volume;
  const int     twos   = (num + 1) / 2;
  rm_lanes      sum[MOST / 2];

  for (int t = 0; t < twos; t++) sum[t] = rm_lanes_of(0.0);
  for (int64_t k = r->first; k < r->end; k++) {
    const double  *u  = r->got + giver[k] * r->width;
    const rm_lanes by = rm_lanes_of(RM_VALUE_SCALE * volume[k]);

    for (int t = 0; t < twos; t++) sum[t] += rm_lanes_at(u + 2 * t) * by;
  }
  for (int t = 0; t < twos; t++) rm_lanes_put(sum[t], num - 2 * t, content + 2 * t);
}

/* Likewise of one field with slopes, which stand beside the value. */
RM_UNROLLED void add_slope(const run *r, double *content)
{
  const rm_rows *rows = r->rows;
  rm_lanes       low = rm_lanes_of(0.0), high = low;

  for (int64_t k = r->first; k < r->end; k++) {
    const double  *place = r->got + rows->giver[k] * r->width, *m = rows->moment[k];
    const rm_lanes by_low = {RM_VALUE_SCALE * rows->volume[k], m[0]};

    low += rm_lanes_at(place) * by_low;
    high += rm_lanes_at(place + 2) * rm_lanes_at(m + 1);
  }
  content[0] = low[0] + (low[1] + (high[0] + high[1]));
}

/* Likewise of num fields: rows of values and slopes are side by side. */
RM_UNROLLED void add_slopes(const run *r, int num, double *content)
{
  const rm_rows *rows = r->rows;
  const int      twos = (num + 1) / 2;
  rm_lanes       sum[4][MOST / 2];

  for (int i = 0; i < 4; i++)
    for (int t = 0; t < twos; t++) sum[i][t] = rm_lanes_of(0.0);
  for (int64_t k = r->first; k < r->end; k++) {
    const double  *place = r->got + rows->giver[k] * r->width, *m = rows->moment[k];
    const rm_lanes by[4] = {rm_lanes_of(RM_VALUE_SCALE * rows->volume[k]), rm_lanes_of(m[0]), rm_lanes_of(m[1]),
                            rm_lanes_of(m[2])};

    fetch_ahead(r, k, num * 4);
    for (int i = 0; i < 4; i++)
      for (int t = 0; t < twos; t++) sum[i][t] += rm_lanes_at(place + i * num + 2 * t) * by[i];
  }
  for (int t = 0; t < twos; t++)
    rm_lanes_put(sum[0][t] + (sum[1][t] + (sum[2][t] + sum[3][t])), num - 2 * t, content + 2 * t);
}

/* Likewise of one field with curvature, which stands `beyond` the value. */
RM_UNROLLED void add_curvature(const run *r, int beyond, double *content)
{
  const rm_rows *rows = r->rows;
  rm_lanes       low = rm_lanes_of(0.0), high = low, form = low;

  for (int64_t k = r->first; k < r->end; k++) {
    const double  *u = r->got + rows->giver[k] * r->width, *h = u + beyond, *m = rows->moment[k], *s = rows->second[k];
    const rm_lanes by_low = {RM_VALUE_SCALE * rows->volume[k], m[0]}, constant = {h[6] * rows->volume[k], 0.0};

    fetch_ahead(r, k, beyond + 7);
    low += rm_lanes_at(u) * by_low;
    high += rm_lanes_at(u + 2) * rm_lanes_at(m + 1);
    form += ((rm_lanes_at(h) * rm_lanes_at(s) + rm_lanes_at(h + 2) * rm_lanes_at(s + 2)) +
             rm_lanes_at(h + 4) * rm_lanes_at(s + 4)) +
            constant;
  }
  content[0] = low[0] + ((low[1] + (high[0] + high[1])) + (form[0] + form[1]));
}

/* Likewise of num fields, two after two; even and odd coefficients of the form are summed apart. */
RM_UNROLLED void add_curvatures(const run *r, int num, int beyond, double *content)
{
  const rm_rows *rows = r->rows;

  for (int t = 0; t < (num + 1) / 2; t++) {
    rm_lanes sum[4], even = rm_lanes_of(0.0), odd = even;

    for (int i = 0; i < 4; i++) sum[i] = rm_lanes_of(0.0);
    for (int64_t k = r->first; k < r->end; k++) {
      const double  *u = r->got + rows->giver[k] * r->width + 2 * t, *h = u + beyond * num;
      const double  *m = rows->moment[k], *s = rows->second[k];
      const rm_lanes volume = rm_lanes_of(rows->volume[k]);

      if (t == 0) fetch_ahead(r, k, (beyond + 7) * num);
      sum[0] += rm_lanes_at(u) * (volume * rm_lanes_of(RM_VALUE_SCALE));
      for (int i = 0; i < 3; i++) sum[i + 1] += rm_lanes_at(u + (i + 1) * num) * rm_lanes_of(m[i]);
      even += ((rm_lanes_at(h) * rm_lanes_of(s[0]) + rm_lanes_at(h + 2 * num) * rm_lanes_of(s[2])) +
               rm_lanes_at(h + 4 * num) * rm_lanes_of(s[4])) +
              rm_lanes_at(h + 6 * num) * volume;
      odd += (rm_lanes_at(h + num) * rm_lanes_of(s[1]) + rm_lanes_at(h + 3 * num) * rm_lanes_of(s[3])) +
             rm_lanes_at(h + 5 * num) * rm_lanes_of(s[5]);
    }
    rm_lanes_put(sum[0] + ((sum[1] + (sum[2] + sum[3])) + (even + odd)), num - 2 * t, content + 2 * t);
  }
}

/* Any of these; num is a constant where this is called, so that each case gets loops of its own. */
RM_UNROLLED void add_run(const run *r, int degree, int num, int beyond, double *content)
{
  if (degree == 0)
    add_values(r, num, content);
  else if (degree == 1 && num == 1)
    add_slope(r, content);
  else if (degree == 1)
    add_slopes(r, num, content);
  else if (num == 1)
    add_curvature(r, beyond, content);
  else
    add_curvatures(r, num, beyond, content);
}

/* Runs of a long row, with compensation between them. */
RM_UNROLLED void add_runs(const run *row, int degree, int num, int beyond, double *content)
{
  rm_compensated total[MOST] = {{0.0, 0.0}};

  for (int64_t first = row->first; first < row->end; first += RUN) {
    const run r = {row->rows, row->got, row->width, first, row->end - first > RUN ? first + RUN : row->end, row->last};
    double    part[MOST];

    add_run(&r, degree, num, beyond, part);
    for (int f = 0; f < num; f++) rm_compensated_add(&total[f], part[f]);
  }
  for (int f = 0; f < num; f++) content[f] = rm_compensated_value(&total[f]);
}

/* The fields of a span in some cells. */
typedef struct patch {
  const rm_packing *packing;
  const rm_span    *span;
  const rm_rows    *rows;
  const double     *got;
  rm_lid            first, end;
} patch;

RM_UNROLLED void sum_patch(const patch *w, int degree, int num, double *content)
{
  const rm_packing *p      = w->packing;
  const int64_t    *offset = w->rows->offset;
  const int         beyond = rm_pack_curvature(p->has_bounds);

  for (rm_lid c = w->first; c < w->end; c++, content += p->num_fields) {
    const run row = {w->rows, w->got, p->width, offset[c], offset[c + 1], offset[w->rows->num_cells] - 1};

    if (row.end - row.first <= RUN)
      add_run(&row, degree, num, beyond, content);
    else
      add_runs(&row, degree, num, beyond, content);
  }
}

static void sum_values(const patch *w, double *content)
{
  switch (w->span->num) {
    case 1: sum_patch(w, 0, 1, content); break;
    case 2: sum_patch(w, 0, 2, content); break;
    case 3: sum_patch(w, 0, 3, content); break;
    default: sum_patch(w, 0, MOST, content);
  }
}

static void sum_slopes(const patch *w, double *content)
{
  switch (w->span->num) {
    case 1: sum_patch(w, 1, 1, content); break;
    case 2: sum_patch(w, 1, 2, content); break;
    case 3: sum_patch(w, 1, 3, content); break;
    default: sum_patch(w, 1, MOST, content);
  }
}

static void sum_curvatures(const patch *w, double *content)
{
  switch (w->span->num) {
    case 1: sum_patch(w, 2, 1, content); break;
    case 2: sum_patch(w, 2, 2, content); break;
    case 3: sum_patch(w, 2, 3, content); break;
    default: sum_patch(w, 2, MOST, content);
  }
}

void rm_sum_rows(const rm_packing *p, const rm_rows *rows, const double *got, rm_lid first, rm_lid end, double *content)
{
  for (int i = 0; i < p->num_spans; i++) {
    const rm_span *span = &p->span[i];
    const patch    w    = {p, span, rows, got + p->at[span->first], first, end};

    switch (span->degree) {
      case 0: sum_values(&w, content + span->first); break;
      case 1: sum_slopes(&w, content + span->first); break;
      default: sum_curvatures(&w, content + span->first);
    }
  }
}
