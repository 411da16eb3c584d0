#!/bin/sh
# Booleans of meshes, and of a mesh and a surface: volumes, cells, fields, boundaries, valid CGNS. See bodies.sh.
# shellcheck source-path=SCRIPTDIR source=bodies.sh
. "$(dirname "$0")/bodies.sh"
transfer=$5

makes 0.125 intersection good.cgns half.cgns -o both.cgns
makes 1.875 union good.cgns half.cgns -o union.cgns
makes 0.875 difference good.cgns half.cgns -o less.cgns
makes 0.875 rdifference good.cgns half.cgns -o rest.cgns
makes 1 imprint good.cgns half.cgns -o imprint.cgns
hold "$wrong" "two meshes have the volumes of every operation"
checked both.cgns union.cgns less.cgns rest.cgns imprint.cgns
hold "$wrong" "cgnscheck finds no error in what is written"
makes 1 intersection good.cgns good.cgns -o out.cgns
[ "$(value result cells)" = 64 ] || complain "not 64 cells"
makes 2 union two_zones.cgns two_zones.cgns -o out.cgns
[ "$(value result cells)" = 16 ] || complain "not 16 cells"
hold "$wrong" "a mesh and itself are that mesh"
makes 1.875 union union.cgns both.cgns -o out.cgns
makes 0.875 difference union.cgns mesh.cgns -o out.cgns
hold "$wrong" "results are operands"

makes 0.875 difference good.cgns core.obj -o cut.cgns
checked cut.cgns
makes 0.125 intersection core.obj good.cgns -o out.cgns
[ "$(value result cells)" = 8 ] || complain "not 8 cells"
makes 0.125 intersection good.cgns dice.obj -o out.cgns
hold "$wrong" "a surface cuts a mesh"
value result boundaries 0 | grep -qx dice || complain "no boundary dice"
hold "$wrong" "what the surface cuts gets its name"
makes 0.125 intersection good.cgns dice.obj -o corner.cgns
makes 0.125 imprint corner.cgns away.obj -o corner.obj # by the BC_t of corner.cgns
near "$(area corner.obj dice)" 0.75 1e-14
near "$(area corner.obj unnamed)" 0.75 1e-14
hold "$wrong" "names come through a CGNS file with the faces that they belong to"

for n in 1 3; do
  "$mpiexec" "$numproc_flag" "$n" "$transfer" -q corner.cgns mesh.cgns -o out.cgns --supermesh "super$n.cgns" ||
    complain "remap fails"
done
cmp -s super1.cgns super3.cgns || complain "other bytes on 3 ranks"
checked super1.cgns
makes 0.125 imprint super1.cgns away.obj -o super.obj
near "$(area super.obj dice)" 0.75 1e-14
near "$(area super.obj unnamed)" 0.75 1e-14
grep -q FaceAncestors super1.cgns || complain "faces have no ancestors"
hold "$wrong" "the supermesh that remap writes keeps them too"

alike cgns "1 2 3 4" union good.cgns half.cgns
alike vtu "1 4" union good.cgns dice.obj
alike obj "1 2" difference good.cgns half.cgns
alike obj "1 4" union good.cgns dice.obj
alike stl "1 3" union good.cgns dice.obj
hold "$wrong" "the bytes do not depend on the number of ranks"
for n in 1 3; do
  works "$n" rdifference good.cgns half.cgns -o out.cgns --report report.json
  value result volume >"volume$n"
done
cmp -s volume1 volume3 || complain "$(cat volume1) and $(cat volume3)"
hold "$wrong" "nor do the volumes of the report"

works 1 imprint good.cgns half.cgns -o out.cgns -f 'Dens*' --report report.json
[ "$(value result fields 0)" = Density ] || complain "no Density"
"$transfer" -q good.cgns mesh.cgns -o direct.cgns -f Density --report report.json || complain "remap fails"
direct=$(value fields 0 source_integral)
"$transfer" -q out.cgns mesh.cgns -o back.cgns -f Density --report report.json || complain "remap does not take the result"
near "$(value fields 0 source_integral)" "$direct" 1e-13
hold "$wrong" "fields are carried over, and remap takes the result"
finish
