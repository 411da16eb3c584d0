/* bench_cells -- time and memory of the explicit supermesh (crossings, segments, then cells, faces, ancestors) on the warped
 * hexahedra of DESIGN section 6: mesh 1 is N^3, rotated by 0.3 about z and x and scaled by SCALE, mesh 2 is NB^3. ANGLE 0 with
 * SCALE 1 and PHASE as of mesh 2, 0.1, gives identical meshes where N is NB. One JSON line.
 *
 *   bench_cells N NB SCALE diagonal|centre [REPEATS [ANGLE [PHASE]]] */
#include <stdio.h>
#include <sys/resource.h>
#include <time.h>
#include "cells/cells.h"
#include "laid.h"

static double cpu_seconds(void)
{
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double peak_bytes(void)
{
  struct rusage use;
  getrusage(RUSAGE_SELF, &use);
  return 1024.0 * (double)use.ru_maxrss;
}

int main(int argc, char **argv)
{
  if (argc < 5) return fprintf(stderr, "usage: bench_cells N NB SCALE diagonal|centre [REPEATS [ANGLE [PHASE]]]\n"), 2;
  const int         repeats = argc > 5 ? atoi(argv[5]) : 1;
  const remap_faces faces   = strcmp(argv[4], "centre") ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE;
  tm_mesh          *source  = tm_benchmark(atoi(argv[1]), argc > 7 ? atof(argv[7]) : 0.7, argc > 6 ? atof(argv[6]) : 0.3, atof(argv[3]));
  tm_mesh          *target  = tm_benchmark(atoi(argv[2]), 0.1, 0, 1);
  laid             *l       = laid_over(source, target, faces, NULL);
  double            overlay = INFINITY, build = INFINITY;
  const double      before  = peak_bytes();

  if (l->status != REMAP_OK) return fprintf(stderr, "%s\n", l->reason.text), 1;
  for (int r = 0; r < repeats; r++) {
    rm_arena         *arena = rm_arena_new();
    const rm_overlay *o     = NULL;
    const rm_cells   *cells = NULL;
    const double      t0    = cpu_seconds();
    remap_status      status = rm_overlay_build(arena, l->mesh, &l->part, NULL, &o, &l->reason);
    const double      t1     = cpu_seconds();

    if (status == REMAP_OK) status = rm_cells_build(arena, &l->part, o, RM_CELLS_UNION, &cells, &l->reason);
    const double t2 = cpu_seconds();
    if (status != REMAP_OK) return fprintf(stderr, "%d %s\n", (int)status, l->reason.text), 1;
    overlay = fmin(overlay, t1 - t0);
    build   = fmin(build, t2 - t1);
    if (r == repeats - 1)
      printf("{\"bench\":\"cells\",\"faces\":\"%s\",\"cells\":[%d,%d],\"maph\":%d,\"maph_faces\":%d,\"vertices\":%d,\"us_overlay\":%.2f,"
             "\"us_cells\":%.2f,\"us_per_maph\":%.2f,\"bytes_result_per_maph\":%.0f,\"bytes_peak_per_maph\":%.0f}\n",
             argv[4], l->mesh[0]->num_cells, l->mesh[1]->num_cells, cells->num_cells, cells->num_faces, cells->num_vertices,
             1e6 * overlay / cells->num_cells, 1e6 * build / cells->num_cells, 1e6 * (overlay + build) / cells->num_cells,
             (double)rm_arena_bytes(arena) / cells->num_cells, (peak_bytes() - before) / cells->num_cells);
    rm_arena_drop(arena);
  }
  laid_free(l);
  tm_free(source);
  tm_free(target);
  return 0;
}
