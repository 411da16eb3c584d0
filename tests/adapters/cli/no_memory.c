/* no_memory -- preloaded into a program: requests of 256 KiB and more through aligned_alloc fail. The library's arenas draw
 * their blocks that way, nobody else on the way does. */
#include <errno.h>
#include <stddef.h>
#include <stdlib.h>

void *aligned_alloc(size_t alignment, size_t size)
{
  void *memory = NULL;
  int   error;

  if (size >= 1 << 18) {
    errno = ENOMEM;
    return NULL;
  }
  error = posix_memalign(&memory, alignment, size);
  if (error) errno = error;
  return error ? NULL : memory;
}
