/* quadratic -- the weights of a least-squares quadratic polynomial in one cell.
 *
 * Minimise sum over k of (w_k (g.d_k + H:(d_k d_k^T + Q_k) - du_k))^2, Q_k being the neighbour's mean of (x - c_k)(x - c_k)^T
 * less the cell's own, so that polynomial and data are compared by their means and quadratic fields come out exactly.
 * Everything is done in the axes in which the neighbours spread evenly, q = W d: so neither stretching nor rotation of a mesh
 * matters, and in directions that the neighbours do not span there is neither slope nor curvature. w_k = |q_k|^-4.5, so that
 * near neighbours count more. Columns are scaled to unit length and orthogonalised twice, the longest that is left first; the
 * last one's length tells how well the neighbours determine the polynomial. O(n) time. */
#include "field_private.h"

enum { MOST = 9 };

/* A = Q R, columns in the order of pivots; R of columns scaled to unit length. */
typedef struct factors {
  int    column[MOST];
  double scale[MOST], r[MOST][MOST]; /* r[p][c]: row of pivot p, column c */
} factors;

static const double WELL_CONDITIONED = 0.04; /* the least that a column of unit length may add to those before it */

static double dot_columns(int64_t n, const double (*a)[MOST], int c, int e)
{
  double sum = 0.0;

  for (int64_t k = 0; k < n; k++) sum += a[k][c] * a[k][e];
  return sum;
}

/* Take the part along column `unit`, of length 1, out of column c; that part. */
static double remove_part(int64_t n, double (*a)[MOST], int unit, int c)
{
  const double part = dot_columns(n, (const double(*)[MOST])a, unit, c);

  for (int64_t k = 0; k < n; k++) a[k][c] -= part * a[k][unit];
  return part;
}

/* Factor the first m columns in place, into Q. False if they are not well independent. */
static bool factor(int64_t n, double (*a)[MOST], int m, factors *f)
{
  bool is_used[MOST] = {false};

  for (int c = 0; c < m; c++) {
    f->scale[c] = sqrt(dot_columns(n, (const double(*)[MOST])a, c, c));
    if (!(f->scale[c] > 0.0)) return false;
    for (int64_t k = 0; k < n; k++) a[k][c] /= f->scale[c];
    for (int p = 0; p < m; p++) f->r[p][c] = 0.0;
  }
  for (int p = 0; p < m; p++) {
    double longest = 0.0, length;
    int    pivot   = 0;

    for (int c = 0; c < m; c++) {
      const double square = is_used[c] ? 0.0 : dot_columns(n, (const double(*)[MOST])a, c, c);

      if (square <= longest) continue;
      longest = square;
      pivot   = c;
    }
    for (int q = 0; q < p; q++) f->r[q][pivot] += remove_part(n, a, f->column[q], pivot);
    length = sqrt(dot_columns(n, (const double(*)[MOST])a, pivot, pivot));
    if (!(length > WELL_CONDITIONED)) return false;
    for (int64_t k = 0; k < n; k++) a[k][pivot] /= length;
    f->r[p][pivot] = length;
    is_used[pivot] = true;
    f->column[p]   = pivot;
    for (int c = 0; c < m; c++)
      if (!is_used[c]) f->r[p][c] = remove_part(n, a, pivot, c);
  }
  return true;
}

/* Row k of the pseudo-inverse's transpose. */
static void solve_row(const factors *f, int m, const double q[MOST], double x[MOST])
{
  for (int p = m - 1; p >= 0; p--) {
    double sum = q[f->column[p]];

    for (int s = p + 1; s < m; s++) sum -= f->r[p][f->column[s]] * x[f->column[s]];
    x[f->column[p]] = sum / f->r[p][f->column[p]];
  }
  for (int c = 0; c < m; c++) x[c] /= f->scale[c];
}

/* W S W^T at (a, b), S symmetric as six numbers. */
static double turned(const double axes[3][3], const double s[6], int a, int b)
{
  double sum = 0.0;

  for (int k = 0; k < 6; k++) {
    const int x = rm_row_of[k], y = rm_column_of[k];

    sum += s[k] * (x == y ? axes[a][x] * axes[b][x] : axes[a][x] * axes[b][y] + axes[a][y] * axes[b][x]);
  }
  return sum;
}

/* Coefficients in the axes, dim slopes and one per (a, b) with a <= b, to the nine of the polynomial in x. */
static void turn_back(const double axes[3][3], int dim, const double in[MOST], double out[MOST])
{
  for (int i = 0; i < 9; i++) out[i] = 0.0;
  for (int a = 0; a < dim; a++)
    for (int i = 0; i < 3; i++) out[i] += in[a] * axes[a][i];
  for (int a = 0, at = dim; a < dim; a++)
    for (int b = a; b < dim; b++, at++)
      for (int k = 0; k < 6; k++) {
        const int x = rm_row_of[k], y = rm_column_of[k];

        out[3 + k] += in[at] * (x == y ? axes[a][x] * axes[b][x] : axes[a][x] * axes[b][y] + axes[a][y] * axes[b][x]);
      }
}

bool rm_quadratic_weights(int64_t n, const double (*d)[3], const double (*spread)[6], const rm_distance_noise *noise,
                          rm_quadratic_room *room, double (*weight)[9])
{
  double  axes[3][3];
  factors f;
  int     dim, m;

  for (int64_t k = 0; k < n; k++)
    for (int i = 0; i < 3; i++) room->distance[k][i] = d[k][i];
  dim = rm_leastsq_axes(n, room->distance, noise, room->row_weight, axes);
  m   = dim + dim * (dim + 1) / 2;
  if (dim == 0 || n < m) return false;
  for (int64_t k = 0; k < n; k++) {
    double *row = room->row[k], q[3], square = 0.0;
    int     at = dim;

    for (int a = 0; a < dim; a++) {
      q[a] = axes[a][0] * d[k][0] + axes[a][1] * d[k][1] + axes[a][2] * d[k][2];
      square += q[a] * q[a];
    }
    room->row_weight[k] = square > 0.0 ? 1.0 / (square * square * sqrt(sqrt(square))) : 0.0;
    for (int a = 0; a < dim; a++) {
      row[a] = room->row_weight[k] * q[a];
      for (int b = a; b < dim; b++)
        row[at++] = room->row_weight[k] * (q[a] * q[b] + turned((const double(*)[3])axes, spread[k], a, b));
    }
  }
  if (!factor(n, room->row, m, &f)) return false;
  for (int64_t k = 0; k < n; k++) {
    double x[MOST] = {0.0};

    solve_row(&f, m, room->row[k], x);
    for (int c = 0; c < m; c++) x[c] *= room->row_weight[k];
    turn_back((const double(*)[3])axes, dim, x, weight[k]);
  }
  return true;
}
