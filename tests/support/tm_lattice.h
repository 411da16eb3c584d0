/* tm_lattice -- from cells, added face by face, to meshes; cells on a lattice of boxes, and what one box is divided into. One
 * hash look-up per face and cell. See meshes.h. */
#ifndef TM_LATTICE_H
#define TM_LATTICE_H

#include "tm_mesh.h"

#include <string.h>

/* ---- from cells to faces ------------------------------------------------------------------------------------------ */

/* Cells are added face by face, as loops of node ids that run counter-clockwise seen from outside; a face that comes twice
 * lies between two cells. Ids need not be dense. */
typedef struct tm_builder_ {
  int64_t   num_faces, face_room, num_corners, corner_room, num_cells;
  int64_t  *face_offset, *face_node, *owner, *neighbour;
  uint64_t *hash;  /* [num_faces] of its set of nodes */
  int64_t  *table; /* [slots] face + 1, 0 if free; slots is a power of two above 2 num_faces */
  int64_t   slots;
} tm_builder_;

static inline void tm_resize_(void *data, int64_t count, size_t size)
{
  void *old, *moved;

  memcpy(&old, data, sizeof old);
  moved = realloc(old, (size_t)(count + 1) * size);
  if (!moved) abort();
  memcpy(data, &moved, sizeof moved);
}

static inline void tm_make_room_(tm_builder_ *b, int corners)
{
  if (b->num_corners + corners > b->corner_room) {
    b->corner_room = 2 * b->corner_room + 1000 + corners;
    tm_resize_(&b->face_node, b->corner_room, sizeof *b->face_node);
  }
  if (b->num_faces < b->face_room) return;
  b->face_room = 2 * b->face_room + 256;
  tm_resize_(&b->face_offset, b->face_room + 1, sizeof *b->face_offset);
  tm_resize_(&b->owner, b->face_room, sizeof *b->owner);
  tm_resize_(&b->neighbour, b->face_room, sizeof *b->neighbour);
  tm_resize_(&b->hash, b->face_room, sizeof *b->hash);
  free(b->table);
  for (b->slots = 1024; b->slots < 2 * b->face_room;) b->slots *= 2;
  b->table = tm_alloc_(b->slots, sizeof *b->table);
  for (int64_t f = 0; f < b->num_faces; f++) {
    int64_t at = (int64_t)(b->hash[f] % (uint64_t)b->slots);

    while (b->table[at]) at = (at + 1) % b->slots;
    b->table[at] = f + 1;
  }
}

static inline bool tm_same_face_(const tm_builder_ *b, int64_t face, int n, const int64_t *node)
{
  const int64_t *other = b->face_node + b->face_offset[face];
  int            found = 0;

  if (b->face_offset[face + 1] - b->face_offset[face] != n) return false;
  for (int i = 0; i < n; i++)
    for (int k = 0; k < n; k++) found += node[i] == other[k];
  return found == n;
}

static inline void tm_face_(tm_builder_ *b, int64_t cell, int n, const int64_t *node)
{
  uint64_t hash = 0;
  int64_t  at;

  for (int i = 0; i < n; i++) hash += tm_mix_((uint64_t)node[i]);
  tm_make_room_(b, n);
  for (at = (int64_t)(hash % (uint64_t)b->slots); b->table[at]; at = (at + 1) % b->slots) {
    const int64_t face = b->table[at] - 1;

    if (b->hash[face] != hash || !tm_same_face_(b, face, n, node)) continue;
    if (b->neighbour[face] >= 0) abort(); /* a maker that puts a third cell at a face is broken */
    b->neighbour[face] = cell;
    return;
  }
  b->table[at]                   = ++b->num_faces;
  b->hash[b->num_faces - 1]      = hash;
  b->owner[b->num_faces - 1]     = cell;
  b->neighbour[b->num_faces - 1] = -1;
  b->face_offset[0]              = 0;
  memcpy(b->face_node + b->num_corners, node, (size_t)n * sizeof *node);
  b->num_corners += n;
  b->face_offset[b->num_faces] = b->num_corners;
}

/* The mesh of the builder's faces, whose nodes are the ids that occur, in ascending order; *id_of_node, the caller's to free,
 * tells them. Coordinates are still to be filled in. Frees what the builder holds. */
static inline tm_mesh *tm_finish_(tm_builder_ *b, int64_t num_ids, int64_t **id_of_node)
{
  int64_t *node_of_id = tm_alloc_(num_ids, sizeof *node_of_id), num_nodes = 0;
  tm_mesh *mesh;

  for (int64_t i = 0; i < b->num_corners; i++) node_of_id[b->face_node[i]] = 1;
  for (int64_t id = 0; id < num_ids; id++) num_nodes += node_of_id[id];
  *id_of_node = tm_alloc_(num_nodes, sizeof **id_of_node);
  num_nodes   = 0;
  for (int64_t id = 0; id < num_ids; id++) {
    if (!node_of_id[id]) continue;
    (*id_of_node)[num_nodes] = id;
    node_of_id[id]           = num_nodes++;
  }
  mesh = tm_new_(num_nodes, b->num_faces, b->num_corners, b->num_cells);
  for (int64_t i = 0; i < b->num_corners; i++) mesh->face_node[i] = node_of_id[b->face_node[i]];
  for (int64_t f = 0; f < b->num_faces; f++) {
    mesh->face_offset[f + 1] = b->face_offset[f + 1];
    mesh->owner[f]           = b->owner[f];
    mesh->neighbour[f]       = b->neighbour[f];
  }
  for (int64_t c = 0; c < b->num_cells; c++) mesh->global[c] = c;
  free(node_of_id);
  free(b->face_offset);
  free(b->face_node);
  free(b->owner);
  free(b->neighbour);
  free(b->hash);
  free(b->table);
  return mesh;
}

/* ---- the lattice: points of half the spacing of the boxes, so that centres and midpoints have ids too --------------- */

static inline int64_t tm_id_(const int n[3], const int p[3])
{
  return ((int64_t)p[2] * (2 * n[1] + 1) + p[1]) * (2 * n[0] + 1) + p[0];
}

static inline int64_t tm_num_ids_(const int n[3]) { return (int64_t)(2 * n[0] + 1) * (2 * n[1] + 1) * (2 * n[2] + 1); }

static inline void tm_lattice_point_(const int n[3], int64_t id, double xyz[3])
{
  for (int d = 0; d < 3; d++) {
    const int64_t side = 2 * n[d] + 1;

    xyz[d] = (double)(id % side) / (2 * n[d]);
    id /= side;
  }
}

static inline tm_mesh *tm_finish_lattice_(tm_builder_ *b, const int n[3], tm_map map, const void *data)
{
  int64_t *id;
  tm_mesh *mesh = tm_finish_(b, tm_num_ids_(n), &id);

  for (int64_t v = 0; v < mesh->view.num_nodes; v++) tm_lattice_point_(n, id[v], mesh->xyz + 3 * v);
  tm_move(mesh, map, data);
  free(id);
  return mesh;
}

/* Corners of a box, [x + 2 y + 4 z], and of its six faces, counter-clockwise seen from outside: -x, +x, -y, +y, -z, +z. */
static const int tm_box_face_[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

/* The lattice ids of a box's corners; lowest corner p, edges of `size` lattice steps. */
static inline void tm_corners_(const int n[3], const int p[3], int size, int64_t corner[8])
{
  for (int c = 0; c < 8; c++)
    corner[c] = tm_id_(n, (int[]){p[0] + (c & 1) * size, p[1] + (c >> 1 & 1) * size, p[2] + (c >> 2) * size});
}

/* ---- divisions of one box ------------------------------------------------------------------------------------------ */

static inline void tm_add_hexahedron_(tm_builder_ *b, const int64_t c[8])
{
  for (int f = 0; f < 6; f++) {
    const int *q = tm_box_face_[f];

    tm_face_(b, b->num_cells, 4, (int64_t[]){c[q[0]], c[q[1]], c[q[2]], c[q[3]]});
  }
  b->num_cells++;
}

static inline void tm_add_tetrahedron_(tm_builder_ *b, const int64_t v[4]) /* det[v1 - v0, v2 - v0, v3 - v0] > 0 */
{
  static const int face[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

  for (int f = 0; f < 4; f++) tm_face_(b, b->num_cells, 3, (int64_t[]){v[face[f][0]], v[face[f][1]], v[face[f][2]]});
  b->num_cells++;
}

/* Kuhn's six tetrahedra: paths along the axes from corner 0 to corner 7. Faces are cut from their lowest to their highest
 * corner, in all boxes alike. tet, oriented, gets corners of the box. */
static inline void tm_kuhn_(int tet[6][4])
{
  static const int axes[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}};

  for (int t = 0; t < 6; t++) {
    const int first = 1 << axes[t][0], second = first | 1 << axes[t][1], even = t < 3;

    tet[t][0] = 0;
    tet[t][1] = even ? first : second;
    tet[t][2] = even ? second : first;
    tet[t][3] = 7;
  }
}

static inline void tm_add_kuhn_(tm_builder_ *b, const int64_t c[8])
{
  int tet[6][4];

  tm_kuhn_(tet);
  for (int t = 0; t < 6; t++) tm_add_tetrahedron_(b, (int64_t[]){c[tet[t][0]], c[tet[t][1]], c[tet[t][2]], c[tet[t][3]]});
}

/* Two prisms along z, cut by the plane through corners 0, 3, 7, 4. */
static inline void tm_add_prisms_(tm_builder_ *b, const int64_t c[8])
{
  static const int base[2][3] = {{0, 1, 3}, {0, 3, 2}};

  for (int t = 0; t < 2; t++) {
    const int *v = base[t];

    tm_face_(b, b->num_cells, 3, (int64_t[]){c[v[0]], c[v[2]], c[v[1]]});
    tm_face_(b, b->num_cells, 3, (int64_t[]){c[v[0] + 4], c[v[1] + 4], c[v[2] + 4]});
    for (int h = 0; h < 3; h++) {
      const int from = v[h], to = v[(h + 1) % 3];

      tm_face_(b, b->num_cells, 4, (int64_t[]){c[from], c[to], c[to + 4], c[from + 4]});
    }
    b->num_cells++;
  }
}

/* Six pyramids with their tips in the middle; of a face whose bit is set in `cut`, two tetrahedra instead. */
static inline void tm_add_pyramids_(tm_builder_ *b, const int64_t c[8], int64_t middle, int cut)
{
  for (int f = 0; f < 6; f++) {
    int64_t q[4];
    int     low = 0;

    for (int h = 0; h < 4; h++) {
      q[h] = c[tm_box_face_[f][h]];
      if (q[h] < q[low]) low = h;
    }
    if (cut >> f & 1) {
      const int64_t v0 = q[low], v1 = q[(low + 1) % 4], v2 = q[(low + 2) % 4], v3 = q[(low + 3) % 4];

      tm_add_tetrahedron_(b, (int64_t[]){v0, v2, v1, middle});
      tm_add_tetrahedron_(b, (int64_t[]){v0, v3, v2, middle});
      continue;
    }
    tm_face_(b, b->num_cells, 4, q);
    for (int h = 0; h < 4; h++) tm_face_(b, b->num_cells, 3, (int64_t[]){q[(h + 1) % 4], q[h], middle});
    b->num_cells++;
  }
}
#endif
