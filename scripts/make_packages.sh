#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Makes the Debian packages stillmap, libstillmap-dev and python3-stillmap of a build (PRESET: release or arm64) in
# build/PRESET/packages, for the distribution on which it runs, and checks them with lintian if that is installed.
#
#   scripts/make_packages.sh PRESET
set -euo pipefail
cd "$(dirname "$0")/../build/$1"

options=()
if [ "$1" = arm64 ]; then
  # dpkg-shlibdeps knows installed libraries only; programs for ARM depend on the same packages as those of this computer.
  options=(-D CPACK_DEBIAN_PACKAGE_ARCHITECTURE=arm64 -D CPACK_DEBIAN_PACKAGE_SHLIBDEPS=OFF)
  for component in command:stillmap python:python3-stillmap; do
    native=(../release/packages/"${component#*:}"_*.deb)
    name=${component%:*}
    options+=(-D "CPACK_DEBIAN_${name^^}_PACKAGE_DEPENDS=$(dpkg-deb --field "${native[0]}" Depends)")
  done
fi

rm -rf packages _CPack_Packages
cpack -G DEB "${options[@]}" >packages.log 2>&1 || { cat packages.log >&2; exit 1; }
if command -v lintian >/dev/null; then
  lintian --allow-root --fail-on error --suppress-tags bogus-mail-host,bad-distribution-in-changes-file packages/*.deb
else
  echo "warning: the packages are not checked, since lintian is not installed" >&2
fi
ls -l packages
