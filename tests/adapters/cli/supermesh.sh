#!/bin/sh
# --supermesh: the common parts of cells as a mesh, beside the transfer. See cli.sh for the arguments.
# shellcheck source-path=SCRIPTDIR source=cli.sh
. "$(dirname "$0")/cli.sh"
cd "$work" || exit 1

works 1 good.cgns mesh.cgns -o out.cgns --supermesh super.cgns --report report.json
[ "$(value supermesh cells)" = "$(value overlap pairs)" ] || complain "not a cell for each pair"
near "$(value supermesh volume)" 1 1e-14
grep -q "^output  super.cgns, supermesh of 216 cells" stdout || complain "the text does not say so"
hold "$wrong" "the supermesh has a cell for each pair of cells and the volume of the overlap"
for n in 2 4; do
  works "$n" -q good.cgns mesh.cgns -o other.cgns --supermesh "on$n.cgns"
  cmp -s "on$n.cgns" super.cgns || complain "other bytes on $n ranks"
  cmp -s other.cgns out.cgns || complain "another OUTPUT on $n ranks"
done
hold "$wrong" "its bytes do not depend on the number of ranks"
works 1 -q good.cgns mesh.cgns -o plain.cgns
cmp -s plain.cgns out.cgns || complain "another OUTPUT without it"
hold "$wrong" "OUTPUT is the same with it and without"
works 1 -q super.cgns mesh.cgns -o back.cgns -f Volume --report report.json
near "$(value source volume)" 1 1e-14
[ "$(value overlap pairs)" = 216 ] || complain "its cells do not lie in one target cell each"
hold "$wrong" "what is written is a mesh that remap reads"
works 2 -q good.cgns half.cgns -o out.cgns --supermesh super.vtu && grep -q 'NumberOfCells' super.vtu
hold $? "a name in .vtu gives VTK"
"$tools/make_demo" . 6 >/dev/null || complain "make_demo fails"
for n in 1 2 3 4; do
  works "$n" -q source.cgns target.cgns -o out.cgns --supermesh "on$n.cgns" --report report.json
  cmp -s on1.cgns "on$n.cgns" || complain "other bytes on $n ranks"
  volume=$(value supermesh volume)
  [ "$n" -gt 1 ] || alone=$volume
  [ "$volume" = "$alone" ] || complain "another volume on $n ranks"
done
near "$(value supermesh volume)" 1 1e-14
[ "$(value supermesh cells)" -ge "$(value overlap pairs)" ] || complain "fewer cells than pairs"
works 1 -q on1.cgns target.cgns -o back.cgns -f Volume --report report.json
near "$(value source volume)" 1 1e-14
hold "$wrong" "zones of TARGET that touch without matching faces are joined"
refused 2 "result.cgns" "the supermesh must not be OUTPUT" good.cgns mesh.cgns --supermesh ./out/result.cgns -o out/result.cgns
refused 2 "good.cgns" "the supermesh must not be SOURCE" good.cgns mesh.cgns --supermesh good.cgns -o out/result.cgns
refused 5 "absent/super.cgns" "where it cannot be written is told first" \
  good.cgns mesh.cgns --supermesh absent/super.cgns -o out/result.cgns
finish
