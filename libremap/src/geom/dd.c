/* dd -- a determinant in double-double. About 250 floating-point operations (30 ns), no branches. */
#include "geom/expansion.h"

rm_dd rm_det_dd(const double o[3], const double a[3], const double b[3], const double c[3])
{
  rm_dd u[3], v[3], w[3], normal[3];

  for (int k = 0; k < 3; k++) {
    u[k] = rm_two_diff(a[k], o[k]);
    v[k] = rm_two_diff(b[k], o[k]);
    w[k] = rm_two_diff(c[k], o[k]);
  }
  rm_dd_cross(v, w, normal);
  return rm_dd_dot(u, normal);
}
