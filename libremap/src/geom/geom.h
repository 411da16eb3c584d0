/* geom -- exact signs, face triangulation, integrals over tetrahedra. Pure: no allocation, no mesh, no state.
 *
 * Signs are exact for coordinates that are 0 or of magnitude 2^-100..2^10 (rm_mesh brings them there): a static or dynamic
 * filter decides nearly always, double-double and integers of fixed capacity (exact.h) the rest. Shared vertices, axis-parallel
 * differences and coordinates on a common grid are answered in a few nanoseconds. Needs round-to-nearest IEEE doubles and no
 * contraction: rm_geom_selftest() verifies both.
 *
 * Simulation of simplicity (DESIGN 2.2): mesh 2 is thought translated by (e, e^2, e^3). `moved` says which operand belongs to
 * the translated mesh: +1 the triangle's (the edge is of mesh 1), -1 the edge's or point's (it is of mesh 2). */
#ifndef RM_GEOM_H
#define RM_GEOM_H

#include "base/base.h"

/* True if error-free transformations work as compiled and as the processor rounds now. */
bool rm_geom_selftest(void);

/* ---- exact signs: -1, 0, +1 ------------------------------------------------------------------------------------- */

/* Sign of det[b - a, c - a, d - a], no simulation of simplicity. */
int rm_orient3d(const double a[3], const double b[3], const double c[3], const double d[3]);

/* Sign of component `axis` of (a1 - a0) x (b1 - b0), likewise. */
int rm_cross_sign(const double a0[3], const double a1[3], const double b0[3], const double b1[3], int axis);

/* Side of point p against the triangle's plane: sign of n.(p - t0), n = (t1 - t0) x (t2 - t0); if zero, -moved times the first
 * non-zero component of n; 0 only if n = 0. *degenerate (may be NULL) is set if the determinant itself was zero. */
int rm_point_side(const double t0[3], const double t1[3], const double t2[3], const double p[3], int moved, bool *degenerate);

/* Side of edge p0p1's line against edge f0f1: sign of det[u, f0 - p0, v], u = p1 - p0, v = f1 - f0; if zero, moved times the
 * first non-zero component of v x u; 0 only if the edges are parallel and coplanar with nothing to decide by (v x u = 0).
 * For a triangle (t0,t1,t2) crossed by the line along its normal all three of (t0t1), (t1t2), (t2t0) give +1. */
int rm_edge_side(const double p0[3], const double p1[3], const double f0[3], const double f1[3], int moved, bool *degenerate);

/* Order of the crossings of edge p0p1's line with the planes of triangles s and t, neither parallel to it after simulation of
 * simplicity: -1 if s is met before t going p0 -> p1, +1 after, 0 if they are met together even so (same plane along the line).
 * The exact values compared are (n.(q - p0) + moved n.d) / (n.u), d = (e, e^2, e^3). Exact; may be slow. */
int rm_crossing_order(const double p0[3], const double p1[3], const double s[3][3], const double t[3][3], int moved);

/* ---- values, correctly signed and accurate, canonical in their operands ------------------------------------------ */

/* Parameter of the crossing of edge p0p1 with the triangle's plane, n.(t0 - p0) / (n.u), n.u != 0: relative error of both
 * numerator and denominator at most 2^-50 (evaluated further in double-double when cancellation demands), clamped to [0, 1].
 * A function of the coordinates alone. */
double rm_crossing_parameter(const double p0[3], const double p1[3], const double t0[3], const double t1[3],
                             const double t2[3]);

/* ---- triangulation of a face (DESIGN 2.1) ------------------------------------------------------------------------ */

enum { RM_CENTRE_POINT = -1 }; /* stands for the mean of the face's vertices in a triangle's corner list */

/* Triangles of a polygon by its vertices' coordinates alone: the result, as a set of triangles in space, does not depend on
 * where the loop starts or which way it runs, and its boundary is the loop, edge by edge. xyz is [n][3]. Of points repeated
 * bitwise: one in a row stays, spikes (b c b) drop out, and where the loop comes back to a point otherwise it is cut into parts
 * of distinct points, each triangulated as a face of its own (or all by one fan). corner, room for 3 (n + 2) ints, receives
 * indices into xyz or RM_CENTRE_POINT, three per triangle, oriented as the input loop; centre receives the mean when it is
 * used. work is scratch of at least 4 n ints. Returns the number of triangles, 0 if no part of 3 vertices is left.
 * Triangle: itself. Exactly coplanar face, or faces == DIAGONAL: as few triangles as possible, shorter diagonal first, ties by
 * coordinates, ears cut off in canonical order where the polygon is concave. CENTRE: fan about the mean, summed in canonical
 * order; if one triangle of the fan runs against the face's area vector or the mean is a vertex, ears as above; if no ear is
 * left, a fan from the canonical first vertex. O(n^2) worst case, O(n) for quadrangles; no triangle has a corner twice. */
int rm_triangulate(const double (*xyz)[3], int n, remap_faces faces, int *corner, double centre[3], int *work);

/* True if the points lie in one plane and their loop is the boundary of a convex polygon; straight angles are allowed, repeated
 * points are not. Exact. rm_triangulate makes n - 2 triangles of it, all with area and of the loop's orientation, without the
 * mean. O(n); 10 ns where the fourth point is off the plane. */
bool rm_is_planar_convex(const double (*xyz)[3], int n);

/* ---- symmetric matrices ------------------------------------------------------------------------------------------- */

/* Rows and columns of the six numbers of one, as second moments are kept everywhere: xx, yy, zz, xy, xz, yz. */
static const int rm_row_of[6] = {0, 1, 2, 0, 0, 1}, rm_column_of[6] = {0, 1, 2, 1, 2, 2};

/* ---- double-double ------------------------------------------------------------------------------------------------ */

typedef struct rm_dd { double hi, lo; } rm_dd;
/* det[a - o, b - o, c - o] with relative error 2^-95 of the sum of absolute terms: the differences are exact. */
rm_dd rm_det_dd(const double o[3], const double a[3], const double b[3], const double c[3]);

#endif
