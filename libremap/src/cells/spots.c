/* spots -- coordinates and exact signs of vertices of the supermesh. A spot that is no vertex of a mesh is the meeting of a
 * line with a plane, both through points in doubles: rational coordinates, numerators of degree 4 over denominators of degree
 * 3. Doubles with their error bounds decide nearly always (10 ns); integers (exact.h) the rest (a few us). */
#include "cells/cells_private.h"

#include <math.h>
#include <string.h>
#include "geom/exact.h"
#include "geom/expansion.h"

bool rm_off_plane(const double a[3], const double b[3], const double c[3], double o[3])
{
  double n[3];
  int    axis[3] = {0, 1, 2};

  for (int k = 0; k < 3; k++) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    n[k] = fabs((b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]));
  }
  for (int k = 2; k > 0; k--)
    for (int h = 0; h < k; h++)
      if (n[axis[h]] < n[axis[h + 1]]) { const int s = axis[h]; axis[h] = axis[h + 1], axis[h + 1] = s; }
  for (int k = 0; k < 3; k++) {
    memcpy(o, a, 3 * sizeof *o);
    o[axis[k]] += 1;
    const int side = rm_orient3d(a, b, c, o);
    if (side < 0) o[axis[k]] = a[axis[k]] - 1;
    if (side) return true;
  }
  return false;
}

/* A plane through a vertex of the other mesh that lies on edge e. */
static void vertex_plane(const rm_trimesh *own, rm_lid e, const double vertex[3], double plane[3][3])
{
  const double *p0 = own->vertex[own->edge[e][0]], *p1 = own->vertex[own->edge[e][1]];
  int           k = 0;

  for (int c = 1; c < 3; c++)
    if (fabs(p1[c] - p0[c]) > fabs(p1[k] - p0[k])) k = c;
  for (int h = 0; h < 3; h++) memcpy(plane[h], vertex, sizeof plane[h]);
  plane[1][(k + 1) % 3] += 1;
  plane[2][(k + 2) % 3] += 1;
}

void rm_spot_plane(const rm_limit *l, const rm_spot *spot, int side, double plane[3][3])
{
  const rm_trimesh *own = l->mesh[side], *other = l->mesh[1 - side];
  const rm_feature  f   = spot->at[1 - side];
  const rm_lid     *e   = own->edge[spot->at[side].id];

  switch (f.kind) {
    case RM_ON_VERTEX: vertex_plane(own, spot->at[side].id, other->vertex[f.id], plane); break;
    case RM_ON_EDGE:
      for (int h = 0; h < 2; h++) memcpy(plane[h], other->vertex[other->edge[f.id][h]], sizeof plane[h]);
      if (!rm_off_plane(plane[0], plane[1], own->vertex[e[0]], plane[2]))
        rm_off_plane(plane[0], plane[1], own->vertex[e[1]], plane[2]);
      break;
    default:
      for (int h = 0; h < 3; h++) memcpy(plane[h], other->vertex[other->triangle[f.id][h]], sizeof plane[h]);
  }
}

/* Of two edges, the mesh whose edge begins at the lower point, or ends there: whichever mesh is called the first. */
static int lower_edge(const rm_limit *l, const rm_spot *spot)
{
  const rm_lid *e = l->mesh[0]->edge[spot->at[0].id], *f = l->mesh[1]->edge[spot->at[1].id];

  for (int h = 0; h < 2; h++)
    for (int c = 0; c < 3; c++) {
      const double x = l->mesh[0]->vertex[e[h]][c], y = l->mesh[1]->vertex[f[h]][c];
      if (x != y) return x < y ? 0 : 1;
    }
  return 0;
}

bool rm_spot_meeting(const rm_limit *l, const rm_spot *spot, double line[2][3], double plane[3][3])
{
  const bool edge[2] = {spot->at[0].kind == RM_ON_EDGE, spot->at[1].kind == RM_ON_EDGE};

  for (int side = 0; side < 2; side++)
    if (spot->at[side].kind == RM_ON_VERTEX) {
      memcpy(line[0], l->mesh[side]->vertex[spot->at[side].id], sizeof line[0]);
      return false;
    }
  const int         own = edge[0] && edge[1] ? lower_edge(l, spot) : edge[0] ? 0 : 1;
  const rm_trimesh *m   = l->mesh[own];

  for (int h = 0; h < 2; h++) memcpy(line[h], m->vertex[m->edge[spot->at[own].id][h]], sizeof line[h]);
  rm_spot_plane(l, spot, own, plane);
  return true;
}

/* ---- coordinates ------------------------------------------------------------------------------------------------- */

/* What rounding to lambda took from the parameter at which a line meets a plane. Some 150 ns. */
static double parameter_tail(double line[2][3], double plane[3][3], double lambda)
{
  rm_dd side[2][3], reach[3], u[3], normal[3];

  for (int c = 0; c < 3; c++) {
    for (int h = 0; h < 2; h++) side[h][c] = rm_two_diff(plane[h + 1][c], plane[0][c]);
    reach[c] = rm_two_diff(plane[0][c], line[0][c]);
    u[c]     = rm_two_diff(line[1][c], line[0][c]);
  }
  rm_dd_cross(side[0], side[1], normal);
  const rm_dd  den  = rm_dd_dot(normal, u);
  const double tail = rm_dd_sub(rm_dd_dot(normal, reach), rm_dd_mul((rm_dd){lambda, 0}, den)).hi / den.hi;
  return fabs(tail) < 0x1p-50 ? tail : 0; /* else it has no digits: the line is all but parallel */
}

/* The spot in two parts, low what rounding took from xyz; *error is a bound of the error of each coordinate. Where two edges
 * meet in a point of doubles, as those of boxes do, it is that point: zones that touch in a plane do so when joined. */
static void place(const rm_limit *l, const rm_spot *spot, double xyz[3], float low[3], float *error)
{
  double line[2][3], plane[3][3], tail = 0, size = 0, reach = 0;

  if (!rm_spot_meeting(l, spot, line, plane)) {
    memcpy(xyz, line[0], sizeof line[0]);
    low[0] = low[1] = low[2] = *error = 0;
    return;
  }
  const double lambda = rm_crossing_parameter(line[0], line[1], plane[0], plane[1], plane[2]);
  if (spot->at[0].kind == RM_ON_EDGE && spot->at[1].kind == RM_ON_EDGE) tail = parameter_tail(line, plane, lambda);
  for (int c = 0; c < 3; c++) {
    const rm_dd u = rm_two_diff(line[1][c], line[0][c]), way = rm_dd_mul((rm_dd){lambda, tail}, u);
    const rm_dd x = rm_dd_add((rm_dd){line[0][c], 0}, way);
    xyz[c] = x.hi;
    low[c] = (float)x.lo;
    size   = rm_max(size, fabs(u.hi));
    reach  = rm_max(reach, rm_max(fabs(line[0][c]), fabs(line[1][c])));
  }
  *error = (float)rm_max(0x1.1p-48 * size + 0x1.1p-52 * reach, 0x1p-120); /* no smaller as a float */
}

remap_status rm_spot_coordinates(const rm_limit_home *home, rm_limit *l)
{
  float *error, low[3];

  l->xyz = rm_arena_alloc_apart(home->spots, l->num_spots, sizeof *l->xyz);
  if (!l->xyz) return REMAP_NO_MEMORY;
  RM_NEW(error, home->rest, l->num_spots);
  for (rm_lid p = 0; p < l->num_spots; p++) place(l, &l->spot[p], l->xyz[p], low, &error[p]);
  l->error = error;
  return REMAP_OK;
}

remap_status rm_spot_low(rm_arena *arena, const rm_limit *l, float (**out)[3])
{
  double xyz[3];
  float  error;

  RM_NEW(*out, arena, l->num_spots);
  for (rm_lid p = 0; p < l->num_spots; p++) place(l, &l->spot[p], xyz, (*out)[p], &error);
  return REMAP_OK;
}

/* ---- integers ---------------------------------------------------------------------------------------------------- */

/* Coordinates num / den: num at scale degree + 1, den at scale degree. */
typedef struct rational {
  rm_int num[3], den;
} rational;

typedef struct meeting {
  double line[2][3], plane[3][3];
  bool   crosses;
} meeting;

static int scale_of(const rm_limit *l, int n, const rm_lid spot[], meeting out[])
{
  const double *point[15];
  int           num = 0;

  for (int k = 0; k < n; k++) {
    out[k].crosses = rm_spot_meeting(l, &l->spot[spot[k]], out[k].line, out[k].plane);
    point[num++]   = out[k].line[0];
    if (!out[k].crosses) continue;
    point[num++] = out[k].line[1];
    for (int h = 0; h < 3; h++) point[num++] = out[k].plane[h];
  }
  return rm_int_scale(num, point);
}

static void to_rational(const meeting *m, int scale, rational *r)
{
  rm_int u[3], a[3], b[3], d[3], n[3], num, x, y;

  if (!m->crosses) {
    for (int k = 0; k < 3; k++) rm_int_from_double(&r->num[k], m->line[0][k], scale);
    rm_int_from_double(&r->den, 1, 0);
    return;
  }
  for (int k = 0; k < 3; k++) {
    rm_int_from_difference(&u[k], m->line[1][k], m->line[0][k], scale);
    rm_int_from_difference(&a[k], m->plane[1][k], m->plane[0][k], scale);
    rm_int_from_difference(&b[k], m->plane[2][k], m->plane[0][k], scale);
    rm_int_from_difference(&d[k], m->plane[0][k], m->line[0][k], scale);
  }
  rm_int_cross(n, a, b);
  rm_int_dot(&num, n, d);
  rm_int_dot(&r->den, n, u);
  for (int k = 0; k < 3; k++) {
    rm_int p0;
    rm_int_from_double(&p0, m->line[0][k], scale);
    rm_int_mul(&x, &p0, &r->den);
    rm_int_mul(&y, &num, &u[k]);
    rm_int_add(&r->num[k], &x, &y);
  }
}

static __attribute__((noinline)) int exact_turn(const rm_view *v, const rm_lid spot[3])
{
  meeting   m[3];
  rational  r[3];
  rm_int    minor, term, sum = {0};
  const int scale = scale_of(v->l, 3, spot, m);
  int       sign = 1;

  for (int k = 0; k < 3; k++) {
    to_rational(&m[k], scale, &r[k]);
    sign *= rm_int_sign(&r[k].den);
  }
  for (int k = 0; k < 3; k++) {
    const rational *a = &r[(k + 1) % 3], *b = &r[(k + 2) % 3];
    rm_int_minor(&minor, &a->num[v->x], &b->num[v->y], &a->num[v->y], &b->num[v->x]);
    rm_int_mul(&term, &minor, &r[k].den);
    rm_int_add(&sum, &sum, &term);
  }
  return sign * rm_int_sign(&sum);
}

static __attribute__((noinline)) int exact_compare(const rm_limit *l, const rm_lid spot[2], int axis)
{
  meeting   m[2];
  rational  r[2];
  rm_int    diff;
  const int scale = scale_of(l, 2, spot, m);

  for (int k = 0; k < 2; k++) to_rational(&m[k], scale, &r[k]);
  rm_int_minor(&diff, &r[0].num[axis], &r[1].den, &r[1].num[axis], &r[0].den);
  return rm_int_sign(&diff) * rm_int_sign(&r[0].den) * rm_int_sign(&r[1].den);
}

/* ---- doubles first ----------------------------------------------------------------------------------------------- */

rm_view rm_view_of(const rm_limit *l, int side, rm_lid t)
{
  const rm_trimesh *m = l->mesh[side];
  const double     *a = m->vertex[m->triangle[t][0]], *b = m->vertex[m->triangle[t][1]], *c = m->vertex[m->triangle[t][2]];
  double            o[3];
  int               k = 0;

  const bool found = rm_off_plane(a, b, c, o);
  RM_ASSERT(found);
  (void)found;
  for (int h = 1; h < 3; h++)
    if (o[h] != a[h]) k = h;
  return (rm_view){l, (k + 1) % 3, (k + 2) % 3, o[k] > a[k] ? 1 : -1};
}

int rm_turn(const rm_view *v, rm_lid p, rm_lid q, rm_lid r)
{
  const double *a = v->l->xyz[p], *b = v->l->xyz[q], *c = v->l->xyz[r];
  const double  ux = b[v->x] - a[v->x], uy = b[v->y] - a[v->y], vx = c[v->x] - a[v->x], vy = c[v->y] - a[v->y];
  const double  left = ux * vy, right = uy * vx, det = left - right;
  const double  e = (double)v->l->error[p] + (double)v->l->error[q] + (double)v->l->error[r];
  const double  bound = 0x1p-50 * (fabs(left) + fabs(right)) + 2 * e * (fabs(ux) + fabs(uy) + fabs(vx) + fabs(vy) + e);

  if (det > bound) return v->flip;
  if (det < -bound) return -v->flip;
  if (bound == 0) return 0;
  return v->flip * exact_turn(v, (const rm_lid[3]){p, q, r});
}

int rm_compare(const rm_limit *l, rm_lid p, rm_lid q, int axis)
{
  const double diff = l->xyz[p][axis] - l->xyz[q][axis], bound = 2 * ((double)l->error[p] + (double)l->error[q]);

  if (p == q) return 0;
  if (diff > bound) return 1;
  if (diff < -bound) return -1;
  if (bound == 0) return 0;
  return exact_compare(l, (const rm_lid[2]){p, q}, axis);
}
