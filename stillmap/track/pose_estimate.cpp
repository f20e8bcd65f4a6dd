// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/pose_estimate.hpp"

#include <limits>

#include <Eigen/LU>

namespace stillmap {
namespace {

/// Variance of a landmark relative to that of a keypoint: landmarks are made of keypoints, most of
/// them of few.
constexpr double kLandmarkVariance = 1;

/// Squared distance from its prior up to which a pose agrees with it [sigma^2]: 99.9 % with six
/// degrees of freedom.
constexpr double kPriorChi2 = 22.46;
/// Factor on the information of a prior with which it decides against all matches.
constexpr double kFirm = 1e4;
/// Of the matches that agree with either the pose near the prior or the one without it, the least
/// number and share that must agree with the former. Where the prior is wrong only outliers do.
constexpr int kLeastSupport = 10;
constexpr double kLeastShare = 0.1;

bool agrees(const PoseSolution& solution, const PosePrior& prior) {
  return solution.well_posed && prior.chi2(solution.T_world_camera) <= kPriorChi2;
}

/// Returns whether enough matches tell for the motion of the prior: those of the background if
/// somebody near the camera has the others.
bool is_supported(const PoseSolution& near, const PoseSolution& without) {
  int only_near = 0, only_without = 0;
  for (std::size_t i = 0; i < near.inlier.size(); ++i) {
    only_near += near.inlier[i] && !without.inlier[i];
    only_without += without.inlier[i] && !near.inlier[i];
  }
  return near.well_posed && only_near >= kLeastSupport &&
         only_near >= kLeastShare * (only_near + only_without);
}

PoseSolution solve_near_prior(const Camera& camera, const Pose& guess,
                              const std::vector<PoseObservation>& observations,
                              const std::optional<PosePrior>& prior) {
  PoseSolution with_prior = solve_pose(camera, guess, observations, prior);
  if (!prior || agrees(with_prior, *prior)) return with_prior;
  PoseSolution without = solve_pose(camera, guess, observations);
  const PosePrior firm{prior->T_world_camera, kFirm * prior->information};
  PoseSolution bound = solve_pose(camera, prior->T_world_camera, observations, firm);
  if (!is_supported(bound, without)) return without;
  PoseSolution near = solve_pose(camera, bound.T_world_camera, observations, prior);
  return agrees(near, *prior) ? near : bound;
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
  const PoseSolution solution =
      solve_near_prior(model.camera, T_world_camera_guess, observations, prior);
  if (!solution.well_posed || solution.inliers < min_inliers) return std::nullopt;
  PoseEstimate estimate{solution.T_world_camera, {}, covariance_of(solution)};
  estimate.contradicts_prior = prior && !agrees(solution, *prior);
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
