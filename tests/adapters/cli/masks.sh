#!/bin/sh
# Masks: which cells give and which want, by the codes of Iblank, cellN and others; and what becomes of the rest. See cli.sh for
# the arguments.
# shellcheck source-path=SCRIPTDIR source=cli.sh
. "$(dirname "$0")/cli.sh"
cd "$work" || exit 1

# cover SIDE COVERED PARTIAL UNCOVERED MASKED: cells.
cover() {
  have="$(value coverage "$1" covered cells) $(value coverage "$1" partial cells) $(value coverage "$1" uncovered cells)"
  have="$have $(value coverage "$1" masked cells)"
  [ "$have" = "$2 $3 $4 $5" ] || complain "$1 has $have cells covered, in part, not, masked; want $2 $3 $4 $5"
}
# within LOW HIGH KEY...: the number there is between the two.
within() {
  low=$1
  high=$2
  shift 2
  awk -v x="$(value "$@")" -v low="$low" -v high="$high" 'BEGIN { exit !(low <= x && x <= high) }' ||
    complain "$* is $(value "$@"), not within $low..$high"
}
density="-f Density"

# Computed is x < 1/2, interpolated up to 3/4, then holes with absurd values; targets are 3 cells wide.
for mask in Iblank cellN Masks/Iblank Masks/cellN ChimeraCellType=1 Iblank=1 Masks/cellN=1; do
  [ "$mask" = cellN ] && continue # FlowSolution has a cellN of its own, which comes first
  works 1 masked.cgns mesh.cgns -o out.cgns --report report.json $density --source-mask $mask
  cover source 32 0 0 32
  cover target 9 9 9 0
  within 0.999999 1.000001 fields 0 target_max
  near "$(value coverage target partial volume)" 0.33333333333333333 1e-14
  near "$(value coverage target least_partial 0 coverage)" 0.5 1e-14
  [ "$(value coverage source mask)" = "$mask" ] || complain "the report does not name the mask"
  hold "$wrong" "--source-mask $mask takes what is computed"
done
works 1 masked.cgns mesh.cgns -o out.cgns --report report.json $density --source-mask cellN
cover source 32 0 0 32
cover target 0 27 0 0
hold "$wrong" "the solution's own field comes first"
for mask in Iblank=1+-1 ChimeraCellType=-1+1 Masks/cellN=1+2; do
  works 1 masked.cgns mesh.cgns -o out.cgns --report report.json $density --source-mask $mask
  cover source 48 0 0 16
  cover target 18 9 0 0
  hold "$wrong" "--source-mask $mask takes just these codes"
done
for n in 1 2 3; do works $n masked.cgns mesh.cgns -o masked$n.cgns --report report$n.json --source-mask Iblank; done
cmp masked1.cgns masked2.cgns && cmp masked1.cgns masked3.cgns || complain "the bytes depend on the number of ranks"
hold "$wrong" "1, 2 and 3 ranks write the same"

works 1 good.cgns masked.cgns -o out.cgns --report report.json $density --target-mask Iblank --output-solution New
cover target 48 0 0 16
within 0 1.2 fields 0 target_max
works 1 out.cgns out.cgns -o again.cgns --report report.json --solution New
within 0.8 1.2 fields 0 source_min
within 0.8 1.2 fields 0 source_max
hold "$wrong" "--target-mask: what is interpolated wants, holes get a state that is somewhere else"
works 1 good.cgns masked.cgns -o out.cgns $density --target-mask Iblank --output-solution New --on-uncovered fill=-5
works 1 out.cgns out.cgns -o again.cgns --report report.json --solution New
within -5 -5 fields 0 source_min
hold "$wrong" "or the value to fill with"
works 1 good.cgns masked.cgns -o out.cgns $density --target-mask Iblank
works 1 out.cgns out.cgns -o again.cgns --report report.json $density
within 1e30 1e30 fields 0 source_max
hold "$wrong" "old values of holes stay"
works 1 masked.cgns masked.cgns -o out.cgns --source-mask Masks/cellN --target-mask Iblank --report report.json
cover target 32 0 16 16
[ "$(value fields)" = 3 ] || complain "$(value fields) fields"
grep -q "field cellN is a mask and is left out" report.json || complain "nothing is said about cellN"
hold "$wrong" "masks themselves are not transferred"
works 1 masked.cgns mesh.cgns -o out.cgns --source-mask cellN --report report.json -f cellN
within 1 1 fields 0 target_min
hold "$wrong" "unless they are named"

# The solver's volumes: 1/64 each but for cell 4, which is a quarter larger; Density there is a hole's.
works 2 wide.cgns masked.cgns -o out.cgns --report report.json --target-volume Volume --output-solution New
near "$(value target solver_volume)" 1.00390625 1e-14
near "$(value target max_volume_difference)" 0.25 1e-13
within 0 1e-14 fields 0 conservation_error
grep -q "differs by 2.5e-01 at most, at Base/Zone: cell 4" stdout || complain "people are not told"
works 1 out.cgns mesh.cgns -o again.cgns --report report.json --solution New --source-volume Volume $density
near "$(value fields 0 source_integral)" "$(value fields 0 target_integral)" 1e-14
hold "$wrong" "--target-volume and --source-volume: what solvers integrate is conserved"
works 1 masked.cgns mesh.cgns -o out.cgns --report report.json $density --source-mask Iblank --source-volume Volume --scale .5
near "$(value source solver_volume)" 0.12548828125 1e-14
hold "$wrong" "they are scaled with SOURCE"

works 1 good.cgns good.cgns -o out.cgns --report report.json --target-volume FlowSolution/Density
grep -q "good.cgns: field FlowSolution/Density differs from the volume of a cell by 69.4 times" report.json ||
  complain "$(grep -A3 notes report.json)"
hold "$wrong" "a field that cannot be volumes is doubted"

# Zones that overlap by half, the doubled cells of the second one being holes.
works 2 overset.cgns wide.cgns -o out.cgns --report report.json $density --source-mask Iblank --on-uncovered fill=1 \
  --on-partial normalise
near "$(value coverage source covered volume)" 1.5 1e-14
within 0.999999 1.000001 fields 0 target_max
within 0 1e-14 fields 0 conservation_error
hold "$wrong" "a mask makes of zones that overlap one mesh"
works 2 good.cgns overset.cgns -o out.cgns --report report.json $density --target-mask Iblank --output-solution New
cover target 8 0 4 4
hold "$wrong" "and lets fields go to zones that overlap"
refused 6 "overset.cgns.*overlap" "zones that overlap are refused without a mask" overset.cgns mesh.cgns -o out/result.cgns
refused 6 "overset.cgns.*times.*source-mask" "and with one that leaves the overlap" \
  overset.cgns mesh.cgns -o out/result.cgns --source-mask Iblank=0+1

refused 2 "masked.cgns.*Zone.*no_such" "a mask that is not there is named" \
  masked.cgns mesh.cgns -o out/result.cgns --source-mask no_such
# quick CODE WORD SENTENCE ARGUMENT...: refused, on one rank
quick() {
  status=$1
  says=$2
  sentence=$3
  shift 3
  fails 1 "$status" "$says" masked.cgns mesh.cgns -o out/result.cgns "$@"
  hold $? "$sentence"
}
quick 2 "mesh.cgns.*Zone.*Iblank" "so is one of the target" --target-mask Iblank
quick 2 "masked.cgns.*Nowhere" "a mask that leaves nothing is refused" --source-mask Nowhere
quick 2 "ChimeraCellType=1" "codes that nobody agrees on have to be given" --source-mask ChimeraCellType
quick 2 "source-mask: '1+x'" "codes are whole numbers" --source-mask Iblank=1+x
quick 2 "source-mask: '=1'" "a mask has a name" --source-mask =1
quick 5 "masked.cgns.*Zone.*cell 1 .*Nowhere.*source-volume" "a volume of 0 is named" --source-volume Nowhere
quick 2 "masked.cgns.*Zone.*no_such" "so is a volume that is not there" --source-volume no_such
quick 5 "masked.cgns.*Zone.*cell 64.*Broken" "a code that is NaN is named" --source-mask Broken
finish
