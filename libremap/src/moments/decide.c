/* decide -- does a pair have volume: the exact answer where rounding leaves a doubt (DESIGN 2.6).
 *
 * In the limit, without simulation of simplicity, the triangles of i and j leave polygons that bound i n j, or what both
 * wind about. The volume is the sum over all planes of height times net area of the polygons in the plane. So polygons that
 * cancel in their plane can go: mostly their sides are the same but for their direction; what is left of a plane has no net
 * area, or has. A body has faces in four planes at least; where fewer are left there is none. Where four or more are left,
 * the sum is taken exactly.
 *
 * Points are told from each other by what they lie on, not by numbers: a vertex, a pair of edges that cross, or a facet and the
 * edge that crosses it. So where planes coincide, a polygon between two of them is seen to have shrunk to a line.
 *
 * All of it holds for any cells, inverted and tangled ones too. O(sides log sides) where the sides cancel, which they do on
 * identical, nested and abutting meshes; exact sums cost as rational.c says. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "moments/moments_private.h"

/* ---- what rounding decides ----------------------------------------------------------------------------------------------- */

static double largest_extent(const double box[6]) { return rm_max(box[3] - box[0], rm_max(box[4] - box[1], box[5] - box[2])); }

/* Extent of what the pair's points are computed from: edges and faces of i, of j. */
static double operand_extent(const work *w, rm_lid i, const slot *s)
{
  const double a = largest_extent(w->o->mesh[0]->cell_box[i]), b = largest_extent(w->o->mesh[1]->cell_box[s->target]);
  return (s->kinds & (FROM_SOURCE | FROM_BOTH) ? a : 0) + (s->kinds & (FROM_TARGET | FROM_BOTH) ? b : 0) + s->reach;
}

/* Forward error of 6 V: in units of u = 2^-53, a point errs by 4 extents, a plane's height by 6, a cone's double area by 3
 * sqrt(3) reach^2 at most: together less than 2^7 extent reach^2 per cone. */
double rm_moments_noise(const work *w, rm_lid i, const slot *s)
{
  return 0x1p-46 * (s->num_cones + 1) * s->reach * s->reach * operand_extent(w, i, s);
}

bool rm_moments_has_area(const work *w, rm_lid i, const slot *s, const polygon *g)
{
  const double *n      = w->o->mesh[g->mesh]->normal[g->triangle];
  const double  length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  return fabs(g->area) > 0x1p-46 * (g->num_cones + 1) * g->reach * operand_extent(w, i, s) * length;
}

static bool is_same(const double *a, const double *b) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }

/* ---- exact questions about triangles ------------------------------------------------------------------------------------- */

bool rm_moments_coplanar(const work *w, int mesh_a, rm_lid a, int mesh_b, rm_lid b)
{
  const rm_trimesh *m = w->o->mesh[mesh_a], *k = w->o->mesh[mesh_b];
  const rm_lid     *v = m->triangle[a];

  for (int c = 0; c < 3; c++)
    if (rm_orient3d(m->vertex[v[0]], m->vertex[v[1]], m->vertex[v[2]], k->vertex[k->triangle[b][c]]) != 0) return false;
  return true;
}

int rm_moments_normal_sign(const rm_trimesh *m, rm_lid t, int axis)
{
  const rm_lid *v = m->triangle[t];
  return rm_cross_sign(m->vertex[v[0]], m->vertex[v[1]], m->vertex[v[0]], m->vertex[v[2]], axis);
}

int rm_moments_axis(const rm_trimesh *m, rm_lid t)
{
  const double *n = m->normal[t];
  int           k = fabs(n[1]) > fabs(n[0]) ? 1 : 0;

  if (fabs(n[2]) > fabs(n[k])) k = 2;
  for (int h = 0; h < 3; h++, k = (k + 1) % 3)
    if (rm_moments_normal_sign(m, t, k)) return k;
  return -1;
}

/* ---- limits: where the crossings are without simulation of simplicity ---------------------------------------------------- */

/* Where a crossing lies exactly: nowhere in particular, at end h of its edge; at corner h of the k-th triangle of its facet
 * (AT_CORNER + 3 k + h), on side h of that one (AT_SIDE + 3 k + h). */
enum { AT_NOTHING = 1, AT_END, AT_CORNER = AT_END + 2, AT_SIDE = AT_CORNER + 3 * RM_MAX_SIDES };

/* The corner of triangle t that lies on the line p0 p1, which is not in its plane; -1 if there is none. *side is one that the
 * line meets elsewhere, -1 likewise. */
static int corner_on_line(const rm_trimesh *m, rm_lid t, const double *const p[2], int *side)
{
  const double *v[3];
  bool          on[3]; /* the line meets that through corners h and h + 1 */

  *side = -1;
  for (int h = 0; h < 3; h++) v[h] = m->vertex[m->triangle[t][h]];
  for (int h = 0; h < 2; h++) on[h] = rm_orient3d(p[0], p[1], v[h], v[h + 1]) == 0;
  if (on[0] && on[1]) return 1;
  on[2] = rm_orient3d(p[0], p[1], v[2], v[0]) == 0;
  if (on[2] && (on[0] || on[1])) return on[0] ? 0 : 2;
  for (int h = 0; h < 3; h++)
    if (on[h] && !rm_is_inner(m, t, h)) *side = h;
  return -1;
}

/* AT_END + h if that end lies in the facet's plane; by the first triangle that tells, AT_CORNER and more if that corner lies on
 * the edge's line, else AT_SIDE and more if the edge's line meets the line of that side. */
static int find_limit(const rm_trimesh *m, rm_lid facet, const double *const p[2])
{
  const rm_lid *v = m->triangle[facet];
  rm_lid        t = facet;
  int           on_side = AT_NOTHING, k = 0;

  for (int h = 0; h < 2; h++)
    if (rm_orient3d(m->vertex[v[0]], m->vertex[v[1]], m->vertex[v[2]], p[h]) == 0) return AT_END + h;
  do {
    int       side;
    const int corner = corner_on_line(m, t, p, &side);

    if (corner >= 0) return AT_CORNER + 3 * k + corner;
    if (side >= 0 && on_side == AT_NOTHING) on_side = AT_SIDE + 3 * k + side;
    t = rm_facet_next(m, t);
    k++;
  } while (t != facet);
  return on_side;
}

/* Give a locus its vertex, if it has one, and its edges. A crossing is the end of many sides: its answer is kept. */
static void settle_locus(const work *w, locus *l)
{
  if (l->crossing < 0) return;
  const rm_trimesh  *own = w->o->mesh[l->mesh], *other = w->o->mesh[1 - l->mesh];
  const rm_crossing *x = &w->o->trace[l->mesh].crossing[l->crossing];
  const rm_lid      *e = own->edge[x->edge];
  rm_lid             t = x->triangle / 2;
  uint8_t           *at = &w->limit[l->mesh][l->crossing];

  if (!*at) *at = (uint8_t)find_limit(other, t, (const double *const[2]){own->vertex[e[0]], own->vertex[e[1]]});
  l->edge[l->mesh] = x->edge;
  if (*at == AT_NOTHING) return;
  if (*at < AT_CORNER) {
    l->vertex = own->vertex[e[*at - AT_END]];
    return;
  }
  const int from = *at >= AT_SIDE ? *at - AT_SIDE : *at - AT_CORNER;

  for (int k = 0; k < from / 3; k++) t = rm_facet_next(other, t);
  if (*at >= AT_SIDE) l->edge[1 - l->mesh] = other->triangle_edge[t][from % 3];
  else l->vertex = other->vertex[other->triangle[t][from % 3]];
}

/* A settled locus where two edges cross: both meshes may have it as a crossing, with one triangle or another. */
static bool is_of_edges(const locus *l) { return !l->vertex && l->edge[0] >= 0 && l->edge[1] >= 0; }

static bool is_same_locus(const locus *a, const locus *b)
{
  if (a->vertex || b->vertex) return a->vertex && b->vertex && is_same(a->vertex, b->vertex);
  if (is_of_edges(a) || is_of_edges(b)) return a->edge[0] == b->edge[0] && a->edge[1] == b->edge[1];
  return a->crossing == b->crossing && a->mesh == b->mesh;
}

/* True if the locus is known to lie on an edge's line. */
static bool is_on_edge(const work *w, const locus *l, int mesh, rm_lid edge)
{
  const rm_trimesh *m = w->o->mesh[mesh];

  return l->edge[mesh] == edge ||
         (l->vertex && (is_same(l->vertex, m->vertex[m->edge[edge][0]]) || is_same(l->vertex, m->vertex[m->edge[edge][1]])));
}

void rm_moments_settle(work *w, polygon *g)
{
  int *link = &g->first_side;

  for (int k = *link; k >= 0 && !g->is_settled; k = *link) {
    polygon_side *s = &w->side[k];

    settle_locus(w, &s->from);
    settle_locus(w, &s->to);
    if (is_same_locus(&s->from, &s->to))
      *link = s->next;
    else
      link = &s->next;
  }
  g->is_settled = true;
}

/* ---- polygons, found by pair and triangle -------------------------------------------------------------------------------- */

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
    int *bucket         = &w->bucket[bucket_of(w, w->polygon[k].target, w->polygon[k].mesh, w->polygon[k].triangle)];
    w->polygon[k].chain = *bucket;
    *bucket             = k;
  }
  return REMAP_OK;
}

remap_status rm_moments_no_polygons(work *w)
{
  w->num_polygons = w->num_sides = 0;
  return set_buckets(w, FEW_BUCKETS);
}

/* The polygon of a pair in a plane, a new one if it has none yet. NULL: w->status tells. */
static polygon *find_polygon(work *w, slot *s, const plane *pl)
{
  polygon *g = s->last_polygon >= 0 ? &w->polygon[s->last_polygon] : NULL;

  if (g && pl->mesh == 0 && g->triangle == pl->triangle) return g;
  for (int k = w->bucket[bucket_of(w, s->target, pl->mesh, pl->triangle)]; k >= 0; k = w->polygon[k].chain) {
    g = &w->polygon[k];
    if (g->triangle == pl->triangle && g->mesh == pl->mesh && g->target == s->target) return g;
  }
  if (w->num_polygons == w->num_buckets && (w->status = set_buckets(w, 4 * w->num_buckets)) != REMAP_OK) return NULL;
  if ((w->status = rm_grow(&w->polygon, &w->polygon_room, w->num_polygons + 1, sizeof *w->polygon)) != REMAP_OK) return NULL;
  int *bucket = &w->bucket[bucket_of(w, s->target, pl->mesh, pl->triangle)];
  g           = &w->polygon[w->num_polygons];
  *g          = (polygon){.next       = s->first_polygon,
                          .chain      = *bucket,
                          .target     = s->target,
                          .mesh       = pl->mesh,
                          .triangle   = pl->triangle,
                          .first_side = -1};
  if (pl->mesh == 0) s->last_polygon = w->num_polygons;
  *bucket = s->first_polygon = w->num_polygons++;
  return g;
}

static locus locus_of(const point *p) { return (locus){p->edge < 0 ? p->base : NULL, p->mesh, p->crossing, {-1, -1}}; }

/* The polygon's rounded area and its sides, for pairs that are in doubt, and for skins. */
static void add_polygon_side(work *w, rm_lid j, double sign, const plane *pl, const point *p, const point *q)
{
  slot         *s = &w->slots[w->slot_of[j]];
  const double *n = pl->n;
  double        a[3], b[3];
  polygon      *g;

  if (s->first_polygon == NO_POLYGONS || w->status != REMAP_OK) return;
  if (!(s->kinds & IN_DOUBT) && !w->o->mesh[pl->mesh]->triangle_is_skin[pl->triangle]) return;
  if (!(g = find_polygon(w, s, pl))) return;
  relative(p, s->o, a);
  relative(q, s->o, b);
  if (!g->num_cones) memcpy(g->first, a, sizeof g->first);
  for (int d = 0; d < 3; d++) {
    a[d] -= g->first[d];
    b[d] -= g->first[d];
    g->reach = rm_max(g->reach, rm_max(fabs(a[d]), fabs(b[d])));
  }
  g->area +=
      sign * (n[0] * (a[1] * b[2] - a[2] * b[1]) + n[1] * (a[2] * b[0] - a[0] * b[2]) + n[2] * (a[0] * b[1] - a[1] * b[0]));
  g->num_cones++;
  if ((w->status = rm_grow(&w->side, &w->side_room, w->num_sides + 1, sizeof *w->side)) != REMAP_OK) return;
  w->side[w->num_sides] = (polygon_side){g->first_side, (int)sign, locus_of(p), locus_of(q), pl->v};
  g->first_side         = w->num_sides++;
}

void rm_moments_add_polygon(work *w, const rm_lid j[2], double sign, const plane *pl, const plane *other, const point *p,
                            const point *q)
{
  for (int h = 0; h < 2; h++) {
    if (j[h] < 0) continue;
    add_polygon_side(w, j[h], h ? -sign : sign, pl, p, q);
    if (other) add_polygon_side(w, j[h], h ? sign : -sign, other, p, q);
  }
}

/* ---- sides that cancel --------------------------------------------------------------------------------------------------- */

static uint64_t locus_key(const locus *p)
{
  if (p->vertex) return rm_hash_point(p->vertex);
  return rm_hash_word(is_of_edges(p) ? (uint64_t)p->edge[0] << 32 | (uint64_t)p->edge[1]
                                     : 2 * (uint64_t)p->crossing + (uint64_t)p->mesh);
}

/* +1: the same side, -1: the same but for its direction, 0: another one. */
static int compare_sides(const polygon_side *a, const polygon_side *b)
{
  if (is_same_locus(&a->from, &b->from) && is_same_locus(&a->to, &b->to)) return 1;
  return is_same_locus(&a->from, &b->to) && is_same_locus(&a->to, &b->from) ? -1 : 0;
}

enum { FEW = 24 };

static remap_status sort_keys(work *w, int n)
{
  if (n > FEW) {
    RM_TRY(rm_grow(&w->spare, &w->spare_room, n, sizeof *w->spare));
    rm_sort_keyed(w->key, w->spare, n);
    return REMAP_OK;
  }
  for (int i = 1; i < n; i++) {
    const rm_keyed x = w->key[i];
    int            k = i;
    for (; k > 0 && w->key[k - 1].key > x.key; k--) w->key[k] = w->key[k - 1];
    w->key[k] = x;
  }
  return REMAP_OK;
}

/* Of n sides of one plane, leave in list those that do not cancel; their number, -1 if memory ran out. Sides that count
 * equally often one way as the other stand side by side once they are sorted by what does not tell their directions. */
static int cancel(work *w, int *list, int n)
{
  int left = 0;

  if ((w->status = rm_grow(&w->key, &w->key_room, n, sizeof *w->key)) != REMAP_OK) return -1;
  for (int k = 0; k < n; k++)
    w->key[k] = (rm_keyed){locus_key(&w->side[list[k]].from) + locus_key(&w->side[list[k]].to), list[k]};
  if ((w->status = sort_keys(w, n)) != REMAP_OK) return -1;
  for (int first = 0, end; first < n; first = end) {
    const polygon_side *one     = &w->side[w->key[first].item];
    int                 balance = 0;
    bool                alike   = true;

    for (end = first; end < n && w->key[end].key == w->key[first].key; end++) {
      const polygon_side *s     = &w->side[w->key[end].item];
      const int           order = compare_sides(one, s);
      alike &= order != 0;
      balance += order * s->times;
    }
    if (alike && balance == 0) continue;
    for (int k = first; k < end; k++) list[left++] = (int)w->key[k].item;
  }
  return left;
}

/* ---- polygons by their planes -------------------------------------------------------------------------------------------- */

static const double *corner_of(const work *w, const polygon *g)
{
  const rm_trimesh *m = w->o->mesh[g->mesh];
  return m->vertex[m->triangle[g->triangle][0]];
}

/* End h of a side. */
static const locus *end_of(const polygon_side *s, int h) { return h ? &s->to : &s->from; }

/* True if the polygon's sides are known to lie on an edge of either mesh that passes through x. */
static bool is_along_edge(const work *w, const polygon *g, const locus *x)
{
  for (int mesh = 0; mesh < 2; mesh++) {
    bool all = x->edge[mesh] >= 0;

    for (int k = g->first_side; k >= 0 && all; k = w->side[k].next)
      all = is_on_edge(w, &w->side[k].from, mesh, x->edge[mesh]) && is_on_edge(w, &w->side[k].to, mesh, x->edge[mesh]);
    if (all) return true;
  }
  return false;
}

/* A polygon may have area: its triangle has, and its sides do not run to and fro between two vertices or along an edge. */
static bool may_have_area(work *w, polygon *g)
{
  const double *one = NULL, *other = NULL;
  bool          may = false;

  rm_moments_settle(w, g);
  for (int k = g->first_side; k >= 0 && !may; k = w->side[k].next)
    for (int h = 0; h < 2 && !may; h++) {
      const locus  *x = end_of(&w->side[k], h);
      const double *v = x->vertex;

      if (!v) {
        if (is_along_edge(w, g, x)) return false;
        may = true;
      } else if (!one || is_same(v, one)) {
        one = v;
      } else if (!other || is_same(v, other)) {
        other = v;
      } else {
        may = true;
      }
    }
  return may && rm_moments_axis(w->o->mesh[g->mesh], g->triangle) >= 0;
}

/* The polygons that may have area, plane by plane, into w->plane; their number, -1 if memory ran out. */
static int sort_by_plane(work *w, const slot *s)
{
  int n = 0;

  for (int k = s->first_polygon; k >= 0; k = w->polygon[k].next) {
    if (!may_have_area(w, &w->polygon[k])) continue;
    if ((w->status = rm_grow(&w->plane, &w->plane_room, n + 1, sizeof *w->plane)) != REMAP_OK) return -1;
    w->plane[n++] = k;
  }
  if (n < 4) return n;
  if ((w->status = rm_grow(&w->key, &w->key_room, n, sizeof *w->key)) != REMAP_OK) return -1;
  for (int k = 0; k < n; k++) {
    const polygon *g   = &w->polygon[w->plane[k]];
    uint64_t       key = 0;

    if (n > FEW) {
      const rm_trimesh *m     = w->o->mesh[g->mesh];
      const rm_lid     *t     = m->triangle[g->triangle];
      const rm_modulus *first = rm_moments_modulus(w, 0);
      if (!first) return -1;
      key = rm_residue_of_plane(first, m->vertex[t[0]], m->vertex[t[1]], m->vertex[t[2]]);
    } else {
      while (!rm_moments_coplanar(w, g->mesh, g->triangle, w->polygon[w->plane[key]].mesh, w->polygon[w->plane[key]].triangle))
        key++;
    }
    w->key[k] = (rm_keyed){key, w->plane[k]};
  }
  if ((w->status = sort_keys(w, n)) != REMAP_OK) return -1;
  for (int k = 0; k < n; k++) w->plane[k] = (int)w->key[k].item;
  return n;
}

/* Add what is left of the sides of polygons first .. end - 1 of w->plane, which lie in one plane, to the num in w->left,
 * unless they have no net area; the new number, -1 if memory ran out. */
static int add_plane(work *w, int first, int end, int num)
{
  const polygon *one    = &w->polygon[w->plane[first]];
  const double  *corner = corner_of(w, one);
  int            n      = 0;

  for (int k = first; k < end; k++)
    for (int at = w->polygon[w->plane[k]].first_side; at >= 0; at = w->side[at].next) {
      if ((w->status = rm_grow(&w->left, &w->left_room, num + n + 1, sizeof *w->left)) != REMAP_OK) return -1;
      w->left[num + n++]   = at;
      w->side[at].in_plane = corner;
    }
  n = cancel(w, w->left + num, n);
  if (n <= 0) return n < 0 ? n : num;
  const exact_sum area = {
      .side = w->left + num, .num_sides = n, .axis = rm_moments_axis(w->o->mesh[one->mesh], one->triangle), .origin = corner};
  return rm_moments_is_zero(w, &area) ? num : num + n;
}

/* The end of the run of polygons in w->plane that lie in one plane with polygon first. */
static int run_of_plane(const work *w, int first, int n)
{
  const polygon *one = &w->polygon[w->plane[first]];
  int            end = first + 1;

  while (end < n &&
         rm_moments_coplanar(w, one->mesh, one->triangle, w->polygon[w->plane[end]].mesh, w->polygon[w->plane[end]].triangle))
    end++;
  return end;
}

bool rm_moments_has_volume(work *w, const slot *s)
{
  const int n          = sort_by_plane(w, s);
  int       num_planes = 0, num = 0;

  for (int first = 0; n > 3 && first < n && num_planes < 4; first = run_of_plane(w, first, n)) num_planes++;
  if (num_planes < 4) return false;
  num_planes = 0;
  for (int first = 0, end; first < n; first = end) {
    const int before = num;

    end = run_of_plane(w, first, n);
    num = add_plane(w, first, end, num);
    if (num < 0 || w->status != REMAP_OK) return true;
    num_planes += num > before;
  }
  if (num_planes < 4) return false;
  return !rm_moments_is_zero(
      w, &(exact_sum){.side = w->left, .num_sides = num, .axis = -1, .origin = w->side[w->left[0]].in_plane});
}

void rm_moments_decided(work *w)
{
  free(w->polygon);
  free(w->bucket);
  free(w->side);
  free(w->plane);
  free(w->left);
  free(w->key);
  free(w->spare);
  free(w->strip);
  free(w->modulus);
}
