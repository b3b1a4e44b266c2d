#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Files that comments and documents name exist: NAME.h, NAME.cpp and NAME.sh, with or without folders in front, where NAME
# is no word in capitals, which stands for others. Studies that they name, sar_bench STUDY, are subcommands of it.
set -eu

# Of other projects.
theirs=concurrent_hash_map.h

present=$(find include src apps tests scripts cmake data docs -type f \( -name '*.h' -o -name '*.cpp' -o -name '*.sh' \))

studies=$(cat apps/sar_bench/*.cpp | tr -d '\n' |
  grep -oE 'add_subcommand\( *"[a-z]+"' | sed 's/.*"\(.*\)"/\1/')

# file:line:text of comments, and of every line of documents.
{
  grep -rnoE '//.*' include src apps tests --include='*.h' --include='*.cpp' || true
  grep -rnoE '^ *#[^!i].*' scripts tests --include='*.sh' --include='CMakeLists.txt' || true
  grep -nE '.' /dev/null ./*.md $(find docs -name '*.md') || true
} | awk -v present="$present" -v theirs="$theirs" -v studies="$studies" '
  BEGIN {
    n = split(present, files, "\n")
    for (i = 1; i <= n; ++i) {
      # A path, and all that is left of it when folders are taken away in front.
      for (rest = files[i]; rest != ""; rest = substr(rest, slash + 1)) {
        known[rest] = 1
        slash = index(rest, "/")
        if (slash == 0) break
      }
    }
    known[theirs] = 1
    n = split(studies, list, "\n")
    for (i = 1; i <= n; ++i) study[list[i]] = 1
  }
  {
    split($0, part, ":")
    text = substr($0, length(part[1]) + length(part[2]) + 3)
    for (rest = text; match(rest, /sar_bench [a-z]+/); rest = substr(rest, RSTART + RLENGTH)) {
      name = substr(rest, RSTART + 10, RLENGTH - 10)
      if (!(name in study)) { print part[1] ":" part[2] ": names sar_bench " name ", which is no study"; bad = 1 }
    }
    while (match(text, /[A-Za-z0-9_.\/-]*[A-Za-z0-9_]\.(h|cpp|sh)([^A-Za-z0-9_]|$)/)) {
      name = substr(text, RSTART, RLENGTH)
      text = substr(text, RSTART + RLENGTH)
      sub(/[^A-Za-z0-9_]$/, "", name)
      sub(/^.*\.\.\//, "", name)
      sub(/^\.?\//, "", name)
      base = name
      sub(/^.*\//, "", base)
      if (base ~ /^[A-Z]+\./) continue
      if (!(name in known)) { print part[1] ":" part[2] ": names " name ", which does not exist"; bad = 1 }
      ++names
    }
  }
  END {
    if (names == 0) { print "nothing names a file: the pattern of this check is wrong"; bad = 1 }
    exit bad
  }'
