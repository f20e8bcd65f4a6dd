// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/mover_shape.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Largest half depth of an object, whose far side is not visible: that of a person [m].
constexpr double kMaxHalfDepth = 0.2;
/// Minimum area of a mover's cells, facing the camera [m^2]; chosen on simulated scenes.
constexpr double kMinArea = 0.015;
/// Minimum share of a mover's cells with neighbors of it on all sides [0..1]; chosen on simulated
/// scenes.
constexpr double kMinCore = 0.2;
/// Width of the shadow without depth that an occluder casts for a structured-light sensor [cells].
constexpr int kShadow = 3;

/// Returns the mean of the values without the `cut` smallest and largest ones.
double trimmed_mean(std::vector<double>& values, std::size_t cut) {
  const auto n = static_cast<std::ptrdiff_t>(cut);
  std::nth_element(values.begin(), values.begin() + n, values.end());
  std::nth_element(values.begin() + n, values.end() - 1 - n, values.end());
  const double sum = std::accumulate(values.begin() + n, values.end() - n, 0.0);
  return sum / static_cast<double>(values.size() - 2 * cut);
}

Eigen::Vector3d mean_without_flying_pixels(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [&](const auto& p) { return p(axis); });
    mean(axis) = trimmed_mean(values, flying_pixels(points.size()));
  }
  return mean;
}

/// Returns half the width across the longer image axis of the points [m]: sqrt(3) times their
/// standard deviation, as for evenly spread points.
double half_width(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p.head<2>();
  mean /= static_cast<double>(points.size());
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector2d d = p.head<2>() - mean;
    covariance += d * d.transpose();
  }
  covariance /= static_cast<double>(points.size());
  const double middle = covariance.trace() / 2;
  const double smaller =
      middle - std::hypot((covariance(0, 0) - covariance(1, 1)) / 2, covariance(0, 1));
  return std::sqrt(3 * std::max(0.0, smaller));
}

void measure_position(const MoverRegion& region, const MoverGrid& grid, const Pose& T_world_camera,
                      MoverDetection& detection) {
  std::vector<Eigen::Vector3d> world;
  for (const Eigen::Vector3d& p : region.points) world.push_back(T_world_camera * p);
  const Eigen::Vector3d mean = mean_without_flying_pixels(world);
  const Eigen::AlignedBox3d box = box_without_flying_pixels(world);
  const Eigen::Vector3d ray = (mean - T_world_camera.translation()).normalized();
  const double cell = (mean - T_world_camera.translation()).norm() / grid.camera().fx;
  const double half_depth = std::min(half_width(region.points) + cell, kMaxHalfDepth);
  const Eigen::Vector3d behind = std::numbers::pi / 4 * half_depth * ray;
  detection.surface_mean = mean;
  detection.centroid = mean + behind;
  // A point is the center of its cell, and rims were left out: one cell on all sides is put back.
  detection.surface = {box.min().array() - cell, box.max().array() + cell};
  detection.box = detection.surface.merged(detection.surface.translated(2 * behind));
}

void measure_outline(const MoverRegion& region, const MoverGrid& grid, MoverDetection& detection) {
  const cv::Rect cells = cv::boundingRect(region.cells);
  detection.image_box = {cells.x * kCellSide, cells.y * kCellSide, cells.width * kCellSide,
                         cells.height * kCellSide};
  detection.cut_off = cells.x == 0 || cells.y == 0 || cells.br().x >= grid.depth.cols ||
                      cells.br().y >= grid.depth.rows;
}

/// Returns whether an object may continue beyond one of its cells: the image ends there, or a
/// nearer surface follows, possibly after the cells without depth in its shadow.
bool is_hidden_beyond(const MoverGrid& grid, cv::Point cell, cv::Point step) {
  const cv::Mat1f& depth = grid.cells.depth;
  const cv::Rect image({0, 0}, depth.size());
  const double here = depth(cell);
  for (int i = 1; i <= kShadow; ++i) {
    const cv::Point beyond = cell + i * step;
    if (!image.contains(beyond)) return true;
    const double there = depth(beyond);
    if (there > 0) return there < here - grid.depth_step.at(here);
  }
  return false;
}

/// Returns whether the object may continue beyond most of a region's last cells in a direction.
bool hidden_toward(const MoverRegion& region, const MoverGrid& grid, cv::Point step) {
  std::map<int, cv::Point> last;  // by row or column
  for (const cv::Point& cell : region.cells) {
    const auto [found, first] = last.emplace(step.x != 0 ? cell.y : cell.x, cell);
    if (!first && (cell - found->second).dot(step) > 0) found->second = cell;
  }
  const auto hidden = std::count_if(last.begin(), last.end(), [&](const auto& entry) {
    return is_hidden_beyond(grid, entry.second, step);
  });
  return 2 * static_cast<std::size_t>(hidden) > last.size();
}

void measure_spans(const MoverRegion& region, const MoverGrid& grid, const Pose& T_world_camera,
                   MoverDetection& detection) {
  const Eigen::Vector3d extent = box_without_flying_pixels(region.points).sizes();
  const std::array<cv::Point, 2> steps{cv::Point(1, 0), cv::Point(0, 1)};
  for (int axis = 0; axis < 2; ++axis) {
    VisibleSpan& span = detection.spans[static_cast<std::size_t>(axis)];
    const cv::Point step = steps[static_cast<std::size_t>(axis)];
    span = {T_world_camera.rotation().col(axis), extent(axis), hidden_toward(region, grid, -step),
            hidden_toward(region, grid, step)};
    detection.cut_off |= span.low_hidden || span.high_hidden;
  }
}

/// Returns the area of the cells, facing the camera [m^2].
double area_of(const MoverRegion& region, const MoverGrid& grid) {
  const double side = 1 / grid.camera().fx;
  double area = 0;
  for (const Eigen::Vector3d& p : region.points) area += std::pow(side * p.z(), 2);
  return area;
}

/// Returns the share of a region's cells with cells of it on all sides [0..1], which is small for a
/// strip of background along an outline.
double core_of(const MoverRegion& region, const MoverGrid& grid) {
  cv::Mat1b cells(grid.depth.size(), 0);
  for (const cv::Point& cell : region.cells) cells(cell) = 255;
  const cv::Mat cross = cv::getStructuringElement(cv::MORPH_CROSS, {3, 3});
  cv::morphologyEx(cells, cells, cv::MORPH_CLOSE, cross);  // Holes in the depth are no outline.
  return static_cast<double>(cv::countNonZero(without_rim(cells))) / cv::countNonZero(cells);
}

}  // namespace

void measure_shape(const MoverRegion& region, const MoverGrid& grid, const Pose& T_world_camera,
                   MoverDetection& detection) {
  detection.cells = static_cast<int>(region.cells.size());
  measure_position(region, grid, T_world_camera, detection);
  measure_outline(region, grid, detection);
  measure_spans(region, grid, T_world_camera, detection);
}

bool is_object(const MoverRegion& region, const MoverGrid& grid) {
  return static_cast<int>(region.cells.size()) >= kMinMoverCells &&
         area_of(region, grid) >= kMinArea && core_of(region, grid) >= kMinCore;
}

}  // namespace stillmap
