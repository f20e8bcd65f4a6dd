// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/recording_test.hpp"

#include <algorithm>
#include <memory>

#include <gtest/gtest.h>

/// A person walks ahead of the camera and fills most of the view from the first frame on.
namespace stillmap {
namespace {

std::shared_ptr<const SimulatedSequence> following() {
  static const auto made =
      std::make_shared<const SimulatedSequence>(SimulationOptions{.scene = "flat",
                                                                  .people = 1,
                                                                  .activity = "companion",
                                                                  .camera = "follow",
                                                                  .frames = 60,
                                                                  .width = 320,
                                                                  .height = 240,
                                                                  .wheels = true});
  return made;
}

SlamResult result_with(std::unique_ptr<Detector> detector, bool wheels = false) {
  Camera camera = following()->camera();
  if (!wheels) camera.wheels.reset();
  SlamSystem slam(camera, recorded::small_options("fused"), std::move(detector));
  for (std::size_t i = 0; i < following()->frames(); ++i) slam.push(following()->frame(i));
  return slam.finish();
}

double error_of(const SlamResult& result) {
  return absolute_trajectory_error(following()->trajectory(), result.trajectory).translation.rmse;
}

TEST(Companion, IsNotFollowedIfMasksNameThePerson) {
  const SlamResult result = result_with(std::make_unique<recorded::TrueMasks>(following()));
  EXPECT_EQ(result.trajectory.size(), following()->frames());
  EXPECT_LT(error_of(result), 0.02);
}

TEST(Companion, MakesPosesUncertainWithoutMasks) {
  const SlamResult result = result_with(nullptr);
  const auto uncertain = std::ranges::count_if(result.frames, [](const FrameRecord& frame) {
    return frame.uncertainty == Uncertainty::kContradiction;
  });
  EXPECT_TRUE(error_of(result) < 0.02 || 5 * uncertain > 60) << "a wrong path without a doubt";
}

/// Two people wave close to a camera on a tripod.
TEST(Companion, DoesNotMoveACameraAtRest) {
  const SimulatedSequence tripod({.people = 2,
                                  .activity = "wave",
                                  .camera = "static",
                                  .frames = 60,
                                  .width = 320,
                                  .height = 240,
                                  .shake = 0});
  SlamSystem slam(tripod.camera(), recorded::small_options("fused"));
  for (std::size_t i = 0; i < tripod.frames(); ++i) {
    const auto returned = slam.push(tripod.frame(i));
    ASSERT_TRUE(returned) << i;
    EXPECT_LT(returned->translation().norm(), 1e-3) << i << ": meters from the first pose";
  }
  for (const StampedPose& pose : slam.finish().trajectory)
    EXPECT_LT(pose.T_world_camera.translation().norm(), 1e-3) << pose.timestamp;
}

TEST(Companion, IsNotFollowedIfWheelsGiveTheMotion) {
  const SlamResult result = result_with(nullptr, true);
  EXPECT_EQ(result.trajectory.size(), following()->frames());
  EXPECT_LT(error_of(result), 0.02);
  EXPECT_FALSE(result.carried_parts);
}

}  // namespace
}  // namespace stillmap
