/* What a rank has to know of all others: bytes that collective calls hand out to it, in groups of a quarter of the ranks and
 * with all of them. */
#include <remap/remap.h>
#include "balance.h"
#include "counted.h"
#include "rt.h"

enum { N = 10, QUARTER = 4 };

static void far_away(double xyz[3], const void *data)
{
  (void)data;
  xyz[0] += 9;
}

/* Greatest bytes of a build, and of a transfer that builds stencils and looks for cells that are nearest. */
static void count(MPI_Comm comm, double bytes[2])
{
  remap_context   *ctx = NULL;
  tm_mesh         *whole[2], *mine[2];
  remap_transfer   how;
  double           counts[5];
  int              rank, size;

  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  remap_transfer_default(&how);
  how.on_uncovered = REMAP_UNCOVERED_NEAREST;
  balance_meshes("even", N, whole);
  whole[1] = tm_join(whole[1], tm_hexahedra((int[]){2, 2, 2}, far_away, NULL));
  RT_EQ(remap_create(comm, NULL, &ctx), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    int *deal = tm_deal(whole[side], size, TM_SLABS, 1);

    mine[side] = tm_part(whole[side], deal, rank, 0);
    RT_EQ(remap_set_mesh(ctx, side, &mine[side]->view), REMAP_OK);
    tm_free(whole[side]), free(deal);
  }
  double *u = tm_alloc_(mine[0]->view.num_cells, sizeof *u), *v = tm_alloc_(mine[1]->view.num_cells, sizeof *v);
  remap_field_desc one = {.name = "u", .nature = REMAP_CONSERVED, .in = u, .out = v};

  counted_take(NULL);
  RT_EQ(remap_build(ctx), REMAP_OK);
  counted_take(counts);
  bytes[0] = counts[4];
  RT_EQ(remap_field(ctx, REMAP_FORWARD, &how, 1, &one, NULL), REMAP_OK);
  counted_take(counts);
  bytes[1] = counts[4];
  MPI_Allreduce(MPI_IN_PLACE, bytes, 2, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
  remap_destroy(&ctx);
  for (int side = 0; side < 2; side++) tm_free(mine[side]);
  free(u), free(v);
}

/* Cuts of keys are what is told to all: 59 bytes here. A box of each rank would be 56 more, its crowds of a mesh 1 kB. */
static void a_rank_more_adds_less_to_what_all_are_told_than_a_box_of_each_would(void)
{
  static const double most[2] = {80, 8};
  double              few[2], many[2];
  MPI_Comm            group;

  MPI_Comm_split(MPI_COMM_WORLD, rt_rank() % QUARTER, rt_rank(), &group);
  count(group, few);
  count(MPI_COMM_WORLD, many);
  MPI_Comm_free(&group);
  for (int k = 0; k < 2; k++) {
    const double more = (many[k] - few[k]) / (rt_size() - rt_size() / QUARTER);

    if (!RT_CHECK(more < most[k]) && rt_rank() == 0) printf("# %s: %.0f bytes\n", k ? "transfer" : "build", more);
  }
}

RT_MAIN(RT_CASE(a_rank_more_adds_less_to_what_all_are_told_than_a_box_of_each_would))
