#!/bin/sh
# ratio.sh -- the overlay's time per cell beside that of the float prototype overlay_floor.c, run in turn, medians of user CPU.
#
#   tests/bench/ratio.sh BUILD [PROTOTYPE.c] [RUNS]
#
# BUILD is the build folder; PROTOTYPE.c defaults to ../shared/bench/overlay_floor.c beside the project. One JSON line per kind of
# triangulation: microseconds per cell of mesh 1 (32^3 warped hexahedra in 64^3), their ratio, and the whole remap_build.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
build=${1:?usage: ratio.sh BUILD [PROTOTYPE.c] [RUNS]}
floor=${2:-$here/../../../shared/bench/overlay_floor.c}
runs=${3:-5}
if [ ! -f "$floor" ]; then
  echo "ratio.sh: no prototype at $floor: name it as the second argument" >&2
  exit 77
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
gcc -O3 -march=native -o "$work/floor" "$floor" -lm

# The middle one of the lines of standard input.
median() { sort -g | awk '{ x[NR] = $1 } END { print x[int((NR + 1) / 2)] }'; }

export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
for faces in diagonal centre; do
  for i in $(seq "$runs"); do
    "$work/floor" 32 64 0.5 $faces | sed -n 's/.*together //p' >>"$work/floor.$faces"
    "$build/tests/bench_overlay" warped 32 $faces | sed 's/.*"us_overlay":\([0-9.]*\).*/\1/' >>"$work/ours.$faces"
    mpirun -n 1 "$build/tests/bench_build" 32 64 0.5 $faces | sed 's/.*"us_build_per_source_cell":\([0-9.]*\).*/\1/' >>"$work/build.$faces"
  done
  a=$(median <"$work/floor.$faces") b=$(median <"$work/ours.$faces") c=$(median <"$work/build.$faces")
  awk -v f=$faces -v a="$a" -v b="$b" -v c="$c" -v n="$runs" 'BEGIN {
    printf "{\"bench\":\"ratio\",\"faces\":\"%s\",\"runs\":%d,\"us_prototype\":%s,\"us_overlay\":%s,\"ratio\":%.2f,\"us_whole_build\":%s}\n", f, n, a, b, b / a, c }'
done
