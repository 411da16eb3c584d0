#!/bin/sh
# scaling.sh -- the tables of libremap/doc/scaling.md: what bench_scaling counts on 1 to 32 ranks, and fits of it; on up to 128
# ranks what every rank is told, and on up to 256 what bench_crowds counts. Nothing here is a time, so the machine may be busy
# and the ranks more than its cores.
#
#   tests/bench/scaling.sh BUILD [N ...]
#
# BUILD is the build folder. N defaults to 12 16 20 24 32; the largest makes the table, all of them and half as much again make
# the fits. Takes some ten minutes.
set -eu
build=${1:?usage: scaling.sh BUILD [N ...]}
shift
[ $# -gt 0 ] || set -- 12 16 20 24 32
for largest; do :; done
work=$(mktemp)
trap 'rm -f "$work"' EXIT
[ "$(id -u)" != 0 ] || export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1

# run RANKS PROGRAM ARGUMENTS
run() {
  ranks=$1 program=$2
  shift 2
  mpirun --oversubscribe --mca mpi_yield_when_idle 1 -n "$ranks" "$build/tests/$program" "$@"
}

# both N RANKS ...
both() {
  n=$1
  shift
  for ranks; do
    for dealt in "" RANDOM; do
      printf '%s ' "$n"
      run "$ranks" bench_scaling even "$n" $dealt
    done
  done
}

for size; do both "$size" 1 2 4 8 16 32; done >"$work"
both $((largest * 3 / 2)) 2 4 8 >>"$work" # ranks with many cells, for the fits

# dealt ranks cells, build: messages bytes partners collectives collective_bytes peak kept, field: messages bytes partners; N
fields() { tr -d '{}"' <"$work" | tr ':,' '  ' |
  awk '{ print $7, $9, $11, $16, $18, $20, $22, $24, $26, $28, $31, $33, $35, $1 }'; }

echo "One rank at most, N = $largest:"
echo
printf '| cells dealt in | ranks | cells per rank | messages | partners | bytes sent | per cell | collectives '
echo "| bytes out of them | peak bytes | per cell | kept | field: messages | bytes |"
echo "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
fields | awk -v largest="$largest" '$14 == largest { n = $3 / $2
  printf "| %s | %d | %d | %d | %d | %d | %.0f | %d | %d | %d | %.0f | %d | %d | %d |\n", $1, $2, n, $4, $6, $5, $5 / n, $7,
    $8, $9, $9 / n, $10, $11, $12 }'
echo
echo "Fits by relative least squares, all N, 2 to 32 ranks P, n cells of both meshes per rank:"
echo
echo "| cells dealt in | y | model | a | b | c | d | error: mean | worst |"
echo "|---|---|---|---|---|---|---|---|---|"
# The terms of a model, u[1] .. u[terms], for n cells per rank on P ranks, N^2 cells in a plane.
#   sent   n times the share of cells that leave their rank, and the surface within the mesh of n cells on P ranks
#   held   n, the same surface, 1
#   peak   these, and the cells of a block of 25,000 triangles, or fewer
#   asked  random dealing: n times the ranks that 18 partners dealt at random lie on, without its own; slabs: the planes beside
fit() { fields | awk -v dealt="$1" -v column="$2" -v model="$3" -v name="$4" -v formula="$5" '
  function share(P, k) {
    if (dealt == "random") return 1 - 1 / P
    for (k = 0; 2 ^ (k + 1) <= P; k++);
    return 1 - 2 ^ -(k - int((k + 2) / 3)) # Morton halves across the slabs
  }
  $1 == dealt && $2 > 1 {
    m++; P = $2; n = $3 / P; y[m] = $column; surface = n ^ (2 / 3) * (1 - P ^ (-1 / 3))
    if (model == "sent") { terms = 2; u[m, 1] = n * share(P); u[m, 2] = surface }
    if (model == "held" || model == "peak") { terms = 3; u[m, 1] = n; u[m, 2] = surface; u[m, 3] = 1 }
    if (model == "peak") { terms = 4; u[m, 4] = n < 25000 / 12 ? n : 25000 / 12 }
    if (model == "asked") {
      terms = 1
      u[m, 1] = dealt == "random" ? n * (P - 1) * (1 - (1 - 1 / P) ^ 18) : (P > 2 ? 2 : 1) * $14 ^ 2
    }
  }
  END {
    for (i = 1; i <= terms; i++)
      for (k = 1; k <= m; k++) {
        s[i, terms + 1] += u[k, i] / y[k]
        for (j = 1; j <= terms; j++) s[i, j] += u[k, i] * u[k, j] / y[k] ^ 2
      }
    for (i = 1; i <= terms; i++)
      for (j = 1; j <= terms; j++) {
        if (j == i) continue
        f = s[j, i] / s[i, i]
        for (k = 1; k <= terms + 1; k++) s[j, k] -= f * s[i, k]
      }
    for (k = 1; k <= m; k++) {
      e = -1
      for (i = 1; i <= terms; i++) e += s[i, terms + 1] / s[i, i] * u[k, i] / y[k]
      if (e < 0) e = -e
      mean += e / m
      if (e > worst) worst = e
    }
    printf "| %s | %s | %s |", dealt, name, formula
    for (i = 1; i <= 4; i++) if (i <= terms) printf " %.0f |", s[i, terms + 1] / s[i, i]; else printf " |"
    printf " %.0f %% | %.0f %% |\n", 100 * mean, 100 * worst
  }'; }
for dealt in slabs random; do
  fit $dealt 5 sent "bytes sent by remap_build" "a n L + b S"
  fit $dealt 9 peak "peak bytes of remap_build" "a n + b S + c + d B"
  fit $dealt 10 held "bytes kept" "a n + b S + c"
done
fit slabs 12 asked "bytes sent by remap_field" "a N^2, twice from 3 ranks on"
fit random 12 asked "bytes sent by remap_field" "a n (P - 1) (1 - (1 - 1/P)^18)"

echo
echo "Up to 128 ranks, slabs, N = 20:"
echo
echo "| ranks | messages | bytes sent | collectives | bytes out of them |"
echo "|---|---|---|---|---|"
for ranks in 8 16 32 64 128; do run "$ranks" bench_scaling even 20; done | tr -d '{}"' | tr ':,' '  ' |
  awk '{ printf "| %d | %d | %d | %d | %d |\n", $8, $15, $17, $21, $23 }'
echo
echo "bench_crowds, 512 boxes of each rank, along the curve or anywhere:"
echo
echo "| ranks | messages | bytes sent | crowds known | anywhere: bytes sent | crowds known | joined: bytes sent | crowds known |"
echo "|---|---|---|---|---|---|---|---|"
for ranks in 8 16 32 64 128 256; do
  { run "$ranks" bench_crowds 8; run "$ranks" bench_crowds 8 RANDOM; } | tr -d '{}"' | tr ':,' '  ' | tr '\n' ' ' |
    awk '{ printf "| %d | %d | %d | %d | %d | %d | %d | %d |\n", $6, $10, $12, $14, $33, $35, $38, $40 }'
done
