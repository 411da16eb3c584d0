/* cut -- intervals of Morton keys, one per rank: first of even numbers of cells, then of even estimated work.
 *
 * Cells that lie anywhere are cut by dividing the range of keys: the cuts are quantiles to within a 64th of a rank's share,
 * depend on the zone's cells and not on who hands them in, and cells of equal key stay together. O(n) time to sort n keys here;
 * then sums over all ranks of WAYS - 1 numbers for each range in which a cut is still looked for, or of one number where these
 * ranges are many: that takes more sums, and fewer numbers in all. A rank walks along its keys once for each sum. Few ranges
 * are left apart at first, few cuts are not found at last: on P ranks some six sums of P numbers. Tags that lie in order over
 * the ranks are cut by adding up: O(n) and two small collectives. */
#include "part/part_private.h"

#include <float.h>

/* Every round divides the ranges that hold cuts by WAYS, or by two if they are more than FEW_RANGES. A cut is good enough if a
 * SLACK-th of a rank's share is on the wrong side. */
enum { WAYS = 8, FEW_RANGES = 16, SLACK = 64 };

/* The search for all cuts at once. A cut that is open lies in [low, low + width); ranges of two are the same or apart. */
typedef struct search {
  int64_t         num_keys;
  const rm_keyed *keyed;    /* [num_keys] this rank's keys, ascending           */
  int             num_cuts; /* comm->size - 1                                   */
  uint64_t        width;
  int             ways;     /* by which the ranges are divided                  */
  uint64_t       *low;      /* [num_cuts] of the range, or the cut if it is found */
  int64_t        *goal;     /* [num_cuts] cells that shall lie below the cut    */
  int64_t         slack;    /* cells by which that may be missed                */
  int             num_open;
  int            *open;     /* [num_open] cuts that are not found yet, ascending */
  int64_t        *below;    /* [ranges with open cuts][ways - 1] ascending: cells of all ranks below inner probes */
} search;

remap_status rm_part_frame(const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2], const rm_zone *zone,
                           rm_frame *out)
{
  double low[3] = {DBL_MAX, DBL_MAX, DBL_MAX}, high[3] = {-DBL_MAX, -DBL_MAX, -DBL_MAX};

  for (int side = 0; side < 2; side++)
    for (rm_lid k = 0; k < zone->num_cells[side]; k++) {
      const double *box = mesh[side]->cell_box[zone->cell[side][k]];

      for (int d = 0; d < 3; d++) {
        if (box[d] < low[d]) low[d] = box[d];
        if (box[3 + d] > high[d]) high[d] = box[3 + d];
      }
    }
  RM_TRY(rm_comm_min_f64(comm, low, 3));
  RM_TRY(rm_comm_max_f64(comm, high, 3));
  *out = *frame;
  for (int d = 0; d < 3 && low[0] <= high[0]; d++) {
    out->box[d]     = low[d];
    out->box[3 + d] = high[d];
  }
  return REMAP_OK;
}

uint64_t rm_part_key(const rm_frame *zone_frame, const double box[6])
{
  const double centre[3] = {0.5 * (box[0] + box[3]), 0.5 * (box[1] + box[4]), 0.5 * (box[2] + box[5])};

  return rm_morton(zone_frame, centre);
}

int rm_part_seat(const rm_cuts *cuts, uint64_t key)
{
  int low = 0, high = cuts->num;

  while (low < high) {
    const int mid = low + (high - low) / 2;

    if (cuts->key[mid] <= key) low = mid + 1;
    else high = mid;
  }
  return low;
}

remap_status rm_part_route_to_seats(rm_arena *arena, const rm_comm *comm, const rm_frame *zone_frame, const rm_mesh *mesh,
                                    const rm_zone *zone, const rm_cuts *cuts, rm_route *out)
{
  const rm_lid  num  = zone->num_cells[mesh->side];
  const rm_lid *cell = zone->cell[mesh->side];
  rm_lid       *seat;

  RM_NEW(seat, arena, num);
  RM_NEW(out->cell, arena, num);
  RM_NEW(out->offset, arena, (int64_t)comm->size + 1);
  for (rm_lid k = 0; k < num; k++) seat[k] = rm_part_seat(cuts, rm_part_key(zone_frame, mesh->cell_box[cell[k]]));
  rm_group(num, seat, comm->size, out->offset, out->cell);
  for (rm_lid k = 0; k < num; k++) out->cell[k] = cell[out->cell[k]];
  return REMAP_OK;
}

/* ---- of cells that lie anywhere ----------------------------------------------------------------------------------- */

/* How many of the keys are smaller than `key`, no fewer than from: in steps that double, then by halving, so that a walk along
 * many keys costs O(1) each where they are dense and O(log n) where they are not. */
static int64_t num_below(const search *s, int64_t from, uint64_t key)
{
  int64_t low = from, step = 1, high;

  while (low + step <= s->num_keys && s->keyed[low + step - 1].key < key) low += step, step *= 2;
  high = low + step - 1 < s->num_keys ? low + step - 1 : s->num_keys;
  while (low < high) {
    const int64_t mid = low + (high - low) / 2;

    if (s->keyed[mid].key < key) low = mid + 1;
    else high = mid;
  }
  return low;
}

/* The keys of both meshes' cells, ascending, and room for the search. Not collective. */
static remap_status prepare(rm_arena *arena, const rm_comm *comm, const rm_frame *zone_frame, const rm_mesh *const mesh[2],
                            const rm_zone *zone, search *s)
{
  rm_keyed *keyed, *spare;
  int64_t   num = 0;

  s->num_keys = (int64_t)zone->num_cells[0] + zone->num_cells[1];
  s->num_cuts = comm->size - 1;
  RM_NEW(keyed, arena, s->num_keys);
  RM_NEW(spare, arena, s->num_keys);
  RM_NEW(s->low, arena, s->num_cuts);
  RM_NEW(s->goal, arena, s->num_cuts);
  RM_NEW(s->open, arena, s->num_cuts);
  RM_NEW(s->below, arena, (int64_t)s->num_cuts + FEW_RANGES * (WAYS - 1));
  for (int side = 0; side < 2; side++)
    for (rm_lid k = 0; k < zone->num_cells[side]; k++) {
      keyed[num] = (rm_keyed){rm_part_key(zone_frame, mesh[side]->cell_box[zone->cell[side][k]]), num};
      RM_ASSERT(keyed[num].key >> RM_KEY_BITS == 0);
      num++;
    }
  rm_sort_keyed(keyed, spare, num);
  s->keyed = keyed;
  return REMAP_OK;
}

/* Is the range of open cut k another one than that of the cut before? */
static bool is_new_range(const search *s, int k) { return k == 0 || s->low[s->open[k]] != s->low[s->open[k - 1]]; }

/* Choose by how much the ranges with open cuts are divided; returns how many there are. */
static int choose_ways(search *s)
{
  int num = 0;

  for (int k = 0; k < s->num_open; k++) num += is_new_range(s, k);
  s->ways = num > FEW_RANGES ? 2 : WAYS;
  while ((uint64_t)s->ways > s->width) s->ways /= 2;
  s->width /= (uint64_t)s->ways;
  return num;
}

/* How many cells of this rank lie below the probes that divide the ranges. */
static void probe(search *s)
{
  int64_t at  = 0;
  int     num = 0;

  for (int k = 0; k < s->num_open; k++)
    for (int j = 1; j < s->ways && is_new_range(s, k); j++)
      s->below[num++] = at = num_below(s, at, s->low[s->open[k]] + (uint64_t)j * s->width);
}

/* Move a cut to the part of its range that ends at the first probe above its goal; found: to that end of the part which is
 * nearer to the goal, if that is near enough. A greater goal never leads to a lower key. */
static bool narrow(search *s, int cut, const int64_t *below)
{
  int     part = 0;
  int64_t under, over;

  while (part < s->ways - 1 && below[part] <= s->goal[cut]) part++;
  s->low[cut] += (uint64_t)part * s->width;
  under = part > 0 ? s->goal[cut] - below[part - 1] : INT64_MAX;
  over  = part < s->ways - 1 ? below[part] - s->goal[cut] : INT64_MAX;
  if (over < under && over <= s->slack) {
    s->low[cut] += s->width;
    return true;
  }
  return under <= s->slack;
}

/* One round. */
static remap_status narrow_all(const rm_comm *comm, search *s)
{
  const int num_ranges = choose_ways(s);
  int       num = 0, range = -1;
  uint64_t  last = 0;

  probe(s);
  RM_TRY(rm_comm_sum_i64(comm, s->below, num_ranges * (s->ways - 1)));
  for (int k = 0; k < s->num_open; k++) {
    const int      cut = s->open[k];
    const uint64_t low = s->low[cut];

    if (range < 0 || low != last) range++;
    last = low;
    if (!narrow(s, cut, s->below + (int64_t)range * (s->ways - 1))) s->open[num++] = cut;
  }
  s->num_open = num;
  return REMAP_OK;
}

/* The share of `total` that is below cut i. */
static int64_t goal_of(int64_t total, int size, int i)
{
  return total / size * (i + 1) + total % size * (i + 1) / size;
}

remap_status rm_part_cut_evenly(rm_arena *arena, const rm_comm *comm, const rm_frame *zone_frame, const rm_mesh *const mesh[2],
                                const rm_zone *zone, rm_cuts *out)
{
  search             s     = {0};
  const remap_status mine  = prepare(arena, comm, zone_frame, mesh, zone, &s);
  int64_t            total = s.num_keys;

  RM_TRY(rm_comm_agree(comm, mine, NULL));
  RM_ASSERT(mine == REMAP_OK);
  RM_TRY(rm_comm_sum_i64(comm, &total, 1));
  for (int i = 0; i < s.num_cuts; i++) {
    s.low[i]  = 0;
    s.goal[i] = goal_of(total, comm->size, i);
    s.open[i] = i;
  }
  s.num_open = s.num_cuts;
  s.slack    = total / comm->size / SLACK;
  s.width    = UINT64_C(1) << RM_KEY_BITS;
  while (s.width > 1 && s.num_open > 0) RM_TRY(narrow_all(comm, &s));
  for (int i = 1; i < s.num_cuts; i++) RM_ASSERT(s.low[i - 1] <= s.low[i]);
  *out = (rm_cuts){s.num_cuts, s.low};
  return REMAP_OK;
}

remap_status rm_part_route_evenly(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2],
                                  const rm_zone *zone, rm_route route[2])
{
  rm_frame     zone_frame;
  rm_cuts      cuts;
  remap_status mine = REMAP_OK;

  RM_TRY(rm_part_frame(comm, frame, mesh, zone, &zone_frame));
  RM_TRY(rm_part_cut_evenly(arena, comm, &zone_frame, mesh, zone, &cuts));
  for (int side = 0; side < 2 && mine == REMAP_OK; side++)
    mine = rm_part_route_to_seats(arena, comm, &zone_frame, mesh[side], zone, &cuts, &route[side]);
  return rm_comm_agree(comm, mine, NULL);
}

/* ---- of tags that lie in order ------------------------------------------------------------------------------------ */

/* This rank's tags of both sides by key, and the work of each. */
static remap_status merge_work(rm_arena *arena, const rm_tags *tags, int64_t *const work[2], rm_keyed **out, int64_t *num)
{
  rm_lid    at[2] = {0, 0};
  rm_keyed *merged;

  *num = (int64_t)tags->num[0] + tags->num[1];
  RM_NEW(merged, arena, *num);
  for (int64_t k = 0; k < *num; k++) {
    const int side = at[0] == tags->num[0] || (at[1] < tags->num[1] && tags->tag[1][at[1]].key < tags->tag[0][at[0]].key);

    merged[k] = (rm_keyed){tags->tag[side][at[side]].key, work[side][at[side]]};
    at[side]++;
  }
  *out = merged;
  return REMAP_OK;
}

/* The cuts whose goals lie in this rank's share of the work, which begins behind `before`; key has room for all. Returns their
 * number. */
static int find_cuts(const rm_comm *comm, const rm_keyed *merged, int64_t num, int64_t before, int64_t total, uint64_t *key)
{
  int found = 0, next = 0;

  while (next < comm->size - 1 && goal_of(total, comm->size, next) < before) next++;
  for (int64_t k = 0, end; k < num; k = end) {
    int64_t here = 0;

    for (end = k; end < num && merged[end].key == merged[k].key; end++) here += merged[end].item;
    for (; next < comm->size - 1 && goal_of(total, comm->size, next) < before + here; next++) {
      const bool is_before = goal_of(total, comm->size, next) - before < here - here / 2;

      key[found++] = merged[k].key + (is_before ? 0 : 1);
    }
    before += here;
  }
  return found;
}

remap_status rm_part_cut_work(rm_arena *arena, const rm_comm *comm, const rm_tags *tags, int64_t *const work[2], rm_cuts *out)
{
  uint64_t    *mine   = rm_arena_zero(arena, comm->size, sizeof *mine);
  int64_t     *offset = rm_arena_alloc(arena, (int64_t)comm->size + 1, sizeof *offset), num = 0, before = 0, total, found;
  rm_keyed    *merged = NULL;
  void        *all;
  remap_status status = mine && offset ? merge_work(arena, tags, work, &merged, &num) : REMAP_NO_MEMORY;

  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_ASSERT(mine && offset);
  for (int64_t k = 0; k < num; k++) before += merged[k].item;
  total = before;
  RM_TRY(rm_comm_sum_i64(comm, &total, 1));
  RM_TRY(rm_comm_exscan_i64(comm, &before));
  found = find_cuts(comm, merged, num, before, total, mine);
  if (total == 0 && comm->rank == 0) found = comm->size - 1; /* no cells: all cuts at 0 */
  RM_TRY(rm_comm_allgatherv(comm, arena, mine, found, sizeof *mine, offset, &all));
  RM_ASSERT(offset[comm->size] == comm->size - 1);
  *out = (rm_cuts){comm->size - 1, all};
  return REMAP_OK;
}
