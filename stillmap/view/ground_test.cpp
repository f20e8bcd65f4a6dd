// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/ground.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A camera 6 m above a yard, pitched down by 42 degrees, as under a crane's trolley. The world
/// frame is that of the camera.
struct Yard {
  Pose T_camera_level = Pose(so3_exp({42 * kDegree, 0, 0}), Eigen::Vector3d::Zero());
  Eigen::Vector3d up = T_camera_level.quaternion() * Eigen::Vector3d(0, -1, 0);
  Trajectory trajectory{{0, Pose()}, {1, Pose()}};
  Cloud cloud;

  Yard() {
    add({-3, 6, 4}, {6, 0, 0}, {0, 0, 5});  // the ground; y points down
    add({-1, 4, 7}, {2, 0, 0}, {0, 2, 0});  // a wall
  }
  void add(const Eigen::Vector3d& corner, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    for (double s = 0; s < a.norm(); s += 0.02) {
      for (double t = 0; t < b.norm(); t += 0.02) {
        const Eigen::Vector3d p = corner + s * a.normalized() + t * b.normalized();
        cloud.add((T_camera_level * p).cast<float>(), {});
      }
    }
  }
};

double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) / kDegree;
}

TEST(Ground, IsTheFloorThatIsFoundUnderACameraThatLooksDown) {
  const Yard yard;
  const Ground ground = displayed_ground(yard.trajectory, yard.cloud);
  EXPECT_EQ(ground.source, UpSource::kFloor);
  EXPECT_LT(degrees_between(ground.up, yard.up), 0.5);
  EXPECT_NEAR(ground.height, -6, 0.03);
}

TEST(Ground, IsAGuessWithoutAFloor) {
  Yard yard;
  yard.cloud = {};
  yard.add({-1, 4, 7}, {2, 0, 0}, {0, 2, 0});
  for (const Cloud& cloud : {yard.cloud, Cloud()}) {
    const Ground ground = displayed_ground(yard.trajectory, cloud);
    EXPECT_EQ(ground.source, UpSource::kImages);
    EXPECT_LT(degrees_between(ground.up, {0, -1, 0}), 1e-6);
  }
  EXPECT_NEAR(displayed_ground(yard.trajectory, {}).height, -1.5, 1e-9);
  EXPECT_EQ(displayed_ground({}, yard.cloud).source, UpSource::kImages);
}

TEST(Ground, HasTheUpwardDirectionOfTheRulesBeforeThatOfTheRun) {
  const Yard yard;
  const Eigen::Vector3d other = Eigen::Vector3d(0.1, -1, 0).normalized();
  GroundHints hints;
  hints.floor.up = other;
  EXPECT_EQ(displayed_ground(yard.trajectory, {}, hints).source, UpSource::kRun);
  EXPECT_LT(degrees_between(displayed_ground(yard.trajectory, {}, hints).up, other), 1e-6);
  hints.rules_up = yard.up;
  const Ground ground = displayed_ground(yard.trajectory, yard.cloud, hints);
  EXPECT_EQ(ground.source, UpSource::kRules);
  EXPECT_LT(degrees_between(ground.up, yard.up), 1e-6);
  EXPECT_NEAR(ground.height, -6, 0.03) << "the floor is found along this direction";
}

TEST(Ground, IsTheFloorOfTheRunsFile) {
  const Yard yard;
  GroundHints hints;
  hints.floor.floor = Floor{{0, 0, 1}, 7};
  const Ground ground = displayed_ground(yard.trajectory, yard.cloud, hints);
  EXPECT_EQ(ground.source, UpSource::kRun);
  EXPECT_EQ(ground.height, 7);
  EXPECT_LT(degrees_between(ground.up, {0, 0, 1}), 1e-6);
}

TEST(Ground, LooksAlikeWithinADegree) {
  const Ground ground{.up = {0, -1, 0}, .height = -1.5, .source = UpSource::kFloor};
  Ground other = ground;
  EXPECT_TRUE(look_alike(ground, other));
  other.height += 0.1;
  EXPECT_FALSE(look_alike(ground, other));
  other = ground;
  other.up = Eigen::Vector3d(0.05, -1, 0).normalized();
  EXPECT_FALSE(look_alike(ground, other));
  other = ground;
  other.source = UpSource::kImages;
  EXPECT_FALSE(look_alike(ground, other));
}

}  // namespace
}  // namespace stillmap
