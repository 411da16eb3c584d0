/* Rows of a supermesh that is dealt out to ranks come back in the order of their numbers, whatever rank had them. */
#include "base.h"
#include "blocks.h"
#include "counted.h"
#include "rt.h"

static const int SIZE[3] = {3, 2, 4};

static void slices_cover_all_rows_and_differ_by_one(void)
{
  for (int64_t n = 0; n < 40; n++)
    for (int size = 1; size < 9; size++) {
      RT_EQ(ra_share(n, 0, size), 0);
      RT_EQ(ra_share(n, size, size), n);
      for (int r = 0; r < size; r++) {
        const int64_t num = ra_share(n, r + 1, size) - ra_share(n, r, size);

        RT_CHECK(num == n / size || num == n / size + 1);
      }
    }
}

static void rows_of_any_length_arrive_in_order(void)
{
  const int64_t total = 50;
  int64_t       global[50], offset[51] = {0}, word[5000], num = 0;
  rslice_rows   rows;

  for (int64_t g = total - 1; g >= 0; g--) { /* row g: g times g; every third row is given by two ranks */
    if (g % rt_size() != rt_rank() && (g % 3 || (g + 1) % rt_size() != rt_rank())) continue;
    offset[num + 1] = offset[num];
    for (int64_t i = 0; i < g; i++) word[offset[num + 1]++] = g;
    global[num++] = g;
  }
  for (int64_t chunk = 1; chunk <= RSLICE_CHUNK; chunk *= 11) {
    RT_EQ(rslice_ship_chunked(MPI_COMM_WORLD, RSLICE_OK, chunk, total, num, global, offset, word, &rows), RSLICE_OK);
    RT_EQ(rows.first, ra_share(total, rt_rank(), rt_size()));
    for (int64_t i = 0; i < rows.num; i++) {
      RT_EQ(rows.offset[i + 1] - rows.offset[i], rows.first + i);
      for (int64_t k = rows.offset[i]; k < rows.offset[i + 1]; k++) RT_EQ(rows.word[k], rows.first + i);
    }
    rslice_drop(&rows);
  }
}

/* Records of three bytes; rank a has (a + 2 b) % 5 * 7 of them for rank b. */
static int64_t records(int a, int b) { return (a + 2 * b) % 5 * 7; }

static void records_arrive_whatever_the_size_of_messages(void)
{
  char    send[64 * 35][3];
  int64_t send_count[64], recv_count[64], num = 0;

  for (int r = 0; r < rt_size(); r++) {
    send_count[r] = records(rt_rank(), r);
    for (int64_t i = 0; i < send_count[r]; i++, num++) {
      send[num][0] = (char)rt_rank();
      send[num][1] = (char)r;
      send[num][2] = (char)i;
    }
  }
  for (int64_t chunk = 1; chunk <= RSLICE_CHUNK; chunk = 3 * chunk + 1) {
    void *recv = NULL;
    char *at;

    RT_EQ(rslice_exchange(MPI_COMM_WORLD, RSLICE_OK, chunk, sizeof *send, send_count, send, recv_count, &recv), RSLICE_OK);
    at = recv;
    for (int r = 0; r < rt_size(); r++) {
      RT_EQ(recv_count[r], records(r, rt_rank()));
      for (int64_t i = 0; i < recv_count[r]; i++, at += 3) RT_CHECK(at[0] == r && at[1] == rt_rank() && at[2] == i);
    }
    free(recv);
  }
}

static void only_those_who_have_records_send_any(void)
{
  const int  next = (rt_rank() + 1) % rt_size();
  int64_t    send_count[64] = {0}, recv_count[64];
  const char record = (char)rt_rank();
  double     counts[5];
  void      *recv = NULL;

  send_count[next] = 1;
  counted_take(NULL);
  if (!RT_EQ(rslice_exchange(MPI_COMM_WORLD, RSLICE_OK, RSLICE_CHUNK, 1, send_count, &record, recv_count, &recv), RSLICE_OK))
    return;
  counted_take(counts);
  RT_CHECK(counts[0] == (rt_size() > 1 ? 2 : 0)); /* how much, and the record */
  RT_CHECK(counts[4] == 2 * sizeof(int));         /* from two agreements */
  RT_EQ(*(char *)recv, (rt_rank() + rt_size() - 1) % rt_size());
  free(recv);
}

static void a_rank_in_trouble_stops_the_exchange_everywhere(void)
{
  int64_t send_count[64] = {0}, recv_count[64];
  void   *recv = NULL;

  for (int failing = 0; failing < rt_size(); failing++) {
    const rslice_status mine = rt_rank() == failing ? RSLICE_INTERNAL : RSLICE_OK;

    RT_EQ(rslice_exchange(MPI_COMM_WORLD, mine, RSLICE_CHUNK, 8, mine ? NULL : send_count, NULL, recv_count, &recv),
          RSLICE_INTERNAL);
    RT_CHECK(!recv);
  }
}

static void a_row_that_nobody_has_is_an_error_on_all_ranks(void)
{
  const int64_t global[1] = {0}, offset[2] = {0, 1}, word[1] = {7};
  rslice_rows   rows;

  RT_EQ(rslice_ship(MPI_COMM_WORLD, RSLICE_OK, 2, 1, global, offset, word, &rows), RSLICE_INTERNAL);
  RT_CHECK(!rows.offset && !rows.word);
  RT_EQ(rslice_ship(MPI_COMM_WORLD, rt_rank() ? RSLICE_OK : RSLICE_MEMORY, 1, 1, global, offset, word, &rows), RSLICE_MEMORY);
}

/* What every rank's slices hold together equals what one rank alone makes of the whole. */
static void check_rows(const rslice_rows *rows, const rslice_rows *whole)
{
  for (int64_t i = 0; i < rows->num; i++) {
    const int64_t at = whole->offset[rows->first + i], n = whole->offset[rows->first + i + 1] - at;

    if (RT_EQ(rows->offset[i + 1] - rows->offset[i], n))
      RT_CHECK(!memcmp(rows->word + rows->offset[i], whole->word + at, (size_t)n * sizeof(int64_t)));
  }
}

static void nodes_faces_and_cells_do_not_depend_on_who_has_them(void)
{
  bl_blocks  *mine = bl_new(SIZE, rt_rank(), rt_size()), *all = bl_new(SIZE, 0, 1);
  rslice_rows rows, whole;

  RT_EQ(rslice_nodes(MPI_COMM_WORLD, &mine->view, &rows), RSLICE_OK);
  RT_EQ(rslice_nodes(MPI_COMM_SELF, &all->view, &whole), RSLICE_OK);
  check_rows(&rows, &whole);
  rslice_drop(&rows);
  rslice_drop(&whole);
  RT_EQ(rslice_faces(MPI_COMM_WORLD, &mine->content, &rows), RSLICE_OK);
  RT_EQ(rslice_faces(MPI_COMM_SELF, &all->content, &whole), RSLICE_OK);
  check_rows(&rows, &whole);
  for (int64_t f = 0; f < whole.num; f++) {
    const int64_t *row = whole.word + whole.offset[f];

    RT_CHECK(row[1] < 0 || row[0] < row[1]);
    RT_CHECK((row[1] < 0) == (row[2] >= 0));
    RT_EQ(row[3], 1 + 2 * (f % 3 == 0));
    for (int i = 1; i < 4; i++) RT_CHECK(row[RSLICE_FACE_HEAD] < row[RSLICE_FACE_HEAD + i]);
  }
  rslice_drop(&rows);
  rslice_drop(&whole);
  for (int with_loops = 0; with_loops < 2; with_loops++) {
    RT_EQ(rslice_cells(MPI_COMM_WORLD, &mine->content, with_loops, &rows), RSLICE_OK);
    RT_EQ(rslice_cells(MPI_COMM_SELF, &all->content, with_loops, &whole), RSLICE_OK);
    check_rows(&rows, &whole);
    RT_EQ(whole.offset[1] - whole.offset[0], rslice_cell_head(&all->content) + (with_loops ? 37 : 6));
    rslice_drop(&rows);
    rslice_drop(&whole);
  }
  bl_free(mine);
  bl_free(all);
}

RT_MAIN(RT_CASE(slices_cover_all_rows_and_differ_by_one), RT_CASE(rows_of_any_length_arrive_in_order),
        RT_CASE(records_arrive_whatever_the_size_of_messages), RT_CASE(only_those_who_have_records_send_any),
        RT_CASE(a_rank_in_trouble_stops_the_exchange_everywhere),
        RT_CASE(a_row_that_nobody_has_is_an_error_on_all_ranks), RT_CASE(nodes_faces_and_cells_do_not_depend_on_who_has_them))
