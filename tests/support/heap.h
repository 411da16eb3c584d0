/* heap -- what a program and the static library ask of the heap, between them and it: bytes held, the most since the test set
 * it, requests, and one that fails. What shared libraries ask is not counted, but what they took from us and free is. One
 * thread. For one file of a program, which remap_heap() of CMake links. */
#ifndef HEAP_H
#define HEAP_H

#include <malloc.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

static struct {
  int64_t held, most; /* bytes; most may be set back to held */
  int64_t requests;   /* so far */
  int64_t left;       /* requests until one fails; below 0: none does */
} heap = {0, 0, 0, -1};

/* The linker's names. */
void *__real_malloc(size_t size);
void *__real_calloc(size_t n, size_t size);
void *__real_realloc(void *old, size_t size);
void *__real_aligned_alloc(size_t alignment, size_t size);
void  __real_free(void *memory);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t n, size_t size);
void *__wrap_realloc(void *old, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
void  __wrap_free(void *memory);

static inline int64_t heap_size_(void *memory) { return memory ? (int64_t)malloc_usable_size(memory) : 0; }

static inline bool heap_refuses_(void)
{
  heap.requests++;
  return heap.left >= 0 && heap.left-- == 0;
}

static inline void *heap_taken_(void *memory)
{
  heap.held += heap_size_(memory);
  if (heap.held > heap.most) heap.most = heap.held;
  return memory;
}

void *__wrap_malloc(size_t size) { return heap_refuses_() ? NULL : heap_taken_(__real_malloc(size)); }
void *__wrap_calloc(size_t n, size_t size) { return heap_refuses_() ? NULL : heap_taken_(__real_calloc(n, size)); }
void *__wrap_aligned_alloc(size_t alignment, size_t size)
{
  return heap_refuses_() ? NULL : heap_taken_(__real_aligned_alloc(alignment, size));
}
void *__wrap_realloc(void *old, size_t size)
{
  const int64_t before = heap_size_(old);
  void         *memory = heap_refuses_() ? NULL : __real_realloc(old, size);

  if (memory) heap.held -= before;
  return heap_taken_(memory);
}
void __wrap_free(void *memory)
{
  heap.held -= heap_size_(memory);
  __real_free(memory);
}
#endif
