#!/bin/sh
# Fields at vertices, through the median-dual cells of both meshes. See cli.sh for the arguments.
# shellcheck source-path=SCRIPTDIR source=cli.sh
. "$(dirname "$0")/cli.sh"
cd "$work" || exit 1
at="--location vertex"

for n in 1 2 3 4; do
  # shellcheck disable=SC2086 # two words
  works $n at_vertices.cgns mesh.cgns -o out$n.cgns --report report.json $at --coverage
  cmp out1.cgns out$n.cgns || complain "1 and $n ranks differ"
done
[ "$(value source cells) $(value target cells)" = "27 64" ] || complain "$(value source cells), $(value target cells) vertices"
near "$(value source volume)" 1 1e-14
near "$(value overlap volume)" 1 1e-14
[ "$(value overlap target_covered)" = 64 ] || complain "not all vertices are covered"
for f in 0 1 2; do
  [ "$(value fields $f conservation_error | awk '{ print ($1 <= 1e-15) }')" = 1 ] || complain "field $f is not conserved"
done
[ "$(value fields 3 nature)" = flag ] || complain "codes are averaged"
hold "$wrong" "fields go from vertices to vertices, with the same bytes on 1 to 4 ranks"
cp out1.cgns checked.cgns
if cgnscheck checked.cgns 2>&1 | grep -E '^ERROR|CGNSlib ERROR|[1-9][0-9]* errors'; then complain "cgnscheck objects"; fi
hold "$wrong" "OUTPUT is sound CGNS"
works 2 out1.cgns at_vertices.cgns -o back.cgns $at --report report.json -f Density,Coverage
near "$(value fields 1 target_min)" 1 1e-13
near "$(value fields 1 target_max)" 1 1e-13
hold "$wrong" "it can be read again, and a constant stays one"
works 1 at_vertices.cgns at_vertices.cgns -o same.cgns $at -f 'Density,Mom*,Tracer'
[ "$(cgnsdiff -d at_vertices.cgns same.cgns 2>&1)" = "" ] || complain "$(cgnsdiff -d at_vertices.cgns same.cgns 2>&1)"
hold "$wrong" "a file remapped onto itself keeps its fields"
works 1 at_vertices.cgns vertex_old.cgns -o out.cgns $at --report report.json -f Density
[ "$(value overlap target_uncovered)" -gt 0 ] || complain "all is covered"
awk -v most="$(value fields 0 target_max)" 'BEGIN { exit !(most > 6) }' || complain "old values are lost"
hold "$wrong" "old values at vertices stay where there is no source"
works 2 --check at_vertices.cgns mesh.cgns $at
hold $? "--check knows dual meshes"

refused 5 "at_vertices.cgns.*Zone.*Vertex.*--location vertex" "vertex values are not taken for cell values" \
  at_vertices.cgns mesh.cgns -o out/result.cgns
refused 5 "good.cgns.*Zone.*CellCenter.*--location cell" "nor the other way round" good.cgns mesh.cgns -o out/result.cgns $at
fails 1 2 "good.cgns.*Zone.*CellCenter-located" at_vertices.cgns good.cgns -o out/result.cgns $at
hold $? "a solution of TARGET keeps its location"

data=${REMAP_SHARED_DATA:-../shared/data}
hexa=$OLDPWD/$data/cgns_vers3310_hexa_sol.cgns
case $data in /*) hexa=$data/cgns_vers3310_hexa_sol.cgns ;; esac
if [ -f "$hexa" ]; then
  unit=$(dirname "$hexa")/cassiopee_case_hexa_v4.cgns
  for n in 1 2; do works $n "$hexa" "$hexa" -o out$n.cgns $at; done
  cmp out1.cgns out2.cgns || complain "1 and 2 ranks differ"
  cgnsdiff -d "$hexa" out1.cgns >differences 2>&1 # where the file leaves the default location out it is written
  if grep -v GridLocation differences; then complain "the fields changed"; fi
  hold "$wrong" "a real file onto itself copies every value"
  works 2 "$hexa" "$unit" -o out.cgns $at --report report.json --on-uncovered fill=0 --on-partial conserve
  [ "$(value fields 0 conservation_error | awk '{ print ($1 <= 1e-14) }')" = 1 ] || complain "Density is not conserved"
  hold "$wrong" "and onto the vertices of another one"
fi
finish
