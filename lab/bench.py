# SPDX-License-Identifier: Apache-2.0
"""Speed of the whole system on sequences: every figure is a median over runs, with its range.

  python3 -m lab bench [SEQUENCE...] [--model NETWORK.onnx] [--runs 5]
  python3 -m lab bench --compare build/bench/old.json                  an older result and this one, with their ratio
  python3 -m lab bench --binary OLD/stillmap --binary NEW/stillmap     two programs in turn, with the ratio per turn

A sequence is a folder in TUM layout. Without one, a simulated scene with walking people is rendered once.
`make bench ARGS="..."` builds first. The results are written to --out (build/bench): bench.md, which is also printed,
and bench.json.

In each turn every program maps every sequence in several ways, one run after the other, in an order that changes from
turn to turn:
  everything              lockstep, all defaults, including dense map and movers
  no dense map, no movers only the camera's poses and the sparse map
  no network              like "everything" without the network; only if --model is given
  profiled                everything, with --profile: CPU times, and the cost of the profile

The share of other programs is the part of the machine that they used meanwhile. If it is large, times are too long;
ratios within one turn and CPU times remain meaningful. The trajectories of all runs must be the same bytes; runs
that differ are listed.
"""
import json
import os
import shutil
import statistics
import subprocess
from dataclasses import dataclass
from pathlib import Path

from lab import core
from lab.core import Failed, markdown, stage_of

SCENE = ["--scene", "office", "--people", "3", "--camera", "xyz", "--frames", "300"]
BUSY = 0.1  # share of other programs above which times are unreliable
STAGES = {"features": "features", "waiting": "waiting for", "motion": "motion", "pose": "pose"}  # of tracking


@dataclass(frozen=True)
class Arm:
    """A way to map a sequence."""
    name: str
    words: tuple = ()
    network: bool = True


EVERYTHING = Arm("everything")
SPARSE = Arm("no dense map, no movers", ("--set", "dense.enabled=false", "--set", "movers.enabled=false"))
NO_NETWORK = Arm("no network", network=False)
PROFILED = Arm("profiled", ("--profile",))


def arms_of(arguments):
    return [EVERYTHING, SPARSE] + ([NO_NETWORK] if arguments.model else []) + [PROFILED]


def machine():
    """Returns the machine, commit and time of the measurement, as far as the system provides them."""
    commit = subprocess.run(["git", "-C", core.ROOT, "describe", "--always", "--dirty"], capture_output=True, text=True,
                            check=False).stdout.strip()
    return {"system": " ".join(os.uname()[i] for i in (0, 2, 4)), "cores": os.cpu_count(),
            "load_average_before": round(os.getloadavg()[0], 2), "commit": commit or None}


# ------------------------------------------------------------------------------------------------------------ a run


def slowest_of(summary):
    """Returns the slowest frame, its time [ms], and the stage that exceeded its own median most."""
    slowest = summary.get("slowest_frame")
    if not slowest:
        return None
    beyond = {name: ms - stage_of(summary, name).get("median_ms", 0) for name, ms in slowest["stages_ms"].items()}
    return {"frame": slowest["frame"], "ms": slowest["ms"], "stage": max(beyond, key=beyond.get, default=None)}


def cpu_per_call(trace, name):
    """Returns the median CPU time of a function's calls [ms]; None without calls."""
    times = [event["tdur"] / 1000 for event in trace["traceEvents"] if event.get("ph") == "X" and event["name"] == name]
    return statistics.median(times) if times else None


def timing_figures(out, others):
    """Figures of one run that the tables show."""
    summary = core.read_json(out / "summary.json")
    of_run, tracking = core.figures_of(summary), stage_of(summary, "tracking")
    figures = {name: of_run[name] for name in ("frames_per_second", "peak_memory_mib", "ate_rmse_m", "tracked",
                                               "frames")}
    figures.update({f"tracking_{name}_ms": tracking.get(f"{name}_ms") for name in ("median", "p95", "p99", "max")})
    figures.update({
        "machine": summary.get("machine"), "others": others, "slowest": slowest_of(summary),
        "memory_mib": summary.get("mapping_memory_mib", of_run["peak_memory_mib"]),
        "first_pose_s": summary.get("first_pose_s"),
        "trajectory": core.sha256_of(out / "trajectory.txt")[:12],
    })
    for name, stage in STAGES.items():
        figures[f"{name}_median_ms"] = stage_of(summary, stage).get("median_ms")
    if (out / "trace.json").exists():
        trace = core.read_json(out / "trace.json")
        figures["dense_keyframe_cpu_ms"] = cpu_per_call(trace, "dense map: keyframe")
        figures["dense_other_cpu_ms"] = cpu_per_call(trace, "dense map: other frame")
    return figures


def run(program, arm, sequence, arguments):
    """Returns the figures of one run, or {"error": reason}."""
    out = arguments.out / "run"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    command = core.run_command(program, sequence, out, arm.words, arguments.model if arm.network else None,
                               arguments.set)
    try:
        return timing_figures(out, core.call(command, arguments.out / "run.log"))
    except (Failed, OSError, ValueError) as problem:
        return {"error": str(problem)}


def measure_orb(arguments):
    """Returns the CPU times for an image's features [ms], ours and OpenCV's; None if the benchmark is not built."""
    if not arguments.orb_benchmark.is_file():
        return None
    command = [arguments.orb_benchmark, "--benchmark_filter=run_extractor/stillmap_best|run_opencv_orb",
               f"--benchmark_repetitions={arguments.runs}", "--benchmark_enable_random_interleaving=true",
               "--benchmark_format=json"]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return None
    times = {"run_extractor/stillmap_best": [], "run_opencv_orb": []}
    for result in json.loads(done.stdout)["benchmarks"]:
        if result.get("run_type") == "iteration":
            times[result["run_name"]].append(result["cpu_time"])
    ours, theirs = times.values()
    return {"stillmap_ms": ours, "opencv_ms": theirs}


def rendered_sequence(arguments):
    """Returns the folder of the simulated scene, which is rendered if it does not exist."""
    sequence = arguments.out / "office_walking"
    if not sequence.is_dir():
        partial = arguments.out / "office_walking.partial"
        shutil.rmtree(partial, ignore_errors=True)
        core.say("rendering a scene ...")
        core.call([arguments.binary[0], "simulate", *SCENE, "--out", partial], arguments.out / "render.log")
        partial.rename(sequence)
    return sequence


def measure(arguments):
    """Makes all runs; returns by sequence, program and arm a list with one entry per turn."""
    programs = names_of(arguments.binary)
    result = {sequence.name: {name: {arm.name: [] for arm in arms_of(arguments)} for name in programs}
              for sequence in arguments.sequences}
    for turn in range(arguments.runs):
        for sequence in arguments.sequences:
            jobs = [(arm, name) for arm in arms_of(arguments) for name in programs]
            for arm, name in jobs if turn % 2 == 0 else reversed(jobs):
                core.say(f"turn {turn + 1} of {arguments.runs}: {sequence.name}, {name}, {arm.name} ...")
                result[sequence.name][name][arm.name].append(run(programs[name], arm, sequence, arguments))
    return result


def names_of(binaries):
    """Returns the programs by their names in the table: A, B ... if there are several."""
    if len(binaries) == 1:
        return {"stillmap": binaries[0]}
    return {chr(ord("A") + i): binary for i, binary in enumerate(binaries)}


# ----------------------------------------------------------------------------------------------------------- tables

# The rows: heading, arm, key, digits, target. "no network" falls back to "everything" if there is no network.
ROWS = [
    ("tracking, median [ms]", "everything", "tracking_median_ms", 2, "<= 10"),
    ("tracking, p95 [ms]", "everything", "tracking_p95_ms", 2, ""),
    ("tracking, p99 [ms]", "everything", "tracking_p99_ms", 2, ""),
    ("tracking, max [ms]", "everything", "tracking_max_ms", 1, ""),
    ("of the median: features [ms]", "everything", "features_median_ms", 2, ""),
    ("of the median: waiting for masks [ms]", "everything", "waiting_median_ms", 2, ""),
    ("of the median: motion [ms]", "everything", "motion_median_ms", 2, ""),
    ("of the median: pose [ms]", "everything", "pose_median_ms", 2, ""),
    ("tracking, median, no network [ms]", "no network", "tracking_median_ms", 2, "<= 10"),
    ("tracking, p95, no network [ms]", "no network", "tracking_p95_ms", 2, ""),
    ("tracking, max, no network [ms]", "no network", "tracking_max_ms", 1, ""),
    ("frames/s, everything", "everything", "frames_per_second", 1, ">= 30"),
    ("frames/s, no dense map, no movers", "no dense map, no movers", "frames_per_second", 1, ">= 30"),
    ("frames/s, everything, no network", "no network", "frames_per_second", 1, ""),
    ("dense map, a keyframe folded in, CPU [ms]", "profiled", "dense_keyframe_cpu_ms", 1, "<= 30"),
    ("dense map, another frame, CPU [ms]", "profiled", "dense_other_cpu_ms", 1, ""),
    ("start-up to first pose, no network [s]", "no network", "first_pose_s", 3, "<= 0.3"),
    ("memory at most, no network [MiB]", "no network", "memory_mib", 0, "<= 400"),
    ("memory at most [MiB]", "everything", "memory_mib", 0, ""),
    ("memory at most, making the files too [MiB]", "everything", "peak_memory_mib", 0, ""),
    ("tracking, median, profiled [ms]", "profiled", "tracking_median_ms", 2, ""),
    ("ATE RMSE [m]", "everything", "ate_rmse_m", 4, ""),
    ("ATE RMSE, no network [m]", "no network", "ate_rmse_m", 4, ""),
]


def runs_of(arms, arm):
    return arms.get(arm) or (arms.get("everything", []) if arm == "no network" else [])


def values_of(arms, arm, key):
    return [run[key] for run in runs_of(arms, arm) if run.get(key) is not None]


def range_cell(values, digits):
    """Returns the median, with the range if there are several values."""
    if not values:
        return "-"
    median, low, high = (f"{value:.{digits}f}" for value in (statistics.median(values), min(values), max(values)))
    return median if low == high else f"{median} ({low}-{high})"


def ratio(after, before):
    """Returns the median ratio within a turn if both have all turns; else the ratio of the medians."""
    if not after or not before:
        return "-"
    if len(after) == len(before):
        pairs = [a / b for a, b in zip(after, before) if b]
        return f"{statistics.median(pairs):.3f}" if pairs else "-"
    return median_ratio(after, before)


def median_ratio(after, before):
    if not after or not before or not statistics.median(before):
        return "-"
    return f"{statistics.median(after) / statistics.median(before):.3f}"


def sequence_table(programs, old):
    """Returns a table with a row per figure and a column per program; the ratio of two programs or results is added."""
    head = ["", *programs, *(["B / A"] if len(programs) == 2 else []), *(["before", "now / before"] if old else []),
            "target"]
    rows = []
    for heading, arm, key, digits, target in ROWS:
        of_program = [values_of(arms, arm, key) for arms in programs.values()]
        if not any(of_program) or (arm == "no network" and not all("no network" in a for a in programs.values())
                                   and key in ("tracking_median_ms", "tracking_p95_ms", "tracking_max_ms",
                                               "frames_per_second", "ate_rmse_m")):
            continue  # it would repeat "everything"
        line = [heading, *(range_cell(values, digits) for values in of_program)]
        line += [ratio(of_program[1], of_program[0])] if len(programs) == 2 else []
        if old:
            before = values_of(next(iter(old.values())), arm, key)
            line += [range_cell(before, digits), median_ratio(of_program[0], before)]
        rows.append(line + [target])
    return markdown(head, rows)


def slowest_text(runs):
    """Returns the slowest frame of each run, which shows whether it is always the same one."""
    slowest = [run["slowest"] for run in runs if run.get("slowest")]
    return ", ".join(f"{s['frame']} ({s['ms']:.1f} ms: {s['stage']})" for s in slowest) or "-"


def overview_table(sequences):
    """Returns the table of the tracking times by sequence."""
    rows = []
    for sequence, programs in sequences.items():
        for name, arms in programs.items():
            runs = runs_of(arms, "everything")
            coverage = {f"{run['tracked']}/{run['frames']}" for run in runs if run.get("frames")}
            rows.append([sequence, name, *(range_cell(values_of(arms, "everything", f"tracking_{key}_ms"), digits)
                                           for key, digits in (("median", 2), ("p95", 2), ("max", 1))),
                         slowest_text(runs), range_cell(values_of(arms, "everything", "ate_rmse_m"), 4),
                         ", ".join(sorted(coverage)) or "-"])
    return markdown(["sequence", "program", "median [ms]", "p95 [ms]", "max [ms]", "slowest frame of each run",
                     "ATE RMSE [m]", "tracked"], rows)


def orb_text(orb):
    if not orb:
        return "ORB extraction: not measured (the benchmark is not built)\n"
    ours, theirs = orb["stillmap_ms"], orb["opencv_ms"]
    return (f"ORB extraction, 640x480, 1000 keypoints, 8 levels, CPU of one core: {range_cell(ours, 2)} ms (target <= 4); "
            f"cv::ORB {range_cell(theirs, 2)} ms; ratio {median_ratio(ours, theirs)}\n")


def all_runs(result):
    return [(sequence, name, arm, run) for sequence, programs in result["sequences"].items()
            for name, arms in programs.items() for arm, runs in arms.items() for run in runs]


def machine_text(result):
    where, runs = result["machine"], [run for *_, run in all_runs(result)]
    name = next((run["machine"] for run in runs if run.get("machine")), "unknown machine")
    text = (f"{name}, {where['system']}; load average before {where['load_average_before']}; "
            f"{result['runs']} run{'s' if result['runs'] != 1 else ''} of each, median (range)")
    others = [run["others"] for run in runs if run.get("others") is not None]
    if others:
        text += (f"; other programs took {100 * statistics.median(others):.0f} % of the machine "
                 f"({100 * min(others):.0f}-{100 * max(others):.0f})")
        if statistics.median(others) > BUSY:
            text += ".\n\n**The machine was busy: wall times are longer than they would be on a quiet one**"
    return text + ".\n"


def differing(result):
    """Returns lines that name the sequences whose trajectories differ between runs, which must not happen."""
    lines = []
    for sequence, programs in result["sequences"].items():
        for network, arms in ((True, ("everything", "no dense map, no movers", "profiled")), (False, ("no network",))):
            hashes = {}
            for name, runs in ((n, run) for n, of in programs.items() for arm in arms for run in of.get(arm, [])):
                if runs.get("trajectory"):
                    hashes.setdefault(runs["trajectory"], set()).add(name)
            if len(hashes) > 1:
                groups = "; ".join(f"{key} by {', '.join(sorted(names))}" for key, names in hashes.items())
                lines.append(f"- {sequence}{'' if network else ', no network'}: trajectories differ: {groups}")
    return lines


def failures(result):
    return [f"- {sequence}, {name}, {arm}: {run['error']}" for sequence, name, arm, run in all_runs(result)
            if run.get("error")]


def text_of(result, old):
    parts = ["# Benchmark\n", machine_text(result)]
    if len(result["programs"]) > 1:
        parts.append("\n".join(f"- {name}: {program}" for name, program in result["programs"].items()) + "\n")
    parts.append(orb_text(result["orb"]))
    parts.append("## Tracking by sequence\n\n" + overview_table(result["sequences"]))
    for sequence, programs in result["sequences"].items():
        network = f", {result['model']}" if result["model"] else ", no network"
        parts.append(f"## {sequence}{network}\n\n"
                     + sequence_table(programs, old.get("sequences", {}).get(sequence) if old else None))
    if differing(result):
        parts.append("## Not the same\n\n" + "\n".join(differing(result)) + "\n")
    if failures(result):
        parts.append("## Failed\n\n" + "\n".join(failures(result)) + "\n")
    return "\n".join(parts)


# ------------------------------------------------------------------------------------------------------------ main


def add_arguments(parser):
    parser.add_argument("sequences", type=Path, nargs="*", metavar="SEQUENCE", help="folders in TUM layout")
    parser.add_argument("--model", type=Path, help="network (.onnx); default: geometry alone")
    parser.add_argument("--runs", type=int, default=5, help="turns; default: %(default)s")
    parser.add_argument("--out", type=Path, default=core.ROOT / "build/bench", help="default: %(default)s")
    parser.add_argument("--binary", type=Path, action="append", help="program to measure; may be repeated")
    parser.add_argument("--compare", type=Path, metavar="OLD.json", help="an older bench.json to show with it")
    parser.add_argument("--set", action="append", default=[], metavar="OPTION=VALUE", help="option of every run")
    parser.add_argument("--orb-benchmark", type=Path,
                        help="default: modules/feature/stillmap_feature_benchmark next to the program")


def check(arguments):
    """Fills in defaults; exits with a usage error if a file is missing."""
    arguments.binary = arguments.binary or [core.PROGRAM]
    if arguments.orb_benchmark is None:
        arguments.orb_benchmark = arguments.binary[-1].resolve().parent / "modules/feature/stillmap_feature_benchmark"
    for needed in [*arguments.binary, *filter(None, [arguments.model, arguments.compare])]:
        if not needed.is_file():
            arguments.error(f"there is no {needed}")
    for sequence in arguments.sequences:
        if not sequence.is_dir():
            arguments.error(f"there is no folder {sequence}")
    if arguments.runs < 1:
        arguments.error("--runs must be 1 or more")


def main(arguments):
    check(arguments)
    old = core.read_json(arguments.compare) if arguments.compare else None
    arguments.out.mkdir(parents=True, exist_ok=True)
    arguments.sequences = [path.resolve() for path in arguments.sequences] or [rendered_sequence(arguments)]
    result = {"machine": machine(), "runs": arguments.runs, "model": arguments.model.name if arguments.model else None,
              "programs": {name: str(path) for name, path in names_of(arguments.binary).items()},
              "orb": measure_orb(arguments), "sequences": measure(arguments)}
    text = text_of(result, old)
    core.write_tables(arguments.out, text, result, "bench")
    print(text)
    return 1 if failures(result) or differing(result) else 0
