# SPDX-License-Identifier: Apache-2.0
"""Arrays, options and cameras that cannot be used, and unusual ones that can."""
import datetime

import numpy as np
import pytest

import stillmap

WIDTH, HEIGHT = 64, 48
RANDOM = np.random.default_rng(1)
RGB = RANDOM.integers(0, 255, (HEIGHT, WIDTH, 3), dtype=np.uint8)
DEPTH = np.full((HEIGHT, WIDTH), 2, np.float32)
MASK = np.zeros((HEIGHT, WIDTH), np.uint8)


@pytest.fixture
def small():
    return stillmap.Camera(WIDTH, HEIGHT, 60, 60, 31.5, 23.5, depth_factor=1000)


@pytest.fixture
def system(small):
    return stillmap.Slam(small, dense={"enabled": False}, movers={"enabled": False})


@pytest.mark.parametrize("rgb, depth, words", [
    (RGB.astype(np.float32), DEPTH, "rgb is of type float32: uint8 is expected"),
    (RGB.astype(np.uint16), DEPTH, "rgb is of type uint16"),
    (RGB[:, :, :2], DEPTH, r"rgb has the shape \(48, 64, 2\)"),
    (RGB[None], DEPTH, r"rgb has the shape \(1, 48, 64, 3\)"),
    (RGB[:-1], DEPTH, "48"),
    (RGB[:0], DEPTH, r"rgb has the shape \(0, 64, 3\)"),
    (RGB.tolist(), DEPTH, "rgb is a list: a NumPy array is expected"),
    (None, DEPTH, "rgb is a NoneType"),
    (RGB, DEPTH.astype(np.float64), "depth is of type float64: float32"),
    (RGB, DEPTH.astype(np.int32), "depth is of type int32"),
    (RGB, DEPTH.astype(">f4"), "depth is of type >f4"),
    (RGB, DEPTH[:, :, None], r"depth has the shape \(48, 64, 1\)"),
    (RGB, DEPTH[:, ::2], "depth image"),
    (RGB, DEPTH * 1000, "the median of the depth image is 2000 m"),
])
def test_an_unusable_image_is_an_error_that_names_it(system, rgb, depth, words):
    with pytest.raises(stillmap.Error, match=words):
        system.push(rgb, depth, 0.0)


@pytest.mark.parametrize("kind", ["int32", "int16", "uint8", ">u2"])
def test_whole_numbers_of_depth_are_raw_units(system, kind):
    raw = (DEPTH * 1000).astype(kind)
    with pytest.raises(stillmap.Error, match=f"depth is of type {kind}:") as caught:
        system.push(RGB, raw, 0.0)
    assert "raw units with depth.astype(numpy.uint16)" in caught.value.fix
    if kind != "uint8":
        system.push(RGB, raw.astype(np.uint16), 0.0)
    with pytest.raises(stillmap.Error) as caught:
        system.push(RGB, DEPTH.astype(np.float64), 0.0)
    assert caught.value.fix == "convert meters with depth.astype(numpy.float32)"


@pytest.mark.parametrize("change", [
    np.asfortranarray,
    lambda array: np.flipud(np.flipud(array).copy()),
    lambda array: np.fliplr(np.fliplr(array).copy()),
    lambda array: np.repeat(array, 2, axis=0)[::2],
    lambda array: np.repeat(array, 2, axis=1)[:, ::2],
    lambda array: np.lib.stride_tricks.as_strided(array, writeable=False),
])
def test_equal_arrays_of_any_strides_give_equal_frames(small, change):
    def keypoints(rgb, depth):
        slam = stillmap.Slam(small, dense={"enabled": False}, movers={"enabled": False})
        slam.push(rgb, depth, 0.0)
        slam.push(rgb, depth, 1 / 30)
        return slam.snapshot().landmarks
    np.testing.assert_array_equal(keypoints(change(RGB), change(DEPTH)), keypoints(RGB, DEPTH))


def test_an_array_at_an_odd_address_is_read(small, system):
    memory = bytes(1) + DEPTH.tobytes()
    depth = np.ndarray(DEPTH.shape, DEPTH.dtype, memory, offset=1)
    assert not depth.flags.aligned
    system.push(RGB, depth, 0.0)


def test_read_only_arrays_are_accepted_and_no_array_is_written_to(system):
    rgb, depth = RGB.copy(), DEPTH.copy()
    rgb.flags.writeable = depth.flags.writeable = False
    system.push(rgb, depth, 0.0)
    np.testing.assert_array_equal(rgb, RGB)


def test_arrays_may_be_reused_after_the_call(camera, frames):
    def landmarks(reuse):
        slam = stillmap.Slam(camera, dense={"enabled": False}, movers={"enabled": False})
        rgb, depth = np.empty_like(frames[0].rgb, order="C"), np.empty_like(frames[0].depth)
        for frame in frames[:5]:
            rgb[:], depth[:] = frame.rgb, frame.depth
            slam.push(rgb, depth, frame.stamp)
            if reuse:
                rgb[:], depth[:] = 0, 0
        return slam.finish().trajectory
    np.testing.assert_array_equal(landmarks(True), landmarks(False))


def test_depth_that_is_not_a_number_is_unknown(small):
    def landmarks(unknown):
        slam = stillmap.Slam(small, dense={"enabled": False}, movers={"enabled": False})
        depth = DEPTH.copy()
        depth[10:30, 10:40] = unknown
        slam.push(RGB, depth, 0.0)
        slam.push(RGB, depth, 1 / 30)
        return slam.snapshot().landmarks
    for unknown in (np.nan, np.inf, -np.inf, -1):
        np.testing.assert_array_equal(landmarks(unknown), landmarks(0))


def test_gray_images_are_accepted(system):
    system.push(RGB[:, :, 0].copy(), DEPTH, 0.0)


def test_a_pixel_of_a_frame_is_red_green_blue(frames):
    image = pytest.importorskip("PIL.Image", reason="skipped: Pillow is missing")
    frame = frames[0]
    assert frame.rgb.shape == frame.depth.shape + (3,)
    assert not frame.rgb.flags.writeable
    gray = frame.rgb.astype(float) @ [0.299, 0.587, 0.114]
    assert np.abs(gray - frame.gray).max() < 1.5
    image.fromarray(np.ascontiguousarray(frame.rgb))


@pytest.mark.parametrize("stamp, words", [(np.nan, "not finite"), (-1.0, "timestamp")])
def test_stamps_rise_and_are_finite(system, stamp, words):
    system.push(RGB, DEPTH, 0.0)
    with pytest.raises(stillmap.Error, match=words):
        system.push(RGB, DEPTH, stamp)


@pytest.mark.parametrize("stamp, words", [
    (1700000000000000000, "seconds are expected\n  fix: divide nanoseconds by 1e9"),
    (1.7e12, "divide nanoseconds"),
    (np.datetime64("2026-01-01T00:00:00.000000000"), "divide nanoseconds"),
    (datetime.datetime(2026, 1, 1), r"stamp is of the type datetime: the time .* in seconds is expected\n.*stamp.timestamp\(\)"),
    ("1.5", "stamp is of the type str"),
    (None, "stamp is of the type None"),
])
def test_a_stamp_is_a_number_of_seconds(system, stamp, words):
    with pytest.raises(stillmap.Error, match=words):
        system.push(RGB, DEPTH, stamp)


@pytest.mark.parametrize("stamp", [1700000000, 1.7e9, np.float32(2), np.int64(3), np.array(4.0)])
def test_a_stamp_may_be_any_kind_of_number(system, stamp):
    system.push(RGB, DEPTH, stamp)
    assert system.snapshot().newest.stamp == float(stamp)


@pytest.mark.parametrize("call, words", [
    (lambda slam: slam.push(RGB, DEPTH), "stamp is missing: the time of the color image in seconds is expected"),
    (lambda slam: slam.push(RGB), "depth is missing"),
    (lambda slam: slam.push(), "rgb is missing"),
    (lambda slam: slam.push(RGB, DEPTH, timestamp=1.0), "there is no argument 'timestamp'"),
    (lambda slam: slam.push(RGB, DEPTH, 0.0, MASK, 3), "5 arguments without a keyword: 4 are expected"),
    (lambda slam: slam.push(RGB, DEPTH, 0.0, rgb=RGB), "'rgb' is given twice"),
    (lambda slam: slam.push(frame=RGB), r"frame is of the type ndarray of 48 values: a Frame of a source is expected"),
])
def test_a_wrong_call_of_push_is_an_error_in_words(system, call, words):
    with pytest.raises(stillmap.Error, match=words) as caught:
        call(system)
    assert caught.value.where == "push" and "push(rgb, depth, stamp)" in caught.value.fix
    assert len(str(caught.value)) < 300  # no values of arrays


def test_a_frame_without_depth_has_unknown_depth(small, frames, camera):
    def trajectory(without):
        slam = stillmap.Slam(camera, dense={"enabled": False}, movers={"enabled": False})
        for frame in frames:
            slam.push(frame.rgb, without if frame.index % 3 == 2 else frame.depth, frame.stamp)
        return slam.finish().trajectory
    tracked = trajectory(None)
    assert len(tracked) == len(frames)
    np.testing.assert_array_equal(tracked, trajectory(np.zeros_like(frames[0].depth)))
    assert stillmap.Slam(small).push(RGB, None, 0.0).state == "no map"  # There is no map without depth.


def test_a_mask_needs_a_system_that_expects_masks(small, system):
    with pytest.raises(stillmap.Error, match="masks=True"):
        system.push(RGB, DEPTH, 0.0, MASK)
    masked = stillmap.Slam(small, masks=True, dense={"enabled": False})
    masked.push(RGB, DEPTH, 0.0, MASK)
    masked.push(RGB, DEPTH, 0.1, MASK > 0)
    masked.push(RGB, DEPTH, 0.2)
    for mask, words in ((MASK[1:], "another size"), (MASK.astype(np.int64), "mask is of type int64")):
        with pytest.raises(stillmap.Error, match=words):
            masked.push(RGB, DEPTH, 0.3, mask)
    with pytest.raises(stillmap.Error, match="network.masks"):
        stillmap.Slam(small, {"network.masks": "folder"}, masks=True)


def test_options_are_those_of_the_command(small):
    options = stillmap.Options({"features.keypoints": 500, "motion.cues": ["residual", "history"]},
                               dense={"enabled": False, "voxel": 0.02})
    assert "keypoints: 500" in str(options)
    assert "voxel: 0.02" in str(options)
    assert "cues: [residual, history]" in str(options)
    options["features.keypoints"] = 600
    assert "keypoints: 600" in str(options)
    assert stillmap.Options(preset="orb-rgbd").preset == "orb-rgbd"
    assert "orb-rgbd" in stillmap.presets()
    stillmap.Slam(small, options)


@pytest.mark.parametrize("values, words", [
    ({"features.keypoint": 500}, "did you mean 'keypoints'"),
    ({"features.keypoints": 5}, "from 50 to 10000"),
    ({"features.keypoints": "many"}, "whole number"),
    ({"dense": {"enable": True}}, "did you mean 'enabled'"),
    ({"densee": {"enabled": False}}, "did you mean 'dense.enabled'"),
    ({"outputs.mesh_voxel": 0.01}, "outputs.mesh_voxel has no effect.*\n.*stillmap dense"),
    ({"outputs": {"mesh_voxels": 0.01}}, "did you mean 'mesh_voxel'"),
    ({"schedule.mode": "sometimes"}, "lockstep, realtime"),
])
def test_a_bad_option_is_the_error_of_the_command(small, values, words):
    with pytest.raises(stillmap.Error, match=words):
        stillmap.Slam(small, values)


def test_options_of_another_kind_are_errors(small):
    with pytest.raises(stillmap.Error, match="give a dict"):
        stillmap.Slam(small, ["fused"])
    with pytest.raises(stillmap.Error, match="both options and a preset"):
        stillmap.Slam(small, stillmap.Options(), preset="static")
    with pytest.raises(stillmap.Error, match="presett"):
        stillmap.Slam(small, preset="presett")


def test_a_camera_is_read_by_its_name_or_path(tmp_path):
    assert stillmap.Camera.read("tum_fr3").width == 640
    with pytest.raises(stillmap.Error, match="none.yaml"):
        stillmap.Camera.read(tmp_path / "none.yaml")


def test_finish_returns_the_same_results_again(system):
    """As after a Ctrl-C during finish(), which Python raises when the call returns."""
    system.push(RGB, DEPTH, 0.0)
    results = system.finish()
    assert system.finish() is results
    assert system.movers == []


def test_cameras_have_the_checks_of_camera_files(recording):
    read = stillmap.Camera.read(recording / "camera.yaml")
    assert (read.width, read.height) == (320, 240)
    np.testing.assert_array_equal(read.matrix, [[read.fx, 0, read.cx], [0, read.fy, read.cy], [0, 0, 1]])
    with pytest.raises(stillmap.Error, match="fx"):
        stillmap.Slam(stillmap.Camera(WIDTH, HEIGHT, -1, 60, 31.5, 23.5, depth_factor=1000))
    with pytest.raises(stillmap.Error, match="kinect_v1"):
        stillmap.Camera(WIDTH, HEIGHT, 60, 60, 31.5, 23.5, depth_factor=1000, sensor="kinect_v0")
    with pytest.raises(stillmap.Error, match="tum_fr9"):
        stillmap.Slam("tum_fr9")


@pytest.mark.parametrize("changes, words", [
    ({"depth_factor": None}, "depth_factor is of the type None: the number of raw depth units per meter"),
    ({"distortion": [0.1] * 8}, "distortion is of the type list of 8 values: a list of k1 k2 p1 p2 k3 .*\n  fix: rectify"),
    ({"depthfactor": 1000}, "there is no argument 'depthfactor'"),
    ({"width": 64.5}, "width is of the type float: a whole number"),
])
def test_a_wrong_argument_of_a_camera_is_an_error_in_words(changes, words):
    values = {"width": WIDTH, "height": HEIGHT, "fx": 60, "fy": 60, "cx": 31.5, "cy": 23.5, "depth_factor": 1000}
    with pytest.raises(stillmap.Error, match=words):
        stillmap.Camera(**(values | changes))


def test_a_camera_needs_the_unit_of_depth():
    with pytest.raises(stillmap.Error, match="depth_factor is missing.*\n.*1000 for depth in millimeters"):
        stillmap.Camera(WIDTH, HEIGHT, 60, 60, 31.5, 23.5)
    assert stillmap.Camera(WIDTH, HEIGHT, 60, 60, 31.5, 23.5, depth_factor=1000, distortion=np.full(5, 0.1)).distorted


@pytest.mark.parametrize("words, call", [
    ("camera is missing", lambda camera: stillmap.Slam()),
    ("camera is of the type int: a Camera, or the name of a preset or file", lambda camera: stillmap.Slam(5)),
    ("3 arguments without a keyword: 2 are expected", lambda camera: stillmap.Slam(camera, {}, "fused")),
    ("preset is of the type int", lambda camera: stillmap.Slam(camera, preset=5)),
    ("masks is of the type str: True or False", lambda camera: stillmap.Slam(camera, masks="all")),
])
def test_a_wrong_argument_of_a_system_is_an_error_in_words(small, words, call):
    with pytest.raises(stillmap.Error, match=words):
        call(small)
