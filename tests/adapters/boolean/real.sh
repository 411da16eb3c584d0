#!/bin/sh
# Real files as operands: cells, boundaries and fields of what comes out, and cgnscheck. See bodies.sh for the arguments.
# shellcheck source-path=SCRIPTDIR source=bodies.sh
. "$(dirname "$0")/bodies.sh"
data=${REMAP_SHARED_DATA:-}
[ -f "$data/pycgns_sqnz_t3_8zones_sol.cgns" ] || { echo "# skipped: the folder of shared data is not there"; exit 77; }

works 1 union "$data/pycgns_sqnz_t3_8zones_sol.cgns" "$data/pycgns_sqnz_unstruct_2dom_sol.cgns" -o same.cgns \
  --solution 'FlowSolution#Init' --report report.json
[ "$(value result in_both cells)" = 11264 ] && [ "$(value result cells)" = 11264 ] || complain "not 11264 cells"
near "$(value result volume)" 1.82423131977 1e-11
[ "$(value result fields 0)" = Density ] || complain "no Density"
checked same.cgns
hold "$wrong" "the same cells in eight zones and in two are those cells"

cube 0.1 0.9 core >core.obj
works 2 difference "$data/msh2cgns_mandel_mixed.cgns" core.obj -o mandel.cgns --report report.json
near "$(value result volume)" 0.488 1e-12
[ "$(value result boundaries 0)" = BC1_on_WEST ] || complain "no BC1_on_WEST"
checked mandel.cgns
works 1 intersection "$data/maia_U_ATB_45_NGON_v42.cgns" "$data/maia_U_ATB_45_NGON_v42.cgns" -o atb.cgns --report report.json
[ "$(value result cells)" = 460 ] || complain "not 460 cells"
[ "$(value result boundaries 0)" = wall ] || complain "no wall"
checked atb.cgns
hold "$wrong" "boundary conditions of elements and of polyhedra come through"

works 1 imprint "$data/pycgns_naca12_hybrid_sol.cgns" core.obj -o naca.cgns --report report.json
near "$(value a zone_overlap)" 4.7702295e-7 1e-6
near "$(value result volume)" 260.185832 1e-9
checked naca.cgns
hold "$wrong" "zones that overlap by rounding are joined, and what two of them have counts once"
finish
