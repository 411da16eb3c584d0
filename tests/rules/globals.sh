#!/bin/sh
# globals.sh LIBREMAP.A -- no variable of the library outlives a call: no symbol in .data, .bss or common, static locals
# included. Constants (.rodata, .data.rel.ro) are fine.
set -eu
found=$(nm --format=sysv --defined-only "$1" | awk -F'|' '
  /:$/ { object = $0; next }
  NF >= 7 { name = $1; class = $3; type = $4; section = $7
            gsub(/ /, "", name); gsub(/ /, "", class); gsub(/ /, "", type); gsub(/ /, "", section)
            if (type == "SECTION" || type == "FILE" || section ~ /^\.data\.rel\.ro/) next
            if (name ~ /^(__asan|__ubsan|__odr_asan|\.L|_GLOBAL_)/ || name ~ /\.ubsan/) next # the sanitizers
            if (class ~ /^[BbDdCSsGg]$/) print object " " name " in " section }')
if [ -n "$found" ]; then
  echo "variables that outlive a call:"
  echo "$found"
  exit 1
fi
echo "no variable outlives a call"
