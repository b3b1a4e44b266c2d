#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Which of the paper's claims about its network hold? One change at a time. Needs a build (scripts/demo.sh makes one).
set -eu

usage() {
  cat <<USAGE
Usage: scripts/paper_claims.sh [--seeds N] [--time SECONDS] [--jobs N] [--publish] [--folder FOLDER]
Learns 36 views of the cuboid, 64 x 64 pixels of 0.6 m, with the field mlp and one change at a time, and prints held-out PSNR
against seconds and steps (Markdown); claims.html and the diagrams are in FOLDER. What is there is not made again. About five
hours on two cores, half of it with --jobs 2.
  --seeds N         runs of each setting (default 5)
  --time SECONDS    of each run (default 300)
  --jobs N          runs at the same time, each on an equal number of cores (default 1)
  --publish         copies the page to docs/results/paper_claims.md, its diagrams to docs/images/paper_claims
  --folder FOLDER   (default build/paper_claims)
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
seeds=5
time=300
jobs=1
publish=false
folder=$root/build/paper_claims
. "$root/scripts/report_values.sh"
take_options "seeds time jobs publish! folder" "" "$@"
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
for number in "$seeds" "$time" "$jobs"; do
  case "$number" in
    "" | *[!0-9]* | 0*) echo "paper_claims.sh: --seeds, --time and --jobs: expected whole numbers above 0, found '$number'" >&2; exit 2 ;;
  esac
done
threads=$(($(nproc) / jobs))
if [ "$threads" -lt 1 ]; then
  echo "paper_claims.sh: --jobs $jobs: expected at most one for each of $(nproc) cores" >&2
  exit 2
fi
mkdir -p "$folder"
# Runs of other settings would be taken for this study's.
settings="$time s, $threads threads"
if [ -f "$folder/settings.txt" ] && [ "$(cat "$folder/settings.txt")" != "$settings" ]; then
  echo "paper_claims.sh: $folder: expected runs of $settings, found those of $(cat "$folder/settings.txt"); choose another folder" >&2
  exit 2
fi
echo "$settings" > "$folder/settings.txt"
revision=$(git -C "$root" rev-parse --short HEAD 2> /dev/null || echo unknown)

render() {
  "$programs/sar_render/sar_render" "$root/data/cuboid.json" --pitch 45 --azimuth "$1" --size 64x64 --spacing 0.6 --altitude 10000 \
    --engine surface --elevations 768 --sub-rows 54 -o "$2" -q > /dev/null
}
render 0:350:10 "$folder/data"
render 5:355:30 "$folder/test"

# The first pass lists the runs that are missing, a command a line, in FOLDER/missing; the second one makes tables of all.
listing=true
n_missing=0

# setting NAME RUN OPTIONS...: the runs RUN.SEED, appended to `methods` as NAME=RUN.1,RUN.2.
setting() {
  name=$1 base=$2
  shift 2
  runs=
  for seed in $(seq "$seeds"); do
    run=$folder/$base.$seed
    if $listing && [ ! -f "$run/report.json" ] && ! grep -q " '$run' " "$folder/missing"; then
      n_missing=$((n_missing + 1))
      echo "echo 'paper_claims.sh: run $n_missing, $name, seed $seed' >&2; '$programs/sar_nerf_train/sar_nerf_train' '$folder/data' -o '$run' \
--field mlp --against '$folder/test' --holdout 0 --time ${time}s --seed $seed --threads $threads -q $* > '$folder/$base.$seed.log' 2>&1 || \
{ tail -n 1 '$folder/$base.$seed.log' >&2; exit 255; }; echo '$revision' > '$run/revision.txt'" >> "$folder/missing"
    fi
    runs=$runs${runs:+,}$run
  done
  methods="$methods
$name=$runs"
}

# study FILE TITLE: table and diagrams of the settings since the last one, a line of `methods` each.
study() {
  if $listing; then return; fi
  spaces=$IFS
  IFS='
'
  {
    echo
    echo "## $2"
    echo
    # shellcheck disable=SC2086  # several methods
    "$programs/sar_bench/sar_bench" curves $methods -o "$folder/$1.png" --title "$2"
    # shellcheck disable=SC2086
    "$programs/sar_bench/sar_bench" curves $methods -o "$folder/$1_steps.png" --title "$2" --steps > /dev/null
    echo
    echo "![$2, against seconds]($1.png)"
    echo "![$2, against steps]($1_steps.png)"
    echo
  } >> "$folder/claims.md"
  IFS=$spaces
  methods=
}

all_settings() {
  methods=
  setting "exact rule" default
  setting "tanh gate" tanh_gate --option integrator=paper-gated
  setting ungated ungated --option integrator=paper
  study activation "Activation: the paper's gate (tanh), without a gate, and the exact rule"
  for frequencies in 4 6 8 10; do setting "L: $frequencies" "L$frequencies" --option position_frequencies=$frequencies; done
  study encoding "Number of frequencies L of the encoding"
  setting "three frequencies" default
  setting "direction alone" no_frequencies --option direction_frequencies=0
  setting "no direction" no_direction --option direction_frequencies=-1
  study direction "Direction in G: with three frequencies (the default for 36 views), as it is, and left out"
  setting "8 x 256" default
  setting "8 x 128" w128 --option width=128
  setting "8 x 64" w64 --option width=64
  setting "4 x 256" d4 --option depth=4 --option skip=2
  study size "Size of the network: layers x features"
}

: > "$folder/missing"
all_settings
echo "paper_claims.sh: $n_missing runs, some $(((n_missing * (time + 20) / jobs + 59) / 60)) min, in $folder" >&2
if [ "$n_missing" -gt 0 ]; then
  # xargs stops at a run that fails (255); what was made stays.
  tr '\n' '\0' < "$folder/missing" | xargs -0 -P "$jobs" -I COMMAND sh -c COMMAND
fi
listing=false
cat > "$folder/claims.md" <<TEXT
# Which of the paper's claims about its network hold

The field \`mlp\`, 36 views of the cuboid at 45°, 64 × 64 pixels of 0.6 m; PSNR of power over 12 unseen azimuths; $seeds seeds, mean (least to largest). Made by
\`scripts/paper_claims.sh --seeds $seeds --time $time --jobs $jobs\`, revision $(cat "$folder"/*/revision.txt | sort | uniq -c | sort -rn | awk '{ printf "%s%s (%d runs)", (NR > 1 ? ", " : ""), $2, $1 }'), on
$(machine_name), $threads of $(nproc) cores for each run. \`8 x 256\`, \`exact rule\` and \`three frequencies\` are the same runs.
TEXT
all_settings
"$programs/sar_bench/sar_bench" page "$folder/claims.md" -q > /dev/null
cat "$folder/claims.md"
if $publish; then publish "$folder/claims.md" "$root/docs/results/paper_claims.md" "$root/docs/images/paper_claims"; fi
