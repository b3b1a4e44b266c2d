#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Learning from measured chips of several depressions. Needs a build (scripts/demo.sh makes one) and chips of your own.
set -eu

usage() {
  cat <<USAGE
Usage: scripts/depressions_table.sh [--sets LIST] [--every DEG] [--folder FOLDER] [--import OPTIONS] CHIPS
Learns from chips of some depressions and compares those of others with their means over 3 degrees, beside the best of all
baselines in each column and what means of other chips as near reach (Markdown). Data and runs stay in FOLDER.
  --sets LIST       trained:predicted (default "15,17,30:15,17,30 15,30:17 15,17:30"); of depressions in both, the
                    azimuths between those trained on
  --every DEG       degrees between training azimuths (default 5)
  --folder FOLDER   (default build/depressions_table)
  --import OPTIONS  of sar_import images, such as "--csv manifest.csv --amplitude-scale 4/65535"
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
sets="15,17,30:15,17,30 15,30:17 15,17:30"
every=5
folder=$root/build/depressions_table
import=
chips=
. "$root/scripts/report_values.sh"
take_options "sets every folder import" chips= "$@"
if [ -z "$chips" ]; then usage >&2; exit 2; fi
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
mkdir -p "$folder"

# import DEPRESSIONS NAME [OPTION...]: what is there already is kept.
import() {
  depressions=$1 name=$2
  shift 2
  # shellcheck disable=SC2086  # several options
  "$programs/sar_import/sar_import" images "$chips" $import --depression "$depressions" -q -o "$folder/$name" "$@" > /dev/null
}

echo "| trained | predicted | $despeckled_head"
echo "|---|---|$despeckled_rule"
for set in $sets; do
  trained=${set%%:*} predicted=${set##*:}
  data=$folder/$trained.$every
  run=$folder/$trained.$every.to.$predicted
  import "$trained" "$trained.$every" --every "$every"
  import "$predicted" "$predicted.all"
  "$programs/sar_nerf_train/sar_nerf_train" "$data" --field grid --against "$folder/$predicted.all" --despeckle 3 -o "$run" -q > /dev/null
  echo "| $trained° | $predicted° | $(despeckled_row "$run/report.json")"
done
