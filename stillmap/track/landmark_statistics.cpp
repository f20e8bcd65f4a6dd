// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/landmark_statistics.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/geometry/depth_visibility.hpp"
#include "stillmap/optimize/residual.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stillmap {
namespace {

/// Per-frame decay factor of a landmark's log-odds. They are an average over frames and no sum,
/// because the measurements of consecutive frames are far from independent.
constexpr float kMemory = 0.95F;
/// Log-odds that a landmark is static if the depth image sees through its position.
constexpr float kSeenThroughLogOdds = -3;
/// Bound of the log-odds of a single frame.
constexpr float kMaxLogOdds = 6;

/// Returns the visibility of a landmark: occluded or seen through only if the depth around agrees.
Visibility landmark_visibility(const Eigen::Vector3d& p_camera, const CellGrid& grid) {
  const DepthView view{grid.depth, grid.camera};
  const auto cell = view.inner_pixel(p_camera, kNearPlane);
  if (!cell) return Visibility::kUnknown;
  const auto z = static_cast<float>(p_camera.z());
  return view.visibility_around(*cell, z, grid.tolerance.at(z));
}

}  // namespace

void LandmarkStatistics::adopt(const LocalMapPtr& local_map) {
  auto counts = take();
  std::vector<float> log_odds;
  for (const LocalLandmark& landmark : local_map->landmarks) {
    const LocalLandmark* known = local_map_ ? local_map_->find(landmark.id) : nullptr;
    log_odds.push_back(known != nullptr ? static_log_odds(landmark.id) : landmark.static_log_odds);
  }
  static_log_odds_ = std::move(log_odds);
  counts_of_old_maps_ = std::move(counts);
  local_map_ = local_map;
  predicted_.assign(local_map->landmarks.size(), 0);
  found_.assign(local_map->landmarks.size(), 0);
}

void LandmarkStatistics::update(std::size_t landmark, float log_odds) {
  float& mean = static_log_odds_[landmark];
  mean += (1 - kMemory) * (std::clamp(log_odds, -kMaxLogOdds, kMaxLogOdds) - mean);
}

void LandmarkStatistics::count(const Frame& frame, const LocalMapPose& pose) {
  const TraceScope scope("visibility_counts");
  const Pose T_camera_world = pose.estimate.T_world_camera.inverse();
  for (std::size_t i = 0; i < pose.expected.size(); ++i) {
    if (!pose.expected[i]) continue;
    const Visibility visibility =
        landmark_visibility(T_camera_world * local_map_->landmarks[i].p_world, *frame.cells);
    predicted_[i] += visibility != Visibility::kOccluded || !options_.occlusion_test;
    if (options_.seen_through && visibility == Visibility::kSeenThrough)
      update(i, kSeenThroughLogOdds);
  }
  const auto& measured = frame.evidence.measured_log_odds.empty()
                             ? frame.evidence.static_log_odds
                             : frame.evidence.measured_log_odds;
  for (const PointMatch& match : pose.estimate.matches) {
    const std::size_t i = local_map_->index(match.landmark);
    ++found_[i];
    update(i, measured[match.keypoint]);
  }
}

std::vector<VisibilityCount> LandmarkStatistics::take() {
  std::vector<VisibilityCount> counts = std::exchange(counts_of_old_maps_, {});
  for (std::size_t i = 0; i < predicted_.size(); ++i) {
    if (predicted_[i] > 0) {
      counts.push_back(
          {local_map_->landmarks[i].id, predicted_[i], found_[i], static_log_odds_[i]});
      predicted_[i] = found_[i] = 0;
    }
  }
  return counts;
}

}  // namespace stillmap
