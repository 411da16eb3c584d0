/* zone_overlap -- do zones of one mesh overlap by more than rounding, among the cells that come to this rank? */
#ifndef RM_ZONE_OVERLAP_H
#define RM_ZONE_OVERLAP_H

#include "moments/moments.h"

typedef struct rm_zone_overlap {
  double volume;  /* largest volume that two cells of different zones share, 0 if none overlap beyond rounding */
  rm_gid cell[2]; /* their global ids ascending, -1 if none                                                    */
} rm_zone_overlap;

/* Overlay the entered cells with the entering ones, the one of the zone that comes first as the source, so that the volume of a
 * pair is the same wherever it is made. Those pairs count of which a face of the skin of the one meets the other by their
 * boxes. Rounding: an overlap no deeper, over the smaller cell's surface, than 2^-20 of `magnitude`, the whole mesh's largest
 * coordinate, which single precision stays well below. Not collective. Twice the cost of an overlay of these cells. */
remap_status rm_zone_overlap_find(const rm_frame *frame, const rm_skins *skins, remap_faces faces, double magnitude,
                                  rm_zone_overlap *out, rm_reason *reason);

#endif
