/* common -- status and message, agreement of ranks, exchange of records.
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
  ra_line(message->text, sizeof message->text, format, args);
  va_end(args);
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
  const int worst = ra_agree(comm, (int)mine, message->text, sizeof message->text);

  if (worst == RCGNS_OK) message->text[0] = 0;
  return (rcgns_status)worst;
}

void rc_bcast(MPI_Comm comm, void *data, int64_t bytes)
{
  const int64_t chunk = 1 << 28;

  for (int64_t at = 0; at < bytes; at += chunk)
    MPI_Bcast((char *)data + at, (int)(bytes - at < chunk ? bytes - at : chunk), MPI_BYTE, 0, comm);
}

rcgns_status rc_exchange(MPI_Comm comm, rcgns_status mine, const void *send, const int64_t *send_count, size_t size,
                         void **received, int64_t *recv_count, rcgns_message *message)
{
  rslice_status status;

  RC_TRY(rc_agree(comm, mine, message));
  status = rslice_exchange(comm, RSLICE_OK, RSLICE_CHUNK, size, send_count, send, recv_count, received);
  return status == RSLICE_OK ? RCGNS_OK : rc_no_memory(message);
}
