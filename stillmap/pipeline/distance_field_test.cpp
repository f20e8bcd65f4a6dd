// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/test_error.hpp"
#include "stillmap/slam.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using testing::HasSubstr;

/// Points at random places, each in the middle of its cell of 0.1 m.
Cloud scattered() {
  std::mt19937 random(3);
  Cloud cloud;
  for (int i = 0; i < 60; ++i) {
    const auto cell = [&](unsigned count) {
      return 0.1F * static_cast<float>(random() % count) - 1.05F;
    };
    cloud.add({cell(20), cell(9), cell(31)}, {});
  }
  return cloud;
}

TEST(DistanceField, HasTheDistanceFromTheNearestPointInEveryCell) {
  const Cloud cloud = scattered();
  const auto field = distance_field(cloud, 0.1, 0.3);
  ASSERT_TRUE(field);
  ASSERT_EQ(field->distances.size(), static_cast<std::size_t>(field->size.prod()));
  std::size_t place = 0;
  for (int x = 0; x < field->size.x(); ++x) {
    for (int y = 0; y < field->size.y(); ++y) {
      for (int z = 0; z < field->size.z(); ++z, ++place) {
        const Eigen::Vector3d center =
            field->origin + 0.1 * (Eigen::Vector3d(x, y, z) + Eigen::Vector3d::Constant(0.5));
        double nearest = std::numeric_limits<double>::max();
        for (const Eigen::Vector3f& p : cloud.points)
          nearest = std::min(nearest, (p.cast<double>() - center).norm());
        ASSERT_NEAR(field->distances[place], nearest, 1e-4) << x << " " << y << " " << z;
      }
    }
  }
}

TEST(DistanceField, InterpolatesAndPointsAwayFromAWall) {
  Cloud wall;
  for (int y = -20; y <= 20; ++y) {
    for (int z = -20; z <= 20; ++z) wall.add({2.05F, 0.1F * y + 0.05F, 0.1F * z + 0.05F}, {});
  }
  const auto field = distance_field(wall, 0.1, 2);
  for (const double x : {0.51, 1.0, 1.333, 1.9})
    EXPECT_NEAR(*field->distance_at({x, 0.02, -0.07}), 2.05 - x, 1e-5);
  EXPECT_NEAR((*field->gradient_at({1.2, 0, 0}) - Eigen::Vector3d(-1, 0, 0)).norm(), 0, 1e-4);
  EXPECT_FALSE(field->distance_at({-3, 0, 0}));
  EXPECT_FALSE(field->gradient_at({-3, 0, 0}));
  EXPECT_FALSE(field->distance_at({std::nan(""), 0, 0}));
}

TEST(DistanceField, RefusesValuesOutOfRange) {
  EXPECT_FALSE(distance_field({}));
  const auto refused = [](double cell, double margin) {
    return test::error_of([&] { distance_field(scattered(), cell, margin); });
  };
  EXPECT_THAT(refused(0, 1), HasSubstr("side of a cell is 0 m"));
  EXPECT_THAT(refused(0.1, -1), HasSubstr("margin is -1 m"));
  EXPECT_THAT(refused(1e-4, 1), HasSubstr("give larger cells"));
  Cloud damaged = scattered();
  damaged.points[1].y() = std::nanf("");
  EXPECT_THAT(test::error_of([&] { distance_field(damaged); }), HasSubstr("not finite"));
}

}  // namespace
}  // namespace stillmap
