// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/back_projection.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/dense/synthetic_frame.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

Eigen::Vector3d point_at(const PointGrid& grid, int row, int col) {
  const cv::Vec3f& p = grid.points(row, col);
  return {p[0], p[1], p[2]};
}

int count_points(const PointGrid& grid) {
  int count = 0;
  for (const cv::Vec3f& p : grid.points) count += p[2] > 0 ? 1 : 0;
  return count;
}

TEST(BackProjection, PlacesEveryPixelOfATiltedPlaneOnThePlane) {
  const Camera camera = small_camera();
  const Plane plane{Eigen::Vector3d(0.3, -0.2, 1).normalized(), 2};
  const PointGrid grid = back_project(camera, view_of(camera, {}, plane), {}, {.stride = 3});
  EXPECT_EQ(grid.points.rows, 40);
  EXPECT_EQ(grid.points.cols, 54);
  EXPECT_EQ(count_points(grid), 40 * 54);
  for (int row = 0; row < grid.points.rows; ++row) {
    for (int col = 0; col < grid.points.cols; ++col) {
      const Eigen::Vector3d p = point_at(grid, row, col);
      EXPECT_LT(plane.distance(p), 1e-6);
      EXPECT_LT((camera.project(p) - Eigen::Vector2d(col, row) * 3).norm(), 1e-4);
    }
  }
}

TEST(BackProjection, LeavesNoPointOnTheMaskOrItsDilatedBorder) {
  const Camera camera = small_camera();
  const RgbdFrame wall = frame_of(camera, [](int, int) { return 2.0; });
  const cv::Rect person(60, 40, 30, 50);
  cv::Mat1b mask(camera.height, camera.width, uchar{0});
  mask(person).setTo(1);  // any value except zero
  const PointGrid grid = back_project(camera, wall, mask, {.stride = 1, .mask_dilation = 5});
  const cv::Rect grown(person.x - 5, person.y - 5, person.width + 10, person.height + 10);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      EXPECT_EQ(grid.points(v, u)[2] > 0, !grown.contains({u, v})) << u << " " << v;
    }
  }
}

TEST(BackProjection, LeavesNoFlyingPixelsAtADepthJump) {
  const Camera camera = small_camera();
  // A box at 1 m in front of a wall at 2 m; the sensor smears the edge over two columns.
  const RgbdFrame frame = frame_of(camera, [](int u, int) {
    if (u < 80) return 1.0;
    return u == 80 ? 1.3 : u == 81 ? 1.7 : 2.0;
  });
  const PointGrid grid = back_project(camera, frame, {}, {.stride = 1});
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const float z = grid.points(v, u)[2];
      const bool at_the_edge = u >= 79 && u <= 82;
      EXPECT_EQ(z, at_the_edge ? 0.0F : u < 80 ? 1.0F : 2.0F) << u << " " << v;
    }
  }
}

TEST(BackProjection, KeepsASurfaceSeenAtAGrazingAngle) {
  const Camera camera{.name = "full", .fx = 528, .fy = 528};
  const double slant = 75 * M_PI / 180;
  const Plane floor{Eigen::Vector3d(0, std::sin(slant), std::cos(slant)), 0.6};
  const PointGrid grid =
      back_project(camera, view_of(camera, {}, floor), {}, {.max_sigma = 0.019459});
  EXPECT_GT(count_points(grid), 40000);
  for (int row = 0; row < grid.points.rows; ++row) {
    const double z = plane_depth(camera, {}, floor, 320, 2 * row);
    const bool in_range = z > 0.3 && z < 3.4;
    EXPECT_TRUE(!in_range || grid.points(row, 160)[2] > 0) << z;
  }
}

TEST(BackProjection, KeepsACeilingWhoseDepthGrowsByMoreThanAJumpPerPixel) {
  const Camera camera = small_camera();
  const Plane ceiling{Eigen::Vector3d(0, -1, 0), 1};
  const RgbdFrame frame = view_of(camera, Pose(), ceiling);
  const int near = 20, far = 24;  // rows at 3.3 and 3.7 m
  ASSERT_GT(frame.depth.at<float>(far, 80) / frame.depth.at<float>(far - 1, 80), 1.02F);
  const PointGrid grid = back_project(camera, frame, {}, {.stride = 1});
  for (int row = near; row <= far; ++row) EXPECT_GT(grid.points(row, 80)[2], 0) << row;
}

TEST(BackProjection, LeavesOutUnknownDepthsAndThoseOutOfRange) {
  const Camera camera = small_camera();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, 0.0F, -1.0F, 0.39F, 4.01F}) {
    const RgbdFrame frame = frame_of(camera, [&](int, int) { return bad; });
    EXPECT_EQ(count_points(back_project(camera, frame, {})), 0) << bad;
  }
  RgbdFrame wall = frame_of(camera, [](int, int) { return 2.0; });
  wall.depth.at<float>(50, 50) = nan;  // Unknown depth is no jump, so its neighbors stay.
  EXPECT_EQ(count_points(back_project(camera, wall, {}, {.stride = 1})), 160 * 120 - 1);
  wall.depth.at<float>(50, 50) = infinity;  // Infinite depth is a jump.
  EXPECT_EQ(count_points(back_project(camera, wall, {}, {.stride = 1})), 160 * 120 - 9);
}

TEST(BackProjection, UsesDepthsUpToTheLargestDeviation) {
  Camera camera = small_camera();
  camera.depth_sensor = find_depth_sensor("realsense_d455");
  // sqrt(0.025824 / 1.885e-3) = 3.70 m
  for (const auto& [depth, count] : {std::pair{3.65, 80 * 60}, std::pair{3.75, 0}}) {
    const RgbdFrame frame = frame_of(camera, [z = depth](int, int) { return z; });
    EXPECT_EQ(count_points(back_project(camera, frame, {})), count) << depth;
  }
}

TEST(BackProjection, RefusesImagesOfOtherSizes) {
  const Camera camera = small_camera();
  const RgbdFrame frame = frame_of(camera, [](int, int) { return 2.0; });
  Camera other = camera;
  other.width = 320;
  EXPECT_THROW(back_project(other, frame, {}), Error);
  EXPECT_THROW(back_project(camera, frame, cv::Mat1b(10, 10)), Error);
  RgbdFrame raw = frame;
  raw.depth = cv::Mat(120, 160, CV_16UC1, cv::Scalar(10000));
  EXPECT_THROW(back_project(camera, raw, {}), Error);
}

}  // namespace
}  // namespace stillmap
