# SPDX-License-Identifier: Apache-2.0
"""Maps every sequence with every preset, evaluates the results, and writes one table of all figures.

  python3 -m lab sequences SEQUENCES_DIR --out RESULTS_DIR [--model yolov8n-seg.onnx] [--box-model yolo11n.onnx]

A sequence is a folder in TUM layout with groundtruth.txt. NAME-no-network is preset NAME of `stillmap run --preset`
without the network; without --model all presets run so. --ablate adds runs of preset fused without each of its cues.

Where a sequence has true masks, the motion label of every keypoint is compared with them: precision and recall of
"moving". Where the sequence has no speeds of the masked objects, they are measured first, once (--no-labels leaves
out both). --ghosts counts the ghosts in the clouds, too.

One run follows the other. A run that was made by the same command line and the same program is not repeated, so
that an interrupted measurement continues; --again repeats all runs, --table makes none. A run that fails is listed
in the tables and tried again next time; the exit code is then 1.

Written to RESULTS_DIR after every run: table.md (printed at the end), table.json, and SEQUENCE_PRESET/ with results.
"""
import argparse
import statistics
from pathlib import Path

from lab import core
from lab.core import cell, coverage, in_order, leaf, markdown, read_json

FUSED_CUES = ["residual", "free-space", "surface", "history", "semantic"]  # of presets/fused.yaml


def without(cue, arguments):
    others = ",".join(name for name in FUSED_CUES if name != cue)
    fused = core.variant_of("fused", arguments)
    return core.Variant(f"{fused.name} minus {cue}", "fused", fused.model, (f"motion.cues={others}",))


def folder_of(variant, sequence, arguments):
    return arguments.out / f"{sequence.name}_{variant.name.replace(' ', '-')}"


# ----------------------------------------------------------------------------------------- running and evaluating


def ensure_run(variant, sequence, arguments):
    out = folder_of(variant, sequence, arguments)
    labels = ("--save-labels",) if arguments.labels else ()
    command = core.run_command(arguments.program, sequence, out, ["--preset", variant.preset, *labels], variant.model,
                               variant.settings + tuple(arguments.set))
    core.ensure_run(f"{sequence.name}, {variant.name}", command, out, arguments.again, labels,
                    ["labels.bin"] if labels else [])


def speeds_of(sequence, arguments):
    """Returns the folder with the speeds of the masked objects, which are measured if the sequence has none."""
    if (sequence / "speed").is_dir():
        return sequence / "speed"
    speeds = arguments.out / "speeds" / sequence.name
    if not speeds.is_dir():
        core.say(f"{sequence.name}, speeds ...")
        speeds.parent.mkdir(parents=True, exist_ok=True)
        core.call([arguments.lab_program, "speeds", sequence, speeds], speeds.parent / f"{sequence.name}.log")
    return speeds


def evaluate(out, name, arguments, *words):
    """Runs `stillmap eval` into OUT/name.json, unless the file exists."""
    if not read_json(out / f"{name}.json"):
        core.call([arguments.program, "eval", *words, "--json", out / f"{name}.json"], out / f"{name}.log")


def ensure_evaluated(variant, sequence, arguments):
    out = folder_of(variant, sequence, arguments)
    if not (sequence / "mask").is_dir():
        return
    if arguments.labels:
        labels = ("--labels", out / "labels.bin", "--sequence", sequence)
        evaluate(out, "labels", arguments, *labels, "--speeds", speeds_of(sequence, arguments))
        # Sitting people are never quite still; here they count as static, against which the labels are counted.
        if any(part in sequence.name for part in arguments.sitting):
            evaluate(out, "still", arguments, *labels, "--still-people")
    if arguments.ghosts:
        evaluate(out, "ghosts", arguments, sequence / "groundtruth.txt", out / "trajectory.txt", "--cloud",
                 out / "cloud.ply", "--sequence", sequence)


def ensure_row(variant, sequence, arguments):
    """Runs and evaluates unless the results exist, and returns the row of the tables; None if there is none."""
    error = folder_of(variant, sequence, arguments) / "error.txt"
    if not arguments.table:
        try:
            ensure_run(variant, sequence, arguments)
            ensure_evaluated(variant, sequence, arguments)
            error.unlink(missing_ok=True)
        except (core.Failed, OSError) as problem:
            error.parent.mkdir(parents=True, exist_ok=True)
            error.write_text(f"{problem}\n", encoding="utf-8")
            core.say(f"{sequence.name}, {variant.name}: failed: {problem}")
    return row_of(variant, sequence, arguments)


# --------------------------------------------------------------------------------------------------------- figures


def label_figures(labels, still):
    return {
        "precision": leaf(labels, "precision", "mean"), "recall": leaf(labels, "recall", "mean"),
        "pooled_precision": leaf(labels, "pooled", "precision"), "pooled_recall": leaf(labels, "pooled", "recall"),
        "false_still_people": leaf(labels, "false_moving_still_people", "mean"),
        "said_sitting_people": leaf(still, "false_moving_still_people", "mean"),
        "false_static_world": leaf(labels, "false_moving_static_world", "mean"),
    }


def ghost_figures(ghosts):
    def percent(part, whole):
        counted, of = leaf(ghosts, "ghosts", part), leaf(ghosts, "ghosts", whole)
        return None if counted is None or not of else 100 * counted / of
    return {"ghosts_percent": percent("ghosts", "points"), "surface_kept_percent": percent("kept", "surface")}


def row_of(variant, sequence, arguments):
    out = folder_of(variant, sequence, arguments)
    summary = read_json(out / "summary.json")
    error = (out / "error.txt").read_text(encoding="utf-8").strip() if (out / "error.txt").exists() else None
    if not summary and error is None:
        return None
    return {"sequence": sequence.name, "preset": variant.name, "error": error, **core.figures_of(summary),
            **label_figures(read_json(out / "labels.json").get("motion_labels", {}),
                            read_json(out / "still.json").get("motion_labels", {})),
            **ghost_figures(read_json(out / "ghosts.json"))}


# ---------------------------------------------------------------------------------------------------------- tables

# Groups of columns (heading, key, digits), shown where any run has a figure of the group.
ERRORS = [("ATE RMSE [m]", "ate_rmse_m", 4), ("ATE SD [m]", "ate_sd_m", 4), ("RPE 1 s [m]", "rpe_1s_m", 4),
          ("RPE 1 s [deg]", "rpe_1s_deg", 3)]
COSTS = [("tracking [ms]", "tracking_median_ms", 1), ("motion [ms]", "motion_median_ms", 2),
         ("frames/s", "frames_per_second", 1), ("memory [MiB]", "peak_memory_mib", 0), ("landmarks", "landmarks", 0)]
REPEATED = [("repeated erased", "repeated_erased", 0)]
LABELS = [("precision", "precision", 3), ("recall", "recall", 3), ("false, still people", "false_still_people", 3),
          ("labeled moving, sitting people", "said_sitting_people", 3), ("false, static world", "false_static_world", 4)]
GHOSTS = [("ghosts [%]", "ghosts_percent", 2), ("surface kept [%]", "surface_kept_percent", 2)]


def ate_cell(row, best):
    """Returns the ATE, bold if it is the best, with the coverage if it is incomplete, or the failure."""
    if row is None:
        return "-"
    text = cell(row["ate_rmse_m"], 4)
    if row["ate_rmse_m"] is not None and row["ate_rmse_m"] == best:
        text = f"**{text}**"
    if row["frames"] is not None and row["tracked"] < row["frames"]:
        text += f" ({coverage(row)})"
    return text if row["error"] is None else f"{text} (failed)"


def ate_table(rows, others):
    """Returns a table with one line per sequence, one column per preset, and the columns of other programs."""
    presets, columns = in_order(r["preset"] for r in rows), in_order(c for figures in others.values() for c in figures)
    lines = []
    for sequence in in_order(r["sequence"] for r in rows):
        runs = {r["preset"]: r for r in rows if r["sequence"] == sequence}
        best = min((r["ate_rmse_m"] for r in runs.values() if r["ate_rmse_m"] is not None), default=None)
        lines.append([sequence] + [ate_cell(runs.get(preset), best) for preset in presets]
                     + [cell(others.get(sequence, {}).get(column), 4) for column in columns])
    return markdown(["sequence", *presets, *columns], lines, "ATE RMSE [m]")


def run_table(rows):
    def shown(group):
        return [c for c in group if any(r[key] is not None for _, key, _ in group for r in rows)]
    repeated = REPEATED if any(r["repeated_erased"] for r in rows) else []
    after = COSTS + repeated + shown(LABELS) + shown(GHOSTS)
    lines = [[r["sequence"], r["preset"], *(cell(r[key], digits) for _, key, digits in ERRORS), coverage(r),
              *(cell(r[key], digits) for _, key, digits in after)] for r in rows]
    return markdown(["sequence", "preset", *(c[0] for c in ERRORS), "coverage", *(c[0] for c in after)], lines,
                    "Every run")


def cue_table(rows):
    """Returns the time per cue [ms]: the median over the sequences of the median over the frames."""
    lines = []
    for preset in in_order(r["preset"] for r in rows):
        cues = [r["cue_median_ms"] for r in rows if r["preset"] == preset]
        for cue in in_order(name for of_run in cues for name in of_run):
            values = [of_run[cue] for of_run in cues if cue in of_run]
            lines.append([preset, cue, cell(statistics.median(values), 3), cell(max(values), 3)])
    return markdown(["preset", "cue", "median [ms]", "on the slowest sequence [ms]"], lines, "Cues")


def failure_list(rows):
    failed = [f"- {r['sequence']}, {r['preset']}: {r['error']}" for r in rows if r["error"] is not None]
    return "Failed\n\n" + "\n".join(failed) + "\n" if failed else ""


def write_tables(rows, arguments):
    others = read_json(arguments.beside) if arguments.beside else {}
    text = "\n".join(filter(None, [ate_table(rows, others), run_table(rows), cue_table(rows), failure_list(rows)]))
    core.write_tables(arguments.out, text, {"beside": others, "runs": rows})
    return text


# ------------------------------------------------------------------------------------------------------------ main


def add_arguments(parser):
    core.add_run_arguments(parser, core.PRESETS)
    parser.add_argument("--ablate", action="store_true", help="also fused without each of its cues in turn")
    parser.add_argument("--without", type=core.names, default=[], help="also fused without these cues, one at a time")
    parser.add_argument("--sitting", type=core.names, default=["sitting"],
                        help="sequences with this in their name: also count the labels against people taken for still")
    parser.add_argument("--no-labels", dest="labels", action="store_false", help="do not evaluate motion labels")
    parser.add_argument("--no-verdicts", dest="labels", action="store_false", help=argparse.SUPPRESS)  # former name
    parser.add_argument("--ghosts", action="store_true", help="count ghosts in the clouds")
    parser.add_argument("--beside", type=Path, help="JSON, {sequence: {column: ATE in meters}}: columns of the ATE table")
    parser.add_argument("--table", action="store_true", help="run nothing, show the results that exist")
    parser.add_argument("--lab-program", type=Path, default=core.LAB_PROGRAM, help="default: %(default)s")


def main(arguments):
    if arguments.ablate and "fused" not in arguments.presets:
        arguments.presets = arguments.presets + ["fused"]
    if not arguments.table:
        core.check_run_arguments(arguments)
    rows, cues = [], list(arguments.without)

    def add(variant, sequence):
        row = ensure_row(variant, sequence, arguments)
        if row is not None:
            rows.append(row)
            write_tables(rows, arguments)
        return row or {}

    for sequence in core.sequences_of(arguments):
        for variant in core.variants_of(arguments):
            row = add(variant, sequence)
            if arguments.ablate and variant == core.variant_of("fused", arguments):  # its summary names its cues
                cues = in_order(cues + list(row.get("cue_median_ms", {})))
        for cue in cues:
            add(without(cue, arguments), sequence)
    print(write_tables(rows, arguments))
    return 1 if any(row["error"] is not None for row in rows) else 0
