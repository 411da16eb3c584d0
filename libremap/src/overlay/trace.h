/* trace -- walks the edges of one mesh through the cells of the other (DESIGN 2.3). */
#ifndef RM_TRACE_H
#define RM_TRACE_H

#include "overlay/overlay.h"

/* Trace every edge of `own` through `other`. moved: +1 if `other` is the translated mesh (mesh 2), else -1. by_tree: take every
 * edge's crossings from the box tree, none by adjacency. Not collective. The trace's arrays live in arena. INCONSISTENT if an
 * edge arrives somewhere with another state than the vertex has; *bad_edge then is that edge. CANCELLED if progress says so.
 * O(pieces of edges), expected. */
remap_status rm_trace_build(rm_arena *arena, const rm_trimesh *own, const rm_trimesh *other, int moved, bool by_tree,
                            const rm_progress *progress, rm_trace *out, rm_lid *bad_edge);

#endif
