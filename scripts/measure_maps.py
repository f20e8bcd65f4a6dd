#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps sequences, saves the maps, localizes the cameras of other sequences in them, and prints tables of the results.

  scripts/measure_maps.py SEQUENCES_DIR --out RESULTS_DIR --model yolov8n-seg.onnx MAPPED:LOCALIZED[,LOCALIZED...] ...

MAPPED and LOCALIZED are names of sequences below SEQUENCES_DIR in TUM layout; paired sequences must have ground
truth in a common world frame. For each LOCALIZED:

  coverage     share of frames with a pose, the first such frame, later frames without one, and frames
               tracked by visual odometry
  aligned      ATE RMSE, with the trajectory aligned to its truth as usual
  in the map   ATE RMSE with the alignment of the mapping run to its own truth
  same run     for a sequence localized in its own map: distance to the poses of the mapping run

and for each map the size of its file with and without the dense views (`stillmap map slim`), and the time to
write and (minimum of all runs) read it [s]. --extend also runs every LOCALIZED extending the map.

Existing results are not computed again. Written to RESULTS_DIR: table.md, printed at the end, and a folder for each run.
"""
import argparse
import json
import subprocess
import sys
from pathlib import Path

LOCALIZED = ["mapped", "localized", "coverage", "first pose at frame", "lost after", "beside the map",
             "ATE aligned [m]", "in the map's world [m]", "from the mapping run's poses [m]"]
FILES = ["mapped", "frames", "keyframes", "landmarks", "MB", "MB per 1000 frames", "slim MB",
         "slim MB per 1000 frames", "written in [s]", "read in [s]"]
ROOT = Path(__file__).resolve().parent.parent


def call(command, log):
    with log.open("w", encoding="utf-8") as to:
        code = subprocess.run([str(word) for word in command], stdout=to, stderr=subprocess.STDOUT,
                              check=False).returncode
    if code != 0:
        sys.exit(f"exit code {code}; see {log}: {' '.join(map(str, command))}")


class Measurement:
    def __init__(self, arguments):
        self.arguments = arguments
        self.out = arguments.out
        self.out.mkdir(parents=True, exist_ok=True)
        self.load_seconds = {}

    def run(self, name, sequence, *more):
        """The folder of a run, and its summary."""
        out = self.out / name
        command = [self.arguments.program, "run", self.arguments.sequences / sequence, "--out", out,
                   "--preset", self.arguments.preset, *more]
        command += ["--model", self.arguments.model] if self.arguments.model else []
        if not (out / "summary.json").exists():
            print(f"{name} ...", file=sys.stderr, flush=True)
            call(command, self.out / f"{name}.log")
        return out, json.loads((out / "summary.json").read_text(encoding="utf-8"))

    def rmse_and_max(self, name, *words):
        file = self.out / f"{name}.json"
        call([self.arguments.program, "eval", *words, "--json", file], self.out / f"{name}.log")
        error = json.loads(file.read_text(encoding="utf-8"))["ate"]["translation_m"]
        return error["rmse"], error["max"]

    def map_of(self, sequence):
        file = self.out / f"{sequence}.map"
        out, summary = self.run(f"{sequence}_mapped", sequence, "--save-map", file)
        return file, out, summary

    def truth(self, sequence):
        return self.arguments.sequences / sequence / "groundtruth.txt"

    def localized(self, mapped, sequence, extend):
        """A line of the table of localized runs."""
        file, first, _ = self.map_of(mapped)
        name = f"{sequence}_{'extending' if extend else 'in'}_{mapped}"
        out, summary = self.run(name, sequence, "--load-map", file, *([] if extend else ["--localize-only"]))
        self.load_seconds.setdefault(mapped, []).append(summary["loaded_map"]["seconds"])
        poses = out / "trajectory.txt"
        aligned = summary["evaluation"]["ate"]["translation_m"]["rmse"]
        placed = self.rmse_and_max(f"{name}_placed", self.truth(sequence), poses, "--aligned-like",
                                   self.truth(mapped), first / "trajectory.txt")
        same = "-"
        if sequence == mapped:
            moved = self.rmse_and_max(f"{name}_same", first / "trajectory.txt", poses, "--one-world")
            same = f"{moved[0]:.4f} (at most {moved[1]:.4f})"
        frames = summary["frames"]
        stamps = [line.split()[0] for line in (self.arguments.sequences / sequence / "rgb.txt").read_text().splitlines()
                  if line and not line.startswith("#")]
        tracked = [line.split()[0] for line in poses.read_text().splitlines() if line and not line.startswith("#")]
        begun = next(i for i, stamp in enumerate(stamps) if abs(float(stamp) - float(tracked[0])) < 1e-4)
        return [mapped, sequence + (", extending" if extend else ""), f"{frames['tracked']}/{frames['total']}",
                str(begun), str(frames["total"] - begun - frames["tracked"]), str(frames["beside_map"]),
                f"{aligned:.4f}",
                f"{placed[0]:.4f} (at most {placed[1]:.4f})", same]

    def file_line(self, mapped):
        """A line of the table of files."""
        file, _, summary = self.map_of(mapped)
        shown, slim = self.out / f"{mapped}_info.json", self.out / f"{mapped}_slim.map"
        call([self.arguments.program, "map", "info", file, "--json", shown], self.out / f"{mapped}_info.log")
        call([self.arguments.program, "map", "slim", file, "--out", slim], self.out / f"{mapped}_slim.log")
        info, frames = json.loads(shown.read_text(encoding="utf-8")), summary["frames"]["total"]
        size, slim_size = info["bytes"] / 1e6, slim.stat().st_size / 1e6
        return [mapped, str(frames), str(info["keyframes"]), str(info["landmarks"]), f"{size:.2f}",
                f"{1000 * size / frames:.1f}", f"{slim_size:.2f}", f"{1000 * slim_size / frames:.1f}",
                f"{summary['saved_map']['seconds']:.2f}", f"{min(self.load_seconds[mapped]):.2f}"]


def markdown(title, head, lines):
    return f"{title}\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in [head, ["---"] * len(head)] + lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", type=Path, help="folder of sequences")
    parser.add_argument("pairs", nargs="+", metavar="MAPPED:LOCALIZED,...")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument("--model", type=Path, help="network")
    parser.add_argument("--preset", default="fused")
    parser.add_argument("--extend", action="store_true", help="also extend the map by every localized sequence")
    parser.add_argument("--program", type=Path, default=ROOT / "build/release/stillmap", help="default: %(default)s")
    arguments = parser.parse_args()
    measurement = Measurement(arguments)
    pairs = [(pair.split(":")[0], name) for pair in arguments.pairs for name in pair.split(":")[1].split(",")]
    lines = [measurement.localized(mapped, name, extend) for mapped, name in pairs
             for extend in ([False, True] if arguments.extend else [False])]
    files = [measurement.file_line(mapped) for mapped in dict.fromkeys(mapped for mapped, _ in pairs)]
    text = markdown("Localized", LOCALIZED, lines) + "\n\n" + markdown("Files", FILES, files) + "\n"
    (arguments.out / "table.md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
