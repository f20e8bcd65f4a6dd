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

/// Adds points of the rectangle from `corner` along `a` and `b`, 2 cm apart.
void add_points(const Eigen::Vector3d& corner, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                Cloud& cloud) {
  for (double s = 0; s < a.norm(); s += 0.02) {
    for (double t = 0; t < b.norm(); t += 0.02)
      cloud.add((corner + s * a.normalized() + t * b.normalized()).cast<float>(), {});
  }
}

TEST(Surfels, OfACloudLieOnItsPlaneAndFaceTheCamera) {
  const Eigen::Matrix3d R = so3_exp({0.4, -0.2, 0.7}).toRotationMatrix();
  Cloud cloud;
  add_points({5, 6, 7}, 2 * R.col(0), 1.5 * R.col(1), cloud);
  const Eigen::Vector3d eye = Eigen::Vector3d(5, 6, 7) - 2 * R.col(2);
  const auto surfels = surfels_of(cloud, {eye}, 0.1);
  EXPECT_NEAR(static_cast<double>(surfels.size()) * 0.01, 2 * 1.5, 2.0);
  ASSERT_GT(surfels.size(), 100U);
  for (const Surfel& s : surfels) {
    EXPECT_NEAR(R.col(2).dot(s.point - Eigen::Vector3d(5, 6, 7)), 0, 1e-4);
    EXPECT_GT(-R.col(2).dot(s.normal), 0.9999);
  }
}

TEST(Surfels, OfACloudLeaveOutEdgesAndLooseMatter) {
  Cloud cloud;
  add_points({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, cloud);
  add_points({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, cloud);
  for (const Surfel& s : surfels_of(cloud, {{0.5, 1, 1}}, 0.1)) {
    const double along = std::max(std::abs(s.normal.y()), std::abs(s.normal.z()));
    EXPECT_GT(along, 0.99) << s.point.transpose();
  }
  Cloud ball;  // filled evenly
  for (int i = 0; i < 1000; ++i)
    ball.add({0.03F * static_cast<float>(i % 10), 0.03F * static_cast<float>(i / 10 % 10),
              0.03F * static_cast<float>(i / 100)},
             {});
  EXPECT_TRUE(surfels_of(ball, {{0, 0, 5}}, 0.1).empty());
  EXPECT_TRUE(surfels_of(Cloud(), {}, 0.1).empty());
}

}  // namespace
}  // namespace stillmap
