/* bench -- what the programs that measure share: clocks, medians, memory in use, and pairs of meshes by name.
 *
 *   warped       N^3 warped hexahedra, rotated, inside (2N)^3 larger by two: those of overlay_floor.c
 *   general      N^3 warped hexahedra on (N+1)^3, warped differently: one target cell per source cell
 *   finer        likewise on (2N)^3
 *   identical    N^3 warped hexahedra on themselves          nested     N^3 boxes on (2N)^3
 *   shifted      N^3 boxes, half a cell apart                abutting   N^3 boxes beside N^3 boxes
 *   boxes        N^3 cubes, rotated and moved by rational numbers, inside (2N)^3 of that size: all faces exactly planar, the
 *                meshes in general position to each other
 *   tetrahedra   6 N^3, warped, rotated, inside 6 (2N)^3     dual       duals of such tetrahedra
 *   pancakes     as general, all 10^4 times thinner in z, rotated
 *   graded       as general, edges growing 1000 times along x, y and z
 *   layer        as general over a wavy wall, cells growing 10^4 times away from it
 *   surface      a ball of 8 N^2 triangles as one cell on 16^3 warped hexahedra    itself   that ball on itself
 *   cones        two cones of N^2 triangles each as one cell, on the same grid     wedges   N^2 wedges round one edge, likewise
 */
#ifndef BENCH_H
#define BENCH_H

#include <sys/resource.h>
#include <time.h>
#include "meshes.h"
#include "surfaces.h"

#define BENCH_CASES                                                                                                          \
  "warped|general|finer|identical|nested|shifted|abutting|boxes|tetrahedra|dual|pancakes|graded|layer|surface|itself|cones|" \
  "wedges"

/* ---- clocks ------------------------------------------------------------------------------------------------------ */

static inline double bench_clock_(clockid_t clock)
{
  struct timespec t;
  clock_gettime(clock, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Seconds of processor time of this process, and of wall clock. */
static inline double bench_cpu(void) { return bench_clock_(CLOCK_PROCESS_CPUTIME_ID); }
static inline double bench_wall(void) { return bench_clock_(CLOCK_MONOTONIC); }

static inline int bench_by_value_(const void *a, const void *b)
{
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* The middle one of n values, which it sorts. */
static inline double bench_median(double *x, int n)
{
  qsort(x, (size_t)n, sizeof *x, bench_by_value_);
  return x[n / 2];
}

/* Largest resident size of this process so far. */
static inline double bench_rss_bytes(void)
{
  struct rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return (double)usage.ru_maxrss * 1024;
}

/* ---- memory in use ------------------------------------------------------------------------------------------------ */

/* Programs built by remap_bench(... HEAP) count what they and the static library hold. */
#ifdef BENCH_HEAP
#include "heap.h"

/* Bytes held now, from where the peak is counted anew. */
static inline double bench_heap_start(void)
{
  heap.most = heap.held;
  return (double)heap.held;
}
/* Bytes held now, and the most since bench_heap_start. */
static inline double bench_heap_now(void) { return (double)heap.held; }
static inline double bench_heap_peak(void) { return (double)heap.most; }
#endif

/* ---- meshes ------------------------------------------------------------------------------------------------------- */

/* Centred, rotated about z and x, scaled: as overlay_floor.c does it. */
static inline tm_mesh *bench_placed_(tm_mesh *mesh, double angle, double scale)
{
  const double c = cos(angle), s = sin(angle);
  const double m[12] = {scale * c,     -scale * s,    0,          scale * (s - c) / 2,
                        scale * c * s, scale * c * c, -scale * s, -scale * (c * s + c * c - s) / 2,
                        scale * s * s, scale * s * c, scale * c,  -scale * (s * s + s * c + c) / 2};
  tm_move(mesh, tm_affine, m);
  return mesh;
}

/* Along each axis, lengths grow 1000 times. */
static inline void bench_grade_(double xyz[3], const void *data)
{
  (void)data;
  for (int d = 0; d < 3; d++) xyz[d] = (pow(1000, xyz[d]) - 1) / 999;
}

/* Heights above a wavy wall grow 10^4 times. */
static inline void bench_layer_(double xyz[3], const void *data)
{
  (void)data;
  xyz[2] = .1 * (pow(1e4, xyz[2]) - 1) / 9999 + .05 * sin(6 * xyz[0]) * sin(5 * xyz[1]);
}

static inline void bench_thin_(double xyz[3], const void *data)
{
  (void)data;
  xyz[2] *= 1e-4;
}

/* As tm_tetrahedra and tm_dual. */
typedef tm_mesh *bench_maker_(const int n[3], tm_map map, const void *data);

/* N^3 hexahedra on M^3, warped differently, then moved by a map (NULL: stay). */
static inline void bench_general_(int n, int m, tm_map map, tm_mesh *mesh[2])
{
  for (int side = 0; side < 2; side++) {
    const int size = side ? m : n;
    mesh[side] = tm_hexahedra((int[]){size, size, size}, tm_warp, &(tm_warping){.03, side ? .1 : .7});
    if (map) tm_move(mesh[side], map, NULL);
  }
}

/* Those of a cell of many triangles, or of many cells round an edge. */
static inline bool bench_surfaces_(const char *name, int n, tm_mesh *mesh[2])
{
  static const double middle[3] = {.1, .2, .3};

  if (!strcmp(name, "surface") || !strcmp(name, "itself")) mesh[0] = surfaces_ball(n, 1, middle);
  else if (!strcmp(name, "cones")) mesh[0] = surfaces_double_cone((int64_t)n * n);
  else if (!strcmp(name, "wedges")) mesh[0] = surfaces_wedges((int64_t)n * n);
  else return false;
  mesh[1] = name[0] == 'i' ? surfaces_ball(n, 1, middle) : tm_benchmark(16, .7, .3, 3);
  return true;
}

/* The meshes of a case; false if there is none of that name. The caller owns them: tm_free. */
static inline bool bench_meshes(const char *name, int n, tm_mesh *mesh[2])
{
  static const tm_warping first = {.03, .7}, second = {.03, .1};
  const int               fine[3] = {2 * n, 2 * n, 2 * n}, coarse[3] = {n, n, n};

  if (!strcmp(name, "warped")) {
    mesh[0] = tm_benchmark(n, .7, .3, .5), mesh[1] = tm_benchmark(2 * n, .1, 0, 1);
  } else if (!strcmp(name, "identical")) {
    for (int side = 0; side < 2; side++) mesh[side] = tm_hexahedra(coarse, tm_warp, &first);
  } else if (!strcmp(name, "nested")) {
    mesh[0] = tm_hexahedra(coarse, NULL, NULL), mesh[1] = tm_hexahedra(fine, NULL, NULL);
  } else if (!strcmp(name, "shifted") || !strcmp(name, "abutting")) {
    const bool   shifted = name[0] == 's';
    const double by = shifted ? .5 / n : 1, m[12] = {1, 0, 0, by, 0, 1, 0, shifted ? by : 0, 0, 0, 1, shifted ? by : 0};
    mesh[0] = tm_hexahedra(coarse, NULL, NULL), mesh[1] = tm_hexahedra(coarse, tm_affine, m);
  } else if (!strcmp(name, "boxes")) {
    mesh[0] = tm_hexahedra(coarse, tm_cube, &(tm_cubing){{n, n, n}, true});
    mesh[1] = tm_hexahedra(fine, tm_cube, &(tm_cubing){{2 * n, 2 * n, 2 * n}, false});
  } else if (!strcmp(name, "tetrahedra") || !strcmp(name, "dual")) {
    bench_maker_ *make = name[0] == 't' ? tm_tetrahedra : tm_dual;
    mesh[0] = bench_placed_(make(coarse, tm_warp, &first), .3, .5), mesh[1] = bench_placed_(make(fine, tm_warp, &second), 0, 1);
  } else if (!strcmp(name, "general") || !strcmp(name, "finer")) {
    bench_general_(n, name[0] == 'g' ? n + 1 : 2 * n, NULL, mesh);
  } else if (!strcmp(name, "pancakes")) {
    bench_general_(n, n + 1, bench_thin_, mesh);
    for (int side = 0; side < 2; side++) bench_placed_(mesh[side], .3, 1);
  } else if (!strcmp(name, "graded") || !strcmp(name, "layer")) {
    bench_general_(n, n + 1, name[0] == 'g' ? bench_grade_ : bench_layer_, mesh);
  } else {
    return bench_surfaces_(name, n, mesh);
  }
  return true;
}

/* REMAP_FACES_ of the word centre or diagonal; -1 for another. */
static inline int bench_faces(const char *word)
{
  return !strcmp(word, "centre") ? REMAP_FACES_CENTRE : !strcmp(word, "diagonal") ? REMAP_FACES_DIAGONAL : -1;
}

#endif
