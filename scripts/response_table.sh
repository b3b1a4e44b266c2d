#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Learning images with an impulse response. Needs a build (scripts/demo.sh makes one).
set -eu

usage() {
  cat <<USAGE
Usage: scripts/response_table.sh [--folder FOLDER] [VEHICLE[:SCALE]]
Renders a vehicle (a depression of 30 degrees, pixels of 0.2 m) with several impulse responses and two solids of data/ (45 degrees,
0.3 m), learns each from 36 views, also with --resolution none, as if the response were not known, and compares 24 unseen
azimuths with their images, beside the best baseline (Markdown). Data and runs stay in FOLDER.
  --folder FOLDER  (default build/response_table)
  VEHICLE          default: data/truck.obj
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
folder=$root/build/response_table
vehicle=$root/data/truck.obj
. "$root/scripts/report_values.sh"
take_options "folder" vehicle= "$@"
scale=1
case "$vehicle" in *:*) scale=${vehicle##*:} vehicle=${vehicle%:*} ;; esac
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
mkdir -p "$folder"

# learn NAME RESPONSE SCENE OPTIONS...: a row of the table; RESPONSE "none" or "WIDTH WINDOW".
learn() {
  name=$1 response=$2 scene=$3
  shift 3
  formation=
  if [ "$response" != none ]; then formation="--resolution ${response% *} --window ${response#* }"; fi
  data=$folder/$(echo "$name.$response" | tr ' :,' '---')
  # shellcheck disable=SC2086  # several options
  {
    "$programs/sar_render/sar_render" "$scene" "$@" $formation --azimuth 0:350:10 -q -o "$data" > /dev/null
    "$programs/sar_render/sar_render" "$scene" "$@" $formation --azimuth 7.5:352.5:15 -q -o "$data.truth" > /dev/null
  }
  "$programs/sar_nerf_train/sar_nerf_train" "$data" --field grid --against "$data.truth" -q -o "$data.run" > /dev/null
  unknown=
  if [ "$response" != none ]; then
    "$programs/sar_nerf_train/sar_nerf_train" "$data" --field grid --against "$data.truth" --resolution none -q -o "$data.unknown" > /dev/null
    unknown=$(model_and_best "$data.unknown/report.json" evaluation psnr_power_db)
    unknown=${unknown% | *}
  fi
  report=$data.run/report.json
  # The best baseline stands behind the model in each cell pair; the score without the response comes between them.
  pair=$(model_and_best "$report" evaluation psnr_power_db)
  echo "| $name | $response | ${pair% | *} | $unknown | ${pair#* | } | $(printf '%.1f' "$(training_seconds "$report")") |"
}

echo "| scene | response (m) | power (dB) | with --resolution none (dB) | best baseline (dB) | training (s) |"
echo "|---|--:|--:|--:|--:|--:|"
vehicle_view="--scale $scale --depression 30 --size 128x128 --spacing 0.2 --slant-range 4500"
solid_view="--pitch 45 --size 128x128 --spacing 0.3"
# shellcheck disable=SC2086
{
  learn vehicle none "$vehicle" $vehicle_view
  learn vehicle "0.305 taylor:-35" "$vehicle" $vehicle_view
  learn vehicle "0.6 taylor:-35" "$vehicle" $vehicle_view
  learn vehicle "0.3,0.9 taylor:-35" "$vehicle" $vehicle_view
  learn vehicle "0.305 none" "$vehicle" $vehicle_view
  learn cuboid "0.5 taylor:-35" "$root/data/cuboid.json" $solid_view
  learn platform "0.5 taylor:-35" "$root/data/platform_upright.json" $solid_view
  learn "vehicle on grass" "0.6 taylor:-35" "$vehicle" $vehicle_view --ground grass
}
