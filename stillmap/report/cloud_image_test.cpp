// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/cloud_image.hpp"

#include "stillmap/base/error.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

struct Points {
  std::vector<Eigen::Vector3f> points;
  std::vector<Rgb> colors;
  std::vector<std::uint8_t> marked;

  void add_square(const Eigen::Vector3f& corner, const Eigen::Vector3f& side,
                  const Eigen::Vector3f& other, const Rgb& color) {
    constexpr int kSteps = 120;
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; j <= kSteps; ++j) {
        points.push_back(corner + side * i / kSteps + other * j / kSteps);
        colors.push_back(color);
      }
    }
  }
  CloudSpan span() const { return {points, colors, marked}; }
};

constexpr Rgb kGreen{20, 200, 40}, kBlue{30, 60, 220};

/// Returns a green wall at z = 2 and a blue ceiling 1.6 m above the cameras; y points down.
Points room() {
  Points room;
  room.add_square({-1, -1, 2}, {2, 0, 0}, {0, 2, 0}, kGreen);
  room.add_square({-1, -1.6F, 0}, {2, 0, 0}, {0, 0, 2}, kBlue);
  return room;
}

Trajectory cameras() { return {{0, Pose()}, {1, Pose(so3_exp({0, 0.1, 0}), {0.1, 0, 0})}}; }

CloudImageOptions small() {
  CloudImageOptions options;
  options.width = 240;
  options.height = 180;
  options.draw_cameras = false;
  return options;
}

/// Returns the number of pixels in which a channel (0 blue, 1 green, 2 red) dominates.
int pixels_of(const cv::Mat& image, int channel) {
  int count = 0;
  for (const cv::Vec3b& pixel : cv::Mat3b(image)) {
    const int others = std::max(pixel[(channel + 1) % 3], pixel[(channel + 2) % 3]);
    count += pixel[channel] > 100 && pixel[channel] > 1.5 * others ? 1 : 0;
  }
  return count;
}

TEST(CloudImage, FillsTheImageWithTheWallAndCutsTheCeilingOff) {
  const cv::Mat image = draw_cloud(room().span(), cameras(), small());
  ASSERT_EQ(image.size(), cv::Size(240, 180));
  EXPECT_GT(pixels_of(image, 1), 240 * 180 / 4);
  EXPECT_EQ(pixels_of(image, 0), 0);
}

TEST(CloudImage, HasEverythingInsideTheFrame) {
  const Points points = room();
  const CloudView view = choose_cloud_view(points.span(), cameras(), small());
  std::size_t inside = 0, drawn = 0;
  for (const Eigen::Vector3f& p : points.points) {
    if (p.cast<double>().dot(view.up) > view.cut) continue;
    const Eigen::Vector3d seen = view.T_world_viewer.inverse() * Eigen::Vector3d(p.cast<double>());
    const Eigen::Vector2d pixel = view.viewer.project(seen);
    inside += seen.z() > 0 && view.viewer.contains(pixel.x(), pixel.y()) ? 1 : 0;
    ++drawn;
  }
  EXPECT_GT(static_cast<double>(inside), 0.999 * static_cast<double>(drawn));
}

TEST(CloudImage, LooksFromBehindAndAboveTheCameras) {
  const CloudView view = choose_cloud_view(room().span(), cameras(), small());
  EXPECT_NEAR(view.up.dot(Eigen::Vector3d(0, -1, 0)), 1, 1e-6);
  EXPECT_LT(view.T_world_viewer.translation().y(), -0.3);  // above: y points down
  EXPECT_LT(view.T_world_viewer.translation().z(), 0);     // behind
  EXPECT_GT(view.T_world_viewer.rotation().col(2).z(), 0.5);
}

TEST(CloudImage, NearerPointsHideFartherOnes) {
  Points points = room();
  points.add_square({-1, -1, 1.9F}, {2, 0, 0}, {0, 2, 0}, {220, 30, 30});
  const cv::Mat image = draw_cloud(points.span(), cameras(), small());
  EXPECT_GT(pixels_of(image, 2), 240 * 180 / 4);
  EXPECT_LT(pixels_of(image, 1), pixels_of(image, 2) / 10);
}

TEST(CloudImage, MarkedPointsAreRed) {
  Points points = room();
  points.marked.assign(points.points.size(), 1);
  const cv::Mat image = draw_cloud(points.span(), cameras(), small());
  EXPECT_GT(pixels_of(image, 2), 240 * 180 / 4);
  EXPECT_EQ(pixels_of(image, 1), 0);
}

TEST(CloudImage, TakesEmptyAndBrokenClouds) {
  const cv::Mat empty = draw_cloud({}, cameras(), small());
  EXPECT_EQ(empty.size(), cv::Size(240, 180));
  EXPECT_NO_THROW(draw_cloud({}, {}, small()));
  Points points;
  points.points = {{NAN, 0, 0}, {INFINITY, 1, 1}, {0, 0, 1}};
  points.colors.assign(3, kGreen);
  EXPECT_NO_THROW(draw_cloud(points.span(), cameras(), small()));
  EXPECT_NO_THROW(draw_cloud(points.span(), {}, small()));
  points.colors.pop_back();
  EXPECT_THROW(draw_cloud(points.span(), cameras(), small()), Error);
}

}  // namespace
}  // namespace stillmap
