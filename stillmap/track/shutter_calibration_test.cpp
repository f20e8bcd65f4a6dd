// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/shutter_calibration.hpp"

#include "stillmap/track/rolling_camera_test.hpp"

#include <numeric>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

Camera camera_of(const char* sensor) {
  Camera camera;
  camera.depth_sensor = find_depth_sensor(sensor);
  return camera;
}

/// Returns the timing estimated from 120 frames of a camera whose shutters have another one.
ShutterTiming estimated(const Camera& camera, const ShutterTiming& truth) {
  const RollingCamera rolling(camera, truth);
  ShutterCalibration calibration;
  std::vector<std::int32_t> previous(rolling.points.size());
  std::iota(previous.begin(), previous.end(), 0);
  for (std::size_t i = 0; i < 120; ++i) {
    const double t = static_cast<double>(i) / 30;
    calibration.add({camera, {}}, rolling.frame(i, t), RollingCamera::pose(t), previous);
  }
  return calibration.timing();
}

TEST(ShutterCalibration, FindsReadoutTimeAndDepthDelay) {
  const ShutterTiming found =
      estimated(camera_of("ideal"), {.readout = 0.02, .depth_delay = 0.012});
  EXPECT_NEAR(found.readout, 0.02, 0.002);
  EXPECT_NEAR(found.depth_delay, 0.012, 0.003);
}

TEST(ShutterCalibration, FindsAReadoutTimeOtherThanThatOfTheSensor) {
  const ShutterTiming found = estimated(camera_of("kinect_v1"), {.readout = 0.018});
  EXPECT_NEAR(found.readout, 0.018, 0.002);
}

TEST(ShutterCalibration, AReadoutTimeIsAtMostTheFrameInterval) {
  Camera camera = camera_of("ideal");
  camera.fps = 60;
  EXPECT_DOUBLE_EQ(estimated(camera, {.readout = 0.02}).readout, 1 / 60.0);
}

TEST(ShutterCalibration, LeavesAGlobalShutterAlone) {
  EXPECT_EQ(estimated(camera_of("kinect_v1"), {}), ShutterTiming{});
}

}  // namespace
}  // namespace stillmap
