# SPDX-License-Identifier: Apache-2.0
"""Starts the node.

  ros2 launch stillmap_ros stillmap.launch.py camera:=/camera/camera params_file:=my.yaml rviz:=true
"""
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node

# The topics of realsense2_camera with align_depth.enable:=true.
TOPICS = {"color": "color/image_raw", "depth": "aligned_depth_to_color/image_raw", "camera_info": "color/camera_info",
          "right": "infra2/image_rect_raw", "imu": "imu", "wheel_odometry": "wheel_odometry"}


def generate_launch_description():
    share = get_package_share_directory("stillmap_ros")
    arguments = [DeclareLaunchArgument("camera", default_value="/camera/camera", description="namespace of the camera"),
                 DeclareLaunchArgument("params_file", default_value=f"{share}/config/stillmap.yaml"),
                 DeclareLaunchArgument("use_sim_time", default_value="false"),
                 DeclareLaunchArgument("rviz", default_value="false")]
    arguments += [DeclareLaunchArgument(name, default_value=topic) for name, topic in TOPICS.items()]
    remapped = [(name, PathJoinSubstitution([LaunchConfiguration("camera"), LaunchConfiguration(name)])) for name in TOPICS]
    node = Node(package="stillmap_ros", executable="stillmap_node", name="stillmap", output="screen",
                parameters=[LaunchConfiguration("params_file"), {"use_sim_time": LaunchConfiguration("use_sim_time")}],
                remappings=remapped, sigterm_timeout="30")
    rviz = Node(package="rviz2", executable="rviz2", arguments=["-d", f"{share}/config/stillmap.rviz"],
                condition=IfCondition(LaunchConfiguration("rviz")))
    return LaunchDescription([*arguments, node, rviz])
