/* file -- a file that appears under its name when it is complete. */
#include "slices.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Where a file of that name is to be. 0, or an error number. */
static int find_place(const char *path, char place[PATH_MAX])
{
  struct stat there;
  bool        exists = !lstat(path, &there);

  if (strlen(path) >= PATH_MAX) return ENAMETOOLONG;
  strcpy(place, path);
  if (exists && S_ISLNK(there.st_mode) && (!realpath(path, place) || stat(place, &there))) return errno;
  return exists && S_ISREG(there.st_mode) && !(there.st_mode & (S_IWUSR | S_IWGRP | S_IWOTH)) ? EACCES : 0;
}

int rslice_file_check(const char *path)
{
  char place[PATH_MAX];

  return find_place(path, place);
}

int rslice_file_begin(const char *path, char *part, size_t size)
{
  char      place[PATH_MAX];
  const int error = find_place(path, place);
  int       file  = -1;

  part[0] = 0;
  if (error) return error;
  for (int i = 0; i < 100 && file < 0; i++) {
    if ((size_t)snprintf(part, size, "%s.part-%ld-%d", place, (long)getpid(), i) >= size) {
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
  char      place[PATH_MAX];
  const int error = find_place(path, place), file = error ? -1 : open(part, O_RDWR | O_CLOEXEC);
  bool      ok = file >= 0 && !fsync(file);

  if (error) return error;
  if (file >= 0) ok = !close(file) && ok;
  return ok && !rename(part, place) ? 0 : errno;
}

int rslice_file_claim(const char *part, int64_t bytes)
{
  const int file  = open(part, O_RDWR | O_CLOEXEC);
  int       error = file < 0 ? errno : posix_fallocate(file, 0, (off_t)bytes);

  if (file >= 0) close(file);
  return error == EOPNOTSUPP || error == EINVAL ? 0 : error; /* a file system that cannot: writing will tell */
}
