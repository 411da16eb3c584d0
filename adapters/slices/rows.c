/* rows -- nodes, faces and cells of a supermesh as rows of words. What is written of a face or cell does not depend on the
 * rank that has it: faces point out of their lower cell, loops begin at their lowest node, the faces of a cell ascend. Linear.
 * */
#include "slices.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* Rows that are collected; room for all of them is taken at once. */
typedef struct rows {
  int64_t  num;
  int64_t *global, *offset, *word;
} rows;

static bool rows_begin(rows *r, int64_t most_rows, int64_t most_words)
{
  *r        = (rows){.num = 0};
  r->global = calloc((size_t)most_rows + 1, sizeof *r->global);
  r->offset = calloc((size_t)most_rows + 2, sizeof *r->offset);
  r->word   = calloc((size_t)most_words + 1, sizeof *r->word);
  return r->global && r->offset && r->word;
}

static void rows_end(rows *r)
{
  free(r->global);
  free(r->offset);
  free(r->word);
}

/* The row grows by a word, or by a number bit by bit. */
static void put(rows *r, int64_t word) { r->word[r->offset[r->num + 1]++] = word; }
static void put_bits(rows *r, double x) { memcpy(&r->word[r->offset[r->num + 1]++], &x, sizeof x); }
static void close_row(rows *r, int64_t global)
{
  r->global[r->num++]   = global;
  r->offset[r->num + 1] = r->offset[r->num];
}

rslice_status rslice_nodes(MPI_Comm comm, const remap_supermesh_view *mesh, rslice_rows *out)
{
  rows          r;
  rslice_status status = rows_begin(&r, mesh->num_nodes, 3 * mesh->num_nodes) ? RSLICE_OK : RSLICE_MEMORY;

  for (int64_t i = 0; status == RSLICE_OK && i < mesh->num_nodes; i++) {
    for (int k = 0; k < 3; k++) put_bits(&r, mesh->node_xyz[3 * i + k]);
    close_row(&r, mesh->node_global[i]);
  }
  status = rslice_ship(comm, status, mesh->global_nodes, r.num, r.global, r.offset, r.word, out);
  rows_end(&r);
  return status;
}

/* ---- faces ----------------------------------------------------------------------------------------------------------- */

/* The global cell behind each face, -1: none. The caller frees; NULL: no memory. */
static int64_t *cells_behind(const remap_supermesh_view *m)
{
  int64_t *behind = calloc((size_t)m->num_faces + 1, sizeof *behind);

  for (int64_t f = 0; behind && f < m->num_faces; f++)
    behind[f] = m->face_neighbour[f] >= 0 ? m->cell_global[m->face_neighbour[f]] : -1;
  for (int64_t i = 0; behind && i < m->num_beyond; i++) behind[m->beyond_face[i]] = m->beyond_cell[i];
  return behind;
}

/* The loop of a face, turned round if asked, from its lowest node. */
static void put_loop(rows *r, const remap_supermesh_view *m, int64_t face, bool reverse)
{
  const int32_t *loop = m->face_node + m->face_offset[face];
  const int64_t  n    = m->face_offset[face + 1] - m->face_offset[face];
  int64_t        low  = 0;

  for (int64_t i = 1; i < n; i++)
    if (m->node_global[loop[i]] < m->node_global[loop[low]]) low = i;
  for (int64_t i = 0; i < n; i++) put(r, m->node_global[loop[(reverse ? low + n - i : low + i) % n]]);
}

rslice_status rslice_faces(MPI_Comm comm, const rslice_content *content, rslice_rows *out)
{
  const remap_supermesh_view *m       = content->mesh;
  const int64_t               corners = m->num_faces ? m->face_offset[m->num_faces] : 0;
  int64_t                    *behind  = cells_behind(m);
  rows                        r       = {.num = 0};
  rslice_status               status  = RSLICE_OK;

  if (!behind || !rows_begin(&r, m->num_faces, RSLICE_FACE_HEAD * m->num_faces + corners))
    status = RSLICE_MEMORY;
  for (int64_t f = 0; status == RSLICE_OK && f < m->num_faces; f++) {
    const int64_t mine = m->cell_global[m->face_owner[f]], other = behind[f];
    const bool    turn = other >= 0 && other < mine;

    if (m->face_neighbour[f] < 0 && turn) continue; /* the rank of the lower cell gives it */
    put(&r, turn ? other : mine);
    put(&r, turn ? mine : other);
    put(&r, content->num_boundaries ? content->face_boundary[f] : -1);
    put(&r, (m->face_from[0][f] >= 0) + 2 * (m->face_from[1][f] >= 0));
    for (int side = 0; side < 2; side++) put(&r, content->face_cell[side] ? content->face_cell[side][f] : 0);
    for (int side = 0; side < 2; side++) put(&r, content->face_number[side] ? content->face_number[side][f] : 0);
    put_loop(&r, m, f, turn);
    close_row(&r, m->face_global[f]);
  }
  status = rslice_ship(comm, status, m->global_faces, r.num, r.global, r.offset, r.word, out);
  free(behind);
  rows_end(&r);
  return status;
}

/* ---- cells ----------------------------------------------------------------------------------------------------------- */

/* Faces of each cell of this rank, ascending. Owned. */
typedef struct cell_faces {
  int64_t *offset, *face; /* [cells + 1]; face */
} cell_faces;

static bool faces_of_cells(const remap_supermesh_view *m, cell_faces *out)
{
  out->offset = calloc((size_t)m->num_cells + 2, sizeof *out->offset);
  out->face   = calloc(2 * (size_t)m->num_faces + 1, sizeof *out->face);
  if (!out->offset || !out->face) return false;
  for (int64_t f = 0; f < m->num_faces; f++) {
    out->offset[m->face_owner[f] + 2]++;
    if (m->face_neighbour[f] >= 0) out->offset[m->face_neighbour[f] + 2]++;
  }
  for (int64_t c = 0; c < m->num_cells; c++) out->offset[c + 2] += out->offset[c + 1];
  for (int64_t f = 0; f < m->num_faces; f++) { /* offset[c + 1] runs ahead to where the next face of c goes */
    out->face[out->offset[m->face_owner[f] + 1]++] = f;
    if (m->face_neighbour[f] >= 0) out->face[out->offset[m->face_neighbour[f] + 1]++] = f;
  }
  return true;
}

int64_t rslice_cell_head(const rslice_content *content) { return 3 + content->num_fields; }

/* What is needed to write cells down. */
typedef struct writer {
  const rslice_content *content;
  cell_faces            of;
  int64_t              *behind; /* [faces] */
  bool                  with_loops;
} writer;

static void put_face(rows *r, const writer *w, int64_t f, int64_t c)
{
  const remap_supermesh_view *m     = w->content->mesh;
  const bool                  owner = m->face_owner[f] == c;
  const int64_t               other = owner ? w->behind[f] : m->cell_global[m->face_owner[f]];

  if (w->with_loops) {
    put(r, m->face_global[f]);
    put(r, m->face_offset[f + 1] - m->face_offset[f]);
    put_loop(r, m, f, !owner);
  } else {
    put(r, other >= 0 && other < m->cell_global[c] ? -(m->face_global[f] + 1) : m->face_global[f] + 1);
  }
}

static void put_cell(rows *r, const writer *w, int64_t c)
{
  const remap_supermesh_view *m = w->content->mesh;

  for (int side = 0; side < 2; side++) put(r, m->cell_ancestor[side][c] + 1);
  put_bits(r, m->cell_volume[c]);
  for (int k = 0; k < w->content->num_fields; k++) put_bits(r, w->content->field[k].values[c]);
  if (w->with_loops) put(r, w->of.offset[c + 1] - w->of.offset[c]);
  for (int64_t i = w->of.offset[c]; i < w->of.offset[c + 1]; i++) put_face(r, w, w->of.face[i], c);
  close_row(r, m->cell_global[c]);
}

rslice_status rslice_cells(MPI_Comm comm, const rslice_content *content, int with_loops, rslice_rows *out)
{
  const remap_supermesh_view *m    = content->mesh;
  writer                      w    = {.content = content, .behind = cells_behind(m), .with_loops = with_loops != 0};
  rows                        r    = {.num = 0};
  const int64_t               most = m->num_faces ? m->face_offset[m->num_faces] : 0;
  rslice_status               status;

  status = w.behind && faces_of_cells(m, &w.of) &&
                   rows_begin(&r, m->num_cells, m->num_cells * (rslice_cell_head(content) + 1) + 2 * (2 * m->num_faces + most))
               ? RSLICE_OK
               : RSLICE_MEMORY;
  for (int64_t c = 0; status == RSLICE_OK && c < m->num_cells; c++) put_cell(&r, &w, c);
  status = rslice_ship(comm, status, m->global_cells, r.num, r.global, r.offset, r.word, out);
  free(w.of.offset);
  free(w.of.face);
  free(w.behind);
  rows_end(&r);
  return status;
}
