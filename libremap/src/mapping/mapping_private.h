/* mapping_private -- pairs on their way from the ranks that made them to rows. */
#ifndef RM_MAPPING_PRIVATE_H
#define RM_MAPPING_PRIVATE_H

#include "mapping.h"

/* The pairs of one side's cells at their home, in order of arrival. Arrays are malloc'ed. What a source cell's pair holds is
 * not stored a second time if its target cell has the same home: then twin is the place of that cell's pair there; else it is
 * -1 - a, a the place among those that are away. */
typedef struct rm_arrivals {
  int64_t  num, room;
  rm_lid  *receiver;              /* [num]                        */
  rm_lid  *giver;                 /* [num] place in the list      */
  rm_lid  *twin;                  /* [num] NULL of the target side */
  double (*second)[6];            /* [num] NULL: there are none   */
  int64_t  num_held, held_room;   /* target side: num; source side: pairs that are away */
  double  *volume, (*moment)[3];  /* [num_held]                   */
  uint8_t *is_cut;                /* [cells] the giving mesh's skin passes through the cell */
  int64_t  num_givers, giver_room; /* each listed once            */
  int32_t *giver_rank;            /* [num_givers]                 */
  rm_lid  *giver_cell;            /* [num_givers]                 */
  rm_lid  *bucket;                /* [num_buckets], a power of two: place in the list plus 1, by hash; 0 is free */
  int64_t  num_buckets;
} rm_arrivals;

struct rm_gathering {
  bool        has_second;
  rm_arrivals of[2]; /* [side that receives] */
};

/* Give the list of givers back; pairs keep their numbers. */
void rm_arrivals_forget_givers(rm_arrivals *a);

/* Take element place[k] of the arrivals' arrays to k, for all k; receivers, which the order of rows tells, are given back.
 * place [num] stays as it is. O(num) time, in place. */
void rm_arrivals_permute(rm_arrivals *a, rm_lid *place);

#endif
