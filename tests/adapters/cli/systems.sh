#!/bin/sh
# What moves with the mass: weights by names, gas models and --gamma, values that cannot be, vectors that turn. See cli.sh for
# the arguments.
# shellcheck source-path=SCRIPTDIR source=cli.sh
. "$(dirname "$0")/cli.sh"
cd "$work" || exit 1

# The place of a field in the report.
place() {
  i=0
  while [ "$(value fields "$i" name 2>/dev/null || echo "$1")" != "$1" ]; do i=$((i + 1)); done
  echo "$i"
}
# weight FIELD WORD: how it is weighted.
weight() {
  [ "$(value fields "$(place "$1")" weight)" = "$2" ] || complain "$1 goes by $(value fields "$(place "$1")" weight), not by $2"
}
# uniform FIELD VALUE: all that arrives is this.
uniform() {
  near "$(value fields "$(place "$1")" target_min)" "$2" 1e-13
  near "$(value fields "$(place "$1")" target_max)" "$2" 1e-13
}
# within FIELD LOW HIGH
within() {
  f=$(place "$1")
  awk -v a="$(value fields "$f" target_min)" -v b="$(value fields "$f" target_max)" -v low="$2" -v high="$3" \
    'BEGIN { exit !(low <= a && b <= high) }' || complain "$1 is not within $2..$3"
}
conserved() {
  for f in $(seq 0 $(($(value fields) - 1))); do
    awk -v e="$(value fields "$f" conservation_error)" 'BEGIN { exit !(e <= 1e-14) }' ||
      complain "$(value fields "$f" name) is conserved within $(value fields "$f" conservation_error) only"
  done
}

for n in 1 2 3; do works $n gas.cgns mesh.cgns -o out$n.cgns --report report.json; done
cmp out1.cgns out2.cgns && cmp out1.cgns out3.cgns || complain "bytes depend on the number of ranks"
for field in Density VelocityX VelocityY VelocityZ Temperature MassFractionA MassFractionB; do weight $field mass; done
weight Pressure "gas model"
grep -q "gamma 1.5" report.json || complain "gamma is not told"
uniform VelocityX 1
uniform VelocityY 2
uniform VelocityZ 3
uniform Pressure 1
within MassFractionA 0 1
within MassFractionB 0 1
within Density 1e-3 1.91
conserved
hold "$wrong" "primitive variables move by the gas model, and what is uniform stays so"
works 1 gas.cgns mesh.cgns -o out.cgns --report report.json --order 3
conserved
uniform Pressure 1
hold "$wrong" "at order 3 too"
works 1 gas.cgns gas.cgns -o same.cgns
[ "$(cgnsdiff -d gas.cgns same.cgns 2>&1)" = "" ] || complain "$(cgnsdiff -d gas.cgns same.cgns 2>&1)"
hold "$wrong" "a file remapped onto itself keeps every bit"
works 1 gas.cgns mesh.cgns -o out.cgns --report report.json -f 'Density,Vel*,Temperature'
weight Temperature "gas model"
hold "$wrong" "temperature stands for the energy where pressure is not taken"

works 1 gas_untold.cgns mesh.cgns -o out.cgns --report report.json
weight VelocityX mass
weight Pressure volume
weight Temperature mass
[ "$(value fields "$(place Pressure)" nature)" = volume-mean ] || complain "Pressure is no volume mean"
uniform VelocityX 1
hold "$wrong" "without a gas model velocity goes by mass and pressure by volume"
works 1 gas_untold.cgns mesh.cgns -o out.cgns --report report.json --gamma 1.4
weight Pressure "gas model"
grep -q "gamma 1.4" report.json || complain "gamma is not told"
hold "$wrong" "--gamma is a gas model"
works 1 gas.cgns mesh.cgns -o out.cgns --report report.json --gamma 1.4
grep -q "gamma 1.4" report.json || complain "gamma is not told"
hold "$wrong" "and comes before the file's"
works 1 gas_without_density.cgns mesh.cgns -o out.cgns --report report.json
for field in VelocityX Pressure Temperature MassFractionA; do weight $field volume; done
grep -q "VelocityX: a quantity per mass, but there is no Density" report.json || complain "nothing is said"
hold "$wrong" "without a density all goes by volume, and the report says so"
works 1 gas_by_state.cgns mesh.cgns -o out.cgns --report report.json
weight VelocityX mass
weight Pressure "gas model"
[ "$(value fields)" = 7 ] || complain "$(value fields) fields"
conserved
uniform VelocityX 1
hold "$wrong" "pressure and temperature make up for a density that is not there"
works 1 gas.cgns mesh.cgns -o out.cgns --report report.json --nature Density=volume-mean
for field in Density VelocityX Pressure; do weight $field volume; done
hold "$wrong" "--nature takes fields out"

echo "0 -1 0 1  1 0 0 0  0 0 1 0" >turn.txt # x' = 1 - y, y' = x
works 2 gas.cgns mesh.cgns -o out.cgns --report report.json --transform turn.txt
uniform VelocityX -2
uniform VelocityY 1
uniform VelocityZ 3
uniform Pressure 1
conserved
hold "$wrong" "velocities turn with the mesh, in whatever order they come"
works 1 gas_without_density.cgns mesh.cgns -o out.cgns --report report.json --transform turn.txt
uniform VelocityX -2
uniform VelocityY 1
hold "$wrong" "without a density too"
echo "0 -.7 0 0.7  0.7 0 0 0  0 0 .7 0" >shrink.txt
works 1 gas.cgns mesh.cgns -o out.cgns --report report.json --transform shrink.txt --on-partial normalise
uniform VelocityX -2
hold "$wrong" "a factor does not matter"
works 1 gas.cgns mesh.cgns -o out.cgns --report report.json --transform turn.txt --keep-vectors
uniform VelocityX 1
hold "$wrong" "--keep-vectors keeps them"
echo "1 .5 0 0  0 1 0 0  0 0 1 0" >shear.txt
works 1 gas.cgns mesh.cgns -o out.cgns --report report.json --transform shear.txt --on-uncovered nearest
uniform VelocityX 1
grep -q "no rotation" report.json || complain "nothing is said"
hold "$wrong" "what is no rotation turns nothing"
works 1 gas_lone.cgns mesh.cgns -o out.cgns --report report.json --transform turn.txt
uniform VelocityX 1
grep -q "VelocityX: it is not turned" report.json || complain "nothing is said"
hold "$wrong" "nor do components that are not all there"

refused 5 "gas_vacuum.cgns.*Zone.*cell 5 .*Density" "a density of 0 is named" gas_vacuum.cgns mesh.cgns -o out/result.cgns
works 1 gas_vacuum.cgns mesh.cgns -o out.cgns --nature Density=volume-mean
hold "$wrong" "and can be averaged all the same"
works 2 nan_field.cgns mesh.cgns -o out.cgns --allow-nan --report report.json
[ "$(value fields "$(place MomentumX)" conservation_error)" = null ] || complain "NaN is conserved"
awk -v e="$(value fields "$(place Density)" conservation_error)" 'BEGIN { exit !(e <= 1e-14) }' || complain "Density is not"
hold "$wrong" "--allow-nan lets NaN pass"
finish
