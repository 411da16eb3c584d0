/* cross -- do two triangles of a surface meet elsewhere than in their common corners and edges? By exact signs alone. A
 * tree finds the pairs whose boxes meet. */
#include "surface_private.h"

#include <stdio.h>
#include <string.h>

enum { MOST_COUNTED = 1000, MOST_NAMED = 2 };

/* An axis across which the triangle covers area; there is one. */
static int seen_across(const double *const t[3])
{
  int axis = 0;

  while (axis < 2 && !rs_turn(t[0], t[1], t[2], axis)) axis++;
  return axis;
}

/* In one plane, seen across the axis: does p lie in the triangle, its boundary included? */
static bool holds(const double *const t[3], const double *p, int axis)
{
  const int turn = rs_turn(t[0], t[1], t[2], axis);

  for (int v = 0; v < 3; v++)
    if (rs_turn(t[v], t[(v + 1) % 3], p, axis) == -turn) return false;
  return true;
}

/* In one plane: do the edges cross, each having the ends of the other on different sides? Ends on edges are left to holds. */
static bool edges_cross(const double *p, const double *q, const double *r, const double *s, int axis)
{
  return rs_turn(p, q, r, axis) * rs_turn(p, q, s, axis) < 0 && rs_turn(r, s, p, axis) * rs_turn(r, s, q, axis) < 0;
}

/* In one plane: does the edge meet the triangle? An edge that lies across it and ends nowhere in it crosses two of its
 * sides, or goes through a corner and crosses a side. */
static bool meets_flat(const double *const t[3], const double *p, const double *q)
{
  const int axis = seen_across(t);

  if (holds(t, p, axis) || holds(t, q, axis)) return true;
  for (int v = 0; v < 3; v++)
    if (edges_cross(p, q, t[v], t[(v + 1) % 3], axis)) return true;
  return false;
}

/* Does the edge p q meet the triangle, boundaries included? */
static bool meets(const double *const t[3], const double *p, const double *q)
{
  const int a = rs_side(t[0], t[1], t[2], p), b = rs_side(t[0], t[1], t[2], q);
  int       sign = 0;

  if (a * b > 0) return false;
  if (!a && !b) return meets_flat(t, p, q);
  for (int v = 0; v < 3; v++) {
    const int side = rs_side(p, q, t[v], t[(v + 1) % 3]);

    if (side * sign < 0) return false;
    if (side) sign = side;
  }
  return true;
}

/* Do two triangles cross or overlap? x, y are nodes. */
static bool overlap(const double *xyz, const int64_t x[3], const int64_t y[3])
{
  const double *const a[3]   = {xyz + 3 * x[0], xyz + 3 * x[1], xyz + 3 * x[2]};
  const double *const b[3]   = {xyz + 3 * y[0], xyz + 3 * y[1], xyz + 3 * y[2]};
  int                 shared = 0, ia = 0, ib = 0, sum_a = 0, sum_b = 0;

  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++)
      if (x[i] == y[k]) {
        shared++;
        ia = i, ib = k;
        sum_a += i, sum_b += k;
      }
  if (shared == 3) return true;
  if (shared == 2) { /* they share an edge: folded onto each other? */
    const int     ta = 3 - sum_a, tb = 3 - sum_b, axis = seen_across(a);
    const double *p = a[(ta + 1) % 3], *q = a[(ta + 2) % 3];

    return !rs_side(p, q, a[ta], b[tb]) && rs_turn(p, q, a[ta], axis) == rs_turn(p, q, b[tb], axis);
  }
  if (shared == 1) return meets(b, a[(ia + 1) % 3], a[(ia + 2) % 3]) || meets(a, b[(ib + 1) % 3], b[(ib + 2) % 3]);
  for (int v = 0; v < 3; v++)
    if (meets(b, a[v], a[(v + 1) % 3]) || meets(a, b[v], b[(v + 1) % 3])) return true;
  return false;
}

/* Append the corners of a triangle. */
static void put_triangle(const rsurf_surface *s, const int64_t corner[3], char *text, size_t size)
{
  for (int v = 0; v < 3; v++) {
    const size_t used = strlen(text);

    rs_put_point(s->node_xyz + 3 * corner[v], text + used, size - used);
  }
}

/* What is found. */
typedef struct crossings {
  const rsurf_surface *surface;
  const double        *xyz;
  const rs_triangles  *triangles;
  int64_t              num;
  char                 text[700]; /* the first ones */
} crossings;

static bool try_pair(void *user, int64_t i, int64_t k)
{
  crossings          *found = user;
  const rs_triangles *t     = found->triangles;

  if (t->face[i] == t->face[k] || !overlap(found->xyz, t->corner[i], t->corner[k])) return true;
  if (found->num++ < MOST_NAMED) {
    strcat(found->text, " ");
    put_triangle(found->surface, t->corner[i], found->text, sizeof found->text - 8);
    strcat(found->text, " and ");
    put_triangle(found->surface, t->corner[k], found->text, sizeof found->text - 8);
  }
  return found->num < MOST_COUNTED;
}

rsurf_status rs_check_crossings(const rsurf_surface *surface, const double *xyz, const char *name, const rs_triangles *t,
                                const rs_tree *tree, rsurf_message *message)
{
  crossings found = {.surface = surface, .xyz = xyz, .triangles = t};

  rs_tree_pairs(tree, try_pair, &found);
  if (!found.num) return RSURF_OK;
  return rs_fail(message, RSURF_GEOMETRY, "%s: the surface crosses itself: %s%lld pairs of triangles, such as%s: repair it",
                 name, found.num >= MOST_COUNTED ? "at least " : "", (long long)found.num, found.text);
}
