/* nearest -- where cells without pairs take their values from: layer by layer through the receiving mesh, from the mapped cells
 * outwards, on all ranks at once; one exchange and one reduction per layer. What no layer reaches (a zone that touches no
 * mapped cell) searches by distance alone. O(cells without a value * layers) time. */
#include "field_private.h"

static void collect_unmapped(const rm_mesh *mesh, const uint8_t *cover, rm_lid *cell, int64_t *num, rm_origin *origin)
{
  *num = 0;
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    const double *x = mesh->cell_centroid[c];

    origin[c] = (rm_origin){.xyz = {x[0], x[1], x[2]}, .global = mesh->cell_global[c], .rank = -1, .cell = c};
    if (cover[c] == REMAP_UNCOVERED) cell[(*num)++] = c;
  }
}

/* The best origin among a cell's neighbours; rank -1 if none has one yet. */
static rm_origin best_around(const rm_stencil *stencil, rm_lid cell, const double centroid[3], const rm_origin *own,
                             const rm_origin *halo)
{
  rm_origin best     = {.rank = -1};
  double    smallest = INFINITY;

  for (int64_t k = stencil->offset[cell]; k < stencil->offset[cell + 1]; k++) {
    const rm_lid     n     = stencil->neighbour[k];
    const rm_origin *other = n < stencil->num_cells ? &own[n] : &halo[n - stencil->num_cells];
    double           distance;

    if (other->rank < 0 || (distance = rm_distance2(centroid, other->xyz)) >= smallest) continue;
    smallest = distance;
    best     = *other;
  }
  return best;
}

/* Give the waiting cells beside the layers so far their origin; the rest stays in waiting. How many were given one. */
static int64_t add_layer(const rm_stencil *stencil, const rm_mesh *mesh, rm_lid *waiting, int64_t *num_waiting, rm_origin *own,
                         const rm_origin *halo, rm_origin *layer)
{
  int64_t left = 0, num = 0;

  for (int64_t k = 0; k < *num_waiting; k++) /* all before any is given, so that a layer does not see itself */
    layer[k] = best_around(stencil, waiting[k], mesh->cell_centroid[waiting[k]], own, halo);
  for (int64_t k = 0; k < *num_waiting; k++) {
    const rm_lid cell = waiting[k];

    if (layer[k].rank >= 0) {
      own[cell] = layer[k];
      num++;
    } else {
      waiting[left++] = cell;
    }
  }
  *num_waiting = left;
  return num;
}

/* Layers until none is added anywhere. Collective. */
static remap_status walk_layers(rm_arena *scratch, const rm_comm *comm, const rm_mesh *mesh, const rm_stencil *stencil,
                                rm_lid *waiting, int64_t *num_waiting, rm_origin *own)
{
  const rm_plan *plan   = stencil->plan;
  rm_origin     *halo   = rm_arena_alloc(scratch, stencil->num_halo, sizeof *halo);
  rm_origin     *buffer = rm_arena_alloc(scratch, plan->send_offset[plan->num_send], sizeof *buffer);
  rm_origin     *layer  = rm_arena_alloc(scratch, *num_waiting, sizeof *layer);
  int64_t        news[2]; /* worst status, cells added */

  RM_TRY(rm_comm_agree(comm, halo && buffer && layer ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  do {
    news[0] = rm_plan_run(comm, plan, sizeof *own, own, halo, buffer);
    news[1] = news[0] == REMAP_OK ? add_layer(stencil, mesh, waiting, num_waiting, own, halo, layer) : 0;
    RM_TRY(rm_comm_max_i64(comm, news, 2));
  } while (news[0] == REMAP_OK && news[1] > 0);
  return (remap_status)news[0];
}

/* Search for the cells that no layer reached. Collective. */
static remap_status search_rest(rm_arena *scratch, const rm_comm *comm, const rm_mesh *mesh, const uint8_t *cover,
                                const rm_lid *waiting, int64_t num_waiting, rm_origin *own)
{
  double(*point)[3] = rm_arena_alloc(scratch, num_waiting, sizeof *point);
  rm_origin *found  = rm_arena_alloc(scratch, num_waiting, sizeof *found);

  RM_TRY(rm_comm_agree(comm, point && found ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(point && found);
  for (int64_t k = 0; k < num_waiting; k++)
    for (int d = 0; d < 3; d++) point[k][d] = mesh->cell_centroid[waiting[k]][d];
  RM_TRY(rm_nearest_anywhere(scratch, comm, mesh, cover, num_waiting, (const double(*)[3])point, found));
  for (int64_t k = 0; k < num_waiting; k++) own[waiting[k]] = found[k];
  return REMAP_OK;
}

/* Each origin once, by rank and number there, as the plan wants it; origin[k] is its place. */
static remap_status list_origins(rm_arena *scratch, const rm_origin *own, rm_nearest *nearest, rm_lid *origin,
                                 int64_t *num_want, int **want_rank, rm_lid **want_cell)
{
  const int64_t n = nearest->num;
  rm_keyed     *keyed, *spare;
  int64_t       num = 0;

  RM_NEW(keyed, scratch, n);
  RM_NEW(spare, scratch, n);
  RM_NEW(*want_rank, scratch, n);
  RM_NEW(*want_cell, scratch, n);
  for (int64_t k = 0; k < n; k++) {
    const rm_origin *o = &own[nearest->cell[k]];

    keyed[k] = (rm_keyed){(uint64_t)o->rank << 32 | (uint64_t)o->cell, k};
  }
  rm_sort_keyed(keyed, spare, n);
  for (int64_t k = 0; k < n; k++) {
    if (k == 0 || keyed[k].key != keyed[k - 1].key) {
      (*want_rank)[num]   = (int)(keyed[k].key >> 32);
      (*want_cell)[num++] = (rm_lid)(keyed[k].key & UINT32_MAX);
    }
    origin[keyed[k].item] = (rm_lid)(num - 1);
  }
  *num_want = num;
  return REMAP_OK;
}

remap_status rm_nearest_build(rm_arena *arena, const rm_comm *comm, const rm_mesh *mesh, const rm_stencil *stencil,
                              const uint8_t *cover, const rm_nearest **out, rm_reason *reason)
{
  rm_arena    *scratch   = rm_arena_new();
  rm_nearest  *nearest   = rm_arena_zero(arena, 1, sizeof *nearest);
  rm_lid      *cell      = NULL, *origin = NULL;
  rm_lid      *waiting   = scratch ? rm_arena_alloc(scratch, mesh->num_cells, sizeof *waiting) : NULL;
  rm_origin   *own       = scratch ? rm_arena_alloc(scratch, mesh->num_cells, sizeof *own) : NULL;
  int         *want_rank = NULL;
  rm_lid      *want_cell = NULL;
  int64_t      num_waiting = 0, num_want = 0, most[1];
  remap_status status = REMAP_OK;

  if (waiting && own) collect_unmapped(mesh, cover, waiting, &num_waiting, own);
  cell   = waiting && own ? rm_arena_alloc(arena, num_waiting, sizeof *cell) : NULL;
  origin = cell ? rm_arena_alloc(arena, num_waiting, sizeof *origin) : NULL;
  RM_GOTO(done, status = rm_comm_agree(comm, nearest && origin ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(nearest && cell && origin && waiting && own);
  nearest->num    = num_waiting;
  nearest->cell   = cell;
  nearest->origin = origin;
  for (int64_t k = 0; k < num_waiting; k++) cell[k] = waiting[k];
  most[0] = 0; /* mapped cells */
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    if (!rm_is_mapped(cover[c])) continue;
    own[c].rank = comm->rank;
    most[0]++;
  }
  RM_GOTO(done, status = rm_comm_max_i64(comm, most, 1));
  if (most[0] == 0) {
    status = rm_fail(REMAP_COVERAGE, reason, mesh->side, -1, "no cell meets the other mesh: are units and position alike?");
    goto done;
  }
  RM_GOTO(done, status = walk_layers(scratch, comm, mesh, stencil, waiting, &num_waiting, own));
  most[0] = num_waiting;
  RM_GOTO(done, status = rm_comm_max_i64(comm, most, 1));
  if (most[0] > 0) RM_GOTO(done, status = search_rest(scratch, comm, mesh, cover, waiting, num_waiting, own));
  status = list_origins(scratch, own, nearest, origin, &num_want, &want_rank, &want_cell);
  RM_GOTO(done, status = rm_comm_agree(comm, status, NULL));
  RM_GOTO(done, status = rm_plan_build(comm, arena, num_want, want_rank, want_cell, &nearest->plan));
  *out = nearest;
done:
  rm_arena_drop(scratch);
  return status;
}
