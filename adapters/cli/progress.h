/* progress.h -- a line every few seconds that says what the job is at, whatever it is doing. */
#ifndef REMAP_CLI_PROGRESS_H
#define REMAP_CLI_PROGRESS_H

#include <stdio.h>

/** Opaque. NULL is fine everywhere and prints nothing. */
typedef struct cli_progress cli_progress;

/** Start to print to out, in the name of a command (borrowed), every `seconds`, from a thread of its own that calls nothing
 *  but the C library. NULL if there is no memory or no thread: the job goes on in silence. The caller owns it:
 *  cli_progress_stop. Not collective. */
cli_progress *cli_progress_start(const char *name, FILE *out, double seconds);

/** What the job is at: the phase's name (copied) and the share of it that is done, 0..1, negative where nobody knows. */
void cli_progress_set(cli_progress *progress, const char *phase, double done);

/** No more lines after this. */
void cli_progress_stop(cli_progress *progress);

#endif
