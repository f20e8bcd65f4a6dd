// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/view_fusion.hpp"

#include "stillmap/base/parallel_for.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/dense/fused_depth.hpp"
#include "stillmap/dense/view_depth_error.hpp"
#include "stillmap/dense/view_pager.hpp"

#include <algorithm>
#include <utility>

namespace stillmap {
namespace {

/// Number of views that a view is averaged with.
constexpr std::size_t kNeighbors = 12;
/// Largest distance of such views, where a turn by a radian counts as two meters [m].
constexpr double kFarthest = 2, kMetersPerRadian = 2;

/// Returns the numbers of the views nearest to a view, the nearest first.
std::vector<std::size_t> nearest_views(const std::vector<PosedView>& views, std::size_t view) {
  const Pose T_camera_world = views[view].T_world_camera.inverse();
  std::vector<std::pair<double, std::size_t>> by_distance;
  for (std::size_t other = 0; other < views.size(); ++other) {
    const Pose between = T_camera_world * views[other].T_world_camera;
    const double distance = between.translation().norm() + kMetersPerRadian * between.angle();
    if (other != view && distance < kFarthest) by_distance.emplace_back(distance, other);
  }
  const std::size_t count = std::min(kNeighbors, by_distance.size());
  std::partial_sort(by_distance.begin(), by_distance.begin() + static_cast<std::ptrdiff_t>(count),
                    by_distance.end());
  std::vector<std::size_t> nearest;
  for (std::size_t i = 0; i < count; ++i) nearest.push_back(by_distance[i].second);
  return nearest;
}

using DepthError = std::optional<SmoothDepthError>;

cv::Mat1w depths_of(const DenseView& view, const DepthError& error) {
  return error ? without_error(view.depth, *error) : view.depth;
}

cv::Mat1f static_depths(const DenseView& view, const DepthError& error) {
  const cv::Mat1w measured = depths_of(view, error);
  cv::Mat1f depths(view.depth.size(), 0.0F);
  for (int row = 0; row < depths.rows; ++row) {
    for (int col = 0; col < depths.cols; ++col) {
      if (view.is_static(row, col)) depths(row, col) = measured(row, col) * DenseView::kDepthUnit;
    }
  }
  return depths;
}

DenseView fused_view(const std::vector<PosedView>& views, std::size_t number,
                     const DepthError& error) {
  DenseView result = copy_of(*views[number].view);
  views[number].view->drop_pages();
  result.depth = depths_of(result, error);
  const Pose T_view_world = views[number].T_world_camera.inverse();
  FusedDepth fused(result);
  for (const std::size_t other : nearest_views(views, number)) {
    const auto& [neighbor, T_world_neighbor] = views[other];
    fused.add(neighbor->camera, static_depths(*neighbor, error), {},
              T_view_world * T_world_neighbor);
    neighbor->drop_pages();
  }
  for (int row = 0; row < result.depth.rows; ++row) {
    for (int col = 0; col < result.depth.cols; ++col) {
      const float depth = fused.at(row, col);
      if (result.is_static(row, col) && depth > 0) result.depth(row, col) = packed_depth(depth);
    }
  }
  return result;
}

}  // namespace

std::vector<std::shared_ptr<const DenseView>> fused_views(const std::vector<PosedView>& views,
                                                          const MemoryLimit& memory) {
  const TraceScope scope("fused views");
  const DepthError error = depth_error_of(views);
  ViewPager pager(memory);
  std::uint64_t bytes_in_memory = 0;
  std::vector<std::shared_ptr<DenseView>> fused(views.size());
  const auto at_once = static_cast<std::size_t>(all_threads());
  for (std::size_t first = 0; first < views.size(); first += at_once) {
    const std::size_t count = std::min(at_once, views.size() - first);
    const auto fuse = [&](std::size_t i) {
      fused[first + i] = std::make_shared<DenseView>(fused_view(views, first + i, error));
    };
    parallel_for(count, all_threads(), [&] { return fuse; });
    for (std::size_t i = first; i < first + count; ++i) {
      const std::size_t bytes = fused[i]->bytes_in_memory();
      if (bytes_in_memory + bytes <= pager.limit() || !pager.page_out(*fused[i]))
        bytes_in_memory += bytes;
      fused[i]->drop_pages();
    }
  }
  return {fused.begin(), fused.end()};
}

}  // namespace stillmap
