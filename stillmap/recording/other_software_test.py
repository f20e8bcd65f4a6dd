#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Files that other software writes give the trajectory of the folder from which they were made, byte for byte.

The writers are those of the PyPI packages rosbags and mcap, and the recorder of librealsense with a software device. They are
installed into build/recording_venv at the first run; exit code 77 ("skipped" for ctest) if that fails.

  other_software_test.py PROGRAM                         run the tests; PROGRAM: the built command
  other_software_test.py --convert FOLDER CAMERA OUT     write a TUM folder as a recording; OUT ends in _KIND.EXTENSION,
                                                         with a name and extension of KINDS
"""
import os
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
from decimal import Decimal
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
VENV = ROOT / "build/recording_venv"
PACKAGES = ["rosbags==0.11.9", "mcap==1.6.0", "opencv-python-headless==5.0.0.93"]
REALSENSE = ["pyrealsense2==2.59.1.11053"]  # Not for every platform.
COLOR, DEPTH = "/camera/rgb/image_raw", "/camera/depth_registered/image_raw"
CAMERA_INFO = "/camera/rgb/camera_info"
FRAMES = 25
# Kinds of files by their names: writer, its settings, encoding of the images.
KINDS = {
    "plain.bag": ("bag", None, "raw"),
    "bz2.bag": ("bag", "BZ2", "raw"),
    "lz4.bag": ("bag", "LZ4", "files"),
    "sqlite.db3": ("rosbag2", None, "raw"),
    "messages.db3": ("rosbag2", "zstd", "raw"),
    "ros2.mcap": ("rosbag2", None, "files"),
    "none.mcap": ("mcap", {"compression": "NONE"}, "raw"),
    "unchunked.mcap": ("mcap", {"use_chunking": False}, "files"),
    "lz4.mcap": ("mcap", {"compression": "LZ4", "enable_crcs": False}, "raw"),
    "zstd.mcap": ("mcap", {"compression": "ZSTD"}, "raw"),
    "noindex.mcap": ("mcap", {"compression": "ZSTD", "index_types": "NONE", "use_statistics": False,
                              "use_summary_offsets": False, "repeat_channels": False, "repeat_schemas": False}, "files"),
}


def install():
    """Installs the packages; exit code 77 if they cannot be installed, for example without a network."""
    python = VENV / "bin/python"
    pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--retries", "1", "--timeout", "10"]
    try:
        if subprocess.run([python, "-c", "import rosbags, mcap, cv2"], capture_output=True, check=False).returncode == 0:
            return
    except OSError:  # There is no environment yet.
        pass
    try:
        subprocess.run([sys.executable, "-m", "venv", VENV], check=True, capture_output=True, timeout=120)
        subprocess.run([*pip, *PACKAGES], check=True, capture_output=True, timeout=300)
        subprocess.run([*pip, *REALSENSE], check=False, capture_output=True, timeout=300)
    except (OSError, subprocess.SubprocessError) as error:
        print(f"skipped: {', '.join(PACKAGES)} cannot be installed into {VENV}: {error}")
        sys.exit(77)


def camera_of(file):
    """The numbers of a camera file, by their keys; distortion as a list."""
    camera = {"distortion": [0.0] * 5}
    for line in Path(file).read_text(encoding="utf-8").splitlines():
        key, _, value = line.split("#")[0].partition(":")
        key, value = key.strip().removeprefix("Camera."), value.strip()
        if value.startswith("["):
            camera[key] = [float(x) for x in value.strip("[]").split(",")]
        elif value.replace(".", "", 1).isdigit():
            camera[key] = float(value)
    camera.setdefault("depth_factor", camera.get("DepthMapFactor", 5000.0))
    return camera


def images(folder, name):
    """(stamp in nanoseconds, file) of a list."""
    for line in (folder / name).read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            stamp, file = line.split()[:2]
            yield int(Decimal(stamp) * 10**9), folder / file


class Messages:
    """Makes and serializes the messages of a folder."""

    def __init__(self, ros, files):
        import cv2
        import numpy
        from rosbags.typesys import Stores, get_typestore
        self.cv2, self.numpy, self.ros, self.files = cv2, numpy, ros, files
        self.store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_HUMBLE)
        self.types = self.store.types

    def header(self, stamp, frame):
        time_type = self.types["builtin_interfaces/msg/Time"]
        values = {"stamp": time_type(sec=stamp // 10**9, nanosec=stamp % 10**9), "frame_id": frame}
        return self.types["std_msgs/msg/Header"](**({"seq": 7} if self.ros == 1 else {}), **values)

    def serialized(self, message, name):
        serialize = self.store.serialize_ros1 if self.ros == 1 else self.store.serialize_cdr
        return bytes(serialize(message, name))

    def image(self, stamp, pixels, encoding):
        data = self.numpy.ascontiguousarray(pixels)
        return self.serialized(self.types["sensor_msgs/msg/Image"](
            header=self.header(stamp, "rgb_optical"), height=data.shape[0], width=data.shape[1], encoding=encoding,
            is_bigendian=0, step=data.strides[0], data=data.view(self.numpy.uint8).ravel()), "sensor_msgs/msg/Image")

    def compressed(self, stamp, data, image_format):
        return self.serialized(self.types["sensor_msgs/msg/CompressedImage"](
            header=self.header(stamp, "rgb_optical"), format=image_format,
            data=self.numpy.frombuffer(data, self.numpy.uint8)), "sensor_msgs/msg/CompressedImage")

    def color(self, stamp, file):
        if self.files:
            return self.compressed(stamp, file.read_bytes(), "rgb8; png compressed bgr8")
        return self.image(stamp, self.cv2.imread(str(file))[:, :, ::-1], "rgb8")

    def depth(self, stamp, file, factor):
        if self.files:  # The unit stays that of the folder: the camera has to be given.
            return self.compressed(stamp, b"\0" * 12 + file.read_bytes(), "16UC1; compressedDepth png")
        raw = self.cv2.imread(str(file), self.cv2.IMREAD_UNCHANGED)
        return self.image(stamp, raw.astype(self.numpy.float32) / self.numpy.float32(factor), "32FC1")

    def camera(self, stamp, camera):
        upper = {name: name.upper() if self.ros == 1 else name for name in "dkrp"}
        fx, fy, cx, cy = (camera[key] for key in ("fx", "fy", "cx", "cy"))
        array = self.numpy.array
        roi = self.types["sensor_msgs/msg/RegionOfInterest"](x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
        matrices = {"d": array(camera["distortion"]), "k": array([fx, 0, cx, 0, fy, cy, 0, 0, 1.0]),
                    "r": array([1.0, 0, 0, 0, 1, 0, 0, 0, 1]), "p": array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1.0, 0])}
        return self.serialized(self.types["sensor_msgs/msg/CameraInfo"](
            header=self.header(stamp, "rgb_optical"), height=int(camera["height"]), width=int(camera["width"]),
            distortion_model="plumb_bob", binning_x=0, binning_y=0, roi=roi,
            **{upper[name]: value for name, value in matrices.items()}), "sensor_msgs/msg/CameraInfo")

    def of_folder(self, folder, camera, count=None):
        """(time, topic, type, bytes) of all messages, by time."""
        image_type = "sensor_msgs/msg/CompressedImage" if self.files else "sensor_msgs/msg/Image"
        entries = [(stamp, COLOR + "/compressed" * self.files, file) for stamp, file in list(images(folder, "rgb.txt"))[:count]]
        suffix = "/compressedDepth" * self.files
        entries += [(stamp, DEPTH + suffix, file) for stamp, file in list(images(folder, "depth.txt"))[:count]]
        for stamp, topic, file in sorted(entries):
            if topic.startswith(COLOR):
                yield stamp, CAMERA_INFO, "sensor_msgs/msg/CameraInfo", self.camera(stamp, camera)
                yield stamp, topic, image_type, self.color(stamp, file)
            else:
                yield stamp, topic, image_type, self.depth(stamp, file, camera["depth_factor"])


def write_bag(path, messages, compression, records):
    from rosbags.rosbag1 import Writer
    with_compression = Writer(path)
    if compression:
        with_compression.set_compression(Writer.CompressionFormat[compression])
    with with_compression as writer:
        connections = {}
        for stamp, topic, kind, data in records:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=messages.store)
            writer.write(connections[topic], stamp, data)


def write_rosbag2(path, messages, compression, records):
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    plugin = StoragePlugin.MCAP if path.suffix == ".mcap" else StoragePlugin.SQLITE3
    folder = path.with_suffix(".folder")
    with_compression = Writer(folder, version=9, storage_plugin=plugin)
    if compression:
        with_compression.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    with with_compression as writer:
        connections = {}
        for stamp, topic, kind, data in records:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=messages.store)
            writer.write(connections[topic], stamp, data)
    shutil.move(next(folder.glob("*" + path.suffix)), path)
    shutil.rmtree(folder)


def write_mcap(path, messages, settings, records):
    from mcap.writer import CompressionType, IndexType, Writer
    settings = dict(settings)
    if "compression" in settings:
        settings["compression"] = CompressionType[settings["compression"]]
    if "index_types" in settings:
        settings["index_types"] = IndexType[settings["index_types"]]
    with open(path, "wb") as file:
        writer = Writer(file, **settings)
        writer.start("ros2", "stillmap test")
        channels = {}
        for stamp, topic, kind, data in records:
            if topic not in channels:
                schema = writer.register_schema(kind, "ros2msg", b"")
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channels[topic], log_time=stamp, publish_time=stamp, data=data)
        writer.finish()


def convert(folder, camera_file, out, count=None):
    """Writes a folder as a recording of the kind that the name of the file tells."""
    kind, settings, encoding = KINDS[out.name.split("_")[-1]]
    messages = Messages(1 if kind == "bag" else 2, encoding == "files")
    records = messages.of_folder(folder, camera_of(camera_file), count)
    {"bag": write_bag, "rosbag2": write_rosbag2, "mcap": write_mcap}[kind](out, messages, settings, records)


def record_with_realsense(folder, out, count):
    """Plays a folder through librealsense's software device and recorder. The depth camera is the color camera."""
    import cv2
    import pyrealsense2 as rs
    camera = camera_of(folder / "camera.yaml")
    intrinsics = rs.intrinsics()
    intrinsics.width, intrinsics.height = int(camera["width"]), int(camera["height"])
    intrinsics.fx, intrinsics.fy, intrinsics.ppx, intrinsics.ppy = (camera[key] for key in ("fx", "fy", "cx", "cy"))
    device = rs.software_device()
    profiles, sensors = {}, {}
    for uid, (name, stream, pixel, size) in enumerate((("Depth", rs.stream.depth, rs.format.z16, 2),
                                                       ("Color", rs.stream.color, rs.format.bgr8, 3)), 1):
        video = rs.video_stream()
        video.type, video.index, video.uid, video.fps, video.bpp, video.fmt = stream, 0, uid, 30, size, pixel
        video.width, video.height, video.intrinsics = intrinsics.width, intrinsics.height, intrinsics
        sensors[name] = device.add_sensor(name)
        profiles[name] = sensors[name].add_video_stream(video)
    sensors["Depth"].add_read_only_option(rs.option.depth_units, 1 / camera["depth_factor"])
    extrinsics = rs.extrinsics()
    extrinsics.rotation, extrinsics.translation = [1, 0, 0, 0, 1, 0, 0, 0, 1], [0, 0, 0]
    profiles["Depth"].register_extrinsics_to(profiles["Color"], extrinsics)
    recorder = rs.recorder(str(out), device)
    queue = rs.frame_queue(100)
    recorded = list(recorder.query_sensors())
    for sensor in recorded:
        sensor.open(sensor.get_stream_profiles())
        sensor.start(queue)
    pairs = list(zip(images(folder, "depth.txt"), images(folder, "rgb.txt")))[:count]
    for number, pair in enumerate(pairs):
        for name, size, (stamp, file) in zip(("Depth", "Color"), (2, 3), pair):
            pixels = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
            frame = rs.software_video_frame()
            frame.pixels, frame.stride, frame.bpp = pixels, size * intrinsics.width, size
            frame.timestamp, frame.domain = stamp / 1e6, rs.timestamp_domain.hardware_clock
            frame.frame_number, frame.profile = number, profiles[name].as_video_stream_profile()
            if name == "Depth":
                frame.depth_units = 1 / camera["depth_factor"]
            sensors[name].on_video_frame(frame)
        time.sleep(0.05)  # The recorder drops frames that come faster than it writes.
    for sensor in recorded:
        sensor.stop()
        sensor.close()
    del recorder


class OtherSoftware(unittest.TestCase):
    program = ""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.at = Path(cls.temporary.name)
        cls.folder = cls.at / "folder"
        cls.stillmap("simulate", "--scene", "office", "--people", "0", "--camera", "xyz", "--frames", str(FRAMES), "--width", "320",
                     "--height", "240", "--out", cls.folder)
        cls.expected = cls.trajectory(cls.folder)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def stillmap(cls, *arguments):
        result = subprocess.run([cls.program, *map(str, arguments)], capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stdout + result.stderr
        return result.stdout

    @classmethod
    def trajectory(cls, recording, *options):
        out = cls.at / "out"
        cls.stillmap("run", recording, "--out", out, "--preset", "static", "--set", "dense.enabled=false", *options)
        return (out / "trajectory.txt").read_bytes()

    def test_every_container_gives_the_trajectory_of_the_folder(self):
        self.assertGreater(self.expected.count(b"\n"), FRAMES // 2)
        for name, (_, _, encoding) in KINDS.items():
            with self.subTest(name):
                out = self.at / f"recorded_{name}"
                convert(self.folder, self.folder / "camera.yaml", out)
                # Depth images of files have the unit of the folder, which a recording cannot tell.
                options = ["--camera", self.folder / "camera.yaml"] if encoding == "files" else []
                self.assertEqual(self.trajectory(out, *options), self.expected)
                listing = self.stillmap("info", out, *options)
                self.assertIn(f"frames: {FRAMES}", listing)
                self.assertIn("sensor_msgs/CameraInfo", listing)
                self.assertEqual(listing.count("\ncamera: "), 1, listing)

    def test_a_truncated_file_is_read_as_far_as_it_goes(self):
        for name in ("plain.bag", "lz4.bag", "sqlite.db3", "none.mcap", "zstd.mcap"):
            with self.subTest(name):
                out = self.at / f"truncated_{name}"
                convert(self.folder, self.folder / "camera.yaml", out)
                os.truncate(out, os.path.getsize(out) * 7 // 10)
                listing = self.stillmap("info", out)
                self.assertIn("truncated", listing)
                frames = int(listing.split("frames: ")[1])
                self.assertGreater(frames, FRAMES // 3)
                self.assertLess(frames, FRAMES)

    def test_librealsense_records_what_the_folder_holds(self):
        try:
            import pyrealsense2  # noqa: F401, pylint: disable=unused-import
        except ImportError:
            self.skipTest("skipped: there is no pyrealsense2")
        out = self.at / "realsense.db3"
        record_with_realsense(self.folder, out, FRAMES)
        listing = self.stillmap("info", out)
        self.assertIn("realsense_d435i", listing)
        self.assertIn("0.0 mm and 0.00 degrees away", listing)
        # Its sensor model is another one than that of the folder.
        given = self.trajectory(out, "--camera", self.folder / "camera.yaml")
        lines = [line for line in given.splitlines() if not line.startswith(b"#")]
        expected = [line for line in self.expected.splitlines() if not line.startswith(b"#")]
        self.assertEqual(len(lines), len(expected))
        poses, wanted = ([[float(value) for value in line.split()] for line in group] for group in (lines, expected))
        for column in range(8):  # the times in its files are rounded, so that single poses differ by more
            squares = [(pose[column] - other[column]) ** 2 for pose, other in zip(poses, wanted)]
            self.assertLess((sum(squares) / len(squares)) ** .5, 0.002, f"column {column}")


if __name__ == "__main__":
    if Path(sys.prefix) != VENV:
        install()
        sys.exit(subprocess.run([VENV / "bin/python", *sys.argv], check=False).returncode)
    if sys.argv[1] == "--convert":
        convert(Path(sys.argv[2]), sys.argv[3], Path(sys.argv[4]), int(sys.argv[5]) if len(sys.argv) > 5 else None)
        sys.exit(0)
    OtherSoftware.program = str(Path(sys.argv.pop()).resolve())
    unittest.main()
