// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/local_map_tracking.hpp"

#include "stillmap/track/previous_frame_tracking.hpp"
#include "stillmap/track/rendered_track_test.hpp"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace rendered;  // NOLINT(google-build-using-namespace)

constexpr int kMinLandmarks = 25;

TEST(LocalMapTracking, RefinesARoughPose) {
  // 5 mm and 0.2 degrees are about 3 pixels.
  const Pose rough = true_pose(2) * Pose(so3_exp({0, 0.0035, 0}), {0.005, 0, 0});
  const auto pose =
      refine_in_local_map(model(), *local_map(), *frame(2), {rough, {}}, kMinLandmarks);
  ASSERT_TRUE(pose);
  expect_pose(pose->estimate.T_world_camera, 2, 0.01, 0.004);
}

TEST(LocalMapTracking, ReturnsLandmarksThatWereExpected) {
  const auto pose =
      refine_in_local_map(model(), *local_map(), *frame(2), {true_pose(2), {}}, kMinLandmarks);
  ASSERT_TRUE(pose);
  std::set<std::size_t> matched;
  for (const PointMatch& match : pose->estimate.matches) {
    ASSERT_TRUE(match.landmark.valid());
    EXPECT_TRUE(pose->expected[local_map()->index(match.landmark)]);
    EXPECT_TRUE(matched.insert(local_map()->index(match.landmark)).second) << "matched twice";
  }
  EXPECT_GT(matched.size(), 100U);
}

TEST(LocalMapTracking, LeavesOutKeypointsThatMove) {
  auto half = changeable(2);
  for (std::size_t i = 0; i < half->features->size(); ++i) {
    if (half->features->keypoints[i].u < 160) half->evidence.weight[i] = 0;
  }
  const auto pose =
      refine_in_local_map(model(), *local_map(), *half, {true_pose(2), {}}, kMinLandmarks);
  ASSERT_TRUE(pose);
  for (const PointMatch& match : pose->estimate.matches)
    EXPECT_GE(half->features->keypoints[match.keypoint].u, 160);
}

/// Returns the matches of a frame's own points, without landmarks, as from the previous frame.
std::vector<PointMatch> own_points(std::size_t index) {
  std::vector<PointMatch> matches;
  for (std::uint32_t i = 0; i < frame(index)->features->size(); ++i) {
    const Keypoint& k = frame(index)->features->keypoints[i];
    if (k.depth <= 0) continue;
    matches.push_back({i, {}, true_pose(index) * model().camera.unproject(k.u, k.v, k.depth), 1});
  }
  return matches;
}

/// Returns the local map with every n-th landmark only.
LocalMap thinned(std::size_t n) {
  LocalMap map = *local_map();
  map.landmarks.clear();
  for (std::size_t i = 0; i < local_map()->landmarks.size(); i += n)
    map.landmarks.push_back(local_map()->landmarks[i]);
  return map;
}

/// Returns the pose of frame 1 from the frame before, none of whose points is a landmark.
PoseEstimate from_previous_frame() {
  TrackerState state = state_at_reference();
  auto previous = std::make_shared<TrackedFrame>(*state.previous);
  previous->landmarks.assign(previous->frame->features->size(), LandmarkId{});
  state.previous = previous;
  return track_previous_frame(model(), state, *frame(1)->features).value().estimate;
}

int matched_landmarks(const PoseEstimate& estimate) {
  return static_cast<int>(std::ranges::count_if(
      estimate.matches, [](const PointMatch& match) { return match.landmark.valid(); }));
}

TEST(LocalMapTracking, PointsOfThePreviousFrameSupportFewLandmarks) {
  const LocalMap few = thinned(25);
  const PoseEstimate first = from_previous_frame();
  ASSERT_EQ(matched_landmarks(first), 0);
  const PoseEstimate without_points{first.T_world_camera, {}};
  const auto alone = refine_in_local_map(model(), few, *frame(1), without_points, kMinInliers);
  ASSERT_TRUE(alone);
  ASSERT_LT(matched_landmarks(alone->estimate), kMinLandmarks) << "too few for a pose alone";
  EXPECT_FALSE(refine_in_local_map(model(), few, *frame(1), without_points, kMinLandmarks));
  const auto pose = refine_in_local_map(model(), few, *frame(1), first, kMinLandmarks);
  ASSERT_TRUE(pose);
  expect_pose(pose->estimate.T_world_camera, 1);
  EXPECT_EQ(matched_landmarks(pose->estimate), std::ssize(pose->estimate.matches))
      << "the points of the previous frame are no matches with the map";
}

TEST(LocalMapTracking, PointsOfThePreviousFrameDoNotSufficeAlone) {
  const LocalMap none = thinned(1000);
  EXPECT_FALSE(
      refine_in_local_map(model(), none, *frame(1), {true_pose(1), own_points(1)}, kMinLandmarks));
}

TEST(LocalMapTracking, FailsOnABlankImageAndElsewhere) {
  const PoseEstimate first{true_pose(1), {}};
  EXPECT_FALSE(refine_in_local_map(model(), *local_map(), *blank(1), first, kMinLandmarks));
  EXPECT_FALSE(refine_in_local_map(model(), *local_map(), *elsewhere(1), first, kMinLandmarks));
}

}  // namespace
}  // namespace stillmap
