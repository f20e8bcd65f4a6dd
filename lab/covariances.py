# SPDX-License-Identifier: Apache-2.0
"""Errors of poses beside their covariances, where the truth is the pose of a marker with a clock of its own.

  python3 -m lab covariances RUN SEQUENCE

RUN is a folder written by `stillmap run --out`, SEQUENCE the recording with its groundtruth.txt. The constant pose of the
camera on the body that the truth tracks, and the offset of its clock, are estimated by robust least squares, together with
the alignment of the worlds; what is left are errors of the poses and noise of the truth. Printed by the share of moving
keypoints: median errors, and the median standard deviations that the covariances state. A simulated truth needs no
calibration: there, `stillmap eval --covariances` compares the whole covariances. Needs numpy and scipy (build/venv has
them).
"""
import csv
from pathlib import Path

from lab import core

try:
    import numpy as np
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation, Slerp
except ImportError:  # only this subcommand needs them
    np = None

SHARES = (0, .1, .3, .5, .65, .75, 1)
OFFSETS = 40, 4  # of the clock of the truth, largest one and step [ms]
SAME_TIME = 1e-4  # [s]


def rows_of(file):
    return np.loadtxt(file, ndmin=2, comments="#")


def nearest(times, wanted):
    """Returns the index of the time that is nearest to each wanted one."""
    after = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    return after - (wanted - times[after - 1] < times[after] - wanted)


class Truth:
    """Poses of the tracked body, interpolated."""

    def __init__(self, file):
        rows = rows_of(file)
        rows = rows[np.unique(rows[:, 0], return_index=True)[1]]
        self.times, self.positions = rows[:, 0], rows[:, 1:4]
        self.rotations = Slerp(self.times, Rotation.from_quat(rows[:, 4:8]))

    def at(self, times):
        return self.rotations(times), np.stack([np.interp(times, self.times, axis) for axis in self.positions.T], 1)


def errors(estimate, truth, parameters):
    """Rotation vectors [rad] and positions [m] of the body's errors, in its frame."""
    rotations, positions = estimate
    world, body = Rotation.from_rotvec(parameters[:3]), Rotation.from_rotvec(parameters[6:9])
    R, t = truth
    position = world.apply(positions + rotations.apply(parameters[9:12])) + parameters[3:6]
    return (R.inv() * world * rotations * body).as_rotvec(), R.inv().apply(position - t)


def calibrated(times, estimate, truth):
    """Returns the least errors and the offset of the truth's clock [s]."""
    best = None
    most, step = OFFSETS
    for offset in np.arange(-most, most + step, step) / 1000:
        there = truth.at(times + offset)
        start = np.zeros(12)
        world = (there[0] * estimate[0].inv()).mean()
        start[:3], start[3:6] = world.as_rotvec(), (there[1] - world.apply(estimate[1])).mean(0)
        residuals = lambda x, there=there: np.concatenate([e.ravel() for e in errors(estimate, there, x)]) / .01
        solved = least_squares(residuals, start, loss="soft_l1")
        if best is None or solved.cost < best[0]:
            best = solved.cost, offset, errors(estimate, there, solved.x)
    return best[2], best[1]


def sigmas_of(run, times):
    """Standard deviations of rotation [rad] and position [m] that the covariances of a run state."""
    rows = rows_of(run / "trajectory_covariance.txt")
    rows = rows[nearest(rows[:, 0], times)]
    diagonal = np.stack([rows[:, 1 + 6 * i - i * (i - 1) // 2] for i in range(6)], 1)
    return np.sqrt(diagonal[:, 3:].sum(1)), np.sqrt(diagonal[:, :3].sum(1))


def moving_shares(run, times):
    with (run / "frames.csv").open(encoding="utf-8") as lines:
        rows = np.array([[float(row["timestamp"]), int(row["moving"]) / max(1, int(row["keypoints"]))]
                         for row in csv.DictReader(lines)])
    return rows[nearest(rows[:, 0], times), 1]


def compare(run, sequence):
    truth = Truth(sequence / "groundtruth.txt")
    rows = rows_of(run / "trajectory.txt")
    slack = OFFSETS[0] / 1000 + SAME_TIME
    rows = rows[(rows[:, 0] > truth.times[0] + slack) & (rows[:, 0] < truth.times[-1] - slack)]
    times = rows[:, 0]
    found, offset = calibrated(times, (Rotation.from_quat(rows[:, 4:8]), rows[:, 1:4]), truth)
    sizes, sigmas, shares = [np.linalg.norm(e, axis=1) for e in found], sigmas_of(run, times), moving_shares(run, times)
    print(f"clock of the truth: {1000 * offset:+.0f} ms\n")
    print("| moving keypoints | poses | position: error, stated [mm] | rotation: error, stated [deg] |\n|---|---|---|---|")
    for least, most in zip(SHARES, SHARES[1:]):
        chosen = (shares >= least) & (shares < most)
        if not chosen.any():
            continue
        angle, length = ([np.median(values[chosen]) for values in pair] for pair in zip(sizes, sigmas))
        print(f"| {100 * least:.0f} to {100 * most:.0f} % | {chosen.sum()} | {1000 * length[0]:.1f}, {1000 * length[1]:.1f} "
              f"| {np.degrees(angle[0]):.3f}, {np.degrees(angle[1]):.3f} |")


def add_arguments(parser):
    parser.add_argument("run", type=Path)
    parser.add_argument("sequence", type=Path)


def main(arguments):
    if np is None:
        raise core.Failed("numpy or scipy is missing: run build/venv/bin/python -m lab covariances ...")
    try:
        compare(arguments.run, arguments.sequence)
    except (OSError, ValueError, KeyError, IndexError) as problem:
        raise core.Failed(f"a file in {arguments.run} or {arguments.sequence} is missing or damaged: {problem}") from problem
    return 0
