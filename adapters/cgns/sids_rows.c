/* sids_rows -- rows of element sections that have no index in the file: MIXED, and polygon lists with inline counts. One pass
 * over the connectivity finds the place of every RC_CUT-th row, its cut; then each rank can read just its own rows. A rank
 * keeps the cuts of the rows that it passed, and others ask it for them.
 *
 * Every rank passes a slice. Where ElementStartOffset is there it says which row a slice begins with. Where it is not, only the
 * row before tells: then a rank follows the rows from every one of the WINDOW first places of its slice, as if one began there.
 * Most of these chains soon end at what is no row, or run into another; those that are left tell for each first place where the
 * next slice is entered and how many rows later. The true places are then handed from rank to rank, each of which looks its
 * answer up. If rows are so long that a slice is entered behind its first places, its rank follows them once more from there,
 * while the others wait. So it is right in any case, and takes two passes over a slice, in blocks, of which none is kept; and P
 * messages one after the other on P ranks. */
#include "cgns_private.h"

#include <stdlib.h>
#include <string.h>

enum { BLOCK = 1 << 20, WINDOW = 256, TAG_PLACE = 30, OLD_NGON = 21, NGON = 22 };

/* ---- one row ------------------------------------------------------------------------------------------------------ */

/* Nodes of a polygon, whose code says in old files how many; 0: it is none. */
static int64_t polygon_nodes(double version, int64_t code)
{
  const int64_t polygon = version < 2.995 ? OLD_NGON : NGON;

  return version > 0.0 && version < 3.195 && code > polygon && code < RC_TOO_MANY ? code - polygon : 0;
}

int64_t rc_mixed_nodes(double version, int64_t code, rc_shape *shape)
{
  const int64_t n = polygon_nodes(version, code);

  *shape = RC_NONE;
  return n ? n : rc_element(version, code, shape);
}

int rc_mixed_surface_corners(double version, int64_t code)
{
  const int64_t n = polygon_nodes(version, code);

  return n == 0 ? rc_surface_corners(version, code) : n == 3 || n == 4 ? (int)n : 0;
}

/* Values behind the head of a row. */
static int64_t row_length(const rcgns_file *file, const rc_section *section, int64_t head, rc_shape *shape)
{
  *shape = RC_NONE;
  return section->layout == RC_MIXED ? rc_mixed_nodes(file->version, head, shape) : head;
}

/* ---- chains of rows from guessed places ----------------------------------------------------------------------------- */

/* A row: its number and where it begins. */
typedef struct place {
  int64_t row, at;
} place;

/* Rows that follow each other. */
typedef struct chain {
  int64_t at;     /* where the next one begins, -1: what is there is no row */
  int64_t rows;   /* so far; once it has joined another, more than that has */
  int     joined; /* the chain that it ran into, -1: none                   */
} chain;

/* Chains from the first places of a slice of connectivity. */
typedef struct guess {
  int64_t from, hi; /* place of the first chain; end of the slice */
  int     num;      /* of chains, from places that follow each other */
  chain   chain[WINDOW];
  int     num_live, live[WINDOW]; /* chains that go on, by ascending places, which differ */
} guess;

static void guess_begin(guess *g, int64_t from, int64_t hi, int64_t num)
{
  g->from = from;
  g->hi   = hi;
  g->num = g->num_live = (int)rc_clamp(num, 0, rc_clamp(hi - from, 0, WINDOW));
  for (int i = 0; i < g->num; i++) {
    g->chain[i] = (chain){from + i, 0, -1};
    g->live[i]  = i;
  }
}

/* Put the first of the live chains, which has gone on, where it belongs now, or let it join the one that is there. */
static void settle(guess *g)
{
  const int first = g->live[0];
  chain    *c     = &g->chain[first];
  int       k     = 0;

  while (k + 1 < g->num_live && g->chain[g->live[k + 1]].at < c->at) g->live[k] = g->live[k + 1], k++;
  g->live[k] = first;
  if (k + 1 == g->num_live || g->chain[g->live[k + 1]].at != c->at) return;
  c->joined = g->live[k + 1];
  c->rows -= g->chain[c->joined].rows;
  g->num_live--;
  memmove(g->live + k, g->live + k + 1, (size_t)(g->num_live - k) * sizeof *g->live);
}

/* Go on through data = connectivity [lo, hi). */
static void guess_block(const rcgns_file *file, const rc_section *section, guess *g, const int64_t *data, int64_t lo,
                        int64_t hi)
{
  while (g->num_live > 0 && g->chain[g->live[0]].at < hi) {
    chain        *c = &g->chain[g->live[0]];
    rc_shape      shape;
    const int64_t n = row_length(file, section, data[c->at - lo], &shape);

    if (n < 1 || n >= section->length - c->at) {
      c->at = -1;
      memmove(g->live, g->live + 1, (size_t)--g->num_live * sizeof *g->live);
      continue;
    }
    c->at += n + 1;
    c->rows++;
    settle(g);
  }
}

/* Follow the chains to the end of the slice; block is scratch. Collective. */
static rcgns_status guess_all(rcgns_file *file, const rc_section *section, guess *g, int64_t *block, rcgns_message *message)
{
  int64_t rounds = g->num ? (g->hi - g->from + BLOCK - 1) / BLOCK : 0;

  MPI_Allreduce(MPI_IN_PLACE, &rounds, 1, MPI_INT64_T, MPI_MAX, file->comm);
  for (int64_t r = 0; r < rounds; r++) {
    const int64_t end = g->num_live ? g->hi : g->from, lo = rc_clamp(g->from + r * BLOCK, g->from, end);
    const int64_t hi = rc_clamp(lo + BLOCK, lo, end);

    RC_TRY(rc_read_1d(file, RCGNS_OK, section->connectivity, lo, hi, 'I', block, message));
    if (lo < hi) guess_block(file, section, g, block, lo, hi);
  }
  return RCGNS_OK;
}

/* The first row behind the slice if it is entered there; false: that is not known. Where rows end at what is no row, the end of
 * the section: whoever passes them will say so. */
static bool guess_exit(const rc_section *section, const guess *g, place entry, place *out)
{
  int64_t c = entry.at - g->from;

  *out = entry;
  if (entry.at >= g->hi) return true;
  if (c < 0 || c >= g->num) return false;
  while (g->chain[c].joined >= 0) {
    out->row += g->chain[c].rows;
    c = g->chain[c].joined;
  }
  out->row += g->chain[c].rows;
  out->at = g->chain[c].at;
  if (out->at < 0) *out = (place){section->num_rows, section->length};
  return true;
}

/* Hand the places where slices are entered from rank to rank, as far as they are known: *entry and *after, or nothing. *stuck:
 * the rank that does not know on, -1: none. Collective. */
static void hand_on(const rcgns_file *file, const rc_section *section, const guess *g, place *entry, place *after, int *stuck)
{
  enum { UNKNOWN = -1 };
  place known = {0, 0}, next = {0, UNKNOWN};

  if (file->rank > 0)
    MPI_Recv(&known, 2, MPI_INT64_T, file->rank - 1, TAG_PLACE, file->comm, MPI_STATUS_IGNORE);
  *stuck = -1;
  if (known.at != UNKNOWN && !guess_exit(section, g, known, &next)) {
    next.at = UNKNOWN;
    *stuck  = file->rank;
  }
  if (file->rank + 1 < file->size) MPI_Send(&next, 2, MPI_INT64_T, file->rank + 1, TAG_PLACE, file->comm);
  *entry = known;
  *after = next;
  MPI_Allreduce(MPI_IN_PLACE, stuck, 1, MPI_INT, MPI_MAX, file->comm);
}

/* The first row of this rank's slice, and the first one behind it. Collective; block is scratch. */
static rcgns_status find_entries(rcgns_file *file, const rc_section *section, int64_t *block, place *entry, place *after,
                                 rcgns_message *message)
{
  const int64_t lo      = ra_share(section->length, file->rank, file->size);
  const int64_t hi      = ra_share(section->length, file->rank + 1, file->size);
  const bool    is_last = file->rank == file->size - 1;
  guess         g;
  int           stuck = -1;

  guess_begin(&g, lo, is_last ? lo : hi, file->rank ? WINDOW : 1); /* the first row is known, behind the last is nothing */
  do {
    RC_TRY(guess_all(file, section, &g, block, message));
    hand_on(file, section, &g, entry, after, &stuck);
    if (file->rank == stuck) guess_begin(&g, entry->at, hi, 1);
    else if (stuck >= 0) g.num_live = 0;
  } while (stuck >= 0);
  if (is_last) *after = (place){section->num_rows, section->length};
  return RCGNS_OK;
}

/* ---- cuts --------------------------------------------------------------------------------------------------------- */

/* A walk along ElementConnectivity. */
typedef struct scan {
  const rcgns_file *file;
  rc_section       *section;
  place             next, end; /* the next row; where this rank stops */
  int64_t           cells, curved;
  bool              has_memory;
} scan;

/* Rows that begin in data = connectivity [lo, hi). */
static bool scan_block(scan *s, const int64_t *data, int64_t lo, int64_t hi)
{
  rc_section *section = s->section;

  for (; s->next.row < s->end.row && s->next.at < hi; s->next.row++) {
    rc_shape      shape;
    const int64_t n     = row_length(s->file, section, data[s->next.at - lo], &shape);
    const bool    inner = s->next.row >= section->row_lo && s->next.row < section->row_hi;

    if (n < 1 || n >= s->end.at - s->next.at) return false;
    if (s->next.row % RC_CUT == 0) {
      s->has_memory = s->has_memory && ra_reserve(&section->cut, 1, sizeof(rc_cut));
      if (!s->has_memory) return false;
      ((rc_cut *)section->cut.item)[section->cut.count++] = (rc_cut){s->next.row, s->next.at, s->cells};
    }
    s->cells += inner && (section->is_poly || shape != RC_NONE);
    s->curved |= shape != RC_NONE && n > rc_corners(shape);
    s->next.at += n + 1;
  }
  return true;
}

/* Where this rank begins and stops, by ElementStartOffset: whole numbers of cuts. Collective. */
static rcgns_status begin_by_offsets(rcgns_file *file, scan *s, rcgns_message *message)
{
  const rc_section *section = s->section;
  const int64_t     cuts    = (section->num_rows + RC_CUT - 1) / RC_CUT;
  bool              any;

  s->next.row = rc_clamp(ra_share(cuts, file->rank, file->size) * RC_CUT, 0, section->num_rows);
  s->end.row  = rc_clamp(ra_share(cuts, file->rank + 1, file->size) * RC_CUT, 0, section->num_rows);
  any         = s->next.row < s->end.row;
  RC_TRY(rc_read_1d(file, RCGNS_OK, section->offsets, s->next.row, s->next.row + any, 'I', &s->next.at, message));
  RC_TRY(rc_read_1d(file, RCGNS_OK, section->offsets, s->end.row, s->end.row + any, 'I', &s->end.at, message));
  if (any && (s->next.at < 0 || s->next.at > s->end.at || s->end.at > section->length))
    s->next.at = s->end.at = -1; /* scan_all will refuse */
  return RCGNS_OK;
}

/* Pass the rows of this rank. Collective; block is scratch. */
static rcgns_status scan_all(rcgns_file *file, const rc_zone *zone, scan *s, int64_t *block, rcgns_message *message)
{
  const int64_t begin = s->next.at, end = s->end.at;
  int64_t       rounds = (end - begin + BLOCK - 1) / BLOCK;
  bool          ok     = true;
  rcgns_status  status = RCGNS_OK;

  MPI_Allreduce(MPI_IN_PLACE, &rounds, 1, MPI_INT64_T, MPI_MAX, file->comm);
  for (int64_t r = 0; r < rounds; r++) {
    const int64_t lo = begin + r * BLOCK, hi = lo + BLOCK < end ? lo + BLOCK : end;

    RC_TRY(rc_read_1d(file, RCGNS_OK, s->section->connectivity, lo, hi < lo ? lo : hi, 'I', block, message));
    ok = ok && (lo >= hi || scan_block(s, block, lo, hi));
  }
  if (!s->has_memory) status = rc_no_memory(message);
  else if (!ok || s->next.row != s->end.row || s->next.at != s->end.at)
    status = rc_fail(message, RCGNS_IO,
                     "%s: zone %s: section %s is damaged at its row %lld: its rows do not fill its connectivity", file->path,
                     zone->name, rc_node_at(&file->tree, rc_node_at(&file->tree, s->section->connectivity)->parent)->name,
                     (long long)rc_clamp(s->next.row, 0, s->section->num_rows) + 1);
  return rc_agree(file->comm, status, message);
}

rcgns_status rc_rows_scan(rcgns_file *file, const rc_zone *zone, rc_section *section, bool *curved, rcgns_message *message)
{
  scan         s      = {.file = file, .section = section, .has_memory = true};
  int64_t     *block  = ra_alloc(BLOCK, sizeof *block), before = 0, sum[2];
  rcgns_status status = block ? RCGNS_OK : rc_no_memory(message);

  RC_GOTO(done, status = rc_agree(file->comm, status, message));
  RC_GOTO(done, status = section->offsets >= 0 ? begin_by_offsets(file, &s, message)
                                               : find_entries(file, section, block, &s.next, &s.end, message));
  RC_GOTO(done, status = scan_all(file, zone, &s, block, message));
  MPI_Exscan(&s.cells, &before, 1, MPI_INT64_T, MPI_SUM, file->comm);
  for (int64_t i = 0; i < section->cut.count && file->rank > 0; i++) ((rc_cut *)section->cut.item)[i].cell += before;
  sum[0] = s.cells;
  sum[1] = s.curved;
  MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPI_INT64_T, MPI_SUM, file->comm);
  section->num_cells = sum[0];
  *curved |= sum[1] > 0;
done:
  free(block);
  return status;
}

static int64_t key_of(const rc_cut *cut, bool by_cell) { return by_cell ? cut->cell : cut->row; }

/* The last of this rank's cuts whose key is no greater. */
static rc_cut last_cut(const rc_section *section, bool by_cell, int64_t key)
{
  const rc_cut *cut = section->cut.item;
  int64_t       low = 0, high = section->cut.count;

  while (high - low > 1) {
    const int64_t mid = low + (high - low) / 2;

    if (key_of(&cut[mid], by_cell) <= key) low = mid;
    else high = mid;
  }
  return cut[low];
}

rcgns_status rc_cuts_find(rcgns_file *file, rcgns_status mine, const rc_section *section, bool by_cell, int num,
                          const int64_t *key, rc_cut *found, rcgns_message *message)
{
  int64_t     *first = calloc(3 * (size_t)file->size, sizeof *first); /* [ranks] least keys; ask; asked */
  int64_t     *ask = first ? first + file->size : NULL, *asked = first ? ask + file->size : NULL;
  int64_t      least = section->cut.count ? key_of(section->cut.item, by_cell) : INT64_MAX, total = 0;
  void        *keys = NULL, *back = NULL;
  rc_cut      *answer = NULL;
  rcgns_status status = mine == RCGNS_OK && !first ? rc_no_memory(message) : mine;

  RC_GOTO(done, status = rc_agree(file->comm, status, message));
  MPI_Allgather(&least, 1, MPI_INT64_T, first, 1, MPI_INT64_T, file->comm);
  for (int i = 0; i < num; i++) {
    int owner = 0;

    for (int r = 0; r < file->size; r++)
      if (first[r] <= key[i]) owner = r;
    ask[owner]++;
  }
  RC_GOTO(done, status = rc_exchange(file->comm, RCGNS_OK, key, ask, sizeof *key, &keys, asked, message));
  for (int r = 0; r < file->size; r++) total += asked[r];
  if (!(answer = ra_alloc(total, sizeof *answer))) status = rc_no_memory(message);
  for (int64_t i = 0; i < total && answer; i++) answer[i] = last_cut(section, by_cell, ((const int64_t *)keys)[i]);
  RC_GOTO(done, status = rc_exchange(file->comm, status, answer, asked, sizeof *answer, &back, ask, message));
  if (num) memcpy(found, back, (size_t)num * sizeof *found);
done:
  free(first);
  free(keys);
  free(answer);
  free(back);
  return status;
}

/* ---- reading ------------------------------------------------------------------------------------------------------ */

/* Where rows [lo, hi) of a section with offsets lie, and what they begin with. Collective. */
static rcgns_status span_by_offsets(rcgns_file *file, rcgns_status mine, const rc_zone *zone, const rc_section *section,
                                    int64_t lo, int64_t hi, int64_t *at, int64_t span[2], rcgns_message *message)
{
  const int64_t n = hi - lo;

  RC_TRY(rc_read_1d(file, mine, section->offsets, lo, n ? hi + 1 : lo, 'I', at, message));
  span[0] = n ? at[0] : 0;
  span[1] = n ? at[n] : 0;
  for (int64_t i = 0; i < n; i++)
    if (at[i] < 0 || at[i] > at[i + 1] || at[i + 1] > section->length)
      return rc_fail(message, RCGNS_IO, "%s: zone %s: ElementStartOffset is not ascending at row %lld", file->path, zone->name,
                     (long long)(lo + i + 1));
  return RCGNS_OK;
}

/* The same between the cuts about rows [lo, hi) of a section without. Collective. */
static rcgns_status span_by_cuts(rcgns_file *file, rcgns_status mine, const rc_section *section, int64_t lo, int64_t hi,
                                 int64_t span[2], rcgns_message *message)
{
  const int64_t key[2] = {lo / RC_CUT * RC_CUT, (hi + RC_CUT - 1) / RC_CUT * RC_CUT};
  rc_cut        found[2] = {{0, 0, 0}, {0, section->length, 0}};

  RC_TRY(rc_cuts_find(file, mine, section, false, lo == hi ? 0 : key[1] < section->num_rows ? 2 : 1, key, found, message));
  span[0] = lo == hi ? 0 : found[0].at;
  span[1] = lo == hi ? 0 : found[1].at;
  return RCGNS_OK;
}

/* Of the rows from the cut below lo on, which the scan found sound, keep [lo, hi); at [hi - lo + 1]. */
static void keep_rows(const rcgns_file *file, const rc_section *section, int64_t lo, int64_t hi, int64_t *at, ra_array *data)
{
  const int64_t skip = section->layout == RC_MIXED ? 0 : 1;
  int64_t      *in = data->item, kept = 0, p = 0;

  for (int64_t row = lo / RC_CUT * RC_CUT; row < hi && lo < hi; row++) {
    rc_shape      shape;
    const int64_t length = row_length(file, section, in[p], &shape), size = length + 1 - skip;

    if (row >= lo) {
      at[row - lo] = kept;
      memmove(in + kept, in + p + skip, (size_t)size * sizeof *in);
      kept += size;
    }
    p += length + 1;
  }
  at[hi - lo] = kept;
  data->count = kept;
}

rcgns_status rc_rows_read(rcgns_file *file, const rc_zone *zone, const rc_section *section, int64_t lo, int64_t hi,
                          ra_array *offset, ra_array *data, rcgns_message *message)
{
  const int64_t n       = hi - lo;
  const bool    indexed = section->layout == RC_OFFSETS;
  int64_t       span[2] = {0, 0}, *at;
  rcgns_status  status  = RCGNS_OK;

  offset->count = data->count = 0;
  if (!ra_reserve(offset, n + 1, sizeof(int64_t))) status = rc_no_memory(message);
  at     = offset->item;
  status = indexed ? span_by_offsets(file, status, zone, section, lo, hi, at, span, message)
                   : span_by_cuts(file, status, section, lo, hi, span, message);
  if (status == RCGNS_OK && !ra_reserve(data, span[1] - span[0], sizeof(int64_t))) status = rc_no_memory(message);
  RC_TRY(rc_read_1d(file, status, section->connectivity, span[0], span[1], 'I', data->item, message));
  offset->count = n + 1;
  if (!indexed) {
    keep_rows(file, section, lo, hi, at, data);
    return RCGNS_OK;
  }
  for (int64_t i = n; i >= 0 && n; i--) at[i] -= span[0];
  if (!n) at[0] = 0;
  data->count = span[1] - span[0];
  return RCGNS_OK;
}
