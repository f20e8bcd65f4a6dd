// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/recorded_path.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace stillmap::simulate {
namespace {

constexpr double kKnotInterval = 0.05;  // s

/// Returns the mean of poses, of which the rotations are alike.
Pose weighted_mean(const std::vector<std::pair<double, Pose>>& poses) {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector4d rotation = Eigen::Vector4d::Zero();
  const Eigen::Vector4d reference = poses.front().second.quaternion().coeffs();
  for (const auto& [weight, pose] : poses) {
    const Eigen::Vector4d q = pose.quaternion().coeffs();
    position += weight * pose.translation();
    rotation += (q.dot(reference) < 0 ? -weight : weight) * q;
  }
  return Pose(Eigen::Quaterniond(rotation.normalized()), position);
}

/// Returns the pose by the recorded ones around a time.
Pose recorded_at(const Trajectory& trajectory, double timestamp) {
  const auto is_before = [](const StampedPose& pose, double time) { return pose.timestamp < time; };
  const auto at = [&](double time) {
    return std::lower_bound(trajectory.begin(), trajectory.end(), time, is_before);
  };
  const auto begin = at(timestamp - kKnotInterval / 2), end = at(timestamp + kKnotInterval / 2);
  if (begin != end) {
    std::vector<std::pair<double, Pose>> near;
    for (auto pose = begin; pose != end; ++pose)
      near.emplace_back(1.0 / static_cast<double>(end - begin), pose->T_world_camera);
    return weighted_mean(near);
  }
  if (begin == trajectory.begin()) return begin->T_world_camera;
  if (begin == trajectory.end()) return trajectory.back().T_world_camera;
  const auto before = begin - 1;
  const double share = (timestamp - before->timestamp) / (begin->timestamp - before->timestamp);
  return interpolate(before->T_world_camera, begin->T_world_camera, share);
}

}  // namespace

RecordedPath::RecordedPath(const Trajectory& trajectory)
    : duration_(trajectory.back().timestamp - trajectory.front().timestamp) {
  const double start = trajectory.front().timestamp;
  const Pose T_first_world = trajectory.front().T_world_camera.inverse();
  const int intervals = static_cast<int>(std::ceil(duration_ / kKnotInterval));
  for (int i = -1; i <= intervals + 1; ++i) {
    const double seconds = std::clamp(i * kKnotInterval, 0.0, duration_);
    knots_.push_back(T_first_world * recorded_at(trajectory, start + seconds));
  }
}

Pose RecordedPath::at(double seconds) const {
  const double position = std::clamp(seconds, 0.0, duration_) / kKnotInterval;
  const auto last = static_cast<double>(knots_.size()) - 4;
  const double interval = std::min(std::floor(position), last);
  const double u = position - interval, u2 = u * u, u3 = u2 * u;
  // Uniform cubic B-spline (de Boor, A Practical Guide to Splines, 1978).
  const std::array<double, 4> weights{(1 - 3 * u + 3 * u2 - u3) / 6, (4 - 6 * u2 + 3 * u3) / 6,
                                      (1 + 3 * u + 3 * u2 - 3 * u3) / 6, u3 / 6};
  std::vector<std::pair<double, Pose>> around;
  for (std::size_t i = 0; i < weights.size(); ++i)
    around.emplace_back(weights.at(i), knots_[static_cast<std::size_t>(interval) + i]);
  return weighted_mean(around);
}

RecordedPath read_path(const std::filesystem::path& file) {
  const Trajectory trajectory = read_trajectory(file);
  if (trajectory.size() < 2)
    throw Error("one pose is no motion of a camera", file.string(), "name a trajectory");
  return RecordedPath(trajectory);
}

}  // namespace stillmap::simulate
