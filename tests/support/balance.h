/* balance -- what each rank has to do when two meshes are overlaid: counted, for tests, and timed, for the bench.
 *
 *   balance_open_on(&b, MPI_COMM_WORLD, "graded", 16, REMAP_FACES_CENTRE);
 *   if (b.status == REMAP_OK) ... b.here, b.bytes ...
 *   balance_close(&b);
 *
 *   even     N^3 warped hexahedra on (N+1)^3
 *   graded   7 (N/2)^3 in a pyramid, a thousand times larger at its foot than at its tip in all directions, on 7 (N/2+1)^3
 *   stretched  N^3 on (N+1)^3, of both those at one corner a thousand times longer along each axis than those at the other
 *   facing   the same, refined towards opposite corners        corner  stretched ones on even ones
 *   layers   stretched along z alone, on even ones; turned by 30 degrees about x
 *   target   N^3 inside one target cell                        source  N^3 inside one source cell
 *   hull     N^3 warped ones and, as target, one cell within a closed surface of 6 (N/2)^2 faces that reaches through them
 *   shell    the same surface as source
 *
 * Everything here is collective. Cells come in slabs. */
#ifndef BALANCE_H
#define BALANCE_H

#include "meshes.h"
#include "moments/moments.h"

#include <time.h>

/* What one rank has. */
typedef struct balance_work {
  double triangles, crossings, pairs, cells;
  double seconds[3]; /* user CPU of partition, overlay with triangulation, moments */
} balance_work;

typedef struct balance {
  rm_comm      comm;
  remap_status status;
  rm_reason    reason;
  balance_work here;
  double       piece_bytes, overlay_bytes; /* of this rank: cells that came; what the overlay makes of them */
} balance;

/* Crossings and triangles, which cost about the same each. */
static inline double balance_cost(const balance_work *w) { return w->crossings + w->triangles; }

static inline double balance_cpu_(void)
{
  struct timespec t;

  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* x in 0..1 to 0..1, so that equal steps become a thousand times longer at the far end; axes with a bit in `turned` the other
 * way. */
typedef struct balance_grading {
  int        axes, turned;
  tm_warping warp; /* before that */
} balance_grading;
static inline void balance_grade_(double xyz[3], const void *data)
{
  const balance_grading *g = data;

  tm_warp(xyz, &g->warp);
  for (int a = 0; a < 3; a++) {
    const bool   turned = g->turned >> a & 1;
    const double x = turned ? 1 - xyz[a] : xyz[a], y = expm1(log(1000) * x) / 999;

    if (g->axes >> a & 1) xyz[a] = turned ? 1 - y : y;
  }
}

/* The unit cube to a pyramid without its tip, heights from 0.001 to 1: equal steps of x are equal factors. data is a
 * tm_warping. */
static inline void balance_pyramid_(double xyz[3], const void *data)
{
  tm_warp(xyz, data);
  xyz[0] = pow(1000, xyz[0] - 1);
  for (int a = 1; a < 3; a++) xyz[a] = (xyz[a] - 0.5) * xyz[0];
}

static inline tm_mesh *balance_pyramid_of_(int n, double phase)
{
  return tm_hexahedra((int[]){7 * n, n, n}, balance_pyramid_, &(tm_warping){0.01, phase});
}

static inline void balance_ball_(double xyz[3], const void *data)
{
  double p[3], most = 0, length = 0;

  (void)data;
  for (int a = 0; a < 3; a++) {
    p[a] = 2 * xyz[a] - 1;
    most = fmax(most, fabs(p[a]));
    length += p[a] * p[a];
  }
  for (int a = 0; a < 3; a++) xyz[a] = 0.5 + (length > 0 ? 0.45 * p[a] * most / sqrt(length) : 0);
}

static inline tm_mesh *balance_stretched_(int n, int axes, int turned, double phase)
{
  return tm_hexahedra((int[]){n, n, n}, balance_grade_, &(balance_grading){axes, turned, {0.02, phase}});
}

static inline tm_mesh *balance_warped_(int n, double phase)
{
  return tm_hexahedra((int[]){n, n, n}, tm_warp, &(tm_warping){0.03, phase});
}

/* The meshes of a case; false if there is none of that name. */
static inline bool balance_meshes(const char *name, int n, tm_mesh *mesh[2])
{
  static const double around[12] = {1.2, 0, 0, -.1, 0, 1.2, 0, -.1, 0, 0, 1.2, -.1}, c = 0.8660254, s = 0.5;
  const double        turn[12] = {1, 0, 0, 0, 0, c, -s, 0, 0, s, c, 0};

  if (!strcmp(name, "even")) {
    mesh[0] = balance_warped_(n, 0.7), mesh[1] = balance_warped_(n + 1, 0.1);
  } else if (!strcmp(name, "graded")) {
    mesh[0] = balance_pyramid_of_(n / 2, 0.7), mesh[1] = balance_pyramid_of_(n / 2 + 1, 0.1);
  } else if (!strcmp(name, "stretched") || !strcmp(name, "facing")) {
    mesh[0] = balance_stretched_(n, 7, 0, 0.7), mesh[1] = balance_stretched_(n + 1, 7, name[0] == 'f' ? 7 : 0, 0.1);
  } else if (!strcmp(name, "corner") || !strcmp(name, "layers")) {
    mesh[0] = balance_stretched_(n, name[0] == 'c' ? 7 : 4, 0, 0.7), mesh[1] = balance_warped_(n + 1, 0.1);
    for (int side = 0; side < 2 && name[0] == 'l'; side++) tm_move(mesh[side], tm_affine, turn);
  } else if (!strcmp(name, "target") || !strcmp(name, "source")) {
    const int one = name[0] == 't';
    mesh[1 - one] = balance_warped_(n, 0.7), mesh[one] = tm_hexahedra((int[]){1, 1, 1}, tm_affine, around);
  } else if (!strcmp(name, "hull") || !strcmp(name, "shell")) {
    const int one = name[0] == 'h', half = n > 1 ? n / 2 : 1;
    mesh[1 - one] = balance_warped_(n, 0.7), mesh[one] = tm_hull(tm_hexahedra((int[]){half, half, half}, balance_ball_, NULL));
  } else {
    return false;
  }
  return true;
}

/* What happens behind the partition. */
static inline remap_status balance_overlay_(balance *b, rm_arena *arena, const rm_frame *frame, const rm_part *part,
                                            remap_faces faces, const rm_moments **moments)
{
  const rm_trimesh *mesh[2];
  const rm_overlay *o = NULL;
  const double      start = balance_cpu_();

  for (int side = 0; side < 2; side++) RM_TRY(rm_trimesh_build(arena, frame, &part->piece[side], faces, &mesh[side]));
  RM_TRY(rm_overlay_build(arena, mesh, part, NULL, &o, &b->reason));
  const double middle = balance_cpu_();
  RM_TRY(rm_moments_build(arena, part, o, 1, moments));
  b->here.seconds[1] = middle - start;
  b->here.seconds[2] = balance_cpu_() - middle;
  b->here.triangles  = (double)mesh[0]->num_triangles + mesh[1]->num_triangles;
  b->here.crossings  = (double)(o->trace[0].num_crossings + o->trace[1].num_crossings);
  b->here.pairs      = (double)(*moments)->num_pairs;
  b->here.cells      = (double)part->piece[0].num_cells + part->piece[1].num_cells;
  return REMAP_OK;
}

static inline remap_status balance_run_(balance *b, rm_arena *arena[3], const remap_mesh view[2], remap_faces faces)
{
  const rm_mesh    *mesh[2];
  const rm_zone    *zone;
  const rm_part    *part;
  const rm_moments *moments;
  rm_frame          frame;

  RM_TRY(rm_frame_build(&b->comm, view, &frame, &b->reason));
  for (int side = 0; side < 2; side++)
    RM_TRY(rm_mesh_build(arena[0], &b->comm, (remap_side)side, &view[side], &frame, faces, &mesh[side], &b->reason));
  const double start = balance_cpu_();
  RM_TRY(rm_zone_build(arena[0], &b->comm, mesh, &zone));
  RM_TRY(rm_part_build(arena[1], &b->comm, &frame, mesh, zone, &part, &b->reason));
  b->here.seconds[0] = balance_cpu_() - start;
  RM_TRY(rm_comm_agree_reason(&b->comm, balance_overlay_(b, arena[2], &frame, part, faces, &moments), &b->reason));
  b->piece_bytes   = (double)rm_arena_bytes(arena[1]);
  b->overlay_bytes = (double)rm_arena_bytes(arena[2]);
  return REMAP_OK;
}

/* Overlay the meshes of a case on the ranks of comm. */
static inline void balance_open_on(balance *b, MPI_Comm comm, const char *name, int n, remap_faces faces)
{
  tm_mesh   *whole[2], *part[2];
  rm_arena  *arena[3] = {rm_arena_new(), rm_arena_new(), rm_arena_new()};
  remap_mesh view[2];

  memset(b, 0, sizeof *b);
  b->status = REMAP_BAD_ARGUMENT;
  if (!balance_meshes(name, n, whole)) abort();
  if (rm_comm_dup(comm, &b->comm) != REMAP_OK) abort();
  for (int side = 0; side < 2; side++) {
    int *deal  = tm_deal(whole[side], b->comm.size, TM_SLABS, 1);
    part[side] = tm_part(whole[side], deal, b->comm.rank, 0);
    view[side] = part[side]->view;
    tm_free(whole[side]);
    free(deal);
  }
  b->status = balance_run_(b, arena, view, faces);
  for (int side = 0; side < 2; side++) tm_free(part[side]);
  for (int k = 0; k < 3; k++) rm_arena_drop(arena[k]);
}

static inline void balance_close(balance *b) { rm_comm_free(&b->comm); }

/* The largest over the mean of a number per rank. Collective. */
static inline double balance_ratio(const balance *b, double mine)
{
  double most = mine, sum = mine;

  MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE, MPI_MAX, b->comm.mpi);
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, b->comm.mpi);
  return sum > 0 ? most * b->comm.size / sum : 1;
}

#endif
