# SPDX-License-Identifier: Apache-2.0
"""Processes of the tests: a recording, the node, a camera, and a robot's other programs in the test itself."""
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parent
FRAMES = 90
# The camera of the rendered recordings: its height and how far it looks down are found from their truth.
DOMAIN = str(os.getpid() % 90 + 10)
# The transport as docs/robot.md sets it.
os.environ |= {"ROS_DOMAIN_ID": DOMAIN, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
               "FASTRTPS_DEFAULT_PROFILES_FILE": str(FOLDER.parent / "stillmap_ros" / "config" / "fastdds.xml")}

import rclpy  # noqa: E402 - after the environment is set
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import PoseWithCovarianceStamped  # noqa: E402
from nav_msgs.msg import OccupancyGrid, Odometry, Path as PathMessage  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from sensor_msgs.msg import PointCloud2  # noqa: E402
from stillmap_msgs.msg import MoverArray, ZoneWarningArray  # noqa: E402
from stillmap_ros import messages  # noqa: E402
from stillmap_ros.node import latched  # noqa: E402
from stillmap_ros.transforms import BODY_OPTICAL, FrameTree, inverse, matrix_of_pose  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402
from visualization_msgs.msg import MarkerArray  # noqa: E402

OPTICAL = "camera_color_optical_frame"


def command(*words):
    return subprocess.run([os.environ["STILLMAP_COMMAND"], *map(str, words)], check=True, capture_output=True, text=True)


@pytest.fixture(scope="session")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("simulated") / "sequence"
    command("simulate", "--people", 1, "--frames", FRAMES, "--width", 320, "--height", 240, "--out", folder)
    return folder


@pytest.fixture(scope="session")
def base_to_camera(recording):
    """T_base_camera of the first frame: the base is below the camera on the floor (z = 0 of the truth), and level."""
    stamp, *pose = np.loadtxt(recording / "groundtruth.txt")[0]
    T_world_camera = matrix_of_pose(*pose)
    ahead = T_world_camera[:3, 2] * [1, 1, 0]
    x = ahead / np.linalg.norm(ahead)
    T_world_base = np.eye(4)
    T_world_base[:3, :3] = np.column_stack([x, np.cross([0, 0, 1], x), [0, 0, 1]])
    T_world_base[:2, 3] = pose[:2]
    return inverse(T_world_base) @ T_world_camera


class Processes:
    """The node and cameras, with their output in files."""

    def __init__(self, folder):
        self.folder, self.running = folder, []

    def start(self, name, *words, output=None):
        log = self.folder / (output or f"{name}{len(self.running)}.log")
        with log.open("w") as file:
            process = subprocess.Popen([sys.executable, "-u", *map(str, words)], stdout=file, stderr=file)
        process.log = log
        self.running.append(process)
        return process

    def node(self, **parameters):
        words = ["-m", "stillmap_ros.node", "--ros-args"]
        for key, value in ({"map_period": 0.3} | parameters).items():
            words += ["-p", f"{key}:={str(value).lower() if isinstance(value, bool) else value}"]
        return self.start("node", *words)

    def camera(self, recording, *words):
        return self.start("camera", FOLDER / "camera.py", recording, *words)

    def close(self):
        for process in self.running:
            if process.poll() is None:
                process.kill()
                process.wait()


def stop(process, number=signal.SIGINT):
    process.send_signal(number)
    process.wait(timeout=60)
    return process.log.read_text()


@pytest.fixture
def processes(tmp_path):
    made = Processes(tmp_path)
    yield made
    made.close()


class Robot:
    """The rest of a robot: publishes its transforms and receives the topics of the node."""

    def __init__(self):
        self.node = rclpy.create_node("robot")
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.tree = FrameTree()
        self.got = {}
        self.times = {}
        self.static = self.node.create_publisher(TFMessage, "/tf_static", latched(100))
        self.tf = self.node.create_publisher(TFMessage, "/tf", 100)
        self.node.create_subscription(TFMessage, "/tf", self._transforms, 100)
        for kind, topic, qos in ((Odometry, "odom", 100), (PoseWithCovarianceStamped, "pose", 100),
                                 (OccupancyGrid, "map", latched()), (PointCloud2, "cloud", latched()),
                                 (PointCloud2, "cloud_added", 10), (PointCloud2, "cloud_removed", 10),
                                 (MoverArray, "tracks", 10), (ZoneWarningArray, "warnings", 10),
                                 (MarkerArray, "movers", 10), (MarkerArray, "changed_objects", latched()), (PathMessage, "path", 1),
                                 (DiagnosticArray, "/diagnostics", 10)):
            self.node.create_subscription(kind, topic, self._keeper(topic), qos)

    def _keeper(self, topic):
        def keep(message):
            self.got.setdefault(topic, []).append(message)
            self.times.setdefault(topic, []).append(time.time())
        return keep

    def _transforms(self, message):
        self.tree.add(message.transforms, False)
        self.got.setdefault("tf", []).extend(message.transforms)

    def mount(self, T_base_camera):
        """Publishes the transform of the camera in two steps, as the drivers of cameras do."""
        T_base_body = T_base_camera @ inverse(BODY_OPTICAL)
        self.static.publish(TFMessage(transforms=[messages.transform_of(T_base_body, 0, "base_link", "camera_link"),
                                                  messages.transform_of(BODY_OPTICAL, 0, "camera_link", OPTICAL)]))

    def spin_until(self, condition, seconds):
        """Returns whether the condition becomes true in time."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if condition():
                return True
            self.executor.spin_once(timeout_sec=0.05)
        return condition()

    def count(self, topic):
        return len(self.got.get(topic, []))

    def values(self):
        """Returns the values of the newest diagnostics, and its message."""
        if not self.count("/diagnostics"):
            return {}, ""
        status = self.got["/diagnostics"][-1].status[0]
        return {pair.key: pair.value for pair in status.values}, status.message

    def says(self, text):
        return any(text in array.status[0].message for array in self.got.get("/diagnostics", []))

    def call(self, kind, name, **request):
        client = self.node.create_client(kind, f"/stillmap/{name}")
        assert client.wait_for_service(10)
        future = client.call_async(kind.Request(**request))
        assert self.spin_until(future.done, 60)
        return future.result()

    def forget(self):
        """Forgets all messages, also those that were sent but not received yet."""
        self.spin_until(lambda: False, 0.5)
        self.got.clear()
        self.times.clear()

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()


@pytest.fixture
def robot(base_to_camera):
    rclpy.init()
    made = Robot()
    made.mount(base_to_camera)
    yield made
    made.close()
    rclpy.shutdown()
