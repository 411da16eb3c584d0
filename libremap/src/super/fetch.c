/* fetch -- what belongs to entities of other ranks, brought to those that come from them. O(n log n) for n of them. */
#include "super/super.h"

#include <string.h>

/* Entities of other ranks that this rank wants. */
typedef struct wants {
  int64_t  num;
  rm_lid  *at;   /* [num] entity of the supermesh */
  int     *rank; /* [num] ascending */
  rm_lid  *item; /* [num] */
} wants;

/* Those of n entities that have an origin, by its rank. */
static remap_status sort_wants(rm_arena *passing, int64_t n, const int32_t *from, const int32_t *from_rank, wants *out)
{
  rm_keyed *key, *spare;

  out->num = 0;
  RM_NEW(key, passing, n);
  RM_NEW(spare, passing, n);
  for (int64_t k = 0; k < n; k++)
    if (from[k] >= 0) key[out->num++] = (rm_keyed){(uint64_t)from_rank[k], k};
  rm_sort_keyed(key, spare, out->num);
  RM_NEW(out->at, passing, out->num);
  RM_NEW(out->rank, passing, out->num);
  RM_NEW(out->item, passing, out->num);
  for (int64_t k = 0; k < out->num; k++) {
    out->at[k]   = (rm_lid)key[k].item;
    out->rank[k] = (int)key[k].key;
    out->item[k] = from[key[k].item];
  }
  return REMAP_OK;
}

static remap_status fetch(const rm_comm *comm, rm_arena *passing, int64_t n, const int32_t *from, const int32_t *from_rank,
                          size_t size, const void *in, const void *none, void *out)
{
  const rm_plan *plan;
  wants          w = {0};
  char          *received = NULL, *buffer = NULL;

  RM_TRY(rm_comm_agree(comm, passing ? sort_wants(passing, n, from, from_rank, &w) : REMAP_NO_MEMORY, NULL));
  RM_TRY(rm_plan_build(comm, passing, w.num, w.rank, w.item, &plan));
  received = rm_arena_alloc(passing, w.num, size);
  buffer   = rm_arena_alloc(passing, plan->send_offset[plan->num_send], size);
  RM_TRY(rm_comm_agree(comm, received && buffer ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_TRY(rm_comm_agree(comm, rm_plan_run(comm, plan, size, in, received, buffer), NULL));
  for (int64_t k = 0; k < n; k++) memcpy((char *)out + (size_t)k * size, none, size);
  for (int64_t k = 0; k < w.num; k++) memcpy((char *)out + (size_t)w.at[k] * size, received + (size_t)k * size, size);
  return REMAP_OK;
}

remap_status rm_super_fetch(const rm_comm *comm, int64_t n, const int32_t *from, const int32_t *from_rank, size_t size,
                            const void *in, const void *none, void *out)
{
  rm_arena    *passing = rm_arena_new();
  remap_status status  = fetch(comm, passing, n, from, from_rank, size, in, none, out);

  rm_arena_drop(passing);
  return status;
}
