// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/depth_camera.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr std::uint64_t kSeed = 5;

cv::Mat wall(double z) { return cv::Mat(480, 640, CV_32FC1, cv::Scalar(z)); }

/// Returns a camera with this sensor, but without its noise, shadow and missing depth.
Camera perfect(const std::string& sensor = "kinect_v1") {
  Camera camera;
  camera.depth_sensor = find_depth_sensor(sensor);
  camera.depth_sensor.noise = {};
  camera.depth_sensor.lateral_sigma = camera.depth_sensor.edge_loss = 0;
  camera.depth_sensor.disparity_step = camera.depth_sensor.depth_step = 0;
  camera.depth_sensor.baseline = 0;
  return camera;
}

struct Spread {
  double mean, sigma;
};
Spread spread(const cv::Mat& image) {
  cv::Scalar mean, sigma;
  cv::meanStdDev(image, mean, sigma);
  return {mean[0], sigma[0]};
}

TEST(DepthCamera, WithoutNoiseDepthIsExact) {
  const cv::Mat depth = wall(2.345);
  EXPECT_EQ(cv::norm(measure_depth(depth, perfect(), kSeed, 0), depth, cv::NORM_INF), 0);
}

TEST(DepthCamera, BiasIsAnOffsetOfTheDisparity) {
  Camera camera = perfect();
  camera.depth_sensor.baseline = 0.075;
  const double bf = camera.depth_sensor.focal * 0.075;
  const auto depth_with = [&](const DepthBias& bias, int v, int u) {
    return static_cast<double>(measure_depth(wall(3), camera, kSeed, 0, bias).at<float>(v, u));
  };
  EXPECT_NEAR(depth_with({.offset = 0.5}, 240, 320), bf / (bf / 3 + 0.5), 1e-4);
  EXPECT_NEAR(depth_with({.bow = 0.5}, 240, 320), 3, 1e-4);
  EXPECT_NEAR(depth_with({.bow = 0.5}, 0, 639), bf / (bf / 3 + 0.5), 2e-3);
  EXPECT_LT(depth_with({.offset = 0.5}, 240, 320), 2.91);
}

TEST(ColorCamera, AutomaticExposureBringsTheMeanToMiddleGray) {
  const cv::Mat dark(60, 80, CV_32FC3, cv::Scalar(20, 30, 40));
  const ColorNoise fixed{.sigma = 0, .gain = 0, .exposure_drift = 0},
      automatic{.sigma = 0, .gain = 0, .exposure_drift = 0, .auto_exposure = 1};
  EXPECT_NEAR(cv::mean(measure_color(dark, 0, fixed, kSeed, 0))[1], 30, 1e-9);
  EXPECT_NEAR(cv::mean(measure_color(dark, 0, automatic, kSeed, 0))[1], 110, 0.5);
}

TEST(DepthCamera, ThatIsIdealIsExactEverywhere) {
  Camera camera;
  camera.depth_sensor = find_depth_sensor("ideal");
  cv::Mat depth = wall(30);
  depth.colRange(300, 400).setTo(0.05);  // edges, and out of the range of every other sensor
  EXPECT_EQ(cv::norm(measure_depth(depth, camera, kSeed, 0), depth, cv::NORM_INF), 0);
}

class EverySensor : public testing::TestWithParam<std::string> {
 protected:
  static Camera camera() {
    Camera camera;
    camera.depth_sensor = find_depth_sensor(GetParam());
    return camera;
  }
};
INSTANTIATE_TEST_SUITE_P(DepthCamera, EverySensor,
                         testing::Values("kinect_v1", "realsense_d435i", "realsense_d455",
                                         "azure_kinect"),
                         [](const auto& test) { return test.param; });

TEST_P(EverySensor, ErrsAsItsModelSays) {
  const DepthSensor& sensor = find_depth_sensor(GetParam());
  for (const double z : {1.0, 2.0, 3.5}) {
    const cv::Mat measured = measure_depth(wall(z), camera(), kSeed, 3);
    const Spread s = spread(measured.colRange(320, 640));  // without the border that has no shadow
    // Rounding to whole steps adds a variance of step^2 / 12.
    const double bf = sensor.focal * sensor.baseline;
    const double step = bf > 0 ? z * z * sensor.disparity_step / bf : sensor.depth_step;
    const double expected = std::hypot(sensor.sigma(z), step / std::sqrt(12));
    EXPECT_NEAR(s.sigma, expected, 0.03 * expected) << z;
    EXPECT_NEAR(s.mean, z, 0.1 * expected) << z;
  }
}

TEST_P(EverySensor, MeasuresNothingOutsideItsRange) {
  const DepthSensor& sensor = find_depth_sensor(GetParam());
  for (const double z : {0.9 * sensor.min_depth, 1.1 * sensor.max_depth}) {
    EXPECT_EQ(cv::countNonZero(measure_depth(wall(z), camera(), kSeed, 0)), 0) << z;
  }
  for (const double z : {1.1 * sensor.min_depth, 0.9 * sensor.max_depth}) {
    EXPECT_GT(cv::countNonZero(measure_depth(wall(z), camera(), kSeed, 0)), 500 * 480) << z;
  }
}

TEST(DepthCamera, AKinectsDisparityComesInEighthsOfAPixel) {
  const Camera camera;
  const cv::Mat measured = measure_depth(wall(3), camera, kSeed, 0);
  for (int u = 0; u < 640; ++u) {
    const double eighths = 8 * 580 * 0.075 / measured.at<float>(100, u);
    ASSERT_NEAR(eighths, std::round(eighths), 1e-4);
  }
}

TEST(DepthCamera, AnAzureKinectsDepthComesInMillimeters) {
  Camera camera;
  camera.depth_sensor = find_depth_sensor("azure_kinect");
  const cv::Mat measured = measure_depth(wall(3), camera, kSeed, 0);
  for (int u = 0; u < 640; ++u) {
    const double millimeters = 1000.0 * measured.at<float>(100, u);
    ASSERT_NEAR(millimeters, std::round(millimeters), 1e-3);
  }
}

TEST(DepthCamera, AnObjectThrowsAShadowToItsLeft) {
  Camera camera = perfect();
  camera.depth_sensor.baseline = 0.075;
  cv::Mat depth = wall(3);
  depth.colRange(300, 400).setTo(1.5);
  const cv::Mat measured = measure_depth(depth, camera, kSeed, 0);
  // The shadow of the projector, 7.5 cm to the right, is as wide as the difference of disparities.
  const double width = camera.bf() * (1 / 1.5 - 1 / 3.0);
  const cv::Mat row = measured.row(200);
  EXPECT_NEAR(cv::countNonZero(row.colRange(0, 300) == 0), width, 1.0);
  EXPECT_EQ(cv::countNonZero(row.colRange(0, 300 - static_cast<int>(width) - 2) == 0), 0);
  EXPECT_EQ(cv::countNonZero(row.colRange(300, 640) == 0), 0);
}

TEST(DepthCamera, GrazingSurfacesGiveNoDepth) {
  const Camera camera = perfect();
  for (const double degrees : {60.0, 86.0}) {
    cv::Mat depth(480, 640, CV_32FC1);
    const double slope =
        std::tan(degrees * std::numbers::pi / 180);  // z = 2 + slope * x, x = (u - cx) z / f
    for (int v = 0; v < 480; ++v) {
      for (int u = 0; u < 640; ++u) {
        depth.at<float>(v, u) = static_cast<float>(2 / (1 - slope * (u - camera.cx) / camera.fx));
      }
    }
    const cv::Mat measured = measure_depth(depth, camera, kSeed, 0);
    EXPECT_EQ(measured.at<float>(240, 320) > 0, degrees < 80) << degrees;
  }
}

TEST(DepthCamera, EdgesLosePixels) {
  Camera camera = perfect();
  camera.depth_sensor.edge_loss = 0.4;
  cv::Mat depth = wall(3);
  depth.colRange(300, 400).setTo(1.5);
  const cv::Mat measured = measure_depth(depth, camera, kSeed, 0);
  EXPECT_NEAR(cv::countNonZero(measured.col(300) == 0), 0.4 * 480, 0.1 * 480);
  EXPECT_EQ(cv::countNonZero(measured.col(350) == 0), 0);
}

TEST(DepthCamera, NoiseDependsOnSeedAndFrameAlone) {
  const cv::Mat depth = wall(2);
  const auto measure = [&](std::uint64_t seed, std::uint64_t frame) {
    return measure_depth(depth, {}, seed, frame);
  };
  EXPECT_EQ(cv::norm(measure(1, 4), measure(1, 4), cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(measure(1, 4), measure(1, 5), cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(measure(1, 4), measure(2, 4), cv::NORM_INF), 0);
}

TEST(DepthCamera, ColorNoiseGrowsWithTheValue) {
  const ColorNoise noise{.exposure_drift = 0};
  for (const double value : {40.0, 120.0, 200.0}) {
    const cv::Mat color(480, 640, CV_32FC3, cv::Scalar::all(value));
    const Spread s = spread(measure_color(color, 0, noise, kSeed, 0));
    // Rounding to whole gray levels adds a variance of 1/12.
    const double expected = std::sqrt(1.5 * 1.5 + 0.02 * value + 1 / 12.0);
    EXPECT_NEAR(s.sigma, expected, 0.03 * expected) << value;
    EXPECT_NEAR(s.mean, value, 0.05) << value;
  }
}

TEST(DepthCamera, ExposureDriftsWithinItsAmplitude) {
  const ColorNoise noise{.sigma = 0, .gain = 0};
  const cv::Mat color(8, 8, CV_32FC3, cv::Scalar::all(200));
  double low = 255, high = 0;
  for (double t = 0; t < 60; t += 0.5) {
    const double value = spread(measure_color(color, t, noise, kSeed, 0)).mean;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  EXPECT_GT(high - low, 6);
  EXPECT_GE(low, 200 * 0.97 - 0.5);
  EXPECT_LE(high, 200 * 1.03 + 0.5);
}

}  // namespace
}  // namespace stillmap
