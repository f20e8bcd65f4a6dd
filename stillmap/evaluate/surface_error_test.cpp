// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/surface_error.hpp"

#include "stillmap/base/error.hpp"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr double kDepth = 2;

Camera small_camera() {
  return {
      .name = "test", .width = 160, .height = 120, .fx = 132, .fy = 132, .cx = 79.5, .cy = 59.5};
}

// A wall 2 m ahead, one meter to each side, a point per centimeter, at an offset.
std::vector<Eigen::Vector3f> wall(float z, float shift = 0) {
  std::vector<Eigen::Vector3f> points;
  for (int x = -100; x <= 100; ++x) {
    for (int y = -80; y <= 80; ++y) {
      points.emplace_back(0.01F * static_cast<float>(x) + shift,
                          0.01F * static_cast<float>(y) + shift, z);
    }
  }
  return points;
}

MaskedFrame frame_of(double depth, const cv::Rect& masked = {}) {
  const Camera camera = small_camera();
  MaskedFrame frame;
  frame.depth = cv::Mat(camera.height, camera.width, CV_32FC1, cv::Scalar(depth));
  frame.mask = cv::Mat::zeros(camera.height, camera.width, CV_8UC1);
  frame.mask(masked).setTo(255);
  return frame;
}

TrueSurface seen_wall(int frames, double measured = kDepth, const cv::Rect& masked = {}) {
  TrueSurface surface(wall(kDepth));
  for (int i = 0; i < frames; ++i) surface.look(frame_of(measured, masked), Pose(), small_camera());
  return surface;
}

TEST(NearestPoint, FindsTheNearestWithinReach) {
  const NearestPoint index(wall(kDepth), 0.1);
  const auto found = index.find({0.503F, -0.204F, 2.04F});
  ASSERT_TRUE(found);
  EXPECT_LT((index.points()[found->index] - Eigen::Vector3f(0.5F, -0.2F, 2)).norm(), 1e-6);
  EXPECT_NEAR(found->distance, std::sqrt(0.003 * 0.003 + 0.004 * 0.004 + 0.04 * 0.04), 1e-6);
  EXPECT_FALSE(index.find({0, 0, 2.11F}));
  EXPECT_FALSE(index.find({std::numeric_limits<float>::quiet_NaN(), 0, 2}));
  EXPECT_EQ(index.around({0, 0, 2}, 0.0101F).size(), 5U);
}

TEST(TrueSurface, DistanceAlongTheNormalIsIndependentOfTheSpacing) {
  // The cloud's points lie 7 mm in front of the wall, and between the wall's points.
  const SurfaceFigures figures = seen_wall(5).judge(wall(kDepth - 0.007F, 0.005F), Pose());
  EXPECT_NEAR(figures.median, 0.007, 1e-5);
  EXPECT_NEAR(figures.p95, 0.007, 1e-3);  // one row lies beyond the wall's border
  EXPECT_EQ(figures.stray_share, 0);
  EXPECT_EQ(figures.complete_2cm, 1);
}

TEST(TrueSurface, BringsTheCloudIntoTheTruthsWorld) {
  const Pose T_truth_estimate(so3_exp({0.3, -0.2, 0.5}), {1, 2, 3});
  std::vector<Eigen::Vector3f> cloud;
  for (const Eigen::Vector3f& p : wall(kDepth)) {
    cloud.push_back((T_truth_estimate.inverse() * p.cast<double>()).cast<float>());
  }
  EXPECT_LT(seen_wall(5).judge(cloud, T_truth_estimate).p95, 1e-5);
}

TEST(TrueSurface, CountsMissingAndSuperfluousPoints) {
  std::vector<Eigen::Vector3f> cloud = wall(kDepth);
  std::erase_if(cloud, [](const auto& p) { return p.x() > 0; });
  const std::size_t half = cloud.size();
  for (int i = 0; i < 100; ++i) cloud.emplace_back(0, 0, 1.0F);  // a ghost
  const SurfaceFigures figures = seen_wall(5).judge(cloud, Pose());
  EXPECT_NEAR(figures.complete_5cm, 0.5, 0.03);
  EXPECT_LT(figures.complete_2cm, figures.complete_5cm);
  EXPECT_NEAR(figures.stray_share, 100.0 / static_cast<double>(half + 100), 1e-9);
}

TEST(TrueSurface, CompletenessCountsVisiblePointsOnly) {
  const std::vector<Eigen::Vector3f> nothing;
  const auto visible = [&](const TrueSurface& surface) {
    return surface.judge(nothing, Pose()).visible;
  };
  const std::size_t all = visible(seen_wall(3));
  EXPECT_EQ(all, (201U * 161 + 1) / 2);       // all in view; every second true point is judged
  EXPECT_EQ(visible(seen_wall(2)), 0U);       // too few frames
  EXPECT_EQ(visible(seen_wall(5, 1.5)), 0U);  // hidden by something
  EXPECT_EQ(visible(seen_wall(5, 0)), 0U);    // nothing measured
  EXPECT_LT(visible(seen_wall(5, kDepth, {0, 0, 80, 120})), 0.6 * static_cast<double>(all));
}

TEST(TrueSurface, ReportsTheErrorOfTheSensor) {
  const SurfaceFigures figures = seen_wall(3, kDepth + 0.0123).judge({}, Pose());
  EXPECT_NEAR(figures.sensor_median, 0.0123, 1e-3);
}

TEST(TrueSurface, NeedsPoints) { EXPECT_THROW(TrueSurface({}), Error); }

}  // namespace
}  // namespace stillmap
