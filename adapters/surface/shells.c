/* shells -- shells into bodies: no two faces cross, every shell has a volume, and a shell in an odd number of others is a
 * void of the body around it. O(n log n): one ray for each shell through a tree of all triangles. */
#include "surface_private.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* All shells and what is found out about them. */
typedef struct shells {
  const rsurf_surface *surface;
  const double        *xyz;
  const rs_triangles  *triangles;
  const int64_t       *of_face; /* [faces] shell */
  int64_t              num;
  int64_t             *first; /* [num + 1] triangles of a shell stand together in `corner` */
  int64_t (*corner)[3];       /* [triangles] sorted by shell */
  int64_t *depth, *parent;    /* [num] shells around it; the innermost of them, -1 */
  ra_array around;            /* int64_t: shells around each, one list after the other */
  int64_t *around_at;         /* [num + 1] */
} shells;

static bool sort_triangles(shells *s)
{
  const rs_triangles *t = s->triangles;

  s->first     = ra_zeros(s->num + 1, sizeof *s->first);
  s->corner    = ra_zeros(t->num, sizeof *s->corner);
  s->depth     = ra_zeros(s->num, sizeof *s->depth);
  s->parent    = ra_zeros(s->num, sizeof *s->parent);
  s->around_at = ra_zeros(s->num + 1, sizeof *s->around_at);
  if (!s->first || !s->corner || !s->depth || !s->parent || !s->around_at) return false;
  for (int64_t i = 0; i < t->num; i++) s->first[s->of_face[t->face[i]] + 1]++;
  for (int64_t k = 0; k < s->num; k++) s->first[k + 1] += s->first[k];
  for (int64_t i = 0; i < t->num; i++) memcpy(s->corner[s->first[s->of_face[t->face[i]]]++], t->corner[i], sizeof *s->corner);
  for (int64_t k = s->num; k > 0; k--) s->first[k] = s->first[k - 1];
  s->first[0] = 0;
  return true;
}

/* On which side of the line a, b in the plane of y and z does p lie, were it moved by (e, e^2) there? 0 only if the line is a
 * point. */
static int turn_moved(const double *a, const double *b, const double *p)
{
  const int sign = rs_turn(a, b, p, 0);

  if (sign) return sign;
  if (a[2] != b[2]) return a[2] > b[2] ? 1 : -1; /* d/dy of (b - a) x (p - a) is -(b - a)_z */
  return (b[1] > a[1]) - (b[1] < a[1]);
}

/* Does a ray from p along x, moved so little that it meets no edge, go through the triangle? */
static bool is_hit(const double *a, const double *b, const double *c, const double *p)
{
  const int one = turn_moved(a, b, p), two = turn_moved(b, c, p), three = turn_moved(c, a, p);

  if (!one || one != two || one != three) return false;
  return rs_side(a, b, c, p) * one > 0; /* seen from +x, a b c turn left: below their plane is -x */
}

static int by_number(const void *a, const void *b)
{
  const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;

  return (x > y) - (x < y);
}

/* A corner of shell k that no other shell has: whether it lies in another is then no question of touching. */
static const double *own_corner(const shells *s, const int64_t *shell_of_node, int64_t k)
{
  for (int64_t i = s->first[k]; i < s->first[k + 1]; i++)
    for (int v = 0; v < 3; v++)
      if (shell_of_node[s->corner[i][v]] >= 0) return s->xyz + 3 * s->corner[i][v];
  return NULL;
}

/* The shells around shell k, in the list of all: those that a ray from it leaves an odd number of times. */
static bool shells_around(shells *s, const rs_tree *tree, const double *p, int64_t k, ra_array *hits)
{
  const double box[6] = {p[0], p[1], p[2], INFINITY, p[1], p[2]};
  int64_t     *found, num = 0;
  bool         ok = rs_tree_find(tree, box, hits);

  found = hits->item;
  for (int64_t i = 0; i < hits->count && ok; i++) {
    const int64_t  t = found[i], other = s->of_face[s->triangles->face[t]];
    const int64_t *c = s->triangles->corner[t];

    if (other != k && is_hit(s->xyz + 3 * c[0], s->xyz + 3 * c[1], s->xyz + 3 * c[2], p)) found[num++] = other;
  }
  if (num) qsort(found, (size_t)num, sizeof *found, by_number);
  for (int64_t i = 0, end; i < num && ok; i = end) {
    for (end = i + 1; end < num && found[end] == found[i]; end++) continue;
    if ((end - i) % 2) ok = ra_push(&s->around, &found[i], sizeof *found);
  }
  s->around_at[k + 1] = s->around.count;
  s->depth[k]         = s->around.count - s->around_at[k];
  return ok;
}

/* depth and around of every shell. */
static rsurf_status nest(shells *s, const rs_tree *tree, const char *name, rsurf_message *message)
{
  int64_t     *shell_of_node = ra_zeros(s->surface->num_nodes, sizeof *shell_of_node); /* -2: several, -1: none yet */
  ra_array     hits          = {.item = NULL};
  rsurf_status status        = shell_of_node ? RSURF_OK : rs_no_memory(message);

  for (int64_t i = 0; i < s->surface->num_nodes && status == RSURF_OK; i++) shell_of_node[i] = -1;
  for (int64_t k = 0; k < s->num && status == RSURF_OK; k++)
    for (int64_t i = 3 * s->first[k]; i < 3 * s->first[k + 1]; i++) {
      int64_t *of = &shell_of_node[s->corner[i / 3][i % 3]];

      *of = *of == -1 || *of == k ? k : -2;
    }
  for (int64_t k = 0; k < s->num && status == RSURF_OK; k++) {
    const double *p = own_corner(s, shell_of_node, k);

    if (!p)
      status = rs_fail(message, RSURF_GEOMETRY, "%s: shell %lld of %lld touches others in all its corners: separate them", name,
                       (long long)k + 1, (long long)s->num);
    else if (!shells_around(s, tree, p, k, &hits))
      status = rs_no_memory(message);
  }
  for (int64_t k = 0; k < s->num && status == RSURF_OK; k++) {
    s->parent[k] = -1;
    for (int64_t i = s->around_at[k]; i < s->around_at[k + 1]; i++) {
      const int64_t other = ((const int64_t *)s->around.item)[i];

      if (s->depth[other] == s->depth[k] - 1) s->parent[k] = other;
    }
  }
  free(shell_of_node);
  free(hits.item);
  return status;
}

/* Which shells are to be turned: outward at even depth, inward at odd. */
static rsurf_status orient(const shells *s, const char *name, int8_t *turn, rsurf_message *message)
{
  for (int64_t k = 0; k < s->num; k++) {
    const int sign = rs_volume_sign(s->xyz, (const int64_t(*)[3])(s->corner + s->first[k]), s->first[k + 1] - s->first[k]);

    if (!sign) {
      char place[300];

      rs_put_point(s->surface->node_xyz + 3 * s->corner[s->first[k]][0], place, sizeof place);
      return rs_fail(message, RSURF_GEOMETRY, "%s: the shell of %lld triangles at %s has no volume: remove it", name,
                     (long long)(s->first[k + 1] - s->first[k]), place);
    }
    turn[k] = (sign < 0) ^ (s->depth[k] % 2 == 1);
  }
  return RSURF_OK;
}

/* Bodies are numbered by their outer shells; a void belongs to the body of the shell around it. */
static rsurf_status number_bodies(const shells *s, rsurf_surface *surface, const int8_t *turn, int8_t *turned,
                                  rsurf_repairs *repairs, rsurf_message *message)
{
  int64_t *body = ra_zeros(s->num, sizeof *body);

  surface->face_body = ra_zeros(surface->num_faces, sizeof *surface->face_body);
  surface->face_none = ra_zeros(surface->num_faces, sizeof *surface->face_none);
  if (!body || !surface->face_body || !surface->face_none) {
    free(body);
    return rs_no_memory(message);
  }
  for (int64_t k = 0; k < s->num; k++) body[k] = s->depth[k] % 2 ? -1 : surface->num_bodies++;
  for (int64_t f = 0; f < surface->num_faces; f++) {
    const int64_t k = s->of_face[f];

    surface->face_body[f] = body[s->depth[k] % 2 ? s->parent[k] : k];
    surface->face_none[f] = -1;
    if (!turn[k]) continue;
    rs_turn_face(surface, f);
    turned[f] ^= 1;
  }
  repairs->shells = s->num;
  repairs->voids  = s->num - surface->num_bodies;
  free(body);
  return RSURF_OK;
}

/* The triangles' boxes; the caller frees. NULL: no memory. */
static double (*boxes_of(const double *xyz, const rs_triangles *t))[6]
{
  double(*box)[6] = ra_zeros(t->num, sizeof *box);

  for (int64_t i = 0; box && i < t->num; i++)
    for (int k = 0; k < 3; k++) {
      const double a = xyz[3 * t->corner[i][0] + k], b = xyz[3 * t->corner[i][1] + k], c = xyz[3 * t->corner[i][2] + k];

      box[i][k]     = fmin(a, fmin(b, c));
      box[i][k + 3] = fmax(a, fmax(b, c));
    }
  return box;
}

rsurf_status rs_make_bodies(rsurf_surface *surface, const double *xyz, const char *name, int64_t num_shells,
                            const int64_t *shell, int8_t *turned, const rs_triangles *triangles, rsurf_repairs *repairs,
                            rsurf_message *message)
{
  shells  s               = {.surface = surface, .xyz = xyz, .triangles = triangles, .of_face = shell, .num = num_shells};
  rs_tree tree            = {.num = 0};
  double(*box)[6]         = boxes_of(xyz, triangles);
  int8_t      *turn_shell = ra_zeros(num_shells, sizeof *turn_shell);
  rsurf_status status = box && turn_shell && rs_tree_build(triangles->num, (const double(*)[6])box, &tree) && sort_triangles(&s)
                            ? RSURF_OK
                            : rs_no_memory(message);

  if (status == RSURF_OK) status = rs_check_crossings(surface, xyz, name, triangles, &tree, message);
  if (status == RSURF_OK) status = nest(&s, &tree, name, message);
  if (status == RSURF_OK) status = orient(&s, name, turn_shell, message);
  if (status == RSURF_OK) status = number_bodies(&s, surface, turn_shell, turned, repairs, message);
  rs_tree_drop(&tree);
  free(box);
  free(turn_shell);
  free(s.first);
  free(s.corner);
  free(s.depth);
  free(s.parent);
  free(s.around.item);
  free(s.around_at);
  return status;
}
