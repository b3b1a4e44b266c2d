#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Learning on generated scenes beside interpolation. Needs a build (scripts/demo.sh makes one).
set -eu

usage() {
  cat <<USAGE
Usage: scripts/scenes_table.sh [--seeds LIST] [--train OPTIONS] [--run NAME] [--folder FOLDER]
Renders each scene of sar_bench scenes in four configurations (clean without a ground, 36 and 12 views; on grass, one look with a
response of 0.4 m from 36 views, and four looks from 12), learns it, and compares 12 unseen azimuths with their clean images,
beside the best of all baselines in each column (Markdown). Data and runs stay in FOLDER.
  --seeds LIST     (default "111 112 113 114 115": scenes that no constant of the method was chosen on)
  --train OPTIONS  of sar_nerf_train, as one text
  --run NAME       of the runs, so that several methods learn from the same data (default "run")
  --folder FOLDER  (default build/scenes_table)
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
seeds="111 112 113 114 115"
folder=$root/build/scenes_table
train=
run=run
. "$root/scripts/report_values.sh"
take_options "seeds train run folder" "" "$@"
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
mkdir -p "$folder"

few=0:330:30 many=0:350:10 unseen=7.3:337.3:30

# learn NAME TEXT AZIMUTHS LOOKS OPTIONS...: a row of the table.
learn() {
  name=$1 text=$2 azimuths=$3 looks=$4
  shift 4
  data=$folder/$name
  "$programs/sar_render/sar_render" "$scene" "$@" --azimuth "$azimuths" --looks "$looks" -q -o "$data" > /dev/null
  "$programs/sar_render/sar_render" "$scene" "$@" --azimuth "$unseen" -q -o "$data.truth" > /dev/null
  # shellcheck disable=SC2086  # several options
  "$programs/sar_nerf_train/sar_nerf_train" "$data" --field grid --against "$data.truth" $train -q -o "$data.$run" > /dev/null
  report=$data.$run/report.json
  echo "| $kind | $text | $(model_and_best "$report" evaluation psnr_power_db) |" \
    "$(model_and_best "$report" evaluation psnr_amplitude_db) |" \
    "$(model_and_best "$report" evaluation psnr_log_amplitude_db) | $(printf '%.1f' "$(training_seconds "$report")") |"
}

echo "| scene | images | power (dB) | best baseline | amplitude (dB) | best baseline | log amplitude (dB) | best baseline | training (s) |"
echo "|---|---|--:|--:|--:|--:|--:|--:|--:|"
for seed in $seeds; do
  scene=$("$programs/sar_bench/sar_bench" scenes --seed "$seed" -o "$folder/scenes" -q)
  kind=$(basename "$(dirname "$scene")" | tr _ ' ')
  dark="--pitch 45 --size 96x96 --spacing 0.3"
  grass="--pitch 60 --ground grass --size 112x128 --spacing 0.25"
  # shellcheck disable=SC2086
  {
    learn "$seed.dark.36" "clean, 36 views" $many inf $dark
    learn "$seed.dark.12" "clean, 12 views" $few inf $dark
    learn "$seed.grass.36" "grass, 1 look, response, 36 views" $many 1 $grass --resolution 0.4 --window taylor:-35
    learn "$seed.grass.12" "grass, 4 looks, 12 views" $few 4 $grass
  }
done
