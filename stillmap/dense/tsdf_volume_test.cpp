// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/tsdf_volume.hpp"

#include "stillmap/dense/map_mesh.hpp"
#include "stillmap/dense/synthetic_frame.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

constexpr double kQuarter = std::numbers::pi / 2;

const Eigen::Vector3d kCenter(0, 0, 2);
constexpr double kRadius = 0.5;

// Returns the depth of a sphere at a pixel [m]; 0 if the ray misses it.
double sphere_depth(const Pose& T_world_camera, int u, int v) {
  const Eigen::Vector3d ray = T_world_camera.quaternion() * small_camera().unproject(u, v, 1);
  const Eigen::Vector3d to = kCenter - T_world_camera.translation();
  const double a = ray.squaredNorm(), b = ray.dot(to);
  const double discriminant = b * b - a * (to.squaredNorm() - kRadius * kRadius);
  return discriminant > 0 ? (b - std::sqrt(discriminant)) / a : 0;
}

// Returns camera poses that face the sphere from its six sides and from eight corners.
std::vector<Pose> around() {
  std::vector<Pose> poses;
  for (int corner = 0; corner < 8; ++corner) {
    const double yaw = 0.7854 + kQuarter * (corner & 3),
                 pitch = (corner & 4) != 0 ? 0.6155 : -0.6155;
    const Eigen::Quaterniond q = so3_exp({0, yaw, 0}) * so3_exp({pitch, 0, 0});
    poses.emplace_back(q, kCenter - q * Eigen::Vector3d(0, 0, 1.6));
  }
  for (const Eigen::Vector3d& turn :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0, kQuarter, 0),
        Eigen::Vector3d(0, 2 * kQuarter, 0), Eigen::Vector3d(0, -kQuarter, 0),
        Eigen::Vector3d(kQuarter, 0, 0), Eigen::Vector3d(-kQuarter, 0, 0)}) {
    const Eigen::Quaterniond q = so3_exp(turn);
    poses.emplace_back(q, kCenter - q * Eigen::Vector3d(0, 0, 1.6));
  }
  return poses;
}

TriangleMesh mesh_of_sphere(double noise, const MeshOptions& options = {}) {
  std::mt19937 random(1);
  std::normal_distribution<double> gauss(0, noise);
  TsdfVolume volume(options);
  for (const Pose& pose : around()) {
    const RgbdFrame frame = frame_of(small_camera(), [&](int u, int v) {
      const double z = sphere_depth(pose, u, v);
      return z > 0 && noise > 0 ? z + gauss(random) : z;
    });
    const DenseView view =
        make_dense_view(small_camera(), frame, {}, {.stride = 1, .max_jump = 0.2}, {}).view;
    volume.integrate(view, pose, view.kind);
  }
  return volume.mesh();
}

TEST(TsdfVolume, GivesAClosedMeshOfASphere) {
  const TriangleMesh mesh = mesh_of_sphere(0);
  ASSERT_GT(mesh.triangles.size(), 5000U);
  for (const Eigen::Vector3f& p : mesh.vertices) {
    EXPECT_NEAR((p.cast<double>() - kCenter).norm(), kRadius, 0.01);  // half a voxel
  }
  // In a closed mesh every edge belongs to one triangle in each direction.
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  double volume = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    ++edges[{a, b}], ++edges[{b, c}], ++edges[{c, a}];
    const Eigen::Vector3d p = mesh.vertices[a].cast<double>() - kCenter;
    const Eigen::Vector3d q = mesh.vertices[b].cast<double>() - kCenter;
    const Eigen::Vector3d r = mesh.vertices[c].cast<double>() - kCenter;
    volume += p.dot(q.cross(r)) / 6;
  }
  std::size_t open = 0;
  for (const auto& [edge, count] : edges) {
    open += count != 1 || !edges.contains({edge.second, edge.first});
  }
  EXPECT_LT(open, edges.size() / 200);
  // Triangles that face outward give the positive volume of the sphere.
  EXPECT_NEAR(volume, 4.0 / 3 * 3.14159 * std::pow(kRadius, 3), 0.02);
}

TEST(TsdfVolume, AveragesNoise) {
  const TriangleMesh mesh = mesh_of_sphere(0.01);
  ASSERT_GT(mesh.triangles.size(), 5000U);
  double sum = 0;
  for (const Eigen::Vector3f& p : mesh.vertices) {
    const double error = (p.cast<double>() - kCenter).norm() - kRadius;
    sum += error * error;
  }
  EXPECT_LT(std::sqrt(sum / static_cast<double>(mesh.vertices.size())), 0.008);
}

TEST(TsdfVolume, IsDeterministic) { EXPECT_EQ(mesh_of_sphere(0.005), mesh_of_sphere(0.005)); }

// A wall with a person in front of it in one view of four, without a mask.
TEST(MapMesh, HasNoGhostsAndUsesTheGivenPoses) {
  const Plane wall{Eigen::Vector3d(0.05, -0.1, 1).normalized(), 2.2};
  DenseMap map(small_camera());
  std::vector<Pose> poses;
  for (std::uint64_t i = 0; i < 4; ++i) {
    poses.emplace_back(Eigen::Quaterniond::Identity(),
                       Eigen::Vector3d(0.05 * static_cast<double>(i), 0, 0));
    RgbdFrame frame = view_of(small_camera(), poses.back(), wall);
    if (i == 1) frame.depth(cv::Rect(60, 20, 30, 80)).setTo(1.4F);
    map.add(i, frame, {});
  }
  const auto mesh_at = [&](const Pose& moved) {
    const auto lookup = [&](std::uint64_t i) { return std::optional(moved * poses[i]); };
    return make_mesh(map.place(lookup));
  };
  const Pose correction(so3_exp({0.1, -0.2, 0.3}), {0.5, 0.1, -0.2});
  for (const Pose& moved : {Pose(), correction}) {
    const TriangleMesh mesh = mesh_at(moved);
    EXPECT_GT(mesh.triangles.size(), 1000U);
    for (const Eigen::Vector3f& p : mesh.vertices) {
      EXPECT_LT(wall.distance(moved.inverse() * p.cast<double>()), 0.01);
    }
  }
}

// A wall so far away that each depth alone is too uncertain.
TEST(MapMesh, ContainsFarSurfaces) {
  constexpr double kFar = 4.7;  // m
  Camera camera = small_camera();
  camera.depth_sensor = find_depth_sensor("kinect_v1");
  std::mt19937 random(1);
  std::normal_distribution<double> gauss(0, camera.depth_sensor.sigma(kFar));
  DenseMap map(camera);
  for (std::uint64_t i = 0; i < 8; ++i)
    map.add(i, frame_of(camera, [&](int, int) { return kFar + gauss(random); }), {});
  const PlacedMap placed = map.place([](std::uint64_t) { return std::optional(Pose()); });
  const TriangleMesh mesh = make_mesh(placed);
  ASSERT_GT(mesh.triangles.size(), 2000U);
  double squares = 0;
  for (const Eigen::Vector3f& p : mesh.vertices) squares += std::pow(p.z() - kFar, 2);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(mesh.vertices.size())),
            0.6 * camera.depth_sensor.sigma(kFar));
}

// A slanted wall whose points are farther apart than the voxels of the cloud: all triangles within
// a voxel of the mesh around a point stay, in one of the cloud 58 % would.
TEST(MapMesh, StaysAroundThePointsOfAFineCloud) {
  const Plane wall{Eigen::Vector3d(0.6, -0.1, 0.8).normalized(), 0.9};
  const auto triangles = [&](double voxel) {
    DenseOptions options;
    options.voxel = voxel;
    DenseMap map(small_camera(), options);
    for (std::uint64_t i = 0; i < 4; ++i) map.add(i, view_of(small_camera(), Pose(), wall), {});
    return make_mesh(map.place([](std::uint64_t) { return std::optional(Pose()); }))
        .triangles.size();
  };
  const std::size_t whole = triangles(0.01);
  ASSERT_GT(whole, 2000U);
  EXPECT_GT(triangles(0.005), whole * 63 / 100);
}

}  // namespace
}  // namespace stillmap
