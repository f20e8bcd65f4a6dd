#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Inputs of first-time users: one rendered recording in many formats and layouts, mapped by the installed command.

Each must be mapped like the original: all frames, exit code 0, no warning about the result, and an error within 10 mm.

  apps/first_day_test.py PROGRAM     PROGRAM: the built command
"""
import codecs
import json
import random
import shutil
import sqlite3
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib
from pathlib import Path

PROGRAM = ""
FRAMES, WIDTH, HEIGHT = 20, 320, 240
FACTOR = 5000  # depth units per meter


def stillmap(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, check=False)


# ------------------------------------------------------------------------------------------------ PNG

def png_file(rows, bits, color):
    """A PNG of these rows of bytes; color: 0 gray, 2 RGB."""
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    header = struct.pack(">IIBBBBB", WIDTH, len(rows), bits, color, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"".join(b"\0" + row for row in rows))) + chunk(b"IEND", b"")


def png_rows(file):
    """The rows of bytes of a PNG without palette and interlacing."""
    data, at, stored = Path(file).read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, bits, color = struct.unpack(">IIBB", body[:10])
        if kind == b"IDAT":
            stored += body
        at += 12 + length
    channels = {0: 1, 2: 3, 6: 4}[color]
    pixel = channels * bits // 8
    raw, row_bytes, rows = zlib.decompress(stored), width * pixel, []
    previous = bytearray(row_bytes)
    for y in range(height):
        kind, row = raw[y * (row_bytes + 1)], bytearray(raw[y * (row_bytes + 1) + 1:(y + 1) * (row_bytes + 1)])
        for x in range(row_bytes):
            left, up = row[x - pixel] if x >= pixel else 0, previous[x]
            corner = previous[x - pixel] if x >= pixel else 0
            guess = left + up - corner
            paeth = min((left, up, corner), key=lambda value: abs(guess - value))
            row[x] = (row[x] + (0, left, up, (left + up) // 2, paeth)[kind]) & 255
        rows.append(bytes(row))
        previous = row
    return rows


def in_millimeters(row):
    return [round(value * 1000 / FACTOR) for value in struct.unpack(f">{WIDTH}H", row)]


def depth_file(file):
    """A depth image as PNG of 16 bits in millimeters."""
    return png_file([struct.pack(f">{WIDTH}H", *in_millimeters(row)) for row in png_rows(file)], 16, 0)


# ------------------------------------------------------------------------------------------------ messages of ROS 2

class Message:
    """The fields of a message in CDR, little-endian."""

    def __init__(self, timestamp, frame):
        self.data = bytearray()
        self.numbers("II", int(timestamp), round((timestamp % 1) * 1e9)).text(frame)

    def numbers(self, kinds, *values):
        for kind, value in zip(kinds, values):
            self.data += bytes(-len(self.data) % struct.calcsize(kind)) + struct.pack("<" + kind, value)
        return self

    def text(self, text):
        return self.bytes(text.encode() + b"\0")

    def bytes(self, data):
        self.numbers("I", len(data)).data += data
        return self

    def encoded(self):
        return b"\0\1\0\0" + bytes(self.data)


def pixels_message(timestamp, frame, encoding, rows):
    return Message(timestamp, frame).numbers("II", len(rows), WIDTH).text(encoding).numbers("BI", 0, len(rows[0])).bytes(b"".join(rows)).encoded()


def color_image(timestamp, frame, file):
    return pixels_message(timestamp, frame, "rgb8", png_rows(file))


def depth_image(timestamp, frame, file):
    return pixels_message(timestamp, frame, "16UC1", [struct.pack(f"<{WIDTH}H", *in_millimeters(row)) for row in png_rows(file)])


def depth_png(timestamp, frame, file):
    """A CompressedImage as an ordinary PNG of 16 bits."""
    return Message(timestamp, frame).text("png").bytes(depth_file(file)).encoded()


def camera_info(timestamp, frame, camera, size=(WIDTH, HEIGHT), with_k=True, binning=0):
    fx, fy, cx, cy = camera
    K = [fx, 0, cx, 0, fy, cy, 0, 0, 1]
    P = [fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0]
    message = Message(timestamp, frame).numbers("II", size[1], size[0]).text("plumb_bob").numbers("I", 5).numbers("d" * 5, *[0.0] * 5)
    message.numbers("d" * 9, *(K if with_k else [0.0] * 9)).numbers("d" * 9, 1, 0, 0, 0, 1, 0, 0, 0, 1).numbers("d" * 12, *P)
    return message.numbers("IIIIIIB", binning, binning, 0, 0, 0, 0, 0).encoded()


def write_bag(folder, topics):
    """Writes a bag of rosbag2 with SQLite. topics: name -> (type, [(timestamp, message)])"""
    folder.mkdir()
    with sqlite3.connect(folder / "bag_0.db3") as file:
        file.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, offered_qos_profiles TEXT)")
        file.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        rows = []
        for number, (name, (kind, messages)) in enumerate(topics.items(), 1):
            file.execute("INSERT INTO topics VALUES(?, ?, ?, 'cdr', '')", (number, name, "sensor_msgs/msg/" + kind))
            rows += [(round(timestamp * 1e9), number, data) for timestamp, data in messages]
        rows.sort(key=lambda row: row[0])
        file.executemany("INSERT INTO messages(timestamp, topic_id, data) VALUES(?, ?, ?)", rows)
    file.close()


# ------------------------------------------------------------------------------------------------ the test

class FirstDay(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        cls.original = cls.folder / "original"
        made = stillmap("simulate", "--people", 0, "--frames", FRAMES, "--width", WIDTH, "--height", HEIGHT, "--out", cls.original)
        assert made.returncode == 0, made.stderr
        cls.color, cls.depth = cls.listed("rgb.txt"), cls.listed("depth.txt")
        values = dict(line.split("#")[0].split(":") for line in (cls.original / "camera.yaml").read_text().splitlines() if ":" in line)
        cls.camera = [float(values[key]) for key in ("fx", "fy", "cx", "cy")]

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def listed(cls, name):
        rows = [line.split() for line in (cls.original / name).read_text().splitlines() if not line.startswith("#")]
        return [(float(timestamp), cls.original / file) for timestamp, file in rows]

    def copy(self, lists=False):
        """A copy of the images and the camera, with `lists` also of the lists, in a folder named after the test."""
        copy = self.folder / self.id().split(".")[-1]
        for name in ("rgb", "depth"):
            shutil.copytree(self.original / name, copy / name)
        for name in ("camera.yaml", *(("rgb.txt", "depth.txt") if lists else ())):
            shutil.copy(self.original / name, copy)
        return copy

    def is_mapped(self, recording, *options):
        out = self.folder / (self.id().split(".")[-1] + "_run")
        done = stillmap("run", recording, *options, "--set", "dense.enabled=false", "--truth", self.original / "groundtruth.txt", "--out", out)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        summary = json.loads((out / "summary.json").read_text())
        self.assertEqual([f for f in summary["findings"] if f["severity"] == "untrusted"], [])
        self.assertEqual((summary["frames"]["total"], summary["frames"]["tracked"]), (FRAMES, FRAMES), done.stdout + done.stderr)
        self.assertLess(summary["evaluation"]["ate"]["translation_m"]["rmse"], 0.01)
        return done.stdout + done.stderr

    def test_the_original(self):
        self.is_mapped(self.original)

    # -------------------------------------------------------------------------------------------- folders

    def test_a_folder_copied_from_a_mac(self):
        copy = self.copy()
        for folder in ("rgb", "depth"):
            (copy / folder / ".DS_Store").write_bytes(b"\0\0\0\1Bud1")
            for file in list((copy / folder).glob("*.png")):
                file.with_name("._" + file.name).write_bytes(b"\0\5\x16\7Mac OS X")
        self.is_mapped(copy)

    def test_a_truth_that_cannot_be_read_is_told_and_left_out(self):
        copy = self.copy(lists=True)
        (copy / "groundtruth.txt").write_text("1,5 0,2 0,1\n")
        out = self.folder / "unreadable_truth_run"
        done = stillmap("run", copy, "--set", "dense.enabled=false", "--out", out)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("the ground truth cannot be read", done.stderr)
        self.assertEqual(json.loads((out / "summary.json").read_text())["frames"]["tracked"], FRAMES)
        named = stillmap("run", copy, "--truth", copy / "groundtruth.txt", "--out", self.folder / "named_truth_run")
        self.assertEqual(named.returncode, 1, named.stdout + named.stderr)

    def test_names_with_a_date(self):
        copy = self.copy()
        for folder in ("rgb", "depth"):
            for i, file in enumerate(sorted((copy / folder).glob("*.png"), key=lambda f: float(f.stem))):
                milliseconds = round(1000 * i / 30)
                file.rename(file.with_name(f"IMG_20240517_1230{milliseconds // 1000:02d}{milliseconds % 1000:03d}.png"))
        done = stillmap("run", copy, "--set", "dense.enabled=false", "--out", self.folder / "dated_run")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn(f"{FRAMES} of {FRAMES} frames tracked", done.stdout)

    def test_names_in_capitals(self):
        copy = self.copy()
        for file in [*(copy / "rgb").iterdir(), *(copy / "depth").iterdir()]:
            file.rename(file.with_suffix(".PNG"))
        self.is_mapped(copy)

    def rewrite_lists(self, copy, entry, encode=str.encode):
        """Writes both lists again; entry: path in the folder -> path in the list."""
        for name, images in (("rgb.txt", self.color), ("depth.txt", self.depth)):
            text = "".join(f"{timestamp:.6f} {entry(file.relative_to(self.original))}\n" for timestamp, file in images)
            (copy / name).write_bytes(encode(text))

    def test_lists_with_the_paths_of_another_computer(self):
        copy = self.copy()
        self.rewrite_lists(copy, lambda file: f"/home/someone/recordings/desk/{file}")
        self.is_mapped(copy)

    def test_lists_of_windows(self):
        copy = self.copy()
        self.rewrite_lists(copy, lambda file: str(file).replace("/", "\\"), lambda text: text.replace("\n", "\r\n").encode())
        self.is_mapped(copy)

    def test_lists_with_a_byte_order_mark(self):
        copy = self.copy()
        self.rewrite_lists(copy, str, lambda text: codecs.BOM_UTF8 + text.encode())
        self.is_mapped(copy)

    def test_associations_of_the_benchmarks_own_script(self):
        copy = self.copy()
        truth = [line for line in (self.original / "groundtruth.txt").read_text().splitlines() if not line.startswith("#")]
        rows = [f"{pose} {depth[0]:.6f} depth/{depth[1].name} {color[0]:.6f} rgb/{color[1].name}"
                for pose, depth, color in zip(truth, self.depth, self.color)]
        (copy / "associations.txt").write_text("\n".join(rows) + "\n")
        self.is_mapped(copy)

    def test_lists_in_utf_16_with_blanks_in_the_names(self):
        copy = self.copy()
        for file in [*(copy / "rgb").iterdir(), *(copy / "depth").iterdir()]:
            file.rename(file.with_name("my image " + file.name))
        self.rewrite_lists(copy, lambda file: f"{file.parent}/my image {file.name}", lambda text: codecs.BOM_UTF16_LE + text.encode("utf-16-le"))
        self.is_mapped(copy)

    def test_masks_named_as_the_images_by_numbers(self):
        copy = self.copy()
        (copy / "mask").mkdir()
        for number, ((_, color), (_, depth)) in enumerate(zip(self.color, self.depth)):
            (copy / "rgb" / color.name).rename(copy / f"rgb/{number:06}.png")
            (copy / "depth" / depth.name).rename(copy / f"depth/{number:06}.png")
            (copy / f"mask/{number:06}.png").write_bytes(png_file([bytes(WIDTH)] * HEIGHT, 8, 0))
        self.is_mapped(copy, "--preset", "seg-mask", "--masks", copy / "mask")
        summary = self.folder / "test_masks_named_as_the_images_by_numbers_run/summary.json"
        self.assertIsNone(json.loads(summary.read_text())["frames_without_masks"])

    def test_a_camera_that_was_mounted_on_its_side(self):
        turned = self.folder / "turned"
        done = stillmap("record", self.original, turned, "--rotate", 270)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(struct.unpack(">II", next((turned / "rgb").iterdir()).read_bytes()[16:24]), (HEIGHT, WIDTH))
        self.is_mapped(turned, "--rotate", 90)

    def test_a_robot_that_is_always_in_view(self):
        """--ignore excludes a pattern that fills the lower left quarter of all images."""
        copy = self.copy(lists=True)
        wide, high = WIDTH // 2, HEIGHT // 2
        pattern = [bytes(random.Random(y // 4 * 1000 + x // 4).randrange(256) for x in range(wide) for _ in range(3)) for y in range(high)]
        for _, file in self.color:
            rows = png_rows(file)
            rows[high:] = [pattern[y] + row[3 * wide:] for y, row in enumerate(rows[high:])]
            (copy / "rgb" / file.name).write_bytes(png_file(rows, 8, 2))
        ignored = [bytes(WIDTH)] * high + [b"\xff" * wide + bytes(WIDTH - wide)] * high
        (copy / "robot.png").write_bytes(png_file(ignored, 8, 0))
        self.is_mapped(copy, "--ignore", copy / "robot.png")

    # -------------------------------------------------------------------------------------------- layouts and cameras

    def test_a_folder_of_arkitscenes(self):
        folder = self.folder / "40753679"
        for name in ("lowres_wide", "lowres_depth", "lowres_wide_intrinsics"):
            (folder / name).mkdir(parents=True)
        for (timestamp, color), (_, depth) in zip(self.color, self.depth):
            shutil.copy(color, folder / f"lowres_wide/40753679_{timestamp:.3f}.png")
            (folder / f"lowres_depth/40753679_{timestamp:.3f}.png").write_bytes(depth_file(depth))
            (folder / f"lowres_wide_intrinsics/40753679_{timestamp:.3f}.pincam").write_text(" ".join(map(str, (WIDTH, HEIGHT, *self.camera))) + "\n")
        self.is_mapped(folder)

    def test_a_folder_of_replica(self):
        folder = self.folder / "office0"
        (folder / "results").mkdir(parents=True)
        for number, ((_, color), (_, depth)) in enumerate(zip(self.color, self.depth)):
            shutil.copy(color, folder / f"results/frame{number:06}.png")
            shutil.copy(depth, folder / f"results/depth{number:06}.png")
        fx, fy, cx, cy = self.camera
        (folder / "cam_params.json").write_text(json.dumps({"camera": {"w": WIDTH, "h": HEIGHT, "fx": fx, "fy": fy, "cx": cx, "cy": cy, "scale": FACTOR}}))
        self.is_mapped(folder)

    def test_the_video_of_a_phone_is_told_with_the_command_that_converts_it(self):
        folder = self.folder / "stray"
        (folder / "depth").mkdir(parents=True)
        (folder / "rgb.mp4").write_bytes(b"\0\0\0\x18ftypmp42")
        (folder / "camera_matrix.csv").write_text("1600, 0, 960\n0, 1600, 720\n0, 0, 1\n")
        (folder / "depth/000000.png").write_bytes(depth_file(self.depth[0][1]))
        refused = stillmap("run", folder, "--out", self.folder / "stray_run")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("ffmpeg", refused.stderr)

    def test_a_camera_of_opencvs_calibration(self):
        copy = self.copy(lists=True)
        (copy / "camera.yaml").unlink()
        fx, fy, cx, cy = self.camera
        camera = self.folder / "opencv.xml"
        camera.write_text(f"""<?xml version="1.0"?>
<opencv_storage>
<image_width>{WIDTH}</image_width>
<image_height>{HEIGHT}</image_height>
<camera_matrix type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt><data>{fx} 0. {cx} 0. {fy} {cy} 0. 0. 1.</data></camera_matrix>
<distortion_coefficients type_id="opencv-matrix"><rows>1</rows><cols>5</cols><dt>d</dt><data>0. 0. 0. 0. 0.</data></distortion_coefficients>
</opencv_storage>
""")
        self.write_millimeters(copy)
        self.is_mapped(copy, "--camera", camera)

    def test_a_camera_without_the_size_of_the_images(self):
        copy = self.copy(lists=True)
        (copy / "camera.yaml").unlink()
        fx, fy, cx, cy = self.camera
        camera = self.folder / "nice_slam.yaml"
        camera.write_text(f"cam:\n  fx: {fx}\n  fy: {fy}\n  cx: {cx}\n  cy: {cy}\n  png_depth_scale: {FACTOR}\n")
        self.is_mapped(copy, "--camera", camera)

    def write_millimeters(self, copy):
        for _, file in self.depth:
            (copy / "depth" / file.name).write_bytes(depth_file(file))

    # -------------------------------------------------------------------------------------------- bags

    COLOR, DEPTH, FRAME = "/camera/color", "/camera/aligned_depth_to_color", "camera_color_optical_frame"

    def images_of(self, frame, images, encode):
        return [(timestamp, encode(timestamp, frame, file)) for timestamp, file in images]

    def infos(self, frame, camera=None, **changes):
        return [(timestamp, camera_info(timestamp, frame, camera or self.camera, **changes)) for timestamp, _ in self.color]

    def bag(self, changed=None):
        """The topics of a ROS 2 camera; `changed` replaces some of them."""
        return {self.COLOR + "/image_raw": ("Image", self.images_of(self.FRAME, self.color, color_image)),
                self.COLOR + "/camera_info": ("CameraInfo", self.infos(self.FRAME)),
                self.DEPTH + "/image_raw": ("Image", self.images_of(self.FRAME, self.depth, depth_image)),
                self.DEPTH + "/camera_info": ("CameraInfo", self.infos(self.FRAME)), **(changed or {})}

    def bag_is_mapped(self, topics):
        folder = self.folder / self.id().split(".")[-1]
        write_bag(folder, topics)
        return self.is_mapped(folder)

    def test_a_bag_of_ros_2(self):
        self.bag_is_mapped(self.bag())

    def test_a_bag_of_two_cameras_of_which_one_has_more_depth(self):
        topics = {}
        for name, color, depth in (("front", self.color, self.depth), ("rear", self.color[::-1], self.depth[::-1])):
            frame = name + "_optical_frame"
            turned = [(timestamp, file) for (timestamp, _), (_, file) in zip(self.color, color)]
            turned_depth = [(timestamp, file) for (timestamp, _), (_, file) in zip(self.depth, depth)]
            topics |= {f"/{name}/color/image_raw": ("Image", self.images_of(frame, turned, color_image)),
                       f"/{name}/color/camera_info": ("CameraInfo", self.infos(frame)),
                       f"/{name}/depth/image_raw": ("Image", self.images_of(frame, turned_depth, depth_image)),
                       f"/{name}/depth/camera_info": ("CameraInfo", self.infos(frame))}
        more = self.images_of("rear_optical_frame", [(self.depth[-1][0] + 0.03, self.depth[-1][1])], depth_image)
        topics["/rear/depth/image_raw"][1].extend(more)
        shown = self.bag_is_mapped(topics)
        self.assertIn("--topics /rear/color/image_raw,/rear/depth/image_raw", shown)

    def test_a_camera_info_of_the_whole_sensor_with_binning(self):
        doubled = [2 * self.camera[0], 2 * self.camera[1], 2 * self.camera[2] + 0.5, 2 * self.camera[3] + 0.5]
        whole = ("CameraInfo", self.infos(self.FRAME, doubled, size=(2 * WIDTH, 2 * HEIGHT), binning=2))
        self.bag_is_mapped(self.bag({self.COLOR + "/camera_info": whole, self.DEPTH + "/camera_info": whole}))

    def test_a_camera_info_without_k(self):
        without = ("CameraInfo", self.infos(self.FRAME, with_k=False))
        self.bag_is_mapped(self.bag({self.COLOR + "/camera_info": without, self.DEPTH + "/camera_info": without}))

    def test_depth_as_an_ordinary_png(self):
        topics = self.bag()
        del topics[self.DEPTH + "/image_raw"]
        topics["/camera/depth/compressed"] = ("CompressedImage", self.images_of(self.FRAME, self.depth, depth_png))
        self.bag_is_mapped(topics)

    def test_depth_that_a_relay_repeats(self):
        repeated = [(timestamp + late, message) for timestamp, message in self.bag()[self.DEPTH + "/image_raw"][1] for late in (0, 0.001, 0.002)]
        self.bag_is_mapped(self.bag({self.DEPTH + "/image_raw": ("Image", repeated)}))


if __name__ == "__main__":
    PROGRAM = str(Path(sys.argv.pop(1)).resolve())
    unittest.main()
