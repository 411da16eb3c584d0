/* order -- items of this rank in the order of their keys, a word of 32 bits after the other: by counting for the first, then
 * few by insertion, and a later word only where the earlier ones are equal. No key is kept. O(n + end of the first words) for
 * keys that soon differ, else O(n log n); 8 bytes an item and 4 for each value of the first word. */
#include "super/super_private.h"

/* Sort n items of the list, whose words below k are equal, by word k, which is there, and those behind it. An item is its word,
 * then its number. */
static void sort_run(const rm_words *words, uint64_t *list, int64_t n, int k)
{
  rm_sort_words(list, n);
  for (int64_t i = 0, next; i < n; i = next) {
    for (next = i + 1; next < n && list[next] >> 32 == list[i] >> 32;) next++;
    if (next == i + 1) continue;
    for (int64_t m = i; m < next && k + 1 < words->num; m++) {
      const uint32_t item = (uint32_t)list[m];
      list[m]             = (uint64_t)words->word(words->user, item, k + 1) << 32 | item;
    }
    if (k + 1 < words->num) sort_run(words, list + i, next - i, k + 1);
    else
      for (int64_t m = i + 1; m < next; m++) list[m] |= RM_SAME;
  }
}

static remap_status order(rm_arena *passing, const rm_words *words, int64_t n, uint32_t *out)
{
  uint64_t *list;
  uint32_t *end;

  RM_ASSERT(n < INT32_MAX && words->num >= 2);
  RM_NEW(list, passing, n);
  RM_NEW0(end, passing, words->end + 2);
  for (int64_t i = 0; i < n; i++) end[words->word(words->user, i, 0) + 2]++;
  for (int64_t b = 0; b < words->end; b++) end[b + 2] += end[b + 1];
  for (int64_t i = 0; i < n; i++)
    list[end[words->word(words->user, i, 0) + 1]++] = (uint64_t)words->word(words->user, i, 1) << 32 | (uint64_t)i;
  for (int64_t b = 0; b < words->end; b++)
    if (end[b + 1] > end[b] + 1) sort_run(words, list + end[b], end[b + 1] - end[b], 1);
  for (int64_t i = 0; i < n; i++) out[i] = (uint32_t)list[i];
  return REMAP_OK;
}

remap_status rm_super_order(const rm_words *words, int64_t n, uint32_t *out)
{
  rm_arena    *passing = rm_arena_new();
  remap_status status  = passing ? order(passing, words, n, out) : REMAP_NO_MEMORY;

  rm_arena_drop(passing);
  return status;
}
