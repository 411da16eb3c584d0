/* arena -- memory that is given back as a whole, and arrays that grow.
 *
 * Small requests are cut from the front of the newest shared block, one after the other; a request above LARGE gets a block
 * of its own. All blocks form one list, newest first:
 *
 *   arena -> [head | large request] -> [head | cut | cut | free ...] -> [head | cut | cut | lost]
 *
 * An allocation is O(1) but for the system's; at most LARGE bytes of a shared block are lost. Dropping is O(blocks). */
#include "base.h"

#include <stdlib.h>
#include <string.h>

enum { ALIGN = 64, SHARED = 1 << 18, LARGE = 1 << 15 };

typedef struct block {
  struct block *next;
} block;

/* Memory that came from elsewhere. */
typedef struct adopted {
  struct adopted *next;
  void           *data;
  size_t          bytes;
} adopted;

struct rm_arena {
  block   *first;     /* all blocks, newest first; NULL if none */
  adopted *adopted;   /* in one of the blocks each              */
  char   *free;       /* next free byte of the newest shared block */
  size_t  free_bytes; /* multiple of ALIGN */
  size_t  bytes;      /* taken from the system */
  int64_t fail_in;    /* allocations until one fails on purpose, 0: never */
};

rm_arena *rm_arena_new(void)
{
  rm_arena *arena = calloc(1, sizeof *arena);

  if (arena) arena->bytes = sizeof *arena;
  return arena;
}

void rm_arena_drop(rm_arena *arena)
{
  block *next;

  if (!arena) return;
  for (adopted *a = arena->adopted; a; a = a->next) free(a->data);
  for (block *b = arena->first; b; b = next) {
    next = b->next;
    free(b);
  }
  free(arena);
}

/* A block with room for `bytes`, a multiple of ALIGN, behind its head; NULL if memory is out. */
static block *new_block(rm_arena *arena, size_t bytes)
{
  block *b = aligned_alloc(ALIGN, bytes + ALIGN);

  if (b) arena->bytes += bytes + ALIGN;
  return b;
}

static void *alloc_large(rm_arena *arena, size_t bytes)
{
  block *b = new_block(arena, bytes);

  if (!b) return NULL;
  b->next      = arena->first;
  arena->first = b;
  return (char *)b + ALIGN;
}

static void *alloc_small(rm_arena *arena, size_t bytes)
{
  void *cut;

  if (bytes > arena->free_bytes) {
    block *b = new_block(arena, SHARED);

    if (!b) return NULL;
    b->next           = arena->first;
    arena->first      = b;
    arena->free       = (char *)b + ALIGN;
    arena->free_bytes = SHARED;
  }
  cut = arena->free;
  arena->free += bytes;
  arena->free_bytes -= bytes;
  return cut;
}

void *rm_arena_alloc(rm_arena *arena, int64_t count, size_t size)
{
  size_t bytes;

  RM_ASSERT(count >= 0 && size > 0);
  if (arena->fail_in && --arena->fail_in == 0) return NULL;
  if (count < 0 || (uint64_t)count > (uint64_t)(INT64_MAX - 2 * ALIGN) / size) return NULL;
  bytes = ((size_t)count * size + ALIGN - 1) / ALIGN * ALIGN;
  if (bytes == 0) bytes = ALIGN;
  return bytes > LARGE ? alloc_large(arena, bytes) : alloc_small(arena, bytes);
}

void *rm_arena_zero(rm_arena *arena, int64_t count, size_t size)
{
  void *memory = rm_arena_alloc(arena, count, size);

  if (memory) memset(memory, 0, (size_t)count * size);
  return memory;
}

remap_status rm_arena_adopt(rm_arena *arena, void *data, size_t bytes)
{
  adopted *a = rm_arena_alloc(arena, 1, sizeof *a);

  if (!a) return REMAP_NO_MEMORY;
  *a = (adopted){arena->adopted, data, bytes};
  arena->adopted = a;
  arena->bytes += bytes;
  return REMAP_OK;
}

void *rm_arena_alloc_apart(rm_arena *arena, int64_t count, size_t size)
{
  void *data;

  RM_ASSERT(count >= 0 && size > 0);
  if (count < 0 || (uint64_t)count > (uint64_t)INT64_MAX / size) return NULL;
  data = malloc(count ? (size_t)count * size : 1);
  if (data && rm_arena_adopt(arena, data, (size_t)count * size) == REMAP_OK) return data;
  free(data);
  return NULL;
}

void *rm_arena_release(rm_arena *arena, const void *data)
{
  adopted **link = &arena->adopted, *a;

  while (*link && (*link)->data != data) link = &(*link)->next;
  a = *link;
  RM_ASSERT(a);
  *link = a->next; /* the record stays in its block */
  arena->bytes -= a->bytes;
  return a->data;
}

size_t rm_arena_bytes(const rm_arena *arena) { return arena->bytes; }

void rm_arena_fail_at(rm_arena *arena, int64_t n) { arena->fail_in = n; }

remap_status rm_reserve(void *data, int64_t *capacity, int64_t need, size_t size)
{
  void *old, *moved;

  if (need <= *capacity) return REMAP_OK;
  RM_REQUIRE(rm_mul_sat(need, (int64_t)size) < INT64_MAX, REMAP_NO_MEMORY);
  memcpy(&old, data, sizeof old); /* data points to a pointer of some type */
  moved = realloc(old, (size_t)need * size);
  RM_REQUIRE(moved, REMAP_NO_MEMORY);
  memcpy(data, &moved, sizeof moved);
  *capacity = need;
  return REMAP_OK;
}

remap_status rm_grow(void *data, int64_t *capacity, int64_t need, size_t size)
{
  const int64_t half = rm_add_sat(*capacity, *capacity / 2), wish = half < 16 ? 16 : half;

  return need <= *capacity ? REMAP_OK : rm_reserve(data, capacity, need > wish ? need : wish, size);
}

int64_t rm_add_sat(int64_t a, int64_t b)
{
  RM_ASSERT(a >= 0 && b >= 0);
  return a > INT64_MAX - b ? INT64_MAX : a + b;
}

int64_t rm_mul_sat(int64_t a, int64_t b)
{
  RM_ASSERT(a >= 0 && b >= 0);
  return b && a > INT64_MAX / b ? INT64_MAX : a * b;
}
