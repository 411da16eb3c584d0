#!/bin/sh
# missing.sh CMAKE SOURCE BUILD WORK -- where one package is missing, the configure step stops and names it.
set -eu
cmake=$1
source=$2
build=$3
work=$4
rm -rf "$work"
mkdir -p "$work"

# What BUILD found, as an initial cache; everything else is looked for where nothing is.
awk -F= '/^(MPI|MPIEXEC|remap_dep)_[A-Za-z0-9_]*:[A-Z]+=/ {
  name = $1; sub(/:.*/, "", name); value = substr($0, length($1) + 2)
  printf "set(%s \"%s\" CACHE STRING \"\")\n", name, value }' "$build/CMakeCache.txt" >"$work/found.cmake"

# without VARIABLES PACKAGE OPTION: configure without the packages whose variables match, expect the message.
without() {
  grep -vE "$1" "$work/found.cmake" >"$work/init.cmake"
  rm -rf "$work/build"
  if "$cmake" -C "$work/init.cmake" -S "$source" -B "$work/build" -DCMAKE_FIND_ROOT_PATH=/nonexistent \
    -DCMAKE_FIND_ROOT_PATH_MODE_LIBRARY=ONLY \
    -DCMAKE_FIND_ROOT_PATH_MODE_INCLUDE=ONLY "$3" >"$work/log" 2>&1; then
    echo "configures without $2"
    exit 1
  fi
  grep -q "apt install $2" "$work/log" || { echo "without $2:"; cat "$work/log"; exit 1; }
  echo "without $2: says so"
}
without '^set\(MPI' 'libopenmpi-dev openmpi-bin' -DCMAKE_DISABLE_FIND_PACKAGE_MPI=ON
without 'gmp' libgmp-dev -DREMAP_CGNS=OFF
if grep -q remap_dep__hdf5 "$work/found.cmake"; then
  without 'hdf5' libhdf5-openmpi-dev -DREMAP_CGNS=ON
  without 'cgns' libcgns-dev -DREMAP_CGNS=ON
  without 'jansson' libjansson-dev -DREMAP_CGNS=ON
fi
