// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/texture.hpp"

#include "stillmap/dense/mesh_charts.hpp"
#include "stillmap/dense/mesh_simplification.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Returns a grid of n x n squares of two triangles each, whose points are given for 0..1, 0..1.
template <typename Point>
TriangleMesh grid_of(int n, const Point& point) {
  TriangleMesh mesh;
  for (int row = 0; row <= n; ++row) {
    for (int col = 0; col <= n; ++col) {
      mesh.vertices.push_back(point(static_cast<float>(col) / static_cast<float>(n),
                                    static_cast<float>(row) / static_cast<float>(n)));
      mesh.colors.push_back({});
    }
  }
  for (int row = 0; row < n; ++row) {
    for (int col = 0; col < n; ++col) {
      const auto a = static_cast<std::uint32_t>(row * (n + 1) + col);
      const auto below = static_cast<std::uint32_t>(a + n + 1);
      mesh.triangles.push_back({a, a + 1, below + 1});
      mesh.triangles.push_back({a, below + 1, below});
    }
  }
  return mesh;
}

/// A wall 2 m wide that turns by a right angle in its middle.
TriangleMesh corner() {
  return grid_of(20, [](float u, float v) {
    const float x = 2 * u;
    return x < 1 ? Eigen::Vector3f(x, v, 1) : Eigen::Vector3f(1, v, 2 - x);
  });
}

/// A cylinder of radius 1 m around y.
TriangleMesh cylinder() {
  return grid_of(60, [](float u, float v) {
    const auto angle = static_cast<float>(2 * std::numbers::pi) * u;
    return Eigen::Vector3f(std::cos(angle), v, std::sin(angle));
  });
}

/// A ramp around an axis: its normals are all upwards, but the second turn is above the first one.
TriangleMesh ramp() {
  return grid_of(200, [](float u, float v) {
    const auto angle = static_cast<float>(4 * std::numbers::pi) * u;
    return Eigen::Vector3f((1 + v) * std::cos(angle), (1 + v) * std::sin(angle), u);
  });
}

std::vector<Rgb> position_colors(const std::vector<Eigen::Vector3f>& points) {
  std::vector<Rgb> colors;
  for (const Eigen::Vector3f& p : points) {
    const auto channel = [](float x) {
      return static_cast<std::uint8_t>(std::clamp(100 + 50 * x, 0.0F, 255.0F));
    };
    colors.push_back({channel(p.x()), channel(p.y()), channel(p.z())});
  }
  return colors;
}

TEST(MeshCharts, APlaneIsOne) {
  const auto flat = grid_of(10, [](float u, float v) { return Eigen::Vector3f(u, v, 3); });
  EXPECT_EQ(charts_of(flat, 4).size(), 1U);
}

TEST(MeshCharts, HaveAtMostTheGivenSide) {
  const auto flat = grid_of(40, [](float u, float v) { return Eigen::Vector3f(9 * u, 9 * v, 3); });
  const auto charts = charts_of(flat, 4);
  EXPECT_GE(charts.size(), 4U);
  for (const MeshChart& chart : charts) {
    Eigen::AlignedBox2f box;
    for (const std::uint32_t triangle : chart.triangles) {
      for (const std::uint32_t vertex : flat.triangles[triangle])
        box.extend(chart.axes * flat.vertices[vertex]);
    }
    EXPECT_LT(box.sizes().maxCoeff(), 4.5);
  }
}

TEST(MeshCharts, ContainEachTriangleOnceAndAreNearTheirPlane) {
  const TriangleMesh mesh = cylinder();
  std::multiset<std::uint32_t> triangles;
  for (const MeshChart& chart : charts_of(mesh, 4)) {
    triangles.insert(chart.triangles.begin(), chart.triangles.end());
    const Eigen::Vector3f normal =
        chart.axes.row(0).transpose().cross(chart.axes.row(1).transpose());
    for (const std::uint32_t triangle : chart.triangles) {
      const auto& [a, b, c] = mesh.triangles[triangle];
      const Eigen::Vector3f own = (mesh.vertices[b] - mesh.vertices[a])
                                      .cross(mesh.vertices[c] - mesh.vertices[a])
                                      .normalized();
      EXPECT_GE(own.dot(normal), 0.499);
    }
  }
  EXPECT_EQ(triangles.size(), mesh.triangles.size());
  EXPECT_EQ(*triangles.rbegin(), mesh.triangles.size() - 1);
}

/// Whatever the charts, the texture at each corner of the mesh shows the color of that point.
TEST(Texture, ShowsTheColorsOfThePoints) {
  for (const TriangleMesh& mesh : {corner(), cylinder(), ramp()}) {
    const TexturedMesh made = textured(mesh, 0.01, position_colors);
    ASSERT_EQ(made.mesh.triangles.size(), mesh.triangles.size());
    ASSERT_EQ(made.places.size(), made.mesh.vertices.size());
    for (std::size_t i = 0; i < made.places.size(); ++i) {
      const auto col = static_cast<int>(made.places[i].x() * static_cast<float>(made.image.cols));
      const auto row = static_cast<int>(made.places[i].y() * static_cast<float>(made.image.rows));
      const Rgb wanted = position_colors({made.mesh.vertices[i]}).front();
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(made.image(row, col)[2 - c], wanted[static_cast<std::size_t>(c)], 2.5);
    }
  }
}

TEST(Texture, ChartsDoNotOverlap) {
  const TexturedMesh made = textured(corner(), 0.01, [](const auto& points) {
    static std::uint8_t call = 0;
    return std::vector<Rgb>(points.size(), Rgb{++call, 0, 0});
  });
  const double texels = 1.0 / (0.01 * 0.01);  // of each half
  EXPECT_GT(cv::countNonZero(made.image.reshape(1)), 2 * texels);
  EXPECT_LT(static_cast<double>(made.image.total()), 2.5 * texels);
}

TEST(Texture, StaysBelowTheSizeOfGraphicsCards) {
  const auto large = grid_of(4, [](float u, float v) { return Eigen::Vector3f(3 * u, 3 * v, 1); });
  const TexturedMesh made = textured(large, 0.0001, [](const auto& points) {
    return std::vector<Rgb>(points.size(), Rgb{1, 2, 3});
  });
  EXPECT_LE(std::max(made.image.cols, made.image.rows), 8192);
  EXPECT_GT(made.image.cols, 4000);
}

TEST(MeshSimplification, KeepsAPlaneAndItsBorder) {
  const auto flat = grid_of(40, [](float u, float v) { return Eigen::Vector3f(u, v, 2); });
  const TriangleMesh fewer = simplified(flat, 0.003);
  EXPECT_LT(fewer.triangles.size(), flat.triangles.size() / 10);
  Eigen::AlignedBox3f box;
  float area = 0;
  for (const auto& [a, b, c] : fewer.triangles) {
    for (const std::uint32_t i : {a, b, c}) box.extend(fewer.vertices[i]);
    area +=
        0.5F *
        (fewer.vertices[b] - fewer.vertices[a]).cross(fewer.vertices[c] - fewer.vertices[a]).norm();
  }
  EXPECT_NEAR(area, 1, 0.01);
  EXPECT_NEAR((box.min() - Eigen::Vector3f(0, 0, 2)).norm(), 0, 1e-5);
  EXPECT_NEAR((box.max() - Eigen::Vector3f(1, 1, 2)).norm(), 0, 1e-5);
}

TEST(MeshSimplification, StaysNearTheSurface) {
  const TriangleMesh fewer = simplified(cylinder(), 0.005);
  ASSERT_LT(fewer.triangles.size(), cylinder().triangles.size() / 3);
  for (const Eigen::Vector3f& p : sampled(fewer, 0.02).points)
    EXPECT_NEAR(std::hypot(p.x(), p.z()), 1, 3 * 0.005);
}

TEST(MeshSimplification, OfNothingIsNothing) {
  EXPECT_TRUE(simplified({}, 0.01).empty());
  const TexturedMesh nothing = textured({}, 0.01, position_colors);
  EXPECT_TRUE(nothing.mesh.empty());
}

}  // namespace
}  // namespace stillmap
