/* states -- see states.h. A list costs its length; looking one up O(length), expected. */
#include "overlay/states.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_LIST = 4096 }; /* more cells than this at one point is no mesh */

static uint64_t hash_list(const rm_winding *list, int n)
{
  uint64_t h = (uint64_t)n;
  for (int k = 0; k < n; k++) h = rm_hash_word(h ^ ((uint64_t)(uint32_t)list[k].cell << 32 | (uint32_t)list[k].number));
  return h;
}

static void rehash(rm_states *s, rm_lid *bucket, rm_lid num_buckets)
{
  for (rm_lid b = 0; b < num_buckets; b++) bucket[b] = -1;
  for (rm_lid i = 0; i < s->num; i++) {
    const uint64_t h = hash_list(s->winding + s->offset[i], s->offset[i + 1] - s->offset[i]) % (uint64_t)num_buckets;
    s->next[i] = bucket[h];
    bucket[h]  = i;
  }
  free(s->bucket);
  s->bucket      = bucket;
  s->num_buckets = num_buckets;
}

remap_status rm_states_init(rm_states *states)
{
  memset(states, 0, sizeof *states);
  RM_TRY(rm_grow(&states->offset, &states->offset_room, 64, sizeof *states->offset));
  states->offset[0] = 0;
  states->bucket    = malloc(64 * sizeof *states->bucket);
  if (!states->bucket) return REMAP_NO_MEMORY;
  for (int b = 0; b < 64; b++) states->bucket[b] = -1;
  states->num_buckets = 64;
  return REMAP_OK;
}

void rm_states_free(rm_states *states)
{
  free(states->offset);
  free(states->winding);
  free(states->bucket);
  free(states->next);
  memset(states, 0, sizeof *states);
}

static remap_status intern(rm_states *s, const rm_winding *list, int n, rm_lid *out)
{
  const uint64_t h = hash_list(list, n);

  for (rm_lid i = s->bucket[h % (uint64_t)s->num_buckets]; i >= 0; i = s->next[i])
    if (s->offset[i + 1] - s->offset[i] == n && !memcmp(s->winding + s->offset[i], list, sizeof *list * (size_t)n)) {
      *out = -2 - i;
      return REMAP_OK;
    }
  if (s->num == INT32_MAX - 8 || s->offset[s->num] > INT32_MAX - n) return REMAP_TOO_LARGE;
  if (s->num == s->num_buckets) {
    const rm_lid num_buckets = 2 * s->num_buckets;
    rm_lid      *bucket      = malloc(sizeof *bucket * (size_t)num_buckets);
    if (!bucket) return REMAP_NO_MEMORY;
    rehash(s, bucket, num_buckets);
  }
  RM_TRY(rm_grow(&s->offset, &s->offset_room, (int64_t)s->num + 2, sizeof *s->offset));
  RM_TRY(rm_grow(&s->next, &s->next_room, (int64_t)s->num + 1, sizeof *s->next));
  RM_TRY(rm_grow(&s->winding, &s->winding_room, (int64_t)s->offset[s->num] + n, sizeof *s->winding));
  memcpy(s->winding + s->offset[s->num], list, sizeof *list * (size_t)n);
  s->offset[s->num + 1] = s->offset[s->num] + n;
  s->next[s->num]       = s->bucket[h % (uint64_t)s->num_buckets];
  s->bucket[h % (uint64_t)s->num_buckets] = s->num;
  *out = -2 - s->num++;
  return REMAP_OK;
}

remap_status rm_states_change(rm_states *states, rm_lid from, rm_lid cell, int by, rm_lid *out)
{
  rm_winding        list[MAX_LIST + 1];
  const rm_winding *old;
  const rm_winding  single = {from, 1};
  int               num_old = 0, n = 0, k = 0;

  *out = from;
  if (cell < 0) return REMAP_OK;
  if (from >= 0) {
    old     = &single;
    num_old = 1;
  } else if (from == RM_OUTSIDE) {
    old = &single;
  } else {
    old     = states->winding + states->offset[-2 - from];
    num_old = states->offset[-1 - from] - states->offset[-2 - from];
  }
  if (num_old >= MAX_LIST) return REMAP_TOO_LARGE;
  for (; k < num_old && old[k].cell < cell; k++) list[n++] = old[k];
  if (k < num_old && old[k].cell == cell) by += old[k++].number;
  if (by) list[n++] = (rm_winding){cell, by};
  for (; k < num_old; k++) list[n++] = old[k];
  if (n == 0) *out = RM_OUTSIDE;
  else if (n == 1 && list[0].number == 1) *out = list[0].cell;
  else return intern(states, list, n, out);
  return REMAP_OK;
}
