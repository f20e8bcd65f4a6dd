// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/loop/ransac.hpp"
#include "stillmap/optimize/residual.hpp"

#include <optional>
#include <span>

namespace stillmap {

/// "These two are one thing", seen by cameras a and b, each with a place in its own camera's frame.
struct RigidPair {
  Eigen::Vector3d p_a = Eigen::Vector3d::Zero(), p_b = Eigen::Vector3d::Zero();    ///< meters
  Eigen::Vector2d uv_a = Eigen::Vector2d::Zero(), uv_b = Eigen::Vector2d::Zero();  ///< pixels
  double scale_a = 1, scale_b = 1;  ///< of the keypoints' pyramid levels
};

/// "This pixel shows that point."
struct AbsolutePair {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< meters
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();       ///< pixels
  double scale = 1;                                   ///< of the keypoint's pyramid level
};

struct PoseRansacOptions {
  ConsensusOptions ransac;
  double pixel_sigma = 1.5;  ///< reprojection error at level 0, that of a guess from few points
  double chi2 = 9.21;        ///< inlier bound [sigma^2]: 99 % of two degrees of freedom
  STILLMAP_FIELDS(ransac, pixel_sigma, chi2)
};

/// The rigid motion T_a_b that most pairs agree on: three pairs give one (Horn 1987, scale known),
/// and a pair agrees if each camera sees the other's point where it sees its own. Judged by
/// reprojection, because a depth's error grows with its square and a pixel's does not. At last
/// fitted to all that agree.
std::optional<Consensus<Pose>> find_rigid_motion(const Camera& camera,
                                                 std::span<const RigidPair> pairs,
                                                 const PoseRansacOptions& options = {});

/// T_world_camera from pixels of known points, without any depth: three give up to four poses (Ke
/// and Roumeliotis, An Efficient Algebraic Solution to the Perspective-Three-Point Problem, CVPR
/// 2017, as in OpenCV), judged by reprojection.
std::optional<Consensus<Pose>> find_absolute_pose(const Camera& camera,
                                                  std::span<const AbsolutePair> pairs,
                                                  const PoseRansacOptions& options = {});

}  // namespace stillmap
