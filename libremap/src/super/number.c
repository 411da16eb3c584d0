/* number -- equal keys of all ranks get one number, in the order of the keys: each rank has its own in order, samples tell
 * where to cut, every key goes to the rank of its interval, is numbered there, and the number comes back. Words are sorted one
 * after the other, and a later one only where the earlier ones are equal. O(n) mostly; 32 bytes and the key for each. */
#include "super/super_private.h"

#include <string.h>

/* Samples of a rank: so many, but of all ranks together not many more than ALL_SAMPLES, which every rank sorts. */
enum { SAMPLES = 64, LEAST_SAMPLES = 4, ALL_SAMPLES = 1 << 19, FEW = 24 };

typedef struct keys {
  int             words;
  const uint64_t *word; /* [n][words] */
  rm_keyed       *order, *spare;
} keys;

/* Sort order[first..first + n), equal up to `word`, by that word and those behind it. */
static void sort_run(keys *k, int64_t first, int64_t n, int word)
{
  rm_keyed *run = k->order + first;

  for (int64_t i = 0; i < n; i++) run[i].key = k->word[run[i].item * k->words + word];
  if (n > FEW) rm_sort_keyed(run, k->spare, n);
  for (int64_t i = 1; i < n && n <= FEW; i++) {
    const rm_keyed x = run[i];
    int64_t        m = i;
    for (; m > 0 && run[m - 1].key > x.key; m--) run[m] = run[m - 1];
    run[m] = x;
  }
  if (word + 1 == k->words) return;
  for (int64_t i = 0, next; i < n; i = next) {
    for (next = i + 1; next < n && run[next].key == run[i].key;) next++;
    if (next > i + 1) sort_run(k, first + i, next - i, word + 1);
  }
}

static bool same_key(const keys *k, int64_t a, int64_t b)
{
  return !memcmp(k->word + a * k->words, k->word + b * k->words, sizeof *k->word * (size_t)k->words);
}

/* place[i] of key i among the distinct ones in order; returns how many these are. */
static int64_t rank_keys(keys *k, int64_t n, int64_t *place)
{
  int64_t num = 0;

  for (int64_t i = 0; i < n; i++) k->order[i].item = i;
  if (n) sort_run(k, 0, n, 0);
  for (int64_t i = 0; i < n; i++) {
    num += i == 0 || !same_key(k, k->order[i - 1].item, k->order[i].item);
    place[k->order[i].item] = num - 1;
  }
  return num;
}

static remap_status start(rm_arena *passing, int64_t n, int words, const uint64_t *word, keys *k)
{
  *k = (keys){.words = words, .word = word};
  RM_NEW(k->order, passing, n);
  RM_NEW(k->spare, passing, n);
  return REMAP_OK;
}

remap_status rm_super_rank(rm_arena *passing, int64_t n, int words, const uint64_t *key, int64_t *place, int64_t *num)
{
  keys k;

  RM_TRY(start(passing, n, words, key, &k));
  *num = rank_keys(&k, n, place);
  return REMAP_OK;
}

static int compare(const uint64_t *a, const uint64_t *b, int words)
{
  for (int w = 0; w < words; w++)
    if (a[w] != b[w]) return a[w] < b[w] ? -1 : 1;
  return 0;
}

/* Several ranks: what each needs. */
typedef struct dealing {
  const uint64_t *key; /* [num][words] in order */
  int64_t         num;
  int64_t  *send_offset, *recv_offset, *back_offset, *sample_offset; /* [size + 1] */
  uint64_t  sample[SAMPLES * RM_SOUP_CORNERS];
  int64_t   num_samples;
  uint64_t *arrived;  /* keys of this rank's interval, and their numbers */
  int64_t  *answer;
} dealing;

static remap_status prepare(rm_arena *passing, const rm_comm *comm, int64_t n, int words, const uint64_t *key, dealing *d)
{
  const int64_t share = ALL_SAMPLES / comm->size;
  const int64_t most  = share > SAMPLES ? SAMPLES : share > LEAST_SAMPLES ? share : LEAST_SAMPLES;

  d->key         = key;
  d->num         = n;
  d->num_samples = n < most ? n : most;
  for (int64_t s = 0; s < d->num_samples; s++)
    memcpy(d->sample + s * words, key + n * s / d->num_samples * words, sizeof *key * (size_t)words);
  RM_NEW(d->send_offset, passing, (int64_t)comm->size + 1);
  RM_NEW(d->recv_offset, passing, (int64_t)comm->size + 1);
  RM_NEW(d->back_offset, passing, (int64_t)comm->size + 1);
  RM_NEW(d->sample_offset, passing, (int64_t)comm->size + 1);
  return REMAP_OK;
}

/* Where each rank's interval ends among the keys here: at the samples' quantiles. */
static remap_status cut(rm_arena *passing, const rm_comm *comm, int words, uint64_t *sample, dealing *d)
{
  const int64_t num = d->sample_offset[comm->size];
  keys          k;

  RM_TRY(start(passing, num, words, sample, &k));
  for (int64_t i = 0; i < num; i++) k.order[i].item = i;
  if (num) sort_run(&k, 0, num, 0);
  d->send_offset[0] = 0;
  for (int r = 1; r < comm->size; r++) {
    int64_t low = d->send_offset[r - 1], high = d->num;

    while (num && low < high) {
      const int64_t middle = (low + high) / 2;
      if (compare(d->key + middle * words, sample + k.order[num * r / comm->size].item * words, words) < 0)
        low = middle + 1;
      else high = middle;
    }
    d->send_offset[r] = low;
  }
  d->send_offset[comm->size] = d->num;
  return REMAP_OK;
}

static remap_status number_here(rm_arena *passing, const rm_comm *comm, int words, dealing *d, int64_t *num)
{
  const int64_t n = d->recv_offset[comm->size];
  keys          k;

  RM_TRY(start(passing, n, words, d->arrived, &k));
  RM_NEW(d->answer, passing, n);
  *num = rank_keys(&k, n, d->answer);
  return REMAP_OK;
}

remap_status rm_super_number(rm_arena *passing, const rm_comm *comm, int64_t n, int words, const uint64_t *key, int64_t *number,
                             int64_t *total)
{
  const size_t size = sizeof *key * (size_t)words;
  dealing      d    = {0};
  void        *samples = NULL, *arrived, *answers;
  int64_t      here = 0, before;

  RM_ASSERT(comm->size > 1 && words <= RM_SOUP_CORNERS);
  RM_TRY(rm_comm_agree(comm, prepare(passing, comm, n, words, key, &d), NULL));
  RM_TRY(rm_comm_allgatherv(comm, passing, d.sample, d.num_samples, size, d.sample_offset, &samples));
  RM_TRY(rm_comm_agree(comm, cut(passing, comm, words, samples, &d), NULL));
  RM_TRY(rm_comm_exchange(comm, passing, size, d.send_offset, key, d.recv_offset, &arrived));
  d.arrived = arrived;
  RM_TRY(rm_comm_agree(comm, number_here(passing, comm, words, &d, &here), NULL));
  before = here;
  RM_TRY(rm_comm_exscan_i64(comm, &before));
  for (int64_t i = 0; i < d.recv_offset[comm->size]; i++) d.answer[i] += before;
  RM_TRY(rm_comm_exchange(comm, passing, sizeof *d.answer, d.recv_offset, d.answer, d.back_offset, &answers));
  if (n) memcpy(number, answers, sizeof *number * (size_t)n); /* keys went in order, so do answers come */
  *total = here;
  return rm_comm_sum_i64(comm, total, 1);
}
