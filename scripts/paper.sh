#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The tables and figures of SAR-NeRF (Lei et al. 2023), the paper's printed values beside ours. Needs a build (scripts/demo.sh makes one).
set -eu

usage() {
  cat <<USAGE
Usage: scripts/paper.sh [--quick] [--only solids|chips] [--seconds N] [--chips FOLDER] [--import OPTIONS] [--lpips FILE] [--long]
         [--recorded] [--publish] [OUT]
Renders, learns, extracts and scores what the paper shows, and writes OUT/paper.md and OUT/paper.html (one file). What is in OUT is
not made again: an interrupted run goes on where it stopped. About six hours on two cores, three and a half with --recorded.
  --quick           fewer views of a quarter of the pixels and short trainings, in about ten minutes: to see what there is, not to quote
  --only PART       solids: Figs. 7 to 13 and Table 1; chips: Table 2 and Figs. 14 to 16
  --seconds N       no training longer than so; the page says it
  --chips FOLDER    of measured chips, a folder for each target: Phoenix files, or images with manifest.csv in FOLDER or beside it. The
                    folder of the paper's Figs. 15 and 16 begins with 2S1. Default: chips of a simulated truck
  --import OPTIONS  of sar_import images (default "--amplitude-scale 4/65535")
  --lpips FILE      weights for LPIPS (docs/guide/lpips.md)
  --long            the paper's method in every cell of Table 1, not in one (fourteen hours more)
  --recorded        scores of networks that docs/results/paper_cells has, instead of training these again
  --publish         of a full run with measured chips: copies the page to docs/paper.md, its pictures to docs/images/paper
  OUT               (default build/paper)
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
quick=false
long=false
recorded=false
publish=false
chips=
import="--amplitude-scale 4/65535"
lpips=
seconds=
only=
out=
. "$root/scripts/report_values.sh"
take_options "quick! long! recorded! publish! only seconds chips import lpips" out= "$@"
seconds_limit=$seconds
out=${out:-$root/build/paper}
case "$seconds_limit" in
  *[!0-9]*) echo "paper.sh: --seconds $seconds_limit: expected a number of seconds, found none" >&2; exit 2 ;;
esac
case "$only" in
  "" | solids | chips) ;;
  *) echo "paper.sh: --only $only: expected solids or chips" >&2; exit 2 ;;
esac
if $recorded && { $quick || [ -n "$seconds_limit" ]; }; then
  echo "paper.sh: --recorded: the recorded trainings are those of a full run; leave out --quick and --seconds" >&2
  exit 2
fi
if $publish && { $quick || [ -n "$seconds_limit$only" ] || [ -z "$chips" ]; }; then
  echo "paper.sh: --publish: expected a full run with --chips; leave out --quick, --seconds and --only" >&2
  exit 2
fi
if [ -n "$chips" ] && ! [ -d "$chips" ]; then
  echo "paper.sh: --chips $chips: expected a folder, found none" >&2
  exit 3
fi
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
mkdir -p "$out/cells"
revision=$(git -C "$root" rev-parse --short HEAD 2> /dev/null || echo unknown)

solids="cuboid platform_upright platform_inverted"
views="72 36 24 12"
test_azimuths=0:358:2
paper_azimuths=0:359:7  # the paper's method takes 20 s a view: what it skips must not change the result
paper_scoring=1000 paper_turning=260 paper_extracting=400
mlp_time=600 paper_time=3600
mlp_scoring=180
training_pitches=35:55:2
even_pitches="36 38 40 42 44 46 48 50 52 54"
far_pitches="30 60"
lattice=256 paper_lattice=128
pixels="--size 128x128 --spacing 0.3"
if $quick; then
  solids=cuboid
  views="36 12"
  test_azimuths=9:351:38
  paper_azimuths=9:237:114
  paper_scoring=60 paper_turning=40 paper_extracting=60
  mlp_time=30 paper_time=30
  mlp_scoring=30
  training_pitches=35:55:10
  even_pitches="40 50"
  lattice=64 paper_lattice=32
  pixels="--size 64x64 --spacing 0.6"  # a network takes seconds a view of the full size
fi
if [ -n "$seconds_limit" ]; then
  if [ "$seconds_limit" -lt $mlp_time ]; then mlp_time=$seconds_limit; fi
  if [ "$seconds_limit" -lt $paper_time ]; then paper_time=$seconds_limit; fi
fi

# Cells of other settings would be taken for this run's.
settings="quick $quick, recorded $recorded, only ${only:-everything}, long $long, seconds ${seconds_limit:-as planned}, chips ${chips:-simulated}, import $import, lpips ${lpips:-none}"
if [ -f "$out/settings.txt" ] && [ "$(cat "$out/settings.txt")" != "$settings" ]; then
  echo "paper.sh: $out: expected a folder of the same settings ($settings), found $(cat "$out/settings.txt"); choose another folder" >&2
  exit 2
fi
echo "$settings" > "$out/settings.txt"

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
  echo "$revision" > "$out/cells/$cell_name.done"
  seconds_left=$((seconds_left - cell_seconds))
}

# text: standard input becomes a part of the result.
text() {
  if $counting; then cat > /dev/null; else cat >> "$out/paper.md.part"; fi
}

# made_at: the revisions of the cells, and the processors of the trainings, recorded ones among them.
made_at() {
  echo
  printf '*Made at revision '
  for mark in "$out"/cells/*.done; do echo "$(cat "$mark") $(basename "$mark" .done | sed 's/^learn_//')"; done |
    awk '{ ++n[$1]; names[$1] = names[$1] (n[$1] > 1 ? ", " : "") $2 } END { for (r in n) print n[r] "|" r "|" names[r] }' | sort -rn |
    awk -F '|' '{ printf "%s%s (%s)", (NR > 1 ? ", " : ""), $2, (NR == 1 ? $1 " cells" : $3) }'
  echo ", on $(sed -n 's/^ *"processor": "\([^"]*\)".*/\1/p' "$out"/*/report.json | sort -u | paste -sd ,), $(nproc) cores.*"
}

# render SCENE OUT OPTIONS...: images of the paper's size unless quick, with four times as many rays as the automatic sampling, so that truth and
# learner share no discretisation.
render() {
  render_scene=$1 render_out=$2
  shift 2
  # The pixels are two options.
  # shellcheck disable=SC2086
  cell "render_$(basename "$render_out")" 5 "$programs/sar_render/sar_render" "$render_scene" $pixels --altitude 10000 \
    --engine surface --elevations 768 --sub-rows 27 -o "$render_out" -q "$@"
}

# learn FIELD DATA AGAINST SECONDS [OPTION...]: a run, OUT/DATA.FIELD.
learn() {
  field=$1 data=$2 against=$3 seconds=$4
  shift 4
  set -- --field "$field" --against "$against" --holdout 0 -o "$data.$field" -q "$@"
  case "$field" in
    mlp) set -- "$@" --time "${mlp_time}s" ;;
    paper) set -- "$@" --time "${paper_time}s" ;;
    *)
      if [ -n "$seconds_limit" ]; then
        set -- "$@" --time "${seconds_limit}s"
        if [ "$seconds" -gt "$seconds_limit" ]; then seconds=$seconds_limit; fi
      elif [ "$field" = surface ] && $quick; then
        set -- "$@" --steps 200
      fi ;;
  esac
  if [ -n "$lpips" ]; then set -- "$@" --lpips "$lpips"; fi
  # Of a network in Table 1 alone the scores are needed.
  cells=$root/docs/results/paper_cells/$(basename "$data").$field.json
  if $recorded && [ $field = mlp ] && [ -f "$cells" ]; then
    mkdir -p "$data.$field"
    cp "$cells" "$data.$field/report.json"
    sed -n 's/^ *"revision": "\(.*\)".*/\1/p' "$cells" > "$out/cells/learn_$(basename "$data").$field.done"
  fi
  cell "learn_$(basename "$data").$field" "$seconds" "$programs/sar_nerf_train/sar_nerf_train" "$data" "$@"
}

# mean REPORT KEY FORMAT: the model's mean over the unseen views, or a dash.
mean() {
  report_means "$1" evaluation "$2" | head -n 1 | awk -v f="$3" '$1 != "" { printf f, $1; n = 1 } END { if (!n) printf "–" }'
}

solid_name() { echo "$1" | sed 's/platform_upright/upright platform/; s/platform_inverted/inverted platform/'; }

# strip FILE ROW...: a picture, OUT/FILE.png, of datasets, one above the other.
strip() {
  strip_file=$1
  shift
  cell "strip_$strip_file" 1 "$programs/sar_bench/sar_bench" strip "$@" -o "$out/$strip_file.png"
}

heading=
if $quick; then heading=" (quick: fewer views of a quarter of the pixels, short trainings)"; fi
if [ -n "$seconds_limit" ]; then heading="$heading (no training longer than $seconds_limit s)"; fi

. "$root/scripts/paper/solids.sh"
. "$root/scripts/paper/chips.sh"

rm -f "$out/paper.md.part"
everything() {
  text << TEXT
# SAR-NeRF, and what we make of it

The tables and figures of Lei et al. (2023), made by \`scripts/paper.sh$(
    for option in quick recorded long; do
      if eval "\$$option"; then printf ' --%s' "$option"; fi
    done
    if [ -n "$chips" ]; then printf ' --chips CHIPS'; fi)\`. Every training has seed 1.
TEXT
  if [ "$only" != chips ]; then
    figure_7
    figure_8
    table_1
    curves_in_time
    figure_9
    figures_10_11
    figures_12_13
  fi
  if [ "$only" != solids ]; then
    import_chips
    table_2
    figure_14
    figures_15_16
  fi
  text << TEXT

## Table 3: recognition from few chips$heading

Table 3 was not replicated. \`sar_fewshot\` does a similar study with another network, another field and restored chips, beside what plain turning of the same chips gives. Added to turned chips, learned views raise an A-ConvNet by 2.5, 3.6 and 4.2 points with 12, 8 and 4 shots. Over the shots alone learned views gain 0.6 (interval − 1.9 to + 3.0, so no gain is shown), 4.3 and 16.8 points, where the paper's views gain a ResNet-50 6.4, 6.0 and 5.1; turned chips alone gain 3.3, 3.7 and 16.1, both together 5.7, 7.3 and 20.3. Turned chips that a field corrects gain 1.5, 3.4 and 4.2 over turned ones:
[recognition.md]($(realpath --relative-to="$out" "$root/docs/results/recognition.md")).
TEXT
  if ! $counting; then made_at | text; fi
}

everything
counting=false
echo "paper.sh: $n_cells cells, some $(((seconds_left + 59) / 60)) min, in $out" >&2
everything
mv "$out/paper.md.part" "$out/paper.md"
"$programs/sar_bench/sar_bench" page "$out/paper.md" -o "$out/paper.html"
if $publish; then
  publish "$out/paper.md" "$root/docs/paper.md" "$root/docs/images/paper"
fi
