#!/bin/sh
# limiters.sh BENCH_CONVERGENCE >libremap/doc/limiters.md -- the page about limiters, with measured tables.
set -eu
cat <<'EOF'
# Limiters

A reconstruction that knows only means overshoots at jumps; what prevents it must not blunt smooth fields. `none` leaves all as
it is. `barth-jespersen` reduces the slope of a giving cell until no vertex of it exceeds the means of its vertex neighbours.
`caas` leaves the reconstruction alone, clips the receiving means to the same bounds and spreads what that takes over all cells;
it needs a sum over all ranks. `auto`, the default, is `barth-jespersen` in cells that are not smooth.

**What a smooth cell is.** Between two neighbours a smooth field rises by the mean of their slopes times their distance. The
largest error of that around a cell, over the largest range of values around one of its neighbours, is its roughness: it falls
with the size of cells where the field is smooth, is small at extrema even where slopes on tetrahedra err by their own size, and
is 1/4 to 1/2 within two layers of a jump of any height. A cell is smooth if no cell within three layers is rougher than 0.2;
fewer would miss a film of one and a half cells at a wall, which looks linear from there. Smooth cells may
exceed the bounds by as much as those lie apart, but not change sign where their neighbours do not. Slopes and roughness travel
among neighbours; there is no sum over all ranks.

**Why walls matter.** A cell at a wall has no neighbour beyond it, so any slope towards the wall exceeds the bounds and
`barth-jespersen` flattens it. That, and not extrema, is what costs it its order: the errors are of first order in a layer of
cells, of order 2 in L1 and 1.5 in L2 at best. Real jumps stay bounded in every row of `sphere`.

At order 3 the bounds are checked on the polar form of the polynomial over pairs of vertices, which encloses it; a polynomial
that may exceed them gives way to the slope of order 2, limited.

Meshes of N^3 onto (N + 1)^3, warped differently, means over cells compared with means; norms and orders of convergence between
the two sizes (the columns L1, L2, Linf are those of the finer one), how far the new values lie below and above the old ones'
range (negative below, positive above: beyond it), giving cells (`caas`: receiving cells) that were limited, giving cells
without a polynomial of order 3. Sources of the figures: `tests/bench/bench_convergence.c`; this page is made by
`tests/bench/limiters.sh`. The mean error of 100 steps on a moving mesh is bounded by `tests/api/test_cycle.c`.
EOF
for kind in hexahedra tetrahedra dual mixed; do
  n=16
  [ "$kind" != mixed ] || n=8
  printf '\n## %s\n\n' "$kind"
  "$1" "$kind" "$n" | sed '1s/$/\n|---|---|---|---|---|---|---|---|---|/'
done
