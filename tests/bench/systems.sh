#!/bin/sh
# systems.sh BENCH_SYSTEMS >libremap/doc/systems.md -- the page about systems, with a measured table.
set -eu
cat <<'EOT'
# Systems of fields

Fields that are carried one by one know nothing of each other: beside a jump of density, momentum over density is any velocity,
and total energy less kinetic energy any pressure. A system (`remap_field_desc.system`) is carried as what it is.

**Reconstruction.** Density, amounts per mass (velocity, mass fractions, others) and internal energy get polynomials, with the
limiter that was asked for; these are multiplied, and amounts per volume travel as polynomials of degree 2, integrated with the
second moments of the pairs. At order 2 an amount per mass is linear about the cell's centre of mass; at order 3 the product is
cut after degree 2. Uniform velocity, pressure and amounts per mass stay so, whatever density does. Mass fractions share one
limiter and keep their sum. Where the limiter finds a cell smooth, velocity and other amounts per mass may exceed the bounds of
the neighbours, but not those of the whole mesh.

**States that can be.** Positive density, positive internal energy and amounts per mass within bounds are a convex cone of
amounts. A receiving cell that is not in it refuses; every cell that gives to it is scaled, once, by the greatest factor that
brings each of its pairs into the cone; that repeats until nobody refuses. A factor for all slopes of a cell keeps content and
what is uniform. Without slopes all is in the cone, so it ends, mostly after a few rounds, of two exchanges and a reduction
each.

**The table.** A ball of some density in density 1, velocity tanh((x - 1/2) / 0.08) along x, uniform pressure, from hexahedra to
tetrahedra. How far velocities lie below and above those of the source (negative below, positive above: beyond), least and
greatest pressure and density, giving cells whose density the limiter changed, giving cells that were scaled, the worst
conservation error of mass, momentum and energy, time. Pressure rises where cells of different velocity are mixed: energy is
conserved, and what the mean velocity no longer has is heat. Made by `tests/bench/systems.sh`.

EOT
"$1"
