/* views -- what tests ask of the faces of a supermesh as remap_supermesh hands it out. */
#ifndef VIEWS_H
#define VIEWS_H

#include <remap/remap.h>

/* Twice the area vector of a face. */
static inline void view_area_vector(const remap_supermesh_view *v, int64_t f, double out[3])
{
  const int32_t *node = v->face_node + v->face_offset[f];
  const double  *o    = v->node_xyz + 3 * (int64_t)node[0];

  out[0] = out[1] = out[2] = 0;
  for (int64_t k = 1; k + 1 < v->face_offset[f + 1] - v->face_offset[f]; k++) {
    double a[3], b[3];
    for (int c = 0; c < 3; c++)
      a[c] = v->node_xyz[3 * (int64_t)node[k] + c] - o[c], b[c] = v->node_xyz[3 * (int64_t)node[k + 1] + c] - o[c];
    for (int c = 0; c < 3; c++) out[c] += a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
  }
}
#endif
