#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Unpacks the libraries of this distribution for 64-bit ARM into build/arm64_root, for the CMake preset arm64, and
# installs the cross compiler and the emulator. Nothing in the root runs while it is made.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install_dependencies.sh --arm64
root=$PWD/build/arm64_root
[ ! -e "$root/made" ] || exit 0
rm -rf "$root"
# shellcheck source=/dev/null
. /etc/os-release
libraries=$(scripts/install_dependencies.sh --libraries | paste -sd ,)
mmdebstrap --quiet --variant=extract --architectures=arm64 --include="libstdc++-12-dev,python3-numpy,$libraries" \
  "$VERSION_CODENAME" "$root"

# What the packages' scripts would do, and names of files as the cross compiler sees them.
lib=usr/lib/aarch64-linux-gnu
for library in blas lapack; do
  ln -s "$library/lib$library.so.3" "$root/$lib/lib$library.so.3"
  ln -s "$library/lib$library.so.3" "$root/$lib/lib$library.so"
done
find "$root/usr/lib" -lname '/*' -print0 | while IFS= read -r -d '' link; do
  ln -sfnr "$root$(readlink "$link")" "$link"
done
sed -i "s#;/usr/lib/#;$root/usr/lib/#g" "$root/$lib/cmake/Ceres/CeresTargets.cmake"
# OpenVINO for ARM, of the version of this computer's.
python3 -m pip download --quiet --no-deps --only-binary=:all: --python-version 3.11 \
  --platform manylinux_2_35_aarch64 --platform manylinux_2_31_aarch64 --dest "$root/opt" \
  "$(scripts/install_dependencies.sh --openvino)"
python3 -m zipfile --extract "$root"/opt/openvino-*.whl "$root/opt"
find "$root/opt" -name '*.so*' -exec aarch64-linux-gnu-strip --strip-unneeded {} +
# By this file CMake knows the distribution of the packages.
cp /etc/os-release "$root/etc"
touch "$root/made"
