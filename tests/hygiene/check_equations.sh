#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Every "printed eq. N" of sources and documents is a row of docs/equations.md.
set -eu
table=docs/equations.md

rows=$(sed -n 's/^| *\([0-9][0-9]*\) *|.*/\1/p' "$table")
if [ -z "$rows" ]; then
  echo "$table: expected table rows beginning with '| N |', found none"
  exit 1
fi

# "printed eqs. 6, 24" and "printed 17, 20–23" alike; the dash of a range is a hyphen or an en dash.
grep -rnoE '[Pp]rinted (eqs?\.? )?[0-9]+((, ?| and | to |-|–)[0-9]+)*' \
  include src apps tests docs --include='*.h' --include='*.cpp' --include='*.md' |
  awk -v rows="$rows" -v table="$table" '
    BEGIN { n = split(rows, list, "\n"); for (i = 1; i <= n; ++i) known[list[i]] = 1 }
    {
      split($0, part, ":")
      text = substr($0, length(part[1]) + length(part[2]) + 3)
      while (match(text, /[0-9]+/)) {
        number = substr(text, RSTART, RLENGTH)
        text = substr(text, RSTART + RLENGTH)
        if (!(number in known)) {
          print part[1] ":" part[2] ": names printed equation " number ", which has no row in " table
          bad = 1
        }
      }
      ++references
    }
    END {
      if (references == 0) { print "no source names an equation: the pattern of this check is wrong"; bad = 1 }
      exit bad
    }'
