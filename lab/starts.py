# SPDX-License-Identifier: Apache-2.0
"""Median and worst ATE over runs that start at different frames.

  python3 -m lab starts SEQUENCES_DIR --out RESULTS_DIR [--model yolov8n-seg.onnx] [--presets fused,static] [--starts 5]
  python3 -m lab starts SEQUENCES_DIR --out RESULTS_DIR --networks none,a.onnx,b.onnx --count 300

One run is one sample: which frame comes first decides which keyframes are made, and so moves the ATE. Every sequence
(a folder with groundtruth.txt) is mapped from frames 0 to N-1 on (`stillmap run --first`), and the accuracy is given
as the median of the N runs with the worst of them. Runs that exist are not repeated; see `lab sequences`.
Besides, as medians over the runs: ATE after alignment with scale, RPE over 1 s, error of the displacement from frame
to frame (its RMS, and the largest of all runs), and the mean normalized squared error of the poses by their covariances
(6 is expected). Where the truth is the pose of a marker (--truth-frame bonn_crowd=bonn), these use the pose of the
camera, the ATE the unchanged truth.

Written to RESULTS_DIR: starts.md (printed at the end), starts.json, and a folder per run.
"""
import json
import statistics
from pathlib import Path

from lab import core

NO_NETWORK = "none"


def add_arguments(parser):
    core.add_run_arguments(parser, ["fused"])
    parser.add_argument("--starts", type=int, default=5, help="number of first frames; default: %(default)s")
    parser.add_argument("--count", type=int, default=0, help="frames of each run; default: all")
    parser.add_argument("--networks", type=core.names, default=[], metavar="FILE,FILE",
                        help=f"run each preset with each of these networks instead of --model; {NO_NETWORK}: without one")
    parser.add_argument("--truth-frame", action="append", default=[], metavar="SEQUENCE=FRAME",
                        help="frame of a sequence's truth, as of `stillmap eval --truth-frame`")


def variants_of(arguments):
    """Variants of all presets, with each network if several are named."""
    if not arguments.networks:
        return core.variants_of(arguments)
    return [core.Variant(preset + core.NO_NETWORK, preset) if network == NO_NETWORK else
            core.Variant(f"{preset}-{Path(network).stem}", preset, Path(network))
            for network in arguments.networks for preset in arguments.presets]


def evaluated(sequence, out, words, arguments):
    """Figures of `stillmap eval` with these words."""
    file = out / "eval.json"
    core.call([arguments.program, "eval", sequence / "groundtruth.txt", out / "trajectory.txt", "--scale", "--force",
               "--json", file, *words], out / "eval.log")
    return json.loads(file.read_text(encoding="utf-8"))


def accuracy_of(sequence, out, arguments):
    """Figures of a run that its summary does not have."""
    frame = dict(word.split("=", 1) for word in arguments.truth_frame).get(sequence.name)
    words = ["--covariances", out / "trajectory_covariance.txt"]
    unchanged = evaluated(sequence, out, words, arguments)
    of_camera = evaluated(sequence, out, [*words, "--truth-frame", frame], arguments) if frame else unchanged
    return {"ate_with_scale_m": core.leaf(unchanged, "ate_with_scale", "translation", "rmse"),
            "rpe_1s_m": core.leaf(of_camera, "rpe_1s", "translation", "rmse"),
            "displacement_m": core.leaf(of_camera, "displacement", "error", "rmse"),
            "displacement_largest_m": core.leaf(of_camera, "displacement", "error", "max"),
            "nees": core.leaf(of_camera, "covariances", "nees")}


def run_from(first, variant, sequence, arguments):
    """Figures of one run, or {"error": reason}."""
    out = arguments.out / f"{sequence.name}_{variant.name}_from_{first}"
    words = ["--preset", variant.preset, "--first", first]
    if arguments.count:
        words += ["--count", arguments.count]
    command = core.run_command(arguments.program, sequence, out, words, variant.model,
                               variant.settings + tuple(arguments.set))
    try:
        figures = core.figures_of(core.ensure_run(f"{sequence.name}, {variant.name}, from {first}", command, out,
                                                  arguments.again))
        return {**figures, **accuracy_of(sequence, out, arguments)}
    except (core.Failed, OSError) as problem:
        return {"error": str(problem)}


def row_of(sequence, preset, runs):
    """Returns one line of the table: sequence and preset, with the figures over the runs of all starts."""
    def known(name):
        return [run[name] for run in runs if run.get(name) is not None]

    def median(name):
        return statistics.median(known(name)) if known(name) else None

    return {"sequence": sequence, "preset": preset, "ate_rmse_m": [run.get("ate_rmse_m") for run in runs],
            "median_m": median("ate_rmse_m"), "worst_m": max(known("ate_rmse_m"), default=None),
            "with_scale_m": median("ate_with_scale_m"), "rpe_1s_m": median("rpe_1s_m"),
            "displacement_m": median("displacement_m"), "nees": median("nees"),
            "displacement_largest_m": max(known("displacement_largest_m"), default=None),
            "not_tracked": [run["frames"] - run["tracked"] if run.get("frames") else None for run in runs],
            "errors": [run["error"] for run in runs if "error" in run]}


def millimeters(value):
    return None if value is None else 1000 * value


def text_of(rows, starts):
    lines = [[row["sequence"], row["preset"], " ".join(core.cell(ate, 4) for ate in row["ate_rmse_m"]),
              f"{core.cell(row['median_m'], 4)}; {core.cell(row['worst_m'], 4)}", core.cell(row["with_scale_m"], 4),
              core.cell(row["rpe_1s_m"], 4),
              f"{core.cell(millimeters(row['displacement_m']), 1)}; "
              f"{core.cell(millimeters(row['displacement_largest_m']), 1)}",
              core.cell(row["nees"], 1), " ".join(core.cell(count, 0) for count in row["not_tracked"])] for row in rows]
    head = ["sequence", "preset", f"ATE [m] from frames 0 to {starts - 1}", "median; worst", "with scale",
            "RPE over 1 s [m]", "displacement: RMS; largest [mm]", "normalized error", "not tracked"]
    text = core.markdown(head, lines, "ATE RMSE over starts")
    failed = [f"- {row['sequence']}, {row['preset']}: {error}" for row in rows for error in row["errors"]]
    return text + ("\nFailed\n\n" + "\n".join(failed) + "\n" if failed else "")


def main(arguments):
    core.check_run_arguments(arguments)
    if arguments.starts < 1:
        arguments.error("--starts must be 1 or more")
    for network in arguments.networks:
        if network != NO_NETWORK and not Path(network).exists():
            arguments.error(f"there is no network {network}: name another one, or {NO_NETWORK}")
    rows = []
    for sequence in core.sequences_of(arguments):
        for variant in variants_of(arguments):
            runs = [run_from(first, variant, sequence, arguments) for first in range(arguments.starts)]
            rows.append(row_of(sequence.name, variant.name, runs))
            core.write_tables(arguments.out, text_of(rows, arguments.starts),
                              {"starts": arguments.starts, "rows": rows}, "starts")
    print(text_of(rows, arguments.starts))
    return 1 if any(row["errors"] for row in rows) else 0
