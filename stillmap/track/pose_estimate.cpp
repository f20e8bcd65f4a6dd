// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/pose_estimate.hpp"

#include "stillmap/geometry/contradiction.hpp"
#include "stillmap/optimize/pose_covariance.hpp"

#include <limits>

namespace stillmap {
namespace {

/// Factor on the information of a prior with which it decides against all matches.
constexpr double kFirm = 1e4;
/// Of the matches that agree with the pose near the prior or with the one without it, and clearly
/// fit one of them better, the least number and share that must fit the former: squared residuals
/// differ by kClearly or more. Where the prior is wrong, few do by chance.
constexpr int kLeastSupport = 10;
constexpr double kLeastShare = 0.12, kClearly = 1;

bool agrees(const PoseSolution& solution, const PosePrior& prior) {
  return solution.well_posed && prior.chi2(solution.T_world_camera) <= kContradiction;
}

/// The matches of a frame.
struct Problem {
  const TrackingModel& model;
  const Features& features;
  const std::vector<PointMatch>& matches;
  std::vector<PoseObservation> observations;  // one per match

  PoseSolution solve(const Pose& guess, const std::optional<PosePrior>& prior) const {
    return solve_pose(model.camera, guess, observations, prior);
  }
};

/// Returns whether enough matches tell for the motion of the prior: those of the background if
/// somebody near the camera has the others.
bool is_supported(const Problem& problem, const PoseSolution& near, const PoseSolution& without) {
  int for_near = 0, for_without = 0;
  for (std::size_t i = 0; i < problem.matches.size(); ++i) {
    if (!near.inlier[i] && !without.inlier[i]) continue;
    const auto residual = [&](const PoseSolution& solution) {
      const Chi2 chi2 =
          chi2_of(problem.model, problem.features, solution.T_world_camera, problem.matches[i]);
      return chi2.pixel + chi2.disparity;
    };
    const double difference = residual(without) - residual(near);
    for_near += difference > kClearly;
    for_without += difference < -kClearly;
  }
  return near.well_posed && for_near >= kLeastSupport &&
         for_near >= kLeastShare * (for_near + for_without);
}

PoseSolution solve_near_prior(const Problem& problem, const Pose& guess,
                              const std::optional<PosePrior>& prior) {
  PoseSolution with_prior = problem.solve(guess, prior);
  if (!prior || agrees(with_prior, *prior)) return with_prior;
  PoseSolution without = problem.solve(guess, std::nullopt);
  const PosePrior firm{prior->T_world_camera, kFirm * prior->information};
  PoseSolution bound = problem.solve(prior->T_world_camera, firm);
  if (!is_supported(problem, bound, without)) return without;
  PoseSolution near = problem.solve(bound.T_world_camera, prior);
  return agrees(near, *prior) ? near : bound;
}

}  // namespace

std::optional<PoseEstimate> estimate_pose(const TrackingModel& model, const Features& features,
                                          const Pose& T_world_camera_guess,
                                          const std::vector<PointMatch>& matches, int min_inliers,
                                          const std::optional<PosePrior>& prior) {
  Problem problem{model, features, matches, {}};
  problem.observations.reserve(matches.size());
  for (const PointMatch& match : matches) {
    const Keypoint& k = features.keypoints[match.keypoint];
    problem.observations.push_back({match.p_world, k.u, k.v, k.depth,
                                    static_cast<float>(model.pyramid.scale(k.level)),
                                    match.weight});
  }
  const PoseSolution solution = solve_near_prior(problem, T_world_camera_guess, prior);
  if (!solution.well_posed || solution.inliers < min_inliers) return std::nullopt;
  PoseEstimate estimate{
      solution.T_world_camera, {}, pose_covariance(model.camera, problem.observations, solution)};
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
