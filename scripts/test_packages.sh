#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs the packages of scripts/make_packages.sh into a clean root of this distribution that mmdebstrap makes, uses
# them there, and removes them. Needs root, mmdebstrap and a mirror of the distribution.
set -euo pipefail
cd "$(dirname "$0")/.."

command -v mmdebstrap >/dev/null || {
  echo "error: mmdebstrap is not installed" >&2
  echo "  fix: apt-get install mmdebstrap" >&2
  exit 1
}
shopt -s nullglob
packages=(build/release/packages/*.deb)
[ ${#packages[@]} -eq 3 ] || {
  echo "error: there are ${#packages[@]} packages in build/release/packages, not 3" >&2
  echo "  fix: make package" >&2
  exit 1
}
# shellcheck source=/dev/null
. /etc/os-release
sources=(/etc/apt/sources.list.d/{debian,ubuntu}.sources)

# The root is a temporary folder that mmdebstrap removes; format null writes no image of it.
mmdebstrap --quiet --variant=apt --format=null \
  --customize-hook="mkdir -p \"\$1/packages\"" \
  --customize-hook="copy-in ${packages[*]} scripts/use_packages.sh cmake/installed_package_test examples /packages" \
  --customize-hook="chroot \"\$1\" bash /packages/use_packages.sh" \
  "$VERSION_CODENAME" - "${sources[0]}"
