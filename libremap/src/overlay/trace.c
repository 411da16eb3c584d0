/* trace -- edge tracing with label colouring (DESIGN 2.3).
 *
 * Vertices are taken in their order, which is that of space, and every edge carries the state of its first vertex to its
 * second. A vertex that no edge has reached before gets its state from the vertex before it, by a walk along the straight line
 * between them, the first one from a point outside. So crossings are found in the order of their edges. Cost: see walk.c and
 * hits.c. */
#include "overlay/trace.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "overlay/tracer.h"

static double parameter(const tracer *t, rm_lid b)
{
  const rm_lid *v = t->other->triangle[b];
  return rm_crossing_parameter(t->p0, t->p1, t->other->vertex[v[0]], t->other->vertex[v[1]], t->other->vertex[v[2]]);
}

/* Trace edge e, whose first vertex has state *state; *state becomes the second one's. */
static remap_status trace_edge(tracer *t, rm_lid e, rm_lid *state)
{
  rm_lid at = *state;

  RM_TRY(rm_trace_find_hits(t, t->own->vertex[t->own->edge[e][0]], t->own->vertex[t->own->edge[e][1]], state));
  RM_TRY(rm_grow(&t->crossing, &t->crossing_room, t->num_crossings + t->num_hits, sizeof *t->crossing));
  t->first[e] = t->num_crossings;
  t->count[e] = t->num_hits;
  t->state[e] = at;
  for (int k = 0; k < t->num_hits; k++) {
    const hit h = t->hits[k];
    RM_TRY(rm_states_cross(&t->states, at, t->other->side[h.triangle], h.sign, &at));
    t->crossing[t->num_crossings++] = (rm_crossing){parameter(t, h.triangle), 2 * h.triangle + (h.sign < 0), at, e};
  }
  return REMAP_OK;
}

/* ---- the whole mesh ---------------------------------------------------------------------------------------------- */

enum {
  UNKNOWN = INT32_MAX, /* no state yet */
  STEP    = 1 << 14    /* edges between two calls of progress */
};

/* Bits: below and above the box along x, y, z. An edge whose ends share one misses all that is in the box. */
static uint8_t beyond(const double box[6], const double p[3])
{
  int bits = 0;

  for (int c = 0; c < 3; c++) bits |= (p[c] < box[c]) << 2 * c | (p[c] > box[c + 3]) << (2 * c + 1);
  return (uint8_t)bits;
}

/* State of vertex v, from that of vertex `before`, -1: from a point outside. */
static remap_status locate(tracer *t, rm_lid v, rm_lid before, rm_lid *where)
{
  const double *p = t->own->vertex[v], outside[3] = {2, p[1], p[2]}; /* every coordinate is below 1 in magnitude */

  where[v] = before < 0 ? RM_OUTSIDE : where[before];
  return rm_trace_find_hits(t, before < 0 ? outside : t->own->vertex[before], p, &where[v]);
}

static remap_status colour(tracer *t, const rm_progress *progress, rm_lid *bad_edge)
{
  const rm_trimesh *m = t->own;
  rm_lid           *where, last = -1;
  uint8_t          *far;

  RM_NEW(where, t->scratch, m->num_vertices);
  RM_NEW(far, t->scratch, m->num_vertices);
  for (rm_lid v = 0; v < m->num_vertices; v++) {
    far[v]   = beyond(t->other->box, m->vertex[v]);
    where[v] = far[v] ? RM_OUTSIDE : UNKNOWN;
  }
  for (rm_lid e = 0; e < m->num_edges; e++) {
    const rm_lid v = m->edge[e][0], w = m->edge[e][1];
    rm_lid       state;

    if (e % STEP == STEP - 1 && progress && progress->call &&
        progress->call(progress->user, t->moved > 0 ? "tracing of source edges" : "tracing of target edges",
                       (double)e / m->num_edges))
      return REMAP_CANCELLED;
    if (far[v] & far[w] || rm_is_inside_facets(m, e)) {
      t->first[e] = t->num_crossings;
      t->count[e] = 0;
      t->state[e] = RM_OUTSIDE;
      continue;
    }
    if (where[v] == UNKNOWN) RM_TRY(locate(t, v, last, where));
    last  = v;
    state = where[v];
    RM_TRY(trace_edge(t, e, &state));
    if (where[w] == UNKNOWN) where[w] = state;
    if (where[w] != state) {
      *bad_edge = e;
      return REMAP_INCONSISTENT;
    }
  }
  return REMAP_OK;
}

/* What has grown on the way, in the arena. */
static remap_status keep(rm_arena *arena, const tracer *t, rm_trace *out)
{
  const rm_lid num_winding = t->states.offset[t->states.num];
  rm_crossing *crossing;
  rm_lid      *offset;
  rm_winding  *winding;

  RM_NEW(crossing, arena, t->num_crossings);
  RM_NEW(offset, arena, (int64_t)t->states.num + 1);
  RM_NEW(winding, arena, num_winding);
  if (t->num_crossings) memcpy(crossing, t->crossing, sizeof *crossing * (size_t)t->num_crossings);
  memcpy(offset, t->states.offset, sizeof *offset * ((size_t)t->states.num + 1));
  if (num_winding) memcpy(winding, t->states.winding, sizeof *winding * (size_t)num_winding);
  *out = (rm_trace){t->num_crossings, crossing, t->first, t->count, t->state, offset, winding, t->states.num};
  return REMAP_OK;
}

remap_status rm_trace_build(rm_arena *arena, const rm_trimesh *own, const rm_trimesh *other, int moved, bool by_tree,
                            const rm_progress *progress, rm_trace *out, rm_lid *bad_edge)
{
  tracer       t = {.own = own, .other = other, .moved = moved, .by_tree = by_tree, .scratch = rm_arena_new(),
                    .clear = {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY}};
  remap_status status = t.scratch ? REMAP_OK : REMAP_NO_MEMORY;

  if (status != REMAP_OK) goto done;
  RM_GOTO(done, status = rm_states_init(&t.states));
  t.first = rm_arena_alloc(arena, own->num_edges, sizeof *t.first);
  t.count = rm_arena_alloc(arena, own->num_edges, sizeof *t.count);
  t.state = rm_arena_alloc(arena, own->num_edges, sizeof *t.state);
  RM_GOTO(done, status = t.first && t.count && t.state ? REMAP_OK : REMAP_NO_MEMORY);
  RM_GOTO(done, status = colour(&t, progress, bad_edge));
  status = keep(arena, &t, out);
done:
  rm_states_free(&t.states);
  free(t.hits);
  free(t.skin_hits);
  free(t.crossing);
  rm_arena_drop(t.scratch);
  return status;
}
