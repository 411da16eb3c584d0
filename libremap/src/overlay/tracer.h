/* tracer -- what the files share that trace the edges of one mesh through the other: hits.c, walk.c, trace.c. */
#ifndef RM_TRACER_H
#define RM_TRACER_H

#include "overlay/states.h"
#include "overlay/trace.h"

/* A crossing found: what a facet of the other mesh is called by and the sign of the crossing seen along the edge from its first
 * vertex. */
typedef struct hit {
  rm_lid triangle;
  int    sign;
} hit;

/* Error of an edge's side against a line in the sheared frame, by the square of the reach of its coordinates. With u = 2^-53:
 * differences err by u, shears by 3 u, so sheared coordinates, at most 2 reach, by 8 u reach; their products and the difference
 * of these by less than 80 u reach^2. */
#define LINE_NOISE 0x1p-46
typedef struct tracer {
  const rm_trimesh *own, *other;
  int               moved;
  bool              by_tree; /* every edge */
  rm_arena         *scratch;
  rm_states         states;
  const rm_boxtree *all_tree; /* over all triangles of other; built when first needed */
  const double    (*all_box)[6];
  hit              *hits; /* crossings of the present edge, ascending along it */
  int64_t           hits_room;
  int               num_hits;
  hit              *skin_hits; /* crossings of the present edge with the skin, ascending along it */
  int64_t           skin_room;
  int               num_skin; /* -1: not asked for yet */
  int               skin_behind; /* so many of them lie behind the walk */
  const double     *tried;       /* start of the edge for which clear was sought last */
  double            clear[6];    /* a box that no skin enters                         */
  rm_crossing      *crossing;
  int64_t           num_crossings, crossing_room;
  int64_t          *first;
  rm_lid           *count, *state;
  /* the present edge */
  const double     *p0, *p1;
  double            u[3], shear[2]; /* p1 - p0; u[axis[0]] / u[axis[2]], u[axis[1]] / u[axis[2]] */
  int               axis[3];        /* axis[2] is the edge's longest direction; a cyclic permutation of x, y, z */
  int               turn;           /* -1 if the edge runs down that axis, else 1 */
} tracer;

/* The side of edge f of the other mesh against the present edge's line. Exact. */
static inline int edge_side(const tracer *t, rm_lid f)
{
  const rm_trimesh *m = t->other;
  return rm_edge_side(t->p0, t->p1, m->vertex[m->edge[f][0]], m->vertex[m->edge[f][1]], t->moved, NULL);
}

/* Side of an end of the present edge against triangle b's plane. */
static inline int end_side(const tracer *t, rm_lid b, const double *p)
{
  const rm_lid *v = t->other->triangle[b];
  return rm_point_side(t->other->vertex[v[0]], t->other->vertex[v[1]], t->other->vertex[v[2]], p, t->moved, NULL);
}

/* The crossing of triangle b with sign s as one of its facet. */
static inline hit hit_of(const rm_trimesh *m, rm_lid b, int s)
{
  const rm_lid facet = rm_facet_of(m, b);
  return (hit){facet / 2, facet & 1 ? -s : s};
}

/* One more crossing of the present edge. */
static inline remap_status push_hit(tracer *t, rm_lid triangle, int sign)
{
  RM_TRY(rm_grow(&t->hits, &t->hits_room, t->num_hits + 1, sizeof *t->hits));
  t->hits[t->num_hits++] = (hit){triangle, sign};
  return REMAP_OK;
}

/* -1, 0, +1: triangle a is crossed before, with, after triangle b going from p0 to p1. Exact. */
int rm_trace_order(const tracer *t, rm_lid a, rm_lid b);
/* Put n hits into their order along the present edge. O(n log n). */
void rm_trace_sort_hits(const tracer *t, hit *h, int n);

/* All crossings of the present edge, ascending along it, into t->hits: by the box tree over all triangles. */
remap_status rm_trace_all_hits(tracer *t);
/* Its crossings with the skin into t->skin_hits, if they are not there yet. */
remap_status rm_trace_need_skin_hits(tracer *t);
/* True if the edge's box lies in one that no skin enters. */
bool rm_trace_is_clear(tracer *t);
/* The present edge comes near a cell that may be tangled: that may stick out of the skin, so what is outside may cross it. */
bool rm_trace_is_near_odd(const tracer *t);

/* The crossings of the line from p0 to p1, which need not be an edge, into t->hits. *state, that of p0, becomes that of p1. */
remap_status rm_trace_find_hits(tracer *t, const double *p0, const double *p1, rm_lid *state);

#endif
