// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/registration.hpp"

#include "stillmap/dense/dense_map.hpp"
#include "stillmap/dense/synthetic_frame.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

/// A corner of a room: the floor, the wall ahead and the wall on the right, which together
/// determine a pose.
const std::vector<Plane> kCorner{{{0, 1, 0}, 0.6}, {{0, 0, 1}, 2}, {{1, 0, 0}, 0.8}};

DenseView view_of_planes(const std::vector<Plane>& planes, const Pose& T_world_camera) {
  const RgbdFrame frame = frame_of(small_camera(), [&](int u, int v) {
    double nearest = 100;
    for (const Plane& plane : planes) {
      const double z = plane_depth(small_camera(), T_world_camera, plane, u, v);
      if (z > 0) nearest = std::min(nearest, z);
    }
    return nearest;
  });
  BackProjectionOptions every_pixel;
  every_pixel.stride = 1;
  every_pixel.max_jump = 1;  // as the floor is seen at a grazing angle
  return make_dense_view(small_camera(), frame, {}, every_pixel).view;
}

Pose pose_of(int i) {
  return Pose::exp(
      (Eigen::Matrix<double, 6, 1>() << 0.02 * i, 0.01 * i, 0, 0, 0.02 * i, 0).finished());
}

/// Returns the error of a pose as a distance of points 2 m ahead [m].
double error_of(const Pose& pose, const Pose& truth) {
  const Eigen::Vector3d ahead(0, 0, 2), aside(1, 0, 1);
  return std::max((pose * ahead - truth * ahead).norm(), (pose * aside - truth * aside).norm());
}

TEST(Registration, MovesViewsOntoTheSurfaceOfThoseBeforeThem) {
  std::vector<DenseView> views;
  for (int i = 0; i < 4; ++i) views.push_back(view_of_planes(kCorner, pose_of(i)));
  Eigen::Matrix<double, 6, 1> wrong;
  wrong << 0.012, -0.01, 0.015, 0.004, -0.006, 0.005;
  std::vector<PosedView> posed;
  for (int i = 0; i < 4; ++i) {
    const Pose error = i % 2 == 0 ? Pose() : Pose::exp(wrong);
    posed.push_back({&views[static_cast<std::size_t>(i)], pose_of(i) * error});
  }
  ASSERT_GT(error_of(posed[1].T_world_camera, pose_of(1)), 0.015);
  const auto result = registered(posed);
  EXPECT_EQ(error_of(result[0].T_world_camera, pose_of(0)), 0) << "the first view stays";
  for (int i = 1; i < 4; ++i) {
    const Pose& pose = result[static_cast<std::size_t>(i)].T_world_camera;
    EXPECT_LT(error_of(pose, pose_of(i)), 0.004) << i;
  }
}

TEST(Registration, LeavesAPoseAsItIsAlongAWall) {
  const std::vector<Plane> wall{{{0, 0, 1}, 2}};
  const DenseView first = view_of_planes(wall, Pose()), second = view_of_planes(wall, Pose());
  const Pose displaced =
      Pose::exp((Eigen::Matrix<double, 6, 1>() << 0.02, 0, 0.01, 0, 0, 0).finished());
  const Pose result = registered({{&first, Pose()}, {&second, displaced}})[1].T_world_camera;
  EXPECT_NEAR(result.translation().x(), 0.02, 0.001);
  EXPECT_NEAR(result.translation().z(), 0, 0.001);
}

TEST(Registration, LeavesAViewOfAnotherPlaceWhereItIs) {
  const DenseView view = view_of_planes(kCorner, Pose());
  const Pose far_away = Pose::exp((Eigen::Matrix<double, 6, 1>() << 5, 0, 0, 0, 0, 0).finished());
  const auto result = registered({{&view, Pose()}, {&view, far_away}});
  EXPECT_EQ(result[1].T_world_camera.translation(), far_away.translation());
}

/// The step of the dense map: without it the walls of the cloud are as thick as the poses are
/// wrong.
TEST(Registration, IsAppliedByTheDenseMapIfItIsSelected) {
  const auto thickness = [](bool registration) {
    DenseOptions options;
    options.registration = registration;
    options.fuse = false;
    options.evidence.remove_ghosts = false;
    DenseMap map(small_camera(), options);
    const Pose wrong = Pose::exp((Eigen::Matrix<double, 6, 1>() << 0, 0, 0.03, 0, 0, 0).finished());
    map.add(0, view_of_planes(kCorner, Pose()));
    map.add(1, view_of_planes(kCorner, Pose()));
    const auto placed =
        map.place([&](std::uint64_t id) { return std::optional(id == 0 ? Pose() : wrong); });
    float nearest = 10, farthest = 0;
    for (const Eigen::Vector3f& p : cloud_of(placed).cloud.points) {
      if (p.x() > 0.6F || p.y() > 0.4F) continue;
      nearest = std::min(nearest, p.z());
      farthest = std::max(farthest, p.z());
    }
    return farthest - nearest;
  };
  EXPECT_GT(thickness(false), 0.025F);
  EXPECT_LT(thickness(true), 0.01F);
}

}  // namespace
}  // namespace stillmap
