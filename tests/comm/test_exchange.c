/* Exchange of arrays between all ranks, and among neighbours by a plan. */
#include "comm/comm_private.h"
#include "rt.h"

/* Messages that this rank sends, as MPI is asked to, and calls in which every rank hears from every other. */
static int sends_, alltoalls_;

int MPI_Isend(const void *data, int n, MPI_Datatype type, int to, int tag, MPI_Comm comm, MPI_Request *request)
{
  sends_++;
  return PMPI_Isend(data, n, type, to, tag, comm, request);
}
int MPI_Issend(const void *data, int n, MPI_Datatype type, int to, int tag, MPI_Comm comm, MPI_Request *request)
{
  sends_++;
  return PMPI_Issend(data, n, type, to, tag, comm, request);
}
int MPI_Alltoall(const void *mine, int n, MPI_Datatype type, void *all, int m, MPI_Datatype its, MPI_Comm comm)
{
  alltoalls_++;
  return PMPI_Alltoall(mine, n, type, all, m, its, comm);
}

static rm_comm world(void)
{
  rm_comm comm;

  RT_EQ(rm_comm_dup(MPI_COMM_WORLD, &comm), REMAP_OK);
  return comm;
}

/* How many items rank src sends to rank dst: nothing, a few, or many. */
static int64_t amount(int src, int dst, int most) { return (int64_t)((unsigned)(7 * src + 13 * dst + 5) % 4) * most / 3; }
/* The i-th of them. */
static int64_t word(int src, int dst, int64_t i) { return ((int64_t)src * 1000 + dst) * 1000000 + i; }

/* Exchange amount() items of 1 + extra words, and compare. */
static void exchange_and_check(const rm_comm *comm, int64_t chunk, int most, int extra)
{
  rm_arena *arena = rm_arena_new();
  int64_t  *send_offset, *recv_offset, *send;
  void     *recv  = NULL;
  const int width = 1 + extra, me = comm->rank;

  send_offset = rm_arena_zero(arena, comm->size + 1, sizeof *send_offset);
  recv_offset = rm_arena_zero(arena, comm->size + 1, sizeof *recv_offset);
  for (int r = 0; r < comm->size; r++) send_offset[r + 1] = send_offset[r] + amount(me, r, most);
  send = rm_arena_zero(arena, send_offset[comm->size] * width, sizeof *send);
  for (int r = 0; r < comm->size; r++)
    for (int64_t i = send_offset[r]; i < send_offset[r + 1]; i++)
      for (int w = 0; w < width; w++) send[i * width + w] = word(me, r, i - send_offset[r]) + w;

  RT_EQ(rm_comm_exchange_chunked(comm, chunk, arena, sizeof *send * (size_t)width, send_offset, send, recv_offset, &recv),
        REMAP_OK);
  RT_EQ(recv_offset[0], 0);
  for (int r = 0; r < comm->size; r++) {
    RT_EQ(recv_offset[r + 1] - recv_offset[r], amount(r, me, most));
    for (int64_t i = recv_offset[r]; i < recv_offset[r + 1]; i++)
      for (int w = 0; w < width; w++) RT_EQ(((int64_t *)recv)[i * width + w], word(r, me, i - recv_offset[r]) + w);
  }
  rm_arena_drop(arena);
}

static void items_arrive_in_the_order_of_the_senders(void)
{
  rm_comm comm = world();

  exchange_and_check(&comm, RM_COMM_CHUNK, 300, 0);
  exchange_and_check(&comm, RM_COMM_CHUNK, 10000, 2);
  rm_comm_free(&comm);
}

static void chunks_of_any_size_give_the_same_arrays(void)
{
  rm_comm comm = world();

  for (int64_t chunk = 1; chunk < 5000; chunk = chunk * 3 + 1) exchange_and_check(&comm, chunk, 30, 1);
  rm_comm_free(&comm);
}

static void nothing_at_all_can_be_exchanged(void)
{
  rm_comm comm = world();

  exchange_and_check(&comm, RM_COMM_CHUNK, 0, 0);
  rm_comm_free(&comm);
}

/* Everybody sends two items to the rank `distance` above, and ranks below `most` do. */
static void send_upwards(const rm_comm *comm, int distance, int most)
{
  rm_arena     *arena       = rm_arena_new();
  int64_t      *send_offset = rm_arena_zero(arena, comm->size + 1, sizeof *send_offset);
  int64_t      *recv_offset = rm_arena_zero(arena, comm->size + 1, sizeof *recv_offset);
  const int     to   = (comm->rank + distance) % comm->size;
  const int     from = (comm->rank + comm->size - distance % comm->size) % comm->size;
  const int64_t send[2] = {comm->rank, distance};
  void         *recv    = NULL;

  for (int r = to; r < comm->size && comm->rank < most; r++) send_offset[r + 1] = 2;
  RT_EQ(rm_comm_exchange(comm, arena, sizeof *send, send_offset, send, recv_offset, &recv), REMAP_OK);
  for (int r = 0; r <= comm->size; r++) RT_EQ(recv_offset[r], r > from && from < most ? 2 : 0);
  if (from < most) RT_EQ(((int64_t *)recv)[0], from);
  if (from < most) RT_EQ(((int64_t *)recv)[1], distance);
  rm_arena_drop(arena);
}

static void exchanges_that_follow_each_other_at_once_stay_apart(void)
{
  rm_comm comm = world();

  for (int i = 0; i < 300; i++) send_upwards(&comm, i * i % 7, i % 3 ? comm.size : i % (comm.size + 1));
  rm_comm_free(&comm);
}

static void only_those_who_have_something_to_say_send_anything(void)
{
  rm_comm comm = world();

  sends_ = alltoalls_ = 0;
  send_upwards(&comm, 1, comm.size - 1);
  RT_EQ(sends_, comm.rank < comm.size - 1 ? 2 : 0); /* how much, and that */
  send_upwards(&comm, comm.size, comm.size); /* to themselves */
  RT_EQ(sends_, comm.rank < comm.size - 1 ? 2 : 0);
  RT_EQ(alltoalls_, 0);
  rm_comm_free(&comm);
}

static void a_rank_without_memory_stops_the_exchange_everywhere(void)
{
  rm_comm   comm  = world();
  rm_arena *arena = rm_arena_new();
  int64_t  *send_offset, *recv_offset, *send;
  void     *recv = NULL;

  send_offset = rm_arena_zero(arena, comm.size + 1, sizeof *send_offset);
  recv_offset = rm_arena_zero(arena, comm.size + 1, sizeof *recv_offset);
  send        = rm_arena_zero(arena, comm.size, sizeof *send);
  for (int r = 0; r <= comm.size; r++) send_offset[r] = r;
  if (comm.rank == comm.size / 2) rm_arena_fail_at(arena, 1);
  RT_EQ(rm_comm_exchange(&comm, arena, sizeof *send, send_offset, send, recv_offset, &recv), REMAP_NO_MEMORY);
  rm_arena_fail_at(arena, 0);
  RT_EQ(rm_comm_exchange(&comm, arena, sizeof *send, send_offset, send, recv_offset, &recv), REMAP_OK);
  rm_arena_drop(arena);
  rm_comm_free(&comm);
}

/* Every rank wants `each` items of each rank whose distance upwards is in 0..reach, in an order of its own. */
static int64_t wants(const rm_comm *comm, int reach, int each, int *rank, rm_lid *item)
{
  int64_t n = 0;

  for (int r = 0; r < comm->size; r++) {
    if ((r - comm->rank + comm->size) % comm->size > reach) continue;
    for (int i = 0; i < each; i++) {
      rank[n]   = r;
      item[n++] = (rm_lid)((i * 7 + comm->rank) % 50);
    }
  }
  return n;
}

static void run_and_check(const rm_comm *comm, int64_t chunk, const rm_plan *plan, int width, int64_t n, const int *rank,
                          const rm_lid *item)
{
  const size_t size     = sizeof(int64_t) * (size_t)width;
  int64_t     *mine     = malloc(50 * size);
  int64_t     *received = malloc((size_t)n * size + 1);
  void        *buffer   = malloc((size_t)plan->send_offset[plan->num_send] * size + 1);

  if (mine && received && buffer) {
    for (int i = 0; i < 50 * width; i++) mine[i] = comm->rank * 10000 + i;
    RT_EQ(rm_plan_run_chunked(comm, chunk, plan, size, mine, received, buffer), REMAP_OK);
    for (int64_t k = 0; k < n; k++)
      for (int w = 0; w < width; w++) RT_EQ(received[k * width + w], rank[k] * 10000 + item[k] * width + w);
  }
  free(mine);
  free(received);
  free(buffer);
}

static void a_plan_brings_what_each_rank_wants_again_and_again(void)
{
  rm_comm comm = world();

  for (int reach = 0; reach < 3; reach++) {
    rm_arena      *arena = rm_arena_new();
    int           *rank  = rm_arena_alloc(arena, comm.size * 40, sizeof *rank);
    rm_lid        *item  = rm_arena_alloc(arena, comm.size * 40, sizeof *item);
    const int64_t  n     = wants(&comm, reach, 40, rank, item);
    const rm_plan *plan  = NULL;

    RT_EQ(rm_plan_build(&comm, arena, n, rank, item, &plan), REMAP_OK);
    if (rt_all(plan != NULL)) {
      RT_EQ(plan->num_recv, reach < comm.size ? reach + 1 : comm.size);
      RT_EQ(plan->num_send, plan->num_recv);
      RT_EQ(plan->recv_offset[plan->num_recv], n);
      for (int i = 1; i < plan->num_recv; i++) RT_CHECK(plan->recv_rank[i - 1] < plan->recv_rank[i]);
      for (int i = 1; i < plan->num_send; i++) RT_CHECK(plan->send_rank[i - 1] < plan->send_rank[i]);
      for (int width = 1; width <= 3; width++) run_and_check(&comm, RM_COMM_CHUNK, plan, width, n, rank, item);
      for (int64_t chunk = 1; chunk < 1000; chunk *= 7) run_and_check(&comm, chunk, plan, 2, n, rank, item);
    }
    rm_arena_drop(arena);
  }
  rm_comm_free(&comm);
}

/* Two flows under way at once, of runs of several sizes; the last rank's status reaches whoever hears from it. */
static void flows_bring_items_and_the_worst_status_of_their_senders(void)
{
  rm_comm comm = world();

  for (int64_t chunk = 1; chunk < 1000; chunk *= 7) {
    rm_arena      *arena = rm_arena_new();
    int           *rank  = rm_arena_alloc(arena, comm.size * 40, sizeof *rank);
    rm_lid        *item  = rm_arena_alloc(arena, comm.size * 40, sizeof *item);
    const int64_t  n     = wants(&comm, 2, 40, rank, item);
    const rm_plan *plan  = NULL;
    rm_flow        flow[2];
    double         mine[2][50];

    RT_EQ(rm_plan_build(&comm, arena, n, rank, item, &plan), REMAP_OK);
    for (int f = 0; f < 2; f++) RT_EQ(rm_flow_init_chunked(arena, chunk, plan, f, sizeof *mine[f], &flow[f]), REMAP_OK);
    for (int run = 0; run < 3; run++) {
      const remap_status said    = run == 1 && comm.rank == comm.size - 1 ? REMAP_COVERAGE : REMAP_OK;
      rm_note            note[2] = {{7, (int32_t)said, 0, 0}, {run == 2 ? (uint64_t)comm.rank : 7, (int32_t)said, 0, 0}};
      bool               hears   = false;
      int                others  = 0;

      for (int f = 0; f < 2; f++) {
        for (int k = 0; k < 50; k++) mine[f][k] = 1000 * comm.rank + 100 * f + k;
        RT_EQ(rm_flow_post(&comm, &flow[f], NULL, false, sizeof **mine, mine[f], note[f]), REMAP_OK);
        memset(mine[f], 0, sizeof mine[f]); /* on their way */
      }
      for (int64_t k = 0; k < n; k++) hears |= rank[k] == comm.size - 1, others += rank[k] != comm.rank;
      for (int f = 0; f < 2; f++) {
        const double *got = (const double *)(const void *)flow[f].received;

        RT_EQ(rm_flow_wait(&comm, &flow[f], NULL, &note[f]), run == 2 && f == 1 && others ? REMAP_BAD_ARGUMENT : REMAP_OK);
        for (int64_t k = 0; k < n; k++)
          RT_NEAR(got[k], run == 2 && f == 1 && rank[k] != comm.rank ? 0.0 : 1000 * rank[k] + 100 * f + item[k], 0.0);
        RT_EQ(note[f].status, run == 1 && hears ? REMAP_COVERAGE : said);
      }
    }
    rm_arena_drop(arena);
  }
  rm_comm_free(&comm);
}

/* The last rank says something else, and sends items of another size: it and its peers are apart from each other, nobody else
 * is, and all of it is forgotten in the next run. */
static void who_says_something_else_is_apart_from_its_peers(void)
{
  for (int64_t chunk = 30; chunk <= 1 << 20; chunk *= 1 << 15) {
    rm_comm         comm  = world();
    rm_arena       *arena = rm_arena_new();
    int            *rank  = rm_arena_alloc(arena, comm.size * 300, sizeof *rank);
    rm_lid         *item  = rm_arena_alloc(arena, comm.size * 300, sizeof *item);
    const int64_t   n     = wants(&comm, 2, 300, rank, item);
    const bool      is_last = comm.rank == comm.size - 1;
    const rm_plan  *plan  = NULL;
    const rm_peers *peers = NULL;
    rm_parley       parley;
    rm_flow         flow;
    double          mine[300][2];

    RT_EQ(rm_plan_build(&comm, arena, n, rank, item, &plan), REMAP_OK);
    RT_EQ(rm_peers_build(arena, &comm, 1, &plan, &peers), REMAP_OK);
    RT_EQ(rm_parley_init(arena, peers, &parley), REMAP_OK);
    RT_EQ(rm_flow_init_chunked(arena, chunk, plan, 0, sizeof *mine, &flow), REMAP_OK);
    for (int run = 0; run < 6; run++) {
      const bool   differs = run % 2 == 0, is_odd = is_last && differs;
      const size_t size    = is_odd == (run % 4 == 0) ? sizeof **mine : sizeof *mine; /* longer or shorter than the others' */
      rm_note      note    = {is_odd ? 11 : 12, REMAP_OK, 0, 0};
      bool         all     = true, meets_odd = false;

      for (int k = 0; k < 300; k++) mine[k][0] = mine[k][1] = 1000 * comm.rank + k;
      RT_EQ(rm_flow_post(&comm, &flow, &parley, true, size, mine, note), REMAP_OK);
      const remap_status status = rm_flow_wait(&comm, &flow, &parley, &note);
      for (int p = 0; p < peers->num; p++) {
        RT_EQ(parley.is_apart[p], differs && (is_last || peers->rank[p] == comm.size - 1));
        meets_odd |= differs && (is_last || peers->rank[p] == comm.size - 1);
      }
      RT_EQ(status, meets_odd ? REMAP_BAD_ARGUMENT : REMAP_OK);
      RT_EQ(rm_parley_all(&comm, &parley, &all), REMAP_OK);
      RT_CHECK(all == (!differs || comm.size == 1));
    }
    rm_arena_drop(arena);
    rm_comm_free(&comm);
  }
}

static void only_neighbours_take_part_in_a_plan(void)
{
  rm_comm        comm  = world();
  rm_arena      *arena = rm_arena_new();
  const int      rank  = 0;
  const rm_lid   item  = 3;
  const rm_plan *plan  = NULL;

  /* Only the last rank wants something, of the first: the others run nothing at all, not even this call. */
  RT_EQ(rm_plan_build(&comm, arena, comm.rank == comm.size - 1, &rank, &item, &plan), REMAP_OK);
  if (rt_all(plan != NULL) && (comm.rank == 0 || comm.rank == comm.size - 1)) {
    const double mine[4]  = {0.0, 1.0, 2.0, 3.0};
    double       received = 0.0, buffer;

    RT_EQ(plan->num_send, comm.rank == 0);
    RT_EQ(plan->num_recv, comm.rank == comm.size - 1);
    RT_EQ(rm_plan_run(&comm, plan, sizeof *mine, mine, &received, &buffer), REMAP_OK);
    if (comm.rank == comm.size - 1) RT_NEAR(received, 3.0, 0.0);
  }
  rm_arena_drop(arena);
  rm_comm_free(&comm);
}

static void a_rank_without_memory_stops_a_plan_everywhere(void)
{
  rm_comm comm = world();
  int     failures;

  for (failures = 0; failures < 100; failures++) {
    rm_arena      *arena = rm_arena_new();
    int           *rank  = rm_arena_alloc(arena, comm.size * 40, sizeof *rank);
    rm_lid        *item  = rm_arena_alloc(arena, comm.size * 40, sizeof *item);
    const int64_t  n     = wants(&comm, 2, 40, rank, item);
    const rm_plan *plan  = NULL;
    remap_status   status;

    if (comm.rank == comm.size - 1) rm_arena_fail_at(arena, failures + 1);
    status = rm_plan_build(&comm, arena, n, rank, item, &plan);
    RT_CHECK(status == REMAP_OK || status == REMAP_NO_MEMORY);
    rm_arena_drop(arena);
    if (rt_all(status == REMAP_OK)) break;
  }
  RT_EQ(failures, 7);
  rm_comm_free(&comm);
}

/* Ranks 2 k and 2 k + 1 swap; a last one without partner does not. */
static void two_ranks_swap_arrays_of_any_lengths_and_what_a_rank_has_no_room_for_is_taken_away(void)
{
  static const int64_t length[] = {0, 1, 2000, 2047, 2048, 5000, 0, 1000000};
  enum { NUM = sizeof length / sizeof *length };
  rm_comm comm = world();
  const int with = comm.rank ^ 1;

  for (int k = 0; k < 2 * NUM && with < comm.size; k++) {
    const int64_t mine = length[(k + comm.rank % 2) % NUM], its = length[(k + with % 2) % NUM];
    const bool    fails = k >= NUM && comm.rank % 2;
    rm_arena     *arena = rm_arena_new();
    int64_t      *send  = rm_arena_alloc(arena, mine, sizeof *send), num = -1;
    void         *recv  = NULL;

    for (int64_t i = 0; i < mine; i++) send[i] = word(comm.rank, with, i + k);
    if (fails) rm_arena_fail_at(arena, 1);
    RT_EQ(rm_comm_swap(&comm, arena, with, sizeof *send, mine, send, &num, &recv), fails ? REMAP_NO_MEMORY : REMAP_OK);
    RT_EQ(num, fails ? 0 : its);
    for (int64_t i = 0; i < num; i++) RT_CHECK(((int64_t *)recv)[i] == word(with, comm.rank, i + k));
    rm_arena_drop(arena);
  }
  rm_comm_free(&comm);
}

RT_MAIN(RT_CASE(items_arrive_in_the_order_of_the_senders), RT_CASE(chunks_of_any_size_give_the_same_arrays),
        RT_CASE(nothing_at_all_can_be_exchanged), RT_CASE(exchanges_that_follow_each_other_at_once_stay_apart),
        RT_CASE(only_those_who_have_something_to_say_send_anything),
        RT_CASE(a_rank_without_memory_stops_the_exchange_everywhere),
        RT_CASE(a_plan_brings_what_each_rank_wants_again_and_again),
        RT_CASE(flows_bring_items_and_the_worst_status_of_their_senders),
        RT_CASE(who_says_something_else_is_apart_from_its_peers), RT_CASE(only_neighbours_take_part_in_a_plan),
        RT_CASE(a_rank_without_memory_stops_a_plan_everywhere),
        RT_CASE(two_ranks_swap_arrays_of_any_lengths_and_what_a_rank_has_no_room_for_is_taken_away))
