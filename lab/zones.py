# SPDX-License-Identifier: Apache-2.0
"""Recall, precision and latency of warnings on simulated scenes with exact truth.

  python3 -m lab zones --out RESULTS_DIR [--frames 600] [--program build/release/stillmap]

Scenes (an office with walking people, a yard below a crane) are rendered and mapped with `stillmap run --zones`, with
the rendered masks and without any. The true warnings are those of `stillmap warn` on the true poses and movers, with
the same rules. Only true warnings of movers that are in view when they begin count: at least 600 pixels show them. A true
warning is found if a warning of the same kind and rule begins at most two seconds before its begin and before its end, or
is active then; a warning is right if it overlaps with a true one of the same kind and rule, within half a second.

Written to RESULTS_DIR: zones.md (printed at the end), zones.json, and a folder per run.
"""
import csv
import json
import math
import shutil
import statistics
import subprocess
from pathlib import Path

from lab import core

SCENES = {
    "office": ["--scene", "office", "--people", "3", "--camera", "xyz"],
    "office, camera walks": ["--scene", "office", "--people", "3", "--camera", "halfsphere"],
    "yard": ["--scene", "yard", "--people", "3", "--camera", "trolley"],
}
BEFORE, SLACK = 2.0, 0.5  # [s]
MIN_PIXELS = 600
FAR = 1e9


def add_arguments(parser):
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--program", type=Path, default=core.ROOT / "build/release/stillmap")
    parser.add_argument("--frames", type=int, default=600, help="frames per scene; default: %(default)s")


def rotated(q, v):
    """Rotates a vector by a quaternion x, y, z, w."""
    x, y, z, w = times(times(q, [*v, 0]), inverse(q))
    return [x, y, z]


def inverse(q):
    return [-q[0], -q[1], -q[2], q[3]]


def times(a, b):
    """Product of two quaternions x, y, z, w."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]


def read_poses(sequence):
    """The true poses: lists of time, x, y, z and a quaternion."""
    lines = (sequence / "groundtruth.txt").read_text().splitlines()
    return [[float(word) for word in line.split()] for line in lines if line and line[0] != "#"]


def read_movers(sequence):
    with open(sequence / "truth_movers.csv", encoding="utf-8") as file:
        return list(csv.DictReader(file))


class FirstCamera:
    """The frame of the first camera, which is the world of a run."""

    def __init__(self, sequence):
        first = read_poses(sequence)[0]
        self.origin, self.turn = first[1:4], inverse(first[4:])

    def direction(self, v):
        return rotated(self.turn, v)

    def point(self, p):
        return self.direction([a - b for a, b in zip(p, self.origin)])


def write_truth(sequence, folder):
    """Writes a folder like that of a run, with the true poses and movers in the frame of the first camera. Returns the
    number of pixels per time and id."""
    folder.mkdir(parents=True, exist_ok=True)
    camera = FirstCamera(sequence)
    lines = [[pose[0], *camera.point(pose[1:4]), *times(camera.turn, pose[4:])] for pose in read_poses(sequence)]
    (folder / "trajectory.txt").write_text("".join(" ".join(f"{v:.9f}" for v in line) + "\n" for line in lines))
    pixels, rows = {}, ["timestamp,id,class,state,x,y,z,vx,vy,vz,min_x,min_y,min_z,max_x,max_y,max_z"]
    for row in read_movers(sequence):
        ends = [[float(row[f"{end}_{axis}"]) for axis in "xyz"] for end in ("min", "max")]
        corners = [camera.point([ends[i >> k & 1][k] for k in range(3)]) for i in range(8)]
        values = [*camera.point([float(row[axis]) for axis in "xyz"]), *camera.direction([float(row["v" + axis]) for axis in "xyz"]),
                  *map(min, zip(*corners)), *map(max, zip(*corners))]
        rows.append(",".join([row["timestamp"], row["id"], row["class"], "moving", *(f"{v:.5f}" for v in values)]))
        pixels[round(float(row["timestamp"]), 4), int(row["id"])] = int(row["pixels"])
    (folder / "movers.csv").write_text("\n".join(rows) + "\n")
    return pixels


def write_rules(file, sequence):
    """Zones where people walk, and distances from the camera and from a point ahead of it."""
    camera = FirstCamera(sequence)
    seen = [row for row in read_movers(sequence) if row["name"] == "person" and int(row["pixels"]) >= 2 * MIN_PIXELS]
    zones = []
    for k, share in enumerate((0.3, 0.7)):
        x, y = (sorted(float(row[axis]) for row in seen)[int(share * len(seen))] for axis in "xy")
        corners = [[x + dx, y + dy, 0] for dx, dy in ((-.8, -.8), (.8, -.8), (.8, .8), (-.8, .8))]
        zones.append({"name": f"zone {k + 1}", "polygon": [camera.point(corner) for corner in corners], "height": [0, 2.2]})
    rules = {"up": camera.direction([0, 0, 1]), "zones": zones, "points": [{"name": "hook", "offset": [0, 0, 3]}],
             "distances": [{"to": "camera", "nearer": 2.5, "within": 1.5}, {"to": "hook", "nearer": 1.0, "level": True}]}
    file.write_text(json.dumps(rules, indent=1))  # YAML includes JSON


def intervals(file):
    """Warnings of an events.jsonl: kind, rule, mover, begin, end, first event."""
    open_ones, done = {}, []
    for line in file.read_text().splitlines():
        event = json.loads(line)
        key = event["kind"], event["rule"], event.get("mover", 0)
        if event["event"] == "begin":
            open_ones[key] = event
        elif key in open_ones:
            done.append((*key, open_ones[key]["timestamp"], event["timestamp"], open_ones.pop(key)))
    return done + [(*key, event["timestamp"], FAR, event) for key, event in open_ones.items()]


def judged(truth, found, pixels, fps):
    """Recall, precision and latency."""
    def similar(a, b):  # a course becomes a distance: both announce the same
        return a[1] == b[1] and (a[0] == b[0] or {a[0], b[0]} == {"near", "course"})
    true = [w for w in truth if pixels.get((round(w[3], 4), w[2]), 0) >= MIN_PIXELS and w[4] - w[3] > 0.55]
    latencies, distances = [], {}
    for warning in true:
        # A course may be over before the mover is near: its begin counts if it is shortly before.
        hits = [f for f in found if similar(warning, f) and f[3] <= warning[4] and
                (f[4] >= warning[3] or f[3] >= warning[3] - BEFORE)]
        if hits:
            latencies.append(max(0.0, min(f[3] for f in hits) - warning[3]) * fps)
        depth = math.dist(warning[5]["position"], warning[5]["camera"][:3])
        label = "< 2 m" if depth < 2 else "2 to 4 m" if depth < 4 else "> 4 m"
        distances.setdefault(label, []).append(bool(hits))
    mine = [f for f in found if f[0] != "unknown"]
    right = [f for f in mine if any(similar(w, f) and f[3] <= w[4] + SLACK and f[4] >= w[3] - SLACK for w in truth)]
    return {"true": len(true), "found": len(latencies), "warnings": len(mine), "right": len(right),
            "recall": len(latencies) / len(true) if true else None, "precision": len(right) / len(mine) if mine else None,
            "latency_median_frames": statistics.median(latencies) if latencies else None,
            "latency_p90_frames": sorted(latencies)[int(0.9 * len(latencies))] if latencies else None,
            "recall_by_distance": {k: [sum(v), len(v)] for k, v in sorted(distances.items())}}


def call(*words):
    result = subprocess.run([str(w) for w in words], capture_output=True, text=True, check=False)
    if result.returncode not in (0, 3):
        raise core.Failed(result.stderr.strip())


def main(arguments):
    arguments.out.mkdir(parents=True, exist_ok=True)
    rows = []
    for scene, words in SCENES.items():
        folder = arguments.out / scene.replace(", ", "_").replace(" ", "_")
        sequence = folder / "sequence"
        if not (sequence / "groundtruth.txt").exists():
            call(arguments.program, "simulate", *words, "--frames", arguments.frames, "--out", sequence)
        pixels = write_truth(sequence, folder / "truth")
        rules = folder / "rules.yaml"
        write_rules(rules, sequence)
        call(arguments.program, "warn", folder / "truth", "--zones", rules, "--force")
        truth = intervals(folder / "truth/events.jsonl")
        for name, masks in (("masks", ["--masks", sequence / "mask"]), ("no network", [])):
            out = folder / name.replace(" ", "_")
            shutil.rmtree(out, ignore_errors=True)
            call(arguments.program, "run", sequence, *masks, "--zones", rules, "--out", out)
            rows.append({"scene": scene, "segmentation": name, **judged(truth, intervals(out / "events.jsonl"), pixels, 30)})
    lines = [[row["scene"], row["segmentation"], f"{row['found']}/{row['true']}", core.cell(row["recall"], 2),
              f"{row['right']}/{row['warnings']}", core.cell(row["precision"], 2), core.cell(row["latency_median_frames"], 0),
              core.cell(row["latency_p90_frames"], 0), ", ".join(f"{k}: {a}/{b}" for k, (a, b) in row["recall_by_distance"].items())]
             for row in rows]
    text = core.markdown(["scene", "segmentation", "found", "recall", "right", "precision", "latency, median [frames]",
                          "90 % [frames]", "found by distance"], lines, "Warnings against the truth")
    (arguments.out / "zones.md").write_text(text)
    (arguments.out / "zones.json").write_text(json.dumps(rows, indent=1))
    print(text)
    return 0
