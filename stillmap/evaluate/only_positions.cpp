// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/only_positions.hpp"

#include <algorithm>
#include <numbers>

namespace stillmap {
namespace {

/// Largest angle and distance from the first pose [rad, m].
struct Extent {
  double angle = 0, distance = 0;
  bool turned = false;  // whether a rotation is not exactly the identity
};

Extent extent(const Trajectory& trajectory) {
  Extent largest;
  if (trajectory.empty()) return largest;
  const Pose T_first_world = trajectory.front().T_world_camera.inverse();
  for (const StampedPose& pose : trajectory) {
    const Pose T = T_first_world * pose.T_world_camera;
    largest.angle = std::max(largest.angle, T.angle());
    largest.distance = std::max(largest.distance, T.translation().norm());
    const Eigen::Quaterniond& q = pose.T_world_camera.quaternion();
    largest.turned = largest.turned || q.w() != 1 || !q.vec().isZero(0);
  }
  return largest;
}

}  // namespace

bool has_only_positions(const Trajectory& truth, const Trajectory& estimate) {
  constexpr double kNone = 1e-6, kTurn = 5 * std::numbers::pi / 180;  // [rad, m]
  const Extent a = extent(truth), b = extent(estimate);
  const auto lacks_rotations = [](const Extent& one, const Extent& other) {
    const bool other_turns = other.angle > kTurn || (!one.turned && other.turned);
    return one.angle < kNone && one.distance > kNone && other_turns;
  };
  return lacks_rotations(a, b) || lacks_rotations(b, a);
}

}  // namespace stillmap
