# SPDX-License-Identifier: Apache-2.0
"""The examples for live cameras, with stand-ins for the vendors' packages, whose names and shapes are those of the
packages. The packages themselves are not needed."""
import datetime
import importlib.util
import signal
import sys
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest
from test_examples import SOURCE

import stillmap
from stillmap import lens as lens_models

EXAMPLES = {"live_kinect": ("freenect",), "live_oak": ("depthai",), "live_orbbec": ("pyorbbecsdk",),
            "live_realsense": ("pyrealsense2",), "live_record3d": ("record3d",), "live_zed": ("pyzed",)}


@pytest.fixture(name="load")
def fixture_load(monkeypatch):
    """Loads an example with stand-ins that accept every call, and returns its module."""
    monkeypatch.syspath_prepend(SOURCE / "examples")

    def load(name):
        for package in EXAMPLES.get(name, ()):
            monkeypatch.setitem(sys.modules, package, mock.MagicMock())
        spec = importlib.util.spec_from_file_location(name, SOURCE / "examples" / f"{name}.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield load
    for number, handler in handlers.items():
        signal.signal(number, handler)


@pytest.fixture(name="live")
def fixture_live(load):
    load("live_oak")
    return sys.modules["live"]


def returns(value):
    return lambda *_: value


def millimeters(frame):
    return np.round(frame.depth * 1000).astype(np.uint16)


def check(live, camera, recording, frames, pushed):
    """The frames of an example give the trajectory of the recording; attempts without a frame are left out."""
    slam = stillmap.Slam(camera, dense={"enabled": False})
    live.track(slam, pushed)
    trajectory = slam.finish().trajectory
    assert len(trajectory) == len(frames)
    assert stillmap.ate(recording / "groundtruth.txt", trajectory).translation.rmse < 0.02


def tuples(frames):
    return [(frame.rgb, frame.depth, frame.stamp) for frame in frames]


def positions(folder):
    return np.loadtxt(folder / "trajectory.txt").shape[0]


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize("arguments", [[], ["--help"], ["a file/results"]])
def test_no_camera_starts_without_a_folder_for_the_results(load, monkeypatch, tmp_path, capsys, name, arguments):
    (tmp_path / "a file").write_text("")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [name, *arguments])
    example = load(name)
    stand_ins = [sys.modules[package] for package in EXAMPLES[name]]
    started = [len(stand_in.mock_calls) for stand_in in stand_ins]
    with pytest.raises(SystemExit) as ended:
        example.main()
    assert ended.value.code == (0 if arguments == ["--help"] else 2)
    assert [len(stand_in.mock_calls) for stand_in in stand_ins] == started
    printed = capsys.readouterr()
    assert "RESULTS" in (printed.out or printed.err)


@pytest.mark.parametrize("end, words", [
    (KeyboardInterrupt(), None),
    (RuntimeError("Frame didn't arrive within 5000"), "Frame didn't arrive within 5000"),
    (StopIteration(), None),
])
def test_the_results_are_written_whatever_ends_the_run(live, frames, camera, tmp_path, end, words):
    source = iter(tuples(frames))

    class Ending:
        def __iter__(self):
            return self

        def __next__(self):
            try:
                return next(source)
            except StopIteration:
                raise end from None
    problem = live.run(camera, Ending(), tmp_path)
    assert problem is None if words is None else words in problem and str(tmp_path) in problem
    assert positions(tmp_path) == len(frames)


def test_sigterm_ends_the_run_like_ctrl_c(live, frames, camera, tmp_path):
    def terminated():
        yield from tuples(frames)
        signal.raise_signal(signal.SIGTERM)
        yield from iter(lambda: None, 0)
    assert live.run(camera, terminated(), tmp_path) is None
    assert positions(tmp_path) == len(frames)


def test_a_second_ctrl_c_does_not_lose_the_results(live, frames, camera, tmp_path, monkeypatch):
    class ImpatientSlam(stillmap.Slam):
        def finish(self):
            signal.raise_signal(signal.SIGINT)
            return super().finish()
    monkeypatch.setattr(stillmap, "Slam", ImpatientSlam)
    assert live.run(camera, tuples(frames), tmp_path) is None
    assert positions(tmp_path) == len(frames)


def test_a_run_without_frames_writes_empty_results(live, camera, tmp_path):
    assert live.run(camera, [], tmp_path) is None
    assert (tmp_path / "trajectory.txt").exists()


def test_a_camera_that_delivers_nothing_ends_the_run(live, frames, camera, tmp_path, monkeypatch, capsys):
    clock = iter(range(1000))
    monkeypatch.setattr(live.time, "monotonic", lambda: next(clock))

    def silent():
        yield from tuples(frames)
        yield from iter(lambda: None, 0)
    assert "no usable frame for 5 s" in live.run(camera, silent(), tmp_path / "silent")
    assert positions(tmp_path / "silent") == len(frames)
    repeated = [*tuples(frames), *tuples(frames)[-1:] * 20]
    assert "no usable frame" in live.run(camera, repeated, tmp_path / "repeated")
    assert "timestamp" in capsys.readouterr().err


@pytest.mark.parametrize("lens, coefficients", [
    ("plumb_bob", [0.1, -0.05, 0.001, -0.002, 0.01]), ("BROWN_CONRADY", [0.1, -0.05, 0.001, -0.002, 0.01, 0, 0, 0]),
    ("brown_conrady", [0.1]), ("none", [0] * 5), ("rational_polynomial", [0.1, -0.05, 0.001, -0.002, 0.01, 0, 0, 0])])
def test_coefficients_of_browns_model_are_taken_as_they_are(lens, coefficients):
    found = lens_models.brown_coefficients(lens, coefficients, 640, 480, 600, 600, 320, 240)
    np.testing.assert_array_equal(found, np.pad(coefficients, (0, 5))[:5])


LENS = 640, 480, 600, 600, 320, 240
GRID = np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-0.4, 0.4, 7))


def test_the_rational_model_is_approximated():
    k1, k2, p1, p2, k3, k4, k5, k6 = given = 0.3, 0.05, 0.001, -0.002, 0.01, 0.35, 0.04, 0.005
    fitted = lens_models.brown_coefficients("rational_polynomial", given, *LENS)
    x, y = GRID
    r2 = x**2 + y**2
    ratio = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    true = (x * ratio + 2 * p1 * x * y + p2 * (r2 + 2 * x**2), y * ratio + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y)
    assert np.abs(np.subtract(lens_models.polynomial(x, y, *fitted), true)).max() < 0.1 / 600
    assert np.abs(np.subtract(lens_models.polynomial(x, y, *given[:5]), true)).max() > 5 / 600  # the first five alone


def test_the_inverse_model_is_inverted():
    given = -0.055, 0.064, -0.0009, 0.0005, -0.02
    fitted = lens_models.brown_coefficients("inverse_brown_conrady", given, *LENS)
    ideal = lens_models.polynomial(*GRID, *given)
    assert np.abs(np.subtract(lens_models.polynomial(*ideal, *fitted), GRID)).max() < 0.1 / 600


def test_the_equidistant_model_is_approximated_where_it_can_be():
    given = 0.02, -0.01, 0.003, 0.001
    fitted = lens_models.brown_coefficients("equidistant", given, *LENS)
    for radius in (0.1, 0.3, 0.5):
        angle = np.arctan(radius)
        distorted = angle * (1 + sum(k * angle ** (2 * i) for i, k in enumerate(given, 1)))
        assert abs(lens_models.polynomial(radius, 0, *fitted)[0] - distorted) < 0.1 / 600
    with pytest.raises(lens_models.LensError, match="differs from the lens"):
        lens_models.brown_coefficients("equidistant", given, 848, 800, 286, 286, 424, 400)


@pytest.mark.parametrize("lens, coefficients", [("thin_prism", [0.1] * 12), ("rational_polynomial", [0.1] * 12),
                                                ("ftheta", [0.1]), ("equidistant", [0.1] * 5)])
def test_an_unknown_lens_is_refused(lens, coefficients):
    with pytest.raises(lens_models.LensError, match="not supported.\n  fix"):
        lens_models.brown_coefficients(lens, coefficients, *LENS)


class RealSensePipeline:
    """rs.pipeline of a camera that stops after its frames."""

    def __init__(self, frames, camera):
        self.framesets, self.camera = map(self.frameset, frames), camera

    @staticmethod
    def frameset(frame):
        color = SimpleNamespace(get_data=returns(frame.rgb), get_timestamp=returns(1000 * frame.stamp))
        return SimpleNamespace(get_color_frame=returns(color),
                               get_depth_frame=returns(SimpleNamespace(get_data=returns(millimeters(frame)))))

    def start(self, _):
        c = self.camera
        intrinsics = SimpleNamespace(width=c.width, height=c.height, fx=c.fx, fy=c.fy, ppx=c.cx, ppy=c.cy,
                                     model=SimpleNamespace(name="inverse_brown_conrady"), coeffs=[0.0] * 5)
        profile = SimpleNamespace(fps=returns(30))
        profile.as_video_stream_profile = returns(SimpleNamespace(get_intrinsics=returns(intrinsics)))
        sensor = SimpleNamespace(get_depth_scale=returns(0.001))
        device = SimpleNamespace(first_depth_sensor=returns(sensor))
        return SimpleNamespace(get_stream=returns(profile), get_device=returns(device))

    def wait_for_frames(self, timeout_ms):
        for frameset in self.framesets:
            return frameset
        raise RuntimeError(f"Frame didn't arrive within {timeout_ms}")


def test_live_realsense_keeps_the_results_of_a_camera_that_is_unplugged(load, recording, frames, camera, tmp_path, monkeypatch):
    example = load("live_realsense")
    example.rs.pipeline = returns(RealSensePipeline(frames, camera))
    example.rs.align = returns(SimpleNamespace(process=lambda frameset: frameset))
    monkeypatch.setattr(sys, "argv", ["live_realsense.py", str(tmp_path / "new" / "results")])
    assert "Frame didn't arrive within 5000" in example.main()
    trajectory = stillmap.read_trajectory(tmp_path / "new" / "results" / "trajectory.txt")
    assert len(trajectory) == len(frames)
    assert stillmap.ate(recording / "groundtruth.txt", trajectory).translation.rmse < 0.02


def test_a_missing_camera_is_an_error_in_words(load, live, tmp_path, monkeypatch):
    example = load("live_realsense")
    example.rs.pipeline.return_value.start.side_effect = RuntimeError("No device connected")
    monkeypatch.setattr(sys, "argv", ["live_realsense.py", str(tmp_path)])
    with pytest.raises(SystemExit, match="^The camera cannot be used: No device connected$"):
        live.start(example.main)
    with pytest.raises(SystemExit, match="^stopped$"):
        live.start(lambda: "stopped")
    with pytest.raises(SystemExit) as ended:
        live.start(lambda: None)
    assert ended.value.code is None


def test_live_oak(load, live, recording, frames, camera):
    example = load("live_oak")
    example.SIZE = camera.width, camera.height

    def message(pixels, stamp):
        return SimpleNamespace(getFrame=returns(pixels), getTimestampDevice=returns(datetime.timedelta(seconds=stamp)))

    groups = [None, *({"color": message(f.rgb, f.stamp), "depth": message(millimeters(f), f.stamp)} for f in frames)]
    check(live, example.camera_of(camera.matrix), recording, frames, example.frames_of(groups))


def test_live_orbbec(load, live, recording, frames, camera):
    example = load("live_orbbec")
    intrinsic = SimpleNamespace(width=camera.width, height=camera.height, fx=camera.fx, fy=camera.fy, cx=camera.cx, cy=camera.cy)
    distortion = SimpleNamespace(model=SimpleNamespace(name="BROWN_CONRADY_K6"), k1=0, k2=0, p1=0, p2=0, k3=0, k4=0, k5=0, k6=0)
    profile = SimpleNamespace(get_intrinsic=returns(intrinsic), get_distortion=returns(distortion), get_fps=returns(30))

    def frame_set(frame):
        def video(pixels):
            return SimpleNamespace(get_height=returns(camera.height), get_width=returns(camera.width), get_depth_scale=returns(0.5),
                                   get_data=returns(pixels.tobytes()), get_timestamp_us=returns(round(1e6 * frame.stamp)))
        return SimpleNamespace(get_color_frame=returns(video(frame.rgb)), get_depth_frame=returns(video(2 * millimeters(frame))))

    missing = SimpleNamespace(get_color_frame=returns(None), get_depth_frame=returns(None))
    sets = [None, missing, *map(frame_set, frames)]
    check(live, example.camera_of(profile, "kinect_v1"), recording, frames, example.frames_of(sets))
    distortion.k1, distortion.k4 = 0.3, 0.35
    assert example.camera_of(profile, "kinect_v1").distorted
    distortion.k6 = 50
    with pytest.raises(lens_models.LensError, match="brown_conrady_k6|BROWN_CONRADY_K6"):
        example.camera_of(profile, "kinect_v1")


def test_live_record3d(load, live, recording, frames, camera):
    example = load("live_record3d")
    current = []
    doubled = SimpleNamespace(fx=2 * camera.fx, fy=2 * camera.fy, tx=2 * camera.cx + 0.5, ty=2 * camera.cy + 0.5)
    stream = SimpleNamespace(get_rgb_frame=lambda: np.repeat(np.repeat(current[0].rgb, 2, 0), 2, 1),
                             get_depth_frame=lambda: current[0].depth[::2, ::2])

    def arrivals():
        yield None
        for frame in frames:
            current[:] = [frame]
            yield frame.stamp

    found = example.camera_of(doubled, (2 * camera.height, 2 * camera.width, 3))
    np.testing.assert_array_equal(found.matrix, camera.matrix)
    check(live, found, recording, frames, example.frames_of(stream, arrivals()))


@pytest.mark.parametrize("devices, connected", [([], True), (["phone"], False)])
def test_live_record3d_without_a_phone_says_so(load, tmp_path, monkeypatch, devices, connected):
    example = load("live_record3d")
    example.record3d.Record3DStream.get_connected_devices = returns(devices)
    example.record3d.Record3DStream.return_value.connect = returns(connected)
    monkeypatch.setattr(sys, "argv", ["live_record3d.py", str(tmp_path)])
    assert "start the USB streaming" in example.main()


def test_live_zed(load, live, recording, frames, camera):
    example = load("live_zed")
    codes = example.sl.ERROR_CODE
    current, states = [], iter([codes.CAMERA_NOT_DETECTED, *[codes.SUCCESS] * len(frames), codes.END_OF_SVOFILE_REACHED])
    source = iter(frames)

    def grab():
        state = next(states)
        if state == codes.SUCCESS:
            current[:] = [next(source)]
        return state

    def bgra():
        return np.dstack([current[0].rgb[:, :, ::-1], np.full(current[0].depth.shape, 255, np.uint8)])

    images = iter([SimpleNamespace(get_data=bgra), SimpleNamespace(get_data=lambda: np.where(current[0].depth, current[0].depth, np.nan))])
    example.sl.Mat = lambda: next(images)
    zed = SimpleNamespace(grab=grab, retrieve_image=returns(None), retrieve_measure=returns(None),
                          get_timestamp=lambda _: SimpleNamespace(get_nanoseconds=lambda: round(1e9 * current[0].stamp)))
    left = SimpleNamespace(fx=camera.fx, fy=camera.fy, cx=camera.cx, cy=camera.cy)
    calibration = SimpleNamespace(left_cam=left, get_camera_baseline=returns(0.12))
    found = example.camera_of(SimpleNamespace(calibration_parameters=calibration, fps=30,
                                              resolution=SimpleNamespace(width=camera.width, height=camera.height)))
    assert found.baseline == 0.12
    check(live, found, recording, frames, example.frames_of(zed))


def test_live_kinect(load, live, recording, frames, camera, monkeypatch):
    example = load("live_kinect")
    images = iter([(None, None), *(((f.rgb, 0), (millimeters(f), 0)) for f in frames)])
    current = []

    def video():
        current[:] = next(images)
        return current[0]

    example.freenect.sync_get_video, example.freenect.sync_get_depth = video, lambda format: current[1]
    stamps = iter([frame.stamp for frame in frames])
    monkeypatch.setattr(example, "time", SimpleNamespace(monotonic=lambda: next(stamps)))
    nominal = live.camera_of((camera.width, camera.height), camera.fx, camera.fy, camera.cx, camera.cy)
    check(live, nominal, recording, frames, example.frames_of(range(len(frames) + 1)))
