/* faces -- the polygons as faces: pieces of one face between the same two cells put together again, across edges that no other
 * polygon has, if what results has one loop that meets itself nowhere; concave faces cut into convex ones if that is asked for.
 * Pieces that are exactly coplanar leave volumes as they are; others come together only if asked for. O(n), expected; memory
 * for pieces that have others to join, and one byte for each polygon. */
#include "cells/cells_private.h"

#include <stdlib.h>
#include <string.h>

/* Groups of polygons, of two at least. */
typedef struct groups {
  rm_lid        num;
  const rm_lid *offset; /* [num + 1]                                                             */
  const rm_lid *member; /* polygons, ascending; groups ascend by their first one                 */
  rm_lid       *of;     /* [num polygons] group, -1                                              */
  uint8_t      *inner;  /* [num_vertices of p] bits: the edge from this place on is no side      */
} groups;

typedef struct work {
  rm_arena          *scratch;
  const rm_limit    *l;
  const rm_polygons *p;
  const rm_glued    *glued;
  groups             g;
  rm_lid            *next;  /* [num_spots] -1: where the side from a spot leads to, of the present group */
  rm_lid            *loop;  /* of the present group                                                      */
  rm_parts           parts; /* of the present face                                                       */
  rm_faces          *out;
} work;

static rm_lid root(rm_lid *parent, rm_lid k)
{
  while (parent[k] != k) k = parent[k] = parent[parent[k]];
  return k;
}

static inline bool is_inner(const groups *g, uint32_t corner) { return g->inner[corner >> 3] >> (corner & 7) & 1; }

/* ---- groups ------------------------------------------------------------------------------------------------------ */

/* A joint counts if it is coplanar, or if neither of its polygons is for coplanar ones alone. */
static bool counts(const rm_joint *j, const uint8_t *plane_only)
{
  return j->coplanar || !plane_only || (!plane_only[j->polygon[0]] && !plane_only[j->polygon[1]]);
}

/* Groups of polygons that joints connect; plane_only may be NULL. */
static remap_status group_pieces(work *w, const uint8_t *plane_only)
{
  const rm_glued *glued = w->glued;
  const rm_lid    n     = (rm_lid)w->p->num;
  groups         *g     = &w->g;
  rm_lid         *of, *offset, *member, num = 0;

  RM_NEW(of, w->scratch, n);
  RM_NEW0(g->inner, w->scratch, w->p->num_vertices / 8 + 1);
  for (rm_lid k = 0; k < n; k++) of[k] = k;
  for (int64_t i = 0; i < glued->num_joints; i++) {
    const rm_joint *j = &glued->joint[i];
    if (!counts(j, plane_only)) continue;
    const rm_lid a = root(of, j->polygon[0]), b = root(of, j->polygon[1]);
    if (a < b) of[b] = a;
    else of[a] = b;
    for (int h = 0; h < 2; h++) g->inner[j->corner[h] >> 3] |= (uint8_t)(1 << (j->corner[h] & 7));
  }
  RM_NEW0(offset, w->scratch, (int64_t)n + 2);
  for (rm_lid k = 0; k < n; k++) offset[root(of, k)]++;
  for (rm_lid k = 0; k < n; k++) { /* from parents, which are lower, to groups */
    if (of[k] == k) of[k] = offset[k] > 1 ? -2 - num++ : -1;
    else of[k] = of[of[k]];
  }
  for (rm_lid k = 0; k < n; k++) of[k] = of[k] < -1 ? -2 - of[k] : -1;
  memset(offset, 0, sizeof *offset * ((size_t)num + 2));
  for (rm_lid k = 0; k < n; k++)
    if (of[k] >= 0) offset[of[k] + 2]++;
  for (rm_lid k = 0; k < num; k++) offset[k + 2] += offset[k + 1];
  RM_NEW(member, w->scratch, offset[num + 1]);
  for (rm_lid k = 0; k < n; k++)
    if (of[k] >= 0) member[offset[of[k] + 1]++] = k;
  g->num    = num;
  g->of     = of;
  g->offset = offset;
  g->member = member;
  return REMAP_OK;
}

/* ---- loops ------------------------------------------------------------------------------------------------------- */

/* Link the sides of all members, from vertex to vertex, and count them; false if two begin at one vertex. */
static bool link_sides(const work *w, rm_lid group, rm_lid *sides, rm_lid *first)
{
  bool simple = true;

  *sides = 0;
  for (rm_lid i = w->g.offset[group]; i < w->g.offset[group + 1]; i++) {
    const rm_lid  m = w->g.member[i], n = rm_polygon_size(w->p, m);
    const rm_lid *v      = rm_polygon_loop(w->p, m);
    const bool    turned = rm_is_turned(w->glued, m);

    for (rm_lid k = 0; k < n; k++) {
      const rm_lid from = v[turned ? (k + 1) % n : k], to = v[turned ? k : (k + 1) % n];
      if (is_inner(&w->g, w->p->first[m] + (uint32_t)k)) continue;
      simple        = simple && w->next[from] < 0;
      w->next[from] = to;
      *first        = from;
      ++*sides;
    }
  }
  return simple;
}

static void unlink_sides(const work *w, rm_lid group)
{
  for (rm_lid i = w->g.offset[group]; i < w->g.offset[group + 1]; i++) {
    const rm_lid  m = w->g.member[i], n = rm_polygon_size(w->p, m);
    const rm_lid *v = rm_polygon_loop(w->p, m);
    for (rm_lid k = 0; k < n; k++) w->next[v[k]] = -1;
  }
}

/* The loop of a group in w->loop, counter-clockwise about the normal out of the lower cell, RM_OUTSIDE being the highest; 0 if
 * the group has not exactly one loop that meets itself nowhere: its members then are faces as they are. */
static rm_lid group_loop(const work *w, rm_lid group)
{
  rm_lid sides, first = -1, num = 0;
  bool   simple = link_sides(w, group, &sides, &first);

  for (rm_lid v = first; simple && num < sides; v = w->next[v]) {
    w->loop[num++] = v;
    simple         = w->next[v] >= 0 && (w->next[v] == first) == (num == sides);
  }
  unlink_sides(w, group);
  return simple && num >= 3 ? num : 0;
}

/* Room for the loops of groups. */
static remap_status loop_room(work *w)
{
  uint32_t longest = 0;

  for (rm_lid k = 0; k < w->g.num; k++) {
    uint32_t sum = 0;
    for (rm_lid i = w->g.offset[k]; i < w->g.offset[k + 1]; i++) sum += (uint32_t)rm_polygon_size(w->p, w->g.member[i]);
    longest = sum > longest ? sum : longest;
  }
  RM_NEW(w->loop, w->scratch, longest);
  if (w->next) return REMAP_OK;
  RM_NEW(w->next, w->scratch, w->l->num_spots);
  for (rm_lid s = 0; s < w->l->num_spots; s++) w->next[s] = -1;
  return REMAP_OK;
}

/* ---- warped groups ----------------------------------------------------------------------------------------------- */

enum { CANDIDATES = 6 };

/* Groups that have been at all sides of a group so far. */
typedef struct company {
  rm_lid other[CANDIDATES];
  bool   any; /* a side has been seen */
} company;

/* Leave in the company of group g those that are at the present edge too. */
static void meet(company *c, rm_lid g, const rm_lid *present, rm_lid n)
{
  rm_lid kept = 0, was[CANDIDATES];

  memcpy(was, c->other, sizeof was);
  for (int i = 0; i < CANDIDATES; i++) c->other[i] = -1;
  for (rm_lid k = 0; k < n && kept < CANDIDATES; k++) {
    bool stays = present[k] != g && !c->any;
    for (int i = 0; i < CANDIDATES && c->any; i++) stays = stays || (was[i] >= 0 && was[i] == present[k]);
    for (rm_lid i = 0; i < kept; i++) stays = stays && c->other[i] != present[k];
    if (stays) c->other[kept++] = present[k];
  }
  c->any = true;
}

typedef struct enclosure {
  const work *w;
  company    *list; /* [num polygons] of its group: at the group's first member; of a polygon alone at that */
} enclosure;

/* The polygon that stands for all of polygon k's group. */
static rm_lid leader(const work *w, rm_lid k) { return w->g.of[k] < 0 ? k : w->g.member[w->g.offset[w->g.of[k]]]; }

static remap_status meet_at_edge(void *user, rm_lid low, const rm_arc *arc, rm_lid n)
{
  const enclosure *e = user;
  rm_lid           around[CANDIDATES + 1];
  const rm_lid     most = n <= CANDIDATES ? n : CANDIDATES + 1;

  (void)low;
  if (is_inner(&e->w->g, e->w->p->first[arc[0].polygon / 2] + (uint32_t)arc[0].place)) return REMAP_OK;
  for (rm_lid k = 0; k < most; k++) around[k] = leader(e->w, arc[k].polygon / 2);
  for (rm_lid k = 0; k < most; k++) meet(&e->list[around[k]], around[k], around, most);
  return REMAP_OK;
}

/* Mark groups all of whose sides are sides of one other group too: as polygons of one loop they would leave nothing between
 * them. */
static remap_status mark_enclosed(work *w, uint8_t *bad)
{
  enclosure e = {w, NULL};

  RM_NEW0(e.list, w->scratch, w->p->num);
  RM_TRY(rm_each_edge(w->l->num_spots, w->p, meet_at_edge, &e));
  for (rm_lid k = 0; k < w->g.num; k++) {
    const company *c = &e.list[w->g.member[w->g.offset[k]]];
    bad[k]           = c->other[0] >= 0 && c->any;
  }
  return REMAP_OK;
}

/* Twice the area of polygon k, as a vector along the normal out of its lower cell. */
static void area_vector(const work *w, rm_lid k, double out[3])
{
  const rm_lid *v = rm_polygon_loop(w->p, k), n = rm_polygon_size(w->p, k);
  const double *o = w->l->xyz[v[0]], sign = rm_is_turned(w->glued, k) ? -1 : 1;

  out[0] = out[1] = out[2] = 0;
  for (rm_lid i = 1; i + 1 < n; i++) {
    double a[3], b[3];
    for (int c = 0; c < 3; c++) a[c] = w->l->xyz[v[i]][c] - o[c], b[c] = w->l->xyz[v[i + 1]][c] - o[c];
    for (int c = 0; c < 3; c++) out[c] += sign * (a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3]);
  }
}

/* True if all pieces of the group show the same side along the mean of their normals. */
static bool is_without_folds(const work *w, rm_lid group)
{
  double sum[3] = {0, 0, 0}, a[3];

  for (rm_lid i = w->g.offset[group]; i < w->g.offset[group + 1]; i++) {
    area_vector(w, w->g.member[i], a);
    for (int c = 0; c < 3; c++) sum[c] += a[c];
  }
  for (rm_lid i = w->g.offset[group]; i < w->g.offset[group + 1]; i++) {
    area_vector(w, w->g.member[i], a);
    if (!(a[0] * sum[0] + a[1] * sum[1] + a[2] * sum[2] > 0)) return false;
  }
  return true;
}

/* Group again, where polygons of groups that are no faces join only what is coplanar. */
static remap_status refuse_groups(work *w)
{
  uint8_t *bad, *plane_only;

  RM_NEW0(bad, w->scratch, w->g.num);
  RM_NEW0(plane_only, w->scratch, w->p->num);
  RM_TRY(loop_room(w));
  RM_TRY(mark_enclosed(w, bad));
  for (rm_lid k = 0; k < w->g.num; k++) {
    const bool refused = bad[k] || !is_without_folds(w, k) || !group_loop(w, k);
    for (rm_lid i = w->g.offset[k]; i < w->g.offset[k + 1]; i++) plane_only[w->g.member[i]] = refused;
  }
  return group_pieces(w, plane_only);
}

/* ---- faces ------------------------------------------------------------------------------------------------------- */

/* A face of polygon k with a loop of its own. */
static remap_status make_face(work *w, rm_lid k, const rm_lid *loop, rm_lid n)
{
  rm_faces *out  = w->out;
  rm_parts *made = &out->made;

  RM_TRY(rm_grow(&made->vertex, &made->vertex_room, made->num_vertices + n, sizeof *made->vertex));
  RM_TRY(rm_grow(&made->end, &made->end_room, made->num + 1, sizeof *made->end));
  RM_TRY(rm_grow(&out->made_of, &out->made_room, made->num + 1, sizeof *out->made_of));
  if (made->num_vertices > INT32_MAX - n) return REMAP_TOO_LARGE;
  memcpy(made->vertex + made->num_vertices, loop, sizeof *loop * (size_t)n);
  made->num_vertices += n;
  out->made_of[made->num]  = k;
  made->end[made->num++]   = (rm_lid)made->num_vertices;
  out->kind[k]             = RM_FACE_MADE;
  return REMAP_OK;
}

/* A face of pieces, cut into convex ones if it is concave and that is wanted. */
static remap_status add_face(work *w, const rm_pieces *of, const rm_lid *loop, rm_lid n, bool split_concave)
{
  const rm_lid  k    = of->polygon[0];
  const rm_view view = split_concave && n > 3 ? rm_view_of(w->l, w->p->own[k] & 1, w->p->own[k] / 2) : (rm_view){0};

  if (!view.l || rm_is_convex(&view, loop, n)) return loop == w->loop ? make_face(w, k, loop, n) : REMAP_OK;
  RM_TRY(rm_cut_convex(&view, n, loop, of, &w->parts));
  for (int64_t i = 0; i < w->parts.num; i++) {
    const rm_lid first = i ? w->parts.end[i - 1] : 0;
    RM_TRY(make_face(w, k, w->parts.vertex + first, w->parts.end[i] - first));
  }
  return REMAP_OK;
}

static void reverse(rm_lid *loop, rm_lid n)
{
  for (rm_lid i = 0, k = n - 1; i < k; i++, k--) {
    const rm_lid x = loop[i];
    loop[i] = loop[k], loop[k] = x;
  }
}

/* The face of the group whose first member is polygon k; *one is false if its members stay what they are. */
static remap_status add_group(work *w, rm_lid k, bool split_concave, bool *one)
{
  const rm_lid group = w->g.of[k], n = group_loop(w, group);

  *one = n > 0;
  if (!n) return REMAP_OK;
  for (rm_lid i = w->g.offset[group]; i < w->g.offset[group + 1]; i++) w->out->kind[w->g.member[i]] = RM_FACE_NONE;
  if (rm_is_turned(w->glued, k)) reverse(w->loop, n); /* it runs as that of a polygon which is not turned */
  return add_face(w, &(rm_pieces){w->p, w->g.member + w->g.offset[group], w->g.offset[group + 1] - w->g.offset[group]}, w->loop,
                  n, split_concave);
}

static remap_status all_faces(work *w, bool split_concave)
{
  for (rm_lid k = 0; k < w->p->num; k++) {
    bool one = false;

    if (w->out->kind[k] == RM_FACE_NONE) continue;
    if (w->g.num && w->g.of[k] >= 0 && w->g.member[w->g.offset[w->g.of[k]]] == k) RM_TRY(add_group(w, k, split_concave, &one));
    if (one) continue;
    RM_TRY(add_face(w, &(rm_pieces){w->p, &k, 1}, rm_polygon_loop(w->p, k), rm_polygon_size(w->p, k), split_concave));
  }
  return REMAP_OK;
}

static remap_status build(work *w, bool warped, bool split_concave)
{
  if (w->glued->num_joints) {
    RM_TRY(group_pieces(w, NULL));
    if (warped) RM_TRY(refuse_groups(w));
    RM_TRY(loop_room(w));
  }
  if (w->glued->num_joints || split_concave) return all_faces(w, split_concave);
  return REMAP_OK;
}

remap_status rm_faces_build(const rm_limit *l, const rm_polygons *p, const rm_glued *glued, bool warped, bool split_concave,
                            rm_faces *out)
{
  work         w      = {.scratch = rm_arena_new(), .l = l, .p = p, .glued = glued, .out = out};
  remap_status status = w.scratch ? build(&w, warped, split_concave) : REMAP_NO_MEMORY;

  free(w.parts.vertex);
  free(w.parts.end);
  rm_arena_drop(w.scratch);
  return status;
}
