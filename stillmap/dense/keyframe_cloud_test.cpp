// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/keyframe_cloud.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/dense/synthetic_frame.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

Eigen::Vector3d position(const KeyframeCloud& cloud, const PackedPoint& point) {
  const auto& [x, y, z] = point.position;
  return Eigen::Vector3d(x, y, z) * cloud.step;
}

TEST(KeyframeCloud, PacksPointsAndColoursOfSinglePixels) {
  const Camera camera = small_camera();
  const RgbdFrame frame = frame_of(camera, [](int, int) { return 2.0; });
  const PointGrid grid = back_project(camera, frame, {});
  const KeyframeCloud cloud = pack_keyframe(grid, frame, 0.001);  // finer than the pixels: one each
  ASSERT_EQ(cloud.points.size(), 80U * 60U);
  EXPECT_LT(cloud.step, 1e-4);
  for (const PackedPoint& point : cloud.points) {
    const Eigen::Vector2d pixel(point.color[2], point.color[1]);  // RGB of BGR (u, v, 7)
    const Eigen::Vector3d truth = camera.unproject(pixel.x(), pixel.y(), 2);
    EXPECT_EQ(point.color[0], 7);
    EXPECT_LT((position(cloud, point) - truth).cwiseAbs().maxCoeff(), 0.51 * cloud.step);
    EXPECT_EQ(point.count, 1);
  }
}

TEST(KeyframeCloud, ThinningKeepsTheSurfaceAndTheNumberOfPixels) {
  const Camera camera = small_camera();
  const Plane plane{Eigen::Vector3d(0.3, -0.2, 1).normalized(), 1};
  const RgbdFrame frame = view_of(camera, {}, plane);
  const KeyframeCloud fine = pack_keyframe(back_project(camera, frame, {}), frame, 0.02);
  const KeyframeCloud coarse = thinned(fine, 0.08);
  EXPECT_LT(coarse.points.size() * 8, fine.points.size());
  int pixels = 0;
  for (const PackedPoint& point : coarse.points) {
    EXPECT_LT(plane.distance(position(coarse, point)), fine.step + coarse.step);
    pixels += point.count;
  }
  EXPECT_EQ(pixels, 80 * 60);
}

TEST(KeyframeCloud, RefusesColoursThatDoNotFit) {
  const Camera camera = small_camera();
  RgbdFrame frame = frame_of(camera, [](int, int) { return 2.0; });
  const PointGrid grid = back_project(camera, frame, {});
  frame.color = cv::Mat(60, 80, CV_8UC3);
  EXPECT_THROW(pack_keyframe(grid, frame, 0.01), Error);
  frame.color = cv::Mat(120, 160, CV_8UC1);
  EXPECT_THROW(pack_keyframe(grid, frame, 0.01), Error);
}

}  // namespace
}  // namespace stillmap
