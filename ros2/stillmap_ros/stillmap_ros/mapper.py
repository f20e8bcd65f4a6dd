# SPDX-License-Identifier: Apache-2.0
"""Slam in the frames of a robot: its poses as map -> odom -> base, and its map in files. For the tracking thread."""
import json
import os
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yaml

import stillmap
from stillmap_ros.pairing import SET_BACK
from stillmap_ros.transforms import adjoint, inverse, matrix_of_pose, rotation_of, rotation_vector

LEAST_VARIANCE = 1e-6  # of a pose [m^2, rad^2]; the first frame of a map has none, and filters demand one
BRIDGED = 0.2  # time without a motion from the camera over which the odometry keeps its velocity [s]
INTERVAL = 33 * 10**6  # time between the frames before and after the clock was set back [ns]


@dataclass
class Located:
    """The result of a frame. Covariances as in ROS: x, y, z, and rotations about the fixed axes."""
    time: int  # of the image [ns]
    update: stillmap.PoseUpdate
    T_map_base: np.ndarray | None = None  # None while there is no pose in the map
    covariance: np.ndarray = field(default_factory=lambda: np.eye(6))
    elsewhere: bool = False  # the camera has a pose, but in a map that is not connected with the loaded one
    T_odom_base: np.ndarray | None = None  # visual odometry; None while there is no pose
    odometry_covariance: np.ndarray = field(default_factory=lambda: np.eye(6))
    twist: np.ndarray = field(default_factory=lambda: np.zeros(6))  # (v, w) in the base [m/s, rad/s]
    twist_covariance: np.ndarray = field(default_factory=lambda: np.eye(6))


class FrameError(ValueError):
    """A file next to a map that does not contain T_map_world."""


class StampError(ValueError):
    """A frame that is not newer than the one before."""


def covariance_in(T, covariance):
    """Returns a covariance of small motions in the base as one about the fixed axes of the frame of T_frame_base."""
    turned = np.kron(np.eye(2), T[:3, :3])
    return turned @ covariance @ turned.T + LEAST_VARIANCE * np.eye(6)


class Odometry:
    """The motions between frames, added up. It never jumps: corrections of the map are not in it."""

    def __init__(self):
        self.T_odom_base = np.eye(4)
        self.covariance = np.zeros((6, 6))  # of T_odom_base, in the base
        self.twist = np.zeros(6)
        self.twist_covariance = np.eye(6)
        self.error = np.zeros((6, 6))  # of the newest pose in the map, in the base
        self.last = None  # time of the newest frame with a pose [ns]

    def add(self, time, T_previous_base, error):
        """Adds a frame. T_previous_base: its motion since the last one, None if unknown; error: covariance in the base."""
        dt = (time - self.last) / 1e9 if self.last is not None else None
        if T_previous_base is not None and dt:
            both = error + self.error
            self.twist = np.concatenate([T_previous_base[:3, 3], rotation_vector(T_previous_base[:3, :3])]) / dt
            self.twist_covariance = both / dt**2 + LEAST_VARIANCE * np.eye(6)
        elif dt and 0 < dt < BRIDGED:
            T_previous_base, both = moved(self.twist * dt), (dt * self.twist_covariance * dt)
        else:
            T_previous_base, both = np.eye(4), np.eye(6)
        back = adjoint(inverse(T_previous_base))
        self.covariance = back @ self.covariance @ back.T + (both if self.last is not None else 0)
        self.T_odom_base = self.T_odom_base @ T_previous_base
        self.error, self.last = error, time


def moved(twist):
    """Returns the matrix of a small motion (v, w)."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation_of(twist[3:]), twist[:3]
    return T


def journal_of(map_file):
    return Path(f"{map_file}.journal")


def frame_file_of(map_file):
    """Returns the file next to a map that contains T_map_world."""
    return Path(f"{map_file}.frame")


class Mapper:
    """The system for one camera, and its place in the frames of the robot. The map's frame is the base at the start of
    the map: z up, and on the floor if the base is."""

    def __init__(self, camera, options, T_base_camera, odometry, *, stereo=False, masks=False, load=None, extend=True):
        self.camera, self.odometry, self.stereo = camera, odometry, stereo
        self.slam = stillmap.Slam(camera, options, masks=masks, load_map=load, extend_map=extend)
        if not extend:
            self.slam.set_mode("localize")
        self.T_base_camera = T_base_camera
        self.T_map_world = T_base_camera
        self.in_loaded = load is not None  # T_map_world is that of the loaded map's world
        if load is not None:
            self.T_map_world = self._T_map_world_of(load)
        self.journal, self.rules = None, None
        self.newest = None  # stamp of the newest frame [ns]
        self.shift = 0  # added to the stamps since the clock was set back [ns]

    def _T_map_world_of(self, file):
        """Returns the transform that was saved with a map; without one, the map began where the base is now."""
        saved = frame_file_of(file)
        if not saved.exists():
            return self.T_base_camera
        try:
            T = np.array(json.loads(saved.read_text())["T_map_world"], float)
            if T.shape == (4, 4) and np.isfinite(T).all():
                return T
        except (OSError, ValueError, KeyError, TypeError):
            pass
        raise FrameError(f"{saved} contains no transform of 4 x 4 numbers\n  fix: restore it, or remove it, so that the map "
                         "begins where the base is")

    def load(self, file):
        """Adds a saved map, whose frame is the map's frame from now on: there are no poses until the camera is found in
        it. Returns why no place of it is recognized yet, or an empty text."""
        T_map_world = self._T_map_world_of(file)
        reason = self.slam.load_map(file)
        self.in_loaded, self.T_map_world = True, T_map_world
        if self.journal:
            self._write_frame(self.journal)
        if self.rules:
            self.watch(self.rules)
        return reason

    def watch(self, file):
        """Warns of the zones and distances of a file, whose zones are in the frame of the map."""
        self.rules = file
        try:
            rules = self._rules_in_world(yaml.safe_load(Path(file).read_text()))
        except (yaml.YAMLError, AttributeError, KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{file}: {error}\n  fix: correct it; docs/view.md lists the keys with an example") from error
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as in_world:
            in_world.write(yaml.safe_dump(rules))
            in_world.flush()
            try:
                self.slam.watch(in_world.name)
            except stillmap.Error as error:
                raise ValueError(str(error).replace(in_world.name, str(file))) from error

    def _rules_in_world(self, rules):
        R, t = self.T_map_world[:3, :3].T, self.T_map_world[:3, 3]
        zones = [zone | {"polygon": [(R @ (np.array(corner) - t)).tolist() for corner in zone["polygon"]]}
                 for zone in rules.get("zones", [])]
        return rules | {"up": (R @ rules.get("up", [0, 0, 1])).tolist(), "zones": zones}

    def keep_journal(self, map_file):
        """Keeps a journal next to the file of the map while the node runs; that of a killed node is renamed."""
        self.journal = journal_of(map_file)
        if self.journal.exists():
            os.replace(self.journal, f"{self.journal}.old")
        self.slam.keep_journal(self.journal)
        self._write_frame(self.journal)

    def save(self, map_file):
        self.slam.save_map(map_file)
        self._write_frame(map_file)

    def _write_frame(self, map_file):
        temporary = Path(f"{frame_file_of(map_file)}.new")
        temporary.write_text(json.dumps({"T_map_world": self.T_map_world.tolist()}))
        os.replace(temporary, frame_file_of(map_file))

    def push(self, rgb, depth, time, mask, T_base_camera):
        """Tracks a frame. Returns a Located. Raises StampError.
        depth: or the right image of a stereo pair"""
        stamp = self._rising(time)
        push = self.slam.push_stereo if self.stereo else self.slam.push
        update = push(rgb, depth, stamp / 10**9, *([] if mask is None else [mask]))
        self.newest = stamp
        located = Located(time, update)
        if update.T_world_camera is not None:
            self._locate(located, stamp, T_base_camera)
        self.T_base_camera = T_base_camera
        return located

    def push_imu(self, message):
        """Adds a sensor_msgs/Imu. Samples with numbers that are not finite are left out."""
        stamp, w, a = message.header.stamp, message.angular_velocity, message.linear_acceleration
        numbers = [w.x, w.y, w.z, a.x, a.y, a.z]
        if np.isfinite(numbers).all():
            self.slam.push_imu((stamp.sec * 10**9 + stamp.nanosec + self.shift) / 10**9, numbers[:3], numbers[3:])

    def push_odometry(self, message):
        """Adds a nav_msgs/Odometry. Samples that are no rigid motion are left out."""
        stamp, p, q = message.header.stamp, message.pose.pose.position, message.pose.pose.orientation
        numbers = [p.x, p.y, p.z, q.x, q.y, q.z, q.w]
        if np.isfinite(numbers).all() and abs(np.linalg.norm(numbers[3:]) - 1) < 0.01:
            self.slam.push_odometry((stamp.sec * 10**9 + stamp.nanosec + self.shift) / 10**9, matrix_of_pose(*numbers))

    def _rising(self, time):
        stamp = time + self.shift
        if self.newest is None or stamp > self.newest:
            return stamp
        if stamp > self.newest - SET_BACK:
            raise StampError("the stamps of the images are zero\n  fix: let the camera's driver set header.stamp" if time == 0
                             else "an image is not newer than the one before")
        self.shift += self.newest + INTERVAL - stamp
        return self.newest + INTERVAL

    def _locate(self, located, stamp, T_base_camera):
        update, T_camera_base = located.update, inverse(T_base_camera)
        to_base = adjoint(T_base_camera)
        error = to_base @ update.covariance @ to_base.T
        T_previous_base = None
        if update.T_previous_camera is not None:
            T_previous_base = self.T_base_camera @ update.T_previous_camera @ T_camera_base
        self.odometry.add(stamp, T_previous_base, error)
        odometry = self.odometry
        located.elsewhere = self.in_loaded and not update.in_saved_map
        if not located.elsewhere:
            located.T_map_base = self.T_map_world @ update.T_world_camera @ T_camera_base
            located.covariance = covariance_in(located.T_map_base, error)
        located.T_odom_base = odometry.T_odom_base
        located.odometry_covariance = covariance_in(odometry.T_odom_base, odometry.covariance)
        located.twist, located.twist_covariance = odometry.twist, odometry.twist_covariance
