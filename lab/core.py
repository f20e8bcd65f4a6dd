# SPDX-License-Identifier: Apache-2.0
"""Runs stillmap, reads summary.json, and makes tables: the core that all subcommands share."""
import hashlib
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "build/release/stillmap"
LAB_PROGRAM = ROOT / "build/release/stillmap_lab"
PRESETS = ["orb-rgbd", "static", "seg-mask", "box-flow", "gated-seg", "box-epipolar", "fused", "fused-no-network"]
BOX_PRESETS = {"box-flow", "box-epipolar"}  # their papers use boxes, not masks
NO_NETWORK = "-no-network"
UNTRUSTED = 3  # exit code of a run whose result should not be trusted


class Failed(RuntimeError):
    """A program failed, or its input is missing."""


# ----------------------------------------------------------------------------------------------------- programs


def processor_time():
    """Returns busy and total time of all cores since system start [s]; None if the system does not provide them."""
    try:
        ticks = [int(word) for word in Path("/proc/stat").read_text(encoding="ascii").split("\n")[0].split()[1:9]]
    except (OSError, ValueError):
        return None
    per_second = os.sysconf("SC_CLK_TCK")
    idle = ticks[3] + ticks[4]
    return (sum(ticks) - idle) / per_second, sum(ticks) / per_second


def call(command, log):
    """Runs a program and writes its output to a log.

    @return share of the machine that other programs used meanwhile [0..1]; None where it is not known
    Throws Failed with the end of the log if the program fails. A run whose result should not be trusted has not failed."""
    before = processor_time()
    with log.open("w", encoding="utf-8") as to:
        process = subprocess.Popen([str(word) for word in command], stdout=to, stderr=subprocess.STDOUT)
        try:
            _, status, usage = os.wait4(process.pid, 0)
        except KeyboardInterrupt:
            process.terminate()
            process.wait()
            raise
        process.returncode = os.waitstatus_to_exitcode(status)
    after = processor_time()
    if process.returncode not in (0, UNTRUSTED):
        end = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-3:]
        raise Failed(f"exit code {process.returncode}: {' / '.join(end)}")
    if before is None or after is None or after[1] <= before[1]:
        return None
    others = after[0] - before[0] - usage.ru_utime - usage.ru_stime
    return max(0.0, others / (after[1] - before[1]))


def say(text):
    """Prints progress to standard error, so that tables can be piped."""
    print(text, file=sys.stderr, flush=True)


def sha256_of(file):
    return hashlib.sha256(file.read_bytes()).hexdigest()


# -------------------------------------------------------------------------------------------------------- runs


def run_command(program, sequence, out, words=(), model=None, settings=()):
    """Returns the command line of one run."""
    command = [program, "run", sequence, "--out", out, *words, *(["--model", model] if model else [])]
    for setting in settings:
        command += ["--set", setting]
    return [str(word) for word in command]


def ensure_run(name, command, out, again=False, optional=(), outputs=(), inputs=()):
    """Runs the program, unless the same program already made these results with the same command line.

    @param optional  words that only add output: results made without them count if `outputs` are there
    @param inputs    files of the command line, such as networks: results count if these have not changed
    @return summary.json. Throws Failed."""
    made_by = {"command": [word for word in command if word not in optional], "program": sha256_of(Path(command[0]))}
    if inputs:
        made_by["inputs"] = [sha256_of(file) for file in inputs]
    made = read_json(out / "run.json") == made_by and all((out / file).exists() for file in outputs)
    if not made or again or not read_json(out / "summary.json"):
        out.mkdir(parents=True, exist_ok=True)
        for stale in ("run.json", "summary.json", "labels.json", "still.json", "ghosts.json", "evaluation.json", "error.txt"):
            (out / stale).unlink(missing_ok=True)
        say(f"{name} ...")
        call(command, out / "run.log")
        (out / "run.json").write_text(json.dumps(made_by, indent=1), encoding="utf-8")
    summary = read_json(out / "summary.json")
    if not summary:
        raise Failed(f"{name}: there is no summary.json")
    return summary


@dataclass(frozen=True)
class Variant:
    """Preset with its network, its options, and its name in tables."""
    name: str
    preset: str
    model: Path | None = None
    settings: tuple = ()


def variant_of(name, arguments):
    """Returns the variant of a preset's name. It has no network if the name says so, or if none was named; its own name
    then says so, too."""
    preset = name.removesuffix(NO_NETWORK)
    if preset in ("orb-rgbd", "static"):
        return Variant(preset, preset)
    model = arguments.box_model if preset in BOX_PRESETS and arguments.box_model else arguments.model
    if preset != name or model is None:
        return Variant(preset + NO_NETWORK, preset)
    return Variant(name, preset, model)


def variants_of(arguments):
    """Returns the variants of all named presets, each once."""
    return in_order(variant_of(name, arguments) for name in arguments.presets)


def sequences_of(arguments):
    """Returns the sequences (folders with groundtruth.txt) in a folder by name. Throws Failed if there are none."""
    sequences = sorted(p.parent for p in arguments.sequences.glob("*/groundtruth.txt")
                       if not arguments.only or p.parent.name in arguments.only)
    missing = set(arguments.only) - {sequence.name for sequence in sequences}
    if missing or not sequences:
        raise Failed(f"no sequence {', '.join(sorted(missing))} (a folder with groundtruth.txt) in {arguments.sequences}")
    return sequences


def names(text):
    return [name for name in text.split(",") if name]


def add_run_arguments(parser, presets):
    """Adds the arguments of all subcommands that run presets on a folder of sequences."""
    parser.add_argument("sequences", type=Path, help="folder of sequences in TUM layout, with groundtruth.txt")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument("--model", type=Path, help="network with masks (.onnx); without it all presets run without a network")
    parser.add_argument("--box-model", type=Path, help="network with boxes, for box-flow and box-epipolar")
    parser.add_argument("--presets", type=names, default=presets,
                        help=f"NAME{NO_NETWORK} is preset NAME without the network; default: " + ",".join(presets))
    parser.add_argument("--only", type=names, default=[], help="only sequences of these names")
    parser.add_argument("--set", action="append", default=[], metavar="OPTION=VALUE", help="option of every run")
    parser.add_argument("--again", action="store_true", help="repeat runs that were made already")
    parser.add_argument("--program", type=Path, default=PROGRAM, help="default: %(default)s")


def check_run_arguments(arguments):
    """Exits with a usage error if a program or a network is missing."""
    for network in (arguments.model, arguments.box_model):
        if network is not None and not network.exists():
            arguments.error(f"there is no network {network}: name another one, or none")
    if not arguments.program.is_file():
        arguments.error(f"there is no {arguments.program}: build it, or name it with --program")


# ----------------------------------------------------------------------------------------------------- results


def read_json(file):
    """Returns the content of a JSON file; {} if it is missing or invalid."""
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def leaf(tree, *path):
    """Returns the number at the first matching path; keys match by their beginning, since units follow the names."""
    for name in path:
        tree = next((v for k, v in tree.items() if k.startswith(name)), {}) if isinstance(tree, dict) else {}
    return tree if isinstance(tree, (int, float)) else None


def stage_of(summary, name):
    """Returns the timing of the first stage whose name has this prefix; {} if there is none."""
    return next((stage for stage in summary.get("timing_ms", []) if stage["name"].startswith(name)), {})


def figures_of(summary):
    """Returns the figures of a run that the tables show."""
    evaluation = summary.get("evaluation", {})
    return {
        "ate_rmse_m": leaf(evaluation, "ate", "translation", "rmse"),
        "ate_sd_m": leaf(evaluation, "ate", "translation", "sd"),
        "rpe_1s_m": leaf(evaluation, "rpe", "translation", "rmse"),
        "rpe_1s_deg": leaf(evaluation, "rpe", "rotation", "rmse"),
        "tracked": leaf(summary, "frames", "tracked"), "frames": leaf(summary, "frames", "total"),
        "tracking_median_ms": stage_of(summary, "tracking").get("median_ms", leaf(summary, "tracking_median_ms")),
        "motion_median_ms": next((stage["median_ms"] for stage in summary.get("timing_ms", [])
                                  if stage["name"] == "motion"), None),
        "cue_median_ms": {stage["name"].removeprefix("motion: "): stage["median_ms"]
                          for stage in summary.get("timing_ms", []) if stage["name"].startswith("motion: ")},
        "frames_per_second": leaf(summary, "frames_per_second"), "peak_memory_mib": leaf(summary, "peak_memory_mib"),
        "repeated_erased": leaf(summary, "refinement", "repeated_erased"),
        "maps": leaf(summary, "maps"), "keyframes": leaf(summary, "keyframes"), "landmarks": leaf(summary, "landmarks"),
        "loops": len(summary.get("loops", [])),
    }


def read_trajectory(file):
    """Returns the rows of a file in TUM format: timestamp [s], position [m], quaternion x y z w."""
    rows = (line.replace(",", " ").split() for line in file.read_text(encoding="utf-8").splitlines())
    return [[float(word) for word in row] for row in rows if row and not row[0].startswith("#")]


# ------------------------------------------------------------------------------------------------------ tables


def in_order(values):
    """Returns each value once, in order of first appearance."""
    return list(dict.fromkeys(values))


def cell(value, digits):
    return "-" if value is None else f"{value:.{digits}f}"


def coverage(row):
    """Returns the number of tracked frames and of all frames as text."""
    return "-" if row["frames"] is None else f"{row['tracked']}/{row['frames']}"


def markdown(head, rows, title=""):
    lines = [head, ["---"] * len(head)] + rows
    table = "\n".join("| " + " | ".join(str(word) for word in line) + " |" for line in lines) + "\n"
    return f"{title}\n\n{table}" if title else table


def write_tables(out, text, data, name="table"):
    """Writes a table as Markdown and its data as JSON."""
    out.mkdir(parents=True, exist_ok=True)
    (out / f"{name}.md").write_text(text, encoding="utf-8")
    (out / f"{name}.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
