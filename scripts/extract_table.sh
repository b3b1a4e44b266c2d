#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The closed loop: mesh, images, learned field, volume, compared with the mesh. Needs a build (scripts/demo.sh makes one).
set -eu

usage() {
  cat <<USAGE
Usage: scripts/extract_table.sh [--sets LIST] [--field NAME] [--folder FOLDER] [SCENE[:SCALE]...]
Renders each scene, learns it with the default settings, extracts it with and without the ground's height, and prints
scores beside those of carving alone (Markdown). Data, runs and volumes stay in FOLDER.
  --sets LIST      of views: "396" odd pitches 35 to 55 deg, azimuths every 10 deg; "36" the azimuths at 45 deg
                   (default "396 36")
  --field NAME     surface (default), grid or mlp
  --folder FOLDER  (default build/extract_table)
  SCENE            default: the solids of data/
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
sets="396 36"
field=surface
folder=$root/build/extract_table
scenes=
. "$root/scripts/report_values.sh"
take_options "sets field folder" scenes "$@"
if [ -z "$scenes" ]; then
  for solid in cuboid platform_upright platform_inverted l_building; do scenes="$scenes $root/data/$solid.json"; done
fi
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
mkdir -p "$folder"

echo "| scene | views | ground | IoU | carving's | share of its error left | visible Chamfer (m) | Hausdorff (m) | training (s) | extraction (s) | memory (MiB) |"
echo "|---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|"
for item in $scenes; do
  take_scene "$item"
  truth=$scene
  for set in $sets; do
    pitch=45
    if [ "$set" = 396 ]; then pitch=35:55:2; fi
    data=$folder/$name.$set
    run=$data.$field
    # Four times as many rays as the automatic sampling, so that truth and learner share no discretisation.
    "$programs/sar_render/sar_render" "$scene" --scale "$scale" --pitch "$pitch" --azimuth 0:350:10 --size 128x128 \
      --spacing 0.3 --altitude 10000 --engine surface --elevations 768 --sub-rows 27 -o "$data" -q > /dev/null
    "$programs/sar_nerf_train/sar_nerf_train" "$data" --field "$field" -o "$run" -q > /dev/null
    training=$(run_seconds "$run/report.json")
    for ground in unknown 0; do
      out=$run.$ground
      height=
      if [ "$ground" != unknown ]; then height="--ground-height $ground"; fi
      # shellcheck disable=SC2086  # no height is no option
      "$programs/sar_extract/sar_extract" "$run" "$out.vdb" $height --truth "$truth" --truth-scale "$scale" \
        --images "$data" --mesh "$out.ply" --preview "$out.png" --overwrite -q > "$out.txt"
      report=$out.report.json
      seconds=$(extraction_seconds "$report")
      echo "$name $set $ground $(value "$report" iou 1) $(value "$report" iou 2) $(value "$report" chamfer_m 2)" \
        "$(value "$report" hausdorff_m 2) $training $seconds" \
        "$(value "$report" peak 1)" |
        awk '{ printf "| %s | %d | %s | %.3f | %.3f | %.2f | %.3f | %.2f | %.1f | %.1f | %.0f |\n",
               $1, $2, $3, $4, $5, (1 - $4) / (1 - $5), $6, $7, $8, $9, $10 / 1048576 }'
    done
  done
done
