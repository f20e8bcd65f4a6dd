// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/occupancy.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr int kRayStride = 4;  // every n-th pixel of a view sends a ray
constexpr int kFarViews = 2;   // that must show what only far pixels tell of: one may be wrong
constexpr std::uint8_t kGridOccupied = 0, kGridUnknown = 205,
                       kGridFree = 254;  // as map servers have it

/// Marks voxels on the way from the eye to what it sees, the last one left out.
void cast_ray(const Eigen::Vector3d& eye, const Eigen::Vector3d& end, double edge,
              VoxelIndex& crossed) {
  const Eigen::Vector3d way = end - eye;
  const double length = way.norm() - edge;  // what was hit may lie half a voxel nearer
  const double step = 0.5 * edge;
  for (double s = 0; s < length; s += step) {
    if (const auto voxel = voxel_at(eye + way * (s / way.norm()), edge)) crossed.add(*voxel);
  }
}

void cast_rays(const ViewAtPlace& placed, double edge, VoxelIndex& crossed) {
  const DenseView& view = *placed.view;
  for (int row = 0; row < view.depth.rows; row += kRayStride) {
    for (int col = 0; col < view.depth.cols; col += kRayStride) {
      const double z = view.depth(row, col) * double{DenseView::kDepthUnit};
      if (z <= 0) continue;
      cast_ray(placed.T_world_camera.translation(),
               placed.T_world_camera * view.camera.unproject(col, row, z), edge, crossed);
    }
  }
}

// ---- OctoMap ----------------------------------------------------------------------------------

constexpr int kDepth = 16, kCenter = 1 << (kDepth - 1);

/// Bits of three coordinates interleaved: the way down the tree, three bits a level, x lowest.
std::uint64_t tree_key(const Lattice& lattice) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto c = static_cast<std::uint64_t>(lattice[axis] + kCenter);
    for (int bit = 0; bit < kDepth; ++bit) key |= (c >> bit & 1) << (3 * bit + axis);
  }
  return key;
}

enum class Leaf : std::uint8_t { kUnknown, kFree, kOccupied, kInner };

struct Keyed {
  std::uint64_t key;
  Leaf leaf;
};

/// The tree over sorted leaves, written from the root down as it is made.
class OctreeWriter {
 public:
  explicit OctreeWriter(std::vector<Keyed> leaves) : leaves_(std::move(leaves)) {}

  std::string bytes() {
    if (leaves_.empty()) return {};
    build(0, leaves_.size(), kDepth);
    write(nodes_.size() - 1);
    return std::move(bytes_);
  }
  /// Nodes with the root and the leaves, after bytes().
  std::size_t size() const { return size_; }

 private:
  struct Node {
    std::array<Leaf, 8> kinds{};
    std::array<std::size_t, 8> children{};
  };

  /// What leaves first .. last - 1 amount to, `level` levels above the finest.
  Leaf build(std::size_t first, std::size_t last, int level) {
    if (level == 0) return leaves_[first].leaf;
    Node node;
    for (std::size_t at = first; at < last;) {
      const auto child = leaves_[at].key >> (3 * (level - 1)) & 7;
      std::size_t end = at;
      while (end < last && (leaves_[end].key >> (3 * (level - 1)) & 7) == child) ++end;
      node.kinds[child] = build(at, end, level - 1);
      node.children[child] = nodes_.empty() ? 0 : nodes_.size() - 1;
      at = end;
    }
    const bool uniform = std::all_of(node.kinds.begin(), node.kinds.end(), [&](Leaf kind) {
      return kind == node.kinds[0] && kind != Leaf::kInner && kind != Leaf::kUnknown;
    });
    if (uniform && level < kDepth) return node.kinds[0];
    nodes_.push_back(node);
    return Leaf::kInner;
  }

  /// Two bits a child, the lower first: 1 0 free, 0 1 occupied, 1 1 inner, 0 0 unknown.
  void write(std::size_t number) {
    const Node node = nodes_[number];
    ++size_;
    std::uint16_t bits = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      const Leaf kind = node.kinds[i];
      if (kind == Leaf::kFree || kind == Leaf::kInner) bits |= 1U << (2 * i);
      if (kind == Leaf::kOccupied || kind == Leaf::kInner) bits |= 2U << (2 * i);
      size_ += kind == Leaf::kFree || kind == Leaf::kOccupied;
    }
    bytes_.push_back(static_cast<char>(bits & 0xff));
    bytes_.push_back(static_cast<char>(bits >> 8));
    for (std::size_t i = 0; i < 8; ++i) {
      if (node.kinds[i] == Leaf::kInner) write(node.children[i]);
    }
  }

  std::vector<Keyed> leaves_;
  std::vector<Node> nodes_;
  std::string bytes_;
  std::size_t size_ = 0;
};

// ---- Floor ------------------------------------------------------------------------------------

constexpr std::size_t kFloorSamples = 20000;
constexpr double kOnPlane = 0.03;     // meters
constexpr double kFloorShare = 0.15;  // of the points on the fullest level plane
const double kLargestTilt = std::cos(20 * std::numbers::pi / 180);

std::vector<Eigen::Vector3d> thinned(std::span<const Eigen::Vector3f> points) {
  std::vector<Eigen::Vector3d> some;
  const std::size_t step = std::max<std::size_t>(1, points.size() / kFloorSamples);
  for (std::size_t i = 0; i < points.size(); i += step) some.push_back(points[i].cast<double>());
  return some;
}

std::size_t points_on(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& up,
                      double height) {
  return static_cast<std::size_t>(std::count_if(points.begin(), points.end(), [&](const auto& p) {
    return std::abs(up.dot(p) - height) < kOnPlane;
  }));
}

/// Normal of the level plane with the most points, by RANSAC; `up` where there is none.
Eigen::Vector3d level_normal(const std::vector<Eigen::Vector3d>& points,
                             const Eigen::Vector3d& up) {
  constexpr int kTries = 300;
  std::mt19937_64 random(1);
  Eigen::Vector3d best = up;
  std::size_t most = 0;
  for (int i = 0; i < kTries; ++i) {
    const auto& a = points[random() % points.size()];
    const auto& b = points[random() % points.size()];
    const auto& c = points[random() % points.size()];
    Eigen::Vector3d normal = (b - a).cross(c - a);
    if (normal.norm() < 1e-4) continue;
    normal.normalize();
    if (normal.dot(up) < 0) normal = -normal;
    if (normal.dot(up) < kLargestTilt) continue;
    const std::size_t count = points_on(points, normal, normal.dot(a));
    if (count > most) most = count, best = normal;
  }
  return best;
}

/// The lowest height at which a good share of the points lies.
double lowest_level(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& up) {
  std::map<int, std::size_t> histogram;  // of heights, in bins as thick as a plane
  for (const auto& p : points) ++histogram[static_cast<int>(std::floor(up.dot(p) / kOnPlane))];
  std::size_t most = 0;
  for (const auto& [bin, count] : histogram) most = std::max(most, count);
  for (auto bin = histogram.begin(); bin != histogram.end(); ++bin) {
    if (static_cast<double>(bin->second) < kFloorShare * static_cast<double>(most)) continue;
    const auto next = std::next(bin);  // the plane may lie astride two bins
    const bool higher =
        next != histogram.end() && next->first == bin->first + 1 && next->second > bin->second;
    return ((higher ? next : bin)->first + 0.5) * kOnPlane;
  }
  return 0;
}

/// The plane through the points that lie on it.
Floor refined(const std::vector<Eigen::Vector3d>& points, Floor floor) {
  for (int round = 0; round < 3; ++round) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    std::vector<Eigen::Vector3d> on;
    for (const auto& p : points) {
      if (std::abs(floor.up.dot(p) - floor.height) < kOnPlane) on.push_back(p);
    }
    if (on.size() < 10) break;
    for (const auto& p : on) mean += p;
    mean /= static_cast<double>(on.size());
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (const auto& p : on) moments += (p - mean) * (p - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments);
    Eigen::Vector3d normal = solver.eigenvectors().col(0);
    if (normal.dot(floor.up) < 0) normal = -normal;
    if (normal.dot(floor.up) < kLargestTilt) break;  // a strip is no plane
    floor.up = normal;
    floor.height = normal.dot(mean);
  }
  return floor;
}

// ---- Floor plan -------------------------------------------------------------------------------

struct Column {
  bool occupied = false, free = false, floor = false;
  double low = std::numeric_limits<double>::infinity(), high = -low;  // of what is occupied [m]
};

/// Columns of cells by their coordinates in frame `map`.
using Columns = std::map<std::pair<int, int>, Column>;

Columns columns_of(const OccupiedSpace& space, const OccupancyOptions& options) {
  Columns columns;
  const auto column_at = [&](const Eigen::Vector3d& p) -> Column& {
    return columns[{static_cast<int>(std::floor(p.x() / options.cell)),
                    static_cast<int>(std::floor(p.y() / options.cell))}];
  };
  for (const Voxel voxel : space.occupied) {
    const Eigen::Vector3d p = center_of(voxel, space.edge);
    if (p.z() > options.highest || p.z() < -options.lowest) continue;
    Column& column = column_at(p);
    if (p.z() < options.lowest) {
      column.floor = true;
      continue;
    }
    column.occupied = true;
    column.low = std::min(column.low, p.z() - space.edge / 2);
    column.high = std::max(column.high, p.z() + space.edge / 2);
  }
  for (const Voxel voxel : space.free) {
    const Eigen::Vector3d p = center_of(voxel, space.edge);
    if (p.z() >= options.lowest && p.z() <= options.highest) column_at(p).free = true;
  }
  return columns;
}

OccupancyGrid drawn(const Columns& columns, double cell) {
  OccupancyGrid grid;
  grid.resolution = cell;
  if (columns.empty()) return grid;
  int low_x = std::numeric_limits<int>::max(), low_y = low_x, high_x = -low_x, high_y = -low_x;
  for (const auto& [place, column] : columns) {
    low_x = std::min(low_x, place.first), high_x = std::max(high_x, place.first);
    low_y = std::min(low_y, place.second), high_y = std::max(high_y, place.second);
  }
  grid.origin = {low_x * cell, low_y * cell};
  grid.image = cv::Mat1b(high_y - low_y + 1, high_x - low_x + 1, kGridUnknown);
  for (const auto& [place, column] : columns) {
    std::uint8_t& pixel = grid.image(high_y - place.second, place.first - low_x);
    if (column.free || column.floor) pixel = kGridFree;
    if (column.occupied) pixel = kGridOccupied;
  }
  return grid;
}

std::vector<StaticObstacle> obstacles_in(const Columns& columns, const OccupancyGrid& grid,
                                         double smallest) {
  if (grid.image.empty()) return {};
  cv::Mat1i labels;
  const int count = cv::connectedComponents(grid.image == kGridOccupied, labels, 8, CV_32S);
  std::vector<StaticObstacle> found(static_cast<std::size_t>(count));
  const int low_x = cvRound(grid.origin.x() / grid.resolution);
  const int low_y = cvRound(grid.origin.y() / grid.resolution);
  for (const auto& [place, column] : columns) {
    if (!column.occupied) continue;
    const int label = labels(labels.rows - 1 - (place.second - low_y), place.first - low_x);
    const Eigen::Vector2d corner(place.first * grid.resolution, place.second * grid.resolution);
    const Eigen::Vector2d opposite = corner.array() + grid.resolution;
    auto& box = found[static_cast<std::size_t>(label)].box;
    box.extend(Eigen::Vector3d(corner.x(), corner.y(), column.low));
    box.extend(Eigen::Vector3d(opposite.x(), opposite.y(), column.high));
  }
  std::erase_if(found, [&](const StaticObstacle& obstacle) {
    return obstacle.box.isEmpty() || obstacle.box.sizes().maxCoeff() < smallest;
  });
  const auto area = [](const StaticObstacle& o) { return o.box.sizes().head<2>().prod(); };
  std::stable_sort(found.begin(), found.end(),
                   [&](const auto& a, const auto& b) { return area(a) > area(b); });
  for (std::size_t i = 0; i < found.size(); ++i) found[i].id = static_cast<int>(i + 1);
  return found;
}

}  // namespace

void require_valid(const OccupancyOptions& options) {
  require_voxel_size(options.cell, "dense.occupancy.cell");
  if (options.min_points >= 1 && options.lowest >= 0 && options.highest > options.lowest &&
      options.min_obstacle >= 0) {
    return;
  }
  throw Error("an option is out of range", "dense occupancy",
              "min_points >= 1, 0 <= lowest < highest, min_obstacle >= 0");
}

OccupiedSpace occupied_space(const PlacedMap& placed, const Pose& T_map_world,
                             const OccupancyOptions& options) {
  require_valid(options);
  OccupiedSpace space{.edge = options.cell, .occupied = {}, .free = {}};
  VoxelIndex index;
  std::vector<int> points;
  for (const std::uint32_t cell : placed.cells) {
    if (placed.grid->is_far(cell) && placed.grid->cell(cell).views < kFarViews) continue;
    const auto voxel = voxel_at(T_map_world * placed.grid->mean(cell).cast<double>(), options.cell);
    if (!voxel) continue;
    const std::uint32_t number = index.add(*voxel);
    points.resize(index.size(), 0);
    ++points[number];
  }
  VoxelIndex crossed;
  for (const ViewAtPlace& view : placed.views) {
    cast_rays({view.view, T_map_world * view.T_world_camera}, options.cell, crossed);
  }
  for (const std::uint32_t i : index.sorted()) {
    if (points[i] >= options.min_points) space.occupied.push_back(index.voxel(i));
  }
  for (const std::uint32_t i : crossed.sorted()) {
    const std::uint32_t number = index.find(crossed.voxel(i));
    const bool taken = number != VoxelIndex::kNone && points[number] >= options.min_points;
    if (!taken) space.free.push_back(crossed.voxel(i));
  }
  return space;
}

std::string octomap_bytes(const OccupiedSpace& space) {
  std::vector<Keyed> leaves;
  const auto add = [&](const std::vector<Voxel>& voxels, Leaf leaf) {
    for (const Voxel voxel : voxels) {
      const Lattice lattice = lattice_of(voxel);
      if ((lattice.array() < -kCenter).any() || (lattice.array() >= kCenter).any()) {
        throw Error("the map is too wide for an OctoMap of this resolution", "octomap",
                    "set dense.occupancy.cell higher");
      }
      leaves.push_back({tree_key(lattice), leaf});
    }
  };
  add(space.occupied, Leaf::kOccupied);
  add(space.free, Leaf::kFree);
  std::sort(leaves.begin(), leaves.end(),
            [](const Keyed& a, const Keyed& b) { return a.key < b.key; });
  OctreeWriter writer(std::move(leaves));
  const std::string data = writer.bytes();
  return fmt::format(
             "# Octomap OcTree binary file\n# made by stillmap; meters, frame map: z up from the "
             "floor\nid OcTree\n"
             "size {}\nres {}\ndata\n",
             writer.size(), space.edge) +
         data;
}

std::optional<Floor> find_floor(std::span<const Eigen::Vector3f> points,
                                const Eigen::Vector3d& up) {
  constexpr std::size_t kLeast = 100;
  const std::vector<Eigen::Vector3d> some = thinned(points);
  if (some.size() < kLeast || !(up.norm() > 0)) return std::nullopt;
  Floor floor;
  floor.up = level_normal(some, up.normalized());
  floor.height = lowest_level(some, floor.up);
  floor = refined(some, floor);
  for (const Eigen::Vector3f& p : points) {
    floor.points += std::abs(floor.up.dot(p.cast<double>()) - floor.height) < kOnPlane;
  }
  return floor.points >= kLeast ? std::optional(floor) : std::nullopt;
}

Pose map_frame(const Floor& floor, const Pose& T_world_camera) {
  const Eigen::Matrix3d R_camera = T_world_camera.rotation();
  const auto level = [&](const Eigen::Vector3d& v) {
    return Eigen::Vector3d(v - floor.up.dot(v) * floor.up);
  };
  Eigen::Vector3d ahead = level(R_camera.col(2));
  if (ahead.norm() < 0.2) ahead = level(-R_camera.col(1));  // it looks straight down, or up
  Eigen::Matrix3d R_map_world;
  R_map_world.row(0) = ahead.normalized();
  R_map_world.row(2) = floor.up;
  R_map_world.row(1) = floor.up.cross(ahead.normalized());
  const Eigen::Vector3d& eye = T_world_camera.translation();
  const Eigen::Vector3d below = eye - (floor.up.dot(eye) - floor.height) * floor.up;
  return {R_map_world, -(R_map_world * below)};
}

FloorPlan floor_plan(const OccupiedSpace& space, const OccupancyOptions& options) {
  require_valid(options);
  const Columns columns = columns_of(space, options);
  FloorPlan plan{.grid = drawn(columns, options.cell), .obstacles = {}};
  plan.obstacles = obstacles_in(columns, plan.grid, options.min_obstacle);
  return plan;
}

std::string grid_pgm(const OccupancyGrid& grid) {
  std::string bytes = fmt::format("P5\n{} {}\n255\n", grid.image.cols, grid.image.rows);
  for (const std::uint8_t pixel : grid.image) bytes.push_back(static_cast<char>(pixel));
  return bytes;
}

std::string grid_yaml(const OccupancyGrid& grid, const std::string& image_name,
                      const Pose& T_map_world) {
  const Eigen::Quaterniond& q = T_map_world.quaternion();
  const Eigen::Vector3d& t = T_map_world.translation();
  return fmt::format(
      "image: {}\nresolution: {}\norigin: [{:.6f}, {:.6f}, 0.0]\nnegate: 0\n"
      "occupied_thresh: 0.65\nfree_thresh: 0.196\nmode: trinary\n"
      "# frame map in the trajectory's world: T_map_world as tx ty tz qx qy qz qw\n"
      "# T_map_world: {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
      image_name, grid.resolution, grid.origin.x(), grid.origin.y(), t.x(), t.y(), t.z(), q.x(),
      q.y(), q.z(), q.w());
}

}  // namespace stillmap
