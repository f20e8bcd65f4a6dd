// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/pyramid.hpp"

#include "stillmap/feature/dead_leaves.hpp"
#include "stillmap/feature/resample.hpp"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

class Shrinking : public testing::TestWithParam<CpuPath> {};
INSTANTIATE_TEST_SUITE_P(Paths, Shrinking, testing::Values(CpuPath::kPortable, best_cpu_path()),
                         [](const auto& suite) { return suite.index == 0 ? "Portable" : "Best"; });

TEST_P(Shrinking, IsBilinear) {
  const cv::Mat image = dead_leaves({151, 97}, 1);
  Shrinker shrink(GetParam());
  for (const cv::Size size : {cv::Size(126, 81), {151, 97}, {76, 49}, {100, 97}, {17, 9}, {3, 2}}) {
    cv::Mat shrunk, expected;
    shrink(image, size, shrunk);
    cv::resize(image, expected, size, 0, 0, cv::INTER_LINEAR_EXACT);
    // Weights of 1/64 and two roundings give an error of one or two gray values; at edges of full
    // contrast, four.
    EXPECT_LE(cv::norm(shrunk, expected, cv::NORM_INF), 4) << size;
    EXPECT_LE(cv::norm(shrunk, expected, cv::NORM_L1) / size.area(), 0.6) << size;
  }
}

TEST(Shrinker, GivesTheSameBitsOnEveryPath) {
  const cv::Mat image = dead_leaves({203, 61}, 2);
  Shrinker portable(CpuPath::kPortable), best(best_cpu_path());
  for (int width = 2; width <= 203; ++width) {
    cv::Mat a, b;
    portable(image, {width, 50}, a);
    best(image, {width, 50}, b);
    ASSERT_EQ(cv::norm(a, b, cv::NORM_INF), 0) << width;
  }
}

TEST(ImagePyramid, HasTheSpecifiedLevels) {
  const cv::Mat image = dead_leaves({640, 480}, 3);
  ImagePyramid pyramid;
  pyramid.build(image, {8, 1.2}, 33);
  ASSERT_EQ(pyramid.levels(), 8);
  EXPECT_EQ(pyramid[0].data, image.data);
  EXPECT_EQ(pyramid[1].size(), cv::Size(533, 400));
  EXPECT_EQ(pyramid[7].size(), cv::Size(179, 134));
  pyramid.build(dead_leaves({100, 50}, 4), {8, 1.2}, 33);
  EXPECT_EQ(pyramid.levels(), 3);  // 50, 42, 35
  pyramid.build(dead_leaves({20, 200}, 4), {8, 1.2}, 33);
  EXPECT_EQ(pyramid.levels(), 0);
}

TEST(ImagePyramid, LevelsAreAligned) {
  // The centroid of a soft spot, found at each level, maps to the same position.
  cv::Mat image(480, 640, CV_8UC1);
  const cv::Point2d truth(231.3, 174.8);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const double r2 = (x - truth.x) * (x - truth.x) + (y - truth.y) * (y - truth.y);
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(240 * std::exp(-r2 / 200));
    }
  }
  ImagePyramid pyramid;
  pyramid.build(image, {8, 1.2}, 33);
  for (int level = 0; level < 8; ++level) {
    const cv::Moments m = cv::moments(pyramid[level]);
    const cv::Point2d p = pyramid.to_full_size(cv::Point2d(m.m10 / m.m00, m.m01 / m.m00), level);
    EXPECT_NEAR(p.x, truth.x, 0.1) << level;
    EXPECT_NEAR(p.y, truth.y, 0.1) << level;
  }
}

}  // namespace
}  // namespace stillmap
