/* bench_overlay -- time and memory of the overlay stage by stage on one rank: triangulation, crossings and segments, volumes
 * and first moments of triangulated meshes in memory; "overlay" is the sum of the last two. One JSON line; microseconds of
 * processor time per cell of mesh 1, medians; wall clock of the overlay; bytes of heap that triangulation, overlay and moments
 * take together, at the peak, per cell of mesh 2; a hash of the bits of all V and M, whatever the order of the pairs.
 *
 *   bench_overlay CASE N diagonal|centre [REPEATS]      cases: bench.h */
#include "bench.h"
#include "laid.h"

enum { TRIANGULATION, TRACE, MOMENTS, OVERLAY, WALL, NUM_TIMES };

/* Measure all stages once; what they made goes again. */
static remap_status measure(laid *l, remap_faces faces, double seconds[NUM_TIMES], double *peak_bytes)
{
  rm_arena         *arena = rm_arena_new();
  const rm_trimesh *mesh[2];
  const rm_overlay *o;
  const rm_moments *m;
  remap_status      status = arena ? REMAP_OK : REMAP_NO_MEMORY;
  const double      held = bench_heap_start(), t0 = bench_cpu();

  for (int side = 0; side < 2 && status == REMAP_OK; side++)
    status = rm_trimesh_build(arena, &l->frame, &l->part.piece[side], faces, &mesh[side]);
  const double t1 = bench_cpu(), wall = bench_wall();
  if (status == REMAP_OK) status = rm_overlay_build(arena, mesh, &l->part, NULL, &o, &l->reason);
  const double t2 = bench_cpu();
  if (status == REMAP_OK) status = rm_moments_build(arena, &l->part, o, 1, &m);
  const double t3 = bench_cpu();
  seconds[TRIANGULATION] = t1 - t0, seconds[TRACE] = t2 - t1, seconds[MOMENTS] = t3 - t2, seconds[OVERLAY] = t3 - t1;
  seconds[WALL] = bench_wall() - wall;
  *peak_bytes   = bench_heap_peak() - held;
  rm_arena_drop(arena);
  return status;
}

static uint64_t hash_of(const rm_moments *m)
{
  uint64_t sum = 0;

  for (int64_t k = 0; k < m->num_pairs; k++) {
    uint64_t     h    = rm_hash_word((uint64_t)m->source[k] << 32 | (uint64_t)m->target[k]), bits;
    const double x[4] = {m->volume[k], m->moment[k][0], m->moment[k][1], m->moment[k][2]};
    for (int c = 0; c < 4; c++) memcpy(&bits, &x[c], sizeof bits), h = rm_hash_word(h ^ bits);
    sum += rm_hash_word(h ^ m->flags[k]);
  }
  return sum;
}

int main(int argc, char **argv)
{
  const int repeats = argc > 4 ? atoi(argv[4]) : 1, faces = argc > 3 ? bench_faces(argv[3]) : -1;
  tm_mesh  *mesh[2];
  double    peak = 0, once[NUM_TIMES], us[NUM_TIMES];

  if (faces < 0 || atoi(argv[2]) < 1 || repeats < 1 || !bench_meshes(argv[1], atoi(argv[2]), mesh))
    return fprintf(stderr, "usage: bench_overlay " BENCH_CASES " N diagonal|centre [REPEATS]\n"), 2;

  laid   *l    = laid_over(mesh[0], mesh[1], (remap_faces)faces, NULL);
  double *time = tm_alloc_(NUM_TIMES * repeats, sizeof *time);
  for (int r = 0; r < repeats && l->status == REMAP_OK; r++) {
    l->status = measure(l, (remap_faces)faces, once, &peak);
    for (int k = 0; k < NUM_TIMES; k++) time[k * repeats + r] = once[k];
  }
  if (l->status != REMAP_OK) return fprintf(stderr, "%s: %s\n", remap_status_text(l->status), l->reason.text), 1;

  const rm_lid   *cells = (rm_lid[]){l->part.piece[0].num_cells, l->part.piece[1].num_cells};
  const rm_trace *trace = l->overlay->trace;
  const double    pairs = (double)l->moments->num_pairs;
  for (int k = 0; k < NUM_TIMES; k++) us[k] = 1e6 * bench_median(time + k * repeats, repeats) / cells[0];
  printf("{\"bench\":\"overlay\",\"case\":\"%s\",\"n\":%s,\"faces\":\"%s\",\"cells\":[%d,%d],\"crossings\":%lld,\"segments\":%"
         "lld,\"pairs\":%.0f,"
         "\"us_triangulation\":%.2f,\"us_crossings_segments\":%.2f,\"us_moments\":%.2f,\"us_overlay\":%.2f,\"us_overlay_wall\":"
         "%.2f,"
         "\"us_per_pair\":%.3f,\"peak_bytes_per_target_cell\":%.0f,\"hash\":\"%016llx\"}\n",
         argv[1], argv[2], argv[3], cells[0], cells[1], (long long)(trace[0].num_crossings + trace[1].num_crossings),
         (long long)(l->overlay->end_offset[l->mesh[0]->num_triangles] / 2), pairs, us[TRIANGULATION], us[TRACE], us[MOMENTS],
         us[OVERLAY], us[WALL], pairs > 0 ? us[OVERLAY] * cells[0] / pairs : 0, peak / cells[1],
         (unsigned long long)hash_of(l->moments));
  laid_free(l);
  tm_free(mesh[0]), tm_free(mesh[1]);
  free(time);
  return 0;
}
