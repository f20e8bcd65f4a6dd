#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""ROS 2 node: subscribes to color, registered depth and camera_info, and publishes the pose of the camera.

  ros2_node.py RESULTS --ros-args -r color:=/camera/color/image_raw -r depth:=/camera/aligned_depth_to_color/image_raw \\
               -r camera_info:=/camera/color/camera_info -p sensor:=realsense_d435i

sensor: noise model of the depth (default: kinect_v1). A color topic whose name contains "rect" is taken as rectified.
Not tried: there was no ROS 2 where it was written. The conversion of messages is tested with stand-ins.
"""
import collections
import sys

import live
import message_filters
import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CameraInfo, Image

SAME, REVERSED, FIRST = slice(0, 3), slice(2, None, -1), 0  # channels of a pixel that are used
ENCODINGS = {"rgb8": (np.uint8, 3, SAME), "rgba8": (np.uint8, 4, SAME), "bgr8": (np.uint8, 3, REVERSED),
             "bgra8": (np.uint8, 4, REVERSED), "8UC3": (np.uint8, 3, REVERSED), "mono8": (np.uint8, 1, FIRST),
             "8UC1": (np.uint8, 1, FIRST), "mono16": (np.uint16, 1, FIRST), "16UC1": (np.uint16, 1, FIRST),
             "32FC1": (np.float32, 1, FIRST)}


def pixels_of(message):
    """Returns the image of a message: uint8 RGB or gray, uint16 [mm] or float32 [m]."""
    if message.encoding not in ENCODINGS:
        raise ValueError(f"images of the encoding '{message.encoding}' are not read\n"
                         f"  fix: give a topic with one of {', '.join(ENCODINGS)}, such as those of image_proc")
    kind, channels, used = ENCODINGS[message.encoding]
    stored = np.dtype(kind).newbyteorder(">" if message.is_bigendian else "<")
    rows = np.frombuffer(message.data, np.uint8).reshape(message.height, message.step)
    rows = np.ascontiguousarray(rows[:, : message.width * channels * stored.itemsize])
    return rows.view(stored).reshape(message.height, message.width, channels)[:, :, used].astype(kind)


def camera_of(info, sensor, rectified=False):
    """Returns the camera of a CameraInfo message; rectified: of the images that image_proc rectified."""
    matrix = np.reshape(info.p if rectified else info.k, (3, -1))
    return live.camera_of((info.width, info.height), matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2],
                          info.distortion_model or "none", [] if rectified else info.d, sensor=sensor)


def pose_message(pose, header):
    message = PoseStamped(header=header)
    message.header.frame_id = "map"
    position, rotation = message.pose.position, message.pose.orientation
    position.x, position.y, position.z = pose[:3, 3]
    rotation.x, rotation.y, rotation.z, rotation.w = Rotation.from_matrix(pose[:3, :3]).as_quat()
    return message


def messages_of(node):
    """Returns synchronous messages (color, depth, camera_info). It waits for topics without a limit."""
    newest = collections.deque(maxlen=1)
    topics = [message_filters.Subscriber(node, kind, name, qos_profile=qos_profile_sensor_data)
              for kind, name in ((Image, "color"), (Image, "depth"), (CameraInfo, "camera_info"))]
    synchronizer = message_filters.ApproximateTimeSynchronizer(topics, 2, 0.02)
    synchronizer.registerCallback(lambda *messages: newest.append(messages))
    while True:
        rclpy.spin_once(node, timeout_sec=1)
        if newest:
            yield newest.pop()


def main():
    parser = live.parser(__doc__)
    results = parser.parse_args(remove_ros_args(sys.argv)[1:]).results
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)  # Ctrl-C ends live.run().
    node = rclpy.create_node("stillmap")
    sensor = node.declare_parameter("sensor", "kinect_v1").value
    publisher, messages = node.create_publisher(PoseStamped, "camera_pose", 10), messages_of(node)
    camera = camera_of(next(messages)[2], sensor, "rect" in node.resolve_topic_name("color"))
    header = None

    def frames():
        nonlocal header
        for color, depth, _ in messages:
            header = color.header
            yield pixels_of(color), pixels_of(depth), header.stamp.sec + header.stamp.nanosec / 1e9

    def publish(pose):
        if pose is not None:
            publisher.publish(pose_message(pose, header))

    return live.run(camera, frames(), results, publish)


if __name__ == "__main__":
    live.start(main)
