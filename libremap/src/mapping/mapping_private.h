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

/* Where a cell's home is, and its number there. */
typedef struct rm_home {
  int32_t rank;
  rm_lid  cell;
} rm_home;

/* The pairs that were made on this rank. Arrays are malloc'ed. A cell is listed once for every part that it came with. */
typedef struct rm_pairs_here {
  int64_t  num, room;
  rm_lid  *cell[2];        /* [side][num] place in the list of homes          */
  double  *volume;         /* [num] and so on, as in rm_moments               */
  double (*moment)[3], (*second)[6], (*second_back)[6];
  uint8_t *flags;
  int64_t  num_homes[2], home_room[2];
  rm_home *home[2];        /* [side][num_homes]                               */
} rm_pairs_here;

struct rm_gathering {
  bool          has_second;
  int64_t       slice; /* pairs that go home at once, at least */
  rm_pairs_here here;
  rm_arrivals   of[2]; /* [side that receives] */
};

/* Send the pairs that are here home; none is here then. Moments of pairs that are away from their target cells are still about
 * the source cells' centroids. Collective. TOO_LARGE if 2^31 or more come to one rank. */
remap_status rm_gathering_send(rm_gathering *g, const rm_comm *comm, rm_reason *reason);

/* Give the list of givers back; pairs keep their numbers. */
void rm_arrivals_forget_givers(rm_arrivals *a);

/* Take element place[k] of the arrivals' arrays to k, for all k; receivers, which the order of rows tells, are given back.
 * place [num] stays as it is. O(num) time, in place. */
void rm_arrivals_permute(rm_arrivals *a, rm_lid *place);

#endif
