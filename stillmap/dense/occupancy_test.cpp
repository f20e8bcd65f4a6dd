// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/occupancy.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/dense/synthetic_frame.hpp"

#include <algorithm>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

// A world as the first camera has it: x right, y down. The floor is 1.2 m below, a wall 3 m ahead,
// and a box of 40 cm with its front 2 m ahead stands on the floor.
constexpr double kFloorY = 1.2, kWallZ = 3, kBoxFront = 2, kBoxTop = 0.8;
const Pose kCamera(so3_exp({-0.35, 0, 0}), {0, 0, 0});  // looks down a little

double depth_at(int u, int v) {
  const Eigen::Vector3d ray = kCamera.quaternion() * small_camera().unproject(u, v, 1);
  double s = kWallZ / ray.z();
  if (ray.y() > 0) s = std::min(s, kFloorY / ray.y());
  const Eigen::Vector3d front = ray * (kBoxFront / ray.z());
  if (std::abs(front.x()) < 0.2 && front.y() > kBoxTop && front.y() < kFloorY) {
    s = std::min(s, kBoxFront / ray.z());
  }
  const Eigen::Vector3d top = ray * (kBoxTop / ray.y());
  if (ray.y() > 0 && std::abs(top.x()) < 0.2 && top.z() > kBoxFront && top.z() < kBoxFront + 0.4) {
    s = std::min(s, kBoxTop / ray.y());
  }
  return s;  // camera depth: the ray has z = 1 in the camera's frame
}

struct Made {
  ComposedCloud cloud;
  Floor floor;
  Pose T_map_world;
  OccupiedSpace space;
  FloorPlan plan;
};

Made made() {
  DenseOptions options;
  options.back_projection.stride = 1;
  DenseMap map(small_camera(), options);
  map.add(0, frame_of(small_camera(), depth_at), {});
  const PlacedMap placed = map.place([](std::uint64_t) { return std::optional(kCamera); });
  Made result;
  result.cloud = cloud_of(placed, {});
  result.floor = find_floor(result.cloud.cloud.points, {0.1, -1, 0.05}).value();
  result.T_map_world = map_frame(result.floor, kCamera);
  result.space = occupied_space(placed, result.T_map_world);
  result.plan = floor_plan(result.space);
  return result;
}

TEST(Occupancy, FindsTheFloor) {
  const Made m = made();
  EXPECT_LT((m.floor.up - Eigen::Vector3d(0, -1, 0)).norm(), 5e-3);
  EXPECT_NEAR(m.floor.height, -kFloorY, 5e-3);
  EXPECT_GT(m.floor.points, 1000U);
}

TEST(Occupancy, FindsNoFloorInAWall) {
  std::vector<Eigen::Vector3f> wall;
  for (int i = 0; i < 10000; ++i) {
    wall.emplace_back(0.01F * static_cast<float>(i % 100), 0.01F * static_cast<float>(i / 100), 2);
  }
  const auto floor = find_floor(wall, {0, -1, 0});
  // At best the lowest strip of it, which is no floor to speak of.
  EXPECT_LT(floor ? floor->points : 0, 800U);
  EXPECT_FALSE(find_floor({}, {0, -1, 0}));
}

TEST(Occupancy, PutsTheMapOnTheFloorBelowTheCamera) {
  const Made m = made();
  EXPECT_LT((m.T_map_world * Eigen::Vector3d(0, 0, 0) - Eigen::Vector3d(0, 0, kFloorY)).norm(),
            0.01);
  EXPECT_LT((m.T_map_world * Eigen::Vector3d(0, kFloorY, 2) - Eigen::Vector3d(2, 0, 0)).norm(),
            0.01);
  EXPECT_LT((m.T_map_world * Eigen::Vector3d(1, kFloorY, 0) - Eigen::Vector3d(0, -1, 0)).norm(),
            0.01);
}

// Value of the grid at a place of frame `map`.
int value_at(const OccupancyGrid& grid, double x, double y) {
  const int col = static_cast<int>(std::floor((x - grid.origin.x()) / grid.resolution));
  const int row =
      grid.image.rows - 1 - static_cast<int>(std::floor((y - grid.origin.y()) / grid.resolution));
  const bool inside = row >= 0 && col >= 0 && row < grid.image.rows && col < grid.image.cols;
  return inside ? grid.image(row, col) : 205;
}

TEST(Occupancy, TellsOccupiedFromFreeAndUnknown) {
  const OccupancyGrid grid = made().plan.grid;
  EXPECT_EQ(value_at(grid, 2.02, 0.0), 0);    // the box's front
  EXPECT_EQ(value_at(grid, 3.02, 0.6), 0);    // the wall
  EXPECT_EQ(value_at(grid, 1.5, 0.0), 254);   // floor before the box
  EXPECT_EQ(value_at(grid, 1.8, 0.6), 254);   // floor beside it
  EXPECT_EQ(value_at(grid, 4.0, 0.0), 205);   // behind the wall
  EXPECT_EQ(value_at(grid, -1.0, 0.0), 205);  // behind the camera
}

TEST(Occupancy, MeasuresTheBoxAsAnObstacle) {
  const Made m = made();
  const auto is_box = [](const StaticObstacle& o) {
    return o.box.contains(Eigen::Vector3d(2.02, 0, 0.25)) && o.box.sizes().y() < 0.6;
  };
  const auto found = std::find_if(m.plan.obstacles.begin(), m.plan.obstacles.end(), is_box);
  ASSERT_NE(found, m.plan.obstacles.end());
  EXPECT_NEAR(found->box.sizes().y(), 0.4, 0.11);  // two cells
  EXPECT_NEAR(found->box.max().z(), kFloorY - kBoxTop, 0.06);
}

TEST(Occupancy, WritesWhatMapServersRead) {
  const Made m = made();
  const std::string pgm = grid_pgm(m.plan.grid);
  const std::string head = "P5\n" + std::to_string(m.plan.grid.image.cols) + " " +
                           std::to_string(m.plan.grid.image.rows) + "\n255\n";
  EXPECT_EQ(pgm.substr(0, head.size()), head);
  EXPECT_EQ(pgm.size(), head.size() + m.plan.grid.image.total());
  const std::string yaml = grid_yaml(m.plan.grid, "grid.pgm", m.T_map_world);
  for (const char* key : {"image: grid.pgm\n", "resolution: 0.05\n", "origin: [", "negate: 0\n",
                          "occupied_thresh: 0.65\n", "free_thresh: 0.196\n"}) {
    EXPECT_NE(yaml.find(key), std::string::npos) << key;
  }
}

// Reads the tree of a .bt file: what its leaves say of each of the finest voxels.
class TreeReader {
 public:
  explicit TreeReader(const std::string& file) : data_(file.substr(file.find("data\n") + 5)) {
    ++nodes;
    read(Lattice::Constant(-32768), 32768);
  }
  std::set<std::tuple<int, int, int>> occupied, free;
  std::size_t nodes = 0;
  bool whole() const { return at_ == data_.size(); }

 private:
  void read(const Lattice& corner, int half) {
    const auto byte = [&] {
      return static_cast<unsigned>(static_cast<unsigned char>(data_.at(at_++)));
    };
    const unsigned low = byte(), bits = low | byte() << 8;
    for (int i = 0; i < 8; ++i) {
      const Lattice child = corner + half * Lattice(i & 1, i >> 1 & 1, i >> 2 & 1);
      const unsigned kind = bits >> (2 * i) & 3;
      nodes += kind != 0;
      if (kind == 3) read(child, half / 2);
      if (kind == 1) fill(free, child, half);
      if (kind == 2) fill(occupied, child, half);
    }
  }
  static void fill(std::set<std::tuple<int, int, int>>& set, const Lattice& corner, int side) {
    for (int x = 0; x < side; ++x) {
      for (int y = 0; y < side; ++y) {
        for (int z = 0; z < side; ++z) set.emplace(corner.x() + x, corner.y() + y, corner.z() + z);
      }
    }
  }
  std::string data_;
  std::size_t at_ = 0;
};

TEST(Occupancy, WritesAnOctoMapThatHoldsTheSpace) {
  OccupiedSpace space{.edge = 0.05, .occupied = {}, .free = {}};
  std::set<Voxel> occupied, free;
  std::mt19937 random(1);
  std::uniform_int_distribution<int> place(-20, 20);
  for (int i = 0; i < 500; ++i)
    occupied.insert(voxel_of({place(random), place(random), place(random)}));
  for (int x = 0; x < 16; ++x) {  // a block that will be pruned, astride nothing
    for (int y = 0; y < 16; ++y) {
      for (int z = 32; z < 48; ++z) free.insert(voxel_of({x, y, z}));
    }
  }
  space.occupied.assign(occupied.begin(), occupied.end());
  space.free.assign(free.begin(), free.end());
  const std::string file = octomap_bytes(space);
  EXPECT_EQ(file.substr(0, 30), "# Octomap OcTree binary file\n#");
  const TreeReader tree(file);
  EXPECT_TRUE(tree.whole());
  EXPECT_EQ(tree.occupied.size(), occupied.size());
  EXPECT_EQ(tree.free.size(), free.size());
  for (const Voxel voxel : occupied) {
    const Lattice l = lattice_of(voxel);
    EXPECT_TRUE(tree.occupied.contains({l.x(), l.y(), l.z()}));
  }
  EXPECT_NE(file.find("\nsize " + std::to_string(tree.nodes) + "\n"), std::string::npos);
  EXPECT_LT(file.size(), 500 * 2 * 10 + 200);  // the block is one leaf, not 4096
}

TEST(Occupancy, ChecksItsOptions) {
  EXPECT_THROW(require_valid(OccupancyOptions{.cell = 0}), Error);
  EXPECT_THROW(require_valid(OccupancyOptions{.lowest = 1, .highest = 1}), Error);
}

}  // namespace
}  // namespace stillmap
