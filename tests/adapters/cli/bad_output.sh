#!/bin/sh
# What cannot be chosen, computed or written ends the command like broken files do: see bad_files.sh. See cli.sh for the
# arguments.
# shellcheck source-path=SCRIPTDIR source=cli.sh
. "$(dirname "$0")/cli.sh"
cd "$work" || exit 1
echo "1 0 0 0  0 1 0 0  0 0 1" >eleven.txt
echo "1 0 0 0  0 1 0 0  0 0 one 0" >word.txt
mkdir shut
chmod a-w shut
closed=shut
[ "$(id -u)" != 0 ] || closed=/proc # where even root creates no files

refused 2 "two_solutions.cgns.*FlowSolution, Other" "of two solutions one must be chosen" \
  two_solutions.cgns mesh.cgns -o out/result.cgns
refused 2 "good.cgns.*Density" "a field that is not there is refused, with a list" \
  good.cgns mesh.cgns -o out/result.cgns -f Density,Vorticity
refused 2 "good.cgns.*Missing" "a solution that is not there is refused" \
  good.cgns mesh.cgns -o out/result.cgns --solution Missing
refused 2 "good.cgns" "a time step that is not there is refused" good.cgns mesh.cgns -o out/result.cgns --step 3
refused 2 "good.cgns.*Nowhere" "a base that is not there is refused" \
  good.cgns mesh.cgns -o out/result.cgns --source-base Nowhere
refused 3 far.cgns "meshes that do not meet are refused" good.cgns far.cgns -o out/result.cgns
refused 3 "half.cgns.*cell" "uncovered cells are refused if asked" good.cgns half.cgns -o out/result.cgns --on-uncovered error
refused 3 "half.cgns.*cell" "partly covered cells are refused if asked" \
  good.cgns half.cgns -o out/result.cgns --on-partial error
refused 4 "wide.cgns.*Density.*bow_tie.cgns: zone Base/Zone: cell 1 .*inside out" \
  "a result that is not conservative is not written, and the cell to blame is named" wide.cgns bow_tie.cgns -o out/result.cgns
run 2 wide.cgns bow_tie.cgns -o out/result.cgns --report report.json
[ "$code" = 4 ] && grep -q "bow_tie.cgns: zone Base/Zone: cell 1 .*inside out" report.json
hold $? "so does the report"
refused 5 absent.txt "a missing transform is named" good.cgns mesh.cgns -o out/result.cgns --transform absent.txt
refused 5 eleven.txt "a transform of 11 numbers is refused" good.cgns mesh.cgns -o out/result.cgns --transform eleven.txt
refused 5 word.txt "a transform with a word in it is refused" good.cgns mesh.cgns -o out/result.cgns --transform word.txt

refused 5 "out/absent/result.cgns" "a folder that is not there takes no OUTPUT" good.cgns mesh.cgns -o out/absent/result.cgns
refused 5 "$closed/result.cgns" "a folder that may not be written takes no OUTPUT" good.cgns mesh.cgns -o "$closed/result.cgns"
refused 5 "/dev/full" "a device is no OUTPUT" good.cgns mesh.cgns -o /dev/full
echo keep >locked.cgns
chmod a-w locked.cgns
refused 5 "locked.cgns.*may not be written" "an OUTPUT that nobody may write is left alone" good.cgns mesh.cgns -o locked.cgns
rm -f locked.cgns
ln -s absent/nowhere.cgns lost.cgns
refused 5 "lost.cgns" "a link that leads nowhere is no OUTPUT" good.cgns mesh.cgns -o lost.cgns
rm lost.cgns
mkdir elsewhere
echo old >elsewhere/real.cgns
ln -s ../elsewhere/real.cgns out/link.cgns
works 1 good.cgns mesh.cgns -o out/link.cgns
[ -L out/link.cgns ] || complain "the link is gone"
[ "$(head -c 3 elsewhere/real.cgns)" != old ] || complain "what it links to is as it was"
[ "$(ls elsewhere)" = real.cgns ] || complain "something is left beside it"
hold "$wrong" "a link stays, and what it links to becomes OUTPUT"
rm -rf out/link.cgns elsewhere
run 1 good.cgns mesh.cgns -o out/whole.cgns --report /dev/full
[ "$code" = 5 ] || complain "exit status $code"
grep -q "/dev/full.*out/whole.cgns is written and complete" "$work/stderr" || complain "$(cat "$work/stderr")"
[ -s out/whole.cgns ] || complain "OUTPUT is not there"
hold "$wrong" "a report that fails at the end is told, and that OUTPUT is there"
rm -f out/whole.cgns
refused 2 "good.cgns" "OUTPUT must not be SOURCE" good.cgns mesh.cgns -o good.cgns
refused 2 "mesh.cgns" "OUTPUT must not be TARGET" good.cgns mesh.cgns -o ./mesh.cgns
refused 5 "$closed/report.json" "a report that cannot be written is told first" \
  good.cgns mesh.cgns --report "$closed/report.json" -o out/result.cgns
refused 2 "good.cgns" "the report must not be SOURCE" good.cgns mesh.cgns --report good.cgns -o out/result.cgns
refused 2 "result.cgns" "the report must not be OUTPUT" good.cgns mesh.cgns --report ./out/result.cgns -o out/result.cgns

# A full disk, as far as everybody can have one: a limit on the size of files.
cat >small_disk <<'S'
#!/bin/sh
ulimit -f 8
exec "$@"
S
chmod +x small_disk
wrapper=./small_disk
OMPI_MCA_btl=self,tcp # the shared-memory transport needs larger files
export OMPI_MCA_btl
refused 5 "result.cgns" "a full disk is told, and nothing is half written" good.cgns mesh.cgns -o out/result.cgns
finish
