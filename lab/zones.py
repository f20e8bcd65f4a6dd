# SPDX-License-Identifier: Apache-2.0
"""Recall, precision and latency of warnings on simulated scenes with exact truth.

  python3 -m lab zones --out RESULTS_DIR [--model NETWORK.onnx] [--seeds 3] [--frames 300] [--scenes NAME ...]

Scenes (an office with walking people and three motions of the camera, a yard below a crane) are rendered and mapped with
`stillmap run --zones`: with the rendered masks, with a network, and without any. The true warnings are those of `stillmap warn` on
the true poses and movers, with the same rules. Only true warnings of movers that are in view when they begin count: at
least 600 pixels show them. A true warning is found if a warning of the same kind and rule begins at most two seconds
before its begin and before its end, or is active then; a warning is right if it overlaps with a true one of the same kind
and rule, within half a second, and if a true mover is within 0.7 m of its position, along the floor, when it begins. A warning without a
true mover there is a ghost. Results that the same program has made are kept.

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
    "office_turning": ["--scene", "office", "--people", "3", "--camera", "halfsphere"],
    "office_walking": ["--scene", "office", "--people", "3", "--camera", "loop"],
    "yard": ["--scene", "yard", "--people", "3", "--camera", "trolley"],
}
FPS = 30
BEFORE, SLACK = 2.0, 0.5  # [s]
REACH = 0.7  # [m], farther from all true movers there is none: two radii of a person and the error of a centroid
MIN_PIXELS = 600
FAR = 1e9
GAPS = ("unknown", "unseen")  # kinds of events about what is not known
RANGES = ((2, "below 2 m"), (4, "2 to 4 m"), (8, "4 to 8 m"), (FAR, "beyond 8 m"))


def add_arguments(parser):
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--program", type=Path, default=core.ROOT / "build/release/stillmap")
    parser.add_argument("--model", type=Path, help="network (.onnx); default: no runs with a network")
    parser.add_argument("--frames", type=int, default=300, help="frames per sequence; default: %(default)s")
    parser.add_argument("--seeds", type=int, default=3, help="sequences per scene; default: %(default)s")
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES), help="default: all")


def rotated(q, v):
    """Rotates a vector by a quaternion x, y, z, w."""
    return times(times(q, [*v, 0]), inverse(q))[:3]


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
    up = camera.direction([0, 0, 1])
    for row in read_movers(sequence):
        low, high = ([float(row[f"{end}_{axis}"]) for axis in "xyz"] for end in ("min", "max"))
        # The box around the upright cylinder of the true box.
        height, radius = high[2] - low[2], (high[0] - low[0] + high[1] - low[1]) / 4
        half = [height / 2 * abs(u) + radius * math.sqrt(max(0, 1 - u * u)) for u in up]
        center = camera.point([(a + b) / 2 for a, b in zip(low, high)])
        values = [*camera.point([float(row[axis]) for axis in "xyz"]), *camera.direction([float(row["v" + axis]) for axis in "xyz"]),
                  *(c - h for c, h in zip(center, half)), *(c + h for c, h in zip(center, half))]
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


class TruePositions:
    """The true positions of all movers by time, in the world of the run."""

    def __init__(self, folder, up):
        self.up, self.centers = up, {}
        with open(folder / "movers.csv", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                self.centers.setdefault(round(float(row["timestamp"]), 4), []).append([float(row[axis]) for axis in "xyz"])

    def has(self, event):
        """Whether a true mover is where the mover of an event is, along the floor: of many people only a part is in view."""
        def apart(center):
            v = [a - b for a, b in zip(event["position"], center)]
            height = sum(a * b for a, b in zip(v, self.up))
            return math.hypot(*(a - height * b for a, b in zip(v, self.up)))
        return any(apart(center) <= REACH for center in self.centers.get(round(event["timestamp"], 4), []))


def judged(truth, found, pixels, positions):
    """Latency of each true warning that was found, whether it was found by its distance, and the warnings.

    positions: the true ones."""
    def similar(a, b):  # a course becomes a distance: both announce the same
        return a[1] == b[1] and (a[0] == b[0] or {a[0], b[0]} == {"near", "course"})
    true = [w for w in truth if pixels.get((round(w[3], 4), w[2]), 0) >= MIN_PIXELS and w[4] - w[3] > 0.55]
    latencies, distances = [], {}
    for warning in true:
        # A course may be over before the mover is near: its begin counts if it is shortly before.
        hits = [f for f in found if similar(warning, f) and f[3] <= warning[4] and
                (f[4] >= warning[3] or f[3] >= warning[3] - BEFORE)]
        if hits:
            latencies.append(max(0.0, min(f[3] for f in hits) - warning[3]) * FPS)
        depth = math.dist(warning[5]["position"], warning[5]["camera"][:3])
        label = next(name for limit, name in RANGES if depth < limit)
        distances.setdefault(label, []).append(bool(hits))
    mine = [f for f in found if f[0] not in GAPS]
    timely = [f for f in mine if any(similar(w, f) and f[3] <= w[4] + SLACK and f[4] >= w[3] - SLACK for w in truth)]
    right = [f for f in timely if positions.has(f[5])]
    ghosts = [f for f in mine if not positions.has(f[5])]
    return {"latencies": latencies, "distances": distances, "warnings": len(mine), "right": len(right), "ghosts": len(ghosts)}


def figures(parts):
    """Recall, precision and latency over sequences."""
    latencies = sorted(x for part in parts for x in part["latencies"])
    distances = {name: [hit for part in parts for hit in part["distances"].get(name, [])] for _, name in RANGES}
    true, warnings = sum(map(len, distances.values())), sum(part["warnings"] for part in parts)
    right, ghosts = (sum(part[key] for part in parts) for key in ("right", "ghosts"))
    return {"true": true, "found": len(latencies), "warnings": warnings, "right": right, "ghosts": ghosts,
            "recall": len(latencies) / true if true else None, "precision": right / warnings if warnings else None,
            "latency_median_frames": statistics.median(latencies) if latencies else None,
            "latency_p90_frames": latencies[int(0.9 * len(latencies))] if latencies else None,
            "found_by_distance": {name: [sum(hits), len(hits)] for name, hits in distances.items() if hits}}


def call(*words):
    result = subprocess.run([str(w) for w in words], capture_output=True, text=True, check=False)
    if result.returncode not in (0, 3):
        raise core.Failed(result.stderr.strip())


def truth_of(sequence, folder, program):
    """The true warnings, the pixels and positions of the movers, and the file of the rules."""
    pixels = write_truth(sequence, folder / "truth")
    rules = folder / "rules.yaml"
    write_rules(rules, sequence)
    call(program, "warn", folder / "truth", "--zones", rules, "--force")
    positions = TruePositions(folder / "truth", FirstCamera(sequence).direction([0, 0, 1]))
    return intervals(folder / "truth/events.jsonl"), pixels, positions, rules


def run(sequence, rules, words, out, program):
    """The warnings of a run, which is made unless the same program has made it."""
    made_by = {"program": core.sha256_of(program), "words": [str(w) for w in words], "rules": rules.read_text()}
    if core.read_json(out / "made_by.json") != made_by:
        core.say(f"{out} ...")
        shutil.rmtree(out, ignore_errors=True)
        call(program, "run", sequence, *words, "--zones", rules, "--out", out)
        (out / "made_by.json").write_text(json.dumps(made_by))
    return intervals(out / "events.jsonl")


def rows_of(scene, arguments):
    """The figures of one scene with each segmentation."""
    kinds = {"masks": lambda sequence: ["--masks", sequence / "mask"]}
    if arguments.model:
        kinds[arguments.model.stem] = lambda _: ["--model", arguments.model]
    kinds["no network"] = lambda _: []
    parts = {kind: [] for kind in kinds}
    for seed in range(1, arguments.seeds + 1):
        folder = arguments.out / f"{scene}_{seed}"
        sequence = folder / "sequence"
        if not (sequence / "associations.txt").exists():  # the last file that is written
            core.say(f"{sequence} ...")
            call(arguments.program, "simulate", *SCENES[scene], "--frames", arguments.frames, "--fps", FPS, "--seed", seed,
                 "--out", sequence)
        truth, pixels, positions, rules = truth_of(sequence, folder, arguments.program)
        for kind, words in kinds.items():
            found = run(sequence, rules, words(sequence), folder / kind.replace(" ", "_"), arguments.program)
            parts[kind].append(judged(truth, found, pixels, positions))
    return [{"scene": scene, "segmentation": kind, **figures(of_kind)} for kind, of_kind in parts.items()]


def main(arguments):
    arguments.out.mkdir(parents=True, exist_ok=True)
    rows = [row for scene in arguments.scenes for row in rows_of(scene, arguments)]
    lines = [[row["scene"], row["segmentation"], f"{row['found']} of {row['true']}", f"{row['right']} of {row['warnings']}", row["ghosts"],
              f"{core.cell(row['latency_median_frames'], 0)}, {core.cell(row['latency_p90_frames'], 0)}",
              *("{} of {}".format(*row["found_by_distance"].get(name, [0, 0])) for _, name in RANGES)] for row in rows]
    text = core.markdown(["scene", "segmentation", "true warnings found", "warnings that are right", "without a mover there",
                          "latency, median and 90 % [frames]", *(name for _, name in RANGES)], lines,
                         "Warnings against the truth")
    (arguments.out / "zones.md").write_text(text)
    (arguments.out / "zones.json").write_text(json.dumps(rows, indent=1))
    print(text)
    return 0
