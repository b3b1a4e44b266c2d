#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Learning under speckle against clean truth. Needs a build (scripts/demo.sh makes one).
set -eu

usage() {
  cat <<USAGE
Usage: scripts/speckle_table.sh [--looks LIST] [--every LIST] [--depression LIST] [--folder FOLDER] [SCENE[:SCALE]...]
Renders each scene on grass as MSTAR's radar sees it (128 x 128 pixels of 0.2 m, resolution 0.305 m), learns it from
speckled views, and compares 24 unseen azimuths with their clean images, beside the best of all baselines in each column
(Markdown). Data and runs stay in FOLDER.
  --looks LIST       (default "1 4")
  --every LIST       degrees between training azimuths (default "5 10 15")
  --depression LIST  degrees (default "15 17 30")
  --folder FOLDER    (default build/speckle_table)
  SCENE              default: the L-shaped building of data/
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
looks="1 4"
every="5 10 15"
depression="15 17 30"
folder=$root/build/speckle_table
scenes=
. "$root/scripts/report_values.sh"
take_options "looks every depression folder" scenes "$@"
depressions=$depression
scenes=${scenes:-$root/data/l_building.json}
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
mkdir -p "$folder"

render() {
  "$programs/sar_render/sar_render" "$scene" --scale "$scale" --ground grass --depression "$depression" --size 128x128 \
    --spacing 0.2 --resolution 0.305 --window taylor:-35 --slant-range 4500 -q "$@" > /dev/null
}

echo "| scene | depression | looks | every | power (dB) | best baseline | log amplitude (dB) | best baseline | shadow IoU | best baseline | training (s) |"
echo "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
for item in $scenes; do
  take_scene "$item"
  for depression in $depressions; do
    truth=$folder/$name.$depression.truth
    render --azimuth 7.5:352.5:15 -o "$truth"
    for look in $looks; do
      for step in $every; do
        data=$folder/$name.$depression.$look.$step
        render --azimuth "0:355:$step" --looks "$look" -o "$data"
        "$programs/sar_nerf_train/sar_nerf_train" "$data" --field grid --against "$truth" -o "$data.run" -q > /dev/null
        report=$data.run/report.json
        echo "| $name | $depression | $look | $step | $(model_and_best "$report" evaluation psnr_power_db) |" \
          "$(model_and_best "$report" evaluation psnr_log_amplitude_db) |" \
          "$(model_and_best "$report" evaluation shadow_iou) | $(printf '%.1f' "$(training_seconds "$report")") |"
      done
    done
  done
done
