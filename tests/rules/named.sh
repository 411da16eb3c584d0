#!/bin/sh
# named.sh TESTS NAMED -- every file tests/**/test_*.c, bench_*.c or fuzz_*.c is named by a remap_test(), remap_bench() or
# remap_fuzz(); NAMED lists those that are.
set -eu
tests=$1
named=$2
status=0
files=$(cd "$tests" && find . -name 'test_*.c' -o -name 'bench_*.c' -o -name 'fuzz_*.c' | sed 's|^\./||' | sort)
for file in $files; do
  grep -qxF "$file" "$named" || { echo "no remap_test(), remap_bench() or remap_fuzz() names tests/$file"; status=1; }
done
echo "$(echo "$files" | wc -l) test files"
exit $status
