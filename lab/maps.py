# SPDX-License-Identifier: Apache-2.0
"""Saves maps of sequences, localizes the camera of other sequences in them, and tabulates errors and file sizes.

  python3 -m lab maps SEQUENCES_DIR MAPPED:LOCALIZED[,LOCALIZED...] ... --out RESULTS_DIR --model yolov8n-seg.onnx

MAPPED and LOCALIZED are names of sequences below SEQUENCES_DIR in TUM layout; the groundtruth.txt of a pair must be of
one world. For each LOCALIZED:

  coverage     frames with a pose of all frames, the first frame that has one, frames lost after that, and frames
               that were tracked by visual odometry outside of the map
  aligned      ATE RMSE, the trajectory aligned with its truth as usual
  in the map   the same aligned as the mapping run's trajectory is aligned with its own truth
  same run     where a sequence is localized in its own map: distance to the poses of the mapping run

and for each map the size of its file with and without the dense views (`stillmap map slim`), and the seconds to write
and (least of all runs) read it. --extend also runs every LOCALIZED extending the map.

Runs that exist are not repeated. Written to RESULTS_DIR: table.md, printed at the end, and a folder per run.
"""
from pathlib import Path

from lab import core

LOCALIZED = ["mapped", "localized", "coverage", "first pose at frame", "lost after", "by odometry",
             "ATE aligned [m]", "in the map's world [m]", "from the mapping run's poses [m]"]
FILES = ["mapped", "frames", "keyframes", "landmarks", "MB", "MB per 1000 frames", "slim MB",
         "slim MB per 1000 frames", "written in [s]", "read in [s]"]


class Measurement:
    def __init__(self, arguments):
        self.arguments = arguments
        self.out = arguments.out
        self.out.mkdir(parents=True, exist_ok=True)
        self.load_seconds = {}

    def run(self, name, sequence, *more):
        """Returns the folder of a run and its summary."""
        words = ["--preset", self.arguments.preset, *more]
        command = core.run_command(self.arguments.program, self.arguments.sequences / sequence, self.out / name, words,
                                   self.arguments.model)
        return self.out / name, core.ensure_run(name, command, self.out / name)

    def rmse_and_max(self, name, *words):
        file = self.out / f"{name}.json"
        core.call([self.arguments.program, "eval", *words, "--json", file], self.out / f"{name}.log")
        error = core.read_json(file)["ate"]["translation_m"]
        return error["rmse"], error["max"]

    def map_of(self, sequence):
        file = self.out / f"{sequence}.map"
        out, summary = self.run(f"{sequence}_mapped", sequence, "--save-map", file)
        return file, out, summary

    def truth(self, sequence):
        return self.arguments.sequences / sequence / "groundtruth.txt"

    def first_pose(self, sequence, poses):
        """Returns the index of the first frame with a pose."""
        first = core.read_trajectory(poses)[0][0]
        images = (self.arguments.sequences / sequence / "rgb.txt").read_text(encoding="utf-8").splitlines()
        stamps = [float(line.split()[0]) for line in images if line and not line.startswith("#")]
        return next(i for i, stamp in enumerate(stamps) if abs(stamp - first) < 1e-4)

    def localized(self, mapped, sequence, extend):
        """Returns a line of the table of localized runs."""
        file, first, _ = self.map_of(mapped)
        name = f"{sequence}_{'extending' if extend else 'in'}_{mapped}"
        out, summary = self.run(name, sequence, "--load-map", file, *([] if extend else ["--localize-only"]))
        self.load_seconds.setdefault(mapped, []).append(summary["loaded_map"]["seconds"])
        poses, frames = out / "trajectory.txt", summary["frames"]
        placed = self.rmse_and_max(f"{name}_placed", self.truth(sequence), poses, "--aligned-like",
                                   self.truth(mapped), first / "trajectory.txt")
        same = "-"
        if sequence == mapped:
            moved = self.rmse_and_max(f"{name}_same", first / "trajectory.txt", poses, "--one-world")
            same = f"{moved[0]:.4f} (at most {moved[1]:.4f})"
        begun = self.first_pose(sequence, poses)
        return [mapped, sequence + (", extending" if extend else ""), f"{frames['tracked']}/{frames['total']}", begun,
                frames["total"] - begun - frames["tracked"], frames["tracked_by_odometry"],
                core.cell(core.figures_of(summary)["ate_rmse_m"], 4), f"{placed[0]:.4f} (at most {placed[1]:.4f})",
                same]

    def file_line(self, mapped):
        """Returns a line of the table of files."""
        file, _, summary = self.map_of(mapped)
        shown, slim = self.out / f"{mapped}_info.json", self.out / f"{mapped}_slim.map"
        core.call([self.arguments.program, "map", "info", file, "--json", shown], self.out / f"{mapped}_info.log")
        core.call([self.arguments.program, "map", "slim", file, "--out", slim], self.out / f"{mapped}_slim.log")
        info, frames = core.read_json(shown), summary["frames"]["total"]
        size, slim_size = info["bytes"] / 1e6, slim.stat().st_size / 1e6
        return [mapped, frames, info["keyframes"], info["landmarks"], f"{size:.2f}", f"{1000 * size / frames:.1f}",
                f"{slim_size:.2f}", f"{1000 * slim_size / frames:.1f}", f"{summary['saved_map']['seconds']:.2f}",
                f"{min(self.load_seconds[mapped]):.2f}"]


def add_arguments(parser):
    parser.add_argument("sequences", type=Path, help="folder of sequences")
    parser.add_argument("pairs", nargs="+", metavar="MAPPED:LOCALIZED,...")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument("--model", type=Path, help="network (.onnx)")
    parser.add_argument("--preset", default="fused", help="default: %(default)s")
    parser.add_argument("--extend", action="store_true", help="also extend the map by every localized sequence")
    parser.add_argument("--program", type=Path, default=core.PROGRAM, help="default: %(default)s")


def main(arguments):
    measurement = Measurement(arguments)
    pairs = [(pair.split(":")[0], name) for pair in arguments.pairs for name in pair.split(":")[1].split(",")]
    lines = [measurement.localized(mapped, name, extend) for mapped, name in pairs
             for extend in ([False, True] if arguments.extend else [False])]
    files = [measurement.file_line(mapped) for mapped in core.in_order(mapped for mapped, _ in pairs)]
    text = core.markdown(LOCALIZED, lines, "Localized") + "\n" + core.markdown(FILES, files, "Files")
    core.write_tables(arguments.out, text, {"localized": [dict(zip(LOCALIZED, line)) for line in lines],
                                            "files": [dict(zip(FILES, line)) for line in files]})
    print(text)
    return 0
