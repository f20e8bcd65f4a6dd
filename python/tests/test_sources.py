# SPDX-License-Identifier: Apache-2.0
"""The arguments of source()."""
import _thread
import shutil
import sqlite3
import struct
import threading

import numpy as np
import pytest

import stillmap


class Message:
    """Fields in the encoding CDR, little-endian."""
    def __init__(self):
        self.data = bytearray()

    def numbers(self, code, *values):
        size = struct.calcsize(code)
        for value in values:
            self.data += bytes(-len(self.data) % size) + struct.pack("<" + code, value)
        return self

    def text(self, text):
        self.numbers("I", len(text) + 1).data += text.encode() + b"\0"
        return self

    def header(self, stamp):
        return self.numbers("I", int(stamp), round(stamp % 1 * 1e9)).text("color")

    def image(self, stamp, encoding, pixels):
        self.header(stamp).numbers("I", *pixels.shape[:2]).text(encoding).numbers("B", 0)
        self.numbers("I", pixels.strides[0], pixels.nbytes).data += pixels.tobytes()
        return self

    def camera_info(self, camera):
        k, p = camera.matrix, np.hstack([camera.matrix, np.zeros((3, 1))])
        self.header(1).numbers("I", camera.height, camera.width).text("plumb_bob").numbers("I", 0)
        self.numbers("d", *k.ravel(), *np.eye(3).ravel(), *p.ravel()).numbers("I", *[0] * 6).numbers("B", 0)
        return self


def write_recording(file, camera, frames):
    """A file of rosbag2 with two color topics; the images of the second one are upside down."""
    messages = [("/a/camera_info", "CameraInfo", Message().camera_info(camera)),
                ("/b/camera_info", "CameraInfo", Message().camera_info(camera))]
    for frame in frames:
        rgb = np.ascontiguousarray(frame.rgb)
        messages += [("/a/image_raw", "Image", Message().image(frame.stamp, "rgb8", rgb)),
                     ("/b/image_raw", "Image", Message().image(frame.stamp, "rgb8", rgb[::-1].copy())),
                     ("/depth/image_raw", "Image", Message().image(frame.stamp, "32FC1", frame.depth))]
    with sqlite3.connect(file) as database:
        database.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, "
                         "offered_qos_profiles TEXT)")
        database.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        ids = {}
        for time, (name, kind, message) in enumerate(messages):
            if name not in ids:
                ids[name] = len(ids) + 1
                database.execute("INSERT INTO topics VALUES(?, ?, ?, 'cdr', '')",
                                 (ids[name], name, "sensor_msgs/msg/" + kind))
            data = b"\0\1\0\0" + bytes(message.data)
            database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", (ids[name], time, data))
    database.close()


def test_topics_chooses_the_images_of_a_recorded_file(frames, camera, tmp_path):
    file = tmp_path / "two.db3"
    write_recording(file, camera, frames[:3])
    topics = ("/b/image_raw", "/depth/image_raw")
    chosen = stillmap.source(file, topics=",".join(topics))
    np.testing.assert_array_equal(next(stillmap.source(file, topics=topics)).rgb, frames[0].rgb[::-1])
    assert any("/b/image_raw" in note for note in chosen.notes)
    for frame, flipped in zip(frames, chosen):
        np.testing.assert_array_equal(flipped.rgb, frame.rgb[::-1])
        np.testing.assert_allclose(flipped.stamp, frame.stamp, atol=1e-9)
    np.testing.assert_array_equal(next(stillmap.source(file)).rgb, frames[0].rgb)
    with pytest.raises(stillmap.Error, match="did you mean '/depth/image_raw'"):
        stillmap.source(file, topics="/b/image_raw,/depth/image_row")


def test_ignored_pixels_have_no_depth(recording):
    image = max((recording / "mask").glob("*.png"), key=lambda file: file.stat().st_size)
    camera = stillmap.Camera.read(str(recording / "camera.yaml"))
    camera.ignore = str(image)
    whole, ignored, of_camera = (next(stillmap.source(recording, **arguments)).depth
                                 for arguments in ({}, {"ignore": image}, {"camera": camera}))
    assert 0 < np.count_nonzero(ignored) < np.count_nonzero(whole)
    np.testing.assert_array_equal(ignored, of_camera)


def test_fps_is_the_rate_of_images_with_numbers(recording, tmp_path):
    for kind in ("rgb", "depth"):
        (tmp_path / kind).mkdir()
        for number, file in enumerate(sorted((recording / kind).iterdir())):
            shutil.copy(file, tmp_path / kind / f"{number}.png")
    source = stillmap.source(tmp_path, camera=recording / "camera.yaml", fps=10)
    np.testing.assert_allclose([frame.stamp for frame in source][:3], [0, 0.1, 0.2], atol=1e-9)
    with pytest.raises(stillmap.Error, match="frame rate"):
        stillmap.source(tmp_path, camera=recording / "camera.yaml", fps=0)


def test_a_camera_replaces_that_of_the_recording(recording, frames, camera):
    other = stillmap.Camera(camera.width, camera.height, 300, 301, 160, 120, depth_factor=2 * camera.depth_factor)
    source = stillmap.source(recording, camera=other)
    np.testing.assert_array_equal(source.camera.matrix, other.matrix)
    np.testing.assert_allclose(next(source).depth, frames[0].depth / 2, rtol=1e-6)


@pytest.mark.parametrize("arguments, words", [
    ({"topic": "a,b"}, "there is no argument 'topic'"),
    ({"topics": ("a", 5)}, "topics is of the type tuple of 2 values: 'COLOR,DEPTH' or a list of both names"),
    ({"camera": 5}, "camera is of the type int: a Camera, or the name of a preset or file"),
    ({"fps": "fast"}, "fps is of the type str"),
    ({"follow": "yes"}, "follow is of the type str: True, False or a time"),
])
def test_a_wrong_argument_is_an_error_in_words(recording, arguments, words):
    with pytest.raises(stillmap.Error, match=words):
        stillmap.source(recording, **arguments)
    with pytest.raises(stillmap.Error, match="text is missing"):
        stillmap.source()


@pytest.fixture(name="growing")
def fixture_growing(recording, tmp_path):
    """A copy of the recording with the first ten images, and a function that adds the others."""
    folder = tmp_path / "growing"
    shutil.copytree(recording, folder)
    lists = {name: (recording / name).read_text().splitlines(keepends=True) for name in ("rgb.txt", "depth.txt")}

    def write(count):
        for name, lines in lists.items():
            images = [line for line in lines if not line.startswith("#")]
            (folder / name).write_text("".join(images[:count]))
    write(10)
    return folder, lambda: write(None)


def test_follow_waits_for_the_images_of_a_folder_that_grows(frames, growing):
    folder, grow = growing
    source = stillmap.source(folder, follow=60, count=len(frames))
    with pytest.raises(TypeError):
        len(source)
    first = [next(source) for _ in range(5)]
    grow()
    stamps = [frame.stamp for frame in [*first, *source]]
    assert stamps == [frame.stamp for frame in frames]


def test_ctrl_c_ends_the_wait_for_images(growing):
    source = stillmap.source(growing[0], follow=60)
    timer = threading.Timer(0.5, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        for _ in source:
            source.skipped  # the wait does not hold what other calls need
    timer.join()


def test_a_live_camera_needs_its_library():
    with pytest.raises(stillmap.Error, match="realsense:"):
        stillmap.source("realsense:")
