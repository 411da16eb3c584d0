/* What issue and design promise of a transfer, on every kind of mesh, through the public interface: closure, constants, linear
 * fields, conservation, identity, and the same bits on any number of ranks. */
#include <remap/remap.h>
#include <float.h>
#include "meshes.h"
#include "rt.h"

typedef tm_mesh *maker(int n);

static tm_mesh *hexahedra(int n) { return tm_hexahedra((int[]){n, n, n}, tm_warp, &(tm_warping){0.03, 0.7}); }
static tm_mesh *tetrahedra(int n) { return tm_tetrahedra((int[]){n, n, n}, tm_warp, &(tm_warping){0.03, 0.3}); }
static tm_mesh *mixed(int n) { return tm_mixed((int[]){n, n, n}, tm_warp, &(tm_warping){0.02, 0.1}); }
static tm_mesh *hanging(int n) { return tm_refined((int[]){n, n, n}, tm_checkered, tm_warp, &(tm_warping){0.02, 0.5}); }
static tm_mesh *dual(int n) { return tm_dual((int[]){n, n, n}, tm_warp, &(tm_warping){0.02, 0.9}); }
static tm_mesh *boxes(int n) { return tm_hexahedra((int[]){n, n, n}, NULL, NULL); }

static const struct {
  const char *name;
  maker      *make;
  int         n;
} kinds[] = {{"hexahedra", hexahedra, 6}, {"tetrahedra", tetrahedra, 4},
             {"mixed", mixed, 6},         {"hanging nodes", hanging, 4},
             {"dual", dual, 4},           {"boxes", boxes, 5}};
enum { NUM_KINDS = sizeof kinds / sizeof *kinds };

/* One context over this rank's parts of two meshes. */
typedef struct bench {
  remap_context *ctx;
  tm_mesh       *mine[2];
  int64_t        cells[2];
  double        *volume[2], *centroid[2];
} bench;

static bool set_up(bench *b, MPI_Comm comm, const tm_mesh *source, const tm_mesh *target, remap_faces faces, uint64_t seed)
{
  const tm_mesh *whole[2] = {source, target};
  remap_options  options;
  int            rank, size;

  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  memset(b, 0, sizeof *b);
  remap_options_default(&options);
  options.faces = faces;
  if (!rt_all(RT_EQ(remap_create(comm, &options, &b->ctx), REMAP_OK))) return false;
  for (int side = 0; side < 2; side++) {
    int *deal = tm_deal(whole[side], size, seed ? TM_RANDOM : TM_SLABS, seed);
    b->mine[side] = tm_part(whole[side], deal, rank, seed);
    free(deal);
    RT_EQ(remap_set_mesh(b->ctx, side, &b->mine[side]->view), REMAP_OK);
  }
  const remap_status status = remap_build(b->ctx);
  if (!rt_all(RT_EQ(status, REMAP_OK))) {
    printf("# %s\n", remap_message(b->ctx));
    return false;
  }
  for (int side = 0; side < 2; side++) {
    b->cells[side]    = b->mine[side]->view.num_cells;
    b->volume[side]   = tm_alloc_(b->cells[side], sizeof(double));
    b->centroid[side] = tm_alloc_(3 * b->cells[side], sizeof(double));
    RT_EQ(remap_cells(b->ctx, side, b->volume[side], b->centroid[side]), REMAP_OK);
  }
  return true;
}

static void tear_down(bench *b)
{
  remap_destroy(&b->ctx);
  for (int side = 0; side < 2; side++) {
    tm_free(b->mine[side]);
    free(b->volume[side]);
    free(b->centroid[side]);
  }
}

static double linear(const double x[3]) { return 0.3 + 1.7 * x[0] - 0.6 * x[1] + 0.9 * x[2]; }
static double wavy(const double x[3]) { return 2 + sin(5 * x[0] + x[1]) * cos(3 * x[2] - x[0]); }

static double *evaluate(const bench *b, int side, double (*f)(const double x[3]))
{
  double *u = tm_alloc_(b->cells[side], sizeof *u);
  for (int64_t c = 0; c < b->cells[side]; c++) u[c] = f(b->centroid[side] + 3 * c);
  return u;
}

/* Constant and linear fields, closure and conservation of one pair of meshes. scale: a length of the meshes. */
static void check_promises(const tm_mesh *source, const tm_mesh *target, remap_faces faces, const char *what)
{
  bench          b;
  remap_stats    stats;
  remap_transfer how;

  if (set_up(&b, MPI_COMM_WORLD, source, target, faces, 0)) {
    double *lin = evaluate(&b, 0, linear), *got = tm_alloc_(b.cells[1], sizeof *got), *one = tm_alloc_(b.cells[0], sizeof *one);
    double *got_one = tm_alloc_(b.cells[1], sizeof *got_one), *got_wave = tm_alloc_(b.cells[1], sizeof *got_wave);
    double *wave = evaluate(&b, 0, wavy);
    remap_cover       *cover = tm_alloc_(b.cells[1], sizeof *cover);
    remap_field_report report[3];
    double             largest = 0, error = 0;

    for (int64_t c = 0; c < b.cells[0]; c++) one[c] = 1, largest = fmax(largest, fabs(lin[c]));
    remap_field_desc fields[3] = {{.name = "linear", .nature = REMAP_CONSERVED, .in = lin, .out = got},
                                  {.name = "one", .nature = REMAP_CONSERVED, .in = one, .out = got_one},
                                  {.name = "wave", .nature = REMAP_CONSERVED, .in = wave, .out = got_wave}};
    RT_EQ(remap_get_stats(b.ctx, &stats), REMAP_OK);
    for (int side = 0; side < 2; side++)
      if (!RT_CHECK(stats.max_closure_error[side] <= 1e-12))
        printf("# %s: closure of side %d: %g\n", what, side, stats.max_closure_error[side]);
    remap_transfer_default(&how);
    how.limiter = REMAP_LIMITER_NONE;
    if (!RT_EQ(remap_field(b.ctx, REMAP_FORWARD, &how, 3, fields, report), REMAP_OK)) printf("# %s\n", remap_message(b.ctx));
    RT_EQ(remap_coverage(b.ctx, REMAP_TARGET, NULL, cover), REMAP_OK);
    for (int64_t c = 0; c < b.cells[1]; c++) {
      if (cover[c] == REMAP_UNCOVERED) continue;
      error = fmax(error, fabs(got[c] - linear(b.centroid[1] + 3 * c)));
      if (!RT_NEAR(got_one[c], 1, 1e-13)) break;
    }
    MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
    if (!RT_CHECK(error <= 1e-12 * largest)) printf("# %s: linear field errs by %g of %g\n", what, error, largest);
    for (int k = 0; k < 3; k++)
      if (!RT_CHECK(report[k].conservation_error <= 1e-14))
        printf("# %s: conservation of %s: %g\n", what, fields[k].name, report[k].conservation_error);
    free(lin), free(got), free(one), free(got_one), free(wave), free(got_wave), free(cover);
  }
  tear_down(&b);
}

static void every_kind_of_mesh_keeps_the_promises(void)
{
  for (int s = 0; s < NUM_KINDS; s++)
    for (int t = 0; t < NUM_KINDS; t++)
      for (int faces = 0; faces < 2; faces++) {
        tm_mesh *source = kinds[s].make(kinds[s].n), *target = kinds[t].make(kinds[t].n + 1);
        char     what[100];
        snprintf(what, sizeof what, "%s to %s, %s", kinds[s].name, kinds[t].name, faces ? "diagonal" : "centre");
        check_promises(source, target, faces, what);
        tm_free(source), tm_free(target);
      }
}

static void scaled_and_moved_meshes_keep_the_promises(void)
{
  static const double scale[] = {1e-6, 1e6, 1, 1}, shift[] = {0, 0, 1e6, -3.3e5};

  for (int k = 0; k < 4; k++)
    for (int s = 0; s < 3; s++) {
      const double m[12] = {scale[k], 0, 0, shift[k], 0, scale[k], 0, -shift[k], 0, 0, scale[k], 0.7 * shift[k]};
      tm_mesh     *source = kinds[s].make(kinds[s].n), *target = kinds[0].make(5);
      char         what[100];
      tm_move(source, tm_affine, m), tm_move(target, tm_affine, m);
      snprintf(what, sizeof what, "%s scaled by %g, moved by %g", kinds[s].name, scale[k], shift[k]);
      check_promises(source, target, REMAP_FACES_CENTRE, what);
      tm_free(source), tm_free(target);
    }
}

static void remapping_onto_the_same_mesh_is_a_bitwise_copy(void)
{
  for (int s = 0; s < NUM_KINDS; s++)
    for (int faces = 0; faces < 2; faces++) {
      tm_mesh    *mesh = kinds[s].make(kinds[s].n);
      bench       b;
      remap_stats stats;

      if (set_up(&b, MPI_COMM_WORLD, mesh, mesh, faces, 0)) {
        double *u = evaluate(&b, 0, wavy), *got = tm_alloc_(b.cells[1], sizeof *got);
        RT_EQ(remap_get_stats(b.ctx, &stats), REMAP_OK);
        if (!RT_EQ(stats.pairs, stats.cells[0])) printf("# %s, faces %d\n", kinds[s].name, faces);
        RT_EQ(stats.cells_by_cover[1][REMAP_COVERED], stats.cells[1]);
        remap_field_desc field = {.name = "wave", .nature = REMAP_CONSERVED, .in = u, .out = got};
        RT_EQ(remap_field(b.ctx, REMAP_FORWARD, NULL, 1, &field, NULL), REMAP_OK);
        RT_CHECK(!memcmp(u, got, sizeof *u * (size_t)b.cells[0]));
        field = (remap_field_desc){.name = "wave", .nature = REMAP_CONSERVED, .in = got, .out = u};
        memset(u, 0, sizeof *u * (size_t)b.cells[0]);
        RT_EQ(remap_field(b.ctx, REMAP_BACKWARD, NULL, 1, &field, NULL), REMAP_OK);
        RT_CHECK(!memcmp(u, got, sizeof *u * (size_t)b.cells[0]));
        free(u), free(got);
      }
      tear_down(&b);
      tm_free(mesh);
    }
}

/* Both directions with limiter, by global id. */
static void transfer_both_ways(bench *b, int64_t num_source, int64_t num_target, double *by_source, double *by_target)
{
  double *u = evaluate(b, 0, wavy), *v = tm_alloc_(b->cells[1], sizeof *v), *back = tm_alloc_(b->cells[0], sizeof *back);
  remap_field_desc there = {.name = "wave", .nature = REMAP_CONSERVED, .in = u, .out = v};
  remap_field_desc home  = {.name = "wave", .nature = REMAP_CONSERVED, .in = v, .out = back};

  RT_EQ(remap_field(b->ctx, REMAP_FORWARD, NULL, 1, &there, NULL), REMAP_OK);
  RT_EQ(remap_field(b->ctx, REMAP_BACKWARD, NULL, 1, &home, NULL), REMAP_OK);
  for (int64_t c = 0; c < num_source; c++) by_source[c] = 0;
  for (int64_t c = 0; c < num_target; c++) by_target[c] = 0;
  for (int64_t c = 0; c < b->cells[0]; c++) by_source[b->mine[0]->view.cell_global[c]] = back[c];
  for (int64_t c = 0; c < b->cells[1]; c++) by_target[b->mine[1]->view.cell_global[c]] = v[c];
  free(u), free(v), free(back);
}

static void fields_are_the_same_bits_on_any_ranks_for_any_partition_and_numbering(void)
{
  static const int pair[][2] = {{0, 1}, {4, 2}, {3, 0}, {5, 5}};

  for (int p = 0; p < 4; p++)
    for (uint64_t seed = 1; seed <= 3; seed++) {
      tm_mesh *source = kinds[pair[p][0]].make(4), *target = kinds[pair[p][1]].make(5);
      const int64_t ns = source->view.num_cells, nt = target->view.num_cells;
      double  *want[2] = {tm_alloc_(ns, sizeof(double)), tm_alloc_(nt, sizeof(double))};
      double  *got[2]  = {tm_alloc_(ns, sizeof(double)), tm_alloc_(nt, sizeof(double))};
      bench    alone, together;
      const bool ok_alone = set_up(&alone, MPI_COMM_SELF, source, target, REMAP_FACES_CENTRE, 0);
      const bool ok = set_up(&together, MPI_COMM_WORLD, source, target, REMAP_FACES_CENTRE, seed);

      if (ok_alone && ok) {
        remap_stats s[2];
        transfer_both_ways(&alone, ns, nt, want[0], want[1]);
        transfer_both_ways(&together, ns, nt, got[0], got[1]);
        RT_EQ(remap_get_stats(alone.ctx, &s[0]), REMAP_OK);
        RT_EQ(remap_get_stats(together.ctx, &s[1]), REMAP_OK);
        RT_EQ(s[1].pairs, s[0].pairs);
        RT_NEAR(s[1].overlap_volume, s[0].overlap_volume, 0.0);
        RT_NEAR(s[1].volume[0], s[0].volume[0], 0.0);
        for (int side = 0; side < 2; side++) {
          for (int c = 0; c < 3; c++) RT_EQ(s[1].cells_by_cover[side][c], s[0].cells_by_cover[side][c]);
          for (int64_t c = 0; c < together.cells[side]; c++) {
            const int64_t g = together.mine[side]->view.cell_global[c];
            if (!RT_NEAR(got[side][g], want[side][g], 0.0)) break;
          }
        }
      }
      tear_down(&alone), tear_down(&together);
      for (int side = 0; side < 2; side++) free(want[side]), free(got[side]);
      tm_free(source), tm_free(target);
    }
}

static void cells_across_a_patched_interface_are_covered_unless_it_gapes(void)
{
  static const struct {
    double gap;
    int    covered;
  } cases[] = {{0, 2}, {0x1p-53, 2}, {-0x1p-54, 2}, {1e-3, 0}, {-1e-3, 0}};

  for (int k = 0; k < 5; k++) {
    tm_mesh    *source = tm_two_zones((int[]){1, 2, 2}, (int[]){1, 1, 3}, cases[k].gap, NULL, NULL);
    tm_mesh    *target = tm_hexahedra((int[]){1, 1, 2}, NULL, NULL);
    bench       b;
    remap_stats stats;

    if (set_up(&b, MPI_COMM_WORLD, source, target, REMAP_FACES_CENTRE, 0)) {
      RT_EQ(remap_get_stats(b.ctx, &stats), REMAP_OK);
      if (!RT_EQ(stats.cells_by_cover[1][REMAP_COVERED], cases[k].covered)) printf("# gap %g\n", cases[k].gap);
      RT_EQ(stats.cells_by_cover[1][REMAP_PARTIAL], 2 - cases[k].covered);
    }
    tear_down(&b);
    tm_free(source), tm_free(target);
  }
}

RT_MAIN(RT_CASE(cells_across_a_patched_interface_are_covered_unless_it_gapes), RT_CASE(every_kind_of_mesh_keeps_the_promises),
        RT_CASE(scaled_and_moved_meshes_keep_the_promises), RT_CASE(remapping_onto_the_same_mesh_is_a_bitwise_copy),
        RT_CASE(fields_are_the_same_bits_on_any_ranks_for_any_partition_and_numbering))
