/* cells -- the supermesh as a product: limit, polygons, cells, then the faces of those that are asked for. See cells.h.
 * Cost: some 3.5 us (diagonal) or 6.5 us (centre) per cell. Memory is kept below 600 bytes per cell, of which 420 (centre) are
 * the result: what passes is given back stage by stage, and vertices and loops become those of the result where they are. */
#include "cells/cells_private.h"

#include <stdlib.h>
#include <string.h>

typedef struct work {
  rm_arena              *arena;
  rm_arena              *limit_arena; /* of l, whose spot and xyz are the result's          */
  rm_arena              *glued_arena; /* of glued and new_cell                              */
  rm_arena              *faces_arena; /* of faces and new_vertex                            */
  const rm_part         *part;
  const rm_cells_choice *choice;
  const rm_limit        *l;
  rm_polygons            p;
  rm_glued               glued;
  rm_faces               faces;
  rm_lid                *new_cell;   /* [glued.num_cells] RM_OUTSIDE if it is not kept                         */
  rm_lid                *new_vertex; /* [num_spots] -1 if no face has it; NULL where all are used               */
  rm_cells              *out;
} work;

/* ---- stages ------------------------------------------------------------------------------------------------------ */

static remap_status make_polygons(work *w, const rm_overlay *overlay, rm_cells_passing *passing, rm_reason *reason)
{
  const double  start    = rm_seconds();
  rm_arena     *lines[2] = {rm_arena_new(), rm_arena_new()};
  rm_limit_home home     = {w->arena, {lines[0], lines[1]}, w->limit_arena, passing};
  remap_status  status   = lines[0] && lines[1] ? REMAP_OK : REMAP_NO_MEMORY;

  if (status == REMAP_OK) status = rm_limit_build(&home, w->part, overlay, &w->l, reason);
  if (status == REMAP_OK) status = rm_polygons_build(w->part, w->l, lines, &w->p, reason);
  for (int side = 0; side < 2; side++) rm_arena_drop(lines[side]);
  rm_arena_drop(passing->around);
  passing->around          = NULL;
  w->out->num_polygons     = w->p.num;
  w->out->seconds_polygons = rm_seconds() - start;
  return status;
}

static remap_status make_cells(work *w, rm_reason *reason)
{
  const double       start  = rm_seconds();
  const remap_status status = rm_glue(w->glued_arena, w->part, w->l, &w->p, w->choice->aggregate, &w->glued, reason);

  w->out->seconds_glue = rm_seconds() - start;
  return status;
}

/* ---- selection --------------------------------------------------------------------------------------------------- */

static bool is_kept(rm_label label, const rm_cells_choice *choice)
{
  const bool in[2] = {label.cell[0] != RM_OUTSIDE, label.cell[1] != RM_OUTSIDE};
  const int  side  = in[0] && in[1] ? choice->owner : in[0] ? 0 : 1;

  if (!(choice->keep & (in[0] && in[1] ? REMAP_IN_BOTH : in[0] ? REMAP_IN_SOURCE : REMAP_IN_TARGET))) return false;
  return !choice->core[side] || (choice->core[side][label.cell[side]] & 1);
}

/* Number the cells that are kept. */
static remap_status select_cells(work *w)
{
  const rm_glued *g = &w->glued;
  rm_lid (*ancestor)[2];
  double *volume;

  RM_NEW(w->new_cell, w->glued_arena, g->num_cells);
  for (rm_lid c = 0; c < g->num_cells; c++) w->new_cell[c] = is_kept(g->label[c], w->choice) ? w->out->num_cells++ : RM_OUTSIDE;
  RM_NEW(ancestor, w->arena, w->out->num_cells);
  RM_NEW(volume, w->arena, w->out->num_cells);
  for (rm_lid c = 0; c < g->num_cells; c++) {
    if (w->new_cell[c] < 0) continue;
    memcpy(ancestor[w->new_cell[c]], g->label[c].cell, sizeof *ancestor);
    volume[w->new_cell[c]] = g->volume[c];
  }
  w->out->cell_ancestor = (const rm_lid (*)[2])ancestor;
  w->out->cell_volume   = volume;
  return REMAP_OK;
}

/* The cell of the result on side h of polygon k, RM_OUTSIDE. */
static rm_lid cell_beside(const work *w, int64_t k, int h)
{
  return w->glued.cell[2 * k + h] < 0 ? RM_OUTSIDE : w->new_cell[w->glued.cell[2 * k + h]];
}

/* What becomes of every polygon. */
static remap_status choose_faces(work *w)
{
  uint8_t *kind;

  RM_NEW(kind, w->faces_arena, w->p.num);
  for (int64_t k = 0; k < w->p.num; k++)
    kind[k] = cell_beside(w, k, 0) >= 0 || cell_beside(w, k, 1) >= 0 ? RM_FACE_ITSELF : RM_FACE_NONE;
  w->faces.kind = kind;
  return rm_faces_build(w->l, &w->p, &w->glued, w->choice->aggregate, w->choice->split_concave, &w->faces);
}

/* ---- faces ------------------------------------------------------------------------------------------------------- */

/* The cell behind a polygon that bounds one of the result, if it is one that is not kept, else RM_OUTSIDE. */
static rm_lid cell_beyond(const work *w, int64_t k)
{
  for (int h = 0; h < 2; h++)
    if (w->glued.cell[2 * k + h] >= 0 && cell_beside(w, k, h) < 0) return w->glued.cell[2 * k + h];
  return RM_OUTSIDE;
}

/* Faces to be, their vertices, and which spots they have. */
typedef struct tally {
  int64_t  faces, corners;
  uint8_t *used; /* [num_spots] bits */
} tally;

static void count_face(work *w, tally *t, int64_t k, const rm_lid *loop, rm_lid n)
{
  t->faces++;
  t->corners += n;
  w->out->num_beyond += cell_beyond(w, k) >= 0;
  w->out->num_shared += w->p.other[k] < RM_OUTSIDE;
  for (rm_lid i = 0; i < n; i++) t->used[loop[i] >> 3] |= (uint8_t)(1 << (loop[i] & 7));
}

static inline rm_lid made_begin(const rm_faces *f, int64_t m) { return m ? f->made.end[m - 1] : 0; }

/* Count the faces, and number the vertices that are used. */
static remap_status count_faces(work *w, tally *t)
{
  const rm_faces *f = &w->faces;
  const rm_lid    n = w->l->num_spots;

  *t = (tally){0};
  RM_NEW0(t->used, w->faces_arena, (int64_t)n / 8 + 1);
  for (int64_t k = 0; k < w->p.num; k++)
    if (f->kind[k] == RM_FACE_ITSELF) count_face(w, t, k, rm_polygon_loop(&w->p, k), rm_polygon_size(&w->p, k));
  for (int64_t m = 0; m < f->made.num; m++)
    count_face(w, t, f->made_of[m], f->made.vertex + made_begin(f, m), f->made.end[m] - made_begin(f, m));
  if (t->faces >= INT32_MAX || t->corners > UINT32_MAX) return REMAP_TOO_LARGE;
  for (rm_lid s = 0; s < n; s++) w->out->num_vertices += t->used[s >> 3] >> (s & 7) & 1;
  if (w->out->num_vertices == n) return REMAP_OK;
  RM_NEW(w->new_vertex, w->faces_arena, n);
  for (rm_lid s = 0, num = 0; s < n; s++) w->new_vertex[s] = t->used[s >> 3] >> (s & 7) & 1 ? num++ : -1;
  return REMAP_OK;
}

/* The spots in use become the vertices, where they are. The limit is used up. */
static void make_vertices(work *w)
{
  rm_spot *spot    = w->l->spot;
  double (*xyz)[3] = w->l->xyz;

  for (rm_lid s = 0; s < w->l->num_spots && w->new_vertex; s++) {
    if (w->new_vertex[s] < 0) continue;
    spot[w->new_vertex[s]] = spot[s];
    memmove(xyz[w->new_vertex[s]], xyz[s], sizeof *xyz);
  }
  w->out->vertex      = (const double (*)[3])xyz;
  w->out->vertex_spot = spot;
  rm_arena_drop(w->limit_arena);
  w->limit_arena = NULL;
  w->l           = NULL;
}

typedef struct result {
  rm_lid (*cell)[2], *own, (*beyond)[2], (*shared)[2], num, num_beyond, num_shared;
} result;

/* Write the next face: of polygon k, with a loop that may stand in the place where it goes or behind that. */
static void write_face(work *w, result *r, int64_t k, const rm_lid *loop, rm_lid n)
{
  const rm_lid   left = cell_beside(w, k, 0), right = cell_beside(w, k, 1), behind = cell_beyond(w, k), f = r->num++;
  const bool     turned = (uint32_t)left > (uint32_t)right;
  const uint32_t first  = w->p.first[f];
  rm_lid        *to     = w->p.vertex + first;

  r->cell[f][0] = turned ? right : left;
  r->cell[f][1] = behind >= 0 ? -2 - r->num_beyond : turned ? left : right;
  if (behind >= 0) memcpy(r->beyond[r->num_beyond++], w->glued.label[behind].cell, sizeof *r->beyond);
  if (w->p.other[k] < RM_OUTSIDE) {
    for (int side = 0; side < 2; side++) r->shared[r->num_shared][side] = rm_polygon_triangle(&w->p, k, side);
    r->own[f] = -1 - r->num_shared++;
  } else {
    r->own[f] = w->p.own[k];
  }
  for (rm_lid i = 0; i < n; i++) to[i] = w->new_vertex ? w->new_vertex[loop[i]] : loop[i];
  for (rm_lid i = 0, j = n - 1; i < j && turned; i++, j--) {
    const rm_lid x = to[i];
    to[i] = to[j], to[j] = x;
  }
  w->p.first[f + 1] = first + (uint32_t)n;
}

/* The faces in the arrays of the polygons: those that are polygons as they are come first, and so move towards the front; then
 * those that have been made. */
static remap_status write_faces(work *w, const tally *t)
{
  const rm_faces *f = &w->faces;
  rm_polygons    *p = &w->p;
  result          r = {0};

  RM_TRY(rm_grow(&p->first, &p->first_room, t->faces + 1, sizeof *p->first));
  RM_TRY(rm_grow(&p->vertex, &p->vertex_room, t->corners, sizeof *p->vertex));
  p->first[0] = 0;
  r.cell = rm_arena_alloc_apart(w->arena, t->faces, sizeof *r.cell);
  if (!r.cell) return REMAP_NO_MEMORY;
  RM_NEW(r.own, w->arena, t->faces);
  RM_NEW(r.beyond, w->arena, w->out->num_beyond);
  RM_NEW(r.shared, w->arena, w->out->num_shared);
  for (int64_t k = 0; k < p->num; k++)
    if (f->kind[k] == RM_FACE_ITSELF) write_face(w, &r, k, rm_polygon_loop(p, k), rm_polygon_size(p, k));
  for (int64_t m = 0; m < f->made.num; m++)
    write_face(w, &r, f->made_of[m], f->made.vertex + made_begin(f, m), f->made.end[m] - made_begin(f, m));
  w->out->num_faces = r.num;
  w->out->face_cell = (const rm_lid (*)[2])r.cell;
  w->out->face_own  = r.own;
  w->out->beyond    = (const rm_lid (*)[2])r.beyond;
  w->out->shared    = (const rm_lid (*)[2])r.shared;
  return REMAP_OK;
}

/* The result takes the arrays of the polygons over. */
static remap_status take_loops(work *w, const tally *t)
{
  rm_polygons *p = &w->p;

  p->num          = t->faces;
  p->num_vertices = t->corners;
  rm_polygons_trim(p);
  RM_TRY(rm_arena_adopt(w->arena, p->first, sizeof *p->first * ((size_t)t->faces + 1)));
  w->out->face_offset = p->first;
  p->first            = NULL;
  RM_TRY(rm_arena_adopt(w->arena, p->vertex, sizeof *p->vertex * (size_t)t->corners));
  w->out->face_vertex = p->vertex;
  p->vertex           = NULL;
  return REMAP_OK;
}

static remap_status make_faces(work *w)
{
  tally t;

  RM_TRY(choose_faces(w));
  RM_TRY(count_faces(w, &t));
  make_vertices(w);
  RM_TRY(write_faces(w, &t));
  return take_loops(w, &t);
}

/* ------------------------------------------------------------------------------------------------------------------ */

static void drop(work *w)
{
  rm_polygons_free(&w->p);
  free(w->glued.joint);
  free(w->faces.made_of);
  free(w->faces.made.vertex);
  free(w->faces.made.end);
  rm_arena_drop(w->limit_arena);
  rm_arena_drop(w->glued_arena);
  rm_arena_drop(w->faces_arena);
}

remap_status rm_cells_build(rm_arena *arena, const rm_part *part, const rm_overlay *overlay, rm_cells_passing *passing,
                            const rm_cells_choice *choice, const rm_cells **out, rm_reason *reason)
{
  work         w      = {.arena       = arena,
                         .limit_arena = rm_arena_new(),
                         .glued_arena = rm_arena_new(),
                         .faces_arena = rm_arena_new(),
                         .part        = part,
                         .choice      = choice};
  rm_cells_passing none   = {NULL, NULL, NULL};
  remap_status     status = w.limit_arena && w.glued_arena && w.faces_arena ? REMAP_OK : REMAP_NO_MEMORY;

  w.out = rm_arena_zero(arena, 1, sizeof *w.out);
  if (!w.out) status = REMAP_NO_MEMORY;
  if (!passing) passing = &none;
  if (status == REMAP_OK) status = make_polygons(&w, overlay, passing, reason);
  if (status == REMAP_OK) status = make_cells(&w, reason);
  const double start = rm_seconds();
  if (status == REMAP_OK) status = select_cells(&w);
  if (status == REMAP_OK) status = make_faces(&w);
  drop(&w);
  if (status != REMAP_OK) return status;
  w.out->seconds_faces = rm_seconds() - start;
  *out                 = w.out;
  return REMAP_OK;
}
