// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/seen_again.hpp"

#include "stillmap/dense/projected_points.hpp"

#include <cstdint>
#include <utility>

namespace stillmap {
namespace {

/// Largest ratio of the depths of a point in a newer and an earlier view for the earlier one, which
/// is sharper, to be replaced.
constexpr float kCoarser = 1.5F;

/// The pixels of a view with a depth, as points.
struct PixelPoints {
  std::vector<Eigen::Vector3f> points;  // world frame [m]
  std::vector<cv::Point> pixels;
  std::vector<float> largest;  // depth in a newer view that shows them as sharply [m]
};

PixelPoints points_of(const PosedView& posed) {
  const PlacedView placed(*posed.view, posed.T_world_camera);
  PixelPoints result;
  for (int row = 0; row < posed.view->depth.rows; ++row) {
    for (int col = 0; col < posed.view->depth.cols; ++col) {
      if (posed.view->depth(row, col) == 0) continue;
      result.points.emplace_back(placed.point(row, col).cast<float>());
      result.pixels.emplace_back(col, row);
      result.largest.push_back(kCoarser * static_cast<float>(placed.depth(row, col)));
    }
  }
  return result;
}

/// The color stays: maps are compared by the images of their views.
void erase_surface(DenseView& view, cv::Point pixel) {
  view.depth(pixel) = 0;
  view.kind(pixel) = kNoSurface;
}

bool shows_surface(const DenseView& view, cv::Point pixel) {
  return view.kind(pixel) != kNoSurface && view.kind(pixel) != kMoverSurface;
}

}  // namespace

void NewerViews::add(const PosedView& view, bool refutes) {
  newer_.push_back({PlacedView(*view.view, view.T_world_camera), view.T_world_camera, refutes});
  view.view->drop_pages();
}

RestOfView NewerViews::rest_of(const PosedView& earlier) const {
  struct Votes {
    int shown = 0, through = 0;
  };
  const PixelPoints at = points_of(earlier);
  const PointGroups groups(at.points);
  std::vector<Votes> votes(at.points.size());
  for (const auto& [newer, T_world_camera, refutes] : newer_) {
    groups.for_each_in(ViewProjection({&newer.view(), T_world_camera}), all_threads(),
                       [&](std::size_t i, const ProjectedPoint& p) {
                         const std::size_t place = groups.place(i);
                         const Eigen::Vector3f p_camera = newer.in_camera(groups.point(i));
                         if (p.z <= at.largest[place]) votes[place].shown += newer.shows(p_camera);
                         if (refutes)
                           votes[place].through += newer.at(p_camera) == VoxelVote::kSeenThrough;
                       });
    newer.view().drop_pages();
  }
  RestOfView rest{copy_of(*earlier.view)};
  earlier.view->drop_pages();
  for (std::size_t i = 0; i < votes.size(); ++i) {
    if (votes[i].through >= kRefuting) erase_surface(rest.view, at.pixels[i]);
    rest.surfaces += votes[i].shown < kEnough && shows_surface(rest.view, at.pixels[i]);
  }
  return rest;
}

}  // namespace stillmap
