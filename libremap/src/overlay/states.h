/* states -- interned lists of winding numbers (DESIGN 2.7): the state of a point is the cells it lies in and how often each
 * winds about it. Normally one cell, once, and then the state is that cell's number; equal states are equal integers. */
#ifndef RM_STATES_H
#define RM_STATES_H

#include "overlay/overlay.h"

typedef struct rm_states {
  rm_lid     *offset; /* [num + 1], malloc'ed like the rest */
  rm_winding *winding;
  rm_lid     *bucket; /* [num_buckets] first list of each hash value, -1 */
  rm_lid     *next;   /* [num] next list of equal hash, -1               */
  int64_t     offset_room, winding_room, next_room;
  rm_lid      num, num_buckets;
} rm_states;

/* Start empty. NO_MEMORY. The caller owns what is inside: rm_states_free. */
remap_status rm_states_init(rm_states *states);
/* Give back what is inside. */
void rm_states_free(rm_states *states);

/* The state in which cell's number has changed by `by`; cell RM_OUTSIDE changes nothing. Short lists, so linear time. */
remap_status rm_states_change(rm_states *states, rm_lid from, rm_lid cell, int by, rm_lid *out);

/* The state behind triangle t when crossed with sign s = +1 along its normal, -1 against it: the near cell is left, the far one
 * entered. */
static inline remap_status rm_states_cross(rm_states *states, rm_lid from, const rm_lid side[2], int s, rm_lid *out)
{
  const rm_lid near = side[s > 0 ? 0 : 1], far = side[s > 0 ? 1 : 0];

  if (from == near) { /* from the one cell, or from outside, into the next: the usual case */
    *out = far;
    return REMAP_OK;
  }
  RM_TRY(rm_states_change(states, from, near, -1, out));
  return rm_states_change(states, *out, far, 1, out);
}

#endif
