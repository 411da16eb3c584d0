/* super -- the stages in order: cover, triangulation, crossings, cells, cells that pass, numbers. Where what was made does
 * not fit cells that would pass, which is rare, the first four are done again for all cells. Before all that, zones are joined
 * whose faces do not match. */
#include "super/super_private.h"

#include <stdio.h>
#include <string.h>

typedef struct work {
  const rm_super_job *job;
  rm_arena           *passing; /* of all that the result does not need        */
  rm_cells_passing    early;   /* of what is given back before cells are made */
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

/* A zone that lists all cells of the sides that `all` names. Not collective. */
static remap_status widen_zone(rm_arena *arena, const rm_super_job *job, const bool all[2], const rm_zone **zone)
{
  rm_zone *wide;

  RM_NEW(wide, arena, 1);
  *wide = **zone;
  for (int side = 0; side < 2; side++) {
    const rm_lid n = job->mesh[side]->num_cells;
    rm_lid      *cell;

    if (!all[side]) continue;
    RM_NEW(cell, arena, n);
    for (rm_lid c = 0; c < n; c++) cell[c] = c;
    wide->num_cells[side] = n;
    wide->cell[side]      = cell;
  }
  *zone = wide;
  return REMAP_OK;
}

static remap_status cover(work *w, const bool all[2], rm_reason *reason)
{
  const rm_super_job *job   = w->job;
  const double        start = rm_seconds();
  const rm_zone      *zone;

  RM_TRY(rm_zone_build(w->passing, job->comm, job->mesh, &zone));
  RM_TRY(rm_comm_agree(job->comm, widen_zone(w->passing, job, all, &zone), NULL));
  RM_TRY(rm_part_cover(w->passing, job->comm, job->frame, job->mesh, zone, job->options->keep, all, &w->cover, reason));
  w->figures.seconds_partition += rm_seconds() - start;
  return REMAP_OK;
}

/* What happens on this rank alone. */
static remap_status make_cells(work *w, bool *regular, rm_reason *reason)
{
  const remap_supermesh_options *options = w->job->options;
  const rm_cells_choice          choice  = {options->keep,
                                            w->cover->owner,
                                            {w->cover->flag[0], w->cover->flag[1]},
                                            options->aggregate != 0,
                                            options->split_concave != 0};
  const rm_trimesh_home home = {w->passing, w->early.around, w->early.walks};
  const rm_trimesh     *given[2];
  const rm_overlay     *overlay = NULL;
  double                start   = rm_seconds();

  for (int side = 0; side < 2; side++) {
    RM_TRY(rm_trimesh_build_in(&home, w->job->frame, &w->cover->part.piece[side], w->job->faces, &given[side]));
    RM_TRY(rm_cells_mesh(&home, w->job->frame, given[side], &w->mesh[side]));
    w->figures.num_triangles[side] = w->mesh[side]->num_triangles;
  }
  w->figures.seconds_triangulation += rm_seconds() - start;
  RM_TRY(tell(w, "triangulation", 1));
  start = rm_seconds();
  RM_TRY(rm_overlay_build(w->early.overlay, w->mesh, &w->cover->part, w->job->progress, &overlay, reason));
  w->figures.seconds_crossings += rm_seconds() - start;
  w->figures.num_crossings = overlay->trace[0].num_crossings + overlay->trace[1].num_crossings;
  RM_TRY(rm_cells_build(w->passing, &w->cover->part, overlay, &w->early, &choice, &w->cells, reason));
  w->figures.num_polygons = w->cells->num_polygons;
  w->figures.seconds_polygons += w->cells->seconds_polygons;
  w->figures.seconds_cells += w->cells->seconds_glue;
  w->figures.seconds_faces += w->cells->seconds_faces;
  RM_TRY(tell(w, "cells of the supermesh", 1));
  return rm_super_is_regular(w->job, w->cover, given, w->mesh, regular);
}

static void drop_passing(work *w)
{
  rm_arena_drop(w->early.walks);
  rm_arena_drop(w->early.overlay);
  rm_arena_drop(w->early.around);
  rm_arena_drop(w->passing);
  w->early   = (rm_cells_passing){NULL, NULL, NULL};
  w->passing = NULL;
}

/* The cells of this rank's core; *regular, on all ranks, if others can pass beside them. Collective. */
static remap_status make_core(work *w, const bool all[2], bool *regular, rm_reason *reason)
{
  int64_t irregular;

  drop_passing(w);
  w->passing = rm_arena_new();
  w->early   = (rm_cells_passing){rm_arena_new(), rm_arena_new(), rm_arena_new()};
  const bool ready = w->passing && w->early.walks && w->early.overlay && w->early.around;
  RM_TRY(rm_comm_agree(w->job->comm, ready ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_TRY(cover(w, all, reason));
  RM_TRY(rm_comm_agree_reason(w->job->comm, make_cells(w, regular, reason), reason));
  irregular = !*regular;
  RM_TRY(rm_comm_max_i64(w->job->comm, &irregular, 1));
  *regular = !irregular;
  return REMAP_OK;
}

static remap_status fill_soup(work *w)
{
  w->soup.has_ranks = w->job->comm->size > 1;
  return rm_soup_add_cells(&w->soup, w->passing, &w->cover->part, w->mesh, w->cells);
}

static remap_status build(rm_arena *arena, work *w, rm_super *out, rm_reason *reason)
{
  const bool none[2] = {false, false}, all[2] = {rm_super_passes(w->job, 0), rm_super_passes(w->job, 1)};
  bool       regular = true;

  RM_TRY(make_core(w, none, &regular, reason));
  if (!regular) RM_TRY(make_core(w, all, &regular, reason));
  const double start = rm_seconds();
  RM_TRY(rm_comm_agree(w->job->comm, fill_soup(w), NULL));
  RM_TRY(rm_super_pass(w->job, w->cover, w->mesh, w->cells, &w->soup));
  drop_passing(w);
  RM_TRY(rm_super_finish(arena, w->job, &w->soup, out, reason));
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

remap_status rm_super_make(rm_arena *arena, const rm_super_job *job, rm_super **out, rm_reason *reason)
{
  work         w   = {.job = job};
  rm_super    *new = rm_arena_zero(arena, 1, sizeof *new);
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(job->comm, new ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(new);
  RM_GOTO(done, status = build(arena, &w, new, reason));
  add_figures(&w.figures, &new->view);
  *out = new;
done:
  drop_passing(&w);
  rm_soup_free(&w.soup);
  return status;
}

/* Does a mesh touch itself where nothing joins it? That is then what is wrong. Collective. */
static remap_status explain_contact(const rm_super_job *job, int side, bool *found, rm_reason *reason)
{
  rm_reason    unused = {-1, -1, ""};
  rm_gid       cell[2];
  remap_status status = rm_super_find_contact(job, side, cell, &unused);

  *found = status == REMAP_OK && cell[0] >= 0;
  if (!*found) return status;
  *reason = (rm_reason){-1, -1, ""};
  (void)rm_fail(REMAP_BAD_MESH, reason, side, cell[0],
                "a face of this cell meets one of the cell with global number %lld, but they do not match and no zone ends "
                "there: let nodes agree, or make zones of parts that touch, which are joined",
                (long long)cell[1]);
  return REMAP_OK;
}

/* Zones that touch were joined, but not all nodes of that are doubles. */
static void tell_of_rounding(rm_reason *reason)
{
  const size_t length = strlen(reason->text);

  (void)snprintf(reason->text + length, sizeof reason->text - length,
                 ". Its zones were joined by nodes that are rounded, which may be why: let nodes agree where zones touch");
}

/* A failure in terms of the meshes that were given; parts of cells that two zones hold may be too thin once nodes are rounded.
 * Collective. */
static remap_status explain(const rm_super_job *job, const rm_conformed whole[2], remap_status status, rm_reason *reason)
{
  const rm_comm *comm  = job->comm;
  bool           found = false;

  status = rm_comm_agree_reason(comm, status, reason); /* for all ranks to see the same side */
  if (reason->side >= 0 && whole[reason->side].mesh) rm_super_trace_reason(comm, &whole[reason->side], reason);
  for (int side = 0; side < 2 && status == REMAP_BAD_MESH; side++) {
    if (!whole[side].mesh && !found) RM_TRY(explain_contact(job, side, &found, reason));
    if (whole[side].mesh && reason->side == side && !(whole[side].overlap > 0)) tell_of_rounding(reason);
    if (!(whole[side].overlap > 0)) continue;
    *reason = (rm_reason){side, reason->side == side ? reason->global_cell : -1,
                          "its zones overlap by rounding, and parts of cells that two of them hold are too thin to be told "
                          "from it: let nodes agree where zones touch, or choose one of the zones"};
    break;
  }
  return status;
}

/* Volumes over all ranks, by the meshes that cells lie in. Collective. */
static remap_status sum_volumes(const rm_comm *comm, remap_supermesh_view *view)
{
  rm_sum sum[3];

  for (int k = 0; k < 3; k++) rm_sum_clear(&sum[k]);
  for (int64_t c = 0; c < view->num_cells; c++)
    rm_sum_add(&sum[view->cell_ancestor[0][c] < 0 ? 2 : view->cell_ancestor[1][c] < 0 ? 1 : 0], view->cell_volume[c]);
  RM_TRY(rm_comm_sum_exact(comm, sum, 3));
  for (int k = 0; k < 3; k++) view->volume[k] = rm_sum_value(&sum[k]);
  return REMAP_OK;
}

remap_status rm_super_build(rm_arena *arena, const rm_super_job *job, const rm_super **out, rm_reason *reason)
{
  rm_arena      *own[2]   = {rm_arena_new(), rm_arena_new()};
  const rm_mesh *mesh[2]  = {job->mesh[0], job->mesh[1]};
  rm_conformed   whole[2] = {{.mesh = NULL}, {.mesh = NULL}};
  rm_super_job   whole_job = *job;
  rm_super      *super;
  remap_status   status = rm_comm_agree(job->comm, own[0] && own[1] ? REMAP_OK : REMAP_NO_MEMORY, NULL);

  whole_job.mesh = mesh;
  for (int side = 0; side < 2 && status == REMAP_OK; side++) {
    status = rm_super_conform(&own[side], job, side, &whole[side], reason);
    if (whole[side].mesh) mesh[side] = whole[side].mesh;
  }
  if (status == REMAP_OK) {
    status = rm_super_make(arena, &whole_job, &super, reason);
    if (status != REMAP_OK) status = explain(job, whole, status, reason);
  }
  for (int side = 0; side < 2 && status == REMAP_OK; side++) {
    const double unit = 1 / job->frame->scale;

    super->view.zone_overlap[side] = whole[side].overlap * unit * unit * unit;
    if (whole[side].mesh) status = rm_super_retrace(arena, job->comm, side, &whole[side], super);
  }
  if (status == REMAP_OK) status = sum_volumes(job->comm, &super->view);
  if (status == REMAP_OK) *out = super;
  for (int side = 0; side < 2; side++) rm_arena_drop(own[side]);
  return status;
}
