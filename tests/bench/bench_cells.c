/* bench_cells -- time and memory of the explicit supermesh (crossings, segments, then cells, faces, ancestors) on the warped
 * hexahedra of DESIGN section 6: mesh 1 is N^3, rotated by 0.3 about z and x and scaled by SCALE, mesh 2 is NB^3. ANGLE 0 with
 * SCALE 1 and PHASE as of mesh 2, 0.1, gives identical meshes where N is NB. One JSON line.
 *
 *   bench_cells N NB SCALE diagonal|centre [REPEATS [ANGLE [PHASE]]]      room cells alone
 *   bench_cells all N NB SCALE diagonal|centre [ANGLE [PHASE]]             remap_supermesh, from the meshes as lent, union
 *   bench_cells all spheres LEVEL [OFFSET]                                 the same of two closed surfaces, intersection
 *   bench_cells spheres LEVEL OFFSET [REPEATS]    two closed surfaces of 20 4^LEVEL triangles each, one moved by OFFSET radii
 *   bench_cells cut LEVEL [REPEATS]               one such surface in a grid of 32 x 40 x 23 boxes */
#include <mpi.h>
#include <stdio.h>
#include "cells/cells.h"
#include "bench.h"
#include "laid.h"

/* ---- closed surfaces --------------------------------------------------------------------------------------------- */

typedef struct soup {
  tm_mesh *mesh;
  int64_t  num;
  double   shift;
} soup;

static void midpoint(const double a[3], const double b[3], double out[3])
{
  double length = 0;

  for (int c = 0; c < 3; c++) out[c] = a[c] + b[c], length += out[c] * out[c];
  for (int c = 0; c < 3; c++) out[c] /= sqrt(length);
}

static void divide(soup *s, int level, const double a[3], const double b[3], const double c[3])
{
  double ab[3], bc[3], ca[3];

  if (level == 0) {
    const double *p[3] = {a, b, c};
    for (int h = 0; h < 3; h++) {
      for (int d = 0; d < 3; d++) s->mesh->xyz[9 * s->num + 3 * h + d] = .4 * p[h][d] + s->shift * (d + 1) / 3;
      s->mesh->face_node[3 * s->num + h] = 3 * s->num + h;
    }
    s->mesh->face_offset[s->num + 1] = 3 * (s->num + 1);
    s->mesh->owner[s->num]           = 0;
    s->mesh->neighbour[s->num++]     = -1;
    return;
  }
  midpoint(a, b, ab), midpoint(b, c, bc), midpoint(c, a, ca);
  divide(s, level - 1, a, ab, ca);
  divide(s, level - 1, b, bc, ab);
  divide(s, level - 1, c, ca, bc);
  divide(s, level - 1, ab, bc, ca);
}

/* A sphere of radius 0.4 as one cell: an icosahedron, divided. */
static tm_mesh *sphere(int level, double shift)
{
  static const int face[20][3] = {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                                  {11, 10, 2}, {10, 7, 6}, {7, 1, 8}, {3, 9, 4}, {3, 4, 2}, {3, 2, 6}, {3, 6, 8},
                                  {3, 8, 9}, {4, 9, 5}, {2, 4, 11}, {6, 2, 10}, {8, 6, 7}, {9, 8, 1}};
  const int64_t    n = 20 * ((int64_t)1 << 2 * level);
  const double     g = (1 + sqrt(5)) / 2, l = sqrt(1 + g * g), x = 1 / l, y = g / l;
  const double     corner[12][3] = {{-x, y, 0}, {x, y, 0}, {-x, -y, 0}, {x, -y, 0}, {0, -x, y}, {0, x, y},
                                    {0, -x, -y}, {0, x, -y}, {y, 0, -x}, {y, 0, x}, {-y, 0, -x}, {-y, 0, x}};
  soup             s = {tm_new_(3 * n, n, 3 * n, 1), 0, shift};

  for (int f = 0; f < 20; f++) divide(&s, level, corner[face[f][0]], corner[face[f][1]], corner[face[f][2]]);
  return s.mesh;
}

static void box_of_grid(double xyz[3], const void *data)
{
  (void)data;
  for (int c = 0; c < 3; c++) xyz[c] = 1.1 * xyz[c] - .55;
}

/* Pieces of both meshes, triangulated: laid_over without the overlay. */
static laid *lay(const tm_mesh *source, const tm_mesh *target, remap_faces faces)
{
  static const laid_how plain = {{NULL, NULL}, 0, 0, 0};
  const tm_mesh *const  whole[2] = {source, target};
  laid                 *l = tm_alloc_(1, sizeof *l);

  l->arena = rm_arena_new();
  l->frame = laid_frame_(whole);
  for (int side = 0; side < 2 && l->status == REMAP_OK; side++) {
    laid_piece_(l, whole[side], side, &plain);
    l->status = rm_trimesh_build(l->arena, &l->frame, &l->part.piece[side], faces, &l->mesh[side]);
    const rm_trimesh_home home = {l->arena, l->arena, l->arena};
    if (l->status == REMAP_OK) l->status = rm_cells_mesh(&home, &l->frame, l->mesh[side], &l->mesh[side]);
  }
  return l;
}

static void run(const char *name, tm_mesh *source, tm_mesh *target, remap_faces faces, int repeats)
{
  const rm_cells_choice all = {.keep = REMAP_IN_BOTH | REMAP_IN_SOURCE | REMAP_IN_TARGET};
  laid        *l       = lay(source, target, faces);
  double       overlay = INFINITY, build = INFINITY;
  const double held    = bench_heap_start();

  if (l->status != REMAP_OK) fprintf(stderr, "%s\n", l->reason.text), exit(1);
  for (int r = 0; r < repeats; r++) {
    rm_arena         *arena = rm_arena_new();
    rm_cells_passing  passing = {.overlay = rm_arena_new()};
    const rm_overlay *o     = NULL;
    const rm_cells   *cells = NULL;
    const double      t0    = bench_cpu();
    remap_status      status = rm_overlay_build(passing.overlay, l->mesh, &l->part, NULL, &o, &l->reason);
    const double      t1     = bench_cpu();

    if (status == REMAP_OK) status = rm_cells_build(arena, &l->part, o, &passing, &all, &cells, &l->reason);
    const double t2 = bench_cpu();
    if (status != REMAP_OK) fprintf(stderr, "%d %s\n", (int)status, l->reason.text), exit(1);
    overlay = fmin(overlay, t1 - t0);
    build   = fmin(build, t2 - t1);
    if (r == repeats - 1)
      printf("{\"bench\":\"cells\",\"case\":\"%s\",\"cells\":[%d,%d],\"triangles\":[%d,%d],\"maph\":%d,\"maph_faces\":%d,"
             "\"vertices\":%d,\"s_overlay\":%.3f,\"s_cells\":%.3f,\"us_per_maph\":%.2f,\"bytes_result_per_maph\":%.0f,"
             "\"bytes_peak_per_maph\":%.0f}\n",
             name, l->mesh[0]->num_cells, l->mesh[1]->num_cells, l->mesh[0]->num_triangles, l->mesh[1]->num_triangles,
             cells->num_cells, cells->num_faces, cells->num_vertices, overlay, build,
             1e6 * (overlay + build) / cells->num_cells, (double)rm_arena_bytes(arena) / cells->num_cells,
             (bench_heap_peak() - held) / cells->num_cells);
    rm_arena_drop(arena);
    rm_arena_drop(passing.overlay);
  }
  laid_free(l);
  tm_free(source);
  tm_free(target);
}

static uint64_t hash_words(uint64_t hash, const void *data, size_t bytes)
{
  for (size_t k = 0; k + 4 <= bytes; k += 4) {
    uint32_t word;
    memcpy(&word, (const char *)data + k, 4);
    hash = rm_hash_word(hash ^ word);
  }
  return hash;
}

/* Of the bits of all that a view hands out. */
static uint64_t hash_of(const remap_supermesh_view *v)
{
  const size_t   nodes = (size_t)v->num_nodes, faces = (size_t)v->num_faces, cells = (size_t)v->num_cells;
  const size_t   corners = (size_t)v->face_offset[faces];
  const struct { const void *data; size_t bytes; } array[] = {
      {v->node_xyz, 24 * nodes}, {v->node_global, 8 * nodes}, {v->face_offset, 8 * faces}, {v->face_node, 4 * corners},
      {v->face_owner, 4 * faces}, {v->face_neighbour, 4 * faces}, {v->face_global, 8 * faces}, {v->face_from[0], 4 * faces},
      {v->face_from[1], 4 * faces}, {v->cell_global, 8 * cells}, {v->cell_ancestor[0], 8 * cells},
      {v->cell_ancestor[1], 8 * cells}, {v->cell_volume, 8 * cells}};
  uint64_t hash = 0;

  for (size_t k = 0; k < sizeof array / sizeof *array; k++) hash = hash_words(hash, array[k].data, array[k].bytes);
  return hash;
}

/* remap_supermesh on all ranks; the meshes are dealt in slabs. */
static void run_all(tm_mesh *source, tm_mesh *target, remap_faces faces, int keep)
{
  const remap_supermesh_options all = {.keep = keep, .pass_through = 1};
  tm_mesh             *whole[2] = {source, target}, *mine[2];
  remap_context       *ctx;
  remap_options        how;
  remap_supermesh_view v;
  int                  rank, size;

  MPI_Comm_rank(MPI_COMM_WORLD, &rank), MPI_Comm_size(MPI_COMM_WORLD, &size);
  remap_options_default(&how);
  how.faces = faces;
  if (remap_create(MPI_COMM_WORLD, &how, &ctx) != REMAP_OK) exit(1);
  for (int side = 0; side < 2; side++) {
    int *deal  = tm_deal(whole[side], size, TM_SLABS, 1);
    mine[side] = tm_part(whole[side], deal, rank, 0);
    remap_set_mesh(ctx, side, &mine[side]->view);
    tm_free(whole[side]), free(deal);
  }
  const double held = bench_heap_start(), t0 = bench_cpu();
  if (remap_supermesh(ctx, &all, &v) != REMAP_OK) fprintf(stderr, "%s\n", remap_message(ctx)), exit(1);
  const double t1 = bench_cpu();
  printf("{\"bench\":\"supermesh\",\"rank\":%d,\"ranks\":%d,\"maph\":%lld,\"maph_here\":%lld,\"faces\":%lld,\"nodes\":%lld,"
         "\"us_per_maph\":%.2f,\"bytes_peak_per_maph\":%.0f,\"bytes_held_per_maph\":%.0f,"
         "\"s_partition\":%.3f,\"s_triangulation\":%.3f,\"s_crossings\":%.3f,"
         "\"s_polygons\":%.3f,\"s_cells\":%.3f,\"s_faces\":%.3f,\"s_numbering\":%.3f,\"s_user\":%.3f,\"hash\":\"%016llx\"}\n",
         rank, size, (long long)v.global_cells, (long long)v.num_cells, (long long)v.num_faces, (long long)v.num_nodes,
         1e6 * (t1 - t0) / (double)v.num_cells, (bench_heap_peak() - held) / (double)v.num_cells,
         (bench_heap_now() - held) / (double)v.num_cells, v.seconds_partition,
         v.seconds_triangulation, v.seconds_crossings, v.seconds_polygons, v.seconds_cells, v.seconds_faces,
         v.seconds_numbering, t1 - t0, (unsigned long long)hash_of(&v));
  remap_destroy(&ctx);
  for (int side = 0; side < 2; side++) tm_free(mine[side]);
}

int main(int argc, char **argv)
{
  if (argc > 3 && !strcmp(argv[1], "all")) {
    const bool spheres = !strcmp(argv[2], "spheres");
    MPI_Init(&argc, &argv);
    if (spheres)
      run_all(sphere(atoi(argv[3]), 0), sphere(atoi(argv[3]), argc > 4 ? atof(argv[4]) : .1), REMAP_FACES_DIAGONAL,
              REMAP_IN_BOTH);
    else if (argc > 5)
      run_all(tm_benchmark(atoi(argv[2]), argc > 7 ? atof(argv[7]) : 0.7, argc > 6 ? atof(argv[6]) : 0.3, atof(argv[4])),
              tm_benchmark(atoi(argv[3]), 0.1, 0, 1), strcmp(argv[5], "centre") ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE,
              REMAP_IN_BOTH | REMAP_IN_SOURCE | REMAP_IN_TARGET);
    MPI_Finalize();
    return 0;
  }
  if (argc > 3 && !strcmp(argv[1], "spheres")) {
    run("spheres", sphere(atoi(argv[2]), 0), sphere(atoi(argv[2]), atof(argv[3])), REMAP_FACES_DIAGONAL,
        argc > 4 ? atoi(argv[4]) : 1);
  } else if (argc > 2 && !strcmp(argv[1], "cut")) {
    run("cut", tm_hexahedra((int[]){32, 40, 23}, box_of_grid, NULL), sphere(atoi(argv[2]), 0), REMAP_FACES_DIAGONAL,
        argc > 3 ? atoi(argv[3]) : 1);
  } else if (argc > 4) {
    run(argv[4], tm_benchmark(atoi(argv[1]), argc > 7 ? atof(argv[7]) : 0.7, argc > 6 ? atof(argv[6]) : 0.3, atof(argv[3])),
        tm_benchmark(atoi(argv[2]), 0.1, 0, 1), strcmp(argv[4], "centre") ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE,
        argc > 5 ? atoi(argv[5]) : 1);
  } else {
    return fprintf(stderr,
                   "usage: bench_cells N NB SCALE diagonal|centre [REPEATS [ANGLE [PHASE]]] | spheres LEVEL OFFSET [REPEATS] "
                   "| cut LEVEL [REPEATS]\n"),
           2;
  }
  return 0;
}
