#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# The part of scripts/test_wheels.sh that runs in a clean root: the wheel FILE is installed into a fresh environment and
# used.
set -euo pipefail

fail() {
  echo "FAILED: $*" >&2
  exit 1
}
cd /tmp
python3 -m venv environment
environment/bin/pip install --quiet "$1" || fail "pip install $1"
echo "passed after $SECONDS s: installed ($(du -sh environment | cut -f 1) with NumPy)"
environment/bin/stillmap demo --quiet --frames 60 --out demo >demo.log || { cat demo.log >&2; fail "stillmap demo"; }
[ -s demo/fused/cloud.ply ] || fail "stillmap demo made no cloud"
echo "passed after $SECONDS s: stillmap demo"
environment/bin/python "$(dirname "$0")/use_module.py" || fail "the Python module"
echo "passed after $SECONDS s: the Python module"
