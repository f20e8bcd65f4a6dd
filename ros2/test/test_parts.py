# SPDX-License-Identifier: Apache-2.0
"""The parts of the node that need no other process: images, pairs, transforms, odometry."""
import array
import struct
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from builtin_interfaces.msg import Time
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Image
from stillmap_ros import images, mapper, messages, transforms
from stillmap_ros.changes import Changes
from stillmap_ros.node import ParameterError, value_of
from stillmap_ros.pairing import Pairing, Queue
from stillmap_ros.serialized import image_of

import stillmap

RNG = np.random.default_rng(1)
RGB = RNG.integers(0, 255, (6, 8, 3), np.uint8)
DEPTH = RNG.integers(1, 9000, (6, 8), np.uint16)


def image(encoding, pixels, big_endian=False, padding=8):
    """A message with rows of more bytes than their pixels have."""
    stored = pixels.astype(pixels.dtype.newbyteorder(">" if big_endian else "<"))
    rows = np.pad(stored.view(np.uint8).reshape(pixels.shape[0], -1), ((0, 0), (0, padding)))
    return SimpleNamespace(encoding=encoding, height=pixels.shape[0], width=pixels.shape[1], step=rows.shape[1],
                           data=rows.tobytes(), is_bigendian=big_endian)


def test_images_of_all_encodings():
    bgr, gray = np.ascontiguousarray(RGB[:, :, ::-1]), np.ascontiguousarray(RGB[:, :, 0])
    alpha = np.full((*gray.shape, 1), 255, np.uint8)
    colors = {"rgb8": RGB, "rgba8": np.dstack([RGB, alpha]), "bgr8": bgr, "bgra8": np.dstack([bgr, alpha]), "8UC3": bgr}
    for encoding, pixels in colors.items():
        np.testing.assert_array_equal(images.raw_pixels(image(encoding, pixels), images.COLOR), RGB)
    for encoding in ("mono8", "8UC1"):
        np.testing.assert_array_equal(images.raw_pixels(image(encoding, gray), images.COLOR), gray)
    depth = {"16UC1": DEPTH, "mono16": DEPTH, "32FC1": DEPTH.astype(np.float32) / 1000}
    for encoding, pixels in depth.items():
        for big_endian in (False, True):
            found = images.raw_pixels(image(encoding, pixels, big_endian), images.DEPTH)
            np.testing.assert_array_equal(found, pixels)
            assert found.dtype == pixels.dtype and found.dtype.isnative
    with pytest.raises(images.ImageError, match="'bayer_rggb8' are not read here\n  fix: give a topic with one of rgb8"):
        images.raw_pixels(image("bayer_rggb8", gray), images.COLOR)
    with pytest.raises(images.ImageError, match="'8UC1' are not read here\n  fix: give a topic with one of mono16, 16UC1, 32FC1"):
        images.raw_pixels(image("8UC1", gray), images.DEPTH)
    short = image("mono8", gray)
    short.data = short.data[:20]
    with pytest.raises(images.ImageError, match="8 x 6 pixels has 20 bytes"):
        images.raw_pixels(short, images.COLOR)


def test_raw_pixels_are_not_copied():
    message = image("rgb8", RGB)
    assert np.shares_memory(images.raw_pixels(message, images.COLOR), np.frombuffer(message.data, np.uint8))


@pytest.mark.parametrize("frame", ["", "a", "camera", "camera_optical"])
def test_fields_of_a_serialized_image(frame):
    sent = Image(height=6, width=8, encoding="16UC1", is_bigendian=0, step=16, data=DEPTH.tobytes())
    sent.header.frame_id, sent.header.stamp = frame, Time(sec=-3, nanosec=999999999)
    serialized = serialize_message(sent)
    read = image_of(serialized)
    for name in ("height", "width", "encoding", "is_bigendian", "step"):
        assert getattr(read, name) == getattr(sent, name), name
    assert (read.header.frame_id, images.nanoseconds(read.header.stamp)) == (frame, -2 * 10**9 - 1)
    pixels = images.raw_pixels(read, images.DEPTH)
    np.testing.assert_array_equal(pixels, DEPTH)
    assert np.shares_memory(pixels, np.frombuffer(serialized, np.uint8)) and pixels.flags.aligned


def test_values_of_parameters():
    assert value_of("a", 1, 0.5) == 1.0 and isinstance(value_of("a", 1, 0.5), float)
    assert value_of("a", array.array("q", [1, 2]), [0.0]) == [1.0, 2.0] and value_of("a", [], [""]) == []
    for value, default in ((1, True), (True, 0.5), (5, ""), ("soon", 0.5), (0.5, [0.5]), ([0.5], 0.5), (["a"], [0.5])):
        with pytest.raises(ParameterError, match="^a: is .*\n  fix: give "):
            value_of("a", value, default)


def rvl(pixels):
    """The bytes of an image in RVL, number by number."""
    nibbles, values, previous = [], [int(v) for v in pixels.ravel()], 0

    def put(number):
        while number > 7:
            nibbles.append(number & 7 | 8)
            number >>= 3
        nibbles.append(number)
    while values:
        zeros = next((i for i, v in enumerate(values) if v), len(values))
        others = next((i for i, v in enumerate(values[zeros:]) if not v), len(values) - zeros)
        put(zeros)
        put(others)
        for value in values[zeros:zeros + others]:
            difference, previous = value - previous, value
            put(2 * difference if difference >= 0 else -2 * difference - 1)
        values = values[zeros + others:]
    nibbles += [0] * (-len(nibbles) % 8)
    words = [sum(n << (28 - 4 * i) for i, n in enumerate(nibbles[k:k + 8])) for k in range(0, len(nibbles), 8)]
    return struct.pack("<II", pixels.shape[1], pixels.shape[0]) + struct.pack(f"<{len(words)}I", *words)


def test_compressed_images():
    png = cv2.imencode(".png", RGB[:, :, ::-1])[1].tobytes()
    np.testing.assert_array_equal(images.compressed_color(SimpleNamespace(data=png)), RGB)
    png = cv2.imencode(".png", DEPTH)[1].tobytes()
    message = SimpleNamespace(data=bytes(12) + png, format="16UC1; compressedDepth png")
    np.testing.assert_array_equal(images.compressed_depth(message), DEPTH)
    # 32FC1: inverse depth, quantized: a / z + b.
    a, b, z = 10000.0, -900.0, np.linspace(0.6, 8, 48, dtype=np.float32).reshape(6, 8)
    z[0, 0] = 0
    stored = np.where(z > 0, a / np.maximum(z, 0.1) + b, 0).astype(np.uint16)
    message.data = struct.pack("<iff", 0, a, b) + cv2.imencode(".png", stored)[1].tobytes()
    message.format = "32FC1; compressedDepth png"
    np.testing.assert_allclose(images.compressed_depth(message), z, rtol=1e-3)
    message.format = "16UC1; compressedDepth rvl"
    for pixels in (DEPTH, np.where(RNG.random((6, 8)) < 0.4, 0, DEPTH), np.zeros((6, 8), int), np.full((6, 8), 65535)):
        message.data = struct.pack("<iff", 1, 0, 0) + rvl(pixels)
        np.testing.assert_array_equal(images.compressed_depth(message), pixels)
    message.data = message.data[:-4]
    with pytest.raises(images.ImageError, match="ends early"):
        images.compressed_depth(message)
    with pytest.raises(images.ImageError, match="cannot be decoded"):
        images.compressed_color(SimpleNamespace(data=b"no image"))


def camera_info(**changes):
    k = np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]])
    p = np.hstack([np.diag([2.0, 2.0, 1.0]) @ k, np.zeros((3, 1))])
    return SimpleNamespace(**{"width": 640, "height": 480, "k": k.ravel(), "p": p.ravel(), "d": [],
                              "distortion_model": "plumb_bob"} | changes)


def test_cameras():
    found = images.camera_of(camera_info(d=[0.1, 0.2, 0, 0]), "realsense_d435i", False, "")
    assert found.fx == 600 and found.distorted and found.depth_factor == 1000
    rectified = images.camera_of(camera_info(d=[0.1, 0.2, 0, 0]), "kinect_v1", True, "")
    assert rectified.fx == 1200 and not rectified.distorted
    with pytest.raises(RuntimeError, match="image_proc"):
        images.camera_of(camera_info(d=[0.1] * 12), "kinect_v1", False, "")
    with pytest.raises(stillmap.Error, match="kinect_v0"):
        images.camera_of(camera_info(), "kinect_v0", False, "")
    with pytest.raises(images.ImageError, match="no focal length"):
        images.camera_of(camera_info(k=np.zeros(9)), "kinect_v1", False, "")


def test_a_stereo_pair_has_the_baseline_of_its_right_camera_info():
    p = np.array([[500.0, 0, 320, -60], [0, 500, 240, 0], [0, 0, 1, 0]])
    found = images.stereo_camera_of(camera_info(p=p.ravel()), "")
    assert (found.fx, found.cx) == (500, 320) and found.baseline == pytest.approx(0.12)
    with pytest.raises(images.ImageError, match="right camera"):
        images.stereo_camera_of(camera_info(), "")


def stamped(nanoseconds):
    return SimpleNamespace(header=SimpleNamespace(stamp=SimpleNamespace(sec=nanoseconds // 10**9,
                                                                        nanosec=nanoseconds % 10**9)))


def pairs(order, slop=0.02, lossless=False):
    """The stamps [ms] of the pairs of messages that arrive as (topic, stamp [ms]), and the number of those without one."""
    pairing = Pairing(2, slop, lossless)
    found = [tuple(images.nanoseconds(m.header.stamp) // 10**6 for m in complete)
             for topic, stamp in order for complete in pairing.add(topic, stamped(stamp * 10**6))]
    return found, pairing.unpaired


def test_messages_are_paired_with_the_nearest():
    assert pairs([(0, 0), (1, 0), (0, 33), (1, 33)]) == ([(0, 0), (33, 33)], 0)
    assert pairs([(1, 0), (1, 33), (0, 1), (0, 34), (1, 66)]) == ([(1, 0), (34, 33)], 0)
    assert pairs([(0, 0), (0, 33), (1, 30), (1, 63)]) == ([(33, 30)], 1), "too far apart"
    late = [(0, 33 * i) for i in range(20)] + [(1, 33 * i) for i in range(20)]
    assert len(pairs(late)[0]) == 20
    very_late = [(0, 33 * i) for i in range(60)] + [(1, 33 * i) for i in range(60)]
    assert len(pairs(very_late)[0]) == 30 and len(pairs(very_late, lossless=True)[0]) == 60


def test_a_clock_that_is_set_back_does_not_stop_the_pairs():
    assert pairs([(0, 90000), (1, 90000), (1, 90033), (0, 10), (1, 10), (0, 43), (1, 43)])[0][1:] == [(10, 10), (43, 43)]


def test_the_queue_keeps_the_newest_or_all():
    newest, every = Queue(False), Queue(True)
    for i in range(5):
        newest.put(i)
        every.put(i)
    assert newest.get(0) == 4 and newest.get(0) is None and newest.dropped == 4
    assert [every.get(0) for _ in range(5)] == list(range(5)) and every.dropped == 0


def random_motion():
    return transforms.matrix_of_rpy(*RNG.uniform(-2, 2, 3), *RNG.uniform(-1.5, 1.5, 3))


def test_rotations_become_quaternions_and_back():
    turns = [random_motion()[:3, :3] for _ in range(50)]
    turns += [np.diag(d) for d in ((1.0, 1, 1), (1.0, -1, -1), (-1.0, 1, -1), (-1.0, -1, 1))]
    for R in turns:
        np.testing.assert_allclose(transforms.matrix_of_quaternion(*transforms.quaternion_of(R)), R, atol=1e-12)


def test_transforms_are_found_through_the_tree_at_their_time():
    tree = transforms.FrameTree()
    T_base_link, T_link_optical = random_motion(), random_motion()
    tree.add([messages.transform_of(T_base_link, 0, "base_link", "camera_link"),
              messages.transform_of(T_link_optical, 0, "camera_link", "optical")], True)
    np.testing.assert_allclose(tree.lookup("base_link", "optical", 5), T_base_link @ T_link_optical, atol=1e-9)
    for i in range(3):
        T = np.eye(4)
        T[0, 3] = i
        tree.add([messages.transform_of(T, i * 10**8, "odom", "base_link")], False)
    found = tree.lookup("odom", "optical", 15 * 10**7)
    np.testing.assert_allclose(found[:3, 3] - (T_base_link @ T_link_optical)[:3, 3], [1.5, 0, 0], atol=1e-9)
    assert tree.lookup("odom", "optical", 5 * 10**8) is None, "too new"
    assert tree.lookup("odom", "wheel", 0) is None


def test_covariances_are_those_of_moved_poses():
    """Samples of errors in the camera's frame, against the covariance of the base about fixed axes."""
    T_base_camera, T_map_camera, sigma = random_motion(), random_motion(), 1e-3
    scales = sigma * np.array([1, 2, 3, 1, 2, 3])
    T_map_base = T_map_camera @ transforms.inverse(T_base_camera)
    errors = []
    for _ in range(4000):
        moved = T_map_camera @ mapper.moved(scales * RNG.standard_normal(6)) @ transforms.inverse(T_base_camera)
        turn = transforms.rotation_vector(moved[:3, :3] @ T_map_base[:3, :3].T)
        errors.append([*(moved[:3, 3] - T_map_base[:3, 3]), *turn])
    to_base = transforms.adjoint(T_base_camera)
    predicted = mapper.covariance_in(T_map_base, to_base @ np.diag(scales**2) @ to_base.T)
    predicted -= mapper.LEAST_VARIANCE * np.eye(6)
    sampled = np.cov(np.transpose(errors))
    assert np.abs(sampled - predicted).max() < 0.1 * np.abs(predicted).max()


def test_the_odometry_bridges_a_frame_and_not_a_second():
    odometry, step = mapper.Odometry(), np.eye(4)
    step[0, 3] = 0.01
    error = 1e-6 * np.eye(6)
    for i, known in enumerate((False, True, True, False, True)):
        odometry.add(i * 33 * 10**6, step if known else None, error)
    np.testing.assert_allclose(odometry.T_odom_base[0, 3], 0.04, atol=1e-9)
    odometry.add(3 * 10**9, None, error)
    np.testing.assert_allclose(odometry.T_odom_base[0, 3], 0.04, atol=1e-9)
    assert np.linalg.eigvalsh(odometry.covariance).min() > 0.5, "how far it went is unknown"


def test_changes_of_a_cloud():
    changes = Changes()
    first = np.array([[1, 2, 3], [4, 5, 6]], np.float32)
    added, removed = changes.update(first, np.array([7, 9], np.uint64))
    assert added.all() and len(removed) == 0
    added, removed = changes.update(first + 1, np.array([7, 8], np.uint64))
    assert added.tolist() == [False, True]
    np.testing.assert_array_equal(removed, first[1:])


@pytest.mark.parametrize("text", ["zones: [{name: room", "- 1", "zones: [{name: room, polygon: 5}]", "zone: 1"])
def test_rules_that_cannot_be_used_are_named(tmp_path, text):
    file = tmp_path / "zones.yaml"
    file.write_text(text)
    camera = stillmap.Camera(640, 480, 500, 500, 320, 240, depth_factor=1000)
    made = mapper.Mapper(camera, stillmap.Options(), np.eye(4), mapper.Odometry())
    with pytest.raises(ValueError, match=f"(?s)^{file}.*fix: "):
        made.watch(file)
