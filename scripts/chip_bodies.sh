#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Bodies learned from measured chips. Needs a build (scripts/demo.sh makes one) and chips of your own.
set -eu

usage() {
  cat <<USAGE
Usage: scripts/chip_bodies.sh [--every DEG] [--depressions LIST] [--folder FOLDER] [--import OPTIONS] CHIPS...
Imports each folder of chips (sar_import images CHIPS OPTIONS), learns the field surface with default settings from a chip every
so many degrees of all depressions together, extracts the body, and prints the size of its largest component (1st to 99th
percentile of area, along its own axes) (Markdown). Data, runs, bodies and pictures of them stay in FOLDER.
  --every DEG         degrees between azimuths (default 5)
  --depressions LIST  (default 17)
  --folder FOLDER     (default build/chip_bodies)
  --import OPTIONS    of sar_import images, such as "--csv manifest.csv --amplitude-scale 4/65535"
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
every=5
depressions=17
folder=$root/build/chip_bodies
import=
chips=
. "$root/scripts/report_values.sh"
take_options "every depressions folder import" chips "$@"
if [ -z "$chips" ]; then usage >&2; exit 2; fi
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
mkdir -p "$folder"

# largest REPORT: length, width and height of the largest component.
largest() {
  tr -d ' \n' < "$1" | sed 's/.*"largest_component_m":\[\([^]]*\)\].*/\1/; s/,/ /g'
}

echo "| chips | depressions | length (m) | width (m) | height (m) | components | unseen (%) | training (s) |"
echo "|---|---|--:|--:|--:|--:|--:|--:|"
for item in $chips; do
  data=$folder/$(basename "$item").$depressions
  # shellcheck disable=SC2086  # several options
  "$programs/sar_import/sar_import" images "$item" $import --depression "$depressions" --every "$every" -q -o "$data" > /dev/null
  "$programs/sar_nerf_train/sar_nerf_train" "$data" --field surface --holdout 0 -o "$data.run" -q > /dev/null
  "$programs/sar_extract/sar_extract" "$data.run" "$data.vdb" --mesh "$data.ply" --preview "$data.png" --overwrite -q > /dev/null
  report=$data.report.json
  echo "$(basename "$item") $depressions $(largest "$report") $(value "$report" components 1) $(value "$report" unseen_part 1)" \
    "$(run_seconds "$data.run/report.json")" |
    awk '{ printf "| %s | %s | %.2f | %.2f | %.2f | %d | %.0f | %.0f |\n", $1, $2, $3, $4, $5, $6, 100 * $7, $8 }'
done
