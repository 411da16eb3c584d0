#!/bin/sh
# Memory that runs out on one rank ends the command on all of them. See cli.sh for the first arguments; the last is
# no_memory.so.
# shellcheck source-path=SCRIPTDIR source=cli.sh
. "$(dirname "$0")/cli.sh"
no_memory=$5
cd "$work" || exit 1
"$tools/make_demo" . 12 >/dev/null || exit 1
cat >short_of_memory <<S
#!/bin/sh
[ "\$((OMPI_COMM_WORLD_RANK + 1))" != "\$OMPI_COMM_WORLD_SIZE" ] || LD_PRELOAD=$no_memory
export LD_PRELOAD
exec "\$@"
S
chmod +x short_of_memory
wrapper=./short_of_memory
refused 7 "source.cgns.*memory" "a rank without memory ends all ranks" source.cgns target.cgns -o out/result.cgns
finish
