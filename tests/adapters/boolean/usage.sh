#!/bin/sh
# The command line of remap-boolean: what is offered, what is refused, what is silent. See bodies.sh for the arguments.
# shellcheck source-path=SCRIPTDIR source=bodies.sh
. "$(dirname "$0")/bodies.sh"

# wrong_usage SENTENCE WORD ARGUMENT...: exit status 2 and one line that holds the word.
wrong_usage() {
  sentence=$1
  says=$2
  shift 2
  fails 1 2 "$says" "$@"
  hold $? "$sentence"
}
wrong_usage "an unknown option is named" "'--frobnicate'" union cube.obj dice.obj -o out/result.cgns --frobnicate
wrong_usage "words are needed" OPERATION
wrong_usage "two files are needed" "two files" union cube.obj -o out/result.cgns
wrong_usage "three files are too many" "'away.obj'" union cube.obj dice.obj away.obj -o out/result.cgns
wrong_usage "a file to write is needed" OUT union cube.obj dice.obj
wrong_usage "an operation is one of five" "'minus' is no operation" minus cube.obj dice.obj -o out/result.cgns
wrong_usage "the ending of OUT says its format" "result.ply" union cube.obj dice.obj -o out/result.ply
wrong_usage "a scale is positive" "--scale" union cube.obj dice.obj -o out/result.cgns --scale -1
wrong_usage "faces are of two kinds" "--faces" union cube.obj dice.obj -o out/result.cgns --faces round
wrong_usage "an empty argument is refused" "empty" union cube.obj dice.obj -o out/result.cgns --fields ""
wrong_usage "OUT must not be A" "cube.obj" union cube.obj dice.obj -o ./cube.obj
wrong_usage "OUT must not be B" "dice.obj" union cube.obj dice.obj -o dice.obj
wrong_usage "the report must not be OUT" "result.cgns" union cube.obj dice.obj --report out/result.cgns -o out/result.cgns
wrong_usage "a solution that nobody has is told" "Missing" imprint good.cgns dice.obj --solution Missing -o out/result.cgns
wrong_usage "a field that nobody has is told" "Vorticity" imprint good.cgns dice.obj -f Vorticity -o out/result.cgns

works 1 --help
for word in intersection union difference rdifference imprint --output --fields --solution --faces --aggregate --split \
  --a-base --b-base --scale --report --quiet --verbose --version --help; do
  grep -q -e "$word" stdout || complain "--help does not say $word"
done
[ "$(awk 'length > 128' stdout)" = "" ] || complain "--help is wide"
hold "$wrong" "--help says every operation and option"
works 2 --version
grep -qx 'remap-boolean [0-9]*\.[0-9]*\.[0-9]*' stdout || complain "$(cat stdout)"
hold "$wrong" "--version is one line from one rank"
works 2 -q union cube.obj dice.obj -o out.cgns && [ -s out.cgns ] && [ ! -s stdout ]
hold $? "-q is silent"
works 1 -v union good.cgns dice.obj -o out.cgns && grep -q "^boundary  *dice" stdout && grep -q "^in_both" stdout
hold $? "-v lists boundaries"
finish
