/* geom_private -- what the files of geom share besides the error-free transformations (expansion.h) and exact integers. */
#ifndef RM_GEOM_PRIVATE_H
#define RM_GEOM_PRIVATE_H

#include "geom/geom.h"

static inline int rm_sign(double x) { return (x > 0) - (x < 0); }

static inline bool rm_same_point(const double a[3], const double b[3]) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }

/* Exact sign of (a1 - a0) x (b1 - b0) on the first axis where it is not zero, x before y before z; 0 if the vector is zero. */
int rm_first_cross_sign(const double a0[3], const double a1[3], const double b0[3], const double b1[3]);

#endif
