// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/far_surface.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/dense/synthetic_frame.hpp"

#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

const DepthSensor& sensor() { return find_depth_sensor("kinect_v1"); }

/// What far_depths() makes of a frame behind back_project().
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

TEST(FarSurface, IsWhereManyNoisyDepthsAgree) {
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

TEST(FarSurface, IsNothingBetweenTwoSurfaces) {
  // Column 80 lies halfway between a wall and what stands a meter before it.
  const RgbdFrame frame = frame_of(small_camera(), [](int u, int) {
    return u < 80 ? 4.5 : u == 80 ? 5.0 : 5.5;
  });
  const cv::Mat1f far = far_depths_of(frame, {.max_sigma = 0.060784});
  EXPECT_EQ(cv::countNonZero(far.col(40)), 0);
  EXPECT_NEAR(far(30, 36), 4.5, 1e-5);
  EXPECT_NEAR(far(30, 44), 5.5, 1e-5);
}

TEST(FarSurface, IsWhereNoPointWasPlaced) {
  const RgbdFrame near = frame_of(small_camera(), [](int, int) { return 3.0; });
  EXPECT_EQ(cv::countNonZero(far_depths_of(near)), 0);  // all of it was
  // A jump on what is near is one, and no noise.
  const RgbdFrame steps =
      frame_of(small_camera(), [](int u, int) { return u % 4 < 2 ? 2.0 : 1.9; });
  EXPECT_EQ(cv::countNonZero(far_depths_of(steps)), 0);
}

TEST(FarSurface, IsNeitherUnderAMaskNorTooFar) {
  const RgbdFrame frame = frame_of(small_camera(), [](int u, int) { return u < 80 ? 4.8 : 5.5; });
  cv::Mat1b mask = cv::Mat1b::zeros(frame.depth.size());
  mask(cv::Rect(10, 10, 20, 20)).setTo(255);
  const cv::Mat1f far = far_depths_of(frame, {}, mask);
  EXPECT_EQ(far(10, 10), 0);
  EXPECT_EQ(far(10, 17), 0);  // six pixels beside it
  EXPECT_NEAR(far(10, 20), 4.8, 1e-5);
  EXPECT_EQ(far(10, 60), 0);
  EXPECT_EQ(cv::countNonZero(far_depths_of(frame, {.max_sigma = 0})), 0);
}

}  // namespace
}  // namespace stillmap
