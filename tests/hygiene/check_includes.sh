#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Modules include only modules that docs/design.md puts above them, rooms of a module only rooms above them, and the headers of
# the sampling core no third-party library but GLM.
set -eu
bad=0

# Everything a module may use, directly or not, itself excluded.
allowed() {
  case $1 in
    core) ;;
    geometry | field) echo core ;;
    formation) echo core geometry ;;
    recognise) echo core ;;
    mpa) echo core geometry field ;;
    dataset) echo core geometry ;;
    evaluation) echo core geometry dataset ;;
    report) echo core geometry dataset ;;
    scene) echo core geometry field ;;
    trace) echo core geometry field mpa ;;
    render) echo core geometry field mpa scene trace ;;
    nerf) echo core geometry field mpa dataset ;;
    bake) echo core geometry field mpa dataset nerf scene trace ;;
    *) return 1 ;;
  esac
}

# file:line:module of each include of one of our headers.
our_includes() {
  grep -rnE '^ *# *include *["<]sarnerf/' "$@" --include='*.h' --include='*.cpp' |
    sed -E 's|^([^:]*:[0-9]+):.*sarnerf/([a-z_]+)/.*|\1:\2|'
}

for module in $(ls include/sarnerf src | grep -vE ':|\.|^$' | sort -u); do
  if ! layers=$(allowed "$module"); then
    echo "$module: a module that docs/design.md and tests/hygiene/check_includes.sh do not place"
    bad=1
    continue
  fi
  dirs=
  for dir in include/sarnerf/$module src/$module; do [ ! -d "$dir" ] || dirs="$dirs $dir"; done
  for use in $(our_includes $dirs || true); do
    used=${use##*:}
    case " $module $(echo $layers) " in
      *" $used "*) ;;
      *) echo "${use%:*}: $module may not include sarnerf/$used (allowed: $(echo $layers))"; bad=1 ;;
    esac
  done
done

# The folders of a module's sources, and what each may use of the others. Files beside them may use all.
rooms() {
  case $1 in
    nerf/ground) ;;
    nerf/field) echo ground ;;
    nerf/mlp | nerf/surface) echo ground field ;;
    nerf/files) echo ground field mlp surface ;;
    nerf/train) echo ground field mlp surface files ;;
    scene/readers | scene/cgal) ;;
    scene/repair) echo cgal ;;
    scene/vdb) echo readers ;;
    scene/voxelise) echo cgal vdb ;;
    render/layers) ;;
    render/surface | render/voxel) echo layers ;;
    *) return 1 ;;
  esac
}

for dir in src/*/*/; do
  [ -d "$dir" ] || continue
  room=${dir#src/}
  room=${room%/}
  module=${room%%/*}
  if ! above=$(rooms "$room"); then
    echo "$dir: a folder that docs/design.md and tests/hygiene/check_includes.sh do not place"
    bad=1
    continue
  fi
  for use in $(grep -rnE '^ *# *include *"[a-z_]+/' "$dir" --include='*.h' --include='*.cpp' |
    sed -E 's|^([^:]*:[0-9]+):[^"]*"([a-z_]+)/.*|\1:\2|'); do
    used=${use##*:}
    [ -d "src/$module/$used" ] || continue
    case " ${room#*/} $(echo $above) " in
      *" $used "*) ;;
      *) echo "${use%:*}: $room may not include $module/$used (allowed: $(echo $above))"; bad=1 ;;
    esac
  done
done

# The standard library's headers have neither a dot nor a slash.
for module in core geometry field mpa; do
  [ -d include/sarnerf/$module ] || continue
  if grep -rnE '^ *# *include' include/sarnerf/$module |
    grep -vE 'include *(<[a-z0-9_]+>|<glm/|"sarnerf/)'; then
    echo "include/sarnerf/$module: the lines above include a third-party header other than GLM's"
    bad=1
  fi
done

# Who reads a header of bake needs no LibTorch for it: models are named there, and no more.
if [ -d include/sarnerf/bake ] && grep -rnE '^ *# *include *("sarnerf/nerf/|<torch)' include/sarnerf/bake; then
  echo "include/sarnerf/bake: the lines above bring in LibTorch; name the type instead (struct Model;)"
  bad=1
fi

exit $bad
