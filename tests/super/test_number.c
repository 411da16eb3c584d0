/* Numbers of keys that many ranks have, against all keys on one. */
#include "rt.h"
#include "super/super_private.h"

#include <string.h>

enum { WORDS = 2, MOST = 3000 };

/* This rank's keys, ascending and each once: first words 0 .. range - 1, crowded towards 0 by the power. */
static int64_t make_keys(uint64_t seed, int64_t range, int power, uint64_t (*key)[WORDS])
{
  uint64_t state = rm_hash_word(seed + (uint64_t)rt_rank()), word[MOST];
  int64_t  num   = 0;

  for (int i = 0; i < MOST; i++) {
    double x = 1;

    for (int p = 0; p < power; p++) x *= (double)((state = rm_hash_word(state)) >> 11) * 0x1p-53;
    word[i] = (uint64_t)(x * (double)range) << 1 | (state & 1);
  }
  rm_sort_words(word, MOST);
  for (int i = 0; i < MOST; i++) {
    if (i > 0 && word[i] == word[i - 1]) continue;
    key[num][0]   = word[i] >> 1;
    key[num++][1] = word[i] & 1;
  }
  return num;
}

/* A key's number is how many distinct ones of all ranks are smaller. */
static void check(const rm_comm *comm, rm_arena *arena, int64_t n, const uint64_t (*key)[WORDS], const int64_t *number,
                  int64_t total)
{
  int64_t  *offset = rm_arena_alloc(arena, comm->size + 1, sizeof *offset), distinct = 0, at = 0;
  uint64_t *word;
  void     *all;

  RT_EQ(rm_comm_allgatherv(comm, arena, key, n, sizeof *key, offset, &all), REMAP_OK);
  word = rm_arena_alloc(arena, offset[comm->size], sizeof *word);
  for (int64_t i = 0; i < offset[comm->size]; i++)
    word[i] = ((uint64_t(*)[WORDS])all)[i][0] << 1 | ((uint64_t(*)[WORDS])all)[i][1];
  rm_sort_words(word, offset[comm->size]);
  for (int64_t i = 0; i < offset[comm->size]; i++) {
    const bool is_here = at < n && word[i] == (key[at][0] << 1 | key[at][1]);

    if (i > 0 && word[i] == word[i - 1]) continue;
    if (is_here) RT_EQ(number[at++], distinct);
    distinct++;
  }
  RT_EQ(at, n);
  RT_EQ(total, distinct);
}

static void keys_are_numbered_in_their_order_wherever_they_are_cut(void)
{
  rm_comm comm;

  RT_EQ(rm_comm_dup(MPI_COMM_WORLD, &comm), REMAP_OK);
  for (int k = 0; k < 12; k++) {
    static uint64_t key[MOST][WORDS];
    static int64_t  number[MOST];
    const int64_t   range = k % 3 ? 1000000 : 700; /* fewer than there are parts to count in */
    rm_arena       *arena = rm_arena_new();
    int64_t         total = 0, n = k % 4 == 3 && rt_rank() % 2 ? 0 : make_keys((uint64_t)k, range, 1 + k % 4, key);

    RT_EQ(rm_super_number(arena, &comm, n, WORDS, &key[0][0], k < 6 ? range : 0, number, &total), REMAP_OK);
    check(&comm, arena, n, (const uint64_t(*)[WORDS])key, number, total);
    rm_arena_drop(arena);
  }
  rm_comm_free(&comm);
}

RT_MAIN(RT_CASE(keys_are_numbered_in_their_order_wherever_they_are_cut))
