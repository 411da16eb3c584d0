/* base -- memory, growing arrays, maps by open addressing, messages, shares. Everything is linear in what it is given; an
 * agreement is one reduction, plus one broadcast after a failure. */
#include "base.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- messages ----------------------------------------------------------------------------------------------------- */

void ra_line(char *text, size_t size, const char *format, va_list args)
{
  vsnprintf(text, size, format, args);
  for (char *c = text; *c; c++)
    if ((unsigned char)*c < ' ' || *c == 127) *c = '?';
}

int ra_agree(MPI_Comm comm, int mine, char *text, size_t size)
{
  struct {
    int status, rank;
  } worst = {mine, 0};

  MPI_Comm_rank(comm, &worst.rank);
  MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_2INT, MPI_MAXLOC, comm);
  if (worst.status) MPI_Bcast(text, (int)size, MPI_CHAR, worst.rank, comm);
  return worst.status;
}

/* ---- memory ------------------------------------------------------------------------------------------------------- */

void *ra_alloc(int64_t count, size_t size)
{
  if (count < 0 || (uint64_t)count > PTRDIFF_MAX / size) return NULL;
  return malloc(count ? (size_t)count * size : 1);
}

void *ra_zeros(int64_t count, size_t size) { return count < 0 ? NULL : calloc((size_t)count + 1, size); }

bool ra_reserve(ra_array *array, int64_t more, size_t size)
{
  int64_t capacity = array->capacity;
  void   *item;

  if (more <= array->capacity - array->count) return true;
  if (more > (int64_t)(PTRDIFF_MAX / (2 * size)) - array->count) return false;
  capacity = array->count + more > 2 * capacity ? array->count + more : 2 * capacity;
  item     = realloc(array->item, (size_t)capacity * size);
  if (!item) return false;
  array->item     = item;
  array->capacity = capacity;
  return true;
}

bool ra_push(ra_array *array, const void *item, size_t size)
{
  if (!ra_reserve(array, 1, size)) return false;
  memcpy((char *)array->item + (size_t)array->count++ * size, item, size);
  return true;
}

bool ra_push_int(ra_array *array, int64_t value) { return ra_push(array, &value, sizeof value); }

void ra_drop(ra_array *array)
{
  free(array->item);
  *array = (ra_array){.item = NULL};
}

/* ---- maps --------------------------------------------------------------------------------------------------------- */

static uint64_t mix(uint64_t h, int64_t value)
{
  h ^= (uint64_t)value;
  h *= UINT64_C(0x9e3779b97f4a7c15);
  return h ^ (h >> 29);
}

/* Where the key stands, or the free place where it would. */
static int64_t slot_of(const ra_map *map, const int64_t *key)
{
  const size_t bytes = (size_t)map->width * sizeof *key;
  uint64_t     h     = UINT64_C(0x2545f4914f6cdd1d);

  for (int i = 0; i < map->width; i++) h = mix(h, key[i]);
  for (uint64_t s = h;; s++) {
    const int64_t at = (int64_t)(s & (uint64_t)(map->num_slots - 1));
    const int64_t i  = map->slot[at];

    if (i < 0 || !memcmp((const int64_t *)map->key.item + i * map->width, key, bytes)) return at;
  }
}

/* Twice the slots, all keys put in again. */
static bool map_grow(ra_map *map)
{
  const int64_t num  = map->num_slots ? 2 * map->num_slots : 64;
  int64_t      *slot = ra_alloc(num, sizeof *slot);

  if (!slot) return false;
  for (int64_t i = 0; i < num; i++) slot[i] = -1;
  free(map->slot);
  map->slot      = slot;
  map->num_slots = num;
  for (int64_t i = 0; i < map->key.count; i++) slot[slot_of(map, (const int64_t *)map->key.item + i * map->width)] = i;
  return true;
}

int64_t ra_map_add(ra_map *map, const int64_t *key)
{
  int64_t at;

  if (2 * (map->key.count + 1) > map->num_slots && !map_grow(map)) return -1;
  at = slot_of(map, key);
  if (map->slot[at] < 0) {
    if (!ra_push(&map->key, key, (size_t)map->width * sizeof *key)) return -1;
    map->slot[at] = map->key.count - 1;
  }
  return map->slot[at];
}

int64_t ra_map_find(const ra_map *map, const int64_t *key) { return map->num_slots ? map->slot[slot_of(map, key)] : -1; }

void ra_map_drop(ra_map *map)
{
  ra_drop(&map->key);
  free(map->slot);
  map->slot      = NULL;
  map->num_slots = 0;
}

/* ---- shares ------------------------------------------------------------------------------------------------------- */

int64_t ra_share(int64_t n, int rank, int size)
{
  const int64_t rest = n % size;

  return n / size * rank + (rank < rest ? rank : rest);
}

int ra_owner(int64_t n, int64_t i, int size)
{
  const int64_t each = n / size, rest = n % size;

  return (int)(i < rest * (each + 1) ? i / (each + 1) : rest + (i - rest * (each + 1)) / each);
}
