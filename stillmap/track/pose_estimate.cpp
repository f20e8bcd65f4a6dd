// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/pose_estimate.hpp"

#include <limits>

#include <Eigen/LU>

namespace stillmap {
namespace {

/// Variance of a landmark relative to that of a keypoint: landmarks are made of keypoints, most of
/// them of few.
constexpr double kLandmarkVariance = 1;

/// Squared distance from its prior up to which a pose agrees with it [sigma^2]: 99.9 % with three
/// degrees of freedom.
constexpr double kPriorChi2 = 16.3;
/// Factor on the information of a prior with which it decides against all matches.
constexpr double kFirm = 1e4;
/// Least number of inliers of a pose that agrees with the prior, relative to that of the best pose.
/// In a start among people a wrong motion had 1.3 times the inliers of the true one
/// (lab/records/real_sensors.md).
constexpr double kLeastShare = 0.7;

/// @param contradicts  set if the best pose contradicts the prior
PoseSolution solve_near_prior(const Camera& camera, const Pose& guess,
                              const std::vector<PoseObservation>& observations,
                              const std::optional<PosePrior>& prior, bool& contradicts) {
  PoseSolution with_prior = solve_pose(camera, guess, observations, prior);
  const auto agrees = [&](const PoseSolution& solution) {
    return solution.well_posed && prior->chi2(solution.T_world_camera) <= kPriorChi2;
  };
  if (!prior || agrees(with_prior)) return with_prior;
  contradicts = true;
  PoseSolution without = solve_pose(camera, guess, observations);
  const PosePrior firm{prior->T_world_camera, kFirm * prior->information};
  const PoseSolution bound = solve_pose(camera, guess, observations, firm);
  if (!bound.well_posed || bound.inliers < kLeastShare * without.inliers) return without;
  PoseSolution near = solve_pose(camera, bound.T_world_camera, observations, prior);
  return agrees(near) ? near : bound;
}

/// Inverse information times the a posteriori variance of unit weight.
Matrix6d covariance_of(const PoseSolution& solution) {
  return (1 + kLandmarkVariance) * solution.rms * solution.rms * solution.information.inverse();
}

}  // namespace

std::optional<PoseEstimate> estimate_pose(const TrackingModel& model, const Features& features,
                                          const Pose& T_world_camera_guess,
                                          const std::vector<PointMatch>& matches, int min_inliers,
                                          const std::optional<PosePrior>& prior) {
  std::vector<PoseObservation> observations;
  observations.reserve(matches.size());
  for (const PointMatch& match : matches) {
    const Keypoint& k = features.keypoints[match.keypoint];
    observations.push_back({match.p_world, k.u, k.v, k.depth,
                            static_cast<float>(model.pyramid.scale(k.level)), match.weight});
  }
  bool contradicts = false;
  const PoseSolution solution =
      solve_near_prior(model.camera, T_world_camera_guess, observations, prior, contradicts);
  if (!solution.well_posed || solution.inliers < min_inliers) return std::nullopt;
  PoseEstimate estimate{solution.T_world_camera, {}, covariance_of(solution), contradicts};
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
