#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs Debian packages into a clean root of their release, uses them there, and removes them. Needs root, mmdebstrap
# and the keys of the release's archive.
#
#   scripts/test_packages.sh                   those of scripts/make_packages.sh, on this release
#   scripts/test_packages.sh RELEASE FOLDER    those in a folder
set -euo pipefail
cd "$(dirname "$0")/.."

# shellcheck source=/dev/null
. /etc/os-release
release=${1:-$VERSION_CODENAME} folder=${2:-build/release/packages}
# shellcheck source=scripts/clean_root.sh
. scripts/clean_root.sh
shopt -s nullglob
packages=("$folder"/*.deb)
[ ${#packages[@]} -eq 3 ] || {
  echo "error: there are ${#packages[@]} packages in $folder, not 3" >&2
  echo "  fix: make package" >&2
  exit 1
}
in_clean_root "$release" ca-certificates \
  --customize-hook="mkdir -p \"\$1/packages\"" \
  --customize-hook="copy-in ${packages[*]} scripts/use_packages.sh scripts/use_module.py cmake/installed_package_test examples /packages" \
  --customize-hook="chroot \"\$1\" bash /packages/use_packages.sh"
