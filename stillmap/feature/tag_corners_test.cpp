// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/tag_corners.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

Tag square(std::uint32_t id, float left, float top, float side) {
  return {{2, id},
          {{{left, top + side}, {left + side, top + side}, {left + side, top}, {left, top}}}};
}

TEST(TagCorners, DescriptorsStandForTheirCorners) {
  std::vector<Descriptor> descriptors;
  for (const std::uint8_t family : {0, 6}) {
    for (const std::uint32_t id : {0U, 1U, 2U, 586U, 48713U}) {
      for (std::uint8_t i = 0; i < 4; ++i) {
        const TagCorner corner{{family, id}, i};
        EXPECT_EQ(tag_corner_of(descriptor_of(corner)), corner);
        descriptors.push_back(descriptor_of(corner));
      }
    }
  }
  // The number of different bits of two random descriptors has the standard deviation 8.
  for (std::size_t a = 0; a < descriptors.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b)
      EXPECT_GT(distance(descriptors[a], descriptors[b]), 128 - 5 * 8) << a << " " << b;
  }
}

TEST(TagCorners, OtherDescriptorsStandForNone) {
  Descriptor changed = descriptor_of({{0, 7}, 1});
  EXPECT_FALSE(tag_corner_of(Descriptor{}));
  changed[3] ^= 1;
  EXPECT_FALSE(tag_corner_of(changed));
  changed = descriptor_of({{0, 7}, 4});
  EXPECT_FALSE(tag_corner_of(changed)) << "a tag has four corners";
}

TEST(TagCorners, AreKeypointsWithDepthInTheGrid) {
  cv::Mat depth(100, 120, CV_32FC1, cv::Scalar(2));
  depth(cv::Rect(0, 0, 60, 100)) = 3;
  Features features;
  features.keypoints = {{.u = 5, .v = 6, .level = 2}};
  features.descriptors = {Descriptor{1, 2, 3, 4}};
  const std::vector<Tag> tags = {square(5, 20, 30, 20), square(6, 80, 30, 20)};
  const Features with = with_tag_corners(features, tags, depth, {});
  ASSERT_EQ(with.size(), 9U);
  EXPECT_EQ(with.keypoints[0].level, 2) << "the others stay";
  EXPECT_EQ(with.descriptors[0], features.descriptors[0]);
  EXPECT_EQ(with.keypoints[2].u, 40);
  EXPECT_EQ(with.keypoints[2].v, 50);
  EXPECT_EQ(with.keypoints[2].depth, 3);
  EXPECT_EQ(with.keypoints[2].level, 0);
  EXPECT_EQ(with.keypoints[2].angle, 0) << "upright";
  EXPECT_EQ(with.keypoints[7].depth, 2);
  EXPECT_EQ(tag_corner_of(with.descriptors[7]), (TagCorner{{2, 6}, 2}));
  std::vector<std::uint32_t> near;
  with.grid.for_each_near(100, 30, 1, 0, 0, [&](std::uint32_t i) { near.push_back(i); });
  EXPECT_EQ(near, std::vector<std::uint32_t>{7});
}

/// A plane that is turned by 30 degrees, with noise of 25 mm, as a Kinect has at 4 m, and holes.
TEST(TagCorners, DepthsAreThoseOfThePlaneOfTheTag) {
  const auto depth_of_plane = [](float u) { return 4 / (1 - 0.58F * (u - 60) / 500); };
  cv::Mat depth(100, 120, CV_32FC1);
  cv::RNG random(1);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u)
      depth.at<float>(v, u) =
          depth_of_plane(static_cast<float>(u)) + static_cast<float>(random.gaussian(0.025));
  }
  depth(cv::Rect(40, 30, 20, 9)) = 0;
  depth(cv::Rect(45, 60, 5, 4)) = 1.5F;  // a hand
  const Features with = with_tag_corners({}, std::vector<Tag>{square(5, 30, 25, 50)}, depth, {});
  ASSERT_EQ(with.size(), 4U);
  for (const Keypoint& k : with.keypoints) EXPECT_NEAR(k.depth, depth_of_plane(k.u), 0.005);
  depth = 0;
  EXPECT_EQ(
      with_tag_corners({}, std::vector<Tag>{square(5, 30, 25, 50)}, depth, {}).keypoints[0].depth,
      0);
}

TEST(TagCorners, TagsThatAreIgnoredOrBeyondTheImageAreLeftOut) {
  const cv::Mat depth(100, 120, CV_32FC1, cv::Scalar(2));
  cv::Mat ignored(depth.size(), CV_8UC1, cv::Scalar(0));
  ignored(cv::Rect(35, 45, 10, 10)) = 255;
  const std::vector<Tag> tags = {square(5, 20, 30, 20), square(6, 80, 30, 20),
                                 square(7, 110, 30, 20)};
  const Features with = with_tag_corners({}, tags, depth, ignored);
  ASSERT_EQ(with.size(), 4U);
  EXPECT_EQ(tag_corner_of(with.descriptors[0])->tag.id, 6U);
}

}  // namespace
}  // namespace stillmap
