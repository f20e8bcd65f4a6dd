# SPDX-License-Identifier: Apache-2.0
"""Repeats the experiments of the four papers and prints their tables.

  python3 -m lab reproduce crane
  python3 -m lab reproduce all --data tum --model yolo11n-seg.onnx --model seg-mask=yolov8n-seg.onnx --model box-flow=yolo11n.onnx
  python3 -m lab reproduce gated-seg --data tum --model yolov8n-seg.onnx --variant no-eq9=gated-seg:map.landmark_rules=[] \\
    --baseline ORB-SLAM3=trajectories

Every sequence is mapped with the baseline orb-rgbd, with fused, and with the preset of the paper, whose tables are printed
as soon as its runs are done; crane takes the presets of all papers. After an interrupt the same command goes on: a run is
not repeated unless the program, its network or its command line has changed. Exit code 3: the tables lack a run, or no
preset of a paper was run, since it detects nothing without a network and none was named.

Written to the output folder: PAPER.md, PAPER.tex, PAPER.json, summary.md of all systems, PAPER_trajectories/ with a page
and charts for each sequence, and a folder per run in runs/.
"""
import re
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from lab import core
from lab.paper_tables import BASELINE, OWN, PAPERS, crane_table, paper_tables, summary_tables, systems_of

CRANE, ALL = "crane", "all"
INCOMPLETE, INTERRUPTED = 3, 130  # exit codes
CUES_OF_DETECTORS = {"semantic", "gated-semantic", "box-flow", "epipolar", "epipolar-everywhere"}
OTHER_FINDINGS = {"floor-unknown", "zones-tilted", "events-lost"}  # say nothing about the trajectory
DRAWN_FRAME = 30  # index of the frame for which --maps draws the figures of the methods
# Names of folders, and the names of their sequences in the tables.
NAMES = {r"(?:rgbd_dataset_)?(?:(?:freiburg|fr)3_)?(?:walking|w)_(static|xyz|rpy|halfsphere|half)": r"walking_\1",
         r"(?:rgbd_dataset_)?(?:(?:freiburg|fr)3_)?(?:sitting|s)_(static|xyz|rpy|halfsphere|half)": r"sitting_\1",
         r"(?:rgbd_dataset_)?(?:freiburg|fr)1_rpy": "fr1_rpy", r"(?:rgbd_)?(bonn_.+)": r"\1", r"((?:kitchen|yard)_.+)": r"\1"}
TUM_SEQUENCES = [f"{people}_{motion}" for people in ("walking", "sitting") for motion in ("xyz", "halfsphere", "rpy", "static")]
TUM_PAGE = "https://cvg.cit.tum.de/data/datasets/rgbd-dataset/download"
YARDS = {"yard_static": ["--people", "0", "--objects", "0"], "yard_dynamic": ["--people", "3", "--objects", "3"],
         "yard_loaded": ["--people", "3", "--objects", "3", "--near-objects"]}
ROUND = ["--scene", "yard", "--camera", "trolley", "--camera-model", "realsense_d435i", "--fps", "15", "--frames", "526"]

# --------------------------------------------------------------------------------------------------- sequences


@dataclass(frozen=True)
class Sequence:
    """A recording with its name in the tables, and the words for its camera if its folder has no camera.yaml."""
    name: str
    folder: Path
    camera: tuple = ()


def benchmark_name(folder):
    """Returns the name of a sequence in a folder of this name; empty for an unknown one."""
    found = ((re.fullmatch(pattern, folder.lower()), name) for pattern, name in NAMES.items())
    return next((re.sub("_half$", "_halfsphere", match.expand(name)) for match, name in found if match), "")


def sequence_in(folder):
    name = benchmark_name(folder.name) or folder.name
    preset = "tum_fr3" if name in TUM_SEQUENCES else "tum_fr1" if name.startswith("fr1_") else ""
    return Sequence(name, folder, ("--camera", preset) if preset and not (folder / "camera.yaml").exists() else ())


def recordings_in(data):
    """Returns the recordings with images and ground truth in a folder, those of the papers first."""
    found = [sequence_in(truth.parent) for truth in data.glob("*/groundtruth.txt")
             if (truth.parent / "associations.txt").exists()
             or all((truth.parent / name).exists() for name in ("rgb.txt", "depth.txt"))]
    rank = {name: place for place, name in enumerate(TUM_SEQUENCES)}
    return sorted(found, key=lambda sequence: (rank.get(sequence.name, len(rank)), sequence.name, sequence.folder))


def find_sequences(data, names):
    """Returns the known sequences in a folder, or those of these names, known or not. Throws Failed for a missing one."""
    recordings = recordings_in(data)
    if not names:
        return [sequence for sequence in recordings if benchmark_name(sequence.folder.name)]
    by_name = {name: s for s in reversed(recordings) for name in (s.folder.name, s.name)}
    for name in names:
        if name not in by_name:
            raise core.Failed(f"{data}: there is no recording '{name}' with ground truth, but: {', '.join(by_name)}")
    return [by_name[name] for name in names]


def missing_sequences(papers, sequences):
    names = {sequence.name for sequence in sequences}
    return [name for name in core.in_order(name for paper in papers for name in paper["sequences"]) if name not in names]


def yards_of(arguments):
    """Returns the yards of the data folder, or renders them, unless an earlier start did so."""
    yards = [sequence for sequence in recordings_in(arguments.data or Path()) if sequence.name in YARDS]
    if len(yards) == len(YARDS):
        return yards
    rendered = arguments.out / f"sequences_{arguments.width}"
    rendered.mkdir(parents=True, exist_ok=True)
    for name, movers in YARDS.items():
        if not (rendered / name / "rgb.txt").exists():  # written last
            core.say(f"rendering {name} ...")
            core.call([arguments.program, "simulate", *ROUND, *movers, "--width", arguments.width, "--out", rendered / name],
                      rendered / f"{name}.log")
    return recordings_in(rendered)


# ----------------------------------------------------------------------------------------------------- columns


@dataclass(frozen=True)
class Column(core.Variant):
    """A preset or a variant, and whether it detects nothing without a network or masks."""
    needs_detector: bool = False


def named_values(texts, option, form, others):
    """Returns the values of NAME=VALUE by their names. Throws Failed for the name of another column."""
    values = {}
    for text in texts:
        name, _, value = text.partition("=")
        if not value or not re.fullmatch(r"[\w.-]+", name, re.ASCII):
            raise core.Failed(f"{option}: '{text}' is not of the form {form} (letters, digits and hyphens in NAME)")
        if name in others or name in values:
            raise core.Failed(f"{option}: there is another column '{name}': choose another name")
        values[name] = value
    return values


def networks_of(arguments):
    """Returns the networks by the names of presets and variants; that for all has an empty name. Throws Failed."""
    networks = dict(model.split("=", 1) if "=" in model else ("", model) for model in arguments.model)
    for file in networks.values():
        if not arguments.true_masks and not Path(file).is_file():
            raise core.Failed(f"there is no network {file}")
    return networks


def needs_detector(preset, settings, program):
    """Returns whether nothing is detected without a network or masks. Throws Failed for what `stillmap run` refuses."""
    command = [program, "run", "--preset", preset, *(word for s in settings for word in ("--set", s)), "--dump-config", "-"]
    shown = subprocess.run(command, capture_output=True, text=True, check=False)
    if shown.returncode != 0:
        raise core.Failed(shown.stderr.strip())
    cues = re.findall(r"[\w-]+", re.search(r"\n  cues: \[(.*)\]", shown.stdout)[1])
    return bool(cues) and CUES_OF_DETECTORS.issuperset(cues) and '\n  model: ""\n' in shown.stdout


def columns_of(presets, arguments):
    """Returns the columns of presets and of all variants. Throws Failed."""
    texts = {preset: preset for preset in presets}
    texts |= named_values(arguments.variant, "--variant", "NAME=PRESET[:OPTION=VALUE]...", core.PRESETS)
    networks, columns = networks_of(arguments), []
    for name, text in texts.items():
        preset, *settings = text.split(":")
        network = networks.get(name) or networks.get(preset) or networks.get("")
        columns.append(Column(name, preset, Path(network) if network else None, tuple(settings),
                              needs_detector(preset, settings, arguments.program)))
    known = {"", *(name for column in columns for name in (column.name, column.preset))}
    for name in networks.keys() - known:
        raise core.Failed(f"--model: '{name}' is no preset of this experiment, but: {', '.join(sorted(known - {''}))}")
    return columns


def true_masks(sequence, arguments):
    """Returns the folder of the masks that take the place of a network; None if there is none."""
    return sequence.folder / "mask" if arguments.true_masks and (sequence.folder / "mask").is_dir() else None


# -------------------------------------------------------------------------------------------------------- runs


def evaluated(sequence, trajectory, out, arguments, *words):
    """Returns the figures of a trajectory by `stillmap eval`, made in OUT unless they exist. Throws Failed."""
    file = out / "evaluation.json"
    if not core.read_json(file):
        core.call([arguments.program, "eval", sequence.folder / "groundtruth.txt", trajectory, "--per-frame", "--closure",
                   *words, "--json", file], out / "evaluation.log")
    return {key: figures for key, figures in core.read_json(file).items() if key not in ("stillmap", "findings")}


def figures_of(summary):
    """Returns the figures of a run that the tables need besides its errors."""
    tracking, waiting = (core.stage_of(summary, name).get("mean_ms", 0) for name in ("tracking", "waiting for network and map"))
    frames = summary["frames"]
    share = {} if frames["highly_dynamic"] is None else {"highly_dynamic": frames["highly_dynamic"] / frames["total"]}
    untrusted = [finding for finding in summary["findings"]
                 if finding["severity"] == "untrusted" and finding["code"] not in OTHER_FINDINGS]
    return {"tracking_ms": {"mean": tracking}, "total_ms": {"mean": 1000 / summary["frames_per_second"]},
            "with_detector_ms": {"mean": tracking + waiting},
            "machine": summary["machine"], "detector": summary["detector"], "findings": untrusted, **share}


def run_of(column, sequence, first, arguments):
    """Returns a run with its figures, or with the problem that it has; it is made unless an earlier start did so."""
    run = {"preset": column.name, "sequence": sequence.name, "first_frame": first}
    out, masks = arguments.out / "runs" / f"{sequence.name}_{column.name}_{first}", true_masks(sequence, arguments)
    words = ["--preset", column.preset, "--first", first, "--count", arguments.frames, *sequence.camera]
    words += ["--masks", masks] if masks else []
    words += ["--schedule", arguments.schedule] if arguments.schedule else []
    drawn = min(DRAWN_FRAME, arguments.frames - 1) if arguments.frames else DRAWN_FRAME
    words += ["--figures", drawn] if arguments.maps else []
    settings = [*column.settings, "movers.enabled=false", *([] if arguments.maps else ["dense.enabled=false"])]
    model = None if masks else column.model
    try:
        summary = core.ensure_run(f"{sequence.name}, {column.name}, from frame {first}", core.run_command(
            arguments.program, sequence.folder, out, words, model, settings), out, inputs=[model] if model else [])
        judged = arguments.maps and (out / "cloud.ply").exists() and (sequence.folder / "mask").is_dir()
        cloud = ["--cloud", out / "cloud.ply", "--sequence", sequence.folder, *sequence.camera] if judged else []
        errors = evaluated(sequence, out / "trajectory.txt", out, arguments, "--frames", summary["frames"]["total"], *cloud)
        return run | errors | figures_of(summary)
    except core.Failed as problem:
        return run | {"problem": str(problem)}


def trajectories_of(folder, sequence):
    """Returns the trajectories of a sequence in the folder of another system."""
    return sorted(file for file in Path(folder).glob("*.txt") if re.fullmatch(re.escape(sequence) + r"(_\d+)?", file.stem))


def foreign_runs(folders, sequences, arguments):
    """Returns the runs of other systems. Throws Failed for a folder without any, and for one that cannot be evaluated."""
    runs = []
    for name, folder in folders.items():
        files = {sequence: trajectories_of(folder, sequence.name) for sequence in sequences}
        missing = [sequence.name for sequence in sequences if not files[sequence]]
        if len(missing) == len(files):
            raise core.Failed(f"{folder} contains no trajectory of these sequences: name the files SEQUENCE.txt or SEQUENCE_1.txt, "
                              f"SEQUENCE_2.txt, ... with the sequences' names in the tables, such as {missing[0]}.txt")
        if missing:
            print(f"{name} has no trajectory of {', '.join(missing)} in {folder}: these cells and the means over them stay empty")
        for sequence, number, file in ((s, number, file) for s in sequences for number, file in enumerate(files[s])):
            out = arguments.out / "others" / f"{sequence.name}_{name}_{number}"
            out.mkdir(parents=True, exist_ok=True)
            (out / "evaluation.json").unlink(missing_ok=True)
            runs.append({"preset": name, "sequence": sequence.name, "first_frame": number, "file": str(file),
                         **evaluated(sequence, file, out, arguments)})
    return runs


class Experiment:
    """Which columns map which sequences, and their runs."""

    def __init__(self, presets, sequences, arguments):
        """Throws Failed for wrong columns and trajectories."""
        self.sequences, self.arguments, self.own_runs = sequences, arguments, []
        columns = columns_of(presets, arguments)
        self.columns = [column for column in columns if any(self.can_run(column, sequence) for sequence in sequences)]
        self.left_out = [column.name for column in columns if column not in self.columns]
        names = [column.name for column in columns]
        folders = named_values(arguments.baseline, "--baseline", "NAME=DIR", core.PRESETS + names)
        self.foreign = foreign_runs(folders, sequences, arguments)
        self.others = names[len(presets):] + list(folders)
        self.reference = next(iter(folders), BASELINE)  # of improvement rates

    def can_run(self, column, sequence):
        """Returns whether a column has what it needs on a sequence."""
        return not column.needs_detector or column.model or true_masks(sequence, self.arguments)

    @property
    def runs(self):
        return self.own_runs + self.foreign

    def run(self, names):
        """Maps the sequences with the columns of these names, `runs` times each: run n begins at frame n."""
        for sequence in self.sequences:
            for column in self.columns:
                if column.name in names and self.can_run(column, sequence):
                    for first in range(self.arguments.runs):
                        run = run_of(column, sequence, first, self.arguments)
                        shown = run.get("problem") or f"ATE RMSE {run['ate']['translation_m']['rmse']:.4f} m"
                        core.say(f"{sequence.name}, {column.name}, from frame {first}: {shown}")
                        self.own_runs.append(run)

    def problems(self):
        return [f"the tables lack {run['preset']} on {run['sequence']}, since the run from frame {run['first_frame']} failed: "
                f"{run['problem']}" for run in self.own_runs if "problem" in run]


# ----------------------------------------------------------------------------------------------------- results


def protocol_of(runs, arguments):
    """Returns sentences about the runs, for the heading of their tables."""
    def short(detector):
        return "masks of the sequences" if detector.startswith("masks from") else detector.split(" (")[0]
    detectors = core.in_order(f"{run['preset']}: {short(run['detector'])}" for run in runs if run.get("detector"))
    starts = f"Mean of {arguments.runs} runs, which begin at frames 0 to {arguments.runs - 1},"
    frames = f"the first {arguments.frames} frames of each" if arguments.frames else "all frames"
    return (f"{starts if arguments.runs > 1 else 'One run from frame 0'} per preset and sequence; {frames}. "
            f"{'Realtime' if arguments.schedule == 'realtime' else 'Lockstep'}, "
            f"{'with dense map, without movers' if arguments.maps else 'without dense map and movers'}. "
            f"{next((run['machine'] for run in runs if 'machine' in run), 'No run')}. "
            f"Detectors: {'; '.join(detectors) or 'none'}.")


def findings_of(runs):
    """Returns the reasons not to trust some of the runs, each behind the name of its run."""
    return [finding | {"message": f"{run['preset']} on {run['sequence']} from frame {run['first_frame']}: {finding['message']}"}
            for run in runs for finding in run.get("findings", [])]


def remarks_of(left_out, findings, missing):
    """Returns what a reader of the tables must know about presets, runs and sequences."""
    remarks = [f"Left out, since they detect moving objects with a network only and none was named (--model FILE.onnx, or --model "
               f"PRESET=FILE.onnx): {', '.join(left_out)}\n"] if left_out else []
    if findings:
        lines = [f"- {'; '.join(filter(None, (finding['message'], finding['fix'])))}\n" for finding in findings]
        remarks.append("Runs that should not be trusted:\n\n" + "".join(lines))
    if missing:
        remarks.append("Sequences of the papers that were not found, and where they come from:\n\n"
                       + "".join(f"- {name}: rgbd_dataset_freiburg3_{name}, {TUM_PAGE}\n" for name in missing))
    return "\n".join(remarks)


def marked(name, table):
    """Returns a table between the markers of `lab paper_docs`."""
    return f"\n<!-- table: {name} -->\n\n{table.markdown()}\n<!-- end of table -->\n"


def write_results(name, text, heading, tables, data, experiment):
    """Prints the tables of a paper, and writes them as Markdown, LaTeX and JSON."""
    out = experiment.arguments.out
    print(f"\n{text}", flush=True)
    core.write_tables(out, text, {"paper": name, **data, "tables": [table.as_json() for table in tables]}, name)
    latex = "".join(f"% {line}\n" for line in heading) + "".join(f"\n{table.latex()}" for table in tables)
    (out / f"{name}.tex").write_text(latex, encoding="utf-8")


def write_trajectories(name, systems, experiment):
    """Writes a page with the trajectories from the first frame for each sequence."""
    arguments = experiment.arguments
    for sequence in experiment.sequences:
        first = {run["preset"]: run.get("file", arguments.out / "runs" / f"{sequence.name}_{run['preset']}_0")
                 for run in experiment.runs if (run["sequence"], run["first_frame"]) == (sequence.name, 0) and "ate" in run}
        paths = [f"{system}={first[system]}" for system in systems if system in first]
        out = arguments.out / f"{name}_trajectories" / sequence.name
        out.mkdir(parents=True, exist_ok=True)
        if paths:
            core.call([arguments.program, "compare", "--truth", sequence.folder / "groundtruth.txt", *paths, "--out", out],
                      out / "compare.log")


def write_paper(paper, experiment):
    """Prints the tables of a paper and writes its files."""
    name, systems = paper["preset"], systems_of(paper, experiment.others)
    runs = [run for system in systems for run in experiment.runs if run["preset"] == system]
    missing, findings = missing_sequences([paper], experiment.sequences), findings_of(runs)
    heading = f"{name} ({paper['authors']} {paper['year']}): {paper['title']}"
    protocol = (f"{protocol_of(runs, experiment.arguments)} Improvement rates are over {experiment.reference}. "
                f"Published figures: {paper['source']}.")
    tables = paper_tables(paper, runs, experiment.others, experiment.reference)
    remarks = remarks_of(experiment.left_out, findings, missing)
    text = f"# {heading}\n\n{protocol}\n" + "".join(f"\n{table.markdown()}" for table in tables) + (remarks and f"\n{remarks}")
    data = {"title": paper["title"], "source": paper["source"], "protocol": protocol, "runs": runs, "findings": findings,
            "missing_sequences": missing, "presets_left_out": experiment.left_out}
    write_results(name, text, [heading, protocol], tables, data, experiment)
    write_trajectories(name, systems, experiment)


# ------------------------------------------------------------------------------------------------- experiments


def reproduce(papers, arguments):
    """Repeats the experiments of papers on the sequences of the data folder. Returns the problems of the runs."""
    if not arguments.data:
        raise core.Failed("the folder with the sequences is missing: add --data DIR")
    sequences = find_sequences(arguments.data, arguments.sequences)
    missing, presets = missing_sequences(papers, sequences), [paper["preset"] for paper in papers]
    if not sequences:
        raise core.Failed(f"{arguments.data} contains no sequence of the papers with ground truth: get those of the papers, or "
                          f"name other folders in it with --sequences.\n{remarks_of([], [], missing)}")
    experiment = Experiment([BASELINE, *presets, OWN], sequences, arguments)
    print(remarks_of(experiment.left_out, [], missing), flush=True)
    experiment.run([BASELINE, OWN, *experiment.others])
    for paper in papers:
        experiment.run([paper["preset"]])
        write_paper(paper, experiment)
    tables = summary_tables(experiment.runs, experiment.reference)
    summary = f"{protocol_of(experiment.runs, arguments)}\n" + "".join(marked(name, table) for name, table in tables.items())
    (arguments.out / "summary.md").write_text(summary, encoding="utf-8")
    none = [f"no preset of a paper was run: {remarks_of(experiment.left_out, [], [])}"]
    return experiment.problems() + (none if set(presets) <= set(experiment.left_out) else [])


def reproduce_crane(arguments):
    """Repeats the crane experiment of SLAM3-YOLOv8 (section 4.5) in the simulated yard, without and with moving objects.
    Returns the problems of the runs."""
    paper = PAPERS["seg-mask"]
    # Networks trained on COCO detect neither hooks nor the rendered vehicles.
    arguments.true_masks = arguments.true_masks or not arguments.model
    experiment = Experiment([BASELINE, *PAPERS, OWN], yards_of(arguments), arguments)
    experiment.run([column.name for column in experiment.columns])
    masks = "true masks of workers, hook and vehicles" if arguments.true_masks else "masks by a network"
    protocol = (f"{protocol_of(experiment.runs, arguments)} Simulated yard, camera realsense_d435i, {masks}. Improvement rates are "
                f"over {experiment.reference}.")
    tables = {CRANE: crane_table(paper, experiment.runs, experiment.reference),
              "ate": summary_tables(experiment.runs, experiment.reference)["ate"]}
    text = f"# crane: {paper['title']}\n\n{protocol}\n" + "".join(marked(name, table) for name, table in tables.items())
    write_results(CRANE, text, [protocol], tables.values(), {"source": paper["source"], "runs": experiment.runs}, experiment)
    write_trajectories(CRANE, systems_of(paper, ()), experiment)
    return experiment.problems()


def add_arguments(parser):
    add, several = parser.add_argument, {"action": "append", "default": []}
    add("paper", choices=[*PAPERS, CRANE, ALL], metavar="PAPER",
        help=f"{', '.join(PAPERS)}: preset of a paper; all: the four papers; crane: the crane of seg-mask's paper")
    add("--data", type=Path, metavar="DIR",
        help="folder with the sequences: TUM freiburg3 (rgbd_dataset_freiburg3_walking_xyz, fr3_w_xyz, walking_xyz, ...), fr1_rpy, "
        "bonn_*, kitchen_*, yard_*; crane renders its sequences if they are not there")
    add("--model", **several, metavar="[PRESET=]FILE", help="network (.onnx) for all presets, or for one; may be repeated")
    add("--true-masks", action="store_true", help="take the masks of SEQUENCE/mask, where there are any, instead of a network")
    add("--sequences", type=core.names, default=[], metavar="NAME,NAME",
        help="only these sequences; folders of other names must be named here")
    add("--runs", type=int, default=3, help="runs per preset and sequence; run n begins at frame n; default: %(default)s")
    add("--frames", type=int, default=0, help="use only the first frames; default: all")
    add("--variant", **several, metavar="NAME=PRESET[:OPTION=VALUE]...",
        help="additional column: a preset (name or file) with changed options; may be repeated")
    add("--baseline", **several, metavar="NAME=DIR",
        help="additional column: the trajectories of another system (TUM format) in DIR/SEQUENCE.txt or DIR/SEQUENCE_RUN.txt; "
        "improvement rates compare with the first one instead of orb-rgbd; may be repeated")
    add("--schedule", choices=["lockstep", "realtime"], help="default: lockstep")
    add("--maps", action="store_true",
        help="also write dense maps and the figures of the methods, and count ghosts in sequences with true masks")
    add("--width", type=int, default=640, help="crane: width of the rendered images; default: %(default)s")
    add("--out", type=Path, default=Path("reproduced"), help="output folder; default: %(default)s")
    add("--program", type=Path, default=core.PROGRAM, help="default: %(default)s")


def check_arguments(arguments):
    """Exits with a usage error if a program is missing or options contradict each other."""
    if not arguments.program.is_file():
        arguments.error(f"there is no {arguments.program}: build it, or name it with --program")
    if arguments.runs < 1 or arguments.frames < 0:
        arguments.error("--runs must be 1 or more, and --frames 0 or more")
    if arguments.paper == CRANE and (arguments.sequences or arguments.frames):
        arguments.error("the crane has its own sequences and needs the whole round: leave out --sequences and --frames")
    if arguments.baseline and arguments.frames:
        arguments.error("the trajectories of other systems cover whole sequences: leave out --frames or --baseline")


def main(arguments):
    check_arguments(arguments)
    for ended in (signal.SIGINT, signal.SIGTERM):
        signal.signal(ended, signal.default_int_handler)  # raises KeyboardInterrupt
    try:
        problems = (reproduce_crane(arguments) if arguments.paper == CRANE else
                    reproduce(list(PAPERS.values()) if arguments.paper == ALL else [PAPERS[arguments.paper]], arguments))
    except KeyboardInterrupt:
        print("interrupted; the same command goes on with the runs that are left")
        return INTERRUPTED
    if problems:
        print("lab reproduce: incomplete tables", *problems, sep="\n  ", file=sys.stderr)
    return INCOMPLETE if problems else 0
