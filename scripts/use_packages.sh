#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# The part of scripts/test_packages.sh that runs in the clean root: each package is installed and used, then all are
# removed.
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive STILLMAP_ONNXRUNTIME=/nowhere
cd /tmp

fail() {
  echo "FAILED: $*" >&2
  exit 1
}
install() {
  apt-get install -q -y --no-install-recommends "$@" >apt.log 2>&1 || { cat apt.log >&2; fail "apt-get install $*"; }
}
passed() { echo "passed after $SECONDS s: $*"; }

apt-get update -q >/dev/null
install /packages/stillmap_*.deb
passed "stillmap is installed ($(du -shx / 2>/dev/null | cut -f 1) in all)"
stillmap demo --quiet --frames 60 --out demo >demo.log || { cat demo.log >&2; fail "stillmap demo"; }
[ -s demo/fused/cloud.ply ] || fail "stillmap demo made no cloud"
passed "stillmap demo"
zcat /usr/share/man/man1/stillmap.1.gz | grep -c calibrate >manual.log || fail "the manual page names no calibrate"

install /packages/python3-stillmap_*.deb
python3 /packages/use_module.py
passed "the Python module"

install /packages/libstillmap-dev_*.deb g++ cmake make
cmake -S /packages/installed_package_test -B project -DSTILLMAP_TEST_HEADERS=slam.hpp >cmake.log 2>&1 || { cat cmake.log >&2; fail "cmake"; }
cmake --build project >cmake.log 2>&1 || { cat cmake.log >&2; fail "compile with libstillmap-dev"; }
cd /packages/installed_package_test
python3 -c 'import pathlib, toy_network; toy_network.write(pathlib.Path("/tmp/toy.onnx"))'
cd /tmp
project/installed_package_test toy.onnx results | grep OpenVINO || fail "the program does not find the OpenVINO plug-in"
[ -s results/summary.json ] || fail "the program wrote no results"
passed "a program with the library"

files=$(dpkg -L stillmap python3-stillmap libstillmap-dev)
apt-get purge -q -y stillmap python3-stillmap libstillmap-dev >apt.log 2>&1 || { cat apt.log >&2; fail "apt-get purge"; }
for file in $files; do
  [ -d "$file" ] || [ ! -e "$file" ] || fail "$file was not removed"
done
[ ! -e /usr/lib/python3/dist-packages/stillmap ] || fail "bytecode of the Python module was not removed"
passed "all packages are removed"
