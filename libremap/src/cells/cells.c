/* cells -- the supermesh as a product: limit, polygons, cells, then the faces of those that are asked for. See cells.h.
 * Cost: some 4 us (diagonal) or 8 us (centre) and 0.3 kB of result per cell; what passes is given back stage by stage. */
#include "cells/cells_private.h"

#include <stdlib.h>
#include <string.h>

typedef struct work {
  rm_arena        *arena, *scratch;
  rm_arena        *limit_arena; /* of l; dropped when the vertices are out */
  const rm_part   *part;
  const rm_limit  *l;
  rm_polygons      p;
  rm_glued         glued;
  rm_faces         faces;
  const rm_cells_choice *choice;
  rm_lid          *new_cell; /* [glued.num_cells] RM_OUTSIDE if it is not kept */
  rm_lid          *loop;     /* of the present group of polygons */
  rm_parts         parts;    /* of the present face              */
  remap_status     status;   /* of each_face                     */
  rm_cells        *out;
} work;

/* ---- stages ------------------------------------------------------------------------------------------------------ */

static remap_status make_polygons(work *w, const rm_overlay *overlay, rm_arena **overlay_arena, rm_reason *reason)
{
  const double start   = rm_seconds();
  rm_arena    *passing = rm_arena_new();
  rm_overlay  *o       = rm_arena_alloc(w->limit_arena, 1, sizeof *o);
  remap_status status  = passing && o ? REMAP_OK : REMAP_NO_MEMORY;

  if (status == REMAP_OK) {
    *o     = *overlay;
    status = rm_limit_build(w->limit_arena, passing, w->part, o, &w->l, reason);
  }
  if (status == REMAP_OK) status = rm_polygons_build(w->part, w->l, &w->p, reason);
  rm_arena_drop(passing);
  if (status == REMAP_OK && overlay_arena) {
    *o = (rm_overlay){.mesh = {o->mesh[0], o->mesh[1]}}; /* all that is asked for from here on */
    rm_arena_drop(*overlay_arena);
    *overlay_arena = NULL;
  }
  w->out->num_polygons     = w->p.num;
  w->out->seconds_polygons = rm_seconds() - start;
  return status;
}

static remap_status make_cells(work *w, rm_reason *reason)
{
  const double start   = rm_seconds();
  rm_arena    *passing = rm_arena_new();
  rm_arcs      arcs;
  remap_status status = passing ? rm_arcs_build(passing, w->l->num_spots, &w->p, &arcs) : REMAP_NO_MEMORY;

  if (status == REMAP_OK) status = rm_glue(w->scratch, w->l, &w->p, &arcs, &w->glued);
  if (status == REMAP_BAD_MESH)
    rm_fail(status, reason, -1, -1,
            "the faces around an edge of the supermesh do not bound cells: cells of one mesh overlap or are inverted");
  w->out->seconds_glue = rm_seconds() - start;
  if (status == REMAP_OK) status = rm_faces_build(w->scratch, passing, w->l, &w->p, &arcs, &w->glued,
                                                  w->choice->aggregate, &w->faces);
  rm_arena_drop(passing);
  w->out->seconds_faces = rm_seconds() - start - w->out->seconds_glue;
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

  RM_NEW(w->new_cell, w->scratch, g->num_cells);
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

/* Cells beside polygon k in the result, the lower one first; false if neither is kept. *turned if its loop runs the wrong
 * way. */
static bool cells_beside(const work *w, int64_t k, rm_lid cell[2], bool *turned)
{
  for (int h = 0; h < 2; h++) cell[h] = w->glued.cell[2 * k + h] < 0 ? RM_OUTSIDE : w->new_cell[w->glued.cell[2 * k + h]];
  *turned = (uint32_t)cell[0] > (uint32_t)cell[1];
  if (*turned) {
    const rm_lid low = cell[1];
    cell[1] = cell[0], cell[0] = low;
  }
  return cell[0] >= 0;
}

/* ---- faces ------------------------------------------------------------------------------------------------------- */

typedef struct face {
  rm_polygon   *of;
  const rm_lid *vertex;
  rm_lid        num, cell[2];
  bool          turned;
} face;

typedef void visitor(work *w, const face *f, void *user);

/* Visit the face, or the convex parts of it if it is concave and that is wanted. Its loop runs counter-clockwise about its
 * triangle's normal. */
static void visit_face(work *w, const face *f, visitor *visit, void *user)
{
  face part = *f;

  if (!w->choice->split_concave || f->num < 4) {
    visit(w, f, user);
    return;
  }
  const rm_view view = rm_view_of(w->l, f->of->own & 1, f->of->own / 2);
  if (rm_is_convex(&view, f->vertex, f->num)) {
    visit(w, f, user);
    return;
  }
  w->status = rm_cut_convex(&view, f->num, f->vertex, &w->parts);
  for (int64_t k = 0; k < w->parts.num && w->status == REMAP_OK; k++) {
    part.vertex = w->parts.vertex + (k ? w->parts.end[k - 1] : 0);
    part.num    = w->parts.end[k] - (k ? w->parts.end[k - 1] : 0);
    visit(w, &part, user);
  }
}

static void reverse(rm_lid *loop, rm_lid n)
{
  for (rm_lid i = 0, k = n - 1; i < k; i++, k--) {
    const rm_lid x = loop[i];
    loop[i] = loop[k], loop[k] = x;
  }
}

/* Visit every face of the result. */
static remap_status each_face(work *w, visitor *visit, void *user)
{
  w->status = REMAP_OK;
  for (int64_t k = 0; k < w->faces.num && w->status == REMAP_OK; k++) {
    const rm_lid *member = w->faces.member + w->faces.offset[k], first = member[0];
    const int64_t n = w->faces.offset[k + 1] - w->faces.offset[k];
    face          f;

    if (!cells_beside(w, first, f.cell, &f.turned)) continue;
    f.num = n > 1 ? rm_face_loop(&w->faces, &w->p, &w->glued, k, w->loop) : 0;
    if (f.num) {
      if (rm_is_turned(&w->glued, first)) reverse(w->loop, f.num); /* it runs as that of a polygon which is not turned */
      f.of     = &w->p.polygon[first];
      f.vertex = w->loop;
      visit_face(w, &f, visit, user);
      continue;
    }
    for (int64_t i = 0; i < n && w->status == REMAP_OK; i++) {
      cells_beside(w, member[i], f.cell, &f.turned);
      f.of     = &w->p.polygon[member[i]];
      f.vertex = w->p.vertex + f.of->first;
      f.num    = rm_polygon_size(f.of);
      visit_face(w, &f, visit, user);
    }
  }
  return w->status;
}

/* Sizes of the result, and which spots it has. */
typedef struct tally {
  int64_t corners;
  rm_lid *used; /* [num_spots], all 0 */
} tally;

static void count_face(work *w, const face *f, void *user)
{
  tally *t = user;

  w->out->num_faces++;
  t->corners += f->num;
  for (rm_lid i = 0; i < f->num; i++) t->used[f->vertex[i]] = 1;
}

typedef struct result {
  const rm_lid *new_vertex;
  int64_t      *offset;
  rm_lid       *vertex, (*cell)[2], (*beyond)[2], (*triangle)[2], num;
} result;

/* Ancestors of the cell on the far side of a face, if that is not kept. */
static void set_beyond(const work *w, const face *f, rm_lid beyond[2])
{
  const int64_t k = f->of - w->p.polygon;

  beyond[0] = beyond[1] = RM_OUTSIDE;
  if (f->cell[1] >= 0) return;
  for (int h = 0; h < 2; h++) {
    const rm_lid c = w->glued.cell[2 * k + h];
    if (c >= 0 && w->new_cell[c] < 0) memcpy(beyond, w->glued.label[c].cell, sizeof w->glued.label[c].cell);
  }
}

static void keep_face(work *w, const face *f, void *user)
{
  result       *r  = user;
  const int64_t at = r->offset[r->num];

  for (rm_lid i = 0; i < f->num; i++) r->vertex[at + i] = r->new_vertex[f->vertex[f->turned ? f->num - 1 - i : i]];
  memcpy(r->cell[r->num], f->cell, sizeof f->cell);
  for (int side = 0; side < 2; side++) r->triangle[r->num][side] = rm_polygon_triangle(f->of, side);
  set_beyond(w, f, r->beyond[r->num]);
  r->offset[++r->num] = at + f->num;
}

static remap_status make_faces(work *w)
{
  rm_cells *out = w->out;
  rm_lid   *new_vertex, longest = 0;
  double  (*xyz)[3];
  rm_spot  *spot;
  tally     t = {0, NULL};
  result    r = {0};

  for (int64_t k = 0; k < w->faces.num; k++) {
    const rm_lid *member = w->faces.member + w->faces.offset[k];
    rm_lid        sum    = 0;
    for (int64_t i = 0; i < w->faces.offset[k + 1] - w->faces.offset[k]; i++) sum += rm_polygon_size(&w->p.polygon[member[i]]);
    longest = sum > longest ? sum : longest;
  }
  RM_NEW(w->loop, w->scratch, longest);
  RM_NEW0(new_vertex, w->scratch, w->l->num_spots);
  t.used = new_vertex;
  RM_TRY(each_face(w, count_face, &t));
  for (rm_lid s = 0; s < w->l->num_spots; s++) out->num_vertices += new_vertex[s];
  RM_NEW(xyz, w->arena, out->num_vertices);
  RM_NEW(spot, w->arena, out->num_vertices);
  for (rm_lid s = 0, n = 0; s < w->l->num_spots; s++) {
    if (!new_vertex[s]) continue;
    memcpy(xyz[n], w->l->xyz[s], sizeof *xyz);
    spot[n]       = w->l->spot[s];
    new_vertex[s] = n++;
  }
  if (!w->choice->split_concave) {
    rm_arena_drop(w->limit_arena);
    w->limit_arena = NULL;
    w->l           = NULL;
  }
  r.new_vertex = new_vertex;
  RM_NEW(r.offset, w->arena, (int64_t)out->num_faces + 1);
  RM_NEW(r.vertex, w->arena, t.corners);
  RM_NEW(r.cell, w->arena, out->num_faces);
  RM_NEW(r.beyond, w->arena, out->num_faces);
  RM_NEW(r.triangle, w->arena, out->num_faces);
  r.offset[0] = 0;
  RM_TRY(each_face(w, keep_face, &r));
  out->vertex        = (const double (*)[3])xyz;
  out->vertex_spot   = spot;
  out->face_offset   = r.offset;
  out->face_vertex   = r.vertex;
  out->face_cell     = (const rm_lid (*)[2])r.cell;
  out->face_beyond   = (const rm_lid (*)[2])r.beyond;
  out->face_triangle = (const rm_lid (*)[2])r.triangle;
  return REMAP_OK;
}

remap_status rm_cells_build(rm_arena *arena, const rm_part *part, const rm_overlay *overlay, rm_arena **passing,
                            const rm_cells_choice *choice, const rm_cells **out, rm_reason *reason)
{
  work         w = {.arena = arena, .scratch = rm_arena_new(), .limit_arena = rm_arena_new(), .part = part, .choice = choice};
  remap_status status = w.scratch && w.limit_arena ? REMAP_OK : REMAP_NO_MEMORY;

  w.out = rm_arena_zero(arena, 1, sizeof *w.out);
  if (!w.out) status = REMAP_NO_MEMORY;
  if (status == REMAP_OK) status = make_polygons(&w, overlay, passing, reason);
  if (status == REMAP_OK) status = make_cells(&w, reason);
  if (status == REMAP_OK) status = select_cells(&w);
  const double start = rm_seconds();
  if (status == REMAP_OK) status = make_faces(&w);
  free(w.p.polygon);
  free(w.p.vertex);
  free(w.parts.vertex);
  free(w.parts.end);
  rm_arena_drop(w.scratch);
  rm_arena_drop(w.limit_arena);
  if (status != REMAP_OK) return status;
  w.out->seconds_faces += rm_seconds() - start;
  *out = w.out;
  return REMAP_OK;
}
