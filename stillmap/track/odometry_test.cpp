// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/odometry.hpp"

#include "stillmap/track/previous_frame_tracking.hpp"
#include "stillmap/track/rendered_track_test.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace rendered;  // NOLINT(google-build-using-namespace)

/// Returns the pose of a frame from the previous one's depth alone, without landmarks.
PoseEstimate initial_pose(std::size_t index) {
  TrackerState state = state_at_reference();
  auto previous = std::make_shared<TrackedFrame>(*state.previous);
  previous->landmarks.assign(previous->landmarks.size(), LandmarkId{});
  state.previous = previous;
  return track_previous_frame(model(), state, *frame(index)->features).value().estimate;
}

TEST(Odometry, TracksPointsThatAreNotInTheMap) {
  const auto pose = track_by_odometry(model(), *frame(2), initial_pose(2));
  ASSERT_TRUE(pose);
  expect_pose(pose->T_world_camera, 2);
}

TEST(Odometry, FailsIfTheEvidenceLeavesTooFewPoints) {
  auto moving = changeable(2);
  moving->evidence.weight.assign(moving->features->size(), 0);
  EXPECT_FALSE(track_by_odometry(model(), *moving, initial_pose(2)));
}

TEST(Odometry, FailsWithoutMatches) {
  EXPECT_FALSE(track_by_odometry(model(), *frame(2), {true_pose(2), {}}));
}

}  // namespace
}  // namespace stillmap
