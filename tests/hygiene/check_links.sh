#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# check_links.sh PROGRAM...: the simulator's programs load no LibTorch, neither directly nor through
# another library: it costs half a second at each start. Those that learn load nothing of the simulator.
set -eu
bad=0
for program in "$@"; do
  direct=$(readelf -d "$program" | sed -n 's/.*(NEEDED).*\[\(.*\)\].*/\1/p')
  all=$(ldd "$program")
  if echo "$all" | grep 'not found'; then
    echo "$program: the libraries above are missing"
    bad=1
  fi
  if case $(basename "$program") in sar_import | sar_fewshot) false ;; esac && echo "$direct" | grep -E 'lib(matio|csv)'; then
    echo "$program: links the readers of measured images (above); only sar_import and sar_fewshot may"
    bad=1
  fi
  case $(basename "$program") in
    sar_extract) ;;  # takes from one half to the other
    sar_nerf_* | sar_fewshot | sar_recognise)
      # GMP may come with a library of the distribution's, through its codecs; CGAL would need it directly.
      if printf '%s\n%s\n' "$direct" "$all" | grep -E 'lib(embree|openvdb)' || echo "$direct" | grep -E 'lib(gmp|mpfr|CGAL)'; then
        echo "$program: links the simulator's libraries (above); only scene, trace, render and bake may"
        bad=1
      fi
      ;;
    *)
      if printf '%s\n%s\n' "$direct" "$all" | grep -E 'lib(torch|c10)'; then
        echo "$program: links LibTorch (above); only nerf, bake and their programs may"
        bad=1
      fi
      ;;
  esac
done
exit $bad
