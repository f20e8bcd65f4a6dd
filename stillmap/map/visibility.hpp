// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/matching.hpp"
#include "stillmap/map/map.hpp"

#include <optional>

namespace stillmap {

/// A camera at a fixed pose, prepared for projecting many landmarks.
class LandmarkProjector {
 public:
  LandmarkProjector(const Camera& camera, const PyramidShape& pyramid, const Pose& T_world_camera)
      : camera_(camera),
        pyramid_(pyramid),
        R_camera_world_(T_world_camera.rotation().transpose()),
        p_world_camera_(T_world_camera.translation()) {}

  /// Returns the depth of a point along the optical axis [m].
  double depth(const Eigen::Vector3d& p_world) const {
    return R_camera_world_.row(2).dot(p_world - p_world_camera_);
  }

  /// Returns the expected image position and pyramid levels of a landmark; nothing if it is behind
  /// the camera, outside the image, at a distance that its patch does not fit, or facing away.
  /// @param Seen             Landmark or LocalLandmark
  /// @param radius           search radius at level 0 [pixels]; grows with the level's scale
  /// @param min_view_cosine  minimum cosine between mean and current viewing direction
  template <typename Seen>
  std::optional<ProjectionQuery> expect(const Seen& landmark, double radius,
                                        double min_view_cosine) const;

 private:
  const Camera& camera_;
  const PyramidShape& pyramid_;
  Eigen::Matrix3d R_camera_world_;
  Eigen::Vector3d p_world_camera_;
};

template <typename Seen>
std::optional<ProjectionQuery> LandmarkProjector::expect(const Seen& landmark, double radius,
                                                         double min_view_cosine) const {
  constexpr double kNear = 0.05;       // Minimum depth [m].
  constexpr double kRangeSlack = 1.2;  // Tolerance of one level at both ends of the distance range.
  const Eigen::Vector3d ray = landmark.p_world - p_world_camera_;
  const Eigen::Vector3d p_camera = R_camera_world_ * ray;
  if (p_camera.z() < kNear) return std::nullopt;
  const Eigen::Vector2d uv = camera_.project(p_camera);
  if (!camera_.contains(uv.x(), uv.y())) return std::nullopt;
  const double range = ray.norm();
  if (landmark.max_distance > 0 && (range * kRangeSlack < landmark.min_distance ||
                                    range > landmark.max_distance * kRangeSlack)) {
    return std::nullopt;
  }
  if (ray.dot(landmark.normal) < min_view_cosine * range) return std::nullopt;
  const int level = expected_level(pyramid_, landmark.max_distance, range);
  ProjectionQuery query;
  query.u = static_cast<float>(uv.x());
  query.v = static_cast<float>(uv.y());
  query.radius = static_cast<float>(radius * pyramid_.scale(level));
  query.min_level = level - 1;
  query.max_level = level + 1;
  query.descriptor = landmark.descriptor;
  return query;
}

}  // namespace stillmap
