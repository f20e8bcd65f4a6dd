# SPDX-License-Identifier: Apache-2.0
"""Rigid motions as 4x4 matrices T_a_b (p_a = T_a_b p_b), and the tree of frames of /tf and /tf_static."""
import bisect
import math

import numpy as np

KEPT = 10 * 10**9  # age of the oldest transform that is kept [ns]
LATE = 0.1 * 10**9  # time beyond the newest transform up to which it is used [ns]
# Axes of a camera body (x ahead, y left, z up) and of its image (x right, y down, z ahead), REP 103.
BODY_OPTICAL = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])


def inverse(T):
    result = np.eye(4)
    result[:3, :3] = T[:3, :3].T
    result[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return result


def matrix_of_quaternion(x, y, z, w):
    x, y, z, w = np.array([x, y, z, w]) / np.linalg.norm([x, y, z, w])
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def matrix_of_pose(x, y, z, *quaternion):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = matrix_of_quaternion(*quaternion), (x, y, z)
    return T


def quaternion_of(R):
    """Returns x, y, z, w of a rotation, w >= 0: 4 times one component, the largest, times all of them, normalized."""
    (a, b, c), (d, e, f), (g, h, i) = R.tolist()
    squares = [1 + a - e - i, 1 + e - a - i, 1 + i - a - e, 1 + a + e + i]
    largest = squares.index(max(squares))
    row = [(squares[0], b + d, c + g, h - f), (b + d, squares[1], f + h, c - g), (c + g, f + h, squares[2], d - b),
           (h - f, c - g, d - b, squares[3])][largest]
    length = math.copysign(math.sqrt(sum(x * x for x in row)), row[3])
    return [x / length for x in row]


def matrix_of_rpy(x, y, z, roll, pitch, yaw):
    (a, b, c), (d, e, f) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    T = np.eye(4)
    T[:3, :3] = [[c * b, c * e * d - f * a, c * e * a + f * d], [f * b, f * e * d + c * a, f * e * a - c * d],
                 [-e, b * d, b * a]]
    T[:3, 3] = x, y, z
    return T


def matrix_of(transform):
    """Returns the matrix of a geometry_msgs/Transform."""
    t, q = transform.translation, transform.rotation
    return matrix_of_pose(t.x, t.y, t.z, q.x, q.y, q.z, q.w)


def rotation_vector(R):
    x, y, z, w = quaternion_of(R)
    sine = np.linalg.norm([x, y, z])
    return np.array([x, y, z]) * (2 * np.arctan2(sine, w) / sine if sine > 1e-12 else 2)


def rotation_of(vector):
    """Returns the rotation matrix of a rotation vector."""
    angle = np.linalg.norm(vector)
    axis = vector / angle if angle > 1e-12 else vector
    return matrix_of_quaternion(*(np.sin(angle / 2) * axis), np.cos(angle / 2))


def interpolated(a, b, share):
    """Returns the transform at a share of the way [0..1] from one to another near it."""
    T = np.eye(4)
    T[:3, :3] = a[:3, :3] @ rotation_of(share * rotation_vector(a[:3, :3].T @ b[:3, :3]))
    T[:3, 3] = (1 - share) * a[:3, 3] + share * b[:3, 3]
    return T


def adjoint(T):
    """Returns the matrix that maps a small motion (v, w) in frame b to the same one in frame a, for T_a_b."""
    R, t = T[:3, :3], T[:3, 3]
    cross = np.array([[0, -t[2], t[1]], [t[2], 0, -t[0]], [-t[1], t[0], 0]])
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = R
    result[:3, 3:] = cross @ R
    return result


class FrameTree:
    """The newest transforms of all frames. For one thread that adds; any may look up."""

    def __init__(self):
        self.fixed = {}  # child: (parent, matrix)
        self.moving = {}  # child: (parent, [times], [matrices])

    def add(self, transforms, fixed):
        for stamped in transforms:
            child, parent = stamped.child_frame_id.lstrip("/"), stamped.header.frame_id.lstrip("/")
            matrix = matrix_of(stamped.transform)
            if fixed:
                self.fixed[child] = (parent, matrix)
                continue
            time = stamped.header.stamp.sec * 10**9 + stamped.header.stamp.nanosec
            known = self.moving.get(child)
            times, matrices = (known[1], known[2]) if known and known[0] == parent else ([], [])
            if times and time < times[-1]:  # the clock was set back, or a transform is late
                times, matrices = [], []
            first = bisect.bisect_left(times, time - KEPT)
            self.moving[child] = (parent, [*times[first:], time], [*matrices[first:], matrix])

    def _parent(self, child, time):
        """Returns the parent of a frame and T_parent_child at a time [ns]; None if unknown."""
        if child in self.fixed:
            return self.fixed[child]
        parent, times, matrices = self.moving.get(child, (None, [], []))
        i = bisect.bisect_left(times, time)
        if i < len(times) and (times[i] == time or i > 0):
            if times[i] == time:
                return parent, matrices[i]
            return parent, interpolated(matrices[i - 1], matrices[i], (time - times[i - 1]) / (times[i] - times[i - 1]))
        if times and i == len(times) and time - times[-1] <= LATE:
            return parent, matrices[-1]
        return None

    def _to_root(self, frame, time):
        """Returns the frames from one to its root, with T_ancestor_frame."""
        ancestors, T = {frame: np.eye(4)}, np.eye(4)
        while (found := self._parent(frame, time)) is not None and found[0] not in ancestors:
            frame, T = found[0], found[1] @ T
            ancestors[frame] = T
        return ancestors

    def lookup(self, target, source, time):
        """Returns T_target_source at a time [ns], or None while it is not known."""
        up, down = self._to_root(source, time), self._to_root(target, time)
        for frame, T_frame_source in up.items():
            if frame in down:
                return inverse(down[frame]) @ T_frame_source
        return None
