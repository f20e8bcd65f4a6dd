// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/mesh.hpp"

#include "stillmap/dense/cloud.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

// Returns a square of two triangles, a separate triangle, and an unused vertex.
TriangleMesh small_mesh() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                   {9, 9, 9}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}};
  for (std::uint8_t i = 0; i < 8; ++i) mesh.colors.push_back({i, 100, 200});
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {5, 6, 7}};
  return mesh;
}

TEST(Mesh, LosesSpecksAndUnusedVertices) {
  const TriangleMesh kept = without_specks(small_mesh(), 2);
  EXPECT_EQ(kept.triangles.size(), 2U);
  EXPECT_EQ(kept.vertices.size(), 4U);
  EXPECT_EQ(kept.colors.size(), 4U);
  EXPECT_EQ(without_specks(small_mesh(), 1).triangles.size(), 3U);
  EXPECT_TRUE(without_specks(small_mesh(), 3).empty());
}

TEST(Mesh, IsSampledAtTheGivenSpacing) {
  const Cloud cloud = sampled(without_specks(small_mesh(), 2), 0.1);
  for (double x = 0.03; x < 1; x += 0.11) {
    for (double y = 0.02; y < 1; y += 0.13) {
      float nearest = 1;
      for (const auto& p : cloud.points) {
        nearest = std::min(nearest, (p - Eigen::Vector3d(x, y, 0).cast<float>()).norm());
      }
      EXPECT_LT(nearest, 0.075) << x << " " << y;
    }
  }
}

}  // namespace
}  // namespace stillmap
