// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/kinect.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr std::uint64_t kSeed = 5;

cv::Mat wall(double z) { return cv::Mat(480, 640, CV_32FC1, cv::Scalar(z)); }

KinectOptions perfect() {
  KinectOptions options;
  options.axial = options.lateral = options.disparity_step = options.edge_loss =
      options.exposure_drift = 0;
  options.shadow = false;
  return options;
}

struct Spread {
  double mean, sigma;
};
Spread spread(const cv::Mat& image) {
  cv::Scalar mean, sigma;
  cv::meanStdDev(image, mean, sigma);
  return {mean[0], sigma[0]};
}

TEST(Kinect, WithoutNoiseDepthIsExact) {
  const cv::Mat depth = wall(2.345);
  EXPECT_EQ(cv::norm(measure_depth(depth, {}, perfect(), kSeed, 0), depth, cv::NORM_INF), 0);
}

TEST(Kinect, AxialNoiseGrowsAsNguyenMeasured) {
  KinectOptions options = perfect();
  options.axial = 1;
  for (const double z : {1.0, 2.0, 3.5, 5.0}) {
    const Spread s = spread(measure_depth(wall(z), {}, options, kSeed, 3));
    const double expected = 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4);
    EXPECT_NEAR(s.sigma, expected, 0.03 * expected) << z;
    EXPECT_NEAR(s.mean, z, 0.02 * expected)
        << z;  // 307200 pixels: the mean of the noise is far below
  }
}

TEST(Kinect, DisparityComesInEighthsOfAPixel) {
  KinectOptions options = perfect();
  options.axial = 1;
  options.disparity_step = 0.125;
  const Camera camera;
  const cv::Mat measured = measure_depth(wall(3), camera, options, kSeed, 0);
  for (int u = 0; u < 640; ++u) {
    const double eighths = 8 * options.focal * camera.baseline / measured.at<float>(100, u);
    ASSERT_NEAR(eighths, std::round(eighths), 1e-4);
  }
}

TEST(Kinect, AThingThrowsAShadowToItsLeft) {
  KinectOptions options = perfect();
  options.shadow = true;
  const Camera camera;
  cv::Mat depth = wall(3);
  depth.colRange(300, 400).setTo(1.5);
  const cv::Mat measured = measure_depth(depth, camera, options, kSeed, 0);
  // What the projector, 7.5 cm to the right, cannot light: as wide as the disparities differ.
  const double width = camera.bf() * (1 / 1.5 - 1 / 3.0);
  const cv::Mat row = measured.row(200);
  EXPECT_NEAR(cv::countNonZero(row.colRange(0, 300) == 0), width, 1.0);
  EXPECT_EQ(cv::countNonZero(row.colRange(0, 300 - static_cast<int>(width) - 2) == 0), 0);
  EXPECT_EQ(cv::countNonZero(row.colRange(300, 640) == 0), 0);
}

TEST(Kinect, GrazingSurfacesGiveNoDepth) {
  const Camera camera;
  for (const double degrees : {60.0, 86.0}) {
    cv::Mat depth(480, 640, CV_32FC1);
    const double slope =
        std::tan(degrees * std::numbers::pi / 180);  // z = 2 + slope * x, x = (u - cx) z / f
    for (int v = 0; v < 480; ++v) {
      for (int u = 0; u < 640; ++u) {
        depth.at<float>(v, u) = static_cast<float>(2 / (1 - slope * (u - camera.cx) / camera.fx));
      }
    }
    const cv::Mat measured = measure_depth(depth, camera, perfect(), kSeed, 0);
    EXPECT_EQ(measured.at<float>(240, 320) > 0, degrees < 80) << degrees;
  }
}

TEST(Kinect, EdgesLosePixels) {
  KinectOptions options = perfect();
  options.edge_loss = 0.4;
  cv::Mat depth = wall(3);
  depth.colRange(300, 400).setTo(1.5);
  const cv::Mat measured = measure_depth(depth, {}, options, kSeed, 0);
  EXPECT_NEAR(cv::countNonZero(measured.col(300) == 0), 0.4 * 480, 0.1 * 480);
  EXPECT_EQ(cv::countNonZero(measured.col(350) == 0), 0);
}

TEST(Kinect, RangeIsLimited) {
  for (const double z : {0.3, 9.0}) {
    EXPECT_EQ(cv::countNonZero(measure_depth(wall(z), {}, perfect(), kSeed, 0)), 0) << z;
  }
}

TEST(Kinect, NoiseDependsOnSeedAndFrameAlone) {
  const cv::Mat depth = wall(2);
  const auto measure = [&](std::uint64_t seed, std::uint64_t frame) {
    return measure_depth(depth, {}, {}, seed, frame);
  };
  EXPECT_EQ(cv::norm(measure(1, 4), measure(1, 4), cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(measure(1, 4), measure(1, 5), cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(measure(1, 4), measure(2, 4), cv::NORM_INF), 0);
}

TEST(Kinect, ColorNoiseGrowsWithTheValue) {
  KinectOptions options;
  options.exposure_drift = 0;
  for (const double value : {40.0, 120.0, 200.0}) {
    const cv::Mat color(480, 640, CV_32FC3, cv::Scalar::all(value));
    const Spread s = spread(measure_color(color, 0, options, kSeed, 0));
    // Rounding to whole gray levels adds a variance of 1/12.
    const double expected = std::sqrt(1.5 * 1.5 + 0.02 * value + 1 / 12.0);
    EXPECT_NEAR(s.sigma, expected, 0.03 * expected) << value;
    EXPECT_NEAR(s.mean, value, 0.05) << value;
  }
}

TEST(Kinect, ExposureDriftsWithinItsAmplitude) {
  KinectOptions options;
  options.color_sigma = options.color_gain = 0;
  const cv::Mat color(8, 8, CV_32FC3, cv::Scalar::all(200));
  double low = 255, high = 0;
  for (double t = 0; t < 60; t += 0.5) {
    const double value = spread(measure_color(color, t, options, kSeed, 0)).mean;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  EXPECT_GT(high - low, 6);
  EXPECT_GE(low, 200 * 0.97 - 0.5);
  EXPECT_LE(high, 200 * 1.03 + 0.5);
}

}  // namespace
}  // namespace stillmap
