/* moments -- crossings and segments of the overlay in; volume and first moments of every pair out (DESIGN 2.4, 2.6). No
 * polyhedron is built. Sums run in the overlay's canonical order, so they depend on coordinates only. */
#ifndef RM_MOMENTS_H
#define RM_MOMENTS_H

#include "overlay/overlay.h"
#include "part/part.h"

enum {
  RM_PAIR_SOURCE_SKIN = 1, /* the source mesh's skin passes through the target cell beside or inside this pair: it is partial */
  RM_PAIR_TARGET_SKIN = 2  /* the target mesh's skin passes through the source cell: that one is partial                     */
};

/* Pairs of this rank's pieces. Read-only once built. Invariants: pairs are sorted by target, and within a target canonically;
 * a pair is listed if its exact volume is not zero; coordinates and volumes are in the mesh room's frame. */
typedef struct rm_moments {
  int64_t       num_pairs;
  const rm_lid *source, *target; /* [num_pairs] cells of part->piece[0] and [1]                             */
  const double *volume;          /* [num_pairs]                                                             */
  const double (*moment)[3];     /* [num_pairs] integral of (x - c), c the source cell's centroid           */
  const uint8_t *flags;          /* [num_pairs] RM_PAIR_ bits                                               */
  double        zone_overlap_volume[2]; /* [side] of cells of one mesh with each other on this rank         */
  rm_gid        zone_overlap_cell[2][2]; /* [side] global ids of the two cells that overlap most, or -1     */
} rm_moments;

/* Not collective. The product lives in arena. */
remap_status rm_moments_build(rm_arena *arena, const rm_part *part, const rm_overlay *overlay, const rm_moments **out,
                              rm_reason *reason);

#endif
