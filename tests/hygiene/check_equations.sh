#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Every "printed eq. N" of sources and documents is a row of docs/method/equations.md, and every row of that document's tables
# names files that exist.
set -eu
table=docs/method/equations.md
bad=0

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
    }' || bad=1

# "line number, file" of each file that a row names in its last column, "line number" alone where it names none, and
# "line number, ?" for the head of a table whose last column is not "where".
cited=$(awk -F '|' '
  !/^\|/ { head = ""; next }
  head == "" { head = $(NF - 1); if (head !~ /^ *where *$/) print FNR " ?"; next }
  /^\|[-:| ]*$/ { next }
  {
    cell = $(NF - 1)
    found = 0
    while (match(cell, /`[A-Za-z0-9_.\/]+\.(h|cpp|md|sh)`/)) {
      print FNR " " substr(cell, RSTART + 1, RLENGTH - 2)
      cell = substr(cell, RSTART + RLENGTH)
      found = 1
    }
    if (!found) print FNR
  }' "$table")

while read -r line file; do
  case $file in
    '') echo "$table:$line: expected a file in the column \"where\", such as \`mpa/integrate.h\`; found none"; bad=1 ;;
    '?') echo "$table:$line: expected \"where\" as the table's last column"; bad=1 ;;
    *)
      if [ ! -f "$file" ] && [ ! -f "include/sarnerf/$file" ]; then
        echo "$table:$line: names $file, which is neither in the repository nor in include/sarnerf"
        bad=1
      fi ;;
  esac
done <<CITED
$cited
CITED

exit $bad
