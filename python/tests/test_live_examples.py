# SPDX-License-Identifier: Apache-2.0
"""The examples for live cameras, with stand-ins for the vendors' frames. Their names and shapes are those of the
vendors' packages; the packages themselves are not needed."""
import datetime
import importlib.util
import sys
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest

import stillmap
from test_examples import SOURCE


@pytest.fixture(name="load")
def fixture_load(monkeypatch):
    def load(name, *packages):
        for package in packages:
            monkeypatch.setitem(sys.modules, package, mock.MagicMock())
        spec = importlib.util.spec_from_file_location(name, SOURCE / "examples" / f"{name}.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module
    return load


def returns(value):
    return lambda: value


def millimeters(frame):
    return np.round(frame.depth * 1000).astype(np.uint16)


def check(slam, recording, frames):
    trajectory = slam.finish().trajectory
    assert len(trajectory) == len(frames)
    assert stillmap.ate(recording / "groundtruth.txt", trajectory).translation.rmse < 0.02


def slam_of(camera):
    return stillmap.Slam(camera, dense={"enabled": False})


def test_live_oak(load, recording, frames, camera):
    example = load("live_oak", "depthai")
    example.SIZE = camera.width, camera.height

    def message(pixels, stamp):
        return SimpleNamespace(getFrame=returns(pixels), getTimestampDevice=returns(datetime.timedelta(seconds=stamp)))

    slam = slam_of(example.camera_of(camera.matrix))
    example.track(slam, ({"color": message(f.rgb, f.stamp), "depth": message(millimeters(f), f.stamp)} for f in frames))
    check(slam, recording, frames)


def test_live_orbbec(load, recording, frames, camera):
    example = load("live_orbbec", "pyorbbecsdk")
    intrinsic = SimpleNamespace(width=camera.width, height=camera.height, fx=camera.fx, fy=camera.fy, cx=camera.cx, cy=camera.cy)
    distortion = SimpleNamespace(k1=0, k2=0, p1=0, p2=0, k3=0)
    profile = SimpleNamespace(get_intrinsic=returns(intrinsic), get_distortion=returns(distortion), get_fps=returns(30))

    def frame_set(frame):
        def video(pixels):
            return SimpleNamespace(get_height=returns(camera.height), get_width=returns(camera.width), get_depth_scale=returns(0.5),
                                   get_data=returns(pixels.tobytes()), get_timestamp_us=returns(round(1e6 * frame.stamp)))
        return SimpleNamespace(get_color_frame=returns(video(frame.rgb)), get_depth_frame=returns(video(2 * millimeters(frame))))

    slam = slam_of(example.camera_of(profile, "kinect_v1"))
    missing = SimpleNamespace(get_color_frame=returns(None), get_depth_frame=returns(None))
    example.track(slam, [missing, *map(frame_set, frames)])
    check(slam, recording, frames)


def test_live_record3d(load, recording, frames, camera):
    example = load("live_record3d", "record3d")
    current = []
    doubled = SimpleNamespace(fx=2 * camera.fx, fy=2 * camera.fy, tx=2 * camera.cx + 0.5, ty=2 * camera.cy + 0.5)
    stream = SimpleNamespace(get_rgb_frame=lambda: np.repeat(np.repeat(current[0].rgb, 2, 0), 2, 1),
                             get_depth_frame=lambda: current[0].depth[::2, ::2])

    def times():
        for frame in frames:
            current[:] = [frame]
            yield frame.stamp

    found = example.camera_of(doubled, (2 * camera.height, 2 * camera.width, 3))
    np.testing.assert_array_equal(found.matrix, camera.matrix)
    slam = slam_of(found)
    example.track(slam, stream, times())
    check(slam, recording, frames)


def test_pixels_and_camera_of_ros2_messages(load, frames, camera):
    example = load("ros2_node")
    rgb, depth = frames[0].rgb, millimeters(frames[0])
    padded = np.zeros((camera.height, 3 * camera.width + 8), np.uint8)
    for encoding, pixels in (("rgb8", rgb), ("bgr8", rgb[:, :, ::-1])):
        padded[:, : 3 * camera.width] = pixels.reshape(camera.height, -1)
        message = SimpleNamespace(encoding=encoding, height=camera.height, width=camera.width, step=padded.shape[1],
                                  data=padded.tobytes())
        np.testing.assert_array_equal(example.pixels_of(message), rgb)
    message = SimpleNamespace(encoding="16UC1", height=camera.height, width=camera.width, step=2 * camera.width, data=depth.tobytes())
    np.testing.assert_array_equal(example.pixels_of(message), depth)
    info = SimpleNamespace(width=camera.width, height=camera.height, k=camera.matrix.ravel(), d=[0.1, 0.2, 0, 0])
    np.testing.assert_array_equal(example.camera_of(info).matrix, camera.matrix)
    assert example.camera_of(info).distorted
