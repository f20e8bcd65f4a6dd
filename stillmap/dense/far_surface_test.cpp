// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/far_surface.hpp"

#include "stillmap/dense/synthetic_frame.hpp"

#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

const DepthSensor& sensor() { return find_depth_sensor("kinect_v1"); }

/// Returns far_depths() of a frame after back_project().
cv::Mat1f far_depths_of(const RgbdFrame& frame, const FarOptions& options = {},
                        const cv::Mat1b& excluded = {}) {
  const PointGrid placed = back_project(small_camera(), frame, excluded);
  return far_depths(sensor(), frame.depth, excluded, placed, {}, options);
}

RgbdFrame noisy(const std::function<double(int u, int v)>& depth) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  return frame_of(small_camera(), [&](int u, int v) {
    const double z = depth(u, v);
    return z + normal(random) * sensor().sigma(z);
  });
}

TEST(FarSurface, AveragesNoisyDepths) {
  constexpr double kWall = 4.7;
  const cv::Mat1f far = far_depths_of(noisy([](int, int) { return kWall; }));
  double squares = 0, count = 0;
  for (const float z : far) {
    if (z <= 0) continue;
    squares += (z - kWall) * (z - kWall);
    count += 1;
  }
  EXPECT_GT(count, 0.93 * static_cast<double>(far.total()));
  EXPECT_LT(std::sqrt(squares / count), sensor().sigma(kWall) / 4);  // of 25 pixels: a fifth
}

TEST(FarSurface, IsNotBetweenTwoSurfaces) {
  // Column 80 is halfway between a wall and an object one meter in front of it.
  const RgbdFrame frame = frame_of(small_camera(), [](int u, int) {
    return u < 80 ? 4.5 : u == 80 ? 5.0 : 5.5;
  });
  const cv::Mat1f far = far_depths_of(frame, {.max_sigma = 0.060784});
  EXPECT_EQ(cv::countNonZero(far.col(40)), 0);
  EXPECT_NEAR(far(30, 36), 4.5, 1e-5);
  EXPECT_NEAR(far(30, 44), 5.5, 1e-5);
}

TEST(FarSurface, IsOnlyAtPixelsWithoutAPoint) {
  const RgbdFrame near = frame_of(small_camera(), [](int, int) { return 3.0; });
  EXPECT_EQ(cv::countNonZero(far_depths_of(near)), 0);  // All pixels have points.
  // A jump on a near surface is not noise.
  const RgbdFrame steps =
      frame_of(small_camera(), [](int u, int) { return u % 4 < 2 ? 2.0 : 1.9; });
  EXPECT_EQ(cv::countNonZero(far_depths_of(steps)), 0);
}

TEST(FarSurface, IsNotUnderAMaskOrTooFar) {
  const RgbdFrame frame = frame_of(small_camera(), [](int u, int) { return u < 80 ? 4.8 : 5.5; });
  cv::Mat1b mask = cv::Mat1b::zeros(frame.depth.size());
  mask(cv::Rect(10, 10, 20, 20)).setTo(255);
  const cv::Mat1f far = far_depths_of(frame, {}, mask);
  EXPECT_EQ(far(10, 10), 0);
  EXPECT_EQ(far(10, 17), 0);  // six pixels outside the mask
  EXPECT_NEAR(far(10, 20), 4.8, 1e-5);
  EXPECT_EQ(far(10, 60), 0);
  EXPECT_EQ(cv::countNonZero(far_depths_of(frame, {.max_sigma = 0})), 0);
}

}  // namespace
}  // namespace stillmap
