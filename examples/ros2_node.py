#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""ROS 2 node: subscribes to color, registered depth and camera_info, and publishes the pose of the camera.

  ros2_node.py RESULTS --ros-args -r color:=/camera/color/image_raw -r depth:=/camera/aligned_depth_to_color/image_raw \\
               -r camera_info:=/camera/color/camera_info

Not tried: there was no ROS 2 where it was written. pixels_of() and camera_of() are tested with stand-ins for messages.
"""
import sys

import numpy as np

import stillmap


def pixels_of(message):
    """Image of a message: uint8 RGB for rgb8 and bgr8, uint16 [mm] for 16UC1, float32 [m] for 32FC1."""
    kind, channels = {"rgb8": (np.uint8, 3), "bgr8": (np.uint8, 3), "16UC1": (np.uint16, 1), "32FC1": (np.float32, 1)}[message.encoding]
    rows = np.frombuffer(message.data, np.uint8).reshape(message.height, message.step)
    rows = np.ascontiguousarray(rows[:, : message.width * channels * np.dtype(kind).itemsize])
    image = rows.view(kind).reshape(message.height, message.width, channels)
    return np.ascontiguousarray(image[:, :, ::-1]) if message.encoding == "bgr8" else image.squeeze()


def camera_of(info):
    """Camera of a CameraInfo message; depth is in millimeters or float."""
    k, d = list(info.k), list(info.d)
    return stillmap.Camera(info.width, info.height, k[0], k[4], k[2], k[5], distortion=(d + [0.0] * 5)[:5], depth_factor=1000)


def main():
    import message_filters
    import rclpy
    from geometry_msgs.msg import PoseStamped
    from scipy.spatial.transform import Rotation
    from sensor_msgs.msg import CameraInfo, Image

    rclpy.init(args=sys.argv)
    node = rclpy.create_node("stillmap")
    publisher = node.create_publisher(PoseStamped, "camera_pose", 10)
    slam = None

    def on_images(color, depth, info):
        nonlocal slam
        slam = slam or stillmap.Slam(camera_of(info), {"schedule.mode": "realtime"})
        pose = slam.push(pixels_of(color), pixels_of(depth), color.header.stamp.sec + color.header.stamp.nanosec / 1e9)
        if pose is None:
            return
        message = PoseStamped(header=color.header)
        message.header.frame_id = "map"
        position, rotation = message.pose.position, message.pose.orientation
        position.x, position.y, position.z = pose[:3, 3]
        rotation.x, rotation.y, rotation.z, rotation.w = Rotation.from_matrix(pose[:3, :3]).as_quat()
        publisher.publish(message)

    topics = [message_filters.Subscriber(node, kind, name, qos_profile=rclpy.qos.qos_profile_sensor_data)
              for kind, name in ((Image, "color"), (Image, "depth"), (CameraInfo, "camera_info"))]
    message_filters.ApproximateTimeSynchronizer(topics, 2, 0.02).registerCallback(on_images)
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    if slam:
        slam.finish().write(sys.argv[1])


if __name__ == "__main__":
    main()
