// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/carried_parts.hpp"

#include "stillmap/simulate/board.hpp"
#include "stillmap/track/rendered_track_test.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using rendered::frame_of, rendered::model;
using ::testing::HasSubstr;

/// A moving camera without a mover.
const SimulatedSequence& office() {
  static const SimulatedSequence made({.people = 0,
                                       .camera = "xyz",
                                       .frames = 90,
                                       .width = 320,
                                       .height = 240,
                                       .seed = 3,
                                       .speed = 2});
  return made;
}

TrackedFramePtr tracked(const RgbdFramePtr& image, const Pose& T_world_camera) {
  const auto frame = frame_of(image);
  frame->recorded_features = frame->features;
  auto result = std::make_shared<TrackedFrame>();
  result->frame = frame;
  result->state = TrackState::kTracking;
  result->T_world_camera = T_world_camera;
  return result;
}

/// Returns the finding about a recording with a printed board in half of all images, always at the
/// same pixels.
/// @param follow  whether the tracked poses follow the board, so that they stand still
std::optional<Finding> finding_with_board(bool follow) {
  CarriedParts parts;
  for (std::size_t i = 0; i < office().frames(); ++i) {
    const auto image = behind({.share = 0.5, .distance = 0.5}, *office().frame(i),
                              office().camera(), /*seconds=*/1);
    parts.add(model(), tracked(image, follow ? Pose() : office().T_world_camera(i)));
  }
  return parts.finding();
}

TEST(CarriedParts, AreARobotsBodyIfThePosesFollowIt) {
  const auto finding = finding_with_board(/*follow=*/true);
  ASSERT_TRUE(finding);
  EXPECT_THAT(finding->fix, HasSubstr("--ignore FILE.png"));
  EXPECT_FALSE(finding_with_board(/*follow=*/false));
}

TEST(CarriedParts, AreNonePeopleInFrontOfACameraAtRest) {
  const SimulatedSequence people(
      {.people = 4, .camera = "static", .frames = 60, .width = 320, .height = 240, .seed = 3});
  CarriedParts parts;
  for (std::size_t i = 0; i < people.frames(); ++i)
    parts.add(model(), tracked(people.frame(i), Pose()));
  EXPECT_FALSE(parts.finding());
}

}  // namespace
}  // namespace stillmap
