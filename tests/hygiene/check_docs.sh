#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The README stays short enough to be read, and links between pages lead to files and headings that exist.
set -eu
kMaxLines=200
kMaxCharacters=120
bad=0

# Characters, not bytes: the continuation bytes of UTF-8 are left out.
LC_ALL=C tr -d '\200-\277' < README.md | awk -v lines=$kMaxLines -v most=$kMaxCharacters '
  length($0) > most { print "README.md:" NR ": " length($0) " characters, at most " most; bad = 1 }
  END { if (NR > lines) { print "README.md: " NR " lines, at most " lines ": move details to docs/"; bad = 1 } exit bad }
' || bad=1

# heading FILE: its headings, as links write them.
headings() {
  sed -n 's/^#\{1,\} //p' "$1" | tr '[:upper:]' '[:lower:]' | sed 's/[^[:alnum:] _-]//g; s/ /-/g'
}

for page in ./*.md $(find docs data -name '*.md'); do
  for link in $(grep -oE '\]\([^) ]+\)' "$page" | sed 's/^](//; s/)$//' | sort -u); do
    case $link in *://*) continue ;; esac
    target=${link%%#*}
    if [ -n "$target" ]; then target=$(dirname "$page")/$target; else target=$page; fi
    if [ ! -e "$target" ]; then
      echo "${page#./}: the link $link leads nowhere"
      bad=1
    elif [ "$link" != "${link#*#}" ] && ! headings "$target" | grep -qxF "${link#*#}"; then
      echo "${page#./}: $link: no such heading"
      bad=1
    fi
  done
done

exit $bad
