// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/pose_estimate.hpp"

#include <limits>

#include <Eigen/LU>

namespace stillmap {
namespace {

/// Variance of a landmark relative to that of a keypoint: landmarks are made of keypoints, most of
/// them of few.
constexpr double kLandmarkVariance = 1;

/// Inverse information times the a posteriori variance of unit weight.
Matrix6d covariance_of(const PoseSolution& solution) {
  return (1 + kLandmarkVariance) * solution.rms * solution.rms * solution.information.inverse();
}

}  // namespace

std::optional<PoseEstimate> estimate_pose(const TrackingModel& model, const Features& features,
                                          const Pose& T_world_camera_guess,
                                          const std::vector<PointMatch>& matches, int min_inliers) {
  std::vector<PoseObservation> observations;
  observations.reserve(matches.size());
  for (const PointMatch& match : matches) {
    const Keypoint& k = features.keypoints[match.keypoint];
    observations.push_back({match.p_world, k.u, k.v, k.depth,
                            static_cast<float>(model.pyramid.scale(k.level)), match.weight});
  }
  const PoseSolution solution = solve_pose(model.camera, T_world_camera_guess, observations);
  if (!solution.well_posed || solution.inliers < min_inliers) return std::nullopt;
  PoseEstimate estimate{solution.T_world_camera, {}, covariance_of(solution)};
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (solution.inlier[i]) estimate.matches.push_back(matches[i]);
  }
  return estimate;
}

Chi2 chi2_of(const TrackingModel& model, const Features& features, const Pose& T_world_camera,
             const PointMatch& match) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const Keypoint& k = features.keypoints[match.keypoint];
  const Eigen::Vector3d p = T_world_camera.inverse() * match.p_world;
  if (p.z() < kNearPlane) return {kNever, kNever};
  const ObservationNoise noise = observation_noise(model.camera, k.depth);
  return chi2(
      make_measurement(model.camera, noise, k.u, k.v, k.depth, model.pyramid.scale(k.level)),
      predict(model.camera, p));
}

}  // namespace stillmap
