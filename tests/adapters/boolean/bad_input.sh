#!/bin/sh
# What is broken, empty or cannot be written ends remap-boolean with one line, on one rank and on two. See bodies.sh.
# shellcheck source-path=SCRIPTDIR source=bodies.sh
. "$(dirname "$0")/bodies.sh"
grep -v '^f 3 1 5 7' dice.obj >open.obj
{ cat dice.obj; echo "f 1 3 4 2"; } >thick.obj
{ cube 0 1 a; cube .5 1.5 b | awk '/^f/ { for (i = 2; i < 6; i++) $i += 8 } { print }'; } >cross.obj
printf "solid a\nfacet normal 0 0 1 outer loop vertex 0 0 0" >short.stl
head -c 200 /dev/zero >zeros.stl
echo "v 0 0 nan" >nan.obj
# alone CODE WORD SENTENCE ARGUMENT...: fails, on one rank.
alone() {
  status=$1
  says=$2
  sentence=$3
  shift 3
  fails 1 "$status" "$says" "$@"
  hold $? "$sentence"
}
mkdir shut
chmod a-w shut
closed=shut
[ "$(id -u)" != 0 ] || closed=/proc # where even root creates no files

refused 5 absent.obj "a file that is not there is named" union cube.obj absent.obj -o out/result.cgns
alone 5 absent.cgns "so is a CGNS file" union absent.cgns cube.obj -o out/result.cgns
alone 5 "short.stl.*line 2.*truncated" "a truncated STL file is refused with its line" \
  union cube.obj short.stl -o out/result.cgns
alone 5 "nan.obj.*line 1" "numbers must be finite" union nan.obj cube.obj -o out/result.cgns
refused 6 "open.obj.*4 edges.*(.* .* .*)-(" "an open surface is refused with its edges" \
  union open.obj cube.obj -o out/result.cgns
alone 6 "thick.obj.*more than two faces" "an edge of three faces is refused" union cube.obj thick.obj -o out/result.cgns
alone 6 "cross.obj.*crosses itself" "a surface that crosses itself is refused" union cube.obj cross.obj -o out/result.cgns
refused 6 "open_cell.cgns" "a cell that is open is refused" union open_cell.cgns cube.obj -o out/result.cgns
alone 5 "no_volume.cgns" "a mesh without cells is refused" union no_volume.cgns cube.obj -o out/result.cgns
refused 3 "cube.obj and away.obj has no cells" "an empty result is told" intersection cube.obj away.obj -o out/result.cgns
alone 3 "no cells" "a body without itself is empty" difference good.cgns good.cgns -o out/result.vtu
alone 3 "no cells" "bodies that share one corner do not intersect" intersection cube.obj beside.obj -o out/result.obj
alone 5 "out/absent/result.cgns" "a folder that is not there takes no OUT" union cube.obj dice.obj -o out/absent/result.cgns
echo precious >kept.vtu
chmod a-w kept.vtu
alone 5 "kept.vtu.*may not be written" "an OUT without write permission is left alone" union cube.obj dice.obj -o kept.vtu
[ "$(cat kept.vtu)" = precious ] || complain "kept.vtu was touched"
hold "$wrong" "it holds what it held"
alone 5 "$closed/result.vtu" "a folder that may not be written takes no OUT" union cube.obj dice.obj -o "$closed/result.vtu"
refused 5 "$closed/report.json" "a report that cannot be written is told first" \
  union cube.obj dice.obj --report "$closed/report.json" -o out/result.cgns
alone 2 "two_solutions.cgns.*FlowSolution, Other" "of two solutions one must be chosen" \
  union two_solutions.cgns cube.obj -o out/result.cgns

# A full disk, as far as everybody can have one: a limit on the size of files.
cat >small_disk <<'S'
#!/bin/sh
ulimit -f 4
exec "$@"
S
chmod +x small_disk
wrapper=./small_disk
OMPI_MCA_btl=self,tcp # the shared-memory transport needs larger files
export OMPI_MCA_btl
for ending in cgns vtu stl; do
  refused 5 "result.$ending" "a full disk is told, and nothing is half written as $ending" \
    union good.cgns half.cgns -o "out/result.$ending"
done
finish
