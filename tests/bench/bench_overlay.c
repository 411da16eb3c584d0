/* bench_overlay -- time of the overlay (crossings, segments, volumes and first moments of triangulated meshes in memory) on the
 * warped hexahedra of DESIGN section 6: mesh 1 is N^3, rotated by 0.3 about z and x and scaled by SCALE, and lies inside mesh 2
 * of NB^3. One JSON line.
 *
 *   bench_overlay N NB SCALE diagonal|centre [REPEATS] */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "moments/moments.h"

static double cpu_seconds(void)
{
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *get(rm_arena *arena, int64_t n, size_t size)
{
  void *p = rm_arena_zero(arena, n, size);
  if (!p) exit(7);
  return p;
}

typedef struct grid {
  int n;
} grid;
static rm_lid node_at(grid g, int i, int j, int k) { return (k * (g.n + 1) + j) * (g.n + 1) + i; }
static rm_lid cell_at(grid g, int i, int j, int k) { return i < 0 || j < 0 || k < 0 || i >= g.n || j >= g.n || k >= g.n ? -1 : (k * g.n + j) * g.n + i; }

static rm_piece make_piece(rm_arena *arena, int n, double phase, double angle, double scale)
{
  const grid   g  = {n};
  const rm_lid n1 = n + 1, nodes = n1 * n1 * n1, faces = 3 * n * n * n1, cells = n * n * n;
  const double c = cos(angle), s = sin(angle), w = 2 * M_PI;
  double     (*xyz)[3]   = get(arena, nodes, sizeof *xyz);
  int64_t     *offset    = get(arena, faces + 1, sizeof *offset);
  rm_lid      *face_node = get(arena, 4 * (int64_t)faces, sizeof *face_node);
  rm_lid     (*cell)[2]  = get(arena, faces, sizeof *cell);
  uint8_t     *skin      = get(arena, faces, 1);
  rm_lid       f         = 0;

  for (int k = 0; k < n1; k++)
    for (int j = 0; j < n1; j++)
      for (int i = 0; i < n1; i++) {
        const double x = (double)i / n, y = (double)j / n, z = (double)k / n;
        const double q    = 0.03 * sin(w * x + phase) * sin(w * y + phase) * sin(w * z + phase);
        const double p[3] = {x + q - .5, y + .7 * q - .5, z - .9 * q - .5}, r[3] = {c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]};
        double      *out = xyz[node_at(g, i, j, k)];
        out[0] = scale * r[0], out[1] = scale * (c * r[1] - s * r[2]), out[2] = scale * (s * r[1] + c * r[2]);
      }
  for (int d = 0; d < 3; d++)
    for (int k = 0; k < n + (d == 2); k++)
      for (int j = 0; j < n + (d == 1); j++)
        for (int i = 0; i < n + (d == 0); i++, f++) {
          const int    a[3] = {d == 2, d == 0, d == 1}, b[3] = {d == 1, d == 2, d == 0}; /* the face's two directions: normal along d */
          const rm_lid low = cell_at(g, i - (d == 0), j - (d == 1), k - (d == 2)), high = cell_at(g, i, j, k);
          rm_lid       q[4] = {node_at(g, i, j, k), node_at(g, i + a[0], j + a[1], k + a[2]),
                               node_at(g, i + a[0] + b[0], j + a[1] + b[1], k + a[2] + b[2]), node_at(g, i + b[0], j + b[1], k + b[2])};
          for (int h = 0; h < 4; h++) face_node[4 * f + h] = q[low < 0 ? 3 - h : h];
          cell[f][0] = low < 0 ? high : low;
          cell[f][1] = low < 0 ? -1 : high;
          skin[f]    = low < 0 || high < 0;
          offset[f + 1] = 4 * ((int64_t)f + 1);
        }
  rm_gid *global = get(arena, cells, sizeof *global);
  rm_lid *home   = get(arena, cells, sizeof *home);
  int    *rank   = get(arena, cells, sizeof *rank);
  double *volume = get(arena, cells, sizeof *volume);
  double (*centroid)[3] = get(arena, cells, sizeof *centroid);
  for (rm_lid i = 0; i < cells; i++) global[i] = home[i] = i, volume[i] = scale * scale * scale / cells;
  return (rm_piece){nodes, faces, cells, (const double (*)[3])xyz, offset, face_node, (const rm_lid (*)[2])cell, skin, global, rank,
                    home, volume, (const double (*)[3])centroid};
}

static double triangulated_volume(const rm_trimesh *m, rm_lid c)
{
  double v = 0;
  for (rm_lid a = m->cell_triangle_offset[c]; a < m->cell_triangle_offset[c + 1]; a++) {
    const rm_lid *t = m->triangle[m->cell_triangle[a] / 2];
    const rm_dd   d = rm_det_dd(m->vertex[m->cell_vertex[m->cell_vertex_offset[c]]], m->vertex[t[0]], m->vertex[t[1]], m->vertex[t[2]]);
    v += m->cell_triangle[a] & 1 ? -d.hi : d.hi;
  }
  return v / 6;
}

static int by_value(const void *a, const void *b)
{
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

int main(int argc, char **argv)
{
  if (argc < 5) return fprintf(stderr, "usage: bench_overlay N NB SCALE diagonal|centre [REPEATS]\n"), 2;
  const int         repeats = argc > 5 ? atoi(argv[5]) : 1;
  const remap_faces faces   = strcmp(argv[4], "centre") ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE;
  const rm_frame    frame   = {1, {-1, -1, -1, 1, 1, 1}};
  rm_arena         *arena   = rm_arena_new();
  rm_part           part;
  const rm_trimesh *mesh[2];
  double           *time = get(arena, 3 * (int64_t)repeats, sizeof *time), *total = time + repeats, *tracing = total + repeats;

  part.piece[0] = make_piece(arena, atoi(argv[1]), 0.7, 0.3, atof(argv[3]));
  part.piece[1] = make_piece(arena, atoi(argv[2]), 0.1, 0, 1);
  for (int r = 0; r < repeats; r++) {
    rm_arena         *a = rm_arena_new();
    const rm_overlay *o = NULL;
    const rm_moments *m = NULL;
    rm_reason         reason = {0};
    remap_status      status = REMAP_OK;
    const double      t0     = cpu_seconds();

    for (int side = 0; side < 2 && status == REMAP_OK; side++) status = rm_trimesh_build(a, &frame, &part.piece[side], faces, &mesh[side]);
    const double t1 = cpu_seconds();
    if (status == REMAP_OK) status = rm_overlay_build(a, mesh, &part, NULL, &o, &reason);
    const double t2 = cpu_seconds();
    if (status == REMAP_OK) status = rm_moments_build(a, &part, o, 1, &m);
    const double t3 = cpu_seconds();
    if (status != REMAP_OK) return fprintf(stderr, "%s %s\n", remap_status_text(status), reason.text), 1;
    time[r] = t3 - t1, total[r] = t3 - t0, tracing[r] = t2 - t1;
    if (r == repeats - 1) {
      const rm_lid n   = part.piece[0].num_cells;
      double      *row = get(a, n, sizeof *row), worst = 0;
      rm_lid       by_tree = 0;
      for (int64_t k = 0; k < m->num_pairs; k++) row[m->source[k]] += m->volume[k];
      for (rm_lid i = 0; i < n; i++) worst = fmax(worst, fabs(row[i] / triangulated_volume(mesh[0], i) - 1));
      for (int s = 0; s < 2; s++) for (rm_lid i = 0; i < mesh[s]->num_cells; i++) by_tree += mesh[s]->cell_by_tree[i];
      qsort(time, (size_t)repeats, sizeof *time, by_value);
      qsort(total, (size_t)repeats, sizeof *time, by_value);
      qsort(tracing, (size_t)repeats, sizeof *time, by_value);
      printf("{\"bench\":\"overlay\",\"faces\":\"%s\",\"cells\":[%d,%d],\"crossings\":%lld,\"pairs_per_cell\":%.2f,\"row_closure\":%.1e,"
             "\"by_tree\":%d,\"us_crossings_segments\":%.2f,\"us_moments\":%.2f,\"us_overlay\":%.2f,\"us_with_triangulation\":%.2f,\"bytes_per_cell\":%.0f}\n",
             argv[4], n, part.piece[1].num_cells, (long long)(o->trace[0].num_crossings + o->trace[1].num_crossings), (double)m->num_pairs / n,
             worst, by_tree, 1e6 * tracing[repeats / 2] / n, 1e6 * (time[repeats / 2] - tracing[repeats / 2]) / n, 1e6 * time[repeats / 2] / n,
             1e6 * total[repeats / 2] / n, (double)rm_arena_bytes(a) / n);
    }
    rm_arena_drop(a);
  }
  rm_arena_drop(arena);
  return 0;
}
