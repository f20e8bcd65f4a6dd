// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/trimmed_box.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(TrimmedBox, LeavesOutTheOutermostPointsOfEachAxis) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 10; ++i) points.emplace_back(i, -i, 100 * i);
  const Eigen::AlignedBox3d whole = trimmed_box(points, 0), inner = trimmed_box(points, 2);
  EXPECT_EQ(whole.min(), Eigen::Vector3d(0, -9, 0));
  EXPECT_EQ(whole.max(), Eigen::Vector3d(9, 0, 900));
  EXPECT_EQ(inner.min(), Eigen::Vector3d(2, -7, 200));
  EXPECT_EQ(inner.max(), Eigen::Vector3d(7, -2, 700));
  EXPECT_TRUE(trimmed_box({}, 0).isEmpty());
}

}  // namespace
}  // namespace stillmap
