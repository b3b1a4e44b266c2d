#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# shellcheck disable=SC2154
# Sourced by scripts/paper.sh: the paper's buildings and its three solids, rendered, learned and extracted.

# Fig. 7: buildings as the paper's equations 32 to 34 have them, width x height in metres.
figure_7() {
  buildings="14x8 10x10 8x14"
  for size in $buildings; do
    for engine in surface voxel; do
      cell "fig7_$size.$engine" 5 "$programs/sar_render/sar_render" "$root/data/building_$size.json" --pitch 45 --azimuth 0,180 --size 96x192 \
        --spacing 0.2 --altitude 10000 --layers wall,roof,mask --engine $engine -o "$out/$size.$engine" -q
    done
    cell "fig7_$size.extents" 1 "$programs/sar_bench/sar_bench" extents "$out/$size.surface" "$out/$size.voxel" -q
    strip "fig7_$size" "$out/$size.voxel" "$out/$size.surface" --difference --zoom 2
  done
  text << TEXT

## Fig. 7: wall, roof and shadow of three buildings$heading

Roof of width w, walls of height h, incidence α = 45°, cot α = 1 (the paper's equations 32 to 34). Extents in slant range are measured at azimuth 0°, in whole bins
of 0.2 m of the middle azimuth row (\`sar_bench extents\`): wall and roof are the bins above half of the median of their layer, the shadow those where nothing else is seen. In closed form the wall has h cos α and the roof w sin α; the shadow is what of (w + h tan α) sin α lies behind them.

| w × h (m) | printed case | extents (m) of | wall | roof | shadow | ‖voxel − surface‖₂ / ‖surface‖₂ of power |
|---|---|---|--:|--:|--:|--:|
TEXT
  if $counting; then return; fi
  for size in $buildings; do
    case $size in
      14x8) printed="w/h > cot α: the roof is the longer" ;;
      10x10) printed="w/h = cot α: they coincide" ;;
      *) printed="w/h < cot α: the wall is the longer" ;;
    esac
    echo "$size" | awk -F x -v printed="$printed" '{ c = sqrt(0.5); w = $1 * c; h = $2 * c
      printf "| %s | %s | closed form | %.2f | %.2f | %.2f | – |\n", $0, printed, h, w, w + h - (w > h ? w - h : 0) }'
    for engine in surface voxel; do
      grep "^| $size.$engine | 0°" "$out/cells/fig7_$size.extents.log" | awk -F '|' -v row="| $size | $printed | $engine engine" '{ print row " |" $4 "|" $5 "|" $6 "|" $7 "|" }'
    done
  done | text
  echo | text
  for size in $buildings; do echo "![building of $size m](fig7_$size.png)"; done | text
  text << TEXT
*Azimuths 0 and 180°. From above: the voxel engine, as in the paper; the surface engine; their difference, in the same decibels.*
TEXT
}

figure_8() {
  text << TEXT

## Fig. 8: three solids$heading

TEXT
  for solid in $solids; do
    for engine in voxel surface; do
      cell "fig8_$solid.$engine" 10 "$programs/sar_render/sar_render" "$root/data/$solid.json" --pitch 45 --azimuth 30:70:40 --size 128x128 \
        --spacing 0.3 --altitude 10000 --engine $engine -o "$out/fig8_$solid.$engine" -q
    done
    strip "fig8_$solid" "$out/fig8_$solid.voxel" "$out/fig8_$solid.surface"
    echo "![$(solid_name "$solid")](fig8_$solid.png)" | text
  done
  text << TEXT
*128 × 128 pixels of 0.3 m, pitch 45°, altitude 10 km, azimuths 30 and 70°. Above: the voxel engine, as in the paper; below: the surface engine.*
TEXT
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

# best_baseline REPORT KEY FORMAT: the largest mean of an interpolation.
best_baseline() {
  report_means "$1" evaluation "$2" | awk -v f="$3" 'NR > 1 && $1 > best { best = $1 } END { printf f, best }'
}

table_1() {
  for solid in $solids; do
    render "$root/data/$solid.json" "$out/$solid.test" --pitch 45 --azimuth $test_azimuths
    if $long || [ "$solid" = cuboid ]; then render "$root/data/$solid.json" "$out/$solid.some" --pitch 45 --azimuth $paper_azimuths; fi
    for n in $views; do
      step=$(awk "BEGIN { print 360 / $n }")
      last=$(awk "BEGIN { print 360 - 360 / $n }")
      render "$root/data/$solid.json" "$out/$solid.$n" --pitch 45 --azimuth "0:$last:$step"
      for f in surface grid mlp; do
        case $f in mlp) s=$((mlp_time + mlp_scoring)) ;; *) s=60 ;; esac
        learn $f "$out/$solid.$n" "$out/$solid.test" $s
      done
      if $long || [ "$solid.$n" = cuboid.36 ]; then
        learn paper "$out/$solid.$n" "$out/$solid.some" $((paper_time + paper_scoring))
      fi
    done
  done
  text << TEXT

## Table 1: unseen azimuths at 45°$heading

| solid | views | method | PSNR (dB) | SSIM | LPIPS | training (s) | steps |
|---|--:|---|--:|--:|--:|--:|--:|
TEXT
  if $counting; then return; fi
  for solid in $solids; do
    for n in $views; do
      name=$(solid_name "$solid")
      paper=$(printed "$solid" "$n")
      echo "| $name | $n | SAR-NeRF as printed | ${paper%% |*} | – | ${paper##*| } | – | – |"
      for f in paper mlp grid surface; do
        report=$out/$solid.$n.$f/report.json
        if [ ! -f "$report" ]; then continue; fi
        echo "| $name | $n | $f | $(mean "$report" psnr_power_db %.2f) | $(mean "$report" ssim_power %.4f) | $(mean "$report" lpips %.4f) | $(training_seconds "$report" | awk '{ printf "%.0f", $1 }') | $(trained_steps "$report") |"
        if [ $f = paper ]; then
          echo "| $name | $n | best interpolation, views of \`paper\` | $(best_baseline "$report" psnr_power_db %.2f) | $(best_baseline "$report" ssim_power %.4f) | – | 0 | – |"
        fi
      done
      report=$out/$solid.$n.grid/report.json
      echo "| $name | $n | best interpolation | $(best_baseline "$report" psnr_power_db %.2f) | $(best_baseline "$report" ssim_power %.4f) | – | 0 | – |"
    done
  done | text
  text << TEXT

*PSNR of power over the peak of the training images, mean over the unseen azimuths of $test_azimuths°; the best of all interpolations is chosen for each score.
\`paper\`: the method to the letter (\`--field paper\`), scored at those of $paper_azimuths°, where the best interpolation is a row of its own. \`mlp\`: its network with an exact rule, carving, pruning and a schedule. \`grid\`: voxels of extinction and
spherical harmonics of brightness. \`surface\`: a signed distance and brightness. All with default options. Interpolations are of the training images, turned or not. The images are those of the surface engine with four times as many rays as its automatic
sampling; the printed values are of the authors' own images. The paper does not say whether its PSNR is of power or of amplitude, nor over which peak. The paper's second row of the inverted
platform is printed as "5/72" and taken for 36 views.$(if [ -z "$lpips" ]; then echo " LPIPS of ours needs weights (\`--lpips\`)."; fi)*
TEXT
}

# PSNR of unseen views during the trainings from 36 views of the cuboid; recorded networks and very short trainings have no such curve.
curves_in_time() {
  set --
  for f in paper mlp grid surface; do
    if grep -q psnr_power_db "$out/cuboid.36.$f/metrics.jsonl" 2> /dev/null; then set -- "$@" "$f=$out/cuboid.36.$f"; fi
  done
  if ! $counting && [ $# -eq 0 ]; then return; fi
  cell curves_cuboid 1 "$programs/sar_bench/sar_bench" curves "$@" --title "Cuboid, 36 views" -o "$out/curves_cuboid.png"
  text << TEXT

![cuboid, 36 views: PSNR against seconds](curves_cuboid.png)
*At most eight of the unseen views, scored during the trainings: the last point lies before the end, and the table has all views.$(
    if $recorded; then echo " \`mlp\` was recorded without a curve."; fi)*
TEXT
}

# Trained views are every 10 degrees: of these azimuths the first and the last one, as in the paper's figure; quick: the first one.
turn=0:90:9
if $quick; then turn=0:45:45; fi

figure_9() {
  text << TEXT

## Fig. 9: azimuths from 0 to 90°$heading

TEXT
  for solid in $solids; do
    render "$root/data/$solid.json" "$out/$solid.turn" --pitch 45 --azimuth $turn
    set -- "$out/$solid.turn"
    for f in surface paper; do
      if [ "$f" = paper ] && ! $long && [ "$solid" != cuboid ]; then continue; fi
      if [ "$f" = paper ]; then s=$paper_turning; else s=8; fi
      cell "turn_$solid.$f" "$s" "$programs/sar_nerf_render/sar_nerf_render" "$out/$solid.36.$f" --pitch 45 --azimuth $turn -o "$out/$solid.turn.$f" -q
      set -- "$@" "$out/$solid.turn.$f"
    done
    strip "turn_$solid" "$@" --trained "$out/$solid.36"
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
        cell "pitch_$solid.$p.$f" 8 "$programs/sar_nerf_render/sar_nerf_render" "$out/$solid.pitches.$f" --against "$out/$solid.pitch$p" \
          -o "$out/$solid.pitch$p.$f.scores"
      done
    done
    for p in ${even_pitches%% *} $far_pitches; do
      cell "pitch_$solid.$p.views" 8 "$programs/sar_nerf_render/sar_nerf_render" "$out/$solid.pitches.surface" --pitch "$p" --azimuth 0:324:36 \
        -o "$out/$solid.pitch$p.surface" -q
      strip "pitch_$solid.$p" "$out/$solid.pitch$p" "$out/$solid.pitch$p.surface"
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

Learned from the pitches $training_pitches°, azimuths every 10°. PSNR of power (dB) over the azimuths 0:324:36° of each unseen pitch, of which 0° and 180° were trained at the neighbouring pitches.

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
*Above: rendered; below: predicted by \`surface\`. $(echo "$far_pitches" | sed "s/ / and /")° lie outside of the learned pitches.*
TEXT
}

figures_12_13() {
  for solid in $solids; do
    fields=surface
    if [ "$solid" = cuboid ] || $long; then fields="surface paper"; fi
    for f in $fields; do
      data=$out/$solid.pitches
      n_voxels=$lattice s=60
      if [ $f = paper ]; then data=$out/$solid.36 n_voxels=$paper_lattice s=$paper_extracting; fi
      cell "body_$solid.$f" "$s" "$programs/sar_extract/sar_extract" "$data.$f" "$out/$solid.$f.vdb" --resolution $n_voxels --extent 20 \
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
*Lattices of $lattice³ voxels over 20 m; of $paper_lattice³ for the paper's method. Of the paper's method a voxel is full where its extinction reaches the automatic threshold; the paper removes those with σ = 0. Visible Chamfer: the mean distance between the surfaces of both bodies, over what the views see.*
TEXT
}

