#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Whether a change of the code left everything that the programs write as it was: runs the commands of
# scripts/same_outputs.list with one build and with another, and compares the files.
set -eu

usage() {
  cat <<EOF
Usage: scripts/same_outputs.sh make FOLDER             run the list's commands, with one thread, and keep what they write
       scripts/same_outputs.sh compare BEFORE AFTER    name every file that differs; exits 1 when one does

SARNERF_PROGRAMS  folder with the programs' folders; default build/release/apps
SARNERF_MSTAR     folder with measured chips; without it, commands that need them are left out
Times, memory and revisions in reports are not compared, nor checkpoints, metrics.jsonl and
report.html of runs, which depend on the clock; the models that were learned are. Both folders must come from one machine: LibTorch
chooses its code by the processor.
EOF
}

here=$(cd "$(dirname "$0")/.." && pwd)
programs=$(cd "${SARNERF_PROGRAMS:-$here/build/release/apps}" && pwd)

make_outputs() {
  [ ! -e "$1" ] || { echo "same_outputs: $1 exists; name a new folder" >&2; exit 2; }
  # Recipes and models name folders: all outputs are made in the same one, then moved.
  work=${TMPDIR:-/tmp}/sarnerf_same_outputs
  rm -rf "$work"
  mkdir -p "$work"
  folder=$(cd "$(dirname "$1")" && pwd)/$(basename "$1")
  cd "$work"
  number=0
  grep -v '^ *\(#\|$\)' "$here/scripts/same_outputs.list" | while read -r program arguments; do
    number=$((number + 1))
    case $arguments in *'$MSTAR'*|*chips*) [ -n "${SARNERF_MSTAR-}" ] || continue ;; esac
    arguments=$(printf '%s' "$arguments" | sed "s|@/|$here/data/|g; s|\$MSTAR|${SARNERF_MSTAR-}|g")
    log=$(printf 'printed/%02d_%s.txt' "$number" "$program")
    mkdir -p printed
    # Words are split here: no argument of the list has a space.
    # shellcheck disable=SC2086
    if "$programs/$program/$program" $arguments --threads 1 -q > "$log" 2>&1 < /dev/null; then code=0; else code=$?; fi
    echo "exit $code" >> "$log"
    [ "$code" = 0 ] || echo "same_outputs: exit $code: $program $arguments" >&2
  done
  cd /
  mv "$work" "$folder"
}

# A text without what differs from run to run: seconds, bytes, revisions, folders, sums over reports.
calm() {
  sed -E -e "s|$here|HERE|g" \
    -e 's/("[A-Za-z0-9_ ]*(seconds|_s|_ns|per_second|time|times|bytes|revision|created|processor|memory|at_s|elapsed)[A-Za-z0-9_ ]*": *)("[^"]*"|[-+0-9.e]+)/\1X/g' \
    -e 's/[0-9.]+( ?(s|ms|min|minutes|seconds|MiB|GiB|MB|GB|KB|kB))([^a-z]|$)/X\1\3/g' \
    -e 's/[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9:.Z+-]+/DATE/g' "$1" |
    awk '/"(seconds|memory_bytes|memory|times)": \{/ { within = 1 }
      within { gsub(/[-+0-9.e]+/, "X") }
      /\}/ { within = 0 }
      { print }'
}

compare_outputs() {
  bad=0
  n=0
  for file in $( (cd "$1" && find . -type f; cd "$2" && find . -type f) | sort -u); do
    n=$((n + 1))
    if [ ! -f "$1/$file" ] || [ ! -f "$2/$file" ]; then
      echo "only one has $file"; bad=1
    elif ! cmp -s "$1/$file" "$2/$file"; then
      case $file in
        # These hold seconds, or lines whose steps the clock chose; model.pt holds what was learned.
        */latest.pt|*/report.html|*/metrics.jsonl) ;;
        *.json|*.jsonl|*.md|*.txt|*.html|*.toml)
          calm "$1/$file" > "$scratch/before"
          calm "$2/$file" > "$scratch/after"
          cmp -s "$scratch/before" "$scratch/after" || { echo "differs: $file"; bad=1; } ;;
        *) echo "differs: $file"; bad=1 ;;
      esac
    fi
  done
  echo "same_outputs: $n files compared"
  return $bad
}

case ${1-} in
  make) [ $# = 2 ] || { usage >&2; exit 2; }; make_outputs "$2" ;;
  compare)
    [ $# = 3 ] || { usage >&2; exit 2; }
    scratch=$(mktemp -d)
    trap 'rm -rf "$scratch"' EXIT
    compare_outputs "$2" "$3" ;;
  -h|--help) usage ;;
  *) usage >&2; exit 2 ;;
esac
