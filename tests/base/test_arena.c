/* Arena, growing arrays, saturating counts. */
#include <stdlib.h>
#include "base/base.h"
#include "rt.h"

static const int64_t sizes[] = {0, 1, 63, 64, 65, 1000, 32768, 32769, 100000, 262144, 5000000, 8};

enum { NUM_SIZES = sizeof sizes / sizeof *sizes };

static void allocations_are_aligned_and_do_not_touch(void)
{
  rm_arena      *arena = rm_arena_new();
  unsigned char *at[40 * NUM_SIZES];

  for (int i = 0; i < 40 * NUM_SIZES; i++) {
    at[i] = rm_arena_alloc(arena, sizes[i % NUM_SIZES], 1);
    if (!RT_CHECK(at[i] != NULL)) continue;
    RT_EQ((uintptr_t)at[i] % 64, 0);
    memset(at[i], i & 255, (size_t)sizes[i % NUM_SIZES]);
  }
  for (int i = 0; i < 40 * NUM_SIZES; i++) {
    const int64_t n    = sizes[i % NUM_SIZES];
    int64_t       same = 0;

    for (int64_t k = 0; at[i] && k < n; k++) same += at[i][k] == (i & 255);
    RT_EQ(same, n);
  }
  rm_arena_drop(arena);
}

static void bytes_cover_what_was_asked(void)
{
  rm_arena    *arena  = rm_arena_new();
  const size_t before = rm_arena_bytes(arena);

  rm_arena_alloc(arena, 1000000, 8);
  RT_CHECK(rm_arena_bytes(arena) - before >= 8000000);
  RT_CHECK(rm_arena_bytes(arena) - before <= 8001000);
  rm_arena_drop(arena);
}

static void zeroed_memory_is_zero(void)
{
  rm_arena *arena = rm_arena_new();

  for (int i = 0; i < 20; i++) memset(rm_arena_alloc(arena, 5000, 1), 255, 5000);
  for (int i = 0; i < NUM_SIZES; i++) {
    const unsigned char *x     = rm_arena_zero(arena, sizes[i], 1);
    int64_t              zeros = 0;

    for (int64_t k = 0; k < sizes[i]; k++) zeros += x[k] == 0;
    RT_EQ(zeros, sizes[i]);
  }
  rm_arena_drop(arena);
}

/* Whether it frees them, once, the sanitizers see. */
static void adopted_memory_is_the_arenas(void)
{
  rm_arena    *arena  = rm_arena_new();
  const size_t before = rm_arena_bytes(arena);
  double      *kept   = malloc(1000 * sizeof *kept), *left = malloc(sizeof *left);

  RT_EQ(rm_arena_adopt(arena, kept, 1000 * sizeof *kept), REMAP_OK);
  RT_CHECK(rm_arena_bytes(arena) - before >= 8000);
  kept[999] = 1;
  rm_arena_fail_at(arena, 1);
  RT_EQ(rm_arena_adopt(arena, left, sizeof *left), REMAP_NO_MEMORY);
  free(left);
  rm_arena_drop(arena);
}

static void adopted_memory_can_be_taken_back(void)
{
  rm_arena *arena = rm_arena_new();
  double   *apart[3], *taken;

  for (int k = 0; k < 3; k++) {
    apart[k] = rm_arena_alloc_apart(arena, 1000, sizeof **apart);
    if (RT_CHECK(apart[k] != NULL)) apart[k][999] = k;
  }
  const size_t before = rm_arena_bytes(arena);
  taken               = rm_arena_release(arena, apart[1]);
  RT_CHECK(taken == apart[1]);
  RT_EQ(before - rm_arena_bytes(arena), 8000);
  RT_CHECK(rm_arena_alloc_apart(arena, INT64_MAX / 4, 8) == NULL);
  rm_arena_drop(arena);
  RT_EQ((int)taken[999], 1);
  free(taken);
}

static void impossible_sizes_give_null(void)
{
  rm_arena *arena = rm_arena_new();

  RT_CHECK(rm_arena_alloc(arena, INT64_MAX, 8) == NULL);
  RT_CHECK(rm_arena_alloc(arena, INT64_MAX, 1) == NULL);
  RT_CHECK(rm_arena_zero(arena, INT64_MAX / 2, 4) == NULL);
  RT_CHECK(rm_arena_alloc(arena, INT64_MAX / 8, 8) == NULL);
  RT_CHECK(rm_arena_alloc(arena, 10, 8) != NULL);
  rm_arena_drop(arena);
}

static remap_status take_three(rm_arena *arena, int *taken)
{
  double *x;

  for (*taken = 0; *taken < 3; ++*taken) RM_NEW(x, arena, 10 + *taken);
  return REMAP_OK;
}

static remap_status take_cleared(rm_arena *arena, int64_t *x0)
{
  int64_t *x;

  RM_NEW0(x, arena, 4);
  *x0 = x[0] | x[3];
  return REMAP_OK;
}

static void the_chosen_allocation_fails(void)
{
  rm_arena *arena = rm_arena_new();
  int64_t   x0    = -1;
  int       taken;

  for (int n = 1; n <= 3; n++) {
    rm_arena_fail_at(arena, n);
    RT_EQ(take_three(arena, &taken), REMAP_NO_MEMORY);
    RT_EQ(taken, n - 1);
    RT_EQ(take_three(arena, &taken), REMAP_OK); /* once only */
  }
  rm_arena_fail_at(arena, 1);
  RT_EQ(take_cleared(arena, &x0), REMAP_NO_MEMORY);
  RT_EQ(x0, -1);
  rm_arena_fail_at(arena, 1);
  rm_arena_fail_at(arena, 0);
  RT_EQ(take_cleared(arena, &x0), REMAP_OK);
  RT_EQ(x0, 0);
  rm_arena_drop(arena);
}

static void nothing_can_be_dropped(void)
{
  rm_arena_drop(NULL);
  rm_arena_drop(rm_arena_new());
}

static void an_array_grows_and_keeps_its_content(void)
{
  int    *x        = NULL;
  int64_t capacity = 0, moves = 0, wrong = 0;

  for (int i = 0; i < 100000; i++) {
    const int64_t before = capacity;

    RT_EQ(rm_grow(&x, &capacity, i + 1, sizeof *x), REMAP_OK);
    RT_CHECK(capacity > i);
    moves += capacity != before;
    x[i] = i;
  }
  for (int i = 0; i < 100000; i++) wrong += x[i] != i;
  RT_EQ(wrong, 0);
  RT_CHECK(moves < 30);
  free(x);
}

static void an_array_that_cannot_grow_stays(void)
{
  double *x        = NULL, *before;
  int64_t capacity = 0;

  RT_EQ(rm_grow(&x, &capacity, 100, sizeof *x), REMAP_OK);
  x[99]  = 5;
  before = x;
  RT_EQ(rm_grow(&x, &capacity, INT64_MAX, sizeof *x), REMAP_NO_MEMORY);
  RT_EQ(rm_grow(&x, &capacity, INT64_MAX / 16, sizeof *x), REMAP_NO_MEMORY);
  RT_CHECK(x == before && x[99] == 5);
  RT_EQ(capacity, 100);
  free(x);
}

static void counts_saturate(void)
{
  RT_EQ(rm_add_sat(2, 3), 5);
  RT_EQ(rm_add_sat(INT64_MAX, 1), INT64_MAX);
  RT_EQ(rm_add_sat(INT64_MAX - 1, 1), INT64_MAX);
  RT_EQ(rm_mul_sat(0, INT64_MAX), 0);
  RT_EQ(rm_mul_sat(INT64_MAX, 0), 0);
  RT_EQ(rm_mul_sat(INT64_C(1) << 31, INT64_C(1) << 31), INT64_C(1) << 62);
  RT_EQ(rm_mul_sat(INT64_C(1) << 32, INT64_C(1) << 31), INT64_MAX);
}

RT_MAIN(RT_CASE(allocations_are_aligned_and_do_not_touch), RT_CASE(bytes_cover_what_was_asked), RT_CASE(zeroed_memory_is_zero),
        RT_CASE(adopted_memory_is_the_arenas), RT_CASE(adopted_memory_can_be_taken_back),
        RT_CASE(impossible_sizes_give_null), RT_CASE(the_chosen_allocation_fails),
        RT_CASE(nothing_can_be_dropped), RT_CASE(an_array_grows_and_keeps_its_content),
        RT_CASE(an_array_that_cannot_grow_stays), RT_CASE(counts_saturate))
