// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/fused_depth.hpp"

#include "stillmap/dense/synthetic_frame.hpp"

#include <random>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

constexpr int kRow = 30, kCol = 40;  // a pixel in the middle of a view at stride 2

DenseView view_of_wall(double depth) {
  const RgbdFrame frame = frame_of(small_camera(), [&](int, int) { return depth; });
  return make_dense_view(small_camera(), frame, {}).view;
}

cv::Mat1f wall(double depth) {
  return cv::Mat1f(small_camera().height, small_camera().width, static_cast<float>(depth));
}

TEST(FusedDepth, AveragesInverseDepths) {
  FusedDepth fused(view_of_wall(2));
  fused.add(small_camera(), wall(2.02), {}, Pose());
  EXPECT_NEAR(fused.at(kRow, kCol), 2 / (1 / 2.0 + 1 / 2.02), 1e-4);
  EXPECT_EQ(fused.supported(kRow, kCol), 2);
}

TEST(FusedDepth, NoiseFallsWithTheNumberOfImages) {
  const Camera camera = small_camera();
  const double sigma = camera.depth_sensor.sigma(2);
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, sigma);
  const auto noisy = [&](int, int) { return 2 + noise(random); };
  FusedDepth fused(make_dense_view(camera, frame_of(camera, noisy), {}).view);
  for (int i = 0; i < 8; ++i) fused.add(camera, frame_of(camera, noisy).depth, {}, Pose());
  double squares = 0;
  int count = 0;
  for (int row = 5; row < 55; ++row) {
    for (int col = 5; col < 75; ++col) {
      if (fused.supported(row, col) < 9) continue;
      squares += std::pow(fused.at(row, col) - 2, 2);
      ++count;
    }
  }
  ASSERT_GT(count, 3000);
  EXPECT_LT(std::sqrt(squares / count), 0.4 * sigma);  // a third, by nine measurements
  EXPECT_NEAR(fused.sigma(kRow, kCol), sigma / 3, 0.01 * sigma);
}

TEST(FusedDepth, FollowsTheMotionOfTheCamera) {
  const Camera camera = small_camera();
  const Plane floor{Eigen::Vector3d(0.1, -0.3, 1).normalized(), 2};
  const Pose moved(Eigen::Quaterniond(Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitY())),
                   Eigen::Vector3d(0.1, 0.02, -0.05));
  FusedDepth fused(make_dense_view(camera, view_of(camera, Pose(), floor), {}).view);
  fused.add(camera, view_of(camera, moved, floor).depth, {}, moved);
  EXPECT_EQ(fused.supported(kRow, kCol), 2);
  EXPECT_NEAR(fused.at(kRow, kCol), plane_depth(camera, Pose(), floor, 2 * kCol, 2 * kRow), 1e-3);
}

TEST(FusedDepth, ASurfaceThatMoreImagesSeeThroughIsGone) {
  FusedDepth fused(view_of_wall(2));
  fused.add(small_camera(), wall(3), {}, Pose());
  EXPECT_NEAR(fused.at(kRow, kCol), 2, 1e-3);  // one for, one against
  fused.add(small_camera(), wall(3), {}, Pose());
  EXPECT_EQ(fused.at(kRow, kCol), 0);
}

TEST(FusedDepth, ASurfaceThatWasSeenForLongCanGoToo) {
  FusedDepth fused(view_of_wall(2));
  for (int i = 0; i < 300; ++i) fused.add(small_camera(), wall(2), {}, Pose());
  for (int i = 0; i < 300; ++i) fused.add(small_camera(), wall(3), {}, Pose());
  EXPECT_EQ(fused.at(kRow, kCol), 0);
}

TEST(FusedDepth, ANearerSurfaceHidesWithoutRefuting) {
  FusedDepth fused(view_of_wall(2));
  for (int i = 0; i < 5; ++i) fused.add(small_camera(), wall(1), {}, Pose());
  EXPECT_NEAR(fused.at(kRow, kCol), 2, 1e-3);
  EXPECT_EQ(fused.supported(kRow, kCol), 1);
}

TEST(FusedDepth, AMoverAtTheSurfaceRefutesIt) {
  FusedDepth here(view_of_wall(2)), behind(view_of_wall(2));
  for (int i = 0; i < 2; ++i) {
    here.add(small_camera(), wall(0), wall(2), Pose());
    behind.add(small_camera(), wall(0), wall(1.5), Pose());
  }
  EXPECT_EQ(here.at(kRow, kCol), 0);
  EXPECT_NEAR(behind.at(kRow, kCol), 2, 1e-3);
}

}  // namespace
}  // namespace stillmap
