/* arcs -- the edges of polygons, those between the same two vertices side by side. */
#ifndef RM_CELLS_ARCS_H
#define RM_CELLS_ARCS_H

#include "cells/cells_private.h"

/* One polygon's edge. */
typedef struct rm_arc {
  rm_lid low, high; /* vertices */
  rm_lid polygon;
  rm_lid place;   /* of its first vertex in the loop      */
  rm_lid against; /* 1: the polygon runs from high to low */
} rm_arc;

typedef struct rm_arcs {
  int64_t num;
  rm_arc *arc; /* [num] ascending by (low, high), then by polygon */
} rm_arcs;

static inline bool rm_same_arc(const rm_arc *a, const rm_arc *b) { return a->low == b->low && a->high == b->high; }

/* Lives in arena. Vertices of the polygons are below num_vertices. O(n), expected. */
remap_status rm_arcs_build(rm_arena *arena, rm_lid num_vertices, const rm_polygons *p, rm_arcs *out);

#endif
