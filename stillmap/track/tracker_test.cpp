// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/tracker.hpp"

#include "stillmap/simulate/board.hpp"
#include "stillmap/track/moving_majority.hpp"
#include "stillmap/track/rendered_track_test.hpp"

#include <functional>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace rendered;  // NOLINT(google-build-using-namespace)

/// A tracker and the newest map that it is given.
class TrackerTest : public ::testing::Test {
 protected:
  static Tracker tracker(TrackerStart start = TrackerStart::kNewMap, TrackerOptions options = {}) {
    return {sequence().camera(), PyramidShape{}, options, start};
  }

  /// Tracks a frame in both passes.
  static TrackedFramePtr push(Tracker& tracker, const FramePtr& frame, const LocalMapPtr& map,
                              const std::optional<RelocalizationResult>& found = {}) {
    const auto initial = tracker.predict_pose(*frame->features, map);
    return tracker.track(frame, initial, map, found);
  }

  /// Returns the pose in the sequence's world. A tracker that starts a map has its own world, which
  /// is the first camera's.
  static Pose from_first_camera(const TrackedFramePtr& tracked) {
    return true_pose(kReference) * tracked->T_world_camera.value();
  }

  /// Returns a map in the world of a tracker that started with the reference frame.
  static LocalMapPtr started_map() { return map_of(frame(kReference), Pose()); }
};

TEST_F(TrackerTest, StartsAMapAndTracksInIt) {
  Tracker t = tracker();
  const auto first = push(t, frame(0), nullptr);
  EXPECT_EQ(first->state, TrackState::kStarted);
  ASSERT_TRUE(first->proposal);
  const LocalMapPtr map = started_map();
  for (std::size_t i = 1; i < 6; ++i) {
    const auto tracked = push(t, frame(i), map);
    ASSERT_EQ(tracked->state, TrackState::kTracking) << i;
    EXPECT_FALSE(tracked->relocalized || tracked->tracked_by_odometry);
    expect_pose(from_first_camera(tracked), i);
    EXPECT_EQ(tracked->reference, map->reference);
  }
}

/// Returns frame `index` in which keypoints are labeled as moving.
FramePtr with_moving(std::size_t index, const std::function<bool(const Keypoint&)>& moves) {
  auto frame = changeable(index);
  for (std::size_t i = 0; i < frame->features->size(); ++i)
    if (moves(frame->features->keypoints[i])) frame->evidence.weight[i] = 0;
  return frame;
}

TEST_F(TrackerTest, MotionIsFalseIfItTakesMostOfAPosesCertainty) {
  for (const auto& [right_of, is_false] : {std::pair(100.0F, true), std::pair(200.0F, false)}) {
    Tracker t = tracker();
    push(t, frame(0), nullptr);
    const LocalMapPtr map = started_map();
    push(t, frame(1), map);
    const auto moves = [right_of = right_of](const Keypoint& k) { return k.u > right_of; };
    const auto tracked = push(t, with_moving(2, moves), map);
    const double share = moving_share(tracked->frame->evidence.weight);
    if (is_false) {
      EXPECT_EQ(share, 0);
    } else {
      EXPECT_GT(share, 0.2);
    }
    expect_pose(from_first_camera(tracked), 2);
  }
}

TEST_F(TrackerTest, WaitsForAFrameThatCanStartAMap) {
  Tracker t = tracker();
  const auto waiting = push(t, blank(0), nullptr);
  EXPECT_EQ(waiting->state, TrackState::kWaiting);
  EXPECT_FALSE(waiting->has_pose());
  EXPECT_NE(waiting->reason, "");
  EXPECT_EQ(push(t, frame(1), nullptr)->state, TrackState::kStarted);
}

TEST_F(TrackerTest, FindsTheReferenceKeyframeAgainAfterABlankImage) {
  Tracker t = tracker();
  push(t, frame(0), nullptr);
  const LocalMapPtr map = started_map();
  push(t, frame(1), map);
  const auto lost = push(t, blank(2), map);
  EXPECT_EQ(lost->state, TrackState::kLost);
  EXPECT_NE(lost->reason, "");
  const auto again = push(t, frame(3), map);
  ASSERT_EQ(again->state, TrackState::kTracking);
  EXPECT_FALSE(again->relocalized);
  expect_pose(from_first_camera(again), 3);
}

TEST_F(TrackerTest, IsLostThenRelocalizedThenTracks) {
  // In a map that exists the camera is lost until its place is recognized.
  Tracker t = tracker(TrackerStart::kInMap);
  EXPECT_EQ(push(t, frame(0), nullptr)->state, TrackState::kLost);
  EXPECT_EQ(push(t, elsewhere(1), nullptr, relocalization(0))->state, TrackState::kLost);
  const auto relocalized = push(t, frame(2), nullptr, relocalization(0));
  ASSERT_EQ(relocalized->state, TrackState::kTracking);
  EXPECT_TRUE(relocalized->relocalized);
  EXPECT_TRUE(relocalized->enters_world());
  expect_pose(*relocalized->T_world_camera, 2);
  const auto tracked = push(t, frame(3), local_map());
  ASSERT_EQ(tracked->state, TrackState::kTracking);
  EXPECT_FALSE(tracked->relocalized);
  expect_pose(*tracked->T_world_camera, 3);
}

TEST_F(TrackerTest, AnUnconfirmedRelocalizationLeavesTheStateAsItIs) {
  Tracker t = tracker();
  push(t, frame(0), nullptr);
  const LocalMapPtr map = started_map();
  push(t, frame(1), map);
  EXPECT_EQ(push(t, blank(2), map, relocalization(0))->state, TrackState::kLost);
  const auto again = push(t, frame(3), map);
  ASSERT_EQ(again->state, TrackState::kTracking);
  expect_pose(from_first_camera(again), 3);
}

TEST_F(TrackerTest, FollowsACorrectionOfTheMap) {
  Tracker t = tracker();
  push(t, frame(0), nullptr);
  push(t, frame(1), started_map());
  // The same map, moved by a loop closure: 1 m and 60 degrees.
  const Pose correction(so3_exp({0, 0, 1.05}), {1, 0, 0});
  const LocalMapPtr corrected = map_of(frame(kReference), correction);
  const auto initial = t.predict_pose(*frame(2)->features, corrected);
  ASSERT_TRUE(initial) << "the previous frame moves along";
  const Pose T_reference_odometry = true_pose(kReference);
  expect_pose(T_reference_odometry * initial->motion.T_odometry_previous, 1);
  expect_pose(T_reference_odometry * initial->motion.T_odometry_camera, 2);
  const auto tracked = t.track(frame(2), initial, corrected);
  ASSERT_EQ(tracked->state, TrackState::kTracking);
  expect_pose(true_pose(kReference) * correction.inverse() * *tracked->T_world_camera, 2);
  expect_pose(T_reference_odometry * tracked->T_odometry_world * *tracked->T_world_camera, 2);
}

TEST_F(TrackerTest, StartsANewMapWhereTheOldOneWasLost) {
  TrackerOptions options;
  options.new_map.patience = 2;
  Tracker t = tracker(TrackerStart::kNewMap, options);
  push(t, frame(0), nullptr);
  const LocalMapPtr map = started_map();
  const auto last = push(t, frame(1), map);
  EXPECT_EQ(push(t, elsewhere(2), map)->state, TrackState::kLost);
  EXPECT_EQ(push(t, elsewhere(3), map)->state, TrackState::kLost);
  const auto started = push(t, elsewhere(4), map);
  ASSERT_EQ(started->state, TrackState::kStarted);
  EXPECT_LT((started->T_world_camera->translation() - last->T_world_camera->translation()).norm(),
            1e-9);
  ASSERT_TRUE(started->proposal);
  EXPECT_EQ(started->proposal->abandoned, map->reference) << "after two frames it is not kept";
}

/// What covers the view of a camera at rest uncovers the same.
TEST_F(TrackerTest, StartsNoMapWhileTheViewOfACameraAtRestIsCovered) {
  TrackerOptions options;
  options.new_map.patience = 2;
  Tracker t = tracker(TrackerStart::kNewMap, options);
  push(t, frame(0), nullptr);
  const LocalMapPtr map = started_map();
  const auto again = [&](const FramePtr& shown, std::size_t index) {
    auto image = std::make_shared<RgbdFrame>(*shown->image);
    image->index = index;
    image->timestamp = static_cast<double>(index) / sequence().camera().fps;
    auto same = std::make_shared<Frame>(*shown);
    same->image = image;
    return same;
  };
  for (std::size_t i = 1; i < 5; ++i) push(t, again(frame(0), i), map);
  for (std::size_t i = 5; i < 40; ++i)
    EXPECT_EQ(push(t, again(elsewhere(0), i), map)->state, TrackState::kLost) << i;
  const auto uncovered = push(t, again(frame(0), 40), map);
  ASSERT_EQ(uncovered->state, TrackState::kTracking);
  expect_pose(from_first_camera(uncovered), 0, 1e-3, 1e-3);
}

TEST_F(TrackerTest, StartsNoMapWhileANearSurfaceOccludesTheCamera) {
  TrackerOptions options;
  options.new_map.patience = 2;
  options.new_map.occluded_patience = 5;
  Tracker t = tracker(TrackerStart::kNewMap, options);
  push(t, frame(0), nullptr);
  const LocalMapPtr map = started_map();
  push(t, frame(1), map);
  for (std::size_t i = 2; i < 9; ++i) {
    const auto image =
        behind({.share = 1, .distance = 0.6}, *frame(i)->image, sequence().camera(), 0);
    EXPECT_EQ(push(t, frame_of(image), map)->state, TrackState::kLost) << i;
  }
  const auto image =
      behind({.share = 1, .distance = 0.6}, *frame(9)->image, sequence().camera(), 0);
  EXPECT_EQ(push(t, frame_of(image), map)->state, TrackState::kStarted) << "it stayed";
}

/// Returns the map with the landmarks of the reference that are left of a column.
LocalMapPtr left_of(float column) {
  auto map = std::make_shared<LocalMap>(*local_map());
  const LocalKeyframe& reference = local_map()->keyframes.front();
  std::erase_if(map->landmarks, [&](const LocalLandmark& landmark) {
    for (std::size_t i = 0; i < reference.landmarks.size(); ++i) {
      if (reference.landmarks[i] == landmark.id)
        return reference.features->keypoints[i].u >= column;
    }
    return true;
  });
  return map;
}

TEST_F(TrackerTest, FallsBackToOdometryInAMapThatIsOnlyLocalizedIn) {
  for (const bool fallback : {true, false}) {
    TrackerOptions options;
    options.tracked_by_odometry = fallback;
    Tracker t = tracker(TrackerStart::kInMapOnly, options);
    ASSERT_EQ(push(t, frame(1), nullptr, relocalization(0))->state, TrackState::kTracking);
    const LocalMapPtr nearly_empty = left_of(10);  // too few landmarks remain in view
    for (std::size_t i = 2; i < 5; ++i) {
      const auto tracked = push(t, frame(i), nearly_empty);
      EXPECT_EQ(tracked->state, fallback ? TrackState::kTracking : TrackState::kLost) << i;
      EXPECT_EQ(tracked->tracked_by_odometry, fallback);
      if (fallback) expect_pose(tracked->T_world_camera.value(), i, 0.03, 0.01);
    }
    const auto back = push(t, frame(5), local_map());
    ASSERT_EQ(back->state, TrackState::kTracking);
    EXPECT_FALSE(back->tracked_by_odometry) << "the map is in view again";
    expect_pose(back->T_world_camera.value(), 5);
  }
}

TEST_F(TrackerTest, NeverStartsAMapInAMapThatIsOnlyLocalizedIn) {
  TrackerOptions options;
  options.new_map.patience = 1;
  Tracker t = tracker(TrackerStart::kInMapOnly, options);
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_EQ(push(t, frame(i), nullptr)->state, TrackState::kLost) << i;
}

}  // namespace
}  // namespace stillmap
