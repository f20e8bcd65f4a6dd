#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Makes the Debian packages of the last commit for another release in a root of its own, in build/RELEASE, and uses them
# in a clean one. Needs root, mmdebstrap and the keys of the release's archive.
#
#   scripts/package_in.sh noble       Ubuntu 24.04 (/usr/share/keyrings/ubuntu-archive-keyring.gpg)
#   scripts/package_in.sh bookworm    Debian 12
set -euo pipefail
cd "$(dirname "$0")/.."

release=$1
# shellcheck source=scripts/clean_root.sh
. scripts/clean_root.sh
mkdir -p "build/$release"
git -c tar.umask=0022 archive --format=tar HEAD >"build/$release/source.tar"
in_clean_root "$release" ca-certificates,make,lintian \
  --customize-hook="mkdir -p \"\$1/source\"" \
  --customize-hook="tar-in build/$release/source.tar /source" \
  --customize-hook="chroot \"\$1\" env STILLMAP_COMMIT=$(git rev-parse --short HEAD) make -C /source package JOBS=${JOBS:-$(nproc)}" \
  --customize-hook="rm -f build/$release/*.deb; cp \"\$1\"/source/build/release/packages/*.deb build/$release"
rm "build/$release/source.tar"
scripts/test_packages.sh "$release" "build/$release"
