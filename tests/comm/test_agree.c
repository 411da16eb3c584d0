/* Agreement, reductions and arrays that every rank gets. */
#include "comm/comm_private.h"
#include "rt.h"

static rm_comm world(void)
{
  rm_comm comm;

  RT_EQ(rm_comm_dup(MPI_COMM_WORLD, &comm), REMAP_OK);
  return comm;
}

static void a_duplicate_knows_its_rank_and_size_and_returns_errors(void)
{
  rm_comm comm = world();
  int     same = -1;

  RT_EQ(comm.rank, rt_rank());
  RT_EQ(comm.size, rt_size());
  MPI_Comm_compare(comm.mpi, MPI_COMM_WORLD, &same);
  RT_EQ(same, MPI_CONGRUENT);
  RT_CHECK(MPI_Send(&same, 1, MPI_INT, comm.size, 0, comm.mpi) != MPI_SUCCESS); /* no such rank: an error, not the end */
  rm_comm_free(&comm);
  RT_CHECK(comm.mpi == MPI_COMM_NULL);
  rm_comm_free(&comm);
}

static void no_communicator_is_refused(void)
{
  rm_comm comm = {MPI_COMM_NULL, 7, 7};

  RT_EQ(rm_comm_dup(MPI_COMM_NULL, &comm), REMAP_BAD_ARGUMENT);
  RT_EQ(comm.rank, 7);
}

static void worst_status_wins_on_every_rank(void)
{
  rm_comm   comm  = world();
  int       first = -1;
  const int last  = rt_size() - 1;

  RT_EQ(rm_comm_agree(&comm, rt_rank() == last ? REMAP_INTERNAL : REMAP_COVERAGE, &first), REMAP_INTERNAL);
  RT_EQ(first, last);
  RT_EQ(rm_comm_agree(&comm, rt_rank() == 0 ? REMAP_OK : REMAP_BAD_MESH, NULL), last > 0 ? REMAP_BAD_MESH : REMAP_OK);
  rm_comm_free(&comm);
}

static void among_equal_statuses_the_lowest_rank_is_named(void)
{
  rm_comm comm  = world();
  int     first = -1;

  RT_EQ(rm_comm_agree(&comm, rt_rank() == 0 && rt_size() > 1 ? REMAP_OK : REMAP_NO_MEMORY, &first), REMAP_NO_MEMORY);
  RT_EQ(first, rt_size() > 1);
  rm_comm_free(&comm);
}

static void all_ok_stays_ok_and_leaves_the_reason(void)
{
  rm_comm   comm   = world();
  rm_reason reason = {REMAP_SOURCE, rt_rank(), "mine"};
  int       first  = -1;

  RT_EQ(rm_comm_agree(&comm, REMAP_OK, &first), REMAP_OK);
  RT_EQ(rm_comm_agree_reason(&comm, REMAP_OK, &reason), REMAP_OK);
  RT_EQ(reason.global_cell, rt_rank());
  RT_STR(reason.text, "mine");
  rm_comm_free(&comm);
}

static void the_worst_reason_is_everybodys(void)
{
  rm_comm      comm   = world();
  const int    last   = rt_size() - 1;
  rm_reason    reason = {-1, -1, ""};
  remap_status mine   = REMAP_OK;

  if (rt_rank() == 0) mine = rm_fail(REMAP_NO_MEMORY, &reason, -1, -1, "less bad");
  if (rt_rank() == last) {
    reason = (rm_reason){-1, -1, ""};
    mine   = rm_fail(REMAP_INCONSISTENT, &reason, REMAP_TARGET, (rm_gid)1 << 40, "rank %d", last);
  }
  RT_EQ(rm_comm_agree_reason(&comm, mine, &reason), REMAP_INCONSISTENT);
  RT_EQ(reason.side, REMAP_TARGET);
  RT_EQ(reason.global_cell, (rm_gid)1 << 40);
  RT_CHECK(strncmp(reason.text, "rank ", 5) == 0 && atoi(reason.text + 5) == last);
  RT_EQ(rm_comm_agree_reason(&comm, mine, NULL), REMAP_INCONSISTENT);
  rm_comm_free(&comm);
}

static void reductions_are_elementwise(void)
{
  rm_comm   comm   = world();
  const int n      = rt_size();
  int64_t   sum[2] = {1, (int64_t)1 << 40}, max[2] = {rt_rank(), -rt_rank()};
  double    hi[2] = {rt_rank() + 0.5, -1.0 - rt_rank()}, lo[2] = {rt_rank() + 0.5, -1.0 - rt_rank()};

  RT_EQ(rm_comm_sum_i64(&comm, sum, 2), REMAP_OK);
  RT_EQ(sum[0], n);
  RT_EQ(sum[1], n * ((int64_t)1 << 40));
  RT_EQ(rm_comm_max_i64(&comm, max, 2), REMAP_OK);
  RT_EQ(max[0], n - 1);
  RT_EQ(max[1], 0);
  RT_EQ(rm_comm_max_f64(&comm, hi, 2), REMAP_OK);
  RT_NEAR(hi[0], n - 0.5, 0.0);
  RT_NEAR(hi[1], -1.0, 0.0);
  RT_EQ(rm_comm_min_f64(&comm, lo, 2), REMAP_OK);
  RT_NEAR(lo[0], 0.5, 0.0);
  RT_NEAR(lo[1], -n, 0.0);
  rm_comm_free(&comm);
}

static void an_exclusive_scan_counts_the_lower_ranks(void)
{
  rm_comm comm  = world();
  int64_t value = rt_rank() + 1, want = 0;

  for (int r = 0; r < rt_rank(); r++) want += r + 1;
  RT_EQ(rm_comm_exscan_i64(&comm, &value), REMAP_OK);
  RT_EQ(value, want);
  rm_comm_free(&comm);
}

static void exact_sums_are_exact_and_do_not_see_the_partition(void)
{
  static const double term[] = {1e300, 1.0, -1e300, 1e-300, 0x1p-1074, -0.75, 3e7, 1e16, -1e16, 0x1p-30};
  const int           n      = (int)(sizeof term / sizeof *term);
  rm_comm             comm   = world();
  rm_sum              sum[2], whole;

  rm_sum_clear(&sum[0]);
  rm_sum_clear(&sum[1]);
  rm_sum_clear(&whole);
  for (int i = 0; i < n; i++) {
    rm_sum_add(&whole, term[i]);
    if (i % rt_size() == rt_rank()) rm_sum_add(&sum[0], term[i]);
    if (i % rt_size() == rt_rank()) rm_sum_add(&sum[1], -term[i]);
  }
  RT_EQ(rm_comm_sum_exact(&comm, sum, 2), REMAP_OK);
  RT_NEAR(rm_sum_value(&sum[0]), rm_sum_value(&whole), 0.0);
  RT_NEAR(rm_sum_value(&sum[0]), 30000000.25 + 0x1p-30, 0.0);
  RT_NEAR(rm_sum_value(&sum[1]), -rm_sum_value(&whole), 0.0);
  rm_comm_free(&comm);
}

static void gathering_is_the_same_in_one_piece_and_in_small_ones(void)
{
  rm_comm       comm    = world();
  const int64_t chunk[] = {1, 3, 8, 1000, RM_COMM_CHUNK};
  int64_t       mine[5], all[5 * 64];

  if (rt_size() > 64) return;
  for (int i = 0; i < 5; i++) mine[i] = 100 * rt_rank() + i;
  for (int c = 0; c < 5; c++) {
    memset(all, -1, sizeof all);
    RT_EQ(rm_comm_allgather_chunked(&comm, chunk[c], mine, all, 5, sizeof *mine), REMAP_OK);
    for (int r = 0; r < rt_size(); r++)
      for (int i = 0; i < 5; i++) RT_EQ(all[5 * r + i], 100 * r + i);
  }
  rm_comm_free(&comm);
}

static void gathering_lists_of_any_length_keeps_the_order_of_ranks(void)
{
  rm_comm       comm    = world();
  const int64_t chunk[] = {1, 5, RM_COMM_CHUNK};
  const int64_t n       = 3 * (rt_rank() % 3); /* the first rank has none */
  int32_t       mine[6];

  for (int i = 0; i < 6; i++) mine[i] = 1000 * rt_rank() + i;
  for (int c = 0; c < 3; c++) {
    rm_arena *arena  = rm_arena_new();
    int64_t  *offset = rm_arena_alloc(arena, rt_size() + 1, sizeof *offset);
    void     *all    = NULL;

    RT_EQ(rm_comm_allgatherv_chunked(&comm, chunk[c], arena, n ? mine : NULL, n, sizeof *mine, offset, &all), REMAP_OK);
    RT_EQ(offset[0], 0);
    for (int r = 0; r < rt_size(); r++) {
      RT_EQ(offset[r + 1] - offset[r], 3 * (r % 3));
      for (int64_t i = 0; i < offset[r + 1] - offset[r]; i++) RT_EQ(((int32_t *)all)[offset[r] + i], 1000 * r + i);
    }
    rm_arena_drop(arena);
  }
  rm_comm_free(&comm);
}

static void a_rank_without_memory_stops_gathering_everywhere(void)
{
  rm_comm comm = world();
  int32_t mine = rt_rank();

  for (int n = 1; n <= 3; n++) {
    rm_arena    *arena  = rm_arena_new();
    int64_t     *offset = rm_arena_alloc(arena, rt_size() + 1, sizeof *offset);
    void        *all    = NULL;
    remap_status status;

    if (rt_rank() == rt_size() - 1) rm_arena_fail_at(arena, n);
    status = rm_comm_allgatherv(&comm, arena, &mine, 1, sizeof mine, offset, &all);
    RT_EQ(status, n <= 2 ? REMAP_NO_MEMORY : REMAP_OK);
    rm_arena_drop(arena);
  }
  rm_comm_free(&comm);
}

RT_MAIN(RT_CASE(a_duplicate_knows_its_rank_and_size_and_returns_errors), RT_CASE(no_communicator_is_refused),
        RT_CASE(worst_status_wins_on_every_rank), RT_CASE(among_equal_statuses_the_lowest_rank_is_named),
        RT_CASE(all_ok_stays_ok_and_leaves_the_reason), RT_CASE(the_worst_reason_is_everybodys),
        RT_CASE(reductions_are_elementwise), RT_CASE(an_exclusive_scan_counts_the_lower_ranks),
        RT_CASE(exact_sums_are_exact_and_do_not_see_the_partition),
        RT_CASE(gathering_is_the_same_in_one_piece_and_in_small_ones),
        RT_CASE(gathering_lists_of_any_length_keeps_the_order_of_ranks),
        RT_CASE(a_rank_without_memory_stops_gathering_everywhere))
