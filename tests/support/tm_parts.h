/* tm_parts -- meshes over ranks: a rank for each cell, and what one rank has of a mesh. O(cells). See meshes.h. */
#ifndef TM_PARTS_H
#define TM_PARTS_H

#include "tm_mesh.h"

#include <string.h>

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
