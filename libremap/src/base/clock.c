/* clock -- wall-clock seconds from the monotonic clock. */
#include "base.h"

#include <time.h>

double rm_seconds(void)
{
  struct timespec now;

  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}
