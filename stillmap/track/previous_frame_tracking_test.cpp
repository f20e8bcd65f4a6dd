// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/previous_frame_tracking.hpp"

#include "stillmap/track/rendered_track_test.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace rendered;  // NOLINT(google-build-using-namespace)

TEST(PreviousFrameTracking, RecoversThePoseOfTheNextFrame) {
  for (const std::size_t index : {1U, 3U}) {
    const auto pose = track_previous_frame(model(), state_at_reference(), *frame(index)->features);
    ASSERT_TRUE(pose) << index;
    expect_pose(pose->estimate.T_world_camera, index);
  }
}

TEST(PreviousFrameTracking, UsesLandmarksAloneIfEnoughAreFound) {
  const auto pose = track_previous_frame(model(), state_at_reference(), *frame(1)->features);
  ASSERT_TRUE(pose);
  EXPECT_TRUE(std::ranges::all_of(pose->estimate.matches,
                                  [](const PointMatch& m) { return m.landmark.valid(); }));
}

TEST(PreviousFrameTracking, UsesTheDepthOfThePreviousFrameWithoutLandmarks) {
  TrackerState state = state_at_reference();
  auto previous = std::make_shared<TrackedFrame>(*state.previous);
  previous->landmarks.assign(previous->landmarks.size(), LandmarkId{});
  state.previous = previous;
  const auto pose = track_previous_frame(model(), state, *frame(1)->features);
  ASSERT_TRUE(pose);
  expect_pose(pose->estimate.T_world_camera, 1);
}

TEST(PreviousFrameTracking, PrefersOdometryPointsToDepth) {
  // The odometry points are 5 cm off the depth: the pose follows them.
  const Eigen::Vector3d offset(0.05, 0, 0);
  TrackerState state = state_at_reference();
  auto previous = std::make_shared<TrackedFrame>(*state.previous);
  state.odometry_points.resize(previous->landmarks.size());
  for (std::size_t i = 0; i < state.odometry_points.size(); ++i) {
    const Keypoint& k = previous->frame->features->keypoints[i];
    if (k.depth <= 0) continue;
    state.odometry_points[i] =
        state.T_world_previous * model().camera.unproject(k.u, k.v, k.depth) + offset;
  }
  previous->landmarks.assign(previous->landmarks.size(), LandmarkId{});
  state.previous = previous;
  const auto pose = track_previous_frame(model(), state, *frame(1)->features);
  ASSERT_TRUE(pose);
  const Pose moved(pose->estimate.T_world_camera.rotation(),
                   pose->estimate.T_world_camera.translation() - offset);
  expect_pose(moved, 1);
}

TEST(PreviousFrameTracking, AppliesTheMotionModel) {
  // Frame 20 is too far from the reference for the search radius, unless the motion is predicted.
  TrackerState state = state_at_reference();
  state.T_previous_next = true_pose(kReference).inverse() * true_pose(20);
  const auto pose = track_previous_frame(model(), state, *frame(20)->features);
  ASSERT_TRUE(pose);
  expect_pose(pose->estimate.T_world_camera, 20);
}

/// Returns the state after a map was started with a frame: no velocity is known.
TrackerState state_after_start(const FramePtr& frame, const Pose& T_world_camera) {
  auto tracked = std::make_shared<TrackedFrame>();
  tracked->frame = frame;
  tracked->state = TrackState::kStarted;
  tracked->T_world_camera = T_world_camera;
  tracked->landmarks.assign(frame->features->size(), LandmarkId{});
  TrackerState state;
  state.local_map = map_of(frame, T_world_camera);
  state.previous = tracked;
  state.T_world_previous = T_world_camera;
  return state;
}

TEST(PreviousFrameTracking, DoesNotFollowSomebodyNearAtTheStart) {
  // People walk past close to the camera; every frame of the sequence starts a map once.
  const SimulatedSequence people({.people = 3,
                                  .activity = "crowd",
                                  .camera = "xyz",
                                  .frames = 40,
                                  .width = 320,
                                  .height = 240,
                                  .seed = 5});
  const TrackingModel model{people.camera(), PyramidShape{}};
  for (std::size_t i = 0; i + 1 < people.frames(); ++i) {
    const TrackerState state =
        state_after_start(frame_of(people.frame(i)), people.T_world_camera(i));
    const auto pose = track_previous_frame(model, state, *frame_of(people.frame(i + 1))->features);
    ASSERT_TRUE(pose) << i;
    const Pose error = people.T_world_camera(i + 1).inverse() * pose->estimate.T_world_camera;
    EXPECT_LT(error.translation().norm(), 0.015) << i;
  }
}

TEST(PreviousFrameTracking, IgnoresPointsThatMove) {
  TrackerState state = state_at_reference();
  auto moving = changeable(kReference);
  moving->evidence.weight.assign(moving->features->size(), 0);
  auto previous = std::make_shared<TrackedFrame>(*state.previous);
  previous->frame = moving;
  state.previous = previous;
  EXPECT_FALSE(track_previous_frame(model(), state, *frame(1)->features));
}

TEST(PreviousFrameTracking, MatchesNoKeypointThatIsKnownToMove) {
  const Features& features = *frame(1)->features;
  std::vector<float> weights(features.size(), 1);
  for (std::size_t i = 0; i < weights.size(); i += 2) weights[i] = 0;
  const auto pose = track_previous_frame(model(), state_at_reference(), features, weights);
  ASSERT_TRUE(pose);
  for (const FrameMatch& m : pose->matches) EXPECT_EQ(m.match.keypoint % 2, 1U);
  weights.assign(features.size(), 0);
  EXPECT_FALSE(track_previous_frame(model(), state_at_reference(), features, weights));
}

TEST(PreviousFrameTracking, FailsOnABlankImageAndElsewhere) {
  EXPECT_FALSE(track_previous_frame(model(), state_at_reference(), *blank(1)->features));
  EXPECT_FALSE(track_previous_frame(model(), state_at_reference(), *elsewhere(1)->features));
}

}  // namespace
}  // namespace stillmap
