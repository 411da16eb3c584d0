#!/bin/sh
# quickstart.sh demo|test -- from a bare Debian 12 to a running remap; quick when run again.
#   demo   install what is missing, build, make two warped meshes with a known field, remap between them on two ranks
#   test   install what is missing, build, run every test
# Options for CMake go into REMAP_CMAKE_OPTIONS, for CTest into REMAP_CTEST_OPTIONS, another build folder into REMAP_BUILD
# (default: build).
set -eu
cd "$(dirname "$0")/.."
build=${REMAP_BUILD:-build}
cores=$(nproc)

packages="gcc g++ make cmake pkg-config libc6-dev
  libopenmpi-dev openmpi-bin libhdf5-openmpi-dev libcgns-dev libjansson-dev libgmp-dev cgns-convert"

install_packages() {
  missing=
  for package in $packages; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing="$missing $package"
  done
  [ -n "$missing" ] || return 0
  as_root=
  if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null || { echo "quickstart: needs root or sudo to install:$missing" >&2; exit 1; }
    as_root=sudo
  fi
  echo "Installing:$missing"
  $as_root apt-get update -q
  # shellcheck disable=SC2086 # the packages are words
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $missing
}

build_all() {
  # shellcheck disable=SC2086 # the options are words
  cmake -S . -B "$build" ${REMAP_CMAKE_OPTIONS:-}
  cmake --build "$build" -j "$cores"
}

# mpirun on two ranks: also as root, on a single core, and in a container that forbids one process to read another's memory.
run_on_two() {
  if [ "$(id -u)" = 0 ]; then
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  fi
  export OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_btl_vader_single_copy_mechanism=none
  mpirun -n 2 "$@"
}

demo() {
  dir=$build/demo
  remap=$build/adapters/cli/remap
  mkdir -p "$dir"
  "$build/examples/make_demo" "$dir"
  echo "\$ mpirun -n 2 $remap $dir/source.cgns $dir/target.cgns -o $dir/out.cgns --report $dir/report.json"
  run_on_two "$remap" "$dir/source.cgns" "$dir/target.cgns" -o "$dir/out.cgns" --report "$dir/report.json"
  echo
  echo "$dir/report.json:"
  cat "$dir/report.json"
}

case ${1:-} in
  demo)
    install_packages
    build_all
    demo
    ;;
  test)
    install_packages
    build_all
    cd "$build"
    # shellcheck disable=SC2086 # the options are words
    exec ctest --output-on-failure -j "$cores" ${REMAP_CTEST_OPTIONS:-}
    ;;
  *)
    echo "usage: ./cmake/quickstart.sh demo|test" >&2
    exit 2
    ;;
esac
