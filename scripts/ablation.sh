#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The ablation of the learning method on generated scenes. Needs a build (cmake --build --preset release).
set -eu

usage() {
  cat <<USAGE
Usage: scripts/ablation.sh [--folder FOLDER] [--spot FILE] [--data] [OPTIONS of sar_bench ablation...]
Renders generated scenes (seeds 101 to 110, 121 to 126, 131 to 135, 141 to 145, 151 to 156, 161 to 165; spot where its mesh is
given), each in one configuration, and leaves out each rule and prior of learning alone (sar_bench ablation). What is there is
not made again. FOLDER/result has the cells (cells.jsonl) and the table (ablation.md).
  --folder FOLDER  (default build/ablation)
  --spot FILE      spot.obj, 1.7 m long as published; rendered 6 times as large
  --data           only render
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
folder=$root/build/ablation
spot=
only_data=
while [ $# -gt 0 ]; do
  case "$1" in
    --folder) folder=$2; shift 2 ;;
    --spot) spot=$2; shift 2 ;;
    --data) only_data=yes; shift ;;
    -h | --help) usage; exit 0 ;;
    *) break ;;
  esac
done
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
. "$root/scripts/shifted_views.sh"
mkdir -p "$folder/data"
"$programs/sar_bench/sar_bench" scenes --seed 101:110 -o "$folder/scenes" -q > /dev/null
"$programs/sar_bench/sar_bench" scenes --seed 121:126 -o "$folder/scenes" -q > /dev/null
"$programs/sar_bench/sar_bench" scenes --seed 131:135 -o "$folder/scenes" -q > /dev/null
"$programs/sar_bench/sar_bench" scenes --seed 141:145 -o "$folder/scenes" -q > /dev/null
"$programs/sar_bench/sar_bench" scenes --seed 151:156 -o "$folder/scenes" -q > /dev/null
"$programs/sar_bench/sar_bench" scenes --seed 161:165 -o "$folder/scenes" -q > /dev/null

# Azimuths of 12 and 36 training views, and those that judge.
few=0:330:30 many=0:350:10 unseen=7.3:337.3:30
sets=
# data NAME SCENE AZIMUTHS PITCHES LOOKS OPTIONS...
data() {
  name=$1 scene=$2 azimuths=$3 pitches=$4 looks=$5
  shift 5
  sets="$sets $folder/data/$name"
  render() {
    "$programs/sar_render/sar_render" "$scene" --pitch "$pitches" "$@" -q > /dev/null
  }
  render "$@" --azimuth "$azimuths" --looks "$looks" -o "$folder/data/$name"
  render "$@" --azimuth "$unseen" -o "$folder/data/$name.truth"
}
# measured NAME SCENE DEPRESSION: as measured chips, 36 views of one look over a textured ground, whose poses are not exact: shifted by
# 0.6 pixel (root mean square) along track and in range.
measured() {
  sets="$sets $folder/data/$1"
  set -- "$1" "$2" "$3" --materials "$folder/materials.json" --ground meadow --size 112x128 --spacing 0.2 --resolution 0.3 --window taylor:-35
  name=$1 scene=$2 depression=$3
  shift 3
  shifted_views 0.2 "$folder/data/$name" "$(seq -s ' ' 0 10 350)" "$depression" 1 "$scene" "$@"
  "$programs/sar_render/sar_render" "$scene" "$@" --depression "$depression" --aim 0,1.2,0 --azimuth $unseen -q \
    -o "$folder/data/$name.truth" > /dev/null
}
# between NAME SCENE PITCHES PITCHES_UNSEEN: clean, 24 azimuths of each pitch; judged at pitches between these.
between() {
  sets="$sets $folder/data/$1"
  view="--size 96x96 --spacing 0.3 -q"
  # shellcheck disable=SC2086
  "$programs/sar_render/sar_render" "$2" --pitch "$3" --azimuth 0:345:15 $view -o "$folder/data/$1" > /dev/null
  # shellcheck disable=SC2086
  "$programs/sar_render/sar_render" "$2" --pitch "$4" --azimuth "$unseen" $view -o "$folder/data/$1.truth" > /dev/null
}
scene() { echo "$folder"/scenes/"$1"_*/scene.json; }

cat > "$folder/materials.json" <<MATERIALS
{"format": "sarnerf-materials", "version": 1, "materials": {
  "meadow": {"gamma0": 0.15, "exponent": 0.5, "texture": {"kind": "checker", "period_m": 4.0, "contrast": 0.3}}}}
MATERIALS
dark="--size 96x96 --spacing 0.3"
meadow="--ground grass --size 112x128 --spacing 0.25"
response="--resolution 0.4 --window taylor:-35"
# shellcheck disable=SC2086  # several options
{
  if [ -n "$spot" ]; then data spot "$spot" $many 45 inf --scale 6 $dark; fi
  data 101 "$(scene 101)" $few 45 inf $dark
  data 102 "$(scene 102)" $many 45 inf $dark --resolution 0.45 --window taylor:-35
  data 103 "$(scene 103)" $many 60 1 $meadow
  data 104 "$(scene 104)" $few 35,45,55 inf $dark
  data 105 "$(scene 105)" $many 45 inf $meadow
  data 106 "$(scene 106)" $many 60 4 $meadow $response
  data 107 "$(scene 107)" $few 60 4 $meadow
  data 108 "$(scene 108)" $few 50,60,70 1 $meadow $response
  data 109 "$(scene 109)" $few 45 inf $meadow
  data 110 "$(scene 110)" $many 60 1 $meadow $response
  # Five scenes at least for each rule: few views without a ground, the response, several looks.
  data 121 "$(scene 121)" $few 45 inf $dark
  data 122 "$(scene 122)" $few 45 inf $dark --resolution 0.45 --window taylor:-35
  data 123 "$(scene 123)" $few 40,50 inf $dark
  data 124 "$(scene 124)" $few 60 4 $meadow $response
  data 125 "$(scene 125)" $many 60 4 $meadow
  data 126 "$(scene 126)" $many 60 4 $meadow $response
  for seed in 131 132 133 134 135; do measured $seed "$(scene $seed)" 25; done
  # Many directions.
  for seed in 151 152 153 154 155 156; do between $seed "$(scene $seed)" 35:55:4 37,45,53; done
  # A response; --without response makes it an unknown one.
  for seed in 161 162 163 164 165; do data $seed "$(scene $seed)" $many 45 inf $dark --resolution 0.45 --window taylor:-35; done
  # Too few views to estimate a ground.
  for seed in 141 142 143 144 145; do data $seed "$(scene $seed)" 0:288:72 45 inf $meadow; done
}
if [ -n "$only_data" ]; then exit 0; fi
# shellcheck disable=SC2086
exec "$programs/sar_bench/sar_bench" ablation $sets -o "$folder/result" "$@"
