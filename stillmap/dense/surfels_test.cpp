// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/surfels.hpp"

#include "stillmap/dense/synthetic_frame.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

Camera camera() {
  Camera c = small_camera();
  for (double* value : {&c.fx, &c.fy, &c.cx, &c.cy}) *value *= 5;
  c.width *= 5;
  c.height *= 5;
  return c;
}

/// Returns the map of one view of a plane n . p = d, camera frame.
PlacedMap map_of_plane(const Eigen::Vector3d& n, double d, const Pose& T_world_camera) {
  DenseOptions options;
  options.back_projection.stride = 1;
  DenseMap map(camera(), options);
  map.add(0,
          frame_of(camera(), [&](int u, int v) { return d / n.dot(camera().unproject(u, v, 1)); }),
          {});
  return map.place([=](std::uint64_t) { return std::optional(T_world_camera); });
}

TEST(Surfels, OfAPlaneLieOnItWithItsNormalAndCountItsArea) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.4, -1).normalized();
  const Pose T_world_camera(so3_exp({0.2, 0.5, -0.3}), {1, 2, 3});
  const auto surfels = surfels_of(map_of_plane(normal, -1.5, T_world_camera), 0.1);
  ASSERT_GT(surfels.size(), 100U);
  for (const Surfel& s : surfels) {
    EXPECT_NEAR(normal.dot(T_world_camera.inverse() * s.point), -1.5, 2e-3);
    EXPECT_GT(s.normal.dot(T_world_camera.quaternion() * normal), std::cos(0.03))
        << "towards the camera";
  }
}

TEST(Surfels, AreOneForEachCubeOfTheSurface) {
  EXPECT_TRUE(surfels_of(PlacedMap{}, 0.1).empty());
  const auto fine = surfels_of(map_of_plane({0, 0, -1}, -1.5, Pose()), 0.05);
  const auto coarse = surfels_of(map_of_plane({0, 0, -1}, -1.5, Pose()), 0.1);
  // A cube covers four times the area of one of half its side.
  EXPECT_NEAR(static_cast<double>(fine.size()) / static_cast<double>(coarse.size()), 4, 0.8);
}

}  // namespace
}  // namespace stillmap
