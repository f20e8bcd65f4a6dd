// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/recent_views.hpp"

#include "stillmap/geometry/depth_visibility.hpp"
#include "stillmap/motion/mover_regions.hpp"

namespace stillmap {
namespace {

/// Number of views, and the shortest time between two of them [s].
constexpr std::size_t kViews = 10;
constexpr double kViewInterval = 0.2;
/// Minimum depth of a point that is looked up in a view [m].
constexpr double kNearest = 0.1;
/// Number of points of an object that are looked up at least, if it has as many.
constexpr std::size_t kEnoughPoints = 200;

struct Observation {
  Visibility visibility = Visibility::kUnknown;
  bool moves = false;  ///< Whether the surface at the point moves.
};

/// Returns the visibility of a point: on the surface if one of the nine cells around it shows a
/// surface there, seen through if all nine do, else unknown.
Observation observe(const CellView& view, const Eigen::Vector3d& p_world) {
  const Eigen::Vector3d p = view.T_camera_world * p_world;
  const cv::Mat1f& depth = view.cells->depth;
  const auto pixel = DepthView{depth, view.cells->camera}.inner_pixel(p, kNearest);
  if (!pixel) return {};
  const double tolerance = object_depth_step(view.cells->camera).at(p.z()) / 2;
  bool free = true;
  for (int y = pixel->y - 1; y <= pixel->y + 1; ++y) {
    for (int x = pixel->x - 1; x <= pixel->x + 1; ++x) {
      const Visibility visibility = visibility_of(p.z(), double{depth(y, x)}, tolerance);
      if (visibility == Visibility::kOnSurface) return {visibility, view.moves(y, x) != 0};
      free = free && visibility == Visibility::kSeenThrough;
    }
  }
  return {free ? Visibility::kSeenThrough : Visibility::kUnknown};
}

}  // namespace

void RecentViews::add(CellView view) {
  if (!views_.empty() && view.timestamp < views_.back().timestamp + kViewInterval) return;
  views_.push_back(std::move(view));
  if (views_.size() > kViews) views_.pop_front();
}

void RecentViews::move(const Pose& T_corrected_world) {
  const Pose T_world_corrected = T_corrected_world.inverse();
  for (CellView& view : views_) view.T_camera_world = view.T_camera_world * T_world_corrected;
}

bool RecentViews::was_static(const Eigen::Vector3d& p_world) const {
  int votes = 0;
  for (const CellView& view : views_) {
    const auto [visibility, moves] = observe(view, p_world);
    if (visibility == Visibility::kUnknown) continue;
    votes += visibility == Visibility::kOnSurface && !moves ? 1 : -1;
  }
  return votes > 0;
}

bool RecentViews::was_free(const std::vector<Eigen::Vector3d>& points,
                           const Pose& T_world_camera) const {
  const std::size_t step = 1 + points.size() / kEnoughPoints;
  int votes = 0;
  for (const CellView& view : views_) {
    for (std::size_t i = 0; i < points.size(); i += step) {
      const Visibility visibility = observe(view, T_world_camera * points[i]).visibility;
      if (visibility == Visibility::kUnknown) continue;
      votes += visibility == Visibility::kSeenThrough ? 1 : -1;
    }
  }
  return votes > 0;
}

}  // namespace stillmap
