#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds sar_render and renders a first picture; then builds the programs that learn, renders every
# scene shipped in data/, learns one of them, and extracts it as a body.
set -eu

case "${1-}" in
  '') ;;
  -h | --help)
    cat <<EOF
Usage: scripts/demo.sh
Installs missing packages, builds build/release, renders the scenes of data/ to out/demo, learns one of
them and takes it out of the model, as a volume, a mesh and a picture, compared with the truth. The first
picture is there as soon as sar_render is built.
EOF
    exit 0 ;;
  *) echo "demo: expected no arguments, found '$1'" >&2; exit 2 ;;
esac

cd "$(dirname "$0")/.."
start=$(date +%s)
cores=$(nproc)
since_start() { echo "$((($(date +%s) - start) / 60)) min $((($(date +%s) - start) % 60)) s"; }
# build SECONDS WHAT TARGET...: says how long it takes if nothing of it is built, given its processor time on one core.
build() {
  minutes=$((($1 / cores + 59) / 60)); what=$2
  shift 2
  echo "demo: building $what: about $minutes min on $cores cores if nothing of it is built yet"
  cmake --build --preset release --target "$@"
}

out=out/demo
mkdir -p "$out"
render() {
  echo "demo: sar_render $*"
  build/release/apps/sar_render/sar_render "$@" --overwrite -q
}

scripts/setup.sh
cmake --preset release
build 320 sar_render sar_render

render data/truck.obj --pitch 60 --azimuth 30 --ground grass --spacing 0.1 -o "$out/truck"
echo "demo: the first picture is $PWD/$out/truck.png, $(since_start) after the start"

build 400 "the programs that learn, and sar_import" sar_nerf_train sar_nerf_render sar_extract sar_import
echo "demo: rendering the scenes of data/ and learning one of them: about 1 min"

# The paper's Fig. 7: roof longer than the wall's layover, equal, shorter. At 35° another building coincides.
for scene in building_14x8 building_10x10 building_8x14; do
  render "data/$scene.json" --pitch 45 --ground grass --spacing 0.1 -o "$out/$scene"
done
render data/building_coinciding_35.json --pitch 35 --ground grass --spacing 0.1 \
  -o "$out/building_coinciding_35"

for scene in cuboid platform_upright platform_inverted; do
  render "data/$scene.json" --pitch 45 --azimuth 30 --ground grass --spacing 0.1 -o "$out/$scene"
done
render data/street.json --pitch 40 --azimuth 20 --spacing 0.1 -o "$out/street"

# 36 views of the cuboid; what is learned from them, judged on views between them; a surface, and the body that it bounds.
render data/cuboid.json --pitch 45 --azimuth 0:350:10 --size 128x128 --spacing 0.3 -o "$out/cuboid_36"
render data/cuboid.json --pitch 45 --azimuth 5:355:10 --size 128x128 --spacing 0.3 -o "$out/cuboid_between"
build/release/apps/sar_nerf_train/sar_nerf_train "$out/cuboid_36" --time 20s --against "$out/cuboid_between" \
  -o "$out/cuboid_run" --overwrite
build/release/apps/sar_nerf_render/sar_nerf_render "$out/cuboid_run" --azimuth 12.5 -o "$out/cuboid_unseen" --overwrite
build/release/apps/sar_nerf_train/sar_nerf_train "$out/cuboid_36" --field surface --time 20s -o "$out/cuboid_surface" --overwrite
build/release/apps/sar_extract/sar_extract "$out/cuboid_surface" "$out/cuboid_body.vdb" --mesh "$out/cuboid_body.ply" \
  --preview "$out/cuboid_body.png" --truth data/cuboid.json --overwrite

# A sweep writes a dataset folder.
render data/truck.obj --pitch 60 --azimuth 0:350:10 --spacing 0.1 -o "$out/truck_turning"

echo "demo: done after $(since_start)"
echo "demo: the pictures are in $PWD/$out: *.png and truck_turning/png; the *.tif hold radar brightness"
