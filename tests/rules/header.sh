#!/bin/sh
# header.sh CC INCLUDE... -- remap.h compiles alone, without a warning, as C99, C11, C17, C++11 and C++17, and so does a
# C++ file that calls it.
set -eu
cc=$1
shift
includes=
library=$1
shift
for dir in "$@"; do includes="$includes -isystem $dir"; done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cat >"$work/alone.c" <<'C'
#include <remap/remap.h>
#include <remap/remap.h>
extern int use(const remap_mesh *mesh, remap_context *ctx);
int use(const remap_mesh *mesh, remap_context *ctx)
{
  return (int)remap_set_mesh(ctx, REMAP_TARGET, mesh) + (remap_status_text(REMAP_OK) != NULL);
}
C
for language in c:c99 c:c11 c:c17 c++:c++11 c++:c++17; do
  # shellcheck disable=SC2086 # a list of options
  "$cc" -x "${language%%:*}" -std="${language#*:}" -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror \
    -fsyntax-only -I"$library" $includes "$work/alone.c"
  echo "compiles as ${language#*:}"
done
