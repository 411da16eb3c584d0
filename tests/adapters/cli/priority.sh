#!/bin/sh
# Zones that overlap, by priority: what one hides of another does not count. See cli.sh for the arguments.
# shellcheck source-path=SCRIPTDIR source=cli.sh
. "$(dirname "$0")/cli.sh"
cd "$work" || exit 1
data=${REMAP_SHARED_DATA:-../shared/data}
case $data in /*) ;; *) data=$OLDPWD/$data ;; esac

# Two cubes of 4 x 4 x 4 cells, one moved by 0.3; Tracer is one linear field of both, and of inside.cgns, which they cover in
# part.
for first in Zone Second; do
  for n in 1 2 3; do
    works $n crossed.cgns inside.cgns -o out$n.cgns -f Tracer --limiter none --priority "Base/$first" --on-partial normalise \
      --on-uncovered error --report report.json
    cmp out1.cgns out$n.cgns || complain "1 and $n ranks differ"
  done
  [ "$(cgnsdiff -d -t1e-13 inside.cgns out1.cgns 2>&1)" = "" ] || complain "the linear field is not that of the target"
  near "$(value source volume)" 1.3 1e-14
  near "$(value overlap volume)" 0.9025 1e-14
  awk -v e="$(value fields 0 conservation_error)" 'BEGIN { exit !(e <= 1e-14) }' || complain "it is not conserved"
  grep -q "32 pieces of cells of lower priority" report.json || complain "the report does not count the pieces"
  hold "$wrong" "with $first first, space counts once and linear fields are exact across the cut"
done
works 1 crossed.cgns inside.cgns -o one.cgns -f Density --priority 'Base/Sec*,Base/Zone'
works 1 crossed.cgns inside.cgns -o two.cgns -f Density --priority Base/Zone
cmp -s one.cgns two.cgns
[ $? = 1 ]
hold $? "the order decides whose values count"
works 2 gas_crossed.cgns inside.cgns -o out.cgns --report report.json --priority Base/Second --output-solution New --order 3
for f in 0 2 3 4; do near "$(value fields $f target_min)" "$(value fields $f target_max)" 1e-13; done
for f in $(seq 0 $(($(value fields) - 1))); do
  awk -v e="$(value fields "$f" conservation_error)" 'BEGIN { exit !(e <= 1e-14) }' || complain "field $f is not conserved"
done
hold "$wrong" "systems of fields stay what they are, at order 3"
works 2 overset.cgns wide.cgns -o out.cgns --report report.json -f Density --priority Base/Zone --source-mask Iblank \
  --on-uncovered fill=1 --on-partial normalise --output-solution New
near "$(value fields 0 target_max)" 1 1e-6
near "$(value coverage source covered volume)" 1.5 1e-13
hold "$wrong" "masks and priorities go together"
works 2 good.cgns crossed.cgns -o out.cgns --report report.json -f Density --priority Base/Zone --output-solution New
[ "$(value target cells)" = 128 ] || complain "cells are lost"
awk -v e="$(value fields 0 conservation_error)" 'BEGIN { exit !(e <= 1e-14) }' || complain "it is not conserved"
hold "$wrong" "zones of TARGET get their values one by one"

# What else takes cells takes pieces: of the second cube those of x > 1 are visible, inside.cgns goes from 0.05 to 1.05.
for n in 1 3; do
  works $n crossed.cgns inside.cgns -o out.cgns -f Tracer --priority Base/Zone --on-partial normalise --report report.json \
    --source-coverage psi$n.cgns --supermesh super$n.cgns
  cmp psi1.cgns psi$n.cgns && cmp super1.cgns super$n.cgns || complain "1 and $n ranks differ"
done
[ "$(value supermesh cells)" = "$(value overlap pairs)" ] || complain "not a cell for each pair"
near "$(value supermesh volume)" 0.9025 1e-14
works 1 psi1.cgns wide.cgns -o out.cgns -f Coverage --priority Base/Zone --on-partial normalise --report report.json
near "$(value fields 0 source_integral)" 0.8664 1e-14 # of the first cube 0.95^3, of the other 0.2 0.95^2 over a width of 0.05
hold "$wrong" "--source-coverage has the share of whole cells that is visible and covered"
works 2 super1.cgns wide.cgns -o out.cgns -f AncestorSource --nature AncestorSource=volume-mean --on-partial normalise \
  --report report.json
near "$(value fields 0 source_integral)" "$(awk 'BEGIN {
  for (c = 0; c < 64; c++) {
    width[0] = .2
    width[1] = width[2] = width[3] = .25
    side = width[int(c / 4) % 4] * width[int(c / 16)]
    sum += (c + 1) * width[c % 4] * side
    if (c % 4 == 2) sum += (c + 65) * .05 * side
  }
  printf "%.17g", sum }')" 1e-13
near "$(value fields 0 source_max)" 127 0
hold "$wrong" "ancestors in the --supermesh are cells of SOURCE"
works 2 crossed.cgns wide.cgns -o out.cgns -f Tracer --priority Base/Zone --output-solution New --supermesh walls.cgns
grep -q Inlet walls.cgns && grep -q Outlet walls.cgns || complain "a boundary is lost"
! grep -q -e Inlet -e Outlet super1.cgns || complain "a boundary comes from nowhere"
hold "$wrong" "and boundaries those of its faces"
works 2 crossed.cgns inside.cgns --priority Base/Zone --check --report report.json
[ "$(grep -c "PASS$" stdout)" = 5 ] || complain "$(grep "FAIL$" stdout)"
hold "$wrong" "--check: linear fields, order and conservation pass across the cut"
# Cells of volume 1/8 by the solver, but for cell 4 of each zone, a quarter larger; visible are all of the first zone and the
# second half of the other, where Density is 1.
works 2 overset.cgns wide.cgns -o out.cgns -f Density --priority Base/Zone --source-volume Volume --on-partial normalise \
  --on-uncovered fill=1 --report report.json --output-solution New
near "$(value source solver_volume)" 1.5625 1e-14
near "$(value source max_volume_difference)" 0.25 1e-13
near "$(value fields 0 source_integral)" 1.5625 1e-14
near "$(value fields 0 target_integral)" 1.5625 1e-14
hold "$wrong" "--source-volume: a piece has its share of the solver's volume"
if [ -f "$data/pycgns_124Disk_chimera_brokenlink.cgns" ]; then
  "$tools/make_demo" . 8 >/dev/null || complain "no demo"
  echo "1 0 0 -15  0 1 0 -15  0 0 1 -15" >move.txt
  disk=$data/pycgns_124Disk_chimera_brokenlink.cgns
  refused 6 "124Disk.*overlap" "a real overset file is refused" source.cgns "$disk" -o out/result.cgns --scale 30 \
    --transform move.txt --output-solution New -f Density
  works 2 source.cgns "$disk" -o disk.cgns --scale 30 --transform move.txt --output-solution New --priority 'Disk/*'
  works 2 disk.cgns mesh.cgns -o out.cgns --solution New --priority 'Disk/*' --on-uncovered fill=0 --report report.json \
    -f Density
  awk -v e="$(value fields 0 conservation_error)" 'BEGIN { exit !(e <= 1e-13) }' || complain "it is not conserved"
  hold "$wrong" "with priorities it is target and source"
fi

# Turned, the cubes' common sides agree but for rounding.
echo ".8 -.6 0 .1  .48 .64 -.6 .31  .36 .48 .8 -.27" >turn.txt
for n in 1 3; do
  works $n crossed.cgns wide.cgns -o out.cgns -f Tracer --priority Base/Zone --transform turn.txt --faces diagonal \
    --report report.json --output-solution New --source-coverage psi$n.cgns
done
cmp psi1.cgns psi3.cgns || complain "1 and 3 ranks differ"
grep -q "32 pieces of cells of lower priority" report.json || complain "slivers count as pieces"
near "$(value source volume)" 1.3 1e-14
awk -v e="$(value fields 0 conservation_error)" 'BEGIN { exit !(e <= 1e-14) }' || complain "it is not conserved"
hold "$wrong" "pieces that are no more than rounding are left out"

refused 6 "crossed.cgns.*pieces.*leave --supermesh out" "pieces that overlap by rounding make no supermesh" \
  crossed.cgns wide.cgns -o out/result.cgns --priority Base/Zone --transform turn.txt --supermesh super.cgns
refused 6 "crossed.cgns.*overlap" "zones that nobody named may not overlap" crossed.cgns inside.cgns -o out/result.cgns
# quick CODE WORD SENTENCE ARGUMENT...: refused, on one rank.
quick() {
  status=$1
  says=$2
  sentence=$3
  shift 3
  fails 1 "$status" "$says" "$@"
  hold $? "$sentence"
}
quick 2 "crossed.cgns.*zone 'Base/Third'" "a zone that is nowhere is named" \
  crossed.cgns inside.cgns -o out/result.cgns --priority Base/Zone,Base/Third
quick 6 "crossed.cgns.*one by one in --priority" "zones of one class may not overlap" \
  crossed.cgns inside.cgns -o out/result.cgns --priority 'Base/*'
finish
