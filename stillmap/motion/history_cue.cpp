// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/history_cue.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Number of uninformative observations that are added to those of each surface.
constexpr double kDoubt = 1.0;
/// Share of a surface's log-odds that is kept for the next frame; chosen on simulated scenes.
constexpr double kMemory = 0.8;
/// Bounds of the log-odds of a surface and of a landmark.
constexpr double kHighestLogOdds = 3, kLowestLogOdds = -6;
/// Weight of a landmark's log-odds for the keypoint that shows it.
constexpr double kLandmarkWeight = 0.5;

}  // namespace

void SurfaceCue::add_to(MotionEvidence& evidence, const MotionInput& input) {
  const SurfaceSpread spread(*input.cells);
  const cv::Mat1f sum = spread(evidence.surface_measured);
  const cv::Mat1f count = spread(evidence.surface_observations);
  const auto doubt = static_cast<float>(kDoubt);
  evidence.surface_measured = sum / (count + doubt);
  evidence.surface_observations.setTo(1);
}

void HistoryCue::add_to(MotionEvidence& evidence, const MotionInput& input) {
  const auto most = static_cast<float>(kHighestLogOdds), least = static_cast<float>(kLowestLogOdds);
  cv::Mat1f& surfaces = evidence.surface_measured;
  if (input.ego_motion) {
    const EgoMotion& ego = *input.ego_motion;
    const DepthPolynomial<float>& tolerance = input.cells->tolerance;
    const cv::Mat1f& depth_before = input.previous->cells->depth;
    const cv::Mat1f& measured_before = input.previous->evidence.surface_measured;
    const auto memory = static_cast<float>(kMemory);
    const Reprojection reprojection(*input.cells,
                                    ego.T_odometry_previous.inverse() * ego.T_odometry_camera,
                                    input.exposure, input.previous->exposure);
    for_each_reprojected(*input.cells, reprojection, [&](int r, int c, float, int before, float z) {
      if (std::abs(depth_before(before) - z) > tolerance.at(z)) return;
      surfaces(r, c) += memory * measured_before(before);
    });
  }
  surfaces = cv::max(least, cv::min(most, surfaces));
  if (!input.ego_motion) return;
  for (std::size_t i = 0; i < evidence.static_log_odds.size(); ++i) {
    evidence.static_log_odds[i] += static_cast<float>(kLandmarkWeight) *
                                   std::clamp(input.ego_motion->landmark_log_odds[i], least, most);
  }
}

}  // namespace stillmap
