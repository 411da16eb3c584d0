#!/bin/sh
# consumer.sh CMAKE CC BUILD WORK -- what BUILD installs can be used by a project of its own: through find_package(remap),
# shared and static, and through pkg-config with a plain compiler; and it says the same version everywhere.
set -eu
cmake=$1
cc=$2
build=$3
work=$4
rm -rf "$work"
mkdir -p "$work/project"
"$cmake" --install "$build" --prefix "$work/prefix" >"$work/install.log"

cat >"$work/project/main.c" <<'C'
#include <remap/remap.h>
#include <stdio.h>
#include <string.h>
int main(int argc, char **argv)
{
  remap_context *ctx = NULL;
  remap_status   status;

  MPI_Init(&argc, &argv);
  status = remap_create(MPI_COMM_WORLD, NULL, &ctx);
  remap_destroy(&ctx);
  printf("%s %s\n", remap_version(), remap_status_text(status));
  MPI_Finalize();
  return argc < 2 || strcmp(argv[1], remap_version()) != 0 || status != REMAP_OK;
}
C
cat >"$work/project/CMakeLists.txt" <<'CMAKE'
cmake_minimum_required(VERSION 3.18)
project(consumer C)
find_package(remap 0.1 REQUIRED)
add_executable(shared main.c)
target_link_libraries(shared PRIVATE remap::remap)
add_executable(static main.c)
target_link_libraries(static PRIVATE remap::remap_static)
file(WRITE ${CMAKE_BINARY_DIR}/version "${remap_VERSION}")
CMAKE
"$cmake" -S "$work/project" -B "$work/build" -DCMAKE_C_COMPILER="$cc" -DCMAKE_PREFIX_PATH="$work/prefix" \
  -DCMAKE_C_FLAGS="${CFLAGS:-}" >"$work/configure.log"
"$cmake" --build "$work/build" >"$work/build.log"
version=$(cat "$work/build/version")
"$work/build/shared" "$version"
"$work/build/static" "$version"

pc=$(dirname "$(find "$work/prefix" -name remap.pc)")
PKG_CONFIG_PATH=$pc
export PKG_CONFIG_PATH
[ "$(pkg-config --modversion remap)" = "$version" ] || { echo "remap.pc says another version"; exit 1; }
# shellcheck disable=SC2046,SC2086 # lists of options
"$cc" ${CFLAGS:-} $(pkg-config --cflags remap) -o "$work/plain" "$work/project/main.c" $(pkg-config --libs remap)
LD_LIBRARY_PATH=$(pkg-config --variable=libdir remap) "$work/plain" "$version"
