#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# shellcheck disable=SC2154
# Sourced by scripts/paper.sh: what the paper learns from measured chips. Without chips of one's own, those of a simulated truck.

depressions="15 17 30"  # of Figs. 15 and 16
intervals="5 10 15"
if $quick; then intervals=15; fi
chip_azimuths=0:358.8:1.2  # 300 chips; the paper's target has 299

# Measured chips, or the views that a truck would give: one look, MSTAR's spacing and impulse response, in Phoenix files, so that both
# take the same way.
measured=true targets=
if [ -z "$chips" ]; then
  measured=false targets=truck chips=$out/truck_chips
else
  for folder in "$chips"/*/; do targets="$targets $(basename "$folder")"; done
  if $quick; then targets=$(echo "$targets" | awk '{ print $1 }'); fi
fi
table=$(chips_table_of "$chips")
# The paper's target of several depressions.
turned=$(echo "$targets" | tr ' ' '\n' | grep -e '^2S1' -e '^truck$' | head -n 1)

import_chips() {
  if ! $measured; then
    for d in $depressions; do
      cell "simulate_$d" 30 "$programs/sar_render/sar_render" "$root/data/truck.obj" --depression "$d" --azimuth $chip_azimuths \
        --ground grass --size 128x128 --spacing 0.203,0.202 --slant-range 4500 --resolution 0.305 --window taylor:-35 --looks 1 --seed "$d" \
        --quantity amplitude -q -o "$out/truck_views/$d"
      cell "phoenix_$d" 5 "$programs/sar_import/sar_import" phoenix "$out/truck_views/$d" -q -o "$chips/truck/$d"
    done
  fi
  for target in $targets; do
    chips_of "$target" 17 all
    for n in $intervals; do chips_of "$target" 17 "$n" --every "$n"; done
  done
}

# chips_of TARGET DEPRESSIONS NAME [OPTION...]: the dataset OUT/chips_TARGET.NAME.
chips_of() {
  target=$1 wanted=$2 of=$3
  shift 3
  set -- --depression "$wanted" -q -o "$out/chips_$target.$of" "$@"
  if [ -f "$table" ]; then
    # shellcheck disable=SC2086  # several options
    set -- images "$chips/$target" --csv "$table" $import "$@"
  else
    set -- mstar "$chips/$target" "$@"
  fi
  cell "import_$target.$of" 10 "$programs/sar_import/sar_import" "$@"
}

chips_heading() { if $measured; then echo "measured chips$1"; else echo "chips of a simulated truck, not MSTAR's$1"; fi; }

# The paper's figures, at intervals of 5, 10 and 15 degrees.
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
  for target in $targets; do
    for n in $intervals; do
      for f in surface grid; do learn $f "$out/chips_$target.$n" "$out/chips_$target.all" 150 --despeckle 3; done
    done
  done
  text << TEXT

## Table 2: $(chips_heading ", at 17°")$heading

PSNR of amplitude (dB). *Raw*: against single chips with their speckle, which no method predicts; so the paper has it. *Means*: against the mean of every
second unseen chip within 3°. *Registered*: the same, each predicted view, an interpolated one too, shifted by up to two pixels; the truth chooses the shift on the even blocks of 16 × 16 pixels, and the odd blocks are scored,
so that these values do not compare with *means*. "True neighbours": the mean of the other unseen chips within 3°, what the speckle lets any method reach; no method has these chips.

| target | interval (°) | score | SAR-NeRF as printed | surface | grid | best interpolation | true neighbours | training, surface and grid (s) |
|---|--:|---|--:|--:|--:|--:|--:|--:|
TEXT
  if $counting; then return; fi
  for target in $targets; do
    for n in $intervals; do
      data=$out/chips_$target.$n
      took="$(training_seconds "$data.surface/report.json" | awk '{ printf "%.0f", $1 }'), $(training_seconds "$data.grid/report.json" | awk '{ printf "%.0f", $1 }')"
      of_surface=$(model_and_best "$data.surface/report.json" evaluation psnr_amplitude_db)
      echo "| $target | $n | raw | $(printed_chips "$target" "$n") | ${of_surface%% |*} | $(model_and_best "$data.grid/report.json" evaluation psnr_amplitude_db) | – | $took |"
      for score in psnr registered_psnr; do
        case $score in psnr) named=means ;; *) named=registered ;; esac
        of_surface=$(model_and_best "$data.surface/report.json" despeckled ${score}_amplitude_db 2)
        echo "| $target | $n | $named | – | ${of_surface%% |*} | $(model_and_best "$data.grid/report.json" despeckled ${score}_amplitude_db 2) | $took |"
      done
    done
  done | text
  text << TEXT

*PSNR is over the peak of the training chips; the paper does not say whether its own is of power or of amplitude, nor over which peak.$(
    if $measured && [ -f "$table" ]; then echo " Chips read from pictures, as MSTAR's restored from JPEG, have lost their absolute gain and exact peaks: the printed column does not compare with the others."; fi)*
TEXT
}

# predicted NAME RUN VIEWS: a run's prediction of a dataset's views.
predicted() {
  cell "$1" 8 "$programs/sar_nerf_render/sar_nerf_render" "$2" --views "$3" -o "$out/$1" -q
}

figure_14() {
  text << TEXT

## Fig. 14: $(chips_heading "")$heading

TEXT
  widest=${intervals##* }
  for target in $targets; do
    chips_of "$target" 17 some --every 40
    set -- "$out/chips_$target.some"
    for f in surface grid; do
      predicted "fig14_$target.$f" "$out/chips_$target.$widest.$f" "$out/chips_$target.some"
      set -- "$@" "$out/fig14_$target.$f"
    done
    strip "fig14_$target" "$@" --trained "$out/chips_$target.$widest"
    echo "![$target](fig14_$target.png)" | text
  done
  text << TEXT
*Azimuths from 0 to 320°. From above: a chip; predicted by \`surface\` and by \`grid\` from chips every $widest° at 17°. Views that were learned are framed.*
TEXT
}

figures_15_16() {
  if [ -z "$turned" ]; then return; fi
  listed=$(echo "$depressions" | tr ' ' ,)
  chips_of "$turned" "$listed" depressions --every 5
  chips_of "$turned" "$listed" depressions_all
  learn surface "$out/chips_$turned.depressions" "$out/chips_$turned.depressions_all" 300
  text << TEXT

## Fig. 15: $(chips_heading ", from three depressions")$heading

TEXT
  for d in $depressions; do
    chips_of "$turned" "$d" "some_$d" --every 33
    predicted "fig15_$turned.$d" "$out/chips_$turned.depressions.surface" "$out/chips_$turned.some_$d"
    strip "fig15_$d" "$out/chips_$turned.some_$d" "$out/fig15_$turned.$d" --trained "$out/chips_$turned.depressions"
    echo "![$turned at $d°](fig15_$d.png)" | text
  done
  text << TEXT
*$turned, learned by \`surface\` from chips every 5° at $(echo "$depressions" | sed 's/ /, /g')°. In each picture, a chip above, and its prediction below; framed ones were learned.*

## Fig. 16: depressions of which there is no chip$heading

TEXT
  for d in 12 20 35; do
    cell "fig16_$d" 8 "$programs/sar_nerf_render/sar_nerf_render" "$out/chips_$turned.depressions.surface" --depression $d --azimuth 0:320:40 \
      -q -o "$out/fig16_$turned.$d"
    strip "fig16_$d" "$out/fig16_$turned.$d"
    echo "![$turned at $d°](fig16_$d.png)" | text
  done
  text << TEXT
*Predicted at depressions of 12, 20 and 35°; azimuths from 0 to 320°.*
TEXT
}
