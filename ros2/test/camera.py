# SPDX-License-Identifier: Apache-2.0
"""A camera in a process of its own: publishes a recording on color, depth and camera_info.

  camera.py RECORDING [--rate HZ] [--first N] [--count N] [--now] [--clock] [--best-effort] [--compressed]
            [--late S] [--half] [--frame NAME] [--back S] [--repeat N] [--imu] [--wheels] [--stereo]
            [--known] [--uncalibrated N]
"""
import argparse
import array
import time

import cv2
import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from nav_msgs.msg import Odometry
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, Imu

import stillmap

BASELINE = 0.1  # of a stereo pair [m]
PATIENCE = 20  # time in which a subscriber must come [s]


def parse():
    parser = argparse.ArgumentParser()
    parser.add_argument("recording")
    parser.add_argument("--rate", type=float, default=30, help="frames per second; 0: as fast as they are taken")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=0)
    parser.add_argument("--repeat", type=int, default=1, help="number of passes, every other one backward")
    parser.add_argument("--now", action="store_true", help="stamps of the system's clock, not of the recording")
    parser.add_argument("--clock", action="store_true", help="publish the stamps on /clock")
    parser.add_argument("--best-effort", action="store_true")
    parser.add_argument("--compressed", action="store_true")
    parser.add_argument("--late", type=float, default=0, help="time by which depth images are later [s]")
    parser.add_argument("--half", action="store_true", help="images of half the size, with the whole camera_info")
    parser.add_argument("--back", type=float, default=0, help="time subtracted from the stamps [s]")
    parser.add_argument("--imu", action="store_true", help="publish the samples of imu0/data.csv, too")
    parser.add_argument("--wheels", action="store_true", help="publish the samples of odometry.txt, too")
    parser.add_argument("--stereo", action="store_true", help="publish a right image in place of depth")
    parser.add_argument("--known", action="store_true", help="the node knows this camera: do not wait for its camera_info")
    parser.add_argument("--uncalibrated", type=int, default=0, help="number of frames whose camera_info is empty")
    parser.add_argument("--frame", default="camera_color_optical_frame")
    return parser.parse_args()


def image(pixels, encoding, header):
    message = Image(header=header, height=pixels.shape[0], width=pixels.shape[1], encoding=encoding)
    message.step = pixels.strides[0]
    message.data = array.array("B", pixels.tobytes())
    return message


def compressed(pixels, text, header, kind=".png", prefix=b""):
    data = prefix + cv2.imencode(kind, pixels)[1].tobytes()
    return CompressedImage(header=header, format=text, data=array.array("B", data))


def right_image(left, depth, bf):
    """Returns the image of a camera to the right: each pixel moves to the left by bf / depth; what no pixel covers is noise."""
    right = np.random.default_rng(1).integers(0, 255, left.shape, np.uint8)
    nearest = np.zeros(depth.shape, np.float32)  # disparity [pixels]
    v, u = np.nonzero(depth > 0)
    disparity = bf / depth[v, u]
    order = np.argsort(disparity, kind="stable")  # nearer surfaces last
    v, u, disparity = v[order], u[order], disparity[order]
    for offset in (0, 1):
        column = np.floor(u - disparity).astype(int) + offset
        inside = (column >= 0) & (column < depth.shape[1])
        shown = disparity[inside] >= nearest[v[inside], column[inside]]
        rows, columns, source = v[inside][shown], column[inside][shown], u[inside][shown]
        nearest[rows, columns] = disparity[inside][shown]
        exact = columns + disparity[inside][shown]  # column of the left image, between pixels
        low = np.clip(np.floor(exact).astype(int), 0, depth.shape[1] - 2)
        share = np.clip(exact - low, 0, 1)[:, None]
        near = np.abs(source - exact) <= 1
        blended = (1 - share) * left[rows, low] + share * left[rows, low + 1]
        right[rows[near], columns[near]] = blended[near].astype(np.uint8)
    return right


class Camera:
    def __init__(self, arguments):
        self.arguments = arguments
        self.source = stillmap.source(arguments.recording, first=arguments.first, count=arguments.count)
        self.node = rclpy.create_node("camera")
        lossless = arguments.rate == 0
        qos = QoSProfile(
            history=HistoryPolicy.KEEP_ALL if lossless else HistoryPolicy.KEEP_LAST, depth=5,
            reliability=ReliabilityPolicy.BEST_EFFORT if arguments.best_effort else ReliabilityPolicy.RELIABLE)
        kind = CompressedImage if arguments.compressed else Image
        color, depth = ("color/compressed", "depth/compressedDepth") if arguments.compressed else ("color", "depth")
        self.color = self.node.create_publisher(kind, color, qos)
        self.depth = self.node.create_publisher(kind, "right" if arguments.stereo else depth, qos)
        self.info = self.node.create_publisher(CameraInfo, "camera_info", qos)
        self.imu = self.node.create_publisher(Imu, "imu", 400)
        self.wheels = self.node.create_publisher(Odometry, "wheel_odometry", 400)
        self.clock = self.node.create_publisher(Clock, "/clock", 10)

    def wait(self):
        """Waits for the node, which asks for camera_info reliably and needs it of its first camera only."""
        awaited = [self.color, self.depth] + ([] if self.arguments.best_effort or self.arguments.known else [self.info])
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if all(p.get_subscription_count() for p in awaited):
                return time.sleep(0.5)
            time.sleep(0.05)
        raise SystemExit("nobody subscribes")

    def messages(self, number, frame, stamp):
        """Returns the messages of a frame, the number-th one."""
        camera, half = self.source.camera, 2 if self.arguments.half else 1
        info = CameraInfo(width=camera.width, height=camera.height, distortion_model="plumb_bob", d=[0.0] * 5)
        if number >= self.arguments.uncalibrated:
            info.k = camera.matrix.ravel()
        info.header.frame_id = self.arguments.frame
        info.header.stamp = stamp
        bgr = np.ascontiguousarray(frame.rgb[::half, ::half, ::-1])
        depth = np.ascontiguousarray(frame.depth[::half, ::half])
        if self.arguments.stereo:
            right = right_image(bgr, depth, BASELINE * camera.fx)
            info.p = [camera.fx, 0.0, camera.cx, -BASELINE * camera.fx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0]
            return info, image(bgr, "bgr8", info.header), image(right, "bgr8", info.header)
        if self.arguments.compressed:
            millimeters = np.round(1000 * depth).astype(np.uint16)
            return (info, compressed(bgr, "bgr8; png compressed bgr8", info.header),
                    compressed(millimeters, "16UC1; compressedDepth png", info.header, prefix=bytes(12)))
        return info, image(bgr, "bgr8", info.header), image(depth, "32FC1", info.header)

    def publish_sample(self, sample):
        message = Imu()
        message.header.frame_id = self.arguments.frame
        message.header.stamp = Time(sec=int(sample[0] // 10**9), nanosec=int(sample[0] % 10**9))
        for vector, numbers in ((message.angular_velocity, sample[1:4]), (message.linear_acceleration, sample[4:7])):
            vector.x, vector.y, vector.z = map(float, numbers)
        self.imu.publish(message)

    def publish_odometry(self, sample):
        nanoseconds = round(sample[0] * 1e9)
        message = Odometry(child_frame_id="base_link")
        message.header.frame_id = "wheel_odom"
        message.header.stamp = Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
        p, q = message.pose.pose.position, message.pose.pose.orientation
        p.x, p.y, p.z, q.x, q.y, q.z, q.w = map(float, sample[1:])
        self.wheels.publish(message)

    def play(self):
        frames = list(self.source)
        order = [frame for turn in range(self.arguments.repeat) for frame in (frames, frames[::-1])[turn % 2]]
        begin, waiting = time.monotonic(), []
        samples = np.loadtxt(f"{self.arguments.recording}/imu0/data.csv", delimiter=",") if self.arguments.imu else []
        samples = list(samples)
        odometry = list(np.loadtxt(f"{self.arguments.recording}/odometry.txt") if self.arguments.wheels else [])
        for i, frame in enumerate(order):
            if self.arguments.rate:
                time.sleep(max(0, begin + i / self.arguments.rate - time.monotonic()))
            now = time.time() if self.arguments.now else frame.stamp
            nanoseconds = round((now - self.arguments.back) * 1e9)
            stamp = Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
            if self.arguments.clock:
                self.clock.publish(Clock(clock=stamp))
            while samples and samples[0][0] <= nanoseconds + 10**7:
                self.publish_sample(samples.pop(0))
            while odometry and odometry[0][0] * 1e9 <= nanoseconds + 3 * 10**7:
                self.publish_odometry(odometry.pop(0))
            info, color, depth = self.messages(i, frame, stamp)
            self.info.publish(info)
            self.color.publish(color)
            waiting.append((time.monotonic() + self.arguments.late, depth))
            while waiting and waiting[0][0] <= time.monotonic():
                self.depth.publish(waiting.pop(0)[1])
        for due, depth in waiting:
            time.sleep(max(0, due - time.monotonic()))
            self.depth.publish(depth)


def main():
    arguments = parse()
    rclpy.init()
    camera = Camera(arguments)
    camera.wait()
    camera.play()
    time.sleep(1 if arguments.rate else 600)  # A publisher that ends takes what was not received yet with it.


if __name__ == "__main__":
    main()
