// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/rotated.hpp"

#include "stillmap/base/error.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

Camera recorded() {
  Camera camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = 52;
  camera.fy = 50;
  camera.cx = 30;
  camera.cy = 25;
  return camera;
}

/// A frame whose gray value and depth at (u, v) tell the pixel.
RgbdFrame frame_of(const Camera& camera) {
  RgbdFrame frame;
  frame.index = 7;
  frame.timestamp = 1.5;
  frame.gray.create(camera.height, camera.width, CV_8UC1);
  frame.depth.create(camera.height, camera.width, CV_32FC1);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      frame.gray.at<uchar>(v, u) = static_cast<uchar>(u + v);
      frame.depth.at<float>(v, u) = static_cast<float>(u + 100 * v + 1);
    }
  }
  cv::merge(std::vector<cv::Mat>(3, frame.gray), frame.color);
  return frame;
}

class Rotated : public testing::TestWithParam<int> {};

TEST_P(Rotated, APointIsSeenInItsTurnedPixel) {
  const Camera camera = recorded(), turned = rotated(camera, GetParam());
  const RgbdFrame frame = frame_of(camera), other = rotated(frame, GetParam());
  ASSERT_EQ(other.depth.size(), cv::Size(turned.width, turned.height));
  ASSERT_EQ(other.color.size(), other.depth.size());
  for (const auto& [u, v] : {std::pair{0, 0}, {63, 0}, {17, 40}, {30, 25}}) {
    const Eigen::Vector2d pixel =
        turned.project(turned_camera(GetParam()).inverse() * camera.unproject(u, v, 2));
    const cv::Point at(static_cast<int>(std::lround(pixel.x())),
                       static_cast<int>(std::lround(pixel.y())));
    EXPECT_NEAR((pixel - Eigen::Vector2d(at.x, at.y)).norm(), 0, 1e-9);
    EXPECT_EQ(other.depth.at<float>(at), frame.depth.at<float>(v, u));
    EXPECT_EQ(other.gray.at<uchar>(at), frame.gray.at<uchar>(v, u));
  }
  EXPECT_TRUE(other.ignored.empty());
  EXPECT_EQ(other.index, 7U);
}

INSTANTIATE_TEST_SUITE_P(Angles, Rotated, testing::Values(0, 90, 180, 270));

TEST(Rotated, RefusesOtherAnglesAndReadoutTimes) {
  EXPECT_THROW(rotated(recorded(), 45), Error);
  EXPECT_THROW(rotated(recorded(), -90), Error);
  EXPECT_THROW(rotated(recorded(), 360), Error);
  Camera rolling = recorded();
  rolling.shutter = {.readout = 0.02, .depth_delay = 0};
  EXPECT_THROW(rotated(rolling, 180), Error);
  EXPECT_EQ(rotated(rolling, 0).shutter, rolling.shutter);
}

}  // namespace
}  // namespace stillmap
