#!/bin/sh
# What is covered: figures in the report, phi and psi as fields. See cli.sh for the arguments.
# shellcheck source-path=SCRIPTDIR source=cli.sh
. "$(dirname "$0")/cli.sh"
cd "$work" || exit 1

echo "1 0 0 .01  0 1 0 0  0 0 1 0" >shift.txt
# The source is the unit cube, the target the same moved by half of it along the diagonal: 3 x 3 x 3 cells, one of them inside.
works 2 good.cgns half.cgns -o out.cgns --report report.json --coverage --source-coverage psi.cgns
for row in "target covered 1" "target partial 7" "target uncovered 19" "target masked 0" "source covered 8" \
  "source uncovered 56"; do
  # shellcheck disable=SC2086 # words of a row
  set -- $row
  [ "$(value coverage "$1" "$2" cells)" = "$3" ] || complain "$1 $2: $(value coverage "$1" "$2" cells) cells"
done
near "$(value coverage target covered volume)" 0.037037037037037035 1e-14
near "$(value coverage target partial volume)" 0.25925925925925924 1e-14
near "$(value coverage target uncovered volume)" 0.70370370370370372 1e-14
near "$(value coverage source uncovered volume)" 0.875 1e-14
hold "$wrong" "the report has cells and volumes"
[ "$(value coverage target least_partial) $(value coverage target largest_uncovered)" = "5 5" ] || complain "not 5 cells each"
[ "$(value coverage target least_partial 0 cell)" = "Base/Zone: cell 14 (counted from 1)" ] || complain "another cell"
near "$(value coverage target least_partial 0 coverage)" 0.125 1e-14
near "$(value coverage target least_partial 0 volume)" 0.037037037037037035 1e-14
for d in 0 1 2; do near "$(value coverage target least_partial 0 centre $d)" 1 1e-14; done
near "$(value coverage target largest_uncovered 0 coverage)" 0 0
grep -q "least Base/Zone: cell 14 .* at 1 1 1" stdout || complain "people are not told"
hold "$wrong" "and the worst cells with their places"

works 1 out.cgns out.cgns -o again.cgns --report report.json -f Coverage
near "$(value fields 0 source_max)" 1 1e-14
near "$(value fields 0 source_min)" 0 0
near "$(value fields 0 source_integral)" 0.125 1e-14
hold "$wrong" "--coverage writes phi into OUTPUT"
works 1 psi.cgns psi.cgns -o again.cgns --report report.json
[ "$(value fields)" = 5 ] || complain "SOURCE does not keep its fields"
near "$(value fields 4 source_integral)" 0.125 1e-14
hold "$wrong" "--source-coverage writes SOURCE with psi"
for n in 1 3; do works $n good.cgns half.cgns -o out$n.cgns --report report$n.json --coverage --source-coverage psi$n.cgns; done
cmp psi1.cgns psi3.cgns && cmp out1.cgns out3.cgns && cmp psi.cgns psi1.cgns || complain "bytes depend on the number of ranks"
hold "$wrong" "1, 2 and 3 ranks write the same"

# Three of the seven are covered by a quarter, three by a half, one by an eighth.
works 1 good.cgns half.cgns -o out.cgns --report report.json --min-coverage .3 --on-uncovered fill=-7 -f Density --coverage
[ "$(value coverage target too_little)" = 4 ] || complain "$(value coverage target too_little) cells count as not covered"
[ "$(value coverage target partial cells)" = 7 ] || complain "the report forgets what is covered in part"
near "$(value fields 0 target_min)" -7 0
grep -q "4 of these count as not covered" stdout || complain "people are not told"
works 1 out.cgns out.cgns -o again.cgns --report report.json -f Coverage
near "$(value fields 0 source_integral)" 0.125 1e-14
hold "$wrong" "--min-coverage lets cells count as not covered, and phi tell the truth"
refused 3 "mesh.cgns.*cell 1 .*min-coverage" "so that they can be refused" \
  good.cgns mesh.cgns -o out/result.cgns --transform shift.txt --min-coverage .98 --on-uncovered error
fails 1 2 "min-coverage: '2'" good.cgns mesh.cgns -o out/result.cgns --min-coverage 2
hold $? "a share is at most 1"

refused 2 "out.cgns.*Coverage.*fields" "a field of that name is in the way" \
  out.cgns mesh.cgns -o out/result.cgns --coverage
refused 2 "good.cgns.*input" "SOURCE is not overwritten" good.cgns mesh.cgns --source-coverage good.cgns -o out/result.cgns
refused 2 "out/result.cgns.*source-coverage" "two outputs are two files" \
  good.cgns mesh.cgns --source-coverage out/result.cgns -o out/result.cgns
refused 5 "nowhere/psi.cgns" "a folder that is not there is named" \
  good.cgns mesh.cgns --source-coverage nowhere/psi.cgns -o out/result.cgns
finish
