/* What remap_build holds at most, and afterwards, per cell and per pair: what the library holds is counted (heap.h). */
#include "api/context.h"
#include "heap.h"
#include "meshes.h"
#include "rt.h"

/* Bytes per target cell at the peak of a build of two warped grids of about n^3 cells, and after it; pairs per target cell. */
typedef struct amounts {
  double peak, kept, pairs;
} amounts;

static amounts build(int n, remap_faces faces, int64_t triangles)
{
  tm_mesh       *mesh[2];
  remap_options  options;
  remap_context *ctx = NULL;
  remap_stats    stats;
  int64_t        before;

  remap_options_default(&options);
  options.faces = faces;
  for (int side = 0; side < 2; side++)
    mesh[side] = tm_hexahedra((int[]){n + side, n + side, n + side}, tm_warp, &(tm_warping){.03, side ? .1 : .7});
  RT_EQ(remap_create(MPI_COMM_WORLD, &options, &ctx), REMAP_OK);
  ctx->slicing = (rm_slicing){.triangles = triangles, .repeats = RM_BLOCK_REPEATS};
  for (int side = 0; side < 2; side++) RT_EQ(remap_set_mesh(ctx, side, &mesh[side]->view), REMAP_OK);
  before = heap.most = heap.held;
  RT_EQ(remap_build(ctx), REMAP_OK);
  const double cells = (double)mesh[1]->view.num_cells;
  const double peak = (double)(heap.most - before), kept = (double)(heap.held - before);
  RT_EQ(remap_get_stats(ctx, &stats), REMAP_OK);
  remap_destroy(&ctx);
  for (int side = 0; side < 2; side++) tm_free(mesh[side]);
  return (amounts){peak / cells, kept / cells, (double)stats.pairs / cells};
}

/* As with 80,000 triangles at 40^3 cells, where shared blocks of arenas count for less. */
static void a_build_of_warped_grids_stays_within_its_bounds(void)
{
  static const double most_bytes[2] = {[REMAP_FACES_CENTRE] = 2000, [REMAP_FACES_DIAGONAL] = 1300};

  for (int faces = REMAP_FACES_CENTRE; faces <= REMAP_FACES_DIAGONAL; faces++) {
    const amounts a = build(24, (remap_faces)faces, 18000);

    if (!RT_CHECK(a.peak <= most_bytes[faces])) printf("# peak %.0f, kept %.0f bytes per target cell\n", a.peak, a.kept);
  }
}

/* Meshes and pairs are all that is kept: 48 bytes per pair, and 650 per cell of both meshes together. */
static void what_is_kept_is_meshes_and_pairs(void)
{
  const amounts a = build(16, REMAP_FACES_DIAGONAL, 10000), b = build(24, REMAP_FACES_DIAGONAL, 18000);

  RT_CHECK(b.kept <= 48 * b.pairs + 650);
  RT_CHECK(a.pairs > 7 && b.pairs > 7);
  if (!RT_CHECK(b.kept <= a.kept)) printf("# kept %.0f and %.0f bytes per target cell\n", a.kept, b.kept);
}

/* Bytes per target cell that transfers of so many fields add to what a build keeps. */
static double moving_takes(int n, int num_fields)
{
  tm_mesh         *mesh[2];
  remap_context   *ctx      = NULL;
  remap_field_desc field[9] = {{.name = NULL}};
  double          *value[2];

  for (int side = 0; side < 2; side++) {
    mesh[side]  = tm_hexahedra((int[]){n + side, n + side, n + side}, tm_warp, &(tm_warping){.03, side ? .1 : .7});
    value[side] = tm_alloc_(num_fields * mesh[side]->view.num_cells, sizeof *value[side]);
  }
  for (int f = 0; f < num_fields; f++)
    field[f] = (remap_field_desc){.in  = value[0] + f * mesh[0]->view.num_cells,
                                  .out = value[1] + f * mesh[1]->view.num_cells};
  RT_EQ(remap_create(MPI_COMM_WORLD, NULL, &ctx), REMAP_OK);
  for (int side = 0; side < 2; side++) RT_EQ(remap_set_mesh(ctx, side, &mesh[side]->view), REMAP_OK);
  RT_EQ(remap_build(ctx), REMAP_OK);
  const int64_t before = heap.held;
  RT_EQ(remap_field(ctx, REMAP_FORWARD, NULL, num_fields, field, NULL), REMAP_OK);
  const double bytes = (double)(heap.held - before) / (double)mesh[1]->view.num_cells;
  remap_destroy(&ctx);
  for (int side = 0; side < 2; side++) tm_free(mesh[side]), free(value[side]);
  return bytes;
}

/* By the default transfer, of order 2 and limited. */
static void moving_fields_takes_a_stencil_and_what_travels_once(void)
{
  const double one = moving_takes(20, 1), many = moving_takes(20, 9);

  if (!RT_CHECK(one <= 950 && many - one <= 8 * 90))
    printf("# one field %.0f, 9 fields %.0f bytes per target cell\n", one, many);
}

static void without_blocks_the_peak_is_that_of_a_whole_overlay(void)
{
  const amounts whole = build(16, REMAP_FACES_DIAGONAL, INT64_MAX), blocks = build(16, REMAP_FACES_DIAGONAL, 5000);

  RT_CHECK(whole.peak > 2 * blocks.peak); /* so the bounds above see blocks at work */
}

RT_MAIN(RT_CASE(a_build_of_warped_grids_stays_within_its_bounds), RT_CASE(what_is_kept_is_meshes_and_pairs),
        RT_CASE(moving_fields_takes_a_stencil_and_what_travels_once),
        RT_CASE(without_blocks_the_peak_is_that_of_a_whole_overlay))
