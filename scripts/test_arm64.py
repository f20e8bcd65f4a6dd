#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the programs that were cross-compiled for 64-bit ARM (build/arm64) under QEMU: the unit tests of the modules that
compute, and a run on a rendered sequence, whose results must be the same bytes as those of this computer's program.

  test_arm64.py [--frames N] [--modules NAME,NAME...]
"""
import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
EMULATED = ["qemu-aarch64", "-L", ROOT / "build" / "arm64_root", ROOT / "build" / "arm64" / "stillmap"]
NATIVE = [ROOT / "build" / "release" / "stillmap"]
MODULES = "base,config,geometry,inertial,recording,sensor,feature,segment,motion,map,optimize,track,loop,dense"
RESULTS = ("trajectory.txt", "trajectory_live.txt", "trajectory_covariance.txt", "keyframes.txt", "movers.csv", "cloud.ply")


def run(*command):
    subprocess.run([str(part) for part in command], check=True, cwd=ROOT)


def positions(file):
    rows = [line.split() for line in file.read_text().splitlines() if not line.startswith("#")]
    return {row[0]: [float(value) for value in row[1:4]] for row in rows}


def largest_distance(first, second):
    """The largest distance between positions of two trajectories at the same time [m]."""
    a, b = positions(first), positions(second)
    return max((sum((x - y) ** 2 for x, y in zip(a[stamp], b[stamp])) ** .5 for stamp in a.keys() & b.keys()), default=0)


def compared_results(frames):
    """Runs both programs on the same recording; yields the names of results that differ."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        run(*NATIVE, "simulate", "--frames", frames, "--people", 2, "--out", folder / "sequence")
        for name, program in (("native", NATIVE), ("emulated", EMULATED)):
            start = time.monotonic()
            run(*program, "run", folder / "sequence", "--quiet", "--out", folder / name)
            print(f"{name}: {frames} frames in {time.monotonic() - start:.1f} s")
        for file in RESULTS:
            native, emulated = folder / "native" / file, folder / "emulated" / file
            if native.read_bytes() != emulated.read_bytes():
                yield file
        distance = largest_distance(folder / "native" / "trajectory.txt", folder / "emulated" / "trajectory.txt")
        print(f"largest distance between the trajectories: {distance * 1e6:.3f} micrometers")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--modules", default=MODULES)
    arguments = parser.parse_args()
    differing = list(compared_results(arguments.frames))
    print("results that differ:", ", ".join(differing) or "none")
    labels = "|".join(arguments.modules.split(","))
    tests = subprocess.run(["ctest", "--preset", "arm64", "-L", f"^({labels})$", "--timeout", "3000", "-j", "2"], cwd=ROOT,
                           check=False)
    return 1 if differing or tests.returncode else 0


if __name__ == "__main__":
    sys.exit(main())
