/* cut -- intervals of Morton keys, one per rank, of even estimated work. The cuts are exact quantiles of the work over all
 * ranks, found by bisecting the range of keys: they depend on the zone's cells and not on who hands them in, and cells of
 * equal key stay together. O(n) time to sort n keys here; then ROUNDS sums over all ranks of WAYS - 1 numbers per cut, each a
 * search of the keys. */
#include "part/part_private.h"

#include <float.h>

/* Every round divides the range that holds a cut by WAYS; keys have 63 bits. */
enum { KEY_BITS = 63, WAY_BITS = 3, WAYS = 1 << WAY_BITS, ROUNDS = KEY_BITS / WAY_BITS };

/* This rank's zone cells by key. */
typedef struct keys {
  rm_lid    num[2];      /* [side]                                                 */
  rm_keyed *keyed[2];    /* [side][num[side]] ascending; item is the place in zone */
  int      *target_rank; /* [num[REMAP_TARGET]] by place in zone                   */
  int64_t  *next;        /* [comm->size] where the next target of a rank goes      */
} keys;

/* The search for all cuts at once. Cut s lies in [low[s], low[s] + width). */
typedef struct search {
  int       num_cuts; /* comm->size - 1                                            */
  uint64_t  width;
  uint64_t *low;      /* [num_cuts]                                                */
  int64_t  *goal;     /* [num_cuts] work that shall lie below the cut              */
  int64_t  *below;    /* [num_cuts][WAYS - 1] work below the inner probes, all ranks */
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

/* The keys of the zone's cells of one mesh, ascending. */
static remap_status sort_keys(rm_arena *arena, const rm_frame *zone_frame, const rm_mesh *mesh, rm_lid num, const rm_lid *cell,
                              rm_keyed **out)
{
  rm_keyed *keyed, *scratch;

  RM_NEW(keyed, arena, num);
  RM_NEW(scratch, arena, num);
  for (rm_lid k = 0; k < num; k++) {
    keyed[k] = (rm_keyed){rm_part_key(zone_frame, mesh->cell_box[cell[k]]), k};
    RM_ASSERT(keyed[k].key >> KEY_BITS == 0);
  }
  rm_sort_keyed(keyed, scratch, num);
  *out = keyed;
  return REMAP_OK;
}

/* How many of the keys are smaller than `key`. */
static rm_lid num_below(const rm_keyed *keyed, rm_lid num, uint64_t key)
{
  rm_lid low = 0, high = num;

  while (low < high) {
    const rm_lid mid = low + (high - low) / 2;

    if (keyed[mid].key < key) low = mid + 1;
    else high = mid;
  }
  return low;
}

/* The estimate of the overlay's work, in pairs, that this rank's cells of keys below `key` cause: as many pairs as they are
 * cells, of both meshes. Where n source and m target cells fill the same place they make between max(n, m) and some eight
 * times as many pairs, so the sum is right to a small factor whichever mesh is finer, and follows the refinement of both from
 * place to place. */
static int64_t work_below(const keys *k, uint64_t key)
{
  return (int64_t)num_below(k->keyed[REMAP_SOURCE], k->num[REMAP_SOURCE], key) +
         (int64_t)num_below(k->keyed[REMAP_TARGET], k->num[REMAP_TARGET], key);
}

/* All that can fail on this rank alone: the sorted keys, and room for the search and for its result. */
static remap_status prepare(rm_arena *arena, const rm_comm *comm, const rm_frame *zone_frame, const rm_mesh *const mesh[2],
                            const rm_zone *zone, keys *k, search *s, rm_route *route)
{
  for (int side = 0; side < 2; side++) {
    k->num[side] = zone->num_cells[side];
    RM_TRY(sort_keys(arena, zone_frame, mesh[side], zone->num_cells[side], zone->cell[side], &k->keyed[side]));
  }
  RM_NEW(k->target_rank, arena, k->num[REMAP_TARGET]);
  RM_NEW(k->next, arena, comm->size);
  s->num_cuts = comm->size - 1;
  RM_NEW(s->low, arena, s->num_cuts);
  RM_NEW(s->goal, arena, s->num_cuts);
  RM_NEW(s->below, arena, (int64_t)s->num_cuts * (WAYS - 1));
  RM_NEW(route->offset, arena, (int64_t)comm->size + 1);
  RM_NEW(route->cell, arena, zone->num_cells[REMAP_TARGET]);
  return REMAP_OK;
}

/* One round: WAYS - 1 probes divide each cut's range evenly; it shrinks to the part before the first probe above the goal. */
static remap_status narrow(const rm_comm *comm, const keys *k, search *s)
{
  s->width /= WAYS;
  for (int i = 0; i < s->num_cuts; i++)
    for (int j = 1; j < WAYS; j++) s->below[i * (WAYS - 1) + j - 1] = work_below(k, s->low[i] + (uint64_t)j * s->width);
  RM_TRY(rm_comm_sum_i64(comm, s->below, s->num_cuts * (WAYS - 1)));
  for (int i = 0; i < s->num_cuts; i++) {
    int part = 0;

    while (part < WAYS - 1 && s->below[i * (WAYS - 1) + part] <= s->goal[i]) part++;
    s->low[i] += (uint64_t)part * s->width;
  }
  return REMAP_OK;
}

/* Cut s becomes the greatest key with at most its share of the work below it. Collective. */
static remap_status find_cuts(const rm_comm *comm, const keys *k, search *s)
{
  int64_t total = (int64_t)k->num[REMAP_SOURCE] + k->num[REMAP_TARGET];

  RM_TRY(rm_comm_sum_i64(comm, &total, 1));
  for (int i = 0; i < s->num_cuts; i++) {
    s->low[i]  = 0;
    s->goal[i] = total / comm->size * (i + 1) + total % comm->size * (i + 1) / comm->size;
  }
  s->width = UINT64_C(1) << KEY_BITS;
  for (int round = 0; round < ROUNDS; round++) RM_TRY(narrow(comm, k, s));
  RM_ASSERT(s->width == 1);
  return REMAP_OK;
}

/* Rank r takes the targets of keys from cut r - 1 up to cut r; the sort by rank leaves their order as it is in the zone. */
static void route_targets(const rm_comm *comm, const rm_zone *zone, const keys *k, const search *s, rm_route *route)
{
  const rm_keyed *keyed = k->keyed[REMAP_TARGET];
  const rm_lid    num   = k->num[REMAP_TARGET];
  rm_lid          begin = 0;

  for (int r = 0; r < comm->size; r++) {
    const rm_lid end = r < s->num_cuts ? num_below(keyed, num, s->low[r]) : num;

    RM_ASSERT(begin <= end);
    for (rm_lid i = begin; i < end; i++) k->target_rank[keyed[i].item] = r;
    route->offset[r] = k->next[r] = begin;
    begin            = end;
  }
  route->offset[comm->size] = num;
  for (rm_lid i = 0; i < num; i++) route->cell[k->next[k->target_rank[i]]++] = zone->cell[REMAP_TARGET][i];
}

remap_status rm_part_cut(rm_arena *arena, const rm_comm *comm, const rm_frame *zone_frame, const rm_mesh *const mesh[2],
                         const rm_zone *zone, rm_route *out)
{
  keys               k     = {0};
  search             s     = {0};
  rm_route           route = {0};
  const remap_status mine  = prepare(arena, comm, zone_frame, mesh, zone, &k, &s, &route);

  RM_TRY(rm_comm_agree(comm, mine, NULL));
  RM_ASSERT(mine == REMAP_OK);
  RM_TRY(find_cuts(comm, &k, &s));
  route_targets(comm, zone, &k, &s, &route);
  *out = route;
  return REMAP_OK;
}
