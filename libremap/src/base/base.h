/* base -- what every room uses: failures and their text, memory that is dropped as a whole, growable arrays, sorting,
 * exact sums, clocks. Knows neither MPI calls nor geometry; everything here is not collective. */
#ifndef RM_BASE_H
#define RM_BASE_H

#include <remap/remap.h>
#include <assert.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef int32_t rm_lid; /* an entity of this rank    */
typedef int64_t rm_gid; /* an entity of the whole mesh */

/* ---- failures -------------------------------------------------------------------------------------------------- */

#define RM_TRY(call)                                    \
  do {                                                  \
    const remap_status rm_status_ = (call);             \
    if (rm_status_ != REMAP_OK) return rm_status_;      \
  } while (0)
/* RM_GOTO(done, status = call): leave through the one cleanup label. */
#define RM_GOTO(label, assign)             \
  do {                                     \
    if ((assign) != REMAP_OK) goto label;  \
  } while (0)
/* The caller's mistake; checked in every build. Never in a collective function. */
#define RM_REQUIRE(cond, status) \
  do {                           \
    if (!(cond)) return (status); \
  } while (0)
/* Our mistake; debug builds. */
#define RM_ASSERT(cond) assert(cond)

/* The reason of a failure, filled where it is found and carried up beside the status. */
typedef struct rm_reason {
  int    side;        /* mesh concerned: REMAP_SOURCE, REMAP_TARGET, or -1 */
  rm_gid global_cell; /* cell concerned, or -1                              */
  char   text[400];   /* what is wrong and what to do, without mesh, zone and cell; "" if nothing is */
} rm_reason;

/* Fill *reason (may be NULL) in the manner of printf and hand status back: return rm_fail(...). The first reason stays. */
remap_status rm_fail(remap_status status, rm_reason *reason, int side, rm_gid global_cell, const char *format, ...)
    __attribute__((format(printf, 5, 6)));

/* ---- memory ---------------------------------------------------------------------------------------------------- */

/* arena -- blocks that are given back together. One product lives in one arena; nothing in it is freed alone.
 * Memory is aligned to 64 bytes. Large requests get a block of their own, so that dropping them returns memory. */
typedef struct rm_arena rm_arena;
/* NULL if memory is out. The caller owns it: rm_arena_drop. */
rm_arena *rm_arena_new(void);
/* Give everything back; NULL is fine. */
void rm_arena_drop(rm_arena *arena);
/* count * size bytes, not cleared; NULL if memory is out or the product overflows. count 0 gives a valid pointer. Owned by
 * arena. */
void *rm_arena_alloc(rm_arena *arena, int64_t count, size_t size);
/* The same, cleared to zero. */
void *rm_arena_zero(rm_arena *arena, int64_t count, size_t size);
/* Hand malloc'ed memory of `bytes` over to the arena, which frees it with all else. NO_MEMORY: it stays the caller's. */
remap_status rm_arena_adopt(rm_arena *arena, void *data, size_t bytes);
/* Memory like that, of count * size bytes, for rm_arena_release to take; NULL if there is none. */
void *rm_arena_alloc_apart(rm_arena *arena, int64_t count, size_t size);
/* Take memory back that was adopted: it is the caller's, who frees it. data itself, not const any more. O(adopted pieces). */
void *rm_arena_release(rm_arena *arena, const void *data);
/* Bytes in use. */
size_t rm_arena_bytes(const rm_arena *arena);
/* ptr = RM_NEW(arena, count, type): returns NO_MEMORY from the calling function if there is none. Only where nothing is
 * owned. */
#define RM_NEW(ptr, arena, count)                                                                    \
  do {                                                                                               \
    if (!((ptr) = rm_arena_alloc((arena), (int64_t)(count), sizeof *(ptr)))) return REMAP_NO_MEMORY; \
  } while (0)
#define RM_NEW0(ptr, arena, count)                                                                  \
  do {                                                                                              \
    if (!((ptr) = rm_arena_zero((arena), (int64_t)(count), sizeof *(ptr)))) return REMAP_NO_MEMORY; \
  } while (0)
/* For tests: let the n-th allocation from now on (1 = the next) of this arena fail; 0 switches it off. */
void rm_arena_fail_at(rm_arena *arena, int64_t n);

/* Room for `need` elements of `size` bytes in a malloc'ed array that grows by half: *data may move, *capacity is in elements.
 * Start from NULL and 0; the caller frees *data. NO_MEMORY leaves the array as it was. */
remap_status rm_grow(void *data, int64_t *capacity, int64_t need, size_t size);
/* The same with no more room than that: for arrays whose length is known. */
remap_status rm_reserve(void *data, int64_t *capacity, int64_t need, size_t size);

/* a + b of counts, saturating at INT64_MAX (so that an allocation of the result fails). Arguments >= 0. */
int64_t rm_add_sat(int64_t a, int64_t b);
/* a * b, likewise. */
int64_t rm_mul_sat(int64_t a, int64_t b);

/* The greater of two numbers, neither of them NaN: for loops in which the call of fmax would count. */
static inline double rm_max(double a, double b) { return a > b ? a : b; }

/* ---- sorting --------------------------------------------------------------------------------------------------- */

/* A 64-bit key and what it belongs to. */
typedef struct rm_keyed {
  uint64_t key;
  int64_t  item;
} rm_keyed;
/* Sort by key, stable; radix, O(n) per significant byte that is not constant. scratch is [n]. The result is in data. */
void rm_sort_keyed(rm_keyed *data, rm_keyed *scratch, int64_t n);
/* Sort doubles ascending (-0 before +0); in place, no allocation, O(n log n), quick for short lists. No NaN. */
void rm_sort_doubles(double *data, int64_t n);
enum { RM_FEW_WORDS = 24 };
/* Sort words ascending; in place, no allocation, O(n log n), by insertion up to RM_FEW_WORDS of them. */
void rm_sort_words(uint64_t *data, int64_t n);
/* Sum of a list that does not depend on its order: sorts data by value, then adds with compensation. */
double rm_sum_sorted(double *data, int64_t n);
/* In place exclusive prefix sum over count[0..n]: count[0..n-1] hold counts, afterwards offsets, count[n] the total. */
int64_t rm_offsets(int64_t *count, int64_t n);
/* The last k below n with offset[k] <= item, offset ascending: where the item lies, say the zone of a cell. 0 if all are
 * greater, -1 if n is 0. O(log n). */
int64_t rm_interval_of(int64_t n, const int64_t *offset, int64_t item);
/* Group the items 0 to n - 1, n < 2^31, by key[k] < num_keys, in their order: those of key i to order, [n], from offset[i] on;
 * those whose key is below 0 are left out. offset is [num_keys + 1]. By counting, without allocation, O(n + num_keys). Returns
 * how many there are. */
int64_t rm_group(int64_t n, const rm_lid *key, int64_t num_keys, int64_t *offset, rm_lid *order);

/* ---- hashing --------------------------------------------------------------------------------------------------- */

/* A well mixed 64-bit hash of one word. */
uint64_t rm_hash_word(uint64_t x);
/* The same of the three coordinates of a point, -0 and +0 alike. */
uint64_t rm_hash_point(const double xyz[3]);

/* ---- exact sums ------------------------------------------------------------------------------------------------ */

/* superaccumulator -- a sum of doubles without rounding: a fixed-point number wide enough for every double, in limbs of 32
 * bits kept in 64, so that partial sums of ranks add limb by limb (an MPI_SUM of int64_t) and the result depends on neither
 * order nor partition. Room for 2^30 additions between two calls of rm_sum_carry. Finite values only. */
enum { RM_SUM_LIMBS = 70 };
typedef struct rm_sum {
  int64_t limb[RM_SUM_LIMBS];
  int64_t added; /* additions since the last carry */
} rm_sum;
/* Make it 0, as {0} is. */
void rm_sum_clear(rm_sum *sum);
/* Add a number. */
void rm_sum_add(rm_sum *sum, double x);
/* Add the product x * y exactly (as two doubles, by an error-free product; |x y| within 2^-960..2^1000 or 0). */
void rm_sum_add_product(rm_sum *sum, double x, double y);
/* Add another sum, as if all its numbers came. */
void rm_sum_merge(rm_sum *sum, const rm_sum *other);
/* Normalise limbs so that |limb| < 2^32: before summing accumulators of many ranks limb by limb. */
void rm_sum_carry(rm_sum *sum);
/* The nearest double (ties to even). */
double rm_sum_value(const rm_sum *sum);

/* ---- clock ----------------------------------------------------------------------------------------------------- */

/* Seconds of wall clock since some fixed moment. */
double rm_seconds(void);

#endif
