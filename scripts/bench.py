#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures the speed of the complete system on sequences: medians over runs, with ranges.

  scripts/bench.py [SEQUENCE...] [--model NETWORK.onnx] [--runs 5]
  scripts/bench.py --compare build/bench/old.json                  old and new times, and their ratio
  scripts/bench.py --binary OLD/stillmap --binary NEW/stillmap     two alternating programs, and the ratio within each turn

A sequence is a folder in TUM layout. Without one, a simulated scene with walking people is rendered once.
`make bench ARGS="..."` builds first. Written to --out (build/bench): bench.md, which is also printed, and bench.json.

In each turn every program maps every sequence in several ways, one run at a time, in an order that changes with
each turn:
  everything              lockstep with all defaults, including dense map and movers
  no dense map, no movers tracking and sparse mapping only
  no network              only with --model; otherwise "everything" has none
  profiled                everything with --profile: CPU times and the cost of profiling

"Others' share" is the CPU share of other programs. If it is large, wall times are too long; ratios within one
turn and CPU times remain meaningful. Trajectories of all runs must be byte-identical; differences are reported.
"""
import argparse
import hashlib
import json
import os
import shutil
import statistics
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SCENE = ["--scene", "office", "--people", "3", "--camera", "xyz", "--frames", "300"]
BUSY = 0.1  # others' share of the machine from which times are doubtful
STAGES = ("features", "waiting for masks carried beside", "motion", "pose")  # of the time that tracking takes


class Failed(RuntimeError):
    """A program that failed."""


@dataclass(frozen=True)
class Arm:
    """A way to map a sequence."""
    name: str
    words: tuple = ()
    network: bool = True


EVERYTHING = Arm("everything")
SPARSE = Arm("no dense map, no movers", ("--set", "dense_cloud=false", "--set", "movers.enabled=false"))
NO_NETWORK = Arm("no network", network=False)
PROFILED = Arm("profiled", ("--profile",))


def arms_of(arguments):
    return [EVERYTHING, SPARSE] + ([NO_NETWORK] if arguments.model else []) + [PROFILED]


# ------------------------------------------------------------------------------------------------------- the machine


def processor_time():
    """Busy and total CPU time of all cores [s]; None if unknown."""
    try:
        ticks = [int(word) for word in Path("/proc/stat").read_text(encoding="ascii").split("\n")[0].split()[1:9]]
    except (OSError, ValueError):
        return None
    per_second = os.sysconf("SC_CLK_TCK")
    idle = ticks[3] + ticks[4]
    return (sum(ticks) - idle) / per_second, sum(ticks) / per_second


def call(command, log):
    """Runs a program, its output into a log.

    @return what other programs took of the machine meanwhile, 0 to 1; None where it is not known
    Throws Failed with the end of the log where the program fails."""
    before = processor_time()
    with log.open("w", encoding="utf-8") as to:
        process = subprocess.Popen([str(word) for word in command], stdout=to, stderr=subprocess.STDOUT)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    after = processor_time()
    if process.returncode != 0:
        end = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-3:]
        raise Failed(f"exit code {process.returncode}: {' / '.join(end)}")
    if before is None or after is None or after[1] <= before[1]:
        return None
    others = after[0] - before[0] - usage.ru_utime - usage.ru_stime
    return max(0.0, others / (after[1] - before[1]))


def machine():
    """Machine and time of the measurement."""
    commit = subprocess.run(["git", "-C", ROOT, "describe", "--always", "--dirty"], capture_output=True, text=True,
                            check=False).stdout.strip()
    return {"system": " ".join(os.uname()[i] for i in (0, 2, 4)), "cores": os.cpu_count(),
            "load_average_before": round(os.getloadavg()[0], 2), "commit": commit or None}


# ------------------------------------------------------------------------------------------------------------ a run


def leaf(tree, *path):
    """The number at the first matching path; keys match by their beginning, as units follow the names."""
    for name in path:
        tree = next((v for k, v in tree.items() if k.startswith(name)), {}) if isinstance(tree, dict) else {}
    return tree if isinstance(tree, (int, float)) else None


def stage_of(summary, name):
    return next((stage for stage in summary.get("timing_ms", []) if stage["name"] == name), {})


def slowest_of(summary):
    """Frame, milliseconds, and the stage that took longest beyond its own median."""
    slowest = summary.get("slowest_frame")
    if not slowest:
        return None
    beyond = {name: ms - stage_of(summary, name).get("median_ms", 0) for name, ms in slowest["stages_ms"].items()}
    return {"frame": slowest["frame"], "ms": slowest["ms"], "stage": max(beyond, key=beyond.get, default=None)}


def cpu_per_call(trace, name):
    """Median CPU time of a function's calls [ms]; None where there was none."""
    times = [event["tdur"] / 1000 for event in trace["traceEvents"] if event.get("ph") == "X" and event["name"] == name]
    return statistics.median(times) if times else None


def figures_of(out, others):
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    tracking = stage_of(summary, "tracking")
    figures = {
        "machine": summary.get("machine"), "others": others,
        "tracking_median_ms": tracking.get("median_ms"), "tracking_p95_ms": tracking.get("p95_ms"),
        "tracking_p99_ms": tracking.get("p99_ms"), "tracking_max_ms": tracking.get("max_ms"),
        "slowest": slowest_of(summary), "frames_per_second": summary.get("frames_per_second"),
        "memory_mib": summary.get("mapping_memory_mib", summary.get("peak_memory_mib")),
        "peak_memory_mib": summary.get("peak_memory_mib"), "first_pose_s": summary.get("first_pose_s"),
        "dense_keyframe_ms": stage_of(summary, "dense map: keyframe").get("median_ms"),
        "ate_rmse_m": leaf(summary.get("evaluation", {}), "ate", "translation", "rmse"),
        "tracked": leaf(summary, "frames", "tracked"), "frames": leaf(summary, "frames", "total"),
        "trajectory": hashlib.sha256((out / "trajectory.txt").read_bytes()).hexdigest()[:12],
    }
    for stage in STAGES:
        figures[f"{stage}_median_ms"] = stage_of(summary, stage).get("median_ms")
    if (out / "trace.json").exists():
        trace = json.loads((out / "trace.json").read_text(encoding="utf-8"))
        figures["dense_keyframe_cpu_ms"] = cpu_per_call(trace, "dense map: keyframe")
        figures["dense_other_cpu_ms"] = cpu_per_call(trace, "dense map: other frame")
    return figures


def run(program, arm, sequence, arguments):
    """Figures of one run, or {"error": why there are none}."""
    out = arguments.out / "run"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    command = [program, "run", sequence, "--out", out, *arm.words]
    command += ["--model", arguments.model] if arguments.model and arm.network else []
    for setting in arguments.set:
        command += ["--set", setting]
    try:
        return figures_of(out, call(command, arguments.out / "run.log"))
    except (Failed, OSError, ValueError) as problem:
        return {"error": str(problem)}


def measure_orb(arguments):
    """CPU time of feature extraction per image [ms]: ours and OpenCV's; None if the benchmark is not built."""
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
    """The simulator's scene, rendered if it is not there yet."""
    sequence = arguments.out / "office_walking"
    if not sequence.is_dir():
        partial = arguments.out / "office_walking.partial"
        shutil.rmtree(partial, ignore_errors=True)
        print("rendering a scene ...", file=sys.stderr, flush=True)
        call([arguments.binary[0], "simulate", *SCENE, "--out", partial], arguments.out / "render.log")
        partial.rename(sequence)
    return sequence


def measure(arguments):
    """All runs: by sequence, program and arm, a list with one entry a turn."""
    programs = names_of(arguments.binary)
    result = {sequence.name: {name: {arm.name: [] for arm in arms_of(arguments)} for name in programs}
              for sequence in arguments.sequences}
    for turn in range(arguments.runs):
        for sequence in arguments.sequences:
            jobs = [(arm, name) for arm in arms_of(arguments) for name in programs]
            for arm, name in jobs if turn % 2 == 0 else reversed(jobs):
                print(f"turn {turn + 1} of {arguments.runs}: {sequence.name}, {name}, {arm.name} ...", file=sys.stderr,
                      flush=True)
                result[sequence.name][name][arm.name].append(run(programs[name], arm, sequence, arguments))
    return result


def names_of(binaries):
    """The programs by the names that the table has for them: A, B ... where there are several."""
    if len(binaries) == 1:
        return {"stillmap": binaries[0]}
    return {chr(ord("A") + i): binary for i, binary in enumerate(binaries)}


# ----------------------------------------------------------------------------------------------------------- tables

# What is shown: heading, arm, key, digits, target. "no network" falls back to "everything" where there is no network.
ROWS = [
    ("tracking, median [ms]", "everything", "tracking_median_ms", 2, "<= 10"),
    ("tracking, p95 [ms]", "everything", "tracking_p95_ms", 2, ""),
    ("tracking, p99 [ms]", "everything", "tracking_p99_ms", 2, ""),
    ("tracking, max [ms]", "everything", "tracking_max_ms", 1, ""),
    ("of the median: features [ms]", "everything", "features_median_ms", 2, ""),
    ("of the median: waiting for masks [ms]", "everything", "waiting for masks carried beside_median_ms", 2, ""),
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


def cell(values, digits):
    """The median, and the range where there is one."""
    if not values:
        return "-"
    median, low, high = (f"{value:.{digits}f}" for value in (statistics.median(values), min(values), max(values)))
    return median if low == high else f"{median} ({low}-{high})"


def ratio(after, before):
    """Ratio within the same turns if both have all turns; otherwise of the medians."""
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


def markdown(head, rows):
    lines = [head, ["---"] * len(head)] + rows
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def sequence_table(programs, old):
    """A line a figure, a column a program; with two, or with an older result, their ratio."""
    head = ["", *programs, *(["B / A"] if len(programs) == 2 else []), *(["before", "now / before"] if old else []),
            "target"]
    rows = []
    for heading, arm, key, digits, target in ROWS:
        of_program = [values_of(arms, arm, key) for arms in programs.values()]
        if not any(of_program) or (arm == "no network" and not all("no network" in a for a in programs.values())
                                   and key in ("tracking_median_ms", "tracking_p95_ms", "tracking_max_ms",
                                               "frames_per_second", "ate_rmse_m")):
            continue  # or it would say the same as "everything"
        line = [heading, *(cell(values, digits) for values in of_program)]
        line += [ratio(of_program[1], of_program[0])] if len(programs) == 2 else []
        if old:
            before = values_of(next(iter(old.values())), arm, key)
            line += [cell(before, digits), median_ratio(of_program[0], before)]
        rows.append(line + [target])
    return markdown(head, rows)


def slowest_text(runs):
    """Where the slowest frames were: always the same one, or now here, now there."""
    slowest = [run["slowest"] for run in runs if run.get("slowest")]
    return ", ".join(f"{s['frame']} ({s['ms']:.1f} ms: {s['stage']})" for s in slowest) or "-"


def overview_table(sequences):
    """Tracking by sequence."""
    rows = []
    for sequence, programs in sequences.items():
        for name, arms in programs.items():
            runs = runs_of(arms, "everything")
            coverage = {f"{run['tracked']}/{run['frames']}" for run in runs if run.get("frames")}
            rows.append([sequence, name, *(cell(values_of(arms, "everything", f"tracking_{key}_ms"), digits)
                                           for key, digits in (("median", 2), ("p95", 2), ("max", 1))),
                         slowest_text(runs), cell(values_of(arms, "everything", "ate_rmse_m"), 4),
                         ", ".join(sorted(coverage)) or "-"])
    return markdown(["sequence", "program", "median [ms]", "p95 [ms]", "max [ms]", "slowest frame of each run",
                     "ATE RMSE [m]", "tracked"], rows)


def orb_text(orb):
    if not orb:
        return "ORB extraction: not measured (the benchmark is not built)\n"
    ours, theirs = orb["stillmap_ms"], orb["opencv_ms"]
    return (f"ORB extraction, 640x480, 1000 keypoints, 8 levels, CPU of one core: {cell(ours, 2)} ms (target <= 4); "
            f"cv::ORB {cell(theirs, 2)} ms; ratio {median_ratio(ours, theirs)}\n")


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
    """Trajectories depend on the data and the options alone; and the dense map, the movers and a profile change none."""
    lines = []
    for sequence, programs in result["sequences"].items():
        for network, arms in ((True, ("everything", "no dense map, no movers", "profiled")), (False, ("no network",))):
            hashes = {}
            for name, runs in ((n, run) for n, of in programs.items() for arm in arms for run in of.get(arm, [])):
                if runs.get("trajectory"):
                    hashes.setdefault(runs["trajectory"], set()).add(name)
            if len(hashes) > 1:
                told = "; ".join(f"{key} by {', '.join(sorted(names))}" for key, names in hashes.items())
                lines.append(f"- {sequence}{'' if network else ', no network'}: trajectories differ: {told}")
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


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", type=Path, nargs="*", metavar="SEQUENCE", help="folders in TUM layout")
    parser.add_argument("--model", type=Path, help="network (.onnx); default: by geometry alone")
    parser.add_argument("--runs", type=int, default=5, help="turns; default: %(default)s")
    parser.add_argument("--out", type=Path, default=ROOT / "build/bench", help="default: %(default)s")
    parser.add_argument("--binary", type=Path, action="append", help="program to measure; may be repeated")
    parser.add_argument("--compare", type=Path, metavar="OLD.json", help="older bench.json for comparison")
    parser.add_argument("--set", action="append", default=[], metavar="ROOM.OPTION=VALUE", help="for every run")
    parser.add_argument("--orb-benchmark", type=Path, help="default: modules/feature/stillmap_feature_benchmark in the folder of")
    arguments = parser.parse_args()
    arguments.binary = arguments.binary or [ROOT / "build/release/stillmap"]
    if arguments.orb_benchmark is None:
        arguments.orb_benchmark = arguments.binary[-1].resolve().parent / "modules/feature/stillmap_feature_benchmark"
    for needed in [*arguments.binary, *filter(None, [arguments.model, arguments.compare])]:
        if not needed.is_file():
            parser.error(f"there is no {needed}")
    for sequence in arguments.sequences:
        if not sequence.is_dir():
            parser.error(f"there is no folder {sequence}")
    if arguments.runs < 1:
        parser.error("--runs must be 1 or more")
    return arguments


def main():
    arguments = parse()
    old = json.loads(arguments.compare.read_text(encoding="utf-8")) if arguments.compare else None
    arguments.out.mkdir(parents=True, exist_ok=True)
    arguments.sequences = [path.resolve() for path in arguments.sequences]
    try:
        arguments.sequences = arguments.sequences or [rendered_sequence(arguments)]
    except Failed as problem:
        sys.exit(f"the scene could not be rendered: {problem}")
    result = {"machine": machine(), "runs": arguments.runs, "model": arguments.model.name if arguments.model else None,
              "programs": {name: str(path) for name, path in names_of(arguments.binary).items()},
              "orb": measure_orb(arguments), "sequences": measure(arguments)}
    text = text_of(result, old)
    (arguments.out / "bench.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    (arguments.out / "bench.md").write_text(text, encoding="utf-8")
    print(text)
    sys.exit(1 if failures(result) or differing(result) else 0)


if __name__ == "__main__":
    main()
