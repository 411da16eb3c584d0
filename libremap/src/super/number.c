/* number -- equal keys of all ranks get one number, in the order of the keys: each rank has its own in order, every key goes to
 * the rank of its interval, is numbered there, and the number comes back. Where first words are numbers from 0 on, counts of
 * them tell where to cut, the same number of counts on any number of ranks; elsewhere samples of the keys. What the ranks sent
 * is merged. Keys without order are sorted a word after the other, by a later one only where the earlier ones are equal.
 * O(n log ranks); 16 bytes and the key for each. */
#include "super/super_private.h"

#include <string.h>

/* Samples of a rank: so many, but of all ranks together not many more than ALL_SAMPLES, which every rank sorts. */
enum { SAMPLES = 64, LEAST_SAMPLES = 4, ALL_SAMPLES = 1 << 19, BINS = 1024, FEW = 24 };

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
  const rm_comm  *comm;
  int             words;
  const uint64_t *key; /* [num][words] in order */
  int64_t         num;
  int64_t        *send_offset, *recv_offset, *back_offset; /* [size + 1] */
  uint64_t       *arrived;  /* keys of this rank's interval, and their numbers */
  int64_t        *answer;
} dealing;

static remap_status prepare(rm_arena *passing, dealing *d)
{
  RM_NEW(d->send_offset, passing, (int64_t)d->comm->size + 1);
  RM_NEW(d->recv_offset, passing, (int64_t)d->comm->size + 1);
  RM_NEW(d->back_offset, passing, (int64_t)d->comm->size + 1);
  d->send_offset[0]             = 0;
  d->send_offset[d->comm->size] = d->num;
  return REMAP_OK;
}

/* Rank r's interval begins at a key: the first `words` words of it. Those of lower ranks are cut. */
static void cut_at(dealing *d, int r, const uint64_t *key, int words)
{
  int64_t low = d->send_offset[r - 1], high = d->num;

  while (low < high) {
    const int64_t middle = (low + high) / 2;

    if (compare(d->key + middle * d->words, key, words) < 0) low = middle + 1;
    else high = middle;
  }
  d->send_offset[r] = low;
}

/* Cut where first words are 0 .. range - 1, and lie evenly within each of BINS parts of that. Collective. */
static remap_status cut_by_counts(dealing *d, int64_t range)
{
  const int64_t width = range / BINS + 1;
  int64_t       below[BINS + 1] = {0};
  int           bin = 0;

  for (int64_t i = 0; i < d->num; i++) below[(int64_t)d->key[i * d->words] / width]++;
  RM_TRY(rm_comm_sum_i64(d->comm, below, BINS));
  rm_offsets(below, BINS);
  for (int r = 1; r < d->comm->size; r++) {
    const int64_t goal = below[BINS] / d->comm->size * r + below[BINS] % d->comm->size * r / d->comm->size;
    uint64_t      word;

    while (bin < BINS - 1 && below[bin + 1] <= goal) bin++;
    word = (uint64_t)(bin * width);
    if (below[bin + 1] > below[bin])
      word += (uint64_t)((double)(goal - below[bin]) / (double)(below[bin + 1] - below[bin]) * (double)width);
    cut_at(d, r, &word, 1);
  }
  return REMAP_OK;
}

/* Samples of the keys: this rank's, and everybody's in order. */
typedef struct samples {
  uint64_t mine[SAMPLES * RM_SOUP_CORNERS];
  int64_t  num_mine;
  int64_t *offset; /* [size + 1] */
  void    *all;
  keys     sorted;
} samples;

static remap_status take_samples(rm_arena *passing, const dealing *d, samples *s)
{
  const int64_t share = ALL_SAMPLES / d->comm->size;
  const int64_t most  = share > SAMPLES ? SAMPLES : share > LEAST_SAMPLES ? share : LEAST_SAMPLES;

  s->num_mine = d->num < most ? d->num : most;
  for (int64_t i = 0; i < s->num_mine; i++)
    memcpy(s->mine + i * d->words, d->key + d->num * i / s->num_mine * d->words, sizeof *d->key * (size_t)d->words);
  RM_NEW(s->offset, passing, (int64_t)d->comm->size + 1);
  return REMAP_OK;
}

static remap_status sort_samples(rm_arena *passing, const dealing *d, samples *s)
{
  const int64_t num = s->offset[d->comm->size];

  RM_TRY(start(passing, num, d->words, s->all, &s->sorted));
  for (int64_t i = 0; i < num; i++) s->sorted.order[i].item = i;
  if (num) sort_run(&s->sorted, 0, num, 0);
  return REMAP_OK;
}

/* Cut at the samples' quantiles. Collective. */
static remap_status cut_by_samples(rm_arena *passing, dealing *d)
{
  const size_t size = sizeof *d->key * (size_t)d->words;
  samples      s    = {.num_mine = 0};

  RM_TRY(rm_comm_agree(d->comm, take_samples(passing, d, &s), NULL));
  RM_TRY(rm_comm_allgatherv(d->comm, passing, s.mine, s.num_mine, size, s.offset, &s.all));
  RM_TRY(rm_comm_agree(d->comm, sort_samples(passing, d, &s), NULL));
  for (int r = 1; r < d->comm->size; r++) {
    const int64_t num = s.offset[d->comm->size];

    if (num > 0) cut_at(d, r, s.sorted.word + s.sorted.order[num * r / d->comm->size].item * d->words, d->words);
    else d->send_offset[r] = 0;
  }
  return REMAP_OK;
}

/* Keys that arrived, a run in order from every rank; a heap has the ranks whose runs go on, the one of the least key first. */
typedef struct merge {
  const dealing *d;
  int64_t       *next; /* [ranks] place of the run's next key */
  int           *heap;
  int            num;
} merge;

static bool comes_first(const merge *m, int a, int b)
{
  const dealing *d = m->d;
  return compare(d->arrived + m->next[a] * d->words, d->arrived + m->next[b] * d->words, d->words) < 0;
}

static void sift_down(merge *m, int k)
{
  for (int best;; k = best) {
    best = k;
    for (int child = 2 * k + 1; child <= 2 * k + 2 && child < m->num; child++)
      if (comes_first(m, m->heap[child], m->heap[best])) best = child;
    if (best == k) return;
    const int x   = m->heap[k];
    m->heap[k]    = m->heap[best];
    m->heap[best] = x;
  }
}

static remap_status number_here(rm_arena *passing, dealing *d, int64_t *num)
{
  const uint64_t *last = NULL;
  merge           m    = {.d = d};

  RM_NEW(d->answer, passing, d->recv_offset[d->comm->size]);
  RM_NEW(m.next, passing, d->comm->size);
  RM_NEW(m.heap, passing, d->comm->size);
  for (int r = 0; r < d->comm->size; r++) {
    m.next[r] = d->recv_offset[r];
    if (m.next[r] < d->recv_offset[r + 1]) m.heap[m.num++] = r;
  }
  for (int k = m.num / 2; k-- > 0;) sift_down(&m, k);
  for (*num = 0; m.num; sift_down(&m, 0)) {
    const int       r   = m.heap[0];
    const uint64_t *key = d->arrived + m.next[r] * d->words;

    *num += !last || compare(last, key, d->words) != 0;
    d->answer[m.next[r]++] = *num - 1;
    last                   = key;
    if (m.next[r] == d->recv_offset[r + 1]) m.heap[0] = m.heap[--m.num];
  }
  return REMAP_OK;
}

remap_status rm_super_number(rm_arena *passing, const rm_comm *comm, int64_t n, int words, const uint64_t *key, int64_t range,
                             int64_t *number, int64_t *total)
{
  dealing d    = {.comm = comm, .words = words, .key = key, .num = n};
  int64_t here = 0, before;
  void   *arrived, *answers;

  RM_ASSERT(comm->size > 1 && words <= RM_SOUP_CORNERS);
  RM_TRY(rm_comm_agree(comm, prepare(passing, &d), NULL));
  RM_TRY(range > 0 ? cut_by_counts(&d, range) : cut_by_samples(passing, &d));
  RM_TRY(rm_comm_exchange(comm, passing, sizeof *key * (size_t)words, d.send_offset, key, d.recv_offset, &arrived));
  d.arrived = arrived;
  RM_TRY(rm_comm_agree(comm, number_here(passing, &d, &here), NULL));
  before = here;
  RM_TRY(rm_comm_exscan_i64(comm, &before));
  for (int64_t i = 0; i < d.recv_offset[comm->size]; i++) d.answer[i] += before;
  RM_TRY(rm_comm_exchange(comm, passing, sizeof *d.answer, d.recv_offset, d.answer, d.back_offset, &answers));
  if (n) memcpy(number, answers, sizeof *number * (size_t)n); /* keys went in order, so do answers come */
  *total = here;
  return rm_comm_sum_i64(comm, total, 1);
}
