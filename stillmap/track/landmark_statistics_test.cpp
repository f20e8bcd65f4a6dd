// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/landmark_statistics.hpp"

#include "stillmap/track/rendered_track_test.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace rendered;  // NOLINT(google-build-using-namespace)

/// Returns the pose of the reference frame with every landmark expected and none matched.
LocalMapPose all_expected() {
  return {{true_pose(kReference), {}}, std::vector<char>(local_map()->landmarks.size(), 1)};
}

/// Returns the reference frame with its depth changed by a factor.
FramePtr scaled_depth(double factor) {
  auto result = changeable(kReference);
  auto cells = std::make_shared<CellGrid>(*result->cells);
  cells->depth = cv::Mat1f(cells->depth * factor);  // leaves the shared image as it is
  result->cells = cells;
  return result;
}

double mean_log_odds(const std::vector<VisibilityCount>& counts) {
  double sum = 0;
  for (const VisibilityCount& count : counts) sum += count.static_log_odds;
  return sum / static_cast<double>(counts.size());
}

TEST(LandmarkStatistics, CountsExpectedAndFoundLandmarks) {
  LandmarkStatistics statistics;
  statistics.adopt(local_map());
  LocalMapPose pose = all_expected();
  const LocalLandmark& first = local_map()->landmarks.front();
  pose.estimate.matches.push_back({0, first.id, first.p_world, 1});
  statistics.count(*frame(kReference), pose);
  statistics.count(*frame(kReference), pose);
  const auto counts = statistics.take();
  EXPECT_GT(counts.size(), local_map()->landmarks.size() / 2);
  for (const VisibilityCount& count : counts) {
    EXPECT_EQ(count.predicted, 2U);
    EXPECT_EQ(count.found, count.landmark == first.id ? 2U : 0U);
  }
  EXPECT_TRUE(statistics.take().empty());
}

TEST(LandmarkStatistics, AnOccludedLandmarkIsNotExpected) {
  LandmarkStatistics statistics;
  statistics.adopt(local_map());
  statistics.count(*scaled_depth(0.4), all_expected());
  // Landmarks whose neighborhood has no depth remain: it is unknown whether they are occluded.
  EXPECT_LT(statistics.take().size(), local_map()->landmarks.size() / 2);
}

TEST(LandmarkStatistics, ALandmarkThatTheDepthSeesThroughIsProbablyMoving) {
  LandmarkStatistics statistics;
  statistics.adopt(local_map());
  for (int i = 0; i < 50; ++i) statistics.count(*scaled_depth(2), all_expected());
  EXPECT_LT(mean_log_odds(statistics.take()), -1);
}

TEST(LandmarkStatistics, NothingFollowsFromDepthIfThatIsTurnedOff) {
  LandmarkStatistics statistics({.seen_through = false});
  statistics.adopt(local_map());
  for (int i = 0; i < 50; ++i) statistics.count(*scaled_depth(2), all_expected());
  EXPECT_EQ(mean_log_odds(statistics.take()), 0);
}

TEST(LandmarkStatistics, KeepsCountsAndLogOddsInANewSnapshot) {
  LandmarkStatistics statistics;
  statistics.adopt(local_map());
  statistics.count(*scaled_depth(2), all_expected());
  const LandmarkId id = local_map()->landmarks.front().id;
  const float log_odds = statistics.static_log_odds(id);
  statistics.adopt(std::make_shared<LocalMap>(*local_map()));
  EXPECT_EQ(statistics.static_log_odds(id), log_odds);
  EXPECT_FALSE(statistics.take().empty());
}

}  // namespace
}  // namespace stillmap
