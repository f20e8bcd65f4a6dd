#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs what Stillmap is built from, on Debian 12 or Ubuntu 24.04: system packages with apt, and OpenVINO
# (optional) from its wheel into a virtual environment in the build folder. What is there already is left
# alone, so a second call takes no time and needs no network.
#
#   scripts/install_dependencies.sh            to build, run and test
#   scripts/install_dependencies.sh --tools    also what `make format` and `make lint` use
set -euo pipefail
cd "$(dirname "$0")/.."

packages=(
  # compiler and build
  g++ make cmake ninja-build ccache git python3 python3-venv
  # libraries
  libopencv-dev libeigen3-dev libceres-dev libopen3d-dev libcli11-dev libspdlog-dev libfmt-dev
  libyaml-cpp-dev nlohmann-json3-dev libtbb-dev zlib1g-dev
  # tests and benchmarks
  libgtest-dev libgmock-dev libbenchmark-dev
)
# One version everywhere: another one formats otherwise and finds other things.
tools=(clang-format-14 clang-tidy-14)

# The version in use when the build was last tried; its C++ package is part of the wheel.
wheels=(openvino==2026.4.1 numpy)
venv=build/venv

missing_packages() {
  local package
  for package in "$@"; do
    # grep, not an exit code: a removed package with its settings left behind is still known to dpkg.
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
    echo "error: these packages are missing, and only root can install them: ${missing[*]}" >&2
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
  [ -x "$venv/bin/pip" ] || python3 -m venv "$venv"
  "$venv/bin/pip" install --quiet --disable-pip-version-check "${wheels[@]}"
}

[ "${1:-}" != --tools ] || packages+=("${tools[@]}")
mapfile -t missing < <(missing_packages "${packages[@]}")
[ ${#missing[@]} -eq 0 ] || install_packages

# The stamp holds the versions asked for, so that a new pin is installed and an old one is not looked at again.
stamp=$venv/installed-wheels
if [ "$(cat "$stamp" 2>/dev/null)" != "${wheels[*]}" ]; then
  echo "Installing ${wheels[*]} into $venv"
  if install_wheels; then
    echo "${wheels[*]}" >"$stamp"
  else
    echo "warning: OpenVINO could not be installed; segmentation will use OpenCV's slower networks." >&2
    echo "  fix: run scripts/install_dependencies.sh again when there is a network" >&2
  fi
fi
