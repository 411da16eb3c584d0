/* nodes -- the soup's vertices become the nodes of the result. Corners are put in the order of their coordinates, along the
 * curve of Morton keys, vertices in that of their corners; loops of vertices become loops of nodes. O(n). */
#include "super/super_private.h"

#include <stdlib.h>
#include <string.h>

/* A cell that has the soup's vertex i. */
static int64_t name_at_vertex(const rm_soup *s, int64_t i)
{
  int64_t f = 0;

  while (f < s->num_faces) {
    int64_t k = s->first[f];
    while (k < s->first[f + 1] && s->loop[k] != i) k++;
    if (k < s->first[f + 1]) break;
    f++;
  }
  RM_ASSERT(f < s->num_faces); /* no vertex is without a face */
  return rm_cell_name((const int64_t *const *)s->ancestor, s->face_cell[f][0]);
}

/* ---- corners ----------------------------------------------------------------------------------------------------- */

/* The distinct corners in order. */
typedef struct corners {
  int64_t *place;  /* [corners of the soup]           */
  int64_t *global; /* [num] NULL: as here, on one rank */
  int64_t  num, num_everywhere;
} corners;

/* A word that ascends as the coordinate does. */
static uint64_t word_of(double x)
{
  uint64_t bits;

  memcpy(&bits, &x, sizeof bits);
  return bits >> 63 ? ~bits : bits | UINT64_C(1) << 63;
}

/* Morton key and coordinates. */
enum { CORNER_WORDS = 4 };

/* distinct: the keys in order, for more than one rank. */
static remap_status sort_corners(const rm_finish *w, rm_arena *passing, corners *c, uint64_t **distinct)
{
  const rm_soup *s = w->soup;
  uint64_t     (*key)[CORNER_WORDS];

  RM_NEW(key, passing, s->num_corners);
  for (int64_t i = 0; i < s->num_corners; i++) {
    key[i][0] = rm_morton(w->job->frame, s->corner[i]);
    for (int d = 0; d < 3; d++) key[i][1 + d] = word_of(s->corner[i][d]);
  }
  RM_TRY(rm_super_rank(passing, s->num_corners, CORNER_WORDS, &key[0][0], c->place, &c->num));
  if (!s->has_ranks) return REMAP_OK;
  RM_NEW(*distinct, passing, CORNER_WORDS * c->num);
  for (int64_t i = 0; i < s->num_corners; i++) memcpy(*distinct + CORNER_WORDS * c->place[i], key[i], sizeof *key);
  return REMAP_OK;
}

/* Collective. The soup has no corners any more: what vertices are made of are places. */
static remap_status number_corners(const rm_finish *w, rm_arena *arena, corners *c)
{
  rm_soup      *s = w->soup;
  rm_arena     *passing  = rm_arena_new();
  uint64_t     *distinct = NULL;
  remap_status  status = REMAP_NO_MEMORY;

  c->place = rm_arena_alloc(arena, s->num_corners, sizeof *c->place);
  if (passing && c->place) status = sort_corners(w, passing, c, &distinct);
  if (status == REMAP_OK && s->has_ranks) c->global = rm_arena_alloc(arena, c->num, sizeof *c->global);
  RM_GOTO(done, status = rm_comm_agree(w->job->comm, s->has_ranks && !c->global ? REMAP_NO_MEMORY : status, NULL));
  if (s->has_ranks)
    status = rm_super_number(passing, w->job->comm, c->num, CORNER_WORDS, distinct, 0, c->global, &c->num_everywhere);
  free(s->corner);
  s->corner = NULL;
done:
  rm_arena_drop(passing);
  return status;
}

/* ---- vertices ---------------------------------------------------------------------------------------------------- */

/* The soup's vertices by the places of their corners. */
typedef struct vertices {
  const rm_made_of *made_of;
  const int64_t    *place;
} vertices;

static uint32_t corner_of(const vertices *v, uint32_t corner) { return corner ? (uint32_t)v->place[corner - 1] + 1 : 0; }

static uint32_t word_of_vertex(const void *user, int64_t i, int k)
{
  const vertices   *v = user;
  const rm_made_of *m = &v->made_of[i];

  if (k == 0) return (uint32_t)v->place[m->first];
  if (k == 1) return (uint32_t)m->kind << 30 | corner_of(v, m->second);
  return corner_of(v, m->more[k - 2]);
}

/* What numbers nodes. */
typedef struct numbering {
  corners   c;
  uint32_t *order;   /* [vertices of the soup] */
  rm_lid   *node_of; /* [vertices of the soup] */
} numbering;

/* The soup's vertices in order, and the node that each is. */
static remap_status sort_vertices(rm_finish *w, rm_arena *passing, numbering *x)
{
  const rm_soup *s     = w->soup;
  const vertices v     = {s->made_of, x->c.place};
  const rm_words words = {word_of_vertex, &v, RM_SOUP_CORNERS, x->c.num};
  int64_t        n     = 0;

  RM_NEW(x->order, passing, s->num_vertices);
  RM_NEW(x->node_of, passing, s->num_vertices);
  RM_TRY(rm_super_order(&words, s->num_vertices, x->order));
  for (int64_t k = 0; k < s->num_vertices; k++) {
    const bool    again = x->order[k] & RM_SAME;
    const int64_t i     = x->order[k] & ~RM_SAME;

    if (again && i < s->num_made) return rm_super_tangled(w, name_at_vertex(s, i)); /* the one before was made, too */
    n += !again;
    x->node_of[i] = (rm_lid)(n - 1);
  }
  w->v.num_nodes = n;
  return REMAP_OK;
}

static uint64_t global_of(const corners *c, uint32_t corner)
{
  return corner ? (uint64_t)c->global[c->place[corner - 1]] + 1 : 0;
}

/* Over several ranks, by the corners' global numbers. Collective. */
static remap_status number_nodes(rm_finish *w, rm_arena *passing, const numbering *x)
{
  const rm_soup *s = w->soup;
  uint64_t     (*key)[RM_SOUP_CORNERS] = rm_arena_alloc(passing, w->v.num_nodes, sizeof *key);
  int64_t       *global = rm_arena_alloc(w->arena, w->v.num_nodes, sizeof *global);

  RM_TRY(rm_comm_agree(w->job->comm, key && global ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  for (int64_t i = 0; i < s->num_vertices && key; i++) {
    const rm_made_of *m  = &s->made_of[i];
    uint64_t         *to = key[x->node_of[i]];

    to[0] = global_of(&x->c, m->first + 1) << 2 | m->kind;
    to[1] = global_of(&x->c, m->second);
    for (int k = 2; k < RM_SOUP_CORNERS; k++) to[k] = global_of(&x->c, m->more[k - 2]);
  }
  w->v.node_global = global;
  return rm_super_number(passing, w->job->comm, w->v.num_nodes, RM_SOUP_CORNERS, &key[0][0], 4 * (x->c.num_everywhere + 1),
                         global, &w->v.global_nodes);
}

/* Turn every loop of nodes until it begins with its least one. */
static remap_status turn_loops(rm_soup *s, rm_arena *passing)
{
  uint32_t longest = 0;
  rm_lid  *copy;

  for (int64_t f = 0; f < s->num_faces; f++)
    if (s->first[f + 1] - s->first[f] > longest) longest = s->first[f + 1] - s->first[f];
  RM_NEW(copy, passing, longest);
  for (int64_t f = 0; f < s->num_faces; f++) {
    const uint32_t n     = s->first[f + 1] - s->first[f];
    rm_lid        *loop  = s->loop + s->first[f];
    uint32_t       least = 0;

    for (uint32_t k = 1; k < n; k++)
      if (loop[k] < loop[least]) least = k;
    if (!least) continue;
    for (uint32_t k = 0; k < n; k++) copy[k] = loop[k < n - least ? k + least : k + least - n];
    memcpy(loop, copy, sizeof *loop * n);
  }
  return REMAP_OK;
}

static remap_status make_nodes(rm_finish *w, rm_arena *passing, const numbering *x)
{
  rm_soup     *s    = w->soup;
  const double unit = 1 / w->job->frame->scale;
  double     (*xyz)[3];

  free(s->made_of);
  s->made_of = NULL;
  RM_NEW(xyz, w->arena, w->v.num_nodes);
  for (int64_t i = 0; i < s->num_vertices; i++)
    for (int c = 0; c < 3; c++) xyz[x->node_of[i]][c] = s->xyz[i][c] * unit;
  free(s->xyz);
  s->xyz        = NULL;
  w->v.node_xyz = &xyz[0][0];
  for (int64_t k = 0; k < s->num_loop; k++) s->loop[k] = x->node_of[s->loop[k]];
  return turn_loops(s, passing);
}

/* Collective. */
static remap_status nodes(rm_finish *w, rm_arena *passing)
{
  const rm_comm *comm = w->job->comm;
  numbering      x    = {.order = NULL};
  rm_arena      *keys = rm_arena_new();
  remap_status   status;

  RM_GOTO(done, status = rm_comm_agree(comm, keys ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_GOTO(done, status = number_corners(w, keys, &x.c));
  RM_GOTO(done, status = rm_comm_agree_reason(comm, sort_vertices(w, passing, &x), w->reason));
  if (w->soup->has_ranks) RM_GOTO(done, status = number_nodes(w, keys, &x));
  rm_arena_drop(keys);
  return rm_comm_agree(comm, make_nodes(w, passing, &x), NULL);
done:
  rm_arena_drop(keys);
  return status;
}

remap_status rm_super_nodes(rm_finish *w)
{
  rm_arena    *passing = rm_arena_new();
  remap_status status  = rm_comm_agree(w->job->comm, passing ? REMAP_OK : REMAP_NO_MEMORY, NULL);

  if (status == REMAP_OK) status = nodes(w, passing);
  rm_arena_drop(passing);
  return status;
}
