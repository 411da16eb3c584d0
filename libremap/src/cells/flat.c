/* flat -- a triangulation without flat triangles, whose corners lie on a line, for what bounds volumes exactly: collapsed
 * faces, hanging nodes and singular axes leave such triangles, which in a limit without thickness are not there.
 *
 * A flat triangle has one edge that runs along its other two, over a vertex. Left out, the triangles beyond that edge would
 * no longer meet the others there in common edges: so each of them is cut at all vertices of flat triangles that lie on its
 * edge. What is done to an edge depends on what touches it alone. O(n); O(f log f) for f flat triangles. */
#include "cells/cells_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct work {
  rm_arena         *scratch;
  const rm_trimesh *m;
  uint8_t          *is_flat;      /* [num_triangles]                              */
  uint8_t          *at_flat;      /* [num_vertices] corner of a flat triangle     */
  rm_lid           *inner_offset; /* [num_edges + 1]                              */
  rm_lid           *inner;        /* vertices inside an edge, along it            */
  int64_t           num_inner, inner_room;
  rm_lid          (*corner)[3];   /* [num] triangles that are left, oriented as their old ones */
  rm_lid           *old;          /* [num]                                        */
  int64_t           num, corner_room, old_room;
} work;

bool rm_has_area(const rm_trimesh *m, rm_lid t)
{
  const double *a = m->vertex[m->triangle[t][0]], *b = m->vertex[m->triangle[t][1]], *c = m->vertex[m->triangle[t][2]];
  double        o[3];

  for (int k = 0; k < 3; k++) {
    const int    i = (k + 1) % 3, j = (k + 2) % 3;
    const double x = (b[i] - a[i]) * (c[j] - a[j]), y = (b[j] - a[j]) * (c[i] - a[i]);
    if (fabs(x - y) > 0x1p-50 * (fabs(x) + fabs(y))) return true;
  }
  return rm_off_plane(a, b, c, o);
}

/* True if v lies inside the edge. */
static bool is_inside(const rm_trimesh *m, const rm_lid edge[2], rm_lid v)
{
  const double *a = m->vertex[edge[0]], *b = m->vertex[edge[1]], *p = m->vertex[v];
  double        o[3];
  int           k = 0;

  if (v == edge[0] || v == edge[1]) return false;
  while (k < 2 && a[k] == b[k]) k++;
  if (!(a[k] < b[k] ? a[k] < p[k] && p[k] < b[k] : b[k] < p[k] && p[k] < a[k])) return false;
  return !rm_off_plane(a, b, p, o);
}

/* ---- vertices inside edges --------------------------------------------------------------------------------------- */

typedef struct query {
  work         *w;
  const rm_lid *vertex; /* of the tree's items */
  rm_lid        edge;
  int64_t       first;
  remap_status  status;
} query;

/* Put a vertex that lies inside the edge to its place among those before it. */
static int take_inner(void *user, rm_lid item)
{
  query            *q = user;
  work             *w = q->w;
  const rm_trimesh *m = w->m;
  const rm_lid      v = q->vertex[item], *edge = m->edge[q->edge];
  const double     *a = m->vertex[edge[0]], *b = m->vertex[edge[1]];
  int               k = 0;
  int64_t           at;

  if (!is_inside(m, edge, v)) return 0;
  q->status = rm_grow(&w->inner, &w->inner_room, w->num_inner + 1, sizeof *w->inner);
  if (q->status != REMAP_OK) return 1;
  while (k < 2 && a[k] == b[k]) k++;
  for (at = w->num_inner; at > q->first; at--) {
    const double x = m->vertex[w->inner[at - 1]][k], y = m->vertex[v][k];
    if (a[k] < b[k] ? x < y : x > y) break;
    w->inner[at] = w->inner[at - 1];
  }
  w->inner[at] = v;
  w->num_inner++;
  return 0;
}

/* The vertices of flat triangles inside each edge of a flat triangle. */
static remap_status find_inner(work *w)
{
  const rm_trimesh *m = w->m;
  const rm_boxtree *tree;
  uint8_t          *edge_at_flat;
  rm_lid           *list, num = 0;
  double          (*box)[6];

  RM_NEW0(edge_at_flat, w->scratch, m->num_edges);
  RM_NEW0(w->inner_offset, w->scratch, (int64_t)m->num_edges + 1);
  for (rm_lid t = 0; t < m->num_triangles; t++)
    for (int h = 0; h < 3 && w->is_flat[t]; h++) edge_at_flat[m->triangle_edge[t][h]] = 1;
  for (rm_lid v = 0; v < m->num_vertices; v++) num += w->at_flat[v];
  RM_NEW(list, w->scratch, num);
  RM_NEW(box, w->scratch, num);
  num = 0;
  for (rm_lid v = 0; v < m->num_vertices; v++) {
    if (!w->at_flat[v]) continue;
    for (int c = 0; c < 6; c++) box[num][c] = m->vertex[v][c % 3];
    list[num++] = v;
  }
  RM_TRY(rm_boxtree_build(w->scratch, num, (const double (*)[6])box, &tree));
  for (rm_lid e = 0; e < m->num_edges; e++) {
    query q = {w, list, e, w->num_inner, REMAP_OK};

    w->inner_offset[e] = (rm_lid)w->num_inner;
    if (edge_at_flat[e])
      rm_boxtree_query_segment(tree, (const double(*)[6])box, m->vertex[m->edge[e][0]], m->vertex[m->edge[e][1]], take_inner,
                               &q);
    RM_TRY(q.status);
  }
  w->inner_offset[m->num_edges] = (rm_lid)w->num_inner;
  return REMAP_OK;
}

/* ---- triangles --------------------------------------------------------------------------------------------------- */

static remap_status push(work *w, rm_lid t, rm_lid a, rm_lid b, rm_lid c)
{
  RM_TRY(rm_grow(&w->corner, &w->corner_room, w->num + 1, sizeof *w->corner));
  RM_TRY(rm_grow(&w->old, &w->old_room, w->num + 1, sizeof *w->old));
  memcpy(w->corner[w->num], (rm_lid[3]){a, b, c}, sizeof *w->corner);
  w->old[w->num++] = t;
  return REMAP_OK;
}

/* Side h of triangle t runs from its corner h to the next one; the k-th of its n points from one to the other, ends
 * included. */
static rm_lid num_on_side(const work *w, rm_lid t, int h)
{
  const rm_lid e = w->m->triangle_edge[t][h];
  return w->inner_offset[e + 1] - w->inner_offset[e] + 2;
}
static rm_lid on_side(const work *w, rm_lid t, int h, rm_lid k)
{
  const rm_lid e = w->m->triangle_edge[t][h], n = num_on_side(w, t, h),
               at = h == 2 ? n - 1 - k : k; /* the third runs backwards */
  return at == 0 ? w->m->edge[e][0] : at == n - 1 ? w->m->edge[e][1] : w->inner[w->inner_offset[e] + at - 1];
}

/* A fan from p over side h of triangle t, points first..last of it. */
static remap_status fan(work *w, rm_lid t, rm_lid p, int h, rm_lid first, rm_lid last)
{
  for (rm_lid k = first; k < last; k++) RM_TRY(push(w, t, on_side(w, t, h, k), on_side(w, t, h, k + 1), p));
  return REMAP_OK;
}

/* Cut triangle t at the points on its sides: a fan over the first side that has some, whose outer triangles become fans over
 * the other two. The corners run as the sides do. */
static remap_status cut(work *w, rm_lid t)
{
  int base = 0;

  while (base < 2 && num_on_side(w, t, base) == 2) base++;
  const int    next = (base + 1) % 3, back = (base + 2) % 3;
  const rm_lid n = num_on_side(w, t, base), n_next = num_on_side(w, t, next), n_back = num_on_side(w, t, back);
  const rm_lid apex = on_side(w, t, back, 0);

  if (n == 2) return push(w, t, on_side(w, t, 0, 0), on_side(w, t, 1, 0), on_side(w, t, 2, 0));
  RM_TRY(fan(w, t, on_side(w, t, base, 1), back, 0, n_back - 1));
  RM_TRY(fan(w, t, apex, base, 1, n - 2));
  return fan(w, t, on_side(w, t, base, n - 2), next, 0, n_next - 1);
}

/* ---- the new mesh ------------------------------------------------------------------------------------------------ */

/* The triangles that are left as a piece of their own. */
static remap_status make_piece(const work *w, rm_piece *out)
{
  const rm_trimesh *m = w->m;
  rm_lid           *node_of, *node, num_nodes = 0, (*cell)[2];
  double          (*xyz)[3];
  int64_t          *offset;
  uint8_t          *skin;

  RM_NEW(node_of, w->scratch, m->num_vertices);
  RM_NEW(xyz, w->scratch, m->num_vertices);
  RM_NEW(node, w->scratch, 3 * w->num);
  RM_NEW(offset, w->scratch, w->num + 1);
  RM_NEW(cell, w->scratch, w->num);
  RM_NEW(skin, w->scratch, w->num);
  for (rm_lid v = 0; v < m->num_vertices; v++) node_of[v] = -1;
  offset[0] = 0;
  for (int64_t k = 0; k < w->num; k++) {
    const rm_lid *side = m->side[w->old[k]], turned = side[0] < 0;

    for (int h = 0; h < 3; h++) {
      const rm_lid v = w->corner[k][turned ? 2 - h : h];
      if (node_of[v] < 0) {
        memcpy(xyz[num_nodes], m->vertex[v], sizeof *xyz);
        node_of[v] = num_nodes++;
      }
      node[3 * k + h] = node_of[v];
    }
    cell[k][0]    = side[turned];
    cell[k][1]    = side[!turned];
    skin[k]       = m->triangle_is_skin[w->old[k]];
    offset[k + 1] = 3 * (k + 1);
  }
  *out = (rm_piece){.num_nodes    = num_nodes,
                    .num_faces    = (rm_lid)w->num,
                    .num_cells    = m->num_cells,
                    .node_xyz     = (const double (*)[3])xyz,
                    .face_offset  = offset,
                    .face_node    = node,
                    .face_cell    = (const rm_lid (*)[2])cell,
                    .face_is_skin = skin};
  return REMAP_OK;
}

/* The same mesh with the faces that the old triangles were part of. */
static remap_status restore_faces(rm_arena *arena, const work *w, const rm_trimesh *made, const rm_trimesh **out)
{
  rm_trimesh *m;
  rm_lid    (*face)[2];

  RM_NEW(m, arena, 1);
  RM_NEW(face, arena, made->num_triangles);
  for (rm_lid t = 0; t < made->num_triangles; t++)
    for (int h = 0; h < 2; h++) {
      const rm_lid from = made->triangle_face[t][h], old = from < 0 ? -1 : w->old[from];
      face[t][h] = old < 0 ? -1 : w->m->triangle_face[old][w->m->side[old][0] == made->side[t][h] ? 0 : 1];
    }
  *m               = *made;
  m->triangle_face = (const rm_lid (*)[2])face;
  *out             = m;
  return REMAP_OK;
}

static remap_status rebuild(const rm_trimesh_home *home, const rm_frame *frame, work *w, const rm_trimesh **out)
{
  const rm_trimesh *m = w->m, *made;
  rm_piece          piece;

  RM_NEW0(w->at_flat, w->scratch, m->num_vertices);
  for (rm_lid t = 0; t < m->num_triangles; t++)
    for (int h = 0; h < 3 && w->is_flat[t]; h++) w->at_flat[m->triangle[t][h]] = 1;
  RM_TRY(find_inner(w));
  for (rm_lid t = 0; t < m->num_triangles; t++)
    if (!w->is_flat[t]) RM_TRY(cut(w, t));
  if (w->num > INT32_MAX) return REMAP_TOO_LARGE;
  RM_TRY(make_piece(w, &piece));
  RM_TRY(rm_trimesh_build_in(home, frame, &piece, REMAP_FACES_DIAGONAL, &made));
  return restore_faces(home->mesh, w, made, out);
}

remap_status rm_cells_mesh(const rm_trimesh_home *home, const rm_frame *frame, const rm_trimesh *mesh, const rm_trimesh **out)
{
  work         w      = {.scratch = rm_arena_new(), .m = mesh};
  remap_status status = w.scratch ? REMAP_OK : REMAP_NO_MEMORY;
  bool         any    = false;

  if (status == REMAP_OK) w.is_flat = rm_arena_alloc(w.scratch, mesh->num_triangles, sizeof *w.is_flat);
  if (!w.is_flat) status = REMAP_NO_MEMORY;
  for (rm_lid t = 0; t < mesh->num_triangles && status == REMAP_OK; t++) {
    w.is_flat[t] = !rm_has_area(mesh, t);
    any          = any || w.is_flat[t];
  }
  if (status == REMAP_OK && any) status = rebuild(home, frame, &w, &mesh);
  if (status == REMAP_OK && mesh->facet) status = rm_trimesh_of_triangles(home->mesh, mesh, &mesh);
  free(w.inner);
  free(w.corner);
  free(w.old);
  rm_arena_drop(w.scratch);
  if (status == REMAP_OK) *out = mesh;
  return status;
}
