/* common -- status and message, growing arrays, a map of keys. Linear in what they are given. */
#include "surface_private.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *rsurf_status_text(rsurf_status status)
{
  switch (status) {
#define X(name, number, text) \
  case RSURF_##name: return text;
    RSURF_STATUS_LIST(X)
#undef X
  }
  return "unknown status";
}

rsurf_status rs_fail(rsurf_message *message, rsurf_status status, const char *format, ...)
{
  va_list args;

  va_start(args, format);
  vsnprintf(message->text, sizeof message->text, format, args);
  va_end(args);
  for (char *c = message->text; *c; c++) /* names in files may hold anything: one line stays one line */
    if ((unsigned char)*c < ' ' || *c == 127) *c = '?';
  return status;
}

rsurf_status rs_no_memory(rsurf_message *message)
{
  return rs_fail(message, RSURF_MEMORY, "out of memory while reading or writing a surface: use a larger machine");
}

void *rs_alloc(int64_t count, size_t size) { return count < 0 ? NULL : calloc((size_t)count + 1, size); }

bool rs_push(rs_array *array, const void *item, size_t size)
{
  if (array->count == array->capacity) {
    const int64_t capacity = array->capacity ? 2 * array->capacity : 64;
    void         *more     = (uint64_t)capacity > PTRDIFF_MAX / size ? NULL : realloc(array->item, (size_t)capacity * size);

    if (!more) return false;
    array->item     = more;
    array->capacity = capacity;
  }
  memcpy((char *)array->item + (size_t)array->count++ * size, item, size);
  return true;
}

static uint64_t mix(uint64_t h, uint64_t value)
{
  h = (h ^ value) * UINT64_C(0x9e3779b97f4a7c15);
  return h ^ (h >> 32);
}

/* Where the key stands, or the free place where it would. */
static int64_t slot_of(const rs_map *map, const uint64_t *key)
{
  const size_t width = (size_t)map->width;
  uint64_t     h     = UINT64_C(0x2545f4914f6cdd1d);

  for (size_t i = 0; i < width; i++) h = mix(h, key[i]);
  for (;; h++) {
    const int64_t at = (int64_t)(h & (uint64_t)(map->num_slots - 1)), i = map->slot[at];

    if (i < 0 || !memcmp((const uint64_t *)map->key.item + (size_t)i * width, key, width * sizeof *key)) return at;
  }
}

/* Twice the slots, all keys put in again. */
static bool map_grow(rs_map *map)
{
  const int64_t num  = map->num_slots ? 2 * map->num_slots : 256;
  int64_t      *slot = rs_alloc(num, sizeof *slot);

  if (!slot) return false;
  for (int64_t i = 0; i < num; i++) slot[i] = -1;
  free(map->slot);
  map->slot      = slot;
  map->num_slots = num;
  for (int64_t i = 0; i < map->key.count; i++) slot[slot_of(map, (const uint64_t *)map->key.item + i * map->width)] = i;
  return true;
}

int64_t rs_map_add(rs_map *map, const uint64_t *key)
{
  int64_t at;

  if (2 * (map->key.count + 1) > map->num_slots && !map_grow(map)) return -1;
  at = slot_of(map, key);
  if (map->slot[at] < 0) {
    if (!rs_push(&map->key, key, (size_t)map->width * sizeof *key)) return -1;
    map->slot[at] = map->key.count - 1;
  }
  return map->slot[at];
}

int64_t rs_map_find(const rs_map *map, const uint64_t *key) { return map->num_slots ? map->slot[slot_of(map, key)] : -1; }

void rs_map_drop(rs_map *map)
{
  free(map->key.item);
  free(map->slot);
  *map = (rs_map){.width = map->width};
}

void rsurf_drop(rsurf_surface *surface)
{
  for (int32_t g = 0; g < surface->num_groups; g++) free(surface->group_name[g]);
  free(surface->group_name);
  free(surface->node_xyz);
  free(surface->face_offset);
  free(surface->face_node);
  free(surface->face_group);
  free(surface->face_body);
  free(surface->face_none);
  *surface = (rsurf_surface){.num_nodes = 0};
}
