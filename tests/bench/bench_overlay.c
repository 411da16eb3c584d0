/* bench_overlay -- time of the overlay (crossings, segments, volumes and first moments of triangulated meshes in memory, one rank)
 * on the meshes of DESIGN section 6 and on those where every face coincides. One JSON line; microseconds of user CPU per cell of
 * mesh 1 and per pair, medians.
 *
 *   bench_overlay CASE N diagonal|centre [REPEATS]
 *
 *   warped       N^3 warped hexahedra, rotated, inside (2N)^3 larger by two: those of overlay_floor.c
 *   identical    N^3 warped hexahedra on themselves          nested     N^3 boxes on (2N)^3
 *   shifted      N^3 boxes, half a cell apart                abutting   N^3 boxes beside N^3 boxes
 *   boxes        N^3 boxes, rotated, inside (2N)^3           tetrahedra 6 N^3, warped, rotated, inside 6 (2N)^3
 *   dual         duals of such tetrahedra                    pancakes   N^3 warped hexahedra on (N+1)^3, all 10^4 times thinner in z, rotated */
#include <time.h>
#include "laid.h"

static double cpu_seconds(void)
{
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Centred, rotated about z and x, scaled: as overlay_floor.c does it. */
static tm_mesh *placed(tm_mesh *mesh, double angle, double scale)
{
  const double c = cos(angle), s = sin(angle);
  const double m[12] = {scale * c,     -scale * s,    0,          scale * (s - c) / 2,
                        scale * c * s, scale * c * c, -scale * s, -scale * (c * s + c * c - s) / 2,
                        scale * s * s, scale * s * c, scale * c,  -scale * (s * s + s * c + c) / 2};
  tm_move(mesh, tm_affine, m);
  return mesh;
}

typedef tm_mesh *maker(const int n[3], tm_map map, const void *data);

static bool make_meshes(const char *name, int n, tm_mesh *mesh[2])
{
  static const tm_warping first = {0.03, 0.7}, second = {0.03, 0.1};
  const int fine[3] = {2 * n, 2 * n, 2 * n}, coarse[3] = {n, n, n}, next[3] = {n + 1, n + 1, n + 1};

  if (!strcmp(name, "warped")) {
    mesh[0] = tm_benchmark(n, 0.7, 0.3, 0.5), mesh[1] = tm_benchmark(2 * n, 0.1, 0, 1);
  } else if (!strcmp(name, "identical")) {
    for (int side = 0; side < 2; side++) mesh[side] = tm_hexahedra(coarse, tm_warp, &first);
  } else if (!strcmp(name, "nested")) {
    mesh[0] = tm_hexahedra(coarse, NULL, NULL), mesh[1] = tm_hexahedra(fine, NULL, NULL);
  } else if (!strcmp(name, "shifted") || !strcmp(name, "abutting")) {
    const double by = name[0] == 's' ? 0.5 / n : 1, m[12] = {1, 0, 0, by, 0, 1, 0, name[0] == 's' ? by : 0, 0, 0, 1, name[0] == 's' ? by : 0};
    mesh[0] = tm_hexahedra(coarse, NULL, NULL), mesh[1] = tm_hexahedra(coarse, tm_affine, m);
  } else if (!strcmp(name, "boxes")) {
    mesh[0] = placed(tm_hexahedra(coarse, NULL, NULL), 0.3, 0.5), mesh[1] = placed(tm_hexahedra(fine, NULL, NULL), 0, 1);
  } else if (!strcmp(name, "tetrahedra") || !strcmp(name, "dual")) {
    maker *make = name[0] == 't' ? tm_tetrahedra : tm_dual;
    mesh[0] = placed(make(coarse, tm_warp, &first), 0.3, 0.5), mesh[1] = placed(make(fine, tm_warp, &second), 0, 1);
  } else if (!strcmp(name, "pancakes")) {
    const double thin[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1e-4, 0};
    mesh[0] = tm_hexahedra(coarse, tm_warp, &first), mesh[1] = tm_hexahedra(next, tm_warp, &second);
    for (int side = 0; side < 2; side++) tm_move(mesh[side], tm_affine, thin), placed(mesh[side], 0.3, 1);
  } else {
    return false;
  }
  return true;
}

static int by_value(const void *a, const void *b)
{
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}
static double median(double *x, int n)
{
  qsort(x, (size_t)n, sizeof *x, by_value);
  return x[n / 2];
}

int main(int argc, char **argv)
{
  const int         repeats = argc > 4 ? atoi(argv[4]) : 1;
  const remap_faces faces   = argc > 3 && !strcmp(argv[3], "centre") ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL;
  tm_mesh          *mesh[2];

  if (argc < 4 || atoi(argv[2]) < 1 || repeats < 1 || !make_meshes(argv[1], atoi(argv[2]), mesh))
    return fprintf(stderr, "usage: bench_overlay warped|identical|nested|shifted|abutting|boxes|tetrahedra|dual|pancakes N diagonal|centre [REPEATS]\n"), 2;

  laid   *l     = laid_over(mesh[0], mesh[1], faces, NULL);
  double *trace = tm_alloc_(3 * repeats, sizeof *trace), *sum = trace + repeats, *triangulate = sum + repeats;
  size_t  bytes = 0;

  for (int r = 0; r < repeats && l->status == REMAP_OK; r++) {
    rm_arena         *arena = rm_arena_new();
    const rm_trimesh *again[2];
    const rm_overlay *o;
    const rm_moments *m;
    const double      t0 = cpu_seconds();

    for (int side = 0; side < 2 && l->status == REMAP_OK; side++)
      l->status = rm_trimesh_build(arena, &l->frame, &l->part.piece[side], faces, &again[side]);
    const double t1 = cpu_seconds();
    if (l->status == REMAP_OK) l->status = rm_overlay_build(arena, again, &l->part, NULL, &o, &l->reason);
    const double t2 = cpu_seconds();
    if (l->status == REMAP_OK) l->status = rm_moments_build(arena, &l->part, o, 1, &m);
    const double t3 = cpu_seconds();
    triangulate[r] = t1 - t0, trace[r] = t2 - t1, sum[r] = t3 - t2;
    bytes = rm_arena_bytes(arena);
    rm_arena_drop(arena);
  }
  if (l->status != REMAP_OK) return fprintf(stderr, "%s: %s\n", remap_status_text(l->status), l->reason.text), 1;

  const double  cells = l->part.piece[0].num_cells, pairs = (double)l->moments->num_pairs;
  const int64_t crossings = l->overlay->trace[0].num_crossings + l->overlay->trace[1].num_crossings;
  const double  us_trace = 1e6 * median(trace, repeats), us_sum = 1e6 * median(sum, repeats);
  printf("{\"bench\":\"overlay\",\"case\":\"%s\",\"faces\":\"%s\",\"cells\":[%d,%d],\"crossings\":%lld,\"pairs\":%.0f,\"us_crossings_segments\":%.2f,"
         "\"us_moments\":%.2f,\"us_overlay\":%.2f,\"us_per_pair\":%.2f,\"us_triangulation\":%.2f,\"bytes\":%.0f}\n",
         argv[1], argv[3], l->part.piece[0].num_cells, l->part.piece[1].num_cells, (long long)crossings, pairs, us_trace / cells, us_sum / cells,
         (us_trace + us_sum) / cells, pairs > 0 ? (us_trace + us_sum) / pairs : 0, 1e6 * median(triangulate, repeats) / cells, (double)bytes / cells);
  laid_free(l);
  tm_free(mesh[0]), tm_free(mesh[1]);
  free(trace);
  return 0;
}
