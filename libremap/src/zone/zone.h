/* zone -- two meshes in; out which of their cells can meet the other mesh at all (the overlap zone). What can never meet is
 * left behind and counted. Coarse: ranks learn of each other's cells by boxes around groups of them, crowds, and only of those
 * that they meet. O(n log B) time for n cells here and B crowds. */
#ifndef RM_ZONE_H
#define RM_ZONE_H

#include "mesh/mesh.h"

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
 * of two at most: group is [most][6], group_of [n] tells the group of each item and may be NULL, *num_groups is 0 only if n is.
 * Not collective. Working memory from scratch. O(n log most). */
remap_status rm_box_groups(rm_arena *scratch, rm_lid n, const double (*box)[6], int most, double (*group)[6], rm_lid *group_of,
                           int *num_groups);

/* A crowd: boxes of a rank that lie side by side, by one around them. */
typedef struct rm_crowd {
  double  box[6];
  double  num;   /* boxes in it, about                                       */
  int64_t rank;  /* whose they are; if it is joined, of some                 */
  int64_t label; /* of its boxes, 0 if they have none; RM_SEVERAL_LABELS     */
} rm_crowd;
enum { RM_SEVERAL_LABELS = -1 };

/* Crowds that this rank knows of. Read-only once built. */
typedef struct rm_crowds {
  rm_lid            num, num_own; /* this rank's come first */
  const rm_crowd   *crowd;        /* [num]                  */
  const double    (*box)[6];      /* [num] of each          */
  const rm_boxtree *tree;         /* over them              */
} rm_crowds;

/* A rank makes no more crowds than RM_CROWDS. Where it does not matter whose they are, it learns of no more than
 * RM_SOME_CROWDS, however many ranks and whatever lies on them; otherwise of RM_ALL_CROWDS. */
enum { RM_CROWDS = 64, RM_SOME_CROWDS = 1024, RM_ALL_CROWDS = INT32_MAX };

/* Items of `size` bytes that begin with their box, double[6]: tell each rank of all those that meet its asking boxes, and of a
 * few others. Its own come first, all of them. Collective; messages to log2 P ranks, and what a rank takes in follows from what
 * it asks for and not from how many ranks there are. *met, [*num_met], lives in arena. */
remap_status rm_boxes_meet(rm_arena *arena, const rm_comm *comm, size_t size, int64_t num, const void *item,
                           rm_lid num_asking, const double (*asking)[6], int64_t *num_met, void **met);

/* The same of crowds, into which the boxes of every rank are grouped. Neighbouring crowds of other ranks are joined so that no
 * more than `most` are left. Collective. *out lives in arena. TOO_LARGE if a rank cannot number them. */
remap_status rm_crowds_meet(rm_arena *arena, const rm_comm *comm, rm_lid num_boxes, const double (*box)[6], rm_lid num_asking,
                            const double (*asking)[6], rm_lid most, rm_crowds *out);

/* The same for boxes with labels, [num_boxes] from 0, such as zones: a rank makes crowds of one label each, RM_CROWDS of them
 * or one for each label. */
remap_status rm_crowds_meet_labelled(rm_arena *arena, const rm_comm *comm, rm_lid num_boxes, const double (*box)[6],
                                     const rm_lid *label, rm_lid num_asking, const double (*asking)[6], rm_lid most,
                                     rm_crowds *out);

/* The boxes that meet crowds of each rank, but for the rank left_out (-1: of all): which[num] of them ask, in order, or the
 * first num if it is NULL. offset is [comm->size + 1], *item, [offset[comm->size]], lives in arena: boxes grouped by rank, in
 * the order in which they ask. Counted in a first walk and listed in a second, so that no more room is taken than there are
 * entries. Not collective. O(num log B) mostly. */
remap_status rm_crowds_list(rm_arena *arena, const rm_comm *comm, const rm_crowds *crowds, int left_out, rm_lid num,
                            const rm_lid *which, const double (*box)[6], int64_t *offset, rm_lid **item);

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
