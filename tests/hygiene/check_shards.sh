#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# A file is a story, not a function: under a tenth of the source files have fewer than 60 lines.
set -eu

wc -l $(find include src apps -type f \( -name '*.h' -o -name '*.cpp' \) | sort) | awk '
  $2 == "total" { next }
  { ++files }
  $1 < 60 { short[++shards] = $2 ": " $1 " lines" }
  END {
    if (files == 0) { print "no source files: the pattern of this check is wrong"; exit 1 }
    if (10 * shards < files) exit 0
    for (i = 1; i <= shards; ++i) print short[i]
    print shards " of " files " source files have fewer than 60 lines, at most a tenth may: tell what belongs together in one file"
    exit 1
  }'
