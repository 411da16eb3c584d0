/* decide -- does a pair have volume, does a skin pass through it: exact answers where rounding leaves a doubt (DESIGN 2.6). */
#include <math.h>
#include <string.h>
#include "geom/exact.h"
#include "moments/moments_private.h"

/* ---- does a pair have volume, does a skin pass through it (DESIGN 2.6) ------------------------------------------------- */

static double largest_extent(const double box[6])
{
  return fmax(box[3] - box[0], fmax(box[4] - box[1], box[5] - box[2]));
}

/* Extent of what the pair's points are computed from: edges and faces of i, of j. */
static double operand_extent(const work *w, rm_lid i, const slot *s)
{
  const double a = largest_extent(w->o->mesh[0]->cell_box[i]), b = largest_extent(w->o->mesh[1]->cell_box[s->target]);
  return (s->kinds & (FROM_SOURCE | FROM_BOTH) ? a : 0) + (s->kinds & (FROM_TARGET | FROM_BOTH) ? b : 0) + s->reach;
}

/* Forward error of 6 V: in units of u = 2^-53, a point errs by 4 extents, a plane's height by 6, a cone's double area by 3 sqrt(3)
 * reach^2 at most: together less than 2^7 extent reach^2 per cone. */
double rm_moments_noise(const work *w, rm_lid i, const slot *s)
{
  return 0x1p-46 * (s->num_cones + 1) * s->reach * s->reach * operand_extent(w, i, s);
}

/* The polygon has area beyond rounding: its points err by 4 extents, in units of u, however small it is itself. */
static bool has_area(const work *w, rm_lid i, const slot *s, const polygon *g)
{
  const double *n = w->o->mesh[g->mesh]->normal[g->triangle];
  const double  length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  return fabs(g->area) > 0x1p-46 * (g->num_cones + 1) * g->reach * operand_extent(w, i, s) * length;
}

static bool coplanar(const work *w, int mesh_a, rm_lid a, int mesh_b, rm_lid b)
{
  const rm_trimesh *m = w->o->mesh[mesh_a], *k = w->o->mesh[mesh_b];
  const rm_lid     *v = m->triangle[a];

  for (int c = 0; c < 3; c++)
    if (rm_orient3d(m->vertex[v[0]], m->vertex[v[1]], m->vertex[v[2]], k->vertex[k->triangle[b][c]]) != 0) return false;
  return true;
}

/* +1 if the normals of triangles a and b out of their cells, cell[mesh], point the same way, -1 if opposite; means something for
 * coplanar ones. */
static int facing(const work *w, const rm_lid cell[2], int mesh_a, rm_lid a, int mesh_b, rm_lid b)
{
  const rm_trimesh *m = w->o->mesh[mesh_a], *k = w->o->mesh[mesh_b];
  const double     *n = m->normal[a], *o = k->normal[b];
  const bool        flip = (m->side[a][0] == cell[mesh_a]) != (k->side[b][0] == cell[mesh_b]);

  return (n[0] * o[0] + n[1] * o[1] + n[2] * o[2] > 0) != flip ? 1 : -1;
}

/* ---- limits: where the crossings are without simulation of simplicity ---------------------------------------------------- */

/* Where a crossing lies exactly: nowhere in particular, at end h of its edge, at corner h of its triangle. */
enum { AT_NOTHING = 1, AT_END, AT_CORNER = AT_END + 2 };

/* AT_END + h if that end lies in the triangle's plane, AT_CORNER + h if that corner lies on the edge's line. */
static int find_limit(const rm_overlay *o, const corner *c)
{
  const rm_trimesh *own = o->mesh[c->mesh], *other = o->mesh[1 - c->mesh];
  const rm_lid     *t = other->triangle[c->triangle];
  const double     *p[2], *v[3];
  bool              on[3];

  for (int h = 0; h < 3; h++) v[h] = other->vertex[t[h]];
  for (int h = 0; h < 2; h++) {
    p[h] = own->vertex[own->edge[c->edge][h]];
    if (rm_orient3d(v[0], v[1], v[2], p[h]) == 0) return AT_END + h;
  }
  for (int h = 0; h < 3; h++) (void)rm_edge_side(p[0], p[1], v[h], v[(h + 1) % 3], 1, &on[h]);
  for (int h = 0; h < 3; h++)
    if (on[h] && on[(h + 1) % 3]) return AT_CORNER + (h + 1) % 3;
  return AT_NOTHING;
}

/* The vertex at which a corner lies exactly, NULL if it lies at none. A crossing is a corner of many polygons: its answer is kept. */
static const double *limit_vertex(const work *w, const corner *c)
{
  const rm_trimesh *own = w->o->mesh[c->mesh], *other = w->o->mesh[1 - c->mesh];

  if (c->edge < 0) return c->vertex;
  uint8_t *at = &w->limit[c->mesh][c->crossing];
  if (!*at) *at = (uint8_t)find_limit(w->o, c);
  if (*at == AT_NOTHING) return NULL;
  return *at < AT_CORNER ? own->vertex[own->edge[c->edge][*at - AT_END]] : other->vertex[other->triangle[c->triangle][*at - AT_CORNER]];
}

/* The projection of a corner's limit along axis k in homogeneous coordinates (x, y, w): for a crossing of p0 + lambda u, lambda =
 * N / D, the integers (D p0 + N u, D). Coordinates count in units of 2^-scale. */
static void homogeneous(const rm_overlay *o, const corner *c, const double *vertex, int k, int scale, rm_int out[3])
{
  const int axis[2] = {(k + 1) % 3, (k + 2) % 3};

  if (vertex) {
    for (int h = 0; h < 2; h++) rm_int_from_double(&out[h], vertex[axis[h]], scale);
    rm_int_from_double(&out[2], 1, 0);
    return;
  }
  const rm_trimesh *own = o->mesh[c->mesh], *other = o->mesh[1 - c->mesh];
  const rm_lid     *t = other->triangle[c->triangle];
  const double     *p0 = own->vertex[own->edge[c->edge][0]], *p1 = own->vertex[own->edge[c->edge][1]], *t0 = other->vertex[t[0]];
  rm_int            u[3], a[3], b[3], n[3], down[3], up, product, x;

  for (int d = 0; d < 3; d++) {
    rm_int_from_difference(&u[d], p1[d], p0[d], scale);
    rm_int_from_difference(&a[d], other->vertex[t[1]][d], t0[d], scale);
    rm_int_from_difference(&b[d], other->vertex[t[2]][d], t0[d], scale);
    rm_int_from_difference(&down[d], t0[d], p0[d], scale);
  }
  rm_int_cross(n, a, b);
  rm_int_dot(&up, n, down);
  rm_int_dot(&out[2], n, u);
  for (int h = 0; h < 2; h++) {
    rm_int_from_double(&x, p0[axis[h]], scale);
    rm_int_mul(&out[h], &out[2], &x);
    rm_int_mul(&product, &up, &u[axis[h]]);
    rm_int_add(&out[h], &out[h], &product);
  }
}

static bool is_same(const double *a, const double *b) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }

/* ---- polygons, found by pair and triangle ---------------------------------------------------------------------------------- */

enum { FEW_BUCKETS = 256 };

static int bucket_of(const work *w, rm_lid target, int mesh, rm_lid triangle)
{
  const uint64_t key = (uint64_t)(uint32_t)target << 32 | (uint32_t)(2 * triangle + mesh);
  return (int)(rm_hash_word(key) & (uint64_t)(w->num_buckets - 1));
}

static remap_status set_buckets(work *w, int num)
{
  RM_TRY(rm_grow(&w->bucket, &w->bucket_room, num, sizeof *w->bucket));
  w->num_buckets = num;
  for (int b = 0; b < num; b++) w->bucket[b] = -1;
  for (int k = 0; k < w->num_polygons; k++) {
    int *bucket = &w->bucket[bucket_of(w, w->polygon[k].target, w->polygon[k].mesh, w->polygon[k].triangle)];
    w->polygon[k].chain = *bucket;
    *bucket             = k;
  }
  return REMAP_OK;
}

remap_status rm_moments_no_polygons(work *w)
{
  w->num_polygons = w->num_corners = 0;
  return set_buckets(w, FEW_BUCKETS);
}

/* The polygon of a pair in a plane, a new one if it has none yet. NULL: w->status tells. */
static polygon *find_polygon(work *w, slot *s, const plane *pl)
{
  polygon *g;

  if (pl->mesh == 0 && s->last_polygon >= 0 && w->polygon[s->last_polygon].triangle == pl->triangle) return &w->polygon[s->last_polygon];
  for (int k = w->bucket[bucket_of(w, s->target, pl->mesh, pl->triangle)]; k >= 0; k = w->polygon[k].chain) {
    g = &w->polygon[k];
    if (g->triangle == pl->triangle && g->mesh == pl->mesh && g->target == s->target) return g;
  }
  if (w->num_polygons == w->num_buckets && (w->status = set_buckets(w, 4 * w->num_buckets)) != REMAP_OK) return NULL;
  if ((w->status = rm_grow(&w->polygon, &w->polygon_room, w->num_polygons + 1, sizeof *w->polygon)) != REMAP_OK) return NULL;
  int *bucket = &w->bucket[bucket_of(w, s->target, pl->mesh, pl->triangle)];
  g           = &w->polygon[w->num_polygons];
  *g = (polygon){.next = s->first_polygon, .chain = *bucket, .target = s->target, .mesh = pl->mesh, .triangle = pl->triangle, .first_corner = -1};
  if (pl->mesh == 0) s->last_polygon = w->num_polygons;
  *bucket = s->first_polygon = w->num_polygons++;
  return g;
}

/* The polygon's area, for pairs that are in doubt. */
static void add_polygon_side(work *w, rm_lid j, double sign, const plane *pl, const point *p, const point *q)
{
  slot         *s = &w->slots[w->slot_of[j]];
  const double *n = pl->n;
  const point  *start = sign > 0 ? p : q, *end = sign > 0 ? q : p; /* going round the polygon */
  double        a[3], b[3];
  polygon      *g;
  corner       *c;

  if (s->first_polygon == NO_POLYGONS || w->status != REMAP_OK) return;
  if (!(s->kinds & IN_DOUBT) && !w->o->mesh[pl->mesh]->triangle_is_skin[pl->triangle]) return;
  if (!(g = find_polygon(w, s, pl))) return;
  relative(p, s->o, a);
  relative(q, s->o, b);
  if (!g->num_cones) memcpy(g->first, a, sizeof g->first);
  for (int d = 0; d < 3; d++) {
    a[d] -= g->first[d];
    b[d] -= g->first[d];
    g->reach = fmax(g->reach, fmax(fabs(a[d]), fabs(b[d])));
  }
  if ((w->status = rm_grow(&w->corner, &w->corner_room, w->num_corners + 2, sizeof *w->corner)) != REMAP_OK) return;
  c    = &w->corner[w->num_corners];
  c[0] = (corner){g->first_corner, start->mesh, start->edge, start->triangle, start->crossing, start->base};
  c[1] = (corner){-1, end->mesh, end->edge, end->triangle, end->crossing, end->base};
  g->first_corner = w->num_corners;
  w->num_corners += 2;
  g->area += sign * (n[0] * (a[1] * b[2] - a[2] * b[1]) + n[1] * (a[2] * b[0] - a[0] * b[2]) + n[2] * (a[0] * b[1] - a[1] * b[0]));
  g->num_cones++;
}

void rm_moments_add_polygon(work *w, rm_lid i, const rm_lid j[2], int kind, double sign, const plane *pl, const point *p, const point *q)
{
  (void)i, (void)kind;
  for (int h = 0; h < 2; h++)
    if (j[h] >= 0) add_polygon_side(w, j[h], h ? -sign : sign, pl, p, q);
}

/* The axis along which the polygon's triangle is largest. */
static int longest_axis(const work *w, const polygon *g)
{
  const double *n = w->o->mesh[g->mesh]->normal[g->triangle];
  const int     k = fabs(n[1]) > fabs(n[0]) ? 1 : 0;
  return fabs(n[2]) > fabs(n[k]) ? 2 : k;
}

/* All corners of a polygon have their limits on one line. Exact. */
static bool is_line(const work *w, const polygon *g)
{
  const double *one = NULL, *other = NULL;
  const int     k = longest_axis(w, g), scale = RM_INT_SCALE;
  bool          simple = true;
  rm_int        first[3], at[3], line[3], d;
  bool          has_first = false, has_line = false;

  for (int c = g->first_corner; c >= 0 && simple; c = w->corner[c].next) { /* mostly the same vertex or two, again and again */
    const double *v = limit_vertex(w, &w->corner[c]);
    if (!one) one = v;
    else if (v && !other && !is_same(v, one)) other = v;
    simple = v && (is_same(v, one) || (other && is_same(v, other)));
  }
  if (simple) return true;
  for (int c = g->first_corner; c >= 0; c = w->corner[c].next) {
    homogeneous(w->o, &w->corner[c], limit_vertex(w, &w->corner[c]), k, scale, has_first ? at : first);
    if (!has_first) {
      has_first = true;
    } else if (!has_line) {
      rm_int_cross(line, first, at);
      has_line = rm_int_sign(&line[0]) || rm_int_sign(&line[1]) || rm_int_sign(&line[2]);
    } else {
      rm_int_dot(&d, line, at);
      if (rm_int_sign(&d)) return false;
    }
  }
  return true;
}

/* Both ends of the side that begins with corner c, going round. */
static void side_ends(const work *w, int c, int k, rm_int start[3], rm_int end[3])
{
  const corner *to = &w->corner[c + 1];

  homogeneous(w->o, &w->corner[c], limit_vertex(w, &w->corner[c]), k, RM_INT_SCALE, start);
  homogeneous(w->o, to, limit_vertex(w, to), k, RM_INT_SCALE, end);
}

static bool is_same_place(const rm_int a[3], const rm_int b[3])
{
  rm_int x, y;

  for (int h = 0; h < 2; h++) {
    rm_int_mul(&x, &a[h], &b[2]);
    rm_int_mul(&y, &b[h], &a[2]);
    rm_int_sub(&x, &x, &y);
    if (rm_int_sign(&x)) return false;
  }
  return true;
}

static bool is_on(const rm_int line[3], const rm_int at[3])
{
  rm_int d;

  rm_int_dot(&d, line, at);
  return rm_int_sign(&d) == 0;
}

/* The polygon's limit has no area: on every line, as many of the sides that lie there start as end at any place, for only then do
 * they run to and fro. O(sides squared), exact. */
static bool is_without_area(const work *w, const polygon *g)
{
  const int k = longest_axis(w, g);
  rm_int    from[3], to[3], line[3], start[3], end[3];

  if (is_line(w, g)) return true;
  for (int c = g->first_corner; c >= 0; c = w->corner[c].next) {
    int balance[2] = {0, 0};

    side_ends(w, c, k, from, to);
    if (is_same_place(from, to)) continue;
    rm_int_cross(line, from, to);
    for (int d = g->first_corner; d >= 0; d = w->corner[d].next) {
      side_ends(w, d, k, start, end);
      if (!is_on(line, start) || !is_on(line, end)) continue;
      balance[0] += is_same_place(start, from) - is_same_place(end, from);
      balance[1] += is_same_place(start, to) - is_same_place(end, to);
    }
    if (balance[0] || balance[1]) return false;
  }
  return true;
}

/* ------------------------------------------------------------------------------------------------------------------------ */

/* The polygons of a pair without volume cancel: each one whose limit has area meets an exactly coplanar one that faces the other
 * way. In untangled cells the reverse holds too. */
bool rm_moments_has_volume(const work *w, rm_lid i, const slot *s)
{
  const rm_lid cell[2] = {i, s->target};

  for (int k = s->first_polygon; k >= 0; k = w->polygon[k].next) {
    const polygon *g = &w->polygon[k];
    bool           cancels = false;

    if (!has_area(w, i, s, g) && is_without_area(w, g)) continue;
    for (int l = s->first_polygon; l >= 0 && !cancels; l = w->polygon[l].next) {
      const polygon *h = &w->polygon[l];
      cancels = l != k && facing(w, cell, g->mesh, g->triangle, h->mesh, h->triangle) < 0 &&
                coplanar(w, g->mesh, g->triangle, h->mesh, h->triangle);
    }
    if (!cancels) return true;
  }
  return false;
}

/* Area shared by triangles a and b projected along axis k, by clipping one at the sides of the other; computed relative to o. */
static double shared_area(const double *const a[3], const double *const b[3], int k, const double o[3])
{
  const int x = (k + 1) % 3, y = (k + 2) % 3;
  double    loop[2][8][2], area = 0;
  int       n = 3, from = 0;
  double    c[3][2];

  for (int h = 0; h < 3; h++) {
    loop[0][h][0] = a[h][x] - o[x], loop[0][h][1] = a[h][y] - o[y];
    c[h][0] = b[h][x] - o[x], c[h][1] = b[h][y] - o[y];
  }
  const double turn = (c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[1][1] - c[0][1]) * (c[2][0] - c[0][0]) < 0 ? -1 : 1;
  for (int h = 0; h < 3; h++, from = 1 - from) {
    const double *p = c[h], u[2] = {c[(h + 1) % 3][0] - p[0], c[(h + 1) % 3][1] - p[1]};
    double      (*in)[2] = loop[from], (*out)[2] = loop[1 - from];
    int           m = 0;
    for (int i = 0; i < n; i++) {
      const double *q = in[i], *r = in[(i + 1) % n];
      const double  s = turn * (u[0] * (q[1] - p[1]) - u[1] * (q[0] - p[0])), t = turn * (u[0] * (r[1] - p[1]) - u[1] * (r[0] - p[0]));
      if (s >= 0) out[m][0] = q[0], out[m][1] = q[1], m++;
      if ((s > 0 && t < 0) || (s < 0 && t > 0)) {
        const double l = s / (s - t);
        out[m][0] = q[0] + l * (r[0] - q[0]), out[m][1] = q[1] + l * (r[1] - q[1]), m++;
      }
    }
    n = m;
  }
  for (int i = 1; i + 1 < n; i++)
    area += (loop[from][i][0] - loop[from][0][0]) * (loop[from][i + 1][1] - loop[from][0][1]) -
            (loop[from][i][1] - loop[from][0][1]) * (loop[from][i + 1][0] - loop[from][0][0]);
  return fabs(area) / 2;
}

/* Simulation of simplicity puts triangle t of mesh `mesh` on the inner side of the coplanar triangle b of the other mesh's cell. */
static bool is_just_inside(const work *w, const rm_lid cell[2], int mesh, rm_lid t, rm_lid b)
{
  const rm_trimesh *other = w->o->mesh[1 - mesh];
  const rm_lid     *v     = other->triangle[b];
  const int         side  = rm_point_side(other->vertex[v[0]], other->vertex[v[1]], other->vertex[v[2]],
                                          w->o->mesh[mesh]->vertex[w->o->mesh[mesh]->triangle[t][0]], mesh ? -1 : 1, NULL);
  return other->side[b][0] == cell[1 - mesh] ? side < 0 : side > 0;
}

/* The skin of a mesh passes through the pair's cell of the other mesh: one of its polygons there has area beyond what lies in
 * coplanar triangles of that cell with the same side outward. (Coincident skins, as of two meshes of one domain, do not make a cell
 * partial. Where they are put just outside the cell they are no polygons of it; where just inside, their area is taken off.) */
bool rm_moments_skin_passes(const work *w, rm_lid i, const slot *s, int mesh, bool is_flat)
{
  const rm_lid      cell[2] = {i, s->target};
  const rm_trimesh *own = w->o->mesh[mesh], *other = w->o->mesh[1 - mesh];

  for (int l = s->first_polygon; l >= 0; l = w->polygon[l].next) {
    const polygon *g = &w->polygon[l];
    const rm_lid   t = g->triangle;

    if (g->mesh != mesh || !own->triangle_is_skin[t] || (!has_area(w, i, s, g) && is_without_area(w, g))) continue;
    const double *n = own->normal[t], square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    const double *v[3] = {own->vertex[own->triangle[t][0]], own->vertex[own->triangle[t][1]], own->vertex[own->triangle[t][2]]};
    int           k    = fabs(n[1]) > fabs(n[0]) ? 1 : 0;
    if (fabs(n[2]) > fabs(n[k])) k = 2;
    const double area = fabs(g->area) / 2 * fabs(n[k]) / square;
    double       shared = 0;
    for (rm_lid a = other->cell_triangle_offset[cell[1 - mesh]]; a < other->cell_triangle_offset[cell[1 - mesh] + 1]; a++) {
      const rm_lid b = other->cell_triangle[a] / 2;
      if (!coplanar(w, mesh, t, 1 - mesh, b)) continue;
      if (!is_flat && (facing(w, cell, mesh, t, 1 - mesh, b) < 0 || !is_just_inside(w, cell, mesh, t, b))) continue;
      const double *c[3] = {other->vertex[other->triangle[b][0]], other->vertex[other->triangle[b][1]], other->vertex[other->triangle[b][2]]};
      shared += shared_area(v, c, k, s->o);
    }
    if (shared == 0 || fabs(area - shared) > 0x1p-40 * area) return true;
  }
  return false;
}
