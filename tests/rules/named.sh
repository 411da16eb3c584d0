#!/bin/sh
# named.sh TESTS NAMED -- every file tests/**/test_*.c or bench_*.c is named by a remap_test() or remap_bench(); NAMED lists
# those that are.
set -eu
tests=$1
named=$2
status=0
files=$(cd "$tests" && find . -name 'test_*.c' -o -name 'bench_*.c' | sed 's|^\./||' | sort)
for file in $files; do
  grep -qxF "$file" "$named" || { echo "no remap_test() or remap_bench() names tests/$file"; status=1; }
done
echo "$(echo "$files" | wc -l) test files"
exit $status
