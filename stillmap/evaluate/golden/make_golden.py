#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the golden trajectories and their expected error figures, with numpy alone.

An evaluation of its own, written from the TUM benchmark's rules and not from the C++ code: brute force where
the C++ is clever, 4x4 matrices where the C++ has quaternions. Writes CASE_truth.txt, CASE_estimate.txt (TUM
format) and expected.json into its own folder. Seeds are fixed: same bytes each time.

    python3 -m pip install numpy && python3 make_golden.py
"""
import json
import pathlib

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent


# ---------------------------------------------------------------- the rules

def read_tum(path):
    """Stamps (n,) and poses (n, 4, 4), sorted by stamp; the last line of a stamp counts."""
    lines = {}
    for line in path.read_text().splitlines():
        if line.strip() and not line.startswith("#"):
            values = [float(word) for word in line.split()]
            lines[values[0]] = values[1:]
    stamps = np.array(sorted(lines))
    return stamps, np.array([pose_matrix(lines[stamp]) for stamp in stamps])


def pose_matrix(values):
    tx, ty, tz, *q = values
    x, y, z, w = np.array(q) / np.linalg.norm(q)
    T = np.eye(4)
    T[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    T[:3, 3] = tx, ty, tz
    return T


def associate(a_stamps, b_stamps, max_difference=0.02):
    """All candidates, sorted by difference, then a, then b; greedy, one to one."""
    candidates = sorted((abs(a - b), a, b) for a in a_stamps for b in b_stamps
                        if abs(a - b) < max_difference)
    free_a, free_b, matches = set(a_stamps), set(b_stamps), []
    for _, a, b in candidates:
        if a in free_a and b in free_b:
            free_a.remove(a)
            free_b.remove(b)
            matches.append((a, b))
    return sorted(matches)


def statistics(errors):
    e = np.asarray(errors)
    return {"rmse": np.sqrt(np.dot(e, e) / len(e)), "mean": np.mean(e), "median": np.median(e),
            "sd": np.std(e), "min": np.min(e), "max": np.max(e), "count": len(e)}


def ate(gt_stamps, gt, est_stamps, est):
    gt_at, est_at = dict(zip(gt_stamps, gt)), dict(zip(est_stamps, est))
    matches = associate(gt_stamps, est_stamps)
    p_gt = np.array([gt_at[a][:3, 3] for a, _ in matches]).T
    p_est = np.array([est_at[b][:3, 3] for _, b in matches]).T
    mean_gt, mean_est = p_gt.mean(axis=1, keepdims=True), p_est.mean(axis=1, keepdims=True)
    W = sum(np.outer(e, g) for e, g in zip((p_est - mean_est).T, (p_gt - mean_gt).T))
    U, _, Vt = np.linalg.svd(W.T)
    S = np.eye(3)
    reflected = np.linalg.det(U) * np.linalg.det(Vt) < 0
    if reflected:
        S[2, 2] = -1
    R = U @ S @ Vt
    t = mean_gt - R @ mean_est
    errors = np.sqrt(((R @ p_est + t - p_gt) ** 2).sum(axis=0))
    return {"translation": statistics(errors), "reflection_guarded": bool(reflected),
            "R_truth_estimate": R.tolist(), "t_truth_estimate": t[:, 0].tolist(),
            "matches": [[float(a), float(b)] for a, b in matches]}


def nearest(stamps, t, low=0, high=None, best=0):
    """Index of the timestamp nearest to t [s], by bisection; the first visited wins a tie."""
    high = len(stamps) if high is None else high
    if low >= high:
        return best
    middle = (low + high) // 2
    best = middle if abs(stamps[middle] - t) < abs(stamps[best] - t) else best
    if stamps[middle] == t:
        return middle
    return nearest(stamps, t, low, middle, best) if stamps[middle] > t else \
        nearest(stamps, t, middle + 1, high, best)


def rpe(gt_stamps, gt, est_stamps, est, delta, unit):
    clock = est_stamps if unit == "s" else np.arange(len(est_stamps), dtype=float)
    limit = 2 * np.median(np.diff(gt_stamps))
    translations, rotations, spans = [], [], []
    for i in range(len(est_stamps)):
        j = nearest(clock, clock[i] + delta)
        if j == len(est_stamps) - 1:
            continue
        gi, gj = nearest(gt_stamps, est_stamps[i]), nearest(gt_stamps, est_stamps[j])
        if max(abs(gt_stamps[gi] - est_stamps[i]), abs(gt_stamps[gj] - est_stamps[j])) > limit:
            continue
        A = np.linalg.inv(gt[gj]) @ gt[gi]
        B = np.linalg.inv(est[j]) @ est[i]
        E = np.linalg.inv(B) @ A
        translations.append(np.linalg.norm(E[:3, 3]))
        rotations.append(np.degrees(np.arccos(np.clip((np.trace(E[:3, :3]) - 1) / 2, -1, 1))))
        spans.append([float(est_stamps[i]), float(est_stamps[j])])
    return {"translation": statistics(translations), "rotation": statistics(rotations), "pairs": spans}


# ------------------------------------------------------------ the trajectories

def rotation(w):
    angle = np.linalg.norm(w)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = w / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def quaternion(R):
    """xyzw, by the eigenvector of the 4x4 matrix of Bar-Itzhack (2000)."""
    K = np.array([[R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
                  [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
                  [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], 0],
                  [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], np.trace(R)]]) / 3
    q = np.linalg.eigh(K)[1][:, -1]
    return q if q[3] >= 0 else -q


def camera_path(t):
    """A hand-held camera at time t (seconds from the start): pose as 4x4."""
    T = np.eye(4)
    T[:3, :3] = rotation(np.array([0.3 * np.sin(0.7 * t), 0.5 * np.sin(0.4 * t + 1), 0.2 * np.cos(1.1 * t)]))
    T[:3, 3] = [1.2 * np.sin(0.5 * t), 0.6 * np.sin(0.9 * t + 0.4), 0.8 * np.cos(0.35 * t)]
    return T


def shifted(T_world, poses):
    return [T_world @ pose for pose in poses]


def drifted(poses, rng, step_t, step_r):
    """Adds a random walk to the poses, each step seen from the camera."""
    walk, result = np.eye(4), []
    for pose in poses:
        step = np.eye(4)
        step[:3, :3] = rotation(rng.normal(0, step_r, 3))
        step[:3, 3] = rng.normal(0, step_t, 3)
        walk = walk @ step
        result.append(pose @ walk)
    return result


def write_tum(path, stamps, poses, decimals=6):
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for stamp, pose in zip(stamps, poses):
        numbers = [*pose[:3, 3], *quaternion(pose[:3, :3])]
        lines.append(f"{stamp:.{decimals}f} " + " ".join(f"{x:.7f}" for x in numbers))
    path.write_text("\n".join(lines) + "\n")


ELSEWHERE = np.block([[rotation(np.array([0.4, -1.1, 0.8])), np.array([[2.0], [-1.0], [0.5]])],
                      [np.zeros((1, 3)), np.ones((1, 1))]])


def case_drift(rng):
    """Motion capture at 100 Hz with jitter, camera at 30 Hz with jitter, drift; lost for 0.8 s and 2.6 s (in
    the longer gap the pose nearest to t + 1 s can be pose i itself)."""
    start = 1341846313.0
    gt_t = np.arange(0, 12, 0.01) + rng.uniform(-0.002, 0.002, 1200)
    est_t = np.arange(0.4, 11.5, 1 / 30) + rng.uniform(-0.004, 0.004, 333)
    lost = ((est_t > 3) & (est_t < 3.8)) | ((est_t > 7) & (est_t < 9.6))
    est_t = est_t[~lost]
    est = drifted(shifted(ELSEWHERE, map(camera_path, est_t)), rng, 0.0015, 0.0008)
    return start + gt_t[::3], list(map(camera_path, gt_t[::3])), start + est_t, est


def case_ties(rng):
    """The estimate at twice the truth's rate and half a step off, all stamps multiples of 1/64 s: every
    difference is exact, most are tied, and one to one matters."""
    gt_t = np.arange(0, 8, 2 / 64)
    est_t = np.arange(0.5, 7.5, 1 / 64) + 0.0
    keep = rng.uniform(size=len(est_t)) > 0.35
    est_t = est_t[keep]
    est = drifted(shifted(ELSEWHERE, map(camera_path, est_t)), rng, 0.002, 0.001)
    return 100 + gt_t, list(map(camera_path, gt_t)), 100 + est_t, est


def case_holes(rng):
    """Holes of 1.5 s and 0.2 s in the truth, the estimate longer than the truth at both ends, and a few
    stamps given twice with different poses."""
    gt_t = np.arange(0, 10, 0.02) + rng.uniform(-0.003, 0.003, 500)
    gt_t = gt_t[~(((gt_t > 4) & (gt_t < 5.5)) | ((gt_t > 7) & (gt_t < 7.2)))]
    est_t = np.sort(np.append(np.arange(-0.6, 10.8, 0.1), [1.0, 2.0, 6.3]))
    est = drifted(shifted(ELSEWHERE, map(camera_path, est_t)), rng, 0.003, 0.002)
    return 1305031100.0 + gt_t, list(map(camera_path, gt_t)), 1305031100.0 + est_t, est


def case_mirrored(rng):
    """An estimate that is the mirror image of the truth in a plane with a little noise: the best orthogonal
    matrix is a reflection, which must not be taken."""
    gt_t = np.arange(0, 4, 0.05)
    gt = list(map(camera_path, gt_t))
    est = [pose.copy() for pose in gt]
    for g, e in zip(gt, est):
        g[2, 3] = 0.3 * g[2, 3]
        e[:3, 3] = g[:3, 3] * [-1, 1, 1] + rng.normal(0, 0.01, 3)
        e[:3, :3] = e[:3, :3] @ rotation(rng.normal(0, 0.02, 3))
    return gt_t, gt, gt_t, est


def main():
    expected = {}
    for seed, case in enumerate([case_drift, case_ties, case_holes, case_mirrored]):
        name = case.__name__.removeprefix("case_")
        gt_stamps, gt, est_stamps, est = case(np.random.default_rng(seed))
        write_tum(HERE / f"{name}_truth.txt", gt_stamps, gt)
        write_tum(HERE / f"{name}_estimate.txt", est_stamps, est)
        truth = read_tum(HERE / f"{name}_truth.txt")
        estimate = read_tum(HERE / f"{name}_estimate.txt")
        expected[name] = {"ate": ate(*truth, *estimate),
                          "rpe_1s": rpe(*truth, *estimate, 1.0, "s"),
                          "rpe_frame": rpe(*truth, *estimate, 1.0, "f")}
        for kind in ("ate", "rpe_1s", "rpe_frame"):
            print(name, kind, json.dumps(expected[name][kind]["translation"]))
    (HERE / "expected.json").write_text(json.dumps(expected, separators=(",", ":")) + "\n")


if __name__ == "__main__":
    main()
