#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps every sequence below a folder with every preset named and prints the figures as a Markdown table.

  scripts/run_sequences.py SEQUENCES_DIR --out RESULTS_DIR --model yolov8n-seg.onnx [--presets static seg-mask]
                           [--ghosts] [--only NAME ...] [--table]

A sequence is a folder in TUM layout with groundtruth.txt. --ghosts counts, where the sequence has true masks, the
ghosts in the cloud. --table prints the table of results that are there already and runs nothing.
"""
import argparse
import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
COMMAND = ROOT / "build/release/stillmap"
HEAD = ["sequence", "preset", "ATE RMSE [m]", "SD [m]", "RPE 1 s [m]", "RPE 1 s [deg]", "coverage",
        "tracking [ms]", "frames/s", "memory [MiB]", "ghosts [%]", "surface kept [%]"]


def run(sequence, preset, out, arguments):
    command = [COMMAND, "run", sequence, "--preset", preset, "--out", out]
    if preset != "static":
        command += ["--model", arguments.model]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    if arguments.ghosts and (sequence / "mask").is_dir():
        subprocess.run([COMMAND, "eval", sequence / "groundtruth.txt", out / "trajectory.txt", "--cloud",
                        out / "cloud.ply", "--sequence", sequence, "--json", out / "ghosts.json"],
                       check=True, stdout=subprocess.DEVNULL)


def leaf(tree, *path):
    """The value at the first matching path; keys match by their beginning, as units follow the names."""
    for name in path:
        tree = next((v for k, v in tree.items() if k.startswith(name)), {}) if isinstance(tree, dict) else {}
    return tree if isinstance(tree, (int, float)) else float("nan")


def row(sequence, preset, out):
    summary = json.loads((out / "summary.json").read_text())
    evaluation, frames = summary.get("evaluation", {}), summary["frames"]
    ghosts = out / "ghosts.json"
    ghosts = json.loads(ghosts.read_text())["ghosts"] if ghosts.exists() else {}
    share = lambda part, whole: f"{100 * ghosts[part] / max(1, ghosts[whole]):.2f}" if ghosts else "-"
    return [sequence.name, preset, f"{leaf(evaluation, 'ate', 'translation', 'rmse'):.4f}",
            f"{leaf(evaluation, 'ate', 'translation', 'sd'):.4f}",
            f"{leaf(evaluation, 'rpe', 'translation', 'rmse'):.4f}",
            f"{leaf(evaluation, 'rpe', 'rotation', 'rmse'):.3f}", f"{frames['tracked']}/{frames['total']}",
            f"{summary['tracking_median_ms']:.1f}", f"{summary['frames_per_second']:.1f}",
            f"{summary['peak_memory_mib']:.0f}", share("ghosts", "points"), share("kept", "surface")]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--model", type=Path)
    parser.add_argument("--presets", nargs="+", default=["static", "seg-mask"])
    parser.add_argument("--only", nargs="+", default=[])
    parser.add_argument("--ghosts", action="store_true")
    parser.add_argument("--table", action="store_true")
    arguments = parser.parse_args()
    if not arguments.table and arguments.model is None and arguments.presets != ["static"]:
        parser.error("--model FILE.onnx is needed for presets other than static")
    print("| " + " | ".join(HEAD) + " |\n|" + "---|" * len(HEAD))
    for sequence in sorted(p.parent for p in arguments.sequences.glob("*/groundtruth.txt")):
        if arguments.only and sequence.name not in arguments.only:
            continue
        for preset in arguments.presets:
            out = arguments.out / f"{sequence.name}_{preset}"
            try:
                if not arguments.table:
                    run(sequence, preset, out, arguments)
                if (out / "summary.json").exists():
                    print("| " + " | ".join(row(sequence, preset, out)) + " |", flush=True)
            except subprocess.CalledProcessError as e:
                print(f"{sequence.name}, {preset}: exit code {e.returncode}", file=sys.stderr)


main()
