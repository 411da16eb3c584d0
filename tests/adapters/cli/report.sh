#!/bin/sh
# The report and the file that is written, on meshes that are easy to know. See cli.sh for the arguments.
# shellcheck source-path=SCRIPTDIR source=cli.sh
. "$(dirname "$0")/cli.sh"
cd "$work" || exit 1

# keys WHERE KEY...: the object there has these keys.
keys() {
  where=$1
  shift
  # shellcheck disable=SC2086 # $where is a list of keys
  value $where >have || complain "the report has no $where"
  for key in "$@"; do grep -qx "$key" have || complain "the report has no $where $key"; done
}
# is WANTED KEY...: the value there is just this.
is() {
  want=$1
  shift
  [ "$(value "$@")" = "$want" ] || complain "$* is $(value "$@"), want $want"
}

works 2 good.cgns mesh.cgns -o out.cgns --report report.json
keys "" version ranks source target overlap coverage fields check time memory notes
keys source file zones cells volume
keys target file zones cells volume
keys overlap pairs volume source_covered source_partial source_uncovered target_covered target_partial target_uncovered \
  max_closure_error_source max_closure_error_target
keys "fields 0" name nature order limiter source_integral target_integral conservation_error source_min source_max target_min \
  target_max limited_cells order_reduced_cells
keys time read partition overlay transfer write total
keys memory peak_rss_bytes_max
hold "$wrong" "the report has every key"
is 2 ranks
is good.cgns source file
is 64 source cells
is 27 target cells
is 1 source zones
is 216 overlap pairs
is 64 overlap source_covered
is 0 overlap source_partial
is 27 overlap target_covered
is 0 overlap target_uncovered
near "$(value overlap volume)" 1 1e-15
near "$(value source volume)" 1 1e-15
is 4 fields
is Density fields 0 name
is conserved fields 0 nature
is 2 fields 0 order
is auto fields 0 limiter
is volume-mean fields 2 nature
is flag fields 3 nature
is none fields 3 limiter
near "$(value fields 0 source_integral)" "$(value fields 0 target_integral)" 1e-14
[ "$(value memory peak_rss_bytes_max)" -gt 1000000 ] || complain "no memory is needed"
grep -q "Tracer" report.json || complain "the unknown name is not remarked"
hold "$wrong" "its numbers are those of two cubes of 64 and 27 cells"

works 1 good.cgns mesh.cgns -o one.cgns --report report.json -f Density,Mom* --order 1
is 2 fields
is MomentumX fields 1 name
is 1 fields 0 order
is none fields 0 limiter
hold "$wrong" "names and globs choose fields"
cmp -s one.cgns out.cgns
[ $? = 1 ]
hold $? "fewer fields make another file"

works 1 good.cgns mesh.cgns -o one.cgns --report report.json --nature 'Tracer=conserved,Mom*=volume-mean' --nature Density=flag
for row in "0 flag" "1 volume-mean" "2 conserved" "3 flag"; do is "${row#* }" fields "${row% *}" nature; done
if grep -q "Tracer: its name" report.json; then complain "a nature that is given is not known"; fi
hold "$wrong" "--nature says what fields are"

works 2 good.cgns mesh.cgns -o one.cgns --report report.json -f Density --order 3 --limiter caas
is 3 fields 0 order
is caas fields 0 limiter
is 0 fields 0 order_reduced_cells
near "$(value fields 0 source_integral)" "$(value fields 0 target_integral)" 1e-14
hold "$wrong" "order and limiter are those asked for"

works 1 old.cgns mesh.cgns -o one.cgns --report report.json --limiter none --on-uncovered fill=-3 --on-partial conserve
is 19 overlap target_uncovered
is 7 overlap target_partial
is 1 overlap target_covered
is -3 fields 0 target_min
is none fields 0 limiter
hold "$wrong" "what is not covered takes the value to fill with"

works 1 good.cgns old.cgns -o one.cgns --report report.json
awk -v most="$(value fields 0 target_max)" 'BEGIN { exit !(most > 6) }' || complain "old values are lost"
[ "$(value fields 0 conservation_error | awk '{ print ($1 <= 1e-14) }')" = 1 ] || complain "it is not conserved"
hold "$wrong" "old values stay where there is no source"

works 1 good.cgns old.cgns -o one.cgns --report report.json --output-solution Restart --on-uncovered nearest
awk -v most="$(value fields 0 target_max)" 'BEGIN { exit !(most < 2) }' || complain "old values of another solution are taken"
is Restart target solution
works 1 one.cgns mesh.cgns -o two.cgns --solution Restart --report report.json
is Restart source solution
hold "$wrong" "the solution to write has a name of its own, and can be read again"

echo "1 0 0 5  0 0 -1 0.5  0 1 0 -.5" >move.txt
works 1 good.cgns mesh.cgns -o one.cgns --report report.json --scale 1e-3
near "$(value source volume)" 1e-9 1e-14
near "$(value overlap volume)" 1e-9 1e-14
hold "$wrong" "--scale changes the unit of SOURCE"
works 1 good.cgns far.cgns -o one.cgns --report report.json --scale 2 --transform move.txt --on-uncovered fill=0
[ "$code" = 0 ] || complain "exit status $code"
near "$(value source volume)" 8 1e-14
is 0 overlap pairs
hold "$wrong" "--transform comes after --scale, and meshes need not meet"

works 1 good.cgns good.cgns -o same.cgns --report report.json -f 'Density,Mom*,Tracer'
is 64 overlap pairs
is 0 fields 0 conservation_error
[ "$(cgnsdiff -d good.cgns same.cgns 2>&1)" = "" ] || complain "$(cgnsdiff -d good.cgns same.cgns 2>&1)"
hold "$wrong" "a file remapped onto itself keeps its fields"
works 1 good.cgns mesh.cgns -q -o out.cgns --report /dev/stdout && grep -q '"peak_rss_bytes_max"' stdout
hold $? "the report can go to standard output"
ln -s behind.json link.json
works 1 good.cgns mesh.cgns -q -o out.cgns --report link.json && [ -L link.json ] && grep -q '"peak_rss_bytes_max"' behind.json
hold $? "a report goes through a link and leaves the link"

name=$(printf 'm\351lange') # Latin 1
cp good.cgns "$name.cgns"
works 1 "$name.cgns" mesh.cgns -o one.cgns --report report.json --output-solution "$name"
is "$(printf 'm\303\251lange').cgns" source file
is "$(printf 'm\303\251lange')" target solution
hold "$wrong" "names that are not UTF-8 are reported"

"$tools/make_demo" . 10 >/dev/null || complain "no demo"
for n in 1 2 3; do works "$n" source.cgns target.cgns -o "out$n.cgns" --report "report$n.json"; done
cmp out1.cgns out2.cgns || complain "1 and 2 ranks differ"
cmp out1.cgns out3.cgns || complain "1 and 3 ranks differ"
for n in 1 2 3; do "$tools/json_value" "report$n.json" fields 4 conservation_error; done | sort -u | wc -l | grep -qx 1 ||
  complain "reports differ"
hold "$wrong" "1, 2 and 3 ranks write the same bytes"
cp report2.json report.json
[ "$(value overlap max_closure_error_target | awk '{ print ($1 <= 1e-12) }')" = 1 ] || complain "closure"
is 0 overlap target_uncovered
near "$(value overlap volume)" 1 1e-14
hold "$wrong" "warped hexahedra and octagonal prisms close"
finish
