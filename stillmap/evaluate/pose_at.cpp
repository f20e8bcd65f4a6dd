// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/pose_at.hpp"

#include <algorithm>
#include <iterator>

namespace stillmap {
namespace {

constexpr double kMaxGap = 0.1;  // between stamps that are interpolated [s]

}  // namespace

std::optional<Pose> pose_at(const Trajectory& trajectory, double timestamp) {
  const auto after = std::lower_bound(
      trajectory.begin(), trajectory.end(), timestamp,
      [](const StampedPose& pose, double stamp) { return pose.timestamp < stamp; });
  if (after != trajectory.end() && after->timestamp == timestamp) return after->T_world_camera;
  if (after == trajectory.begin() || after == trajectory.end()) return std::nullopt;
  const auto before = std::prev(after);
  const double gap = after->timestamp - before->timestamp;
  if (gap > kMaxGap) return std::nullopt;
  return interpolate(before->T_world_camera, after->T_world_camera,
                     (timestamp - before->timestamp) / gap);
}

}  // namespace stillmap
