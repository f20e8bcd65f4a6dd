// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/motion_sensors.hpp"
#include "stillmap/recording/rgbd_streams.hpp"

#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// The samples of the inertial measurement unit of a recorded camera.
struct ImuStream {
  std::string topic;               ///< Of the gyroscope.
  std::string accelerometer = {};  ///< Topic of the accelerometer, if it is another one.
  std::string frame = {};          ///< Coordinate frame of the gyroscope.
  /// In the frame of the unit, by increasing time. Accelerations of a separate topic are
  /// interpolated at the times of the gyroscope.
  std::vector<ImuSample> samples = {};
  std::optional<Pose> T_color_imu = {};  ///< Pose in the frame of the color camera, if recorded.
};

/// Returns the samples (sensor_msgs/Imu) of the unit of the camera; none if the recording has none.
/// Of several units the one whose topic begins as that of the color images is taken, then one whose
/// pose is recorded, then the one with most messages. Samples whose time does not increase, and
/// those that are not finite, are left out.
std::optional<ImuStream> find_imu_stream(Recording& recording, const RgbdStreams& streams);

}  // namespace stillmap
