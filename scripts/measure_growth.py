#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures the growth of a map while the camera repeatedly circles one room.

  scripts/measure_growth.py --out DIR [--rounds 10] [--people N] [--program build/release/stillmap]

Renders a camera moving around the simulated office (once; kept in DIR), and maps the first round, the first two, and
so on. Prints a table: keyframes and landmarks in the map, peak memory, milliseconds per frame, ATE.
"""
import argparse
import json
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FPS, SPEED = 15, 1.8  # small, quick pictures: 0.72 m/s


def call(*words):
    subprocess.run([str(word) for word in words], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def positions(sequence):
    rows = (line.split() for line in (sequence / "groundtruth.txt").read_text(encoding="utf-8").splitlines())
    return [tuple(float(x) for x in row[1:4]) for row in rows if row and not row[0].startswith("#")]


def distance(a, b):
    return sum((x - y) ** 2 for x, y in zip(a, b)) ** 0.5


def round_length(sequence):
    """Frames until the camera is back where it began."""
    path = positions(sequence)
    away = next(i for i, p in enumerate(path) if distance(p, path[0]) > 1)
    near = [i for i in range(away, len(path)) if distance(path[i], path[0]) < 0.5]
    first = [i for i in near if i - near[0] < 3 * FPS]
    return min(first, key=lambda i: distance(path[i], path[0]))


def render(arguments, frames, name):
    sequence = arguments.out / name
    if not (sequence / "associations.txt").exists():  # the last file written
        call(arguments.program, "simulate", "--people", arguments.people, "--camera", "loop", "--frames", frames,
             "--fps", FPS, "--speed", SPEED, "--width", 320, "--height", 240, "--out", sequence)
    return sequence


def figures(arguments, sequence, frames):
    out = arguments.out / f"run_{frames}"
    call(arguments.program, "run", sequence, "--count", frames, "--out", out)
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    stages = {stage["name"]: stage for stage in summary["timing_ms"]}
    ate = summary["evaluation"]["ate"]["translation_m"]["rmse"]
    return [summary["keyframes"], summary["landmarks"], f"{summary['peak_memory_mib']:.0f}",
            f"{stages['tracking']['median_ms']:.2f}", f"{stages['map refinement']['median_ms']:.1f}",
            len(summary["loops"]), f"{summary['frames']['tracked']}/{frames}", f"{ate:.4f}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder for the pictures and the results")
    parser.add_argument("--rounds", type=int, default=10, help="default: %(default)s")
    parser.add_argument("--people", type=int, default=0, help="who walk about, default: %(default)s")
    parser.add_argument("--program", type=Path, default=ROOT / "build/release/stillmap", help="default: %(default)s")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    length = round_length(render(arguments, 450, f"once_{arguments.people}"))
    sequence = render(arguments, arguments.rounds * length, f"rounds_{arguments.people}_{arguments.rounds}")
    print(f"{length} frames a round\n\n| rounds | keyframes | landmarks | memory [MiB] | tracking, median [ms] | "
          "refinement, median [ms] | loops | tracked | ATE [m] |\n|" + "---|" * 9)
    for rounds in range(1, arguments.rounds + 1):
        row = figures(arguments, sequence, rounds * length)
        print("| " + " | ".join(str(cell) for cell in [rounds, *row]) + " |", flush=True)


if __name__ == "__main__":
    main()
