#!/bin/sh
# ratio.sh -- the overlay's speed as ratios that machines share: beside the float prototype overlay_floor.c, case beside case,
# small beside large. Programs run in turn, RUNS times; medians of processor time. Prints a table in Markdown.
#
#   tests/bench/ratio.sh BUILD [PROTOTYPE.c] [RUNS]
#
# BUILD is the build folder; PROTOTYPE.c defaults to ../shared/bench/overlay_floor.c beside the project, and rows that need it
# are left out without it. RUNS defaults to 5. Takes some minutes and 4 GB.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
build=${1:?usage: ratio.sh BUILD [PROTOTYPE.c] [RUNS]}
floor=${2:-$here/../../../shared/bench/overlay_floor.c}
runs=${3:-5}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
[ ! -f "$floor" ] || gcc -O3 -march=native -o "$work/floor" "$floor" -lm

for i in $(seq "$runs"); do
  for faces in diagonal centre; do
    [ ! -x "$work/floor" ] || "$work/floor" 32 64 0.5 $faces | sed -n 's/.*together //p' >>"$work/floor-$faces"
    "$build/tests/bench_overlay" warped 32 $faces >>"$work/warped-32-$faces"
  done
  for run in general-16 general-24 identical-24 finer-16 nested-16 boxes-32 tetrahedra-16 dual-16 general-64; do
    "$build/tests/bench_overlay" "${run%-*}" "${run#*-}" diagonal >>"$work/$run-diagonal"
  done
done

# The middle one of the numbers of standard input. Of the runs of a case, that of the time per cell, and per pair. A row of the
# table: what, unit, times, bar, stretch.
median() { sort -g | awk '{ x[NR] = $1 } END { print x[int((NR + 1) / 2)] }'; }
cell() { sed 's/.*"us_overlay":\([0-9.]*\).*/\1/' "$work/$1" | median; }
pair() { sed 's/.*"us_per_pair":\([0-9.]*\).*/\1/' "$work/$1" | median; }
row() {
  awk -v name="$1" -v unit="$2" -v a="$3" -v b="$4" -v bar="$5" -v stretch="$6" 'BEGIN {
    printf "| %s | %s | %.3g | %.3g | %.2f | %s | %s |\n", name, unit, a, b, a / b, bar, stretch }'
}

echo "| case | unit | it | against | ratio | bar | stretch |"
echo "|---|---|---|---|---|---|---|"
general=$(cell warped-32-diagonal)
per_pair=$(pair warped-32-diagonal)
if [ -x "$work/floor" ]; then
  row "warped hexahedra, diagonal, against the prototype" us/cell "$general" "$(median <"$work/floor-diagonal")" 1.5 0.7
  row "the same, centre" us/cell "$(cell warped-32-centre)" "$(median <"$work/floor-centre")" 1.0 0.5
fi
row "planar boxes, against warped diagonal" us/cell "$(cell boxes-32-diagonal)" "$general" 0.6 0.35
row "identical meshes, against general of that size" us/cell "$(cell identical-24-diagonal)" "$(cell general-24-diagonal)" 3 1.5
row "nested meshes, against general of those sizes" us/cell "$(cell nested-16-diagonal)" "$(cell finer-16-diagonal)" 3 1.5
row "tetrahedra, against warped diagonal" us/pair "$(pair tetrahedra-16-diagonal)" "$per_pair" 1.0 0.8
row "polyhedra (dual), against warped diagonal" us/pair "$(pair dual-16-diagonal)" "$per_pair" - -
row "64^3, against 16^3" us/cell "$(cell general-64-diagonal)" "$(cell general-16-diagonal)" 1.35 1.15
