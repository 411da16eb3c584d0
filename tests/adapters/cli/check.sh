#!/bin/sh
# remap --check: figures and verdicts about two meshes. See cli.sh for the arguments.
# shellcheck source-path=SCRIPTDIR source=cli.sh
. "$(dirname "$0")/cli.sh"
cd "$work" || exit 1
"$tools/make_demo" . 8 >/dev/null || complain "no demo"

names="constant linear order conservation bounds"
for order in 1 2 3; do
  for limiter in none auto; do
    works 2 --check source.cgns target.cgns --order $order --limiter $limiter --report report.json
    for name in $names; do grep -q "^$name .*PASS$" stdout || complain "$name does not pass"; done
    [ "$(value check)" = 5 ] || complain "$(value check) figures"
    i=0
    for name in $names; do
      [ "$(value check $i name) $(value check $i pass)" = "$name true" ] || complain "the report does not say that $name passes"
      i=$((i + 1))
    done
    awk -v got="$(value check 2 figure)" -v want=$order 'BEGIN { exit !(got > want - .5 && got < want + 1) }' ||
      complain "order $(value check 2 figure) where $order is asked"
    hold "$wrong" "all figures of order $order and limiter $limiter pass"
  done
done
for n in 1 3; do
  run $n --check source.cgns target.cgns
  grep -E "^(linear|order|bounds) " stdout >"figures$n"
done
[ -s figures1 ] && cmp figures1 figures3
hold $? "1 and 3 ranks find the same order"
works 1 --check good.cgns good.cgns --report report.json
near "$(value check 0 figure)" 0 0
near "$(value check 1 figure)" 0 0
hold "$wrong" "identical meshes are exact"
works 1 --check masked.cgns mesh.cgns --source-mask Iblank --limiter none
hold $? "masks count"

fails 2 4 "wide.cgns.*half.cgns.*order" wide.cgns half.cgns --check --report report.json
grep -q "^order .*FAIL$" stdout || complain "no FAIL"
[ "$(value check 2 pass)" = false ] || complain "the report does not tell"
hold "$wrong" "cells too wide for the order fail with status 4"
fails 2 4 "wide.cgns.*bow_tie.cgns.*order.*zone Base/Zone: cell 1 .*inside out" wide.cgns bow_tie.cgns --check \
  --report report.json
grep -q "bow_tie.cgns: zone Base/Zone: cell 1 .*inside out" report.json || complain "the report does not tell"
hold "$wrong" "a cell whose parts cancel is named"
fails 1 3 "do not meet" good.cgns far.cgns --check
hold $? "meshes that do not meet are told apart"
fails 1 2 "leave -o" good.cgns mesh.cgns --check -o out/result.cgns
hold $? "--check writes no OUTPUT"
works 1 mesh.cgns mesh.cgns --check
hold $? "no fields are needed"
finish
