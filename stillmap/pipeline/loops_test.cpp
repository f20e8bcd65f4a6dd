// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/recording_test.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using recorded::small_options, recorded::same_bytes;

constexpr std::size_t kFrames = 330;
/// Number of frames until the first keyframe shows the start of the path again.
constexpr std::size_t kSeenOnce = 240;

/// Returns a sequence of a camera that is carried once around the office and a little farther, with
/// small images that are quick to render.
const SimulatedSequence& round() {
  static const SimulatedSequence made([] {
    SimulationOptions options;
    options.people = 0;
    options.camera = "loop";
    options.frames = kFrames;
    options.fps = 15;
    options.speed = 1.8;
    options.width = 320;
    options.height = 240;
    return options;
  }());
  return made;
}

/// Returns a frame of the sequence, which is rendered at the first request.
const RgbdFramePtr& frame_at(std::size_t index) {
  static std::vector<RgbdFramePtr> made(kFrames);
  if (!made[index]) made[index] = round().frame(index);
  return made[index];
}

SlamParameters loop_options() {
  SlamParameters options = small_options("static");
  options.dense_cloud = false;
  return options;
}

SlamResult run(const SlamParameters& options) {
  SlamSystem slam(round().camera(), options);
  for (std::size_t i = 0; i < kFrames; ++i) slam.push(frame_at(i));
  return slam.finish();
}

double ate(const SlamResult& result) {
  return absolute_trajectory_error(round().trajectory(), result.trajectory).translation.rmse;
}

int count(const SlamResult& result, MapEvent::Kind kind) {
  return static_cast<int>(std::count_if(result.events.begin(), result.events.end(),
                                        [&](const MapEvent& e) { return e.kind == kind; }));
}

TEST(Loops, AreClosedDeterministicallyAndReduceTheError) {
  SlamParameters options = loop_options();
  options.dense_cloud = true;
  const SlamResult closed = run(options), again = run(options);
  EXPECT_EQ(closed.dense.cloud, again.dense.cloud);
  EXPECT_GE(closed.dense_statistics.replacements, 1U) << "the live map follows";
  options.dense_cloud = false;
  EXPECT_TRUE(same_bytes(closed.trajectory, again.trajectory));
  EXPECT_TRUE(same_bytes(closed.keyframes, again.keyframes));
  options.places.loops = false;
  const SlamResult open = run(options);
  EXPECT_GE(count(closed, MapEvent::Kind::kLoop), 1);
  EXPECT_EQ(count(open, MapEvent::Kind::kLoop), 0);
  EXPECT_EQ(closed.tracked(), kFrames);
  EXPECT_LT(ate(closed), 0.5 * ate(open));
  options.places.loops = true;
  options.schedule.realtime = true;
  // The accuracy depends on the machine, since frames are pushed as fast as they are tracked.
  EXPECT_GT(run(options).tracked(), kFrames / 2) << "tracking continues during loop correction";
}

/// Nobody is there, so that hardly any keypoint moves, also when the world is corrected.
TEST(Loops, DoNotMakeTheBackgroundSeemToMove) {
  const SlamResult closed = run(small_options("fused"));
  const auto loop = std::ranges::find(closed.events, MapEvent::Kind::kLoop, &MapEvent::kind);
  ASSERT_NE(loop, closed.events.end());
  ASSERT_GT(loop->meters, 0.1);
  for (std::size_t i = loop->frame_index; i < kFrames; ++i)
    EXPECT_LT(closed.frames[i].moving_share(), 0.15) << i;
}

/// The camera is kidnapped from the first quarter of the path to the last one, and goes on to the
/// start.
TEST(Maps, AreMergedWhenAPlaceOfTheOldMapIsRecognized) {
  SlamSystem slam(round().camera(), loop_options());
  for (std::size_t i = 0; i < kFrames; ++i) {
    if (i < 80 || i > 180) slam.push(frame_at(i));
  }
  const SlamResult result = slam.finish();
  EXPECT_EQ(count(result, MapEvent::Kind::kMerge), 1);
  EXPECT_EQ(result.maps, 1U);
  EXPECT_LT(ate(result), 0.05) << "meters, of one consistent path";
}

/// One keyframe that shows the other map is enough, since there may be no consecutive ones.
TEST(Maps, AreMergedWithoutConsecutiveKeyframesThatShowTheOther) {
  const auto maps_with = [](bool connect_at_once) {
    SlamParameters options = loop_options();
    options.places.connect_at_once = connect_at_once;
    options.places.connect_by = 0;
    options.places.consistent = 1000;
    SlamSystem slam(round().camera(), options);
    for (std::size_t i = 0; i < kFrames; ++i) {
      if (i < 80 || i > 180) slam.push(frame_at(i));
    }
    return slam.finish().maps;
  };
  EXPECT_EQ(maps_with(false), 2U);
  EXPECT_EQ(maps_with(true), 1U);
}

/// The camera is kidnapped as above, but the sequence ends at the first keyframe that shows the old
/// place, before consecutive ones do.
TEST(Maps, LeftSeparateAreComparedAtTheEnd) {
  const auto maps_with = [](int connect_by) {
    SlamParameters options = loop_options();
    options.places.connect_at_once = false;
    options.places.connect_by = connect_by;
    SlamSystem slam(round().camera(), options);
    for (std::size_t i = 0; i < kSeenOnce; ++i) {
      if (i < 80 || i > 180) slam.push(frame_at(i));
    }
    return slam.finish();
  };
  const SlamResult apart = maps_with(0), joined = maps_with(20);
  EXPECT_EQ(apart.maps, 2U);
  EXPECT_EQ(joined.maps, 1U);
  EXPECT_EQ(joined.tracked(), apart.tracked());
  EXPECT_LT(ate(joined), 0.05) << "meters, of one consistent path";
  EXPECT_GT(ate(apart), 2 * ate(joined));
}

/// The camera is kidnapped as above, but the two maps are saved before the old place is observed.
TEST(Maps, AreMergedAfterLoading) {
  SlamSystem before(round().camera(), loop_options());
  for (std::size_t i = 0; i < 225; ++i) {
    if (i < 80 || i > 180) before.push(frame_at(i));
  }
  const SlamResult first = before.finish();
  ASSERT_EQ(first.maps, 2U) << (first.events.empty() ? 0 : first.events[0].frame_index);
  const SavedMap two = saved_map_from_bytes(saved_map_bytes(before.saved_map("test")), "two.map");
  SlamSystem slam(round().camera(), loop_options(), nullptr, StartingMap{two, true});
  for (std::size_t i = 205; i < kFrames; ++i) slam.push(frame_at(i));
  const SlamResult result = slam.finish();
  EXPECT_GE(result.tracked(), kFrames - 205 - 5);
  EXPECT_EQ(count(result, MapEvent::Kind::kMerge), 1);
  EXPECT_EQ(count(result, MapEvent::Kind::kDropped), 0);
  EXPECT_EQ(result.maps, 1U);
  EXPECT_EQ(slam.saved_map("test").map.first.size(), 1U);
  EXPECT_LT(ate(result), 0.05);
}

/// The camera leaves the map of the first part of the path, turns around, and comes back into it.
class TrackedByOdometry : public ::testing::Test {
 protected:
  struct Step {
    std::size_t shown;  ///< Index of the frame in the sequence.
    double error;       ///< Position error in the map's world, without alignment [m].
  };
  /// Returns the frames with a pose, and in `by_odometry` the number of those tracked by odometry.
  static std::vector<Step> run_localized(const SlamParameters& options,
                                         std::ptrdiff_t& by_odometry) {
    SlamSystem first(round().camera(), loop_options());
    for (std::size_t i = 0; i < kMapped; ++i) first.push(frame_at(i));
    first.finish();
    SlamSystem slam(round().camera(), options, nullptr,
                    StartingMap{first.saved_map("test"), false});
    for (std::size_t step = 0; step < kSteps; ++step) {
      auto frame = std::make_shared<RgbdFrame>(*frame_at(shown_at(step)));
      frame->index = step;
      frame->timestamp = static_cast<double>(step);
      slam.push(frame);
    }
    const SlamResult result = slam.finish();
    by_odometry = std::count_if(result.frames.begin(), result.frames.end(),
                                [](const FrameRecord& f) { return f.tracked_by_odometry; });
    std::vector<Step> steps;
    for (const auto& [stamp, T] : result.trajectory) {
      const std::size_t shown = shown_at(static_cast<std::size_t>(stamp));
      const Pose truth = round().T_world_camera(0).inverse() * round().T_world_camera(shown);
      steps.push_back({shown, (T.translation() - truth.translation()).norm()});
    }
    return steps;
  }
  static constexpr std::size_t kMapped = 40, kTurn = 110, kBegin = 10;
  static constexpr std::size_t kSteps = 2 * (kTurn - kBegin);
  static std::size_t shown_at(std::size_t step) {
    return step < kTurn - kBegin ? kBegin + step : 2 * kTurn - kBegin - step;
  }
};

TEST_F(TrackedByOdometry, OdometryContinuesUntilTheMapIsObservedAgain) {
  std::ptrdiff_t by_odometry = 0;
  const auto steps = run_localized(loop_options(), by_odometry);
  EXPECT_GE(steps.size(), kSteps - 3) << "all but those before the place was recognized";
  EXPECT_GT(by_odometry, 50);
  for (const Step& step : steps) {
    EXPECT_LT(step.error, step.shown < kMapped ? 0.03 : 0.1) << step.shown;
  }
  EXPECT_LT(steps.back().error, 0.01);
}

TEST_F(TrackedByOdometry, WithoutItTheCameraIsLostThere) {
  SlamParameters options = loop_options();
  options.tracker.tracked_by_odometry = false;
  std::ptrdiff_t by_odometry = 0;
  EXPECT_LT(run_localized(options, by_odometry).size(), kSteps - 50);
  EXPECT_EQ(by_odometry, 0);
}

}  // namespace
}  // namespace stillmap
