/* Sorting, order-independent sums of lists, offsets, hashes. */
#include "base/base.h"
#include "rt.h"

static uint64_t next(uint64_t *state) { return rm_hash_word((*state)++); }

static const int64_t lengths[] = {0, 1, 2, 3, 23, 24, 25, 47, 48, 49, 1000, 30000};

enum { NUM_LENGTHS = sizeof lengths / sizeof *lengths, MOST = 30000 };

static uint64_t full_range(uint64_t r) { return r; }
static uint64_t few_values(uint64_t r) { return r % 3; }
static uint64_t high_and_low(uint64_t r) { return (r & 255) | (r >> 60) << 60; }
static uint64_t one_byte(uint64_t r) { return UINT64_C(0x1234560000000000) | (r & 255) << 16; }
static uint64_t (*const shape[])(uint64_t) = {full_range, few_values, high_and_low, one_byte};

static void keys_are_sorted_and_equal_keys_keep_their_order(void)
{
  rm_keyed *data = malloc(MOST * sizeof *data), *scratch = malloc(MOST * sizeof *scratch);
  uint64_t  state = 1;

  for (int s = 0; s < 4; s++)
    for (int l = 0; l < NUM_LENGTHS; l++) {
      int64_t wrong = 0, sum = 0;

      for (int64_t i = 0; i < lengths[l]; i++) data[i] = (rm_keyed){shape[s](next(&state)), i};
      rm_sort_keyed(data, scratch, lengths[l]);
      for (int64_t i = 0; i < lengths[l]; i++) {
        sum += data[i].item;
        if (i) wrong += data[i].key < data[i - 1].key || (data[i].key == data[i - 1].key && data[i].item < data[i - 1].item);
      }
      RT_EQ(wrong, 0);
      RT_EQ(sum, lengths[l] * (lengths[l] - 1) / 2);
    }
  free(data);
  free(scratch);
}

static void words_are_sorted(void)
{
  uint64_t *data = malloc(MOST * sizeof *data), state = 2;

  for (int s = 0; s < 4; s++)
    for (int l = 0; l < NUM_LENGTHS; l++) {
      int64_t  wrong = 0;
      uint64_t sum = 0;

      for (int64_t i = 0; i < lengths[l]; i++) sum += data[i] = shape[s](next(&state));
      rm_sort_words(data, lengths[l]);
      for (int64_t i = 0; i < lengths[l]; i++) {
        sum -= data[i];
        if (i) wrong += data[i] < data[i - 1];
      }
      RT_EQ(wrong, 0);
      RT_EQ(sum, 0);
    }
  free(data);
}

enum { RANDOM, ASCENDING, DESCENDING, CONSTANT, TWO_VALUES, ORGAN_PIPE, NUM_PATTERNS };

static double pattern(int which, int64_t i, int64_t n, uint64_t *state)
{
  switch (which) {
    case RANDOM: return ldexp((double)(int64_t)next(state), (int)(next(state) % 200) - 100);
    case ASCENDING: return (double)i;
    case DESCENDING: return (double)-i;
    case CONSTANT: return 3;
    case TWO_VALUES: return (double)(next(state) % 2);
    default: return (double)(i < n / 2 ? i : n - i);
  }
}

static int by_value(const void *left, const void *right)
{
  const double x = *(const double *)left, y = *(const double *)right;

  return (x > y) - (x < y);
}

static void doubles_are_sorted(void)
{
  double  *data = malloc(MOST * sizeof *data), *want = malloc(MOST * sizeof *want);
  uint64_t state = 2;

  for (int p = 0; p < NUM_PATTERNS; p++)
    for (int l = 0; l < NUM_LENGTHS; l++) {
      for (int64_t i = 0; i < lengths[l]; i++) want[i] = data[i] = pattern(p, i, lengths[l], &state);
      qsort(want, (size_t)lengths[l], sizeof *want, by_value);
      rm_sort_doubles(data, lengths[l]);
      RT_EQ(memcmp(data, want, (size_t)lengths[l] * sizeof *data), 0);
    }
  free(data);
  free(want);
}

static void minus_zero_comes_before_plus_zero(void)
{
  double data[60];
  int    wrong = 0;

  for (int i = 0; i < 60; i++) data[i] = i % 3 ? 0.0 : -0.0;
  rm_sort_doubles(data, 60);
  for (int i = 0; i < 60; i++) wrong += (signbit(data[i]) != 0) != (i < 20);
  RT_EQ(wrong, 0);
}

/* A list on which the median of three is always the worst choice (Musser's killer), so that the fallback has to take over. */
static void quicksort_killer_is_sorted_in_time(void)
{
  const int64_t n = 400000, half = n / 2;
  double       *data  = malloc((size_t)n * sizeof *data);
  int64_t       wrong = 0;
  double        begin;

  for (int64_t i = 0; i < half; i++) {
    data[i]        = (double)(i % 2 ? half + i + (half % 2) : i + 1);
    data[half + i] = (double)(2 * (i + 1));
  }
  begin = rm_seconds();
  rm_sort_doubles(data, n);
  RT_CHECK(rm_seconds() - begin < 10);
  for (int64_t i = 1; i < n; i++) wrong += data[i] < data[i - 1];
  RT_EQ(wrong, 0);
  free(data);
}

static void sum_of_a_list_does_not_depend_on_its_order(void)
{
  double   list[200], copy[200], sum = 0;
  uint64_t state = 3;

  for (int i = 0; i < 200; i++) list[i] = pattern(RANDOM, i, 200, &state);
  for (int round = 0; round < 50; round++) {
    memcpy(copy, list, sizeof copy);
    if (round == 0) sum = rm_sum_sorted(copy, 200);
    RT_NEAR(rm_sum_sorted(copy, 200), sum, 0.0);
    for (int i = 199; i > 0; i--) { /* shuffle */
      const int    k = (int)(next(&state) % (uint64_t)(i + 1));
      const double x = list[i];

      list[i] = list[k];
      list[k] = x;
    }
  }
}

static void sum_of_a_list_is_compensated(void)
{
  double cancels[] = {1e100, 1.0, -1e100, 1.0}, tenths[1000];

  for (int i = 0; i < 1000; i++) tenths[i] = 0.1;
  RT_NEAR(rm_sum_sorted(cancels, 4), 2.0, 0.0);
  RT_NEAR(rm_sum_sorted(tenths, 1000), 100.0, 0.0);
  RT_NEAR(rm_sum_sorted(NULL, 0), 0.0, 0.0);
}

static void counts_become_offsets(void)
{
  int64_t count[] = {3, 0, 2, 5, -1}, none[] = {77};

  RT_EQ(rm_offsets(count, 4), 10);
  RT_EQ(count[0], 0);
  RT_EQ(count[1], 3);
  RT_EQ(count[2], 3);
  RT_EQ(count[3], 5);
  RT_EQ(count[4], 10);
  RT_EQ(rm_offsets(none, 0), 0);
  RT_EQ(none[0], 0);
}

static void items_are_grouped_by_key_in_their_order_and_left_out_below_0(void)
{
  const rm_lid key[8] = {2, 0, -1, 2, 4, 0, -1, 2}, expected[6] = {1, 5, 0, 3, 7, 4}, begin[6] = {0, 2, 2, 5, 5, 6};
  rm_lid       order[8];
  int64_t      offset[6];

  RT_EQ(rm_group(8, key, 5, offset, order), 6);
  for (int i = 0; i < 6; i++) {
    RT_EQ(offset[i], begin[i]);
    RT_EQ(order[i], expected[i]);
  }
  RT_EQ(rm_group(0, NULL, 0, offset, NULL), 0);
  RT_EQ(offset[0], 0);
}

static void zeros_of_both_signs_hash_alike(void)
{
  const double plus[3] = {0.0, 1.0, 0.0}, minus[3] = {-0.0, 1.0, -0.0}, turned[3] = {1.0, 0.0, 0.0};

  RT_CHECK(rm_hash_point(plus) == rm_hash_point(minus));
  RT_CHECK(rm_hash_point(plus) != rm_hash_point(turned));
}

/* Each output bit changes with each input bit in half of the tries, give or take a sixteenth of them. */
static void every_bit_of_a_word_reaches_every_bit_of_its_hash(void)
{
  enum { TRIES = 4000 };
  for (int in = 0; in < 64; in++) {
    int changed[64] = {0}, wrong = 0;

    for (uint64_t x = 0; x < TRIES; x++) {
      const uint64_t flips = rm_hash_word(x) ^ rm_hash_word(x ^ UINT64_C(1) << in);

      for (int out = 0; out < 64; out++) changed[out] += (int)(flips >> out & 1);
    }
    for (int out = 0; out < 64; out++) wrong += abs(changed[out] - TRIES / 2) > TRIES / 16;
    RT_EQ(wrong, 0);
  }
}

static int by_word(const void *left, const void *right)
{
  const uint64_t x = *(const uint64_t *)left, y = *(const uint64_t *)right;

  return (x > y) - (x < y);
}

static void points_of_a_grid_do_not_collide(void)
{
  enum { SIDE = 40, ALL = SIDE * SIDE * SIDE };
  uint64_t *hash       = malloc(ALL * sizeof *hash);
  int       collisions = 0;

  for (int i = 0; i < ALL; i++) {
    const double xyz[3] = {0.125 * (i % SIDE), 0.125 * (i / SIDE % SIDE), 0.125 * (i / SIDE / SIDE)};

    hash[i] = rm_hash_point(xyz);
  }
  qsort(hash, ALL, sizeof *hash, by_word);
  for (int i = 1; i < ALL; i++) collisions += hash[i] == hash[i - 1];
  RT_EQ(collisions, 0);
  free(hash);
}

static void an_item_lies_behind_the_last_offset_not_beyond_it(void)
{
  const int64_t offset[] = {2, 5, 5, 9}, of[] = {0, 0, 0, 0, 0, 2, 2, 2, 2, 3, 3};

  for (int64_t item = 0; item <= 10; item++) RT_EQ(rm_interval_of(4, offset, item), of[item]);
  RT_EQ(rm_interval_of(0, NULL, 3), -1);
}

RT_MAIN(RT_CASE(keys_are_sorted_and_equal_keys_keep_their_order), RT_CASE(words_are_sorted), RT_CASE(doubles_are_sorted),
        RT_CASE(minus_zero_comes_before_plus_zero), RT_CASE(quicksort_killer_is_sorted_in_time),
        RT_CASE(sum_of_a_list_does_not_depend_on_its_order), RT_CASE(sum_of_a_list_is_compensated),
        RT_CASE(counts_become_offsets), RT_CASE(an_item_lies_behind_the_last_offset_not_beyond_it),
        RT_CASE(items_are_grouped_by_key_in_their_order_and_left_out_below_0),
        RT_CASE(zeros_of_both_signs_hash_alike),
        RT_CASE(every_bit_of_a_word_reaches_every_bit_of_its_hash), RT_CASE(points_of_a_grid_do_not_collide))
