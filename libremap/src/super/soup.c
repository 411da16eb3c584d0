/* soup -- what this rank has made, before it is numbered: an array of vertices, of faces and of cells, to which things are
 * added. O(n). */
#include "super/super_private.h"

#include <stdlib.h>
#include <string.h>

void rm_soup_free(rm_soup *soup)
{
  free(soup->corner);
  free(soup->vertex);
  free(soup->face);
  free(soup->loop);
  free(soup->cell);
}

void rm_soup_drop_vertices(rm_soup *soup)
{
  free(soup->corner);
  free(soup->vertex);
  soup->corner       = NULL;
  soup->vertex       = NULL;
  soup->num_corners  = soup->num_vertices = 0;
  soup->corner_room  = soup->vertex_room = 0;
}

remap_status rm_soup_reserve(rm_soup *soup, int64_t vertices, int64_t faces, int64_t loop, int64_t cells)
{
  RM_TRY(rm_grow(&soup->vertex, &soup->vertex_room, soup->num_vertices + vertices, sizeof *soup->vertex));
  RM_TRY(rm_grow(&soup->face, &soup->face_room, soup->num_faces + faces + 1, sizeof *soup->face));
  RM_TRY(rm_grow(&soup->loop, &soup->loop_room, soup->num_loop + loop, sizeof *soup->loop));
  return rm_grow(&soup->cell, &soup->cell_room, soup->num_cells + cells, sizeof *soup->cell);
}

static remap_status add_corner(rm_soup *soup, const double xyz[3], rm_lid *out)
{
  if (soup->num_corners == INT32_MAX) return REMAP_TOO_LARGE;
  RM_TRY(rm_grow(&soup->corner, &soup->corner_room, soup->num_corners + 1, sizeof *soup->corner));
  memcpy(soup->corner[soup->num_corners], xyz, sizeof *soup->corner);
  *out = (rm_lid)soup->num_corners++;
  return REMAP_OK;
}

static remap_status add_vertex(rm_soup *soup, const rm_soup_vertex *vertex)
{
  if (soup->num_vertices == INT32_MAX) return REMAP_TOO_LARGE;
  RM_TRY(rm_grow(&soup->vertex, &soup->vertex_room, soup->num_vertices + 1, sizeof *soup->vertex));
  soup->vertex[soup->num_vertices++] = *vertex;
  return REMAP_OK;
}

remap_status rm_soup_add_corner(rm_soup *soup, const double xyz[3], rm_lid *vertex)
{
  rm_soup_vertex v = {{xyz[0], xyz[1], xyz[2]}, {-1, -1, -1, -1, -1}, 0};

  RM_TRY(add_corner(soup, xyz, &v.corner[0]));
  *vertex = (rm_lid)soup->num_vertices;
  return add_vertex(soup, &v);
}

remap_status rm_soup_add_to_loop(rm_soup *soup, rm_lid vertex)
{
  RM_TRY(rm_grow(&soup->loop, &soup->loop_room, soup->num_loop + 1, sizeof *soup->loop));
  soup->loop[soup->num_loop++] = vertex;
  return REMAP_OK;
}

remap_status rm_soup_end_face(rm_soup *soup, rm_soup_face face)
{
  if (soup->num_faces == INT32_MAX - 1) return REMAP_TOO_LARGE;
  RM_TRY(rm_grow(&soup->face, &soup->face_room, soup->num_faces + 2, sizeof *soup->face));
  face.first                           = soup->num_faces ? soup->face[soup->num_faces].first : 0;
  soup->face[soup->num_faces++]        = face;
  soup->face[soup->num_faces].first    = soup->num_loop;
  return REMAP_OK;
}

remap_status rm_soup_add_cell(rm_soup *soup, rm_soup_cell cell)
{
  if (soup->num_cells == INT32_MAX) return REMAP_TOO_LARGE;
  RM_TRY(rm_grow(&soup->cell, &soup->cell_room, soup->num_cells + 1, sizeof *soup->cell));
  soup->cell[soup->num_cells++] = cell;
  return REMAP_OK;
}

/* ---- what room cells made ---------------------------------------------------------------------------------------- */

/* The corner that vertex v of mesh `side` is; made when first met. */
static remap_status corner_of(rm_soup *soup, const rm_trimesh *const mesh[2], rm_lid *const corner_of_vertex[2], int side,
                              rm_lid v, rm_lid *out)
{
  rm_lid *c = &corner_of_vertex[side][v];

  if (*c < 0) RM_TRY(add_corner(soup, mesh[side]->vertex[v], c));
  *out = *c;
  return REMAP_OK;
}

/* Corners of what the vertex is made of; features of two meshes in an order that does not depend on which mesh is the first. */
static remap_status add_spot(rm_soup *soup, const rm_trimesh *const mesh[2], rm_lid *const corner_of_vertex[2],
                             const rm_spot *spot, const double xyz[3])
{
  rm_soup_vertex v = {{xyz[0], xyz[1], xyz[2]}, {-1, -1, -1, -1, -1}, 0};
  int            n = 0, first = spot->at[0].kind == RM_ON_EDGE ? 0 : 1;

  for (int side = 1; side >= 0; side--)
    if (spot->at[side].kind == RM_ON_VERTEX) first = side;
  for (int k = 0; k < 2; k++) {
    const int         side = k ? 1 - first : first;
    const rm_feature  f    = spot->at[side];
    const rm_trimesh *m    = mesh[side];
    const rm_lid      id   = f.id;
    const rm_lid     *list = f.kind == RM_ON_VERTEX ? &id : f.kind == RM_ON_EDGE ? m->edge[f.id] : m->triangle[f.id];
    const int         num  = f.kind == RM_ON_VERTEX ? 1 : f.kind == RM_ON_EDGE ? 2 : 3;

    for (int h = 0; h < num; h++) RM_TRY(corner_of(soup, mesh, corner_of_vertex, side, list[h], &v.corner[n++]));
    if (f.kind == RM_ON_VERTEX) break;
    if (k == 0) v.kind = 1 + side;
    else if (f.kind == RM_ON_EDGE) v.kind = 3;
  }
  return add_vertex(soup, &v);
}

static remap_status add_vertices(rm_soup *soup, rm_arena *passing, const rm_trimesh *const mesh[2], const rm_cells *cells)
{
  rm_lid *corner_of_vertex[2];

  for (int side = 0; side < 2; side++) {
    RM_NEW(corner_of_vertex[side], passing, mesh[side]->num_vertices);
    for (rm_lid v = 0; v < mesh[side]->num_vertices; v++) corner_of_vertex[side][v] = -1;
  }
  for (rm_lid v = 0; v < cells->num_vertices; v++)
    RM_TRY(add_spot(soup, mesh, corner_of_vertex, &cells->vertex_spot[v], cells->vertex[v]));
  soup->num_made = soup->num_vertices;
  return REMAP_OK;
}

static remap_status add_cell(rm_soup *soup, const rm_part *part, const rm_cells *cells, rm_lid c)
{
  rm_soup_cell cell = {{-1, -1}, {-1, -1}, {-1, -1}, cells->cell_volume[c]};

  for (int side = 0; side < 2; side++) {
    const rm_lid a = cells->cell_ancestor[c][side];
    if (a < 0) continue;
    cell.ancestor[side] = part->piece[side].cell_global[a];
    cell.home[side]     = part->piece[side].cell_home[a];
    cell.rank[side]     = part->piece[side].cell_home_rank[a];
  }
  return rm_soup_add_cell(soup, cell);
}

/* The caller's face of which triangle t is part: of two, that of the lower rank and number. */
static void origin_of(const rm_part *part, const rm_trimesh *const mesh[2], int side, rm_lid t, rm_soup_face *out)
{
  const rm_piece *p = &part->piece[side];

  for (int h = 0; h < 2 && t >= 0; h++) {
    const rm_lid f = mesh[side]->triangle_face[t][h];
    if (f < 0) continue;
    const int    rank = p->cell_home_rank[p->face_cell[f][0]];
    const rm_lid home = p->face_home[f];
    if (out->from[side] >= 0 && (out->from_rank[side] < rank || (out->from_rank[side] == rank && out->from[side] <= home)))
      continue;
    out->from[side]      = home;
    out->from_rank[side] = rank;
  }
}

static remap_status add_face(rm_soup *soup, const rm_part *part, const rm_trimesh *const mesh[2], const rm_cells *cells,
                             rm_lid f, rm_lid first_vertex, rm_lid first_cell)
{
  const rm_lid *cell = cells->face_cell[f];
  rm_soup_face  face = {0, {first_cell + cell[0], cell[1] < 0 ? -1 : first_cell + cell[1]}, {-1, -1}, {-1, -1}};

  for (int side = 0; side < 2; side++) origin_of(part, mesh, side, rm_cells_triangle(cells, f, side), &face);
  for (uint32_t k = cells->face_offset[f]; k < cells->face_offset[f + 1]; k++)
    RM_TRY(rm_soup_add_to_loop(soup, first_vertex + cells->face_vertex[k]));
  return rm_soup_end_face(soup, face);
}

remap_status rm_soup_add_cells(rm_soup *soup, const rm_part *part, const rm_trimesh *const mesh[2], const rm_cells *cells)
{
  const rm_lid first_vertex = (rm_lid)soup->num_vertices, first_cell = (rm_lid)soup->num_cells;
  rm_arena    *passing = rm_arena_new();
  remap_status status  = passing ? add_vertices(soup, passing, mesh, cells) : REMAP_NO_MEMORY;

  rm_arena_drop(passing);
  RM_TRY(status);
  for (rm_lid c = 0; c < cells->num_cells; c++) RM_TRY(add_cell(soup, part, cells, c));
  for (rm_lid f = 0; f < cells->num_faces; f++) RM_TRY(add_face(soup, part, mesh, cells, f, first_vertex, first_cell));
  return REMAP_OK;
}
