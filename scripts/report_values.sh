#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# For scripts that make tables of the programs' reports: sourced by them.

# take_options NAMES REST [ARGUMENT...]: sets the variable NAME for each --NAME VALUE of the names, and to true for each --NAME of those
# written NAME!. Other arguments are appended to the variable REST; of REST= the last one counts; without REST there must be none. -h
# prints usage(); what is not an option is an error.
take_options() {
  option_names=$1 rest=$2
  shift 2
  while [ $# -gt 0 ]; do
    case "$1" in
      -h | --help) usage; exit 0 ;;
      -*)
        option= is_flag=false
        for option_name in $option_names; do
          if [ "$1" = "--$option_name" ]; then option=$option_name; fi
          if [ "$1!" = "--$option_name" ]; then option=${option_name%?} is_flag=true; fi
        done
        if [ -z "$option" ]; then
          echo "$(basename "$0"): $1: no such option" >&2
          usage >&2
          exit 2
        fi
        if $is_flag; then
          eval "$option=true"
          shift
          continue
        fi
        if [ $# -lt 2 ]; then
          echo "$(basename "$0"): $1: expected a value behind it, found none (see --help)" >&2
          exit 2
        fi
        eval "$option=\$2"
        shift 2 ;;
      *)
        case "$rest" in
          "")
            echo "$(basename "$0"): $1: expected options only" >&2
            usage >&2
            exit 2 ;;
          *=) eval "${rest}\$1" ;;
          *) eval "$rest=\"\${$rest:+\$$rest }\$1\"" ;;
        esac
        shift ;;
    esac
  done
}

# chips_table_of CHIPS: the table of a folder of chips, in it or beside it, whether it is there or not.
chips_table_of() {
  if [ -f "$1/manifest.csv" ]; then echo "$1/manifest.csv"; else echo "$(dirname "$1")/manifest.csv"; fi
}

# machine_name: the processor, as /proc/cpuinfo has it.
machine_name() { sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1; }

# take_scene ITEM: sets scene, scale and name from FILE[:SCALE]. The name of a generated scene is that of its folder.
take_scene() {
  scene=${1%%:*}
  scale=1
  case "$1" in *:*) scale=${1##*:} ;; esac
  name=$(basename "$scene")
  name=${name%.*}
  if [ "$name" = scene ]; then name=$(basename "$(dirname "$scene")"); fi
}

# add_generated_scenes SEEDS: puts those of sar_bench scenes, made in $folder/scenes, before $scenes; none for an empty list.
add_generated_scenes() {
  if [ -z "$1" ]; then return; fi
  scenes="$("$programs/sar_bench/sar_bench" scenes --seed "$1" -o "$folder/scenes" --quiet) $scenes"
}

# report_means REPORT evaluation|despeckled KEY: the key's means, one a line: the model's, the baselines', what bounds them.
report_means() {
  if [ "$2" = despeckled ]; then cut='s/.*"despeckled"://'; else cut='s/.*"evaluation"://; s/"despeckled":.*//'; fi
  tr -d ' \n' < "$1" | sed "$cut"'; s/"views":\[[^]]*\]//g' | grep -o "\"mean\":{[^{}]*\({[^}]*}\)\{0,1\}" |
    grep -o "\"$3\":[-0-9.e+]*" | sed 's/.*://'
}

# model_and_best REPORT evaluation|despeckled KEY [BOUNDS]: "model | best baseline" and the best of the last BOUNDS rows,
# larger being better.
model_and_best() {
  report_means "$1" "$2" "$3" | awk -v n_bounds="${4:-0}" '
    { v[NR] = $1 }
    END {
      if (NR < 2) { printf "– | –%s", (n_bounds > 0 ? " | –" : ""); exit }
      best = v[2]; bound = v[NR]
      for (n = 2; n <= NR - n_bounds; ++n) if (v[n] > best) best = v[n]
      for (n = NR - n_bounds + 1; n <= NR; ++n) if (v[n] > bound) bound = v[n]
      printf "%.2f | %.2f", v[1], best
      if (n_bounds > 0) printf " | %.2f", bound
    }'
}

# value REPORT KEY N: what follows the N-th occurrence of a key in sar_extract's report, where the extracted body comes first, then
# the carved one.
value() {
  tr -d ' \n' < "$1" | grep -o "\"$2\":[-0-9.e+]*" | sed -n "$3{s/.*://;p;}"
}

# extraction_seconds REPORT: of sar_extract, without scores.
extraction_seconds() {
  for stage in field body mesh write; do value "$1" $stage 1; done | awk '{ s += $1 } END { print s }'
}

# run_seconds REPORT: of sar_nerf_train, all programs of the run together.
run_seconds() {
  sed -n 's/.*"all programs of the run": *\([0-9.]*\).*/\1/p' "$1" | head -n 1
}

# training_seconds REPORT
training_seconds() {
  sed -n 's/.*"until trained": *\([0-9.]*\).*/\1/p' "$1" | head -n 1
}

# trained_steps REPORT
trained_steps() {
  sed -n 's/^ *"steps": *\([0-9]*\).*/\1/p' "$1" | head -n 1
}

# Columns of a table of measured chips, after those that say what a row is.
despeckled_head="amplitude (dB) | best baseline | true neighbours | power (dB) | best baseline | true neighbours | target IoU | best baseline | true neighbours | shadow IoU | best baseline | true neighbours | training (s) |"
despeckled_rule="--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"

# Columns of the table after it: an oracle registers each predicted view to its truth.
registered_head="amplitude (dB) | best baseline | true neighbours | power (dB) | best baseline | true neighbours |"
registered_rule="--:|--:|--:|--:|--:|--:|"

# registered_row REPORT: those columns.
registered_row() {
  for key in registered_psnr_amplitude_db registered_psnr_power_db; do
    printf '%s | ' "$(model_and_best "$1" despeckled $key 2)"
  done
}

# despeckled_row REPORT: those columns of sar_nerf_train's report with --despeckle.
despeckled_row() {
  for key in psnr_amplitude_db psnr_power_db target_iou shadow_iou; do
    printf '%s | ' "$(model_and_best "$1" despeckled $key 2)"
  done
  printf '%.1f |' "$(training_seconds "$1")"
}

# publish PAGE DOCUMENT PICTURES: copies a page of Markdown to a document of docs/, and the pictures of the page to a folder there. A missing
# picture leaves both as they were.
publish() {
  publish_new=$3.new
  rm -rf "$publish_new"
  mkdir -p "$publish_new"
  if ! grep -o '([^()]*\.png)' "$1" | tr -d '()' | while IFS= read -r picture; do cp "$(dirname "$1")/$picture" "$publish_new" || exit 1; done; then
    rm -rf "$publish_new"
    return 1
  fi
  rm -rf "$3"
  mv "$publish_new" "$3"
  sed "s#(\([^()]*\.png\))#($(realpath --relative-to="$(dirname "$2")" "$3")/\1)#g; s#([^()]*/docs/results/#(results/#g" "$1" > "$2.new"
  mv "$2.new" "$2"
}
