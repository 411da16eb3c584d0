/* The overlay's work, counted in crossings and triangles, is shared out evenly; and what a rank holds falls with their
 * number. */
#include "balance.h"
#include "rt.h"

static const char *const even_cases[] = {"even", "graded", "target", "source", "hull", "shell"};
enum { NUM_EVEN = sizeof even_cases / sizeof *even_cases, N = 14 };

/* Work of the slowest rank over the mean. */
static double ratio_of(const char *name, int n)
{
  balance b;
  double  ratio = INFINITY;

  balance_open_on(&b, MPI_COMM_WORLD, name, n, REMAP_FACES_CENTRE);
  if (RT_EQ(b.status, REMAP_OK)) ratio = balance_ratio(&b, balance_cost(&b.here));
  balance_close(&b);
  return ratio;
}

static void no_rank_has_more_than_115_percent_of_the_mean_work_on_even_and_graded_meshes_and_with_one_cell_over_all(void)
{
  for (int k = 0; k < NUM_EVEN; k++) {
    const double ratio = ratio_of(even_cases[k], N);

    if (!RT_CHECK(ratio <= 1.15)) printf("# %s: %.3f\n", even_cases[k], ratio);
  }
}

static void slender_cells_are_shared_out_nearly_as_well(void)
{
  static const char *const cases[] = {"stretched", "corner", "layers"}; /* counts, which cost unlike there */

  for (int k = 0; k < 3; k++) {
    const double ratio = ratio_of(cases[k], N);

    if (!RT_CHECK(ratio <= 1.35)) printf("# %s: %.3f\n", cases[k], ratio);
  }
}

/* Bytes that a rank holds at most, of cells that came and of what the overlay makes of them. */
static double most_bytes(MPI_Comm comm, const char *name, int n)
{
  balance b;
  double  bytes;

  balance_open_on(&b, comm, name, n, REMAP_FACES_CENTRE);
  RT_EQ(b.status, REMAP_OK);
  bytes = b.piece_bytes + b.overlay_bytes;
  MPI_Allreduce(MPI_IN_PLACE, &bytes, 1, MPI_DOUBLE, MPI_MAX, comm);
  balance_close(&b);
  return bytes;
}

/* Cells along the cuts are on two ranks: a surface, besides each rank's share, that of n / P cells being P^(1/3) of them as
 * large as that of n. */
static void memory_of_a_rank_falls_with_their_number(void)
{
  for (int k = 0; k < NUM_EVEN; k++) {
    double       alone = rt_rank() == 0 ? most_bytes(MPI_COMM_SELF, even_cases[k], N) : 0;
    const double here  = most_bytes(MPI_COMM_WORLD, even_cases[k], N);

    MPI_Bcast(&alone, 1, MPI_DOUBLE, 0, MPI_COMM_WORLD);
    const double share = here * rt_size() / alone;
    if (!RT_CHECK(share <= 1 + 0.82 * (cbrt(rt_size()) - 1))) printf("# %s: %.2f of a share\n", even_cases[k], share);
  }
}

RT_MAIN(RT_CASE(no_rank_has_more_than_115_percent_of_the_mean_work_on_even_and_graded_meshes_and_with_one_cell_over_all),
        RT_CASE(slender_cells_are_shared_out_nearly_as_well), RT_CASE(memory_of_a_rank_falls_with_their_number))
