/* moments -- crossings and segments of the overlay in; volume and moments of every pair out (DESIGN 2.4, 2.6). No polyhedron is
 * built. Sums run in the overlay's canonical order, so they depend on coordinates only. */
#ifndef RM_MOMENTS_H
#define RM_MOMENTS_H

#include "overlay/overlay.h"

enum {
  RM_PAIR_SOURCE_SKIN = 1, /* the source mesh's skin passes through the target cell within this pair: that cell is partial */
  RM_PAIR_TARGET_SKIN = 2, /* the target mesh's skin passes through the source cell: that one is partial                   */
  RM_PAIR_EMPTY       = 4  /* no pair: no volume, but the skin of a flat part of one cell passes through the other; V is 0  */
};

/* Pairs of this rank's pieces that are made here (rm_part_makes_pair). Read-only once built. Invariants: a pair is listed once,
 * in the order of sources and in no particular order within a source; it is listed if its exact volume is not zero, or as
 * RM_PAIR_EMPTY; coordinates are in the mesh room's frame. */
typedef struct rm_moments {
  int64_t        num_pairs;
  const rm_lid  *source, *target; /* [num_pairs] cells of part->piece[0] and [1]                                       */
  const double  *volume;          /* [num_pairs]                                                                       */
  const double (*moment)[3];      /* [num_pairs] integral of (x - c), c the source cell's centroid                     */
  const double (*second)[6];      /* [num_pairs] integral of (x - c)(x - c)^T: xx, yy, zz, xy, xz, yz; NULL if not asked */
  const double (*second_back)[6]; /* [num_pairs] the same about the target cell's centroid; NULL likewise                */
  const uint8_t *flags;           /* [num_pairs] RM_PAIR_ bits                                                         */
} rm_moments;

/* degree: 1 for volumes and first moments, 2 for second moments too. Not collective. The product lives in arena. O(crossings);
 * pairs whose rounding could exceed 2^-33 of the smaller cell are summed again in double-double; whether those exist whose sum
 * is within its rounding error is decided exactly. */
remap_status rm_moments_build(rm_arena *arena, const rm_part *part, const rm_overlay *overlay, int degree,
                              const rm_moments **out);

#endif
