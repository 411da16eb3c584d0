/* super -- the stages in order: cover, triangulation, crossings, cells, cells that pass, numbers. */
#include "super/super_private.h"

#include <string.h>

typedef struct work {
  const rm_super_job *job;
  rm_arena           *passing;       /* of all that the result does not need */
  rm_arena           *overlay_arena; /* of crossings and segments */
  const rm_cover     *cover;
  const rm_trimesh   *mesh[2];
  const rm_cells     *cells;
  rm_soup             soup;
  remap_supermesh_view figures; /* counts and times */
} work;

static remap_status tell(const work *w, const char *phase, double done)
{
  const rm_progress *p = w->job->progress;
  return p && p->call && p->call(p->user, phase, done) ? REMAP_CANCELLED : REMAP_OK;
}

static remap_status cover(work *w, rm_reason *reason)
{
  const double   start = rm_seconds();
  const rm_zone *zone;

  RM_TRY(rm_zone_build(w->passing, w->job->comm, w->job->mesh, &zone));
  RM_TRY(rm_part_cover(w->passing, w->job->comm, w->job->frame, w->job->mesh, zone, w->job->options->keep, &w->cover, reason));
  w->figures.seconds_partition = rm_seconds() - start;
  return REMAP_OK;
}

/* What happens on this rank alone. */
static remap_status make_cells(work *w, rm_reason *reason)
{
  const remap_supermesh_options *options = w->job->options;
  const rm_cells_choice choice = {options->keep, w->cover->owner, {w->cover->flag[0], w->cover->flag[1]}, options->aggregate != 0,
                                  options->split_concave != 0};
  const rm_overlay     *overlay = NULL;
  double                start   = rm_seconds();

  for (int side = 0; side < 2; side++) {
    RM_TRY(rm_trimesh_build(w->passing, w->job->frame, &w->cover->part.piece[side], w->job->faces, &w->mesh[side]));
    RM_TRY(rm_cells_mesh(w->passing, w->job->frame, w->mesh[side], &w->mesh[side]));
    w->figures.num_triangles[side] = w->mesh[side]->num_triangles;
  }
  w->figures.seconds_triangulation = rm_seconds() - start;
  RM_TRY(tell(w, "triangulation", 1));
  start = rm_seconds();
  RM_TRY(rm_overlay_build(w->overlay_arena, w->mesh, &w->cover->part, w->job->progress, &overlay, reason));
  w->figures.seconds_crossings = rm_seconds() - start;
  w->figures.num_crossings     = overlay->trace[0].num_crossings + overlay->trace[1].num_crossings;
  RM_TRY(rm_cells_build(w->passing, &w->cover->part, overlay, &w->overlay_arena, &choice, &w->cells, reason));
  w->figures.num_polygons     = w->cells->num_polygons;
  w->figures.seconds_polygons = w->cells->seconds_polygons;
  w->figures.seconds_cells    = w->cells->seconds_glue;
  w->figures.seconds_faces    = w->cells->seconds_faces;
  RM_TRY(tell(w, "cells of the supermesh", 1));
  RM_TRY(rm_super_reserve(w->job, w->cover, w->cells, &w->soup));
  return rm_soup_add_cells(&w->soup, &w->cover->part, w->mesh, w->cells);
}

/* What the soup has is no longer needed elsewhere. */
static void drop_passing(work *w)
{
  rm_arena_drop(w->passing);
  w->passing = NULL;
}

static remap_status build(rm_arena *arena, work *w, rm_super *out, rm_reason *reason)
{
  RM_TRY(cover(w, reason));
  RM_TRY(rm_comm_agree_reason(w->job->comm, make_cells(w, reason), reason));
  const double start = rm_seconds();
  RM_TRY(rm_super_pass(w->job, w->cover, w->mesh, w->cells, &w->soup));
  drop_passing(w);
  RM_TRY(rm_super_finish(arena, w->job, &w->soup, out));
  w->figures.seconds_numbering = rm_seconds() - start;
  return REMAP_OK;
}

/* The counts and times beside what the view has already. */
static void add_figures(const remap_supermesh_view *figures, remap_supermesh_view *view)
{
  for (int side = 0; side < 2; side++) view->num_triangles[side] = figures->num_triangles[side];
  view->num_crossings         = figures->num_crossings;
  view->num_polygons          = figures->num_polygons;
  view->seconds_partition     = figures->seconds_partition;
  view->seconds_triangulation = figures->seconds_triangulation;
  view->seconds_crossings     = figures->seconds_crossings;
  view->seconds_polygons      = figures->seconds_polygons;
  view->seconds_cells         = figures->seconds_cells;
  view->seconds_faces         = figures->seconds_faces;
  view->seconds_numbering     = figures->seconds_numbering;
}

remap_status rm_super_build(rm_arena *arena, const rm_super_job *job, const rm_super **out, rm_reason *reason)
{
  work         w   = {.job = job, .passing = rm_arena_new(), .overlay_arena = rm_arena_new()};
  rm_super    *new = rm_arena_zero(arena, 1, sizeof *new);
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(job->comm, w.passing && w.overlay_arena && new ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(w.passing && w.overlay_arena && new);
  RM_GOTO(done, status = build(arena, &w, new, reason));
  add_figures(&w.figures, &new->view);
  *out = new;
done:
  rm_arena_drop(w.overlay_arena);
  rm_arena_drop(w.passing);
  rm_soup_free(&w.soup);
  return status;
}
