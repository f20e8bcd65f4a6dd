// SPDX-License-Identifier: Apache-2.0
// Data that the recorder of librealsense writes in addition to images: ROS 1 bags (to version 2.55)
// and files of rosbag2 (since 2.56). The topics of a stream begin with /device_0/sensor_1/Color_0.
#pragma once
#include "stillmap/geometry/pose.hpp"
#include "stillmap/recording/recording.hpp"
#include "stillmap/recording/rgbd_streams.hpp"

#include <optional>
#include <string>

namespace stillmap {

/// Returns the pose of the depth camera or the IMU in the frame of the color camera, T_color_other,
/// of a ROS 1 bag; none for other recordings. Files of rosbag2 contain /tf_static.
/// @param color, other  topics of the images or samples
std::optional<Pose> realsense_extrinsics(Recording& recording, const std::string& color,
                                         const std::string& other);

/// Returns the unit of 16-bit depth images [m]; none for other recordings.
std::optional<double> realsense_depth_unit(Recording& recording, const std::string& depth);

/// Returns whether the distortion of a camera is the inverse model, which files of rosbag2 call
/// plumb_bob in their CameraInfo.
bool realsense_inverts_distortion(Recording& recording, const std::string& image);

/// Replaces the stamps of images or samples by the timestamps of the camera, which files of rosbag2
/// contain in a text message with each of them; their own stamps are the times of arrival there.
/// @param topic  of the images or samples
void use_realsense_timestamps(Recording& recording, const std::string& topic,
                              std::vector<MessageEntry>& entries);

/// Returns the name of the depth sensor for find_depth_sensor(); empty for other recordings.
std::string realsense_sensor(Recording& recording);

}  // namespace stillmap
