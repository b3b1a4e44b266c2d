#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Makes the tables of docs/results anew, all at the checked-out revision. Needs a build and a quiet machine.
set -eu

usage() {
  cat <<USAGE
Usage: scripts/results.sh [--folder FOLDER] [--meshes FOLDER] [--chips FOLDER] [--insert] [STUDY...]
Runs each study and keeps its Markdown as FOLDER/STUDY.md. A study whose file is there is not run again. With --insert, each
table replaces the one between <!-- results STUDY --> and <!-- end --> in docs/results/*.md. The README's rows are means and copies of these, by hand.
Studies: accuracy solids ground learning pitch response speckle scenes chips depressions chip_bodies extraction surfaces surfaces_ground
trial; all without arguments.
  --folder FOLDER  (default build/results)
  --meshes FOLDER  meshes from outside: stanford-bunny.obj, Kenney's vehicle-truck-*.obj and building-small-*.obj; what
                   is missing is left out
  --chips FOLDER   a folder of chips for each target, and manifest.csv in it or beside it; without it, no study of measured chips
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
folder=$root/build/results
meshes=
chips=
insert=
studies=
while [ $# -gt 0 ]; do
  case "$1" in
    --folder) folder=$2; shift 2 ;;
    --meshes) meshes=$2; shift 2 ;;
    --chips) chips=$2; shift 2 ;;
    --insert) insert=yes; shift ;;
    -h | --help) usage; exit 0 ;;
    -*) usage >&2; exit 2 ;;
    *) studies="$studies $1"; shift ;;
  esac
done
studies=${studies:-accuracy solids ground learning pitch response speckle scenes chips depressions chip_bodies extraction surfaces surfaces_ground trial}
. "$root/scripts/report_values.sh"
# The studies run in FOLDER.
absolute() { case "$1" in "" | /*) echo "$1" ;; *) echo "$PWD/$1" ;; esac; }
folder=$(absolute "$folder")
meshes=$(absolute "$meshes")
chips=$(absolute "$chips")
chips_csv=$(chips_table_of "$chips")
SARNERF_PROGRAMS=$(absolute "${SARNERF_PROGRAMS:-$root/build/release/apps}")
export SARNERF_PROGRAMS
bench=$SARNERF_PROGRAMS/sar_bench/sar_bench
revision=$(git -C "$root" rev-parse --short HEAD)
machine=$(machine_name)
mkdir -p "$folder"
cd "$folder"
# Data and runs of another revision would be taken for this one's.
if [ -f revision.txt ] && [ "$(cat revision.txt)" != "$revision" ]; then
  echo "results: $folder has studies of revision $(cat revision.txt), this is $revision; choose another --folder" >&2
  exit 2
fi
echo "$revision" > revision.txt

# mesh NAME[:SCALE]: the mesh with its scale, or nothing where it is missing. shown NAME[:SCALE]: its name, as a reader would type it.
mesh() {
  if [ -n "$meshes" ] && [ -f "$meshes/${1%%:*}" ]; then echo "$meshes/$1"; fi
}
shown() {
  for name in "$@"; do
    if [ -n "$(mesh "$name")" ]; then printf ' %s' "$name"; fi
  done
}

# Each study prints its table, then the command that a reader would type.
study_accuracy() {
  command='sar_bench accuracy data/cuboid.json data/platform_upright.json data/building_14x8.json data/street.json --rounds 3'
  accuracy() { "$bench" accuracy "$@" --rounds 3 --table accuracy_table.md --diagrams accuracy > accuracy.json; }
  accuracy "$root/data/cuboid.json" "$root/data/platform_upright.json" "$root/data/building_14x8.json" "$root/data/street.json"
  cat accuracy_table.md
  for item in vehicle-truck-green.obj:2.5 building-small-a.obj:10 stanford-bunny.obj:60; do
    if [ -z "$(mesh "$item")" ]; then continue; fi
    accuracy "$meshes/${item%%:*}" --scale "${item##*:}"
    sed 1,2d accuracy_table.md
    command="$command; sar_bench accuracy ${item%%:*} --scale ${item##*:} --rounds 3"
  done
}
study_solids() {
  "$root/scripts/nerf_table.sh" solids.data
  command=scripts/nerf_table.sh
}
study_ground() {
  "$root/scripts/nerf_table.sh" --ground --views "36 24 12" ground.data
  command='scripts/nerf_table.sh --ground --views "36 24 12"'
}
study_learning() {
  render_cuboid() {
    "$SARNERF_PROGRAMS/sar_render/sar_render" "$root/data/cuboid.json" --pitch 45 --azimuth "$1" --size 128x128 --spacing 0.3 \
      --engine surface --elevations 768 --sub-rows 27 -o "$2" -q > /dev/null
  }
  render_cuboid 0:350:10 cuboid_36
  render_cuboid 5:355:10 cuboid_between
  "$bench" learning cuboid_36 --against cuboid_between --fields grid,mlp --time grid=2s,3s,5s,10s,20s --time mlp=60s \
    --views 12 -o learning.study --overwrite
  command='sar_bench learning cuboid_36 --against cuboid_between --fields grid,mlp --time grid=2s,3s,5s,10s,20s --time mlp=60s --views 12'
}
study_pitch() {
  "$root/scripts/nerf_pitch.sh" --azimuths 0:345:15 pitch.data
  command='scripts/nerf_pitch.sh --azimuths 0:345:15'
}
study_response() {
  # shellcheck disable=SC2046  # no mesh is no argument
  "$root/scripts/response_table.sh" --folder response.data $(mesh vehicle-truck-green.obj:3)
  command="scripts/response_table.sh$(shown vehicle-truck-green.obj:3)"
}
study_speckle() {
  # shellcheck disable=SC2046
  "$root/scripts/speckle_table.sh" --folder speckle.data $(mesh vehicle-truck-green.obj:3) "$root/data/l_building.json"
  command="scripts/speckle_table.sh$(shown vehicle-truck-green.obj:3) data/l_building.json"
}
study_scenes() {
  "$root/scripts/scenes_table.sh" --folder scenes.data
  command='scripts/scenes_table.sh'
}
study_chips() {
  targets=
  for target in 2S1_b01 ZSU_23_4_d08 BRDM_2_E-71 T72_A64; do targets="$targets $chips/$target"; done
  # shellcheck disable=SC2086
  "$root/scripts/chips_table.sh" --folder chips.data --import "--csv $chips_csv --amplitude-scale 4/65535" $targets
  command='scripts/chips_table.sh --import "--csv manifest.csv --amplitude-scale 4/65535" 2S1_b01 ZSU_23_4_d08 BRDM_2_E-71 T72_A64'
}
study_chip_bodies() {
  bodies() { "$root/scripts/chip_bodies.sh" --folder chip_bodies.data --import "--csv $chips_csv --amplitude-scale 4/65535" "$@"; }
  bodies "$chips/2S1_b01" "$chips/BRDM_2_E-71" "$chips/ZSU_23_4_d08" "$chips/T72_A64"
  bodies --depressions 15,17,30 "$chips/2S1_b01" > more.part
  sed 1,2d more.part
  command='scripts/chip_bodies.sh --import "--csv manifest.csv --amplitude-scale 4/65535" 2S1_b01 BRDM_2_E-71 ZSU_23_4_d08 T72_A64, and 2S1_b01 with --depressions 15,17,30'
}
study_depressions() {
  "$root/scripts/depressions_table.sh" --folder depressions.data --import "--csv $chips_csv --amplitude-scale 4/65535" \
    "$chips/2S1_b01"
  command='scripts/depressions_table.sh --import "--csv manifest.csv --amplitude-scale 4/65535" 2S1_b01'
}
study_surfaces() {
  # shellcheck disable=SC2046
  "$root/scripts/surfaces_table.sh" --folder surfaces.data "$root/data/platform_inverted.json" $(mesh spot.obj:6) \
    $(mesh vehicle-truck-green.obj:2.5) $(mesh building-small-a.obj:10)
  command="scripts/surfaces_table.sh data/platform_inverted.json$(shown spot.obj:6 vehicle-truck-green.obj:2.5 building-small-a.obj:10)"
}
study_surfaces_ground() {
  "$root/scripts/surfaces_table.sh" --folder surfaces.data --sets 36 --ground grass
  "$root/scripts/surfaces_table.sh" --folder surfaces.data --sets "36 396" --ground grass --looks 4 > more.part
  sed 1,2d more.part
  command='scripts/surfaces_table.sh --sets 36 --ground grass; scripts/surfaces_table.sh --sets "36 396" --ground grass --looks 4'
}
study_extraction() {
  solids=
  for solid in cuboid platform_upright platform_inverted l_building; do solids="$solids $root/data/$solid.json"; done
  # shellcheck disable=SC2046,SC2086
  "$root/scripts/extract_table.sh" --folder extraction.data $solids $(mesh building-small-a.obj:10) $(mesh building-small-c.obj:10) \
    $(mesh vehicle-truck-green.obj:3) $(mesh vehicle-truck-red.obj:3)
  command="scripts/extract_table.sh data/cuboid.json data/platform_upright.json data/platform_inverted.json data/l_building.json$(shown building-small-a.obj:10 \
    building-small-c.obj:10 vehicle-truck-green.obj:3 vehicle-truck-red.obj:3)"
}

study_trial() {
  # shellcheck disable=SC2046
  "$root/scripts/trial_table.sh" --folder trial.data "$root/data/tree.obj" $(mesh vehicle-truck-green.obj:2.5)
  command="scripts/trial_table.sh data/tree.obj$(shown vehicle-truck-green.obj:2.5)"
}

# put STUDY: its table into every page that has a place for it.
put() {
  if [ ! -s "$folder/$1.md" ]; then echo "results: $folder/$1.md: expected a table, found none" >&2; exit 1; fi
  for page in "$root"/docs/results/*.md; do
    grep -qF "<!-- results $1 -->" "$page" || continue
    awk -v begin="<!-- results $1 -->" -v file="$folder/$1.md" '
      $0 == begin { print; while ((getline line < file) > 0) print line; skip = 1; next }
      skip && $0 == "<!-- end -->" { skip = 0 }
      !skip' "$page" > "$page.new"
    mv "$page.new" "$page"
    echo "results: $1 is in ${page#"$root"/}" >&2
  done
}

for study in $studies; do
  case "$study" in
    chips | depressions | chip_bodies)
      if [ -z "$chips" ]; then echo "results: $study is left out: no --chips" >&2; continue; fi ;;
  esac
  if [ ! -s "$study.md" ]; then
    echo "results: $study" >&2
    start=$(date +%s)
    "study_$study" > "$study.part"
    {
      echo
      cat "$study.part"
      echo
      echo "*\`$command\`, revision $revision, $(date +%F), $(nproc) cores of $machine, $((($(date +%s) - start + 59) / 60)) min.*"
      echo
    } > "$study.md"
    rm "$study.part"
  fi
  if [ -n "$insert" ]; then put "$study"; fi
done
