// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/mover_image.hpp"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Returns a mover that moves along x, 3 m in front of the camera; y points down.
MoverTrack walker() {
  MoverTrack track;
  track.id = 1;
  track.class_name = "person";
  for (int i = 0; i < 40; ++i) {
    MoverSample sample;
    sample.timestamp = i / 30.0;
    sample.observed = true;
    sample.centroid = {-1 + 0.05 * i, 0, 3};
    sample.velocity = {0.5, 0, 0};
    track.samples.push_back(sample);
  }
  return track;
}

TEST(MoverImage, ShowsThePathInFrontOfTheCamera) {
  const Trajectory cameras{{0, Pose()}, {1, Pose()}};  // from above: x to the right, z upwards
  const cv::Mat image = draw_movers({walker()}, cameras, {}, 600);
  ASSERT_EQ(image.type(), CV_8UC3);
  ASSERT_EQ(image.cols, 600);
  cv::Mat blue;  // color of the first mover
  cv::inRange(image, cv::Scalar(150, 80, 0), cv::Scalar(200, 140, 40), blue);
  const cv::Rect where = cv::boundingRect(blue);
  ASSERT_GT(where.area(), 0);
  EXPECT_LT(where.br().y, image.rows / 2) << "3 m ahead of the camera is the upper half";
  EXPECT_GT(where.width, 3 * where.height) << "the path leads from left to right";
}

TEST(MoverImage, NeedsNoData) { EXPECT_FALSE(draw_movers({}, {}, {}).empty()); }

}  // namespace
}  // namespace stillmap
