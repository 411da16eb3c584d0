#!/bin/sh
# layering.sh PROJECT -- who may see whom:
#   a room includes itself and rooms upstream of it, by the table below;
#   libremap/src includes neither adapters nor anything outside of libremap but C headers, mpi.h and remap/remap.h;
#   only comm calls MPI functions, geom includes only base and calls neither MPI nor the allocator;
#   adapters and examples include <remap/remap.h> alone of the library; only the programs cli and boolean include other
#   adapters, but for base, which is for all, and slices, which is for all writers;
#   the tests of a room may see the rooms.
set -eu
cd "$1"
failures=$(mktemp)
trap 'rm -f "$failures"' EXIT

# room: the other rooms it may include
upstream() {
  tools="base geom comm"
  case $1 in
    base) echo "" ;;
    geom | comm) echo "base" ;;
    mesh) echo "$tools" ;;
    zone) echo "$tools mesh" ;;
    part) echo "$tools mesh zone" ;;
    overlay) echo "$tools mesh zone part" ;;
    moments) echo "$tools mesh zone part overlay" ;;
    mapping) echo "$tools mesh zone part overlay moments" ;;
    cells) echo "$tools mesh zone part overlay" ;;
    super) echo "$tools mesh zone part overlay cells" ;;
    field) echo "$tools mesh zone part overlay moments mapping" ;;
    api) echo "$tools mesh zone part overlay moments mapping cells super field" ;;
    *) echo "unknown" ;;
  esac
}

# Lines FILE<tab>HEADER of every include in the given files.
includes() {
  [ $# -gt 0 ] || return 0
  awk 'match($0, /^[ \t]*#[ \t]*include[ \t]*[<"][^>"]+[>"]/) {
         header = $0; sub(/^[^<"]*[<"]/, "", header); sub(/[>"].*/, "", header); print FILENAME "\t" header }' "$@"
}

# C without comments and string literals, as FILE:LINE: TEXT.
plain() {
  [ $# -gt 0 ] || return 0
  awk 'FNR == 1 { inside = 0 }
       { text = $0
         gsub(/\\./, "", text); gsub(/"[^"]*"/, "\"\"", text)
         out = ""
         while (length(text)) {
           if (inside) { i = index(text, "*/"); if (!i) break; text = substr(text, i + 2); inside = 0; continue }
           i = index(text, "/*"); j = index(text, "//")
           if (j && (!i || j < i)) { out = out substr(text, 1, j - 1); break }
           if (!i) { out = out text; break }
           out = out substr(text, 1, i - 1); text = substr(text, i + 2); inside = 1
         }
         print FILENAME ":" FNR ": " out }' "$@"
}

# Rooms.
for dir in libremap/src/*/; do
  room=$(basename "$dir")
  allowed=" $room $(upstream "$room") "
  case $allowed in *" unknown "*) echo "$dir is a room that the rules do not know" >>"$failures" ;; esac
  files=$(find "$dir" -name '*.[ch]' | sort)
  # shellcheck disable=SC2086 # a list of files
  includes $files | while IFS="$(printf '\t')" read -r file header; do
    case $header in
      */*) other=${header%%/*} ;;
      *) [ -f "$dir$header" ] && other=$room || other=system ;;
    esac
    case $other in
      system) continue ;; # which of them, is the next check
      remap | sys) continue ;;
      *) case $allowed in *" $other "*) ;; *) echo "$file includes $header: $room may see only:$allowed" ;; esac ;;
    esac
  done >>"$failures"
  # shellcheck disable=SC2086
  includes $files |
    awk -F'\t' '$2 ~ /hdf5|cgns|jansson|gmp/ { print $1 " includes " $2 ": the core needs MPI alone" }' >>"$failures"
  if [ "$room" != comm ]; then
    # shellcheck disable=SC2086
    plain $files | grep -E '\bMPI_[A-Z][A-Za-z0-9_]*[ ]*\(' | sed 's/$/   <- only comm calls MPI/' >>"$failures" || true
  fi
  if [ "$room" = geom ]; then
    # shellcheck disable=SC2086
    plain $files | grep -E '\b(malloc|calloc|realloc|free|aligned_alloc|rm_arena_[a-z]+|rm_grow)[ ]*\(' |
      sed 's/$/   <- geom does not allocate/' >>"$failures" || true
  fi
  # shellcheck disable=SC2086
  plain $files | grep -E '\b(printf|puts|putchar|perror|exit|_exit|abort|MPI_Abort)[ ]*\(|\b(stdout|stderr)\b' |
    sed 's/$/   <- the library neither prints nor exits/' >>"$failures" || true
done

# Adapters and examples.
for dir in adapters/*/ examples/; do
  [ -d "$dir" ] || continue
  name=$(basename "$dir")
  files=$(find "$dir" -name '*.[ch]' | sort)
  # shellcheck disable=SC2086
  includes $files | while IFS="$(printf '\t')" read -r file header; do
    case $header in
      remap/remap.h) ;;
      remap/*) echo "$file includes $header: of the library only remap/remap.h" ;;
      ../* | */src/*) echo "$file includes $header: reaches into another folder" ;;
      */*)
        first=${header%%/*}
        if [ -d "libremap/src/$first" ] && [ ! -f "$dir$header" ]; then
          echo "$file includes $header: of the library only remap/remap.h"
        elif [ -d "adapters/$first" ] && [ "$first" != "$name" ] && [ "$name" != cli ] && [ "$name" != boolean ]; then
          echo "$file includes $header: only programs see other adapters"
        fi
        ;;
    esac
  done >>"$failures"
done

if [ -s "$failures" ]; then
  cat "$failures"
  exit 1
fi
echo "all includes go upstream"
