/* sort -- keys with items by radix, doubles by comparison, and what is built on sorted lists.
 *
 * rm_sort_keyed: one pass counts all eight bytes, then one pass per byte that is not the same in every key; short lists by
 * insertion. rm_sort_doubles: quicksort by the median of three with insertion below 24 elements; a part that is divided
 * badly too often is finished by heapsort, so that O(n log n) holds for every input. */
#include "base.h"

#include <math.h>
#include <string.h>

static void insert_keyed(rm_keyed *data, int64_t n)
{
  for (int64_t i = 1; i < n; i++) {
    const rm_keyed x = data[i];
    int64_t        k = i;

    for (; k > 0 && data[k - 1].key > x.key; k--) data[k] = data[k - 1];
    data[k] = x;
  }
}

/* Move src to dst in the order of one byte of the key. count holds the byte's histogram and is used up. */
static void scatter(const rm_keyed *src, rm_keyed *dst, int64_t n, int shift, int64_t count[256])
{
  int64_t at = 0;

  for (int d = 0; d < 256; d++) {
    const int64_t here = count[d];

    count[d] = at;
    at += here;
  }
  for (int64_t i = 0; i < n; i++) dst[count[src[i].key >> shift & 255]++] = src[i];
}

void rm_sort_keyed(rm_keyed *data, rm_keyed *scratch, int64_t n)
{
  int64_t   count[8][256] = {{0}};
  rm_keyed *src = data, *dst = scratch;

  if (n < 48) {
    insert_keyed(data, n);
    return;
  }
  for (int64_t i = 0; i < n; i++)
    for (int b = 0; b < 8; b++) count[b][data[i].key >> 8 * b & 255]++;
  for (int b = 0; b < 8; b++) {
    rm_keyed *other;

    if (count[b][src[0].key >> 8 * b & 255] == n) continue;
    scatter(src, dst, n, 8 * b, count[b]);
    other = src;
    src   = dst;
    dst   = other;
  }
  if (src != data) memcpy(data, src, (size_t)n * sizeof *data);
}

/* Total order: by value, -0 before +0. */
static bool less(double x, double y) { return x < y || (x == y && signbit(x) && !signbit(y)); }

static void swap(double *x, double *y)
{
  const double z = *x;

  *x = *y;
  *y = z;
}

static void insert_doubles(double *data, int64_t n)
{
  for (int64_t i = 1; i < n; i++) {
    const double x = data[i];
    int64_t      k = i;

    for (; k > 0 && less(x, data[k - 1]); k--) data[k] = data[k - 1];
    data[k] = x;
  }
}

static void sift_down(double *data, int64_t at, int64_t n)
{
  for (int64_t child; (child = 2 * at + 1) < n; at = child) {
    if (child + 1 < n && less(data[child], data[child + 1])) child++;
    if (!less(data[at], data[child])) return;
    swap(&data[at], &data[child]);
  }
}

static void heap_doubles(double *data, int64_t n)
{
  for (int64_t i = n / 2; i-- > 0;) sift_down(data, i, n);
  for (int64_t i = n; i-- > 1;) {
    swap(&data[0], &data[i]);
    sift_down(data, 0, i);
  }
}

static double median(double x, double y, double z)
{
  if (less(y, x)) swap(&x, &y);
  if (less(z, y)) y = z;
  return less(y, x) ? x : y;
}

/* Divide at the median of three: nothing in data[0 .. result - 1] is above anything in data[result .. n - 1]. 0 < result < n,
 * since another of the three is not below the pivot and stops lo before the end. */
static int64_t divide(double *data, int64_t n)
{
  const double pivot = median(data[0], data[n / 2], data[n - 1]);
  int64_t      lo = 0, hi = n - 1;

  for (;; lo++, hi--) {
    while (less(data[lo], pivot)) lo++;
    while (less(pivot, data[hi])) hi--;
    if (lo >= hi) return hi + 1;
    swap(&data[lo], &data[hi]);
  }
}

static void quick_doubles(double *data, int64_t n, int depth)
{
  while (n > 24) {
    int64_t left;

    if (depth-- == 0) {
      heap_doubles(data, n);
      return;
    }
    left = divide(data, n);
    if (left < n - left) { /* recurse into the smaller part */
      quick_doubles(data, left, depth);
      data += left;
      n -= left;
    } else {
      quick_doubles(data + left, n - left, depth);
      n = left;
    }
  }
  insert_doubles(data, n);
}

void rm_sort_doubles(double *data, int64_t n)
{
  int depth = 2;

  for (int64_t k = n; k > 1; k /= 2) depth += 2;
  quick_doubles(data, n, depth);
}

static void insert_words(uint64_t *data, int64_t n)
{
  for (int64_t i = 1; i < n; i++) {
    const uint64_t x = data[i];
    int64_t        k = i;

    for (; k > 0 && data[k - 1] > x; k--) data[k] = data[k - 1];
    data[k] = x;
  }
}

/* Put x into the heap of n words whose root is free. */
static void sift_word(uint64_t *data, int64_t at, int64_t n, uint64_t x)
{
  for (int64_t child; (child = 2 * at + 1) < n; at = child) {
    if (child + 1 < n && data[child] < data[child + 1]) child++;
    if (data[child] <= x) break;
    data[at] = data[child];
  }
  data[at] = x;
}

void rm_sort_words(uint64_t *data, int64_t n)
{
  if (n <= RM_FEW_WORDS) {
    insert_words(data, n);
    return;
  }
  for (int64_t i = n / 2; i-- > 0;) sift_word(data, i, n, data[i]);
  for (int64_t i = n; i-- > 1;) {
    const uint64_t x = data[i];

    data[i] = data[0];
    sift_word(data, 0, i, x);
  }
}

double rm_sum_sorted(double *data, int64_t n)
{
  double sum = 0, lost = 0; /* lost: what rounding took from sum (Neumaier) */

  rm_sort_doubles(data, n);
  for (int64_t i = 0; i < n; i++) {
    const double x = data[i], next = sum + x;

    lost += fabs(sum) >= fabs(x) ? (sum - next) + x : (x - next) + sum;
    sum = next;
  }
  return sum + lost;
}

int64_t rm_offsets(int64_t *count, int64_t n)
{
  int64_t at = 0;

  for (int64_t i = 0; i < n; i++) {
    const int64_t here = count[i];

    count[i] = at;
    at += here;
  }
  count[n] = at;
  return at;
}

int64_t rm_interval_of(int64_t n, const int64_t *offset, int64_t item)
{
  int64_t low = 0, high = n;

  while (high - low > 1) {
    const int64_t middle = low + (high - low) / 2;

    if (offset[middle] <= item) low = middle;
    else high = middle;
  }
  return high > low ? low : -1;
}

int64_t rm_group(int64_t n, const rm_lid *key, int64_t num_keys, int64_t *offset, rm_lid *order)
{
  RM_ASSERT(n <= INT32_MAX);
  for (int64_t i = 0; i <= num_keys; i++) offset[i] = 0;
  for (int64_t k = 0; k < n; k++)
    if (key[k] >= 0) offset[key[k]]++;
  rm_offsets(offset, num_keys);
  for (int64_t k = 0; k < n; k++)
    if (key[k] >= 0) order[offset[key[k]]++] = (rm_lid)k;
  for (int64_t i = num_keys; i > 0; i--) offset[i] = offset[i - 1]; /* each key's end is the next one's begin */
  offset[0] = 0;
  return offset[num_keys];
}
