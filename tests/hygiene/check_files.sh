#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Short files, a licence line in each source, no path of one particular machine.
set -eu
kMaxLines=450
bad=0

offence() {
  echo "$1"
  bad=1
}

ours() { find include src apps tests scripts cmake .ci data docs -type f "$@" | sort; }

for file in $(ours -name '*.h' -o -name '*.cpp' -o -name '*.sh' -o -name '*.cmake' -o -name CMakeLists.txt); do
  lines=$(wc -l < "$file")
  [ "$lines" -le $kMaxLines ] || offence "$file: $lines lines, at most $kMaxLines: split it by concept"
  case $file in
    *.h | *.cpp) top=1 ;;
    *.sh) top=2 ;;
    *) continue ;;
  esac
  sed -n "${top}p" "$file" | grep -q 'SPDX-License-Identifier: Apache-2.0' ||
    offence "$file:$top: expected the line 'SPDX-License-Identifier: Apache-2.0'"
done

# An absolute path below these exists on one machine only. Scenes and pictures are data, not text.
found=$(grep -nIE '(^|[^[:alnum:]_./$}-])/(home|root|tmp|work|mnt|Users)/[[:alnum:]]' \
  $(ours -not -path 'data/*' -not -name '*.png') ./*.md CMakeLists.txt CMakePresets.json || true)
[ -z "$found" ] || offence "paths of one machine:
$found"

exit $bad
