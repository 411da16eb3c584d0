/* integrals -- volume, centroid and second moments of every cell with triangulated faces, to the last bits and from coordinates
 * alone.
 *
 * A cell is the sum of the tetrahedra that its triangles span with the centre of its box. Each triangle's corners are put in
 * the order of their coordinates, its determinant is taken in double-double, and the terms are added in bins: exactly, hence in
 * any order (Rump, Ogita and Oishi 2008; Demmel and Nguyen 2015). Where the volume is so small beside the box that this could
 * not vouch for 50 bits (a flat cell), volume and centroid are summed without any rounding. Second moments are those of the
 * tetrahedra that the triangles span with the centroid.
 * About 0.1 us per triangle, 0.2 us more for second moments; scratch memory for the largest cell. */
#include "geom/expansion.h"
#include "mesh/mesh_private.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* A triangle whose corners ascend; sign is -1 if they then run against the outer normal. */
typedef struct triangle {
  double p[3][3];
  double sign;
} triangle;

/* Room for the largest cell. */
typedef struct workspace {
  double (*loop_xyz)[3]; /* [corners of the largest face] */
  int      *corner, *work;
  triangle *triangle; /* [triangles of the largest cell] */
  double   *volume;   /* [2 triangles] terms of 6 V */
  double   *moment;   /* [2 triangles] terms of 24 M along one axis, or of 120 S along two */
} workspace;

typedef struct vec {
  double x[3];
} vec;

/* ---- arithmetic -------------------------------------------------------------------------------------------------------- */

/* Sum of n <= 2^spare doubles, which does not depend on their order; error below 2^(4 spare - 156) max |x| and its rounding. x
 * is used up. Three bins: each takes the bits of all numbers above its last place, so that their sum is exact. */
static double sum_binned(double *x, int64_t n)
{
  double largest = 0.0, bin[3] = {0.0, 0.0, 0.0};
  rm_dd  high;
  int    exponent, spare = 1;

  for (int64_t i = 0; i < n; i++)
    if (fabs(x[i]) > largest) largest = fabs(x[i]);
  if (largest == 0.0) return 0.0;
  while (((int64_t)1 << spare) < n) spare++;
  frexp(largest, &exponent);
  for (int b = 0; b < 3; b++) {
    const double big = ldexp(1.5, exponent + spare);

    for (int64_t i = 0; i < n; i++) {
      const double part = (x[i] + big) - big;

      bin[b] += part;
      x[i] -= part;
    }
    exponent += spare - 52;
  }
  high = rm_two_sum(bin[0], bin[1]);
  return high.hi + (high.lo + bin[2]);
}

/* ---- triangles of a cell ------------------------------------------------------------------------------------------------- */

static bool less(const double a[3], const double b[3])
{
  return a[0] != b[0] ? a[0] < b[0] : a[1] != b[1] ? a[1] < b[1] : a[2] < b[2];
}

static triangle ordered(const double *a, const double *b, const double *c, double sign)
{
  const double *swap;
  triangle      t;

#define RM_ORDER(u, v) \
  if (less(v, u)) swap = u, u = v, v = swap, sign = -sign
  RM_ORDER(a, b);
  RM_ORDER(b, c);
  RM_ORDER(a, b);
#undef RM_ORDER
  memcpy(t.p[0], a, sizeof t.p[0]);
  memcpy(t.p[1], b, sizeof t.p[1]);
  memcpy(t.p[2], c, sizeof t.p[2]);
  t.sign = sign;
  return t;
}

/* The triangles of a cell's faces into w->triangle; returns how many. */
static int64_t collect(const rm_mesh *mesh, remap_faces faces, rm_lid cell, workspace *w)
{
  int64_t num = 0;

  for (int64_t i = mesh->cell_face_offset[cell]; i < mesh->cell_face_offset[cell + 1]; i++) {
    const rm_lid  f    = mesh->cell_face[i];
    const rm_lid *loop = mesh->face_node + mesh->face_offset[f];
    const int     n    = (int)(mesh->face_offset[f + 1] - mesh->face_offset[f]);
    const double  sign = mesh->face_cell[f][0] == cell ? 1.0 : -1.0;
    double        centre[3];
    int           found;

    for (int k = 0; k < n; k++) memcpy(w->loop_xyz[k], mesh->node_xyz[loop[k]], sizeof w->loop_xyz[k]);
    found = rm_triangulate((const double(*)[3])w->loop_xyz, n, faces, w->corner, centre, w->work);
    for (int t = 0; t < found; t++) {
      const double *corner[3];

      for (int k = 0; k < 3; k++)
        corner[k] = w->corner[3 * t + k] == RM_CENTRE_POINT ? centre : w->loop_xyz[w->corner[3 * t + k]];
      w->triangle[num++] = ordered(corner[0], corner[1], corner[2], sign);
    }
  }
  return num;
}

/* ---- the two ways -------------------------------------------------------------------------------------------------------- */

/* Terms of 24 M along one axis, from those of 6 V: w times the sum of the corners from o. If all w have one sign, their
 * products add up without cancellation and rounded ones will do; else they are kept in double-double. Returns how many there
 * are. */
static int64_t moment_terms(const triangle *list, int64_t num, const double *volume, double o, int axis, bool one_sign,
                            double *out)
{
  for (int64_t i = 0; i < num; i++) {
    const triangle *t = &list[i];
    const double    w = volume[2 * i];

    if (one_sign) {
      out[i] = w * ((t->p[0][axis] - o) + (t->p[1][axis] - o) + (t->p[2][axis] - o));
    } else {
      const rm_dd  u = rm_two_sum(t->p[0][axis], -o), v = rm_two_sum(t->p[1][axis], -o), x = rm_two_sum(t->p[2][axis], -o);
      const rm_dd  uv = rm_two_sum(u.hi, v.hi), sum = rm_two_sum(uv.hi, x.hi), product = rm_two_product(w, sum.hi);
      const double rest = (uv.lo + sum.lo) + (u.lo + v.lo + x.lo);

      out[2 * i]     = product.hi;
      out[2 * i + 1] = product.lo + (w * rest + volume[2 * i + 1] * sum.hi);
    }
  }
  return one_sign ? num : 2 * num;
}

/* 6 V and 24 M about o, rounded at the end. */
static double sum_about(const double o[3], int64_t num, workspace *w, vec *moment)
{
  int64_t num_negative = 0, num_positive = 0;

  for (int64_t i = 0; i < num; i++) {
    const triangle *t = &w->triangle[i];
    const rm_dd     d = rm_det_dd(o, t->p[0], t->p[1], t->p[2]);

    w->volume[2 * i]     = t->sign * d.hi;
    w->volume[2 * i + 1] = t->sign * d.lo;
    num_negative += w->volume[2 * i] < 0.0;
    num_positive += w->volume[2 * i] > 0.0;
  }
  for (int a = 0; a < 3; a++) {
    const bool one_sign = num_negative == 0 || num_positive == 0;

    moment->x[a] = sum_binned(w->moment, moment_terms(w->triangle, num, w->volume, o[a], a, one_sign, w->moment));
  }
  return sum_binned(w->volume, 2 * num);
}

/* Add sign * x y z, and times each of the corners' coordinates to their moments, exactly. */
static void add_exact(rm_sum *volume, rm_sum moment[3], const triangle *t, double sign, double x, double y, double z)
{
  const rm_dd  xy   = rm_two_product(sign * x, y);
  const rm_dd  high = rm_two_product(xy.hi, z), low = rm_two_product(xy.lo, z);
  const double part[4] = {high.hi, high.lo, low.hi, low.lo};

  for (int i = 0; i < 4; i++) {
    rm_sum_add(volume, part[i]);
    for (int k = 0; k < 3; k++)
      for (int a = 0; a < 3; a++) rm_sum_add_product(&moment[a], part[i], t->p[k][a]);
  }
}

/* 6 V and 24 M about the coordinates' origin, exact and rounded once. */
static double sum_exactly(int64_t num, const triangle *list, vec *moment)
{
  rm_sum volume, sum[3];

  rm_sum_clear(&volume);
  for (int a = 0; a < 3; a++) rm_sum_clear(&sum[a]);
  for (int64_t i = 0; i < num; i++) {
    const triangle *t = &list[i];

    for (int k = 0; k < 3; k++) { /* the determinant's six products */
      const int x = k, y = (k + 1) % 3, z = (k + 2) % 3;

      add_exact(&volume, sum, t, t->sign, t->p[0][x], t->p[1][y], t->p[2][z]);
      add_exact(&volume, sum, t, -t->sign, t->p[0][x], t->p[1][z], t->p[2][y]);
    }
  }
  for (int a = 0; a < 3; a++) moment->x[a] = rm_sum_value(&sum[a]);
  return rm_sum_value(&volume);
}

static void integrate(const double box[6], int64_t num, workspace *w, double *volume, double centroid[3])
{
  double o[3], half[3], bound, six;
  vec    moment;

  for (int a = 0; a < 3; a++) {
    o[a]    = 0.5 * (box[a] + box[a + 3]);
    half[a] = box[a + 3] - o[a];
  }
  /* Terms of one determinant stay below 6 half x half y half z, double-double keeps 95 bits of them. */
  bound = 6.0 * half[0] * half[1] * half[2] * (double)num;
  six   = sum_about(o, num, w, &moment);
  if (fabs(six) < 0x1p-40 * bound) {
    o[0] = o[1] = o[2] = 0.0;
    six                = sum_exactly(num, w->triangle, &moment);
  }
  *volume = six / 6.0;
  for (int a = 0; a < 3; a++) centroid[a] = six == 0.0 ? 0.5 * (box[a] + box[a + 3]) : o[a] + moment.x[a] / (4.0 * six);
}

/* ---- second moments ------------------------------------------------------------------------------------------------------ */

/* Terms of 120 S along axes x and y, from those of 6 V: w times the sum over corners of x y plus the product of the sums of x
 * and of y, both from o. In double-double: products off the diagonal cancel. Returns how many there are. */
static int64_t second_terms(const triangle *list, int64_t num, const double *volume, const double o[3], int x, int y,
                            double *out)
{
  for (int64_t i = 0; i < num; i++) {
    const triangle *t      = &list[i];
    rm_dd           sum[2] = {{0.0, 0.0}, {0.0, 0.0}}, total = {0.0, 0.0};

    for (int k = 0; k < 3; k++) {
      const rm_dd u = rm_two_sum(t->p[k][x], -o[x]), v = rm_two_sum(t->p[k][y], -o[y]);

      sum[0] = rm_dd_add(sum[0], u);
      sum[1] = rm_dd_add(sum[1], v);
      total  = rm_dd_add(total, rm_dd_mul(u, v));
    }
    total          = rm_dd_mul(rm_dd_add(total, rm_dd_mul(sum[0], sum[1])), (rm_dd){volume[2 * i], volume[2 * i + 1]});
    out[2 * i]     = total.hi;
    out[2 * i + 1] = total.lo;
  }
  return 2 * num;
}

static void integrate_second(const double centroid[3], int64_t num, workspace *w, double second[6])
{
  for (int64_t i = 0; i < num; i++) {
    const triangle *t = &w->triangle[i];
    const rm_dd     d = rm_det_dd(centroid, t->p[0], t->p[1], t->p[2]);

    w->volume[2 * i]     = t->sign * d.hi;
    w->volume[2 * i + 1] = t->sign * d.lo;
  }
  for (int k = 0; k < 6; k++) {
    const int64_t n = second_terms(w->triangle, num, w->volume, centroid, rm_row_of[k], rm_column_of[k], w->moment);

    second[k] = sum_binned(w->moment, n) / 120.0;
  }
}

/* ---- all cells ----------------------------------------------------------------------------------------------------------- */

static remap_status make_workspace(rm_arena *scratch, const rm_mesh *mesh, workspace *w)
{
  int64_t corners = 3, triangles = 1;

  for (rm_lid f = 0; f < mesh->num_faces; f++)
    if (mesh->face_offset[f + 1] - mesh->face_offset[f] > corners) corners = mesh->face_offset[f + 1] - mesh->face_offset[f];
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    int64_t num = 0;

    for (int64_t i = mesh->cell_face_offset[c]; i < mesh->cell_face_offset[c + 1]; i++)
      num += mesh->face_offset[mesh->cell_face[i] + 1] - mesh->face_offset[mesh->cell_face[i]] + 2;
    if (num > triangles) triangles = num;
  }
  RM_NEW(w->loop_xyz, scratch, corners);
  RM_NEW(w->corner, scratch, 3 * (corners + 2));
  RM_NEW(w->work, scratch, 4 * corners);
  RM_NEW(w->triangle, scratch, triangles);
  RM_NEW(w->volume, scratch, 2 * triangles);
  RM_NEW(w->moment, scratch, 2 * triangles);
  return REMAP_OK;
}

remap_status rm_mesh_integrals(rm_arena *scratch, const rm_mesh *mesh, remap_faces faces, double *volume, double (*centroid)[3])
{
  workspace w;

  RM_TRY(make_workspace(scratch, mesh, &w));
  for (rm_lid c = 0; c < mesh->num_cells; c++)
    integrate(mesh->cell_box[c], collect(mesh, faces, c, &w), &w, &volume[c], centroid[c]);
  return REMAP_OK;
}

remap_status rm_mesh_second(rm_arena *arena, const rm_mesh *mesh, remap_faces faces, const double (**out)[6])
{
  rm_arena    *scratch    = rm_arena_new();
  double(*second)[6]      = rm_arena_alloc(arena, mesh->num_cells, sizeof *second);
  remap_status status     = scratch && second ? REMAP_OK : REMAP_NO_MEMORY;
  workspace    w;

  if (status == REMAP_OK) status = make_workspace(scratch, mesh, &w);
  for (rm_lid c = 0; c < mesh->num_cells && status == REMAP_OK; c++)
    integrate_second(mesh->cell_centroid[c], collect(mesh, faces, c, &w), &w, second[c]);
  rm_arena_drop(scratch);
  if (status == REMAP_OK) *out = (const double(*)[6])second;
  return status;
}
