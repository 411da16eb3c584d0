/* file -- a file that appears under its name when it is complete. */
#include "slices.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <unistd.h>

int rslice_file_begin(const char *path, char *part, size_t size)
{
  int file = -1;

  for (int i = 0; i < 100 && file < 0; i++) {
    if ((size_t)snprintf(part, size, "%s.part-%ld-%d", path, (long)getpid(), i) >= size) {
      errno = ENAMETOOLONG;
      break;
    }
    file = open(part, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file < 0 && errno != EEXIST) break;
  }
  if (file < 0) {
    part[0] = 0;
    return errno;
  }
  close(file);
  return 0;
}

int rslice_file_finish(const char *part, const char *path)
{
  const int file = open(part, O_RDWR | O_CLOEXEC);
  bool      ok   = file >= 0 && !fsync(file);

  if (file >= 0) ok = !close(file) && ok;
  return ok && !rename(part, path) ? 0 : errno;
}

int rslice_file_claim(const char *part, int64_t bytes)
{
  const int file  = open(part, O_RDWR | O_CLOEXEC);
  int       error = file < 0 ? errno : posix_fallocate(file, 0, (off_t)bytes);

  if (file >= 0) close(file);
  return error == EOPNOTSUPP || error == EINVAL ? 0 : error; /* a file system that cannot: writing will tell */
}
