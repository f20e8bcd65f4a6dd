// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/recording_test.hpp"
#include "stillmap/simulate/board.hpp"

#include <numbers>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using recorded::black, recorded::small_options;

constexpr std::size_t kFrom = 90;  // first covered frame

/// A camera with an IMU or on wheels that moves at .4 m/s through the office.
const SimulatedSequence& moving() {
  static const SimulatedSequence made({.people = 0,
                                       .camera = "loop",
                                       .frames = 220,
                                       .width = 320,
                                       .height = 240,
                                       .imu = "d435i",
                                       .wheels = true});
  return made;
}

const std::vector<RgbdFramePtr>& frames() {
  static const std::vector<RgbdFramePtr> made = [] {
    std::vector<RgbdFramePtr> all;
    for (std::size_t i = 0; i < moving().frames(); ++i) all.push_back(moving().frame(i));
    return all;
  }();
  return made;
}

struct Blind {
  bool imu = false, wheels = false;
  bool board = false;    // whether a printed board covers the view, or darkness
  std::size_t to = 150;  // first frame that is not covered any more
};

struct Outcome {
  std::vector<FrameRecord> records;
  std::size_t maps = 0, findings = 0;
  double largest_error = 0;    // of the poses handed out [m]
  std::optional<double> tilt;  // error of the upward direction [rad]
};

Outcome run(const Blind& blind) {
  Camera camera = moving().camera();
  if (!blind.imu) camera.imu.reset();
  if (!blind.wheels) camera.wheels.reset();
  SlamSystem slam(camera, small_options("fused"));
  Outcome outcome;
  std::optional<Pose> T_true_world;
  for (const RgbdFramePtr& frame : frames()) {
    auto pushed = std::make_shared<RgbdFrame>(*frame);
    const bool covered = frame->index >= kFrom && frame->index < blind.to;
    const double since = (static_cast<double>(frame->index) - kFrom) / 30;
    if (covered && blind.board) *pushed = *behind(Board{.share = 1}, *frame, camera, since);
    if (covered && !blind.board) pushed->gray = black(frame->gray);
    const auto pose = slam.push(pushed);
    if (!pose) continue;
    const Pose truth = moving().T_world_camera(frame->index);
    if (!T_true_world) T_true_world = truth * pose->inverse();
    const Pose error = (*T_true_world * *pose).inverse() * truth;
    outcome.largest_error = std::max(outcome.largest_error, error.translation().norm());
  }
  const SlamResult result = slam.finish();
  outcome.records = result.frames;
  outcome.maps = result.maps;
  outcome.findings = result.motion_sensors.size();
  if (result.up) outcome.tilt = std::acos((T_true_world->quaternion() * *result.up).z());
  return outcome;
}

void expect_one_map(const Blind& blind, double error) {
  const Outcome outcome = run(blind);
  EXPECT_EQ(outcome.maps, 1U);
  EXPECT_EQ(outcome.findings, 0U);
  EXPECT_LT(outcome.largest_error, error);
  for (const FrameRecord& f : outcome.records) {
    EXPECT_TRUE(f.has_pose()) << f.index << ' ' << f.reason;
    EXPECT_TRUE(f.predicted() || f.index <= kFrom || f.index >= blind.to) << f.index;
    EXPECT_TRUE(!f.predicted() || f.covariance.trace() > 0) << f.index;
  }
}

TEST(Blind, AnImuBridgesSecondsInTheSameMap) { expect_one_map({.imu = true}, 0.06); }

TEST(Blind, TheAccelerometerShowsTheUpwardDirection) {
  const auto tilt = run({.imu = true, .to = kFrom}).tilt;
  ASSERT_TRUE(tilt);
  EXPECT_LT(*tilt, 1 * std::numbers::pi / 180);  // two standard deviations
  EXPECT_FALSE(run({.wheels = true, .to = kFrom}).tilt);
}

TEST(Blind, WheelsBridgeSecondsInTheSameMap) { expect_one_map({.wheels = true}, 0.06); }

TEST(Blind, AMovingSurfaceThatCoversTheViewIsNotTakenForThePlace) {
  expect_one_map({.imu = true, .board = true}, 0.06);
}

TEST(Blind, OdometryInCentimetersIsToldAndNotUsed) {
  Camera camera = moving().camera();
  camera.imu.reset();
  SlamSystem slam(camera, small_options("fused"));
  for (const RgbdFramePtr& frame : frames()) {
    auto pushed = std::make_shared<RgbdFrame>(*frame);
    for (OdometrySample& sample : pushed->odometry)
      sample.T_odom_base =
          Pose(sample.T_odom_base.quaternion(), 100 * sample.T_odom_base.translation());
    slam.push(pushed);
  }
  const SlamResult result = slam.finish();
  ASSERT_EQ(result.motion_sensors.size(), 1U);
  EXPECT_EQ(result.motion_sensors.front().code, "odometry-unlike");
}

TEST(Blind, WithoutThemAMapIsStartedAtThePlaceOfTheLoss) {
  const Outcome outcome = run({.to = 180});
  EXPECT_GT(outcome.largest_error, 0.3);
  EXPECT_TRUE(std::ranges::none_of(outcome.records, &FrameRecord::predicted));
}

}  // namespace
}  // namespace stillmap
