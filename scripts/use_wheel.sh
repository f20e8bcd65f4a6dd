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
environment/bin/python -c '
import numpy as np, stillmap
slam = stillmap.Slam(stillmap.Camera(160, 120, fx=140, fy=140, cx=80, cy=60, depth_factor=1000))
for i in range(3):
    slam.push(np.full((120, 160, 3), 128, np.uint8), np.full((120, 160), 2, np.float32), i / 30)
assert len(slam.finish().trajectory) <= 3
print("stillmap", stillmap.__version__)' || fail "the Python module"
echo "passed after $SECONDS s: the Python module"
