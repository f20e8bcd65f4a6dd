# SPDX-License-Identifier: Apache-2.0
"""Changes between visits of a simulated room: found, missed and false ones.

  python3 -m lab changes OUT [--seeds 1,2,3] [--people 0] [--width 320] [--frames 700]

Renders visits of the office with `stillmap simulate --visit`: of each seed the first visit, the same with another path and
with the light of the evening, and the second one, maps each, and compares the maps with `stillmap map changes`. "during its run": what a run that extends the
map of the first visit tells (changes.jsonl). A reported surface is right if its center lies within 20 cm of the box of a
piece of furniture that truly is there at that visit only; a piece of which the camera saw five square decimeters is found
if a right surface belongs to it. Between the first visits nothing has changed.

Written to OUT: changes.md (printed at the end), changes.json, and a folder per recording, run and comparison.
"""
import array
import csv
import json
import math
from pathlib import Path

from lab import core

NEAR = 0.2  # [m]
SEEN = 500  # points of surface.ply, one per square centimeter
VISITS = {"first": ["--visit", 1], "again": ["--visit", 1, "--speed", 0.85],
          "evening": ["--visit", 1, "--speed", 0.9, "--light", "evening"], "second": ["--visit", 2, "--speed", 1.15]}


def add_arguments(parser):
    parser.add_argument("out", type=Path, help="folder for recordings and results")
    parser.add_argument("--seeds", type=core.names, default=["1", "2", "3"])
    parser.add_argument("--people", type=int, default=0, help="people who walk; default: %(default)s")
    parser.add_argument("--width", type=int, default=320, help="of the images [pixels]; default: %(default)s")
    parser.add_argument("--frames", type=int, default=700, help="of a visit; default: %(default)s, once around the room")
    parser.add_argument("--program", type=Path, default=core.PROGRAM, help="default: %(default)s")


def mapped(arguments, seed, visit):
    """Returns the folders of the recording of a visit and of its run."""
    name = f"{visit}-{seed}"
    recording, run = arguments.out / "recordings" / name, arguments.out / name
    if not (recording / "associations.txt").exists():
        core.say(f"renders {name}")
        recording.parent.mkdir(parents=True, exist_ok=True)
        core.call([arguments.program, "simulate", "--camera", "loop", "--fps", 15, "--frames", arguments.frames, "--people",
                   arguments.people, "--width", arguments.width, "--height", arguments.width * 3 // 4, "--seed", seed,
                   *VISITS[visit], "--out", recording, "--quiet"], arguments.out / f"{name}.render.log")
    core.ensure_run(name, core.run_command(arguments.program, recording, run), run)
    return recording, run


def to_truth(run):
    """Returns the function that moves a point from the world of a run to that of its truth."""
    T = core.read_json(run / "summary.json")["evaluation"]["ate"]["T_truth_estimate"]
    x, y, z, w = T["quaternion_xyzw"]
    R = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
         [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
         [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    return lambda p: [sum(a * b for a, b in zip(row, p)) + t for row, t in zip(R, T["translation_m"])]


def pieces_of(recording):
    """Returns the boxes of the rearranged pieces at both visits: {name: (box or None, box or None)}."""
    with (recording / "rearranged.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))

    def box(row, visit):
        corners = [[row[f"{visit}_{corner}_{axis}"] for axis in "xyz"] for corner in ("min", "max")]
        return None if corners[0][0] == "" else [[float(x) for x in corner] for corner in corners]
    return {row["name"]: (box(row, "first"), box(row, "second")) for row in rows}


def seen_pieces(recording, pieces, side):
    """Returns the names of the pieces of which a visit saw enough."""
    header, _, data = (recording / "surface.ply").read_bytes().partition(b"end_header\n")
    count = int(header.split(b"element vertex ")[1].split()[0])
    values = array.array("f", data[:12 * count])
    seen = dict.fromkeys((name for name, boxes in pieces.items() if boxes[side]), 0)
    for x, y, z in zip(values[0::3], values[1::3], values[2::3]):
        for name in seen:
            low, high = pieces[name][side]
            if low[0] <= x <= high[0] and low[1] <= y <= high[1] and low[2] + 0.03 < z <= high[2]:  # not the floor
                seen[name] += 1
    return {name for name, points in seen.items() if points >= SEEN}


def surfaces_of(changes, moved):
    """Returns the surfaces of changes: (side, kind, center in the truth's world)."""
    return [(side, change["kind"], moved(change[key]["center"])) for change in changes
            for side, key in enumerate(("before", "after")) if key in change]


def found_between(arguments, before, after, name):
    """Returns the surfaces that differ between two runs."""
    folder = arguments.out / name
    core.call([arguments.program, "map", "changes", before, after, "--out", folder, "--force"], arguments.out / f"{name}.log")
    found = core.read_json(folder / "changes.json")
    return surfaces_of(found["changes"], to_truth(Path(found["world"])))


def told_during_run(arguments, before, recording, name):
    """Returns the surfaces that a run tells which extends the map of another run."""
    run = arguments.out / name
    core.ensure_run(name, [*core.run_command(arguments.program, recording, run), "--load-map", str(before)], run)
    return surfaces_of(map(json.loads, (run / "changes.jsonl").read_text().splitlines()), to_truth(before))


def piece_at(pieces, side, center):
    """Returns the name of the piece at a place at one of the visits, or None."""
    distances = {name: math.hypot(*(max(low - x, x - high, 0) for low, high, x in zip(*boxes[side], center)))
                 for name, boxes in pieces.items() if boxes[side]}
    name = min(distances, key=distances.get, default=None)
    return name if name and distances[name] < NEAR else None


def counts(surfaces, pieces, recordings):
    found = [piece_at(pieces, side, center) for side, _, center in surfaces]
    truth = {(name, side) for side in (0, 1) for name in seen_pieces(recordings[side], pieces, side)}
    right = {(name, side) for name, (side, _, _) in zip(found, surfaces) if name} & truth
    moved = {name for name, _ in truth if {(name, 0), (name, 1)} <= truth}
    told = {name for name, (_, kind, _) in zip(found, surfaces) if name in moved and kind == "moved"}
    return {"surfaces that changed": len(truth), "found": len(right), "reported": len(surfaces),
            "false": sum(name is None for name in found), "moved pieces": len(moved), "told as moved": len(told),
            "missed": sorted(f"{name} ({('before', 'after')[side]})" for name, side in truth - right)}


def main(arguments):
    arguments.out.mkdir(parents=True, exist_ok=True)
    lines = []
    for seed in arguments.seeds:
        runs = {visit: mapped(arguments, seed, visit) for visit in VISITS}
        pieces = pieces_of(runs["first"][0])
        for before, after, truth in (("first", "second", pieces), ("again", "second", pieces), ("evening", "second", pieces),
                                     ("first", "again", {}), ("first", "evening", {})):
            surfaces = found_between(arguments, runs[before][1], runs[after][1], f"{before}-{after}-{seed}")
            recordings = runs[before][0], runs[after][0]
            lines.append({"seed": seed, "visits": f"{before}, {after}", **counts(surfaces, truth, recordings)})
        for after, truth in (("second", pieces), ("again", {}), ("evening", {})):
            surfaces = told_during_run(arguments, runs["first"][1], runs[after][0], f"live-{after}-{seed}")
            recordings = runs["first"][0], runs[after][0]
            lines.append({"seed": seed, "visits": f"first, {after} during its run", **counts(surfaces, truth, recordings)})
    text = core.markdown(list(lines[0]), [[", ".join(v) if isinstance(v, list) else v for v in line.values()] for line in lines])
    core.write_tables(arguments.out, text, {"comparisons": lines}, "changes")
    print(text)
