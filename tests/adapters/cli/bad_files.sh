#!/bin/sh
# Broken files end the command within seconds, on any number of ranks, with the right exit status and one line that names
# the file; nothing is left behind and nothing is lost. See cli.sh for the arguments.
# shellcheck source-path=SCRIPTDIR source=cli.sh
. "$(dirname "$0")/cli.sh"
cd "$work" || exit 1
head -c 9000 good.cgns >cut_off.cgns
echo "no mesh at all" >text.cgns
: >empty.cgns
for place in 96 1504; do # of the root, and of the first node below it
  cp good.cgns "damaged$place.cgns"
  head -c 16 /dev/zero | tr '\0' '\377' | dd of="damaged$place.cgns" bs=1 seek="$place" conv=notrunc 2>dd.log
done

refused 5 absent.cgns "a missing source is named" absent.cgns mesh.cgns -o out/result.cgns
refused 5 absent.cgns "a missing target is named" good.cgns absent.cgns -o out/result.cgns
refused 5 cut_off.cgns "a truncated file is refused" cut_off.cgns mesh.cgns -o out/result.cgns
refused 5 cut_off.cgns "a truncated target is refused" good.cgns cut_off.cgns -o out/result.cgns
refused 5 damaged96.cgns "a file without a root is refused" good.cgns damaged96.cgns -o out/result.cgns
refused 5 damaged1504.cgns "a file that is damaged within is refused" damaged1504.cgns mesh.cgns -o out/result.cgns
refused 5 text.cgns "a file that is not CGNS is refused" text.cgns mesh.cgns -o out/result.cgns
refused 5 empty.cgns "an empty file is refused" good.cgns empty.cgns -o out/result.cgns
refused 5 out: "a folder is no CGNS file" out mesh.cgns -o out/result.cgns
refused 5 no_volume.cgns "a mesh without volume cells is refused" good.cgns no_volume.cgns -o out/result.cgns
refused 5 no_coordinates.cgns "missing coordinates are refused" no_coordinates.cgns mesh.cgns -o out/result.cgns
refused 6 "nan_coordinate.cgns.*Zone" "a coordinate that is NaN is refused" nan_coordinate.cgns mesh.cgns -o out/result.cgns
refused 6 "far_node.cgns.*Zone.*cell 8" "a node number out of range is refused" good.cgns far_node.cgns -o out/result.cgns
refused 6 "volumes" "a unit in which volumes are no numbers is refused" good.cgns mesh.cgns --scale 1e308 -o out/result.cgns
refused 3 "units" "a mesh too small to have volumes beside the other is refused" \
  good.cgns mesh.cgns --scale 1e-40 -o out/result.cgns
refused 6 "open_cell.cgns.*Zone.*cell 1" "an open cell is refused" good.cgns open_cell.cgns -o out/result.cgns
refused 6 "three_cells.cgns.*Zone.*face 1" "a face of three cells is refused" good.cgns three_cells.cgns -o out/result.cgns
refused 6 "zones_overlap.cgns.*Zone.*Second.*priority.*mask" "zones that overlap are named, and what to do" \
  good.cgns zones_overlap.cgns -o out/result.cgns
refused 5 "short_field.cgns.*Zone.*Density" "a field of the wrong size is refused" short_field.cgns mesh.cgns -o out/result.cgns
refused 5 "nan_field.cgns.*Zone.*cell 3.*MomentumX" "a value that is NaN is refused" nan_field.cgns mesh.cgns -o out/result.cgns
refused 5 "at_vertices.cgns.*Vertex.*Density" "fields at vertices are refused by name" \
  at_vertices.cgns mesh.cgns -o out/result.cgns
refused 2 "at_vertices.cgns.*Zone.*Vertex" "a target with vertex values in the output's solution is refused" \
  good.cgns at_vertices.cgns -o out/result.cgns
refused 5 mesh.cgns "a source without fields is refused" mesh.cgns good.cgns -o out/result.cgns
finish
