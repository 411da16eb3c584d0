/* hits -- crossings of the present edge from box trees, exact and in their order: where walking from cell to cell may miss one,
 * and where an edge that is outside meets the skin. O(log n + hits) per edge, expected. */
#include <math.h>
#include <string.h>
#include "overlay/tracer.h"

enum { CLEARANCE = 2 /* lengths of an edge around it that are to be free of skin */ };

/* ---- the present edge and one triangle, or two ----------------------------------------------------------------------- */

/* Sign with which the present edge's line crosses triangle b. Exact. */
static int line_crosses(const tracer *t, rm_lid b)
{
  const rm_lid *e = t->other->triangle_edge[b];
  const int     s = edge_side(t, e[0]);
  return s && edge_side(t, e[1]) == s && edge_side(t, e[2]) == -s ? s : 0;
}

/* What the filter of crosses tells about one triangle: true if the present edge's line passes it by. */
static bool surely_misses(const tracer *t, rm_lid b)
{
  const int    i = t->axis[0], j = t->axis[1], k = t->axis[2];
  double       x[3], y[3], reach = 0;
  int          along = 0, against = 0;

  for (int h = 0; h < 3; h++) {
    const double *q = t->other->vertex[t->other->triangle[b][h]];
    const double  dx = q[i] - t->p0[i], dy = q[j] - t->p0[j], dz = q[k] - t->p0[k];
    x[h]  = dx - t->shear[0] * dz;
    y[h]  = dy - t->shear[1] * dz;
    reach = rm_max(reach, rm_max(fabs(dx), rm_max(fabs(dy), fabs(dz))));
  }
  const double bound = LINE_NOISE * reach * reach;
  for (int h = 0; h < 3; h++) {
    const int    g = (h + 1) % 3;
    const double d = x[h] * y[g] - x[g] * y[h];
    along += d > bound;
    against += d < -bound;
  }
  return along && against;
}

/* Sign of the crossing of the present edge with triangle b, or 0 if they do not meet. Exact. */
static int meets(const tracer *t, rm_lid b)
{
  const int s = line_crosses(t, b);
  return s && end_side(t, b, t->p0) == -s && end_side(t, b, t->p1) == s ? s : 0;
}

int rm_trace_order(const tracer *t, rm_lid a, rm_lid b)
{
  double q[2][3][3];

  if (a == b) return 0;
  for (int h = 0; h < 3; h++) {
    memcpy(q[0][h], t->other->vertex[t->other->triangle[a][h]], sizeof q[0][h]);
    memcpy(q[1][h], t->other->vertex[t->other->triangle[b][h]], sizeof q[1][h]);
  }
  return rm_crossing_order(t->p0, t->p1, (const double (*)[3])q[0], (const double (*)[3])q[1], t->moved);
}

/* Crossings at exactly one place keep the order of triangles, which is canonical. */
static bool comes_before(const tracer *t, hit a, hit b)
{
  const int o = rm_trace_order(t, a.triangle, b.triangle);
  return o < 0 || (o == 0 && a.triangle < b.triangle);
}

/* Put x into the heap of n hits whose root `at` is free. */
static void sift_hit(const tracer *t, hit *h, int at, int n, hit x)
{
  for (int child; (child = 2 * at + 1) < n; at = child) {
    if (child + 1 < n && comes_before(t, h[child], h[child + 1])) child++;
    if (!comes_before(t, x, h[child])) break;
    h[at] = h[child];
  }
  h[at] = x;
}

enum { FEW_HITS = 16 };

/* Few by insertion, many by a heap: an edge may cross a hundred thousand triangles. */
void rm_trace_sort_hits(const tracer *t, hit *h, int n)
{
  for (int i = 1; i < n && n <= FEW_HITS; i++) {
    const hit x = h[i];
    int       k = i;
    for (; k > 0 && comes_before(t, x, h[k - 1]); k--) h[k] = h[k - 1];
    h[k] = x;
  }
  if (n <= FEW_HITS) return;
  for (int i = n / 2; i-- > 0;) sift_hit(t, h, i, n, h[i]);
  for (int i = n; i-- > 1;) {
    const hit x = h[i];

    h[i] = h[0];
    sift_hit(t, h, 0, i, x);
  }
}

/* ---- box trees ------------------------------------------------------------------------------------------------------- */

typedef struct collect {
  tracer       *t;
  const rm_lid *triangle_of; /* NULL: items are triangles */
  hit         **list;
  int64_t      *room;
  int          *num;
  remap_status  status;
} collect;

static int collect_hit(void *user, rm_lid item)
{
  collect     *c = user;
  const rm_lid b = c->triangle_of ? c->triangle_of[item] : item;
  const int    s = surely_misses(c->t, b) ? 0 : meets(c->t, b);

  if (!s) return 0;
  c->status = rm_grow(c->list, c->room, *c->num + 1, sizeof **c->list);
  if (c->status != REMAP_OK) return 1;
  (*c->list)[(*c->num)++] = hit_of(c->t->other, b, s);
  return 0;
}

static remap_status need_all_tree(tracer *t)
{
  const rm_trimesh *m = t->other;
  double          (*box)[6];

  if (t->all_tree) return REMAP_OK;
  if (m->num_skin == m->num_triangles) { /* a closed surface: all is skin, in the same order */
    t->all_tree = m->skin_tree;
    t->all_box  = m->skin_box;
    return REMAP_OK;
  }
  RM_NEW(box, t->scratch, m->num_triangles);
  for (rm_lid b = 0; b < m->num_triangles; b++) {
    const double *v[3] = {m->vertex[m->triangle[b][0]], m->vertex[m->triangle[b][1]], m->vertex[m->triangle[b][2]]};
    for (int c = 0; c < 3; c++) {
      box[b][c]     = fmin(v[0][c], fmin(v[1][c], v[2][c]));
      box[b][c + 3] = fmax(v[0][c], fmax(v[1][c], v[2][c]));
    }
  }
  t->all_box = (const double (*)[6])box;
  return rm_boxtree_build(t->scratch, m->num_triangles, t->all_box, &t->all_tree);
}

remap_status rm_trace_all_hits(tracer *t)
{
  collect c = {t, NULL, &t->hits, &t->hits_room, &t->num_hits, REMAP_OK};

  RM_TRY(need_all_tree(t));
  t->num_hits = 0;
  rm_boxtree_query_segment(t->all_tree, t->all_box, t->p0, t->p1, collect_hit, &c);
  RM_TRY(c.status);
  rm_trace_sort_hits(t, t->hits, t->num_hits);
  return REMAP_OK;
}

/* Around a new start, a box that no skin enters is sought. */
bool rm_trace_is_clear(tracer *t)
{
  double box[6], room[6], size = 0;
  bool   inside = true;

  for (int c = 0; c < 3; c++) {
    box[c]     = t->p0[c] < t->p1[c] ? t->p0[c] : t->p1[c];
    box[c + 3] = t->p0[c] < t->p1[c] ? t->p1[c] : t->p0[c];
    size       = box[c + 3] - box[c] > size ? box[c + 3] - box[c] : size;
    inside     = inside && box[c] >= t->clear[c] && box[c + 3] <= t->clear[c + 3];
  }
  if (inside || t->tried == t->p0) return inside;
  t->tried = t->p0;
  for (int c = 0; c < 3; c++) room[c] = box[c] - CLEARANCE * size, room[c + 3] = box[c + 3] + CLEARANCE * size;
  if (rm_boxtree_meets(t->other->skin_tree, t->other->skin_box, room)) return false;
  memcpy(t->clear, room, sizeof t->clear);
  return true;
}

remap_status rm_trace_need_skin_hits(tracer *t)
{
  collect c = {t, t->other->skin, &t->skin_hits, &t->skin_room, &t->num_skin, REMAP_OK};

  if (t->num_skin >= 0) return REMAP_OK;
  t->num_skin = 0;
  rm_boxtree_query_segment(t->other->skin_tree, t->other->skin_box, t->p0, t->p1, collect_hit, &c);
  RM_TRY(c.status);
  rm_trace_sort_hits(t, t->skin_hits, t->num_skin);
  return REMAP_OK;
}

static int is_met(void *user, rm_lid item)
{
  (void)user, (void)item;
  return 1;
}

bool rm_trace_is_near_odd(const tracer *t)
{
  const rm_trimesh *m = t->other;
  return m->num_odd > 0 && rm_boxtree_query_segment(m->odd_tree, m->odd_box, t->p0, t->p1, is_met, NULL);
}

