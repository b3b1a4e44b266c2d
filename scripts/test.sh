#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds the release preset and runs its tests.
set -eu

usage() {
  cat <<EOF
Usage: scripts/test.sh [--unit]
Installs missing packages, builds build/release and runs all tests.
  --unit   only the unit tests, about a minute
EOF
}

label=
case "${1-}" in
  '') ;;
  --unit) label=unit ;;
  -h | --help) usage; exit 0 ;;
  *) usage >&2; exit 2 ;;
esac

cd "$(dirname "$0")/.."
scripts/setup.sh
cmake --preset release
cmake --build --preset release
exec ctest --preset release --parallel "$(nproc)" ${label:+--label-regex "^$label\$"}
