/* Progress lines: they come by themselves, say the phase, and end. */
#include "progress.h"
#include "rt.h"

#include <time.h>

static void sleep_for(double seconds)
{
  nanosleep(&(struct timespec){(time_t)seconds, (long)((seconds - (double)(time_t)seconds) * 1e9)}, NULL);
}

/* Everything written to the file, which is closed. */
static const char *text_of(FILE *file, char *text, size_t size)
{
  size_t length;

  rewind(file);
  length       = fread(text, 1, size - 1, file);
  text[length] = '\0';
  fclose(file);
  return text;
}

static void a_long_phase_is_told_again_and_again(void)
{
  FILE         *out = tmpfile();
  char          text[4000];
  cli_progress *progress;
  int           lines = 0;

  if (!rt_all(RT_CHECK(out != NULL))) return;
  progress = cli_progress_start("remap", out, .05);
  RT_CHECK(progress != NULL);
  cli_progress_set(progress, "waiting", .25);
  sleep_for(.4);
  cli_progress_stop(progress);
  text_of(out, text, sizeof text);
  for (const char *c = text; *c; c++) lines += *c == '\n';
  RT_CHECK(lines >= 2 && lines <= 8);
  RT_CHECK(strstr(text, "s: waiting, 25 %\n") != NULL);
}

static void a_share_nobody_knows_is_not_told(void)
{
  FILE         *out = tmpfile();
  char          text[4000];
  cli_progress *progress;

  if (!rt_all(RT_CHECK(out != NULL))) return;
  progress = cli_progress_start("remap", out, .05);
  cli_progress_set(progress, "reading", -1);
  sleep_for(.2);
  cli_progress_stop(progress);
  RT_CHECK(strstr(text_of(out, text, sizeof text), "s: reading\n") != NULL);
}

static void a_short_job_is_silent_and_ends_at_once(void)
{
  FILE        *out = tmpfile();
  char         text[4000];
  const double begin = MPI_Wtime();

  if (!rt_all(RT_CHECK(out != NULL))) return;
  cli_progress_stop(cli_progress_start("remap", out, 60));
  RT_CHECK(MPI_Wtime() - begin < 30);
  RT_EQ(strlen(text_of(out, text, sizeof text)), 0);
}

static void nobody_listening_is_fine(void)
{
  cli_progress_set(NULL, "anything", 1);
  cli_progress_stop(NULL);
}

RT_MAIN(RT_CASE(a_long_phase_is_told_again_and_again), RT_CASE(a_share_nobody_knows_is_not_told),
        RT_CASE(a_short_job_is_silent_and_ends_at_once), RT_CASE(nobody_listening_is_fine))
