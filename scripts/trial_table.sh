#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Does the trial of sar_nerf_train --field auto choose the better field? Needs a build (scripts/demo.sh makes one).
set -eu

usage() {
  cat <<USAGE
Usage: scripts/trial_table.sh [--seeds LIST] [--sets LIST] [--folder FOLDER] [SCENE[:SCALE]...]
Renders shapes (sar_bench scenes) without a ground, learns each with the fields surface and grid by their default settings, lets
the trial choose, and prints the PSNR of power on 12 unseen views between the training views (Markdown). Data and runs stay in
FOLDER, and what is there is not made again.
  --seeds LIST     of generated shapes (default 206:210)
  --sets LIST      numbers of views at 45 deg, evenly around (default "36 12")
  --folder FOLDER  (default build/trial_table)
  SCENE            other scenes, after the generated ones
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
seeds=206:210
sets="36 12"
folder=$root/build/trial_table
scenes=
. "$root/scripts/report_values.sh"
take_options "seeds sets folder" scenes "$@"
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
mkdir -p "$folder"
add_generated_scenes "$seeds"

echo "| scene | views | surface (dB) | grid (dB) | trial: surface (dB) | grid (dB) | trial (s) | chosen | worse than the other by (dB) |"
echo "|---|--:|--:|--:|--:|--:|--:|---|--:|"
for item in $scenes; do
  take_scene "$item"
  render() {
    "$programs/sar_render/sar_render" "$scene" --scale "$scale" --pitch 45 --size 128x128 --spacing 0.3 --altitude 10000 \
      --ground none -q "$@" > /dev/null
  }
  render --azimuth 5:355:30 -o "$folder/$name.truth"
  for n in $sets; do
    data=$folder/$name.$n
    render --azimuth "0:$(awk "BEGIN { print 360 - 360 / $n }"):$(awk "BEGIN { print 360 / $n }")" -o "$data"
    for field in surface grid; do
      "$programs/sar_nerf_train/sar_nerf_train" "$data" --field $field --against "$folder/$name.truth" -o "$data.$field" -q > /dev/null
    done
    "$programs/sar_nerf_train/sar_nerf_train" "$data" --steps 1 -o "$data.auto" -q > /dev/null
    psnr() { report_means "$data.$1/report.json" evaluation psnr_power_db | head -n 1; }
    trial=$data.auto/trial.json
    chosen=$(sed -n 's/.*"field": "\([a-z]*\)".*/\1/p' "$trial" | head -n 1)
    echo "$name $n $(psnr surface) $(psnr grid)" \
      "$(value "$trial" psnr_power_db 1) $(value "$trial" psnr_power_db 2) $(value "$trial" seconds 1) $(value "$trial" seconds 2) $chosen" |
      awk '{ worse = $9 == "grid" ? $3 - $4 : $4 - $3
             printf "| %s | %d | %.2f | %.2f | %.2f | %.2f | %.1f | %s | %s |\n",
                    $1, $2, $3, $4, $5, $6, $7 + $8, $9, (worse > 0 ? sprintf("%.2f", worse) : "–") }'
  done
done
