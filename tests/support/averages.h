/* averages -- smooth and discontinuous fields, their means over the cells of a mesh, and the errors of a transfer.
 *
 * A cell is integrated as the library sees it: its faces triangulated by rm_triangulate, a tetrahedron over each triangle from
 * a point inside, and in each tetrahedron a rule of degree 5 with 14 points (Walkington 2000). 0.7 us per triangle and
 * field. */
#ifndef AVERAGES_H
#define AVERAGES_H

#include "geom/geom.h"
#include "meshes.h"

typedef double av_field(const double x[3]);

static inline double av_constant(const double x[3]) { return (void)x, 1.7; }
static inline double av_linear(const double x[3]) { return 0.3 + 1.7 * x[0] - 0.6 * x[1] + 0.9 * x[2]; }
static inline double av_quadratic(const double x[3])
{
  return 1 + x[0] - 0.4 * x[1] + x[0] * x[0] - 0.7 * x[1] * x[1] + 0.5 * x[2] * x[2] + x[0] * x[1] - 1.3 * x[1] * x[2] +
         0.2 * x[0] * x[2];
}
static inline double av_trig(const double x[3])
{
  return 2 + sin(2 * M_PI * x[0]) * sin(2 * M_PI * x[1]) * sin(2 * M_PI * x[2]);
}
static inline double av_gauss(const double x[3])
{
  const double d[3] = {x[0] - 0.5, x[1] - 0.5, x[2] - 0.5};

  return exp(-20 * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
}
static inline double av_franke(const double p[3])
{
  const double x = 9 * p[0], y = 9 * p[1], z = 9 * p[2];

  return 0.75 * exp(-((x - 2) * (x - 2) + (y - 2) * (y - 2) + (z - 2) * (z - 2)) / 4) +
         0.75 * exp(-(x + 1) * (x + 1) / 49 - (y + 1) / 10 - (z + 1) / 10) +
         0.5 * exp(-((x - 7) * (x - 7) + (y - 3) * (y - 3) + (z - 5) * (z - 5)) / 4) -
         0.2 * exp(-(x - 4) * (x - 4) - (y - 7) * (y - 7) - (z - 5) * (z - 5));
}
/* 1 inside a ball about the middle, 0 outside. */
static inline double av_sphere(const double x[3])
{
  const double d[3] = {x[0] - 0.5, x[1] - 0.5, x[2] - 0.5};

  return d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < 0.09;
}

typedef struct av_named {
  const char *name;
  av_field   *of;
  bool        is_smooth;
} av_named;
static const av_named av_fields[] = {
    {"constant", av_constant, true}, {"linear", av_linear, true}, {"quadratic", av_quadratic, true}, {"trig", av_trig, true},
    {"gauss", av_gauss, true},       {"franke", av_franke, true}, {"sphere", av_sphere, false}};
enum { AV_CONSTANT, AV_LINEAR, AV_QUADRATIC, AV_TRIG, AV_GAUSS, AV_FRANKE, AV_SPHERE, AV_NUM };

/* Integral of a field over the tetrahedron p[0..3], signed volume 6 V given. */
static inline double av_tetrahedron_(const double p[4][3], double six, av_field *f)
{
  static const double a[3] = {0.31088591926330060980, 0.092735250310891226402, 0.045503704125649649492};
  static const double w[3] = {0.11268792571801585080, 0.073493043116361949544, 0.042546020777081466438};
  double              sum  = 0;

  for (int k = 0; k < 14; k++) {
    static const int pair[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
    const int        kind       = k < 4 ? 0 : k < 8 ? 1 : 2;
    double           x[3]       = {0, 0, 0};

    for (int c = 0; c < 4; c++) {
      const double b = kind < 2 ? (c == k % 4 ? 1 - 3 * a[kind] : a[kind])
                                : (c == pair[k - 8][0] || c == pair[k - 8][1] ? a[2] : 0.5 - a[2]);

      for (int d = 0; d < 3; d++) x[d] += b * p[c][d];
    }
    sum += w[kind] * f(x);
  }
  return sum * six / 6;
}

/* Volumes [num_cells] and means [num_fields][num_cells] of the cells of a mesh; the caller's arrays. */
static inline void av_means(const tm_mesh *mesh, remap_faces faces, int num_fields, av_field *const *field, double *volume,
                            double *const *mean)
{
  const remap_mesh *m    = &mesh->view;
  int64_t           most = 3;

  for (int64_t f = 0; f < m->num_faces; f++)
    if (m->face_offset[f + 1] - m->face_offset[f] > most) most = m->face_offset[f + 1] - m->face_offset[f];
  double(*loop)[3]  = tm_alloc_(most, sizeof *loop);
  double(*inner)[4] = tm_alloc_(m->num_cells, sizeof *inner); /* a point inside each cell, and how many made it */
  int *corner = tm_alloc_(3 * (most + 2), sizeof *corner), *work = tm_alloc_(4 * most, sizeof *work);

  for (int64_t f = 0; f < m->num_faces; f++)
    for (int side = 0; side < 2; side++) {
      const int64_t cell = side ? m->face_neighbour[f] : m->face_owner[f];

      for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1] && cell >= 0; k++) {
        for (int d = 0; d < 3; d++) inner[cell][d] += m->node_xyz[3 * m->face_node[k] + d];
        inner[cell][3] += 1;
      }
    }
  for (int64_t c = 0; c < m->num_cells; c++) {
    volume[c] = 0;
    for (int q = 0; q < num_fields; q++) mean[q][c] = 0;
  }
  for (int64_t f = 0; f < m->num_faces; f++) {
    const int n = (int)(m->face_offset[f + 1] - m->face_offset[f]);
    double    centre[3];

    for (int k = 0; k < n; k++) memcpy(loop[k], m->node_xyz + 3 * m->face_node[m->face_offset[f] + k], sizeof *loop);
    const int found = rm_triangulate((const double(*)[3])loop, n, faces, corner, centre, work);
    for (int t = 0; t < found; t++)
      for (int side = 0; side < 2; side++) {
        const int64_t cell = side ? m->face_neighbour[f] : m->face_owner[f];
        double        p[4][3], e[3][3];

        if (cell < 0) continue;
        for (int d = 0; d < 3; d++) p[0][d] = inner[cell][d] / inner[cell][3];
        for (int k = 0; k < 3; k++)
          memcpy(p[k + 1], corner[3 * t + k] == RM_CENTRE_POINT ? centre : loop[corner[3 * t + k]], sizeof *p);
        for (int k = 0; k < 3; k++)
          for (int d = 0; d < 3; d++) e[k][d] = p[k + 1][d] - p[0][d];
        const double six = (side ? -1 : 1) * (e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) +
                                              e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
                                              e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]));
        volume[cell] += six / 6;
        for (int q = 0; q < num_fields; q++) mean[q][cell] += av_tetrahedron_((const double(*)[3])p, six, field[q]);
      }
  }
  for (int64_t c = 0; c < m->num_cells; c++)
    for (int q = 0; q < num_fields; q++) mean[q][c] /= volume[c];
  free(loop), free(inner), free(corner), free(work);
}

/* Norms of the difference of two fields, weighted with volume. */
typedef struct av_error {
  double l1, l2, linf;
} av_error;
static inline av_error av_difference(int64_t n, const double *volume, const double *got, const double *want)
{
  double l1 = 0, l2 = 0, linf = 0, total = 0;

  for (int64_t c = 0; c < n; c++) {
    const double e = fabs(got[c] - want[c]);

    l1 += e * volume[c], l2 += e * e * volume[c], total += volume[c];
    linf = fmax(linf, e);
  }
  return (av_error){l1 / total, sqrt(l2 / total), linf};
}

/* ---- kinds of meshes ------------------------------------------------------------------------------------------------- */

typedef enum av_kind { AV_HEXAHEDRA, AV_TETRAHEDRA, AV_DUAL, AV_MIXED, AV_NUM_KINDS } av_kind;
static const char *const av_kind_name[] = {"hexahedra", "tetrahedra", "dual", "mixed"};

/* Meshes of the unit cube on a lattice of n^3, warped by `size` but for its walls; tetrahedra and duals, which have more faces,
 * of one half as fine. */
static inline tm_mesh *av_mesh(av_kind kind, int n, double size)
{
  const int        h       = n / 2 + n % 2;
  const tm_warping warping = {size, 0};

  switch (kind) {
    case AV_TETRAHEDRA: return tm_tetrahedra((int[]){h, h, h}, tm_warp, &warping);
    case AV_DUAL: return tm_dual((int[]){h, h, h}, tm_warp, &warping);
    case AV_MIXED: return tm_mixed((int[]){n, n, n}, tm_warp, &warping);
    default: return tm_hexahedra((int[]){n, n, n}, tm_warp, &warping);
  }
}
#endif
