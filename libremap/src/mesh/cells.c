/* cells -- the faces of each cell, and whether they close it. O(corners) time. */
#include "mesh/mesh_private.h"

#include <string.h>

remap_status rm_mesh_cell_faces(rm_arena *arena, rm_lid num_cells, rm_lid num_faces, const rm_lid (*face_cell)[2],
                                const int64_t **offset, const rm_lid **face)
{
  int64_t *first;
  rm_lid  *list;

  RM_NEW0(first, arena, (int64_t)num_cells + 2);
  for (rm_lid f = 0; f < num_faces; f++)
    for (int s = 0; s < 2; s++)
      if (face_cell[f][s] >= 0) first[face_cell[f][s] + 1]++;
  RM_NEW(list, arena, rm_offsets(first + 1, num_cells));
  /* first[c + 1] is where the next face of cell c goes, and ends as where those of c + 1 begin. */
  for (rm_lid f = 0; f < num_faces; f++)
    for (int s = 0; s < 2; s++)
      if (face_cell[f][s] >= 0) list[first[face_cell[f][s] + 1]++] = f;
  *offset = first;
  *face   = list;
  return REMAP_OK;
}

/* An undirected edge and how often it runs from its smaller node minus how often it runs to it. */
typedef struct edge {
  uint64_t key;
  int64_t  balance;
} edge;

/* Corners of a cell's faces. */
static int64_t num_corners(const rm_mesh *mesh, rm_lid cell)
{
  int64_t num = 0;

  for (int64_t i = mesh->cell_face_offset[cell]; i < mesh->cell_face_offset[cell + 1]; i++) {
    const rm_lid f = mesh->cell_face[i];

    num += mesh->face_offset[f + 1] - mesh->face_offset[f];
  }
  return num;
}

/* Count one passage along an edge in a table of a power of two entries; balance 0 with key 0 is free. Returns by how much the
 * number of unbalanced edges changes. */
static int pass(edge *table, uint64_t size, rm_lid from, rm_lid to)
{
  const rm_lid   lo = from < to ? from : to, hi = from < to ? to : from;
  const uint64_t key = (uint64_t)lo << 32 | (uint64_t)hi; /* never 0: hi > lo */
  uint64_t       at  = rm_hash_word(key) & (size - 1);
  int64_t        before;

  while (table[at].key != 0 && table[at].key != key) at = (at + 1) & (size - 1);
  table[at].key = key;
  before        = table[at].balance;
  table[at].balance += from == lo ? 1 : -1;
  return (table[at].balance != 0) - (before != 0);
}

/* True if each edge of the cell runs as often one way as the other; if not, node gets the ends of one that does not. */
static bool is_closed(const rm_mesh *mesh, rm_lid cell, edge *table, rm_lid node[2])
{
  uint64_t size       = 16;
  int64_t  unbalanced = 0;

  while (size < 2 * (uint64_t)num_corners(mesh, cell)) size *= 2;
  memset(table, 0, size * sizeof *table);
  for (int64_t i = mesh->cell_face_offset[cell]; i < mesh->cell_face_offset[cell + 1]; i++) {
    const rm_lid  f     = mesh->cell_face[i];
    const rm_lid *loop  = mesh->face_node + mesh->face_offset[f];
    const int64_t n     = mesh->face_offset[f + 1] - mesh->face_offset[f];
    const bool    owned = mesh->face_cell[f][0] == cell;

    for (int64_t k = 0; k < n; k++) {
      const rm_lid a = loop[k], b = loop[k + 1 < n ? k + 1 : 0];

      unbalanced += owned ? pass(table, size, a, b) : pass(table, size, b, a);
    }
  }
  if (unbalanced == 0) return true;
  for (uint64_t at = 0; at < size; at++)
    if (table[at].balance != 0) {
      node[0] = (rm_lid)(table[at].key >> 32);
      node[1] = (rm_lid)(table[at].key & UINT32_MAX);
      break;
    }
  return false;
}

remap_status rm_mesh_find_open(rm_arena *scratch, const rm_mesh *mesh, rm_mesh_open *out)
{
  int64_t most = 0, size = 16;
  edge   *table;

  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    const int64_t n = num_corners(mesh, c);
    if (n > most) most = n;
  }
  while (size < 2 * most) size *= 2;
  RM_NEW(table, scratch, size);
  for (out->cell = 0; out->cell < mesh->num_cells; out->cell++)
    if (!is_closed(mesh, out->cell, table, out->node)) return REMAP_OK;
  out->cell = -1;
  return REMAP_OK;
}
