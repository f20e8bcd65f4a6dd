# SPDX-License-Identifier: Apache-2.0
"""Merged maps: pieces of recordings in one world, wrong connections of different places, bytes in other orders.

  python3 -m lab merging SEQUENCES --out DIR [--length 60] [--most 12] [--orders 10]

SEQUENCES holds sequences in TUM layout with groundtruth.txt; those with the same beginning of their names, up to the
first "_", are of one place. Pieces of each, spread evenly, are mapped one by one, and all maps are merged. A connection of
two places is wrong. The ATE is that of the keyframes of all pieces of a sequence that lie in one world, aligned at once,
beside that of a run of the whole sequence. The merge is repeated with the maps in other orders.

Written to DIR: merging.md (printed at the end), merging.json, and a folder per run.
"""
import random
import time
from collections import Counter
from pathlib import Path

from lab import core


def add_arguments(parser):
    parser.add_argument("sequences", type=Path, help="folder of sequences in TUM layout, with groundtruth.txt")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument("--only", type=core.names, default=[], help="only sequences of these names")
    parser.add_argument("--length", type=int, default=60, help="of a piece [frames]; default: %(default)s")
    parser.add_argument("--most", type=int, default=12, help="pieces of a sequence; default: %(default)s")
    parser.add_argument("--orders", type=int, default=10, help="of the maps; default: %(default)s")
    parser.add_argument("--set", action="append", default=[], metavar="OPTION=VALUE", help="option of every run")
    parser.add_argument("--program", type=Path, default=core.PROGRAM, help="default: %(default)s")


def place_of(sequence):
    return sequence.name.split("_")[0]


def mapped(arguments, sequence, name, words=()):
    """Returns the folder of a run."""
    out = arguments.out / name
    core.ensure_run(name, core.run_command(arguments.program, sequence, out, words, settings=arguments.set), out)
    return out


def rows_of(file):
    return [line for line in file.read_text(encoding="utf-8").splitlines() if line and line[0] != "#"]


def pieces_of(arguments, sequence):
    """Returns the folders of the runs of the pieces of a sequence."""
    frames = len(rows_of(sequence / "rgb.txt"))
    count = min(arguments.most, max(1, frames // arguments.length))
    starts = [i * (frames - arguments.length) // max(1, count - 1) for i in range(count)]
    return [mapped(arguments, sequence, f"{sequence.name}-{start}", ["--first", start, "--count", arguments.length])
            for start in starts]


def merged(arguments, runs, name):
    """Merges the maps of runs. Returns the bytes of the map, the description of the merge, and the time [s]."""
    out, description = arguments.out / f"{name}.map", arguments.out / f"{name}.json"
    begin = time.monotonic()
    core.call([arguments.program, "map", "merge", *runs, "--out", out, "--json", description, "--force"],
              arguments.out / f"{name}.log")
    return out.read_bytes(), core.read_json(description), time.monotonic() - begin


def keyframes_of(arguments, names):
    """Returns the keyframes of the merged map: lists of (component, row in TUM format) by the name of their map."""
    export = arguments.out / "export"
    core.call([arguments.program, "map", "export", arguments.out / "merged.map", "--out", export, "--force"],
              arguments.out / "export.log")
    keyframes = {name: [] for name in names}
    for k in core.read_json(export / "graph.json")["keyframes"]:
        row = [k["timestamp"], *k["translation"], *k["quaternion_xyzw"]]
        keyframes[names[k["session"]]].append((k["component"], row))
    return keyframes


def error(arguments, sequence, trajectory):
    """Returns the ATE of a trajectory [mm]; None for too few poses."""
    if len(core.read_trajectory(trajectory)) < 3:
        return None
    description = arguments.out / "error.json"
    core.call([arguments.program, "eval", sequence / "groundtruth.txt", trajectory, "--json", description, "--force"],
              arguments.out / "error.log")
    return 1000 * core.leaf(core.read_json(description), "ate", "translation", "rmse")


def line_of(arguments, sequence, runs, keyframes):
    """Returns the line of a sequence: its pieces in the world of most of them."""
    worlds = Counter(component for run in runs for component in {c for c, _ in keyframes[str(run)]})
    world, count = worlds.most_common(1)[0]
    rows = sorted(row for run in runs for component, row in keyframes[str(run)] if component == world)
    together = arguments.out / "together.txt"
    together.write_text("".join(" ".join(f"{x:.9f}" for x in row) + "\n" for row in rows), encoding="utf-8")
    whole = mapped(arguments, sequence, sequence.name)
    return {"sequence": sequence.name, "pieces in one world": f"{count} of {len(runs)}",
            "ATE [mm]": core.cell(error(arguments, sequence, together), 1),
            "ATE of one run [mm]": core.cell(error(arguments, sequence, whole / "keyframes.txt"), 1)}


def main(arguments):
    arguments.out.mkdir(parents=True, exist_ok=True)
    sequences = core.sequences_of(arguments)
    runs = {sequence: pieces_of(arguments, sequence) for sequence in sequences}
    everything = [run for of_sequence in runs.values() for run in of_sequence]
    known, description, seconds = merged(arguments, everything, "merged")
    place = {str(run): place_of(sequence) for sequence, of_sequence in runs.items() for run in of_sequence}
    pairs = Counter((place[p["a"]] == place[p["b"]], p["connected"]) for p in description["pairs"])
    keyframes = keyframes_of(arguments, description["maps"])
    lines = [line_of(arguments, sequence, runs[sequence], keyframes) for sequence in sequences]
    orders = random.Random(1)
    different = sum(merged(arguments, orders.sample(everything, len(everything)), "order")[0] != known
                    for _ in range(arguments.orders))
    totals = {"maps": len(everything), "pairs of different places": pairs[False, True] + pairs[False, False],
              "of these connected": pairs[False, True], "pairs of one place": pairs[True, True] + pairs[True, False],
              "of them connected": pairs[True, True], "time [s]": core.cell(seconds, 1),
              "memory [MiB]": core.cell(description["peak_memory_mib"], 0),
              "other bytes": f"{different} of {arguments.orders} orders"}
    text = core.markdown(list(totals), [list(totals.values())]) + "\n" + core.markdown(
        list(lines[0]), [list(line.values()) for line in lines])
    core.write_tables(arguments.out, text, {"totals": totals, "sequences": lines}, "merging")
    print(text)
    return 0
