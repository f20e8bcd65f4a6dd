#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs each wheel of scripts/make_wheels.py for this computer into a clean root that has nothing but Python, and uses
# it there: Debian 12 (Python 3.11), Ubuntu 24.04 (3.12), Debian 13 (3.13). Needs root, mmdebstrap and the archives'
# keys (ubuntu-archive-keyring, debian-archive-keyring).
set -euo pipefail
cd "$(dirname "$0")/.."

command -v mmdebstrap >/dev/null || {
  echo "error: mmdebstrap is not installed" >&2
  echo "  fix: apt-get install mmdebstrap" >&2
  exit 1
}
certificates=${PIP_CERT:-/etc/ssl/certs/ca-certificates.crt}
use_in() {  # RELEASE WHEEL
  local wheel=$2 mirror=http://deb.debian.org/debian
  [ "$1" != noble ] || mirror="deb [signed-by=/usr/share/keyrings/ubuntu-archive-keyring.gpg] http://archive.ubuntu.com/ubuntu noble main universe"
  echo "== $(basename "$wheel") in $1"
  mmdebstrap --quiet --variant=apt --format=null --include=python3,python3-venv,ca-certificates \
    --customize-hook="mkdir -p \"\$1/wheels\"" \
    --customize-hook="copy-in $wheel scripts/use_wheel.sh /wheels" \
    --customize-hook="copy-in $certificates /wheels" \
    --customize-hook="PIP_CERT=/wheels/$(basename "$certificates") chroot \"\$1\" bash /wheels/use_wheel.sh /wheels/$(basename "$wheel")" \
    "$1" - "$mirror"
}
for pair in cp311:bookworm cp312:noble cp313:trixie; do
  for wheel in build/wheels/stillmap-*-"${pair%:*}"-*"$(uname -m)".whl; do
    [ ! -e "$wheel" ] || use_in "${pair#*:}" "$wheel"
  done
done
