/* pairs -- pairs of small meshes in the library's own form, for the tests of the rooms between mesh and overlay: several kinds
 * of neighbourhood, each handed in in several ways.
 *
 *   pairs_world world;
 *   pairs_open(&world, PAIRS_SAME, TM_RANDOM);
 *   ... rm_zone_build(world.arena, &world.comm, world.mesh, &zone) ...
 *   pairs_close(&world);
 *
 * Everything here is collective. */
#ifndef PAIRS_H
#define PAIRS_H

#include "mesh/mesh.h"
#include "meshes.h"
#include "rt.h"

typedef enum pairs_kind {
  PAIRS_SAME,          /* one grid twice                                                 */
  PAIRS_WARPED,        /* warped hexahedra and tetrahedra of one cube                    */
  PAIRS_PARTLY,        /* polyhedra with hanging nodes and a turned grid that sticks out */
  PAIRS_COARSE_TARGET, /* a grid and one target cell around it                           */
  PAIRS_COARSE_SOURCE, /* one source cell around a grid                                  */
  PAIRS_TOUCHING,      /* two grids that share one plane                                 */
  PAIRS_APART,         /* two grids that do not meet                                     */
  PAIRS_NO_SOURCE,     /* a source without cells                                         */
  PAIRS_GRADED,        /* a grid that is refined towards a corner, and an even one       */
  PAIRS_DRAWN          /* and beyond: PAIRS_DRAWN + k is the k-th pair drawn by lot      */
} pairs_kind;

enum { PAIRS_NUM_DEALS = TM_LAST + 1 }; /* the ways of tm_dealing */

typedef struct pairs_world {
  rm_comm        comm;
  rm_arena      *arena; /* of the meshes, and free for the caller's products */
  rm_frame       frame;
  const rm_mesh *mesh[2];
} pairs_world;

/* Scale by m[0] and move by (m[1], m[2], m[3]). */
static inline void pairs_place_(double xyz[3], const void *data)
{
  const double *m = data;

  for (int d = 0; d < 3; d++) xyz[d] = m[0] * xyz[d] + m[1 + d];
}

/* Crowd the unit cube's points towards the origin. */
static inline void pairs_grade_(double xyz[3], const void *data)
{
  const double power = *(const double *)data;

  for (int d = 0; d < 3; d++) xyz[d] = pow(xyz[d], power);
}

static inline tm_mesh *pairs_grid_(int n, double scale, double shift)
{
  return tm_hexahedra((int[]){n, n, n}, pairs_place_, (double[]){scale, shift, 0.0, 0.0});
}

static inline tm_mesh *pairs_checkered_(const int n[3], tm_map map, const void *data)
{
  return tm_refined(n, tm_checkered, map, data);
}

/* A small mesh of any maker, distorted, and moved by up to the cube's edge. */
static inline tm_mesh *pairs_draw_(uint64_t seed)
{
  static tm_mesh *(*const maker[])(const int n[3], tm_map map, const void *data) = {
      tm_hexahedra, tm_tetrahedra, tm_prisms, tm_pyramids, tm_mixed, pairs_checkered_, tm_dual};
  const int64_t num = (int64_t)(sizeof maker / sizeof *maker), steps = 1000;
  uint64_t      state = tm_mix_(seed);
  double        map[12];
  int           n[3];

  for (int d = 0; d < 3; d++) n[d] = 1 + (int)tm_random(&state, 4);
  for (int i = 0; i < 12; i++) {
    const double drawn = 2.0 * (double)tm_random(&state, steps) / (double)steps - 1.0;

    map[i] = i % 4 == 3 ? drawn : (i % 5 == 0) + 0.3 * drawn; /* the linear part stays right-handed */
  }
  return maker[tm_random(&state, num)](n, tm_affine, map);
}

/* The whole mesh of one side; NULL if it has no cells. */
static inline tm_mesh *pairs_whole_(pairs_kind kind, int side)
{
  const bool source = side == REMAP_SOURCE;
  tm_mesh   *mesh;

  if (kind >= PAIRS_DRAWN) return pairs_draw_(2 * (uint64_t)(kind - PAIRS_DRAWN) + (uint64_t)side);
  switch (kind) {
    case PAIRS_WARPED:
      return source ? tm_hexahedra((int[]){5, 6, 7}, tm_warp, &(tm_warping){0.03, 0.7})
                    : tm_tetrahedra((int[]){4, 3, 3}, tm_warp, &(tm_warping){0.02, 0.1});
    case PAIRS_PARTLY:
      if (source) return tm_refined((int[]){4, 4, 4}, tm_right_half, tm_warp, &(tm_warping){0.02, 0.7});
      mesh = tm_benchmark(6, 0.7, 0.3, 1.0);
      tm_move(mesh, pairs_place_, (double[]){1.0, 0.9, 0.5, 0.5});
      return mesh;
    case PAIRS_COARSE_TARGET: return source ? pairs_grid_(6, 1.0, 0.0) : pairs_grid_(1, 1.5, -0.25);
    case PAIRS_COARSE_SOURCE: return source ? pairs_grid_(1, 1.5, -0.25) : pairs_grid_(6, 1.0, 0.0);
    case PAIRS_TOUCHING: return source ? pairs_grid_(5, 1.0, 0.0) : pairs_grid_(4, 1.0, 1.0);
    case PAIRS_APART: return source ? pairs_grid_(5, 1.0, 0.0) : pairs_grid_(4, 1.0, 3.0);
    case PAIRS_NO_SOURCE: return source ? NULL : pairs_grid_(4, 1.0, 0.0);
    case PAIRS_GRADED:
      return source ? tm_hexahedra((int[]){12, 12, 12}, pairs_grade_, &(double){3.0}) : pairs_grid_(10, 1.0, 0.0);
    default: return pairs_grid_(7, 1.0, 0.0);
  }
}

/* This rank's part of a mesh; renumbered at random if dealt at random. */
static inline tm_mesh *pairs_part_(const tm_mesh *whole, tm_dealing deal)
{
  int     *rank = tm_deal(whole, rt_size(), deal, 1);
  tm_mesh *part = tm_part(whole, rank, rt_rank(), deal == TM_RANDOM ? 7 : 0);

  free(rank);
  return part;
}

/* How many kinds a test goes through, from 0 on. */
static inline int pairs_num_kinds(void) { return PAIRS_DRAWN + (rt_long() ? 500 : 10); }

static inline void pairs_open(pairs_world *world, pairs_kind kind, tm_dealing deal)
{
  tm_mesh   *part[2] = {NULL, NULL};
  remap_mesh view[2];
  rm_reason  reason = {-1, -1, ""};

  memset(view, 0, sizeof view);
  memset(world, 0, sizeof *world);
  world->arena = rm_arena_new();
  RT_EQ(rm_comm_dup(MPI_COMM_WORLD, &world->comm), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    tm_mesh *whole = pairs_whole_(kind, side);

    if (!whole) continue;
    part[side] = pairs_part_(whole, deal);
    view[side] = part[side]->view;
    tm_free(whole);
  }
  RT_EQ(rm_frame_build(&world->comm, view, &world->frame, &reason), REMAP_OK);
  for (int side = 0; side < 2; side++)
    RT_EQ(rm_mesh_build(world->arena, &world->comm, (remap_side)side, &view[side], &world->frame, REMAP_FACES_CENTRE,
                        &world->mesh[side], &reason),
          REMAP_OK);
  for (int side = 0; side < 2; side++) tm_free(part[side]);
}

static inline void pairs_close(pairs_world *world)
{
  rm_arena_drop(world->arena);
  rm_comm_free(&world->comm);
}

#endif
