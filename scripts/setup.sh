#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs the packages of scripts/packages.txt that are missing on this Debian 12 or 13 system.
set -eu

usage() {
  cat <<EOF
Usage: scripts/setup.sh [--check] [--optional]
Installs the Debian packages that building and testing need and that are not installed yet.
  --check     only list what is missing; exits 1 when something is
  --optional  with those of scripts/packages-optional.txt, without which some tests are skipped
EOF
}

check_only=false
optional=false
for argument in "$@"; do
  case $argument in
    --check) check_only=true ;;
    --optional) optional=true ;;
    -h | --help) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
  esac
done

if ! command -v dpkg-query > /dev/null || ! command -v apt-get > /dev/null; then
  echo "setup: this script needs Debian's apt; elsewhere, install the counterparts of scripts/packages.txt" >&2
  exit 1
fi

packages() {
  sed 's/#.*//' "$(dirname "$0")/packages.txt"
  if $optional; then sed 's/#.*//' "$(dirname "$0")/packages-optional.txt"; fi
}
missing=
for package in $(packages); do
  state=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2> /dev/null || true)
  [ "$state" = installed ] || missing="$missing $package"
done

if [ -z "$missing" ]; then
  echo "setup: all packages are installed"
  exit 0
fi
echo "setup: missing:$missing"
if $check_only; then exit 1; fi

as_root=
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo > /dev/null; then
    echo "setup: installing packages needs root and there is no sudo; as root, run: apt-get install$missing" >&2
    exit 1
  fi
  as_root=sudo
fi

apt() {
  echo "setup: ${as_root:+$as_root }apt-get $*"
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get -q "$@" < /dev/null
}
apt update
# The list is one word per package.
# shellcheck disable=SC2086
apt install -y --no-install-recommends $missing
