#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints the drift of a trajectory on a KITTI sequence: per frame, and over all segments of a length by KITTI's rule.

  scripts/kitti_drift.py poses.txt RESULTS/trajectory.txt [--fps 10] [--lengths 10,20,30,40]

poses.txt: the truth in KITTI's format; the frame of a pose of the trajectory is its time multiplied by the rate. Needs NumPy.
"""
import argparse

import numpy as np


def read_kitti(file):
    """N x 4 x 4 poses T_world_camera."""
    rows = np.loadtxt(file).reshape(-1, 3, 4)
    return np.concatenate([rows, np.tile([[[0.0, 0, 0, 1]]], (len(rows), 1, 1))], axis=1)


def read_tum(file, fps):
    """Poses T_world_camera by the number of their frame."""
    poses = {}
    for stamp, *translation, x, y, z, w in np.loadtxt(file):
        pose = np.eye(4)
        pose[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
        pose[:3, 3] = translation
        poses[round(stamp * fps)] = pose
    return poses


def error(truth, estimate, i, j):
    """Error of the motion from frame i to frame j: translation [m], rotation [degrees]."""
    E = np.linalg.inv(np.linalg.inv(truth[i]) @ truth[j]) @ (np.linalg.inv(estimate[i]) @ estimate[j])
    return np.linalg.norm(E[:3, 3]), np.degrees(np.arccos(np.clip((np.trace(E[:3, :3]) - 1) / 2, -1, 1)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("truth")
    parser.add_argument("trajectory")
    parser.add_argument("--fps", type=float, default=10, help="rate of the frames [Hz]")
    parser.add_argument("--lengths", default="10,20,30,40", help="lengths of the segments [m]")
    arguments = parser.parse_args()
    truth, estimate = read_kitti(arguments.truth), read_tum(arguments.trajectory, arguments.fps)
    steps = np.linalg.norm(np.diff(truth[:, :3, 3], axis=0), axis=1)
    distance = np.concatenate([[0], np.cumsum(steps)])
    print(f"{len(truth)} frames, {len(estimate)} tracked, path {distance[-1]:.1f} m")
    frames = [error(truth, estimate, i, i + 1) for i in range(len(truth) - 1) if i in estimate and i + 1 in estimate]
    rmse = np.sqrt(np.mean(np.square(frames), axis=0))
    print(f"per frame: {1000 * rmse[0]:.1f} mm, {rmse[1]:.3f} degrees (RMSE)")
    for length in map(float, arguments.lengths.split(",")):
        ends = np.searchsorted(distance, distance + length)  # KITTI: the first frame at least as far away
        segments = [np.divide(error(truth, estimate, i, j), distance[j] - distance[i])
                    for i, j in enumerate(ends) if j < len(truth) and i in estimate and j in estimate]
        if segments:
            meters, degrees = 100 * np.mean(segments, axis=0)
            print(f"{length:g} m: {meters:.2f} %, {degrees:.2f} degrees / 100 m, {len(segments)} segments")


if __name__ == "__main__":
    main()
