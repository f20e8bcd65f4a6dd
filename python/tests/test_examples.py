# SPDX-License-Identifier: Apache-2.0
"""The examples, each where its package is installed."""
import importlib.util
import os
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import stillmap

SOURCE = Path(__file__).resolve().parents[2]


def run_example(package, name, *words):
    pytest.importorskip(package, reason=f"skipped: {package} is missing")
    script = SOURCE / "python" / "examples" / name
    result = subprocess.run([sys.executable, script, *map(str, words)], capture_output=True, text=True, check=False,
                            stdin=subprocess.DEVNULL, timeout=300)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


def test_view_open3d(recording):
    text = run_example("open3d", "view_open3d.py", recording, "--no-window")
    assert "PointCloud with" in text and "LineSet with 23 lines" in text


def test_evaluate_evo(recording):
    words = run_example("evo", "evaluate_evo.py", recording).split()
    assert words[1] == words[4], words  # ATE of both


def test_live_rerun(recording, tmp_path):
    run_example("rerun", "live_rerun.py", recording, tmp_path / "live.rrd")
    assert (tmp_path / "live.rrd").stat().st_size > 1000000


def test_live_viser(recording):
    with socket.socket() as any_free:
        any_free.bind(("", 0))
        port = any_free.getsockname()[1]
    assert "points" in run_example("viser", "live_viser.py", recording, port)


def test_batch_ray(recording, command, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(Path(os.environ["STILLMAP_COMMAND"]).parent), prepend=os.pathsep)
    other = tmp_path / "other"
    command("simulate", "--people", 0, "--frames", 30, "--width", 320, "--height", 240, "--out", other)
    text = run_example("ray", "batch_ray.py", tmp_path / "out", recording, other)
    assert f"{recording.name}: " in text and "0 to come" in text
    command("run", recording, "--out", tmp_path / "alone")
    for name in ("trajectory.txt", "cloud.ply"):
        assert (tmp_path / "out" / recording.name / name).read_bytes() == (tmp_path / "alone" / name).read_bytes()
    assert (tmp_path / "out" / "all.map").stat().st_size > 10000


def profile_of(rs, camera, kind, index, pixel_format, bytes_per_pixel):
    stream = rs.video_stream()
    stream.type, stream.index, stream.uid = kind, 0, index
    stream.width, stream.height, stream.fps = camera.width, camera.height, 30
    stream.bpp, stream.fmt = bytes_per_pixel, pixel_format
    intrinsics = rs.intrinsics()
    intrinsics.width, intrinsics.height = camera.width, camera.height
    intrinsics.fx, intrinsics.fy, intrinsics.ppx, intrinsics.ppy = camera.fx, camera.fy, camera.cx, camera.cy
    intrinsics.model, intrinsics.coeffs = rs.distortion.brown_conrady, [0.0] * 5
    stream.intrinsics = intrinsics
    return stream


class SoftwareCamera:
    """librealsense's software device as a camera, which delivers the frames of a recording."""

    def __init__(self, rs, camera, frames):
        self.rs, self.camera, self.frames = rs, camera, frames
        self.device = rs.software_device()
        self.sensors = {kind: self.device.add_sensor(name)
                        for kind, name in ((rs.stream.depth, "Depth"), (rs.stream.color, "Color"))}
        formats = {rs.stream.depth: (rs.format.z16, 2), rs.stream.color: (rs.format.rgb8, 3)}
        self.profiles = {}
        for index, (kind, sensor) in enumerate(self.sensors.items()):
            stream = profile_of(rs, camera, kind, index, *formats[kind])
            self.profiles[kind] = rs.video_stream_profile(sensor.add_video_stream(stream))
        self.sensors[rs.stream.depth].add_read_only_option(rs.option.depth_units, 1 / camera.depth_factor)
        self.device.create_matcher(rs.matchers.default)
        self.syncer = rs.syncer()
        for kind, sensor in self.sensors.items():
            sensor.open(self.profiles[kind])
            sensor.start(self.syncer)

    def deliver(self, kind, pixels, frame):
        video = self.rs.software_video_frame()
        video.pixels = np.ascontiguousarray(pixels)
        video.bpp = pixels.itemsize * (3 if pixels.ndim == 3 else 1)
        video.stride = self.camera.width * video.bpp
        video.timestamp, video.domain = 1000 * frame.stamp, self.rs.timestamp_domain.hardware_clock
        video.frame_number = frame.index + 1
        video.profile = self.profiles[kind]
        self.sensors[kind].on_video_frame(video)

    def __iter__(self):
        for frame in self.frames:
            raw = np.round(frame.depth * self.camera.depth_factor).astype(np.uint16)
            self.deliver(self.rs.stream.depth, raw, frame)
            self.deliver(self.rs.stream.color, frame.rgb, frame)
            yield self.syncer.wait_for_frames()


def test_live_realsense_with_a_software_device(recording, frames, camera, monkeypatch):
    rs = pytest.importorskip("pyrealsense2", reason="skipped: pyrealsense2 is missing")
    monkeypatch.syspath_prepend(SOURCE / "examples")
    spec = importlib.util.spec_from_file_location("live_realsense", SOURCE / "examples" / "live_realsense.py")
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    device = SoftwareCamera(rs, camera, frames)
    found = example.camera_of(device.profiles[rs.stream.color], 1 / camera.depth_factor)
    np.testing.assert_array_equal(np.float32(camera.matrix), np.float32(found.matrix))
    slam = stillmap.Slam(found, dense={"enabled": False})
    example.live.track(slam, example.frames_of(device))
    trajectory = slam.finish().trajectory
    assert len(trajectory) >= len(frames) - 1  # the first set of the syncer has one stream only
    assert stillmap.ate(recording / "groundtruth.txt", trajectory).translation.rmse < 0.02
