// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/motion_compensation.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/orb_extractor.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
Eigen::Vector3d MotionCompensation::at_moment(const Eigen::Vector3d& p, double dt) const {
  return moved_point(p, dt, v_, w_);
}

/// Returns the depth of a point of the color image, read from the depth image that was exposed
/// `depth_delay` [s] later [m]; 0 if unknown.
double MotionCompensation::depth_seen_from(const Eigen::Vector3d& p, double depth_delay) const {
  const Eigen::Vector2d uv = camera_.project(at_moment(p, -depth_delay));
  if (!camera_.contains(uv.x(), uv.y())) return 0;
  const float z = depth_at(image_.depth, static_cast<float>(uv.x()), static_cast<float>(uv.y()),
                           depth_edge_of(camera_.depth_sensor));
  return z > 0 ? at_moment(camera_.unproject(uv.x(), uv.y(), z), depth_delay).z() : 0;
}

Keypoint MotionCompensation::keypoint(const Keypoint& recorded, const ShutterTiming& timing) const {
  const double depth_delay = image_.depth_delay + timing.depth_delay;
  double z = recorded.depth;
  if (depth_delay != 0) {
    const double guess = z > 0 ? z : kTypicalDepth;
    z = depth_seen_from(camera_.unproject(recorded.u, recorded.v, guess), depth_delay);
  }
  const double row_time = (recorded.v / camera_.height - 0.5) * timing.readout;
  const Eigen::Vector3d p =
      at_moment(camera_.unproject(recorded.u, recorded.v, z > 0 ? z : kTypicalDepth), row_time);
  const Eigen::Vector2d uv = camera_.project(p);
  Keypoint result = recorded;
  result.u = static_cast<float>(uv.x());
  result.v = static_cast<float>(uv.y());
  result.depth = z > 0 ? static_cast<float>(p.z()) : 0.0F;
  return result;
}

Features MotionCompensation::features(const Features& recorded, const ShutterTiming& timing) const {
  const TraceScope scope("motion compensation");
  Features result;
  result.keypoints.reserve(recorded.size());
  for (const Keypoint& k : recorded.keypoints) result.keypoints.push_back(keypoint(k, timing));
  result.descriptors = recorded.descriptors;
  result.grid = KeypointGrid(result.keypoints, camera_.width, camera_.height);
  return result;
}

double MotionCompensation::rms(const Features& recorded, const ShutterTiming& timing) const {
  double squares = 0;
  for (const Keypoint& k : recorded.keypoints) {
    const Keypoint moved = keypoint(k, timing);
    squares += std::pow(moved.u - k.u, 2) + std::pow(moved.v - k.v, 2);
  }
  return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(recorded.size(), 1)));
}

}  // namespace stillmap
