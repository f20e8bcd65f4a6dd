# SPDX-License-Identifier: Apache-2.0
"""The node: topics, parameters, services and threads.

One thread receives images, one tracks, one publishes the map, and the main thread does the rest, so that no image waits
behind tracking."""
import array
import collections
import concurrent.futures
import os
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path as PathMessage
from nav_msgs.srv import GetMap, LoadMap
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, Imu, PointCloud2
from std_srvs.srv import SetBool, Trigger
from stillmap_msgs.msg import MoverArray, ZoneWarningArray
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

import stillmap
from stillmap_ros import images, messages
from stillmap_ros.changes import Changes
from stillmap_ros.mapper import FrameError, Mapper, Odometry as VisualOdometry, frame_file_of, journal_of
from stillmap_ros.pairing import Pairing, Queue
from stillmap_ros.serialized import image_of
from stillmap_ros.transforms import BODY_OPTICAL, FrameTree, inverse, matrix_of_pose, matrix_of_rpy

PARAMETERS = {
    "map_frame": "map", "odom_frame": "odom",
    "base_frame": "base_link",  # empty: the camera's own body
    "base_to_camera": [0.0],  # x y z roll pitch yaw of the camera's body [m, rad]; one number: from tf
    "publish_odom": True,  # False: the robot publishes odom -> base_link
    "moving_camera": False,  # the camera moves on the robot, so its transform comes from /tf, too
    "transform_tolerance": 0.1,  # time by which map -> odom is dated ahead [s]
    "schedule": "realtime",  # or lockstep: every frame, with repeatable results
    "depth_transport": "raw", "color_transport": "raw",  # or compressed
    "masks": False,  # masks of another node on the topic `mask`
    "imu": False,  # the topic `imu` supports the poses
    "wheels": False,  # the topic `wheel_odometry` bridges seconds without a pose
    "rectified": False,  # the images are those of image_proc
    "stereo": False,  # a rectified pair: `right` in place of depth, camera_info of the right camera
    "pairing": 0.02,  # largest difference of the stamps of color and depth [s]
    "sensor": "kinect_v1", "static_mask": "",  # PNG file, white where the robot sees itself
    "preset": "", "options": [""],  # of Stillmap, NAME=VALUE
    "map_file": "", "localize": False, "results": "",
    "zones": "",  # file of zones and distances to warn of, in the frame of the map
    "map_period": 2.0,  # time between two clouds and grids [s]; 0: none
    "grid_cell": 0.05, "grid_lowest": 0.1, "grid_highest": 1.8, "robot_radius": 0.2,  # [m]
}
CHOICES = {"schedule": ("realtime", "lockstep"), "color_transport": ("raw", "compressed"),
           "depth_transport": ("raw", "compressed")}
COMPARED = 10.0  # time between two comparisons with the loaded map [s]
SILENCE = 1.0  # time without an image after which that is a problem [s]
SHOWN = 2.0  # time for which a problem is shown [s]
REPEATED = 5.0  # time between two lines of the log about the same problem, and without images after which that is an error [s]


class ParameterError(ValueError):
    """A parameter with which the node cannot work."""


def value_of(name, value, default):
    """Returns the value of a parameter in the type of its default; an integer is a number, too."""
    listed = isinstance(default, list)
    value = [] if listed and value is None else value  # an empty list has no type
    sequence = isinstance(value, (list, tuple, array.array))
    kind = type(default[0] if listed else default)
    values = list(value) if sequence else [value]
    if sequence != listed or any(type(v) not in ((float, int) if kind is float else (kind,)) for v in values):
        words = {bool: "true or false", float: "a number", str: "a text"}[kind]
        raise ParameterError(f"{name}: is {value!r}\n  fix: give {f'a list, each {words}' if listed else words}")
    values = [kind(v) for v in values]
    return values if listed else values[0]


def keep_old(map_file):
    """Renames the files of a map, so that no other replaces it. Returns what was done; nothing if there is none."""
    if not map_file or not Path(map_file).exists():
        return ""
    names = (f"{map_file}.old{number}" for number in ["", *range(2, 10000)])
    old = next(name for name in names if not Path(name).exists())
    for file, name in ((Path(map_file), old), (frame_file_of(map_file), frame_file_of(old))):
        if file.exists():
            os.replace(file, name)
    return f"; the map in {map_file} is kept as {old}"


def latched(depth=1):
    return QoSProfile(depth=depth, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE)


class ImageReceiver:
    """Receives images on a thread of its own, as reliably as their publishers send, and hands sets to a queue. Other
    topics are received by the node."""

    def __init__(self, node, topics, lossless, slop):
        self.node, self.topics, self.lossless = node, topics, lossless
        # A node of its own for the thread; its names are resolved already.
        self.receiver = rclpy.create_node(f"{node.get_name()}_images", use_global_arguments=False,
                                          start_parameter_services=False, enable_rosout=False)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.receiver)
        self.subscriptions = {}  # topic: (subscription, reliable)
        self.pairing = Pairing(sum(not isinstance(i, str) for _, _, i in topics), slop, lossless)
        self.queue = Queue(lossless)
        self.info = None  # CameraInfo; None: the next one is received
        # Imu and Odometry messages that were not used yet, and the newest stamp of each kind [ns].
        self.samples = {"imu": collections.deque(maxlen=4000), "wheels": collections.deque(maxlen=4000)}
        self.newest_sample = {"imu": 0, "wheels": 0}
        self.received = 0
        self.newest = None  # monotonic time of the newest set [s]
        self.receiver.create_timer(0.5, self.connect)
        self.thread = threading.Thread(target=self._run, name="images")

    def start(self):
        self.connect()
        self.thread.start()

    def _run(self):
        try:
            self.executor.spin()
        except ExternalShutdownException:
            pass

    def connect(self):
        """Subscribes to topics that have publishers, and again where their reliability changed."""
        for name, kind, index in self.topics:
            publishers = self.receiver.get_publishers_info_by_topic(name)
            if not publishers:
                continue
            wanted = not (index == "info" and self.info is not None)
            reliable = all(p.qos_profile.reliability == ReliabilityPolicy.RELIABLE for p in publishers)
            known = self.subscriptions.get(name)
            # In lockstep images wait where the queue is full, and must not keep these from being received.
            owner = self.node if isinstance(index, str) else self.receiver
            if known and (known[1] != reliable or not wanted):
                owner.destroy_subscription(self.subscriptions.pop(name)[0])
            if not wanted or name in self.subscriptions:
                continue
            if self.lossless and not reliable:
                self.node.get_logger().warning(f"{name} is published best effort: frames may be lost in lockstep")
            qos = QoSProfile(history=HistoryPolicy.KEEP_ALL if self.lossless else HistoryPolicy.KEEP_LAST,
                             depth=400 if index in self.samples else 15,
                             reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT)
            # Without the events of the middleware, which cost as much as the images.
            subscription = owner.create_subscription(
                kind, name, self._callback_of(kind, index), qos, raw=kind is Image,
                event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False))
            self.subscriptions[name] = (subscription, reliable)
            self.node.get_logger().info(f"receives {name} ({'reliable' if reliable else 'best effort'})")

    def _callback_of(self, kind, index):
        if index == "info":
            return self._receive_info
        if index in self.samples:
            return lambda message: self._receive_sample(index, message)

        def receive(message):
            self.newest = time.monotonic()
            for complete in self.pairing.add(index, image_of(message) if kind is Image else message):
                self.received += 1
                self.queue.put(complete)
        return receive

    def _receive_sample(self, kind, message):
        self.samples[kind].append(message)
        self.newest_sample[kind] = images.nanoseconds(message.header.stamp)

    def _receive_info(self, message):
        self.info = message

    def missing(self):
        """Returns the topics without a publisher."""
        return [name for name, _, index in self.topics
                if name not in self.subscriptions and not (index == "info" and self.info is not None)]

    def close(self):
        self.queue.close()
        self.executor.shutdown()
        self.thread.join()
        self.receiver.destroy_node()


class StillmapNode(Node):
    def __init__(self):
        super().__init__("stillmap")
        for name, value in PARAMETERS.items():
            self.declare_parameter(name, value, ParameterDescriptor(dynamic_typing=True))
        self.settings = {name: value_of(name, self.get_parameter(name).value, value) for name, value in PARAMETERS.items()}
        self._check_settings()
        self.add_on_set_parameters_callback(lambda _: SetParametersResult(
            successful=False, reason="parameters are read at the start only; there are services for what changes later"))
        self.lossless = self.settings["schedule"] == "lockstep"
        self.options = self._options()
        self.mapper = None  # of the tracking thread; others keep a reference of their own
        self.newest = None  # newest Located
        self.visual_odometry = VisualOdometry()  # continues without a jump in the next map
        self.T_map_odom = None  # of the present map; None before its first pose
        self.paused = False
        self.map_file = self.settings["map_file"]  # empty: none
        self.extend = not self.settings["localize"]
        self.starts = self._maps_to_start_from()  # the first that can be used is
        self.counts = collections.Counter()
        self.delays = collections.deque(maxlen=100)  # from the stamp to the published pose [s]
        self.problems = {}  # text: monotonic time of its newest occurrence
        self.findings = []
        self.tree = FrameTree()
        self.commands = collections.deque()
        self.stopping = threading.Event()
        self._create_publishers()
        self._create_services()
        self._subscribe_transforms()
        self.images = ImageReceiver(self, self._topics(), self.lossless, self.settings["pairing"])
        self.threads = [threading.Thread(target=self._track_all, name="tracking"),
                        threading.Thread(target=self._publish_maps, name="maps"),
                        threading.Thread(target=self._publish_changed_objects, name="changes")]
        # Not the clock of a simulation, which may stand still.
        self.create_timer(1.0, self._publish_diagnostics, clock=Clock(clock_type=ClockType.STEADY_TIME))

    # Setup

    def _check_settings(self):
        """Raises ParameterError for what would keep the node from its work later."""
        given, settings = set(self._parameter_overrides), self.settings
        for name in given.difference(PARAMETERS, {"use_sim_time", "start_type_description_service"}):
            if not name.startswith("qos_overrides"):
                raise ParameterError(f"there is no parameter {name}\n  fix: use one of {', '.join(PARAMETERS)}")
        for name in ("static_mask", "zones", "map_file", "results"):
            settings[name] = settings[name] and str(Path(settings[name]).expanduser().absolute())
        for name in ("static_mask", "zones"):
            if settings[name] and not Path(settings[name]).is_file():
                raise ParameterError(f"{name}: there is no file {settings[name]}\n  fix: name a file, or leave it empty")
        if len(settings["base_to_camera"]) not in (1, 6):
            raise ParameterError("base_to_camera: six numbers are expected\n  fix: give x y z roll pitch yaw [m, rad]")
        for name, words in CHOICES.items():
            if settings[name] not in words:
                raise ParameterError(f"{name}: is '{settings[name]}'\n  fix: use {' or '.join(words)}")
        self._check_files(Path(settings["map_file"]), Path(settings["results"]))
        frames = [settings[name] for name in ("map_frame", "odom_frame", "base_frame")]
        if len(set(frames)) < 3 or not all(frames[:2]):
            raise ParameterError("map_frame, odom_frame, base_frame: are not three frames\n  fix: give each a name of its own")
        for name in ("grid_cell", "pairing"):
            if not settings[name] > 0:
                raise ParameterError(f"{name}: is {settings[name]}\n  fix: give a positive number")
        for name in ("map_period", "robot_radius", "transform_tolerance"):
            if not settings[name] >= 0:
                raise ParameterError(f"{name}: is {settings[name]}\n  fix: give a positive number, or zero")
        if not settings["grid_lowest"] < settings["grid_highest"]:
            raise ParameterError("grid_lowest: is not below grid_highest\n  fix: exchange them")
        try:
            stillmap.Camera(640, 480, 500, 500, 320, 240, depth_factor=1000, sensor=settings["sensor"])
        except stillmap.Error as error:
            raise ParameterError(f"sensor: {error}") from error

    def _check_files(self, map_file, results):
        """Raises ParameterError for files that could not be written at the end."""
        if self.settings["map_file"]:
            if not map_file.parent.is_dir():
                raise ParameterError(f"map_file: the folder {map_file.parent} is not there\n  fix: make it")
            if map_file.is_dir():
                raise ParameterError(f"map_file: {map_file} is a folder\n  fix: name a file in it")
            if not os.access(map_file.parent, os.W_OK):
                raise ParameterError(f"map_file: the folder {map_file.parent} cannot be written\n  fix: name another one")
        if self.settings["results"]:
            try:
                results.mkdir(parents=True, exist_ok=True)
                (results / ".writable").touch()
                (results / ".writable").unlink()
            except OSError as error:
                raise ParameterError(f"results: {error}\n  fix: name a folder that can be written") from error

    def _options(self):
        options = {"schedule.mode": self.settings["schedule"]}
        for text in filter(None, self.settings["options"]):
            name, _, value = text.partition("=")
            options[name] = value
        return stillmap.Options(options, preset=self.settings["preset"])

    def _maps_to_start_from(self):
        """Returns the map of a node that was killed and the saved one, as far as they exist."""
        files = (journal_of(self.map_file), Path(self.map_file)) if self.map_file else ()
        return [file for file in files if file.exists()]

    def _topics(self):
        compressed = {name: self.settings[f"{name}_transport"] == "compressed" for name in ("color", "depth")}
        names = {"color": "color/compressed" if compressed["color"] else "color",
                 "depth": "depth/compressedDepth" if compressed["depth"] else "depth"}
        if self.settings["stereo"]:
            names["depth"] = "right/compressed" if compressed["depth"] else "right"
        topics = [(self._resolved(names[name]), CompressedImage if compressed[name] else Image, index)
                  for index, name in enumerate(("color", "depth"))]
        if self.settings["masks"]:
            topics.append((self._resolved("mask"), Image, 2))
        if self.settings["imu"]:
            topics.append((self._resolved("imu"), Imu, "imu"))
        if self.settings["wheels"]:
            topics.append((self._resolved("wheel_odometry"), Odometry, "wheels"))
        return [*topics, (self._resolved("camera_info"), CameraInfo, "info")]

    def _resolved(self, name):
        """Returns the name of a topic; the transport follows the remapped name of the image."""
        base, _, transport = name.partition("/")
        return self.resolve_topic_name(base) + ("/" + transport if transport else "")

    def _create_publishers(self):
        self.tf = self.create_publisher(TFMessage, "/tf", 100)
        self.odometry = self.create_publisher(Odometry, "odom", 10)
        self.pose = self.create_publisher(PoseWithCovarianceStamped, "pose", 10)
        self.movers = self.create_publisher(MarkerArray, "movers", 10)
        self.tracks = self.create_publisher(MoverArray, "tracks", 10)
        self.warnings = self.create_publisher(ZoneWarningArray, "warnings", 10)
        self.cloud = self.create_publisher(PointCloud2, "cloud", latched())
        self.cloud_added = self.create_publisher(PointCloud2, "cloud_added", 10)
        self.cloud_removed = self.create_publisher(PointCloud2, "cloud_removed", 10)
        self.changed_objects = self.create_publisher(MarkerArray, "changed_objects", latched())
        self.grid = self.create_publisher(OccupancyGrid, "map", latched())
        self.path = self.create_publisher(PathMessage, "path", 1)
        self.diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)

    def _create_services(self):
        self.create_service(Trigger, "~/save_map", self._save_map)
        self.create_service(LoadMap, "~/load_map", self._load_map)
        self.create_service(SetBool, "~/localize", self._set_localize)
        self.create_service(SetBool, "~/pause", self._set_pause)
        self.create_service(Trigger, "~/reset", self._reset)
        self.create_service(GetMap, "~/get_map", self._get_map)

    def _subscribe_transforms(self):
        self.create_subscription(TFMessage, "/tf_static", lambda m: self.tree.add(m.transforms, True), latched(100))
        if self.settings["moving_camera"] or not self.settings["publish_odom"]:
            self.create_subscription(TFMessage, "/tf", lambda m: self.tree.add(m.transforms, False), 100)

    def start(self):
        self.images.start()
        for thread in self.threads:
            thread.start()

    # The tracking thread

    def _track_all(self):
        while not self.stopping.is_set() or (self.lossless and self.images.queue.sets):
            complete = self.images.queue.get(0.1)
            while self.commands:
                command, done = self.commands.popleft()
                try:
                    done.set_result(command())
                except Exception as error:  # noqa: BLE001 - returned to the caller of the service
                    done.set_exception(error)
            if complete is not None and not self.paused:
                self._track(complete)

    def _on_tracker(self, command):
        """Runs a function between two frames. Returns its result."""
        done = concurrent.futures.Future()
        self.commands.append((command, done))
        self.images.queue.wake()
        return done.result(timeout=60)

    def _track(self, complete):
        try:
            located = self._located(complete)
        except Exception as error:  # noqa: BLE001 - no frame ends the node
            self._tell(str(error) or type(error).__name__)
            located = None
        if located is None:
            self.counts["not used"] += 1
            return
        self.newest = located
        self.counts["tracked" if located.T_map_base is not None else "without a pose"] += 1
        if located.T_map_base is None:
            elsewhere = "the camera is in a map that is not connected with the loaded one yet"
            reason = elsewhere if located.elsewhere else located.update.reason
            if not self.extend and located.update.state == "no map":
                reason += "\n  fix: name a saved map in map_file, or call ~/localize with false"
            self._tell(f"no pose: {reason}")
        self._publish_pose(located)

    def _located(self, complete):
        header = complete[0].header
        stamp, frame = images.nanoseconds(header.stamp), header.frame_id
        info = self._awaited(lambda: self.images.info, f"no camera_info yet on {self._resolved('camera_info')}\n"
                             "  fix: remap camera_info to the topic of the color camera")
        T_base_camera = self._awaited(
            lambda: self._base_to_camera(frame, stamp), f"no transform {self.settings['base_frame']} -> {frame}\n"
            "  fix: publish it on /tf_static, or set the parameter base_to_camera")
        if info is None or T_base_camera is None:
            return None
        rgb, depth, *masks = (self._pixels(message, index) for index, message in enumerate(complete))
        mask = masks[0] if masks else None
        if self.mapper is None:
            imu = self._imu(frame, stamp)
            if imu is None and self.settings["imu"]:
                return None
            try:
                self._start(info, T_base_camera, imu)
            except Exception:
                self.images.info = None  # the next one may be right
                raise
        self._require_size(rgb, depth)
        self._await_samples(stamp)
        for kind, push in (("imu", self.mapper.push_imu), ("wheels", self.mapper.push_odometry)):
            while self.images.samples[kind]:
                push(self.images.samples[kind].popleft())
                self.counts[f"samples: {kind}"] += 1
        return self.mapper.push(rgb, depth, stamp, mask, T_base_camera)

    def _imu(self, camera_frame, stamp):
        """Returns the stillmap.Imu of the topic `imu` with its transform, or None while it is unknown."""
        if not self.settings["imu"]:
            return None
        sample = self._awaited(lambda: next(iter(self.images.samples["imu"]), None), f"no sample yet on {self._resolved('imu')}")
        if sample is None:
            return None
        frame = sample.header.frame_id.lstrip("/")
        T_camera_imu = self._awaited(
            lambda: np.eye(4) if frame == camera_frame.lstrip("/") else self.tree.lookup(camera_frame.lstrip("/"), frame, stamp),
            f"no transform {camera_frame} -> {frame}\n  fix: publish it on /tf_static, or set imu to false")
        return None if T_camera_imu is None else stillmap.Imu(T_camera_imu=T_camera_imu)

    def _await_samples(self, stamp):
        """In lockstep, waits for the samples of IMU and wheels up to an image, but no longer than a second."""
        end = time.monotonic() + 1
        wanted = [kind for kind in self.images.samples if self.settings[kind]]
        while (self.lossless and any(self.images.newest_sample[kind] < stamp for kind in wanted) and time.monotonic() < end
               and not self.stopping.wait(0.002)):
            pass

    def _awaited(self, find, problem):
        """Returns the result of find(). While it is None, reports the problem; in lockstep the frame waits for it."""
        while (found := find()) is None:
            self._tell(problem)
            if not self.lossless or self.stopping.wait(0.05):
                return None
        return found

    def _pixels(self, message, index):
        try:
            if not isinstance(message, CompressedImage):
                return images.raw_pixels(message, images.DEPTH if index == 1 and not self.settings["stereo"] else images.COLOR)
            if index == 0 or self.settings["stereo"]:
                return images.compressed_color(message)
            return images.compressed_depth(message)
        except images.ImageError as error:
            raise images.ImageError(f"{self.images.topics[index][0]}: {error}") from error

    def _require_size(self, rgb, depth):
        camera = self.mapper.camera
        for name, image in (("color", rgb), ("right" if self.settings["stereo"] else "depth", depth)):
            if image.shape[:2] == (camera.height, camera.width):
                continue
            raise images.ImageError(
                f"the {name} image has {image.shape[1]} x {image.shape[0]} pixels, camera_info said {camera.width} x "
                f"{camera.height}\n  fix: give registered depth of that size, or call ~/reset after a change")

    def _base_to_camera(self, frame, stamp):
        """Returns the transform from the base to the camera's optical frame, or None while it is unknown."""
        given = self.settings["base_to_camera"]
        if len(given) == 6:
            return matrix_of_rpy(*given) @ BODY_OPTICAL
        if not self.settings["base_frame"]:
            return BODY_OPTICAL
        return self.tree.lookup(self.settings["base_frame"], frame.lstrip("/"), stamp)

    def _camera_of(self, info):
        if self.settings["stereo"]:
            return images.stereo_camera_of(info, self.settings["static_mask"])
        return images.camera_of(info, self.settings["sensor"], self.settings["rectified"], self.settings["static_mask"])

    def _start(self, info, T_base_camera, imu):
        """Starts a map, or in one."""
        camera = self._camera_of(info)
        camera.imu = imu
        if self.settings["wheels"]:
            camera.T_camera_base = np.linalg.inv(T_base_camera)
        mapper = self._mapper_in_first_usable_map(camera, T_base_camera)
        self.mapper, self.changes, self.starts, self.T_map_odom = mapper, Changes(), [], None
        if self.map_file:
            mapper.keep_journal(self.map_file)

    def _mapper_in_first_usable_map(self, camera, T_base_camera):
        """Returns a Mapper in the first usable map of self.starts, or a new map. Unusable ones of this node are renamed."""
        new = None
        while self.starts:
            load = self.starts[0]
            try:
                mapper = self._mapper(camera, T_base_camera, load)
            except (stillmap.Error, FrameError) as error:
                new = new or self._mapper(camera, T_base_camera, None)  # raises what is not the map's fault
                self.starts.pop(0)
                own = self.map_file and load in (journal_of(self.map_file), Path(self.map_file))
                self._tell(f"{load} cannot be used: {error}{keep_old(load) if own else ''}")
                continue
            self.get_logger().info(f"starts in the map {load}")
            return mapper
        return new or self._mapper(camera, T_base_camera, None)

    def _mapper(self, camera, T_base_camera, load):
        mapper = Mapper(camera, self.options, T_base_camera, self.visual_odometry, stereo=self.settings["stereo"],
                        masks=self.settings["masks"], load=load, extend=self.extend)
        if self.settings["zones"]:
            mapper.watch(self.settings["zones"])
        return mapper

    def _publish_pose(self, located):
        map_frame, odom_frame = self.settings["map_frame"], self.settings["odom_frame"]
        base_frame = self.settings["base_frame"] or "camera"
        transforms = []
        T_odom_base = located.T_odom_base
        if T_odom_base is not None and self.settings["publish_odom"]:
            transforms.append(messages.transform_of(T_odom_base, located.time, odom_frame, base_frame))
        if located.T_map_base is not None:
            if not self.settings["publish_odom"]:
                T_odom_base = self.tree.lookup(odom_frame, base_frame, located.time)
                if T_odom_base is None:
                    self._tell(f"no transform {odom_frame} -> {base_frame} at the time of the image\n"
                               "  fix: let the robot's odometry publish it, or set publish_odom")
            if T_odom_base is not None:
                self.T_map_odom = located.T_map_base @ inverse(T_odom_base)
        if self.T_map_odom is not None and not located.elsewhere:
            ahead = located.time + round(1e9 * self.settings["transform_tolerance"])
            transforms.append(messages.transform_of(self.T_map_odom, ahead, map_frame, odom_frame))
        self.tf.publish(TFMessage(transforms=transforms))
        if located.T_map_base is not None:
            self.pose.publish(messages.pose_message(located.T_map_base, located.covariance, located.time, map_frame))
            if (now := self.get_clock().now().nanoseconds):  # a simulated clock may not have begun
                self.delays.append((now - located.time) / 1e9)
        if located.T_odom_base is not None and self.settings["publish_odom"]:
            self.odometry.publish(messages.odometry_of(
                located.T_odom_base, located.odometry_covariance, located.twist, located.twist_covariance, located.time,
                odom_frame, base_frame))

    # The thread of the map

    def _publish_maps(self):
        next_map = 0.0
        while not self.stopping.wait(0.1):
            mapper, newest = self.mapper, self.newest
            if mapper is None or newest is None or newest.T_map_base is None:
                continue
            begin = time.monotonic()
            try:
                self._publish_movers(mapper, newest.time)
                if 0 < self.settings["map_period"] and next_map <= begin:
                    self._publish_map(mapper, newest.time)
                    self.findings = mapper.slam.findings
                    # The map takes a tenth of one core at most.
                    next_map = begin + max(self.settings["map_period"], 10 * (time.monotonic() - begin))
            except Exception as error:  # noqa: BLE001 - the thread goes on
                self._tell(f"the map is not published: {error}")

    def _publish_movers(self, mapper, stamp):
        T, frame = mapper.T_map_world, self.settings["map_frame"]
        if self.movers.get_subscription_count() or self.tracks.get_subscription_count():
            movers = mapper.slam.movers
            self.movers.publish(messages.movers_of(movers, T, stamp, frame))
            self.tracks.publish(messages.tracks_of(movers, T, stamp, frame))
        if self.settings["zones"]:
            self.warnings.publish(messages.warnings_of(mapper.slam.warnings, T, stamp, frame))

    def _publish_map(self, mapper, stamp):
        snapshot = mapper.slam.snapshot()
        T, frame = mapper.T_map_world, self.settings["map_frame"]
        T_camera_base = inverse(mapper.T_base_camera)
        bases = [(round(row[0] * 1e9), matrix_of_pose(*row[1:]) @ T_camera_base) for row in snapshot.trajectory[::5]]
        if self.path.get_subscription_count():
            self.path.publish(messages.path_of([(time, T @ T_world_base) for time, T_world_base in bases], stamp, frame))

        def in_map(points):
            return (points @ T[:3, :3].T + T[:3, 3]).astype(np.float32)
        if self.cloud.get_subscription_count():
            self.cloud.publish(messages.cloud_of(in_map(snapshot.cloud.points), snapshot.cloud.colors, stamp, frame))
        if self.cloud_added.get_subscription_count() or self.cloud_removed.get_subscription_count():
            added, removed = self.changes.update(snapshot.cloud.points, snapshot.cloud_voxels)
            self.cloud_added.publish(messages.cloud_of(in_map(snapshot.cloud.points[added]), snapshot.cloud.colors[added], stamp, frame))
            self.cloud_removed.publish(messages.cloud_of(in_map(removed), np.zeros_like(removed, np.uint8), stamp, frame))
        way = [T_world_base[:3, 3] for _, T_world_base in bases]
        grid = stillmap.navigation_grid(snapshot.cloud, T, way=way, cell=self.settings["grid_cell"], lowest=self.settings["grid_lowest"],
                                        highest=self.settings["grid_highest"], radius=self.settings["robot_radius"])
        if grid is not None:
            self.newest_grid = messages.grid_of(grid, stamp, frame)
            self.grid.publish(self.newest_grid)

    def _publish_changed_objects(self):
        while not self.stopping.wait(COMPARED):
            mapper, newest = self.mapper, self.newest
            if newest is None or mapper is None or not mapper.in_loaded or not self.changed_objects.get_subscription_count():
                continue
            try:
                self.changed_objects.publish(messages.changed_objects_of(
                    mapper.slam.changes(), mapper.T_map_world, newest.time, self.settings["map_frame"]))
            except Exception as error:  # noqa: BLE001 - the thread goes on
                if not self.stopping.is_set():
                    self._tell(f"changed objects are not published: {error}")

    newest_grid = None

    # The main thread: services and diagnostics

    def _answer(self, response, command):
        """Answers a service with the text that a command returns."""
        try:
            response.success, response.message = True, command()
            self.get_logger().info(response.message)
        except Exception as error:  # noqa: BLE001 - the caller gets the reason
            response.success, response.message = False, str(error) or type(error).__name__
            self.get_logger().warning(response.message)
        return response

    def _save(self):
        """Saves the map to map_file. Returns what was done. Any thread may call it."""
        if self.mapper is None:
            raise RuntimeError("there is no map yet\n  fix: wait for the first image")
        if not self.map_file:
            raise RuntimeError("no file is named\n  fix: set the parameter map_file")
        self.mapper.save(self.map_file)
        return f"saved the map {self.map_file}"

    def _save_map(self, _, response):
        return self._answer(response, self._save)

    def _load_map(self, request, response):
        file = Path(request.map_url.removeprefix("file://")).expanduser().absolute()
        exists = file.is_file() or (file / "run.map").is_file()

        def load():
            if not exists:
                raise FileNotFoundError(f"there is no map {request.map_url}\n  fix: name a saved map, or the folder of a run")
            if self.mapper is None:
                self.starts = [file]
                own = self.map_file and Path(self.map_file) == file
                return f"starts in the map {file} with the first image{'' if own else keep_old(self.map_file)}"
            reason = self.mapper.load(file)
            self.T_map_odom = None
            return f"the map {file} is loaded; {reason}" if reason else f"the camera is in the map {file}"
        answer = self._answer(Trigger.Response(), lambda: self._on_tracker(load))
        response.result = LoadMap.Response.RESULT_SUCCESS
        if not answer.success:
            response.result = (LoadMap.Response.RESULT_INVALID_MAP_DATA if exists
                               else LoadMap.Response.RESULT_MAP_DOES_NOT_EXIST)
        return response

    def _restart(self):
        """Leaves the present map; the next frame starts a new one, which is extended."""
        self.extend = True
        if self.mapper is not None and self.map_file:
            self._save()
            journal_of(self.map_file).unlink(missing_ok=True)
        self.mapper, self.starts, self.newest_grid, self.images.info = None, [], None, None
        return f"starts a new map, which is extended{keep_old(self.map_file)}"

    def _set_localize(self, request, response):
        mode = "localize" if request.data else "map"

        def set_mode():
            self.extend = not request.data
            if self.mapper is not None:
                self.mapper.slam.set_mode(mode)
            return "localizes only" if request.data else "extends the map"
        return self._answer(response, lambda: self._on_tracker(set_mode))

    def _set_pause(self, request, response):
        self.paused = request.data
        self.images.queue.clear()
        response.success, response.message = True, "paused" if request.data else "goes on"
        return response

    def _reset(self, _, response):
        return self._answer(response, lambda: self._on_tracker(self._restart))

    def _get_map(self, _, response):
        if self.newest_grid is not None:
            response.map = self.newest_grid
        return response

    def _tell(self, problem):
        """Logs a problem once in some seconds, and shows it in the diagnostics."""
        now, title = time.monotonic(), " ".join(problem.split()[:3])
        known = self.problems.get(title)
        self.problems[title] = (now, problem, known[2] if known and now - known[2] < REPEATED else now)
        if self.problems[title][2] == now:
            self.get_logger().warning(problem)

    def _publish_diagnostics(self):
        now = time.monotonic()
        if self.images.missing():
            self._tell(f"waits for {', '.join(self.images.missing())}\n  fix: remap the topics to those of `ros2 topic list`")
        elif not self.paused and self.images.newest is not None and now - self.images.newest > SILENCE:
            self._tell(f"no images for {now - self.images.newest:.0f} s")
        recent = [text.replace("\n  fix", "; fix") for seen, text, _ in self.problems.values() if now - seen < SHOWN]
        untrusted = [f.code for f in self.findings if f.severity == "untrusted"]
        located = self.newest
        state = "paused" if self.paused else located.update.state if located else "no image yet"
        status = DiagnosticStatus(name=f"{self.get_name()}: tracking", hardware_id="", level=DiagnosticStatus.OK)
        if recent or untrusted or state != "tracked":
            status.level = DiagnosticStatus.WARN
        if untrusted or (self.images.newest is not None and state != "paused" and now - self.images.newest > REPEATED):
            status.level = DiagnosticStatus.ERROR
        status.message = "; ".join(recent) or state
        values = {"state": state, "mode": "map" if self.extend else "localize",
                  "findings": " ".join(f.code for f in self.findings), "frames received": self.images.received,
                  "frames dropped": self.images.queue.dropped, "frames without a partner": self.images.pairing.unpaired,
                  **{name if name.startswith("samples") else f"frames {name}": n for name, n in sorted(self.counts.items())}}
        if located is not None:
            values |= {"landmarks": located.update.inliers, "certain": located.update.certain}
        if self.delays:
            values["delay, median [ms]"] = f"{1000 * np.median(self.delays):.0f}"
        status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self.diagnostics.publish(array)

    def close(self):
        """Ends the threads, and writes the map and the results. Returns what could not be written."""
        self.stopping.set()
        self.images.close()
        for thread in self.threads:
            thread.join()
        if self.mapper is None:
            return []
        writes, failures = [], []
        if self.map_file:
            writes.append(self._save_at_the_end)
        if self.settings["results"]:
            results = self.mapper.slam.finish()
            writes.append(lambda: results.write(self.settings["results"]))
        for write in writes:
            try:
                write()
            except (OSError, RuntimeError) as error:
                failures.append(str(error))
        return failures

    def _save_at_the_end(self):
        self.get_logger().info(self._save())
        for file in (journal_of(self.map_file), frame_file_of(journal_of(self.map_file))):
            file.unlink(missing_ok=True)


def main():
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    try:
        rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
        node = StillmapNode()
    except KeyboardInterrupt:
        return
    except Exception as error:  # noqa: BLE001 - of ROS, too, such as for a parameter of two types
        sys.exit(f"stillmap: {error}")
    node.start()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)  # A second Ctrl-C does not lose the map.
    failures = node.close()
    node.destroy_node()
    rclpy.try_shutdown()
    if failures:
        sys.exit("\n".join(f"stillmap: not written: {failure}" for failure in failures))


if __name__ == "__main__":
    main()
