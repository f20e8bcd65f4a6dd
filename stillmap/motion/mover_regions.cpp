// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/mover_regions.hpp"

#include "stillmap/base/disjoint_sets.hpp"
#include "stillmap/geometry/trimmed_box.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Neighboring cells belong to one object while their depths differ by less than five standard
/// deviations of a reading plus a step within an object, such as from an arm to the trunk [m].
constexpr double kStepSigmas = 5, kStepFloor = 0.12;
/// Minimum number of cells of a piece; fewer are noise.
constexpr std::size_t kMinPieceCells = 4;
/// Minimum share of a piece under an instance that must be in its mask [0..1]: the majority. The
/// cells of an instance reach beyond its mask, so around the few cells of a hidden object's visible
/// part most of them are of the furniture before it or the wall behind it.
constexpr double kMinShareInMask = 0.5;
/// Largest gap, and largest difference of depth, between two pieces of one object that an occluder
/// cuts apart [m].
constexpr double kPieceGap = 0.3;
/// Largest width and length of an object joined from pieces: those of a person [m].
constexpr double kMaxJoinedWidth = 0.7, kMaxJoinedLength = 2.2;
/// Share of the points cut off on each side of an axis as flying pixels [0..1].
constexpr double kFlyingShare = 0.02;

bool same_object(const MoverGrid& grid, cv::Point a, cv::Point b) {
  const float depth_a = grid.depth(a), depth_b = grid.depth(b);
  if (depth_a == 0 || depth_b == 0) return false;
  if (grid.instance(a) != grid.instance(b)) return false;
  const double depth = std::min(depth_a, depth_b);
  return std::abs(depth_a - depth_b) < grid.depth_step.at(depth);
}

std::vector<MoverRegion> connected_regions(const MoverGrid& grid) {
  const int width = grid.depth.cols, height = grid.depth.rows;
  const auto number = [&](cv::Point p) { return static_cast<std::size_t>(p.y * width + p.x); };
  DisjointSets sets(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const cv::Point here(x, y);
      if (grid.depth(here) == 0) continue;
      for (const cv::Point step :
           {cv::Point(1, 0), cv::Point(0, 1), cv::Point(2, 0), cv::Point(0, 2)}) {
        const cv::Point there = here + step;
        if (there.x < width && there.y < height && same_object(grid, here, there))
          sets.unite(number(here), number(there));
      }
    }
  }
  std::map<std::size_t, MoverRegion> regions;  // by their first cell
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float z = grid.depth(y, x);
      if (z == 0) continue;
      MoverRegion& region = regions[sets.root(number({x, y}))];
      region.cells.emplace_back(x, y);
      region.points.push_back(grid.camera().unproject(x, y, z));
    }
  }
  std::vector<MoverRegion> result;
  for (auto& [first, region] : regions) {
    if (region.cells.size() >= kMinPieceCells) result.push_back(std::move(region));
  }
  return result;
}

/// Returns whether two regions may be pieces of one object.
bool may_join(const MoverRegion& a, const MoverRegion& b, int instance_a, int instance_b) {
  const bool named = instance_a != kNoInstance && instance_b != kNoInstance;
  if (named && instance_a != instance_b) return false;
  if (std::abs(a.box.center().z() - b.box.center().z()) > kPieceGap) return false;
  if (named) return true;
  if (a.box.exteriorDistance(b.box) > kPieceGap) return false;
  const Eigen::Vector3d size = a.box.merged(b.box).sizes();
  return std::min(size.x(), size.y()) <= kMaxJoinedWidth &&
         std::max(size.x(), size.y()) <= kMaxJoinedLength;
}

void absorb(MoverRegion& whole, MoverRegion& piece) {
  whole.cells.insert(whole.cells.end(), piece.cells.begin(), piece.cells.end());
  whole.points.insert(whole.points.end(), piece.points.begin(), piece.points.end());
  whole.box.extend(piece.box);
  piece.cells.clear();
  piece.points.clear();
}

/// Joins pieces until no two are left that may be joined.
void join_pieces(std::vector<MoverRegion>& regions, const MoverGrid& grid) {
  std::vector<int> instance;
  for (MoverRegion& region : regions) {
    region.box = box_without_flying_pixels(region.points);
    instance.push_back(cover_of(region, grid).instance);
  }
  for (bool joined = true; joined;) {
    joined = false;
    for (std::size_t i = 0; i < regions.size(); ++i) {
      for (std::size_t k = i + 1; k < regions.size(); ++k) {
        if (regions[i].cells.empty() || regions[k].cells.empty()) continue;
        if (!may_join(regions[i], regions[k], instance[i], instance[k])) continue;
        absorb(regions[i], regions[k]);
        instance[i] = std::max(instance[i], instance[k]);
        joined = true;
      }
    }
  }
  std::erase_if(regions, [](const MoverRegion& region) { return region.cells.empty(); });
}

/// Keeps the largest of the regions that one instance covers; the others are background that its
/// mask or box includes.
void keep_largest_pieces(std::vector<MoverRegion>& regions, const MoverGrid& grid) {
  std::map<int, std::size_t> cells_of_largest;
  for (const MoverRegion& region : regions) {
    auto& largest = cells_of_largest[cover_of(region, grid).instance];
    largest = std::max(largest, region.cells.size());
  }
  cells_of_largest[kNoInstance] = 0;
  std::erase_if(regions, [&](const MoverRegion& region) {
    return region.cells.size() < cells_of_largest[cover_of(region, grid).instance];
  });
}

/// Returns the share of a region's cells that are set in a map [0..1].
double share_of(const MoverRegion& region, const cv::Mat1b& map) {
  const auto set = std::count_if(region.cells.begin(), region.cells.end(),
                                 [&](cv::Point cell) { return map(cell) != 0; });
  return static_cast<double>(set) / static_cast<double>(region.cells.size());
}

}  // namespace

DepthPolynomial<double> object_depth_step(const Camera& camera) {
  return camera.depth_sensor.tolerance<double>(kStepSigmas, kStepFloor);
}

InstanceCover cover_of(const MoverRegion& region, const MoverGrid& grid) {
  std::map<int, int> cells_of;
  for (const cv::Point& cell : region.cells) ++cells_of[grid.instance(cell)];
  InstanceCover cover;
  int most = 0;
  for (const auto& [instance, cells] : cells_of) {
    if (instance == kNoInstance || cells <= most) continue;
    most = cells;
    cover = {instance, static_cast<double>(cells) / static_cast<double>(region.cells.size())};
  }
  return cover;
}

double moving_share(const MoverRegion& region, const MoverGrid& grid) {
  return share_of(region, grid.moves);
}

std::vector<MoverRegion> mover_regions(const MoverGrid& grid) {
  std::vector<MoverRegion> regions = connected_regions(grid);
  std::erase_if(regions, [&](const MoverRegion& region) {
    return cover_of(region, grid).instance == kNoInstance
               ? moving_share(region, grid) < kMinMovingShare
               : share_of(region, grid.in_mask) < kMinShareInMask;
  });
  join_pieces(regions, grid);
  keep_largest_pieces(regions, grid);
  return regions;
}

int count_without_depth(const MoverGrid& grid) {
  cv::Mat1i labels;
  const int count = cv::connectedComponents(grid.moves, labels);
  std::vector<int> cells(static_cast<std::size_t>(count), 0);
  std::vector<int> with_depth = cells;
  for (int y = 0; y < labels.rows; ++y) {
    for (int x = 0; x < labels.cols; ++x) {
      const auto label = static_cast<std::size_t>(labels(y, x));
      ++cells[label];
      with_depth[label] += grid.cells.depth(y, x) > 0 ? 1 : 0;
    }
  }
  int result = 0;
  for (std::size_t i = 1; i < cells.size(); ++i)
    result += cells[i] >= kMinMoverCells && 10 * with_depth[i] < cells[i] ? 1 : 0;
  return result;
}

std::size_t flying_pixels(std::size_t points) {
  return std::min(static_cast<std::size_t>(kFlyingShare * static_cast<double>(points)),
                  (points - 1) / 2);
}

Eigen::AlignedBox3d box_without_flying_pixels(const std::vector<Eigen::Vector3d>& points) {
  return trimmed_box(points, flying_pixels(points.size()));
}

cv::Mat1b without_rim(const cv::Mat1b& cells) {
  cv::Mat1b inner;
  cv::erode(cells, inner, cv::Mat::ones(3, 3, CV_8UC1), cv::Point(-1, -1), 1, cv::BORDER_CONSTANT,
            cv::Scalar(255));
  return inner;
}

}  // namespace stillmap
