/* rows -- what receiving cells get from their pairs: sums over a row of u V + g.M + h:S, for all fields of a transfer.
 *
 * The row is read once for every few fields next to each other (a span), whose sums stay in registers; the products of a pair
 * are added up side by side, value, slope and curvature, which the compiler turns into vectors, the same for any number of
 * fields. Pairs are added in row order, so the sums are those of any partition: plainly within runs of 32 pairs, where rounding
 * takes little, runs with compensation, so that rows of any length keep all digits. O(pairs) per field. */
#include "field_private.h"

enum { RUN = 32, MOST = RM_SPAN_FIELDS };

/* Pairs next to each other in a row. */
typedef struct run {
  const rm_rows *rows;
  const double  *got; /* of the span's first field in giver 0 */
  int64_t        width, first, end;
} run;

/* The sums over a run, of num fields without slopes, whose values are side by side. */
static inline void add_values(const run *r, int num, double *content)
{
  const rm_lid *giver     = r->rows->giver;
  const double *volume    = r->rows->volume;
  double        sum[MOST] = {0.0};

  for (int64_t k = r->first; k < r->end; k++) {
    const double *u = r->got + giver[k] * r->width, scaled = RM_VALUE_SCALE * volume[k];

    for (int f = 0; f < num; f++) sum[f] += u[f] * scaled;
  }
  for (int f = 0; f < num; f++) content[f] = sum[f];
}

/* Likewise of fields with slopes, `stride` apart. */
static inline void add_slopes(const run *r, int num, int64_t stride, double *content)
{
  const rm_lid *giver      = r->rows->giver;
  const double *volume     = r->rows->volume;
  const double(*moment)[3] = r->rows->moment;
  double sum[MOST][4]      = {{0.0}};

  for (int64_t k = r->first; k < r->end; k++) {
    const double *place = r->got + giver[k] * r->width;
    const double  by[4] = {RM_VALUE_SCALE * volume[k], moment[k][0], moment[k][1], moment[k][2]};

    for (int f = 0; f < num; f++)
      for (int i = 0; i < 4; i++) sum[f][i] += place[f * stride + i] * by[i];
  }
  for (int f = 0; f < num; f++) content[f] = sum[f][0] + (sum[f][1] + (sum[f][2] + sum[f][3]));
}

/* Likewise of fields with curvature, which stands `beyond` the value. */
static inline void add_curvatures(const run *r, int num, int64_t stride, int beyond, double *content)
{
  const rm_rows *rows         = r->rows;
  double         sum[MOST][4] = {{0.0}}, form[MOST][4] = {{0.0}};

  for (int64_t k = r->first; k < r->end; k++) {
    const double *place = r->got + rows->giver[k] * r->width, *m = rows->moment[k], *s = rows->second[k];
    const double  volume = rows->volume[k], by[4] = {RM_VALUE_SCALE * volume, m[0], m[1], m[2]};

    for (int f = 0; f < num; f++) {
      const double *u = place + f * stride, *h = u + beyond;

      for (int i = 0; i < 4; i++) sum[f][i] += u[i] * by[i];
      for (int i = 0; i < 2; i++) form[f][i] += h[i] * s[i] + h[i + 2] * s[i + 2];
      for (int i = 0; i < 2; i++) form[f][i + 2] += h[i + 4] * s[i + 4];
      form[f][2] += h[6] * volume;
    }
  }
  for (int f = 0; f < num; f++)
    content[f] = sum[f][0] + ((sum[f][1] + (sum[f][2] + sum[f][3])) + ((form[f][0] + form[f][1]) + (form[f][2] + form[f][3])));
}

/* Any of these; num is a constant where this is called, so that each case gets loops of its own. */
static inline void add_run(const run *r, int degree, int num, int64_t stride, int beyond, double *content)
{
  if (degree == 0)
    add_values(r, num, content);
  else if (degree == 1)
    add_slopes(r, num, stride, content);
  else
    add_curvatures(r, num, stride, beyond, content);
}

static void sum_run(const run *r, const rm_packing *p, const rm_span *span, double *content)
{
  const int degree = span->degree, beyond = rm_pack_curvature(p->has_bounds), stride = rm_pack_width(degree, p->has_bounds);

  switch (span->num) {
    case 1: add_run(r, degree, 1, stride, beyond, content); break;
    case 2: add_run(r, degree, 2, stride, beyond, content); break;
    case 3: add_run(r, degree, 3, stride, beyond, content); break;
    default: add_run(r, degree, MOST, stride, beyond, content);
  }
}

void rm_sum_row(const rm_packing *p, const rm_rows *rows, const double *got, rm_lid cell, double *content)
{
  const int64_t first = rows->offset[cell], end = rows->offset[cell + 1];

  for (int i = 0; i < p->num_spans; i++) {
    const rm_span *span        = &p->span[i];
    run            r           = {rows, got + p->at[span->first], p->width, first, end};
    rm_compensated total[MOST] = {{0.0, 0.0}};
    double         part[MOST];

    if (end - first <= RUN) {
      sum_run(&r, p, span, content + span->first);
      continue;
    }
    for (; r.first < end; r.first = r.end) {
      r.end = end - r.first > RUN ? r.first + RUN : end;
      sum_run(&r, p, span, part);
      for (int f = 0; f < span->num; f++) rm_compensated_add(&total[f], part[f]);
    }
    for (int f = 0; f < span->num; f++) content[span->first + f] = rm_compensated_value(&total[f]);
  }
}
