/* The bits of one rank on any number of ranks: pairs, fields, reports and statistics, for partitions and numberings by lot,
 * with the caller's global ids and without, masked and moved; and in one block of a rank or in many, of a few cells each,
 * with pairs that go home in one slice or in many. */
#include "api/context.h"
#include "meshes.h"
#include "rt.h"

typedef struct world {
  remap_context *ctx;
  tm_mesh       *mine[2];
} world;

enum { /* seeds from there on */
  GIANTS = 1000, /* cells that meet very many others, on either side */
  ZONES  = 2000  /* zones of a mesh that overlap                     */
};

/* One cell around what others have in many; or two halves, one of a single cell, whose pair is one of giants. */
static tm_mesh *make_with_giants(int side, uint64_t seed)
{
  static const double around[12] = {1.3, 0, 0, -.1, 0, 1.2, .1, -.15, 0, 0, 1.4, -.2};
  const tm_warping    warp       = {.03, .1 * (double)seed};
  const bool          is_one     = (seed + (uint64_t)side) % 2 == 0;

  switch (seed / 2 % 3) {
    case 0: return is_one ? tm_hexahedra((int[]){1, 1, 1}, tm_affine, around) : tm_tetrahedra((int[]){3, 3, 4}, tm_warp, &warp);
    case 1:
      return is_one ? tm_hull(tm_tetrahedra((int[]){3, 3, 3}, tm_warp, &warp))
                    : tm_refined((int[]){3, 4, 3}, tm_checkered, NULL, NULL);
    default:
      return is_one ? tm_two_zones((int[]){1, 1, 1}, (int[]){4, 4, 4}, 0, tm_warp, &warp)
                    : tm_two_zones((int[]){1, 1, 1}, (int[]){3, 5, 4}, 0, NULL, NULL);
  }
}

/* Zones that overlap by a part of a cell, by cells, or around one large cell, opposite to one zone, to others, and to a box
 * that sees a corner of that, or nothing. */
static tm_mesh *make_with_zones(int side, uint64_t seed)
{
  static const double corner[12] = {.3, 0, 0, .4, 0, .3, 0, .1, 0, 0, .4, .2};
  static const double far[12]    = {.1, 0, 0, .05, 0, .3, 0, .1, 0, 0, .4, .2};
  const tm_warping    warp = {.03, 200 + .1 * (double)seed};

  switch ((seed - ZONES) % 6 * 2 + (uint64_t)side) {
    case 1: case 2: return tm_two_zones((int[]){3, 3, 2}, (int[]){4, 2, 3}, -.125, tm_warp, &warp);
    case 4: case 7: case 11: return tm_two_zones((int[]){4, 5, 4}, (int[]){5, 4, 3}, -.3, tm_warp, &warp);
    case 5: case 9: return tm_two_zones((int[]){1, 1, 1}, (int[]){4, 4, 4}, -.2, tm_warp, &warp);
    case 6: return tm_hexahedra((int[]){4, 3, 3}, tm_affine, corner);
    case 10: return tm_hexahedra((int[]){3, 3, 3}, tm_affine, far);
    default: return tm_hexahedra((int[]){6, 4, 3}, NULL, NULL);
  }
}

static void above(double xyz[3], const void *data)
{
  (void)data;
  xyz[2] += 1;
}

static tm_mesh *make(int side, uint64_t seed)
{
  static const double away[12] = {1, 0, 0, .25, 0, 1, 0, .2, 0, 0, 1, .3};
  const tm_warping    warp     = {.03, .1 * (double)seed};
  tm_mesh            *m;

  if (seed >= ZONES) return make_with_zones(side, seed);
  if (seed >= GIANTS) return make_with_giants(side, seed);
  switch ((seed + (uint64_t)side) % 5) {
    case 0: m = tm_tetrahedra((int[]){3, 3, 3}, tm_warp, &warp); break;
    case 1: m = tm_refined((int[]){3, 4, 3}, tm_checkered, tm_warp, &warp); break;
    case 2: m = tm_dual((int[]){3, 3, 4}, tm_warp, &warp); break;
    case 3: m = tm_join(tm_hexahedra((int[]){5, 4, 2}, NULL, NULL), tm_prisms((int[]){5, 4, 2}, above, NULL)); break;
    default: m = tm_hexahedra((int[]){5, 4, 6}, NULL, NULL); break; /* aligned with nothing, coplanar with itself */
  }
  if (side) tm_move(m, tm_affine, away);
  return m;
}

/* A context that has its meshes. triangles: of the cells that are overlaid at once, about; 0: as the library does. */
static void lend(world *w, MPI_Comm comm, const remap_options *options, uint64_t seed, bool has_ids, int64_t triangles)
{
  int rank, size;

  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  RT_EQ(remap_create(comm, options, &w->ctx), REMAP_OK);
  if (triangles) w->ctx->slicing = (rm_slicing){.triangles = triangles, .repeats = INFINITY};
  if (triangles) w->ctx->slice = triangles / 4;
  for (int side = 0; side < 2; side++) {
    tm_mesh *whole = make(side, seed);
    int     *deal  = tm_deal(whole, size, seed % 3 ? TM_RANDOM : TM_SLABS, seed);

    w->mine[side] = tm_part(whole, deal, rank, size > 1 ? seed : 0);
    if (!has_ids) w->mine[side]->view.cell_global = NULL;
    RT_EQ(remap_set_mesh(w->ctx, side, &w->mine[side]->view), REMAP_OK);
    tm_free(whole), free(deal);
  }
}

static void open_world(world *w, MPI_Comm comm, uint64_t seed, bool has_ids, int64_t triangles)
{
  static const double turned[12] = {.96, -.28, 0, .1, .28, .96, 0, -.1, 0, 0, 1, .05};
  const remap_motion  motion[2]  = {{NULL, NULL}, {NULL, turned}};

  lend(w, comm, NULL, seed, has_ids, triangles);
  RT_EQ(remap_build(w->ctx), REMAP_OK);
  if (seed % 2) RT_EQ(remap_move(w->ctx, motion), REMAP_OK);
  if (seed % 3 == 1) {
    uint8_t *gives[2], *wants[2];

    for (int side = 0; side < 2; side++) {
      const int64_t num = w->mine[side]->view.num_cells;

      gives[side] = tm_alloc_(num, 1), wants[side] = tm_alloc_(num, 1);
      for (int64_t c = 0; c < num; c++) {
        gives[side][c] = w->mine[side]->global[c] % 7 != 1;
        wants[side][c] = w->mine[side]->global[c] % 5 != 2;
      }
    }
    RT_EQ(remap_set_masks(w->ctx, &(remap_masks){.gives = {gives[0], gives[1]}, .wants = {wants[0], wants[1]}}), REMAP_OK);
    for (int side = 0; side < 2; side++) free(gives[side]), free(wants[side]);
  }
}

static void close_world(world *w)
{
  remap_destroy(&w->ctx);
  for (int side = 0; side < 2; side++) tm_free(w->mine[side]);
}

/* Order 1 and 2, limited and not, in one direction: values by the cells' ids in the whole mesh. */
enum { WAYS = 3 };
static void transfer(world *w, int d, double *by_id, int64_t num_ids, remap_field_report report[WAYS][2])
{
  const tm_mesh *give = w->mine[d], *take = w->mine[1 - d];
  double        *u[2], *v[2];

  for (int k = 0; k < 2; k++) {
    u[k] = tm_alloc_(give->view.num_cells, sizeof(double)), v[k] = tm_alloc_(take->view.num_cells, sizeof(double));
    for (int64_t c = 0; c < give->view.num_cells; c++)
      u[k][c] = ldexp((double)(tm_mix_((uint64_t)give->global[c] + (uint64_t)k) % 100000) - 5e4, k ? 300 : -20);
  }
  for (int way = 0; way < WAYS; way++) {
    const remap_field_desc f[2] = {{.nature = REMAP_CONSERVED, .in = u[0], .out = v[0]},
                                   {.nature = REMAP_CONSERVED, .in = u[1], .out = v[1]}};
    remap_transfer         how;

    remap_transfer_default(&how);
    how.order        = way ? 2 : 1;
    how.limiter      = way == 1 ? REMAP_LIMITER_NONE : REMAP_LIMITER_BARTH_JESPERSEN;
    how.on_uncovered = REMAP_UNCOVERED_NEAREST;
    RT_EQ(remap_field(w->ctx, d, &how, 2, f, report[way]), REMAP_OK);
    for (int64_t c = 0; c < take->view.num_cells; c++)
      for (int k = 0; k < 2; k++) by_id[(2 * way + k) * num_ids + take->global[c]] = v[k][c];
  }
  for (int k = 0; k < 2; k++) free(u[k]), free(v[k]);
}

/* Volumes and moments of a cell's pairs in one number: their order is canonical, so they may be added up. */
static void sum_rows(world *w, int d, double *by_id)
{
  remap_pairs_view p;

  RT_EQ(remap_pairs(w->ctx, d, &p), REMAP_OK);
  for (int64_t c = 0; c < p.num_rows; c++) {
    double sum = 0;
    for (int64_t k = p.row_offset[c]; k < p.row_offset[c + 1]; k++)
      sum = 3 * sum + p.volume[k] + 5 * p.moment[3 * k] + 7 * p.moment[3 * k + 1] + 11 * p.moment[3 * k + 2];
    by_id[w->mine[1 - d]->global[c]] = sum;
  }
}

static void look(uint64_t seed, bool has_ids, int64_t triangles)
{
  world       alone, together;
  remap_stats s[2];

  open_world(&alone, MPI_COMM_SELF, seed, true, 0);
  open_world(&together, MPI_COMM_WORLD, seed, has_ids, triangles);
  RT_EQ(remap_get_stats(alone.ctx, &s[0]), REMAP_OK);
  RT_EQ(remap_get_stats(together.ctx, &s[1]), REMAP_OK);
  RT_CHECK(s[0].pairs > 0 && s[0].pairs == s[1].pairs);
  RT_NEAR(s[0].overlap_volume, s[1].overlap_volume, 0.0);
  for (int side = 0; side < 2; side++) {
    RT_NEAR(s[0].max_closure_error[side], s[1].max_closure_error[side], 0.0);
    if (!has_ids) continue; /* zones are told by them */
    RT_NEAR(s[0].zone_overlap[side], s[1].zone_overlap[side], 0.0);
    for (int k = 0; k < 2; k++) RT_EQ(s[0].zone_overlap_cell[side][k], s[1].zone_overlap_cell[side][k]);
  }
  for (int d = 0; d < 2; d++) {
    const int64_t      n = s[0].cells[1 - d];
    double            *want = tm_alloc_((2 * WAYS + 1) * n, sizeof *want), *got = tm_alloc_((2 * WAYS + 1) * n, sizeof *got);
    remap_field_report report[2][WAYS][2];

    memset(report, 0, sizeof report);
    transfer(&alone, d, want, n, report[0]), sum_rows(&alone, d, want + 2 * WAYS * n);
    transfer(&together, d, got, n, report[1]), sum_rows(&together, d, got + 2 * WAYS * n);
    RT_CHECK(memcmp(report[0], report[1], sizeof report[0]) == 0);
    for (int k = 0; k <= 2 * WAYS; k++)
      for (int64_t c = 0; c < together.mine[1 - d]->view.num_cells; c++) {
        const int64_t g = k * n + together.mine[1 - d]->global[c];
        if (!RT_CHECK(memcmp(&want[g], &got[g], sizeof *got) == 0)) {
          printf("# seed %d, direction %d, list %d: %.17g and %.17g\n", (int)seed, d, k, want[g], got[g]);
          break;
        }
      }
    free(want), free(got);
  }
  close_world(&alone), close_world(&together);
}

/* Fewer where there are many ranks for few cores. */
static uint64_t num_seeds(void) { return rt_long() ? 40 : rt_size() > 8 ? 2 : 6; }

static void everything_has_the_bits_of_one_rank_with_ids(void)
{
  for (uint64_t seed = 1; seed <= num_seeds(); seed++) look(seed, true, 0);
}
static void everything_has_the_bits_of_one_rank_without_ids(void)
{
  for (uint64_t seed = 101; seed <= 100 + num_seeds(); seed++) look(seed, false, 0);
}
static void everything_has_the_bits_of_one_rank_with_giants(void)
{
  for (uint64_t k = 0; k < 6; k++) look(GIANTS + (rt_size() > 8 ? 3 * k : k), k % 2 == 0, 0);
}
static void everything_has_the_bits_of_one_rank_with_overlapping_zones(void)
{
  for (uint64_t seed = ZONES; seed < ZONES + (rt_long() ? 60 : 6); seed++) look(seed, true, 0);
}
/* What remap_build of meshes with zones says where it is asked to refuse those that overlap, and the cells that do. */
static remap_status refuse(MPI_Comm comm, uint64_t seed, char message[256])
{
  remap_options options;
  world         w;
  remap_status  status;

  remap_options_default(&options);
  options.zone_overlap_is_error = 1;
  lend(&w, comm, &options, seed, true, 0);
  status = remap_build(w.ctx);
  snprintf(message, 256, "%s", remap_message(w.ctx));
  close_world(&w);
  return status;
}
static void overlapping_zones_are_refused_on_any_number_of_ranks_or_on_none(void)
{
  static const uint64_t seeds[] = {ZONES, ZONES + 1, ZONES + 2, ZONES + 3, ZONES + 4, ZONES + 5, GIANTS + 6, GIANTS + 7};

  for (int k = 0; k < 8; k++) {
    const uint64_t     seed = seeds[k];
    char               alone[256], together[256];
    const remap_status status = refuse(MPI_COMM_SELF, seed, alone);

    RT_EQ(status, seed == ZONES + 5 ? REMAP_OK : REMAP_ZONE_OVERLAP); /* where the other mesh is not, they may */
    RT_EQ(refuse(MPI_COMM_WORLD, seed, together), status);
    RT_CHECK(strcmp(alone, together) == 0);
  }
}
/* Builds only: moves overlay all at once. Down to a cell or two in a block. */
static void everything_has_the_bits_of_one_block_in_many_blocks(void)
{
  for (uint64_t seed = 2; seed <= num_seeds() + 2; seed += 2) look(seed, true, seed % 4 ? 300 : 20);
  for (uint64_t k = 0; k < 6; k += 2) look(GIANTS + k, true, 40), look(ZONES + k, true, 40);
}

RT_MAIN(RT_CASE(everything_has_the_bits_of_one_rank_with_giants), RT_CASE(everything_has_the_bits_of_one_rank_with_ids),
        RT_CASE(everything_has_the_bits_of_one_rank_with_overlapping_zones),
        RT_CASE(overlapping_zones_are_refused_on_any_number_of_ranks_or_on_none),
        RT_CASE(everything_has_the_bits_of_one_rank_without_ids), RT_CASE(everything_has_the_bits_of_one_block_in_many_blocks))
