#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Views that are cut elsewhere than their poses have it, as measured chips are: sourced by scripts that render them.

# Shift of the view at azimuth a (degrees; f in radians) along track and in range, in units of a scale: the sum of two harmonics of
# azimuth, 0.61 of each axis (root mean square), 1.2 at most. Neither harmonic is the first, which would be a translation of the scene.
shift_of_view='pi = atan2(0, -1); f = a * pi / 180; sign = (a / 10) % 2 ? -1 : 1
  along = 0.5 * cos(3 * f + 1) + 0.7 * sign * cos(5 * f); range = 0.5 * sin(3 * f) + 0.7 * sign * cos(5 * f + 2)'

# shifted_aim AZIMUTH DEPRESSION SCALE_M: the aim point x,y,z of that view, 1.2 m above the ground where it is not shifted.
# View: from radar, along track h = (-cos a, 0, sin a), away from it k = (-sin p sin a, -cos p, -sin p cos a).
shifted_aim() {
  awk -v a="$1" -v d="$2" -v s="$3" 'BEGIN {
    '"$shift_of_view"'
    p = (90 - d) * pi / 180; along *= s; range *= s
    printf "%.9f,%.9f,%.9f", -along * cos(f) - range * sin(p) * sin(f), 1.2 - range * cos(p), along * sin(f) - range * sin(p) * cos(f) }'
}

# shifted_views SCALE_M DATA AZIMUTHS DEPRESSION LOOKS OPTIONS...: a data set of such views; AZIMUTHS are a list. Options of
# sar_render: the scene and the images.
shifted_views() {
  scale=$1 data=$2 azimuths=$3 depression=$4 looks=$5
  shift 5
  if [ -e "$data.done" ]; then return; fi
  "$programs/sar_render/sar_render" "$@" --depression "$depression" --aim 0,1.2,0 --azimuth "$(echo "$azimuths" | tr ' ' ,)" \
    --looks "$looks" -q -o "$data" > /dev/null
  view=0
  for azimuth in $azimuths; do
    noise=
    if [ "$looks" != inf ]; then noise="--seed $((1 + azimuth))"; fi
    # shellcheck disable=SC2086
    "$programs/sar_render/sar_render" "$@" --depression "$depression" --aim "$(shifted_aim "$azimuth" "$depression" "$scale")" \
      --azimuth "$azimuth" --looks "$looks" $noise -q -o "$data.one" --overwrite > /dev/null
    mv "$data.one.tif" "$data/images/view_$(printf %03d "$view").tif"
    view=$((view + 1))
  done
  sed 's/"exact_poses": *true/"exact_poses": false/' "$data/dataset.json" > "$data.one.json"
  mv "$data.one.json" "$data/dataset.json"
  rm -f "$data".one.*
  touch "$data.done"
}
