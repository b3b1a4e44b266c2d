#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# SAR-NeRF over pitch, as in the paper: learned from odd pitches of 35 to 55 degrees, azimuths in steps of ten, and
# scored at the even pitches between them and at 30 and 60 degrees beside interpolation. Needs a build
# (scripts/demo.sh makes one).
set -eu

usage() {
  cat <<USAGE
Usage: scripts/nerf_pitch.sh [OPTION...] [FOLDER]
Renders the data, trains with the default settings, and prints a row for each pitch (Markdown); data, runs and scores
stay in FOLDER (default: build/nerf_pitch).
  --solid NAME       of data/ (default cuboid)
  --step DEG         between the azimuths of the training views (default 10: 396 views)
  --azimuths RANGE   of the views that are scored at each pitch (default 0:355:5: as trained, and halfway)
  --pitches LIST     that are scored (default "36 38 40 42 44 46 48 50 52 54 30 60")
  --train OPTIONS    of sar_nerf_train, as one text (default: its own defaults)
  --seeds N          runs; mean and spread are printed (default 1)
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
solid=cuboid
step=10
azimuths=0:355:5
pitches="36 38 40 42 44 46 48 50 52 54 30 60"
train=
seeds=1
folder=
. "$root/scripts/report_values.sh"
take_options "solid step azimuths pitches train seeds" folder= "$@"
folder=${folder:-$root/build/nerf_pitch}
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
mkdir -p "$folder"

# Four times as many rays as the automatic sampling, so that truth and learner share no discretisation.
render() {
  "$programs/sar_render/sar_render" "$root/data/$solid.json" --pitch "$1" --azimuth "$2" --size 128x128 --spacing 0.3 \
    --altitude 10000 --engine surface --elevations 768 --sub-rows 27 -o "$3" -q > /dev/null
}

# Names say what is in them, so that another --step or --azimuths does not meet other data in its way.
data=$folder/$solid.step$step
render 35:55:2 "0:$(awk "BEGIN { print 360 - $step }"):$step" "$data"
for pitch in $pitches; do render "$pitch" "$azimuths" "$folder/$solid.test$azimuths.$pitch"; done

rows=$folder/rows.txt
: > "$rows"
for seed in $(seq "$seeds"); do
  run=$data.run$seed
  # The options are several words.
  # shellcheck disable=SC2086
  "$programs/sar_nerf_train/sar_nerf_train" "$data" --field grid --holdout 0 --seed "$seed" $train -o "$run" -q > /dev/null
  seconds=$(run_seconds "$run/report.json")
  for pitch in $pitches; do
    scores=$run.scores.$pitch
    "$programs/sar_nerf_render/sar_nerf_render" "$run" --against "$folder/$solid.test$azimuths.$pitch" -o "$scores" \
      --overwrite > "$scores.md" 2> "$scores.log" || { cat "$scores.log" >&2; exit 1; }
    # The table's rows: method, PSNR of power, of amplitude, of the target, SSIM. The rescaled one may come twice, with
    # two heights of the plane: the better counts.
    awk -F '|' -v row="$pitch|$seed|$seconds" '
      /^\| SAR-NeRF/ { own = $3; ssim = $6; next }
      /dB/ || !/^\|.*[0-9]/ { next }
      $2 ~ /rescaled/ && $3 + 0 > rescaled { rescaled = $3 + 0 }
      $3 + 0 > best { best = $3 + 0; name = $2 }
      END { gsub(/ /, "", own); gsub(/ /, "", ssim); gsub(/^ +| +$/, "", name)
            print row "|" own "|" ssim "|" rescaled "|" best "|" name }' "$scores.md" >> "$rows"
  done
done

awk -F '|' '
  { key = $1; if (!(key in n)) order[++count] = key
    n[key]++; own[key] += $4; square[key] += $4 * $4; ssim[key] += $5; rescaled[key] = $6; best[key] = $7; name[key] = $8
    if ($3 > seconds) seconds = $3 }
  END {
    print "| pitch (deg) | PSNR power (dB) | best baseline (dB) | margin (dB) | nearest pitch rescaled (dB) | SSIM |"
    print "|--:|--:|--:|--:|--:|--:|"
    for (k = 1; k <= count; k++) {
      key = order[k]; mean = own[key] / n[key]
      variance = square[key] / n[key] - mean * mean; spread = variance > 0 ? sqrt(variance) : 0
      printf "| %s | %.2f%s | %.2f, %s | %+.2f | %.2f | %.4f |\n", key, mean,
             (n[key] > 1 ? sprintf(" ± %.2f", spread) : ""), best[key], name[key], mean - best[key], rescaled[key],
             ssim[key] / n[key]
    }
    printf "\nTrained in %.1f s.\n", seconds
  }' "$rows" | tee "$folder/table.md"
