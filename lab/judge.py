# SPDX-License-Identifier: Apache-2.0
"""Compares static maps with the truth of a simulator, in addition to `stillmap eval --cloud`.

  python3 -m lab judge walls RUN SEQUENCE      thickness of walls that the camera observed on two visits
  python3 -m lab judge objects RUN SEQUENCE    labels and objects compared with the true objects of the room
  python3 -m lab judge appeared RUN SEQUENCE   furniture that is new or elsewhere at the second visit of the room

RUN is a folder written by `stillmap run --out`, SEQUENCE one by `stillmap simulate`. Needs numpy (build/venv has it).
"""
import csv
from collections import Counter
from pathlib import Path

from lab import changes, core

try:
    import numpy as np
except ImportError:  # only this subcommand needs it
    np = None

TYPES = {"float": "<f4", "double": "<f8", "uchar": "u1", "ushort": "<u2"}


def read_ply(file):
    """Returns the vertices of a binary PLY as a structured array, and its header."""
    data = file.read_bytes()
    begin = data.index(b"end_header\n") + len(b"end_header\n")
    header, count, fields, in_vertices = data[:begin].decode(), 0, [], False
    for line in header.splitlines():
        words = line.split()
        if words[0] == "element":
            in_vertices = words[1] == "vertex"
            count = int(words[2]) if in_vertices else count
        elif words[0] == "property" and in_vertices:
            fields.append((words[2], TYPES[words[1]]))
    return np.frombuffer(data[begin:], np.dtype(fields), count), header


def positions(vertices):
    return np.stack([vertices[axis] for axis in "xyz"], 1).astype(float)


def trajectory_of(file):
    return np.array(core.read_trajectory(file))


def rotation(q):
    x, y, z, w = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def to_truth(run, sequence):
    """Returns R, t from the run's world to the truth's, by least squares over the camera's positions and axes."""
    truth = {round(row[0], 3): row for row in trajectory_of(sequence / "groundtruth.txt")}
    estimate = trajectory_of(run / "trajectory.txt")
    pairs = [(truth[round(row[0], 3)], row) for row in estimate if round(row[0], 3) in truth]
    if not pairs:
        raise core.Failed("the run and the sequence share no time stamp")
    ends = [[], []]  # positions, and points 1 m along each axis, so that a rotating camera suffices
    for pair in pairs:
        for side, row in zip(ends, pair):
            side.extend([row[1:4], *(row[1:4] + rotation(row[4:8]).T)])
    target, source = (np.array(side) for side in ends)
    U, _, Vt = np.linalg.svd((target - target.mean(0)).T @ (source - source.mean(0)))
    R = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
    return R, target.mean(0) - R @ source.mean(0)


class Points:
    """Index of points in a grid of cells, to find those near a place."""

    def __init__(self, points, cell=0.15):
        self.cell, keys = cell, self.keys(np.floor(points / cell))
        self.order = np.argsort(keys, kind="stable")
        self.points, self.sorted = points, keys[self.order]

    @staticmethod
    def keys(cells):
        return ((cells + 5000) @ [10**10, 10**5, 1]).astype(np.int64)

    def near(self, place, radius):
        reach = np.arange(-int(np.ceil(radius / self.cell)), int(np.ceil(radius / self.cell)) + 1)
        around = np.stack(np.meshgrid(reach, reach, reach), -1).reshape(-1, 3)
        keys = self.keys(np.floor(place / self.cell) + around)
        first, last = np.searchsorted(self.sorted, keys), np.searchsorted(self.sorted, keys + 1)
        found = np.concatenate([self.order[a:b] for a, b in zip(first, last)])
        points = self.points[found]
        return points[np.linalg.norm(points - place, axis=1) < radius]

    def along(self, place, normal, radius, reach=0.45):
        """Returns the signed distances along a normal of the points within a cylinder around it [m]."""
        offset = self.near(place, reach) - place
        height = offset @ normal
        return height[np.linalg.norm(offset - np.outer(height, normal), axis=1) < radius]


def wall_patches(surface, spacing=0.4):
    """Returns places and normals of true walls without other surfaces close in front of or behind them."""
    index = Points(surface)
    _, first = np.unique(Points.keys(np.floor(surface / spacing)), return_index=True)
    for place in surface[np.sort(first)]:
        patch = index.near(place, 0.15)
        if len(patch) < 60:
            continue
        middle = patch.mean(0)
        spread, axes = np.linalg.eigh(np.cov((patch - middle).T))
        normal = axes[:, 0]  # z is up in a simulated world
        if spread[0] < 0.003**2 and abs(normal[2]) < 0.2 and np.all(np.abs(index.along(middle, normal, 0.12)) < 0.02):
            yield middle, normal


def read_camera(sequence):
    lines = (line.split("#")[0].split(":") for line in (sequence / "camera.yaml").read_text().splitlines())
    values = {line[0].strip(): line[1] for line in lines if len(line) == 2}
    return {name: float(values[name]) for name in ("fx", "fy", "cx", "cy", "width", "height")}


def longest_absence(place, normal, trajectory, camera):
    """Returns the time between two visits [s]: the longest time that the place was out of view."""
    seen = []
    for row in trajectory[::10]:
        x, y, z = rotation(row[4:8]).T @ (place - row[1:4])
        if not 0.5 < z < 3.5 or abs((row[1:4] - place) @ normal) < 0.3:
            continue
        u, v = camera["fx"] * x / z + camera["cx"], camera["fy"] * y / z + camera["cy"]
        if 20 < u < camera["width"] - 20 and 20 < v < camera["height"] - 20:
            seen.append(row[0])
    return max(np.diff(seen), default=0)


def judge_walls(run, sequence, absence=20):
    R, t = to_truth(run, sequence)
    cloud = Points(positions(read_ply(run / "cloud.ply")[0]) @ R.T + t)
    camera, truth = read_camera(sequence), trajectory_of(sequence / "groundtruth.txt")
    thickness = []
    for place, normal in wall_patches(positions(read_ply(sequence / "surface.ply")[0])):
        if longest_absence(place, normal, truth, camera) < absence:
            continue
        height = cloud.along(place, normal, 0.1)
        if len(height) >= 40:
            thickness.append(np.subtract(*np.percentile(height, [95, 5])))
    if not thickness:
        raise core.Failed("no wall was observed on two visits")
    mm = 1000 * np.array(thickness)
    print(f"{len(mm)} wall patches seen again after {absence} s or more; 5 to 95 % of the points around each within "
          f"(median) {np.median(mm):.0f} mm, (90 %) {np.percentile(mm, 90):.0f} mm, (worst) {mm.max():.0f} mm; "
          f"thicker than 60 mm: {100 * np.mean(mm > 60):.1f} %")


def true_objects(sequence):
    """Returns class, lower and upper corner [m] of the objects of the room."""
    with open(sequence / "things.csv", newline="", encoding="utf-8") as lines:
        return [(row["class"], *(np.array([float(row[f"{end}_{axis}"]) for axis in "xyz"]) for end in ("min", "max")))
                for row in csv.DictReader(lines)]


def inside(points, true_object, margin):
    """Returns whether points lie inside the box of an object, extended by a margin [m]."""
    return np.all((points > true_object[1] - margin) & (points < true_object[2] + margin), axis=-1)


def judge_labels(run, truth, R, t):
    vertices, header = read_ply(run / "semantic.ply")
    points, right, labeled = positions(vertices) @ R.T + t, 0, 0
    for line in header.splitlines():
        if not line.startswith("comment label "):
            continue
        number, name = line.split(maxsplit=3)[2:]
        mine = points[vertices["label"] == int(number)]
        good = np.zeros(len(mine), bool)
        for true_object in truth:
            good |= inside(mine, true_object, 0.05) if true_object[0] == name else False
        print(f"{name:14} {len(mine):7} points, {100 * good.mean() if len(mine) else 0:5.1f} % at a true object")
        right, labeled = right + good.sum(), labeled + len(mine)
    print(f"{'all':14} {labeled:7} points, {100 * right / max(1, labeled):5.1f} %")


def judge_objects(run, sequence):
    R, t = to_truth(run, sequence)
    truth = true_objects(sequence)
    judge_labels(run, truth, R, t)
    found = Counter()
    for detected in core.read_json(run / "objects.json")["objects"]:
        center = R @ np.array(detected["center"]) + t
        match = [i for i, true in enumerate(truth) if true[0] == detected["class"] and inside(center, true, 0.15)]
        found[match[0] if match else None] += 1
    wrong = found.pop(None, 0)
    print(f"{len(truth)} true objects: {len(found)} found, {sum(found.values()) - len(found)} of them doubled; "
          f"{wrong} objects without a true one")
    print("found of each class:", ", ".join(f"{name} {sum(truth[i][0] == name for i in found)}/{count}"
                                            for name, count in Counter(c for c, *_ in truth).items()))


def judge_appeared(run, sequence, distance=0.05, every=10):
    R, t = to_truth(run, sequence)
    cloud = Points(positions(read_ply(run / "cloud.ply")[0]) @ R.T + t, distance)
    surface = positions(read_ply(sequence / "surface.ply")[0])
    for name, (_, box) in sorted(changes.pieces_of(sequence).items()):
        if box is None:
            continue
        points = surface[inside(surface, (name, *map(np.array, box)), 0.01)][::every]
        if len(points):
            share = np.mean([len(cloud.near(point, distance)) > 0 for point in points])
            print(f"{name}: {100 * share:.1f} % of {len(points)} visible points within {100 * distance:.0f} cm of the cloud")


# The files of a run and of a sequence that each subject reads.
NEEDED = {"walls": (["trajectory.txt", "cloud.ply"], ["groundtruth.txt", "camera.yaml", "surface.ply"]),
          "objects": (["trajectory.txt", "semantic.ply", "objects.json"], ["groundtruth.txt", "things.csv"]),
          "appeared": (["trajectory.txt", "cloud.ply"], ["groundtruth.txt", "surface.ply", "rearranged.csv"])}


def require_files(subject, run, sequence):
    """Throws Failed for the first file that is missing."""
    in_run, in_sequence = NEEDED[subject]
    for folder, names, maker in ((run, in_run, "stillmap run --out" + (" with a network" if subject == "objects" else "")),
                                 (sequence, in_sequence, "stillmap simulate --out")):
        for name in names:
            if not (folder / name).is_file():
                raise core.Failed(f"there is no {folder / name}: name a folder that `{maker}` wrote")


def add_arguments(parser):
    parser.add_argument("subject", choices=list(NEEDED))
    parser.add_argument("run", type=Path)
    parser.add_argument("sequence", type=Path)


def main(arguments):
    require_files(arguments.subject, arguments.run, arguments.sequence)
    if np is None:
        raise core.Failed("numpy is missing: run build/venv/bin/python -m lab judge ...")
    try:
        judges = {"walls": judge_walls, "objects": judge_objects, "appeared": judge_appeared}
        judges[arguments.subject](arguments.run, arguments.sequence)
    except (ValueError, KeyError, IndexError) as problem:
        raise core.Failed(f"a file in {arguments.run} or {arguments.sequence} is damaged: {problem!r}") from problem
    return 0
