# SPDX-License-Identifier: Apache-2.0
"""SHA-256 of trajectory, keyframes, cloud and movers of every sequence.

  python3 -m lab hashes SEQUENCES_DIR --out RESULTS_DIR [--model yolov8n-seg.onnx] [--presets fused] [--count N]
  python3 -m lab hashes ... --compare OLD/hashes.json      names the files that differ; exit code 1 if any does

In lockstep the results depend on the data and the options alone, so a change that must not change results must not
change these. Written to RESULTS_DIR: hashes.md (printed at the end), hashes.json, and a folder per run.
"""
from pathlib import Path

from lab import core

FILES = ("trajectory.txt", "keyframes.txt", "cloud.ply", "movers.csv")
SHOWN = 16  # digits in the table; the JSON has all 64


def add_arguments(parser):
    core.add_run_arguments(parser, ["fused"])
    parser.add_argument("--count", type=int, default=0, help="only the first frames; default: all")
    parser.add_argument("--compare", type=Path, metavar="OLD.json", help="an older hashes.json to compare with")


def hashes_of(variant, sequence, arguments):
    """Returns file name -> SHA-256 of one run; None for a file that the run does not have."""
    out = arguments.out / f"{sequence.name}_{variant.name}"
    words = ["--preset", variant.preset, *(["--count", arguments.count] if arguments.count else [])]
    command = core.run_command(arguments.program, sequence, out, words, variant.model,
                               variant.settings + tuple(arguments.set))
    core.ensure_run(f"{sequence.name}, {variant.name}", command, out, arguments.again)
    return {file: core.sha256_of(out / file) if (out / file).exists() else None for file in FILES}


def differing(runs, old):
    """Returns lines that name the files which differ from an older list, or which it lacks."""
    return [f"- {run}: {file} differs" for run, hashes in runs.items() for file in FILES
            if hashes[file] != old.get(run, {}).get(file)]


def main(arguments):
    core.check_run_arguments(arguments)
    runs = {f"{sequence.name}, {variant.name}": hashes_of(variant, sequence, arguments)
            for sequence in core.sequences_of(arguments) for variant in core.variants_of(arguments)}
    lines = [[run, *((hashes[file] or "-")[:SHOWN] for file in FILES)] for run, hashes in runs.items()]
    text = core.markdown(["run", *FILES], lines, "SHA-256, first digits")
    changed = differing(runs, core.read_json(arguments.compare)) if arguments.compare else []
    if arguments.compare:
        text += "\n" + ("\n".join(changed) if changed else f"All are the same as in {arguments.compare}.") + "\n"
    core.write_tables(arguments.out, text, runs, "hashes")
    print(text)
    return 1 if changed else 0
