// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/features.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/map/map.hpp"
#include "stillmap/optimize/pose_solver.hpp"

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Match of a keypoint with a point in the world.
struct PointMatch {
  std::uint32_t keypoint = 0;
  LandmarkId landmark;  ///< invalid for a point of the previous frame that is no landmark
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< [m]
  float weight = 1;                                   ///< factor of its information [0..1]
};

/// Pose of a frame and the matches that agree with it.
struct PoseEstimate {
  Pose T_world_camera;
  std::vector<PointMatch> matches;  ///< inliers only
  /// Covariance of the perturbation (v, w) in T_world_camera exp(v, w), from the residuals of the
  /// inliers: see pose_covariance() [m^2, rad^2].
  Matrix6d covariance = Matrix6d::Zero();
  /// Whether the pose contradicts the prior: too few matches agree with any near it.
  bool contradicts_prior = false;
};

/// Camera and feature pyramid of a sequence.
struct TrackingModel {
  Camera camera;
  PyramidShape pyramid;
};

/// Largest Hamming distance of a match, of 256 bits. ORB-SLAM2 accepts up to 100 (TH_HIGH).
inline constexpr int kMaxMatchDistance = 90;
/// Largest ratio of the best to the second-best distance of a match (Lowe, IJCV 2004).
inline constexpr double kMatchRatio = 0.8;
/// Inliers below which a pose from the previous frame or the reference keyframe is rejected.
inline constexpr int kMinInliers = 15;
/// Inliers from which a pose is accepted without further support.
inline constexpr int kSureInliers = 40;

/// Returns the pose that minimizes the reprojection errors of the matches, or none if the problem
/// is not well posed or fewer than `min_inliers` matches agree. If another motion than that of the
/// prior fits most matches, such as that of somebody near the camera, the best pose that agrees
/// with the prior is returned, unless hardly any match tells for it.
std::optional<PoseEstimate> estimate_pose(const TrackingModel& model, const Features& features,
                                          const Pose& T_world_camera_guess,
                                          const std::vector<PointMatch>& matches, int min_inliers,
                                          const std::optional<PosePrior>& prior = std::nullopt);

/// Returns the squared residuals of a match at a pose; infinite for a point behind the camera.
Chi2 chi2_of(const TrackingModel& model, const Features& features, const Pose& T_world_camera,
             const PointMatch& match);

}  // namespace stillmap
