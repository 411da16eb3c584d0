# shellcheck shell=sh source-path=SCRIPTDIR source=../cli/cli.sh
# bodies.sh -- what the scripts that test remap-boolean share beyond cli.sh: surfaces to cut with, checks of what is written.
#
#   SCRIPT MPIEXEC NUMPROC_FLAG REMAP_BOOLEAN TOOLS REMAP
. "$(dirname "$0")/../cli/cli.sh"
cd "$work" || exit 1

# cube LOW HIGH NAME: an OBJ file of a cube, its sides in a group of that name, to standard output.
cube() {
  awk -v a="$1" -v b="$2" -v name="$3" 'BEGIN {
    for (i = 0; i < 8; i++) print "v", (i % 2 ? b : a), (int(i / 2) % 2 ? b : a), (i > 3 ? b : a)
    print "g " name "\nf 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 2 4 8 6\nf 4 3 7 8\nf 3 1 5 7" }'
}
cube 0 1 cube >cube.obj
cube .5 1.5 dice >dice.obj
cube .25 .75 core >core.obj
cube 1 2 beside >beside.obj
cube 5 6 away >away.obj

# makes VOLUME ARGUMENT...: the command succeeds, and the result has that volume.
makes() {
  want=$1
  shift
  works 1 "$@" --report report.json
  near "$(value result volume)" "$want" 1e-14
}

# checked FILE...: cgnscheck finds no error, if there is one.
checked() {
  command -v cgnscheck >/dev/null || return 0
  for file in "$@"; do
    cp "$file" stamped.cgns
    "$tools/stamp" stamped.cgns || complain "$file: no CGNS file"
    cgnscheck stamped.cgns >found 2>&1
    ! grep -E 'ERROR' found || complain "$file: cgnscheck complains"
  done
}

# alike ENDING RANKS ARGUMENT...: the same bytes on any of these numbers of ranks, 1 among them.
alike() {
  ending=$1
  numbers=$2
  shift 2
  for n in $numbers; do
    works "$n" -q "$@" -o "on$n.$ending"
    cmp -s on1."$ending" "on$n.$ending" || complain "$ending: other bytes on $n ranks"
  done
}

# area FILE GROUP: the area of the faces of a group of an OBJ file.
area() {
  awk -v want="$2" '
    /^v/ { n++; x[n] = $2; y[n] = $3; z[n] = $4 }
    /^g/ { on = $2 == want }
    /^f/ && on {
      ax = ay = az = 0
      for (i = 3; i < NF; i++) {
        ux = x[$i] - x[$2]; uy = y[$i] - y[$2]; uz = z[$i] - z[$2]
        k = i + 1
        vx = x[$k] - x[$2]; vy = y[$k] - y[$2]; vz = z[$k] - z[$2]
        ax += uy * vz - uz * vy; ay += uz * vx - ux * vz; az += ux * vy - uy * vx
      }
      sum += sqrt(ax * ax + ay * ay + az * az) / 2
    }
    END { printf "%.15g", sum }' "$1"
}
