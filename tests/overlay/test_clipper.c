/* Volumes, first and second moments of all pairs against plain clipping of tetrahedra in doubles, which shares no step with
 * the overlay: every cell is cut into tetrahedra from the mean of its vertices, each of one mesh is clipped by the planes of
 * each of the other. Good for meshes in general position with star-shaped cells. */
#include "laid.h"
#include "rt.h"

/* Volume, integrals of x and of x x^T (xx, yy, zz, xy, xz, yz) about a point. */
typedef struct integrals {
  double v, m[3], s[6];
} integrals;

typedef struct tetrahedron {
  double p[4][3];
} tetrahedron;

static double volume_of(const tetrahedron *t)
{
  double u[3][3];

  for (int k = 0; k < 3; k++)
    for (int c = 0; c < 3; c++) u[k][c] = t->p[k + 1][c] - t->p[0][c];
  return (u[0][0] * (u[1][1] * u[2][2] - u[1][2] * u[2][1]) + u[0][1] * (u[1][2] * u[2][0] - u[1][0] * u[2][2]) +
          u[0][2] * (u[1][0] * u[2][1] - u[1][1] * u[2][0])) /
         6;
}

static void add(const tetrahedron *t, const double about[3], integrals *sum)
{
  static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
  const double     v = fabs(volume_of(t));
  double           x[4][3], all[3] = {0, 0, 0};

  for (int k = 0; k < 4; k++)
    for (int c = 0; c < 3; c++) all[c] += x[k][c] = t->p[k][c] - about[c];
  sum->v += v;
  for (int c = 0; c < 3; c++) sum->m[c] += v / 4 * all[c];
  for (int k = 0; k < 6; k++) {
    double products = all[row[k]] * all[column[k]];
    for (int h = 0; h < 4; h++) products += x[h][row[k]] * x[h][column[k]];
    sum->s[k] += v / 20 * products;
  }
}

/* Integrate what of t lies in the half-spaces k.. of four; inside is where n.x + n[3] > 0. */
static void clip(const tetrahedron *t, const double plane[4][4], int k, const double about[3], integrals *sum)
{
  double      h[4];
  int         in[4], out[4], num_in = 0, num_out = 0;
  tetrahedron part;

  if (k == 4) {
    add(t, about, sum);
    return;
  }
  for (int v = 0; v < 4; v++) {
    h[v] = plane[k][3];
    for (int c = 0; c < 3; c++) h[v] += plane[k][c] * t->p[v][c];
    if (h[v] > 0)
      in[num_in++] = v;
    else
      out[num_out++] = v;
  }
  if (num_in == 4) clip(t, plane, k + 1, about, sum);
  if (num_in == 0 || num_in == 4) return;
  double cut[4][4][3]; /* between in and out */
  for (int a = 0; a < num_in; a++)
    for (int b = 0; b < num_out; b++)
      for (int c = 0; c < 3; c++) {
        const double *p = t->p[in[a]], *q = t->p[out[b]];
        cut[a][b][c] = p[c] + h[in[a]] / (h[in[a]] - h[out[b]]) * (q[c] - p[c]);
      }
#define PART(a, b, c, d)                                                                                      \
  do {                                                                                                        \
    const double *const corner[4] = {a, b, c, d};                                                             \
    for (int corner_ = 0; corner_ < 4; corner_++) memcpy(part.p[corner_], corner[corner_], sizeof part.p[0]); \
    clip(&part, plane, k + 1, about, sum);                                                                    \
  } while (0)
  if (num_in == 1) {
    PART(t->p[in[0]], cut[0][0], cut[0][1], cut[0][2]);
  } else if (num_in == 3) {
    PART(t->p[in[0]], t->p[in[1]], t->p[in[2]], cut[2][0]);
    PART(t->p[in[0]], t->p[in[1]], cut[1][0], cut[2][0]);
    PART(t->p[in[0]], cut[0][0], cut[1][0], cut[2][0]);
  } else {
    PART(t->p[in[0]], cut[0][0], cut[0][1], cut[1][1]);
    PART(t->p[in[0]], cut[0][0], cut[1][0], cut[1][1]);
    PART(t->p[in[0]], t->p[in[1]], cut[1][0], cut[1][1]);
  }
#undef PART
}

/* The planes of a tetrahedron, looking inwards. */
static void planes_of(const tetrahedron *t, double plane[4][4])
{
  for (int k = 0; k < 4; k++) {
    const double *a = t->p[(k + 1) % 4], *b = t->p[(k + 2) % 4], *c = t->p[(k + 3) % 4];
    double        inside;

    for (int d = 0; d < 3; d++) {
      const int e = (d + 1) % 3, f = (d + 2) % 3;
      plane[k][d] = (b[e] - a[e]) * (c[f] - a[f]) - (b[f] - a[f]) * (c[e] - a[e]);
    }
    plane[k][3] = -(plane[k][0] * a[0] + plane[k][1] * a[1] + plane[k][2] * a[2]);
    inside      = plane[k][3] + plane[k][0] * t->p[k][0] + plane[k][1] * t->p[k][1] + plane[k][2] * t->p[k][2];
    for (int d = 0; d < 4 && inside < 0; d++) plane[k][d] = -plane[k][d];
  }
}

/* The tetrahedron of triangle number a of a cell. */
static tetrahedron piece_of(const rm_trimesh *m, rm_lid cell, rm_lid a)
{
  const rm_lid *v = m->triangle[m->cell_triangle[a] / 2], first = m->cell_vertex_offset[cell],
               end = m->cell_vertex_offset[cell + 1];
  tetrahedron t    = {{{0, 0, 0}}};

  for (rm_lid k = first; k < end; k++)
    for (int c = 0; c < 3; c++) t.p[0][c] += m->vertex[m->cell_vertex[k]][c] / (end - first);
  for (int h = 0; h < 3; h++) memcpy(t.p[h + 1], m->vertex[v[h]], sizeof t.p[0]);
  return t;
}

static integrals clipped(const laid *l, rm_lid i, rm_lid j, const double about[3])
{
  const rm_trimesh *m = l->mesh[0], *k = l->mesh[1];
  integrals         sum = {0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};

  for (rm_lid b = k->cell_triangle_offset[j]; b < k->cell_triangle_offset[j + 1]; b++) {
    const tetrahedron by = piece_of(k, j, b);
    double            plane[4][4];

    planes_of(&by, plane);
    for (rm_lid a = m->cell_triangle_offset[i]; a < m->cell_triangle_offset[i + 1]; a++) {
      const tetrahedron t = piece_of(m, i, a);
      clip(&t, (const double(*)[4])plane, 0, about, &sum);
    }
  }
  return sum;
}

static void agrees(tm_mesh *a, tm_mesh *b)
{
  for (int faces = 0; faces < 2; faces++) {
    laid   *l     = laid_over(a, b, faces ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, &(laid_how){.degree = 2});
    int64_t pairs = 0;

    if (!RT_EQ(l->status, REMAP_OK)) continue;
    for (rm_lid i = 0; i < l->num[0]; i++)
      for (rm_lid j = 0; j < l->num[1]; j++) {
        const double *c = l->part.piece[0].cell_centroid[l->place[0][i]], *box = l->mesh[0]->cell_box[l->place[0][i]];
        const int64_t k = laid_pair(l, i, j);

        if (!rm_box_meets(box, l->mesh[1]->cell_box[l->place[1][j]])) continue;
        const integrals want  = clipped(l, l->place[0][i], l->place[1][j], c);
        const double    least = fmin(laid_cell_volume(l, 0, i), laid_cell_volume(l, 1, j));
        const double    size  = fmax(box[3] - box[0], fmax(box[4] - box[1], box[5] - box[2]));
        RT_NEAR(k < 0 ? 0 : l->moments->volume[k], want.v, 1e-13 * least);
        for (int d = 0; d < 3; d++) RT_NEAR(k < 0 ? 0 : l->moments->moment[k][d], want.m[d], 1e-13 * least * size);
        for (int d = 0; d < 6; d++) RT_NEAR(k < 0 ? 0 : l->moments->second[k][d], want.s[d], 1e-13 * least * size * size);
        pairs += k >= 0;
      }
    RT_EQ(l->moments->num_pairs, pairs);
    laid_free(l);
  }
  tm_free(a);
  tm_free(b);
}

typedef tm_mesh *maker(const int n[3], tm_map map, const void *data);

static tm_mesh *turned(maker *make, int n, double angle, double scale)
{
  tm_mesh *mesh = make((int[]){n, n, n}, tm_warp, &(tm_warping){.03, angle});

  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    double *p = mesh->xyz + 3 * v;
    for (int d = 0; d < 3; d++) p[d] = (p[d] - .5) * scale;
    tm_rotate_(p, angle);
  }
  return mesh;
}

static void warped_hexahedra_agree(void) { agrees(turned(tm_hexahedra, 4, .3, 1), turned(tm_hexahedra, 5, .1, 1.1)); }
static void tetrahedra_on_hexahedra_agree(void) { agrees(turned(tm_tetrahedra, 3, .7, 1), turned(tm_hexahedra, 3, .2, .9)); }
static void prisms_on_pyramids_agree(void) { agrees(turned(tm_prisms, 3, .4, 1), turned(tm_pyramids, 2, 1.1, 1)); }
static void polyhedra_on_tetrahedra_agree(void) { agrees(turned(tm_dual, 2, .5, 1), turned(tm_tetrahedra, 3, .9, 1)); }
static void sizes_much_apart_agree(void) { agrees(turned(tm_hexahedra, 1, .3, 1), turned(tm_hexahedra, 7, .8, .4)); }

RT_MAIN(RT_CASE(warped_hexahedra_agree), RT_CASE(tetrahedra_on_hexahedra_agree), RT_CASE(prisms_on_pyramids_agree),
        RT_CASE(polyhedra_on_tetrahedra_agree), RT_CASE(sizes_much_apart_agree))
