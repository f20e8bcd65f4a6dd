#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs the dependencies of Stillmap on Debian 12 or Ubuntu 24.04: system packages with apt, and wheels into
# a virtual environment in the build folder. Installed packages are kept, so a second call takes no time and
# needs no network access.
#
#   scripts/install_dependencies.sh            to build, run and test
#   scripts/install_dependencies.sh --fuzz     also clang with libFuzzer for `make fuzz`
#   scripts/install_dependencies.sh --tools    also the tools for `make format`, `make lint` and quantize_network.py
#   scripts/install_dependencies.sh --wheels   also what scripts/build_wheel_dependencies.sh needs
#   scripts/install_dependencies.sh --arm64    also the cross compiler and the emulator for 64-bit ARM
#   scripts/install_dependencies.sh --libraries    only prints the names of the packages that programs are linked with;
#                                                  --openvino: the wheel of OpenVINO
set -euo pipefail
cd "$(dirname "$0")/.."

libraries=(
  libopencv-dev libeigen3-dev libceres-dev libdeflate-dev libpng-dev libjpeg-dev libtiff-dev libopenexr-dev libcli11-dev libfmt-dev
  libyaml-cpp-dev nlohmann-json3-dev liboctomap-dev libmeshoptimizer-dev libbz2-dev liblz4-dev libzstd-dev libsqlite3-dev
  libapriltag-dev libcivetweb-dev libjs-three libcurl4-openssl-dev libmosquitto-dev
  python3-dev pybind11-dev libgtest-dev libgmock-dev libbenchmark-dev
)
packages=(g++ make cmake ninja-build ccache git dpkg-dev python3 python3-venv nodejs "${libraries[@]}")
fuzz_packages=(clang libclang-rt-dev)
tool_packages=(eslint)
wheel_packages=(libprotobuf-dev protobuf-compiler)
arm64_packages=(crossbuild-essential-arm64 qemu-user mmdebstrap)
# OpenVINO runs the networks fast; its C++ package is part of the wheel. Optional: without it OpenCV runs them.
openvino=(openvino==2026.4.1 numpy)
# The tests of the Python module. Optional: without them they are skipped.
python_tests=(pytest==8.4.2)
# The packages that examples of the Python module use, as far as they are small. Optional, as above.
examples=(evo==1.38.1 viser==1.1.1 pyrealsense2==2.59.1.11053)
# Wheels, not packages, so that every distribution formats alike and finds the same faults; and what
# scripts/quantize_network.py needs.
tools=(clang-format==14.0.6 clang-tidy==22.1.8 onnx==1.23.2 onnxruntime==1.31.1 pillow)

venv=build/venv
stamp=$venv/installed  # what pip installed, a line each

missing_packages() {
  local package
  for package in "${packages[@]}"; do
    # The status, not the exit code: a removed package whose settings are left is still known to dpkg.
    dpkg-query --show --showformat='${Status}' "$package" 2>/dev/null | grep -q 'ok installed$' ||
      echo "$package"
  done
}

as_root() {
  if [ "$(id -u)" -eq 0 ]; then
    "$@"
  elif command -v sudo >/dev/null; then
    sudo "$@"
  else
    echo "error: only root can install the missing packages: ${missing[*]}" >&2
    echo "  fix: run this script as root, or install sudo, or ask the administrator for" >&2
    echo "       apt-get install --no-install-recommends ${missing[*]}" >&2
    exit 1
  fi
}

install_packages() {
  command -v apt-get >/dev/null || {
    echo "error: there is no apt-get here; this script knows Debian 12 and Ubuntu 24.04 only" >&2
    echo "  fix: install what these packages hold by the system's own means: ${missing[*]}" >&2
    exit 1
  }
  echo "Installing ${#missing[@]} packages: ${missing[*]}"
  as_root apt-get update -q
  as_root env DEBIAN_FRONTEND=noninteractive \
    apt-get install -q -y --no-install-recommends "${missing[@]}"
}

install_wheels() {
  local wheel wanted=()
  for wheel in "$@"; do
    grep -qxF "$wheel" "$stamp" 2>/dev/null || wanted+=("$wheel")
  done
  [ ${#wanted[@]} -gt 0 ] || return 0
  echo "Installing ${wanted[*]} into $venv"
  [ -x "$venv/bin/pip" ] || python3 -m venv "$venv" || return 1
  "$venv/bin/pip" install --quiet --disable-pip-version-check "${wanted[@]}" || return 1
  printf '%s\n' "${wanted[@]}" >>"$stamp"
}

case ${1:-} in
  --fuzz) packages+=("${fuzz_packages[@]}") ;;
  --tools) packages+=("${tool_packages[@]}") ;;
  --wheels) packages+=("${wheel_packages[@]}") ;;
  --arm64) packages+=("${arm64_packages[@]}") ;;
  --libraries) printf '%s\n' "${libraries[@]}" "${wheel_packages[@]}"; exit ;;
  --openvino) echo "${openvino[0]}"; exit ;;
esac
mapfile -t missing < <(missing_packages)
[ ${#missing[@]} -eq 0 ] || install_packages
install_wheels "${openvino[@]}" || {
  echo "warning: OpenVINO could not be installed; segmentation will use OpenCV's slower networks" >&2
  echo "  fix: run scripts/install_dependencies.sh again when there is a network" >&2
}
install_wheels "${python_tests[@]}" || {
  echo "warning: pytest could not be installed; the tests of the Python module are skipped" >&2
  echo "  fix: run scripts/install_dependencies.sh again when there is a network" >&2
}
if [ "${1:-}" = --tools ]; then
  install_wheels "${examples[@]}" || echo "warning: ${examples[*]} could not be installed" >&2
  install_wheels "${tools[@]}" || {
    echo "error: ${tools[*]} could not be installed" >&2
    echo "  fix: run this again when there is a network" >&2
    exit 1
  }
fi
