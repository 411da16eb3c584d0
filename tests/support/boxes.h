/* boxes -- pairs of meshes of axis-parallel boxes, whose overlaps are known in closed form, taken through the room mapping
 * without any overlay. What is tested with them depends on neither predicates nor tracing.
 *
 *   boxes_world world;
 *   boxes_open(&world, MPI_COMM_WORLD, boxes_grid(...), boxes_grid(...), TM_RANDOM);
 *   ... world.mapping, world.stencil[side] ...
 *   boxes_close(&world);
 *
 * On MPI_COMM_SELF the same call gives every rank the answer of one rank. Everything is collective on the communicator. */
#ifndef BOXES_H
#define BOXES_H

#include "field/field.h"
#include "meshes.h"
#include "rt.h"

typedef struct boxes_world {
  rm_comm           comm;
  rm_arena         *arena; /* of everything, and free for the caller's scratch */
  rm_frame          frame;
  const rm_mesh    *mesh[2];
  rm_part           part; /* without faces */
  rm_moments        moments;
  const rm_mapping *mapping;
  const rm_stencil *stencil[2];
} boxes_world;

/* Where a grid lies: the box from low to high; grading 0: equal cells, up to 0.9: cells that grow along each axis. */
typedef struct boxes_shape {
  double low[3], high[3], grading;
} boxes_shape;

static inline void boxes_place_(double xyz[3], const void *data)
{
  const boxes_shape *shape = data;

  for (int d = 0; d < 3; d++) {
    const double t = xyz[d] - shape->grading * xyz[d] * (1.0 - xyz[d]);

    xyz[d] = t < 1.0 ? shape->low[d] + t * (shape->high[d] - shape->low[d]) : shape->high[d];
  }
}

/* n[0] x n[1] x n[2] boxes. The caller's, or boxes_open's. high below low along an odd number of axes makes all cells
 * inverted. */
static inline tm_mesh *boxes_grid(int nx, int ny, int nz, boxes_shape shape)
{
  return tm_hexahedra((int[]){nx, ny, nz}, boxes_place_, &shape);
}

/* A cell as every rank sees it. */
typedef struct boxes_cell_ {
  double box[6], volume, centroid[3];
  rm_gid global;
  int    rank;
  rm_lid number;
} boxes_cell_;

static inline boxes_cell_ *boxes_gather_(const boxes_world *world, const rm_mesh *mesh, int64_t *num)
{
  boxes_cell_ *mine   = rm_arena_zero(world->arena, mesh->num_cells, sizeof *mine);
  int64_t     *offset = rm_arena_alloc(world->arena, world->comm.size + 1, sizeof *offset);
  void        *all    = NULL;

  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    memcpy(mine[c].box, mesh->cell_box[c], sizeof mine[c].box);
    memcpy(mine[c].centroid, mesh->cell_centroid[c], sizeof mine[c].centroid);
    mine[c].volume = mesh->cell_volume[c];
    mine[c].global = mesh->cell_global[c];
    mine[c].rank   = world->comm.rank;
    mine[c].number = c;
  }
  RT_EQ(rm_comm_allgatherv(&world->comm, world->arena, mine, mesh->num_cells, sizeof *mine, offset, &all), REMAP_OK);
  *num = offset[world->comm.size];
  return all;
}

/* Volume of the overlap of two cells, negative if one of them is inverted, and its moment about the first one's centroid. */
static inline double boxes_overlap_(const boxes_cell_ *i, const boxes_cell_ *j, double moment[3])
{
  double volume = (i->volume < 0.0) == (j->volume < 0.0) ? 1.0 : -1.0, middle[3];

  for (int d = 0; d < 3; d++) {
    const double low = fmax(i->box[d], j->box[d]), high = fmin(i->box[d + 3], j->box[d + 3]);

    if (!(high > low)) return 0.0;
    volume *= high - low;
    middle[d] = 0.5 * ((low - i->centroid[d]) + (high - i->centroid[d]));
  }
  for (int d = 0; d < 3; d++) moment[d] = volume * middle[d];
  return volume;
}

/* 1 for cells that the other mesh does not cover. */
static inline bool *boxes_partial_(const boxes_world *world, const boxes_cell_ *cell, int64_t n, const boxes_cell_ *other,
                                   int64_t m)
{
  bool  *is_partial = rm_arena_zero(world->arena, n, sizeof *is_partial);
  double moment[3];

  for (int64_t i = 0; i < n; i++) {
    double sum = 0.0;

    for (int64_t j = 0; j < m; j++) sum += fabs(boxes_overlap_(&cell[i], &other[j], moment));
    is_partial[i] = sum < fabs(cell[i].volume) * (1.0 - 1e-9);
  }
  return is_partial;
}

static inline rm_piece boxes_piece_(const boxes_world *world, const boxes_cell_ *all, const int64_t *which, int64_t n)
{
  rm_gid *global       = rm_arena_alloc(world->arena, n, sizeof *global);
  int    *rank         = rm_arena_alloc(world->arena, n, sizeof *rank);
  rm_lid *home         = rm_arena_alloc(world->arena, n, sizeof *home);
  double *volume       = rm_arena_alloc(world->arena, n, sizeof *volume);
  double(*centroid)[3] = rm_arena_alloc(world->arena, n, sizeof *centroid);

  for (int64_t k = 0; k < n; k++) {
    const boxes_cell_ *cell = &all[which[k]];

    global[k] = cell->global;
    rank[k]   = cell->rank;
    home[k]   = cell->number;
    volume[k] = cell->volume;
    memcpy(centroid[k], cell->centroid, sizeof centroid[k]);
  }
  return (rm_piece){.num_cells      = (rm_lid)n,
                    .cell_global    = global,
                    .cell_home_rank = rank,
                    .cell_home      = home,
                    .cell_volume    = volume,
                    .cell_centroid  = (const double(*)[3])centroid};
}

/* All pairs; each target cell on the rank its global id says, the pairs of odd ranks in reverse. */
static inline void boxes_overlay_(const boxes_world *world, rm_part *part, rm_moments *moments)
{
  int64_t            n[2], num = 0, *which[2], num_targets = 0;
  const boxes_cell_ *cell[2];
  const bool        *is_partial[2];
  rm_lid            *source, *target;
  double            *volume, (*moment)[3];
  uint8_t           *flags;

  for (int side = 0; side < 2; side++) {
    cell[side]  = boxes_gather_(world, world->mesh[side], &n[side]);
    which[side] = rm_arena_alloc(world->arena, n[side], sizeof **which);
  }
  for (int side = 0; side < 2; side++)
    is_partial[side] = boxes_partial_(world, cell[side], n[side], cell[1 - side], n[1 - side]);
  for (int64_t i = 0; i < n[0]; i++) which[0][i] = i;
  for (int64_t j = 0; j < n[1]; j++)
    if (rm_hash_word((uint64_t)cell[1][j].global) % (uint64_t)world->comm.size == (uint64_t)world->comm.rank)
      which[1][num_targets++] = j;
  part->piece[0] = boxes_piece_(world, cell[0], which[0], n[0]);
  part->piece[1] = boxes_piece_(world, cell[1], which[1], num_targets);

  source = rm_arena_alloc(world->arena, n[0] * num_targets, sizeof *source);
  target = rm_arena_alloc(world->arena, n[0] * num_targets, sizeof *target);
  volume = rm_arena_alloc(world->arena, n[0] * num_targets, sizeof *volume);
  moment = rm_arena_alloc(world->arena, n[0] * num_targets, sizeof *moment);
  flags  = rm_arena_zero(world->arena, n[0] * num_targets, sizeof *flags);
  for (int64_t k = 0; k < num_targets; k++)
    for (int64_t l = 0; l < n[0]; l++) {
      const int64_t i = world->comm.rank % 2 ? n[0] - 1 - l : l, j = which[1][k];

      volume[num] = boxes_overlap_(&cell[0][i], &cell[1][j], moment[num]);
      if (!(fabs(volume[num]) > 0.0)) continue;
      source[num] = (rm_lid)i;
      target[num] = (rm_lid)k;
      flags[num]  = (uint8_t)((is_partial[1][j] ? RM_PAIR_SOURCE_SKIN : 0) | (is_partial[0][i] ? RM_PAIR_TARGET_SKIN : 0));
      num++;
    }
  *moments = (rm_moments){.num_pairs = num,
                          .source    = source,
                          .target    = target,
                          .volume    = volume,
                          .moment    = (const double(*)[3])moment,
                          .flags     = flags};
}

/* Two meshes of the library, each dealt to the ranks of comm; at random means renumbered too. Frees whole[]. */
static inline void boxes_open_meshes(boxes_world *world, MPI_Comm comm, tm_mesh *source, tm_mesh *target, tm_dealing deal)
{
  tm_mesh   *whole[2] = {source, target}, *part[2];
  remap_mesh view[2];
  rm_reason  reason = {-1, -1, ""};

  memset(world, 0, sizeof *world);
  world->arena = rm_arena_new();
  RT_EQ(rm_comm_dup(comm, &world->comm), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    int *rank = tm_deal(whole[side], world->comm.size, deal, (uint64_t)side + 1);

    part[side] = tm_part(whole[side], rank, world->comm.rank, deal == TM_RANDOM ? 7 : 0);
    view[side] = part[side]->view;
    tm_free(whole[side]);
    free(rank);
  }
  RT_EQ(rm_frame_build(&world->comm, view, &world->frame, &reason), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    RT_EQ(rm_mesh_build(world->arena, &world->comm, (remap_side)side, &view[side], &world->frame, REMAP_FACES_CENTRE,
                        &world->mesh[side], &reason),
          REMAP_OK);
    RT_EQ(rm_stencil_build(world->arena, &world->comm, &world->frame, world->mesh[side], NULL, &world->stencil[side]),
          REMAP_OK);
    RT_EQ(rm_stencil_weigh(world->arena, world->mesh[side], world->stencil[side], &world->stencil[side]), REMAP_OK);
  }
  for (int side = 0; side < 2; side++) tm_free(part[side]);
}

static inline void boxes_open(boxes_world *world, MPI_Comm comm, tm_mesh *source, tm_mesh *target, tm_dealing deal)
{
  rm_reason reason = {-1, -1, ""};

  boxes_open_meshes(world, comm, source, target, deal);
  boxes_overlay_(world, &world->part, &world->moments);
  RT_EQ(rm_mapping_build(world->arena, &world->comm, &world->frame, world->mesh, &world->part, &world->moments, &world->mapping,
                         &reason),
        REMAP_OK);
}

static inline void boxes_close(boxes_world *world)
{
  rm_arena_drop(world->arena);
  rm_comm_free(&world->comm);
}

/* What a transfer between the world's meshes needs. */
static inline rm_transfer_setup boxes_setup(const boxes_world *w, remap_direction direction)
{
  const int     giving = direction == REMAP_FORWARD ? REMAP_SOURCE : REMAP_TARGET, receiving = 1 - giving;
  const rm_gid *number = w->mapping->cells_by_cover[receiving];

  return (rm_transfer_setup){.comm              = &w->comm,
                             .frame             = &w->frame,
                             .giving            = w->mesh[giving],
                             .receiving         = w->mesh[receiving],
                             .rows              = &w->mapping->rows[receiving],
                             .giving_rows       = &w->mapping->rows[giving],
                             .giving_stencil    = w->stencil[giving],
                             .receiving_stencil = w->stencil[receiving],
                             .keeping_stencil   = w->stencil[receiving],
                             .any_partial       = number[REMAP_PARTIAL] > 0,
                             .any_uncovered     = number[REMAP_UNCOVERED] > 0};
}

/* One transfer with a carrier of its own, which lives in arena; integrals in the own frame. */
static inline remap_status boxes_transfer(rm_arena *arena, const rm_transfer_setup *setup, const remap_transfer *how, int num,
                                          const remap_field_desc *fields, remap_field_report *reports, rm_reason *reason)
{
  const rm_load load    = rm_load_of(setup, how, num, fields);
  rm_carrier   *carrier = NULL;

  RM_TRY(rm_carrier_build(arena, setup, load, &carrier, reason));
  rm_carrier_start(carrier, how, num, fields, 1, REMAP_OK, reason);
  return rm_carrier_finish(carrier, 1.0, reports, reason);
}

/* The cell of a mesh that has a global id; -1 if it is not on this rank. */
static inline rm_lid boxes_find(const rm_mesh *mesh, rm_gid global)
{
  for (rm_lid c = 0; c < mesh->num_cells; c++)
    if (mesh->cell_global[c] == global) return c;
  return -1;
}

/* Equal bit by bit. */
static inline bool boxes_same_bits(const void *a, const void *b, size_t size) { return memcmp(a, b, size) == 0; }
#endif
