/* blocks -- a supermesh made by hand: n[0] x n[1] x n[2] unit cubes, dealt out to ranks like cards, for tests of writers.
 *
 *   bl_blocks *b = bl_new((int[]){3, 2, 2}, rank, size);
 *   rvtk_write(comm, path, &b->content, &message);
 *   bl_free(b);
 *
 * Ancestors: cell c lies in source cell c, and in target cell c / 2 if c is even. Every face lies in one of the source, every
 * third in one of the target: face g in one of cell g + 1 called 100 + g, and in one of cell g / 2 + 1 called g % 6 + 1. A
 * field "Number" holds 1.5 c, six boundaries are the sides. Memory that runs out ends the program. */
#ifndef BLOCKS_H
#define BLOCKS_H

#include "slices.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct bl_blocks {
  rslice_content       content;
  remap_supermesh_view view;
  rslice_field         field;
  int                  n[3], rank, size;
  void                *own[40];
  int                  num_own;
} bl_blocks;

static inline void *bl_alloc(bl_blocks *b, int64_t count, size_t size)
{
  void *item = calloc((size_t)count + 1, size);

  if (!item || b->num_own == 40) abort();
  return b->own[b->num_own++] = item;
}

static inline int     bl_owner(const bl_blocks *b, int64_t cell) { return (int)(cell * 7 / 3 % b->size); }
static inline int64_t bl_node(const bl_blocks *b, int64_t i, int64_t j, int64_t k)
{
  return (k * (b->n[1] + 1) + j) * (b->n[0] + 1) + i;
}
static inline int64_t bl_cell(const bl_blocks *b, const int64_t at[3])
{
  for (int d = 0; d < 3; d++)
    if (at[d] < 0 || at[d] >= b->n[d]) return -1;
  return (at[2] * b->n[1] + at[1]) * b->n[0] + at[0];
}

/* Face number g: its axis, and the cells below and above it. */
static inline int64_t bl_num_faces(const bl_blocks *b, int axis)
{
  return (int64_t)(b->n[0] + (axis == 0)) * (b->n[1] + (axis == 1)) * (b->n[2] + (axis == 2));
}
static inline int bl_face(const bl_blocks *b, int64_t g, int64_t at[3], int64_t cell[2])
{
  int     axis = 0;
  int64_t below[3];

  for (; g >= bl_num_faces(b, axis); axis++) g -= bl_num_faces(b, axis);
  at[0] = g % (b->n[0] + (axis == 0));
  g /= b->n[0] + (axis == 0);
  at[1] = g % (b->n[1] + (axis == 1));
  at[2] = g / (b->n[1] + (axis == 1));
  memcpy(below, at, sizeof below);
  below[axis]--;
  cell[0] = bl_cell(b, below);
  cell[1] = bl_cell(b, at);
  return axis;
}

/* The four nodes of a face, global numbers, the normal along the axis. */
static inline void bl_loop(const bl_blocks *b, int axis, const int64_t at[3], int64_t node[4])
{
  static const int u[4] = {0, 1, 1, 0}, v[4] = {0, 0, 1, 1};

  for (int i = 0; i < 4; i++) {
    int64_t p[3] = {at[0], at[1], at[2]};

    p[(axis + 1) % 3] += u[i];
    p[(axis + 2) % 3] += v[i];
    node[i] = bl_node(b, p[0], p[1], p[2]);
  }
}

/* Cells of this rank and what belongs to them; local[c] is the place of global cell c, -1. */
static inline int32_t *bl_cells(bl_blocks *b)
{
  remap_supermesh_view *v      = &b->view;
  int32_t              *local  = bl_alloc(b, v->global_cells, sizeof *local);
  int64_t              *global = bl_alloc(b, v->global_cells, sizeof *global), *from[2];
  double *volume = bl_alloc(b, v->global_cells, sizeof *volume), *field = bl_alloc(b, v->global_cells, sizeof *field);

  for (int s = 0; s < 2; s++) v->cell_ancestor[s] = from[s] = bl_alloc(b, v->global_cells, sizeof *from[s]);
  for (int64_t c = 0; c < v->global_cells; c++) {
    local[c] = -1;
    if (bl_owner(b, c) != b->rank) continue;
    local[c]             = (int32_t)v->num_cells;
    global[v->num_cells] = from[0][v->num_cells] = c;
    from[1][v->num_cells]                        = c % 2 ? -1 : c / 2;
    volume[v->num_cells]                         = 1;
    field[v->num_cells++]                        = 1.5 * (double)c;
  }
  v->cell_global = global;
  v->cell_volume = volume;
  b->field       = (rslice_field){"Number", field};
  return local;
}

/* Faces of those cells, over global nodes. Every other face points out of its upper cell. */
static inline int64_t *bl_faces(bl_blocks *b, const int32_t *local)
{
  remap_supermesh_view *v      = &b->view;
  const int64_t         most   = v->global_faces;
  int64_t              *offset = bl_alloc(b, most + 1, sizeof *offset), *global = bl_alloc(b, most, sizeof *global),
          *loop = bl_alloc(b, 4 * most, sizeof *loop), *beyond_cell = bl_alloc(b, most, sizeof *beyond_cell);
  int32_t *owner = bl_alloc(b, most, sizeof *owner), *neighbour = bl_alloc(b, most, sizeof *neighbour),
          *beyond_face = bl_alloc(b, most, sizeof *beyond_face), *boundary = bl_alloc(b, most, sizeof *boundary), *from[2];

  int64_t *face[4]; /* cells and numbers of both sides */

  for (int k = 0; k < 4; k++) face[k] = bl_alloc(b, most, sizeof *face[k]);
  for (int side = 0; side < 2; side++) v->face_from[side] = from[side] = bl_alloc(b, most, sizeof *from[side]);
  for (int64_t g = 0; g < most; g++) {
    int64_t       at[3], cell[2], node[4];
    const int     axis = bl_face(b, g, at, cell);
    const int64_t f    = v->num_faces;
    int           out  = cell[0] < 0 || local[cell[0]] < 0 || (cell[1] >= 0 && local[cell[1]] >= 0 && g % 2); /* whose normal */

    if (cell[out] < 0 || local[cell[out]] < 0) continue;
    bl_loop(b, axis, at, node);
    for (int i = 0; i < 4; i++) loop[4 * f + i] = node[out ? 3 - i : i];
    global[f]    = g;
    from[1][f]   = g % 3 ? -1 : 0;
    face[0][f]   = g + 1;
    face[1][f]   = g % 3 ? 0 : g / 2 + 1;
    face[2][f]   = 100 + g;
    face[3][f]   = g % 3 ? 0 : g % 6 + 1;
    owner[f]     = local[cell[out]];
    neighbour[f] = cell[1 - out] < 0 ? -1 : local[cell[1 - out]];
    boundary[f]  = cell[1 - out] < 0 ? 2 * axis + !out : -1;
    if (cell[1 - out] >= 0 && neighbour[f] < 0) {
      beyond_face[v->num_beyond]   = (int32_t)f;
      beyond_cell[v->num_beyond++] = cell[1 - out];
    }
    offset[++v->num_faces] = 4 * (f + 1);
  }
  v->face_offset           = offset;
  v->face_global           = global;
  v->face_owner            = owner;
  v->face_neighbour        = neighbour;
  v->beyond_face           = beyond_face;
  v->beyond_cell           = beyond_cell;
  for (int side = 0; side < 2; side++) b->content.face_cell[side] = face[side], b->content.face_number[side] = face[2 + side];
  b->content.face_boundary = boundary;
  return loop;
}

/* Nodes of those faces. */
static inline void bl_nodes(bl_blocks *b, const int64_t *loop)
{
  remap_supermesh_view *v = &b->view;
  int32_t *local = bl_alloc(b, v->global_nodes, sizeof *local), *node = bl_alloc(b, 4 * v->num_faces, sizeof *node);
  int64_t *global = bl_alloc(b, v->global_nodes, sizeof *global);
  double  *xyz    = bl_alloc(b, 3 * v->global_nodes, sizeof *xyz);

  for (int64_t i = 0; i < 4 * v->num_faces; i++) local[loop[i]] = 1;
  for (int64_t g = 0; g < v->global_nodes; g++) {
    if (!local[g]) continue;
    xyz[3 * v->num_nodes]     = (double)(g % (b->n[0] + 1));
    xyz[3 * v->num_nodes + 1] = (double)(g / (b->n[0] + 1) % (b->n[1] + 1));
    xyz[3 * v->num_nodes + 2] = (double)(g / (b->n[0] + 1) / (b->n[1] + 1));
    global[v->num_nodes]      = g;
    local[g]                  = (int32_t)v->num_nodes++;
  }
  for (int64_t i = 0; i < 4 * v->num_faces; i++) node[i] = local[loop[i]];
  v->node_xyz    = xyz;
  v->node_global = global;
  v->face_node   = node;
}

static inline bl_blocks *bl_new(const int n[3], int rank, int size)
{
  static const char *const name[6] = {"left", "right", "front", "back", "a very long name with / in it, 40 letters", "top"};
  bl_blocks               *b       = calloc(1, sizeof *b);

  if (!b) abort();
  memcpy(b->n, n, sizeof b->n);
  b->rank              = rank;
  b->size              = size;
  b->view.global_cells = (int64_t)n[0] * n[1] * n[2];
  b->view.global_nodes = (int64_t)(n[0] + 1) * (n[1] + 1) * (n[2] + 1);
  for (int d = 0; d < 3; d++) b->view.global_faces += bl_num_faces(b, d);
  b->content = (rslice_content){.mesh           = &b->view,
                                .ancestor       = {"AncestorA", "AncestorB"},
                                .num_fields     = 1,
                                .field          = &b->field,
                                .num_boundaries = 6,
                                .boundary_name  = name};
  bl_nodes(b, bl_faces(b, bl_cells(b)));
  return b;
}

static inline void bl_free(bl_blocks *b)
{
  for (int i = 0; i < b->num_own; i++) free(b->own[i]);
  free(b);
}

/* Do two files hold the same bytes? */
static inline int bl_same_files(const char *one, const char *other)
{
  FILE *a = fopen(one, "rb"), *b = fopen(other, "rb");
  int   x = 0, y = a && b ? 0 : 1;

  while (x == y && x != EOF) {
    x = fgetc(a);
    y = fgetc(b);
  }
  if (a) fclose(a);
  if (b) fclose(b);
  return x == y;
}

#endif
