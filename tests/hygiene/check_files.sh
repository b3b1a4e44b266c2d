#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Files that can be read in one go, a licence line in each source, no path of one particular machine.
set -eu
kMaxLines=700
bad=0

offence() {
  echo "$1"
  bad=1
}

ours() { find include src apps tests scripts cmake .ci data docs -type f "$@" | sort; }

awk -v most=$kMaxLines '
  function finish() {
    if (lines > most) { print file ": " lines " lines, at most " most ": split it by concept"; bad = 1 }
  }
  FNR == 1 {
    finish()
    file = FILENAME
    top = file ~ /\.(h|cpp)$/ ? 1 : file ~ /\.sh$/ ? 2 : 0
  }
  { lines = FNR }
  FNR == top && !/SPDX-License-Identifier: Apache-2\.0/ {
    print file ":" top ": expected the line \"SPDX-License-Identifier: Apache-2.0\""
    bad = 1
  }
  END { finish(); exit bad }
' $(ours -name '*.h' -o -name '*.cpp' -o -name '*.sh' -o -name '*.cmake' -o -name CMakeLists.txt) || bad=1

# An absolute path below these exists on one machine only. Scenes and pictures are data, not text.
found=$(grep -nIE '(^|[^[:alnum:]_./$}-])/(home|root|tmp|work|mnt|Users)/[[:alnum:]]' \
  $(ours -not -path 'data/*' -not -name '*.png') ./*.md CMakeLists.txt CMakePresets.json || true)
[ -z "$found" ] || offence "paths of one machine:
$found"

exit $bad
