/* order -- the canonical order of cells, in which every sum over cells runs. A radix sort by Morton key, then a comparison of
 * whole cells within runs of equal keys, which are short unless cells are smaller than 2^-21 of the frame's box. O(n) time, 32
 * bytes per cell. */
#include "mapping.h"

#include <stdlib.h>

/* What the comparison looks at, gathered so that qsort needs nothing else. */
typedef struct whole_cell {
  double  centroid[3], volume;
  rm_gid  global;
  int64_t place;
} whole_cell;

static int compare_cells(const void *first, const void *second)
{
  const whole_cell *a = first, *b = second;

  for (int d = 0; d < 3; d++)
    if (a->centroid[d] != b->centroid[d]) return a->centroid[d] < b->centroid[d] ? -1 : 1;
  if (a->volume != b->volume) return a->volume < b->volume ? -1 : 1;
  return (a->global > b->global) - (a->global < b->global);
}

remap_status rm_canonical_order(rm_arena *scratch, const rm_frame *frame, int64_t n, const double (*centroid)[3],
                                const double *volume, const rm_gid *global, rm_lid *order)
{
  int64_t     longest = 0;
  rm_keyed   *keyed, *spare;
  whole_cell *run;

  RM_NEW(keyed, scratch, n);
  RM_NEW(spare, scratch, n);
  for (int64_t k = 0; k < n; k++) keyed[k] = (rm_keyed){rm_morton(frame, centroid[k]), k};
  rm_sort_keyed(keyed, spare, n);
  for (int64_t first = 0, end; first < n; first = end) {
    for (end = first + 1; end < n && keyed[end].key == keyed[first].key; end++) {
    }
    if (end - first > longest) longest = end - first;
  }
  RM_NEW(run, scratch, longest);
  for (int64_t first = 0, end; first < n; first = end) {
    for (end = first; end < n && keyed[end].key == keyed[first].key; end++) {
      const int64_t k = keyed[end].item;

      run[end - first] = (whole_cell){{centroid[k][0], centroid[k][1], centroid[k][2]}, volume[k], global[k], k};
    }
    if (end - first > 1) qsort(run, (size_t)(end - first), sizeof *run, compare_cells);
    for (int64_t k = first; k < end; k++) order[k] = (rm_lid)run[k - first].place;
  }
  return REMAP_OK;
}
