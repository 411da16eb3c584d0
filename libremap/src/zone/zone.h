/* zone -- two meshes in; out which of their cells can meet the other mesh at all (the overlap zone). What can never meet is
 * left behind and counted. Coarse: boxes of groups of cells are gathered, at most RM_ZONE_BOXES per rank and mesh, and fewer
 * where there are very many ranks. O(n log B) time for n cells here and B boxes. */
#ifndef RM_ZONE_H
#define RM_ZONE_H

#include "mesh/mesh.h"

enum { RM_ZONE_BOXES = 64, RM_ZONE_ALL_BOXES = 1 << 16 };

/* How many boxes a rank may have, for no more than RM_ZONE_ALL_BOXES or one per rank to be gathered: some megabytes on 10^5
 * ranks. */
static inline int rm_zone_boxes(int num_ranks)
{
  const int most = RM_ZONE_ALL_BOXES / num_ranks;

  return most > RM_ZONE_BOXES ? RM_ZONE_BOXES : most > 1 ? most : 1;
}

/* True if two boxes have a point in common; touching is enough. */
static inline bool rm_box_meets(const double a[6], const double b[6])
{
  return a[0] <= b[3] && b[0] <= a[3] && a[1] <= b[4] && b[1] <= a[4] && a[2] <= b[5] && b[2] <= a[5];
}

/* A flat binary tree of boxes over items, for queries by box. Read-only once built; not collective. Touching boxes meet. */
typedef struct rm_boxtree {
  rm_lid         num_items;
  int64_t        num_nodes;
  const double (*box)[6];    /* [num_nodes] min x, y, z, max x, y, z                                   */
  const rm_lid  *first;      /* [num_nodes] leaf: first place in item; inner: node of the second child */
  const rm_lid  *count;      /* [num_nodes] leaf: number of items; inner: 0 (first child is node + 1)  */
  const rm_lid  *item;       /* [num_items] in the tree's order                                        */
} rm_boxtree;
/* Build over n boxes by median splits on centres; leaves hold at most 8 items. Lives in arena. O(n log n). */
remap_status rm_boxtree_build(rm_arena *arena, rm_lid n, const double (*box)[6], const rm_boxtree **out);
/* Call visit(user, item) for every item of a leaf whose own box meets `box`, until it returns non-zero, which is handed back.
 * Items' boxes must be given again. O(log n + hits). */
int rm_boxtree_query(const rm_boxtree *tree, const double (*item_box)[6], const double box[6],
                     int (*visit)(void *user, rm_lid item), void *user);

/* The same for every item whose own box meets the straight segment pq, and perhaps for some that miss it by rounding. */
int rm_boxtree_query_segment(const rm_boxtree *tree, const double (*item_box)[6], const double p[3], const double q[3],
                             int (*visit)(void *user, rm_lid item), void *user);

/* True if some item's own box meets `box`. O(log n) mostly. */
bool rm_boxtree_meets(const rm_boxtree *tree, const double (*item_box)[6], const double box[6]);

/* The boxes of at most `most` groups of neighbouring items that together hold all n boxes, in numbers that differ by a factor
 * of two at most: group is [most][6], *num_groups is 0 only if n is. Not collective. Working memory from scratch. O(n log
 * most). */
remap_status rm_box_groups(rm_arena *scratch, rm_lid n, const double (*box)[6], int most, double (*group)[6], int *num_groups);

/* Read-only once built. Invariants: listed cells ascend; a cell that is not listed meets no cell box of the other mesh. */
typedef struct rm_zone {
  rm_lid         num_cells[2]; /* [side]                                                            */
  const rm_lid  *cell[2];      /* [side][num_cells[side]] cells whose box meets a box of the other mesh */
} rm_zone;

/* Collective. Lives in arena. */
remap_status rm_zone_build(rm_arena *arena, const rm_comm *comm, const rm_mesh *const mesh[2], const rm_zone **out);
/* Every invariant that one rank can see; slow. Not collective. */
remap_status rm_zone_check(const rm_zone *zone, const rm_mesh *const mesh[2]);

#endif
