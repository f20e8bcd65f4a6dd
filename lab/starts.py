# SPDX-License-Identifier: Apache-2.0
"""Median and worst ATE over runs that start at different frames.

  python3 -m lab starts SEQUENCES_DIR --out RESULTS_DIR [--model yolov8n-seg.onnx] [--presets fused,static] [--starts 5]

One run is one sample: which frame comes first decides which keyframes are made, and so moves the ATE. Every sequence
(a folder with groundtruth.txt) is mapped from frames 0 to N-1 on (`stillmap run --first`), and the accuracy is given
as the median of the N runs with the worst of them. Runs that exist are not repeated; see `lab sequences`.

Written to RESULTS_DIR: starts.md (printed at the end), starts.json, and a folder per run.
"""
import statistics

from lab import core


def add_arguments(parser):
    core.add_run_arguments(parser, ["fused"])
    parser.add_argument("--starts", type=int, default=5, help="number of first frames; default: %(default)s")


def run_from(first, variant, sequence, arguments):
    """Figures of one run, or {"error": reason}."""
    out = arguments.out / f"{sequence.name}_{variant.name}_from_{first}"
    words = ["--preset", variant.preset, "--first", first]
    command = core.run_command(arguments.program, sequence, out, words, variant.model,
                               variant.settings + tuple(arguments.set))
    try:
        return core.figures_of(core.ensure_run(f"{sequence.name}, {variant.name}, from {first}", command, out,
                                               arguments.again))
    except (core.Failed, OSError) as problem:
        return {"error": str(problem)}


def row_of(sequence, preset, runs):
    """Returns one line of the table: sequence and preset, with the figures over the runs of all starts."""
    ates = [run.get("ate_rmse_m") for run in runs]
    known = [ate for ate in ates if ate is not None]
    least = min((run for run in runs if run.get("frames")), default=None, key=lambda run: run["tracked"] / run["frames"])
    return {"sequence": sequence, "preset": preset, "ate_rmse_m": ates,
            "median_m": statistics.median(known) if known else None, "worst_m": max(known, default=None),
            "least_tracked": least["tracked"] if least else None, "frames": least["frames"] if least else None,
            "errors": [run["error"] for run in runs if "error" in run]}


def text_of(rows, starts):
    lines = [[row["sequence"], row["preset"], core.cell(row["median_m"], 4), core.cell(row["worst_m"], 4),
              " ".join(core.cell(ate, 4) for ate in row["ate_rmse_m"]),
              "-" if row["frames"] is None else f"{row['least_tracked']}/{row['frames']}"] for row in rows]
    head = ["sequence", "preset", "median", "worst", f"from frame 0 to {starts - 1}", "tracked, least"]
    text = core.markdown(head, lines, "ATE RMSE [m] over starts")
    failed = [f"- {row['sequence']}, {row['preset']}: {error}" for row in rows for error in row["errors"]]
    return text + ("\nFailed\n\n" + "\n".join(failed) + "\n" if failed else "")


def main(arguments):
    core.check_run_arguments(arguments)
    if arguments.starts < 1:
        arguments.error("--starts must be 1 or more")
    rows = []
    for sequence in core.sequences_of(arguments):
        for variant in core.variants_of(arguments):
            runs = [run_from(first, variant, sequence, arguments) for first in range(arguments.starts)]
            rows.append(row_of(sequence.name, variant.name, runs))
            core.write_tables(arguments.out, text_of(rows, arguments.starts),
                              {"starts": arguments.starts, "rows": rows}, "starts")
    print(text_of(rows, arguments.starts))
    return 1 if any(row["errors"] for row in rows) else 0
