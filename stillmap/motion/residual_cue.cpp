// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/residual_cue.hpp"

#include "stillmap/geometry/observation_noise.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

/// Number of frames over which positions are compared: more detect slower movers, but fewer
/// keypoints are tracked that long. Chosen on simulated scenes.
constexpr int kBaseline = 10;
/// Log-odds of a residual that does not fit at all, as it may be a false match; chosen on simulated
/// scenes.
constexpr float kWorstLogOdds = -4;

float scale_of(const Keypoint& keypoint, const PyramidShape& pyramid) {
  return std::pow(static_cast<float>(pyramid.scale_factor), static_cast<float>(keypoint.level));
}

}  // namespace

void ResidualCue::add_to(MotionEvidence& evidence, const MotionInput& input) {
  const auto& keypoints = input.features->keypoints;
  std::vector<Trail> trails(keypoints.size());
  if (input.ego_motion) {
    const EgoMotion& ego = *input.ego_motion;
    const Camera& camera = input.cells->image_camera;
    const float max_depth = camera.depth_sensor.depth_at_sigma(kJudgedSigma);
    const Pose T_camera_odometry = ego.T_odometry_camera.inverse();
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      const Keypoint& k = keypoints[i];
      const auto j = static_cast<std::size_t>(ego.previous[i]);
      Trail before;
      if (ego.previous[i] >= 0 && j < trails_.size()) before = trails_[j];
      if (before.valid) {
        const cv::Point cell = input.cells->cell_of(k.u, k.v);
        evidence.surface_measured(cell) += log_odds(before, k, input, T_camera_odometry);
        evidence.surface_observations(cell) += 1;
      }
      if (k.depth <= 0 || k.depth > max_depth) continue;
      const Eigen::Vector3d p_odometry =
          ego.T_odometry_camera * camera.unproject(k.u, k.v, k.depth);
      trails[i] = extended(before, p_odometry.cast<float>(), scale_of(k, input.pyramid));
    }
  }
  trails_ = std::move(trails);
}

ResidualCue::Trail ResidualCue::extended(const Trail& trail, const Eigen::Vector3f& p_odometry,
                                         float scale) {
  if (!trail.valid) return {p_odometry, p_odometry, scale, scale, 0, true};
  Trail next = trail;
  if (++next.age >= kBaseline) {
    next = {trail.newer, p_odometry, trail.newer_scale, scale, 0, true};
  }
  return next;
}

float ResidualCue::log_odds(const Trail& trail, const Keypoint& keypoint, const MotionInput& input,
                            const Pose& T_camera_odometry) {
  const Camera& camera = input.cells->image_camera;
  const Eigen::Vector3d p = T_camera_odometry * trail.older.cast<double>();
  if (p.z() < 0.1) return kWorstLogOdds;
  const Eigen::Vector2d uv = camera.project(p);
  const ObservationNoise noise = observation_noise(camera, keypoint.depth);
  const double s = scale_of(keypoint, input.pyramid);
  const double pose_u = camera.fx * kPoseSigma / p.z();
  const double pose_d = camera.bf() * kPoseSigma / (p.z() * p.z());
  const double variance = noise.pixel_sigma * noise.pixel_sigma *
                              (s * s + static_cast<double>(trail.older_scale) * trail.older_scale) +
                          pose_u * pose_u;
  double chi2 = (uv - Eigen::Vector2d(keypoint.u, keypoint.v)).squaredNorm() / variance;
  if (keypoint.depth > 0) {
    const double d = camera.bf() / p.z() - camera.bf() / keypoint.depth;
    chi2 += d * d / (2 * noise.disparity_sigma * noise.disparity_sigma + pose_d * pose_d);
  }
  return std::max(kWorstLogOdds, static_cast<float>(kBestLogOdds - chi2 / 2));
}

}  // namespace stillmap
