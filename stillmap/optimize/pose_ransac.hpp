// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/optimize/ransac.hpp"
#include "stillmap/optimize/residual.hpp"

#include <optional>
#include <span>

namespace stillmap {

/// A pair of corresponding points seen by cameras a and b.
struct RigidPair {
  Eigen::Vector3d p_a = Eigen::Vector3d::Zero(),
                  p_b = Eigen::Vector3d::Zero();  ///< In the own camera frame [m].
  Eigen::Vector2d uv_a = Eigen::Vector2d::Zero(),
                  uv_b = Eigen::Vector2d::Zero();  ///< Pixel positions.
  double scale_a = 1, scale_b = 1;  ///< Scale factors of the keypoints' pyramid levels.
};

/// A pair of a pixel and the point that it shows.
struct AbsolutePair {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< World position [m].
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();       ///< Pixel position.
  double scale = 1;  ///< Scale factor of the keypoint's pyramid level.
};

/// Returns the rigid motion T_a_b with most inliers (at least `min_inliers`), from samples of three
/// pairs (Horn 1987, scale known). A pair is an inlier if both cameras see the other's point near
/// their own pixel: reprojection is used because a depth error grows with the square of the depth.
/// Finally fitted to all inliers.
std::optional<Consensus<Pose>> find_rigid_motion(const Camera& camera,
                                                 std::span<const RigidPair> pairs, int min_inliers);

/// Returns the number of pairs that agree with T_a_b, as in find_rigid_motion().
int count_agreeing(const Camera& camera, std::span<const RigidPair> pairs, const Pose& T_a_b);

/// Returns T_world_camera from pixels of known points without depth: samples of three give up to
/// four poses (Ke and Roumeliotis, An Efficient Algebraic Solution to the Perspective-Three-Point
/// Problem, CVPR 2017, as in OpenCV), judged by reprojection; at least `min_inliers`.
std::optional<Consensus<Pose>> find_absolute_pose(const Camera& camera,
                                                  std::span<const AbsolutePair> pairs,
                                                  int min_inliers);

}  // namespace stillmap
