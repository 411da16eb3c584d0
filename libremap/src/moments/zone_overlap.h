/* zone_overlap -- do zones of one mesh overlap by more than rounding? */
#ifndef RM_ZONE_OVERLAP_H
#define RM_ZONE_OVERLAP_H

#include "moments/moments.h"

typedef struct rm_zone_overlap {
  double volume;  /* largest volume that two cells of different zones share, 0 if none overlap beyond rounding */
  rm_gid cell[2]; /* their global ids ascending, -1 if none                                                    */
} rm_zone_overlap;

/* Overlay the cells of a piece that a foreign zone's skin may enter with the cells behind that skin. Zone z holds the global
 * cells from zone_cell_offset[z] up to zone_cell_offset[z + 1]. Rounding: an overlap no deeper, over the smaller cell's
 * surface, than 2^-20 of `magnitude`, the whole mesh's largest coordinate, which single precision stays well below. Not
 * collective. O(n) for zones that join; patched interfaces cost an overlay of the layers beside them. */
remap_status rm_zone_overlap_find(const rm_frame *frame, const rm_piece *piece, remap_faces faces, int64_t num_zones,
                                  const int64_t *zone_cell_offset, double magnitude, rm_zone_overlap *out, rm_reason *reason);

#endif
