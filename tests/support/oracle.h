/* oracle -- what an overlay must be, in exact rationals and by brute force, for small meshes.
 *
 * Volumes and first moments of pairs do not follow the method they are compared with: a cell's winding number is the signed sum
 * of the tetrahedra from one of its vertices over its triangles, so integrals over i n j are signed sums over intersections of
 * two tetrahedra, and these are clipped plane by plane. Crossings are found by asking every edge for every triangle with the
 * signs of DESIGN 2.2. About 20 us per pair of tetrahedra that meet. */
#ifndef ORACLE_H
#define ORACLE_H

#include <gmp.h>
#include "laid.h"
#include "rt.h"

typedef struct oracle_int3 {
  mpz_t c[3];
} oracle_int3;
typedef struct oracle_point {
  mpq_t c[3];
} oracle_point;

typedef struct oracle {
  const laid  *l;
  int          power;                     /* coordinates are multiplied by 2^power */
  oracle_int3 *vertex[2];                 /* [side][num_vertices]                  */
  oracle_point corner[2][4], fresh[4][4]; /* of two tetrahedra; made by clipping with one plane */
  mpq_t        normal[4][3], offset[4];   /* planes of the second, inside is positive           */
  mpq_t        height[4][4], sum[10];     /* 6 |T n B|, 24 M, 120 S (xx, yy, zz, xy, xz, yz)    */
  mpq_t        s, t;                      /* scratch                                            */
  oracle_int3  u, v, w, n;
  mpz_t        x, y;
} oracle;

/* ---- life -------------------------------------------------------------------------------------------------------- */

/* The power of two that makes an integer of every coordinate. */
static inline int oracle_power_(const rm_trimesh *m, int power)
{
  for (rm_lid v = 0; v < m->num_vertices; v++)
    for (int c = 0; c < 3; c++) {
      int    exponent;
      double x = frexp(m->vertex[v][c], &exponent);

      for (int bits = 0; x != 0 && bits <= 53; bits++, x *= 2)
        if (x == rint(x)) {
          if (bits - exponent > power) power = bits - exponent;
          break;
        }
    }
  return power;
}

static inline oracle *oracle_new(const laid *l)
{
  oracle *o = tm_alloc_(1, sizeof *o);

  o->l     = l;
  o->power = oracle_power_(l->mesh[1], oracle_power_(l->mesh[0], 0));
  for (int side = 0; side < 2; side++) {
    const rm_trimesh *m = l->mesh[side];

    o->vertex[side] = tm_alloc_(m->num_vertices, sizeof **o->vertex);
    for (rm_lid v = 0; v < m->num_vertices; v++)
      for (int c = 0; c < 3; c++) mpz_init_set_d(o->vertex[side][v].c[c], ldexp(m->vertex[v][c], o->power));
  }
  for (int k = 0; k < 4; k++) {
    mpq_init(o->offset[k]);
    for (int c = 0; c < 3; c++) {
      mpq_init(o->normal[k][c]);
      for (int h = 0; h < 2; h++) mpq_init(o->corner[h][k].c[c]);
      for (int h = 0; h < 4; h++) mpq_init(o->fresh[h][k].c[c]);
    }
    for (int h = 0; h < 4; h++) mpq_init(o->height[k][h]);
  }
  for (int c = 0; c < 3; c++) mpz_inits(o->u.c[c], o->v.c[c], o->w.c[c], o->n.c[c], NULL);
  for (int k = 0; k < 10; k++) mpq_init(o->sum[k]);
  mpz_inits(o->x, o->y, NULL);
  mpq_inits(o->s, o->t, NULL);
  return o;
}

static inline void oracle_free(oracle *o)
{
  for (int side = 0; side < 2; side++) {
    for (rm_lid v = 0; v < o->l->mesh[side]->num_vertices; v++)
      for (int c = 0; c < 3; c++) mpz_clear(o->vertex[side][v].c[c]);
    free(o->vertex[side]);
  }
  for (int k = 0; k < 4; k++) {
    mpq_clear(o->offset[k]);
    for (int c = 0; c < 3; c++) {
      mpq_clear(o->normal[k][c]);
      for (int h = 0; h < 2; h++) mpq_clear(o->corner[h][k].c[c]);
      for (int h = 0; h < 4; h++) mpq_clear(o->fresh[h][k].c[c]);
    }
    for (int h = 0; h < 4; h++) mpq_clear(o->height[k][h]);
  }
  for (int c = 0; c < 3; c++) mpz_clears(o->u.c[c], o->v.c[c], o->w.c[c], o->n.c[c], NULL);
  for (int k = 0; k < 10; k++) mpq_clear(o->sum[k]);
  mpz_clears(o->x, o->y, NULL);
  mpq_clears(o->s, o->t, NULL);
  free(o);
}

/* ---- integers ---------------------------------------------------------------------------------------------------- */

static inline void oracle_between_(oracle_int3 *out, const oracle_int3 *a, const oracle_int3 *b)
{
  for (int c = 0; c < 3; c++) mpz_sub(out->c[c], b->c[c], a->c[c]);
}
static inline void oracle_cross_(oracle_int3 *out, const oracle_int3 *a, const oracle_int3 *b)
{
  for (int c = 0; c < 3; c++) {
    mpz_mul(out->c[c], a->c[(c + 1) % 3], b->c[(c + 2) % 3]);
    mpz_submul(out->c[c], a->c[(c + 2) % 3], b->c[(c + 1) % 3]);
  }
}
static inline void oracle_dot_(mpz_t out, const oracle_int3 *a, const oracle_int3 *b)
{
  mpz_mul(out, a->c[0], b->c[0]);
  mpz_addmul(out, a->c[1], b->c[1]);
  mpz_addmul(out, a->c[2], b->c[2]);
}
static inline int oracle_first_sign_(const oracle_int3 *a)
{
  return mpz_sgn(a->c[0]) ? mpz_sgn(a->c[0]) : mpz_sgn(a->c[1]) ? mpz_sgn(a->c[1]) : mpz_sgn(a->c[2]);
}

/* ---- crossings by brute force ------------------------------------------------------------------------------------- */

static inline int oracle_edge_side_(oracle *o, const oracle_int3 *p0, const oracle_int3 *p1, const oracle_int3 *f0,
                                    const oracle_int3 *f1, int moved)
{
  oracle_between_(&o->u, p0, p1);
  oracle_between_(&o->v, f0, f1);
  oracle_between_(&o->w, p0, f0);
  oracle_cross_(&o->n, &o->w, &o->v);
  oracle_dot_(o->x, &o->u, &o->n);
  if (mpz_sgn(o->x)) return mpz_sgn(o->x);
  oracle_cross_(&o->n, &o->v, &o->u);
  return moved * oracle_first_sign_(&o->n);
}

static inline void oracle_normal_(oracle *o, int side, rm_lid t)
{
  const rm_lid *k = o->l->mesh[side]->triangle[t];

  oracle_between_(&o->u, &o->vertex[side][k[0]], &o->vertex[side][k[1]]);
  oracle_between_(&o->v, &o->vertex[side][k[0]], &o->vertex[side][k[2]]);
  oracle_cross_(&o->n, &o->u, &o->v);
}

static inline int oracle_point_side_(oracle *o, int side, rm_lid t, const oracle_int3 *p, int moved)
{
  oracle_normal_(o, side, t);
  oracle_between_(&o->w, &o->vertex[side][o->l->mesh[side]->triangle[t][0]], p);
  oracle_dot_(o->x, &o->n, &o->w);
  return mpz_sgn(o->x) ? mpz_sgn(o->x) : -moved * oracle_first_sign_(&o->n);
}

/* Sign of the crossing of edge e of mesh `side` with triangle t of the other, 0 if there is none. */
static inline int oracle_crosses_(oracle *o, int side, rm_lid e, rm_lid t)
{
  const rm_trimesh  *own = o->l->mesh[side], *other = o->l->mesh[1 - side];
  const oracle_int3 *p0 = &o->vertex[side][own->edge[e][0]], *p1 = &o->vertex[side][own->edge[e][1]];
  const rm_lid      *k     = other->triangle[t];
  const int          moved = side == 0 ? 1 : -1;
  int                s[3], a, b;

  for (int c = 0; c < 3; c++) {
    const double *p = own->vertex[own->edge[e][0]], *q = own->vertex[own->edge[e][1]];
    const double  x[3] = {other->vertex[k[0]][c], other->vertex[k[1]][c], other->vertex[k[2]][c]};

    if (fmax(p[c], q[c]) < fmin(x[0], fmin(x[1], x[2])) || fmin(p[c], q[c]) > fmax(x[0], fmax(x[1], x[2]))) return 0;
  }
  for (int h = 0; h < 3; h++)
    s[h] = oracle_edge_side_(o, p0, p1, &o->vertex[1 - side][k[h]], &o->vertex[1 - side][k[(h + 1) % 3]], moved);
  if (!s[0] || s[0] != s[1] || s[0] != s[2]) return 0;
  a = oracle_point_side_(o, 1 - side, t, p0, moved);
  b = oracle_point_side_(o, 1 - side, t, p1, moved);
  return a && b && a != b ? -a : 0;
}

/* Place of the crossing on edge e: {n.(t0 - p0), moved n} / n.u, the powers of the infinitesimal. */
static inline void oracle_place_(oracle *o, int side, rm_lid e, rm_lid t, mpq_t place[4])
{
  const rm_trimesh *own = o->l->mesh[side], *other = o->l->mesh[1 - side];
  const int         moved = side == 0 ? 1 : -1;

  oracle_normal_(o, 1 - side, t);
  oracle_between_(&o->w, &o->vertex[side][own->edge[e][0]], &o->vertex[1 - side][other->triangle[t][0]]);
  oracle_between_(&o->u, &o->vertex[side][own->edge[e][0]], &o->vertex[side][own->edge[e][1]]);
  oracle_dot_(o->x, &o->n, &o->w);
  oracle_dot_(o->y, &o->n, &o->u);
  for (int c = 0; c < 4; c++) {
    if (c > 0) mpz_set(o->x, o->n.c[c - 1]);
    if (c > 0 && moved < 0) mpz_neg(o->x, o->x);
    mpz_set(mpq_numref(place[c]), o->x);
    mpz_set(mpq_denref(place[c]), o->y);
    mpq_canonicalize(place[c]);
  }
}

/* The crossings of mesh `side` with the other are those of the trace, in their exact order. */
static inline void oracle_check_crossings(oracle *o, int side)
{
  const rm_trimesh *own = o->l->mesh[side], *other = o->l->mesh[1 - side];
  const rm_trace   *trace = &o->l->overlay->trace[side];
  int64_t           total = 0, wrong = 0, unordered = 0;
  mpq_t             place[2][4];

  for (int c = 0; c < 4; c++) mpq_inits(place[0][c], place[1][c], NULL);
  for (rm_lid e = 0; e < own->num_edges; e++) {
    const rm_crossing *list  = trace->crossing + trace->first[e];
    rm_lid             found = 0;

    for (rm_lid t = 0; t < other->num_triangles && !rm_is_inside_facets(own, e); t++) {
      const int s      = oracle_crosses_(o, side, e, t);
      bool      listed = false;

      if (!s) continue;
      for (rm_lid k = 0; k < trace->count[e]; k++) listed |= list[k].triangle == (rm_facet_of(other, t) ^ (s < 0));
      wrong += !listed;
      found++;
    }
    total += found;
    wrong += found != trace->count[e];
    for (rm_lid k = 0; k < trace->count[e]; k++) {
      int order = 0;

      oracle_place_(o, side, e, list[k].triangle / 2, place[k & 1]);
      for (int c = 0; c < 4 && k > 0 && !order; c++) order = mpq_cmp(place[!(k & 1)][c], place[k & 1][c]);
      unordered += order > 0;
    }
  }
  RT_EQ(trace->num_crossings, total);
  RT_EQ(wrong, 0);
  RT_EQ(unordered, 0);
  for (int c = 0; c < 4; c++) mpq_clears(place[0][c], place[1][c], NULL);
}

/* ---- integrals by clipping ----------------------------------------------------------------------------------------- */

/* out = det[a - d, b - d, c - d] */
static inline void oracle_det_(oracle *o, mpq_t out, const oracle_point *const p[4])
{
  oracle_point e[3];

  for (int k = 0; k < 3; k++)
    for (int c = 0; c < 3; c++) mpq_init(e[k].c[c]), mpq_sub(e[k].c[c], p[k]->c[c], p[3]->c[c]);
  mpq_set_ui(out, 0, 1);
  for (int c = 0; c < 3; c++) {
    mpq_mul(o->s, e[1].c[(c + 1) % 3], e[2].c[(c + 2) % 3]);
    mpq_mul(o->t, e[1].c[(c + 2) % 3], e[2].c[(c + 1) % 3]);
    mpq_sub(o->s, o->s, o->t);
    mpq_mul(o->s, o->s, e[0].c[c]);
    mpq_add(out, out, o->s);
  }
  for (int k = 0; k < 3; k++)
    for (int c = 0; c < 3; c++) mpq_clear(e[k].c[c]);
}

static const int oracle_row_[6] = {0, 1, 2, 0, 0, 1}, oracle_column_[6] = {0, 1, 2, 1, 2, 2};

/* Add 6 volume, 24 moment and, where the overlay has them, 120 second moments of the tetrahedron, signed by sign alone. */
static inline void oracle_add_(oracle *o, const oracle_point *const p[4], int sign)
{
  mpq_t det, x, total[3];

  mpq_inits(det, x, total[0], total[1], total[2], NULL);
  oracle_det_(o, det, p);
  if (mpq_sgn(det) * sign < 0) mpq_neg(det, det);
  mpq_add(o->sum[0], o->sum[0], det);
  for (int c = 0; c < 3; c++) {
    mpq_add(x, p[0]->c[c], p[1]->c[c]);
    mpq_add(x, x, p[2]->c[c]);
    mpq_add(x, x, p[3]->c[c]);
    mpq_set(total[c], x);
    mpq_mul(x, x, det);
    mpq_add(o->sum[1 + c], o->sum[1 + c], x);
  }
  for (int k = 0; k < 6 && o->l->moments->second; k++) {
    mpq_mul(x, total[oracle_row_[k]], total[oracle_column_[k]]);
    for (int v = 0; v < 4; v++) mpq_mul(o->s, p[v]->c[oracle_row_[k]], p[v]->c[oracle_column_[k]]), mpq_add(x, x, o->s);
    mpq_mul(x, x, det);
    mpq_add(o->sum[4 + k], o->sum[4 + k], x);
  }
  mpq_clears(det, x, total[0], total[1], total[2], NULL);
}

/* The point where a -> b meets the plane over which their heights are. */
static inline const oracle_point *oracle_cut_(oracle *o, oracle_point *out, const oracle_point *a, const oracle_point *b,
                                              const mpq_t ha, const mpq_t hb)
{
  mpq_sub(o->s, ha, hb);
  mpq_div(o->s, ha, o->s);
  for (int c = 0; c < 3; c++) {
    mpq_sub(o->t, b->c[c], a->c[c]);
    mpq_mul(o->t, o->t, o->s);
    mpq_add(out->c[c], a->c[c], o->t);
  }
  return out;
}

/* Clip the tetrahedron with planes k.. of the second and add what is left. */
static inline void oracle_clip_(oracle *o, const oracle_point *const p[4], int k, int sign)
{
  const oracle_point *in[4], *out[4], *c[4];
  mpq_t              *hin[4], *hout[4];
  int                 num_in = 0, num_out = 0;

  if (k == 4) {
    oracle_add_(o, p, sign);
    return;
  }
  for (int v = 0; v < 4; v++) {
    mpq_t *h = &o->height[k][v];

    mpq_set(*h, o->offset[k]);
    for (int d = 0; d < 3; d++) mpq_mul(o->s, o->normal[k][d], p[v]->c[d]), mpq_add(*h, *h, o->s);
    if (mpq_sgn(*h) > 0)
      hin[num_in] = h, in[num_in++] = p[v];
    else
      hout[num_out] = h, out[num_out++] = p[v];
  }
  if (num_in == 0) return;
  if (num_in == 4) {
    oracle_clip_(o, p, k + 1, sign);
    return;
  }
  if (num_in == 1) {
    for (int v = 0; v < 3; v++) c[v] = oracle_cut_(o, &o->fresh[k][v], in[0], out[v], *hin[0], *hout[v]);
    oracle_clip_(o, (const oracle_point *const[4]){in[0], c[0], c[1], c[2]}, k + 1, sign);
  } else if (num_in == 3) {
    for (int v = 0; v < 3; v++) c[v] = oracle_cut_(o, &o->fresh[k][v], in[v], out[0], *hin[v], *hout[0]);
    oracle_clip_(o, (const oracle_point *const[4]){in[0], in[1], in[2], c[2]}, k + 1, sign);
    oracle_clip_(o, (const oracle_point *const[4]){in[0], in[1], c[1], c[2]}, k + 1, sign);
    oracle_clip_(o, (const oracle_point *const[4]){in[0], c[0], c[1], c[2]}, k + 1, sign);
  } else {
    for (int v = 0; v < 4; v++) c[v] = oracle_cut_(o, &o->fresh[k][v], in[v / 2], out[v % 2], *hin[v / 2], *hout[v % 2]);
    oracle_clip_(o, (const oracle_point *const[4]){in[0], c[0], c[1], c[3]}, k + 1, sign);
    oracle_clip_(o, (const oracle_point *const[4]){in[0], c[0], c[2], c[3]}, k + 1, sign);
    oracle_clip_(o, (const oracle_point *const[4]){in[0], in[1], c[2], c[3]}, k + 1, sign);
  }
}

/* The tetrahedron from vertex `apex` over a triangle into corner[side]; its box; the sign of its volume seen from a cell on the
 * triangle's left. */
static inline int oracle_tetrahedron_(oracle *o, int side, rm_lid apex, rm_lid t, double box[6])
{
  const rm_trimesh *m    = o->l->mesh[side];
  const rm_lid      v[4] = {m->triangle[t][0], m->triangle[t][1], m->triangle[t][2], apex};

  for (int c = 0; c < 6; c++) box[c] = c < 3 ? INFINITY : -INFINITY;
  for (int h = 0; h < 4; h++)
    for (int c = 0; c < 3; c++) {
      box[c]     = fmin(box[c], m->vertex[v[h]][c]);
      box[c + 3] = fmax(box[c + 3], m->vertex[v[h]][c]);
    }
  oracle_normal_(o, side, t);
  oracle_between_(&o->w, &o->vertex[side][apex], &o->vertex[side][v[0]]);
  oracle_dot_(o->x, &o->n, &o->w);
  return mpz_sgn(o->x);
}

static inline void oracle_load_(oracle *o, int side, rm_lid apex, rm_lid t)
{
  const rm_lid *v = o->l->mesh[side]->triangle[t];

  for (int h = 0; h < 4; h++)
    for (int c = 0; c < 3; c++) mpq_set_z(o->corner[side][h].c[c], o->vertex[side][h < 3 ? v[h] : apex].c[c]);
}

/* The planes of corner[1], whose volume has the given sign. */
static inline void oracle_planes_(oracle *o, int sign)
{
  static const int face[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {0, 2, 3}}; /* normals point out where the sign is + */

  for (int k = 0; k < 4; k++) {
    const oracle_point *a = &o->corner[1][face[k][0]], *b = &o->corner[1][face[k][1]], *c = &o->corner[1][face[k][2]];

    mpq_set_ui(o->offset[k], 0, 1);
    for (int d = 0; d < 3; d++) {
      const int e = (d + 1) % 3, f = (d + 2) % 3;
      mpq_t     y;

      mpq_init(y);
      mpq_sub(o->s, b->c[e], a->c[e]), mpq_sub(o->t, c->c[f], a->c[f]), mpq_mul(o->normal[k][d], o->s, o->t);
      mpq_sub(o->s, b->c[f], a->c[f]), mpq_sub(o->t, c->c[e], a->c[e]), mpq_mul(y, o->s, o->t);
      mpq_sub(o->normal[k][d], o->normal[k][d], y);
      if (sign > 0) mpq_neg(o->normal[k][d], o->normal[k][d]);
      mpq_mul(y, o->normal[k][d], a->c[d]);
      mpq_sub(o->offset[k], o->offset[k], y);
      mpq_clear(y);
    }
  }
}

/* 6 V and 24 M about the origin of cells i of mesh 1 and j of mesh 2, by their places, into o->sum; lengths times 2^power. */
static inline void oracle_integrate(oracle *o, rm_lid i, rm_lid j)
{
  const rm_trimesh *m1 = o->l->mesh[0], *m2 = o->l->mesh[1];
  const rm_lid      a1 = m1->triangle[m1->cell_triangle[m1->cell_triangle_offset[i]] / 2][0];
  const rm_lid      a2 = m2->triangle[m2->cell_triangle[m2->cell_triangle_offset[j]] / 2][0];

  for (int k = 0; k < 10; k++) mpq_set_ui(o->sum[k], 0, 1);
  for (rm_lid b = m2->cell_triangle_offset[j]; b < m2->cell_triangle_offset[j + 1]; b++) {
    double    box2[6], box1[6];
    const int s2 = oracle_tetrahedron_(o, 1, a2, m2->cell_triangle[b] / 2, box2);

    if (!s2) continue;
    oracle_load_(o, 1, a2, m2->cell_triangle[b] / 2);
    oracle_planes_(o, s2);
    for (rm_lid t = m1->cell_triangle_offset[i]; t < m1->cell_triangle_offset[i + 1]; t++) {
      const int s1 = oracle_tetrahedron_(o, 0, a1, m1->cell_triangle[t] / 2, box1);

      if (!s1 || !rm_box_meets(box1, box2)) continue;
      oracle_load_(o, 0, a1, m1->cell_triangle[t] / 2);
      oracle_clip_(o, (const oracle_point *const[4]){&o->corner[0][0], &o->corner[0][1], &o->corner[0][2], &o->corner[0][3]}, 0,
                   s1 * s2 * (m1->cell_triangle[t] & 1 ? -1 : 1) * (m2->cell_triangle[b] & 1 ? -1 : 1));
    }
  }
}

/* 6 V of a cell by its place. */
static inline void oracle_cell(oracle *o, int side, rm_lid c, mpq_t out)
{
  const rm_trimesh *m = o->l->mesh[side];

  mpq_set_ui(out, 0, 1);
  for (rm_lid a = m->cell_triangle_offset[c]; a < m->cell_triangle_offset[c + 1]; a++) {
    const rm_lid t = m->cell_triangle[a] / 2;

    oracle_normal_(o, side, t);
    oracle_dot_(o->x, &o->n, &o->vertex[side][m->triangle[t][0]]);
    if (m->cell_triangle[a] & 1) mpz_neg(o->x, o->x);
    mpq_set_z(o->s, o->x);
    mpq_add(out, out, o->s);
  }
}

/* out / (count 2^(power dimension)) as a double. */
static inline double oracle_value_(const oracle *o, const mpq_t x, int count, int dimension)
{
  mpq_t  y;
  double value;

  mpq_init(y);
  mpq_set_ui(y, 1, (unsigned long)count);
  mpq_mul(y, y, x);
  mpq_div_2exp(y, y, (mp_bitcnt_t)(o->power * dimension));
  value = mpq_get_d(y);
  mpq_clear(y);
  return value;
}

/* What is asked besides the crossings, V, M and S. */
typedef enum oracle_demand {
  ORACLE_EXACT,  /* the pairs are those of volumes that are not zero, and every cell's cover follows from them    */
  ORACLE_TANGLED /* the pairs likewise; bars by the cells' boxes, as volumes may vanish where cells are tangled   */
} oracle_demand;

/* ---- the comparison ------------------------------------------------------------------------------------------------- */

static inline double oracle_box_volume_(const laid *l, int side, rm_lid c)
{
  const double *box = l->mesh[side]->cell_box[l->place[side][c]];
  return (box[3] - box[0]) * (box[4] - box[1]) * (box[5] - box[2]);
}

static inline void oracle_check_pair_(oracle *o, rm_lid i, rm_lid j, oracle_demand demand)
{
  const laid   *l = o->l;
  const int64_t listed = laid_pair(l, i, j), k = listed >= 0 && l->moments->flags[listed] & RM_PAIR_EMPTY ? -1 : listed;
  const double *c = l->part.piece[0].cell_centroid[l->place[0][i]], *box = l->mesh[0]->cell_box[l->place[0][i]];
  const double  least = demand == ORACLE_TANGLED ? fmin(oracle_box_volume_(l, 0, i), oracle_box_volume_(l, 1, j))
                                                 : fmin(fabs(laid_cell_volume(l, 0, i)), fabs(laid_cell_volume(l, 1, j)));
  const double  size = fmax(box[3] - box[0], fmax(box[4] - box[1], box[5] - box[2])), want = oracle_value_(o, o->sum[0], 6, 3);
  mpq_t         about[3], moment[3], x;

  if ((k >= 0) != (mpq_sgn(o->sum[0]) != 0))
    rt_fail_(__FILE__, __LINE__, "pair (%d, %d) of volume %.17g %s (%.17g)", i, j, want, k >= 0 ? "is listed" : "is missing",
             k >= 0 ? l->moments->volume[k] : 0.0);
  RT_NEAR(k >= 0 ? l->moments->volume[k] : 0.0, want, 1e-13 * least);
  if (k < 0) return;
  mpq_init(x);
  for (int d = 0; d < 3; d++) {
    mpq_inits(about[d], moment[d], NULL);
    mpq_set_d(about[d], ldexp(c[d], o->power));
    mpq_set_ui(x, 4, 1);
    mpq_mul(x, x, about[d]);
    mpq_mul(x, x, o->sum[0]);
    mpq_sub(moment[d], o->sum[1 + d], x);
    RT_NEAR(l->moments->moment[k][d], oracle_value_(o, moment[d], 24, 4), 1e-13 * least * size);
  }
  for (int h = 0; h < 6 && l->moments->second; h++) { /* S about c = S - c M(c) - M c */
    const int a = oracle_row_[h], b = oracle_column_[h];

    mpq_mul(x, about[a], moment[b]);
    mpq_mul(o->s, about[b], o->sum[1 + a]);
    mpq_add(x, x, o->s);
    mpq_set_ui(o->s, 5, 1);
    mpq_mul(x, x, o->s);
    mpq_sub(x, o->sum[4 + h], x);
    RT_NEAR(l->moments->second[k][h], oracle_value_(o, x, 120, 5), 1e-13 * least * size * size);
  }
  for (int d = 0; d < 3; d++) mpq_clears(about[d], moment[d], NULL);
  mpq_clear(x);
}

/* Compare an overlay with the oracle: the crossings, the set of pairs, V, M and S, and how every cell is covered. */
static inline void oracle_check(const laid *l, oracle_demand demand)
{
  oracle *o = oracle_new(l);
  mpq_t  *total[2], cell;

  mpq_init(cell);
  for (int side = 0; side < 2; side++) {
    oracle_check_crossings(o, side);
    total[side] = tm_alloc_(l->num[side], sizeof **total);
    for (rm_lid c = 0; c < l->num[side]; c++) mpq_init(total[side][c]);
  }
  for (rm_lid i = 0; i < l->num[0]; i++)
    for (rm_lid j = 0; j < l->num[1]; j++) {
      if (l->place[0][i] < 0 || l->place[1][j] < 0) continue;
      if (!rm_box_meets(l->mesh[0]->cell_box[l->place[0][i]], l->mesh[1]->cell_box[l->place[1][j]])) {
        RT_EQ(laid_pair(l, i, j), -1);
        continue;
      }
      oracle_integrate(o, l->place[0][i], l->place[1][j]);
      mpq_add(total[0][i], total[0][i], o->sum[0]);
      mpq_add(total[1][j], total[1][j], o->sum[0]);
      oracle_check_pair_(o, i, j, demand);
    }
  for (int side = 0; side < 2; side++) {
    for (rm_lid c = 0; c < l->num[side]; c++) {
      if (l->place[side][c] < 0) {
        mpq_clear(total[side][c]);
        continue;
      }
      oracle_cell(o, side, l->place[side][c], cell);
      const remap_cover want = !mpq_sgn(total[side][c])          ? REMAP_UNCOVERED
                               : mpq_equal(total[side][c], cell) ? REMAP_COVERED
                                                                 : REMAP_PARTIAL;
      const remap_cover got  = laid_cover(l, side, c);
      if (demand == ORACLE_EXACT && got != want)
        rt_fail_(__FILE__, __LINE__, "cell %d of mesh %d has cover %d, want %d (%.17g of %.17g)", c, side, got, want,
                 oracle_value_(o, total[side][c], 6, 3), oracle_value_(o, cell, 6, 3));
      mpq_clear(total[side][c]);
    }
    free(total[side]);
  }
  mpq_clear(cell);
  oracle_free(o);
}

/* Lay one mesh over the other and compare: both triangulations, both ways round. The meshes are given up. */
static inline void oracle_agrees(tm_mesh *a, tm_mesh *b)
{
  for (int way = 0; way < 4; way++) {
    laid *l = laid_over(way & 1 ? b : a, way & 1 ? a : b, way & 2 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, NULL);

    if (RT_EQ(l->status, REMAP_OK)) oracle_check(l, ORACLE_EXACT);
    laid_free(l);
  }
  tm_free(a);
  tm_free(b);
}

#endif
