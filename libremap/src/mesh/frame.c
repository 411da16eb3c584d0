/* frame -- the scale and the box that both meshes and all ranks share, and keys along the Morton curve in it. One pass over the
 * corners, two reductions, no memory. */
#include "mesh/mesh_private.h"

#include <math.h>

double rm_mesh_to_frame(double x, double scale)
{
  const double y = x * scale;

  return fabs(y) < 0x1p-100 ? 0.0 : y; /* -0 too */
}

/* Widen high = {-min x, -min y, -min z, max x, max y, max z} by the nodes that faces of one mesh use. */
static remap_status widen(remap_side side, const remap_mesh *given, rm_gid first_global, double high[6], rm_reason *reason)
{
  for (int64_t f = 0; f < given->num_faces; f++)
    for (int64_t k = given->face_offset[f]; k < given->face_offset[f + 1]; k++) {
      const double *xyz = given->node_xyz + 3 * given->face_node[k];

      if (!isfinite(xyz[0]) || !isfinite(xyz[1]) || !isfinite(xyz[2]))
        return rm_fail(REMAP_BAD_MESH, reason, (int)side, rm_mesh_global_of(given, first_global, given->face_owner[f]),
                       "node %lld of its face %lld lies at (%g, %g, %g): give finite coordinates",
                       (long long)given->face_node[k], (long long)f, xyz[0], xyz[1], xyz[2]);
      for (int a = 0; a < 3; a++) {
        if (-xyz[a] > high[a]) high[a] = -xyz[a];
        if (xyz[a] > high[a + 3]) high[a + 3] = xyz[a];
      }
    }
  return REMAP_OK;
}

remap_status rm_frame_extent(const rm_comm *comm, remap_side side, const remap_mesh *given, double extent[6], rm_reason *reason)
{
  rm_gid       first_global;
  remap_status status;

  for (int i = 0; i < 6; i++) extent[i] = -INFINITY;
  RM_TRY(rm_mesh_first_global(comm, given, &first_global));
  status = rm_mesh_given_check(side, given, first_global, reason);
  if (status == REMAP_OK) status = widen(side, given, first_global, extent, reason);
  RM_TRY(rm_comm_agree_reason(comm, status, reason));
  return rm_comm_max_f64(comm, extent, 6);
}

void rm_frame_of(const double extent[2][6], rm_frame *out)
{
  double   high[6], largest = 0.0;
  rm_frame frame = {1.0, {0}};

  for (int i = 0; i < 6; i++) high[i] = fmax(extent[0][i], extent[1][i]);
  if (-high[0] <= high[3]) { /* there are nodes */
    int exponent = 0;

    for (int i = 0; i < 6; i++) largest = fmax(largest, fabs(high[i]));
    if (largest > 0.0) frexp(largest, &exponent);
    frame.scale = ldexp(1.0, exponent < -1023 ? 1023 : -exponent); /* a mesh of subnormal size stays small in its frame */
    for (int a = 0; a < 3; a++) {
      frame.box[a]     = rm_mesh_to_frame(-high[a], frame.scale);
      frame.box[a + 3] = rm_mesh_to_frame(high[a + 3], frame.scale);
    }
  }
  *out = frame;
}

remap_status rm_frame_build(const rm_comm *comm, const remap_mesh mesh[2], rm_frame *out, rm_reason *reason)
{
  double extent[2][6];

  for (int s = 0; s < 2; s++) RM_TRY(rm_frame_extent(comm, (remap_side)s, &mesh[s], extent[s], reason));
  rm_frame_of((const double(*)[6])extent, out);
  return REMAP_OK;
}

/* The 21 low bits of x, two zeros after each. */
static uint64_t spread(uint64_t x)
{
  x = (x | x << 32) & UINT64_C(0x001f00000000ffff);
  x = (x | x << 16) & UINT64_C(0x001f0000ff0000ff);
  x = (x | x << 8) & UINT64_C(0x100f00f00f00f00f);
  x = (x | x << 4) & UINT64_C(0x10c30c30c30c30c3);
  return (x | x << 2) & UINT64_C(0x1249249249249249);
}

uint64_t rm_morton(const rm_frame *frame, const double xyz[3])
{
  const double *box = frame->box, steps = 0x1p21;
  double        extent = 0.0; /* of a cube around the box, so that the curve's cells are cubes too */
  uint64_t      key    = 0;

  for (int a = 0; a < 3; a++) extent = fmax(extent, box[a + 3] - box[a]);
  if (!(extent > 0.0)) return 0;
  for (int a = 0; a < 3; a++) {
    const double at = (xyz[a] - box[a]) / extent * steps;

    key |= spread(at >= steps ? ((uint64_t)1 << 21) - 1 : at > 0.0 ? (uint64_t)at : 0) << a;
  }
  return key;
}
