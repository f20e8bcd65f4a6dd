// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/motion_compensation.hpp"

#include "stillmap/track/rolling_camera_test.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr double kTime = 0.37;  // [s]

/// Largest errors over all keypoints: of the pixel [pixels] and of the depth [m].
struct Errors {
  double pixel = 0, depth = 0;
};

Errors errors_of(const RollingCamera& rolling, const Features& features) {
  Errors errors;
  const Pose T_camera_world = RollingCamera::pose(kTime).inverse();
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Keypoint& k = features.keypoints[i];
    if (!rolling.camera.contains(k.u, k.v, 20)) continue;
    const Eigen::Vector3d p = T_camera_world * rolling.points[i];
    errors.pixel =
        std::max(errors.pixel, (rolling.camera.project(p) - Eigen::Vector2d(k.u, k.v)).norm());
    errors.depth = std::max(errors.depth, std::abs(p.z() - k.depth));
  }
  return errors;
}

TEST(MotionCompensation, GivesTheKeypointsOfAGlobalShutter) {
  const RollingCamera rolling(Camera{}, {.readout = 0.027, .depth_delay = -0.015});
  const auto frame = rolling.frame(0, kTime);
  const Errors before = errors_of(rolling, *frame->recorded_features);
  EXPECT_GT(before.pixel, 4);
  EXPECT_GT(before.depth, 0.01);
  const MotionCompensation compensation(*frame->image, rolling.camera, RollingCamera::twist(kTime));
  const Errors after =
      errors_of(rolling, compensation.features(*frame->recorded_features, rolling.timing));
  EXPECT_LT(after.pixel, 0.15);
  EXPECT_LT(after.depth, 0.008);
}

TEST(MotionCompensation, ReadsTheDepthOfAnImageWithAnotherTimestamp) {
  const RollingCamera rolling(Camera{}, {});
  const auto frame = rolling.frame(0, kTime);
  RgbdFrame image = *frame->image;
  image.depth = rolling.depth(kTime + 0.018);
  image.depth_delay = 0.018;
  const MotionCompensation compensation(image, rolling.camera, RollingCamera::twist(kTime));
  EXPECT_LT(errors_of(rolling, compensation.features(*frame->recorded_features, {})).depth, 0.008);
}

TEST(MotionCompensation, OfAGlobalShutterChangesNothing) {
  const RollingCamera rolling(Camera{}, {});
  const auto frame = rolling.frame(0, kTime);
  const MotionCompensation compensation(*frame->image, rolling.camera, RollingCamera::twist(kTime));
  const Features features = compensation.features(*frame->recorded_features, {});
  for (std::size_t i = 0; i < features.size(); ++i) {
    EXPECT_NEAR(features.keypoints[i].u, frame->recorded_features->keypoints[i].u, 1e-3);
    EXPECT_EQ(features.keypoints[i].depth, frame->recorded_features->keypoints[i].depth);
  }
}

}  // namespace
}  // namespace stillmap
