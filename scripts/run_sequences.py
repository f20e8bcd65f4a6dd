#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps every sequence in a folder with every preset, evaluates the results and writes one table of all figures.

  scripts/run_sequences.py SEQUENCES_DIR --out RESULTS_DIR --model yolov8n-seg.onnx [--box-model yolo11n.onnx]

A sequence is a folder in TUM layout with groundtruth.txt. In addition to the presets of `stillmap run --preset` there is
fused-nonet: preset fused without a network. --ablate adds a run of preset fused without each of its cues in turn.

For a sequence with true masks the motion labels are evaluated: precision and recall of "moving". If it has no speed
images, they are measured first, once (--no-verdicts skips both).
--ghosts also counts the ghosts in the clouds.

Runs are sequential. An existing run of the same command line and program is not repeated, so an interrupted
series continues where it stopped; --again repeats all runs, --table none. A failed run is marked in the tables, does not
stop the others, and is repeated next time; the exit code is then 1.

Written to RESULTS_DIR after every run: table.md (printed at the end), table.json, and SEQUENCE_PRESET/ with the results.
"""
import argparse
import hashlib
import json
import statistics
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PRESETS = ["static", "seg-mask", "box-flow", "gated-seg", "box-epipolar", "fused", "fused-nonet"]
BOX_PRESETS = {"box-flow", "box-epipolar"}  # their papers have boxes, not masks
NO_NETWORK = "-nonet"
MADE_FROM_RUN = ("run.json", "verdicts.json", "still.json", "ghosts.json", "error.txt")


class Failed(RuntimeError):
    """A program that did not do what it was called for."""


# ----------------------------------------------------------------------------------------------- what is to be run


@dataclass(frozen=True)
class Variant:
    """A preset, how it is run, and what the tables call it."""
    name: str
    preset: str
    model: Path | None = None
    settings: tuple[str, ...] = ()

    def folder(self, sequence, arguments):
        return arguments.out / f"{sequence.name}_{self.name.replace(' ', '-')}"


def variant_of(name, arguments):
    preset = name.removesuffix(NO_NETWORK)
    if preset != name or name == "static":
        return Variant(name, preset)
    model = arguments.box_model if name in BOX_PRESETS and arguments.box_model else arguments.model
    return Variant(name, preset, model)


def without(cue, arguments):
    return Variant(f"fused minus {cue}", "fused", arguments.model, (f"motion.without={cue}",))


# ------------------------------------------------------------------------------------------------ running, judging


def call(command, log):
    """Runs a program, its output into a log. Throws Failed with the end of it where it fails."""
    with log.open("w", encoding="utf-8") as to:
        code = subprocess.run(command, stdout=to, stderr=subprocess.STDOUT, check=False).returncode
    if code != 0:
        end = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-3:]
        raise Failed(f"exit code {code}: {' / '.join(end)}")


def read_json(file):
    """What the file says; {} where it is missing or broken."""
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def run_command(variant, sequence, out, arguments):
    command = [arguments.program, "run", sequence, "--preset", variant.preset, "--out", out]
    command += ["--model", variant.model] if variant.model else []
    for setting in variant.settings + tuple(arguments.set):
        command += ["--set", setting]
    return [str(word) for word in command + (["--save-verdicts"] if arguments.verdicts else [])]


def ensure_run(variant, sequence, arguments):
    """Runs, unless that very run is there already."""
    out = variant.folder(sequence, arguments)
    command = run_command(variant, sequence, out, arguments)
    made_by = {"command": [word for word in command if word != "--save-verdicts"], "program": arguments.fingerprint}
    there = read_json(out / "run.json") == made_by and read_json(out / "summary.json")
    if there and not arguments.again and (not arguments.verdicts or (out / "verdicts.bin").exists()):
        return
    out.mkdir(parents=True, exist_ok=True)
    for stale in MADE_FROM_RUN + ("summary.json",):
        (out / stale).unlink(missing_ok=True)
    print(f"{sequence.name}, {variant.name} ...", file=sys.stderr, flush=True)
    call(command, out / "run.log")
    (out / "run.json").write_text(json.dumps(made_by, indent=1), encoding="utf-8")


def speeds_of(sequence, arguments):
    """The folder with the speeds of what a sequence shows, measured where it brings none."""
    if (sequence / "speed").is_dir():
        return sequence / "speed"
    speeds = arguments.out / "speeds" / sequence.name
    if not speeds.is_dir():
        print(f"{sequence.name}, speeds ...", file=sys.stderr, flush=True)
        speeds.parent.mkdir(parents=True, exist_ok=True)
        call([str(arguments.program), "eval", "--sequence", str(sequence), "--measure-speeds", str(speeds)],
             speeds.parent / f"{sequence.name}.log")
    return speeds


def judge(out, name, arguments, *words):
    """`stillmap eval` into OUT/name.json, unless it is there already."""
    if not read_json(out / f"{name}.json"):
        call([str(word) for word in (arguments.program, "eval", *words, "--json", out / f"{name}.json")],
             out / f"{name}.log")


def ensure_judged(variant, sequence, arguments):
    out = variant.folder(sequence, arguments)
    if not (sequence / "mask").is_dir():
        return
    if arguments.verdicts:
        verdicts = ("--verdicts", out / "verdicts.bin", "--sequence", sequence)
        judge(out, "verdicts", arguments, *verdicts, "--speeds", speeds_of(sequence, arguments))
        # Whoever sits never keeps quite still; what is made of them if they count as still?
        if any(part in sequence.name for part in arguments.sitting):
            judge(out, "still", arguments, *verdicts, "--still-people")
    if arguments.ghosts:
        judge(out, "ghosts", arguments, sequence / "groundtruth.txt", out / "trajectory.txt", "--cloud",
              out / "cloud.ply", "--sequence", sequence)


def ensure_row(variant, sequence, arguments):
    """Runs and judges as far as it is not done yet, and returns what the tables show of it; None where there is
    nothing to show."""
    error = variant.folder(sequence, arguments) / "error.txt"
    if not arguments.table:
        try:
            ensure_run(variant, sequence, arguments)
            ensure_judged(variant, sequence, arguments)
            error.unlink(missing_ok=True)
        except (Failed, OSError) as problem:
            error.parent.mkdir(parents=True, exist_ok=True)
            error.write_text(f"{problem}\n", encoding="utf-8")
            print(f"{sequence.name}, {variant.name}: failed: {problem}", file=sys.stderr, flush=True)
    return row_of(variant, sequence, arguments)


# --------------------------------------------------------------------------------------------------------- figures


def leaf(tree, *path):
    """The number at the first matching path; keys match by their beginning, as units follow the names."""
    for name in path:
        tree = next((v for k, v in tree.items() if k.startswith(name)), {}) if isinstance(tree, dict) else {}
    return tree if isinstance(tree, (int, float)) else None


def run_figures(summary):
    evaluation = summary.get("evaluation", {})
    medians = {stage["name"]: stage["median_ms"] for stage in summary.get("timing_ms", [])}
    return {
        "ate_rmse_m": leaf(evaluation, "ate", "translation", "rmse"),
        "ate_sd_m": leaf(evaluation, "ate", "translation", "sd"),
        "rpe_1s_m": leaf(evaluation, "rpe", "translation", "rmse"),
        "rpe_1s_deg": leaf(evaluation, "rpe", "rotation", "rmse"),
        "tracked": leaf(summary, "frames", "tracked"), "frames": leaf(summary, "frames", "total"),
        "tracking_median_ms": leaf(summary, "tracking_median_ms"), "motion_median_ms": medians.get("motion"),
        "cue_median_ms": {name.removeprefix("motion: "): ms for name, ms in medians.items()
                          if name.startswith("motion: ")},
        "frames_per_second": leaf(summary, "frames_per_second"), "peak_memory_mib": leaf(summary, "peak_memory_mib"),
        "repeated_pairs": leaf(summary, "refinement", "repeated_pairs"),
        "repeated_gone": leaf(summary, "refinement", "repeated_gone"),
        "maps": leaf(summary, "maps"), "keyframes": leaf(summary, "keyframes"), "landmarks": leaf(summary, "landmarks"),
    }


def verdict_figures(verdicts, still):
    return {
        "precision": leaf(verdicts, "precision", "mean"), "recall": leaf(verdicts, "recall", "mean"),
        "pooled_precision": leaf(verdicts, "pooled", "precision"), "pooled_recall": leaf(verdicts, "pooled", "recall"),
        "false_still_people": leaf(verdicts, "false_moving_still_people", "mean"),
        "said_sitting_people": leaf(still, "false_moving_still_people", "mean"),
        "false_static_world": leaf(verdicts, "false_moving_static_world", "mean"),
    }


def ghost_figures(ghosts):
    def percent(part, whole):
        counted, of = leaf(ghosts, "ghosts", part), leaf(ghosts, "ghosts", whole)
        return None if counted is None or not of else 100 * counted / of
    return {"ghosts_percent": percent("ghosts", "points"), "surface_kept_percent": percent("kept", "surface")}


def row_of(variant, sequence, arguments):
    out = variant.folder(sequence, arguments)
    summary = read_json(out / "summary.json")
    error = (out / "error.txt").read_text(encoding="utf-8").strip() if (out / "error.txt").exists() else None
    if not summary and error is None:
        return None
    return {"sequence": sequence.name, "preset": variant.name, "error": error, **run_figures(summary),
            **verdict_figures(read_json(out / "verdicts.json").get("verdicts", {}),
                              read_json(out / "still.json").get("verdicts", {})),
            **ghost_figures(read_json(out / "ghosts.json"))}


# ---------------------------------------------------------------------------------------------------------- tables

# Groups of columns (heading, key, digits), shown where any run has a figure of the group.
ERRORS = [("ATE RMSE [m]", "ate_rmse_m", 4), ("ATE SD [m]", "ate_sd_m", 4), ("RPE 1 s [m]", "rpe_1s_m", 4),
          ("RPE 1 s [deg]", "rpe_1s_deg", 3)]
COSTS = [("tracking [ms]", "tracking_median_ms", 1), ("motion [ms]", "motion_median_ms", 2),
         ("frames/s", "frames_per_second", 1), ("memory [MiB]", "peak_memory_mib", 0), ("landmarks", "landmarks", 0)]
REPEATED = [("repeated pairs", "repeated_pairs", 0), ("repeated gone", "repeated_gone", 0)]
VERDICTS = [("precision", "precision", 3), ("recall", "recall", 3), ("false, still people", "false_still_people", 3),
            ("said, sitting people", "said_sitting_people", 3), ("false, static world", "false_static_world", 4)]
GHOSTS = [("ghosts [%]", "ghosts_percent", 2), ("surface kept [%]", "surface_kept_percent", 2)]


def cell(value, digits):
    return "-" if value is None else f"{value:.{digits}f}"


def markdown(title, head, rows):
    lines = [head, ["---"] * len(head)] + rows
    return f"{title}\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def in_order(values):
    return list(dict.fromkeys(values))


def coverage(row):
    return "-" if row["frames"] is None else f"{row['tracked']}/{row['frames']}"


def ate_cell(row, best):
    """The best is bold; frames that were not tracked, and failures, are told."""
    if row is None:
        return "-"
    text = cell(row["ate_rmse_m"], 4)
    if row["ate_rmse_m"] is not None and row["ate_rmse_m"] == best:
        text = f"**{text}**"
    if row["frames"] is not None and row["tracked"] < row["frames"]:
        text += f" ({coverage(row)})"
    return text if row["error"] is None else f"{text} (failed)"


def ate_table(rows, beside):
    """One line a sequence, one column a preset, then those of figures to be shown beside."""
    presets, others = in_order(r["preset"] for r in rows), in_order(c for figures in beside.values() for c in figures)
    lines = []
    for sequence in in_order(r["sequence"] for r in rows):
        runs = {r["preset"]: r for r in rows if r["sequence"] == sequence}
        best = min((r["ate_rmse_m"] for r in runs.values() if r["ate_rmse_m"] is not None), default=None)
        lines.append([sequence] + [ate_cell(runs.get(preset), best) for preset in presets]
                     + [cell(beside.get(sequence, {}).get(other), 4) for other in others])
    return markdown("ATE RMSE [m]", ["sequence", *presets, *others], lines)


def run_table(rows):
    def shown(group):
        return [c for c in group if any(r[key] is not None for _, key, _ in group for r in rows)]
    repeated = REPEATED if any(r["repeated_pairs"] for r in rows) else []
    before, after = ERRORS, COSTS + repeated + shown(VERDICTS) + shown(GHOSTS)
    lines = [[r["sequence"], r["preset"], *(cell(r[key], digits) for _, key, digits in before), coverage(r),
              *(cell(r[key], digits) for _, key, digits in after)] for r in rows]
    return markdown("Every run", ["sequence", "preset", *(c[0] for c in before), "coverage", *(c[0] for c in after)],
                    lines)


def cue_table(rows):
    """Milliseconds per cue: the median over frames, of that the median over sequences."""
    lines = []
    for preset in in_order(r["preset"] for r in rows):
        cues = [r["cue_median_ms"] for r in rows if r["preset"] == preset]
        for cue in in_order(name for of_run in cues for name in of_run):
            values = [of_run[cue] for of_run in cues if cue in of_run]
            lines.append([preset, cue, cell(statistics.median(values), 3), cell(max(values), 3)])
    return markdown("Cues", ["preset", "cue", "median [ms]", "on the slowest sequence [ms]"], lines)


def failure_list(rows):
    failed = [f"- {r['sequence']}, {r['preset']}: {r['error']}" for r in rows if r["error"] is not None]
    return "Failed\n\n" + "\n".join(failed) + "\n" if failed else ""


def write_tables(rows, arguments):
    beside = read_json(arguments.beside) if arguments.beside else {}
    text = "\n".join(filter(None, [ate_table(rows, beside), run_table(rows), cue_table(rows), failure_list(rows)]))
    (arguments.out / "table.md").write_text(text, encoding="utf-8")
    (arguments.out / "table.json").write_text(json.dumps({"beside": beside, "runs": rows}, indent=1) + "\n",
                                              encoding="utf-8")
    return text


# ------------------------------------------------------------------------------------------------------------ main


def names(text):
    return [name for name in text.split(",") if name]


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", type=Path, help="folder of sequences")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument("--model", type=Path, help="network with masks")
    parser.add_argument("--box-model", type=Path, help="network with boxes, for box-flow and box-epipolar")
    parser.add_argument("--presets", type=names, default=PRESETS, help="default: " + ",".join(PRESETS))
    parser.add_argument("--ablate", action="store_true", help="also fused without each of its cues in turn")
    parser.add_argument("--without", type=names, default=[], help="also fused without these cues, one at a time")
    parser.add_argument("--only", type=names, default=[], help="only sequences of these names")
    parser.add_argument("--set", action="append", default=[], metavar="ROOM.OPTION=VALUE", help="for every run")
    parser.add_argument("--sitting", type=names, default=["sitting"],
                        help="in sequences with this in their name, also count what is said to move of people at all")
    parser.add_argument("--no-verdicts", dest="verdicts", action="store_false", help="do not judge keypoints")
    parser.add_argument("--ghosts", action="store_true", help="count ghosts in the clouds")
    parser.add_argument("--beside", type=Path, help="JSON, {sequence: {column: ATE in meters}}: shown beside ours")
    parser.add_argument("--table", action="store_true", help="run nothing, show what is there")
    parser.add_argument("--again", action="store_true", help="make all runs anew")
    parser.add_argument("--program", type=Path, default=ROOT / "build/release/stillmap", help="default: %(default)s")
    arguments = parser.parse_args()
    if arguments.ablate and "fused" not in arguments.presets:
        arguments.presets = arguments.presets + ["fused"]
    lacking = [name for name in arguments.presets
               if name != "static" and not name.endswith(NO_NETWORK) and variant_of(name, arguments).model is None]
    if lacking and not arguments.table:
        parser.error(f"--model FILE.onnx is needed for {', '.join(lacking)}")
    if not arguments.table:
        if not arguments.program.is_file():
            parser.error(f"there is no {arguments.program}: build it, or name it with --program")
        arguments.fingerprint = hashlib.sha256(arguments.program.read_bytes()).hexdigest()
    return arguments


def sequences_of(arguments):
    sequences = sorted(p.parent for p in arguments.sequences.glob("*/groundtruth.txt")
                       if not arguments.only or p.parent.name in arguments.only)
    missing = set(arguments.only) - {sequence.name for sequence in sequences}
    if missing or not sequences:
        sys.exit(f"no sequence {', '.join(sorted(missing))} (a folder with groundtruth.txt) in {arguments.sequences}")
    return sequences


def main():
    arguments = parse()
    sequences = sequences_of(arguments)
    arguments.out.mkdir(parents=True, exist_ok=True)
    rows, cues = [], list(arguments.without)

    def add(variant, sequence):
        row = ensure_row(variant, sequence, arguments)
        if row is not None:
            rows.append(row)
            write_tables(rows, arguments)
        return row or {}

    for sequence in sequences:
        for name in arguments.presets:
            row = add(variant_of(name, arguments), sequence)
            if arguments.ablate and name == "fused":  # which tells its cues
                cues = in_order(cues + list(row.get("cue_median_ms", {})))
        for cue in cues:
            add(without(cue, arguments), sequence)
    print(write_tables(rows, arguments))
    sys.exit(1 if any(row["error"] is not None for row in rows) else 0)


if __name__ == "__main__":
    main()
