#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs each wheel of scripts/make_wheels.py for this computer into a clean root that has nothing but Python, and uses
# it there: Ubuntu 22.04 (Python 3.10), Debian 12 (3.11), Ubuntu 24.04 (3.12), Debian 13 (3.13). Needs root, mmdebstrap and the
# archives' keys.
set -euo pipefail
cd "$(dirname "$0")/.."

# shellcheck source=scripts/clean_root.sh
. scripts/clean_root.sh
shopt -s nullglob
tested=0
for pair in cp310:jammy cp311:bookworm cp312:noble cp313:trixie; do
  for wheel in build/wheels/stillmap-*-"${pair%:*}"-*"$(uname -m)".whl; do
    tested=$((tested + 1))
    echo "== $(basename "$wheel") on ${pair#*:}"
    in_clean_root "${pair#*:}" python3,python3-venv,ca-certificates \
      --customize-hook="mkdir -p \"\$1/wheels\"" \
      --customize-hook="copy-in $wheel scripts/use_wheel.sh scripts/use_module.py /wheels" \
      --customize-hook="chroot \"\$1\" bash /wheels/use_wheel.sh /wheels/$(basename "$wheel")"
  done
done
[ $tested -gt 0 ] || {
  echo "error: there are no wheels for this computer in build/wheels" >&2
  echo "  fix: make wheels" >&2
  exit 1
}
