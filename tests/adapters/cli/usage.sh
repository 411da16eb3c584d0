#!/bin/sh
# The command line: what is offered, what is refused, what is silent. See cli.sh for the arguments.
# shellcheck source-path=SCRIPTDIR source=cli.sh
. "$(dirname "$0")/cli.sh"
cd "$work" || exit 1

# wrong_usage SENTENCE WORD ARGUMENT...: exit status 2 and one line that holds the word.
wrong_usage() {
  sentence=$1
  says=$2
  shift 2
  fails 2 2 "$says" "$@"
  hold $? "$sentence"
}
# quick SENTENCE WORD ARGUMENT...: the same on one rank.
quick() {
  sentence=$1
  says=$2
  shift 2
  fails 1 2 "$says" "$@"
  hold $? "$sentence"
}

wrong_usage "an unknown option is named" "'--frobnicate'" good.cgns mesh.cgns -o out/result.cgns --frobnicate
wrong_usage "files are needed" SOURCE
quick "an unknown letter is named" "'-z'" good.cgns mesh.cgns -o out/result.cgns -z
quick "one file is not enough" TARGET good.cgns -o out/result.cgns
quick "three files are too many" "'far.cgns'" good.cgns mesh.cgns far.cgns -o out/result.cgns
quick "a file to write is needed" OUTPUT good.cgns mesh.cgns
quick "an option without its argument is named" "'-o'" good.cgns mesh.cgns -o
quick "an empty name is no file" empty "" mesh.cgns -o out/result.cgns
quick "an empty argument is refused" "solution" good.cgns mesh.cgns -o out/result.cgns --solution ""
quick "a flag takes no argument" "quiet" good.cgns mesh.cgns -o out/result.cgns --quiet=1
quick "a scale of 0 is refused" "--scale" good.cgns mesh.cgns -o out/result.cgns --scale 0
quick "a scale is a number" "--scale" good.cgns mesh.cgns -o out/result.cgns --scale 2x
quick "a ratio of specific heats is above 1" "--gamma: '1'" good.cgns mesh.cgns -o out/result.cgns --gamma 1
quick "a step is a number or last" "--step" good.cgns mesh.cgns -o out/result.cgns --step first
quick "a step counts from 1" "--step" good.cgns mesh.cgns -o out/result.cgns --step 0
quick "a nature is one of four" "'Density=heavy'" good.cgns mesh.cgns -o out/result.cgns --nature Density=heavy
quick "a nature needs a name" "'conserved'" good.cgns mesh.cgns -o out/result.cgns --nature conserved
quick "a nature is of a field" "no field 'Depth'" good.cgns mesh.cgns -o out/result.cgns --nature Tracer=conserved,Depth=flag
quick "a value to fill with is a number" "fill=VALUE" good.cgns mesh.cgns -o out/result.cgns --on-uncovered fill=x
quick "solution and step exclude each other" "--step" good.cgns mesh.cgns -o out/result.cgns --step 1 --solution FlowSolution
for option in location=face order=4 order=two limiter=vanleer faces=center on-uncovered=blend on-partial=keep; do
  quick "--$option is not offered" "--${option%=*}: '${option#*=}'" good.cgns mesh.cgns -o out/result.cgns "--$option"
done
quick "--cgns-version is not offered" "'--cgns-version'" good.cgns mesh.cgns -o out/result.cgns --cgns-version 4

works 1 --help
for option in fields nature order limiter faces on-uncovered on-partial location solution step output-solution source-base \
  target-base scale transform priority source-volume target-volume gamma allow-nan keep-vectors check supermesh min-coverage \
  coverage source-coverage source-mask target-mask report output quiet verbose version help; do
  grep -q -e "--$option" stdout || complain "--help does not say --$option"
done
[ "$(awk 'length > 128' stdout)" = "" ] || complain "--help is wide"
hold "$wrong" "--help says every option, and no other"
works 2 --version
if ! grep -qx 'remap [0-9]*\.[0-9]*\.[0-9]*' stdout || [ "$(wc -l <stdout)" != 1 ]; then complain "$(cat stdout)"; fi
hold "$wrong" "--version is one line from one rank"

works 2 -q good.cgns mesh.cgns -o out.cgns && [ -s out.cgns ] && [ ! -s stdout ]
hold $? "-q is silent"
works 1 -o out.cgns -- good.cgns mesh.cgns && grep -q "^Density" stdout && grep -q "total [0-9]" stdout
hold $? "options may come first, and end"
works 1 -v good.cgns mesh.cgns -o out.cgns && grep -q "Base/Zone .*64 cells" stdout
hold $? "-v lists zones"
finish
