/* soup -- what this rank has made, before it is numbered: an array of vertices, of faces and of cells, to which things are
 * added. What room cells made stays where it is, as far as it can. O(n). */
#include "super/super_private.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_CORNERS = (1 << 30) - 2 };

void rm_soup_free(rm_soup *soup)
{
  free(soup->corner);
  free(soup->xyz);
  free(soup->made_of);
  free(soup->first);
  free(soup->face_cell);
  free(soup->loop);
  free(soup->volume);
  for (int side = 0; side < 2; side++) {
    free(soup->from[side]);
    free(soup->from_rank[side]);
    free(soup->ancestor[side]);
    free(soup->home[side]);
    free(soup->rank[side]);
  }
}

/* ---- room -------------------------------------------------------------------------------------------------------- */

/* rm_grow or rm_reserve. */
typedef remap_status resize(void *data, int64_t *capacity, int64_t need, size_t size);

/* Room in one of several arrays of one length: *out is how much it has. */
static remap_status room_in(resize *by, void *data, int64_t room, int64_t need, size_t size, int64_t *out)
{
  *out = room;
  return by(data, out, need, size);
}

static remap_status vertex_room(resize *by, rm_soup *s, int64_t need)
{
  int64_t room = s->vertex_room;

  if (need <= room) return REMAP_OK;
  RM_TRY(room_in(by, &s->xyz, s->vertex_room, need, sizeof *s->xyz, &room));
  RM_TRY(room_in(by, &s->made_of, s->vertex_room, need, sizeof *s->made_of, &room));
  s->vertex_room = room;
  return REMAP_OK;
}

/* need counts the end of the last one, too. */
static remap_status face_room(resize *by, rm_soup *s, int64_t need)
{
  int64_t room = s->face_room;

  if (need <= room) return REMAP_OK;
  RM_TRY(room_in(by, &s->first, s->face_room, need, sizeof *s->first, &room));
  RM_TRY(room_in(by, &s->face_cell, s->face_room, need, sizeof *s->face_cell, &room));
  for (int side = 0; side < 2; side++) {
    RM_TRY(room_in(by, &s->from[side], s->face_room, need, sizeof *s->from[side], &room));
    if (s->has_ranks) RM_TRY(room_in(by, &s->from_rank[side], s->face_room, need, sizeof *s->from_rank[side], &room));
  }
  s->face_room = room;
  return REMAP_OK;
}

static remap_status cell_room(resize *by, rm_soup *s, int64_t need)
{
  int64_t room = s->cell_room;

  if (need <= room) return REMAP_OK;
  RM_TRY(room_in(by, &s->volume, s->cell_room, need, sizeof *s->volume, &room));
  for (int side = 0; side < 2; side++) {
    RM_TRY(room_in(by, &s->ancestor[side], s->cell_room, need, sizeof *s->ancestor[side], &room));
    RM_TRY(room_in(by, &s->home[side], s->cell_room, need, sizeof *s->home[side], &room));
    if (s->has_ranks) RM_TRY(room_in(by, &s->rank[side], s->cell_room, need, sizeof *s->rank[side], &room));
  }
  s->cell_room = room;
  return REMAP_OK;
}

remap_status rm_soup_reserve(rm_soup *soup, int64_t vertices, int64_t faces, int64_t loop, int64_t cells)
{
  RM_TRY(vertex_room(rm_reserve, soup, soup->num_vertices + vertices));
  RM_TRY(face_room(rm_reserve, soup, soup->num_faces + faces + 1));
  RM_TRY(rm_reserve(&soup->loop, &soup->loop_room, soup->num_loop + loop, sizeof *soup->loop));
  return cell_room(rm_reserve, soup, soup->num_cells + cells);
}

/* ---- one by one -------------------------------------------------------------------------------------------------- */

static remap_status add_corner(rm_soup *soup, const double xyz[3], uint32_t *out)
{
  if (soup->num_corners == MAX_CORNERS) return REMAP_TOO_LARGE;
  RM_TRY(rm_grow(&soup->corner, &soup->corner_room, soup->num_corners + 1, sizeof *soup->corner));
  memcpy(soup->corner[soup->num_corners], xyz, sizeof *soup->corner);
  *out = (uint32_t)soup->num_corners++;
  return REMAP_OK;
}

remap_status rm_soup_add_corner(rm_soup *soup, const double xyz[3], rm_lid *vertex)
{
  rm_made_of made_of = {0};

  if (soup->num_vertices == INT32_MAX) return REMAP_TOO_LARGE;
  RM_TRY(add_corner(soup, xyz, &made_of.first));
  RM_TRY(vertex_room(rm_grow, soup, soup->num_vertices + 1));
  memcpy(soup->xyz[soup->num_vertices], xyz, sizeof *soup->xyz);
  soup->made_of[soup->num_vertices] = made_of;
  *vertex                           = (rm_lid)soup->num_vertices++;
  return REMAP_OK;
}

remap_status rm_soup_add_to_loop(rm_soup *soup, rm_lid vertex)
{
  if (soup->num_loop == UINT32_MAX) return REMAP_TOO_LARGE;
  RM_TRY(rm_grow(&soup->loop, &soup->loop_room, soup->num_loop + 1, sizeof *soup->loop));
  soup->loop[soup->num_loop++] = vertex;
  return REMAP_OK;
}

static void set_origin(rm_soup *soup, int64_t f, const rm_soup_face *face)
{
  for (int side = 0; side < 2; side++) {
    soup->from[side][f] = face->from[side];
    if (soup->has_ranks) soup->from_rank[side][f] = face->from_rank[side];
  }
}

remap_status rm_soup_end_face(rm_soup *soup, const rm_soup_face *face)
{
  const int64_t f = soup->num_faces;

  if (f == INT32_MAX - 1) return REMAP_TOO_LARGE;
  RM_TRY(face_room(rm_grow, soup, f + 2));
  if (f == 0) soup->first[0] = 0;
  memcpy(soup->face_cell[f], face->cell, sizeof *soup->face_cell);
  set_origin(soup, f, face);
  soup->first[++soup->num_faces] = (uint32_t)soup->num_loop;
  return REMAP_OK;
}

remap_status rm_soup_add_cell(rm_soup *soup, const rm_soup_cell *cell)
{
  const int64_t c = soup->num_cells;

  if (c == INT32_MAX) return REMAP_TOO_LARGE;
  RM_TRY(cell_room(rm_grow, soup, c + 1));
  soup->volume[c] = cell->volume;
  for (int side = 0; side < 2; side++) {
    soup->ancestor[side][c] = cell->ancestor[side];
    soup->home[side][c]     = cell->home[side];
    if (soup->has_ranks) soup->rank[side][c] = cell->rank[side];
  }
  soup->num_cells++;
  return REMAP_OK;
}

/* ---- what room cells made ---------------------------------------------------------------------------------------- */

/* Vertices of the meshes by side, and the corner + 1 that each is; made when first met. */
typedef struct corners {
  const rm_trimesh *const *mesh;
  uint32_t                *of[2];
} corners;

static remap_status corner_of(rm_soup *soup, const corners *c, int side, rm_lid v, uint32_t *out)
{
  uint32_t *corner = &c->of[side][v];

  if (!*corner) {
    RM_TRY(add_corner(soup, c->mesh[side]->vertex[v], corner));
    ++*corner;
  }
  *out = *corner;
  return REMAP_OK;
}

/* Corners of what the vertex is made of; features of two meshes in an order that does not depend on which mesh is the first. */
static remap_status add_spot(rm_soup *soup, const corners *c, const rm_spot *spot)
{
  uint32_t corner[RM_SOUP_CORNERS] = {0}, kind = 0;
  int      n = 0, first = spot->at[0].kind == RM_ON_EDGE ? 0 : 1;

  for (int side = 1; side >= 0; side--)
    if (spot->at[side].kind == RM_ON_VERTEX) first = side;
  for (int k = 0; k < 2; k++) {
    const int         side = k ? 1 - first : first;
    const rm_feature  f    = spot->at[side];
    const rm_trimesh *m    = c->mesh[side];
    const rm_lid      id   = f.id;
    const rm_lid     *list = f.kind == RM_ON_VERTEX ? &id : f.kind == RM_ON_EDGE ? m->edge[f.id] : m->triangle[f.id];
    const int         num  = f.kind == RM_ON_VERTEX ? 1 : f.kind == RM_ON_EDGE ? 2 : 3;

    for (int h = 0; h < num; h++) RM_TRY(corner_of(soup, c, side, list[h], &corner[n++]));
    if (f.kind == RM_ON_VERTEX) break;
    if (k == 0) kind = 1 + (uint32_t)side;
    else if (f.kind == RM_ON_EDGE) kind = 3;
  }
  soup->made_of[soup->num_vertices++] =
      (rm_made_of){corner[0] - 1, kind & 3, corner[1] & 0x3fffffff, {corner[2], corner[3], corner[4]}};
  return REMAP_OK;
}

static remap_status add_vertices(rm_soup *soup, rm_arena *passing, const rm_trimesh *const mesh[2], const rm_cells *cells)
{
  corners c = {mesh, {NULL, NULL}};
  int64_t most = 0, room = 0;

  for (int side = 0; side < 2; side++) {
    RM_NEW0(c.of[side], passing, mesh[side]->num_vertices);
    most += mesh[side]->num_vertices;
  }
  RM_TRY(rm_reserve(&soup->corner, &soup->corner_room, most, sizeof *soup->corner));
  RM_TRY(rm_reserve(&soup->made_of, &room, cells->num_vertices, sizeof *soup->made_of));
  for (rm_lid v = 0; v < cells->num_vertices; v++) RM_TRY(add_spot(soup, &c, &cells->vertex_spot[v]));
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
  return rm_soup_add_cell(soup, &cell);
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

static remap_status add_origins(rm_soup *soup, const rm_part *part, const rm_trimesh *const mesh[2], const rm_cells *cells)
{
  for (int side = 0; side < 2; side++) {
    int64_t room = 0, rank_room = 0;

    RM_TRY(rm_reserve(&soup->from[side], &room, (int64_t)cells->num_faces + 1, sizeof *soup->from[side]));
    if (soup->has_ranks)
      RM_TRY(rm_reserve(&soup->from_rank[side], &rank_room, (int64_t)cells->num_faces + 1, sizeof *soup->from_rank[side]));
  }
  for (rm_lid f = 0; f < cells->num_faces; f++) {
    rm_soup_face face = {{-1, -1}, {-1, -1}, {-1, -1}};

    for (int side = 0; side < 2; side++) origin_of(part, mesh, side, rm_cells_triangle(cells, f, side), &face);
    set_origin(soup, f, &face);
  }
  return REMAP_OK;
}

remap_status rm_soup_add_cells(rm_soup *soup, rm_arena *arena, const rm_part *part, const rm_trimesh *const mesh[2],
                               const rm_cells *cells)
{
  rm_arena    *passing = rm_arena_new();
  remap_status status  = passing ? add_vertices(soup, passing, mesh, cells) : REMAP_NO_MEMORY;

  RM_ASSERT(soup->num_faces == 0 && soup->num_cells == 0);
  rm_arena_drop(passing);
  free(rm_arena_release(arena, cells->vertex_spot));
  RM_TRY(status);
  RM_TRY(cell_room(rm_reserve, soup, cells->num_cells));
  for (rm_lid c = 0; c < cells->num_cells; c++) RM_TRY(add_cell(soup, part, cells, c));
  RM_TRY(add_origins(soup, part, mesh, cells));
  soup->xyz         = rm_arena_release(arena, cells->vertex);
  soup->face_cell   = rm_arena_release(arena, cells->face_cell);
  soup->first       = rm_arena_release(arena, cells->face_offset);
  soup->loop        = rm_arena_release(arena, cells->face_vertex);
  soup->num_faces   = cells->num_faces;
  soup->num_loop    = soup->first[cells->num_faces];
  soup->vertex_room = soup->num_vertices;
  soup->face_room   = soup->num_faces;
  soup->loop_room   = soup->num_loop;
  return REMAP_OK;
}
