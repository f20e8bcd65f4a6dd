// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/sharpness.hpp"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

TEST(Sharpness, OfAUniformImageIsZero) {
  EXPECT_EQ(sharpness(cv::Mat(48, 64, CV_8UC1, cv::Scalar(77))), 0);
}

TEST(Sharpness, OfARampIsItsSquaredSlopePerBlock) {
  cv::Mat1b ramp(48, 64);
  for (int y = 0; y < ramp.rows; ++y) {
    for (int x = 0; x < ramp.cols; ++x) ramp(y, x) = static_cast<std::uint8_t>(2 * x + y);
  }
  EXPECT_DOUBLE_EQ(sharpness(ramp), 4 * 4 + 2 * 2);  // Two pixels further: 4 to the right, 2 below.
}

TEST(Sharpness, FallsWithMotionBlurInEitherDirection) {
  cv::Mat1b noise(480, 640);
  cv::RNG(1).fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::Mat scene, across, down;
  cv::GaussianBlur(noise, scene, {}, 2);
  cv::blur(scene, across, {9, 1});
  cv::blur(scene, down, {1, 9});
  EXPECT_LT(sharpness(across), 0.6 * sharpness(scene));
  EXPECT_LT(sharpness(down), 0.6 * sharpness(scene));
}

}  // namespace
}  // namespace stillmap
