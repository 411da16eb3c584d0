/* leastsq -- the weights of a least-squares gradient in one cell, and the axes in which its neighbours spread evenly.
 *
 * Minimise sum over k of (w_k (g.d_k - du_k))^2 with w_k = 1/(|d_k| |W d_k|), so that near neighbours count more. W d are
 * distances in the axes in which the neighbours spread evenly: cells of any shape have near ones among them; |d_k| lets a
 * gradient across curved layers of thin cells survive, and more of it would cost digits there. The matrix A = (w_k d_k) is
 * factored A = Q R by Gram-Schmidt, every column orthogonalised twice, with columns scaled to unit length and pivoting. Columns
 * of rounding only are left out first: unit length would turn them into slopes. If the rest has lower rank too (a thin mesh
 * that is not parallel to an axis), the slope is sought within the space of the distances alone, so that it is 0 in every
 * direction they do not span. O(n) time per cell. */
#include "field_private.h"

/* A = Q R over the columns that are linearly independent, in pivot order. */
typedef struct factors {
  int    rank, column[3]; /* [rank] pivots                                         */
  double scale[3];        /* lengths of the columns                                */
  double r[3][3];         /* r[p][c]: row of pivot p, column c, of the scaled matrix */
} factors;

static const double INDEPENDENT = 0x1p-27; /* relative to the length of a column: about 1e-8 */

static double square(double x) { return x * x; }

static double dot_columns(int64_t n, const double (*a)[3], int c, int e)
{
  double sum = 0.0;

  for (int64_t k = 0; k < n; k++) sum += a[k][c] * a[k][e];
  return sum;
}

/* Take the part along column `unit`, of length 1, out of column c; that part. */
static double remove_part(int64_t n, double (*a)[3], int unit, int c)
{
  const double part = dot_columns(n, (const double(*)[3])a, unit, c);

  for (int64_t k = 0; k < n; k++) a[k][c] -= part * a[k][unit];
  return part;
}

/* Factor the first num_columns columns of a, in place: column f->column[p] becomes the p-th column of Q. Columns of length 0
 * are left out; so is what is shorter than tolerance once the pivots before are taken out. */
static void factor(int64_t n, double (*a)[3], int num_columns, double tolerance, factors *f)
{
  bool is_used[3] = {false, false, false};

  *f = (factors){.rank = 0};
  for (int c = 0; c < num_columns; c++) {
    f->scale[c] = sqrt(dot_columns(n, (const double(*)[3])a, c, c));
    is_used[c]  = !(f->scale[c] > 0.0);
    if (is_used[c]) continue;
    for (int64_t k = 0; k < n; k++) a[k][c] /= f->scale[c];
  }
  for (int p = 0; p < num_columns; p++) {
    double longest = 0.0;
    int    pivot   = -1;

    for (int c = 0; c < num_columns; c++) {
      const double length = is_used[c] ? 0.0 : sqrt(dot_columns(n, (const double(*)[3])a, c, c));

      if (length <= longest) continue;
      longest = length;
      pivot   = c;
    }
    if (pivot < 0 || (p > 0 && longest <= tolerance)) return;
    for (int q = 0; q < p; q++) f->r[q][pivot] += remove_part(n, a, f->column[q], pivot);
    f->r[p][pivot] = sqrt(dot_columns(n, (const double(*)[3])a, pivot, pivot));
    for (int64_t k = 0; k < n; k++) a[k][pivot] /= f->r[p][pivot];
    is_used[pivot]       = true;
    f->column[f->rank++] = pivot;
    for (int c = 0; c < num_columns; c++)
      if (!is_used[c]) f->r[p][c] = remove_part(n, a, pivot, c);
  }
}

/* Row k of the pseudo-inverse's transpose: x with x[c] = 0 for columns that are no pivots. */
static void solve_row(const factors *f, const double q[3], double x[3])
{
  x[0] = x[1] = x[2] = 0.0;
  for (int p = f->rank - 1; p >= 0; p--) {
    double sum = q[f->column[p]];

    for (int s = p + 1; s < f->rank; s++) sum -= f->r[p][f->column[s]] * x[f->column[s]];
    x[f->column[p]] = sum / f->r[p][f->column[p]];
  }
  for (int c = 0; c < 3; c++)
    if (f->scale[c] > 0.0) x[c] /= f->scale[c];
}

/* An orthonormal basis of the space that the rows of the factored matrix span, in unscaled coordinates; its dimension. */
static int row_space(const factors *f, double basis[3][3])
{
  int num = 0;

  for (int p = 0; p < f->rank; p++) {
    double *b = basis[num], length;

    for (int c = 0; c < 3; c++) b[c] = f->r[p][c] * f->scale[c];
    for (int twice = 0; twice < 2; twice++)
      for (int q = 0; q < num; q++) {
        const double part = b[0] * basis[q][0] + b[1] * basis[q][1] + b[2] * basis[q][2];

        for (int c = 0; c < 3; c++) b[c] -= part * basis[q][c];
      }
    length = sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
    if (!(length > 0.0)) continue;
    for (int c = 0; c < 3; c++) b[c] /= length;
    num++;
  }
  return num;
}

/* Row weights, 1/(|d| |W d|) or 1 without axes W, but 0 where the distance is rounding only; d becomes w d, without the columns
 * that span nothing. The number of columns left; *noise_length receives the largest length that rounding has in a scaled
 * column. */
static int weigh_rows(int64_t n, double (*d)[3], int num_axes, const double axes[3][3], const rm_distance_noise *noise,
                      double *row_weight, double *noise_length)
{
  double longest[3] = {0.0, 0.0, 0.0}, length2[3] = {0.0, 0.0, 0.0}, sum2 = 0.0;
  int    num = 0;

  for (int64_t k = 0; k < n; k++) {
    const double *x      = d[k];
    const double  length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    bool          is_far = false;
    double        spread = 0.0;

    for (int c = 0; c < 3; c++) is_far |= fabs(x[c]) > noise->coordinate[c] + 0x1p-40 * noise->extent[c];
    for (int a = 0; a < num_axes; a++) spread += square(axes[a][0] * x[0] + axes[a][1] * x[1] + axes[a][2] * x[2]);
    row_weight[k] = !is_far ? 0.0 : num_axes == 0 ? 1.0 : spread > 0.0 ? 1.0 / (length * sqrt(spread)) : 0.0;
    sum2 += row_weight[k] * row_weight[k];
    for (int c = 0; c < 3; c++) {
      if (is_far && fabs(x[c]) > longest[c]) longest[c] = fabs(x[c]);
      d[k][c] *= row_weight[k];
      length2[c] += d[k][c] * d[k][c];
    }
  }
  *noise_length = 0.0;
  for (int c = 0; c < 3; c++) {
    if (longest[c] <= noise->coordinate[c] + INDEPENDENT * noise->extent[c]) {
      for (int64_t k = 0; k < n; k++) d[k][c] = 0.0;
      continue;
    }
    num++;
    *noise_length = fmax(*noise_length, noise->coordinate[c] * sqrt(sum2 / length2[c]));
  }
  return num;
}

/* Rows projected to a basis of `num` directions. The old rows are gone, so they are made again from Q and R. */
static void project_rows(int64_t n, double (*a)[3], const factors *f, const double basis[3][3], int num)
{
  for (int64_t k = 0; k < n; k++) {
    double row[3] = {0.0, 0.0, 0.0};

    for (int p = 0; p < f->rank; p++)
      for (int c = 0; c < 3; c++) row[c] += a[k][f->column[p]] * f->r[p][c] * f->scale[c];
    for (int b = 0; b < num; b++) a[k][b] = row[0] * basis[b][0] + row[1] * basis[b][1] + row[2] * basis[b][2];
    for (int b = num; b < 3; b++) a[k][b] = 0.0;
  }
}

int rm_leastsq_axes(int64_t n, double (*d)[3], const rm_distance_noise *noise, double *scratch, double axes[3][3])
{
  double    noise_length, basis[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
  const int num = weigh_rows(n, d, 0, NULL, noise, scratch, &noise_length);
  factors   f;

  factor(n, d, 3, fmax(INDEPENDENT, noise_length), &f);
  if (f.rank < num) {
    const int dim = row_space(&f, basis);

    project_rows(n, d, &f, (const double(*)[3])basis, dim);
    factor(n, d, dim, 0.0, &f);
  }
  for (int p = 0; p < f.rank; p++) { /* Q = A R^-1, column by column */
    const int c = f.column[p];

    for (int i = 0; i < 3; i++) {
      double sum = basis[c][i] / f.scale[c];

      for (int q = 0; q < p; q++) sum -= f.r[q][c] * axes[q][i];
      axes[p][i] = sum / f.r[p][c];
    }
  }
  return f.rank;
}

void rm_leastsq_weights(int64_t n, double (*d)[3], const rm_distance_noise *noise, double *scratch, double (*weight)[3])
{
  double  noise_length, axes[3][3], basis[3][3] = {{0.0}};
  int     num_axes, num, dim                    = 3;
  factors f;

  for (int64_t k = 0; k < n; k++)
    for (int c = 0; c < 3; c++) weight[k][c] = d[k][c];
  num_axes = rm_leastsq_axes(n, weight, noise, scratch, axes);
  num      = weigh_rows(n, d, num_axes, (const double(*)[3])axes, noise, scratch, &noise_length);
  factor(n, d, 3, fmax(INDEPENDENT, noise_length), &f);
  if (f.rank < num) {
    dim = row_space(&f, basis);
    project_rows(n, d, &f, (const double(*)[3])basis, dim);
    factor(n, d, dim, 0.0, &f);
  }
  for (int64_t k = 0; k < n; k++) {
    double x[3];

    solve_row(&f, d[k], x);
    for (int c = 0; c < 3; c++) {
      const double along = dim < 3 ? x[0] * basis[0][c] + x[1] * basis[1][c] + x[2] * basis[2][c] : x[c];

      weight[k][c] = scratch[k] * along;
    }
  }
}
