#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Builds the preset `fuzz` and gives hostile bytes to every reader (docs/results/robustness.md).
set -eu

usage() {
  cat <<EOF
Usage: scripts/fuzz.sh [TARGET...] [--runs N] [--jobs N]
Fuzzes the readers of tests/fuzz under address and undefined-behaviour sanitizers; needs clang with libFuzzer
(Debian: apt-get install clang). Exits 1 on a finding, whose input is kept in out/fuzz/TARGET/.
  TARGET    config, csv_table, image, manifest, material_json, obj, off, phoenix, ply, sample,
            scene_json, stl, vdb; default all
  --runs N  executions of each target, default 1000000
  --jobs N  compilers at once, default all processors
EOF
}

runs=1000000
jobs=$(nproc)
targets=
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --runs | --jobs)
      case ${2-} in '' | *[!0-9]*) usage >&2; exit 2 ;; esac
      if [ "$1" = --runs ]; then runs=$2; else jobs=$2; fi
      shift
      ;;
    -*) usage >&2; exit 2 ;;
    *) targets="$targets $1" ;;
  esac
  shift
done

cd "$(dirname "$0")/.."
all=$(cd tests/fuzz/seeds && ls)
for target in $targets; do
  if [ ! -d "tests/fuzz/seeds/$target" ]; then
    echo "fuzz: there is no target '$target'; expected one of" $all >&2
    exit 2
  fi
done
: "${targets:=$all}"

cmake --preset fuzz > /dev/null
programs=
for target in $targets; do programs="$programs fuzz_$target"; done
# shellcheck disable=SC2086
cmake --build build/fuzz --parallel "$jobs" --target $programs

# The quarantine of freed memory counts as memory used: a small one, so that the limit is the reader's.
export ASAN_OPTIONS="quarantine_size_mb=32:detect_stack_use_after_return=1:$(printenv ASAN_OPTIONS || true)"
export UBSAN_OPTIONS="print_stacktrace=1:$(printenv UBSAN_OPTIONS || true)"
export LSAN_OPTIONS="suppressions=$PWD/tests/fuzz/leaks.supp:print_suppressions=0:$(printenv LSAN_OPTIONS || true)"

bad=0
for target in $targets; do
  out=out/fuzz/$target
  mkdir -p "$out/corpus"
  dictionary=tests/fuzz/$target.dict
  start=$(date +%s)
  code=0
  build/fuzz/tests/fuzz/fuzz_"$target" "$out/corpus" "tests/fuzz/seeds/$target" -runs="$runs" -dict="$dictionary" \
    -max_len=65536 -timeout=10 -rss_limit_mb=512 -artifact_prefix="$out/" -print_final_stats=1 \
    -reload=0 > "$out/log" 2>&1 || code=$?
  seconds=$(($(date +%s) - start))
  executed=$(sed -n 's/^stat::number_of_executed_units: *//p' "$out/log")
  coverage=$(sed -n 's/^#.* cov: \([0-9]*\) .*/\1/p' "$out/log" | tail -n 1)
  finding=none
  if [ "$code" -ne 0 ]; then
    bad=1
    finding=$(sed -n 's/.*Test unit written to //p' "$out/log" | tail -n 1)
    finding="${finding:-see} ($out/log)"
  fi
  printf 'fuzz: %-14s %9s executions, coverage %6s, %6s s, findings: %s\n' \
    "$target" "${executed:-?}" "${coverage:-?}" "$seconds" "$finding"
done
exit $bad
