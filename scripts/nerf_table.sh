#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Table 1 of SAR-NeRF on clean renders: three solids, learned from 72 to 12 views, scored on all other azimuths in
# steps of half a degree beside interpolation. Needs a build (scripts/demo.sh makes one).
set -eu

usage() {
  cat <<USAGE
Usage: scripts/nerf_table.sh [--seeds N] [--views LIST] [--solids LIST] [--ground] [FOLDER]
Renders the data, trains each row with the default settings, and prints the table (Markdown); data, runs and scores
stay in FOLDER (default: build/nerf_table).
  --seeds N      runs a row; mean and spread are printed (default 1)
  --views LIST   numbers of training views (default "72 36 24 12")
  --solids LIST  of data/ (default "cuboid platform_upright platform_inverted")
  --ground       the solids stand on a checkered ground that they shade
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
seeds=1
views="72 36 24 12"
solids="cuboid platform_upright platform_inverted"
ground=false
folder=
. "$root/scripts/report_values.sh"
take_options "seeds views solids ground!" folder= "$@"
name=nerf_table
if $ground; then name=nerf_table_ground; fi
folder=${folder:-$root/build/$name}
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
mkdir -p "$folder"

# Four times as many rays as the automatic sampling, so that truth and learner share no discretisation.
render() {
  "$programs/sar_render/sar_render" "$scene" --pitch 45 --azimuth "$1" --size 128x128 --spacing 0.3 \
    --altitude 10000 --engine surface --elevations 768 --sub-rows 27 -o "$2" -q > /dev/null
}

scene_of() {
  if ! $ground; then
    echo "$root/data/$1.json"
    return
  fi
  cat > "$folder/$1.json" <<SCENE
{"format": "sarnerf-scene", "version": 1, "meshes": [{"file": "$root/data/$1.obj"}],
 "ground": {"material": "meadow"},
 "materials": {
  "checkered": {"gamma0": 1.0, "exponent": 2.0, "texture": {"kind": "checker", "period_m": 1.0, "contrast": 0.25}},
  "meadow": {"gamma0": 0.1, "exponent": 1.0, "texture": {"kind": "checker", "period_m": 4.0, "contrast": 0.3}}}}
SCENE
  echo "$folder/$1.json"
}

rows=$folder/rows.txt
: > "$rows"
for solid in $solids; do
  scene=$(scene_of "$solid")
  render 0:359.5:0.5 "$folder/$solid.test"
  for n in $views; do
    step=$(awk "BEGIN { print 360 / $n }")
    last=$(awk "BEGIN { print 360 - 360 / $n }")
    render "0:$last:$step" "$folder/$solid.$n"
    for seed in $(seq "$seeds"); do
      run=$folder/$solid.$n.run$seed
      "$programs/sar_nerf_train/sar_nerf_train" "$folder/$solid.$n" --field grid --seed "$seed" -o "$run" -q > /dev/null
      "$programs/sar_nerf_render/sar_nerf_render" "$run" --against "$folder/$solid.test" -o "$run.scores" \
        --overwrite > "$run.scores.md" 2> "$run.scores.log" || { cat "$run.scores.log" >&2; exit 1; }
      seconds=$(run_seconds "$run/report.json")
      # The table's rows: method, PSNR of power, of amplitude, of the target, SSIM.
      awk -F '|' -v row="$solid|$n|$seed|$seconds" '
        /^\| SAR-NeRF/ { own = $3; amplitude = $4; ssim = $6; next }
        /log-amplitude error/ { exit }  # of images with a background, a second table follows
        /dB/ || !/^\|.*[0-9]/ { next }
        $3 + 0 > best { best = $3 + 0; name = $2 }
        END { gsub(/ /, "", own); gsub(/ /, "", amplitude); gsub(/ /, "", ssim); gsub(/^ +| +$/, "", name)
              print row "|" own "|" amplitude "|" ssim "|" best "|" name }' "$run.scores.md" >> "$rows"
    done
  done
done

awk -F '|' '
  { key = $1 "|" $2; if (!(key in n)) order[++count] = key
    n[key]++; own[key] += $5; square[key] += $5 * $5; amplitude[key] += $6; ssim[key] += $7
    best[key] = $8; name[key] = $9; if ($4 > seconds[key]) seconds[key] = $4 }
  END {
    print "| solid | views | PSNR power (dB) | best baseline (dB) | margin (dB) | SSIM | PSNR amplitude (dB) | s |"
    print "|---|--:|--:|--:|--:|--:|--:|--:|"
    for (k = 1; k <= count; k++) {
      key = order[k]; split(key, part, "|"); mean = own[key] / n[key]
      variance = square[key] / n[key] - mean * mean; spread = variance > 0 ? sqrt(variance) : 0
      printf "| %s | %d | %.2f%s | %.2f, %s | %+.2f | %.4f | %.2f | %.1f |\n", part[1], part[2], mean,
             (n[key] > 1 ? sprintf(" ± %.2f", spread) : ""), best[key], name[key], mean - best[key], ssim[key] / n[key],
             amplitude[key] / n[key], seconds[key]
    }
  }' "$rows" | tee "$folder/table.md"
