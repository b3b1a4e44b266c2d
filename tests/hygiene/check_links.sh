#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# check_links.sh PROGRAM...: the simulator's programs load no LibTorch, neither directly nor through
# another library: it costs half a second at each start.
set -eu
bad=0
for program in "$@"; do
  direct=$(readelf -d "$program" | sed -n 's/.*(NEEDED).*\[\(.*\)\].*/\1/p')
  all=$(ldd "$program")
  if echo "$all" | grep 'not found'; then
    echo "$program: the libraries above are missing"
    bad=1
  fi
  if printf '%s\n%s\n' "$direct" "$all" | grep -E 'lib(torch|c10)'; then
    echo "$program: links LibTorch (above); only nerf, bake and their programs may"
    bad=1
  fi
done
exit $bad
