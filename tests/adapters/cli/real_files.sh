#!/bin/sh
# Real files: solutions onto other meshes of their case and onto themselves, on one and two ranks. The last argument chooses the
# case; its data are in the folder REMAP_SHARED_DATA, and what they must give is in MANIFEST.md there. See cli.sh for the other
# arguments.
# shellcheck source-path=SCRIPTDIR source=cli.sh disable=SC2317 # the cases are called by name
. "$(dirname "$0")/cli.sh"
data=${REMAP_SHARED_DATA:-../shared/data}
if [ ! -f "$data/pycgns_sqnz_t3_8zones_sol.cgns" ]; then
  echo "# skipped: no shared data in $data"
  exit 77
fi
data=$(cd "$data" && pwd)
cd "$work" || exit 1

# at_most BAR KEY...: the number there is not above the bar.
at_most() {
  bar=$1
  shift
  awk -v got="$(value "$@")" -v bar="$bar" 'BEGIN { exit !(got <= bar) }' || complain "$* is $(value "$@"), the bar is $bar"
}

# The place of a field in the report.
place() {
  i=0
  while [ "$(value fields "$i" name 2>/dev/null || echo "$1")" != "$1" ]; do i=$((i + 1)); done
  echo "$i"
}

# both_ranks ARGUMENT...: on 1 and 2 ranks the command writes the same bytes, within the bars; out.cgns and report.json stay.
both_ranks() {
  for n in 1 2; do works "$n" "$@" -o "out$n.cgns" --report report.json; done
  cmp out1.cgns out2.cgns || complain "1 and 2 ranks differ"
  mv out1.cgns out.cgns
  rm -f out2.cgns
  at_most 1e-12 overlap max_closure_error_source
  at_most 1e-12 overlap max_closure_error_target
  for f in $(seq 0 $(($(value fields) - 1))); do at_most 1e-14 fields "$f" conservation_error; done
}

# integral FIELD WANTED WITHIN: of the new field.
integral() { near "$(value fields "$(place "$1")" target_integral)" "$2" "$3"; }

# bounded FIELD [SLACK]: the limiter keeps the new values within the old ones.
bounded() {
  f=$(place "$1")
  awk -v a="$(value fields "$f" source_min)" -v b="$(value fields "$f" target_min)" -v c="$(value fields "$f" target_max)" \
    -v d="$(value fields "$f" source_max)" -v slack="${2:-0}" \
    'BEGIN { exit !(a <= b + slack && b <= c && c <= d + slack) }' || complain "$1 leaves its bounds"
}

sqnz() {
  blocks=$data/pycgns_sqnz_t3_8zones_sol.cgns
  elements=$data/pycgns_sqnz_unstruct_2dom_sol.cgns
  both_ranks "$blocks" "$elements" --solution "FlowSolution#Init" --output-solution initialisation
  [ "$(value overlap pairs)" = 11264 ] || complain "$(value overlap pairs) pairs"
  integral Density 1.87404962703 1e-9
  integral MomentumX 1.34402047107 1e-9
  integral EnergyStagnationDensity 4.235492327 1e-9
  # the files themselves differ in the last bit
  [ -z "$(cgnsdiff -d -t1e-15 "$elements" out.cgns 2>&1)" ] || complain "the fields are not those of the same cells"
  hold "$wrong" "blocks onto elements gives every value to the same cell"
  both_ranks "$elements" "$elements"
  [ -z "$(cgnsdiff -d "$elements" out.cgns 2>&1)" ] || complain "the fields changed"
  hold "$wrong" "elements onto themselves copies every value"
  both_ranks "$elements" "$blocks" --output-solution New
  integral Density 1.87404962703 1e-9
  hold "$wrong" "elements onto blocks, from HDF5 to ADF"
}

adflow() {
  wing=$data/adflow_mdo_tutorial_rans_vol.cgns
  works 2 "$wing" "$wing" -o out.cgns --report report.json --nature 'Vel*=volume-mean,Pressure=volume-mean,Turb*=volume-mean'
  integral Density 24402589.5945 1e-9
  integral VelocityX 23087966.2135 1e-9
  integral Pressure 24402589.8404 1e-9
  integral TurbulentSANuTilde 14.7251100649 1e-9
  for field in Density VelocityX VelocityY VelocityZ Pressure TurbulentSANuTilde; do bounded "$field"; done
  [ "$(value overlap pairs)" = 24192 ] || complain "$(value overlap pairs) pairs"
  [ "$(value overlap target_covered)" = 24192 ] || complain "cells are lost"
  hold "$wrong" "a wing of 38 blocks onto itself, rind stripped"
}

other_wing() {
  both_ranks "$data/adflow_mdo_tutorial_rans_vol.cgns" "$data/cgnsutil_717_wl_L2.cgns"
  for field in VelocityX VelocityY VelocityZ TurbulentSANuTilde; do bounded "$field" 1e-12; done
  for field in Density Pressure; do
    awk -v least="$(value fields "$(place "$field")" target_min)" 'BEGIN { exit !(least > 0) }' ||
      complain "$field is not positive"
  done
  [ "$(value fields "$(place Pressure)" weight)" = "gas model" ] || complain "the gas model of the file is not used"
  [ "$(value source cells) $(value target cells)" = "24192 15120" ] || complain "cells are lost"
  [ "$(value overlap target_partial)" -gt 0 ] || complain "the wings differ, no cell can tell"
  hold "$wrong" "the wing's solution onto the mesh of another wing"
}

# Its zones overlap by 4e-9 of the whole.
naca12() {
  hybrid=$data/pycgns_naca12_hybrid_sol.cgns
  both_ranks "$hybrid" "$hybrid"
  integral Density 260.147664358 1e-8
  integral MomentumX 259.846604905 1e-8
  integral EnergyStagnationDensity 773.151051269 1e-8
  [ -z "$(cgnsdiff -d -t1e-4 "$hybrid" out.cgns 2>&1)" ] || complain "the fields changed"
  hold "$wrong" "prisms and blocks onto themselves"
}

# Meshes without a solution get one from a cube about them.
spheres() {
  echo "1 0 0 -50000  0 1 0 -50000  0 0 1 -50000" >move.txt
  "$tools/make_demo" . 16 >/dev/null || complain "no demo"
  for level in 01 02 04; do
    both_ranks source.cgns "$data/hopr_spheremesh${level}_mixed.cgns" --scale 1e5 --transform move.txt
    [ "$(value overlap target_covered)" = "$(value target cells)" ] || complain "the cube is too small"
    mv out.cgns "$level.cgns"
  done
  hold "$wrong" "a cube onto spheres of three levels"
  for pair in "01 02" "02 04" "04 01" "04 04"; do
    both_ranks "${pair% *}.cgns" "${pair#* }.cgns" --output-solution Moved --limiter barth-jespersen -f Density
    bounded Density
    [ "$(value overlap target_uncovered)" = 0 ] || complain "cells are uncovered"
    hold "$wrong" "level ${pair% *} of the sphere onto level ${pair#* }"
  done
}

# Everything with volume cells takes a field, the rest is refused.
targets() {
  echo "1 0 0 -50000  0 1 0 -50000  0 0 1 -50000" >move.txt
  "$tools/make_demo" . 8 >/dev/null || complain "no demo"
  while read -r name cells; do
    if [ "$cells" = 0 ]; then
      fails 1 5 "$name" source.cgns "$data/$name.cgns" -o out/result.cgns
      hold $? "$name has no volume cells"
      continue
    fi
    works 2 source.cgns "$data/$name.cgns" -o out.cgns --report report.json --scale 1e5 --transform move.txt \
      --output-solution New --on-uncovered fill=0 --fields Density
    [ "$(value target cells)" = "$cells" ] || complain "$(value target cells) cells, want $cells"
    at_most 1e-12 overlap max_closure_error_target
    at_most 1e-14 fields 0 conservation_error
    hold "$wrong" "$name takes a field in $cells cells"
  done <<'LIST'
idwarp_o_mesh_79zones 24416
cgnsutil_717_wl_L2 15120
pycgns_001Disk_T0 2401
cassiopee_sample1_oldNGON 6859
cassiopee_case_hexa_v4 729
maia_U_ATB_45_NGON_v42 460
cgns_vers3310_hexa_sol 2560
cgns_vers3000_hexa20label 2560
cgns_vers3110_hdf5-110_tetra 13761
su2_bend_coarse_mixed 1288
hopr_naca0012_icem_110k 110592
hopr_sphere_agglo_S3_21k 21168
msh2cgns_mandel_mixed 23566
adflow_nozzle_iblank_surf 0
cassiopee_naca_IBMO_overset 0
su2_flamelet_medium_2d 0
msh2cgns_9v_6e_transient_sol 0
msh2cgns_cubic_MIXED_v41 0
msh2cgns_quadratic_QUAD9_v41 0
LIST
}

case $5 in
  sqnz | adflow | other_wing | naca12 | spheres | targets) "$5" ;;
  *) hold 1 "$5 is a case" ;;
esac
finish
