// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/keyframe_proposal.hpp"
#include "stillmap/map/local_map.hpp"
#include "stillmap/track/local_map_tracking.hpp"

#include <cstdint>
#include <vector>

namespace stillmap {

struct LandmarkStatisticsOptions {
  /// Whether a landmark that the depth image sees through counts as moving.
  bool seen_through = true;
  /// Whether landmarks occluded by a nearer surface do not count as expected.
  bool occlusion_test = true;
};

/// Counts for each landmark of the local map how often it was expected and found, and filters the
/// log-odds that it is static.
class LandmarkStatistics {
 public:
  explicit LandmarkStatistics(const LandmarkStatisticsOptions& options = {}) : options_(options) {}

  /// Changes to a new local map. Keeps the log-odds of landmarks that the old one contained and the
  /// counts that were not taken yet.
  void adopt(const LocalMapPtr& local_map);

  /// Returns the log-odds that a landmark of the local map is static.
  float static_log_odds(LandmarkId id) const { return static_log_odds_[local_map_->index(id)]; }

  /// Adds the observations of a frame. A landmark that a nearer surface occludes is not counted as
  /// expected. One that the depth image sees through is probably moving: it gets log-odds of -3, by
  /// which cull_landmarks() erases it after 9 frames in a row.
  void count(const Frame& frame, const LocalMapPose& pose);

  /// Returns the counts since the last call and resets them.
  std::vector<VisibilityCount> take();

 private:
  void update(std::size_t landmark, float log_odds);

  LandmarkStatisticsOptions options_;
  LocalMapPtr local_map_;
  std::vector<VisibilityCount> counts_of_old_maps_;
  std::vector<std::uint32_t> predicted_, found_;  // per landmark of local_map_ [frames]
  std::vector<float> static_log_odds_;            // per landmark of local_map_
};

}  // namespace stillmap
