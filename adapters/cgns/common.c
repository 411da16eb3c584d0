/* common -- status and message, agreement of ranks, growing arrays, hashing, exchange of records.
 *
 * Everything here is linear in what it is given. An agreement is one reduction, plus one broadcast after a failure. */
#include "cgns_private.h"
#include "slices.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *rcgns_status_text(rcgns_status status)
{
  switch (status) {
#define X(name, number, text) \
  case RCGNS_##name: return text;
    RCGNS_STATUS_LIST(X)
#undef X
  }
  return "unknown status";
}

void rcgns_options_default(rcgns_options *options)
{
  *options = (rcgns_options){.scale = 1.0, .transform = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
}

void rcgns_choice_default(rcgns_choice *choice) { *choice = (rcgns_choice){.name = NULL}; }

rcgns_status rc_fail(rcgns_message *message, rcgns_status status, const char *format, ...)
{
  va_list args;

  va_start(args, format);
  vsnprintf(message->text, sizeof message->text, format, args);
  va_end(args);
  for (char *c = message->text; *c; c++) /* names in files may hold anything: one line stays one line */
    if ((unsigned char)*c < ' ' || *c == 127) *c = '?';
  return status;
}

rcgns_status rc_no_memory(rcgns_message *message)
{
  return rc_fail(message, RCGNS_MEMORY, "out of memory while reading or writing CGNS: use more ranks or nodes");
}

rcgns_status rc_name_file(const char *path, rcgns_status status, rcgns_message *message)
{
  const rcgns_message plain = *message;
  const size_t        n     = strlen(path);

  if (status != RCGNS_MEMORY || (!strncmp(plain.text, path, n) && plain.text[n] == ':')) return status;
  return rc_fail(message, status, "%s: %.900s", path, plain.text);
}

rcgns_status rc_agree(MPI_Comm comm, rcgns_status mine, rcgns_message *message)
{
  struct {
    int status, rank;
  } worst = {(int)mine, 0};

  MPI_Comm_rank(comm, &worst.rank);
  MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_2INT, MPI_MAXLOC, comm);
  if (worst.status == RCGNS_OK)
    message->text[0] = 0;
  else
    MPI_Bcast(message->text, (int)sizeof message->text, MPI_CHAR, worst.rank, comm);
  return (rcgns_status)worst.status;
}

void rc_bcast(MPI_Comm comm, void *data, int64_t bytes)
{
  const int64_t chunk = 1 << 28;

  for (int64_t at = 0; at < bytes; at += chunk)
    MPI_Bcast((char *)data + at, (int)(bytes - at < chunk ? bytes - at : chunk), MPI_BYTE, 0, comm);
}

/* ---- memory ------------------------------------------------------------------------------------------------------- */

void *rc_alloc(int64_t count, size_t size)
{
  if (count < 0 || (uint64_t)count > PTRDIFF_MAX / size) return NULL;
  return malloc(count ? (size_t)count * size : 1);
}

bool rc_reserve(rc_array *array, int64_t more, size_t size)
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

bool rc_push(rc_array *array, int64_t value)
{
  if (!rc_reserve(array, 1, sizeof value)) return false;
  ((int64_t *)array->item)[array->count++] = value;
  return true;
}

void rc_drop(rc_array *array)
{
  free(array->item);
  *array = (rc_array){.item = NULL};
}

static uint64_t mix(uint64_t h, int64_t value)
{
  h ^= (uint64_t)value;
  h *= UINT64_C(0x9e3779b97f4a7c15);
  return h ^ (h >> 29);
}

static int64_t slot_of(const rc_map *map, const int64_t *key)
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
static bool map_grow(rc_map *map)
{
  const int64_t num  = map->num_slots ? 2 * map->num_slots : 64;
  int64_t      *slot = rc_alloc(num, sizeof *slot);

  if (!slot) return false;
  for (int64_t i = 0; i < num; i++) slot[i] = -1;
  free(map->slot);
  map->slot      = slot;
  map->num_slots = num;
  for (int64_t i = 0; i < map->key.count; i++) slot[slot_of(map, (const int64_t *)map->key.item + i * map->width)] = i;
  return true;
}

int64_t rc_map_add(rc_map *map, const int64_t *key)
{
  const size_t bytes = (size_t)map->width * sizeof *key;
  int64_t      at;

  if (2 * (map->key.count + 1) > map->num_slots && !map_grow(map)) return -1;
  at = slot_of(map, key);
  if (map->slot[at] < 0) {
    if (!rc_reserve(&map->key, 1, bytes)) return -1;
    memcpy((int64_t *)map->key.item + map->key.count * map->width, key, bytes);
    map->slot[at] = map->key.count++;
  }
  return map->slot[at];
}

int64_t rc_map_find(const rc_map *map, const int64_t *key) { return map->num_slots ? map->slot[slot_of(map, key)] : -1; }

void rc_map_drop(rc_map *map)
{
  rc_drop(&map->key);
  free(map->slot);
  map->slot      = NULL;
  map->num_slots = 0;
}

/* ---- distribution ------------------------------------------------------------------------------------------------- */

int64_t rc_share(int64_t n, int rank, int size)
{
  const int64_t rest = n % size;

  return n / size * rank + (rank < rest ? rank : rest);
}

int rc_owner(int64_t n, int64_t i, int size)
{
  const int64_t each = n / size, rest = n % size;

  return (int)(i < rest * (each + 1) ? i / (each + 1) : rest + (i - rest * (each + 1)) / each);
}

rcgns_status rc_exchange(MPI_Comm comm, rcgns_status mine, const void *send, const int64_t *send_count, size_t size,
                         void **received, int64_t *recv_count, rcgns_message *message)
{
  rslice_status status;

  RC_TRY(rc_agree(comm, mine, message));
  status = rslice_exchange(comm, RSLICE_OK, RSLICE_CHUNK, size, send_count, send, recv_count, received);
  return status == RSLICE_OK ? RCGNS_OK : rc_no_memory(message);
}
