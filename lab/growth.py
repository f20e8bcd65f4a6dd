# SPDX-License-Identifier: Apache-2.0
"""Growth of a map while the camera goes round and round in one room.

  python3 -m lab growth --out DIR [--rounds 10] [--people N]
  python3 -m lab growth --out DIR --visits 10 [--people N]

Renders a camera that is carried around the simulated office (once; kept in DIR), and maps the first round, the first
two rounds, and so on. The table has keyframes and landmarks of the map, peak memory, milliseconds and ATE. With --visits each
round is a recording of its own, at another speed, whose run extends the map of the one before; every second visit is of the
rearranged room (`stillmap simulate --visit 2`). The table then has the size and the views of the map, too.

Written to DIR: growth.md (printed at the end), growth.json, and a folder per run.
"""
from pathlib import Path

from lab import core

FPS, SPEED = 15, 1.8  # small images that are quick to render; the camera moves at 0.72 m/s


def add_arguments(parser):
    parser.add_argument("--out", type=Path, required=True, help="folder for the images and the results")
    parser.add_argument("--rounds", type=int, default=10, help="default: %(default)s")
    parser.add_argument("--visits", type=int, help="number of recordings, instead of rounds of one")
    parser.add_argument("--frames", type=int, default=450, help="of a visit; default: %(default)s")
    parser.add_argument("--people", type=int, default=0, help="people who walk about; default: %(default)s")
    parser.add_argument("--program", type=Path, default=core.PROGRAM, help="default: %(default)s")


def distance(a, b):
    return sum((x - y) ** 2 for x, y in zip(a, b)) ** 0.5


def round_length(sequence):
    """Returns the number of frames until the camera is back at its start."""
    path = [row[1:4] for row in core.read_trajectory(sequence / "groundtruth.txt")]
    away = next(i for i, p in enumerate(path) if distance(p, path[0]) > 1)
    near = [i for i in range(away, len(path)) if distance(path[i], path[0]) < 0.5]
    first = [i for i in near if i - near[0] < 3 * FPS]
    return min(first, key=lambda i: distance(path[i], path[0]))


def render(arguments, frames, name):
    sequence = arguments.out / name
    if not (sequence / "associations.txt").exists():  # the last file that is written
        core.call([arguments.program, "simulate", "--people", arguments.people, "--camera", "loop", "--frames", frames,
                   "--fps", FPS, "--speed", SPEED, "--width", 320, "--height", 240, "--out", sequence],
                  arguments.out / f"{name}.log")
    return sequence


def line_of(arguments, sequence, frames):
    out = arguments.out / f"run_{frames}"
    command = core.run_command(arguments.program, sequence, out, ["--count", frames])
    summary = core.ensure_run(f"{frames} frames", command, out)
    figures = core.figures_of(summary)
    return [figures["keyframes"], figures["landmarks"], core.cell(figures["peak_memory_mib"], 0),
            core.cell(figures["tracking_median_ms"], 2),
            core.cell(core.stage_of(summary, "map refinement").get("median_ms"), 1), figures["loops"],
            core.coverage(figures), core.cell(figures["ate_rmse_m"], 4)]


def visit(arguments, number):
    """Maps a visit that extends the map of the one before; returns its line of the table."""
    name = f"visit_{arguments.people}_{number}"
    speed = (1, 0.85, 1.15)[number % 3]
    recording, out = arguments.out / name, arguments.out / f"run_of_{name}"
    if not (recording / "associations.txt").exists():
        core.call([arguments.program, "simulate", "--people", arguments.people, "--camera", "loop", "--frames",
                   arguments.frames, "--fps", FPS, "--speed", SPEED * speed, "--visit", 1 + number % 2, "--width", 320, "--height", 240,
                   "--out", recording], arguments.out / f"{name}.log")
    saved = [arguments.out / f"visits_{arguments.people}_{number - back}.map" for back in (0, 1)]
    words = ["--save-map", saved[0]] + (["--load-map", saved[1]] if number else [])
    summary = core.ensure_run(name, core.run_command(arguments.program, recording, out, words), out, outputs=[saved[0].resolve()])
    figures = core.figures_of(summary)
    core.call([arguments.program, "map", "info", saved[0], "--json", out / "map.json"], out / "map.log")
    described = core.read_json(out / "map.json")
    return [number + 1, described["keyframes"], described["landmarks"], described["views"],
            core.cell(saved[0].stat().st_size / 1e6, 1), core.cell(figures["tracking_median_ms"], 2),
            core.cell(core.stage_of(summary, "map refinement").get("median_ms"), 1), figures["maps"],
            core.coverage(figures), core.cell(figures["ate_rmse_m"], 4)]


def show_visits(arguments):
    lines = [visit(arguments, number) for number in range(arguments.visits)]
    head = ["visit", "keyframes", "landmarks", "views", "map [MB]", "tracking, median [ms]", "refinement, median [ms]",
            "components", "tracked", "ATE [m]"]
    text = core.markdown(head, lines, f"{arguments.frames} frames a visit")
    core.write_tables(arguments.out, text, [dict(zip(head, line)) for line in lines], "visits")
    print(text)
    return 0


def main(arguments):
    arguments.out.mkdir(parents=True, exist_ok=True)
    if arguments.visits:
        return show_visits(arguments)
    length = round_length(render(arguments, 450, f"once_{arguments.people}"))
    sequence = render(arguments, arguments.rounds * length, f"rounds_{arguments.people}_{arguments.rounds}")
    lines = [[rounds, *line_of(arguments, sequence, rounds * length)] for rounds in range(1, arguments.rounds + 1)]
    head = ["rounds", "keyframes", "landmarks", "memory [MiB]", "tracking, median [ms]", "refinement, median [ms]",
            "loops", "tracked", "ATE [m]"]
    text = core.markdown(head, lines, f"{length} frames a round")
    core.write_tables(arguments.out, text, [dict(zip(head, line)) for line in lines], "growth")
    print(text)
    return 0
