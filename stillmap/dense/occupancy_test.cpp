// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/occupancy.hpp"

#include "stillmap/dense/synthetic_room.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

// In frame map the camera is above the origin, the wall 3 m ahead along x, the floor at z = 0.
TEST(Occupancy, IsFreeUpToTheSurfaceAndUnknownBehindIt) {
  const OccupiedSpace space = planner_maps().space;
  const auto contains = [&](const std::vector<Voxel>& voxels, const Eigen::Vector3d& point) {
    return std::ranges::binary_search(voxels, voxel_at(point, space.edge).value());
  };
  const Eigen::Vector3d in_front(1.5, 0, 0.63), behind(3.53, 0.6, 0.63);
  const Eigen::Vector3d box(2, 0, 0.28), half_voxel(0.5 * space.edge, 0, 0);
  EXPECT_TRUE(contains(space.free, in_front));
  EXPECT_FALSE(contains(space.occupied, in_front));
  EXPECT_TRUE(contains(space.occupied, box - half_voxel) ||
              contains(space.occupied, box + half_voxel));  // the surface lies between voxels
  EXPECT_FALSE(contains(space.free, behind) || contains(space.occupied, behind));
}

}  // namespace
}  // namespace stillmap
