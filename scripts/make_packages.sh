#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Makes the Debian packages stillmap, libstillmap-dev and python3-stillmap of the built release in
# build/release/packages, for the distribution on which it runs, and checks them with lintian if that is installed.
set -euo pipefail
cd "$(dirname "$0")/../build/release"

rm -rf packages _CPack_Packages
cpack -G DEB >packages.log 2>&1 || { cat packages.log >&2; exit 1; }
if command -v lintian >/dev/null; then
  lintian --allow-root --fail-on error --suppress-tags bogus-mail-host,bad-distribution-in-changes-file packages/*.deb
else
  echo "warning: the packages are not checked, since lintian is not installed" >&2
fi
ls -l packages
