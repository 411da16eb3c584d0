/* fail -- the reason of a failure, written once where it is found. O(length of the text). */
#include "base.h"

#include <stdarg.h>
#include <stdio.h>

remap_status rm_fail(remap_status status, rm_reason *reason, int side, rm_gid global_cell, const char *format, ...)
{
  va_list list;

  if (!reason || reason->text[0]) return status;
  reason->side        = side;
  reason->global_cell = global_cell;
  va_start(list, format);
  vsnprintf(reason->text, sizeof reason->text, format, list);
  va_end(list);
  return status;
}
