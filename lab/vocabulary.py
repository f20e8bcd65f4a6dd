# SPDX-License-Identifier: Apache-2.0
"""Makes stillmap/feature/vocabulary.bin again.

  python3 -m lab vocabulary [--scratch build/vocabulary]

Renders empty rooms of many seeds, seen on walks and from many sides, and trains the vocabulary on the images: ten
minutes on two cores, and the same bytes every time. Only needed when the descriptors, the simulated rooms or the
layout of the file change. Sequences that are rendered already are kept.
"""
from pathlib import Path

from lab import core


def add_arguments(parser):
    parser.add_argument("--scratch", type=Path, default=core.ROOT / "build/vocabulary", help="default: %(default)s")
    parser.add_argument("--out", type=Path, default=core.ROOT / "stillmap/feature/vocabulary.bin",
                        help="default: %(default)s")
    parser.add_argument("--program", type=Path, default=core.PROGRAM, help="default: %(default)s")
    parser.add_argument("--lab-program", type=Path, default=core.LAB_PROGRAM, help="default: %(default)s")


def walks():
    """Camera motion, frames, frames per second and seed of every training sequence."""
    yield from (("loop", 40, 1, seed) for seed in range(1, 49))
    for seed in range(49, 65):
        yield from (("halfsphere", 10, 0.5, seed), ("rpy", 10, 0.7, seed))


def main(arguments):
    arguments.scratch.mkdir(parents=True, exist_ok=True)
    folders = []
    for camera, frames, fps, seed in walks():
        folder = arguments.scratch / f"{camera}_{seed}"
        folders.append(folder / "rgb")
        if not (folder / "associations.txt").exists():  # the last file that is written
            core.say(f"rendering {folder.name} ...")
            core.call([arguments.program, "simulate", "--people", 0, "--camera", camera, "--frames", frames,
                       "--fps", fps, "--seed", seed, "--out", folder], arguments.scratch / "render.log")
    core.say("training ...")
    core.call([arguments.lab_program, "vocabulary", *sorted(folders), "--out", arguments.out],
              arguments.scratch / "train.log")
    print((arguments.scratch / "train.log").read_text(encoding="utf-8").strip().splitlines()[-1])
    return 0
