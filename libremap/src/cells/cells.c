/* cells -- the supermesh as a product: limit, polygons, cells, then those that are asked for. See cells.h.
 * Cost: a few us and some hundred bytes per cell, most of them in the exact search for contacts and the planar graphs. */
#include "cells/cells_private.h"

#include <stdlib.h>
#include <string.h>

static bool is_kept(rm_label label, int keep)
{
  const bool source = label.cell[0] != RM_OUTSIDE, target = label.cell[1] != RM_OUTSIDE;
  return keep & (source && target ? RM_CELLS_IN_BOTH : source ? RM_CELLS_IN_SOURCE : RM_CELLS_IN_TARGET);
}

/* Number the cells that are kept and drop the others. */
static remap_status select_cells(rm_arena *arena, rm_arena *scratch, const rm_glued *g, int keep, rm_lid **new_cell, rm_cells *out)
{
  rm_lid (*ancestor)[2];
  double *volume;

  RM_NEW(*new_cell, scratch, g->num_cells);
  for (rm_lid c = 0; c < g->num_cells; c++) (*new_cell)[c] = is_kept(g->label[c], keep) ? out->num_cells++ : RM_OUTSIDE;
  RM_NEW(ancestor, arena, out->num_cells);
  RM_NEW(volume, arena, out->num_cells);
  for (rm_lid c = 0; c < g->num_cells; c++) {
    if ((*new_cell)[c] < 0) continue;
    memcpy(ancestor[(*new_cell)[c]], g->label[c].cell, sizeof *ancestor);
    volume[(*new_cell)[c]] = g->volume[c];
  }
  out->cell_ancestor = (const rm_lid (*)[2])ancestor;
  out->cell_volume   = volume;
  return REMAP_OK;
}

static inline rm_lid cell_beside(const rm_glued *g, const rm_lid *new_cell, int64_t side)
{
  return g->cell[side] < 0 ? RM_OUTSIDE : new_cell[g->cell[side]];
}

static remap_status keep_faces(rm_arena *arena, rm_arena *scratch, const rm_limit *l, const rm_polygons *p, const rm_glued *g,
                               const rm_lid *new_cell, rm_cells *out)
{
  rm_lid  *new_vertex, *vertex, (*cell)[2], (*triangle)[2], n = 0, f = 0;
  int64_t *offset, corners = 0;
  double (*xyz)[3];

  RM_NEW0(new_vertex, scratch, l->num_spots);
  for (int64_t k = 0; k < p->num; k++) {
    if (cell_beside(g, new_cell, 2 * k) < 0 && cell_beside(g, new_cell, 2 * k + 1) < 0) continue;
    out->num_faces++;
    corners += p->polygon[k].num;
    for (rm_lid i = 0; i < p->polygon[k].num; i++) new_vertex[p->vertex[p->polygon[k].first + i]] = 1;
  }
  for (rm_lid s = 0; s < l->num_spots; s++) out->num_vertices += new_vertex[s];
  RM_NEW(xyz, arena, out->num_vertices);
  RM_NEW(offset, arena, (int64_t)out->num_faces + 1);
  RM_NEW(vertex, arena, corners);
  RM_NEW(cell, arena, out->num_faces);
  RM_NEW(triangle, arena, out->num_faces);
  for (rm_lid s = 0; s < l->num_spots; s++) {
    if (!new_vertex[s]) continue;
    memcpy(xyz[n], l->xyz[s], sizeof *xyz);
    new_vertex[s] = n++;
  }
  offset[0] = 0;
  for (int64_t k = 0; k < p->num; k++) {
    const rm_polygon *x = &p->polygon[k];
    const rm_lid      left = cell_beside(g, new_cell, 2 * k), right = cell_beside(g, new_cell, 2 * k + 1);
    const bool        turned = left < 0 || (right >= 0 && right < left);

    if (left < 0 && right < 0) continue;
    for (rm_lid i = 0; i < x->num; i++) vertex[offset[f] + i] = new_vertex[p->vertex[x->first + (turned ? x->num - 1 - i : i)]];
    cell[f][0] = turned ? right : left;
    cell[f][1] = turned ? left : right;
    memcpy(triangle[f], x->triangle, sizeof *triangle);
    offset[f + 1] = offset[f] + x->num;
    f++;
  }
  out->vertex        = (const double (*)[3])xyz;
  out->face_offset   = offset;
  out->face_vertex   = vertex;
  out->face_cell     = (const rm_lid (*)[2])cell;
  out->face_triangle = (const rm_lid (*)[2])triangle;
  return REMAP_OK;
}

static remap_status build(rm_arena *arena, rm_arena *scratch, const rm_part *part, const rm_overlay *o, int keep, rm_polygons *p,
                          rm_cells *out, rm_reason *reason)
{
  const rm_limit *l = NULL;
  rm_glued        g = {0};
  rm_lid         *new_cell;

  RM_TRY(rm_limit_build(scratch, part, o, &l, reason));
  RM_TRY(rm_polygons_build(scratch, part, l, p, reason));
  const remap_status status = rm_glue(scratch, l, p, &g);
  if (status == REMAP_BAD_MESH)
    return rm_fail(status, reason, -1, -1, "the faces around an edge of the supermesh do not bound cells: cells of one mesh overlap");
  RM_TRY(status);
  RM_TRY(rm_merge(scratch, l, p, &g));
  RM_TRY(select_cells(arena, scratch, &g, keep, &new_cell, out));
  return keep_faces(arena, scratch, l, p, &g, new_cell, out);
}

remap_status rm_cells_build(rm_arena *arena, const rm_part *part, const rm_overlay *overlay, int keep, const rm_cells **out,
                            rm_reason *reason)
{
  rm_arena    *scratch = rm_arena_new();
  rm_cells    *cells   = rm_arena_zero(arena, 1, sizeof *cells);
  rm_polygons  p       = {0};
  remap_status status  = scratch && cells ? REMAP_OK : REMAP_NO_MEMORY;

  if (status == REMAP_OK) status = build(arena, scratch, part, overlay, keep, &p, cells, reason);
  free(p.polygon);
  free(p.vertex);
  rm_arena_drop(scratch);
  if (status == REMAP_OK) *out = cells;
  return status;
}
