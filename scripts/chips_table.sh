#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Learning from measured chips of one depression. Needs a build (scripts/demo.sh makes one) and chips of your own.
set -eu

usage() {
  cat <<USAGE
Usage: scripts/chips_table.sh [--every LIST] [--depression DEG] [--folder FOLDER] [--import OPTIONS] CHIPS...
Imports each folder of chips (sar_import images CHIPS/DEPRESSION OPTIONS, or CHIPS itself where there is no such folder),
learns from a chip every so many degrees and compares the others with their means over 3 degrees, beside the best of all
baselines in each column and what means of other chips as near reach (Markdown). A second table allows each predicted view a
shift of up to two pixels that its truth chooses. Data and runs stay in FOLDER.
  --every LIST      degrees between training azimuths (default "5 10 15")
  --depression DEG  (default 17)
  --folder FOLDER   (default build/chips_table)
  --import OPTIONS  of sar_import images, such as "--csv manifest.csv --amplitude-scale 4/65535"
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
every="5 10 15"
depression=17
folder=$root/build/chips_table
import=
chips=
registered=
. "$root/scripts/report_values.sh"
take_options "every depression folder import" chips "$@"
if [ -z "$chips" ]; then usage >&2; exit 2; fi
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
mkdir -p "$folder"

echo "| chips | every | $despeckled_head"
echo "|---|--:|$despeckled_rule"
for item in $chips; do
  name=$(basename "$item")
  source=$item
  if [ -d "$item/$depression" ]; then source=$item/$depression; fi
  import() {
    # shellcheck disable=SC2086  # several options
    "$programs/sar_import/sar_import" images "$source" $import -q "$@" > /dev/null
  }
  import -o "$folder/$name.all"
  for step in $every; do
    data=$folder/$name.$step
    import --every "$step" -o "$data"
    "$programs/sar_nerf_train/sar_nerf_train" "$data" --field grid --against "$folder/$name.all" --despeckle 3 -o "$data.run" -q > /dev/null
    echo "| $name | $step | $(despeckled_row "$data.run/report.json")"
    registered="$registered| $name | $step | $(registered_row "$data.run/report.json")
"
  done
done

echo
echo "Oracle-registered:"
echo
echo "| chips | every | $registered_head"
echo "|---|--:|$registered_rule"
printf '%s' "$registered"
