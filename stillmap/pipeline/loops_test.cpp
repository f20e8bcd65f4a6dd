// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/recording_test.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using recorded::small_options, recorded::same_bytes;

constexpr std::size_t kFrames = 330;

/// A camera carried around the office in small, quick pictures, and a little farther.
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

/// Rendered when first asked for.
const RgbdFramePtr& picture(std::size_t index) {
  static std::vector<RgbdFramePtr> made(kFrames);
  if (!made[index]) made[index] = round().frame(index);
  return made[index];
}

SlamOptions loop_options() {
  SlamOptions options = small_options("static");
  options.dense_cloud = false;
  return options;
}

SlamResult run(const SlamOptions& options) {
  Slam slam(round().camera(), options);
  for (std::size_t i = 0; i < kFrames; ++i) slam.push(picture(i));
  return slam.finish();
}

double ate(const SlamResult& result) {
  return absolute_trajectory_error(round().trajectory(), result.trajectory).translation.rmse;
}

int count(const SlamResult& result, MapEvent::Kind kind) {
  return static_cast<int>(std::count_if(result.events.begin(), result.events.end(),
                                        [&](const MapEvent& e) { return e.kind == kind; }));
}

TEST(Loops, AreClosedTheSameInEveryRunAndTheTrajectoryIsBetterForIt) {
  SlamOptions options = loop_options();
  const SlamResult closed = run(options), again = run(options);
  EXPECT_TRUE(same_bytes(closed.trajectory, again.trajectory));
  EXPECT_TRUE(same_bytes(closed.keyframes, again.keyframes));
  options.places.loops = false;
  const SlamResult open = run(options);
  EXPECT_GE(count(closed, MapEvent::Kind::kLoop), 1);
  EXPECT_EQ(count(open, MapEvent::Kind::kLoop), 0);
  EXPECT_EQ(closed.tracked(), kFrames);
  EXPECT_LT(ate(closed), 0.5 * ate(open));
  options.places.loops = true;
  options.schedule.mode = "realtime";
  // How well depends on the machine, for the frames come as fast as they are tracked.
  EXPECT_GT(run(options).tracked(), kFrames / 2) << "the tracker goes on while the map is bent";
}

/// Kidnapped from the first quarter of the round to its last, and on to where it began.
TEST(Maps, AreJoinedWhenThePlaceOfTheOldOneIsSeen) {
  Slam slam(round().camera(), loop_options());
  for (std::size_t i = 0; i < kFrames; ++i) {
    if (i < 80 || i > 180) slam.push(picture(i));
  }
  const SlamResult result = slam.finish();
  EXPECT_EQ(count(result, MapEvent::Kind::kMerge), 1);
  EXPECT_EQ(result.maps, 1U);
  EXPECT_LT(ate(result), 0.05) << "metres, of one consistent path";
}

}  // namespace
}  // namespace stillmap
