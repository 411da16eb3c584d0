#!/bin/sh
# Booleans of closed surfaces: volumes, names, formats, the same bytes on any number of ranks. See bodies.sh for the arguments.
# shellcheck source-path=SCRIPTDIR source=bodies.sh
. "$(dirname "$0")/bodies.sh"

makes 0.125 intersection cube.obj dice.obj -o out.cgns
makes 1.875 union cube.obj dice.obj -o out.cgns
makes 0.875 difference cube.obj dice.obj -o out.cgns
makes 0.875 rdifference cube.obj dice.obj -o out.cgns
makes 1 imprint cube.obj dice.obj -o out.cgns
hold "$wrong" "two cubes in each other have the volumes of every operation"
makes 0.875 difference cube.obj core.obj -o out.cgns
[ "$(value result cells)" = 1 ] || complain "more than one cell"
checked out.cgns
hold "$wrong" "a cube without its core is one cell with a void"
makes 1 union cube.obj core.obj -o out.cgns
[ "$(value result cells)" = 2 ] || complain "not two cells"
makes 2 union cube.obj beside.obj -o out.cgns
hold "$wrong" "cubes in each other, and cubes that share one corner, join"
makes 1 intersection cube.obj cube.obj -o out.cgns
[ "$(value result cells)" = 1 ] || complain "not one cell"
makes 1 union cube.obj cube.obj -o out.obj
[ "$(grep -c '^v ' out.obj)" = 8 ] || complain "not eight corners"
hold "$wrong" "a body and itself are that body"

makes 0.875 difference cube.obj dice.obj -o out.obj
[ "$(grep -c '^v ' out.obj)" = 14 ] && [ "$(grep '^g ' out.obj | tr '\n' ' ')" = "g cube g dice " ] || complain "$(cat out.obj)"
makes 0.875 difference cube.obj dice.obj -o out.stl
[ "$(grep '^solid ' out.stl | tr '\n' ' ')" = "solid cube solid dice " ] || complain "$(grep solid out.stl)"
makes 0.875 intersection out.stl cube.obj -o again.obj
near "$(area out.obj cube)" 5.25 1e-14
near "$(area out.obj dice)" 0.75 1e-14
hold "$wrong" "outer surfaces keep the names of their faces, and are good to go on with"

for ending in stl obj; do alike "$ending" "1 3" union cube.obj dice.obj; done
alike cgns "1 2 3 4" union cube.obj dice.obj
hold "$wrong" "the bytes do not depend on the number of ranks"
makes 0.125 intersection dice.obj cube.obj -o out.cgns --faces diagonal --split --aggregate
makes 0.125 intersection cube.obj cube.obj -o out.cgns --scale 0.5
hold "$wrong" "options are heard"
sed -E '10s/f (.) (.) (.) (.)/f \4 \3 \2 \1/; 12s/f (.) (.) (.) (.)/f \4 \3 \2 \1/' dice.obj >mixed.obj
works 1 difference cube.obj mixed.obj -o out.cgns --report report.json
near "$(value result volume)" 0.875 1e-14
[ "$(value b repairs faces_turned)" = 2 ] || complain "not two faces were turned"
hold "$wrong" "faces that point inward are turned round"
finish
