#!/bin/sh
# openfoam.sh -- the overlay beside that of OpenFOAM's mapFieldsPar -mapMethod cellVolumeWeight, on the same meshes, one process
# each.
#
#   tests/bench/openfoam.sh BUILD [CASE] [N] [RUNS]
#
# BUILD is the build folder; CASE (bench.h) defaults to general, N to 24, RUNS to 3. OpenFOAM's overlay is what mapFieldsPar
# takes more with that method than with mapNearest, which reads and writes the same and only looks for nearest cells; it makes
# volumes only. Ours is crossings, segments, V and M of triangulated meshes (centre), and the same with the triangulation.
# Medians of processor time; one JSON line. 77 if mapFieldsPar is not installed (Debian package openfoam).
set -eu
build=${1:?usage: openfoam.sh BUILD [CASE] [N] [RUNS]}
case=${2:-general}
n=${3:-24}
runs=${4:-3}
if ! command -v mapFieldsPar >/dev/null; then
  echo "openfoam.sh: mapFieldsPar is missing: apt install openfoam" >&2
  exit 77
fi
: "${WM_PROJECT_DIR:=/usr/share/openfoam}" # where Debian has it; else OpenFOAM's own bashrc tells
export WM_PROJECT_DIR OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for side in source target; do mkdir -p "$work/$side/system" "$work/$side/constant/polyMesh" "$work/$side/0"; done
"$build/tests/bench_openfoam" "$case" "$n" "$work"

# The middle one of the lines of standard input.
median() { sort -g | awk '{ x[NR] = $1 } END { print x[int((NR + 1) / 2)] }'; }

# Processor seconds of mapFieldsPar with a method, one line per run.
map_with() {
  for i in $(seq "$runs"); do
    LC_ALL=C sh -c "mapFieldsPar '$work/source' -case '$work/target' -mapMethod $1 -sourceTime 0 >'$work/log' 2>&1
      echo \$? >'$work/status'; times" |
      awk 'END { split($1, u, "[ms]"); split($2, s, "[ms]"); print 60 * u[1] + u[2] + 60 * s[1] + s[2] }'
    if [ "$(cat "$work/status")" != 0 ]; then
      tail -n 20 "$work/log" >&2
      exit 1
    fi
  done
}

map_with cellVolumeWeight >"$work/whole"
map_with mapNearest >"$work/rest"
whole=$(median <"$work/whole")
rest=$(median <"$work/rest")
"$build/tests/bench_overlay" "$case" "$n" centre "$runs" >"$work/ours"
field() { sed "s/.*\"$1\":\[*\([0-9.,]*\).*/\1/" "$work/ours"; }
awk -v case="$case" -v n="$n" -v runs="$runs" -v whole="$whole" -v rest="$rest" -v cells="$(field cells)" \
  -v overlay="$(field us_overlay)" -v triangulation="$(field us_triangulation)" 'BEGIN {
  split(cells, c, ",")
  theirs = 1e6 * (whole - rest) / c[2]; ours = overlay * c[1] / c[2]; all = ours + triangulation * c[1] / c[2]
  printf "{\"bench\":\"openfoam\",\"case\":\"%s\",\"n\":%d,\"runs\":%d,\"cells\":[%d,%d],", case, n, runs, c[1], c[2]
  printf "\"seconds_mapFieldsPar\":%.2f,\"seconds_without_overlay\":%.2f,", whole, rest
  printf "\"us_openfoam_per_target_cell\":%.1f,\"us_ours\":%.1f,\"us_ours_with_triangulation\":%.1f,", theirs, ours, all
  printf "\"times_faster\":%.1f,\"times_faster_with_triangulation\":%.1f}\n", theirs / ours, theirs / all }'
