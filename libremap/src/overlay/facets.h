/* facets -- which triangles of a piece stay together as one facet, for trimesh.c. A planar convex face that is not in the skin
 * of the whole mesh is *whole*: its triangles are one facet on each side where they bound a cell, and are joined with those of
 * the cell beyond all together or not at all. So a cell's facets depend on nothing but the cell. */
#ifndef RM_FACETS_H
#define RM_FACETS_H

#include <string.h>
#include "overlay/overlay.h"

/* One triangle as part of a face of one cell, before joining. */
typedef struct rm_triple {
  rm_lid  v[3];  /* ascending vertices */
  rm_lid  cell;  /* the cell beside it */
  rm_lid  face;  /* of the piece */
  uint8_t right; /* 1: the cell is on the side the normal points to */
  uint8_t side;  /* of the face, 0 its owner's */
  uint8_t skin;
} rm_triple;

typedef struct rm_facets {
  uint8_t *is_whole; /* [num_faces] the caller's                                                        */
  bool     any;      /* a face is whole                                                                 */
  rm_lid  *beyond;   /* [2 num_faces] face and side that those of a whole one all meet, or none of them */
  rm_lid  *first;    /* [2 num_faces] 2 * (first triangle of a whole one) + (side of its cell), -1      */
  rm_lid  *facet, *next; /* [num_triangles] as the mesh has it                                          */
} rm_facets;

/* Of n triples in order, copies of one triangle side by side, find what meets at whole faces. is_whole has been filled in. The
 * arrays live in scratch. O(n). */
remap_status rm_facets_compare(rm_arena *scratch, rm_facets *facets, rm_lid num_faces, const rm_triple *triple, int64_t n);

/* The end of the copies of triangle i; *opposite if they are two on opposite sides, of two cells. Those of one cell stay apart:
 * they would where a third copy is there too, which another rank need not have, and sums must not depend on that. */
static inline int64_t rm_triple_copies(const rm_triple *triple, int64_t i, int64_t num, bool *opposite)
{
  int64_t k = i + 1;

  while (k < num && !memcmp(triple[k].v, triple[i].v, sizeof triple[i].v)) k++;
  *opposite = k == i + 2 && triple[i].right != triple[i + 1].right && triple[i].cell != triple[i + 1].cell;
  return k;
}

/* Two such copies may be joined; any is true. */
bool rm_facets_admit(const rm_facets *facets, const rm_triple *a, const rm_triple *b);

/* Make room for the facets of n triangles, in the arena of the mesh, and, if any is true, add them one by one, with one or two
 * triples each. */
remap_status rm_facets_open(rm_arena *arena, rm_facets *facets, int64_t n);
void rm_facets_add(rm_facets *facets, const rm_triple *triple, bool joined, rm_lid triangle);

/* Fill in what the mesh says of its facets. It has all the rest but how cells are walked through. O(n). */
remap_status rm_facets_finish(rm_arena *arena, rm_arena *scratch, const rm_facets *facets, rm_trimesh *m);

#endif
