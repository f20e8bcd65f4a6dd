// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/recording_test.hpp"

#include <memory>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Time from the first to the last row of both cameras [s].
constexpr double kReadout = 0.06;
constexpr std::size_t kFrames = 30;

/// A hand-held camera with rolling shutters. It turns from the first frame on.
const SimulatedSequence& turning() {
  static const SimulatedSequence made({.people = 0,
                                       .camera = "rpy",
                                       .frames = 90,
                                       .width = 320,
                                       .height = 240,
                                       .readout = kReadout});
  return made;
}

/// Returns the frame at which the camera turns fastest, early enough to be followed by others.
std::size_t fastest_frame() {
  std::size_t fastest = 0;
  double most = 0;
  for (std::size_t i = 0; i + kFrames < turning().frames(); ++i) {
    const double angle =
        (turning().T_world_camera(i).inverse() * turning().T_world_camera(i + 1)).angle();
    if (angle > most) most = angle, fastest = i;
  }
  return fastest;
}

SlamResult result_of(bool timing_known) {
  Camera camera = turning().camera();
  camera.shutter = timing_known ? ShutterTiming{kReadout, 0} : ShutterTiming{};
  SlamParameters options = recorded::small_options("static");
  SlamSystem slam(camera, options);
  const std::size_t first = fastest_frame();
  for (std::size_t i = first; i < first + kFrames; ++i) slam.push(turning().frame(i));
  return slam.finish();
}

/// Returns the error of the pose of frame `k` relative to that of the last frame.
Pose error_at(const Trajectory& trajectory, std::size_t k) {
  const std::size_t first = fastest_frame();
  const Pose truth =
      turning().T_world_camera(first + kFrames - 1).inverse() * turning().T_world_camera(first + k);
  const Pose estimate =
      trajectory.back().T_world_camera.inverse() * trajectory.at(k).T_world_camera;
  return truth.inverse() * estimate;
}

TEST(StartInMotion, TheMapIsStartedAgainAtTheSecondFrame) {
  const SlamResult result = result_of(true);
  ASSERT_EQ(result.trajectory.size(), kFrames) << "the first frame must keep its pose";
  EXPECT_EQ(result.frames[0].state, TrackState::kTracking);
  EXPECT_EQ(result.frames[1].state, TrackState::kStarted);
  EXPECT_EQ(result.maps, 1U);
  EXPECT_TRUE(result.events.empty()) << "a replaced map is no event";
  EXPECT_EQ(result.keyframes.front().timestamp, result.frames[1].timestamp);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_LT(error_at(result.trajectory, k).translation().norm(), 0.015) << k;
    EXPECT_LT(error_at(result.trajectory, k).angle(), 0.008) << k;
  }
}

TEST(StartInMotion, AGlobalShutterKeepsTheFirstFrame) {
  const SlamResult result = result_of(false);
  EXPECT_EQ(result.frames[0].state, TrackState::kStarted);
  EXPECT_EQ(result.frames[1].state, TrackState::kTracking);
}

}  // namespace
}  // namespace stillmap
