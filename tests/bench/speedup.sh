#!/bin/sh
# speedup.sh -- how much faster two ranks overlay than one: wall clock of the stages behind the partition, and of all of
# remap_build, on general and on graded meshes, N^3 to (N+1)^3. Runs with one rank and with two take turns, RUNS times; medians.
# Prints a table in Markdown. Wants two idle cores; the last rows, from counts and processor time of the ranks alone, do not.
#
#   tests/bench/speedup.sh BUILD [N] [RUNS] [diagonal|centre]
#
# BUILD is the build folder. N defaults to 64, RUNS to 5. With 64 on an idle machine it takes some minutes and 3 GB.
set -eu
build=${1:?usage: speedup.sh BUILD [N] [RUNS] [diagonal|centre]}
n=${2:-64}
runs=${3:-5}
faces=${4:-diagonal}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
[ "$(id -u)" != 0 ] || export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1

for i in $(seq "$runs"); do
  for case in general graded; do
    for ranks in 1 2; do
      mpirun --oversubscribe -n "$ranks" "$build/tests/bench_build" "$case" "$n" "$faces" >>"$work/$case-$ranks"
    done
  done
done
for case in even graded; do
  for ranks in 1 2; do
    mpirun --oversubscribe -n "$ranks" "$build/tests/bench_balance" "$n" "$faces" "$case" >"$work/balance-$case-$ranks"
  done
done

median() { sort -g | awk '{ x[NR] = $1 } END { print x[int((NR + 1) / 2)] }'; }
of() { sed "s/.*\"$2\":\([0-9.]*\).*/\1/" "$work/$1" | median; }
row() { awk -v name="$1" -v a="$2" -v b="$3" 'BEGIN { printf "| %s | %.3f | %.3f | %.2f |\n", name, a, b, a / b }'; }

echo "| | 1 rank | 2 ranks | ratio |"
echo "|---|---|---|---|"
for case in general graded; do
  row "$case, overlay, s" "$(of $case-1 seconds_overlay)" "$(of $case-2 seconds_overlay)"
  row "$case, remap_build, s" "$(of $case-1 seconds_build)" "$(of $case-2 seconds_build)"
done
for case in even graded; do # of both ranks together; the slower one has a half times the ratio of the largest to the mean
  row "bench_balance $case, user CPU of the slower rank, s" "$(of balance-$case-1 cpu_overlay)" \
    "$(awk -v a="$(of balance-$case-2 cpu_overlay)" -v r="$(of balance-$case-2 cpu)" 'BEGIN { print a * r / 2 }')"
  row "bench_balance $case, crossings and triangles of the slower rank" \
    "$(awk -v a="$(of balance-$case-1 all_crossings)" -v b="$(of balance-$case-1 all_triangles)" 'BEGIN { print a + b }')" \
    "$(awk -v a="$(of balance-$case-2 all_crossings)" -v b="$(of balance-$case-2 all_triangles)" \
      -v r="$(of balance-$case-2 work)" 'BEGIN { print (a + b) * r / 2 }')"
done
