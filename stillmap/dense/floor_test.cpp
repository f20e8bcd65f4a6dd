// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/floor.hpp"

#include "stillmap/dense/synthetic_room.hpp"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kDegree = std::numbers::pi / 180;

/// Adds surfels of the rectangle that starts at `corner` and extends by `a` and `b` [m].
void add_rectangle(const Eigen::Vector3d& corner, const Eigen::Vector3d& a,
                   const Eigen::Vector3d& b, const Eigen::Vector3d& normal,
                   std::vector<Surfel>& surfels) {
  for (double s = kFloorSurfel / 2; s < a.norm(); s += kFloorSurfel) {
    for (double t = kFloorSurfel / 2; t < b.norm(); t += kFloorSurfel)
      surfels.push_back({corner + s * a.normalized() + t * b.normalized(), normal});
  }
}

/// A room with z up: a wall ahead and one on the left, each from 0.3 m above the floor on, as far
/// as furniture lets the camera see. The camera is 1.4 m above the floor.
struct Room {
  std::vector<Surfel> surfels;
  /// Looks along x, down by 30 degrees.
  Pose camera = Pose(Eigen::Matrix3d((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished()),
                     {0, 0, 1.4}) *
                Pose(so3_exp({-30 * kDegree, 0, 0}), Eigen::Vector3d::Zero());

  Room() {
    add_rectangle({4, -2, 0.3}, {0, 4, 0}, {0, 0, 2}, {-1, 0, 0}, surfels);
    add_rectangle({0, 2, 0.3}, {4, 0, 0}, {0, 0, 2}, {0, -1, 0}, surfels);
  }
  void add_level(double x, double y, double length, double width, double z) {
    add_rectangle({x, y, z}, {length, 0, 0}, {0, width, 0}, {0, 0, 1}, surfels);
  }
  /// Returns the surfels in the frame of the camera, as for a run that begins there.
  std::vector<Surfel> seen() const {
    std::vector<Surfel> seen;
    for (const Surfel& s : surfels) {
      seen.push_back({camera.inverse() * s.point, camera.quaternion().conjugate() * s.normal});
    }
    return seen;
  }
  /// Returns the finding in the frame of the camera.
  FloorFinding find(const FloorHints& hints = {}) const {
    return find_floor(seen(), {Pose()}, hints);
  }
  Eigen::Vector3d up() const { return camera.quaternion().conjugate() * Eigen::Vector3d::UnitZ(); }
};

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

TEST(Floor, IsFoundByACameraThatLooksDown) {
  Room room;
  room.add_level(1, -1, 2, 2, 0);
  const FloorFinding found = room.find();
  ASSERT_TRUE(found.floor) << found.reason;
  EXPECT_LT(angle_between(found.floor->up, room.up()), 1e-3);
  EXPECT_NEAR(found.floor->height, -1.4, 1e-3);
  EXPECT_NEAR(found.evidence.camera_height, 1.4, 1e-3);
  EXPECT_NEAR(found.evidence.area, 4, 0.2);
  EXPECT_NEAR(found.evidence.width, 2, 0.1);
  EXPECT_EQ(found.reason, "");
}

TEST(Floor, IsFoundByACameraThatIsRolled) {
  Room room;
  room.add_level(1, -1, 2, 2, 0);
  room.camera = room.camera * Pose(so3_exp({0, 0, 20 * kDegree}), Eigen::Vector3d::Zero());
  const FloorFinding found = room.find();
  ASSERT_TRUE(found.floor) << found.reason;
  EXPECT_LT(angle_between(found.floor->up, room.up()), 1e-3);
}

TEST(Floor, IsFoundByACameraThatIsRolledAndLooksDown) {
  Room room;
  room.add_level(1, -1, 2, 2, 0);
  room.camera = Pose(room.camera.rotation() * so3_exp({-5 * kDegree, 0, 0}).toRotationMatrix() *
                         so3_exp({0, 0, 33 * kDegree}).toRotationMatrix(),
                     room.camera.translation());
  const FloorFinding found = room.find();
  ASSERT_TRUE(found.up) << found.reason;
  EXPECT_LT(angle_between(*found.up, room.up()), 1e-3)
      << "the surfaces outweigh that cameras are seldom rolled";
  EXPECT_TRUE(found.floor) << found.reason;
}

TEST(Floor, ItsDirectionIsMoreCertainIfMoreSurfacesShowIt) {
  Room small, large;
  small.add_level(1, -1, 1, 1, 0);
  large.add_level(1, -1, 4, 4, 0);
  add_rectangle({4, -2, 2.3}, {0, 4, 0}, {0, 0, 2}, {-1, 0, 0}, large.surfels);
  EXPECT_LT(large.find().up_sigma, 0.8 * small.find().up_sigma);
  EXPECT_LT(small.find().up_sigma, 1 * kDegree);
  EXPECT_EQ(small.find({.up = small.up()}).up_sigma, 0) << "it was given";
}

TEST(Floor, IsUnknownIfOneSmallSurfaceAloneShowsItsRoll) {
  Room room;
  room.surfels.clear();
  room.add_level(1.2, -0.3, 0.75, 0.75, 0);
  add_rectangle({3, -1, 0.3}, {0, 2, 0}, {0, 0, 2}, {-1, 0, 0}, room.surfels);
  const FloorFinding found = room.find();
  EXPECT_FALSE(found.floor);
  EXPECT_GT(found.confidence, 0.5) << "it is the direction that is uncertain";
  EXPECT_GT(found.up_sigma, 1 * kDegree);
  EXPECT_THAT(found.reason, HasSubstr("show the upward direction only within"));
  EXPECT_FALSE(room.find({.camera_height = 1.4}).floor);
  EXPECT_TRUE(room.find({.up = room.up(), .camera_height = 1.4}).floor);
}

TEST(Floor, IsUnknownIfItsPartsAndTheWallsContradict) {
  const auto bent = [](double angle) {
    Room room;
    room.surfels.clear();
    // Floor and wall rise, or lean, by the angle on the left and fall by it on the right.
    for (const double side : {-1.0, 1.0}) {
      const double a = side * angle;
      add_rectangle({1, side < 0 ? -1.0 : 0.0, 0}, {1.5, 0, 0}, {0, 1, 0},
                    {std::sin(a), 0, std::cos(a)}, room.surfels);
      add_rectangle({3, side < 0 ? -1.0 : 0.0, 0.3}, {0, 1, 0}, {0, 0, 1},
                    {-std::cos(a), 0, std::sin(a)}, room.surfels);
    }
    return room.find();
  };
  EXPECT_TRUE(bent(0.5 * kDegree).floor) << bent(0.5 * kDegree).reason;
  EXPECT_FALSE(bent(2.5 * kDegree).floor);
  EXPECT_THAT(bent(2.5 * kDegree).reason, HasSubstr("show the upward direction only within"));
}

TEST(Floor, IsUnknownIfTheCameraIsUpsideDown) {
  Room room;
  room.add_level(1, -1, 2, 2, 0);
  const Pose level = room.camera * Pose(so3_exp({25 * kDegree, 0, 0}), Eigen::Vector3d::Zero());
  for (const double roll : {180, 170, 200}) {
    room.camera = level * Pose(so3_exp({0, 0, roll * kDegree}), Eigen::Vector3d::Zero());
    const FloorFinding found = room.find();
    EXPECT_FALSE(found.floor);
    EXPECT_FALSE(found.up) << "it would be that of the ceiling";
    EXPECT_THAT(found.reason, HasSubstr("upside down"));
  }
}

TEST(Floor, TellsHowTurnedImagesMustBeTurned) {
  Room room;
  room.surfels.clear();
  room.add_level(1, -1.5, 3, 3, 0);
  add_rectangle({4, -1.5, 0.3}, {0, 3, 0}, {0, 0, 1.5}, {-1, 0, 0}, room.surfels);
  add_rectangle({2, 1.5, 0.3}, {2, 0, 0}, {0, 0, 0.3}, {0, -1, 0}, room.surfels);
  const Pose upright = room.camera;
  ASSERT_TRUE(room.find().floor) << room.find().reason;
  for (const int degrees : {90, 270}) {
    room.camera = upright * Pose(so3_exp({0, 0, degrees * kDegree}), Eigen::Vector3d::Zero());
    const FloorFinding found = room.find();
    EXPECT_FALSE(found.floor);
    EXPECT_THAT(found.reason, HasSubstr("turn them with --rotate " + std::to_string(degrees)));
    EXPECT_TRUE(room.find({.up = room.up()}).floor) << "a given direction is not doubted";
  }
}

TEST(Floor, ASmallWallBesideTheCameraIsNoFloorOfTurnedImages) {
  Room room;
  room.surfels.clear();
  room.add_level(1, -1, 1.6, 0.8, 0.75);  // a table hides the floor
  add_rectangle({4, -2, 0.3}, {0, 4, 0}, {0, 0, 2}, {-1, 0, 0}, room.surfels);
  add_rectangle({2, 2, 0.3}, {2, 0, 0}, {0, 0, 1}, {0, -1, 0}, room.surfels);
  const FloorFinding found = room.find();
  EXPECT_FALSE(found.floor);
  EXPECT_TRUE(found.up);
  EXPECT_THAT(found.reason, Not(HasSubstr("--rotate")));
}

TEST(Floor, IsBelowATable) {
  Room room;
  room.add_level(1, -1, 2, 2, 0);
  room.add_level(1, 0, 1.6, 0.8, 0.75);
  const FloorFinding found = room.find();
  ASSERT_TRUE(found.floor) << found.reason;
  EXPECT_NEAR(found.floor->height, -1.4, 1e-3);
}

TEST(Floor, ATableIsNoFloorIfOtherSurfacesLieBelow) {
  Room room;
  room.add_level(1, 0, 1.6, 0.8, 0.75);
  const FloorFinding found = room.find();
  EXPECT_FALSE(found.floor);
  ASSERT_TRUE(found.up);
  EXPECT_LT(angle_between(*found.up, room.up()), 1e-3) << "the walls show the upward direction";
  EXPECT_THAT(found.reason, HasSubstr("other surfaces lie below"));
}

TEST(Floor, ATableIsNoFloorIfItAloneIsSeen) {
  Room room;
  room.surfels.clear();
  room.add_level(0.5, -0.8, 0.8, 1.6, 0.75);
  const FloorFinding found = room.find();
  EXPECT_FALSE(found.floor);
  EXPECT_THAT(found.reason, HasSubstr("0.8 m wide"));
}

TEST(Floor, IsUnknownInFrontOfAWall) {
  Room room;
  room.surfels.clear();
  add_rectangle({2, -1, 0.3}, {0, 2, 0}, {0, 0, 2}, {-1, 0, 0}, room.surfels);
  EXPECT_FALSE(room.find().floor);
  EXPECT_FALSE(find_floor({}, {Pose()}).floor);
  EXPECT_FALSE(find_floor({}, {}).floor);
}

TEST(Floor, IsTakenFromTheHints) {
  Room room;
  const FloorFinding by_height = room.find({.camera_height = 1.4});
  ASSERT_TRUE(by_height.floor);
  EXPECT_NEAR(by_height.floor->height, -1.4, 1e-3);
  EXPECT_EQ(by_height.confidence, 1);
  const FloorFinding by_both = find_floor({}, {Pose()}, {.up = {{0, -2, 0}}, .camera_height = 0.5});
  ASSERT_TRUE(by_both.floor);
  EXPECT_EQ(by_both.floor->up, Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(by_both.floor->height, -0.5);
  const FloorFinding given = room.find({.floor = Floor{{0, 0, 1}, 3}});
  EXPECT_EQ(given.floor->height, 3);
}

TEST(Floor, IsFoundByGravityWhereSurfacesDoNotShowTheUpwardDirection) {
  Room room;
  room.surfels.clear();
  room.add_level(0.5, -1, 2, 2, 0);
  room.camera = room.camera * Pose(so3_exp({0, 0, 60 * kDegree}), Eigen::Vector3d::Zero());
  EXPECT_FALSE(room.find().floor);
  const Eigen::Vector3d up = room.camera.quaternion().conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d nearly = so3_exp({0.4 * kDegree, 0, 0}) * up;
  const FloorFinding found = room.find({.gravity = nearly});
  ASSERT_TRUE(found.floor) << found.reason;
  EXPECT_LT(std::acos(std::min(1.0, found.floor->up.dot(up))), 0.45 * kDegree);
  EXPECT_NEAR(found.evidence.camera_height, 1.4, 0.05);
}

TEST(Floor, IsUnknownOnASurfaceThatGravityShowsToBeARamp) {
  Room room;
  room.add_level(0, -2, 4, 4, 0);
  const Eigen::Vector3d up = room.camera.quaternion().conjugate() * Eigen::Vector3d::UnitZ();
  const FloorFinding found = room.find({.gravity = so3_exp({6 * kDegree, 0, 0}) * up});
  ASSERT_TRUE(found.up);
  EXPECT_GT(std::acos(found.up->dot(up)), 5 * kDegree);
}

TEST(Floor, MapFrameIsOnTheFloorBelowTheCamera) {
  const PlannerMaps m = planner_maps();
  EXPECT_LT((m.T_map_world * Eigen::Vector3d(0, 0, 0) - Eigen::Vector3d(0, 0, kFloorY)).norm(),
            0.01);
  EXPECT_LT((m.T_map_world * Eigen::Vector3d(0, kFloorY, 2) - Eigen::Vector3d(2, 0, 0)).norm(),
            0.02);
  EXPECT_LT((m.T_map_world * Eigen::Vector3d(1, kFloorY, 0) - Eigen::Vector3d(0, -1, 0)).norm(),
            0.02);
}

TEST(Floor, TheDirectionOfWallsIsKnownUpToRightAngles) {
  Room room;
  const double yaw = 0.3;
  const Pose T_map_world(so3_exp({0, 0, yaw}), Eigen::Vector3d::Zero());
  EXPECT_NEAR(wall_direction(room.surfels, T_map_world), yaw, 1e-9);
  EXPECT_EQ(wall_direction({}, T_map_world), 0);
}

TEST(Floor, UprightAxesAreAlongAndAcrossTheWallsAndUpward) {
  Room room;
  room.camera = Pose(so3_exp({0, 0, 0.3}), Eigen::Vector3d::Zero()) * room.camera;
  room.add_level(1, -1.5, 3, 3, 0);
  const FloorFinding found = room.find();
  ASSERT_TRUE(found.up.has_value()) << found.reason;
  const Eigen::Matrix3d R = upright_axes(found, room.seen(), {Pose()});
  EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  EXPECT_NEAR(R.determinant(), 1, 1e-9);
  const auto seen = [&](const Eigen::Vector3d& v) {
    return room.camera.quaternion().conjugate() * v;
  };
  EXPECT_LT(angle_between(R.row(2), seen(Eigen::Vector3d::UnitZ())), kDegree);
  EXPECT_LT(angle_between(R.row(0), seen(Eigen::Vector3d::UnitX())), kDegree);
}

TEST(Floor, UprightAxesOfAnUnknownFloorAreUprightInTheImages) {
  const Eigen::Matrix3d R = upright_axes({.reason = "unknown"}, {}, {Pose()});
  EXPECT_LT((R.row(2).transpose() + Eigen::Vector3d::UnitY()).norm(), 1e-9);
}

}  // namespace
}  // namespace stillmap
