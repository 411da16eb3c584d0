/* mapping -- pairs with their moments in; ancestor tables out, both ways: rows of the target cells at their owners, rows of the
 * source cells at theirs, in canonical order, with coverage and closure. */
#ifndef RM_MAPPING_H
#define RM_MAPPING_H

#include "moments/moments.h"

#include <math.h>

/* Has a cell of this coverage pairs? */
static inline bool rm_is_mapped(uint8_t cover) { return cover == REMAP_PARTIAL || cover == REMAP_COVERED; }

/* The pairs of the cells of one side (the receiving cells), on the rank that handed them in. Read-only once built. Invariants:
 *   a row's pairs ascend by the giving cell's (Morton key of the centroid, centroid, volume, global id);
 *   giver[] points into the halo lists; each (rank, cell) is listed once there, ascending;
 *   same[] of a cell only if its pair is alone in its row and in its partner's row and both cells are covered: then the pair's
 *   volume is this cell's own and its moment is 0. */
typedef struct rm_rows {
  rm_lid         num_cells;    /* receiving cells                                                          */
  const int64_t *offset;       /* [num_cells + 1]                                                          */
  const rm_lid  *giver;        /* [offset[num_cells]] place in the halo of giving cells                    */
  const double  *volume;       /* [offset[num_cells]] V, own frame; of source cells NULL until rm_mapping_complete */
  const double (*moment)[3];   /* [likewise] integral of (x - c), c the GIVING cell's centroid                     */
  const double (*second)[6];   /* [offset[num_cells]] integral of (x - c)(x - c)^T: xx, yy, zz, xy, xz, yz; NULL if the moments
                                  had none                                                                         */
  const rm_lid  *twin;         /* [likewise] of source cells, what the two above are made of: the pair of the target cell, if
                                  that has the same home, or -1 - its place among those that are away              */
  const double  *away_volume, (*away_moment)[3];
  const uint8_t *same;         /* [num_cells]                                                              */
  const uint8_t *cover;        /* [num_cells] remap_cover; UNWANTED only by rm_mapping_mask                */
  const double (*centroid_error)[3]; /* [num_cells] true centroid less rm_mesh's, by which moments about the latter do not add
                                  up to 0: what rounding took, at most 2^-48 of it; 0 where the pairs do not tell it (cells
                                  that are not covered) or nobody needs it (same)                          */
  rm_lid         num_givers;   /* giving cells that this rank needs, from all ranks                        */
  const int     *giver_rank;   /* [num_givers] ascending                                                   */
  const rm_lid  *giver_cell;   /* [num_givers] number on that rank, ascending within a rank                */
  const rm_gid  *giver_global; /* [num_givers]                                                             */
  const double (*giver_centroid)[3]; /* [num_givers]                                                       */
  const rm_plan *plan;         /* brings the givers' values here                                           */
} rm_rows;

typedef struct rm_mapping {
  rm_rows rows[2]; /* [side that receives]: rows[REMAP_TARGET] serves forward, rows[REMAP_SOURCE] backward */
  rm_gid  num_pairs;                 /* over all ranks                                    */
  double  overlap_volume;            /* over all ranks, exact sum rounded once, own frame */
  rm_gid  cells_by_cover[2][3];      /* over all ranks [side][remap_cover]                */
  double  volume_by_cover[2][3];     /* likewise, sums of abs(volume); not those of rm_mapping_mask */
  double  max_closure_error[2];      /* over all ranks, covered cells                     */
  rm_gid  worst_closure_cell[2];     /* its global id (the smallest such), -1 if none     */
} rm_mapping;

/* Pairs where they were made, and on their way home. */
typedef struct rm_gathering rm_gathering;
/* Without pairs yet; with second moments or without. slice: so many pairs of a rank go home at once, or a 16th if that is more.
 * The caller owns it: rm_gathering_drop. NULL if memory is out. Not collective. */
rm_gathering *rm_mapping_open(const rm_mesh *const mesh[2], bool has_second, int64_t slice);
void rm_gathering_drop(rm_gathering *gathering);
/* Add the pairs of a part; part and moments may end then. Every pair is added once, by whichever rank and in whichever call.
 * Not collective. TOO_LARGE, NO_MEMORY. */
remap_status rm_mapping_add(rm_gathering *gathering, const rm_part *part, const rm_moments *moments);
/* Send all pairs that were added home and make rows of them; the gathering then has them no longer. Rows of source cells are
 * without volume and moment. Collective. Lives in arena. A target cell is uncovered without pairs, partial if one of its pairs
 * says SOURCE_SKIN and the pairs leave more of it than 2^-44, else covered; a source cell likewise by TARGET_SKIN. TOO_LARGE if
 * 2^31 or more pairs come to one rank. */
remap_status rm_mapping_close(rm_arena *arena, rm_gathering *gathering, const rm_comm *comm, const rm_frame *frame,
                              const rm_mesh *const mesh[2], const rm_mapping **out, rm_reason *reason);
/* The same mapping with volume and moment of the source cells' rows too, 32 bytes per pair. Not collective. Lives in arena and
 * borrows from mapping. O(pairs). NO_MEMORY. */
remap_status rm_mapping_complete(rm_arena *arena, const rm_mesh *const mesh[2], const rm_mapping *mapping,
                                 const rm_mapping **out);
/* What pair k of a row, that of a cell of this mesh, holds: its volume is returned, with its moment. Where rows lack both, of
 * source cells, back are the rows of the target cells. Not collective. */
double rm_mapping_pair(const rm_rows *rows, const rm_rows *back, const rm_mesh *mesh, rm_lid cell, int64_t k, double moment[3]);
/* All of it, of one part. Collective. Lives in arena. */
remap_status rm_mapping_build(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2],
                              const rm_part *part, const rm_moments *moments, const rm_mapping **out, rm_reason *reason);
/* What a mask says of a cell: it takes no part; it does; it does, but has no pairs. */
enum { RM_MASK_OUT = 0, RM_MASK_IN = 1, RM_MASK_BARE = 2 };

/* A complete mapping with only those pairs whose receiving cell wants values and whose giving cell gives: wants [receiving
 * cells] and gives [giving cells], both RM_MASK_IN. Of the receiving side: cells that are OUT are UNWANTED, without pairs;
 * others lose pairs, and are PARTIAL, or UNCOVERED if none is left. Of the giving side likewise. cells_by_cover counts what is
 * left. Collective. Lives in arena and borrows from mapping. O(pairs). */
remap_status rm_mapping_mask(rm_arena *arena, const rm_comm *comm, const rm_mapping *mapping, remap_side receiving,
                             const uint8_t *wants, const uint8_t *gives, const rm_mapping **out);
/* Every invariant that one rank can see; slow. Not collective. */
remap_status rm_mapping_check(const rm_mapping *mapping, const rm_mesh *const mesh[2]);

/* A sum with compensation (after Neumaier): sum + lost. */
typedef struct rm_compensated {
  double sum, lost;
} rm_compensated;
static inline void rm_compensated_add(rm_compensated *s, double x)
{
  const double next = s->sum + x, added = next - s->sum;

  s->lost += (s->sum - (next - added)) + (x - added); /* what rounding took, exactly and without a branch (Knuth's two-sum) */
  s->sum = next;
}
static inline double rm_compensated_value(const rm_compensated *s) { return s->sum + s->lost; }

/* Sum of a row's volumes, in row order. */
static inline double rm_row_volume(const rm_rows *rows, rm_lid cell)
{
  rm_compensated sum = {0.0, 0.0};

  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++) rm_compensated_add(&sum, rows->volume[k]);
  return rm_compensated_value(&sum);
}

/* Put n cells into canonical order: by the Morton key of the centroid, then centroid, volume and global id, compared in turn;
 * no numbering of a rank takes part. order [n] receives places of the arrays, [n] each. Not collective. Working memory from
 * scratch. NO_MEMORY. O(n). */
remap_status rm_canonical_order(rm_arena *scratch, const rm_frame *frame, int64_t n, const double (*centroid)[3],
                                const double *volume, const rm_gid *global, rm_lid *order);

#endif
