#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The tables and figures of SAR-NeRF (Lei et al. 2023), the paper's printed values beside ours. Needs a build (scripts/demo.sh makes one).
set -eu

usage() {
  cat <<USAGE
Usage: scripts/paper.sh [--quick] [--chips FOLDER] [--lpips FILE] [--long] [OUT]
Renders, learns, extracts and scores what the paper shows, and writes OUT/paper.md and OUT/paper.html (one file). What is in OUT is
not made again: an interrupted run goes on where it stopped. About five hours on two cores.
  --quick         fewer views and short trainings, in about ten minutes: to see what there is, not to quote
  --chips FOLDER  of measured chips: a folder of images for each target, and manifest.csv in it or beside it (Table 2)
  --lpips FILE    weights for LPIPS (docs/guide/lpips.md)
  --long          the paper's method in every cell of Table 1, not in one (two hours more)
  OUT             (default build/paper)
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
quick=false
long=false
chips=
lpips=
out=
while [ $# -gt 0 ]; do
  case "$1" in
    --quick) quick=true; shift ;;
    --long) long=true; shift ;;
    --chips | --lpips)
      if [ $# -lt 2 ]; then echo "paper.sh: $1: expected a value behind it, found none (see --help)" >&2; exit 2; fi
      case "$1" in --chips) chips=$2 ;; *) lpips=$2 ;; esac
      shift 2 ;;
    -h | --help) usage; exit 0 ;;
    -*) usage >&2; exit 2 ;;
    *) out=$1; shift ;;
  esac
done
out=${out:-$root/build/paper}
table=$chips/manifest.csv
if [ -n "$chips" ] && [ ! -f "$table" ]; then table=$(dirname "$chips")/manifest.csv; fi
if [ -n "$chips" ] && [ ! -f "$table" ]; then
  echo "paper.sh: --chips $chips: expected manifest.csv in the folder or beside it, found none" >&2
  exit 3
fi
. "$root/scripts/report_values.sh"
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
mkdir -p "$out/cells"
revision=$(git -C "$root" rev-parse --short HEAD 2> /dev/null || echo unknown)
machine=$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)

solids="cuboid platform_upright platform_inverted"
views="72 36 24 12"
test_azimuths=0:359:1
mlp_time=600 paper_time=3600
surface_steps=auto
training_pitches=35:55:2
even_pitches="36 40 44 46 50 54"
far_pitches="30 60"
lattice=256
if $quick; then
  solids=cuboid
  views="36 12"
  test_azimuths=3:351:12
  mlp_time=30 paper_time=30
  surface_steps=200
  training_pitches=35:55:10
  even_pitches="40 50"
  lattice=128
fi

# Cells: what takes time. The first pass adds up their planned seconds, the second one makes them.
counting=true
n_cells=0 n_done=0 seconds_left=0

# cell NAME SECONDS COMMAND...: runs the command once, in whichever run of this script; its output is OUT/cells/NAME.log.
cell() {
  cell_name=$1 cell_seconds=$2
  shift 2
  if $counting; then
    n_cells=$((n_cells + 1))
    if [ ! -f "$out/cells/$cell_name.done" ]; then seconds_left=$((seconds_left + cell_seconds)); fi
    return
  fi
  n_done=$((n_done + 1))
  if [ -f "$out/cells/$cell_name.done" ]; then return; fi
  echo "paper.sh: $n_done of $n_cells, $cell_name; some $(((seconds_left + 59) / 60)) min left" >&2
  if ! "$@" > "$out/cells/$cell_name.log" 2>&1; then
    tail -n 3 "$out/cells/$cell_name.log" >&2
    echo "paper.sh: $cell_name failed; the same command goes on from here (see $out/cells/$cell_name.log)" >&2
    exit 1
  fi
  : > "$out/cells/$cell_name.done"
  seconds_left=$((seconds_left - cell_seconds))
}

# text: standard input becomes a part of the result.
text() {
  if $counting; then cat > /dev/null; else cat >> "$out/paper.md.part"; fi
}

# render SCENE OUT OPTIONS...: images of the paper's size, with four times as many rays as the automatic sampling, so that truth and
# learner share no discretisation.
render() {
  render_scene=$1 render_out=$2
  shift 2
  cell "render_$(basename "$render_out")" 20 "$programs/sar_render/sar_render" "$render_scene" --size 128x128 --spacing 0.3 --altitude 10000 \
    --engine surface --elevations 768 --sub-rows 27 -o "$render_out" -q "$@"
}

# learn FIELD DATA AGAINST SECONDS: a run, OUT/DATA.FIELD.
learn() {
  field=$1 data=$2 against=$3 seconds=$4
  set -- --field "$field" --against "$against" --holdout 0 -o "$data.$field" -q
  case "$field" in
    mlp) set -- "$@" --time "${mlp_time}s" ;;
    paper) set -- "$@" --time "${paper_time}s" ;;
    surface) if [ "$surface_steps" != auto ]; then set -- "$@" --steps "$surface_steps"; fi ;;
  esac
  if [ -n "$lpips" ]; then set -- "$@" --lpips "$lpips"; fi
  cell "learn_$(basename "$data").$field" "$seconds" "$programs/sar_nerf_train/sar_nerf_train" "$data" "$@"
}

# printed SOLID VIEWS: PSNR and LPIPS of the paper's Table 1. (Its row of 36 views of the inverted platform is labelled 5/72.)
printed() {
  case "$1.$2" in
    cuboid.72) echo "34.81 | 0.0153" ;; cuboid.36) echo "32.87 | 0.0358" ;;
    cuboid.24) echo "31.66 | 0.0549" ;; cuboid.12) echo "27.38 | 0.0711" ;;
    platform_upright.72) echo "34.89 | 0.0305" ;; platform_upright.36) echo "34.67 | 0.0334" ;;
    platform_upright.24) echo "32.82 | 0.0404" ;; platform_upright.12) echo "26.30 | 0.0962" ;;
    platform_inverted.72) echo "35.71 | 0.0198" ;; platform_inverted.36) echo "34.71 | 0.0297" ;;
    platform_inverted.24) echo "31.11 | 0.0506" ;; platform_inverted.12) echo "26.63 | 0.0877" ;;
    *) echo "– | –" ;;
  esac
}

# mean REPORT KEY FORMAT: the model's mean over the unseen views, or a dash.
mean() {
  report_means "$1" evaluation "$2" | head -n 1 | awk -v f="$3" '$1 != "" { printf f, $1; n = 1 } END { if (!n) printf "–" }'
}

solid_name() { echo "$1" | sed 's/platform_upright/upright platform/; s/platform_inverted/inverted platform/'; }

heading=
if $quick; then heading=" (quick: fewer views, short trainings)"; fi

figure_8() {
  text << TEXT

## Fig. 8: three solids$heading

TEXT
  for solid in $solids; do
    for engine in voxel surface; do
      cell "fig8_$solid.$engine" 10 "$programs/sar_render/sar_render" "$root/data/$solid.json" --pitch 45 --azimuth 30:70:40 --size 128x128 \
        --spacing 0.3 --altitude 10000 --engine $engine -o "$out/fig8_$solid.$engine" -q
    done
    cell "fig8_$solid.strip" 1 "$programs/sar_bench/sar_bench" strip "$out/fig8_$solid.voxel" "$out/fig8_$solid.surface" -o "$out/fig8_$solid.png"
    echo "![$(solid_name "$solid")](fig8_$solid.png)" | text
  done
  text << TEXT
*128 × 128 pixels of 0.3 m, pitch 45°, altitude 10 km, azimuths 30 and 70°. Above: the voxel engine, as in the paper; below: the surface engine.*
TEXT
}

table_1() {
  for solid in $solids; do
    render "$root/data/$solid.json" "$out/$solid.test" --pitch 45 --azimuth $test_azimuths
    for n in $views; do
      step=$(awk "BEGIN { print 360 / $n }")
      last=$(awk "BEGIN { print 360 - 360 / $n }")
      render "$root/data/$solid.json" "$out/$solid.$n" --pitch 45 --azimuth "0:$last:$step"
      for f in surface grid mlp; do
        case $f in mlp) s=$((mlp_time + 60)) ;; *) s=60 ;; esac
        learn $f "$out/$solid.$n" "$out/$solid.test" $s
      done
      if $long || [ "$solid.$n" = cuboid.36 ]; then learn paper "$out/$solid.$n" "$out/$solid.test" $((paper_time + 60)); fi
    done
  done
  text << TEXT

## Table 1: unseen azimuths at 45°$heading

| solid | views | method | PSNR (dB) | SSIM | LPIPS | training (s) |
|---|--:|---|--:|--:|--:|--:|
TEXT
  if $counting; then return; fi
  for solid in $solids; do
    for n in $views; do
      name=$(solid_name "$solid")
      paper=$(printed "$solid" "$n")
      echo "| $name | $n | SAR-NeRF as printed | ${paper%% |*} | – | ${paper##*| } | – |"
      for f in paper mlp grid surface; do
        report=$out/$solid.$n.$f/report.json
        if [ ! -f "$report" ]; then continue; fi
        echo "| $name | $n | $f | $(mean "$report" psnr_power_db %.2f) | $(mean "$report" ssim_power %.4f) | $(mean "$report" lpips %.4f) | $(training_seconds "$report" | awk '{ printf "%.0f", $1 }') |"
      done
      best=$(model_and_best "$out/$solid.$n.grid/report.json" evaluation psnr_power_db)
      echo "| $name | $n | best interpolation | ${best##*| } | – | – | 0 |"
    done
  done | text
  text << TEXT

*PSNR of power over the peak of the training images, mean over the unseen azimuths of $test_azimuths°. "paper": the method to the letter (\`--field paper\`);
"mlp": its network with an exact rule, carving, pruning and a schedule; the paper does not say over which peak its PSNR is. The paper's second row of the inverted
platform is printed as "5/72" and taken for 36 views.$(if [ -z "$lpips" ]; then echo " LPIPS of ours needs weights (\`--lpips\`)."; fi)*
TEXT
}

# Trained views are every 10 degrees: of these azimuths the first and the last one, as in the paper's figure.
turn=0:90:9

figure_9() {
  text << TEXT

## Fig. 9: azimuths from 0 to 90°$heading

TEXT
  for solid in $solids; do
    render "$root/data/$solid.json" "$out/$solid.turn" --pitch 45 --azimuth $turn
    strip="$out/$solid.turn"
    for f in surface paper; do
      if [ "$f" = paper ] && ! $long && [ "$solid" != cuboid ]; then continue; fi
      cell "turn_$solid.$f" 20 "$programs/sar_nerf_render/sar_nerf_render" "$out/$solid.36.$f" --pitch 45 --azimuth $turn -o "$out/$solid.turn.$f" -q
      strip="$strip $out/$solid.turn.$f"
    done
    # shellcheck disable=SC2086  # several folders
    cell "turn_$solid.strip" 1 "$programs/sar_bench/sar_bench" strip $strip --trained "$out/$solid.36" -o "$out/turn_$solid.png"
    echo "![$(solid_name "$solid")](turn_$solid.png)" | text
  done
  text << TEXT
*From above: rendered; predicted by \`surface\` from 36 views; by the paper's method, where it was trained. Frames mark views that were learned from.*
TEXT
}

# Lists of views of several pitches, in one dataset each.
pitches() {
  for solid in $solids; do
    render "$root/data/$solid.json" "$out/$solid.pitches" --pitch $training_pitches --azimuth 0:350:10
    for p in $even_pitches $far_pitches; do
      render "$root/data/$solid.json" "$out/$solid.pitch$p" --pitch "$p" --azimuth 0:324:36
    done
    for f in surface grid; do
      learn $f "$out/$solid.pitches" "$out/$solid.pitch${even_pitches%% *}" 300
      for p in $even_pitches $far_pitches; do
        cell "pitch_$solid.$p.$f" 20 "$programs/sar_nerf_render/sar_nerf_render" "$out/$solid.pitches.$f" --against "$out/$solid.pitch$p" \
          -o "$out/$solid.pitch$p.$f.scores"
      done
    done
    for p in ${even_pitches%% *} $far_pitches; do
      cell "pitch_$solid.$p.views" 20 "$programs/sar_nerf_render/sar_nerf_render" "$out/$solid.pitches.surface" --pitch "$p" --azimuth 0:324:36 \
        -o "$out/$solid.pitch$p.surface" -q
      cell "pitch_$solid.$p.strip" 1 "$programs/sar_bench/sar_bench" strip "$out/$solid.pitch$p" "$out/$solid.pitch$p.surface" -o "$out/pitch_$solid.$p.png"
    done
  done
}

# log_psnr CELL: the model's and the best baseline's PSNR of power, from the table that sar_nerf_render prints.
log_psnr() {
  awk -F '|' '/^\| SAR-NeRF/ && own == "" { own = $3; next }
    /log-amplitude error/ { exit }
    /dB/ || !/^\|.*[0-9]/ { next }
    $3 + 0 > best { best = $3 + 0 }
    END { gsub(/ /, "", own); printf "%s | %.2f", own, best }' "$out/cells/$1.log"
}

figures_10_11() {
  pitches
  text << TEXT

## Figs. 10 and 11: pitches between and beyond those that were learned$heading

Learned from the pitches $training_pitches°, azimuths every 10°. PSNR of power (dB) over ten azimuths of each unseen pitch.

| solid | pitch (°) | surface | grid | best interpolation |
|---|--:|--:|--:|--:|
TEXT
  if $counting; then return; fi
  for solid in $solids; do
    for p in $even_pitches $far_pitches; do
      own=$(log_psnr "pitch_$solid.$p.surface")
      of_grid=$(log_psnr "pitch_$solid.$p.grid")
      echo "| $(solid_name "$solid") | $p | ${own%% |*} | ${of_grid} |"
    done
  done | text
  echo | text
  for solid in $solids; do
    for p in ${even_pitches%% *} $far_pitches; do echo "![$(solid_name "$solid"), $p°](pitch_$solid.$p.png)"; done
  done | text
  text << TEXT
*Above: rendered; below: predicted by \`surface\`. $far_pitches° lie outside of the learned pitches.*
TEXT
}

figures_12_13() {
  for solid in $solids; do
    fields=surface
    if [ "$solid" = cuboid ] || $long; then fields="surface paper"; fi
    for f in $fields; do
      data=$out/$solid.pitches
      if [ $f = paper ]; then data=$out/$solid.36; fi
      cell "body_$solid.$f" 60 "$programs/sar_extract/sar_extract" "$data.$f" "$out/$solid.$f.vdb" --resolution $lattice --extent 20 \
        --truth "$root/data/$solid.json" --images "$data" --mesh "$out/$solid.$f.ply" --preview "$out/body_$solid.$f.png" --overwrite -q
    done
  done
  text << TEXT

## Figs. 12 and 13: bodies$heading

| solid | field | views | IoU | visible Chamfer (m) |
|---|---|--:|--:|--:|
TEXT
  if $counting; then return; fi
  for solid in $solids; do
    for f in surface paper; do
      report=$out/$solid.$f.report.json
      if [ ! -f "$report" ]; then continue; fi
      seen="pitches $training_pitches°"
      if [ $f = paper ]; then seen="36 at 45°"; fi
      echo "| $(solid_name "$solid") | $f | $seen | $(value "$report" iou 1 | awk '{ printf "%.3f", $1 }') | $(value "$report" chamfer_m 2 | awk '{ printf "%.3f", $1 }') |"
    done
  done | text
  echo | text
  for solid in $solids; do
    for f in surface paper; do
      if [ -f "$out/body_$solid.$f.png" ]; then echo "![$(solid_name "$solid"), $f](body_$solid.$f.png)"; fi
    done
  done | text
  text << TEXT
*A lattice of $lattice³ voxels over 20 m. Of the paper's method a voxel is full where its extinction reaches the automatic threshold; the paper removes those with σ = 0.*
TEXT
}

# The paper's names of the vehicles, and their printed PSNR at intervals of 5, 10 and 15 degrees.
printed_chips() {
  case "$1.$2" in
    2S1*.5) echo 31.26 ;; 2S1*.10) echo 30.31 ;; 2S1*.15) echo 30.15 ;;
    ZSU*.5) echo 30.98 ;; ZSU*.10) echo 30.57 ;; ZSU*.15) echo 30.00 ;;
    BRDM*.5) echo 32.74 ;; BRDM*.10) echo 32.14 ;; BRDM*.15) echo 30.72 ;;
    *A64*.5) echo 30.53 ;; *A64*.10) echo 30.00 ;; *A64*.15) echo 29.95 ;;
    *) echo – ;;
  esac
}

table_2() {
  intervals="5 10 15"
  if $quick; then intervals=15; fi
  for folder in "$chips"/*/; do
    target=$(basename "$folder")
    if $quick && [ "$target" != "$(basename "$(echo "$chips"/*/ | cut -d ' ' -f 1)")" ]; then continue; fi
    cell "import_$target" 20 "$programs/sar_import/sar_import" images "$folder" --csv "$table" --amplitude-scale 4/65535 \
      --depression 17 -q -o "$out/chips_$target"
    for n in $intervals; do
      data=$out/chips_$target.$n
      cell "import_$target.$n" 10 "$programs/sar_import/sar_import" images "$folder" --csv "$table" --amplitude-scale 4/65535 \
        --depression 17 --every "$n" -q -o "$data"
      for f in surface grid; do learn $f "$data" "$out/chips_$target" 150; done
    done
  done
  text << TEXT

## Table 2: measured chips at 17°$heading

PSNR of amplitude of raw chips (dB), as the paper has it: of single images with speckle, which no method predicts.

| target | interval (°) | SAR-NeRF as printed | surface | grid | best interpolation |
|---|--:|--:|--:|--:|--:|
TEXT
  if $counting; then return; fi
  for folder in "$chips"/*/; do
    target=$(basename "$folder")
    for n in $intervals; do
      report=$out/chips_$target.$n
      if [ ! -f "$report.surface/report.json" ]; then continue; fi
      of_grid=$(model_and_best "$report.grid/report.json" evaluation psnr_amplitude_db)
      echo "| $target | $n | $(printed_chips "$target" "$n") | $(mean "$report.surface/report.json" psnr_amplitude_db %.2f) | $of_grid |"
    done
  done | text
  text << TEXT

*Chips restored from JPEG where the folder's are. The paper does not say over which peak its PSNR is; ours is over the peak of the training chips.*
TEXT
}

rm -f "$out/paper.md.part"
everything() {
  text << TEXT
# SAR-NeRF, and what we make of it

The tables and figures of Lei et al. (2023), made by \`scripts/paper.sh$(if $quick; then echo " --quick"; fi)\`, revision $revision, on $machine, $(nproc) cores.
TEXT
  figure_8
  table_1
  figure_9
  figures_10_11
  figures_12_13
  if [ -n "$chips" ]; then table_2; fi
}

everything
counting=false
echo "paper.sh: $n_cells cells, some $(((seconds_left + 59) / 60)) min, in $out" >&2
everything
mv "$out/paper.md.part" "$out/paper.md"
"$programs/sar_bench/sar_bench" page "$out/paper.md" -o "$out/paper.html"
