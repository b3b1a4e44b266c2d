#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What is left of known shifts of views, and what learning shifts costs where poses are exact. Needs a build.
set -eu

usage() {
  cat <<USAGE
Usage: scripts/registration_table.sh [--seeds LIST] [--folder FOLDER]
Renders scenes of sar_bench scenes on grass, every view shifted by up to 2 pixels (scripts/shifted_views.sh), learns them, and prints the
root mean square of both axes of the shifts before and after, without the best common translation. Then it learns exact views with
--register off and on, with three seeds each, and prints what that costs (PSNR of power of 12 unseen views). Two tables (Markdown).
  --seeds LIST     (default "103 105 107")
  --folder FOLDER  (default build/registration_table)
USAGE
}

root=$(cd "$(dirname "$0")/.." && pwd)
seeds="103 105 107"
folder=$root/build/registration_table
. "$root/scripts/report_values.sh"
take_options "seeds folder" "" "$@"
programs=${SARNERF_PROGRAMS:-$root/build/release/apps}
. "$root/scripts/shifted_views.sh"
mkdir -p "$folder"

depression=30 spacing=0.2
scale=0.333  # m: 1.2 of it are two pixels
many=$(seq -s ' ' 0 10 350) few=$(seq -s ' ' 0 30 330)

# left_of_shifts REPORT AZIMUTHS: "before | after", pixels. The normal equations of the best translation are solved by Gauss's method.
left_of_shifts() {
  grep -o '"\(azimuth\|range\)_m": *[-0-9.e+]*' "$1" | sed 's/.*: *//' | paste - - |
    awk -v azimuths="$2" -v d="$depression" -v s="$scale" -v spacing="$spacing" '
      function rms(e,   n, c, r, k, t, sum, f, m) {
        for (r = 1; r <= 3; ++r) for (c = 1; c <= 4; ++c) m[r, c] = 0
        for (n = 1; n <= 2 * NR; ++n)
          for (r = 1; r <= 3; ++r) {
            for (c = 1; c <= 3; ++c) m[r, c] += u[n, r] * u[n, c]
            m[r, 4] += u[n, r] * e[n]
          }
        for (k = 1; k <= 3; ++k)
          for (r = 1; r <= 3; ++r)
            if (r != k) { f = m[r, k] / m[k, k]; for (c = 1; c <= 4; ++c) m[r, c] -= f * m[k, c] }
        for (k = 1; k <= 3; ++k) t[k] = m[k, 4] / m[k, k]
        sum = 0
        for (n = 1; n <= 2 * NR; ++n) sum += (e[n] - t[1] * u[n, 1] - t[2] * u[n, 2] - t[3] * u[n, 3]) ^ 2
        return sqrt(sum / (2 * NR)) / spacing
      }
      BEGIN { split(azimuths, list, " ") }
      {
        a = list[NR]
        '"$shift_of_view"'
        p = (90 - d) * pi / 180; n = 2 * NR - 1
        u[n, 1] = -cos(f); u[n, 2] = 0; u[n, 3] = sin(f)
        u[n + 1, 1] = -sin(p) * sin(f); u[n + 1, 2] = -cos(p); u[n + 1, 3] = -sin(p) * cos(f)
        before[n] = s * along; before[n + 1] = s * range
        after[n] = $1 - s * along; after[n + 1] = $2 - s * range
      }
      END { printf "%.2f | %.3f", rms(before), rms(after) }'
}

size="--ground grass --size 112x128 --spacing $spacing"
train() { "$programs/sar_nerf_train/sar_nerf_train" "$@" --field grid -q > /dev/null; }
scene_of() { "$programs/sar_bench/sar_bench" scenes --seed "$1" -o "$folder/scenes" -q; }

# shifted TEXT NAME AZIMUTHS LOOKS OPTIONS...: a row of the first table.
shifted() {
  text=$1 set=$folder/$2 list=$3
  looks=$4
  shift 4
  # shellcheck disable=SC2086
  shifted_views "$scale" "$set" "$list" "$depression" "$looks" "$scene" $size "$@"
  train "$set" -o "$set.run"
  echo "| $kind | $text | $(left_of_shifts "$set.run/report.json" "$list") |"
}

echo "| scene | images | shifts (pixels) | error after training |"
echo "|---|---|--:|--:|"
for seed in $seeds; do
  scene=$(scene_of "$seed")
  kind=$(basename "$(dirname "$scene")" | tr _ ' ')
  shifted "clean, 36 views" "$seed.clean.36" "$many" inf
  shifted "clean, 12 views" "$seed.clean.12" "$few" inf
  shifted "1 look, response of 0.3 m, 36 views" "$seed.look.36" "$many" 1 --resolution 0.3 --window taylor:-35
done

echo
echo "| scene, exact views | off (dB) | on (dB) | cost (dB) | shifts that were learned (pixels) |"
echo "|---|--:|--:|--:|--:|"
for seed in $seeds; do
  scene=$(scene_of "$seed")
  set=$folder/$seed.exact
  for views in "0:350:10 $set" "7.3:337.3:30 $set.truth"; do
    # shellcheck disable=SC2086
    "$programs/sar_render/sar_render" "$scene" $size --depression $depression --azimuth "${views%% *}" -q -o "${views#* }" > /dev/null
  done
  : > "$set.rows"
  for number in 1 2 3; do
    for registers in off on; do
      train "$set" --against "$set.truth" --register $registers --seed $number -o "$set.$registers.$number"
    done
    echo "$(report_means "$set.off.$number/report.json" evaluation psnr_power_db | head -n 1)" \
      "$(report_means "$set.on.$number/report.json" evaluation psnr_power_db | head -n 1)" \
      "$(sed -n 's/.*"rms_pixels": *\([0-9.e-]*\).*/\1/p' "$set.on.$number/report.json")" >> "$set.rows"
  done
  awk -v kind="$(basename "$(dirname "$scene")" | tr _ ' '), clean, 36 views" '
    { off += $1 / 3; on += $2 / 3; rms += $3 / 3; cost = $1 - $2
      if (NR == 1 || cost < least) least = cost
      if (NR == 1 || cost > most) most = cost }
    END { printf "| %s | %.2f | %.2f | %.2f (%.2f to %.2f) | %.3f |\n", kind, off, on, off - on, least, most, rms }' "$set.rows"
done
