# shellcheck shell=sh disable=SC2016,SC2086 # $wrapper is several words or none
# cli.sh -- what the scripts that test the remap command share; they source it and end with `finish`.
#
#   SCRIPT MPIEXEC NUMPROC_FLAG REMAP TOOLS
#
# TOOLS is the folder of make_files, json_value and make_demo. Like in rt.h, a check records and goes on.
set -u
mpiexec=$1
numproc_flag=$2
remap=$3
tools=$4
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 1' INT TERM
cases=0
failed=0
wrong=0
"$tools/make_files" "$work" || exit 1
cksum "$work"/*.cgns >"$work/inputs"

# Run the command on $1 ranks with the other arguments: its exit status goes to $code, its output to $work/stdout and what the
# ranks themselves write to standard error, without mpiexec's remarks, to $work/stderr. One rank needs no mpiexec. $wrapper, if
# it is set, starts each rank.
run() {
  ranks=$1
  shift
  : >"$work/stderr"
  : >"$work/mpiexec"
  if [ "$ranks" = 1 ] && [ -z "${wrapper:-}" ]; then
    timeout 100 "$remap" "$@" </dev/null >"$work/stdout" 2>"$work/stderr"
  else
    STDERR=$work/stderr timeout 100 "$mpiexec" "$numproc_flag" "$ranks" sh -c 'exec "$@" 2>>"$STDERR"' sh \
      ${wrapper:-} "$remap" "$@" </dev/null >"$work/stdout" 2>"$work/mpiexec"
  fi
  code=$?
}

# hold STATUS SENTENCE: the sentence is true if the status is 0.
hold() {
  cases=$((cases + 1))
  if [ "$1" = 0 ]; then
    echo "holds  $2"
  else
    echo "FAILS  $2"
    failed=$((failed + 1))
  fi
  wrong=0
}

# complain WHY: a check failed; the next `hold "$wrong"` says what it was for.
complain() {
  echo "# $*"
  wrong=1
}

# fails RANKS CODE WORD ARGUMENT...: the command ends with that exit status within seconds and one line on standard error, which
# holds the word; it leaves no OUTPUT behind and one that is there as it is. OUTPUT is the last argument if it is -o PATH.
fails() {
  ranks=$1
  want=$2
  word=$3
  shift 3
  rm -rf "$work/out"
  mkdir "$work/out"
  [ "$ranks" != 1 ] || echo precious >"$work/out/result.cgns" # on one rank OUTPUT exists already
  run "$ranks" "$@"
  [ "$code" = "$want" ] || complain "exit status $code, want $want"
  [ "$(wc -l <"$work/stderr")" = 1 ] || complain "not one line on standard error"
  grep -q "^remap[a-z-]*: .*$word" "$work/stderr" || complain "standard error does not say '$word'"
  if [ "$ranks" = 1 ]; then
    [ "$(cat "$work/out/result.cgns")" = precious ] || complain "OUTPUT was touched"
    rm -f "$work/out/result.cgns"
  fi
  [ -z "$(ls -A "$work/out")" ] || complain "left behind: $(ls -A "$work/out")"
  [ "$wrong" = 0 ] || sed 's/^/#   /' "$work/stderr" "$work/mpiexec"
  return "$wrong"
}

# refused CODE WORD SENTENCE ARGUMENT...: fails, on one and on two ranks.
refused() {
  status=$1
  says=$2
  sentence=$3
  shift 3
  for n in 1 2; do
    fails "$n" "$status" "$says" "$@"
    hold $? "$sentence (on $n)"
  done
}

# works RANKS ARGUMENT...: the command succeeds and says nothing on standard error.
works() {
  run "$@"
  [ "$code" = 0 ] || complain "exit status $code"
  [ ! -s "$work/stderr" ] || complain "standard error is not empty"
  [ "$wrong" = 0 ] || sed 's/^/#   /' "$work/stderr" "$work/mpiexec"
  return "$wrong"
}

# The value in the report $work/report.json that the keys lead to.
value() { "$tools/json_value" "$work/report.json" "$@"; }

# near A B BY: two numbers agree within BY of the larger one.
near() {
  awk -v a="$1" -v b="$2" -v by="$3" 'function mag(x) { return x < 0 ? -x : x }
    BEGIN { most = mag(a) > mag(b) ? mag(a) : mag(b); exit !(mag(a - b) <= by * most) }' ||
    complain "$1 and $2 differ by more than $3"
}

# Lets the script end.
finish() {
  awk '{ print $3 }' "$work/inputs" | xargs cksum | cmp -s - "$work/inputs"
  hold $? "no input file was changed"
  echo "$((cases - failed)) of $cases cases hold"
  [ "$cases" -gt 0 ] && [ "$failed" = 0 ]
  exit
}
