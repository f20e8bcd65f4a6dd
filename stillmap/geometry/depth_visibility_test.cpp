// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/depth_visibility.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(DepthVisibility, ComparesAPointWithTheSurface) {
  EXPECT_EQ(visibility_of(2.0, 1.5, 0.1), Visibility::kOccluded);
  EXPECT_EQ(visibility_of(2.0, 1.95, 0.1), Visibility::kOnSurface);
  EXPECT_EQ(visibility_of(2.0, 2.05, 0.1), Visibility::kOnSurface);
  EXPECT_EQ(visibility_of(2.0, 2.5, 0.1), Visibility::kSeenThrough);
  EXPECT_EQ(visibility_of(2.0, 0.0, 0.1), Visibility::kUnknown);
}

class DepthViewTest : public ::testing::Test {
 protected:
  Camera camera_{.name = "test", .width = 8, .height = 6, .fx = 8, .fy = 8, .cx = 3.5, .cy = 2.5};
  cv::Mat1f depth_ = cv::Mat1f(6, 8, 2.0F);
  DepthView view_{depth_, camera_};
};

TEST_F(DepthViewTest, FindsThePixelOfAPoint) {
  EXPECT_EQ(view_.inner_pixel(camera_.unproject(3, 2, 1.5), 0.1), cv::Point(3, 2));
  EXPECT_FALSE(view_.inner_pixel(camera_.unproject(3, 2, 0.05), 0.1)) << "too near";
  EXPECT_FALSE(view_.inner_pixel({0, 0, -1}, 0.1)) << "behind the camera";
  EXPECT_FALSE(view_.inner_pixel(camera_.unproject(0, 2, 1.5), 0.1)) << "at the border";
  EXPECT_FALSE(view_.inner_pixel(camera_.unproject(20, 2, 1.5), 0.1)) << "outside";
}

TEST_F(DepthViewTest, AllNeighborsMustAgree) {
  const cv::Point pixel(3, 2);
  EXPECT_EQ(view_.visibility_around(pixel, 3, 0.1F), Visibility::kOccluded);
  EXPECT_EQ(view_.visibility_around(pixel, 2, 0.1F), Visibility::kOnSurface);
  EXPECT_EQ(view_.visibility_around(pixel, 1, 0.1F), Visibility::kSeenThrough);
  depth_(1, 2) = 1;
  EXPECT_EQ(view_.visibility_around(pixel, 1.5F, 0.1F), Visibility::kOnSurface) << "an edge";
  depth_(1, 2) = 0;
  EXPECT_EQ(view_.visibility_around(pixel, 1, 0.1F), Visibility::kUnknown);
}

}  // namespace
}  // namespace stillmap
