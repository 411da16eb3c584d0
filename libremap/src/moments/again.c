/* again -- the sums of pairs once more, in double-double: of cells so thin that rounding of 2^-53 would show (DESIGN 2.4).
 *
 * 1000 operations per cone. */
#include <string.h>
#include "moments/moments_private.h"

static void dd_difference(const double a[3], const double b[3], rm_dd out[3])
{
  for (int c = 0; c < 3; c++) out[c] = rm_two_diff(a[c], b[c]);
}

static rm_dd dd_quotient(rm_dd a, rm_dd b)
{
  const double q0 = a.hi / b.hi;
  const rm_dd  r  = rm_dd_sub(a, rm_dd_mul(b, (rm_dd){q0, 0}));
  const double q1 = (r.hi + r.lo) / b.hi;
  return rm_quick_two_sum(q0, q1);
}

/* lambda times the edge, the parameter computed again from the coordinates. */
static void dd_delta(const rm_overlay *o, const point *p, rm_dd out[3])
{
  const rm_trimesh *own = o->mesh[p->mesh], *other = o->mesh[1 - p->mesh];
  const rm_lid     *v = other->triangle[p->triangle];
  const double     *t0 = other->vertex[v[0]];
  rm_dd             a[3], b[3], n[3], u[3], down[3];

  dd_difference(other->vertex[v[1]], t0, a);
  dd_difference(other->vertex[v[2]], t0, b);
  rm_dd_cross(a, b, n);
  dd_difference(own->vertex[own->edge[p->edge][1]], p->base, u);
  dd_difference(t0, p->base, down);
  const rm_dd along  = rm_dd_dot(n, u);
  rm_dd       lambda = along.hi != 0 ? dd_quotient(rm_dd_dot(n, down), along) : (rm_dd){0, 0}; /* as lambda has it */
  if (lambda.hi < 0) lambda = (rm_dd){0, 0};
  if (lambda.hi > 1) lambda = (rm_dd){1, 0};
  for (int c = 0; c < 3; c++) out[c] = rm_dd_mul(lambda, u[c]);
}

/* The point relative to an origin. A crossing serves several cones in a row: the last ones are remembered. */
static void dd_relative(work *w, const point *p, const double origin[3], rm_dd out[3])
{
  dd_difference(p->base, origin, out);
  if (p->edge < 0) return;
  memo *m = &w->memo[((uint32_t)p->edge * 31u + (uint32_t)p->triangle) % NUM_MEMOS];
  if (m->edge != p->edge || m->triangle != p->triangle || m->mesh != p->mesh) {
    m->edge = p->edge, m->triangle = p->triangle, m->mesh = p->mesh;
    dd_delta(w->o, p, m->delta);
  }
  for (int c = 0; c < 3; c++) out[c] = rm_dd_add(out[c], m->delta[c]);
}

static void add_cone_dd(work *w, rm_lid j, double sign, const plane *pl, const point *p, const point *q)
{
  const slot *s = &w->slots[w->slot_of[j]];
  rm_dd      *sum = w->exact[w->slot_of[j]], r[3], a[3], b[3], cross[3];

  if (!(s->kinds & AGAIN)) return;
  dd_difference(pl->v, s->o, r);
  dd_relative(w, p, s->o, a);
  dd_relative(w, q, s->o, b);
  rm_dd_cross(a, b, cross);
  const rm_dd six_v = rm_dd_mul(rm_dd_dot(r, cross), (rm_dd){sign, 0});
  sum[0] = rm_dd_add(sum[0], six_v);
  for (int c = 0; c < 3; c++) sum[1 + c] = rm_dd_add(sum[1 + c], rm_dd_mul(six_v, rm_dd_add(r[c], rm_dd_add(a[c], b[c]))));
  for (int k = 0; k < w->num_sums - 4; k++) {
    const int   x = rm_row_of[k], y = rm_column_of[k];
    const rm_dd sx = rm_dd_add(r[x], rm_dd_add(a[x], b[x])), sy = rm_dd_add(r[y], rm_dd_add(a[y], b[y]));
    const rm_dd own = rm_dd_add(rm_dd_mul(r[x], r[y]), rm_dd_add(rm_dd_mul(a[x], a[y]), rm_dd_mul(b[x], b[y])));
    sum[4 + k] = rm_dd_add(sum[4 + k], rm_dd_mul(six_v, rm_dd_add(own, rm_dd_mul(sx, sy))));
  }
}

static void add_dd(work *w, const rm_lid j[2], double sign, const plane *pl, const plane *other, const point *p,
                   const point *q)
{
  for (int h = 0; h < 2; h++) {
    if (j[h] < 0) continue;
    add_cone_dd(w, j[h], h ? -sign : sign, pl, p, q);
    if (other) add_cone_dd(w, j[h], h ? sign : -sign, other, p, q);
  }
}

remap_status rm_moments_sum_again(work *w, rm_lid i)
{
  RM_TRY(rm_grow(&w->exact, &w->exact_room, w->num_slots, sizeof *w->exact));
  memset(w->exact, 0, sizeof *w->exact * (size_t)w->num_slots);
  rm_moments_all_sides(w, i, add_dd);
  for (int k = 0; k < w->num_slots; k++)
    if (w->slots[k].kinds & AGAIN)
      for (int c = 0; c < w->num_sums; c++) w->slots[k].sum[c] = w->exact[k][c].hi + w->exact[k][c].lo;
  return w->status;
}
