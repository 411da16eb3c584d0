/* progress -- a thread that sleeps, wakes every few seconds, prints one line and sleeps again. The job only leaves its phase
 * behind a lock, so phases that tell nothing about their own progress, such as reading a file, are reported as well. */
#include "progress.h"

#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <time.h>

struct cli_progress {
  const char     *name;
  FILE           *out;
  double          seconds; /* between lines */
  struct timespec begin;
  pthread_t       thread;
  pthread_cond_t  wake; /* waits on CLOCK_MONOTONIC */
  pthread_mutex_t lock; /* guards what follows */
  bool            ends;
  char            phase[48];
  double          done;
};

static struct timespec later(struct timespec from, double seconds)
{
  const double whole = (double)(time_t)seconds;

  from.tv_sec += (time_t)whole;
  from.tv_nsec += (long)((seconds - whole) * 1e9);
  if (from.tv_nsec >= 1000000000L) {
    from.tv_sec++;
    from.tv_nsec -= 1000000000L;
  }
  return from;
}

static void print_line(const cli_progress *progress)
{
  struct timespec now;
  double          elapsed;

  clock_gettime(CLOCK_MONOTONIC, &now);
  elapsed = (double)(now.tv_sec - progress->begin.tv_sec) + 1e-9 * (double)(now.tv_nsec - progress->begin.tv_nsec);
  if (progress->done < 0)
    fprintf(progress->out, "%s: %.0f s: %s\n", progress->name, elapsed, progress->phase);
  else
    fprintf(progress->out, "%s: %.0f s: %s, %.0f %%\n", progress->name, elapsed, progress->phase, 100 * progress->done);
  fflush(progress->out);
}

static void *watch(void *data)
{
  cli_progress   *progress = data;
  struct timespec next     = later(progress->begin, progress->seconds);

  pthread_mutex_lock(&progress->lock);
  while (!progress->ends) {
    /* 0: woken to end, or for no reason at all */
    if (pthread_cond_timedwait(&progress->wake, &progress->lock, &next) == 0) continue;
    print_line(progress);
    next = later(next, progress->seconds);
  }
  pthread_mutex_unlock(&progress->lock);
  return NULL;
}

cli_progress *cli_progress_start(const char *name, FILE *out, double seconds)
{
  cli_progress      *progress = calloc(1, sizeof *progress);
  pthread_condattr_t clock;

  if (!progress) return NULL;
  progress->name    = name;
  progress->out     = out;
  progress->seconds = seconds;
  progress->done    = -1;
  snprintf(progress->phase, sizeof progress->phase, "start");
  clock_gettime(CLOCK_MONOTONIC, &progress->begin);
  pthread_condattr_init(&clock);
  pthread_condattr_setclock(&clock, CLOCK_MONOTONIC);
  pthread_cond_init(&progress->wake, &clock);
  pthread_condattr_destroy(&clock);
  pthread_mutex_init(&progress->lock, NULL);
  if (pthread_create(&progress->thread, NULL, watch, progress)) {
    pthread_mutex_destroy(&progress->lock);
    pthread_cond_destroy(&progress->wake);
    free(progress);
    return NULL;
  }
  return progress;
}

void cli_progress_set(cli_progress *progress, const char *phase, double done)
{
  if (!progress) return;
  pthread_mutex_lock(&progress->lock);
  snprintf(progress->phase, sizeof progress->phase, "%s", phase);
  progress->done = done;
  pthread_mutex_unlock(&progress->lock);
}

void cli_progress_stop(cli_progress *progress)
{
  if (!progress) return;
  pthread_mutex_lock(&progress->lock);
  progress->ends = true;
  pthread_cond_signal(&progress->wake);
  pthread_mutex_unlock(&progress->lock);
  pthread_join(progress->thread, NULL);
  pthread_mutex_destroy(&progress->lock);
  pthread_cond_destroy(&progress->wake);
  free(progress);
}
