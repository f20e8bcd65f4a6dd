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

TEST(MoverImage, MoversOfDistantIdsDifferInColor) {
  std::vector<MoverTrack> movers{walker(), walker()};
  movers[1].id = 8;
  for (MoverSample& sample : movers[1].samples) sample.centroid.z() = 5;
  const cv::Mat image = draw_movers(movers, {{0, Pose()}, {1, Pose()}}, {}, 600);
  for (const cv::Scalar& color : {cv::Scalar(178, 114, 0), cv::Scalar(0, 94, 213)}) {
    cv::Mat drawn;
    cv::inRange(image, color - cv::Scalar::all(2), color + cv::Scalar::all(2), drawn);
    EXPECT_GT(cv::countNonZero(drawn), 50) << color;
  }
}

TEST(MoverImage, TheLastBoxIsInsideTheImage) {
  MoverTrack mover = walker();
  mover.samples.back().box = {Eigen::Vector3d(0, -1, 2), Eigen::Vector3d(4, 1, 4)};
  const cv::Mat image = draw_movers({mover}, {{0, Pose()}, {1, Pose()}}, {}, 600);
  cv::Mat blue;
  cv::inRange(image, cv::Scalar(150, 80, 0), cv::Scalar(200, 140, 40), blue);
  EXPECT_LT(cv::boundingRect(blue).br().x, image.cols - 5);
}

TEST(MoverImage, NeedsNoData) { EXPECT_FALSE(draw_movers({}, {}, {}).empty()); }

}  // namespace
}  // namespace stillmap
