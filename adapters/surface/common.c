/* common -- status and message; a surface given back. */
#include "surface_private.h"

#include <stdarg.h>
#include <stdlib.h>

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
  ra_line(message->text, sizeof message->text, format, args);
  va_end(args);
  return status;
}

rsurf_status rs_no_memory(rsurf_message *message)
{
  return rs_fail(message, RSURF_MEMORY, "out of memory while reading or writing a surface: use a larger machine");
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
