#!/bin/sh
# scaling.sh -- the tables of libremap/doc/scaling.md: what bench_scaling counts on 1 to 16 ranks, and fits of it. Nothing here
# is a time, so the machine may be busy and the ranks more than its cores.
#
#   tests/bench/scaling.sh BUILD [N ...]
#
# BUILD is the build folder. N defaults to 12 16 20 24; the largest makes the table, all make the fits. Takes about two minutes.
set -eu
build=${1:?usage: scaling.sh BUILD [N ...]}
shift
[ $# -gt 0 ] || set -- 12 16 20 24
for largest; do :; done
work=$(mktemp)
trap 'rm -f "$work"' EXIT
[ "$(id -u)" != 0 ] || export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1

for n; do
  for ranks in 1 2 4 8 16; do
    for dealt in "" RANDOM; do
      mpirun --oversubscribe --mca mpi_yield_when_idle 1 -n "$ranks" "$build/tests/bench_scaling" even "$n" $dealt
    done
  done
done >"$work"

# dealt ranks cells N, then build: messages bytes partners collectives collective_bytes peak kept, then field: messages bytes
# partners
fields() { tr -d '{}"' <"$work" | tr ':,' '  ' |
  awk '{ print $6, $8, $10, $15, $17, $19, $21, $23, $25, $27, $30, $32, $34 }'; }

echo "One rank at most, N = $largest:"
echo
echo "| cells dealt in | ranks | cells per rank | messages | partners | bytes sent | per cell | collectives |" \
  "bytes into them | peak bytes | per cell | kept | field: messages | bytes |"
echo "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
cells=$(fields | awk '{ if ($3 > most) most = $3 } END { print most }')
fields | awk -v cells="$cells" '$3 == cells { n = $3 / $2
  printf "| %s | %d | %d | %d | %d | %d | %.0f | %d | %d | %d | %.0f | %d | %d | %d |\n",
    $1, $2, n, $4, $6, $5, $5 / n, $7, $8, $9, $9 / n, $10, $11, $12 }'
echo
echo "Fits to y = a n + b n^(2/3), n cells of both meshes per rank, all N, 2 to 16 ranks P, relative least squares; for bytes"
echo "that are sent, n is taken (1 - 1/P) times, which is what has to leave its rank:"
echo
echo "| cells dealt in | y | a | b | worst error |"
echo "|---|---|---|---|---|"
fit() { fields | awk -v dealt="$1" -v column="$2" -v leaves="$3" -v name="$4" '
  $1 == dealt && $2 > 1 { k++; n[k] = $3 / $2 * (leaves ? 1 - 1 / $2 : 1); y[k] = $column }
  END {
    for (i = 1; i <= k; i++) {
      u = n[i] / y[i]; v = n[i] ^ (2 / 3) / y[i]; uu += u * u; uv += u * v; vv += v * v; us += u; vs += v
    }
    d = uu * vv - uv * uv; a = (us * vv - vs * uv) / d; b = (vs * uu - us * uv) / d
    if (a < 0) { a = 0; b = vs / vv } else if (b < 0) { b = 0; a = us / uu }
    for (i = 1; i <= k; i++) { e = (a * n[i] + b * n[i] ^ (2 / 3)) / y[i] - 1; if (e < 0) e = -e; if (e > worst) worst = e }
    printf "| %s | %s | %.0f | %.0f | %.0f %% |\n", dealt, name, a, b, 100 * worst }'; }
for dealt in slabs random; do
  fit $dealt 5 1 "bytes sent by remap_build"
  fit $dealt 9 0 "peak bytes of remap_build"
  fit $dealt 10 0 "bytes kept"
  fit $dealt 12 1 "bytes sent by remap_field"
done
