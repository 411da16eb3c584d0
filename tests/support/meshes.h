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
 * costs O(cells) with one hash look-up per face and cell. */
#ifndef MESHES_H
#define MESHES_H

#include <remap/remap.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A mesh that owns its arrays; view points to them. Everything in view may be changed or replaced by the caller. */
typedef struct tm_mesh {
  remap_mesh   view;
  double      *xyz;         /* [num_nodes][3]              */
  int64_t     *face_offset; /* [num_faces + 1]             */
  int64_t     *face_node;   /* [face_offset[num_faces]]    */
  int64_t     *owner;       /* [num_faces]                 */
  int64_t     *neighbour;   /* [num_faces], -1 for none    */
  int64_t     *global;      /* [num_cells]                 */
  int64_t     *zone_offset; /* [num_zones + 1] or NULL     */
  const char **zone_name;   /* [num_zones] literals, or NULL */
} tm_mesh;

/* Moves one point. */
typedef void (*tm_map)(double xyz[3], const void *data);

static inline void *tm_alloc_(int64_t count, size_t size)
{
  void *memory = calloc((size_t)count + 1, size);

  if (!memory) {
    fprintf(stderr, "meshes.h: memory is out\n");
    abort();
  }
  return memory;
}

static inline void tm_free(tm_mesh *mesh)
{
  if (!mesh) return;
  free(mesh->xyz);
  free(mesh->face_offset);
  free(mesh->face_node);
  free(mesh->owner);
  free(mesh->neighbour);
  free(mesh->global);
  free(mesh->zone_offset);
  free((void *)mesh->zone_name);
  free(mesh);
}

/* Let the view point to the arrays. */
static inline void tm_view_(tm_mesh *mesh)
{
  mesh->view.node_xyz         = mesh->xyz;
  mesh->view.face_offset      = mesh->face_offset;
  mesh->view.face_node        = mesh->face_node;
  mesh->view.face_owner       = mesh->owner;
  mesh->view.face_neighbour   = mesh->neighbour;
  mesh->view.cell_global      = mesh->global;
  mesh->view.zone_name        = mesh->zone_name;
  mesh->view.zone_cell_offset = mesh->zone_offset;
}

/* A mesh with room for the given counts. */
static inline tm_mesh *tm_new_(int64_t num_nodes, int64_t num_faces, int64_t num_corners, int64_t num_cells)
{
  tm_mesh *mesh = tm_alloc_(1, sizeof *mesh);

  mesh->view.num_nodes = num_nodes;
  mesh->view.num_faces = num_faces;
  mesh->view.num_cells = num_cells;
  mesh->xyz            = tm_alloc_(3 * num_nodes, sizeof(double));
  mesh->face_offset    = tm_alloc_(num_faces + 1, sizeof(int64_t));
  mesh->face_node      = tm_alloc_(num_corners, sizeof(int64_t));
  mesh->owner          = tm_alloc_(num_faces, sizeof(int64_t));
  mesh->neighbour      = tm_alloc_(num_faces, sizeof(int64_t));
  mesh->global         = tm_alloc_(num_cells, sizeof(int64_t));
  tm_view_(mesh);
  return mesh;
}

static inline uint64_t tm_mix_(uint64_t x)
{
  x += UINT64_C(0x9e3779b97f4a7c15);
  x = (x ^ x >> 32) * UINT64_C(0xd6e8feb86659fd93);
  x = (x ^ x >> 29) * UINT64_C(0xd6e8feb86659fd93);
  return x ^ x >> 32;
}

/* The next of a sequence of random numbers, below end. */
static inline int64_t tm_random(uint64_t *state, int64_t end) { return (int64_t)(tm_mix_((*state)++) % (uint64_t)end); }

/* ---- maps -------------------------------------------------------------------------------------------------------- */

/* The warp of q = size sin(2 pi x + phase) sin(2 pi y + phase) sin(2 pi z + phase): (x, y, z) += (q, 0.7 q, -0.9 q). */
typedef struct tm_warping {
  double size, phase;
} tm_warping;
static inline void tm_warp(double xyz[3], const void *data)
{
  const tm_warping *warp = data;
  const double      w    = 2 * M_PI;
  const double q = warp->size * sin(w * xyz[0] + warp->phase) * sin(w * xyz[1] + warp->phase) * sin(w * xyz[2] + warp->phase);

  xyz[0] += q;
  xyz[1] += .7 * q;
  xyz[2] += -.9 * q;
}

/* A 3 x 4 matrix by rows: linear part, then translation. data is double[12]. */
static inline void tm_affine(double xyz[3], const void *data)
{
  const double *m = data, x = xyz[0], y = xyz[1], z = xyz[2];

  for (int r = 0; r < 3; r++) xyz[r] = m[4 * r] * x + m[4 * r + 1] * y + m[4 * r + 2] * z + m[4 * r + 3];
}

/* The lattice's n[0] x n[1] x n[2] boxes as cubes of edge 366 about the origin; `turned`: by the rotation of the quaternion
 * (13, 2, 1, 3), which is rational with denominator 183, and moved a little. All coordinates are exact, so that faces are
 * exactly planar; turned cubes are in general position to those that are not. */
typedef struct tm_cubing {
  int  n[3];
  bool turned;
} tm_cubing;
static inline void tm_cube(double xyz[3], const void *data)
{
  static const double turn[3][3] = {{163, -74, 38}, {82, 157, -46}, {-14, 58, 173}};
  static const double move[3]    = {37 + 311 / 1024., 101 + 717 / 1024., -59 - 103 / 1024.};
  const tm_cubing    *cubes      = data;
  double              at[3];

  for (int d = 0; d < 3; d++) at[d] = rint(2 * xyz[d] * cubes->n[d]) - cubes->n[d]; /* halves, too, come to lie exactly */
  for (int d = 0; d < 3; d++)
    xyz[d] = cubes->turned ? turn[d][0] * at[0] + turn[d][1] * at[1] + turn[d][2] * at[2] + move[d] : 183 * at[d];
}

/* Rotation by an angle about z, then by the same angle about x. */
static inline void tm_rotate_(double xyz[3], double angle)
{
  const double c = cos(angle), s = sin(angle), x = c * xyz[0] - s * xyz[1], y = s * xyz[0] + c * xyz[1], z = xyz[2];

  xyz[0] = x;
  xyz[1] = c * y - s * z;
  xyz[2] = s * y + c * z;
}

/* Move all nodes of a mesh. */
static inline void tm_move(tm_mesh *mesh, tm_map map, const void *data)
{
  for (int64_t v = 0; map && v < mesh->view.num_nodes; v++) map(mesh->xyz + 3 * v, data);
}

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

/* ---- dual of the tetrahedra ------------------------------------------------------------------------------------------ */

/* One edge in one tetrahedron: det[to - from, left - from, right - from] > 0, so that going round the edge by the right-hand
 * rule leads from the triangle with `left` to the one with `right`. */
typedef struct tm_wedge_ {
  int64_t from, to, left, right, tet;
} tm_wedge_;
static inline int tm_by_edge_(const void *x, const void *y)
{
  const tm_wedge_ *v = x, *w = y;

  if (v->from != w->from) return v->from < w->from ? -1 : 1;
  return (v->to > w->to) - (v->to < w->to);
}

/* Dual nodes are the tetrahedra and, on the boundary, centres of triangles, midpoints of edges and nodes: the mean of `count`
 * nodes, found in a lattice of sixths of a box. m counts nodes. */
static inline int64_t tm_mean_id_(const int m[3], int64_t num_tets, int count, const int64_t *node)
{
  int64_t sixth[3] = {0, 0, 0};

  for (int v = 0; v < count; v++) {
    sixth[0] += 6 / count * (node[v] % m[0]);
    sixth[1] += 6 / count * (node[v] / m[0] % m[1]);
    sixth[2] += 6 / count * (node[v] / m[0] / m[1]);
  }
  return num_tets + (sixth[2] * (6 * m[1] - 5) + sixth[1]) * (6 * m[0] - 5) + sixth[0];
}

/* The dual faces of one edge, from its wedges in any order: the polygon of the tetrahedra around it and, on the boundary,
 * what closes the cells of both ends. */
static inline void tm_add_dual_edge_(tm_builder_ *b, const int m[3], int64_t num_tets, const tm_wedge_ *wedge, int num_wedges)
{
  enum { MOST = 64 };
  const int64_t from = wedge->from, to = wedge->to;
  int           first = 0, here, next, count = 0;
  bool          inner = true;
  int64_t       loop[MOST + 3], tip[2], centre[2], middle;

  for (int w = 0; w < num_wedges; w++) {
    bool has_previous = false;

    for (int v = 0; v < num_wedges; v++) has_previous = has_previous || wedge[v].right == wedge[w].left;
    if (!has_previous) first = w;
    inner = inner && has_previous;
  }
  if (num_wedges > MOST) abort();
  loop[count++] = -1; /* for the first triangle of a boundary edge */
  for (here = first, next = -1; next != first; here = next) {
    loop[count++] = wedge[here].tet;
    for (next = 0; next < num_wedges && wedge[next].left != wedge[here].right;) next++;
    if (next == num_wedges) break;
  }
  if (inner) {
    tm_face_(b, from, count - 1, loop + 1);
    tm_face_(b, to, count - 1, loop + 1);
    return;
  }
  tip[0] = wedge[first].left;
  tip[1] = wedge[here].right;
  middle = tm_mean_id_(m, num_tets, 2, (int64_t[]){from, to});
  for (int h = 0; h < 2; h++) centre[h] = tm_mean_id_(m, num_tets, 3, (int64_t[]){from, to, tip[h]});
  loop[0]       = centre[0];
  loop[count++] = centre[1];
  loop[count++] = middle;
  tm_face_(b, from, count, loop);
  tm_face_(b, to, count, loop);
  for (int h = 0; h < 2; h++) {
    const int64_t corner[2] = {tm_mean_id_(m, num_tets, 1, &from), tm_mean_id_(m, num_tets, 1, &to)};

    tm_face_(b, h ? from : to, 3, (int64_t[]){corner[!h], middle, centre[h]});
    tm_face_(b, h ? to : from, 3, (int64_t[]){middle, corner[h], centre[h]});
  }
}

/* All wedges of the tetrahedra of a lattice, sorted by edge; *mean, [num_tets][3], gets the tetrahedra's centres. */
static inline tm_wedge_ *tm_wedges_(const int n[3], double **mean)
{
  static const int even[6][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}};
  const int64_t    num_tets   = (int64_t)6 * n[0] * n[1] * n[2];
  tm_wedge_       *wedge      = tm_alloc_(6 * num_tets, sizeof *wedge);
  int              kuhn[6][4];

  tm_kuhn_(kuhn);
  *mean = tm_alloc_(3 * num_tets, sizeof **mean);
  for (int64_t tet = 0; tet < num_tets; tet++) {
    const int64_t box    = tet / 6;
    const int     ijk[3] = {(int)(box % n[0]), (int)(box / n[0] % n[1]), (int)(box / n[0] / n[1])};
    int64_t       v[4];

    for (int h = 0; h < 4; h++) {
      const int c = kuhn[tet % 6][h], at[3] = {ijk[0] + (c & 1), ijk[1] + (c >> 1 & 1), ijk[2] + (c >> 2)};

      v[h] = ((int64_t)at[2] * (n[1] + 1) + at[1]) * (n[0] + 1) + at[0];
      for (int d = 0; d < 3; d++) (*mean)[3 * tet + d] += .25 * at[d] / n[d];
    }
    for (int e = 0; e < 6; e++) {
      const int64_t a = v[even[e][0]], z = v[even[e][1]], left = v[even[e][2]], right = v[even[e][3]];

      wedge[6 * tet + e] = a < z ? (tm_wedge_){a, z, left, right, tet} : (tm_wedge_){z, a, right, left, tet};
    }
  }
  qsort(wedge, (size_t)(6 * num_tets), sizeof *wedge, tm_by_edge_);
  return wedge;
}

/* The dual of tm_tetrahedra(n): a polyhedron about every node, with a face for every edge (up to 26 faces of up to 9 nodes),
 * closed by triangles on the boundary. */
static inline tm_mesh *tm_dual(const int n[3], tm_map map, const void *data)
{
  const int     m[3]     = {n[0] + 1, n[1] + 1, n[2] + 1};
  const int64_t num_tets = (int64_t)6 * n[0] * n[1] * n[2], side[3] = {6 * n[0] + 1, 6 * n[1] + 1, 6 * n[2] + 1};
  double       *mean;
  tm_wedge_    *wedge = tm_wedges_(n, &mean);
  tm_builder_   b     = {.num_cells = (int64_t)m[0] * m[1] * m[2]};
  int64_t      *id;
  tm_mesh      *mesh;

  for (int64_t begin = 0, end; begin < 6 * num_tets; begin = end) {
    for (end = begin + 1; end < 6 * num_tets && tm_by_edge_(&wedge[begin], &wedge[end]) == 0;) end++;
    tm_add_dual_edge_(&b, m, num_tets, wedge + begin, (int)(end - begin));
  }
  mesh = tm_finish_(&b, num_tets + side[0] * side[1] * side[2], &id);
  for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
    int64_t sixths = id[v] - num_tets;

    for (int d = 0; d < 3; d++) {
      mesh->xyz[3 * v + d] = id[v] < num_tets ? mean[3 * id[v] + d] : (double)(sixths % side[d]) / (6 * n[d]);
      sixths /= side[d];
    }
  }
  tm_move(mesh, map, data);
  free(wedge);
  free(mean);
  free(id);
  return mesh;
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

/* ---- distribution ------------------------------------------------------------------------------------------------------ */

typedef enum tm_dealing {
  TM_SLABS,  /* contiguous ranges of equal length                  */
  TM_RANDOM, /* every cell by lot                                   */
  TM_LAST    /* all cells to the last rank, the others without any  */
} tm_dealing;

/* A rank for every cell of a mesh; malloc'ed, the caller's. The same on every rank. */
static inline int *tm_deal(const tm_mesh *mesh, int num_ranks, tm_dealing how, uint64_t seed)
{
  int     *rank  = tm_alloc_(mesh->view.num_cells, sizeof *rank);
  uint64_t state = tm_mix_(seed);

  for (int64_t c = 0; c < mesh->view.num_cells; c++) {
    switch (how) {
      case TM_SLABS: rank[c] = (int)(c * num_ranks / mesh->view.num_cells); break;
      case TM_RANDOM: rank[c] = (int)tm_random(&state, num_ranks); break;
      default: rank[c] = num_ranks - 1; break;
    }
  }
  return rank;
}

/* Number the marked entries of index from 0 and set the others to -1: in order, or shuffled if state is not NULL. Returns how
 * many there are. */
static inline int64_t tm_number_(int64_t *index, int64_t n, uint64_t *state)
{
  int64_t *marked = tm_alloc_(n, sizeof *marked), count = 0;

  for (int64_t i = 0; i < n; i++) {
    if (index[i]) marked[count++] = i;
    index[i] = -1;
  }
  for (int64_t i = count - 1; state && i > 0; i--) {
    const int64_t k = tm_random(state, i + 1), x = marked[i];

    marked[i] = marked[k];
    marked[k] = x;
  }
  for (int64_t i = 0; i < count; i++) index[marked[i]] = i;
  free(marked);
  return count;
}

/* The part of a mesh that belongs to one rank: the cells with rank_of_cell[cell] == rank (NULL: all of them), numbered as in
 * the whole; with a seed other than 0 the cells, faces and nodes are numbered at random, loops begin anywhere and faces may be
 * turned over to their other cell. cell_global and zones are those of the whole mesh. */
static inline tm_mesh *tm_part(const tm_mesh *whole, const int *rank_of_cell, int rank, uint64_t seed)
{
  const remap_mesh *view  = &whole->view;
  uint64_t          state = tm_mix_(seed), *shuffle = seed ? &state : NULL;
  int64_t          *cell = tm_alloc_(view->num_cells, sizeof *cell), *face = tm_alloc_(view->num_faces, sizeof *face);
  int64_t          *node = tm_alloc_(view->num_nodes, sizeof *node), *whole_face, num_cells, num_faces, num_nodes, corners = 0;
  tm_mesh          *part;

  for (int64_t c = 0; c < view->num_cells; c++) cell[c] = !rank_of_cell || rank_of_cell[c] == rank;
  for (int64_t f = 0; f < view->num_faces; f++) {
    face[f] = cell[whole->owner[f]] || (whole->neighbour[f] >= 0 && cell[whole->neighbour[f]]);
    if (!face[f]) continue;
    corners += whole->face_offset[f + 1] - whole->face_offset[f];
    for (int64_t i = whole->face_offset[f]; i < whole->face_offset[f + 1]; i++) node[whole->face_node[i]] = 1;
  }
  num_cells = tm_number_(cell, view->num_cells, shuffle);
  num_faces = tm_number_(face, view->num_faces, shuffle);
  num_nodes = tm_number_(node, view->num_nodes, shuffle);

  part       = tm_new_(num_nodes, num_faces, corners, num_cells);
  whole_face = tm_alloc_(num_faces, sizeof *whole_face);
  for (int64_t c = 0; c < view->num_cells; c++)
    if (cell[c] >= 0) part->global[cell[c]] = whole->global[c];
  for (int64_t v = 0; v < view->num_nodes; v++)
    if (node[v] >= 0) memcpy(part->xyz + 3 * node[v], whole->xyz + 3 * v, 3 * sizeof(double));
  for (int64_t f = 0; f < view->num_faces; f++)
    if (face[f] >= 0) whole_face[face[f]] = f;

  for (int64_t f = 0; f < num_faces; f++) {
    const int64_t from = whole->face_offset[whole_face[f]], n = whole->face_offset[whole_face[f] + 1] - from;
    const int64_t begin = shuffle ? tm_random(shuffle, n) : 0, left = cell[whole->owner[whole_face[f]]];
    const int64_t right = whole->neighbour[whole_face[f]] < 0 ? -1 : cell[whole->neighbour[whole_face[f]]];
    const bool    turn  = left < 0 || (right >= 0 && shuffle && tm_random(shuffle, 2));

    part->owner[f]           = turn ? right : left;
    part->neighbour[f]       = turn ? left : right;
    part->face_offset[f + 1] = part->face_offset[f] + n;
    for (int64_t i = 0; i < n; i++)
      part->face_node[part->face_offset[f] + i] = node[whole->face_node[from + (turn ? begin + n - i : begin + i) % n]];
  }
  part->view.name      = view->name;
  part->view.num_zones = view->num_zones;
  if (view->num_zones > 0) {
    part->zone_offset = tm_alloc_(view->num_zones + 1, sizeof(int64_t));
    part->zone_name   = tm_alloc_(view->num_zones, sizeof(char *));
    memcpy(part->zone_offset, whole->zone_offset, (size_t)(view->num_zones + 1) * sizeof(int64_t));
    memcpy((void *)part->zone_name, (const void *)whole->zone_name, (size_t)view->num_zones * sizeof(char *));
    tm_view_(part);
  }
  free(cell);
  free(face);
  free(node);
  free(whole_face);
  return part;
}
#endif
