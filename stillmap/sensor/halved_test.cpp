// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/halved.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/sensor/converted_source.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

Camera recorded() {
  Camera camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = 131;
  camera.fy = 129;
  camera.cx = 79.3;
  camera.cy = 59.8;
  return camera;
}

/// A plane in front of the camera, z = 2 + 0.3 x - 0.2 y [m].
double plane_depth(const Camera& camera, double u, double v) {
  const Eigen::Vector3d ray = camera.unproject(u, v, 1);
  return 2 / (1 - 0.3 * ray.x() + 0.2 * ray.y());
}

RgbdFrame frame_of(const Camera& camera) {
  RgbdFrame frame;
  frame.index = 7;
  frame.timestamp = 1.5;
  frame.gray.create(camera.height, camera.width, CV_8UC1);
  frame.depth.create(camera.height, camera.width, CV_32FC1);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      frame.gray.at<uchar>(y, x) = static_cast<uchar>(x);
      frame.depth.at<float>(y, x) = static_cast<float>(plane_depth(camera, x, y));
    }
  }
  cv::merge(std::vector<cv::Mat>(3, frame.gray), frame.color);
  return frame;
}

class Frames : public FrameSource {
 public:
  Frames(const Camera& camera, int count) : camera_(camera), left_(count) {}
  const Camera& camera() const override { return camera_; }
  RgbdFramePtr next() override {
    return left_-- > 0 ? std::make_shared<RgbdFrame>(frame_of(camera_)) : nullptr;
  }
  std::optional<std::size_t> size() const override { return left_; }
  const std::vector<SkippedFrame>& skipped() const override { return skipped_; }

 private:
  Camera camera_;
  int left_;
  std::vector<SkippedFrame> skipped_ = {{0.5, "torn"}};
};

TEST(Halved, APointProjectsToTheCenterOfItsPixels) {
  const Camera camera = recorded(), half = halved(camera);
  const Eigen::Vector3d point(0.21, -0.17, 1.9);
  const Eigen::Vector2d whole_pixel = camera.project(point), half_pixel = half.project(point);
  EXPECT_NEAR(half_pixel.x(), (whole_pixel.x() - 0.5) / 2, 1e-12);
  EXPECT_NEAR(half_pixel.y(), (whole_pixel.y() - 0.5) / 2, 1e-12);
}

TEST(Halved, ThePlaneIsUnchanged) {
  const Camera camera = recorded(), half = halved(camera);
  const RgbdFrame small = halved(frame_of(camera));
  ASSERT_EQ(small.depth.size(), cv::Size(80, 60));
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x) {
      EXPECT_NEAR(small.depth.at<float>(y, x), plane_depth(half, x, y), 2e-4);
    }
  }
  EXPECT_EQ(small.gray.at<uchar>(3, 20), 41) << "mean of 40 and 41, rounded";
  EXPECT_EQ(small.color.size(), cv::Size(80, 60));
  EXPECT_EQ(small.index, 7U);
  EXPECT_EQ(small.timestamp, 1.5);
}

TEST(Halved, ReadingsOfTwoSurfacesAreNotMixed) {
  RgbdFrame frame = frame_of(recorded());
  cv::Mat(cv::Matx22f(1, 3, 0, 1.02F)).copyTo(frame.depth({2, 2, 2, 2}));
  frame.depth({4, 2, 2, 2}).setTo(0);
  const RgbdFrame small = halved(frame);
  EXPECT_FLOAT_EQ(small.depth.at<float>(1, 1), 1.01F);
  EXPECT_EQ(small.depth.at<float>(1, 2), 0) << "no reading";
}

TEST(Halved, APixelIsIgnoredIfOneOfItsFourIs) {
  RgbdFrame frame = frame_of(recorded());
  EXPECT_TRUE(halved(frame).ignored.empty());
  frame.ignored = cv::Mat(frame.gray.size(), CV_8UC1, cv::Scalar(0));
  frame.ignored.at<uchar>(5, 7) = 255;
  const RgbdFrame small = halved(frame);
  EXPECT_EQ(cv::countNonZero(small.ignored), 1);
  EXPECT_NE(small.ignored.at<uchar>(2, 3), 0);
}

TEST(ConvertedSource, ReturnsAllFrames) {
  ConvertedSource source(std::make_unique<Frames>(recorded(), 2), halved(recorded()),
                         [](const RgbdFrame& frame) { return halved(frame); });
  EXPECT_EQ(source.camera().width, 80);
  EXPECT_EQ(source.size(), 2U);
  ASSERT_TRUE(source.next());
  EXPECT_EQ(source.next()->gray.size(), cv::Size(80, 60));
  EXPECT_FALSE(source.next());
  EXPECT_EQ(source.skipped().size(), 1U);
}

TEST(Halved, RefusesImagesThatAreTooSmall) {
  Camera small = recorded();
  small.width = 120;
  EXPECT_THROW(halved(small), Error);
}

}  // namespace
}  // namespace stillmap
