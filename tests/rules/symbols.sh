#!/bin/sh
# symbols.sh LIBREMAP.SO -- every function that remap.h declares is exported, nothing else is, and nothing of the library's
# own is left undefined.
set -eu
library=$1
header=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

nm -D --defined-only "$library" | awk '{ print $3 }' | sort >"$work/exported"
awk '/^REMAP_API/ { match($0, /remap_[a-z_0-9]+\(/); print substr($0, RSTART, RLENGTH - 1) }' "$header" | sort >"$work/declared"
[ -s "$work/declared" ] || { echo "$header declares nothing"; exit 1; }
if ! diff "$work/declared" "$work/exported" >"$work/difference"; then
  echo "declared in remap.h (<) and exported by $library (>) differ:"
  cat "$work/difference"
  exit 1
fi
if nm -D --undefined-only "$library" | grep -E ' (rm|remap)_'; then
  echo "the symbols above are used but defined nowhere"
  exit 1
fi
echo "$(wc -l <"$work/exported") symbols, all in remap.h"
