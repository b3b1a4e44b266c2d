#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Shapes that no constant was chosen on, and their surfaces learned from images. Needs a build (scripts/demo.sh makes one).
set -eu

usage() {
  cat <<USAGE
Usage: scripts/surfaces_table.sh [--seeds LIST] [--sets LIST] [--field NAME] [--ground MATERIAL] [--looks L] [--folder FOLDER] [SCENE[:SCALE]...]
Renders shapes (sar_bench scenes), learns them with the default settings, extracts bodies, and prints their scores beside those of
carving alone (Markdown). What is there is not made again. Data, runs and bodies stay in FOLDER.
  --seeds LIST     of generated shapes (default 206:210; development used 201 to 205)
  --sets LIST      of views: "396" pitches 20 to 70 deg, azimuths every 10 deg; "36" the azimuths at 45 deg; "12" every third of
                   these (default "36 12 396")
  --field NAME     surface (default), grid or mlp
  --ground MATERIAL, --looks L  of sar_render: a ground (default none), speckle (default inf)
  --folder FOLDER  (default build/surfaces_table)
  SCENE            other scenes, after the generated ones
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
seeds=206:210
sets="36 12 396"
field=surface
ground=none
looks=inf
folder=$root/build/surfaces_table
scenes=
. "$root/scripts/report_values.sh"
take_options "seeds sets field ground looks folder" scenes "$@"
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
pixel_m=0.3
mkdir -p "$folder"
add_generated_scenes "$seeds"

echo "| scene | ground, looks | views | IoU | observable | carving's | best hull's IoU | (1 − observable) / carving's | difference (m) | (pixels) | visible Chamfer (m) | normals (°) | components | unseen (%) | training (s) | extraction (s) |"
echo "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
for item in $scenes; do
  take_scene "$item"
  for set in $sets; do
    pitch=45
    azimuth=0:350:10
    case "$set" in
      396) pitch=20:70:5 ;;
      12) azimuth=0:330:30 ;;
    esac
    data=$folder/$name.$ground.$looks.$set
    run=$data.$field
    report=$run.body.report.json
    # Four times as many rays as the automatic sampling, so that truth and learner share no discretisation. Images of another scene or
    # scale under this name are refused.
    "$programs/sar_render/sar_render" "$scene" --scale "$scale" --pitch "$pitch" --azimuth "$azimuth" --size 128x128 --spacing $pixel_m \
      --altitude 10000 --engine surface --elevations 768 --sub-rows 27 --ground "$ground" --looks "$looks" -o "$data" -q > /dev/null
    if [ ! -f "$report" ]; then
      "$programs/sar_nerf_train/sar_nerf_train" "$data" --field "$field" --holdout 0 -o "$run" -q > /dev/null
      "$programs/sar_extract/sar_extract" "$run" "$run.body.vdb" --truth "$scene" --truth-scale "$scale" --images "$data" \
        --mesh "$run.body.ply" --preview "$run.body.png" --overwrite -q > /dev/null
    fi
    training=$(run_seconds "$run/report.json")
    seconds=$(extraction_seconds "$report")
    echo "$name $ground $looks $set $(value "$report" iou 1) $(value "$report" observable_iou 1) $(value "$report" observable_iou 2)" \
      "$(value "$report" hull_iou 1) $(value "$report" symmetric_difference_m 1) $pixel_m $(value "$report" chamfer_m 2) $(value "$report" visible_normal_error_deg 1)" \
      "$(value "$report" components 1) $(value "$report" unseen_part 1) $training $seconds" |
      awk '{ printf "| %s | %s, %s | %d | %.3f | %.3f | %.3f | %.3f | %.2f | %.3f | %.2f | %.3f | %.1f | %d | %.0f | %.0f | %.1f |\n",
             $1, $2, $3, $4, $5, $6, $7, $8, (1 - $6) / (1 - $7), $9, $9 / $10, $11, $12, $13, 100 * $14, $15, $16 }'
  done
done
