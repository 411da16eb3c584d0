/* Rows of sections without an index, against the rows that were written: hexahedra in a line among polygons of any length,
 * whose nodes look like heads of rows. */
#include "files.h"

enum { POLYGON = 22, HEXA = 17, QUAD = 7 };

/* A MIXED section as it was written. */
typedef struct section {
  int64_t  num_rows, num_cells, length;
  int64_t *row, *offset; /* [length], [num_rows + 1] */
  int64_t *cells;        /* [num_rows + 1] hexahedra before a row */
} section;

static void section_free(section *s)
{
  free(s->row);
  free(s->offset);
  free(s->cells);
}

/* Values of the next row: a hexahedron, a quadrangle, or a polygon that has thousands of nodes with a chance of 1 / rarity. */
static int64_t add_row(section *s, int64_t rarity, int64_t most_cells, uint64_t *state)
{
  int64_t *row = s->row + s->length;
  int64_t  n   = 4;

  if (s->num_cells < most_cells && tm_random(state, 2)) {
    static const int64_t corner[8] = {0, 1, 2, 3, 4, 5, 6, 7};

    row[0] = HEXA;
    for (n = 0; n < 8; n++) row[1 + n] = 4 * s->num_cells + 1 + corner[n];
    s->num_cells++;
    return 1 + n;
  }
  if (tm_random(state, rarity) == 0) n = 300 + tm_random(state, 3000);
  else if (tm_random(state, 2)) n = 3 + tm_random(state, 40); /* newer files have elements of these codes */
  row[0] = n == 4 && tm_random(state, 2) ? QUAD : POLYGON + n;
  for (int64_t i = 0; i < n; i++) row[1 + i] = 1 + tm_random(state, 40); /* most of these could be heads */
  return 1 + n;
}

static section draw(int64_t num_rows, int64_t rarity, int64_t num_cells, uint64_t seed)
{
  section  s     = {.num_rows = num_rows};
  uint64_t state = tm_mix_(seed);

  s.row    = tm_alloc_(num_rows * (rarity < 50 ? 3301 : 400), sizeof *s.row);
  s.offset = tm_alloc_(num_rows + 1, sizeof *s.offset);
  s.cells  = tm_alloc_(num_rows + 1, sizeof *s.cells);
  for (int64_t r = 0; r <= num_rows; r++) {
    s.offset[r] = s.length;
    s.cells[r]  = s.num_cells;
    if (r < num_rows) s.length += add_row(&s, rarity, num_cells, &state);
  }
  return s;
}

/* A file with the section and the nodes of its hexahedra. Collective. */
static void write_file(const section *s, const char *path)
{
  cf_file      *f    = cf_new(3.1);
  const int64_t n    = 4 * (s->num_cells + 11);
  const int64_t zone = cf_zone(f, cf_base(f), "Zone", 1, (int64_t[]){n, s->num_cells, 0});
  double       *xyz  = tm_alloc_(3 * n, sizeof *xyz);

  for (int64_t i = 0; i < n; i++) {
    xyz[3 * i]     = (double)(i / 4);
    xyz[3 * i + 1] = i % 4 == 1 || i % 4 == 2;
    xyz[3 * i + 2] = i % 4 >= 2;
  }
  cf_coordinates(f, zone, xyz, 1, &n);
  cf_section(f, zone, "Mixed", 20, 1, s->num_rows, s->length, s->row);
  cf_write(f, path);
  free(xyz);
}

/* The cuts of all ranks together are those of the section, and no rank has more than its share of rows. */
static void check_cuts(const section *s, const rc_section *got)
{
  const rc_cut *cut = got->cut.item;

  RT_EQ(cf_count(got->cut.count), (s->num_rows + RC_CUT - 1) / RC_CUT);
  for (int64_t i = 0; i < got->cut.count; i++) {
    RT_EQ(cut[i].row % RC_CUT, 0);
    RT_EQ(cut[i].at, s->offset[cut[i].row]);
    RT_EQ(cut[i].cell, s->cells[cut[i].row]);
    RT_CHECK(cut[i].at >= ra_share(s->length, rt_rank(), rt_size()));
    RT_CHECK(cut[i].at < ra_share(s->length, rt_rank() + 1, rt_size()));
  }
}

/* Every rank asks for cuts, and reads rows, of its own. Collective. */
static void check_reading(const section *s, rcgns_file *file, const rc_zone *zone, const rc_section *got, uint64_t *state)
{
  const int64_t lo = tm_random(state, s->num_rows), hi = lo + tm_random(state, s->num_rows - lo + 1);
  const int64_t cell[2] = {s->cells[lo], s->cells[hi]};
  ra_array      offset = {.item = NULL}, data = {.item = NULL};
  rc_cut        found[2];
  rcgns_message why;

  RT_EQ(rc_cuts_find(file, RCGNS_OK, got, true, 2, cell, found, &why), RCGNS_OK);
  for (int k = 0; k < 2; k++) {
    const int64_t next = found[k].row + RC_CUT;

    RT_EQ(found[k].at, s->offset[found[k].row]);
    RT_EQ(found[k].cell, s->cells[found[k].row]);
    RT_CHECK(found[k].cell <= cell[k] && (next >= s->num_rows || s->cells[next] > cell[k]));
  }
  if (!RT_EQ(rc_rows_read(file, zone, got, lo, hi, &offset, &data, &why), RCGNS_OK)) return;
  RT_EQ(data.count, s->offset[hi] - s->offset[lo]);
  for (int64_t r = lo; r <= hi; r++) RT_EQ(((int64_t *)offset.item)[r - lo], s->offset[r] - s->offset[lo]);
  RT_CHECK(!data.count || !memcmp(data.item, s->row + s->offset[lo], (size_t)data.count * sizeof(int64_t)));
  ra_drop(&offset);
  ra_drop(&data);
}

static void check_section(const section *s, uint64_t seed)
{
  uint64_t    state = tm_mix_(seed + 100 + (uint64_t)rt_rank());
  char        path[64];
  rcgns_file *file;

  cf_path(path, "rows");
  write_file(s, path);
  if ((file = cf_open(path, NULL))) {
    const rc_section *got = file->zone->section;

    RT_EQ(got->num_cells, s->num_cells);
    RT_NEAR(cf_total(file), (double)s->num_cells, 1e-9);
    check_cuts(s, got);
    for (int i = 0; i < 10; i++) check_reading(s, file, file->zone, got, &state);
    rcgns_close(&file);
  }
  cf_remove(path);
}

static void rows_are_found_wherever_slices_begin(void)
{
  for (uint64_t seed = 0; seed < 6; seed++) {
    section s = draw(seed == 0 ? 5 : 20000, 1000, seed == 0 ? 2 : 2000, seed);

    check_section(&s, seed);
    section_free(&s);
  }
}

static void rows_longer_than_slices_are_found_too(void)
{
  for (uint64_t seed = 0; seed < 6; seed++) {
    section s = draw(seed % 2 ? 20 : 1500, seed % 2 ? 1 : 5, 15, seed);

    check_section(&s, seed);
    section_free(&s);
  }
}

/* Open a file whose row r has another head: the message names that row, or what is missing at the end, on any ranks. */
static void check_damage(section *s, int64_t row, int64_t head)
{
  const int64_t kept = s->row[s->offset[row]];
  char          path[64], what[64];
  rcgns_file   *file = NULL;
  rcgns_message why  = {""};

  s->row[s->offset[row]] = head;
  cf_path(path, "damaged_rows");
  write_file(s, path);
  snprintf(what, sizeof what, "section Mixed is damaged at its row %lld:", (long long)row + 1);
  RT_EQ(rcgns_open(MPI_COMM_WORLD, path, NULL, &file, &why), RCGNS_IO);
  if (!RT_CHECK(strstr(why.text, what))) printf("# %s\n", why.text);
  RT_CHECK(!file);
  cf_remove(path);
  s->row[s->offset[row]] = kept;
}

static void a_damaged_row_is_named_whichever_rank_meets_it(void)
{
  section s = draw(3000, 100, 1000, 7);

  for (int64_t row = 0; row < s.num_rows; row += 374) check_damage(&s, row, -1);
  check_damage(&s, s.num_rows - 1, HEXA + 1); /* an element of 20 nodes that passes the end */
  s.num_rows++; /* one more than there are */
  s.offset[s.num_rows - 1] = s.offset[0];
  check_damage(&s, s.num_rows - 1, s.row[0]);
  section_free(&s);
}

RT_MAIN(RT_CASE(rows_are_found_wherever_slices_begin), RT_CASE(rows_longer_than_slices_are_found_too),
        RT_CASE(a_damaged_row_is_named_whichever_rank_meets_it))
