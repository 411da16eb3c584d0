/* trimesh -- triangulates a piece of a mesh and puts it in canonical order (DESIGN 2.1, 2.5).
 *
 * Points are sorted by Morton key, triangles and edges are bucketed by their lowest vertex: O(n) time. About 800 bytes per
 * hexahedron with `diagonal`, 1600 with `centre`, 200 more than the former where all faces are planar. */
#include "overlay/facets.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  MAX_LOCAL_TRIANGLES = 166, /* a cell with more is walked through by the box tree */
  MAX_LOCAL_VERTICES  = 256,
  MAX_TRIANGLES       = 1 << 29
};

typedef struct builder {
  rm_arena       *scratch;
  const rm_frame *frame;
  const rm_piece *piece;
  double        (*point)[3]; /* nodes, then centres */
  int64_t         num_points;
  int64_t         num_raw;
  int64_t       (*raw)[3];   /* [num_raw] points, oriented as the face        */
  rm_lid         *raw_face;  /* [num_raw]                                     */
  rm_facets       facets;
} builder;

/* ---- triangulation of the faces -------------------------------------------------------------------------------- */

static remap_status triangulate_faces(builder *b, remap_faces faces)
{
  const rm_piece *p = b->piece;
  int64_t         longest = 3, most = 0;
  double        (*xyz)[3];
  int            *corner, *work;

  for (rm_lid f = 0; f < p->num_faces; f++) {
    const int64_t n = p->face_offset[f + 1] - p->face_offset[f];
    longest = n > longest ? n : longest;
    most += n; /* no triangulation of n corners has more than n triangles */
  }
  if (longest > INT32_MAX / 8 || most > MAX_TRIANGLES) return REMAP_TOO_LARGE;
  RM_NEW(xyz, b->scratch, longest);
  RM_NEW(corner, b->scratch, 3 * (longest + 2));
  RM_NEW(work, b->scratch, 4 * longest + 16);
  RM_NEW(b->point, b->scratch, (int64_t)p->num_nodes + p->num_faces);
  RM_NEW(b->raw, b->scratch, most);
  RM_NEW(b->raw_face, b->scratch, most);
  RM_NEW(b->facets.is_whole, b->scratch, p->num_faces);
  if (p->num_nodes) memcpy(b->point, p->node_xyz, sizeof *b->point * (size_t)p->num_nodes);
  b->num_points = p->num_nodes;
  for (rm_lid f = 0; f < p->num_faces; f++) {
    const rm_lid *node = p->face_node + p->face_offset[f];
    const int     n    = (int)(p->face_offset[f + 1] - p->face_offset[f]);
    double        centre[3];
    bool          used = false;

    for (int k = 0; k < n; k++) memcpy(xyz[k], p->node_xyz[node[k]], sizeof *xyz);
    const int num = rm_triangulate((const double (*)[3])xyz, n, faces, corner, centre, work);
    RM_ASSERT(num <= n);
    for (int k = 0; k < num; k++) {
      for (int h = 0; h < 3; h++) {
        const int c = corner[3 * k + h];
        used |= c == RM_CENTRE_POINT;
        b->raw[b->num_raw][h] = c == RM_CENTRE_POINT ? b->num_points : node[c];
      }
      b->raw_face[b->num_raw++] = f;
    }
    if (used) memcpy(b->point[b->num_points++], centre, sizeof centre);
    b->facets.is_whole[f] = n > 3 && n <= RM_MAX_SIDES && !used && !p->face_is_skin[f] &&
                            rm_is_planar_convex((const double (*)[3])xyz, n);
  }
  return REMAP_OK;
}

/* ---- vertices ---------------------------------------------------------------------------------------------------- */

static int compare_points(const double a[3], const double b[3])
{
  for (int c = 0; c < 3; c++)
    if (a[c] != b[c]) return a[c] < b[c] ? -1 : 1;
  return 0;
}

/* A double's bits, such that they ascend with it. */
static uint64_t ascending(double x)
{
  uint64_t bits;

  memcpy(&bits, &x, sizeof bits);
  return bits >> 63 ? ~bits : bits | UINT64_C(1) << 63;
}

/* Sort n points of equal key by their coordinates: few by insertion, many by one coordinate after the other. */
static void sort_ties(const builder *b, rm_keyed *tie, rm_keyed *spare, int64_t n)
{
  const uint64_t key = tie[0].key;

  if (n > RM_FEW_WORDS) {
    for (int c = 2; c >= 0; c--) {
      for (int64_t i = 0; i < n; i++) tie[i].key = ascending(b->point[tie[i].item][c]);
      rm_sort_keyed(tie, spare, n);
    }
    for (int64_t i = 0; i < n; i++) tie[i].key = key;
    return;
  }
  for (int64_t i = 1; i < n; i++) {
    const rm_keyed x = tie[i];
    int64_t        k = i;
    for (; k > 0 && compare_points(b->point[tie[k - 1].item], b->point[x.item]) > 0; k--) tie[k] = tie[k - 1];
    tie[k] = x;
  }
}

/* Sorted distinct points become vertices; vertex_of[point]. */
static remap_status number_vertices(rm_arena *arena, builder *b, rm_lid *vertex_of, rm_trimesh *m)
{
  const int64_t n = b->num_points;
  rm_keyed     *key, *spare;
  double      (*vertex)[3];
  rm_lid        count = 0;

  if (n > INT32_MAX) return REMAP_TOO_LARGE;
  RM_NEW(key, b->scratch, n);
  RM_NEW(spare, b->scratch, n);
  for (int64_t i = 0; i < n; i++) {
    for (int c = 0; c < 3; c++) b->point[i][c] += 0.0; /* a mean may be -0 */
    key[i] = (rm_keyed){rm_morton(b->frame, b->point[i]), i};
  }
  rm_sort_keyed(key, spare, n);
  for (int64_t i = 0, end; i < n; i = end) {
    for (end = i + 1; end < n && key[end].key == key[i].key; end++) continue;
    if (end > i + 1) sort_ties(b, key + i, spare, end - i);
  }
  RM_NEW(vertex, arena, n);
  for (int64_t i = 0; i < n; i++) {
    const double *p = b->point[key[i].item];
    if (!count || compare_points(vertex[count - 1], p)) memcpy(vertex[count++], p, sizeof *vertex);
    vertex_of[key[i].item] = count - 1;
  }
  m->vertex       = (const double (*)[3])vertex;
  m->num_vertices = count;
  return REMAP_OK;
}

/* ---- triangles --------------------------------------------------------------------------------------------------- */

/* Of triangles with one lowest vertex, the rest of their order. */
static uint64_t order_of(const rm_triple *t)
{
  return (uint64_t)t->v[1] << 32 | (uint64_t)t->v[2] << 1 | t->right;
}

/* Sort n triples by their order, stable: few by insertion, many by way of their keys. */
static remap_status sort_triples(rm_arena *scratch, rm_triple *triple, int64_t n)
{
  rm_keyed  *key, *spare;
  rm_triple *copy;

  for (int64_t i = 1; i < n && n <= RM_FEW_WORDS; i++) {
    const rm_triple x = triple[i];
    int64_t         k = i;
    for (; k > 0 && order_of(&triple[k - 1]) > order_of(&x); k--) triple[k] = triple[k - 1];
    triple[k] = x;
  }
  if (n <= RM_FEW_WORDS) return REMAP_OK;
  RM_NEW(key, scratch, n);
  RM_NEW(spare, scratch, n);
  RM_NEW(copy, scratch, n);
  for (int64_t i = 0; i < n; i++) key[i] = (rm_keyed){order_of(&triple[i]), i};
  rm_sort_keyed(key, spare, n);
  memcpy(copy, triple, sizeof *copy * (size_t)n);
  for (int64_t i = 0; i < n; i++) triple[i] = copy[key[i].item];
  return REMAP_OK;
}

/* Every triangle once per cell beside it, bucketed by its lowest vertex and sorted within the bucket. */
static remap_status collect_triples(const builder *b, const rm_lid *vertex_of, rm_lid num_vertices, rm_triple **out,
                                    int64_t *num)
{
  const rm_piece *p = b->piece;
  int64_t        *offset, n = 0;
  rm_triple      *triple;

  RM_NEW0(offset, b->scratch, (int64_t)num_vertices + 2);
  for (int64_t k = 0; k < b->num_raw; k++) {
    const rm_lid *cell = p->face_cell[b->raw_face[k]];
    rm_lid        low  = INT32_MAX;
    for (int h = 0; h < 3; h++) low = vertex_of[b->raw[k][h]] < low ? vertex_of[b->raw[k][h]] : low;
    offset[low + 2] += 1 + (cell[1] >= 0);
  }
  for (rm_lid v = 0; v < num_vertices; v++) offset[v + 2] += offset[v + 1];
  n = offset[num_vertices + 1];
  if (n > MAX_TRIANGLES) return REMAP_TOO_LARGE;
  RM_NEW(triple, b->scratch, n);
  for (int64_t k = 0; k < b->num_raw; k++) {
    const rm_lid  face = b->raw_face[k];
    rm_triple     t    = {
           {vertex_of[b->raw[k][0]], vertex_of[b->raw[k][1]], vertex_of[b->raw[k][2]]}, 0, face, 0, 0, p->face_is_skin[face]};
    int           odd  = 0;

    if (t.v[0] > t.v[1]) { const rm_lid s = t.v[0]; t.v[0] = t.v[1], t.v[1] = s, odd ^= 1; }
    if (t.v[1] > t.v[2]) { const rm_lid s = t.v[1]; t.v[1] = t.v[2], t.v[2] = s, odd ^= 1; }
    if (t.v[0] > t.v[1]) { const rm_lid s = t.v[0]; t.v[0] = t.v[1], t.v[1] = s, odd ^= 1; }
    for (int h = 0; h < 2; h++) {
      t.cell  = p->face_cell[face][h];
      t.side  = (uint8_t)h;
      t.right = (uint8_t)(odd ^ h); /* the face's normal points out of its owner, which is therefore on the left */
      if (t.cell >= 0) triple[offset[t.v[0] + 1]++] = t;
    }
  }
  for (rm_lid v = 0; v < num_vertices; v++) RM_TRY(sort_triples(b->scratch, triple + offset[v], offset[v + 1] - offset[v]));
  *out = triple;
  *num = n;
  return REMAP_OK;
}

/* The end of the copies of triangle i; *joined if they are two that become one. */
static inline int64_t copies_end(const builder *b, const rm_triple *triple, int64_t i, int64_t num, bool *joined)
{
  const int64_t end = rm_triple_copies(triple, i, num, joined);

  if (*joined && b->facets.any) *joined = rm_facets_admit(&b->facets, &triple[i], &triple[i + 1]);
  return end;
}

/* Join two cells' copies of a triangle that lie on opposite sides; any other copies stay apart, each a skin. */
static remap_status join_triangles(const rm_trimesh_home *home, builder *b, const rm_triple *triple, int64_t num, rm_trimesh *m)
{
  rm_lid (*triangle)[3], (*side)[2], (*face)[2];
  uint8_t *skin;
  int64_t  after = num;
  rm_lid   count = 0;
  bool     joined;

  RM_TRY(rm_facets_compare(b->scratch, &b->facets, b->piece->num_faces, triple, num));
  for (int64_t i = 0; i < num; after -= joined) i = copies_end(b, triple, i, num, &joined);
  RM_NEW(triangle, home->mesh, after);
  RM_NEW(side, home->mesh, after);
  RM_NEW(skin, home->mesh, after);
  RM_NEW(face, home->mesh, after);
  RM_TRY(rm_facets_open(home->walks, &b->facets, after));
  for (int64_t i = 0; i < num;) {
    const int64_t end = copies_end(b, triple, i, num, &joined);

    for (; i < end; i += 1 + joined) {
      memcpy(triangle[count], triple[i].v, sizeof *triangle);
      face[count][0] = face[count][1] = side[count][0] = side[count][1] = RM_OUTSIDE;
      for (int h = 0; h <= joined; h++) {
        side[count][triple[i + h].right] = triple[i + h].cell;
        face[count][triple[i + h].right] = triple[i + h].face;
      }
      if (b->facets.any) rm_facets_add(&b->facets, triple + i, joined, count);
      skin[count++] = !joined && triple[i].skin;
    }
  }
  m->num_triangles    = count;
  m->triangle         = (const rm_lid (*)[3])triangle;
  m->side             = (const rm_lid (*)[2])side;
  m->triangle_is_skin = skin;
  m->triangle_face    = (const rm_lid (*)[2])face;
  return REMAP_OK;
}

static void triangle_normal(const rm_trimesh *m, rm_lid t, double n[3])
{
  const double *a = m->vertex[m->triangle[t][0]], *b = m->vertex[m->triangle[t][1]], *c = m->vertex[m->triangle[t][2]];
  const double  e[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, f[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};

  n[0] = e[1] * f[2] - e[2] * f[1];
  n[1] = e[2] * f[0] - e[0] * f[2];
  n[2] = e[0] * f[1] - e[1] * f[0];
}

/* ---- edges ------------------------------------------------------------------------------------------------------- */

/* The half edges of all triangles as words: upper vertex, then 4 * triangle + h. Those of a lower vertex stand from
 * offset[vertex] on and ascend, so that the triangles of an edge do too. num_edges: how many edges they make. */
static remap_status sort_half_edges(rm_arena *scratch, const rm_trimesh *m, rm_lid **out_offset, uint64_t **out,
                                    rm_lid *num_edges)
{
  static const int low[3] = {0, 1, 0}, high[3] = {1, 2, 2};
  const rm_lid nt = m->num_triangles, nv = m->num_vertices;
  rm_lid      *offset, ne = 0;
  uint64_t    *half;

  RM_NEW0(offset, scratch, (int64_t)nv + 2);
  RM_NEW(half, scratch, 3 * (int64_t)nt);
  for (rm_lid t = 0; t < nt; t++)
    for (int h = 0; h < 3; h++) offset[m->triangle[t][low[h]] + 2]++;
  for (rm_lid v = 0; v < nv; v++) offset[v + 2] += offset[v + 1];
  for (rm_lid t = 0; t < nt; t++)
    for (int h = 0; h < 3; h++)
      half[offset[m->triangle[t][low[h]] + 1]++] = (uint64_t)m->triangle[t][high[h]] << 32 | (uint64_t)(4 * t + h);
  for (rm_lid v = 0; v < nv; v++) {
    rm_sort_words(half + offset[v], offset[v + 1] - offset[v]);
    for (rm_lid i = offset[v]; i < offset[v + 1]; i++) ne += i == offset[v] || half[i] >> 32 != half[i - 1] >> 32;
  }
  *out_offset = offset;
  *out        = half;
  *num_edges  = ne;
  return REMAP_OK;
}

static remap_status number_edges(const rm_trimesh_home *home, rm_arena *scratch, rm_trimesh *m)
{
  const rm_lid nt = m->num_triangles;
  rm_lid (*triangle_edge)[3], (*edge)[2], *star_offset, *star, *offset, num_edges, ne = 0;
  uint64_t *half;

  RM_TRY(sort_half_edges(scratch, m, &offset, &half, &num_edges));
  RM_NEW(triangle_edge, home->around, nt);
  RM_NEW(edge, home->mesh, num_edges);
  RM_NEW(star_offset, home->around, (int64_t)num_edges + 1);
  RM_NEW(star, home->around, 3 * (int64_t)nt);
  for (rm_lid v = 0; v < m->num_vertices; v++)
    for (rm_lid i = offset[v]; i < offset[v + 1]; i++) {
      const rm_lid at = (rm_lid)(uint32_t)half[i];

      if (i == offset[v] || half[i] >> 32 != half[i - 1] >> 32) {
        star_offset[ne] = i;
        edge[ne][0]     = v;
        edge[ne++][1]   = (rm_lid)(half[i] >> 32);
      }
      star[i] = at;
      triangle_edge[at / 4][at % 4] = ne - 1;
    }
  star_offset[ne]  = 3 * nt;
  m->num_edges     = ne;
  m->edge          = (const rm_lid (*)[2])edge;
  m->triangle_edge = (const rm_lid (*)[3])triangle_edge;
  m->star_offset   = star_offset;
  m->star          = star;
  return REMAP_OK;
}

static remap_status edges_at_vertices(rm_arena *arena, rm_trimesh *m)
{
  rm_lid *offset, *list;

  RM_NEW0(offset, arena, (int64_t)m->num_vertices + 2);
  RM_NEW(list, arena, 2 * (int64_t)m->num_edges);
  for (rm_lid e = 0; e < m->num_edges; e++)
    for (int h = 0; h < 2; h++) offset[m->edge[e][h] + 2]++;
  for (rm_lid v = 0; v < m->num_vertices; v++) offset[v + 2] += offset[v + 1];
  for (rm_lid e = 0; e < m->num_edges; e++)
    for (int h = 0; h < 2; h++) list[offset[m->edge[e][h] + 1]++] = e;
  m->vertex_edge_offset = offset;
  m->vertex_edge        = list;
  return REMAP_OK;
}

/* ---- cells ------------------------------------------------------------------------------------------------------- */

static remap_status triangles_of_cells(rm_arena *arena, rm_trimesh *m)
{
  rm_lid *offset, *list;

  RM_NEW0(offset, arena, (int64_t)m->num_cells + 2);
  for (rm_lid t = 0; t < m->num_triangles; t++)
    for (int h = 0; h < 2; h++)
      if (m->side[t][h] >= 0) offset[m->side[t][h] + 2]++;
  for (rm_lid c = 0; c < m->num_cells; c++) offset[c + 2] += offset[c + 1];
  RM_NEW(list, arena, offset[m->num_cells + 1]);
  for (rm_lid t = 0; t < m->num_triangles; t++)
    for (int h = 0; h < 2; h++)
      if (m->side[t][h] >= 0) list[offset[m->side[t][h] + 1]++] = 2 * t + h;
  m->cell_triangle_offset = offset;
  m->cell_triangle        = list;
  return REMAP_OK;
}

/* Where a vertex was seen last. */
typedef struct sighting {
  rm_lid cell;
  int    place;
} sighting;

static remap_status vertices_of_cells(rm_arena *arena, rm_arena *scratch, rm_trimesh *m)
{
  const int64_t num_sides = m->cell_triangle_offset[m->num_cells];
  rm_lid       *offset, *vertex, *list, n = 0;
  uint8_t     (*corner)[3];
  sighting     *at;

  RM_NEW(offset, arena, (int64_t)m->num_cells + 1);
  RM_NEW(corner, arena, num_sides);
  RM_NEW(list, scratch, 3 * num_sides);
  RM_NEW(at, scratch, m->num_vertices);
  for (rm_lid v = 0; v < m->num_vertices; v++) at[v].cell = -1;
  for (rm_lid c = 0; c < m->num_cells; c++) {
    const rm_lid first = m->cell_triangle_offset[c], last = m->cell_triangle_offset[c + 1];
    int          num   = 0;

    offset[c] = n;
    for (rm_lid a = first; a < last && last - first <= MAX_LOCAL_TRIANGLES; a++)
      for (int h = 0; h < 3; h++) {
        const rm_lid v = m->triangle[m->cell_triangle[a] / 2][h];
        if (at[v].cell != c) {
          at[v]           = (sighting){c, num};
          list[n + num++] = v;
        }
        corner[a][h] = (uint8_t)at[v].place;
      }
    if (num <= MAX_LOCAL_VERTICES) n += num;
  }
  offset[m->num_cells] = n;
  RM_NEW(vertex, arena, n);
  memcpy(vertex, list, sizeof *vertex * (size_t)n);
  m->cell_vertex_offset   = offset;
  m->cell_vertex          = vertex;
  m->cell_triangle_vertex = (const uint8_t (*)[3])corner;
  return REMAP_OK;
}

static void empty_box(double box[6])
{
  for (int c = 0; c < 3; c++) box[c] = INFINITY, box[c + 3] = -INFINITY;
}
static void widen_box(double box[6], const double p[3])
{
  for (int c = 0; c < 3; c++) {
    box[c]     = p[c] < box[c] ? p[c] : box[c];
    box[c + 3] = p[c] > box[c + 3] ? p[c] : box[c + 3];
  }
}

static remap_status boxes(rm_arena *arena, rm_trimesh *m)
{
  double (*cell_box)[6];

  RM_NEW(cell_box, arena, m->num_cells);
  for (rm_lid c = 0; c < m->num_cells; c++) {
    empty_box(cell_box[c]);
    for (rm_lid a = m->cell_triangle_offset[c]; a < m->cell_triangle_offset[c + 1]; a++)
      for (int h = 0; h < 3; h++) widen_box(cell_box[c], m->vertex[m->triangle[m->cell_triangle[a] / 2][h]]);
  }
  m->cell_box = (const double (*)[6])cell_box;
  empty_box(m->box);
  for (rm_lid v = 0; v < m->num_vertices; v++) widen_box(m->box, m->vertex[v]);
  return REMAP_OK;
}

/* ---- skin -------------------------------------------------------------------------------------------------------- */

static remap_status collect_skin(rm_arena *arena, rm_trimesh *m)
{
  rm_lid *skin;
  double (*box)[6];
  rm_lid  n = 0;

  for (rm_lid t = 0; t < m->num_triangles; t++) n += m->side[t][0] < 0 || m->side[t][1] < 0;
  RM_NEW(skin, arena, n);
  RM_NEW(box, arena, n);
  n = 0;
  for (rm_lid t = 0; t < m->num_triangles; t++) {
    if (m->side[t][0] >= 0 && m->side[t][1] >= 0) continue;
    empty_box(box[n]);
    for (int h = 0; h < 3; h++) widen_box(box[n], m->vertex[m->triangle[t][h]]);
    skin[n++] = t;
  }
  m->num_skin = n;
  m->skin     = skin;
  m->skin_box = (const double (*)[6])box;
  return rm_boxtree_build(arena, n, m->skin_box, &m->skin_tree);
}

static bool is_skin(const rm_trimesh *m, rm_lid t) { return m->side[t][0] < 0 || m->side[t][1] < 0; }

/* Skin triangles round vertex v from triangle t on, edge by edge, until t is back; every skin edge at v has two of them. */
static rm_lid skin_round(const rm_trimesh *m, rm_lid v, rm_lid t)
{
  rm_lid num = 0, at = t, edge = -1;

  do {
    int h = 0;
    while (m->triangle_edge[at][h] == edge ||
           (m->edge[m->triangle_edge[at][h]][0] != v && m->edge[m->triangle_edge[at][h]][1] != v))
      h++;
    edge = m->triangle_edge[at][h];
    rm_lid k = m->star_offset[edge];
    while (m->star[k] / 4 == at || !is_skin(m, m->star[k] / 4)) k++;
    at = m->star[k] / 4;
    num++;
  } while (at != t);
  return num;
}

/* Mark every vertex about which the skin closes more than once, or an edge of which has not two skin triangles: there, cells
 * that share a vertex need not be neighbours. O(triangles at edges of the skin). */
static remap_status pinched_vertices(rm_arena *scratch, const rm_trimesh *m, uint8_t *pinched)
{
  rm_lid *num, *one; /* skin triangles at a vertex, and one of them */

  RM_NEW0(num, scratch, m->num_vertices);
  RM_NEW(one, scratch, m->num_vertices);
  for (rm_lid s = 0; s < m->num_skin; s++)
    for (int h = 0; h < 3; h++) {
      const rm_lid t = m->skin[s], e = m->triangle_edge[t][h];
      int          n = 0;

      num[m->triangle[t][h]]++;
      one[m->triangle[t][h]] = t;
      for (rm_lid k = m->star_offset[e]; k < m->star_offset[e + 1]; k++) n += is_skin(m, m->star[k] / 4);
      if (n != 2) pinched[m->edge[e][0]] = pinched[m->edge[e][1]] = 1;
    }
  for (rm_lid v = 0; v < m->num_vertices; v++)
    if (num[v] > 1 && !pinched[v] && skin_round(m, v, one[v]) < num[v]) pinched[v] = 1;
  return REMAP_OK;
}

/* ---- how edges may walk                    ----------------------------------------------------------------------- */

typedef struct nearness {
  const rm_trimesh *m;
  rm_lid            cell;
  int               patience; /* so many more triangles are looked at */
} nearness;

enum { PATIENCE = 512 };

/* Height of a point over a triangle's plane, times the normal's magnitude. */
static double height(const rm_trimesh *m, rm_lid t, const double p[3])
{
  const double *v = m->vertex[m->triangle[t][0]], *n = m->normal[t];
  return n[0] * (p[0] - v[0]) + n[1] * (p[1] - v[1]) + n[2] * (p[2] - v[2]);
}

/* True if a plane clearly parts the cell from the triangle: the triangle's own, or that of a triangle of the cell. Layers of
 * thin cells along a slanted wall are told from it this way, where their boxes cannot. */
static bool are_parted(const rm_trimesh *m, rm_lid c, rm_lid skin)
{
  const double *a = m->cell_box[c], *b = m->vertex[m->triangle[skin][0]];
  double        reach = 0;
  int           above = 0, below = 0;
  const rm_lid  first = m->cell_vertex_offset[c], last = m->cell_vertex_offset[c + 1];

  for (int k = 0; k < 3; k++) {
    reach = rm_max(reach, rm_max(fabs(a[k + 3] - b[k]), fabs(a[k] - b[k])));
    reach =
        rm_max(reach, rm_max(fabs(m->vertex[m->triangle[skin][1]][k] - b[k]), fabs(m->vertex[m->triangle[skin][2]][k] - b[k])));
  }
  const double noise = 0x1p-46 * reach * reach * reach;
  for (rm_lid k = first; k < last; k++) {
    const double h = height(m, skin, m->vertex[m->cell_vertex[k]]);
    above += h > noise;
    below += h < -noise;
  }
  if (above == last - first || below == last - first) return true;
  for (rm_lid k = m->cell_triangle_offset[c]; k < m->cell_triangle_offset[c + 1]; k++) {
    const rm_lid t    = m->cell_triangle[k] / 2;
    const double out  = m->cell_triangle[k] & 1 ? -1 : 1;
    bool         part = true;

    for (int h = 0; h < 3 && part; h++) part = out * height(m, t, m->vertex[m->triangle[skin][h]]) > noise;
    for (rm_lid l = first; l < last && part; l++) part = out * height(m, t, m->vertex[m->cell_vertex[l]]) <= noise;
    if (part) return true;
  }
  return false;
}

/* The skin triangle belongs to a cell that shares no vertex with this one, and may enter it. (Cells that share a vertex which
 * is not pinched are neighbours in the mesh.) Where very many triangles are near, as where thousands of cells meet, that is
 * taken for granted. */
static int is_foreign_skin(void *user, rm_lid s)
{
  nearness         *near  = user;
  const rm_trimesh *m     = near->m;
  const rm_lid     *side  = m->side[m->skin[s]];
  const rm_lid      owner = side[0] >= 0 ? side[0] : side[1];

  if (owner == near->cell) return 0;
  if (near->patience-- == 0) return 1;
  for (rm_lid k = m->cell_vertex_offset[near->cell]; k < m->cell_vertex_offset[near->cell + 1]; k++)
    for (rm_lid l = m->cell_vertex_offset[owner]; l < m->cell_vertex_offset[owner + 1]; l++)
      if (m->cell_vertex[k] == m->cell_vertex[l]) return 0;
  return !are_parted(m, near->cell, m->skin[s]);
}

/* True if every triangle of the cell is seen from inside from the mean of its vertices, clearly: the cell is then star-shaped,
 * hence winds once about its inside and not at all about the rest. Rounding can only make the answer false. */
static bool is_star_shaped(const rm_trimesh *m, rm_lid c)
{
  double        o[3] = {0, 0, 0}, size = 0;
  const rm_lid  first = m->cell_vertex_offset[c], last = m->cell_vertex_offset[c + 1];
  const double *box = m->cell_box[c];

  for (rm_lid k = first; k < last; k++)
    for (int a = 0; a < 3; a++) o[a] += m->vertex[m->cell_vertex[k]][a] - box[a];
  for (int a = 0; a < 3; a++) {
    o[a] = box[a] + o[a] / (last - first);
    size = box[a + 3] - box[a] > size ? box[a + 3] - box[a] : size;
  }
  for (rm_lid a = m->cell_triangle_offset[c]; a < m->cell_triangle_offset[c + 1]; a++) {
    const double *v = m->vertex[m->triangle[m->cell_triangle[a] / 2][0]], *n = m->normal[m->cell_triangle[a] / 2];
    const double  h = n[0] * (v[0] - o[0]) + n[1] * (v[1] - o[1]) + n[2] * (v[2] - o[2]);
    const double  noise = 0x1p-46 * size * size * size;
    if ((m->cell_triangle[a] & 1 ? -h : h) <= noise) return false;
  }
  return first < last;
}

static remap_status choose_walks(rm_arena *arena, rm_arena *scratch, rm_trimesh *m)
{
  uint8_t *walk, *pinched;
  double (*odd_box)[6];
  rm_lid   num_odd = 0;

  RM_NEW0(walk, arena, m->num_cells);
  RM_NEW0(pinched, scratch, m->num_vertices);
  RM_NEW(odd_box, scratch, m->num_cells);
  RM_TRY(pinched_vertices(scratch, m, pinched));
  for (rm_lid c = 0; c < m->num_cells; c++) {
    const bool is_large = m->cell_vertex_offset[c] == m->cell_vertex_offset[c + 1];
    nearness   near     = {m, c, PATIENCE};

    for (rm_lid k = m->cell_vertex_offset[c]; k < m->cell_vertex_offset[c + 1]; k++)
      if (pinched[m->cell_vertex[k]]) walk[c] = RM_WALK_TOGETHER;
    if (is_large) walk[c] = RM_WALK_NOT;
    if (!walk[c] && rm_boxtree_query(m->skin_tree, m->skin_box, m->cell_box[c], is_foreign_skin, &near))
      walk[c] = RM_WALK_TOGETHER;
    if (is_large ? m->num_cells > 1 : !is_star_shaped(m, c)) {
      walk[c] = RM_WALK_NOT;
      memcpy(odd_box[num_odd++], m->cell_box[c], sizeof *odd_box);
    }
  }
  if (num_odd) {
    double (*kept)[6];

    RM_NEW(kept, arena, num_odd);
    memcpy(kept, odd_box, sizeof *kept * (size_t)num_odd);
    m->num_odd = num_odd;
    m->odd_box = (const double (*)[6])kept;
    RM_TRY(rm_boxtree_build(arena, num_odd, m->odd_box, &m->odd_tree));
    for (rm_lid c = 0; c < m->num_cells; c++)
      if (walk[c] != RM_WALK_NOT && rm_boxtree_meets(m->odd_tree, m->odd_box, m->cell_box[c])) walk[c] = RM_WALK_NOT;
  }
  m->cell_walk = walk;
  return REMAP_OK;
}

/* ------------------------------------------------------------------------------------------------------------------ */

static remap_status build(const rm_trimesh_home *home, builder *b, remap_faces faces, rm_trimesh *m)
{
  rm_lid        *vertex_of;
  rm_triple *triple;
  int64_t        num_triples;
  double       (*normal)[3];

  RM_TRY(triangulate_faces(b, faces));
  RM_NEW(vertex_of, b->scratch, b->num_points);
  RM_TRY(number_vertices(home->mesh, b, vertex_of, m));
  RM_TRY(collect_triples(b, vertex_of, m->num_vertices, &triple, &num_triples));
  RM_TRY(join_triangles(home, b, triple, num_triples, m));
  RM_NEW(normal, home->walks, m->num_triangles);
  for (rm_lid t = 0; t < m->num_triangles; t++) triangle_normal(m, t, normal[t]);
  m->normal = (const double (*)[3])normal;
  RM_TRY(number_edges(home, b->scratch, m));
  RM_TRY(edges_at_vertices(home->around, m));
  RM_TRY(triangles_of_cells(home->walks, m));
  RM_TRY(vertices_of_cells(home->walks, b->scratch, m));
  RM_TRY(boxes(home->walks, m));
  RM_TRY(collect_skin(home->walks, m));
  RM_TRY(rm_facets_finish(home->walks, b->scratch, &b->facets, m));
  return choose_walks(home->walks, b->scratch, m);
}

remap_status rm_trimesh_build_in(const rm_trimesh_home *home, const rm_frame *frame, const rm_piece *piece, remap_faces faces,
                                 const rm_trimesh **out)
{
  builder      b = {.scratch = rm_arena_new(), .frame = frame, .piece = piece};
  rm_trimesh  *m = rm_arena_zero(home->mesh, 1, sizeof *m);
  remap_status status = b.scratch && m ? REMAP_OK : REMAP_NO_MEMORY;

  if (status == REMAP_OK) {
    m->num_cells = piece->num_cells;
    status       = build(home, &b, faces, m);
  }
  rm_arena_drop(b.scratch);
  RM_ASSERT(status != REMAP_OK || rm_trimesh_check(frame, m) != REMAP_INTERNAL);
  if (status == REMAP_OK) *out = m;
  return status;
}

remap_status rm_trimesh_build(rm_arena *arena, const rm_frame *frame, const rm_piece *piece, remap_faces faces,
                              const rm_trimesh **out)
{
  return rm_trimesh_build_in(&(rm_trimesh_home){arena, arena, arena}, frame, piece, faces, out);
}
