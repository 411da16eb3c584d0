/* mask -- a mapping without the pairs of masked cells. What the cells at the other end of a pair are is asked of their ranks
 * once, one byte per cell. O(pairs) time and memory. */
#include "mapping.h"

/* Room for what is left of rows. */
typedef struct draft {
  int64_t *offset;
  rm_lid  *giver;
  double  *volume;
  double (*moment)[3], (*second)[6]; /* second NULL if there are none */
  uint8_t *same, *cover;
} draft;

static remap_status make_room(rm_arena *arena, const rm_rows *rows, draft *d)
{
  const int64_t n = rows->offset[rows->num_cells];

  RM_NEW(d->offset, arena, (int64_t)rows->num_cells + 1);
  RM_NEW(d->giver, arena, n);
  RM_NEW(d->volume, arena, n);
  RM_NEW(d->moment, arena, n);
  d->second = NULL;
  if (rows->second) RM_NEW(d->second, arena, n);
  RM_NEW(d->same, arena, rows->num_cells);
  RM_NEW(d->cover, arena, rows->num_cells);
  return REMAP_OK;
}

/* Keep the pairs between cells that are in: own [num_cells], other [num_givers]. */
static void filter(const rm_rows *rows, const uint8_t *own, const uint8_t *other, draft *d)
{
  int64_t num = 0;

  d->offset[0] = 0;
  for (rm_lid c = 0; c < rows->num_cells; c++) {
    const int64_t first = rows->offset[c], end = rows->offset[c + 1], before = num;

    for (int64_t k = first; k < end && own[c] == RM_MASK_IN; k++) {
      if (other[rows->giver[k]] != RM_MASK_IN) continue;
      d->giver[num]  = rows->giver[k];
      d->volume[num] = rows->volume[k];
      for (int i = 0; i < 3; i++) d->moment[num][i] = rows->moment[k][i];
      for (int i = 0; i < 6 && d->second; i++) d->second[num][i] = rows->second[k][i];
      num++;
    }
    d->offset[c + 1] = num;
    d->same[c]       = rows->same[c] && num > before;
    d->cover[c]      = own[c] == RM_MASK_OUT             ? REMAP_UNWANTED
                       : num - before == end - first    ? rows->cover[c]
                       : num == before                  ? REMAP_UNCOVERED
                                                        : REMAP_PARTIAL;
  }
}

remap_status rm_mapping_mask(rm_arena *arena, const rm_comm *comm, const rm_mapping *mapping, remap_side receiving,
                             const uint8_t *wants, const uint8_t *gives, const rm_mapping **out)
{
  rm_mapping   *masked = rm_arena_alloc(arena, 1, sizeof *masked);
  rm_flow       flow[2];
  draft         d[2];
  int64_t       count[6] = {0};
  remap_status  status   = masked ? REMAP_OK : REMAP_NO_MEMORY;

  for (int side = 0; side < 2 && status == REMAP_OK; side++) {
    status = make_room(arena, &mapping->rows[side], &d[side]);
    if (status == REMAP_OK) status = rm_flow_init(arena, mapping->rows[side].plan, 0, 1, &flow[side]);
  }
  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_ASSERT(masked);
  *masked = *mapping;
  for (int side = 0; side < 2; side++) {
    const uint8_t *own = side == (int)receiving ? wants : gives, *far = side == (int)receiving ? gives : wants;
    rm_note        note = {0, REMAP_OK, 0, 0};
    rm_rows       *rows = &masked->rows[side];

    status = rm_flow_post(comm, &flow[side], NULL, false, 1, far, note);
    if (status == REMAP_OK) status = rm_flow_wait(comm, &flow[side], NULL, &note);
    if (status != REMAP_OK) break;
    filter(&mapping->rows[side], own, (const uint8_t *)flow[side].received, &d[side]);
    rows->offset = d[side].offset;
    rows->giver  = d[side].giver;
    rows->volume = d[side].volume;
    rows->moment = (const double(*)[3])d[side].moment;
    rows->second = (const double(*)[6])d[side].second;
    rows->same   = d[side].same;
    rows->cover  = d[side].cover;
    for (rm_lid c = 0; c < rows->num_cells; c++)
      if (rows->cover[c] != REMAP_UNWANTED) count[3 * side + rows->cover[c]]++;
  }
  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_TRY(rm_comm_sum_i64(comm, count, 6));
  for (int side = 0; side < 2; side++)
    for (int i = 0; i < 3; i++) masked->cells_by_cover[side][i] = count[3 * side + i];
  *out = masked;
  return REMAP_OK;
}
