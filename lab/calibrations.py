# SPDX-License-Identifier: Apache-2.0
"""Checks the uncertainty that `stillmap calibrate` states, on pieces of recordings with known cameras.

  python3 -m lab calibrations SEQUENCES --out DIR [--pieces 40] [--lengths 60,100,150,200,300] [--only NAMES]

SEQUENCES holds sequences in TUM layout with groundtruth.txt and the correct camera in camera.yaml. Four more are rendered
into DIR/rendered, with exact values of all parameters. Pieces of these lengths (in turn), spread evenly over every
sequence, are calibrated, starting from the correct camera. A parameter is observed unless the command calls it not
observable. Its uncertainty holds if the truth is within two standard deviations of the estimate. Since the camera is
correct, every correction is wrong; a piece whose camera was corrected is mapped with both cameras. Of real sensors only the
intrinsics count, since the errors of their depth and timing are unknown.

Written to DIR: calibrations.md (printed at the end) and calibrations.json, with all parameters of every piece.
"""
import math
import re
import statistics
import subprocess
from pathlib import Path

from lab import core, findings

RENDERED = {"xyz": ["--camera", "xyz", "--seed", 1], "rpy": ["--camera", "rpy", "--seed", 2],
            "halfsphere": ["--camera", "halfsphere", "--seed", 3], "loop": ["--camera", "loop", "--seed", 4]}
INTRINSICS = ("fx", "fy", "cx", "cy")
LINE = re.compile(r"^(\w+) \[\S+\] +(\S+) +(\S+) +(\S+)  (kept|corrected|not observable)", re.MULTILINE)


def add_arguments(parser):
    parser.add_argument("sequences", type=Path, help="folder of sequences in TUM layout, with groundtruth.txt")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument("--only", type=core.names, default=[], help="only sequences of these names")
    parser.add_argument("--pieces", type=int, default=40, help="number of pieces of all sequences; default: %(default)s")
    parser.add_argument("--lengths", type=lambda text: [int(n) for n in text.split(",")], default=[60, 100, 150, 200, 300],
                        help="lengths of the pieces [frames]; default: 60,100,150,200,300")
    parser.add_argument("--frames", type=int, default=300, help="length of the rendered sequences; default: %(default)s")
    parser.add_argument("--width", type=int, default=640, help="width of the rendered images; default: %(default)s")
    parser.add_argument("--preset", default="fused", help="preset of the runs with both cameras; default: %(default)s")
    parser.add_argument("--program", type=Path, default=core.PROGRAM, help="default: %(default)s")


# -------------------------------------------------------------------------------------------------------- pieces


def rendered(arguments):
    """Returns the rendered sequences, which are made if they are missing."""
    folders = []
    for name, words in RENDERED.items():
        folder = arguments.out / "rendered" / name
        if not (folder / "groundtruth.txt").exists():
            core.say(f"rendering {name} ...")
            size = ["--width", arguments.width, "--height", arguments.width * 3 // 4]
            command = [arguments.program, "simulate", *words, "--people", 1, "--frames", arguments.frames, *size, "--out", folder]
            core.call(command, arguments.out / "render.log")
        folders.append(folder)
    return folders


def pieces(sequence, lengths, count):
    """Returns first frame and length of pieces that are spread evenly over a sequence; the lengths are used in turn."""
    frames = len(findings.rows(sequence / "rgb.txt"))
    result = []
    for i in range(count):
        length = min(lengths[i % len(lengths)], frames)
        result.append((round((frames - length) * i / max(1, count - 1)), length))
    return list(dict.fromkeys(result))


# --------------------------------------------------------------------------------------------------- measurement


def parameters_of(text):
    """Returns the lines of the table that `calibrate` prints."""
    return [{"name": name, "given": float(given), "estimated": float(estimated), "sigma": float(sigma), "verdict": verdict}
            for name, given, estimated, sigma, verdict in LINE.findall(text)]


def ate_of(arguments, sequence, first, length, words):
    """Returns the ATE of a piece [m]; None if it fails."""
    out = arguments.out / "run"
    command = core.run_command(arguments.program, sequence, out, ["--first", first, "--count", length, "--preset",
                                                                  arguments.preset, "--force", "-q", *words],
                               settings=["dense.enabled=false"])
    subprocess.run(command, capture_output=True, check=False)
    return core.figures_of(core.read_json(out / "summary.json"))["ate_rmse_m"]


def measure(arguments, sequence, kind, first, length):
    camera = arguments.out / "camera.yaml"
    command = [arguments.program, "calibrate", sequence, "--first", first, "--count", length, "--out", camera, "--force", "-q"]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise core.Failed(f"{sequence.name}, frames {first} to {first + length}: {done.stderr.strip()}")
    piece = {"sequence": sequence.name, "kind": kind, "first": first, "frames": length, "parameters": parameters_of(done.stdout)}
    if any(p["verdict"] == "corrected" for p in piece["parameters"]):
        piece["ate_given_m"] = ate_of(arguments, sequence, first, length, [])
        piece["ate_calibrated_m"] = ate_of(arguments, sequence, first, length, ["--camera", camera])
    core.say(f"{sequence.name}, {length} frames from {first}: " + ", ".join(
        f"{p['name']} {p['estimated'] - p['given']:+.4g} +- {p['sigma']:.2g} {p['verdict']}" for p in piece["parameters"]))
    return piece


# --------------------------------------------------------------------------------------------------------- tables


def holds(parameter):
    return abs(parameter["estimated"] - parameter["given"]) <= 2 * parameter["sigma"]


def ate_ratio(piece):
    given, calibrated = piece.get("ate_given_m"), piece.get("ate_calibrated_m")
    return calibrated / given if given and calibrated else math.inf if given else 1.0


def scatter(parameters):
    """Returns the RMS of error / standard deviation, and the median standard deviation, of the parameters with one."""
    known = [p for p in parameters if math.isfinite(p["sigma"]) and p["sigma"] > 0]
    if not known:
        return ["-", "-"]
    square = statistics.mean(((p["estimated"] - p["given"]) / p["sigma"]) ** 2 for p in known)
    return [f"{math.sqrt(square):.2f}", f"{statistics.median(p['sigma'] for p in known):.3g}"]


def row(name, parameters):
    observed = [p for p in parameters if p["verdict"] != "not observable"]
    share = lambda part, whole: f"{100 * part / whole:.0f} %" if whole else "-"
    return [name, len(parameters), share(len(parameters) - len(observed), len(parameters)),
            share(sum(map(holds, observed)), len(observed)), share(sum(map(holds, parameters)), len(parameters)),
            sum(p["verdict"] == "corrected" for p in parameters), *scatter(parameters)]


def tables(results):
    lines = []
    for kind in core.in_order(piece["kind"] for piece in results):
        of_kind = [p for piece in results if piece["kind"] == kind for p in piece["parameters"]]
        for name in core.in_order(p["name"] for p in of_kind):
            if kind == "rendered" or name in INTRINSICS:
                lines.append(row(f"{kind}, {name}", [p for p in of_kind if p["name"] == name]))
    head = ["parameter", "pieces", "not observable", "observed: within 2 sigma", "all: within 2 sigma", "wrong corrections",
            "RMS of error / sigma", "median sigma"]
    ratios = [ate_ratio(piece) for piece in results]
    return core.markdown(head, lines, f"{len(results)} pieces with correct cameras") + (
        f"\nRatio of the ATE with the calibrated camera to that with the given one: at most {max(ratios):.2f}, "
        f"above 1.05 in {sum(ratio > 1.05 for ratio in ratios)} of {len(ratios)} pieces; "
        f"{sum('ate_given_m' in piece for piece in results)} cameras were changed.\n")


def main(arguments):
    arguments.out.mkdir(parents=True, exist_ok=True)
    sequences = [(s, s.name) for s in core.sequences_of(arguments)] + [(s, "rendered") for s in rendered(arguments)]
    results = []
    for i, (sequence, kind) in enumerate(sequences):
        count = arguments.pieces * (i + 1) // len(sequences) - arguments.pieces * i // len(sequences)
        for first, length in pieces(sequence, arguments.lengths, count):
            results.append(measure(arguments, sequence, kind, first, length))
            text = tables(results)
            core.write_tables(arguments.out, text, results, "calibrations")
    print(text)
    return 0
