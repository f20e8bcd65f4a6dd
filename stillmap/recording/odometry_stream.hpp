// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/motion_sensors.hpp"
#include "stillmap/recording/rgbd_streams.hpp"

#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// The odometry of a recorded robot.
struct OdometryStream {
  std::string topic;
  std::string frame = {};                    ///< Coordinate frame of the base (child_frame_id).
  std::vector<OdometrySample> samples = {};  ///< By increasing time.
  std::optional<Pose> T_color_base = {};     ///< In the frame of the color camera, if recorded.
};

/// Returns the messages nav_msgs/Odometry of the topic that has most of them; of those only whose
/// base has a recorded pose in the frame of the color camera if there are any. None if the
/// recording has none. Messages whose time does not increase, and those that are no rigid motion,
/// are left out.
std::optional<OdometryStream> find_odometry_stream(Recording& recording,
                                                   const RgbdStreams& streams);

}  // namespace stillmap
