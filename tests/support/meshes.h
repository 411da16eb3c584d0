/* meshes -- makers of polyhedral test meshes, and their distribution over ranks.
 *
 *   tm_mesh *whole = tm_tetrahedra((int[]){4, 5, 6}, tm_warp, &(tm_warping){0.03, 0.7});
 *   int     *rank  = tm_deal(whole, rt_size(), TM_RANDOM, 1);
 *   tm_mesh *mine  = tm_part(whole, rank, rt_rank(), 7);
 *   remap_set_mesh(ctx, REMAP_SOURCE, &mine->view);
 *
 * Every maker fills the unit cube with a lattice of n[0] x n[1] x n[2] boxes, divides the boxes, and moves the nodes by a map
 * (NULL: stay). The whole mesh is the same on every rank; tm_part takes from it the cells of one rank, optionally renumbered
 * at random. Meshes are malloc'ed, owned by the caller and freed by tm_free; memory that runs out ends the program. A maker
 * costs O(cells) with one hash look-up per face and cell.
 *
 *   meshes.h      makers that divide boxes; zones
 *   tm_dual.h     tm_dual
 *   tm_mesh.h     tm_mesh, maps
 *   tm_lattice.h  what makers are made of
 *   tm_parts.h    tm_deal, tm_part */
#ifndef MESHES_H
#define MESHES_H

#include "tm_dual.h"
#include "tm_lattice.h"
#include "tm_mesh.h"
#include "tm_parts.h"

/* ---- makers --------------------------------------------------------------------------------------------------------- */

typedef enum tm_kind_ { TM_HEXAHEDRA_, TM_PRISMS_, TM_PYRAMIDS_, TM_FIVE_PYRAMIDS_, TM_TETRAHEDRA_, TM_MIXED_ } tm_kind_;

/* Boxes one after the other, x fastest, each divided as `kind` says. MIXED changes the kind along x: hexahedra, prisms,
 * pyramids, then a layer with pyramids and, towards the next, tetrahedra, then tetrahedra. */
static inline tm_mesh *tm_boxes_(const int n[3], tm_kind_ kind, tm_map map, const void *data)
{
  tm_builder_ b = {0};

  for (int k = 0; k < n[2]; k++)
    for (int j = 0; j < n[1]; j++)
      for (int i = 0; i < n[0]; i++) {
        const int  p[3] = {2 * i, 2 * j, 2 * k}, layer = 5 * i / n[0];
        const bool last_before_tets = i + 1 < n[0] && layer < 4 && 5 * (i + 1) / n[0] >= 4;
        tm_kind_   here             = kind;
        int64_t    c[8], middle = tm_id_(n, (int[]){p[0] + 1, p[1] + 1, p[2] + 1});

        tm_corners_(n, p, 2, c);
        if (kind == TM_MIXED_) here = last_before_tets ? TM_FIVE_PYRAMIDS_ : layer == 3 ? TM_PYRAMIDS_ : (tm_kind_)layer;
        switch (here) {
          case TM_HEXAHEDRA_: tm_add_hexahedron_(&b, c); break;
          case TM_PRISMS_: tm_add_prisms_(&b, c); break;
          case TM_PYRAMIDS_: tm_add_pyramids_(&b, c, middle, 0); break;
          case TM_FIVE_PYRAMIDS_: tm_add_pyramids_(&b, c, middle, 2); break;
          default: tm_add_kuhn_(&b, c); break;
        }
      }
  return tm_finish_lattice_(&b, n, map, data);
}

/* n[0] n[1] n[2] hexahedra, cells and nodes numbered with x fastest. */
static inline tm_mesh *tm_hexahedra(const int n[3], tm_map map, const void *data)
{
  return tm_boxes_(n, TM_HEXAHEDRA_, map, data);
}

/* Six tetrahedra per box (Kuhn), conformal. */
static inline tm_mesh *tm_tetrahedra(const int n[3], tm_map map, const void *data)
{
  return tm_boxes_(n, TM_TETRAHEDRA_, map, data);
}

/* Two triangular prisms per box, along z. */
static inline tm_mesh *tm_prisms(const int n[3], tm_map map, const void *data) { return tm_boxes_(n, TM_PRISMS_, map, data); }

/* Six pyramids per box. */
static inline tm_mesh *tm_pyramids(const int n[3], tm_map map, const void *data)
{
  return tm_boxes_(n, TM_PYRAMIDS_, map, data);
}

/* Cells one behind the other, each a prism over the same polygon of n corners, counter-clockwise seen against the direction in
 * which they follow. Corner h of layer k is at (h, k, 0): the caller moves the nodes. */
static inline tm_mesh *tm_column(int n, int layers)
{
  tm_builder_ b    = {.num_cells = layers};
  int64_t    *loop = tm_alloc_(n, sizeof *loop), *id;
  tm_mesh    *mesh;

  for (int k = 0; k < layers; k++) {
    for (int h = 0; h < n; h++) loop[h] = (int64_t)k * n + (n - 1 - h);
    tm_face_(&b, k, n, loop);
    for (int h = 0; h < n; h++) loop[h] = (int64_t)(k + 1) * n + h;
    tm_face_(&b, k, n, loop);
    for (int h = 0; h < n; h++) {
      const int64_t p = (int64_t)k * n + h, q = (int64_t)k * n + (h + 1) % n;
      tm_face_(&b, k, 4, (int64_t[]){p, q, q + n, p + n});
    }
  }
  mesh = tm_finish_(&b, (int64_t)(layers + 1) * n, &id);
  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    mesh->xyz[3 * v]     = (double)(id[v] % n);
    mesh->xyz[3 * v + 1] = (double)(id[v] / n);
  }
  free(loop);
  free(id);
  return mesh;
}

/* Hexahedra, prisms, pyramids and tetrahedra side by side along x, conformal; all four where n[0] >= 5. */
static inline tm_mesh *tm_mixed(const int n[3], tm_map map, const void *data) { return tm_boxes_(n, TM_MIXED_, map, data); }

/* The meshes of the overlay benchmark: n^3 hexahedra, warped by 0.03, centred at the origin, rotated by angle about z and
 * then about x, scaled. Mesh 1: phase 0.7, angle 0.3; mesh 2: phase 0.1, angle 0, scale 1. */
static inline tm_mesh *tm_benchmark(int n, double phase, double angle, double scale)
{
  tm_mesh *mesh = tm_hexahedra((int[]){n, n, n}, tm_warp, &(tm_warping){.03, phase});

  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    double *xyz = mesh->xyz + 3 * v;

    for (int d = 0; d < 3; d++) xyz[d] -= .5;
    tm_rotate_(xyz, angle);
    for (int d = 0; d < 3; d++) xyz[d] *= scale;
  }
  return mesh;
}

/* Chooses boxes of a lattice n. */
typedef bool (*tm_choice)(const int n[3], const int ijk[3]);
static inline bool tm_right_half(const int n[3], const int ijk[3]) { return ijk[0] >= n[0] / 2; }
static inline bool tm_checkered(const int n[3], const int ijk[3]) { return n && (ijk[0] + ijk[1] + ijk[2]) % 2 == 0; }

/* True if a box that touches lattice point p is refined. */
static inline bool tm_fine_near_(const int n[3], tm_choice fine, const int p[3])
{
  for (int c = 0; c < 8; c++) {
    const int ijk[3] = {(p[0] - (c & 1)) >> 1, (p[1] - (c >> 1 & 1)) >> 1, (p[2] - (c >> 2)) >> 1};
    bool      inside = true;

    for (int d = 0; d < 3; d++) inside = inside && ijk[d] >= 0 && ijk[d] < n[d];
    if (inside && fine(n, ijk)) return true;
  }
  return false;
}

/* A face of a coarse box beside a finer one: four quadrangles if the box behind it is refined, else one polygon with the
 * hanging nodes of its edges. */
static inline void tm_coarse_face_(tm_builder_ *b, const int n[3], tm_choice fine, const int p[3], const int corner[4])
{
  int     at[4][3], half[4][3], middle[3], count = 0;
  int64_t loop[8];

  for (int h = 0; h < 4; h++)
    for (int d = 0; d < 3; d++) at[h][d] = p[d] + 2 * (corner[h] >> d & 1);
  for (int d = 0; d < 3; d++) {
    middle[d] = (at[0][d] + at[2][d]) / 2;
    for (int h = 0; h < 4; h++) half[h][d] = (at[h][d] + at[(h + 1) % 4][d]) / 2;
  }
  for (int h = 0; h < 4; h++) {
    if (tm_fine_near_(n, fine, middle)) {
      tm_face_(b, b->num_cells, 4,
               (int64_t[]){tm_id_(n, at[h]), tm_id_(n, half[h]), tm_id_(n, middle), tm_id_(n, half[(h + 3) % 4])});
      continue;
    }
    loop[count++] = tm_id_(n, at[h]);
    if (tm_fine_near_(n, fine, half[h])) loop[count++] = tm_id_(n, half[h]);
  }
  if (count) tm_face_(b, b->num_cells, count, loop);
}

/* Boxes of which the chosen ones are refined into eight. The faces of coarse boxes are divided where they meet fine ones and
 * carry the fine edges' nodes, so the mesh is conformal: polyhedra with hanging nodes. */
static inline tm_mesh *tm_refined(const int n[3], tm_choice fine, tm_map map, const void *data)
{
  tm_builder_ b = {0};
  int64_t     c[8];

  for (int k = 0; k < n[2]; k++)
    for (int j = 0; j < n[1]; j++)
      for (int i = 0; i < n[0]; i++) {
        const int p[3] = {2 * i, 2 * j, 2 * k};

        if (!fine(n, (int[]){i, j, k})) {
          for (int f = 0; f < 6; f++) tm_coarse_face_(&b, n, fine, p, tm_box_face_[f]);
          b.num_cells++;
          continue;
        }
        for (int child = 0; child < 8; child++) {
          tm_corners_(n, (int[]){p[0] + (child & 1), p[1] + (child >> 1 & 1), p[2] + (child >> 2)}, 1, c);
          tm_add_hexahedron_(&b, c);
        }
      }
  return tm_finish_lattice_(&b, n, map, data);
}

/* ---- zones ----------------------------------------------------------------------------------------------------------- */

/* Both meshes as zones "left" and "right" of one; nothing is joined. Takes the two over and frees them. */
static inline tm_mesh *tm_join(tm_mesh *left, tm_mesh *right)
{
  static const char *const name[]  = {"left", "right"};
  const tm_mesh           *part[]  = {left, right};
  const int64_t            corners = left->face_offset[left->view.num_faces];
  int64_t                  node = 0, face = 0, corner = 0, cell = 0;
  tm_mesh *mesh = tm_new_(left->view.num_nodes + right->view.num_nodes, left->view.num_faces + right->view.num_faces,
                          corners + right->face_offset[right->view.num_faces], left->view.num_cells + right->view.num_cells);

  mesh->zone_offset    = tm_alloc_(3, sizeof(int64_t));
  mesh->zone_name      = tm_alloc_(2, sizeof(char *));
  mesh->view.num_zones = 2;
  for (int z = 0; z < 2; z++) {
    const remap_mesh *view = &part[z]->view;

    memcpy(mesh->xyz + 3 * node, part[z]->xyz, (size_t)(3 * view->num_nodes) * sizeof(double));
    for (int64_t c = 0; c < part[z]->face_offset[view->num_faces]; c++)
      mesh->face_node[corner + c] = part[z]->face_node[c] + node;
    for (int64_t f = 0; f < view->num_faces; f++) {
      mesh->face_offset[face + f + 1] = part[z]->face_offset[f + 1] + corner;
      mesh->owner[face + f]           = part[z]->owner[f] + cell;
      mesh->neighbour[face + f]       = part[z]->neighbour[f] < 0 ? -1 : part[z]->neighbour[f] + cell;
    }
    for (int64_t c = 0; c < view->num_cells; c++) mesh->global[cell + c] = cell + c;
    node += view->num_nodes;
    face += view->num_faces;
    corner += part[z]->face_offset[view->num_faces];
    cell += view->num_cells;
    mesh->zone_offset[z + 1] = cell;
    mesh->zone_name[z]       = name[z];
  }
  tm_view_(mesh);
  tm_free(left);
  tm_free(right);
  return mesh;
}

/* One cell inside the skin of a mesh, which is taken over. */
static inline tm_mesh *tm_hull(tm_mesh *m)
{
  int64_t faces = 0, corners = 0;
  tm_mesh *hull;

  for (int64_t f = 0; f < m->view.num_faces; f++)
    if (m->neighbour[f] < 0) faces++, corners += m->face_offset[f + 1] - m->face_offset[f];
  hull = tm_new_(m->view.num_nodes, faces, corners, 1);
  memcpy(hull->xyz, m->xyz, 3 * (size_t)m->view.num_nodes * sizeof *m->xyz);
  faces = corners = 0;
  for (int64_t f = 0; f < m->view.num_faces; f++) {
    if (m->neighbour[f] >= 0) continue;
    for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++) hull->face_node[corners++] = m->face_node[k];
    hull->neighbour[faces]     = -1;
    hull->face_offset[++faces] = corners;
  }
  tm_free(m);
  return hull;
}

/* Two zones of hexahedra that fill the unit cube, patched at x = 1/2: `left` and `right` boxes, which need not match there.
 * The right zone begins at 1/2 + gap: below 0, the zones overlap; above, they gape. With gap 0 and boxes that match, the nodes
 * at the patch agree bitwise. */
static inline tm_mesh *tm_two_zones(const int left[3], const int right[3], double gap, tm_map map, const void *data)
{
  tm_mesh *mesh[2] = {tm_hexahedra(left, NULL, NULL), tm_hexahedra(right, NULL, NULL)};

  for (int64_t v = 0; v < mesh[0]->view.num_nodes; v++) mesh[0]->xyz[3 * v] *= .5;
  for (int64_t v = 0; v < mesh[1]->view.num_nodes; v++) {
    double *x = mesh[1]->xyz + 3 * v;

    *x = (.5 + gap) * (1 - *x) + *x;
  }
  for (int z = 0; z < 2; z++) tm_move(mesh[z], map, data);
  return tm_join(mesh[0], mesh[1]);
}
#endif
